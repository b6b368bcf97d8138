/* Inputs that drive coordinates: the importer sets them with their first and second derivatives.
 *
 * In Co-Simulation they move on during a step, by x + v s + a s^2/2, and the importer sets them anew before the next. In Model
 * Exchange it sets them at each time. Where one moves though its derivatives are said to be zero, these are not connected. */
#include "instance.h"

#include "inputs.h"

int fmu_set_input_derivative(fmu *f, uint32_t vr, int order, mech_real value)
{
    int input;
    if (fmu_find(f, vr, &input) != FMU_U)
        return fmu_fail(f, FMU_ERROR, "the variable #%lu# is not an input", (unsigned long)vr);
    for (int k = 0; k < f->d->n_drives; k++)
        if (f->d->drives[k][0] == input && (order == 1 || order == 2)) {
            const uint32_t derivative = vr + (uint32_t)(f->d->drives[k][order] - input);
            return fmu_set(f, FMU_REAL, &derivative, 1, &value);
        }
    return fmu_fail(f, FMU_ERROR, "the input #%lu# is constant during a step: its derivative of order %d is not taken",
                    (unsigned long)vr, order);
}

static void plan(mech_table *table, const fmu_drive *at, int interpolation, const mech_real *value, const mech_real *slope)
{
    table->interpolation = interpolation;
    table->n = 2;
    table->t = at->t;
    table->value = value;
    table->slope = slope;
}

void fmu_plan_drives(fmu *f, mech_real end)
{
    for (int k = 0; k < f->d->n_drives; k++) {
        const int *drive = f->d->drives[k];
        if (!f->u_set[drive[0]]) continue;
        fmu_drive *at = f->drives + k;
        const mech_real h = end - f->st->t, x = f->u[drive[0]], v = f->u[drive[1]], a = f->u[drive[2]];
        at->t[0] = f->st->t;
        at->t[1] = end;
        at->value[0] = x;
        at->value[1] = x + h * (v + h / 2 * a);
        at->first[0] = v;
        at->first[1] = v + h * a;
        at->second = a;
        for (int i = 0; i < f->st->n_driven; i++) {
            mech_table *table = f->tables + i;
            if (table->input == drive[0]) plan(table, at, MECH_SPLINE, at->value, at->first);
            if (table->input == drive[1]) plan(table, at, MECH_LINEAR, at->first, NULL);
            f->s->segments[i] = mech_segment(table, f->st->t);
        }
    }
}

void fmu_follow_drives(fmu *f)
{
    for (int k = 0; k < f->d->n_drives; k++) {
        const int *drive = f->d->drives[k];
        const fmu_drive *at = f->drives + k;
        if (!f->u_set[drive[0]] || at->t[0] == at->t[1]) continue;
        const mech_real s = f->st->t - at->t[0];
        f->u[drive[0]] = at->value[0] + s * (at->first[0] + s / 2 * at->second);
        f->u[drive[1]] = at->first[0] + s * at->second;
    }
    fmu_begin_drives(f);
}

void fmu_begin_drives(fmu *f)
{
    for (int k = 0; k < f->d->n_drives; k++)
        for (int order = 0; order < 3; order++) f->drives[k].told[order] = f->u[f->d->drives[k][order]];
}

int fmu_check_drives(fmu *f)
{
    for (int k = 0; k < f->d->n_drives; k++) {
        const int *drive = f->d->drives[k];
        const fmu_drive *at = f->drives + k;
        const mech_real now[3] = {f->u[drive[0]], f->u[drive[1]], f->u[drive[2]]};
        for (int order = 0; order < 2 && f->u_set[drive[0]]; order++)
            if (now[order] != at->told[order] && now[order + 1] == 0 && at->told[order + 1] == 0)
                return fmu_fail(f, FMU_ERROR, "at time %g the input '%s' %s, though its %s derivative is set to 0: connect this, too",
                                f->st->t, f->d->drive_names[k], order ? "changes its rate" : "moves",
                                order ? "second" : "first");
    }
    fmu_begin_drives(f);
    return FMU_OK;
}
