"""Curves with known answers: values of what is stationary, each within its estimated error, and what kind of extremum it is."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.optimize import brentq

import mechc
from mechc.runtime.curves.found import CurveSolution

mpmath.mp.dps = 30

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "curves"

TRUST = 30
"""A true error is at most this many times the estimated one."""


def solve(text: str, **options: Any) -> CurveSolution:
    found: CurveSolution = mechc.loads(text).solve(**options)
    return found


def example(name: str, **options: Any) -> CurveSolution:
    found: CurveSolution = mechc.load(EXAMPLES / f"{name}.mech").solve(**options)
    return found


def near(value: float, exact: float, claimed: float) -> None:
    """The true error is below 1e-9 of the value, and not far above what was claimed."""
    error = abs(value - exact)
    assert error <= 1e-9 * abs(exact)
    assert error <= TRUST * claimed, (error, claimed)


def test_a_hanging_line_of_given_length() -> None:
    """U61: a catenary with c = 0.3082365 and the sag 0.5026333."""
    c = float(mpmath.findroot(lambda c: 2 * c * mpmath.sinh(1 / (2 * c)) - 1.5, 0.3))
    sag = c * (math.cosh(1 / (2 * c)) - 1)
    assert (c, sag) == pytest.approx((0.3082365, 0.5026333), abs=6e-8)
    found = example("clothesline")
    near(found.outputs["sag"], sag, found.output_errors["sag"])
    near(found.outputs["lambda"], 10 * (sag + c), found.output_errors["lambda"])
    assert found.multipliers["length"] == found.outputs["lambda"]
    assert (found.kind, found.negative_directions) == ("minimum", 0)
    value, drift = found.first_integrals["energy"]
    assert drift < 1e-10 * abs(value)


def cycloid(a: float, phi: Any) -> tuple[Any, Any]:
    """Along and down."""
    return a * (phi - mpmath.sin(phi)), a * (1 - mpmath.cos(phi))


def test_the_curve_of_fastest_descent_begins_steeply() -> None:
    """U59: 0.5828955 s to (1, -1) on the cycloid of a = 0.5729170 to phi = 2.412011; dz/dx = -sqrt((2 a + z)/(-z)), which is
    1/sqrt(-z) near the start; 0.6385509 s on the straight line."""
    phi = mpmath.findroot(lambda t: (t - mpmath.sin(t)) / (1 - mpmath.cos(t)) - 1, 2.4)
    a = 1 / (1 - mpmath.cos(phi))
    exact = float(mpmath.sqrt(a / mpmath.mpf("9.81")) * phi)
    assert [float(phi), float(a), exact] == pytest.approx([2.412011, 0.5729170, 0.5828955], abs=5e-7)
    found = example("brachistochrone")
    near(found.stationary, exact, found.error)
    assert found.stationary == pytest.approx(0.5828955, abs=5e-8)
    assert found.kind == "minimum"
    for share in (0.05, 0.2, 0.5, 0.8, 0.99):
        along, down = map(float, cycloid(a, share * phi))
        place = found(down)
        assert place["x"] == pytest.approx(along, abs=1e-8)
        assert place["der(x)"] == pytest.approx(math.sqrt(down / (2 * float(a) - down)), rel=1e-7)
    steep = [1 / found(down)["der(x)"] for down in (1e-3, 4e-3)]
    assert steep == pytest.approx([math.sqrt(2 * a / down) for down in (1e-3, 4e-3)], rel=2e-3)
    assert steep[0] / steep[1] == pytest.approx(2, rel=2e-3)
    straight = mechc.loads("""dimensionless;
      coordinate s = 0;
      kinetic 1/2*der(s)^2;
      potential -9.81*s/sqrt(2);
      when s > sqrt(2) then terminate("there"); end when;
      experiment(stop = 2);""").simulate()
    assert float(straight.time[-1]) == pytest.approx(0.6385509, abs=5e-8)


BOTTOM = pytest.param(math.pi, marks=pytest.mark.slow)


@pytest.mark.parametrize("phi", [2.0, BOTTOM])
def test_fastest_descents_along_four_cycloids(phi: float) -> None:
    """U59: the plotted curves, to phi = 2 in 2 sqrt(a/g) and to (pi a, -2 a), where they are level, in pi sqrt(a/g)."""
    for a in (0.5, 1, 1.5, 2):
        along, down = map(float, cycloid(a, mpmath.mpf(phi)))
        found = example("brachistochrone", set={"along": along, "down": down})
        near(found.stationary, phi * math.sqrt(a / 9.81), found.error)
        middle = tuple(map(float, cycloid(a, mpmath.mpf(phi) / 2)))
        assert found(middle[1])["x"] == pytest.approx(middle[0], abs=1e-7)


@pytest.mark.parametrize(
    ("experiment", "guess", "negative", "stated"),
    [("shallow", 0.85, 0, 5.991797), ("deep", 0.235, 1, 6.845655)],
)
def test_both_soap_films(experiment: str, guess: float, negative: int, stated: float) -> None:
    """U64: 5.991797 and 6.845655 at b = 0.5, r = (1/alpha) cosh(alpha z)."""
    c = mpmath.findroot(lambda c: c * mpmath.cosh(mpmath.mpf("0.5") / c) - 1, guess)
    exact = float(2 * mpmath.pi * c * (mpmath.mpf("0.5") + c / 2 * mpmath.sinh(1 / c)))
    assert exact == pytest.approx(stated, abs=6e-7)
    found = example("soap_film", experiment=experiment)
    near(found.stationary, exact, found.error)
    assert found["r"] == pytest.approx(float(c) * np.cosh(found.places / float(c)), abs=1e-9)
    near(found.outputs["waist"], float(c), found.output_errors["waist"])
    assert found.negative_directions == negative
    assert found.kind == ("saddle" if negative else "minimum")


def test_light_through_two_media_bends_where_they_meet() -> None:
    """U63: n1 sin(theta1) = n2 sin(theta2)."""
    found = example("fermat")
    c = mpmath.findroot(
        lambda x: 1.5 * x / mpmath.sqrt(1 + x**2) - (1 - x) / mpmath.sqrt(1 + (1 - x) ** 2), 0.4
    )
    exact = 1.5 * mpmath.sqrt(1 + c**2) + mpmath.sqrt(1 + (1 - c) ** 2)
    near(found.stationary, float(exact), found.error)
    near(found.outputs["cross"], float(c), found.output_errors["cross"])
    snell = float(1.5 * c / mpmath.sqrt(1 + c**2))
    assert abs(found["invariant"] - snell).max() < 1e-9  # on either side of the kink, and nowhere between
    slopes = found["der(x)"][abs(found.places) < 1e-9]
    assert slopes == pytest.approx([float(c), float(1 - c)], rel=1e-9)
    assert [*found.first_integrals] == ["momentum(x)"]  # no energy, as n depends on z
    assert found(0.0)["der(x)"] == pytest.approx(float(1 - c), rel=1e-9)


def test_a_step_that_is_passed_unrefracted_is_told() -> None:
    """U63 with the border across x: of 3.31 where 2.65 is right nobody may think that it is stationary."""
    text = """\
