"""Bifurcation diagrams against closed forms, published periods of Duffing's equation, and strobing by SciPy."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from shared_models import CUBIC
from slow_params import slow_but
from struck_oscillator import after_a_period, strobed

import mechc
from mechc.presentation.answers import figure
from mechc.runtime.outcome import SimulationError

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

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
        assert len(row["points"]) == 100
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


def test_periods_of_the_driven_pendulum_are_the_published_ones() -> None:
    """q = 2, wD = 2/3: periods of Baker and Gollub, Chaotic Dynamics (1990), chapter 3; chaotic at g = 1.15 and 1.50."""
    model = mechc.load(EXAMPLES / "driven_pendulum.mech")
    for g, period in {0.9: 1, 1.07: 2, 1.15: None, 1.35: 1, 1.45: 2, 1.47: 4, 1.5: None}.items():
        found = model.diagram(
            over=f"g = {g} .. {g + 1e-9}, 2", every="2*pi/wD", hold="600*2*pi/wD", tolerance=1e-8
        )
        assert found.details["diagram"][0]["period"] == period


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


def test_several_starts_show_attractors_beside_each_other() -> None:
    """r + x - x^3 = 0 has three solutions for r^2 < 4/27, of which the middle one parts what goes to the others."""
    settings: dict[str, Any] = {
        "over": "r = -0.3 .. 0.3, 3",
        "every": 1,
        "hold": 60,
        "starts": "x = -2 .. 2, 4",
    }
    for order in ("start", "up", "down"):
        rows = asked(CUBIC, order=order, **settings)
        assert len(rows) == 12
        for row in rows:
            roots = np.sort(np.roots([-1, 0, 1, row["parameter"]["r"]]).real)
            # the middle one lies within 0.34 of zero
            wanted = roots[0] if row["start"]["x"] < 0 else roots[2]
            assert row["points"][-1] == pytest.approx(wanted, abs=1e-6)
    found = mechc.loads(CUBIC).diagram(**settings)
    assert found.message.endswith("points at 3 values of r from 4 starts")
    assert set(found.arrays) == {"r", "time", "x", "start of x"}


def test_impacts_of_a_ball_on_a_shaken_table() -> None:
    """One bounce in each period: it leaves with u = g T/2, where the table has the speed v of u - v = e (u + v) (Holmes 1982)."""
    for row in asked(TABLE, over="a = 0.265 .. 0.27, 2", of="gone", at="impacts", hold=300):
        a, u = row["parameter"]["a"], 9.81 / 2
        assert row["period"] == 1 and np.allclose(np.diff(row["times"]), 1, rtol=1e-9)
        assert np.allclose(row["points"], u, rtol=1e-8)
        speed = 2 * math.pi * a * np.cos(2 * math.pi * np.asarray(row["times"]) + 0.2)
        assert np.allclose(speed, u * (1 - 0.5) / (1 + 0.5), rtol=1e-7)


STOP = """\
model Stop "an oscillator against a hard stop"
  dimensionless;
  parameter w = 2.6;
  coordinate x = 0;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  damping 0.04 on x;
  force cos(w*time) on x;
  contact stop: 0.3 - x restitution 0.8;
