/* An FMU of FMI 3.0 for Co-Simulation with event mode: x' = rate + u with u held; where x comes to `level`, doStep returns early, and
   the event makes `count` one more and `level` higher by `spacing`. With u as it is set, x + u >= level is an event at once, if
   `looks` is set. Its step is exact. */

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

enum { OK, WARNING, DISCARD, ERROR };
enum { X, COUNT, U, RATE, LEVEL, SPACING, AHEAD, VARIABLES };

typedef struct {
    double v[VARIABLES], time;
    bool event_mode_used, event_mode;
} Instance;

static double sum(const Instance *i) { return i->v[X] + i->v[AHEAD] * i->v[U]; }

const char *fmi3GetVersion(void) { return "3.0"; }
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                  bool event_mode_used, bool early, const unsigned required[], size_t n, void *environment,
                                  void *log, void *update) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)required, (void)n;
    (void)environment, (void)log, (void)update;
    Instance *i = calloc(1, sizeof *i);
    i->event_mode_used = event_mode_used && early;
    i->v[RATE] = 1, i->v[LEVEL] = i->v[SPACING] = 1e9;
    return i;
}
void fmi3FreeInstance(void *c) { free(c); }
int fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const categories[]) {
    return (void)c, (void)on, (void)n, (void)categories, OK;
}
int fmi3EnterInitializationMode(void *c, bool d, double tolerance, double start, bool bounded, double stop) {
    (void)d, (void)tolerance, (void)bounded, (void)stop;
    ((Instance *)c)->time = start;
    return OK;
}
int fmi3ExitInitializationMode(void *c) {
    Instance *i = c;
    i->event_mode = i->event_mode_used;
    return OK;
}
int fmi3Terminate(void *c) { return (void)c, OK; }
int fmi3Reset(void *c) { return (void)c, ERROR; }
int fmi3GetFloat64(void *c, const unsigned r[], size_t n, double v[], size_t m) {
    for (size_t k = 0; k < n; k++) v[k] = ((Instance *)c)->v[r[k]];
    return (void)m, OK;
}
int fmi3SetFloat64(void *c, const unsigned r[], size_t n, const double v[], size_t m) {
    for (size_t k = 0; k < n; k++) ((Instance *)c)->v[r[k]] = v[k];
    return (void)m, OK;
}
int fmi3GetFMUState(void *c, void **state) {
    if (((Instance *)c)->event_mode) return ERROR; /* the master promises to store in step mode */
    if (!*state) *state = malloc(sizeof(Instance));
    return *(Instance *)*state = *(Instance *)c, OK;
}
int fmi3SetFMUState(void *c, void *state) {
    if (((Instance *)c)->event_mode) return ERROR;
    return *(Instance *)c = *(Instance *)state, OK;
}
int fmi3FreeFMUState(void *c, void **state) { return (void)c, free(*state), *state = NULL, OK; }

int fmi3EnterEventMode(void *c) { return ((Instance *)c)->event_mode = true, OK; }
int fmi3EnterStepMode(void *c) { return ((Instance *)c)->event_mode = false, OK; }
int fmi3UpdateDiscreteStates(void *c, bool *again, bool *terminate, bool *nominals, bool *values, bool *defined, double *next) {
    Instance *i = c;
    if (!i->event_mode) return ERROR;
    *again = *terminate = *nominals = *values = *defined = false;
    *next = 0;
    while (sum(i) >= i->v[LEVEL]) i->v[COUNT] += 1, i->v[LEVEL] += i->v[SPACING];
    return OK;
}

