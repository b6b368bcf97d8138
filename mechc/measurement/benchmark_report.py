"""What a benchmark looks like: the table, the diagram of error over run time, and a page on which points tell what they are."""

from __future__ import annotations

import html
import io
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

from ..presentation.numbers import duration
from ..runtime.methods import KERNEL_METHODS
from ..runtime.reference.high_precision import ladder_of
from .benchmark import conclusion
from .machine import described

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..runtime.reference.work_precision import WorkPrecisionPoint
    from .benchmark import Benchmark

MARKERS = "osD^v<>pPX*hH"
DRAWN_BELOW = 1.0
"""Points with larger errors are named, not drawn."""


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
        rows.append(_horizon_line(made))
    for method, points in made.by_method().items():
        claimed = "  claimed" if any(p.claimed is not None for p in points) else ""
        rows += ["", f"  {method:<16}  error   at end     run time  spread      steps  evaluations{claimed}"]
        for p in points:
            if p.error is None or p.error_at_end is None:
                rows.append(f"  {p.setting:>14.3g}  {p.failure}")
                continue
            rows.append(
                f"  {p.setting:>14.3g}  {p.error:.1e}  {p.error_at_end:.1e}  {duration(p.seconds):>11}"
                f"  {p.spread:>5.0%}  {p.steps or '-':>9}  {p.evaluations or '-':>11}"
                + (f"  {p.claimed:.1e}" if p.claimed is not None else "")
            )
    rows += ["", *(f"  {name}: {why}" for name, why in made.skipped)] if made.skipped else []
    rows += ["", *(f"  {name}: {mode}" for name, mode in made.peers.items())] if made.peers else []
    return "\n".join([*rows, "", conclusion(made)])


def _horizon_line(made: Benchmark) -> str:
    chaotic = "the motion is too chaotic for a reference"
    if made.softened:
        chaotic = "the motion through singular positions is known too little"
    tolerances = ladder_of(made.reference.precision, made.reference.method)
    if tolerances and made.reference.tolerance > tolerances[-1]:
        chaotic = "the reference had no time to be exact enough (--seconds)"
    why = "the model ends its run" if made.ended else chaotic
    return f"measured to t = {made.horizon:.6g} of {made.stop:.6g}: beyond, {why}"


def _reference_line(made: Benchmark) -> str:
    truth = made.reference
    if truth.method == "closed solution":
        return "reference: the closed solutions that the model states; other states are not measured"
    softened = (
        ", which is softened at singular positions: errors near that are its own" if made.softened else ""
    )
    effort = "from the cache" if truth.cached else f"{truth.seconds:.1f} s"
    return (
        f"reference: {truth.method} in {truth.precision} at {truth.tolerance:.0e}, "
        f"{made.digits} digits trusted, its two best runs differ by {truth.doubt.max():.0e}{softened} ({effort})"
    )


def draw(made: Benchmark, path: Path) -> None:
    """Draw the diagram: error over run time, both logarithmic, one line for each method; beside it what runs claim over what their
    errors are; below it what is not drawn, and why."""
    from matplotlib import rc_context

    figure, _ = _figure(made)
    with rc_context({"svg.hashsalt": made.model}):  # the same picture is the same file
        figure.savefig(path, dpi=150, metadata={"Date": None} if path.suffix == ".svg" else None)


