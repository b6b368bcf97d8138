/* Runs the Co-Simulation of an FMI 3 library and prints its states: run_library LIBRARY TOKEN STEP STEPS VR... */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3FunctionTypes.h"

#if defined(_WIN32)
#include <windows.h>
#define OPEN(path) (void *)LoadLibraryA(path)
#define FIND(library, name) (void *)GetProcAddress((HMODULE)library, name)
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#endif

static void tell(void *e, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)e;
    fprintf(stderr, "%d %s %s\n", (int)status, category, message);
}

int main(int argc, char **argv)
{
    void *library = argc > 5 ? OPEN(argv[1]) : NULL;
    if (!library) {
        fputs("the library cannot be loaded\n", stderr);
        return 2;
    }
    fmi3InstantiateCoSimulationTYPE *instantiate = FIND(library, "fmi3InstantiateCoSimulation");
    fmi3EnterInitializationModeTYPE *enter = FIND(library, "fmi3EnterInitializationMode");
    fmi3ExitInitializationModeTYPE *leave = FIND(library, "fmi3ExitInitializationMode");
    fmi3DoStepTYPE *step = FIND(library, "fmi3DoStep");
    fmi3GetFloat64TYPE *get = FIND(library, "fmi3GetFloat64");
    fmi3FreeInstanceTYPE *release = FIND(library, "fmi3FreeInstance");
    if (!instantiate || !enter || !leave || !step || !get || !release) return 3;
    fmi3Instance f = instantiate("f", argv[2], "", fmi3False, fmi3False, fmi3False, fmi3False, NULL, 0, NULL, tell, NULL);
    if (!f || enter(f, fmi3False, 0, 0, fmi3False, 0) || leave(f)) return 4;
    const double h = atof(argv[3]);
    for (int k = 0; k < atoi(argv[4]); k++) {
        fmi3Boolean b[3];
        fmi3Float64 last;
        if (step(f, k * h, h, fmi3True, b, b + 1, b + 2, &last)) return 5;
    }
    for (int i = 5; i < argc; i++) {
        const fmi3ValueReference vr = (fmi3ValueReference)atoi(argv[i]);
        double value;
        if (get(f, &vr, 1, &value, 1)) return 6;
        printf("%.17g\n", value);
    }
    release(f);
    return 0;
}
