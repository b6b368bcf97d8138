/* One blow: impulses along the rows that keep all constraints, by the response of the velocities to unit impulses.
 *
 * Newton's restitution, Coulomb's cone for the impulses, friction against the slip that is left. Sticking and sliding on are tried
 * first; where friction turns the slip, it is a problem of cones (contact_cones.h).
 */
#include "impulses.h"

#include <string.h>

#include "contact_cones.h"
#include "journal.h"
#include "near_rows.h"
#include "rows.h"

enum { ROUNDS_PER_HIT = 8, STATES = 3, MOST_COMBINED = 5 };

int mech_impulse_holds(const mech_solver *s, int i)
{
    return mech_row_of(s, i)->kind == MECH_BILATERAL && s->events->z[mech_row_of(s, i)->flag] > MECH_C(0.5);
}

mech_real mech_impulse_restitution(mech_solver *s, int i)
{
    const mech_real e = mech_row_value(s, i, MECH_COEFFICIENT), r = -*mech_row_rate(s, i);
    const mech_real t = s->run->report.t, flight = t - s->events->last_hit[i];
    const int rests = e * r <= mech_row_rest(s, i) || mech_row_falls_back(s, i, e * r);
    /* The flights that are left out would last as long as this geometric series. */
    s->events->delay[i] = rests && e > 0 && e < 1 && s->events->last_hit[i] > s->o.t0 ? flight * e / (1 - e) : 0;
    s->events->last_hit[i] = t;
    return rests ? 0 : e;
}

void mech_impulse_set(mech_solver *s, int n, const int *set, const mech_real *x)
{
    memset(s->events->impulse, 0, (size_t)s->events->n_rows * sizeof(mech_real));
    for (int k = 0; k < n; k++) s->events->impulse[set[k]] = x[k];
}

/* A contact that hits, with the rows of its friction from `slips` on; it aims at the rate after the impact. */
typedef struct hit {
    int contact, slips, count;
    enum { HIT_STICKS, HIT_SLIDES, HIT_SPARED } state;
    mech_real aim;     /* change of its rate                                              */
    mech_real push[2]; /* direction of the impulse of friction, where it slides           */
    int slides;        /* whatever happens: it does not stick                             */
} hit;

static hit begin_hit(mech_solver *s, int contact)
{
    hit h = {contact, -1, 0, HIT_STICKS, -(1 + mech_impulse_restitution(s, contact)) * *mech_row_rate(s, contact), {0, 0}, 0};
    for (int i = s->events->n_rows - 1; i >= 0; i--)
        if (mech_row_of(s, i)->kind == MECH_FRICTION && mech_row_of(s, i)->normal == contact &&
            mech_row_value(s, i, MECH_COEFFICIENT) > 0)
            h.slips = i;
    if (h.slips >= 0) h.count = mech_row_partner(s, h.slips) < 0 ? 1 : 2;
    return h;
}

/* Contacts that slide: the impulses of contact and friction lie on the cone and act as one, or (`sign` -1) no longer. */
static void join(mech_solver *s, int n, const hit *hits, int sign)
{
    const int width = s->model->nv + s->events->n_rows;
    for (int k = 0; k < n; k++) {
        if (hits[k].state != HIT_SLIDES) continue;
        mech_real *b = s->events->response + hits[k].contact * width;
        for (int c = 0; c < hits[k].count; c++) {
            const mech_real share = sign * mech_row_value(s, hits[k].slips, MECH_EXTRA) * hits[k].push[c];
            for (int i = 0; i < width; i++) b[i] += share * s->events->response[(hits[k].slips + c) * width + i];
        }
    }
}

