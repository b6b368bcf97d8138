"""Sizes of states that nothing in the model gives a size to: from a pilot run."""

from __future__ import annotations

import math

import pytest

import mechc
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate import nominal_run

FORCED = """
model Forced
  coordinate x = 0 m;
  parameter m = {m};
  kinetic 1/2*m*der(x)^2;
  potential 1/2*({k})*x^2;
  force {f}*cos(2 s^-1*time) on x;
  experiment(stop = 100 s);
end Forced;
"""


def nominal(text: str) -> float:
    error = mechc.loads(text).simulate().accuracy.error
    assert error is not None
    return error.nominal["x"]


def test_forced_motion_is_measured_by_what_it_reaches() -> None:
    # x = (cos t - cos 2t)/3 m reaches between 2/3 and 3/4 m; by its acceleration at rest it would be 1e4 m
    assert nominal(FORCED.format(m="1 kg", k="1 N/m", f="1 N")) == pytest.approx(0.67, abs=0.1)


def test_a_change_of_units_changes_the_size_by_its_factor_alone() -> None:
    in_metres = nominal(FORCED.format(m="1 kg", k="1 N/m", f="1 N"))
    farther = nominal(FORCED.format(m="1 kg", k="1 N/m", f="1024 N"))
    assert farther == 1024 * in_metres  # a power of two: no rounding differs


def test_a_declared_size_needs_no_pilot() -> None:
    text = FORCED.format(m="1 kg", k="1 N/m", f="1 N").replace("x = 0 m", "x(nominal = 3 m) = 0 m")
    assert nominal(text) == 3.0


def test_a_small_motion_beside_a_large_one_keeps_its_size() -> None:
    """Not coupled, 1e10 times smaller and 100 times faster: measured by a millionth of the other it would be lost."""
    text = """
    parameter a = 1e6 m;
    parameter b = 1e-4 m;
    coordinate Length x = a;
    coordinate Length y = b;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
    potential 1/2*1 N/m*x^2 + 1/2*1e4 N/m*y^2;
    experiment(stop = 10 s, tolerance = 1e-9);
    """
    solution = mechc.loads(text).simulate(estimate_error=False)
    assert solution["y"][-1] == pytest.approx(1e-4 * math.cos(1000), abs=1e4 * 1e-9 * 1e-4)  # 160 periods


STARTS = {
    "two lengths": "coordinate Length x = 3 km; coordinate Length y = 5 m; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"
    "potential 1/2*2 N/m*(x - y)^2;",
    "a length at rest": "parameter a = 3 m; parameter b = 7 m; coordinate Length x = 0 m; initial der(x) = 1e-3 m/s;"
    "kinetic 1/2*1 kg*der(x)^2; potential 1/2*(2 N/m)*(x - a*b/(1 m))^2;",
    "losses and an input": "coordinate Angle phi = 40 deg; input Torque push = 0.3 N.m*(1 + time/(1 s));"
    "kinetic 1/2*1 kg.m^2*der(phi)^2; potential -9.81 J*cos(phi); damping 0.1 N.m.s on phi; force push on phi;",
    "a range and a declared size": "coordinate Length x(nominal = 2 cm) = 0 m; coordinate Length y(max = 9 m) = 0 m;"
    "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 1/2*(2 N/m)*((x - 1 m)^2 + y^2);",
}


@pytest.mark.parametrize("text", STARTS.values(), ids=STARTS)
def test_the_kernel_goes_by_the_same_rules_to_the_last_bit(text: str) -> None:
    problem = mechc.loads(f"{text} experiment(stop = 7 s);").problem("c")
    case = prepare(problem, load_functions(problem), SimulationOptions())
    found = nominal_run._by_kernel(case)
    assert found is not None
    assert found.tolist() == nominal_run._nominal(case, None).tolist()


def test_where_a_first_run_tells_more_the_kernel_leaves_it_to_that() -> None:
    problem = mechc.loads(FORCED.format(m="1 kg", k="1 N/m", f="1 N")).problem("c")
    case = prepare(problem, load_functions(problem), SimulationOptions())
    assert nominal_run._by_kernel(case) is None and nominal_run.takes_pilot(case)
