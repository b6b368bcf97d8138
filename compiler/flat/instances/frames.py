"""Frames and points: their values, connections and welds, found when first asked for."""

from __future__ import annotations

from fractions import Fraction

from mechc.lang import ast
from mechc.lang.source import Span

from .. import types
from ..model import Apply, Array, Expression, Kind, Literal, Name, Type
from ..names.instance import ElaborationProgress, PlaceMember
from ..names.scope import Poisoned, Scope
from ..subscripts import Index, element_name
from ..values.evaluate import pick
from .declared_types import distributed
from .instantiate import element_scope, extents
from .modifications import cannot_modify, strongest

FRAME_NAMES = ("from", "to")
"""Free frames that a value given by name connects like ``->``; any other is welded."""


def place_extents(member: PlaceMember) -> tuple[int, ...]:
    """Return the sizes of an array of frames or points; empty for a single one."""
    if member.declaration.dimensions and not member.extents:
        member.extents = extents(member.scope, member.declaration.dimensions)
    return member.extents


def is_free(member: PlaceMember) -> bool:
    """Tell whether a frame was declared without a value."""
    return isinstance(member.declaration, ast.Frame) and member.declaration.value is None


def place_type(member: PlaceMember, index: Index) -> Type:
    """Return FRAME, or the type of a point: that of its value."""
    if isinstance(member.declaration, ast.Frame):
        return types.FRAME
    value = place_value(member, index)
    assert value is not None
    return value.type


def place_value(member: PlaceMember, index: Index) -> Expression | None:
    """Return the value of one frame or point; None for a free frame."""
    if index in member.values:
        return member.values[index]
    if member.progress is ElaborationProgress.WRONG:
        raise Poisoned
    if index in member.opening:
        member.progress = ElaborationProgress.WRONG
        raise member.scope.fail(
            "E0207",
            f"'{member.declaration.name}' is defined by itself",
            member.declaration.name_span,
        )
    member.opening.add(index)
    try:
        value = _place(member, index)
    except Poisoned:
        member.progress = ElaborationProgress.WRONG
        raise
    member.values[index] = value
    return value


def _place(member: PlaceMember, index: Index) -> Expression | None:
    declaration, scope = member.declaration, member.scope
    assert isinstance(declaration, ast.Frame | ast.Point)
    if declaration.value is None:
        return _bound_frame(member, index)
    if member.modifiers:
        raise cannot_modify(member, member.modifiers[0], "has a value of its own")
    inner = element_scope(scope, declaration.dimensions, index)
    value = inner.elaborate(declaration.value)
    if (
        index
        and not any(d.name for d in declaration.dimensions)
        and value.type.shape[: len(index)] == member.extents
    ):
        value = pick(value, index)
    return placed_at(inner, value, declaration, declaration.value.span)


def placed_at(scope: Scope, value: Expression, declaration: ast.Declaration, span: Span) -> Expression:
    """Check that a value is a frame, or a point, as declared."""
    kind = value.type.kind
    if isinstance(declaration, ast.Frame):
        if kind is Kind.FRAME and not value.type.shape:
            return value
        raise scope.fail(
            "E0332",
            f"'{declaration.name}' is a frame, the value is {types.describe(value.type)}",
            span,
            caption=f"this is {types.describe(value.type)}",
            help="begin with a frame, as in 'world * trans({x, y}) * rot(angle)'",
        )
    if kind is Kind.POINT and len(value.type.shape) == 1:
        return value
    if kind is Kind.FRAME and not value.type.shape:
        return value_as_point(scope, value, span)
    raise scope.fail(
        "E0332",
        f"'{declaration.name}' is a point, the value is {types.describe(value.type)}",
        span,
        caption=f"this is {types.describe(value.type)}",
        help="write a frame times a vector of lengths, as in 'world * {x, y}'",
    )


def value_as_point(scope: Scope, frame: Expression, span: Span) -> Expression:
    """Return the origin of a frame as a point: the frame times a vector of zeros."""
    size = scope.flattening.space.known(scope, span)
    dimension = types.NUMBER.dimension if scope.flattening.dimensionless else types.LENGTH
    zero = Literal(type=types.real(dimension), span=span, value=Fraction(0))
    offset = Array(type=types.real(dimension, (size,)), span=span, elements=(zero,) * size)
    type = types.make(Kind.POINT, (size,), dimension)
    return Apply(type=type, span=span, function="multiply", arguments=(frame, offset))


def _bound_frame(member: PlaceMember, index: Index) -> Expression | None:
    """Return what a free frame is connected to by ``->`` or by name; None while nothing is."""
    winner = strongest(member.modifiers)
    if winner is None:
        return None
    source, name = winner.source, member.declaration.name
    if winner.kind != "=" or winner.rate or len(winner.path) > 1 or winner.path[0].indices:
        raise source.scope.fail("E0403", f"'{name}' is a frame; write '{name} = frame'", winner.span)
    sizes = place_extents(member)
    value = distributed(source.scope, source.value(), sizes, winner.picks, source.node.span)
    if index and value.type.shape == sizes:
        value = pick(value, index)
    if value.type.kind is not Kind.FRAME or value.type.shape:
        given = types.describe(value.type)
        raise source.scope.fail(
            "E0332",
            f"'{name}' connects to a frame, this is {given}",
            source.node.span,
            caption=f"this is {given}",
            help="name a frame of the component, for example 'bar.a'"
            if value.type.kind is not Kind.POINT
            else _frame_at(source.node),
        )
    if winner.link or name in FRAME_NAMES:
        return value
    member.welds[index] = (value, source.scope.origin(source.node.span))
    return None


def _frame_at(node: ast.Expression) -> str:
    """Say how a frame at a point is written."""
    match node:
        case ast.Binary(operator="*", left=left, right=ast.Parenthesis() | ast.Vector() as right):
            inner = right.inner if isinstance(right, ast.Parenthesis) and not right.unit else right
            return f"write '{left.span.text} * trans({inner.span.text})'"
        case _:
            return "write the frame that carries the point, times 'trans(...)'"


def place_reference(member: PlaceMember, index: Index, span: Span) -> Expression:
    """Return a frame or point by name."""
    return Name(type=place_type(member, index), span=span, name=element_name(member.name, index))


def frame_or_point(scope: Scope, node: ast.Expression, what: str) -> Expression:
    """Return an expression that must be a frame or a point."""
    value = scope.elaborate(node)
    kind, shape = value.type.kind, value.type.shape
    if (kind is Kind.FRAME and not shape) or (kind is Kind.POINT and len(shape) == 1):
        return value
    given = types.describe(value.type)
    help = "write 'world * {x, y}' for a point" if kind in types.NUMERIC and len(shape) == 1 else ""
    if shape and kind in (Kind.FRAME, Kind.POINT):
        help = "give an index"
    raise scope.fail(
        "E0332", f"{what} at a frame or a point", node.span, caption=f"this is {given}", help=help
    )
