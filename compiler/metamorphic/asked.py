"""Which questions about the motion a model asks, and whether the motion feels the answers."""

from __future__ import annotations

from collections.abc import Collection

from msgspec.structs import replace

from ..flat.model import Apply, Derivative, Expression, FlatModel, Name, Query, Role
from ..flat.operands import parts, stated

ENERGIES = frozenset({"energy", "kinetic_energy", "potential_energy", "power"})
JUMPING = frozenset({"sign", "floor", "ceil", "mod", "div", "less", "less_equal", "greater", "greater_equal", "equal",
                     "not_equal", "and", "or", "not", "sample", "initial"})  # fmt: skip
KINKS = ("abs", "min", "max", "clamp", "deadzone")
RATES = frozenset({"vel", "vel_at", "angvel"})


def defined_by(model: FlatModel, wanted: Collection[str]) -> frozenset[str]:
    """Return the definitions whose value asks one of the ``wanted`` questions, or holds one that does."""
    values = {d.name: d.value for d in model.definitions if d.value is not None}
    found = {n for n, e in values.items() if any(_asks(p, wanted) for p in parts([e]))}
    while True:
        more = {
            n for n, e in values.items() if any(isinstance(p, Name) and p.name in found for p in parts([e]))
        }
        if more <= found:
            return frozenset(found)
        found |= more


def felt(model: FlatModel, wanted: Collection[str]) -> bool:
    """Whether anything but definitions asks one of the questions, itself or through definitions."""
    through = defined_by(model, wanted)
    rest = replace(model, definitions=(), draws=(), exacts=())
    return any(_asks(p, wanted) or (isinstance(p, Name) and p.name in through) for p in parts(stated(rest)))


def _asks(part: Expression, wanted: Collection[str]) -> bool:
    return isinstance(part, Query) and part.function in wanted


class ModelFacts:
    """What expressions of a model hold, through its definitions."""

    def __init__(self, model: FlatModel) -> None:
        self._values = {d.name: d.value for d in model.definitions if d.value is not None}
        self._within: dict[str, frozenset[str]] = {}
        self.defined = frozenset(self._values)
        self._fixed = frozenset(v.name for v in model.variables if v.role is Role.PARAMETER)

    def within(self, *roots: Expression) -> frozenset[str]:
        """Return the names, functions (``f()``), questions (``f?``) and ``der`` in expressions and in what they name."""
        found: set[str] = set()
        for p in parts(roots):
            match p:
                case Name(name=name):
                    found.add(name)
                    if name in self._values:
                        found |= self._named(name)
                case Apply(function=function):
                    found.add(f"{function}()")
                case Query(function=function):
                    found.add(f"{function}?")
                case Derivative():
                    found.add("der")
                case _:
                    found.add(type(p).__name__)
        return frozenset(found)

    def _named(self, name: str) -> frozenset[str]:
        if name not in self._within:
            value = self._values[name]
            assert value is not None
            self._within[name] = self.within(value)
        return self._within[name]

    def constant(self, value: Expression) -> bool:
        """Whether a value is a formula of parameters alone."""
        known = self._fixed | self.defined | {"Literal", "Array", "Element"}
        return all(n in known or n.endswith("()") for n in self.within(value))

    def moves(self, *roots: Expression) -> bool:
        """Whether expressions hold rates."""
        inside = self.within(*roots)
        return bool(inside & {"der", *(f"{f}()" for f in RATES)}) or any(n.endswith("?") for n in inside)

    def jumps(self, *roots: Expression) -> bool:
        """Whether expressions hold conditions or steps."""
        inside = self.within(*roots)
        return bool(inside & {"Select", *(f"{f}()" for f in JUMPING)})

    def bends(self, *roots: Expression) -> bool:
        """Whether expressions hold kinks, conditions or steps."""
        return self.jumps(*roots) or bool(self.within(*roots) & {f"{f}()" for f in KINKS})
