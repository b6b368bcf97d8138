/* The number of one member on a device, in OpenCL C 1.2: what lane_vectors.h is to processors.
 *
 * Operations of doubles are rounded as on processors, fused ones too: both give the same bits. In M the lowest bit counts.
 * The functions that lanes take from the C library are those of the device, with the errors that OpenCL allows.
 */
#ifndef MECH_ITEM_NUMBERS_H
#define MECH_ITEM_NUMBERS_H

#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#pragma OPENCL FP_CONTRACT OFF

/* in the place of model.h and real.h, which are for machines with a C library */
#define MECH_MODEL_H
#define MECH_REAL_H
#define MECH_C(literal) literal
#define MECH_EPSILON DBL_EPSILON
#define MECH_FIXED __constant
#define mech_abs fabs
#define mech_min(a, b) ((a) < (b) ? (a) : (b))
#define mech_max(a, b) ((a) > (b) ? (a) : (b))
#define mech_log log
#define mech_pow pow
#define mech_floor floor
#define mech_finite(x) ((x) - (x) == 0)
typedef double mech_real;

#include "lanes.h"

#define LANE static inline
#define LANE_TWICE
#define LANE_BITS(hex) hex##L
#define LANE_OF(x, l) x
#define LANE_RARELY(x) (x)
#define LANE_FUSED 1
#define MECH_LANE_WIDTH 1
#ifndef NULL
#define NULL 0
#endif

enum { WIDTH = 1 };
typedef double V;
typedef long M;
enum { PAIRED = 1 };
typedef float S;
typedef int SM;
LANE SM single_raw(S x) { return as_int(x); }
LANE S single_value(SM m) { return as_float(m); }
LANE S single_pick(SM m, S a, S b) { return m & 1 ? a : b; }
LANE S single(double x) { return (float)x; }
LANE void lane_narrow(S *to, int room, V from) { *to = (float)from; }
LANE S lane_joined(V a, V b) { return (float)a; }
LANE V lane_widened(const S *from, int room) { return *from; }
LANE S single_fma(S a, S b, S c) { return fma(a, b, c); }
LANE S single_fnma(S a, S b, S c) { return fma(-a, b, c); }
LANE M lane_raw(V x) { return as_long(x); }
LANE V lane_value(M m) { return as_double(m); }
LANE V lane(double x) { return x; }
LANE M lane_all(M m) { return -(m & 1); }
LANE V lane_number(M m) { return (V)(m & 1); }
LANE V lane_pick(M m, V a, V b) { return m & 1 ? a : b; }
LANE V lane_fma(V a, V b, V c) { return fma(a, b, c); }
LANE V lane_fnma(V a, V b, V c) { return fma(-a, b, c); }
LANE V lane_sqrt(V a) { return sqrt(a); }
LANE unsigned lane_bits(M m) { return (unsigned)(m & 1); }
LANE M lane_set(unsigned bits) { return (M)(bits & 1); }

#endif
