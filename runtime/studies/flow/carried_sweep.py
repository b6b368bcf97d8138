"""A parameter that goes through values step by step, while the motion goes on from where it was: slow sweeps and diagrams."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from msgspec.structs import replace

from ...case import SimulationOptions, find_setting, inputs_at
from ...outcome import ENDED, Outcome, SimulationError
from ...problem import Array, Problem
from ...results.solution import Solution
from ...settings import Formula, Range
from ...start.initial import assemble
from ..runs.simulate import Plan, plan_run, run_from
from .pieces import column_at

Hold = Callable[[Plan, Array], float]
"""How long a value is held, from the plan of its run and the state with which it begins."""


def refuse_states(problem: Problem, over: Range) -> None:
    """Raise SimulationError for a part of the state, which the motion carries from value to value."""
    if find_setting(problem, over.name).array == "y":
        raise SimulationError(
            f"'{over.name}' is part of the state, which is carried over",
            help="sweep a parameter or a constant input",
        )


def interval_of(plan: Plan, y: Array, said: float | Formula, what: str) -> float:
    """Return a time that may be a formula of the parameters. Raises SimulationError where it is not positive."""
    if isinstance(said, Formula):
        said = float(column_at(plan.case, said.name)(np.array([plan.case.begin]), y[None, :])[0])
    if not (math.isfinite(said) and said > 0):
        raise SimulationError(f"{what} is positive, it is {said:g}")
    return said


class CarriedSweep:
    """The motion that is carried from value to value. Each value begins with the state and the discrete variables with which the
    one before ended, on the constraints as they are now, and at the time at which the model begins."""

    def __init__(
        self,
        problem: Problem,
        options: SimulationOptions,
        over: Range,
        hold: Hold,
        interrupted: Callable[[], bool],
    ) -> None:
        self.problem, self.over, self.hold, self.interrupted = problem, over, hold, interrupted
        self.options = replace(
            options, start=0.0, stop=0.0, every=None, estimate_error=False, progress=None, max_steps=None, stiff_after=None,
        )  # fmt: skip
        self.progress = options.progress
        self.y: Array | None = None
        self.z: Array | None = None
        self.outcome, self.message, self.goes_on = Outcome.COMPLETED, "", True
        self.last: Solution | None = None

    def afresh(self) -> None:
        """Let the next value begin at the start of the model."""
        self.y = self.z = None

    def motions(
        self, values: Array, part: tuple[float, float], *, afresh: bool = False
    ) -> Iterator[tuple[float, Plan, Solution]]:
        """Yield each value with its plan and its motion, as long as they go on; ``part`` of the work of the whole study."""
        for k, value in enumerate(values.tolist()):
            if self.interrupted():
                self.outcome, self.goes_on = Outcome.INTERRUPTED, False
                self.message = f"interrupted at {self.over.name} = {value:g}"
                return
            if afresh:
                self.afresh()
            plan, solution = self._held(value)
            if solution.outcome not in ENDED or solution.outcome is Outcome.TERMINATED:
                self.outcome, self.goes_on = solution.outcome, False
                self.message = f"ended at {self.over.name} = {value:.6g}: {solution.message}"
                return
            yield value, plan, solution
            if self.progress is not None:
                self.progress(part[0] + (part[1] - part[0]) * (k + 1) / len(values))

    def _held(self, value: float) -> tuple[Plan, Solution]:
        options = replace(self.options, values={**self.options.values, self.over.name: value})
        begun = plan_run(self.problem, options)
        y = begun.case.y0 if self.y is None else self._carried(begun)
        plan = plan_run(self.problem, replace(options, stop=begun.case.begin + self.hold(begun, y)))
        z = plan.case.z if self.z is None else self.z
        solution = run_from(plan, y, z)
        self.last = solution
        final = solution.final()
        self.y = np.array([final[q.name] for q in self.problem.states])
        for k, quantity in enumerate(self.problem.states):
            if quantity.kind == "account":
                self.y[k] = 0.0
        self.z = plan.case.z.copy()
        for k, quantity in enumerate(self.problem.discretes):
            if quantity.kind == "discrete":  # what holds, sticks and switches follows from the state
                self.z[k] = float(solution[quantity.name][-1])
        return plan, solution

    def _carried(self, plan: Plan) -> Array:
        problem, case, before = self.problem, plan.case, self.y
        assert before is not None
        if not problem.assembly or self.last is None:
            return before
        free = np.zeros(len(before), dtype=bool)
        return assemble(
            problem, case.functions, case.begin, before, free, inputs_at(case, case.begin), case.z, case.p,
            reproducible=self.options.reproducible,
        ).y  # fmt: skip
