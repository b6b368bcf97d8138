"""Which equation to solve for which unknown where the natural pairing has a zero on the diagonal.

Indefinite mass matrices (light-cone coordinates, metrics) may have zero diagonal entries though they are regular.
The pairing that makes the product of the chosen entries largest at a random state puts nothing small on the
diagonal (Duff and Koster, SIAM J. Matrix Anal. Appl. 22, 2001).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..graph import Graph, Node
from ..graph.differentiate import jacobian
from ..graph.evaluate import evaluate

ABSENT = 1e6
"""Cost of an entry that is zero: more than any sum of logarithms of entries."""


def pairing(graph: Graph, equations: Sequence[Node], unknowns: Sequence[Node]) -> list[int] | None:
    """Return the equation for each unknown, or None if every pairing meets a zero: the system is singular."""
    rows = jacobian(graph, equations, unknowns)
    entries = [(i, j, n) for i, row in enumerate(rows) for j, n in row.items()]
    random = np.random.default_rng(7)
    values = {s: float(random.uniform(0.3, 0.9)) for s in graph.support(*(n for *_, n in entries))}
    costs = np.full((len(equations), len(unknowns)), ABSENT)
    for (i, j, _), value in zip(entries, evaluate(graph, [n for *_, n in entries], values), strict=True):
        if np.isfinite(value) and value != 0:
            costs[i, j] = -np.log(abs(value))
    chosen, columns = linear_sum_assignment(costs)
    if costs[chosen, columns].max() >= ABSENT:
        return None
    result = [0] * len(unknowns)
    for i, j in zip(chosen, columns, strict=True):
        result[j] = int(i)
    return result
