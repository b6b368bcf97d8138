#include <stdlib.h>

#include "newton.h"

/* How far beside a state at which the derivatives have no value these are taken, as a share of its size. */
static const mech_real BESIDE = MECH_C(1e-8);

static void evaluate(mech_solver *s, mech_real t, const mech_real *y, mech_real *out)
{
    mech_surroundings(s, t);
    s->model->jacobian(t, y, s->u, s->o.z, s->o.p, out);
    s->run->report.jacobians++;
}

static int finite_all(const mech_model *model, const mech_real *jacobian)
{
    for (int e = 0; e < model->n_jacobian; e++)
        if (!mech_finite(jacobian[e])) return 0;
    return 1;
}

void mech_jacobian(mech_solver *s, mech_real t, const mech_real *y, mech_real *out)
{
    evaluate(s, t, y, out);
    if (finite_all(s->model, out)) return;
    mech_real *beside = calloc((size_t)s->ny, sizeof *beside);
    if (!beside) return;
    for (int i = 0; i < s->ny; i++) /* by different shares, so that nothing cancels again */
        beside[i] = y[i] + BESIDE * (1 + (mech_real)(i % 7) / 8) * (mech_nominal(s, i) + mech_abs(y[i]));
    evaluate(s, t, beside, out);
    free(beside);
}

size_t mech_newton_size(const mech_model *model, const mech_spectrum *spectrum)
{
    const int n = model->nq + model->nv + model->nx, systems = spectrum->has_real + 2 * spectrum->pairs;
    return mech_structure_size(model) + (size_t)model->n_jacobian + (size_t)n * (size_t)n * (size_t)systems +
           2 * (size_t)n + 3 * mech_integers(n);
}

void mech_newton_prepare(mech_newton *k, const mech_model *model, const mech_spectrum *spectrum,
                         mech_real *memory)
{
    k->spectrum = spectrum;
    k->structure = mech_find_structure(model, memory);
    k->h = 0;
    const int n = k->structure.n;
    const size_t square = (size_t)k->structure.m * (size_t)k->structure.m;
    mech_real *next = memory + mech_structure_size(model);
    k->jacobian = next, next += model->n_jacobian;
    k->room = next, next += 2 * n;
    k->pivot = (int *)next, next += mech_integers(n);
    for (int l = 0; l < 2; l++) k->pivots[l] = (int *)next, next += mech_integers(n);
    k->real = next, next += spectrum->has_real ? square : 0;
    for (int l = 0; l < spectrum->pairs; l++) {
        k->re[l] = next, next += square;
        k->im[l] = next, next += square;
    }
}

int mech_newton_factorise(mech_newton *k, mech_real h)
{
    const mech_spectrum *c = k->spectrum;
    k->h = 0;
    if (c->has_real && mech_factorise_shifted(&k->structure, k->jacobian, c->real / h, k->real, k->pivot))
        return 1;
    for (int l = 0; l < c->pairs; l++)
        if (mech_factorise_shifted_complex(&k->structure, k->jacobian, c->alpha[l] / h, c->beta[l] / h,
                                           k->re[l], k->im[l], k->pivots[l]))
            return 1;
    k->h = h;
    return 0;
}

void mech_mix_stages(int stages, int n, const mech_real *matrix, const mech_real *w, mech_real *z)
{
    for (int i = 0; i < stages; i++) {
        const mech_real *m = matrix + i * stages;
        mech_real *zi = z + i * n;
        switch (stages) {
        case 1:
            for (int k = 0; k < n; k++) zi[k] = m[0] * w[k];
            break;
        case 2:
            for (int k = 0; k < n; k++) zi[k] = m[0] * w[k] + m[1] * w[n + k];
            break;
        case 3:
            for (int k = 0; k < n; k++) zi[k] = m[0] * w[k] + m[1] * w[n + k] + m[2] * w[2 * n + k];
            break;
        default:
            for (int k = 0; k < n; k++)
                zi[k] = m[0] * w[k] + m[1] * w[n + k] + m[2] * w[2 * n + k] + m[3] * w[3 * n + k];
        }
    }
}

void mech_newton_correct(const mech_newton *k, const mech_real *f, const mech_real *w, mech_real *d)
{
    const mech_spectrum *c = k->spectrum;
    const int n = k->structure.n;
    mech_mix_stages(c->stages, n, c->t_inverse, f, d);
    if (c->has_real) {
        const mech_real sigma = c->real / k->h;
        for (int i = 0; i < n; i++) d[i] -= sigma * w[i];
        mech_solve_shifted(&k->structure, k->jacobian, sigma, k->real, k->pivot, d, k->room);
    }
    for (int l = 0; l < c->pairs; l++) {
        const int at = (c->has_real + 2 * l) * n;
        const mech_real alpha = c->alpha[l] / k->h, beta = c->beta[l] / k->h;
        const mech_real *w_re = w + at, *w_im = w_re + n;
        mech_real *d_re = d + at, *d_im = d_re + n;
        for (int i = 0; i < n; i++) {
            d_re[i] -= alpha * w_re[i] - beta * w_im[i];
            d_im[i] -= beta * w_re[i] + alpha * w_im[i];
        }
        mech_solve_shifted_complex(&k->structure, k->jacobian, alpha, beta, k->re[l], k->im[l], k->pivots[l],
                                   d_re, d_im, k->room);
    }
}

/* Two steps of the power method each time: two, as it may be one of a pair of complex ones. */
mech_real mech_dominant(const mech_model *model, const mech_real *jacobian, const mech_real *scale, mech_real *x,
                        mech_real *image)
{
    const int n = model->nq + model->nv + model->nx;
    mech_real before = 0, after = 0;
    for (int i = 0; i < n; i++) before += x[i] * scale[i] * x[i] * scale[i];
    for (int l = 0; l < 2; l++) {
        for (int i = 0; i < n; i++) image[i] = 0;
        for (int e = 0; e < model->n_jacobian; e++)
            image[model->jac_row[e]] += jacobian[e] * x[model->jac_col[e]];
        for (int i = 0; i < n; i++) x[i] = image[i];
    }
    for (int i = 0; i < n; i++) after += x[i] * scale[i] * x[i] * scale[i];
    if (!(after > 0) || !mech_finite(after) || !(before > 0)) {
        for (int i = 0; i < n; i++) x[i] = 1 / scale[i]; /* begin anew */
        return before > 0 ? 0 : (mech_real)INFINITY;
    }
    const mech_real inverse = 1 / mech_sqrt(after);
    for (int i = 0; i < n; i++) x[i] *= inverse;
    return mech_sqrt(mech_sqrt(after / before));
}
