"""Forces and moments of joints whose reactions are asked for, read from the residual along virtual displacements.

What these displacements are: ``mechanics/kinematics/reactions.py``.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...graph import Node
from ...graph.differentiate import vjp
from ...mechanics.system import MechanicalSystem
from ..rows.residual import energy_efforts, seeds_of


def joint_reactions(
    system: MechanicalSystem, multipliers: Sequence[Sequence[Node]]
) -> dict[str, tuple[tuple[Node, ...], tuple[Node, ...]]]:
    """Return (force, moment) on the ``to`` side of each joint that was asked for, in world components.

    The residual along the virtual rates of a tree joint is the force that moves what it carries. For a closure, where
    the joint alone is displaced, it is minus the force of its own multipliers and of what acts on its coordinates.
    """
    graph, kinematics = system.graph, system.kinematics
    closing = {joint.name for joint in system.topology.closures}
    result = {}
    along = [rate for moved in system.virtual.values() for rate in (*moved.force_rates, *moved.moment_rates)]
    found = iter(vjp(graph, seeds_of(system, multipliers), along) if along else ())
    for name, moved in system.virtual.items():
        efforts = [graph.add(next(found), share) for share in energy_efforts(system, moved)]
        if name in closing:
            efforts = [graph.neg(e) for e in efforts]
        size = kinematics.size
        force = kinematics.to_world(moved.frame, tuple(efforts[:size]))
        moment = tuple(efforts[size:])
        if size == 3:
            moment = kinematics.to_world(moved.frame, moment)
        result[name] = (tuple(force), tuple(moment))
    return result
