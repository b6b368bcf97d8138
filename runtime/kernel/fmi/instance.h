/* One instance of a model in an FMU: what both versions of the interface share. Internal to the FMU.
 *
 *  1. Everything that changes lies in one block (fmu_state and the arrays behind it) and in the block of the
 *     solver, so that both can be copied out and back bit for bit.
 *  2. Value references: 0 is the time, then y, dy/dt, u, p and the outputs follow in the order of the model.
 *  3. Nothing is allocated between fmu_create and fmu_destroy but states that the importer asks for.
 *  4. The numbers of the statuses are those of FMI 2 and FMI 3.
 *  5. The seeds of derivatives are passed behind the discrete variables in z.
 */
#ifndef MECH_FMI_INSTANCE_H
#define MECH_FMI_INSTANCE_H

#include <stddef.h>
#include <stdint.h>

#include "method.h"

enum { FMU_OK = 0, FMU_WARNING = 1, FMU_DISCARD = 2, FMU_ERROR = 3, FMU_FATAL = 4 };

enum fmu_mode {
    FMU_INSTANTIATED = 1,
    FMU_INITIALISATION = 2,
    FMU_EVENT = 4,
    FMU_CONTINUOUS = 8,
    FMU_STEP = 16,
    FMU_STEP_FAILED = 32,
    FMU_TERMINATED = 64
};

/* What the exporter writes beside the model: defaults of the exported experiment, one entry for each number. */
typedef struct fmu_description {
    const char *token, *method;
    mech_real t0, stop, tolerance, dt;
    int nz, n_seeds;                    /* true discrete variables; seeds behind them in z       */
    const mech_real *nominal;           /* [ny]                                                  */
    const mech_real *y, *u, *p;         /* values of the experiment                              */
    const unsigned char *y_given, *u_given, *p_given; /* 0: by the formulas of the model         */
    const unsigned char *p_settable;    /* 0: calculated from others                             */
    const unsigned char *y_settable;    /* states whose initial value may be changed             */
    int initial_is_free;                /* no initial value depends on other quantities          */
    const char *const *assertions;      /* [n_assertions]                                        */
    mech_function *tangent, *adjoint;   /* J seed: out[ny + n_outputs]; J^T seed: out[ny + nu + 1 + np] */
} fmu_description;

extern const fmu_description mech_fmu_description;
const mech_model *mech_model_get(void);

/* The beginning of the changing block. The first eight bytes are zero: one importer frees states wrongly. */
typedef struct fmu_state {
    uint64_t zero, layout;
    mech_real t, start, stop, tolerance, last_step_end;
    int mode, stop_defined, tolerance_defined;
    int stale_parameters, stale_initial, stale_inputs, stale_rates, stale_outputs;
    int solver_stale; /* the state, an input or a parameter was changed from outside   */
    int n_driven;     /* inputs that the importer has set                             */
} fmu_state;

typedef struct fmu fmu;
typedef void fmu_logger(fmu *f, int status, const char *category, const char *message);

struct fmu {
    const fmu_description *d;
    const mech_model *m;
    mech_solver *s;
    int ny, is_co_simulation, logging;
    unsigned categories; /* bits, in the order of fmu_categories */
    size_t size;         /* bytes of the block                   */
    fmu_state *st;
    mech_real *y, *dy, *u, *p, *z, *out, *atol, *scratch;
    unsigned char *p_set, *y_set, *u_set;
    mech_table *tables;
    void *saved; /* the solver before a step */
    fmu_logger *log;
    void *environment, *callback; /* for the functions of one version */
    void *update;
    char *name;
};

enum { FMU_N_CATEGORIES = 4 };
extern const char *const fmu_categories[FMU_N_CATEGORIES];

/* NULL: no memory, or another token. */
fmu *fmu_create(const char *name, const char *token, int is_co_simulation, fmu_logger *log, void *environment,
                void *callback, int logging);
void fmu_destroy(fmu *f);
void fmu_reset(fmu *f);
int fmu_fail(fmu *f, int status, const char *format, ...);
/* FMU_OK if the present mode is among `modes`, else logs. */
int fmu_allowed(fmu *f, int modes, const char *function);
int fmu_set_categories(fmu *f, int on, size_t n, const char *const *names);

int fmu_enter_initialisation(fmu *f);
int fmu_exit_initialisation(fmu *f);
int fmu_get(fmu *f, const uint32_t *vr, size_t n, mech_real *value);
int fmu_set(fmu *f, const uint32_t *vr, size_t n, const mech_real *value);
int fmu_set_time(fmu *f, mech_real t);
int fmu_set_states(fmu *f, const mech_real *y, size_t n);
int fmu_get_states(fmu *f, mech_real *y, size_t n);
int fmu_get_rates(fmu *f, mech_real *dy, size_t n);
/* After an accepted step of the importer: assertions, drift; `event`: the state must be projected. */
int fmu_completed_step(fmu *f, int *event);
/* One pass of event mode; `moved`: the states changed. */
int fmu_update(fmu *f, int *moved);

int fmu_derivative(fmu *f, int adjoint, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns,
                   size_t n_knowns, const mech_real *seed, mech_real *result);

/* Steps to t + h. `stop_asked` is asked after each step of the solver, NULL: never; `reached`: where it ended. */
int fmu_step(fmu *f, mech_real t, mech_real h, int (*stop_asked)(fmu *f, mech_real t, mech_real *until),
             mech_real *reached);

size_t fmu_state_size(const fmu *f);
int fmu_save(fmu *f, void **state);
int fmu_load(fmu *f, const void *state);
int fmu_check_state(fmu *f, const void *bytes, size_t size);

int fmu_refresh_rates(fmu *f);
int fmu_refresh_outputs(fmu *f);
int fmu_refresh_parameters(fmu *f);
int fmu_refresh_initial(fmu *f);
void fmu_touch(fmu *f);

#endif
