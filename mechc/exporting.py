"""Write a model as code that stands alone: a Python module, one for CasADi or JAX, or a folder of C files."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterable, Mapping
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import Struct
from msgspec.structs import replace

from .c_main import (
    ASSEMBLED_START,
    EVEN_COUNT,
    EVEN_GRID,
    EVEN_SPACING,
    FOUND_PARAMETERS,
    MAIN,
    PLAIN_START,
    ROWS,
    STATED_COUNT,
    STATED_GRID,
    STATED_SPACING,
)
from .compiler.pipeline import program_with
from .compiler.targets.c_header import comment
from .requests.parse_values import UsageMistake
from .runtime.methods import KERNEL_METHODS, RUNS_ALL, parts_for
from .targets import MODULES

if TYPE_CHECKING:
    from .compiler.program.model import Program
    from .compiler.targets.differentiable import Begin
    from .model import CompiledModel
    from .runtime.case import Case
    from .runtime.interface import Setting
    from .runtime.problem import Problem
    from .solution import Solution


class Defaults(Struct, frozen=True):
    """What the default experiment says: times, tolerance, and the values it sets by index of p, y (and whether they are
    known) and u. ``every``: the spacing of the output, None for 501 rows. ``pilot``: whether its nominal values take a first run."""

    begin: float = 0.0
    start: float = 0.0
    stop: float = 10.0
    tolerance: float = 1e-9
    parameters: tuple[tuple[int, float], ...] = ()
    initial: tuple[tuple[int, float, bool], ...] = ()
    inputs: tuple[tuple[int, float], ...] = ()
    method: str = "dop853"
    step: float = 0.0
    every: float | None = None
    pilot: bool = False


def export(model: CompiledModel, target: str, output: Path | None) -> tuple[Path, ...]:
    """Write the files of a target, with the values of the default experiment, and return them. Raises UsageMistake for an unknown
    target."""
    if model.compilation.equations.curve is not None:
        raise UsageMistake(
            f"'{model.name}' is a curve, which nothing steps through in time", "'mechc run' finds it"
        )
    model = with_weights(model.for_experiment(None))
    name = stem_of(model)
    match target:
        case target if target in MODULES:
            module = Path(MODULES[target].file.format(re.sub(r"\W", "_", name)))  # what Python can import
            return _write({output or module: _module(without_bends(model), target)})
        case "c":
            folder = output or Path(f"{name}_c")
            if folder.suffix:
                raise UsageMistake("the C target writes a folder", f"as in -o {name}_c")
            refuse_driving_inputs(model, "a C program")
            defaults = defaults_of(ready_code(model), model.settings)
            model, run = default_run(model, **as_printed(defaults)) or (model, None)
            if run is not None:
                defaults = replace(defaults, method=method_of(model, run))
            parts = model.compilation.parts
            program = program_with(model.compilation, {*parts, *parts_for(defaults.method)})
            if program.no_series:
                raise UsageMistake(
                    f"'{defaults.method}' cannot run this model: {program.no_series}",
                    RUNS_ALL,
                )
            files = c_files(with_own_sizes(program, run), defaults, parts)
            return _write({folder / file: text for file, text in files.items()})
        case _:
            raise UsageMistake(f"there is no target '{target}'", f"c, {', '.join(MODULES)}")


def ready_code(model: CompiledModel) -> Problem:
    """Return code that evaluates a start, with the bits of a reproducible run: by libtcc where there is such, in some milliseconds."""
    return model.problem(reproducible=True, quick=True)


def with_weights(model: CompiledModel) -> CompiledModel:
    """Return a model with weights of constraints if its mass matrix is singular with the values that it was given, as a run
    that meets that begins again with them; else as it is."""
    if not model.settings or not model.compilation.equations.constraints:
        return model
    from .runtime.outcome import SINGULAR_MASS, SimulationError
    from .runtime.results.diagnosis import failure_at_start
    from .session import compliant

    try:
        case, _ = _default_case(ready_code(model), model.settings)
    except SimulationError:  # a value may come from outside
        return model
    failure = failure_at_start(case)
    return compliant(model) if failure is not None and failure.kind == SINGULAR_MASS else model


def without_bends(model: CompiledModel) -> CompiledModel:
    """Return a model whose only events are kinks of tables and energies without them, for targets that know no events."""
    if model.compilation.program.switching is None:
        return model
    plain = model.keeping({*model.compilation.parts, "bends"})
    return plain if plain.compilation.program.switching is None else model


def exported_run(
    model: CompiledModel, experiment: str | None, stop: float | None, **options: Any
) -> tuple[CompiledModel, Solution]:
    """Run what is exported, for what only a run tells: whether the model is stiff, passes singular positions, or has states
    far below others of their unit. Return the model that ran, with what that took. Raises SimulationError; KeyboardInterrupt where a part of
    it is all there is."""
    from .requests.request import asked
    from .runtime.outcome import Outcome
    from .runtime.studies.kinds.motion import Simulate
    from .session import answered
    from .solution import Solution

    given = {"experiment": experiment, "stop": stop, "reproducible": True, **options}
    ran, solution = answered(model, asked(Simulate, {**given, "estimate_error": False}))
    assert isinstance(solution, Solution)
    if solution.outcome is Outcome.INTERRUPTED:
        raise KeyboardInterrupt
    return ran, solution


def default_run(model: CompiledModel, **options: Any) -> tuple[CompiledModel, Solution] | None:
    """Run the default experiment; None where it cannot begin as the model is."""
    from .runtime.case import find_experiment
    from .runtime.outcome import SimulationError

    experiment = find_experiment(ready_code(model), None)
    said = experiment is not None and "stop" in experiment.options
    try:
        return exported_run(model, None, None if said else Defaults().stop, **options)
    except SimulationError:
        return None


def as_printed(defaults: Defaults) -> dict[str, float]:
    """Return the option by which a run has the rows of a C program: how far states get, and so the sizes that their errors are
    measured against, is read off rows."""
    if defaults.every is not None or not defaults.stop > defaults.start:
        return {}
    return {"every": (defaults.stop - defaults.start) / (ROWS - 1)}


def method_of(model: CompiledModel, run: Solution) -> str:
    """Return the method of a C program: that of the experiment, else the one that the run took; a run that changed to the
    implicit one is begun with both at hand."""
    said = model.method(None)
    if said and said != "auto":
        return said if said in KERNEL_METHODS else Defaults().method
    return "auto" if run.statistics.jacobians else Defaults().method


def with_own_sizes(program: Program, run: Solution | None) -> Program:
    """Return a program that declares the nominal values of states which a run has found to stay far below those of others."""
    sizes = run.motion.own_sizes if run is not None else {}
    if not sizes:
        return program
    states = tuple(replace(e, nominal=sizes.get(e.name, e.nominal)) for e in program.states)
    return replace(program, states=states)


def _module(model: CompiledModel, target: str) -> str:
    """Return the text of a Python module. Raises UsageMistake for what it cannot hold."""
    from .compiler.graph.operations import NORMAL
    from .compiler.program.model import Operate
    from .runtime.interface import COMPLIANCE

    program = model.compilation.program
    if program.switching is not None and program.switching.delays is not None:
        raise UsageMistake(
            f"'{program.name}' has delays, and a module of functions of the present state keeps no past",
            "the targets c, fmu and web run it",
        )
    written = MODULES[target]
    begin = begin_of(model)
    if written.runs:
        refuse_driving_inputs(model, f"a {written.title} module")
        ran = default_run(model)
        sizes = ran[1].motion.own_sizes if ran is not None else {}
        nominal = [sizes.get(e.name, x) for e, x in zip(program.arrays["y"], begin.nominal, strict=True)]
        took = ran[0].compilation.program if ran is not None else program
        begin = replace(
            begin,
            nominal=nominal,
            stiff=ran is not None and ran[1].statistics.jacobians > 0,
            singular=took.function("closeness") is not None and COMPLIANCE not in model.compilation.parts,
        )
    elif program.switching is not None:
        raise UsageMistake(
            f"'{program.name}' switches (events, contacts, friction, or laws that change with the motion), which has no "
            "derivative where it does",
            "mechc run --sensitivity differentiates through events; the targets c and fmu run them",
        )
    else:
        program = model.program(model.compilation.parts | written.parts)
    if not written.noise and any(
        type(s) is Operate and s.code == NORMAL for f in program.functions for body in f.bodies for s in body
    ):
        raise UsageMistake(
            f"'{program.name}' has noise, whose whole numbers of 64 bits {written.title} does not know",
            "make it an input, and give that as you like; the targets python, c, fmu and web have the noise itself",
        )
    if (long := max((len(t.values) for t in program.tables), default=0)) > written.longest_table:
        raise UsageMistake(
            f"'{program.name}' has a table of {long} numbers, which {written.title}'s symbols would write out one by one",
            f"up to {written.longest_table:g} are possible; the targets jax, python, c and fmu read tables of any length",
        )
    return written.emitter()(program, begin)


def refuse_driving_inputs(model: CompiledModel, target: str, given: Collection[str] = ()) -> None:
    """Refuse a target whose inputs are set one by one, where a derivative of one is needed too, except those that are ``given`` as
    tables. Raises UsageMistake."""
    from .runtime.interface import derived_among

    inputs = [entry.name for entry in model.inputs]
    for k in derived_among(inputs):
        if (name := inputs[k]) not in given:
            raise UsageMistake(
                f"the input '{name}' drives a coordinate, which needs its derivatives too, and {target} is told none",
                f"drive by what a filter of two states makes of it: input {name}(filter = 1 ms); "
                "mechc run takes derivatives from a table; FMUs, casadi and jax have them as inputs of their own",
            )


def begin_of(model: CompiledModel) -> Begin:
    """Return where the run of the default experiment begins and ends, and the sizes of its states."""
    from .compiler.targets.differentiable import Begin
    from .runtime.case import inputs_at
    from .runtime.integrate.nominal_run import nominal_of

    problem = ready_code(model)
    case, settings = _default_case(problem, model.settings)
    chosen = [s.index for s in settings if s.array == "p"]
    return Begin(
        case.begin,
        case.y0.tolist(),
        inputs_at(case, case.begin).tolist(),
        {problem.parameters[k].name: float(case.p[k]) for k in (*chosen, *problem.found)},
        case.stop,
        nominal_of(case).tolist(),
        {i: float(table.values[0]) for i, table in sorted(case.tables.items())},
        case.tolerance,
    )


def stem_of(model: CompiledModel) -> str:
    """Name what is written of a model: after its file, or, where it was chosen among several or has none, after itself."""
    file = Path(model.compilation.source.name)
    return file.stem if model.compilation.request.model is None and file.is_file() else file_stem(model.name)


def file_stem(model: str) -> str:
    """Make the name of a file: ``DoublePendulum`` gives ``double_pendulum``."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", model).lower()


