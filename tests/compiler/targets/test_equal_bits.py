"""C and scalar Python give the same bits, arrays agree to a few units in the last place."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from differentiable_modules import plain_module
from native_code import Both, bits, random_states
from sample_equations import chain, every_operation, pendulum

from mechc.compiler.equations.model import Equations
from mechc.compiler.program import lower

SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, 3.0, math.inf, -math.inf, math.nan, 1e308, -1e308, 5e-324, 710.0, -2.5]


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> Both:
    return Both(every_operation(), tmp_path_factory.mktemp("everything"))


def test_every_operation_has_equal_bits_at_random_points(everything: Both) -> None:
    for state in random_states(3000, 2):
        everything.compare("everything", state)


def test_every_operation_has_equal_bits_at_special_values(everything: Both) -> None:
    for pair in itertools.product(SPECIAL, SPECIAL):
        everything.compare("everything", list(pair))


def test_undefined_values_are_nan_and_nothing_raises(everything: Both) -> None:
    """sqrt, log, asin and acosh of -2; the result beside them is untouched."""
    out = everything.python["everything"](
        0.0, np.array([-2.0, 1.0]), everything.u, everything.z, everything.p
    )
    assert [math.isnan(out[i]) for i in (3, 10, 13, 14)] == [True] * 4
    assert out[19] == -1.0


def test_a_branch_that_is_not_taken_does_not_matter(everything: Both) -> None:
    """select(a < b, sqrt(a), b/a) at a = 0, and at a < 0 < b."""

    def at(a: float, b: float) -> float:
        y = np.array([a, b])
        return float(everything.python["everything"](0.0, y, everything.u, everything.z, everything.p)[39])

    assert at(0.0, 1.0) == 0.0
    assert at(4.0, 2.0) == 0.5
    assert math.isnan(at(-1.0, 1.0))


MODELS: dict[str, Callable[[], Equations]] = {
    "pendulum": pendulum,
    "double pendulum": lambda: chain(2),
    "chain of 7": lambda: chain(7, joint_angles=True),
}


@pytest.mark.parametrize("name", MODELS)
def test_models_have_equal_bits(name: str, tmp_path: Path) -> None:
    both = Both(MODELS[name](), tmp_path)
    p = np.full_like(both.p, np.nan)
    both.complete(p, np.zeros(len(both.program.arrays["p"]), np.uint8))
    assert bits(p) == bits(both.p)
    for function in both.program.functions:
        for state in random_states(300, both.program.size("y")):
            both.compare(function.name, state)


def test_arrays_agree_to_a_few_units_in_the_last_place(everything: Both) -> None:
    """NumPy's own functions differ from the C library's in the last digits, nothing else may."""
    module = plain_module(everything.program)
    states = random_states(500, 2) + [[a, b] for a in SPECIAL for b in SPECIAL]
    y = np.array(states).T
    with np.errstate(all="ignore"):
        listed = module.everything(0.7, y, everything.u, everything.p)
    found = np.array([np.broadcast_to(value, y.shape[1]) for value in listed], dtype=float)
    assert found.shape == (71, len(states))
    expected = np.array(
        [
            everything.python["everything"](0.7, np.array(s), everything.u, everything.z, everything.p)
            for s in states
        ]
    ).T
    assert np.array_equal(np.isnan(found), np.isnan(expected))
    assert np.array_equal(np.isinf(found), np.isinf(expected))
    finite = np.isfinite(expected)
    distance = np.abs(found[finite] - expected[finite]) / np.spacing(np.abs(expected[finite]))
    assert distance.max() <= 4


def test_a_chain_over_arrays_agrees_to_its_conditioning() -> None:
    """The sum of squares of accelerations, 60 operations deep: 1e-12 relative is 5000 roundings."""
    program = lower(chain(7))
    module = plain_module(program)
    p = module.parameters()
    y = np.array(random_states(50, 14)).T
    found = np.array(module.rhs(0.0, y, (), p))
    expected = np.array([module.rhs(0.0, s, (), p) for s in y.T]).T
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
