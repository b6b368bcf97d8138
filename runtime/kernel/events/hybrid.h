/* Runs with events: location in time (locate.c), what happens at one instant (instant.c), impacts
 * (impacts.c), and which rows hold, stick, slide or are open (modes.c). Internal to the kernel.
 *
 * Words. A *switch* is a relation frozen between events; a *row* a contact, a friction or a constraint that can be
 * switched (model.h). w = g with the sign that the present mode keeps at w >= 0; an event is where w leaves that.
 */
#ifndef MECH_HYBRID_H
#define MECH_HYBRID_H

#include "method.h"

enum {
    MECH_SAMPLES = 6,    /* both ends of a step and three between, and room for one more             */
    MECH_RECENT = 50,    /* firings of branches that are looked at for ever shorter intervals        */
    MECH_MOST_ROWS = 64  /* rows of a model: mech_look refuses more, lists of different rows hold them */
};

typedef struct mech_modes {
    int n, n_rows;          /* indicators: n_switches + n_rows                               */
    mech_real *z;
    mech_real *w;           /* [MECH_SAMPLES][n]                                             */
    mech_real *rate;        /* [MECH_SAMPLES][n] dw/dt                                       */
    mech_real *scale, *rate_scale; /* [n] largest |w| and |dw/dt| so far                     */
    mech_real *fresh;       /* [n] 1: crossed at the present instant                         */
    mech_real *row;         /* [n_rows][MECH_ROW_VALUES]                                     */
    mech_real *gap_scale, *speed, *force; /* [n_rows] largest values so far                  */
    mech_real *mobility;    /* [n_rows] largest response of a row to itself so far           */
    mech_real *response;    /* [n_rows][nv + n_rows] by unit impulses                        */
    mech_real *impulse, *change; /* [n_rows]                                                 */
    mech_real *matrix;      /* [n_rows][n_rows + 1] of a linear system                       */
    mech_real *flags, *signs; /* [n_rows] before the instant                                 */
    mech_real *open, *slides; /* [n_rows] at the present instant: let go (1), stays though it rises (-1); slides so */
    mech_real *last_hit, *delay; /* [n_rows] time of the last impact; until the bounces that are left out end */
    mech_real *held, *held_new; /* [n_branches] conditions                                   */
    mech_real *act;         /* [ny + nz + checks]                                            */
    mech_real *y_at, *move; /* [ny] a state; a displacement                                  */
    mech_real *y_before, *z_before, *outputs, *times;
    mech_real *recent;      /* [MECH_RECENT] times of the last firings of branches           */
    mech_real *counters;    /* [COUNTERS]                                                    */
} mech_modes;

enum {
    MECH_FIRED = 0, MECH_BRANCH, MECH_STANDING, MECH_LAST_TIME, MECH_CROWD, MECH_CROWD_TIME, MECH_COUNTERS
};

/* Lets a size grow to |x|; what is infinite or not a number has no size, and must not spoil those to come. */
static inline void mech_widen(mech_real *size, mech_real x)
{
    if (mech_finite(x)) *size = mech_max(*size, mech_abs(x));
}

/* Of a row: its description; what it measures at present (enum mech_row_value); its rate; whether it holds. */
static inline const mech_row *mech_row_of(const mech_solver *s, int i) { return &s->model->hybrid->rows[i]; }

static inline mech_real mech_value(const mech_solver *s, int i, int which)
{
    return s->modes->row[i * MECH_ROW_VALUES + which];
}

static inline mech_real *mech_rate(const mech_solver *s, int i)
{
    return s->modes->row + i * MECH_ROW_VALUES + MECH_RATE;
}

static inline int mech_holds(const mech_solver *s, int i)
{
    return s->modes->z[mech_row_of(s, i)->flag] > MECH_C(0.5);
}

/* Change of the rate of row i by a unit impulse along row j, as mech_find_response has found it last. */
static inline mech_real mech_response(const mech_solver *s, int i, int j)
{
    const int nv = s->model->nv;
    return s->modes->response[j * (nv + s->modes->n_rows) + nv + i];
}

/* Numbers that a model needs, and their places in memory that begins at `memory`. */
size_t mech_modes_numbers(const mech_model *model);
void mech_modes_attach(mech_modes *e, const mech_model *model, mech_real *memory);

int mech_advance_hybrid(mech_solver *s, mech_real t_end, long max_steps);

/* What the solver needs of all this, so that models without events do without (events.c). */
typedef struct mech_event_support {
    size_t (*numbers)(const mech_model *model);
    void (*attach)(mech_modes *e, const mech_model *model, mech_real *memory);
    int (*advance)(mech_solver *s, mech_real t_end, long max_steps);
} mech_event_support;

