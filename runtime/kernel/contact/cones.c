/* Solvers of the contact problem (cones.h).
 *
 * Gauss-Seidel: M. Jean (1999). ADMM with the shift of de Saxce's form taken from the last iterate, and its penalty adapted:
 * J. Carpentier, Q. Le Lidec, L. Montaut (2024). Newton's method on the natural map, which is not smooth, with a damping
 * that vanishes like the residual: it converges fast where solutions are not isolated, too (N. Yamashita, M. Fukushima 2001).
 */
#include "cones.h"

#include <string.h>

#include "linear.h"
#include "orthogonal.h"

enum { MOST_STEPS = 40, FIRST_ROUND = 20, ROUNDS = 10, MOST_ROOTS = 80, HALVES = 12 };

static mech_real size2(int n, const mech_real *x)
{
    return n == 0 ? 0 : n == 1 ? mech_abs(x[0]) : mech_sqrt(x[0] * x[0] + x[1] * x[1]);
}

/* The inverse mass of a cone: the mean of its diagonal entries, by which its rates and impulses are compared. */
static mech_real mobility(const mech_cones *c, const mech_cone *k)
{
    mech_real sum = 0;
    for (int i = k->at; i < k->at + mech_cone_rows(k); i++) sum += c->w[(size_t)i * c->n + i];
    return sum > 0 ? sum / mech_cone_rows(k) : 1;
}

/* p: the nearest point of the set to z; derivative d[3][3], where not NULL. */
static void project(const mech_cone *k, mech_real coefficient, const mech_real *z, mech_real *p, mech_real *d)
{
    const int n = mech_cone_rows(k), first = k->kind == MECH_CONE, slips = k->slips;
    const mech_real mu = coefficient;
    if (d) memset(d, 0, 9 * sizeof(mech_real));
    memcpy(p, z, (size_t)n * sizeof(mech_real));
    for (int i = 0; d && i < n; i++) d[4 * i] = 1;
    if (k->kind == MECH_CONE_HELD) return;
    const mech_real *zt = z + first, t = size2(slips, zt);
    if (k->kind == MECH_CONE_DISC) {
        if (t <= mu) return;
        for (int i = 0; i < slips; i++) p[i] = mu * zt[i] / t;
        for (int i = 0; d && i < slips; i++)
            for (int j = 0; j < slips; j++) d[3 * i + j] = mu / t * ((i == j) - zt[i] * zt[j] / (t * t));
        return;
    }
    if (mu > 0 && t <= mu * z[0]) return; /* inside */
    if (d) memset(d, 0, 9 * sizeof(mech_real));
    if (mu == 0 || !slips) { /* a half line */
        p[0] = mech_max(0, z[0]);
        for (int i = 1; i < n; i++) p[i] = 0;
        if (d) d[0] = z[0] > 0;
        return;
    }
    if (mu * t <= -z[0]) {
        for (int i = 0; i < n; i++) p[i] = 0;
        return;
    }
    const mech_real c = 1 / (1 + mu * mu), pn = c * (z[0] + mu * t);
    mech_real along[3] = {1, 0, 0};
    p[0] = pn;
    for (int i = 0; i < slips; i++) {
        along[1 + i] = mu * zt[i] / t;
        p[1 + i] = along[1 + i] * pn;
    }
    for (int i = 0; d && i < n; i++)
        for (int j = 0; j < n; j++) {
            d[3 * i + j] = c * along[i] * along[j];
            if (i && j) d[3 * i + j] += mu * pn / t * ((i == j) - zt[i - 1] * zt[j - 1] / (t * t));
        }
}

/* The natural map of a cone: r - P(r - (u + mu |u_t| n) / m), m its mobility; the argument of P in z. */
static void natural_map(const mech_cone *k, const mech_real *r, const mech_real *u, mech_real m, mech_real *z, mech_real *map)
{
    const int n = mech_cone_rows(k);
    for (int i = 0; i < n; i++) z[i] = r[i] - u[i] / m;
    if (k->kind == MECH_CONE) z[0] -= k->coefficient * size2(k->slips, u + 1) / m;
    project(k, k->coefficient, z, map, NULL);
    for (int i = 0; i < n; i++) map[i] = r[i] - map[i];
}

