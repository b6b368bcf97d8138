/* Impacts: blows one after the other, the fastest approach first, or all at once, until nothing approaches. */
#include "impacts.h"

#include <string.h>

#include "contact_cones.h"
#include "impulses.h"
#include "journal.h"
#include "rows.h"

enum { ROUNDS_PER_ROW = 50, TURNS_PER_ROW = 4, MOST_STRIKES = 8 };

/* Notes an impact; a freewheel that takes hold as it comes to rest has none. */
static void note(mech_solver *s, int i)
{
    const mech_real approach = -*mech_row_rate(s, i);
    if (mech_row_of(s, i)->sign == MECH_FREEWHEEL && approach <= MECH_C(1e-6) * s->events->speed[i]) return;
    mech_journal_note(s, MECH_IMPACT, i, approach);
}

/* Whether contact i approaches as impacts do: what has been laid down at this instant only does so by what the others that hold it
 * leave it. */
static int approaches(const mech_solver *s, int i)
{
    const mech_real approach = -*mech_row_rate(s, i);
    if (!mech_row_touches(s, i) || !(approach > mech_row_idle(s, i))) return 0;
    return !(s->events->open[i] < 0 && s->model->hybrid->crowd && approach <= mech_row_rest(s, i));
}

/* Whether all that still approaches is slower than it rests. */
static int all_rest(const mech_solver *s)
{
    for (int i = 0; i < s->events->n_rows; i++)
        if (approaches(s, i) && -*mech_row_rate(s, i) > mech_row_rest(s, i)) return 0;
    return 1;
}

/* Whether what still approaches in a crowd is ended together: where none of it is faster than it rests, if none has friction;
 * where none rebounds and each row has had its turns, as blows that are passed on plastically only ever halve. */
static int dies_out(const mech_solver *s, int round, int friction)
{
    const int turns = round >= TURNS_PER_ROW * s->events->n_rows;
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_real approach = -*mech_row_rate(s, i);
        if (!approaches(s, i)) continue;
        const int slow = !friction && approach <= mech_row_rest(s, i);
        if (!slow && !(turns && mech_row_value(s, i, MECH_COEFFICIENT) == 0)) return 0;
    }
    return 1;
}

static int apply_checked(mech_solver *s, int contact)
{
    mech_real size;
    const mech_real lost = mech_rows_impulse_loss(s, &size);
    if (!mech_finite(lost)) return mech_fail(s, MECH_NO_IMPACT, contact);
    if (lost < -MECH_C(1e-9) * size) return mech_fail(s, MECH_ENERGY_RAISED, contact);
    mech_rows_apply_impulses(s);
    return MECH_RUNNING;
}

static int fastest_approach(const mech_solver *s)
{
    int found = -1;
    mech_real fastest = 0;
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_real approach = -*mech_row_rate(s, i);
        if (approaches(s, i) && (found < 0 || approach > fastest)) {
            found = i;
            fastest = approach;
        }
    }
    return found;
}

/* All that touches at once. */
static int strike(mech_solver *s, int contact)
{
    mech_event_state *e = s->events;
    mech_real restitution[MECH_MOST_ROWS];
    for (int i = 0; i < e->n_rows; i++) restitution[i] = approaches(s, i) ? mech_impulse_restitution(s, i) : 0;
    return mech_contact_cones_strike(s, restitution, 0, NULL) ? MECH_RUNNING : mech_fail(s, MECH_NO_IMPACT, contact);
}

/* The same where blows one after the other have no solution, or would raise the energy. */
static int strike_after_all(mech_solver *s, int contact)
{
    s->run->report.status = MECH_RUNNING;
    s->run->report.failed_index = -1;
    const int status = strike(s, contact);
    return status ? status : apply_checked(s, contact);
}

/* Constraints that were engaged take their rates away at once. */
static int engage(mech_solver *s)
{
    mech_event_state *e = s->events;
    int set[MECH_MOST_ROWS], n = 0, moves = -1;
    mech_real target[MECH_MOST_ROWS], x[MECH_MOST_ROWS];
    for (int i = 0; i < e->n_rows; i++) {
        if (!mech_impulse_holds(s, i)) continue;
        if (!(mech_abs(mech_row_value(s, i, MECH_GAP)) <= MECH_C(1e-6) * mech_max(e->gap_scale[i], 0))) {
            s->run->report.failed_value = mech_row_value(s, i, MECH_GAP);
            return mech_fail(s, MECH_APART, i);
        }
        if (mech_abs(*mech_row_rate(s, i)) > mech_row_still(s, i)) moves = i;
        set[n] = i;
        target[n++] = -*mech_row_rate(s, i);
    }
    if (moves < 0) return MECH_RUNNING;
    mech_rows_find_response(s);
    mech_rows_solve(s, n, set, target, x);
    mech_impulse_set(s, n, set, x);
    return apply_checked(s, moves);
}

