"""Rows of the sources without an example of their own: a short model, a study, and the answer that the source states."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from closed_forms import integrate
from gallery import load
from scipy.special import mathieu_a, mathieu_b
from scipy.stats import ks_2samp

import mechc

G = 9.81


def final(text: str, **settings: Any) -> dict[str, float]:
    return mechc.loads(text).simulate(estimate_error=False, **settings).final()


def triple(found: Mapping[str, Any], name: str) -> np.ndarray[Any, Any]:
    return np.array([found[f"{name}[{k}]"] for k in (1, 2, 3)])


# ---------------------------------------------------------------- vectors and similarity


@pytest.mark.slow
def test_products_of_vectors() -> None:
    """U1: a x (b x c) = b (a.c) - c (a.b), also against NumPy's products."""
    text = """\
model Products
  dimensionless;
  parameter a[3] = {1.3, -0.4, 2.1};
  parameter b[3] = {0.2, 1.7, -0.9};
  parameter c[3] = {-1.1, 0.6, 0.5};
  output left[3] = cross(a, cross(b, c));
  output right[3] = b*dot(a, c) - c*dot(a, b);
  output volume = dot(a, cross(b, c));
  experiment(stop = 1);
end Products;
"""
    found = final(text)
    a, b, c = np.array([1.3, -0.4, 2.1]), np.array([0.2, 1.7, -0.9]), np.array([-1.1, 0.6, 0.5])
    assert triple(found, "left") == pytest.approx(np.cross(a, np.cross(b, c)), rel=1e-14)
    assert triple(found, "right") == pytest.approx(triple(found, "left"), rel=1e-14)
    assert found["volume"] == pytest.approx(a @ np.cross(b, c), rel=1e-14)


def test_derivative_of_a_triple_product() -> None:
    """U98: d/dt [r.(v x a)] = r.(v x da/dt), along a space curve."""
    text = """\
model Path
  dimensionless;
  let r = {cos(time), sin(2*time), time^3};
  output rate = der(dot(r, cross(der(r), der(r, 2))));
  output expected = dot(r, cross(der(r), der(der(r, 2))));
  experiment(stop = 1.3);
end Path;
"""
    found = final(text)
    t = 1.3
    r = np.array([math.cos(t), math.sin(2 * t), t**3])
    v = np.array([-math.sin(t), 2 * math.cos(2 * t), 3 * t * t])
    jerk = np.array([math.sin(t), -8 * math.cos(2 * t), 6])
    assert found["rate"] == pytest.approx(r @ np.cross(v, jerk), rel=1e-12)
    assert found["expected"] == pytest.approx(found["rate"], rel=1e-13)


def test_a_model_in_another_medium() -> None:
    """U25: at the same Reynolds number, a tenth of the size: in air ten times as fast with the same force, in water 0.645 times
    as fast with 3.225 times the force (the notes round to 0.64 and 3.2), at ten times the pressure a tenth of the force."""
    text = """\
model Scale
  parameter Density rho = 1.29 kg/m^3;
  parameter eta = 2e-5 Pa.s;
  parameter d = 1 m;
  parameter Re = 3e4;
  output speed = Re*eta/(rho*d);
  output drag = rho*speed^2*d^2*sqrt(1000/Re) "any drag coefficient of Re will do";
  experiment(stop = 1 s);
end Scale;
"""
    model = mechc.loads(text)

    def at(**values: str) -> dict[str, float]:
        return model.simulate(set=dict(values), estimate_error=False).final()

    whole, air = at(), at(d="0.1 m")
    water, thick = at(d="0.1 m", rho="1000 kg/m^3", eta="1e-3 Pa.s"), at(d="0.1 m", rho="12.9 kg/m^3")
    assert air["speed"] == pytest.approx(10 * whole["speed"]) and air["drag"] == pytest.approx(whole["drag"])
    assert water["speed"] / whole["speed"] == pytest.approx(0.645, rel=1e-12)
    assert water["drag"] / whole["drag"] == pytest.approx(3.225, rel=1e-12)
    assert thick["drag"] == pytest.approx(whole["drag"] / 10)


WELL = """\
model Well
  dimensionless;
  parameter m = 1;
  parameter k = 1;
  coordinate q = 0.7;
  kinetic 1/2*m*der(q)^2;
  potential {potential};
end Well;
"""


