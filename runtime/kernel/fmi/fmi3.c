/* FMI 3.0: the functions of the standard over the shared instance. */
#include "fmi3Functions.h"

#include <stdlib.h>
#include <string.h>

#include "instance.h"

enum { SOME_TIME = FMU_INITIALISATION | FMU_EVENT | FMU_CONTINUOUS | FMU_STEP | FMU_TERMINATED };
enum { ANY = SOME_TIME | FMU_INSTANTIATED };

/* What FMI 3 adds to the callbacks; kept in `update` behind the instance's life, not in its state. */
typedef struct extras {
    fmi3IntermediateUpdateCallback update;
    int early_return, event_mode;
} extras;

#define CHECK(modes, name)                                                     \
    do {                                                                       \
        if (!c) return fmi3Error;                                              \
        if (fmu_allowed((fmu *)c, modes, name)) return fmi3Error;              \
    } while (0)

typedef struct logger {
    fmi3LogMessageCallback call;
} logger;

static void tell(fmu *f, int status, const char *category, const char *message)
{
    const logger *l = f->callback;
    if (l->call) l->call(f->environment, (fmi3Status)status, category, message);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String names[])
{
    CHECK(ANY, "fmi3SetDebugLogging");
    return (fmi3Status)fmu_set_categories(c, on, n, names);
}

static fmi3Instance create(fmi3String name, fmi3String token, int co_simulation, fmi3InstanceEnvironment environment,
                           fmi3LogMessageCallback log, fmi3Boolean logging, extras more)
{
    logger *l = malloc(sizeof *l);
    extras *e = malloc(sizeof *e);
    fmu *f = NULL;
    if (l && e) {
        l->call = log;
        *e = more;
        f = fmu_create(name, token, co_simulation, tell, environment, l, logging);
    }
    if (!f) {
        free(l);
        free(e);
        return NULL;
    }
    f->update = e;
    return f;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    (void)resources;
    (void)visible;
    return create(name, token, 0, environment, log, logging, (extras){NULL, 0, 0});
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
    return create(name, token, 1, environment, log, logging, (extras){update, early_return, event_mode});
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback clock, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock)
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)clock;
    (void)lock;
    (void)unlock;
    if (log) log(environment, fmi3Error, "logStatusError", "the FMU has no Scheduled Execution");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance c)
{
    fmu *f = c;
    if (!f) return;
    free(f->callback);
    free(f->update);
    fmu_destroy(f);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop)
{
    CHECK(FMU_INSTANTIATED, "fmi3EnterInitializationMode");
    fmu *f = c;
    if (!mech_finite(start) || (stop_defined && !(stop >= start)))
        return (fmi3Status)fmu_fail(f, FMU_ERROR, "start %g and stop %g are no interval", start, stop);
    f->st->start = start;
    f->st->stop_defined = stop_defined;
    f->st->stop = stop_defined ? stop : start + (f->d->stop - f->d->t0);
    f->st->tolerance_defined = tolerance_defined;
    if (tolerance_defined) f->st->tolerance = tolerance;
    return (fmi3Status)fmu_enter_initialisation(f);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    CHECK(FMU_INITIALISATION, "fmi3ExitInitializationMode");
    fmu *f = c;
    const int status = fmu_exit_initialisation(f);
    if (!status && f->is_co_simulation && ((const extras *)f->update)->event_mode) f->st->mode = FMU_EVENT;
    return (fmi3Status)status;
}

fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    CHECK(FMU_CONTINUOUS | FMU_STEP, "fmi3EnterEventMode");
    fmu *f = c;
    if (f->is_co_simulation && !((const extras *)f->update)->event_mode)
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
    CHECK(ANY, "fmi3GetFloat64");
    if (n_values != n) return (fmi3Status)fmu_fail(c, FMU_ERROR, "all variables are scalars: give one value each");
    return (fmi3Status)fmu_get(c, vr, n, values);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[],
                          size_t n_values)
{
    CHECK(ANY & ~FMU_TERMINATED, "fmi3SetFloat64");
    if (n_values != n) return (fmi3Status)fmu_fail(c, FMU_ERROR, "all variables are scalars: give one value each");
    return (fmi3Status)fmu_set(c, vr, n, values);
}

static fmi3Status none(fmi3Instance c, size_t n, const char *name)
{
    CHECK(ANY, name);
    return n ? (fmi3Status)fmu_fail(c, FMU_ERROR, "%s: the model has no variable of this type", name) : fmi3OK;
}

