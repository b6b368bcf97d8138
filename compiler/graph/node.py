"""The graph: nodes interned by structure and by value.

A node is an integer; its arguments have smaller ones, so that ascending order is topological. Every node
carries its value at one random point of a prime field (field.py). A constructor that arrives at a value
already there, up to sign, returns the node that has it: this finds common subexpressions, a - a = 0,
sin^2 + cos^2 = 1 and everything else that is an identity of rational functions and angles.

Which form represents a value: the one built first. Exceptions: a constant always represents its value, and
a sum or difference computed later is replaced by whatever exists, but an earlier *difference* never stands
for anything else than a sum (2 sin^2 a is not replaced by 1 - cos 2a, which cancels near a = 0).
x*y/x is y: an identity may remove a division by something that vanishes at single points.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Final, NewType

from . import operations as ops
from .field import HALF, Angle, P, circle, constant_angle, hashed, of_fraction, opaque_angle, symbol_angle
from .fold import exact_binary, exact_unary
from .operations import ADD, CONST, COS, DIV, MUL, NEG, OPERATIONS, SELECT, SIN, SQRT, SUB, SYMBOL, Parity
from .table import Table

Node = NewType("Node", int)

NONE: Final = Node(-1)
"""Fills the place of an argument that an operation does not have."""

_FOLD_BITS: Final = 1024
"""Constants with larger numerators or denominators are no longer multiplied out exactly."""

_CHAIN_LIMIT: Final = 64
"""Larger exponents go to the power function of the target."""


class DivisionByZero(ZeroDivisionError):
    """A divisor is identically zero. ``numerator`` is the node that was to be divided."""

    def __init__(self, numerator: Node) -> None:
        super().__init__("division by an expression that is identically zero")
        self.numerator = numerator


class Graph:
    """Build and read expressions.

    ``by_value=False`` interns by structure only (for comparison); ``seed`` chooses the point of the field.
    The same calls give the same nodes in every process.
    """

    __slots__ = (
        "_angles",
        "_cache",
        "_classes",
        "_code",
        "_constants",
        "_left",
        "_lookups",
        "_names",
        "_negatives",
        "_points",
        "_right",
        "_symbols",
        "_third",
        "_values",
        "by_value",
        "half",
        "minus_one",
        "one",
        "seed",
        "tables",
        "two",
        "zero",
    )

    def __init__(self, *, by_value: bool = True, seed: int = 0) -> None:
        self.by_value = by_value
        self.seed = seed
        self.tables: list[Table] = []
        # one entry for each node
        self._code: list[int] = []
        self._left: list[Node] = []
        self._right: list[Node] = []
        self._values: list[int] = []
        # what only some nodes have
        self._third: dict[Node, Node] = {}
        self._names: dict[Node, str] = {}
        self._constants: dict[Node, Fraction] = {}
        self._lookups: dict[Node, tuple[int, int]] = {}
        self._angles: dict[Node, Angle] = {}
        self._points: dict[Node, tuple[int, int]] = {}
        # from structure or value to node
        self._symbols: dict[str, Node] = {}
        self._classes: dict[int, Node] = {}
        self._negatives: dict[Node, Node] = {}
        self._cache: dict[tuple[object, ...], Node] = {}
        # add and mul rely on these three numbers
        self.zero: Node = self.constant(0)
        self.one: Node = self.constant(1)
        self.minus_one: Node = self.constant(-1)
        self.two: Node = self.constant(2)
        self.half: Node = self.constant(Fraction(1, 2))

    # ------------------------------------------------------------------ reading

    def __len__(self) -> int:
        return len(self._code)

    def op(self, n: Node) -> int:
        """Return the code of the operation (operations.py)."""
        return self._code[n]

    def args(self, n: Node) -> tuple[Node, ...]:
        a = self._left[n]
        if a < 0:
            return ()
        b = self._right[n]
        if b < 0:
            return (a,)
        return (a, b, self._third[n]) if self._code[n] == SELECT else (a, b)

    def value(self, n: Node) -> Fraction:
        """Return the exact value of a constant. Raises KeyError for any other node."""
        return self._constants[n]

    def name(self, n: Node) -> str:
        """Return the name of a symbol. Raises KeyError for any other node."""
        return self._names[n]

    def table_of(self, n: Node) -> tuple[int, int]:
        """Return (index into ``tables``, order of the derivative) of a lookup."""
        return self._lookups[n]

    def is_constant(self, n: Node) -> bool:
        return self._code[n] == CONST

    def is_zero(self, n: Node) -> bool:
        """Tell whether the expression is identically zero (with ``by_value``: up to identities)."""
        return n == 0

    def equal_up_to_sign(self, a: Node, b: Node) -> bool:
        return a == b or self._negatives.get(a) == b or self._negatives.get(b) == a

    def reach(self, outputs: Iterable[Node]) -> list[Node]:
        """Return the outputs and all they depend on, ascending."""
        stack = list(outputs)
        seen = bytearray(max(stack, default=-1) + 1)
        left, right, code = self._left, self._right, self._code
        found: list[Node] = []
        while stack:
            n = stack.pop()
            if seen[n]:
                continue
            seen[n] = 1
            found.append(n)
            a = left[n]
            if a >= 0:
                stack.append(a)
                b = right[n]
                if b >= 0:
                    stack.append(b)
                    if code[n] == SELECT:
                        stack.append(self._third[n])
        found.sort()
        return found

    def support(self, *outputs: Node) -> list[Node]:
        """Return the symbols that the outputs depend on, ascending."""
        code = self._code
        return [n for n in self.reach(outputs) if code[n] == SYMBOL]

    def count_operations(self, outputs: Iterable[Node]) -> int:
        """Count all distinct nodes but constants and symbols; sine and cosine count apart."""
        code = self._code
        return sum(code[n] > SYMBOL for n in self.reach(outputs))

    # ------------------------------------------------------------------ trials

    def fork(self) -> Graph:
        """Return an independent copy, to try something on."""
        other = object.__new__(Graph)
        for slot in Graph.__slots__:
            held = getattr(self, slot)
            setattr(other, slot, held.copy() if isinstance(held, (list, dict)) else held)
        return other

    def adopt(self, fork: Graph) -> None:
        """Take over all nodes of a fork, if nothing was added here since."""
        if len(fork) < len(self) or fork._code[: len(self)] != self._code:
            raise ValueError("the graph has changed since it was forked")
        for slot in Graph.__slots__:
            setattr(self, slot, getattr(fork, slot))

    # ------------------------------------------------------------------ interning

    def _new(self, code: int, a: Node, b: Node, v: int) -> Node:
        n = Node(len(self._code))
        self._code.append(code)
        self._left.append(a)
        self._right.append(b)
        self._values.append(v)
        return n

    def _intern(self, code: int, a: Node, b: Node, v: int) -> Node:
        """Return the node with this value in the field, or a new one."""
        key = v if v <= HALF else P - v
        found = self._classes.get(key)
        if found is not None and (self._code[found] != SUB or code in (ADD, SUB)):
            return found if self._values[found] == v else self.neg(found)
        self._classes[key] = n = self._new(code, a, b, v)
        return n

    def _structural(self, code: int, a: Node, b: Node = NONE) -> Node:
        """Return the node with this operation and these arguments, or a new one."""
        key = (code, a, b)
        n = self._cache.get(key)
        if n is None:
            self._cache[key] = n = self._new(code, a, b, 0)
        return n

    # ------------------------------------------------------------------ leaves

    def constant(self, value: Fraction | int | float) -> Node:
        """Return an exact rational; a float stands for the dyadic number that it is.

        Raises ValueError or OverflowError for NaN and infinities.
        """
        exact = Fraction(value)
        key = ("constant", exact)
        n = self._cache.get(key)
        if n is None:
            v = of_fraction(exact)
            self._cache[key] = n = self._new(CONST, NONE, NONE, v)
            self._constants[n] = exact
            key_of_class = v if v <= HALF else P - v
            found = self._classes.get(key_of_class)
            if found is None or self._code[found] != CONST:
                self._classes[key_of_class] = n
        return n

    def symbol(self, name: str) -> Node:
        n = self._symbols.get(name)
        if n is None:
            v = hashed("symbol", name, self.seed)
            self._symbols[name] = n = self._new(SYMBOL, NONE, NONE, v)
            self._names[n] = name
            self._classes[v if v <= HALF else P - v] = n
        return n

    def add_table(self, table: Table) -> int:
        """Return the index of a table in ``tables``, adding it if it is new."""
        if table not in self.tables:
            self.tables.append(table)
        return self.tables.index(table)

    # ------------------------------------------------------------------ arithmetic

    def add(self, a: Node, b: Node) -> Node:
        if a == 0:
            return b
        if b == 0:
            return a
        code = self._code
        ca, cb = code[a], code[b]
        if cb == NEG:
            return self.sub(a, self._left[b])
        if ca == NEG:
            return self.sub(b, self._left[a])
        if ca == CONST and cb == CONST:
            folded = self._constants[a] + self._constants[b]
            if _small(folded):
                return self.constant(folded)
        if a > b:
            a, b = b, a
        if not self.by_value:
            return self._structural(ADD, a, b)
        values = self._values
        v = values[a] + values[b]
        if v >= P:
            v -= P
        # _intern, written out: additions and multiplications are nearly all calls
        key = v if v <= HALF else P - v
        found = self._classes.get(key)
        if found is not None:
            return found if values[found] == v else self.neg(found)
        self._classes[key] = n = self._new(ADD, a, b, v)
        return n

    def sub(self, a: Node, b: Node) -> Node:
        if b == 0:
            return a
        if a == b:
            return self.zero
        if a == 0:
            return self.neg(b)
        code = self._code
        ca, cb = code[a], code[b]
        if cb == NEG:
            return self.add(a, self._left[b])
        if ca == NEG:
            return self.neg(self.add(self._left[a], b))
        if ca == CONST and cb == CONST:
            folded = self._constants[a] - self._constants[b]
            if _small(folded):
                return self.constant(folded)
        if not self.by_value:
            return self._structural(SUB, a, b)
        values = self._values
        v = values[a] - values[b]
        if v < 0:
            v += P
        key = v if v <= HALF else P - v
        found = self._classes.get(key)
        if found is not None:
            return found if values[found] == v else self.neg(found)
        self._classes[key] = n = self._new(SUB, a, b, v)
        return n

    def neg(self, a: Node) -> Node:
        n = self._negatives.get(a)
        if n is not None:
            return n
        code = self._code[a]
        if code == NEG:
            return self._left[a]
        if code == CONST:
            return self.constant(-self._constants[a])
        if code == SUB and not self.by_value:
            n = self._structural(SUB, self._right[a], self._left[a])
        else:
            v = self._values[a]
            n = self._new(NEG, a, NONE, P - v if v else 0)
        self._negatives[a] = n
        return n

    def mul(self, a: Node, b: Node) -> Node:
        # zero and one are nodes 0 and 1
        if a <= 1:
            return b if a else a
        if b <= 1:
            return a if b else b
        code = self._code
        ca, cb = code[a], code[b]
        if ca == NEG:
            inner = self._left[a]
            return self.mul(inner, self._left[b]) if cb == NEG else self.neg(self.mul(inner, b))
        if cb == NEG:
            return self.neg(self.mul(a, self._left[b]))
        if ca == CONST or cb == CONST:
            n = self._scaled(a, b) if ca == CONST else self._scaled(b, a)
            if n is not None:
                return n
        elif a == b and ca == SQRT:
            return self._left[a]
        if a > b:
            a, b = b, a
        if not self.by_value:
            return self._structural(MUL, a, b)
        values = self._values
        v = values[a] * values[b]
        # p is a Mersenne number: 2^127 is 1
        v = (v & P) + (v >> 127)
        if v >= P:
            v -= P
        key = v if v <= HALF else P - v
        found = self._classes.get(key)
        if found is not None and code[found] != SUB:
            return found if values[found] == v else self.neg(found)
        self._classes[key] = n = self._new(MUL, a, b, v)
        return n

    def _scaled(self, c: Node, a: Node) -> Node | None:
        """Return the product of a constant and a node where a local rule simplifies it."""
        if c == self.minus_one:
            return self.neg(a)
        if a == self.minus_one:
            return self.neg(c)
        factor = self._constants[c]
        code = self._code[a]
        if code == CONST:
            folded = factor * self._constants[a]
            return self.constant(folded) if _small(folded) else None
        if code == MUL:
            x, y = self._left[a], self._right[a]
            if self._code[y] == CONST:
                x, y = y, x
            if self._code[x] == CONST:
                folded = factor * self._constants[x]
                return self.mul(self.constant(folded), y) if _small(folded) else None
        return None

    def div(self, a: Node, b: Node) -> Node:
        """Return a/b. Raises DivisionByZero where b is identically zero."""
        if b == 0:
            raise DivisionByZero(a)
        if a == 0 or b == 1:
            return a
        if a == b:
            return self.one
        code = self._code
        if code[b] == CONST:
            inverse = 1 / self._constants[b]
            return self.mul(a, self.constant(inverse))
        if code[a] == NEG:
            return self.neg(self.div(self._left[a], b))
        if code[b] == NEG:
            return self.neg(self.div(a, self._left[b]))
        if not self.by_value:
            return self._structural(DIV, a, b)
        key = (DIV, a, b)
        n = self._cache.get(key)
        if n is None:
            v = self._values[a] * pow(self._values[b], -1, P) % P
            self._cache[key] = n = self._intern(DIV, a, b, v)
        return n

    def sum(self, terms: Iterable[Node]) -> Node:
        total = self.zero
        for term in terms:
            total = self.add(total, term)
        return total

    def product(self, factors: Iterable[Node]) -> Node:
        total = self.one
        for factor in factors:
            total = self.mul(total, factor)
        return total

    def dot(self, a: Sequence[Node], b: Sequence[Node]) -> Node:
        """Return the sum of the products of corresponding elements."""
        return self.sum(self.mul(x, y) for x, y in zip(a, b, strict=True))

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
                self._third[n] = c
        return n

    def _function(self, code: int, a: Node) -> Node:
        """Apply a unary function: exact results, parity, then interning."""
        parity = OPERATIONS[code].parity
        if self._code[a] == CONST:
            exact = exact_unary(code, self._constants[a])
            if exact is not None:
                return self.constant(exact)
        if parity is not Parity.NONE and self._is_negative(a):
            positive = self._function(code, self.neg(a))
            return positive if parity is Parity.EVEN else self.neg(positive)
        if not self.by_value:
            return self._structural(code, a)
        if code in (SIN, COS):
            key = (code, a)
            n = self._cache.get(key)
            if n is None:
                cosine, sine = self._point(a)
                self._cache[key] = n = self._intern(code, a, NONE, sine if code == SIN else cosine)
            return n
        return self._opaque(code, a)

    def _is_negative(self, a: Node) -> bool:
        code = self._code[a]
        return code == NEG or (code == CONST and self._constants[a] < 0)

    def _point(self, n: Node) -> tuple[int, int]:
        """Return (cosine, sine) of an angle in the field."""
        point = self._points.get(n)
        if point is None:
            exponent = self._angle(n).exponent()
            if exponent is None:
                exponent = opaque_angle(self._values[n], self.seed).exponent()
                assert exponent is not None
            self._points[n] = point = circle(exponent)
        return point

    def _angle(self, n: Node) -> Angle:
        """Return the angle that a node stands for: linear in symbols, opaque below anything else."""
        angles, code, left, right = self._angles, self._code, self._left, self._right
        stack = [n]
        while stack:
            k = stack[-1]
            if k in angles:
                stack.pop()
                continue
            c, a, b = code[k], left[k], right[k]
            if c == CONST:
                angles[k] = constant_angle(self._constants[k], self.seed)
            elif c == SYMBOL:
                angles[k] = symbol_angle(self._names[k], self.seed)
            elif c in (ADD, SUB):
                if a in angles and b in angles:
                    angles[k] = angles[a] + angles[b] if c == ADD else angles[a] - angles[b]
                else:
                    stack += (a, b)
            elif c == NEG or (c == MUL and CONST in (code[a], code[b])):
                if c == MUL and code[a] != CONST:
                    a, b = b, a
                factor, inner = (Fraction(-1), a) if c == NEG else (self._constants[a], b)
                if inner in angles:
                    angles[k] = angles[inner].scaled(factor)
                else:
                    stack.append(inner)
            else:
                angles[k] = opaque_angle(self._values[k], self.seed)
        return angles[n]

    def sin(self, a: Node) -> Node:
        return self._function(SIN, a)

    def cos(self, a: Node) -> Node:
        return self._function(COS, a)

    def tan(self, a: Node) -> Node:
        return self._function(ops.TAN, a)

    def asin(self, a: Node) -> Node:
        return self._function(ops.ASIN, a)

    def acos(self, a: Node) -> Node:
        return self._function(ops.ACOS, a)

    def atan(self, a: Node) -> Node:
        return self._function(ops.ATAN, a)

    def sinh(self, a: Node) -> Node:
        return self._function(ops.SINH, a)

    def cosh(self, a: Node) -> Node:
        return self._function(ops.COSH, a)

    def tanh(self, a: Node) -> Node:
        return self._function(ops.TANH, a)

    def asinh(self, a: Node) -> Node:
        return self._function(ops.ASINH, a)

    def acosh(self, a: Node) -> Node:
        return self._function(ops.ACOSH, a)

    def atanh(self, a: Node) -> Node:
        return self._function(ops.ATANH, a)

    def exp(self, a: Node) -> Node:
        return self._function(ops.EXP, a)

    def log(self, a: Node) -> Node:
        return self._function(ops.LOG, a)

    def abs(self, a: Node) -> Node:
        return self._function(ops.ABS, a)

    def sign(self, a: Node) -> Node:
        return self._function(ops.SIGN, a)

    def floor(self, a: Node) -> Node:
        return self._function(ops.FLOOR, a)

    def sqrt(self, a: Node) -> Node:
        if self._code[a] == MUL and self._left[a] == self._right[a]:
            return self.abs(self._left[a])
        return self._function(SQRT, a)

    def atan2(self, y: Node, x: Node) -> Node:
        return self._binary(ops.ATAN2, y, x)

    def minimum(self, a: Node, b: Node) -> Node:
        return a if a == b else self._binary(ops.MINIMUM, min(a, b), max(a, b))

    def maximum(self, a: Node, b: Node) -> Node:
        return a if a == b else self._binary(ops.MAXIMUM, min(a, b), max(a, b))

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
            exact = exact_binary(code, self._constants[a], self._constants[b])
            if exact is not None:
                return self.constant(exact)
        return self._opaque(code, a, b)

    def lookup(self, table: int, x: Node) -> Node:
        """Return the value of ``tables[table]`` at x."""
        return self._lookup(table, 0, x)

    def lookup_slope(self, n: Node) -> Node:
        """Return the derivative of a lookup with respect to its argument."""
        table, order = self._lookups[n]
        return self._lookup(table, order + 1, self._left[n]) if order < 3 else self.zero

    def _lookup(self, table: int, order: int, x: Node) -> Node:
        if not 0 <= table < len(self.tables):
            raise IndexError(f"no table {table}")
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


def _small(c: Fraction) -> bool:
    return c.numerator.bit_length() <= _FOLD_BITS and c.denominator.bit_length() <= _FOLD_BITS
