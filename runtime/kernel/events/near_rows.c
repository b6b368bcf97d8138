#include "near_rows.h"

#include <string.h>

#include "envelope.h"

enum { CHANGES_PER_ROW = 20, PASSES = 2 };

/* Rows that are moved so little apart from others are left to these where gaps and rates are mended: what is left of a gap by
 * rounding and tolerances would else move bodies by a million times as much. */
static const mech_real MENDED = MECH_C(1e-6);

/* Share of what is to be taken away that may be left where forces of rows that give way grow: more of it has no solution. */
static const mech_real LEFT = MECH_C(1e-3);

/* Of two rows that move each other alike. */
static mech_real response(const mech_solver *s, int i, int j)
{
    const int nv = s->model->nv;
    return s->events->response[i * (nv + s->events->n_rows) + nv + j];
}

/* Factors of the rows in `set`, in the memory for matrices. */
typedef struct factors {
    int n, rank, first[MECH_MOST_ROWS], at[MECH_MOST_ROWS];
    mech_real d[MECH_MOST_ROWS], *a;
} factors;

/* Of each row in `set` the first there that moves it. */
static void find_first(const mech_solver *s, int n, const int *set, int *first)
{
    const int *reach = s->events->first;
    for (int i = 0, low = 0; i < n; i++) {
        while (low > 0 && set[low - 1] >= reach[set[i]]) low--;
        while (low < i && set[low] < reach[set[i]]) low++;
        first[i] = low;
    }
}

static void factorise(mech_solver *s, int n, const int *set, mech_real share, mech_real ease, factors *f)
{
    f->n = n;
    f->a = s->events->matrix;
    find_first(s, n, set, f->first);
    mech_envelope_places(n, f->first, f->at);
    for (int i = 0; i < n; i++) {
        for (int j = f->first[i]; j < i; j++) f->a[f->at[i] + j] = response(s, set[i], set[j]);
        f->d[i] = (1 + ease) * response(s, set[i], set[i]);
    }
    f->rank = mech_envelope_factor(n, f->first, f->at, share, f->a, f->d);
}

int mech_near_rows_solve(mech_solver *s, int n, const int *set, const mech_real *target, mech_real *x)
{
    factors f;
    factorise(s, n, set, MENDED, 0, &f);
    memcpy(x, target, (size_t)n * sizeof(mech_real));
    mech_envelope_solve(n, f.first, f.at, f.a, f.d, x);
    return f.rank;
}

int mech_near_rows_add(mech_solver *s, mech_near_rows_basis *basis, int i)
{
    const int n = basis->n;
    mech_real *a = s->events->matrix;
    basis->row[n] = i;
    basis->first[n] = n;
    for (int k = n - 1; k >= 0; k--) {
        const mech_real part = response(s, i, basis->row[k]);
        a[n * (n - 1) / 2 + k] = part;
        if (part != 0) basis->first[n] = k;
    }
    basis->at[n] = n * (n - 1) / 2;
    basis->pivot[n] = response(s, i, i);
    if (!mech_envelope_row(n, basis->first, basis->at, MECH_DEPENDENT, a, basis->pivot)) return 0;
    basis->n = n + 1;
    return 1;
}

/* The system of the rows that are in; gives how many there are, `of` which. */
static int active(mech_solver *s, const mech_near_rows_problem *p, int *of, factors *f)
{
    int rows[MECH_MOST_ROWS], n = 0;
    for (int k = 0; k < p->n; k++)
        if (p->in[k]) {
            rows[n] = p->set[k];
            of[n++] = k;
        }
    factorise(s, n, rows, 0, MECH_EASE, f);
    return n;
}

/* x of the rows that are in; `strict`: those that do not press leave. Gives whether all stay. */
static int solve_active(mech_solver *s, mech_near_rows_problem *p, int strict)
{
    int of[MECH_MOST_ROWS], all = 1;
    mech_real x[MECH_MOST_ROWS];
    factors f;
    const int n = active(s, p, of, &f);
    for (int k = 0; k < n; k++) x[k] = -p->q[of[k]];
    mech_envelope_solve(n, f.first, f.at, f.a, f.d, x);
    memset(p->x, 0, (size_t)p->n * sizeof(mech_real));
    for (int k = 0; k < n; k++) {
        p->x[of[k]] = x[k];
        if (strict && !p->held[of[k]] && x[k] <= p->weak[of[k]]) p->in[of[k]] = all = 0;
    }
    return all;
}

