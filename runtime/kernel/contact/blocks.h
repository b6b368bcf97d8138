/* The contact problem (cones.h) of many bodies, without its matrix: each cone moves the few velocities of the bodies that it
 * connects, and a sweep over all cones costs as much as there are of them. Internal to the kernel.
 *
 * u = K v + b and v = v0 + sum of R r over the cones, so that W = K R.
 */
#ifndef MECH_BLOCKS_H
#define MECH_BLOCKS_H

#include "cones.h"

typedef struct mech_block {
    mech_cone cone;                /* its place `at` says nothing here                             */
    int width;                     /* how many velocities it moves                                 */
    const int *v;                  /* [width] which                                                */
    const mech_real *k, *response; /* [rows][width] K, R^T                                         */
    mech_real w[9];                /* [3][3] K R                                                   */
    mech_real b[3], r[3], u[3];    /* r: a guess, or zero, before                                  */
} mech_block;

typedef struct mech_blocks {
    int n, nv;
    mech_block *blocks;
    const mech_real *free_; /* [nv] v0                                                       */
    mech_real *v;           /* [nv] that of r                                                */
    mech_real *room;        /* [6 n + 2 nv] for the sweeps                                   */
    mech_real residual;     /* the largest                                                   */
    int worst;              /* its block                                                     */
    int sweeps;             /* what it took                                                  */
} mech_blocks;

/* w of a block from its K and R. */
void mech_block_join(mech_block *block);

/* v, all u, residual and worst of all r. Gives whether all residuals are within their slacks. */
int mech_blocks_check(mech_blocks *c);

/* Gauss-Seidel from the guesses, each cone solved exactly, with momentum from sweep to sweep (Y. Nesterov 1983) that begins again where
 * it misleads (B. O'Donoghue, E. Candes 2015); at most so many sweeps. Gives whether it is solved. */
int mech_blocks_sweep(mech_blocks *c, int most);

/* Rows of all blocks; numbers of room to solve them as one problem. */
int mech_blocks_rows(const mech_blocks *c);
size_t mech_blocks_joined_room(const mech_blocks *c);

/* With their matrix, by Newton's method from the guesses (cones.h): where contacts of one mechanism act on each other so much that
 * sweeps hardly get on. Gives whether it is solved; all r are at least as good as before. */
int mech_blocks_solve_joined(mech_blocks *c, mech_real *room);

#endif
