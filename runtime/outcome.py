"""How a run ends, and how a failure is told."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar

from msgspec import Struct

from .interface import Origin
from .problem import Array, Problem

SINGULAR_MASS = "singular mass matrix"
"""The kind of a failure: nothing has inertia along some motion, which the constraints decide all the same."""

AT_SINGULAR_POSITIONS = ("off constraints", "step too small", "not converged", SINGULAR_MASS)
"""Kinds of failures with which a run ends where constraints become dependent, or the mass matrix singular."""

LISTED = 6
"""Coordinates that a message names."""


class Outcome(Enum):
    """How a run ends, the better one first. Doubtful: it reached its end, and a check contradicts its estimated error."""

    COMPLETED = "completed"
    TERMINATED = "terminated"
    DOUBTFUL = "doubtful"
    FAILED = "failed"
    INTERRUPTED = "interrupted"


ENDED = (Outcome.COMPLETED, Outcome.TERMINATED, Outcome.DOUBTFUL)
"""Outcomes of runs that reached their end."""


def worst(outcomes: Iterable[Outcome]) -> Outcome:
    """Return the worst of some outcomes; of none, completed."""
    order = list(Outcome)
    return max(outcomes, key=order.index, default=Outcome.COMPLETED)


class Told:
    """An answer that prints and draws itself: who shows answers sets ``teller``, ``drawer`` and, for notebooks, ``bundler``; data know
    no words of their own."""

    teller: ClassVar[Callable[[Any], str] | None] = None
    drawer: ClassVar[Callable[..., Any] | None] = None
    bundler: ClassVar[Callable[[Any], dict[str, Any]] | None] = None

    def __str__(self) -> str:
        return Told.teller(self) if Told.teller is not None else repr(self)

    def plot(self, path: str | Path | None = None, *, ax: Any = None, style: str = "") -> Any:
        """Draw the answer; return the Matplotlib figure, or the axes ``ax`` where they are given (one, or one for each diagram).

        ``path`` writes the picture (png, pdf, svg); ``style="paper"`` is for print. Raises SimulationError where there is nothing to
        draw.
        """
        if Told.drawer is None:
            raise RuntimeError("nothing here draws: import mechc")
        return Told.drawer(self, path, ax, style)


class SimulationError(Exception):
    """A run that cannot begin as it was asked for: an unknown name, no stop time, a value out of its range."""

    def __init__(
        self,
        message: str,
        origin: Origin | None = None,
        *,
        code: str = "",
        notes: tuple[str, ...] = (),
        help: str = "",
    ) -> None:
        super().__init__(message)
        self.message = message
        self.origin = origin
        self.code = code
        self.notes = notes
        self.help = help

    def __str__(self) -> str:
        return f"{self.message}; {self.help}" if self.help else self.message


TOO_MANY_STEPS = "too many steps"
"""The kind of a failure: more steps than the caller allows."""


class Failure(Struct, frozen=True):
    """Why a run stopped early. ``name`` is the offending quantity, "" for an assertion; ``state`` the last
    one that was reached, at ``time``."""

    kind: str
    """not finite, step too small, assertion, not converged, off constraints, singular mass matrix, out of reach, too many steps,
    given up"""
    time: float
    name: str
    message: str
    origin: Origin | None
    state: Mapping[str, float]


def time_text(problem: Problem, time: float) -> str:
    unit = f" {problem.time.unit}" if problem.time.unit else ""
    return f"t = {time:.10g}{unit}"


def derivative_text(problem: Problem, index: int) -> str:
    """Name the time derivative of a state: "the acceleration of 'theta'"."""
    name = problem.states[index].name
    if index < problem.nq:
        return f"the rate of '{name}'"
    if index < problem.nq + problem.nv and name.startswith("der("):
        base, _, component = name.removeprefix("der(").partition(")")
        return f"the acceleration of '{base}{component}'"
    return f"the derivative of '{name}'"


def value_text(value: float) -> str:
    return "not a number" if math.isnan(value) else "infinite"


def state_at(problem: Problem, y: Array) -> dict[str, float]:
    return {quantity.name: float(value) for quantity, value in zip(problem.states, y, strict=True)}


def not_finite(problem: Problem, index: int, value: float, time: float, y: Array) -> Failure:
    message = f"{derivative_text(problem, index)} is {value_text(value)} at {time_text(problem, time)}"
    quantity = problem.states[index]
    return Failure("not finite", time, quantity.name, message, quantity.origin, state_at(problem, y))


def step_too_small(problem: Problem, index: int, time: float, y: Array) -> Failure:
    quantity = problem.states[index]
    message = (
        f"the step became too small at {time_text(problem, time)}: the motion is singular there, "
        f"or the tolerance is below what rounding allows; '{quantity.name}' changes fastest"
    ) + (f", with {configuration(problem, y)}" if problem.constraints else "")
    return Failure("step too small", time, quantity.name, message, quantity.origin, state_at(problem, y))


def no_series(problem: Problem, index: int, time: float, y: Array) -> Failure:
    quantity = problem.states[index]
    message = (
        f"{derivative_text(problem, index)} has no Taylor series at {time_text(problem, time)}, as where it holds the root or another "
        "power of what is zero there, such as a speed at rest: 'dop853' and 'radau5' go on from there"
    )
    return Failure("no series", time, quantity.name, message, quantity.origin, state_at(problem, y))


def assertion_failed(problem: Problem, index: int, time: float, y: Array) -> Failure:
    assertion = problem.assertions[index]
    message = f"assertion failed at {time_text(problem, time)}: {assertion.message}"
    return Failure("assertion", time, "", message, assertion.origin, state_at(problem, y))


def not_converged(problem: Problem, time: float, y: Array) -> Failure:
    message = (
        f"the equations of an implicit step could not be solved at {time_text(problem, time)}: "
        "a smaller step may help, or the motion is singular there"
    )
    return Failure("not converged", time, "", message, None, state_at(problem, y))


def off_constraints(problem: Problem, time: float, y: Array) -> Failure:
    at = time_text(problem, time)
    message = (
        f"the constraints can no longer be satisfied at {at}: the mechanism is locked or singular there, "
        f"with {configuration(problem, y)}"
    )
    return Failure("off constraints", time, "", message, None, state_at(problem, y))


def velocities_jump(problem: Problem, time: float, y: Array) -> Failure:
    at = time_text(problem, time)
    message = (
        f"the constraints of velocities would have to change the velocities at once near {at}, which no force does: "
        f"they depend on each other there and not beside it, with {configuration(problem, y)}; begin with velocities "
        "that fit beside it, or write an impact as an event"
    )
    return Failure("velocities jump", time, "", message, None, state_at(problem, y))


def configuration(problem: Problem, y: Array) -> str:
    """List the coordinates, the first ``LISTED`` of many."""
    shown = [
        f"{q.name} = {value:.6g}" + (f" {q.unit}" if q.unit else "")
        for q, value in zip(problem.states[: problem.nq], y, strict=False)
    ]
    more = len(shown) - LISTED
    return ", ".join(shown[:LISTED] + ([f"and {more} more"] if more > 0 else []))


def too_many_steps(problem: Problem, count: int, time: float, y: Array) -> Failure:
    message = f"{count} steps were taken at {time_text(problem, time)}, more are not allowed"
    return Failure(TOO_MANY_STEPS, time, "", message, None, state_at(problem, y))


def given_up(problem: Problem, seconds: float, evaluations: int, time: float, y: Array) -> Failure:
    message = f"given up after {seconds:.2g} s and {evaluations} evaluations, at {time_text(problem, time)}"
    return Failure("given up", time, "", message, None, state_at(problem, y))
