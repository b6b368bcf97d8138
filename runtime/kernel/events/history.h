/* What delays look back at: the polynomials of the steps behind, with the modes in which they were taken. Internal to the
 * kernel.
 *
 * Before the start everything had the value of the start. Where a derivative jumps at one time, that of what looks back
 * jumps a delay later: at breaks, at which steps end (A. Bellen, M. Zennaro, Numerical Methods for Delay Differential
 * Equations, Oxford 2003, sections 2.1 and 3.1). No step is longer than the shortest delay, so that it looks at steps that
 * are done.
 */
#ifndef MECH_HISTORY_H
#define MECH_HISTORY_H

#include "run.h"

/* NULL: no memory. */
struct mech_history *mech_history_new(const mech_model *model, int n_dense, int order);
void mech_history_free(struct mech_history *h);

/* Forgets all; a status where a delay is not positive. */
int mech_history_begin(mech_solver *s);

/* The start has happened: its values stay. */
int mech_history_freeze(mech_solver *s);

/* Writes what z holds of the past at time t; where that jumps, what comes behind at the beginning of a step, and what
 * comes before at its end. */
void mech_history_look(mech_solver *s, mech_real t);

/* The same at the present time, before it jumps: an instant begins. */
void mech_history_look_before(mech_solver *s);

/* Keeps the attempted step of h. */
int mech_history_keep(mech_solver *s, mech_real h);

/* Something may jump at the present time, by an instant or between rows of a table: what looks back will. */
int mech_history_instant(mech_solver *s);
int mech_history_stop(mech_solver *s);

/* The time until which the present step may last. */
mech_real mech_history_next(const mech_solver *s);

/* Whether the present time is a break; breaks follow from it. A negative status: no memory. */
int mech_history_at_break(mech_solver *s);

/* As mech_save_size, mech_save, mech_load. */
size_t mech_history_size(const mech_solver *s);
void mech_history_save(const mech_solver *s, char *memory);
void mech_history_load(mech_solver *s, const char *memory);

#endif
