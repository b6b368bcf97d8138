/* The systems of shifted.h, for a test. */
#include <stdlib.h>

#include "shifted.h"
#include "solver.h"

/* Solves (sigma - J) d = r, real or complex; gives the number of unknowns that were left, or -1. */
MECH_API int shifted(int n, int entries, const int *rows, const int *columns, const double *jacobian, double re,
                     double im, double *r_re, double *r_im)
{
    const mech_model model = {.nx = n, .n_jacobian = entries, .jac_row = rows, .jac_col = columns};
    double *memory = malloc(sizeof(double) * (mech_structure_size(&model) + (size_t)(2 * n * n + 2 * n)));
    int *pivot = malloc(sizeof(int) * (size_t)n);
    const mech_structure k = mech_find_structure(&model, memory);
    double *a = memory + mech_structure_size(&model), *b = a + n * n, *room = b + n * n;
    int singular;
    if (im == 0) {
        singular = mech_factorise_shifted(&k, jacobian, re, a, pivot);
        if (!singular) mech_solve_shifted(&k, jacobian, re, a, pivot, r_re, room);
    } else {
        singular = mech_factorise_shifted_complex(&k, jacobian, re, im, a, b, pivot);
        if (!singular) mech_solve_shifted_complex(&k, jacobian, re, im, a, b, pivot, r_re, r_im, room);
    }
    free(memory);
    free(pivot);
    return singular ? -1 : k.m;
}
