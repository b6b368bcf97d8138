"""What is made of a problem once."""

from __future__ import annotations

import itertools
from collections.abc import Callable

from written_problems import pendulum

from mechc.runtime.memo import MOST, once
from mechc.runtime.problem import Problem


def _count() -> Callable[[Problem], int]:
    """Return a function of a problem that counts its calls."""
    calls = itertools.count(1)
    return lambda problem: next(calls)


def test_is_made_once_for_one_problem_and_again_for_an_equal_one() -> None:
    remember = once(_count())
    first, second = pendulum(), pendulum()
    assert [remember(first), remember(first), remember(second), remember(first)] == [1, 1, 2, 1]


def test_keeps_the_last_ones() -> None:
    remember = once(_count())
    problems = [pendulum() for _ in range(MOST + 1)]
    for problem in problems:
        remember(problem)
    assert remember(problems[-1]) == MOST + 1
    assert remember(problems[0]) == MOST + 2
