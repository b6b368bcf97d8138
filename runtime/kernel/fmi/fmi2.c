/* FMI 2.0: the functions of the standard over the shared instance. */
#include "fmi2Functions.h"

#include <string.h>

#include "instance.h"

/* The headers that come with some tools know no prefix for functions that are linked statically (names.h). */
#ifdef MECH_PREFIX
#undef fmi2FullName
#define fmi2FullName(name) MECH_NAME(name)
#endif

enum { SOME_TIME = FMU_INITIALISATION | FMU_EVENT | FMU_CONTINUOUS | FMU_STEP | FMU_STEP_FAILED | FMU_TERMINATED };
enum { ANY = SOME_TIME | FMU_INSTANTIATED };

#define CHECK(modes, name)                                                          \
    do {                                                                            \
        if (!c) return fmi2Error;                                                   \
        if (fmu_allowed((fmu *)c, modes, name)) return fmi2Error;                   \
    } while (0)

static void tell(fmu *f, int status, const char *category, const char *message)
{
    const fmi2CallbackFunctions *functions = f->callback;
    /* the message is not a format */
    functions->logger(f->environment, f->name ? f->name : "", (fmi2Status)status, category, "%s", message);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    CHECK(ANY, "fmi2SetDebugLogging");
    return (fmi2Status)fmu_set_categories(c, on, n, names);
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)resources;
    (void)visible;
    if (!functions || !functions->logger) return NULL;
    return fmu_create(name, guid, type == fmi2CoSimulation, tell, functions->componentEnvironment,
                      (void *)functions, logging);
}

