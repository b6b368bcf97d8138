"""Angles in the field: linear in symbols, opaque below anything else."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from .field import Angle, circle, constant_angle, opaque_angle, symbol_angle
from .operations import ADD, CONST, MUL, NEG, SUB, SYMBOL

if TYPE_CHECKING:
    from .dependence import Node
    from .interning import NodeStore


def point_of(store: NodeStore, n: Node) -> tuple[int, int]:
    """Return (cosine, sine) of an angle in the field."""
    point = store._points.get(n)
    if point is None:
        exponent = angle_of(store, n).exponent()
        if exponent is None:
            exponent = opaque_angle(store._values[n], store.seed).exponent()
            assert exponent is not None
        store._points[n] = point = circle(exponent)
    return point


def angle_of(store: NodeStore, n: Node) -> Angle:
    """Return the angle that a node stands for: linear in symbols, opaque below anything else."""
    angles, code, left, right = store._angles, store._code, store._left, store._right
    stack = [n]
    while stack:
        k = stack[-1]
        if k in angles:
            stack.pop()
            continue
        c, a, b = code[k], left[k], right[k]
        if c == CONST:
            angles[k] = constant_angle(store._constants[k], store.seed)
        elif c == SYMBOL:
            angles[k] = symbol_angle(store._names[k], store.seed)
        elif c in (ADD, SUB):
            if a in angles and b in angles:
                angles[k] = angles[a] + angles[b] if c == ADD else angles[a] - angles[b]
            else:
                stack += (a, b)
        elif c == NEG or (c == MUL and CONST in (code[a], code[b])):
            if c == MUL and code[a] != CONST:
                a, b = b, a
            factor, inner = (Fraction(-1), a) if c == NEG else (store._constants[a], b)
            if inner in angles:
                scaled = angles[inner].scaled(factor)
                angles[k] = opaque_angle(store._values[k], store.seed) if scaled.is_lost else scaled
            else:
                stack.append(inner)
        else:
            angles[k] = opaque_angle(store._values[k], store.seed)
    return angles[n]
