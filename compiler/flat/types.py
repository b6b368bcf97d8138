"""Types of flat expressions: one object for each type, and their names in the words of the user."""

from __future__ import annotations

import re
from fractions import Fraction

from msgspec.structs import replace

from mechc.lang.units import DIMENSIONLESS, NAMED_TYPES, Dimension, preferred_unit

from .model import Array, Expression, Kind, Literal, Select, Type

_KNOWN: dict[tuple[str, tuple[int, ...], Dimension, bool], Type] = {}


def make(
    kind: Kind,
    shape: tuple[int, ...] = (),
    dimension: Dimension = DIMENSIONLESS,
    angle: bool = False,
) -> Type:
    """Return the type; equal types are one object, so that rules can be cached by identity."""
    key = (kind._value_, shape, dimension, angle)  # `value` is a property of Python, and types are made often
    found = _KNOWN.get(key)
    if found is None:
        found = _KNOWN[key] = Type(kind, shape, dimension, angle)
    return found


def real(dimension: Dimension = DIMENSIONLESS, shape: tuple[int, ...] = (), angle: bool = False) -> Type:
    return make(Kind.REAL, shape, dimension, angle)


def _dimension(name: str) -> Dimension:
    return NAMED_TYPES[name].dimension


NUMBER = real()
ANGLE = real(angle=True)
INTEGER = make(Kind.INTEGER)
BOOLEAN = make(Kind.BOOLEAN)
STRING = make(Kind.STRING)
ROTATION = make(Kind.ROTATION)
POSE = make(Kind.POSE)
FRAME = make(Kind.FRAME)

LENGTH = _dimension("Length")
MASS = _dimension("Mass")
TIME = _dimension("Time")
VELOCITY = _dimension("Velocity")
ACCELERATION = _dimension("Acceleration")
FORCE = _dimension("Force")
ENERGY = _dimension("Energy")
POWER = _dimension("Power")
ACTION = _dimension("Action")
INERTIA = _dimension("Inertia")
RATE = _dimension("Frequency")
MOMENTUM = _dimension("Momentum")

NUMERIC = (Kind.REAL, Kind.INTEGER, Kind.POINT)
"""Kinds that arithmetic works on; a point stands for its position in world components."""


def with_shape(type: Type, shape: tuple[int, ...]) -> Type:
    return type if type.shape == shape else make(type.kind, shape, type.dimension, type.angle)


def element_of(type: Type, depth: int = 1) -> Type:
    """Return the type after ``depth`` indices; the components of a point are lengths."""
    shape = type.shape[depth:]
    if type.kind is Kind.POINT and not shape:
        return real(type.dimension)
    if type.kind is Kind.ROTATION:
        return NUMBER
    return with_shape(type, shape)


def numeric(type: Type) -> Type:
    """Return the type that arithmetic sees: a point is a vector of lengths, a whole number a number."""
    if type.kind in (Kind.POINT, Kind.INTEGER):
        return make(Kind.REAL, type.shape, type.dimension, type.angle)
    return type


def is_zero(expression: Expression) -> bool:
    """Tell whether an expression is the bare ``0`` (an array of them, or a choice), which fits every dimension."""
    if isinstance(expression, Literal):
        kind = expression.type
        return (
            expression.value == 0
            and not isinstance(expression.value, bool)
            and kind.dimension.is_none
            and not kind.angle
        )
    if isinstance(expression, Select):
        return is_zero(expression.then) and is_zero(expression.otherwise)
    return isinstance(expression, Array) and all(is_zero(e) for e in expression.elements)


def retyped_zero(expression: Expression, dimension: Dimension, angle: bool) -> Expression:
    """Return a bare zero as a quantity of the dimension that is wanted."""
    if isinstance(expression, Literal):
        return Literal(type=make(Kind.REAL, (), dimension, angle), span=expression.span, value=Fraction(0))
    if isinstance(expression, Select):
        return replace(
            expression,
            type=make(Kind.REAL, expression.type.shape, dimension, angle),
            then=retyped_zero(expression.then, dimension, angle),
            otherwise=retyped_zero(expression.otherwise, dimension, angle),
        )
    assert isinstance(expression, Array)
    elements = tuple(retyped_zero(e, dimension, angle) for e in expression.elements)
    return Array(
        type=make(Kind.REAL, expression.type.shape, dimension, angle), span=expression.span, elements=elements
    )


