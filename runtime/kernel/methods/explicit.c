#include "explicit.h"

mech_real mech_explicit_stiffness(mech_solver *s, mech_real h)
{
    const int n = s->ny;
    const mech_tableau *T = s->method->tableau;
    const mech_real *last = s->work + (T->stages - 2) * n, *ys = s->work + (T->stages - 1) * n;
    mech_real numerator = 0, denominator = 0;
    for (int i = 0; i < n; i++) {
        mech_real scale = s->o.atol[i] + s->o.rtol * mech_abs(s->y_new[i]);
        mech_real a = (s->dy_new[i] - last[i]) / scale, b = (s->y_new[i] - ys[i]) / scale;
        numerator += a * a;
        denominator += b * b;
    }
    return denominator > 0 ? h * mech_sqrt(numerator / denominator) : 0;
}

mech_real mech_explicit_dense_error(const mech_solver *s)
{
    const int n = s->ny;
    const mech_real *term = s->dense + (s->n_dense - 1) * n, share = s->method->tableau->dense_share;
    mech_real sum = 0;
    for (int i = 0; i < n; i++) {
        const mech_real scale = s->o.atol[i] + s->o.rtol * mech_max(mech_abs(s->y[i]), mech_abs(s->y_new[i]));
        const mech_real x = term[i] * share / scale;
        sum += x * x;
    }
    return mech_sqrt(sum / n);
}
