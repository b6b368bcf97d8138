"""The gradient of one number of a motion in as many parameters, initial values and inputs as one likes, for the price of a few runs."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from msgspec.structs import replace

from ...case import Case, inputs_at
from ...outcome import Outcome, SimulationError
from ...problem import Problem
from ...results.accuracy import companion_tolerance
from ...settings import Formula, settable
from ...tangent.gradient import Gradient, Gradients
from ..findings import Curve, Findings, Panel, Value
from ..runs.simulate import plan_run
from ..study import Study

FEW = 6
"""Names that are written below a picture."""


class FindGradient(Study, frozen=True, kw_only=True):
    """The derivatives of ``goal``, at the end of a smooth motion or as its integral over the time, in all that ``to`` names."""

    unused = frozenset({"every"})
    goal: Annotated[Formula | None, settable('Quantity to differentiate: "x", "x^2 + y^2".', "formula")] = (
        None
    )
    to: Annotated[
        tuple[str, ...],
        settable(
            "Parameters, initial values and inputs with respect to which to differentiate.", "directions"
        ),
    ] = ()
    integral: Annotated[
        bool, settable("Differentiate the integral of the goal over the time, not its last value.", "flag")
    ] = False

    def solve(self, problem: Problem) -> Findings:
        """Run the motion and go back along its steps. Raises SimulationError for motions that are not smooth."""
        if self.goal is None or not self.to:
            raise SimulationError(
                "a gradient needs a goal, and names to differentiate in", help="say --goal x --to m,l"
            )
        plan = plan_run(problem, replace(self, points=2))
        case = plan.case
        begun = Gradients(case, self.goal.name, self.to, integral=self.integral)
        found = begun.at(plan.nominal, case.tolerance)
        _check(found, self.goal.text, case)
        errors: list[float | None] = [None] * (1 + len(self.to))
        words = "no second run was asked for"
        if self.estimate_error:
            tolerance = companion_tolerance(case.tolerance)[0]
            other = begun.at(plan.nominal, tolerance)
            errors = [
                abs(found.value - other.value),
                *(float(e) for e in np.abs(found.derivatives - other.derivatives)),
            ]
            words = f"the same at a tolerance of {tolerance:.0e}"
        goal = f"integral of {self.goal.text}" if self.integral else self.goal.text
        names = [d.name for d in found.directions]
        return Findings(
            study="gradient",
            model=problem.name,
            outcome=Outcome.COMPLETED,
            message=f"{goal} is {found.value:.10g}{f' {found.unit}' if found.unit else ''} at {case.stop:g}{f' {problem.time.unit}' if problem.time.unit else ''}",
            values=(
                Value(goal, found.unit, found.value, errors[0]),
                *(
                    Value(f"d/d({name})", unit, float(value), error)
                    for name, unit, value, error in zip(
                        names, found.units, found.derivatives, errors[1:], strict=True
                    )
                ),
            ),
            errors_from=words,
            remarks=(f"back over {found.steps} steps, whose states fill {found.memory / 1e3:.3g} kB",),
            panels=(_panel(goal, found, case),),
            details={
                "goal": found.value,
                "gradient": dict(zip(names, found.derivatives.tolist(), strict=True)),
                "steps": found.steps,
                "memory": found.memory,
            },
            arrays={"gradient": found.derivatives},
        )


def _check(found: Gradient, goal: str, case: Case) -> None:
    """Refuse what is not a number. Raises SimulationError."""
    if not np.isfinite(found.value):
        raise SimulationError(
            f"'{goal}' is not a number at the end of the motion, at t = {case.stop:g}",
            help="a goal must be defined there: roots and logarithms of positive values, no division by zero",
        )
    wrong = [
        d.name for d, value in zip(found.directions, found.derivatives, strict=True) if not np.isfinite(value)
    ]
    if wrong:
        raise SimulationError(
            f"the derivative of '{goal}' by '{wrong[0]}' is not a number: somewhere during the motion a formula has none, such as the root at zero",
            help="sensitivity=[...] of a run states the time at which this happens",
        )


def _panel(goal: str, found: Gradient, case: Case) -> Panel:
    """Draw what a change of each by its own size does to the goal; by one, where its value is zero."""
    sizes = [
        abs(float({"p": case.p, "y": case.y0, "u": inputs_at(case, case.begin)}[d.array][d.index])) or 1.0
        for d in found.directions
    ]
    names = [d.name for d in found.directions]
    named = "" if len(names) <= FEW else f"{len(names)} names, in their order"
    places = np.arange(1.0, 1.0 + len(sizes))
    curve = Curve("", places, found.derivatives * np.array(sizes), "points")
    shown = tuple(names) if not named else ()
    title = "what a change of each by its own size does"
    return Panel(title, named, "", f"change of {goal}", found.unit, (curve,), x_names=shown)
