/* Values of an instance: variables by reference, evaluation on demand. */
#include "instance.h"

#include <string.h>

enum fmu_place fmu_find(const fmu *f, uint32_t vr, int *index)
{
    const int sizes[] = {1, f->ny, f->ny, f->m->nu, f->m->np, f->m->n_outputs, f->d->n_discrete, f->d->n_indicators};
    uint32_t left = vr;
    for (int k = 0; k < FMU_NOTHING; k++) {
        if (left < (uint32_t)sizes[k]) {
            *index = (int)left;
            return (enum fmu_place)k;
        }
        left -= (uint32_t)sizes[k];
    }
    return FMU_NOTHING;
}

int fmu_refresh_parameters(fmu *f)
{
    if (!f->st->stale_parameters) return FMU_OK;
    f->m->parameters(f->p, f->p_set);
    f->st->stale_parameters = 0;
    f->st->stale_inputs = 1;
    fmu_touch(f);
    if (!fmu_finite(f->p, f->m->np)) return fmu_undefined(f, "a parameter is not finite");
    return FMU_OK;
}

int fmu_refresh_inputs(fmu *f)
{
    const int status = fmu_refresh_parameters(f);
    if (status || !f->st->stale_inputs) return status;
    f->st->stale_inputs = 0;
    if (f->st->n_driven == f->m->nu && f->st->mode > FMU_INITIALISATION) return FMU_OK;
    if (!f->m->inputs) return FMU_OK;
    f->m->inputs(f->st->t, f->y, f->u, f->z, f->p, f->scratch);
    for (int i = 0; i < f->m->nu; i++)
        if (!f->u_set[i]) f->u[i] = f->scratch[i];
    return FMU_OK;
}

/* The formulas of the model for the initial state. */
static int start_values(fmu *f)
{
    const fmu_description *d = f->d;
    const mech_model *m = f->m;
    mech_real *value = f->scratch;
    m->initial(f->st->t, f->y, f->u, f->z, f->p, value);
    for (int i = 0; i < f->ny; i++)
        if (!f->y_set[i]) f->y[i] = d->y_given[i] ? d->y_stated[i] : value[i];
    for (int k = 0; k < d->n_dependent; k++) { /* one of them may be stated with another */
        d->others(f->st->t, f->y, f->u, f->z, f->p, value);
        for (int j = 0; j < d->n_dependent; j++) {
            const int i = d->dependent[j];
            if (!f->y_set[i] && !d->y_given[i]) f->y[i] = value[j];
        }
    }
    return fmu_finite(f->y, f->ny) ? FMU_OK : fmu_undefined(f, "an initial value is not finite");
}

int fmu_refresh_initial(fmu *f)
{
    fmu_state *st = f->st;
    int status = fmu_refresh_inputs(f);
    if (status || !st->stale_initial || st->mode > FMU_INITIALISATION) return status;
    const mech_model *m = f->m;
    if (m->discretes) m->discretes(st->t, f->y, f->u, f->scratch, f->p, f->z);
    if (st->off) status = start_values(f); /* else the values of the exporter hold */
    if (status) return status;
    if (st->mode == FMU_INITIALISATION) {
        fmu_list_tables(f);
        if (st->off && f->d->assemble) status = f->d->assemble(f);
        else if (st->off) fmu_project(f); /* rotations alone, which always succeeds */
        if (!status && m->hybrid) status = f->d->events->look(f);
    }
    st->stale_initial = status != FMU_OK;
    fmu_touch(f);
    return status;
}

int fmu_refresh_rates(fmu *f)
{
    const int status = fmu_refresh_initial(f);
    if (status || !f->st->stale_rates) return status;
    f->m->rhs(f->st->t, f->y, f->u, f->z, f->p, f->dy);
    if (!fmu_finite(f->dy, f->ny)) return fmu_undefined(f, "a derivative is not finite");
    f->st->stale_rates = 0;
    return FMU_OK;
}

int fmu_refresh_outputs(fmu *f)
{
    const int status = fmu_refresh_initial(f);
    if (status || !f->st->stale_outputs || !f->m->n_outputs) return status;
    f->m->outputs(f->st->t, f->y, f->u, f->z, f->p, f->out);
    if (!fmu_finite(f->out, f->m->n_outputs)) return fmu_undefined(f, "an output is not finite");
    f->st->stale_outputs = 0;
    return FMU_OK;
}

static int has_type(fmu *f, enum fmu_type type, uint32_t vr, enum fmu_place place, int i)
{
    const unsigned char *types = place == FMU_Z ? f->d->z_type : place == FMU_U ? f->d->u_type : place == FMU_P ? f->d->p_type : NULL;
    if (type == (types ? (enum fmu_type)types[i] : FMU_REAL)) return FMU_OK;
    return fmu_fail(f, FMU_ERROR, "the variable #%lu# is of another type", (unsigned long)vr);
}

