"""Frequency responses against SciPy, of state spaces written by hand from the physics, and against python-control where it is installed."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, NamedTuple

import mpmath
import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
import scipy.optimize
import scipy.signal
from numpy.typing import NDArray

import mechc
from mechc.cli.main import run as run_command
from mechc.runtime.local import frequency_response
from mechc.runtime.outcome import SimulationError
from mechc.runtime.studies.kinds.response import FrequencyResponse

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
W = np.geomspace(0.05, 300.0, 24)


class Case(NamedTuple):
    """A model and its transfer functions H [w][outputs][inputs] at ``W``, by other means; A, B, C, D of its state space by hand."""

    text: str
    settings: dict[str, Any]
    wanted: Complex
    system: tuple[Array, Array, Array, Array] | None = None


def by_mpmath(e: Any, a: Any, b: Any, c: Any, d: Any = None) -> Complex:
    """C (s E - A)^-1 B + D with thirty digits, from numbers as they are written."""
    with mpmath.workdps(30):
        e, a, b, c = (
            mpmath.matrix(np.atleast_2d(np.asarray(x, dtype=object)).tolist()) for x in (e, a, b, c)
        )
        found = []
        for w in W:
            s = mpmath.mpc(0, w)
            inverse = mpmath.inverse(s * e - a)
            found.append(np.array((c * inverse * b).tolist(), dtype=complex))
    whole = np.array(found).reshape(len(W), c.rows, b.cols)
    return whole if d is None else whole + np.asarray(d, dtype=float)


Known = tuple[Complex, tuple[Array, Array, Array, Array]]


def by_hand(e: Any, a: Any, b: Any, c: Any, d: Any = None) -> Known:
    """H of E x' = A x + B u, y = C x + D u, and its state space."""
    e, a, b, c = (np.atleast_2d(np.asarray(x, dtype=float)) for x in (e, a, b, c))
    d = np.zeros((len(c), b.shape[1])) if d is None else np.asarray(d, dtype=float)
    return by_mpmath(e, a, b, c, d), (np.linalg.solve(e, a), np.linalg.solve(e, b), c, d)


def second_order(m: Any, c: Any, k: Any, push: Any, seen: Any, d: Any = None) -> Known:
    """H of M x'' + C x' + K x = P u, y = Y x + D u, and its state space."""
    m, c, k, push, seen = (np.atleast_2d(np.asarray(x, dtype=float)) for x in (m, c, k, push, seen))
    n = len(m)
    none, one = np.zeros((n, n)), np.eye(n)
    e, a = np.block([[one, none], [none, m]]), np.block([[none, one], [-k, -c]])
    return by_hand(e, a, np.vstack([np.zeros_like(push), push]), np.hstack([seen, np.zeros_like(seen)]), d)


def quotient(above: Any, below: Any) -> Complex:
    """H of a quotient of polynomials in s, by ``scipy.signal.freqs``, [w][1][1]."""
    return np.asarray(scipy.signal.freqs(above, below, W)[1], dtype=complex)[:, None, None]


OSCILLATOR = """\
model Oscillator
  parameter c = 0.4 N.s/m;
  input Force u = 0 N;
  coordinate Length x = 0 m;
  kinetic 1/2*(2 kg)*der(x)^2;
  potential 1/2*(50 N/m)*x^2;
  damping c on x;
  force u on x;
end Oscillator;
"""

SHAFT = """\
model Shaft "three disks on a shaft; a spring holds the first, which is turned"
  input Torque u = 0 N.m;
  coordinate Angle a = 0 rad;
  coordinate Angle b = 0 rad;
  coordinate Angle c = 0 rad;
  kinetic 1/2*(0.2 kg.m^2)*der(a)^2 + 1/2*(0.1 kg.m^2)*der(b)^2 + 1/2*(0.3 kg.m^2)*der(c)^2;
  potential 1/2*(5 N.m/rad)*a^2 + 1/2*(30 N.m/rad)*(b - a)^2 + 1/2*(20 N.m/rad)*(c - b)^2;
  damping 0.05 N.m.s on a;
  damping 0.02 N.m.s on b - a;
  damping 0.01 N.m.s on c - b;
  torque u on a;
end Shaft;
"""

FILTER = """\
model Filter "no mechanics: states alone, and an output that the input reaches at once"
  dimensionless;
  input u = 0;
  state a = 0;
  state b = 0;
  state c = 0;
  equation der(a) = 2*u - 3*a;
  equation der(b) = a - 4*b + 0.5*c;
  equation der(c) = b - 5*c;
  output last = c;
  output mixed = a + c + 0.5*u;
end Filter;
"""

