"""What a text does not say and the compiler knows: units of formulas, values of parameters, sizes of arrays."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from msgspec import Struct

from ..compiler.flat.model import FlatModel, Kind, Role, Type, Variable
from ..compiler.flat.values.evaluate import Value, constant
from ..lang import ast
from ..lang.units import parse_unit, preferred_unit
from .document import Document
from .hover import types_in


class Inlay(Struct, frozen=True):
    """``text``, shown at an offset between the characters of the text; ``about`` says in words what it is."""

    offset: int
    text: str
    about: str


class _Known(Struct, frozen=True):
    """What the compiler knows of a model, by names: types, variables, default values of parameters."""

    types: Mapping[str, Type]
    variables: Mapping[str, Variable]
    values: Mapping[str, Value]


def inlays(document: Document, start: int, end: int) -> list[Inlay]:
    """Return what is shown between [start, end); nothing for a text that cannot be read."""
    found: list[Inlay] = []
    knowledge: dict[str, _Known] = {}
    for model, statement in () if document.broken else document.statements():
        flat = document.flat_of(model)
        if flat is None or not isinstance(statement, ast.Declaration) or isinstance(statement, ast.Component):
            continue
        if statement.span.end < start or statement.span.start > end:
            continue
        if model not in knowledge:
            knowledge[model] = _Known(types_in(flat), {v.name: v for v in flat.variables}, values_of(flat))
        known = knowledge[model]
        type = known.types.get(statement.name)
        if type is not None:
            found += [*_sizes(statement, type), *_units(statement, type), *_values(statement, known)]
    return sorted(found, key=lambda inlay: inlay.offset)


def values_of(flat: FlatModel) -> Mapping[str, Value]:
    """Return the default values in SI of the parameters whose values follow from constants and from each other."""
    parameters = [v for v in flat.variables if v.role is Role.PARAMETER and v.value is not None]
    known: dict[str, Value] = {}
    while True:
        new = {
            v.name: value
            for v in parameters
            if v.name not in known and v.value is not None and (value := constant(v.value, known)) is not None
        }
        if not new:
            return known
        known |= new


def _sizes(statement: ast.Declaration, type: Type) -> list[Inlay]:
    """Say how many elements an array has, where a formula gives its size."""
    if not statement.dimensions or all(d.span.text.strip().isdigit() for d in statement.dimensions):
        return []
    shape = type.shape[-len(statement.dimensions) :]
    text = ", ".join(str(size) for size in shape)
    return [Inlay(statement.dimensions[-1].span.end, f" = {text}", "number of elements")] if shape else []


def _units(statement: ast.Declaration, type: Type) -> list[Inlay]:
    """Say the unit of a formula whose declaration names no type."""
    if not isinstance(statement, ast.Let | ast.Output) or statement.type or type.kind is not Kind.REAL:
        return []
    unit = preferred_unit(type.dimension, type.angle)
    if unit == "1":
        return []
    end = max([statement.name_span.end, *(d.span.end + 1 for d in statement.dimensions)])
    return [Inlay(end, f" [{unit}]", "unit of the formula")]


def _values(statement: ast.Declaration, known: _Known) -> list[Inlay]:
    """Say the value of a parameter that a formula of others gives."""
    if not isinstance(statement, ast.Parameter) or statement.value is None or _is_plain(statement.value):
        return []
    variable, value = known.variables.get(statement.name), known.values.get(statement.name)
    if variable is None or not isinstance(value, Fraction):
        return []
    return [Inlay(statement.value.span.end, f" = {_shown(value, variable)}", "default value")]


def _is_plain(value: ast.Expression) -> bool:
    """Whether a value is a number as it stands, with or without a sign and a unit."""
    return isinstance(value.operand if isinstance(value, ast.Unary) else value, ast.Number | ast.Quantity)


def _shown(value: Fraction, variable: Variable) -> str:
    unit = variable.attributes.display or preferred_unit(variable.type.dimension, variable.type.angle)
    number = float(value) / float(parse_unit(unit).factor)
    return f"{number:.6g}" if unit == "1" else f"{number:.6g} {unit}"
