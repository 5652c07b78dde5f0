/* Van der Pol's oscillator with the habits of the Reference FMUs: its outputs are its states, directional derivatives are of the rates
   (and of one more output) only, and anything else that is asked of it is an Error. Each event halves and turns round the second state.
   `FMI` is 2 or 3. */

#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>

typedef struct {
    double t, x[2], mu;
    bool broken, event;
} Oscillator;

/* 0, 2: states, outputs; 1, 3: their rates; 4: mu; 5: x0 x1, output; 6: local, x0 + x1. */
static int get(Oscillator *o, const unsigned r[], size_t n, double v[]) {
    if (o->broken) return 3;
    for (size_t i = 0; i < n; i++) {
        double all[] = {o->x[0], o->x[1], o->x[1], o->mu * (1 - o->x[0] * o->x[0]) * o->x[1] - o->x[0], o->mu,
                        o->x[0] * o->x[1], o->x[0] + o->x[1]};
        if (r[i] > 6) return 3;
        v[i] = all[r[i]];
    }
    return 0;
}
static int set(Oscillator *o, const unsigned r[], size_t n, const double v[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] == 4) o->mu = v[i];
        else return 3;
    }
    return 0;
}
static int directional(Oscillator *o, const unsigned of[], size_t n, const unsigned by[], size_t k, const double seed[], double d[]) {
    double x = o->x[0], v = o->x[1];
    for (size_t i = 0; i < n; i++) {
        d[i] = 0;
        for (size_t j = 0; j < k; j++) {
            if (by[j] != 0 && by[j] != 2) return o->broken = true, 3;
            bool first = by[j] == 0;
            if (of[i] == 1) d[i] += first ? 0 : seed[j];
            else if (of[i] == 3) d[i] += seed[j] * (first ? -2 * o->mu * x * v - 1 : o->mu * (1 - x * x));
            else if (of[i] == 5) d[i] += seed[j] * (first ? v : x);
            else return o->broken = true, 3;
        }
    }
    return 0;
}
static Oscillator *made(void) {
    Oscillator *o = calloc(1, sizeof *o);
    o->x[0] = 2, o->mu = 1;
    return o;
}
static int states(Oscillator *o, double x[]) { return x[0] = o->x[0], x[1] = o->x[1], 0; }
static int put(Oscillator *o, const double x[]) { return o->x[0] = x[0], o->x[1] = x[1], 0; }
static int rates(Oscillator *o, double d[]) { unsigned r[] = {1, 3}; return get(o, r, 2, d); }
static int enter(Oscillator *o) { return o->event = true, 0; }
static bool changed(Oscillator *o) {
    bool due = o->event;
    if (due) o->x[1] *= -0.5;
    return o->event = false, due;
}
static int reset(Oscillator *o) { Oscillator *fresh = made(); *o = *fresh; free(fresh); return 0; }

#if FMI == 2
typedef struct { int again, terminate, nominals, states, defined; double next; } Info;
const char *fmi2GetVersion(void) { return "2.0"; }
const char *fmi2GetTypesPlatform(void) { return "default"; }
void *fmi2Instantiate(const char *n, int k, const char *g, const char *r, const void *c, int v, int l) {
    return (void)n, (void)k, (void)g, (void)r, (void)c, (void)v, (void)l, made();
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int d, double e, double s, int b, double z) { return (void)c, (void)d, (void)e, (void)s, (void)b, (void)z, 0; }
int fmi2EnterInitializationMode(void *c) { return (void)c, 0; }
int fmi2ExitInitializationMode(void *c) { return (void)c, 0; }
int fmi2Terminate(void *c) { return (void)c, 0; }
int fmi2Reset(void *c) { return reset(c); }
int fmi2GetReal(void *c, const unsigned r[], size_t n, double v[]) { return get(c, r, n, v); }
int fmi2SetReal(void *c, const unsigned r[], size_t n, const double v[]) { return set(c, r, n, v); }
int fmi2EnterEventMode(void *c) { return enter(c); }
int fmi2NewDiscreteStates(void *c, Info *e) { return *e = (Info){0}, e->states = changed(c), 0; }
int fmi2EnterContinuousTimeMode(void *c) { return (void)c, 0; }
int fmi2SetTime(void *c, double t) { return ((Oscillator *)c)->t = t, 0; }
int fmi2SetContinuousStates(void *c, const double x[], size_t n) { return (void)n, put(c, x); }
int fmi2GetContinuousStates(void *c, double x[], size_t n) { return (void)n, states(c, x); }
int fmi2GetDerivatives(void *c, double d[], size_t n) { return (void)n, rates(c, d); }
int fmi2GetDirectionalDerivative(void *c, const unsigned of[], size_t n, const unsigned by[], size_t k, const double seed[], double d[]) {
    return directional(c, of, n, by, k, seed, d);
}
#else
#include <stdint.h>
const char *fmi3GetVersion(void) { return "3.0"; }
void *fmi3InstantiateModelExchange(const char *n, const char *t, const char *r, bool v, bool l, void *e, void *log) {
    return (void)n, (void)t, (void)r, (void)v, (void)l, (void)e, (void)log, made();
}
void fmi3FreeInstance(void *c) { free(c); }
int fmi3EnterInitializationMode(void *c, bool d, double e, double s, bool b, double z) { return (void)c, (void)d, (void)e, (void)s, (void)b, (void)z, 0; }
int fmi3ExitInitializationMode(void *c) { return (void)c, 0; }
int fmi3Terminate(void *c) { return (void)c, 0; }
int fmi3Reset(void *c) { return reset(c); }
int fmi3GetFloat64(void *c, const uint32_t r[], size_t n, double v[], size_t k) { return (void)k, get(c, r, n, v); }
int fmi3SetFloat64(void *c, const uint32_t r[], size_t n, const double v[], size_t k) { return (void)k, set(c, r, n, v); }
int fmi3EnterEventMode(void *c) { return enter(c); }
int fmi3UpdateDiscreteStates(void *c, bool *again, bool *end, bool *nominals, bool *states, bool *defined, double *next) {
    return *again = *end = *nominals = *defined = false, *next = 0, *states = changed(c), 0;
}
int fmi3EnterContinuousTimeMode(void *c) { return (void)c, 0; }
int fmi3SetTime(void *c, double t) { return ((Oscillator *)c)->t = t, 0; }
int fmi3SetContinuousStates(void *c, const double x[], size_t n) { return (void)n, put(c, x); }
int fmi3GetContinuousStates(void *c, double x[], size_t n) { return (void)n, states(c, x); }
int fmi3GetContinuousStateDerivatives(void *c, double d[], size_t n) { return (void)n, rates(c, d); }
int fmi3GetNumberOfContinuousStates(void *c, size_t *n) { return (void)c, *n = 2, 0; }
int fmi3GetNumberOfEventIndicators(void *c, size_t *n) { return (void)c, *n = 0, 0; }
int fmi3GetDirectionalDerivative(void *c, const uint32_t of[], size_t n, const uint32_t by[], size_t k, const double seed[], size_t ns, double d[], size_t nd) {
    return (void)ns, (void)nd, directional(c, of, n, by, k, seed, d);
}
#endif
