/* A block with inputs u, states x, outputs y, for FMI 2.0 and 3.0. `model.h` is written per block: NX, NU, NY, DEGREE
   (of the inputs' polynomials within a step), capabilities, start values, and either the matrices of a linear system
   (LINEAR) or flow(), outputs() and feedthrough(). */

#include <math.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "model.h"

/* Inputs as polynomials around the beginning of the step: value, first derivative, ... */
typedef double Inputs[NU][DEGREE + 1];

/* Value references. */
enum { TIME = 0, INPUT = 1, OUTPUT = 101, STATE = 201, FAULT = 301, FAULT_TIME = 302 };

enum {
    OK, WARNING, DISCARD, ERROR, FATAL,               /* as returned by doStep; also FMI's numbers */
    NOT_A_NUMBER, INFINITE,                           /* outputs */
    FINE_STEPS, TERMINATE, HALFWAY,                   /* refuses steps above 2e-4 s; ends the run; stops half way */
    GET_FAILS, SET_FAILS, SAVE_FAILS, RESTORE_FAILS,
    ENTER_FAILS, EXIT_FAILS, TERMINATE_FAILS, INSTANTIATE_FAILS,
    CRASH = 50, ABORT, EXIT, HANG, OVERFLOW, CHDIR    /* of the process */
};

/* What goes into a saved state. */
typedef struct {
    double time, x[NX];
    Inputs u;
} State;

/* A propagator for one step length. */
typedef struct {
    double h, e[NX][NX], g[DEGREE + 1][NX][NU];
} Propagator;

enum { PROPAGATORS = 4 };

typedef struct {
    State s;
    double fault_time, stop;
    int fault, phase; /* 0 instantiated, 1 initialization, 2 steps, 3 terminated */
    Propagator cache[PROPAGATORS];
    unsigned next;
    char *name;
    /* the importer's, by version */
    const void *callbacks;
    void *environment, *log, *update;
    int early_allowed;
} Block;

#ifdef LINEAR
enum { SIZE = NX + (DEGREE + 1) * NU };

static void multiply(long double (*a)[SIZE], long double (*b)[SIZE], long double (*c)[SIZE]) {
    for (int i = 0; i < SIZE; i++)
        for (int j = 0; j < SIZE; j++) {
            c[i][j] = 0;
            for (int k = 0; k < SIZE; k++) c[i][j] += a[i][k] * b[k][j];
        }
}

/* exp(h [A B 0; 0 0 I; 0 0 0]) by its series, scaled and squared: exact for inputs that are polynomials. */
static const Propagator *propagator(Block *b, double h) {
    for (int i = 0; i < PROPAGATORS; i++)
        if (b->cache[i].h == h) return &b->cache[i];
    static _Thread_local long double m[SIZE][SIZE], e[SIZE][SIZE], p[SIZE][SIZE], t[SIZE][SIZE];
    memset(m, 0, sizeof m);
    for (int i = 0; i < NX; i++) {
        for (int j = 0; j < NX; j++) m[i][j] = A[i][j];
        for (int j = 0; j < NU; j++) m[i][NX + j] = B[i][j];
    }
    for (int i = 0; i < DEGREE * NU; i++) m[NX + i][NX + NU + i] = 1;
    long double norm = 0;
    for (int i = 0; i < SIZE; i++) {
        long double row = 0;
        for (int j = 0; j < SIZE; j++) row += fabsl(m[i][j]) * h;
        norm = fmaxl(norm, row);
    }
    int squarings = 0;
    long double scale = h;
    for (; norm > 0.5; norm /= 2, scale /= 2) squarings++;
    memset(e, 0, sizeof e);
    memset(p, 0, sizeof p);
    for (int i = 0; i < SIZE; i++) e[i][i] = p[i][i] = 1;
    for (int n = 1; n <= 20; n++) {
        multiply(p, m, t);
        for (int i = 0; i < SIZE; i++)
            for (int j = 0; j < SIZE; j++) e[i][j] += p[i][j] = t[i][j] * scale / n;
    }
    for (; squarings > 0; squarings--) {
        multiply(e, e, t);
        memcpy(e, t, sizeof e);
    }
    Propagator *out = &b->cache[b->next++ % PROPAGATORS];
    out->h = h;
    for (int i = 0; i < NX; i++) {
        for (int j = 0; j < NX; j++) out->e[i][j] = e[i][j];
        for (int k = 0; k <= DEGREE; k++)
            for (int j = 0; j < NU; j++) out->g[k][i][j] = e[i][NX + k * NU + j];
    }
    return out;
}

