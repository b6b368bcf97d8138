"""Linear systems between inputs that drive coordinates and what they move: against transfer functions by hand and SciPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.signal
from numpy.typing import NDArray

import mechc
from mechc.runtime.outcome import SimulationError
from mechc.runtime.studies.kinds.along import Along
from mechc.runtime.studies.kinds.linearize import Linearization

BASE = """
model Base
  input Length y(interpolation = "spline") = 0 m;
  coordinate Length b;
  drive b = y;
  coordinate Length x = 0 m;
  kinetic 1/2*(1 kg)*der(x)^2 + 1/2*(0.5 kg)*der(b)^2;
  potential 1/2*(100 N/m)*(x - b)^2;
  damping 10 N.s/m on x - b;
  output place = x;
  output stretch = x - b;
  output push = reaction(b);
  experiment(stop = 1 s);
end Base;
"""
W = np.array([0.01, 1.0, 10.0, 100.0, 3000.0])


def linear(text: str, **settings: Any) -> Linearization:
    found = mechc.loads(text).study("linearize", **settings)
    assert isinstance(found, Linearization)
    return found


def nulls(found: Linearization) -> NDArray[np.complex128]:
    assert found.zeros is not None
    return found.zeros


def answered(found: Linearization, w: NDArray[np.float64] = W) -> NDArray[np.complex128]:
    """Return H [frequency][output][input], from the matrices as the docs state them."""
    s = 1j * w[:, None, None]
    inner = np.linalg.solve(
        s * np.eye(len(found.A)) - found.A, np.broadcast_to(found.B, (len(w), *found.B.shape))
    )
    answer: NDArray[np.complex128] = found.C @ inner + found.D + s * found.D1 + s**2 * found.D2
    return answer


@pytest.mark.filterwarnings("ignore:Badly conditioned")  # SciPy forms the polynomials again
def test_the_motion_of_the_base_is_one_input() -> None:
    """X/Y = (k + c s)/(m s^2 + c s + k): 0.101 at 100 rad/s, where the rate of the base decides."""
    found = linear(BASE, inputs="y", outputs="place")
    s = 1j * W
    wanted = (100 + 10 * s) / (s**2 + 10 * s + 100)
    np.testing.assert_allclose(answered(found)[:, 0, 0], wanted, rtol=1e-12)
    assert abs(answered(found)[3, 0, 0]) == pytest.approx(0.1010, abs=5e-5)
    assert [q.name for q in found.inputs] == ["y"] and not found.D1.any() and not found.D2.any()
    np.testing.assert_allclose(nulls(found), [-10], rtol=1e-12)
    _, by_scipy = scipy.signal.freqresp(found.signal(), W)
    np.testing.assert_allclose(by_scipy, wanted, rtol=1e-9)


def test_python_control_gets_the_whole_column() -> None:
    control = pytest.importorskip("control")
    system = linear(BASE, inputs="y", outputs="place").control()
    s = 1j * W
    np.testing.assert_allclose(system(s), (100 + 10 * s) / (s**2 + 10 * s + 100), rtol=1e-10)
    assert control.zeros(system) == pytest.approx([-10], rel=1e-12)


def test_gain_and_step_are_those_of_the_whole_column() -> None:
    gain, _, step = linear(BASE, inputs="y", outputs="place").panels
    w = gain.curves[0].x
    s = 1j * w
    np.testing.assert_allclose(gain.curves[0].y, abs((100 + 10 * s) / (s**2 + 10 * s + 100)), rtol=1e-10)
    _, wanted = scipy.signal.step(([10, 100], [1, 10, 100]), T=step.curves[0].x)
    np.testing.assert_allclose(step.curves[0].y, wanted, atol=1e-9)


def test_a_difference_that_only_the_acceleration_moves() -> None:
    """(X - Y)/Y = -m s^2/(m s^2 + c s + k): a double zero at 0, and -1 at high frequencies."""
    found = linear(BASE, outputs="stretch")
    s = 1j * W
    np.testing.assert_allclose(answered(found)[:, 0, 0], -(s**2) / (s**2 + 10 * s + 100), atol=1e-13)
    np.testing.assert_allclose(nulls(found), [0, 0], atol=1e-6)  # a double one: sqrt(rounding)
    assert not found.D1.any() and not found.D2.any()


def test_a_force_that_the_acceleration_reaches_is_told_so() -> None:
    """F/Y = M s^2 + (k + c s) m s^2/(m s^2 + c s + k), which no A, B, C, D holds."""
    found = linear(BASE, outputs="push")
    s = 1j * W
    wanted = 0.5 * s**2 + (100 + 10 * s) * s**2 / (s**2 + 10 * s + 100)
    np.testing.assert_allclose(answered(found)[:, 0, 0], wanted, rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose([found.D1[0, 0], found.D2[0, 0]], [10, 0.5], rtol=1e-12)
    # numerator: s^2 (M m s^2 + (M + m) c s + (M + m) k)
    wanted_zeros = np.sort_complex([0, 0, *np.roots([0.5, 15, 150])])
    # a double one: sqrt(rounding)
    np.testing.assert_allclose(np.sort_complex(nulls(found)), wanted_zeros, atol=1e-6)
    assert any("acceleration of 'y' reaches 'push' at once" in remark for remark in found.remarks)
    assert np.array_equal(found.arrays["D2"], found.D2)
    for asked in (found.signal, lambda: linear(BASE, outputs="push", sample=0.01)):
        with pytest.raises(SimulationError, match="'push'"):
            asked()
    assert not any(c.name.endswith("push") for c in found.panels[2].curves)


@pytest.mark.filterwarnings("ignore:Badly conditioned")
def test_held_inputs_are_those_of_the_transfer_function() -> None:
    found = linear(BASE, outputs="place", sample=0.01)
    zero_order = scipy.signal.cont2discrete(([10, 100], [1, 10, 100]), 0.01)
    _, wanted = scipy.signal.dfreqresp((zero_order[0][0], zero_order[1], 0.01), W[W < 300] * 0.01)
    _, answer = scipy.signal.dfreqresp(found.signal(), W[W < 300] * 0.01)
    np.testing.assert_allclose(answer, wanted, rtol=1e-8)


def test_two_inputs_move_a_frame() -> None:
    """A pendulum below a hinge whose place and lean are driven, with friction against what it hangs on.

    J a'' + c (a - w)' + m g r a = -m r y'' for its angle a against the vertical, J = 4/3 m r^2 of a uniform bar; the
    coordinate of the hinge is a - w.
    """
    text = """
    import mech.planar.*;
    model Hung
      input Length y(interpolation = "spline") = 0 m;
      input Angle w(interpolation = "spline") = 0 rad;
      gravity {0, -9.81} m/s^2;
      coordinate Length b; drive b = y;
      coordinate Angle h; drive h = w;
      frame cart = world * trans({b, 0*b}) * rot(h);
      Bar bar(m = 2 kg, l = 1 m);
      Revolute r(cart -> bar.a, angle = -90 deg);
      damping 0.3 N.m.s on r.angle;
      output swing = r.angle;
      output tip = pos(bar.b)[1];
      experiment(stop = 0.1 s, every = 0.05 s);
    end Hung;
    """
    found = linear(text)
    s = 1j * W
    below = 2 / 3 * s**2 + 0.3 * s + 9.81
    by_place, by_lean = -(s**2) / below, 0.3 * s / below
    wanted = np.array([[by_place, by_lean - 1], [1 + by_place, by_lean]])
    np.testing.assert_allclose(answered(found), np.moveaxis(wanted, 2, 0), atol=1e-11)
    assert found.B.shape == (2, 2) and not found.D2.any()
    only = linear(text, inputs="w", outputs="tip")
    np.testing.assert_allclose(answered(only)[:, 0, 0], by_lean, atol=1e-11)

    along = mechc.loads(text).study("along")
    assert isinstance(along, Along)
    names = ["y", "w", "der(y)", "der(w)", "der(der(y))", "der(der(w))"]
    assert [q.name for q in along.inputs] == names
    np.testing.assert_allclose(along.B[-1][1], [0, -14.715, 0, 0, -1.5, -1], atol=1e-12)
    assert [q.name for q in mechc.loads(text).study("along", inputs="w").inputs] == names[1::2]  # type: ignore[attr-defined]


def test_a_loop_that_is_driven() -> None:
    """A slider on a driven crank pushes a mass by spring and damper: displacements of the loop follow the input.

    Slider at g(a) = r cos a + sqrt(l^2 - r^2 sin^2 a); at rest x/a = g'(a) (k + c s)/(m s^2 + c s + k).
    """
    text = """
    import mech.planar.*;
    model Crank
      input Angle a(interpolation = "spline") = 50 deg;
      Bar crank(m = 1 kg, l = 0.3 m);
      Bar rod(m = 1 kg, l = 1 m);
      Revolute pin(world -> crank.a);
      Revolute knee(crank.b -> rod.a, angle ~ -60 deg);
      Particle slider(m = 1 kg);
      Prismatic rail(world -> slider.a, position ~ 1.2 m);
      Revolute eye(rod.b -> slider.a);
      drive pin.angle = a;
      coordinate Length x ~ 1.1661258 m;
      kinetic 1/2*(1 kg)*der(x)^2;
      potential 1/2*(100 N/m)*(x - rail.position)^2;
      damping 3 N.s/m on x - rail.position;
      output place = x;
      output slide = rail.position;
    end Crank;
    """
    a = np.radians(50)
    slope = -0.3 * np.sin(a) - 0.09 * np.sin(a) * np.cos(a) / np.sqrt(1 - 0.09 * np.sin(a) ** 2)
    found = linear(text, at="equilibrium")
    s = 1j * W
    np.testing.assert_allclose(
        answered(found)[:, 0, 0], slope * (100 + 3 * s) / (s**2 + 3 * s + 100), atol=1e-9
    )
    np.testing.assert_allclose(answered(found)[:, 1, 0], slope, rtol=1e-9)


def test_derivatives_of_an_input_are_no_inputs_of_their_own() -> None:
    with pytest.raises(SimulationError, match=r"'der\(y\)' follows from 'y'"):
        linear(BASE, inputs="der(y)")
    found = linear(BASE, outputs="der(der(y)),place")
    np.testing.assert_allclose(answered(found)[:, 0, 0], -(W**2), rtol=1e-14)


def test_answers_in_files(tmp_path: Path) -> None:
    found = linear(BASE, outputs="push")
    assert {"A", "B", "C", "D", "D1", "D2", "S0", "S1"} <= set(found.arrays) and found.details[
        "D2"
    ] == found.D2.tolist()
    plain = linear(BASE.replace("drive b = y;", "force y*(1 N/m) on b;").replace("reaction(b)", "b"))
    assert set(plain.arrays) == {"A", "B", "C", "D"} and "D1" not in plain.details


def test_an_input_that_moves_a_constraint_keeps_its_value() -> None:
    """It is left out and said so, and refused where it is asked for; both masses swing together."""
    text = """
    input Length u = 0.1 m;
    input Force push = 0 N;
    coordinate Length x ~ 0 m;
    coordinate Length y ~ 0 m;
    kinetic 1/2*(1 kg)*der(x)^2 + 1/2*(3 kg)*der(y)^2;
    potential 1/2*(100 N/m)*x^2;
    force push on y;
    constraint rod: x = y + u;
    """
    found = linear(text, outputs="y")
    assert [q.name for q in found.inputs] == ["push"] and found.poles.imag == pytest.approx([5, -5])
    assert any("'u' moves a constraint and keeps its value" in remark for remark in found.remarks)
    with pytest.raises(SimulationError, match="the state jumps with it"):
        linear(text, inputs="u")
