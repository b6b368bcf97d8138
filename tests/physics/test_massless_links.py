"""Mechanisms with links without mass: the constraints decide their accelerations. Against SciPy with one freedom."""

from __future__ import annotations

import re
import runpy
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from mechc.runtime.outcome import Outcome

SLIDER = """
import mech.planar.*;
parameter rod_mass = {rod} kg;
parameter J = 0.02 kg.m^2;
parameter m = 2 kg;
gravity {{0, -9.81 m/s^2}};
Bar rod(m = rod_mass, l = 0.3 m);
Body crank(m = 0 kg, J = J);
Particle slider(m = m);
Revolute main(world -> crank.a, angle = {angle} rad, der(angle) = {rate} rad/s);
Revolute pin(crank.a * trans({{0.1 m, 0 m}}) -> rod.a, angle ~ -0.4 rad);
Prismatic guide(world -> slider.a, position ~ 0.39 m);
Revolute wrist(rod.b -> slider.a);
{more}
experiment(stop = 1 s, tolerance = 1e-12);
"""
J, M, R, L = 0.02, 2.0, 0.1, 0.3


def slider(angle: float) -> tuple[float, float, float]:
    """Place of the slider and its derivatives by the angle of the crank."""
    s, c = np.sin(angle), np.cos(angle)
    q = np.sqrt(L * L - (R * s) ** 2)
    second = -R * c - R * R * (c * c - s * s) / q - (R * R * s * c) ** 2 / q**3
    return R * c + q, -R * s - R * R * s * c / q, second


def crank(angle: float, rate: float, time: np.ndarray) -> np.ndarray:
    """Angles of the crank: (J + m x'^2) a'' + m x' x'' a'^2 = 0."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        _, first, second = slider(y[0])
        return [y[1], -M * first * second * y[1] ** 2 / (J + M * first**2)]

    found = solve_ivp(rates, (0, time[-1]), [angle, rate], "DOP853", time, rtol=1e-13, atol=1e-14)
    return np.asarray(found.y[0])


@pytest.mark.parametrize(
    ("angle", "method"),
    [(0.3, "dop853"), (0.0, "taylor"), pytest.param(0.0, "radau5", marks=pytest.mark.slow)],
)
def test_slider_crank_with_a_massless_rod(angle: float, method: str) -> None:
    """Through both dead centres, and from one. Measured: 2e-11 after 1 s."""
    run = mechc.loads(SLIDER.format(rod=0, angle=angle, rate=10, more="")).simulate(method=method)
    assert run.outcome is Outcome.COMPLETED and not run.remarks
    exact = crank(angle, 10, run.time)
    assert exact[-1] > 2.5 * np.pi
    assert run["main.angle"] == pytest.approx(exact, abs=1e-9)
    assert run["guide.position"] == pytest.approx([slider(x)[0] for x in exact], abs=1e-9)
    drift = run.accuracy.energy
    assert drift is not None and drift.relative is not None and drift.relative < 1e-10


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_weights_follow_the_masses(scale: float) -> None:
    model = mechc.loads(SLIDER.format(rod=0, angle=0.3, rate=10, more=""))
    run = model.simulate(set={"J": J * scale, "m": M * scale})
    assert run["main.angle"] == pytest.approx(crank(0.3, 10, run.time), abs=1e-9)


def test_a_rod_that_loses_its_mass_by_a_setting() -> None:
    """The model is built for a rod with mass; without it the run begins again, alone and among the members of an ensemble."""
    model = mechc.loads(SLIDER.format(rod=0.5, angle=0.3, rate=10, more=""))
    run = model.simulate(set={"rod_mass": 0})
    assert run["main.angle"] == pytest.approx(crank(0.3, 10, run.time), abs=1e-9)
    assert any("mass matrix is singular at t = 0" in remark for remark in run.remarks)
    many = model.ensemble(vary={"rod_mass": [0.0, 0.5]}, keep="final(main.angle)")
    assert float(many["final(main.angle)"][0]) == pytest.approx(crank(0.3, 10, run.time)[-1], abs=1e-9)


def test_a_module_of_a_rod_that_loses_its_mass(tmp_path: Path) -> None:
    model = mechc.loads(SLIDER.format(rod=0.5, angle=0.3, rate=10, more="")).with_values({"rod_mass": 0.0})
    (file,) = model.compile("python", tmp_path / "massless.py")
    motion = runpy.run_path(str(file))["simulate"]()
    assert motion["main.angle"] == pytest.approx(crank(0.3, 10, np.asarray(motion["time"])), abs=1e-7)


def test_a_slider_that_hits() -> None:
    """The impulse goes through the massless rod: with one freedom the rate of the crank turns round times -e."""
    text = SLIDER.format(
        rod=0, angle=0.3, rate=-5, more="contact wall: 0.398 m - guide.position restitution 0.5;"
    )
    run = mechc.loads(text).simulate()
    hit = next(e.time for e in run.events if e.kind == "impact")
    rate = run["der(main.angle)"]
    before, after = rate[run.time <= hit][-2], rate[run.time >= hit][1]
    step = run.time[1]  # (J + m x'^2) a'^2 is constant on either side
    assert after == pytest.approx(-0.5 * before, rel=10 * step)
    last = crank_after(run.time, hit)
    assert run["main.angle"][-1] == pytest.approx(last, abs=1e-9)


def crank_after(time: np.ndarray, hit: float) -> float:
    """The angle at the end with one impact at the time ``hit``."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        _, first, second = slider(y[0])
        return [y[1], -M * first * second * y[1] ** 2 / (J + M * first**2)]

    tight = {"rtol": 1e-13, "atol": 1e-14}
    first = solve_ivp(rates, (0, hit), [0.3, -5], "DOP853", **tight).y[:, -1]
    assert slider(first[0])[0] == pytest.approx(0.398, abs=1e-10)
    return float(solve_ivp(rates, (hit, time[-1]), [first[0], -0.5 * first[1]], "DOP853", **tight).y[0, -1])


