"""One motion: the question of a run, with all that may be asked beside it."""

from __future__ import annotations

from ...case import SimulationOptions
from ...problem import Problem
from ...results.solution import Solution
from ..runs.simulate import Run, as_keywords, is_as_stated, run
from ..study import solve


class Simulate(Run, frozen=True, kw_only=True):
    """The motion from the start to the stop. The answer is a ``Solution``."""

    def solve(self, problem: Problem) -> Solution:
        """Run a problem. A run that fails or is interrupted keeps what was computed, and says so in its outcome.

        Raises ``SimulationError`` if it cannot begin; ``CompilerMissing`` and ``BuildError`` if the kernel is
        needed and cannot be built.
        """
        as_stated = is_as_stated(problem, self)
        found = run(
            problem, self, as_stated=as_stated, sensitivity=self.sensitivity, condition=self.condition
        )
        if self.constants:
            from .constants import with_constants  # with scipy

            return with_constants(found, problem, self)
        return found


def simulate(problem: Problem, options: SimulationOptions | None = None) -> Solution:
    """Run a problem: ``Simulate`` with these options."""
    found = solve(problem, Simulate(**as_keywords(options or SimulationOptions())))
    assert isinstance(found, Solution)
    return found
