/* Taylor's method: the state over a step as a polynomial whose coefficients follow from the program of the rates (model.h,
 * point 19). The order is 0.8 ln(1/rtol): an order costs nearly the same as any other, so that many orders and long
 * steps are cheaper than the order of least error for its price; ln(1/rtol) of few slots, which
 * the rest of a step outweighs. The step follows from the last four coefficients, of
 * which some vanish where a motion is symmetric in time; what the polynomial then misses shows in the residual of the
 * equations at its end.
 *
 * A. Jorba, M. Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods, Exp.
 * Math. 14, 2005.
 */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "method.h"
#include "fast_pow.h"
#include "series.h"
#include "taylor.h"

enum { MOST = MECH_SERIES_MOST, ROWS = MOST + 1 };

typedef mech_lanes lanes;
enum { WIDTH = MECH_SERIES_WIDTH };

static inline int padded(int n) { return (n + MECH_LANES - 1) / MECH_LANES * MECH_LANES; }

typedef struct series {
    int n, slots, stride; /* of a row of states, of slots, of all that an order gives                    */
    mech_real *z, *y_begun;
    mech_real *weight;    /* [n] 1 / the error allowed                                                   */
    mech_real *kept;      /* rates, then kept numbers                                                    */
    mech_real *end;       /* [n] the polynomial at the end of the step                                   */
    mech_real *slope;     /* [n] its derivative there                                                    */
    mech_real *sums;      /* [4][slots] begun for four orders at once, then what `next` reads            */
    mech_real *x;         /* [ROWS][n] coefficients of the state                                         */
    mech_real *rows;      /* [MOST][stride] of rates, A and B                                            */
} series;

/* Behind it in the extra numbers, from the next multiple of 64 bytes on: its parts. */
typedef struct memory {
    int order;
    int holds; /* the coefficients are those of a state at t with certain z, */
    int begun; /* the kept numbers those of one at t_begun with the same z   */
    mech_real t, t_begun, longest;
    series parts;
} memory;

static memory *memory_of(const mech_solver *s) { return (memory *)mech_extra(s); }

/* Lays out the parts from `at` on, which may be NULL; gives where they end. */
static size_t lay_out(const mech_model *m, mech_real *at, series *k)
{
    const int ny = m->nq + m->nv + m->nx;
    size_t used = 0;
#define PART(name, count) (k->name = at ? at + used : NULL, used += (size_t)padded((int)(count)))
    k->n = padded(ny);
    k->slots = padded(m->series->n_slots);
    k->stride = k->n + 2 * k->slots;
    if (k->stride / MECH_LANES % 2 == 0) k->stride += MECH_LANES; /* a power of two apart, rows share places of the cache */
    PART(z, m->nz);
    PART(y_begun, ny);
    PART(weight, ny);
    PART(kept, ny + m->series->n_kept);
    PART(end, ny);
    PART(slope, ny);
    PART(sums, 5 * k->slots + 2);
    PART(x, ROWS * k->n);
    PART(rows, MOST * k->stride);
#undef PART
    return used;
}

static int lacks(const mech_model *model) { return model->series ? MECH_RUNNING : MECH_NEEDS_SERIES; }

enum { HEADER = (sizeof(memory) + sizeof(mech_real) - 1) / sizeof(mech_real), ALIGNED = 64 };

static size_t n_extra(const mech_model *m)
{
    series k;
    return HEADER + ALIGNED / sizeof(mech_real) + lay_out(m, NULL, &k);
}

static int order_for(const mech_solver *s)
{
    const mech_series *series = s->model->series;
    const int few = series->expand || series->n_slots <= MECH_FEW_SLOTS;
    return mech_taylor_order(s->o.rtol, few ? MECH_C(1.0) : MECH_C(0.8), MOST);
}

/* What was remembered belongs to other parameters, or lies at another place of a line of the cache. */
static void forget(mech_solver *s)
{
    memory *m = memory_of(s);
    char *behind = (char *)(mech_extra(s) + HEADER);
    lay_out(s->model, (mech_real *)(behind + (ALIGNED - (uintptr_t)behind % ALIGNED) % ALIGNED), &m->parts);
    m->order = order_for(s);
    m->holds = m->begun = 0;
}

static void begin(mech_solver *s, int fresh)
{
    (void)fresh; /* t, y and z tell that */
    if (!s->run->started) forget(s);
}

static int same(const mech_real *a, const mech_real *b, int n)
{
    for (int i = 0; i < n; i++)
        if (memcmp(a + i, b + i, sizeof *a)) return 0;
    return 1;
}

/* Rates and kept numbers at t, y. */
static void start(mech_solver *s, const series *k, mech_real t, const mech_real *y)
{
    memory *m = memory_of(s);
    s->model->series->start(t, y, s->u, s->o.z, s->o.p, k->kept);
    s->run->report.evaluations++;
    memcpy(k->y_begun, y, (size_t)s->ny * sizeof(mech_real));
    m->t_begun = t;
    m->begun = 1;
}

