/* FMUs of FMI 2.0 for Model Exchange; KIND says which, see the descriptions in coupled.rs and faults.rs.

   BALL    h' = v, v' = -9.81; at h = 0 and v < 0: v := -0.7 v, bounces + 1
   SENSOR  y' = (u - y) / T; when `bounces` changes: y := u, reset + 1; when u crosses 0.5: crossings + 1
   TROUBLE x' by `fault`: see there */

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*free)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

typedef struct {
    int again, terminate, nominals, states, defined;
    double next;
} EventInfo;

#define BALL 1
#define SENSOR 2
#define TROUBLE 3
enum { OK, WARNING, DISCARD, ERROR };

#if KIND == BALL
enum { NX = 2, NZ = 1 };
#else
enum { NX = 1, NZ = 1 };
#endif

typedef struct {
    const Callbacks *callbacks;
    double t, x[2], u, T;
    int bounces, seen, crossings, above, fault, mode, initialized, event;
} Instance;

const char *fmi2GetVersion(void) { return "2.0"; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks,
                      int visible, int logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)visible, (void)logging;
    Instance *i = calloc(1, sizeof *i);
    i->callbacks = callbacks;
    i->x[0] = KIND == SENSOR ? 0 : 1;
    i->T = 0.1;
    return i;
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int d, double tol, double start, int s, double stop) {
    (void)d, (void)tol, (void)s, (void)stop;
    ((Instance *)c)->t = start;
    return OK;
}
int fmi2EnterInitializationMode(void *c) { (void)c; return OK; }
int fmi2ExitInitializationMode(void *c) {
    Instance *i = c;
    i->event = 1;
    i->above = i->u > 0.5;
    i->seen = i->bounces;
    i->mode = 1;
    return OK;
}
int fmi2Terminate(void *c) { (void)c; return OK; }

/* States */
int fmi2GetFMUstate(void *c, void **s) {
    if (!*s) *s = malloc(sizeof(Instance));
    memcpy(*s, c, sizeof(Instance));
    return OK;
}
int fmi2SetFMUstate(void *c, void *s) { memcpy(c, s, sizeof(Instance)); return OK; }
int fmi2FreeFMUstate(void *c, void **s) { (void)c; free(*s); *s = NULL; return OK; }

/* Reals: 0 h or y or x, 1 v, 2 u, 3 T, 4 der(0), 5 der(1). Integers: 0 bounces, 1 crossings, 2 fault. */
static void rates(Instance *i, double dx[]) {
#if KIND == BALL
    dx[0] = i->x[1];
    dx[1] = -9.81;
#elif KIND == SENSOR
    dx[0] = (i->u - i->x[0]) / i->T;
#else
    switch (i->fault) {
    case 0: dx[0] = i->mode ? -sqrt(i->x[0]) : 0; break;   /* refused below 0 */
    case 1: dx[0] = i->t > 0.5 ? NAN : 1; break;
    case 2: dx[0] = i->mode ? -1 : 1; break;               /* chatters at 0 */
    default: dx[0] = -1;
    }
#endif
}
int fmi2GetReal(void *c, const unsigned r[], size_t n, double v[]) {
    Instance *i = c;
    double dx[2] = {0, 0};
    rates(i, dx);
    for (size_t k = 0; k < n; k++)
        v[k] = r[k] < 2 ? i->x[r[k]] : r[k] == 2 ? i->u : r[k] == 3 ? i->T : dx[r[k] - 4];
    return OK;
}
int fmi2SetReal(void *c, const unsigned r[], size_t n, const double v[]) {
    Instance *i = c;
    for (size_t k = 0; k < n; k++) {
        if (r[k] < 2) i->x[r[k]] = v[k];
        if (r[k] == 2) i->u = v[k];
        if (r[k] == 3) i->T = v[k];
    }
    return OK;
}
int fmi2GetInteger(void *c, const unsigned r[], size_t n, int v[]) {
    Instance *i = c;
    for (size_t k = 0; k < n; k++) v[k] = r[k] == 0 ? i->bounces : r[k] == 1 ? i->crossings : i->fault;
    return OK;
}
int fmi2SetInteger(void *c, const unsigned r[], size_t n, const int v[]) {
    Instance *i = c;
    if (KIND == SENSOR && i->initialized && !i->event) return ERROR; /* discrete inputs: in event mode only */
    for (size_t k = 0; k < n; k++) {
        if (r[k] == 0) i->bounces = v[k];
        if (r[k] == 2) i->fault = v[k];
    }
    return OK;
}

int fmi2EnterEventMode(void *c) { ((Instance *)c)->event = 1; return OK; }
int fmi2EnterContinuousTimeMode(void *c) {
    Instance *i = c;
    i->initialized = 1;
    i->event = 0;
    return OK;
}
int fmi2CompletedIntegratorStep(void *c, int keep, int *event, int *terminate) {
    (void)c, (void)keep;
    *event = *terminate = 0;
    return OK;
}
int fmi2NewDiscreteStates(void *c, EventInfo *e) {
    Instance *i = c;
    memset(e, 0, sizeof *e);
#if KIND == BALL
    if (i->x[0] <= 0 && i->x[1] < 0) {
        i->x[0] = 1e-300; /* 0 would make a second event, on leaving it */
        i->x[1] *= -0.7;
        i->bounces++;
        e->states = 1;
    }
#elif KIND == SENSOR
    if (i->seen != i->bounces) {
        i->seen = i->bounces;
        i->x[0] = i->u;
        e->states = 1;
    }
    if ((i->u > 0.5) != i->above) {
        i->above = i->u > 0.5;
        i->crossings++;
    }
#else
    if (i->fault == 0 && i->x[0] <= 1e-3) i->mode = 0;
    if (i->fault == 2) i->mode = i->x[0] > 0;
    if (i->fault == 3 && i->x[0] <= 0.5) e->again = 1;
    if (i->fault == 4) { e->defined = 1; e->next = i->t; }
#endif
    return OK;
}
int fmi2SetTime(void *c, double t) { ((Instance *)c)->t = t; return OK; }
int fmi2SetContinuousStates(void *c, const double x[], size_t n) { memcpy(((Instance *)c)->x, x, n * sizeof *x); return OK; }
int fmi2GetContinuousStates(void *c, double x[], size_t n) { memcpy(x, ((Instance *)c)->x, n * sizeof *x); return OK; }
int fmi2GetNominalsOfContinuousStates(void *c, double x[], size_t n) {
    (void)c;
    for (size_t k = 0; k < n; k++) x[k] = 1;
    return OK;
}
int fmi2GetDerivatives(void *c, double dx[], size_t n) {
    Instance *i = c;
    (void)n;
    if (KIND == TROUBLE && i->fault == 0 && i->x[0] < 0) return DISCARD;
    if (KIND == TROUBLE && i->fault == 5 && i->t > 0.5) {
        i->callbacks->logger(i->callbacks->environment, "trouble", ERROR, "e", "no derivative beyond %g s", 0.5);
        return ERROR;
    }
    if (KIND == TROUBLE && i->fault == 6 && i->t > 0.5) return DISCARD;
    rates(i, dx);
    return OK;
}
int fmi2GetEventIndicators(void *c, double z[], size_t n) {
    Instance *i = c;
    (void)n;
#if KIND == BALL
    z[0] = i->x[0];
#elif KIND == SENSOR
    z[0] = i->u - 0.5;
#else
    z[0] = i->fault == 0 ? i->x[0] - 1e-3 : i->fault == 3 ? i->x[0] - 0.5 : i->x[0];
#endif
    return OK;
}
