"""The storage of the graph: nodes interned by structure and by value.

A node is an integer; its arguments have smaller ones, so that ascending order is topological. Every node
carries its value at one random point of a prime field (field.py). A constructor that arrives at a value
already there, up to sign, returns the node that has it: this finds common subexpressions, a - a = 0,
sin^2 + cos^2 = 1 and everything else that is an identity of rational functions and angles.

Which form represents a value: the one built first, but
- a constant always represents its value;
- an earlier *difference* stands for sums and differences only: 2 sin^2 a is not replaced by 1 - cos 2a, which
  cancels near a = 0;
- an earlier form that is *partial* (it divides, takes a root or logarithm somewhere, so it has singular states)
  does not stand for one that is not: x + 1 is not replaced by (x^2 - 1)/(x - 1).
The other way round is accepted: x*y/x is y, an identity may remove a singular state.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence, Set
from fractions import Fraction
from itertools import compress
from typing import Final, Self

from .dependence import Node, ReachCache, depends_on, few_reached, marked, marked_within, within
from .field import HALF, Angle, P, hashed, of_fraction
from .operations import ADD, CONST, MUL, NEG, OTHER, PARTIAL, SELECT, SINGULAR, SUB, SYMBOL
from .solution import Solutions
from .table import Samples, Table

NONE: Final = Node(-1)
"""Fills the place of an argument that an operation does not have."""

ASKED: Final = 16
"""Sets of nodes whose traits are remembered: those of all velocities, say, are asked about for each statement."""


class NodeStore:
    """Nodes and what is known about them; ``Graph`` (node.py) adds the constructors of expressions.

    ``by_value=False`` interns by structure only (for comparison); ``seed`` chooses the point of the field.
    The same calls give the same nodes in every process.
    """

    __slots__ = (
        "_angles",
        "_asked",
        "_cache",
        "_classes",
        "_code",
        "_constants",
        "_inverses",
        "_left",
        "_lookups",
        "_names",
        "_negatives",
        "_points",
        "_reached",
        "_right",
        "_symbols",
        "_third",
        "_traits",
        "_used",
        "_values",
        "by_value",
        "gradients",
        "half",
        "minus_one",
        "one",
        "seed",
        "solutions",
        "tables",
        "two",
        "zero",
    )

    def __init__(self, *, by_value: bool = True, seed: int = 0) -> None:
        self.by_value = by_value
        self.seed = seed
        self.tables: list[Table | Samples] = []
        self.gradients: dict[tuple[Node, tuple[Node, ...]], list[Node]] = {}
        """Of a node, by some symbols: those that differentiate.py remembers."""
        self.solutions: Solutions = {}
        """How what ``derived(value, 0)`` stands for was found (solution.py)."""
        # one entry for each node
        self._code: list[int] = []
        self._left: list[Node] = []
        self._right: list[Node] = []
        self._values: list[int] = []
        self._traits = bytearray()
        """Whether singular, and kinds of symbols that it depends on (operations.py)."""
        # what only some nodes have
        self._third: dict[Node, Node] = {}
        self._names: dict[Node, str] = {}
        self._constants: dict[Node, Fraction] = {}
        self._lookups: dict[Node, tuple[int, int]] = {}
        self._angles: dict[Node, Angle] = {}
        self._points: dict[Node, tuple[int, int]] = {}
        self._inverses: dict[Node, int] = {}
        self._reached = ReachCache()
        self._asked: dict[frozenset[Node], bytes] = {}
        self._used = {ADD, SUB, MUL}
        """Operations that some node has, and perhaps these."""
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

    def identical(self, a: Node, b: Node) -> bool:
        """Tell whether two expressions are the same function. Nodes that differ may be: see the module."""
        return a == b or (self.by_value and self._values[a] == self._values[b])

    def equal_up_to_sign(self, a: Node, b: Node) -> bool:
        if self.by_value:
            return self.identical(a, b) or self._values[a] + self._values[b] == P
        return a == b or self._negatives.get(a) == b or self._negatives.get(b) == a

    def reach(self, outputs: Iterable[Node], known: Iterable[Node] = ()) -> list[Node]:
        """Return the outputs and all they depend on, ascending; neither ``known`` nodes nor what is below them."""
        wanted, stopped = tuple(outputs), frozenset(known)
        few = few_reached(self, wanted, stopped)
        if few is not None:
            return few
        marks = self._marks(wanted, stopped)
        return list(compress(range(len(marks)), marks))  # type: ignore[arg-type]

    def reach_of(self, outputs: Iterable[Node], nodes: Iterable[Node]) -> list[Node]:
        """Return those of ``reach`` that may depend on some nodes, or be one: all that are, and some others."""
        wanted = tuple(outputs)
        few = few_reached(self, wanted)
        return marked_within(self, wanted, self._within(frozenset(nodes))) if few is None else few

    def depend(self, outputs: Iterable[Node], nodes: Collection[Node]) -> bool:
        """Tell whether some output depends on one of some nodes, or is one."""
        sought = frozenset(nodes)
        return depends_on(self, outputs, sought, self._within(sought))

    def _within(self, nodes: frozenset[Node]) -> bytes:
        """Return for each combination of traits whether what has them may depend on one of some nodes."""
        asked = self._asked.get(nodes)
        if asked is None:
            if len(self._asked) >= ASKED:
                self._asked.clear()
            asked = self._asked[nodes] = within(frozenset([self._traits[n] for n in nodes]))
        return asked

    def _marks(self, wanted: tuple[Node, ...], known: frozenset[Node] = frozenset()) -> bytearray:
        """Return a byte for each node, 1 where it is reached; large questions are often asked again."""
        return marked(self, wanted, known) if known else self._reached.to(self, wanted)

    def reached_with(self, outputs: Iterable[Node], codes: Set[int]) -> list[Node]:
        """Return those of the nodes that outputs reach that have one of some operations, ascending."""
        wanted, code = tuple(outputs), self._code
        if codes.isdisjoint(self._used):
            return []
        few = few_reached(self, wanted)
        if few is not None:
            return [n for n in few if code[n] in codes]
        marks = self._marks(wanted)
        if codes.isdisjoint(set(compress(code, marks))):
            return []
        return [n for n in compress(range(len(marks)), marks) if code[n] in codes]  # type: ignore[misc]

    def having(self, nodes: Iterable[Node], codes: Set[int]) -> list[Node]:
        """Return those of some nodes that have one of some operations."""
        code = self._code
        return [] if codes.isdisjoint(self._used) else [n for n in nodes if code[n] in codes]

    def reached_among(self, outputs: Sequence[Node], candidates: Iterable[Node]) -> list[Node]:
        """Return those of some nodes that the outputs depend on, or are."""
        wanted, traits = tuple(outputs), self._traits
        held = {traits[n] for n in wanted}
        candidates = [n for n in candidates if any(not traits[n] & ~own for own in held)]
        if not candidates:
            return []
        few = few_reached(self, wanted)
        if few is not None:
            found = set(few)
            return [n for n in candidates if n in found]
        marks = self._marks(wanted)
        return [n for n in candidates if n < len(marks) and marks[n]]

    def depth_first(self, outputs: Iterable[Node], given: Iterable[Node] = ()) -> list[Node]:
        """Return the outputs and all they depend on, each after its arguments, left ones first.

        ``given`` nodes that are met are among them, but not what is below.
        """
        left, right, code, third = self._left, self._right, self._code, self._third
        done, leaf = bytearray(len(code)), bytearray(len(code))
        for n in given:
            leaf[n] = 1
        order: list[Node] = []
        emit = order.append
        for output in outputs:
            stack: list[int] = [output]
            push, pop = stack.append, stack.pop
            while stack:
                n = pop()  # type: ignore[assignment]
                if n < 0:
                    emit(~n)  # type: ignore[arg-type]  # its arguments are there
                    continue
                while not done[n]:
                    done[n] = 1
                    a = left[n]
                    if a < 0 or leaf[n]:
                        emit(n)
                        break
                    push(~n)
                    b = right[n]
                    if b >= 0:
                        if third and code[n] == SELECT:
                            push(third[n])
                        if not done[b]:
                            push(b)
                    n = a
        return order

    def support(self, *outputs: Node) -> list[Node]:
        """Return the symbols that the outputs depend on, ascending."""
        few = few_reached(self, outputs)
        if few is not None:
            return [n for n in few if self._code[n] == SYMBOL]
        marks = self._marks(outputs)
        return [n for n in self._names if n < len(marks) and marks[n]]

    def count_operations(self, outputs: Iterable[Node]) -> int:
        """Count all distinct nodes but constants and symbols; sine and cosine count apart."""
        codes = bytes(compress(self._code, self._marks(tuple(outputs))))
        return len(codes) - codes.count(CONST) - codes.count(SYMBOL)

    # ------------------------------------------------------------------ trials

    def fork(self) -> Self:
        """Return an independent copy, to try something on."""
        other = object.__new__(type(self))
        for slot in NodeStore.__slots__:
            held = getattr(self, slot)
            if isinstance(held, (list, dict, set, bytearray, ReachCache)):
                held = held.copy()
            setattr(other, slot, held)
        return other

    def adopt(self, fork: Self) -> None:
        """Take over all nodes of a fork, if nothing was added here since."""
        if len(fork) < len(self) or fork._code[: len(self)] != self._code:
            raise ValueError("the graph has changed since it was forked")
        for slot in NodeStore.__slots__:
            setattr(self, slot, getattr(fork, slot))

    # ------------------------------------------------------------------ interning

    def _new(self, code: int, a: Node, b: Node, v: int) -> Node:
        n: Node = len(self._code)  # type: ignore[assignment]  # Node(..) would be a call for each node
        self._code.append(code)
        self._left.append(a)
        self._right.append(b)
        self._values.append(v)
        self._used.add(code)
        own = SINGULAR if code in PARTIAL else 0
        if a >= 0:
            own |= self._traits[a]
            if b >= 0:
                own |= self._traits[b]
        self._traits.append(own)
        return n

    def _intern(self, code: int, a: Node, b: Node, v: int) -> Node:
        """Return the node with this value in the field, or a new one."""
        key = v if v <= HALF else P - v
        found = self._classes.get(key)
        if found is not None and self._may_stand(found, code, a, b):
            return found if self._values[found] == v else self.neg(found)
        self._classes[key] = n = self._new(code, a, b, v)
        return n

    def _may_stand(self, found: Node, code: int, a: Node, b: Node) -> bool:
        """Tell whether a node with the right value may represent an operation; see the module."""
        if self._code[found] == SUB and code not in (ADD, SUB):
            return False
        traits = self._traits
        own = (traits[a] if a >= 0 else 0) | (traits[b] if b >= 0 else 0)
        return code in PARTIAL or not traits[found] & ~own & SINGULAR

    def _structural(self, code: int, a: Node, b: Node = NONE) -> Node:
        """Return the node with this operation and these arguments, or a new one."""
        n = self._cache.get((code, a, b))
        if n is None:
            self._cache[code, a, b] = n = self._new(code, a, b, 0)
        return n

    def _inverse(self, n: Node) -> int:
        """Return the inverse of a value in the field, which takes long: a length divides several times."""
        found = self._inverses.get(n)
        if found is None:
            self._inverses[n] = found = pow(self._values[n], -1, P)
        return found

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

    # ------------------------------------------------------------------ leaves

    def constant(self, value: Fraction | int | float) -> Node:
        """Return an exact rational; a float stands for the dyadic number that it is.

        Raises ValueError or OverflowError for NaN and infinities.
        """
        exact = value if type(value) is Fraction else Fraction(value)
        key = ("constant", exact.numerator, exact.denominator)  # the hash of a fraction takes an inverse
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

    def symbol(self, name: str, kind: int = OTHER) -> Node:
        """Return the symbol of this name; ``kind`` (operations.py) is that of a new one."""
        n = self._symbols.get(name)
        if n is None:
            v = hashed("symbol", name, self.seed)
            self._symbols[name] = n = self._new(SYMBOL, NONE, NONE, v)
            self._traits[n] = kind
            self._names[n] = name
            self._classes[v if v <= HALF else P - v] = n
        return n

    def add_table(self, table: Table | Samples) -> int:
        """Return the index of a table in ``tables``, adding it if it is new."""
        if table not in self.tables:
            self.tables.append(table)
        return self.tables.index(table)
