"""Bifurcation diagrams against closed forms, published periods of Duffing's equation, and strobing by SciPy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from mechc.presentation.answers import figure
from mechc.runtime.outcome import SimulationError

LINEAR = """\
model Linear
  dimensionless;
  parameter w = 1;
  coordinate x = 0;
  kinetic 1/2*der(x)^2;
  potential 1/2*4*x^2;
  damping 0.5 on x;
  force cos(w*time) on x;
  output twice = 2*x;
  experiment(stop = 200, tolerance = 1e-10);
end Linear;
"""

DUFFING = """\
model Duffing
  dimensionless;
  parameter g = 0.2;
  coordinate x = 0;
  kinetic 1/2*der(x)^2;
  potential -1/2*x^2 + 1/4*x^4;
  damping 0.3 on x;
  force g*cos(1.2*time) on x;
end Duffing;
"""

CUBIC = """\
model Cubic
  dimensionless;
  parameter r = -1;
  state Real x = -1;
  equation der(x) = r + x - x^3;
end Cubic;
"""

TABLE = """\
model Table "a ball on a shaken table"
  dimensionless;
  parameter a = 0.27;
  coordinate h = a*sin(0.2);
  initial der(h) = 4.9;
  let place = a*sin(2*pi*time + 0.2);
  kinetic 1/2*der(h)^2;
  potential 9.81*h;
  contact hit: h - place restitution 0.5;
  output gone = der(h);
