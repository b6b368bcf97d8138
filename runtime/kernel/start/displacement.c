#include "displacement.h"

static int is_rotation(const mech_model *m, int i)
{
    for (int k = 0; k < m->n_rotations; k++)
        if (m->rotations[k] == i) return 1;
    return 0;
}

static void product(const mech_real *a, const mech_real *b, mech_real *out)
{
    out[0] = a[0] * b[0] - (a[1] * b[1] + a[2] * b[2] + a[3] * b[3]);
    out[1] = a[1] * b[0] + b[1] * a[0] + (a[2] * b[3] - a[3] * b[2]);
    out[2] = a[2] * b[0] + b[2] * a[0] + (a[3] * b[1] - a[1] * b[3]);
    out[3] = a[3] * b[0] + b[3] * a[0] + (a[1] * b[2] - a[2] * b[1]);
}

static mech_real length(const mech_real *x) { return mech_sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

static void turn(mech_real *q, const mech_real *by)
{
    const mech_real angle = length(by), share = angle > 0 ? mech_sin(angle / 2) / angle : MECH_C(0.5);
    const mech_real half[4] = {mech_cos(angle / 2), share * by[0], share * by[1], share * by[2]};
    mech_real turned[4];
    product(q, half, turned);
    const mech_real size = mech_sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2] +
                                     turned[3] * turned[3]);
    for (int i = 0; i < 4; i++) q[i] = turned[i] / size;
}

static void rotation_vector(const mech_real *a, const mech_real *b, mech_real *out)
{
    if (a[0] == b[0] && a[1] == b[1] && a[2] == b[2] && a[3] == b[3]) {
        for (int i = 0; i < 3; i++) out[i] = 0; /* fused products leave rounding */
        return;
    }
    const mech_real back[4] = {a[0], -a[1], -a[2], -a[3]};
    mech_real relative[4];
    product(back, b, relative);
    const mech_real sign = relative[0] >= 0 ? 1 : -1, size = length(relative + 1);
    const mech_real share = size > MECH_C(1e-300) ? 2 * mech_atan2(size, sign * relative[0]) / size : 2;
    for (int i = 0; i < 3; i++) out[i] = sign * relative[1 + i] * share;
}

void mech_displace(const mech_model *m, mech_real *y, const mech_real *d)
{
    for (int j = 0; j < m->nv; j++) {
        const int i = m->start->partner[j];
        if (!is_rotation(m, i)) y[i] += d[j];
        else if ((j == 0 || m->start->partner[j - 1] != i) && (d[j] != 0 || d[j + 1] != 0 || d[j + 2] != 0))
            turn(y + i, d + j);
    }
}

void mech_deviation(const mech_model *m, const mech_real *y, const mech_real *guess, mech_real *out)
{
    for (int j = 0; j < m->nv; j++) {
        const int i = m->start->partner[j];
        if (!is_rotation(m, i)) out[j] = y[i] - guess[i];
        else if (j == 0 || m->start->partner[j - 1] != i) rotation_vector(guess + i, y + i, out + j);
    }
}

mech_real mech_characteristic_length(const mech_model *m, const mech_real *p)
{
    mech_real sum = 0;
    int n = 0;
    for (int k = 0; k < m->start->n_lengths; k++) {
        const mech_real size = mech_abs(p[m->start->lengths[k]]);
        if (size > 0) sum += mech_log(size), n++;
    }
    return n ? mech_exp(sum / n) : 1;
}
