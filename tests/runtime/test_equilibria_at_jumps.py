"""Equilibria on surfaces where forces jump through zero, against balances by hand."""

from __future__ import annotations

import pytest

import mechc
from mechc.runtime.studies.kinds.equilibria import FoundEquilibria


def values(text: str) -> list[dict[str, float]]:
    found = mechc.loads(text).study("equilibria")
    assert isinstance(found, FoundEquilibria)
    return [one["values"] for one in found.equilibria]


VALLEY = """
coordinate Length x = 1 m;
coordinate Length y = 1 m;
kinetic 1/2*1 kg*der(x)^2 + 1/2*2 kg*der(y)^2;
potential {k} N*abs(x - 0.2 m) + 1/2*4 N/m*(x - y)^2 + 1/2*1 N/m*y^2;
force {load} N on x;
"""


def test_a_valley_holds_what_pushes_less() -> None:
    """None was found. At x = 0.2 m the springs in series, 4 and 1 N/m, pull with 0.16 N: y = 0.16 m."""
    (found,) = values(VALLEY.format(k=3, load=1))
    assert found == pytest.approx({"x": 0.2, "y": 0.16}, rel=1e-9)


def test_a_load_beyond_the_jump_moves_it_to_the_slope() -> None:
    """5 N against 3 N: the rest, 2 N, stretches both springs, x = 2/0.8 m = 2.5 m and y = 2 m."""
    (found,) = values(VALLEY.format(k=3, load=5))
    assert found == pytest.approx({"x": 2.5, "y": 2.0}, rel=1e-9)


def test_the_top_of_a_ridge_holds_nothing() -> None:
    """Both sides lead away from it; 0.3 N on each rest where 0.8 N/m x is as much."""
    found = values(VALLEY.format(k=-0.3, load=0))
    assert [one["x"] for one in found] == pytest.approx([-0.375, 0.375], rel=1e-9)


def test_a_relay_holds_its_state() -> None:
    text = "state y = 1; parameter load = {}; equation der(y) = (load + (if y > 0.3 then -1 else 1))/1 s;"
    assert values(text.format(0.4)) == [pytest.approx({"y": 0.3}, rel=1e-9)]
    assert values(text.format(1.4)) == []
