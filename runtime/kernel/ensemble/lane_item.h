/* What generated lanes of one member end with: the kernel of a device, in OpenCL C, which takes each member of a list on by some
 * steps. Included behind the method.
 *
 * What is done between two steps is that of lane_members.c. The arrays are those of item_layout.h; `fixed`: parameters with hoisted
 * constants, discrete variables, inputs that are given; `rows` [n_grid][ny]; `times`: the grid, then the stops.
 */

#include "hits.h"
#include "item_layout.h"

enum {
    FIRST_Y = MECH_ITEM_SINGLES, FIRST_SUM = FIRST_Y + 2 * NY, FIRST_OWN = FIRST_SUM + N_KEPT,
    N_NUMBERS = FIRST_OWN + NY + N_HELD, N_FIXED = N_ALL + NZ + NU
};

__kernel void mech_item_sizes(__global int *sizes)
{
    sizes[0] = N_NUMBERS;
    sizes[1] = N_FIXED;
}

#if N_KEPT
typedef struct watch {
    const mech_lane_room *room;
    int n;
    double t, h, *samples, *sums;
    __global const int *kinds;
} watch;

static int kind_of(const watch *w, int k) { return w->kinds[k]; }

static double value_of(watch *w, int k, double s)
{
    V y[NY], out[N_KEPT];
    state_at(w->room, w->room->terms, s, y);
    kept_at(w->room, w->t + s * w->h, y, out);
    return out[k];
}

#include "reduce.h"
#endif

static void load(__global const double *from, uint first, int count, uint n, uint me, double *to)
{
    for (int i = 0; i < count; i++) to[i] = from[(first + (uint)i) * (size_t)n + me];
}

static void save(const double *from, uint first, int count, uint n, uint me, __global double *to)
{
    for (int i = 0; i < count; i++) to[(first + (uint)i) * (size_t)n + me] = from[i];
}

