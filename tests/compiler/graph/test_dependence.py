"""What nodes depend on, by the quick ways and by walking through arguments."""

import random

import pytest

from mechc.compiler.graph import Graph, Node, dependence
from mechc.compiler.graph import operations as ops


def walked(graph: Graph, wanted: list[Node], known: set[Node]) -> list[Node]:
    found: set[Node] = set()
    pending = [n for n in wanted if n not in known]
    while pending:
        n = pending.pop()
        found.add(n)
        pending += [a for a in graph.args(n) if a not in known and a not in found]
    return sorted(found)


@pytest.fixture(params=[0, 500], ids=["by marks", "few"])
def graph(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Graph:
    monkeypatch.setattr(dependence, "FEW", request.param)
    rng = random.Random(3)
    g = Graph()
    nodes = [g.symbol(f"s{k}") for k in range(8)] + [g.constant(k) for k in range(2, 5)]
    for _ in range(300):
        a, b, c = rng.choices(nodes, k=3)
        made = (g.add(a, b), g.mul(a, b), g.sub(a, b), g.sin(a), g.select(g.less(a, b), b, c))
        nodes.append(rng.choice(made))
    return g


def test_all_ways_find_the_same(graph: Graph) -> None:
    rng = random.Random(5)
    everything = [Node(n) for n in range(len(graph))]
    for _ in range(60):
        wanted = rng.choices(everything, k=rng.choice([0, 1, 2, 7]))
        found = walked(graph, wanted, set())
        for _ in range(2):  # the second answer is a kept one
            assert graph.reach(wanted) == found
            assert graph.support(*wanted) == [n for n in found if graph.op(n) == ops.SYMBOL]
            assert graph.count_operations(wanted) == sum(graph.op(n) > ops.SYMBOL for n in found)
        asked = rng.choices(everything, k=9)
        assert graph.reached_among(wanted, asked) == [n for n in asked if n in found]
        for n in wanted:
            assert graph.depend([n], asked) == (not set(asked).isdisjoint(walked(graph, [n], set())))
        known = set(rng.choices(everything, k=4))
        assert graph.reach(iter(wanted), iter(known)) == walked(graph, wanted, known)


def test_a_fork_has_answers_of_its_own(graph: Graph) -> None:
    x, y = graph.symbol("s0"), graph.symbol("s1")
    other = graph.fork()
    mine, theirs = graph.mul(graph.sin(x), graph.cos(y)), other.mul(other.exp(y), other.exp(other.exp(y)))
    assert graph.support(mine) == [x, y]
    assert other.support(theirs) == [y]
    assert graph.support(mine) == [x, y]
