/* With R = f - (A^-1 / h) Z the corrections solve (A^-1 / h - diag J) dZ = R. A row of J with one entry c in
 * column j, such as q' = v, is solved by hand: dq = h A (R + c dv). What is left has the size of the stages of
 * the other unknowns.
 */
#include "stages.h"

size_t mech_stages_size(const mech_model *model, const mech_spectrum *spectrum)
{
    const int ny = model->nq + model->nv + model->nx, n = spectrum->stages * ny;
    if (ny > MECH_MOST_STAGED) return 0;
    return (size_t)(spectrum->stages * model->n_jacobian) + (size_t)n * (size_t)n + (size_t)n + mech_integers(n);
}

/* out = T F(L) T^-1 with F(L) = L, or its inverse: A^-1, or A. */
static void recompose(const mech_spectrum *c, int inverted, mech_real *out)
{
    const int s = c->stages;
    mech_real block[MECH_MAX_STAGES * MECH_MAX_STAGES] = {0}, half[MECH_MAX_STAGES * MECH_MAX_STAGES];
    if (c->has_real) block[0] = inverted ? 1 / c->real : c->real;
    for (int l = 0; l < c->pairs; l++) {
        const int i = c->has_real + 2 * l;
        const mech_real scale = inverted ? c->alpha[l] * c->alpha[l] + c->beta[l] * c->beta[l] : 1;
        const mech_real alpha = c->alpha[l] / scale, beta = (inverted ? -c->beta[l] : c->beta[l]) / scale;
        block[i * s + i] = block[(i + 1) * s + i + 1] = alpha;
        block[i * s + i + 1] = -beta;
        block[(i + 1) * s + i] = beta;
    }
    mech_mix_stages(s, s, block, c->t_inverse, half);
    mech_mix_stages(s, s, c->t, half, out);
}

void mech_stages_prepare(mech_stages *k, const mech_model *model, const mech_spectrum *spectrum,
                         mech_real *memory)
{
    const int ny = model->nq + model->nv + model->nx, n = spectrum->stages * ny;
    k->matrix = NULL;
    if (ny > MECH_MOST_STAGED) return;
    k->stages = spectrum->stages;
    recompose(spectrum, 0, k->inverse);
    recompose(spectrum, 1, k->a);
    k->jacobian = memory, memory += spectrum->stages * model->n_jacobian;
    k->matrix = memory, memory += (size_t)n * (size_t)n;
    k->room = memory, memory += n;
    k->pivot = (int *)memory;
}

int mech_stages_factorise(mech_stages *k, const mech_structure *structure, int n_jacobian, mech_real h)
{
    const int s = k->stages, m = structure->m, size = s * m;
    mech_real *a = k->matrix;
    k->h = h;
    for (int i = 0; i < size * size; i++) a[i] = 0;
    for (int i = 0; i < s; i++) {
        const mech_real *jacobian = k->jacobian + i * n_jacobian;
        for (int j = 0; j < s; j++) {
            mech_real *block = a + i * m * size + j * m;
            const mech_real inverse = k->inverse[i * s + j] / h, by = h * k->a[i * s + j];
            const mech_real *other = k->jacobian + j * n_jacobian;
            for (int p = 0; p < m; p++) block[p * size + p] += inverse;
            for (int l = 0; l < structure->n_chained; l++) {
                const int *c = structure->chained + 4 * l;
                block[c[2] * size + c[1] % m] -= jacobian[c[0]] * by * other[structure->coefficient[c[3]]];
            }
        }
        for (int l = 0; l < structure->n_direct; l++) {
            const int place = structure->direct[2 * l + 1];
            a[(i * m + place / m) * size + i * m + place % m] -= jacobian[structure->direct[2 * l]];
        }
    }
    return mech_factorise(size, a, k->pivot);
}

void mech_stages_correct(const mech_stages *k, const mech_structure *structure, int n_jacobian,
                         const mech_real *f, const mech_real *z, mech_real *d)
{
    const int s = k->stages, n = structure->n, m = structure->m;
    mech_mix_stages(s, n, k->inverse, z, d);
    for (int i = 0; i < s * n; i++) d[i] = f[i] - d[i] / k->h;
    mech_real *b = k->room;
    for (int i = 0; i < s; i++) {
        const mech_real *jacobian = k->jacobian + i * n_jacobian;
        for (int p = 0; p < m; p++) b[i * m + p] = d[i * n + structure->kept[p]];
        for (int l = 0; l < structure->n_chained; l++) {
            const int *c = structure->chained + 4 * l, at = structure->simple[c[3]];
            mech_real sum = 0;
            for (int j = 0; j < s; j++) sum += k->a[i * s + j] * d[j * n + at];
            b[i * m + c[2]] += jacobian[c[0]] * k->h * sum;
        }
    }
    mech_solve(s * m, k->matrix, k->pivot, b);
    for (int l = 0; l < structure->n_simple; l++) {
        const int at = structure->simple[l];
        mech_real right[MECH_MAX_STAGES];
        for (int j = 0; j < s; j++)
            right[j] = d[j * n + at] + k->jacobian[j * n_jacobian + structure->coefficient[l]] *
                                           b[j * m + structure->partner[l]];
        for (int i = 0; i < s; i++) {
            mech_real sum = 0;
            for (int j = 0; j < s; j++) sum += k->a[i * s + j] * right[j];
            d[i * n + at] = k->h * sum;
        }
    }
    for (int i = 0; i < s; i++)
        for (int p = 0; p < m; p++) d[i * n + structure->kept[p]] = b[i * m + p];
}