/* The sums of all slots of order k. From order 4 on those of four orders are begun at once, with two numbers read for four
 * products, and completed when their order comes. What the latest order gave comes last: processors add up the rest while
 * they wait for it. */
static void add_up(const series *v, int k)
{
    const int r = k % 4, step = v->stride / WIDTH, row = v->slots / WIDTH;
    for (int i = 0; i < row; i++) {
        const lanes *a = (const lanes *)(v->rows + v->n) + i, *b = a + row;
        lanes *begun = (lanes *)v->sums + i, sum = {0};
        int last = k - 1;
        if (k < 4) {
            last = 1;
            for (int j = 2; j < k; j++) sum += a[step * j] * b[step * (k - j)];
            if (k > 1) sum += a[step] * b[step * (k - 1)];
        } else if (r == 0) {
            lanes s1 = {0}, s2 = {0}, s3 = {0}, w1 = {0}, w2 = {0}, w3 = {0};
            for (int j = 2; j < last; j++) {
                const lanes w = b[step * (k - j)], x = a[step * j];
                sum += x * w;
                s1 += x * w1;
                s2 += x * w2;
                s3 += x * w3;
                w3 = w2, w2 = w1, w1 = w;
            }
            const lanes x = a[step * last], w = b[step * last];
            begun[row] = s1 + (x * b[2 * step] + a[2 * step] * w);
            begun[2 * row] = s2 + x * b[3 * step] + (k > 4 ? a[3 * step] * w : sum * 0);
            begun[3 * row] = s3 + (k > 4 ? x * b[4 * step] + a[4 * step] * w : sum * 0);
            sum += x * b[step] + a[step] * w;
        } else {
            sum = begun[r * row];
            for (int j = r; j > 0; j--) sum += a[step * j] * b[step * (k - j)] + a[step * (k - j)] * b[step * j];
        }
        begun[4 * row] = sum;
    }
}

/* The same in the order of additions that models of few slots have in their own loop: of very few, the products of the latest
 * coefficients come last. */
static void add_up_few(const series *v, int k)
{
    const mech_real *rows = v->rows + v->n, *first = rows + v->stride, *latest = rows + (k - 1) * v->stride;
    mech_real *sums = v->sums + 4 * v->slots;
    const int ends = v->slots == MECH_LANES;
    mech_series_sums(ends ? 2 : 1, k, rows, v->slots, v->stride, sums);
    for (int i = 0; ends && k > 1 && i < v->slots; i++) {
        sums[i] += first[i] * latest[v->slots + i];
        if (k > 2) sums[i] += latest[i] * first[v->slots + i];
    }
}

static mech_real largest(const series *v, int k, int ny)
{
    mech_real most = 0;
    for (int i = 0; i < ny; i++) most = mech_max(mech_abs(v->x[k * v->n + i]) * v->weight[i], most);
    return most;
}

/* The step over which none of the last terms is larger than an error allowed; its last digits do not count. */
static mech_real suggested(const series *v, int order, int ny, mech_real longest)
{
    double least = INFINITY; /* logarithms: one power serves all */
    for (int k = order; k > order - LAST; k--) {
        const mech_real size = largest(v, k, ny);
        if (!mech_finite(size) || !(size > 0)) continue;
        const double here = -mech_rough_log2((double)size) * (double)mech_series_over[k];
        least = here < least ? here : least;
    }
    return mech_min(longest, mech_rough_exp2(least));
}

/* A step from one time that can be represented to another one, so that the state is that of its time to the last digit. */
static mech_real representable(mech_real t, mech_real h)
{
    const mech_real between = (t + h) - t;
    return between > 0 && mech_finite(between) ? between : h;
}

/* The orders from 2 on, one after the other. */
static void next_orders(const mech_solver *s, const series *v, int order)
{
    const int ny = s->ny, n = v->n, few = s->model->series->n_slots <= MECH_FEW_SLOTS;
    mech_real *u = v->sums + 4 * v->slots;
    for (int k = 1; k < order; k++) {
        mech_real *rates = v->rows + k * v->stride, *next = v->x + (k + 1) * n;
        if (few) add_up_few(v, k);
        else add_up(v, k);
        u[v->slots] = mech_series_over[k];
        u[v->slots + 1] = k == 1;
        s->model->series->next(k, v->x + k * n, u, v->kept + ny, s->o.p, rates);
        const mech_real share = mech_series_over[k + 1];
        for (int i = 0; i < ny; i++) next[i] = rates[i] * share;
    }
}

