/* The number type of the kernel, and the few functions of it that the kernel calls.
 *
 * MECH_REAL is double unless a build says otherwise. A build in higher precision defines MECH_REAL and
 * one of MECH_QUAD (libquadmath) or MECH_LONG (long double), and compiles the same sources.
 */
#ifndef MECH_REAL_H
#define MECH_REAL_H

#include "model.h"

#include <math.h>

#if defined(MECH_QUAD)
#include <quadmath.h>
#define MECH_C(literal) literal##Q
#define MECH_EPSILON FLT128_EPSILON
#define mech_sqrt sqrtq
#define mech_pow powq
#define mech_abs fabsq
#define mech_floor floorq
#define mech_sin sinq
#define mech_cos cosq
#define mech_atan2 atan2q
#define mech_exp expq
#define mech_log logq
#elif defined(MECH_LONG)
#include <float.h>
#define MECH_C(literal) literal##L
#define MECH_EPSILON LDBL_EPSILON
#define mech_sqrt sqrtl
#define mech_pow powl
#define mech_abs fabsl
#define mech_floor floorl
#define mech_sin sinl
#define mech_cos cosl
#define mech_atan2 atan2l
#define mech_exp expl
#define mech_log logl
#else
#include <float.h>
#define MECH_C(literal) literal
#define MECH_EPSILON DBL_EPSILON
#define mech_sqrt sqrt
#define mech_pow pow
#define mech_abs fabs
#define mech_floor floor
#define mech_sin sin
#define mech_cos cos
#define mech_atan2 atan2
#define mech_exp exp
#define mech_log log
#endif

static inline mech_real mech_min(mech_real a, mech_real b) { return a < b ? a : b; }
static inline mech_real mech_max(mech_real a, mech_real b) { return a > b ? a : b; }

/* Infinity minus itself is not-a-number, and not-a-number equals nothing. */
static inline int mech_finite(mech_real x) { return x - x == 0; }

#endif
