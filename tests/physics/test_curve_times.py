"""Motions between two places: Lambert's problem either way round and with revolutions, and the free time of a given energy."""

from __future__ import annotations

import itertools

import mpmath as mp
import pytest

import mechc

mp.mp.dps = 30

MU = mp.mpf("3.986004418e14")

PLANE = """
model Plane
  parameter mu = 3.986004418e14 m^3/s^2;
  parameter m = 1 kg;
  parameter T = 3000 s;
  parameter turn = 90 deg "swept from the first place to the second, with its sign";
  independent t from 0 s to T;
  let size = 7e6 m + 1e6 m*t/T;
  coordinate Length r[2] ~ {size*cos(turn*t/T), size*sin(turn*t/T)};
  initial r = {7e6, 0} m;
  final r = {0, 8e6} m;
  kinetic 1/2*m*dot(der(r), der(r));
  potential -m*mu/norm(r);
  output swept = integral((r[1]*der(r[2]) - r[2]*der(r[1]))/dot(r, r));
end Plane;
"""

POLAR = """
model Polar
  parameter mu = 3.986004418e14 m^3/s^2;
  parameter m = 1 kg;
  parameter T = 8000 s;
  parameter turn = 450 deg;
  independent t from 0 s to T;
  coordinate r ~ 7e6 m + 1e6 m*t/T;
  coordinate Angle phi ~ turn*t/T;
  initial r = 7e6 m;
  initial phi = 0 rad;
  final r = 8e6 m;
  final phi = turn;
  kinetic 1/2*m*(der(r)^2 + r^2*der(phi)^2);
  potential -m*mu/r;
end Polar;
"""


def actions(time: float, turn: float) -> list[tuple[mp.mpf, mp.mpf]]:
    """Return energies and actions of the orbits, by Lagrange's equation: sin^2(alpha/2) = s/2a, sin^2(beta/2) = (s - c)/2a."""
    chord = mp.sqrt(mp.mpf(7e6) ** 2 + mp.mpf(8e6) ** 2)
    half = (mp.mpf(15e6) + chord) / 2
    rounds, rest = divmod(abs(turn), 360)
    sign = 1 if rest < 180 else -1

    def shape(alpha: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
        a = half / (2 * mp.sin(alpha / 2) ** 2)
        return a, sign * 2 * mp.asin(mp.sqrt((half - chord) / (2 * a)))

    def late(alpha: mp.mpf) -> mp.mpf:
        a, beta = shape(alpha)
        passed = 2 * mp.pi * rounds + alpha - mp.sin(alpha) - beta + mp.sin(beta)
        return mp.sqrt(a**3 / MU) * passed / time - 1

    found = []
    grid = [mp.mpf(k) / 400 * 2 * mp.pi for k in range(1, 400)]
    for low, high in itertools.pairwise(grid):
        if late(low) * late(high) < 0:
            alpha = mp.findroot(late, (low, high), solver="anderson")
            a, beta = shape(alpha)
            energy = -MU / (2 * a)
            # T - V = energy + 2 mu/r, and dt/r is sqrt(a/mu) times the eccentric anomaly
            found.append((energy, energy * time + 2 * mp.sqrt(MU * a) * (2 * mp.pi * rounds + alpha - beta)))
    return found


@pytest.mark.parametrize(
    ("text", "time", "turn"),
    [
        pytest.param(PLANE, 3000, 90, id="short way"),
        pytest.param(PLANE, 9000, -270, id="long way"),
        pytest.param(PLANE, 8000, 450, id="with a revolution"),
        pytest.param(POLAR, 8000, 450, id="with a revolution, in an angle"),
        pytest.param(POLAR, 16000, 810, id="with two revolutions, in an angle", marks=pytest.mark.slow),
    ],
)
def test_lamberts_problem(text: str, time: float, turn: float) -> None:
    found = mechc.loads(text).solve(set={"T": time, "turn": f"{turn} deg"})
    energy, drift = found.first_integrals["energy"]
    near = min(actions(time, turn), key=lambda row: abs(row[0] - energy))
    assert energy == pytest.approx(float(near[0]), rel=1e-10)
    assert drift < 1e-9 * abs(energy)
    assert abs(found.stationary - near[1]) <= 30 * found.error <= 1e-9 * abs(found.stationary)
    if "swept" in found.outputs:
        assert found.outputs["swept"] == pytest.approx(float(mp.radians(turn)), rel=1e-12)


def test_the_time_of_a_given_energy_is_found() -> None:
    """A stone of energy E over a distance x: sin(2 angle) = g x / v^2; the value is Maupertuis' int 2 T dt."""
    g, v, x = mp.mpf("9.81"), mp.mpf(6), mp.mpf(2)
    angle = mp.asin(g * x / v**2) / 2
    time = 2 * v * mp.sin(angle) / g
    exact = mp.quad(lambda t: (v * mp.cos(angle)) ** 2 + (v * mp.sin(angle) - g * t) ** 2, [0, time])
    found = mechc.loads("""
        model FreeTime
          parameter m = 1 kg;
          parameter E = 18 J;
          parameter g = 9.81 m/s^2;
          independent t from 0 s to T;
          coordinate T ~ 0.4 s;
          coordinate Length r[2] ~ {2 m*t/T, 0.4 m*(t/T)*(1 - t/T)};
          initial r = {0, 0} m;
          final r = {2, 0} m;
          kinetic 1/2*m*dot(der(r), der(r));
          potential m*g*r[2];
          lagrangian E;
        end FreeTime;
    """).solve()
    assert found.interval[1] == pytest.approx(float(time), rel=1e-12)
    assert abs(found.stationary - exact) <= 30 * found.error <= 1e-9 * exact


def test_an_action_that_nothing_raises_is_a_maximum() -> None:
    text = """
model Falling
  dimensionless;
  independent t from 0 to 1;
  coordinate y ~ 0;
  initial y = 0;
  final y = 1;
  lagrangian -1/2*der(y)^2;
end Falling;
"""
    assert mechc.loads(text).solve().kind == "maximum"
    assert mechc.loads(text.replace("lagrangian -", "kinetic ")).solve().kind == "minimum"


def test_a_range_that_would_descend_is_no_answer() -> None:
    """1/(2 b) - k b^2/4 is stationary at b = -1/k^(1/3) alone."""
    text = """
model Before
  dimensionless;
  independent x from 0 to b;
  coordinate b ~ 1;
  coordinate y ~ x;
  initial y = 0;
  final y = 1;
  stationary integral(1/2*der(y)^2 - x/2);
end Before;
"""
    with pytest.raises(mechc.SimulationError, match="goes from 0 to -1: it must ascend"):
        mechc.loads(text).solve()


def test_an_end_stays_above_the_other_one_on_the_way() -> None:
    """1/(2 b) + b/2 is stationary at 1 and -1; from 5 Newton's whole step goes below zero."""
    text = """
model Free
  dimensionless;
  independent x from 0 to b;
  coordinate b ~ 5;
  coordinate y ~ x/5;
  initial y = 0;
  final y = 1;
  stationary integral(1/2*der(y)^2 + 1/2);
end Free;
"""
    found = mechc.loads(text).solve()
    assert found.stationary == pytest.approx(1, rel=1e-12)
    assert found.interval[1] == pytest.approx(1, rel=1e-9)
