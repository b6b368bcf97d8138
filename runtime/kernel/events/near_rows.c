#include "near_rows.h"

#include <string.h>

#include "envelope.h"

enum { CHANGES_PER_ROW = 20 };

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

static void factorise(mech_solver *s, int n, const int *set, factors *f)
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
    f->rank = mech_envelope_factor(n, f->first, f->at, f->a, f->d);
}

int mech_near_rows_solve(mech_solver *s, int n, const int *set, const mech_real *target, mech_real *x)
{
    factors f;
    factorise(s, n, set, &f);
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
    if (!mech_envelope_row(n, basis->first, basis->at, a, basis->pivot)) return 0;
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
    factorise(s, n, rows, f);
    return n;
}

/* x of the rows that are in; those that depend on others leave, and, `strict`, those that pull. Gives whether all stay. */
static int solve_active(mech_solver *s, mech_near_rows_problem *p, int strict)
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
        if (f.d[k] == 0) p->in[of[k]] = 0;
        if (f.d[k] == 0 || !strict || !(x[k] < -p->weak[of[k]])) continue;
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

/* Brings row `enters` in, which is violated: its own x grows until it no longer is, those that come to zero meanwhile leave
 * (D. Goldfarb, A. Idnani 1983). 0 where it would grow without end. */
static int enter(mech_solver *s, mech_near_rows_problem *p, int enters, int *changes)
{
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
            const mech_real until = r[k] > 0 ? mech_max(p->x[of[k]], 0) / r[k] : (mech_real)INFINITY;
            if (until < step) {
                step = until;
                leaves = k;
            }
        }
        const mech_real rate = gap_rate(s, p, enters);
        const mech_real whole = bend > MECH_DEPENDENT * own ? -rate / bend : (mech_real)INFINITY;
        if (whole <= step) {
            p->in[enters] = 1;
            return 1;
        }
        if (leaves < 0 || --*changes < 0) return 0;
        for (int k = 0; k < n; k++) p->x[of[k]] -= step * r[k];
        p->x[enters] += step;
        p->x[of[leaves]] = 0;
        p->in[of[leaves]] = 0;
    }
}

int mech_near_rows_complement(mech_solver *s, mech_near_rows_problem *p)
{
    int changes = CHANGES_PER_ROW * (p->n + 5);
    while (!solve_active(s, p, 1));
    for (;;) {
        int worst = -1;
        mech_real most = 0;
        for (int k = 0; k < p->n; k++) {
            const mech_real lacks = p->in[k] ? 0 : -gap_rate(s, p, k) - p->slack[k];
            if (lacks > most) {
                most = lacks;
                worst = k;
            }
        }
        if (worst < 0) return 1;
        if (--changes < 0 || !enter(s, p, worst, &changes)) return 0;
        solve_active(s, p, 0);
    }
}
