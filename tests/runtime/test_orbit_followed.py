"""Orbits over a parameter: what happens on the way, against closed forms, literature, and shooting by SciPy."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root
from scipy.special import mathieu_a, mathieu_b
from slow_params import slow_but

import mechc

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

Rate = Callable[[float, np.ndarray, float], tuple[np.ndarray, np.ndarray]]
"""Rates and their derivatives by the state, at a time and a value of the parameter."""


def followed(model: mechc.Model | str, **settings: Any) -> dict[str, Any]:
    if isinstance(model, str):
        model = mechc.loads(model)
    found: dict[str, Any] = model.study("orbit", **settings).summary()  # type: ignore[assignment]
    return found


def kinds(found: dict[str, Any]) -> list[str]:
    return [one["kind"] for one in found["special"]]


def shoot(rate: Rate, y: np.ndarray, period: float, p: float) -> tuple[np.ndarray, np.ndarray]:
    """State and linear map after a period."""
    n = len(y)

    def both(t: float, s: np.ndarray) -> np.ndarray:
        f, jacobian = rate(t, s[:n], p)
        return np.concatenate([f, (jacobian @ s[n:].reshape(n, n)).ravel()])

    end = solve_ivp(
        both, (0, period), np.r_[y, np.eye(n).ravel()], method="DOP853", rtol=1e-11, atol=1e-12
    ).y[:, -1]
    return end[:n], end[n:].reshape(n, n)


def critical(
    rate: Rate, y: np.ndarray, p: float, period: Callable[[float], float], test: Callable[[np.ndarray], float]
) -> float:
    """The parameter at which a function of the linear map vanishes on the orbit near a state."""

    def left(s: np.ndarray) -> np.ndarray:
        end, matrix = shoot(rate, s[:-1], period(s[-1]), s[-1])
        return np.concatenate([end - s[:-1], [test(matrix)]])

    solved = root(left, np.r_[y, p], tol=1e-11)
    assert np.abs(left(solved.x)).max() < 1e-7
    return float(solved.x[-1])


def less(s: float) -> Callable[[np.ndarray], float]:
    return lambda m: float(np.linalg.det(m - s * np.eye(len(m))))


STOP = """\
model Impact "oscillator against a hard stop"
  dimensionless;
  parameter w = 2.6;
  parameter F = 1;
  parameter d = 0.3;
  parameter e = 0.8;
  parameter z = 0.02;
  coordinate x = 0;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  damping 2*z on x;
  force F*cos(w*time) on x;
  contact stop: d - x restitution e;
  experiment(stop = 200);