def test_similar_motions_take_similar_times() -> None:
    """U33: twice the mass takes sqrt(2) times as long, twice the potential 1/sqrt(2) times, on the same path; U81: the period of
    k q^4 is sqrt(m/2E) (E/k)^(1/4) B(1/4, 1/2), at twice the energy 0.8408964 of it."""
    quartic = mechc.loads(WELL.format(potential="k*q^4"))
    beta = math.gamma(0.25) * math.gamma(0.5) / math.gamma(0.75)
    assert beta == pytest.approx(5.2441151, abs=5e-8)

    def period(**settings: Any) -> float:
        return float(quartic.period(**settings)["period"])

    plain = period()
    assert period(set={"m": 2}) / plain == pytest.approx(math.sqrt(2), rel=1e-11)
    assert period(set={"k": 2}) / plain == pytest.approx(1 / math.sqrt(2), rel=1e-11)
    one, two = period(energy=1.0), period(energy=2.0)
    assert one == pytest.approx(math.sqrt(0.5) * beta, rel=1e-11)
    assert two / one == pytest.approx(0.8408964, abs=5e-8)
    assert period(energy=1.0, set={"k": 2}) / one == pytest.approx(2**-0.25, rel=1e-11)


# ---------------------------------------------------------------- one coordinate


def test_small_oscillations_about_a_minimum() -> None:
    """U10: k = V''(a), w = sqrt(k/m): of m = 3 about the minima of q^4/4 - q^2/2, V'' = 2 at 1."""
    model = mechc.loads(WELL.format(potential="k*(q^4/4 - q^2/2)"))
    (mode,) = model.modes(at="q = 1", set={"m": 3}).summary()["modes"]
    assert mode["frequency"] == pytest.approx(math.sqrt(2 / 3), rel=1e-14)


def test_period_by_integration() -> None:
    """T3, U78: T = 2 pi sqrt(m/(2 (V0 + E))) in V0 tan^2 x, and 2 pi sqrt(m/(2 V0)) at small amplitudes."""
    model = mechc.loads(WELL.format(potential="k*tan(q)^2"))
    for m, k, energy in ((1, 1, 0.5), (3, 2, 5.0)):
        exact = 2 * math.pi * math.sqrt(m / (2 * (k + energy)))
        assert model.period(set={"m": m, "k": k}, energy=energy)["period"] == pytest.approx(exact, rel=1e-12)
    (mode,) = model.modes(at="q = 0", set={"m": 3, "k": 2}).summary()["modes"]
    assert 2 * math.pi / mode["frequency"] == pytest.approx(2 * math.pi * math.sqrt(3 / 4), rel=1e-13)


def test_parabola_of_safety() -> None:
    """U12: thrown with v0 in any direction, the highest place at a distance rho is on g^2 rho^2 = v0^4 - 2 g v0^2 z."""
    text = """\
model Shell
  dimensionless;
  parameter angle = 1;
  parameter v0 = 12;
  parameter rho = 8;
  coordinate x = 0;
  coordinate z = 0;
  initial der(x) = v0*cos(angle);
  initial der(z) = v0*sin(angle);
  kinetic 1/2*(der(x)^2 + der(z)^2);
  potential 9.81*z;
  when x > rho then
    terminate("there");
  end when;
  experiment(stop = 100);
end Shell;
"""
    model = mechc.loads(text)
    for rho in (4.0, 8.0):
        found = model.optimum(vary="angle = 0.2 .. 1.5", goal="z", set={"rho": rho})
        assert found["z"] == pytest.approx((12**4 - G**2 * rho**2) / (2 * G * 12**2), rel=1e-9)


@pytest.mark.parametrize(("rho", "below"), [(4.0, 0.5), (9.0, 2.0), (13.0, 0.1), (-6.0, 3.0)])
def test_every_place_below_it_is_reached_by_two_shells(rho: float, below: float) -> None:
    """U12: tan(angle) = (v0^2 +- sqrt(v0^4 - g (g rho^2 + 2 z v0^2)))/(g rho); no shell comes above the parabola."""
    z = (12**4 - G**2 * rho**2) / (2 * G * 12**2) - below
    root = math.sqrt(12**4 - G * (G * rho**2 + 2 * z * 12**2))
    angles = [math.atan2((12**2 + s * root) * np.sign(rho), G * abs(rho)) for s in (1, -1)]
    for angle in angles:
        angle = angle if rho > 0 else math.pi + angle
        solution = load("parabola_of_safety").simulate(set={"angle": angle})
        t = rho / (12 * math.cos(angle))
        assert solution(t)["x"] == pytest.approx(rho, abs=1e-9) and solution(t)["z"] == pytest.approx(
            z, abs=1e-9
        )
        assert (solution["z"] <= solution["safe"] + 1e-9).all()


