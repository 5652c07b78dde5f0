/* The block as an FMU of FMI 2.0 (Co-Simulation). */

#include "block.h"

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*free)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

static int say(Block *b, int status, const char *what) {
    const Callbacks *c = b->callbacks;
    if (c && c->logger) c->logger(c->environment, b->name, status, "status", "%s (fault %d at %g s)", what, b->fault, b->s.time);
    return status;
}

const char *fmi2GetVersion(void) { return "2.0"; }
const char *fmi2GetTypesPlatform(void) { return "default"; }

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks,
                      int visible, int logging) {
    (void)resources, (void)visible, (void)logging;
    if (type != 1 || strcmp(guid, TOKEN)) return NULL;
    Block *b = block(name);
    b->callbacks = callbacks;
    if (!strcmp(b->name, "refuses")) {
        say(b, ERROR, "no instance");
        drop(b);
        return NULL;
    }
    return b;
}
void fmi2FreeInstance(void *c) { if (c) drop(c); }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const categories[]) {
    return (void)c, (void)on, (void)n, (void)categories, OK;
}
int fmi2SetupExperiment(void *c, int d, double tolerance, double start, int bounded, double stop) {
    (void)d, (void)tolerance;
    Block *b = c;
    b->s.time = start;
    if (bounded) b->stop = stop;
    return OK;
}
int fmi2EnterInitializationMode(void *c) {
    Block *b = c;
    b->phase = 1;
    return b->fault == ENTER_FAILS ? say(b, ERROR, "enter fails") : OK;
}
int fmi2ExitInitializationMode(void *c) {
    Block *b = c;
    b->phase = 2;
    return b->fault == EXIT_FAILS ? say(b, ERROR, "exit fails") : OK;
}
int fmi2Terminate(void *c) {
    Block *b = c;
    b->phase = 3;
    return b->fault == TERMINATE_FAILS ? say(b, ERROR, "terminate fails") : OK;
}
int fmi2Reset(void *c) {
    Block *b = c;
    Block *fresh = block(b->name);
    b->s = fresh->s, b->fault = 0, b->phase = 0;
    drop(fresh);
    return OK;
}

int fmi2GetReal(void *c, const unsigned r[], size_t n, double v[]) {
    Block *b = c;
    int bad = 0;
    if (b->fault == GET_FAILS && faulty(b)) return say(b, ERROR, "get fails");
    for (size_t k = 0; k < n; k++) v[k] = value(b, r[k], &bad);
    return bad ? say(b, ERROR, "no such variable") : OK;
}
int fmi2SetReal(void *c, const unsigned r[], size_t n, const double v[]) {
    Block *b = c;
    int status = OK;
    if (b->fault == SET_FAILS && faulty(b) && b->phase == 2) return say(b, ERROR, "set fails");
    for (size_t k = 0; k < n; k++) status |= assign(b, r[k], v[k]);
    return status ? say(b, ERROR, "cannot be set") : OK;
}
int fmi2GetInteger(void *c, const unsigned r[], size_t n, int v[]) {
    for (size_t k = 0; k < n; k++) if (r[k] != FAULT) return ERROR; else v[k] = ((Block *)c)->fault;
    return OK;
}
int fmi2SetInteger(void *c, const unsigned r[], size_t n, const int v[]) {
    for (size_t k = 0; k < n; k++) if (r[k] != FAULT) return ERROR; else ((Block *)c)->fault = v[k];
    return OK;
}

