"""Peers of the work-precision pages: each follows a motion that is known in closed form, and is refused what it is not given."""

from __future__ import annotations

import importlib.util
import math
import sys
from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np
import pytest

import mechc
from mechc.compiler.pipeline import program_with
from mechc.compiler.program import Program
from mechc.measurement import peers as libraries
from mechc.measurement.peers import diffsol, heyoka
from mechc.runtime.case import Case, SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate.solver import SolverOptions
from mechc.runtime.outcome import SimulationError
from mechc.runtime.reference.work_precision import Peer

OSCILLATOR = """model Oscillator
  parameter m = 2 kg;
  parameter k = 8 N/m;
  coordinate Length x = 30 cm;
  coordinate Length far = 40 m;
  kinetic 1/2*m*(der(x)^2 + der(far)^2);
  potential 1/2*k*(x^2 + far^2);
  experiment(stop = 10 s);
end Oscillator;
"""
OMEGA = 2.0
NAMES = (
    "cvode:Adams",
    "cvode:BDF",
    *(pytest.param(name, marks=pytest.mark.slow) for name in ("numbalsoda:LSODA", "heyoka:Taylor")),
    *(f"diffsol:{name}" for name in ("tsit45", "bdf", "esdirk34")),
    *(pytest.param(f"diffrax:{name}", marks=pytest.mark.slow) for name in ("Dopri8", "Kvaerno5")),
)
"""LSODA and heyoka compile for seconds before their first run."""


@pytest.fixture(scope="module")
def posed() -> tuple[Mapping[str, Peer], Case]:
    model = mechc.loads(OSCILLATOR)
    problem = model.problem(method="radau5")
    return libraries.peers(model), prepare(problem, load_functions(problem), SimulationOptions(points=11))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("end_alone", [False, True])
def test_a_peer_follows_an_oscillator(
    posed: tuple[Mapping[str, Peer], Case], name: str, *, end_alone: bool
) -> None:
    from msgspec.structs import replace

    peers, case = posed
    if name not in peers:
        pytest.skip(f"{name} is not installed")
    case = replace(case, grid=case.grid[:1]) if end_alone else case
    tolerance, nominal = 1e-9, np.array([0.3, 40.0, 0.6, 80.0])
    done = peers[name](case, SolverOptions(name, tolerance, nominal))
    t = np.array([case.stop]) if end_alone else case.grid
    exact = np.column_stack(
        [a * f for f in (np.cos(OMEGA * t), -OMEGA * np.sin(OMEGA * t)) for a in (0.3, 40.0)]
    )
    assert done.failure is None
    assert done.y.shape == exact.shape
    # what steps are off by adds up: by no more than their number, some thousands
    assert np.max(np.abs(done.y - exact) / nominal) < 3000 * tolerance
    assert name.startswith(("diffsol", "diffrax")) or done.statistics.evaluations > 20  # these count none


FALLING = """model Falling
  parameter g = 9.81 m/s^2;
  coordinate Length h = 1 m;
  coordinate Length x = 0 m;
  initial der(x) = 3 m/s;
  kinetic 1/2*1 kg*(der(h)^2 + der(x)^2);
  potential 1 kg*g*h;
  contact floor: h restitution 0.8;
  friction 2 N on x;
  experiment(stop = 2 s);
end Falling;
"""
WITH_EVENTS = (
    *(f"scipy:{name}" for name in ("DOP853", "LSODA")),
    "cvode:Adams",
    "cvode:BDF",
    pytest.param("heyoka:Taylor", marks=pytest.mark.slow),
    *(f"diffsol:{name}" for name in ("tsit45", "bdf")),
)


def fallen(t: float) -> tuple[float, float]:
    """Return height and way: parabolas, of which each leaves 0.8 of the speed; a parabola that ends in rest."""
    begin, v = math.sqrt(2 / 9.81), 0.8 * math.sqrt(2 * 9.81)
    height = 1 - 9.81 * t**2 / 2
    while t > begin:
        height = v * (t - begin) - 9.81 * (t - begin) ** 2 / 2
        begin, v = begin + 2 * v / 9.81, 0.8 * v
    s = min(t, 1.5)
    return height, 3 * s - s**2


@pytest.fixture(scope="module")
def falls() -> tuple[Mapping[str, Peer], Case]:
    model = mechc.loads(FALLING)
    problem = model.problem(method="radau5")
    return libraries.peers(model), prepare(problem, load_functions(problem), SimulationOptions(points=21))