/* NULL where models with events are left out. */
extern const mech_event_support *const mech_events;

/* w and, where asked for, dw/dt at a state. */
void mech_indicate(mech_solver *s, mech_real t, const mech_real *y, mech_real *w, mech_real *rate);
/* 1 where w vanishes up to rounding. */
int mech_at_zero(const mech_solver *s, int k, mech_real w);
/* The largest size so far of what indicator k measures in its present mode. */
mech_real *mech_indicator_size(const mech_solver *s, int k);
/* Seeks the first event on the attempted step: *hit its indicator or -1, *part where in 0..1. */
void mech_locate(mech_solver *s, mech_real h, int *hit, mech_real *part);

/* What happens at the present time. `hit`: the indicator that was located, or -1. */
int mech_instant(mech_solver *s, int hit);
/* The same without a step before or behind it. `ticks`: pulses of the clocks that are due. */
int mech_happen(mech_solver *s, int hit, int ticks);
/* Switches, sizes and held conditions where nothing has happened yet. */
int mech_look(mech_solver *s);
/* Looks, the first time; then what happens at the present time. */
int mech_begin_modes(mech_solver *s);
int mech_begin_hybrid(mech_solver *s);
/* Sets the switches that depend on time alone. */
int mech_set_times(mech_solver *s, int ticks);
void mech_read_conditions(mech_solver *s, mech_real *out);
/* Tells the changes of modes over the instant. */
void mech_note_modes(mech_solver *s, int quiet);
void mech_write_instant(mech_solver *s);
/* The first time after the present one at which something is known to happen, or infinity. */
mech_real mech_next_time(mech_solver *s);
void mech_note(mech_solver *s, int kind, int index, mech_real value);

void mech_read_rows(mech_solver *s);
/* MECH_OUT_OF_RANGE where a coefficient of the rows read last is; `limits`: where a limit of friction is, too. */
int mech_check_rows(mech_solver *s, int limits);
/* The second row of a friction on a surface, of which i is the first, or -1. */
int mech_partner(const mech_solver *s, int i);
/* The size of a value of a friction, over both rows on a surface. */
mech_real mech_size_of(const mech_solver *s, int i, int which);
int mech_touches(const mech_solver *s, int i);
/* Whether contact i would fall back before its gap grows beyond rounding. */
int mech_falls_back(const mech_solver *s, int i, mech_real rate);
mech_real mech_still(const mech_solver *s, int i); /* speed that counts as none */
/* Frictions on surfaces (slides.c). The slip of friction i that counts as none; whether it has no more than that. */
mech_real mech_no_slip(const mech_solver *s, int i);
int mech_slow(const mech_solver *s, int i);
/* Takes the slow slips away; gives those that begin to slide a slip that counts as none. */
void mech_end_slips(mech_solver *s);
void mech_begin_slides(mech_solver *s);
/* Whether indicator `hit` is that of a slide. */
int mech_slides(const mech_solver *s, int hit);
/* Turns slide i, from rest, into the direction in which it accelerates; 0 where it has that. */
int mech_aim_slide(mech_solver *s, int i);
void mech_find_response(mech_solver *s);
/* Whether a force along row i changes its rate, by the responses found last: not so at a dead centre. */
int mech_moved_by_itself(const mech_solver *s, int i);
/* x of a[n][n] x = b for the rows in `set`, n different ones; dependent rows get 0. Gives the rank. */
int mech_solve_rows(mech_solver *s, int n, const int *set, const mech_real *target, mech_real *x);
/* Adds the effect of the impulses to velocities, row rates and energy accounts. */
void mech_apply_impulses(mech_solver *s);
int mech_impacts(mech_solver *s, int *count);
int mech_pass_step(mech_solver *s, int hit, int *passed);
int mech_choose_modes(mech_solver *s, int hit);
/* Moves the present state onto the rows that hold. */
void mech_hold_rows(mech_solver *s);
/* The rows that hold or stick; gives their number. */
int mech_held_rows(mech_solver *s, int *held);
/* Moves coordinates so that the gaps of n rows vanish; velocities so that their rates do. */
void mech_close_gaps(mech_solver *s, int n, const int *rows);
void mech_stop_rates(mech_solver *s, int n, const int *rows);
void mech_set_rates(mech_solver *s, int n, const int *rows, const mech_real *aim);

/* For callers who integrate themselves (overshoot.c): puts back a state that has left what holds, gone beyond the
 * surface of an open contact, or beyond the end of a slip. Gives by how much the present time went back with it. */
mech_real mech_catch_rows(mech_solver *s);
/* After what happened there: on again by that much, unless a contact comes back sooner. The present time stays. */
void mech_catch_up(mech_solver *s, mech_real time);

#endif
