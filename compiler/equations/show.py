"""The text of ``mechc show equations``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mechc.runtime.interface import Quantity

from ..graph.show import show_formulas
from .model import Equations, Function


def show(equations: Equations) -> str:
    """Return sizes, arrays and all functions as formulas."""
    return "\n".join(_lines(equations)) + "\n"


def _lines(equations: Equations) -> Iterator[str]:
    sizes = f"{equations.nq} coordinates, {equations.nv} velocities, {equations.nx} further states"
    yield f"equations of {equations.name}: {sizes}"
    yield f"  needs: {', '.join(sorted(equations.needs)) or 'nothing special'}"
    arrays = (
        ("y", equations.states),
        ("u", equations.inputs),
        ("z", equations.discretes),
        ("p", equations.parameters),
        ("out", equations.outputs),
    )
    for array, entries in arrays:
        for i, entry in enumerate(entries):
            yield f"  {array}[{i}] {_described(entry)}"
    rules = [(equations.parameters[rule.index].name, rule.value) for rule in equations.parameter_rules]
    if rules:
        yield ""
        yield "parameters"
        yield from (f"  {line}" for line in show_formulas(equations.graph, rules))
    for function in equations.functions:
        yield ""
        yield f"function {function.name}" + (f": {function.doc}" if function.doc else "")
        named = list(zip(_result_names(equations, function), function.outputs, strict=True))
        yield from (f"  {line}" for line in show_formulas(equations.graph, named))


def _described(entry: Quantity) -> str:
    return entry.name + (f" [{entry.unit}]" if entry.unit else "") + f" {entry.kind}"


def _result_names(equations: Equations, function: Function) -> list[str]:
    """Name the results of a function by what they are, where that is known."""
    entries: Sequence[Quantity] = ()
    match function.name:
        case "rhs":
            return [f"d/dt {entry.name}" for entry in equations.states]
        case "initial":
            entries = equations.states
        case "outputs":
            entries = equations.outputs
        case "inputs":
            entries = equations.inputs
        case "discretes":
            entries = equations.discretes
    if len(entries) == len(function.outputs):
        return [entry.name for entry in entries]
    return [f"out[{i}]" for i in range(len(function.outputs))]
