/* A member made ready: settings of the experiment, parameters, a start on the constraints, nominal values. */
#include <string.h>

#include "inputs.h"
#include "member.h"

static void set(mech_room *r, const mech_place *place, mech_real value)
{
    const mech_ensemble *e = r->e;
    const int given = place->guess ? MECH_GUESSED : MECH_KNOWN;
    switch (place->array) {
    case MECH_IN_P:
        r->p[place->index] = value;
        r->p_set[place->index] = 1;
        break;
    case MECH_IN_Y:
        r->y[place->index] = value;
        r->y_given[place->index] = (unsigned char)given;
        break;
    default:
        for (int k = 0; k < e->options->n_tables; k++)
            if (r->tables[k].input == place->index && r->tables[k].n == 1) {
                r->table_values[k] = value;
                r->tables[k].value = &r->table_values[k];
            }
    }
}

static void put_given(mech_room *r)
{
    const mech_ensemble *e = r->e;
    const mech_model *m = e->model;
    const size_t np = (size_t)(m->np + m->nh), ny = (size_t)(m->nq + m->nv + m->nx);
    memcpy(r->p, e->p, np * sizeof(mech_real));
    memcpy(r->y, e->y, ny * sizeof(mech_real));
    memcpy(r->p_set, e->p_set, (size_t)m->np);
    memcpy(r->y_given, e->y_given, ny);
    memcpy(r->tables, e->options->tables, (size_t)e->options->n_tables * sizeof(mech_table));
    for (int k = 0; k < e->n_varied; k++) set(r, &e->varied[k], r->values[k]);
}

static int same(mech_real a, mech_real b) { return a == b || (a != a && b != b); }

/* Settings of an experiment may depend on parameters that it sets: evaluated until nothing changes. */
static int settle(mech_room *r, mech_member *told)
{
    const mech_ensemble *e = r->e;
    const mech_model *m = e->model;
    const int ny = m->nq + m->nv + m->nx;
    put_given(r);
    if (m->parameters) m->parameters(r->p, r->p_set);
    if (!e->experiment) return MECH_MEMBER_RAN;
    for (int k = 0; k < e->n_settings; k++) r->chosen[k] = (mech_real)NAN;
    for (int round = 0; round < e->n_settings + 2; round++) {
        if (m->nu) mech_inputs(m, r->tables, e->options->n_tables, NULL, 0, r->p, r->u);
        for (int i = 0; i < ny; i++) r->plain[i] = (mech_real)NAN;
        for (int i = 0; i < m->nz; i++) r->z[i] = (mech_real)NAN;
        if (m->discretes) m->discretes(0, r->plain, r->u, r->z, r->p, r->z);
        m->initial(0, r->plain, r->u, r->z, r->p, r->plain);
        e->experiment(0, r->plain, r->u, r->z, r->p, r->numbers);
        int changed = 0;
        for (int k = 0; k < e->n_settings; k++) {
            const mech_real value = r->numbers[e->n_numbers + k];
            if (e->settings[k].array < 0 || same(value, r->chosen[k])) continue;
            r->chosen[k] = value;
            changed = 1;
        }
        if (!changed) {
            for (int k = 0; k < e->n_numbers; k++)
                if (mech_finite(e->numbers[k]) && r->numbers[k] != e->numbers[k]) {
                    told->index = k;
                    return MECH_MEMBER_TIMES;
                }
            return MECH_MEMBER_RAN;
        }
        put_given(r);
        for (int k = 0; k < e->n_settings; k++)
            if (e->settings[k].array >= 0) set(r, &e->settings[k], r->chosen[k]);
        if (m->parameters) m->parameters(r->p, r->p_set);
    }
    return MECH_MEMBER_UNSETTLED;
}

static int outside(const mech_real *x, int n, const mech_real *low, const mech_real *high)
{
    for (int i = 0; i < n; i++)
        if (!mech_finite(x[i]) || x[i] < low[i] || x[i] > high[i]) return i;
    return -1;
}

int mech_member_start(mech_room *r, mech_member *told)
{
    const mech_ensemble *e = r->e;
    const mech_model *m = e->model;
    const int ny = m->nq + m->nv + m->nx;
    const int stage = settle(r, told);
    if (stage != MECH_MEMBER_RAN) return stage;
    told->index = outside(r->p, m->np, e->p_low, e->p_high);
    if (told->index >= 0) {
        told->failed_value = r->p[told->index];
        return MECH_MEMBER_PARAMETER;
    }
    mech_start_report report;
    if (m->nu) mech_inputs(m, r->tables, e->options->n_tables, NULL, e->options->t0, r->p, r->u);
    for (int i = 0; i < m->nz; i++) r->z[i] = (mech_real)NAN;
    told->status = mech_start_state(m, e->options->t0, r->y_given, r->u, r->z, r->p, r->y, r->plain, &report);
    told->index = report.row;
    told->failed_value = report.off;
    if (told->status) return MECH_MEMBER_START;
    if (mech_start_found(m, e->options->t0, r->y, r->u, r->z, r->p, r->p_set) >= 0 ||
        outside(r->p, m->np, e->p_low, e->p_high) >= 0) {
        told->index = outside(r->p, m->np, e->p_low, e->p_high);
        told->failed_value = r->p[told->index];
        return MECH_MEMBER_PARAMETER;
    }
    told->index = outside(r->y, ny, e->y_low, e->y_high);
    if (told->index >= 0) {
        told->failed_value = r->y[told->index];
        return MECH_MEMBER_STATE;
    }
    r->options = *e->options;
    r->options.tables = r->tables;
    r->options.y0 = r->y;
    r->options.z = r->z;
    r->options.p = r->p;
    if (mech_nominal_values(m, e->sizes, &r->options, e->stop, r->plain, r->nominal)) return MECH_MEMBER_MEMORY;
    return MECH_MEMBER_RAN;
}
