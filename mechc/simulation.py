"""From what a user asks for, in names and units, to a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from .compiler.equations.model import COMPLIANCE, SINGULAR
from .display import Display, choose
from .lang.units import UnitError, parse_unit
from .runtime.case import SimulationOptions, find_experiment
from .runtime.inputs import Table, read_tables
from .runtime.outcome import AT_SINGULAR_POSITIONS, Failure, Outcome, SimulationError
from .runtime.results.solution import Solution as Run
from .runtime.studies.simulate import Plan, plan_run
from .runtime.studies.simulate import simulate as run
from .runtime.studies.simulate import simulate_sweep as run_sweep
from .settings import UsageMistake, elements_of, read_value_of, tidy, unknown_name
from .solution import Solution

if TYPE_CHECKING:
    from .api import Model, Target
    from .runtime.problem import Problem
    from .runtime.studies.stepwise import Stepper


FEW_STEPS = 20_000
"""Steps after which a run is looked at: if it is stiff, it begins anew with an implicit method at hand."""
TOO_MANY = "too many steps"
REPEATED = "the run was repeated with multipliers of a small compliance"
PASSED_BY = (
    f'where the mechanism passes a singular position there, build it with keep={{"{COMPLIANCE}"}}; a whole run '
    "(simulate) does that by itself"
)
"""What a run step by step says: it cannot begin anew, as its caller has seen its past."""

Runs = tuple[Sequence[Run], Sequence[Mapping[str, float]]]
"""Solutions, and the swept values of each."""


class Request(Struct, frozen=True):
    """What a user asks of a run: texts with units where the user may write them. See ``Model.simulate``."""

    stop: float | str | None = None
    start: float | str | None = None
    step: float | str | None = None
    every: float | str | None = None
    tolerance: float | None = None
    method: str | None = None
    experiment: str | None = None
    inputs: Mapping[str, str | Path] = field(default_factory=dict)
    estimate_error: bool = True
    reproducible: bool = False
    target: Target = "auto"
    progress: Callable[[float], None] | None = None


class Sweep(Struct, frozen=True):
    """Several runs of one experiment: ``points`` are the swept values in SI, one mapping for each solution."""

    points: tuple[Mapping[str, float | bool | str], ...]
    solutions: tuple[Solution, ...]
    complete: bool = True
    """Whether all runs were made: Ctrl-C leaves those that were finished."""


def simulate(model: Model, request: Request) -> Solution:
    """Run a model whose structural parameters are settled. Raises SimulationError for a sweep."""
    return simulate_settled(model, request)[1]


def simulate_settled(model: Model, request: Request) -> tuple[Model, Solution]:
    """The same, with the model that ran: with compliant multipliers if it took those (``_solve``)."""
    ran, problem, runs = _solve(model, request, lambda problem, options: ((run(problem, options),), ({},)))
    return ran, _shown(runs[0][0], problem, model, request)


def start(model: Model, request: Request) -> Stepper:
    """Begin a run that the caller takes on, piece by piece."""
    from .runtime.studies.stepwise import Stepper

    method = request.method or model.method(request.experiment)
    problem = model.problem(request.target, method=method, reproducible=request.reproducible)
    advice = "" if _foreseen(model) else PASSED_BY
    return Stepper(problem, _options(model, request, problem), _moving_inputs(model), advice)


def _moving_inputs(model: Model) -> frozenset[str]:
    """Return the inputs whose defaults depend on time."""
    equations = model.compilation.equations
    time = {n for n, slot in equations.layout.items() if slot.array == "t"}
    defaults = [n for f in equations.functions if f.name == "inputs" for n in f.outputs]
    moving = [bool(time & set(equations.graph.support(n))) for n in defaults]
    return frozenset(e.name for e, moves in zip(equations.inputs, moving, strict=True) if moves)


def plan(model: Model, request: Request) -> Plan:
    """Make a run ready without beginning it. Raises SimulationError."""
    method = request.method or model.method(request.experiment)
    problem = model.problem(request.target, method=method, reproducible=request.reproducible)
    return plan_run(problem, _options(model, request, problem))


def sweep(model: Model, request: Request) -> Sweep:
    """Run a model once for each combination of the values that its experiment sweeps; once if there are none.

    Structural parameters are swept outermost: each of their values compiles the model again.
    """
    points: list[Mapping[str, float | bool | str]] = []
    solutions: list[Solution] = []
    complete = True

    def all_runs(problem: Problem, options: SimulationOptions) -> Runs:
        nonlocal complete
        done = run_sweep(problem, options)
        complete = done.complete
        return done.solutions, done.values

    for structural, variant in model.structural_points(request.experiment):
        try:
            _, problem, (runs, values) = _solve(variant, request, all_runs)
        except KeyboardInterrupt:  # while a variant was compiled, or pressed again during its first run
            if not solutions:
                raise
            complete = False
            break
        points += [{**structural, **point} for point in values]
        solutions += [
            _shown(one, problem, variant, request, point)
            for one, point in zip(runs, points[-len(runs) :], strict=True)
        ]
        if not complete or solutions[-1].outcome is Outcome.INTERRUPTED:
            break
    return Sweep(tuple(points), tuple(solutions), complete)


def _solve(
    model: Model, request: Request, solve: Callable[[Problem, SimulationOptions], Runs]
) -> tuple[Model, Problem, Runs]:
    """Run; where that meets a singular position which was not foreseen, run again with compliant multipliers.

    Returns the model that ran, too. Whether there are such positions is decided for the default values, along one
    motion (equations/singular.py).
    """
    problem, runs = _solve_as_it_is(model, request, solve)
    if not problem.constraints or _foreseen(model) or problem.library is None or not any(map(_met, runs[0])):
        return model, problem, runs
    compliant = model.keeping({*model.compilation.parts, COMPLIANCE})
    other, again = _solve_as_it_is(compliant, request, solve)
    if any(map(_met, again[0])):
        return model, problem, runs
    for one, before in zip(again[0], runs[0], strict=True):
        failure = _cause(before)
        if failure is not None:
            one.add_remark(f"met a singular position at t = {failure.time:.6g}: {REPEATED}")
    return compliant, other, again


def _foreseen(model: Model) -> bool:
    """Whether the model has what passes singular positions."""
    return any(choice.topic == SINGULAR for choice in model.compilation.equations.choices)


def _cause(run: Run) -> Failure | None:
    """What ended a run, or its companion run."""
    return run.failure or run.accuracy.failure


def _met(run: Run) -> bool:
    failure = _cause(run)
    return failure is not None and failure.kind in AT_SINGULAR_POSITIONS


def _solve_as_it_is(
    model: Model, request: Request, solve: Callable[[Problem, SimulationOptions], Runs]
) -> tuple[Problem, Runs]:
    """Run by the method that was asked for; without one explicitly, and again with the Jacobian if that is stiff.

    So the Jacobian is compiled for stiff models only. What the first try costs at most is ``FEW_STEPS``.
    """
    method = request.method or model.method(request.experiment)
    problem = model.problem(request.target, method=method, reproducible=request.reproducible)
    options = _options(model, request, problem)
    if method or problem.library is None:
        return problem, solve(problem, options)
    runs = solve(problem, replace(options, max_steps=FEW_STEPS))
    if all(one.failure is None or one.failure.kind != TOO_MANY for one in runs[0]):
        return problem, runs
    if any(one.statistics.stiff_time is not None for one in runs[0]):
        problem = model.problem(request.target, method="auto", reproducible=request.reproducible)
    return problem, solve(problem, options)


def _options(model: Model, request: Request, problem: Problem) -> SimulationOptions:
    unit = problem.time.unit
    return SimulationOptions(
        experiment=request.experiment,
        values=model.settings,
        inputs=_tables(problem, request.inputs),
        stop=_time("stop", request.stop, unit),
        start=_time("start", request.start, unit),
        step=_time("step", request.step, unit),
        every=_time("every", request.every, unit),
        tolerance=_tolerance(request.tolerance),
        method=request.method,
        estimate_error=request.estimate_error,
        reproducible=request.reproducible,
        progress=request.progress,
    )


def _shown(
    solution: Run,
    problem: Problem,
    model: Model,
    request: Request,
    swept: Mapping[str, float | bool | str] = MappingProxyType({}),
) -> Solution:
    first = find_experiment(problem, None)
    as_stated = (
        not model.settings and not request.inputs and (first is None or first.name == solution.experiment)
    )
    display = _display(problem, request.experiment)
    return Solution.of(solution, problem, display=display, as_stated=as_stated, swept=swept)


def _tolerance(given: float | None) -> float | None:
    """Return the tolerance as a number. Raises UsageMistake."""
    try:
        return None if given is None else float(given)
    except (TypeError, ValueError):
        raise UsageMistake(f"the tolerance is a number such as 1e-9, not {given!r}") from None


def _time(name: str, given: float | str | None, unit: str) -> float | None:
    """Return a time in SI. Raises UsageMistake."""
    if given is None or not isinstance(given, str):
        return given
    value = read_value_of(name, given)
    if not value.single:
        raise UsageMistake(f"'{name}' is one time, not a list")
    return value.in_unit(unit, name)[0]


def _tables(problem: Problem, files: Mapping[str, str | Path]) -> dict[str, Table]:
    """Read the CSV file of each input. Raises UsageMistake, SimulationError."""
    units = {quantity.name: quantity.unit for quantity in problem.inputs}
    tables: dict[str, Table] = {}

    def convert(name: str, unit: str) -> float:
        wanted = problem.time.unit if name == "time" else units[name]
        if not unit:
            return 1.0
        try:
            given, known = parse_unit(unit), parse_unit(wanted or "1")
        except UnitError as error:
            raise SimulationError(str(error)) from None
        if given.dimension != known.dimension:
            raise SimulationError(f"the column '{name}' is in {unit}, the input has the unit {wanted or '1'}")
        return float(given.factor)

    for name, path in files.items():
        elements = elements_of(tidy(name), units)
        if not elements:
            raise unknown_name("input", name, units)
        interpolations = {q.name: q.interpolation for q in problem.inputs if q.name in elements}
        if len(elements) == 1:
            tables |= read_tables(Path(path), interpolations, convert, column=elements[0])
            continue
        found = read_tables(Path(path), interpolations, convert)
        if missing := [n for n in elements if n not in found]:
            raise SimulationError(
                f"the table {path} has no column '{missing[0]}', which '{name}' stands for too"
            )
        tables |= found
    return tables


def _display(problem: Problem, experiment: str | None) -> Display:
    """Return the units that the experiment asks for."""
    chosen = find_experiment(problem, experiment)
    words = chosen.words.get("display", "") if chosen else ""
    return choose(words) if words else Display()
