"""The result of a run, as users meet it: the runtime's solution with units to show, and pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

from .display import Display, choose, factor
from .runtime.results.quantities import Display as Unit
from .runtime.results.solution import Solution as Run

if TYPE_CHECKING:
    from .runtime.problem import Array, Problem


class TrueError(Struct, frozen=True):
    """Difference from a closed solution: largest and at the end, in SI; ``relative``: largest by the largest value."""

    name: str
    unit: str
    largest: float
    at_end: float
    relative: float


class Solution(Run):
    """A mapping from names to arrays over ``time``; see ``mechc.runtime.results.solution`` for what it holds.

    ``problem`` describes the quantities; ``compiled`` says whether it ran as C.
    """

    problem: Problem
    compiled: bool
    display: Display
    as_stated: bool
    swept: Mapping[str, float | bool | str]

    @staticmethod
    def of(
        run: Run,
        problem: Problem,
        *,
        display: Display,
        as_stated: bool = True,
        swept: Mapping[str, float | bool | str] = MappingProxyType({}),
    ) -> Solution:
        """Take over what a run gave. ``as_stated``: it is the default experiment, with no value changed.

        ``swept``: the values that this run of a sweep has, in SI; they are written into files as columns.
        """
        solution = Solution.__new__(Solution)
        vars(solution).update(vars(run))
        solution.problem = problem
        solution.compiled = problem.library is not None
        solution.display = display
        solution.as_stated = as_stated
        solution.swept = swept
        return solution

    def __repr__(self) -> str:
        return f"<mechc solution of {self.model}: {self.outcome.value}, {len(self.time)} times, {len(self)} quantities>"

    def __str__(self) -> str:
        """The report of the run, as ``mechc run`` prints it."""
        from .presentation.report import report

        return report(self)

    @property
    def true_errors(self) -> tuple[TrueError, ...]:
        """Compare with the closed solutions that the model states; they hold for its default experiment only."""
        if not self.as_stated:
            return ()
        exact = [q for q in self.problem.outputs if q.kind == "exact"]
        return tuple(self._true_error(q.name, q.name.removeprefix("exact(")[:-1], q.unit) for q in exact)

    def _true_error(self, exact: str, name: str, unit: str) -> TrueError:
        difference = np.abs(self[name] - self[exact])
        largest, size = float(difference.max()), float(np.abs(self[exact]).max())
        return TrueError(name, unit, largest, float(difference[-1]), largest / size if size > 0 else largest)

    def summary(self) -> dict[str, Any]:
        """Return the report of the run as plain data, as ``mechc run --json`` prints it."""
        summary = super().summary()
        for name in [name for name in summary["final"] if name.startswith("exact(")]:
            del summary["final"][name]
        if "problem" in vars(self) and self.true_errors:
            summary["accuracy"]["true_error"] = {
                e.name: {"largest": e.largest, "at_end": e.at_end, "relative": e.relative}
                for e in self.true_errors
            }
        return summary

    def columns(
        self, names: Sequence[str] | None = None, display: Unit | None = None
    ) -> dict[str, tuple[str, Array]]:
        """Give unit and values by name, time first, swept parameters last."""
        columns = super().columns(names, display)
        units = {quantity.name: quantity.unit for quantity in self.problem.parameters}
        for name, value in self.swept.items():
            if name not in self and isinstance(value, float | int):
                unit, factor = (
                    display(name, units[name]) if display and name in units else (units.get(name, ""), 1.0)
                )
                columns[name] = (unit, np.full_like(self.time, value * factor))
        return columns

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
        from .presentation import plots

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
