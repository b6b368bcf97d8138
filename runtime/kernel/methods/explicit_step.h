/* The functions of an explicit Runge-Kutta method, `attempt` and `dense`, made from TABLEAU (explicit.h). Its zeros, and
 * what lies behind its last stage, are gone when the compiler has seen them. SMALL_SIZES: with code for each small
 * number of states, which pays where the coefficients are many.
 */
#if defined(__GNUC__)
#define ALWAYS_INLINE static inline __attribute__((always_inline))
#else
#define ALWAYS_INLINE static inline
#endif

#define EACH_STAGE(DO) \
    DO(1) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7) DO(8) DO(9) DO(10) DO(11) DO(12) DO(13) DO(14) DO(15) DO(16)

/* The stages, from 1 on. The end of the step lies in dy_new and leaves its place to the state of the last one. */
#define PLACE(j) ((j) == TABLEAU.stages + 1 ? s->dy_new : s->work + ((j) - 2) * n)
#define STAGES_OF_THE_STEP                                                                                \
    {NULL,      s->dy,     PLACE(2),  PLACE(3),  PLACE(4),  PLACE(5),  PLACE(6),  PLACE(7), PLACE(8),     \
     PLACE(9),  PLACE(10), PLACE(11), PLACE(12), PLACE(13), PLACE(14), PLACE(15), PLACE(16)}

/* Element i of the sum of the first `last` stages k, each times its weight. */
ALWAYS_INLINE mech_real weighted(mech_real *const *k, int last, const mech_real *w, int i)
{
    mech_real sum = 0, equal = 0;
    int begun = 0;
#define TERM(j)                                                                  \
    if ((j) <= last && w[j] != 0) {                                              \
        equal = (j) > 1 && w[(j) - 1] == w[j] ? equal + k[j][i] : k[j][i];       \
        if ((j) == last || w[(j) + 1] != w[j]) {                                 \
            sum = begun ? sum + w[j] * equal : w[j] * equal;                     \
            begun = 1;                                                           \
        }                                                                        \
    }
    EACH_STAGE(TERM)
#undef TERM
    return sum;
}

/* Element i of the distance from the embedded solution of one that is the sum of stages, over h. */
ALWAYS_INLINE mech_real distance(mech_real *const *k, mech_real sum, int i)
{
#define TERM(j) \
    if ((j) <= TABLEAU.stages && TABLEAU.embedded[j] != 0) sum = sum - TABLEAU.embedded[j] * k[j][i];
    EACH_STAGE(TERM)
#undef TERM
    return sum;
}

/* With a constant n the loops unroll into straight lines. Vectors would be slower there: a derivative that was
   written number by number just before cannot be read as a vector without a stall. */
#define ATTEMPT attempt_small
#define LOOP
#define SUMS(a, b)
#include "explicit_attempt.h"

/* With many states vectors halve the time of the sums, where the build allows them. */
#define ATTEMPT attempt_large
#if defined(MECH_SIMD)
#define PRAGMA(text) _Pragma(#text)
#define LOOP _Pragma("omp simd")
#define SUMS(a, b) PRAGMA(omp simd reduction(+ : a, b))
#else
#define LOOP
#define SUMS(a, b)
#endif
#include "explicit_attempt.h"

#if defined(MECH_STATES) && MECH_STATES >= 2 && MECH_STATES <= 9
/* built for models of this many states alone */
static mech_real attempt(mech_solver *s, mech_real h) { return attempt_small(s, h, MECH_STATES); }
#elif defined(MECH_STATES)
static mech_real attempt(mech_solver *s, mech_real h) { return attempt_large(s, h, s->ny); }
#elif defined(SMALL_SIZES)
#define SIZED(N) static mech_real attempt_##N(mech_solver *s, mech_real h) { return attempt_small(s, h, N); }
SIZED(2)
SIZED(3)
SIZED(4)
SIZED(5)
SIZED(6)
SIZED(7)
SIZED(8)
SIZED(9)

static mech_real attempt(mech_solver *s, mech_real h)
{
    switch (s->ny) {
    case 2: return attempt_2(s, h);
    case 3: return attempt_3(s, h);
    case 4: return attempt_4(s, h);
    case 5: return attempt_5(s, h);
    case 6: return attempt_6(s, h);
    case 7: return attempt_7(s, h);
    case 8: return attempt_8(s, h);
    case 9: return attempt_9(s, h);
    default: return attempt_large(s, h, s->ny);
    }
}
#else
static mech_real attempt(mech_solver *s, mech_real h)
{
    return s->ny < 10 ? attempt_small(s, h, s->ny) : attempt_large(s, h, s->ny);
}
#endif

static void dense(mech_solver *s, mech_real h)
{
    const int n = s->ny, last = TABLEAU.stages + 1 + TABLEAU.further;
    const mech_real t = s->run->report.t;
    const mech_real *y = s->y;
    mech_real *const k[] = STAGES_OF_THE_STEP, *ys = s->work + (TABLEAU.stages + TABLEAU.further) * n;
#define STAGE(j)                                                                                   \
    if ((j) > TABLEAU.stages + 1 && (j) <= last) {                                                 \
        for (int i = 0; i < n; i++) ys[i] = y[i] + h * weighted(k, (j) - 1, TABLEAU.a[j], i);      \
        mech_rhs(s, t + TABLEAU.c[j] * h, ys, k[j]);                                               \
    }
    EACH_STAGE(STAGE)
#undef STAGE
    mech_hermite(s, h);
    mech_real *d = s->dense + 4 * n;
    for (int i = 0; i < n; i++) {
        if (TABLEAU.terms > 0) d[i] = h * weighted(k, last, TABLEAU.dense[0], i);
        if (TABLEAU.terms > 1) d[n + i] = h * weighted(k, last, TABLEAU.dense[1], i);
        if (TABLEAU.terms > 2) d[2 * n + i] = h * weighted(k, last, TABLEAU.dense[2], i);
        if (TABLEAU.terms > 3) d[3 * n + i] = h * weighted(k, last, TABLEAU.dense[3], i);
    }
}
