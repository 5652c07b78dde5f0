/* The block as an FMU of FMI 3.0 (Co-Simulation). Inputs within a step come from the intermediate update, which is
   called at its beginning and at its end and makes them a line. */

#include <stdbool.h>

#include "block.h"

typedef void (*Log)(void *, int, const char *, const char *);
typedef void (*Update)(void *, double, bool, bool, bool, bool, bool *, double *);

static int say(Block *b, int status, const char *what) {
    char text[200];
    snprintf(text, sizeof text, "%s (fault %d at %g s)", what, b->fault, b->s.time);
    if (b->log) ((Log)b->log)(b->environment, status, "status", text);
    return status;
}

const char *fmi3GetVersion(void) { return "3.0"; }

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                  bool events, bool early, const unsigned required[], size_t n, void *environment,
                                  Log log, Update update) {
    (void)resources, (void)visible, (void)logging, (void)events, (void)required, (void)n;
    if (strcmp(token, TOKEN)) return NULL;
    Block *b = block(name);
    b->environment = environment, b->log = (void *)log, b->update = (void *)update, b->early_allowed = early;
    if (!strcmp(b->name, "refuses")) {
        say(b, ERROR, "no instance");
        drop(b);
        return NULL;
    }
    return b;
}
void fmi3FreeInstance(void *c) { if (c) drop(c); }
int fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const categories[]) {
    return (void)c, (void)on, (void)n, (void)categories, OK;
}
int fmi3EnterInitializationMode(void *c, bool d, double tolerance, double start, bool bounded, double stop) {
    (void)d, (void)tolerance;
    Block *b = c;
    b->s.time = start, b->phase = 1;
    if (bounded) b->stop = stop;
    return b->fault == ENTER_FAILS ? say(b, ERROR, "enter fails") : OK;
}
int fmi3ExitInitializationMode(void *c) {
    Block *b = c;
    b->phase = 2;
    return b->fault == EXIT_FAILS ? say(b, ERROR, "exit fails") : OK;
}
int fmi3Terminate(void *c) {
    Block *b = c;
    b->phase = 3;
    return b->fault == TERMINATE_FAILS ? say(b, ERROR, "terminate fails") : OK;
}
int fmi3Reset(void *c) {
    Block *b = c;
    Block *fresh = block(b->name);
    b->s = fresh->s, b->fault = 0, b->phase = 0;
    drop(fresh);
    return OK;
}

int fmi3GetFloat64(void *c, const unsigned r[], size_t n, double v[], size_t m) {
    Block *b = c;
    int bad = n != m;
    if (b->fault == GET_FAILS && faulty(b)) return say(b, ERROR, "get fails");
    for (size_t k = 0; k < n; k++) v[k] = value(b, r[k], &bad);
    return bad ? say(b, ERROR, "no such variable") : OK;
}
int fmi3SetFloat64(void *c, const unsigned r[], size_t n, const double v[], size_t m) {
    Block *b = c;
    int status = n == m ? OK : ERROR;
    if (b->fault == SET_FAILS && faulty(b) && b->phase == 2) return say(b, ERROR, "set fails");
    for (size_t k = 0; k < n; k++) status |= assign(b, r[k], v[k]);
    return status ? say(b, ERROR, "cannot be set") : OK;
}
int fmi3GetInt32(void *c, const unsigned r[], size_t n, int32_t v[], size_t m) {
    (void)m;
    for (size_t k = 0; k < n; k++) if (r[k] != FAULT) return ERROR; else v[k] = ((Block *)c)->fault;
    return OK;
}
int fmi3SetInt32(void *c, const unsigned r[], size_t n, const int32_t v[], size_t m) {
    (void)m;
    for (size_t k = 0; k < n; k++) if (r[k] != FAULT) return ERROR; else ((Block *)c)->fault = v[k];
    return OK;
}

int fmi3GetOutputDerivatives(void *c, const unsigned r[], size_t n, const int32_t order[], double v[], size_t m) {
    for (size_t k = 0; k < n; k++) {
        if (!OUTPUT_DERIVATIVES || n != m || r[k] < OUTPUT || r[k] >= OUTPUT + NY || order[k] != 1) return ERROR;
        v[k] = output_derivative(c, r[k] - OUTPUT);
    }
    return OK;
}
int fmi3GetDirectionalDerivative(void *c, const unsigned y[], size_t ny, const unsigned u[], size_t nu,
                                 const double du[], size_t n, double dy[], size_t m) {
    for (size_t i = 0; i < ny; i++) {
        dy[i] = 0;
        for (size_t j = 0; j < nu; j++) {
            if (!DIRECTIONAL || n != nu || m != ny || y[i] < OUTPUT || y[i] >= OUTPUT + NY || u[j] < INPUT || u[j] >= INPUT + NU)
                return say(c, ERROR, "no such derivative");
            dy[i] += feedthrough(c, y[i] - OUTPUT, u[j] - INPUT) * du[j];
        }
    }
    return OK;
}

int fmi3GetFMUState(void *c, void **state) {
    Block *b = c;
    if (!ROLLBACK) return say(b, ERROR, "states cannot be saved");
    if (b->fault == SAVE_FAILS && faulty(b)) return say(b, ERROR, "save fails");
    if (!*state) *state = malloc(sizeof(State));
    *(State *)*state = b->s;
    return OK;
}
int fmi3SetFMUState(void *c, void *state) {
    Block *b = c;
    if (!ROLLBACK) return say(b, ERROR, "states cannot be restored");
    if (b->fault == RESTORE_FAILS && faulty(b)) return say(b, ERROR, "restore fails");
    b->s = *(State *)state;
    return OK;
}
int fmi3FreeFMUState(void *c, void **state) { return (void)c, free(*state), *state = NULL, OK; }

