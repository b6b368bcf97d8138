"""Rebuild expressions with other leaves, or in another graph."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress

from . import operations as ops
from .node import DivisionByZero, Graph, Node
from .solution import remember_images


def substitute(graph: Graph, outputs: Sequence[Node], replacements: Mapping[Node, Node]) -> list[Node]:
    """Return the outputs with some nodes replaced, all at once; what depends on none of them stays as it is.

    Raises DivisionByZero where a divisor becomes zero, but for one in a branch that is never taken then.
    """
    if not replacements or not graph.reached_among(outputs, replacements):
        return list(outputs)
    try:
        return _substituted(graph, outputs, replacements)
    except DivisionByZero as error:
        return _beside_what_divides(graph, outputs, replacements, error)


def _substituted(graph: Graph, outputs: Sequence[Node], replacements: Mapping[Node, Node]) -> list[Node]:
    images: dict[Node, Node] = dict(replacements)
    left, right, code = graph._left, graph._right, graph._code
    for n in graph.reach_of(outputs, replacements):
        # the number of an argument that is not there is no key
        if (left[n] in images or right[n] in images or code[n] == ops.SELECT) and n not in images:
            arguments = graph.args(n)
            new = tuple([images.get(a, a) for a in arguments])
            if new != arguments:
                images[n] = rebuild(graph, n, graph, new)
    if graph.solutions:
        remember_images(graph.solutions, images, replacements)
    return [images.get(n, n) for n in outputs]


def _beside_what_divides(
    graph: Graph, outputs: Sequence[Node], replacements: Mapping[Node, Node], error: DivisionByZero
) -> list[Node]:
    """Return the same where choices that are made by now leave out every quotient without a value; else raise the error."""
    images: dict[Node, Node | None] = dict(replacements)  # None: without a value
    for n in graph.reach_of(outputs, replacements):
        arguments = graph.args(n)
        new = [images.get(a, a) for a in arguments]
        if n in images or new == list(arguments):
            continue
        if graph.op(n) == ops.SELECT and new[0] in (graph.zero, graph.one):
            images[n] = new[1] if new[0] == graph.one else new[2]
            continue
        known = tuple(x for x in new if x is not None)
        images[n] = None
        if len(known) == len(new):
            with suppress(DivisionByZero):
                images[n] = rebuild(graph, n, graph, known)
    found = [images.get(n, n) for n in outputs]
    known = tuple(x for x in found if x is not None)
    if len(known) < len(found):
        raise error
    return list(known)


def transfer(
    source: Graph, outputs: Sequence[Node], target: Graph, replacements: Mapping[Node, Node] | None = None
) -> list[Node]:
    """Build the outputs again in another graph; symbols keep their names.

    ``replacements``: nodes of the source that become given nodes of the target.
    """
    images: dict[Node, Node] = dict(replacements or {})
    for n in source.reach(outputs):
        if n in images:
            continue
        match source.op(n):
            case ops.CONST:
                images[n] = target.constant(source.value(n))
            case ops.SYMBOL:
                images[n] = target.symbol(source.name(n))
            case _:
                images[n] = rebuild(source, n, target, tuple(images[a] for a in source.args(n)))
    return [images[n] for n in outputs]


def rebuild(source: Graph, n: Node, target: Graph, arguments: tuple[Node, ...]) -> Node:
    """Apply the operation of a node of ``source`` to arguments in ``target``."""
    code = source.op(n)
    if code != ops.LOOKUP:
        return target.apply(code, *arguments)
    index, order = source.table_of(n)
    if target is not source:
        index = target.add_table(source.tables[index])
    (x,) = arguments
    return target.lookup(index, x, order)
