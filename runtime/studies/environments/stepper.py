"""A run that the caller takes on piece by piece, with inputs that change between two pieces: an environment without a period."""

from __future__ import annotations

import math

from msgspec.structs import replace

from ...case import SimulationOptions
from ...outcome import SimulationError, time_text
from ...problem import Problem
from .environment import Environment
from .environments import Saved, Wishes

MAX_STEPS = 1_000_000
"""Steps of the integrator that one ``step`` takes, if the caller sets no bound: about a second of a small model."""


class Stepper:
    """``step(until)`` goes on to a time; ``sim[name]`` reads a state, output, input or discrete variable, in SI.

    ``sim[name] = value`` sets an input from the present time on, if its default depends on no time. ``snapshot`` and
    ``restore`` save and restore everything, bit for bit. Close it, or use it as a context.
    """

    def __init__(self, problem: Problem, options: SimulationOptions, wishes: Wishes) -> None:
        """Begin a run. Raises ``SimulationError``."""
        self._problem = problem
        self._env = Environment(problem, options, replace(wishes, n=1))

    def __enter__(self) -> Stepper:
        return self

    def __exit__(self, *details: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the memory of the run back."""
        self._env.close()

    @property
    def time(self) -> float:
        return self._env.time

    def step(self, until: float, *, max_steps: int = MAX_STEPS, seconds: float = math.inf) -> None:
        """Go on to the time ``until`` [s]. Raises ``SimulationError`` if the run fails on its way or has ended.

        So does a motion that needs more than ``max_steps`` steps of the integrator or ``seconds`` of computing (checked ten
        times a second): then the run stands where it came to, and may be restored or taken on.
        """
        if until < self.time:
            raise SimulationError(f"the run is at {time_text(self._problem, self.time)}, beyond {until:g}")
        self._env.step_to(until, max_steps, seconds)

    def __getitem__(self, name: str) -> float:
        return self._env[name]

    def __setitem__(self, name: str, value: float) -> None:
        self._env[name] = value

    def snapshot(self) -> Saved:
        """Give all that changes during the run."""
        return self._env.save()

    def restore(self, saved: Saved) -> None:
        """Go back to what ``snapshot`` gave, bit for bit."""
        self._env.load(saved)
