"""Error against run time of one model: the reference, the measured methods, the table and the diagram."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .compiler.pipeline import program_for
from .compiler.problem import header
from .compiler.targets.c import emit_c
from .runtime.build import build_shared
from .runtime.case import Case, SimulationOptions, input_values, prepare
from .runtime.functions import Functions, load_functions
from .runtime.native import kernel_methods, load_kernel
from .runtime.nominal import nominal_values
from .runtime.outcome import SimulationError
from .runtime.peers import METHODS
from .runtime.pilot import largest_values
from .runtime.reference import Reference, ReferenceFailed, best_precision, reference, reference_flags
from .runtime.work_precision import TOLERANCES, Point, measure

if TYPE_CHECKING:
    from .api import Model
    from .runtime.problem import Problem

DEFAULT_METHODS = ("dop853", "radau5", "rk4")
MEASURED_POINTS = 41
"""Output times at which errors are measured."""
HORIZON_DOUBT = 1e-14
"""Times at which the two reference runs differ by more are not measured on."""


@dataclass(frozen=True, slots=True)
class Benchmark:
    """``skipped``: methods that do not fit the model, with the reason. ``horizon``: the last time of measurement,
    earlier than ``stop`` where the reference cannot be trusted to the end."""

    model: str
    experiment: str
    reference: Reference
    horizon: float
    stop: float
    points: tuple[Point, ...]
    skipped: tuple[tuple[str, str], ...]

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
                "seconds": made.seconds,
                "horizon": self.horizon,
            },
            "points": [asdict(point) for point in self.points],
            "skipped": dict(self.skipped),
        }


def benchmark(
    model: Model,
    *,
    methods: Sequence[str] = (),
    against: Sequence[str] = (),
    tolerances: Sequence[float] = TOLERANCES,
    experiment: str | None = None,
    stop: float | None = None,
    seconds: float = 60.0,
    progress: Callable[[], None] | None = None,
) -> Benchmark:
    """Measure a model. ``seconds``: how long the reference may take.

    Raises ReferenceFailed, SimulationError, CompilerMissing, BuildError.
    """
    problem = model.problem("c", method="radau5")
    functions = load_functions(problem)
    options = SimulationOptions(
        experiment=experiment, values=model.settings, stop=stop, points=MEASURED_POINTS
    )
    case = prepare(problem, functions, options)
    nominal = _nominal(problem, functions, case)
    truth = _reference(model, case, nominal, methods, seconds)
    count = truth.trusted(HORIZON_DOUBT)
    if count < 2:
        raise ReferenceFailed(
            f"its two best runs differ by {truth.doubt[1]:.0e} at t = {truth.t[1]:g} already"
        )
    truth = _first(truth, count)
    horizon = float(truth.t[-1])
    points: list[Point] = []
    skipped: list[tuple[str, str]] = []
    known = [*methods] if methods else [m for m in DEFAULT_METHODS if m in kernel_methods(load_kernel())]
    measured = _until(case, horizon)
    for name in [*known, *(f"scipy:{m}" for a in against for m in _peers(a))]:
        try:
            points += measure(problem, functions, measured, name, nominal, truth, tolerances, progress)
        except SimulationError as error:
            skipped.append((name, error.message))
    return Benchmark(model.name, case.experiment, truth, horizon, case.stop, tuple(points), tuple(skipped))


def _peers(name: str) -> Sequence[str]:
    """Return the methods that a word of ``--against`` stands for. Raises SimulationError."""
    if name == "scipy":
        return METHODS
    if name.startswith("scipy:") and name.removeprefix("scipy:") in METHODS:
        return (name.removeprefix("scipy:"),)
    raise SimulationError(f"there is no peer '{name}': scipy, or one of scipy:{', scipy:'.join(METHODS)}")


def _reference(model: Model, case: Case, nominal: Any, methods: Sequence[str], seconds: float) -> Reference:
    """Solve the case in higher precision; by radau5 if that is the only method asked for."""
    precision = best_precision()
    program = program_for(model.compilation, implicit=True)
    sources = {"model.c": emit_c(program), "model.h": header()}
    library = build_shared(sources, reference_flags(precision), name="reference-model")
    method = "radau5" if tuple(methods) == ("radau5",) else "dop853"
    return reference(library, case, nominal, case.grid, precision=precision, method=method, seconds=seconds)


def _nominal(problem: Problem, functions: Functions, case: Case) -> Any:
    u = input_values(functions, case.tables, case.begin, case.p, len(problem.inputs))
    rates = functions.rhs(case.begin, case.y0, u, case.z, case.p)
    outputs = functions.outputs(case.begin, case.y0, u, case.z, case.p) if functions.outputs else ()
    energies = [float(v) for v, q in zip(outputs, problem.outputs, strict=True) if q.kind == "energy"]
    duration = case.stop - case.begin
    return nominal_values(
        problem,
        case.y0,
        rates,
        case.p,
        energies,
        duration,
        lambda provisional: largest_values(problem, functions, case, provisional),
    )


def _first(truth: Reference, count: int) -> Reference:
    return replace(
        truth, t=truth.t[:count], high=truth.high[:count], low=truth.low[:count], doubt=truth.doubt[:count]
    )


def _until(case: Case, horizon: float) -> Case:
    return replace(case, stop=horizon, grid=case.grid[case.grid <= horizon])


def report(made: Benchmark) -> str:
    """Return the table, with what it was measured against."""
    truth = made.reference
    rows = [
        f"{made.model}{', ' + made.experiment if made.experiment else ''}: error against run time",
        f"reference: {truth.method} in {truth.precision} at {truth.tolerance:.0e}, known to {truth.doubt.max():.0e}"
        f" ({truth.seconds:.1f} s)",
    ]
    if made.horizon < made.stop:
        rows.append(
            f"measured to t = {made.horizon:.6g} of {made.stop:.6g}: beyond, the motion is too chaotic for a reference"
        )
    for method, points in made.by_method().items():
        rows += ["", f"  {method:<14}    error   at end     run time  spread      steps  evaluations"]
        for p in points:
            if p.error is None or p.error_at_end is None:
                rows.append(f"  {p.setting:>14.3g}  {p.failure}")
                continue
            rows.append(
                f"  {p.setting:>14.3g}  {p.error:.1e}  {p.error_at_end:.1e}  {_duration(p.seconds):>11}"
                f"  {p.spread:>5.0%}  {p.steps:>9}  {p.evaluations:>11}"
            )
    rows += ["", *(f"  {name}: {why}" for name, why in made.skipped)] if made.skipped else []
    return "\n".join(rows)


def _duration(seconds: float) -> str:
    for unit, factor in (("us", 1e6), ("ms", 1e3)):
        if seconds * factor < 1000:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds:.3g} s"


def draw(made: Benchmark, path: Path) -> None:
    """Draw the diagram: error over run time, both logarithmic, one line for each method."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.add_subplot()
    for (method, points), marker in zip(made.by_method().items(), "osD^v<>pPX*hH" * 2, strict=False):
        good = [(p.seconds, p.error) for p in points if p.error is not None and p.error < 1]
        axes.loglog(*zip(*good, strict=True), marker=marker, ms=4, lw=1.2, label=method) if good else None
    axes.set_xlabel("run time, s")
    axes.set_ylabel("largest relative error")
    axes.set_title(f"{made.model}, to t = {made.horizon:g}")
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=150)
