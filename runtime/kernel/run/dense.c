/* The polynomial of a step (solver.h, point 6). */
#include "solver.h"

#if defined(MECH_SIMD)
#define SIDE_BY_SIDE _Pragma("omp simd")
#else
#define SIDE_BY_SIDE
#endif

/* Of eight coefficients, as dop853 has them: by the loop, a third of the time of its short runs goes into their rows. */
static void at_of_eight(const mech_real *restrict c, int n, mech_real s, mech_real *restrict y)
{
    const mech_real *c1 = c + n, *c2 = c1 + n, *c3 = c2 + n, *c4 = c3 + n, *c5 = c4 + n, *c6 = c5 + n, *c7 = c6 + n;
    const mech_real r = 1 - s;
    SIDE_BY_SIDE
    for (int i = 0; i < n; i++)
        y[i] = c[i] + s * (c1[i] + r * (c2[i] + s * (c3[i] + r * (c4[i] + s * (c5[i] + r * (c6[i] + s * c7[i]))))));
}

void mech_dense_at(const mech_real *c, int n_dense, int ny, mech_real s, mech_real *y)
{
    const mech_real r = 1 - s;
    if (n_dense == 8) {
        at_of_eight(c, ny, s, y);
        return;
    }
    for (int i = 0; i < ny; i++) {
        mech_real sum = c[(n_dense - 1) * ny + i];
        for (int k = n_dense - 2; k >= 0; k--) sum = c[k * ny + i] + (k % 2 ? r : s) * sum;
        y[i] = sum;
    }
}
