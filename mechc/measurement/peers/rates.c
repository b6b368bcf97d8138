/* Rates and Jacobian of a compiled model in the forms that CVODE and LSODA want, with nothing between. */
#include "model.h"

typedef struct peer_model {
    mech_function *rhs, *jacobian;
    const int *row, *col;
    const double *z, *p, *size;        /* size: LSODA gets states over these, as it knows one absolute tolerance only */
    double *(*entries)(void *vector);  /* N_VGetArrayPointer */
    double *(*columns)(void *matrix);  /* SUNDenseMatrix_Data */
    double *state, *values;
    long ny, n_jacobian, evaluations;
} peer_model;

__attribute__((visibility("default"))) int peer_cvode_rates(double t, void *y, void *dy, void *user)
{
    peer_model *m = user;
    m->evaluations++;
    m->rhs(t, m->entries(y), 0, m->z, m->p, m->entries(dy));
    return 0;
}

__attribute__((visibility("default"))) int peer_cvode_jacobian(double t, void *y, void *dy, void *matrix, void *user, void *a,
                                                               void *b, void *c)
{
    const peer_model *m = user;
    double *out = m->columns(matrix);
    (void)dy, (void)a, (void)b, (void)c;
    m->jacobian(t, m->entries(y), 0, m->z, m->p, m->values);
    for (long k = 0; k < m->n_jacobian; k++) /* the others are zero from before */
        out[m->col[k] * m->ny + m->row[k]] = m->values[k];
    return 0;
}

__attribute__((visibility("default"))) void peer_lsoda_rates(double t, double *x, double *dx, double *user)
{
    peer_model *m = (peer_model *)user;
    m->evaluations++;
    for (long i = 0; i < m->ny; i++)
        m->state[i] = x[i] * m->size[i];
    m->rhs(t, m->state, 0, m->z, m->p, dx);
    for (long i = 0; i < m->ny; i++)
        dx[i] /= m->size[i];
}
