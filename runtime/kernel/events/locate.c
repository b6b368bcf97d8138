/* Events within a step: sampled on its polynomial, then located to rounding. */
#include "locate.h"

#include <string.h>

#include "indicators.h"
#include "rows.h"

/* The samples that every step gets: of irregular places, so that nothing periodic looks constant. */
static const mech_real places[MECH_SAMPLES - 1] = {0, MECH_C(0.2371), MECH_C(0.5557), MECH_C(0.7913), 1};

/* One indicator on a step, as a function f of the part of the step. `known`: its rate is. */
typedef struct search {
    mech_solver *s;
    mech_real h, shift, tol, room;
    int k, known;
    int measured; /* its tolerance covers the rounding of its terms                              */
    int rounding; /* the search was broken off: it may see rounding                              */
    long *looks;  /* samples in this step so far                                                 */
} search;

typedef struct sample {
    mech_real part, f, rate; /* df/dpart */
} sample;

static sample sampled(const search *q, mech_real part, mech_real w, mech_real rate)
{
    return (sample){part, w + q->shift, q->h * rate};
}

static sample look(const search *q, mech_real part)
{
    mech_solver *s = q->s;
    ++*q->looks;
    mech_real *y = s->events->y_at;
    mech_real *w = s->events->w + (MECH_SAMPLES - 1) * s->events->n;
    mech_real *rate = s->events->rate + (MECH_SAMPLES - 1) * s->events->n;
    mech_indicator_place(s, q->k, part, y);
    mech_indicator_read(s, q->k, s->run->report.t + part * q->h, y, w, q->known ? rate : NULL);
    return sampled(q, part, w[q->k], q->known ? rate[q->k] : 0);
}

/* The cubic through values and rates of a and b at a part between them; *rate its derivative there. */
static mech_real cubic(const sample *a, const sample *b, mech_real part, mech_real *rate)
{
    const mech_real length = b->part - a->part, s = (part - a->part) / length, r = 1 - s, d = b->f - a->f;
    const mech_real u = length * a->rate - d, v = d - length * b->rate - u;
    *rate = (d + (r - s) * u + s * (2 * r - s) * v) / length;
    return a->f + s * (d + r * (u + s * v));
}

/* Its least value, and where. */
static mech_real least(const sample *a, const sample *b, mech_real *where)
{
    const mech_real length = b->part - a->part, d = b->f - a->f;
    const mech_real u = length * a->rate - d, v = d - length * b->rate - u;
    /* f' = d + u + 2 (v - u) s - 3 v s^2 */
    const mech_real c0 = d + u, c1 = v - u, c2 = -3 * v, square = c1 * c1 - c0 * c2;
    mech_real lowest = mech_min(a->f, b->f), rate;
    *where = a->f < b->f ? a->part : b->part;
    if (!(square >= 0)) return lowest;
    const mech_real sum = -(c1 + (c1 < 0 ? -1 : 1) * mech_sqrt(square));
    const mech_real roots[2] = {c2 != 0 ? sum / c2 : -1, sum != 0 ? c0 / sum : -1};
    for (int i = 0; i < 2; i++) {
        if (!(roots[i] > 0 && roots[i] < 1)) continue;
        const mech_real part = a->part + roots[i] * length, f = cubic(a, b, part, &rate);
        if (f < lowest) {
            lowest = f;
            *where = part;
        }
    }
    return lowest;
}

/* Illinois method from a (f >= 0) to b (f < 0), with bisection where it is slow. */
static mech_real zero_between(const search *q, sample a, sample b)
{
    int side = 0;
    a.f = mech_max(a.f, 0);
    for (int i = 0; i < 100 && b.part - a.part > 2 * MECH_EPSILON * b.part; i++) {
        mech_real c = i % 8 == 7 ? (a.part + b.part) / 2 : (a.f * b.part - b.f * a.part) / (a.f - b.f);
        if (!(c > a.part && c < b.part)) c = (a.part + b.part) / 2;
        if (!(c > a.part && c < b.part)) break;
        const sample x = look(q, c);
        if (x.f == 0) return c;
        if (x.f < 0) {
            b = x;
            if (side == -1) a.f /= 2;
            side = -1;
        } else {
            a = x;
            if (side == 1) b.f /= 2;
            side = 1;
        }
    }
    return b.part;
}

