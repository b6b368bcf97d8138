"""Hamilton's function, Hamilton's equations and Routh's function as formulas in coordinates and momenta.

The Legendre transformation is done with numbers at random states; formulas are fitted to them in a span of products of momenta and
functions of the coordinates, and hold at further states to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from msgspec import Struct

from ...case import Case, inputs_at
from ...numerics.rank import FORMULAS, solve
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ..findings import Curve, Findings, Panel, Table
from ..formulas.coefficients import digits, fraction, recognised, shown
from ..formulas.combination import MOST_PARAMETERS, sum_text, tidy
from ..formulas.monomials import MonomialVariable, Terms
from ..formulas.null_space import independent_columns
from ..formulas.relations import Chance
from ..formulas.sampling import PhaseSample, Sampler
from ..study import OF_A_MOTION, Study
from .symmetries import case_of

FITS = 1e-9
"""Largest relative difference of a formula from the numbers that it stands for, at states that it was not found from."""

MOST_FORMULA = 40
"""Terms of a formula that is worth showing."""

Wanted = Callable[[PhaseSample], Array]


class HamiltonEquation(Struct, frozen=True):
    """``left`` = ``right``; ``right`` empty where there is no formula in the span; ``off``: largest relative difference."""

    left: str
    right: str
    off: float | None


class Hamilton(Study, frozen=True, kw_only=True):
    """H in coordinates and momenta, Hamilton's equations, and Routh's function for cyclic coordinates."""

    unused = OF_A_MOTION
    needs = frozenset({"phase"})

    def solve(self, problem: Problem) -> Findings:
        """Form them. Raises SimulationError for models with constraints."""
        case = case_of(problem, self)
        if problem.constraints:
            raise SimulationError(
                f"'{problem.name}' has constraints: its coordinates and momenta are not free",
                help="write it in independent coordinates",
            )
        fit = _Fit(case)
        n = problem.nv
        energy = next(k for k, q in enumerate(problem.phase) if q.kind == "energy")
        momenta = [k for k, q in enumerate(problem.phase) if q.kind == "momentum"]
        if not _are_conjugate(case, energy, momenta):
            raise SimulationError(
                f"the Lagrangian of '{problem.name}' holds accelerations: it has no Hamilton's equations in its coordinates and their momenta",
                help="add the time derivative of a function of coordinates and time that cancels them; it does not change the motion",
            )
        names = fit.names
        equations = [fit.equation("H", lambda s: s.phase[:, energy], 2)]
        root = ""
        if not equations[0].right:
            squared = fit.equation("H^2", lambda s: s.phase[:, energy] ** 2, 2)
            root = f"sqrt({squared.right})" if squared.right else ""
            if root:
                equations[0] = HamiltonEquation("H", root, squared.off)
        turning = {i + k for i in problem.rotations for k in range(4)}
        for k in range(problem.nq, problem.nq + n):  # of a rotation the angular velocity, der(R)[1]
            equations.append(fit.over(problem.states[k].name, partial(_rate_of, k), 1, root, energy))
        for i, k in enumerate(momenta):
            equations.append(fit.over(f"der({names[i]})", partial(_slope_of, k), 2, root, energy))
        definitions = [
            HamiltonEquation(names[i], problem.phase[k].name, 0.0)
            for i, k in enumerate(momenta)
            if problem.phase[k].name and not problem.phase[k].name.startswith("momentum(")
        ]
        cyclic = _cyclic(case, momenta)
        routh = None
        if cyclic and len(cyclic) < n and not turning:
            routh = fit.routh(cyclic, energy, momenta)
        tables = [
            Table("momenta", (("", ""), ("", "")), tuple((e.left, e.right) for e in definitions)),
            Table(
                "Hamilton's equations",
                (("", ""), ("", ""), ("off by", "")),
                tuple((e.left, e.right or "no short formula in the span", e.off) for e in equations),
            ),
        ]
        if routh is not None:
            kept = ", ".join(names[i] for i in cyclic)
            tables.append(
                Table(
                    f"Routh's function, {kept} constant",
                    (("", ""), ("", "")),
                    ((routh.left, routh.right or "no short formula in the span"),),
                )
            )
        return Findings(
            study="hamilton",
            model=problem.name,
            outcome=Outcome.COMPLETED,
            message="Hamilton's function" if equations[0].right else "no formula of H in the span",
            errors_from="difference from the Legendre transformation at further random states",
            remarks=(*(f"{names[i]} is constant" for i in cyclic), *_left_out(problem)),
            tables=tuple(table for table in tables if table.rows),
            panels=(_panel(case, energy),),
            details={
                "H": equations[0].right or None,
                "equations": {e.left: e.right or None for e in equations[1:]},
                "momenta": {e.left: e.right for e in definitions},
                "cyclic": [names[i] for i in cyclic],
                "routhian": routh.right if routh is not None and routh.right else None,
                "accuracy": {"off": {e.left: e.off for e in equations}},
            },
        )


class _Fit:
    """Formulas fitted to numbers, in products of momenta and functions of coordinates."""

    def __init__(self, case: Case) -> None:
        self.case, self.problem = case, case.problem
        nq = self.problem.nq
        rates = [state.name for state in self.problem.states[nq : nq + self.problem.nv]]
        self.coordinates = [rate.removeprefix("der(").replace(")", "", 1) for rate in rates]
        self.names = [f"p_{name}" for name in self.coordinates]
        momenta = [k for k, q in enumerate(self.problem.phase) if q.kind == "momentum"]
        self.moving = [MonomialVariable(self.names[i], "phase", k, True) for i, k in enumerate(momenta)]
        self.chance = Chance(case)

    def equation(
        self, left: str, wanted: Wanted, degree: int, moving: Sequence[MonomialVariable] | None = None
    ) -> HamiltonEquation:
        """Return a formula of numbers at states."""
        for factors in (degree + 2, degree + 4):
            terms = Terms(
                self.case, degree, factors=factors, moving=self.moving if moving is None else moving
            )
            terms.listed = [m for m in terms.listed if m.whole < 0]
            found = self._one(left, wanted, terms)
            if found is not None:
                return found
        return HamiltonEquation(left, "", None)

    def over(self, left: str, wanted: Wanted, degree: int, root: str, energy: int) -> HamiltonEquation:
        """Return a formula of a rate; where H is a root, also one of the rate times H, divided by it."""
        found = self.equation(left, wanted, degree)
        if found.right or not root:
            return found
        product = self.equation(left, lambda s: wanted(s) * s.phase[:, energy], degree)
        if not product.right:
            return found
        above = product.right if _is_product(product.right) else f"({product.right})"
        return HamiltonEquation(left, f"{above}/{root}", product.off)

    def _one(self, left: str, wanted: Wanted, terms: Terms) -> HamiltonEquation | None:
        sample = Sampler(self.case, seed=41).states(2 * len(terms.listed) + 30, wide=True)
        kept = independent_columns(terms.values(sample)[0])
        terms.keep(kept)
        vector, off = self._solve(wanted, terms, sample)
        check = Sampler(self.case, seed=43).states(40, wide=True)
        values, target = self._columns(terms, check), wanted(check)
        size = np.abs(values * vector).sum(axis=1) + np.abs(target) + 1e-300
        off = float((np.abs(values @ vector - target) / size).max(initial=0.0))
        places = [int(k) for k in np.flatnonzero(vector)]
        if off > FITS or len(places) > MOST_FORMULA:
            return None
        if len(places) == 0:
            return HamiltonEquation(left, "0", off)
        texts = self._texts(vector, places, wanted, terms)
        names = [v.name for v in terms.variables]
        listed = ["1" if k == 0 else terms.text(terms.listed[k - 1], names) for k in places]
        return HamiltonEquation(left, tidy(sum_text(texts, listed), self.problem), off)

    def _columns(self, terms: Terms, sample: PhaseSample) -> Array:
        return np.hstack([np.ones((len(sample.t), 1)), terms.values(sample)[0]])

    def _solve(self, wanted: Wanted, terms: Terms, sample: PhaseSample) -> tuple[Array, float]:
        values, target = self._columns(terms, sample), wanted(sample)
        if not target.any():  # as the rate of the momentum of a cyclic coordinate
            return np.zeros(values.shape[1]), 0.0
        rows = np.maximum(np.abs(target), 1e-3 * np.abs(target).max())
        scale = np.abs(values / rows[:, None]).max(axis=0)
        scale = np.where(scale > 0, scale, 1.0)
        solution = solve(values / rows[:, None] / scale, target / rows, FORMULAS)
        sizes = np.abs(solution)
        solution = np.where(sizes < 1e-9 * sizes.max(initial=0.0), 0.0, solution)
        return solution / scale, 0.0

    def _texts(self, vector: Array, places: Sequence[int], wanted: Wanted, terms: Terms) -> list[str]:
        """Return the coefficients as formulas of the parameters."""
        plain = [
            shown(f) if (f := fraction(float(vector[k]))) is not None else digits(float(vector[k]))
            for k in places
        ]

        def at(p: Array) -> Array | None:
            try:
                sample = Sampler(self.case, seed=self.chance.seed()).states(2 * len(places) + 10, p)
            except SimulationError:
                return None
            values, target = self._columns(terms, sample)[:, places], wanted(sample)
            scale = np.abs(values).max(axis=0)
            solution = solve(values / scale, target, FORMULAS)
            off = np.abs(values / scale @ solution - target).max()
            return solution / scale if off <= 1e-8 * (np.abs(target).max() or 1.0) else None

        base = vector[places]
        relevant = []
        for k in self.chance.free:
            other = at(self.chance.values({k}))
            if other is None or np.abs(other / base - 1).max() > 1e-7:
                relevant.append(k)
        if not relevant or len(relevant) > MOST_PARAMETERS:
            return plain
        names = [self.problem.parameters[k].name for k in relevant]
        count = 1 + len(relevant) + len(relevant) * (3 * len(relevant) - 1) // 2 + 6
        rows, settings = [], []
        for _ in range(2 * count):
            p = self.chance.values(set(relevant))
            found = at(p)
            if found is not None:
                rows.append(found)
                settings.append(p[relevant])
            if len(rows) == count:
                break
        if len(rows) < len(relevant) + 4:
            return plain
        values, given = np.array(rows), np.array(settings)
        return [recognised(values[:, j], given, names) or plain[j] for j in range(len(places))]

    def routh(self, cyclic: Sequence[int], energy: int, momenta: Sequence[int]) -> HamiltonEquation:
        """Return R = L - sum of p q' over cyclic coordinates, in their momenta and the other velocities."""
        nq = self.problem.nq
        others = [i for i in range(self.problem.nv) if i not in cyclic]
        moving = [self.moving[i] for i in cyclic]
        moving += [MonomialVariable(self.problem.states[nq + i].name, "y", nq + i, True) for i in others]

        def wanted(s: PhaseSample) -> Array:
            total: Array = sum(s.phase[:, momenta[i]] * s.y[:, nq + i] for i in others) - s.phase[:, energy]
            return total

        return self.equation("R", wanted, 2, moving)