mech_real mech_cone_residual(const mech_cone *k, mech_real m, const mech_real *r, const mech_real *u)
{
    mech_real z[3], map[3], sum = 0;
    natural_map(k, r, u, m, z, map);
    for (int i = 0; i < mech_cone_rows(k); i++) sum += map[i] * map[i];
    return m * mech_sqrt(sum);
}

int mech_cones_check(mech_cones *c)
{
    int solved = 1;
    mech_real furthest = -1;
    for (int i = 0; i < c->n; i++) {
        mech_real sum = c->q[i];
        for (int j = 0; j < c->n; j++) sum += c->w[(size_t)i * c->n + j] * c->r[j];
        c->u[i] = sum;
    }
    c->residual = 0;
    c->worst = -1;
    for (int a = 0; a < c->n_cones; a++) {
        const mech_cone *k = &c->cones[a];
        const mech_real sum = mech_cone_residual(k, mobility(c, k), c->r + k->at, c->u + k->at);
        if (!(sum <= k->slack)) solved = 0;
        if (sum > c->residual) c->residual = sum;
        const mech_real part = k->slack > 0 ? sum / k->slack : sum;
        if (!(part <= furthest)) {
            furthest = part;
            c->worst = a;
        }
        if (!mech_finite(sum)) {
            c->residual = sum;
            return 0;
        }
    }
    return solved;
}

/* ---- one cone ---------------------------------------------------------------------------------------------------- */

/* t = -(S + lambda)^+ c for S[2][2] of n rows, and its slope by lambda. */
static void give_way(int n, const mech_real *s, const mech_real *c, mech_real lambda, mech_real *t, mech_real *slope)
{
    mech_real scale = s[0] + (n > 1 ? s[3] : 0);
    if (n == 1) {
        const mech_real d = s[0] + lambda;
        t[0] = d > 0 ? -c[0] / d : 0;
        slope[0] = d > 0 ? -t[0] / d : 0;
        return;
    }
    const mech_real a = s[0] + lambda, d = s[3] + lambda, b = s[1], det = a * d - b * b;
    if (det > MECH_C(1e-13) * (scale + lambda) * (scale + lambda)) {
        t[0] = -(d * c[0] - b * c[1]) / det;
        t[1] = -(a * c[1] - b * c[0]) / det;
        slope[0] = -(d * t[0] - b * t[1]) / det;
        slope[1] = -(a * t[1] - b * t[0]) / det;
        return;
    }
    /* nothing moves along one direction */
    mech_real x[2] = {s[0] >= s[3] ? s[0] : b, s[0] >= s[3] ? b : s[3]}, length = size2(2, x);
    const mech_real along = length > 0 ? (c[0] * x[0] + c[1] * x[1]) / (length * (scale + lambda)) : 0;
    for (int i = 0; i < 2; i++) {
        t[i] = length > 0 ? -along * x[i] / length : 0;
        slope[i] = -t[i] / (scale + lambda);
    }
}