def write_page(made: Benchmark, path: Path) -> None:
    """Write a page with the diagram, on which points tell what they are, and the table."""
    from matplotlib import rc_context

    figure, told = _figure(made)
    text = io.StringIO()
    with rc_context({"svg.hashsalt": made.model, "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    drawn = text.getvalue()[text.getvalue().index("<svg") :]
    for name, words in told.items():
        drawn = drawn.replace(
            f'<g id="{name}">', f'<g id="{name}" class="point"><title>{html.escape(words)}</title>'
        )
    path.write_text(
        PAGE.format(
            title=html.escape(f"{made.model}: error against run time"),
            drawn=drawn,
            table=html.escape(report(made)),
        ),
        encoding="utf-8",
        newline="\n",
    )


PAGE = """<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<title>{title}</title>
<style>
body {{ font: 15px system-ui, sans-serif; max-width: 75em; margin: 2em auto; padding: 0 1em; }}
svg {{ width: 100%; height: auto; }}
.point:hover {{ stroke: black; stroke-width: 2; }}
pre {{ font-size: 12px; white-space: pre-wrap; }}
</style>
<h1>{title}</h1>
{drawn}
<pre>{table}</pre>
</html>
"""


def _figure(made: Benchmark) -> tuple[Figure, dict[str, str]]:
    """Return the diagram, and what its points say by the names of their groups."""
    from matplotlib.figure import Figure

    notes = _notes(made)
    lines = [row for note in notes for row in textwrap.wrap(note, 165)]
    below = 0.16 * (len(lines) + 1)
    height = 6.2 + below
    figure = Figure(figsize=(11, height))
    left, right, top = 0.07, 0.66, 1 - 0.5 / height
    bottom = (below + 0.6) / height
    axes = figure.add_axes((left, bottom, right - left, top - bottom))
    told = _curves(made, axes, labels=True)
    axes.set_xlabel("processor time of a run, s (shaded: the middle half of repeated runs)")
    axes.set_ylabel("largest error, of nominal + |value|")
    axes.set_title(
        f"{made.model}{', ' + made.experiment if made.experiment else ''}, to t = {made.horizon:g}"
    )
    handles, names = axes.get_legend_handles_labels()
    if handles:
        columns = 1 if len(handles) <= 14 else 2
        figure.legend(
            handles,
            names,
            loc="upper left",
            bbox_to_anchor=(right + 0.005, top + 0.01),
            fontsize=8,
            ncols=columns,
            frameon=False,
        )
    claims = figure.add_axes((right + 0.075, bottom, 0.985 - right - 0.075, 0.36 * (top - bottom)))
    told |= _claims(made, claims)
    for k, row in enumerate(lines):
        figure.text(0.02, (below - 0.16 * (k + 1)) / height, row, fontsize=7.5, va="bottom")
    return figure, told


def _notes(made: Benchmark) -> list[str]:
    """Say what the diagram rests on, what is not in it, and what it comes to."""
    notes = [conclusion(made), _reference_line(made)]
    if made.horizon < made.stop:
        notes.append(_horizon_line(made))
    notes.append(described())
    notes += [f"{name}: {mode}" for name, mode in made.peers.items()]
    reasons: dict[str, dict[str, list[str]]] = {}
    for method, points in made.by_method().items():
        for p in points:
            if p.error is None or p.error >= DRAWN_BELOW:
                why = p.failure.partition(" at t = ")[0].rstrip(",") if p.error is None else "errors above 1"
                reasons.setdefault(why, {}).setdefault(method, []).append(f"{p.setting:.2g}")
    for why, where in reasons.items():
        methods = ", ".join(f"{method} ({', '.join(settings)})" for method, settings in where.items())
        notes.append(f"not drawn: {methods}: {why}")
    skipped: dict[str, list[str]] = {}
    for name, why in made.skipped:
        skipped.setdefault(why.removeprefix(f"'{name}' cannot run this model: "), []).append(name)
    return [*notes, *(f"not measured: {', '.join(names)}: {why}" for why, names in skipped.items())]


def _claims(made: Benchmark, axes: Axes) -> dict[str, str]:
    """Draw what runs claim over what their errors are."""
    told = {}
    values = []
    for k, points in enumerate(made.by_method().values()):
        for i, p in enumerate(points):
            if not p.claimed or not p.claimed_of or p.claimed_of >= DRAWN_BELOW:
                continue
            name = f"claim-{k}-{i}"
            axes.loglog(
                p.claimed_of,
                p.claimed,
                color=_color(k),
                marker=MARKERS[k % len(MARKERS)],
                ls="",
                ms=3,
                gid=name,
            )
            told[name] = f"{_point_text(p)}; it claims {p.claimed:.1e}"
            values += [p.claimed, p.claimed_of]
    axes.tick_params(labelsize=7)
    if values:
        ends = (min(values) / 3, max(values) * 3)
        axes.loglog(ends, ends, "k-", lw=0.8, alpha=0.5)
        axes.set_xlim(ends)
        axes.set_ylim(ends)
    else:
        axes.text(
            0.5,
            0.5,
            "no run estimates its error",
            ha="center",
            va="center",
            transform=axes.transAxes,
            fontsize=8,
        )
    axes.set_xlabel("true error", fontsize=8)
    axes.set_ylabel("estimated error", fontsize=8)
    axes.grid(alpha=0.3)
    return told


def _color(k: int) -> tuple[float, ...]:
    """Return the color of a method: ten strong ones, then ten light ones."""
    from matplotlib import colormaps

    color: tuple[float, ...] = colormaps["tab20"](2 * (k % 10) + (k // 10) % 2)
    return color


def _setting(p: WorkPrecisionPoint) -> str:
    return f"step {p.setting:.3g}" if p.fixed else f"tolerance {p.setting:.0e}"


def _point_text(p: WorkPrecisionPoint) -> str:
    return f"{p.method}, {_setting(p)}: error {p.error:.1e}, {duration(p.seconds)}{f', {p.steps} steps' if p.steps else ''}"


def draw_small(made: Benchmark, path: Path) -> None:
    """Draw the diagram for a table of many: no title, few pixels."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.6, 2.4), layout="constrained")
    axes = figure.add_subplot()
    _curves(made, axes, labels=False)
    axes.tick_params(labelsize=7)
    axes.legend(fontsize=7, handlelength=1.2, borderpad=0.3, labelspacing=0.3)
    figure.savefig(path, dpi=80, pil_kwargs={"optimize": True})


def _curves(made: Benchmark, axes: Axes, *, labels: bool) -> dict[str, str]:
    """Draw error over run time; with ``labels`` the settings stand at the points and the spread of times is shaded. Return what points
    say, by the names of their groups."""
    told = {}
    for k, (method, points) in enumerate(made.by_method().items()):
        good = [p for p in points if p.error is not None and 0 < p.error < DRAWN_BELOW]
        if not good:
            continue
        color, marker = _color(k), MARKERS[k % len(MARKERS)]
        style = "-" if method in KERNEL_METHODS else "--"
        seconds, errors = [p.seconds for p in good], [float(p.error or 0) for p in good]
        axes.loglog(seconds, errors, color=color, marker=marker, ms=4, lw=1.2, ls=style, label=method)
        if not labels:
            continue
        low, high = zip(*(p.quartiles or (p.seconds, p.seconds) for p in good), strict=True)
        axes.fill_betweenx(errors, low, high, color=color, alpha=0.15, lw=0)
        for i, (p, error) in enumerate(zip(good, errors, strict=True)):
            name = f"point-{k}-{i}"
            axes.plot(p.seconds, error, color=color, marker=marker, ms=4, ls="", gid=name)
            told[name] = _point_text(p)
            words = f"{p.setting:.1g}" if p.fixed else f"{p.setting:.0e}".replace("e-0", "e-")
            if i % 2 == 0:
                axes.annotate(
                    words,
                    (p.seconds, error),
                    (2, 2),
                    textcoords="offset points",
                    fontsize=5,
                    color=color,
                )
    axes.grid(alpha=0.3)
    return told
