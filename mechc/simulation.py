"""From what a user asks for, in names and units, to a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from .display import Display, choose
from .lang.units import UnitError, parse_unit
from .runtime.case import SimulationOptions, find_experiment
from .runtime.inputs import Table, read_tables
from .runtime.outcome import SimulationError
from .runtime.simulate import simulate as run
from .settings import UsageMistake, read_value, unknown_name
from .solution import Solution

if TYPE_CHECKING:
    from .api import Model, Target
    from .runtime.problem import Problem


def simulate(
    model: Model,
    *,
    stop: float | str | None,
    start: float | str | None,
    step: float | str | None,
    every: float | str | None,
    tolerance: float | None,
    method: str | None,
    experiment: str | None,
    inputs: Mapping[str, Path],
    estimate_error: bool,
    reproducible: bool,
    target: Target,
    progress: Callable[[float], None] | None,
) -> Solution:
    """Run a model whose structural parameters are settled. See ``Model.simulate``."""
    if method is not None and method.startswith("scipy:"):
        target = "python" if target == "auto" else target
    problem = model.problem(target, reproducible=reproducible)
    unit = problem.time.unit
    options = SimulationOptions(
        experiment=experiment,
        values=model.settings,
        inputs=_tables(problem, inputs),
        stop=_time("stop", stop, unit),
        start=_time("start", start, unit),
        step=_time("step", step, unit),
        every=_time("every", every, unit),
        tolerance=tolerance,
        method=method,
        estimate_error=estimate_error,
        reproducible=reproducible,
        progress=progress,
    )
    solution = run(problem, options)
    return Solution.of(solution, problem, display=_display(problem, experiment))


def _time(name: str, given: float | str | None, unit: str) -> float | None:
    """Return a time in SI. Raises UsageMistake."""
    if given is None or not isinstance(given, str):
        return given
    value = read_value(given)
    if not value.single:
        raise UsageMistake(f"'{name}' is one time, not a list")
    return value.in_unit(unit, name)[0]


def _tables(problem: Problem, files: Mapping[str, Path]) -> dict[str, Table]:
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
        if name not in units:
            raise unknown_name("input", name, units)
        interpolations = {quantity.name: "linear" for quantity in problem.inputs}
        tables |= read_tables(path, interpolations, convert, column=name)
    return tables


def _display(problem: Problem, experiment: str | None) -> Display:
    """Return the units that the experiment asks for."""
    chosen = find_experiment(problem, experiment)
    words = chosen.words.get("display", "") if chosen else ""
    return choose(words) if words else Display()
