"""Whether a model is planar or spatial, seen before anything is elaborated.

The first vector or rotation that belongs to a frame says it; so ``pos(a)`` has a known number of components
even where it stands before that.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from fractions import Fraction
from functools import cache
from typing import get_type_hints

from msgspec import Struct

from mechc.lang import ast
from mechc.lang.source import Span

from .classes import Class
from .namespace import Namespace
from .scope import Flattening

_PLANAR = ("rot", "heading")
_SPATIAL = ("rotx", "roty", "rotz", "axis_angle", "quat")
_COMPONENTS = ("direction", "components")
_FRAMES = ("world", "from", "to")

Hint = tuple[int, Span, str]


class _Names(Struct):
    """Names of a class: its ``frames``, and the ``sizes`` of its vectors whose length is written there."""

    frames: set[str]
    sizes: dict[str, int]


def _names_of(cls: Class) -> _Names:
    names = _Names(set(), {})
    for stated in cls.statements:
        match stated.statement:
            case ast.Frame(name=name):
                names.frames.add(name)
            case ast.Component() | ast.Point():
                pass
            case ast.Declaration(name=name, dimensions=(ast.Dimension(size=ast.Number(value=size)),)):
                names.sizes[name] = int(size)
            case _:
                pass
    return names


def look_ahead(flattening: Flattening, cls: Class) -> None:
    """Set the space of the model from the first place that tells."""
    hint = _of_class(flattening, cls, set())
    if hint is not None:
        flattening.space.size, flattening.space.span, flattening.space.word = hint


def _of_class(flattening: Flattening, cls: Class, seen: set[int]) -> Hint | None:
    if id(cls.model) in seen:
        return None
    seen.add(id(cls.model))
    names = _names_of(cls)
    for stated in cls.statements:
        hint = _of_statement(flattening, stated.statement, stated.namespace, names, seen)
        if hint is not None:
            return hint
    return None


def _of_each(
    flattening: Flattening,
    statements: tuple[ast.Statement, ...],
    namespace: Namespace,
    names: _Names,
    seen: set[int],
) -> Hint | None:
    """Return the first hint of the statements of a block."""
    hints = (_of_statement(flattening, s, namespace, names, seen) for s in statements)
    return next((hint for hint in hints if hint is not None), None)


def _of_statement(
    flattening: Flattening,
    statement: ast.Statement,
    namespace: Namespace,
    names: _Names,
    seen: set[int],
) -> Hint | None:
    match statement:
        case ast.Gravity(value=ast.Vector(elements=items, span=span)) if len(items) in (2, 3):
            return len(items), span, f"a field of {len(items)} components"
        case ast.Coordinate(type="Rotation", span=span):
            return 3, span, "a rotation"
        case ast.Component(type=type, span=span):
            found = namespace.look_up(type, span)
            if found is not None and isinstance(found.definition, ast.Model):
                inner = flattening.classes.of(found.definition, found.namespace)
                return _of_class(flattening, inner, seen)
            return None
        case ast.For(body=body):
            return _of_each(flattening, body, namespace, names, seen)
        case ast.If(branches=branches, otherwise=otherwise):
            inside = (*(s for branch in branches for s in branch.body), *otherwise)
            return _of_each(flattening, inside, namespace, names, seen)
        case (
            ast.Experiment()
            | ast.Study()
            | ast.Import()
            | ast.Function()
            | ast.Type()
            | ast.Extends()
            | ast.Draw()
        ):
            return None
        case _:
            return next((h for e in nodes(statement, ast.Draw) if (h := _of_expression(e, names))), None)


_LEAVES = (str, bool, int, Fraction, Span)


def nodes(node: ast.Node, apart: type[ast.Node] | None = None) -> Iterator[ast.Node]:
    """Yield a node and everything inside it, except for what stands in nodes of the kind ``apart``."""
    pending = [node]
    while pending:
        at = pending.pop()
        if apart is not None and isinstance(at, apart):
            continue
        yield at
        inner: list[ast.Node] = []
        for name in branches_of(at.__class__):
            value = getattr(at, name)
            if isinstance(value, ast.Node):
                inner.append(value)
            elif isinstance(value, tuple):
                inner += [v for v in value if isinstance(v, ast.Node)]
        pending.extend(reversed(inner))


@cache
def branches_of(kind: Hashable) -> tuple[str, ...]:
    """Return the fields of a kind of node in which nodes may stand."""
    assert isinstance(kind, type) and issubclass(kind, ast.Node)
    kinds = get_type_hints(kind)
    return tuple(name for name in kind.__struct_fields__ if kinds[name] not in _LEAVES)


def _of_expression(node: ast.Node, names: _Names) -> Hint | None:
    match node:
        case ast.Call(function=ast.Reference(parts=(ast.Part(name=name),)), arguments=arguments, span=span):
            if name in _PLANAR:
                return 2, span, f"'{name}'"
            if name in _SPATIAL:
                return 3, span, f"'{name}'"
            if name == "trans" and arguments:
                size = _length(arguments[0], names.sizes)
                return (size, span, f"a displacement of {size} components") if size in (2, 3) else None
            if name in _COMPONENTS and len(arguments) == 2:
                size = _length(arguments[1], names.sizes)
                return (size, span, f"a vector of {size} components") if size in (2, 3) else None
        case ast.Binary(operator="*", left=left, right=ast.Vector() | ast.Reference() as right):
            size = _length(right, names.sizes)
            if size in (2, 3) and _begins_with_frame(left, names.frames):
                return size, right.span, f"a vector of {size} components"
        case _:
            pass
    return None


def _length(node: ast.Expression, sizes: Mapping[str, int]) -> int:
    """Return how many components a vector or a multiple of one has; 0 where that is not to be seen."""
    match node:
        case ast.Vector(elements=items):
            return len(items)
        case ast.Reference(parts=(ast.Part(name=name, indices=()),)):
            return sizes.get(name, 0)
        case ast.Unary(operand=inner) | ast.Binary(operator="/", left=inner):
            return _length(inner, sizes)
        case ast.Binary(operator="*", left=left, right=right):
            return _length(right, sizes) or _length(left, sizes)
        case _:
            return 0


def _begins_with_frame(node: ast.Expression, frames: set[str]) -> bool:
    while isinstance(node, ast.Binary) and node.operator == "*":
        node = node.left
    if isinstance(node, ast.Reference):
        return node.parts[0].name in _FRAMES or node.parts[0].name in frames
    return False
