"""Error against run time of one model: the reference and the measured methods."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct, to_builtins
from msgspec.structs import replace

from ..curves import check_motion
from ..runtime.case import Case, SimulationOptions, find_experiment, prepare
from ..runtime.functions import load_functions
from ..runtime.integrate.choose_method import check_name
from ..runtime.integrate.kernel_run import run_kernel
from ..runtime.integrate.nominal_run import nominal_of
from ..runtime.integrate.scipy_compiled import METHODS
from ..runtime.integrate.scipy_methods import PREFIX
from ..runtime.integrate.solver_options import SolverOptions
from ..runtime.native.kernel import kernel_methods, load_kernel
from ..runtime.outcome import SimulationError
from ..runtime.reference.high_precision import (
    FAST_PRECISION,
    Reference,
    ReferenceFailed,
    ReferenceTooLong,
    best_precision,
    has_precision,
)
from ..runtime.reference.reference_cache import kept_reference
from ..runtime.reference.work_precision import LONGEST, TOLERANCES, Peer, Point, Task, measure
from ..runtime.results.evaluate import evaluate_rows
from .references import ReferenceCode, compile_for_reference, solve

if TYPE_CHECKING:
    from ..model import CompiledModel
    from ..runtime.problem import Array, Problem

DEFAULT_METHODS = ("dop853", "radau5", "rk4")
MEASURED_POINTS = 41
"""Output times at which errors are measured."""
END_TOLERANCE = 1e-6
"""Tolerance of the run that finds where a model ends it, and how long before that the last error is measured."""
MOST_STEPS = 100_000
HORIZON_DOUBT = 1e-14
"""Times at which the two reference runs differ by more are not measured on."""


class Benchmark(Struct, frozen=True):
    """``skipped``: methods that do not fit the model, with the reason. ``horizon``: the last time of measurement,
    earlier than ``stop`` where the reference cannot be trusted to the end."""

    model: str
    experiment: str
    reference: Reference
    horizon: float
    stop: float
    points: tuple[Point, ...]
    skipped: tuple[tuple[str, str], ...]
    closed: Mapping[str, float]
    """How far the reference is from each closed solution that the model states, over nominal + |value|."""
    ended: bool = False
    """The model ends its run soon after the horizon."""

    @property
    def digits(self) -> int:
        """Decimal digits of the reference that can be trusted."""
        doubt = float(np.nanmax(self.reference.doubt))
        return 33 if doubt == 0 else int(-math.log10(doubt))

    def by_method(self) -> dict[str, list[Point]]:
        methods: dict[str, list[Point]] = {}
        for point in self.points:
            methods.setdefault(point.method, []).append(point)
        return methods

    def summary(self) -> dict[str, Any]:
        """Return everything as plain data."""
        made = self.reference
        return {
            "model": self.model,
            "experiment": self.experiment,
            "reference": {
                "precision": made.precision,
                "method": made.method,
                "tolerance": made.tolerance,
                "doubt": float(made.doubt.max()),
                "digits": self.digits,
                "seconds": made.seconds,
                "cached": made.cached,
                "horizon": self.horizon,
                "closed_solutions": dict(self.closed),
            },
            "points": [to_builtins(point) for point in self.points],
            "skipped": dict(self.skipped),
        }


def benchmark(
    model: CompiledModel,
    *,
    methods: Sequence[str] = (),
    against: Sequence[str] = (),
    tolerances: Sequence[float] = TOLERANCES,
    experiment: str | None = None,
    stop: float | None = None,
    seconds: float = 60.0,
    progress: Callable[[], None] | None = None,
    longest: float = LONGEST,
    enough: float = 0.0,
    beside: Mapping[str, Peer] = MappingProxyType({}),
) -> Benchmark:
    """Measure a model. ``seconds``: how long the reference may take, if it is not in the cache. ``longest``: how long
    one run may take before it is given up. ``enough``: error at which the ladder of a peer ends. ``beside``: further peers by
    the names of their methods.

    Where none can be computed, closed solutions that the model states take its place.

    Raises ReferenceFailed, SimulationError, CompilerMissing, BuildError.
    """
    check_motion(model, "run time of a motion")
    for name in methods:
        check_name(name)
    problem = model.problem("c", method="radau5")
    functions = load_functions(problem)
    options = SimulationOptions(
        experiment=experiment, values=model.settings, stop=stop, points=MEASURED_POINTS
    )
    case = prepare(problem, functions, options)
    nominal = nominal_of(case)
    stop = case.stop
    case = _before_the_end(case, nominal)
    exact = closed_solutions(model, case)
    try:
        truth = _reference(model, case, nominal, methods, seconds)
    except ReferenceFailed:
        if not exact:
            raise
        truth = _closed_reference(problem, case, nominal, exact)
    count = truth.trusted(HORIZON_DOUBT)
    if count < 2:
        k = min(1, truth.t.size - 1)
        raise ReferenceFailed(
            f"its two best runs differ by {truth.doubt[k]:.0e} at t = {truth.t[k]:g} already"
        )
    ended = case.stop < stop and count == case.grid.size
    truth = _first(truth, count)
    horizon = float(truth.t[-1])
    task = Task(_until(case, horizon), nominal, truth, longest)
    known = [*methods] if methods else [m for m in DEFAULT_METHODS if m in kernel_methods(load_kernel())]
    names = [*known, *(f"scipy:{m}" for a in against for m in _peers(a))]
    points, skipped = _measured(task, [*names, *beside], tolerances, enough, progress, beside)
    closed = _agreement(exact, truth, nominal)
    return Benchmark(model.name, case.experiment, truth, horizon, stop, points, skipped, closed, ended)


def _measured(
    task: Task,
    names: Sequence[str],
    tolerances: Sequence[float],
    enough: float,
    progress: Callable[[], None] | None,
    beside: Mapping[str, Peer],
) -> tuple[tuple[Point, ...], tuple[tuple[str, str], ...]]:
    """Measure methods; return the points, and those that do not fit the model with the reason."""
    points: list[Point] = []
    skipped: list[tuple[str, str]] = []
    for name in names:
        least = enough if name.startswith(PREFIX) or name in beside else 0.0
        try:
            points += measure(task, name, tolerances, enough=least, progress=progress, peer=beside.get(name))
        except SimulationError as error:
            skipped.append((name, error.message))
    return tuple(points), tuple(skipped)


def _agreement(exact: dict[int, tuple[str, Array]], truth: Reference, nominal: Array) -> dict[str, float]:
    """Return how far a reference is from closed solutions at its times, over nominal + |value|, by state."""
    return {
        name: float(np.max(np.abs(values[: truth.t.size] - high) / (nominal[k] + np.abs(high))))
        for k, (name, values) in exact.items()
        for high in (truth.high[:, k],)
    }


def closed_solutions(model: CompiledModel, case: Case) -> dict[int, tuple[str, Array]]:
    """Return name and values at the output times of each state that the model gives a closed solution of, by index.

    They hold for the default experiment with nothing changed.
    """
    problem, functions = case.problem, case.functions
    first = find_experiment(problem, None)
    if model.settings or functions.outputs is None or case.experiment != (first.name if first else ""):
        return {}
    names = [q.name for q in problem.states]
    rows = evaluate_rows(case, "outputs", case.grid, np.tile(case.y0, (case.grid.size, 1)))
    return {
        names.index(name): (name, rows[:, k])
        for k, q in enumerate(problem.outputs)
        if q.kind == "exact" and (name := q.name.removeprefix("exact(")[:-1]) in names
    }


def _closed_reference(
    problem: Problem, case: Case, nominal: Array, exact: dict[int, tuple[str, Array]]
) -> Reference:
    """Return closed solutions as a reference; states without one are not-a-number, and not measured."""
    high = np.full((case.grid.size, problem.ny), np.nan)
    for k, (_, values) in exact.items():
        high[:, k] = values
    doubt = np.full(case.grid.size, float(np.finfo(float).eps))
    return Reference(
        case.grid, high, np.zeros_like(high), doubt, nominal, "double", "closed solution", 0.0, 0.0, 0
    )


def _before_the_end(case: Case, nominal: Array) -> Case:
    """Return the case up to shortly before a model ends its run, if it does."""
    hybrid = case.problem.hybrid
    if hybrid is None or all(branch.message is None for branch in hybrid.branches):
        return case
    options = SolverOptions("dop853", END_TOLERANCE, nominal, max_steps=MOST_STEPS)
    done = run_kernel(case, options)
    if done.terminated is None:
        return case
    stop = case.begin + (1 - END_TOLERANCE) * (float(done.t[-1]) - case.begin)
    return replace(case, stop=stop, grid=np.linspace(case.begin, stop, MEASURED_POINTS))


def _peers(name: str) -> Sequence[str]:
    """Return the methods that a word of ``--against`` stands for. Raises SimulationError."""
    if name == "scipy":
        return METHODS
    if name.startswith("scipy:") and name.removeprefix("scipy:") in METHODS:
        return (name.removeprefix("scipy:"),)
    raise SimulationError(f"there is no peer '{name}': scipy, or one of scipy:{', scipy:'.join(METHODS)}")


def _reference(
    model: CompiledModel, case: Case, nominal: Array, methods: Sequence[str], seconds: float
) -> Reference:
    """Solve the case in higher precision; by radau5 if that is the only method asked for.

    Where the most precise numbers, computed by software, take too long, those of the processor do.
    """
    try:
        precision = best_precision()
    except ReferenceFailed:
        from .slow_reference import slow_reference

        return slow_reference(model, case, nominal, seconds)
    best = compile_for_reference(model, precision)
    stiff = tuple(methods) == ("radau5",)

    def make(code: ReferenceCode) -> Reference:
        return solve(code, case, nominal, case.grid, "radau5" if stiff else code.explicit, seconds)

    def make_best() -> Reference:
        try:
            return make(best)
        except ReferenceTooLong:
            if precision == FAST_PRECISION or not has_precision(FAST_PRECISION):
                raise
            return make(compile_for_reference(model, FAST_PRECISION))

    return kept_reference(
        best.library,
        case,
        nominal,
        case.grid,
        precision=precision,
        method="radau5" if stiff else best.explicit,
        seconds=seconds,
        make=make_best,
    )


def reference_at(
    model: CompiledModel, times: Sequence[float], *, experiment: str | None = None, seconds: float = 60.0
) -> Reference:
    """Solve a model in higher precision at given times, with the numbers that it states taken as exact decimals.

    Raises ReferenceFailed, SimulationError, CompilerMissing, BuildError.
    """
    problem = model.problem("c")
    functions = load_functions(problem)
    options = SimulationOptions(experiment=experiment, values=model.settings, stop=max(times), points=2)
    case = prepare(problem, functions, options)
    code = compile_for_reference(model)
    return solve(code, case, nominal_of(case), np.array(times), code.explicit, seconds, decimals=True)


def _first(truth: Reference, count: int) -> Reference:
    return replace(
        truth, t=truth.t[:count], high=truth.high[:count], low=truth.low[:count], doubt=truth.doubt[:count]
    )


def _until(case: Case, horizon: float) -> Case:
    return replace(case, stop=horizon, grid=case.grid[case.grid <= horizon])
