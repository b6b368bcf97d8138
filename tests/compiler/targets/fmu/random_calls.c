/* Random sequences of calls against an FMI 3 unit: no crash and no report of the sanitizers, whatever the order. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi3Functions.h"

static uint64_t state = 88172645463325252u;

static unsigned draw(unsigned n)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (unsigned)(state >> 33) % n;
}

static int told;
static void tell(void *e, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)e;
    if (status < fmi3Discard || !category || !message || !*message) exit(3);
    told++;
}

int main(int argc, char **argv)
{
    (void)argc;
    for (int run = 0; run < 300; run++) {
        const int cs = run % 2;
        fmi3Instance f = cs ? fmi3InstantiateCoSimulation("f", argv[1], "", 0, 1, draw(2), draw(2), NULL, 0, NULL,
                                                          tell, NULL)
                            : fmi3InstantiateModelExchange("f", argv[1], "", 0, 1, NULL, tell);
        if (!f) return 4;
        fmi3FMUState kept = NULL;
        double t = 0;
        for (int k = 0; k < 60; k++) {
            fmi3Boolean b[5];
            double x[16] = {0}, w[16] = {1, 2, 3};
            fmi3ValueReference vr[2] = {draw(24), draw(24)};
            size_t n = 0;
            fmi3Status s = fmi3OK;
            const int before = told;
            fmi3GetNumberOfContinuousStates(f, &n);
            switch (draw(23)) {
            case 0: s = fmi3EnterInitializationMode(f, draw(2), 1e-6, 0, draw(2), 1); break;
            case 1: s = fmi3ExitInitializationMode(f); break;
            case 2: s = fmi3EnterEventMode(f); break;
            case 3: s = fmi3UpdateDiscreteStates(f, b, b + 1, b + 2, b + 3, b + 4, x); break;
            case 4: s = fmi3EnterContinuousTimeMode(f); break;
            case 5: s = fmi3EnterStepMode(f); break;
            case 6: s = fmi3Terminate(f); break;
            case 7: s = draw(4) ? fmi3OK : fmi3Reset(f); break;
            case 8: s = fmi3GetFloat64(f, vr, 2, x, 2); break;
            case 9: x[0] = draw(9) ? draw(100) * 0.1 : 0.0 / (double)(t - t); s = fmi3SetFloat64(f, vr, 1, x, 1); break;
            case 10: s = fmi3GetContinuousStates(f, x, n + draw(2)); break;
            case 11: s = fmi3SetContinuousStates(f, w, n); break;
            case 12: s = fmi3GetContinuousStateDerivatives(f, x, n); break;
            case 13: s = fmi3SetTime(f, draw(100) * 0.1); break;
            case 14: s = fmi3CompletedIntegratorStep(f, 1, b, b + 1); break;
            case 15:
            case 16:
                s = fmi3DoStep(f, t, draw(5) * 0.1, 1, b, b + 1, b + 2, x);
                if (s == fmi3OK) t = x[0];
                break;
            case 17: s = fmi3GetFMUState(f, &kept); break;
            case 18: s = fmi3SetFMUState(f, kept); break;
            case 19: s = fmi3GetDirectionalDerivative(f, vr, 1, vr + 1, 1, w, 1, x, 1); break;
            case 20: s = fmi3GetAdjointDerivative(f, vr, 1, vr + 1, 1, w, 1, x, 1); break;
            case 21: {
                size_t size = 0;
                s = fmi3SerializedFMUStateSize(f, kept, &size);
                fmi3Byte *bytes = calloc(size + 1, 1);
                if (!bytes) return 5;
                if (kept) s = fmi3SerializeFMUState(f, kept, bytes, size);
                if (draw(2)) s = fmi3DeserializeFMUState(f, bytes, size - draw(2), &kept);
                free(bytes);
                break;
            }
            default: s = fmi3GetNominalsOfContinuousStates(f, x, n); break;
            }
            /* whatever is not OK has been told with a reason */
            if (s != fmi3OK && told == before) return 6;
        }
        fmi3FreeFMUState(f, &kept);
        fmi3FreeInstance(f);
    }
    printf("%d\n", told);
    return told > 0 ? 0 : 7;
}
