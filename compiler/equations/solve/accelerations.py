"""Accelerations and multipliers from the residual, by elimination along the structure of the model."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from fractions import Fraction
from functools import partial

from msgspec import Struct

from mechc.lang.diagnostics import Reporter

from ...flat.model import Kind
from ...graph import Node
from ...graph.differentiate import jacobian
from ...graph.elimination.eliminate import VARIANTS, Elimination, ZeroPivot, solve
from ...graph.rewrite import substitute
from ...mechanics.system import AssertionRow, ConstraintRows, MechanicalSystem
from ..rows.constraints import Row, carried, settle, weighted
from ..rows.residual import constraint_rates
from .unknown_forces import UnknownForces, report_circle

ROUNDING = Fraction(1, 10**14)
"""Share of the terms of a sum below which the sum is rounding."""
LARGEST_WHOLE = 16
"""Unknowns above which the code of the whole matrix is far longer than any other; it is not formed then."""


class Accelerations(Struct, frozen=True):
    """``a`` for each free velocity, ``multipliers`` for each kept constraint row, ``forces`` for each that is asked for
    by others; ``pivots`` must not vanish, as the assertions ``determined`` say where that depends on parameters or states."""

    a: tuple[Node, ...]
    multipliers: tuple[Node, ...]
    forces: tuple[Node, ...]
    elimination: Elimination
    determined: tuple[AssertionRow, ...]


class Undetermined(Exception):
    """Accelerations that nothing determines; ``told`` reports which, and returns what to raise."""

    def __init__(self, told: Callable[[], Exception]) -> None:
        super().__init__()
        self.told = told


def accelerations(
    system: MechanicalSystem,
    residual: Sequence[Node],
    free: Sequence[int],
    rows: Sequence[Row],
    supports: Sequence[Collection[int]],
    forces: UnknownForces,
    reporter: Reporter,
    *,
    whole: bool = False,
) -> Accelerations:
    """Solve r - K^T lam = 0 with K a + gamma = 0, or with what the modes of a row say instead.

    ``supports``: for each of the first rows the free velocities on which it depends at consistent states. Its
    multiplier is eliminated right after them, so that the cost of many loops grows with their number and not with
    its square. The other rows are switched: where they are off, the multiplier is in its own row with a factor that
    vanishes in other modes, so it comes last but for ``forces``, on which any equation may depend. ``whole`` factorises the matrix without looking at the structure.
    """
    sought = [system.a[i] for i in free]
    multipliers = [row.multiplier for row in rows]
    unknowns = [*sought, *multipliers, *forces.symbols]
    conditions = [row.equation for row in rows]
    balance = weighted(system.graph, [residual[i] for i in free], rows, conditions, sought)
    reactions = carried(system.graph, rows, conditions, sought)
    laws = substitute(system.graph, [*conditions, *forces.equations], reactions)
    equations = [*balance, *laws]
    after: dict[int, Collection[int]] = {len(free) + k: support for k, support in enumerate(supports)}
    after |= {k: range(k) for k in range(len(free) + len(supports), len(unknowns))}
    try:
        variants = () if whole and len(unknowns) <= LARGEST_WHOLE else VARIANTS
        found = solve(system.graph, equations, unknowns, after=after, variants=variants)
    except ZeroPivot as singular:
        if singular.unknown >= len(free) + len(rows):
            from ...graph.elimination.clashes import clash

            contrary = clash(system.graph, equations, unknowns, [system.graph.zero] * len(unknowns))
            raise report_circle(system, forces.symbols, reporter, contrary=contrary) from None
        raise Undetermined(partial(massless, system, residual, free, rows, singular, reporter)) from None
    values = dict(zip(unknowns, found.solutions, strict=True))
    order = (*forces.symbols, *sought, *multipliers)
    values = dict(zip(order, settle(system.graph, rows, [values[n] for n in order]), strict=True))
    values |= zip(reactions, substitute(system.graph, list(reactions.values()), values), strict=True)
    a, lam, others = (tuple(values[n] for n in symbols) for symbols in (sought, multipliers, forces.symbols))
    weighing = any(row.weight is not None for row in rows)
    asserted = determined(system, balance, free, found) if weighing else ()
    return Accelerations(a, lam, others, found, asserted)


def _coupled(
    system: MechanicalSystem, residual: Sequence[Node], free: Sequence[int], unknown: int
) -> list[str]:
    """Return the coordinates that share inertia with one that has no pivot; nothing if it has no inertia at all."""
    (row,) = jacobian(system.graph, [residual[unknown]], [system.a[i] for i in free])
    if unknown not in row:
        return []
    coupled = [system.v[free[j]] for j in row]
    return list(
        dict.fromkeys(s.variable.name if s.variable.type.kind is Kind.ROTATION else s.of for s in coupled)
    )


def _follows_force(system: MechanicalSystem, rows: ConstraintRows) -> bool:
    """Tell whether a friction that is in no contact has a limit in which a force stands."""
    mode = rows.mode
    if mode is None or mode.contact:
        return False
    limits = (mode.kinetic, mode.static, mode.backward, mode.static_backward)
    return not system.queries.keys().isdisjoint(system.graph.support(*(n for n in limits if n is not None)))


def _cure(system: MechanicalSystem, rate: Node) -> str:
    """Say what helps a coordinate that moves nothing with mass."""
    switched = [(rows, rows.mode.kind) for rows in system.constraints if rows.mode is not None]
    free = [n for rows, kind in switched if kind == "freewheel" for n in constraint_rates(system, rows)]
    if rate in system.graph.support(*free):
        return "a freewheel acts on what has mass: give some to what it moves, or a large limit in place of 'infinite'"
    for rows, kind in switched:
        if (
            kind == "friction"
            and rate in system.graph.support(*constraint_rates(system, rows))
            and _follows_force(system, rows)
        ):
            return (
                f"the limit of the friction '{rows.name}' follows a force, and such a friction acts on what has mass: give some to what it "
                "moves; a damping needs none"
            )
    rates = [n for rows, _ in switched for n in constraint_rates(system, rows)]
    if rate in system.graph.support(*rates):
        return "contacts and friction in contacts act on what has mass: give some to what it moves; a damping needs none"
    return (
        "give a mass or an inertia to what it moves, or remove the coordinate; points and thin rods on the axis of a hinge have "
        "none about it"
    )


def massless(
    system: MechanicalSystem,
    residual: Sequence[Node],
    free: Sequence[int],
    rows: Sequence[Row],
    singular: ZeroPivot,
    reporter: Reporter,
) -> Exception:
    """Report which accelerations, or which reaction of the ``rows``, cannot be found."""
    if singular.unknown < len(free):
        scalar = system.v[free[singular.unknown]]
        coupled = _coupled(system, [residual[i] for i in free], free, singular.unknown)
        if coupled:
            names = " and ".join(f"'{name}'" for name in coupled)
            return reporter.fail(
                "E0520",
                f"some motion of {names} together moves no mass",
                scalar.variable.origin.shown,
                caption="the accelerations of these coordinates are undetermined",
                help="the mass matrix is singular: give a mass to what moves then, or use fewer coordinates",
            )
        return reporter.fail(
            "E0520",
            f"nothing with mass moves with '{scalar.variable.name}'",
            scalar.variable.origin.shown,
            caption="the acceleration of this coordinate is undetermined",
            help=_cure(system, scalar.node),
        )
    row = rows[singular.unknown - len(free)]
    return reporter.fail(
        "E0520",
        f"constraint '{row.title}' has no reaction that could be found",
        row.constraint.origin.shown,
        caption="nothing with mass moves with it, or the others imply it",
        help="give a mass or an inertia to what it moves, or remove the constraint",
    )


def determined(
    system: MechanicalSystem, balance: Sequence[Node], free: Sequence[int], found: Elimination
) -> tuple[AssertionRow, ...]:
    """Return assertions that the pivots of accelerations are more than rounding; ``balance``: the equations they were found in.

    Parameters and states may leave a motion that moves no mass and that no constraint holds. Its pivot is what rounding leaves of
    zero, and the accelerations made with it are numbers all the same.
    """
    graph = system.graph
    entries = jacobian(graph, balance, [system.a[i] for i in free])
    asserted = []
    for k, row, pivot in zip(found.order, found.rows, found.pivots, strict=True):
        if k < len(free) and row == k:
            least = graph.mul(graph.constant(ROUNDING), entries[k].get(k, graph.zero))
            scalar = system.v[free[k]].variable
            message = f"some motion with '{scalar.name}' moves no mass, and no constraint decides it"
            asserted.append(AssertionRow(graph.less(least, pivot), message, scalar.origin))
    return tuple(asserted)
