"""Which formulas are torques: as dimensions those are energies, and are shown in N.m nevertheless."""

from __future__ import annotations

from msgspec import Struct, field

from mechc.lang import ast
from mechc.lang.units import NAMED_TYPES

from .. import types
from ..expressions.coordinates import definition_of
from ..model import Apply, Array, Element, Expression, Literal, Name, Previous, Query, Select
from ..names.instance import VariableMember
from ..names.scope import Flattening

_ASKED = ("moment", "reaction", "multiplier")
_ALIKE = (
    *("add", "subtract", "negate", "abs", "min", "max", "clamp", "deadzone", "mod"),
    *("components", "direction", "norm", "transpose", "diag"),
)
"""What gives a quantity of the kind of its arguments; frames are of no kind."""
_PRODUCTS = ("multiply", "dot", "cross", "outer")


def is_torque(flattening: Flattening, expression: Expression) -> bool:
    """Tell whether a formula with the dimension of an energy is built of torques."""
    return _Search(flattening).torque(expression)


class _Search(Struct):
    """What is known of formulas and names that are used several times."""

    flattening: Flattening
    known: dict[int | str, bool] = field(default_factory=dict)

    def torque(self, expression: Expression) -> bool:
        if expression.type.dimension != types.ENERGY:
            return False
        key = expression.name if isinstance(expression, Name) else id(expression)
        if key not in self.known:
            self.known[key] = False  # a name that needs itself is reported elsewhere
            self.known[key] = self._torque(expression)
        return self.known[key]

    def _torque(self, expression: Expression) -> bool:
        match expression:
            case Literal(span=span):
                return "N." in span.text
            case Query(function=function):
                return function in _ASKED
            case Name(name=name):
                member = self.flattening.variables.get(name)
                if member is not None and member.bound is None:
                    return _declared(member, "N.m")
                return any(map(self.torque, definition_of(self.flattening, name)))
            case Element(base=base) | Previous(operand=base):
                return self.torque(base)
            case Array(elements=elements):
                return any(map(self.torque, elements))
            case Select(then=then, otherwise=otherwise):
                return self.torque(then) or self.torque(otherwise)
            case Apply(function="cross", arguments=(first, second)):
                lever = {first.type.dimension, second.type.dimension} == {types.LENGTH, types.FORCE}
                return lever or self._product(first, second) or self._product(second, first)
            case Apply(function=function, arguments=(first, second)) if function in _PRODUCTS:
                return self._product(first, second) or self._product(second, first)
            case Apply(function="sqrt", arguments=(squares,)):
                return self._squared(squares)
            case Apply(function="divide", arguments=(first, _)):
                return self.torque(first)
            case Apply(function=function, arguments=arguments) if function in _ALIKE:
                return any(map(self.torque, arguments))
            case _:
                return False

    def _product(self, first: Expression, second: Expression) -> bool:
        """A torque times a number, or a stiffness in N.m/rad times an angle; times its square it is an energy."""
        if not second.type.dimension.is_none:
            return False
        if not second.type.angle:
            return self.torque(first) and not _stiffness(self.flattening, first)
        return _stiffness(self.flattening, first)

    def _squared(self, expression: Expression) -> bool:
        """Tell whether a formula holds the square of a torque: its root is the length of a vector."""
        match expression:
            case Apply(function="power", arguments=(base, _)):
                return self.torque(base)
            case Apply(function="multiply" | "dot", arguments=(first, second)):
                return self.torque(first) and self.torque(second)
            case Apply(function=function, arguments=arguments) if function in _ALIKE:
                return any(map(self._squared, arguments))
            case _:
                return False


def _stiffness(flattening: Flattening, expression: Expression) -> bool:
    match expression:
        case Literal(span=span):
            return "/rad" in span.text
        case Apply(function="negate", arguments=(inner,)) | Element(base=inner):
            return _stiffness(flattening, inner)
        case Name(name=name):
            member = flattening.variables.get(name)
            return member is not None and member.bound is None and _declared(member, "N.m/rad")
        case _:
            return False


def _declared(member: VariableMember, unit: str) -> bool:
    """Tell whether a variable is declared by a type or a value in a unit like this one."""
    declaration = member.declaration
    named = NAMED_TYPES.get(declaration.type)
    if named is not None:
        return named.unit == unit
    start = getattr(declaration, "start", None)
    node = start.value if isinstance(start, ast.Start) else getattr(declaration, "value", None)
    while isinstance(node, ast.Unary):
        node = node.operand
    written = getattr(node, "unit", "") or ""
    return "N." in written and ("/rad" in written) == ("/rad" in unit)
