"""Whether the accelerations are determined, asked at every state of a run where constraints have weights.

Parameters and states may leave a motion that moves no mass and that no constraint holds. Its pivot is what rounding leaves
of zero, and the accelerations made with it are numbers all the same. So the model asserts that there is none.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from ...graph import Node
from ...graph.differentiate import jacobian
from ...graph.elimination.eliminate import Elimination
from ...mechanics.system import AssertionRow, MechanicalSystem

ROUNDING = Fraction(1, 10**14)
"""Share of the terms of a sum below which the sum is rounding."""


def determined(
    system: MechanicalSystem, balance: Sequence[Node], free: Sequence[int], found: Elimination
) -> tuple[AssertionRow, ...]:
    """Return assertions that the pivots of accelerations are no rounding; ``balance``: the equations they were found in."""
    graph = system.graph
    entries = jacobian(graph, balance, [system.a[i] for i in free])
    asserted = []
    for k, row, pivot in zip(found.order, found.rows, found.pivots, strict=True):
        if k < len(free) and row == k:
            least = graph.mul(graph.constant(ROUNDING), entries[k].get(k, graph.zero))
            scalar = system.v[free[k]].variable
            message = f"some motion with '{scalar.name}' moves no mass, and no constraint decides it"
            asserted.append(AssertionRow(graph.less(least, pivot), message, scalar.origin))
    return tuple(asserted)