int fmu_get(fmu *f, enum fmu_type type, const uint32_t *vr, size_t n, mech_real *value)
{
    int status = FMU_OK, i = 0;
    for (size_t k = 0; k < n && !status; k++) {
        const enum fmu_place place = fmu_find(f, vr[k], &i);
        if (place != FMU_NOTHING && has_type(f, type, vr[k], place, i)) return FMU_ERROR;
        switch (place) {
        case FMU_TIME: value[k] = f->st->t; break;
        case FMU_Y:
            status = fmu_refresh_initial(f);
            value[k] = f->y[i];
            break;
        case FMU_DY:
            status = fmu_refresh_rates(f);
            value[k] = f->dy[i];
            break;
        case FMU_U:
            status = fmu_refresh_inputs(f);
            value[k] = f->u[i];
            break;
        case FMU_P:
            status = fmu_refresh_parameters(f);
            value[k] = f->p[i];
            break;
        case FMU_OUT:
            status = fmu_refresh_outputs(f);
            value[k] = f->out[i];
            break;
        case FMU_Z:
            status = fmu_refresh_initial(f);
            value[k] = f->z[i];
            break;
        case FMU_W:
            status = fmu_refresh_initial(f);
            if (!status) status = f->d->events->indicators(f);
            value[k] = f->w[f->d->indicators[i]];
            break;
        default: return fmu_fail(f, FMU_ERROR, "there is no variable #%lu#", (unsigned long)vr[k]);
        }
    }
    return status;
}

/* An importer that sets one of the three sets all of them. */
static void claim_drive(fmu *f, int input)
{
    for (int k = 0; k < f->d->n_drives; k++) {
        const int *drive = f->d->drives[k];
        if (input == drive[0] || input == drive[1] || input == drive[2])
            f->u_set[drive[0]] = f->u_set[drive[1]] = f->u_set[drive[2]] = 1;
    }
}

int fmu_set(fmu *f, enum fmu_type type, const uint32_t *vr, size_t n, const mech_real *value)
{
    fmu_state *st = f->st;
    const int before = st->mode & (FMU_INSTANTIATED | FMU_INITIALISATION);
    int i = 0;
    for (size_t k = 0; k < n; k++) {
        const enum fmu_place place = fmu_find(f, vr[k], &i);
        if (place == FMU_NOTHING) return fmu_fail(f, FMU_ERROR, "there is no variable #%lu#", (unsigned long)vr[k]);
        if (has_type(f, type, vr[k], place, i)) return FMU_ERROR;
        if (!mech_finite(value[k]))
            return fmu_fail(f, FMU_DISCARD, "the value for #%lu# is not finite", (unsigned long)vr[k]);
        if (place == FMU_U) continue;
        if (place == FMU_P && f->d->p_settable[i] && (before || st->mode & (FMU_EVENT | FMU_STEP))) continue;
        if (place == FMU_Y && f->d->y_settable[i] && before) continue;
        return fmu_fail(f, FMU_ERROR, "the variable #%lu# cannot be set now", (unsigned long)vr[k]);
    }
    for (size_t k = 0; k < n; k++) switch (fmu_find(f, vr[k], &i)) {
        case FMU_U:
            if (f->u_set[i] && f->u[i] == value[k]) break;
            f->u[i] = value[k];
            if (!f->u_set[i]) {
                f->u_set[i] = 1;
                claim_drive(f, i);
                fmu_list_tables(f);
            }
            st->stale_initial = st->solver_stale = 1;
            st->off |= before;
            fmu_touch(f);
            break;
        case FMU_P:
            if (f->p_set[i] && f->p[i] == value[k]) break;
            f->p[i] = value[k];
            f->p_set[i] = 1;
            st->stale_parameters = st->stale_initial = st->solver_stale = st->off = 1;
            fmu_touch(f);
            break;
        case FMU_Y:
            f->y[i] = value[k];
            f->y_set[i] = 1;
            st->stale_initial = st->solver_stale = st->off = 1;
            fmu_touch(f);
            break;
        default: break;
        }
    return FMU_OK;
}

int fmu_set_time(fmu *f, mech_real t)
{
    if (!mech_finite(t)) return fmu_fail(f, FMU_DISCARD, "the time is not finite");
    if (t == f->st->t) return FMU_OK;
    f->st->t = t;
    f->st->stale_inputs = 1;
    fmu_touch(f);
    return FMU_OK;
}

static int right_size(fmu *f, size_t n)
{
    if (n == (size_t)f->ny) return FMU_OK;
    return fmu_fail(f, FMU_ERROR, "the model has %d continuous states, not %lu", f->ny, (unsigned long)n);
}

int fmu_set_states(fmu *f, const mech_real *y, size_t n)
{
    const int status = right_size(f, n);
    if (status) return status;
    if (!fmu_finite(y, f->ny)) return fmu_fail(f, FMU_DISCARD, "a state is not finite");
    memcpy(f->y, y, n * sizeof(mech_real));
    fmu_touch(f);
    return FMU_OK;
}

int fmu_get_states(fmu *f, mech_real *y, size_t n)
{
    int status = right_size(f, n);
    if (!status) status = fmu_refresh_initial(f);
    if (!status) memcpy(y, f->y, n * sizeof(mech_real));
    return status;
}

int fmu_get_rates(fmu *f, mech_real *dy, size_t n)
{
    int status = right_size(f, n);
    if (!status) status = fmu_refresh_rates(f);
    if (!status) memcpy(dy, f->dy, n * sizeof(mech_real));
    return status;
}

int fmu_get_indicators(fmu *f, mech_real *w, size_t n)
{
    if (n != (size_t)f->d->n_indicators)
        return fmu_fail(f, FMU_ERROR, "the model has %d event indicators, not %lu", f->d->n_indicators, (unsigned long)n);
    int status = fmu_refresh_initial(f);
    if (!status && n) status = f->d->events->indicators(f);
    for (size_t k = 0; k < n && !status; k++) w[k] = f->w[f->d->indicators[k]];
    return status;
}