TWO_MASSES = """\
model TwoMasses
  input Force u = 0 N;
  input Force w = 0 N;
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  kinetic 1/2*(2 kg)*der(x)^2 + 1/2*(0.5 kg)*der(y)^2;
  potential 1/2*(300 N/m)*x^2 + 1/2*(40 N/m)*(y - x)^2;
  damping 1 N.s/m on x;
  damping 0.3 N.s/m on y - x;
  force u on x;
  force w on y;
  output spread = y - x;
  output first = x;
end TwoMasses;
"""

CART_POLE = """\
model CartPole
  input Force u = 0 N;
  coordinate Length x = 0 m;
  coordinate phi = 180 deg;
  kinetic 1/2*(1.2 kg)*der(x)^2 + (0.2 kg)*(0.6 m)*cos(phi)*der(x)*der(phi) + 1/2*(0.2 kg)*(0.6 m)^2*der(phi)^2;
  potential (0.2 kg)*(9.81 m/s^2)*(0.6 m)*cos(phi);
  damping 0.3 N.s/m on x;
  damping 0.02 N.m.s on phi;
  force u on x;
end CartPole;
"""

MOTOR = """\
model Motor "with a winding: a first-order state"
  parameter R = 2 Ohm;
  parameter K = 0.1 N.m/A;
  input Voltage v = 0 V;
  coordinate Angle a = 0 rad;
  state Current i = 0 A;
  equation der(i) = (v - R*i - K*der(a))/(0.05 H);
  kinetic 1/2*(0.01 kg.m^2)*der(a)^2;
  damping 0.02 N.m.s on a;
  potential 1/2*(0.3 N.m)*a^2;
  force K*i on a;
  output speed = der(a);
  output current = i;
end Motor;
"""

GYRO = """\
model Gyro "two angles that a spinning rotor couples"
  input Torque u = 0 N.m;
  coordinate a = 0 rad;
  coordinate b = 0 rad;
  kinetic 1/2*(0.02 kg.m^2)*(der(a)^2 + der(b)^2) + (0.5 kg.m^2/s)*a*der(b);
  potential 1/2*(3 N.m)*(a^2 + 2*b^2);
  damping 0.01 N.m.s on a;
  damping 0.03 N.m.s on b;
  force u on a;
end Gyro;
"""

BASE = """\
model Base "shaken at its foot"
  input Length y(interpolation = "spline") = 0 m;
  coordinate Length b;
  drive b = y;
  coordinate Length x = 0 m;
  kinetic 1/2*(1 kg)*der(x)^2 + 1/2*(0.5 kg)*der(b)^2;
  potential 1/2*(100 N/m)*(x - b)^2;
  damping 10 N.s/m on x - b;
  output place = x;
  output push = reaction(b);
  experiment(stop = 1 s);
end Base;
"""

QUARTER_CAR = """\
model QuarterCar "over a road"
  input Length road(interpolation = "spline") = 0 m;
  coordinate Length r;
  drive r = road;
  coordinate Length w = 0 m;
  coordinate Length b = 0 m;
  kinetic 1/2*(40 kg)*der(w)^2 + 1/2*(300 kg)*der(b)^2;
  potential 1/2*(150e3 N/m)*(w - r)^2 + 1/2*(18e3 N/m)*(b - w)^2;
  damping 1200 N.s/m on b - w;
  output body = b;
  output tyre = w - r;
  experiment(stop = 1 s);
end QuarterCar;
"""

HANGING = """\
model Hanging "a pendulum below a hinge that is driven sideways"
  input Length y(interpolation = "spline") = 0 m;
  coordinate Length s;
  drive s = y;
  coordinate a = 0 rad;
  frame bob = world*trans({s + (0.8 m)*sin(a), -(0.8 m)*cos(a)});
  gravity {0, -9.81} m/s^2;
  mass 0.3 kg at bob;
  damping 0.01 N.m.s on a;
  output place = s + (0.8 m)*sin(a);
  experiment(stop = 1 s);
end Hanging;
"""