int fmi2SetRealInputDerivatives(void *c, const unsigned r[], size_t n, const int order[], const double v[]) {
    Block *b = c;
    for (size_t k = 0; k < n; k++) {
        if (r[k] < INPUT || r[k] >= INPUT + NU || order[k] < 1 || order[k] > DEGREE)
            return say(b, ERROR, "no input derivative of this order");
        b->s.u[r[k] - INPUT][order[k]] = v[k];
    }
    return OK;
}
int fmi2GetRealOutputDerivatives(void *c, const unsigned r[], size_t n, const int order[], double v[]) {
    for (size_t k = 0; k < n; k++) {
        if (!OUTPUT_DERIVATIVES || r[k] < OUTPUT || r[k] >= OUTPUT + NY || order[k] != 1) return ERROR;
        v[k] = output_derivative(c, r[k] - OUTPUT);
    }
    return OK;
}
int fmi2GetDirectionalDerivative(void *c, const unsigned y[], size_t ny, const unsigned u[], size_t nu,
                                 const double du[], double dy[]) {
    for (size_t i = 0; i < ny; i++) {
        dy[i] = 0;
        for (size_t j = 0; j < nu; j++) {
            if (!DIRECTIONAL || y[i] < OUTPUT || y[i] >= OUTPUT + NY || u[j] < INPUT || u[j] >= INPUT + NU)
                return say(c, ERROR, "no such derivative");
            dy[i] += feedthrough(c, y[i] - OUTPUT, u[j] - INPUT) * du[j];
        }
    }
    return OK;
}

int fmi2GetFMUstate(void *c, void **state) {
    Block *b = c;
    if (!ROLLBACK) return say(b, ERROR, "states cannot be saved");
    if (b->fault == SAVE_FAILS && faulty(b)) return say(b, ERROR, "save fails");
    if (!*state) *state = malloc(sizeof(State));
    *(State *)*state = b->s;
    return OK;
}
int fmi2SetFMUstate(void *c, void *state) {
    Block *b = c;
    if (!ROLLBACK) return say(b, ERROR, "states cannot be restored");
    if (b->fault == RESTORE_FAILS && faulty(b)) return say(b, ERROR, "restore fails");
    b->s = *(State *)state;
    return OK;
}
int fmi2FreeFMUstate(void *c, void **state) { return (void)c, free(*state), *state = NULL, OK; }

int fmi2DoStep(void *c, double t, double h, int no_rollback) {
    Block *b = c;
    (void)no_rollback;
    if (fabs(t - b->s.time) > 1e-9 || !(h > 0) || t + h > b->stop + 1e-9) return say(b, ERROR, "no step from here");
    int status = OK;
    if (faulty(b)) {
        if (b->fault >= CRASH) say(b, WARNING, "step");
        status = fault_of_step(b, &h);
        if (status) say(b, status > FATAL ? DISCARD : status, "step");
        if (status == HALFWAY) status = DISCARD;
        else if (status > WARNING) return status;
    }
    flow(b, t, h);
    shift(b->s.u, h);
    for (int j = 0; j < NU; j++)
        for (int k = 1; k <= DEGREE; k++) b->s.u[j][k] = 0; /* derivatives hold for one step */
    b->s.time = t + h;
    return status;
}
int fmi2GetRealStatus(void *c, int kind, double *value) { return *value = ((Block *)c)->s.time, kind == 2 ? OK : DISCARD; }
int fmi2GetBooleanStatus(void *c, int kind, int *value) {
    return *value = ((Block *)c)->fault == TERMINATE, kind == 3 ? OK : DISCARD;
}

/* Some importers want every function, used or not. */
#define NOT_OFFERED(name) int name() { return ERROR; }
NOT_OFFERED(fmi2GetBoolean) NOT_OFFERED(fmi2SetBoolean) NOT_OFFERED(fmi2GetString) NOT_OFFERED(fmi2SetString)
NOT_OFFERED(fmi2SerializedFMUstateSize) NOT_OFFERED(fmi2SerializeFMUstate) NOT_OFFERED(fmi2DeSerializeFMUstate)
NOT_OFFERED(fmi2CancelStep) NOT_OFFERED(fmi2GetStatus) NOT_OFFERED(fmi2GetIntegerStatus) NOT_OFFERED(fmi2GetStringStatus)
