"""Everything that is reported beside the state: declared outputs, energies, momenta."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection

from msgspec import Struct

from mechc.runtime.interface import Quantity

from ...flat.model import Kind
from ...graph import Node
from ...mechanics.system import MechanicalSystem
from ..model import quantity
from ..solve.solved import Solved
from .entries import Layout, declared, momentum_unit
from .momenta import conserved_momenta


class OutputList(Struct, frozen=True):
    """``entries`` describe ``nodes``; ``conserved`` and ``energy_balance`` are indices into both (-1: absent)."""

    entries: tuple[Quantity, ...]
    nodes: tuple[Node, ...]
    conserved: tuple[int, ...]
    energy_balance: tuple[int, ...]


def list_outputs(
    system: MechanicalSystem, solved: Solved, layout: Layout, parts: Collection[str]
) -> OutputList:
    """Return the outputs of a model, prescribed coordinates first. ``parts``: see needs.py."""
    rows = _rows(system, solved, layout)
    if "reactions" in parts:
        rows += _multipliers(system, solved)
    if "positions" in parts:
        rows += _positions(system, layout)
    names = {entry.name: k for k, (entry, _) in enumerate(rows)}
    balance = ("energy.total", "energy.dissipated", "energy.supplied")
    return OutputList(
        tuple(entry for entry, _ in rows),
        tuple(n for _, n in rows),
        tuple(k for k, (entry, _) in enumerate(rows) if entry.kind == "momentum"),
        () if solved.energies.reason else tuple(names.get(name, -1) for name in balance),
    )


def _rows(system: MechanicalSystem, solved: Solved, layout: Layout) -> list[tuple[Quantity, Node]]:
    rows: list[tuple[Quantity, Node]] = []
    for drive in system.drives:
        rows += [(layout.entry(system.q[k], "coordinate"), system.q[k].node) for k in drive.q]
        rows += [
            (layout.entry(system.v[i], "rate", rate=True), system.v[i].node)
            for i in drive.v
            if not drive.balanced or _has_a_rate(system, solved, system.v[i].node)
        ]
    for row in system.outputs:
        unit = layout.length if row.definition.type.kind is Kind.POINT else None
        rows.append((declared(row.definition, row.name, "output", unit), row.node))
    energy = solved.energies
    joule = layout.energy
    rows += [
        (quantity("energy.kinetic", "energy", joule), energy.kinetic),
        (quantity("energy.potential", "energy", joule), energy.potential),
        (quantity("energy.total", "energy", joule), energy.total),
    ]
    for name in layout.accounts:
        rows.append((quantity(name, "energy", joule), layout.account_symbols[name]))
    rows += _creeps(system, layout)
    rows += _quadratures(system)
    described = {entry.name: entry for entry in (*layout.states, *(entry for entry, _ in rows))}
    for exact in system.exacts:
        unit = described[exact.name].unit
        display = described[exact.name].display
        span = exact.origin.span
        rows.append((quantity(f"exact({exact.name})", "exact", unit, display, span=span), exact.node))
    for i in energy.cyclic:
        scalar, momentum = system.v[i], energy.momenta[i]
        assert momentum is not None, "cyclic velocities are free"
        entry = quantity(f"momentum({scalar.of})", "momentum", momentum_unit(scalar, layout))
        rows.append((entry, momentum))
    cyclic = {entry.name for entry, _ in rows}
    known = [n for entry, n in rows if entry.kind == "momentum"]
    for name, unit, node in conserved_momenta(system, solved, layout.dimensionless):
        if name not in cyclic and not any(system.graph.equal_up_to_sign(node, n) for n in known):
            rows.append((quantity(name, "momentum", unit), node))
    return rows


def _has_a_rate(system: MechanicalSystem, solved: Solved, rate: Node) -> bool:
    """Tell whether a rate that a balance of forces gives is known: that of an input is not."""
    return system.unknown_rates.keys().isdisjoint(system.graph.support(*solved.resolve([rate])))


def _creeps(system: MechanicalSystem, layout: Layout) -> list[tuple[Quantity, Node]]:
    """Return the speeds of regularized frictions where they ought to stick; those of contacts while these are closed."""
    closed = {rows.name: rows.mode.flag for rows in system.constraints if rows.mode is not None}
    found: list[tuple[Quantity, Node]] = []
    for rows in system.constraints:
        mode = rows.mode
        if mode is None or mode.smooth is None or mode.smooth.creep is None:
            continue
        creep, name = mode.smooth.creep, mode.contact or rows.name
        if mode.contact:
            creep = system.graph.mul(closed[mode.contact], creep)
        unit = "" if layout.dimensionless else mode.smooth.unit
        found.append((quantity(f"creep({name})", "creep", unit), creep))
    return found


def _quadratures(system: MechanicalSystem) -> list[tuple[Quantity, Node]]:
    """Return the estimated relative errors of the definite integrals.

    Of those in energies and constraints, and of all whose rates are formed, that of their slopes counts, too.
    """
    graph = system.graph
    found: dict[str, tuple[Quantity, Node]] = {}
    energies = (system.kinetic, system.potential, system.lagrangian, system.dissipation)
    sloping = set(graph.reach([*energies, *(n for rows in system.constraints for n in rows.residuals)]))
    changing = {system.symbols.time, *(s.node for s in (*system.q, *system.v)), *system.xdot}
    for integral in system.lowering.integrals.errors.values():
        text = " ".join(integral.span.text.split())
        name = text if text not in found else f"{text}, {len(found) + 1}"
        error = integral.error
        if integral.inside in sloping or system.rate.formed(integral.inside):
            along = [n for n in graph.support(integral.inside) if n in changing]
            error = graph.maximum(error, integral.slope(along))
        found[name] = (quantity(f"error({name})", "quadrature", "", span=integral.span), error)
    return list(found.values())


def _multipliers(system: MechanicalSystem, solved: Solved) -> list[tuple[Quantity, Node]]:
    """Return the force of every constraint, whether anything asks for it or not."""
    rows = [row for row in solved.all_rows if row.multiplier in solved.replace]
    count: Counter[str] = Counter()
    found: list[tuple[Quantity, Node]] = []
    for row in rows:
        count[row.title] += 1  # equations of one closure have its name
        number = f", {count[row.title]}" if count[row.title] > 1 else ""
        found.append((quantity(f"multiplier({row.title}{number})", "output", ""), row.multiplier))
    return found


def _positions(system: MechanicalSystem, layout: Layout) -> list[tuple[Quantity, Node]]:
    """Return the place of every mass in the world."""
    found: list[tuple[Quantity, Node]] = []
    for number, mass in enumerate(system.masses, start=1):
        position = system.kinematics.position(mass.point)
        names = [f"mass({number})[{k}]" for k in range(1, len(position) + 1)]
        found += [
            (quantity(name, "output", layout.length), n) for name, n in zip(names, position, strict=True)
        ]
    return found
