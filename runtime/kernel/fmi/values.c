/* Values of an instance: variables by reference, evaluation on demand, derivatives. */
#include "instance.h"

#include <string.h>

enum place { TIME, STATE, RATE, INPUT, PARAMETER, OUTPUT, NOTHING };

static enum place find(const fmu *f, uint32_t vr, int *index)
{
    const int sizes[] = {1, f->ny, f->ny, f->m->nu, f->m->np, f->m->n_outputs};
    uint32_t left = vr;
    for (int k = 0; k < 6; k++) {
        if (left < (uint32_t)sizes[k]) {
            *index = (int)left;
            return (enum place)k;
        }
        left -= (uint32_t)sizes[k];
    }
    return NOTHING;
}

static int undefined(fmu *f, const char *what)
{
    /* an importer can take a smaller step in continuous time only */
    const int smaller = f->st->mode & (FMU_CONTINUOUS | FMU_STEP);
    return fmu_fail(f, smaller ? FMU_DISCARD : FMU_ERROR, "at time %g %s", f->st->t, what);
}

static int all_finite(const mech_real *x, int n)
{
    mech_real sum = 0;
    for (int i = 0; i < n; i++) sum += x[i] - x[i];
    return sum == 0;
}

int fmu_refresh_parameters(fmu *f)
{
    if (!f->st->stale_parameters) return FMU_OK;
    f->m->parameters(f->p, f->p_set);
    f->st->stale_parameters = 0;
    f->st->stale_inputs = 1;
    fmu_touch(f);
    if (!all_finite(f->p, f->m->np)) return undefined(f, "a parameter is not finite");
    return FMU_OK;
}

static int refresh_inputs(fmu *f)
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

/* The largest distance of a unit quaternion from length one. */
static mech_real off_unit(const fmu *f)
{
    mech_real largest = 0;
    for (int k = 0; k < f->m->n_rotations; k++) {
        const mech_real *e = f->y + f->m->rotations[k];
        const mech_real off = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3] - 1;
        largest = mech_max(largest, mech_abs(off));
    }
    return largest;
}

/* Only a quaternion off by more than rounding is changed: the solver normalises, too, and once is enough. */
static void normalise(fmu *f)
{
    if (off_unit(f) > 16 * MECH_EPSILON) mech_normalise(f->m, f->y);
}

int fmu_refresh_initial(fmu *f)
{
    fmu_state *st = f->st;
    int status = refresh_inputs(f);
    if (status || !st->stale_initial || st->mode > FMU_INITIALISATION) return status;
    const mech_model *m = f->m;
    if (m->discretes) m->discretes(st->t, f->y, f->u, f->z, f->p, f->z);
    m->initial(st->t, f->y, f->u, f->z, f->p, f->scratch);
    for (int i = 0; i < f->ny; i++)
        if (!f->y_set[i]) f->y[i] = f->scratch[i];
    if (!all_finite(f->y, f->ny)) return undefined(f, "an initial value is not finite");
    normalise(f);
    if (m->n_velocity && st->mode == FMU_INITIALISATION) {
        const int n = f->s->o.n_tables;
        f->s->o.n_tables = 0;
        memcpy(f->s->u, f->u, (size_t)m->nu * sizeof(mech_real));
        const int off = mech_project(f->s, st->t, f->y);
        f->s->o.n_tables = n;
        if (off) return fmu_fail(f, FMU_ERROR, "the initial state cannot meet the constraints");
    }
    st->stale_initial = 0;
    fmu_touch(f);
    return FMU_OK;
}

int fmu_refresh_rates(fmu *f)
{
    const int status = fmu_refresh_initial(f);
    if (status || !f->st->stale_rates) return status;
    f->m->rhs(f->st->t, f->y, f->u, f->z, f->p, f->dy);
    if (!all_finite(f->dy, f->ny)) return undefined(f, "a derivative is not finite");
    f->st->stale_rates = 0;
    return FMU_OK;
}

int fmu_refresh_outputs(fmu *f)
{
    const int status = fmu_refresh_initial(f);
    if (status || !f->st->stale_outputs || !f->m->n_outputs) return status;
    f->m->outputs(f->st->t, f->y, f->u, f->z, f->p, f->out);
    if (!all_finite(f->out, f->m->n_outputs)) return undefined(f, "an output is not finite");
    f->st->stale_outputs = 0;
    return FMU_OK;
}

int fmu_get(fmu *f, const uint32_t *vr, size_t n, mech_real *value)
{
    int status = FMU_OK, i = 0;
    for (size_t k = 0; k < n && !status; k++) switch (find(f, vr[k], &i)) {
        case TIME: value[k] = f->st->t; break;
        case STATE:
            status = fmu_refresh_initial(f);
            value[k] = f->y[i];
            break;
        case RATE:
            status = fmu_refresh_rates(f);
            value[k] = f->dy[i];
            break;
        case INPUT:
            status = refresh_inputs(f);
            value[k] = f->u[i];
            break;
        case PARAMETER:
            status = fmu_refresh_parameters(f);
            value[k] = f->p[i];
            break;
        case OUTPUT:
            status = fmu_refresh_outputs(f);
            value[k] = f->out[i];
            break;
        default: return fmu_fail(f, FMU_ERROR, "there is no variable #%lu#", (unsigned long)vr[k]);
        }
    return status;
}