# ---------------------------------------------------------------- words

_IRREGULAR = {"Real": "number", "Integer": "whole number", "Boolean": "truth value", "Frequency": "rate"}
_PREFERRED = ("Real", "Length", "Mass", "Time", "Velocity", "Acceleration", "Force", "Energy", "Frequency")


def _words_for_dimensions() -> dict[tuple[Dimension, bool], str]:
    words: dict[tuple[Dimension, bool], str] = {}
    for name in (*_PREFERRED, *NAMED_TYPES):
        named = NAMED_TYPES[name]
        words.setdefault((named.dimension, named.angle), _word(name))
    return words


def _word(name: str) -> str:
    return _IRREGULAR.get(name) or re.sub(r"(?<=.)([A-Z])", r" \1", name).lower()


_WORDS = _words_for_dimensions()


def dimension_word(dimension: Dimension, angle: bool = False) -> str:
    """Return ``length``, ``force``, ``quantity`` where the dimension has no name."""
    return _WORDS.get((dimension, angle)) or _WORDS.get((dimension, False)) or "quantity"


def _word_of_unit(unit: str) -> str:
    """Return ``torque`` for N.m; ``quantity`` for a unit that no type has."""
    return next((_word(name) for name, named in NAMED_TYPES.items() if named.unit == unit), "quantity")


def with_article(noun: str) -> str:
    return f"{'an' if noun[:1] in 'aeio' else 'a'} {noun}"


def unit_words(dimension: Dimension, angle: bool = False, unit: str = "") -> str:
    """Return ``a length (m)``, ``a number``, ``a quantity in kg^2``; with ``unit``, in which it is declared, ``a torque (N.m)``."""
    if dimension.is_none:
        return "an angle" if angle else "a number"
    usual = preferred_unit(dimension, angle)
    word = _word_of_unit(unit) if unit not in ("", usual) else dimension_word(dimension, angle)
    unit = unit or usual
    return f"a quantity in {unit}" if word == "quantity" else f"{with_article(word)} ({unit})"


def describe(type: Type, unit: str = "") -> str:
    """Return what a type is in the words of the user: ``a length (m)``, ``a vector of 2 lengths (m)``; ``unit`` as in ``unit_words``."""
    match type.kind:
        case Kind.BOOLEAN | Kind.STRING | Kind.ROTATION | Kind.POSE | Kind.FRAME:
            noun = {
                Kind.BOOLEAN: "truth value",
                Kind.STRING: "text",
                Kind.ROTATION: "rotation",
                Kind.POSE: "pose",
                Kind.FRAME: "frame",
            }[type.kind]
            return f"an array {shape_text(type.shape)} of {noun}s" if type.shape else with_article(noun)
        case Kind.POINT:
            return "a point" if len(type.shape) == 1 else f"an array {shape_text(type.shape[:-1])} of points"
        case Kind.REAL | Kind.INTEGER:
            whole = type.kind is Kind.INTEGER
            single = "a whole number" if whole else unit_words(type.dimension, type.angle, unit)
            if not type.shape:
                return single
            many = _plural(single)
            if len(type.shape) == 1:
                return f"a vector of {type.shape[0]} {many}"
            return f"an array {shape_text(type.shape)} of {many}"


def _plural(single: str) -> str:
    noun, _, unit = single.partition(" ")[2].partition(" (")
    if noun.startswith("quantity in"):
        plural = noun.replace("quantity", "quantities")
    elif noun.endswith("y") and noun[-2] not in "aeiou":
        plural = noun[:-1] + "ies"
    else:
        plural = noun + ("es" if noun.endswith("s") else "s")
    return f"{plural} ({unit}" if unit else plural


def shape_text(shape: tuple[int, ...]) -> str:
    """Return ``[2, 3]``; a scalar is ``[]``."""
    return f"[{', '.join(map(str, shape))}]"
