"""Motions of first-order states along a surface where their law jumps: Filippov's solutions, by hand and from smooth laws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mechc
from mechc.cli.main import mechc as program
from mechc.runtime.outcome import Outcome


def test_between_two_states() -> None:
    """OpenModelica's 12190: x = y from 1/7 s on, at the rate of the combination 6/17 (-2, 1.5) + 11/17 (2, -3) of both fields."""
    found = mechc.loads("""
    state Real x = 1.5;
    state Real y = 1;
    equation der(x) = if x > y then -2 Hz else 2 Hz;
    equation der(y) = if y > x then -3 Hz else 1.5 Hz;
    experiment(stop = 1 s);
    """).simulate()
    assert found.outcome == Outcome.COMPLETED
    assert found["x"][-1] == pytest.approx(17 / 14 - 6 / 17 * 6 / 7, rel=1e-12)
    np.testing.assert_allclose(found["x"][found.time > 0.2], found["y"][found.time > 0.2], atol=1e-12)


LEAVES = """
model Leaves
  dimensionless;
  state Real x = 1;
  state Real y = {y};
  equation der(x) = 1;
  equation der(y) = (if {relation} then -1 else 1) + x - 1.5;
  output push = if {relation} then -1 else 1;
  experiment(stop = 3, tolerance = 1e-10);
end Leaves;
"""


@pytest.mark.parametrize("relation", ["y > 0", "not 0 >= y"])
@pytest.mark.parametrize("method", ["dop853", "radau5", "taylor"])
def test_it_leaves_where_one_side_leads_away(relation: str, method: str) -> None:
    """On y = 0 the push balances x - 1.5 until that is 1, at t = 1.5; then y = (t - 1.5)^2/2."""
    found = mechc.loads(LEAVES.format(y=0, relation=relation)).simulate(method=method)
    assert found.outcome == Outcome.COMPLETED
    t = found.time
    np.testing.assert_allclose(found["y"], np.maximum(t - 1.5, 0) ** 2 / 2, atol=1e-9)
    inner = (t > 0.01) & (t < 1.49)
    np.testing.assert_allclose(found["push"][inner], 0.5 - t[inner], atol=1e-9)
    np.testing.assert_allclose(found["push"][t > 1.51], -1)


def test_it_leaves_again_after_it_came() -> None:
    """From y = 0.1 at the rate x - 2.5: y = 0.1 - 1.5 t + t^2/2 until 0."""
    found = mechc.loads(LEAVES.format(y=0.1, relation="y > 0")).simulate()
    assert found.outcome == Outcome.COMPLETED
    come = 1.5 - np.sqrt(2.25 - 0.2)
    t = found.time
    wanted = np.where(t < come, 0.1 - 1.5 * t + t**2 / 2, np.maximum(t - 1.5, 0) ** 2 / 2)
    np.testing.assert_allclose(found["y"], wanted, atol=1e-9)


def smooth(width: float) -> NDArray[np.float64]:
    def rates(t: float, v: NDArray[np.float64]) -> list[float]:
        x, y, _ = v
        u = np.tanh((y + 0.5 * x**2 - 0.2) / width)
        return [y, -x - 0.2 * y - 2 * u, x * u]

    end: NDArray[np.float64] = solve_ivp(
        rates, (0, 4), [1.5, 0.3, 0], method="LSODA", rtol=1e-10, atol=1e-12
    ).y[:, -1]
    return end


def test_a_curved_surface_against_smooth_laws() -> None:
    """The law tanh(g/width) for two widths, extrapolated to none; the surface is kept, and integrals get the mean push."""
    text = """
    dimensionless;
    state Real x = 1.5; state Real y = 0.3; state Real w = 0;
    equation der(x) = y;
    equation der(y) = -x - 0.2*y - 2*(if y + 0.5*x^2 - 0.2 > 0 then 1 else -1);
    equation der(w) = x*(if y + 0.5*x^2 - 0.2 > 0 then 1 else -1);
    experiment(stop = 4, tolerance = 1e-10);
    """
    found = mechc.loads(text).simulate()
    wanted = 2 * smooth(1e-3) - smooth(2e-3)
    np.testing.assert_allclose([found[n][-1] for n in "xyw"], wanted, atol=2e-5)
    slid = found.time > 2
    assert abs(found["y"] + 0.5 * found["x"] ** 2 - 0.2)[slid].max() < 1e-9


