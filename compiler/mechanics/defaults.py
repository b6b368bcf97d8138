"""What parameters, inputs and discrete variables are by default, as formulas and as numbers."""

from __future__ import annotations

from collections.abc import Sequence

from ..graph import Node
from ..graph.evaluate import evaluate
from ..graph.rewrite import substitute
from .meaning.symbols import Scalar
from .system import MechanicalSystem


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


def first_values(system: MechanicalSystem) -> dict[Node, Node]:
    """Return the first value of each discrete variable with those of the others put in, but where they go in a circle."""
    formulas = default_formulas(system, system.symbols.discretes)
    for _ in formulas:
        if formulas.keys().isdisjoint(system.graph.support(*formulas.values())):
            break
        found = substitute(system.graph, list(formulas.values()), formulas)
        formulas = dict(zip(formulas, found, strict=True))
    return formulas


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
