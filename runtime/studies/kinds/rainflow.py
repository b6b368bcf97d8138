"""Cycles of a load by rainflow counting, from which fatigue is assessed.

ASTM E1049-85 (2017), 5.4.4, over the exact extrema of the motion; full cycles count 1, those that the record does not close 1/2.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import Annotated, Any

import numpy as np
from msgspec import Struct

from ...outcome import ENDED, Outcome, SimulationError
from ...problem import Array, Problem
from ...settings import settable
from ..findings import Curve, Findings, Panel, Table, Value
from ..flow.crossings import turns
from ..flow.record import Recorded, RecordStudy, recorded, unfinished

CLASSES = 10
FAINT = 1e-3
"""Of the largest range: what is less counts as no cycle."""
ERRORS = "the same count of a run at a looser tolerance"


class Cycle(Struct, frozen=True):
    """One cycle: its ``range``, ``mean``, and ``count``, 1 or 1/2; the places ``begin`` and ``end`` of its turns in the series."""

    range: float
    mean: float
    count: float
    begin: int
    end: int


class Rainflow(RecordStudy, frozen=True, kw_only=True):
    """The cycles of the quantity ``of`` over a run, without what is still ``settling``."""

    classes: Annotated[
        int, settable(f"Number of range classes in the table (default: {CLASSES}).", "count")
    ] = CLASSES
    least: Annotated[
        float,
        settable(
            f"Cycles below this share of the largest range are not counted (default: {FAINT:g}).", "number"
        ),
    ] = FAINT

    def solve(self, problem: Problem) -> Findings:
        """Run the model at two tolerances and count the cycles of the tighter motion. Raises SimulationError."""
        if not 0 <= self.least < 1:
            raise SimulationError(f"'least' is a share from 0 to 1, not {self.least:g}")
        record = recorded(problem, self)
        if record.solution.outcome not in ENDED:
            return unfinished("rainflow", problem, record.solution, ERRORS)
        return _findings(problem, self, record)


def turning_points(x: Array) -> list[int]:
    """Return the places of a series at which it turns, and both ends; of equal values in a row the first."""
    moves = np.flatnonzero(np.diff(x) != 0)
    if not moves.size:
        return []
    signs = np.sign(np.diff(x)[moves])
    turns = moves[1:][signs[1:] != signs[:-1]]
    # where it rests on a level before it turns, that begins after the move before
    before = moves[:-1][signs[1:] != signs[:-1]] + 1
    inner = np.minimum(turns, before)
    return [0, *inner.tolist(), int(moves[-1]) + 1]


def cycles(x: Array) -> list[Cycle]:
    """Count the cycles of a series by the rules of ASTM E1049, 5.4.4."""
    found: list[Cycle] = []
    kept: list[int] = []

    def counted(a: int, b: int, count: float) -> None:
        found.append(Cycle(abs(float(x[b] - x[a])), float(x[a] + x[b]) / 2, count, a, b))

    for place in turning_points(x):
        kept.append(place)
        while len(kept) >= 3:
            last, before = abs(x[kept[-1]] - x[kept[-2]]), abs(x[kept[-2]] - x[kept[-3]])
            if last < before:
                break
            if len(kept) == 3:  # the range before holds the start
                counted(kept[0], kept[1], 0.5)
                del kept[0]
            else:
                counted(kept[-3], kept[-2], 1.0)
                del kept[-3:-1]
    for a, b in itertools.pairwise(kept):
        counted(a, b, 0.5)
    return found


def _counted(x: Array, least: float) -> tuple[list[Cycle], int]:
    """Return the cycles that count, by their ranges, and the number of those that are too small."""
    every = cycles(x)
    largest = max((one.range for one in every), default=0.0)
    found = [one for one in every if one.range >= least * largest]
    return sorted(found, key=lambda one: -one.range), len(every) - len(found)


def _total(found: Iterable[Cycle]) -> float:
    return sum(one.count for one in found)


def _findings(problem: Problem, study: Rainflow, record: Recorded) -> Findings:
    seen, begin, solution, rough = record.of, record.begin, record.solution, record.rough
    unit, time = solution.unit(seen.name), problem.time
    t, x = turns(solution, seen.name, begin)
    found, faint = _counted(x, study.least)
    other, _ = _counted(turns(rough, seen.name, begin)[1], study.least)
    largest = found[0].range if found else 0.0
    values = (
        Value("cycles", "", _total(found), abs(_total(found) - _total(other))),
        Value("largest range", unit, largest, abs(largest - (other[0].range if other else 0.0))),
    )
    edges = np.linspace(0, largest, study.classes + 1)
    rows = []
    for low, high in itertools.pairwise(edges.tolist()):
        inside = [one for one in found if low < one.range <= high or (high == largest and one.range > high)]
        if inside:
            count = _total(inside)
            rows.append((low, high, count, sum(one.mean * one.count for one in inside) / count))
    head = (("range from", unit), ("to", unit), ("cycles", ""), ("mean", unit))
    remarks = [f"{faint} below {study.least:g} of the largest range are not counted"] if faint else []
    # how many cycles reach a range at least
    over = np.cumsum([one.count for one in found])
    ranges = np.array([one.range for one in found])
    arrays = {
        "range": ranges,
        "mean": np.array([one.mean for one in found]),
        "count": np.array([one.count for one in found]),
        "begin": np.array([t[one.begin] for one in found]),
        "end": np.array([t[one.end] for one in found]),
    }
    details: dict[str, Any] = {
        "of": seen.text,
        "cycles": [
            {"range": one.range, "mean": one.mean, "count": one.count, "begin": float(t[one.begin]), "end": float(t[one.end])}
            for one in found
        ],
        "faint": faint,
    }  # fmt: skip
    curve = Curve(seen.text, np.repeat(over, 2)[:-1], np.repeat(ranges, 2)[1:]) if found else None
    told = rough if rough.outcome is Outcome.DOUBTFUL else solution
    return Findings(
        study="rainflow",
        model=problem.name,
        outcome=told.outcome,
        message=f"{_total(found):g} cycles of {seen.text} over {t[-1] - t[0]:.6g} {time.unit}".rstrip(),
        values=values,
        errors_from=ERRORS,
        remarks=(*remarks, *solution.remarks),
        tables=(Table("", head, tuple(rows)),) if rows else (),
        panels=(Panel("ranges", "cycles that reach it", "", "range", unit, (curve,), logarithmic="x"),)
        if curve
        else (),
        details=details,
        arrays=arrays,
        runs=(solution, rough),
    )
