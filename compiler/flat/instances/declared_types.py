"""Declared types, and fitting a value to one: units, shapes, broadcasting, distribution over arrays."""

from __future__ import annotations

import re
from fractions import Fraction

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.source import Span
from mechc.lang.units import NAMED_TYPES, UnitError, parse_unit, preferred_unit
from mechc.suggest import closest

from .. import types
from ..model import Array, Expression, Kind, Literal, Type
from ..names.instance import Pick
from ..names.scope import Poisoned, Scope
from ..operands import free_names
from ..values.angles import warn_of_bare_angle, warn_of_hertz
from ..values.evaluate import pick

PLAIN_TYPES = {
    "Real": types.NUMBER,
    "Integer": types.INTEGER,
    "Boolean": types.BOOLEAN,
    "String": types.STRING,
    "Rotation": types.ROTATION,
    "Angle": types.ANGLE,
}


def declared_type(scope: Scope, name: str, span: Span) -> Type:
    """Return the scalar type that a type name stands for."""
    plain = PLAIN_TYPES.get(name)
    if plain is not None:
        return plain
    named = NAMED_TYPES.get(name)
    if named is not None:
        if scope.flattening.dimensionless:
            return types.NUMBER
        return types.real(named.dimension, angle=named.angle)
    found = scope.namespace.look_up(name, span)
    if found is not None and isinstance(found.definition, ast.Type):
        if scope.flattening.dimensionless:
            return types.NUMBER
        unit = parse_unit(found.definition.unit)
        return types.real(unit.dimension, angle=unit.angle)
    if scope.namespace.broken:
        raise Poisoned
    near = closest(name, [*NAMED_TYPES, *PLAIN_TYPES, *scope.namespace.names()])
    raise scope.fail(
        "E0203",
        f"there is no type '{name}'",
        span,
        help=f"did you mean '{near}'?" if near else f"define it, as in 'type {name} = unit \"kg/m\";'",
    )


def fits(expression: Expression, target: Type) -> bool:
    """Tell whether an expression has a type that ``fit`` accepts, shapes aside."""
    kind, wanted = expression.type.kind, target.kind
    if wanted is Kind.REAL:
        if kind not in types.NUMERIC:
            return False
        return expression.type.dimension == target.dimension or types.is_zero(expression)
    if wanted is Kind.INTEGER:
        whole = isinstance(expression, Literal) and isinstance(expression.value, Fraction)
        return kind is Kind.INTEGER or (
            whole and expression.type.dimension.is_none and expression.value.denominator == 1  # type: ignore[union-attr]
        )
    if wanted is Kind.ROTATION:
        return kind in (Kind.ROTATION, Kind.POSE)
    return kind is wanted


ROTATIONS = (
    "write a product of rotations, as in 'rotz(30 deg)*rotx(10 deg)', or a quaternion, 'quat(w, x, y, z)'"
)


def fit(
    scope: Scope,
    expression: Expression,
    target: Type,
    span: Span,
    *,
    code: str = "E0303",
    name: str = "",
    declared: Span | None = None,
) -> Expression:
    """Return a value as one of type ``target``: a zero gets its unit, a scalar fills an array.

    Reports, with the place of the declaration, what does not fit.
    """
    if expression.type is target:
        return expression
    if not fits(expression, target):
        what = f"'{name}'" if name else "this place"
        unit = written_unit(declared, target)
        wanted = types.describe(target if expression.type.shape else types.with_shape(target, ()), unit)
        given = types.describe(
            types.numeric(expression.type) if target.kind is Kind.REAL else expression.type
        )
        if given == wanted:
            given += f", in {expression.type.dimension}"
        labels = (Label(declared, f"{what} is {wanted}"),) if declared is not None else ()
        raise scope.fail(
            code,
            f"{what} is {wanted}, the value is {given}",
            span,
            caption=f"this is {given}",
            labels=labels,
            help=ROTATIONS
            if target.kind is Kind.ROTATION
            else unit_help(expression, target, span, unit, declared),
        )
    if target.angle and target.dimension.is_none and not scope.flattening.dimensionless:
        warn_of_bare_angle(expression, scope.flattening, declared)
    elif target.angle and not expression.type.angle and not scope.flattening.dimensionless:
        warn_of_hertz(expression, target, scope.flattening, declared)
    if target.kind is Kind.REAL and expression.type.dimension != target.dimension:
        expression = types.retyped_zero(expression, target.dimension, target.angle)
    return broadcast(scope, expression, target, span, name, declared)


def broadcast(
    scope: Scope, expression: Expression, target: Type, span: Span, name: str, declared: Span | None
) -> Expression:
    """Return a value in the shape of ``target``; a scalar fills it."""
    shape = target.shape
    if expression.type.shape == shape:
        return expression
    if not expression.type.shape:
        return filled(expression, shape, span)
    what = f"'{name}'" if name else "this place"
    labels = (Label(declared, f"{what} is declared here"),) if declared is not None else ()
    raise scope.fail(
        "E0305",
        f"{what} has {shape_words(shape)}, the value has {shape_words(expression.type.shape)}",
        span,
        caption=f"this is {types.describe(expression.type)}",
        labels=labels,
        help=f"declare it as '{name}{types.shape_text(expression.type.shape)}'"
        if not shape and name
        else _shape_help(expression, target, span),
    )


