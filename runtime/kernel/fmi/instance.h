/* One instance of a model in an FMU: what both versions of the interface share. Internal to the FMU.
 *
 *  1. All memory that changes is one block (fmu_state and the arrays after it) and the block of the
 *     solver, so that both can be saved and restored bit for bit.
 *  2. Value references: 0 is the time, then y, dy/dt, u, p and the outputs follow in the order of the model, then
 *     the discrete variables of the user, and the event indicators.
 *  3. Nothing is allocated between fmu_create and fmu_destroy but states that the importer asks for.
 *  4. The numbers of the statuses are those of FMI 2 and FMI 3.
 *  5. The seeds of derivatives are passed behind the discrete variables in z.
 *  6. A model with events shares z with its solver, whose modes are the only ones. Only `events` of the description leads to
 *     the code for events, so that other models do without it (fmi_events.c).
 */
#ifndef MECH_FMI_INSTANCE_H
#define MECH_FMI_INSTANCE_H

#include <stddef.h>
#include <stdint.h>

#include "run.h"

enum { FMU_OK = 0, FMU_WARNING = 1, FMU_DISCARD = 2, FMU_ERROR = 3, FMU_FATAL = 4 };

enum fmu_mode {
    FMU_INSTANTIATED = 1,
    FMU_INITIALISATION = 2,
    FMU_EVENT = 4,
    FMU_CONTINUOUS = 8,
    FMU_STEP = 16,
    FMU_STEP_FAILED = 32,
    FMU_TERMINATED = 64,
    FMU_INTERMEDIATE = 128 /* inside the callback of a step */
};

enum fmu_type { FMU_REAL = 0, FMU_INTEGER = 1, FMU_BOOLEAN = 2 };

typedef struct fmu fmu;

/* What one pass of event mode, or a step, tells the importer. */
typedef struct fmu_news {
    int moved;       /* the states have changed                                               */
    int again;       /* one more pass is due                                                  */
    int ends;        /* the model ends the simulation                                         */
    int event;       /* an event is reached and waits for event mode                          */
    mech_real next;  /* time of the next event that is known before, or infinity              */
    mech_real reached;
} fmu_news;

typedef struct fmu_event_functions {
    int (*look)(fmu *f);              /* during initialisation: switches and modes as they stand */
    int (*begin)(fmu *f);             /* what happens at the start, and the solver made ready    */
    int (*update)(fmu *f, fmu_news *news);
    int (*indicators)(fmu *f);        /* into f->w                                               */
    int (*drifts)(fmu *f);            /* 1: what should rest or touch has moved too far          */
    int (*fail)(fmu *f, int outcome); /* tells why an event failed; gives the status             */
} fmu_event_functions;

extern const fmu_event_functions fmu_events_of_models;

/* What the exporter writes beside the model: defaults of the exported experiment, one entry for each number. */
/* A parameter that states its range, in SI; `unit` as a message has it. */
typedef struct fmu_range {
    int p;
    mech_real low, high;
    const char *name, *unit;
} fmu_range;

typedef struct fmu_description {
    const char *token, *method;
    mech_real t0, stop, tolerance, dt;
    int nz, n_seeds;                    /* true discrete variables; seeds behind them in z       */
    int n_discrete;                     /* of them the user's, the first                         */
    const unsigned char *z_type;        /* [n_discrete] enum fmu_type                            */
    const unsigned char *u_type, *p_type; /* the same of inputs and parameters                   */
    int n_indicators;
    const int *indicators;              /* [n_indicators] of those of mech_hybrid                */
    const mech_real *nominal;           /* [ny]                                                  */
    const mech_real *y, *u, *p;         /* values of the experiment                              */
    const mech_real *y_stated;          /* the same before it was assembled                      */
    const unsigned char *y_given, *u_given, *p_given; /* 0: by the formulas of the model         */
    const unsigned char *p_settable;    /* 0: calculated from others                             */
    const unsigned char *y_settable;    /* states whose initial value may be changed             */
    const unsigned char *y_held;        /* [ny] initial values that constraints must not move    */
    int n_dependent;                    /* initial values that are stated with those of others   */
    const int *dependent;               /* [n_dependent] in y                                    */
    mech_function *others;              /* out[n_dependent]; NULL: there are none                */
    int (*assemble)(struct fmu *f);     /* fmu_assemble; NULL: the initial state is as it is stated */
    int initial_is_free;                /* no initial value depends on other quantities          */
    int inputs_move;                    /* an input that nobody sets depends on time             */
    int n_drives;
    const int (*drives)[3];             /* [n_drives] in u: an input that drives, its derivatives */
    const char *const *drive_names;     /* [n_drives]                                            */
    int n_sizes;
    const int *sizes;                   /* [n_sizes] elements by reference, 0: none; NULL: scalars */
    const char *const *assertions;      /* [n_assertions]                                        */
    int n_ranges;
    const fmu_range *ranges;
    const char *const *branches, *const *ends, *const *rows; /* names; messages of terminate or NULL */
    const char *const *const *checks;   /* messages of the assertions of each branch             */
    const fmu_event_functions *events;  /* NULL: the model has none                              */
    mech_function *tangent, *adjoint;   /* J seed: out[ny + n_outputs]; J^T seed: out[ny + nu + 1 + np] */
    mech_function *start_tangent, *start_adjoint; /* of the initial state by u, t, p; NULL: not by formulas */
} fmu_description;