end Impact;
"""
D, E, Z = 0.3, 0.8, 0.02


def doubling_of_the_impacting_orbit(low: float, high: float) -> float:
    """The frequency at which the orbit of one impact in a period doubles it: all between impacts in closed form."""
    fast = math.sqrt(1 - Z * Z)

    def free(w: float, s: float, x: float, v: float, t: float) -> tuple[float, float]:
        force = 1 / complex(1 - w * w, 2 * Z * w)

        def forced(t: float) -> tuple[float, float]:
            turned = force * np.exp(1j * w * t)
            return turned.real, (1j * w * turned).real

        p, q = forced(s)
        c, b = x - p, (v - q + Z * (x - p)) / fast
        fall, phase = math.exp(-Z * (t - s)), fast * (t - s)
        place = fall * (c * math.cos(phase) + b * math.sin(phase))
        rate = -Z * place + fall * fast * (b * math.cos(phase) - c * math.sin(phase))
        p, q = forced(t)
        return place + p, rate + q

    def orbit(w: float) -> tuple[float, float]:
        period = 2 * math.pi / w

        def rate_for(s: float) -> float:  # linear in the rate after the impact
            at0, at1 = (free(w, s, D, v, s + period)[0] for v in (0.0, 1.0))
            return (D - at0) / (at1 - at0)

        def missing(s: float) -> float:
            v = rate_for(s)
            return v + E * free(w, s, D, v, s + period)[1]

        places = np.linspace(0, period, 721)
        values = [missing(s) for s in places]
        for a, b, one, two in zip(places, places[1:], values, values[1:], strict=False):
            if one * two < 0 and abs(one) + abs(two) < 1:
                s = brentq(missing, a, b, xtol=1e-14)
                v = rate_for(s)
                between = [free(w, s, D, v, t)[0] for t in np.linspace(s, s + period, 200)[1:-1]]
                if v < 0 and max(between) < D:
                    return s, v
        raise AssertionError("no orbit of one impact")

    def test(w: float) -> float:
        period = 2 * math.pi / w
        s, v = orbit(w)

        def impact(s: float, v: float) -> np.ndarray:
            centre = orbit_time
            t = brentq(lambda t: free(w, s, D, v, t)[0] - D, centre - 1e-3, centre + 1e-3, xtol=1e-15)
            return np.array([t, -E * free(w, s, D, v, t)[1]])

        orbit_time, h = s + period, 1e-5
        columns = [
            (impact(s + h, v) - impact(s - h, v)) / (2 * h),
            (impact(s, v + h) - impact(s, v - h)) / (2 * h),
        ]
        trace = columns[0][0] + columns[1][1]
        det = E * E * math.exp(-2 * Z * period)  # Liouville, and the law of impact twice
        return float(1 + trace + det)

    return float(brentq(test, low, high, xtol=1e-9))


@pytest.mark.parametrize(
    "over", slow_but(["w = 2 .. 2.15, 3"], ["w = 2 .. 2.15, 3", "w = 1.95 .. 2.6, 27", "w = 1.95 .. 2.6, 40"])
)
def test_grazing_and_the_doubling_before_it(over: str) -> None:
    """The motion without impacts has the amplitude 1/|1 - w^2 + 2 i z w|: it touches the stop where that is d. No torus can be: the
    map has the determinant e^2 exp(-2 z T)."""
    found = followed(STOP, period="2*pi/w", over=over)
    assert kinds(found) == ["period doubling", "grazing"]
    doubling, grazing = found["special"]
    touching = brentq(lambda w: abs(1 / complex(1 - w * w, 2 * Z * w)) - D, 2, 2.2, xtol=1e-14)
    assert grazing["value"] == pytest.approx(touching, abs=3e-8)  # touches within the tolerance of events
    assert "impact 'stop'" in grazing["events"]
    assert doubling["value"] == pytest.approx(doubling_of_the_impacting_orbit(2.05, 2.0785), abs=1e-6)
    for one in found["orbits"]:
        w = one["parameter"]["w"]
        product = np.prod([complex(*m) for m in one["multipliers"]])
        impacts = 2 * (w < touching)
        assert product == pytest.approx(E**impacts * math.exp(-2 * Z * 2 * math.pi / w), rel=1e-6)


@pytest.mark.slow
def test_grazing_from_the_side_without_impacts() -> None:
    found = followed(STOP, period="2*pi/w", set={"w": 2.1}, over="F = 0.9 .. 1.1, 9")
    touching = D * abs(complex(1 - 2.1**2, 2 * Z * 2.1))
    assert kinds(found)[0] == "grazing" and found["special"][0]["value"] == pytest.approx(touching, abs=3e-8)


LYAPUNOV = """\
model Restricted
  dimensionless;
  parameter mu = 0.01215;
  coordinate x = 0.8234;
  coordinate y = 0;
  initial der(y) = 0.1263;
  kinetic 1/2*((der(x) - y)^2 + (der(y) + x)^2);
  potential -(1 - mu)/sqrt((x + mu)^2 + y^2) - mu/sqrt((x - 1 + mu)^2 + y^2);
  experiment(stop = 50);