model Ray
  dimensionless;
  independent {along} from {low} to {high};
  coordinate {across} ~ {guess};
  initial {across} = {first};
  final {across} = {last};
  stationary integral((if x > 0.3 then 1 else 2)*sqrt(1 + der({across})^2));
end Ray;
"""
    wrong = solve(text.format(along="z", low=-1, high=1, across="x", guess="0.5*z + 0.5", first=0, last=1))
    assert wrong.outcome.value == "doubtful" and any("not stationary" in r for r in wrong.remarks)
    right = solve(text.format(along="x", low=0, high=1, across="z", guess="2*x - 1", first=-1, last=1))
    place = brentq(lambda a: 2 * a / np.hypot(0.3, a) - (2 - a) / np.hypot(0.7, 2 - a), 0, 1, xtol=1e-15)
    near(right.stationary, 2 * np.hypot(0.3, place) + np.hypot(0.7, 2 - place), right.error)
    assert right.outcome.value == "completed" and right.remarks == []


def test_light_bends_through_a_medium_that_changes_with_height() -> None:
    """U63: n(z) sin(theta) = C; for n = 1 + z the ray is x = C (arcosh((1 + z)/C) - arcosh(1/C))."""
    found = solve("""
        model Mirage
          dimensionless;
          independent z from 0 to 1;
          coordinate x ~ z;
          initial x = 0;
          final x = 1;
          stationary integral((1 + z)*sqrt(1 + der(x)^2));
          output invariant = (1 + z)*der(x)/sqrt(1 + der(x)^2);
        end Mirage;
    """)
    C = brentq(lambda c: c * (np.arccosh(2 / c) - np.arccosh(1 / c)) - 1, 0.5, 1, xtol=1e-15)
    assert found["invariant"] == pytest.approx(C, rel=1e-9)
    exact = C * (np.arccosh((1 + found.places) / C) - np.arccosh(1 / C))
    assert found["x"] == pytest.approx(exact, abs=1e-9)


def test_a_geodesic_of_the_half_plane_is_a_circle() -> None:
    """U71: x^2 + y^2 = 2, of the length 2 ln(1 + sqrt(2))."""
    assert 2 * math.log(1 + math.sqrt(2)) == pytest.approx(1.7627472, abs=6e-8)
    found = example("half_plane_geodesic")
    near(found.stationary, 2 * math.log(1 + math.sqrt(2)), found.error)
    assert abs(found["circle"] - 2).max() < 1e-10
