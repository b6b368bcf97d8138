/* The pairs Lobatto IIIA - IIIB on positions and momenta with a fixed step, for models with or without
 * position constraints: symplectic, symmetric; positions and velocities fulfil the constraints. Order 2
 * (RATTLE), 4 and 6.
 *
 *     Q_i = q + h sum a_ij V_j       p(Q_i, V_i) = p + h sum a^_ij F_j       phi(Q_i) = 0
 *     F_j = dL/dq + Q + K^T lam_j    q1 = Q_s    p1 = p + h sum b_j F_j      K v1 + b = 0
 *
 * The stages are found by simplified Newton iterations with M and K at the beginning of the step. The
 * momenta are kept from step to step, sums are compensated. Accounts are summed up at the nodes of the dense
 * output.
 *
 * L. Jay, Symplectic partitioned Runge-Kutta methods for constrained Hamiltonian systems, SIAM J. Numer.
 * Anal. 33, 1996; E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd ed., Springer 2006,
 * section VII.1.
 */
#include <string.h>

#include "hermite.h"
#include "linear.h"
#include "lobatto_tableau.h"

enum { MAX_ITERATIONS = 100 };

/* nv velocities, nc constraints, s stages. */
typedef struct arrays {
    mech_real *q, *v, *d, *f;       /* [s][nv] stages: positions, velocities, their changes; forces */
    mech_real *lam, *phi;           /* [s][nc] multipliers, residuals */
    mech_real *p, *p_rest, *q_rest; /* [nv] momenta; what rounding kept from them and from q */
    mech_real *p_new;               /* [nv] */
    mech_real *mass, *k, *mk, *s;   /* LU of M [nv][nv], K [nc][nv], M^-1 K^T [nc][nv], LU of K M^-1 K^T */
    mech_real *k_at, *at, *out;     /* K of a stage, a state, results of a function */
    mech_real *x_rest, *rates;      /* [nx] of accounts: as p_rest; [ny] derivatives */
    int *mass_pivot, *s_pivot;
} arrays;

static size_t n_numbers(int s, int nv, int nc, int nx)
{
    const int vectors = 4 * s * nv + 2 * s * nc + 9 * nv + 4 * nx + 2 * nc;
    return (size_t)(vectors + nv * nv + 3 * nc * nv + nc * nc) + mech_integers(nv) + mech_integers(nc);
}

/* Lays the n_numbers out from `next`. */
static arrays lay_out(mech_real *next, int s, int nv, int nc, int nx)
{
    arrays lying, *k = &lying;
    mech_real **vectors[] = {&k->q, &k->v, &k->d, &k->f};
    for (int i = 0; i < 4; i++) *vectors[i] = next, next += s * nv;
    k->lam = next, next += s * nc;
    k->phi = next, next += s * nc;
    mech_real **single[] = {&k->p, &k->p_rest, &k->q_rest, &k->p_new};
    for (int i = 0; i < 4; i++) *single[i] = next, next += nv;
    k->mass = next, next += nv * nv;
    mech_real **rows[] = {&k->k, &k->mk, &k->k_at};
    for (int i = 0; i < 3; i++) *rows[i] = next, next += nc * nv;
    k->s = next, next += nc * nc;
    k->at = next, next += 2 * nv + nx;
    k->x_rest = next, next += nx;
    k->rates = next, next += 2 * nv + nx;
    k->out = next, next += nv + 2 * nc + nx;
    k->mass_pivot = (int *)next, next += mech_integers(nv);
    k->s_pivot = (int *)next;
    return lying;
}

static arrays arrays_of(const mech_solver *s, const lobatto *c)
{
    return lay_out(s->work, c->stages, s->model->nv, s->model->n_velocity, s->model->nx);
}

static int lacks(const mech_model *m)
{
    const int plain =
        m->nq == m->nv && m->nx == m->n_accounts && !m->n_rotations && m->n_position == m->n_velocity;
    const int enough = m->momentum && m->force && m->mass;
    const int constrained = !m->n_velocity || (m->constraints && m->constraint_jacobian);
    const int switching = m->hybrid && m->hybrid->n_rows; /* their forces are in no function of the model */
    return plain && enough && constrained && !switching ? MECH_RUNNING : MECH_NEEDS_MOMENTA;
}

static void call(mech_solver *s, mech_function *f, mech_real t, const mech_real *y, mech_real *out)
{
    mech_surroundings(s, t);
    f(t, y, s->u, s->o.z, s->o.p, out);
}

