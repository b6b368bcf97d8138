#include "inputs.h"

int mech_segment(const mech_table *table, mech_real t)
{
    int low = -1, high = table->n; /* t[low] <= t < t[high] */
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (table->t[middle] <= t)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static mech_real value_at(const mech_table *table, int i, mech_real t)
{
    const mech_real *v = table->value;
    if (i < 0) return v[0];
    if (i >= table->n - 1) return v[table->n - 1];
    mech_real h = table->t[i + 1] - table->t[i];
    mech_real s = (t - table->t[i]) / h, r = 1 - s, d = v[i + 1] - v[i];
    switch (table->interpolation) {
    case MECH_STEP:
        return v[i];
    case MECH_SPLINE:
        return v[i] + s * (d + r * (r * (h * table->slope[i] - d) - s * (h * table->slope[i + 1] - d)));
    default:
        return v[i] + s * d;
    }
}

void mech_inputs(const mech_model *model, const mech_table *tables, int n_tables, const int *segments,
                 mech_real t, const mech_real *p, mech_real *u)
{
    model->inputs(t, NULL, NULL, NULL, p, u);
    for (int k = 0; k < n_tables; k++) {
        const mech_table *table = &tables[k];
        /* A spline is smooth at its rows: no step ends there, so its row is searched. */
        int i = segments && table->interpolation != MECH_SPLINE ? segments[k] : mech_segment(table, t);
        u[table->input] = value_at(table, i, t);
    }
}

void mech_evaluate_inputs(const mech_model *model, const mech_table *tables, int n_tables, long n,
                          const mech_real *t, const mech_real *p, mech_real *u)
{
    for (long k = 0; k < n; k++) mech_inputs(model, tables, n_tables, NULL, t[k], p, u + k * model->nu);
}

void mech_evaluate(const mech_model *model, mech_function *f, int n_out, const mech_table *tables,
                   int n_tables, long n, const mech_real *t, const mech_real *y, const mech_real *z,
                   const mech_real *p, mech_real *u, mech_real *out)
{
    const long ny = model->nq + model->nv + model->nx;
    for (long k = 0; k < n; k++) {
        if (model->nu) mech_inputs(model, tables, n_tables, NULL, t[k], p, u);
        f(t[k], y + k * ny, u, z, p, out + k * n_out);
    }
}
