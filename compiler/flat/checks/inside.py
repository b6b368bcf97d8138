"""What stands in each statement of a model, listed once for all who look for oversights."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from msgspec import Struct

from mechc.lang import ast

from ..names.classes import Stated
from ..names.instance import Instance
from ..names.space import branches_of


class Inside(Struct, frozen=True):
    """A statement, and the nodes in it that somebody looks at, in the order of the text."""

    stated: Stated
    references: list[ast.Reference]
    modifications: list[ast.Modification]
    calls: list[ast.Call]
    quantities: list[ast.Quantity]
    declared: list[ast.Parameter | ast.Input]


_PLACES: dict[type[ast.Node], int] = {
    ast.Reference: 0,
    ast.Modification: 1,
    ast.Call: 2,
    ast.Quantity: 3,
    ast.Parameter: 4,
    ast.Input: 4,
}
_rules: dict[type[ast.Node], tuple[int, tuple[str, ...]]] = {}
"""Where nodes of a kind are listed, -1 for nowhere, and the fields in which nodes may stand, last ones first."""


def inside_of(instance: Instance) -> Sequence[Inside]:
    """List the nodes of each statement of a model, inherited ones too."""
    return [inside(stated) for stated in instance.cls.statements]


def inside(stated: Stated) -> Inside:
    """List the nodes of a statement."""
    return Inside(stated, *listed(stated.statement))


def listed(node: ast.Node) -> tuple[list[Any], ...]:
    """List a node and what stands in it by the places of ``_PLACES``; much of the time of a large model is spent here."""
    found: tuple[list[Any], ...] = ([], [], [], [], [])
    pending = [node]
    while pending:
        at = pending.pop()
        place, branches = _rules.get(at.__class__) or _rule(at.__class__)
        if place >= 0:
            found[place].append(at)
        if place == 0:
            pending += [i for part in at.parts[::-1] for i in part.indices[::-1]]  # type: ignore[attr-defined]
            continue
        for name in branches:
            value = getattr(at, name)
            if value.__class__ is tuple:
                pending += [v for v in value[::-1] if isinstance(v, ast.Node)]
            elif isinstance(value, ast.Node):
                pending.append(value)
    return found


def _rule(kind: type[ast.Node]) -> tuple[int, tuple[str, ...]]:
    rule = _rules[kind] = (_PLACES.get(kind, -1), branches_of(kind)[::-1])
    return rule
