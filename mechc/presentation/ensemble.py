"""An ensemble as people see it: its report, and its picture."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..runtime.ensembles.result import QUANTILES, Ensemble
from .axes import DrawnDiagram
from .numbers import number, unit_in_brackets
from .style import PLAIN, Style, pad, width

HEIGHT, SQUARE = 3.2, 6.4
MOST_FAMILY = 300
"""Curves that are drawn one by one; of more members the bands of quantiles are."""
FEWEST_CELLS = 4
"""Values of each of two dimensions from which a map is drawn."""


def report(runs: Ensemble, style: Style = PLAIN) -> str:
    """Return members, what was kept, and how accurate it is, without an end of line."""
    made = runs.counts()
    bad = made.get("failed", 0) + made.get("doubtful", 0) + made.get("not made", 0)
    said = ", ".join(f"{n} {word}" for word, n in made.items())
    head = f"{runs.model}, ensemble of {len(runs)} members: {said}"
    shape = " x ".join(f"{name} ({n})" for name, n in zip(runs.dimensions, runs.shape, strict=True))
    rows = [style.red(head) if bad else style.bold(head), "", f"  dimensions  {shape}"]
    rows.append(f"  method      {runs.method}, {runs.build}, {runs.threads} thread{'s' * (runs.threads > 1)}")
    if runs.steps.any():  # not counted where an interpreter carried changes across events
        rows.append(f"  steps       {int(runs.steps.sum())}")
    rows.append(f"  run time    {runs.seconds:.3g} s")
    if runs.scalars:
        rows += ["", *_table(runs)]
    if runs.series:
        rows.append(
            f"  over time: {', '.join(column.name for column in runs.series)}, {runs.times.size} times"
        )
    rows += ["", f"  {_errors(runs)}"]
    rows += [f"  {n} of: {text}" for text, n in runs.why().items()]
    rows += [f"  note: {remark}" for remark in runs.remarks]
    return "\n".join(rows)


def _table(runs: Ensemble) -> list[str]:
    """Return quantiles of each kept number and the median of its estimated errors."""
    cells = [["", "mean", *(f"{100 * q:g} %" for q in QUANTILES), "error"]]
    for column in runs.scalars:
        values = runs[column.name]
        finite = values[np.isfinite(values)]
        row = [column.name + unit_in_brackets(column.unit)]
        if not finite.size:
            cells.append([*row, "no member has it", *[""] * (len(QUANTILES) + 1)])
            continue
        row += [number(finite.mean()), *(number(v) for v in np.quantile(finite, QUANTILES))]
        errors = runs.error(column.name)
        errors = errors[np.isfinite(errors)]
        cells.append([*row, f"{np.median(errors):.1e}" if errors.size else "not estimated"])
    widths = [max(width(row[k]) for row in cells) for k in range(len(cells[0]))]
    return [
        (
            "  "
            + "  ".join(
                [pad(row[0], widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))]
            )
        ).rstrip()
        for row in cells
    ]


def _errors(runs: Ensemble) -> str:
    known = runs.errors[np.isfinite(runs.errors)]
    if not known.size:
        return "errors were not estimated"
    of = "all members" if known.size == len(runs) else f"{known.size} of {len(runs)} members"
    return (
        f"largest error of the states, relative to nominal + |value|, from second runs of {of}: "
        f"{np.median(known):.1e} in the middle, {known.max():.1e} at most"
    )


def diagrams(runs: Ensemble) -> list[DrawnDiagram]:
    """Return the diagrams of an ensemble.

    Series: curves side by side, or bands of quantiles of many. Numbers: a map over two dimensions, a line over one, else
    histograms, or points over the values that were drawn.
    """
    panels = [*runs.scalars, *runs.series]
    height = SQUARE if panels and _square(runs) and not runs.series else HEIGHT
    return [
        DrawnDiagram(
            height, partial(_over_time if column in runs.series else _number, runs=runs, name=column.name)
        )
        for column in panels
    ]


def _varied(runs: Ensemble) -> list[int]:
    """Return the dimensions of more than one value."""
    return [k for k, n in enumerate(runs.shape) if n > 1]


def _is_map(runs: Ensemble) -> bool:
    long = _varied(runs)
    return runs.members.cloud is None and len(long) == 2 and min(runs.shape[k] for k in long) >= FEWEST_CELLS


def _square(runs: Ensemble) -> bool:
    """Whether a map is over two quantities of one unit and of like ranges, whose lengths are the same then."""
    if not _is_map(runs):
        return False
    one, two = (runs.members.axes[k] for k in _varied(runs))
    wide, high = (float(np.ptp(axis.values)) for axis in (one, two))
    return one.unit == two.unit and 0.5 <= wide / high <= 2


def _label(runs: Ensemble, name: str) -> str:
    unit = runs.time.unit if name == "time" else runs.unit(name)
    return f"{name} [{unit}]" if unit not in ("", "1") else name


def _over_time(axes: Any, runs: Ensemble, name: str) -> None:
    from .axes import COLOURS

    rows = runs[name].reshape(len(runs), -1)
    rows = rows[np.isfinite(rows).any(axis=1)]
    if len(rows) <= MOST_FAMILY:
        shades = np.linspace(0.1, 0.9, max(len(rows), 2))
        import matplotlib

        colours = matplotlib.colormaps["viridis"](shades)
        for row, colour in zip(rows, colours, strict=False):
            axes.plot(runs.times, row, color=colour, linewidth=0.8)
    else:
        low, quarter, middle, third, high = np.nanquantile(rows, QUANTILES, axis=0)
        axes.fill_between(
            runs.times, low, high, color=COLOURS[0], alpha=0.2, linewidth=0, label="5 % to 95 %"
        )
        axes.fill_between(
            runs.times, quarter, third, color=COLOURS[0], alpha=0.35, linewidth=0, label="25 % to 75 %"
        )
        axes.plot(runs.times, middle, color=COLOURS[0], label="median")
        axes.legend()
    axes.set_xlabel(_label(runs, "time"))
    axes.set_ylabel(_label(runs, name))


def _number(axes: Any, runs: Ensemble, name: str) -> None:
    from .axes import COLOURS

    values, names = runs[name], runs.members.names
    long = _varied(runs)
    if _is_map(runs):
        x, y = (runs.members.axes[k] for k in reversed(long))
        grid = values.reshape([runs.shape[k] for k in long])
        shown = axes.pcolormesh(x.values, y.values, grid, cmap="viridis", shading="nearest", rasterized=True)
        axes.grid(visible=False)
        if _square(runs):
            axes.set_aspect("equal")
        axes.figure.colorbar(shown, ax=axes, label=_label(runs, name))
        axes.set_xlabel(_label(runs, x.name))
        axes.set_ylabel(_label(runs, y.name))
    elif runs.members.cloud is None and long:
        k = max(long, key=lambda one: runs.shape[one])
        lines = np.moveaxis(values, k, -1).reshape(-1, runs.shape[k])
        for row in lines:
            axes.plot(runs.members.axes[k].values, row, linewidth=1.0, marker="." if row.size < 60 else None)
        axes.set_xlabel(_label(runs, runs.members.axes[k].name))
        axes.set_ylabel(_label(runs, name))
    elif len(names) == 1:
        axes.plot(runs[names[0]].ravel(), values.ravel(), ".", markersize=1.5, color=COLOURS[0])
        axes.set_xlabel(_label(runs, names[0]))
        axes.set_ylabel(_label(runs, name))
    else:
        finite = values[np.isfinite(values)]
        axes.hist(finite, bins=max(10, min(100, round(finite.size**0.5))), color=COLOURS[0])
        axes.set_xlabel(_label(runs, name))
        axes.set_ylabel("members")
