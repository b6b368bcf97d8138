"""Conditions on a quantity that stays zero on one side, as the depth of a contact: no sign changes where it becomes zero."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mechc
from mechc.compiler.graph import Graph
from mechc.compiler.mechanics.meaning.functions import less, less_equal

Array = NDArray[np.float64]

K, C = 1e4, 20.0
FALLING = """
coordinate Length x = 0.1 m;
kinetic 1/2*1 kg*der(x)^2;
potential 9.81 N*x + 1/2*1e4 N/m*max(0 m, -x)^2;
let depth = max(0 m, -x);
let S = if x < 0 m then -1e4 N/m*x else 0 N;
"""
ON_DEPTH = (
    "depth > 0 m",
    "not depth <= 0 m",
    "0 N < 1e4 N/m*depth",
    "abs(depth) > 0 m",
    "1e4*depth/1 m + (depth/1 m)^3 > 0",
    "sqrt(depth/1 m) > 0",
    "min(x, 0 m) < 0 m",
    "S > 0 N",
)


@cache
def bounced() -> tuple[float, float]:
    """Place and speed after 1 s on a spring with a damper that does not pull; the steps end where it touches and parts."""

    def touching(t: float, y: np.ndarray) -> list[float]:
        return [float(y[1]), -9.81 + max(0.0, -K * y[0] - C * y[1])]

    def zero(t: float, y: np.ndarray) -> float:
        return float(y[0])

    zero.terminal = True  # type: ignore[attr-defined]
    t, y, inside = 0.0, np.array([0.1, 0.0]), False
    while t < 1:
        zero.direction = 1.0 if inside else -1.0  # type: ignore[attr-defined]
        right = touching if inside else lambda t, y: [float(y[1]), -9.81]
        found = solve_ivp(right, (t, 1.0), y, "DOP853", events=zero, rtol=1e-11, atol=1e-13, max_step=1e-2)
        t, y, inside = float(found.t[-1]), found.y[:, -1].copy(), not inside
    return float(y[0]), float(y[1])


@pytest.mark.parametrize("condition", ON_DEPTH)
def test_a_damper_that_acts_while_something_is_deep(condition: str) -> None:
    s = mechc.loads(
        f"{FALLING} force (if {condition} then max(-1e4 N/m*depth, -20 N.s/m*der(x)) else 0 N) on x; experiment(stop = 1 s, tolerance = 1e-11);"
    ).simulate(estimate_error=False)
    assert s["x"][-1] == pytest.approx(bounced()[0], abs=1e-7)
    assert s["der(x)"][-1] == pytest.approx(bounced()[1], abs=1e-5)


@pytest.mark.parametrize("condition", ["abs(S) > 0 N", "S > 0 N or S < 0 N", "not (S <= 0 N and S >= 0 N)"])
def test_a_damper_beyond_a_play(condition: str) -> None:
    """The same outside of a dead zone, with the condition on its force and on the place: one motion."""
    text = "coordinate Length x = 0.3 m; kinetic 1/2*1 kg*der(x)^2; let S = 1e3 N/m*deadzone(x, 0.1 m); potential 1/2*1e3 N/m*deadzone(x, 0.1 m)^2; force (if {} then -4 N.s/m*der(x) else 0 N) on x; experiment(stop = 2 s, tolerance = 1e-11);"
    one, other = (
        mechc.loads(text.format(c)).simulate(estimate_error=False) for c in (condition, "abs(x) > 0.1 m")
    )
    assert one["x"][-1] == pytest.approx(other["x"][-1], abs=1e-9)


def test_a_relation_without_such_a_region_stays_as_it_is() -> None:
    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    for a, b in ((x, y), (graph.zero, x), (graph.maximum(x, y), graph.one), (graph.abs(x), y)):
        assert less(graph, a, b) == graph.less(a, b)
        assert less_equal(graph, a, b) == graph.less_equal(a, b)
    assert less(graph, graph.zero, graph.maximum(graph.zero, x)) != graph.less(
        graph.zero, graph.maximum(graph.zero, x)
    )


PADDED = """
import mech.translational.*;

model Pad
  input Length below;
  input Length above;
  let lo = below;
  Gap gap(lo -> above, k = 1e4 N/m, c = 60 N.s/m, rest = 0.1 m);
  output Force F = gap.push;
end Pad;

model Cell
  input Length floor;
  Slider body(m = 2 kg, s = 0.3 m);
  let top = body.s;
  Pad pad(below = floor, above = top);
  potential 2 kg*9.81 m/s^2*body.s;
end Cell;

model Padded
  let Length road = 2 cm*sin(5 rad/s*time);
  Cell cell(floor = road);
  state impulse = 0 N.s;
  equation der(impulse) = cell.pad.F;
  when impulse > 30 N.s then
    terminate("enough");
  end when;
  experiment(stop = 5 s, tolerance = 1e-10);
end Padded;
"""


def test_a_gap_in_a_part_of_a_part_over_a_moving_floor_lets_go() -> None:
    """F = max(0, k overlap - c v) while both sides overlap, and nothing after; the times by SciPy."""

    def rate(t: float, x: Array) -> list[float]:
        overlap, v = 0.1 - x[0] + 0.02 * np.sin(5 * t), x[1] - 0.1 * np.cos(5 * t)
        push = max(0.0, 1e4 * overlap - 60 * v) if overlap >= 0 else 0.0
        return [x[1], push / 2 - 9.81, push]

    def enough(_: float, x: Array) -> float:
        return float(x[2] - 30)

    enough.terminal = True  # type: ignore[attr-defined]
    known = solve_ivp(
        rate, (0, 5), [0.3, 0, 0], "DOP853", rtol=1e-10, atol=1e-11, max_step=1e-3, events=[enough]
    )
    run = mechc.loads(PADDED, model="Padded").simulate()
    assert run.time[-1] == pytest.approx(known.t[-1], abs=1e-7)
    assert run["cell.body.s"][-1] == pytest.approx(known.y[0, -1], abs=1e-7)
