"""Point symmetries of a model and what they keep constant (Noether 1918), found as a null space.

A transformation q -> q + e xi(q, t), t -> t + e tau(t) that changes L dt by a total derivative dF alone keeps
I = xi p - tau h - F constant along every motion, with the momenta p and the energy function h = p v - L. All I in a span of
xi, tau and F are tried at once: their rates at random states vanish for those combinations that are constant. Rates are
those of the whole model, constraints and forces included: what I is linear in the momenta and constant, is a symmetry.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations_with_replacement

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...case import Case, find_experiment, inputs_at, prepare
from ...functions import load_functions
from ...local.chart import chart_of
from ...local.equilibrium_feasibility import contacts
from ...local.operating_point import Site, begun_at, plan_of
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...results.files import json_number
from ..findings import Findings, Table
from ..formulas.combination import (
    Coefficients,
    CombinationDrift,
    Track,
    condition,
    drift_of,
    drift_panel,
    ended_early,
    stop_of,
    sum_text,
    tidy,
    times,
    tracked,
)
from ..formulas.null_space import (
    CONFIRMED,
    Null,
    Refining,
    confirmed,
    independent_columns,
    null_space,
    sizes_of,
    sparse_basis,
    support,
)
from ..formulas.relations import Chance
from ..formulas.sampling import PhaseSample, Sampler
from ..study import Study
from .generators import generator_of, negative

MOST_TERMS = 700
"""Of the span: with more, products of time and coordinates, then products with coordinates are left out."""


WORLDLY = ("spin", "linear", "angular", "moment")
"""Kinds of momenta that belong to the world, not to single coordinates."""

COSTS = {"xi": 1.0, "tau": 1.5, "spin": 1.5, "linear": 1.6, "angular": 1.6, "moment": 1.6, "F": 0.7}
"""How long terms make a formula, in the order in which they stand there."""

SHOWN = 110
"""Characters of a formula in a table."""


class Term(Struct, frozen=True):
    """One column of the span. ``kind``: ``F`` (a function of coordinates and time), ``xi`` (a factor of a momentum),
    ``tau`` (a factor of the energy), or a momentum of all bodies; ``index`` of the momentum in ``phase``.

    The factor is time^``time`` times the coordinates whose indices in y are ``of``.
    """

    kind: str
    index: int
    of: tuple[int, ...] = ()
    time: int = 0


class Constant(Struct, frozen=True, eq=False):
    """A symmetry with what it keeps constant; ``holds``: what must be true of the parameters for it."""

    name: str
    generator: str
    conserved: str
    drift: CombinationDrift | None
    holds: str
    vector: Array


class Symmetries(Study, frozen=True, kw_only=True):
    """Point symmetries with the quantities that they keep constant, as formulas, and how far these drift on a run."""

    needs = frozenset({"phase"})

    def solve(self, problem: Problem) -> Findings:
        """Find the symmetries in the span. Raises SimulationError where the model has no velocities."""
        case = as_it_slides(case_of(problem, self))
        span = TermSpan(case)
        sampler = Sampler(case)
        columns = span.values(sampler.states(2 * len(span.terms) + 40))
        kept, null, sizes = _null(columns, sampler.time)
        check = span.values(Sampler(case, seed=9).states(60, wide=True))[1][:, kept]
        good = [v for v in null.vectors if confirmed(v, check, sizes) < CONFIRMED]
        vectors = np.array(good) if len(good) < len(null.vectors) else null.vectors
        doubtful = len(null.vectors) - len(vectors)
        costs = np.array([span.cost(span.terms[k]) for k in kept])
        basis = np.zeros((len(vectors), len(span.terms)))
        if len(vectors):
            refining = Refining(columns[1][:, kept], check, sizes)
            basis[:, kept] = sparse_basis(vectors, costs, sizes, refining=refining)
        chance = Chance(case)
        track = tracked(case, self)
        typical = np.sqrt((columns[0] ** 2).mean(axis=0))
        found = self._constants(span, basis, chance, track, typical)
        found.sort(key=lambda one: (np.count_nonzero(one.vector), tuple(support(one.vector))))
        return self._findings(problem, found, null, track, doubtful, span)

    def _constants(
        self, span: TermSpan, basis: Array, chance: Chance, track: Track | None, typical: Array
    ) -> list[Constant]:
        def columns(sampler: Sampler, count: int, p: Array | None) -> tuple[Array, Array]:
            return span.values(sampler.states(count, p))

        coefficients = Coefficients(span.case, columns, chance)
        relations = chance.relations()
        along = span.along(track) if track is not None else None
        found = []
        for vector in basis:
            places = support(vector)
            vector = vector / vector[places[0]]
            needs = condition(coefficients, vector, relations)
            texts = (
                coefficients.numbers(vector) if needs.held is None else coefficients.texts(vector, needs.held)
            )
            order = sorted(range(len(places)), key=lambda j: _place(span.terms[places[j]]))
            terms, texts = [span.terms[places[j]] for j in order], [texts[j] for j in order]
            conserved = span.formula(terms, texts)
            if conserved.startswith("-"):
                texts = [negative(text) for text in texts]
                conserved = span.formula(terms, texts)
            name, generator = generator_of(span, terms, texts)
            drift = None
            if track is not None and along is not None:
                size = float(np.abs(vector[places]) @ typical[places])
                drift = drift_of(track, along[:, places] * vector[places], size)
            found.append(Constant(name, generator, conserved, drift, needs.words, vector))
        return found

    def _findings(
        self,
        problem: Problem,
        found: list[Constant],
        null: Null,
        track: Track | None,
        doubtful: int,
        span: TermSpan,
    ) -> Findings:
        remarks = list(span.remarks)
        remarks += about(span.case)
        if track is None:
            remarks.append("no drift: nothing says when to stop; give stop, as in --stop '10 s'")
        remarks += ended_early(track)
        if doubtful:
            remarks.append(f"{doubtful} combinations were constant at some states only, and are left out")
        if not null.clear:
            remarks.append(
                f"the gap of the singular values is narrow, {null.largest_zero:.1e} to {null.next:.1e}: "
                "what counts as zero cannot be told for sure"
            )
        if any(len(text) > SHOWN for one in found for text in (one.conserved, _row(one))):
            remarks.append("long formulas are cut here; --json has them whole")
        outcome = track.solution.outcome if track is not None else Outcome.COMPLETED
        n = len(found)
        return Findings(
            study="symmetries",
            model=problem.name,
            outcome=outcome,
            message=f"{n or 'no'} point {'symmetry' if n == 1 else 'symmetries'} in the span",
            errors_from="drift: change along the run, relative to the sizes of the terms",
            remarks=tuple(remarks),
            tables=(
                Table(
                    "symmetries",
                    (("symmetry", ""), ("conserved", ""), ("drift", "")),
                    tuple(
                        (
                            cut(_row(one), SHOWN),
                            cut(one.conserved, SHOWN),
                            one.drift.largest if one.drift else None,
                        )
                        for one in found
                    ),
                ),
            ),
            panels=(drift_panel([(one.name, one.drift) for one in found if one.drift], problem.time.unit),),
            details={
                "symmetries": [
                    {
                        "generator": one.generator,
                        "conserved": one.conserved,
                        "drift": json_number(one.drift.largest) if one.drift else None,
                        "name": one.name,
                        "holds": f"because {one.holds}" if one.holds else "for all values of the parameters",
                    }
                    for one in found
                ],
                "accuracy": {
                    "gap": {"largest_zero": null.largest_zero, "next": null.next},
                    "terms": len(span.terms),
                    "errors_from": "drift: change along the run, relative to the sizes of the terms",
                },
            },
            runs=(track.solution,) if track is not None else (),
        )


def _place(term: Term) -> tuple[object, ...]:
    """Return where a term stands in a formula: x*p_y before y*p_x."""
    return list(COSTS).index(term.kind), term.time, term.of, term.index


def _row(one: Constant) -> str:
    return f"{one.name}: {one.generator}" + (f" [because {one.holds}]" if one.holds else "")


def cut(text: str, size: int) -> str:
    """Leave out what a text has beyond a number of characters."""
    return text if len(text) <= size else text[: size - 1].rstrip() + "…"


def case_of(problem: Problem, study: Study) -> Case:
    """Make a case whose states are looked at, whether anything says when to stop or not.

    Raises SimulationError where there are no velocities.
    """
    if problem.nv == 0:
        raise SimulationError(
            f"'{problem.name}' has no velocities: nothing moves by itself",
            help="declare coordinates with kinetic energy, or bodies with joints",
        )
    functions = load_functions(problem)
    if stop_of(find_experiment(problem, study.experiment), study):
        return prepare(problem, functions, study)
    return prepare(problem, functions, replace(study, stop=study.start or 0.0))


def as_it_slides(case: Case) -> Case:
    """Give a case in which dry friction acts as at the start of the motion, or forwards where it sticks there: without a direction
    it is none, and what it takes would count as constant."""
    site = site_at_start(case)
    plan = plan_of(site)
    if plan is None or case.problem.hybrid is None:
        return case
    places = [
        plan.rows[k].sign
        for k, row in enumerate(case.problem.hybrid.rows)
        if row.kind == "friction" and plan.rows[k].normal < 0
    ]
    if not places:
        return case
    try:
        begun = begun_at(site, case.y0).z
    except SimulationError:  # told where it is run
        begun = case.z
    z = case.z.copy()
    z[places] = np.where(begun[places] == 0, 1.0, begun[places])
    return replace(case, z=z)


def site_at_start(case: Case) -> Site:
    """Give the start of a case, to look at what switches there."""
    u = inputs_at(case, case.begin)
    return Site(case, chart_of(case.problem), case.begin, u, case.z, case.y0, case.p)


def _closed(case: Case) -> list[str]:
    """Name the contacts that are closed once the motion has begun."""
    site = site_at_start(case)
    plan = plan_of(site)
    if plan is None or not contacts(site):
        return []
    try:
        z = begun_at(site, case.y0).z
    except SimulationError:
        return []
    rows = case.problem.hybrid.rows if case.problem.hybrid is not None else ()
    return [f"'{rows[k].name}'" for k in contacts(site) if z[plan.rows[k].flag] > 0.5]


def about(case: Case) -> list[str]:
    """Say what constancy means for a model with events or inputs."""
    problem, found = case.problem, []
    if problem.hybrid is not None and (closed := _closed(case)):
        found.append(
            f"contacts are taken as open, {', '.join(closed)} too, which the motion begins on: while they press, and by their "
            "friction, what is listed may change"
        )
    if problem.hybrid is not None and (
        problem.hybrid.switches or problem.hybrid.branches or problem.hybrid.rows
    ):
        found.append("constant between events: while what switches stays as it is at the start")
    if problem.inputs:
        found.append("inputs are taken as arbitrary: what is constant, is so whatever they do")
    if any(state.kind == "account" and state.name == "energy.dissipated" for state in problem.states):
        found.append("the model dissipates energy: what is listed remains constant all the same")
    return found


def _null(columns: tuple[Array, Array], time: float) -> tuple[list[int], Null, Array]:
    """Return the columns that are independent, the combinations of them that are constant, and their sizes."""
    values, rates = columns
    kept = independent_columns(values)
    sizes = sizes_of(values[:, kept], rates[:, kept], time)
    return kept, null_space(rates[:, kept], sizes), sizes


class TermSpan:
    """The terms that a constant may have, with their values, rates and texts."""

    def __init__(self, case: Case) -> None:
        problem = case.problem
        self.case = case
        self.problem = problem
        turning = {i + k for i in problem.rotations for k in range(4)}
        self.places = [k for k in range(problem.nq) if k not in turning]
        kinds = [quantity.kind for quantity in problem.phase]
        self.momenta = [k for k, kind in enumerate(kinds) if kind == "momentum"]
        self.energy = kinds.index("energy")
        self.world = {kind: [k for k, x in enumerate(kinds) if x == kind] for kind in WORLDLY}
        self.remarks: list[str] = []
        n, m = len(self.momenta), len(self.places)
        linear, mixed = True, True
        if n * (2 + 2 * m) + m * (m + 5) // 2 > MOST_TERMS:
            mixed = False
            self.remarks.append("the span leaves out generators with products of time and coordinates")
        if n * (2 + m) + m * (m + 5) // 2 > MOST_TERMS:
            linear = False
            self.remarks.append("the span leaves out generators with coordinates: the model has many")
        self.terms = self._terms(linear, mixed)

    def _terms(self, linear: bool, mixed: bool) -> list[Term]:
        q, p = self.places, self.momenta
        terms = [Term("xi", i) for i in p]
        terms += [Term("tau", self.energy)]
        terms += [Term("xi", i, (k,)) for i in p for k in q if linear]
        terms += [Term("xi", i, (), 1) for i in p]
        terms += [Term("F", -1, (k,)) for k in q]
        terms += [Term("F", -1, (), 1), Term("F", -1, (), 2)]
        terms += [Term("tau", self.energy, (), 1), Term("tau", self.energy, (), 2)]
        terms += [Term("xi", i, (k,), 1) for i in p for k in q if mixed]
        terms += [Term("F", -1, (k,), 1) for k in q]
        if linear:
            terms += [Term("F", -1, pair) for pair in combinations_with_replacement(q, 2)]
        for kind in ("spin", "linear", "angular"):
            terms += [Term(kind, k) for k in self.world[kind]]
        terms += [Term("linear", k, (), 1) for k in self.world["linear"]]
        terms += [Term("moment", k) for k in self.world["moment"]]
        return terms

    def values(self, sample: PhaseSample) -> tuple[Array, Array]:
        """Return the values and the rates of all terms at states, [n, terms] each."""
        y, rate = sample.y, sample.rate
        values, rates = np.empty((len(y), len(self.terms))), np.empty((len(y), len(self.terms)))
        for j, term in enumerate(self.terms):
            factor, slope = _factor(term, sample.t, y, rate)
            if term.kind == "F":
                values[:, j], rates[:, j] = factor, slope
            else:
                of, change = sample.phase[:, term.index], sample.phase_rate[:, term.index]
                values[:, j], rates[:, j] = factor * of, slope * of + factor * change
        return values, rates

    def along(self, track: Track) -> Array:
        """Return the values of all terms along a run."""
        zeros = np.zeros_like(track.phase)
        return self.values(PhaseSample(track.time, track.y, np.zeros_like(track.y), track.phase, zeros))[0]

    def cost(self, term: Term) -> float:
        """Return how long a term makes a formula."""
        return COSTS[term.kind] + 0.5 * len(term.of) + 0.5 * term.time

    def text(self, term: Term) -> str:
        """Return a term as a formula."""
        names = [self.problem.states[k].name for k in term.of]
        if len(names) == 2 and names[0] == names[1]:
            names = [f"{names[0]}^2"]
        clock = self.problem.time.name
        powers = [] if term.time == 0 else [clock if term.time == 1 else f"{clock}^{term.time}"]
        factor = "*".join([*powers, *names]) or "1"
        return factor if term.kind == "F" else times(factor, self.quantity(term.index))

    def quantity(self, index: int) -> str:
        """Return the formula of a quantity, or words for it where that is long."""
        found = self.problem.phase[index]
        if found.name:
            return found.name
        return "energy()" if found.kind == "energy" else found.doc.replace(" ", "_")

    def formula(self, terms: Sequence[Term], coefficients: Sequence[str]) -> str:
        """Return the formula of a combination."""
        return tidy(sum_text(coefficients, [self.text(term) for term in terms]), self.problem)


def _factor(term: Term, t: Array, y: Array, rate: Array) -> tuple[Array, Array]:
    """Return time^n times coordinates, and the rate of that."""
    value, slope = t**term.time, term.time * t ** max(term.time - 1, 0)
    for k in term.of:
        value, slope = value * y[:, k], slope * y[:, k] + value * rate[:, k]
    return value, slope
