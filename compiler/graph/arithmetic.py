"""Sums and products: most nodes of every graph, so that what ``NodeStore`` does for all is written out here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from .dependence import Node
from .field import HALF, P
from .fold import is_short
from .interning import NodeStore
from .operations import ADD, CONST, DIV, MUL, NEG, SINGULAR, SQRT, SUB


class DivisionByZero(ZeroDivisionError):
    """A divisor is identically zero. ``numerator`` is the node that was to be divided."""

    def __init__(self, numerator: Node) -> None:
        super().__init__("division by an expression that is identically zero")
        self.numerator = numerator


class Arithmetic(NodeStore):
    """The four operations, and what is made of them."""

    __slots__ = ()

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
            if is_short(folded):
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
        traits = self._traits
        if found is not None and (not traits[found] & SINGULAR or (traits[a] | traits[b]) & SINGULAR):
            return found if values[found] == v else self.neg(found)
        # _new, written out, too
        self._classes[key] = n = len(code)  # type: ignore[assignment]
        code.append(ADD)
        self._left.append(a)
        self._right.append(b)
        values.append(v)
        traits.append(traits[a] | traits[b])
        return n  # type: ignore[return-value]

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
            if is_short(folded):
                return self.constant(folded)
        if not self.by_value:
            return self._structural(SUB, a, b)
        values = self._values
        v = values[a] - values[b]
        if v < 0:
            v += P
        key = v if v <= HALF else P - v
        found = self._classes.get(key)
        traits = self._traits
        if found is not None and (not traits[found] & SINGULAR or (traits[a] | traits[b]) & SINGULAR):
            return found if values[found] == v else self.neg(found)
        self._classes[key] = n = len(code)  # type: ignore[assignment]
        code.append(SUB)
        self._left.append(a)
        self._right.append(b)
        values.append(v)
        traits.append(traits[a] | traits[b])
        return n  # type: ignore[return-value]

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
        traits = self._traits
        if (
            found is not None
            and code[found] != SUB
            and (not traits[found] & SINGULAR or (traits[a] | traits[b]) & SINGULAR)
        ):
            return found if values[found] == v else self.neg(found)
        self._classes[key] = n = len(code)  # type: ignore[assignment]
        code.append(MUL)
        self._left.append(a)
        self._right.append(b)
        values.append(v)
        traits.append(traits[a] | traits[b])
        return n  # type: ignore[return-value]

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
            return self.constant(folded) if is_short(folded) else None
        if code == MUL:
            x, y = self._left[a], self._right[a]
            if self._code[y] == CONST:
                x, y = y, x
            if self._code[x] == CONST:
                folded = factor * self._constants[x]
                return self.mul(self.constant(folded), y) if is_short(folded) else None
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
            v = self._values[a] * self._inverse(b) % P
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
