"""What parameters, inputs, discrete variables and the state are by default, as numbers."""

from __future__ import annotations

from ...graph import Node
from ...graph.evaluate import evaluate
from ...mechanics.defaults import default_formulas
from ...mechanics.system import MechanicalSystem


def default_values(system: MechanicalSystem) -> dict[Node, float]:
    """Return the default values of parameters, inputs, discrete variables and time, and the initial state.

    Virtual displacements are zero, as in every motion.
    """
    graph = system.graph
    values: dict[Node, float] = {system.symbols.time: 0.0}
    values |= {node: 0.0 for displacement in system.virtual.values() for node in displacement.values}
    for scalars in (system.symbols.parameters, system.symbols.inputs, system.symbols.discretes):
        formulas = default_formulas(system, scalars)
        values |= {s.node: 0.0 for s in scalars}
        for _ in range(len(formulas) + 1):  # parameters may depend on later ones
            found = evaluate(graph, list(formulas.values()), values)
            settled = all(values[n] == x for n, x in zip(formulas, found, strict=True))
            values |= zip(formulas, found, strict=True)
            if settled:
                break
    starts = [
        *zip(system.q, system.start_q, strict=True),
        *zip(system.v, system.start_v, strict=True),
        *zip(system.symbols.states, system.start_x, strict=True),
    ]
    numbers = evaluate(graph, [b.value for _, b in starts], values)
    return values | {s.node: x for (s, _), x in zip(starts, numbers, strict=True)}
