/* What is kept of a member, formed while it runs. */
#include <string.h>

#include "inputs.h"
#include "member.h"

enum { SAMPLES = MECH_LANE_SAMPLES, SEARCHES = 60 };

/* Lobatto's rule of five places on 0..1, exact up to the seventh degree, which is that of the polynomials of dop853. */
static const mech_real PLACES[SAMPLES] = MECH_LANE_PLACES;
static const mech_real SHARES[SAMPLES] = {MECH_C(0.05), MECH_C(0.27222222222222223), MECH_C(0.35555555555555557),
                                          MECH_C(0.27222222222222223), MECH_C(0.05)};
static const mech_real BESIDE = MECH_C(0.01); /* of a step: where an end is looked at for a peak inside */
static const mech_real GOLDEN = MECH_C(0.3819660112501051);

typedef struct mech_watch {
    mech_real t, h;              /* of the present step, with the coefficients of its polynomial */
    const mech_real *dense, *z;
    int n_dense, width, plain;   /* numbers of the polynomial stand `width` apart   */
    int n_outputs;
    mech_real from;              /* where what is kept begins                       */
    mech_real *y, *u, *out;      /* room for a state, inputs, outputs               */
    mech_real *sums;             /* [n_kept] of means; found so far for the others  */
    mech_real *samples;          /* [SAMPLES][n_kept]                               */
} watch;

static size_t room_numbers(const mech_ensemble *e)
{
    const mech_model *m = e->model;
    return (size_t)(m->nq + m->nv + m->nx + m->nu + m->n_outputs) + (size_t)e->n_kept * (SAMPLES + 1);
}

size_t mech_watch_bytes(const mech_ensemble *e) { return sizeof(watch) + room_numbers(e) * sizeof(mech_real); }

static int flows(int kind) { return kind == MECH_LARGEST || kind == MECH_LEAST || kind == MECH_MEAN || kind == MECH_FIRST; }

int mech_keeps_steps(const mech_ensemble *e)
{
    int some = 0;
    for (int k = 0; k < e->n_kept; k++) some |= flows(e->kept[k].kind);
    return some;
}

int mech_keeps_events(const mech_ensemble *e)
{
    int some = 0;
    for (int k = 0; k < e->n_kept; k++) some |= e->kept[k].kind == MECH_EVENT_COUNT;
    return some;
}

void mech_watch_begin(mech_room *r)
{
    const mech_ensemble *e = r->e;
    const mech_model *m = e->model;
    watch *w = r->watch;
    w->n_outputs = 0;
    for (int k = 0; k < e->n_kept; k++) w->n_outputs |= e->kept[k].array == MECH_IN_OUTPUTS;
    w->from = e->begin;
    w->y = (mech_real *)(w + 1);
    w->u = w->y + m->nq + m->nv + m->nx;
    w->out = w->u + m->nu;
    w->sums = w->out + m->n_outputs;
    w->samples = w->sums + e->n_kept;
    for (int k = 0; k < e->n_kept; k++) {
        const int kind = e->kept[k].kind;
        w->sums[k] = kind == MECH_LARGEST || kind == MECH_LEAST ? -(mech_real)INFINITY : kind == MECH_FIRST ? (mech_real)NAN : 0;
    }
}

void mech_member_outputs(const mech_room *r, mech_real t, const mech_real *y, const mech_real *z, mech_real *u,
                         mech_real *out)
{
    const mech_model *m = r->e->model;
    if (m->nu) mech_inputs(m, r->tables, r->e->options->n_tables, NULL, t, r->p, u);
    if (m->n_outputs) m->outputs(t, y, u, z, r->p, out);
}

static mech_real value(const mech_kept *kept, const mech_real *y, const mech_real *z, const mech_real *out)
{
    return kept->array == MECH_IN_Y ? y[kept->index] : kept->array == MECH_IN_Z ? z[kept->index] : out[kept->index];
}

/* Smallest values are the largest of the opposite ones. */
static mech_real upright(const mech_kept *kept, mech_real x) { return kept->kind == MECH_LEAST ? -x : x; }