/* The impulses of hits, of their frictions, and of constraints that are engaged; gives whether they reach their aims. */
static int solve_hits(mech_solver *s, int n, const hit *hits)
{
    mech_event_state *e = s->events;
    int set[MECH_MOST_ROWS], m = 0, sure = 1;
    mech_real target[MECH_MOST_ROWS], x[MECH_MOST_ROWS];
    for (int i = 0; i < e->n_rows; i++)
        if (mech_impulse_holds(s, i)) {
            set[m] = i;
            target[m++] = -*mech_row_rate(s, i);
        }
    for (int k = 0; k < n; k++) {
        if (hits[k].state == HIT_SPARED) continue;
        sure &= hits[k].state == HIT_STICKS;
        set[m] = hits[k].contact;
        target[m++] = hits[k].aim;
        for (int c = 0; hits[k].state == HIT_STICKS && c < hits[k].count; c++) {
            set[m] = hits[k].slips + c;
            target[m++] = -*mech_row_rate(s, hits[k].slips + c);
        }
    }
    join(s, n, hits, 1);
    const int rank = mech_rows_share(s, m, set, target, x);
    int reached = rank == m || (n == 1 && sure);
    if (!reached && n > 1) { /* rows that depend on others may have what they want all the same */
        reached = 1;
        for (int k = 0; k < m; k++) {
            mech_real change = 0, size = mech_abs(target[k]);
            for (int j = 0; j < m; j++) {
                const mech_real part = mech_row_response(s, set[k], set[j]) * x[j];
                change += part;
                size += mech_abs(part);
            }
            reached &= mech_abs(change - target[k]) <= MECH_C(1e-9) * size;
        }
    }
    join(s, n, hits, -1);
    mech_impulse_set(s, m, set, x);
    for (int k = 0; k < n; k++)
        for (int c = 0; hits[k].state == HIT_SLIDES && c < hits[k].count; c++)
            e->impulse[hits[k].slips + c] =
                mech_row_value(s, hits[k].slips, MECH_EXTRA) * hits[k].push[c] * e->impulse[hits[k].contact];
    return reached;
}

/* In which way a hit does not fit: it is spared and approaches, it pulls, it sticks beyond its cone. */
enum { COMES_BACK, PULLS, BEYOND_CONE, MISFITS };

/* By how much a hit does not fit in one way; not positive where it fits. */
static mech_real misfit(mech_solver *s, const hit *h, int way)
{
    const mech_event_state *e = s->events;
    const mech_real normal = e->impulse[h->contact];
    if (h->state == HIT_SPARED) {
        mech_real change = 0, size = mech_abs(h->aim);
        for (int j = 0; j < e->n_rows; j++) {
            const mech_real part = mech_row_response(s, h->contact, j) * e->impulse[j];
            change += part;
            size += mech_abs(part);
        }
        return way == COMES_BACK ? h->aim - change - MECH_C(1e-12) * size : 0;
    }
    if (way != BEYOND_CONE) return way == PULLS ? -normal : 0;
    if (h->state == HIT_SLIDES || !h->count) return 0;
    const mech_real a = e->impulse[h->slips], b = h->count == 1 ? 0 : e->impulse[h->slips + 1];
    return mech_sqrt(a * a + b * b) - mech_row_value(s, h->slips, MECH_COEFFICIENT) * normal;
}

static void mend_hit(mech_solver *s, hit *h, int way)
{
    if (way != BEYOND_CONE) {
        h->state = way == PULLS ? HIT_SPARED : h->slides ? HIT_SLIDES : HIT_STICKS;
        return;
    }
    const mech_real *tangential = s->events->impulse + h->slips, slip = mech_row_size(s, h->slips, MECH_RATE);
    const mech_real a = tangential[0], b = h->count == 1 ? 0 : tangential[1], size = mech_sqrt(a * a + b * b);
    for (int c = 0; c < h->count; c++)
        h->push[c] =
            slip > mech_row_still(s, h->slips) ? -*mech_row_rate(s, h->slips + c) / slip : tangential[c] / size;
    h->state = HIT_SLIDES;
}

/* Mends the hits that fit least, all that fit as little at once: which one stands first says nothing. Gives whether there
 * was one. */
static int mend_worst(mech_solver *s, int n, hit *hits)
{
    for (int way = 0; way < MISFITS; way++) {
        mech_real own[MECH_MOST_ROWS], worst = 0;
        if (way == PULLS && n == 1) continue;
        for (int k = 0; k < n; k++) worst = mech_max(worst, own[k] = misfit(s, &hits[k], way));
        if (!(worst > 0)) continue;
        for (int k = 0; k < n; k++)
            if (own[k] >= worst * (1 - MECH_C(1e-6))) mend_hit(s, &hits[k], way);
        return 1;
    }
    return 0;
}

