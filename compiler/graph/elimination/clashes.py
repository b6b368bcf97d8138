"""Equations that contradict each other, told from those that leave something open: by numbers, for the words of a message."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from ..differentiate import jacobian
from ..evaluate import Tape
from ..node import Graph, Node

STATES = 3
STEPS = 40
SMALL = 1e-9


def linear(graph: Graph, rows: Sequence[Node], unknowns: Sequence[Node]) -> bool:
    """Tell whether no derivative of the rows by the unknowns depends on these."""
    slopes = (slope for row in jacobian(graph, list(rows), list(unknowns)) for slope in row.values())
    return not set(unknowns).intersection(graph.support(*slopes))


def clash(graph: Graph, rows: Sequence[Node], unknowns: Sequence[Node], guess: Sequence[Node]) -> bool:
    """Tell whether no numbers near the guess fulfil the rows, at any of several random states.

    Gauss and Newton's method, each step the least of those that are best, ends where the rows are as near to zero as they come.
    """
    slopes = jacobian(graph, list(rows), list(unknowns))
    entries = [slope for row in slopes for slope in row.values()]
    symbols = [s for s in graph.support(*rows, *entries, *guess) if s not in set(unknowns)]
    start = Tape(graph, guess, symbols)
    system = Tape(graph, [*rows, *entries], [*symbols, *unknowns])
    random = Random(7)
    for _ in range(STATES):
        around = {s: random.uniform(0.5, 1.5) for s in symbols}
        try:
            first = start(around)
            given = [first[n] for n in guess]
            # at the guess itself the rows may be level, as y^2 - 2 at 0
            beside = [x + random.uniform(0.1, 1) * (1 + abs(x)) for x in given]
            if any(_fulfilled(system, rows, slopes, unknowns, around, point) for point in (given, beside)):
                return False
        except (ArithmeticError, ValueError):
            return False
    return True


def _fulfilled(
    system: Tape,
    rows: Sequence[Node],
    slopes: Sequence[dict[int, Node]],
    unknowns: Sequence[Node],
    around: dict[Node, float],
    point: list[float],
) -> bool:
    import numpy as np

    from mechc.runtime.numerics import rank

    x = np.array(point)
    for _ in range(STEPS):
        values = system(around | dict(zip(unknowns, x.tolist(), strict=True)))
        rest = np.array([values[n] for n in rows])
        matrix = np.zeros((len(rows), len(unknowns)))
        for i, row in enumerate(slopes):
            for j, slope in row.items():
                matrix[i, j] = values[slope]
        if not (np.isfinite(rest).all() and np.isfinite(matrix).all()):
            return True  # nothing is known
        size = 1 + np.abs(matrix) @ np.abs(x)
        if np.max(np.abs(rest) / size) <= SMALL:
            return True
        x = x + rank.solve(matrix, -rest, rank.NEWTON)
    return False
