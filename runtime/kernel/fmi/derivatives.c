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

/* A state that is a known itself during initialisation. */
static int stated(const fmu *f, int i) { return f->y_set[i] || f->d->y_given[i]; }

/* J seed, with the initial state as a function of the other knowns. */
static void forward(fmu *f, int starting, mech_real *seeds, mech_real *out)
{
    if (starting) {
        f->d->start_tangent(f->st->t, f->y, f->u, f->z, f->p, out);
        for (int i = 0; i < f->ny; i++)
            if (!stated(f, i)) seeds[i] = out[i];
    }
    f->d->tangent(f->st->t, f->y, f->u, f->z, f->p, out);
}

/* J^T seed; `of_states` [ny] are seeds of the states themselves. */
static void backward(fmu *f, int starting, mech_real *seeds, const mech_real *of_states, mech_real *out)
{
    const int others = f->m->nu + 1 + f->m->np;
    mech_real *more = f->slopes + f->ny;
    f->d->adjoint(f->st->t, f->y, f->u, f->z, f->p, out);
    for (int i = 0; i < f->ny; i++) out[i] += of_states[i];
    if (!starting) return;
    memset(seeds, 0, (size_t)f->d->n_seeds * sizeof(mech_real));
    for (int i = 0; i < f->ny; i++) {
        if (stated(f, i)) continue;
        seeds[i] = out[i];
        out[i] = 0;
    }
    f->d->start_adjoint(f->st->t, f->y, f->u, f->z, f->p, more);
    for (int i = 0; i < others; i++) out[f->ny + i] += more[i];
}

int fmu_derivative(fmu *f, int adjoint, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns,
                   size_t n_knowns, const mech_real *seed, mech_real *result)
{
    const int n_plain = f->ny + f->m->n_outputs;
    const int starting = f->st->mode == FMU_INITIALISATION && !f->d->initial_is_free;
    if (starting && !f->d->start_tangent)
        return fmu_fail(f, FMU_ERROR, "derivatives are not available during initialisation: "
                                      "initial values depend on constraints or on each other");
    int status = fmu_refresh_initial(f);
    if (status) return status;
    for (size_t k = 0; k < n_unknowns; k++)
        if (unknown_slot(f, unknowns[k]) < 0)
            return fmu_fail(f, FMU_ERROR, "#%lu# is not an unknown", (unsigned long)unknowns[k]);
    for (size_t k = 0; k < n_knowns; k++) {
        const int i = known_slot(f, knowns[k]);
        if (i < 0 || (starting && i < f->ny && !stated(f, i)))
            return fmu_fail(f, FMU_ERROR, "#%lu# is no known", (unsigned long)knowns[k]);
    }
    mech_real *seeds = f->z + f->d->nz, *out = f->scratch, *of_states = f->slopes;
    memset(seeds, 0, (size_t)f->d->n_seeds * sizeof(mech_real));
    if (!adjoint) {
        for (size_t k = 0; k < n_knowns; k++) seeds[known_slot(f, knowns[k])] += seed[k];
        forward(f, starting, seeds, out);
        for (size_t k = 0; k < n_unknowns; k++) {
            const int i = unknown_slot(f, unknowns[k]);
            result[k] = i < n_plain ? out[i] : seeds[i - n_plain];
        }
    } else {
        memset(of_states, 0, (size_t)f->ny * sizeof(mech_real));
        for (size_t k = 0; k < n_unknowns; k++) {
            const int i = unknown_slot(f, unknowns[k]);
            *(i < n_plain ? seeds + i : of_states + (i - n_plain)) += seed[k];
        }
        backward(f, starting, seeds, of_states, out);
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
        return fmu_fail(f, FMU_ERROR, "#%lu# is not an output", (unsigned long)vr);
    }
    return fmu_finite(result, 1) ? FMU_OK : fmu_undefined(f, "a derivative of an output is not finite");
}
