/* Directional and adjoint derivatives, and derivatives by time. */
#include <string.h>

#include "instance.h"

/* Where the derivative by a known stands among the seeds of the tangent and the results of the adjoint. */
static int known_slot(const fmu *f, uint32_t vr)
{
    int i = 0;
    switch (fmu_find(f, vr, &i)) {
    case FMU_Y: return i;
    case FMU_U: return f->ny + i;
    case FMU_TIME: return f->ny + f->m->nu;
    case FMU_P: return f->d->p_settable[i] ? f->ny + f->m->nu + 1 + i : -1;
    default: return -1;
    }
}

/* The same for an unknown; a state counts from ny + n_outputs. */
static int unknown_slot(const fmu *f, uint32_t vr)
{
    int i = 0;
    switch (fmu_find(f, vr, &i)) {
    case FMU_DY: return i;
    case FMU_OUT: return f->ny + i;
    case FMU_Y: return f->ny + f->m->n_outputs + i;
    default: return -1;
    }
}

int fmu_derivative(fmu *f, int adjoint, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns,
                   size_t n_knowns, const mech_real *seed, mech_real *result)
{
    const int n_plain = f->ny + f->m->n_outputs;
    if (f->st->mode == FMU_INITIALISATION && !f->d->initial_is_free)
        return fmu_fail(f, FMU_ERROR, "derivatives are not available during initialisation: "
                                      "initial values depend on parameters or constraints");
    int status = fmu_refresh_initial(f);
    if (status) return status;
    for (size_t k = 0; k < n_unknowns; k++)
        if (unknown_slot(f, unknowns[k]) < 0)
            return fmu_fail(f, FMU_ERROR, "#%lu# is no unknown", (unsigned long)unknowns[k]);
    for (size_t k = 0; k < n_knowns; k++)
        if (known_slot(f, knowns[k]) < 0)
            return fmu_fail(f, FMU_ERROR, "#%lu# is no known", (unsigned long)knowns[k]);
    mech_real *seeds = f->z + f->d->nz, *out = f->scratch;
    memset(seeds, 0, (size_t)f->d->n_seeds * sizeof(mech_real));
    if (!adjoint) {
        for (size_t k = 0; k < n_knowns; k++) seeds[known_slot(f, knowns[k])] += seed[k];
        f->d->tangent(f->st->t, f->y, f->u, f->z, f->p, out);
        for (size_t k = 0; k < n_unknowns; k++) {
            const int i = unknown_slot(f, unknowns[k]);
            result[k] = i < n_plain ? out[i] : seeds[i - n_plain];
        }
    } else {
        for (size_t k = 0; k < n_unknowns; k++) {
            const int i = unknown_slot(f, unknowns[k]);
            if (i < n_plain) seeds[i] += seed[k];
        }
        f->d->adjoint(f->st->t, f->y, f->u, f->z, f->p, out);
        for (size_t k = 0; k < n_unknowns; k++) {
            const int i = unknown_slot(f, unknowns[k]);
            if (i >= n_plain) out[i - n_plain] += seed[k];
        }
        for (size_t k = 0; k < n_knowns; k++) result[k] = out[known_slot(f, knowns[k])];
    }
    memset(seeds, 0, (size_t)f->d->n_seeds * sizeof(mech_real));
    if (!fmu_finite(result, (int)(adjoint ? n_knowns : n_unknowns)))
        return fmu_undefined(f, "a partial derivative is not finite");
    return FMU_OK;
}

int fmu_output_derivative(fmu *f, uint32_t vr, int order, mech_real *result)
{
    int i = 0;
    const enum fmu_place place = fmu_find(f, vr, &i);
    if (order != 1) return fmu_fail(f, FMU_ERROR, "derivatives of outputs are of order 1, not %d", order);
    if (f->d->inputs_move) return fmu_fail(f, FMU_ERROR, "inputs move by themselves: derivatives of outputs are not known");
    int status = fmu_refresh_rates(f);
    if (status) return status;
    if (place == FMU_Y) {
        *result = f->dy[i];
    } else if (place == FMU_OUT) {
        mech_real *seeds = f->z + f->d->nz, *out = f->scratch;
        memset(seeds, 0, (size_t)f->d->n_seeds * sizeof(mech_real));
        memcpy(seeds, f->dy, (size_t)f->ny * sizeof(mech_real));
        seeds[f->ny + f->m->nu] = 1;
        f->d->tangent(f->st->t, f->y, f->u, f->z, f->p, out);
        memset(seeds, 0, (size_t)f->d->n_seeds * sizeof(mech_real));
        *result = out[f->ny + i];
    } else if (place == FMU_Z && f->d->z_type[i] == FMU_REAL) {
        *result = 0;
    } else {
        return fmu_fail(f, FMU_ERROR, "#%lu# is no output", (unsigned long)vr);
    }
    return fmu_finite(result, 1) ? FMU_OK : fmu_undefined(f, "a derivative of an output is not finite");
}
