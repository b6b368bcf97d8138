/* The discrete adjoint of the explicit method of order 8: backwards over the steps that a run has made.
 *
 * Of each step the state at its beginning is known (a checkpoint); its stages are computed again, then each is pulled back
 * by the transposed derivative of the rates (Griewank, Walther, Evaluating Derivatives, ch. 15; Hager 2000). The lengths
 * of the steps count as given, and each projection onto the constraints as one Newton step at the point where it ended. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "dop853_tableau.h"
#include "solver.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef ptrdiff_t size;

typedef struct {
    mech_function *rhs, *inputs, *goal, *pull_back;
    mech_function *pull_back_position, *pull_back_velocity; /* of the projections behind each step, or NULL */
    size ny, nu, nz, n_free, n_steps, n_tabled, n_rotations; /* nz: seeds, which stand for z       */
    const int *rotations; /* first index in y of four                                                  */
    const int *tabled;    /* index in u of the inputs that tables give                                 */
    const double *p;
    const double *t, *h;  /* [n_steps]                                                                 */
    const double *y;      /* [n_steps + 1][ny], at the beginning of each step, and at the end          */
    const double *from_tables; /* [n_steps][STAGES][n_tabled]                                          */
    double rate;          /* how the goal counts along the motion: 1 for an integral, else 0           */
    double *lambda;       /* [ny]: in: derivative of the goal by the last state; out: by the first     */
    double *gradient;     /* [n_free]: what belongs to parameters and inputs is added                  */
    double *integral;     /* the goal along the motion is added                                        */
} sweep_record;

typedef int advance_function(mech_solver *, double, long);
typedef void read_function(const mech_solver *, mech_report *, double *);

EXPORT int mech_adjoint_stages(void);
EXPORT int mech_adjoint_steps(mech_solver *s, advance_function *advance, read_function *read, double stop, size ny,
                              size room, mech_report *report, double *t, double *y, size *count);
EXPORT int mech_adjoint_sweep(const sweep_record *s);

int mech_adjoint_stages(void)
{
    return STAGES;
}

/* Up to `room` steps of a run one by one: times t and states y [ny] at their ends, so many as `count` says. The functions are
 * those of the kernel, which is another library. */
int mech_adjoint_steps(mech_solver *s, advance_function *advance, read_function *read, double stop, size ny, size room,
                       mech_report *report, double *t, double *y, size *count)
{
    int status = MECH_RUNNING;
    double before;
    read(s, report, y);
    before = report->t;
    *count = 0;
    while (status == MECH_RUNNING && *count < room) {
        status = advance(s, stop, 1);
        read(s, report, y + *count * ny);
        if (report->t == before) continue;
        t[(*count)++] = before = report->t;
    }
    return status;
}

/* A rotation is scaled to unit length behind each step: what is along it, is lost. */
static void across_rotations(const sweep_record *s, const double *y, double *lambda)
{
    for (size r = 0; r < s->n_rotations; r++) {
        const double *q = y + s->rotations[r];
        double *l = lambda + s->rotations[r];
        double along = q[0] * l[0] + q[1] * l[1] + q[2] * l[2] + q[3] * l[3];
        for (int k = 0; k < 4; k++) l[k] -= along * q[k];
    }
}

/* Loops over the state: in vectors where the build allows them. */
#if defined(MECH_SIMD)
#define LOOP _Pragma("omp simd")
#else
#define LOOP
#endif
#if defined(__GNUC__)
#define ALWAYS_INLINE static inline __attribute__((always_inline))
#else
#define ALWAYS_INLINE static inline
#endif

#define EACH_STAGE(DO) DO(1) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7) DO(8) DO(9) DO(10) DO(11) DO(12)
#define EACH_STAGE_BACKWARDS(DO) DO(12) DO(11) DO(10) DO(9) DO(8) DO(7) DO(6) DO(5) DO(4) DO(3) DO(2) DO(1)

/* Element i of what the stages before stage j give to its state, over h; k[l] belongs to stage l, from 1 on. */
ALWAYS_INLINE double from_before(double *const *k, int j, size i)
{
    double sum = 0;
#define TERM(l) \
    if ((l) < j && TABLEAU.a[j][l] != 0) sum += TABLEAU.a[j][l] * k[l][i];
    EACH_STAGE(TERM)
#undef TERM
    return sum;
}

/* The transposed: element i of what the stages behind stage j give back to its rates, over h. */
ALWAYS_INLINE double from_behind(double *const *back, int j, size i)
{
    double sum = 0;
#define TERM(l) \
    if ((l) > j && TABLEAU.a[l][j] != 0) sum += TABLEAU.a[l][j] * back[l][i];
    EACH_STAGE(TERM)
#undef TERM
    return sum;
}