/* The coefficients at the present state, unless they are there. */
static void expand(mech_solver *s, const series *v)
{
    memory *m = memory_of(s);
    const int ny = s->ny, nz = s->model->nz, n = v->n;
    const mech_real t = s->run->report.t;
    const int same_z = !nz || same(v->z, s->o.z, nz);
    if (m->holds && m->t == t && same_z && same(v->x, s->y, ny)) return;
    if (!(m->begun && m->t_begun == t && same_z && same(v->y_begun, s->y, ny))) start(s, v, t, s->y);
    if (nz) memcpy(v->z, s->o.z, (size_t)nz * sizeof(mech_real));
    for (int i = 0; i < ny; i++) {
        v->x[i] = s->y[i];
        v->x[n + i] = v->kept[i];
        v->weight[i] = 1 / (s->o.atol[i] + s->o.rtol * mech_abs(s->y[i]));
    }
    if (s->model->series->expand)
        s->model->series->expand(m->order, v->kept + ny, s->o.p, v->x, v->rows);
    else
        next_orders(s, v, m->order);
    m->t = t;
    m->holds = 1;
    m->longest = representable(t, suggested(v, m->order, ny, s->o.dt_max));
}

static mech_real longest(mech_solver *s)
{
    memory *m = memory_of(s);
    expand(s, &m->parts);
    return m->longest;
}

/* The polynomial y = x_0 + h P(h) at the end of a step and its slope P + h P'; of P even and odd powers apart, which processors
 * form side by side. */
static void reach(const series *v, int order, int ny, mech_real h)
{
    const int row = v->n / WIDTH, held = (ny + WIDTH - 1) / WIDTH;
    const mech_real square = h * h;
    for (int i = 0; i < held; i++) {
        const lanes *x = (const lanes *)v->x + i, none = {0};
        lanes even = none, odd = none, even_rate = none, odd_rate = none; /* with respect to the square */
        int k = order;
        if (k % 2) even = x[k-- * row];
        for (; k > 0; k -= 2) {
            even_rate = even_rate * square + even;
            even = even * square + x[(k - 1) * row];
            odd_rate = odd_rate * square + odd;
            odd = odd * square + x[k * row];
        }
        const lanes share = even + odd * h;
        ((lanes *)v->end)[i] = x[0] + share * h;
        ((lanes *)v->slope)[i] = share + (odd + (even_rate + odd_rate * h) * (2 * h)) * h;
    }
}

/* The error is how far the polynomial at its end is off the equations, over what its last coefficients let expect. */
static mech_real attempt(mech_solver *s, mech_real h)
{
    memory *m = memory_of(s);
    const series *v = &m->parts;
    const int ny = s->ny;
    expand(s, v);
    reach(v, m->order, ny, h);
    memcpy(s->y_new, v->end, (size_t)ny * sizeof(mech_real));
    start(s, v, s->run->report.t + h, s->y_new);
    mech_real most = 0;
    for (int i = 0; i < ny; i++) {
        const mech_real residual = mech_abs(v->slope[i] - v->kept[i]) * v->weight[i];
        s->dy_new[i] = v->kept[i];
        if (!(residual <= most)) most = residual;
    }
    const mech_real error = h * most / (RESIDUAL * (m->order + 1));
    if (error > 1 && mech_finite(error))
        s->run->cut = mech_taylor_part(error, m->order);
    return error;
}

/* The series at the present state, whose rates are finite: of a root of zero, say, no further order is. */
static int blame(mech_solver *s)
{
    const memory *m = memory_of(s);
    for (int k = 2; k <= m->order; k++)
        for (int i = 0; i < s->ny; i++)
            if (!mech_finite(m->parts.x[k * m->parts.n + i])) return mech_fail(s, MECH_NO_SERIES, i);
    return MECH_RUNNING;
}

/* The next state suggests its own step. */
static mech_real control(mech_solver *s, mech_real h, mech_real error)
{
    (void)error;
    return s->o.dt_max / h;
}

/* The same polynomial in the form of solver.h, point 6: divided by s and by s - 1 in turn. */
static void dense(mech_solver *s, mech_real h)
{
    const series v = memory_of(s)->parts;
    const int ny = s->ny, order = memory_of(s)->order;
    mech_real *c = s->dense, power = 1;
    for (int k = 0; k <= MOST; k++, power *= h)
        for (int i = 0; i < ny; i++) c[k * ny + i] = k <= order ? v.x[k * v.n + i] * power : 0;
    for (int m = 1; m < order; m += 2) {
        for (int k = order - 1; k >= m; k--)
            for (int i = 0; i < ny; i++) c[k * ny + i] += c[(k + 1) * ny + i];
        for (int k = m + 1; k <= order; k++)
            for (int i = 0; i < ny; i++) c[k * ny + i] = -c[k * ny + i];
    }
    for (int i = 0; i < ny; i++) c[ny + i] = s->y_new[i] - s->y[i]; /* constraints and rotations have moved the end */
}

const mech_method mech_taylor = {
    .name = "taylor",
    .doc = "Taylor series of order 0.8 to 1.0 ln(1/tolerance) from the program of the model, for smooth motions and high accuracy",
    .order = LEAST,
    .adaptive = 1,
    .n_dense = MOST + 1,
    .error_order = LEAST,
    .factor_min = MECH_C(0.2),
    .factor_max = MECH_C(5.0),
    .lacks = lacks,
    .n_extra = n_extra,
    .begin = begin,
    .attach = forget,
    .longest = longest,
    .gives_derivative = 1,
    .blame = blame,
    .attempt = attempt,
    .control = control,
    .dense = dense,
};
