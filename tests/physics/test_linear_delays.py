"""Models with delays near a state: their responses against exp(-i w T) in closed form, their Padé approximations against mpmath, their
poles against Lambert's function."""

from __future__ import annotations

from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import lambertw

import mechc
from mechc import SimulationError

Complex = NDArray[np.complex128]

LOOP = """
parameter T = 0.3 s;
parameter k = 4 N/m;
input Force u = 0 N;
coordinate Length x = 0 m;
kinetic 1/2*1 kg*der(x)^2;
damping 1 N.s/m on x;
potential 1/2*2 N/m*x^2;
force u - k*delay(x, T) + 0.3*delay(u, 0.1 s) on x;
output Length y = x + 0.2*delay(x, 0.5 s);
experiment(stop = 2 s);
"""
W = np.array([0.0, 0.3, 1.0, 2.2, 7.0, 31.0, 400.0])


def loop(s: Complex, late: Callable[[float, Complex], Complex], k: float = 4.0, T: float = 0.3) -> Complex:
    """y/u with ``late``(T, s) instead of exp(-s T)."""
    x = (1 + 0.3 * late(0.1, s)) / (s**2 + s + 2 + k * late(T, s))
    return x * (1 + 0.2 * late(0.5, s))


def exactly(T: float, s: Complex) -> Complex:
    return np.exp(-s * T)


def by_coefficients(order: int) -> Callable[[float, Complex], Complex]:
    """Padé's approximation by the quotient of polynomials that mpmath finds from the series."""
    with mpmath.workdps(60):
        above, below = mpmath.pade(mpmath.taylor(lambda x: mpmath.exp(-x), 0, 2 * order), order, order)

    def late(T: float, s: Complex) -> Complex:
        with mpmath.workdps(60):
            return np.array(
                [
                    complex(mpmath.polyval(above[::-1], z) / mpmath.polyval(below[::-1], z))
                    for z in np.asarray(s * T)
                ]
            )

    return late


def transfer(found: object, s: Complex) -> Complex:
    a, b, c, d = (getattr(found, name) for name in "ABCD")
    return np.array([(c @ np.linalg.solve(z * np.eye(len(a)) - a, b) + d)[0, 0] for z in s])


def test_responses_are_exact() -> None:
    found = mechc.loads(LOOP).response(
        outputs="y", frequencies="{" + ", ".join(f"{w:g}" for w in W) + "} rad/s"
    )
    exact = loop(1j * W, exactly)
    np.testing.assert_allclose(found.response[:, 0, 0], exact, rtol=1e-13)
    assert (np.abs(found.response[:, 0, 0] - exact) <= found.error[:, 0, 0] + 1e-300).all()
    assert (found.error[:, 0, 0] < 1e-12 * np.abs(exact)).all()


@pytest.mark.parametrize("order", [1, 2, 3, 6, 15])
def test_approximations_are_those_of_pade(order: int) -> None:
    found = mechc.loads(LOOP).linearize(outputs="y", pade=order)
    assert found.A.shape == (2 + 3 * order,) * 2
    s = 1j * W
    np.testing.assert_allclose(transfer(found, s), loop(s, by_coefficients(order)), rtol=1e-10)
    assert any(f"approximations of order {order}" in remark for remark in found.remarks)


@pytest.mark.parametrize("order", [2, 3, 5])
def test_approximations_are_off_by_no_more_than_is_said(order: int) -> None:
    """|P - exp(-z)| <= n!^2/((2n)! (2n+1)!) |w T|^(2n+1), through the quotient that the response is."""
    found = mechc.loads(LOOP).linearize(outputs="y", pade=order)
    remark = next(r for r in found.remarks if "at most" in r)
    factor, power = (float(x) for x in remark.split("at most ")[1].split(",")[0].split(" (w T)^"))
    w = np.linspace(0.05, 6, 60)
    s = np.asarray(1j * w, dtype=np.complex128)

    def off(T: float) -> NDArray[np.float64]:
        return 1.01 * factor * (w * T) ** power  # it is told in three digits

    x = (1 + 0.3 * np.exp(-0.1 * s)) / (below := s**2 + s + 2 + 4 * np.exp(-0.3 * s))
    off_x = (0.3 * off(0.1) + np.abs(x) * 4 * off(0.3)) / (np.abs(below) - 4 * off(0.3))
    bound = off_x * (1.2 + 0.2 * off(0.5)) + np.abs(x) * 0.2 * off(0.5)
    error = np.abs(transfer(found, s) - loop(s, exactly))
    assert (error <= bound + 1e-13).all()
    assert error[-1] > 1e-3 * bound[-1]