/* The state of hit k in a combination, a number to the base of three. */
static int state_in(int combination, int k)
{
    for (; k > 0; k--) combination /= STATES;
    return combination % STATES;
}

static int count_in(int combination, int n, int state)
{
    int found = 0;
    for (int k = 0; k < n; k++) found += state_in(combination, k) == state;
    return found;
}

/* Whether the impulses of what slides are against the slip that is left. */
static int opposes_slip(mech_solver *s, int n, const hit *hits)
{
    for (int k = 0; k < n; k++) {
        const hit *h = &hits[k];
        if (h->state != HIT_SLIDES) continue;
        mech_real rate[2] = {0, 0}, along = 0, across = 0, size = 0;
        for (int c = 0; c < h->count; c++) {
            rate[c] = *mech_row_rate(s, h->slips + c);
            size += mech_abs(rate[c]);
            for (int j = 0; j < s->events->n_rows; j++) {
                const mech_real part = mech_row_response(s, h->slips + c, j) * s->events->impulse[j];
                rate[c] += part;
                size += mech_abs(part);
            }
            along -= h->push[c] * rate[c];
        }
        for (int c = 0; c < h->count; c++) across = mech_max(across, mech_abs(rate[c] + along * h->push[c]));
        if (along < -MECH_C(1e-12) * size || across > MECH_C(1e-12) * size) return 0;
    }
    return 1;
}

static int fits(mech_solver *s, int n, const hit *hits)
{
    mech_real size = 0;
    for (int k = 0; k < n; k++) size = mech_max(size, mech_abs(s->events->impulse[hits[k].contact]));
    for (int k = 0; k < n; k++) {
        for (int way = 0; way < MISFITS; way++)
            if (misfit(s, &hits[k], way) > (way == COMES_BACK ? 0 : MECH_C(1e-12) * size)) return 0;
    }
    return opposes_slip(s, n, hits);
}

/* Gives hits the states of a combination; 0 where these cannot have them. */
static int combine(const mech_solver *s, int n, hit *hits, int combination)
{
    for (int k = 0; k < n; k++) {
        hit *h = &hits[k];
        const mech_real slip = h->count ? mech_row_size(s, h->slips, MECH_RATE) : 0;
        h->state = state_in(combination, k);
        if (h->state == HIT_STICKS && h->slides) return 0;
        if (h->state != HIT_SLIDES) continue;
        if (!h->count || !(slip > mech_row_still(s, h->slips))) return 0;
        for (int c = 0; c < h->count; c++) h->push[c] = -*mech_row_rate(s, h->slips + c) / slip;
    }
    return 1;
}

/* Few hits in all combinations, those first in which most of them take part, and of these those in which most of them stick. */
static int try_all(mech_solver *s, int n, hit *hits)
{
    int all = 1;
    for (int k = 0; k < n; k++) all *= STATES;
    for (int spared = 0; spared < n; spared++)
        for (int slide = 0; slide <= n - spared; slide++)
            for (int i = 0; i < all; i++) {
                if (count_in(i, n, HIT_SPARED) != spared || count_in(i, n, HIT_SLIDES) != slide) continue;
                if (combine(s, n, hits, i) && solve_hits(s, n, hits) && fits(s, n, hits)) return 1;
            }
    return 0;
}

/* Contacts that hit at once: 1 with their impulses, 0 where no combination of sticking, sliding and sparing fits. */
static int fit_hits(mech_solver *s, int n, hit *hits)
{
    for (int round = 0; round < ROUNDS_PER_HIT * n; round++) {
        const int reached = solve_hits(s, n, hits);
        if (mend_worst(s, n, hits)) continue;
        return reached && !(n == 1 && hits[0].state == HIT_SLIDES && s->events->impulse[hits[0].contact] < 0);
    }
    return n > 1 && n <= MOST_COMBINED && try_all(s, n, hits);
}

/* The impulses of hits whose friction would turn the slip: against the slip that is left. */
static int strike_hits(mech_solver *s, int n, const hit *hits)
{
    int among[MECH_MOST_ROWS];
    mech_real restitution[MECH_MOST_ROWS];
    for (int k = 0; k < n; k++) {
        among[k] = hits[k].contact;
        restitution[among[k]] = hits[k].aim / -*mech_row_rate(s, among[k]) - 1;
    }
    return mech_contact_cones_strike(s, restitution, n, among);
}

