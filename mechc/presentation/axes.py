"""What the panels of pictures have in common: colours, the look of axes, legends, and smooth curves of a solution."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ..requests.parse_values import UsageMistake, one_of
from .letters import axis_label, unit_label

if TYPE_CHECKING:
    from ..runtime.problem import Array
    from ..solution import Solution


COLOURS = ("#1f5fa8", "#d1495b", "#2a9d6f", "#e09f3e", "#7656a8", "#5b6770", "#17a2b8", "#a65628")
WIDTH = 8.0
"""Inches of a picture."""
SMOOTH = 2000
"""Points of a curve, where the solution can be computed between its output points."""
FLATTEST = 0.5
"""Least side of the box around a path in space, as a share of its largest."""
ZOOM = 1.1
"""How much larger a box in space is drawn than Matplotlib would."""
LEGEND_CHARACTERS = 46
"""Width of a legend that fits beside the title."""
ROW_CHARACTERS = 78
"""Width of a legend that has a row of its own."""
MOST_ROWS = 6
"""Of a legend: more would leave no room for the curves."""

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

PAPER: dict[Any, Any] = STYLE | {
    "font.size": 8,
    "font.family": "serif",
    "mathtext.fontset": "cm",
    "axes.titlesize": 8,
    "axes.titleweight": "normal",
    "axes.labelcolor": "black",
    "axes.edgecolor": "black",
    "axes.linewidth": 0.5,
    "axes.grid": False,
    "xtick.color": "black",
    "ytick.color": "black",
    "lines.linewidth": 0.9,
    "legend.fontsize": 7,
    "savefig.dpi": 300,
}
STYLES = {"": STYLE, "paper": PAPER}
SIZES = {"": 1.0, "paper": 0.45}
"""The looks of pictures by name, and how large they are: one of a paper is as wide as a column, 3.5 inches."""


def style_named(name: str) -> dict[Any, Any]:
    """Return the look of pictures by its name. Raises UsageMistake."""
    one_of(name, tuple(STYLES), "style")
    return STYLES[name]


def is_picture(path: Path) -> bool:
    """Whether a file has the ending of a picture that Matplotlib writes."""
    from matplotlib.backend_bases import FigureCanvasBase

    return path.suffix.lower().removeprefix(".") in FigureCanvasBase.get_supported_filetypes()


class DrawnDiagram(NamedTuple):
    """One of the diagrams of a picture: its height in inches, and what draws it into axes."""

    height: float
    draw: Callable[[Any], None]


def drawn(diagrams: Sequence[DrawnDiagram], ax: Any = None, style: str = "") -> Any:
    """Draw diagrams below one another and return the Matplotlib figure, or into the axes that are given, and return these."""
    import matplotlib

    if ax is not None:
        for axes, diagram in zip(given_axes(ax, len(diagrams)), diagrams, strict=True):
            draw_on(axes, diagram.draw, style)
        return ax
    with matplotlib.rc_context(style_named(style)):
        size = SIZES[style]
        heights = [size * diagram.height for diagram in diagrams]
        made = Picture(figsize=(size * WIDTH, sum(heights)), layout="constrained")
        places = made.add_gridspec(len(heights), 1, height_ratios=heights)
        for k, diagram in enumerate(diagrams):
            diagram.draw(made.add_subplot(places[k]))
    return made


def draw_on(axes: Any, draw: Callable[[Any], None], style: str) -> None:
    """Draw into axes of a caller, whose own title takes the place of ours."""
    import matplotlib

    with matplotlib.rc_context(style_named(style)):
        draw(axes)
    text = axes.get_title(loc="left")
    axes.set_title("", loc="left")
    axes.set_title(text)


def given_axes(ax: Any, count: int) -> list[Any]:
    """Return the axes that a caller gives, as many as there are diagrams. Raises UsageMistake."""
    axes = list(np.atleast_1d(ax).ravel())
    if len(axes) != count:
        raise UsageMistake(
            f"the picture has {count} diagram{'s' * (count != 1)}, and {len(axes)} axes are given",
            "give a list of axes, one for each diagram",
        )
    return axes


def figure_of(ax: Any) -> Any:
    """Return the figure of axes."""
    return np.atleast_1d(ax).ravel()[0].figure


class SolutionView:
    """A solution at times that are dense enough for smooth curves, in the units to show.

    The rows of the solution stay as they are, both sides of each event among them.
    """

    def __init__(self, solution: Solution) -> None:
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


def equal_box(axes: Any) -> None:
    """Give the axes in space one scale, and a box that is nowhere too flat for its numbers to be read."""
    limits = [axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d()]
    largest = max(high - low for low, high in limits)
    spans = [max(high - low, FLATTEST * largest) for low, high in limits]
    for axis, (low, high), span in zip("xyz", limits, spans, strict=True):
        middle = (low + high) / 2
        getattr(axes, f"set_{axis}lim3d")(middle - span / 2, middle + span / 2)
        axes.locator_params(axis=axis, nbins=max(2, round(6 * span / largest)))
    axes.set_box_aspect(spans, zoom=ZOOM)


PREFIXES = {9: "G", 6: "M", 3: "k", -3: "m", -6: "µ", -9: "n"}
PREFIXED = re.compile(r"(?:Hz|Pa|[NJWVAm])(?![\w^])")
"""Units that may have a prefix: the first factor of what is written, to its first power."""
LARGE, SMALL = 1e4, 1e-2
"""Numbers at an axis that are written with a prefix of their unit."""


def label_axis(axis: Any, name: str, unit: str, factor: float = 1.0) -> None:
    """Name an axis with its unit, with a prefix where numbers would be long; they are drawn times ``factor``. Call it last."""
    size = float(np.abs(axis.get_view_interval()).max()) * factor
    power = 0
    if PREFIXED.match(unit) and size > 0 and not SMALL <= size < LARGE:
        most = 3 if unit[0] == "m" else max(PREFIXES)  # no megametres
        power = min(max(3 * math.floor(math.log10(size) / 3), min(PREFIXES)), most)
    shown = f"{PREFIXES.get(power, '')}{unit}"
    axis.set_label_text(axis_label(name, shown) if name else unit_label(shown))
    if power or factor != 1.0:
        scale = factor / 10.0**power
        axis.set_major_formatter(
            lambda value, _: f"{round(value * scale, 12):g}".replace("-", "\N{MINUS SIGN}")
        )


DOT = 6
"""Least size of a dot in a legend: those of clouds are too small to tell their colours."""


def legend(axes: Any) -> None:
    """Put the legend beside the title where it fits, else between the title and the curves; of too many curves there is none."""
    labels = axes.get_legend_handles_labels()[1]
    beside = sum(len(label) + 4 for label in labels) <= LEGEND_CHARACTERS
    rows = math.ceil(len(labels) / max(1, ROW_CHARACTERS // (max(map(len, labels)) + 5)))
    if rows > MOST_ROWS:
        axes.set_title(f"{axes.get_title(loc='left')} ({len(labels)} curves)")
        return
    found = axes.legend(
        loc="lower right" if beside else "lower left",
        bbox_to_anchor=(1.01 if beside else -0.01, 1.0),
        ncols=len(labels) if beside else math.ceil(len(labels) / rows),
        borderpad=0.2,
        handlelength=1.2,
        handletextpad=0.5,
        columnspacing=1.0,
        labelspacing=0.3,
    )
    for line in found.get_lines():
        line.set_markersize(max(line.get_markersize(), DOT))
    if not beside:
        axes.set_title(axes.get_title(loc="left"), pad=6 + 12 * rows)


def title(text: str, left_out: int, shown: int) -> str:
    return f"{text} ({shown} of {shown + left_out})" if left_out else text


class Picture(Figure):
    """A figure that shows itself where it is the value of a cell."""

    def _repr_png_(self) -> bytes:
        """Return the picture as PNG: the name is IPython's."""
        file = BytesIO()
        self.savefig(file, format="png")
        return file.getvalue()