def test_an_impulse_on_the_crank() -> None:
    more = "when main.angle > 1 rad then impulse 0.1 N.m.s on main.angle; end when;"
    run = mechc.loads(SLIDER.format(rod=0, angle=0.3, rate=10, more=more)).simulate()
    at = int(np.argmin(np.abs(run.time - run.events[0].time)))
    rate = run["der(main.angle)"][at - 2 : at + 3]
    jump = 0.1 / (J + M * slider(1.0)[1] ** 2)
    assert np.max(np.diff(rate)) == pytest.approx(jump, rel=1e-6)


def test_modes_beside_a_massless_rod() -> None:
    more = "potential 25 J*(main.angle - 0.7)^2;"
    model = mechc.loads(SLIDER.format(rod=0, angle=0.7, rate=0, more=more))
    expected = np.sqrt(50 / (J + M * slider(0.7)[1] ** 2))
    assert f"{expected:.7g}" in str(model.modes())


FOUR_BAR = """
import mech.planar.*;
gravity {0, -9.81 m/s^2};
Body crank(m = 0 kg, J = 0.05 kg.m^2);
Bar coupler(m = 0 kg, l = 0.5 m);
Bar rocker(m = 0 kg, l = 0.4 m);
Revolute a(world -> crank.a, angle = 1 rad, der(angle) = 12 rad/s);
Revolute b(crank.a * trans({0.15 m, 0 m}) -> coupler.a, angle ~ -1 rad);
Revolute d(world * trans({0.55 m, 0 m}) -> rocker.a, angle ~ 1.5 rad);
Revolute c(coupler.b -> rocker.b);
mass 1.5 kg at coupler.a * {0.2 m, 0.1 m};
experiment(stop = 1 s, tolerance = 1e-12);
"""


def four_bar(_: float, y: np.ndarray) -> list[float]:
    """Rates of the crank with a point mass on the coupler, in complex numbers: e^(ib) is the coupler, e^(ig) the rocker."""
    tip = 0.15 * np.exp(1j * y[0])
    far = 0.55 - tip
    b = np.angle(far) + np.arccos((0.25 + abs(far) ** 2 - 0.16) / (2 * 0.5 * abs(far)))
    coupler = 0.5 * np.exp(1j * b)
    rocker = tip + coupler - 0.55
    columns = np.array([[-coupler.imag, rocker.imag], [coupler.real, -rocker.real]])

    def rates(z: complex) -> np.ndarray:
        return np.linalg.solve(columns, [-z.real, -z.imag])

    b1, g1 = rates(1j * tip)
    b2, _g2 = rates(-tip - coupler * b1**2 + rocker * g1**2)
    place = np.exp(1j * b) * (0.2 + 0.1j)
    first, second = 1j * tip + 1j * place * b1, -tip - place * b1**2 + 1j * place * b2
    effort = -1.5 * ((first * second.conjugate()).real * y[1] ** 2 + 9.81 * first.imag)
    return [y[1], effort / (0.05 + 1.5 * abs(first) ** 2)]


def test_four_bar_with_two_massless_links() -> None:
    run = mechc.loads(FOUR_BAR).simulate()
    exact = solve_ivp(four_bar, (0, 1), [1, 12], "DOP853", run.time, rtol=1e-13, atol=1e-14).y[0]
    assert exact[-1] > 4 * np.pi
    assert run["a.angle"] == pytest.approx(exact, abs=1e-9)


