"""Initial states of FMUs whose parameters or states were changed: as the native run of the changed model begins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi3 import FMU3Model
from fmu_models import derivative, put, references, states, written
from numpy.typing import NDArray

import mechc
from mechc.compiler.targets.fmu import driver
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

FOUR_BAR = """
import mech.planar.*;

model FourBar "the angle of the crank is stated, all others are guessed"
  parameter phi = 60 deg;
  parameter long = 0.5 m;
  gravity {0, -9.81 m/s^2};
  Bar crank(m = 1 kg, l = 0.2 m);
  Bar coupler(m = 2 kg, l = long);
  Bar rocker(m = 1.5 kg, l = 0.4 m);
  frame pivot = world * trans({0.5 m, 0});
  Revolute a(world -> crank.a, angle = phi);
  Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
  Revolute d(pivot -> rocker.a, angle ~ 90 deg);
  cut Revolute c(coupler.b -> rocker.b);
  initial der(a.angle) = 1 rad/s;
  experiment(stop = 1 s);
end FourBar;
"""

FOLLOWS = """
model Follows "one initial value is stated with another, and both with a parameter"
  parameter h = 1 m;
  coordinate x = h;
  coordinate y = 2*x;
  kinetic 1/2*(1 kg)*(der(x)^2 + der(y)^2);
  experiment(stop = 1 s);
end Follows;
"""


@pytest.fixture(scope="module")
def four_bar(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("starts"), FOUR_BAR, 3)[0]


def start(path: Path, values: Mapping[str, float]) -> dict[str, float]:
    at, names = references(path), states(path)
    with driver.instance(path, "me") as fmu:
        for name, value in values.items():
            put(fmu, at[name], value)
        driver.initialise(fmu, 0.0)
        return dict(zip(names, driver.numbers(fmu, [at[n] for n in names]), strict=True))


@pytest.mark.parametrize("values", [{}, {"phi": 1.3}, {"phi": 0.9, "long": 0.52}, {"a.angle": 0.7}])
def test_what_is_stated_stays_and_the_rest_follows(four_bar: Path, values: dict[str, float]) -> None:
    """Both solve to rounding; 1e-12 leaves room for the condition of the linkage."""
    native = mechc.loads(FOUR_BAR).with_values(values).simulate(stop=1e-6, estimate_error=False)
    found = start(four_bar, values)
    assert found == pytest.approx({n: float(native[n][0]) for n in found}, rel=1e-12)


def test_values_of_the_importer_go_before_those_of_the_model(four_bar: Path) -> None:
    found = start(four_bar, {"d.angle": 1.6})
    assert found["d.angle"] == pytest.approx(1.6, rel=1e-12)
    assert found["a.angle"] != pytest.approx(1.0471975511965976, rel=1e-3)


def test_values_that_cannot_be_met_are_an_error(four_bar: Path) -> None:
    with pytest.raises(Exception, match="status 3"):
        start(four_bar, {"long": 2.0})


def test_values_that_are_stated_with_others_follow_them(tmp_path: Path) -> None:
    path, _ = written(tmp_path, FOLLOWS, 3)
    assert start(path, {"h": 3.0}) == {"x": 3.0, "y": 6.0, "der(x)": 0.0, "der(y)": 0.0}
    assert start(path, {"x": 5.0}) == {"x": 5.0, "y": 10.0, "der(x)": 0.0, "der(y)": 0.0}


def test_an_initial_value_follows_one_that_is_a_number(tmp_path: Path) -> None:
    for version in (2, 3):
        path, _ = written(tmp_path, FOLLOWS.replace("x = h;", "x = 1 m;"), version)
        initial = {
            v.name: v.initial
            for v in fmpy.read_model_description(path).modelVariables
            if v.name in ("x", "y")
        }
        assert initial == {"x": "exact", "y": "approx"}
    assert start(path, {"x": 5.0}) == {"x": 5.0, "y": 10.0, "der(x)": 0.0, "der(y)": 0.0}
    assert start(path, {"x": 5.0, "y": 7.0})["y"] == 7.0


BY_FORMULA = """
model ByFormula "the initial state follows from parameters, an input and one stated value"
  parameter h = 1.5 m;
  parameter k = 3 N/m;
  input Force F = 0.4 N;
  coordinate x = h + h^2/(4 m);
  coordinate w = 0.3 m;
  initial der(x) = 1 m/s*sin(h*k/(1 N));
  kinetic 1/2*(1 kg)*(der(x)^2 + der(w)^2);
  potential 1/2*k*x^2 + 1 N/m*x*w;
  force F*cos(x/(1 m)) on x;
  output Force pull = k*x*w/(1 m);
  experiment(stop = 1 s);
