/* The classical Runge-Kutta method of order 4 with a fixed step; dense output by cubic Hermite interpolation.
 *
 * W. Kutta, Beitrag zur naeherungsweisen Integration totaler Differentialgleichungen, 1901.
 */
#include "explicit.h"

enum { STAGES = 4 };

static const mech_tableau TABLEAU = {
    .stages = STAGES,
    .over = 6,
    .c = {[2] = MECH_C(0.5), MECH_C(0.5), 1},
    .a = {[2] = {[1] = MECH_C(0.5)}, [3] = {[2] = MECH_C(0.5)}, [4] = {[3] = 1}},
    .b = {[1] = 1, 2, 2, 1},
};
#include "explicit_step.h"

const mech_method mech_rk4 = {
    .name = "rk4",
    .doc = "classical Runge-Kutta of order 4, fixed step",
    .order = 4,
    MECH_EXPLICIT(STAGES, 0, 0),
};