end Table;
"""


def asked(text: str, **settings: Any) -> list[dict[str, Any]]:
    found = mechc.loads(text).diagram(**settings).summary()["diagram"]
    assert isinstance(found, list)
    return found


def amplitude(w: float) -> float:
    return 1 / math.hypot(4 - w * w, 0.5 * w)


@pytest.mark.parametrize(("at", "sign"), [("maxima", 1), ("minima", -1)])
def test_extrema_of_a_forced_oscillator_are_its_amplitude(at: str, sign: int) -> None:
    for row in asked(LINEAR, over="w = 1 .. 3, 5", of="twice", at=at):
        assert len(row["points"]) > 10 and row["period"] == 1
        wanted = sign * 2 * amplitude(row["parameter"]["w"])
        assert np.allclose(row["points"], wanted, rtol=2e-9, atol=0)


def test_strobed_it_stands_at_one_point() -> None:
    """x = Re e^(iwt)/(4 - w^2 + i w/2), at whole periods."""
    for row in asked(LINEAR, over="w = 1 .. 3, 3", every="2*pi/w"):
        w = row["parameter"]["w"]
        assert len(row["points"]) == 101
        assert np.allclose(row["points"], (1 / complex(4 - w * w, 0.5 * w)).real, atol=3e-9)
        assert np.allclose(np.diff(row["times"]), 2 * math.pi / w, rtol=1e-12)


def test_points_on_a_surface() -> None:
    """Where the force passes zero upwards; der(x) there."""
    for row in asked(LINEAR.replace("output", "output drive = cos(w*time); output"), over="w = 1 .. 3, 3", where="drive = 0", of="der(x)"):  # fmt: skip
        w = row["parameter"]["w"]
        response = 1j * w / complex(4 - w * w, 0.5 * w)
        assert np.allclose(row["points"], (response * -1j).real, atol=1e-8)


def test_periods_of_duffings_equation_are_the_published_ones() -> None:
    """x'' + 0.3 x' - x + x^3 = g cos 1.2 t: 1, 2, 4, 5, chaos, 2 periods (Jordan and Smith, Nonlinear Ordinary Differential
    Equations, 2007, section 13)."""
    published = {0.20: 1, 0.28: 2, 0.29: 4, 0.37: 5, 0.50: None, 0.65: 2}
    for g, period in published.items():
        (row, _) = asked(DUFFING, over=f"g = {g} .. {g + 1e-9}, 2", every="2*pi/1.2", hold="800*2*pi/1.2")
        assert row["period"] == period


def test_points_of_two_periods_are_those_of_another_integrator() -> None:
    period = 2 * math.pi / 1.2
    (row, _) = asked(DUFFING, over="g = 0.28 .. 0.2800001, 2", every=period, hold=400 * period)
    found = solve_ivp(
        lambda t, y: [y[1], y[0] - y[0] ** 3 - 0.3 * y[1] + 0.28 * math.cos(1.2 * t)],
        (0, 400 * period), [0, 0], "DOP853", [398 * period, 399 * period], rtol=1e-11, atol=1e-12,
    )  # fmt: skip
    assert np.allclose(sorted(row["points"][-2:]), sorted(found.y[0]), atol=1e-6)


def test_up_and_down_differ_between_the_folds() -> None:
    """r + x - x^3 = 0 has three solutions for r^2 < 4/27; between them each way stays on its branch."""
    rows = asked(CUBIC, over="r = -1 .. 1, 21", every=1, hold=60, order="both")
    assert [row["way"] for row in rows] == ["up"] * 21 + ["down"] * 21
    for row in rows:
        r = row["parameter"]["r"]
        roots = np.roots([-1, 0, 1, r])
        real = sorted(roots[np.abs(roots.imag) < 1e-9].real)
        wanted = real[0] if row["way"] == "up" else real[-1]
        assert np.allclose(row["points"], wanted, atol=1e-6)


def test_motions_that_repeat_themselves_are_dots_that_can_be_seen() -> None:
    """One for each point of a period, larger than those of clouds; the way has its colour in the legend."""
    found = mechc.loads(LINEAR).diagram(over="w = 1 .. 3, 5", every="2*pi/w", order="both")
    drawn = figure(found)
    (axes,) = drawn.axes
    spots = [line for line in axes.lines if len(line.get_xdata())]
    assert [len(line.get_xdata()) for line in spots] == [5, 5]
    assert min(line.get_markersize() for line in spots) >= 3
    assert axes.get_title(loc="left") == "once in every 2*pi/w"
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["up", "down"]
    assert all(handle.get_markersize() >= 6 for handle in axes.get_legend().get_lines())


def test_from_the_start_every_value_begins_anew() -> None:
    rows = asked(CUBIC, over="r = -0.3 .. 0.3, 3", every=1, hold=60, order="start")
    assert all(row["points"][-1] < -0.5 for row in rows)


def test_impacts_of_a_ball_on_a_shaken_table() -> None:
    """One bounce in each period: it leaves with u = g T/2, where the table has the speed v of u - v = e (u + v) (Holmes 1982)."""
    for row in asked(TABLE, over="a = 0.265 .. 0.27, 2", of="gone", at="impacts", hold=300):
        a, u = row["parameter"]["a"], 9.81 / 2
        assert row["period"] == 1 and np.allclose(np.diff(row["times"]), 1, rtol=1e-9)
        assert np.allclose(row["points"], u, rtol=1e-8)
        speed = 2 * math.pi * a * np.cos(2 * math.pi * np.asarray(row["times"]) + 0.2)
        assert np.allclose(speed, u * (1 - 0.5) / (1 + 0.5), rtol=1e-7)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({}, "a diagram needs one parameter"),
        ({"over": "w = 1 .. 2", "every": 1, "at": "maxima"}, "'every' and 'at' both choose the points"),
        ({"over": "w = 1 .. 2", "direction": "up"}, "only a surface is crossed in a direction"),
        ({"over": "w = 1 .. 2", "at": "tops"}, "'at' is one of maxima, minima, impacts, not 'tops'"),
        ({"over": "w = 1 .. 2", "order": "forth"}, "'order' is one of up, down, both, start"),
        ({"over": "x = 1 .. 2"}, "'x' is part of the state, which is carried over"),
        ({"over": "w = 1 .. 2", "every": -1}, "the time between the points is positive, it is -1"),
    ],
)
def test_what_is_no_diagram_is_refused(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(SimulationError, match=says):
        mechc.loads(LINEAR).diagram(**settings)


def test_an_initial_value_is_varied_from_the_start_only() -> None:
    rows = asked(CUBIC, over="x = -1 .. 1, 3", every=1, hold=60, order="start", set={"r": 0.1})
    assert rows[0]["points"][-1] < 0 < rows[2]["points"][-1]


def test_what_comes_to_rest_is_one_point() -> None:
    (row, _) = asked(CUBIC, over="r = -1 .. -0.9, 2", hold=60)
    assert row["period"] == 1 and row["points"] == pytest.approx(
        [-1.3247179572447460], rel=1e-8
    )  # x^3 - x = -1


def test_values_without_points_are_counted() -> None:
    found = mechc.loads(CUBIC).diagram(over="r = -1 .. 1, 3", hold=60, where="x = 5")
    assert "at 3 of 3 values the motion has no such points" in " ".join(found.remarks)


@pytest.mark.parametrize(("hold", "times"), [("0.3 s", [0.2, 0.3]), ("0.7 s", [0.4, 0.5, 0.6, 0.7])])
def test_the_last_point_lies_at_the_end_of_a_hold(hold: str, times: list[float]) -> None:
    """3 times 0.1 is more than 0.3 in double precision."""
    text = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; parameter k = 4 N/m; potential 1/2*k*x^2;"
    found = mechc.loads(text).diagram(over="k = 4 N/m .. 9 N/m, 2", every="0.1 s", hold=hold, order="start")
    for row, rate in zip(found.details["diagram"], (2, 3), strict=True):
        assert row["times"] == pytest.approx(times)
        assert row["points"] == pytest.approx(np.cos(rate * np.array(times)), abs=1e-9)
