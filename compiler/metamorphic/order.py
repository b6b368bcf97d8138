"""Statements, components and operands in another order."""

from __future__ import annotations

from random import Random
from typing import TypeVar

from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter

from ..flat.model import Apply, Expression, FlatModel, Kind
from ..flat.operands import with_operands
from ..mechanics.kinematics.topology import classify
from .rewriting import rewritten, undrawn
from .twin import Seen, Twin

SHUFFLED = ("variables", "definitions", "energies", "masses", "inertias", "loads", "dampings", "frictions", "constraints",
            "drives", "contacts", "initials", "equations")  # fmt: skip
"""Not events, whose order counts where they act in one instant."""
T = TypeVar("T")


def in_another_order(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Shuffle statements, and components where their joints span a tree; turn round sums and products."""
    changed = {name: _shuffled(getattr(model, name), random) for name in SHUFFLED}
    words = "statements and operands in another order"
    if not classify(model, Reporter()).closures:
        changed["joints"] = _shuffled(model.joints, random)
    else:
        words += ", joints in theirs, as it says which ones close loops"
    return Twin("another order", words, rewritten(replace(undrawn(model), **changed), _turned_round))


def _shuffled(many: tuple[T, ...], random: Random) -> tuple[T, ...]:
    """Return another order, as soon as there is one."""
    order = list(many)
    random.shuffle(order)
    if order == list(many):
        order.reverse()
    return tuple(order)


def _turned_round(e: Expression) -> Expression:
    match e:
        case Apply(function="add" | "multiply", arguments=(a, b)):
            plain = all(x.type.kind in (Kind.REAL, Kind.INTEGER) and not x.type.shape for x in (a, b))
            return with_operands(e, (b, a)) if plain else e
        case _:
            return e
