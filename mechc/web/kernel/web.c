/* The kernel behind a few functions for a page: numbers in, numbers out, no imports. It is built once (build_kernels.py);
 * compiler/targets/wasm adds a model, and writes the address of its plan to web_slot.
 *
 * All arrays live here; the page reads and writes them in place. A run is: write what is set (p and set, u and u_set,
 * y0 and y_given), web_settle, which adds what the experiment sets and gives its numbers, web_times, web_begin, then
 * web_run. A status below zero of web_run is that of the solver.
 */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "model.h"
#include "solver.h"
#include "start.h"
#include "web_kind.h" /* WEB_EVENTS: whether this kernel knows events (build_kernels.py) */
#include "web_plan.h"

double mech_clock(void) { return 0; } /* the page has its own */

enum { EVENTS = 4096, INSTANTS = 256 }; /* places of events and of instants, to begin with and to go on */
enum { MOST_SIDES = 4000000 };          /* numbers of both sides of instants: later ones are not kept */

const web_plan *web_slot;

static const mech_model *model;
static int ny, n_scene, n_settings;
static long n_rows;
static double begin_time, stop_time;
static mech_real *p, *u, *given_u, *z, *y0, *plain, *nominal, *atol_, *grid, *rows, *zs, *outs, *scenes, *instants, *other, *last;
static unsigned char *set, *u_set, *y_given;
static mech_real *numbers, *chosen, *sides;
static unsigned char *fixed;
static mech_event *events;
static long event_room, n_events, instant_room, n_instants, n_sides;
static int instants_full; /* later ones were written over each other */
static mech_table *tables, *held; /* held: those that the page was written with, by input; n is 0 where there is none */
static mech_real zero, *stops;
static int n_tables, n_stops;
static mech_report report;
static int sizes[12];

static void *take(size_t n, size_t size) { return calloc(n > 0 ? n : 1, size); }

/* Numbers of an instant: its time, states and discretes on both sides (journal.c). */
static size_t instant_width(void) { return 1 + 2 * (size_t)(ny + model->nz); }

/* Numbers of: states, parameters with constants, parameters, inputs, discretes, outputs, numbers of the picture. */
int *EXPORT(web_sizes)(void) { return sizes; }

void *EXPORT(web_array)(int which)
{
    void *const arrays[] = {p, set, given_u, u_set, y0, y_given, nominal, grid, rows, outs, scenes, events, other, zs, numbers, sides};
    return arrays[which];
}

int EXPORT(web_open)(int row_count)
{
    model = web_slot->model;
    ny = model->nq + model->nv + model->nx, n_rows = row_count;
    n_scene = web_slot->n_still + web_slot->n_moving, n_settings = web_slot->n_settings;
    const int all[12] = {ny, model->np + model->nh, model->np, model->nu, model->nz, model->n_outputs, n_scene};
    memcpy(sizes, all, sizeof sizes);
    p = take((size_t)(model->np + model->nh), sizeof *p), set = take((size_t)model->np, 1);
    u = take((size_t)model->nu, sizeof *u), given_u = take((size_t)model->nu, sizeof *u), u_set = take((size_t)model->nu, 1);
    z = take((size_t)model->nz, sizeof *z);
    y0 = take((size_t)ny, sizeof *y0), plain = take((size_t)ny, sizeof *y0), y_given = take((size_t)ny, 1);
    numbers = take((size_t)(web_slot->n_numbers + n_settings), sizeof *numbers);
    chosen = take((size_t)n_settings, sizeof *chosen), fixed = take((size_t)n_settings, 1);
    nominal = take((size_t)ny, sizeof *y0), atol_ = take((size_t)ny, sizeof *y0);
    grid = take((size_t)n_rows, sizeof *grid);
    rows = take((size_t)(n_rows * ny), sizeof *rows), other = take((size_t)(n_rows * ny), sizeof *rows);
    zs = take((size_t)(n_rows * model->nz), sizeof *zs);
    outs = take((size_t)(n_rows * model->n_outputs), sizeof *outs);
    scenes = take((size_t)(n_rows * n_scene), sizeof *scenes);
    tables = take((size_t)model->nu, sizeof *tables), held = take((size_t)model->nu, sizeof *held);
    if (WEB_EVENTS && model->hybrid) {
        events = take(event_room = EVENTS, sizeof *events);
        instants = take((size_t)(instant_room = INSTANTS) * instant_width(), sizeof *instants);
    }
    return 0;
}

/* Where to write the table of an input: n times, then values, then slopes. */
mech_real *EXPORT(web_table)(int input, int interpolation, int n)
{
    mech_real *at = take(3 * (size_t)n, sizeof *at);
    if (at)
        held[input] = (mech_table){input, interpolation, n, at, at + n, at + 2 * n};
    return at;
}

