"""Sizes of states that nothing in the model gives a size to: from a pilot run."""

from __future__ import annotations

import math

import pytest

import mechc
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate.nominal_run import takes_pilot

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


def test_only_where_nothing_gives_a_size_a_first_run_is_made() -> None:
    text = FORCED.format(m="1 kg", k="1 N/m", f="1 N")
    for stated, takes in ((text, True), (text.replace("x = 0 m", "x = 1 m"), False)):
        problem = mechc.loads(stated).problem()
        assert takes_pilot(prepare(problem, load_functions(problem), SimulationOptions())) is takes