FOUR_BAR = """\
import mech.planar.*;
model FourBar "three bars hang in a loop; a torque acts on the first"
  gravity {0, -9.81} m/s^2;
  input Torque u = 0 N.m;
  Bar crank(m = 1 kg, l = 0.2 m);
  Bar coupler(m = 2 kg, l = 0.5 m);
  Bar rocker(m = 1.5 kg, l = 0.4 m);
  frame pivot = world * trans({0.5 m, 0});
  Revolute a(world -> crank.a, angle = -80 deg);
  Revolute b(crank.b -> coupler.a, angle ~ 80 deg);
  Revolute d(pivot -> rocker.a, angle ~ -90 deg);
  cut Revolute c(coupler.b -> rocker.b);
  damping 0.05 N.m.s on a.angle;
  damping 0.02 N.m.s on d.angle;
  force u on a.angle;
  output first = a.angle;
  output last = d.angle;
end FourBar;
"""

SERVO = """\
model Servo "reads every 50 ms, and holds its force"
  parameter Ts = 50 ms;
  input Length target = 0 m;
  input Force w = 0 N;
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*(3 N/m)*x^2;
  damping 0.2 N.s/m on x;
  discrete Force u = 0 N;
  discrete Length last = 0 m;
  when sample(Ts) then
    u := (20 N/m)*(target - x) - (4 N.s/m)*(x - last)/Ts;
    last := x;
  end when;
  force u + w on x;
  output place = x;
  output held = u;
  experiment(stop = 3 s);
end Servo;
"""


def four_bar() -> Complex:
    """H from the equations of three free bars in x, y and angle with their pins, at rest by SciPy, as a pencil (s E - A)."""
    mass, length = np.array([1.0, 2.0, 1.5]), np.array([0.2, 0.5, 0.4])
    half = length / 2

    def ends(q: Any, k: int, sign: float) -> Any:
        x, y, angle = q[3 * k : 3 * k + 3]
        return np.array([x + sign * half[k] * np.cos(angle), y + sign * half[k] * np.sin(angle)])

    def pins(q: Any) -> Any:
        return np.concatenate(
            [
                ends(q, 0, -1),
                ends(q, 0, 1) - ends(q, 1, -1),
                ends(q, 1, 1) - ends(q, 2, 1),
                ends(q, 2, -1) - np.array([0.5, 0]),
            ]
        )

    def along(function: Any, q: Array) -> Array:
        return np.array([function(q + 1e-200j * e).imag / 1e-200 for e in np.eye(len(q))]).T

    weight = np.zeros(9)
    weight[[1, 4, 7]] = 9.81 * mass

    def balance(unknown: Array) -> Array:
        q, lam = unknown[:9], unknown[9:]
        return np.concatenate([weight + along(pins, q).T @ lam, pins(q)])

    a, d = np.radians(-80.0), np.radians(-95.0)
    corner = 0.2 * np.array([np.cos(a), np.sin(a)])
    other = np.array([0.5, 0]) + 0.4 * np.array([np.cos(d), np.sin(d)])
    turn = float(np.arctan2(*(other - corner)[::-1]))
    first = [*(corner / 2), a, *((corner + other) / 2), turn, *((np.array([0.5, 0]) + other) / 2), d]
    forces = np.linalg.lstsq(along(pins, np.array(first)).T, -weight, rcond=None)[0]
    found = scipy.optimize.fsolve(balance, [*first, *forces], xtol=1e-14)
    assert found[1] < 0 and found[7] < 0  # it hangs
    for _ in range(3):  # to rounding
        slope = np.array(
            [(balance(found + 1e-6 * e) - balance(found - 1e-6 * e)) / 2e-6 for e in np.eye(17)]
        ).T
        found = found - np.linalg.solve(slope, balance(found))
    q, lam = found[:9], found[9:]
    g = along(pins, q)
    # of lam . pins only the ends of bars bend: their second derivatives are those of cosine and sine
    stiff = np.zeros((9, 9))
    for k, parts in enumerate(
        [[(-1, lam[0:2]), (1, lam[2:4])], [(-1, -lam[2:4]), (1, lam[4:6])], [(1, -lam[4:6]), (-1, lam[6:8])]]
    ):
        angle = q[3 * k + 2]
        stiff[3 * k + 2, 3 * k + 2] = sum(
            -s * half[k] * (f[0] * np.cos(angle) + f[1] * np.sin(angle)) for s, f in parts
        )
    inertia = np.diag([x for m, size in zip(mass, length, strict=True) for x in (m, m, m * size**2 / 12)])
    damping = np.zeros((9, 9))
    damping[2, 2], damping[8, 8] = 0.05, 0.02
    e = scipy.linalg.block_diag(np.eye(9), inertia, np.zeros((8, 8)))
    matrix = np.block(
        [
            [np.zeros((9, 9)), np.eye(9), np.zeros((9, 8))],
            [-stiff, -damping, -g.T],
            [g, np.zeros((8, 9)), np.zeros((8, 8))],
        ]
    )
    push, seen = np.zeros((26, 1)), np.zeros((2, 26))
    push[9 + 2, 0], seen[0, 2], seen[1, 8] = 1.0, 1.0, 1.0
    return np.array([seen @ np.linalg.solve(1j * w * e - matrix, push) for w in W])