/* Where to write the times at which tables have kinks. */
mech_real *EXPORT(web_stops)(int n)
{
    stops = take((size_t)n, sizeof *stops);
    n_stops = stops ? n : 0;
    return stops;
}

void EXPORT(web_times)(double begin, double start, double stop)
{
    begin_time = begin, stop_time = stop;
    for (long i = 0; i < n_rows; i++)
        grid[i] = i < n_rows - 1 ? start + (double)i * ((stop - start) / (double)(n_rows - 1)) : stop;
}

static void input_tables(int with_held)
{
    n_tables = 0;
    for (int i = 0; i < model->nu; i++)
        if (with_held && held[i].n)
            tables[n_tables++] = held[i];
        else if (u_set[i])
            tables[n_tables++] = (mech_table){i, MECH_STEP, 1, &zero, given_u + i, &zero};
}

static void inputs_at(mech_real t, int with_held)
{
    input_tables(with_held);
    if (model->nu)
        mech_evaluate_inputs(model, tables, n_tables, 1, &t, p, u);
}

static unsigned char *flag(const web_setting *setting)
{
    unsigned char *const flags[] = {set, y_given, u_set};
    return flags[setting->array] + setting->index;
}

static int same(mech_real a, mech_real b) { return a == b || (a != a && b != b); }

/* Settings of the experiment may depend on parameters that it sets: evaluated until nothing changes; -1 where it does.
 * What the page has set already stays; tables are of the run alone. */
int EXPORT(web_settle)(void)
{
    mech_function *const experiment = web_slot->experiment;
    for (int k = 0; k < n_settings; k++)
        fixed[k] = *flag(&web_slot->settings[k]), chosen[k] = zero / zero;
    model->parameters(p, set);
    for (int round = 0; experiment && round < n_settings + 2; round++) {
        inputs_at(0, 0);
        for (int i = 0; i < ny; i++) plain[i] = zero / zero;
        for (int i = 0; i < model->nz; i++) z[i] = zero / zero;
        if (model->discretes)
            model->discretes(0, plain, u, z, p, z);
        model->initial(0, plain, u, z, p, plain);
        experiment(0, plain, u, z, p, numbers);
        int changed = 0;
        for (int k = 0; k < n_settings; k++) {
            const web_setting *s = &web_slot->settings[k];
            const mech_real value = numbers[web_slot->n_numbers + k];
            if (fixed[k] || same(value, chosen[k])) continue;
            mech_real *const values[] = {p, y0, given_u};
            values[s->array][s->index] = chosen[k] = value;
            *flag(s) = s->array == IN_Y && s->guess ? MECH_GUESSED : MECH_KNOWN;
            changed = 1;
        }
        if (!changed) return 0;
        model->parameters(p, set);
    }
    return experiment ? -1 : 0;
}

/* What the run begins with; 0, or how the assembly failed. Values that were set are in p, given_u and y0. */
int EXPORT(web_begin)(void)
{
    inputs_at(begin_time, 1);
    mech_start_report told;
    const int status = mech_start_state(model, begin_time, y_given, u, z, p, y0, plain, &told);
    return status || mech_start_found(model, begin_time, y0, u, z, p, set) < 0 ? status : MECH_START_UNDEFINED;
}

/* Whether there is room for so many events, of which those that happened stay. */
static int room_for_events(long count)
{
    if (count <= event_room) return 1;
    mech_event *larger = realloc(events, 2 * (size_t)count * sizeof *events);
    if (!larger) return 0;
    events = larger, event_room = 2 * count;
    return 1;
}

/* Whether there is room for so many instants, of which those that were kept stay. */
static int room_for_instants(long count)
{
    if (count <= instant_room) return 1;
    if (2 * (size_t)count * instant_width() > MOST_SIDES) return 0;
    mech_real *larger = realloc(instants, 2 * (size_t)count * instant_width() * sizeof *instants);
    if (!larger) return 0;
    instants = larger, instant_room = 2 * count;
    return 1;
}

static int run(double tolerance, int method, double step, double dt_max, mech_real *into)
{
    mech_options o;
    memset(&o, 0, sizeof o);
    o.tables = tables, o.n_tables = n_tables, o.stops = stops, o.n_stops = n_stops;
    o.method = method, o.n_grid = n_rows, o.t0 = begin_time, o.apart = (stop_time - begin_time) / MECH_LOOKS;
    o.dt_max = dt_max, o.dt = step, o.rtol = tolerance, o.halves = into == other;
    o.atol = atol_, o.y0 = y0, o.z = z, o.p = p, o.grid = grid, o.grid_y = into, o.grid_z = zs;
    if (WEB_EVENTS && model->hybrid)
        o.events = events, o.event_capacity = event_room, o.instants = instants, o.instant_capacity = instant_room;
    for (int i = 0; i < ny; i++)
        atol_[i] = tolerance * nominal[i];
    mech_solver *solver = mech_create(model, &o);
    if (!solver)
        return -100;
    int status;
    long calls = 2000, before = 0, kept = 0;
    int full = 0;
    do {
        status = mech_advance(solver, stop_time, 10000);
        if (status == MECH_RUNNING) calls--;
        if (WEB_EVENTS && status == MECH_EVENTS_FULL) {
            mech_read(solver, &report, last);
            before += report.n_events;
            if (!room_for_events(before + EVENTS)) break;
            if (!full && room_for_instants(kept + report.n_instants + INSTANTS))
                kept += report.n_instants;
            else
                full = 1;
            mech_set_events(solver, events + before, event_room - before, instants + (size_t)kept * instant_width(),
                            instant_room - kept);
            status = MECH_RUNNING;
        }
    } while (status == MECH_RUNNING && calls > 0);
    mech_read(solver, &report, last);
    n_events = before + report.n_events, n_instants = full ? kept : kept + report.n_instants, instants_full = full;
    mech_free(solver);
    return status;
}

