/* Which contacts press, which frictions stick: an active set on the level of accelerations. */
#include "contact_modes.h"

#include <string.h>

#include "contact_projection.h"
#include "energy.h"
#include "near_rows.h"
#include "pressing.h"
#include "surface_friction.h"

enum { ROUNDS_PER_ROW = 8 };

static int is_partner(const mech_solver *s, int i) { return i > 0 && mech_row_partner(s, i - 1) == i; }

static void set(mech_solver *s, int i, int flag, mech_real sign)
{
    const mech_row *row = mech_row_of(s, i);
    s->events->z[row->flag] = flag;
    if (row->sign >= 0) s->events->z[row->sign] = sign;
}

static int side(mech_real x) { return x > 0 ? 1 : -1; }

/* Lets a friction slide along a, or on a surface along (a, b). */
static void slide(mech_solver *s, int i, mech_real a, mech_real b)
{
    const int j = mech_row_partner(s, i);
    const mech_real share = j < 0 ? 0 : mech_surface_friction_none(s, i) / mech_sqrt(a * a + b * b);
    set(s, i, 0, j < 0 ? side(a) : share * a);
    if (j >= 0) set(s, j, 0, share * b);
}

/* Whether row i is independent of the n rows already held, and moved by its own force: not so at a dead centre. */
static int independent(mech_solver *s, mech_near_rows_basis *held, int n, int i)
{
    mech_real target[MECH_MOST_ROWS], x[MECH_MOST_ROWS];
    if (!mech_row_moves_itself(s, i)) return 0;
    if (s->model->hybrid->crowd) return mech_near_rows_add(s, held, i);
    held->row[n] = i;
    memset(target, 0, (size_t)(n + 1) * sizeof(mech_real));
    return mech_rows_solve(s, n + 1, held->row, target, x) == n + 1;
}


/* Sets the flags of all rows that are not excluded: held if at rest and independent of those held before. */
static void propose(mech_solver *s)
{
    const mech_real *open = s->events->open, *slides = s->events->slides;
    mech_near_rows_basis held;
    int n = 0;
    held.n = 0;
    for (int kind = MECH_BILATERAL; kind >= MECH_CONTACT; kind -= 2) /* bilateral, then contacts */
        for (int i = 0; i < s->events->n_rows; i++) {
            if (s->events->rows[i].kind != kind) continue;
            if (kind == MECH_BILATERAL) {
                if (mech_row_holds(s, i) && independent(s, &held, n, i)) n++;
                continue;
            }
            const int rests = mech_row_may_rest(s, i) && !(open[i] > 0);
            const int holds = rests && independent(s, &held, n, i);
            n += holds;
            set(s, i, holds, 0);
        }
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        if (row->kind != MECH_FRICTION || is_partner(s, i)) continue;
        const int j = mech_row_partner(s, i), open_normal = row->normal >= 0 && !mech_row_holds(s, row->normal);
        const mech_real other = j < 0 ? 0 : slides[j];
        if (!open_normal && !mech_surface_friction_is_slow(s, i)) {
            slide(s, i, mech_row_value(s, i, MECH_RATE), j < 0 ? 0 : mech_row_value(s, j, MECH_RATE));
        } else if (!open_normal && (slides[i] != 0 || other != 0)) {
            slide(s, i, slides[i], other);
        } else {
            for (int k = i; k <= (j < 0 ? i : j); k++) {
                const int holds = !open_normal && independent(s, &held, n, k);
                n += holds;
                set(s, k, holds, 0);
            }
        }
    }
}

static int sticks(const mech_solver *s, int i)
{
    const int j = mech_row_partner(s, i);
    return mech_row_holds(s, i) || (j >= 0 && mech_row_holds(s, j));
}

/* A friction gives way: it slides against its force. */
static void let_slide(mech_solver *s, int i)
{
    const int j = mech_row_partner(s, i);
    const mech_real size = mech_row_size(s, i, MECH_FORCE);
    s->events->slides[i] = j < 0 ? -side(mech_row_value(s, i, MECH_FORCE)) : -mech_row_value(s, i, MECH_FORCE) / size;
    if (j >= 0) s->events->slides[j] = -mech_row_value(s, j, MECH_FORCE) / size;
}

/* Whether a friction that is neither held nor slides moves all the same: nothing could hold it, as at a dead centre,
 * where no force moves what slides. Others that are not held rest because those on which they depend do. */