/* M, K and what follows from them at a state; 1 where they are singular. */
static int factorise(mech_solver *s, const arrays *k, mech_real t, const mech_real *y)
{
    const int nv = s->model->nv, nc = s->model->n_velocity;
    s->run->report.factorisations++;
    call(s, s->model->mass, t, y, k->mass);
    if (mech_factorise(nv, k->mass, k->mass_pivot)) return 1;
    if (!nc) return 0;
    call(s, s->model->constraint_jacobian, t, y, k->k);
    memcpy(k->mk, k->k, (size_t)(nc * nv) * sizeof(mech_real));
    for (int r = 0; r < nc; r++) mech_solve(nv, k->mass, k->mass_pivot, k->mk + r * nv);
    for (int r = 0; r < nc; r++)
        for (int l = 0; l < nc; l++) {
            mech_real sum = 0;
            for (int i = 0; i < nv; i++) sum += k->k[r * nv + i] * k->mk[l * nv + i];
            k->s[r * nc + l] = sum;
        }
    return mech_factorise(nc, k->s, k->s_pivot);
}

/* Whatever the memory holds, it may be of a step that was not taken: its end was behind an event. */
static void begin(mech_solver *s, const lobatto *c)
{
    const arrays k = arrays_of(s, c);
    const int nv = s->model->nv;
    for (int i = 0; i < c->stages * s->model->n_velocity; i++) k.lam[i] = 0;
    for (int i = 0; i < nv; i++) k.p_rest[i] = k.q_rest[i] = 0;
    for (int i = 0; i < s->model->nx; i++) k.x_rest[i] = 0;
    call(s, s->model->momentum, s->run->report.t, s->y, k.p);
    /* A singular matrix has a zero or a not-a-number in its factors: the first step fails. */
    if (factorise(s, &k, s->run->report.t, s->y)) k.mass[0] = (mech_real)NAN;
}

/* sum_j (high_j + rest_j) x[j][i] over `count` stages. */
static inline mech_real combine(const mech_real *high, const mech_real *rest, const mech_real *x, int n,
                                int i, int count)
{
    mech_real small = 0, sum = 0;
    for (int j = 0; j < count; j++) small += rest[j] * x[j * n + i];
    for (int j = 0; j < count; j++) sum += high[j] * x[j * n + i];
    return sum + small;
}

static void positions(const mech_solver *s, const lobatto *c, const arrays *k, mech_real h)
{
    const int n = s->model->nv;
    for (int j = 1; j < c->stages; j++)
        for (int i = 0; i < n; i++)
            k->q[j * n + i] =
                s->y[i] + (k->q_rest[i] + h * combine(c->a[j], c->a_rest[j], k->v, n, i, c->stages));
}

static const mech_real *stage(const mech_solver *s, const arrays *k, int j)
{
    const int n = s->model->nv;
    memcpy(k->at, k->q + j * n, (size_t)n * sizeof(mech_real));
    memcpy(k->at + n, k->v + j * n, (size_t)n * sizeof(mech_real));
    memcpy(k->at + 2 * n, s->y + 2 * n, (size_t)s->model->nx * sizeof(mech_real));
    return k->at;
}

/* The force of stage j with that of its constraints. */
static void force(mech_solver *s, const lobatto *c, const arrays *k, mech_real h, int j)
{
    const int nv = s->model->nv, nc = s->model->n_velocity;
    const mech_real t = s->run->report.t + c->c[j] * h;
    mech_real *f = k->f + j * nv;
    call(s, s->model->force, t, stage(s, k, j), f);
    s->run->report.evaluations++;
    if (!nc) return;
    const mech_real *rows = j ? k->k_at : k->k;
    if (j) call(s, s->model->constraint_jacobian, t, k->at, k->k_at);
    for (int r = 0; r < nc; r++)
        for (int i = 0; i < nv; i++) f[i] += rows[r * nv + i] * k->lam[j * nc + r];
}

/* Changes of the multipliers that remove the residuals of the stages from the second on. */
static void correct_multipliers(const mech_solver *s, const lobatto *c, const arrays *k, mech_real h)
{
    const int nc = s->model->n_velocity, rows = c->stages - 1;
    const mech_real inverse = 1 / (h * h);
    for (int j = 1; j <= rows; j++) mech_solve(nc, k->s, k->s_pivot, k->phi + j * nc);
    for (int j = 0; j < rows; j++)
        for (int r = 0; r < nc; r++) {
            mech_real sum = 0;
            for (int l = 0; l < rows; l++) sum += c->inverse[j][l] * k->phi[(l + 1) * nc + r];
            k->lam[j * nc + r] -= sum * inverse;
        }
}