static void scene(mech_real t, const mech_real *y, const mech_real *held, mech_real *out)
{
    if (web_slot->still) web_slot->still(t, y, u, held, p, out);
    if (web_slot->moving) web_slot->moving(t, y, u, held, p, out + web_slot->n_still);
}

/* The picture at the state of web_begin, in the first row of scenes. */
void EXPORT(web_picture)(void)
{
    if (n_scene) scene(begin_time, y0, z, scenes);
}

/* Both sides of each instant: its time, states and outputs before it, states and outputs after it. */
static void both_sides(void)
{
    const int n_out = model->n_outputs;
    const size_t width = 1 + 2 * (size_t)(ny + n_out);
    n_sides = 0;
    if (!n_instants) return;
    mech_real *found = realloc(sides, (size_t)n_instants * width * sizeof *sides);
    if (!found) {
        instants_full = 1;
        return;
    }
    sides = found, n_sides = n_instants;
    for (long i = 0; i < n_instants; i++) {
        const mech_real *at = instants + (size_t)i * instant_width();
        mech_real *to = sides + (size_t)i * width;
        to[0] = at[0];
        for (int side = 0; side < 2; side++) {
            const mech_real *y = at + 1 + side * (ny + model->nz);
            mech_real *row = to + 1 + side * (ny + n_out);
            memcpy(row, y, (size_t)ny * sizeof *row);
            if (n_out) mech_evaluate(model, model->outputs, n_out, tables, n_tables, 1, at, y, y + ny, p, u, row + ny);
        }
    }
}

/* From the state of web_begin: rows, outputs, the picture and both sides of events; the status of the solver. */
int EXPORT(web_run)(double tolerance, int method, double step, double dt_max)
{
    mech_options o;
    memset(&o, 0, sizeof o);
    o.tables = tables, o.n_tables = n_tables, o.stops = stops, o.n_stops = n_stops;
    o.method = method, o.t0 = begin_time, o.dt_max = dt_max, o.y0 = y0, o.z = z, o.p = p;
    if (mech_nominal_values(model, web_slot->sizes, &o, stop_time, plain, nominal))
        return -100;
    const int status = run(tolerance, method, step, dt_max, rows);
    const long n = report.n_grid;
    const int n_out = model->n_outputs;
    for (long i = 0; i < n; i++) {
        const mech_real *held = model->hybrid ? zs + i * model->nz : z, *y = rows + i * ny;
        if (n_out)
            mech_evaluate(model, model->outputs, n_out, tables, n_tables, 1, grid + i, y, held, p, u, outs + i * n_out);
        else if (model->nu)
            mech_evaluate_inputs(model, tables, n_tables, 1, grid + i, p, u);
        if (n_scene)
            scene(grid[i], y, held, scenes + i * n_scene);
    }
    if (WEB_EVENTS) both_sides();
    return status;
}

/* The same again at another tolerance, into `other`: what the error is estimated from. */
int EXPORT(web_again)(double tolerance, int method, double step, double dt_max)
{
    const mech_report first = report;
    const int status = run(tolerance, method, step, dt_max, other);
    const long n = report.n_grid;
    report = first;
    return status == MECH_REACHED || status == MECH_TERMINATED ? (int)n : -1;
}

int EXPORT(web_n_grid)(void) { return (int)report.n_grid; }
int EXPORT(web_n_events)(void) { return (int)n_events; }
int EXPORT(web_n_sides)(void) { return (int)n_sides; }
int EXPORT(web_sides_full)(void) { return instants_full; }
double EXPORT(web_reached)(void) { return report.t; }
int EXPORT(web_steps)(void) { return (int)report.steps; }
int EXPORT(web_failed_index)(void) { return report.failed_index; }
int EXPORT(web_failed_part)(void) { return report.failed_part; }
double EXPORT(web_failed_value)(void) { return report.failed_value; }
double EXPORT(web_last)(int k) { return last[k]; }