def _shape_help(value: Expression, target: Type, span: Span) -> str:
    """Say how a value of another shape is given: no square matrix is meant whose entries are all one number."""
    shape = target.shape
    if not _is_square(target):
        return f"give it {shape_words(shape)}, or one value for all of them"
    diagonal = (
        f", or write 'diag({span.text})' for a diagonal matrix" if value.type.shape == shape[:1] else ""
    )
    return f"give it {shape_words(shape)}{diagonal}"


def _is_square(type: Type) -> bool:
    shape = type.shape
    return len(shape) == 2 and shape[0] == shape[1] > 1 and type.kind in types.NUMERIC


def refuse_one_number(scope: Scope, value: Expression, target: Type, span: Span, declared: Span) -> None:
    """Refuse a parameter that is a square matrix whose entries would all be one number: that is singular, and never meant."""
    shape = target.shape
    if not _is_square(target) or value.type.shape or (isinstance(value, Literal) and value.value == 0):
        return
    scope.report(
        "E0305",
        f"'{declared.text}' is a {shape[0]} x {shape[0]} matrix, the value is one number",
        span,
        caption="all entries would be this",
        labels=(Label(declared, f"'{declared.text}' is declared here"),),
        help=f"write 'identity({shape[0]})*({span.text})' for a multiple of the unit matrix",
    )


def filled(expression: Expression, shape: tuple[int, ...], span: Span) -> Expression:
    """Return an array of ``shape`` all of whose elements are ``expression``."""
    result = expression
    for count in reversed(shape):
        inner = result.type
        type = types.make(inner.kind, (count, *inner.shape), inner.dimension, inner.angle)
        result = Array(type=type, span=span, elements=(result,) * count)
    return result


def shape_words(shape: tuple[int, ...]) -> str:
    """Return ``one value``, ``3 elements``, ``2 x 3 elements``."""
    if not shape:
        return "one value"
    if len(shape) == 1:
        return f"{shape[0]} element{'s' if shape[0] != 1 else ''}"
    return f"{' x '.join(map(str, shape))} elements"


def written_unit(declared: Span | None, target: Type) -> str:
    """Return the unit of a quantity in the words of its declaration: of its type, or of a number there; N.m, where the dimension alone says J.

    A name stands after its type, or the place of an argument is that of both.
    """
    if declared is None or target.kind is not Kind.REAL or target.dimension.is_none:
        return ""
    text = declared.file.text
    before = text[: declared.start].split() or [""]
    for word in (before[-1], declared.text.partition(" ")[0]):
        named = NAMED_TYPES.get(word)
        if named is not None and (named.dimension, named.angle) == (target.dimension, target.angle):
            return named.unit
    rest = text[declared.end :].partition(";")[0]
    units: list[str] = re.findall(r"[\d.}\])] ([A-Za-z][\w./^*()-]*)", rest)
    for unit in units:
        try:
            read = parse_unit(unit)
        except UnitError:
            continue
        if read.factor == 1 and (read.dimension, read.angle) == (target.dimension, target.angle):
            return unit
    return ""


def unit_help(
    expression: Expression, target: Type, span: Span, unit: str = "", declared: Span | None = None
) -> str:
    """Say which unit a bare number lacks."""
    if declared is not None and declared.file.text[: declared.start].rstrip().endswith("Real"):
        return "'Real' is a number without a unit: leave the type out, and the value tells it"
    if target.kind is Kind.INTEGER and expression.type.dimension.is_none and free_names(expression):
        return "what counts is known when compiling: 'structural parameter Integer n = 3;'"
    if target.kind is not Kind.REAL or target.dimension.is_none:
        return ""
    if _bare(expression) and (not expression.type.shape or span.text.startswith("{")):
        return f"write '{span.text} {unit or preferred_unit(target.dimension, target.angle)}'"
    factor = target.dimension / expression.type.dimension
    if expression.type.kind is not Kind.REAL or factor.is_none:
        return ""
    if all(e <= 0 for e in factor.exponents):
        return f"one factor of [{expression.type.dimension / target.dimension}] is too many"
    return f"one factor of [{factor}] is missing"


def _bare(expression: Expression) -> bool:
    """Tell numbers that are written without a unit."""
    if isinstance(expression, Array):
        return all(_bare(e) for e in expression.elements)
    return isinstance(expression, Literal) and expression.type.dimension.is_none and not expression.type.angle


def distributed(
    scope: Scope, expression: Expression, shape: tuple[int, ...], picks: tuple[Pick, ...], span: Span
) -> Expression:
    """Return the part of a modification's value that one element of an array of components gets.

    A value of the declared shape goes to every element; one whose shape begins with the dimensions of the
    array is distributed (by its shape alone).
    """
    given = expression.type.shape
    if not given or given == shape or not picks:
        return expression
    choices = [picks, *((p,) for p in reversed(picks))]
    for chosen in choices:
        sizes = tuple(n for p in chosen for n in p.extents)
        if given == sizes + shape:
            return pick(expression, tuple(i for p in chosen for i in p.index))
    sizes = tuple(n for p in picks for n in p.extents)
    raise scope.fail(
        "E0404",
        f"a value with {shape_words(given)} neither fits one component nor the whole array",
        span,
        caption=f"this has the shape {types.shape_text(given)}",
        help=f"one value has the shape {types.shape_text(shape) if shape else 'of a scalar'}, "
        f"one for each component {types.shape_text(sizes + shape)}",
    )