def defaults_of(problem: Problem, values: Mapping[str, float] | None = None) -> Defaults:
    """Evaluate the default experiment, and before it ``values`` by name. A model that says no stop time gets ten seconds."""
    from .runtime.integrate.nominal_run import takes_pilot

    case, settings = _default_case(problem, values or {})
    return Defaults(
        case.begin,
        float(case.grid[0]),
        case.stop,
        case.tolerance,
        tuple((s.index, float(case.p[s.index])) for s in settings if s.array == "p"),
        tuple((s.index, float(case.wanted[s.index]), not s.guess) for s in settings if s.array == "y"),
        tuple((i, float(table.values[0])) for i, table in sorted(case.tables.items())),
        case.method if case.method in KERNEL_METHODS and case.method != "auto" else Defaults().method,
        case.step or 0.0,
        case.every,
        takes_pilot(case),
    )


def _default_case(problem: Problem, values: Mapping[str, float]) -> tuple[Case, list[Setting]]:
    """Make the default experiment ready, and return what it and ``values``, which go before it, set."""
    from .runtime.case import SimulationOptions, find_experiment, find_setting, prepare
    from .runtime.functions import load_functions

    experiment = find_experiment(problem, None)
    said = experiment is not None and "stop" in experiment.options
    options = SimulationOptions(values=values, stop=None if said else Defaults().stop)
    case = prepare(problem, load_functions(problem), options)
    own = [find_setting(problem, name) for name in values]
    settings = [
        *own,
        *(s for s in (experiment.settings if experiment else ()) if not (s in own or _as_known(s) in own)),
    ]
    return case, settings