@pytest.mark.parametrize(("gain", "stable"), [(0.3, True), (1.5, True), (1.6, False), (9.0, False)])
def test_stability_and_poles(gain: float, stable: bool) -> None:
    """x' = -a x(t - 1) + u: s e^s = -a, stable up to pi/2 (N. D. Hayes 1950)."""
    found = mechc.loads(
        f"dimensionless; input u = 0; state x = 0; equation der(x) = u - {gain}*delay(x, 1); experiment(stop = 1);"
    ).response()
    assert found.stable == (stable,)
    poles = np.array([complex(*one) for one in found.details["systems"][0]["poles"]])
    np.testing.assert_allclose(poles * np.exp(poles), -gain, rtol=1e-8)
    for branch in (0, 1):
        expected = complex(lambertw(-gain, branch))
        assert np.abs(poles - expected).min() < 1e-9 * max(1.0, abs(expected))


def test_over_a_delay() -> None:
    found = mechc.loads(LOOP).response(outputs="y", over="T = 0.1 .. 0.3 s, 3", frequencies="{1, 3} rad/s")
    for k, T in enumerate((0.1, 0.2, 0.3)):
        np.testing.assert_allclose(
            found.response[k, :, 0, 0], loop(np.array([1j, 3j]), exactly, T=T), rtol=1e-12
        )
    assert found.stable == (True, True, False)


def test_at_an_equilibrium() -> None:
    """What was is what is: sin(a) = 0.7 - 0.5 a with a torque of a as it was; there H = 1/(s^2 + 0.1 s + cos a + 0.5 exp(-s))."""
    model = mechc.loads(
        "dimensionless; input u = 0; coordinate a = 1.5; kinetic 1/2*der(a)^2; potential -cos(a); damping 0.1 on a;"
        "force 0.7 - 0.5*delay(a, 1) + u on a; experiment(stop = 1);"
    )
    found = model.response(at="equilibrium", outputs="a", frequencies="{0.5, 2}")
    rest = brentq(lambda a: np.sin(a) - 0.7 + 0.5 * a, 0, 1, xtol=1e-15)
    s = np.array([0.5j, 2j])
    exact = 1 / (s**2 + 0.1 * s + np.cos(rest) + 0.5 * np.exp(-s))
    np.testing.assert_allclose(found.response[:, 0, 0], exact, rtol=1e-12)
    assert model.linearize(at="equilibrium").at["a"] == pytest.approx(rest, abs=1e-12)


def test_of_what_drives_and_of_what_has_no_mass() -> None:
    """A base that is driven pulls late, on a mass behind a node without mass: 3 (x - z) = 6 z, so x'' = -2 x + 0.5 b(t - T)."""
    model = mechc.loads(
        'dimensionless; input b(interpolation = "spline") = 0; coordinate base; drive base = b; coordinate x = 0; coordinate z ~ 0; kinetic 1/2*der(x)^2;'
        "potential 1.5*(x - z)^2 + 3*z^2; force 0.5*delay(base, 0.7) on x; experiment(stop = 1);"
    )
    s = np.array([0.5j, 3j])
    exact = 0.5 * np.exp(-0.7 * s) / (s**2 + 2)
    found = model.response(outputs="x", frequencies="{0.5, 3}")
    np.testing.assert_allclose(found.response[:, 0, 0], exact, rtol=1e-12)
    found = model.linearize(outputs="x", pade=9)
    np.testing.assert_allclose(transfer(found, s), exact, rtol=1e-9)


def test_a_rotation_looks_back() -> None:
    """A ball in space under a torque -c w(t - T): s w = -c exp(-s T) w + u."""
    model = mechc.loads(
        "import mech.spatial.*; input Torque u = 0 N.m; Body ball(m = 1 kg, J = diag({1, 1, 1} kg.m^2)); Spherical s(world -> ball.a);"
        "let w[3] = angvel(ball.a); torque {u - 0.5 N.m.s*delay(w[1], 0.2 s), 0 N.m, 0 N.m} on ball.a; output AngularVelocity y = w[1];"
        "experiment(stop = 1 s);"
    )
    found = model.response(outputs="y", frequencies="{1, 5} rad/s")
    s = np.array([1j, 5j])
    np.testing.assert_allclose(found.response[:, 0, 0], 1 / (s + 0.5 * np.exp(-0.2 * s)), rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "study", "options", "words"),
    [
        (LOOP, "modes", {}, "looks back"),
        (LOOP, "response", {"sample": "10 ms"}, "no response of a sampled system with delays"),
        (LOOP, "linearize", {"pade": 200}, "the order of a Padé approximation is 1 to 150"),
        (
            "input Force u = 0 N; coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2; force u on x;",
            "linearize",
            {"pade": 3},
            "has no delays that 'pade' could approximate",
        ),
    ],
)
def test_what_is_refused(text: str, study: str, options: dict[str, object], words: str) -> None:
    with pytest.raises(SimulationError, match=words):
        getattr(mechc.loads(text), study)(**options)
