"""The text of the main program that a model is written with as C: it runs the model and prints its motion."""

from __future__ import annotations

MAIN = """\
/* Runs the model and prints its motion as CSV, {told}, in SI units.
 *
 *   cc -std=c11 -O2 -o {name} *.c -lm
 *   ./{name} [stop [tolerance]]
 *
 * The model is in {name}.c; the other files are what it and its method need of the kernel that
 * integrates it (see solver.h and start.h).
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "model.h"
#include "start.h"

const mech_model *mech_model_get(void);

{spacing}
/* What nominal values are made from: of each state a number for its unit, its kind (start.h), whether that is a pure
   number, the declared nominal, the size of the declared range, and a number for what it feels. */
static const mech_quantity states[] = {{
{quantities}}};
static const int partner[] = {{{partner}}}, units[] = {{{units}}}, energies[] = {{{energies}}};
static const mech_sizes sizes = {{states, partner, units, {n_energies}, energies}};

static mech_real *reals(size_t n)
{{
    mech_real *array = calloc(n > 0 ? n : 1, sizeof *array);
    if (array == NULL) {{
        fputs("out of memory\\n", stderr);
        exit(1);
    }}
    return array;
}}

static double number(const char *text, const char *what, double least, double most)
{{
    char *end;
    const double value = strtod(text, &end);
    if (end == text || *end != '\\0' || !(value >= least && value <= most)) {{
        fprintf(stderr, "the %s is a number from %g to %g, not '%s'\\n", what, least, most, text);
        exit(2);
    }}
    return value;
}}

int main(int argc, char **argv)
{{
    if (argc > 3) {{
        fprintf(stderr, "usage: %s [stop [tolerance]]\\n", argv[0]);
        return 2;
    }}
    const mech_model *model = mech_model_get();
    const double begin = {begin!r}, start = {start!r}, stop = argc > 1 ? number(argv[1], "stop time", start, 1e300) : {stop!r};
    const double tolerance = argc > 2 ? number(argv[2], "tolerance", 1e-15, 0.1) : {tolerance!r};
    const int ny = model->nq + model->nv + model->nx, n_out = model->n_outputs;
    mech_real *p = reals((size_t)(model->np + model->nh)), *u = reals((size_t)model->nu);
    mech_real *z = reals((size_t)model->nz), *y0 = reals((size_t)ny), *plain = reals((size_t)ny), *atol = reals((size_t)ny);
{count}    mech_real *grid = reals(n_rows), *rows = reals(n_rows * (size_t)ny), *zs = reals(n_rows * (size_t)model->nz), *out = reals((size_t)n_out);
    unsigned char *set = calloc((size_t)model->np + 1, 1);
    if (set == NULL)
        return 1;

    /* To change parameter i, write p[i] and set[i] = 1; those that depend on it follow. */
{parameters}    model->parameters(p, set);
{tables}    if (model->nu)
        mech_evaluate_inputs(model, tables, {n_tables}, 1, &begin, p, u);
{initial}{grid}
    mech_options options = {{0}};
    options.method = mech_method_index("{method}");
    options.dt = {step!r};
    options.n_grid = (long)n_rows;
    options.dense = 1;
    options.t0 = begin;
    options.dt_max = stop > begin ? (stop - begin) / 10 : 1;
    options.apart = (stop - begin) / MECH_LOOKS;
    options.rtol = tolerance;
    options.atol = atol;
    options.tables = tables;
    options.n_tables = {n_tables};
    options.y0 = y0;
    options.z = z;
    options.p = p;
    options.grid = grid;
    options.grid_y = rows;
    options.grid_z = zs;
    if (mech_nominal_values(model, &sizes, &options, stop, plain, atol) != 0) {{
        fputs("out of memory\\n", stderr);
        return 1;
    }}
    for (int i = 0; i < ny; i++)
        atol[i] *= tolerance;
    mech_solver *solver = mech_create(model, &options);
    if (solver == NULL) {{
        fputs("the solver cannot be made\\n", stderr);
        return 1;
    }}
    int status;
    do
        status = mech_advance(solver, stop, 100000);
    while (status == MECH_RUNNING);
    mech_report report;
    mech_read(solver, &report, y0);

    puts("{header}");
    for (long i = 0; i < report.n_grid; i++) {{
        const mech_real *y = rows + i * ny, *now = model->hybrid ? zs + i * model->nz : z;
        printf("%.17g", (double)grid[i]);
        for (int k = 0; k < ny; k++)
            printf(",%.17g", (double)y[k]);
        if (n_out > 0)
            mech_evaluate(model, model->outputs, n_out, tables, {n_tables}, 1, &grid[i], y, now, p, u, out);
        for (int k = 0; k < n_out; k++)
{unless}            printf(",%.17g", (double)out[k]);
        putchar('\\n');
    }}
    if (status == MECH_TERMINATED)
        status = MECH_REACHED;
    if (status != MECH_REACHED)
        fprintf(stderr, "stopped at t = %.17g\\n", (double)report.t);
    mech_free(solver);
    return status == MECH_REACHED ? 0 : 1;
}}
"""