static int moves_off(const mech_solver *s, int i)
{
    const mech_row *row = mech_row_of(s, i);
    const mech_event_state *e = s->events;
    const int j = mech_row_partner(s, i);
    if (row->kind != MECH_FRICTION || is_partner(s, i) || sticks(s, i) || e->z[row->sign] != 0) return 0;
    if (row->normal >= 0 && !mech_row_holds(s, row->normal)) return 0;
    if (j >= 0 && e->z[mech_row_of(s, j)->sign] != 0) return 0;
    mech_real scale = e->rate_scale[e->n - e->n_rows + i];
    for (int k = 0; k < e->n_rows; k++)
        scale += mech_abs(mech_row_value(s, k, MECH_FORCE) * mech_row_response(s, i, k));
    return mech_row_size(s, i, MECH_SECOND) > MECH_C(1e-9) * scale;
}

/* The row that pulls, or that sticks beyond its limit, by the most; -1 where there is none. */
static int most_overdone(const mech_solver *s, int hit)
{
    const mech_event_state *e = s->events;
    int worst = -1;
    mech_real excess = 0;
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        const mech_real force = mech_row_value(s, i, MECH_FORCE), slack = MECH_C(1e-10) * e->force[i];
        mech_real over = 0;
        if (row->kind == MECH_CONTACT && mech_row_holds(s, i))
            over = i == hit ? e->force[i] : -force - slack;
        else if (row->kind == MECH_FRICTION && !is_partner(s, i) && sticks(s, i))
            over = i == hit ? e->force[i] : mech_row_size(s, i, MECH_FORCE) - mech_row_value(s, i, MECH_LIMIT) - slack;
        if (over > excess) {
            excess = over;
            worst = i;
        }
    }
    return worst;
}

/* Lets it go; -1 where there is none. */
static int let_go(mech_solver *s, int hit)
{
    const int worst = most_overdone(s, hit);
    if (worst < 0) return worst;
    if (mech_row_of(s, worst)->kind == MECH_CONTACT)
        s->events->open[worst] = 1;
    else
        let_slide(s, worst);
    return worst;
}

/* Takes back the first row that was let go but comes back, or that slides another way than its friction assumes; -1
 * where there is none. `aims`: slides on surfaces find their way. */
static int take_back(mech_solver *s, int aims)
{
    mech_real *open = s->events->open, *slides = s->events->slides;
    const mech_event_state *e = s->events;
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_real second = mech_row_value(s, i, MECH_SECOND);
        const mech_real slack = MECH_C(1e-7) * e->force[i] * mech_row_response(s, i, i);
        if (open[i] > 0 && second < -slack) {
            open[i] = 0;
            return i;
        }
        const int j = mech_row_partner(s, i);
        if (moves_off(s, i)) {
            const mech_real size = mech_row_size(s, i, MECH_SECOND);
            slides[i] = second / size;
            if (j >= 0) slides[j] = mech_row_value(s, j, MECH_SECOND) / size;
            return i;
        }
        if (j >= 0 && aims && mech_surface_friction_aim(s, i)) return i;
        const mech_real along = slides[i] * second + (j < 0 ? 0 : slides[j] * mech_row_value(s, j, MECH_SECOND));
        if (!is_partner(s, i) && along < -slack) {
            slides[i] = 0;
            if (j >= 0) slides[j] = 0;
            return i;
        }
        const mech_real rate = mech_row_value(s, i, MECH_RATE);
        if (s->events->rows[i].kind == MECH_CONTACT && !mech_row_holds(s, i) && open[i] == 0 && rate > 0 &&
            mech_row_touches(s, i) && mech_row_falls_back(s, i, rate)) {
            open[i] = -1;
            memset(slides, 0, (size_t)e->n_rows * sizeof(mech_real)); /* with it, all may stick */
            return i;
        }
    }
    return -1;
}

/* What fits, but for the contacts of friction that press: 1 where one of them may as well be open, since the others
 * stay as they are and it rises. Coulomb's law has a second solution there, and nothing says which one comes. */