def driven() -> dict[str, Case]:
    s = 1j * W
    base = 100 + 10 * s
    stretch = 1 - base / (s**2 + 10 * s + 100)
    push = 0.5 * s**2 + base * stretch
    cars = second_order(
        np.diag([40.0, 300.0]),
        [[1200, -1200], [-1200, 1200]],
        [[168e3, -18e3], [-18e3, 18e3]],
        [[150e3], [0]],
        [[0, 1], [1, 0]],
        [[0], [-1]],
    )
    inertia, stiff = 0.3 * 0.8**2, 0.3 * 9.81 * 0.8
    return {
        "base": Case(
            BASE,
            {"outputs": "place, push"},
            np.stack([quotient([10, 100], [1, 10, 100])[:, 0], push[:, None]], axis=1),
        ),
        "car": Case(QUARTER_CAR, {}, *cars),
        "place": Case(
            BASE,
            {"outputs": "place"},
            *by_hand(np.eye(2), [[0, 1], [-100, -10]], [[0], [1]], [[100, 10]]),
        ),
        # the angle is -0.24 s^2/(0.192 s^2 + c s + k) times that of the hinge, and 0.8*0.24/0.192 is one
        "hanging": Case(
            HANGING,
            {},
            *by_hand(np.diag([1, inertia]), [[0, 1], [-stiff, -0.01]], [[0], [1]], [[stiff, 0.01]]),
        ),
    }


def cases() -> dict[str, Case]:
    m, ml, j = 1.2, 0.2 * 0.6, 0.2 * 0.6**2
    return {
        "oscillator": Case(OSCILLATOR, {}, *second_order(2, 0.4, 50, 1, 1)),
        "shaft": Case(
            SHAFT,
            {"outputs": "a, c"},
            *second_order(
                np.diag([0.2, 0.1, 0.3]),
                [[0.07, -0.02, 0], [-0.02, 0.03, -0.01], [0, -0.01, 0.01]],
                [[35, -30, 0], [-30, 50, -20], [0, -20, 20]],
                [[1], [0], [0]],
                [[1, 0, 0], [0, 0, 1]],
            ),
        ),
        "filter": Case(
            FILTER,
            {"outputs": "last, mixed"},
            *by_hand(
                np.eye(3),
                [[-3, 0, 0], [1, -4, 0.5], [0, 1, -5]],
                [[2], [0], [0]],
                [[0, 0, 1], [1, 0, 1]],
                [[0], [0.5]],
            ),
        ),
        "two masses": Case(
            TWO_MASSES,
            {},
            *second_order(
                np.diag([2, 0.5]),
                [[1.3, -0.3], [-0.3, 0.3]],
                [[340, -40], [-40, 40]],
                np.eye(2),
                [[-1, 1], [1, 0]],
            ),
        ),
        "cart and pole": Case(
            CART_POLE,
            {"outputs": "x, phi"},
            *second_order(
                [[m, -ml], [-ml, j]], np.diag([0.3, 0.02]), np.diag([0, ml * 9.81]), [[1], [0]], np.eye(2)
            ),
        ),
        "motor": Case(
            MOTOR,
            {},
            *by_hand(
                np.eye(3), [[0, 1, 0], [-30, -2, 10], [0, -2, -40]], [[0], [0], [20]], [[0, 1, 0], [0, 0, 1]]
            ),
        ),
        "gyro": Case(
            GYRO,
            {"outputs": "a, b"},
            *second_order(
                0.02 * np.eye(2), [[0.01, -0.5], [0.5, 0.03]], np.diag([3, 6]), [[1], [0]], np.eye(2)
            ),
        ),
        "four-bar": Case(FOUR_BAR, {"at": "equilibrium"}, four_bar()),
        **driven(),
    }


NAMES = (
    "oscillator", "shaft", "filter", "two masses", "cart and pole", "motor", "gyro", "four-bar", "base", "car", "place", "hanging",
)  # fmt: skip


def response(text: str, **settings: Any) -> FrequencyResponse:
    found = mechc.loads(text).study("response", **settings)
    assert isinstance(found, FrequencyResponse)
    return found


@pytest.fixture(scope="module")
def all_cases() -> dict[str, Case]:
    found = cases()
    assert tuple(found) == NAMES
    return found


