"""Expressions: the constructors of the graph, each with its local rules.

Sines and cosines of equal angles are found equal in the field (field.py), where an angle is linear in symbols, and opaque
below anything else.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Final

from . import operations as ops
from .arithmetic import Arithmetic, DivisionByZero
from .dependence import Node
from .field import Angle, circle, constant_angle, hashed, opaque_angle, symbol_angle
from .interning import NONE
from .operation import Operation, Parity
from .operations import ADD, CONST, COS, MUL, NEG, OPERATIONS, SELECT, SIN, SQRT, SUB, SYMBOL
from .table import CELL, ELEMENT

if TYPE_CHECKING:
    from .dependence import Node
    from .interning import NodeStore


__all__ = ["DivisionByZero", "Graph", "Node"]

_CHAIN_LIMIT: Final = 64
"""Larger exponents go to the power function of the target."""


def _function_of(code: int) -> Callable[[Graph, Node], Node]:
    """Return the constructor of a function of one argument."""

    def constructor(self: Graph, a: Node) -> Node:
        return self._function(code, a)

    return constructor


class Graph(Arithmetic):
    """Build and read expressions (reading: interning.py)."""

    __slots__ = ()

    def power(self, x: Node, exponent: Fraction | int) -> Node:
        """Return x to a constant power: multiplications and roots where they do, else ``pow``."""
        exponent = Fraction(exponent)
        if exponent.denominator > 2 or abs(exponent.numerator) > _CHAIN_LIMIT:
            return self._opaque(ops.POW, x, self.constant(exponent))
        if exponent < 0:
            return self.div(self.one, self.power(x, -exponent))
        whole, root = divmod(exponent, 1)
        result = self.sqrt(x) if root else self.one
        if whole:
            chain = x
            for bit in bin(whole)[3:]:
                chain = self.mul(chain, chain)
                if bit == "1":
                    chain = self.mul(chain, x)
            result = self.mul(chain, result)
        return result

    # ------------------------------------------------------------------ functions

    def apply(self, code: int, *arguments: Node) -> Node:
        """Return an operation of the table on its arguments."""
        return _CONSTRUCTORS[code](self, *arguments)

    def _opaque(
        self, code: int, a: Node, b: Node = NONE, c: Node = NONE, extra: tuple[int, ...] = ()
    ) -> Node:
        """Return a node whose value is a hash of the operation and the values of its arguments."""
        key = (code, a, b, c, extra)
        n = self._cache.get(key)
        if n is None:
            if self.by_value:
                values = [self._values[x] for x in (a, b, c) if x >= 0]
                n = self._intern(code, a, b, hashed(OPERATIONS[code].name, values, extra, self.seed))
            else:
                n = self._new(code, a, b, 0)
            self._cache[key] = n
            if c >= 0:
                # a choice that was there keeps its own last argument: this one may be newer than the choice
                self._traits[n] |= self._traits[self._third.setdefault(n, c)]
        return n

    def _function(self, code: int, a: Node) -> Node:
        """Apply a unary function: exact results, parity, then interning."""
        parity = OPERATIONS[code].parity
        if self._code[a] == CONST:
            folded = (exact := OPERATIONS[code].exact) and exact(self._constants[a])
            if folded is not None:
                return self.constant(folded)
        if parity is not Parity.NONE and self._is_negative(a):
            positive = self._function(code, self.neg(a))
            return positive if parity is Parity.EVEN else self.neg(positive)
        if not self.by_value:
            return self._structural(code, a)
        if code in (SIN, COS):
            key = (code, a)
            n = self._cache.get(key)
            if n is None:
                cosine, sine = point_of(self, a)
                self._cache[key] = n = self._intern(code, a, NONE, sine if code == SIN else cosine)
            return n
        return self._opaque(code, a)

    def unsigned(self, a: Node) -> Node:
        """Return what a node is the negative of, or the node: odd functions of negative arguments are negatives."""
        return self._left[a] if self._code[a] == NEG else a

    def _is_negative(self, a: Node) -> bool:
        code = self._code[a]
        return code == NEG or (code == CONST and self._constants[a] < 0)

    sin = _function_of(SIN)
    cos = _function_of(COS)
    tan = _function_of(ops.TAN)
    asin = _function_of(ops.ASIN)
    acos = _function_of(ops.ACOS)
    atan = _function_of(ops.ATAN)
    sinh = _function_of(ops.SINH)
    cosh = _function_of(ops.COSH)
    tanh = _function_of(ops.TANH)
    asinh = _function_of(ops.ASINH)
    acosh = _function_of(ops.ACOSH)
    atanh = _function_of(ops.ATANH)
    exp = _function_of(ops.EXP)
    log = _function_of(ops.LOG)
    abs = _function_of(ops.ABS)
    sign = _function_of(ops.SIGN)
    floor = _function_of(ops.FLOOR)

    def sqrt(self, a: Node) -> Node:
        if self._code[a] == MUL and self._left[a] == self._right[a]:
            return self.abs(self._left[a])
        return self._function(SQRT, a)

    def atan2(self, y: Node, x: Node) -> Node:
        return self._binary(ops.ATAN2, y, x)

    def normal(self, seed: Node, k: Node) -> Node:
        return self._binary(ops.NORMAL, seed, k)

    def minimum(self, a: Node, b: Node) -> Node:
        return a if a == b else self._binary(ops.MINIMUM, min(a, b), max(a, b))

    def maximum(self, a: Node, b: Node) -> Node:
        return a if a == b else self._binary(ops.MAXIMUM, min(a, b), max(a, b))

    def derived(self, value: Node, formula: Node) -> Node:
        """Return what has the value of one node and the derivatives of a formula, whose value is the same but for rounding: of a step of
        Newton's method from ``derived(value, 0)``, a value that counts as constant there."""
        return value if value == formula else self._binary(ops.DERIVED, value, formula)

    def modulo(self, a: Node, b: Node) -> Node:
        """Return a - b floor(a/b). Raises DivisionByZero where b is identically zero."""
        if b == 0:
            raise DivisionByZero(a)
        return self._binary(ops.MODULO, a, b)

    def pow(self, a: Node, b: Node) -> Node:
        """Return a to the power b, a real exponent; NaN for negative a unless b is a whole number."""
        return self.power(a, self._constants[b]) if self._code[b] == CONST else self._opaque(ops.POW, a, b)

    def _binary(self, code: int, a: Node, b: Node) -> Node:
        if self._code[a] == CONST and self._code[b] == CONST:
            folded = (exact := OPERATIONS[code].exact) and exact(self._constants[a], self._constants[b])
            if folded is not None:
                return self.constant(folded)
        return self._opaque(code, a, b)

    def lookup(self, table: int, x: Node, order: int = 0) -> Node:
        """Return the value of ``tables[table]`` at x, or what else it is asked (table.py)."""
        return self._lookup(table, order, x)

    def element(self, table: int, index: Node) -> Node:
        """Return the number of samples with an index, which is a whole number."""
        return self._lookup(table, ELEMENT, index)

    def cell(self, table: int, x: Node) -> Node:
        """Return the index of the interval of ascending samples in which x lies; the first or last one beyond their ends."""
        return self._lookup(table, CELL, x)

    def lookup_slope(self, n: Node) -> Node:
        """Return the derivative of a lookup with respect to its argument."""
        table, order = self._lookups[n]
        return self._lookup(table, order + 1, self._left[n]) if order < 3 else self.zero

    def _lookup(self, table: int, order: int, x: Node) -> Node:
        if not 0 <= table < len(self.tables):
            raise IndexError(f"no table {table}")
        if order >= ELEMENT and self.is_constant(x):
            return self.constant(self.tables[table](float(self.value(x)), order))
        n = self._opaque(ops.LOOKUP, x, extra=(table, order))
        self._lookups[n] = (table, order)
        return n

    # ------------------------------------------------------------------ conditions: 1 holds, 0 does not

    def less(self, a: Node, b: Node) -> Node:
        return self.zero if a == b else self._binary(ops.LESS, a, b)

    def less_equal(self, a: Node, b: Node) -> Node:
        return self.one if a == b else self._binary(ops.LESS_EQUAL, a, b)

    def equal(self, a: Node, b: Node) -> Node:
        return self.one if a == b else self._binary(ops.EQUAL, min(a, b), max(a, b))

    def logical_and(self, a: Node, b: Node) -> Node:
        if a <= 1:
            return b if a else a
        if b <= 1:
            return a if b else b
        return a if a == b else self._opaque(ops.AND, min(a, b), max(a, b))

    def logical_or(self, a: Node, b: Node) -> Node:
        if a <= 1:
            return a if a else b
        if b <= 1:
            return b if b else a
        return a if a == b else self._opaque(ops.OR, min(a, b), max(a, b))

    def logical_not(self, a: Node) -> Node:
        if a <= 1:
            return self.zero if a else self.one
        return self._left[a] if self._code[a] == ops.NOT else self._opaque(ops.NOT, a)

    def select(self, condition: Node, a: Node, b: Node) -> Node:
        """Return a where the condition holds, else b; the other one is not evaluated."""
        if condition <= 1:
            return a if condition else b
        if a == b:
            return a
        if self._code[condition] == ops.NOT:
            return self.select(self._left[condition], b, a)
        return self._opaque(SELECT, condition, a, b)


def _constructor(row: Operation) -> Callable[..., Node]:
    """Return the constructor of an operation: its own one in ``Graph``, or that of all functions of one or several arguments."""
    own: Callable[..., Node] | None = getattr(Graph, row.build or row.name, None)
    if own is not None:
        return own
    if row.arity == 1:
        return lambda graph, a: graph._function(row.code, a)
    if row.arity == 2:
        return lambda graph, a, b: graph._binary(row.code, a, b)
    return lambda graph, *arguments: graph._opaque(row.code, *arguments)


_CONSTRUCTORS: Final = tuple(map(_constructor, OPERATIONS))
"""By code."""


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
