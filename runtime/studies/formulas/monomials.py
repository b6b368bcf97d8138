"""Products of velocities and functions of coordinates, with their rates and gradients: what first integrals are made of."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations_with_replacement
from math import comb

import numpy as np
from msgspec import Struct

from ...case import Case, inputs_at
from ...problem import Array
from .sampling import PhaseSample, Sampler

TURNS = ("spin", "linear", "angular")
"""Momenta of bodies as a whole, which may be terms by themselves."""

MOST_TERMS = 1200
"""Of the span; where it would have more, fewer factors are allowed."""


class MonomialVariable(Struct, frozen=True):
    """A factor of terms: a number of the state, or a quantity of ``phase``; ``moving``: a velocity or a momentum."""

    name: str
    array: str
    index: int
    moving: bool


class Monomial(Struct, frozen=True):
    """``powers`` of the variables; ``whole``: the index in ``phase`` of an energy or a momentum of all bodies, alone."""

    powers: tuple[tuple[int, int], ...]
    degree: int
    whole: int = -1


class Terms:
    """The terms of the span, with values, rates, gradients and texts."""

    def __init__(
        self,
        case: Case,
        degree: int,
        *,
        factors: int | None = None,
        moving: Sequence[MonomialVariable] | None = None,
    ) -> None:
        """``degree`` in velocities or momenta (or in what is ``moving``), at most ``factors`` in all, one more than the
        degree without it."""
        self.case, self.problem = case, case.problem
        self.remarks: list[str] = []
        self.variables = self._variables(moving)
        self.listed = self._listed(degree, degree + 1 if factors is None else factors)

    def keep(self, kept: Sequence[int]) -> None:
        """Leave out terms that are made of others."""
        self.listed = [self.listed[k] for k in kept]

    def product(self, vectors: Sequence[Array]) -> Array | None:
        """Return the coefficients of the product of combinations of terms; None where it has terms that are not listed."""
        places = {term.powers: k for k, term in enumerate(self.listed) if term.whole < 0}
        found = vectors[0]
        for vector in vectors[1:]:
            total = np.zeros_like(found)
            for i in np.flatnonzero(found):
                for j in np.flatnonzero(vector):
                    a, b = self.listed[i], self.listed[j]
                    place = places.get(_together(a.powers, b.powers))
                    if a.whole >= 0 or b.whole >= 0 or place is None:
                        return None
                    total[place] += found[i] * vector[j]
            found = total
        return found

    def _variables(self, moving: Sequence[MonomialVariable] | None) -> list[MonomialVariable]:
        problem = self.problem
        nq, nv = problem.nq, problem.nv
        phase = problem.phase
        momenta = [k for k, quantity in enumerate(phase) if quantity.kind == "momentum"]
        found: list[MonomialVariable] = []
        if moving is not None:
            found += moving
        elif self._constant_mass(momenta):
            found += [MonomialVariable(problem.states[nq + i].name, "y", nq + i, True) for i in range(nv)]
        else:
            found += [MonomialVariable(phase[k].name or phase[k].doc, "phase", k, True) for k in momenta]
        found += [
            MonomialVariable(quantity.name or quantity.doc, "phase", k, False)
            for k, quantity in enumerate(phase)
            if quantity.kind in ("place", "atom")
        ]
        return found

    def _constant_mass(self, momenta: Sequence[int]) -> bool:
        problem, functions = self.problem, self.case.functions
        assert functions.phase_gradient is not None, "the part phase"
        sample = Sampler(self.case, seed=4).states(3)
        width = problem.nq + problem.nv
        found = []
        for t, y in zip(sample.t, sample.y, strict=True):
            flat = functions.phase_gradient(
                float(t), y, inputs_at(self.case, float(t)), self.case.z, self.case.p
            )
            found.append(flat.reshape(-1, width)[momenta, problem.nq :])
        first = found[0]
        return all(np.abs(other - first).max() <= 1e-12 * np.abs(first).max() for other in found)

    def _listed(self, degree: int, most: int) -> list[Monomial]:
        moving = [k for k, v in enumerate(self.variables) if v.moving]
        placed = [k for k, v in enumerate(self.variables) if not v.moving]
        while most > degree and _count(len(moving), len(placed), degree, most) > MOST_TERMS:
            most -= 1
        while placed and _count(len(moving), len(placed), degree, most) > MOST_TERMS:
            placed.pop()
        given = sum(not v.moving for v in self.variables)
        if len(placed) < given or most <= degree:
            self.remarks.append(
                f"the span is smaller than the degree allows: {most} factors, {len(placed)} of {given} functions"
            )
        found = [
            Monomial(_powers((*a, *b)), n)
            for n in range(degree + 1)
            for a in combinations_with_replacement(moving, n)
            for m in range(most - n + 1)
            for b in combinations_with_replacement(placed, m)
            if n + m
        ]
        found.sort(key=lambda one: (sum(p for _, p in one.powers), one.degree))
        # the energy comes first: among many functions there may be some that are nearly its potential
        for kind, n, front in (("energy", 2, True), ("potential", 0, False), *((k, 1, False) for k in TURNS)):
            if n <= degree:
                whole = [
                    Monomial((), n, k)
                    for k, quantity in enumerate(self.problem.phase)
                    if quantity.kind == kind
                ]
                found = [*whole, *found] if front else [*found, *whole]
        return found

    def values(self, sample: PhaseSample) -> tuple[Array, Array]:
        """Return the values and the rates of all terms at states, [n, terms] each."""
        bases = [getattr(sample, v.array)[:, v.index] for v in self.variables]
        names = {"y": "rate", "phase": "phase_rate"}
        slopes = [getattr(sample, names[v.array])[:, v.index] for v in self.variables]
        values = np.empty((len(sample.t), len(self.listed)))
        rates = np.empty_like(values)
        for j, term in enumerate(self.listed):
            if term.whole >= 0:
                values[:, j], rates[:, j] = sample.phase[:, term.whole], sample.phase_rate[:, term.whole]
                continue
            values[:, j] = _product(bases, term.powers)
            rates[:, j] = sum(
                p * _product(bases, _less(term.powers, i)) * slopes[k] for i, (k, p) in enumerate(term.powers)
            )
        return values, rates

    def gradients(self, sample: PhaseSample) -> Array:
        """Return the derivatives of all terms by coordinates and velocities at states, [n, terms, nq + nv].

        Across a unit quaternion and along constraints alone: what leaves these is taken out.
        """
        problem, case = self.problem, self.case
        width = problem.nq + problem.nv
        functions = case.functions
        assert functions.phase_gradient is not None, "the part phase"
        result = np.zeros((len(sample.t), len(self.listed), width))
        for n, (t, y) in enumerate(zip(sample.t, sample.y, strict=True)):
            u = inputs_at(case, float(t))
            own = functions.phase_gradient(float(t), y, u, case.z, case.p).reshape(-1, width)
            rows = [np.eye(width)[v.index] if v.array == "y" else own[v.index] for v in self.variables]
            bases = [np.array([getattr(sample, v.array)[n, v.index]]) for v in self.variables]
            for j, term in enumerate(self.listed):
                if term.whole >= 0:
                    result[n, j] = own[term.whole]
                    continue
                for i, (k, p) in enumerate(term.powers):
                    result[n, j] += p * _product(bases, _less(term.powers, i))[0] * rows[k]
            for i in problem.rotations:
                unit = y[i : i + 4]
                result[n, :, i : i + 4] -= np.outer(result[n, :, i : i + 4] @ unit, unit)
        return result

    def cost(self, term: Monomial) -> float:
        """Return how long a term makes a formula."""
        if term.whole >= 0:
            return 2.5 if term.degree == 2 else 6.0
        return 1.0 + 0.1 * sum(p for _, p in term.powers)

    def text(self, term: Monomial, names: Sequence[str]) -> str:
        """Return a term as a formula, with these names of the variables."""
        if term.whole >= 0:
            found = self.problem.phase[term.whole]
            return found.name or ("energy()" if found.kind == "energy" else found.doc.replace(" ", "_"))
        plain = [
            name if name.replace("_", "").isalnum() or name.startswith("der(") else f"({name})"
            for name in names
        ]
        factors = (plain[k] if p == 1 else f"{plain[k]}^{p}" for k, p in term.powers)
        return "*".join(factors) or "1"


def _count(moving: int, placed: int, degree: int, most: int) -> int:
    total = 0
    for n in range(degree + 1):
        own = comb(moving + n - 1, n) if moving or not n else 0
        total += own * comb(placed + most - n, most - n)
    return total


def _powers(chosen: Sequence[int]) -> tuple[tuple[int, int], ...]:
    return tuple((k, chosen.count(k)) for k in dict.fromkeys(chosen))


def _together(a: tuple[tuple[int, int], ...], b: tuple[tuple[int, int], ...]) -> tuple[tuple[int, int], ...]:
    """Return the powers of a product, in the order in which terms are listed."""
    both = dict(a)
    for k, p in b:
        both[k] = both.get(k, 0) + p
    return tuple(sorted(both.items()))


def _less(powers: tuple[tuple[int, int], ...], place: int) -> tuple[tuple[int, int], ...]:
    """Return powers with one factor fewer at a place."""
    return tuple((k, p - (i == place)) for i, (k, p) in enumerate(powers))


def _product(bases: Sequence[Array], powers: Sequence[tuple[int, int]]) -> Array:
    result: Array = np.ones_like(bases[0])
    for k, p in powers:
        for _ in range(p):
            result = result * bases[k]
    return result