ROWS = 501
"""Rows of a motion whose output has no stated spacing."""

EVEN_SPACING = f"""\
enum {{ ROWS = {ROWS} }};
"""
EVEN_COUNT = """\
    const size_t n_rows = stop > start ? ROWS : 1;
"""
EVEN_GRID = """\
    for (size_t i = 0; i < n_rows; i++)
        grid[i] = i < n_rows - 1 ? start + (double)i * ((stop - start) / (ROWS - 1)) : stop;
"""

STATED_SPACING = """\
/* Time from one row to the next, and the most numbers that are kept. */
static const double EVERY = {every!r}, MOST = {most!r};
"""
STATED_COUNT = """\
    const double intervals = floor((stop - start) / EVERY * (1 + 1e-12));
    if (!((intervals + 2) * (ny + model->nz + 1) <= MOST)) {
        fprintf(stderr, "a row every %g of %g are too many\\n", EVERY, stop - start);
        return 2;
    }
    const int whole = stop - (start + EVERY * intervals) < 1e-9 * EVERY; /* the last interval ends at the stop */
    const size_t n_rows = (size_t)intervals + (whole ? 1 : 2);
"""
STATED_GRID = """\
    for (size_t i = 0; i < n_rows; i++)
        grid[i] = i < n_rows - 1 ? start + EVERY * (double)i : stop;
"""

PLAIN_START = """\
    if (model->discretes)
        model->discretes(begin, y0, u, z, p, z);
    model->initial(begin, y0, u, z, p, y0);
{initial}    mech_normalise(model, y0);
    for (int i = 0; i < ny; i++)
        plain[i] = y0[i];
"""

ASSEMBLED_START = """\
    static const char *const rows_of_start[] = {{{rows}}};
    /* To set initial value i, write y0[i] and given[i] = MECH_KNOWN, or MECH_GUESSED for a guess. */
    unsigned char *given = calloc((size_t)ny + 1, 1);
    if (given == NULL)
        return 1;
{initial}    mech_start_report made;
    if (mech_start_state(model, begin, given, u, z, p, y0, plain, &made) != MECH_STARTED) {{
        fprintf(stderr, "the initial state cannot be assembled%s%s\\n", made.row < 0 || made.status == MECH_START_UNDEFINED
                ? "" : ": ", made.row < 0 || made.status == MECH_START_UNDEFINED ? "" : rows_of_start[made.row]);
        return 1;
    }}
"""
FOUND_PARAMETERS = """\
    if (mech_start_found(model, begin, y0, u, z, p, set) >= 0) {
        fputs("no value is found for a parameter of the start\\n", stderr);
        return 1;
    }
"""
