"""Warnings of damping that feeds energy in, found with the default values of the parameters."""

from __future__ import annotations

from mechc.lang.diagnostics import Reporter

from ...graph.evaluate import Tape
from ...mechanics.defaults import default_values
from ...mechanics.system import MechanicalSystem


def warn_of_negative_damping(system: MechanicalSystem, reporter: Reporter) -> None:
    """Warn of dampings and dissipations that are negative whatever the state.

    What changes its sign with the state or the time, as in a van der Pol oscillator, is meant so.
    """
    graph, model, lowering = system.graph, system.model, system.lowering
    velocities = [s.node for s in system.v]
    fixed = {s.node for s in system.symbols.parameters}
    stated = [("damping", lowering.numbers(d.value), d.origin) for d in model.dampings]
    stated += [
        ("dissipation", lowering.numbers(e.value), e.origin)
        for e in model.energies
        if e.kind == "dissipation"
    ]
    stated = [
        (w, nodes, o) for w, nodes, o in stated if fixed.union(velocities).issuperset(graph.support(*nodes))
    ]
    if not stated:
        return
    default = default_values(system)
    for what, nodes, origin in stated:
        needed = frozenset(graph.support(*nodes))
        moving = [v for v in velocities if v in needed]
        # a form that is not definite changes its sign with the direction
        alone = [{v: float(v is one) for v in moving} for one in velocities if one in needed]
        rest = [dict.fromkeys(moving, 0.0)] if len(moving) < len(velocities) else []
        directions = [*alone, *rest, dict.fromkeys(moving, 1.0)]
        known = {n: value for n, value in default.items() if n in needed}
        tape = Tape(graph, nodes, needed)
        sizes = [values[n] for d in directions for values in (tape(known | d),) for n in nodes]
        if min(sizes) < 0 and max(sizes) <= 0:
            reporter.warning(
                "W0532",
                f"this {what} is negative: it feeds in energy without limit",
                origin.shown,
                help="'damping c on q' is the force -c*der(q), 'dissipation R' the force -dR/d(der(q)); both brake "
                "where they are positive",
            )