@pytest.mark.parametrize("name", NAMES)
def test_against_state_spaces_by_hand(name: str, all_cases: dict[str, Case]) -> None:
    """Within 1e-9 of the largest gain of each pair, and within ten of the stated errors or the rounding of the other program."""
    case = all_cases[name]
    found = response(case.text, frequencies=W, **case.settings)
    assert found.response.shape == case.wanted.shape
    largest = np.abs(case.wanted).max(axis=0)
    assert (np.abs(found.response - case.wanted) <= 1e-9 * largest).all()
    assert (np.abs(found.response - case.wanted) <= 1e-9 * np.abs(case.wanted)).all()
    np.testing.assert_allclose(found.gain, np.abs(case.wanted), rtol=1e-9)
    np.testing.assert_allclose(np.exp(1j * found.phase), case.wanted / np.abs(case.wanted), atol=1e-9)


OF_STATES = tuple(name for name in NAMES if name not in ("four-bar", "base"))
"""Ten with a state space; three of them are driven: their input is the place of something."""


@pytest.mark.filterwarnings("ignore:Badly conditioned")  # SciPy forms polynomials
@pytest.mark.parametrize("name", OF_STATES)
def test_against_scipy(name: str, all_cases: dict[str, Case]) -> None:
    """``freqresp`` of each pair within 1e-9 of its largest gain: far below that its polynomials lose digits."""
    case = all_cases[name]
    assert case.system is not None
    a, b, c, d = case.system
    found = response(case.text, frequencies=W, **case.settings).response
    for k, j in np.ndindex(*d.shape):
        system = scipy.signal.StateSpace(a, b[:, [j]], c[[k]], d[[k]][:, [j]])
        other = scipy.signal.freqresp(system, W)[1]
        assert np.abs(found[:, k, j] - other).max() < 1e-9 * np.abs(other).max()


@pytest.mark.parametrize("name", OF_STATES)
def test_against_python_control(name: str, all_cases: dict[str, Case]) -> None:
    """Each value within 1e-9 of itself."""
    control = pytest.importorskip("control")
    case = all_cases[name]
    assert case.system is not None
    other = control.ss(*case.system)(1j * W, squeeze=False)
    found = response(case.text, frequencies=W, **case.settings).response
    np.testing.assert_allclose(found, np.moveaxis(other, -1, 0), rtol=1e-9)


def test_the_stated_errors_hold(all_cases: dict[str, Case]) -> None:
    """Against thirty digits; without one more step of the solution of the equations it is missed by a factor of 30."""
    for name, case in all_cases.items():
        if name == "four-bar":  # its reference has the digits of doubles
            continue
        found = response(case.text, frequencies=W, **case.settings)
        off = np.abs(found.response - case.wanted)
        assert (off <= found.error).all() and off.max() > 0
        assert (found.error < 1e-12 * found.gain.max(axis=0)).all()


@pytest.mark.filterwarnings("ignore:Badly conditioned")  # SciPy forms polynomials
def test_inputs_that_are_held_between_samples() -> None:
    """Against ``cont2discrete`` and ``dfreqresp``; beyond half the rate of sampling the response repeats."""
    a, b, c = [[0, 1], [-25, -0.2]], [[0], [0.5]], [[1, 0]]
    discrete = scipy.signal.cont2discrete((np.array(a), np.array(b), np.array(c), np.zeros((1, 1))), 0.05)
    w = np.linspace(1, 300, 40)
    wanted = scipy.signal.dfreqresp(scipy.signal.dlti(*discrete[:4], dt=0.05), w * 0.05)[1]
    found = response(OSCILLATOR, frequencies=w, sample=0.05)
    np.testing.assert_allclose(found.response[:, 0, 0], wanted, rtol=1e-9)
    assert found.period == 0.05 and found.stable == (True,)
    assert any(
        "aliasing: beyond 62.8319 rad/s" in remark and "less by 125.664 rad/s" in remark
        for remark in found.remarks
    )
    assert not any("aliasing" in remark for remark in response(OSCILLATOR, sample=0.05).remarks)


