/* What models with events add to an instance: event mode, event indicators, and the start of a run.
 *
 * In Model Exchange the importer integrates, and the solver serves for what happens at one instant: it gets the state,
 * lets happen what is due, and gives the state back. The indicators w >= 0 of the solver are handed out with a small
 * amount added, so that a zero lies clearly behind the event, and the event clearly before the next zero. Where an
 * importer integrates so roughly that a gap that only just opens seems to close again, the amount grows.
 */
#include <string.h>

#include "begin.h"
#include "indicators.h"
#include "instance.h"
#include "instant.h"
#include "contact_modes.h"
#include "overshoot.h"
#include "rows.h"
#include "schedule.h"

/* Conditions that change at one instant, one after the other. */
enum { MOST_AT_ONCE = 16 };

/* Added to an indicator that was zero at all times so far: importers see a change of sign, none from zero itself. */
#define LEAST MECH_C(1e-60)

/* The share of its size that is added to an indicator. Forces are differences of larger ones. */
static mech_real margin(const fmu *f, int k)
{
    const mech_event_state *e = f->s->events;
    const mech_real *size = mech_indicator_size(f->s, k);
    const int of_force = size >= e->force && size < e->force + e->n_rows;
    return mech_max((of_force ? MECH_C(1e-9) : MECH_C(1e-10)) * f->noise[k] * *size, LEAST);
}

/* The solver gets the state of the importer. */
static void hand_over(fmu *f, mech_real t)
{
    mech_run *run = f->s->run;
    fmu_list_tables(f);
    memcpy(f->s->y, f->y, (size_t)f->ny * sizeof(mech_real));
    run->report.t = run->origin = t;
    run->report.status = MECH_RUNNING;
    run->report.failed_index = -1;
}

/* Modes and sizes as if nothing had happened yet. */
static void forget(fmu *f)
{
    const mech_model *m = f->m;
    memset(f->s->events->z, 0, mech_event_state_numbers(m) * sizeof(mech_real));
    if (m->discretes) m->discretes(f->st->t, f->y, f->u, f->scratch, f->p, f->z);
    f->s->run->begun = f->s->run->pending = 0;
}

static int look(fmu *f)
{
    forget(f);
    hand_over(f, f->st->t);
    int struck, outcome = mech_begin_look(f->s);
    if (!outcome) outcome = mech_contact_modes_choose(f->s, -1, &struck);
    return outcome < 0 ? fmu_failed(f, outcome) : FMU_OK;
}

static int start(fmu *f)
{
    forget(f);
    hand_over(f, f->st->t);
    const int outcome = f->is_co_simulation ? mech_begin_run(f->s) : mech_begin_events(f->s);
    if (outcome >= 0) memcpy(f->y, f->s->y, (size_t)f->ny * sizeof(mech_real));
    fmu_touch(f);
    return outcome;
}

static void note_end(fmu *f, int outcome)
{
    if (outcome != MECH_TERMINATED) return;
    f->st->ended = 1;
    fmu_tell(f, FMU_LOG_EVENTS, f->d->ends[f->s->run->report.failed_index]);
}

static int begin(fmu *f)
{
    const int outcome = start(f);
    if (outcome < 0) return fmu_failed(f, outcome);
    note_end(f, outcome);
    return FMU_OK;
}

/* Sizes grow with what is seen; the indicator that is furthest behind its zero, or -1. */
static int furthest(fmu *f)
{
    mech_event_state *e = f->s->events;
    int found = -1;
    mech_real worst = 0;
    if (e->n) mech_indicators_read(f->s, f->s->run->report.t, f->s->y, e->w, NULL);
    for (int k = 0; k < e->n; k++) {
        mech_real *size = mech_indicator_size(f->s, k);
        mech_widen(size, e->w[k]);
        if (!(e->w[k] < -margin(f, k) / 2)) continue;
        if (found < 0 || e->w[k] / *size < worst) {
            found = k;
            worst = e->w[k] / *size;
        }
    }
    return found;
}

/* After what happened: a gap that was passed, and nothing came of it, was passed by errors of the integration. */
static void judge(fmu *f, int passed)
{
    const mech_hybrid *h = f->m->hybrid;
    const mech_event_state *e = f->s->events;
    const int row = passed - h->n_switches;
    if (row < 0 || h->rows[row].kind != MECH_CONTACT) return;
    const int hit = e->last_hit[row] == f->s->run->report.t;
    const int same = !memcmp(e->z_before, e->z, (size_t)f->m->nz * sizeof(mech_real));
    f->noise[passed] = same && !hit ? mech_min(10 * f->noise[passed], MECH_C(1e7)) : 1;
}

