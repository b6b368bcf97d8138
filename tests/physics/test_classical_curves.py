"""Classical problems of the calculus of variations against closed forms: errors below 1e-9, and not far above the claim."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np
import pytest
from gallery import load

import mechc
from mechc.runtime.curves.found import CurveSolution

mp.mp.dps = 30

TRUST = 30


class Case(NamedTuple):
    text: str
    exact: Callable[[], Any]
    kind: str = "minimum"
    negative: int | None = 0


def dido() -> Any:
    radius = 1 / mp.sin(1)
    return radius**2 * (1 - mp.sin(1) * mp.cos(1))


def unequal_rings() -> Any:
    def ends(c: Any, x0: Any) -> list[Any]:
        return [c * mp.cosh(x0 / c) - 1, c * mp.cosh((mp.mpf("0.6") - x0) / c) - mp.mpf("1.2")]

    c, x0 = mp.findroot(ends, (0.9, 0.2))
    left, right = x0, mp.mpf("0.6") - x0
    return 2 * mp.pi * c / 2 * (mp.mpf("0.6") + c / 2 * (mp.sinh(2 * left / c) + mp.sinh(2 * right / c)))


def with_start_speed() -> Any:
    """A cycloid from the depth 0.5 to 1.5, over a width of 1, falling from rest at depth 0."""

    def ends(r: Any, a: Any, b: Any) -> list[Any]:
        return [
            r * (1 - mp.cos(a)) - mp.mpf("0.5"),
            r * (1 - mp.cos(b)) - mp.mpf("1.5"),
            r * (b - mp.sin(b) - a + mp.sin(a)) - 1,
        ]

    r, a, b = mp.findroot(ends, (0.9, 1.1, 2.3))
    return mp.sqrt(r / mp.mpf("9.81")) * (b - a)


def pressed_rod() -> Any:
    p = mp.mpf(20)
    m = mp.findroot(lambda m: mp.ellipk(m) - mp.sqrt(p) / 2, 0.7)
    theta = 2 * mp.asin(mp.sqrt(m))
    return p * mp.cos(theta) + 8 * mp.sqrt(p) * (mp.ellipe(m) - (1 - m) * mp.ellipk(m))


def cone() -> Any:
    """The cone of z = r is unrolled: angles shrink by sqrt(2), lengths along it grow by it."""
    a, b, turn = mp.sqrt(2), 2 * mp.sqrt(2), mp.mpf(1) / mp.sqrt(2)
    return mp.sqrt(a**2 + b**2 - 2 * a * b * mp.cos(turn))


def thrown() -> Any:
    t, g = mp.mpf(2), mp.mpf("9.81")
    return (mp.mpf(9) + 16) / (2 * t) - g * t * 4 / 2 - g**2 * t**3 / 24


def oscillator() -> Any:
    w, t = mp.mpf(2), mp.mpf("0.7")
    return w / (2 * mp.sin(w * t)) * ((1 + mp.mpf("0.25")) * mp.cos(w * t) - 1)


def coupled() -> Any:
    """y'' = z, z'' = y with y(0) = z(0) = 0, y(1) = 1, z(1) = 0: J = (y y' + z z')/2 at the end."""
    return (mp.coth(1) + mp.cot(1)) / 4


def least_action() -> Any:
    """The free fall parabola of given energy: the time is that of the thrown stone, the abbreviated action 2 int T dt."""
    g, speed = mp.mpf("9.81"), mp.mpf(6)
    x = mp.mpf(2)
    # low trajectory to the same height: sin(2 angle) = g x / v^2
    angle = mp.asin(g * x / speed**2) / 2
    time = 2 * speed * mp.sin(angle) / g
    return mp.quad(lambda s: (speed * mp.cos(angle)) ** 2 + (speed * mp.sin(angle) - g * s) ** 2, [0, time])


CASES = {
    "Dido's problem": Case(
        """
        model Dido
          dimensionless;
          independent x from -1 to 1;
          coordinate y ~ 0.5*(1 - x^2);
          initial y = 0;
          final y = 0;
          stationary integral(y);
          constraint rope: integral(sqrt(1 + der(y)^2)) = 2/sin(1);
        end Dido;
        """,
        dido,
        "maximum",
        None,
    ),
    "soap film on unequal rings": Case(
        """
        model Rings
          dimensionless;
          independent x from 0 to 0.6;
          coordinate r ~ 1 + x/3;
          initial r = 1;
          final r = 1.2;
          stationary 2*pi*integral(r*sqrt(1 + der(r)^2));
        end Rings;
        """,
        unequal_rings,
    ),
    "fastest descent with a speed at the start": Case(
        """
        model Running
          parameter g = 9.81 m/s^2;
          independent depth from 0.5 m to 1.5 m;
          coordinate x ~ depth - 0.5 m;
          initial x = 0 m;
          final x = 1 m;
          stationary integral(sqrt((1 + der(x)^2)/(2*g*depth)));
        end Running;
        """,
        with_start_speed,
    ),
    "fastest descent to a line, whose depth is not given": Case(
        """
        model ToLine
          parameter g = 9.81 m/s^2;
          independent depth from 0 m to b;
          coordinate b ~ 0.7 m;
          coordinate x ~ depth;
          initial x = 0 m;
          final x = 1 m;
          stationary integral(sqrt((1 + der(x)^2)/(2*g*depth)));
        end ToLine;
        """,
        lambda: mp.sqrt(mp.pi / mp.mpf("9.81")),
    ),
    "clamped beam, by second derivatives": Case(
        """
        model Beam
          dimensionless;
          independent x from 0 to 1;
          coordinate w ~ 0;
          initial w = 0;
          initial der(w) = 0;
          final w = 0;
          final der(w) = 0;
          stationary integral(1/2*der(w, 2)^2 - w);
        end Beam;
        """,
        lambda: -mp.mpf(1) / 1440,
    ),
    "pressed rod, buckled": Case(
        """
        model Elastica
          dimensionless;
          independent s from 0 to 1;
          coordinate theta ~ 2*cos(pi*s);
          stationary integral(1/2*der(theta)^2 + 20*cos(theta));
        end Elastica;
        """,
        pressed_rod,
        "saddle",
        1,
    ),
    "vibrating string, its second form": Case(
        """
        model String
          dimensionless;
          independent x from 0 to 1;
          coordinate y ~ 1.3*sin(2*pi*x);
          initial y = 0;
          final y = 0;
          stationary integral(der(y)^2);
          constraint size: integral(y^2) = 1;
        end String;
        """,
        lambda: 4 * mp.pi**2,
        "saddle",
        1,
    ),
    "geodesic of a cone": Case(
        """
        model Cone
          dimensionless;
          independent phi from 0 to 1;
          coordinate r ~ 1 + phi;
          initial r = 1;
          final r = 2;
          stationary integral(sqrt(2*der(r)^2 + r^2));
        end Cone;
        """,
        cone,
    ),
    "great circle, on a surface, with no single-valued coordinate": Case(
        """
        model Sphere
          dimensionless;
          independent s from 0 to 1;
          coordinate r[3] ~ {1 - s, s, 0.3*s*(1 - s)};
          initial r = {1, 0, 0};
          final r = {0, 0.6, 0.8};
          constraint surface: dot(r, r) = 1;
          stationary integral(norm(der(r)));
        end Sphere;
        """,
        lambda: mp.pi / 2,
    ),
    "string over a hump": Case(
        """
        model Hump
          dimensionless;
          independent x from -1 to 1;
          coordinate z ~ 0.5;
          initial z = 0;
          final z = 0;
          stationary integral(1/2*der(z)^2);
          constraint hump: z >= 0.5 - 2*x^2;
        end Hump;
        """,
        lambda: 2 * (8 * (1 - mp.sqrt(3) / 2) ** 3 / 3 + 8 * (1 - mp.sqrt(3) / 2) ** 2 * mp.sqrt(3) / 2),
    ),
    "action of a thrown stone": Case(
        """
        model Thrown
          parameter m = 1 kg;
          parameter g = 9.81 m/s^2;
          independent t from 0 s to 2 s;
          coordinate Length r[2] ~ {3 m*t/2 s, 4 m*t/2 s};
          initial r = {0, 0} m;
          final r = {3, 4} m;
          kinetic 1/2*m*dot(der(r), der(r));
          potential m*g*r[2];
        end Thrown;
        """,
        thrown,
    ),
    "action of an oscillator": Case(
        """
        model Oscillator
          dimensionless;
          independent t from 0 to 0.7;
          coordinate x ~ 1 - t;
          initial x = 1;
          final x = 0.5;
          lagrangian 1/2*der(x)^2 - 2*x^2;
        end Oscillator;
        """,
        oscillator,
    ),
    "two dependent variables": Case(
        """
        model Two
          dimensionless;
          independent x from 0 to 1;
          coordinate y ~ x;
          coordinate z ~ 0;
          initial y = 0;
          initial z = 0;
          final y = 1;
          final z = 0;
          stationary integral(1/2*der(y)^2 + 1/2*der(z)^2 + y*z);
        end Two;
        """,
        coupled,
    ),
    "least action of given energy, in any time": Case(
        """
        model Maupertuis
          dimensionless;
          independent s from 0 to 1;
          coordinate r[2] ~ {2*s, 0.5*s*(1 - s)};
          initial r = {0, 0};
          final r = {2, 0};
          stationary integral(sqrt(36 - 2*9.81*r[2])*norm(der(r)));
        end Maupertuis;
        """,
        least_action,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_classical_problem(name: str) -> None:
    """P5 is the problem of two dependent variables."""
    case = CASES[name]
    found: CurveSolution = mechc.loads(case.text).solve()
    exact = float(case.exact())
    error = abs(found.stationary - exact)
    assert error <= 1e-9 * abs(exact)
    assert error <= TRUST * found.error, (error, found.error)
    assert found.kind == case.kind
    if case.negative is not None:
        assert found.negative_directions == case.negative


def test_two_dependent_variables_along_the_curve() -> None:
    """P5: y'' = z and z'' = y from (0, 0) to (1, 0): y + z = sinh(x)/sinh(1), y - z = sin(x)/sin(1); the example."""
    found = load("curves/two_variables").solve()
    assert isinstance(found, CurveSolution)
    for place in np.linspace(0, 1, 11):
        at = found(place)
        sums, differences = np.sinh(place) / np.sinh(1), np.sin(place) / np.sin(1)
        assert at["y"] == pytest.approx((sums + differences) / 2, abs=1e-11)
        assert at["z"] == pytest.approx((sums - differences) / 2, abs=1e-11)
    assert found.stationary == pytest.approx(float(coupled()), rel=1e-12)


def test_from_place_to_place_in_given_time_is_a_kepler_orbit() -> None:
    """The energy of the orbit gives the time back, by Lagrange's equation."""
    mu, t = mp.mpf("3.986004418e14"), 3000
    found: CurveSolution = mechc.loads("""
        model Lambert
          parameter mu = 3.986004418e14 m^3/s^2;
          parameter m = 1 kg;
          parameter T = 3000 s;
          independent t from 0 s to T;
          coordinate Length r[2] ~ {7e6 m*(1 - t/T), 8e6 m*t/T + 3e6 m*(t/T)*(1 - t/T)};
          initial r = {7e6, 0} m;
          final r = {0, 8e6} m;
          kinetic 1/2*m*dot(der(r), der(r));
          potential -m*mu/norm(r);
        end Lambert;
    """).solve()
    energy, drift = found.first_integrals["energy"]
    assert drift < 1e-9 * abs(energy)
    a = -mu / (2 * mp.mpf(energy))
    chord = mp.sqrt(mp.mpf(7e6) ** 2 + mp.mpf(8e6) ** 2)
    half = (mp.mpf(15e6) + chord) / 2
    alpha, beta = 2 * mp.asin(mp.sqrt(half / (2 * a))), 2 * mp.asin(mp.sqrt((half - chord) / (2 * a)))
    times = [
        float(mp.sqrt(a**3 / mu) * (x - mp.sin(x) - beta + mp.sin(beta))) for x in (alpha, 2 * mp.pi - alpha)
    ]
    assert min(abs(x - t) for x in times) < 1e-6


def test_where_the_soap_film_tears() -> None:
    """U64: at the critical distance both films become one: its size and slope of x - c cosh are zero."""
    text = """
        model Film
          dimensionless;
          parameter b = 0.66;
          independent z from -b to b;
          coordinate r ~ 0.55 + 0.45*(z/b)^2;
          initial r = 1;
          final r = 1;
          stationary 2*pi*integral(r*sqrt(1 + der(r)^2));
          output waist = at(r, 0);
        end Film;
    """
    x = mp.findroot(lambda x: x * mp.tanh(x) - 1, 1.2)
    critical = float(x / mp.cosh(x))
    found: CurveSolution = mechc.loads(text).solve(set={"b": critical - 1e-6})
    assert abs(found.outputs["waist"] - critical / float(x)) < 2e-3