/* What a step works with: rates of the stages (in their places later what is given back), states, inputs, ... */
typedef struct {
    double *k[STAGES + 1], *ys[STAGES + 1], *us[STAGES + 1], *z, *seeds, *out;
} room;

/* Go through the stages of step m again. */
static void stages_of(const sweep_record *s, size m, const room *r)
{
    const size n = s->ny;
    const double t = s->t[m], h = s->h[m], *restrict y = s->y + m * n;
    double g;
#define STAGE(j)                                                                                        \
    {                                                                                                   \
        double *restrict x = r->ys[j], at = t + TABLEAU.c[j] * h;                                       \
        LOOP                                                                                            \
        for (size i = 0; i < n; i++) x[i] = y[i] + h * from_before(r->k, j, i);                         \
        if (s->nu) s->inputs(at, x, NULL, r->z, s->p, r->us[j]);                                        \
        for (size l = 0; l < s->n_tabled; l++)                                                          \
            r->us[j][s->tabled[l]] = s->from_tables[(m * STAGES + (j) - 1) * s->n_tabled + l];          \
        if ((j) < STAGES) s->rhs(at, x, r->us[j], r->z, s->p, r->k[j]);                                 \
        if (s->rate != 0 && TABLEAU.b[j] != 0) {                                                        \
            s->goal(at, x, r->us[j], r->z, s->p, &g);                                                   \
            *s->integral += h * TABLEAU.b[j] * g;                                                       \
        }                                                                                               \
    }
    EACH_STAGE(STAGE)
#undef STAGE
}

/* A projection moved the state at the end of step m: pull its derivative back. */
static void project_back(const sweep_record *s, size m, const room *r, mech_function *pull_back)
{
    const size n = s->ny;
    if (!pull_back) return;
    memcpy(r->seeds, s->lambda, (size_t)n * sizeof(double));
    r->seeds[n] = 0;
    pull_back(s->t[m] + s->h[m], s->y + (m + 1) * n, r->us[STAGES], r->z, s->p, r->out);
    for (size i = 0; i < n; i++) s->lambda[i] += r->out[i];
    for (size i = 0; i < s->n_free; i++) s->gradient[i] += r->out[n + i];
}

/* Go back through the stages of step m. */
static void pull_step_back(const sweep_record *s, size m, const room *r)
{
    const size n = s->ny;
    const double t = s->t[m], h = s->h[m];
    double *restrict lambda = s->lambda, *restrict seeds = r->seeds, *restrict out = r->out;
    double *restrict gradient = s->gradient;
#define STAGE(j)                                                                                              \
    {                                                                                                         \
        double *restrict back = r->k[j];                                                                      \
        LOOP                                                                                                  \
        for (size i = 0; i < n; i++) seeds[i] = h * (TABLEAU.b[j] * lambda[i] + from_behind(r->k, j, i));     \
        seeds[n] = s->rate * h * TABLEAU.b[j];                                                                \
        s->pull_back(t + TABLEAU.c[j] * h, r->ys[j], r->us[j], r->z, s->p, out);                              \
        memcpy(back, out, (size_t)n * sizeof(double));                                                        \
        LOOP                                                                                                  \
        for (size i = 0; i < s->n_free; i++) gradient[i] += out[n + i];                                       \
    }
    EACH_STAGE_BACKWARDS(STAGE)
#undef STAGE
#define TERM(l) +r->k[l][i]
    LOOP
    for (size i = 0; i < n; i++) lambda[i] += 0 EACH_STAGE(TERM);
#undef TERM
}

int mech_adjoint_sweep(const sweep_record *s)
{
    const size n = s->ny, nu = s->nu, width = n + s->n_free;
    double *all = calloc((size_t)(2 * STAGES * n + STAGES * nu + s->nz + width), sizeof(double));
    room r;
    if (!all) return 0;
    for (int j = 1; j <= STAGES; j++) {
        r.k[j] = all + (j - 1) * n;
        r.ys[j] = all + (STAGES + j - 1) * n;
        r.us[j] = all + 2 * STAGES * n + (j - 1) * nu;
    }
    r.k[0] = r.ys[0] = r.us[0] = NULL;
    r.z = r.seeds = all + 2 * STAGES * n + STAGES * nu;
    r.out = r.z + s->nz;
    for (size m = s->n_steps - 1; m >= 0; m--) {
        stages_of(s, m, &r);
        project_back(s, m, &r, s->pull_back_velocity);
        across_rotations(s, s->y + (m + 1) * n, s->lambda);
        project_back(s, m, &r, s->pull_back_position);
        across_rotations(s, s->y + (m + 1) * n, s->lambda);
        pull_step_back(s, m, &r);
    }
    if (s->n_steps) across_rotations(s, s->y, s->lambda);
    free(all);
    return 1;
}
