/* Dense output of a step of a model with q' = v from its ends alone: positions by the polynomial of degree 5
 * through q, v, a at both ends, velocities by that of degree 3 through v, a, accounts likewise. Where the
 * positions are good to more than order 4, velocities get the slope of their polynomial in the middle, too;
 * else that would magnify their error.
 */
#include "hermite.h"

void mech_quintic(mech_solver *s, mech_real h)
{
    const int n = s->ny, nq = s->model->nq;
    mech_real *c = s->dense;
    mech_hermite(s, h);
    for (int i = 0; i < n; i++) c[4 * n + i] = c[5 * n + i] = 0;
    for (int i = 0; i < nq; i++) {
        const int j = nq + i;
        const mech_real a = s->dy[j], a_new = s->dy_new[j], half = h * h / 2;
        const mech_real c2 = c[2 * n + i], c3 = c[3 * n + i];
        const mech_real c4 = half * a + c2 - c3, c5 = half * a_new + c2 + 2 * c3 - c4;
        c[4 * n + i] = c4;
        c[5 * n + i] = c5;
        if (s->method->order <= 4) continue;
        const mech_real slope = (c[n + i] + c3 / 4 + c5 / 16) / h;
        const mech_real cubic = (s->y[j] + s->y_new[j]) / 2 + h * (a - a_new) / 8;
        c[4 * n + j] = 16 * (slope - cubic);
    }
}