def _is_product(text: str) -> bool:
    """Whether a formula is not a sum."""
    return " + " not in text and " - " not in text


def _rate_of(place: int, sample: PhaseSample) -> Array:
    found: Array = sample.y[:, place]
    return found


def _slope_of(place: int, sample: PhaseSample) -> Array:
    found: Array = sample.phase_rate[:, place]
    return found


def _are_conjugate(case: Case, energy: int, momenta: Sequence[int]) -> bool:
    """Tell whether dE/dv = v dp/dv, as of E = v p - L with p = dL/dv."""
    nq, nv = case.problem.nq, case.problem.nv
    gradient = case.functions.phase_gradient
    assert gradient is not None
    sample = Sampler(case, seed=7).states(8)
    for t, y in zip(sample.t, sample.y, strict=True):
        rows = gradient(t, y, inputs_at(case, t), case.z, case.p).reshape(-1, nq + nv)[:, nq:]
        terms = y[nq : nq + nv, None] * rows[momenta]
        if np.any(np.abs(rows[energy] - terms.sum(axis=0)) > FITS * np.abs(terms).sum(axis=0)):
            return False
    return True


def _cyclic(case: Case, momenta: Sequence[int]) -> list[int]:
    sample = Sampler(case, seed=5).states(20)
    rates = np.abs(sample.phase_rate[:, momenta]).max(axis=0)
    largest = float(np.abs(sample.phase_rate).max(initial=0.0)) or 1.0
    return [i for i, rate in enumerate(rates) if rate <= 1e-12 * largest]