/* A switch that the motion had passed, w before it went back, and to whose zero it has gone: where a motion reverses, the
   friction and a condition on its direction change at one instant, and the force that the condition brings tells
   whether the friction holds. -1: none. */
static int reached_back(const fmu *f)
{
    const mech_event_state *e = f->s->events;
    for (int k = 0; k < f->m->hybrid->n_switches; k++)
        if (f->w[k] < -margin(f, k) / 2 && mech_indicator_at_zero(f->s, k, e->w[k])) return k;
    return -1;
}

/* Whether the indicator is that of a friction that slides the other way by now: of a slip within rounding, which ended on the way on.
   It goes back to where it ended. */
static int reversed(fmu *f, int hit)
{
    const mech_row *row = &f->m->hybrid->rows[hit - f->m->hybrid->n_switches];
    if (row->kind != MECH_FRICTION || f->z[row->flag] > MECH_C(0.5)) return 0;
    const mech_real present = f->s->run->report.t;
    mech_overshoot_go_back(f->s);
    f->s->run->report.t = present;
    return 1;
}

/* The importer has integrated up to the present time, or a little further than to what was announced. */
static int exchange(fmu *f)
{
    const fmu_state *st = f->st;
    const mech_real close = MECH_C(1e-11) * mech_max(mech_abs(st->t), mech_abs(st->stop - st->start));
    if (fmu_project(f)) return MECH_OFF_CONSTRAINTS;
    hand_over(f, st->next <= st->t + close ? st->next : st->t);
    const int passed = furthest(f);
    memcpy(f->w, f->s->events->w, (size_t)f->s->events->n * sizeof(mech_real));
    const mech_real late = mech_overshoot_go_back(f->s);
    int hit = furthest(f);
    if (hit < 0) hit = reached_back(f);
    int outcome = mech_instant_happen(f->s, hit, 1);
    judge(f, passed);
    if (outcome == MECH_RUNNING) mech_overshoot_go_on(f->s, late);
    /* what is passed still would give the importer no sign: it is below zero before and after */
    for (int n = 0; outcome >= 0; n++) {
        hit = furthest(f);
        if (outcome != MECH_RUNNING || hit < 0 || n == MOST_AT_ONCE) break;
        if (hit >= f->m->hybrid->n_switches && !reversed(f, hit)) break;
        outcome = mech_instant_happen(f->s, hit, 0);
    }
    return outcome;
}

/* The solver stands at an event, or goes on from a state, inputs or parameters that were changed. */
static int co_simulate(fmu *f)
{
    mech_solver *s = f->s;
    if (f->st->off && fmu_project(f)) return MECH_OFF_CONSTRAINTS;
    if (s->run->pending) {
        s->run->pending = 0;
        if (f->st->off) mech_write(s, f->y);
        return mech_instant(s, s->run->pending_hit);
    }
    if (!f->st->solver_stale) return MECH_RUNNING;
    fmu_list_tables(f);
    mech_write(s, f->y);
    return mech_begin_run(s);
}

static int update(fmu *f, fmu_news *news)
{
    fmu_state *st = f->st;
    mech_solver *s = f->s;
    fmu_save(f, &f->saved);
    const int outcome = !s->run->begun ? start(f) : f->is_co_simulation ? co_simulate(f) : exchange(f);
    if (outcome < 0) {
        const int status = fmu_failed(f, outcome);
        fmu_load(f, f->saved);
        return status;
    }
    memcpy(f->y, s->y, (size_t)f->ny * sizeof(mech_real));
    if (f->is_co_simulation) st->t = s->run->report.t;
    st->solver_stale = 0;
    note_end(f, outcome);
    news->ends = st->ended;
    news->next = st->next = mech_schedule_next(s);
    news->again = st->next <= st->t;
    return FMU_OK;
}

