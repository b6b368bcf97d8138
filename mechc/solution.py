"""The result of a run, as users meet it: the runtime's solution with units to show, and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .display import Display, choose, factor
from .runtime.solution import Solution as Run

if TYPE_CHECKING:
    from .runtime.problem import Array, Problem


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

    def shown_in(self, units: str) -> Solution:
        """Return the same solution shown in other units: ``"deg,mm"``."""
        other = copy(self)
        other.display = choose(units)
        return other

    def plot(
        self, path: str | Path | None = None, *, names: Sequence[str] = (), display: str | None = None
    ) -> Any:
        """Draw coordinates, phase portraits, paths and energies; return the Matplotlib figure.

        ``path`` writes the picture (png, pdf, svg); ``names`` limits it; ``display`` names units, "deg,mm".
        """
        from . import plots

        solution = self.shown_in(display) if display else self
        return plots.figure(solution, names) if path is None else plots.save(solution, Path(path), names)

    def shown_unit(self, name: str, si: str | None = None) -> tuple[str, float]:
        """Return the unit that a quantity is shown in, and the factor from SI to it.

        A rate follows its coordinate: where that is shown in deg, its rate is shown in deg/s.
        """
        si = self.unit(name) if si is None else si
        quantity = self.quantities.get(name)
        declared = quantity.display if quantity else ""
        if quantity and not declared and quantity.kind == "rate" and name.startswith("der("):
            base = name.removeprefix("der(").replace(")", "", 1)
            coordinate = self.quantities.get(base)
            if coordinate and coordinate.display and coordinate.unit and si.startswith(f"{coordinate.unit}/"):
                declared = coordinate.display + si.removeprefix(coordinate.unit)
        unit = self.display.unit(si, declared)
        return unit, factor(si) / factor(unit)

    def shown(self, name: str) -> Array:
        """Return the values of a quantity in the unit that it is shown in."""
        return self[name] * self.shown_unit(name)[1]
