"""First integrals beyond symmetries: polynomials in velocities or momenta, found as a null space.

The terms are products of velocities (momenta where the mass matrix changes) with coordinates and the functions of which the
Lagrangian is made: sines, exponentials, reciprocals of distances. The rates of all terms at random states vanish for
those combinations that are constant along every motion. Products of others are taken out, and of what is left it is told
which are functions of each other (rank of their gradients).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations_with_replacement
from typing import Annotated

import numpy as np
from msgspec import Struct

from ...case import Case
from ...numerics.rank import GRADIENTS, rank, solve
from ...outcome import Outcome
from ...problem import Array, Problem
from ...results.files import json_number
from ...settings import settable
from ..findings import Findings, Table
from ..formulas.combination import (
    Coefficients,
    CombinationDrift,
    Track,
    condition,
    drift_of,
    drift_panel,
    ended_early,
    sum_text,
    tidy,
    tracked,
)
from ..formulas.monomials import Monomial, Terms
from ..formulas.null_space import (
    CONFIRMED,
    NEGLIGIBLE,
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
from .symmetries import about, as_it_slides, case_of, cut

INLINE = 160
"""Characters of a formula in which all functions are written out."""

SHOWN = 130
"""Characters of a formula in a table."""

EXACT_PRODUCT = 1e-8
"""Relative difference of a product of constants from a combination of terms that is the same."""


class Integral(Struct, frozen=True, eq=False):
    """A constant: coefficients of the terms, degree in velocities, and what is told of it."""

    vector: Array
    degree: int
    formula: str
    where: dict[str, str]
    drift: CombinationDrift | None
    holds: str
    independent: bool


class Invariants(Study, frozen=True, kw_only=True):
    """Constants of the motion that are polynomials in velocities or momenta up to a degree."""

    needs = frozenset({"phase"})
    degree: Annotated[int, settable("Highest degree in velocities or momenta (default: 2).", "count")] = 2

    def solve(self, problem: Problem) -> Findings:
        """Find the constants in the span. Raises SimulationError where the model has no velocities."""
        case = as_it_slides(case_of(problem, self))
        search, known = _searched(case, self.degree)
        track = tracked(case, self)
        found = _integrals(search.terms, known, track, search.values)
        return _findings(case, found, search, track, search.terms)


def constants_of(case: Case, degree: int, track: Track) -> tuple[list[Integral], list[str]]:
    """Return the constants of a model with their drifts along a run of it, and what is to be said of them."""
    if case.problem.nv == 0:
        return [], []
    search, known = _searched(case, degree)
    found = _integrals(search.terms, known, track, search.values)
    narrow = (
        [] if search.null.clear else ["what counts as a constant cannot be told for sure: the gap is narrow"]
    )
    return found, [*about(case), *narrow]


def _searched(case: Case, degree: int) -> tuple[_Search, list[tuple[Array, int, bool]]]:
    terms = Terms(case, degree)
    sampler = Sampler(case)
    sample = sampler.states(2 * len(terms.listed) + 40, wide=True)
    values, rates = terms.values(sample)
    kept = independent_columns(values)
    terms.keep(kept)
    values, rates = values[:, kept], rates[:, kept]
    check = Sampler(case, seed=9).states(60, wide=True)
    search = _Search(terms, values, rates, sampler.time, terms.values(check)[1])
    return search, search.by_degrees(degree, terms.gradients(Sampler(case, seed=21).states(4)))


# ---------------------------------------------------------------- search


class _Search:
    """Constants by their degrees, lowest first, so that products of known ones are known before they are found."""

    def __init__(self, terms: Terms, values: Array, rates: Array, time: float, check: Array) -> None:
        self.terms, self.values, self.rates, self.check = terms, values, rates, check
        self.sizes = sizes_of(values, rates, time)
        self.null = Null(np.empty((0, 0)), 0.0, 1.0)
        self.in_span = 0
        self.unsure = 0

    def by_degrees(self, degree: int, gradients: Array) -> list[tuple[Array, int, bool]]:
        """Return (coefficients, degree, functionally independent of those before it) of all that are not products."""
        known: list[tuple[Array, int, bool]] = []
        count = len(self.terms.listed)
        for level in range(degree + 1):
            columns = [k for k, term in enumerate(self.terms.listed) if term.degree <= level]
            if not columns:
                continue
            null = null_space(self.rates[:, columns], self.sizes[columns], self.values[:, columns])
            whole = np.zeros((len(null.vectors), count))
            if len(null.vectors):
                whole[:, columns] = null.vectors
            products = list(self._products(known, level))
            found = self._new(whole, products, columns) if len(whole) > _rank(products, self.sizes) else []
            basis = [v for v in found if confirmed(v, self.check, self.sizes) < CONFIRMED]
            if level == degree:
                self.null, self.unsure = null, len(found) - len(basis)
                self.in_span = len(whole) - self.unsure
            for vector in basis:
                known.append((vector, level, _adds([v for v, *_ in known], vector, gradients)))
        return known

    def _new(self, vectors: Array, products: list[Array], columns: Sequence[int]) -> list[Array]:
        costs = np.array([self.terms.cost(self.terms.listed[k]) for k in columns])
        sizes = self.sizes[columns]
        found = sparse_basis(
            vectors[:, columns],
            costs,
            sizes,
            known=np.array([p[columns] for p in products]) if products else None,
            refining=Refining(self.rates[:, columns], self.check[:, columns], sizes),
        )
        whole = np.zeros((len(found), vectors.shape[1]))
        if len(found):
            whole[:, columns] = found
        return list(whole)

    def _products(self, known: Sequence[tuple[Array, int, bool]], level: int) -> Iterator[Array]:
        """Yield the products of known constants up to a degree that lie in the span, by their coefficients.

        Multiplied out where all terms are at hand; else fitted, which tells functions that are nearly alike by few digits.
        """
        scale = np.sqrt((self.values**2).mean(axis=0))
        scale = np.where(scale > 0, scale, 1.0)
        wanted = []
        sequences = [self.values @ vector for vector, *_ in known]
        degrees = [max(n, 1) for _, n, _ in known]
        for factors in range(1, level + 1):
            for chosen in combinations_with_replacement(range(len(known)), factors):
                if sum(degrees[k] for k in chosen) > level:
                    continue
                exact = self.terms.product([known[k][0] for k in chosen])
                if exact is not None:
                    yield exact
                else:
                    wanted.append(np.prod([sequences[k] for k in chosen], axis=0))
        if not wanted:
            return
        scaled = np.hstack([np.ones((len(self.values), 1)), self.values / scale])
        targets = np.array(wanted).T
        targets = targets / np.abs(targets).max(axis=0)
        coefficients = solve(scaled, targets)
        off = np.abs(scaled @ coefficients - targets).max(axis=0)
        for j in range(targets.shape[1]):
            if off[j] < EXACT_PRODUCT:
                vector = coefficients[1:, j] / scale
                size = np.abs(vector * self.sizes).max()
                yield np.where(np.abs(vector * self.sizes) < NEGLIGIBLE * size, 0.0, vector)


def _rank(vectors: Sequence[Array], sizes: Array) -> int:
    if not vectors:
        return 0
    scaled = np.array(vectors) * sizes
    scaled /= np.linalg.norm(scaled, axis=1)[:, None]
    return rank(scaled, GRADIENTS)


def _adds(known: Sequence[Array], vector: Array, gradients: Array) -> bool:
    """Tell whether a constant is not a function of known ones: the rank of gradients grows, at most of the states."""

    def rank_of(vectors: Sequence[Array], at: Array) -> int:
        if not vectors:
            return 0
        rows = np.array(vectors) @ at
        norms = np.linalg.norm(rows, axis=1)
        return rank(rows[norms > 0] / norms[norms > 0][:, None], GRADIENTS)

    votes = [rank_of([*known, vector], at) > rank_of(known, at) for at in gradients]
    return sum(votes) * 2 > len(votes)


# ---------------------------------------------------------------- what is told


def _integrals(
    terms: Terms, known: Sequence[tuple[Array, int, bool]], track: Track | None, values: Array
) -> list[Integral]:
    case = terms.case
    chance = Chance(case)

    def columns(sampler: Sampler, count: int, p: Array | None) -> tuple[Array, Array]:
        return terms.values(sampler.states(count, p))

    coefficients = Coefficients(case, columns, chance)
    relations = chance.relations()
    along = None
    if track is not None:
        still = np.zeros_like(track.phase)
        along = terms.values(PhaseSample(track.time, track.y, np.zeros_like(track.y), track.phase, still))[0]
    typical = np.sqrt((values**2).mean(axis=0))
    found = []
    for vector, degree, independent in known:
        places = support(vector)
        vector = vector / vector[places[0]]
        needs = condition(coefficients, vector, relations)
        texts = coefficients.numbers(vector) if needs.held is None else coefficients.texts(vector, needs.held)
        formula, where = _formula(terms, [terms.listed[k] for k in places], texts)
        drift = None
        if track is not None and along is not None:
            size = float(np.abs(vector[places]) @ typical[places])
            drift = drift_of(track, along[:, places] * vector[places], size)
        found.append(Integral(vector, degree, formula, where, drift, needs.words, independent))
    return found


def _formula(
    terms: Terms, listed: Sequence[Monomial], coefficients: Sequence[str]
) -> tuple[str, dict[str, str]]:
    """Return a formula; where it is long, functions get letters that are told beside it."""
    names = [variable.name for variable in terms.variables]
    text = tidy(
        sum_text(coefficients, [terms.text(term, names) for term in listed]), terms.problem, whole=True
    )
    if len(text) <= INLINE:
        return text, {}
    used = {k for term in listed for k, _ in term.powers if terms.variables[k].array == "phase"}
    taken = {state.name for state in terms.problem.states} | {p.name for p in terms.problem.parameters}
    letters = (f"g{k}" for k in range(1, 200) if f"g{k}" not in taken)
    where = {next(letters): names[k] for k in sorted(used) if len(names[k]) > 12}
    short = {text: name for name, text in where.items()}
    again = [short.get(name, name) for name in names]
    return (
        tidy(sum_text(coefficients, [terms.text(term, again) for term in listed]), terms.problem, whole=True)
    ), where


def _findings(
    case: Case, found: list[Integral], search: _Search, track: Track | None, terms: Terms
) -> Findings:
    problem = case.problem
    remarks = [*terms.remarks, *about(case)]
    independent = [one for one in found if one.independent]
    dependent = [one for one in found if not one.independent]
    null = search.null
    if track is None:
        remarks.append("no drift: nothing says when to stop; give stop, as in --stop '10 s'")
    remarks += ended_early(track)
    if search.unsure:
        remarks.append(f"{search.unsure} combinations were constant at some states only, and are left out")
    if not null.clear:
        remarks.append(
            f"the gap of the singular values is narrow, {null.largest_zero:.1e} to {null.next:.1e}: "
            "what counts as zero cannot be told for sure"
        )
    if any(len(one.formula) > SHOWN for one in found):
        remarks.append("long formulas are cut here; --json has them whole")
    letters = {name: text for one in found for name, text in one.where.items()}
    remarks += [f"{name} = {text}" for name, text in letters.items()]
    n = len(independent)
    heads = (("constant", ""), ("degree", ""), ("drift", ""))
    tables = [Table("constants of the motion", heads, tuple(_row(one) for one in independent))]
    if dependent:
        tables.append(Table("further ones, functions of these", heads, tuple(_row(one) for one in dependent)))
    outcome = track.solution.outcome if track is not None else Outcome.COMPLETED
    told = "drift: change along the run, relative to the sizes of the terms"
    return Findings(
        study="invariants",
        model=problem.name,
        outcome=outcome,
        message=f"{n or 'no'} independent constant{'' if n == 1 else 's'} of the motion in the span",
        errors_from=told,
        remarks=tuple(remarks),
        tables=tuple(tables),
        panels=(
            drift_panel([(cut(one.formula, 40), one.drift) for one in found if one.drift], problem.time.unit),
        ),
        details={
            "invariants": [_plain(one) for one in independent],
            "independent": n,
            "dependent": [_plain(one) for one in dependent],
            "in_span": search.in_span,
            "accuracy": {
                "gap": {"largest_zero": null.largest_zero, "next": null.next},
                "terms": len(terms.listed),
                "errors_from": told,
            },
        },
        runs=(track.solution,) if track is not None else (),
    )


def _row(one: Integral) -> tuple[str, float, float | None]:
    because = f" [because {one.holds}]" if one.holds else ""
    return cut(one.formula, SHOWN) + because, float(one.degree), one.drift.largest if one.drift else None


def _plain(one: Integral) -> dict[str, object]:
    found: dict[str, object] = {
        "formula": one.formula,
        "drift": json_number(one.drift.largest) if one.drift else None,
        "degree": one.degree,
        "holds": f"because {one.holds}" if one.holds else "for all values of the parameters",
    }
    return found | ({"where": one.where} if one.where else {})
