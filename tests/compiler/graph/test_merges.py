"""No merge by value is false: the same formulas, interned by structure only, have the same values."""

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from mechanisms import (
    Mechanism,
    chain_parents,
    closed_chain,
    planar_tree,
    spatial_tree,
    spherical_hub,
)

from mechc.compiler.graph import Graph
from mechc.compiler.graph.elimination.eliminate import NextDefinition, Variant, solve
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.graph.rewrite import transfer

SYSTEMS: dict[str, Callable[[Graph], Mechanism]] = {
    "points": lambda g: planar_tree(g, chain_parents(12), joint_angles=True, rigid=False),
    "bars": lambda g: planar_tree(g, chain_parents(12), joint_angles=True, rigid=True),
    "spatial": lambda g: spatial_tree(g, chain_parents(8)),
    "hub": lambda g: spherical_hub(g, 4),
    "loop": lambda g: closed_chain(g, 5, joint_angles=True),
}
ONE = [Variant(NextDefinition.LEAST_FILL, 6)]


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_unmerged_program_gives_the_same_numbers(name: str) -> None:
    merged, plain = Graph(), Graph(by_value=False)
    m, p = SYSTEMS[name](merged), SYSTEMS[name](plain)
    a = solve(merged, m.residuals, m.a, variants=ONE, dense=False)
    b = solve(plain, p.residuals, p.a, variants=ONE, dense=False)
    assert a.operations < b.operations
    for seed in range(5):
        here, there = m.environment(seed), p.environment(seed)
        names = {plain.name(n): v for n, v in there.items()}
        assert names == {merged.name(n): v for n, v in here.items()}
        x = np.array(evaluate(merged, a.solutions, here))
        y = np.array(evaluate(plain, b.solutions, there))
        assert np.abs(x - y).max() <= 1e-9 * np.abs(y).max()


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_unmerged_program_is_the_same_function_at_a_second_point(name: str) -> None:
    merged, plain, other = Graph(), Graph(by_value=False), Graph(seed=20231)
    m, p = SYSTEMS[name](merged), SYSTEMS[name](plain)
    a = solve(merged, m.residuals, m.a, variants=ONE, dense=False)
    b = solve(plain, p.residuals, p.a, variants=ONE, dense=False)
    x = transfer(merged, a.solutions, other)
    y = transfer(plain, b.solutions, other)
    assert all(other.identical(s, t) for s, t in zip(x, y, strict=True))
    # and the point is another one: the same symbol has another value there
    assert merged._values[merged.symbol("u0")] != other._values[other.symbol("u0")]


@pytest.mark.parametrize("seed", range(4))
def test_the_count_does_not_depend_on_the_point(seed: int) -> None:
    counts = set()
    for s in (0, seed + 1):
        g = Graph(seed=s)
        m = SYSTEMS["spatial"](g)
        counts.add(solve(g, m.residuals, m.a).operations)
    assert len(counts) == 1


FACTORS = [Fraction(2) ** k for k in (31, 40, 64, 95, 126, 200)] + [
    Fraction(math.pi) ** k for k in (-1, -2, -3, -4, 1, 2)
]


@pytest.mark.parametrize("factor", FACTORS, ids=lambda c: f"{float(c):.3g}")
def test_angles_of_any_factor_stay_apart(factor: Fraction) -> None:
    """Exponents are taken modulo a power of two: a factor with as many twos must not make angles vanish."""
    graph = Graph()
    x, y, c = graph.symbol("x"), graph.symbol("y"), graph.constant(factor)
    angles = [graph.mul(c, x), graph.add(graph.mul(c, x), y), graph.sub(y, graph.mul(c, x)), c]
    values = [float(factor) * 0.57, float(factor) * 0.57 + 0.3, 0.3 - float(factor) * 0.57, float(factor)]
    found = evaluate(graph, [f(a) for a in angles for f in (graph.sin, graph.cos)], {x: 0.57, y: 0.3})
    assert found == pytest.approx([f(v) for v in values for f in (math.sin, math.cos)], abs=1e-15)


def test_no_part_of_an_angle_vanishes() -> None:
    """A factor with many twos takes what is divided by them back, and would lose what stands beside it."""
    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    many = Fraction(2) ** 112
    inner = graph.add(graph.mul(graph.constant(1 / many), x), graph.atan(y))
    angle = graph.mul(graph.constant(many / 3), inner)
    assert graph.cos(angle) != graph.cos(graph.div(x, graph.constant(3)))


@pytest.mark.parametrize("value", [1e13, 1e16, 3e20])
def test_large_constants_are_no_turns(value: float) -> None:
    """One rounding of them is as far as from one sixth of a turn to the next."""
    graph = Graph()
    assert evaluate(graph, [graph.sin(graph.constant(Fraction(value)))], {}) == [math.sin(value)]
