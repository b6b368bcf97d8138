/* The systems (sigma - J) d = r of implicit methods. Internal to the kernel.
 *
 * J is the sparse Jacobian of the model. A row of J that holds one entry, as q' = v does, is eliminated by
 * hand: what is factorised has the size of what remains, nv + nx for a system of second order without
 * rotations. It is dense: the accelerations of a mechanism depend on all its coordinates. Good for some
 * hundred unknowns.
 */
#ifndef MECH_SHIFTED_H
#define MECH_SHIFTED_H

#include "linear.h"

/* The structure of J, found once. All arrays lie in memory that the caller gives. */
typedef struct mech_structure {
    int n, m; /* unknowns: all, and those that remain */
    int n_simple;
    int *kept;        /* [m] index in y */
    int *simple;      /* [n_simple] index in y of a row J[i][j] = c with no other entry */
    int *partner;     /* [n_simple] place of j among the kept */
    int *coefficient; /* [n_simple] which entry of J is c */
    int n_direct, n_chained;
    int *direct;  /* [n_direct][2] entry, place in the reduced matrix */
    int *chained; /* [n_chained][4] entry, place in the reduced matrix, its row, number of the simple row */
} mech_structure;

/* Numbers of mech_real that mech_find_structure fills. */
size_t mech_structure_size(const mech_model *model);
mech_structure mech_find_structure(const mech_model *model, mech_real *memory);

/* Factors of sigma - J on what remains. */
int mech_factorise_shifted(const mech_structure *k, const mech_real *jacobian, mech_real sigma, mech_real *a,
                           int *pivot);
int mech_factorise_shifted_complex(const mech_structure *k, const mech_real *jacobian, mech_real sigma_re,
                                   mech_real sigma_im, mech_real *re, mech_real *im, int *pivot);

/* Solves (sigma - J) d = r in place; `b` is room for n numbers, or twice n. */
void mech_solve_shifted(const mech_structure *k, const mech_real *jacobian, mech_real sigma,
                        const mech_real *a, const int *pivot, mech_real *r, mech_real *b);
void mech_solve_shifted_complex(const mech_structure *k, const mech_real *jacobian, mech_real sigma_re,
                                mech_real sigma_im, const mech_real *re, const mech_real *im,
                                const int *pivot, mech_real *r_re, mech_real *r_im, mech_real *b);

#endif
