/* Initial states of models with constraints, or with conditions at the start: assembled like those of every run. */
#include <string.h>

#include "instance.h"
#include "start.h"

enum { AGAIN = 20 };

static int follows(const fmu *f, int i)
{
    for (int k = 0; k < f->d->n_dependent; k++)
        if (f->d->dependent[k] == i) return !f->y_set[i] && !f->d->y_given[i];
    return 0;
}

/* Initial values that follow from those of others; gives whether a coordinate or velocity among them has another value now. */
static int follow_others(fmu *f, mech_real *y)
{
    const fmu_description *d = f->d;
    int moved = 0;
    for (int round = 0; round < d->n_dependent; round++) {
        mech_real *value = f->dy; /* rates are found anew behind it */
        d->others(f->st->t, y, f->u, f->z, f->p, value);
        for (int k = 0; k < d->n_dependent; k++) {
            const int i = d->dependent[k];
            if (!follows(f, i)) continue;
            if (i < f->m->nq + f->m->nv && mech_abs(y[i] - value[k]) > MECH_C(1e-14) * (mech_abs(y[i]) + mech_abs(value[k]))) moved = 1;
            y[i] = value[k];
        }
    }
    return moved;
}

/* 0, or 1 where there is no start in which what the importer has set stays, and what the model holds if `model_holds`. */
static int assemble(fmu *f, int model_holds)
{
    mech_real *y = f->scratch;
    unsigned char *known = f->known;
    memcpy(y, f->y, (size_t)f->ny * sizeof(mech_real));
    for (int i = 0; i < f->ny; i++) known[i] = f->y_set[i] || (model_holds && f->d->y_held[i]);
    for (int again = 0;; again++) {
        if (again == AGAIN || mech_assemble(f->m, f->st->t, known, f->u, f->z, f->p, y, NULL)) return 1;
        if (!follow_others(f, y)) break;
        for (int i = 0; i < f->ny; i++) /* from where it began, with what follows the others now */
            if (!follows(f, i)) y[i] = f->y[i];
    }
    memcpy(f->y, y, (size_t)f->ny * sizeof(mech_real));
    return 0;
}

/* Values that the importer has set go before those of the model. */
int fmu_assemble(fmu *f)
{
    mech_normalise(f->m, f->y);
    if (!assemble(f, 1) || !assemble(f, 0)) {
        const int wrong = mech_start_found(f->m, f->st->t, f->y, f->u, f->z, f->p, f->p_set);
        return wrong < 0 ? FMU_OK : fmu_undefined(f, "a parameter that the start finds is not finite");
    }
    return fmu_fail(f, FMU_ERROR, "the initial values that were set contradict the constraints");
}