int fmi3DoStep(void *c, double t, double h, bool no_rollback, bool *event, bool *terminate, bool *early, double *last) {
    Block *b = c;
    (void)no_rollback;
    *event = *terminate = *early = false, *last = b->s.time;
    if (fabs(t - b->s.time) > 1e-9 || !(h > 0) || t + h > b->stop + 1e-9) return say(b, ERROR, "no step from here");
    int status = OK;
    if (faulty(b)) {
        if (b->fault >= CRASH) say(b, WARNING, "step");
        status = fault_of_step(b, &h);
        if (status) say(b, status > FATAL ? OK : status, "step");
        if (b->fault == TERMINATE) return *terminate = *early = true, OK;
        if (status == HALFWAY) {
            if (!(*early = b->early_allowed)) return DISCARD;
            status = OK;
        } else if (status > WARNING)
            return status;
    }
    bool request = false;
    double when = 0;
    if (b->update && DEGREE > 0) {
        double first[NU + 1];
        ((Update)b->update)(b->environment, t, true, true, false, false, &request, &when);
        for (int j = 0; j < NU; j++) first[j] = b->s.u[j][0];
        ((Update)b->update)(b->environment, t + h, true, false, false, false, &request, &when);
        for (int j = 0; j < NU; j++) {
            b->s.u[j][DEGREE > 0] = (b->s.u[j][0] - first[j]) / h;
            b->s.u[j][0] = first[j];
        }
    }
    flow(b, t, h);
    shift(b->s.u, h);
    for (int j = 0; j < NU; j++)
        for (int k = 1; k <= DEGREE; k++) b->s.u[j][k] = 0;
    b->s.time = *last = t + h;
    if (b->update && DEGREE > 0)
        ((Update)b->update)(b->environment, t + h, false, true, true, false, &request, &when);
    return status;
}

/* Some importers want every function, used or not. */
#define NOT_OFFERED(name) int name() { return ERROR; }
NOT_OFFERED(fmi3ActivateModelPartition) NOT_OFFERED(fmi3CompletedIntegratorStep)
NOT_OFFERED(fmi3DeserializeFMUState) NOT_OFFERED(fmi3EnterConfigurationMode)
NOT_OFFERED(fmi3EnterContinuousTimeMode) NOT_OFFERED(fmi3EnterEventMode)
NOT_OFFERED(fmi3EnterStepMode) NOT_OFFERED(fmi3EvaluateDiscreteStates) NOT_OFFERED(fmi3ExitConfigurationMode)
NOT_OFFERED(fmi3GetAdjointDerivative) NOT_OFFERED(fmi3GetBinary) NOT_OFFERED(fmi3GetBoolean)
NOT_OFFERED(fmi3GetClock) NOT_OFFERED(fmi3GetContinuousStateDerivatives)
NOT_OFFERED(fmi3GetContinuousStates) NOT_OFFERED(fmi3GetEventIndicators)
NOT_OFFERED(fmi3GetFloat32) NOT_OFFERED(fmi3GetInt16) NOT_OFFERED(fmi3GetInt64)
NOT_OFFERED(fmi3GetInt8) NOT_OFFERED(fmi3GetIntervalDecimal) NOT_OFFERED(fmi3GetIntervalFraction)
NOT_OFFERED(fmi3GetNominalsOfContinuousStates) NOT_OFFERED(fmi3GetNumberOfContinuousStates)
NOT_OFFERED(fmi3GetNumberOfEventIndicators) NOT_OFFERED(fmi3GetNumberOfVariableDependencies)
NOT_OFFERED(fmi3GetShiftDecimal) NOT_OFFERED(fmi3GetShiftFraction) NOT_OFFERED(fmi3GetString)
NOT_OFFERED(fmi3GetUInt16) NOT_OFFERED(fmi3GetUInt32) NOT_OFFERED(fmi3GetUInt64)
NOT_OFFERED(fmi3GetUInt8) NOT_OFFERED(fmi3GetVariableDependencies) NOT_OFFERED(fmi3SerializeFMUState)
NOT_OFFERED(fmi3SerializedFMUStateSize) NOT_OFFERED(fmi3SetBinary) NOT_OFFERED(fmi3SetBoolean)
NOT_OFFERED(fmi3SetClock) NOT_OFFERED(fmi3SetContinuousStates) NOT_OFFERED(fmi3SetFloat32)
NOT_OFFERED(fmi3SetInt16) NOT_OFFERED(fmi3SetInt64) NOT_OFFERED(fmi3SetInt8)
NOT_OFFERED(fmi3SetIntervalDecimal) NOT_OFFERED(fmi3SetIntervalFraction)
NOT_OFFERED(fmi3SetShiftDecimal) NOT_OFFERED(fmi3SetShiftFraction) NOT_OFFERED(fmi3SetString)
NOT_OFFERED(fmi3SetTime) NOT_OFFERED(fmi3SetUInt16) NOT_OFFERED(fmi3SetUInt32)
NOT_OFFERED(fmi3SetUInt64) NOT_OFFERED(fmi3SetUInt8) NOT_OFFERED(fmi3UpdateDiscreteStates)
void *fmi3InstantiateModelExchange() { return NULL; }
void *fmi3InstantiateScheduledExecution() { return NULL; }