#define NO_TYPE(type)                                                                                         \
    fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##type values[],    \
                             size_t n_values)                                                                 \
    {                                                                                                         \
        (void)vr;                                                                                             \
        (void)values;                                                                                         \
        (void)n_values;                                                                                       \
        return none(c, n, "fmi3Get" #type);                                                                   \
    }                                                                                                         \
    fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n,                         \
                             const fmi3##type values[], size_t n_values)                                      \
    {                                                                                                         \
        (void)vr;                                                                                             \
        (void)values;                                                                                         \
        (void)n_values;                                                                                       \
        return none(c, n, "fmi3Set" #type);                                                                   \
    }
NO_TYPE(Float32)
NO_TYPE(Int8)
NO_TYPE(UInt8)
NO_TYPE(Int16)
NO_TYPE(UInt16)
NO_TYPE(Int32)
NO_TYPE(UInt32)
NO_TYPE(Int64)
NO_TYPE(UInt64)
NO_TYPE(Boolean)
NO_TYPE(String)

#define NO_CALL(name, arguments)            \
    fmi3Status name arguments               \
    {                                       \
        return none(c, n, #name);           \
    }
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
#define REFERENCES fmi3Instance c, const fmi3ValueReference vr[], size_t n
NO_CALL(fmi3GetBinary, (REFERENCES, size_t sizes[], fmi3Binary values[], size_t n_values))
NO_CALL(fmi3SetBinary, (REFERENCES, const size_t sizes[], const fmi3Binary values[], size_t n_values))
NO_CALL(fmi3GetClock, (REFERENCES, fmi3Clock values[]))
NO_CALL(fmi3SetClock, (REFERENCES, const fmi3Clock values[]))
NO_CALL(fmi3GetIntervalDecimal, (REFERENCES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]))
NO_CALL(fmi3GetIntervalFraction,
        (REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]))
NO_CALL(fmi3GetShiftDecimal, (REFERENCES, fmi3Float64 shifts[]))
NO_CALL(fmi3GetShiftFraction, (REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[]))
NO_CALL(fmi3SetIntervalDecimal, (REFERENCES, const fmi3Float64 intervals[]))
NO_CALL(fmi3SetIntervalFraction, (REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))
NO_CALL(fmi3SetShiftDecimal, (REFERENCES, const fmi3Float64 shifts[]))
NO_CALL(fmi3SetShiftFraction, (REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))
NO_CALL(fmi3GetOutputDerivatives, (REFERENCES, const fmi3Int32 orders[], fmi3Float64 values[], size_t n_values))

static fmi3Status never(fmi3Instance c, const char *name)
{
    if (!c) return fmi3Error;
    return (fmi3Status)fmu_fail(c, FMU_ERROR, "%s is not offered by this FMU", name);
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t *n)
{
    return never(c, "fmi3GetNumberOfVariableDependencies");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent, size_t element_of_dependent[],
                                       fmi3ValueReference independents[], size_t elements[],
                                       fmi3DependencyKind kinds[], size_t n)
{
    return never(c, "fmi3GetVariableDependencies");
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { return never(c, "fmi3EnterConfigurationMode"); }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { return never(c, "fmi3ExitConfigurationMode"); }
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) { return never(c, "fmi3EvaluateDiscreteStates"); }

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 t)
{
    return never(c, "fmi3ActivateModelPartition");
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
    *size = fmu_state_size(c);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    CHECK(ANY, "fmi3SerializeFMUState");
    if (!state || size < fmu_state_size(c)) return (fmi3Status)fmu_fail(c, FMU_ERROR, "the state does not fit");
    memcpy(bytes, state, fmu_state_size(c));
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    CHECK(ANY, "fmi3DeserializeFMUState");
    if (fmu_check_state(c, bytes, size) || fmu_save(c, state)) return fmi3Error;
    memcpy(*state, bytes, size);
    return fmi3OK;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                        const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
{
    CHECK(SOME_TIME, "fmi3GetDirectionalDerivative");
    if (n_seed != n_knowns || n_sensitivity != n_unknowns)
        return (fmi3Status)fmu_fail(c, FMU_ERROR, "seeds belong to the knowns, sensitivities to the unknowns");
    return (fmi3Status)fmu_derivative(c, 0, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                    const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                    size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
{
    CHECK(SOME_TIME, "fmi3GetAdjointDerivative");
    if (n_seed != n_unknowns || n_sensitivity != n_knowns)
        return (fmi3Status)fmu_fail(c, FMU_ERROR, "seeds belong to the unknowns, sensitivities to the knowns");
    return (fmi3Status)fmu_derivative(c, 1, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity);
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *next_defined,
                                    fmi3Float64 *next)
{
    CHECK(FMU_EVENT, "fmi3UpdateDiscreteStates");
    int moved = 0;
    const int status = fmu_update(c, &moved);
    *again = *terminate = *nominals = *next_defined = fmi3False;
    *values = moved != 0;
    *next = 0;
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
    return n ? (fmi3Status)fmu_fail(c, FMU_ERROR, "the model has no event indicators") : fmi3OK;
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
    *n = 0;
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
    const extras *e = f->update;
    fmi3Boolean wanted = fmi3False;
    fmi3Float64 when = t;
    e->update(f->environment, t, fmi3False, fmi3True, fmi3True, e->early_return != 0, &wanted, &when);
    if (!wanted || !e->early_return) return 0;
    *until = when;
    return 1;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    CHECK(FMU_STEP, "fmi3DoStep");
    fmu *f = c;
    *event = *terminate = *early = fmi3False;
    mech_real reached = t;
    const int status = fmu_step(f, t, h, ((const extras *)f->update)->update ? ask : NULL, &reached);
    *last = reached;
    *early = !status && reached < t + h;
    return (fmi3Status)status;
}
