/* The contact problem of cones.h, for a test. */
#include <stdlib.h>
#include <string.h>

#include "cones.h"
#include "solver.h"

/* cones: [n_cones][3] kind, first row, slips; numbers: [n_cones][2] coefficient, slack; how: 0 solve, 1 sweep from r, 2 check r.
 * report: residual, sweeps, factors. Gives whether it is solved. */
MECH_API int cones(int n, int n_cones, const int *kinds, const double *numbers, const double *w, const double *q, int how,
                   int most, double *r, double *u, double *report)
{
    mech_cone *list = malloc((size_t)(n_cones + 1) * sizeof *list);
    double *room = malloc(mech_cones_room(n) * sizeof(double));
    for (int k = 0; k < n_cones; k++)
        list[k] = (mech_cone){kinds[3 * k], kinds[3 * k + 1], kinds[3 * k + 2], numbers[2 * k], numbers[2 * k + 1]};
    mech_cones c = {.n = n, .n_cones = n_cones, .cones = list, .w = w, .q = q, .r = r, .u = u};
    const int solved = how == 0 ? mech_cones_solve(&c, room) : how == 1 ? mech_cones_sweep(&c, most, room) : mech_cones_check(&c);
    report[0] = c.residual;
    report[1] = c.sweeps;
    report[2] = c.factors;
    free(room);
    free(list);
    return solved;
}
