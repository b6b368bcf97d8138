/* Random sequences of calls against an FMI 2 unit: no crash and no report of the sanitizers, whatever the order. */
#include "random_calls.h"

#include <stdarg.h>

#include "fmi2Functions.h"

static void tell(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String format, ...)
{
    (void)e;
    char text[2000];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (!name || strcmp(name, "f")) exit(3);
    hear((int)status, category, text);
}

/* The usual way, so that most of the random calls come where something happens. */
static void begin(fmi2Component f, int cs)
{
    fmi2EventInfo info;
    fmi2SetupExperiment(f, 0, 0, 0, 0, 0);
    fmi2EnterInitializationMode(f);
    fmi2ExitInitializationMode(f);
    if (cs) return;
    fmi2NewDiscreteStates(f, &info);
    fmi2EnterContinuousTimeMode(f);
}

int main(int argc, char **argv)
{
    const size_t n = (size_t)atoi(argv[argc - 2]), n_w = (size_t)atoi(argv[argc - 1]);
    fmi2CallbackFunctions functions = {tell, calloc, free, NULL, NULL};
    for (int run = 0; run < RUNS; run++) {
        const int cs = run % 2;
        fmi2Component f = fmi2Instantiate("f", cs ? fmi2CoSimulation : fmi2ModelExchange, argv[1], "", &functions, 0, 1);
        if (!f) return 4;
        fmi2FMUstate kept = NULL;
        double t = 0;
        if (draw(4)) begin(f, cs);
        for (int k = 0; k < CALLS; k++) {
            fmi2Boolean b[2];
            fmi2Integer i[2] = {1, 1};
            fmi2EventInfo info;
            double x[WIDE] = {0}, w[WIDE] = {1, 2, 3};
            fmi2ValueReference vr[2] = {draw(REFERENCES), draw(REFERENCES)};
            fmi2Status s = fmi2OK;
            const int before = complaints;
            for (size_t j = 3; j < n; j++) w[j] = 0.1 * draw(20) - 1;
            switch (draw(29)) {
            case 0: s = fmi2EnterInitializationMode(f); break;
            case 1: s = fmi2ExitInitializationMode(f); break;
            case 2: s = fmi2EnterEventMode(f); break;
            case 3: s = fmi2NewDiscreteStates(f, &info); break;
            case 4: s = fmi2EnterContinuousTimeMode(f); break;
            case 5: s = fmi2SetupExperiment(f, draw(2), 1e-6, 0, draw(2), 1); break;
            case 6: s = draw(4) ? fmi2OK : fmi2Terminate(f); break;
            case 7:
                s = draw(4) ? fmi2OK : fmi2Reset(f);
                t = 0;
                break;
            case 8: s = fmi2GetReal(f, vr, 2, x); break;
            case 9: x[0] = draw(9) ? draw(100) * 0.1 : 0.0 / (double)(t - t); s = fmi2SetReal(f, vr, 1, x); break;
            case 10: s = fmi2GetContinuousStates(f, x, n + draw(2)); break;
            case 11: s = fmi2SetContinuousStates(f, w, n); break;
            case 12: s = fmi2GetDerivatives(f, x, n); break;
            case 13: s = fmi2SetTime(f, draw(100) * 0.1); break;
            case 14: s = fmi2CompletedIntegratorStep(f, 1, b, b + 1); break;
            case 15:
            case 16:
            case 17: {
                const double h = draw(5) * 0.1;
                s = fmi2DoStep(f, t, h, 1);
                if (s == fmi2OK) t += h;
                break;
            }
            case 18: s = fmi2GetFMUstate(f, &kept); break;
            case 19: s = fmi2SetFMUstate(f, kept); break;
            case 20: s = fmi2GetDirectionalDerivative(f, vr, 1, vr + 1, 1, w, x); break;
            case 21: s = fmi2GetRealStatus(f, draw(2) ? fmi2LastSuccessfulTime : fmi2Terminated, x); break;
            case 22: {
                size_t size = 0;
                s = fmi2SerializedFMUstateSize(f, kept, &size);
                fmi2Byte *bytes = calloc(size + 1, 1);
                if (!bytes) return 5;
                if (kept) s = fmi2SerializeFMUstate(f, kept, bytes, size);
                if (draw(2)) s = fmi2DeSerializeFMUstate(f, bytes, size - draw(2), &kept);
                free(bytes);
                break;
            }
            case 23: s = fmi2GetEventIndicators(f, x, n_w + draw(2)); break;
            case 24: s = fmi2GetInteger(f, vr, 2, i); break;
            case 25: s = fmi2GetBoolean(f, vr, 2, b); break;
            case 26: s = fmi2GetRealOutputDerivatives(f, vr, 2, i, x); break;
            case 27: s = fmi2GetBooleanStatus(f, fmi2Terminated, b); break;
            default: s = fmi2GetNominalsOfContinuousStates(f, x, n); break;
            }
            /* whatever is not OK has been told with a reason */
            if (s != fmi2OK && complaints == before) return 6;
        }
        fmi2FreeFMUstate(f, &kept);
        fmi2FreeInstance(f);
    }
    printf("%d\n", told);
    return told > 0 ? 0 : 7;
}
