/* Initial states of models with constraints, or with conditions at the start: assembled like those of every run. */
#include <string.h>

#include "instance.h"
#include "start.h"

/* 0, or 1 where there is no start in which what the importer has set stays, and what the model holds if `model_holds`. */
static int assemble(fmu *f, int model_holds)
{
    mech_real *y = f->scratch;
    unsigned char *known = f->known;
    memcpy(y, f->y, (size_t)f->ny * sizeof(mech_real));
    for (int i = 0; i < f->ny; i++) known[i] = f->y_set[i] || (model_holds && f->d->y_held[i]);
    if (mech_assemble(f->m, f->st->t, known, f->u, f->z, f->p, y, NULL)) return 1;
    memcpy(f->y, y, (size_t)f->ny * sizeof(mech_real));
    return 0;
}

/* Values that the importer has set go before those of the model. */
int fmu_assemble(fmu *f)
{
    mech_normalise(f->m, f->y);
    if (!assemble(f, 1) || !assemble(f, 0)) return FMU_OK;
    return fmu_fail(f, FMU_ERROR, "the initial values that were set contradict the constraints");
}
