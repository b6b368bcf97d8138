/* Stability of explicit methods.
 *
 * Beyond their domain of stability steps enlarge what they should damp, also what is zero but for rounding. Error
 * estimates see it only when it has grown to the tolerance (those of high order later still), shorten the step, let it fade
 * and grow again: the motion is wrong by the tolerance or more in a way that rounding decides. So the largest eigenvalue is
 * measured where steps may be near the bound, and they stay within. It is measured by J. G. Verwer's and B. P.
 * Sommeijer's nonlinear power method (RKC: an explicit solver for parabolic PDEs, J. Comput. Appl. Math. 88, 1998).
 */
#include "stability.h"

#include "method.h"

/* Steps in a row, but for a few, after which a model counts as stiff; steps in a row after which no longer. */
enum { STIFF_HITS = 15, CALM_HITS = 25 };

/* Steps between two looks at their stages; of a measurement, in which it counts near the bound, and far from it. */
enum { LOOK_EVERY = 4, NEAR_LASTS = 20, FAR_LASTS = 40 };

/* Powers in a measurement, of which the last SAMPLED are averaged. */
enum { POWERS = 12, SAMPLED = 6 };

/* Shares of the bound: at which the stages ask for a measurement; below which steps are far; up to which they may go; and
 * beyond which a good step contradicts a measurement, as where a force has a vertical slope. */
static const mech_real ASKED = MECH_C(0.15), FAR = MECH_C(0.5), STABLE = MECH_C(0.9), BELIEVED = MECH_C(8.0);

/* The length of the differences of states, over nominal + |value|. */
static const mech_real DISTANCE = MECH_C(1e-6);

int mech_stability_calm(mech_solver *s, mech_real h)
{
    mech_run *run = s->run;
    run->calm_hits = s->method->stiffness(s, h) < s->method->stiffness_bound ? run->calm_hits + 1 : 0;
    return run->calm_hits >= CALM_HITS;
}

int mech_stability_stiff(mech_solver *s, mech_real h)
{
    mech_run *run = s->run;
    const long long steps = run->report.steps;
    const int due = steps >= run->fastest_until;
    if (due && !run->near_bound) run->fastest = 0;
    run->measures = run->fastest > 0 && (due || (!run->near_bound && h * run->fastest > FAR * s->method->stiffness_bound));
    const int counts = run->stiff_hits || steps % 100 == 0;
    const int looks = due && !(run->fastest > 0) && steps % LOOK_EVERY == 0;
    if (!counts && !looks) return 0;
    const mech_real bound = s->method->stiffness_bound, seen = s->method->stiffness(s, h);
    if (looks) run->measures = seen > ASKED * bound;
    if (!counts) return 0;
    /* Where values between the ends limit the steps, these stay below the end of the domain of stability. */
    const mech_real share = run->dense_limits ? MECH_C(0.6) : 1;
    if (run->bounded || seen > share * bound) {
        run->calm_hits = 0;
        if (++run->stiff_hits == STIFF_HITS && !(run->report.stiff_time == run->report.stiff_time))
            run->report.stiff_time = run->report.t;
    } else if (run->stiff_hits && ++run->calm_hits == 6) {
        run->stiff_hits = 0;
        run->calm_hits = 0;
    }
    return run->stiff_hits >= STIFF_HITS;
}

mech_real mech_stability_bounded(mech_solver *s, mech_real next)
{
    mech_run *run = s->run;
    run->bounded = run->fastest * next > STABLE * s->method->stiffness_bound;
    return run->bounded ? STABLE * s->method->stiffness_bound / run->fastest : next;
}

/* The largest |lambda| at the present state; 0 where something is undefined nearby. */
static mech_real largest_eigenvalue(mech_solver *s)
{
    const int n = s->ny, moving = n - s->model->n_accounts; /* nothing depends on accounts */
    mech_real *y = s->work, *f = s->work + n, size = 0, product = 1;
    for (int i = 0; i < n; i++) f[i] = 0;
    for (int i = 0; i < moving; i++) { /* something of every motion, the same on every machine */
        const mech_real x = MECH_C(0.6180339887498949) * (i + 1), share = x - mech_floor(x) - MECH_C(0.45);
        f[i] = share * (mech_nominal(s, i) + mech_abs(s->y[i]));
    }
    for (int k = 0; k <= POWERS; k++) {
        size = 0;
        for (int i = 0; i < moving; i++) {
            const mech_real x = f[i] / (mech_nominal(s, i) + mech_abs(s->y[i]));
            size += x * x;
        }
        size = mech_sqrt(size);
        if (!(size > 0) || !mech_finite(size)) return 0;
        if (k > POWERS - SAMPLED) product *= size / DISTANCE;
        if (k == POWERS) break;
        for (int i = 0; i < n; i++) y[i] = s->y[i] + (i < moving ? f[i] * (DISTANCE / size) : 0);
        mech_rhs(s, s->run->report.t, y, f);
        for (int i = 0; i < n; i++) f[i] -= s->dy[i];
    }
    return mech_pow(product, MECH_C(1.0) / SAMPLED);
}

void mech_stability_measure(mech_solver *s, mech_real h)
{
    mech_run *run = s->run;
    const mech_real bound = s->method->stiffness_bound;
    const mech_real found = largest_eigenvalue(s);
    run->measures = 0;
    run->fastest = h * found < BELIEVED * bound ? found : 0;
    run->near_bound = h * run->fastest > FAR * bound;
    run->fastest_until = run->report.steps + (run->near_bound ? NEAR_LASTS : FAR_LASTS);
    run->report.dt = mech_stability_bounded(s, run->report.dt);
}
