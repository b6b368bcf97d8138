"""Loads at single places: momenta leap there, which nothing that is said of the curve may overlook."""

from __future__ import annotations

from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

import mechc

mp.mp.dps = 30

FIXED = Path(__file__).parents[2] / "examples" / "curves" / "loaded_chain.mech"

SLIDING = """
model Sliding "the load is a ring on the chain, guided at x = a"
  parameter w = 10 N/m;
  parameter W = 5 N;
  parameter L = 3 m;
  parameter a = 0.7 m;
  independent x from 0 m to 2 m;
  coordinate z ~ x/4 - x*(2 m - x)/1 m;
  initial z = 0 m;
  final z = 0.5 m;
  stationary integral(w*z*sqrt(1 + der(z)^2)) + W*at(z, a);
  constraint length: integral(sqrt(1 + der(z)^2)) = L;
  output p = der(z)*(w*z + multiplier(length))/sqrt(1 + der(z)^2);
end Sliding;
"""


def fixed() -> tuple[mp.mpf, mp.mpf, mp.mpf]:
    """One horizontal tension H; the vertical one is V + w s, and W more beyond the load. Energy, H, depth of the load."""
    w, load, at, length = 10, 5, 1, 3

    def height(h: mp.mpf, v: mp.mpf) -> mp.mpf:
        return mp.sqrt(h**2 + v**2) / w

    def ends(h: mp.mpf, v: mp.mpf) -> list[mp.mpf]:
        one, two, last = v + w * at, v + w * at + load, v + w * length + load
        wide = h / w * (mp.asinh(one / h) - mp.asinh(v / h) + mp.asinh(last / h) - mp.asinh(two / h))
        return [wide - 2, height(h, one) - height(h, v) + height(h, last) - height(h, two) - mp.mpf("0.5")]

    h, v = mp.findroot(ends, (8, -14))
    low = height(h, v + w * at) - height(h, v)
    two = v + w * at + load
    area = mp.quad(lambda s: height(h, v + w * s) - height(h, v), [0, at])
    area += mp.quad(lambda s: low + height(h, two + w * s) - height(h, two), [0, length - at])
    return w * area + load * low, h, low


def sliding() -> mp.mpf:
    """One tension w (z - z0) on both sides of the ring: two catenaries above the same z0; the vertical one leaps by W."""
    w, load, at, length = 10, 5, mp.mpf("0.7"), 3

    def off(z0: mp.mpf, c: mp.mpf, x: mp.mpf, d: mp.mpf, y: mp.mpf) -> list[mp.mpf]:
        left, right = (at - x) / c, (at - y) / d
        return [
            z0 + c * mp.cosh(x / c),
            z0 + d * mp.cosh((2 - y) / d) - mp.mpf("0.5"),
            c * mp.cosh(left) - d * mp.cosh(right),
            c * (mp.sinh(left) + mp.sinh(x / c)) + d * (mp.sinh((2 - y) / d) - mp.sinh(right)) - length,
            w * (d * mp.sinh(right) - c * mp.sinh(left)) - load,
        ]

    z0, c, x, d, y = mp.findroot(off, (-1.7, 0.85, 1.0, 0.85, 0.6))

    def energy(u: mp.mpf, c: mp.mpf, x: mp.mpf) -> mp.mpf:
        return (z0 + c * mp.cosh((u - x) / c)) * mp.cosh((u - x) / c)

    area = mp.quad(lambda u: energy(u, c, x), [0, at]) + mp.quad(lambda u: energy(u, d, y), [at, 2])
    return w * area + load * (z0 + c * mp.cosh((at - x) / c))


def test_a_load_on_a_chain_of_unequal_heights() -> None:
    found = mechc.load(FIXED).solve()
    exact, h, low = fixed()
    assert abs(found.stationary - exact) <= 30 * found.error <= 1e-9 * abs(exact)
    assert abs(found.outputs["low"] - low) <= 30 * found.output_errors["low"]
    # nothing drives along x; but the load stands at a place of its own, so that there is no energy
    assert [*found.first_integrals] == ["momentum(r[1])"]
    assert found.first_integrals["momentum(r[1])"][0] == pytest.approx(float(h), rel=1e-10)


def test_a_ring_on_a_chain() -> None:
    model = mechc.loads(SLIDING)
    found = model.solve()
    exact = sliding()
    assert abs(found.stationary - exact) <= 30 * found.error <= 1e-9 * abs(exact)
    assert found.first_integrals == {}
    beside = 1e-9
    leap = found(0.7 + beside)["p"] - found(0.7 - beside)["p"]
    assert leap == pytest.approx(5, rel=1e-6)
    assert found(0.4 + beside)["p"] - found(0.4 - beside)["p"] == pytest.approx(0, abs=1e-6)


TIED = """
model Tied "z = y + x^2 at every place, with a load on y"
  dimensionless;
  independent x from 0 to 1;
  coordinate y ~ 0;
  coordinate z ~ x^2;
  initial y = 0;
  final y = 1;
  stationary integral(1/2*der(y)^2 + 1/2*der(z)^2) + at(y, 0.3);
  constraint tie: z = y + x^2;
  output density = 2*multiplier(tie);
end Tied;
"""


def test_the_density_of_a_condition_has_no_part_in_forces_at_places() -> None:
    """2 y'' = -2 and z'' = multiplier, so that it is 1; slopes of z at the ends and its corner take forces at single places."""
    found = mechc.loads(TIED).solve()
    places = np.linspace(0, 1, 41)
    assert found(places)["multiplier(tie)"] == pytest.approx(1, rel=1e-8)
    assert found["density"] == pytest.approx(2, rel=1e-8)
    assert found(0.3)["y"] == pytest.approx(0.3 + 0.3 * 0.7 / 2 - 0.3 * 0.7 / 2, rel=1e-10)


BESIDE_A_ROD = """
model BesideARod "a string with a load and a step of its tension, beside a rod that bends"
  dimensionless;
  independent x from 0 to 1;
  coordinate y ~ 0;
  coordinate z ~ 0;
  initial y = 0;
  final y = 1;
  initial z = 0;
  final z = 1;
  initial der(z) = 0;
  let tension = if x < 0.6 then 1 else 3;
  stationary integral(1/2*tension*der(y)^2 + 1/2*der(z, 2)^2) + at(y, 0.3);
end BesideARod;
"""


def test_a_string_has_corners_beside_a_rod_that_bends() -> None:
    """The force p of the string leaps by 1 at the load: 0.3 (p - 1) + 0.3 p + 0.4 p/3 = 1; the rod is (3 x^2 - x^3)/2, value 3/2."""
    found = mechc.loads(BESIDE_A_ROD).solve()
    p = 1.3 / (0.6 + 0.4 / 3)
    value = 0.3 * (p - 1) ** 2 / 2 + 0.3 * p**2 / 2 + 0.4 * p**2 / 6 + 0.3 * (p - 1) + 1.5
    assert found.stationary == pytest.approx(value, rel=1e-12)
    assert found(0.6)["y"] == pytest.approx(1 - 0.4 * p / 3, rel=1e-10)
    assert found(0.5)["z"] == pytest.approx((3 / 4 - 1 / 8) / 2, rel=1e-10)
    assert found.kind == "minimum"
