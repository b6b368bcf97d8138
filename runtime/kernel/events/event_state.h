/* What runs with events remember between their steps. Internal to the kernel.
 *
 * Words. A *switch* is a relation frozen between events; a *row* a contact, a friction or a constraint that can be
 * switched (model.h). w = g with the sign that the present mode keeps at w >= 0; an event is where w leaves that.
 */
#ifndef MECH_EVENT_STATE_H
#define MECH_EVENT_STATE_H

#include "run.h"

enum {
    MECH_SAMPLES = 6,    /* both ends of a step and three between, and room for one more             */
    MECH_RECENT = 50,    /* firings of branches that are looked at for ever shorter intervals        */
    MECH_MOST_ROWS = 512 /* rows at hand: mech_begin_look refuses more, lists of different rows hold them */
};

typedef struct mech_event_state {
    int n, n_rows;          /* indicators: n_switches + n_rows; of a crowd those rows at hand */
    const mech_row *rows;   /* [n_rows]                                                      */
    mech_real *z;
    mech_real *w;           /* [MECH_SAMPLES][n]                                             */
    mech_real *rate;        /* [MECH_SAMPLES][n] dw/dt                                       */
    mech_real *near, *near_rate; /* [3][n] of neighbouring places, where looks are close           */
    mech_real *scale, *rate_scale; /* [n] largest |w| and |dw/dt| so far                     */
    mech_real *turned, *idle; /* [n] time of the last turn; turns in a row that moved by less than the tolerance */
    mech_real *first_wait, *first_rate; /* [n] before and at the first of those                  */
    mech_real *fresh;       /* [n] 1: crossed at the present instant                         */
    mech_real *row;         /* [n_rows][MECH_ROW_VALUES]                                     */
    mech_real *gap_scale, *speed, *force; /* [n_rows] largest values so far                  */
    mech_real *sizes;       /* [2 n_rows] of speeds, then of forces, before a step            */
    mech_real *mobility;    /* [n_rows] largest response of a row to itself so far           */
    mech_real *response;    /* [n_rows][nv + n_rows] by unit impulses                        */
    mech_real *impulse, *change; /* [n_rows]                                                 */
    mech_real *matrix;      /* [n_rows][n_rows + 1] of a linear system                       */
    mech_real *flags, *signs; /* [n_rows] before the instant                                 */
    mech_real *open, *slides; /* [n_rows] at the present instant: let go (1), stays though it rises (-1); slides so */
    mech_real *last_hit, *delay; /* [n_rows] time of the last impact; until the bounces that are left out end */
    mech_real *held, *held_new; /* [n_branches] conditions                                   */
    mech_real *act;         /* [ny + nz + checks]                                            */
    mech_real *y_at, *move, *driven; /* [ny] a state; a displacement; derivatives at rest    */
    mech_real *aside_at;    /* [ny] a state that is looked at                                */
    mech_real *correction;  /* [nv] of velocities                                            */
    mech_real *y_before, *z_before, *outputs, *times;
    mech_real *recent;      /* [MECH_RECENT] times of the last firings of branches           */
    mech_real *jolted;      /* [ny] the state where impacts at bends of gaps began to follow each other */
    mech_real *counters;    /* [MECH_COUNTERS]                                               */
    mech_row *places;       /* of a crowd: rows at hand                                      */
    mech_real *window;      /* [MECH_MOST_ROWS] for each of them 2 contact, + 1 where it is that of friction */
    mech_real *kept;        /* [2 contacts][MECH_KEPT] what rows remember while they are not at hand */
    mech_real *wake;        /* [contacts] how far coordinates have to move before one may touch */
    mech_real *values;      /* [MECH_MOST_ROWS][crowd's widest] of rows at hand                    */
    mech_real *given, *rates, *forces; /* behind inputs; [ny]; [MECH_MOST_ROWS][3]                 */
    int *first;             /* [MECH_MOST_ROWS] of a crowd: the first row at hand that moves this one */
} mech_event_state;

/* Places in counters. */
enum {
    MECH_FIRED = 0, MECH_BRANCH, MECH_BRANCH_TIME, MECH_STANDING, MECH_LAST_TIME, MECH_CROWD, MECH_CROWD_TIME, MECH_JOLTS, MECH_JOLT_TIME,
    MECH_AT_HAND, MECH_MOVED, MECH_FASTEST,
    MECH_PACE, MECH_STEEPEST, MECH_UNLISTED,
    MECH_CARRIED, /* all that touches rests, and loads lie in their cones by other shares than those of the modes */
    MECH_FLIES,   /* nothing is laid down                                                       */
    MECH_NEARLY,  /* slips of so many times what counts as none count as none                   */
    MECH_RATTLES, /* instants follow each other without progress                                */
    MECH_JAMS,    /* 1: a step has become too small beside a slip; -1: since then, until the next step */
    MECH_COUNTERS
};

/* What a row of a crowd remembers, in the order of the arrays of rows. */
enum {
    MECH_KEPT_GAP, MECH_KEPT_SPEED, MECH_KEPT_FORCE, MECH_KEPT_MOBILITY, MECH_KEPT_HIT, MECH_KEPT_DELAY, MECH_KEPT_FLAGS,
    MECH_KEPT_SIGNS, MECH_KEPT_FRESH, MECH_KEPT_RATE, MECH_KEPT_MODE, MECH_KEPT
};

/* Lets a size grow to |x|; what is infinite or not a number has no size, and must not spoil those to come. */
static inline void mech_widen(mech_real *size, mech_real x)
{
    if (mech_finite(x)) *size = mech_max(*size, mech_abs(x));
}

/* Numbers that a model needs, and their places in memory that begins at `memory`. */
size_t mech_event_state_numbers(const mech_model *model);
void mech_event_state_attach(mech_event_state *e, const mech_model *model, mech_real *memory);

#endif
