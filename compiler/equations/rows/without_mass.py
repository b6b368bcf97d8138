"""Coordinates without mass: the balance of forces on them, 0 = Q, prescribes their motion as a function of the state.

A coordinate z moves no mass if its rate appears in no energy and in no velocity of a mass. Its row r of the equations of motion then
contains no acceleration. With D = dr/d(der z) over coupled coordinates of this kind,

- directions in which D is regular, as dissipation makes it, have rates: the balance is solved for der(z), and z is a first-order
  state;
- directions n with n^T D = 0 have none: n^T r = 0 is solved for z, and its total derivative for der(z).

So the compiler gives each of these coordinates a prescribed motion (``DriveRow``), whose reaction vanishes. Linear balances are solved
along the structure, nonlinear ones by Newton's method in the graph, from a guess that follows the motion.

Massless coordinates that constraints determine are left to the weights of these (weights.py). If accelerations remain undetermined, a joint
motion of several coordinates may move no mass: then a linear combination of their rows with constant factors contains neither
accelerations nor multipliers, and is such a balance. Rotations are not covered. Dry friction on these coordinates: massless_friction.py.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter
from mechc.lang.units import DIMENSIONLESS, parse_unit

from ...graph import DivisionByZero, Node
from ...graph.differentiate import jacobian
from ...graph.elimination.eliminate import ZeroPivot, solve
from ...graph.elimination.linear import NotAffine, linear_system
from ...graph.elimination.newton import newton, terms_of
from ...graph.evaluate import Tape
from ...graph.rewrite import substitute
from ...mechanics.meaning.symbols import unit_text
from ...mechanics.meaning.unknowns import UnknownSystem
from ...mechanics.system import AssertionRow, DriveRow, InitialRow, MechanicalSystem
from .massless_coordinates import (
    Massless,
    all_but_rotations,
    coupled_groups,
    disturbed_states,
    massless_coordinates,
    zero_parameters,
)
from .massless_friction import (
    MasslessFriction,
    damped,
    frictions_alone,
    refuse_laws,
    refuse_several,
    sprung,
    with_massless_friction,
)
from .residual import residual

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

VANISHING = 1e-9
"""Share of the largest entry of a row below which what elimination leaves of it is rounding."""

ROUNDING = Fraction(1, 10**13)
"""Share of its terms below which a sum is rounding."""

PREFERRED = 1e-3
"""Share of the best pivot that suffices for a coordinate whose start is a guess, where the other one's is stated."""

POLISH = 2
"""Last steps of Newton's method: derivatives up to the third are exact."""

FEW = 4
"""Unknowns up to which steps are solved with pivots chosen at each step."""

LARGEST = 1e300

LARGEST_LAW = 4000
"""Operations of balances that steps may solve: each of the thirty steps repeats them."""

_Solved = tuple[tuple[Node, ...], tuple[Node, ...]]
"""Solutions and pivots."""

_RESISTED = (
    "'{}' has no mass, and the values of this run let its balance of forces contain a rate that it does not contain with "
    "the values of the model"
)
_NO_FORCE = "no force decides the motion"
_NO_DAMPING = "the damping that decides the rate is zero: where a value makes it so, write that into the model, and springs decide the place"
_ACCELERATED = (
    "with the values of the model some motion with '{}' moves no mass, and with those of this run it does"
)


def with_balances(system: MechanicalSystem, reporter: Reporter) -> MechanicalSystem:
    """Return the system with a drive for each coordinate without mass that forces alone move; report those that nothing
    moves."""
    multipliers = _multipliers(system)
    rubs = frictions_alone(system, multipliers)
    found = massless_coordinates(system, {rub.rows.name for rub in rubs})
    if not found:
        return system
    graph = system.graph
    still = {n: graph.zero for moved in system.virtual.values() for n in moved.values}
    state_rates = {system.rate(x): f for x, f in system.xdot.items()}
    raw = residual(system, multipliers)
    rows = dict(
        zip(found, substitute(graph, [raw[m.v] for m in found], {**still, **state_rates}), strict=True)
    )
    work = _Work(system, state_rates, disturbed_states(system, graph.support(*rows.values())), reporter)
    found = [m for m in found if not work.accelerated(rows[m])]
    for m in found:
        rows[m] = work.without_inertia(m, rows[m])
    known = MasslessFriction({}, [], [], [])
    for block in coupled_groups(system, found, rows, {rub.lam for rub in rubs}):
        own = [rows[m] for m in block]
        forces = set(graph.support(*own))
        rubbing = [rub for rub in rubs if rub.lam in forces]
        rates = [system.v[m.v].node for m in block]
        for rub in rubbing:
            refuse_laws(
                system, rub, rates, disturbed_states(system, graph.support(*rub.formulas)), known, reporter
            )
        if rubbing and len(block) == 1 and not any(jacobian(graph, own, rates)):
            if len(rubbing) > 1:
                refuse_several(rubbing, reporter)
            sprung(system, rubbing[0], block[0].v, own[0], state_rates, known, reporter)
            continue
        first = len(work.drives)
        work.solve(block, own)
        if rubbing:
            reporter.stop_on_errors()
            work.drives[first:] = damped(system, rubbing, work.drives[first:], known, reporter)
    reporter.stop_on_errors()
    work.drives += known.drives
    return with_massless_friction(_with_drives(system, work), known)


