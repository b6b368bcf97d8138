/* Orders of a Taylor series, included once for each precision: N is V (one room) or S (all rooms), OF(name) and NUMBER are the
 * functions of it. `series_next`, the sides of slots and their groups are those of the model (compiler/targets/lane_series.py).
 *
 * Row k of the coefficients begins with those of order k of the state, behind which stand those of order k - 1 of the sides of the
 * slots that are not states.
 */

/* Of some slots, the sums of A_j B_(k-j) for j from 1 to k - 1. For even k those of the next order are begun with them, as each
 * number that is read serves both, and completed by their first and last product when that comes. */
LANE void OF(products)(int from, int count, int k, const N *x, N *restrict out, N *restrict later)
{
    MECH_FIXED int *a = first_side + from, *b = second_side + from;
    const N *first = x + N_ROWS, *last = x + (k - 1) * N_ROWS, zero = NUMBER(0);
    out += from, later += from;
    if (k % 2) {
#define END(s) \
    if (s < count) out[s] = k > 1 ? OF(fma)(first[a[s]], last[b[s]], OF(fma)(last[a[s]], first[b[s]], later[s])) : zero;
        EACH_SLOT(END)
        return;
    }
    N sum[GROUP] = {0}, next[GROUP] = {0}, before[GROUP] = {0};
    LANE_TWICE
    for (int j = 1; j < k; j++) {
        const N *xa = x + j * N_ROWS, *xb = x + (k - j) * N_ROWS;
#define TERM(s)                                                     \
    if (s < count) {                                                \
        next[s] = OF(fma)(xa[a[s]], before[s], next[s]);            \
        sum[s] = OF(fma)(xa[a[s]], xb[b[s]], sum[s]);               \
        before[s] = xb[b[s]];                                       \
    }
        EACH_SLOT(TERM)
    }
#define PUT(s) \
    if (s < count) out[s] = sum[s], later[s] = next[s];
    EACH_SLOT(PUT)
#undef END
#undef TERM
#undef PUT
}

/* The same of A_j A_(k-j): twice the first half, and for even k the square in the middle. */
LANE void OF(squares)(int from, int count, int k, const N *x, N *restrict out, N *restrict later)
{
    MECH_FIXED int *a = first_side + from;
    const N *first = x + N_ROWS, *last = x + (k - 1) * N_ROWS, zero = NUMBER(0), two = NUMBER(2);
    out += from, later += from;
    if (k % 2) {
#define END(s) \
    if (s < count) out[s] = k > 1 ? OF(fma)(first[a[s]], last[a[s]], later[s]) * two : zero;
        EACH_SLOT(END)
        return;
    }
    N sum[GROUP] = {0}, next[GROUP] = {0}, before[GROUP];
#define BEGIN(s) \
    if (s < count) before[s] = first[a[s]];
    EACH_SLOT(BEGIN)
    for (int j = 2; 2 * j <= k; j++) {
        const N *xa = x + j * N_ROWS, *xb = x + (k + 1 - j) * N_ROWS;
#define TERM(s)                                             \
    if (s < count) {                                        \
        sum[s] = OF(fma)(before[s], xb[a[s]], sum[s]);      \
        before[s] = xa[a[s]];                               \
        next[s] = OF(fma)(before[s], xb[a[s]], next[s]);    \
    }
        EACH_SLOT(TERM)
    }
#define PUT(s) \
    if (s < count) out[s] = OF(fma)(before[s], before[s], sum[s] * two), later[s] = next[s];
    EACH_SLOT(PUT)
#undef END
#undef BEGIN
#undef TERM
#undef PUT
}

#define GROUP_OF(number, kind, from, count)                                                                 \
    static NOINLINE void OF(sums_##number)(int k, const N *x, N *restrict out, N *restrict later)           \
    {                                                                                                       \
        OF(kind)(from, count, k, x, out, later);                                                            \
    }
SERIES_GROUPS(GROUP_OF)
#undef GROUP_OF

/* From order k to the next one, in units of time. */
LANE void OF(next_order)(int k, N *x, const N *kept, const N *p, N unit, N *later)
{
    N sums[N_BEHIND + 3];
#define ADD_UP(number, kind, from, count) OF(sums_##number)(k, x, sums, later);
    SERIES_GROUPS(ADD_UP)
#undef ADD_UP
    sums[N_BEHIND] = NUMBER(1.0 / k);
    sums[N_BEHIND + 1] = k == 1 ? unit : NUMBER(0);
    sums[N_BEHIND + 2] = unit * NUMBER(1.0 / (k + 1));
    OF(series_next)(NUMBER(k), x + k * N_ROWS, sums, kept, p, x + (k + 1) * N_ROWS);
}

/* The longest step over which none of the last terms is larger than an error allowed, in units. Lanes have different orders. */
LANE N OF(suggested)(const N *x, const N *weight, N order, int most, int least)
{
    N power = NUMBER(INFINITY); /* logarithms: one power serves all */
    for (int k = most; k > least - LAST; k--) {
        N size = NUMBER(0);
        for (int i = 0; i < NY; i++) size = OF(larger)(size, OF(abs)(x[k * N_ROWS + i]) * weight[i]);
        const MASK counts =
            (order >= NUMBER(k)) & (order < NUMBER(k + LAST)) & OF(finite)(size) & (size > NUMBER(0));
        power = OF(pick)(counts, OF(smaller)(power, OF(rough_log2)(size) * NUMBER(-1.0 / k)), power);
    }
    return OF(rough_exp2)(power);
}

#undef N
#undef MASK
#undef OF
#undef NUMBER
