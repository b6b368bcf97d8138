/* The sums of Taylor series of few slots (series.h), for models that are added later. */
#include "series.h"
#include "web_plan.h"

void EXPORT(f_series_sums)(int first, int k, const mech_real *rows, int slots, mech_real *sums)
{
    mech_series_sums(first, k, rows, slots, sums);
}