enum { DEEPEST = 60, DEEPEST_WITHOUT_RATES = 12, NOWHERE = 2, DEEP = 8, MOST_LOOKS = 2000000 };

/* How far a sample is off the cubic through a and b. */
static mech_real off(const search *q, const sample *a, const sample *b, const sample *x)
{
    mech_real rate;
    const mech_real error = mech_abs(x->f - cubic(a, b, x->part, &rate));
    return q->known ? mech_max(error, mech_abs(x->rate - rate) * (b->part - a->part) / 4) : error;
}

/* The end of a search that sees no finer: what is negative there. */
static mech_real last_look(const search *q, const sample *a, const sample *b, const mech_real *lowest)
{
    for (int i = 0; i < 2; i++) {
        const sample x = look(q, lowest[i]);
        if (x.f < 0 && x.part > a->part) return zero_between(q, *a, x);
    }
    return b->f < 0 ? zero_between(q, *a, *b) : NOWHERE;
}

/* The error with two more samples: a part of what was rough may look smooth by chance. */
static mech_real confirmed(const search *q, const sample *a, const sample *m, const sample *b, mech_real error)
{
    const mech_real length = b->part - a->part;
    const sample x = look(q, a->part + MECH_C(0.2213) * length), y = look(q, a->part + MECH_C(0.7531) * length);
    return 4 * mech_max(error, mech_max(off(q, a, m, &x), off(q, m, b, &y)));
}

/* Without rates: whether f stays positive, or falls all the way, even if it has a kink. Beside one, the chords from a
 * to m and from m to b are off by no more than 2.2 times what m is off the chord from a to b. */
static int sure(const sample *a, const sample *m, const sample *b)
{
    const mech_real share = (m->part - a->part) / (b->part - a->part);
    const mech_real bend = MECH_C(2.2) * mech_abs(a->f + share * (b->f - a->f) - m->f);
    const mech_real lowest = mech_min(mech_min(a->f, b->f), m->f);
    return lowest > bend || (b->f < 0 && mech_min(a->f - m->f, m->f - b->f) > bend);
}

/* Whether the n + 1 samples are farther from zero than from each other. */
static int far_off(const sample *x, int n)
{
    mech_real lowest = x[0].f, highest = x[0].f;
    for (int j = 1; j <= n; j++) {
        lowest = mech_min(lowest, x[j].f);
        highest = mech_max(highest, x[j].f);
    }
    return lowest > highest - lowest;
}

/* Where f first falls below zero between a and b, or NOWHERE. Samples between them tell the error of the cubic. An
 * interval is dismissed where the cubics on both sides of the middle stay positive by more than that, searched where
 * they fall all the way, and halved else. `given`: samples that are known already, 2 span + 1 of them from a to b.
 * `rough`: the error of the interval that this is a part of. */
