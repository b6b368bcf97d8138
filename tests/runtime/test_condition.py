"""How errors grow along a run: against matrix exponentials, twin runs and known exponents."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.linalg import expm

import mechc
from mechc.cli.main import run as run_command
from mechc.runtime.results.condition import condition_of

PUSHED = """
model Pushed
  dimensionless;
  parameter a = 2;
  parameter c = 0.3;
  coordinate x(nominal = 2) = 0;
  initial der(x) = 1e-3;
  kinetic 1/2*der(x)^2;
  potential -1/2*a*x^2;
  dissipation 1/2*c*der(x)^2;
  experiment(stop = 12);
end Pushed;
"""


def test_linear_growth_is_that_of_the_matrix_exponential() -> None:
    """Also the time of growth by e: 1/(-c/2 + sqrt(c^2/4 + a))."""
    solution = mechc.loads(PUSHED).simulate(condition=True)
    found = solution.condition
    assert solution.accuracy.error is not None
    sizes = np.array([solution.accuracy.error.nominal[n] for n in ("x", "der(x)")])
    matrix = np.array([[0, 1], [2, -0.3]])
    expected = [np.linalg.norm(expm(matrix * t) * sizes / sizes[:, None], 2) for t in found.time]
    np.testing.assert_allclose(found.growth, expected, rtol=1e-6)
    assert found.e_fold == pytest.approx(1 / (-0.15 + math.sqrt(0.0225 + 2)), rel=1e-3)
    assert found.e_fold is not None and found.horizon is not None
    assert found.horizon == pytest.approx(12 + found.e_fold * math.log(1e8 / found.growth[-1]), rel=1e-3)
    assert found.longest == pytest.approx(found.horizon + found.e_fold * math.log(2**52 / 1e8), rel=1e-3)


@pytest.mark.parametrize("potential", ["0", "1/2*x^2", "x^4"], ids=["free", "harmonic", "quartic"])
def test_regular_motions_have_no_horizon(potential: str) -> None:
    """Their changes grow like the time, if they grow."""
    text = (
        PUSHED.replace("-1/2*a*x^2", potential)
        .replace("  dissipation 1/2*c*der(x)^2;\n", "")
        .replace("1e-3", "1")
    )
    found = mechc.loads(text).with_values({}).simulate(condition=True, stop=60).condition
    assert found.e_fold is None and found.horizon is None
    assert found.growth[-1] < 1e3


def test_chaos_has_the_known_exponent_and_tells_when_runs_part() -> None:
    """The exponent of Lorenz's equations is 0.906; runs whose starts differ by d differ by d times the growth at most."""
    model = mechc.load("examples/lorenz.mech")
    solution = model.simulate(condition=True, stop=16, tolerance=1e-12)
    found = solution.condition
    assert found.e_fold == pytest.approx(1 / 0.906, rel=0.35)  # over so short a time it varies as much
    assert solution.accuracy.error is not None
    nominal = solution.accuracy.error.nominal
    d, ratios = 1e-9, []
    for name in "xyz":
        twin = model.simulate(
            set={name: float(solution[name][0]) + d * nominal[name]}, stop=16, tolerance=1e-13
        )
        apart = [(twin(12.0)[n] - solution(12.0)[n]) / nominal[n] for n in "xyz"]
        ratios.append(np.linalg.norm(apart) / d)
    growth = float(np.interp(12.0, found.time, found.growth))
    # the norm is at most theirs together, at least the largest
    assert 0.5 * growth < math.hypot(*ratios) < 2 * growth


@pytest.mark.slow
def test_events_and_rotations_are_part_of_it() -> None:
    """A ball that bounces: its fall by difference of two runs; a top: three directions for its rotation."""
    ball = mechc.load("examples/bouncing_ball.mech").simulate(stop="1 s", condition=True)
    assert ball.accuracy.error is not None
    sizes = [ball.accuracy.error.nominal[n] for n in ("h", "der(h)")]
    own = mechc.load("examples/bouncing_ball.mech").simulate(stop="1 s", sensitivity=["h", "der(h)"])
    flow = np.array([[own.sensitivity(a, b).values[-1] for b in ("h", "der(h)")] for a in ("h", "der(h)")])
    expected = np.linalg.norm(flow * sizes / np.array(sizes)[:, None], 2)
    assert ball.condition.growth[-1] == pytest.approx(expected, rel=1e-6)
    top = mechc.load("examples/heavy_top_rotation.mech").simulate(stop="1 s", condition=True)
    assert top.condition.growth[0] == pytest.approx(1.0, rel=1e-12)
    closed = mechc.load("examples/four_bar.mech").simulate(condition=True)
    assert closed.condition.growth[-1] < 1e-6  # what is driven keeps no change of its start


def test_it_is_told_and_costs_nothing_where_nobody_asks(capsys: pytest.CaptureFixture[str]) -> None:
    solution = mechc.load("examples/lorenz.mech").simulate(stop=1)
    with pytest.raises(mechc.SimulationError, match="nobody asked"):
        _ = solution.condition
    assert "condition" not in solution.summary() and "how errors grow" not in str(solution)
    assert run_command(["run", "examples/lorenz.mech", "--stop", "20", "--condition"]) == 0
    told = capsys.readouterr().out
    assert "they grow e-fold in" in told and "are not those of the model" in told
    assert run_command(["run", "examples/lorenz.mech", "--stop", "20", "--condition", "--json"]) == 0
    condition = json.loads(capsys.readouterr().out)["condition"]
    assert 14 < condition["horizon"] < 20 and condition["e_fold"] == pytest.approx(1.1, rel=0.3)


def test_powers_of_the_time_are_no_exponentials() -> None:
    t = np.linspace(0, 10, 200)
    assert condition_of(t, 1 + t**6, 1e-8).e_fold is None
    assert condition_of(t, np.exp(0.7 * t) * (2 + np.sin(9 * t)), 1e-8).e_fold == pytest.approx(
        1 / 0.7, rel=0.05
    )
    beyond = condition_of(t, np.where(t < 5, np.exp(t), np.inf), 1e-8)
    assert beyond.time[-1] < 5
