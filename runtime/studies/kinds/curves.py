"""The stationary curves of a model over a parameter: branches with the places where they turn back or change their kind."""

from __future__ import annotations

import itertools
from typing import Annotated, Any, ClassVar

import numpy as np
from msgspec import Struct

from ...case import find_experiment
from ...curves.branches import CurveBifurcation, CurveBranch, CurveTracer, on_branch
from ...curves.deflation import further
from ...curves.posed import Posed, pose
from ...curves.search import Failed, FoundCurve, search
from ...outcome import Outcome, SimulationError
from ...problem import Problem
from ...results.files import json_number
from ...settings import Range, settable
from ..findings import Cell, Curve, Findings, Panel, Table, Value
from ..study import OF_A_MOTION, Study

SEEDS = (0.5, 0.02, 0.98)
"""Shares of the range at which curves are looked for, beside the value of the model."""
PATIENCE = 4
"""Starts without a new curve after which no further ones are looked for at a value."""
MOST_BRANCHES = 24


class FoundCurves(Findings, frozen=True, eq=False, kw_only=True):
    """``branches`` and ``special`` points as the JSON object has them: plain data in SI."""

    branches: tuple[dict[str, Any], ...]
    special: tuple[dict[str, Any], ...]


class FollowCurves(Study, frozen=True, kw_only=True):
    """The stationary curves over a parameter, beyond the values at which they turn back."""

    of_curves: ClassVar[bool] = True
    unused = OF_A_MOTION

    over: Annotated[
        tuple[Range, ...], settable("A parameter and its range, over which curves are followed.", "ranges")
    ] = ()

    def solve(self, problem: Problem) -> FoundCurves:
        """Follow them. Raises SimulationError where no curve is found at any value."""
        over = self._over(problem)
        experiment = find_experiment(problem, self.experiment)
        known: dict[float, Posed] = {}

        def posed(share: float) -> Posed:
            if share not in known:
                if len(known) > 256:
                    known.clear()
                value = over.low + share * (over.high - over.low)
                known[share] = pose(problem, {**self.values, over.name: value}, experiment, None)
            return known[share]

        if any(row.bound for row in posed(0.5).curve.points):
            raise SimulationError(
                "curves on an obstacle are not followed over a parameter",
                help="the places that touch change abruptly: take single values, --set or 'sweep' in an experiment",
            )
        tracer = CurveTracer(posed)
        branches: list[CurveBranch] = []
        failures: list[str] = []
        for share in (self._own(problem, over, posed), *SEEDS):
            try:
                weights = branches[0].points[0].discrete.gauge if branches else None
                first = search(posed(share), once=share in SEEDS, weights=weights)
            except Failed as failed:
                failures.append(f"{over.name} = {_value(over, share):.6g}: {failed.why}")
                continue
            for one in (first, *further(posed(share), first, (0.5, -0.5), PATIENCE)):
                if len(branches) < MOST_BRANCHES and not any(on_branch(b, one, share) for b in branches):
                    branches.append(tracer.trace(one, share))
        if not branches:
            raise SimulationError(
                f"no stationary curve of '{problem.name}' was found at any value of '{over.name}'",
                notes=tuple(failures),
            )
        return _found(problem, over, branches, posed(0.5))

    def _over(self, problem: Problem) -> Range:
        if len(self.over) != 1:
            raise SimulationError(
                "curves are followed over one parameter", help='over = "NAME = LOW .. HIGH"'
            )
        (over,) = self.over
        if over.name not in {q.name for q in problem.parameters}:
            raise SimulationError(
                f"'{over.name}' is not a parameter of '{problem.name}'",
                help="curves are followed over a parameter",
            )
        return over

    def _own(self, problem: Problem, over: Range, posed: Any) -> float:
        """Return the share of the range at which the model itself stands, a little inside."""
        experiment = find_experiment(problem, self.experiment)
        names = [q.name for q in problem.parameters]
        own = pose(problem, self.values, experiment, None).p[names.index(over.name)]
        return float(np.clip((own - over.low) / (over.high - over.low), 0.01, 0.99))


def _value(over: Range, share: float) -> float:
    return over.low + share * (over.high - over.low)


class _Row(Struct, frozen=True):
    """What a curve is in a table: its parameter, value, directions down and outputs."""

    parameter: float
    stationary: float
    negative: int
    outputs: tuple[float, ...]


def _row(over: Range, share: float, answer: FoundCurve, which: list[int]) -> _Row:
    return _Row(
        _value(over, share), answer.value, answer.negative, tuple(float(answer.outputs[k]) for k in which)
    )


