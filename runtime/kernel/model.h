/* What generated code offers the kernel: the one contract between them.
 *
 *  1. A model is one immutable struct; its functions are pure: they read their arguments,
 *     write all of `out`, keep no state and allocate nothing.
 *  2. The state is y = (q, v, x): nq coordinates, nv velocities, nx first-order states.
 *     q and v are different in number where a coordinate is a rotation (4 and 3).
 *  3. All functions have one signature, mech_function: (t, y, u, z, p, out).
 *     u: nu inputs, z: nz discrete variables, p: np parameters followed by nh hoisted constants.
 *  4. `parameters(p, set)` computes every parameter that depends on others and is not set
 *     (set[i] != 0 keeps p[i]), then all hoisted constants. It is called once before a run and after each
 *     change of a parameter. Everything else reads p only.
 *  5. `rhs`: out[ny] = dy/dt.
 *  6. `initial`: out[ny], the initial state as far as it is known or guessed; reads t, u, z and p.
 *  7. `inputs`: out[nu], the default of each input at time t; reads t and p. NULL where nu = 0.
 *  8. `discretes`: out[nz], the initial discrete variables. NULL where nz = 0.
 *  9. `outputs`: out[ny_out], everything that is reported beside the state.
 * 10. `assertions`: out[na], > 0.5 where the assertion holds. NULL where na = 0.
 * 11. `jacobian`: out[nnz], the entries of d(rhs)/dy in the order of (jac_row, jac_col). NULL where the
 *     implicit methods are left out.
 * 12. Rotations: `rotations[k]` is the index in y of the first of four quaternion entries (scalar first),
 *     of unit length on entry; the kernel renormalises after each accepted step.
 * 13. A function that meets an undefined value returns not-a-number in `out`; it never traps.
 * 14. Constraints: n_velocity rows K v + b = 0, of which n_position come from positions phi(q, t) = 0.
 *     `project_position`: out[nv + n_position], a correction d in the space of velocities, then phi;
 *     `project_velocity`: out[nv + n_velocity], a correction of v, then K v + b;
 *     `displace`: out[nq] = N(q) d, with d in the place of v in y. NULL where there is nothing to project.
 *     `closeness`: out[1], from 0 (far) to 1: how close a state is to a singular position, in which the rows are linearly
 *     dependent; the model passes it with compliant multipliers. NULL where it has none.
 * 15. `separable`: 1 where q' = v, the accelerations depend on q, t, u(t) and p alone, and x contains only accounts: the last
 *     n_accounts of x, integrals that no derivative reads, except as an initial guess that does not change the result.
 * 16. For the methods on momenta, which need q' = v, no x but accounts, and all constraints from positions, in
 *     one order: `momentum`: out[nv] = dL/dv; `force`: out[nv] = dL/dq + Q, without the forces of constraints;
 *     `mass`: out[nv][nv] = d(momentum)/dv; `constraints`: out[n_position + n_velocity], phi, then K v + b;
 *     `constraint_jacobian`: out[n_velocity][nv] = K; the last two NULL where there are no constraints.
 * 17. `hybrid` is NULL where nothing switches. The kernel then owns z during a run: behind the user's
 *     discrete variables it holds switches, clocks, modes of rows, and places for impulses.
 * 18. `start` is NULL where an initial state is as `initial` says. Else `assembly`: out[n_rows], residuals of
 *     what an initial state must fulfil, rows of stage 1 between coordinates and of stage 2 with velocities;
 *     `assembly_jacobian`: out[n_rows][nv], of a row of stage 1 by displacements in the space of velocities, of
 *     stage 2 by v; `others`: out[n_dependent], the initial values y[dependent[k]] that follow from those of others.
 * 19. `series` is NULL where nobody asks for Taylor series. Each operation that is not linear is one or two slots,
 *     pairs of series A, B whose sums M_k = A_1 B_(k-1) + ... + A_(k-1) B_1 the kernel forms; the rest of order k is
 *     linear. `start`: out[ny + n_kept], the rates, then what all orders read. `next`: t = k, y = coefficients of order
 *     k of the state, u = M_k of the slots, then 1/k and the coefficient of t, z = what was kept; out = coefficients of
 *     order k of the rates, of all A and of all B. In u and out each of these begins at a multiple of MECH_LANES.
 *     Where slots are few, `next` may be NULL and `expand` does all of it: x[order + 1][], of which it reads the coefficients of
 *     order 1 of the state and writes those of 2 to `order`; rows[order][]: A_k, then B_k from order 1 on, of order 0 its own
 *     numbers. Rows consist of whole MECH_LANES, and begin at multiples of 64 bytes.
 * 20. `hybrid->delays` is NULL in models without delays. Else z[delayed] is the delayed value of a source at the time
 *     at which a function is called: the kernel writes it. Delays are positive and do not change during a run.
 */
