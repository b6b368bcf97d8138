"""What happens in a run with events, for tests that know when it should."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from gallery import Array, Solution, run
from scipy.integrate import solve_ivp

TIGHT = 1e-12
"""Tolerance of runs whose event times are known to ten digits."""

DIGITS = 30
"""Of closed forms whose roots are squared away."""


def follow(
    example: str, experiment: str | None = None, *, tolerance: float = TIGHT, **options: Any
) -> Solution:
    """Run an example and demand that its energy balance closes, to 100 times the tolerance."""
    solution = run(example, experiment, tolerance=tolerance, **options)
    balance = solution.accuracy.energy
    assert balance is not None
    drift = balance.absolute if balance.relative is None else balance.relative  # None: nothing has moved
    assert drift <= 100 * tolerance, balance
    return solution


def times(solution: Solution, kind: str, name: str | None = None) -> list[float]:
    """Times of the events of a kind, of all or of those with a name."""
    return [e.time for e in solution.events if e.kind == kind and name in (None, e.name)]


def travel_time(squared_speed: Callable[[Any], Any], start: Any, end: Any) -> Any:
    """Time from one place to another, where the square of the speed is a known function of the place.

    Turning points may be at the ends: the quadrature is made for roots there. They must be known to twice the digits
    of the time; see ``turning_point``.
    """
    with mpmath.workdps(DIGITS):
        return abs(mpmath.quad(lambda x: 1 / mpmath.sqrt(abs(squared_speed(x))), [start, end]))


def turning_point(squared_speed: Callable[[Any], Any], inside: float, outside: float) -> Any:
    """The zero of the square of the speed between two places, to many digits."""
    with mpmath.workdps(DIGITS):
        return mpmath.findroot(squared_speed, (inside, outside), solver="anderson", tol=1e-55)


def integrate(
    rhs: Callable[[float, Array], Any],
    y: Any,
    t: float,
    end: float,
    surface: Callable[[float, Array], float] | None = None,
) -> tuple[float, Array, bool]:
    """Integrate equations written by hand until a surface is crossed downwards, or to the end.

    Returns time, state, and whether the surface was met.
    """
    found = None
    if surface is not None:
        chosen = surface

        def found(t: float, y: Array) -> float:
            return chosen(t, y)

        vars(found).update(terminal=True, direction=-1)
    done = solve_ivp(rhs, (t, end), y, method="DOP853", rtol=1e-13, atol=1e-15, events=found)
    assert done.success
    return float(done.t[-1]), np.asarray(done.y[:, -1]), done.status == 1
