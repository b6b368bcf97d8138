/* What acts between rows of a run at which nothing moves. */
#include "rests.h"

#include <math.h>

#include "inputs.h"

void mech_moved(const mech_model *model, const mech_table *tables, int n_tables, long n, long each,
                const mech_real *t, const mech_real *length, const mech_real *y, const mech_real *rates,
                const mech_real *z, long z_step, const mech_real *p, const mech_real *slow, mech_real *work,
                unsigned char *moved)
{
    const int ny = model->nq + model->nv + model->nx;
    mech_real *u = work, *there = u + model->nu, *found = there + ny;
    for (long k = 0; k < n; k++, y += ny, rates += ny, z += z_step) {
        for (long j = 0; j < each; j++, moved++) {
            const mech_real ahead = length[k] * (((mech_real)j + (mech_real)0.5) / (mech_real)each);
            for (int i = 0; i < ny; i++) there[i] = y[i] + ahead * rates[i];
            if (model->nu) mech_inputs(model, tables, n_tables, NULL, t[k] + ahead, p, u);
            model->rhs(t[k] + ahead, there, u, z, p, found);
            *moved = 0;
            for (int i = 0; i < ny; i++)
                if (fabs((double)(found[i] - rates[i])) > (double)slow[i]) *moved = 1;
        }
    }
}
