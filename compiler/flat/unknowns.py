"""Outputs that equations determine: which belong together with which equations."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod

from msgspec import Struct

from .model import Expression, FlatModel, ImplicitEquation, Unknown, UnknownOutput
from .operands import free_names, parts, stated

_ANSWERS = ("definitions", "assertions", "exacts", "draws", "implicit", "unknowns")
"""Fields of a model on which its motion does not depend."""


class UnknownGroup(Struct, frozen=True):
    """Unknowns that share equations; ``count`` of numbers, ``rows`` of equations between numbers."""

    unknowns: tuple[UnknownOutput, ...]
    equations: tuple[ImplicitEquation, ...]
    count: int
    rows: int

    @property
    def words(self) -> str:
        return ", ".join(f"'{u.name}'" for u in self.unknowns)


def unknowns_in(value: object, definitions: Mapping[str, Expression | None]) -> dict[str, None]:
    """Return the names of the unknown outputs that enter an expression, directly or through definitions."""
    found: dict[str, None] = {}
    seen: set[str] = set()
    pending = [value]
    while pending:
        at = pending.pop()
        if isinstance(at, Unknown):
            found[at.name] = None
            continue
        if at is None:
            continue
        for name in free_names(at):  # type: ignore[arg-type]
            if name in definitions and name not in seen:
                seen.add(name)
                pending.append(definitions[name])
        pending.extend(e for e in parts([at]) if isinstance(e, Unknown))  # type: ignore[list-item]
    return found


def felt(model: FlatModel) -> frozenset[str]:
    """Return the names of the unknown outputs on which the motion depends."""
    if not model.unknowns:
        return frozenset()
    definitions = {d.name: d.value for d in model.definitions}
    fields = (getattr(model, f) for f in model.__struct_fields__ if f not in _ANSWERS)
    return frozenset(n for field in fields for e in stated(field) for n in unknowns_in(e, definitions))


def groups(model: FlatModel) -> tuple[UnknownGroup, ...]:
    """Return the systems of equations, each with its unknowns, in the order of declaration."""
    definitions = {d.name: d.value for d in model.definitions}
    sizes = {d.name: prod(d.type.shape) for d in model.definitions}
    leader = {u.name: u.name for u in model.unknowns}

    def first(name: str) -> str:
        while leader[name] != name:
            name = leader[name]
        return name

    entering = [
        [*unknowns_in(e.left, definitions) | unknowns_in(e.right, definitions)] for e in model.implicit
    ]
    for names in entering:
        for other in names[1:]:
            leader[first(other)] = first(names[0])
    result = []
    for head in dict.fromkeys(first(u.name) for u in model.unknowns):
        members = tuple(u for u in model.unknowns if first(u.name) == head)
        equations = tuple(
            e for e, names in zip(model.implicit, entering, strict=True) if names and first(names[0]) == head
        )
        count = sum(sizes[u.name] for u in members)
        result.append(
            UnknownGroup(members, equations, count, sum(prod(e.left.type.shape) for e in equations))
        )
    return tuple(result)
