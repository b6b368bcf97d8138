"""Pictures of a motion: coordinates, phase portraits, trajectories of points, energies.

``figure`` decides from the solution which panels there are; Matplotlib is imported when it is called.
"""

from __future__ import annotations

import os
import sys
import textwrap
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..requests.parse_values import UsageMistake
from .axes import (
    COLOURS,
    SIZES,
    SolutionView,
    draw_on,
    equal_box,
    given_axes,
    label_axis,
    legend,
    style_named,
    title,
)
from .letters import axis_label, letters, unit_label
from .painting import Painter
from .panels import (
    Changes,
    EnergyPanel,
    Panel,
    Paths,
    PhasePanel,
    Scenery,
    TimePanel,
    curves_of,
    element,
    panels_of,
)
from .stillness import Stillness

if TYPE_CHECKING:
    from ..runtime.problem import Array
    from ..solution import Solution


GREY = "#6b7280"
MOST_EVENTS = 100
CONSTANT = 1e-6
"""Relative change below which a curve is drawn as constant."""
HEAD_CHARACTERS = 66
LINE_CHARACTERS = 15.5
"""Width of the line below the panels, for each inch."""


def figure(solution: Solution, names: Sequence[str] = (), style: str = "") -> Any:
    """Draw a solution and return the Matplotlib figure; ``names`` limits it to those quantities, ``a:b`` is one over another."""
    import matplotlib

    from .axes import Picture

    solution = solution.in_picture()
    view = SolutionView(solution)
    panels = curves_of(solution, _chosen(solution, names)) if names else panels_of(solution)
    with matplotlib.rc_context(style_named(style)):
        places, columns, rows = _places(panels)
        width, size = (5.2 * columns if columns > 1 else 7.0), SIZES[style]
        result = Picture(figsize=(size * width, size * (3.0 * rows + 0.5)), layout="constrained")
        problem = solution.problem
        if not style:
            head = "\n".join(textwrap.wrap(problem.doc or problem.name, HEAD_CHARACTERS * columns))
            result.suptitle(head, fontsize=11, x=0.01, ha="left", color="#111827")
        line = "" if names or style else Stillness(solution).line()
        if line:
            text = "\n".join(textwrap.wrap(line, round(LINE_CHARACTERS * width)))
            result.supxlabel(text, fontsize=8, x=0.01, ha="left", color="#374151")
        grid = result.add_gridspec(rows, columns)
        for panel, place in zip(panels, places, strict=True):
            axes = result.add_subplot(grid[place], projection="3d" if _in_space(panel, solution) else None)
            _draw(axes, panel, view)
    return result


def draw_into(ax: Any, solution: Solution, names: Sequence[str], style: str) -> Any:
    """Draw quantities of a solution into axes that are given, one for each diagram, and return these. Raises UsageMistake."""
    if not names:
        raise UsageMistake("what is drawn into given axes has no default", 'say it: plot("theta", ax=ax)')
    solution = solution.in_picture()
    view, panels = SolutionView(solution), curves_of(solution, _chosen(solution, names))
    for axes, panel in zip(given_axes(ax, len(panels)), panels, strict=True):
        draw_on(axes, partial(_draw, panel=panel, view=view), style)
    return ax


def _chosen(solution: Solution, names: Sequence[str]) -> list[str]:
    """Return the names that were asked for, with the elements of vectors; in pairs ``a:b``, too. Raises KeyError."""
    found: list[str] = []
    for name in names:
        across, colon, up = name.partition(":")
        ends = solution.named([across]), solution.named([up]) if colon else []
        found += [f"{a}:{b}" for a, b in zip(*ends, strict=True)] if colon else ends[0]
    return found