/* A contact that is engaged at this instant must not be beyond its surface. */
static int check_engaged_contacts(mech_solver *s)
{
    const mech_event_state *e = s->events;
    for (int i = 0; i < e->n_rows; i++) {
        const int enabled = mech_row_of(s, i)->enabled;
        if (enabled < 0 || !mech_row_is_enabled(s, i) || e->z_before[enabled] > MECH_C(0.5)) continue;
        if (mech_row_value(s, i, MECH_GAP) >= -MECH_C(1e-6) * e->gap_scale[i]) continue;
        s->run->report.failed_value = mech_row_value(s, i, MECH_GAP);
        return mech_fail(s, MECH_PENETRATION, i);
    }
    return MECH_RUNNING;
}

int mech_impacts_resolve(mech_solver *s, int *count)
{
    mech_event_state *e = s->events;
    mech_rows_read(s);
    const int crowd = s->model->hybrid->crowd != NULL;
    int status = check_engaged_contacts(s), ready = 0, friction = 0, struck = 0;
    if (!status) status = engage(s);
    for (int i = 0; i < e->n_rows; i++) friction |= mech_row_of(s, i)->kind == MECH_FRICTION;
    for (int round = 0; !status; round++) {
        const int contact = fastest_approach(s);
        if (contact < 0) break;
        if (!ready) mech_rows_find_response(s);
        ready = 1;
        const int fades = crowd && dies_out(s, round, friction);
        /* Impacts that contacts pass on to each other are ended together, so that none of their slips is left over; what that leaves is
         * rounding of fast slips, and ends by blows. */
        const int last = !crowd && friction && round && all_rest(s);
        const int many = s->model->hybrid->simultaneous || round >= ROUNDS_PER_ROW * e->n_rows;
        const int together = fades || (last ? struck < MOST_STRIKES : many);
        if (round > 2 * ROUNDS_PER_ROW * e->n_rows) return mech_fail(s, MECH_NO_IMPACT, contact);
        if (together)
            for (int i = 0; i < e->n_rows; i++) {
                if (i != contact && approaches(s, i)) note(s, i);
            }
        note(s, contact);
        struck += together;
        status = !together           ? mech_impulse_fastest(s, contact)
                 : crowd && !friction ? mech_impulse_of_crowd(s)
                 : fades              ? mech_impulse_with_friction(s, contact)
                                      : strike(s, contact);
        if (status == MECH_NO_IMPACT && last && together) { /* what is slower than rest may end by blows, too */
            s->run->report.status = MECH_RUNNING;
            s->run->report.failed_index = -1;
            struck = MOST_STRIKES;
            status = mech_impulse_fastest(s, contact);
        }
        if (!status) status = apply_checked(s, contact);
        if (friction && (status == MECH_NO_IMPACT || status == MECH_ENERGY_RAISED)) status = strike_after_all(s, contact);
        (*count)++;
    }
    return status;
}

/* The jump of the energy in row i. At the surface itself, within rounding, one of the branches may be undefined: then
   the jump is that a little before or behind, along the velocities, by roundings at first. */
static mech_real jump_in(mech_solver *s, int i)
{
    const mech_model *m = s->model;
    const mech_real t = s->run->report.t;
    mech_real *y = s->events->y_at, jump = mech_row_value(s, i, MECH_FORCE);
    mech_real h = 10 * MECH_EPSILON * mech_abs(t) + MECH_C(1e-24) * s->o.dt_max;
    for (int k = 0; !mech_finite(jump) && h < MECH_C(1e-9) * s->o.dt_max; k++) {
        memcpy(y, s->y, (size_t)s->ny * sizeof(mech_real));
        for (int j = 0; j < m->nq; j++)
            if (mech_finite(s->dy[j])) y[j] += (k % 2 ? h : -h) * s->dy[j];
        mech_normalise(m, y);
        m->hybrid->row_values(t, y, s->u, s->events->z, s->o.p, s->events->row);
        jump = mech_row_value(s, i, MECH_FORCE);
        if (k % 2) h *= 4;
        mech_rows_read(s);
    }
    return jump;
}

int mech_impacts_pass_step(mech_solver *s, int hit, int *passed)
{
    mech_event_state *e = s->events;
    for (int i = 0; i < e->n_rows; i++) {
        if (mech_row_of(s, i)->kind != MECH_STEP_ROW || mech_row_of(s, i)->normal != hit) continue;
        mech_rows_read(s);
        mech_rows_find_response(s);
        const mech_real jump = jump_in(s, i), r = *mech_row_rate(s, i), w = mech_row_response(s, i, i);
        if (jump != jump) { /* an infinite one is a wall */
            s->run->report.failed_value = jump;
            return mech_fail(s, MECH_UNDEFINED_JUMP, hit);
        }
        /* Beside a surface across which the energy only bends, rounding of its place gives a jump. */
        if (!(w > 0) || mech_abs(2 * w * jump) <= MECH_C(1e-13) * r * r) return MECH_RUNNING;
        const mech_real square = r * r - 2 * w * jump;
        *passed = square > 0;
        memset(e->impulse, 0, (size_t)e->n_rows * sizeof(mech_real));
        e->impulse[i] = ((*passed ? (r > 0 ? 1 : -1) * mech_sqrt(square) : -r) - r) / w;
        mech_rows_apply_impulses(s);
        mech_journal_note(s, *passed ? MECH_CROSSED : MECH_REFLECTED, i, mech_abs(r));
    }
    return MECH_RUNNING;
}
