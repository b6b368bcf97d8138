"""Warnings of energies that the model contains already: a weight beside ``gravity``, a centrifugal force beside a turning frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from random import Random

from mechc.lang.diagnostics import Reporter

from ...flat.model import Energy
from ...graph import Node
from ...graph.evaluate import Tape
from ...mechanics.defaults import default_values
from ...mechanics.system import MechanicalSystem

DRAWS = 4
SAME = 1e-9
"""Relative difference up to which two energies are the same function of the coordinates."""


def warn_of_counting_twice(
    system: MechanicalSystem, kinetic: Node, driven: Mapping[Node, Node], reporter: Reporter
) -> None:
    """Compare each potential energy with the weights and with the kinetic energy at rest. ``kinetic``: that of the whole model, in
    which drives are put in. A constant makes no difference."""
    graph, lowering = system.graph, system.lowering
    energies = [e for e in system.model.energies if e.kind == "potential"]
    stated = [(e, lowering.numbers(e.value)[0]) for e in energies]
    coordinates = {s.node for s in system.q}
    stated = [
        (e, n)
        for e, n in stated
        if coordinates.intersection(found := graph.support(n)) and not driven.keys() & set(found)
    ]
    if not stated:
        return
    weights = [
        (m.mass, system.kinematics.potential(m.point, m.field)) for m in system.masses if m.field is not None
    ]
    nodes = [kinetic, *(n for _, n in stated), *(n for pair in weights for n in pair)]
    try:
        places = _places(system, nodes)
    except (KeyError, ArithmeticError, ValueError):
        return  # answers that only the equations give, or values that are undefined there
    for energy, node in stated:
        own = [values[node] for values in places]
        for mass, height in weights:
            if _same(own, [-values[mass] * values[height] for values in places]):
                _report(
                    reporter,
                    energy,
                    "the weight of this body is counted twice",
                    "'gravity' already gives each mass its weight: leave one of them out",
                )
                break
        if _same(own, [-values[kinetic] for values in places]):
            _report(
                reporter,
                energy,
                "this centrifugal force is counted twice",
                "the kinetic energy of a turning frame contains it: leave this potential out",
            )


def _places(system: MechanicalSystem, nodes: Sequence[Node]) -> list[dict[Node, float]]:
    """Evaluate at rest at a few places, with the default values of the parameters."""
    random = Random(7)
    default = default_values(system) | {s.node: 0.0 for s in system.v}
    default |= dict.fromkeys(system.a, 0.0)
    tape = Tape(system.graph, nodes, [n for n in system.graph.support(*nodes) if n in default])
    return [tape(default | {s.node: random.uniform(0.5, 1.5) for s in system.q}) for _ in range(DRAWS)]


def _same(one: Sequence[float], other: Sequence[float]) -> bool:
    """Tell whether two energies change alike from place to place, and change at all."""
    changes = [(a - one[0], b - other[0]) for a, b in zip(one[1:], other[1:], strict=True)]
    size = max(abs(x) for pair in changes for x in pair)
    return isfinite(size) and size > 0 and all(abs(a - b) <= SAME * size for a, b in changes)


def _report(reporter: Reporter, energy: Energy, message: str, help: str) -> None:
    reporter.warning("W0567", message, energy.origin.shown, help=help)
