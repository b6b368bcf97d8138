"""A body that runs across a step of a potential, up or down, within a motion by definition; of a Lagrangian, too."""

from __future__ import annotations

from random_models.bends import body
from random_models.operators import choose, negate, relation
from random_models.scope import Scope, rare
from random_models.tree import ENERGY, LENGTH, Slot, node

SHARE = 0.05
"""Of the models."""


@rare(SHARE)
def steps(s: Scope) -> None:
    """Write one."""
    x = body(s, s.number(-0.25, -0.08), s.number(0.8, 1.6))
    height, zero = s.literal(ENERGY, s.number(-0.6, 0.9)), node("number", "0", value=lambda: 0)
    edge = s.literal(LENGTH, s.number(-0.02, 0.06))
    beyond = relation(s.pick((">", ">=")), x, edge)
    law = choose(beyond, height, zero) if s.chance(0.6) else choose(relation("<", x, edge), zero, height)
    if s.chance(0.7):
        s.add("energy", "potential ", Slot("potential", law), ";", data={"what": "potential"})
    else:
        s.add("energy", "lagrangian ", Slot("lagrangian", negate(law)), ";", data={"what": "lagrangian"})
