/* Radau IIA of order 5: implicit, three stages, stiffly accurate; simplified Newton iterations with the
 * model's own Jacobian, an embedded error estimate of order 3, predictive step control. Where these iterations are
 * slow, each stage gets a Jacobian of its own for a while (stages.h).
 *
 * E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Springer 1996, section IV.8,
 * and the authors' program RADAU5. Coefficients computed from the nodes with 60 digits.
 *
 * The estimate of a step falls as h^4, the error of the solution as h^5; so the bound for the estimate is
 * 0.4 tol^(4/5), and the error is proportional to tol. The dense output has the derivatives of the stages
 * and, at the beginning, that of the collocation polynomial p plus (I - h gamma J)^-1 (f(y) - p'): f(y)
 * itself, for order 4 in place of 3, but bounded where h J is not.
 */
#include "method.h"
#include "stages.h"

static const mech_real C1 = MECH_C(0.1550510257216821901802715925294108608034);
static const mech_real C2 = MECH_C(0.6449489742783178098197284074705891391966);
/* Minus the derivatives at 0 of the Lagrange polynomials of the stages over 0, c1, c2, 1. */
static const mech_real E1 = MECH_C(-10.04880939982741556246032950764707991459);
static const mech_real E2 = MECH_C(1.382142733160748895793662840980413247921);
static const mech_real E3 = MECH_C(-0.3333333333333333333333333333333333333333);

static const mech_spectrum SPECTRUM = {
    .stages = 3,
    .has_real = 1,
    .pairs = 1,
    .real = MECH_C(3.637834252744495732208418513577775797946),
    .alpha = {MECH_C(2.681082873627752133895790743211112101027)},
    .beta = {MECH_C(3.050430199247410569426377624787567904441)},
    .t = {MECH_C(0.09443876248897524148749007950641658628681),
          MECH_C(-0.1412552950209542084279903838077973094093),
          MECH_C(-0.03002919410514742449186111708905386666838),
          MECH_C(0.2502131229653333113765090675125016843586),
          MECH_C(0.2041293522937999319959908102983381740865),
          MECH_C(0.3829421127572619377954382335998732103578), 1, 1, 0},
    .t_inverse = {MECH_C(4.17871859155190472734646265851205623),
                  MECH_C(0.3276828207610623870825332724296162342458),
                  MECH_C(0.5233764454994495480399309159089875020601),
                  MECH_C(-4.17871859155190472734646265851205623),
                  MECH_C(-0.3276828207610623870825332724296162342458),
                  MECH_C(0.4766235545005504519600690840910124979399),
                  MECH_C(-0.5028726349457868759512473431395442928592),
                  MECH_C(2.571926949855605429186785353601675054694),
                  MECH_C(-0.5960392048282249249688219110993024032899)},
};

enum { MAX_ITERATIONS = 7 };

static const mech_real SAFETY = MECH_C(0.9);
static const mech_real QUOTIENT_MIN = MECH_C(0.125), QUOTIENT_MAX = MECH_C(5.0); /* of old and new step */
static const mech_real FAST = MECH_C(0.001);    /* convergence so fast that the Jacobian may stay */
static const mech_real SAME_STEP = MECH_C(1.2); /* a step longer by no more than this is not worth new factors */

/* What is remembered from step to step. */
typedef struct radau {
    mech_newton newton;
    mech_real theta, eta;       /* convergence: ratio of corrections, theta / (1 - theta) */
    mech_real h_old, error_old; /* of the last accepted step; h_old = 0: there is none */
    mech_real tolerance;        /* of the error estimate */
    int has_jacobian, jacobian_is_here, iterations;
    long long steps; /* accepted when the Jacobian was last looked at */
    mech_stages stages;
    int own, rescues; /* steps to come with a Jacobian for each stage; in how many runs of such */
} radau;

typedef struct arrays {
    mech_real *f, *z, *w, *d, *poly, *scale, *error, *at, *dominant;
} arrays;

static arrays arrays_of(const mech_solver *s)
{
    const int n = s->ny;
    mech_real *k = s->work;
    return (arrays){.f = k,
                    .z = k + 3 * n,
                    .w = k + 6 * n,
                    .d = k + 9 * n,
                    .poly = k + 12 * n,
                    .scale = k + 15 * n,
                    .error = k + 16 * n,
                    .at = k + 17 * n,
                    .dominant = k + 18 * n};
}

static size_t header(void) { return mech_room_for(sizeof(radau)); }

static size_t n_extra(const mech_model *model)
{
    return header() + mech_newton_size(model, &SPECTRUM) + mech_stages_size(model, &SPECTRUM);
}

static int lacks(const mech_model *model) { return model->jacobian ? MECH_RUNNING : MECH_NEEDS_JACOBIAN; }

