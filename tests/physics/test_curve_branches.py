"""Curves over a parameter: where they turn back and where their kind changes, against closed forms."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import mpmath as mp
import pytest

import mechc

mp.mp.dps = 30

FILM = Path(__file__).parents[2] / "examples" / "curves" / "soap_film.mech"

ROD = """
model Rod
  dimensionless;
  parameter P = 10;
  independent s from 0 to 1;
  coordinate theta ~ sin(pi*s/2);
  initial theta = 0;
  stationary integral(1/2*der(theta)^2 + P*cos(theta));
  output tip = at(theta, 1);
end Rod;
"""


@pytest.fixture(scope="module")
def film() -> Any:
    return mechc.load(FILM).study("curves", over="b = 0.5 .. 0.8")


@pytest.mark.slow
def test_where_the_soap_film_tears(film: Any) -> None:
    """U64: r = c cosh(z/c): both films become one where x tanh(x) = 1, b = x / cosh(x) = 0.66274342, waist 0.552434; there
    and for some way before it both have more than the 2 pi of two discs."""
    x = mp.findroot(lambda x: x * mp.tanh(x) - 1, 1.2)
    (fold,) = film.special
    assert fold["kind"] == "fold"
    off = abs(fold["parameter"]["b"] - float(x / mp.cosh(x)))
    assert off < 1e-12
    assert off <= 30 * fold["error"]
    assert fold["parameter"]["b"] == pytest.approx(0.66274342, abs=6e-9)
    assert fold["outputs"]["waist"] == pytest.approx(float(1 / mp.cosh(x)), rel=1e-6)
    assert fold["outputs"]["waist"] == pytest.approx(0.552434, abs=6e-7)
    near = [p for p in film.branches[0]["points"] if p["parameter"]["b"] > 0.5277]
    assert {p["negative_directions"] for p in near} == {0, 1}
    assert all(p["stationary"] > 2 * math.pi for p in near)


@pytest.mark.slow
def test_the_minimum_and_the_saddle_are_one_branch(film: Any) -> None:
    (branch,) = film.branches
    directions = [p["negative_directions"] for p in branch["points"]]
    assert set(directions) == {0, 1}
    assert sum(a != b for a, b in itertools.pairwise(directions)) == 1
    for point in branch["points"][::5]:
        b, waist = point["parameter"]["b"], point["outputs"]["waist"]
        assert waist * math.cosh(b / waist) == pytest.approx(1, rel=1e-9)
    assert branch["ends"] == ["the range ends", "the range ends"]


@pytest.mark.slow
def test_where_a_rod_buckles() -> None:
    """The straight rod gains a way down at (pi/2)^2 and another at (3 pi/2)^2, where bent ones leave it."""
    found: Any = mechc.loads(ROD).study("curves", over="P = 1 .. 40")
    assert len(found.branches) == 3
    assert [s["kind"] for s in found.special] == ["fork", "fork"]
    for special, exact in zip(found.special, ((math.pi / 2) ** 2, (3 * math.pi / 2) ** 2), strict=True):
        off = abs(special["parameter"]["P"] - exact)
        assert off < 1e-7
        assert off <= 30 * special["error"]


@pytest.mark.slow
def test_where_a_strut_buckles() -> None:
    """Both ends turn freely and stay level: Euler's load is pi^2. Branches of the strut turned by half and whole turns, too."""
    found: Any = mechc.loads("""
        model Strut
          dimensionless;
          parameter P = 5;
          independent s from 0 to 1;
          coordinate theta ~ cos(pi*s);
          stationary integral(1/2*der(theta)^2 + P*cos(theta));
          constraint level: integral(sin(theta)) = 0;
        end Strut;
    """).study("curves", over="P = 5 .. 15")
    (fork,) = found.special
    assert fork["kind"] == "fork"
    off = abs(fork["parameter"]["P"] - math.pi**2)
    assert off < 1e-7
    assert off <= 30 * fork["error"]


def test_studies_of_motions_and_of_curves_are_told_apart() -> None:
    with pytest.raises(mechc.UsageMistake, match="this study is not asked about it"):
        mechc.load(FILM).study("modes")
    pendulum = mechc.load(FILM.parents[1] / "pendulum.mech")
    with pytest.raises(mechc.UsageMistake, match="this study is asked about curves"):
        pendulum.study("curves", over="l = 1 .. 2")