/* r of one cone for u = W r + q: open, else it sticks, else it slides, -u_t = lambda r_t: a root of |r_t| - limit. */
void mech_cone_solve(const mech_cone *k, const mech_real *w, const mech_real *q, mech_real *r)
{
    const int n = mech_cone_rows(k), slips = k->slips, first = k->kind == MECH_CONE;
    if (k->kind == MECH_CONE_HELD) {
        r[0] = w[0] > 0 ? -q[0] / w[0] : 0;
        return;
    }
    for (int i = 0; i < n; i++) r[i] = 0;
    if (first && (q[0] >= 0 || !(w[0] > 0))) return;
    if (first) r[0] = -q[0] / w[0];
    if (!slips || (first && k->coefficient == 0)) return;
    /* r_n = free + side r_t: without the normal row S = W_tt - W_tn W_nt / W_nn */
    mech_real s[4], c[2], side[2] = {0, 0};
    const mech_real mu = first ? k->coefficient : 0, radius = first ? 0 : k->coefficient, free_ = first ? r[0] : 0;
    for (int i = 0; i < slips; i++) {
        const mech_real *row = w + 3 * (i + first), own = first ? row[0] / w[0] : 0;
        for (int j = 0; j < slips; j++) s[2 * i + j] = row[j + first] - (first ? own * w[1 + j] : 0);
        c[i] = q[i + first] - (first ? own * q[0] : 0);
        side[i] = first ? -w[1 + i] / w[0] : 0;
    }
    mech_real low = 0, high = (mech_real)INFINITY, lambda = 0, scale = s[0] + (slips > 1 ? s[3] : 0);
    if (!(scale > 0)) scale = first ? w[0] : 1;
    for (int step = 0; step < MOST_ROOTS; step++) {
        mech_real t[2] = {0, 0}, slope[2] = {0, 0}, normal = free_, rise = 0, change = 0;
        give_way(slips, s, c, lambda, t, slope);
        for (int i = 0; i < slips; i++) {
            normal += side[i] * t[i];
            change += side[i] * slope[i];
        }
        const mech_real length = size2(slips, t), limit = mu * normal + radius, f = length - limit;
        for (int i = 0; i < slips; i++) rise += length > 0 ? t[i] * slope[i] / length : 0;
        if (first) r[0] = normal;
        for (int i = 0; i < slips; i++) r[first + i] = t[i];
        if (step == 0 && f <= 0) break; /* sticks */
        if (mech_abs(f) <= 4 * MECH_EPSILON * (length + mu * mech_abs(normal))) break;
        if (f > 0)
            low = lambda;
        else
            high = lambda;
        /* Newton's method on limit / |r_t| - 1, nearly a straight line: one where S is a number and slip moves no gap */
        const mech_real grows = mu * change * length - limit * rise;
        mech_real next = grows > 0 ? lambda + f * length / grows : (mech_real)INFINITY;
        if (!(next > low && next < high)) next = high < (mech_real)INFINITY ? (low + high) / 2 : 4 * (lambda + scale);
        if (next == lambda) break;
        lambda = next;
    }
    if (first) r[0] = mech_max(0, r[0]);
    const mech_real limit = first ? mu * r[0] : radius, length = size2(slips, r + first);
    for (int i = 0; length > limit && i < slips; i++) r[first + i] *= limit / length;
}

int mech_cones_sweep(mech_cones *c, int most, mech_real *room)
{
    const int n = c->n;
    mech_real *u = room;
    if (mech_cones_check(c)) return 1;
    for (int sweep = 0; sweep < most; sweep++) {
        const int back = sweep % 2; /* to and fro: no side comes first */
        int rests = 1;
        memcpy(u, c->u, (size_t)n * sizeof(mech_real));
        for (int a = 0; a < c->n_cones; a++) {
            const mech_cone *k = &c->cones[back ? c->n_cones - 1 - a : a];
            const int m = mech_cone_rows(k);
            mech_real w[9], q[3], r[3], *own = c->r + k->at;
            for (int i = 0; i < m; i++) {
                q[i] = u[k->at + i];
                for (int j = 0; j < m; j++) {
                    w[3 * i + j] = c->w[(size_t)(k->at + i) * n + k->at + j];
                    q[i] -= w[3 * i + j] * own[j];
                }
            }
            mech_cone_solve(k, w, q, r);
            for (int j = 0; j < m; j++) {
                const mech_real change = r[j] - own[j];
                own[j] = r[j];
                if (change == 0) continue;
                rests &= mech_abs(change) * w[4 * j] <= k->slack / 4;
                for (int i = 0; i < n; i++) u[i] += change * c->w[(size_t)i * n + k->at + j];
            }
        }
        c->sweeps++;
        if ((rests || sweep % 8 == 7 || sweep + 1 == most) && mech_cones_check(c)) return 1;
        if (!rests && sweep % 8 != 7) memcpy(c->u, u, (size_t)n * sizeof(mech_real));
    }
    return mech_cones_check(c);
}

/* ---- Newton's method ---------------------------------------------------------------------------------------------- */

/* F[n], natural maps times the root of the mobility, of the present r; its square. `jacobian` [n][n] by the impulses over
 * the same root, where not NULL. */
