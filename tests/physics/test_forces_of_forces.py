"""Motions under forces that ask about the motion, against equations written by hand."""

from __future__ import annotations

import csv
import math
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmu_models import written
from native_code import compiler
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from slow_params import slow_but

import mechc
from mechc.runtime.outcome import Outcome

PUMP = """model Pump "an oscillator that is driven to an energy of 2 J"
  coordinate Length q = 0.5 m;
  kinetic 1/2*2 kg*der(q)^2;
  potential 1/2*3 N/m*q^2;
  force -0.4 s/m^2*(energy() - 2 J)*der(q) on q;
  experiment(stop = 6 s, tolerance = 1e-10, every = 1 s);
end Pump;
"""

SLED = """model Sled "a sled whose drag follows the root of its normal force, and wears with it"
  coordinate Length x = 0 m;
  coordinate Length y;
  state wear = 0;
  initial der(x) = 3 m/s; initial der(y) = 0.6 m/s;
  kinetic 1/2*2 kg*(der(x)^2 + der(y)^2);
  potential 2 kg*9.81 m/s^2*y;
  constraint track: y = 0.2 m*sin(x/(1 m));
  force drag: -4 N*(multiplier(track)/(1 N))^(1/3)*tanh(der(x)/(1 m/s)) on x;
  equation der(wear) = (multiplier(track)/(1 N))^(1/3)/(1 s);
  output Force N = multiplier(track);
  experiment(stop = 1 s, tolerance = 1e-10, every = 0.25 s);
end Sled;
"""


def pumped(t: float, y: Any) -> list[float]:
    q, v, *_ = y
    return [v, (-3 * q - 0.4 * (v * v + 1.5 * q * q - 2) * v) / 2]


def normal(x: float, v: float) -> float:
    """The multiplier of the track, of which each trial gives the drag and thereby the acceleration."""
    slope, bend = 0.2 * math.cos(x), -0.2 * math.sin(x)

    def lacking(n: float) -> float:
        a = (-slope * n - 4 * abs(n) ** (1 / 3) * math.tanh(v)) / 2
        return float(2 * (slope * a + bend * v * v) + 2 * 9.81 - n)

    return float(brentq(lacking, 1.0, 200.0, xtol=1e-13))


def sledding(t: float, y: Any) -> list[float]:
    x, v, _ = y
    n = normal(x, v)
    root = abs(n) ** (1 / 3)
    return [v, (-0.2 * math.cos(x) * n - 4 * root * math.tanh(v)) / 2, root]


def by_hand(f: Callable[[float, Any], list[float]], start: list[float], stop: float) -> Any:
    return solve_ivp(f, (0, stop), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]


MODELS = {
    "pump": (PUMP, ["q", "der(q)"], by_hand(pumped, [0.5, 0.0], 6)),
    "sled": (SLED, ["x", "der(x)", "wear"], by_hand(sledding, [0.0, 3.0, 0.0], 1)),
}
NEAR = 1e-7
"""A hundred times what the kernel estimates at the tolerance above."""


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("method", ["dop853", "radau5", "gauss4"])
def test_motion(name: str, method: str) -> None:
    text, names, expected = MODELS[name]
    if name == "sled" and method == "gauss4":
        pytest.skip("gauss4 takes steps of one size, and the sled stops")
    options: dict[str, Any] = {"step": 0.01} if method == "gauss4" else {}
    solution = mechc.loads(text).simulate(method=method, **options)
    assert isinstance(solution, mechc.Solution)
    assert solution.outcome is Outcome.COMPLETED
    found = [solution[n][-1] for n in names]
    assert found == pytest.approx(expected, rel=1e-6 if method == "gauss4" else NEAR)


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param("sled", marks=pytest.mark.slow), "pump"])
def test_standalone_c(name: str, tmp_path: Path) -> None:
    text, names, expected = MODELS[name]
    model = mechc.loads(text)
    files = model.compile("c", tmp_path / "made")
    folder = files[0].parent
    program, stop = folder / "program", "6" if name == "pump" else "1"
    sources = [str(f) for f in files if f.suffix == ".c"]
    subprocess.run(
        [compiler(), "-std=c11", "-O1", *sources, "-lm", "-o", str(program)], check=True, capture_output=True
    )
    shown = subprocess.run(
        [str(program), stop, "1e-10"], check=True, capture_output=True, text=True, cwd=folder
    ).stdout
    *_, last = csv.DictReader(shown.splitlines())
    found = [float(next(v for k, v in last.items() if k.split(" ")[0] == n)) for n in names]
    assert found == pytest.approx(expected, rel=NEAR)


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param("pump", marks=pytest.mark.slow), "sled"])
@pytest.mark.parametrize("kind", slow_but(["ModelExchange"], ["CoSimulation", "ModelExchange"]))
def test_fmu(name: str, kind: str, tmp_path: Path) -> None:
    text, names, expected = MODELS[name]
    file, _ = written(tmp_path, text, 3)
    stop = 6.0 if name == "pump" else 1.0
    result = fmpy.simulate_fmu(
        str(file), fmi_type=kind, stop_time=stop, relative_tolerance=1e-10, output=names, output_interval=stop
    )
    assert [result[n][-1] for n in names] == pytest.approx(expected, rel=1e-5)


