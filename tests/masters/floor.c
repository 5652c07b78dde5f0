/* What no master can go below: a plain loop over the functions of the FMUs, in the order of dependency.
     floor LEFT.so RIGHT.so PAIRS STEPS     prints ns per FMU and step (the fastest fiftieth of the run), x1 at the end
     floor LEFT.so RIGHT.so PAIRS STEPS lines    the same, inputs on lines through their last two values
     floor CONTAINER.so RESOURCES TOKEN FMUS STEPS    the same of one FMU that holds all of them */

#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
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

/* The inputs of an FMU over a step. */
typedef struct { double value[2], slope[2]; } Line;

/* From the value before to this one, and on. */
static void draw(Line *line, int inputs, const double *value, int first) {
    for (int i = 0; i < inputs; i++) {
        line->slope[i] = first ? 0 : (value[i] - line->value[i]) * (1 / H);
        line->value[i] = value[i];
    }
}
/* Two half steps, inputs held in each where they have the moments of their lines; one step if nothing moves. */
static void follow(const Library *f, void *c, double t, const unsigned *input, int inputs, const Line *line) {
    static const double two[] = {1.0 / 6, 5.0 / 6}, one[] = {0.5};
    int parts = 1;
    for (int i = 0; i < inputs; i++)
        if (line->slope[i] != 0) parts = 2;
    for (int k = 0; k < parts; k++) {
        const double at = (parts == 2 ? two[k] : one[k]) * H;
        double held[2];
        for (int i = 0; i < inputs; i++) held[i] = line->value[i] + line->slope[i] * at;
        check(f->set(c, input, inputs, held)), check(f->step(c, t + k * H / parts, H / parts, 1));
    }
}
static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1e9 + t.tv_nsec;
}

int main(int argc, char **argv) {
    const int lines = argc == 6 && !strcmp(argv[5], "lines"), container = argc == 6 && !lines;
    if (argc != 5 && argc != 6) return 2;
    const long n = atol(argv[container ? 4 : 3]), steps = atol(argv[container ? 5 : 4]), chunk = steps / 50 ? steps / 50 : 1;
    const unsigned state[] = {2, 3}, input[] = {0, 1}, force[] = {4};
    double best = 1e300, x = 0;
    Library left = load(argv[1]), right = container ? left : load(argv[2]);
    void **l = calloc(n, sizeof *l), **r = calloc(n, sizeof *r);
    Line *to_left = calloc(n, sizeof *to_left), *to_right = calloc(n, sizeof *to_right);
    if (container) l[0] = start(&left, argv[3], argv[2]);
    else for (long i = 0; i < n; i++) l[i] = start(&left, "left", ""), r[i] = start(&right, "right", "");
    double begin = now(), v[2];
    for (long s = 0; s <= steps; s++) {
        if (!container)
            for (long i = 0; i < n; i++) { /* what the step before, or the initialization, has left */
                check(left.get(l[i], state, 2, v)), check(right.set(r[i], input, 2, v));
                if (lines) draw(&to_right[i], 2, v, s == 0);
                check(right.get(r[i], force, 1, v));
                if (lines) draw(&to_left[i], 1, v, s == 0);
                else check(left.set(l[i], input, 1, v));
            }
        if (s == steps) break;
        if (s % chunk == 0 && s) {
            double end = now(), each = (end - begin) / chunk;
            if (each < best) best = each;
            begin = end;
        }
        if (container) check(left.step(l[0], s * H, H, 1));
        else if (lines)
            for (long i = 0; i < n; i++)
                follow(&left, l[i], s * H, input, 1, &to_left[i]), follow(&right, r[i], s * H, input, 2, &to_right[i]);
        else for (long i = 0; i < n; i++) check(left.step(l[i], s * H, H, 1)), check(right.step(r[i], s * H, H, 1));
    }
    if (!container) check(left.get(l[0], state, 1, &x));
    printf("%.3f %.17g\n", best / (container ? n : 2 * n), x);
    return 0;
}
