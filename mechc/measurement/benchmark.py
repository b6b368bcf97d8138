"""Error against run time of one model: the reference and the measured methods."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct, to_builtins
from msgspec.structs import replace

from ..compiler.equations.model import SINGULAR
from ..curves import check_motion
from ..exporting import exported_run
from ..presentation.numbers import duration
from ..runtime.case import Case, SimulationOptions, find_experiment, prepare
from ..runtime.functions import load_functions
from ..runtime.integrate.choose_method import check_name
from ..runtime.integrate.kernel_run import run_kernel
from ..runtime.integrate.nominal_run import nominal_of
from ..runtime.integrate.solver import SolverOptions
from ..runtime.methods import KERNEL_METHODS, parts_for
from ..runtime.outcome import SimulationError
from ..runtime.reference.high_precision import (
    FAST_PRECISION,
    PrecisionReference,
    ReferenceFailed,
    ReferenceTooLong,
    best_precision,
    has_precision,
)
from ..runtime.reference.reference_cache import kept_reference
from ..runtime.reference.work_precision import (
    LONGEST,
    TOLERANCES,
    Peer,
    Task,
    WorkPrecisionPoint,
    around,
    measure,
    time_between,
    time_to_reach,
    timed_in_turns,
)
from ..runtime.results.evaluate import evaluate_rows
from ..runtime.studies.runs.simulate import run as run_problem
from .machine import described
from .peers import left_out, modes_of, peers
from .peers.exchange import exchanged
from .references import ReferenceCode, compile_for_reference, solve

if TYPE_CHECKING:
    from ..model import CompiledModel
    from ..runtime.problem import Array, Problem

MEASURED_POINTS = 41
"""Output times at which errors are measured."""
END_TOLERANCE = 1e-6
"""Tolerance of the run that finds where a model ends it, and how long before that the last error is measured."""
MOST_STEPS = 100_000
LONGEST_CLAIMED = 0.5
"""Seconds of a run above which it is not made again to see what it says of its error."""
SOFTENING = 1e-9
"""What a small compliance of multipliers makes of a motion through singular positions at most: measured 3e-10 with a pantograph that
passes ten of them, beside the same mechanism in independent coordinates."""
SOFTENED_DOUBT = 1e-8
SOFTENED_LADDERS = {"dop853": (1e-13, 1e-14), "radau5": (1e-11, 1e-13)}
HORIZON_DOUBT = 1e-14
"""Times at which the two reference runs differ by more are not measured on."""


class Benchmark(Struct, frozen=True):
    """``skipped``: methods that do not fit the model, with the reason. ``horizon``: the last time of measurement,
    earlier than ``stop`` where the reference cannot be trusted to the end."""

    model: str
    experiment: str
    reference: PrecisionReference
    horizon: float
    stop: float
    points: tuple[WorkPrecisionPoint, ...]
    skipped: tuple[tuple[str, str], ...]
    closed: Mapping[str, float]
    """How far the reference is from each closed solution that the model states, over nominal + |value|."""
    ended: bool = False
    """The model ends its run soon after the horizon."""
    peers: Mapping[str, str] = MappingProxyType({})
    """Libraries that were measured, and how they were set up."""
    softened: bool = False
    """The mechanism meets singular positions: the reference has multipliers of a small compliance, as runs have."""

    @property
    def digits(self) -> int:
        """Decimal digits of the reference that can be trusted."""
        doubt = float(np.nanmax(self.reference.doubt))
        return 33 if doubt == 0 else int(-math.log10(doubt))

    def by_method(self) -> dict[str, list[WorkPrecisionPoint]]:
        methods: dict[str, list[WorkPrecisionPoint]] = {}
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
            "peers": dict(self.peers),
            "machine": described(),
            "conclusion": conclusion(self),
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
    longest: float = LONGEST,
    enough: float = 0.0,
) -> Benchmark:
    """Measure a model: all methods of the kernel where none are named. ``seconds``: how long the reference may take, if it is not
    in the cache. ``longest``: how long one run may take before it is given up. ``enough``: error at which the ladder of a peer ends.
    ``against``: peers by name (``peers/``).

    Where none can be computed, closed solutions that the model states take its place.

    Raises ReferenceFailed, SimulationError, CompilerMissing, BuildError.
    """
    check_motion(model, "run time of a motion")
    for name in methods:
        check_name(name)
    model = _as_it_runs(model, experiment, stop)
    softened = any(choice.topic == SINGULAR for choice in model.compilation.equations.choices)
    names = list(methods) or list(KERNEL_METHODS)
    parts = frozenset().union(*map(parts_for, ("radau5", *names)))
    beside = peers(model, against, parts)
    problem = model.problem(parts=parts)
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
        truth = _softened(model, case, nominal, seconds) if softened else None
        truth = truth or _reference(model, case, nominal, methods, seconds)
    except ReferenceFailed:
        if not exact:
            raise
        truth = _closed_reference(problem, case, nominal, exact)
    count = truth.trusted(SOFTENED_DOUBT if softened else HORIZON_DOUBT)
    if count < 2:
        k = min(1, truth.t.size - 1)
        raise ReferenceFailed(
            f"its two best runs differ by {truth.doubt[k]:.0e} at t = {truth.t[k]:g} already"
        )
    ended = case.stop < stop and count == case.grid.size
    truth = _first(truth, count)
    horizon = float(truth.t[-1])
    task = Task(replace(case, stop=horizon, grid=case.grid[case.grid <= horizon]), nominal, truth, longest)
    points, skipped = _measured(task, [*names, *beside], tolerances, enough, beside)
    points = tuple(p if p.method in beside else _with_claim(p, task, options) for p in points)
    points = _in_turns(points, truth, task, beside)
    closed = _agreement(exact, truth, nominal)
    modes = modes_of({p.method for p in points}, exchanged(case))
    skipped = (*skipped, *left_out(against).items())
    return Benchmark(
        model.name, case.experiment, truth, horizon, stop, points, skipped, closed, ended, modes, softened
    )


def _as_it_runs(model: CompiledModel, experiment: str | None, stop: float | None) -> CompiledModel:
    """Return the model as a run takes it: with multipliers of a small compliance where that meets a singular position."""
    if not model.compilation.equations.constraints:
        return model
    try:
        return exported_run(model, experiment, stop)[0]
    except SimulationError:  # will be told where it is measured
        return model


def _softened(model: CompiledModel, case: Case, nominal: Array, seconds: float) -> PrecisionReference | None:
    """Solve a mechanism with multipliers of a small compliance, which no numbers of 113 bits make more exact: None where the processor
    has none of 64. Raises ReferenceFailed."""
    if not has_precision(FAST_PRECISION):
        return None
    code = compile_for_reference(model, FAST_PRECISION)
    made = solve(code, case, nominal, case.grid, code.explicit, seconds, ladders=SOFTENED_LADDERS)
    return replace(made, doubt=np.maximum(made.doubt, SOFTENING))


def _with_claim(point: WorkPrecisionPoint, task: Task, options: SimulationOptions) -> WorkPrecisionPoint:
    """Let a run of the same setting estimate its own error, and compare it with what that error is."""
    if point.error is None or point.seconds > LONGEST_CLAIMED:
        return point
    problem, truth = task.case.problem, task.reference
    setting = {"step": point.setting} if point.fixed else {"tolerance": point.setting}
    asked = replace(
        options, stop=task.case.stop, method=point.method, points=truth.t.size, dense=False, **setting
    )
    try:
        run = run_problem(problem, asked)
    except SimulationError:
        return point
    estimate = run.accuracy.error
    if estimate is None:
        return point
    names = [q.name for q in problem.states]
    known = np.isin(truth.t, run.time)  # of events both sides are rows
    rows = np.searchsorted(run.time, truth.t[known], side="right") - 1
    y = np.column_stack([run[name][rows] for name in names])
    sizes = np.array([estimate.nominal[name] for name in names])
    apart = np.abs((y - truth.high[known]) - truth.low[known]) / (sizes + np.abs(truth.high[known]))
    return replace(point, claimed=estimate.largest, claimed_of=float(np.nanmax(apart, initial=0.0)))


LEVELS = (1e-9, 1e-6, 1e-3)
"""Errors for which a conclusion is drawn: the first one that a method of the kernel reaches."""
CLEARER = 10.0
"""How many times larger than the doubt of the reference such an error is."""
ALIKE = 1.25
"""By how much times, even measured in turns, differ from one run of the measurement to the next: by less they are called the same."""
CONTENDERS = 2.0
"""How many times as long as the fastest one those may take whose times are measured again in turns."""


def _levels(truth: PrecisionReference) -> list[float]:
    return [level for level in LEVELS if level > CLEARER * float(np.nanmax(truth.doubt))]


def _by_side(points: Sequence[WorkPrecisionPoint]) -> tuple[dict[str, list[WorkPrecisionPoint]], ...]:
    """Return the points by method: those of the kernel, then those of peers."""
    sides: tuple[dict[str, list[WorkPrecisionPoint]], ...] = ({}, {})
    for p in points:
        sides[p.method not in KERNEL_METHODS].setdefault(p.method, []).append(p)
    return sides


def _in_turns(
    points: tuple[WorkPrecisionPoint, ...],
    truth: PrecisionReference,
    task: Task,
    beside: Mapping[str, Peer],
) -> tuple[WorkPrecisionPoint, ...]:
    """Measure again, in turns, the times on which the conclusion rests."""
    ours, theirs = _by_side(points)
    levels = [level for level in _levels(truth) if _times_to_reach(ours, level)]
    reached = [level for level in levels if _times_to_reach(theirs, level)]
    contending: dict[int, WorkPrecisionPoint] = {}
    for level in {*levels[:1], *reached[:1]}:
        for side in (ours, theirs):
            times = _times_to_reach(side, level)
            best = min(times.values(), default=0.0)
            for name, taken in times.items():
                if taken <= CONTENDERS * best:
                    contending |= {id(p): p for p in around(side[name], level)}
    if not contending or sum(p.seconds for p in contending.values()) > task.longest:
        return points
    measured = timed_in_turns(task, list(contending.values()), beside)
    again = dict(zip(contending, measured, strict=True))
    return tuple(again.get(id(p), p) for p in points)


class _Time(Struct, frozen=True):
    """How long a method takes to reach an error, in seconds: the median and the quartiles of repeated runs, and the rounds in which it
    was timed in turns with others."""

    seconds: float
    low: float
    high: float
    rounds: tuple[float, ...] = ()

    def over(self, other: _Time) -> tuple[float, float]:
        """Return how many times as long as another one this takes, at least and at most: the middle half of the rounds in which both
        were timed, and what two measurements differ by."""
        low, high = self.low / other.high, self.high / other.low
        if self.rounds and len(self.rounds) == len(other.rounds):
            ratios = [a / b for a, b in zip(self.rounds, other.rounds, strict=True)]
            low, high = np.percentile(ratios, (25, 75)).tolist()
        return low / ALIKE, high * ALIKE


def conclusion(made: Benchmark) -> str:
    """Say in one sentence which method to take: names are joined where the spread of their times does not tell them apart."""
    ours, theirs = _by_side(made.points)
    levels = [level for level in _levels(made.reference) if _times_to_reach(ours, level)]
    if not levels:
        return f"no method reaches an error of {_power(LEVELS[-1])}"
    level = levels[0]
    take, best = _fastest(ours, level)
    words = f"for {_power(level)} take {take}: {duration(best.seconds)}"
    if not theirs:
        return words
    reached = next((level for level in levels if _times_to_reach(theirs, level)), None)
    if reached is None:
        return f"{words}; none of the peers gets there"
    if reached > level:
        take, best = _fastest(ours, reached)
        words += (
            f"; none of the peers gets there; for {_power(reached)} {take} takes {duration(best.seconds)}"
        )
    peer, other = _fastest(theirs, reached)
    least, most = other.over(best)
    if most < 1:
        return (
            f"for {_power(reached)} take {peer}: {duration(other.seconds)}; the fastest of mechc, {take}, needs "
            f"{_span(1 / most, 1 / least)} times as long"
        )
    if least <= 1:
        return f"{words}; {peer} takes as long within the spread"
    return f"{words}; the fastest peer, {peer}, needs {_span(least, most)} times as long"


def _fastest(methods: Mapping[str, Sequence[WorkPrecisionPoint]], level: float) -> tuple[str, _Time]:
    """Return the fastest method with those that the spread does not tell from it, and its time: ``auto`` is left to what it chooses."""
    times = _spans_to_reach(methods, level)
    alike = _alike(times)
    named = [name for name in alike if name != "auto"] or alike
    return " or ".join(filter(None, (", ".join(named[:-1]), named[-1]))), min(
        (times[name] for name in named), key=lambda t: t.seconds
    )


def _alike(times: Mapping[str, _Time]) -> list[str]:
    """Return the methods that the spread does not tell from the fastest."""
    best = min(times.values(), key=lambda t: t.seconds)
    return [name for name, t in times.items() if t.over(best)[0] <= 1]


def _span(least: float, most: float) -> str:
    low, high = _rounded(least), _rounded(most)
    return low if low == high else f"{low} to {high}"


def _rounded(ratio: float) -> str:
    """Return two digits, without an exponent."""
    return f"{float(f'{ratio:.2g}'):.10g}"


def _power(level: float) -> str:
    return f"{level:.0e}".replace("e-0", "e-")


def _spans_to_reach(methods: Mapping[str, Sequence[WorkPrecisionPoint]], level: float) -> dict[str, _Time]:
    found = {}
    for name, points in methods.items():
        near = around(points, level)
        seconds = time_between(near, level, [p.seconds for p in near])
        if seconds is None:
            continue
        ends = [[(p.quartiles or (p.seconds, p.seconds))[k] for p in near] for k in (0, 1)]
        low, high = (time_between(near, level, end) or seconds for end in ends)
        count = min(len(p.rounds) for p in near)
        rounds = (time_between(near, level, [p.rounds[k] for p in near]) or seconds for k in range(count))
        found[name] = _Time(seconds, min(low, seconds), max(high, seconds), tuple(rounds))
    return found


def _times_to_reach(methods: Mapping[str, Sequence[WorkPrecisionPoint]], level: float) -> dict[str, float]:
    found = {name: time_to_reach(points, level) for name, points in methods.items()}
    return {name: seconds for name, seconds in found.items() if seconds is not None}


def _measured(
    task: Task,
    names: Sequence[str],
    tolerances: Sequence[float],
    enough: float,
    beside: Mapping[str, Peer],
) -> tuple[tuple[WorkPrecisionPoint, ...], tuple[tuple[str, str], ...]]:
    """Measure methods; return the points, and those that do not fit the model with the reason."""
    points: list[WorkPrecisionPoint] = []
    skipped: list[tuple[str, str]] = []
    for name in names:
        least = enough if name in beside else 0.0
        try:
            points += measure(task, name, tolerances, enough=least, peer=beside.get(name))
        except SimulationError as error:
            skipped.append((name, error.message))
    return tuple(points), tuple(skipped)


def _agreement(
    exact: dict[int, tuple[str, Array]], truth: PrecisionReference, nominal: Array
) -> dict[str, float]:
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
) -> PrecisionReference:
    """Return closed solutions as a reference; states without one are not-a-number, and not measured."""
    high = np.full((case.grid.size, problem.ny), np.nan)
    for k, (_, values) in exact.items():
        high[:, k] = values
    doubt = np.full(case.grid.size, float(np.finfo(float).eps))
    return PrecisionReference(
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


def _reference(
    model: CompiledModel, case: Case, nominal: Array, methods: Sequence[str], seconds: float
) -> PrecisionReference:
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

    def make(code: ReferenceCode) -> PrecisionReference:
        return solve(code, case, nominal, case.grid, "radau5" if stiff else code.explicit, seconds)

    def make_best() -> PrecisionReference:
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
) -> PrecisionReference:
    """Solve a model in higher precision at given times, with the numbers that it states taken as exact decimals.

    Raises ReferenceFailed, SimulationError, CompilerMissing, BuildError.
    """
    problem = model.problem()
    functions = load_functions(problem)
    options = SimulationOptions(experiment=experiment, values=model.settings, stop=max(times), points=2)
    case = prepare(problem, functions, options)
    code = compile_for_reference(model)
    return solve(code, case, nominal_of(case), np.array(times), code.explicit, seconds, decimals=True)


def _first(truth: PrecisionReference, count: int) -> PrecisionReference:
    return replace(
        truth, t=truth.t[:count], high=truth.high[:count], low=truth.low[:count], doubt=truth.doubt[:count]
    )
