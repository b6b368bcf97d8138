"""Stiff springs and dampers in mechanisms: steps that do not depend on the stiffness, the limit of rigid parts."""

from __future__ import annotations

from pathlib import Path

import pytest

import mechc

MODELS = Path(__file__).parents[1] / "models" / "stiff"

LADDERS = {
    "spring": ([{"w": w} for w in (1e4, 1e6, 1e8)], 1.0, 10.0),
    "governor": ([{"k": 8e5 * f, "c": 4e4 * f} for f in (1.0, 1e2, 1e4)], 0.5, 2.5),
    "four_bar": ([{"k": k, "c": (2 * k) ** 0.5} for k in (1e6, 1e8, 1e10)], 0.5, 2.5),
}
"""Values, the time at which transients are gone, and the stop."""


def steps(model: mechc.Model, values: dict[str, float], stop: float) -> int:
    solution = model.simulate(method="radau5", set=values, stop=stop, tolerance=1e-8, estimate_error=False)
    assert solution.outcome.value == "completed"
    assert solution.statistics.rejected is not None
    assert solution.statistics.rejected < 0.15 * solution.statistics.steps + 5
    return solution.statistics.steps


@pytest.mark.parametrize("name", LADDERS)
def test_steps_do_not_depend_on_the_stiffness(name: str) -> None:
    """10 000 times the stiffness (the spring: 1e8 times). Measured: within 20 %; with one Jacobian for all stages
    Newton's iterations forced the governor to twice and the four-bar to twice as many steps."""
    ladder, begin, stop = LADDERS[name]
    model = mechc.load(MODELS / f"{name}.mech")
    counts = [steps(model, values, stop) - steps(model, values, begin) for values in ladder]
    assert max(counts) < 1.3 * min(counts), counts


RIGID = """
import mech.planar.*;
gravity {0, -9.81 m/s^2};
Bar crank(m = 1 kg, l = 0.4 m);
Bar coupler(m = 1 kg, l = 1 m);
Bar rocker(m = 1 kg, l = 0.8 m);
Revolute a(world -> crank.a, angle = 60 deg, der(angle) = 0 rad/s);
Revolute b(crank.b -> coupler.a, angle ~ -40 deg);
Revolute r(coupler.b -> rocker.a, angle ~ -90 deg);
cut Revolute d(rocker.b -> world * trans({1 m, 0}));
experiment(stop = 5 s);
"""


@pytest.mark.parametrize("tolerance", [1e-8, 1e-10])
def test_stiff_loop_moves_like_a_rigid_one(tolerance: float) -> None:
    """A coupler of 1e12 N/m gives way by 1e-11 m; errors of up to 30 times the tolerance were measured."""
    rigid = mechc.loads(RIGID).simulate(tolerance=1e-12, estimate_error=False)
    values = {"k": 1e12, "c": 1.4e6}
    model = mechc.load(MODELS / "four_bar.mech")
    stiff = model.simulate(method="radau5", set=values, tolerance=tolerance, estimate_error=False)
    for name in ("a.angle", "b.angle", "r.angle"):
        assert stiff[name] == pytest.approx(rigid[name], abs=100 * tolerance)
    assert stiff.statistics.drift_position is not None
    assert 0 < stiff.statistics.drift_position < 1e-6


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("governor", {"k": 8e7, "c": 4e6}),
        pytest.param("four_bar", {"k": 1e10, "c": 1.4e5}, marks=pytest.mark.slow),
    ],
)
def test_auto_goes_over_to_the_implicit_method(name: str, values: dict[str, float]) -> None:
    model = mechc.load(MODELS / f"{name}.mech")
    auto = model.simulate(set=values, stop=1, tolerance=1e-8)
    implicit = model.simulate(method="radau5", set=values, stop=1, tolerance=1e-11, estimate_error=False)
    assert auto.statistics.method == "radau5"
    assert auto.statistics.switches in (1, 3)
    assert any("the method was changed" in remark for remark in auto.remarks)
    assert auto.statistics.steps < 1000
    for state in ("phi", "left", "s") if name == "governor" else ("a.angle", "b.angle"):
        assert auto[state][-1] == pytest.approx(implicit[state][-1], abs=1e-5)
