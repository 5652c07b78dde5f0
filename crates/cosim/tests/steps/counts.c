/* An FMU that tells how it was called. With `kind` 0 it makes one sample of its law per doStep, whatever the step is, as a discrete
   controller; with 1 whole internal steps of `internal` s, and drops what is left, as a solver of its own. Its law is that of a
   filter, y += gain (u - y). -DFMI=2 or 3. */

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { OK, WARNING, DISCARD, ERROR };
enum { Y, CALLS, SHORTEST, LONGEST, COVERED, REST, U, D, KIND, INTERNAL, GAIN, VARIABLES };

typedef struct {
    double v[VARIABLES];
} Instance;

static Instance *made(void) {
    Instance *i = calloc(1, sizeof *i);
    if (i) i->v[INTERNAL] = 0.01, i->v[GAIN] = 0.25, i->v[SHORTEST] = 1e9;
    return i;
}

static void stepped(Instance *i, double h) {
    double *v = i->v, n = v[KIND] == 0 ? 1 : floor(h / v[INTERNAL] + 1e-6);
    for (double k = 0; k < n; k++) v[Y] += v[GAIN] * (v[U] + v[D] - v[Y]);
    double rest = fabs(h / v[INTERNAL] - round(h / v[INTERNAL]));
    v[CALLS] += 1;
    v[SHORTEST] = fmin(v[SHORTEST], h), v[LONGEST] = fmax(v[LONGEST], h);
    v[COVERED] += h, v[REST] = fmax(v[REST], rest);
}

static int get(const Instance *i, const unsigned r[], size_t n, double v[]) {
    for (size_t k = 0; k < n; k++) v[k] = i->v[r[k]];
    return OK;
}
static int set(Instance *i, const unsigned r[], size_t n, const double v[]) {
    for (size_t k = 0; k < n; k++) i->v[r[k]] = v[k];
    return OK;
}
static int save(const Instance *i, void **state) {
    if (!*state) *state = malloc(sizeof *i);
    if (!*state) return ERROR;
    *(Instance *)*state = *i;
    return OK;
}
/* The counts are what was asked for, also of steps that were taken back. */
static int restore(Instance *i, const void *state) {
    Instance now = *i;
    *i = *(const Instance *)state;
    for (int k = CALLS; k <= REST; k++) i->v[k] = now.v[k];
    return OK;
}

#if FMI == 2
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const void *callbacks, int visible, int logging) {
    return (void)name, (void)type, (void)guid, (void)resources, (void)callbacks, (void)visible, (void)logging, made();
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const *names) { return (void)c, (void)on, (void)n, (void)names, OK; }
int fmi2SetupExperiment(void *c, int d, double t, double start, int s, double stop) {
    return (void)c, (void)d, (void)t, (void)start, (void)s, (void)stop, OK;
}
int fmi2EnterInitializationMode(void *c) { return (void)c, OK; }
int fmi2ExitInitializationMode(void *c) { return (void)c, OK; }
int fmi2Terminate(void *c) { return (void)c, OK; }
int fmi2Reset(void *c) { return (void)c, ERROR; }
int fmi2GetReal(void *c, const unsigned r[], size_t n, double v[]) { return get(c, r, n, v); }
int fmi2SetReal(void *c, const unsigned r[], size_t n, const double v[]) { return set(c, r, n, v); }
int fmi2GetFMUstate(void *c, void **state) { return save(c, state); }
int fmi2SetFMUstate(void *c, void *state) { return restore(c, state); }
int fmi2FreeFMUstate(void *c, void **state) { return (void)c, free(*state), *state = NULL, OK; }
int fmi2DoStep(void *c, double t, double h, int no_rollback) { return (void)t, (void)no_rollback, stepped(c, h), OK; }
#else
const char *fmi3GetVersion(void) { return "3.0"; }
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging, bool event_mode_used,
                                  bool early, const unsigned required[], size_t n, void *environment, void *log, void *update) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)event_mode_used, (void)early;
    return (void)required, (void)n, (void)environment, (void)log, (void)update, made();
}
void fmi3FreeInstance(void *c) { free(c); }
int fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const categories[]) { return (void)c, (void)on, (void)n, (void)categories, OK; }
int fmi3EnterInitializationMode(void *c, bool d, double tolerance, double start, bool bounded, double stop) {
    return (void)c, (void)d, (void)tolerance, (void)start, (void)bounded, (void)stop, OK;
}
int fmi3ExitInitializationMode(void *c) { return (void)c, OK; }
int fmi3Terminate(void *c) { return (void)c, OK; }
int fmi3Reset(void *c) { return (void)c, ERROR; }
int fmi3GetFloat64(void *c, const unsigned r[], size_t n, double v[], size_t m) { return (void)m, get(c, r, n, v); }
int fmi3SetFloat64(void *c, const unsigned r[], size_t n, const double v[], size_t m) { return (void)m, set(c, r, n, v); }
int fmi3GetFMUState(void *c, void **state) { return save(c, state); }
int fmi3SetFMUState(void *c, void *state) { return restore(c, state); }
int fmi3FreeFMUState(void *c, void **state) { return (void)c, free(*state), *state = NULL, OK; }
int fmi3DoStep(void *c, double t, double h, bool no_rollback, bool *event, bool *terminate, bool *early, double *last) {
    *event = *terminate = *early = false;
    *last = t + h;
    return (void)no_rollback, stepped(c, h), OK;
}
#endif
