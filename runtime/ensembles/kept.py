"""What is kept of each member of an ensemble."""

from __future__ import annotations

from msgspec import Struct

from ..interface import GROWTH, Quantity
from ..native.kernel import EVENT_KINDS
from ..outcome import SimulationError
from ..problem import Problem

REDUCTIONS = ("final", "max", "min", "mean", "first", "events")
"""In the order of enum mech_kept_kind; what is kept without one is a series: its values at all output times."""

SERIES = "series"
EXPONENT, FACTOR = "lyapunov", "megno"
GROWN = (EXPONENT, FACTOR)
"""What is told by the growth of a change that goes along (compiler/equations/growth.py): the largest Lyapunov exponent, and the factor
that tells chaos from order sooner."""
FLOWING = ("max", "min", "mean", "first")
"""Those that look between the steps."""


class Kept(Struct, frozen=True):
    """``quantity``: a state or an output; of ``first`` an output that becomes positive where its condition becomes true.

    ``event`` and ``row`` of events: a kind and the name of a row, empty for any.
    """

    label: str
    kind: str
    quantity: str = ""
    event: str = ""
    row: str = ""

    def unit(self, problem: Problem) -> str:
        if self.kind == "events":
            return "1"
        if self.kind == FACTOR:
            return "1"
        if self.kind == EXPONENT:
            return f"1/{problem.time.unit}" if problem.time.unit else ""
        return problem.time.unit if self.kind == "first" else quantity_of(problem, self.quantity).unit


def quantity_of(problem: Problem, name: str) -> Quantity:
    """Find an output or a state. Raises SimulationError."""
    for quantity in (*problem.outputs, *problem.states):
        if quantity.name == name:
            return quantity
    raise SimulationError(f"'{problem.name}' has no output or state '{name}'")


def kept_by_default(problem: Problem) -> tuple[Kept, ...]:
    """Keep the final values of coordinates and states where nobody says what to keep."""
    own = [q.name for q in problem.states if q.kind in ("coordinate", "state")]
    return tuple(Kept(f"final({name})", "final", name) for name in own)


def check_kept(problem: Problem, kept: tuple[Kept, ...]) -> None:
    """Raise SimulationError for what the model has not, and for two things of one name."""
    for k, one in enumerate(kept):
        if one.label in (other.label for other in kept[:k]):
            raise SimulationError(f"'{one.label}' is kept twice")
        if one.kind in GROWN:
            check_growth(problem)
            continue
        if one.kind != "events":
            quantity_of(problem, one.quantity)
            continue
        if problem.hybrid is None:
            raise SimulationError(f"'{one.label}' counts events, and '{problem.name}' has none")
        if one.event and one.event not in EVENT_KINDS:
            raise SimulationError(
                f"there is no kind of event '{one.event}'", help=f"there are {', '.join(EVENT_KINDS)}"
            )
        names = [problem.hybrid.row(k).name for k in range(problem.hybrid.n_rows)] if one.row else []
        if one.row and one.row not in names:
            raise SimulationError(
                f"'{problem.name}' has nothing called '{one.row}' that switches",
                help=f"there are {', '.join(dict.fromkeys(names))}" if names else "",
            )


def has_growth(problem: Problem) -> bool:
    """Whether a change goes along with the motion."""
    return bool(problem.states) and problem.states[-1].name == GROWTH


def check_growth(problem: Problem) -> None:
    """Raise SimulationError where no change goes along with the motions of many runs."""
    if has_growth(problem):
        return
    why = "has events, contacts or switches" if problem.hybrid is not None else "has constraints"
    raise SimulationError(
        f"the exponents of many runs are those of smooth motions, and '{problem.name}' {why}",
        help="the study 'lyapunov' with 'over' follows such motions one by one",
    )