static void lay_out(mech_solver *s, radau *r)
{
    mech_real *memory = mech_extra(s) + header();
    mech_newton_prepare(&r->newton, s->model, &SPECTRUM, memory);
    mech_stages_prepare(&r->stages, s->model, &SPECTRUM, memory + mech_newton_size(s->model, &SPECTRUM));
}

static void attach(mech_solver *s)
{
    radau *r = (radau *)mech_extra(s);
    const mech_real h = r->newton.h;
    lay_out(s, r);
    r->newton.h = h;
}

static void begin(mech_solver *s, int fresh)
{
    radau *r = (radau *)mech_extra(s);
    if (fresh) {
        lay_out(s, r);
        r->own = r->rescues = 0;
        const arrays k = arrays_of(s);
        for (int i = 0; i < s->ny; i++) k.dominant[i] = s->o.atol[i] + s->o.rtol * mech_abs(s->y[i]);
    }
    r->has_jacobian = r->jacobian_is_here = 0;
    r->theta = r->eta = 1;
    r->h_old = 0;
    r->steps = s->run->report.steps;
    r->tolerance = s->o.rtol > 0 ? MECH_C(0.4) * mech_pow(s->o.rtol, MECH_C(0.8)) : MECH_C(1e-3);
}

static void set_scale(const mech_solver *s, const radau *r, mech_real *scale)
{
    const mech_real tightened = s->o.rtol > 0 ? r->tolerance / s->o.rtol : 1, rtol = tightened * s->o.rtol;
    for (int i = 0; i < s->ny; i++) scale[i] = 1 / (tightened * s->o.atol[i] + rtol * mech_abs(s->y[i]));
}

/* The Jacobian and the factors that a step over h needs. */
static int prepare(mech_solver *s, radau *r, mech_real h)
{
    if (r->steps != s->run->report.steps) {
        r->steps = s->run->report.steps;
        r->jacobian_is_here = 0;
    }
    if (!r->has_jacobian || (!r->jacobian_is_here && (r->theta > FAST || s->run->turning))) {
        mech_jacobian(s, s->run->report.t, s->y, r->newton.jacobian);
        r->has_jacobian = r->jacobian_is_here = 1;
        r->newton.h = 0;
    }
    if (r->newton.h == h) return 0;
    s->run->report.factorisations++;
    return mech_newton_factorise(&r->newton, h);
}

/* Stages at the continued polynomial of the last step, in W = T^-1 Z. */
static void predict(const mech_solver *s, const radau *r, const arrays *k, mech_real h)
{
    const int n = s->ny;
    if (r->h_old == 0) {
        for (int i = 0; i < 3 * n; i++) k->z[i] = k->w[i] = 0;
        return;
    }
    const mech_real nodes[3] = {C1, C2, 1}, q = h / r->h_old;
    for (int j = 0; j < 3; j++) {
        const mech_real x = nodes[j] * q, x2 = x + 1 - C2, x1 = x + 1 - C1;
        for (int i = 0; i < n; i++)
            k->z[j * n + i] = x * (k->poly[i] + x2 * (k->poly[n + i] + x1 * k->poly[2 * n + i]));
    }
    mech_mix_stages(3, n, SPECTRUM.t_inverse, k->z, k->w);
}

/* The collocation polynomial with its origin at the end of the step, in Newton's form over 1, c2, c1, 0. */
static void remember(const mech_solver *s, const arrays *k)
{
    const int n = s->ny;
    const mech_real *z1 = k->z, *z2 = z1 + n, *z3 = z2 + n;
    for (int i = 0; i < n; i++) {
        const mech_real end = (z2[i] - z3[i]) / (C2 - 1), middle = (z1[i] - z2[i]) / (C1 - C2),
                        first = z1[i] / C1;
        const mech_real second = (middle - end) / (C1 - 1);
        k->poly[i] = end;
        k->poly[n + i] = second;
        k->poly[2 * n + i] = second - (middle - first) / C2;
    }
}

/* Refuses the step: it is to be repeated with `factor` times its size, and a Jacobian of its own. */
static mech_real refuse(mech_solver *s, radau *r, mech_real factor)
{
    s->run->trouble = MECH_NOT_CONVERGED;
    s->run->cut = factor;
    if (!r->jacobian_is_here) r->has_jacobian = 0;
    r->theta = 1;
    return (mech_real)INFINITY;
}

