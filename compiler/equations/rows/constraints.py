"""Constraint rows with their second derivatives, and the corrections that project a state onto them.

The corrections lead to the nearest state in the mass metric: M d - K^T mu = 0 with K d = -phi for positions, and with
K d = -(K v + b) for velocities. Solved along the structure like the accelerations, so it costs as little.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

from msgspec import Struct

from mechc.lang.diagnostics import Reporter

from ...graph import Graph, Node
from ...graph.differentiate import jvp
from ...graph.elimination.eliminate import solve
from ...graph.evaluate import evaluate
from ...graph.rewrite import substitute
from ...mechanics.kinematics.reactions import reactions_asked
from ...mechanics.system import ConstraintRows, MechanicalSystem
from .residual import constraint_rates

ROUNDING = 1e-12
"""A residual of this size, in SI units, counts as none."""

SWEEPS = 3
"""Solutions in a row with compliant multipliers, each about the multipliers of the one before."""


class Compliance(Struct, frozen=True):
    """A row gives way by ``size`` times what its multiplier differs from ``previous``, a symbol (singular.py).

    ``projected``: the size where states are projected.
    """

    size: Node
    projected: Node
    previous: Node


class Row(Struct, frozen=True):
    """One scalar equation: ``position`` is phi or None, ``rate`` is K v + b, ``second`` is K a + gamma."""

    constraint: ConstraintRows
    component: int
    multiplier: Node
    position: Node | None
    rate: Node
    second: Node
    equation: Node
    """What determines the multiplier: ``second``, or in a mode that is off the law of the force."""
    give: Compliance | None = None
    """Where singular positions are met; already in ``equation``."""
    weight: Node | None = None
    """Where the mass matrix may be singular: what ``weighted`` adds to it, [inertia of the row's own motion]."""

    @property
    def title(self) -> str:
        count = len(self.constraint.residuals)
        return f"{self.constraint.name}[{self.component + 1}]" if count > 1 else self.constraint.name


def rows_of(
    system: MechanicalSystem, multipliers: Sequence[Sequence[Node]], replace: Mapping[Node, Node]
) -> tuple[Row, ...]:
    """Return every row with ``replace`` applied (driven coordinates, rates of states, virtual displacements)."""
    graph = system.graph
    rows: list[Row] = []
    for constraint, symbols in zip(system.constraints, multipliers, strict=True):
        rates = constraint_rates(system, constraint)
        nodes = [*constraint.residuals, *rates, *(system.rate(c) for c in rates)]
        nodes = substitute(graph, nodes, replace)
        count = len(symbols)
        for k, lam in enumerate(symbols):
            position = nodes[k] if constraint.level == "position" else None
            second = nodes[2 * count + k]
            rows.append(Row(constraint, k, lam, position, nodes[count + k], second, second))
    return tuple(rows)


def without_empty(
    rows: Sequence[Row],
    system: MechanicalSystem,
    reporter: Reporter,
    numbers: Callable[[], Mapping[Node, float]],
) -> tuple[Row, ...]:
    """Drop rows that are identically zero; report rows that no motion can change, by what they are off.

    ``numbers``: values of parameters and time. A row that they fulfil is kept: others might not, and the assembly tells.

    What is fulfilled by the other joints alone is named if nothing else is left of a joint, or if its reaction is asked
    for: that reaction is not unique.
    """
    graph = system.graph
    moving = system.symbols.positions | system.symbols.velocities
    kept: list[Row] = []
    empty: dict[str, list[Row]] = {}
    for row in rows:
        if graph.is_zero(row.rate) and (row.position is None or graph.is_zero(row.position)):
            empty.setdefault(row.constraint.name, []).append(row)
            continue
        smooth = row.constraint.mode is not None and row.constraint.mode.smooth is not None
        if not smooth and moving.isdisjoint(graph.support(row.rate)):
            _report_unchangeable(row, system, reporter, numbers)
        kept.append(row)
    left = {row.constraint.name for row in kept}
    asked = reactions_asked(system.model) if empty else ()
    for name, dropped in empty.items():
        if name in asked or (dropped[0].constraint.joint and name not in left):
            report_superfluous(dropped, reporter)
    return tuple(kept)


def _report_unchangeable(
    row: Row, system: MechanicalSystem, reporter: Reporter, numbers: Callable[[], Mapping[Node, float]]
) -> None:
    span = row.constraint.origin.shown
    if row.position is None or not system.graph.is_zero(row.rate):
        reporter.error(
            "E0524",
            f"'{row.title}' cannot be fulfilled: no coordinate changes it",
            span,
            caption="everything in it is prescribed",
        )
        return
    (off,) = evaluate(system.graph, [row.position], numbers())
    if abs(off) < ROUNDING:
        return
    size = f"{abs(off):.4g} {row.constraint.units[row.component]}".rstrip()
    if row.constraint.joint:
        reporter.error(
            "E0529",
            f"the loop that joint '{row.constraint.joint}' closes cannot close: '{row.title}' is off by {size} in every "
            "position",
            span,
            caption="no coordinate changes this",
            help="check positions, lengths and axes around the loop, or use a joint with more degrees of freedom",
        )
    else:
        reporter.error(
            "E0524",
            f"'{row.title}' cannot be fulfilled: it is off by {size}, and no coordinate changes it",
            span,
            caption="nothing that moves is left in it",
        )


def report_superfluous(rows: Sequence[Row], reporter: Reporter) -> None:
    """Name rows of one constraint or joint that are left out."""
    constraint, count = rows[0].constraint, len(rows)
    what = "joint" if constraint.joint else "constraint"
    reporter.warning(
        "W0513",
        f"{what} '{constraint.name}' repeats {count} equation{'s' if count > 1 else ''} already implied by the others; "
        "dropped",
        constraint.origin.shown,
        caption="what is dropped carries nothing: how it and the others share their load cannot be told",
    )


class Projection(Struct, frozen=True):
    """Corrections d of the velocities' size that remove the residuals; the residuals follow.

    ``closeness``, from 0 to 1: the largest share of a compliance in its row; none where nothing is compliant.
    """

    position: tuple[Node, ...]
    position_residuals: tuple[Node, ...]
    velocity: tuple[Node, ...]
    velocity_residuals: tuple[Node, ...]
    closeness: Node | None = None


def projection(
    system: MechanicalSystem,
    residual: Sequence[Node],
    free: Sequence[int],
    rows: Sequence[Row],
    supports: Sequence[Collection[int]],
) -> Projection:
    """Return the corrections of a state with the given independent rows; ``supports`` as for accelerations."""
    located = [row for row in rows if row.position is not None]
    values = [row.position if row.position is not None else row.rate for row in rows]
    count = len(located)
    position, _ = _correction(system, residual, free, located, values[:count], supports[:count])
    velocity, closeness = _correction(system, residual, free, rows, [row.rate for row in rows], supports)
    return Projection(
        position,
        tuple(row.position for row in located if row.position is not None),
        velocity,
        tuple(row.rate for row in rows),
        closeness,
    )


def _correction(
    system: MechanicalSystem,
    residual: Sequence[Node],
    free: Sequence[int],
    rows: Sequence[Row],
    values: Sequence[Node],
    supports: Sequence[Collection[int]],
) -> tuple[tuple[Node, ...], Node | None]:
    """Return d with M d - K^T mu = 0 and K d = -values, and the closeness (Projection)."""
    graph = system.graph
    if not rows:
        return (graph.zero,) * len(free), None
    corrections = [graph.symbol(f"#correction {i}") for i in free]
    along = dict(zip((system.a[i] for i in free), corrections, strict=True))
    inertia = jvp(graph, [residual[i] for i in free], along)
    # the multipliers of rows that are left out must not appear
    forces = jvp(graph, [residual[i] for i in free], {row.multiplier: row.multiplier for row in rows})
    directions = {system.v[i].node: d for i, d in zip(free, corrections, strict=True)}
    changes = jvp(graph, [row.rate for row in rows], directions)
    equations = [graph.add(m, f) for m, f in zip(inertia, forces, strict=True)]
    changes = [
        c if row.give is None else give_way(graph, c, row, row.give.projected)
        for c, row in zip(changes, rows, strict=True)
    ]
    conditions = [graph.add(c, value) for c, value in zip(changes, values, strict=True)]
    equations = [*weighted(graph, equations, rows, conditions, corrections), *conditions]
    unknowns = [*corrections, *(row.multiplier for row in rows)]
    after = {len(free) + k: support for k, support in enumerate(supports)}
    found = solve(graph, equations, unknowns, after=after)
    pivots = dict(zip(found.order, found.pivots, strict=True))
    closeness: Node | None = None
    for k, row in enumerate(rows, start=len(free)):
        if row.give is not None:
            share = graph.div(row.give.projected, pivots[k])
            closeness = share if closeness is None else graph.maximum(closeness, share)
    return settle(graph, rows, found.solutions)[: len(free)], closeness


def weighted(
    graph: Graph,
    equations: Sequence[Node],
    rows: Sequence[Row],
    conditions: Sequence[Node],
    unknowns: Sequence[Node],
) -> list[Node]:
    """Return M a - K^T lam + ... with mu - w K a instead of each multiplier whose row has a weight w.

    ``conditions``: what vanishes of each row, K a + gamma in the ``unknowns`` a. So a is the same, and its matrix M + K^T w K is
    positive definite wherever the constraints decide what M leaves open (weights.py); the symbols lam stand for mu = lam - w gamma
    then. What a compliant row demands holds its multiplier, so lam - w (K a + ...) stands there, and mu is lam.
    """
    weights = {k: row.weight for k, row in enumerate(rows) if row.weight is not None}
    plain = [k for k in weights if rows[k].give is None]
    moved = {k: conditions[k] for k in weights}
    moved |= zip(plain, jvp(graph, [conditions[k] for k in plain], {n: n for n in unknowns}), strict=True)
    replacements = {
        rows[k].multiplier: graph.sub(rows[k].multiplier, graph.mul(weight, moved[k]))
        for k, weight in weights.items()
    }
    return substitute(graph, equations, replacements)


def carried(
    graph: Graph, rows: Sequence[Row], conditions: Sequence[Node], unknowns: Sequence[Node]
) -> dict[Node, Node]:
    """Return lam = mu + w gamma for each multiplier that ``weighted`` replaced by mu - w K a."""
    weights = {k: row.weight for k, row in enumerate(rows) if row.weight is not None and row.give is None}
    gamma = substitute(graph, [conditions[k] for k in weights], dict.fromkeys(unknowns, graph.zero))
    multipliers = [rows[k].multiplier for k in weights]
    return {
        mu: graph.add(mu, graph.mul(weight, rest))
        for mu, weight, rest in zip(multipliers, weights.values(), gamma, strict=True)
    }


def give_way(graph: Graph, change: Node, row: Row, size: Node) -> Node:
    """Return K a + gamma, or whatever a compliant row demands to vanish, with what its multiplier takes from it."""
    assert row.give is not None
    return graph.add(change, graph.mul(size, graph.sub(row.multiplier, row.give.previous)))


def settle(graph: Graph, rows: Sequence[Row], solutions: Sequence[Node]) -> tuple[Node, ...]:
    """Return solutions, of which the last are the multipliers of ``rows``, without the symbols of compliance.

    The first solution is about multipliers of zero, each further one about those of the one before. Where a row gives
    way by the share c of what it would by its own inertia, c^SWEEPS of that is left (iterated Tikhonov regularisation,
    J. T. King and D. Chillingworth 1979; augmented Lagrangian methods do the same).
    """
    solutions = tuple(solutions)
    multipliers = solutions[len(solutions) - len(rows) :]
    soft = [(k, row.give.previous) for k, row in enumerate(rows) if row.give is not None]
    if not soft:
        return solutions
    before = {symbol: graph.zero for _, symbol in soft}
    for _ in range(SWEEPS - 1):
        found = substitute(graph, [multipliers[k] for k, _ in soft], before)
        before = dict(zip((symbol for _, symbol in soft), found, strict=True))
    return tuple(substitute(graph, solutions, before))
