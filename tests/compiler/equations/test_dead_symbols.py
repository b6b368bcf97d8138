"""A symbol without a place at run time may stand in a formula only if it cancels, which the tests of merges show."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from compiled import compiled
from msgspec.structs import replace

import mechc
from mechc.compiler.equations.model import Equations, Function
from mechc.compiler.equations.solve.dead_symbols import without_dead_symbols
from mechc.compiler.malformed import Malformed

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
MODEL = "coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;"


def with_more(text: str) -> Equations:
    """Equations with one more function, of a question that nothing has answered."""
    equations = compiled(MODEL).equations
    graph = equations.graph
    asked, x = graph.symbol("?energy()"), graph.symbol("x")
    both = graph.tanh(graph.add(asked, x))
    values = {"sum": both, "condition": graph.select(graph.less(both, x), x, graph.one)}
    more = Function("more", "", (values[text],))
    return replace(equations, functions=(*equations.functions, more))


@pytest.mark.parametrize("text", ["sum", "condition"])
def test_forgotten_symbol_is_a_mistake_of_the_compiler(text: str) -> None:
    with pytest.raises(Malformed, match=r"energy\(\)"):
        without_dead_symbols(with_more(text))


MOVING = """
import mech.spatial.*;
model M
  Bar b2;
  Revolute j3(world -> b2.a);
  Body b4;
  Revolute j5(b2.c -> b4.a);
  structural parameter Integer N25 = 3 + 1;
  parameter p29[N25] = {(if i26 <> 2 then 1.9*i26 else 1.78)*1 kg for i26 in 1:N25};
  coordinate Length q28[4] = -0.1*{0.14000000000000001 m, -0.029999999999999999 m, 0.02 m, -0.46999999999999997 m};
  kinetic sum(1/2*p29[i26]*der(q28[i26])^2 for i26 in 1:N25);
  input Force u30[4] = {0.46999999999999997 N, -0.87 N*sin(2 rad/s*time), 2.4699999999999998 N, -0.87 N*sin(4 rad/s*time)};
  coordinate Angle q71 = 0.7 rad;
  coordinate Angle q72 = 0.87 rad;
  frame f73 = world * quat(2*cos(q72/2), 0, 2*sin(q72/2), 0);
  mass 0.41 kg at f73 * {0.13, -0.45, 0.34} m;
  frame f74 = b4.a * trans({-0.01, -0.28, -0.32} m) * axis_angle({2*cos((0.7 rad/s*time)), 2*sin((0.7 rad/s*time)), 0}, q71);
  mass 0.49 kg at f74 * {-0.43, 0.5, -0.15} m;
end M;
"""


def test_a_root_of_squares_may_be_a_number_or_not() -> None:
    """Its axis turns, with the root of 4 cos^2 + 4 sin^2: whether that is 2 depends on which numbers have come up before."""
    plain = MOVING.replace("axis_angle({2*cos((0.7 rad/s*time)), 2*sin((0.7 rad/s*time)), 0}, q71)",
                           "rotz(0.7 rad/s*time) * rotx(q71) * rotz(-0.7 rad/s*time)")  # fmt: skip
    assert plain != MOVING
    ends = [
        mechc.loads(t).simulate(stop=0.5, tolerance=1e-10, estimate_error=False)["q71"][-1]
        for t in (MOVING, plain)
    ]
    assert ends[0] == pytest.approx(ends[1], abs=1e-8)


def test_frames_of_equations_that_were_built_again() -> None:
    """A frame has its functions there, too: Hooke's joint turns the shaft behind it with W/cos(bend) where the shaft before it is at zero."""
    model = mechc.load(EXAMPLES / "universal_joint_shaft.mech")
    compilation = model.compilation
    assert compilation.equations.graph is not compilation.system.graph, "else this tests nothing"
    functions = model.functions
    y, shaft, bend = functions.start, functions.frame("shaft_out.a"), math.pi / 6
    along = [math.sin(bend), 0, math.cos(bend)]
    assert shaft.rotation is not None and shaft.angular_velocity is not None
    assert shaft.rotation(y)[:, 2] == pytest.approx(along, abs=1e-12)
    assert np.array(along) @ shaft.angular_velocity(y) == pytest.approx(10 / math.cos(bend), rel=1e-12)
    assert functions.centroid.mass(y) == pytest.approx(2, rel=1e-15)
