#include "schedule.h"

#include "event_state.h"

/* What rounding leaves between multiples of periods, and times, that are the same: count times period, with a start,
 * of periods that are themselves rounded. */
static mech_real rounding(mech_real t) { return 8 * MECH_EPSILON * mech_abs(t); }

int mech_schedule_due(mech_real next, mech_real t) { return t >= next - rounding(t); }

int mech_schedule_set(mech_solver *s, int ticks)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_event_state *e = s->events;
    const mech_real t = s->run->report.t;
    int changed = 0;
    if (!(h->n_times + h->n_clocks)) return 0;
    h->crossing_times(t, s->y, s->u, e->z, s->o.p, e->times);
    for (int k = 0; k < h->n_times; k++) {
        const mech_real after = (mech_real)h->times[2 * k + 1], value = mech_schedule_due(e->times[k], t) ? after : 1 - after;
        if (e->z[h->times[2 * k]] != value) {
            e->z[h->times[2 * k]] = value;
            changed = 1;
        }
    }
    for (int k = 0; ticks && k < h->n_clocks; k++)
        if (mech_abs(e->times[h->n_times + k] - t) <= rounding(t)) {
            e->z[h->clocks[2 * k]] = 1;
            changed = 1;
        }
    return changed;
}

int mech_schedule_end_ticks(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_real *z = s->events->z;
    int ended = h->initial >= 0 && z[h->initial] > 0;
    for (int k = 0; k < h->n_clocks; k++)
        if (z[h->clocks[2 * k]] > 0) {
            z[h->clocks[2 * k]] = 0;
            z[h->clocks[2 * k + 1]] += 1;
            ended = 1;
        }
    if (h->initial >= 0) z[h->initial] = 0;
    return ended;
}

mech_real mech_schedule_next(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    const int n = h->n_times + h->n_clocks;
    const mech_real t = s->run->report.t;
    mech_real next = (mech_real)INFINITY;
    if (!n) return next;
    h->crossing_times(t, s->y, s->u, s->o.z, s->o.p, s->events->times);
    for (int k = 0; k < n; k++) {
        const int over = k < h->n_times && s->events->z[h->times[2 * k]] == (mech_real)h->times[2 * k + 1];
        if (!over && s->events->times[k] > t && s->events->times[k] < next) next = s->events->times[k];
    }
    return next;
}

int mech_schedule_begin_before(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    const mech_real t = s->run->report.t;
    int any = 0;
    if (!h->n_times) return any;
    h->crossing_times(t, s->y, s->u, s->events->z, s->o.p, s->events->times);
    for (int k = 0; k < h->n_times; k++)
        if (h->times[2 * k + 1] && s->events->times[k] == t) {
            s->events->z[h->times[2 * k]] = 0;
            any = 1;
        }
    return any;
}

int mech_schedule_check(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_event_state *e = s->events;
    for (int k = 0; k < h->n_clocks; k++) {
        mech_real *count = e->z + h->clocks[2 * k + 1], *tick = e->times + h->n_times + k;
        h->crossing_times(s->run->report.t, s->y, s->u, e->z, s->o.p, e->times);
        const mech_real first = *tick;
        *count += 1;
        h->crossing_times(s->run->report.t, s->y, s->u, e->z, s->o.p, e->times);
        *count -= 1;
        if (*tick > first) continue;
        s->run->report.failed_value = *tick - first;
        return mech_fail(s, MECH_NO_PERIOD, k);
    }
    return MECH_RUNNING;
}

void mech_schedule_pass(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_event_state *e = s->events;
    for (int k = 0; k < h->n_clocks; k++)
        for (long ticks = 0; ticks < 1000000000; ticks++) {
            h->crossing_times(s->run->report.t, s->y, s->u, e->z, s->o.p, e->times);
            if (!(e->times[h->n_times + k] < s->run->report.t - rounding(s->run->report.t))) break;
            e->z[h->clocks[2 * k + 1]] += 1;
        }
}