/* What an input that drives was told last, and how it moves on during a step of Co-Simulation. */
typedef struct fmu_drive {
    mech_real told[3];                       /* value, first and second derivative */
    mech_real t[2], value[2], first[2], second; /* at both ends of the step        */
} fmu_drive;

enum fmu_place { FMU_TIME, FMU_Y, FMU_DY, FMU_U, FMU_P, FMU_OUT, FMU_Z, FMU_W, FMU_NOTHING };

extern const fmu_description mech_fmu_description;
const mech_model *mech_model_get(void);

/* The beginning of the changing block. The first eight bytes are zero: one importer frees states wrongly. */
typedef struct fmu_state {
    uint64_t zero, layout;
    uint64_t bytes;   /* of what was saved with this                                     */
    mech_real t, start, stop, tolerance, last_step_end;
    int mode, stop_defined, tolerance_defined;
    int stale_parameters, stale_initial, stale_inputs, stale_rates, stale_outputs;
    int solver_stale; /* the state, an input or a parameter was changed from outside   */
    int n_driven;     /* inputs that the importer has set                             */
    int off;          /* a state or parameter was set: constraints may not hold       */
    int ended;        /* the model has ended the simulation                           */
    mech_real next;   /* of fmu_news, as told last                                    */
} fmu_state;

typedef void fmu_logger(fmu *f, int status, const char *category, const char *message);

struct fmu {
    const fmu_description *d;
    const mech_model *m;
    mech_solver *s;
    int ny, is_co_simulation, logging;
    int event_mode, early_return; /* Co-Simulation of FMI 3: what the importer wants    */
    unsigned categories; /* bits, in the order of fmu_categories */
    size_t size;         /* bytes of the block                   */
    fmu_state *st;
    mech_real *y, *dy, *u, *p, *z, *out, *atol, *scratch, *w;
    mech_real *slopes; /* [ny + nu + 1 + np] of derivatives.c                                   */
    mech_real *noise; /* [n_w] by how much more than rounding the importer leaves gaps below zero */
    unsigned char *known; /* [ny] of fmi_start.c                                                 */
    int n_w;          /* event indicators of the kernel                                          */
    fmu_drive *drives; /* [n_drives]                                                            */
    unsigned char *p_set, *y_set, *u_set;
    mech_table *tables;
    uint32_t *elements; /* references of the elements of arrays, for derivatives                   */
    void *saved; /* all that changes, before a step */
    fmu_logger *log;
    void *environment, *callback; /* for the functions of one version */
    char *name;
};

enum { FMU_N_CATEGORIES = 5, FMU_LOG_EVENTS = 4 };
extern const char *const fmu_categories[FMU_N_CATEGORIES];

/* NULL: no memory, or another token. */
fmu *fmu_create(const char *name, const char *token, int is_co_simulation, fmu_logger *log, void *environment,
                void *callback, int logging);
void fmu_destroy(fmu *f);
void fmu_reset(fmu *f);
int fmu_fail(fmu *f, int status, const char *format, ...);
/* A message that is no complaint. */
void fmu_tell(fmu *f, int category, const char *message);
/* FMU_OK if the present mode is among `modes`, else logs. */
int fmu_allowed(fmu *f, int modes, const char *function);
int fmu_set_categories(fmu *f, int on, size_t n, const char *const *names);

