"""Conjugate points, and curves that jump and are lower, against closed forms."""

from __future__ import annotations

from pathlib import Path

import mpmath as mp
import pytest

import mechc

FILM = Path(__file__).parents[2] / "examples" / "curves" / "soap_film.mech"

OSCILLATOR = """
model Oscillator
  dimensionless;
  parameter T = 7;
  independent t from 0 to T;
  coordinate x ~ 1 - 0.5*t/T;
  initial x = 1;
  final x = 0.5;
  lagrangian 1/2*der(x)^2 - 1/2*x^2;
end Oscillator;
"""


@pytest.fixture(scope="module")
def film() -> mechc.Model:
    return mechc.load(FILM)


@pytest.mark.parametrize(("time", "count"), [(3, 0), (4, 1), (7, 2)])
def test_after_each_half_turn_of_an_oscillator_the_action_is_no_longer_least(time: float, count: int) -> None:
    found = mechc.loads(OSCILLATOR).solve(set={"T": time})
    assert found.conjugate_points == pytest.approx([(k + 1) * mp.pi for k in range(count)], abs=1e-9)
    assert found.negative_directions == count


def test_the_deep_film_goes_beyond_its_conjugate_point(film: mechc.Model) -> None:
    """Lindelof: tangents at conjugate points of a catenary meet on its axis, u - coth(u) is the same."""
    deep = film.solve(experiment="deep")
    c = mp.mpf(deep.outputs["waist"])
    u = mp.mpf(-0.5) / c
    conjugate = mp.findroot(lambda v: v - mp.coth(v) - u + mp.coth(u), 0.6)
    assert deep.conjugate_points == pytest.approx([float(c * conjugate)], abs=1e-9)
    assert film.solve(experiment="shallow").conjugate_points == []


@pytest.mark.parametrize(
    ("distance", "told"), [(0.5, False), (0.52769735, False), (0.52769745, True), (0.6, True)]
)
def test_two_discs_are_told_where_they_are_less_than_the_film(
    film: mechc.Model, distance: float, told: bool
) -> None:
    """U64: Goldschmidt's discs have 2 pi, and the film more beyond b = 0.5276974."""
    found = film.solve(experiment="shallow", set={"b": distance})
    remarks = [r for r in found.remarks if "jumps" in r]
    assert bool(remarks) is told is (found.stationary > 2 * mp.pi)
    assert all("the lower value 6.28318531" in r and "r from 1 to 0" in r for r in remarks)
