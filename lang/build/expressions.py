"""Actions of the grammar that build expressions, where these are more than named children (``rules.py``)."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from .. import ast
from ..grammar.lexer import Token
from ..source import Span
from .builder import Builder, Children, items_of, value_of


def _subscripted(base: ast.Expression, indices: list[Any] | None, span: Span) -> ast.Expression:
    return base if indices is None else ast.Subscript(base=base, indices=tuple(indices), span=span)


def _up_to(span: Span, last: Token) -> Span:
    return Span(span.file, span.start, last.end)


def conditional(b: Builder, c: Children, span: Span) -> ast.Conditional:
    first = ast.Branch(condition=c[1], value=c[3], span=c[1].span.to(c[3].span))
    return ast.Conditional(branches=(first, *c[4]), otherwise=c[6], span=span)


def binary(b: Builder, c: Children, span: Span) -> ast.Binary:
    return ast.Binary(operator=c[1].text, left=c[0], right=c[2], span=span)


def quotient(b: Builder, c: Children, span: Span) -> ast.Binary:
    """Refuse numbers alone over a quantity: readers take the unit for that of the whole."""
    left, _, right = c
    divisor = _unsigned(right)
    exact = _number(left) if isinstance(divisor, ast.Quantity) else None
    if exact is not None and isinstance(divisor, ast.Quantity):
        above, unit = left.span.text, divisor.unit
        below = right.span.text[: -len(unit)].rstrip()
        value = exact / divisor.value if divisor.value else Fraction(0)
        value = -value if right.span.text.count("-", 0, divisor.span.start - right.span.start) % 2 else value
        decimal = f"{float(value):g}" if divisor.value else ""
        simple = decimal and Fraction(decimal) == value
        number = f"({above}/{below}) {unit}"
        b.reporter.error(
            "E0114",
            f"'{above}/{below} {unit}' would divide {above} by {below} {unit}",
            span,
            caption="the unit belongs to the divisor alone",
            help=(f"write '{decimal} {unit}' or '{number}'" if simple else f"write '{number}'")
            + f"; if you mean the inverse: '{above}/({below} {unit})'",
        )
    return ast.Binary(operator="/", left=left, right=right, span=span)


def _unsigned(e: ast.Expression) -> ast.Expression:
    """Return what follows signs."""
    while isinstance(e, ast.Unary):
        e = e.operand
    return e


def _number(e: ast.Expression) -> Fraction | None:
    """Return the value of numbers with signs, products and quotients; None for anything else, as for what stands in parentheses.

    Long chains lean to the left, and are followed without recursion."""
    value = Fraction(1)
    while True:
        match e:
            case ast.Number():
                return value * e.value
            case ast.Unary(operator="-" | "+", operand=inner):
                value, e = -value if e.operator == "-" else value, inner
            case ast.Binary(operator="*" | "/", left=left, right=right):
                factor = _number(right)
                if factor is None or (e.operator == "/" and not factor):
                    return None
                value, e = value * factor if e.operator == "*" else value / factor, left
            case _:
                return None


def reference(b: Builder, c: Children, span: Span) -> ast.Reference:
    return ast.Reference(parts=tuple(c[0]), span=span)


def part(b: Builder, c: Children, span: Span) -> ast.Part:
    return ast.Part(name=c[0].text, indices=items_of(c[1]), span=span)


def power(b: Builder, c: Children, span: Span) -> ast.Binary:
    base, sign, exponent = c
    if isinstance(base, ast.Quantity) or (isinstance(base, ast.Parenthesis | ast.Vector) and base.unit):
        b.reporter.error(
            "E0128",
            "a power after a unit could belong to the number or to the unit",
            b.span(sign),
            help=f"write '({base.span.text})^{exponent.span.text}' for the power of the whole quantity",
        )
    return ast.Binary(operator="^", left=base, right=exponent, span=span)


def number(b: Builder, c: Children, span: Span) -> ast.Number:
    text = c[0].text
    return ast.Number(value=value_of(b, text, span), text=text, span=span)


def quantity(b: Builder, c: Children, span: Span) -> ast.Quantity:
    text, unit = c[0].text.split()
    return ast.Quantity(value=value_of(b, text, span), unit=unit, text=text, span=span)


def derivative(b: Builder, c: Children, span: Span) -> ast.Expression:
    _, _, operand, order, closing, indices = c
    base = ast.Derivative(operand=operand, order=order or 1, span=_up_to(span, closing))
    return _subscripted(base, indices, span)


def order(b: Builder, c: Children, span: Span) -> int:
    text = c[1].text
    if not text.isdigit() or not 1 <= int(text) <= 9:
        message = "the order of a derivative is a whole number from 1 to 9"
        b.reporter.error("E0110", message, b.span(c[1]), help="write 'der(x, 2)' for the second derivative")
        return 1
    return int(text)


def previous(b: Builder, c: Children, span: Span) -> ast.Expression:
    base = ast.Previous(operand=c[2], span=_up_to(span, c[3]))
    return _subscripted(base, c[4], span)


def vector(b: Builder, c: Children, span: Span) -> ast.Expression:
    _, elements, closing, unit, indices = c
    base = ast.Vector(
        elements=tuple(elements), unit=unit.text if unit else "", span=_up_to(span, unit or closing)
    )
    return _subscripted(base, indices, span)


def comprehension(b: Builder, c: Children, span: Span) -> ast.Expression:
    _, element, generators, closing, unit, indices = c
    base = ast.Comprehension(
        element=element,
        generators=tuple(generators),
        unit=unit.text if unit else "",
        span=_up_to(span, unit or closing),
    )
    return _subscripted(base, indices, span)


def parenthesis(b: Builder, c: Children, span: Span) -> ast.Expression:
    _, inner, closing, unit, indices = c
    base = ast.Parenthesis(inner=inner, unit=unit.text if unit else "", span=_up_to(span, unit or closing))
    return _subscripted(base, indices, span)


def call(b: Builder, c: Children, span: Span) -> ast.Expression:
    function, _, arguments, closing, unit, indices = c
    positional, named = [], []
    for argument in arguments or ():
        if isinstance(argument, ast.Keyword):
            named.append(argument)
            continue
        if named:
            message = "an argument without a name follows a named one"
            b.reporter.error("E0110", message, argument.span, help="put the named arguments last")
        positional.append(argument)
    base = ast.Call(
        function=function,
        arguments=tuple(positional),
        keywords=tuple(named),
        unit=unit.text if unit else "",
        span=_up_to(span, unit or closing),
    )
    return _subscripted(base, indices, span)


def aggregated(b: Builder, c: Children, span: Span) -> ast.Expression:
    function, _, element, loops, closing, unit, indices = c
    inner = ast.Aggregate(element=element, generators=tuple(loops), span=element.span.to(loops[-1].span))
    base = ast.Call(
        function=function,
        arguments=(inner,),
        unit=unit.text if unit else "",
        span=_up_to(span, unit or closing),
    )
    return _subscripted(base, indices, span)


def generator(b: Builder, c: Children, span: Span) -> ast.Generator:
    return ast.Generator(name=c[1].text, range=c[3], joined=c[0].kind == "COMMA", span=span)
