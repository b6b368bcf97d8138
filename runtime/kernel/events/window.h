/* The rows of a crowd that are at hand: those that may touch within a step, or touch at an instant. Internal to the kernel.
 *
 * All that happens at events happens to them, as if the model had no others; what is not at hand is kept by contact.
 */
#ifndef MECH_WINDOW_H
#define MECH_WINDOW_H

#include "event_state.h"

/* Looks at all contacts for the first time; those that touch are at hand. */
int mech_window_begin(mech_solver *s, mech_real length, mech_real speed);
/* The contacts that may touch before the attempted step ends, and those that are closed. A step within which too many may
 * is repeated with a part of its size. */
int mech_window_for_step(mech_solver *s, mech_real *t_new, mech_real *h);
/* Those of them that touch, and the row `hit`; gives its new place. Of a row only those that it moves, or that approach as well,
 * and those that these move. */
int mech_window_for_instant(mech_solver *s, int hit);
/* After a state was loaded: as many rows are at hand as it says. */
void mech_window_again(mech_solver *s);
/* The number of row i in lists for people; names the row at which a run has failed by it. */
int mech_window_number(const mech_solver *s, int i);
void mech_window_name(mech_solver *s, int status);

/* What the rows at hand measure at (t, y), in the order of mech_row_value; `wholly`: second derivatives without forces, too. */
void mech_window_read(mech_solver *s, mech_real t, const mech_real *y, int wholly, mech_real *row);
/* Their indicators and the rates of these, if asked for. */
void mech_window_indicate(mech_solver *s, mech_real t, const mech_real *y, mech_real *w, mech_real *rate);
/* The same of row i alone, where that takes no forces; 0 where it does. */
int mech_window_indicate_one(mech_solver *s, int i, mech_real t, const mech_real *y, mech_real *w, mech_real *rate);
/* As much of the state at a part of the attempted step as row i reads. */
void mech_window_place(mech_solver *s, int i, mech_real part, mech_real *y);
/* What unit impulses along those that touch or hold do. */
void mech_window_respond(mech_solver *s);

#endif
