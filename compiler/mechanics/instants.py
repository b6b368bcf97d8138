"""What is true at single instants, ``sample()`` and ``initial()``, refused in all that is continuous; the past, refused in
what is a function of the present state."""

from __future__ import annotations

from collections.abc import Iterator

from mechc.lang.diagnostics import Reporter

from ..graph import Node
from .modes import Mode
from .system import MechanicalSystem


def check_instants(system: MechanicalSystem, reporter: Reporter) -> None:
    """Report instants outside of ``when``: at all times that count for what is continuous they would be false."""
    instants = system.lowering.instants
    found = system.graph.support(*_continuous(system)) if instants else []
    for symbol in (n for n in found if n in instants):
        span = instants[symbol]
        reporter.error(
            "E0721",
            f"'{span.text}' is true only at single instants, so it has no meaning here",
            span,
            caption="it belongs to the condition of a 'when'",
            help="set a 'discrete' variable there, and use that: 'when sample(T) then n := ...; end when;'",
        )


def check_past(system: MechanicalSystem, reporter: Reporter) -> None:
    """Report what depends on the past and cannot: energies and masses, constraints and drives, periods of clocks."""
    found = system.lowering.delays.found
    for nodes, what, caption, help in _of_the_present(system) if found else ():
        symbol = next((n for n in system.graph.support(*nodes) if n in found), None)
        if symbol is None:
            continue
        reporter.error(
            "E0582", f"{what} cannot depend on the past", found[symbol].span, caption=caption, help=help
        )


def _of_the_present(system: MechanicalSystem) -> Iterator[tuple[list[Node], str, str, str]]:
    """Yield formulas of the present state alone, with what they are, why, and what to do."""
    matter = [
        n for m in system.masses for n in (m.mass, *(m.field or ()), *system.kinematics.position(m.point))
    ]
    matter += [n for body in system.inertias for row in body.inertia for n in row]
    yield (
        [system.kinetic, system.potential, system.lagrangian, system.dissipation, *matter],
        "an energy, a mass or a place of a body",
        "forces are derivatives of energies with respect to the present state",
        "write the force itself, as in 'force -k*delay(x, T) on x;'",
    )
    tied = [n for rows in system.constraints for n in rows.residuals]
    tied += [n for drive in system.drives if not drive.balanced for n in (*drive.values, *drive.rates)]
    yield (
        tied,
        "a constraint, a contact or a prescribed motion",
        "its force follows from its second derivative, and what is delayed jumps",
        "let a force pull there, as in 'force k*(delay(y, T) - x) on x;'",
    )
    yield (
        [n for clock in system.lowering.clocks.values() for n in (clock.period, clock.start)],
        "the period of a clock",
        "it must be known before",
        "write a condition: 'when delay(x, T) > a then'",
    )


def _continuous(system: MechanicalSystem) -> Iterator[Node]:
    """Yield all formulas that are not those of events."""
    yield from (system.kinetic, system.potential, system.lagrangian, system.dissipation)
    for mass in system.masses:
        yield from (mass.mass, *(mass.field or ()), *system.kinematics.position(mass.point))
    for body in system.inertias:
        yield from (n for row in body.inertia for n in row)
        yield from system.kinematics.angular_velocity(body.frame)
    yield from (n for effort in system.efforts for pair in effort.pairs for n in pair)
    for rows in system.constraints:
        yield from rows.residuals
        if rows.mode is not None:
            yield from _of_mode(rows.mode)
    for drive in system.drives:
        yield from (*drive.values, *drive.rates)
    yield from system.xdot.values()
    yield from (row.node for row in system.outputs)
    yield from (row.node for row in system.exacts)
    yield from (row.condition for row in system.assertions)
    yield from (row.residual for row in system.initials)


def _of_mode(mode: Mode) -> Iterator[Node]:
    for n in (mode.kinetic, mode.static, mode.restitution, mode.rest):
        if n is not None:
            yield n
    if mode.smooth is not None:
        yield mode.smooth.side
