/* x' = -k x as an FMU of FMI 2.0 (V = 2) or 3.0 (V = 3), Model Exchange and Co-Simulation, y = x, one event indicator that
   never changes sign. The environment variable FAULT = "what call count" makes it do something in a call of that name, from
   the count-th one on. No header of FMI is needed. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <fenv.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

typedef struct { void (*logger)(void *, const char *, int, const char *, const char *, ...); void *a, *f, *s, *environment; } Callbacks;
typedef struct {
    double x, k, t;
    Callbacks callbacks;
    void (*log)(void *, int, const char *, const char *);
    void *environment;
} M;

static char what[32] = "", call[32] = "";
static int from = 1, count = 0;
__attribute__((constructor)) static void read_fault(void) {
    const char *fault = getenv("FAULT");
    if (fault) sscanf(fault, "%31s %31s %d", what, call, &from);
}
static int is(const char *name) { return !strcmp(what, name); }
static void say(M *m, const char *text) {
    if (m && m->callbacks.logger) m->callbacks.logger(m->callbacks.environment, "f", 1, "c", "%s", text);
    if (m && m->log) m->log(m->environment, 1, "c", text);
}
static void child(int leaves) {
    if (fork() == 0) {
        if (leaves) setsid();
        sleep(60);
        _exit(0);
    }
}
static void *crash_of_thread(void *p) { *(volatile int *)p = 1; return 0; }
static void *abort_of_thread(void *p) { (void)p; abort(); }
static void exit_again(void) { _exit(0); }
static void exit_never(void) { for (;;) sleep(1); }
static void exit_badly(void) { *(volatile int *)8 = 1; }
/* Uses up the stack: each call is needed by the one before. */
static int deeper(volatile char *p) { volatile char more[4096]; more[0] = *p; return deeper(more) + more[0]; }
static void limit(int what, rlim_t to) { struct rlimit l = {to, to}; setrlimit(what, &l); }
/* What it does to the process that it is in, which goes on. */
static int around(M *m) {
    if (is("chdir")) return chdir("/");
    if (is("close1")) close(1);
    if (is("close2")) close(2);
    if (is("closes")) for (int i = 0; i < 256; i++) close(i);
    if (is("nowhere")) for (int i = 0, n = open("/dev/null", O_RDWR); i < 3; i++) dup2(n, i);
    if (is("ignores")) for (int i = 1; i < 32; i++) signal(i, SIG_IGN);
    if (is("defaults")) for (int i = 1; i < 32; i++) signal(i, SIG_DFL);
    if (is("blocks")) { sigset_t all; sigfillset(&all); sigprocmask(SIG_BLOCK, &all, 0); }
    if (is("alarm")) { alarm(1); usleep(1200000); }
    if (is("atexit_exits")) atexit(exit_again);
    if (is("atexit_hangs")) atexit(exit_never);
    if (is("atexit_crashes")) atexit(exit_badly);
    if (is("file_size")) limit(RLIMIT_FSIZE, 0);
    if (is("files")) limit(RLIMIT_NOFILE, 3);
    if (is("memory")) limit(RLIMIT_AS, 1 << 20);
    if (is("traps")) feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
    if (is("rounds")) fesetround(FE_UPWARD);
    if (is("forks")) fork();
    if (is("session_of_its_own")) setsid();
    if (is("mask")) umask(0777);
    if (is("environment")) clearenv();
    if (is("slow")) usleep(300000);
    if (is("prints")) for (int i = 0; i < 200000; i++) puts("1,2,3,4");
    if (is("prints2")) for (int i = 0; i < 200000; i++) fputs("error: nothing\n", stderr);
    if (is("no_text")) say(m, "\xff\xfe\x80 no UTF-8");
    if (is("escapes")) say(m, "\033[2J\033]0;title\007\r\nerror: a line of its own");
    if (is("empty")) say(m, "");
    return 0;
}
static void *exit_of_thread(void *p) { (void)p; _exit(0); }
static int spins;
/* What a fault does that is none of values; the status to return. */
static int in(M *m, const char *name) {
    if (strcmp(name, call) || ++count < from) return 0;
    if (count == from && around(m)) return 3;
    if (is("_exit")) _exit(0);
    if (is("exit_group")) syscall(SYS_exit_group, 0);
    if (is("exit")) exit(0);
    if (is("quick_exit")) quick_exit(0);
    if (is("exec")) execl("/bin/true", "true", (char *)0);
    if (is("daemon")) if (daemon(1, 1)) return 3;
    if (is("thread_exits")) { pthread_t t; pthread_create(&t, 0, exit_of_thread, 0); for (;;) sleep(1); }
    if (is("thread_crashes")) { pthread_t t; pthread_create(&t, 0, crash_of_thread, (void *)8); for (;;) sleep(1); }
    if (is("thread_aborts")) { pthread_t t; pthread_create(&t, 0, abort_of_thread, 0); for (;;) sleep(1); }
    if (is("overflow")) return deeper((volatile char *)what);
    if (is("segv")) *(volatile int *)8 = 1;
    if (is("abort")) abort();
    if (is("trap")) __builtin_trap();
    if (is("kill")) raise(SIGKILL);
    if (is("term_default")) { signal(SIGTERM, SIG_DFL); raise(SIGTERM); }
    if (is("deaf")) for (int i = 1; i < 32; i++) signal(i, SIG_IGN);
    if (is("hang") || is("deaf")) for (;;) spins++;
    if (is("sleep")) for (;;) sleep(100);
    if (is("stop")) raise(SIGSTOP);
    if (is("child") && count == from) child(0);
    if (is("session") && count == from) child(1);
    if (is("long") && count == from) { char *b = malloc(50000001); memset(b, 'x', 50000000); b[50000000] = 0; say(m, b); free(b); }
    if (is("null") && count == from) say(m, 0);
    if (is("many") && count == from) for (int i = 0; i < 20000; i++) say(m, "one of many");
    if (is("warning")) return 1;
    if (is("discard")) return 2;
    if (is("error")) return 3;
    if (is("fatal")) return 4;
    if (is("pending")) return 5;
    if (is("status42")) return 42;
    if (is("status-1")) return -1;
    return 0;
}
/* What it does to values that it gives or was handed. */
/* Answers, and leaves what is to be written as it was. */
static int keeps(const char *name) { return !strcmp(name, call) && count >= from && is("keeps"); }
static void give(const char *name, double *v, size_t n) {
    if (strcmp(name, call) || count < from || !n) return;
    if (is("nan")) v[0] = NAN;
    if (is("inf")) v[0] = INFINITY;
}
static void handed(const char *name, const void *p, size_t bytes) {
    if (!strcmp(name, call) && count >= from && is("writes")) memset((void *)p, 0x41, bytes);
}
static M *make(void) { M *m = calloc(1, sizeof *m); m->x = 1, m->k = 1; return m; }
static int get(M *m, const unsigned r[], size_t n, double v[]) {
    int status = in(m, "get");
    if (keeps("get")) return status;
    for (size_t i = 0; i < n; i++) {
        switch (r[i]) {
        case 0: v[i] = m->x; break;
        case 1: v[i] = -m->k * m->x; break;
        case 3: v[i] = m->k; break;
        case 4: v[i] = m->x; break;
        case 9: v[i] = m->t; break;
        default: return 3;
        }
    }
    handed("get", r, n * sizeof *r);
    give("get", v, n);
    return status;
}
static int set(M *m, const unsigned r[], size_t n, const double v[]) {
    int status = in(m, "set");
    for (size_t i = 0; i < n; i++) {
        if (r[i] == 0) m->x = v[i];
        else if (r[i] == 3) m->k = v[i];
        else return 3;
    }
    handed("set", r, n * sizeof *r), handed("set", v, n * sizeof *v);
    return status;
}
static int do_step(M *m, double t, double h) {
    int status = in(m, "step");
    if (status > 1) return status;
    m->x *= exp(-m->k * h);
    m->t = t + h;
    if (count >= from && !strcmp(call, "step") && is("nan")) m->x = NAN;
    return status;
}
static int derivatives(M *m, double d[]) {
    int status = in(m, "derivatives");
    if (keeps("derivatives")) return status;
    d[0] = -m->k * m->x;
    int now = !strcmp(call, "derivatives") && count >= from;
    if (now && is("chatter")) d[0] = m->x > 0 ? -1e12 : 1e12;
    if (now && is("noise")) d[0] = rand() % 2000 - 1000;
    give("derivatives", d, 1);
    return status;
}
static int set_states(M *m, const double x[]) {
    int status = in(m, "set_states");
    m->x = x[0];
    handed("set_states", x, sizeof *x);
    return status;
}
static int get_states(M *m, double x[]) { int s = in(m, "get_states"); if (keeps("get_states")) return s; x[0] = m->x; give("get_states", x, 1); return s; }
static int indicators(M *m, double z[]) {
    int status = in(m, "indicators");
    if (keeps("indicators")) return status;
    z[0] = 1;
    if (!strcmp(call, "indicators") && count >= from) {
        if (is("chatter")) z[0] = ++spins & 1 ? 1 : -1;
        if (is("noise")) z[0] = sin(1e7 * m->t);
        if (is("zero")) z[0] = 0;
    }
    give("indicators", z, 1);
    return status;
}
/* Of discrete states: does it want another pass, when is the next event? */
static int discrete(M *m, int *again, int *defined, double *next) {
    int status = in(m, "discrete"), now = !strcmp(call, "discrete") && count >= from;
    *again = now && is("again");
    *defined = now && (is("past") || is("now") || is("next") || is("often") || is("nan"));
    *next = is("past") ? m->t - 1 : is("now") ? m->t : is("next") ? nextafter(m->t, 1e9) : is("often") ? m->t + 1e-6 : NAN;
    return status;
}

