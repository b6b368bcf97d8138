/* Stoermer's and Verlet's method for q'' = a(q, t), in its velocity form: fixed step, symplectic, symmetric,
 * one evaluation a step, added with compensation. Accounts, which read velocities, cost another one.
 *
 * E. Hairer, C. Lubich, G. Wanner, Geometric numerical integration illustrated by the Stoermer-Verlet
 * method, Acta Numerica 12, 2003.
 */
#include "hermite.h"

static int lacks(const mech_model *model) { return model->separable ? MECH_RUNNING : MECH_NEEDS_SEPARABLE; }

static void begin(mech_solver *s, int fresh)
{
    for (int i = 0; fresh && i < s->ny; i++) s->work[i] = 0;
}

static inline void add(mech_solver *s, int i, mech_real step)
{
    const mech_real change = step + s->work[i], y = s->y[i], y_new = y + change;
    s->y_new[i] = y_new;
    s->work[i] = (y - y_new) + change;
}

static mech_real attempt(mech_solver *s, mech_real h)
{
    const int n = s->model->nq, nx = s->model->nx;
    const mech_real half = h / 2, *v = s->y + n, *a = s->dy + n, *a_new = s->dy_new + n;
    for (int i = 0; i < n; i++) {
        add(s, i, h * (v[i] + half * a[i]));
        s->y_new[n + i] = v[i]; /* the accelerations do not read it */
    }
    for (int i = 2 * n; i < s->ny; i++) s->y_new[i] = s->y[i];
    mech_rhs(s, s->run->report.t + h, s->y_new, s->dy_new);
    mech_real check = 0;
    for (int i = 0; i < n; i++) {
        add(s, n + i, half * (a[i] + a_new[i]));
        s->dy_new[i] = s->y_new[n + i];
        check += s->y_new[i] + s->y_new[n + i];
    }
    if (nx) mech_rhs(s, s->run->report.t + h, s->y_new, s->dy_new);
    for (int i = 2 * n; i < s->ny; i++) {
        add(s, i, half * (s->dy[i] + s->dy_new[i]));
        check += s->y_new[i];
    }
    return mech_finite(check) ? 0 : check;
}

const mech_method mech_verlet = {
    .name = "verlet",
    .doc = "Stoermer-Verlet of order 2, fixed step: symplectic and symmetric, for separable models",
    .order = 2,
    .n_work = 1,
    .n_dense = 6,
    .lacks = lacks,
    .begin = begin,
    .gives_derivative = 1,
    .attempt = attempt,
    .dense = mech_quintic,
};
