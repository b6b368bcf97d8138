"""The result of a run, as users meet it: it prints its report and draws its picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .display import choose
from .requests.parse_values import UsageMistake
from .shown import ShownSolution

if TYPE_CHECKING:
    from .runtime.interface import Scene
    from .runtime.results.solution import Columns


class Solution(ShownSolution):
    """A mapping from names to arrays over ``time``; see ``mechc.runtime.results.solution`` for what it holds.

    ``viewer`` makes the page of the model as it was asked, ``pictured_again`` the same run with what is drawn; the
    model sets both.
    """

    viewer: Callable[..., Any] | None = None
    pictured_again: Callable[[], Solution] | None = None

    def __repr__(self) -> str:
        return f"<mechc solution of {self.model}: {self.outcome.value}, {len(self.time)} times, {len(self)} quantities>"

    def __str__(self) -> str:
        """The report of the run, as ``mechc run`` prints it."""
        from .presentation.report import report

        return report(self)

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, Any]:
        """Return report and picture: the name is IPython's."""
        from .presentation.bundles import solution_bundle

        return solution_bundle(self)

    def staged(self) -> tuple[Scene, Columns] | None:
        """Return what is drawn and the function that gives its numbers; the run is repeated once where it was made without."""
        if self.problem.scene is None and self.pictured_again is not None:
            self._again = self.pictured_again()
            self.pictured_again = None
        return super().staged() if self._again is None else self._again.staged()

    _again: Solution | None = None

    def view(self, *, recorded: bool = False, height: int = 640) -> Any:
        """Return the page on which this motion moves, to be shown in a notebook, saved or opened.

        Its sliders integrate again, unless it is ``recorded``: of one motion, without the model.
        """
        if self.viewer is None:
            help = "model.view() shows the page of a model"
            raise UsageMistake("this motion does not know its model", help)
        return self.viewer(recorded=recorded, height=height)

    def shown_in(self, units: str) -> Solution:
        """Return the same solution shown in other units: ``"deg,mm"``."""
        other = copy(self)
        other.display = choose(units)
        return other

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
        from .presentation import plots
        from .presentation.axes import figure_of, is_picture
        from .requests.question import names_in

        solution = self.shown_in(display) if display else self
        if path is not None and not is_picture(Path(path)):
            if isinstance(path, Path):
                raise UsageMistake(
                    f"'{path}' has no ending of a picture", "pictures end in .png, .pdf or .svg"
                )
            names, path = [*names_in(path), *names], None
        made = (
            plots.figure(solution, names, style)
            if ax is None
            else plots.draw_into(ax, solution, names, style)
        )
        if path is not None:
            (made if ax is None else figure_of(ax)).savefig(path)
        return made
