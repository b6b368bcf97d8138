/* Random sequences of calls against an FMI 3 unit: no crash and no report of the sanitizers, whatever the order. */
#include "random_calls.h"

#include "fmi3Functions.h"

static fmi3Instance present;

static void tell(void *e, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)e;
    hear((int)status, category, message);
}

/* Calls from inside a step, allowed ones and others. */
static void intermediate(fmi3InstanceEnvironment e, fmi3Float64 t, fmi3Boolean set, fmi3Boolean get, fmi3Boolean done,
                         fmi3Boolean can_return, fmi3Boolean *wanted, fmi3Float64 *when)
{
    (void)e, (void)set, (void)get, (void)done, (void)can_return;
    double x[4] = {0}, seed = 1;
    fmi3ValueReference vr[2] = {draw(REFERENCES), draw(REFERENCES)};
    fmi3Boolean b[5];
    switch (draw(5)) {
    case 0: fmi3GetFloat64(present, vr, 2, x, 2); break;
    case 1: fmi3GetDirectionalDerivative(present, vr, 1, vr + 1, 1, &seed, 1, x, 1); break;
    case 2: fmi3DoStep(present, t, 0.1, 1, b, b + 1, b + 2, x); break;
    case 3: fmi3EnterEventMode(present); break;
    default: break;
    }
    *wanted = draw(8) == 0;
    *when = t + 0.01 * draw(3);
}

/* The usual way, so that most of the random calls come where something happens. */
static void begin(fmi3Instance f, int cs, int event_mode)
{
    fmi3Boolean b[5];
    double next;
    fmi3EnterInitializationMode(f, 0, 0, 0, 0, 0);
    fmi3ExitInitializationMode(f);
    if (!cs || event_mode) fmi3UpdateDiscreteStates(f, b, b + 1, b + 2, b + 3, b + 4, &next);
    if (!cs)
        fmi3EnterContinuousTimeMode(f);
    else if (event_mode)
        fmi3EnterStepMode(f);
}

int main(int argc, char **argv)
{
    (void)argc;
    for (int run = 0; run < RUNS; run++) {
        const int cs = run % 2, event_mode = draw(2);
        fmi3Instance f =
            cs ? fmi3InstantiateCoSimulation("f", argv[1], "", 0, 1, event_mode, draw(2), NULL, 0, NULL, tell,
                                             draw(2) ? intermediate : NULL)
               : fmi3InstantiateModelExchange("f", argv[1], "", 0, 1, NULL, tell);
        if (!f) return 4;
        present = f;
        fmi3FMUState kept = NULL;
        double t = 0;
        if (draw(4)) begin(f, cs, event_mode);
        for (int k = 0; k < CALLS; k++) {
            fmi3Boolean b[5];
            fmi3Int32 i[2] = {1, 1};
            double x[WIDE] = {0}, w[WIDE] = {1, 2, 3};
            fmi3ValueReference vr[2] = {draw(REFERENCES), draw(REFERENCES)};
            size_t n = 0, n_w = 0;
            fmi3Status s = fmi3OK;
            const int before = complaints;
            fmi3GetNumberOfContinuousStates(f, &n);
            fmi3GetNumberOfEventIndicators(f, &n_w);
            for (size_t j = 3; j < n; j++) w[j] = 0.1 * draw(20) - 1;
            switch (draw(28)) {
            case 0: s = fmi3EnterInitializationMode(f, draw(2), 1e-6, 0, draw(2), 1); break;
            case 1: s = fmi3ExitInitializationMode(f); break;
            case 2: s = fmi3EnterEventMode(f); break;
            case 3: s = fmi3UpdateDiscreteStates(f, b, b + 1, b + 2, b + 3, b + 4, x); break;
            case 4: s = fmi3EnterContinuousTimeMode(f); break;
            case 5: s = fmi3EnterStepMode(f); break;
            case 6: s = draw(4) ? fmi3OK : fmi3Terminate(f); break;
            case 7:
                s = draw(4) ? fmi3OK : fmi3Reset(f);
                t = 0;
                break;
            case 8: s = fmi3GetFloat64(f, vr, 2, x, 2); break;
            case 9: x[0] = draw(9) ? draw(100) * 0.1 : 0.0 / (double)(t - t); s = fmi3SetFloat64(f, vr, 1, x, 1); break;
            case 10: s = fmi3GetContinuousStates(f, x, n + draw(2)); break;
            case 11: s = fmi3SetContinuousStates(f, w, n); break;
            case 12: s = fmi3GetContinuousStateDerivatives(f, x, n); break;
            case 13: s = fmi3SetTime(f, draw(100) * 0.1); break;
            case 14: s = fmi3CompletedIntegratorStep(f, 1, b, b + 1); break;
            case 15:
            case 16:
            case 17:
                s = fmi3DoStep(f, t, draw(5) * 0.1, 1, b, b + 1, b + 2, x);
                if (s == fmi3OK) t = x[0];
                break;
            case 18: s = fmi3GetFMUState(f, &kept); break;
            case 19: s = fmi3SetFMUState(f, kept); break;
            case 20: s = fmi3GetDirectionalDerivative(f, vr, 1, vr + 1, 1, w, 1, x, 1); break;
            case 21: s = fmi3GetAdjointDerivative(f, vr, 1, vr + 1, 1, w, 1, x, 1); break;
            case 22: {
                size_t size = 0;
                s = fmi3SerializedFMUStateSize(f, kept, &size);
                fmi3Byte *bytes = calloc(size + 1, 1);
                if (!bytes) return 5;
                if (kept) s = fmi3SerializeFMUState(f, kept, bytes, size);
                if (draw(2)) s = fmi3DeserializeFMUState(f, bytes, size - draw(2), &kept);
                free(bytes);
                break;
            }
            case 23: s = fmi3GetEventIndicators(f, x, n_w + draw(2)); break;
            case 24: s = fmi3GetInt32(f, vr, 2, i, 2); break;
            case 25: s = fmi3GetBoolean(f, vr, 2, b, 2); break;
            case 26: s = fmi3GetOutputDerivatives(f, vr, 2, i, x, 2); break;
            default: s = fmi3GetNominalsOfContinuousStates(f, x, n); break;
            }
            /* whatever is not OK has been told with a reason */
            if (s != fmi3OK && complaints == before) return 6;
        }
        fmi3FreeFMUState(f, &kept);
        fmi3FreeInstance(f);
    }
    printf("%d\n", told);
    return told > 0 ? 0 : 7;
}
