"""Elements of arrays by indices, which count from 1 and are known when compiling; and arrays of elements."""

from __future__ import annotations

from math import prod

from mechc.lang import ast
from mechc.lang.source import Span

from .. import types
from ..model import Array, Expression, Kind
from ..names.scope import Scope
from .evaluate import pick, range_values, whole_number


def dimension_words(count: int) -> str:
    """Return ``no index``, ``1 index``, ``2 indices``."""
    return {0: "no index", 1: "1 index"}.get(count, f"{count} indices")


def stack(values: list[Expression], sizes: tuple[int, ...], span: Span) -> Expression:
    """Return an array of shape ``sizes`` from values of one type in row-major order."""
    for depth in reversed(range(len(sizes))):
        count = sizes[depth]
        inner = values[0].type if values else types.NUMBER
        type = types.make(inner.kind, (count, *inner.shape), inner.dimension, inner.angle)
        values = [
            Array(type=type, span=span, elements=tuple(values[k * count : (k + 1) * count]))
            for k in range(prod(sizes[:depth]))
        ]
    return values[0]


def indexed(scope: Scope, value: Expression, nodes: tuple[ast.Expression, ...], span: Span) -> Expression:
    """Return ``value[i, a:b]``. Indices are counted from 1 and known when compiling."""
    if not nodes:
        return value
    shape = (4,) if value.type.kind is Kind.ROTATION else value.type.shape
    if len(nodes) > len(shape):
        raise scope.fail(
            "E0316",
            f"{types.describe(value.type)} cannot have {len(nodes)} {'indices' if len(nodes) > 1 else 'index'}",
            span,
            caption="it has no elements" if not shape else f"it has {dimension_words(len(shape))}",
        )
    chosen = [positions(scope, node, size, span) for node, size in zip(nodes, shape, strict=False)]
    return _choose(value, chosen, span)


def _choose(value: Expression, chosen: list[int | list[int]], span: Span) -> Expression:
    """Take single positions as far as there are any, then each of a range by itself."""
    fixed = []
    for position in chosen:
        if not isinstance(position, int):
            break
        fixed.append(position)
    if fixed:
        value = pick(value, tuple(fixed))
    rest = chosen[len(fixed) :]
    if not rest:
        return value
    several = rest[0]
    assert isinstance(several, list)
    items = [_choose(pick(value, (i,)), rest[1:], span) for i in several]
    return stack(items, (len(items),), span)


def positions(scope: Scope, node: ast.Expression, size: int, of: Span) -> int | list[int]:
    """Return one position, or those of a range, counted from 0 and checked against the size of what is indexed."""
    if isinstance(node, ast.Whole):
        return list(range(size))
    if isinstance(node, ast.Range):
        several = [i - 1 for i in range_values(scope, node)]
        for i in several:
            _check_bounds(scope, i, size, of, node.span)
        return several
    position = whole_number(scope, node, "an index") - 1
    _check_bounds(scope, position, size, of, node.span)
    return position


def _check_bounds(scope: Scope, position: int, size: int, of: Span, span: Span) -> None:
    if not 0 <= position < size:
        name = of.text.partition("[")[0]
        raise scope.fail(
            "E0314",
            f"index {position + 1} is outside 1:{size}" if size else f"'{name}' has no elements",
            span,
            caption=f"'{name}' has {size} element{'s' if size != 1 else ''}",
            help=f"the first one is '{name}[1]', the last one '{name}[{size}]'" if size else "",
        )