def _places(panels: Sequence[Panel]) -> tuple[list[tuple[Any, Any]], int, int]:
    """Return where the panels stand, and the number of columns and rows; what is drawn takes two rows."""
    if len(panels) == 1:
        return [(0, 0)], 1, 2 if isinstance(panels[0], Scenery) else 1
    tall = 2 if isinstance(panels[0], Scenery) and len(panels) > 2 else 1
    cells = [(k // 2, k % 2) for k in range(len(panels) + tall)]
    taken = {(k, 0) for k in range(tall)}
    free = [cell for cell in cells if cell not in taken][: len(panels) - 1]
    places: list[tuple[Any, Any]] = [(slice(0, tall), 0), *free]
    rows = max(row for row, _ in free) + 1
    if free[-1][1] == 0 and isinstance(panels[-1], Changes | TimePanel | EnergyPanel):
        places[-1] = (free[-1][0], slice(None))
    return places, 2, max(rows, tall)


def _in_space(panel: Panel, solution: Solution) -> bool:
    match panel:
        case Scenery():
            staged = solution.staged()
            return staged is not None and staged[0].size == 3
        case Paths():
            return panel.dimension == 3
    return False


def save(solution: Solution, path: Path, names: Sequence[str] = ()) -> None:
    """Write the figure as PNG, PDF or SVG, as the ending says; needs no display."""
    figure(solution, names).savefig(path)


def has_display() -> bool:
    """Say whether a window can be opened and somebody is there to look at it."""
    if not sys.stdout.isatty():
        return False
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def show(solution: Solution, names: Sequence[str] = ()) -> None:
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


def _draw(axes: Any, panel: Panel, view: SolutionView) -> None:
    match panel:
        case Changes():
            _draw_changes(axes, panel, view)
        case TimePanel():
            _draw_curves(axes, panel, view)
        case PhasePanel():
            _draw_portrait(axes, panel, view)
        case Paths():
            _draw_paths(axes, panel, view)
        case Scenery():
            draw_scenery(axes, panel, view)
        case EnergyPanel():
            _draw_energies(axes, panel, view)


def _draw_curves(axes: Any, panel: TimePanel, view: SolutionView) -> None:
    mark = "o" if len(view.time) == 1 else None
    for name, colour in zip(panel.names, COLOURS, strict=False):
        axes.plot(view.time, view[name], color=colour, label=letters(name), marker=mark)
    if len(panel.names) == 1:
        axes.set_title(letters(panel.names[0]))
    else:
        axes.set_title(title(panel.title, panel.left_out, len(panel.names)))
        legend(axes)
    _calm(axes)
    label_axis(axes.yaxis, "", view.unit(panel.names[0]))
    _time_axis(axes, view)


def _draw_changes(axes: Any, panel: Changes, view: SolutionView) -> None:
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
        axes.set_title(title(f"derivatives in {panel.to}", panel.left_out, len(panel.curves)))
        legend(axes)
    axes.set_ylabel(unit_label(panel.unit))
    _time_axis(axes, view)


def _draw_portrait(axes: Any, panel: PhasePanel, view: SolutionView) -> None:
    position, rate = view[panel.name], view[panel.rate]
    axes.plot(position, rate, color=COLOURS[0], linewidth=1.1)
    axes.plot(position[:1], rate[:1], "o", color=COLOURS[0], markersize=4, markerfacecolor="white")
    axes.plot(position[-1:], rate[-1:], "o", color=COLOURS[0], markersize=4)
    own = panel.rate == f"der({panel.name})"
    axes.set_title(
        f"phase portrait of {letters(panel.name)}"
        if own
        else f"{letters(panel.rate)} over {letters(panel.name)}"
    )
    label_axis(axes.xaxis, panel.name, view.unit(panel.name))
    label_axis(axes.yaxis, panel.rate, view.unit(panel.rate))
    if not own and view.unit(panel.name) == view.unit(panel.rate):
        axes.set_aspect("equal", adjustable="datalim")


def _draw_paths(axes: Any, panel: Paths, view: SolutionView) -> None:
    unit = view.unit(element(panel.names[0], 1))
    for name, colour in zip(panel.names, COLOURS, strict=False):
        parts = [view[element(name, i)] for i in range(1, panel.dimension + 1)]
        axes.plot(*parts, color=colour, linewidth=1.1, label=point_name(name))
        axes.plot(*(part[:1] for part in parts), "o", color=colour, markersize=4, markerfacecolor="white")
        axes.plot(*(part[-1:] for part in parts), "o", color=colour, markersize=4)
    text = f"path of {point_name(panel.names[0])}" if len(panel.names) == 1 else "paths"
    axes.set_title(title(text, panel.left_out, len(panel.names)))
    axes.set_xlabel(axis_label("x", unit))
    axes.set_ylabel(axis_label("y", unit))
    if panel.dimension == 3:
        axes.set_zlabel(axis_label("z", unit))
        equal_box(axes)
    else:
        axes.set_aspect("equal", adjustable="datalim")
    if len(panel.names) > 1:
        legend(axes)


def _draw_energies(axes: Any, panel: EnergyPanel, view: SolutionView) -> None:
    if panel.balance:
        error, unit = balance_error(view.solution)
        axes.plot(view.solution.time, error, color=COLOURS[1], linewidth=1.0)
        axes.set_title("error of the energy balance")
        axes.set_ylabel(unit_label(unit))
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
        legend(axes)
        _calm(axes)
        label_axis(axes.yaxis, "", view.unit(panel.names[0]) if panel.names else "J")
    _time_axis(axes, view)


def _calm(axes: Any) -> None:
    """Let curves that are constant but for noise look constant."""
    lowest, highest = axes.dataLim.intervaly
    size = max(abs(lowest), abs(highest))
    if 0 < highest - lowest < CONSTANT * size:
        axes.set_ylim(lowest - 0.1 * size, highest + 0.1 * size)


def balance_error(solution: Solution) -> tuple[Array, str]:
    """Return total + dissipated - supplied energy less its first value, in the unit of energies, and this."""
    problem = solution.problem
    total, dissipated, supplied = (*problem.energy_balance, -1, -1)[:3]
    quantity = problem.outputs[total]
    sum_ = np.array(solution[quantity.name], dtype=np.float64)
    if dissipated >= 0:
        sum_ = sum_ + solution[problem.outputs[dissipated].name]
    if supplied >= 0:
        sum_ = sum_ - solution[problem.outputs[supplied].name]
    unit, factor = solution.shown_unit(quantity.name)
    return (sum_ - sum_[0]) * factor, unit


def _time_axis(axes: Any, view: SolutionView) -> None:
    """Label the time axis and mark the events."""
    solution = view.solution
    time = solution.problem.time
    axes.set_xlabel(axis_label(time.name or "time", time.unit))
    if solution.time[-1] > solution.time[0]:
        axes.set_xlim(solution.time[0], solution.time[-1])
    if len(solution.events) <= MOST_EVENTS:
        for event in solution.events:
            axes.axvline(event.time, color=GREY, linewidth=0.7, linestyle=(0, (2, 3)), zorder=1.5)


ABOVE_BOX = 1.08
"""Where a title stands above a box in space, which is drawn larger than its axes."""
ROAD = "#9ca3af"
"""Colour of the paths of bodies without a trail."""
GHOSTS = 4
"""How often what is drawn without a path is painted."""


def draw_scenery(axes: Any, panel: Scenery, view: SolutionView) -> None:
    """Paint what is drawn, pale at the start and full at the end, over the paths of points."""
    solution = view.solution
    staged = solution.staged()
    assert staged is not None, "the panel was chosen for what is drawn"
    scene = staged[0]
    unit, factor = solution.shown_unit(element(panel.names[0], 1)) if panel.names else ("", 1.0)
    if not panel.names:
        lengths = "" if all(q.unit in ("", "1") for q in solution.problem.states) else "m"
        unit, factor = solution.display.in_units("", lengths)
    paths = [_path(view, name, factor) for name in panel.names]
    first, last = float(solution.time[0]), float(solution.time[-1])
    still = not paths and not any(shape.kind == "trail" for shape in scene.shapes)
    times = np.linspace(first, last, GHOSTS if still else 2)
    painter = Painter(solution, times, axes, paths)
    for k in range(len(times)):
        painter.paint(k, opacity=1.0 if k == len(times) - 1 else 0.3, clear=k == 0)
    for path in painter.roads() if still else ():
        parts = path.T[:2] if painter.flat else path.T
        axes.plot(*parts, color=ROAD, linewidth=0.9, zorder=1.7)
    drawn = painter.trails()
    for k, (name, path) in enumerate(zip(panel.names, paths, strict=True)):
        if any(
            np.allclose(path[[0, -1]], trail[[0, -1]], rtol=0, atol=1e-9 * painter.size) for trail in drawn
        ):
            continue
        parts = path.T[:2] if painter.flat else path.T
        axes.plot(*parts, color=COLOURS[k % len(COLOURS)], linewidth=1.1, label=point_name(name), zorder=1.8)
    text = "motion" if len(paths) != 1 else f"motion, with the trail of {point_name(panel.names[0])}"
    axes.set_title(title(text, panel.left_out, len(panel.names)), y=None if painter.flat else ABOVE_BOX)
    axes.set_title("", loc="right")
    if painter.flat:
        axes.update_datalim([painter.low[:2], painter.high[:2]])
        axes.autoscale(enable=True)
        axes.set_aspect("equal", adjustable="datalim")
    else:
        equal_box(axes)
        axes.set_anchor("N")
    for axis in "xy" if painter.flat else "xyz":
        label_axis(getattr(axes, f"{axis}axis"), axis, unit, factor)
    if len(axes.get_legend_handles_labels()[1]) > 1:
        legend(axes)


def _path(view: SolutionView, name: str, factor: float) -> Array:
    """Return the places of a point [n, 3] in SI."""
    parts = [view[element(name, i)] / factor for i in (1, 2)]
    third = element(name, 3)
    parts.append(view[third] / factor if third in view.solution else np.zeros_like(parts[0]))
    return np.column_stack(parts)


def point_name(name: str) -> str:
    """Return the name of a point, or of a row of a matrix."""
    return letters(f"{name[:-1]}]" if name.endswith(",") else name)
