"""Pictures of curves: coordinates over the independent variable, with equal scales where both are lengths."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display import Display, factor
from .letters import axis_label

if TYPE_CHECKING:
    from ..runtime.curves.found import CurveSolution

WIDTH, HEIGHT = 8.0, 3.6
STILL = 1e-5
"""Change, as a share of its size, up to which a quantity is named in a line instead of drawn."""


def save_curve(
    s: CurveSolution, path: Path, names: Sequence[str] = (), display: Display | None = None
) -> None:
    """Write the picture of a curve (png, pdf, svg)."""
    curve_figure(s, names, display).savefig(path)


def curve_figure(s: CurveSolution, names: Sequence[str] = (), display: Display | None = None) -> Any:
    """Draw the curve and what varies along it; return the Matplotlib figure."""
    import matplotlib

    from .axes import COLOURS, STYLE, Picture

    shown = display or Display()
    panels = _panels(s, names)
    still = (
        [] if names else [(over, up) for over, up in panels[1:] if up not in s.coordinates and _still(s, up)]
    )
    panels = [panel for panel in panels if panel not in still]
    with matplotlib.rc_context(STYLE):
        made = Picture(figsize=(WIDTH, HEIGHT * len(panels)), layout="constrained")
        for k, (across, up) in enumerate(panels, start=1):
            axes = made.add_subplot(len(panels), 1, k)
            _draw(axes, s, across, up, shown, COLOURS[(k - 1) % len(COLOURS)])
        if still:
            made.supxlabel(
                "constant: " + ", ".join(_said(s, name, shown) for _, name in still), fontsize="medium"
            )
    return made


def _panels(s: CurveSolution, names: Sequence[str]) -> list[tuple[str, str]]:
    """Return what is drawn over what: two coordinates of one vector over each other, else each over the range."""
    over = s.problem.time.name
    if names:
        pairs = [n.partition(":") for n in names]
        return [(a, b) if colon else (over, a) for a, colon, b in pairs]
    coordinates = s.coordinates
    panels = []
    if len(coordinates) >= 2 and s.unit(coordinates[0]) == s.unit(coordinates[1]):
        panels.append((coordinates[0], coordinates[1]))
        if len(coordinates) == 3:
            panels.append((coordinates[0], coordinates[2]))
    else:
        panels += [(over, n) for n in coordinates]
    panels += [(over, q.name) for q in s.problem.outputs if q.name in s]
    return panels


def _still(s: CurveSolution, name: str) -> bool:
    """Whether a quantity is the same everywhere on the curve, but for what errors make of it."""
    values = s[name][np.isfinite(s[name])]  # an end may be singular
    return bool(values.size and np.ptp(values) <= STILL * np.abs(values).max())


def _said(s: CurveSolution, name: str, display: Display) -> str:
    values, unit = _values(s, name, display)
    return f"{name} = {float(np.nanmedian(values)):.7g}{f' {unit}' if unit else ''}"


def _draw(axes: Any, s: CurveSolution, across: str, up: str, display: Display, colour: str) -> None:
    (x, x_unit), (y, y_unit) = _values(s, across, display), _values(s, up, display)
    axes.plot(x, y, color=colour)
    axes.plot([x[0], x[-1]], [y[0], y[-1]], "o", color=colour, markersize=4)
    axes.set_xlabel(axis_label(across, x_unit))
    axes.set_ylabel(axis_label(up, y_unit))
    is_curve = up in s.coordinates and s.unit(across) == s.unit(up)
    if is_curve:
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_title(f"{s.model}: stationary {s.stationary:.7g}, {s.kind}")


def _values(s: CurveSolution, name: str, display: Display) -> tuple[Any, str]:
    quantity = s.quantity(name) or (s.problem.time if name == s.problem.time.name else None)
    si = s.unit(name)
    unit = display.unit(si, quantity.display if quantity else "")
    values = s.places if name == s.problem.time.name else s[name]
    return values * (factor(si) / factor(unit)), unit if unit != "1" else ""
