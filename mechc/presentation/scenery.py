"""The panel of what is drawn: the scene at the start and the end over the paths of points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .axes import COLOURS, SolutionView, equal_box, legend, title
from .letters import axis_label, letters
from .painting import Painter
from .panels import Scenery, element

if TYPE_CHECKING:
    from ..runtime.problem import Array

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
    axes.set_title(title(text, panel.left_out, len(panel.names)))
    axes.set_title("", loc="right")
    for axis in "xy" if painter.flat else "xyz":
        getattr(axes, f"set_{axis}label")(axis_label(axis, unit))
        if factor != 1.0:
            getattr(axes, f"{axis}axis").set_major_formatter(lambda value, _: f"{value * factor:g}")
    if painter.flat:
        axes.update_datalim([painter.low[:2], painter.high[:2]])
        axes.autoscale(enable=True)
        axes.set_aspect("equal", adjustable="datalim")
    else:
        equal_box(axes)
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