def test_block_braked_by_the_force_of_its_contact() -> None:
    """It lands, is pushed while it touches, and the drag on it grows with the force of the floor."""
    text = """
  coordinate Length x = 0 m; coordinate Length y = 0.5 m;
  initial der(x) = 2 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*10 m/s^2*y;
  contact floor: y;
  force -0.3*multiplier(floor)*tanh(der(x)/(1 m/s)) on x;
  force (if closed(floor) then 1 N else 0 N) on x;
  force (if closed(floor) then 2 N else 9 N)*sin(time/(1 s)) on y;
"""
    solution = mechc.loads(text).simulate(stop=2, tolerance=1e-11)

    def falling(t: float) -> float:
        return 0.5 - 5 * t * t + 9 * (t - math.sin(t))

    touch = float(brentq(falling, 0.2, 0.6, xtol=1e-15))
    assert solution.events[0].time == pytest.approx(touch, abs=1e-9)

    def sliding(t: float, y: Any) -> list[float]:
        n = 10 - 2 * math.sin(t)
        return [y[1], 1 - 0.3 * n * math.tanh(y[1])]

    rest = solve_ivp(sliding, (touch, 2), [2 * touch, 2.0], method="DOP853", rtol=1e-12, atol=1e-12)
    assert solution["x"][-1] == pytest.approx(rest.y[0, -1], rel=1e-9)
    assert solution["der(x)"][-1] == pytest.approx(rest.y[1, -1], rel=1e-9)


def test_friction_of_two_components() -> None:
    """A block in a slot, pressed to the side and down: its limit is 0.1 times the norm of both forces."""
    text = """
  coordinate Length x = 1 m; coordinate Length y; coordinate Length z;
  initial der(x) = 3 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2 + der(z)^2);
  potential 9.81 N*z - 4 N*y;
  constraint side: y = 0 m;
  constraint floor: z = 0 m;
  friction 0.1*norm({multiplier(side), multiplier(floor)}) on x;
"""
    solution = mechc.loads(text).simulate(stop=1)
    assert solution["der(x)"][-1] == pytest.approx(3 - 0.1 * math.hypot(4, 9.81), rel=1e-12)


@pytest.mark.slow
def test_coefficient_of_friction_that_falls_with_the_force() -> None:
    """mu = 0.3 (N/10 N)^-0.2 on a slope whose normal force depends on the friction through a bar across."""
    text = """
  coordinate Length x = 0 m; coordinate Length y = 0 m;
  initial der(x) = 5 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2) + 0.4 kg*der(x)*der(y);
  potential 20 N*y;
  contact floor: y friction 0.3*(multiplier(floor)/(10 N))^(-0.2) along der(x);
  output Force N = multiplier(floor);
"""
    solution = mechc.loads(text).simulate(stop=1, tolerance=1e-11)
    # 1 a + 0.4 y'' = -mu N with y'' = 0, and 0.4 a = N - 20
    pressed = float(brentq(lambda n: n - 20 + 0.4 * 0.3 * (n / 10) ** -0.2 * n, 5, 40, xtol=1e-14))
    assert solution["N"][-1] == pytest.approx(pressed, rel=1e-10)
    assert solution["der(x)"][-1] == pytest.approx(5 + (pressed - 20) / 0.4, rel=1e-10)


def test_no_force_agrees_with_its_law() -> None:
    """3 a = -3 - 1/(2 + a) has no real solution."""
    text = """dimensionless;
  coordinate q = 1; coordinate r = 2;
  kinetic der(q)^2 + 1/2*der(r)^2; potential 3/2*q^2;
  constraint c: r = q + 1;
  force -1/(2 + multiplier(c)) on q;
"""
    solution = mechc.loads(text).simulate(stop=1)
    assert solution.outcome is Outcome.FAILED
    assert "not a number" in solution.message


