/* Members that a device takes on, for whoever calls it: made ready here, and told here. Arrays as in item_layout.h.
 *
 *  1. mech_items_open makes all members of an ensemble ready that wait.
 *  2. Then, as long as mech_items_next gives some: it fills the arrays with those of which a run is to be made; the device takes
 *     each on until its status says that it ended; mech_items_take reads the arrays. The runs of a member follow each other.
 *  3. mech_items_close.
 */
#ifndef MECH_ITEMS_H
#define MECH_ITEMS_H

#include "ensemble.h"

typedef struct mech_items mech_items;

typedef struct mech_item_arrays {
    mech_real *numbers;     /* [MECH_ITEM_SINGLES + 2 ny + n_kept, and more][n]              */
    int *marks;             /* [MECH_ITEM_MARKS][n]                                          */
    mech_real *fixed;       /* [np + nh + nz + nu][n]                                        */
    mech_real *rows;        /* [n_grid][ny][n]                                               */
    unsigned *which;        /* [n] members of which a run is to be made                      */
} mech_item_arrays;

/* Bytes of a member in the memory of this machine. */
MECH_API size_t mech_items_bytes(const mech_ensemble *e);
/* NULL where memory is missing. */
MECH_API mech_items *mech_items_open(const mech_ensemble *e);
/* Gives how many runs are to be made. */
MECH_API long mech_items_next(mech_items *items, const mech_item_arrays *arrays);
/* Those of the first `count` of `which` that have not ended wait, as where the call is to end. */
MECH_API void mech_items_take(mech_items *items, const mech_item_arrays *arrays, long count);
MECH_API void mech_items_close(mech_items *items);

#endif
