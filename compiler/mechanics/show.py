"""The text of ``mechc show system``: the Lagrangian record."""

from __future__ import annotations

from collections.abc import Iterator

from ..graph import Node
from ..graph.show import show_formulas
from .system import Curve, MechanicalSystem


def show(system: MechanicalSystem) -> str:
    """Return coordinates, joints, bodies, energies, forces, constraints and drives."""
    return "\n".join(_lines(system)) + "\n"


def _lines(system: MechanicalSystem) -> Iterator[str]:
    yield f"system {system.model.name}, {_space(system)}"
    for coordinate in system.symbols.coordinates:
        names = ", ".join(scalar.name for scalar in coordinate.q)
        rates = ", ".join(scalar.name for scalar in coordinate.v)
        kind = "rotation" if coordinate.is_rotation else "coordinate"
        yield f"  {kind} {names} with rate {rates}"
    for scalar in system.symbols.states:
        yield f"  state {scalar.name}"
    for edge in system.topology.tree:
        joint = edge.joint
        ends = f"{joint.target} -> {joint.source}" if edge.backwards else f"{joint.source} -> {joint.target}"
        yield f"  joint {joint.name or ends}: {ends}" if joint.name else f"  weld {ends}"
    for joint in system.topology.closures:
        yield f"  loop closed by {joint.name}: {joint.source} -> {joint.target}"
    formulas = list(_formulas(system))
    if formulas:
        yield ""
        yield from (f"  {line}" for line in show_formulas(system.graph, formulas))


def _space(system: MechanicalSystem) -> str:
    return {2: "in the plane", 3: "in space"}.get(system.model.space, "without vectors")


def _formulas(system: MechanicalSystem) -> Iterator[tuple[str, Node]]:
    """Yield the named formulas of the record."""
    graph, axes = system.graph, "xyz"
    for i, mass in enumerate(system.masses, start=1):
        yield f"mass {i}", mass.mass
        for axis, node in zip(axes, system.kinematics.position(mass.point), strict=False):
            yield f"mass {i} at {axis}", node
    for i, body in enumerate(system.inertias, start=1):
        for row, nodes in enumerate(body.inertia, start=1):
            for column, node in enumerate(nodes, start=1):
                if column >= row and not graph.is_zero(node):
                    yield f"inertia {i}[{row},{column}]", node
    energies = (
        ("kinetic energy of formulas", system.kinetic),
        ("potential energy of formulas", system.potential),
        ("further Lagrangian", system.lagrangian),
        ("dissipation function", system.dissipation),
    )
    for name, node in energies:
        if not graph.is_zero(node):
            yield name, node
    if system.curve is not None:
        yield from _of_curve(system.curve)
    for i, effort in enumerate(system.efforts, start=1):
        for rate, value in effort.pairs:
            yield f"force {effort.name or i} on a rate", rate
            yield f"force {effort.name or i}", value
    for constraint in system.constraints:
        for i, node in enumerate(constraint.residuals, start=1):
            yield f"{constraint.level} constraint {constraint.name}[{i}]", node
    for drive in system.drives:
        for k, node in zip(drive.q, drive.values, strict=True):
            yield f"drive of {system.q[k].name}", node
        for i, node in zip(drive.v, drive.rates, strict=True):
            yield f"drive of {system.v[i].name}", node
    for variable, rate in system.xdot.items():
        yield f"d/dt {graph.name(variable)}", rate


def _of_curve(curve: Curve) -> Iterator[tuple[str, Node]]:
    """Yield the range, what is stationary, the numbers of the whole, and the conditions at ends, along and on the whole."""
    yield "lower end of the range", curve.lower
    yield "upper end of the range", curve.upper
    yield "stationary", curve.functional
    for number in curve.numbers:
        yield f"{'integrand' if number.place is None else 'value'} of {number.name}", number.node
        if number.place is not None:
            yield "  at", number.place
    for rows in curve.rows:
        where = (
            "at every place" if rows.on_the_curve else "of the whole" if rows.upper is None else "at an end"
        )
        kind = "inequality" if rows.bound else "condition"
        for i, node in enumerate(rows.residuals, start=1):
            name = f"{rows.name}[{i}]" if len(rows.residuals) > 1 else rows.name
            yield f"{kind} {where}, {name}", node