def test_stability_of_mathieus_equation() -> None:
    """U90: x'' + (a - 2 q cos 2t) x = 0 is stable between the characteristic values a_n(q) and b_(n+1)(q); the vertically driven
    pendulum with w0 = 1 has a = 4/w^2, q = 2 * drive."""
    text = """\
model Mathieu
  dimensionless;
  parameter a = 1;
  parameter q = 0.7;
  coordinate x = 0;
  kinetic 1/2*der(x)^2;
  potential 1/2*(a - 2*q*cos(2*time))*x^2;
end Mathieu;
"""
    model = mechc.loads(text)
    found = model.floquet(period=math.pi, over="a = 0.1 .. 3").summary()
    exact = [float(mathieu_b(1, 0.7)), float(mathieu_a(1, 0.7))]
    assert [edge[0] for edge in found["edges"] if edge[0] < 2.5] == pytest.approx(exact, abs=1e-7)
    middle = model.floquet(period=math.pi, set={"a": 2.2}).summary()["multipliers"]
    assert [abs(complex(*m)) for m in middle] == pytest.approx([1, 1], abs=1e-9)
    inside = model.floquet(period=math.pi, set={"a": 1.0}).summary()["multipliers"]
    assert max(abs(complex(*m)) for m in inside) > 1.5
    assert np.prod([complex(*m) for m in inside]) == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("damping", [0.0, 0.2])
def test_volume_of_states(damping: float) -> None:
    """U149: kept without damping (Liouville), exp(-gamma t) with it."""
    text = WELL.format(potential="-cos(q)").replace("end Well", f"damping {damping} on q; end Well")
    found = mechc.loads(text).volume(stop=5).summary()
    assert found["values"]["ratio"] == pytest.approx(math.exp(-5 * damping), rel=1e-7)


HORIZONTAL = {"w": 2.0, "gamma": 0.3}
"""Of the horizontally driven pendulum: a cycle at a drive of 1, a strange attractor at 2."""


@pytest.mark.parametrize(
    ("example", "drive", "sign", "others"),
    [
        ("driven_pendulum", {"g": 0.9}, -1, {}),
        ("driven_pendulum", {"g": 1.15}, 1, {}),
        ("forced_pendulum", {"a": 1.0}, -1, HORIZONTAL),
        ("forced_pendulum", {"a": 2.0}, 1, HORIZONTAL),
    ],
)
def test_neighbours_on_a_cycle_and_on_a_strange_attractor(
    example: str, drive: dict[str, float], sign: int, others: dict[str, float]
) -> None:
    """U151: neighbours come together on a limit cycle and part on a strange attractor, driven by a torque or at the support."""
    found = load(example).lyapunov(set=drive | others, time=1500, count=1).summary()
    assert sign * found["exponents"][0] > 2 * found["confidence"][0]
    if example == "forced_pendulum" and sign < 0:
        assert found["exponents"][0] == pytest.approx(-0.15, abs=2 * found["confidence"][0])  # -gamma/2


def test_a_strange_attractor_is_the_same_from_any_start() -> None:
    """U151: the stroboscopic points of 4000 turns fill it alike from three starts, and those of another drive do not (statistic of
    Kolmogorov and Smirnov, of which 0.05 has a chance of 1e-4 for independent points)."""
    model = load("forced_pendulum")

    def points(drive: float, **start: float) -> tuple[np.ndarray[Any, Any], ...]:
        settings = (
            HORIZONTAL | {"a": drive} | {name.replace("rate", "der(theta)"): v for name, v in start.items()}
        )
        found = model.section(every="2*pi/w", count=4000, set=settings).arrays
        return np.mod(found["theta"][300:] + np.pi, 2 * np.pi), found["der(theta)"][300:]

    def apart(one: tuple[np.ndarray[Any, Any], ...], other: tuple[np.ndarray[Any, Any], ...]) -> float:
        return max(float(ks_2samp(a, b).statistic) for a, b in zip(one, other, strict=True))

    first = points(2.0)
    for start in ({"theta": 2.0, "rate": -1.0}, {"theta": 1.0, "rate": 3.0}):
        assert apart(first, points(2.0, **start)) < 0.05
    assert apart(first, points(3.0)) > 0.08