#ifndef MECH_MODEL_H
#define MECH_MODEL_H

#ifndef MECH_REAL
#define MECH_REAL double
#endif
typedef MECH_REAL mech_real;

typedef void mech_function(mech_real t, const mech_real *y, const mech_real *u, const mech_real *z,
                           const mech_real *p, mech_real *out);

/* A row that can be switched: a force f in the direction of a rate r = K v + b.
 * contact: gap >= 0, f >= 0 while flag is 1, f = 0 else. friction: r = 0 while flag is 1 (sticking), f from sign
 * (of slip) else. bilateral: a constraint that is on or off. step: no force; an impulse where an energy jumps. */
enum mech_row_kind { MECH_CONTACT = 0, MECH_FRICTION = 1, MECH_BILATERAL = 2, MECH_STEP_ROW = 3 };

enum { MECH_FREEWHEEL = -2 }; /* a contact that always touches, between velocities: friction that never gives way backwards */

typedef struct mech_row {
    int kind;
    int normal;    /* friction: the row of its contact, else -1; step: its switch                */
    int flag;      /* index in z, -1: none                                                       */
    int sign;      /* index in z, -1: none; of a contact MECH_FREEWHEEL where it is one          */
    int impulse;   /* index in z                                                                 */
    int enabled;   /* index in z, -1: always                                                     */
} mech_row;

/* A row that may share a load with others (shares.h); all -1 for one that cannot. */
typedef struct mech_share_row {
    int rest;      /* index in z: 1 where it touches, or sticks, but others carry its part       */
    int share;     /* index in z of what it carries beside that, which only functions are told   */
    int sort;      /* rows of one sort have forces of one unit                                   */
} mech_share_row;

/* What row_values writes for each row. */
enum mech_row_value {
    MECH_GAP = 0,   /* distance of a contact, residual of a position constraint, else 0          */
    MECH_RATE,      /* r                                                                         */
    MECH_DRIFT,     /* b                                                                         */
    MECH_SECOND,    /* dr/dt with the present modes                                              */
    MECH_FORCE,     /* f with the present modes; step: energy behind the switch minus before it  */
    MECH_LIMIT,     /* friction: largest |f| that sticks                                         */
    MECH_COEFFICIENT, /* contact: restitution; friction in a contact: largest |f| over its f; else, for steps
                       that solve for contacts: largest force against a motion forwards, by its flag */
    MECH_EXTRA,     /* contact: approach below which it rests, < 0: relative; friction: sliding coefficient; else
                       the same backwards                                                     */
    MECH_ROW_VALUES
};

typedef struct mech_branch {
    int event;     /* branches of one event exclude each other; < 0: acts at the start only, before that is looked at */
    int n_checks;
    int terminates;
    mech_function *act; /* out[ny + nz + n_checks]: y and z, of which it writes what changes, then > 0.5 for each
                           assertion that holds */
} mech_branch;