def sampled_servo(w: Array, disturbed: bool) -> Complex:
    """Place and force of the servo at its samples, by the exponential of the matrix and SciPy's quadrature."""
    a, period = np.array([[0, 1], [-3, -0.2]]), 0.05
    push = np.array([0.0, 1.0])
    move = scipy.linalg.expm(a * period)
    hold = scipy.integrate.quad_vec(lambda t: scipy.linalg.expm(a * t) @ push, 0, period, epsabs=1e-14)[0]
    found = []
    for x in w:
        z = np.exp(1j * x * period)
        driven = np.zeros(2, dtype=complex)
        if disturbed:
            driven = scipy.integrate.quad_vec(
                lambda t, x=x: scipy.linalg.expm(a * (period - t)) @ push * np.exp(1j * x * t),
                0,
                period,
                epsabs=1e-14,
            )[0]
        # place, rate, force: z X = move X + hold F + driven; F = 20 (r - x) - 4 (x - x/z)/T
        matrix = np.zeros((3, 3), dtype=complex)
        matrix[:2, :2], matrix[:2, 2] = z * np.eye(2) - move, -hold
        matrix[2] = [20 + 4 * (1 - 1 / z) / period, 0, 1]
        place, _, force = np.linalg.solve(matrix, [*driven, 0.0 if disturbed else 20.0])
        found.append([place, force])
    return np.array(found)


def test_a_controller_that_samples_in_the_model() -> None:
    """A target that is read at the samples, and a force that acts in between, also beyond half the rate of sampling."""
    w = np.array([0.3, 2.0, 11.0, 40.0, 62.0, 70.0, 200.0])
    found = response(SERVO, frequencies=w)
    assert [q.name for q in found.inputs] == ["target", "w"] and found.period == 0.05
    assert found.stable == (True,)
    for j, disturbed in enumerate((False, True)):
        np.testing.assert_allclose(found.response[:, :, j], sampled_servo(w, disturbed), rtol=1e-9)
    assert any(remark.startswith("sampled by the model (sample(Ts))") for remark in found.remarks)


@pytest.mark.slow
def test_a_controller_that_samples_against_its_motion() -> None:
    """The motion itself under a sine of the disturbance, seen at the samples once it has settled."""
    w = 2 * math.pi / 0.05 * 0.27
    model = mechc.loads(SERVO.replace("Force w = 0 N", f"Force w = (1 N)*cos({w!r} rad/s*time)"))
    run = model.simulate(stop=40, every=0.05, tolerance=1e-12)
    t, x = run.time[400:-1], run["place"][400:-1]
    basis = np.column_stack([np.cos(w * t), -np.sin(w * t)])
    real, imag = np.linalg.lstsq(basis, x, rcond=None)[0]
    found = response(SERVO, frequencies=[w], inputs="w", outputs="place").response[0, 0, 0]
    assert abs(complex(real, imag) - found) < 1e-8 * abs(found)


def test_a_loop_that_samples_too_slowly_is_unstable() -> None:
    found = response(SERVO, set={"Ts": 0.6})
    assert found.stable == (False,)
    assert any("unstable" in remark and "no motion settles to it" in remark for remark in found.remarks)


def test_phases_have_no_jumps_however_few_frequencies_are_asked() -> None:
    """Two resonances with a zero between them at the mass that is pushed, with none at the other one."""
    w = np.array([0.1, 11.0, 100.0])
    text = TWO_MASSES.replace("1 N.s/m", "1e-5 N.s/m").replace("0.3 N.s/m", "1e-5 N.s/m")
    alone, many = (response(text, inputs="u", outputs="first, y", frequencies=x) for x in (w[[2]], w))
    assert np.degrees(many.phase[:, 1, 0]) == pytest.approx([0, -180, -360], abs=1e-2)
    assert np.degrees(many.phase[:, 0, 0]) == pytest.approx([0, 0, -180], abs=1e-2)
    assert np.degrees(alone.phase[0, :, 0]) == pytest.approx([-180, 0], abs=1e-2)  # nothing is known below


def test_without_damping_a_pole_takes_half_a_turn_and_a_zero_gives_it_back() -> None:
    text = TWO_MASSES.replace("damping 1 N.s/m on x;", "").replace("damping 0.3 N.s/m on y - x;", "")
    found = response(text, inputs="u", outputs="first", frequencies="1 rad/s .. 100 rad/s")
    turns = np.degrees(found.phase[:, 0, 0])
    assert abs(turns[-1] + 180) < 1e-6 and turns.max() < 1e-6 and turns.min() > -180.001
    assert found.stable == (None,) and any("limit of stability" in remark for remark in found.remarks)
    (table,) = found.tables
    assert table.rows[0][2] == math.inf
    poles = np.sqrt(np.linalg.eigvals([[170.0, -20.0], [-80.0, 80.0]]))
    assert np.abs(poles - table.rows[0][5]).min() < 1e-5