static mech_real first_below(search *q, const sample *given, int span, sample a, sample b, mech_real rough,
                             int depth)
{
    if (a.part >= q->room || q->rounding || *q->looks > MOST_LOOKS) return NOWHERE;
    if (depth > DEEP && !q->measured) {
        q->rounding = 1;
        return NOWHERE;
    }
    const mech_real length = b.part - a.part;
    sample m = span ? given[span] : look(q, a.part + MECH_C(0.4547) * length);
    mech_real error = off(q, &a, &b, &m), rate, where[2];
    for (int j = 1; j < 2 * span; j++) error = mech_max(error, off(q, &a, &b, &given[j]));
    if (!q->known && !span) { /* the polynomial of degree 4 through all that is known */
        const mech_real d = m.f - cubic(&a, &b, m.part, &rate);
        m.rate = rate + 2 * d * (1 / (m.part - a.part) + 1 / (m.part - b.part));
    }
    mech_real low = least(&a, &m, &where[0]), low_right = least(&m, &b, &where[1]);
    low = mech_min(low, low_right);
    /* Falling all the way: no rate is off by as much as the least of them. */
    const mech_real flattest = b.f < 0 ? -mech_max(mech_max(a.rate, m.rate), b.rate) * length : 0;
    mech_real margin = mech_max(low, flattest / 16);
    /* Beside a kink one sample may see no more than 1/6.1 of how far the cubics on both sides of it are off. */
    const mech_real bound = span == 1 ? 7 * error : error;
    if (margin > bound && (q->known || (span ? far_off(given, 2 * span) : sure(&a, &m, &b))) &&
        (span || !q->known || margin > 30 * rough || margin > confirmed(q, &a, &m, &b, error))) {
        if (low > 0) return NOWHERE;
        return m.f < 0 ? zero_between(q, a, m) : zero_between(q, m, b);
    }
    const mech_real steep = mech_max(mech_max(mech_abs(a.rate), mech_abs(b.rate)), mech_abs(m.rate));
    const int noise = q->known ? depth > DEEP && error > 10 * steep * length : depth >= DEEPEST_WITHOUT_RATES;
    const int within = !(error > q->tol) && !(low < -q->tol);
    /* What rests has no values that its rates, which are of rounding, could lead to. */
    const int rests = a.f == 0 && m.f == 0 && b.f == 0;
    if (!span && (within || rests || noise || depth == DEEPEST)) return last_look(q, &a, &b, where);
    const mech_real found = first_below(q, given, span / 2, a, m, error, depth + 1);
    if (found < NOWHERE || m.f < 0) return found < NOWHERE ? found : m.part;
    return first_below(q, given + span, span / 2, m, b, error, depth + 1);
}

/* Whether f rises all the way from a, where it is zero, to b: by rates that are above zero by more than the cubic is off, or, where it
 * begins flat, as the speed of a slip that a growing force begins, by rates and values that grow as those of the cubic. */
static int rises_all_the_way(const search *q, const sample *a, const sample *b)
{
    const mech_real length = b->part - a->part;
    if (!(b->rate > 0)) return 0;
    const sample m = look(q, a->part + MECH_C(0.4547) * length);
    const mech_real flattest = mech_min(mech_min(a->rate, m.rate), b->rate) * length;
    const mech_real flat = m.rate > 0 && b->rate > m.rate && b->f - a->f > b->rate * length / 4 ? m.f - a->f : 0;
    const mech_real margin = mech_max(flattest, flat);
    return margin > 16 * off(q, a, b, &m) && margin > 16 * confirmed(q, a, &m, b, 0);
}

/* Moves a, where f is zero, to a place before `end` until which it rises all the way. Where rounding hides that a condition falls again
 * at once, for it may bounce within rounding; of a row, and where f does not leave zero by its rate, this gives 0. */
static int behind_rise(const search *q, sample *a, mech_real end, int leaves)
{
    sample b = *a;
    int rises = 0;
    for (int i = 0; i < DEEPEST && !rises; i++) {
        b = look(q, end /= 4);
        rises = rises_all_the_way(q, a, &b);
    }
    if (!rises && (!leaves || q->k >= q->s->model->hybrid->n_switches)) return 0;
    *a = b;
    return 1;
}

/* Rates of n samples of an indicator by the polynomial through them. */
static void differentiate(sample *x, int n)
{
    for (int j = 0; j < n; j++) {
        x[j].rate = 0;
        for (int i = 0; i < n; i++) {
            if (i == j) continue;
            mech_real weight = 1 / (x[i].part - x[j].part);
            for (int k = 0; k < n; k++)
                if (k != i && k != j) weight *= (x[j].part - x[k].part) / (x[i].part - x[k].part);
            x[j].rate += weight * (x[i].f - x[j].f);
        }
    }
}

/* Whether an indicator is zero where a step begins. So is that of an open contact that rises from below zero: contacts beside
 * it were closed, from gaps that rounding and tolerances had left them, and that has moved it. */
static int begins_at_zero(mech_solver *s, int k, mech_real w, mech_real rate)
{
    const mech_event_state *e = s->events;
    const int i = k - s->model->hybrid->n_switches;
    if (mech_indicator_at_zero(s, k, w)) return 1;
    if (i < 0 || e->rows[i].kind != MECH_CONTACT || e->z[e->rows[i].flag] > MECH_C(0.5)) return 0;
    if (s->model->hybrid->crowd && e->fresh[k] > 0 && w < 0 && w >= -MECH_C(1e-6) * e->gap_scale[i]) return 1;
    return w < 0 && w >= -MECH_C(1e-7) * e->gap_scale[i] && rate > MECH_C(1e-12) * e->rate_scale[k];
}

