"""Compile model texts and evaluate their functions at given values, straight from the graph."""

from __future__ import annotations

from collections.abc import Mapping

from mechc.compiler.compilation import Compilation
from mechc.compiler.graph import Node
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.mechanics.defaults import default_values
from mechc.compiler.pipeline import compile_source
from mechc.lang.source import SourceFile


def compiled(text: str, **options: object) -> Compilation:
    """Compile a model given as text."""
    return compile_source(SourceFile("model.mech", text), **options)  # type: ignore[arg-type]


def outcome(model: Compilation, function: str, values: Mapping[str, float]) -> dict[str, float]:
    """Return the results of a function by name: states' rates for ``rhs``, outputs for ``outputs``.

    ``values`` sets states, parameters, inputs and ``time`` by their names in results; the rest is at its default.
    """
    equations = model.equations
    names = {
        (array, k): entry.name
        for array, entries in (
            ("y", equations.states),
            ("p", equations.parameters),
            ("u", equations.inputs),
            ("z", equations.discretes),
        )
        for k, entry in enumerate(entries)
    }
    old = model.system.graph
    defaults = {old.name(n): value for n, value in default_values(model.system).items()}
    environment: dict[Node, float] = {}
    known = set(values)
    for node, slot in equations.layout.items():
        name = "time" if slot.array == "t" else names[slot.array, slot.index]
        if name in values:
            environment[node] = values[name]
            known.discard(name)
        environment.setdefault(node, defaults.get(equations.graph.name(node), 0.0))
    assert not known, f"not in the model: {known}"
    chosen = next(f for f in equations.functions if f.name == function)
    numbers = evaluate(equations.graph, list(chosen.outputs), environment)
    entries = equations.states if function == "rhs" else equations.outputs
    return {entry.name: float(x) for entry, x in zip(entries, numbers, strict=True)}
