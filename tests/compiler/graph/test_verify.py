"""Graphs that are broken by hand are found, and shown with what surrounds the place."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest

from mechc.compiler.graph import Graph, Node, Table
from mechc.compiler.graph import operations as ops
from mechc.compiler.graph import verify as verification
from mechc.compiler.graph.verify import verify
from mechc.compiler.malformed import Malformed


def sample(by_value: bool = True) -> Graph:
    """x + y, x - y, (x + y)(x - y), sin x, x/y, if x < y then x else y, and a look-up."""
    g = Graph(by_value=by_value)
    x, y = g.symbol("x"), g.symbol("y")
    g.mul(g.add(x, y), g.sub(x, y))
    g.neg(g.sin(x))
    g.div(x, y)
    g.select(g.less(x, y), x, y)
    g.lookup_slope(g.lookup(g.add_table(Table((0.0, 1.0), (0.0, 2.0), (2.0, 2.0))), x))
    return g


def find(g: Graph, code: int) -> Node:
    return next(Node(n) for n in range(len(g)) if g.op(Node(n)) == code)


@pytest.mark.parametrize("by_value", [True, False])
def test_graphs_as_they_are_made_pass(by_value: bool) -> None:
    verify(sample(by_value))


def test_the_exceptions_of_interning_pass() -> None:
    """An earlier difference does not stand for a product, a partial form not for a whole one, a constant comes late."""
    g = Graph()
    x = g.symbol("x")
    double = g.sub(g.one, g.cos(g.mul(g.two, x)))
    assert g.mul(g.two, g.mul(g.sin(x), g.sin(x))) != double
    quotient = g.div(g.sub(g.mul(x, x), g.one), g.sub(x, g.one))
    assert g.add(x, g.one) != quotient
    verify(g)


def later_operand(g: Graph) -> None:
    g._left[find(g, ops.ADD)] = Node(len(g) - 1)


def unknown_operation(g: Graph) -> None:
    g._code[find(g, ops.SIN)] = len(ops.OPERATIONS)


def too_few_operands(g: Graph) -> None:
    g._right[find(g, ops.ADD)] = Node(-1)


def first_missing(g: Graph) -> None:
    n = find(g, ops.SIN)
    g._left[n], g._right[n] = g._right[n], g._left[n]


def no_third(g: Graph) -> None:
    del g._third[find(g, ops.SELECT)]


def descending(g: Graph) -> None:
    n = find(g, ops.MUL)
    g._left[n], g._right[n] = g._right[n], g._left[n]


def twice_negative(g: Graph) -> None:
    n = find(g, ops.NEG)
    g._left[n] = Node(1)


def negative_of_a_negative(g: Graph) -> None:
    n = find(g, ops.NEG)
    g._left[g.neg(g.cos(g.symbol("x")))] = n


def needless_third(g: Graph) -> None:
    g._third[find(g, ops.ADD)] = Node(-1)


def whole(g: Graph) -> None:
    g._traits[find(g, ops.DIV)] &= ~ops.SINGULAR


def another_kind(g: Graph) -> None:
    g._traits[find(g, ops.DIV)] ^= ops.VELOCITY


def no_kind(g: Graph) -> None:
    g._traits[g.symbol("x")] = 0


def unused(g: Graph) -> None:
    g._used.discard(ops.DIV)


def nameless(g: Graph) -> None:
    del g._names[g.symbol("x")]


def same_name(g: Graph) -> None:
    g._names[g.symbol("y")] = "x"


def same_constant(g: Graph) -> None:
    g._constants[g.constant(Fraction(1, 2))] = Fraction(2)


def no_table(g: Graph) -> None:
    g.tables.clear()


def other_value(g: Graph) -> None:
    g._values[find(g, ops.SIN)] += 1


def other_difference(g: Graph) -> None:
    n = find(g, ops.SUB)
    g._values[n] = g._values[find(g, ops.ADD)]


def made_twice(g: Graph) -> None:
    n = find(g, ops.ADD)
    g._new(ops.ADD, g._left[n], g._right[n], g._values[n])


def made_in_another_form(g: Graph) -> None:
    """(x + y)(x - y) written as x*x - y*y, past the constructors."""
    x, y = g.symbol("x"), g.symbol("y")
    squares = g.mul(x, x), g.mul(y, y)
    g._new(ops.SUB, *squares, g._values[find(g, ops.MUL)])


def lost_name(g: Graph) -> None:
    g._symbols["x"] = g.symbol("y")


def lost_value(g: Graph) -> None:
    g._classes[g._values[find(g, ops.SIN)]] = g.zero
    g._classes[5] = g.zero


def short_column(g: Graph) -> None:
    g._values.pop()


def moved_zero(g: Graph) -> None:
    g.zero = g.one


BREAKS: list[tuple[Callable[[Graph], None], str]] = [
    (later_operand, "not older"),
    (unknown_operation, "there is no operation"),
    (too_few_operands, "has 1 operands, add takes 2"),
    (first_missing, "has 1 operands, sin takes 1"),
    (no_third, "has 2 operands, select takes 3"),
    (descending, "mul is symmetric"),
    (twice_negative, "minus a constant"),
    (negative_of_a_negative, "minus a negative"),
    (needless_third, "a third operand where its operation has none"),
    (whole, "undefined, but says otherwise"),
    (another_kind, "depends on other kinds of symbols"),
    (no_kind, "a symbol of no kind"),
    (unused, "an operation that the graph does not know of"),
    (nameless, "lacks a name"),
    (same_name, "symbol x exists twice"),
    (same_constant, "not 0, 1, -1, 2, 1/2"),
    (no_table, "of table 0 of 0"),
    (other_value, "another value"),
    (other_difference, "another value"),
    (made_twice, "may stand for it"),
    (made_in_another_form, "may stand for it"),
    (lost_name, "the name x leads to another node"),
    (lost_value, "leads to another node"),
    (short_column, "columns"),
    (moved_zero, "not 0, 1"),
]


@pytest.mark.parametrize("few", [verification.FEW, 0], ids=["one by one", "in columns"])
@pytest.mark.parametrize(("spoil", "message"), BREAKS, ids=lambda b: getattr(b, "__name__", ""))
def test_broken_graphs_are_found(
    spoil: Callable[[Graph], None], message: str, few: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verification, "FEW", few)
    graph = sample()
    spoil(graph)
    with pytest.raises(Malformed, match=message):
        verify(graph)


def test_equal_structures_are_found_without_values() -> None:
    graph = sample(by_value=False)
    n = find(graph, ops.ADD)
    graph._new(ops.ADD, graph._left[n], graph._right[n], 0)
    with pytest.raises(Malformed, match=f"is node {n} once more"):
        verify(graph)


def test_a_message_shows_the_neighbourhood() -> None:
    graph = sample()
    n = find(graph, ops.MUL)
    graph._left[n], graph._right[n] = graph._right[n], graph._left[n]
    with pytest.raises(Malformed) as caught:
        verify(graph)
    assert str(caught.value) == (
        "graph, node 9: has its operands in descending order, but mul is symmetric\n"
        "       ...\n"
        "       %6 = symbol y\n"
        "       %7 = add %5 %6\n"
        "       %8 = sub %5 %6\n"
        "    -> %9 = mul %8 %7\n"
        "       %10 = sin %5\n"
        "       %11 = neg %10\n"
        "       %12 = div %5 %6\n"
        "       ..."
    )


def test_what_columns_tell_is_what_nodes_tell(monkeypatch: pytest.MonkeyPatch) -> None:
    """One number changed at random: the same is found where every node is looked at by itself."""
    random = np.random.default_rng(1)
    found = 0
    for _ in range(600):
        graph = sample()
        column = (graph._code, graph._left, graph._right, graph._traits)[random.integers(4)]
        column[int(random.integers(5, len(graph)))] = Node(int(random.integers(0, len(graph))))
        with monkeypatch.context() as patch:
            said = [wrong_of(graph)]
            patch.setattr(verification, "FEW", 0)
            said.append(wrong_of(graph))
        assert said[0] == said[1]
        found += "operands" in said[0] or "undefined" in said[0] or "negative" in said[0]
    assert found > 50


def wrong_of(graph: Graph) -> str:
    try:
        verify(graph)
    except Malformed as malformed:
        return str(malformed)
    except (
        KeyError,
        ZeroDivisionError,
        ValueError,
    ) as other:  # a leaf that an operation became, once nodes are found right
        return repr(other)
    return ""