static mech_real maps(const mech_cones *c, mech_real *f, mech_real *jacobian)
{
    const int n = c->n;
    mech_real sum = 0;
    for (int a = 0; a < c->n_cones; a++) {
        const mech_cone *k = &c->cones[a];
        const int m = mech_cone_rows(k), first = k->kind == MECH_CONE;
        const mech_real mass = mobility(c, k), root = mech_sqrt(mass);
        mech_real z[3], map[3], p[3], d[9];
        natural_map(k, c->r + k->at, c->u + k->at, mass, z, map);
        for (int i = 0; i < m; i++) {
            f[k->at + i] = root * map[i];
            sum += f[k->at + i] * f[k->at + i];
        }
        if (!jacobian) continue;
        project(k, k->coefficient, z, p, d);
        const mech_real *ut = c->u + k->at + 1, slip = first ? size2(k->slips, ut) : 0;
        for (int j = 0; j < n; j++) {
            mech_real by[3]; /* of z */
            for (int i = 0; i < m; i++) by[i] = (k->at + i == j) - c->w[(size_t)(k->at + i) * n + j] / mass;
            for (int i = 0; first && slip > 0 && i < k->slips; i++)
                by[0] -= k->coefficient * ut[i] / slip * c->w[(size_t)(k->at + 1 + i) * n + j] / mass;
            for (int i = 0; i < m; i++) {
                mech_real entry = k->at + i == j;
                for (int l = 0; l < m; l++) entry -= d[3 * i + l] * by[l];
                jacobian[(size_t)(k->at + i) * n + j] = root * entry;
            }
        }
        (void)p;
    }
    return sum;
}

static void set_rates(mech_cones *c)
{
    for (int i = 0; i < c->n; i++) {
        mech_real sum = c->q[i];
        for (int j = 0; j < c->n; j++) sum += c->w[(size_t)i * c->n + j] * c->r[j];
        c->u[i] = sum;
    }
}

int mech_cones_refine(mech_cones *c, mech_real *room)
{
    const int n = c->n;
    mech_real *f = room, *d = f + n, *r0 = d + n, *root = r0 + n, *right = root + n, *jacobian = right + 2 * n;
    mech_orthogonal q = {.a = jacobian + (size_t)n * n};
    q.head = q.a + 2 * (size_t)n * n;
    q.order = (int *)(q.head + n);
    for (int a = 0; a < c->n_cones; a++)
        for (int i = 0; i < mech_cone_rows(&c->cones[a]); i++)
            root[c->cones[a].at + i] = mech_sqrt(mobility(c, &c->cones[a]));
    set_rates(c);
    for (int step = 0; step < MOST_STEPS; step++) {
        const mech_real before = maps(c, f, jacobian);
        if (!mech_finite(before)) return 0;
        if (before == 0) break;
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) jacobian[(size_t)i * n + j] /= root[j];
        mech_real scale = 0;
        for (int i = 0; i < n; i++) scale = mech_max(scale, mech_abs(root[i] * c->r[i]) + mech_abs(c->q[i] / root[i]));
        /* the least |J d + F|^2 + damping |d|^2, by columns of 2 n rows */
        const mech_real share = scale > 0 ? mech_min(1, mech_sqrt(before) / scale) : 0;
        memset(q.a, 0, 2 * (size_t)n * n * sizeof(mech_real));
        for (int j = 0; j < n; j++) {
            mech_real *column = q.a + 2 * (size_t)n * j;
            for (int i = 0; i < n; i++) column[i] = jacobian[(size_t)i * n + j];
            column[n + j] = MECH_C(1e-12) + MECH_C(0.1) * share;
        }
        for (int i = 0; i < n; i++) {
            right[i] = -f[i];
            right[n + i] = 0;
        }
        c->factors++;
        q.rows = 2 * n;
        q.cols = n;
        mech_orthogonalise(&q, 0);
        mech_least_squares(&q, right, d);
        memcpy(r0, c->r, (size_t)n * sizeof(mech_real));
        mech_real part = 1, after = before;
        int half = 0;
        for (; half < HALVES; half++, part /= 2) {
            for (int i = 0; i < n; i++) c->r[i] = r0[i] + part * d[i] / root[i];
            set_rates(c);
            after = maps(c, f, NULL);
            if (after < before * (1 - MECH_C(1e-4) * part)) break;
        }
        if (half == HALVES) {
            memcpy(c->r, r0, (size_t)n * sizeof(mech_real));
            break;
        }
        if (after <= 16 * MECH_EPSILON * MECH_EPSILON * scale * scale) break;
        if (after > before / 4 && mech_cones_check(c)) return 1; /* rounding */
    }
    return mech_cones_check(c);
}

/* ---- alternating directions --------------------------------------------------------------------------------------- */

size_t mech_cones_room(int n)
{
    const size_t m = (size_t)n;
    return 3 * m * m + 14 * m + mech_integers(n);
}

