/* Half of a two-mass oscillator as an FMU of FMI 2.0: with -DLEFT a mass that feels a force, else a mass that makes
   it. Steps itself exactly for held inputs, in a few nanoseconds, so that a master's own cost shows.

     left:   x1' = v1, v1' = -k1 x1 - c1 v1 + F                            reads F, gives x1, v1
     right:  x2' = v2, v2' = -k3 x2 - c3 v2 - F, F = k2 (x2 - x1) + c2 (v2 - v1)   reads x1, v1, gives F, x2, v2 */

#include <stdlib.h>
#include <string.h>

static const double k1 = 10, c1 = 0.2, k2 = 10, c2 = 0.5, k3 = 20, c3 = 0.3;

typedef struct {
    double x[2], u[2], h;
    double a[2][2], b[2][2]; /* over the step h */
} Half;

/* exp of [A B; 0 0] h by squaring a Taylor series */
static void discretize(Half *m, double h) {
#ifdef LEFT
    const double g[4][4] = {{0, 1, 0, 0}, {-k1, -c1, 1, 0}};
#else
    const double g[4][4] = {{0, 1, 0, 0}, {-k3 - k2, -c3 - c2, k2, c2}};
#endif
    double e[4][4] = {{0}}, term[4][4] = {{0}}, next[4][4];
    for (int i = 0; i < 4; i++) e[i][i] = term[i][i] = 1;
    for (int n = 1; n < 20; n++) {
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++) {
                next[i][j] = 0;
                for (int k = 0; k < 4; k++) next[i][j] += term[i][k] * g[k][j] * h / 1024 / n;
            }
        memcpy(term, next, sizeof term);
        for (int i = 0; i < 16; i++) e[i / 4][i % 4] += term[i / 4][i % 4];
    }
    for (int s = 0; s < 10; s++) {
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++) {
                next[i][j] = 0;
                for (int k = 0; k < 4; k++) next[i][j] += e[i][k] * e[k][j];
            }
        memcpy(e, next, sizeof e);
    }
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) m->a[i][j] = e[i][j], m->b[i][j] = e[i][j + 2];
    m->h = h;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const *names) { return (void)c, (void)on, (void)n, (void)names, 0; }

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const void *callbacks, int visible, int logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)callbacks, (void)visible, (void)logging;
    Half *m = calloc(1, sizeof *m);
#ifndef LEFT
    if (m) m->x[0] = 0.5;
#endif
    return m;
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int d, double t, double start, int s, double stop) { return (void)c, (void)d, (void)t, (void)start, (void)s, (void)stop, 0; }
int fmi2EnterInitializationMode(void *c) { return (void)c, 0; }
int fmi2ExitInitializationMode(void *c) { return (void)c, 0; }
int fmi2Terminate(void *c) { return (void)c, 0; }
int fmi2Reset(void *c) { memset(c, 0, sizeof(Half)); return 0; }

int fmi2GetReal(void *c, const unsigned r[], size_t n, double v[]) {
    const Half *m = c;
    for (size_t i = 0; i < n; i++) {
        switch (r[i]) {
        case 0: case 1: v[i] = m->u[r[i]]; break;
        case 2: v[i] = m->x[0]; break;
        case 3: v[i] = m->x[1]; break;
        case 4: v[i] = k2 * (m->x[0] - m->u[0]) + c2 * (m->x[1] - m->u[1]); break;
        default: return 3;
        }
    }
    return 0;
}
int fmi2SetReal(void *c, const unsigned r[], size_t n, const double v[]) {
    Half *m = c;
    for (size_t i = 0; i < n; i++) {
        if (r[i] > 1) return 3;
        m->u[r[i]] = v[i];
    }
    return 0;
}
/* There are none; masters that look for these functions find them. */
int fmi2GetInteger(void *c, const unsigned r[], size_t n, int v[]) { return (void)c, (void)r, (void)v, n ? 3 : 0; }
int fmi2GetBoolean(void *c, const unsigned r[], size_t n, int v[]) { return (void)c, (void)r, (void)v, n ? 3 : 0; }
int fmi2GetString(void *c, const unsigned r[], size_t n, const char *v[]) { return (void)c, (void)r, (void)v, n ? 3 : 0; }
int fmi2SetInteger(void *c, const unsigned r[], size_t n, const int v[]) { return (void)c, (void)r, (void)v, n ? 3 : 0; }
int fmi2SetBoolean(void *c, const unsigned r[], size_t n, const int v[]) { return (void)c, (void)r, (void)v, n ? 3 : 0; }
int fmi2SetString(void *c, const unsigned r[], size_t n, const char *const v[]) { return (void)c, (void)r, (void)v, n ? 3 : 0; }
int fmi2GetFMUstate(void *c, void **s) { return (void)c, (void)s, 3; }
int fmi2SetFMUstate(void *c, void *s) { return (void)c, (void)s, 3; }
int fmi2FreeFMUstate(void *c, void **s) { return (void)c, (void)s, 3; }
int fmi2SerializedFMUstateSize(void *c, void *s, size_t *n) { return (void)c, (void)s, (void)n, 3; }
int fmi2SerializeFMUstate(void *c, void *s, char b[], size_t n) { return (void)c, (void)s, (void)b, (void)n, 3; }
int fmi2DeSerializeFMUstate(void *c, const char b[], size_t n, void **s) { return (void)c, (void)b, (void)n, (void)s, 3; }
int fmi2GetDirectionalDerivative(void *c, const unsigned z[], size_t nz, const unsigned v[], size_t nv, const double dv[], double dz[]) {
    return (void)c, (void)z, (void)nz, (void)v, (void)nv, (void)dv, (void)dz, 3;
}
int fmi2SetRealInputDerivatives(void *c, const unsigned r[], size_t n, const int o[], const double v[]) { return (void)c, (void)r, (void)n, (void)o, (void)v, 3; }
int fmi2GetRealOutputDerivatives(void *c, const unsigned r[], size_t n, const int o[], double v[]) { return (void)c, (void)r, (void)n, (void)o, (void)v, 3; }
int fmi2CancelStep(void *c) { return (void)c, 3; }
int fmi2GetStatus(void *c, int k, int *v) { return (void)c, (void)k, (void)v, 2; }
int fmi2GetRealStatus(void *c, int k, double *v) { return (void)c, (void)k, (void)v, 2; }
int fmi2GetIntegerStatus(void *c, int k, int *v) { return (void)c, (void)k, (void)v, 2; }
int fmi2GetBooleanStatus(void *c, int k, int *v) { return (void)c, (void)k, (void)v, 2; }
int fmi2GetStringStatus(void *c, int k, const char **v) { return (void)c, (void)k, (void)v, 2; }

int fmi2DoStep(void *c, double t, double h, int no_rollback) {
    Half *m = c;
    (void)t, (void)no_rollback;
    if (h != m->h) discretize(m, h);
    const double x = m->x[0], v = m->x[1];
    m->x[0] = m->a[0][0] * x + m->a[0][1] * v + m->b[0][0] * m->u[0] + m->b[0][1] * m->u[1];
    m->x[1] = m->a[1][0] * x + m->a[1][1] * v + m->b[1][0] * m->u[0] + m->b[1][1] * m->u[1];
    return 0;
}
