/* DOPRI5, as a table alone: a test adds it to the kernel.
 *
 * J. R. Dormand, P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comp. Appl. Math. 6, 1980; dense output
 * and bound of stiffness as in E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed.,
 * Springer 1993, section II.6.
 */
#include "explicit.h"

#define Q(numerator, denominator) (MECH_C(numerator) / MECH_C(denominator))

enum { STAGES = 6, TERMS = 1 };

static const mech_tableau TABLEAU = {
    .stages = STAGES,
    .terms = TERMS,
    .estimates = 1,
    .uses_end = 1,
    .over = 1,
    .c = {[2] = Q(1.0, 5.0), Q(3.0, 10.0), Q(4.0, 5.0), Q(8.0, 9.0), 1},
    .a = {[2] = {[1] = Q(1.0, 5.0)},
          [3] = {[1] = Q(3.0, 40.0), Q(9.0, 40.0)},
          [4] = {[1] = Q(44.0, 45.0), -Q(56.0, 15.0), Q(32.0, 9.0)},
          [5] = {[1] = Q(19372.0, 6561.0), -Q(25360.0, 2187.0), Q(64448.0, 6561.0), -Q(212.0, 729.0)},
          [6] = {[1] = Q(9017.0, 3168.0), -Q(355.0, 33.0), Q(46732.0, 5247.0), Q(49.0, 176.0),
                 -Q(5103.0, 18656.0)}},
    .b = {[1] = Q(35.0, 384.0), [3] = Q(500.0, 1113.0), Q(125.0, 192.0), -Q(2187.0, 6784.0), Q(11.0, 84.0)},
    .error = {[1] = Q(71.0, 57600.0), [3] = -Q(71.0, 16695.0), Q(71.0, 1920.0), -Q(17253.0, 339200.0),
              Q(22.0, 525.0), -Q(1.0, 40.0)},
    .dense = {{[1] = -Q(12715105075.0, 11282082432.0), [3] = Q(87487479700.0, 32700410799.0),
               -Q(10690763975.0, 1880347072.0), Q(701980252875.0, 199316789632.0), -Q(1453857185.0, 822651844.0),
               Q(69997945.0, 29380423.0)}},
};
#include "explicit_step.h"

const mech_method mech_dopri5 = {
    .name = "dopri5",
    .doc = "explicit Runge-Kutta of order 5 (Dormand, Prince), adaptive",
    .order = 5,
    .adaptive = 1,
    .error_order = 5,
    .factor_min = MECH_C(0.2),
    .factor_max = MECH_C(10.0),
    MECH_EXPLICIT(STAGES, 0, TERMS),
    .gives_derivative = 1,
    .stiffness = mech_explicit_stiffness,
    .stiffness_bound = MECH_C(3.25),
};
