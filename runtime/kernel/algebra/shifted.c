/* Systems (sigma - J) d = r, reduced by the rows of J with one entry.
 *
 * For such a row, sigma d_i - c d_j = r_i: d_i = (r_i + c d_j) / sigma goes into the other rows.
 */
#include "shifted.h"

#include <string.h>

size_t mech_structure_size(const mech_model *model)
{
    const size_t ny = (size_t)(model->nq + model->nv + model->nx);
    return mech_room_for((4 * ny + 4 * (size_t)model->n_jacobian) * sizeof(int));
}

/* The row of y whose only entry is number e, in a column that stays: such rows of (q, v, x) are eliminated.
 */
static int is_simple(const mech_model *model, int e, const int *count, const int *place)
{
    const int i = model->jac_row[e], j = model->jac_col[e];
    return count[i] == 1 && i != j && place[i] == 0 && place[j] >= 0;
}

mech_structure mech_find_structure(const mech_model *model, mech_real *memory)
{
    const int n = model->nq + model->nv + model->nx, entries = model->n_jacobian;
    int *next = (int *)memory;
    mech_structure k = {.n = n};
    k.kept = next, next += n;
    k.simple = next, next += n;
    k.partner = next, next += n;
    k.coefficient = next, next += n;
    /* Until they are known, the lists lend their room: entries per row, and -1 - number for a simple row,
       1 for a column that a simple row needs, 0 else. */
    int *count = k.kept, *place = k.partner;
    memset(count, 0, (size_t)n * sizeof(int));
    memset(place, 0, (size_t)n * sizeof(int));
    for (int e = 0; e < entries; e++) count[model->jac_row[e]]++;
    for (int e = 0; e < entries; e++)
        if (is_simple(model, e, count, place)) {
            k.simple[k.n_simple] = model->jac_row[e];
            k.coefficient[k.n_simple] = e;
            place[model->jac_row[e]] = -1 - k.n_simple++;
            place[model->jac_col[e]] = 1;
        }
    for (int i = 0; i < n; i++)
        if (place[i] >= 0) {
            k.kept[k.m] = i;
            place[i] = k.m++;
        }

    k.direct = k.chained = next;
    for (int e = 0; e < entries; e++) {
        const int row = place[model->jac_row[e]], column = place[model->jac_col[e]];
        if (row < 0 || column < 0) continue;
        k.direct[2 * k.n_direct] = e;
        k.direct[2 * k.n_direct + 1] = row * k.m + column;
        k.n_direct++;
    }
    k.chained = k.direct + 2 * k.n_direct;
    for (int e = 0; e < entries; e++) {
        const int row = place[model->jac_row[e]], column = place[model->jac_col[e]];
        if (row < 0 || column >= 0) continue;
        int *c = k.chained + 4 * k.n_chained++;
        c[0] = e;
        c[1] = row * k.m + place[model->jac_col[k.coefficient[-1 - column]]];
        c[2] = row;
        c[3] = -1 - column;
    }
    for (int l = 0; l < k.n_simple; l++) { /* the numbers of simple rows are no longer read */
        const int column = model->jac_col[k.coefficient[l]];
        int at = 0;
        while (k.kept[at] != column) at++;
        k.partner[l] = at;
    }
    return k;
}

int mech_factorise_shifted(const mech_structure *k, const mech_real *jacobian, mech_real sigma, mech_real *a,
                           int *pivot)
{
    const int m = k->m;
    const mech_real inverse = 1 / sigma;
    for (int i = 0; i < m * m; i++) a[i] = 0;
    for (int i = 0; i < m; i++) a[i * m + i] = sigma;
    for (int l = 0; l < k->n_direct; l++) a[k->direct[2 * l + 1]] -= jacobian[k->direct[2 * l]];
    for (int l = 0; l < k->n_chained; l++) {
        const int *c = k->chained + 4 * l;
        a[c[1]] -= jacobian[c[0]] * jacobian[k->coefficient[c[3]]] * inverse;
    }
    return mech_factorise(m, a, pivot);
}

