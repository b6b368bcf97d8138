"""What a random model of a curve says: its text, and the same as trees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from .jets import Jet, constant
from .tree import E, along, evaluate, replaced

LOWER = E("lower")
UPPER = E("upper")


@dataclass(frozen=True)
class Condition:
    """``left`` = ``right``, numbers of the whole curve; ends are values ``at`` one of them."""

    name: str
    left: E
    right: E


@dataclass(frozen=True)
class Everywhere:
    """``left`` = ``right`` at every place, from which ``coordinate`` follows as ``formula`` of the others."""

    name: str
    left: E
    right: E
    coordinate: int
    formula: E


@dataclass
class Posed:
    """A model; ``names`` of coordinates, the unknown end last; ``given`` what a run changes, in SI."""

    variable: str
    names: list[str]
    sizes: list[float]
    lower: E
    upper: E
    unknown_end: bool = False
    end_size: float = 1.0
    orders: list[int] = field(default_factory=list)
    parameters: dict[str, E] = field(default_factory=dict)
    stationary: E = field(default_factory=lambda: E("num", (), (0.0, "", 1.0)))
    conditions: list[Condition] = field(default_factory=list)
    everywhere: list[Everywhere] = field(default_factory=list)
    outputs: dict[str, E] = field(default_factory=dict)
    along: dict[str, E] = field(default_factory=dict)
    densities: dict[str, str] = field(default_factory=dict)
    multipliers: dict[str, str] = field(default_factory=dict)
    breaks: list[E] = field(default_factory=list)
    given: dict[str, float | str] = field(default_factory=dict)
    experiment: str | None = None
    changed: dict[str, float] = field(default_factory=dict)
    text: str = ""

    def number(self, e: E) -> float:
        """Return the value in SI of a formula of numbers and parameters."""
        return float(evaluate(e, lambda leaf: self.known(leaf, 1, 0)).value[0])

    def known(self, leaf: E, places: int, variables: int) -> Jet:
        match leaf.op, leaf.data:
            case "num", (float(value), _, float(size)):
                return constant(value * size, places, variables)
            case "par", (str(name),):
                value_ = self.changed[name] if name in self.changed else self.number(self.parameters[name])
                return constant(value_, places, variables)
            case "lower", _:
                return constant(self.number(self.lower), places, variables)
            case "upper", _ if not self.unknown_end:
                return constant(self.number(self.upper), places, variables)
        raise AssertionError(leaf.op)


def in_full(e: E, eliminated: Mapping[int, E]) -> E:
    """Return the formula with coordinates that follow from a condition written out."""

    def change(part: E) -> E | None:
        if part.op == "der":
            return replaced(along(part.args[0]), change)
        if part.op == "q" and part.data[0] in eliminated:
            formula = eliminated[int(str(part.data[0]))]
            for _ in range(int(str(part.data[1]))):
                formula = along(formula)
            return replaced(formula, change)
        return None

    return replaced(e, change) if eliminated else e
