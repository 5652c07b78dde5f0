/* A geared joint as somebody else writes it, FMI 2.0 Model Exchange: torque in N.m, states motor and link, dry friction of the motor that
   sticks. No directional derivatives, all parameters fixed, no FMU state. No header of FMI is needed. */
#include <math.h>
#include <stdlib.h>

enum { TAU, EXT, PHI, W, Q, V, JM, JL, C, D, FC, B, N, PHI0, W0, Q0, V0, ALL };
typedef struct { double r[ALL], t; int mode; } M;
typedef unsigned Ref;
typedef struct { int again, terminate, nominals, values, defined; double next; } Info;

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(void *m, int on, size_t n, const char *const *c) { return 0; }
int fmi2Reset(M *m) {
    const double r[ALL] = {0, 0, 0, 0, 0, 0, 2e-5, 0.5, 0.3, 4e-4, 0.02, 3e-5, 100};
    for (int i = 0; i < ALL; i++) m->r[i] = r[i];
    m->t = 0;
    return 0;
}
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *folder, const void *f, int visible, int on) {
    M *m = calloc(1, sizeof(M));
    fmi2Reset(m);
    return m;
}
void fmi2FreeInstance(void *m) { free(m); }
int fmi2SetupExperiment(M *m, int d, double tolerance, double start, int s, double stop) { m->t = start; return 0; }
/* Torque on the motor beside its friction; on the motor's side. */
static double spring(const double *r) { return r[C] * (r[PHI] - r[N] * r[Q]) + r[D] * (r[W] - r[N] * r[V]); }
static double drive(const double *r) { return r[TAU] - spring(r) - r[B] * r[W]; }
static void settle(M *m) {
    double *w = &m->r[W];
    if (m->mode && *w * m->mode <= 0) m->mode = 0, *w = 0;
    if (!m->mode && *w) m->mode = *w > 0 ? 1 : -1;
    if (!m->mode && fabs(drive(m->r)) > m->r[FC]) m->mode = drive(m->r) > 0 ? 1 : -1;
}
int fmi2EnterInitializationMode(void *m) { return 0; }
int fmi2ExitInitializationMode(M *m) {
    for (int i = 0; i < 4; i++) m->r[PHI + i] = m->r[PHI0 + i];
    m->mode = 0;
    settle(m);
    return 0;
}
int fmi2Terminate(void *m) { return 0; }
int fmi2EnterEventMode(void *m) { return 0; }
int fmi2NewDiscreteStates(M *m, Info *info) {
    double before = m->r[W];
    settle(m);
    *info = (Info){0, 0, 0, before != m->r[W], 0, 0};
    return 0;
}
int fmi2EnterContinuousTimeMode(void *m) { return 0; }
int fmi2CompletedIntegratorStep(void *m, int no, int *event, int *terminate) { *event = *terminate = 0; return 0; }
int fmi2SetTime(M *m, double t) { m->t = t; return 0; }
int fmi2SetContinuousStates(M *m, const double *x, size_t n) { for (size_t i = 0; i < n; i++) m->r[PHI + i] = x[i]; return 0; }
int fmi2GetContinuousStates(M *m, double *x, size_t n) { for (size_t i = 0; i < n; i++) x[i] = m->r[PHI + i]; return 0; }
int fmi2GetNominalsOfContinuousStates(M *m, double *x, size_t n) { for (size_t i = 0; i < n; i++) x[i] = 1; return 0; }
int fmi2GetDerivatives(M *m, double *dx, size_t n) {
    const double *r = m->r;
    dx[0] = m->mode ? r[W] : 0;
    dx[1] = m->mode ? (drive(r) - m->mode * r[FC]) / r[JM] : 0;
    dx[2] = r[V];
    dx[3] = (r[N] * spring(r) + r[EXT]) / r[JL];
    return 0;
}
int fmi2GetEventIndicators(M *m, double *z, size_t n) {
    z[0] = m->mode ? m->mode * m->r[W] + 1e-9 : m->r[FC] - fabs(drive(m->r));
    return 0;
}
int fmi2GetReal(M *m, const Ref *v, size_t n, double *x) { for (size_t i = 0; i < n; i++) x[i] = m->r[v[i]]; return 0; }
int fmi2SetReal(M *m, const Ref *v, size_t n, const double *x) { for (size_t i = 0; i < n; i++) m->r[v[i]] = x[i]; return 0; }

#define NONE(name) int name(void) { return 3; }
NONE(fmi2GetInteger) NONE(fmi2GetBoolean) NONE(fmi2GetString) NONE(fmi2SetInteger) NONE(fmi2SetBoolean) NONE(fmi2SetString)
NONE(fmi2GetFMUstate) NONE(fmi2SetFMUstate) NONE(fmi2FreeFMUstate) NONE(fmi2SerializedFMUstateSize) NONE(fmi2SerializeFMUstate)
NONE(fmi2DeSerializeFMUstate) NONE(fmi2GetDirectionalDerivative)
