/* Simplified Newton iterations of implicit Runge-Kutta methods. Internal to the kernel.
 *
 * The stages Z_i = h sum a_ij f(y + Z_j) are uncoupled by A^-1 = T L T^-1, where L holds one real number or
 * none and pairs of conjugate ones, as blocks [alpha -beta; beta alpha]. With Z = (T x 1) W the corrections
 * solve (lambda / h - J) dW = (T^-1 f)  - (L / h) W: one real system and complex ones of the size of a
 * single stage.
 *
 * J. C. Butcher 1976; E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section IV.8.
 */
#ifndef MECH_NEWTON_H
#define MECH_NEWTON_H

#include "run.h"
#include "shifted.h"

enum { MECH_MAX_STAGES = 4 };

typedef struct mech_spectrum {
    int stages, has_real, pairs;
    mech_real real, alpha[2], beta[2];
    mech_real t[MECH_MAX_STAGES * MECH_MAX_STAGES], t_inverse[MECH_MAX_STAGES * MECH_MAX_STAGES];
} mech_spectrum;

typedef struct mech_newton {
    const mech_spectrum *spectrum;
    mech_structure structure;
    mech_real h; /* of the factors; 0: there are none */
    mech_real *jacobian, *real, *re[2], *im[2], *room;
    int *pivot, *pivots[2];
} mech_newton;

size_t mech_newton_size(const mech_model *model, const mech_spectrum *spectrum);
void mech_newton_prepare(mech_newton *k, const mech_model *model, const mech_spectrum *spectrum,
                         mech_real *memory);

/* The Jacobian; where that has no value, as that of v |v| at rest, the one right beside: iterations need no more. */
void mech_jacobian(mech_solver *s, mech_real t, const mech_real *y, mech_real *out);

/* 0, or 1 where a matrix is singular or not finite. */
int mech_newton_factorise(mech_newton *k, mech_real h);

/* d[stages][n] = dW, from W and the derivatives f of the stages. */
void mech_newton_correct(const mech_newton *k, const mech_real *f, const mech_real *w, mech_real *d);

/* z[stages][n] = (matrix x 1) w, matrix[stages][stages]. */
void mech_mix_stages(int stages, int n, const mech_real *matrix, const mech_real *w, mech_real *z);

/* |lambda| of the largest eigenvalue of J, better with each call: x[n] is its vector as far as it is known. Infinite
   where x was lost. image[n] is room; sizes are times scale[n]. */
mech_real mech_dominant(const mech_model *model, const mech_real *jacobian, const mech_real *scale, mech_real *x,
                        mech_real *image);

#endif
