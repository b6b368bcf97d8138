"""Families of contacts (``ContactFamily``): of pairs of shapes, and of two loops."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from mechc.lang import ast

from .. import types
from ..instances.frames import place_extents
from ..instances.instantiate import expand
from ..instances.members import definition_value, parameter_value, type_of
from ..instances.pair_loops import read_beside, read_of
from ..model import Contact, ContactFamily, Expression, Kind, Name
from ..names.instance import (
    DefinitionMember,
    Instance,
    PairLoop,
    PlaceMember,
    SetShape,
    VariableMember,
)
from ..subscripts import element_name, subscripts


class PairsOfShapes(Struct, frozen=True, eq=False):
    """Shapes of which each of ``rows`` touches each of ``columns`` from ``starts`` on by one part of a library; ``row`` touches all,
    and ``pair`` is it with the last one, in the order of the text. The rest is as in ``ContactFamily``."""

    pair: tuple[SetShape, SetShape]
    row: int
    rows: tuple[SetShape, ...]
    heads: tuple[str, ...]
    starts: tuple[int, ...]
    columns: tuple[SetShape, ...]
    labels: tuple[str, ...]
    common: tuple[Expression, ...]


def families_of_shapes(
    pairs: PairsOfShapes, instance: Instance, contacts: Sequence[Contact]
) -> list[ContactFamily]:
    """Return the families of the contacts of one part, which is that of the row and the last column."""
    read = {id(shape): read_of_shape(shape.instance) for shape in (*pairs.rows, *pairs.columns)}
    return [
        ContactFamily(
            contact.name,
            pairs.row,
            pairs.heads,
            pairs.starts,
            pairs.labels,
            contact.name.removeprefix(instance.path),
            tuple(read[id(shape)] for shape in pairs.rows),
            tuple(read[id(shape)] for shape in pairs.columns),
            pairs.common,
        )
        for contact in contacts
    ]


def kind_of_shape(shape: Instance) -> object | None:
    """Return what decides how a part for two shapes is elaborated, beside what it reads of them; None where that is not told."""
    expand(shape)
    told: list[object] = [id(shape.cls), tuple(sorted(shape.modifiers))]
    for name, member in shape.members.items():
        match member:
            case VariableMember(structural=True):
                type_of(member)
                parameter_value(member)
                told.append((name, getattr(member.constant, "value", None)))
                if getattr(member.constant, "value", None) is None:
                    return None
            case VariableMember():
                told.append((name, type_of(member).shape))
            case DefinitionMember():
                told.append((name, definition_value(member).type.shape))
            case PlaceMember():
                told.append((name, place_extents(member)))
            case _:
                return None
    return tuple(told)


def read_of_shape(shape: Instance) -> tuple[Expression, ...]:
    """Return all that a part for two shapes can read of one of them."""
    found: list[Expression] = []
    for member in shape.members.values():
        span = member.declaration.span
        match member:
            case VariableMember(structural=False):
                found.append(Name(type=type_of(member), span=span, name=member.name))
            case DefinitionMember():
                found.append(Name(type=definition_value(member).type, span=span, name=member.name))
            case PlaceMember():
                type = types.make(Kind.FRAME if isinstance(member.declaration, ast.Frame) else Kind.POINT)
                for index in subscripts(place_extents(member)):
                    found.append(Name(type=type, span=span, name=element_name(member.name, index)))
            case _:
                pass
    return tuple(found)


def numbers_in(values: Sequence[Expression]) -> tuple[Expression, ...]:
    """Return the values without texts, which choose among laws."""
    return tuple(value for value in values if value.type.kind is not Kind.STRING)


def family_of_loops(contact: ast.Contact, pairs: PairLoop, name: str) -> ContactFamily:
    """Return the family of a contact in two loops, which is that of the row and the last column."""
    outer, inner = pairs.turns
    rows, columns = (read_of(contact, name) for name in pairs.names)
    before = name.rpartition("[")[0]
    return ContactFamily(
        name,
        pairs.row,
        tuple(f"{before}[{turn}," for turn in outer),
        pairs.starts,
        tuple(map(str, inner)),
        "]",
        tuple(tuple(scope.elaborate(node) for node in rows) for scope in pairs.rows),
        tuple(tuple(scope.elaborate(node) for node in columns) for scope in pairs.columns),
        numbers_in([pairs.rows[pairs.row].elaborate(node) for node in read_beside(contact, pairs.names)]),
    )
