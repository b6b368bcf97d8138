"""Arrays of FMI 3: scalars of the table that make one variable with dimensions, and their names."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

import numpy as np
from msgspec import Struct

from mechc.runtime.problem import Array

from .variables import FmuVariable, VariableTable

_ELEMENT = re.compile(r"(?P<base>(?:der\()?[\w.]+)\[(?P<index>\d+(?:,\d+)*)\](?P<rest>(?:,\d+)?\)?)")


class Group(Struct, frozen=True):
    """A variable of the file: positions of its scalars in the table, row by row; ``shape`` is empty for a scalar."""

    name: str
    members: tuple[int, ...]
    shape: tuple[int, ...] = ()


def scalars(table: VariableTable) -> tuple[Group, ...]:
    """Return each scalar as a variable of its own."""
    return tuple(Group(v.name, (v.index,)) for v in table.variables)


def grouped(table: VariableTable) -> tuple[Group, ...]:
    """Return the variables with arrays for scalars that are alike, whose references follow each other.

    An array of derivatives belongs to an array of states; event indicators and discrete variables stay scalars.
    """
    groups = list(_by_name(table))
    while True:
        of = {k: g for g in groups for k in g.members}
        broken = set()
        for g in groups:
            targets = tuple(table.at(k).derivative for k in g.members)
            states = {of[t].name: of[t] for t in targets if t}
            if any(s.members != targets for s in states.values()):
                broken |= {g.name, *states}
        split = [g for g in groups if g.shape and g.name in broken]
        if not split:
            return tuple(groups)
        groups = [
            part
            for g in groups
            for part in ([Group(table.at(k).name, (k,)) for k in g.members] if g in split else [g])
        ]


def _by_name(table: VariableTable) -> Iterator[Group]:
    variables = table.variables
    start = 0
    while start < len(variables):
        group = _array_at(table, start)
        yield group
        start += len(group.members)


def _array_at(table: VariableTable, start: int) -> Group:
    """Return the longest complete array that begins at a position, else the scalar."""
    variables = table.variables
    first = variables[start]
    found = _ELEMENT.fullmatch(first.name)
    alone = Group(first.name, (first.index,))
    if not found or first.entry.type != "real" or first.index in table.indicators:
        return alone
    indices: list[tuple[int, ...]] = []
    for offset, v in enumerate(variables[start:]):
        same = _ELEMENT.fullmatch(v.name)
        if not same or same["base"] != found["base"] or same["rest"] != found["rest"]:
            break
        if v.reference != first.reference + offset or _traits(v) != _traits(first):
            break
        indices.append(tuple(int(i) for i in same["index"].split(",")))
    shape = tuple(max(axis) for axis in zip(*indices, strict=True))
    if len(indices) < 2 or indices != list(product(*(range(1, n + 1) for n in shape))):
        return alone
    members = tuple(v.index for v in variables[start : start + len(indices)])
    return Group(found["base"] + found["rest"], members, shape)


def _traits(v: FmuVariable) -> tuple[object, ...]:
    """Return what the elements of an array have in common."""
    e = v.entry
    return (
        (
            v.causality,
            v.variability,
            v.initial,
            v.reinit,
            v.start is None,
            v.nominal is None,
            v.derivative == 0,
        ),
        (e.unit, e.display, e.kind, e.type, e.minimum, e.maximum),
    )


def sizes(groups: tuple[Group, ...], table: VariableTable) -> list[int]:
    """Return the number of elements by value reference; 0 where it is inside an array or of nothing."""
    result = [0] * (1 + max(v.reference for v in table.variables))
    for g in groups:
        result[table.at(g.members[0]).reference] = len(g.members)
    return result


def element_names(name: str, shape: tuple[int, ...]) -> list[str]:
    """Return the names of the elements: of ``der(r)`` with two, ``der(r[1])`` and ``der(r[2])``."""
    if not shape:
        return [name]
    base, rest = name, ""
    if found := re.fullmatch(r"(der\([\w.]+)((?:,\d+)?\))", name):
        base, rest = found[1], found[2]
    return [f"{base}[{','.join(map(str, i))}]{rest}" for i in product(*(range(1, n + 1) for n in shape))]


def length(variable: Any) -> int:
    """Return the number of elements of a variable as fmpy describes it."""
    return math.prod(variable.shape or ())


def flattened(result: Any) -> Mapping[str, Array]:
    """Return the columns of a result of fmpy, one for each element, by name."""
    columns: dict[str, Array] = {}
    for name in result.dtype.names:
        values = np.array([np.ravel(np.asarray(v, dtype=np.float64)) for v in result[name]])
        names = element_names(name, result.dtype[name].shape)
        columns |= dict(zip(names, values.T, strict=True))
    return columns
