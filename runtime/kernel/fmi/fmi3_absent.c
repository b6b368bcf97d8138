/* FMI 3.0: functions for what this FMU does not have. They are exported all the same, and say so. */
#include "fmi3Functions.h"

#include "instance.h"

enum { ANY = 255 };

#define CHECK(modes, name)                                                     \
    do {                                                                       \
        if (!c) return fmi3Error;                                              \
        if (fmu_allowed((fmu *)c, modes, name)) return fmi3Error;              \
    } while (0)

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
NO_TYPE(UInt32)
NO_TYPE(Int64)
NO_TYPE(UInt64)
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