/* The contact that approaches fastest hits, together with all that approach as fast: which of them stands first in the
 * text says nothing. Where these have no common solution, it hits alone. */
int mech_impulse_fastest(mech_solver *s, int contact)
{
    mech_event_state *e = s->events;
    const mech_real least = -*mech_row_rate(s, contact) * (1 - MECH_C(1e-9));
    hit hits[MECH_MOST_ROWS];
    mech_real size, hit_before[MECH_MOST_ROWS], delay_before[MECH_MOST_ROWS];
    int n = 1;
    hits[0] = begin_hit(s, contact);
    for (int i = 0; i < e->n_rows; i++) {
        if (i == contact || !mech_row_touches(s, i) || !(-*mech_row_rate(s, i) >= least)) continue;
        hit_before[n] = e->last_hit[i];
        delay_before[n] = e->delay[i];
        hits[n++] = begin_hit(s, i);
    }
    if (n > 1 && ((fit_hits(s, n, hits) && opposes_slip(s, n, hits)) || strike_hits(s, n, hits)) &&
        mech_rows_impulse_loss(s, &size) >= -MECH_C(1e-9) * size) {
        for (int k = 1; k < n; k++)
            mech_journal_note(s, MECH_IMPACT, hits[k].contact, -*mech_row_rate(s, hits[k].contact));
        return MECH_RUNNING;
    }
    for (int k = 1; k < n; k++) {
        e->last_hit[hits[k].contact] = hit_before[k];
        e->delay[hits[k].contact] = delay_before[k];
    }
    hits[0].state = HIT_STICKS;
    const int found = (fit_hits(s, 1, hits) && opposes_slip(s, 1, hits)) || strike_hits(s, 1, hits);
    return found ? MECH_RUNNING : mech_fail(s, MECH_NO_IMPACT, contact);
}

/* All that touch at once: 0 <= p, r+ + e r- >= 0, one of them zero in each row. */
int mech_impulse_of_crowd(mech_solver *s)
{
    mech_near_rows_problem p;
    p.n = 0;
    for (int i = 0; i < s->events->n_rows; i++) {
        if (!mech_row_touches(s, i)) continue;
        const mech_real r = *mech_row_rate(s, i);
        p.set[p.n] = i;
        p.in[p.n] = r < 0;
        p.q[p.n] = r < 0 ? (1 + mech_impulse_restitution(s, i)) * r : r;
        p.slack[p.n] = mech_row_idle(s, i) / 10;
        p.held[p.n] = 0;
        p.weak[p.n++] = 0;
    }
    if (!mech_near_rows_complement(s, &p)) return mech_fail(s, MECH_NO_IMPACT, p.n ? p.set[0] : 0);
    mech_impulse_set(s, p.n, p.set, p.x);
    return MECH_RUNNING;
}

/* The same where some have friction: none of them rebounds, and what slips does so all the while. */
int mech_impulse_with_friction(mech_solver *s, int contact)
{
    hit hits[MECH_MOST_ROWS];
    int n = 0;
    for (int i = 0; i < s->events->n_rows; i++) {
        if (!mech_row_touches(s, i)) continue;
        const mech_real rate = *mech_row_rate(s, i);
        hits[n] = begin_hit(s, i);
        hits[n].aim = mech_abs(rate) <= mech_row_still(s, i) / 10 ? 0 : -rate;
        const mech_real slip = hits[n].count ? mech_row_size(s, hits[n].slips, MECH_RATE) : 0;
        for (int c = 0; slip > 0 && c < hits[n].count; c++) hits[n].push[c] = -*mech_row_rate(s, hits[n].slips + c) / slip;
        hits[n].slides = slip > 0;
        if (slip > 0) hits[n].state = HIT_SLIDES;
        if (hits[n].aim < 0) hits[n].state = HIT_SPARED;
        n++;
    }
    return fit_hits(s, n, hits) ? MECH_RUNNING : mech_impulse_fastest(s, contact);
}