/* Corrections d of the stages from their derivatives, and their size; w and z are those before. */
static mech_real correct(mech_solver *s, radau *r, const arrays *k, mech_real h, int own)
{
    const int n = s->ny, n_jacobian = s->model->n_jacobian;
    const mech_real t = s->run->report.t, nodes[3] = {C1, C2, 1};
    for (int j = 0; j < 3; j++) {
        for (int i = 0; i < n; i++) k->at[i] = s->y[i] + k->z[j * n + i];
        mech_rhs(s, t + nodes[j] * h, k->at, k->f + j * n);
        if (own > 1) mech_jacobian(s, t + nodes[j] * h, k->at, r->stages.jacobian + j * n_jacobian);
    }
    if (own > 1) {
        s->run->report.factorisations++;
        if (mech_stages_factorise(&r->stages, &r->newton.structure, n_jacobian, h)) return (mech_real)INFINITY;
    }
    if (own)
        mech_stages_correct(&r->stages, &r->newton.structure, n_jacobian, k->f, k->z, k->d);
    else
        mech_newton_correct(&r->newton, k->f, k->w, k->d);
    s->run->report.iterations++;
    mech_real sum = 0;
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < n; i++) {
            const mech_real x = k->d[j * n + i] * k->scale[i];
            sum += x * x;
        }
    return mech_sqrt(sum / (3 * n));
}

enum outcome { CONVERGED, SLOW, UNDEFINED };

/* Newton's iterations from the predicted stages; where they are too slow, *factor is that of a step for which
   they would not be. own: with a Jacobian for each stage, which is renewed as long as that is of use. */
static enum outcome iterate(mech_solver *s, radau *r, const arrays *k, mech_real h, int own,
                            mech_real *factor)
{
    const int n = s->ny;
    const mech_real enough =
        mech_max(10 * MECH_EPSILON / r->tolerance, mech_min(MECH_C(0.03), mech_sqrt(r->tolerance)));
    mech_real size_old = 0, ratio_old = 0;
    int renew = own;
    *factor = MECH_C(0.5);
    r->theta = FAST; /* one iteration alone tells that the Jacobian may stay */
    r->eta = mech_pow(mech_max(r->eta, MECH_EPSILON), MECH_C(0.8));
    for (int m = 1;; m++) {
        const mech_real size = correct(s, r, k, h, own + renew);
        if (!mech_finite(size)) return UNDEFINED;
        if (m > 1) {
            const mech_real ratio = size / size_old;
            r->theta = m == 2 || renew ? ratio : mech_sqrt(ratio * ratio_old);
            ratio_old = ratio;
            if (r->theta >= MECH_C(0.99)) return SLOW;
            r->eta = r->theta / (1 - r->theta);
            const int left = MAX_ITERATIONS - 1 - m;
            mech_real at_end = r->eta * size / enough;
            for (int l = 0; l < left; l++) at_end *= r->theta;
            renew = own && r->theta > MECH_C(0.05);
            if (at_end >= 1 && m < MAX_ITERATIONS && !renew) {
                const mech_real excess = mech_min(20, at_end);
                *factor = MECH_C(0.8) * mech_pow(excess, MECH_C(-1.0) / (4 + left));
                return SLOW;
            }
        } else {
            renew = 0;
        }
        size_old = mech_max(size, MECH_EPSILON);
        if (own) {
            for (int i = 0; i < 3 * n; i++) k->z[i] += k->d[i];
        } else {
            for (int i = 0; i < 3 * n; i++) k->w[i] += k->d[i];
            mech_mix_stages(3, n, SPECTRUM.t, k->w, k->z);
        }
        r->iterations = m;
        if (r->eta * size <= enough) return CONVERGED;
        if (m == MAX_ITERATIONS) return SLOW;
    }
}

/* The stages: 0, a refusal, or what is not finite. Where simplified iterations are too slow although their
   Jacobian is new, stages get their own, and so do those of some steps to come. */
static mech_real find_stages(mech_solver *s, radau *r, const arrays *k, mech_real h)
{
    mech_real factor;
    if (!r->own) {
        predict(s, r, k, h);
        const enum outcome outcome = iterate(s, r, k, h, 0, &factor);
        if (outcome == CONVERGED) return 0;
        if (outcome == UNDEFINED) return (mech_real)NAN;
        if (!r->jacobian_is_here || r->h_old == 0 || !r->stages.matrix) return refuse(s, r, factor);
        r->rescues = r->rescues < 5 ? r->rescues + 1 : 5;
        r->own = 4 << r->rescues;
        r->eta = 1;
    }
    predict(s, r, k, h);
    const enum outcome outcome = iterate(s, r, k, h, 1, &factor);
    if (outcome == UNDEFINED) return (mech_real)NAN;
    if (outcome == SLOW) return refuse(s, r, factor);
    r->theta = 1; /* the Jacobian of the beginning is of no use for the next step */
    return 0;
}

