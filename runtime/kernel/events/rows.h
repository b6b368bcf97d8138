/* Rows that can be switched (model.h): what they measure, and what impulses along them do. Internal to the kernel. */
#ifndef MECH_ROWS_H
#define MECH_ROWS_H

#include "event_state.h"

/* Of a row: its description; what it measures at present (enum mech_row_value); its rate; whether it holds. */
static inline const mech_row *mech_row_of(const mech_solver *s, int i) { return &s->events->rows[i]; }

static inline mech_real mech_row_value(const mech_solver *s, int i, int which)
{
    return s->events->row[i * MECH_ROW_VALUES + which];
}

static inline mech_real *mech_row_rate(const mech_solver *s, int i)
{
    return s->events->row + i * MECH_ROW_VALUES + MECH_RATE;
}

static inline int mech_row_holds(const mech_solver *s, int i)
{
    return s->events->z[mech_row_of(s, i)->flag] > MECH_C(0.5);
}

/* Change of the rate of row i by a unit impulse along row j, as mech_rows_find_response has found it last. */
static inline mech_real mech_row_response(const mech_solver *s, int i, int j)
{
    const int nv = s->model->nv;
    return s->events->response[j * (nv + s->events->n_rows) + nv + i];
}

/* Of row i, from what was read last. The second row of a friction on a surface, of which i is the first, or -1. */
int mech_row_partner(const mech_solver *s, int i);
/* The size of a value of a friction, over both rows on a surface. */
mech_real mech_row_size(const mech_solver *s, int i, int which);
/* Whether a contact is one that nothing has released. */
int mech_row_is_enabled(const mech_solver *s, int i);
/* Whether a contact is closed, as far as numbers tell. Of a crowd one that closed while a step was shortened to another's event
 * may be beyond its surface by what the polynomial of the step was off. */
int mech_row_touches(const mech_solver *s, int i);
/* Whether a contact touches, and neither opens nor approaches. */
int mech_row_may_rest(const mech_solver *s, int i);
/* Whether contact i would fall back before its gap grows beyond rounding. */
int mech_row_falls_back(const mech_solver *s, int i, mech_real rate);
/* Where loads are shared otherwise than modes say: whether row i holds or is beside one that does, or is a friction of a joint that
 * rests, so that its force is not an event. */
int mech_row_is_carried(const mech_solver *s, int i);
/* Of the coordinates that an impulse on row i moves, the largest nominal value, or value if these count, too: a ball of a micrometre
 * beside a planet touches by its own size. Of all coordinates for i < 0, and where coordinates without mass stand between the others,
 * of which no velocity tells. `speed`: the same of their velocities, if it is not NULL. */
mech_real mech_row_reach(const mech_solver *s, int i, int with_values, mech_real *speed);

/* Speed below which a contact rests: of a crowd that within the tolerance of the fastest, where nothing is said. */
mech_real mech_row_rest(const mech_solver *s, int i);
/* Speed that counts as none. */
mech_real mech_row_still(const mech_solver *s, int i);
/* Approach that is none of an impact: of a crowd, in which contacts depend on each other, what rounding leaves of others. */
mech_real mech_row_idle(const mech_solver *s, int i);
/* Whether a force along row i changes its rate, by the responses found last: not so at a dead centre. */
int mech_row_moves_itself(const mech_solver *s, int i);

void mech_rows_read(mech_solver *s);
/* MECH_OUT_OF_RANGE where a coefficient of the rows read last is; `limits`: where a limit of friction is, too. */
int mech_rows_check(mech_solver *s, int limits);
void mech_rows_find_response(mech_solver *s);
/* Of a crowd, whose rows were read last without any force, at the responses found last: its sizes of forces. What single ones grow
 * to where contacts nearly depend on each other is not a measure. */
void mech_rows_weigh(mech_solver *s);
/* x of a[n][n] x = b for the rows in `set`, n different ones; dependent rows get 0. Gives the rank. */
int mech_rows_solve(mech_solver *s, int n, const int *set, const mech_real *target, mech_real *x);
/* The same, but dependent rows share: of all solutions the least. */
int mech_rows_share(mech_solver *s, int n, const int *set, const mech_real *target, mech_real *x);
/* Of what was read last: a friction on a surface of which one direction holds, i the first, and other rows stand for the other
 * one, as along a wall, takes the share in which it needs least beyond its limit, and no contact pulls. Leaves all as it is where
 * contacts pull in every share. */
void mech_row_share_across(mech_solver *s, int i);
/* What the impulses take out of the energy, and the size of its terms. */
mech_real mech_rows_impulse_loss(const mech_solver *s, mech_real *size);
/* Adds the effect of the impulses to velocities, row rates and energy accounts. */
void mech_rows_apply_impulses(mech_solver *s);

#endif