/* Contacts whose values one function forms: gap, the part of its rate free of v, the part of its second derivative free
 * of accelerations, restitution, approach below which it rests; K for each of its velocities, bounds of |K| (< 0: none
 * is known); with friction the same two parts of the slip, the coefficients at rest and while sliding, K for each velocity
 * of the slip. Where that has two directions, these two parts and K of the second stand behind. */
typedef struct mech_crowd_kind {
    int n_leaves, n_one;       /* what it reads; how much of it the contacts of a line have in common */
    int n_normal, n_slip;      /* velocities of gap and slip                                     */
    int velocities;            /* where in table it stands which of its leaves these are         */
    int friction;              /* directions of slip: 0, 1, 2                                    */
    mech_function *values;     /* what a contact reads stands behind the inputs                  */
} mech_crowd_kind;

/* Contacts of one kind with numbers from `first` to that of the next line: one thing with each of several others. What they read,
 * indices over y, p and z, stands in table: what is common at `one`, the rest at `others`, of each after that of the one before. */
typedef struct mech_crowd_line {
    int first, kind, one, others;
} mech_crowd_line;

/* Contacts that are too many for formulas of their forces (crowd.h): z[first ...] lists those that are closed, each by
 * 8 (contact + 1) + mode. rhs and outputs of the model find their forces from what these functions give. Where steps solve for
 * contacts, `n_told` numbers stand behind the `capacity` places: 1 once a step has found forces, what these add to the
 * accelerations [nv], they along the velocities [n_efforts], and what is asked [n_asked]; outputs take these, and rhs is that without
 * the crowd. */
typedef struct mech_crowd {
    int n, n_lines, first, capacity, n_asked, n_told;
    int n_efforts;             /* nv where outputs are given forces along the velocities, else 0 */
    int nq;                    /* of the velocities, the first in y                              */
    int stepped;               /* 1: friction in two directions: only steps solve for it */
    int n_values, n_given;     /* the most values of a contact; the most that stands behind the inputs */
    const mech_crowd_kind *kinds;
    const mech_crowd_line *lines;
    const int *table;
    const int *group;          /* [nv] velocities between which forces act have one group        */
    const int *asked;          /* [n_asked][2] contact; 0: force, 1, 2: those of friction, 3: closed; behind accelerations and efforts */
    mech_function *rhs;        /* without the crowd                                              */
    mech_function *outputs;    /* of what stands behind the inputs: accelerations, efforts, then what is asked */
    mech_function *push;       /* out[nv]: jumps of v by the impulses along v behind the inputs  */
    mech_function *supply;     /* out[1]: power into the energy along the accelerations behind the inputs; NULL where nothing that moves
                                  by itself has a part in it                                     */
} mech_crowd;

/* Sources are numbers of y, u, z or the time: a delayed one is one of them a delay ago, or as it was at the start. */
enum mech_source { MECH_SOURCE_Y = 0, MECH_SOURCE_U, MECH_SOURCE_Z, MECH_SOURCE_T };

typedef struct mech_delays {
    int n_sources, n_delays, n_delayed;
    const int *sources;        /* [n_sources][2] enum mech_source, index; in that order of kinds */
    const int *delayed;        /* [n_delayed][3] index in z, of its source, of its delay         */
    mech_function *times;      /* out[n_delays], of p alone                                      */
} mech_delays;

/* Indicators g: n_switches of relations, then one for each row; those of rows stay >= 0 as long as the mode
 * holds. A switch is 1 where g < 0. Time switches change at crossing_times, clocks tick there. */
