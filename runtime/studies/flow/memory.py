"""Discrete variables that carry memory from one time to the next: those that change with the state and are read again."""

from __future__ import annotations

import numpy as np

from ...problem import Array, Problem


def real_discretes(problem: Problem) -> tuple[int, ...]:
    """Give the places in z of the discrete variables that have derivatives, in their order."""
    if problem.hybrid is None:
        return ()
    return tuple(k for k, q in enumerate(problem.discretes) if q.kind == "discrete" and q.type == "real")


def declared_discretes(problem: Problem) -> tuple[int, ...]:
    """Give the places in z of the discrete variables of the model itself, of all types."""
    return tuple(k for k, q in enumerate(problem.discretes) if q.kind == "discrete")


def unchanged(by_others: Array, by_discretes: Array) -> list[int]:
    """Give the discrete variables that a map takes over as they are, but for a constant: by_others [z][n], by_discretes [z][z]."""
    unit = np.eye(len(by_discretes))
    return [
        j for j in range(len(unit)) if np.array_equal(by_discretes[j], unit[j]) and not by_others[j].any()
    ]


def remembered(*maps: tuple[Array, Array, Array]) -> list[int]:
    """Give the discrete variables that maps change and that what moves reads, at once or later.

    Each map tells how what moves changes with z [n][z], and z with what moves [z][m] and with z [z][z]. The others are
    constant, are set again before they are read, or are read by nothing.
    """
    count = len(maps[0][2])
    same = set(range(count)).intersection(*(unchanged(by_others, own) for _, by_others, own in maps))
    reads = np.any([np.abs(by_z).any(axis=0) for by_z, _, _ in maps], axis=0)
    uses = np.any([own != 0 for _, _, own in maps], axis=0)
    wanted, seen = np.flatnonzero(reads).tolist(), set[int]()
    while wanted:
        j = wanted.pop()
        if j not in seen and j not in same:
            seen.add(j)
            wanted += np.flatnonzero(uses[j]).tolist()
    return sorted(seen)