def test_on_a_pole_the_response_has_no_bound() -> None:
    text = OSCILLATOR.replace("damping c on x;", "")
    found = response(text, frequencies=[1.0, 5.0, 7.0])
    assert np.isinf(found.gain[1, 0, 0]) and np.isnan(found.phase[1, 0, 0])
    assert np.degrees(found.phase[[0, 2], 0, 0]) == pytest.approx([0, -180], abs=1e-9)
    assert any("has no bound: 5 rad/s" in remark for remark in found.remarks)
    assert found.summary()["systems"][0]["responses"][0]["gain"][1] is None


def test_a_sharp_peak_is_found_between_the_frequencies() -> None:
    """1/(c w_d) of a damping ratio of a millionth, at w0 sqrt(1 - 2 z^2)."""
    found = response(OSCILLATOR, set={"c": 2e-5}, frequencies="{1, 10} rad/s")
    zeta = 2e-5 / (2 * math.sqrt(2 * 50))
    row = found.tables[0].rows[0]
    assert row[2] == pytest.approx(1 / (50 * 2 * zeta * math.sqrt(1 - zeta**2)), rel=1e-9)
    assert row[5] == pytest.approx(5 * math.sqrt(1 - 2 * zeta**2), rel=1e-7)


def test_over_a_parameter_all_are_in_one_picture() -> None:
    found = response(
        OSCILLATOR, over="c = 0.2 N.s/m .. 20 N.s/m, 3", frequencies="0.1 Hz .. 10 Hz, 25", decibel=True
    )
    w = 2 * np.pi * np.geomspace(0.1, 10, 25)
    assert found.response.shape == (3, 25, 1, 1) and found.arrays["c"].tolist() == [0.2, 10.1, 20]
    for k, c in enumerate((0.2, 10.1, 20)):
        s = 1j * w
        np.testing.assert_allclose(found.response[k, :, 0, 0], 1 / (2 * s**2 + c * s + 50), rtol=1e-12)
    gain, phase = found.panels
    assert [c.name for c in gain.curves] == [f"u to x, c = {c} N.s/m" for c in (0.2, 10.1, 20)]
    assert (gain.x_unit, gain.y_unit, phase.y_unit) == ("Hz", "dB of 1 m/N", "deg")
    assert gain.curves[0].x[[0, -1]] == pytest.approx([0.1, 10])
    assert gain.curves[0].y[0] == pytest.approx(20 * math.log10(abs(found.response[0, 0, 0, 0])))
    assert "3 values of c" in found.message


def test_over_operating_points() -> None:
    """Small motions of a pendulum about its deflections under a constant torque: the frequency falls as sqrt(cos)."""
    text = """
    model Pendulum
      dimensionless;
      input u = 0;
      coordinate a = 0.1;
      kinetic 1/2*der(a)^2;
      potential -cos(a);
      damping 0.3 on a;
      force u on a;
    end Pendulum;
    """
    found = response(text, over="u = 0 .. 0.8, 3", at="equilibrium", frequencies=[0.0, 0.5])
    wanted = [1 / (math.cos(math.asin(u)) - w * w + 0.3j * w) for u in (0, 0.4, 0.8) for w in (0, 0.5)]
    np.testing.assert_allclose(found.response.ravel(), wanted, rtol=1e-12)
    found = response(text, over="a = 0 .. 3, 2", frequencies=[0.5])
    np.testing.assert_allclose(
        found.response.ravel(), [1 / (math.cos(a) - 0.25 + 0.15j) for a in (0, 3)], rtol=1e-12
    )
    assert found.stable == (True, False)
    assert any(remark.startswith("at a = 3: unstable") for remark in found.remarks)
    assert any(remark.startswith("at a = 3: this state is not an equilibrium") for remark in found.remarks)


def test_friction_that_sticks_is_held_and_said() -> None:
    text = OSCILLATOR.replace("damping c on x;", "friction 3 N on x;")
    found = response(text)
    assert not found.gain.any() and np.isnan(found.phase).all()
    assert any("sticks" in remark for remark in found.remarks)
    assert "'u' does not reach 'x'" in found.remarks


