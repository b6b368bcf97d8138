"""A function as loops: what emitters print.

Statements run in order; a loop runs its body once for each value of its counter, from 0 on. What an iteration computes
is known by a number within it and in the loops inside it. What lives longer stands in the workspace w, at places that
are affine in the counters or read from a table.
"""

from __future__ import annotations

from fractions import Fraction

from msgspec import Struct

from ..model import Lookup, Operate

NUMBERS = "numbers"
"""The array of ``Rolled.numbers``."""


class Index(Struct, frozen=True):
    """base + sum of strides times counters; with a table, plus its number at the place that ``numbered`` loop has reached."""

    base: int = 0
    strides: tuple[tuple[int, int], ...] = ()
    """(counter, stride)"""
    table: int = -1
    numbered: int = -1
    """The loop, by its counter, whose iterations are counted through the whole function."""


class Read(Struct, frozen=True):
    """The number ``array[index]``; the array is t, y, u, z, p, w, or the ``numbers`` of the function."""

    array: str
    index: Index


class Local(Struct, frozen=True):
    """The value of a statement of the same iteration, or of one around it."""

    number: int


class LoopRegister(Struct, frozen=True):
    """A number that a loop keeps in a register (``Loop.kept``)."""

    number: int


class Carried(Struct, frozen=True):
    """What an iteration made for the next one (``Loop.carried``)."""

    number: int


class LoopNumber(Struct, frozen=True):
    value: Fraction


Operand = Read | Local | LoopRegister | Carried | LoopNumber


class Compute(Struct, frozen=True):
    """The operation of ``statement``, whose own operands mean nothing here, on ``operands``. The value goes to the
    ``place`` in w, if there is one, and to the register of its number where that is ``kept``."""

    number: int
    statement: Operate | Lookup
    operands: tuple[Operand, ...]
    place: Index | None = None
    kept: bool = False


class Put(Struct, frozen=True):
    """``array[index] = operand``; the array is out, w or, in ``parameters``, p, there ``guarded`` or not."""

    array: str
    index: Index
    operand: Operand
    guarded: bool = False


class Carry(Struct, frozen=True):
    """The register ``number`` holds what the statement ``source`` made in the iteration before, and what lies in w at
    ``first`` in the first one. What the last one made goes to ``last``, if it is read by what follows."""

    number: int
    source: int
    first: Index
    last: Index | None = None


class Loop(Struct, frozen=True):
    """``body`` for each value of ``counter`` below ``trips``. ``kept``: numbers of registers, which are read from a place
    in w before the first iteration and written there after the last one. ``apart``: iterations are many, and but for these
    numbers none reads or writes what another one writes."""

    counter: int
    trips: Index
    body: tuple[Compute | Put | Loop, ...]
    kept: tuple[tuple[int, Index], ...] = ()
    numbered: bool = False
    """Whether some index counts its iterations."""
    apart: bool = False
    carried: tuple[Carry, ...] = ()


Item = Compute | Put | Loop


class Rolled(Struct, frozen=True):
    items: tuple[Item, ...]
    tables: tuple[tuple[int, ...], ...]
    workspace: int
    numbers: tuple[Fraction, ...] = ()
    """Constants that differ from one iteration to another."""
