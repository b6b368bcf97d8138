"""What a benchmark looks like: the table, and the diagram of error over run time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..presentation.numbers import duration

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .benchmark import Benchmark


def report(made: Benchmark) -> str:
    """Return the table, with what it was measured against."""
    rows = [
        f"{made.model}{', ' + made.experiment if made.experiment else ''}: error against run time",
        _reference_line(made),
    ]
    rows += [
        f"closed solution of {name}: the reference agrees to {error:.0e}"
        for name, error in made.closed.items()
    ]
    if made.horizon < made.stop:
        why = "the model ends its run" if made.ended else "the motion is too chaotic for a reference"
        rows.append(f"measured to t = {made.horizon:.6g} of {made.stop:.6g}: beyond, {why}")
    for method, points in made.by_method().items():
        rows += ["", f"  {method:<14}    error   at end     run time  spread      steps  evaluations"]
        for p in points:
            if p.error is None or p.error_at_end is None:
                rows.append(f"  {p.setting:>14.3g}  {p.failure}")
                continue
            rows.append(
                f"  {p.setting:>14.3g}  {p.error:.1e}  {p.error_at_end:.1e}  {duration(p.seconds):>11}"
                f"  {p.spread:>5.0%}  {p.steps:>9}  {p.evaluations:>11}"
            )
    rows += ["", *(f"  {name}: {why}" for name, why in made.skipped)] if made.skipped else []
    return "\n".join(rows)


def _reference_line(made: Benchmark) -> str:
    truth = made.reference
    if truth.method == "closed solution":
        return "reference: the closed solutions that the model states; other states are not measured"
    effort = "from the cache" if truth.cached else f"{truth.seconds:.1f} s"
    return (
        f"reference: {truth.method} in {truth.precision} at {truth.tolerance:.0e}, "
        f"{made.digits} digits trusted ({effort})"
    )


def draw(made: Benchmark, path: Path) -> None:
    """Draw the diagram: error over run time, both logarithmic, one line for each method."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.add_subplot()
    _curves(made, axes)
    axes.set_xlabel("run time, s")
    axes.set_ylabel("largest relative error")
    axes.set_title(f"{made.model}, to t = {made.horizon:g}")
    axes.legend()
    with rc_context({"svg.hashsalt": made.model}):  # the same picture is the same file
        figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix == ".svg" else None)


def draw_small(made: Benchmark, path: Path) -> None:
    """Draw the diagram for a table of many: no title, few pixels."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.6, 2.4), layout="constrained")
    axes = figure.add_subplot()
    _curves(made, axes)
    axes.tick_params(labelsize=7)
    axes.legend(fontsize=7, handlelength=1.2, borderpad=0.3, labelspacing=0.3)
    figure.savefig(path, dpi=80, pil_kwargs={"optimize": True})


def _curves(made: Benchmark, axes: Axes) -> None:
    for (method, points), marker in zip(made.by_method().items(), "osD^v<>pPX*hH" * 2, strict=False):
        good = [(p.seconds, p.error) for p in points if p.error is not None and p.error < 1]
        axes.loglog(*zip(*good, strict=True), marker=marker, ms=4, lw=1.2, label=method) if good else None
    axes.grid(alpha=0.3)