def _panel(case: Case, energy: int) -> Panel:
    """Draw H over the first momentum, at the start."""
    problem = case.problem
    y = case.y0.copy()
    reach = float(Sampler(case).width[problem.nq])
    speeds = np.linspace(-2 * reach, 2 * reach, 81)
    momentum = next(k for k, q in enumerate(problem.phase) if q.kind == "momentum")
    p, h = [], []
    for v in speeds:
        y[problem.nq] = v
        assert case.functions.phase is not None
        found = case.functions.phase(case.begin, y, inputs_at(case, case.begin), case.z, case.p)
        p.append(found[momentum])
        h.append(found[energy])
    name = problem.states[problem.nq].name.removeprefix("der(").replace(")", "", 1)
    return Panel(
        "H at the start",
        f"p_{name}",
        problem.phase[momentum].unit,
        "H",
        problem.phase[energy].unit,
        (Curve("H", np.array(p), np.array(h)),),
    )


def _left_out(problem: Problem) -> tuple[str, ...]:
    """Say what the equations do not hold of a model that switches: contacts, friction, other laws, events."""
    hybrid, found = problem.hybrid, []
    if hybrid is None:
        return ()
    for kind in dict.fromkeys(row.kind for row in hybrid.rows):
        listed = ", ".join(f"'{row.name}'" for row in hybrid.rows if row.kind == kind)
        word = {
            "contact": "contacts, which are not part of H",
            "friction": "dry friction, which H knows nothing of",
            "freewheel": "dry friction, which H knows nothing of",
        }.get(kind, "constraints that can let go")
        found.append(f"these equations are without {listed}: {word}")
    if hybrid.switches or hybrid.branches:
        found.append(
            "these equations hold while what switches stays as it is at the start, and between events"
        )
    return tuple(found)