# ---------------------------------------------------------------- principles


def test_gauge_terms_change_nothing() -> None:
    """U68, T1: L + df/dt, f = m V x + m V^2 t/2 of a boost and f = x^2 sin(t), gives the same motion, q'' = -q^3."""
    plain = WELL.format(potential="q^4/4")
    gauge = plain.replace(
        "end Well", "lagrangian m*0.3*der(q) + m*0.3^2/2 + 2*q*der(q)*sin(time) + q^2*cos(time); end Well"
    )
    t = np.linspace(0, 5, 50)
    exact = integrate(lambda t, y: [y[1], -(y[0] ** 3)], [0.7, 0], t)[0]
    for text in (plain, gauge):
        assert np.abs(mechc.loads(text).simulate(stop=5, tolerance=1e-11)(t)["q"] - exact).max() < 1e-9


def test_a_boost_adds_a_rate_to_the_lagrangian() -> None:
    """U68: seen from axes that go with V, the kinetic energy is larger by m V.r' + m V^2/2, the motion is the same."""
    text = """\
model Boost
  dimensionless;
  coordinate x = 0.7;
  coordinate y = 0;
  initial der(y) = 0.4;
  frame car = world * trans({0.3*time, -0.5*time});
  mass 2 at car * {x, y};
  potential x^4/2 + y^4/2;
  output p[2] = {momentum(x), momentum(y)};
  experiment(stop = 5, tolerance = 1e-11);
end Boost;
"""
    solution = mechc.loads(text).simulate()
    t, u, v = solution.time, solution["der(x)"], solution["der(y)"]
    expected = integrate(lambda t, s: [s[2], s[3], -(s[0] ** 3), -(s[1] ** 3)], [0.7, 0, 0, 0.4], t)
    assert solution["x"] == pytest.approx(expected[0], abs=1e-9)
    assert solution["y"] == pytest.approx(expected[1], abs=1e-9)
    gained = 2 * (0.3 * u - 0.5 * v) + 0.3**2 + 0.5**2
    assert solution["energy.kinetic"] == pytest.approx(u**2 + v**2 + gained, rel=1e-13)
    assert solution["p[1]"] == pytest.approx(2 * (u + 0.3), rel=1e-13)
    assert solution["p[2]"] == pytest.approx(2 * (v - 0.5), rel=1e-13)


def test_generalised_forces() -> None:
    """P2: a force at a point does the work F.dr: of a rod with a weight and a force F across its end, m l^2 theta'' = F l cos(theta)
    - m g l sin(theta)."""
    text = """\
model Rod
  dimensionless;
  coordinate theta = 0.6;
  frame tip = world * rot(theta) * trans({0, -1.5});
  mass 2 at tip;
  gravity {0, -9.81};
  force {3, 0} on tip;
  output acceleration = der(theta, 2);
  experiment(stop = 1);
end Rod;
"""
    solution = mechc.loads(text).simulate(estimate_error=False)
    theta = solution["theta"]
    exact = (3 * 1.5 * np.cos(theta) - 2 * G * 1.5 * np.sin(theta)) / (2 * 1.5**2)
    assert np.abs(solution["acceleration"] - exact).max() < 1e-11


def test_multipliers_of_rates() -> None:
    """P6: a skate cannot move across itself: on a slope it goes (g sin(slope)/(2 w^2)) sin(w t)^2 down and stays in a strip."""
    text = """\
model Skate
  dimensionless;
  parameter w = 2;
  coordinate x = 0;
  coordinate y = 0;
  coordinate phi = 0;
  initial der(phi) = w;
  kinetic 1/2*(der(x)^2 + der(y)^2) + 1/2*der(phi)^2;
  potential -5*x;
  constraint edge: der(x)*sin(phi) = der(y)*cos(phi);
  output push = multiplier(edge);
  experiment(stop = 6, tolerance = 1e-11);
end Skate;
"""
    solution = mechc.loads(text).simulate()
    t = solution.time
    assert np.abs(solution["x"] - 5 / (2 * 4) * np.sin(2 * t) ** 2).max() < 1e-8
    assert np.abs(solution["y"] - 5 / (2 * 4) * (2 * t - np.sin(4 * t) / 2)).max() < 1e-8
    # across itself: v w + 5 sin(phi), v = (5/2) sin(2 t)
    assert np.abs(np.abs(solution["push"]) - np.abs(10 * np.sin(2 * t))).max() < 1e-7


