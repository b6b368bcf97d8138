"""Is a force field conservative? Its curl, potential, circulation, and the parameters that make it so."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Annotated, Any

import numpy as np
from scipy.optimize import least_squares

from ...case import Case, inputs_at
from ...numerics.rank import FORMULAS, solve
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...results.files import json_number
from ...settings import settable
from ..findings import Curve, Findings, Panel, Table, Value
from ..formulas.coefficients import digits, fraction, shown
from ..formulas.combination import sum_text, tidy
from ..formulas.monomials import Terms
from ..formulas.null_space import independent_columns
from ..formulas.relations import Chance
from ..formulas.sampling import Sampler
from ..study import OF_A_MOTION, Study
from .symmetries import case_of

STATES = 30
STEP = 1e-3
"""Of the width of a coordinate: step of the differences that give the curl, of fourth order."""

ZERO = 1e-7
"""Of the largest derivative of a force: a curl below that is none."""

OVER = ("J", "N", "N/m")
"""Unit of an energy over no length, one, or two."""
LENGTHS = {"m": 1, "rad": 0, "1": 0, "": 0}
"""How many lengths a coordinate of a unit is; of others no unit of the curl is told."""

POINTS = 256
"""Of the loop; the rule converges faster than any power, as the field is periodic along it."""


class Field(Study, frozen=True, kw_only=True):
    """The generalised forces at rest as a field of the coordinates: dF_i/dq_j - dF_j/dq_i, its potential, its work
    round a circle about the start, and values of ``vary`` for which it is conservative."""

    unused = OF_A_MOTION
    needs = frozenset({"phase"})
    vary: Annotated[
        tuple[str, ...] | None,
        settable("Parameters whose values are sought for which the curl vanishes.", "directions"),
    ] = None
    radius: Annotated[
        float | None,
        settable("Radius of the circle in the first two coordinates, in SI (default: 1).", "number"),
    ] = None

    def solve(self, problem: Problem) -> Findings:
        """Look at the field. Raises SimulationError for rotations and constraints, which have no such coordinates."""
        case = case_of(problem, self)
        if problem.rotations or problem.constraints or problem.nq != problem.nv:
            raise SimulationError(
                f"the forces of '{problem.name}' are not a field of free coordinates",
                help="a particle with coordinates x, y, z and forces on them has one",
            )
        forces = Forces(case)
        curl, slopes = forces.curl(case.p)
        largest = float(np.abs(curl).max(initial=0.0))
        size = float(np.abs(slopes).max(initial=0.0)) or 1.0
        free = largest <= ZERO * size
        radius = 1.0 if self.radius is None else self.radius
        units = forces.units()
        same = next(iter(units.values())) if len(set(units.values())) == 1 else ""
        values = [Value("largest curl", same, largest, ZERO * size)]
        circle: tuple[float, float] | None = None
        if problem.nq >= 2:
            circle = forces.circulation(radius)
            values.append(Value("circulation", "J" if problem.phase[0].unit else "", *circle))
        here, off = forces.at_start()
        names = forces.names
        if len({state.unit for state in problem.states[: problem.nq]}) == 1:
            unit = same or units.get((0, 0), "")
            values.append(Value("divergence at the start", unit, float(np.trace(here)), float(np.trace(off))))
        for a, b in combinations(range(len(names)), 2):
            name = f"curl at the start, {names[a]} to {names[b]}"
            turn, error = float(here[b, a] - here[a, b]), float(off[b, a] + off[a, b])
            values.append(Value(name, units[a, b], turn, error))
        potential = forces.potential() if free else ""
        sought = self._sought(case, forces)
        around = circle is not None and abs(circle[0]) > max(10 * circle[1], 1e-9 * forces.size * radius)
        verdict = (
            "not conservative: its curl does not vanish"
            if not free
            else "free of curl, but its work round the loop is not zero: a place inside is left out"
            if around
            else "conservative"
        )
        remarks = [f"potential: {potential}"] if potential else []
        remarks += _left_out(problem)
        if states := [problem.states[k].name for k in problem.own if k >= problem.nq + problem.nv]:
            remarks.append(
                f"{', '.join(states)}: held as at the start, where the forces depend on more than the coordinates"
            )
        remarks += (
            ["no potential in the span of short formulas"] if free and not around and not potential else []
        )
        remarks += [sought["text"]] if sought else []
        pairs = [(a, b) for a in range(len(names)) for b in range(a + 1, len(names))]
        table = Table(
            "curl",
            (("component", ""), ("largest at random places", same)),
            tuple(
                (f"d F_{names[b]}/d{names[a]} - d F_{names[a]}/d{names[b]}", float(np.abs(curl[:, k]).max()))
                for k, (a, b) in enumerate(pairs)
            ),
        )
        return Findings(
            study="field",
            model=problem.name,
            outcome=Outcome.COMPLETED,
            message=f"the field is {verdict}",
            values=tuple(values),
            errors_from="differences of fourth order; circulation: half of the points",
            remarks=tuple(remarks),
            tables=(table,) if pairs else (),
            panels=(forces.panel(radius),),
            details={
                "conservative": free and not around,
                "curl_free": free,
                "curl": [[float(x) for x in row] for row in curl[:3]],
                "derivatives_at_start": here.tolist(),
                "circulation": None if circle is None else json_number(circle[0]),
                "radius": radius,
                "potential": potential or None,
                **({"parameter": sought["values"], "possible": sought["possible"]} if sought else {}),
            },
        )

    def _sought(self, case: Case, forces: Forces) -> dict[str, Any]:
        """Return values of parameters for which the curl vanishes everywhere."""
        if not self.vary:
            return {}
        known = [q.name for q in case.problem.parameters]
        unknown = [name for name in self.vary if name not in known]
        if unknown:
            raise SimulationError(f"'{unknown[0]}' is not a parameter of '{case.problem.name}'")
        places = [known.index(name) for name in self.vary]
        chance = Chance(case)

        def curl(x: Array) -> Array:
            found, slopes = forces.curl(chance.at(dict(zip(places, x, strict=True))))
            result: Array = (found / forces.size_of(slopes)).ravel()
            return result

        best = None
        for start in (case.p[places], np.ones(len(places)), -np.ones(len(places)), np.zeros(len(places))):
            found = least_squares(curl, start, xtol=1e-14, ftol=1e-14, gtol=1e-14)
            if best is None or found.cost < best.cost:
                best = found
        assert best is not None
        possible = bool(np.abs(best.fun).max() < ZERO)
        values = {name: round(float(x), 9) + 0.0 for name, x in zip(self.vary, best.x, strict=True)}
        listed = ", ".join(f"{name} = {x:.6g}" for name, x in values.items())
        text = (
            f"conservative for {listed}" if possible else f"for no {', '.join(self.vary)}: nearest {listed}"
        )
        return {"text": text, "values": values, "possible": possible}


def _left_out(problem: Problem) -> list[str]:
    """Say which forces a body at rest does not show."""
    rows = problem.hybrid.rows if problem.hybrid is not None else ()
    kinds = {"friction": "friction", "freewheel": "friction", "contact": "contact"}
    names = [f"{kinds[row.kind]} '{row.name}'" for row in rows if row.kind in kinds]
    if names:
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        return [f"this is the field without {', '.join(names[:3])}{more}"]
    return []


class Forces:
    """The forces of a case at rest, at random places and round loops."""

    def __init__(self, case: Case) -> None:
        self.case = case
        problem = case.problem
        self.momenta = [k for k, q in enumerate(problem.phase) if q.kind == "momentum"]
        self.names = [state.name for state in problem.states[: problem.nq]]
        self.sampler = Sampler(case, seed=8)
        self.places = self.sampler.states(STATES).y[:, : problem.nq]
        self.size = float(np.abs([self.at(q, case.p) for q in self.places]).max(initial=0.0)) or 1.0

    def units(self) -> dict[tuple[int, int], str]:
        """Return the unit of dF_b/dq_a for each pair of coordinates, and for each coordinate with itself: that of an energy
        over both."""
        problem = self.case.problem
        if not problem.phase[self.momenta[0]].unit.strip("1"):
            return {(a, b): "" for b in range(problem.nq) for a in range(b + 1)}
        lengths = [LENGTHS.get(state.unit) for state in problem.states[: problem.nq]]
        found = {}
        for b, second in enumerate(lengths):
            for a, first in enumerate(lengths[: b + 1]):
                found[a, b] = "" if first is None or second is None else OVER[first + second]
        return found

    def at(self, q: Array, p: Array) -> Array:
        """Return the generalised forces at rest: the rates of the momenta."""
        case = self.case
        y = case.y0.copy()
        n = case.problem.nq
        y[:n], y[n : 2 * n] = q, 0.0
        assert case.functions.phase_rate is not None, "the part phase"
        rates = case.functions.phase_rate(case.begin, y, inputs_at(case, case.begin), case.z, p)
        found: Array = rates[self.momenta]
        return found

    def curl(self, p: Array) -> tuple[Array, Array]:
        """Return dF_b/dq_a - dF_a/dq_b [places, pairs], and all derivatives."""
        n = len(self.names)
        found, slopes = [], []
        for q in self.places:
            jacobian = self.slopes(q, p)
            slopes.append(jacobian)
            found.append([jacobian[b, a] - jacobian[a, b] for a in range(n) for b in range(a + 1, n)])
        return np.array(found).reshape(len(self.places), -1), np.array(slopes)

    def slopes(self, q: Array, p: Array, step: float = STEP) -> Array:
        """Return dF_i/dq_j [n, n] at a place."""
        n = len(self.names)
        jacobian = np.zeros((n, n))
        for j in range(n):
            dt = step * self.sampler.width[j]
            e = np.eye(n)[j] * dt
            jacobian[:, j] = (
                8 * (self.at(q + e, p) - self.at(q - e, p)) - self.at(q + 2 * e, p) + self.at(q - 2 * e, p)
            ) / (12 * dt)
        return jacobian

    def at_start(self) -> tuple[Array, Array]:
        """Return dF_i/dq_j at the start [n, n], and by how much they differ with steps twice as long, and rounding."""
        q, p = self.case.y0[: len(self.names)], self.case.p
        found, coarse = self.slopes(q, p), self.slopes(q, p, 2 * STEP)
        rounding = 1e-15 * self.size / (STEP * self.sampler.width[: len(q)])
        return found, np.abs(found - coarse) + rounding

    def size_of(self, slopes: Array) -> float:
        """Return the largest derivative, at least that of a force over its width."""
        return max(float(np.abs(slopes).max(initial=0.0)), self.size / float(self.sampler.width[0]))

    def circulation(self, radius: float) -> tuple[float, float]:
        """Return the work round a circle about the origin in the first two coordinates, counter-clockwise, and an error."""
        found = []
        for count in (POINTS, POINTS // 2):
            angles = 2 * np.pi * np.arange(count) / count
            q = self.case.y0[: len(self.names)].copy()
            total = 0.0
            for a in angles:
                q[:2] = radius * np.cos(a), radius * np.sin(a)
                f = self.at(q, self.case.p)
                total += float(f[1] * np.cos(a) - f[0] * np.sin(a)) * radius
            found.append(total * 2 * np.pi / count)
        return found[0], abs(found[0] - found[1]) + 1e-15 * self.size * radius

    def potential(self) -> str:
        """Return V with F = -grad V as a short formula, if it is in the span."""
        terms = Terms(self.case, 0, factors=5)
        terms.listed = [m for m in terms.listed if m.degree == 0]
        sample = Sampler(self.case, seed=12).states(2 * len(terms.listed) + 30, wide=True)
        values, _ = terms.values(sample)
        kept = [k for k in independent_columns(values) if terms.listed[k].whole < 0]
        terms.keep(kept)
        n = len(self.names)
        power = np.array([self.at(y[:n], self.case.p) @ y[n : 2 * n] for y in sample.y])
        rates = terms.values(sample)[1]
        scale = np.abs(rates).max(axis=0)
        rows = np.maximum(np.abs(power), 1e-3 * np.abs(power).max() or 1.0)
        solution = solve(rates / scale / rows[:, None], -power / rows, FORMULAS)
        off = np.abs(rates / scale @ solution + power).max()
        if off > 1e-8 * (np.abs(power).max() or 1.0):
            return ""
        solution = solution / scale
        sizes = np.abs(solution) * scale
        places = [k for k in range(len(solution)) if sizes[k] > 1e-9 * sizes.max()]
        if len(places) > 12:
            return ""
        if not places:  # no force acts
            return "0"
        names = [v.name for v in terms.variables]
        coefficients = [
            shown(f) if (f := fraction(float(solution[k]))) is not None else digits(float(solution[k]))
            for k in places
        ]
        return tidy(
            sum_text(coefficients, [terms.text(terms.listed[k], names) for k in places]), self.case.problem
        )

    def panel(self, radius: float) -> Panel:
        """Draw the field along the loop: its components over the angle."""
        angles = np.linspace(0, 2 * np.pi, 201)
        q = self.case.y0[: len(self.names)].copy()
        rows = []
        for a in angles:
            if len(q) >= 2:
                q[:2] = radius * np.cos(a), radius * np.sin(a)
            else:
                q[0] = radius * np.cos(a)
            rows.append(self.at(q, self.case.p))
        found = np.array(rows)
        curves: Sequence[Curve] = [
            Curve(f"F_{name}", angles, found[:, k]) for k, name in enumerate(self.names)
        ]
        return Panel("forces round the loop", "angle", "rad", "force", "", tuple(curves))