end ByFormula;
"""


def test_derivatives_during_initialisation(tmp_path: Path) -> None:
    """Differences of sixth order with h = 1e-2: truncation 1e-12, rounding 1e-14; all lie below 1e-9."""
    path, _ = written(tmp_path, BY_FORMULA, 3)
    at = references(path)
    knowns = ["h", "k", "F", "w"]
    unknowns = ["x", "der(x)", "der(x,2)", "der(w,2)", "pull", "energy.total"]
    point = {"h": 1.2, "k": 2.5, "F": 0.7, "w": 0.2}
    direction = {"h": 0.4, "k": -0.9, "F": 0.6, "w": 0.3}
    weights = [0.3, -0.8, 0.5, 0.9, -0.2, 0.7]

    def values(by: float) -> NDArray[np.float64]:
        with in_initialisation(path, {at[n]: point[n] + by * direction[n] for n in knowns}) as fmu:
            return np.array(driver.numbers(fmu, [at[n] for n in unknowns]))

    with in_initialisation(path, {at[n]: point[n] for n in knowns}) as fmu:
        u, k = [at[n] for n in unknowns], [at[n] for n in knowns]
        forward = np.array(derivative(fmu, u, k, list(direction.values())))
        backward = np.array(derivative(fmu, u, k, weights, adjoint=True))
        with pytest.raises(Exception, match="status 3"):
            derivative(fmu, u, [at["x"]], [1.0])  # no known: it follows from h
    steps = {-3: -1 / 60, -2: 9 / 60, -1: -45 / 60, 1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
    wanted = sum(weight * values(0.01 * s) for s, weight in steps.items()) / 0.01
    assert forward == pytest.approx(wanted, rel=1e-9, abs=1e-9)
    assert np.dot(weights, forward) == pytest.approx(np.dot(backward, list(direction.values())), rel=1e-13)


@contextmanager
def in_initialisation(path: Path, values: Mapping[int, float]) -> Iterator[FMU3Model]:
    with driver.instance(path, "me") as fmu:
        for reference, value in values.items():
            put(fmu, reference, value)
        fmu.enterInitializationMode(startTime=0.0)
        yield fmu


ROTATIONS = """
import mech.spatial.*;
model Ticks "a rotation beside a clock: the length of its quaternion is looked at once more at each tick"
  Box b(m = 1 kg, size = {1 m, 0.5 m, 0.45 m});
  Spherical j(world -> b.a, orientation ~ axis_angle({0.37, 0.340, -0.44}, -0.43), der(orientation) ~ {0.55 rad/s, 0.04 rad/s, 0.73 rad/s});
  discrete Real n = 1;
  when sample((1/30) s) then n := 0.7*n; end when;
  experiment(stop = 0.2 s);
end Ticks;
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "turned", ["axis_angle({0.37, 0.340, -0.44}, -0.43)", "axis_angle({-1, 0.2, 0.7}, 2.1)"]
)
def test_rotations_begin_with_the_same_bits_beside_clocks(tmp_path: Path, turned: str) -> None:
    """Export compares the states of Co-Simulation with those of the native run bit by bit."""
    text = ROTATIONS.replace("axis_angle({0.37, 0.340, -0.44}, -0.43)", turned)
    options = FmuOptions(kind="cs")
    (unit,) = export_fmu(mechc.loads(text), tmp_path / "ticks.fmu", options)
    assert unit.exists()
