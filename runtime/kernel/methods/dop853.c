/* DOP853: explicit Runge-Kutta method of order 8 for problems that are not stiff. */
#include "explicit.h"
#include "dop853_tableau.h"
#define SMALL_SIZES
#include "explicit_step.h"

const mech_method mech_dop853 = {
    .name = "dop853",
    .doc = "explicit Runge-Kutta of order 8 (Dormand, Prince), adaptive",
    .order = 8,
    .adaptive = 1,
    .error_order = 8,
    .factor_min = MECH_C(0.333),
    .factor_max = MECH_C(6.0),
    MECH_EXPLICIT(STAGES, FURTHER, TERMS),
    .stiffness = mech_explicit_stiffness,
    .stiffness_bound = MECH_C(6.1), /* where the domain of stability meets the real axis */
    .dense_error = mech_explicit_dense_error,
};
