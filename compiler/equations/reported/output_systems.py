"""Systems of equations for outputs as a function of what is tried for them: runs follow their solutions, and look for others."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from mechc.runtime.interface import Quantity, SoughtOutputs

from ...graph import Node
from ...graph.elimination.newton import linearised
from ...mechanics.system import MechanicalSystem
from ..model import SOUGHT, Function, Slot, quantity
from ..solve.solved import Solved


class Systems(Struct, frozen=True):
    """``given``: what is tried, after the inputs, with the places of its symbols; the function stands alone."""

    plans: tuple[SoughtOutputs, ...] = ()
    given: tuple[Quantity, ...] = ()
    slots: Mapping[Node, Slot] = {}
    functions: tuple[Function, ...] = ()


def systems_of(system: MechanicalSystem, solved: Solved, outputs: tuple[Quantity, ...]) -> Systems:
    """Return the systems of a model, none where nothing in it is found by steps."""
    found = (*system.lowering.unknowns.systems, *system.sought)
    if not found:
        return Systems()
    graph = system.graph
    places = {entry.name: k for k, entry in enumerate(outputs)}
    plans, given, slots, nodes = list[SoughtOutputs](), list[Quantity](), dict[Node, Slot](), list[Node]()
    for one in found:
        names = [row.name for name in one.names for row in system.outputs if row.definition.name == name]
        names = names or list(one.names)  # of coordinates
        plans.append(SoughtOutputs(tuple(places[name] for name in names), len(one.rows)))
        matrix, sizes = linearised(graph, one.rows, one.unknowns)
        for name, symbol in zip(names, one.unknowns, strict=True):
            slots[symbol] = Slot("g", len(given))
            given.append(quantity(f"tried({name})", "given", ""))
        nodes += [*one.guess, *one.rows, *sizes, *(x for line in matrix for x in line)]
    doc = "guesses for unknown outputs; of values that are tried the residuals, their sizes and derivatives"
    return Systems(tuple(plans), tuple(given), slots, (Function(SOUGHT, doc, solved.resolve(nodes)),))