static void flow(Block *b, double t, double h) {
    (void)t;
    const Propagator *p = propagator(b, h);
    double x[NX];
    for (int i = 0; i < NX; i++) {
        x[i] = 0;
        for (int j = 0; j < NX; j++) x[i] += p->e[i][j] * b->s.x[j];
        for (int j = 0; j < NU; j++)
            for (int k = 0; k <= DEGREE; k++) x[i] += p->g[k][i][j] * b->s.u[j][k];
    }
    memcpy(b->s.x, x, sizeof x);
}
static double output(const Block *b, int i) {
    double y = 0;
    for (int j = 0; j < NX; j++) y += C[i][j] * b->s.x[j];
    for (int j = 0; j < NU; j++) y += D[i][j] * b->s.u[j][0];
    return y;
}
static double output_derivative(const Block *b, int i) {
    double y = 0;
    for (int j = 0; j < NX; j++) {
        double dx = 0;
        for (int k = 0; k < NX; k++) dx += A[j][k] * b->s.x[k];
        for (int k = 0; k < NU; k++) dx += B[j][k] * b->s.u[k][0];
        y += C[i][j] * dx;
    }
    for (int j = 0; j < NU; j++) y += DEGREE ? D[i][j] * b->s.u[j][DEGREE > 0] : 0;
    return y;
}
static double feedthrough(const Block *b, int i, int j) { return (void)b, D[i][j]; }
#else
#include "equations.h"
#endif

/* The inputs' polynomials, taken around a time h later. */
static void shift(Inputs u, double h) {
    for (int j = 0; j < NU; j++)
        for (int k = 0; k <= DEGREE; k++) {
            double sum = 0, power = 1;
            for (int n = k; n <= DEGREE; n++, power *= h / (n - k)) sum += u[j][n] * power;
            u[j][k] = sum;
        }
}

static int faulty(const Block *b) { return b->fault && b->s.time >= b->fault_time - 1e-12; }

static double value(const Block *b, unsigned r, int *bad) {
    if (r == TIME) return b->s.time;
    if (r >= INPUT && r < INPUT + NU) return b->s.u[r - INPUT][0];
    if (r >= OUTPUT && r < OUTPUT + NY) {
        if (b->fault == NOT_A_NUMBER && faulty(b)) return NAN;
        if (b->fault == INFINITE && faulty(b)) return -INFINITY;
        return output(b, r - OUTPUT);
    }
    if (r >= STATE && r < STATE + NX) return b->s.x[r - STATE];
    if (r == FAULT_TIME) return b->fault_time;
    *bad = 1;
    return 0;
}

static int assign(Block *b, unsigned r, double v) {
    if (r >= INPUT && r < INPUT + NU) b->s.u[r - INPUT][0] = v;
    else if (r >= STATE && r < STATE + NX && b->phase < 2) b->s.x[r - STATE] = v;
    else if (r == FAULT_TIME) b->fault_time = v;
    else return ERROR;
    return isfinite(v) ? OK : ERROR;
}

static Block *block(const char *name) {
    Block *b = calloc(1, sizeof *b);
    static const double start[NX + 1] = START;
    memcpy(b->s.x, start, sizeof b->s.x);
    b->stop = INFINITY;
    b->name = strdup(name ? name : "");
    return b;
}
static void drop(Block *b) { free(b->name), free(b); }

/* What a faulty step does; OK: go on. */
static int deeper(volatile char *above) {
    volatile char here[4096];
    here[0] = above[0];
    return deeper(here) + here[0];
}

static int fault_of_step(Block *b, double *h) {
    switch (b->fault) {
    case WARNING: case DISCARD: case ERROR: case FATAL: return b->fault;
    case TERMINATE: return DISCARD;
    case FINE_STEPS: return *h > 2e-4 ? DISCARD : OK;
    case HALFWAY: return *h > 0.006 ? *h /= 2, HALFWAY : OK;
    case CRASH: raise(SIGSEGV); break;
    case ABORT: abort();
    case EXIT: exit(0);
    case HANG: for (;;) sleep(1);
    case OVERFLOW: return deeper((volatile char *)"") > 0 ? OK : ERROR;
    case CHDIR: return chdir("/") ? ERROR : OK;
    }
    return OK;
}