@pytest.mark.parametrize(
    ("text", "settings", "said"),
    [
        (OSCILLATOR.replace("input Force u = 0 N;", "").replace("force u on x;", ""), {}, "has no inputs: nothing drives it"),
        (OSCILLATOR, {"frequencies": "2 .. 3", "hertz": True}, "what the bare numbers of 'frequencies' are"),
        (OSCILLATOR, {"over": "c = 0 .. 1, u = 0 .. 1"}, "over one parameter, not over several"),
        (OSCILLATOR, {"over": "x = 0 m .. 1 m", "at": "x = 2 m"}, "'x' has one value in 'at' and several in 'over'"),
        (OSCILLATOR, {"sample": -1}, "the period of sampling is positive"),
        (BASE, {"outputs": "push", "sample": 0.01}, "'push' follows its derivatives"),
        (SERVO, {"sample": 0.01}, "the model samples by itself"),
        (SERVO, {"at": "equilibrium"}, "is not looked for"),
        (SERVO.replace("last := x;", "last := x; reinit(x, 0.5*x);"), {}, "a sample sets the state itself"),
        (
            SERVO.replace("experiment(", "when sample(0.03 s) then last := x; end when; experiment("),
            {},
            "the model samples at several rates or phases: every 0.05, every 0.03",
        ),
    ],
)  # fmt: skip
def test_what_has_no_response_is_refused_in_words(text: str, settings: dict[str, Any], said: str) -> None:
    with pytest.raises(SimulationError, match=said):
        response(text, **settings)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("1 m .. 2 m", "'frequencies' is given in m"),
        ("3 Hz .. 2 Hz", "go from a lower to a higher value"),
        ("1 Hz .. 2 Hz, 1", "a whole number from 2 on"),
        ("fast", "is not a number"),
        ([-1.0], "numbers from 0 on"),
        ([], "numbers from 0 on"),
    ],
)
def test_frequencies_that_are_none_are_refused(given: Any, said: str) -> None:
    with pytest.raises(mechc.UsageMistake, match=said):
        response(OSCILLATOR, frequencies=given)


def test_the_command_writes_and_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, arrays, picture = (tmp_path / name for name in ("model.mech", "found.npz", "bode.svg"))
    file.write_text(OSCILLATOR)
    options = ["--frequencies", "{1, 2} Hz", "--decibel", "--plot", str(picture)]
    assert run_command(["study", "response", str(file), *options, "-o", str(arrays)]) == 0
    printed = capsys.readouterr().out
    with np.load(arrays) as found:
        w = 2 * np.pi * np.array([1.0, 2.0])
        np.testing.assert_allclose(found["frequency"], w)
        np.testing.assert_allclose(found["response"][:, 0, 0], 1 / (50 - 2 * w**2 + 0.4j * w), rtol=1e-12)
        gain = found["gain"][0, 0, 0]
    assert "frequency [Hz]" in printed and f"{20 * math.log10(gain):.7g}" in printed
    assert picture.stat().st_size > 1000
    assert run_command(["study", "response", str(file), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["systems"][0]["stable"] is True and told["accuracy"]["errors"]["response"] < 1e-12


def test_python_control_gets_the_response() -> None:
    control = pytest.importorskip("control")
    data = response(TWO_MASSES, frequencies=W).control()
    assert isinstance(data, control.FrequencyResponseData) and data.input_labels == ["u", "w"]
    slopes = np.array([[-170, 20, -0.65, 0.15], [80, -80, 0.6, -0.6]])
    a = np.vstack([np.eye(4)[2:], slopes])
    b = np.vstack([np.zeros((2, 2)), np.diag([0.5, 2])])
    system = control.ss(a, b, [[-1, 1, 0, 0], [1, 0, 0, 0]], 0)
    np.testing.assert_allclose(data(1j * W), system(1j * W), rtol=1e-9)
    assert len(response(OSCILLATOR, over="c = 0 .. 1, 2", frequencies=W).control()) == 2
    assert response(OSCILLATOR, sample=0.05).control().dt == 0.05


def test_linearize_says_that_samples_are_held() -> None:
    remarks = mechc.loads(SERVO).linearize().remarks
    assert any("(sample(Ts)) is held at its values here" in remark for remark in remarks)


def test_large_systems_are_factored_once(all_cases: dict[str, Case], monkeypatch: pytest.MonkeyPatch) -> None:
    """The same answers by Schur's form, which systems of many states take, within the stated errors."""
    monkeypatch.setattr(frequency_response, "LARGE", 1)
    for name in ("two masses", "motor", "car"):
        case = all_cases[name]
        found = response(case.text, frequencies=W, **case.settings)
        assert (np.abs(found.response - case.wanted) <= found.error).all()
    monkeypatch.undo()
    wanted = response(TWO_MASSES, frequencies=W[:16], sample=0.01)
    monkeypatch.setattr(frequency_response, "LARGE", 1)
    found = response(TWO_MASSES, frequencies=W[:16], sample=0.01)
    assert (np.abs(found.response - wanted.response) <= found.error + wanted.error).all()
