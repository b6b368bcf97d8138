/* What is kept of a member, formed while it runs. */
#include <string.h>

#include "inputs.h"
#include "member.h"

typedef struct mech_watch {
    mech_room *room;
    int n;                       /* kept numbers                                    */
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
    return (size_t)(m->nq + m->nv + m->nx + m->nu + m->n_outputs) + (size_t)e->n_kept * (MECH_LANE_SAMPLES + 1);
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
    w->room = r;
    w->n = e->n_kept;
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

/* Reads all quantities at the place s of the step. */
static void look(mech_room *r, mech_real s)
{
    watch *w = r->watch;
    mech_dense_beside(w->dense, w->n_dense, r->e->model->nq + r->e->model->nv + r->e->model->nx, w->width, w->plain, s, w->y);
    mech_normalise(r->e->model, w->y);
    if (w->n_outputs) mech_member_outputs(r, w->t + s * w->h, w->y, w->z, w->u, w->out);
}

static int kind_of(const watch *w, int k) { return w->room->e->kept[k].kind; }

static mech_real value_of(watch *w, int k, mech_real s)
{
    look(w->room, s);
    return value(&w->room->e->kept[k], w->y, w->z, w->out);
}

#include "reduce.h"

void mech_dense_beside(const mech_real *c, int n_dense, int ny, int width, int plain, mech_real s, mech_real *y)
{
    const mech_real r = plain ? s : 1 - s;
    for (int i = 0; i < ny; i++) {
        mech_real sum = c[((n_dense - 1) * ny + i) * width];
        for (int k = n_dense - 2; k >= 0; k--) sum = c[(k * ny + i) * width] + (k % 2 ? r : s) * sum;
        y[i] = sum;
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
    reduce(w);
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
    reduce(w);
}

mech_real *mech_watch_sums(const mech_room *r) { return r->watch->sums; }

void mech_watch_jump(mech_room *r, mech_real t, const mech_real *y, const mech_real *z)
{
    const mech_ensemble *e = r->e;
    watch *w = r->watch;
    if (t < w->from) return;
    if (w->n_outputs) mech_member_outputs(r, t, y, z, w->u, w->out);
    for (int k = 0; k < e->n_kept; k++) {
        const mech_kept *kept = &e->kept[k];
        if (!flows(kept->kind) || kept->kind == MECH_MEAN) continue;
        const mech_real x = upright(kept->kind, value(kept, y, z, w->out));
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
            out[k] = upright(kept->kind, w->sums[k]);
            break;
        default:
            out[k] = w->sums[k];
        }
    }
}
