"""The report at the end of a run: how it ended, what it cost, how accurate it is."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ..runtime.integrate.events import Events
from ..runtime.outcome import Outcome
from .numbers import count, duration, number, plural, with_unit
from .style import PLAIN, Style, pad, width

if TYPE_CHECKING:
    from ..runtime.interface import Quantity
    from ..runtime.results.accuracy import Accuracy, Drift
    from ..solution import Solution


MOST_STATES = 12
"""States in the table, beside those asked for; of more, those with the largest estimated error are shown."""
FAR_APART = 1e3
"""From this ratio of the sizes of states of one unit on, the sizes are shown that errors are measured against."""
NOTHING = sys.float_info.epsilon
"""A last value below this part of its nominal size, and below its own error, is told as 0; results keep it."""
ROUNDING = 1e-14
"""Of the energies of a run, over some hundred steps."""
MOST_OUTPUTS, MOST_DERIVATIVES = 12, 24
"""Of parts: the outputs of the model itself and what is asked for are never left out."""
DOUBT_WIDTH = 100


def report(solution: Solution, style: Style = PLAIN, of: Collection[str] = ()) -> str:
    """Return the whole report as text, without an end of line.

    ``of``: quantities that the tables must hold, and whose derivatives are listed, all without.
    """
    if solution.outcome is Outcome.FAILED and not solution.statistics.steps:
        return _headline(solution, style)  # it did not begin, and what is said of that is all there is to say
    blocks = [[_headline(solution, style), *_doubts(solution, style)], _cost(solution, style)]
    blocks.append(_values(solution, style, of))
    blocks.append(_sensitivities(solution, style, of))
    blocks.append(_condition(solution, style))
    if not _without_motion(solution):
        blocks.append(_energy(solution, style))
        blocks.append(_invariants(solution, style))
    blocks.append(_true_errors(solution, style))
    blocks.append(event_list(solution, style))
    return "\n\n".join("\n".join(block) for block in blocks if block)


def _headline(solution: Solution, style: Style) -> str:
    problem = solution.problem
    word = solution.outcome.value
    colour = {"completed": style.green, "terminated": style.green, "interrupted": style.yellow}.get(
        word, style.red
    )
    end = f" at {problem.time.name or 't'} = {number(float(solution.time[-1]))}{with_unit(problem.time.unit)}"
    text = f"{style.bold(title(solution))}: {colour(word)}{end if len(solution.time) else ''}"
    reason = solution.message.rpartition(" at ")[0]  # the time is there already
    return f"{text}: {reason}" if word == "terminated" and reason else text


def _doubts(solution: Solution, style: Style) -> list[str]:
    """What disagrees with the estimated errors, and what is likely to be the cause."""
    rows: list[tuple[str, str]] = []
    for doubt in solution.accuracy.contradictions:
        name = "energy.total" if doubt.kind == "energy" else doubt.name
        unit, factor = solution.shown_unit(name, doubt.unit)
        said = doubt.text(unit, factor, with_unit(solution.problem.time.unit))
        rows += [("doubtful", said), ("likely", doubt.causes)]
    return [
        f"  {style.red(pad(label if i == 0 else '', 10))} {line}"
        for label, text in dict.fromkeys(rows)
        for i, line in enumerate(wrap(text, DOUBT_WIDTH))
    ]


def title(solution: Solution) -> str:
    """Return the name of the model and of the experiment, if that has one."""
    return solution.problem.name + (f", {solution.experiment}" if solution.experiment else "")


def _cost(solution: Solution, style: Style) -> list[str]:
    made = solution.statistics
    rejected = f", {count(made.rejected)} rejected" if made.rejected else ""
    rows = [
        ("method", f"{made.method}, compiled C"),
        ("steps", f"{count(made.steps)}{rejected}, {count(made.evaluations)} evaluations"),
        ("run time", duration(made.run_time)),
    ]
    rows += [("note", remark) for remark in solution.remarks]
    return [f"  {style.dim(pad(label, 10))} {text}" for label, text in rows]


def _without_motion(solution: Solution) -> bool:
    """Whether nothing moves and nothing has an energy: a model of outputs alone, as of vector algebra."""
    found = solution.energy
    energies = () if found is None else (found.start, found.end, found.supplied, found.dissipated)
    return not _states(solution) and not any(energies)


def _states(solution: Solution) -> list[Quantity]:
    return [quantity for quantity in solution.problem.states if quantity.kind != "account"]


def _values(solution: Solution, style: Style, of: Collection[str]) -> list[str]:
    """The last value of each state with its estimated errors, then of each output and discrete variable."""
    if not len(solution.time):
        return []
    states = _states(solution)
    estimate = solution.accuracy.error if states else None
    listed = (*solution.problem.outputs, *solution.problem.discretes)
    outputs = [q for q in listed if q.kind in ("coordinate", "rate", "output", "discrete")]
    outputs += [q for n, q in solution.quantities.items() if n in of and q not in (*states, *outputs)]
    total = len(states)
    if estimate and total > MOST_STATES:
        states.sort(key=lambda q: -estimate.by_state[q.name])
    states = first_and_asked(states, MOST_STATES, lambda q: q.name in of)
    head = ["", f"at {number(float(solution.time[-1]))}{with_unit(solution.problem.time.unit)}", ""]
    head += ["estimated error", "largest"] if estimate else []
    apart = estimate is not None and _sizes_apart(states, estimate.nominal)
    head += ["nominal"] if apart else []
    table = [head]
    for quantity in states:
        row = _last(solution, quantity)
        if estimate:
            value, size = float(solution[quantity.name][-1]), estimate.nominal[quantity.name]
            if abs(value) < size * min(estimate.by_state_at_end[quantity.name], NOTHING):
                row[1] = number(0.0)  # a speed at rest that decays for ever
            row += [
                f"{estimate.by_state_at_end[quantity.name]:.1e}",
                f"{estimate.by_state[quantity.name]:.1e}",
            ]
            if apart:
                factor = solution.shown_unit(quantity.name)[1]
                row.append(f"{estimate.nominal[quantity.name] * factor:.2g}")
        table.append(row)
    empty = [""] * (len(head) - 3)
    shown = first_and_asked(outputs, MOST_OUTPUTS, lambda q: is_own(q.name) or q.name in of)
    rows = _aligned([*table, *([*_last(solution, quantity), *empty] for quantity in shown)], style)
    after = 1 + len(states)
    if len(shown) < len(outputs):
        rows.append(left_out(len(outputs) - len(shown), "quantities of parts", style))
    if len(states) < total:
        what = "states with smaller errors" if estimate else "states"
        rows.insert(after, left_out(total - len(states), what, style))
    if estimate:
        rows.append(
            style.dim(
                f"  errors relative to nominal + |value|, from a second run at {estimate.tolerance:.1g}"
            )
        )
    elif solution.accuracy.remark and states:
        rows.append(style.dim(f"  no error estimate: {solution.accuracy.remark}"))
    return rows


def _sizes_apart(states: Sequence[Quantity], nominal: Mapping[str, float]) -> bool:
    """Whether errors of states of one unit are measured against sizes that are far apart."""
    for unit in {q.unit for q in states}:
        sizes = [nominal[q.name] for q in states if q.unit == unit]
        if max(sizes) > FAR_APART * min(sizes):
            return True
    return False


def _condition(solution: Solution, style: Style) -> list[str]:
    """How small changes of the start grow, and until when figures are to be believed."""
    found = solution.motion.condition
    if found is None:
        return []
    unit = with_unit(solution.problem.time.unit)
    end = f"{number(float(found.time[-1]))}{unit}"
    head = style.bold("how errors grow")
    rows = [
        f"  {head}",
        f"  small changes of the start have grown {found.growth[-1]:.2g}-fold at {end}, {found.growth.max():.2g}-fold at most",
    ]
    if found.e_fold is not None:
        rows.append(f"  they grow e-fold in {found.e_fold:.3g}{unit}: the motion is chaotic or unstable")
    horizon, longest = found.horizon, found.longest
    if horizon is not None:
        rows.append(
            f"  figures after {horizon:.3g}{unit} are not those of the model: errors of the tolerance {found.tolerance:.1g} are as "
            "large as they"
        )
    if longest is not None:
        rows.append(f"  after {longest:.3g}{unit} no run in double precision tells more than averages")
    return rows


def _sensitivities(solution: Solution, style: Style, of: Collection[str]) -> list[str]:
    """The last derivatives of coordinates, states and outputs, with their estimated errors."""
    found = solution.motion.sensitivities
    if found is None:
        return []
    kinds = {n: q.kind for n, q in solution.quantities.items() if n in found.columns}
    names = [n for n, kind in kinds.items() if kind in ("coordinate", "rate", "state", "output")]
    listed = found.listed([n for n in names if n in of] if of else names)
    if not listed:
        return []
    end = f"at {number(float(solution.time[-1]))}{with_unit(solution.problem.time.unit)}"
    table = [["derivatives", end, "", *(["estimated error", "largest"] if found.errors is not None else [])]]
    shown = first_and_asked(
        listed, MOST_DERIVATIVES, lambda d: d.of in of or (is_own(d.of) and kinds[d.of] == "output")
    )
    for one in shown:
        row = [one.name, number(float(one.values[-1])), with_unit(one.unit).lstrip()]
        if one.errors is not None:
            row += [f"{one.errors[-1]:.1e}", f"{np.nanmax(one.errors):.1e}"]
        table.append(row)
    rows = _aligned(table, style)
    if len(shown) < len(listed):
        rows.append(left_out(len(listed) - len(shown), "derivatives", style))
    if found.remark:
        rows.append(style.dim(f"  no error estimate of the derivatives: {found.remark}"))
    return rows


def _last(solution: Solution, quantity: Quantity) -> list[str]:
    """Name, last value and unit."""
    unit, factor = solution.shown_unit(quantity.name)
    value = float(solution[quantity.name][-1]) * factor
    return [quantity.name, number(value), "" if unit == "1" else unit]


def _energy(solution: Solution, style: Style) -> list[str]:
    """Where energy came from and where it went, if there is more to say than that it is constant."""
    found = solution.energy
    if found is None:
        return []
    rows = [("at the start", found.start), ("supplied", found.supplied)]
    rows += [("  at events", found.supplied_at_events or None), ("dissipated", found.dissipated)]
    rows += [("  at events", found.dissipated_at_events or None), ("at the end", found.end)]
    unit, factor = solution.shown_unit("energy.total", found.unit)
    least = _rounding_of_energies(solution.accuracy)
    shown = [
        [label, number(value * factor if abs(value) > least else 0.0), unit]
        for label, value in rows
        if value is not None
    ]
    return _aligned([["energy", "", ""], *shown], style)


def _rounding_of_energies(accuracy: Accuracy) -> float:
    """What is told as no energy: less than the balance is off, and rounding beside the energies of the run."""
    drift = accuracy.energy
    if drift is None or not drift.relative:
        return 0.0
    return min(drift.absolute, ROUNDING * drift.absolute / drift.relative)


def _invariants(solution: Solution, style: Style) -> list[str]:
    accuracy = solution.accuracy
    drifts: list[tuple[str, str, Drift]] = []
    if accuracy.energy is not None:
        drifts.append(("energy balance", "energy.total", accuracy.energy))
    drifts += [(drift.name, drift.name, drift) for drift in accuracy.conserved]
    table = [["drift of conserved quantities", "absolute", "", "relative"]] if drifts else []
    for name, quantity, drift in drifts:
        relative = f"{drift.relative:.1e}" if drift.relative is not None else "-"
        unit, factor = solution.shown_unit(quantity, drift.unit)
        table.append([name, f"{drift.absolute * factor:.1e}", "" if unit == "1" else unit, relative])
    return [*_aligned(table, style), *_off_constraints(accuracy, style)]


def _off_constraints(accuracy: Accuracy, style: Style) -> list[str]:
    """What the steps of the method leave of the constraints, and what is left once they are projected."""
    if not accuracy.constraints:
        return []
    table = [["drift off the constraints", "of the steps", "", "projected"]]
    for drift in accuracy.constraints:
        before = "-" if drift.before is None else f"{drift.before:.1e}"
        table.append([drift.level, before, "", f"{drift.after:.1e}"])
    return _aligned(table, style)


def _true_errors(solution: Solution, style: Style) -> list[str]:
    if not solution.motion.as_stated and any(q.kind == "exact" for q in solution.problem.outputs):
        return [
            style.dim("  not compared with the closed solution, which the model states for its own values")
        ]
    table = [["error against the closed solution", "largest", "", "relative"]] if solution.true_errors else []
    for error in solution.true_errors:
        unit, factor = solution.shown_unit(error.name, error.unit)
        table.append([error.name, f"{error.largest * factor:.1e}", unit, f"{error.relative:.1e}"])
    return _aligned(table, style)


def _aligned(table: Sequence[Sequence[str]], style: Style) -> list[str]:
    """Lay out rows in columns: names and units (the first and third) to the left, numbers to the right.

    The first row is the head.
    """
    if not table:
        return []
    columns = range(len(table[0]))
    widths = [max(width(row[i]) for row in table) for i in columns]
    rows = []
    for i, row in enumerate(table):
        cells = [
            pad(row[c], widths[c]) if c in (0, 2) else " " * (widths[c] - width(row[c])) + row[c]
            for c in columns
        ]
        text = f"  {cells[0]}   {cells[1]} {'   '.join(cells[2:])}".rstrip()
        rows.append(style.dim(text) if i == 0 else text)
    return rows


MOST_EVENTS = 8


def event_list(solution: Solution, style: Style) -> list[str]:
    """Return the rows; none where nothing happened."""
    if not isinstance(solution.events, Events) or not solution.events:
        return []
    clocks, events = solution.events.condensed()
    unit = with_unit(solution.problem.time.unit)
    rows = [style.dim(f"  {plural(len(solution.events), 'event')}")]
    names = max((width(clock.name) for clock in clocks), default=0)
    rows += [
        f"  {pad(clock.name, names)}  {clock.count} times, from {number(clock.first)}{unit} to {number(clock.last)}{unit}"
        for clock in clocks
    ]
    shown = events[:MOST_EVENTS]
    names = max((width(event.name) for event in shown), default=0)
    rows += [f"  {e.time:>14.9g}{unit}  {pad(e.name, names)}  {style.dim(e.kind)}" for e in shown]
    if len(events) > MOST_EVENTS:
        met = Counter(f"{event.name} {event.kind}" for event in events)
        few = len(met) <= MOST_EVENTS
        often = [(kind, count) for kind, count in met.most_common(MOST_EVENTS) if few or count > 1]
        counts = ", ".join(f"{count} {kind}" for kind, count in often)
        said = f"; {'in all' if few else 'of all most often'}: {counts}" if often else ""
        rows.append(style.dim(f"  ... and {len(events) - MOST_EVENTS} more{said}"))
        last = events[-1]
        rows.append(
            f"  {last.time:>14.9g}{unit}  {pad(last.name, names)}  {style.dim(last.kind + ', the last')}"
        )
    return rows


T = TypeVar("T")


def is_own(name: str) -> bool:
    """Tell whether a quantity belongs to the model itself, not to one of its parts."""
    return "." not in name


def first_and_asked(items: Sequence[T], most: int, asked: Callable[[T], bool]) -> list[T]:
    """Return what is asked for, and as many of the first others as make up ``most`` together, in the order of ``items``."""
    room = most - sum(map(asked, items))
    found = []
    for item in items:
        if not asked(item):
            if room <= 0:
                continue
            room -= 1
        found.append(item)
    return found


def left_out(count: int, what: str, style: Style) -> str:
    """Return the row that says how many are left out, and how to see them."""
    return style.dim(f"  ... and {count} more {what}; 'mechc run --outputs NAME,...' shows those it names")
