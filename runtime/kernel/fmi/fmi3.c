/* FMI 3.0: the functions of the standard over the shared instance. */
#include "fmi3Functions.h"

#include <stdlib.h>
#include <string.h>

#include "instance.h"

enum { SOME_TIME = FMU_INITIALISATION | FMU_EVENT | FMU_CONTINUOUS | FMU_STEP | FMU_TERMINATED };
enum { ANY = SOME_TIME | FMU_INSTANTIATED };

#define CHECK(modes, name)                                                     \
    do {                                                                       \
        if (!c) return fmi3Error;                                              \
        if (fmu_allowed((fmu *)c, modes, name)) return fmi3Error;              \
    } while (0)

/* Pointers to functions do not fit into pointers to data. */
typedef struct callbacks {
    fmi3LogMessageCallback log;
    fmi3IntermediateUpdateCallback update;
} callbacks;

static void tell(fmu *f, int status, const char *category, const char *message)
{
    const callbacks *own = f->callback;
    if (own->log) own->log(f->environment, (fmi3Status)status, category, message);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String names[])
{
    CHECK(ANY, "fmi3SetDebugLogging");
    return (fmi3Status)fmu_set_categories(c, on, n, names);
}

static fmu *create(fmi3String name, fmi3String token, int co_simulation, fmi3InstanceEnvironment environment,
                   fmi3Boolean logging, callbacks wanted)
{
    callbacks *own = malloc(sizeof *own);
    if (!own) return NULL;
    *own = wanted;
    fmu *f = fmu_create(name, token, co_simulation, tell, environment, own, logging);
    if (!f) free(own);
    return f;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    (void)resources;
    (void)visible;
    return create(name, token, 0, environment, logging, (callbacks){log, NULL});
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode,
                                         fmi3Boolean early_return, const fmi3ValueReference required[],
                                         size_t n_required, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    (void)resources;
    (void)visible;
    (void)required;
    (void)n_required;
    fmu *f = create(name, token, 1, environment, logging, (callbacks){log, update});
    if (!f) return NULL;
    f->early_return = early_return != 0;
    f->event_mode = event_mode != 0;
    return f;
}

void fmi3FreeInstance(fmi3Instance c)
{
    fmu *f = c;
    if (!f) return;
    free(f->callback);
    fmu_destroy(f);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop)
{
    CHECK(FMU_INSTANTIATED, "fmi3EnterInitializationMode");
    const int status = fmu_plan_experiment(c, tolerance_defined, tolerance, start, stop_defined, stop);
    return (fmi3Status)(status ? status : fmu_enter_initialisation(c));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    CHECK(FMU_INITIALISATION, "fmi3ExitInitializationMode");
    return (fmi3Status)fmu_exit_initialisation(c);
}

fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    CHECK(FMU_CONTINUOUS | FMU_STEP, "fmi3EnterEventMode");
    fmu *f = c;
    if (f->is_co_simulation && !f->event_mode)
        return (fmi3Status)fmu_fail(f, FMU_ERROR, "the instance was made without event mode");
    f->st->mode = FMU_EVENT;
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance c)
{
    CHECK(FMU_EVENT | FMU_CONTINUOUS | FMU_STEP, "fmi3Terminate");
    ((fmu *)c)->st->mode = FMU_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c)
{
    CHECK(ANY, "fmi3Reset");
    fmu_reset(c);
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[],
                          size_t n_values)
{
    CHECK(ANY | FMU_INTERMEDIATE, "fmi3GetFloat64");
    return (fmi3Status)fmu_get_arrays(c, vr, n, values, n_values);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[],
                          size_t n_values)
{
    CHECK(ANY & ~FMU_TERMINATED, "fmi3SetFloat64");
    return (fmi3Status)fmu_set_arrays(c, vr, n, values, n_values);
}

