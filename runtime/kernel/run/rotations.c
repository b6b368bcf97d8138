/* Unit length of the rotations in a state (model.h, point 12). */
#include "solver.h"

/* What rounding leaves of the square of the length stays, so that all who do this twice, or once, have the same numbers: each of
 * the four is off by 3/2 eps at most, their squares and sums by 2 eps more. */
#define ROUNDING (4 * MECH_EPSILON)

void mech_normalise(const mech_model *model, mech_real *y)
{
    for (int k = 0; k < model->n_rotations; k++) {
        mech_real *e = y + model->rotations[k];
        const mech_real square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3];
        if (mech_abs(square - 1) <= ROUNDING) continue;
        const mech_real factor = 1 / mech_sqrt(square);
        for (int i = 0; i < 4; i++) e[i] *= factor;
    }
}
