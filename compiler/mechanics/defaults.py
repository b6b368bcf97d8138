"""What parameters, inputs and discrete variables are by default, as formulas."""

from __future__ import annotations

from collections.abc import Sequence

from ..graph import Node
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
