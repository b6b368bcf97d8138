"""Closed loops of any size: what one evaluation costs grows with their number; rates of world components."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from compiled import compiled

from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.mechanics.defaults import default_values
from mechc.compiler.program.lower import hoistable

MODELS = Path(__file__).parents[2] / "models" / "loops"


def operations(text: str, n: int) -> int:
    """Of one evaluation of all accelerations; those on parameters alone are not counted."""
    equations = compiled(text, structural={"n": Fraction(n)}).equations
    rhs = next(f for f in equations.functions if f.name == "rhs")
    once = hoistable(equations.graph, equations.layout, rhs.outputs)
    return equations.graph.count_operations(rhs.outputs) - equations.graph.count_operations(once)


# bounds are the counts reached, rounded up: worse means that something was lost
@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "sizes", "bound"),
    [
        ("closed_chain.mech", (10, 20, 30), 117),
        ("ladder.mech", (4, 8, 12), 378),
        pytest.param("spatial_chain.mech", (12, 18, 24), 487, marks=pytest.mark.slow),
    ],
)
def test_cost_of_loops_is_linear(file: str, sizes: tuple[int, int, int], bound: float) -> None:
    """Each further part costs the same, within a tenth."""
    counts = [operations((MODELS / file).read_text(), n) for n in sizes]
    assert counts[2] <= bound * sizes[2]
    assert counts[2] - counts[1] <= 1.1 * (counts[1] - counts[0])


SPRINGS = """
model Series
  dimensionless;
  structural parameter Integer n = 2;
  parameter k = 3; parameter rest = 1; parameter m = 2;
  coordinate x = 1; coordinate node[n - 1] ~ 0; coordinate y = 2;
  kinetic m/2*der(x)^2 + m*der(y)^2;
  potential k/2*(node[1] - y)^2 + sum(k*(1 + i/n)/2*(node[i] - node[i - 1] - rest)^2 for i in 2:n - 1) + k*(x - node[n - 1])^2;
  experiment(stop = 1);
end Series;
"""


def test_springs_in_series_cost_as_much_as_one() -> None:
    """Nodes without mass between two masses are constant shares of their distance."""
    assert operations(SPRINGS, 5) == operations(SPRINGS, 40) <= 16


MOVING = """
import mech.spatial.*;
model Arm "a turning arm with a slider, whose tip and direction are watched"
  gravity {0, 0, -9.81} m/s^2;
  Body a(m = 1 kg, J = diag({1, 2, 3} kg.m^2));
  Body b(m = 2 kg, J = diag({1, 2, 2} kg.m^2));
  Spherical s(BASE -> a.a);
  Cylindrical c(a.a * trans({0.3, 0.1, 0.2} m) * rotx(0.4) -> b.a, axis = {1, 2, 2});
  constraint tip: pos(b.a * trans({0.1, 0.2, 0.3} m)) = {1, 2, 3} m;
  constraint turned: dot(direction(b.a, {1, 0, 0}), {0, 0.6, 0.8}) = 0.1;
  experiment(stop = 1 s);
end Arm;
"""


@pytest.mark.parametrize(
    "base", ["world", "world * trans({time^2*1 m/s^2, 0 m, 0 m}) * rotz(sin(time*1 rad/s))"]
)
def test_rates_of_world_components(base: str) -> None:
    """Offered rates and second derivatives against differences along a motion."""
    system = compiled(MOVING.replace("BASE", base)).system
    graph, rate = system.graph, system.rate
    watched = [node for rows in system.constraints for node in rows.residuals]
    rates = [rate(node) for node in watched]
    seconds = [rate(node) for node in rates]
    random = np.random.default_rng(4)
    values = default_values(system)
    values |= {s.node: random.uniform(-0.5, 0.5) for s in system.q}
    first, _ = system.rotations[0]
    turn = [s.node for s in system.q[first : first + 4]]
    size = float(np.linalg.norm([values[n] for n in turn]))
    values |= {n: values[n] / size for n in turn}
    values |= {s.node: random.uniform(-1, 1) for s in system.v}
    values |= {a: random.uniform(-1, 1) for a in system.a}

    def moved(dt: float) -> list[float]:
        """The state ``dt`` later, by Taylor's expansion in small parts; a stays."""
        now = dict(values)
        for _ in range(200):
            h = dt / 200
            half = now | {
                s.node: now[s.node] + h / 2 * now[a] for s, a in zip(system.v, system.a, strict=True)
            }
            qdot = evaluate(graph, list(system.qdot), half)
            middle = half | {s.node: now[s.node] + h / 2 * r for s, r in zip(system.q, qdot, strict=True)}
            qdot = evaluate(graph, list(system.qdot), middle)
            now = now | {s.node: now[s.node] + h * r for s, r in zip(system.q, qdot, strict=True)}
            now |= {s.node: now[s.node] + h * now[a] for s, a in zip(system.v, system.a, strict=True)}
            now[system.symbols.time] += h
        return evaluate(graph, watched, now)

    h = 1e-3
    before, here, after = np.array(moved(-h)), np.array(evaluate(graph, watched, values)), np.array(moved(h))
    assert evaluate(graph, rates, values) == pytest.approx((after - before) / (2 * h), abs=1e-5)
    assert evaluate(graph, seconds, values) == pytest.approx((after - 2 * here + before) / h**2, abs=1e-4)


def test_all_reactions_have_names_of_their_own() -> None:
    """A joint with several closure equations has as many multipliers."""
    text = (MODELS.parents[2] / "examples" / "universal_joint_shaft.mech").read_text(encoding="utf-8")
    names = [entry.name for entry in compiled(text, parts={"reactions"}).equations.outputs]
    assert {"multiplier(bearing)", "multiplier(bearing, 2)"} <= set(names)
    assert len(set(names)) == len(names)
