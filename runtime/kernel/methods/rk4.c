/* The classical Runge-Kutta method of order 4 with a fixed step; dense output by cubic Hermite interpolation.
 *
 * W. Kutta, Beitrag zur naeherungsweisen Integration totaler Differentialgleichungen, 1901.
 */
#include "hermite.h"

static mech_real attempt(mech_solver *s, mech_real h)
{
    const int n = s->ny;
    const mech_real t = s->run->report.t, half = h / 2;
    const mech_real *y = s->y, *k1 = s->dy;
    mech_real *k2 = s->work, *k3 = k2 + n, *k4 = k3 + n, *ys = k4 + n, *y_new = s->y_new;

    for (int i = 0; i < n; i++) ys[i] = y[i] + half * k1[i];
    mech_rhs(s, t + half, ys, k2);
    for (int i = 0; i < n; i++) ys[i] = y[i] + half * k2[i];
    mech_rhs(s, t + half, ys, k3);
    for (int i = 0; i < n; i++) ys[i] = y[i] + h * k3[i];
    mech_rhs(s, t + h, ys, k4);
    mech_real sum = 0;
    for (int i = 0; i < n; i++) {
        y_new[i] = y[i] + h / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
        sum += y_new[i];
    }
    return mech_finite(sum) ? 0 : sum;
}

const mech_method mech_rk4 = {
    .name = "rk4",
    .doc = "classical Runge-Kutta of order 4, fixed step",
    .order = 4,
    .adaptive = 0,
    .n_stages = 3,
    .n_work = 4,
    .n_dense = 4,
    .attempt = attempt,
    .dense = mech_hermite,
};