/* k->error = (real / h - J)^-1 (f + sum e_i z_i / h), f the derivative at the beginning; its norm. */
static mech_real estimate(const mech_solver *s, const radau *r, const arrays *k, const mech_real *f,
                          mech_real h)
{
    const int n = s->ny;
    const mech_real *z1 = k->z, *z2 = z1 + n, *z3 = z2 + n;
    for (int i = 0; i < n; i++) k->error[i] = f[i] + (E1 * z1[i] + E2 * z2[i] + E3 * z3[i]) / h;
    mech_solve_shifted(&r->newton.structure, r->newton.jacobian, SPECTRUM.real / h, r->newton.real,
                       r->newton.pivot, k->error, r->newton.room);
    mech_real sum = 0;
    for (int i = 0; i < n; i++) {
        const mech_real x = k->error[i] * k->scale[i];
        sum += x * x;
    }
    return mech_max(mech_sqrt(sum / n), MECH_C(1e-10));
}

static mech_real attempt(mech_solver *s, mech_real h)
{
    radau *r = (radau *)mech_extra(s);
    const arrays k = arrays_of(s);
    const int n = s->ny;
    if (prepare(s, r, h)) return refuse(s, r, MECH_C(0.5));
    set_scale(s, r, k.scale);
    const mech_real failed = find_stages(s, r, &k, h);
    if (failed != 0) return failed;
    for (int i = 0; i < n; i++) s->y_new[i] = s->y[i] + k.z[2 * n + i];
    mech_real error = estimate(s, r, &k, s->dy, h);
    if (error >= 1 && (r->h_old == 0 || s->run->after_rejection)) {
        /* The first estimate is too large where the state is off the slow motion: filtered once more. */
        for (int i = 0; i < n; i++) k.at[i] = s->y[i] + k.error[i];
        mech_rhs(s, s->run->report.t, k.at, k.d);
        error = estimate(s, r, &k, k.d, h);
    }
    return error;
}

static mech_real fourth_root(mech_real x) { return mech_sqrt(mech_sqrt(x)); }

/* K. Gustafsson 1994: the error of the last two steps predicts that of the next. */
static mech_real control(mech_solver *s, mech_real h, mech_real error)
{
    radau *r = (radau *)mech_extra(s);
    const arrays k = arrays_of(s);
    const mech_real safety =
        mech_min(SAFETY, SAFETY * (1 + 2 * MAX_ITERATIONS) / (r->iterations + 2 * MAX_ITERATIONS));
    mech_real quotient = mech_max(QUOTIENT_MIN, mech_min(QUOTIENT_MAX, fourth_root(error) / safety));
    if (r->h_old > 0) {
        const mech_real predicted = r->h_old / h * fourth_root(error * error / r->error_old) / SAFETY;
        quotient = mech_max(quotient, mech_min(QUOTIENT_MAX, predicted));
    }
    if (r->own && !--r->own) r->eta = 1;
    r->h_old = h;
    r->error_old = mech_max(MECH_C(1e-2), error);
    remember(s, &k);
    const mech_real factor = 1 / quotient;
    return r->theta <= FAST && factor >= 1 && factor <= SAME_STEP ? 1 : factor;
}

static mech_real stiffness(mech_solver *s, mech_real h)
{
    const radau *r = (const radau *)mech_extra(s);
    const arrays k = arrays_of(s);
    const mech_real size = mech_dominant(s->model, r->newton.jacobian, k.scale, k.dominant, k.d);
    return mech_finite(size) ? h * size : s->method->stiffness_bound;
}

static void dense(mech_solver *s, mech_real h)
{
    (void)h; /* the stages hold it */
    const arrays k = arrays_of(s);
    const int n = s->ny;
    const mech_real *z1 = k.z, *z2 = z1 + n, *z3 = z2 + n;
    mech_real *c = s->dense;
    for (int i = 0; i < n; i++) {
        const mech_real a1 = (z1[i] - C1 * z3[i]) / (C1 * (1 - C1)),
                        a2 = (z2[i] - C2 * z3[i]) / (C2 * (1 - C2));
        const mech_real slope = (a2 - a1) / (C2 - C1), e = SPECTRUM.real * k.error[i];
        c[i] = s->y[i];
        c[n + i] = s->y_new[i] - s->y[i];
        c[2 * n + i] = a1 - slope * C1 + e;
        c[3 * n + i] = slope - e;
        c[4 * n + i] = -MECH_C(2.5) * e;
    }
}

const mech_method mech_radau5 = {
    .name = "radau5",
    .doc = "Radau IIA of order 5, implicit, adaptive: for stiff models",
    .order = 5,
    .adaptive = 1,
    .n_stages = 3,
    .n_work = 19,
    .n_dense = 5,
    .error_order = 4,
    .factor_min = MECH_C(0.125),
    .factor_max = MECH_C(8.0),
    .lacks = lacks,
    .n_extra = n_extra,
    .begin = begin,
    .attach = attach,
    .attempt = attempt,
    .control = control,
    .stiffness = stiffness,
    .stiffness_bound = 2, /* an explicit method takes such steps, too */
    .dense = dense,
};
