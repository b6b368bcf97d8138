/* Steps of Moreau and Jean where contacts are a crowd (model.h): each contact by its own numbers, the problem in blocks (blocks.h).
 * Internal to the kernel. */
#ifndef MECH_MOREAU_CROWD_H
#define MECH_MOREAU_CROWD_H

#include "linear.h"
#include "run.h"

/* Forces that are stiff (moreau.c): the factors of 1 - h/2 B, and for each velocity one of those that B connects it with. */
typedef struct mech_moreau_stiff {
    int is, nv; /* is: 0 where they are not */
    mech_real *lu;
    int *pivot, *group;
} mech_moreau_stiff;

static inline void mech_moreau_soften(const mech_moreau_stiff *o, mech_real *x) { mech_solve(o->nv, o->lu, o->pivot, x); }

static inline int mech_moreau_group(const mech_moreau_stiff *o, int i)
{
    while (o->group[i] != i) i = o->group[i];
    return i;
}

static inline void mech_moreau_join(const mech_moreau_stiff *o, int i, int j) { o->group[mech_moreau_group(o, i)] = mech_moreau_group(o, j); }

/* What is remembered from step to step. */
typedef struct mech_moreau_crowd {
    mech_real *impulse; /* [contacts][3] of the last step, along gap and slip                     */
    mech_real *wake;    /* [contacts] how far coordinates have to move before one is looked at    */
    mech_real *moves;   /* [nv] 1: moves a gap                                                    */
    mech_real *pull;    /* [nv] mean acceleration by the impulses of the last step                */
    mech_real *effort;  /* [nv] mean force along the velocities                                   */
    mech_real *moved;   /* how far they have                                                      */
    mech_real *step;    /* size of the last step                                                  */
} mech_moreau_crowd;

/* Numbers that this takes, and their places in memory that begins at `memory`. */
size_t mech_moreau_crowd_numbers(const mech_model *model);
void mech_moreau_crowd_attach(mech_moreau_crowd *o, const mech_model *model, mech_real *memory);

/* All contacts are looked at next; fresh: and none has an impulse. */
void mech_moreau_crowd_begin(const mech_moreau_crowd *o, const mech_model *model, int fresh);

/* What a step has found. */
typedef struct mech_moreau_found {
    mech_real residual, overlap, lost, supplied;
    int sweeps, solved;
} mech_moreau_found;

/* The contacts of a step of h, with y in its middle (velocities there are written to): v from v0 and, without contacts, free_.
 * `fastest`: the largest rate so far. 0 without memory. */
int mech_moreau_crowd_solve(mech_solver *s, const mech_moreau_crowd *o, const mech_moreau_stiff *stiff, mech_real h, mech_real *y, const mech_real *v0,
                            const mech_real *free_, mech_real *v, mech_real *fastest, mech_moreau_found *found);

/* The jumps of the velocities by the impulses of the last step, of h, at the state y; 0 without memory. */
int mech_moreau_crowd_push(mech_solver *s, const mech_moreau_crowd *o, mech_real t, mech_real h, const mech_real *y, mech_real *jumps);

/* Writes the mean forces of the last step to z: what they do, and those that are asked. */
void mech_moreau_crowd_tell(const mech_moreau_crowd *o, const mech_model *model, mech_real *z);

#endif
