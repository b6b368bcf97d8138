"""Answers to studies as people see them: text and picture of each type of answer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..requests.parse_values import UsageMistake
from ..requests.question import names_in
from ..runtime.ensembles.result import Ensemble
from ..runtime.outcome import Outcome, SimulationError
from ..runtime.studies.findings import Cell, Curve, Findings, Landscape, Panel, Table, Value
from ..runtime.studies.kinds.sweep import Runs
from ..solution import Solution
from .axes import COLOURS, DrawnDiagram, drawn, figure_of, is_picture, legend
from .numbers import number, unit_in_brackets, with_unit
from .style import PLAIN, Style, pad, width

if TYPE_CHECKING:
    from ..runtime.studies.study import Answer

HEIGHT, TALL = 2.8, 6.0
"""Inches of a panel, and of a tall one."""
MOST_DIAGRAMS, MOST_LABELS = 8, 12
"""Of a sweep: quantities that are drawn, and runs whose values the legend names."""


def text(answer: Answer, style: Style = PLAIN) -> str:
    """Return an answer as text, without an end of line."""
    match answer:
        case Solution():
            from .report import report

            return report(answer, style)
        case Runs():
            from .report import report
            from .sweep_report import sweep_report

            return sweep_report(answer, style) if answer.points[0] else report(answer.solutions[0], style)
        case Ensemble():
            from . import ensemble

            return ensemble.report(answer, style)
        case Findings():
            return _findings(answer, style)
    raise AssertionError(f"no text for {type(answer).__name__}")


def _findings(found: Findings, style: Style) -> str:
    good = found.outcome in (Outcome.COMPLETED, Outcome.TERMINATED)
    head = f"{style.bold(found.model)}, {found.study}: {found.message}"
    rows = [head if good else style.red(head), ""]
    table = [["", "value", "error"], *(_row(value) for value in found.values)]
    widths = [max(width(row[i]) for row in table) for i in range(3)]
    if found.values:
        rows += [
            "  " + "  ".join((pad(row[0], widths[0]), row[1].ljust(widths[1]), row[2])).rstrip()
            for row in table
        ]
    for one in found.tables:
        rows += ["", *_table(one)] if rows[-1] else _table(one)
    if found.values or found.tables:
        rows += [f"  errors: {found.errors_from}"]
    rows += [f"  note: {remark}" for remark in found.remarks]
    return "\n".join(rows).rstrip()


def _row(value: Value) -> list[str]:
    error = "cannot be told" if value.error is None else f"{value.error:.1e}"
    return [value.name, number(value.value) + with_unit(value.unit), error]


def _table(table: Table) -> list[str]:
    """Return the lines of a table: numbers stand right, words left."""
    cells = [[name + unit_in_brackets(unit) for name, unit in table.head]]
    error = [name == "error" for name, _ in table.head]
    cells += [
        [
            f"{cell:.1e}" if is_error and isinstance(cell, float) else _cell(cell)
            for cell, is_error in zip(row, error, strict=True)
        ]
        for row in table.rows
    ]
    columns = range(len(table.head))
    widths = [max(width(row[i]) for row in cells) for i in columns]
    words = [all(isinstance(row[i], str) for row in table.rows) for i in columns]
    lines = [table.title] if table.title else []
    for row in cells:
        texts = (
            pad(row[i], widths[i]) if words[i] else " " * (widths[i] - width(row[i])) + row[i]
            for i in columns
        )
        lines.append(("  " + "  ".join(texts)).rstrip())
    return lines


def _cell(cell: Cell) -> str:
    match cell:
        case None:
            return "cannot be told"
        case str():
            return cell
        case complex():
            sign = "-" if math.copysign(1.0, cell.imag) < 0 else "+"
            return (
                number(cell.real)
                if cell.imag == 0
                else f"{number(cell.real)} {sign} {number(abs(cell.imag))}i"
            )
    return number(cell)


def plotted(
    answer: Answer,
    path: str | Path | None = None,
    ax: Any = None,
    style: str = "",
    names: Sequence[str] = (),
) -> Any:
    """Draw an answer; return the Matplotlib figure, or the axes that were given. ``path`` writes the picture (png, pdf, svg); a text
    without such an ending names quantities of a motion, as ``names`` does."""
    if path is not None and not is_picture(Path(path)):
        if isinstance(path, Path) or not isinstance(answer, Solution):
            raise UsageMistake(f"'{path}' has no ending of a picture", "pictures end in .png, .pdf or .svg")
        names, path = [*names_in(path), *names], None
    if isinstance(answer, Solution):
        from . import plots

        made = plots.figure(answer, names, style) if ax is None else plots.draw_into(ax, answer, names, style)
    else:
        made = drawn(diagrams(answer), ax, style)
    if path is not None:
        (made if ax is None else figure_of(ax)).savefig(path)
    return made


def diagrams(answer: Answer) -> list[DrawnDiagram]:
    """Return the diagrams of an answer. Raises SimulationError where there is nothing to draw."""
    match answer:
        case Ensemble():
            from . import ensemble

            return ensemble.diagrams(answer)
        case Runs():
            panels = _side_by_side(answer)
        case Findings():
            panels = answer.panels
            if not panels:
                raise SimulationError(
                    f"this answer of '{answer.study}' is numbers and formulas: there is nothing to draw",
                    help="leave --plot away",
                )
        case _:
            raise AssertionError(f"no picture for {type(answer).__name__}")
    return [
        DrawnDiagram(
            TALL if panel.tall or panel.equal else HEIGHT, partial(_draw, panel=panel, colours=COLOURS)
        )
        for panel in panels
    ]


def save(answer: Answer, path: Path) -> None:
    """Write the picture of an answer (png, pdf, svg)."""
    if isinstance(answer, Solution):
        from . import plots

        plots.save(answer, path)
    else:
        plotted(answer, path)


def _side_by_side(runs: Runs[Any]) -> tuple[Panel, ...]:
    """Return a diagram of each coordinate, or state where there are none, with a curve for each run of a sweep."""
    first = runs.solutions[0]
    quantities = [q for q in first.problem.states if q.kind == "coordinate"]
    quantities = quantities or [q for q in first.problem.states if q.kind == "state"]
    labels = [
        ", ".join(f"{name} = {_value(value)}" for name, value in point.items()) for point in runs.points
    ]
    found = []
    for quantity in quantities[:MOST_DIAGRAMS]:
        unit, factor = (
            first.shown_unit(quantity.name) if isinstance(first, Solution) else (quantity.unit, 1.0)
        )
        curves = tuple(
            Curve(label if len(labels) <= MOST_LABELS else "", run.time, run[quantity.name] * factor)
            for label, run in zip(labels, runs.solutions, strict=True)
        )
        time = first.problem.time
        found.append(Panel(quantity.name, time.name or "time", time.unit, quantity.name, unit, curves))
    return tuple(found)


def _value(value: float | bool | str) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def figure(found: Findings) -> Any:
    """Draw the panels of an answer below one another; return the Matplotlib figure."""
    return drawn(diagrams(found) if found.panels else [])


def _draw(axes: Any, panel: Panel, colours: tuple[str, ...]) -> None:
    styles: dict[str, dict[str, Any]] = {
        "line": {},
        "dashed": {"linestyle": "--"},
        "dotted": {"linestyle": ":"},
        "points": {"linestyle": "", "marker": "o", "markersize": 4},
        "spots": {"linestyle": "", "marker": ".", "markersize": 3, "markeredgewidth": 0},
        "dots": {"linestyle": "", "marker": ".", "markersize": 1.2, "markeredgewidth": 0, "rasterized": True},
    }
    if panel.landscape is not None:
        _landscape(axes, panel.landscape, colours)
    for k, curve in enumerate(panel.curves):
        colour = colours[(k if curve.colour is None else curve.colour) % len(colours)]
        if curve.style == "cells":
            _cells(axes, curve, panel, colour)
        else:
            axes.plot(curve.x, curve.y, color=colour, label=curve.name or None, **styles[curve.style])
    if panel.x_names:
        _named(axes, panel.x_names)
    for axis in panel.logarithmic:
        axes.set(**{f"{axis}scale": "log"})
        _plain(getattr(axes, f"{axis}axis"))
    axes.set_title(panel.title)
    if panel.x_label:
        axes.set_xlabel(_label(panel.x_label, panel.x_unit))
    axes.set_ylabel(_label(panel.y_label, panel.y_unit))
    if panel.equal:
        axes.set_aspect("equal")
    if sum(bool(curve.name) for curve in panel.curves) > 1:
        legend(axes)


FEW_DECADES = 1000


def _plain(axis: Any) -> None:
    """Write the numbers of a logarithmic axis as they are, where it has few decades: between powers of ten these are hard to read."""
    from matplotlib.ticker import LogFormatter

    low, high = axis.get_view_interval()
    if high < FEW_DECADES * low:
        axis.set_major_formatter("{x:g}")
        chosen = LogFormatter(minor_thresholds=(1.5, 0.6))
        chosen.set_axis(axis)
        chosen.set_locs(axis.get_minorticklocs())
        axis.set_minor_formatter(lambda x, _: f"{x:g}" if chosen(x) else "")


MOST_NAMES, NAME_CHARACTERS = 24, 90


def _named(axes: Any, names: tuple[str, ...]) -> None:
    """Write names below 1, 2, ...: as many as there is room for."""
    shown, room = len(names), min(MOST_NAMES, NAME_CHARACTERS // max(map(len, names)))
    every = -(-shown // max(room, 1))
    places = list(range(1, shown + 1, every))
    axes.set_xticks(places, [names[k - 1] for k in places])
    axes.set_xlim(0.75 if shown < 4 else 0.5, shown + (0.25 if shown < 4 else 0.5))


def _cells(axes: Any, curve: Curve, panel: Panel, colour: str) -> None:
    """Fill the cells of a grid round some of its places."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Rectangle

    sides = []
    for of in ("x", "y"):
        places = np.unique(np.concatenate([getattr(c, of) for c in panel.curves if c.style == "cells"]))
        sides.append(float(np.diff(places).min()) if len(places) > 1 else 1.0)
    width, height = sides
    boxes = [
        Rectangle((x - width / 2, y - height / 2), width, height)
        for x, y in zip(curve.x, curve.y, strict=True)
    ]
    axes.add_collection(PatchCollection(boxes, facecolor=colour, edgecolor="none", alpha=0.75, linewidth=0))
    axes.plot([], [], "s", color=colour, alpha=0.75, label=curve.name)
    axes.autoscale_view()
    axes.grid(False)


def _landscape(axes: Any, land: Landscape, colours: tuple[str, ...]) -> None:
    """Draw lines of equal value, and fill what is below the level."""
    grid = (land.x, land.y, np.ma.masked_invalid(land.values))
    lowest = float(grid[2].min())
    if lowest < land.level:
        axes.contourf(*grid, levels=[lowest, land.level], colors=[colours[0]], alpha=0.18)
    if land.others:
        lines = axes.contour(*grid, levels=land.others, colors="0.55", linewidths=0.8, linestyles="solid")
        axes.clabel(lines, fontsize=7, fmt="%.3g")
    border = axes.contour(*grid, levels=[land.level], colors=[colours[0]], linewidths=2, linestyles="solid")
    axes.clabel(border, fontsize=8, fmt=f"{land.level:.4g} {land.unit}".rstrip())


def _label(name: str, unit: str) -> str:
    return name + unit_in_brackets(unit)
