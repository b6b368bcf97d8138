/* The contact problem: impulses in cones, and the rates that they leave. Internal to the kernel.
 *
 * Find r and u = W r + q such that for each cone K, with its dual K*, K* contains u + mu |u_t| n at right angles to r in K:
 * Signorini's condition and Coulomb's law in the form of G. de Saxce and Z.-Q. Feng (1998). Restitution belongs into q,
 * compliance onto the diagonal of W. Rates and impulses, or accelerations and forces: the problem is the same.
 *
 * W is symmetric, but for contacts that slide on in a known direction (one row, r >= 0, that pushes along another direction
 * than it measures). There need not be a solution then (P. Painleve 1895). Rows may depend on each other.
 */
#ifndef MECH_CONES_H
#define MECH_CONES_H

#include <stddef.h>

#include "real.h"

enum mech_cone_kind {
    MECH_CONE_HELD, /* one row, u = 0, r of any sign                                            */
    MECH_CONE,      /* the normal row, then `slips` tangential ones: |r_t| <= coefficient r_n    */
    MECH_CONE_DISC  /* `slips` tangential rows: |r_t| <= coefficient                             */
};

typedef struct mech_cone {
    int kind, at, slips; /* at: its first row; slips: 0, 1 or 2, of a disc 1 or 2                */
    mech_real coefficient;
    mech_real slack;     /* a residual that counts as none, in the unit of its rates             */
} mech_cone;

typedef struct mech_cones {
    int n, n_cones;         /* rows, cones                                                       */
    const mech_cone *cones; /* rows of a cone follow each other, cones follow each other         */
    const mech_real *w;     /* [n][n]                                                            */
    const mech_real *q;     /* [n]                                                               */
    mech_real *r, *u;       /* [n]; r: a guess, or zero, before                                  */
    mech_real residual;     /* the largest: natural map of a cone as a rate                      */
    int worst;              /* its cone                                                          */
    int sweeps, factors;    /* what it took                                                      */
} mech_cones;

/* How many rows it has. */
static inline int mech_cone_rows(const mech_cone *k) { return k->kind == MECH_CONE_HELD ? 1 : k->slips + (k->kind == MECH_CONE); }

/* r of one cone for u = W r + q; W[3][3] of its rows. */
void mech_cone_solve(const mech_cone *k, const mech_real *w, const mech_real *q, mech_real *r);
/* Its residual for r and u, of which rates and impulses are compared by the inverse mass m. */
mech_real mech_cone_residual(const mech_cone *k, mech_real m, const mech_real *r, const mech_real *u);

/* Numbers of room that the solvers need for n rows. */
size_t mech_cones_room(int n);

/* u, residual and worst of r. Gives whether all residuals are within their slacks. */
int mech_cones_check(mech_cones *c);

/* Block Gauss-Seidel from r, each cone solved exactly; at most so many sweeps. Gives whether it is solved. */
int mech_cones_sweep(mech_cones *c, int most, mech_real *room);

/* Newton's method alone, from an r near a solution. Gives whether it is solved; r is of least residual among its steps. */
int mech_cones_refine(mech_cones *c, mech_real *room);

/* From zero, whatever r was: alternating directions (ADMM), then Newton's method. What is symmetric has symmetric impulses.
 * Gives whether it is solved; r is the best that was found. */
int mech_cones_solve(mech_cones *c, mech_real *room);

#endif
