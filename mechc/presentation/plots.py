"""Pictures of a motion: coordinates, phase portraits, trajectories of points, energies.

``figure`` decides from the solution which panels there are; Matplotlib is imported when it is called.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .panels import Changes, Curves, Energies, Panel, Paths, Portrait, curves_of, element, panels_of

if TYPE_CHECKING:
    from ..runtime.problem import Array
    from ..shown import ShownSolution

COLOURS = ("#1f5fa8", "#d1495b", "#2a9d6f", "#e09f3e", "#7656a8", "#5b6770", "#17a2b8", "#a65628")
GREY = "#6b7280"
MOST_EVENTS = 100
CONSTANT = 1e-6
"""Relative change below which a curve is drawn as constant."""
SMOOTH = 2000
"""Points of a curve, where the solution can be computed between its output points."""
FLATTEST = 0.5
"""Least side of the box around a path in space, as a share of its largest."""
LEGEND_CHARACTERS = 46
"""Width of a legend that fits beside the title."""
ROW_CHARACTERS = 78
"""Width of a legend that has a row of its own."""

STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelcolor": "#374151",
    "axes.edgecolor": "#9ca3af",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e5e7eb",
    "grid.linewidth": 0.7,
    "xtick.color": "#4b5563",
    "ytick.color": "#4b5563",
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "legend.edgecolor": "white",
    "legend.fontsize": 8,
    "figure.dpi": 100,
    "savefig.dpi": 150,
}


class View:
    """A solution at times that are dense enough for smooth curves, in the units to show.

    The rows of the solution stay as they are, both sides of each event among them.
    """

    def __init__(self, solution: ShownSolution) -> None:
        self.solution = solution
        between = np.empty(0)
        if 1 < len(solution.time) < SMOOTH and solution.interpolation == "dense output":
            dense = np.linspace(solution.time[0], solution.time[-1], SMOOTH)
            between = dense[~np.isin(dense, solution.time)]
        self._between: Mapping[str, Array] = solution(between) if len(between) else {}
        times = np.concatenate([solution.time, between])
        self._order = np.argsort(times, kind="stable")
        self.time = times[self._order]

    def __getitem__(self, name: str) -> Array:
        values = np.concatenate([self.solution[name], self._between.get(name, np.empty(0))])
        return values[self._order] * self.solution.shown_unit(name)[1]

    def unit(self, name: str) -> str:
        return self.solution.shown_unit(name)[0]

    def label(self, name: str) -> str:
        return _axis_label(name, self.unit(name))


def figure(solution: ShownSolution, names: Sequence[str] = ()) -> Any:
    """Draw a solution and return the Matplotlib figure; ``names`` limits it to those quantities."""
    import matplotlib

    from .notebook import Picture

    view = View(solution)
    panels = curves_of(solution, solution.named(names)) if names else panels_of(solution)
    columns = 1 if len(panels) == 1 else 2
    rows = max(1, math.ceil(len(panels) / columns))
    with matplotlib.rc_context(STYLE):
        result = Picture(
            figsize=(5.2 * columns if columns > 1 else 7.0, 3.0 * rows + 0.5), layout="constrained"
        )
        problem = solution.problem
        result.suptitle(problem.doc or problem.name, fontsize=11, x=0.01, ha="left", color="#111827")
        grid = result.add_gridspec(rows, columns)
        for i, panel in enumerate(panels):
            three = isinstance(panel, Paths) and panel.dimension == 3
            alone = (
                i == len(panels) - 1 and i % columns == 0 and isinstance(panel, (Changes, Curves, Energies))
            )
            place = grid[i // columns, :] if alone else grid[i // columns, i % columns]
            axes = result.add_subplot(place, projection="3d" if three else None)
            _draw(axes, panel, view)
    return result


def save(solution: ShownSolution, path: Path, names: Sequence[str] = ()) -> None:
    """Write the figure as PNG, PDF or SVG, as the ending says; needs no display."""
    figure(solution, names).savefig(path)


def has_display() -> bool:
    """Say whether a window can be opened and somebody is there to look at it."""
    if not sys.stdout.isatty():
        return False
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def show(solution: ShownSolution, names: Sequence[str] = ()) -> None:
    """Open a window and wait until it is closed."""
    import matplotlib.pyplot as plt
    from matplotlib.backend_bases import FigureManagerBase

    drawn = figure(solution, names)
    window = plt.figure()
    manager = window.canvas.manager
    assert isinstance(manager, FigureManagerBase)
    drawn.set_canvas(manager.canvas)
    manager.canvas.figure = drawn
    plt.show()


def _draw(axes: Any, panel: Panel, view: View) -> None:
    match panel:
        case Changes():
            _draw_changes(axes, panel, view)
        case Curves():
            _draw_curves(axes, panel, view)
        case Portrait():
            _draw_portrait(axes, panel, view)
        case Paths():
            _draw_paths(axes, panel, view)
        case Energies():
            _draw_energies(axes, panel, view)


def _draw_curves(axes: Any, panel: Curves, view: View) -> None:
    for name, colour in zip(panel.names, COLOURS, strict=False):
        axes.plot(view.time, view[name], color=colour, label=name)
    if len(panel.names) == 1:
        axes.set_title(panel.names[0])
    else:
        axes.set_title(_title(panel.title, panel.left_out, len(panel.names)))
        legend(axes)
    axes.set_ylabel(_unit_label(view.unit(panel.names[0])))
    _calm(axes)
    _time_axis(axes, view)


def _draw_changes(axes: Any, panel: Changes, view: View) -> None:
    """Draw derivatives, each with a band of its estimated error."""
    time = view.solution.time
    for one, colour in zip(panel.curves, COLOURS, strict=False):
        axes.plot(time, one.values, color=colour, label=one.name)
        if one.errors is not None:
            axes.fill_between(
                time, one.values - one.errors, one.values + one.errors, color=colour, alpha=0.2, lw=0
            )
    if len(panel.curves) == 1 and not panel.left_out:
        axes.set_title(panel.curves[0].name)
    else:
        axes.set_title(_title(f"derivatives in {panel.to}", panel.left_out, len(panel.curves)))
        legend(axes)
    axes.set_ylabel(_unit_label(panel.unit))
    _time_axis(axes, view)


def _draw_portrait(axes: Any, panel: Portrait, view: View) -> None:
    position, rate = view[panel.name], view[panel.rate]
    axes.plot(position, rate, color=COLOURS[0], linewidth=1.1)
    axes.plot(position[:1], rate[:1], "o", color=COLOURS[0], markersize=4, markerfacecolor="white")
    axes.plot(position[-1:], rate[-1:], "o", color=COLOURS[0], markersize=4)
    axes.set_title(f"phase portrait of {panel.name}")
    axes.set_xlabel(view.label(panel.name))
    axes.set_ylabel(view.label(panel.rate))


def _draw_paths(axes: Any, panel: Paths, view: View) -> None:
    unit = view.unit(element(panel.names[0], 1))
    for name, colour in zip(panel.names, COLOURS, strict=False):
        parts = [view[element(name, i)] for i in range(1, panel.dimension + 1)]
        label = f"{name[:-1]}]" if name.endswith(",") else name
        axes.plot(*parts, color=colour, linewidth=1.1, label=label)
        axes.plot(*(part[:1] for part in parts), "o", color=colour, markersize=4, markerfacecolor="white")
        axes.plot(*(part[-1:] for part in parts), "o", color=colour, markersize=4)
    text = f"path of {panel.names[0]}" if len(panel.names) == 1 else "paths"
    axes.set_title(_title(text, panel.left_out, len(panel.names)))
    axes.set_xlabel(_axis_label("x", unit))
    axes.set_ylabel(_axis_label("y", unit))
    if panel.dimension == 3:
        axes.set_zlabel(_axis_label("z", unit))
        _equal_box(axes)
    else:
        axes.set_aspect("equal", adjustable="datalim")
    if len(panel.names) > 1:
        legend(axes)


def _equal_box(axes: Any) -> None:
    """Give the axes in space one scale, and a box that is nowhere too flat for its numbers to be read."""
    limits = [axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d()]
    largest = max(high - low for low, high in limits)
    spans = [max(high - low, FLATTEST * largest) for low, high in limits]
    for axis, (low, high), span in zip("xyz", limits, spans, strict=True):
        middle = (low + high) / 2
        getattr(axes, f"set_{axis}lim3d")(middle - span / 2, middle + span / 2)
        axes.locator_params(axis=axis, nbins=max(2, round(6 * span / largest)))
    axes.set_box_aspect(spans)


def _draw_energies(axes: Any, panel: Energies, view: View) -> None:
    if panel.balance:
        error, unit = balance_error(view.solution)
        axes.plot(view.solution.time, error, color=COLOURS[1], linewidth=1.0)
        axes.set_title("error of the energy balance")
        axes.set_ylabel(_unit_label(unit))
    else:
        for name, colour in zip(panel.names, COLOURS, strict=False):
            heavy = name.endswith("total")
            axes.plot(
                view.time,
                view[name],
                color="#111827" if heavy else colour,
                linewidth=1.6 if heavy else 1.2,
                label=name.removeprefix("energy."),
            )
        axes.set_title("energies")
        axes.set_ylabel(_unit_label(view.unit(panel.names[0]) if panel.names else "J"))
        legend(axes)
        _calm(axes)
    _time_axis(axes, view)


def _calm(axes: Any) -> None:
    """Let curves that are constant but for noise look constant."""
    lowest, highest = axes.dataLim.intervaly
    size = max(abs(lowest), abs(highest))
    if 0 < highest - lowest < CONSTANT * size:
        axes.set_ylim(lowest - 0.1 * size, highest + 0.1 * size)


def balance_error(solution: ShownSolution) -> tuple[Array, str]:
    """Return total + dissipated - supplied energy less its first value, and its unit."""
    problem = solution.problem
    total, dissipated, supplied = (*problem.energy_balance, -1, -1)[:3]
    quantity = problem.outputs[total]
    sum_ = np.array(solution[quantity.name], dtype=np.float64)
    if dissipated >= 0:
        sum_ = sum_ + solution[problem.outputs[dissipated].name]
    if supplied >= 0:
        sum_ = sum_ - solution[problem.outputs[supplied].name]
    return sum_ - sum_[0], quantity.unit


def _time_axis(axes: Any, view: View) -> None:
    """Label the time axis and mark the events."""
    solution = view.solution
    time = solution.problem.time
    axes.set_xlabel(_axis_label(time.name or "time", time.unit))
    if len(solution.time) > 1:
        axes.set_xlim(solution.time[0], solution.time[-1])
    if len(solution.events) <= MOST_EVENTS:
        for event in solution.events:
            axes.axvline(event.time, color=GREY, linewidth=0.7, linestyle=(0, (2, 3)), zorder=1.5)


def legend(axes: Any) -> None:
    """Put the legend beside the title where it fits, else between the title and the curves."""
    labels = axes.get_legend_handles_labels()[1]
    beside = sum(len(label) + 4 for label in labels) <= LEGEND_CHARACTERS
    rows = math.ceil(len(labels) / max(1, ROW_CHARACTERS // (max(map(len, labels)) + 5)))
    axes.legend(
        loc="lower right" if beside else "lower left",
        bbox_to_anchor=(1.01 if beside else -0.01, 1.0),
        ncols=len(labels) if beside else math.ceil(len(labels) / rows),
        borderpad=0.2,
        handlelength=1.2,
        handletextpad=0.5,
        columnspacing=1.0,
        labelspacing=0.3,
    )
    if not beside:
        axes.set_title(axes.get_title(loc="left"), pad=6 + 12 * rows)


def _title(text: str, left_out: int, shown: int) -> str:
    return f"{text} ({shown} of {shown + left_out})" if left_out else text


def _axis_label(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit and unit != "1" else name


def _unit_label(unit: str) -> str:
    return f"[{unit}]" if unit and unit != "1" else ""
