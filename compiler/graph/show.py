"""Formulas of the graph as text, for ``mechc show`` and golden tests."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from fractions import Fraction

from . import operations as ops
from .node import Graph, Node
from .table import ELEMENT, question

LONGEST = 100
"""Characters of a formula; a longer part gets a name of its own."""

_INFIX = {
    ops.ADD: ("+", 1, 1, 1),
    ops.SUB: ("-", 1, 1, 2),
    ops.MUL: ("*", 2, 2, 2),
    ops.DIV: ("/", 2, 2, 3),
    ops.LESS: ("<", 0, 1, 1),
    ops.LESS_EQUAL: ("<=", 0, 1, 1),
    ops.EQUAL: ("==", 0, 1, 1),
}
"""Sign, how strongly the result binds, and what the operands need to do without parentheses."""

_NEGATION, _ATOM = 2, 9


def show_formulas(graph: Graph, named: Sequence[tuple[str, Node]]) -> Iterator[str]:
    """Yield lines ``name = formula``; what several formulas share comes first under the names %1, %2, ..."""
    outputs = [node for _, node in named]
    order = graph.reach(outputs)
    uses = Counter(argument for n in order for argument in graph.args(n))
    uses.update(outputs)
    texts: dict[Node, tuple[str, int]] = {}
    shared = 0
    for n in order:
        text, binds = _formula(graph, n, texts)
        if graph.args(n) and (uses[n] > 1 or len(text) > LONGEST):
            shared += 1
            yield f"%{shared} = {text}"
            text, binds = f"%{shared}", _ATOM
        texts[n] = text, binds
    for name, node in named:
        yield f"{name} = {texts[node][0]}"


def short_formula(graph: Graph, node: Node, most: int) -> str | None:
    """Return a formula in one piece; None where it is longer than ``most`` characters, or has more operations than that."""
    order = graph.reach([node])
    if len(order) > most:
        return None
    texts: dict[Node, tuple[str, int]] = {}
    for n in order:
        texts[n] = _formula(graph, n, texts)
        if len(texts[n][0]) > most:
            return None
    return texts[node][0]


def _formula(graph: Graph, n: Node, texts: dict[Node, tuple[str, int]]) -> tuple[str, int]:
    """Return the text of one node made of those of its arguments, and how strongly it binds."""
    code = graph.op(n)
    if code == ops.CONST:
        return _constant(graph.value(n))
    if code == ops.SYMBOL:
        return graph.name(n), _ATOM
    arguments = [texts[a] for a in graph.args(n)]
    if code == ops.NEG:
        return f"-{_fit(arguments[0], 2)}", _NEGATION
    if code in _INFIX:
        sign, binds, left, right = _INFIX[code]
        blank = "" if sign in "*/" else " "
        return f"{_fit(arguments[0], left)}{blank}{sign}{blank}{_fit(arguments[1], right)}", binds
    listed = ", ".join(text for text, _ in arguments)
    if code == ops.LOOKUP:
        table, order = graph.table_of(n)
        if order >= ELEMENT:
            return f"{question(order)} of table {table + 1}({listed})", _ATOM
        return f"table {table + 1}{chr(39) * order}({listed})", _ATOM
    return f"{ops.OPERATIONS[code].name}({listed})", _ATOM


def _constant(value: Fraction) -> tuple[str, int]:
    if value.denominator == 1:
        return str(value), _ATOM if value >= 0 else _NEGATION
    if value.denominator < 1000:
        return str(value), 2
    return f"{float(value)!r}", _ATOM if value >= 0 else _NEGATION


def _fit(formula: tuple[str, int], need: int) -> str:
    text, binds = formula
    return text if binds >= need else f"({text})"