typedef struct mech_hybrid {
    int n_switches, n_times, n_clocks, n_branches, n_rows;
    int initial;                /* index in z of initial(), -1: none                             */
    int simultaneous;           /* impacts                                                       */
    int dissipated, supplied;   /* index in y, -1: none                                          */
    int total;                  /* index in outputs of the energy whose balance is kept, -1: none */
    int carried;                /* a part of it is linear in the velocities, or constraints move */
    const int *switches;        /* [n_switches] index in z                                       */
    const int *times;           /* [n_times][2] index in z, value from the crossing on           */
    const int *clocks;          /* [n_clocks][2] index in z of the pulse and of the count        */
    const mech_branch *branches;
    const mech_row *rows;
    mech_function *indicators;      /* out[n_switches + n_rows]                                  */
    mech_function *indicator_rates; /* the same of dg/dt; 0 where it is not known                */
    mech_function *crossing_times;  /* out[n_times + n_clocks]                                   */
    mech_function *conditions;      /* out[n_branches]                                           */
    mech_function *row_values;      /* out[n_rows][MECH_ROW_VALUES]                              */
    mech_function *respond;         /* out[nv + n_rows]: change of v and of every r by the impulses in z */
    const mech_crowd *crowd;        /* NULL where all rows have formulas                         */
    const int *slides;              /* [n_switches] the switch of the mode in which the motion slides along the surface of
                                     * each, -1: none; NULL where no motion slides */
    const mech_delays *delays;  /* NULL where nothing looks back                                 */
    const mech_share_row *shares;   /* [n_rows] NULL where nothing is told of shared loads          */
    int n_leading_switches, n_leading_branches; /* the first ones, of frictions on what has no mass: they change before
                                                 * others are asked */
    int narrow;                 /* indicators may change within a small part of a step: they are looked at closely */
    int n_told, first_told;     /* what laws ask of forces and contacts where steps solve for these: z[first_told] is 1 while such a step
                                 * forms its rates, and the answers behind it are those at its beginning */
    mech_function *told;        /* out[n_told], in the present modes; NULL where laws ask for nothing */
} mech_hybrid;

typedef struct mech_start_row {
    int stage;     /* 1 or 2                                                                     */
    int hard;      /* 0: wished only                                                             */
    int measure;   /* 1: a pure number, 2: a length (of one that must hold, or their rates), 0: anything else */
} mech_start_row;

/* Known values stay in an assembly; guesses move as little as possible, measured by their sizes. */
typedef struct mech_start {
    int n_rows, n_lengths, n_dependent;
    const mech_start_row *rows;
    const unsigned char *known; /* [ny] 0: guessed                                               */
    const int *partner;         /* [nv] index in y of the coordinate, of the first entry of a rotation */
    const mech_real *size;      /* [nv] of that coordinate; 0: the size of lengths               */
    const int *lengths;         /* [n_lengths] index in p of the parameters that are lengths     */
    const int *dependent;
    mech_function *assembly, *assembly_jacobian, *others;
    int n_found;
    const int *found;           /* [n_found] in p: parameters that the start finds                */
    mech_function *find;        /* out[n_found], of a state that is assembled                     */
} mech_start;

#define MECH_LANES 8

typedef void mech_expansion(int order, const mech_real *kept, const mech_real *p, mech_real *x, mech_real *rows);

typedef struct mech_series {
    int n_slots, n_kept;
    mech_function *start, *next;
    mech_expansion *expand;
} mech_series;

typedef struct mech_model {
    int version;                   /* MECH_MODEL_VERSION of the header it was made with   */
    int nq, nv, nx;                /* sizes of q, v, x; ny = nq + nv + nx                 */
    int nu, nz, np, nh;            /* inputs, discrete variables, parameters, hoisted     */
    int n_outputs, n_assertions;
    int n_rotations;
    const int *rotations;          /* [n_rotations] first index in y                      */
    int n_jacobian;
    const int *jac_row, *jac_col;  /* [n_jacobian]                                        */
    void (*parameters)(mech_real *p, const unsigned char *set);
    mech_function *rhs, *initial, *inputs, *discretes, *outputs, *assertions, *jacobian;
    int n_position, n_velocity;    /* rows of constraints                                 */
    int separable, n_accounts;
    mech_function *project_position, *project_velocity, *displace, *closeness;
    mech_function *momentum, *force, *mass, *constraints, *constraint_jacobian;
    const mech_hybrid *hybrid;
    const mech_start *start;
    const mech_series *series;
} mech_model;

#define MECH_MODEL_VERSION 12

#endif
