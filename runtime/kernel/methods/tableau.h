/* An explicit Runge-Kutta method as data. */
#ifndef MECH_TABLEAU_H
#define MECH_TABLEAU_H

#include "real.h"

/* Qualifies constants in memory; devices have a word of their own for it. */
#ifndef MECH_FIXED
#define MECH_FIXED const
#endif

enum { MECH_MOST_WEIGHTS = 16, MECH_MOST_TERMS = 4 };

/* By the number of the stage, from 1 on. */
typedef mech_real mech_weights[MECH_MOST_WEIGHTS + 2];

/* Stage 1 is the derivative at the beginning of the step, stage `stages` + 1 that at its end; `further` ones behind
 * it serve the dense output. */
typedef struct mech_tableau {
    int stages, further, terms;
    int estimates;            /* of the error: 0, 1, or 2 that are combined as those of DOP853   */
    int uses_end;             /* the estimate takes the derivative at the end                    */
    mech_real over;           /* what b is divided by                                            */
    mech_weights c, a[MECH_MOST_WEIGHTS + 2];
    mech_weights b;           /* neighbours that are equal are added before they are weighted    */
    mech_weights error;       /* of the first estimate                                           */
    mech_weights embedded;    /* of another solution, whose distance is the second estimate      */
    mech_weights dense[MECH_MOST_TERMS]; /* `terms` coefficients behind the first four, over h   */
    mech_real dense_share;    /* of the last of them: the error between the ends                 */
} mech_tableau;

#endif
