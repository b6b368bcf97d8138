/* Explicit Runge-Kutta methods: what is common to all of them, and, as data, what tells one from another.
 *
 * A method is a constant TABLEAU, explicit_step.h included behind it, which makes the functions of the method with all
 * coefficients in sight of the compiler, and its struct.
 *
 * E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993,
 * section II.4 (error estimates), II.6 (dense output), IV.2 of volume II (detection of stiffness).
 */
#ifndef MECH_EXPLICIT_H
#define MECH_EXPLICIT_H

#include "hermite.h"
#include "tableau.h"

/* What the struct of a method has from its tableau, of which the numbers are constants. Arrays in work: the stages but
 * the first, the state of the last one, the further stages, and a state for these. */
#define MECH_EXPLICIT(STAGES, FURTHER, TERMS)                                      \
    .n_stages = (STAGES) - 1, .n_work = (STAGES) + (FURTHER) + ((FURTHER) > 0),    \
    .n_dense = 4 + (TERMS), .tableau = &TABLEAU, .attempt = attempt, .dense = dense

/* Of method.h, where the last stage is at the end of the step. It and the new state are two nearby points: the ratio
 * of the differences of derivative and state bounds the dominant eigenvalue from below. */
mech_real mech_explicit_stiffness(mech_solver *s, mech_real h);

/* Of method.h, by `dense_share`. */
mech_real mech_explicit_dense_error(const mech_solver *s);

#endif
