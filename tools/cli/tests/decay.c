/* An FMU of FMI 2.0 (Model Exchange): x' = -k x. With CRASH it writes where it may not as soon as k goes below 0.9 of its start. */

#include <stddef.h>
#include <stdlib.h>

typedef struct { double k, x, dx; } Model;

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const void *callbacks, int visible, int logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)callbacks, (void)visible, (void)logging;
    Model *m = calloc(1, sizeof *m);
    m->k = m->x = 1;
    return m;
}
void fmi2FreeInstance(void *m) { free(m); }
int fmi2SetupExperiment(void *c, int d, double t, double a, int s, double b) { return (void)c, (void)d, (void)t, (void)a, (void)s, (void)b, 0; }
int fmi2EnterInitializationMode(void *c) { return (void)c, 0; }
int fmi2ExitInitializationMode(void *c) { return (void)c, 0; }
int fmi2EnterEventMode(void *c) { return (void)c, 0; }
int fmi2EnterContinuousTimeMode(void *c) { return (void)c, 0; }
int fmi2NewDiscreteStates(void *c, int *info) {
    (void)c;
    for (int i = 0; i < 5; i++) info[i] = 0;
    return 0;
}
int fmi2CompletedIntegratorStep(void *c, int n, int *event, int *end) { return (void)c, (void)n, *event = *end = 0, 0; }
int fmi2Terminate(void *c) { return (void)c, 0; }
int fmi2Reset(void *c) {
    Model *m = c;
    m->k = m->x = 1;
    return 0;
}
static double *at(Model *m, unsigned r) { return r == 0 ? &m->x : r == 1 ? &m->dx : &m->k; }
int fmi2GetReal(void *c, const unsigned *r, size_t n, double *v) {
    Model *m = c;
    m->dx = -m->k * m->x;
    for (size_t i = 0; i < n; i++) v[i] = *at(m, r[i]);
    return 0;
}
int fmi2SetReal(void *c, const unsigned *r, size_t n, const double *v) {
    for (size_t i = 0; i < n; i++) *at(c, r[i]) = v[i];
    return 0;
}
int fmi2SetTime(void *c, double t) { return (void)c, (void)t, 0; }
int fmi2SetContinuousStates(void *c, const double *x, size_t n) { return (void)n, ((Model *)c)->x = x[0], 0; }
int fmi2GetContinuousStates(void *c, double *x, size_t n) { return (void)n, x[0] = ((Model *)c)->x, 0; }
int fmi2GetNominalsOfContinuousStates(void *c, double *x, size_t n) { return (void)c, (void)n, x[0] = 1, 0; }
int fmi2GetEventIndicators(void *c, double *z, size_t n) { return (void)c, (void)z, (void)n, 0; }
int fmi2GetDerivatives(void *c, double *dx, size_t n) {
    Model *m = c;
    (void)n;
#ifdef CRASH
    if (m->k < 0.9) *(volatile int *)8 = 1;
#endif
    return dx[0] = -m->k * m->x, 0;
}
