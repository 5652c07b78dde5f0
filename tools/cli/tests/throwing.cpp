// An FMU of FMI 2.0 (Co-Simulation) that throws an exception which nobody catches.

#include <cstddef>
#include <stdexcept>

struct Callbacks {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(std::size_t, std::size_t);
    void (*free)(void *);
    void (*step_finished)(void *, int);
    void *environment;
};
static const Callbacks *callbacks;
static double now;

extern "C" {
void *fmi2Instantiate(const char *, int, const char *, const char *, const Callbacks *c, int, int) {
    return callbacks = c, &now;
}
void fmi2FreeInstance(void *) {}
int fmi2SetupExperiment(void *, int, double, double start, int, double) { return now = start, 0; }
int fmi2EnterInitializationMode(void *) { return 0; }
int fmi2ExitInitializationMode(void *) { return 0; }
int fmi2Terminate(void *) { return 0; }
int fmi2GetReal(void *, const unsigned *, std::size_t n, double *v) {
    for (std::size_t i = 0; i < n; i++) v[i] = now;
    return 0;
}
int fmi2SetReal(void *, const unsigned *, std::size_t, const double *) { return 0; }
int fmi2DoStep(void *, double t, double h, int) {
    if (t > 0.45) {
        callbacks->logger(callbacks->environment, "throwing", 1, "status", "about to throw at %g s", t);
        throw std::runtime_error("out of range");
    }
    return now = t + h, 0;
}
}
