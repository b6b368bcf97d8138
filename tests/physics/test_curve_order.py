"""The order of the elements, and further classical problems against closed forms and quadratures."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import mpmath as mp
import pytest

import mechc
from mechc.runtime.curves.posed import pose
from mechc.runtime.curves.search import search

mp.mp.dps = 30

RAY = """
model Ray
  dimensionless;
  independent x from -0.5 to 0.5;
  coordinate y ~ 1;
  initial y = 1;
  final y = 1;
  stationary integral((1 + y)*sqrt(1 + der(y)^2));
end Ray;
"""

TUNNEL = """
model Tunnel
  dimensionless;
  independent phi from -0.5 to 0.5;
  coordinate r ~ 0.8 + 0.8*phi^2;
  initial r = 1;
  final r = 1;
  stationary integral(sqrt((der(r)^2 + r^2)/(1 - r^2)));
end Tunnel;
"""

TORUS = """
model Torus
  dimensionless;
  independent u from 0 to 0.2;
  coordinate v ~ 4*u;
  initial v = 0;
  final v = 0.8;
  stationary integral(sqrt((2 + cos(v))^2 + der(v)^2));
end Torus;
"""


def ray() -> float:
    """In n = 1 + y light goes along a catenary about y = -1."""
    c = mp.findroot(lambda c: c * mp.cosh(mp.mpf("0.5") / c) - 2, 1.9)
    return float(c / 2 + c**2 / 2 * mp.sinh(1 / c))


def torus() -> float:
    """Clairaut: R^2 du/ds = c, with R = 2 + cos(v)."""

    def radius(v: mp.mpf) -> mp.mpf:
        return 2 + mp.cos(v)

    def turn(c: mp.mpf) -> mp.mpf:
        return mp.quad(
            lambda v: c / (radius(v) * mp.sqrt(radius(v) ** 2 - c**2)), [0, mp.mpf("0.8")]
        ) - mp.mpf("0.2")

    c = mp.findroot(turn, (1, 2.4), solver="anderson")
    return float(mp.quad(lambda v: radius(v) / mp.sqrt(radius(v) ** 2 - c**2), [0, mp.mpf("0.8")]))


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        pytest.param(RAY, ray, id="light in a gradient"),
        # a hypocycloid through a uniform ball: sqrt(turn (2 pi - turn)), which begins and ends vertically
        pytest.param(TUNNEL, lambda: math.sqrt(2 * math.pi - 1), id="tunnel through the earth"),
        pytest.param(TORUS, torus, id="geodesic of a torus"),
    ],
)
def test_a_further_classical_problem(text: str, exact) -> None:  # type: ignore[no-untyped-def]
    found = mechc.loads(text).solve()
    error = abs(found.stationary - exact())
    assert error <= 1e-9 * exact()
    assert error <= 30 * found.error
    assert found.kind == "minimum"


@pytest.mark.parametrize("degree", [4, 5])
def test_values_converge_with_twice_the_degree(degree: int) -> None:
    """A stationary value has the square of the error of the curve's slope, which is of the order of the degree."""
    posed = pose(mechc.loads(RAY.replace("1 + y)", "y)").replace("1;", "0.8;")).problem(), {}, None, None)
    c = mp.findroot(lambda c: c * mp.cosh(mp.mpf("0.5") / c) - mp.mpf("0.8"), 0.6)
    exact = float(c / 2 + c**2 / 2 * mp.sinh(1 / c))
    errors = [abs(search(posed, degree=degree, adapt=False, elements=n).value - exact) for n in (1, 2, 4)]
    orders = [math.log2(a / b) for a, b in itertools.pairwise(errors)]
    assert orders[-1] == pytest.approx(2 * degree, abs=0.8)


def test_an_elastic_band_under_a_load() -> None:
    """U60: the tension T along the band is k (S - S0); T sin(angle) grows by the load, so that two quadratures remain."""
    load = mp.mpf(3)

    def carried(x: mp.mpf) -> mp.mpf:
        return load * (x + x**2 / 2)

    def slope(x: mp.mpf, v: mp.mpf, t: mp.mpf) -> mp.mpf:
        return (v + carried(x)) / mp.sqrt(t**2 - (v + carried(x)) ** 2)

    def off(v: mp.mpf, t: mp.mpf) -> list[mp.mpf]:
        length = mp.quad(lambda x: mp.sqrt(1 + slope(x, v, t) ** 2), [0, 1])
        return [mp.quad(lambda x: slope(x, v, t), [0, 1]) - mp.mpf("0.2"), 50 * (length - 1) - t]

    v, t = mp.findroot(off, (-1.5, 4.2))
    work = carried(mp.mpf(1)) * mp.mpf("0.2") - mp.quad(lambda x: carried(x) * slope(x, v, t), [0, 1])
    exact = float(t**2 / 100 + work)
    found = mechc.load(Path(__file__).parents[2] / "examples" / "curves" / "rubber_band.mech").solve()
    assert abs(found.stationary - exact) <= 30 * found.error <= 1e-9 * exact
    assert found.outputs["length"] == pytest.approx(float(1 + t / 50), rel=1e-12)
