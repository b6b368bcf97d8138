/* Arrays of FMI 3: a value reference stands for as many numbers as its variable has elements. */
#include "instance.h"

static size_t length(const fmu *f, uint32_t vr)
{
    if (!f->d->sizes) return 1;
    return vr < (uint32_t)f->d->n_sizes ? (size_t)f->d->sizes[vr] : 0;
}

/* FMU_OK if as many values are given as the variables have elements. */
static int check(fmu *f, const uint32_t *vr, size_t n, size_t n_values)
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++) {
        if (!length(f, vr[i])) return fmu_fail(f, FMU_ERROR, "there is no variable #%lu#", (unsigned long)vr[i]);
        count += length(f, vr[i]);
    }
    if (count == n_values) return FMU_OK;
    return fmu_fail(f, FMU_ERROR, "the variables have %lu elements, there are %lu values", (unsigned long)count,
                    (unsigned long)n_values);
}

int fmu_get_arrays(fmu *f, const uint32_t *vr, size_t n, mech_real *value, size_t n_values)
{
    int status = check(f, vr, n, n_values);
    if (!f->d->sizes) return status ? status : fmu_get(f, FMU_REAL, vr, n, value);
    for (size_t i = 0; i < n && !status; i++)
        for (size_t k = 0; k < length(f, vr[i]) && !status; k++) {
            const uint32_t element = vr[i] + (uint32_t)k;
            status = fmu_get(f, FMU_REAL, &element, 1, value++);
        }
    return status;
}

int fmu_set_arrays(fmu *f, const uint32_t *vr, size_t n, const mech_real *value, size_t n_values)
{
    int status = check(f, vr, n, n_values);
    if (!f->d->sizes) return status ? status : fmu_set(f, FMU_REAL, vr, n, value);
    for (size_t i = 0; i < n && !status; i++)
        for (size_t k = 0; k < length(f, vr[i]) && !status; k++) {
            const uint32_t element = vr[i] + (uint32_t)k;
            status = fmu_set(f, FMU_REAL, &element, 1, value++);
        }
    return status;
}

static void spread(const fmu *f, const uint32_t *vr, size_t n, uint32_t *elements)
{
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < length(f, vr[i]); k++) *elements++ = vr[i] + (uint32_t)k;
}

int fmu_derivative_arrays(fmu *f, int adjoint, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns,
                          size_t n_knowns, const mech_real *seed, size_t n_seed, mech_real *result, size_t n_result)
{
    const size_t nu = adjoint ? n_seed : n_result, nk = adjoint ? n_result : n_seed;
    if (check(f, unknowns, n_unknowns, nu) || check(f, knowns, n_knowns, nk)) return FMU_ERROR;
    if (!f->d->sizes) return fmu_derivative(f, adjoint, unknowns, nu, knowns, nk, seed, result);
    if (nu + nk > 2 * (size_t)f->d->n_sizes)
        return fmu_fail(f, FMU_ERROR, "a variable is given more than once");
    spread(f, unknowns, n_unknowns, f->elements);
    spread(f, knowns, n_knowns, f->elements + nu);
    return fmu_derivative(f, adjoint, f->elements, nu, f->elements + nu, nk, seed, result);
}