@pytest.mark.parametrize("name", WITH_EVENTS)
def test_a_peer_bounces_and_comes_to_rest(falls: tuple[Mapping[str, Peer], Case], name: str) -> None:
    peers, case = falls
    if name not in peers:
        pytest.skip(f"{name} is not installed")
    done = peers[name](case, SolverOptions(name, 1e-10, np.full(case.y0.size, 1.0)))
    assert done.failure is None and done.y.shape[0] == case.grid.size
    exact = np.array([fallen(float(t)) for t in case.grid])
    # BDF of second order on parabolas: its steps are off by no more than the tolerance, a bounce makes that of the time
    assert np.abs(done.y[:, :2] - exact).max() < 1e-6
    lost = case.problem.ny - 1  # what impacts and friction dissipate is booked by the unit
    assert case.problem.states[lost].name == "energy.dissipated"
    impacts = sum(0.36 * 9.81 * 0.64**k for k, at in enumerate(_impacts()) if at < 2)
    assert done.y[-1, lost] == pytest.approx(4.5 + impacts, abs=1e-6)


def _impacts() -> list[float]:
    t, v = math.sqrt(2 / 9.81), 0.8 * math.sqrt(2 * 9.81)
    found = [t]
    for _ in range(5):
        t, v = t + 2 * v / 9.81, 0.8 * v
        found.append(t)
    return found


@pytest.mark.parametrize("name", ["numbalsoda:LSODA", "diffrax:Dopri8"])
def test_a_peer_without_events_is_given_none(falls: tuple[Mapping[str, Peer], Case], name: str) -> None:
    peers, case = falls
    if name not in peers:
        pytest.skip(f"{name} is not installed")
    with pytest.raises(SimulationError, match="without events"):
        peers[name](case, SolverOptions(name, 1e-6, np.ones(case.y0.size)))


PENDULUM = """model Pendulum
  parameter g = 9.81 m/s^2;
  parameter l = 2 m;
  coordinate Angle theta = 1 rad;
  kinetic 1/2*1 kg*l^2*der(theta)^2;
  potential -1 kg*g*l*cos(theta);
  experiment(stop = 1 s);
end Pendulum;
"""
Y, SIZES = (0.7, -0.3), (0.5, 4.0)
RATES = (-0.3, -9.81 / 2 * math.sin(0.7))


def given() -> tuple[Program, list[float]]:
    """Return a program, and its parameters with the constants of a run."""
    model = mechc.loads(PENDULUM)
    program = program_with(model.compilation, frozenset())
    problem = model.problem(quick=True)
    case = prepare(problem, load_functions(problem), SimulationOptions(points=2))
    return program, case.p.tolist()


def test_the_text_for_diffsol_means_the_equations() -> None:
    """Read by Python: each line is ``name { formula }``; beside rates by hand."""
    program, p = given()
    lines = [line.removesuffix(" }").split(" { ") for line in diffsol.text(program).splitlines()]
    known = {f"p{i}": value for i, value in enumerate(p)} | {"sin": math.sin, "cos": math.cos, "pow": pow}
    known |= {f"s{i}": size for i, size in enumerate(SIZES)}
    known |= {f"x{i}": y / size for i, (y, size) in enumerate(zip(Y, SIZES, strict=True))}
    for name, formula in lines[2:-1]:  # without in_i and u_i
        known[name] = eval(formula, {}, known)
    assert lines[-1][0] == "F_i"
    found = eval(f"[{lines[-1][1]}]", {}, known)
    assert found == pytest.approx([rate / size for rate, size in zip(RATES, SIZES, strict=True)], rel=1e-14)


def test_the_expressions_for_heyoka_mean_the_equations(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers instead of its expressions; beside rates by hand."""
    program, p = given()
    numbers = SimpleNamespace(
        make_vars=lambda name: Y[int(name[1:])], expression=float, par=p, time=0.0, sin=math.sin, cos=math.cos
    )
    monkeypatch.setitem(sys.modules, "heyoka", numbers)
    rows, _ = heyoka.equations(program)
    assert [state for state, _ in rows] == list(Y)
    assert [rate for _, rate in rows] == pytest.approx(RATES, rel=1e-14)


def test_what_is_absent_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "heyoka" else found(name))
    assert "heyoka" in libraries.absent()
    assert not any(name.startswith("heyoka") for name in libraries.peers(mechc.loads(OSCILLATOR)))