void fmi2FreeInstance(fmi2Component c) { fmu_destroy(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop)
{
    CHECK(FMU_INSTANTIATED, "fmi2SetupExperiment");
    return (fmi2Status)fmu_plan_experiment(c, tolerance_defined, tolerance, start, stop_defined, stop);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    CHECK(FMU_INSTANTIATED, "fmi2EnterInitializationMode");
    return (fmi2Status)fmu_enter_initialisation(c);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    CHECK(FMU_INITIALISATION, "fmi2ExitInitializationMode");
    return (fmi2Status)fmu_exit_initialisation(c);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    CHECK(FMU_EVENT | FMU_CONTINUOUS | FMU_STEP | FMU_STEP_FAILED, "fmi2Terminate");
    ((fmu *)c)->st->mode = FMU_TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    CHECK(ANY, "fmi2Reset");
    fmu_reset(c);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    CHECK(ANY, "fmi2GetReal");
    return (fmi2Status)fmu_get(c, FMU_REAL, vr, n, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    CHECK(ANY & ~FMU_TERMINATED, "fmi2SetReal");
    return (fmi2Status)fmu_set(c, FMU_REAL, vr, n, value);
}

/* Integers and truth values are numbers inside. */
#define TYPE(own, type)                                                                             \
    fmi2Status fmi2Get##own(fmi2Component c, const fmi2ValueReference vr[], size_t n,              \
                            fmi2##own value[])                                                      \
    {                                                                                               \
        CHECK(ANY, "fmi2Get" #own);                                                                 \
        int status = FMU_OK;                                                                        \
        for (size_t k = 0; k < n && !status; k++) {                                                 \
            mech_real number = 0;                                                                   \
            status = fmu_get(c, type, vr + k, 1, &number);                                          \
            value[k] = (fmi2##own)number;                                                           \
        }                                                                                           \
        return (fmi2Status)status;                                                                  \
    }                                                                                               \
    fmi2Status fmi2Set##own(fmi2Component c, const fmi2ValueReference vr[], size_t n,              \
                            const fmi2##own value[])                                                \
    {                                                                                               \
        CHECK(ANY & ~FMU_TERMINATED, "fmi2Set" #own);                                               \
        int status = FMU_OK;                                                                        \
        for (size_t k = 0; k < n && !status; k++) {                                                 \
            const mech_real number = value[k];                                                      \
            status = fmu_set(c, type, vr + k, 1, &number);                                          \
        }                                                                                           \
        return (fmi2Status)status;                                                                  \
    }
TYPE(Integer, FMU_INTEGER)
TYPE(Boolean, FMU_BOOLEAN)

/* A call for none is fine, any other is a mistake. */
#define NONE(name, arguments)                                                                       \
    fmi2Status name arguments                                                                       \
    {                                                                                               \
        (void)vr;                                                                                   \
        (void)value;                                                                                \
        CHECK(ANY, #name);                                                                          \
        if (!n) return fmi2OK;                                                                      \
        return (fmi2Status)fmu_fail(c, FMU_ERROR, #name ": the model has no such variable");        \
    }
NONE(fmi2GetString, (fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[]))
NONE(fmi2SetString, (fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[]))

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    CHECK(ANY, "fmi2GetFMUstate");
    return (fmi2Status)fmu_save(c, state);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    CHECK(ANY, "fmi2SetFMUstate");
    return (fmi2Status)fmu_load(c, state);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    CHECK(ANY, "fmi2FreeFMUstate");
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    CHECK(ANY, "fmi2SerializedFMUstateSize");
    *size = fmu_saved_size(c, state);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    CHECK(ANY, "fmi2SerializeFMUstate");
    if (!state || size < fmu_saved_size(c, state)) return (fmi2Status)fmu_fail(c, FMU_ERROR, "the state does not fit");
    memcpy(bytes, state, fmu_saved_size(c, state));
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    CHECK(ANY, "fmi2DeSerializeFMUstate");
    if (fmu_check_state(c, bytes, size) || fmu_copy_state(c, bytes, size, state)) return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t n_unknowns,
                                        const fmi2ValueReference knowns[], size_t n_knowns, const fmi2Real seed[],
                                        fmi2Real result[])
{
    CHECK(SOME_TIME, "fmi2GetDirectionalDerivative");
    return (fmi2Status)fmu_derivative(c, 0, unknowns, n_unknowns, knowns, n_knowns, seed, result);
}

/* ---- Model Exchange ---- */

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    CHECK(FMU_EVENT | FMU_CONTINUOUS, "fmi2EnterEventMode");
    ((fmu *)c)->st->mode = FMU_EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    CHECK(FMU_EVENT, "fmi2NewDiscreteStates");
    fmu_news news;
    const int status = fmu_update(c, &news);
    memset(info, 0, sizeof *info);
    info->newDiscreteStatesNeeded = news.again;
    info->terminateSimulation = news.ends;
    info->valuesOfContinuousStatesChanged = news.moved;
    info->nextEventTimeDefined = mech_finite(news.next);
    info->nextEventTime = info->nextEventTimeDefined ? news.next : 0;
    return (fmi2Status)status;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    CHECK(FMU_EVENT, "fmi2EnterContinuousTimeMode");
    ((fmu *)c)->st->mode = FMU_CONTINUOUS;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean *event,
                                       fmi2Boolean *terminate)
{
    (void)no_set;
    CHECK(FMU_CONTINUOUS, "fmi2CompletedIntegratorStep");
    int wanted = 0;
    const int status = fmu_completed_step(c, &wanted);
    *event = wanted;
    *terminate = fmi2False;
    return (fmi2Status)status;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t)
{
    CHECK(FMU_EVENT | FMU_CONTINUOUS, "fmi2SetTime");
    return (fmi2Status)fmu_set_time(c, t);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real y[], size_t n)
{
    CHECK(FMU_CONTINUOUS, "fmi2SetContinuousStates");
    return (fmi2Status)fmu_set_states(c, y, n);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dy[], size_t n)
{
    CHECK(SOME_TIME, "fmi2GetDerivatives");
    return (fmi2Status)fmu_get_rates(c, dy, n);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n)
{
    CHECK(SOME_TIME, "fmi2GetEventIndicators");
    return (fmi2Status)fmu_get_indicators(c, z, n);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real y[], size_t n)
{
    CHECK(SOME_TIME, "fmi2GetContinuousStates");
    return (fmi2Status)fmu_get_states(c, y, n);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominal[], size_t n)
{
    CHECK(ANY, "fmi2GetNominalsOfContinuousStates");
    fmu *f = c;
    if (n != (size_t)f->ny) return (fmi2Status)fmu_fail(f, FMU_ERROR, "the model has %d states", f->ny);
    memcpy(nominal, f->d->nominal, n * sizeof *nominal);
    return fmi2OK;
}

/* ---- Co-Simulation ---- */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    CHECK(ANY, "fmi2SetRealInputDerivatives");
    int status = FMU_OK;
    for (size_t k = 0; k < n && !status; k++) status = fmu_set_input_derivative(c, vr[k], order[k], value[k]);
    return (fmi2Status)status;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[])
{
    CHECK(FMU_STEP | FMU_STEP_FAILED | FMU_TERMINATED, "fmi2GetRealOutputDerivatives");
    int status = FMU_OK;
    for (size_t k = 0; k < n && !status; k++) status = fmu_output_derivative(c, vr[k], order[k], value + k);
    return (fmi2Status)status;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set)
{
    (void)no_set;
    CHECK(FMU_STEP, "fmi2DoStep");
    fmu *f = c;
    fmu_news news;
    int status = fmu_step(f, t, h, NULL, &news);
    /* the end of the simulation is told as a step that was not finished */
    if (!status && news.ends) status = fmu_fail(f, FMU_DISCARD, "the model has ended the simulation at time %g", f->st->t);
    if (status == FMU_DISCARD) f->st->mode = FMU_STEP_FAILED;
    return (fmi2Status)status;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    CHECK(ANY, "fmi2CancelStep");
    return (fmi2Status)fmu_fail(c, FMU_ERROR, "no step is in progress: steps are not asynchronous");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    CHECK(ANY, "fmi2GetRealStatus");
    if (kind != fmi2LastSuccessfulTime)
        return (fmi2Status)fmu_fail(c, FMU_DISCARD, "fmi2GetRealStatus knows the last successful time only");
    *value = ((fmu *)c)->st->t;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    CHECK(ANY, "fmi2GetBooleanStatus");
    if (kind != fmi2Terminated)
        return (fmi2Status)fmu_fail(c, FMU_DISCARD, "fmi2GetBooleanStatus knows the termination only");
    *value = ((fmu *)c)->st->ended ? fmi2True : fmi2False;
    return fmi2OK;
}

#define NO_STATUS(name, type)                                                                     \
    fmi2Status name(fmi2Component c, const fmi2StatusKind kind, type *value)                      \
    {                                                                                             \
        (void)kind;                                                                               \
        (void)value;                                                                              \
        CHECK(ANY, #name);                                                                        \
        return (fmi2Status)fmu_fail(c, FMU_DISCARD, #name ": steps are not asynchronous");        \
    }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetStringStatus, fmi2String)
