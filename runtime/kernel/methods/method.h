/* What a method is: one const struct in one file, listed in methods.c. Internal to the kernel. */
#ifndef MECH_METHOD_H
#define MECH_METHOD_H

#include "run.h"

typedef struct mech_method {
    const char *name, *doc;
    int order;
    int adaptive;    /* else the step is the user's                                          */
    int n_stages;    /* derivative arrays that an attempt leaves at the start of work        */
    int n_work;      /* arrays of ny numbers in work                                         */
    int n_dense;     /* coefficients of the dense output, at least 4                         */
    int error_order; /* an error estimate falls as dt to this power                          */
    mech_real factor_min, factor_max;
    const struct mech_tableau *tableau; /* explicit Runge-Kutta methods only                 */

    /* MECH_RUNNING, or what the model lacks for this method. NULL: nothing. */
    int (*lacks)(const mech_model *model);
    /* Further numbers in work, behind n_work * ny. NULL: none. */
    size_t (*n_extra)(const mech_model *model);
    /* The derivative may jump at the present time; fresh: the state may, too. NULL: nothing is remembered. */
    void (*begin)(mech_solver *s, int fresh);
    /* Its extra numbers were copied from other memory: pointers to them. NULL: it keeps none. */
    void (*attach)(mech_solver *s);
    /* The longest step from the present state that this suggests. NULL: only attempts tell. */
    mech_real (*longest)(mech_solver *s);
    int gives_derivative;  /* an attempt fills dy_new, too                                   */
    /* A step solves for contacts, friction and what is engaged: they are not events. The impulses [n_rows] of the last one, and
       the rates [n_rows] that they left. NULL: events are found. */
    const mech_real *(*impulses)(const mech_solver *s, const mech_real **rates);
    /* The same where contacts are a crowd: writes to z what their forces do, and those that are asked. */
    void (*tell)(const mech_solver *s, mech_real *z);
    int keeps_constraints; /* the new state needs no projection                              */

    /* Where steps have become too small: names what of the method is to blame, or MECH_RUNNING. NULL: nothing can be. */
    int (*blame)(mech_solver *s);
    /* From (t, y, dy) over h: fills y_new and returns the error norm (0 without an estimate);
       not finite where a stage is undefined, or where run->trouble says what else is wrong. */
    mech_real (*attempt)(mech_solver *s, mech_real h);
    /* Factor of the next step after one over h with this error. NULL: PI control. */
    mech_real (*control)(mech_solver *s, mech_real h, mech_real error);
    /* After acceptance, with dy_new known: |h lambda| as the step saw it, or 0. NULL: none. */
    mech_real (*stiffness)(mech_solver *s, mech_real h);
    mech_real stiffness_bound; /* above it for long: stiff; of an implicit method: below it for long, calm */
    /* With dy_new known: fills dense[n_dense][ny]. */
    void (*dense)(mech_solver *s, mech_real h);
    /* Norm of the largest error between the ends, from dense. NULL: never much larger than that of the step. */
    mech_real (*dense_error)(const mech_solver *s);

    /* A method that consists of two: begins with the first, goes over to the other where it is stiff. */
    const struct mech_method *explicit_part, *implicit_part;
} mech_method;

extern const mech_method mech_rk4, mech_dop853, mech_radau5;
extern const mech_method mech_gauss2, mech_gauss4, mech_gauss6, mech_gauss8, mech_verlet, mech_auto;
extern const mech_method mech_rattle, mech_lobatto4, mech_lobatto6, mech_taylor, mech_moreau;

extern const mech_method *const mech_methods[];
extern const int mech_n_methods;

/* The extra numbers of a method. */
static inline mech_real *mech_extra(const mech_solver *s)
{
    return s->work + (size_t)s->ny * (size_t)s->method->n_work;
}

/* Fills dense for a step of h that was attempted, unless it is there already. */
static inline void mech_fill_dense(mech_solver *s, mech_real h)
{
    if (s->run->dense_of != h) s->method->dense(s, h);
    s->run->dense_of = h;
}

#endif
