"""What all rooms share: rank, Newton's method, continuation, against closed forms."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from mechc.runtime.numerics.continuation import Reached, follow, located
from mechc.runtime.numerics.newton import added, newton
from mechc.runtime.numerics.rank import POSITIONS, decomposed, independent_rows, null_space, rank, solve
from mechc.runtime.numerics.roots import root
from mechc.runtime.problem import Array


def arctangent(x: Array) -> tuple[Array, float]:
    """Return the step to the zero of atan: from |x| > 1.3917 whole steps lead away."""
    step = -np.arctan(x) * (1 + x**2)
    return step, float(np.abs(step).max())


def test_newtons_method_bounded_and_damped() -> None:
    start = np.array([3.0])
    assert not newton(start, arctangent, added, most=6).converged
    bounded = newton(start, arctangent, added, most=20, close=1e-12, longest=1.0)
    assert bounded.converged and bounded.at[0] == pytest.approx(0.0, abs=1e-15)
    damped = newton(
        start, arctangent, added, most=20, close=1e-12,
        accepted=lambda at, _, after, __: abs(after[0]) < abs(at[0]),
    )  # fmt: skip
    assert damped.converged and damped.at[0] == pytest.approx(0.0, abs=1e-15)


def test_newtons_method_rests_on_rounding() -> None:
    """Of x^2 = 2, with rounding of 1e-9: steps end no shorter than that, and the best place is given."""
    signs = itertools.cycle((1.0, -1.0))

    def step(x: Array) -> tuple[Array, float]:
        found = -(x**2 - 2 + 1e-9 * next(signs)) / (2 * x)
        return found, float(np.abs(found).max())

    found = newton(np.array([1.0]), step, added, most=50, resting=1e-6)
    assert found.converged and found.at[0] == pytest.approx(math.sqrt(2), abs=1e-9)
    assert newton(np.array([1.0]), step, added, most=50, resting=1e-12).why == "too many steps"
    assert newton(np.array([1.0]), lambda _: "a pole", added, most=5).why == "a pole"


def test_what_is_all_rounding_has_no_rank() -> None:
    rounding = 1e-17 * np.array([[1.0, 2.0], [3.0, 5.0]])
    assert rank(rounding, POSITIONS) == 2 and rank(rounding, POSITIONS, size=1.0) == 0
    assert null_space(rounding, POSITIONS, size=1.0).shape == (2, 2)
    assert decomposed(np.zeros((0, 3))).null_space(POSITIONS).shape == (3, 3)


def test_shortest_solution_and_independent_rows() -> None:
    assert solve(np.array([[1.0, 1.0], [2.0, 2.0]]), np.array([2.0, 4.0])) == pytest.approx([1.0, 1.0])
    rows = np.array([[1.0, 0.0, 1.0], [2.0, 0.0, 2.0 + 1e-12], [0.0, 1e-6, 0.0], [np.nan, 0.0, 0.0]])
    assert independent_rows(rows, 1e-9) == [0, 2]
    assert independent_rows(rows, 1e-9, np.full(4, 1e-5)) == [0]


def test_a_branch_is_followed_to_its_end() -> None:
    """Round the unit circle from one quarter to the next: steps are halved where they are longer than 0.03, and grow to 0.05."""
    tried: list[float] = []

    def advance(points: list[float], length: float) -> Reached[float] | None:
        tried.append(length)
        if length > 0.03 and points[-1] > 1:
            return None
        at = points[-1] + length
        return Reached([min(at, math.pi / 2)], 1.5, "the quarter ends" if at >= math.pi / 2 else "")

    points, why = follow([0.0], advance, most=200)
    assert why == "the quarter ends" and points[-1] == math.pi / 2
    assert max(tried) == 0.05 and max(np.diff([p for p in points if p > 1.0])) <= 0.03
    assert follow([0.0], lambda *_: None, most=9, what="orbit") == ([0.0], "no further orbit is found")
    assert follow([0.0], lambda p, h: Reached([p[-1] + h]), most=3)[1] == "3 points are enough"


def test_where_a_test_changes_its_sign() -> None:
    assert located(lambda x: x, math.cos, 0.0, 2.0, 1e-14) == pytest.approx(math.pi / 2, abs=1e-14)
    assert located(lambda x: x, lambda x: math.copysign(1.0, x - 0.3), 0.0, 1.0, 1e-9) == pytest.approx(
        0.3, abs=1e-9
    )
    assert located(lambda x: None if x == 2.0 else x, math.cos, 0.0, 2.0, 1e-14) is None
    assert located(lambda x: x, math.cos, 0.0, 1.0, 1e-14) is None
    assert root(lambda x: x**3, -1.0, 2.0) == pytest.approx(0.0, abs=1e-6)