ZERO = """
parameter J = {J} kg.m^2;
coordinate Angle a ~ 0 rad;
state Angle s = 0 rad;
equation der(s) = 1 rad/s;
kinetic 1/2*J*der(a)^2;
constraint a = s;
experiment(stop = 1 s);
"""


@pytest.mark.parametrize("stated", [0, 1])
def test_a_moment_of_inertia_of_zero(stated: int) -> None:
    run = mechc.loads(ZERO.format(J=stated)).simulate(set={"J": 0})
    assert run.outcome is Outcome.COMPLETED
    assert run["a"] == pytest.approx(run.time, abs=1e-12)


KINEMATIC = """
import mech.planar.*;
Bar rod(m = 0 kg, l = 0.3 m);
Body crank(m = 0 kg, J = 0 kg.m^2);
Particle slider(m = 0 kg);
Revolute main(world -> crank.a);
Revolute pin(crank.a * trans({0.1 m, 0 m}) -> rod.a, angle ~ -0.4 rad);
Prismatic guide(world -> slider.a, position ~ 0.39 m);
Revolute wrist(rod.b -> slider.a);
drive main.angle = 0.3 rad + 10 rad/s*time;
experiment(stop = 1 s, tolerance = 1e-11);
"""


def test_a_driven_mechanism_without_any_mass() -> None:
    """Forces and energies are zero, up to rounding that must not choose the steps."""
    run = mechc.loads(KINEMATIC).simulate()
    assert run.outcome is Outcome.COMPLETED
    angle = 0.3 + 10 * run.time
    assert run["guide.position"] == pytest.approx([slider(x)[0] for x in angle], abs=1e-9)
    assert run.statistics.steps < 200


SPATIAL = """
import mech.spatial.*;
gravity {{0, 0, -9.81 m/s^2}};
Body crank(m = 0 kg, J = diag({{0.05, 0.05, 0.05}} kg.m^2));
Bar rod(m = 0 kg, l = 0.8 m);
Revolute main(world -> crank.a, axis = {{0, 0, 1}}, angle = 0.3 rad, der(angle) = 8 rad/s);
{joint} pin(crank.a * trans({{0.2 m, 0 m, 0 m}}) -> rod.a);
Particle slider(m = 2 kg);
Prismatic guide(world * trans({{0 m, 0.1 m, 0.2 m}}) -> slider.a, axis = {{1, 0, 0}}, position ~ 0.9 m);
Spherical wrist(rod.b -> slider.a);
experiment(stop = 1 s, tolerance = 1e-12);
"""


def test_a_massless_rod_in_space() -> None:
    run = mechc.loads(SPATIAL.format(joint="Universal")).simulate()
    assert run.outcome is Outcome.COMPLETED

    def rates(_: float, y: np.ndarray) -> list[float]:
        s, c = 0.2 * np.sin(y[0]), 0.2 * np.cos(y[0])
        q = np.sqrt(0.64 - (s - 0.1) ** 2 - 0.04)
        first = -s - (s - 0.1) * c / q
        second = -c - (c * c - (s - 0.1) * s) / q - ((s - 0.1) * c) ** 2 / q**3
        return [y[1], -2 * first * second * y[1] ** 2 / (0.05 + 2 * first**2)]

    exact = solve_ivp(rates, (0, 1), [0.3, 8], "DOP853", run.time, rtol=1e-13, atol=1e-14).y[0]
    assert run["main.angle"] == pytest.approx(exact, abs=1e-9)


def loose() -> str:
    more = "Bar tail(m = 0 kg, l = 0.2 m); Revolute joint(crank.a -> tail.a, angle = 0.2 rad);"
    with pytest.raises(mechc.CompileError) as raised:
        mechc.loads(SLIDER.format(rod=0, angle=0.3, rate=10, more=more)).simulate()
    return str(raised.value)


def without_any_inertia() -> str:
    model = mechc.loads(SLIDER.format(rod=0, angle=0.3, rate=10, more=""))
    return model.simulate(set={"J": 0, "m": 0}).message


def spinning_rod() -> str:
    with pytest.raises(mechc.CompileError) as raised:
        mechc.loads(SPATIAL.format(joint="Spherical"))
    return str(raised.value)


@pytest.mark.parametrize(
    ("run", "name"),
    [(loose, "'joint.angle'"), (without_any_inertia, "'main.angle'"), (spinning_rod, "'pin.orientation")],
)
def test_what_nothing_decides_is_named(run: Callable[[], str], name: str) -> None:
    message = run()
    assert name in message and re.search("nothing has inertia|moves no mass|nothing with mass moves", message)
