"""The result of a run, as users meet it: it prints its report and draws its picture in the units that it is shown in."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from .display import Display, choose, shown_unit
from .requests.parse_values import UsageMistake
from .runtime.outcome import Told
from .runtime.results.quantities import Display as Unit
from .runtime.results.solution import Motion
from .runtime.results.solution import Solution as Run

if TYPE_CHECKING:
    from .runtime.interface import Scene
    from .runtime.problem import Array
    from .runtime.results.solution import Columns


class Solution(Told, Run):
    """A mapping from names to arrays over ``time``; see ``mechc.runtime.results.solution`` for what it holds.

    ``display``: the units that it is shown in; ``angles``: the unit of angles in pictures; ``swept``: the values of this run in a
    sweep, in SI, which files have as columns. ``viewer`` makes the page of the model as it was asked, ``pictured_again`` the same
    run with what is drawn; the model sets both.
    """

    viewer: Callable[..., Any] | None = None
    pictured_again: Callable[[], Solution] | None = None

    def __init__(
        self,
        motion: Motion,
        display: Display = Display(),  # noqa: B008, a frozen value
        swept: Mapping[str, float | bool | str] = MappingProxyType({}),
    ) -> None:
        super().__init__(motion)
        self.display = display
        self.angles = ""
        self.swept = swept

    def __repr__(self) -> str:
        return f"<mechc solution of {self.model}: {self.outcome.value}, {len(self.time)} times, {len(self)} quantities>"

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, Any]:
        """Return report and picture: the name is IPython's."""
        assert Told.bundler is not None
        return Told.bundler(self)

    def staged(self) -> tuple[Scene, Columns] | None:
        """Return what is drawn and the function that gives its numbers; the run is repeated once where it was made without."""
        if self.problem.scene is None and self.pictured_again is not None:
            self._again = self.pictured_again()
            self.pictured_again = None
        run = self if self._again is None else self._again
        scene, pictured = run.problem.scene, run.motion.pictured
        return None if scene is None or pictured is None else (scene, pictured)

    _again: Solution | None = None

    def view(self, *, recorded: bool = False, height: int = 640) -> Any:
        """Return the page on which this motion moves, to be shown in a notebook, saved or opened.

        Its sliders integrate again, unless it is ``recorded``: of one motion, without the model.
        """
        if self.viewer is None:
            help = "model.view() shows the page of a model"
            raise UsageMistake("this motion does not know its model", help)
        return self.viewer(recorded=recorded, height=height)

    def shown_in(self, units: str) -> Self:
        """Return the same solution shown in other units: ``"deg,mm"``."""
        other = copy(self)
        other.display = choose(units)
        return other

    def in_picture(self) -> Self:
        """Return the same run in the units of pictures: with angles as the text of the model writes them."""
        return self if self.display.chosen or not self.angles else self.shown_in(self.angles)

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

    def shown_unit(self, name: str, si: str | None = None) -> tuple[str, float]:
        """Return the unit that a quantity is shown in, and the factor from SI to it (``display.py``)."""
        return shown_unit(self.display, self.quantities, name, self.unit(name) if si is None else si)

    def shown(self, name: str) -> Array:
        """Return the values of a quantity in the unit that it is shown in."""
        return self[name] * self.shown_unit(name)[1]

    def plot(
        self,
        path: str | Path | None = None,
        *,
        names: Sequence[str] = (),
        display: str | None = None,
        ax: Any = None,
        style: str = "",
    ) -> Any:
        """Draw coordinates, phase portraits, paths and energies; return the Matplotlib figure.

        ``path`` writes the picture (png, pdf, svg); a text without such an ending names quantities, as ``names`` does, which limits
        the picture to them: "r:theta" draws theta over r. ``display`` names units, "deg,mm"; ``style="paper"`` is for print. With ``ax``
        (one of Matplotlib's axes, or one for each diagram of ``names``) it draws there and returns these. Raises KeyError for a name
        that there is not.
        """
        assert Told.drawer is not None
        return Told.drawer(self.shown_in(display) if display else self, path, ax, style, names)
