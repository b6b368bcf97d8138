"""How solutions of equations are found, for programs that repeat steps in a loop.

A solution is in the graph as the steps that lead to it, written out; in its formulas stands ``derived(value, 0)``. The graph remembers of
each of those nodes what is solved, and the rewriting keeps that: what was made of the node by replacements is the solution of what they make
of its equations. Where none is remembered (in another graph, or one that was stored), the steps are all that is known.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from .dependence import Node


class Solution(Struct, frozen=True, eq=False):
    """What makes ``rows`` vanish: values for ``unknowns``, from a ``guess``. ``slopes``: the derivatives of each row by the unknowns, by
    index; ``terms``: what each row is a sum of. ``number``: another one for each that is stated in a graph."""

    number: int
    unknowns: tuple[Node, ...]
    guess: tuple[Node, ...]
    rows: tuple[Node, ...]
    slopes: tuple[Mapping[int, Node], ...]
    terms: tuple[tuple[Node, ...], ...]


class SolutionPart(Struct, frozen=True, eq=False):
    """One of the numbers of a solution."""

    solution: Solution
    index: int


class SolutionImage(Struct, frozen=True, eq=False):
    """What replacements make of the number that another node stands for."""

    of: Node
    replacements: Mapping[Node, Node]


Solutions = dict[Node, SolutionPart | SolutionImage]


def remember_images(
    solutions: Solutions, images: Mapping[Node, Node], replacements: Mapping[Node, Node]
) -> None:
    """Say of what was made of nodes that stand for solutions how it is found."""
    found = [n for n in images if n in solutions and n not in replacements]
    if found:
        kept = dict(replacements)
        for n in found:
            solutions.setdefault(images[n], SolutionImage(n, kept))
