"""Whether prescribed motions are smooth enough: positions must not jump, nor the rates of drives.

A drive takes its coordinate out of the equations, so nothing would tell the others of the impulse that a jump of its
rate is. Where formulas may jump they compare times, or take whole parts of them; each of these is followed through
time, for the default values of the parameters, and where it changes the formula is looked at on both sides.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import chain, pairwise

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import array_of

from ...graph import Node
from ...graph import operations as ops
from ...graph.differentiate import vjp
from ...graph.evaluate import Tape
from ...graph.rewrite import substitute
from ...mechanics.defaults import default_values
from ...mechanics.system import MechanicalSystem
from .constraints import Row
from .massless_coordinates import placing

HORIZONS = (0.1, 1.0, 10.0, 100.0)
"""Times up to which is looked."""

STEPS = 397
"""To each of them: a prime, so that no period is met at the same places again and again."""

SPARSE = 7
"""Of so many of these times one is looked at for the size of values, which may take long."""

MOST = 8
"""Switches between two of these times that are looked for."""

SHARES = (0.25, 0.5, 0.75)
"""Places between two switches that are looked at, too: a short push may lie between those times."""

SMALL = 1e-6
"""Share of the largest value below which a jump is taken for a rounded coefficient."""


def check_prescribed(system: MechanicalSystem, driven: Mapping[Node, Node], reporter: Reporter) -> None:
    """Report drives whose position or rate jumps."""
    defaults: dict[Node, float] = {}
    inside = _solved(system, driven)
    for row in system.drives:
        if row.balanced:
            continue
        places = list(row.values)
        if len(places) > len(row.v):  # a quaternion and its negative are one rotation
            places = [system.graph.mul(a, b) for a in places for b in places]
        count = len(places)
        formulas = substitute(system.graph, [*places, *row.rates], driven)
        for k, formula in enumerate(formulas):
            if not _levels(system, formula, inside):
                continue
            defaults = defaults or default_values(system)
            at = next(_jumps(system, formula, defaults, inside), None)
            if at is None:
                continue
            name = row.names[0] if len(row.names) == 1 else array_of(row.names[0])[0]
            unit = "" if system.model.dimensionless else " s"
            reporter.error(
                "E0532",
                f"the {'position' if k < count else 'rate'} that is prescribed for '{name}' jumps",
                row.origin.span,
                caption=f"at time = {at:.4g}{unit}",
                help=f"let it change over a finite time; or write 'constraint {name} = ..' if it is a coordinate: "
                "there a rate that jumps is an impulse",
            )
            break


def check_carriers(system: MechanicalSystem, driven: Mapping[Node, Node], reporter: Reporter) -> None:
    """Report frames with masses whose position or rate, as a formula of time, jumps: nothing would tell the motion of the impulse."""
    seen: set[Node] = set()
    carried = [(m.point.frame, m.point.offset, m.origin) for m in system.masses]
    carried += [(body.frame, (), body.origin) for body in system.inertias]
    for carrier, offset, origin in carried:
        numbers = dict.fromkeys(n for n in (*offset, *placing([carrier])) if n not in seen)
        seen.update(numbers)
        moved = [n for n in numbers if system.symbols.time in system.graph.support(n)]
        for what, formulas in (("position", moved), ("rate", [system.rate(n) for n in moved])):
            at = _first_jump(system, formulas, driven)
            if at is None:
                continue
            reporter.error(
                "E0532",
                f"the {what} of a frame that carries a mass jumps",
                origin.shown,
                caption=f"what carries this jumps at time = {at}",
                help="let it change over a finite time; or move the frame by a coordinate and a constraint, as 'frame f = world * "
                "trans({x, 0 m});' with 'constraint x = ..': there a rate that jumps is an impulse",
            )
            return


def check_momenta(system: MechanicalSystem, driven: Mapping[Node, Node], reporter: Reporter) -> None:
    """Report stated energies whose momenta jump with time."""
    graph = system.graph
    energies = [(n, graph.one) for n in (system.kinetic, system.lagrangian)]
    if not _levels(system, graph.add(system.kinetic, system.lagrangian), ()):
        return
    at = _first_jump(system, vjp(graph, energies, [s.node for s in system.v]), driven)
    stated = next((e for e in system.model.energies if e.kind in ("kinetic", "lagrangian")), None)
    if at is not None and stated is not None:
        reporter.error(
            "E0715",
            "the kinetic energy must not jump",
            stated.value.span,
            caption=f"a momentum jumps at time = {at}",
            help="let it change over a finite time, or move a coordinate by a constraint: there a rate that jumps is an impulse",
        )


def _first_jump(
    system: MechanicalSystem, formulas: Sequence[Node], driven: Mapping[Node, Node]
) -> str | None:
    """Return the time at which one of some formulas jumps, as a text, or nothing."""
    inside = _solved(system, driven)
    for formula in substitute(system.graph, list(formulas), driven):
        if _levels(system, formula, inside):
            at = next(_jumps(system, formula, default_values(system), inside), None)
            if at is not None:
                return f"{at:.4g}{'' if system.model.dimensionless else ' s'}"
    return None


def check_held(
    system: MechanicalSystem, rows: Sequence[Row], driven: Mapping[Node, Node], reporter: Reporter
) -> None:
    """Report constraints that ask for another position from one instant to the next."""
    told: set[str] = set()
    inside = _solved(system, driven)
    for row in rows:
        if row.position is None or row.constraint.name in told or not _levels(system, row.position, inside):
            continue
        at = next(_jumps(system, row.position, default_values(system), inside), None)
        if at is None:
            continue
        told.add(row.constraint.name)
        unit = "" if system.model.dimensionless else " s"
        reporter.error(
            "E0532",
            f"the position that '{row.constraint.name}' asks for jumps",
            row.constraint.origin.span,
            caption=f"at time = {at:.4g}{unit}",
            help="let it change over a finite time",
        )


def _solved(system: MechanicalSystem, driven: Mapping[Node, Node]) -> set[Node]:
    """Return the solutions of equations that steps find, as they are and with ``driven`` put in: they do not jump where a step of the
    search compares numbers."""
    found = list(system.lowering.unknowns.found)
    return {*found, *substitute(system.graph, found, driven)}


def _levels(system: MechanicalSystem, formula: Node, inside: Collection[Node]) -> list[Node]:
    """Return what tells by whole numbers on which piece of a formula a time is."""
    graph, time = system.graph, system.symbols.time
    found = [
        n for n in graph.reach([formula], inside) if graph.op(n) in ops.JUMPING and time in graph.support(n)
    ]
    return [graph.floor(graph.div(*graph.args(n))) if graph.op(n) == ops.MODULO else n for n in found]


def _jumps(
    system: MechanicalSystem, formula: Node, defaults: Mapping[Node, float], inside: Collection[Node]
) -> Iterator[float]:
    graph, time = system.graph, system.symbols.time
    levels = _levels(system, formula, inside)
    still = {n: x for n, x in defaults.items() if n != time}
    values, piece = (
        Tape(graph, asked, defaults).settled(still).function(time, asked) for asked in ([formula], levels)
    )

    def value(t: float) -> float:
        return float(values(t)[0])

    runs = [[(t, piece(t)) for t in (end * k / STEPS for k in range(STEPS + 1))] for end in HORIZONS]
    switches = []
    for (first, here), (last, there) in chain.from_iterable(map(pairwise, runs)):
        for _ in range(MOST):
            if here == there:
                break
            before, after = first, last
            while before < (middle := (before + after) / 2) < after:
                if piece(middle) == here:
                    before = middle
                else:
                    after = middle
            switches.append((before, after))
            first, here = after, piece(after)
    if not switches:
        return
    between = [a + (b - a) * x for a, b in pairwise(sorted({t for _, t in switches})) for x in SHARES]
    seen = (abs(value(t)) for t in (*between, *(t for run in runs for t, _ in run[::SPARSE])))
    size = max(filter(math.isfinite, seen), default=0.0)
    for before, after in switches:
        if abs(value(after) - value(before)) > SMALL * size:
            yield after
