/* Gauss collocation with 1 to 4 stages and a fixed step: symplectic, symmetric, of order 2, 4, 6, 8.
 *
 * The stages are found by fixed-point iteration from the continued derivatives of the last step; where q' =
 * v, with the positions of the stages from their velocities at once, which squares the rate. It goes on
 * until rounding stops it, the step is added with compensation, and the coefficients are exact to twice the
 * digits: so the error by rounding grows as the square root of time. Where the iteration does not contract,
 * Newton's method takes over for the rest of the run, if the model has a Jacobian.
 *
 * E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd ed., Springer 2006, sections II.1,
 * VIII.6; E. Hairer, R. McLachlan, A. Razakarivony, Achieving Brouwer's law with implicit Runge-Kutta
 * methods, BIT 48, 2008.
 */
#include "gauss_tableau.h"
#include "hermite.h"

enum { MAX_FIXED_POINT = 60, MAX_NEWTON = 20 };

typedef struct memory {
    mech_real h_old;  /* of the step whose derivatives are in f; 0: there is none */
    int newton;       /* Newton's method is in use */
    int second_order; /* q' = v */
    mech_newton system;
} memory;

/* f, z, d, w: [stages][n]; rest: what rounding kept from y; weight: of changes; at: arguments. */
typedef struct arrays {
    mech_real *f, *z, *d, *w, *rest, *weight, *at;
} arrays;

static inline arrays arrays_of(const mech_solver *s, int stages)
{
    const int n = s->ny, block = stages * n;
    mech_real *k = s->work;
    return (arrays){.f = k,
                    .z = k + block,
                    .d = k + 2 * block,
                    .w = k + 3 * block,
                    .rest = k + 4 * block,
                    .weight = k + 4 * block + n,
                    .at = k + 4 * block + 2 * n};
}

static size_t header(void) { return mech_room_for(sizeof(memory)); }

static size_t n_extra(const mech_model *model, const gauss *g)
{
    return header() + (model->jacobian ? mech_newton_size(model, &g->spectrum) : 0);
}

static void attach(mech_solver *s, const gauss *g)
{
    memory *m = (memory *)mech_extra(s);
    const mech_real h = m->system.h;
    if (s->model->jacobian) mech_newton_prepare(&m->system, s->model, &g->spectrum, mech_extra(s) + header());
    m->system.h = h;
}

static void begin(mech_solver *s, int fresh, const gauss *g)
{
    memory *m = (memory *)mech_extra(s);
    const arrays k = arrays_of(s, g->spectrum.stages);
    m->h_old = 0;
    m->system.h = 0;
    if (!fresh) return;
    const mech_model *model = s->model;
    m->newton = 0;
    m->second_order = model->nq == model->nv && !model->n_rotations;
    if (model->jacobian) mech_newton_prepare(&m->system, model, &g->spectrum, mech_extra(s) + header());
    for (int i = 0; i < s->ny; i++) {
        k.rest[i] = 0;
        k.weight[i] = 1 / (mech_nominal(s, i) + mech_abs(s->y[i]));
    }
}

/* Stages from derivatives, z = h A f; with second_order the positions from the velocities in z. */
static inline void stages_of(const mech_solver *s, const gauss *g, int stages, mech_real h,
                             const mech_real *f, int second_order, mech_real *z)
{
    const int n = s->ny, nq = second_order ? s->model->nq : 0;
    for (int j = 0; j < stages; j++)
        for (int i = nq; i < n; i++) {
            mech_real rest = 0, sum = 0;
            for (int l = 0; l < stages; l++) rest += g->a_rest[j][l] * f[l * n + i];
            for (int l = 0; l < stages; l++) sum += g->a[j][l] * f[l * n + i];
            z[j * n + i] = h * (sum + rest);
        }
    for (int j = 0; j < stages; j++)
        for (int i = 0; i < nq; i++) {
            const mech_real v = s->y[nq + i];
            mech_real rest = 0, sum = 0;
            for (int l = 0; l < stages; l++) rest += g->a_rest[j][l] * (v + z[l * n + nq + i]);
            for (int l = 0; l < stages; l++) sum += g->a[j][l] * (v + z[l * n + nq + i]);
            z[j * n + i] = h * (sum + rest);
        }
}

static inline void predict(const mech_solver *s, const memory *m, const gauss *g, int stages, mech_real h,
                           const arrays *k)
{
    const int n = s->ny;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < stages; j++) {
            mech_real sum = s->dy[i];
            if (m->h_old == h) {
                sum *= g->next[j][stages];
                for (int l = 0; l < stages; l++) sum += g->next[j][l] * k->f[l * n + i];
            }
            k->d[j * n + i] = sum;
        }
    stages_of(s, g, stages, h, k->d, m->second_order, k->z);
}

