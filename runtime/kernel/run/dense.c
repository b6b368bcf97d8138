/* The polynomial of a step (solver.h, point 6). */
#include "solver.h"

void mech_dense_at(const mech_real *c, int n_dense, int ny, mech_real s, mech_real *y)
{
    const mech_real r = 1 - s;
    for (int i = 0; i < ny; i++) {
        mech_real sum = c[(n_dense - 1) * ny + i];
        for (int k = n_dense - 2; k >= 0; k--) sum = c[k * ny + i] + (k % 2 ? r : s) * sum;
        y[i] = sum;
    }
}
