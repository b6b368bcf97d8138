#include "contact_rests.h"

#include "surface_friction.h"

/* Part of what a force along a row does to its own rate that may be left where others undo it: rounding. */
static const mech_real UNDONE = MECH_C(1e-10);

/* Whether the n rows that hold can do all that a force along row i does. */
static int depends(mech_solver *s, int n, const int *held, int i)
{
    mech_real target[MECH_MOST_ROWS], x[MECH_MOST_ROWS];
    const mech_real own = mech_row_response(s, i, i);
    mech_real left = own;
    if (!mech_row_moves_itself(s, i)) return 0;
    for (int k = 0; k < n; k++) target[k] = mech_row_response(s, held[k], i);
    mech_rows_solve(s, n, held, target, x);
    for (int k = 0; k < n; k++) left -= mech_row_response(s, i, held[k]) * x[k];
    return mech_abs(left) <= UNDONE * mech_abs(own);
}

static int rests(const mech_solver *s, int i)
{
    const int place = s->model->hybrid->shares[i].rest;
    return place >= 0 && s->events->z[place] > MECH_C(0.5);
}

static void set(mech_solver *s, int i, int value)
{
    const int place = s->model->hybrid->shares[i].rest;
    if (place >= 0) s->events->z[place] = value;
}

static int first_of(const mech_solver *s, int i) { return i > 0 && mech_row_partner(s, i - 1) == i ? i - 1 : i; }

/* Whether nothing slips along friction i, whose slip may have two components. */
static int is_slow(const mech_solver *s, int i) { return mech_surface_friction_is_slow(s, first_of(s, i)); }

/* Whether friction i slides; on a surface, in whichever direction. */
static int slides(const mech_solver *s, int i)
{
    const int first = first_of(s, i), second = mech_row_partner(s, first);
    const mech_real *z = s->events->z;
    return z[mech_row_of(s, first)->sign] != 0 || (second >= 0 && z[mech_row_of(s, second)->sign] != 0);
}

static int friction_rests(mech_solver *s, int n, const int *held, int i)
{
    if (slides(s, i) || !is_slow(s, i)) return 0;
    return depends(s, n, held, i);
}

static int contact_rests(mech_solver *s, int n, const int *held, int i)
{
    const mech_real slack = MECH_C(1e-7) * s->events->force[i] * mech_row_response(s, i, i);
    if (!mech_row_may_rest(s, i) || mech_abs(mech_row_value(s, i, MECH_SECOND)) > slack) return 0;
    if (!depends(s, n, held, i)) return 0;
    for (int k = 0; k < s->events->n_rows; k++) { /* its friction is held by others, too, or slides */
        const mech_row *row = mech_row_of(s, k);
        if (row->kind != MECH_FRICTION || row->normal != i || mech_row_value(s, k, MECH_COEFFICIENT) == 0) continue;
        if (is_slow(s, k) && !rests(s, k)) return 0;
    }
    return 1;
}

/* The rows that hold; gives how many there are. */
static int find_held(const mech_solver *s, int *held)
{
    int n = 0;
    for (int i = 0; i < s->events->n_rows; i++)
        if (s->events->rows[i].flag >= 0 && s->events->rows[i].kind <= MECH_BILATERAL && mech_row_holds(s, i)) held[n++] = i;
    return n;
}

int mech_contact_rests_any_slide(mech_solver *s)
{
    int held[MECH_MOST_ROWS];
    const int n = find_held(s, held);
    for (int i = 0; n && i < s->events->n_rows; i++) {
        if (mech_row_of(s, i)->kind != MECH_FRICTION || first_of(s, i) != i || !slides(s, i) || !is_slow(s, i)) continue;
        const int j = mech_row_partner(s, i);
        if (depends(s, n, held, i) && (j < 0 || depends(s, n, held, j))) return 1;
    }
    return 0;
}

void mech_contact_rests_mark(mech_solver *s)
{
    int held[MECH_MOST_ROWS];
    mech_event_state *e = s->events;
    if (!s->model->hybrid->shares) return;
    for (int i = 0; i < e->n_rows; i++) set(s, i, 0);
    const int n = find_held(s, held);
    mech_rows_read(s);
    mech_rows_find_response(s);
    for (int i = 0; i < e->n_rows; i++)
        if (e->rows[i].kind == MECH_FRICTION && !mech_row_holds(s, i)) set(s, i, friction_rests(s, n, held, i));
    for (int i = 0; i < e->n_rows; i++)
        if (e->rows[i].kind == MECH_CONTACT && !mech_row_holds(s, i)) set(s, i, contact_rests(s, n, held, i));
    for (int i = 0; i < e->n_rows; i++) {
        const int contact = e->rows[i].kind == MECH_FRICTION ? e->rows[i].normal : -1;
        if (contact >= 0 && rests(s, i) && !rests(s, contact) && !mech_row_holds(s, contact)) set(s, i, 0);
    }
}
