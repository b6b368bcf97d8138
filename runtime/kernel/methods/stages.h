/* Newton's method on all stages of an implicit Runge-Kutta step at once, each with a Jacobian of its own.
 *
 * Simplified iterations (newton.h) take one Jacobian for all stages. Where a stiff force changes its direction
 * during the step, as a stiff spring in a mechanism does, they converge only for steps that fall with the
 * stiffness; with the Jacobians of the stages the steps do not depend on it.
 *
 * Ch. Lubich, Integration of stiff mechanical systems by Runge-Kutta methods, Z. angew. Math. Phys. 44, 1993.
 */
#ifndef MECH_STAGES_H
#define MECH_STAGES_H

#include "newton.h"

/* Most states of a model for which this is done: the matrix of the stages is dense. */
enum { MECH_MOST_STAGED = 150 };

typedef struct mech_stages {
    int stages;
    mech_real h; /* of the factors */
    mech_real a[MECH_MAX_STAGES * MECH_MAX_STAGES], inverse[MECH_MAX_STAGES * MECH_MAX_STAGES];
    mech_real *jacobian; /* [stages][n_jacobian] */
    mech_real *matrix, *room; /* NULL for larger models */
    int *pivot;
} mech_stages;

/* Numbers of mech_real that mech_stages_prepare takes of memory. */
size_t mech_stages_size(const mech_model *model, const mech_spectrum *spectrum);
void mech_stages_prepare(mech_stages *k, const mech_model *model, const mech_spectrum *spectrum,
                         mech_real *memory);

/* From the Jacobians of the stages: 0, or 1 where the matrix is singular or not finite. */
int mech_stages_factorise(mech_stages *k, const mech_structure *structure, int n_jacobian, mech_real h);

/* d[stages][n], the corrections of the stages z[stages][n] with the derivatives f. */
void mech_stages_correct(const mech_stages *k, const mech_structure *structure, int n_jacobian,
                         const mech_real *f, const mech_real *z, mech_real *d);

#endif
