#include "near_rows.h"

#include <string.h>

#include "envelope.h"

enum { CHANGES_PER_ROW = 20, MOST_DROPS = 3 };

/* Rows that are moved so little apart from others are left to these where gaps and rates are mended: what is left of a gap by
 * rounding and tolerances would else move bodies by a million times as much. */
static const mech_real MENDED = MECH_C(1e-6);

static mech_real response(const mech_solver *s, int i, int j)
{
    const int nv = s->model->nv;
    return s->events->response[j * (nv + s->events->n_rows) + nv + i];
}

/* Factors of the rows in `set`, in the memory for matrices. */
typedef struct factors {
    int n, rank, first[MECH_MOST_ROWS], at[MECH_MOST_ROWS];
    mech_real d[MECH_MOST_ROWS], *a;
} factors;

static void factorise(mech_solver *s, int n, const int *set, mech_real share, factors *f)
{
    const int *reach = s->events->first;
    f->n = n;
    f->a = s->events->matrix;
    for (int i = 0, low = 0; i < n; i++) {
        while (low > 0 && set[low - 1] >= reach[set[i]]) low--;
        while (low < i && set[low] < reach[set[i]]) low++;
        f->first[i] = low;
    }
    mech_envelope_places(n, f->first, f->at);
    for (int i = 0; i < n; i++) {
        for (int j = f->first[i]; j < i; j++) f->a[f->at[i] + j] = response(s, set[i], set[j]);
        f->d[i] = response(s, set[i], set[i]);
    }
    f->rank = mech_envelope_factor(n, f->first, f->at, share, f->a, f->d);
}

int mech_near_rows_solve(mech_solver *s, int n, const int *set, const mech_real *target, mech_real *x)
{
    factors f;
    factorise(s, n, set, MENDED, &f);
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
    factorise(s, n, rows, p->share, f);
    return n;
}

/* x of the rows that are in; those that depend on others leave, and, `strict`, those that pull. Gives whether all stay.
 * `dropped` counts how often a row depended. */
static int solve_active(mech_solver *s, mech_near_rows_problem *p, int strict, int *dropped)
{
    int of[MECH_MOST_ROWS], all = 1;
    mech_real x[MECH_MOST_ROWS];
    factors f;
    const int n = active(s, p, of, &f);
    for (int k = 0; k < n; k++) x[k] = -p->q[of[k]];
    mech_envelope_solve(n, f.first, f.at, f.a, f.d, x);
    for (int k = 0; k < p->n; k++) p->x[k] = 0;
    for (int k = 0; k < n; k++) {
        p->x[of[k]] = x[k];
        if (f.d[k] == 0) {
            p->in[of[k]] = 0;
            dropped[of[k]]++;
        }
        if (f.d[k] == 0 || !strict || p->held[of[k]] || !(x[k] < -p->weak[of[k]])) continue;
        p->in[of[k]] = all = 0;
    }
    return all;
}

/* W x + q of row k of the problem. */
static mech_real gap_rate(const mech_solver *s, const mech_near_rows_problem *p, int k)
{
    const int *reach = s->events->first;
    mech_real sum = p->q[k];
    for (int j = k; j >= 0 && p->set[j] >= reach[p->set[k]]; j--)
        if (p->x[j] != 0) sum += response(s, p->set[k], p->set[j]) * p->x[j];
    for (int j = k + 1; j < p->n; j++)
        if (p->x[j] != 0 && reach[p->set[j]] <= p->set[k]) sum += response(s, p->set[k], p->set[j]) * p->x[j];
    return sum;
}

enum { WITHOUT_END, CAME_IN, DEPENDS };

/* Brings row `enters` in, which is violated: its own x grows until it no longer is, those that come to zero meanwhile leave
 * (D. Goldfarb, A. Idnani 1983). DEPENDS where those that are in decide over it, and none of them gives way: then what it
 * lacks is rounding. */
static int enter(mech_solver *s, mech_near_rows_problem *p, int enters, int *changes)
{
    const int sign = gap_rate(s, p, enters) < 0 ? 1 : -1;
    for (;;) {
        int of[MECH_MOST_ROWS], leaves = -1;
        mech_real r[MECH_MOST_ROWS];
        factors f;
        const int n = active(s, p, of, &f), row = p->set[enters];
        const mech_real own = response(s, row, row);
        mech_real bend = own, step = (mech_real)INFINITY;
        for (int k = 0; k < n; k++) r[k] = response(s, row, p->set[of[k]]);
        mech_envelope_solve(n, f.first, f.at, f.a, f.d, r);
        for (int k = 0; k < n; k++) {
            bend -= r[k] * response(s, row, p->set[of[k]]);
            const int gives_way = sign * r[k] > 0 && !p->held[of[k]];
            const mech_real until = gives_way ? mech_max(p->x[of[k]], 0) / (sign * r[k]) : (mech_real)INFINITY;
            if (until < step) {
                step = until;
                leaves = k;
            }
        }
        const mech_real rate = -sign * gap_rate(s, p, enters);
        const mech_real whole = bend > p->share * own ? rate / bend : (mech_real)INFINITY;
        if (whole <= step && mech_finite(whole)) {
            p->in[enters] = 1;
            return CAME_IN;
        }
        if (leaves < 0) return DEPENDS;
        if (--*changes < 0) return WITHOUT_END;
        for (int k = 0; k < n; k++) p->x[of[k]] -= sign * step * r[k];
        p->x[enters] += sign * step;
        p->x[of[leaves]] = 0;
        p->in[of[leaves]] = 0;
    }
}

int mech_near_rows_complement(mech_solver *s, mech_near_rows_problem *p)
{
    int changes = CHANGES_PER_ROW * (p->n + 5), dropped[MECH_MOST_ROWS] = {0};
    while (!solve_active(s, p, 1, dropped));
    for (;;) {
        int worst = -1;
        mech_real most = 0;
        for (int k = 0; k < p->n; k++) {
            if (p->in[k] || dropped[k] >= MOST_DROPS) continue;
            const mech_real rate = gap_rate(s, p, k), lacks = (p->held[k] ? mech_abs(rate) : -rate) - p->slack[k];
            if (lacks > most) {
                most = lacks;
                worst = k;
            }
        }
        if (worst < 0) return 1;
        const int found = --changes < 0 ? WITHOUT_END : enter(s, p, worst, &changes);
        if (found == WITHOUT_END) return 0;
        if (found == DEPENDS) dropped[worst] = MOST_DROPS;
        solve_active(s, p, 0, dropped);
    }
}
