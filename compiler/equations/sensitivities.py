"""Directional and adjoint derivatives of the right-hand side and the outputs, with their seeds as further symbols."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from msgspec.structs import replace

from ..graph import Graph, Node
from ..graph.differentiate import jvp, vjp
from ..graph.rewrite import substitute
from .model import BranchPlan, Equations, Function, Slot, quantity
from .solve.shares import shares_in, undefined

SEED = "seed"
"""Kind of the entries that hold seeds, after the discrete variables."""


def with_sensitivities(equations: Equations, independent: Sequence[int]) -> Equations:
    """Return the equations with the functions ``tangent`` and ``adjoint``.

    ``independent``: the parameters that do not follow from others. The seeds lie in z after the discrete
    variables: of the tangent one for each of y, u, time and p, of the adjoint one for each of dy/dt and the outputs.
    ``tangent`` gives J seed, ``adjoint`` J^T seed, in the same orders; entries of dependent parameters are zero.
    Where loads are shared that rigid bodies do not determine, the derivative of what reads them is not a number. ``start_tangent`` and ``start_adjoint`` are the same for the initial state by u, time and p, where formulas give
    it: out[ny], and out[nu + 1 + np] of seeds for y.
    """
    functions = {f.name: f for f in equations.functions}
    graph, unknowns = equations.graph, total(equations, independent, _unknowns(equations))
    places = {slot: n for n, slot in equations.layout.items()}
    ny, nu, n_p = len(equations.states), len(equations.inputs), len(equations.parameters)
    slots = [Slot("y", i) for i in range(ny)] + [Slot("u", i) for i in range(nu)] + [Slot("t", 0)]
    slots += [Slot("p", i) for i in range(n_p)]
    chosen = set(independent)
    knowns = [places.get(s) if s.array != "p" or s.index in chosen else None for s in slots]
    count, first = max(len(knowns), len(unknowns)), len(equations.discretes)
    seeds = [graph.symbol(f"seed of derivatives {i}") for i in range(count)]
    tangents = {n: seeds[i] for i, n in enumerate(knowns) if n is not None}
    forward = jvp(graph, unknowns, tangents)
    there = [n for n in knowns if n is not None]
    backward = dict(zip(there, vjp(graph, list(zip(unknowns, seeds, strict=False)), there), strict=True))
    shares = shares_in(equations.switching, equations.layout)
    for i, unknown in enumerate(unknowns):
        none = undefined(graph, shares, unknown)
        if none != graph.zero:
            forward[i] = graph.add(forward[i], none)
            asked = graph.select(graph.less(graph.zero, graph.abs(seeds[i])), none, graph.zero)
            backward = {n: graph.add(x, asked) for n, x in backward.items()}
    at_start: tuple[Function, ...] = ()
    initial = total(equations, independent, functions["initial"].outputs)
    if not equations.assembly and not equations.dependent and any(graph.support(n) for n in initial):
        given = {n: seeds[i] for i, n in enumerate(knowns) if n is not None and i >= ny}
        back = vjp(graph, list(zip(initial, seeds, strict=False)), list(given))
        by_known = dict(zip(given, back, strict=True))
        at_start = (
            Function(
                "start_tangent",
                "directional derivative of the initial state",
                tuple(jvp(graph, initial, given)),
            ),
            Function(
                "start_adjoint",
                "adjoint derivative of the initial state",
                tuple(graph.zero if n is None else by_known[n] for n in knowns[ny:]),
            ),
        )
    return replace(
        equations,
        layout={**equations.layout, **{n: Slot("z", first + i) for i, n in enumerate(seeds)}},
        discretes=(*equations.discretes, *(quantity(f"seed[{i + 1}]", SEED, "") for i in range(count))),
        functions=(
            *passing_on(
                equations.functions,
                equations.switching.branches if equations.switching else (),
                len(equations.states) + len(equations.discretes),
                seeds,
            ),
            Function("tangent", "directional derivative of rates and outputs", tuple(forward)),
            Function(
                "adjoint",
                "adjoint derivative of rates and outputs",
                tuple(graph.zero if n is None else backward[n] for n in knowns),
            ),
            *at_start,
        ),
    )


def passing_on(
    functions: Sequence[Function], branches: Sequence[BranchPlan], first: int, seeds: Sequence[Node]
) -> Iterator[Function]:
    """Yield functions; those of branches give all of z, seeds after its first ``first`` numbers and those of y included."""
    acting = {branch.function for branch in branches}
    for function in functions:
        if function.name in acting:
            y_and_z, checks = function.outputs[:first], function.outputs[first:]
            function = replace(function, outputs=(*y_and_z, *seeds, *checks))
        yield function


def dependencies(
    equations: Equations, independent: Sequence[int], nodes: Sequence[Node]
) -> tuple[frozenset[Slot], ...]:
    """Return the places in t, y, u and p (independent parameters) on which each node depends."""
    graph, layout = equations.graph, equations.layout
    return tuple(frozenset(layout[s] for s in graph.support(n)) for n in total(equations, independent, nodes))


def total(equations: Equations, independent: Sequence[int], nodes: Sequence[Node]) -> tuple[Node, ...]:
    """Return nodes with the rules of dependent parameters instead of these."""
    graph = equations.graph
    places = {slot: n for n, slot in equations.layout.items()}
    chosen = set(independent)
    rules = {
        places[Slot("p", r.index)]: r.value
        for r in equations.parameter_rules
        if r.index not in chosen and Slot("p", r.index) in places
    }
    return tuple(substitute(graph, nodes, _closed(graph, rules)))


def _closed(graph: Graph, rules: Mapping[Node, Node]) -> dict[Node, Node]:
    """Put the rules into each other until they hold independent parameters only."""
    closed = dict(rules)
    for _ in rules:
        values = substitute(graph, list(closed.values()), closed)
        if values == list(closed.values()):
            break
        closed = dict(zip(closed, values, strict=True))
    return closed


def _unknowns(equations: Equations) -> tuple[Node, ...]:
    functions = {f.name: f for f in equations.functions}
    return (*functions["rhs"].outputs, *functions["outputs"].outputs)