end Restricted;
"""


def test_a_family_about_l1_meets_nothing() -> None:
    """Nothing happens to it between 0.01215 and 0.0125; multipliers without those of energy and phase are m and 1/m."""
    found = followed(LYAPUNOV, period=2.743, over="mu = 0.01215 .. 0.0125, 8")
    assert found["special"] == [] and len(found["orbits"]) == 8
    large = [max(abs(complex(*m)) for m in one["multipliers"]) for one in found["orbits"]]
    assert np.abs(np.diff(large)).max() < 20 and 2200 < min(large) < max(large) < 2500
    for one in found["orbits"]:
        assert len(one["multipliers"]) == 2
        # errors of 1e-7, times 2400
        assert np.prod([complex(*m) for m in one["multipliers"]]) == pytest.approx(1, abs=1e-3)


DUFFING = """\
model Duffing
  dimensionless;
  parameter w = 0.8;
  parameter F = 0.3;
  coordinate x = 0.5;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2 + 1/4*x^4;
  damping 0.1 on x;
  force F*cos(w*time) on x;
  experiment(stop = 30);
end Duffing;
"""


def test_the_fold_of_a_driven_duffing_oscillator() -> None:
    found = followed(DUFFING, period="2*pi/w", over="w = 0.8 .. 2, 25")
    assert kinds(found)[0] == "fold"

    def rate(t: float, y: np.ndarray, w: float) -> tuple[np.ndarray, np.ndarray]:
        f = np.array([y[1], -0.1 * y[1] - y[0] - y[0] ** 3 + 0.3 * math.cos(w * t)])
        return f, np.array([[0, 1], [-1 - 3 * y[0] ** 2, -0.1]])

    near = np.array([found["start"]["x"], found["start"]["der(x)"]])
    turn = critical(rate, near, found["special"][0]["value"], lambda w: 2 * math.pi / w, less(1))
    assert found["special"][0]["value"] == pytest.approx(turn, abs=1e-6)


def test_a_torus_of_a_driven_van_der_pol_oscillator() -> None:
    """It is entrained from an F on; below, the determinant exp of the integral of 0.2 (1 - x^2) is above 1."""
    text = DUFFING.replace("1/2*x^2 + 1/4*x^4", "1/2*x^2").replace("w = 0.8", "w = 1.1")
    text = text.replace("damping 0.1 on x;", "force 0.2*(1 - x^2)*der(x) on x;")
    found = followed(text, period="2*pi/w", over="F = 0.05 .. 1, 20")
    assert kinds(found) == ["torus"]

    def rate(t: float, y: np.ndarray, force: float) -> tuple[np.ndarray, np.ndarray]:
        f = np.array([y[1], 0.2 * (1 - y[0] ** 2) * y[1] - y[0] + force * math.cos(1.1 * t)])
        return f, np.array([[0, 1], [-1 - 0.4 * y[0] * y[1], 0.2 * (1 - y[0] ** 2)]])

    period = 2 * math.pi / 1.1
    near = root(lambda y: shoot(rate, y, period, 0.34)[0] - y, [0.0, -2.0]).x
    beginning = critical(rate, near, 0.337, lambda _: period, lambda m: float(np.linalg.det(m)) - 1)
    assert found["special"][0]["value"] == pytest.approx(beginning, abs=1e-8)


@pytest.mark.slow
def test_a_driven_pendulum_loses_its_symmetry_and_doubles_its_period() -> None:
    """Baker and Gollub's, q = 2, wD = 2/3."""

    def rate(t: float, y: np.ndarray, g: float) -> tuple[np.ndarray, np.ndarray]:
        f = np.array([y[1], -y[1] / 2 - math.sin(y[0]) + g * math.cos(2 * t / 3)])
        return f, np.array([[0, 1], [-math.cos(y[0]), -0.5]])

    model = mechc.load(EXAMPLES / "driven_pendulum.mech")
    found = followed(model, period="2*pi/wD", over="g = 0.9 .. 1.04, 8")
    assert kinds(found) == ["fork"]
    near = np.array([found["start"]["theta"], found["start"]["der(theta)"]])
    near = root(lambda y: shoot(rate, y, 3 * math.pi, 1.004)[0] - y, near).x

    # a root of higher order in the state, so that the parameter is found along the branch
    def on(g: float) -> float:
        y = root(lambda y: shoot(rate, y, 3 * math.pi, g)[0] - y, near, tol=1e-11).x
        return less(1)(shoot(rate, y, 3 * math.pi, g)[1])

    assert found["special"][0]["value"] == pytest.approx(brentq(on, 1.0, 1.01, xtol=1e-8), abs=1e-6)
    settled = model.section(set={"g": 1.05}, every="2*pi/wD", count=100)
    start = {name: float(settled.arrays[name][-1]) for name in ("theta", "der(theta)")}
    found = followed(model, period="2*pi/wD", over="g = 1.05 .. 1.075, 6", set=start)
    assert kinds(found) == ["period doubling"]
    near = np.array(list(start.values()))
    value = critical(rate, near, 1.066, lambda _: 3 * math.pi, less(-1))
    assert found["special"][0]["value"] == pytest.approx(value, abs=1e-7)


