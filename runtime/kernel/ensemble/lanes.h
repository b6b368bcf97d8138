/* Lanes: several members of an ensemble side by side in vectors, each with its own time, step and error. What the generated
 * lanes of a model (a library of their own) offer the ensemble.
 *
 *  1. Number i of lane l of an array stands at [i * width + l]; arrays begin at multiples of 64 bytes.
 *  2. Lanes are independent: every operation acts on vectors element by element, and work for single lanes leaves the others
 *     unchanged. A member gives the same bits in any lane and beside any others.
 *  3. The program of the model, not the compiler, decides where products and sums are fused: all widths with
 *     fused operations give the same bits.
 *  4. Lanes step as stepping/step.c does, for smooth models only. A failure is reported as `troubled`, and the scalar kernel
 *     runs the member again, which gives the message.
 */
#ifndef MECH_LANES_H
#define MECH_LANES_H

#include "model.h"

#define MECH_LANES_VERSION 1

#ifndef MECH_FIXED
#define MECH_FIXED const /* qualifies constants in memory; devices have a word of their own for it */
#endif

/* The lanes of one vector. Sets of lanes are bits: lane l is 1 << l. */
typedef struct mech_lane_room {
    /* of each lane, set where a member enters it */
    mech_real *t, *rtol, *longest;  /* `longest`: the longest step                                  */
    mech_real *limit;               /* a time that a step ends at: the next stop, or the end        */
    mech_real *next_row;            /* the next time of the grid, infinite: none                    */
    mech_real *most;                /* steps after which the lane is told as `full`, infinite: none */
    mech_real *y, *atol;            /* [ny]                                                         */
    mech_real *p, *z, *u;           /* parameters with hoisted constants; u: inputs that are given  */
    /* of each lane, kept from step to step */
    mech_real *dt, *error_old, *steps, *next_look, *order;
    mech_real *dy;                  /* [ny]                                                         */
    /* of the last step */
    mech_real *from, *h;            /* where it began, its size                                     */
    mech_real *stiffness;           /* |h lambda| as it saw it, of lanes that `looked`              */
    mech_real *dense;               /* [n_dense][ny] coefficients of its polynomial (solver.h), of which */
    int terms;                      /* there are so many                                            */
    mech_real *samples;             /* [MECH_LANE_SAMPLES][n_kept] what is kept, along it           */
    mech_real *extra;               /* [n_extra] of the method                                      */
    const unsigned char *given;     /* [nu] of all lanes: the input is that of `u`                  */
    unsigned alive;                 /* lanes that hold a member                                     */
    unsigned fresh;                 /* lanes whose member begins                                    */
    unsigned after_rejection;
    /* what the last step brought */
    unsigned took;                  /* the step was good                                            */
    unsigned landed;                /* and ended at the limit                                       */
    unsigned looked;                /* `stiffness` was looked at                                    */
    unsigned passed;                /* a time of the grid was reached or passed                     */
    unsigned full, troubled;
    int watched;                    /* samples are wanted of every step                             */
} mech_lane_room;

/* Places of the samples on a step: of Lobatto's rule on 0..1, exact up to the eleventh degree. */
enum { MECH_LANE_SAMPLES = 7 };
#define MECH_LANE_PLACES \
    {0, MECH_C(0.084888051860716535), MECH_C(0.26557560326464289), MECH_C(0.5), \
     MECH_C(0.73442439673535711), MECH_C(0.91511194813928346), 1}

#if !defined(__OPENCL_VERSION__)
typedef struct mech_lanes {
    int version, width, groups, fused;
    int ny, n_all, nz, nu;          /* n_all: parameters with hoisted constants                     */
    int n_kept, n_dense, n_extra;
    int plain;                      /* the polynomial of a step is one in powers of s, not as in solver.h */
    const char *build;              /* in words: the vectors, and whether operations are fused      */
    int look_every;                 /* steps between two looks at stiffness; 0: never               */
    mech_real stiffness_bound;
    /* Begins the members of `fresh` lanes: derivative and first step. Tells `troubled`. */
    void (*begin)(mech_lane_room *room);
    /* Attempts one step in each lane of rooms[groups], which do not feel each other either. */
    void (*attempt)(mech_lane_room *rooms);
} mech_lanes;
#endif

#endif
