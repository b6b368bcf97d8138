/* Orthogonal factors of dense matrices, columns one after the other. Internal to the kernel. */
#ifndef MECH_ORTHOGONAL_H
#define MECH_ORTHOGONAL_H

#include <stddef.h>

#include "real.h"

/* a P = Q R of a[cols][rows], a column after the other: R above the diagonal, reflections below it, the columns in
   the order of P. `rank` counts the columns before what is left is smaller than a share of the first one. */
typedef struct mech_orthogonal {
    int rows, cols, rank;
    mech_real *a;    /* [cols][rows]                                                             */
    mech_real *head; /* [min(rows, cols)] first entry of each reflection                         */
    int *order;      /* [cols]                                                                   */
} mech_orthogonal;

void mech_orthogonalise(mech_orthogonal *o, mech_real share);

/* x[rows] = Q x, or Q' x where `transposed`. */
void mech_rotate(const mech_orthogonal *o, int transposed, mech_real *x);

/* x[cols] of least squares |a x - b|, 0 where a column depends on the others; b[rows] is spent. */
void mech_least_squares(const mech_orthogonal *o, mech_real *b, mech_real *x);

#endif