def with_combined_balances(
    system: MechanicalSystem,
    driven: Mapping[Node, Node],
    prescribed: Collection[int],
    told: Callable[[], Exception],
) -> MechanicalSystem:
    """Return the system with drives for motions of several coordinates together that move no mass, as those of two sliders in a row
    with a mass behind them, or that constraints and forces decide together. Raises what ``told`` returns where there are none.

    Of the rows of the equations of motion a combination with constant factors holds neither accelerations nor multipliers.
    ``driven``, ``prescribed``: what is known of drives so far.
    """
    graph = system.graph
    still = {n: graph.zero for moved in system.virtual.values() for n in moved.values}
    state_rates = {system.rate(x): f for x, f in system.xdot.items()}
    multipliers = _multipliers(system)
    unknowns = [*system.a, *(lam for group in multipliers for lam in group)]
    raw = substitute(graph, residual(system, multipliers), state_rates)
    raw = substitute(graph, raw, {**driven, **still})
    whole = [m for m in all_but_rotations(system) if m.v not in prescribed]
    whole.sort(key=lambda m: not system.start_q[m.q].known)
    rows = [raw[m.v] for m in whole]
    reporter = Reporter()
    work = _Work(system, state_rates, disturbed_states(system, graph.support(*rows)), reporter, combined=True)
    _, balances, taking = work.ranked(whole, rows, unknowns, _ACCELERATED)
    if not balances:
        raise told()
    work.solve(work.following(whole, balances, taking), balances)
    if reporter.has_errors:
        raise told()
    return _with_drives(system, work)


def _with_drives(system: MechanicalSystem, work: _Work) -> MechanicalSystem:
    return replace(
        system,
        drives=(*system.drives, *work.drives),
        initials=(*system.initials, *_stated(system, work.drives)),
        assertions=(*system.assertions, *work.assertions),
        sought=(*system.sought, *work.sought),
    )


def _multipliers(system: MechanicalSystem) -> list[tuple[Node, ...]]:
    """Return the symbols of the forces of constraints, as the equations of motion name them."""
    return [
        tuple(system.graph.symbol(f"#multiplier {n}.{k}") for k in range(len(rows.residuals)))
        for n, rows in enumerate(system.constraints)
    ]


def _stated(system: MechanicalSystem, drives: Sequence[DriveRow]) -> list[InitialRow]:
    """Return the stated starts of what is not a state: conditions on the others."""
    graph = system.graph
    rows = []
    second = DIMENSIONLESS if system.model.dimensionless else parse_unit("s").dimension
    for drive in drives:
        stated = [(system.q[k], system.start_q[k], 0) for k in drive.q]
        stated += [(system.v[i], system.start_v[i], 1) for i in drive.v]
        for scalar, start, order in stated:
            if start.known and start.start is not None:
                unit = unit_text(scalar.variable.type.dimension / second**order)
                residual = graph.sub(scalar.node, start.value)
                rows.append(InitialRow(scalar.name, residual, True, unit, start.start.origin))
    return rows


# ---------------------------------------------------------------- their motion