/* Integers and truth values are numbers inside. */
#define TYPE(own, type)                                                                                      \
    fmi3Status fmi3Get##own(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##own values[],     \
                            size_t n_values)                                                                 \
    {                                                                                                        \
        CHECK(ANY | FMU_INTERMEDIATE, "fmi3Get" #own);                                                       \
        int status = FMU_OK;                                                                                 \
        if (n_values != n) status = fmu_fail(c, FMU_ERROR, "all variables are scalars: give one value each"); \
        for (size_t k = 0; k < n && !status; k++) {                                                          \
            mech_real number = 0;                                                                            \
            status = fmu_get(c, type, vr + k, 1, &number);                                                   \
            values[k] = (fmi3##own)number;                                                                   \
        }                                                                                                    \
        return (fmi3Status)status;                                                                           \
    }                                                                                                        \
    fmi3Status fmi3Set##own(fmi3Instance c, const fmi3ValueReference vr[], size_t n,                         \
                            const fmi3##own values[], size_t n_values)                                       \
    {                                                                                                        \
        CHECK(ANY & ~FMU_TERMINATED, "fmi3Set" #own);                                                        \
        int status = FMU_OK;                                                                                 \
        if (n_values != n) status = fmu_fail(c, FMU_ERROR, "all variables are scalars: give one value each"); \
        for (size_t k = 0; k < n && !status; k++) {                                                          \
            const mech_real number = values[k];                                                              \
            status = fmu_set(c, type, vr + k, 1, &number);                                                   \
        }                                                                                                    \
        return (fmi3Status)status;                                                                           \
    }
TYPE(Int32, FMU_INTEGER)
TYPE(Boolean, FMU_BOOLEAN)

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 orders[],
                                    fmi3Float64 values[], size_t n_values)
{
    CHECK(FMU_STEP | FMU_INTERMEDIATE | FMU_TERMINATED, "fmi3GetOutputDerivatives");
    int status = FMU_OK;
    if (n_values != n) status = fmu_fail(c, FMU_ERROR, "all variables are scalars: give one value each");
    for (size_t k = 0; k < n && !status; k++) status = fmu_output_derivative(c, vr[k], orders[k], values + k);
    return (fmi3Status)status;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    CHECK(ANY, "fmi3GetFMUState");
    return (fmi3Status)fmu_save(c, state);
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    CHECK(ANY, "fmi3SetFMUState");
    return (fmi3Status)fmu_load(c, state);
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    CHECK(ANY, "fmi3FreeFMUState");
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    CHECK(ANY, "fmi3SerializedFMUStateSize");
    *size = fmu_saved_size(c, state);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    CHECK(ANY, "fmi3SerializeFMUState");
    if (!state || size < fmu_saved_size(c, state)) return (fmi3Status)fmu_fail(c, FMU_ERROR, "the state does not fit");
    memcpy(bytes, state, fmu_saved_size(c, state));
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    CHECK(ANY, "fmi3DeserializeFMUState");
    if (fmu_check_state(c, bytes, size) || fmu_copy_state(c, bytes, size, state)) return fmi3Error;
    return fmi3OK;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                        const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
{
    CHECK(SOME_TIME | FMU_INTERMEDIATE, "fmi3GetDirectionalDerivative");
    return (fmi3Status)fmu_derivative_arrays(c, 0, unknowns, n_unknowns, knowns, n_knowns, seed, n_seed, sensitivity,
                                             n_sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                    const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                    size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
{
    CHECK(SOME_TIME | FMU_INTERMEDIATE, "fmi3GetAdjointDerivative");
    return (fmi3Status)fmu_derivative_arrays(c, 1, unknowns, n_unknowns, knowns, n_knowns, seed, n_seed, sensitivity,
                                             n_sensitivity);
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *next_defined,
                                    fmi3Float64 *next)
{
    CHECK(FMU_EVENT, "fmi3UpdateDiscreteStates");
    fmu_news news;
    const int status = fmu_update(c, &news);
    *again = news.again != 0;
    *terminate = news.ends != 0;
    *nominals = fmi3False;
    *values = news.moved != 0;
    *next_defined = mech_finite(news.next) != 0;
    *next = *next_defined ? news.next : 0;
    return (fmi3Status)status;
}

/* ---- Model Exchange ---- */

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    CHECK(FMU_EVENT, "fmi3EnterContinuousTimeMode");
    fmu *f = c;
    if (f->is_co_simulation) return (fmi3Status)fmu_fail(f, FMU_ERROR, "continuous time is for Model Exchange");
    f->st->mode = FMU_CONTINUOUS;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set, fmi3Boolean *event,
                                       fmi3Boolean *terminate)
{
    (void)no_set;
    CHECK(FMU_CONTINUOUS, "fmi3CompletedIntegratorStep");
    int wanted = 0;
    const int status = fmu_completed_step(c, &wanted);
    *event = wanted != 0;
    *terminate = fmi3False;
    return (fmi3Status)status;
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 t)
{
    CHECK(FMU_CONTINUOUS | FMU_EVENT, "fmi3SetTime");
    return (fmi3Status)fmu_set_time(c, t);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 y[], size_t n)
{
    CHECK(FMU_CONTINUOUS, "fmi3SetContinuousStates");
    return (fmi3Status)fmu_set_states(c, y, n);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dy[], size_t n)
{
    CHECK(SOME_TIME, "fmi3GetContinuousStateDerivatives");
    return (fmi3Status)fmu_get_rates(c, dy, n);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n)
{
    CHECK(SOME_TIME, "fmi3GetEventIndicators");
    return (fmi3Status)fmu_get_indicators(c, z, n);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 y[], size_t n)
{
    CHECK(SOME_TIME, "fmi3GetContinuousStates");
    return (fmi3Status)fmu_get_states(c, y, n);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominal[], size_t n)
{
    CHECK(SOME_TIME, "fmi3GetNominalsOfContinuousStates");
    fmu *f = c;
    if (n != (size_t)f->ny) return (fmi3Status)fmu_fail(f, FMU_ERROR, "the model has %d states", f->ny);
    memcpy(nominal, f->d->nominal, n * sizeof *nominal);
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n)
{
    CHECK(ANY, "fmi3GetNumberOfEventIndicators");
    *n = (size_t)((fmu *)c)->d->n_indicators;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n)
{
    CHECK(ANY, "fmi3GetNumberOfContinuousStates");
    *n = (size_t)((fmu *)c)->ny;
    return fmi3OK;
}

/* ---- Co-Simulation ---- */

fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    CHECK(FMU_EVENT, "fmi3EnterStepMode");
    fmu *f = c;
    if (!f->is_co_simulation) return (fmi3Status)fmu_fail(f, FMU_ERROR, "step mode is for Co-Simulation");
    f->st->mode = FMU_STEP;
    return fmi3OK;
}

static int ask(fmu *f, mech_real t, mech_real *until)
{
    const callbacks *own = f->callback;
    fmi3Boolean wanted = fmi3False;
    fmi3Float64 when = t;
    f->st->mode = FMU_INTERMEDIATE;
    own->update(f->environment, t, fmi3False, fmi3True, fmi3True, f->early_return != 0, &wanted, &when);
    f->st->mode = FMU_STEP;
    if (!wanted || !f->early_return) return 0;
    *until = when;
    return 1;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    (void)no_set;
    CHECK(FMU_STEP, "fmi3DoStep");
    fmu *f = c;
    fmu_news news;
    const int status = fmu_step(f, t, h, ((const callbacks *)f->callback)->update ? ask : NULL, &news);
    *event = news.event != 0;
    *terminate = news.ends != 0;
    *last = news.reached;
    *early = !status && news.reached < t + h;
    return (fmi3Status)status;
}
