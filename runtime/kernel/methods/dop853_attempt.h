/* One attempted step of DOP853; dop853.c includes it twice, with other loops:
 * ATTEMPT is the name of the function, LOOP and SUMS(a, b) stand before loops over the state, the latter before
 * one that adds to a and b.
 */
ALWAYS_INLINE mech_real ATTEMPT(mech_solver *s, mech_real h, const int n)
{
    const mech_real t = s->run->report.t, rtol = s->o.rtol;
    const mech_real *restrict y = s->y, *restrict k1 = s->dy, *restrict atol = s->o.atol;
    mech_real *restrict y_new = s->y_new, *restrict k2 = s->work;
    mech_real *restrict k3 = k2 + n, *restrict k4 = k2 + 2 * n, *restrict k5 = k2 + 3 * n;
    mech_real *restrict k6 = k2 + 4 * n, *restrict k7 = k2 + 5 * n, *restrict k8 = k2 + 6 * n;
    mech_real *restrict k9 = k2 + 7 * n, *restrict k10 = k2 + 8 * n, *restrict k11 = k2 + 9 * n;
    mech_real *restrict k12 = k2 + 10 * n, *restrict ys = k2 + 11 * n;

    STAGE(c02, k2, a0201 * k1[i])
    STAGE(c03, k3, a0301 * k1[i] + a0302 * k2[i])
    STAGE(c04, k4, a0401 * k1[i] + a0403 * k3[i])
    STAGE(c05, k5, a0501 * k1[i] + a0503 * k3[i] + a0504 * k4[i])
    STAGE(c06, k6, a0601 * k1[i] + a0604 * k4[i] + a0605 * k5[i])
    STAGE(c07, k7, a0701 * k1[i] + a0704 * k4[i] + a0705 * k5[i] + a0706 * k6[i])
    STAGE(c08, k8, a0801 * k1[i] + a0804 * k4[i] + a0805 * k5[i] + a0806 * k6[i] + a0807 * k7[i])
    STAGE(c09, k9,
          a0901 * k1[i] + a0904 * k4[i] + a0905 * k5[i] + a0906 * k6[i] + a0907 * k7[i] + a0908 * k8[i])
    STAGE(c10, k10,
          a1001 * k1[i] + a1004 * k4[i] + a1005 * k5[i] + a1006 * k6[i] + a1007 * k7[i] + a1008 * k8[i] +
              a1009 * k9[i])
    STAGE(c11, k11,
          a1101 * k1[i] + a1104 * k4[i] + a1105 * k5[i] + a1106 * k6[i] + a1107 * k7[i] + a1108 * k8[i] +
              a1109 * k9[i] + a1110 * k10[i])
    STAGE(1, k12,
          a1201 * k1[i] + a1204 * k4[i] + a1205 * k5[i] + a1206 * k6[i] + a1207 * k7[i] + a1208 * k8[i] +
              a1209 * k9[i] + a1210 * k10[i] + a1211 * k11[i])

    mech_real sum5 = 0, sum3 = 0;
    SUMS(sum5, sum3)
    for (int i = 0; i < n; i++) {
        mech_real sum = b01 * k1[i] + b06 * k6[i] + b07 * k7[i] + b08 * k8[i] + b09 * k9[i] + b10 * k10[i] +
                        b11 * k11[i] + b12 * k12[i];
        y_new[i] = y[i] + h * sum;
        mech_real scale = atol[i] + rtol * mech_max(mech_abs(y[i]), mech_abs(y_new[i]));
        mech_real e3 = (sum - bhh01 * k1[i] - bhh09 * k9[i] - bhh12 * k12[i]) / scale;
        mech_real e5 = (e501 * k1[i] + e506 * k6[i] + e507 * k7[i] + e508 * k8[i] + e509 * k9[i] +
                        e510 * k10[i] + e511 * k11[i] + e512 * k12[i]) / scale;
        sum3 += e3 * e3;
        sum5 += e5 * e5;
    }
    mech_real denominator = sum5 + MECH_C(0.01) * sum3;
    if (denominator == 0) return 0;
    return h * sum5 / mech_sqrt(denominator * n);
}

#undef ATTEMPT
#undef LOOP
#undef SUMS