/* Reads all quantities at the place s of the step. */
static void look(mech_room *r, mech_real s)
{
    watch *w = r->watch;
    mech_dense_beside(w->dense, w->n_dense, r->e->model->nq + r->e->model->nv + r->e->model->nx, w->width, w->plain, s, w->y);
    mech_normalise(r->e->model, w->y);
    if (w->n_outputs) mech_member_outputs(r, w->t + s * w->h, w->y, w->z, w->u, w->out);
}

static mech_real at(mech_room *r, const mech_kept *kept, mech_real s)
{
    look(r, s);
    return upright(kept, value(kept, r->watch->y, r->watch->z, r->watch->out));
}

/* The place of the largest value between a and b, by golden sections and parabolas (R. P. Brent, Algorithms for Minimization
 * Without Derivatives, 1973); ends early where the value is above `enough`. */
static mech_real summit(mech_room *r, const mech_kept *kept, mech_real a, mech_real b, mech_real enough, mech_real *largest)
{
    const mech_real close = MECH_C(1e-9);
    mech_real x = a + GOLDEN * (b - a), v = x, u = x, last = 0, step = 0;
    mech_real fx = at(r, kept, x), fv = fx, fu = fx;
    for (int i = 0; i < SEARCHES && fx <= enough; i++) {
        const mech_real middle = (a + b) / 2;
        if (mech_abs(x - middle) <= 2 * close - (b - a) / 2) break;
        mech_real p = 0, q = 0, former = last;
        if (mech_abs(last) > close) {
            const mech_real g = (x - v) * (fx - fu), k = (x - u) * (fx - fv);
            p = (x - u) * k - (x - v) * g;
            q = 2 * (k - g);
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
        const mech_real f = at(r, kept, next);
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
static mech_real higher(mech_room *r, int k, int first, mech_real *best)
{
    const mech_kept *kept = &r->e->kept[k];
    const int n = r->e->n_kept;
    const mech_real *v = r->watch->samples;
    mech_real found = -1;
    for (int j = 0; j < SAMPLES; j++) {
        const mech_real here = upright(kept, v[j * n + k]);
        const mech_real before = j ? upright(kept, v[(j - 1) * n + k]) : here;
        const mech_real after = j + 1 < SAMPLES ? upright(kept, v[(j + 1) * n + k]) : here;
        if (here > *best) {
            *best = here;
            found = PLACES[j];
            if (first) return found;
        }
        if (!(here >= before && here >= after)) continue;
        const mech_real spread = here - mech_min(before, after);
        if (!(here + spread > *best)) continue;
        if (j == 0 && !(at(r, kept, BESIDE * PLACES[1]) > here)) continue;
        if (j + 1 == SAMPLES && !(at(r, kept, 1 - BESIDE * PLACES[1]) > here)) continue;
        mech_real top;
        const mech_real s = summit(r, kept, PLACES[j ? j - 1 : 0], PLACES[j + 1 < SAMPLES ? j + 1 : j],
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
static mech_real first_time(mech_room *r, int k)
{
    const mech_kept *kept = &r->e->kept[k];
    mech_real best = 0, a = 0;
    mech_real b = higher(r, k, 1, &best);
    if (b < 0) return (mech_real)NAN;
    for (int j = 0; j < SAMPLES; j++)
        if (PLACES[j] < b) a = PLACES[j];
    for (int i = 0; i < SEARCHES && b - a > MECH_EPSILON * b; i++) {
        const mech_real middle = (a + b) / 2;
        if (at(r, kept, middle) > 0) b = middle;
        else a = middle;
    }
    return r->watch->t + b * r->watch->h;
}

void mech_dense_beside(const mech_real *c, int n_dense, int ny, int width, int plain, mech_real s, mech_real *y)
{
    const mech_real r = plain ? s : 1 - s;
    for (int i = 0; i < ny; i++) {
        mech_real sum = c[((n_dense - 1) * ny + i) * width];
        for (int k = n_dense - 2; k >= 0; k--) sum = c[(k * ny + i) * width] + (k % 2 ? r : s) * sum;
        y[i] = sum;
    }
}

/* Reduces the samples of a step. */
static void reduce(mech_room *r)
{
    const mech_ensemble *e = r->e;
    watch *w = r->watch;
    for (int k = 0; k < e->n_kept; k++) switch (e->kept[k].kind) {
        case MECH_LARGEST:
        case MECH_LEAST:
            higher(r, k, 0, &w->sums[k]);
            for (int j = 0; j < SAMPLES; j++) /* what is undefined somewhere has no largest value */
                if (!mech_finite(w->samples[j * e->n_kept + k])) w->sums[k] = (mech_real)NAN;
            break;
        case MECH_MEAN: {
            mech_real sum = 0;
            for (int j = 0; j < SAMPLES; j++) sum += SHARES[j] * w->samples[j * e->n_kept + k];
            w->sums[k] += w->h * sum;
            break;
        }
        case MECH_FIRST:
            if (!mech_finite(w->sums[k])) w->sums[k] = first_time(r, k);
            break;
        default:
            break;
        }
}

void mech_watch_step(mech_room *r, const mech_real *record, int n_dense, const mech_real *z)
{
    const mech_ensemble *e = r->e;
    watch *w = r->watch;
    if (record[0] < w->from) return; /* `from` is the end of a step */
    w->t = record[0];
    w->h = record[1];
    w->dense = record + 2;
    w->n_dense = n_dense;
    w->width = 1;
    w->plain = 0;
    w->z = z;
    for (int j = 0; j < SAMPLES; j++) {
        look(r, PLACES[j]);
        for (int k = 0; k < e->n_kept; k++)
            if (flows(e->kept[k].kind)) w->samples[j * e->n_kept + k] = value(&e->kept[k], w->y, z, w->out);
    }
    reduce(r);
}

void mech_watch_beside(mech_room *r, const mech_beside *step)
{
    const mech_ensemble *e = r->e;
    watch *w = r->watch;
    if (step->t < w->from) return;
    w->t = step->t;
    w->h = step->h;
    w->dense = step->dense;
    w->n_dense = step->n_dense;
    w->width = step->width;
    w->plain = step->plain;
    w->z = r->z;
    for (int i = 0; i < SAMPLES * e->n_kept; i++) w->samples[i] = step->samples[i * step->width];
    reduce(r);
}

void mech_watch_jump(mech_room *r, mech_real t, const mech_real *y, const mech_real *z)
{
    const mech_ensemble *e = r->e;
    watch *w = r->watch;
    if (t < w->from) return;
    if (w->n_outputs) mech_member_outputs(r, t, y, z, w->u, w->out);
    for (int k = 0; k < e->n_kept; k++) {
        const mech_kept *kept = &e->kept[k];
        if (!flows(kept->kind) || kept->kind == MECH_MEAN) continue;
        const mech_real x = upright(kept, value(kept, y, z, w->out));
        if (kept->kind == MECH_FIRST) {
            if (!mech_finite(w->sums[k]) && x > 0) w->sums[k] = t;
        } else if (x > w->sums[k] || !mech_finite(x)) {
            w->sums[k] = x;
        }
    }
}

void mech_watch_events(mech_room *r, const mech_event *events, long n)
{
    const mech_ensemble *e = r->e;
    for (int k = 0; k < e->n_kept; k++) {
        const mech_kept *kept = &e->kept[k];
        for (long i = 0; kept->kind == MECH_EVENT_COUNT && i < n; i++)
            r->watch->sums[k] += events[i].t >= r->watch->from && (kept->event < 0 || events[i].kind == kept->event) &&
                                 (kept->row < 0 || events[i].index == kept->row);
    }
}

void mech_watch_end(mech_room *r, mech_real t, const mech_real *y, const mech_real *z, mech_real *out)
{
    const mech_ensemble *e = r->e;
    watch *w = r->watch;
    if (w->n_outputs) mech_member_outputs(r, t, y, z, w->u, w->out);
    for (int k = 0; k < e->n_kept; k++) {
        const mech_kept *kept = &e->kept[k];
        const mech_real last = value(kept, y, z, w->out);
        switch (kept->kind) {
        case MECH_FINAL:
            out[k] = last;
            break;
        case MECH_MEAN:
            out[k] = t > w->from ? w->sums[k] / (t - w->from) : last;
            break;
        case MECH_LARGEST:
        case MECH_LEAST:
            out[k] = upright(kept, w->sums[k]);
            break;
        default:
            out[k] = w->sums[k];
        }
    }
}