@pytest.mark.parametrize("load", ["0", "(1 - time)"])
def test_force_that_is_nothing_without_its_law(load: str) -> None:
    """N = load + 1/N: the quotient has no value where the iteration would begin."""
    text = f"""dimensionless;
  coordinate q = 1; coordinate r = 0; kinetic 1/2*der(q)^2 + 1/2*der(r)^2;
  constraint c: q = 1;
  force -{load} - 1/multiplier(c) on q;
  force multiplier(c) on r;
  output N = multiplier(c);
"""
    solution = mechc.loads(text).simulate(stop=1, every=0.125)
    assert solution.outcome is Outcome.COMPLETED
    b = 0.0 if load == "0" else 1 - solution.time
    np.testing.assert_allclose(solution["N"], b / 2 + np.sqrt(1 + b * b / 4), rtol=1e-12)


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        ("0.3*lam^2", (0.0, -1 / 0.3)),
        ("0.3*tanh(lam)", (0.0,)),
        ("lam^3", (0.0,)),
        ("0.2 + 0.3*lam^2", tuple((-1 + s * math.sqrt(1 - 0.24)) / 0.6 for s in (1, -1))),
        ("(1 + lam^2)*(1 - time) - 2*time", ()),
    ],
)
def test_multiplier_by_a_law_of_its_own(law: str, expected: tuple[float, ...]) -> None:
    """What is held at rest feels law + lam = 0: one of the roots, or a failure where there is none."""
    text = f"""dimensionless;
  coordinate q = 0.3; kinetic der(q)^2;
  constraint h: q = 0.3;
  force {law.replace("lam", "multiplier(h)")} on q;
  output lam = multiplier(h);
"""
    solution = mechc.loads(text).simulate(stop=1)
    if expected:
        assert solution.outcome is Outcome.COMPLETED
        assert min(abs(solution["lam"][-1] - root) for root in expected) < 1e-14
    else:
        assert solution.outcome is Outcome.FAILED and "not a number" in solution.message
        assert np.isnan(solution["lam"][0])


TWO = """
coordinate Length x = 1 m; coordinate Length y = 2 m; initial der(x) = 1 m/s; initial der(y) ~ 0.5 m/s;
mass 2 kg at world*{x, 0 m}; mass 1 kg at world*{0 m, y}; potential 1/2*3 N/m*(x^2 + y^2);
"""
KINETIC = "(1 kg*der(x)^2 + 1/2*1 kg*der(y)^2)"
ENERGY = f"({KINETIC} + 1/2*3 N/m*(x^2 + y^2))"
FORMULAS = (
    ("kinetic_energy()", KINETIC), ("energy()", ENERGY), ("momentum(x)", "(2 kg*der(x))"),
    ("mass_centre()[1]", "(2*x/3)"), ("mass_centre()[2]", "(y/3)"),
)  # fmt: skip
OFTEN = pytest.mark.slow


@pytest.mark.parametrize(
    "text",
    [
        "constraint c: mass_centre()[1] + mass_centre()[2]^2/(1 m) = 10/9*1 m; initial y ~ 2 m;",
        "constraint c: momentum(x) + 1 kg*der(y) = 2.5 N.s;",
        "when x > 1.1 m then impulse 0.3 s/m*energy() on y; reinit(der(x), 0.1 m/s*energy()/(1 J)); end when;",
        "discrete n = 0; when sample(0.1 s) then n := pre(n) + kinetic_energy()/(1 J); end when; force 0.1 N*n on y;",
        pytest.param(
            "when energy() - 0.5 N*x > 8.2 J then reinit(der(x), 0.1 m/s); end when; force 9 N on y;",
            marks=OFTEN,
        ),
        pytest.param("contact c: mass_centre()[1] - 0.6 m restitution 0.5; force -5 N on x;", marks=OFTEN),
        pytest.param("contact c: y friction 0.1 along der(mass_centre()[1]); force -10 N on y;", marks=OFTEN),
        "dissipation 0.1 kg/s*(1 + energy()/(4 J))*der(x)^2; damping 0.05 s/m^2*kinetic_energy() on y;",
        pytest.param("friction 0.1 m^-1*energy() on x;", marks=OFTEN),
        pytest.param("force (if momentum(x) > 1 N.s then 1 N else 0 N) on y;", marks=OFTEN),
        pytest.param("potential (if mass_centre()[1] > 0.75 m then 0.2 J else 0 J);", marks=OFTEN),
        pytest.param("potential 1 N*max(mass_centre()[1] - 0.7 m, 0 m);", marks=OFTEN),
        pytest.param("kinetic 0.1 kg*der(mass_centre()[1])^2;", marks=OFTEN),
        pytest.param("output p = der(energy()); damping 0.2 N.s/m on x;", marks=OFTEN),
        pytest.param(
            "frame g = world*trans({mass_centre()[1], mass_centre()[2]}); force {1, 2} N on g;", marks=OFTEN
        ),
        pytest.param(
            "let g = mass_centre()[1]; force 1 N on g; output v = der(g); output a = der(g, 2);", marks=OFTEN
        ),
    ],
)
def test_formula_in_the_place_of_a_question(text: str) -> None:
    """Places that are differentiated, or in which events ask: the motion is that of the formula written out."""
    plain = text
    for question, formula in FORMULAS:
        plain = plain.replace(question, formula)
    assert plain != text
    asked, written_out = (mechc.loads(TWO + t).simulate(stop=1, tolerance=1e-10) for t in (text, plain))
    assert asked.outcome is written_out.outcome is Outcome.COMPLETED
    assert [e.kind for e in asked.events] == [e.kind for e in written_out.events]
    for name in written_out:
        np.testing.assert_allclose(asked[name][-1], written_out[name][-1], rtol=1e-9, atol=1e-9)


