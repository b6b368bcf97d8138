#include "event_state.h"

#include "crowd.h"

static int largest_act(const mech_hybrid *h, int base)
{
    int most = 0;
    for (int k = 0; k < h->n_branches; k++)
        if (h->branches[k].n_checks > most) most = h->branches[k].n_checks;
    return base + most;
}

/* Places one array after the other; without memory it only counts. */
static mech_real *take(mech_real **memory, size_t *total, int n)
{
    mech_real *place = *memory;
    *total += (size_t)n;
    if (place) *memory += n;
    return place;
}

static size_t arrange(mech_event_state *e, const mech_model *m, mech_real *memory)
{
    const mech_hybrid *h = m->hybrid;
    const mech_crowd *c = h->crowd;
    const int ny = m->nq + m->nv + m->nx, r = c ? MECH_MOST_ROWS : h->n_rows, n = h->n_switches + r;
    size_t total = 0;
    e->n = c ? h->n_switches : n;
    e->n_rows = c ? 0 : r;
    e->z = take(&memory, &total, m->nz + (c ? 3 * r : 0)); /* flags, signs, impulses of rows at hand behind it */
    e->w = take(&memory, &total, MECH_SAMPLES * n);
    e->rate = take(&memory, &total, MECH_SAMPLES * n);
    e->near = take(&memory, &total, h->narrow ? 3 * n : 0);
    e->near_rate = take(&memory, &total, h->narrow ? 3 * n : 0);
    e->scale = take(&memory, &total, n);
    e->rate_scale = take(&memory, &total, n);
    e->turned = take(&memory, &total, n);
    e->idle = take(&memory, &total, n);
    e->first_wait = take(&memory, &total, n);
    e->first_rate = take(&memory, &total, n);
    e->fresh = take(&memory, &total, n);
    e->row = take(&memory, &total, r * MECH_ROW_VALUES);
    e->gap_scale = take(&memory, &total, r);
    e->speed = take(&memory, &total, r);
    e->force = take(&memory, &total, r);
    e->sizes = take(&memory, &total, 2 * r);
    e->mobility = take(&memory, &total, r);
    e->response = take(&memory, &total, r * (m->nv + r));
    e->impulse = take(&memory, &total, r);
    e->change = take(&memory, &total, m->nv + r);
    e->matrix = take(&memory, &total, r * (r + 1));
    e->flags = take(&memory, &total, r);
    e->signs = take(&memory, &total, r);
    e->open = take(&memory, &total, r);
    e->slides = take(&memory, &total, r);
    e->last_hit = take(&memory, &total, r);
    e->delay = take(&memory, &total, r);
    e->held = take(&memory, &total, h->n_branches);
    e->held_new = take(&memory, &total, h->n_branches);
    e->act = take(&memory, &total, largest_act(h, ny + m->nz));
    e->y_at = take(&memory, &total, ny);
    e->move = take(&memory, &total, ny);
    e->driven = take(&memory, &total, ny);
    e->aside_at = take(&memory, &total, ny);
    e->correction = take(&memory, &total, m->nv);
    e->y_before = take(&memory, &total, ny);
    e->z_before = take(&memory, &total, m->nz);
    e->outputs = take(&memory, &total, m->n_outputs);
    e->times = take(&memory, &total, h->n_times + h->n_clocks);
    e->recent = take(&memory, &total, MECH_RECENT);
    e->jolted = take(&memory, &total, r || m->n_position || m->n_velocity ? ny : 0);
    e->counters = take(&memory, &total, MECH_COUNTERS);
    e->rows = h->rows;
    if (c) {
        e->places = (mech_row *)take(&memory, &total, r * (int)(sizeof(mech_row) / sizeof(mech_real) + 1));
        e->rows = e->places;
        e->window = take(&memory, &total, r);
        e->kept = take(&memory, &total, 2 * c->n * MECH_KEPT);
        e->wake = take(&memory, &total, c->n);
        e->values = take(&memory, &total, r * c->n_values);
        e->given = take(&memory, &total, m->nu + c->n_given);
        e->rates = take(&memory, &total, ny);
        e->forces = take(&memory, &total, MECH_CROWD_FORCES * r);
        e->first = (int *)take(&memory, &total, r);
    }
    return total;
}

size_t mech_event_state_numbers(const mech_model *model)
{
    mech_event_state nowhere;
    return arrange(&nowhere, model, NULL);
}

void mech_event_state_attach(mech_event_state *e, const mech_model *model, mech_real *memory)
{
    arrange(e, model, memory);
}