/* One iteration; gives its largest change of a velocity over what counts as 1. */
static mech_real iterate(mech_solver *s, const lobatto *c, const arrays *k, mech_real h)
{
    const int nv = s->model->nv, nc = s->model->n_velocity, stages = c->stages;
    const mech_real t = s->run->report.t;
    s->run->report.iterations++;
    for (int j = 0; j < stages - 1; j++) force(s, c, k, h, j);
    mech_real largest = 0;
    for (int j = 0; j < stages; j++) {
        mech_real *d = k->d + j * nv;
        call(s, s->model->momentum, t + c->c[j] * h, stage(s, k, j), d);
        for (int i = 0; i < nv; i++)
            d[i] = (k->p[i] - d[i]) +
                   (k->p_rest[i] + h * combine(c->a_hat[j], c->a_hat_rest[j], k->f, nv, i, stages - 1));
        mech_solve(nv, k->mass, k->mass_pivot, d);
        for (int i = 0; i < nv; i++) {
            const mech_real size = mech_abs(d[i]) / (mech_nominal(s, nv + i) + mech_abs(s->y[nv + i]));
            if (!(size <= largest)) largest = size;
            k->v[j * nv + i] += d[i];
        }
    }
    positions(s, c, k, h);
    if (!nc) return largest;
    for (int j = 1; j < stages; j++) {
        call(s, s->model->constraints, t + c->c[j] * h, stage(s, k, j), k->out);
        memcpy(k->phi + j * nc, k->out, (size_t)nc * sizeof(mech_real));
    }
    correct_multipliers(s, c, k, h);
    return largest;
}

/* Iterations end where rounding keeps them from going on: positions change by their last digits, velocities
   by that over h, which is this many of their own last digits. */
static mech_real share_of_velocities(const mech_solver *s, mech_real h)
{
    const int n = s->model->nv;
    mech_real largest = 1;
    for (int i = 0; i < n && s->model->n_velocity; i++) {
        const mech_real ratio =
            (mech_nominal(s, i) + mech_abs(s->y[i])) / (h * (mech_nominal(s, n + i) + mech_abs(s->y[n + i])));
        largest = mech_max(largest, ratio);
    }
    return largest;
}

static int converge(mech_solver *s, const lobatto *c, const arrays *k, mech_real h)
{
    const mech_real share = share_of_velocities(s, h), level = 64 * s->model->nv * MECH_EPSILON * share;
    const mech_real highest = mech_sqrt(MECH_EPSILON) / 64 * share; /* where forces magnify rounding */
    mech_real before = 0;
    int slow = 0;
    for (int l = 0; l < MAX_ITERATIONS; l++) {
        const mech_real size = iterate(s, c, k, h);
        if (!mech_finite(size)) return 0;
        if (l > 1 && size >= before) {
            if (size <= level) return 1;
            if (++slow > 6) return size <= highest;
        }
        if (size == 0 && l > 0) return 1;
        before = size;
    }
    return 0;
}

/* v1 and p1 at q1 from p + h sum b F, with the last multipliers such that K v1 + b = 0. */
static int finish(mech_solver *s, const lobatto *c, const arrays *k, mech_real h)
{
    const int nv = s->model->nv, nc = s->model->n_velocity, last = c->stages - 1;
    const mech_real t = s->run->report.t + h;
    mech_real *y = s->y_new, *v = y + nv;
    force(s, c, k, h, last);
    for (int i = 0; i < nv; i++) {
        const mech_real change = k->p_rest[i] + h * combine(c->b, c->b_rest, k->f, nv, i, c->stages);
        k->p_new[i] = k->p[i] + change;
        k->p_rest[i] = (k->p[i] - k->p_new[i]) + change;
        y[i] = k->q[last * nv + i];
        v[i] = k->v[last * nv + i];
    }
    if (factorise(s, k, t, y)) return 1;
    for (int round = 0; round < 2; round++) {
        call(s, s->model->momentum, t, y, k->d);
        for (int i = 0; i < nv; i++) k->d[i] = k->p_new[i] - k->d[i];
        mech_solve(nv, k->mass, k->mass_pivot, k->d);
        for (int i = 0; i < nv; i++) v[i] += k->d[i];
        if (!nc) continue;
        call(s, s->model->constraints, t, y, k->out);
        mech_real *mu = k->out + nc;
        mech_solve(nc, k->s, k->s_pivot, mu);
        for (int r = 0; r < nc; r++)
            for (int i = 0; i < nv; i++) {
                k->p_new[i] -= k->k[r * nv + i] * mu[r];
                v[i] -= k->mk[r * nv + i] * mu[r];
            }
    }
    return 0;
}

