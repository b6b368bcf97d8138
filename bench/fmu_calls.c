/* Nanoseconds of the calls of an FMU, compiled together with its sources: TOKEN N. Prints one line for each case:
 * its name and the smallest of REPEATS means over N calls. CPU time, so that other work on the machine adds little.
 */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifdef FMI2
#include "fmi2Functions.h"
#else
#include "fmi3Functions.h"
#endif
#include "instance.h"

enum { REPEATS = 15 };
static double STEP = 0.01;
static double *rates, *states;
static size_t n;
static volatile double sink;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

#ifdef FMI2
typedef fmi2Component unit;
static void tell(void *e, const char *name, fmi2Status status, const char *category, const char *message, ...)
{
    (void)e, (void)name, (void)category;
    fprintf(stderr, "%d %s\n", (int)status, message);
}
static fmi2CallbackFunctions callbacks = {tell, calloc, free, NULL, NULL};
static unit begin(const char *token, int cs)
{
    unit f = fmi2Instantiate("f", cs ? fmi2CoSimulation : fmi2ModelExchange, token, "", &callbacks, 0, 0);
    if (!f || fmi2SetupExperiment(f, 1, 1e-6, 0, 0, 0) || fmi2EnterInitializationMode(f)) return NULL;
    return fmi2ExitInitializationMode(f) ? NULL : f;
}
#define set_time fmi2SetTime
#define set_states fmi2SetContinuousStates
#define get_states fmi2GetContinuousStates
#define get_rates fmi2GetDerivatives
#define free_unit fmi2FreeInstance
#define continuous fmi2EnterContinuousTimeMode
static int one_step(unit f, double t) { return fmi2DoStep(f, t, STEP, fmi2True); }
#else
typedef fmi3Instance unit;
static void tell(void *e, fmi3Status status, const char *category, const char *message)
{
    (void)e, (void)category;
    fprintf(stderr, "%d %s\n", (int)status, message);
}
static unit begin(const char *token, int cs)
{
    unit f = cs ? fmi3InstantiateCoSimulation("f", token, "", 0, 0, 0, 0, NULL, 0, NULL, tell, NULL)
                : fmi3InstantiateModelExchange("f", token, "", 0, 0, NULL, tell);
    if (!f || fmi3EnterInitializationMode(f, 1, 1e-6, 0, 0, 0)) return NULL;
    return fmi3ExitInitializationMode(f) ? NULL : f;
}
#define set_time fmi3SetTime
#define set_states fmi3SetContinuousStates
#define get_states fmi3GetContinuousStates
#define get_rates fmi3GetContinuousStateDerivatives
#define free_unit fmi3FreeInstance
#define continuous fmi3EnterContinuousTimeMode
static int one_step(unit f, double t)
{
    fmi3Boolean b[3];
    double reached;
    return fmi3DoStep(f, t, STEP, fmi3True, b, b + 1, b + 2, &reached);
}
#endif

/* One call of a case; a nonzero result ends the measurement. */
static int bare(unit f, long i)
{
    const fmu *g = f;
    states[0] += 1e-9;
    g->m->rhs(1e-9 * (double)i, states, g->u, g->z, g->p, rates);
    sink = rates[n - 1];
    return 0;
}

static int whole(unit f, long i)
{
    states[0] += 1e-9;
    const int wrong = set_time(f, 1e-9 * (double)i) || set_states(f, states, n) || get_rates(f, rates, n);
    sink = rates[n - 1];
    return wrong;
}

static int again(unit f, long i)
{
    (void)i;
    const int wrong = get_rates(f, rates, n);
    sink = rates[n - 1];
    return wrong;
}

static double reached;
static int step(unit f, long i)
{
    (void)i;
    const int wrong = one_step(f, reached);
    reached += STEP;
    return wrong;
}

static int measure(const char *name, int (*call)(unit, long), unit f, long count)
{
    double best = 1e300;
    for (int r = 0; r < REPEATS; r++) {
        const double begun = now();
        for (long i = 0; i < count; i++)
            if (call(f, i)) return 1;
        const double mean = (now() - begun) / (double)count;
        if (mean < best) best = mean;
    }
    printf("%s %.3f\n", name, best);
    return 0;
}

int main(int argc, char **argv)
{
    if (argc < 3) return 2;
    const long count = atol(argv[2]);
    unit me = begin(argv[1], 0), cs = begin(argv[1], 1);
    if (!me || !cs) return 3;
    n = (size_t)((fmu *)me)->ny;
    rates = calloc(n, sizeof *rates);
    states = calloc(n, sizeof *states);
#ifdef FMI2
    fmi2EventInfo info;
    int wrong = fmi2NewDiscreteStates(me, &info) != fmi2OK;
#else
    fmi3Boolean b[5];
    double next;
    int wrong = fmi3UpdateDiscreteStates(me, b, b + 1, b + 2, b + 3, b + 4, &next) != fmi3OK;
#endif
    wrong = wrong || continuous(me) || get_states(me, states, n) || measure("bare", bare, me, count)
            || measure("whole", whole, me, count) || measure("again", again, me, count)
            || measure("step", step, cs, count / 100);
    free_unit(me);
    free_unit(cs);
    free(rates);
    free(states);
    return wrong;
}