/* The derivatives of all stages; 1 if q' was not v where that was taken for granted. */
static inline int evaluate(mech_solver *s, const gauss *g, int stages, mech_real h, const arrays *k,
                           int second_order)
{
    const int n = s->ny, nq = second_order ? s->model->nq : 0;
    int differs = 0;
    for (int j = 0; j < stages; j++) {
        const mech_real *z = k->z + j * n;
        mech_real *f = k->f + j * n;
        for (int i = 0; i < n; i++) k->at[i] = s->y[i] + (z[i] + k->rest[i]);
        mech_rhs(s, s->run->report.t + g->c[j] * h, k->at, f);
        for (int i = 0; i < nq; i++) differs |= f[i] != k->at[nq + i];
    }
    return differs;
}

/* Weighted size of d - z; z becomes d. */
static inline mech_real replace(const mech_solver *s, int stages, const arrays *k)
{
    const int n = s->ny;
    mech_real largest = 0;
    for (int j = 0; j < stages; j++)
        for (int i = 0; i < n; i++) {
            const mech_real change = mech_abs(k->d[j * n + i] - k->z[j * n + i]) * k->weight[i];
            if (!(change <= largest)) largest = change;
            k->z[j * n + i] = k->d[j * n + i];
        }
    return largest;
}

/* What an iteration may still change when rounding keeps it from going on: as a rule, and where forces magnify
   the rounding of positions, if it has got no further in several iterations. */
static mech_real rounding_level(int n) { return 64 * n * MECH_EPSILON; }
static mech_real highest_level(void) { return mech_sqrt(MECH_EPSILON) / 64; }

enum outcome { FOUND, NO_CONTRACTION, UNDEFINED };

static inline enum outcome fixed_point(mech_solver *s, memory *m, const gauss *g, int stages, mech_real h,
                                       const arrays *k)
{
    mech_real before = 0;
    int slow = 0;
    for (int l = 0; l < MAX_FIXED_POINT; l++) {
        s->run->report.iterations++;
        if (evaluate(s, g, stages, h, k, m->second_order) && m->second_order) {
            m->second_order = 0;
            before = 0;
        }
        stages_of(s, g, stages, h, k->f, m->second_order, k->d);
        const mech_real size = replace(s, stages, k);
        if (!mech_finite(size)) return l ? NO_CONTRACTION : UNDEFINED;
        if (size == 0) return FOUND;
        if (l > 0 && size >= before) {
            if (size <= rounding_level(s->ny)) return FOUND;
            if (++slow > 4) return size <= highest_level() ? FOUND : NO_CONTRACTION;
        } else if (l > 0 && size > MECH_C(0.7) * before && ++slow > 12) {
            return size <= highest_level() ? FOUND : NO_CONTRACTION;
        }
        before = size;
    }
    return before <= highest_level() ? FOUND : NO_CONTRACTION;
}

/* The same by simplified Newton iterations with the Jacobian at the beginning of the step. */
static int newton(mech_solver *s, memory *m, const gauss *g, int stages, mech_real h, const arrays *k)
{
    const int n = s->ny;
    mech_newton *c = &m->system;
    mech_jacobian(s, s->run->report.t, s->y, c->jacobian);
    s->run->report.factorisations++;
    if (mech_newton_factorise(c, h)) return 0;
    mech_real before = 0;
    for (int l = 0; l < MAX_NEWTON; l++) {
        s->run->report.iterations++;
        (void)evaluate(s, g, stages, h, k, 0);
        mech_mix_stages(stages, n, g->spectrum.t_inverse, k->z, k->w);
        mech_newton_correct(c, k->f, k->w, k->d);
        mech_mix_stages(stages, n, g->spectrum.t, k->d, k->w);
        for (int i = 0; i < stages * n; i++) k->d[i] = k->z[i] + k->w[i];
        const mech_real size = replace(s, stages, k);
        if (!mech_finite(size)) return 0;
        if (size == 0 || (l > 0 && size >= before && size <= 16 * rounding_level(n))) return 1;
        if (l > 3 && size >= 2 * before && size > highest_level()) return 0;
        before = size;
    }
    return before <= highest_level();
}

/* y_new = y + step with what rounding cut off so far, and keeps what it cuts off now. */
static inline void add(mech_solver *s, const arrays *k, int i, mech_real step)
{
    const mech_real change = step + k->rest[i], y = s->y[i], y_new = y + change;
    s->y_new[i] = y_new;
    k->rest[i] = (y - y_new) + change;
}