end Stop;
"""


def test_points_of_an_impacting_oscillator_follow_each_other() -> None:
    """From before its grazing at w = 2.0814162, where 1/|1 - w^2 + 0.04 i w| = 0.3, to chaos after it. The chaos of two programs
    does not agree, so each point is carried on to the next; of 80 000 points the worst was 3e-7 off."""
    settings: dict[str, Any] = {"over": "w = 2.06 .. 2.12, 4", "every": "2*pi/w", "hold": "120*2*pi/w"}
    places, rates = asked(STOP, **settings), asked(STOP, of="der(x)", **settings)
    struck = 0
    for one, other in zip(places, rates, strict=True):
        assert len(one["points"]) == 60
        points = list(zip(one["points"], other["points"], strict=True))
        for before, after in itertools.pairwise(points):
            x, v, hits = after_a_period(one["parameter"]["w"], *before)
            assert (x, v) == pytest.approx(after, abs=3e-6)
            struck += hits
    assert struck > 50


def settled(points: np.ndarray, period: int) -> int:
    """Return from which point on a motion repeats itself to 2e-8."""
    moves = np.flatnonzero(np.abs(points[period:] - points[:-period]) > 2e-8)
    return int(moves[-1]) + 1 if moves.size else 0


def apart(found: np.ndarray, points: np.ndarray, period: int) -> tuple[int, float]:
    """Return from which point on two motions repeat themselves, and how far they are apart from there."""
    first = period + max(settled(found, period), settled(points, period))
    off = [np.abs(found[first:] - points[first - k : 200 - k]).max(initial=0) for k in range(period)]
    return first, min(off) if first + period <= 200 else math.inf


@pytest.mark.slow
def test_all_windows_of_an_impacting_oscillator() -> None:
    """400 values of 200 points, against another program. What is left of a beginning differs, and with it which point of the period
    is met when: all points are compared from where both motions repeat themselves."""
    rows = asked(
        STOP,
        over="w = 2 .. 2.9, 400",
        every="2*pi/w",
        hold="400*2*pi/w",
        order="start",
        tolerance=1e-10,
    )
    own = strobed(np.array([row["parameter"]["w"] for row in rows]), 400, 200)
    periods, worst, count = [], 0.0, 0
    for row, points in zip(rows, own, strict=True):
        if not (period := row["period"]):
            continue
        found = np.array(row["points"])
        first, off = apart(found, points, period)
        if first + period <= 200:
            if off > 1e-6:  # of attractors beside each other rounding chooses one
                nearby = strobed(row["parameter"]["w"] + 1e-13 * np.arange(1, 17), 400, 200)
                off = min(apart(found, points, period)[1] for points in nearby)
            assert off < 1e-6, row["parameter"]
            periods.append(period)
            worst, count = max(worst, off), count + 200 - first
    print(
        f"{count} points are {worst:.1e} off at most, at {len(periods)} values, of {sum(row['period'] is not None for row in rows)}"
    )
    assert len(periods) > 200 and {*periods} >= {1, 3, 4, 5, 6, 8, 16}


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({}, "a diagram needs one parameter"),
        ({"over": "w = 1 .. 2", "every": 1, "at": "maxima"}, "'every' and 'at' both choose the points"),
        ({"over": "w = 1 .. 2", "direction": "up"}, "only a surface is crossed in a direction"),
        ({"over": "w = 1 .. 2", "at": "tops"}, "'at' is one of maxima, minima, impacts, not 'tops'"),
        ({"over": "w = 1 .. 2", "order": "forth"}, "'order' is one of up, down, both, start"),
        (
            {"over": "w = 1 .. 2", "starts": "w = 1 .. 2, 3"},
            "'w' is not an initial value: starts differ in these alone",
        ),
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
    # x^3 - x = -1
    assert row["period"] == 1 and row["points"] == pytest.approx([-1.3247179572447460], rel=1e-8)


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


def test_a_branch_goes_on_where_it_is_unstable() -> None:
    """The motion of one point of Duffing's equation doubles its period at g = 0.2656; each point of the branch comes back after a
    period of SciPy's motion, and a small change grows or shrinks there as the largest multiplier says."""
    period = 2 * math.pi / 1.2

    def after(g: float, y: Any) -> Any:
        return solve_ivp(
            lambda t, y: [y[1], y[0] - y[0] ** 3 - 0.3 * y[1] + g * math.cos(1.2 * t)],
            (0, period), y, "DOP853", rtol=1e-11, atol=1e-12,
        ).y[:, -1]  # fmt: skip

    settings = {"over": "g = 0.2 .. 0.32, 4", "every": "2*pi/1.2", "branch": True, "tolerance": 1e-9}
    places, rates = (
        mechc.loads(DUFFING).diagram(of=of, set={"x": 1}, **settings).details for of in ("x", "der(x)")
    )
    assert [one["kind"] for one in places["special"]] == ["period doubling"]
    for one, other in zip(places["branch"], rates["branch"], strict=True):
        g, start = one["parameter"]["g"], np.array([*one["points"], *other["points"]])
        assert after(g, start) == pytest.approx(start, abs=1e-7)
        changes = [(after(g, start + d) - after(g, start - d)) / 2e-5 for d in 1e-5 * np.eye(2)]
        largest = np.abs(np.linalg.eigvals(np.column_stack(changes))).max()
        assert max(abs(complex(*m)) for m in one["multipliers"]) == pytest.approx(largest, rel=1e-5)
        assert one["stable"] == (largest < 1) == (g < places["special"][0]["value"])
    assert places["branch"][-1]["parameter"]["g"] == pytest.approx(0.32)


