"""Floquet multipliers: how small changes of a periodic motion grow over one period; charts of stability (Floquet 1883)."""

from __future__ import annotations

import itertools
import math
from typing import Annotated, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ...case import part_of
from ...integrate.interruption import NotedInterruptions
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...settings import Formula, Range, settable
from ..findings import Curve, Findings, Panel, Table, Value
from ..flow.linearised import Linearised, multipliers
from ..flow.pieces import column_at, with_horizon
from ..flow.time_dependence import after_initial_events
from ..runs.simulate import Plan, plan_run
from ..study import Study

TOLERANCE = 1e-11
ALONG, ACROSS = 101, 41
"""Values of a parameter, and of each of two."""
BACK = 1e-6
"""Of nominal values: a motion that misses its start by more does not come back."""


class Floquet(Study, frozen=True, kw_only=True):
    """The multipliers of the motion from the start over ``period``, which must be one of the motion or of the linear
    model; over one parameter, or over two as a chart of stability."""

    needs = frozenset({"jacobian"})
    of_own_states = True

    period: Annotated[float | Formula | None, settable('The period: "2*pi/w".', "interval")] = None
    over: Annotated[
        tuple[Range, ...], settable('Parameters: "a = 0 .. 1, 50", or two, separated by a comma.', "ranges")
    ] = ()

    def solve(self, problem: Problem) -> Findings:
        """Integrate the motion and its derivatives over a period. Raises SimulationError."""
        options = with_horizon(problem, self, 1.0, TOLERANCE)
        if len(self.over) > 2:
            raise SimulationError("stability is shown over one parameter or over two, not over more")
        first = _at(problem, options, {})
        linear = Linearised(first.plan)
        if not self.over:
            return _one(problem, first, linear)
        return _over(problem, options, linear)


class _Place(Struct, frozen=True):
    plan: Plan
    period: float


def _at(problem: Problem, study: Floquet, values: dict[str, float]) -> _Place:
    """Make the motion ready for these values of parameters."""
    options = replace(study, values={**study.values, **values}, stop=study.stop)
    plan = after_initial_events(plan_run(problem, options))
    case, period = plan.case, study.period
    if period is None:
        period = case.stop - case.begin
    if isinstance(period, Formula):
        period = float(column_at(case, period.name)(np.array([case.begin]), case.y0[None, :])[0])
    if not (math.isfinite(period) and period > 0):
        raise SimulationError(f"the period is positive, it is {period:g}")
    return _Place(plan, period)


def _one(problem: Problem, place: _Place, linear: Linearised) -> Findings:
    case = place.plan.case
    start = _settled(linear, place)
    found = linear.map(case.begin, start, place.period).remembered()
    values, errors = multipliers(found)
    own = list(problem.own)
    missed = float((np.abs(found.end - case.y0) / place.plan.nominal)[own].max())
    missed = max(missed, linear.missed(start, found))
    remarks = []
    if missed > BACK:
        remarks.append(
            f"the motion does not come back to its start after this time, it misses it by {missed:.1e} of its size: these "
            "are the multipliers of its linear map, and of a period only where the model is linear with this period"
        )
    remarks += linear.unreturned(start, found)
    if found.memory:
        remarks.append(f"changes of {linear.named(found)} belong to the map: the motion keeps and reads them")
    largest, error = float(np.abs(values[0])), float(errors[0])
    # the map of a smooth linear model holds wherever it begins
    judged = missed <= BACK or problem.hybrid is None
    stable = None if abs(largest - 1) <= error or not judged else largest < 1
    words = {None: "neutral: stability cannot be told", True: "stable", False: "unstable"}[stable]
    if not judged:
        words = "no period of the motion, so nothing is said of its stability"
    rows = tuple(
        (complex(value), float(abs(value)), float(off)) for value, off in zip(values, errors, strict=True)
    )
    turn = np.linspace(0, 2 * np.pi, 181)
    panel = Panel("multipliers", "real part", "", "imaginary part", "", (
        Curve("unit circle", np.cos(turn), np.sin(turn), "dashed"),
        Curve("multipliers", values.real, values.imag, "points")), equal=True, tall=True)  # fmt: skip
    return Findings(
        study="floquet",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=f"{words}, the largest multiplier is {largest:.10g} in size",
        values=(Value("period", problem.time.unit, place.period, 0.0), Value("largest", "", largest, error)),
        errors_from="a run at a tighter tolerance, through the conditions of the eigenvalues",
        remarks=tuple(remarks),
        tables=(Table("multipliers", (("multiplier", ""), ("size", ""), ("error", "")), rows),),
        panels=(panel,),
        details={
            "multipliers": [[float(v.real), float(v.imag)] for v in values],
            "errors": errors.tolist(),
            "period": place.period,
            "stable": stable,
            "returns": missed <= BACK,
        },
    )


