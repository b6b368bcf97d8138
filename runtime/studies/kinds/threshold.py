"""Thresholds: from which value of a parameter or of the start on something happens, by bisection."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from msgspec.structs import replace

from ...integrate.interruption import NotedInterruptions
from ...outcome import ENDED, Outcome, SimulationError, time_text
from ...problem import Problem
from ...results.solution import Solution
from ...settings import FormulaSurface, Range, settable
from ..findings import Curve, Findings, Panel, Table
from ..flow.crossings import turns
from ..runs.companion import closer
from ..runs.simulate import plan_run, run
from ..study import Study

LOOKS = 17
"""Values at which it is looked at first."""
WIDTH = 1e-12
"""Of the range, to which a threshold is bisected."""
TOLERANCE = 1e-10
"""Of a threshold for which no tolerance is said."""
TOUCHES = 1e-13
"""Of the sizes of a quantity and its level, within which a motion with impacts has reached the level."""


class Threshold(Study, frozen=True, kw_only=True):
    """The values of ``over`` at which what happens changes: that the motion ``reaches`` a value, or without it, that it is
    ended by ``terminate`` before its stop."""

    of_past = True
    needs = frozenset({"jacobian"})  # beyond a threshold motions may be stiff
    unused = frozenset({"start", "every", "estimate_error"})

    over: Annotated[
        tuple[Range, ...],
        settable(f"Quantity to vary; {LOOKS} values are evaluated first unless a count is given.", "ranges"),
    ] = ()
    reaches: Annotated[
        FormulaSurface | None,
        settable(
            'Event that must happen before the stop: "x = -1" (default: an end by terminate).', "surface"
        ),
    ] = None

    def solve(self, problem: Problem) -> Findings:
        """Look at values over the range, and bisect where neighbours differ. Raises SimulationError."""
        if len(self.over) != 1:
            raise SimulationError(
                "a threshold is sought over one quantity", help='say --over "push = 0 .. 5" --reaches "x = 1"'
            )
        over = self.over[0]
        with NotedInterruptions() as interrupted:
            return _Bisection(problem, self, over).findings(interrupted)


class _Bisection:
    """What happens as a function of the value that is varied."""

    def __init__(self, problem: Problem, study: Threshold, over: Range) -> None:
        self.problem, self.study, self.over = problem, study, over
        plan = plan_run(problem, replace(study, values={**study.values, over.name: over.low}))
        case = plan.case
        self.tolerance = case.tolerance if study.tolerance is not None else min(case.tolerance, TOLERANCE)
        self.closer, _ = closer(replace(plan, case=replace(case, tolerance=self.tolerance)))
        self.horizon = time_text(problem, case.stop)
        self.seen: list[tuple[float, bool, float]] = []
        self.ended: dict[float, str] = {}
        """What ended motions by terminate before it happened."""
        self.last: Solution | None = None

    def happens(self, value: float, *, closer: bool = False) -> bool:
        """Say whether it happens with a value, also in the ``closer`` motion. Raises SimulationError where one fails before
        it can be told."""
        study = self.study
        options = replace(
            study, values={**study.values, self.over.name: value}, estimate_error=False, progress=None,
            tolerance=self.tolerance, max_steps=None, stiff_after=None,
        )  # fmt: skip
        if closer:
            options = replace(options, **self.closer)
        solution = run(self.problem, options)
        if solution.outcome is Outcome.INTERRUPTED:
            raise KeyboardInterrupt
        self.last = solution
        if study.reaches is None:
            happened, extreme = solution.outcome is Outcome.TERMINATED, float(solution.time[-1])
        else:
            happened, extreme = self._reached(solution, study.reaches)
        if not happened and solution.outcome not in ENDED:
            raise SimulationError(
                f"whether it happens at {self.over.name} = {value:.9g} cannot be told: {solution.message}",
                help="stop earlier, or vary over a smaller range",
            )
        if not happened and solution.outcome is Outcome.TERMINATED:
            self.ended[value] = solution.message
        if not closer:
            self.seen.append((value, happened, extreme))
        return happened

    def _reached(self, solution: Solution, surface: FormulaSurface) -> tuple[bool, float]:
        """Say whether a motion goes through a level, and how far it comes towards it from where it begins."""
        g = turns(solution, surface.name)[1] - surface.level
        g = g[np.isfinite(g)]
        begun = np.flatnonzero(g)
        if not len(begun):
            return True, surface.level
        sign = float(np.sign(g[begun[0]]))
        closest = float((sign * g).min())
        hits = any(event.kind == "impact" for event in solution.events)
        # where a contact stands on the level, rounding decides on which side of it an impact is
        touches = TOUCHES * (abs(surface.level) + float(np.ptp(g))) if hits else 0.0
        return closest <= touches, surface.level + sign * closest

    def findings(self, interrupted: Callable[[], bool]) -> Findings:
        over, study = self.over, self.study
        values = np.linspace(over.low, over.high, over.count or LOOKS)
        found: list[dict[str, Any]] = []
        outcome = Outcome.COMPLETED
        try:
            told = []
            for k, value in enumerate(values):
                told.append(self.happens(float(value)))
                if study.progress is not None:
                    study.progress(0.5 * (k + 1) / len(values))
                if interrupted():
                    raise KeyboardInterrupt
            for k in [k for k in range(len(told) - 1) if told[k] != told[k + 1]]:
                found.append(self._located(float(values[k]), float(values[k + 1]), told[k], interrupted))
        except KeyboardInterrupt:
            outcome = Outcome.INTERRUPTED
        return self._answer(found, outcome)

    def _located(
        self, low: float, high: float, below: bool, interrupted: Callable[[], bool]
    ) -> dict[str, Any]:
        """Bisect, and widen what is left until a tighter tolerance agrees at both of its ends."""
        width = WIDTH * (self.over.high - self.over.low)
        while high - low > width and low < (low + high) / 2 < high:
            middle = (low + high) / 2
            if self.happens(middle) == below:
                low = middle
            else:
                high = middle
            if interrupted():
                raise KeyboardInterrupt
        first, last = self.over.low, self.over.high
        a, b, reach = low, high, max(high - low, 4e-16 * abs(low))
        while a > first and self.happens(a, closer=True) != below:
            a, reach = max(first, a - reach), 3 * reach
        reach = max(high - low, 4e-16 * abs(high))
        while b < last and self.happens(b, closer=True) == below:
            b, reach = min(last, b + reach), 3 * reach
        place = (low + high) / 2
        return {
            "parameter": {self.over.name: place},
            "error": max(place - a, b - place),
            "below": below,
            "above": not below,
        }

    def _answer(self, found: list[dict[str, Any]], outcome: Outcome) -> Findings:
        over, study, problem = self.over, self.study, self.problem
        what = f"it reaches {study.reaches.text}" if study.reaches is not None else "it is ended by terminate"
        rows = tuple(
            (
                one["parameter"][over.name],
                one["error"],
                f"{what} {'below' if one['below'] else 'above'}",
            )
            for one in found
        )
        seen = sorted(self.seen)
        if found:
            message = f"{what} from {over.name} = {found[0]['parameter'][over.name]:.9g} on"
            if len(found) > 1:
                message = f"{what} first from {over.name} = {found[0]['parameter'][over.name]:.9g} on; {len(found)} changes"
            elif found[0]["below"]:
                message = f"{what} up to {over.name} = {found[0]['parameter'][over.name]:.9g}"
        else:
            always = bool(seen) and seen[0][1]
            message = f"{what} {'at every' if always else 'at no'} value that was looked at"
        if outcome is Outcome.INTERRUPTED:
            message = f"interrupted: {message}"
        quantity = study.reaches.name if study.reaches is not None else "time of the end"
        unit = problem.time.unit
        if study.reaches is not None:
            unit = next(q.unit for q in (*problem.states, *problem.outputs) if q.name == quantity)
        curves = [
            Curve(name, np.array([v for v, h, _ in seen if h is happened]), np.array([e for _, h, e in seen if h is happened]),
                  "points", k)
            for k, (name, happened) in enumerate((("does not happen", False), ("happens", True)))
        ]  # fmt: skip
        if study.reaches is not None:
            ends = np.array([over.low, over.high])
            curves.append(Curve(study.reaches.text, ends, np.full(2, study.reaches.level), "dashed", 2))
        title = "how far it comes" if study.reaches is not None else "when it ends"
        return Findings(
            study="threshold",
            model=problem.name,
            outcome=outcome,
            message=message,
            errors_from="bisection, and a tighter tolerance at the ends of what is left",
            remarks=(
                *self._ended_before(),
                f"motions are followed to {self.horizon}: what happens later does not count",
                f"two changes between neighbours of the {over.count or LOOKS} values that were looked at first are not seen",
            ),
            tables=(Table("", ((over.name, over.unit), ("error", over.unit), ("", "")), rows),)
            if rows
            else (),
            panels=(Panel(title, over.name, over.unit, quantity, unit, tuple(curves)),),
            details={
                "thresholds": found,
                "looked_at": [{"parameter": {over.name: v}, "happens": h} for v, h, _ in seen],
                "accuracy": {
                    "errors": [one["error"] for one in found],
                    "errors_from": "bisection, and a tighter tolerance at the ends of what is left",
                },
            },
            runs=(self.last,) if self.last is not None else (),
        )

    def _ended_before(self) -> list[str]:
        """Say that motions ended by terminate before it happened, and of one of them when."""
        if not self.ended or self.study.reaches is None:
            return []
        value, message = min(self.ended.items())
        count = len(self.ended)
        return [
            f"{count} motion{'s' if count > 1 else ''} ended before that, as with {self.over.name} = {value:.6g}: {message}"
        ]
