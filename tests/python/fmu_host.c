/* Runs a library of an FMU by Co-Simulation, on whatever platform this is compiled for:

     fmu_host LIBRARY 2|3 TOKEN STEP INPUT BOOLEAN OUTPUT...

   Numbers behind STEP (in s, written as C writes %a) are value references: of a real input, a Boolean output, real outputs. Each
   line of standard input is the input's value during a step; each line of output what came of it, as %a. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"
#ifdef _WIN32
#include <windows.h>
static void *library(const char *path) {
    void *it = (void *)LoadLibraryA(path);
    if (!it) fprintf(stderr, "LoadLibrary: error %lu\n", (unsigned long)GetLastError());
    return it;
}
static void *symbol(void *library, const char *name) { return (void *)GetProcAddress(library, name); }
#else
#include <dlfcn.h>
static void *library(const char *path) {
    void *it = dlopen(path, RTLD_NOW);
    if (!it) fprintf(stderr, "%s\n", dlerror());
    return it;
}
static void *symbol(void *library, const char *name) { return dlsym(library, name); }
#endif

#define OUTPUTS 16

static void *loaded;
static void *function(const char *name) {
    void *it = symbol(loaded, name);
    if (!it) {
        fprintf(stderr, "%s is missing\n", name);
        exit(1);
    }
    return it;
}
#define F(name) ((name##TYPE *)function(#name))

static void logged2(fmi2ComponentEnvironment e, fmi2String instance, fmi2Status status, fmi2String category, fmi2String text, ...) {
    va_list rest;
    (void)e, (void)instance, (void)status, (void)category;
    va_start(rest, text);
    vfprintf(stderr, text, rest);
    va_end(rest);
    fputc('\n', stderr);
}
static void logged3(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text) {
    (void)e, (void)status, (void)category;
    fprintf(stderr, "%s\n", text);
}

static void demand(int status, const char *what) {
    if (status != 0) {
        fprintf(stderr, "%s: status %d\n", what, status);
        exit(1);
    }
}
/* From a line; not by scanf, which reads no hexadecimal digits under old versions of wine. */
static int read_number(double *value) {
    char line[64], *end;
    if (!fgets(line, sizeof line, stdin)) return 0;
    *value = strtod(line, &end);
    return end != line;
}
static void print(int sticking, const double *values, int n) {
    printf("%d", sticking);
    for (int i = 0; i < n; i++) printf(" %a", values[i]);
    putchar('\n');
}

static void run2(const char *token, double step, fmi2ValueReference input, fmi2ValueReference flag, const fmi2ValueReference *outputs, int n) {
    static const fmi2CallbackFunctions callbacks = {logged2, calloc, free, 0, 0};
    fmi2Component c = F(fmi2Instantiate)("host", fmi2CoSimulation, token, "", &callbacks, fmi2False, fmi2True);
    demand(c == 0, "fmi2Instantiate");
    demand(F(fmi2SetupExperiment)(c, fmi2False, 0, 0, fmi2False, 0), "fmi2SetupExperiment");
    demand(F(fmi2EnterInitializationMode)(c), "fmi2EnterInitializationMode");
    demand(F(fmi2ExitInitializationMode)(c), "fmi2ExitInitializationMode");
    double u, y[OUTPUTS];
    for (long k = 0; read_number(&u); k++) {
        fmi2Boolean sticking;
        demand(F(fmi2SetReal)(c, &input, 1, &u), "fmi2SetReal");
        demand(F(fmi2DoStep)(c, k * step, step, fmi2True), "fmi2DoStep");
        demand(F(fmi2GetReal)(c, outputs, n, y), "fmi2GetReal");
        demand(F(fmi2GetBoolean)(c, &flag, 1, &sticking), "fmi2GetBoolean");
        print(sticking, y, n);
    }
    demand(F(fmi2Terminate)(c), "fmi2Terminate");
    F(fmi2FreeInstance)(c);
}

static void run3(const char *token, double step, fmi3ValueReference input, fmi3ValueReference flag, const fmi3ValueReference *outputs, int n) {
    fmi3Instance c = F(fmi3InstantiateCoSimulation)("host", token, 0, fmi3False, fmi3True, fmi3False, fmi3False, 0, 0, 0, logged3, 0);
    demand(c == 0, "fmi3InstantiateCoSimulation");
    demand(F(fmi3EnterInitializationMode)(c, fmi3False, 0, 0, fmi3False, 0), "fmi3EnterInitializationMode");
    demand(F(fmi3ExitInitializationMode)(c), "fmi3ExitInitializationMode");
    double u, y[OUTPUTS];
    for (long k = 0; read_number(&u); k++) {
        fmi3Boolean sticking, events, terminate, early;
        double reached;
        demand(F(fmi3SetFloat64)(c, &input, 1, &u, 1), "fmi3SetFloat64");
        demand(F(fmi3DoStep)(c, k * step, step, fmi3True, &events, &terminate, &early, &reached), "fmi3DoStep");
        demand(F(fmi3GetFloat64)(c, outputs, n, y, n), "fmi3GetFloat64");
        demand(F(fmi3GetBoolean)(c, &flag, 1, &sticking, 1), "fmi3GetBoolean");
        print(sticking, y, n);
    }
    demand(F(fmi3Terminate)(c), "fmi3Terminate");
    F(fmi3FreeInstance)(c);
}

int main(int count, char **words) {
    unsigned outputs[OUTPUTS];
    int n = count - 7;
    if (n < 1 || n > OUTPUTS) {
        fprintf(stderr, "usage: fmu_host LIBRARY 2|3 TOKEN STEP INPUT BOOLEAN OUTPUT...\n");
        return 2;
    }
    for (int i = 0; i < n; i++) outputs[i] = strtoul(words[7 + i], 0, 10);
    loaded = library(words[1]);
    if (!loaded) return 1;
    double step = strtod(words[4], 0);
    unsigned input = strtoul(words[5], 0, 10), flag = strtoul(words[6], 0, 10);
    (words[2][0] == '2' ? run2 : run3)(words[3], step, input, flag, outputs, n);
    return 0;
}
