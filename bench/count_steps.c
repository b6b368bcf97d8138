/* Steps of the classical Runge-Kutta method, for a counter of instructions to watch: mech_advance is all that counts.
 *
 * count_steps KERNEL.so MODEL.so NUMBERS STEPS DT; NUMBERS holds y0, z and p (complete) as doubles.
 */
#include "solver.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

typedef const mech_model *get_model(void);
typedef int method_index(const char *);
typedef mech_solver *create(const mech_model *, const mech_options *);
typedef int advance(mech_solver *, mech_real, long);

static void *symbol(const char *file, const char *name)
{
    void *library = dlopen(file, RTLD_NOW);
    void *found = library ? dlsym(library, name) : NULL;
    if (!found) {
        fprintf(stderr, "%s\n", dlerror());
        exit(2);
    }
    return found;
}

int main(int count, char **words)
{
    if (count != 6) return 2;
    const mech_model *model = ((get_model *)symbol(words[2], "mech_model_get"))();
    const int ny = model->nq + model->nv + model->nx, n = ny + model->nz + model->np + model->nh;
    double *numbers = calloc((size_t)n + 1, sizeof *numbers), *sizes = calloc((size_t)ny + 1, sizeof *sizes);
    FILE *file = fopen(words[3], "rb");
    if (!file || fread(numbers, sizeof *numbers, (size_t)n, file) != (size_t)n) return 2;
    for (int i = 0; i < ny; i++) sizes[i] = 1e-8;
    const long steps = atol(words[4]);
    const double dt = atof(words[5]);
    const mech_options options = {.method = ((method_index *)symbol(words[1], "mech_method_index"))("rk4"),
                                  .dt = dt, .dt_max = (double)steps * dt, .rtol = 1e-8, .atol = sizes,
                                  .y0 = numbers, .z = numbers + ny, .p = numbers + ny + model->nz};
    mech_solver *solver = ((create *)symbol(words[1], "mech_create"))(model, &options);
    const int status = ((advance *)symbol(words[1], "mech_advance"))(solver, (double)(2 * steps) * dt, steps);
    return status < 0 ? 1 : 0;
}