static int indicators(fmu *f)
{
    const mech_hybrid *h = f->m->hybrid;
    const int n = f->s->events->n;
    h->indicators(f->st->t, f->y, f->u, f->z, f->p, f->w);
    for (int k = 0; k < n; k++) {
        if (k < h->n_switches && f->z[h->switches[k]] > MECH_C(0.5)) f->w[k] = -f->w[k];
        f->w[k] += margin(f, k);
    }
    return fmu_finite(f->w, n) ? FMU_OK : fmu_undefined(f, "an event indicator is not finite");
}

static int drifts(fmu *f)
{
    const mech_hybrid *h = f->m->hybrid;
    const mech_event_state *e = f->s->events;
    int far = 0;
    hand_over(f, f->st->t);
    furthest(f);
    if (h->n_rows) mech_rows_read(f->s);
    for (int i = 0; i < h->n_rows; i++) {
        const mech_row *row = &h->rows[i];
        if (row->flag < 0 || !(f->z[row->flag] > MECH_C(0.5))) continue;
        const mech_real *value = e->row + i * MECH_ROW_VALUES;
        far |= mech_abs(value[MECH_GAP]) > f->st->tolerance * e->gap_scale[i];
        far |= mech_abs(value[MECH_RATE]) > f->st->tolerance * e->speed[i];
    }
    return far;
}

static int fail(fmu *f, int outcome)
{
    const mech_report *r = &f->s->run->report;
    const int k = r->failed_index;
    const mech_real t = r->t;
    const char *branch = k >= 0 && k < f->m->hybrid->n_branches ? f->d->branches[k] : "";
    const char *row = k >= 0 && k < f->m->hybrid->n_rows ? f->d->rows[k] : "";
    switch (outcome) {
    case MECH_BRANCH_ASSERTION:
        return fmu_fail(f, FMU_ERROR, "at time %g: %s", t, f->d->checks[k][r->failed_part]);
    case MECH_EVENT_LOOP: return fmu_fail(f, FMU_ERROR, "the events at time %g do not come to rest", t);
    case MECH_ZENO:
        return fmu_fail(f, FMU_ERROR, "'when %s' fires in ever shorter intervals, until time %g", branch, t);
    case MECH_PENETRATION: return fmu_fail(f, FMU_ERROR, "contact '%s' is penetrated at time %g", row, t);
    case MECH_ENERGY_RAISED:
        return fmu_fail(f, FMU_ERROR, "the impact of '%s' at time %g would raise the energy", row, t);
    case MECH_CHATTER:
        if (r->failed_part == 3)
            return fmu_fail(f, FMU_ERROR, "the motion goes from side to side where a constraint bends, until time %g", t);
        if (r->failed_part == 4)
            return fmu_fail(f, FMU_ERROR, "the motion comes to rest at time %g where a force jumps, and goes to and fro there ever faster", t);
        return fmu_fail(f, FMU_ERROR, "a condition in the equations of motion goes to and fro at time %g", t);
    case MECH_APART:
        return fmu_fail(f, FMU_ERROR, "'%s' is engaged at time %g, but does not hold there", row, t);
    case MECH_NO_MODE:
        if (r->failed_part == 1)
            return fmu_fail(f, FMU_ERROR, "contacts and frictions change their modes again and again without getting on at time %g%s%s", t,
                            *row ? ", among them " : "", row);
        return fmu_fail(f, FMU_ERROR, "no combination of touching, sticking and sliding fits at time %g", t);
    case MECH_OUT_OF_RANGE:
        return fmu_fail(f, FMU_ERROR, "a coefficient or limit of '%s' is %g at time %g", row, r->failed_value, t);
    case MECH_UNDEFINED_JUMP:
        return fmu_fail(f, FMU_ERROR, "an energy is undefined at time %g where a condition changes", t);
    case MECH_NO_PERIOD:
        return fmu_fail(f, FMU_ERROR, "a 'sample' has the period %g: a period is positive", r->failed_value);
    case MECH_NO_DELAY: return fmu_fail(f, FMU_ERROR, "a delay is %g s: a delay is positive", r->failed_value);
    case MECH_NO_MEMORY: return fmu_fail(f, FMU_ERROR, "there is no memory at time %g for what delays look back at", t);
    case MECH_NO_IMPACT: return fmu_fail(f, FMU_ERROR, "the impacts at time %g have no solution", t);
    default: return fmu_fail(f, FMU_ERROR, "the method does not fit the model");
    }
}

const fmu_event_functions fmu_events_of_models = {look, begin, update, indicators, drifts, fail};
