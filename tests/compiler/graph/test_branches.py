"""Which nodes only one branch needs."""

import pytest

from mechc.compiler.graph import Graph
from mechc.compiler.graph.differentiate import guards


def test_private_and_shared_nodes() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    condition = g.less(x, y)
    private, shared = g.sqrt(x), g.exp(y)
    root = g.select(condition, g.mul(private, shared), g.neg(shared))
    found = guards(g, [root])
    inside = found[private]
    assert inside is not None
    assert (inside.condition, inside.holds, inside.outer) == (condition, True, None)
    assert found[g.mul(private, shared)] is inside
    assert found[shared] is None  # both branches need it
    other = found[g.neg(shared)]
    assert other is not None and not other.holds
    assert found[condition] is None and found[x] is None


def test_an_output_is_always_needed() -> None:
    g = Graph()
    x = g.symbol("x")
    root = g.select(g.less(x, g.one), g.sqrt(x), g.zero)
    assert guards(g, [root, g.sqrt(x)])[g.sqrt(x)] is None


def test_nested_branches() -> None:
    g = Graph()
    x, y, z = (g.symbol(c) for c in "xyz")
    outer, inner = g.less(x, y), g.less(y, z)
    deep, middle = g.log(z), g.exp(z)
    root = g.select(outer, g.select(inner, g.mul(deep, middle), middle), x)
    found = guards(g, [root])
    guard = found[deep]
    assert guard is not None and guard.outer is found[middle] is not None
    assert (guard.condition, guard.depth) == (inner, 2)
    assert found[inner] is found[middle]  # the inner condition is asked only there
    assert found[z] is found[middle]


@pytest.mark.parametrize("shallow_first", [True, False])
def test_uses_at_different_depths(shallow_first: bool) -> None:
    """One use two branches deep, one in the other branch of the inner condition, one deeper still."""
    g = Graph()
    x, y, z = (g.symbol(c) for c in "xyz")
    first, second, third = g.less(x, y), g.less(y, z), g.less(z, x)
    used = g.exp(z)
    if shallow_first:
        g.mul(used, y)
    deep = g.select(third, g.mul(used, x), y)
    root = g.select(first, g.select(second, deep, g.mul(used, y)), x)
    found = guards(g, [root])
    guard = found[used]
    assert guard is not None and (guard.condition, guard.depth) == (first, 1)
    inner = found[g.mul(used, x)]
    assert inner is not None and (inner.condition, inner.depth) == (third, 3)


def test_two_selects_with_one_condition_share_their_guard() -> None:
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    condition, private = g.less(x, y), g.sin(x)
    total = g.add(g.select(condition, private, y), g.select(condition, g.mul(private, y), x))
    guard = guards(g, [total])[private]
    assert guard is not None and guard.holds