int fmu_set(fmu *f, const uint32_t *vr, size_t n, const mech_real *value)
{
    fmu_state *st = f->st;
    const int before = st->mode & (FMU_INSTANTIATED | FMU_INITIALISATION);
    int i = 0;
    for (size_t k = 0; k < n; k++) {
        const enum place place = find(f, vr[k], &i);
        if (place == NOTHING) return fmu_fail(f, FMU_ERROR, "there is no variable #%lu#", (unsigned long)vr[k]);
        if (!mech_finite(value[k]))
            return fmu_fail(f, FMU_DISCARD, "the value for #%lu# is not finite", (unsigned long)vr[k]);
        if (place == INPUT) continue;
        if (place == PARAMETER && f->d->p_settable[i] && (before || st->mode & (FMU_EVENT | FMU_STEP))) continue;
        if (place == STATE && f->d->y_settable[i] && before) continue;
        return fmu_fail(f, FMU_ERROR, "the variable #%lu# cannot be set now", (unsigned long)vr[k]);
    }
    for (size_t k = 0; k < n; k++) switch (find(f, vr[k], &i)) {
        case INPUT:
            if (f->u_set[i] && f->u[i] == value[k]) break;
            f->u[i] = value[k];
            f->u_set[i] = 1;
            st->stale_initial = st->solver_stale = 1;
            fmu_touch(f);
            break;
        case PARAMETER:
            if (f->p_set[i] && f->p[i] == value[k]) break;
            f->p[i] = value[k];
            f->p_set[i] = 1;
            st->stale_parameters = st->stale_initial = st->solver_stale = 1;
            fmu_touch(f);
            break;
        case STATE:
            f->y[i] = value[k];
            f->y_set[i] = 1;
            st->stale_initial = st->solver_stale = 1;
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
    if (!all_finite(y, f->ny)) return fmu_fail(f, FMU_DISCARD, "a state is not finite");
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

int fmu_completed_step(fmu *f, int *event)
{
    const mech_model *m = f->m;
    *event = 0;
    int status = fmu_refresh_initial(f);
    if (status) return status;
    if (m->n_assertions) {
        m->assertions(f->st->t, f->y, f->u, f->z, f->p, f->scratch);
        for (int k = 0; k < m->n_assertions; k++)
            if (!(f->scratch[k] > MECH_C(0.5)))
                return fmu_fail(f, FMU_ERROR, "at time %g: %s", f->st->t, f->d->assertions[k]);
    }
    if (off_unit(f) > f->st->tolerance) *event = 1;
    if (m->n_velocity) {
        /* the size of a correction over the nominal values, without making it */
        mech_real *moved = f->scratch;
        memcpy(moved, f->y, (size_t)f->ny * sizeof(mech_real));
        memcpy(f->s->u, f->u, (size_t)m->nu * sizeof(mech_real));
        if (mech_project(f->s, f->st->t, moved)) return undefined(f, "the constraints cannot be met");
        for (int i = 0; i < m->nq + m->nv; i++)
            if (mech_abs(moved[i] - f->y[i]) > f->st->tolerance * (f->d->nominal[i] + mech_abs(f->y[i]))) *event = 1;
    }
    return FMU_OK;
}

int fmu_update(fmu *f, int *moved)
{
    const mech_model *m = f->m;
    *moved = 0;
    int status = fmu_refresh_initial(f);
    if (status) return status;
    if (!m->n_rotations && !m->n_velocity) return FMU_OK;
    mech_real *before = f->scratch;
    memcpy(before, f->y, (size_t)f->ny * sizeof(mech_real));
    normalise(f);
    memcpy(f->s->u, f->u, (size_t)m->nu * sizeof(mech_real));
    if (m->n_velocity && mech_project(f->s, f->st->t, f->y))
        return fmu_fail(f, FMU_ERROR, "at time %g the constraints cannot be met", f->st->t);
    *moved = memcmp(before, f->y, (size_t)f->ny * sizeof(mech_real)) != 0;
    if (*moved) {
        fmu_touch(f);
        f->st->solver_stale = 1;
    }
    return FMU_OK;
}

/* Where the derivative by a known stands among the seeds of the tangent and the results of the adjoint. */
static int known_slot(const fmu *f, uint32_t vr)
{
    int i = 0;
    switch (find(f, vr, &i)) {
    case STATE: return i;
    case INPUT: return f->ny + i;
    case TIME: return f->ny + f->m->nu;
    case PARAMETER: return f->d->p_settable[i] ? f->ny + f->m->nu + 1 + i : -1;
    default: return -1;
    }
}

/* The same for an unknown; a state counts from ny + n_outputs. */
static int unknown_slot(const fmu *f, uint32_t vr)
{
    int i = 0;
    switch (find(f, vr, &i)) {
    case RATE: return i;
    case OUTPUT: return f->ny + i;
    case STATE: return f->ny + f->m->n_outputs + i;
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
    if (!all_finite(result, (int)(adjoint ? n_knowns : n_unknowns)))
        return undefined(f, "a partial derivative is not finite");
    return FMU_OK;
}