static int fits_open(mech_solver *s, int *contact)
{
    mech_event_state *e = s->events;
    int found = 0;
    for (int i = 0; i < s->events->n_rows && !found; i++) {
        if (s->events->rows[i].kind != MECH_CONTACT || !mech_row_holds(s, i)) continue;
        const mech_real slack = MECH_C(1e-7) * e->force[i] * mech_row_response(s, i, i);
        if (!(mech_row_value(s, i, MECH_FORCE) > MECH_C(1e-7) * e->force[i])) continue;
        int rows[3], n = 0;
        mech_real flag[3], sign[3];
        rows[n++] = i;
        for (int k = 0; k < s->events->n_rows && n < 3; k++)
            if (s->events->rows[k].kind == MECH_FRICTION && s->events->rows[k].normal == i) rows[n++] = k;
        if (n == 1) continue;
        for (int k = 0; k < n; k++) {
            const mech_row *row = &s->events->rows[rows[k]];
            flag[k] = e->z[row->flag];
            sign[k] = row->sign < 0 ? 0 : e->z[row->sign];
            set(s, rows[k], 0, 0);
        }
        mech_rows_read(s);
        found = mech_row_value(s, i, MECH_SECOND) > slack && most_overdone(s, -1) < 0;
        for (int k = 0; k < n; k++) set(s, rows[k], flag[k] > MECH_C(0.5), sign[k]);
        mech_rows_read(s);
        *contact = i;
    }
    return found;
}

/* Mends the row that fits least, and gives it; -1 where all fit. `hit` was located where its mode ends. */
static int mend_misfit(mech_solver *s, int hit, int aims)
{
    const int worst = let_go(s, hit);
    return worst >= 0 ? worst : take_back(s, aims);
}

/* What is chosen fits: the state moves onto it. */
static int take_choice(mech_solver *s)
{
    if (s->events->counters[MECH_UNLISTED] > 0) return mech_fail(s, MECH_NO_MODE, -1);
    for (int i = 0; i < s->events->n_rows; i++)
        if (!mech_finite(mech_row_value(s, i, MECH_FORCE))) {
            s->run->report.failed_value = mech_row_value(s, i, MECH_FORCE);
            return mech_fail(s, MECH_NO_MODE, i);
        }
    int contact;
    if (fits_open(s, &contact)) return mech_fail(s, MECH_NO_MODE, contact);
    /* Thousands of gaps that are closed by what counts as touching lower a heap. */
    const int booked = s->model->hybrid->crowd && mech_energy_booked(s);
    const mech_real before = booked ? mech_energy_total(s) : 0;
    mech_contact_projection_state(s);
    if (booked) mech_energy_book_beyond_rounding(s, before);
    for (int i = 0; s->model->hybrid->crowd && i < s->events->n_rows; i++) { /* what is left is kept by others */
        const mech_real approach = -mech_row_value(s, i, MECH_RATE);
        if (mech_row_touches(s, i) && approach > 0 && approach <= mech_row_rest(s, i) / 100) s->events->open[i] = -1;
    }
    mech_surface_friction_begin(s);
    return mech_rows_check(s, 1);
}

/* Forces of a crowd have the sizes of those that end what accelerates without them. */
static void weigh_forces(mech_solver *s)
{
    mech_event_state *e = s->events;
    mech_real flags[MECH_MOST_ROWS];
    for (int i = 0; i < e->n_rows; i++) {
        flags[i] = e->z[e->rows[i].flag];
        e->z[e->rows[i].flag] = 0;
    }
    mech_rows_read(s);
    mech_rows_weigh(s);
    for (int i = 0; i < e->n_rows; i++) e->z[e->rows[i].flag] = flags[i];
}

int mech_contact_modes_choose(mech_solver *s, int hit)
{
    int any = 0, friction = 0;
    for (int i = 0; i < s->events->n_rows; i++) {
        any |= s->events->rows[i].kind != MECH_STEP_ROW;
        friction |= s->events->rows[i].kind == MECH_FRICTION;
    }
    if (!any) return MECH_RUNNING;
    mech_rows_read(s);
    mech_rows_find_response(s);
    /* A stick that ends, ends: a reversal begins with the attempt to stick. */
    const int ends = hit >= 0 && s->events->rows[hit].kind != MECH_STEP_ROW && sticks(s, hit) ? hit : -1;
    if (s->model->hybrid->crowd && !friction) return mech_pressing_choose(s, ends) < 0 ? mech_fail(s, MECH_NO_MODE, hit < 0 ? 0 : hit) : take_choice(s);
    if (s->model->hybrid->crowd) weigh_forces(s);
    propose(s);
    mech_surface_friction_end(s);
    for (int round = 0; round <= ROUNDS_PER_ROW * s->events->n_rows; round++) {
        mech_rows_read(s);
        if (mend_misfit(s, round == 0 ? ends : -1, round < ROUNDS_PER_ROW / 2 * s->events->n_rows) < 0)
            return take_choice(s);
        propose(s);
    }
    return mech_fail(s, MECH_NO_MODE, hit < 0 ? 0 : hit);
}