def test_a_pendulum_on_a_support_that_shakes() -> None:
    """Its rest doubles the period at the edges of Mathieu's first tongue."""
    model = mechc.load(EXAMPLES / "vertically_driven_pendulum.mech")
    found = followed(model, period="2*pi/w", over="w = 1.7 .. 2.4, 8")
    assert kinds(found) == ["period doubling", "period doubling"]
    edges = sorted(2 / math.sqrt(float(edge(1, 2 * 0.1))) for edge in (mathieu_a, mathieu_b))
    assert [one["value"] for one in found["special"]] == pytest.approx(edges, abs=1e-7)


def test_an_upright_pendulum_on_a_support_that_shakes() -> None:
    """Kapitza's: it stands between the edges a0 and b1 of Mathieu's equation, with a = -4/w^2 and q twice the amplitude."""
    model = mechc.load(EXAMPLES / "vertically_driven_pendulum.mech")
    found = followed(model, period="2*pi/w", set={"theta": math.pi, "w": 15}, over="a = 0.05 .. 0.6, 12")
    assert kinds(found) == ["fork", "period doubling"]
    edges = [
        brentq(lambda a: float(mathieu_a(0, 2 * a)) + 4 / 15**2, 0.05, 0.2, xtol=1e-14),
        brentq(lambda a: float(mathieu_b(1, 2 * a)) + 4 / 15**2, 0.3, 0.6, xtol=1e-14),
    ]
    assert [one["value"] for one in found["special"]] == pytest.approx(edges, abs=1e-7)


ROTOR = """\
model Rotor "an unbalanced disk on a shaft that has losses of its own"
  dimensionless;
  parameter w = 1.1;
  parameter still = 0.1 "damping outside";
  parameter turning = 0.2 "damping in the shaft, which turns with it";
  coordinate x = 0;
  coordinate y = 0;
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential 1/2*(x^2 + y^2);
  damping still on x;
  damping still on y;
  force -turning*(der(x) + w*y) + 0.1*w^2*cos(w*time) on x;
  force -turning*(der(y) - w*x) + 0.1*w^2*sin(w*time) on y;
  experiment(stop = 30);
end Rotor;
"""


def test_a_shaft_with_losses_of_its_own_begins_to_whirl() -> None:
    """Of x + i y: s^2 + (c + d) s + 1 - i d w has a root i where w = 1 + c/d, whatever the unbalance."""
    found = followed(ROTOR, period="2*pi/w", over="w = 1.1 .. 1.9, 9")
    assert kinds(found) == ["torus"]
    assert found["special"][0]["value"] == pytest.approx(1.5, abs=1e-9)


LORENZ = """\
model Lorenz
  dimensionless;
  parameter below = 0;
  let r = 350 - below;
  state x = 5;
  state y = 40;
  state z = 300;
  equation der(x) = 10*(y - x);
  equation der(y) = x*(r - z) - y;
  equation der(z) = x*y - 8/3*z;
  experiment(stop = 40);
end Lorenz;
"""


BESIDE_THE_FORK = "below = 0 .. 44, 3"
"""Steps of which one met an orbit without the symmetry behind the fork, so that no fork was told."""