/* Whether an open contact of a crowd touches and hardly moves: others that it depends on keep it, but for rounding. */
static int is_idle(const mech_solver *s, int k)
{
    const int i = k - s->model->hybrid->n_switches;
    if (i < 0 || !s->model->hybrid->crowd || s->events->rows[i].kind != MECH_CONTACT || mech_row_holds(s, i)) return 0;
    return mech_abs(s->events->rate[k]) <= 10 * mech_row_idle(s, i);
}

/* Samples all indicators; 0 where one is at its event at the start already, *hit. */
static int sample_all(mech_solver *s, mech_real h, int *hit)
{
    mech_event_state *e = s->events;
    const mech_real t = s->run->report.t;
    const int n = e->n, last = MECH_SAMPLES - 2; /* the row behind is room for the search */
    mech_indicators_read(s, t, s->y, e->w, e->rate);
    for (int k = 0; k < n; k++) {
        mech_indicator_widen(s, k, e->w[k]);
        mech_widen(e->rate_scale + k, e->rate[k]);
        const int zero = begins_at_zero(s, k, e->w[k], e->rate[k]);
        const int falls = e->rate[k] < -MECH_C(1e-12) * e->rate_scale[k];
        if ((!zero && e->w[k] < 0) || (zero && !(e->fresh[k] > 0) && falls && e->w[k] < 0)) {
            *hit = k;
            return 0;
        }
    }
    for (int j = 1; j <= last; j++) {
        mech_real *y = s->y_new;
        if (j < last) {
            y = e->y_at;
            mech_dense_at(s->dense, s->n_dense, s->ny, places[j], y);
            mech_normalise(s->model, y);
        }
        mech_indicators_read(s, t + places[j] * h, y, e->w + j * n, e->rate + j * n);
        for (int k = 0; k < n; k++) mech_indicator_widen(s, k, e->w[j * n + k]);
    }
    return 1;
}

/* Samples of all indicators: 2 span + 1 places, with a row of n values and one of rates for each. */
typedef struct samples {
    const mech_real *at, *w, *rate;
    int span;
} samples;

/* Where between the first and the last of some samples of a step indicator k leaves its side, before `room`; NOWHERE if it does not. */
static mech_real locate_one(mech_solver *s, int k, mech_real h, const samples *of, mech_real room, long *looks)
{
    const mech_event_state *e = s->events;
    const int n = e->n, last = 2 * of->span;
    enum { MOST_PASSES = 8 };
    for (int pass = 0;; pass++) {
        const int measured = pass || k >= s->model->hybrid->n_switches;
        search q = {.s = s, .h = h, .tol = mech_indicator_tolerance(s, k), .room = room, .k = k, .looks = looks, .measured = measured};
        const int zero = begins_at_zero(s, k, e->w[k], e->rate[k]);
        for (int j = 0; j <= last; j++) q.known |= of->rate[j * n + k] != 0;
        /* It begins at zero and grows: zero itself is not an event. */
        const int idle = zero && is_idle(s, k);
        const int leaves = zero && !idle && e->rate[k] > MECH_C(1e-12) * e->rate_scale[k] && e->rate[k] * h > q.tol;
        /* Rounding may leave w below zero: the way back to that level is the event. */
        if (zero) q.shift = mech_max(0, -e->w[k]) + (leaves ? 0 : idle ? 1000 * q.tol : q.tol);
        sample x[MECH_SAMPLES - 1];
        for (int j = 0; j <= last; j++) x[j] = sampled(&q, of->at[j], of->w[j * n + k], of->rate[j * n + k]);
        if (!q.known) differentiate(x, last + 1);
        const int flat = zero && !idle && !leaves && q.known && x[1].f > 16 * q.tol && x[1].rate > 0;
        if (x[0].part == 0 && (leaves || flat) && !behind_rise(&q, &x[0], x[1].part, leaves) && leaves) {
            q.shift += q.tol;
            for (int j = 0; j <= last; j++) x[j].f += q.tol;
        }
        if (x[last].part == 1 && x[last].f < 0 && x[last].f >= -q.tol) x[last].f = 0; /* the next step begins with it */
        const mech_real found = first_below(&q, x, of->span, x[0], x[last], 0, 0);
        /* What is zero where the step begins may be zero all along, but for the rounding of its terms. */
        const int resting = zero && found < NOWHERE && !measured;
        if ((!q.rounding && !resting) || pass == MOST_PASSES) return found;
        mech_indicator_widen_by_terms(s, k, s->run->report.t + h, s->y_new);
    }
}