static inline mech_real attempt(mech_solver *s, mech_real h, const gauss *g, int stages)
{
    memory *m = (memory *)mech_extra(s);
    const arrays k = arrays_of(s, stages);
    const int n = s->ny;
    predict(s, m, g, stages, h, &k);
    const enum outcome outcome = m->newton ? NO_CONTRACTION : fixed_point(s, m, g, stages, h, &k);
    if (outcome == UNDEFINED) return (mech_real)INFINITY;
    if (!m->newton && outcome == NO_CONTRACTION) {
        if (!s->model->jacobian) {
            s->run->trouble = MECH_NOT_CONVERGED;
            return (mech_real)INFINITY;
        }
        m->newton = 1;
        for (int i = 0; i < stages * n; i++) k.z[i] = 0;
    }
    if (m->newton && !newton(s, m, g, stages, h, &k)) {
        s->run->trouble = MECH_NOT_CONVERGED;
        return (mech_real)INFINITY;
    }
    mech_real check = 0;
    for (int i = 0; i < n; i++) {
        mech_real rest = 0, sum = 0;
        if (m->newton) {
            for (int j = 0; j < stages; j++) sum += g->by_stages[j] * k.z[j * n + i];
        } else if (m->second_order && i < s->model->nq) {
            const int at = s->model->nq + i;
            for (int j = 0; j < stages; j++) rest += g->b_rest[j] * (s->y[at] + k.z[j * n + at]);
            for (int j = 0; j < stages; j++) sum += g->b[j] * (s->y[at] + k.z[j * n + at]);
        } else {
            for (int j = 0; j < stages; j++) rest += g->b_rest[j] * k.f[j * n + i];
            for (int j = 0; j < stages; j++) sum += g->b[j] * k.f[j * n + i];
        }
        add(s, &k, i, m->newton ? sum : h * (sum + rest));
        check += s->y_new[i];
        if (mech_abs(s->y_new[i]) * k.weight[i] > 2) /* it has grown */
            k.weight[i] = 1 / (mech_nominal(s, i) + mech_abs(s->y_new[i]));
    }
    m->h_old = m->newton ? 0 : h;
    return mech_finite(check) ? 0 : check;
}

static inline void dense(mech_solver *s, mech_real h, const gauss *g, int stages)
{
    const memory *m = (const memory *)mech_extra(s);
    const arrays k = arrays_of(s, stages);
    const int n = s->ny;
    mech_real *c = s->dense;
    if (stages == 1 && !m->newton) {
        mech_hermite(s, h);
        return;
    }
    for (int i = 0; i < n; i++) {
        c[i] = s->y[i];
        c[n + i] = s->y_new[i] - s->y[i];
        for (int l = 2; l < s->method->n_dense; l++) {
            mech_real sum = 0;
            if (!m->newton) {
                sum = g->smooth[l - 2][0] * s->dy[i] + g->smooth[l - 2][stages + 1] * s->dy_new[i];
                for (int j = 0; j < stages; j++) sum += g->smooth[l - 2][j + 1] * k.f[j * n + i];
            } else if (l <= stages) {
                for (int j = 0; j < stages; j++) sum += g->plain[l - 2][j] * k.f[j * n + i];
            }
            c[l * n + i] = h * sum;
        }
    }
}

#define GAUSS(ORDER, STAGES, DENSE)                                                                          \
    static size_t n_extra_##ORDER(const mech_model *model) { return n_extra(model, &GAUSS##ORDER); }         \
    static void begin_##ORDER(mech_solver *s, int fresh) { begin(s, fresh, &GAUSS##ORDER); }                 \
    static void attach_##ORDER(mech_solver *s) { attach(s, &GAUSS##ORDER); }                                 \
    static mech_real attempt_##ORDER(mech_solver *s, mech_real h)                                            \
    {                                                                                                        \
        return attempt(s, h, &GAUSS##ORDER, STAGES);                                                         \
    }                                                                                                        \
    static void dense_##ORDER(mech_solver *s, mech_real h) { dense(s, h, &GAUSS##ORDER, STAGES); }           \
    const mech_method mech_gauss##ORDER = {                                                                  \
        .name = "gauss" #ORDER,                                                                              \
        .doc = "Gauss collocation of order " #ORDER ", fixed step: symplectic and symmetric",                \
        .order = ORDER,                                                                                      \
        .n_stages = STAGES,                                                                                  \
        .n_work = 4 * STAGES + 3,                                                                            \
        .n_dense = DENSE,                                                                                    \
        .n_extra = n_extra_##ORDER,                                                                          \
        .begin = begin_##ORDER,                                                                              \
        .attach = attach_##ORDER,                                                                            \
        .attempt = attempt_##ORDER,                                                                          \
        .dense = dense_##ORDER,                                                                              \
    };

GAUSS(2, 1, 4)
GAUSS(4, 2, 5)
GAUSS(6, 3, 6)
GAUSS(8, 4, 7)
