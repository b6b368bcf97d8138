/* The tail of a Taylor series: its last orders in single precision, for all lanes at once.
 *
 * The last terms of a step have the size of the allowed error; each order before is larger by a factor that does not depend on the
 * tolerance. So ten orders need no more than seven digits. Coefficients are in units of a power of two close to the
 * step, so that they neither grow nor vanish with their order. Overflow in single precision is detected at the end of the step,
 * in double precision. Then the step is repeated without a tail, and a member with frequent repetitions continues
 * without one.
 *
 * Each lane chooses by its tolerance where its tail begins. Between the first and the last beginning, orders are computed in
 * both precisions and each lane uses its own: no bit depends on the other lanes.
 */
#ifndef MECH_LANE_TAIL_H
#define MECH_LANE_TAIL_H

typedef struct tail {
    S (*x)[N_ROWS], *kept, *p; /* what `series_next` takes and gives                        */
    S unit, later[N_BEHIND + 1];
    S weight[NY];              /* one over the error allowed                                */
    S wanted;                  /* the step that the last terms allow, in units              */
} tail;

/* A member of which a tail has spoiled more steps than these, and than a share of all, goes on without one. */
static MECH_FIXED double SPOILED_AT_FIRST = 4, SPOILED_SHARE = 0.05;

/* The last order of each lane before its tail, an even one, as sums of two orders are begun there. */
LANE V low_orders(const mech_lane_room *r, const V *held)
{
    const M whole = lane_set(r->after_rejection) | (held[SPOILED] > SPOILED_AT_FIRST + SPOILED_SHARE * AT(r->steps));
    return lane_pick(whole, lane(MOST + 1), held[LOW]);
}

LANE V coefficient(const work *w, const tail *s, const span *all, int k, int i)
{
    if (k <= all->first_low) return w->x[k][i];
    const V single = lane_widened(&s->x[k][i], w->room);
    return k > all->last_low ? single : lane_pick(w->low >= (double)k, w->x[k][i], single);
}

/* Enters what the rooms begin with. */
static void enter(tail *s, const mech_lane_room *r, const work *w, int first)
{
    const work *a = &w[0], *b = &w[GROUPS - 1];
    const V *pa = (const V *)r[0].p, *pb = (const V *)r[GROUPS - 1].p;
    for (int k = 1; k <= first; k++)
        for (int i = 0; i < (k == 1 ? NY : N_ROWS); i++) /* what stands behind the first order no sum reads */
            s->x[k][i] = lane_joined(a->x[k][i], b->x[k][i]);
    for (int i = 0; i < N_SERIES_KEPT; i++) s->kept[i] = lane_joined(a->held[NY + i], b->held[NY + i]);
    for (int i = 0; i < N_TAIL_P; i++) s->p[i] = lane_joined(pa[tail_p[i]], pb[tail_p[i]]);
    s->unit = lane_joined(a->unit, b->unit);
}

/* Puts zeros, or numbers of double precision, in row k of some lanes. */
static void put_row(tail *s, int room, M which, const V *from, int n, int k)
{
    for (int i = 0; i < n; i++)
        lane_narrow(&s->x[k][i], room, lane_pick(which, from ? from[i] : lane(0), lane_widened(&s->x[k][i], room)));
}

static void form_tail(const mech_lane_room *r, work *w, tail *s, const span *all)
{
    if (all->first_low >= all->most) return;
    s->x = (S(*)[N_ROWS])(w->x + MOST + 1);
    s->kept = (S *)(s->x + MOST + 1);
    s->p = s->kept + N_SERIES_KEPT;
    enter(s, r, w, all->first_low);
    for (int k = all->first_low; k < all->most; k++) {
        single_next_order(k, s->x[0], s->kept, s->p, s->unit, s->later);
        for (int g = 0; g < GROUPS && k < all->last_low; g++)
            put_row(s, g, w[g].low > (double)k, w[g].x[k + 1], N_ROWS, k + 1);
    }
    const S order = lane_joined(AT(r[0].order), AT(r[GROUPS - 1].order));
    s->wanted = single_suggested(s->x[0], s->weight, order, all->most, all->least);
    for (int k = all->least + 1; k <= all->most; k++)
        for (int g = 0; k > all->first_low && g < GROUPS; g++) put_row(s, g, AT(r[g].order) < (double)k, NULL, NY, k);
}

/* What the tail comes to at the end of the step. */
static void end_tail(work *w, const tail *s, const span *all)
{
    if (all->first_low >= all->most) return;
    const S h = lane_joined(w[0].step.h * w[0].over, w[GROUPS - 1].step.h * w[GROUPS - 1].over);
    S sum[NY], rate[NY];
    for (int i = 0; i < NY; i++) sum[i] = rate[i] = single(0);
    for (int k = all->most; k > all->first_low; k--) {
        for (int i = 0; i < NY; i++) {
            rate[i] = single_fma(rate[i], h, sum[i]);
            sum[i] = single_fma(sum[i], h, s->x[k][i]);
        }
        for (int g = 0; k <= all->last_low + 1 && g < GROUPS; g++) {
            const M here = w[g].low == (double)(k - 1);
            for (int i = 0; i < NY; i++) {
                const S so_far = sum[i], slope = rate[i]; /* only these are read by parts */
                w[g].sum[i] = lane_pick(here, lane_widened(&so_far, g), w[g].sum[i]);
                w[g].rate[i] = lane_pick(here, lane_widened(&slope, g), w[g].rate[i]);
            }
        }
    }
}

#endif