def test_spring_at_a_hinged_body() -> None:
    """The spring pulls with 50 N from (3, 4) m at the hinge: it must be held with (-30, -40) N."""
    text = """import mech.planar.*;
Body b(m = 1 kg, J = 1 kg.m^2, com = {0, 0} m);
Revolute h(world -> b.a);
potential 1/2*2 N/m*(norm(pos(b.a) - {3, 4} m) + 20 m)^2;
output F = reaction(h);
"""
    solution = mechc.loads(text).simulate(stop=0.1)
    np.testing.assert_allclose(solution["F"][-1], [-30, -40], rtol=1e-12)


TRACK = """coordinate x = 0 m;
coordinate Length y;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1 kg*9.81 m/s^2*y;
constraint track: y = 0.5*x;
force {law} on x;
output held = multiplier(track);
experiment(stop = 1 us);
"""
ROOTS: dict[str, tuple[str, Callable[[float], float]]] = {
    "one bend": ("0.05 N^-1*multiplier(track)^2", lambda n: 0.05 * n**2),
    "a dip": (
        "-80 N*multiplier(track)/(1 N)*exp(-multiplier(track)/(1 N))",
        lambda n: -80 * n * math.exp(-n),
    ),
    "three forces": ("4 N*sin(multiplier(track)/(1 N))", lambda n: 4 * math.sin(n)),
    "a slope that is too steep where it begins": (
        "6 N*sin(multiplier(track)/(1 N) - 7.3)",
        lambda n: 6 * math.sin(n - 7.3),
    ),
    "a slope of one where it begins": (
        "3 N*sin(multiplier(track)/(1 N) - 7.262314441467)",
        lambda n: 3 * math.sin(n - 7.262314441467),
    ),
    "steep where it begins": ("8 N*sin(multiplier(track)/(1 N) - 7.8)", lambda n: 8 * math.sin(n - 7.8)),
    "a root": ("12 N*sqrt(multiplier(track)/(1 N) - 7.84)", lambda n: 12 * math.sqrt(max(0, n - 7.84))),
    "eleven forces": ("30 N*sin(multiplier(track)/(1 N))", lambda n: 30 * math.sin(n)),
}


def grown(law: Callable[[float], float]) -> float:
    """Follow n = 7.848 N + 0.4 F(n) as the law F grows from nothing, in steps that find the root beside the last one."""
    n = 7.848
    for k in range(1, 2001):
        a, b = n - 0.05, n + 0.05
        n = float(brentq(lambda m, k=k: m - 7.848 - 0.4 * k / 2000 * law(m), a, b, xtol=1e-14))
    return n


@pytest.mark.parametrize("name", ROOTS)
def test_of_several_forces_the_one_holds_into_which_that_without_the_law_grows(name: str) -> None:
    text, law = ROOTS[name]
    solution = mechc.loads(TRACK.format(law=text)).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution["held"][0] == pytest.approx(grown(law), rel=1e-13)


def test_where_two_forces_have_met_and_gone_there_is_none() -> None:
    """N = 7.848 N + 0.4 c N^2 has no solution beyond c = 0.0796/N."""
    text = TRACK.format(law="0.09 N^-1*multiplier(track)^2")
    solution = mechc.loads(text).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution.outcome is Outcome.FAILED and "not a number" in solution.message
