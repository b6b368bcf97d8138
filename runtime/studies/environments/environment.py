"""One environment: arrays without the axis of many, names, and errors that are raised."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mechc.suggest import suggest

from ...allowed_values import check_input
from ...case import SimulationOptions, inputs_at
from ...driving_inputs import derived
from ...native import kernel as native
from ...outcome import SimulationError, time_text
from ...problem import Array, Problem
from .environments import Environments, Wishes


class Environment(Environments):
    """One of ``Environments``: ``q`` [nq], ``v`` [nv], ``x`` [nx], ``z`` [nz], ``u`` [nu] and ``y`` [ny], ``time`` and ``status``
    numbers; ``env[name]`` reads a state, input, output or discrete variable, ``env[name] = value`` sets an input. What ends it is
    raised.
    """

    def __init__(self, problem: Problem, options: SimulationOptions, wishes: Wishes) -> None:
        super().__init__(problem, options, wishes)
        self._views = tuple(view[0:1] if view.ndim == 1 else view[0] for view in self._views)
        self._inputs_now, self._outputs_now = self._u[0], self._outputs[0]
        self._read_status = self._status.item
        self._readers: dict[str, Callable[[], float]] = {}
        self._places = {name: k for k, name in enumerate(self.names.u)}
        self._bounded = {q.name: q for q in problem.inputs if q.minimum is not None or q.maximum is not None}
        self._as_they_are = {problem.inputs[k].name for k in problem.held_inputs}

    @property
    def time(self) -> float:
        return self._t.item(0)

    @property
    def status(self) -> int:
        return self._status.item(0)

    @property
    def u(self) -> Array:
        found: Array = self._inputs_now
        return found

    @property
    def y(self) -> Array:
        if self._stale:
            self._read()
            self._stale = False
        found: Array = self._outputs_now
        return found

    def step(self) -> None:
        """Take one control step with the inputs of ``u``. Raises ``SimulationError`` if the motion fails on its way or has ended."""
        self._stale = True
        while self._step():
            pass
        if self._read_status(0) != 1:
            raise self._ended()

    def reset(self, q: Any = None, v: Any = None, x: Any = None, where: Any = None) -> None:
        """Begin again at the start, or in the state that is given (see ``Environments``). Raises SimulationError."""
        super().reset(q, v, x, where)
        if self._status.item(0) != 1:
            raise self._ended()

    def step_to(self, until: float, max_steps: int, seconds: float) -> None:
        """Go on to a time, whatever the period. Raises ``SimulationError``, also where that takes more steps or seconds."""
        self._check_open()
        self._stale = True
        begun = self._progress()
        struct, last = self._struct, begun.steps + max_steps
        struct.until = until
        try:
            while self.status in (1, 0):
                struct.max_steps = last - self._progress().steps
                unfinished = self._step()
                now = self._progress()
                if self.status == 1 and self.time >= until:
                    return
                if self.status == 0 and (not unfinished or now.seconds - begun.seconds > seconds):
                    raise self._over_budget(until, None if unfinished else max_steps, seconds)
        finally:
            struct.until, struct.max_steps = math.nan, self._wishes.max_steps
        raise self._ended()

    def _progress(self) -> native.ReportStruct:
        report = native.ReportStruct()
        self._library.mech_environments_report(self._struct, 0, report)
        return report

    def _over_budget(self, until: float, max_steps: int | None, seconds: float) -> SimulationError:
        """Say how far a step has come within its bounds, and which state is the largest."""
        problem, y = self._problem, self._y[0]
        spent = f"{seconds:g} s of computing" if max_steps is None else f"{max_steps} steps"
        own = np.array([state.kind != "account" for state in problem.states])
        largest = int(np.argmax(own * np.abs(y) / self._nominal))
        state = problem.states[largest]
        return SimulationError(
            f"{spent} lead to {time_text(problem, self.time)} only, not to {time_text(problem, until)}; "
            f"the largest state there is {state.name} = {y[largest]:.4g} {state.unit}".rstrip(),
            help="the motion grows without bound, or it needs a larger max_steps or seconds in 'step'",
        )

    def _ended(self) -> SimulationError:
        return self.why() or SimulationError(
            f"a control step took more than {self._struct.max_steps} steps; the motion goes on with the next one",
            help="the motion grows without bound, or it needs a larger max_steps",
        )

    def __getitem__(self, name: str) -> float:
        reader = self._readers.get(name)
        if reader is None:
            reader = self._readers[name] = self._reader(name)
        return reader()

    def _reader(self, name: str) -> Callable[[], float]:
        """Return what reads a quantity. Raises KeyError for one that there is not."""
        problem = self._problem
        for quantities, row in ((problem.states, self._y[0]), (problem.discretes, self._z[0])):
            for k, quantity in enumerate(quantities):
                if quantity.name == name:
                    return _at(row.item, k)
        if name in self._places:
            return _at(self._inputs_now.item, self._places[name])
        for k, quantity in enumerate(problem.inputs):
            if quantity.name == name:
                return _at(lambda at: float(inputs_at(self._case, self.time)[at]), k)
        for k, quantity in enumerate(problem.outputs):
            if quantity.name == name:
                return _at(lambda at: float(self.y[at]), k)
        known = [q.name for q in (*problem.states, *problem.outputs, *problem.inputs, *problem.discretes)]
        raise KeyError(f"there is no '{name}'{suggest(name, known)}")

    def __setitem__(self, name: str, value: float) -> None:
        k = self._places.get(name)
        if k is None:
            if name in self._as_they_are and value == self[name]:
                return
            raise self._not_settable(name)
        if not math.isfinite(value):
            raise SimulationError(f"the input '{name}' is a finite number, not {value}")
        if name in self._bounded:
            check_input(self._bounded[name], value)
        self._inputs_now[k] = value

    def _not_settable(self, name: str) -> SimulationError:
        problem = self._problem
        names = [quantity.name for quantity in problem.inputs]
        if name not in names:
            return SimulationError(f"'{name}' is not an input (inputs: {', '.join(names) or 'none'})")
        k = names.index(name)
        if k in {i for own, more in derived(problem).items() for i in (own, *more)}:
            return SimulationError(
                f"the input '{name}' drives a coordinate, which cannot be elsewhere at once"
            )
        if k in problem.held_inputs:
            return SimulationError(
                f"the equations take the rate of the input '{name}' to be zero, so it stays as it is while they run"
            )
        return SimulationError(f"the input '{name}' is a function of time or a table, so it cannot be set")


def _at(read: Callable[[int], float], k: int) -> Callable[[], float]:
    return lambda: read(k)
