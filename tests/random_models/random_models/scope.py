"""What a model under construction knows: its random numbers, names, statements, and what expressions may use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from random import Random
from typing import TypeVar

from random_models.quantities import quantity
from random_models.tree import LENGTH, NUMBER, Dim, E, S, Seq, Slot, reference, statement

T = TypeVar("T")

TYPES: dict[Dim, tuple[str, ...]] = {}


def _types() -> None:
    from random_models import tree as t

    TYPES.update(
        {
            t.MASS: ("Mass",), t.LENGTH: ("Length",), t.TIME: ("Time",), t.SPEED: ("Velocity",),
            t.FORCE: ("Force",), t.ENERGY: ("Energy", "Torque"), t.ACCELERATION: ("Acceleration",),
            t.RATE: ("AngularVelocity", "Frequency"), t.POWER: ("Power",), t.INERTIA: ("Inertia",),
            t.dim(1, 0, -2): ("Stiffness",), t.dim(1, 0, -1): ("Damping",),
            t.dim(1, 2, -1): ("RotationalDamping", "AngularMomentum"), t.dim(1, 1, -1): ("Momentum",),
            t.NUMBER: ("Real",),
        }
    )  # fmt: skip


_types()


@dataclass
class File:
    """What all models of one file share: functions, types and classes, which stand before the model."""

    random: Random
    items: list[S] = field(default_factory=list)
    functions: list[tuple[str, tuple[Dim, ...], Dim, E, tuple[str, ...]]] = field(default_factory=list)
    count: int = 0

    def fresh(self, prefix: str) -> str:
        """Return a new name."""
        self.count += 1
        return f"{prefix}{self.count}"


@dataclass
class Scope:
    """One model of the file. ``in_class``: it is not the one that runs."""

    file: File
    space: int = 0
    in_class: bool = False
    statements: list[S] = field(default_factory=list)
    signals: list[E] = field(default_factory=list)
    parameters: list[E] = field(default_factory=list)
    # vector-valued references: array parameters and coordinates
    vectors: list[E] = field(default_factory=list)
    frames: list[E] = field(default_factory=list)  # placed frames and points
    bodies: list[E] = field(default_factory=list)  # frames that carry mass
    joints: list[str] = field(default_factory=list)
    constraints: list[tuple[str, Dim, bool]] = field(default_factory=list)  # name, dimension, a contact
    coordinates: list[E] = field(default_factory=list)
    driven: list[E] = field(default_factory=list)
    powers: list[str] = field(default_factory=list)
    locked: bool = False  # constraints are there: initial values are guesses
    conditions: list[E] = field(default_factory=list)  # truth values
    notes: set[str] = field(default_factory=set)
    # of coordinates and rates, where they are numbers
    starts: dict[str, Fraction] = field(default_factory=dict)
    clocks: list[Fraction] = field(default_factory=list)  # periods
    counters: list[E] = field(default_factory=list)  # discrete numbers

    @property
    def random(self) -> Random:
        return self.file.random

    @contextmanager
    def apart(self, what: str) -> Iterator[None]:
        """Write something by random numbers of its own: models keep all else."""
        outer, self.file.random = self.file.random, Random(what)
        try:
            yield
        finally:
            self.file.random = outer

    def discrete_number(self) -> E:
        """Write a discrete variable that begins with a number, and return it."""
        name = self.fresh("n")
        first = self.literal(NUMBER, self.number(0.2, 1))
        self.add("discrete", f"discrete Real {name} = ", Slot("discrete.value", first), ";", name=name)
        n = reference(name, "discrete", NUMBER, level="z")
        self.signals.append(n)
        return n

    def fresh(self, prefix: str) -> str:
        return self.file.fresh(prefix)

    def chance(self, p: float) -> bool:
        return self.random.random() < p

    def pick(self, items: Iterable[T]) -> T:
        return self.random.choice(list(items))

    def weighted(self, table: Iterable[tuple[float, T]]) -> T:
        rows = [(w, x) for w, x in table if w > 0]
        return self.random.choices([x for _, x in rows], [w for w, _ in rows])[0]

    def add(
        self, kind: str, *parts: str | Slot | Seq, name: str = "", data: dict[str, object] | None = None
    ) -> S:
        """Write a statement, now and then with a doc string."""
        if parts[-1] == ";" and self.chance(0.03):
            parts = (*parts[:-1], ' "said in words";')
        s = statement(kind, *parts, name=name, data=data)
        self.statements.append(s)
        return s

    def number(self, low: float, high: float, digits: int = 2) -> Fraction:
        """Return a random number of few digits."""
        return Fraction(str(round(self.random.uniform(low, high), digits)))

    def size(self) -> Fraction:
        """Return a positive number of moderate size."""
        return self.number(0.3, 2.5)

    def literal(self, d: Dim, value: Fraction | None = None, *, angle: bool = False) -> E:
        """Write a number of a dimension in some unit."""
        return quantity(self.size() if value is None else value, d, self.random, angle=angle)

    def parameter(self, d: Dim, value: Fraction | None = None, expression: E | None = None) -> E:
        """Declare a parameter of a dimension, or take one that is there where no value is asked for."""
        if value is None and expression is None:
            there = [p for p in self.parameters if p.dim == d and not p.shape and p.ref]
            if there and self.chance(0.6):
                return self.pick(there)
        name = self.fresh("p")
        e = expression if expression is not None else self.literal(d, value)
        named = d in TYPES and self.chance(0.4)
        head = f"parameter {self.pick(TYPES[d]) + ' ' if named else ''}{name}"
        if self.chance(0.08) and named:
            head += self.pick(("(min = -1e6 {u})", "(max = 1e6 {u})", "(nominal = 2 {u})")).replace(
                "{u}", _si(d)
            )
        self.add("parameter", head + " = ", Slot("parameter.value", e), ";", name=name)
        p = reference(name, "parameter", d, level="p")
        self.parameters.append(p)
        return p

    def value(self, d: Dim, value: Fraction | None = None, *, angle: bool = False) -> E:
        """Return a literal or a parameter of a positive value."""
        return self.parameter(d, value) if self.chance(0.4) else self.literal(d, value, angle=angle)


def _si(d: Dim) -> str:
    text = str(quantity(1, d))
    return text.partition(" ")[2]


Maker = Callable[[Scope], None]
__all__ = ["File", "Maker", "Scope", "LENGTH", "NUMBER", "TYPES"]


def rare(share: float) -> Callable[[Callable[[Scope], object]], Callable[[Scope, int], None]]:
    """Have something written into a share of the models, by random numbers of its own: models keep all else."""

    def decorated(write: Callable[[Scope], object]) -> Callable[[Scope, int], None]:
        def part(s: Scope, seed: int) -> None:
            with s.apart(f"{write.__name__} of {seed}"):
                if s.chance(share):
                    write(s)

        part.__doc__ = write.__doc__
        return part

    return decorated