def _found(problem: Problem, over: Range, branches: list[CurveBranch], posed: Posed) -> FoundCurves:
    which = [k for k, varies in enumerate(posed.curve.varying) if not varies]
    names = [problem.outputs[k].name for k in which]
    units = [problem.outputs[k].unit for k in which]
    rows = [
        [_row(over, p.share, a, which) for p, a in zip(b.points, b.answers, strict=True)] for b in branches
    ]
    specials = _distinct([(k, s) for k, b in enumerate(branches) for s in b.specials])
    span = over.high - over.low
    values = tuple(
        Value(f"{s.kind} {n}: {over.name}", over.unit, _value(over, s.share), s.error * abs(span))
        for n, (_, s) in enumerate(specials, start=1)
    )
    head = (
        ("", ""),
        (over.name, over.unit),
        ("stationary", posed.curve.unit),
        *zip(names, units, strict=True),
    )
    table: list[tuple[Cell, ...]] = []
    for _, s in specials:
        r = _row(over, s.share, s.answer, which)
        table.append((s.kind, r.parameter, r.stationary, *r.outputs))
    count = len(branches)
    listed = "; ".join(f"{s.kind} at {over.name} = {_value(over, s.share):.10g}" for _, s in specials)
    records = tuple(
        {
            "points": [
                {
                    "parameter": {over.name: json_number(r.parameter)},
                    "stationary": json_number(r.stationary),
                    "negative_directions": r.negative,
                    "outputs": {n: json_number(v) for n, v in zip(names, r.outputs, strict=True)},
                }
                for r in line
            ],
            "ends": list(branch.ends),
        }
        for line, branch in zip(rows, branches, strict=True)
    )
    points = tuple(
        {
            "kind": s.kind,
            "branch": k + 1,
            "parameter": {over.name: json_number(_value(over, s.share))},
            "error": json_number(s.error * abs(span)),
            "stationary": json_number(s.answer.value),
            "outputs": {
                n: json_number(float(s.answer.outputs[i])) for n, i in zip(names, which, strict=True)
            },
        }
        for k, s in specials
    )
    panels = [_panel(over, "stationary", posed.curve.unit, [[(r.parameter, r.stationary, r.negative) for r in line] for line in rows])]  # fmt: skip
    for k, (name, unit) in enumerate(zip(names[:2], units[:2], strict=True)):
        panels.append(_panel(over, name, unit, [[(r.parameter, r.outputs[k], r.negative) for r in line] for line in rows]))  # fmt: skip
    ends = [
        f"branch {k}: {why} at {over.name} = {_value(over, b.points[i].share):.6g}"
        for k, b in enumerate(branches, start=1)
        for i, why in zip((0, -1), b.ends, strict=True)
        if why != "the range ends"
    ]
    return FoundCurves(
        study="curves",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=f"{count} branch{'' if count == 1 else 'es'}" + (f"; {listed}" if listed else ""),
        values=values,
        errors_from="how far special points move with elements of higher degree",
        remarks=tuple(ends),
        tables=(Table("", head, tuple(table)),) if table else (),
        panels=tuple(panels),
        details={"branches": list(records), "special": list(points)},
        branches=records,
        special=points,
    )


def _distinct(specials: list[tuple[int, CurveBifurcation]]) -> list[tuple[int, CurveBifurcation]]:
    """Return special points once each; a fold of one branch that is a fork of another is a fork."""
    found: list[tuple[int, CurveBifurcation]] = []
    for k, s in sorted(specials, key=lambda row: row[1].kind != "fork"):
        if not any(
            abs(s.share - o.share) < 1e-4 + min(s.error + o.error, 1e-2)
            and abs(s.answer.value - o.answer.value) < 1e-3 * (abs(o.answer.value) + 1e-300)
            for _, o in found
        ):
            found.append((k, s))
    return sorted(found, key=lambda row: row[1].share)


def _panel(over: Range, name: str, unit: str, lines: list[list[tuple[float, float, int]]]) -> Panel:
    """Return a diagram over the parameter: minima as lines, others dashed."""
    curves: list[Curve] = []
    for line in lines:
        x, y = np.array([r[0] for r in line]), np.array([r[1] for r in line])
        least = np.array([r[2] == 0 for r in line])
        edges = [0, *(np.flatnonzero(np.diff(least.astype(int))) + 1).tolist(), len(line)]
        for first, last in itertools.pairwise(edges):
            stop = min(last + 1, len(line))
            label = "minimum" if least[first] else "saddle or maximum"
            named = any(curve.name == label for curve in curves)
            style, colour = ("line", 0) if least[first] else ("dashed", 1)
            curves.append(Curve("" if named else label, x[first:stop], y[first:stop], style, colour))
    return Panel(name, over.name, over.unit, name, unit, tuple(curves))
