"""How a curve converges: the error of what is stationary over unknowns, for elements of several degrees."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct, to_builtins

from ..presentation.numbers import duration
from ..requests.parse_values import UsageMistake
from ..runtime.case import find_experiment
from ..runtime.curves.posed import pose
from ..runtime.curves.search import Failed, search

if TYPE_CHECKING:
    from pathlib import Path

    from ..model import CompiledModel

DEGREES = (4, 6, 8, 10)
ELEMENTS = (1, 2, 4, 8, 16, 32)
RESOLVED = 1e-13
"""Relative error that is rounding."""


class MeshError(Struct, frozen=True):
    """What equal elements give: ``error`` of the value relative to its size, ``order`` since the row of half as many; or why there is none."""

    degree: int
    elements: int
    unknowns: int = 0
    newton_steps: int = 0
    error: float | None = None
    order: float | None = None
    seconds: float = 0.0
    failure: str = ""


class Convergence(Struct, frozen=True):
    """``stationary`` with its ``error``: the reference, on elements that fit the curve."""

    model: str
    experiment: str
    stationary: float
    error: float
    unit: str
    meshes: tuple[MeshError, ...]

    def summary(self) -> dict[str, Any]:
        found: dict[str, Any] = to_builtins(self)
        return found


def convergence(model: CompiledModel, experiment: str | None) -> Convergence:
    """Find the curve on equal elements of several degrees. Raises UsageMistake, SimulationError."""
    problem = model.problem()
    assert problem.curve is not None
    chosen = find_experiment(problem, experiment)
    posed = pose(problem, model.settings, chosen, None)
    with np.errstate(all="ignore"):
        try:
            best = search(posed)
        except Failed as failed:
            raise UsageMistake(
                f"'{model.name}' has no curve over '{problem.time.name}' to converge to: {failed.why}",
                "'mechc run' says more, and takes both variables over a parameter where that helps",
            ) from None
        meshes: list[MeshError] = []
        for degree in DEGREES:
            if degree < 2 * problem.curve.order:
                continue
            before: MeshError | None = None
            for elements in ELEMENTS:
                before = _on(posed, degree, elements, best, before)
                meshes.append(before)
    name = chosen.name if chosen else ""
    return Convergence(
        model.name, name, float(best.value), float(best.value_error), problem.curve.unit, tuple(meshes)
    )


def _on(posed: Any, degree: int, elements: int, best: Any, before: MeshError | None) -> MeshError:
    """Return what equal elements give, for which the guess is the same."""
    begun = time.process_time()
    try:
        found = search(posed, degree=degree, adapt=False, elements=elements)
    except Failed as failed:
        return MeshError(degree, elements, failure=failed.why)
    seconds = time.process_time() - begun
    size = max(abs(best.value), best.size, 1e-300)
    error = float(abs(found.value - best.value) / size)
    order = None
    if before is not None and before.error and error > RESOLVED and before.unknowns < found.count:
        order = math.log2(before.error / error)
    return MeshError(degree, elements, found.count, found.steps, error, order, seconds)


def report(made: Convergence) -> str:
    """Return the table."""
    unit = f" {made.unit}" if made.unit else ""
    rows = [
        f"{made.model}{', ' + made.experiment if made.experiment else ''}: error over unknowns",
        f"reference: {made.stationary:.13g}{unit} with an error of {made.error:.0e}, on elements that fit the curve",
    ]
    for degree in dict.fromkeys(m.degree for m in made.meshes):
        rows += [
            "",
            f"  degree {degree:<4} elements  unknowns    error  order  Newton steps   processor time",
        ]
        for m in (m for m in made.meshes if m.degree == degree):
            if m.error is None:
                rows.append(f"  {'':<11} {m.elements:>8}  {m.failure}")
                continue
            order = f"{m.order:.1f}" if m.order is not None else "-"
            rows.append(
                f"  {'':<11} {m.elements:>8}  {m.unknowns:>8}  {m.error:.1e}  {order:>5}  {m.newton_steps:>12}"
                f"  {duration(m.seconds):>15}"
            )
    return "\n".join(rows)


def draw(made: Convergence, path: Path) -> None:
    """Draw error over unknowns, both logarithmic, one line for each degree."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.add_subplot()
    for degree, marker in zip(DEGREES, "osD^", strict=True):
        points = [(m.unknowns, m.error) for m in made.meshes if m.degree == degree and m.error]
        if points:
            axes.loglog(*zip(*points, strict=True), marker=marker, ms=4, lw=1.2, label=f"degree {degree}")
    axes.set_xlabel("unknowns")
    axes.set_ylabel("relative error of what is stationary")
    axes.set_title(made.model)
    axes.grid(alpha=0.3)
    axes.legend()
    with rc_context({"svg.hashsalt": made.model}):  # the same picture is the same file
        figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix == ".svg" else None)