int mech_cones_solve(mech_cones *c, mech_real *room)
{
    const int n = c->n;
    mech_real *best = room, *root = best + n, *x = root + n, *y = x + n, *z = y + n, *s = z + n, *y0 = s + n;
    mech_real *newton = y0 + n, *a = newton, least = (mech_real)INFINITY, largest = 0;
    int *pivot = (int *)(a + (size_t)n * n), factored = 0;
    memset(c->r, 0, (size_t)n * sizeof(mech_real));
    if (mech_cones_check(c) || !n) return 1;
    for (int k = 0; k < c->n_cones; k++)
        for (int i = 0; i < mech_cone_rows(&c->cones[k]); i++) root[c->cones[k].at + i] = mech_sqrt(mobility(c, &c->cones[k]));
    for (int i = 0; i < n; i++) {
        mech_real sum = 0;
        for (int j = 0; j < n; j++) sum += mech_abs(c->w[(size_t)i * n + j]) / (root[i] * root[j]);
        largest = mech_max(largest, sum);
    }
    memset(x, 0, (size_t)n * sizeof(mech_real));
    memset(y, 0, (size_t)n * sizeof(mech_real));
    memset(z, 0, (size_t)n * sizeof(mech_real));
    memset(s, 0, (size_t)n * sizeof(mech_real));
    memcpy(best, c->r, (size_t)n * sizeof(mech_real));
    const mech_real ease = MECH_C(1e-6) * largest;
    mech_real penalty = largest / 10;
    for (int round = 0, steps = FIRST_ROUND; round < ROUNDS; round++, steps *= 2) {
        for (int step = 0; step < steps; step++) {
            if (!factored) {
                for (int i = 0; i < n; i++)
                    for (int j = 0; j < n; j++)
                        a[(size_t)i * n + j] = c->w[(size_t)i * n + j] / (root[i] * root[j]) + (i == j ? penalty + ease : 0);
                c->factors++;
                if (mech_factorise(n, a, pivot)) return 0;
                factored = 1;
            }
            mech_real primal = 0, dual = 0;
            for (int i = 0; i < n; i++) x[i] = -(c->q[i] / root[i] + s[i]) + ease * x[i] + penalty * y[i] + z[i];
            mech_solve(n, a, pivot, x);
            memcpy(y0, y, (size_t)n * sizeof(mech_real));
            for (int k = 0; k < c->n_cones; k++) {
                const mech_cone *cone = &c->cones[k];
                mech_real at[3];
                for (int i = 0; i < mech_cone_rows(cone); i++) at[i] = x[cone->at + i] - z[cone->at + i] / penalty;
                /* of a disc, whose radius is an impulse, in the unit of y */
                const mech_real own = cone->kind == MECH_CONE_DISC ? cone->coefficient * root[cone->at] : cone->coefficient;
                project(cone, own, at, y + cone->at, NULL);
            }
            for (int i = 0; i < n; i++) {
                z[i] -= penalty * (x[i] - y[i]);
                primal = mech_max(primal, mech_abs(x[i] - y[i]));
                dual = mech_max(dual, penalty * mech_abs(y[i] - y0[i]));
            }
            for (int k = 0; k < c->n_cones; k++)
                if (c->cones[k].kind == MECH_CONE)
                    s[c->cones[k].at] = c->cones[k].coefficient * size2(c->cones[k].slips, z + c->cones[k].at + 1);
            c->sweeps++;
            if (step % 20 != 19) continue;
            const mech_real ratio = primal / (dual + MECH_C(1e-300));
            if (ratio > 10 || ratio < MECH_C(0.1)) {
                penalty *= mech_min(10, mech_max(MECH_C(0.1), mech_sqrt(ratio)));
                factored = 0;
            }
        }
        for (int i = 0; i < n; i++) c->r[i] = y[i] / root[i];
        int solved = mech_cones_check(c);
        if (mech_finite(c->residual) && c->residual < least) {
            least = c->residual;
            memcpy(best, c->r, (size_t)n * sizeof(mech_real));
        }
        factored = 0; /* the room of the factors is Newton's, too */
        solved = mech_cones_refine(c, newton);
        if (solved) return 1;
        if (mech_finite(c->residual) && c->residual < least) {
            least = c->residual;
            memcpy(best, c->r, (size_t)n * sizeof(mech_real));
        }
    }
    memcpy(c->r, best, (size_t)n * sizeof(mech_real));
    return mech_cones_check(c);
}