def test_a_follower_that_pulls_an_oscillator() -> None:
    """Once the follower is at the mass, m x'' = -(k + c) x."""
    found = mechc.loads("""
    coordinate Length x = 1 m;
    state Length y = 0.5 m;
    kinetic 1/2*(1 kg)*der(x)^2;
    potential 1/2*(4 N/m)*x^2;
    force -(0.5 N/m)*y on x;
    equation der(y) = if y > x then -9 m/s else 9 m/s;
    experiment(stop = 3 s, tolerance = 1e-10);
    """).simulate()

    def rates(t: float, v: NDArray[np.float64]) -> list[float]:
        return [v[1], -4 * v[0] - 0.5 * v[2], 9]

    def meets(t: float, v: NDArray[np.float64]) -> float:
        return float(v[2] - v[0])

    meets.terminal = True  # type: ignore[attr-defined]
    before = solve_ivp(rates, (0, 3), [1, 0, 0.5], events=meets, rtol=1e-12, atol=1e-13)
    (x, v, _), rest, w = before.y[:, -1], 3 - before.t[-1], np.sqrt(4.5)
    assert found["x"][-1] == pytest.approx(x * np.cos(w * rest) + v / w * np.sin(w * rest), abs=1e-9)


def test_a_surface_that_moves_and_derivatives() -> None:
    """x follows sin t; before it gets there it moves at the rate k, after that k changes nothing."""
    model = mechc.loads("""
    dimensionless;
    parameter k = 3;
    state Real x = 1;
    equation der(x) = if x > sin(time) then -k else k;
    experiment(stop = 2);
    """)
    found = model.simulate(tolerance=1e-10, sensitivity=["k"])
    t = found.time
    slid = found["x"] < np.sin(t) + 1e-9
    assert slid.sum() > 100
    np.testing.assert_allclose(found["x"][slid], np.sin(t[slid]), atol=1e-9)
    by_k = found.sensitivity("x", "k").values
    first = int(slid.argmax())  # the instant itself, told from before and from after
    np.testing.assert_allclose(by_k[:first], -t[:first], atol=1e-8)
    np.testing.assert_allclose(by_k[first + 2 :], 0, atol=1e-8)


def test_laws_that_lead_through_or_away_do_not_slide() -> None:
    through = "state Real x = -1; equation der(x) = if x > 0 then 2 else 1;"
    away = "state Real x = 0.1; equation der(x) = if x > 0 then 1 else -1;"
    for text, end in ((through, 6.0), (away, 4.1)):
        found = mechc.loads(f"dimensionless; {text} experiment(stop = 4);").simulate()
        assert found["x"][-1] == pytest.approx(end, abs=1e-9)


def test_several_surfaces_at_once_are_refused_in_words() -> None:
    found = mechc.loads("""
    dimensionless;
    state Real x = 1; state Real y = 3;
    equation der(x) = if x > 0 then -1 else 1;
    equation der(y) = if y > 0 then -2 else 2;
    experiment(stop = 4);
    """).simulate()
    assert found.outcome == Outcome.FAILED and found.time[-1] == pytest.approx(1.5)
    assert "along several at once it is not followed" in found.message


def test_an_fmu_slides_too(tmp_path: Path) -> None:
    """Before it is written, its run is compared with the native one."""
    model, fmu = tmp_path / "leaves.mech", tmp_path / "leaves.fmu"
    model.write_text(LEAVES.format(y=0.1, relation="y > 0"))
    done = CliRunner().invoke(program, ["compile", str(model), "--target", "fmu", "-o", str(fmu)])
    assert done.exit_code == 0, done.output
    assert fmu.exists()