/* W x + q of all rows, W with what they give way by. */
static void find_rates(const mech_solver *s, const mech_near_rows_problem *p, const int *first, mech_real *rate)
{
    for (int k = 0; k < p->n; k++) {
        const mech_real x = p->x[k];
        mech_real sum = p->q[k] + (1 + MECH_EASE) * response(s, p->set[k], p->set[k]) * x;
        for (int j = first[k]; j < k; j++) {
            const mech_real part = response(s, p->set[k], p->set[j]);
            sum += part * p->x[j];
            rate[j] += part * x;
        }
        rate[k] = sum;
    }
}

/* Brings row `enters` in, which is violated by `lacks`: its own x grows until it no longer is, those that come to zero meanwhile
 * leave (D. Goldfarb, A. Idnani 1983). 0 where that does not end. */
static int enter(mech_solver *s, mech_near_rows_problem *p, int enters, mech_real lacks, int *changes)
{
    const int sign = lacks > 0 ? 1 : -1, row = p->set[enters];
    mech_real rate = mech_abs(lacks);
    for (;;) {
        int of[MECH_MOST_ROWS], leaves = -1;
        mech_real r[MECH_MOST_ROWS], bend = (1 + MECH_EASE) * response(s, row, row), step = (mech_real)INFINITY;
        const mech_real least = MECH_EASE / 2 * bend;
        factors f;
        const int n = active(s, p, of, &f);
        for (int k = 0; k < n; k++) r[k] = response(s, row, p->set[of[k]]);
        mech_envelope_solve(n, f.first, f.at, f.a, f.d, r);
        for (int k = 0; k < n; k++) {
            bend -= r[k] * response(s, row, p->set[of[k]]);
            if (!(sign * r[k] > 0) || p->held[of[k]]) continue;
            const mech_real until = mech_max(p->x[of[k]], 0) / (sign * r[k]);
            if (until < step) {
                step = until;
                leaves = k;
            }
        }
        bend = mech_max(bend, least); /* but for rounding */
        if (leaves < 0 || rate <= step * bend) {
            p->in[enters] = 1;
            return 1;
        }
        if (--*changes < 0) return 0;
        for (int k = 0; k < n; k++) p->x[of[k]] -= sign * step * r[k];
        p->x[enters] += sign * step;
        rate -= step * bend;
        p->x[of[leaves]] = 0;
        p->in[of[leaves]] = 0;
    }
}

/* Solves the problem whose rows give way, from those that are in. */
static int complement(mech_solver *s, mech_near_rows_problem *p, const int *first)
{
    int changes = CHANGES_PER_ROW * (p->n + 5);
    mech_real rate[MECH_MOST_ROWS];
    while (!solve_active(s, p, 1));
    for (;;) {
        int worst = -1;
        mech_real most = 0;
        find_rates(s, p, first, rate);
        for (int k = 0; k < p->n; k++) {
            const mech_real lacks = (p->held[k] ? mech_abs(rate[k]) : -rate[k]) - p->slack[k];
            if (p->in[k] || !(lacks > most)) continue;
            most = lacks;
            worst = k;
        }
        if (worst < 0) return 1;
        if (--changes < 0 || !enter(s, p, worst, -rate[worst], &changes)) return 0;
        solve_active(s, p, 0);
    }
}

int mech_near_rows_complement(mech_solver *s, mech_near_rows_problem *p)
{
    int first[MECH_MOST_ROWS], solved = 1;
    mech_real q[MECH_MOST_ROWS], before[MECH_MOST_ROWS], largest = 0;
    memcpy(q, p->q, (size_t)p->n * sizeof(mech_real));
    memset(p->x, 0, (size_t)p->n * sizeof(mech_real));
    find_first(s, p->n, p->set, first);
    for (int k = 0; k < p->n; k++) largest = mech_max(largest, mech_abs(q[k]));
    for (int pass = 0; solved && pass < PASSES; pass++) {
        memcpy(before, p->x, (size_t)p->n * sizeof(mech_real));
        for (int k = 0; k < p->n; k++) p->q[k] = q[k] - MECH_EASE * response(s, p->set[k], p->set[k]) * p->x[k];
        solved = complement(s, p, first);
    }
    memcpy(p->q, q, (size_t)p->n * sizeof(mech_real));
    for (int k = 0; solved && k < p->n; k++)
        solved = MECH_EASE * response(s, p->set[k], p->set[k]) * mech_abs(p->x[k] - before[k]) <= 100 * p->slack[k] + LEFT * largest;
    return solved;
}