int fmi3DoStep(void *c, double t, double h, bool no_rollback, bool *event, bool *terminate, bool *early, double *last) {
    Instance *i = c;
    (void)no_rollback;
    *event = *terminate = *early = false;
    if (i->event_mode || fabs(t - i->time) > 1e-9 || !(h > 0)) return ERROR;
    double rate = i->v[RATE] + (i->v[AHEAD] ? 0 : i->v[U]), left = (i->v[LEVEL] - sum(i)) / rate;
    if (!i->event_mode_used) {
        for (; left <= h && left >= 0; left += i->v[SPACING] / rate) i->v[COUNT] += 1, i->v[LEVEL] += i->v[SPACING];
    } else if (left <= h && (left > 0 || sum(i) >= i->v[LEVEL])) {
        h = left > 0 ? left : 0;
        *event = *early = true;
    }
    i->v[X] += rate * h;
    if (*early && sum(i) < i->v[LEVEL]) i->v[X] = i->v[LEVEL] - i->v[AHEAD] * i->v[U]; /* rounding */
    *last = i->time = t + h;
    return OK;
}

#define NOT_OFFERED(name) int name() { return ERROR; }
NOT_OFFERED(fmi3ActivateModelPartition) NOT_OFFERED(fmi3CompletedIntegratorStep) NOT_OFFERED(fmi3DeserializeFMUState)
NOT_OFFERED(fmi3EnterConfigurationMode) NOT_OFFERED(fmi3EnterContinuousTimeMode) NOT_OFFERED(fmi3EvaluateDiscreteStates)
NOT_OFFERED(fmi3ExitConfigurationMode) NOT_OFFERED(fmi3GetAdjointDerivative) NOT_OFFERED(fmi3GetBinary)
NOT_OFFERED(fmi3GetBoolean) NOT_OFFERED(fmi3GetClock) NOT_OFFERED(fmi3GetContinuousStateDerivatives)
NOT_OFFERED(fmi3GetContinuousStates) NOT_OFFERED(fmi3GetDirectionalDerivative) NOT_OFFERED(fmi3GetEventIndicators)
NOT_OFFERED(fmi3GetFloat32) NOT_OFFERED(fmi3GetInt16) NOT_OFFERED(fmi3GetInt32) NOT_OFFERED(fmi3GetInt64)
NOT_OFFERED(fmi3GetInt8) NOT_OFFERED(fmi3GetIntervalDecimal) NOT_OFFERED(fmi3GetIntervalFraction)
NOT_OFFERED(fmi3GetNominalsOfContinuousStates) NOT_OFFERED(fmi3GetNumberOfContinuousStates)
NOT_OFFERED(fmi3GetNumberOfEventIndicators) NOT_OFFERED(fmi3GetNumberOfVariableDependencies)
NOT_OFFERED(fmi3GetOutputDerivatives) NOT_OFFERED(fmi3GetShiftDecimal) NOT_OFFERED(fmi3GetShiftFraction)
NOT_OFFERED(fmi3GetString) NOT_OFFERED(fmi3GetUInt16) NOT_OFFERED(fmi3GetUInt32) NOT_OFFERED(fmi3GetUInt64)
NOT_OFFERED(fmi3GetUInt8) NOT_OFFERED(fmi3GetVariableDependencies) NOT_OFFERED(fmi3SerializeFMUState)
NOT_OFFERED(fmi3SerializedFMUStateSize) NOT_OFFERED(fmi3SetBinary) NOT_OFFERED(fmi3SetBoolean) NOT_OFFERED(fmi3SetClock)
NOT_OFFERED(fmi3SetContinuousStates) NOT_OFFERED(fmi3SetFloat32) NOT_OFFERED(fmi3SetInt16) NOT_OFFERED(fmi3SetInt32)
NOT_OFFERED(fmi3SetInt64) NOT_OFFERED(fmi3SetInt8) NOT_OFFERED(fmi3SetIntervalDecimal)
NOT_OFFERED(fmi3SetIntervalFraction) NOT_OFFERED(fmi3SetShiftDecimal) NOT_OFFERED(fmi3SetShiftFraction)
NOT_OFFERED(fmi3SetString) NOT_OFFERED(fmi3SetTime) NOT_OFFERED(fmi3SetUInt16) NOT_OFFERED(fmi3SetUInt32)
NOT_OFFERED(fmi3SetUInt64) NOT_OFFERED(fmi3SetUInt8)
void *fmi3InstantiateModelExchange() { return NULL; }
void *fmi3InstantiateScheduledExecution() { return NULL; }