__kernel void mech_items(uint n, uint count, __global const uint *which, int attempts, __global double *numbers,
                         __global int *marks, __global const double *fixed, __global double *rows,
                         __global const double *times, int n_grid, int n_stops, double stop, double from,
                         __global const int *kinds, __global const uchar *inputs_given, int turns)
{
    if (get_global_id(0) >= count) return;
    const uint me = which[get_global_id(0)];
    double one[MECH_ITEM_SINGLES], y[NY], atol[NY], dy[NY], p[N_ALL + 1], z[NZ + 1], u[NU + 1], extra[N_EXTRA + 1];
    double dense[N_DENSE * NY], samples[MECH_LANE_SAMPLES * N_KEPT + 1], sums[N_KEPT + 1];
    double limit, next_row, step_from, step_h, stiffness;
    uchar given[NU + 1];
    int mark[MECH_ITEM_MARKS];
    load(numbers, 0, MECH_ITEM_SINGLES, n, me, one);
    load(numbers, FIRST_Y, NY, n, me, y);
    load(numbers, FIRST_Y + NY, NY, n, me, atol);
    load(numbers, FIRST_SUM, N_KEPT, n, me, sums);
    load(numbers, FIRST_OWN, NY, n, me, dy);
    load(numbers, FIRST_OWN + NY, N_HELD, n, me, extra);
    load(fixed, 0, N_ALL, n, me, p);
    load(fixed, N_ALL, NZ, n, me, z);
    load(fixed, N_ALL + NZ, NU, n, me, u);
    for (int i = 0; i < NU; i++) given[i] = inputs_given[i];
    for (int i = 0; i < MECH_ITEM_MARKS; i++) mark[i] = marks[i * (size_t)n + me];
    mech_lane_room r;
    r.t = &one[MECH_ITEM_T];
    r.rtol = &one[MECH_ITEM_RTOL];
    r.longest = &one[MECH_ITEM_LONGEST];
    r.most = &one[MECH_ITEM_MOST];
    r.steps = &one[MECH_ITEM_STEPS];
    r.dt = &one[MECH_ITEM_DT];
    r.error_old = &one[MECH_ITEM_ERROR_OLD];
    r.next_look = &one[MECH_ITEM_NEXT_LOOK];
    r.order = &one[MECH_ITEM_ORDER];
    r.limit = &limit;
    r.next_row = &next_row;
    r.from = &step_from;
    r.h = &step_h;
    r.stiffness = &stiffness;
    r.y = y;
    r.atol = atol;
    r.dy = dy;
    r.p = p;
    r.z = z;
    r.u = u;
    r.dense = dense;
    r.samples = samples;
    r.extra = extra;
    r.given = given;
    r.terms = N_DENSE;
    r.watched = N_KEPT > 0;
    r.alive = 1;
    r.after_rejection = (unsigned)mark[MECH_ITEM_REJECTED];
    mech_hits hits = {mark[MECH_ITEM_STIFF], mark[MECH_ITEM_CALM], one[MECH_ITEM_SINCE]};
    __global const double *stops = times + n_grid;
    int next_stop = 0, status = mark[MECH_ITEM_STATUS], row = mark[MECH_ITEM_ROWS];
    if (status == MECH_ITEM_FRESH) {
        one[MECH_ITEM_NEXT_LOOK] = LOOK_EVERY ? (double)LOOK_EVERY : (double)INFINITY;
        r.fresh = 1;
        begin(&r);
        status = r.troubled ? MECH_ITEM_TROUBLED : MECH_ITEM_RUNS;
    }
    for (int a = 0; a < attempts && status == MECH_ITEM_RUNS; a++) {
        while (next_stop < n_stops && stops[next_stop] <= *r.t) next_stop++;
        limit = next_stop < n_stops && stops[next_stop] < stop ? stops[next_stop] : stop;
        next_row = row < n_grid ? times[row] : (double)INFINITY;
        attempt(&r);
        if (r.troubled & 1) {
            status = MECH_ITEM_TROUBLED;
            break;
        }
        if (!(r.took & 1)) continue;
        if (r.looked & 1) {
            *r.next_look = mech_hit(&hits, stiffness > STIFFNESS_BOUND, step_from, *r.steps, (double)LOOK_EVERY);
            if (hits.stiff >= STIFF_HITS && turns) status = MECH_ITEM_TROUBLED;
        }
        for (; row < n_grid && times[row] <= *r.t; row++) {
            V there[NY];
            if (times[row] == *r.t) {
                for (int i = 0; i < NY; i++) there[i] = y[i];
            } else {
                state_at(&r, r.terms, (times[row] - step_from) / step_h, there);
            }
            save(there, (uint)row * NY, NY, n, me, rows);
        }
#if N_KEPT
        if (step_from >= from) {
            watch w = {&r, N_KEPT, step_from, step_h, samples, sums, kinds};
            reduce(&w);
        }
#endif
        if (status == MECH_ITEM_TROUBLED) break;
        if (*r.t == stop) status = MECH_ITEM_REACHED;
        else if (r.full & 1) status = MECH_ITEM_FULL;
    }
    one[MECH_ITEM_SINCE] = hits.since;
    mark[MECH_ITEM_STATUS] = status;
    mark[MECH_ITEM_ROWS] = row;
    mark[MECH_ITEM_STIFF] = hits.stiff;
    mark[MECH_ITEM_CALM] = hits.calm;
    mark[MECH_ITEM_REJECTED] = (int)(r.after_rejection & 1);
    save(one, 0, MECH_ITEM_SINGLES, n, me, numbers);
    save(y, FIRST_Y, NY, n, me, numbers);
    save(sums, FIRST_SUM, N_KEPT, n, me, numbers);
    save(dy, FIRST_OWN, NY, n, me, numbers);
    save(extra, FIRST_OWN + NY, N_HELD, n, me, numbers);
    for (int i = 0; i < MECH_ITEM_MARKS; i++) marks[i * (size_t)n + me] = mark[i];
}