@pytest.mark.parametrize(("points", "freedoms"), [(2, 5), (3, 6)])
def test_rigid_points_lose_a_freedom_for_each_distance(points: int, freedoms: int) -> None:
    """U39: a dumbbell has 5 degrees of freedom; U40: a rigid triangle has 6."""
    rows = ["model Points", "  dimensionless;"]
    for i in range(points):
        place = (math.cos(2 * math.pi * i / points), math.sin(2 * math.pi * i / points), 0.0)
        rows += [f"  coordinate {c}{i} ~ {p!r};" for c, p in zip("xyz", place, strict=True)]
        rows += [f"  kinetic 1/2*(der(x{i})^2 + der(y{i})^2 + der(z{i})^2);"]
    side = 2.0 if points == 2 else math.sqrt(3)
    rows += [
        f"  constraint d{i}{j}: (x{i} - x{j})^2 + (y{i} - y{j})^2 + (z{i} - z{j})^2 = {side!r}^2;"
        for i in range(points) for j in range(i)
    ]  # fmt: skip
    found = mechc.loads("\n".join([*rows, "end Points;"])).kinematics()
    assert found.summary()["freedoms"] == freedoms and f"{freedoms} degrees of freedom" in str(found)


# ---------------------------------------------------------------- bodies


def test_kinetic_energy_about_any_point() -> None:
    """U117, of 6 freedoms: T = M V^2/2 + M r_cm.(V x w) + w.I w/2, with V the velocity of any point of the body and I about it."""
    text = """\
import mech.spatial.*;
model Loose
  Body b(m = 2 kg, J = diag({0.3, 0.5, 0.4})*(1 kg.m^2), com = {0.2, -0.1, 0.3} m);
  Free free(world -> b.a, der(position) = {1, -2, 0.5} m/s, der(orientation) = {0.7, -1.1, 2} rad/s);
  experiment(stop = 0.001 s);
end Loose;
"""
    model = mechc.loads(text)
    assert model.kinematics().summary()["freedoms"] == 6
    solution = model.simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    c, v, w = np.array([0.2, -0.1, 0.3]), np.array([1, -2, 0.5]), np.array([0.7, -1.1, 2])
    inertia = np.diag([0.3, 0.5, 0.4]) + 2 * (c @ c * np.eye(3) - np.outer(c, c))
    exact = 2 * v @ v / 2 + 2 * c @ np.cross(v, w) + w @ inertia @ w / 2
    assert solution["energy.kinetic"][0] == pytest.approx(exact, rel=1e-13)


def test_torque_about_another_point() -> None:
    """U131: dP/dt = F, dl/dt = N, and about a point displaced by a the torque is N - a x F."""
    text = """\
import mech.spatial.*;
model Pushed
  Body b(m = 2 kg, J = diag({0.3, 0.5, 0.4})*(1 kg.m^2));
  Free free(world -> b.a, der(position) = {1, -2, 0.5} m/s, der(orientation) = {0.7, -1.1, 2} rad/s);
  frame tip = b.a * trans({0.4, 0.1, -0.2} m);
  force {3, -1, 2} N on tip;
  output P[3] = 2 kg*vel(b.a);
  output l[3] = cross(pos(b.a), 2 kg*vel(b.a)) + (1 kg.m^2)*(0.3*angvel(b.a, b.a)[1]*direction(b.a, {1, 0, 0}) + 0.5*angvel(b.a, b.a)[2]*direction(b.a, {0, 1, 0})\n      + 0.4*angvel(b.a, b.a)[3]*direction(b.a, {0, 0, 1}));
  output at[3] = pos(tip);
  experiment(stop = 1 s, tolerance = 1e-11);
end Pushed;
"""
    solution = mechc.loads(text).simulate(estimate_error=False)
    t, h, force = 0.5, 1e-3, np.array([3.0, -1.0, 2.0])

    def rate(name: str, of: np.ndarray[Any, Any] | None = None) -> np.ndarray[Any, Any]:
        rows = []
        for s in (-2, -1, 1, 2):
            found = solution(t + s * h)
            value = triple(found, name)
            rows.append(value if of is None else value - np.cross(of, triple(found, "P")))
        return np.asarray((rows[0] - 8 * rows[1] + 8 * rows[2] - rows[3]) / (12 * h))

    place = triple(solution(t), "at")
    assert rate("P") == pytest.approx(force, abs=1e-8)
    assert rate("l") == pytest.approx(np.cross(place, force), abs=1e-7)
    a = np.array([0.3, 0.7, -0.4])
    assert rate("l", a) == pytest.approx(np.cross(place, force) - np.cross(a, force), abs=1e-7)


