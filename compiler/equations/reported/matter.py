"""Masses and moments of inertia where they are, for studies that ask for the inertia of assemblies."""

from __future__ import annotations

from msgspec import Struct

from mechc.runtime.interface import Quantity

from ...graph import Node
from ...mechanics.system import MechanicalSystem
from ..model import Function, quantity
from ..solve.solved import Solved
from .entries import Layout


class MatterFunctions(Struct, frozen=True):
    """``entries``: one for each mass (kind mass: the number, then its place) and inertia (kind inertia: the tensor in the axes of the
    world, row by row; in the plane one number), named by the body."""

    entries: tuple[Quantity, ...]
    functions: tuple[Function, ...]


def matter_of(system: MechanicalSystem, solved: Solved, layout: Layout) -> MatterFunctions:
    """Return all masses of a model at a state."""
    kinematics = system.kinematics
    entries: list[Quantity] = []
    nodes: list[Node] = []
    pure = layout.dimensionless
    for mass in system.masses:
        entries.append(
            quantity(_body(mass.origin.instance), "mass", "" if pure else "kg", span=mass.origin.span)
        )
        nodes += [mass.mass, *kinematics.position(mass.point)]
    for body in system.inertias:
        unit = "" if pure else "kg.m^2"
        entries.append(quantity(_body(body.origin.instance), "inertia", unit, span=body.origin.span))
        if kinematics.size == 2:
            nodes.append(body.inertia[0][0])
            continue
        columns = [kinematics.to_world(body.frame, tuple(row[k] for row in body.inertia)) for k in range(3)]
        for k in range(3):
            nodes += kinematics.to_world(body.frame, tuple(column[k] for column in columns))
    functions = (Function("matter", "masses with their places, inertias", solved.resolve(nodes)),)
    return MatterFunctions(tuple(entries), functions if nodes else ())


def _body(instance: str) -> str:
    return instance or "model"
