/* DOP853: explicit Runge-Kutta method of order 8 for problems that are not stiff.
 *
 * E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993,
 * section II.5 (method, error estimate), II.6 (dense output), IV.2 of volume II (detection of stiffness).
 */
#include "dop853_tableau.h"
#include "hermite.h"

#if defined(__GNUC__)
#define ALWAYS_INLINE static inline __attribute__((always_inline))
#else
#define ALWAYS_INLINE static inline
#endif

/* One stage: the state ys[i], then its derivative. `h` times the sum, so that small numbers add first. */
#define STAGE(c, k, sum)                                      \
    LOOP                                                      \
    for (int i = 0; i < n; i++) ys[i] = y[i] + h * (sum);     \
    mech_rhs(s, t + (c) * h, ys, k);

/* With a constant n the loops unroll into straight lines. Vectors would be slower there: a derivative that was
   written number by number just before cannot be read as a vector without a stall. */
#define ATTEMPT attempt_small
#define LOOP
#define SUMS(a, b)
#include "dop853_attempt.h"

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
#include "dop853_attempt.h"

#define LOOP

#if defined(MECH_STATES) && MECH_STATES >= 2 && MECH_STATES <= 9
/* built for models of this many states alone */
static mech_real attempt_any(mech_solver *s, mech_real h) { return attempt_small(s, h, MECH_STATES); }
#elif defined(MECH_STATES)
static mech_real attempt_any(mech_solver *s, mech_real h) { return attempt_large(s, h, s->ny); }
#else
#define SIZED(N) static mech_real attempt_##N(mech_solver *s, mech_real h) { return attempt_small(s, h, N); }
SIZED(2)
SIZED(3)
SIZED(4)
SIZED(5)
SIZED(6)
SIZED(7)
SIZED(8)
SIZED(9)

static mech_real attempt_any(mech_solver *s, mech_real h)
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
#endif

/* The last stage and the new state are two nearby points at t + h: the ratio of the differences of derivative
   and state bounds the dominant eigenvalue from below. */
static mech_real stiffness(mech_solver *s, mech_real h)
{
    const int n = s->ny;
    const mech_real *k12 = s->work + 10 * n, *ys = s->work + 11 * n;
    mech_real numerator = 0, denominator = 0;
    for (int i = 0; i < n; i++) {
        mech_real scale = s->o.atol[i] + s->o.rtol * mech_abs(s->y_new[i]);
        mech_real a = (s->dy_new[i] - k12[i]) / scale, b = (s->y_new[i] - ys[i]) / scale;
        numerator += a * a;
        denominator += b * b;
    }
    return denominator > 0 ? h * mech_sqrt(numerator / denominator) : 0;
}

static void dense(mech_solver *s, mech_real h)
{
    const int n = s->ny;
    const mech_real t = s->run->report.t;
    const mech_real *y = s->y, *k1 = s->dy, *k13 = s->dy_new;
    mech_real *w = s->work;
    const mech_real *k6 = w + 4 * n, *k7 = w + 5 * n, *k8 = w + 6 * n, *k9 = w + 7 * n, *k10 = w + 8 * n;
    const mech_real *k11 = w + 9 * n, *k12 = w + 10 * n;
    /* what the last stage left behind k12 stays there for `stiffness` */
    mech_real *k14 = w + 12 * n, *k15 = w + 13 * n, *k16 = w + 14 * n, *ys = w + 15 * n;

    STAGE(c14, k14,
          a1401 * k1[i] + a1407 * k7[i] + a1408 * k8[i] + a1409 * k9[i] + a1410 * k10[i] + a1411 * k11[i] +
              a1412 * k12[i] + a1413 * k13[i])
    STAGE(c15, k15,
          a1501 * k1[i] + a1506 * k6[i] + a1507 * k7[i] + a1508 * k8[i] + a1511 * k11[i] + a1512 * k12[i] +
              a1513 * k13[i] + a1514 * k14[i])
    STAGE(c16, k16,
          a1601 * k1[i] + a1606 * k6[i] + a1607 * k7[i] + a1608 * k8[i] + a1609 * k9[i] + a1613 * k13[i] +
              a1614 * k14[i] + a1615 * k15[i])

    mech_hermite(s, h);
    mech_real *d4 = s->dense + 4 * n, *d5 = d4 + n, *d6 = d5 + n, *d7 = d6 + n;
#define DENSE(r)                                                                                          \
    h * (d##r##01 * k1[i] + d##r##06 * k6[i] + d##r##07 * k7[i] + d##r##08 * k8[i] + d##r##09 * k9[i] +   \
         d##r##10 * k10[i] + d##r##11 * k11[i] + d##r##12 * k12[i] + d##r##13 * k13[i] +                  \
         d##r##14 * k14[i] + d##r##15 * k15[i] + d##r##16 * k16[i])
    for (int i = 0; i < n; i++) {
        d4[i] = DENSE(4);
        d5[i] = DENSE(5);
        d6[i] = DENSE(6);
        d7[i] = DENSE(7);
    }
}

/* The last term is at most d7 / 256, and three to five times the error of the polynomial (measured on y' = z y for
   all z in the domain of stability). */
static mech_real dense_error(const mech_solver *s)
{
    const int n = s->ny;
    const mech_real *d7 = s->dense + 7 * n, share = MECH_C(1.0) / (3 * 256);
    mech_real sum = 0;
    for (int i = 0; i < n; i++) {
        const mech_real scale = s->o.atol[i] + s->o.rtol * mech_max(mech_abs(s->y[i]), mech_abs(s->y_new[i]));
        const mech_real x = d7[i] * share / scale;
        sum += x * x;
    }
    return mech_sqrt(sum / n);
}

const mech_method mech_dop853 = {
    .name = "dop853",
    .doc = "explicit Runge-Kutta of order 8 (Dormand, Prince), adaptive",
    .order = 8,
    .adaptive = 1,
    .n_stages = 11,
    .n_work = 16,
    .n_dense = 8,
    .error_order = 8,
    .factor_min = MECH_C(0.333),
    .factor_max = MECH_C(6.0),
    .attempt = attempt_any,
    .stiffness = stiffness,
    .stiffness_bound = MECH_C(6.1), /* where the domain of stability meets the real axis */
    .dense = dense,
    .dense_error = dense_error,
};