def _as_known(setting: Setting) -> Setting:
    return replace(setting, guess=False)


def c_files(program: Program, defaults: Defaults, parts: Collection[str]) -> dict[str, str]:
    """Return the C files by name: the model, what it and its method need of the kernel, and a main program.

    ``parts``: what is kept though the model does not need it (equations/needs.py).
    """
    from .compiler.targets.alone import standing_alone
    from .compiler.targets.c import emit_c
    from .compiler.targets.kernel_files import needed_kernel
    from .runtime.native.kernel import kernel_sources

    program = standing_alone(program)
    name = file_stem(program.name)
    model = f"{name}_model.c" if f"{name}.c" in kernel_sources() else f"{name}.c"
    own = {model: emit_c(program), "main.c": _main(name, program, defaults)}
    methods = (defaults.method, *(["dop853"] if defaults.pilot else []))
    return {**own, **needed_kernel(program, methods, own, parts)}


def _main(name: str, program: Program, defaults: Defaults) -> str:
    """Return the main program."""
    from .runtime.limits_of_time import MOST_BYTES
    from .runtime.nominal import sizes_of

    sizes = sizes_of(program)
    states, outputs = program.arrays["y"], program.arrays["out"]
    known = {e.name for e in states}  # accounts of energy are states and outputs
    twice = [k for k, e in enumerate(outputs) if e.name in known]
    entries = [*program.arrays["t"][:1], *states, *(e for e in outputs if e.name not in known)]
    every = defaults.every
    return MAIN.format(
        name=name,
        told=f"{ROWS} rows"
        if every is None
        else f"a row every {every:g}{f' {unit}' if (unit := program.arrays['t'][0].unit) else ''}",
        spacing=EVEN_SPACING if every is None else STATED_SPACING.format(every=every, most=MOST_BYTES / 8),
        count=EVEN_COUNT if every is None else STATED_COUNT,
        grid=EVEN_GRID if every is None else STATED_GRID,
        method=defaults.method,
        step=defaults.step,
        begin=defaults.begin,
        start=defaults.start,
        stop=defaults.stop,
        tolerance=defaults.tolerance,
        quantities="".join(
            f"    {{{unit}, {_KINDS[kind]}, {int(pure)}, {nominal!r}, {size!r}, {group}}}, /* {comment(entry.name)} */\n"
            for unit, kind, pure, nominal, size, group, entry in zip(
                sizes.units,
                sizes.kinds,
                sizes.pure,
                sizes.nominal,
                sizes.ranges,
                sizes.groups or [0] * len(states),
                states,
                strict=True,
            )
        )
        or "    {0, MECH_PLAIN, 0, 0, 0, 0},\n",
        partner=_list(sizes.partner),
        units=_list(sizes.parameter_units),
        energies=_list(sizes.energies),
        n_energies=len(sizes.energies),
        parameters="".join(
            f"    p[{i}] = {value!r};\n    set[{i}] = 1;\n" for i, value in defaults.parameters
        ),
        tables=_tables(defaults),
        n_tables=len(defaults.inputs),
        initial=_start(program, defaults),
        header=_csv_row(f"{e.name} [{e.unit}]" if e.unit else e.name for e in entries).replace('"', '\\"'),
        unless=f"            if ({' && '.join(f'k != {k}' for k in twice)})\n    " if twice else "",
    )


