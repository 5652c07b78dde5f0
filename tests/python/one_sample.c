/* A discrete law as small exporters make it, FMI 2.0 Co-Simulation: one sample per fmi2DoStep, whatever the step says:
   sum += e, u = e + 0.05 sum. It counts its calls. No header of FMI is needed. */
#include <stddef.h>
#include <stdlib.h>

typedef struct { double e, u, sum; int calls; } M;
typedef unsigned Ref;

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(void *m, int on, size_t n, const char *const *c) { return 0; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *folder, const void *f, int visible, int on) {
    return calloc(1, sizeof(M));
}
void fmi2FreeInstance(void *m) { free(m); }
int fmi2SetupExperiment(void *m, int d, double tolerance, double start, int s, double stop) { return 0; }
int fmi2EnterInitializationMode(void *m) { return 0; }
int fmi2ExitInitializationMode(void *m) { return 0; }
int fmi2Terminate(void *m) { return 0; }
int fmi2Reset(void *m) { return 0; }
int fmi2GetReal(M *m, const Ref *v, size_t n, double *x) {
    for (size_t i = 0; i < n; i++) x[i] = v[i] == 0 ? m->e : m->u;
    return 0;
}
int fmi2SetReal(M *m, const Ref *v, size_t n, const double *x) {
    for (size_t i = 0; i < n; i++)
        if (v[i] == 0) m->e = x[i];
    return 0;
}
int fmi2GetInteger(M *m, const Ref *v, size_t n, int *x) {
    for (size_t i = 0; i < n; i++) x[i] = m->calls;
    return 0;
}
int fmi2DoStep(M *m, double t, double h, int no) {
    m->sum += m->e;
    m->u = m->e + 0.05 * m->sum;
    m->calls++;
    return 0;
}

/* FMPy looks for every function of the standard. */
#define NONE(name) int name(void) { return 3; }
NONE(fmi2CancelStep) NONE(fmi2GetStatus) NONE(fmi2GetRealStatus) NONE(fmi2GetIntegerStatus) NONE(fmi2GetBooleanStatus)
NONE(fmi2GetStringStatus) NONE(fmi2GetBoolean) NONE(fmi2GetString) NONE(fmi2SetInteger) NONE(fmi2SetBoolean) NONE(fmi2SetString)
NONE(fmi2GetFMUstate) NONE(fmi2SetFMUstate) NONE(fmi2FreeFMUstate) NONE(fmi2SerializedFMUstateSize) NONE(fmi2SerializeFMUstate)
NONE(fmi2DeSerializeFMUstate) NONE(fmi2GetDirectionalDerivative) NONE(fmi2SetRealInputDerivatives) NONE(fmi2GetRealOutputDerivatives)