int fmu_plan_experiment(fmu *f, int tolerance_defined, mech_real tolerance, mech_real start, int stop_defined,
                        mech_real stop);
int fmu_enter_initialisation(fmu *f);
int fmu_exit_initialisation(fmu *f);
/* What a value reference refers to, and its index there. */
enum fmu_place fmu_find(const fmu *f, uint32_t vr, int *index);
int fmu_get(fmu *f, enum fmu_type type, const uint32_t *vr, size_t n, mech_real *value);
int fmu_set(fmu *f, enum fmu_type type, const uint32_t *vr, size_t n, const mech_real *value);
/* The derivative of an input that drives, of order 1 or 2: the same as to set the input that holds it. */
int fmu_set_input_derivative(fmu *f, uint32_t vr, int order, mech_real value);
int fmu_set_time(fmu *f, mech_real t);
int fmu_set_states(fmu *f, const mech_real *y, size_t n);
int fmu_get_states(fmu *f, mech_real *y, size_t n);
int fmu_get_rates(fmu *f, mech_real *dy, size_t n);
int fmu_get_indicators(fmu *f, mech_real *w, size_t n);
/* After an accepted step of the importer: assertions, drift; `event`: the state must be projected. */
int fmu_completed_step(fmu *f, int *event);
/* One pass of event mode. */
int fmu_update(fmu *f, fmu_news *news);

int fmu_derivative(fmu *f, int adjoint, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns,
                   size_t n_knowns, const mech_real *seed, mech_real *result);
/* The same with arrays: counts of values are those of their elements. */
int fmu_get_arrays(fmu *f, const uint32_t *vr, size_t n, mech_real *value, size_t n_values);
int fmu_set_arrays(fmu *f, const uint32_t *vr, size_t n, const mech_real *value, size_t n_values);
int fmu_derivative_arrays(fmu *f, int adjoint, const uint32_t *unknowns, size_t n_unknowns, const uint32_t *knowns,
                          size_t n_knowns, const mech_real *seed, size_t n_seed, mech_real *result, size_t n_result);
/* Derivatives of outputs by time, of first order, with inputs at rest. */
int fmu_output_derivative(fmu *f, uint32_t vr, int order, mech_real *result);

/* Steps to t + h. `stop_asked` is asked after each step of the solver, NULL: never. */
int fmu_step(fmu *f, mech_real t, mech_real h, int (*stop_asked)(fmu *f, mech_real t, mech_real *until),
             fmu_news *news);

/* Bytes of a state of an FMU with delays grow with what these look back at; of the present state where none is given. */
size_t fmu_saved_size(const fmu *f, const void *state);
int fmu_save(fmu *f, void **state);
int fmu_load(fmu *f, const void *state);
int fmu_check_state(fmu *f, const void *bytes, size_t size);
int fmu_copy_state(fmu *f, const void *bytes, size_t size, void **state);

/* Tolerance and times of the experiment, and the inputs, as the solver wants them. */
void fmu_set_experiment(fmu *f);
void fmu_list_tables(fmu *f);
/* Inputs that drive move on from their values and derivatives until `end`. */
void fmu_plan_drives(fmu *f, mech_real end);
/* They stand where these have led them at the present time. */
void fmu_follow_drives(fmu *f);
/* What they are told now is what they were told last. */
void fmu_begin_drives(fmu *f);
/* An importer that moves one without telling its derivatives is an error. */
int fmu_check_drives(fmu *f);
/* The largest distance of a unit quaternion from length one. */
mech_real fmu_off_unit(const fmu *f);
/* Moves y onto the constraints: 0, or MECH_OFF_CONSTRAINTS. */
int fmu_project(fmu *f);
/* The same for an initial state after a change from outside. */
int fmu_assemble(fmu *f);
/* Tells why a run failed; gives the status. */
int fmu_failed(fmu *f, int outcome);
int fmu_undefined(fmu *f, const char *what);
int fmu_finite(const mech_real *x, int n);
int fmu_refresh_inputs(fmu *f);
int fmu_refresh_rates(fmu *f);
int fmu_refresh_outputs(fmu *f);
int fmu_refresh_parameters(fmu *f);
int fmu_refresh_initial(fmu *f);
void fmu_touch(fmu *f);

#endif