_KINDS = {"": "MECH_PLAIN", "account": "MECH_ACCOUNT", "rotation": "MECH_ROTATION_ENTRY"}


def _start(program: Program, defaults: Defaults) -> str:
    """Return the lines that fill z and y0."""
    if not program.assembly and not program.dependent and not program.found:
        values = "".join(f"    y0[{i}] = {value!r};\n" for i, value, _ in defaults.initial)
        return PLAIN_START.format(initial=values)
    values = "".join(
        f"    y0[{i}] = {value!r};\n    given[{i}] = {'MECH_KNOWN' if known else 'MECH_GUESSED'};\n"
        for i, value, known in defaults.initial
    )
    rows = ", ".join(_c_string(row.name) for row in program.assembly) or "NULL"
    found = FOUND_PARAMETERS if program.found else ""
    return ASSEMBLED_START.format(rows=rows, initial=values) + found


def _tables(defaults: Defaults) -> str:
    """Return the lines of inputs that are given: tables of one row."""
    if not defaults.inputs:
        return "    const mech_table *tables = NULL;\n"
    rows = ", ".join(
        f"{{{i}, MECH_STEP, 1, &given_at, &given_inputs[{k}], NULL}}"
        for k, (i, _) in enumerate(defaults.inputs)
    )
    values = ", ".join(repr(value) for _, value in defaults.inputs)
    return (
        f"    static const mech_real given_at = 0, given_inputs[] = {{{values}}};\n"
        f"    static const mech_table tables[] = {{{rows}}};\n"
    )


def _list(numbers: Iterable[int]) -> str:
    return ", ".join(map(str, numbers)) or "0"


def _c_string(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


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
