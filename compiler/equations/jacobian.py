"""The Jacobian of the rates: which of its entries can differ from zero, and what these are."""

from __future__ import annotations

from collections.abc import Sequence

from ..graph.differentiate import jacobian
from ..mechanics.system import MechanicalSystem
from .model import Function
from .reported.entries import Layout


def jacobian_of_rates(
    system: MechanicalSystem, layout: Layout, functions: Sequence[Function]
) -> tuple[Function, tuple[tuple[int, int], ...]]:
    """Return the function of the entries of d(rhs)/dy that can differ from zero, and their places."""
    rhs = next(f for f in functions if f.name == "rhs")
    states = [n for n, slot in layout.slots.items() if slot.array == "y"]
    rows = jacobian(system.graph, rhs.outputs, states)
    still = layout.without_effect
    entries = [
        (i, j, n) for i, row in enumerate(rows) for j, n in sorted(row.items()) if states[j] not in still
    ]
    function = Function(
        "jacobian", "entries of d(rhs)/dy that can differ from zero", tuple(n for *_, n in entries)
    )
    return function, tuple((i, j) for i, j, _ in entries)
