"""Warnings about angles without unit: degrees that are forgotten are radians, silently."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction

from mechc.lang import ast
from mechc.lang.diagnostics import Label, Reporter
from mechc.lang.source import Span
from mechc.lang.units import Unit, may_count_turns, parse_unit

from ..model import Apply, Array, Element, Expression, Literal, Name, Type
from ..names.scope import Flattening

_OF_ANGLES = ("sin", "cos", "tan", "rot", "rotx", "roty", "rotz")
_UNTYPED = ("", "Real")
_QUANTITY = re.compile(r"-?\s*[\d.]+(?:[eE][-+]?\d+)?\s+(?P<unit>[^\s\d]\S*)")
"""A number with its unit as written."""
_TURN = 2 * math.pi
"""Bare numbers above this are hardly radians, in a formula that takes any number."""
_WRITTEN = re.compile(r"-?\s*[\d.]+([eE][-+]?\d+)?")
"""A number as written; ``pi/6`` is one as well once it is evaluated, and means radians."""


def warn_of_bare_angle(expression: Expression, flattening: Flattening, declared: Span | None) -> None:
    """Warn where a number without unit is given for what is declared as an angle, also by a name that has it."""
    labels = (Label(declared, "this is an angle"),) if declared is not None else ()
    match expression:
        case Array(elements=inner) | Apply(function="negate", arguments=inner):
            for element in inner:
                warn_of_bare_angle(element, flattening, declared)
        case Literal(value=Fraction() as value) if value and _WRITTEN.fullmatch(expression.span.text):
            _warn(expression.span, value, flattening.reporter, labels)
        case Name(name=name) | Element(base=Name(name=name)):
            for number in _bare_numbers(_stated(name, flattening)):
                _warn(number.span, number.value, flattening.reporter, labels)
        case _:
            pass


def warn_of_hertz(
    expression: Expression, target: Type, flattening: Flattening, declared: Span | None
) -> None:
    """Warn where hertz, or something per minute, is given for the rate of an angle."""
    labels = (Label(declared, "this is a rate of an angle"),) if declared is not None else ()
    match expression:
        case Array(elements=inner) | Apply(function="negate", arguments=inner):
            for element in inner:
                warn_of_hertz(element, target, flattening, declared)
        case Literal() if written := _QUANTITY.fullmatch(expression.span.text):
            unit = parse_unit(written["unit"])
            if may_count_turns(unit, Unit("", target.dimension, Fraction(1), angle=True)):
                what = f"a rate of an angle is given in {unit.symbol}"
                hertz_for_angles(expression.span, what, flattening.reporter, labels)
        case _:
            pass


def hertz_for_angles(span: Span, what: str, reporter: Reporter, labels: tuple[Label, ...] = ()) -> None:
    """Warn that a unit counts no turns, once for each place."""
    if any(d.code == "W0301" and d.span == span for d in reporter.diagnostics):
        return
    number, _, symbol = span.text.rpartition(" ")
    unit = parse_unit(symbol)
    per = f"{float(unit.factor):.5g} rad/s" if unit.factor != 1 else "1/s"
    turn = "2 pi rad/s" if unit.factor == 1 else "2 pi times that"
    reporter.warning(
        "W0301",
        f"{what}, and 1 {symbol} is {per}, not {turn}",
        span,
        labels=labels,
        help=f"write '2*pi*{number} {symbol}', or 'rev/s' or 'rpm' for turns",
    )


def _stated(name: str, flattening: Flattening) -> ast.Expression | None:
    """Return what is written for a parameter or abbreviation of no declared dimension: in its declaration or outside."""
    definition = flattening.definitions.get(name)
    if definition is not None:
        declaration = definition.declaration
        return (
            declaration.value if isinstance(declaration, ast.Let) and declaration.type in _UNTYPED else None
        )
    member = flattening.variables.get(name)
    if (
        member is None
        or not isinstance(member.declaration, ast.Parameter)
        or member.declaration.type not in _UNTYPED
    ):
        return None
    if member.modifiers:
        return max(member.modifiers, key=lambda m: m.rank).source.node
    return member.declaration.value


def _bare_numbers(node: ast.Expression | None) -> Iterator[ast.Number]:
    match node:
        case ast.Number(value=value) if value:
            yield node
        case ast.Unary(operand=inner) | ast.Parenthesis(inner=inner, unit=""):
            yield from _bare_numbers(inner)
        case ast.Vector(elements=elements, unit=""):
            for element in elements:
                yield from _bare_numbers(element)
        case _:
            pass


def warn_of_degrees(
    calls: Iterable[ast.Call], declarations: Mapping[str, ast.Declaration], reporter: Reporter
) -> None:
    """Warn of arguments of sines and rotations that look like degrees: ``sin(30)``, ``cos(phi)`` with ``phi = 60``."""
    for call in calls:
        if call.function.name not in _OF_ANGLES:
            continue
        for term in (t for argument in call.arguments for t in _terms(argument)):
            match term:
                case ast.Number(value=value) if value > _TURN:
                    _warn(term.span, value, reporter, ())
                case ast.Reference(parts=(ast.Part(name=name, indices=()),)) if name in declarations:
                    given = _bare_start(declarations[name])
                    if given is not None and given.value > _TURN:
                        _warn(given.span, given.value, reporter, ())
                case _:
                    pass


def warn_of_bare_side(left: Expression, right: Expression, flattening: Flattening) -> None:
    """Warn where an angle meets a bare number beyond a full turn in a sum or a comparison: ``120 - d.angle``."""
    angle, number = (left, right) if left.type.angle else (right, left)
    if number.type.angle or not number.type.dimension.is_none:
        return
    labels = (Label(angle.span, "this is an angle"),) if angle.span.file is number.span.file else ()
    match number:
        case Literal(value=Fraction() as value) if abs(value) > _TURN and _WRITTEN.fullmatch(
            number.span.text
        ):
            _warn(number.span, value, flattening.reporter, labels)
        case Name(name=name) | Element(base=Name(name=name)):
            for bare in _bare_numbers(_stated(name, flattening)):
                if abs(bare.value) > _TURN:
                    _warn(bare.span, bare.value, flattening.reporter, labels)
        case _:
            pass


def _terms(expression: ast.Expression) -> Iterator[ast.Expression]:
    """Yield what is added and subtracted in an expression."""
    match expression:
        case ast.Binary(operator="+" | "-", left=left, right=right):
            yield from _terms(left)
            yield from _terms(right)
        case ast.Unary(operand=inner) | ast.Parenthesis(inner=inner, unit=""):
            yield from _terms(inner)
        case _:
            yield expression


def _bare_start(declaration: ast.Declaration) -> ast.Number | None:
    """Return the number without unit that a parameter or coordinate of no declared dimension has, its sign aside."""
    match declaration:
        case ast.Parameter(type=type, value=value) if type in _UNTYPED:
            pass
        case ast.Coordinate(type=type, start=ast.Start(value=value)) if type in _UNTYPED:
            pass
        case _:
            return None
    if isinstance(value, ast.Unary):
        value = value.operand
    return value if isinstance(value, ast.Number) else None


def _warn(span: Span, value: Fraction, reporter: Reporter, labels: tuple[Label, ...]) -> None:
    if any(d.code == "W0303" and d.span == span for d in reporter.diagnostics):
        return  # one number that several angles get
    number = span.text
    reporter.warning(
        "W0303",
        f"the angle {number} has no unit, so it is {number} rad",
        span,
        caption=f"this is {math.degrees(value):.5g} deg",
        labels=labels,
        help=f"write '{number} deg' or '{number} rad'",
    )
