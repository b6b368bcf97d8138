"""How solutions of equations are found, for programs that repeat steps in a loop.

A solution is in the graph as the steps that lead to it, written out; in its formulas stands ``derived(value, 0)``. The graph remembers of
each of those nodes what is solved, and the rewriting keeps that: what was made of the node by replacements is the solution of what they make
of its equations. Where none is remembered (in another graph, or one that was stored), the steps are all that is known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING

from msgspec import Struct

if TYPE_CHECKING:
    from .node import Graph, Node


class Solution(Struct, frozen=True, eq=False):
    """What makes ``rows`` vanish: values for ``unknowns``, from a ``guess``. ``slopes``: the derivatives of each row by the unknowns, by
    index; ``terms``: what each row is a sum of. ``number``: another one for each that is stated in a graph."""

    number: int
    unknowns: tuple[Node, ...]
    guess: tuple[Node, ...]
    rows: tuple[Node, ...]
    slopes: tuple[Mapping[int, Node], ...]
    terms: tuple[tuple[Node, ...], ...]


class Part(Struct, frozen=True, eq=False):
    """One of the numbers of a solution."""

    solution: Solution
    index: int


class Image(Struct, frozen=True, eq=False):
    """What replacements make of the number that another node stands for."""

    of: Node
    replacements: Mapping[Node, Node]


def remember_images(graph: Graph, images: Mapping[Node, Node], replacements: Mapping[Node, Node]) -> None:
    """Say of what was made of nodes that stand for solutions how it is found."""
    found = [n for n in images if n in graph.solutions and n not in replacements]
    if found:
        kept = dict(replacements)
        for n in found:
            graph.solutions.setdefault(images[n], Image(n, kept))


def part_of(graph: Graph, n: Node, found: dict[tuple[int, ...], Solution]) -> Part | None:
    """Return what a node is of which solution, with own symbols for the unknowns; None where that is not known. ``found``: those that
    were asked for."""
    steps: list[Mapping[Node, Node]] = []
    known = graph.solutions.get(n)
    while isinstance(known, Image):
        steps.append(known.replacements)
        known = graph.solutions.get(known.of)
    if known is None:
        return None
    key = (known.solution.number, *map(id, steps))
    if key not in found:
        found[key] = _image_of(graph, known.solution, steps)
    return Part(found[key], known.index)


def _image_of(graph: Graph, solution: Solution, steps: Sequence[Mapping[Node, Node]]) -> Solution:
    """Return what replacements, the last ones first, make of a solution with own symbols for its unknowns."""
    from .rewrite import substitute

    own = {u: graph.symbol(f"#unknown {solution.number}.{k}") for k, u in enumerate(solution.unknowns)}
    guess = list(solution.guess)
    rest = [
        *solution.rows,
        *chain.from_iterable(row.values() for row in solution.slopes),
        *chain.from_iterable(solution.terms),
    ]
    rest = substitute(graph, rest, own)
    for replacements in reversed(steps):
        both = substitute(graph, [*guess, *rest], replacements)
        guess, rest = both[: len(guess)], both[len(guess) :]
    numbers = iter(rest)
    rows = tuple(next(numbers) for _ in solution.rows)
    slopes = tuple({j: next(numbers) for j in row} for row in solution.slopes)
    terms = tuple(tuple(next(numbers) for _ in row) for row in solution.terms)
    return Solution(solution.number, tuple(own.values()), tuple(guess), rows, slopes, terms)
