/* Dense LU factors with partial pivoting, real and complex. */
#include "linear.h"

static void swap(mech_real *a, mech_real *b, int n)
{
    for (int j = 0; j < n; j++) {
        const mech_real x = a[j];
        a[j] = b[j];
        b[j] = x;
    }
}

int mech_factorise(int n, mech_real *a, int *pivot)
{
    for (int k = 0; k < n; k++) {
        int p = k;
        for (int i = k + 1; i < n; i++)
            if (mech_abs(a[i * n + k]) > mech_abs(a[p * n + k])) p = i;
        pivot[k] = p;
        if (!(mech_abs(a[p * n + k]) > 0)) return 1;
        if (p != k) swap(a + p * n, a + k * n, n);
        const mech_real *top = a + k * n, inverse = 1 / top[k];
        a[k * n + k] = inverse; /* the solution multiplies by it */
        for (int i = k + 1; i < n; i++) {
            mech_real *row = a + i * n, f = row[k] * inverse;
            row[k] = f;
            if (f != 0)
                for (int j = k + 1; j < n; j++) row[j] -= f * top[j];
        }
    }
    return 0;
}

void mech_solve(int n, const mech_real *a, const int *pivot, mech_real *b)
{
    for (int k = 0; k < n; k++) {
        const mech_real x = b[pivot[k]];
        b[pivot[k]] = b[k];
        b[k] = x;
    }
    for (int i = 1; i < n; i++) {
        mech_real sum = b[i];
        for (int j = 0; j < i; j++) sum -= a[i * n + j] * b[j];
        b[i] = sum;
    }
    for (int i = n - 1; i >= 0; i--) {
        mech_real sum = b[i];
        for (int j = i + 1; j < n; j++) sum -= a[i * n + j] * b[j];
        b[i] = sum * a[i * n + i];
    }
}

/* |re| + |im| is within a factor sqrt 2 of the modulus, and cannot overflow half-way. */
static mech_real size(mech_real re, mech_real im) { return mech_abs(re) + mech_abs(im); }

int mech_factorise_complex(int n, mech_real *re, mech_real *im, int *pivot)
{
    for (int k = 0; k < n; k++) {
        int p = k;
        for (int i = k + 1; i < n; i++)
            if (size(re[i * n + k], im[i * n + k]) > size(re[p * n + k], im[p * n + k])) p = i;
        pivot[k] = p;
        const mech_real scale = size(re[p * n + k], im[p * n + k]);
        if (!(scale > 0)) return 1;
        if (p != k) {
            swap(re + p * n, re + k * n, n);
            swap(im + p * n, im + k * n, n);
        }
        const mech_real *tr = re + k * n, *ti = im + k * n;
        const mech_real ur = tr[k] / scale, ui = ti[k] / scale, square = (ur * ur + ui * ui) * scale;
        const mech_real vr = ur / square, vi = -ui / square;
        re[k * n + k] = vr;
        im[k * n + k] = vi;
        for (int i = k + 1; i < n; i++) {
            mech_real *rr = re + i * n, *ri = im + i * n;
            const mech_real fr = rr[k] * vr - ri[k] * vi, fi = rr[k] * vi + ri[k] * vr;
            rr[k] = fr;
            ri[k] = fi;
            if (fr == 0 && fi == 0) continue;
            for (int j = k + 1; j < n; j++) {
                rr[j] -= fr * tr[j] - fi * ti[j];
                ri[j] -= fr * ti[j] + fi * tr[j];
            }
        }
    }
    return 0;
}

void mech_solve_complex(int n, const mech_real *re, const mech_real *im, const int *pivot, mech_real *b_re,
                        mech_real *b_im)
{
    for (int k = 0; k < n; k++) {
        const int p = pivot[k];
        const mech_real x = b_re[p], y = b_im[p];
        b_re[p] = b_re[k];
        b_im[p] = b_im[k];
        b_re[k] = x;
        b_im[k] = y;
    }
    for (int i = 1; i < n; i++) {
        const mech_real *rr = re + i * n, *ri = im + i * n;
        mech_real x = b_re[i], y = b_im[i];
        for (int j = 0; j < i; j++) {
            x -= rr[j] * b_re[j] - ri[j] * b_im[j];
            y -= rr[j] * b_im[j] + ri[j] * b_re[j];
        }
        b_re[i] = x;
        b_im[i] = y;
    }
    for (int i = n - 1; i >= 0; i--) {
        const mech_real *rr = re + i * n, *ri = im + i * n;
        mech_real x = b_re[i], y = b_im[i];
        for (int j = i + 1; j < n; j++) {
            x -= rr[j] * b_re[j] - ri[j] * b_im[j];
            y -= rr[j] * b_im[j] + ri[j] * b_re[j];
        }
        b_re[i] = x * rr[i] - y * ri[i];
        b_im[i] = x * ri[i] + y * rr[i];
    }
}