def test_poinsots_motion() -> None:
    """P12: of a free body w.I w and |I w| stay; the axis of rotation moves where ellipsoid and sphere meet."""
    text = """\
import mech.spatial.*;
model Thrown
  Body b(m = 1 kg, J = diag({1, 2, 2.5})*(1 kg.m^2));
  Free free(world -> b.a, der(orientation) = {0.1, 3, -0.2} rad/s);
  experiment(stop = 20 s, tolerance = 1e-11);
end Thrown;
"""
    solution = mechc.loads(text).simulate()
    w = np.array([solution[f"der(free.orientation)[{k}]"] for k in (1, 2, 3)])
    moments = np.array([1, 2, 2.5])[:, None]
    energy, momentum = (moments * w**2).sum(axis=0), (moments**2 * w**2).sum(axis=0)
    assert np.ptp(energy) < 1e-8 * energy[0] and np.ptp(momentum) < 1e-8 * momentum[0]
    assert np.ptp(w[1]) > 5  # about its middle axis it turns over

    def euler(_: float, w: np.ndarray[Any, Any]) -> list[float]:
        return [
            -0.5 * w[1] * w[2],
            1.5 * w[2] * w[0] / 2,
            -1 * w[0] * w[1] / 2.5,
        ]  # I1 w1' + (I3 - I2) w2 w3 = 0

    assert w == pytest.approx(integrate(euler, [0.1, 3, -0.2], solution.time), abs=1e-6)


def test_a_virial_of_forces() -> None:
    """P1: <T> = -<F.r>/2, in a potential whose force is no power of r."""
    text = """\
model Plane
  dimensionless;
  coordinate x = 1;
  coordinate y = 0;
  initial der(y) = 0.6;
  let r = sqrt(x^2 + y^2);
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential log(1 + r^2);
  output virial = -2*r^2/(1 + r^2) "F.r";
  experiment(stop = 400);
end Plane;
"""
    found = mechc.loads(text).virial(of="virial")
    (error,) = (value.error for value in found.values if value.name == "virial")
    assert error is not None and error < 1e-5
    assert found["energy.kinetic"] == pytest.approx(-found["virial"] / 2, abs=2 * error)


@pytest.mark.slow
def test_fall_to_the_centre() -> None:
    """T4: it reaches the centre if r^2 U -> -c with c > M^2/(2 m): of U = -1/r^2 - 1/r below the speed sqrt(2) across."""
    text = """\
model Falling
  dimensionless;
  coordinate r = 1;
  coordinate phi = 0;
  initial der(r) = -0.1;
  parameter across = 1;
  initial der(phi) = across;
  kinetic 1/2*(der(r)^2 + r^2*der(phi)^2);
  potential -1/r^2 - 1/r;
  when r < 1e-3 then
    terminate("fallen");
  end when;
  experiment(stop = 200);
end Falling;
"""
    found = mechc.loads(text).threshold(over="across = 1 .. 2, 6", tolerance=1e-9).summary()
    (one,) = found["thresholds"]
    # it has to get to 1e-3, where M^2/(2 r^2) exceeds 1/r^2 by up to 1/r
    exact = float(np.roots([0.5 * (1e6 - 1), 0, -(1e6 + 1e3) - 0.005 + 2]).max())
    assert one["below"] and one["parameter"]["across"] == pytest.approx(exact, rel=1e-8)
    assert exact == pytest.approx(math.sqrt(2), abs=2e-3)
