/* An FMU of FMI 2.0 whose step fails from t = 0.5 s on, in the way that the parameter `fault` names; else its
   output is the time reached, by steps of whatever length, plus its input. */

#include <math.h>
#include <stdlib.h>

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*free)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

typedef struct {
    const Callbacks *callbacks;
    int fault;
    double time, u;
} Instance;

enum { OK, WARNING, DISCARD, ERROR, FATAL, NOT_A_NUMBER, INFINITE, FINE_STEPS, ENDS, HALFWAY };

const char *fmi2GetVersion(void) { return "2.0"; }

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks,
                      int visible, int logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)visible, (void)logging;
    Instance *i = calloc(1, sizeof *i);
    i->callbacks = callbacks;
    return i;
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int d, double t, double start, int s, double stop) {
    (void)d, (void)t, (void)s, (void)stop;
    ((Instance *)c)->time = start;
    return 0;
}
int fmi2EnterInitializationMode(void *c) { (void)c; return 0; }
int fmi2ExitInitializationMode(void *c) { (void)c; return 0; }
int fmi2Terminate(void *c) { (void)c; return 0; }

int fmi2SetInteger(void *c, const unsigned r[], size_t n, const int v[]) {
    (void)r;
    if (n) ((Instance *)c)->fault = v[0];
    return 0;
}
int fmi2SetReal(void *c, const unsigned r[], size_t n, const double v[]) {
    (void)r;
    if (n) ((Instance *)c)->u = v[0];
    return 0;
}
int fmi2GetReal(void *c, const unsigned r[], size_t n, double v[]) {
    Instance *i = c;
    (void)r;
    for (size_t k = 0; k < n; k++) {
        v[k] = i->time + i->u;
        if (i->time > 0.5) {
            if (i->fault == NOT_A_NUMBER) v[k] = NAN;
            if (i->fault == INFINITE) v[k] = -INFINITY;
        }
    }
    return 0;
}

int fmi2DoStep(void *c, double t, double h, int no_rollback) {
    Instance *i = c;
    (void)no_rollback;
    if (fabs(t - i->time) > 1e-9) return ERROR;
    if (t >= 0.5) {
        i->callbacks->logger(i->callbacks->environment, "x", i->fault, "step", "fault %d", i->fault);
        switch (i->fault) {
        case DISCARD: case ERROR: case FATAL: case ENDS: return i->fault == ENDS ? DISCARD : i->fault;
        case FINE_STEPS:
            if (h > 2e-4) return DISCARD;
            break;
        case HALFWAY:
            if (h > 0.01) { i->time = t + h / 2; return DISCARD; }
            break;
        case WARNING: i->time = t + h; return WARNING;
        }
    }
    i->time = t + h;
    return 0;
}
int fmi2GetRealStatus(void *c, int kind, double *value) { (void)kind; *value = ((Instance *)c)->time; return 0; }
int fmi2GetBooleanStatus(void *c, int kind, int *value) {
    (void)kind;
    *value = ((Instance *)c)->fault == ENDS;
    return 0;
}