def test_a_branch_grazes_where_its_amplitude_reaches_the_stop() -> None:
    found = mechc.loads(STOP).diagram(
        over="w = 2.075 .. 2.5, 6", order="down", every="2*pi/w", hold="300*2*pi/w", branch=True
    )
    grazing = brentq(lambda w: 1 / math.hypot(1 - w * w, 0.04 * w) - 0.3, 2, 2.2)
    assert grazing == pytest.approx(2.0814162, abs=1e-7)
    (event,) = (one for one in found.details["special"] if one["kind"] == "grazing")
    assert event["value"] == pytest.approx(grazing, abs=1e-7)


BELT = """\
model Belt "a block on a belt, held by a spring"
  dimensionless;
  parameter u = 0.2 "of the belt";
  coordinate x = 0;
  initial der(x) = u;
  let v = abs(u - der(x));
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  damping 0.02 on x;
  friction LAW on x - u*time;
  experiment(stop = 60, tolerance = 1e-10);
end Belt;
"""

LAWS: dict[str, Callable[[float], float]] = {
    "0.6 + 0.4*exp(-v/0.3) + 0.05*v": lambda v: 0.6 + 0.4 * math.exp(-v / 0.3) + 0.05 * v,
    "0.8 + 4*v*exp(1 - 10*v)": lambda v: 0.8 + 4 * v * math.exp(1 - 10 * v),
}
"""One with its peak at rest, one with its peak at 0.1."""


def stick_and_slip(law: Callable[[float], float], u: float) -> tuple[float, float, float]:
    """Return period, largest and smallest x of the cycle by SciPy: it slips from where it cannot stick, until it is as fast as the belt."""

    def rate(t: float, y: np.ndarray) -> list[float]:
        slip = u - y[1]
        return [y[1], math.copysign(law(abs(slip)), slip) - y[0] - 0.02 * y[1]]

    def sticks(t: float, y: np.ndarray) -> float:
        return float(y[1] - u) if t > 0.5 else -1.0

    def turns(t: float, y: np.ndarray) -> float:
        return float(y[1])

    sticks.terminal = True  # type: ignore[attr-defined]
    begin = law(0) - 0.02 * u
    found = solve_ivp(
        rate, (0, 30), [begin, u], "DOP853", events=[sticks, turns], rtol=1e-12, atol=1e-13, max_step=0.05
    )
    end = float(found.y[0, -1])
    assert found.status == 1 and abs(end + 0.02 * u) < law(0)
    seen = found.y_events[1][:, 0]
    assert seen.size == 2
    return float(found.t[-1]) + (begin - end) / u, float(seen[0]), float(seen[1])


@pytest.mark.parametrize("law", slow_but([next(iter(LAWS))], LAWS))
def test_a_branch_of_stick_and_slip(law: str) -> None:
    model = mechc.loads(BELT.replace("LAW", law))
    settings: dict[str, Any] = {"over": "u = 0.15 .. 0.5, 6", "of": "x", "branch": True}
    top, low = (model.diagram(at=at, **settings).details["branch"] for at in ("maxima", "minima"))
    assert len(top) >= 6 and len(low) == len(top)
    for one, other in zip(top, low, strict=True):
        (largest,), (smallest,) = one["points"], other["points"]
        wanted = stick_and_slip(LAWS[law], one["parameter"]["u"])
        assert (one["period"], largest, smallest) == pytest.approx(wanted, rel=1e-9, abs=1e-9)
        # nothing of a change is left after a stick
        assert max(abs(complex(*m)) for m in one["multipliers"]) < 1e-8


def test_why_there_is_no_branch_is_said() -> None:
    found = mechc.loads(DUFFING).diagram(over="g = 0.5 .. 0.5001, 2", every="2*pi/1.2", branch=True)
    assert "there is no periodic motion from which to follow a branch" in found.remarks
    assert "branch" not in found.details