def _settled(linear: Linearised, place: _Place) -> Array:
    """Give the start with what the first periods set once."""
    case = place.plan.case
    start = linear.joined(case.y0, case.z)
    if not linear.declared:
        return start
    first = linear.map(case.begin, start, place.period, checked=False).remembered()
    return linear.settled(case.begin, start, place.period, first)


def _over(problem: Problem, study: Floquet, linear: Linearised) -> Findings:
    """Give the largest multiplier over one parameter, or a chart over two, row by row."""
    each = ALONG if len(study.over) == 1 else ACROSS
    axes = [np.linspace(r.low, r.high, r.count or each) for r in study.over]
    names = [r.name for r in study.over]
    sizes = np.full([len(a) for a in axes], np.nan)
    all_values: list[Any] = []
    done, outcome = 0, Outcome.COMPLETED
    with NotedInterruptions() as interrupted:
        for index in itertools.product(*(range(len(a)) for a in axes)):
            if interrupted():
                outcome = Outcome.INTERRUPTED
                break
            values = {n: float(a[k]) for n, a, k in zip(names, axes, index, strict=True)}
            place = _at(problem, study, values)
            found_values = _multipliers(linear, place)
            sizes[index] = np.abs(found_values[0])
            all_values.append([[float(v.real), float(v.imag)] for v in found_values])
            done += 1
            if progress := part_of(study.progress, 0.0, 1.0):
                progress(done / sizes.size)
    details: dict[str, Any] = {
        "parameters": {n: a.tolist() for n, a in zip(names, axes, strict=True)},
        "largest": np.where(np.isfinite(sizes), sizes, np.nan).tolist(),
        "multipliers": all_values,
    }
    if len(axes) == 1:
        edges = _edges(problem, study, linear, names[0], axes[0], sizes)
        details["edges"] = edges
        panels: tuple[Panel, ...] = (
            Panel("stability", names[0], study.over[0].unit, "largest multiplier", "", (
                Curve("largest multiplier", axes[0], sizes),
                Curve("1", axes[0], np.ones_like(sizes), "dashed"))),
        )  # fmt: skip
        found_edges = tuple(
            Value(f"edge {k + 1}", study.over[0].unit, edge, width) for k, (edge, width) in enumerate(edges)
        )
    else:
        panels, found_edges = (_chart(study, axes, sizes),), ()
    unstable = int((sizes > 1 + 1e-6).sum())
    return Findings(
        study="floquet",
        model=problem.name,
        outcome=outcome,
        message=f"unstable at {unstable} of {done} values",
        values=found_edges,
        errors_from="bisection of the size of the largest multiplier at 1",
        panels=panels,
        details=details,
        arrays={**dict(zip(names, axes, strict=True)), "largest": sizes},
    )


def _multipliers(linear: Linearised, place: _Place) -> NDArray[Any]:
    """Give the multipliers at other values of parameters, the largest first."""
    case, there = place.plan.case, linear.renewed(place.plan)
    found = there.map(case.begin, _settled(there, place), place.period, checked=False)
    values: NDArray[Any] = np.linalg.eigvals(found.remembered().matrix)
    return values[np.argsort(-np.abs(values))]


NEUTRAL = 1e-7
"""Beyond 1, from where on a multiplier counts as unstable: those of stable motions without damping are 1 in size."""


def _edges(
    problem: Problem, study: Floquet, linear: Linearised, name: str, axis: Array, sizes: Array
) -> list[tuple[float, float]]:
    """Find the values at which stability changes, by bisection between neighbours."""
    edges = []
    unstable = sizes > 1 + NEUTRAL
    for k in np.flatnonzero(unstable[1:] != unstable[:-1]):
        low, high = float(axis[k]), float(axis[k + 1])
        limit = 1.0 if min(sizes[k], sizes[k + 1]) < 1 - NEUTRAL else 1 + NEUTRAL
        while high - low > 1e-9 * max(abs(low), abs(high)):
            middle = (low + high) / 2
            found = _multipliers(linear, _at(problem, study, {name: middle}))
            beyond = float(np.abs(found[0])) > limit
            low, high = (middle, high) if beyond == unstable[k] else (low, middle)
        edges.append(((low + high) / 2, high - low))
    return edges


def _chart(study: Floquet, axes: list[Array], sizes: Array) -> Panel:
    """Draw the places of unstable and of stable values."""
    x, y = np.meshgrid(*axes, indexing="ij")
    unstable = sizes > 1 + 1e-6
    one, other = study.over
    return Panel("stability", one.name, one.unit, other.name, other.unit, (
        Curve("stable", x[~unstable], y[~unstable], "cells"),
        Curve("unstable", x[unstable], y[unstable], "cells")), tall=True)  # fmt: skip