/* Derivatives at the end of the step, and accounts there: from the rates at the nodes. */
static void close_accounts(mech_solver *s, const lobatto *c, const arrays *k, mech_real h)
{
    const int first = 2 * s->model->nv, last = c->stages - 1;
    const mech_real t = s->run->report.t;
    for (int i = first; i < s->ny; i++) s->y_new[i] = s->y[i];
    mech_rhs(s, t + h, s->y_new, s->dy_new);
    if (!s->model->nx) return;
    mech_quintic(s, h);
    for (int i = first; i < s->ny; i++)
        k->out[i - first] =
            (c->b[0] + c->b_rest[0]) * s->dy[i] + (c->b[last] + c->b_rest[last]) * s->dy_new[i];
    for (int j = 1; j < last; j++) {
        mech_dense_at(s->dense, 6, s->ny, c->c[j], k->at);
        mech_rhs(s, t + c->c[j] * h, k->at, k->rates);
        for (int i = first; i < s->ny; i++) k->out[i - first] += (c->b[j] + c->b_rest[j]) * k->rates[i];
    }
    for (int i = first; i < s->ny; i++) {
        const mech_real change = k->x_rest[i - first] + h * k->out[i - first];
        s->y_new[i] = s->y[i] + change;
        k->x_rest[i - first] = (s->y[i] - s->y_new[i]) + change;
    }
}

static mech_real attempt(mech_solver *s, mech_real h, const lobatto *c)
{
    const arrays k = arrays_of(s, c);
    const int nv = s->model->nv, nc = s->model->n_velocity, last = c->stages - 1;
    for (int j = 0; j < c->stages; j++)
        for (int i = 0; i < nv; i++) k.v[j * nv + i] = s->y[nv + i] + c->c[j] * h * s->dy[nv + i];
    for (int i = 0; i < nv; i++) k.q[i] = s->y[i];
    /* The multipliers go on as they ended. */
    for (int j = 0; j < last - 1; j++)
        memcpy(k.lam + j * nc, k.lam + (last - 1) * nc, (size_t)nc * sizeof(mech_real));
    memcpy(k.lam + last * nc, k.lam, (size_t)nc * sizeof(mech_real));
    positions(s, c, &k, h);
    if (!converge(s, c, &k, h) || finish(s, c, &k, h)) {
        s->run->trouble = MECH_NOT_CONVERGED;
        return (mech_real)INFINITY;
    }
    mech_real check = 0;
    for (int i = 0; i < nv; i++) {
        const mech_real change = k.q_rest[i] + h * combine(c->b, c->b_rest, k.v, nv, i, c->stages);
        s->y_new[i] = s->y[i] + change;
        k.q_rest[i] = (s->y[i] - s->y_new[i]) + change;
        k.p[i] = k.p_new[i];
        check += s->y_new[i] + s->y_new[nv + i];
    }
    close_accounts(s, c, &k, h);
    return mech_finite(check) ? 0 : check;
}

#define LOBATTO(NAME, TABLEAU, ORDER, DOC)                                                                   \
    static size_t n_extra_##NAME(const mech_model *m)                                                        \
    {                                                                                                        \
        return n_numbers(TABLEAU.stages, m->nv, m->n_velocity, m->nx);                                       \
    }                                                                                                        \
    static void begin_##NAME(mech_solver *s, int fresh) { (void)fresh, begin(s, &TABLEAU); }                 \
    static mech_real attempt_##NAME(mech_solver *s, mech_real h) { return attempt(s, h, &TABLEAU); }         \
    const mech_method mech_##NAME = {                                                                        \
        .name = #NAME,                                                                                       \
        .doc = DOC,                                                                                          \
        .order = ORDER,                                                                                      \
        .n_dense = 6,                                                                                        \
        .lacks = lacks,                                                                                      \
        .n_extra = n_extra_##NAME,                                                                           \
        .begin = begin_##NAME,                                                                               \
        .gives_derivative = 1,                                                                               \
        .keeps_constraints = 1,                                                                              \
        .attempt = attempt_##NAME,                                                                           \
        .dense = mech_quintic,                                                                               \
    };

LOBATTO(rattle, RATTLE, 2, "RATTLE, of order 2, fixed step: symplectic, symmetric, keeps constraints")
LOBATTO(lobatto4, LOBATTO4, 4,
        "Lobatto IIIA - IIIB of order 4, fixed step: symplectic, symmetric, keeps constraints")
LOBATTO(lobatto6, LOBATTO6, 6,
        "Lobatto IIIA - IIIB of order 6, fixed step: symplectic, symmetric, keeps constraints")