/* Whether indicator k dips at the middle one of three places, or is below zero there. */
static int dips(mech_solver *s, int k)
{
    const mech_event_state *e = s->events;
    const mech_real tol = mech_indicator_tolerance(s, k), w = e->near[e->n + k];
    if (w < -tol - mech_max(0, -e->w[k])) return 1;
    return w < e->near[k] - tol && w < e->near[2 * e->n + k] - tol;
}

/* Reads all indicators at a part of the attempted step. */
static void read_at(mech_solver *s, mech_real h, mech_real part, mech_real *w, mech_real *rate)
{
    mech_real *y = s->y_new;
    if (part < 1) {
        y = s->events->y_at;
        mech_dense_at(s->dense, s->n_dense, s->ny, part, y);
        mech_normalise(s->model, y);
    }
    mech_indicators_read(s, s->run->report.t + part * h, y, w, rate);
}

/* Looks at all indicators in a long step so closely that what is narrow does not hide between its samples, up to what these
 * have found; an event that comes sooner is *hidden. */
static void look_closely(mech_solver *s, mech_real h, int *hit, mech_real *part, int *hidden, long *looks)
{
    enum { FEWEST = 4 };
    mech_event_state *e = s->events;
    const int n = e->n;
    const mech_real apart = s->model->hybrid->narrow ? s->o.apart : 0, seen = *hit < 0 ? 2 : *part;
    if (!(apart > 0 && h > FEWEST * apart)) return;
    const long many = (long)(h / apart) + 1;
    mech_real at[3] = {0, 0, 0};
    memcpy(e->near + n, e->w, (size_t)n * sizeof(mech_real));
    for (long j = 1; j <= many && !*hidden; j++) {
        at[2] = j == many ? 1 : (mech_real)j / (mech_real)many;
        if (at[2] >= seen) return;
        read_at(s, h, at[2], e->near + 2 * n, NULL);
        int dip = 0;
        for (int k = 0; j > 1 && k < n && !dip; k++) dip = dips(s, k);
        for (int i = 0; dip && i < 3; i++) read_at(s, h, at[i], e->near + i * n, e->near_rate + i * n);
        for (int k = 0; dip && k < n; k++) {
            if (!dips(s, k)) continue;
            const samples three = {at, e->near, e->near_rate, 1};
            const mech_real found = locate_one(s, k, h, &three, *part, looks);
            if (!(found < *part)) continue;
            *part = found;
            *hit = k;
            *hidden = 1;
        }
        memmove(e->near, e->near + n, 2 * (size_t)n * sizeof(mech_real));
        at[0] = at[1];
        at[1] = at[2];
    }
}

int mech_locate(mech_solver *s, mech_real h, int *hit, mech_real *part, int *hidden)
{
    long looks = 0;
    *hit = -1;
    *hidden = 0;
    *part = 0;
    if (!sample_all(s, h, hit)) return MECH_RUNNING;
    *part = 1;
    const samples all = {places, s->events->w, s->events->rate, 2};
    for (int k = 0; k < s->events->n; k++) {
        const mech_real found = locate_one(s, k, h, &all, *part, &looks);
        if (looks > MOST_LOOKS) {
            s->run->report.failed_part = 2;
            return mech_fail_to_settle(s, MECH_CHATTER, k);
        }
        if (found < *part) {
            *part = found;
            *hit = k;
        }
    }
    look_closely(s, h, hit, part, hidden, &looks);
    if (looks <= MOST_LOOKS) return MECH_RUNNING;
    s->run->report.failed_part = 2;
    return mech_fail_to_settle(s, MECH_CHATTER, *hit);
}
