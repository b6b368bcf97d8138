/* Dense linear algebra. Internal to the kernel.
 *
 * Complex numbers are pairs of arrays, so that every number type of a build will do.
 */
#ifndef MECH_LINEAR_H
#define MECH_LINEAR_H

#include <stddef.h>

#include "real.h"

/* How many mech_real have room for some bytes, and for n integers: what lies among numbers in one block. */
static inline size_t mech_room_for(size_t bytes) { return (bytes + sizeof(mech_real) - 1) / sizeof(mech_real); }
static inline size_t mech_integers(int n) { return mech_room_for((size_t)n * sizeof(int)); }

/* LU factors with partial pivoting in place, rows one after the other; 0, or 1 where a is singular. */
int mech_factorise(int n, mech_real *a, int *pivot);
void mech_solve(int n, const mech_real *a, const int *pivot, mech_real *b);
int mech_factorise_complex(int n, mech_real *re, mech_real *im, int *pivot);
void mech_solve_complex(int n, const mech_real *re, const mech_real *im, const int *pivot, mech_real *b_re,
                        mech_real *b_im);

#endif
