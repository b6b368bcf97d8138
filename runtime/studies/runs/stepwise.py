"""A run that the caller takes on piece by piece, with inputs that change between two pieces."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
from msgspec.structs import replace

from mechc.suggest import suggest

from ...case import SimulationOptions, inputs_at
from ...driving_inputs import derived
from ...inputs import constant
from ...integrate.kernel_failure import kernel_failure
from ...integrate.solver import FIRST_EVENTS, Solver
from ...native import kernel as native
from ...native.status import Status
from ...outcome import AT_SINGULAR_POSITIONS, SimulationError, time_text
from ...problem import Problem
from ...results.diagnosis import with_cause
from .simulate import plan_run

LONGEST = 1000
"""The longest step over that of the experiment's run: how far the caller will go is not known."""

MAX_STEPS = 1_000_000
"""Steps of the integrator that one ``step`` takes, if the caller sets no bound: about a second of a small model."""


class Stepper:
    """``step(until)`` goes on to a time; ``sim[name]`` reads a state, output, input or discrete variable, in SI.

    ``sim[name] = value`` sets an input from the present time on, if its default depends on no time. ``snapshot`` and
    ``restore`` save and restore everything, bit for bit. Close it, or use it as a context.
    """

    def __init__(
        self,
        problem: Problem,
        options: SimulationOptions,
        moving: Collection[str],
        at_singular_positions: str = "",
    ) -> None:
        """Begin a run. ``moving``: inputs that the model gives as functions of time, so that they cannot be set;
        ``at_singular_positions``: what helps where constraints become dependent on its way."""
        stop = math.inf if options.stop is None else options.stop
        options = replace(options, stop=stop if math.isfinite(stop) else 1.0, points=2)
        plan = plan_run(problem, options)
        now = inputs_at(plan.case, plan.case.begin)
        given = {k: table.times.size > 1 for k, table in plan.case.tables.items()}
        self._held = {
            k: constant(float(now[k]))
            for k, quantity in enumerate(problem.inputs)
            if not given.get(k, quantity.name in moving)
        }
        self._case = replace(
            plan.case,
            tables={**plan.case.tables, **self._held},
            grid=np.empty(0),
            max_step=LONGEST * plan.case.max_step,
        )
        self._problem = problem
        self._at_singular_positions = at_singular_positions
        self._end: SimulationError | None = None
        struct, method = plan.case.functions.struct, plan.method.name
        kernel = native.kernel_for(struct, options.reproducible, method)
        tolerance, step = plan.case.tolerance, plan.case.step or 0.0
        self._nominal = plan.nominal
        self._solver = Solver(kernel, self._case, method, tolerance, tolerance * plan.nominal, step)

    def __enter__(self) -> Stepper:
        return self

    def __exit__(self, *details: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the memory of the run back."""
        self._solver.__exit__(None, None, None)

    @property
    def time(self) -> float:
        return self._solver.report()[0].t

    def step(self, until: float, *, max_steps: int = MAX_STEPS, seconds: float = math.inf) -> None:
        """Go on to the time ``until`` [s]. Raises ``SimulationError`` if the run fails on its way or has ended.

        So does a motion that needs more than ``max_steps`` steps of the integrator or ``seconds`` of computing (checked ten
        times a second): then the run stands where it came to, and may be restored or taken on.
        """
        if until < self.time:
            raise SimulationError(f"the run is at {time_text(self._problem, self.time)}, beyond {until:g}")
        if self._end is not None:
            raise self._end
        status, begun = Status.RUNNING, self._solver.progress()
        last, end = begun.steps + max_steps, begun.seconds + seconds
        left = max_steps
        while status in (Status.RUNNING, Status.EVENTS_FULL):
            status = self._solver.advance(until, left)
            if status == Status.EVENTS_FULL:
                self._solver.start_events(FIRST_EVENTS)
            elif status == Status.RUNNING:
                now = self._solver.progress()
                left = last - now.steps
                if left <= 0 or now.seconds > end:
                    raise self._over_budget(until, max_steps if left <= 0 else None, seconds)
        if status != Status.REACHED:
            self._end = self._failure(status)
            raise self._end

    def _over_budget(self, until: float, max_steps: int | None, seconds: float) -> SimulationError:
        """Say how far a step has come within its bounds, and which state is the largest."""
        report, y = self._solver.report()
        spent = f"{seconds:g} s of computing" if max_steps is None else f"{max_steps} steps"
        own = np.array([state.kind != "account" for state in self._problem.states])
        largest = int(np.argmax(own * np.abs(y) / self._nominal))
        state = self._problem.states[largest]
        return SimulationError(
            f"{spent} lead to {time_text(self._problem, report.t)} only, not to {time_text(self._problem, until)}; "
            f"the largest state there is {state.name} = {y[largest]:.4g} {state.unit}".rstrip(),
            help="the motion grows without bound, or it needs a larger max_steps or seconds in 'step'",
        )

    def _failure(self, status: Status) -> SimulationError:
        report, y = self._solver.report()
        problem = self._problem
        if status == Status.TERMINATED and problem.hybrid is not None:
            message = problem.hybrid.branches[report.failed_index].message
            return SimulationError(f"{message} at {time_text(problem, report.t)}")
        found = kernel_failure(problem, status, report, y)
        if found is None:
            return SimulationError(f"the run stopped at {time_text(problem, report.t)}")
        found = with_cause(self._case, found)
        singular = problem.constraints and found.kind in AT_SINGULAR_POSITIONS
        advice = self._at_singular_positions if singular else ""
        return SimulationError(found.message, found.origin, help=advice)

    def __getitem__(self, name: str) -> float:
        report, y = self._solver.report()
        problem, z = self._problem, self._solver.discretes()
        u = inputs_at(self._case, report.t)
        for quantities, values in ((problem.states, y), (problem.inputs, u), (problem.discretes, z)):
            for quantity, value in zip(quantities, values, strict=True):
                if quantity.name == name:
                    return float(value)
        for k, quantity in enumerate(problem.outputs):
            if quantity.name == name and self._case.functions.outputs is not None:
                return float(self._case.functions.outputs(report.t, y, u, z, self._case.p)[k])
        known = [q.name for q in (*problem.states, *problem.outputs, *problem.inputs, *problem.discretes)]
        raise KeyError(f"there is no '{name}'{suggest(name, known)}")

    def __setitem__(self, name: str, value: float) -> None:
        names = [quantity.name for quantity in self._problem.inputs]
        if name not in names:
            raise SimulationError(f"'{name}' is no input (inputs: {', '.join(names) or 'none'})")
        k = names.index(name)
        if k not in self._held:
            raise SimulationError(f"the input '{name}' is a function of time or a table, so it cannot be set")
        if k in {i for own, more in derived(self._problem).items() for i in (own, *more)}:
            raise SimulationError(
                f"the input '{name}' drives a coordinate, which cannot be elsewhere at once"
            )
        if k in self._problem.held_inputs and value != self._held[k].values[0]:
            raise SimulationError(
                f"the equations take the rate of the input '{name}' to be zero, so it stays as it is while they run"
            )
        if not math.isfinite(value):
            raise SimulationError(f"the input '{name}' is a finite number, not {value}")
        self._held[k].values[0] = value
        self._solver.set_constant(k, value)

    def snapshot(self) -> tuple[bytes, dict[int, float]]:
        """Give all that changes during the run."""
        return self._solver.save(), {k: float(table.values[0]) for k, table in self._held.items()}

    def restore(self, saved: tuple[bytes, dict[int, float]]) -> None:
        """Go back to what ``snapshot`` gave, bit for bit."""
        memory, inputs = saved
        self._end = None
        for k, value in inputs.items():
            self._held[k].values[0] = value
            self._solver.set_constant(k, value)
        self._solver.load(memory)
