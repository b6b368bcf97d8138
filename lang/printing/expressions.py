"""Expressions to text that reads back to the same tree."""

from __future__ import annotations

from collections.abc import Sequence
from typing import assert_never

from .. import ast
from ..units import unit_end
from .layout import Bracketed, Chain, Doc, Link, Unbroken, flat

# How tightly each form binds; an operand that binds less than its place asks for gets parentheses.
_CONDITIONAL, _OR, _AND, _NOT, _RELATION, _SUM, _PRODUCT, _SIGNED, _POWER, _ATOM = range(10)
_LEVELS = {
    "or": _OR, "and": _AND, "+": _SUM, "-": _SUM, "*": _PRODUCT, "/": _PRODUCT, "^": _POWER,
}  # fmt: skip


def print_expression(expression: ast.Expression) -> str:
    """Return an expression on one line."""
    return flat(document(expression))


def document(expression: ast.Expression, level: int = _CONDITIONAL) -> Doc:
    """Return an expression as a document, in parentheses where it binds less than ``level``."""
    doc = _bare(expression)
    return Bracketed("(", (doc,), ")") if _level(expression) < level else doc


def quote(text: str) -> str:
    """Return a text in quotes."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\t", "\\t")
    return f'"{escaped}"'


def _level(expression: ast.Expression) -> int:
    match expression:
        case ast.Binary(operator=operator):
            return _LEVELS.get(operator, _RELATION)
        case ast.Unary(operator=operator):
            return _NOT if operator == "not" else _SIGNED
        case ast.Conditional() | ast.Range() | ast.Aggregate():
            return _CONDITIONAL
        case ast.Quantity():
            return _POWER
        case (
            ast.Vector(unit=unit)
            | ast.Comprehension(unit=unit)
            | ast.Parenthesis(unit=unit)
            | ast.Call(unit=unit)
        ):
            return _POWER if unit else _ATOM
        case _:
            return _ATOM


def _bare(e: ast.Expression) -> Doc:
    match e:
        case ast.Number():
            return e.text
        case ast.Quantity():
            return f"{e.text} {e.unit}"
        case ast.String():
            return quote(e.value)
        case ast.Boolean():
            return "true" if e.value else "false"
        case ast.Time():
            return "time"
        case ast.Reference():
            return reference(e)
        case ast.Derivative():
            order = () if e.order == 1 else (str(e.order),)
            return Bracketed("der(", (document(e.operand), *order), ")")
        case ast.Previous():
            return Bracketed("pre(", (document(e.operand),), ")")
        case ast.Unary():
            if e.operator == "not":
                return Unbroken(("not ", document(e.operand, _NOT)))
            return Unbroken((e.operator, document(e.operand, _SIGNED)))
        case ast.Binary():
            return _binary(e)
        case ast.Conditional():
            return _conditional(e)
        case ast.Vector():
            return Bracketed("{", tuple(document(x) for x in e.elements), "}", _unit(e.unit))
        case ast.Comprehension():
            return Bracketed("{", (_generated(e.element, e.generators),), "}", _unit(e.unit))
        case ast.Aggregate():
            return _generated(e.element, e.generators)
        case ast.Range():
            parts = [e.start, e.stop] if e.step is None else [e.start, e.step, e.stop]
            return ":".join(_index(p) for p in parts)
        case ast.Whole():
            return ":"
        case ast.Result():
            return document(e.call)
        case ast.Call():
            keywords = (Unbroken((f"{k.name} = ", document(k.value))) for k in e.keywords)
            arguments = (*(document(a) for a in e.arguments), *keywords)
            return Unbroken((reference(e.function), Bracketed("(", arguments, ")", _unit(e.unit))))
        case ast.Parenthesis():
            return Bracketed("(", (document(e.inner),), ")", _unit(e.unit))
        case ast.Subscript():
            base = document(e.base)
            if not isinstance(e.base, _SUBSCRIPTABLE):
                base = Bracketed("(", (base,), ")")
            return Unbroken((base, indices(e.indices)))
        case _:
            assert_never(e)


_SUBSCRIPTABLE = (
    ast.Derivative, ast.Previous, ast.Vector, ast.Comprehension, ast.Parenthesis, ast.Call
)  # fmt: skip


def _unit(unit: str) -> str:
    return f" {unit}" if unit else ""


def reference(e: ast.Reference) -> Doc:
    """Return ``a.b[2].c``."""
    return ".".join(p.name + (flat(indices(p.indices)) if p.indices else "") for p in e.parts)


def indices(values: Sequence[ast.Expression]) -> Doc:
    """Return ``[i, j]``."""
    return Bracketed("[", tuple(_index(v) for v in values), "]")


def _index(e: ast.Expression, level: int = _CONDITIONAL) -> str:
    """Return what stands in brackets or in a range: ``i-1`` without blanks."""
    if isinstance(e, ast.Binary) and e.operator in ("+", "-") and not isinstance(e.right, ast.Binary):
        return _index(e.left, _SUM) + e.operator + flat(document(e.right, _PRODUCT))
    return flat(document(e, level))


def _generated(element: ast.Expression, generators: Sequence[ast.Generator]) -> Doc:
    links = []
    for g in generators:
        sign = ", " if g.joined else " for "
        links.append(Link(f"{sign}{g.name} in ", f"{sign.lstrip()}{g.name} in ", document(g.range)))
    return Chain(document(element), tuple(links))


def _conditional(e: ast.Conditional) -> Doc:
    first, *others = e.branches
    links = [
        Link(" elseif ", "elseif ", Unbroken((document(b.condition), " then ", document(b.value))))
        for b in others
    ]
    links.append(Link(" else ", "else ", document(e.otherwise)))
    return Chain(Unbroken(("if ", document(first.condition), " then ", document(first.value))), tuple(links))


def _binary(e: ast.Binary) -> Doc:
    """Return a chain of the operators of one level, leftmost operand first."""
    level = _level(e)
    if level == _POWER:
        return Unbroken((document(e.left, _ATOM), "^", document(e.right, _SIGNED)))
    links: list[Link] = []
    node: ast.Expression = e
    while isinstance(node, ast.Binary) and _level(node) == level:
        right = document(node.right, _SUM if level == _RELATION else level + 1)
        sign = f" {node.operator} "
        if level == _PRODUCT and not _blanks_wanted(node, right):
            sign = node.operator
        links.append(Link(sign, sign.lstrip(), right))
        node = node.left
        if level == _RELATION:
            break
    first = document(node, _SUM if level == _RELATION else level)
    return Chain(first, tuple(reversed(links)))


def _blanks_wanted(product: ast.Binary, right: Doc) -> bool:
    """True where the author put blanks around ``*`` or ``/``, or where ``/`` would join a unit.

    ``5 N / m`` divides by the variable m; ``5 N/m`` is a stiffness.
    """
    left_span, right_span = product.left.span, product.right.span
    if left_span.file is right_span.file and left_span.end < right_span.start:
        between = left_span.file.text[left_span.end : right_span.start]
        if between[0].isspace() and between[-1].isspace() and between.strip() == product.operator:
            return True
    unit = _last_unit(product.left)
    if not unit or product.operator != "/":
        return False
    joined = f"{unit}/{flat(right)}"
    return unit_end(joined) > len(unit)


def _last_unit(e: ast.Expression) -> str:
    """Return the unit with which the text of an expression ends, or nothing."""
    match e:
        case ast.Quantity(unit=unit) | ast.Vector(unit=unit):
            return unit
        case ast.Comprehension(unit=unit) | ast.Parenthesis(unit=unit) | ast.Call(unit=unit):
            return unit
        case ast.Binary(right=operand) | ast.Unary(operand=operand):
            return _last_unit(operand)
        case ast.Conditional(otherwise=operand):
            return _last_unit(operand)
        case _:
            return ""