@pytest.mark.parametrize("over", slow_but([BESIDE_THE_FORK], [BESIDE_THE_FORK, "below = 0 .. 60, 7"]))
def test_lorenz_s_orbit_loses_its_symmetry(over: str) -> None:
    """After half a period it is at -x, -y, z: that half has the multiplier -1 there, near r = 313 (C. Sparrow, 1982)."""
    found = followed(LORENZ, over=over)
    assert kinds(found) == ["fork"]

    def rate(t: float, y: np.ndarray, r: float) -> tuple[np.ndarray, np.ndarray]:
        f = np.array([10 * (y[1] - y[0]), y[0] * (r - y[2]) - y[1], y[0] * y[1] - 8 / 3 * y[2]])
        return f, np.array([[-10, 10, 0], [r - y[2], -1, -y[0]], [y[1], y[0], -8 / 3]])

    turn = np.diag([-1.0, -1.0, 1.0])

    def left(s: np.ndarray) -> np.ndarray:
        end, matrix = shoot(rate, s[:3], s[3], s[4])
        missing: np.ndarray = np.r_[turn @ end - s[:3], s[2] - s[4] + 1, less(-1)(turn @ matrix)]
        return missing

    at = 350 - found["special"][0]["value"]

    # stable at 316, where the second half begins as it passes z = r - 1 again
    def passes(t: float, y: np.ndarray) -> float:
        return float(y[2] - 315)

    passes.direction = 1  # type: ignore[attr-defined]
    settled = solve_ivp(
        lambda t, y: rate(t, y, 316)[0], (0, 20), [5, 40, 300], rtol=1e-9, atol=1e-9, events=passes
    )
    half = float(np.diff(settled.t_events[0][-2:])[0])
    solved = root(left, np.r_[settled.y_events[0][-1], half, at], tol=1e-11)
    assert np.abs(left(solved.x)).max() < 1e-6 and 312 < solved.x[4] < 314
    # orbits close within 1e-8, which near a fork leaves them beside the branch
    assert at == pytest.approx(solved.x[4], abs=1e-3 if over == BESIDE_THE_FORK else 1e-7)


SPRING = """\
model Spring "a mass on a spring that goes up and down, with no energy at rest"
  dimensionless;
  parameter k = 1.5;
  coordinate x = 0;
  coordinate z = 1 + 1/k + sqrt(0.18/k);
  kinetic 1/2*(der(x)^2 + der(z)^2);
  potential 1/2*k*(sqrt(x^2 + z^2) - 1)^2 - z + 1 + 1/(2*k);
  experiment(stop = 30);
end Spring;
"""


def test_a_mass_on_a_spring_begins_to_swing() -> None:
    """z = 1 + 1/k + A cos(sqrt(k) t) at any energy k A^2/2; beside it x'' + k (1 - 1/z) x = 0 doubles the period within a tongue."""
    found = followed(SPRING, period="2*pi/sqrt(k)", over="k = 1.5 .. 5, 8")
    assert kinds(found) == ["period doubling", "period doubling"]

    def test(k: float) -> float:
        def rate(t: float, y: np.ndarray, k: float) -> tuple[np.ndarray, np.ndarray]:
            pull = k - k / (1 + 1 / k + math.sqrt(0.18 / k) * math.cos(math.sqrt(k) * t))
            matrix = np.array([[0, 1], [-pull, 0]])
            return matrix @ y, matrix

        return less(-1)(shoot(rate, np.zeros(2), 2 * math.pi / math.sqrt(k), k)[1])

    edges = [brentq(test, 1.8, 2.2, xtol=1e-10), brentq(test, 4, 4.5, xtol=1e-10)]
    assert [one["value"] for one in found["special"]] == pytest.approx(edges, abs=1e-6)


