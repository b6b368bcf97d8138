"""Slow sweeps: a parameter goes up and down in steps, and the motion goes on from where it was: jumps, two branches."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from msgspec import Struct

from ...integrate.interruption import NotedInterruptions
from ...outcome import SimulationError
from ...problem import Array, Problem
from ...results.solution import Solution
from ...settings import Formula, Range, settable
from ..findings import Curve, Findings, Panel, Table
from ..flow.carried_sweep import CarriedSweep, interval_of, refuse_states
from ..flow.crossings import turns
from ..runs.simulate import Plan
from ..study import Study

COUNT = 41
SEEN = 0.25
"""Part of each hold, at its end, that is looked at."""
SAMPLES = 4000
JUMP = 6.0
"""Times the median change between neighbouring values, from which on a change is a jump."""
NOTICED = 0.05
"""Of the range of what is told, which a jump exceeds."""
APART = 0.02
"""Of the same range: branches that differ by more are two."""


class Hysteresis(Study, frozen=True, kw_only=True):
    """The values of ``over`` upwards and then downwards, each held for ``hold``; every one begins with the state in which the
    one before ended, and at the time at which the model begins."""

    of_past = True
    unused = frozenset({"start", "stop", "every", "estimate_error"})
    needs = frozenset({"jacobian"})  # what is held for long may be stiff

    over: Annotated[
        tuple[Range, ...],
        settable(f"Parameter or input that goes up and down; {COUNT} values without a count.", "ranges"),
    ] = ()
    hold: Annotated[
        float | Formula | None,
        settable(
            'How long each value is kept fixed, a multiple of the period of a drive: "60*2*pi/w".', "interval"
        ),
    ] = None
    of: Annotated[
        Formula | None, settable("Quantity to observe (default: the first coordinate).", "formula")
    ] = None

    def solve(self, problem: Problem) -> Findings:
        """Go up and down. Raises SimulationError."""
        if len(self.over) != 1 or self.hold is None:
            raise SimulationError(
                "a slow sweep needs what goes up and down, and how long each value is held",
                help='say --over "w = 0.5 .. 1.5" --hold "60*2*pi/w"',
            )
        over, hold = self.over[0], self.hold
        refuse_states(problem, over)
        seen = self.of or Formula(problem.states[0].name, problem.states[0].name)
        values = np.linspace(over.low, over.high, over.count or COUNT)

        def held(plan: Plan, y: Array) -> float:
            return interval_of(plan, y, hold, "the time for which a value is held")

        with NotedInterruptions() as interrupted:
            sweep = CarriedSweep(problem, self, over, held, interrupted)
            up = _branch(sweep, seen, values, (0.0, 0.5))
            down = _branch(sweep, seen, values[::-1], (0.5, 1.0)) if sweep.goes_on else []
        return _findings(problem, sweep, seen, up, down)


class Held(Struct, frozen=True):
    """One value that was held, and what was seen at the end of it; ``unsettled``: by how much its spread still changed."""

    value: float
    lowest: float
    highest: float
    mean: float
    rms: float
    unsettled: float


def _branch(sweep: CarriedSweep, seen: Formula, values: Array, part: tuple[float, float]) -> list[Held]:
    return [_seen(value, solution, seen) for value, _, solution in sweep.motions(values, part)]


def _seen(value: float, solution: Solution, seen: Formula) -> Held:
    end = float(solution.time[-1])
    begin = end - SEEN * (end - float(solution.time[0]))
    x = solution(np.linspace(begin, end, SAMPLES))[seen.name]
    whole = turns(solution, seen.name, begin)[1]
    early, late = x[: SAMPLES // 2], x[SAMPLES // 2 :]
    change = max(
        abs(np.ptp(early) - np.ptp(late)) / 2,
        abs(early.max() - late.max()),
        abs(early.min() - late.min()),
    )
    return Held(value, float(whole.min()), float(whole.max()), float(x.mean()), float(x.std()), float(change))


def _findings(
    problem: Problem, sweep: CarriedSweep, seen: Formula, up: list[Held], down: list[Held]
) -> Findings:
    over = sweep.over
    unit = next(q.unit for q in (*problem.states, *problem.outputs) if q.name == seen.name)
    both = [*up, *down]
    quantity = _distinguishing(both)
    span = float(np.ptp([getattr(one, quantity) for one in both])) if both else 0.0
    jumps = [*_jumps(up, "up", quantity, span), *_jumps(down, "down", quantity, span)]
    apart = _apart(up, down, quantity, span)
    remarks = []
    restless = [one for one in both if one.unsettled > 1e-3 * max(span, 1e-300)]
    if restless and span > 0:
        remarks.append(
            f"at {len(restless)} of {len(both)} values the motion had not settled to a thousandth of the range: hold them "
            "longer, or it does not repeat itself"
        )
    message = sweep.message or (
        f"two branches between {over.name} = {apart[0]:.6g} and {apart[1]:.6g}"
        if apart
        else "one branch, up and down" + (", as far as motions have settled" if restless else "")
    )
    rows = tuple(
        (jump["direction"], jump["between"][0], jump["between"][1], jump["from"], jump["to"])
        for jump in jumps
    )
    head = (("jump", ""), ("between", over.unit), ("and", over.unit), ("from", unit), ("to", unit))
    word = {"rms": "rms about the mean", "mean": "mean"}[quantity]
    curves = tuple(
        Curve(
            name,
            np.array([one.value for one in branch]),
            np.array([getattr(one, quantity) for one in branch]),
            style,
            k,
        )
        for k, (name, branch, style) in enumerate((("up", up, "line"), ("down", down, "dashed")))
        if branch
    )
    errors = {
        name: max((one.unsettled for one in branch), default=None)
        for name, branch in (("up", up), ("down", down))
    }
    return Findings(
        study="hysteresis",
        model=problem.name,
        outcome=sweep.outcome,
        message=message,
        errors_from="what still changes between the halves of what is seen of each value",
        remarks=tuple(remarks),
        tables=(Table(f"jumps of {seen.text} ({word})", head, rows),) if rows else (),
        panels=(Panel(f"{seen.text}, {word}", over.name, over.unit, seen.text, unit, curves, tall=True),),
        details={
            "up": [_record(over, one) for one in up],
            "down": [_record(over, one) for one in down],
            "told": quantity,
            "jumps": jumps,
            "hysteresis": list(apart) if apart else None,
            "accuracy": {
                "errors": errors,
                "errors_from": "what still changes between the halves of what is seen",
            },
        },
        runs=(sweep.last,) if sweep.last is not None else (),
    )


def _record(over: Range, one: Held) -> dict[str, Any]:
    return {
        "parameter": {over.name: one.value}, "lowest": one.lowest, "highest": one.highest, "mean": one.mean,
        "rms": one.rms, "unsettled": one.unsettled,
    }  # fmt: skip


def _distinguishing(both: list[Held]) -> str:
    """Say what tells the branches apart: the spread of a motion, or the place where it comes to rest."""
    moving = max((one.rms for one in both), default=0.0)
    places = np.array([one.mean for one in both])
    return "rms" if len(places) and moving > 1e-3 * max(float(np.ptp(places)), 1e-300) else "mean"


def _jumps(branch: list[Held], direction: str, quantity: str, span: float) -> list[dict[str, Any]]:
    x = np.array([getattr(one, quantity) for one in branch])
    if len(x) < 3 or span == 0:
        return []
    steps = np.abs(np.diff(x))
    limit = max(JUMP * float(np.median(steps)), NOTICED * span)
    return [
        {
            "direction": direction,
            "between": [branch[k].value, branch[k + 1].value],
            "from": float(x[k]),
            "to": float(x[k + 1]),
        }
        for k in np.flatnonzero(steps > limit)
    ]


def _apart(up: list[Held], down: list[Held], quantity: str, span: float) -> tuple[float, float] | None:
    """Return the range of values at which the branches differ, by more than what had not settled there."""
    back = {one.value: one for one in down}
    differing = [
        one.value
        for one in up
        if (other := back.get(one.value)) is not None
        and abs(getattr(one, quantity) - getattr(other, quantity))
        > APART * max(span, 1e-300) + one.unsettled + other.unsettled
    ]
    return (min(differing), max(differing)) if differing else None
