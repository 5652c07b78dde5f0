/* An FMU of FMI 2.0 with the habits of real ones: keeps the callbacks, passes another environment, gives no
   category, misses functions, returns odd statuses. It tells the order of the calls through its log. */

#include <stddef.h>
#include <stdio.h>
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
    const Callbacks *callbacks;
    char name[64];
    int polls;
} Instance;

static void say(Instance *i, const char *what) {
    int elsewhere;
    i->callbacks->logger(&elsewhere, i->name, 0, NULL, "%s", what);
}

const char *fmi2GetVersion(void) { return "2.0"; }

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks,
                      int visible, int logging) {
    (void)type, (void)visible, (void)logging;
    if (!callbacks || !callbacks->allocate || !callbacks->free || !resources || strncmp(resources, "file:///", 8))
        return NULL;
    if (strcmp(guid, "{it}")) {
        callbacks->logger(callbacks->environment, name, 3, NULL, "guid %s is not mine", guid);
        return NULL;
    }
    Instance *i = callbacks->allocate(1, sizeof *i);
    i->callbacks = callbacks;
    snprintf(i->name, sizeof i->name, "%s", name);
    return i;
}

void fmi2FreeInstance(void *c) {
    Instance *i = c;
    say(i, "instance freed");
    i->callbacks->free(i);
}

int fmi2SetupExperiment(void *c, int d, double t, double a, int s, double b) {
    (void)c, (void)d, (void)t, (void)a, (void)s, (void)b;
    return 0;
}
int fmi2EnterInitializationMode(void *c) { say(c, "initialization"); return 1; }
int fmi2ExitInitializationMode(void *c) { (void)c; return 0; }
int fmi2Terminate(void *c) { say(c, "terminated"); return 0; }

int fmi2GetFMUstate(void *c, void **state) {
    Instance *i = c;
    if (!*state)
        *state = i->callbacks->allocate(1, 8);
    return 0;
}
int fmi2FreeFMUstate(void *c, void **state) {
    Instance *i = c;
    i->callbacks->free(*state);
    *state = NULL;
    say(i, "state freed");
    return 0;
}

int fmi2GetString(void *c, const unsigned *vr, size_t n, const char **values) {
    (void)c, (void)vr;
    for (size_t k = 0; k < n; k++)
        values[k] = NULL;
    return 0;
}
int fmi2GetBoolean(void *c, const unsigned *vr, size_t n, int *values) {
    (void)c, (void)vr;
    for (size_t k = 0; k < n; k++)
        values[k] = -7;
    return 0;
}

int fmi2GetReal(void *c, const unsigned *vr, size_t n, double *values) {
    (void)c;
    for (size_t k = 0; k < n; k++)
        values[k] = vr[k] / 3.0;
    return 0;
}
int fmi2SetReal(void *c, const unsigned *vr, size_t n, const double *values) {
    (void)c, (void)values;
    return n && vr[0] == 99 ? 3 : 0;
}

/* The step size says what happens. */
int fmi2DoStep(void *c, double time, double step, int no_rollback) {
    Instance *i = c;
    (void)time, (void)no_rollback;
    i->polls = 0;
    if (step == 6) {
        char text[100];
        for (int k = 0; k < 5000; k++) {
            snprintf(text, sizeof text, "message %d of many, long enough that not all of them have room at a time", k);
            say(i, text);
        }
    }
    if (step == 7) {
        say(i, "last words");
        exit(3);
    }
    return step == 2 ? 2 : step == 3 ? 3 : step == 4 ? 4 : step == 5 ? 5 : step == 77 ? 77 : 0;
}
int fmi2GetStatus(void *c, int kind, int *value) {
    Instance *i = c;
    if (kind != 0)
        return 3;
    *value = ++i->polls < 3 ? 5 : 0;
    return 0;
}
int fmi2GetRealStatus(void *c, int kind, double *value) {
    (void)c;
    *value = 0.25;
    return kind == 2 ? 0 : 3;
}