HALO = """\
model Halo "restricted three bodies: Earth, Moon, and an orbit about L1; raised by h, as the energy is kept"
  dimensionless;
  parameter h = 0;
  coordinate x = 0.8234;
  coordinate y = 0;
  coordinate z = 0;
  initial der(y) = 0.1263;
  kinetic 1/2*((der(x) - y)^2 + (der(y) + x)^2 + der(z)^2);
  potential -(1 - 0.01215)/sqrt((x + 0.01215)^2 + y^2 + z^2) - 0.01215/sqrt((x - 1 + 0.01215)^2 + y^2 + z^2) + h;
  experiment(stop = 50);
end Halo;
"""


def test_halo_orbits_leave_the_family_about_l1() -> None:
    """Where the plane orbit has a vertical multiplier 1, at a Jacobi constant of 3.1743 (Earth and Moon)."""
    found = followed(HALO, period=2.743, energy=-1.587, over="h = -0.002 .. 0.003, 5")
    assert kinds(found) == ["fork"]
    mu = 0.01215

    def rates(t: float, s: np.ndarray) -> list[float]:
        x, y, vx, vy = s[:4]
        one, two = (1 - mu) / math.hypot(x + mu, y) ** 3, mu / math.hypot(x - 1 + mu, y) ** 3
        ax = x + 2 * vy - one * (x + mu) - two * (x - 1 + mu)
        ay = y - 2 * vx - (one + two) * y
        return [vx, vy, ax, ay, s[5], -(one + two) * s[4], s[7], -(one + two) * s[6]]

    def crossed(t: float, s: np.ndarray) -> float:
        return float(s[1]) if t > 0.1 else 1.0

    crossed.terminal, crossed.direction = True, -1  # type: ignore[attr-defined]

    def half(x: float, vy: float) -> np.ndarray:
        begin = [x, 0, 0, vy, 1, 0, 0, 1]
        y: np.ndarray = solve_ivp(
            rates, (0, 5), begin, method="DOP853", rtol=1e-12, atol=1e-13, events=crossed
        ).y[:, -1]
        return y

    def left(s: np.ndarray) -> list[float]:
        end = half(*s)
        # over a whole round of an orbit that is its own mirror, the trace is 2 + 4 b c of its half
        return [end[2], end[5] * end[6]]

    x, vy = root(left, [0.8234, 0.1263], tol=1e-12).x
    jacobi = x**2 + 2 * (1 - mu) / abs(x + mu) + 2 * mu / abs(x - 1 + mu) - vy**2
    assert jacobi == pytest.approx(3.1743, abs=1e-3)
    assert found["special"][0]["value"] == pytest.approx(jacobi / 2 - 1.587, abs=1e-7)


def normal_form(more: str, radius: str = "1 - x^2 - y^2") -> str:
    return f"""model Normal dimensionless; parameter mu = 0; state x = 0.95; state y = 0; {more}
        equation der(x) = x*({radius}) - y; equation der(y) = y*({radius}) + x; experiment(stop = 30); end Normal;"""


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        (normal_form("state z = 0; equation der(z) = mu*z - z^3;"), "fork", 0.0),
        (normal_form("state u = 0; state v = 0; equation der(u) = mu*u - 1.3*v; equation der(v) = mu*v + 1.3*u;"), "torus", 0.0),
        (normal_form("", "-(mu + 0.1) + (x^2 + y^2) - (x^2 + y^2)^2"), "fold", 0.15),
    ],
)  # fmt: skip
def test_normal_forms(text: str, kind: str, value: float) -> None:
    """A circle beside which a direction, or two that turn, lose stability; one that meets another, r^2 = 1/2."""
    found = followed(text, over="mu = -0.1 .. 0.2, 8")
    assert kinds(found) == [kind]
    assert found["special"][0]["value"] == pytest.approx(value, abs=1e-6 if kind == "fold" else 1e-10)


def test_roessler_s_band_doubles_its_period() -> None:
    """a = b = 0.2: at c = 2.832445 (e.g. in the manuals of AUTO and MatCont)."""
    text = """model R dimensionless; parameter c = 2.5; state x = 3; state y = 3; state z = 0.5; equation der(x) = -y - z;
        equation der(y) = x + 0.2*y; equation der(z) = 0.2 + z*(x - c); experiment(stop = 100); end R;"""
    found = followed(text, over="c = 2.5 .. 3, 6")
    assert kinds(found) == ["period doubling"]
    assert found["special"][0]["value"] == pytest.approx(2.832445, abs=1e-6)


