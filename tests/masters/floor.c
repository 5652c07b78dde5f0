/* What no master can go below: a plain loop over the functions of the FMUs, in the order of dependency.
     floor LEFT.so RIGHT.so PAIRS STEPS     prints ns per FMU and step (the fastest fiftieth of the run), x1 at the end
     floor CONTAINER.so RESOURCES TOKEN FMUS STEPS    the same of one FMU that holds all of them */

#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static const double H = 1e-3;

typedef struct {
    void *(*instantiate)(const char *, int, const char *, const char *, const void *, int, int);
    int (*setup)(void *, int, double, double, int, double);
    int (*enter)(void *), (*leave)(void *);
    int (*get)(void *, const unsigned *, size_t, double *);
    int (*set)(void *, const unsigned *, size_t, const double *);
    int (*step)(void *, double, double, int);
} Library;

static void logger(void *e, const char *i, int s, const char *c, const char *m, ...) { (void)e, fprintf(stderr, "%s %d %s %s\n", i, s, c, m); }
static const struct { void *logger, *allocate, *free, *finished, *environment; } CALLBACKS = {(void *)logger, (void *)calloc, (void *)free, 0, 0};

static Library load(const char *path) {
    void *l = dlopen(path, RTLD_NOW);
    if (!l) { fprintf(stderr, "%s\n", dlerror()); exit(1); }
    Library f;
#define FUNCTION(field, name) *(void **)&f.field = dlsym(l, name); if (!f.field) { fprintf(stderr, "%s lacks %s\n", path, name); exit(1); }
    FUNCTION(instantiate, "fmi2Instantiate") FUNCTION(setup, "fmi2SetupExperiment") FUNCTION(enter, "fmi2EnterInitializationMode")
    FUNCTION(leave, "fmi2ExitInitializationMode") FUNCTION(get, "fmi2GetReal") FUNCTION(set, "fmi2SetReal") FUNCTION(step, "fmi2DoStep")
    return f;
}
static void check(int status) { if (status) { fprintf(stderr, "status %d\n", status); exit(1); } }
static void *start(const Library *f, const char *token, const char *resources) {
    void *c = f->instantiate("x", 1, token, resources, &CALLBACKS, 0, 0);
    if (!c) { fprintf(stderr, "no instance\n"); exit(1); }
    check(f->setup(c, 0, 0, 0, 0, 0)), check(f->enter(c)), check(f->leave(c));
    return c;
}
static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1e9 + t.tv_nsec;
}

int main(int argc, char **argv) {
    const int container = argc == 6;
    if (!container && argc != 5) return 2;
    const long n = atol(argv[container ? 4 : 3]), steps = atol(argv[container ? 5 : 4]), chunk = steps / 50 ? steps / 50 : 1;
    const unsigned state[] = {2, 3}, input[] = {0, 1}, force[] = {4};
    double best = 1e300, x = 0;
    Library left = load(argv[1]), right = container ? left : load(argv[2]);
    void **l = calloc(n, sizeof *l), **r = calloc(n, sizeof *r);
    if (container) l[0] = start(&left, argv[3], argv[2]);
    else for (long i = 0; i < n; i++) l[i] = start(&left, "left", ""), r[i] = start(&right, "right", "");
    double begin = now(), v[2];
    for (long s = 0; s <= steps; s++) {
        if (!container)
            for (long i = 0; i < n; i++) { /* what the step before, or the initialization, has left */
                check(left.get(l[i], state, 2, v)), check(right.set(r[i], input, 2, v));
                check(right.get(r[i], force, 1, v)), check(left.set(l[i], input, 1, v));
            }
        if (s == steps) break;
        if (s % chunk == 0 && s) {
            double end = now(), each = (end - begin) / chunk;
            if (each < best) best = each;
            begin = end;
        }
        if (container) check(left.step(l[0], s * H, H, 1));
        else for (long i = 0; i < n; i++) check(left.step(l[i], s * H, H, 1)), check(right.step(r[i], s * H, H, 1));
    }
    if (!container) check(left.get(l[0], state, 1, &x));
    printf("%.3f %.17g\n", best / (container ? n : 2 * n), x);
    return 0;
}