class _Work:
    """Solves one block after the other; ``drives``, ``assertions`` and ``sought`` are what it found."""

    def __init__(
        self,
        system: MechanicalSystem,
        state_rates: Mapping[Node, Node],
        places: list[dict[Node, float]],
        reporter: Reporter,
        *,
        combined: bool = False,
    ) -> None:
        self.system, self.graph = system, system.graph
        self.state_rates, self.places, self.reporter = state_rates, places, reporter
        self.combined = combined
        self.drives: list[DriveRow] = []
        self.assertions: list[AssertionRow] = []
        self.sought: list[UnknownSystem] = []

    def accelerated(self, row: Node) -> bool:
        """Tell whether accelerations have a share in a balance with the values of the model."""
        entries = jacobian(self.graph, [row], self.system.a)
        return any(entries) and any(m.any() for m in self._matrices(entries, len(self.system.a)))

    def without_inertia(self, m: Massless, row: Node) -> Node:
        """Return a balance without accelerations; assert that they have no share in it, where parameters decide that."""
        graph, system = self.graph, self.system
        (entries,) = jacobian(graph, [row], system.a)
        if not entries:
            return row
        total = graph.zero
        for n in entries.values():
            total = graph.add(total, graph.abs(n))
        scalar = system.v[m.v]
        message = f"'{scalar.of}' has no mass with the values of the model, and some with those of this run"
        self.assertions.append(
            AssertionRow(graph.less_equal(total, graph.zero), message, scalar.variable.origin)
        )
        (still,) = substitute(graph, [row], dict.fromkeys(system.a, graph.zero))
        return still

    def solve(self, block: Sequence[Massless], rows: Sequence[Node]) -> None:
        """Add the drives of a block."""
        system, graph = self.system, self.graph
        places = [system.q[m.q].node for m in block]
        rates = [system.v[m.v].node for m in block]
        if self.combined:
            rows = [self._without_idle(block, i, row, rates) for i, row in enumerate(rows)]
        resisted, balances, _ = self.ranked(block, rows, rates, _RESISTED)
        algebraic = self._solved_for(block, balances, places)
        if algebraic is None:
            return
        moved = [system.rate(n) for n in balances]
        moved = substitute(graph, moved, self.state_rates)
        laws = [*(rows[i] for i in resisted), *moved]
        why = _NO_DAMPING if resisted and not balances else _NO_FORCE
        ahead = self._solved(laws, rates, lambda: self._carried_along(laws, rates, block), block, why)
        sought = [places[k] for k in algebraic]
        first = [system.start_q[block[k].q].value for k in algebraic]
        guesses = self._guesses([block[k] for k in algebraic], [ahead[k] for k in algebraic], first)
        values = self._solved(balances, sought, lambda: guesses, [block[k] for k in algebraic])
        self._keep_balances(balances, sought, values, guesses, [block[k] for k in algebraic])
        known = dict(
            zip(algebraic, zip(values, self._followed(values, guesses, first), strict=True), strict=True)
        )
        for k, m in enumerate(block):
            scalar = system.v[m.v]
            value, guess = known.get(k, (None, None))
            q, found = ((), ()) if value is None else ((m.q,), (value,))
            origin = scalar.variable.origin
            drive = DriveRow((scalar.of,), q, (m.v,), found, (ahead[k],), origin, True, self.combined, guess)
            self.drives.append(drive)

    def _carried_along(
        self, laws: Sequence[Node], rates: Sequence[Node], block: Sequence[Massless]
    ) -> list[Node]:
        """Return rates from which steps begin: those with which what has mass would carry a block along if the dampings were those for
        small rates. The starts where these are stated, or where no damping is left of small rates."""
        graph, system = self.graph, self.system
        begun = [system.start_v[m.v] for m in block]
        first = [start.value for start in begun]
        if any(start.start is not None for start in begun):
            return first
        moving = [s.node for s in system.v]
        resting = dict.fromkeys(moving, graph.zero)
        try:
            slopes = [
                dict(zip(row, substitute(graph, list(row.values()), resting), strict=True))
                for row in jacobian(graph, laws, moving)
            ]
            linear = [graph.dot(list(row.values()), [moving[j] for j in row]) for row in slopes]
            linear = [linear[i] for i in self._matched(linear, rates)]
            found, _ = self._eliminated(linear, rates)
        except (DivisionByZero, NotAffine, ZeroPivot):
            return first
        largest = graph.constant(Fraction(LARGEST))
        return [
            graph.select(graph.less_equal(graph.abs(n), largest), n, other)
            for n, other in zip(found, first, strict=True)
        ]

    def _keep_balances(
        self,
        balances: Sequence[Node],
        places: Sequence[Node],
        values: Sequence[Node],
        guesses: Sequence[Node],
        block: Sequence[Massless],
    ) -> None:
        """Keep the balances that steps solve: a run follows their solutions, and looks for others."""
        graph, system = self.graph, self.system
        if not system.lowering.unknowns.found.keys() & set(values):
            return
        names = tuple(system.v[m.v].of for m in block)
        symbols = tuple(graph.symbol(f"?{name}") for name in names)
        rows = substitute(graph, balances, dict(zip(places, symbols, strict=True)))
        self.sought.append(UnknownSystem(names, symbols, tuple(guesses), tuple(rows)))

    def _guesses(self, block: Sequence[Massless], rates: Sequence[Node], first: Sequence[Node]) -> list[Node]:
        """Return from where steps begin: symbols that follow the motion, so that the solution goes on as it began; the starts where
        rates are unknown, as those of inputs are."""
        graph, system = self.graph, self.system
        if not system.unknown_rates.keys().isdisjoint(graph.support(*rates)):
            return list(first)
        return [graph.symbol(f"guess({system.v[m.v].of})") for m in block]

    def _followed(
        self, values: Sequence[Node], guesses: Sequence[Node], first: Sequence[Node]
    ) -> list[tuple[Node, Node] | None]:
        """Return the guesses that follow the motion, with their first values: the balance at the start."""
        graph, system = self.graph, self.system
        if list(guesses) == list(first) or not graph.reached_among(values, guesses):
            return [None] * len(values)
        starts = dict(zip(guesses, first, strict=True))
        starts |= zip((s.node for s in system.q), (b.value for b in system.start_q), strict=True)
        starts |= zip((s.node for s in system.v), (b.value for b in system.start_v), strict=True)
        starts |= zip((s.node for s in system.symbols.states), (b.value for b in system.start_x), strict=True)
        try:
            begun = substitute(graph, values, starts)
        except DivisionByZero:
            begun = list(first)
        allowed = {system.symbols.time, *(s.node for s in system.symbols.parameters)}
        if not allowed.issuperset(graph.support(*begun)):
            begun = list(first)
        return list(zip(guesses, begun, strict=True))

    def following(
        self, whole: Sequence[Massless], balances: Sequence[Node], taking: Sequence[Sequence[int]]
    ) -> list[Massless]:
        """Return the coordinates that the balances decide, of those whose rows are in them: by their rates where dampings hold these,
        else by their places, those with a guessed start first."""
        import numpy as np

        system = self.system
        allowed = np.zeros((len(balances), len(whole)))
        for i, among in enumerate(taking):
            allowed[i, list(among)] = 1.0
        guessed = [not system.start_q[m.q].known for m in whole]
        for sought in ([system.v[m.v].node for m in whole], [system.q[m.q].node for m in whole]):
            entries = jacobian(self.graph, balances, sought)
            for matrix in self._matrices(entries, len(whole)):
                chosen = _pivots(matrix * allowed, guessed)
                if len(chosen) == len(balances):
                    return [whole[k] for k in chosen]
        return [whole[among[-1]] for among in taking]

    def ranked(
        self, block: Sequence[Massless], rows: Sequence[Node], rates: Sequence[Node], message: str
    ) -> tuple[list[int], list[Node], list[list[int]]]:
        """Return the rows that decide rates, the combinations of rows that hold none, without them, and the rows in each of these.

        What is left of a combination without its rates is made first: equal formulas are one node, which keeps its first form.
        """
        import numpy as np

        from mechc.runtime.numerics.rank import independent_rows, solve

        graph = self.graph
        entries = jacobian(graph, rows, rates)
        if not any(entries):
            return [], list(rows), [[i] for i in range(len(rows))]
        matrices = self._matrices(entries, len(rates))
        if not matrices:
            return list(range(len(rows))), [], []
        scales = np.max([np.abs(d).max(axis=1) for d in matrices], axis=0)
        wide = np.hstack(matrices) / np.where(scales > 0, scales, 1.0)[:, None]
        kept = independent_rows(wide, VANISHING)
        if len(kept) == len(rows):
            return kept, [], []
        others = [i for i in range(len(rows)) if i not in kept]
        combined, taking = list[Node](), list[list[int]]()
        without = [*rates, *self._undamping([entries[i] for i in others])]
        still = substitute(graph, rows, dict.fromkeys(without, graph.zero))
        basis = wide[kept].T if kept else np.zeros((wide.shape[1], 0))
        for i in others:
            shares = solve(basis, wide[i]) if kept else np.zeros(0)
            total, whole, among = still[i], rows[i], [i]
            for j, share in zip(kept, shares, strict=True):
                if abs(share) <= VANISHING:
                    continue
                factor = share * (scales[i] or 1.0) / scales[j]
                exact = Fraction(factor).limit_denominator(1000)
                if abs(float(exact) - factor) > VANISHING * abs(factor):
                    exact = Fraction(factor)
                among.insert(0, j)
                total = graph.sub(total, graph.mul(graph.constant(exact), still[j]))
                whole = graph.sub(whole, graph.mul(graph.constant(exact), rows[j]))
            combined.append(total)
            taking.append(among)
            self._assert_undamped(block, i, whole, rates, message)
        return kept, combined, taking

    def _without_idle(self, block: Sequence[Massless], i: int, row: Node, rates: Sequence[Node]) -> Node:
        """Return a balance without dampings of value zero on other coordinates, whose rates constraints tie to ``rates``."""
        graph = self.graph
        others = [s.node for s in self.system.v if s.node not in rates]
        (entries,) = jacobian(graph, [row], others)
        idle = [others[j] for j, n in entries.items() if self._undamping([{j: n}])]
        if not idle:
            return row
        zeros = self._undamping([{j: n for j, n in entries.items() if others[j] in idle}])
        self._assert_undamped(block, i, row, idle, _RESISTED)
        (still,) = substitute(graph, [row], dict.fromkeys(zeros, graph.zero))
        return still

    def _undamping(self, entries: Sequence[Mapping[int, Node]]) -> list[Node]:
        """Return the parameters of value zero that take the rates out of balances, such as a damping: with them go the rates of what
        has mass, too. ``_assert_undamped`` holds them to that."""
        graph = self.graph
        left = [n for row in entries for n in row.values()]
        zeros = [n for n in graph.support(*left) if n in zero_parameters(self.system)]
        gone = substitute(graph, left, dict.fromkeys(zeros, graph.zero))
        return zeros if all(n == graph.zero for n in gone) else []

    def _assert_undamped(
        self, block: Sequence[Massless], i: int, combined: Node, rates: Sequence[Node], message: str
    ) -> None:
        """Assert that a combination of balances holds no rate, where that is not so whatever the parameters are."""
        graph = self.graph
        (row,) = jacobian(graph, [combined], rates)
        left = [n for n in row.values() if not graph.is_constant(n)]
        if not left:
            return
        holds = graph.one
        for n in left:
            terms = graph.zero
            for term in terms_of(graph, n):
                terms = graph.add(terms, graph.abs(term))
            holds = graph.logical_and(
                holds, graph.less_equal(graph.abs(n), graph.mul(graph.constant(ROUNDING), terms))
            )
        if holds == graph.one:
            return
        scalar = self.system.v[block[i].v]
        message = message.format(scalar.of)
        self.assertions.append(AssertionRow(holds, message, scalar.variable.origin))

    def _solved_for(
        self, block: Sequence[Massless], balances: Sequence[Node], places: Sequence[Node]
    ) -> list[int] | None:
        """Return the coordinates for which balances without rates are solved; report what none of them decides."""
        if not balances:
            return []
        entries = jacobian(self.graph, balances, places)
        matrices = self._matrices(entries, len(places))
        guessed = [not self.system.start_q[m.q].known for m in block]
        best: list[int] = []
        for matrix in matrices:
            chosen = _pivots(matrix, guessed)
            if len(chosen) > len(best):
                best = chosen
            if len(best) == len(balances):
                return sorted(best)
        names = [self.system.v[m.v].of for m in block]
        touched = (
            [k for k in range(len(block)) if k not in best]
            if len(balances) == len(block)
            else range(len(block))
        )
        loose = [names[k] for k in touched]
        scalar = self.system.v[block[next(iter(touched))].v]
        alone = len(block) == 1
        self.reporter.error(
            "E0520",
            f"nothing with mass moves with '{loose[0]}', and no force decides where it is"
            if alone
            else f"nothing with mass moves with {_listed(names)} together, and no force decides where they are",
            scalar.variable.origin.shown,
            caption="the balance of forces does not depend on this coordinate"
            if alone
            else "the balances of forces leave a motion of them open",
            help="give a mass to what it moves, connect it by a spring or a damping, or remove the coordinate",
        )
        return None

    def _matrices(self, entries: Sequence[Mapping[int, Node]], width: int) -> list[Array]:
        """Return a Jacobian as numbers at the places where it has a value."""
        import numpy as np

        flat = [(i, j, n) for i, row in enumerate(entries) for j, n in row.items()]
        tape = Tape(self.graph, [n for *_, n in flat], self.places[0])
        found = []
        for place in self.places:
            values = tape(place)
            matrix = np.zeros((len(entries), width))
            for i, j, n in flat:
                matrix[i, j] = values[n]
            if np.isfinite(matrix).all():
                found.append(matrix)
        return found

    def _solved(
        self,
        rows: Sequence[Node],
        unknowns: Sequence[Node],
        guesses: Callable[[], Sequence[Node]],
        block: Sequence[Massless],
        why: str = _NO_FORCE,
    ) -> tuple[Node, ...]:
        """Return formulas of the unknowns that make the rows vanish; ``why``: what is said of a run in which they do not decide them."""
        if not rows:
            return ()
        try:
            order = self._matched(rows, unknowns)
            ordered = [rows[i] for i in order]
            solutions, pivots = self._by_shares(ordered, unknowns) or self._eliminated(ordered, unknowns)
        except NotAffine:
            return self._by_steps(rows, unknowns, guesses(), block)
        except ZeroPivot:
            raise self._undecided(block) from None
        self._assert_decided(pivots, block, why)
        return solutions

    def _eliminated(self, rows: Sequence[Node], unknowns: Sequence[Node]) -> _Solved:
        found = solve(self.graph, rows, unknowns)
        return found.solutions, found.pivots

    def _by_shares(self, rows: Sequence[Node], unknowns: Sequence[Node]) -> _Solved | None:
        """Return the solution of linear rows as shares of the few forces that change, such as that at the end of a chain of springs.

        The shares depend on parameters alone, so that a run finds them once. None where elimination has fewer products.
        """
        graph = self.graph
        fixed = {s.node for s in self.system.symbols.parameters}
        entries = jacobian(graph, rows, unknowns)
        if not fixed.issuperset(graph.support(*(n for row in entries for n in row.values()))):
            return None
        offsets = substitute(graph, rows, dict.fromkeys(unknowns, graph.zero))
        moving = [i for i, n in enumerate(offsets) if not fixed.issuperset(graph.support(n))]
        if len(rows) < 2 or len(moving) * len(rows) > sum(map(len, entries)):
            return None
        linear_system(graph.fork(), rows, unknowns)
        linear = [graph.sum(graph.mul(n, unknowns[j]) for j, n in row.items()) for row in entries]
        still = [graph.zero if i in moving else n for i, n in enumerate(offsets)]
        total, pivots = self._eliminated(
            [graph.add(a, b) for a, b in zip(linear, still, strict=True)], unknowns
        )
        solutions = list(total)
        for i in moving:
            forced = [graph.add(n, graph.one) if k == i else n for k, n in enumerate(linear)]
            shares, _ = self._eliminated(forced, unknowns)
            solutions = [
                graph.add(n, graph.mul(share, offsets[i])) for n, share in zip(solutions, shares, strict=True)
            ]
        return tuple(solutions), pivots

    def _matched(self, rows: Sequence[Node], unknowns: Sequence[Node]) -> Sequence[int]:
        """Return the rows in an order in which each holds the unknown of its place, as balances do of their own coordinates."""
        import numpy as np

        if len(rows) == 1:
            return [0]
        entries = jacobian(self.graph, rows, unknowns)
        from scipy.optimize import linear_sum_assignment

        sizes = np.zeros((len(rows), len(unknowns)))
        for matrix in self._matrices(entries, len(unknowns)):
            sizes = np.maximum(sizes, np.abs(matrix))
        largest = sizes.max(axis=1, keepdims=True)
        shares = np.log(np.maximum(sizes / np.where(largest > 0, largest, 1.0), 1e-30))
        i, j = linear_sum_assignment(shares, maximize=True)
        return [int(k) for _, k in sorted(zip(j, i, strict=True))]

    def _by_steps(
        self,
        rows: Sequence[Node],
        unknowns: Sequence[Node],
        guesses: Sequence[Node],
        block: Sequence[Massless],
    ) -> tuple[Node, ...]:
        graph = self.graph
        slopes = [n for row in jacobian(graph, rows, unknowns) for n in row.values()]
        if len(graph.reach([*rows, *slopes])) > LARGEST_LAW:
            raise self._too_large(block)
        try:
            many = len(rows) > FEW
            rows = [rows[i] for i in self._matched(rows, unknowns)] if many else rows
            found = newton(graph, rows, unknowns, guesses, POLISH, along=many)
        except (DivisionByZero, ZeroPivot):
            raise self._undecided(block) from None
        holds = graph.one
        for n in found:
            holds = graph.logical_and(
                holds, graph.less_equal(graph.abs(n), graph.constant(Fraction(LARGEST)))
            )
        names = _listed([self.system.v[m.v].of for m in block])
        origin = self.system.v[block[0].v].variable.origin
        self.system.lowering.unknowns.found |= dict.fromkeys(found)
        message = f"no balance of forces on {names} is found from the start"
        self.assertions.append(AssertionRow(holds, message, origin))
        return found

    def _assert_decided(self, pivots: Sequence[Node], block: Sequence[Massless], why: str) -> None:
        """Assert that no pivot is rounding, where states or parameters decide that."""
        graph = self.graph
        holds = graph.one
        for pivot in pivots:
            if graph.is_constant(pivot):
                continue
            terms = graph.zero
            for term in terms_of(graph, pivot):
                terms = graph.add(terms, graph.abs(term))
            least = graph.mul(graph.constant(ROUNDING), terms)
            holds = graph.logical_and(holds, graph.less(least, graph.abs(pivot)))
        if holds == graph.one:
            return
        names = _listed([self.system.v[m.v].of for m in block])
        origin = self.system.v[block[0].v].variable.origin
        message = f"nothing with mass moves with {names}, and {why}"
        self.assertions.append(AssertionRow(holds, message, origin))

    def _undecided(self, block: Sequence[Massless]) -> Exception:
        return self._refused(
            block,
            "E0520",
            "at the start no force decides the motion",
            caption="the balance of forces does not depend on this coordinate there",
            help="guess a start or a rate where a spring or a damping acts on it, as 'initial der(q) ~ ..'; or give a mass to what "
            "it moves",
        )

    def _too_large(self, block: Sequence[Massless]) -> Exception:
        return self._refused(
            block,
            "E0591",
            "the law of the forces on it is too long to be solved",
            caption="the balance of forces determines this coordinate, by a law of thousands of operations",
            help="give a mass to what it moves: 'kinetic 1/2*m*der(q)^2;'",
        )

    def _refused(
        self, block: Sequence[Massless], code: str, why: str, *, caption: str, help: str
    ) -> Exception:
        moved = [self.system.v[m.v] for m in block]
        message = f"nothing with mass moves with {_listed([one.of for one in moved])}, and {why}"
        return self.reporter.fail(code, message, moved[0].variable.origin.shown, caption=caption, help=help)


def _listed(names: Sequence[str]) -> str:
    shown = [f"'{name}'" for name in names[:4]]
    if len(names) > len(shown):
        return ", ".join(shown) + f" and {len(names) - len(shown)} more"
    return " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)


def _pivots(matrix: Array, preferred: Sequence[bool]) -> list[int]:
    """Return columns that make the rows regular, of those with a large pivot the preferred ones; columns and rows count by their
    largest entry."""
    import numpy as np

    left = matrix
    for axis in (0, 1):  # whatever the units are
        sizes = np.abs(left).max(axis=axis, keepdims=True)
        left = left / np.where(sizes > 0, sizes, 1.0)
    open_rows = list(range(len(matrix)))
    chosen: list[int] = []
    while open_rows:
        sizes = np.abs(left[open_rows]).max(axis=0)
        sizes[chosen] = 0.0
        if not sizes.max(initial=0.0) > VANISHING:
            break
        liked = np.where(preferred, sizes, PREFERRED * sizes)
        column = int(liked.argmax())
        row = max(open_rows, key=lambda i: abs(left[i, column]))
        open_rows.remove(row)
        chosen.append(column)
        for i in open_rows:
            left[i] = left[i] - left[row] * (left[i, column] / left[row, column])
    return chosen
