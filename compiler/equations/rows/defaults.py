"""What parameters, inputs, discrete variables and the state are by default: as formulas and as numbers."""

from __future__ import annotations

from collections.abc import Sequence

from ...graph import Node
from ...graph.evaluate import evaluate
from ...mechanics.meaning.symbols import Scalar
from ...mechanics.system import MechanicalSystem


def default_formulas(system: MechanicalSystem, scalars: Sequence[Scalar]) -> dict[Node, Node]:
    """Return the formula that the declaration of each number gives; those without a value are left out."""
    groups: dict[str, list[Scalar]] = {}
    for s in scalars:
        groups.setdefault(s.variable.name, []).append(s)
    found: dict[Node, Node] = {}
    for group in groups.values():
        value = group[0].variable.value
        if value is None:
            continue
        numbers = system.lowering.numbers(value)
        numbers = numbers * len(group) if len(numbers) == 1 else numbers
        found |= zip((s.node for s in group), numbers, strict=True)
    return found


def default_values(system: MechanicalSystem) -> dict[Node, float]:
    """Return the default values of parameters, inputs, discrete variables and time, and the initial state."""
    graph = system.graph
    values: dict[Node, float] = {system.symbols.time: 0.0}
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