int mech_factorise_shifted_complex(const mech_structure *k, const mech_real *jacobian, mech_real sigma_re,
                                   mech_real sigma_im, mech_real *re, mech_real *im, int *pivot)
{
    const int m = k->m;
    const mech_real square = sigma_re * sigma_re + sigma_im * sigma_im;
    const mech_real inverse_re = sigma_re / square, inverse_im = -sigma_im / square;
    for (int i = 0; i < m * m; i++) re[i] = im[i] = 0;
    for (int i = 0; i < m; i++) {
        re[i * m + i] = sigma_re;
        im[i * m + i] = sigma_im;
    }
    for (int l = 0; l < k->n_direct; l++) re[k->direct[2 * l + 1]] -= jacobian[k->direct[2 * l]];
    for (int l = 0; l < k->n_chained; l++) {
        const int *c = k->chained + 4 * l;
        const mech_real product = jacobian[c[0]] * jacobian[k->coefficient[c[3]]];
        re[c[1]] -= product * inverse_re;
        im[c[1]] -= product * inverse_im;
    }
    return mech_factorise_complex(m, re, im, pivot);
}

void mech_solve_shifted(const mech_structure *k, const mech_real *jacobian, mech_real sigma,
                        const mech_real *a, const int *pivot, mech_real *r, mech_real *b)
{
    const int m = k->m;
    const mech_real inverse = 1 / sigma;
    for (int i = 0; i < m; i++) b[i] = r[k->kept[i]];
    for (int l = 0; l < k->n_chained; l++) {
        const int *c = k->chained + 4 * l;
        b[c[2]] += jacobian[c[0]] * r[k->simple[c[3]]] * inverse;
    }
    mech_solve(m, a, pivot, b);
    for (int i = 0; i < m; i++) r[k->kept[i]] = b[i];
    for (int l = 0; l < k->n_simple; l++) {
        const int i = k->simple[l];
        r[i] = (r[i] + jacobian[k->coefficient[l]] * b[k->partner[l]]) * inverse;
    }
}

void mech_solve_shifted_complex(const mech_structure *k, const mech_real *jacobian, mech_real sigma_re,
                                mech_real sigma_im, const mech_real *re, const mech_real *im,
                                const int *pivot, mech_real *r_re, mech_real *r_im, mech_real *b)
{
    const int m = k->m;
    const mech_real square = sigma_re * sigma_re + sigma_im * sigma_im;
    const mech_real inverse_re = sigma_re / square, inverse_im = -sigma_im / square;
    mech_real *b_re = b, *b_im = b + k->n;
    for (int i = 0; i < m; i++) {
        b_re[i] = r_re[k->kept[i]];
        b_im[i] = r_im[k->kept[i]];
    }
    for (int l = 0; l < k->n_chained; l++) {
        const int *c = k->chained + 4 * l, i = k->simple[c[3]];
        const mech_real x = r_re[i], y = r_im[i];
        b_re[c[2]] += jacobian[c[0]] * (x * inverse_re - y * inverse_im);
        b_im[c[2]] += jacobian[c[0]] * (x * inverse_im + y * inverse_re);
    }
    mech_solve_complex(m, re, im, pivot, b_re, b_im);
    for (int i = 0; i < m; i++) {
        r_re[k->kept[i]] = b_re[i];
        r_im[k->kept[i]] = b_im[i];
    }
    for (int l = 0; l < k->n_simple; l++) {
        const int i = k->simple[l], j = k->partner[l];
        const mech_real c = jacobian[k->coefficient[l]];
        const mech_real x = r_re[i] + c * b_re[j], y = r_im[i] + c * b_im[j];
        r_re[i] = x * inverse_re - y * inverse_im;
        r_im[i] = x * inverse_im + y * inverse_re;
    }
}
