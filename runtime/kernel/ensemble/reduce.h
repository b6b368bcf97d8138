/* What is kept of the steps of one member: largest and smallest values, means, first times.
 *
 * Included where `watch` is a struct of `n` kept numbers, of which `kind_of(w, k)` tells the kind and `value_of(w, k, s)` the value at
 * the place s of the step, with the begin `t` and size `h` of the step, `samples` [SAMPLES][n] along it, and `sums` [n] of what was
 * found so far. Smallest values are the largest of the opposite ones.
 */
#ifndef MECH_REDUCE_H
#define MECH_REDUCE_H

#include "kinds.h"

enum { SAMPLES = MECH_LANE_SAMPLES, SEARCHES = 60 };

/* Lobatto's rule of seven places on 0..1: exact for the polynomials of dop853, and for the long steps of Taylor's method as good as
 * their ends. */
static MECH_FIXED mech_real PLACES[SAMPLES] = MECH_LANE_PLACES;
static MECH_FIXED mech_real SHARES[SAMPLES] = {
    MECH_C(0.02380952380952381), MECH_C(0.13841302368078297), MECH_C(0.2158726906049313), MECH_C(0.24380952380952381),
    MECH_C(0.2158726906049313), MECH_C(0.13841302368078297), MECH_C(0.02380952380952381)};
static MECH_FIXED mech_real BESIDE = MECH_C(6e-5); /* of the first part: where an end is looked at for a peak inside, of which no more
                                                     than the square of this is missed */
static MECH_FIXED mech_real GOLDEN = MECH_C(0.3819660112501051);

static mech_real upright(int kind, mech_real x) { return kind == MECH_LEAST ? -x : x; }

static mech_real at(watch *w, int k, mech_real s) { return upright(kind_of(w, k), value_of(w, k, s)); }

static mech_real sampled(const watch *w, int j, int k) { return upright(kind_of(w, k), w->samples[j * w->n + k]); }

/* The place of the largest value between a and b, by golden sections and parabolas (R. P. Brent, Algorithms for Minimization
 * Without Derivatives, 1973); ends early where the value is above `enough`. */
static mech_real summit(watch *w, int k, mech_real a, mech_real b, mech_real enough, mech_real *largest)
{
    const mech_real close = MECH_C(1e-9);
    mech_real x = a + GOLDEN * (b - a), v = x, u = x, last = 0, step = 0;
    mech_real fx = at(w, k, x), fv = fx, fu = fx;
    for (int i = 0; i < SEARCHES && fx <= enough; i++) {
        const mech_real middle = (a + b) / 2;
        if (mech_abs(x - middle) <= 2 * close - (b - a) / 2) break;
        mech_real p = 0, q = 0, former = last;
        if (mech_abs(last) > close) {
            const mech_real g = (x - v) * (fx - fu), d = (x - u) * (fx - fv);
            p = (x - u) * d - (x - v) * g;
            q = 2 * (d - g);
            if (q > 0) p = -p;
            q = mech_abs(q);
            last = step;
        }
        if (q > 0 && mech_abs(p) < mech_abs(q * former / 2) && p > q * (a - x) && p < q * (b - x)) {
            step = p / q;
        } else {
            last = x < middle ? b - x : a - x;
            step = GOLDEN * last;
        }
        const mech_real next = x + (mech_abs(step) >= close ? step : step > 0 ? close : -close);
        const mech_real f = at(w, k, next);
        if (f >= fx) {
            if (next >= x) a = x;
            else b = x;
            u = v; fu = fv;
            v = x; fv = fx;
            x = next; fx = f;
        } else {
            if (next < x) a = next;
            else b = next;
            if (f >= fv || v == x) {
                u = v; fu = fv;
                v = next; fv = f;
            } else if (f >= fu || u == x || u == v) {
                u = next; fu = f;
            }
        }
    }
    *largest = fx;
    return x;
}

/* Searches the parts of a step that may hold a value above `best`; gives the place of the first that does, or -1. With
 * `first` it stops there; else it goes on to the largest. */
static mech_real higher(watch *w, int k, int first, mech_real *best)
{
    mech_real found = -1;
    for (int j = 0; j < SAMPLES; j++) {
        const mech_real here = sampled(w, j, k);
        const mech_real before = j ? sampled(w, j - 1, k) : here;
        const mech_real after = j + 1 < SAMPLES ? sampled(w, j + 1, k) : here;
        if (here > *best) {
            *best = here;
            found = PLACES[j];
            if (first) return found;
        }
        if (!(here >= before && here >= after)) continue;
        const mech_real spread = here - mech_min(before, after);
        if (!(here + spread > *best)) continue;
        if (j == 0 && !(at(w, k, BESIDE * PLACES[1]) > here)) continue;
        if (j + 1 == SAMPLES && !(at(w, k, 1 - BESIDE * PLACES[1]) > here)) continue;
        mech_real top;
        const mech_real s = summit(w, k, PLACES[j ? j - 1 : 0], PLACES[j + 1 < SAMPLES ? j + 1 : j],
                                   first ? *best : (mech_real)INFINITY, &top);
        if (top > *best) {
            *best = top;
            found = s;
            if (first) return found;
        }
    }
    return found;
}

/* The time at which a quantity that is not positive at the begin of the step first becomes so, or not-a-number. */
static mech_real first_time(watch *w, int k)
{
    mech_real best = 0, a = 0;
    mech_real b = higher(w, k, 1, &best);
    if (b < 0) return (mech_real)NAN;
    for (int j = 0; j < SAMPLES; j++)
        if (PLACES[j] < b) a = PLACES[j];
    for (int i = 0; i < SEARCHES && b - a > MECH_EPSILON * b; i++) {
        const mech_real middle = (a + b) / 2;
        if (at(w, k, middle) > 0) b = middle;
        else a = middle;
    }
    return w->t + b * w->h;
}

/* Reduces the samples of a step. */
static void reduce(watch *w)
{
    for (int k = 0; k < w->n; k++) switch (kind_of(w, k)) {
        case MECH_LARGEST:
        case MECH_LEAST:
            higher(w, k, 0, &w->sums[k]);
            for (int j = 0; j < SAMPLES; j++) /* what is undefined somewhere has no largest value */
                if (!mech_finite(w->samples[j * w->n + k])) w->sums[k] = (mech_real)NAN;
            break;
        case MECH_MEAN: {
            mech_real sum = 0;
            for (int j = 0; j < SAMPLES; j++) sum += SHARES[j] * w->samples[j * w->n + k];
            w->sums[k] += w->h * sum;
            break;
        }
        case MECH_FIRST:
            if (!mech_finite(w->sums[k])) w->sums[k] = first_time(w, k);
            break;
        default:
            break;
        }
}

#endif
