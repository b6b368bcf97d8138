"""Formulas of the graph as people write them: in the language itself, on one line, if they are short enough."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from . import operations as ops
from .node import Graph, Node

LONGEST = 400
"""Characters of a formula that is worth showing."""

PARTS = 60
"""Factors of a product and terms of a sum that are worth showing."""

SUM, TERM, ATOM = 1, 2, 9
"""How strongly a text binds."""

_NAMES = {ops.MINIMUM: "min", ops.MAXIMUM: "max", ops.MODULO: "mod"}
_UNWRITTEN = frozenset(
    (ops.LESS, ops.LESS_EQUAL, ops.EQUAL, ops.AND, ops.OR, ops.NOT, ops.SELECT, ops.LOOKUP)
)
_ARITHMETIC = frozenset((ops.MUL, ops.DIV, ops.NEG, ops.CONST))


class _Unwritten(Exception):
    pass


def written(graph: Graph, node: Node, names: Mapping[Node, str], longest: int = LONGEST) -> str:
    """Return a node as an expression of the language; empty where it is longer, or has choices and tables.

    Products and sums are flattened and numbers drawn in front. ``names`` of the symbols; symbols without a name give no
    text.
    """
    try:
        text = _Writer(graph, names, longest).text(node)[0]
    except _Unwritten:
        return ""
    return text if len(text) <= longest else ""


class _Writer:
    """Texts of nodes, each formed once."""

    def __init__(self, graph: Graph, names: Mapping[Node, str], longest: int) -> None:
        self.graph = graph
        self.names = names
        self.longest = longest
        self.found: dict[Node, tuple[str, int]] = {}

    def text(self, n: Node) -> tuple[str, int]:
        if n not in self.found:
            found = self.form(n)
            if len(found[0]) > self.longest:
                raise _Unwritten
            self.found[n] = found
        return self.found[n]

    def form(self, n: Node) -> tuple[str, int]:
        graph, code = self.graph, self.graph.op(n)
        if code == ops.SYMBOL:
            if n not in self.names:
                raise _Unwritten
            return self.names[n], ATOM
        if code in _UNWRITTEN:
            raise _Unwritten
        if code in (ops.ADD, ops.SUB):
            return self.sum(n), SUM
        if code in _ARITHMETIC:
            coefficient, factors = self.factors(n)
            return self.product(coefficient, factors)
        texts = [self.text(a) for a in graph.args(n)]
        if code == ops.POW:
            return f"{fit(texts[0], ATOM)}^{fit(texts[1], ATOM)}", TERM
        name = _NAMES.get(code, ops.OPERATIONS[code].name)
        return f"{name}({', '.join(text for text, _ in texts)})", ATOM

    def factors(self, n: Node) -> tuple[Fraction, dict[Node, int]]:
        """Take a product apart: its number, and the powers of its other factors."""
        graph, code = self.graph, self.graph.op(n)
        if code == ops.CONST:
            return graph.value(n), {}
        if code == ops.NEG:
            number, factors = self.factors(graph.args(n)[0])
            return -number, factors
        if code not in (ops.MUL, ops.DIV):
            return Fraction(1), {n: 1}
        (a, one), (b, other) = (self.factors(x) for x in graph.args(n))
        powers = dict(one)
        sign = 1 if code == ops.MUL else -1
        for factor, power in other.items():
            powers[factor] = powers.get(factor, 0) + sign * power
        if len(powers) > PARTS or (sign < 0 and b == 0):
            raise _Unwritten
        return a * b if sign > 0 else a / b, {f: p for f, p in powers.items() if p}

    def product(self, coefficient: Fraction, factors: Mapping[Node, int]) -> tuple[str, int]:
        above = [self.power(f, p) for f, p in factors.items() if p > 0]
        below = [self.power(f, -p) for f, p in factors.items() if p < 0]
        size, sign = abs(coefficient), "-" if coefficient < 0 else ""
        if size != 1 or not above:
            above = [number(size), *above] if size.denominator == 1 or above else above
            if size.denominator != 1 and len(above) == 0:
                above = [number(size)]
        text = "*".join(above)
        if len(below) == 1:
            text += f"/{below[0]}"
        elif below:
            text += f"/({'*'.join(below)})"
        single = len(above) == 1 and not below
        binds = SUM if sign else ATOM if single and above[0].replace(".", "").isalnum() else TERM
        if single and not sign and len(factors) == 1:
            ((factor, power),) = factors.items()
            if power == 1 and size == 1:
                return self.text(factor)
        return sign + text, binds

    def power(self, n: Node, power: int) -> str:
        text = fit(self.text(n), ATOM)
        return text if power == 1 else f"{text}^{power}"

    def sum(self, n: Node) -> str:
        graph = self.graph
        terms: list[tuple[Fraction, dict[Node, int]]] = []
        waiting: list[tuple[Node, int]] = [(n, 1)]
        while waiting:
            node, sign = waiting.pop()
            if graph.op(node) in (ops.ADD, ops.SUB):
                a, b = graph.args(node)
                waiting += [(b, sign if graph.op(node) == ops.ADD else -sign), (a, sign)]
                continue
            number, factors = self.factors(node)
            terms.append((sign * number, factors))
            if len(terms) > PARTS:
                raise _Unwritten
        text = ""
        for coefficient, factors in terms:
            one = fit(self.product(abs(coefficient), factors), TERM)
            negative = coefficient < 0
            text += (f" - {one}" if negative else f" + {one}") if text else (f"-{one}" if negative else one)
        return text


def number(value: Fraction) -> str:
    """Return a number as text: a fraction, or the decimal that it is."""
    return str(value) if value.denominator < 100 else f"{float(value)!r}"


def fit(text: tuple[str, int], need: int) -> str:
    """Return a text in parentheses, if it binds less than it needs to."""
    return text[0] if text[1] >= need else f"({text[0]})"
