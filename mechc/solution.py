"""The result of a run, as users meet it: the runtime's solution with units to show, and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .display import Display, choose, factor
from .runtime.solution import Solution as Run

if TYPE_CHECKING:
    from .runtime.problem import Problem


class Solution(Run):
    """A mapping from names to arrays over ``time``; see ``mechc.runtime.solution`` for what it holds.

    ``problem`` describes the quantities; ``compiled`` says whether it ran as C.
    """

    problem: Problem
    compiled: bool
    display: Display

    @staticmethod
    def of(run: Run, problem: Problem, *, display: Display) -> Solution:
        """Take over what a run gave."""
        solution = Solution.__new__(Solution)
        vars(solution).update(vars(run))
        solution.problem = problem
        solution.compiled = problem.library is not None
        solution.display = display
        return solution

    def plot(
        self, path: str | Path | None = None, *, names: Sequence[str] = (), display: str | None = None
    ) -> Any:
        """Draw coordinates, phase portraits, paths and energies; return the Matplotlib figure.

        ``path`` writes the picture (png, pdf, svg); ``names`` limits it; ``display`` names units, "deg,mm".
        """
        from . import plots

        shown = choose(display) if display else self.display
        if path is None:
            return plots.figure(self, shown, names)
        return plots.save(self, Path(path), shown, names)

    def shown_unit(self, name: str, si: str) -> tuple[str, float]:
        """Return the unit that a quantity is shown in, and the factor from SI to it."""
        quantity = self.quantities.get(name)
        unit = self.display.unit(si, quantity.display if quantity else "")
        return unit, factor(si) / factor(unit)
