"""Write a model as code that stands alone: a Python module, or a folder of C files."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterable
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct

from .compiler.pipeline import program_with
from .runtime.methods import KERNEL_METHODS, parts_for
from .settings import UsageMistake

if TYPE_CHECKING:
    from .compiler.program.model import Program
    from .model import CompiledModel
    from .runtime.problem import Problem

MAIN = """\
/* Runs the model and prints its motion as CSV, 501 rows, in SI units.
 *
 *   cc -std=c11 -O2 -o {name} *.c -lm
 *   ./{name} [stop [tolerance]]
 *
 * The model is in {name}.c; the other files are what it and its method need of the kernel that
 * integrates it (see solver.h).
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "model.h"
#include "solver.h"

const mech_model *mech_model_get(void);

enum {{ ROWS = 501 }};

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
    const double stop = argc > 1 ? number(argv[1], "stop time", 0, 1e300) : {stop!r};
    const double tolerance = argc > 2 ? number(argv[2], "tolerance", 1e-15, 0.1) : {tolerance!r};
    const int ny = model->nq + model->nv + model->nx, n_out = model->n_outputs;
    mech_real *p = reals((size_t)(model->np + model->nh)), *u = reals((size_t)model->nu);
    mech_real *z = reals((size_t)model->nz), *y0 = reals((size_t)ny), *atol = reals((size_t)ny);
    mech_real *grid = reals(ROWS), *rows = reals((size_t)(ROWS * ny)), *zs = reals((size_t)(ROWS * model->nz)), *out = reals((size_t)n_out);
    unsigned char *set = calloc((size_t)model->np + 1, 1);
    if (set == NULL)
        return 1;

    /* To change parameter i, write p[i] and set[i] = 1; those that depend on it follow. */
{parameters}    model->parameters(p, set);
    if (model->inputs)
        model->inputs(0, y0, u, z, p, u);
    if (model->discretes)
        model->discretes(0, y0, u, z, p, z);
    model->initial(0, y0, u, z, p, y0);
{initial}    for (int i = 0; i < ny; i++)
        atol[i] = tolerance * fmax(fabs((double)y0[i]), 1.0);
    for (int i = 0; i < ROWS; i++)
        grid[i] = stop * i / (ROWS - 1);

    mech_options options = {{0}};
    options.method = mech_method_index("{method}");
    options.dt = {step!r};
    options.n_grid = ROWS;
    options.dt_max = stop > 0 ? stop / 10 : 1;
    options.rtol = tolerance;
    options.atol = atol;
    options.y0 = y0;
    options.z = z;
    options.p = p;
    options.grid = grid;
    options.grid_y = rows;
    options.grid_z = zs;
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
        if (n_out > 0) {{
            if (model->inputs)
                model->inputs(grid[i], y, u, z, p, u);
            model->outputs(grid[i], y, u, now, p, out);
        }}
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


class Defaults(Struct, frozen=True):
    """What the default experiment says: stop, tolerance, and the values it sets by index of p and y."""

    stop: float = 10.0
    tolerance: float = 1e-9
    parameters: tuple[tuple[int, float], ...] = ()
    initial: tuple[tuple[int, float], ...] = ()
    method: str = "dop853"
    step: float = 0.0


def export(model: CompiledModel, target: str, output: Path | None) -> tuple[Path, ...]:
    """Write the files of a target and return them. Raises UsageMistake for an unknown target."""
    program = model.compilation.program
    name = file_stem(program.name)
    match target:
        case "python":
            from .compiler.targets.python import emit_python

            if program.hybrid is not None:
                raise UsageMistake(
                    f"'{program.name}' switches (events, contacts, friction, or laws that change with the motion), "
                    "which a Python module cannot run",
                    "the targets c and fmu can",
                )
            return _write({output or Path(f"{name}.py"): emit_python(program)})
        case "c":
            folder = output or Path(f"{name}_c")
            if folder.suffix:
                raise UsageMistake("the C target writes a folder", f"as in -o {name}_c")
            defaults = defaults_of(model.problem("python"))
            parts = model.compilation.parts
            program = program_with(model.compilation, parts_for(defaults.method))
            files = c_files(program, defaults, parts)
            return _write({folder / file: text for file, text in files.items()})
        case _:
            raise UsageMistake(f"there is no target '{target}'", "python or c")


def file_stem(model: str) -> str:
    """Make the name of a file: ``DoublePendulum`` gives ``double_pendulum``."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", model).lower()


def defaults_of(problem: Problem) -> Defaults:
    """Evaluate the default experiment. A model that says no stop time gets ten seconds."""
    from .runtime.case import SimulationOptions, find_experiment, prepare
    from .runtime.functions import load_functions

    experiment = find_experiment(problem, None)
    said = experiment is not None and "stop" in experiment.options
    options = SimulationOptions(stop=None if said else Defaults().stop)
    case = prepare(problem, load_functions(problem), options)
    settings = experiment.settings if experiment else ()
    return Defaults(
        case.stop,
        case.tolerance,
        tuple((s.index, float(case.p[s.index])) for s in settings if s.array == "p"),
        tuple((s.index, float(case.y0[s.index])) for s in settings if s.array == "y"),
        case.method if case.method in KERNEL_METHODS and case.method != "auto" else Defaults().method,
        case.step or 0.0,
    )


def c_files(program: Program, defaults: Defaults, parts: Collection[str] = ()) -> dict[str, str]:
    """Return the C files by name: the model, what it and its method need of the kernel, and a main program.

    ``parts``: what is kept though the model does not need it (equations/needs.py).
    """
    from .compiler.targets.c import emit_c
    from .compiler.targets.kernel_files import needed_kernel
    from .runtime.native.kernel import kernel_sources

    name = file_stem(program.name)
    model = f"{name}_model.c" if f"{name}.c" in kernel_sources() else f"{name}.c"
    states, outputs = program.arrays["y"], program.arrays["out"]
    known = {e.name for e in states}  # accounts of energy are states and outputs
    twice = [k for k, e in enumerate(outputs) if e.name in known]
    entries = [*program.arrays["t"][:1], *states, *(e for e in outputs if e.name not in known)]
    parameters = [f"    p[{i}] = {value!r};\n    set[{i}] = 1;\n" for i, value in defaults.parameters]
    main = MAIN.format(
        name=name,
        method=defaults.method,
        step=defaults.step,
        stop=defaults.stop,
        tolerance=defaults.tolerance,
        parameters="".join(parameters),
        initial="".join(f"    y0[{i}] = {value!r};\n" for i, value in defaults.initial),
        header=_csv_row(f"{e.name} [{e.unit}]" if e.unit else e.name for e in entries).replace('"', '\\"'),
        unless=f"            if ({' && '.join(f'k != {k}' for k in twice)})\n    " if twice else "",
    )
    own = {model: emit_c(program), "main.c": main}
    return {**own, **needed_kernel(program, defaults.method, own, parts)}


def _csv_row(cells: Iterable[str]) -> str:
    """Return one line of CSV: cells with commas are quoted, as ``r[1,1] [m]``."""
    text = StringIO()
    csv.writer(text, lineterminator="").writerow(cells)
    return text.getvalue()


def _write(files: dict[Path, str]) -> tuple[Path, ...]:
    for path, text in files.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="\n")
    return tuple(files)