static double nominal(void) {
    int now = !strcmp(call, "nominals");
    return now && is("zero") ? 0 : now && is("negative") ? -1 : 1;
}
/* How many there are, of FMI 3.0. */
static size_t counted(const char *name) {
    if (strcmp(name, call)) return 1;
    return is("none") ? 0 : is("two") ? 2 : is("huge") ? (size_t)1 << 60 : 1;
}
/* Ends the run in the midst of a step, at a time that is none of it. */
static int lost(void) { return !strcmp(call, "step") && count >= from && (is("ends_nan") || is("ends_back") || is("ends_far")); }
static double nowhere(double t) { return is("ends_nan") ? NAN : is("ends_back") ? t - 1 : t + 1; }
static int ends(const char *name) { return !strcmp(call, name) && count >= from && is("ends"); }

#if V == 2
const char *fmi2GetVersion(void) { return "2.0"; }
const char *fmi2GetTypesPlatform(void) { return "default"; }
void *fmi2Instantiate(const char *n, int k, const char *g, const char *r, const Callbacks *c, int v, int l) {
    (void)n, (void)k, (void)g, (void)r, (void)v, (void)l;
    M *m = make();
    m->callbacks = *c;
    return in(m, "instantiate") > 1 ? NULL : m;
}
void fmi2FreeInstance(void *c) { in(c, "free"); free(c); }
int fmi2SetupExperiment(void *c, int d, double e, double s, int b, double z) { (void)d, (void)e, (void)b, (void)z; ((M *)c)->t = s; return 0; }
int fmi2EnterInitializationMode(void *c) { return in(c, "enter"); }
int fmi2ExitInitializationMode(void *c) { return in(c, "exit_initialization"); }
int fmi2Terminate(void *c) { return in(c, "terminate"); }
int fmi2GetReal(void *c, const unsigned r[], size_t n, double v[]) { return get(c, r, n, v); }
int fmi2SetReal(void *c, const unsigned r[], size_t n, const double v[]) { return set(c, r, n, v); }
int fmi2DoStep(void *c, double t, double h, int b) { (void)b; int s = do_step(c, t, h); return ends("step") || lost() ? 2 : s; }
int fmi2GetStatus(void *c, int k, int *v) { (void)c, (void)k; return *v = is("pending") ? 5 : 0, 0; }
int fmi2GetRealStatus(void *c, int k, double *v) { (void)k; return *v = lost() ? nowhere(((M *)c)->t) : ((M *)c)->t, 0; }
int fmi2GetBooleanStatus(void *c, int k, int *v) { (void)c, (void)k; return *v = ends("step") || lost(), 0; }
int fmi2EnterEventMode(void *c) { return in(c, "event_mode"); }
typedef struct { int again, terminate, nominals, states, defined; double next; } Info;
int fmi2NewDiscreteStates(void *c, Info *e) { memset(e, 0, sizeof *e); int s = discrete(c, &e->again, &e->defined, &e->next); return e->terminate = ends("discrete"), s; }
int fmi2EnterContinuousTimeMode(void *c) { return in(c, "continuous_mode"); }
int fmi2CompletedIntegratorStep(void *c, int b, int *e, int *t) { (void)b; return *e = *t = 0, in(c, "completed"); }
int fmi2SetTime(void *c, double t) { ((M *)c)->t = t; return in(c, "set_time"); }
int fmi2SetContinuousStates(void *c, const double x[], size_t n) { (void)n; return set_states(c, x); }
int fmi2GetDerivatives(void *c, double d[], size_t n) { (void)n; return derivatives(c, d); }
int fmi2GetEventIndicators(void *c, double z[], size_t n) { (void)n; return indicators(c, z); }
int fmi2GetContinuousStates(void *c, double x[], size_t n) { (void)n; return get_states(c, x); }
int fmi2GetNominalsOfContinuousStates(void *c, double x[], size_t n) { (void)n; int s = in(c, "nominals"); x[0] = nominal(); give("nominals", x, 1); return s; }
#else
#include <stdbool.h>
#include <stdint.h>
typedef void Log(void *, int, const char *, const char *);
const char *fmi3GetVersion(void) { return "3.0"; }
static void *instance(void *environment, Log *log) {
    M *m = make();
    m->environment = environment, m->log = log;
    return in(m, "instantiate") > 1 ? NULL : m;
}
void *fmi3InstantiateModelExchange(const char *n, const char *t, const char *r, bool v, bool l, void *e, Log *log) {
    return (void)n, (void)t, (void)r, (void)v, (void)l, instance(e, log);
}
void *fmi3InstantiateCoSimulation(const char *n, const char *t, const char *r, bool v, bool l, bool ev, bool early, const uint32_t *q,
                                  size_t nq, void *e, Log *log, void *u) {
    return (void)n, (void)t, (void)r, (void)v, (void)l, (void)ev, (void)early, (void)q, (void)nq, (void)u, instance(e, log);
}
void fmi3FreeInstance(void *c) { in(c, "free"); free(c); }
int fmi3EnterInitializationMode(void *c, bool d, double e, double s, bool b, double z) { (void)d, (void)e, (void)b, (void)z; ((M *)c)->t = s; return in(c, "enter"); }
int fmi3ExitInitializationMode(void *c) { return in(c, "exit_initialization"); }
int fmi3Terminate(void *c) { return in(c, "terminate"); }
int fmi3GetFloat64(void *c, const uint32_t r[], size_t n, double v[], size_t k) { (void)k; return get(c, r, n, v); }
int fmi3SetFloat64(void *c, const uint32_t r[], size_t n, const double v[], size_t k) { (void)k; return set(c, r, n, v); }
int fmi3DoStep(void *c, double t, double h, bool b, bool *event, bool *end, bool *early, double *last) {
    (void)b;
    int s = do_step(c, t, h);
    int now = !strcmp(call, "step") && count >= from;
    *event = now && is("event"), *end = ends("step") || lost(), *early = (now && is("early")) || lost();
    *last = now && is("early") ? t + h / 2 : now && is("last_nan") ? NAN : now && is("last_back") ? t - 1 : now && is("last_far") ? t + 10 * h : lost() ? nowhere(t) : t + h;
    return s;
}
int fmi3EnterEventMode(void *c) { return in(c, "event_mode"); }
int fmi3UpdateDiscreteStates(void *c, bool *again, bool *end, bool *nominals, bool *states, bool *defined, double *next) {
    int a, d, s = discrete(c, &a, &d, next);
    *again = a, *end = ends("discrete"), *nominals = *states = false, *defined = d;
    return s;
}
int fmi3EnterContinuousTimeMode(void *c) { return in(c, "continuous_mode"); }
int fmi3CompletedIntegratorStep(void *c, bool b, bool *e, bool *t) { (void)b; return *e = *t = false, in(c, "completed"); }
int fmi3SetTime(void *c, double t) { ((M *)c)->t = t; return in(c, "set_time"); }
int fmi3SetContinuousStates(void *c, const double x[], size_t n) { (void)n; return set_states(c, x); }
int fmi3GetContinuousStateDerivatives(void *c, double d[], size_t n) { (void)n; return derivatives(c, d); }
int fmi3GetEventIndicators(void *c, double z[], size_t n) { (void)n; return indicators(c, z); }
int fmi3GetContinuousStates(void *c, double x[], size_t n) { (void)n; return get_states(c, x); }
int fmi3GetNominalsOfContinuousStates(void *c, double x[], size_t n) { (void)n; int s = in(c, "nominals"); x[0] = nominal(); give("nominals", x, 1); return s; }
int fmi3GetNumberOfContinuousStates(void *c, size_t *n) { return *n = counted("states"), in(c, "states"); }
int fmi3GetNumberOfEventIndicators(void *c, size_t *n) { return *n = counted("number"), in(c, "number"); }
#endif
