"""What an FMU tells people: a page with equations and variables, a picture, an icon, reference results."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ..lang.diagnostics import Reporter
from ..presentation import panels, plots
from ..presentation.axes import COLOURS
from ..runtime.methods import SOLVING_CONTACTS
from ..runtime.outcome import Outcome

if TYPE_CHECKING:
    from mechc.runtime.interface import Quantity

    from ..model import CompiledModel
    from ..runtime.problem import Array
    from ..solution import Solution

ICON = "icon.png"
ICON_SIZE = 128
DOTS = 75
"""Dots per inch of the pictures: legible, and no more bytes than the rest of the file."""
ROWS = 201
"""Rows of the reference results, evenly spaced."""
LOOSE = 1e-6
"""Tolerance that other tools may be expected to use."""
TRUSTED = 1e-4
"""The reference results end where a run at the loose tolerance differs by this, over the sizes of the variables."""
ROUNDING = 0.1
"""An output that differs by this part of its size, where the states still agree, is nothing but errors."""
NEAR = 1e-3
"""Part of the run next to an event that the reference results leave out."""
EVEN = 1e-6
"""Of the time between two events: by how much others may be apart."""
LARGEST_SYSTEM = 200
"""Nodes of the equations beyond which they are not printed: SymPy takes seconds to tidy so many."""

STYLE = (
    "body{font-family:Georgia,serif;max-width:60em;margin:3em auto;padding:0 1em;color:#222}"
    "h1,h2{font-weight:normal}h2{color:#555;border-bottom:1px solid #ddd}img{max-width:100%}"
    "table{border-collapse:collapse}td,th{text-align:left;padding:.15em 1em .15em 0}"
)


def native_run(
    model: CompiledModel,
    experiment: str | None,
    stop: float,
    tolerance: float | None = None,
    step: float | None = None,
) -> tuple[CompiledModel, Solution]:
    """Run the experiment that is exported; return the model that ran, with compliant multipliers if it took those.

    Raises CompileError (E0906) if it fails, SimulationError.
    """
    from ..exporting import exported_run

    ran, solution = exported_run(model, experiment, stop, tolerance=tolerance, step=step)
    if solution.outcome is Outcome.FAILED:
        raise Reporter().fail(
            "E0906",
            f"the experiment to be exported fails: {solution.message}",
            None,
            help="an FMU contains the results of its default experiment; correct the model, or choose "
            "another with --experiment NAME",
        )
    return ran, solution


def documents(
    model: CompiledModel, experiment: str | None, solution: Solution, begin: float
) -> dict[str, bytes]:
    """Return the files by path in the FMU, and ``ICON``, whose place depends on the version. ``begin``: of the motion."""
    rows = reference(model, experiment, solution, begin)
    return {
        "documentation/index.html": page(model, solution).encode(),
        "documentation/diagram.png": _png(plots.figure(solution)),
        **({"documentation/reference.csv": rows.encode()} if rows else {}),
        ICON: _png(icon(solution)),
    }


def placed(files: Mapping[str, bytes], fmi: int) -> dict[str, bytes]:
    """Return the files with the icon where the version of FMI wants it."""
    place = "model.png" if fmi == 2 else "terminalsAndIcons/icon.png"
    return {place if name == ICON else name: data for name, data in files.items()}


def page(model: CompiledModel, solution: Solution) -> str:
    """Return a page with the picture, the equations of motion and the variables."""
    equations = model.compilation.equations
    values = dict(solution.parameters)
    parts = [
        "<!DOCTYPE html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{escape(model.name)}</title>',
        f"<style>{STYLE}</style></head><body>",
        f"<h1>{escape(model.name)}</h1>",
        f"<p>{escape(' '.join(model.doc.split()))}</p>" if model.doc else "",
        '<p><img src="diagram.png" alt="the motion of the default experiment"></p>',
        *_equations(model),
        *_table("Coordinates, velocities and other states", equations.states, {}),
        *_table("Inputs", equations.inputs, {}),
        *_table("Parameters", equations.parameters, values),
        *_table("Outputs", equations.outputs, {}),
        *_files(model),
        "<h2>Reference results</h2>",
        f'<p><a href="reference.csv">reference.csv</a> holds the default experiment: {_extent(solution)}. Names are '
        "those of the model description, numbers are in the units given there.</p>",
        "</body></html>",
    ]
    return "\n".join(part for part in parts if part) + "\n"


def _extent(solution: Solution) -> str:
    return (
        f"even times from {solution.time[0]:g} to {solution.time[-1]:g}, as far as a run at the tolerance {LOOSE:g} "
        f"stays within {TRUSTED:g} of it, without the rows next to events"
    )


def _equations(model: CompiledModel) -> list[str]:
    """Return the sections on the equations, or how to get them if they are long."""
    from ..compiler.symbolic.layouts import sections_html

    equations = model.compilation.equations
    rhs = next(f for f in equations.functions if f.name == "rhs")
    size = len(equations.graph.reach(rhs.outputs))
    if size > LARGEST_SYSTEM:
        return [
            "<h2>Equations of motion</h2>",
            f"<p>They have {size} terms and are not printed here; <code>mechc equations --format html</code> "
            "writes them.</p>",
        ]
    return [sections_html(model.compilation.system)]


def _files(model: CompiledModel) -> list[str]:
    """Name the files whose values the model holds; nothing where there are none."""
    files = model.compilation.flat.files
    if not files:
        return []
    rows = [f"<tr><td>{escape(f.name)}</td><td><code>{f.checksum}</code></td></tr>" for f in files]
    head = "<table><tr><th>name</th><th>SHA-256</th></tr>"
    words = "<p>Their values were read when the FMU was made; it does not need them.</p>"
    return ["<h2>Files</h2>", words, head, *rows, "</table>"]


def _table(title: str, entries: Sequence[Quantity], values: Mapping[str, float]) -> list[str]:
    """Return a table of quantities, with values where there are some; nothing if there are no entries."""
    if not entries:
        return []
    value = "<th>value</th>" if values else ""
    rows = [f"<h2>{title}</h2>", f"<table><tr><th>name</th>{value}<th>unit</th><th></th></tr>"]
    for e in entries:
        cell = f"<td>{values[e.name]:.10g}</td>" if e.name in values else "<td></td>" if values else ""
        doc = re.sub(r"`(.+?)`", r"<code>\1</code>", escape(" ".join(e.doc.split())))
        rows.append(f"<tr><td>{escape(e.name)}</td>{cell}<td>{escape(e.unit or '1')}</td><td>{doc}</td></tr>")
    return [*rows, "</table>"]


def reference(model: CompiledModel, experiment: str | None, solution: Solution, begin: float) -> str:
    """Return the reference results: states and outputs at even times, as long as they can be trusted; "" where none can be.

    The times are even from the ``begin`` of the motion, where an FMU begins, so that its steps meet them; those before the output are left out.
    """
    from ..compiler.targets.fmu.reference import write_reference

    stop = float(solution.time[-1])
    time = _even_times(begin, stop, solution)
    time = time[time >= solution.time[0]]
    entries = (*solution.problem.states, *solution.problem.outputs)
    found = solution(time)
    columns = {q.name: found[q.name] for q in entries}
    keep = _away_from_events(time, solution)
    if 2 * np.count_nonzero(keep) < len(time) and (between := _between_events(time, solution)) is not None:
        time, keep = between, np.ones(len(between), dtype=np.bool_)
        found = solution(time)
        columns = {q.name: found[q.name] for q in entries}
    if stop > solution.time[0]:
        loose = native_run(model, experiment, stop, tolerance=LOOSE)[1]
        keep &= time <= _horizon(solution, loose, time, columns)
        columns = {name: columns[name] for name in _trusted(solution, loose, time[keep], columns, keep)}
    if not keep.any():
        return ""
    return write_reference(time[keep], {name: values[keep] for name, values in columns.items()})


def _even_times(begin: float, stop: float, solution: Solution) -> Array:
    """Return even times; where steps solve for contacts these are ends of steps, as between them an impact is dated differently
    by who stops there."""
    if not stop > begin:
        return solution.time[:1]
    step = solution.statistics.longest_step
    if step is None or solution.statistics.method not in SOLVING_CONTACTS:
        return np.linspace(begin, stop, ROWS, dtype=np.float64)
    spacing = step * max(1, math.ceil((stop - begin) / (ROWS - 1) / step * (1 - 1e-9)))
    ends: Array = begin + spacing * np.arange(
        math.floor((stop - begin) / spacing * (1 + 1e-9)) + 1, dtype=np.float64
    )
    return ends


def _trusted(
    solution: Solution, loose: Solution, time: Array, columns: Mapping[str, Array], keep: Any
) -> list[str]:
    """Return the names of all states and of those outputs that are more than errors of the integration.

    An output that is zero but for those, as a momentum that nothing changes, differs from run to run by as much as
    its size, and cannot be compared.
    """
    states = {q.name for q in solution.problem.states}
    other = loose(time)
    return [
        name
        for name, values in columns.items()
        if name in states
        or np.all(np.abs(other[name] - values[keep]) <= ROUNDING * np.max(np.abs(values[keep]), initial=0.0))
    ]


def _away_from_events(time: Array, solution: Solution) -> Any:
    """Mark the times that no event is near to, where one tool has it before and another one after the row."""
    keep = np.ones(len(time), dtype=np.bool_)
    for event in solution.events:
        keep &= np.abs(time - event.time) > NEAR * (time[-1] - time[0])
    return keep


def _between_events(time: Array, solution: Solution) -> Array | None:
    """Return times in the middle between events, one for each of ``time``: of a controller that is sampled in even steps each
    time is near to an event. None where events are not even."""
    instants = np.unique([event.time for event in solution.events])
    gaps = np.diff(instants)
    if len(instants) < max(len(time), 2) or np.ptp(gaps) > EVEN * gaps[0]:
        return None
    places = np.clip(np.searchsorted(instants, time, side="right"), 1, len(gaps)) - 1
    middles: Array = np.unique(instants[places] + gaps[places] / 2)
    return middles


def _horizon(solution: Solution, loose: Solution, time: Array, columns: Mapping[str, Array]) -> float:
    """Return the time up to which a run at a loose tolerance follows."""
    from ..compiler.targets.fmu.reference import sizes

    early = time[time <= loose.time[-1]]
    values = loose(early)
    states = {q.name: columns[q.name] for q in solution.problem.states}
    far = np.zeros(len(early), dtype=np.bool_)
    units = {q.name: q.unit for q in solution.problem.states}
    for name, size in sizes(states, units, float(np.ptp(time))).items():
        far |= ~(np.abs(values[name] - states[name][: len(early)]) <= TRUSTED * size)
    return float(early[max(int(np.argmax(far)) - 1, 0)] if far.any() else early[-1])


def icon(solution: Solution) -> Any:
    """Draw the first panel of the picture small and without words."""
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(ICON_SIZE / DOTS, ICON_SIZE / DOTS))
    axes = drawn.add_axes((0.06, 0.06, 0.88, 0.88))
    axes.set_axis_off()
    for k, (x, y) in enumerate(_strokes(solution)):
        axes.plot(x, y, color=COLOURS[k % len(COLOURS)], linewidth=1.6)
    return drawn


def _strokes(solution: Solution) -> list[tuple[Array, Array]]:
    """Return the paths of points in the plane if there are some, else coordinates over time."""
    problem = solution.problem
    names = panels.point_names([q for q in problem.outputs if q.kind == "output"])
    paths = [(solution[f"{n}[1]"], solution[f"{n}[{size}]"]) for n, size in names.items()]
    moving = [(x, y) for x, y in paths if np.ptp(x) + np.ptp(y) > 0]
    if moving:
        return moving[:4]
    shown = [q.name for q in problem.states if q.kind in ("coordinate", "state")][:4]
    return [(solution.time, solution[name] / (np.max(np.abs(solution[name])) or 1.0)) for name in shown]


def _png(drawn: Any) -> bytes:
    """Return the bytes of a picture, without the version of the program that drew it."""
    memory = io.BytesIO()
    drawn.savefig(memory, format="png", dpi=DOTS, metadata={"Software": None})
    return memory.getvalue()