BALL = """\
model Ball "bounces on a table that vibrates"
  dimensionless;
  parameter A = 0.03;
  parameter late = 0.05;
  coordinate z = 0.2;
  kinetic 1/2*der(z)^2;
  potential z;
  contact z - A*sin(2*pi*(time + late)) restitution 0.8;
  experiment(stop = 3);
end Ball;
"""


def test_a_bouncing_ball_doubles_its_period() -> None:
    """One impact in T = 1, v = 1/2 after it; the map of impacts in closed form, its determinant e^2."""
    e, w = 0.8, 2 * math.pi

    def test(rise: float) -> float:
        phase = math.acos((1 - e) / (1 + e) * 0.5 / (rise * w))
        up, fall, v = rise * w * math.cos(phase), -rise * w**2 * math.sin(phase), 0.5
        landing = v - 1 - up
        ds = np.array([(v - 1 - up) / landing, -1 / landing])
        dv = np.array([e * (ds[0] - 1), -e + e * ds[1]]) + (1 + e) * fall * ds
        return float(1 + ds[0] + dv[1] + e * e)

    rise = 0.02
    phase = math.acos((1 - e) / (1 + e) * 0.5 / (rise * w))
    start = {"late": phase / w - 0.3, "z": rise * math.sin(phase) + 0.35 - 0.245, "der(z)": -0.2}
    found = followed(BALL, period=1, set=start, over="A = 0.02 .. 0.08, 7")
    assert "period doubling" in kinds(found) and "torus" not in kinds(found)
    value = next(one["value"] for one in found["special"] if one["kind"] == "period doubling")
    assert value == pytest.approx(brentq(test, 0.02, 0.1, xtol=1e-13), abs=1e-8)


def test_orbits_of_conservative_models_have_no_bifurcations_by_rounding() -> None:
    text = (
        DUFFING.replace("damping 0.1 on x;", "")
        .replace("force F*cos(w*time) on x;", "")
        .replace("1/4*x^4", "F*x^4")
    )
    found = followed(text, over="F = 0.1 .. 1, 5")
    assert found["special"] == [] and all(one["multipliers"] == [] for one in found["orbits"])


def test_multipliers_on_the_unit_circle_are_no_tori() -> None:
    """The motion along y of Henon and Heiles, elliptic in x: a pair m, 1/m of size 1, which rounding puts on either side."""
    text = """model H dimensionless; parameter k = 1; coordinate x = 0; coordinate y = 0.2;
        kinetic 1/2*(der(x)^2 + der(y)^2); potential 1/2*(x^2 + y^2) + k*x^2*y - y^3/3; experiment(stop = 30); end H;"""
    found = followed(text, over="k = 0.2 .. 0.6, 9")
    assert found["special"] == []
    sizes = [abs(complex(*m)) for one in found["orbits"] for m in one["multipliers"]]
    assert len(sizes) == 18 and sizes == pytest.approx(18 * [1.0], abs=1e-6)
    assert all(abs(m[1]) > 1e-3 for one in found["orbits"] for m in one["multipliers"])


def test_multipliers_that_liouville_s_formula_contradicts_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """A linear map that is wrong by a thousandth."""
    from mechc.runtime.studies.flow import linearised, liouville

    right = linearised.determinant
    monkeypatch.setattr(liouville, "determinant", lambda found: (right(found)[0] * 1.001, right(found)[1]))
    found = mechc.loads(DUFFING).study("orbit", period="2*pi/w").summary()
    known = math.exp(-0.1 * 2 * math.pi / 0.8)
    assert any(f"and {known:.6g} by Liouville's formula" in remark for remark in found["remarks"])
    monkeypatch.undo()
    found = mechc.loads(DUFFING).study("orbit", period="2*pi/w").summary()
    assert not any("Liouville" in remark for remark in found["remarks"])
