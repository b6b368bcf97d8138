"""Which constraints between velocities could be written between positions: Frobenius' theorem at random points.

The rows of a constraint are forms w = A(q, t) dq + b(q, t) dt. They are integrable where dw(X, Y) = 0 for all
directions X, Y that the rows allow. Numbers at random points decide; a constraint whose rows contain inputs, states
or rates of rotations is taken for nonholonomic.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mechc.lang.diagnostics import Reporter
from mechc.runtime.numerics import rank

from ...graph import Node
from ...graph.differentiate import jacobian
from ...graph.evaluate import evaluate
from ...graph.rewrite import substitute
from ...mechanics.meaning.symbols import Scalar
from ...mechanics.system import MechanicalSystem
from .constraints import Row

POINTS = 3
TOLERANCE = 1e-9
"""Largest dw(X, Y), as a share of the entries of A and their derivatives, that counts as none."""

Array = NDArray[np.float64]


def note_integrable(
    system: MechanicalSystem, rows: Sequence[Row], values: Mapping[Node, float], reporter: Reporter
) -> None:
    """Say which constraints between velocities fix a function of the coordinates."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        if row.position is None:
            groups.setdefault(row.constraint.name, []).append(row)
    for name, group in groups.items():
        if _integrable(system, group, values):
            reporter.note(
                "N0505",
                f"constraint '{name}' contains velocities, but could be written with coordinates alone",
                group[0].constraint.origin.shown,
                caption="integrable",
                help="between positions it cannot drift, and it also removes a degree of freedom of the positions",
            )


def _integrable(system: MechanicalSystem, rows: Sequence[Row], values: Mapping[Node, float]) -> bool:
    graph = system.graph
    plain = {s.node: q.node for s, q in _pairs(system)}
    rates = [row.rate for row in rows]
    support = set(graph.support(*rates))
    strange = {s.node for s in (*system.symbols.inputs, *system.symbols.states, *system.symbols.discretes)}
    strange |= {s.node for s in system.v} - plain.keys()
    strange |= {q.node for first, _ in system.rotations for q in system.q[first : first + 4]}
    if support & strange:
        return False
    velocities = [v for v in plain if v in support]
    places = [plain[v] for v in velocities]
    places += [q for q in plain.values() if q in support and q not in places]
    zero = graph.zero
    coefficients = [
        row.get(j, zero) for row in jacobian(graph, rates, velocities) for j in range(len(velocities))
    ]
    rest = substitute(graph, rates, dict.fromkeys(velocities, zero))
    count, size = len(rows), len(places) + 1  # the last one is the time
    forms: list[list[Node]] = []
    for k in range(count):
        own = coefficients[k * len(velocities) : (k + 1) * len(velocities)]
        forms.append([*own, *[zero] * (size - 1 - len(own)), rest[k]])
    variables = [*places, system.symbols.time]
    entries = [n for form in forms for n in form]
    slopes = [row.get(j, zero) for row in jacobian(graph, entries, variables) for j in range(size)]
    numbers = np.random.default_rng(5)
    for _ in range(POINTS):
        point = dict(values) | {n: values.get(n, 0.0) + float(numbers.standard_normal()) for n in variables}
        point |= dict.fromkeys(velocities, 0.0)
        found = np.array(evaluate(graph, [*entries, *slopes], point))
        if not np.isfinite(found).all():
            return False
        a = found[: count * size].reshape(count, size)
        slope = found[count * size :].reshape(count, size, size)
        if _bracket(a, slope) > TOLERANCE * (1 + float(np.abs(found).max())) ** 2:
            return False
    return True


def _bracket(a: Array, slope: Array) -> float:
    """Return the largest dw(X, Y) over the directions X, Y with a X = a Y = 0."""
    allowed = rank.null_space(a, rank.NEWTON)
    curl = slope - slope.transpose(0, 2, 1)
    return float(np.abs(allowed.T @ curl @ allowed).max(initial=0.0))


def _pairs(system: MechanicalSystem) -> list[tuple[Scalar, Scalar]]:
    result: list[tuple[Scalar, Scalar]] = []
    for coordinate in system.symbols.coordinates:
        if not coordinate.is_rotation:
            result += list(zip(coordinate.v, coordinate.q, strict=True))
    return result
