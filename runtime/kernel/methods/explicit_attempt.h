/* One attempted step of an explicit Runge-Kutta method; explicit_step.h includes it twice, with other loops:
 * ATTEMPT is the name of the function, LOOP and SUMS(a, b) stand before loops over the state, the latter before
 * one that adds to a and b.
 */
ALWAYS_INLINE mech_real ATTEMPT(mech_solver *s, mech_real h, const int n)
{
    const mech_real t = s->run->report.t, rtol = s->o.rtol, h_over = h / TABLEAU.over;
    const mech_real *restrict y = s->y, *restrict atol = s->o.atol;
    mech_real *const k[] = STAGES_OF_THE_STEP;
    mech_real *restrict y_new = s->y_new, *restrict ys = s->work + (TABLEAU.stages - 1) * n;

#define STAGE(j)                                                                                   \
    if ((j) > 1 && (j) <= TABLEAU.stages) {                                                        \
        LOOP                                                                                       \
        for (int i = 0; i < n; i++) ys[i] = y[i] + h * weighted(k, (j) - 1, TABLEAU.a[j], i);      \
        mech_rhs(s, t + TABLEAU.c[j] * h, ys, k[j]);                                               \
    }
    EACH_STAGE(STAGE)
#undef STAGE

    if (TABLEAU.uses_end) {
        LOOP
        for (int i = 0; i < n; i++) y_new[i] = y[i] + h_over * weighted(k, TABLEAU.stages, TABLEAU.b, i);
        mech_rhs(s, t + h, y_new, s->dy_new);
    }
    mech_real first = 0, second = 0;
    SUMS(first, second)
    for (int i = 0; i < n; i++) {
        const mech_real sum = weighted(k, TABLEAU.stages, TABLEAU.b, i);
        if (!TABLEAU.uses_end) y_new[i] = y[i] + h_over * sum;
        if (TABLEAU.estimates > 0) {
            const mech_real scale = atol[i] + rtol * mech_max(mech_abs(y[i]), mech_abs(y_new[i]));
            const mech_real far = distance(k, sum, i) / scale;
            const mech_real error = weighted(k, TABLEAU.stages + TABLEAU.uses_end, TABLEAU.error, i) / scale;
            if (TABLEAU.estimates > 1) second += far * far;
            first += error * error;
        } else {
            first += y_new[i];
        }
    }
    if (TABLEAU.estimates == 0) return mech_finite(first) ? 0 : first;
    if (TABLEAU.estimates == 1) return h * mech_sqrt(first / n);
    const mech_real both = first + MECH_C(0.01) * second;
    if (both == 0) return 0;
    return h * first / mech_sqrt(both * n);
}

#undef ATTEMPT
#undef LOOP
#undef SUMS
