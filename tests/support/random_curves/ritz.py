"""Stationary curves by polynomials on few elements (Ritz), conditions by multipliers, Newton's method.

Everything is written from docs/curves.md alone and shares nothing with the compiler: Legendre polynomials whose continuity is
a null space, integrals by Gauss on twice as many places, derivatives of jets, coordinates that a condition at every place
gives written out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh, null_space

from .jets import Jet, Numbers, constant
from .posed import Posed, in_full
from .tree import E, at, coordinate, evaluate

Start = Callable[[Numbers], tuple[Numbers, float]]
"""Places in SI to coordinates [places, coordinates] and the upper end."""


@cache
def _gauss(n: int) -> tuple[Numbers, Numbers]:
    return legendre.leggauss(n)


@dataclass(frozen=True)
class Functional:
    """A number of the curve with gradient and Hessian in the unknowns."""

    value: float
    gradient: Numbers
    hessian: Numbers


class Ritz:
    """One discretisation of a model."""

    def __init__(self, model: Posed, pieces: int, degree: int) -> None:
        self.model = model
        self.degree = degree
        self.eliminated = {c.coordinate: c.formula for c in model.everywhere}
        self.free = [i for i in range(len(model.sizes)) if i not in self.eliminated]
        self.a = model.number(model.lower)
        self.span = 1.0 if model.unknown_end else model.number(model.upper) - self.a
        inner = [] if model.unknown_end else [(model.number(b) - self.a) / self.span for b in model.breaks]
        corners = sorted({0.0, 1.0, *(s for s in inner if 1e-9 < s < 1 - 1e-9)})
        corners = [s for i, s in enumerate(corners) if i == 0 or s - corners[i - 1] > 1e-9]
        self.knots = np.unique(np.concatenate([np.linspace(p, q, pieces + 1) for p, q in pairwise(corners)]))
        self.bases = [self._joined(model.orders[i]) * model.sizes[i] for i in self.free]
        self.width = sum(b.shape[1] for b in self.bases) + model.unknown_end
        self.variables = 3 * len(self.free) + model.unknown_end
        self._found: dict[E, Functional] = {}
        self.unknowns = np.zeros(self.width)
        nodes, weights = _gauss(2 * degree + 6)
        h = np.diff(self.knots)
        self.places = (self.knots[:-1, None] + h[:, None] * (nodes + 1) / 2).ravel()
        self.weights = (h[:, None] * weights / 2).ravel()
        self.rows = self.matrix(self.places)

    def _pieces_of(self, s: Numbers, left: bool = False) -> Numbers:
        found = np.searchsorted(self.knots, s, side="left" if left else "right") - 1
        return np.clip(found, 0, len(self.knots) - 2)

    def polynomials(self, s: Numbers, order: int, left: bool = False) -> Numbers:
        """Return derivatives in s [places, coefficients] of the polynomials of all elements."""
        element = self._pieces_of(s, left)
        low, high = self.knots[element], self.knots[element + 1]
        local = 2 * (s - low) / (high - low) - 1
        wide = np.zeros((len(s), len(self.knots) - 1, self.degree + 1))
        raised = legendre.legder(np.eye(self.degree + 1), order) if order else np.eye(self.degree + 1)
        values = (
            legendre.legvander(local, raised.shape[0] - 1) @ raised * (2 / (high - low))[:, None] ** order
        )
        wide[np.arange(len(s)), element] = values
        return wide.reshape(len(s), (len(self.knots) - 1) * (self.degree + 1))

    def _joined(self, order: int) -> Numbers:
        """Return a basis [coefficients, unknowns] of curves with this many continuous derivatives."""
        inner = self.knots[1:-1]
        if not len(inner):
            return np.eye(self.degree + 1)
        rows = [self.polynomials(inner, k) - self.polynomials(inner, k, left=True) for k in range(order + 1)]
        jumps = np.concatenate(rows)
        joined: Numbers = null_space(jumps / np.linalg.norm(jumps, axis=1, keepdims=True))
        return joined

    def matrix(self, s: Numbers) -> Numbers:
        """Return [places, variables, unknowns]: values and two derivatives in s of each free coordinate, and the end."""
        rows = np.zeros((len(s), self.variables, self.width))
        orders = [self.polynomials(s, k) for k in range(3)]
        column = 0
        for i, basis in enumerate(self.bases):
            for k in range(3):
                rows[:, 3 * i + k, column : column + basis.shape[1]] = orders[k] @ basis
            column += basis.shape[1]
        if self.model.unknown_end:
            rows[:, -1, -1] = self.model.end_size
        return rows

    def leaf(self, s: Numbers, local: Numbers) -> Callable[[E], Jet]:
        """Answer for leaves at places, of the values [places, variables] there."""
        n, m = len(s), self.variables
        if self.model.unknown_end:
            end = self._variable(local, m - 1)
            span = end - constant(self.a, n, m)
        else:
            span = constant(self.span, n, m)
        x = constant(self.a, n, m) + span * constant(s, n, m)

        def answer(e: E) -> Jet:
            match e.op, e.data:
                case "q", (int(i), int(order)):
                    jet = self._variable(local, 3 * self.free.index(i) + order)
                    for _ in range(order):
                        jet = jet / span
                    return jet
                case "x", _:
                    return x
                case (("end" | "upper"), _) if self.model.unknown_end:
                    return end
            return self.model.known(e, n, m)

        self._span = span
        return answer

    def _variable(self, local: Numbers, k: int) -> Jet:
        jet = constant(local[:, k], *local.shape)
        jet.slope[:, k] = 1.0
        return jet

    def functional(self, e: E) -> Functional:
        """Return an integral, a value at a place or the end, at the present curve."""
        if e not in self._found:
            self._found[e] = self._functional(e)
        return self._found[e]

    def _functional(self, e: E) -> Functional:
        if e.op in ("end", "upper"):
            e = at(e, E("upper"))
        if e.op == "q":
            raise AssertionError("a coordinate of no place")
        if e.op == "integral":
            s, rows, weights = self.places, self.rows, self.weights
        else:
            place = e.args[1]
            if place.op in ("lower", "upper"):
                s = np.array([0.0 if place.op == "lower" else 1.0])
            else:
                s = np.array([(self.model.number(place) - self.a) / self.span])
            rows, weights = self.matrix(s), np.ones(1)
        local = rows @ self.unknowns
        answer = self.leaf(s, local)
        jet = evaluate(in_full(e.args[0], self.eliminated), answer)
        if e.op == "integral":
            jet = jet * self._span
        bent = (weights[:, None, None] * jet.bend) @ rows
        m = rows.shape[2]
        return Functional(
            float(weights @ jet.value),
            np.einsum("q,qi,qid->d", weights, jet.slope, rows, optimize=True),
            rows.reshape(-1, m).T @ bent.reshape(-1, m),
        )

    def outer(self, e: E) -> tuple[Functional, dict[E, float]]:
        """Return a formula of numbers of the curve, and its derivative by each of these numbers."""
        parts = list(dict.fromkeys(p for p in _outermost(e) if p.op in ("integral", "at", "end", "upper")))
        parts = [p for p in parts if p.op in ("integral", "at") or self.model.unknown_end]
        found = [self.functional(p) for p in parts]

        def leaf(p: E) -> Jet:
            if p in parts:
                k = parts.index(p)
                jet = constant(found[k].value, 1, len(parts))
                jet.slope[:, k] = 1.0
                return jet
            return self.model.known(p, 1, len(parts))

        jet = evaluate(e, leaf)
        gradient = np.zeros(self.width)
        hessian = np.zeros((self.width, self.width))
        for k, f in enumerate(found):
            gradient += jet.slope[0, k] * f.gradient
            hessian += jet.slope[0, k] * f.hessian
            for m, g in enumerate(found):
                if jet.bend[0, k, m]:
                    hessian += jet.bend[0, k, m] * np.outer(f.gradient, g.gradient)
        return Functional(float(jet.value[0]), gradient, hessian), dict(
            zip(parts, map(float, jet.slope[0]), strict=True)
        )

    def begin(self, start: Start) -> None:
        """Take the curve nearest to a given one."""
        s = self.places
        curve, end = start(self.a + (end_span(self, start)) * s)
        column = 0
        values = self.polynomials(s, 0)
        for i, basis in zip(self.free, self.bases, strict=True):
            fitted = np.linalg.lstsq(values @ basis, curve[:, i], rcond=None)[0]
            self.unknowns[column : column + basis.shape[1]] = fitted
            column += basis.shape[1]
        if self.model.unknown_end:
            self.unknowns[-1] = end / self.model.end_size

    def solve(self) -> None:
        """Go to the stationary curve by Newton's method; raise ArithmeticError where it does not come."""
        steps: list[float] = []
        for _ in range(15):
            self._found.clear()
            goal, _ = self.outer(self.model.stationary)
            held = [self.outer(c.left - c.right)[0] for c in self.model.conditions]
            K = np.array([h.gradient for h in held]).reshape(len(held), self.width)
            sizes = np.linalg.norm(K, axis=1)
            G = K / sizes[:, None]
            scale = max(float(np.abs(np.diag(goal.hessian)).max()), 1e-300)
            if not steps:
                lam = np.linalg.lstsq(G.T, -goal.gradient / scale, rcond=None)[0]
            H = goal.hessian / scale
            for w, h, size in zip(lam, held, sizes, strict=True):
                H = H + w / size * h.hessian
            system = np.block([[H, G.T], [G, np.zeros((len(held), len(held)))]])
            wrong = np.array([h.value for h in held]) / sizes
            right = -np.concatenate([goal.gradient / scale + G.T @ lam, wrong])
            change = np.linalg.solve(system, right)
            self.unknowns = self.unknowns + change[: self.width]
            lam = lam + change[self.width :]
            steps.append(float(np.abs(change).max() / (1 + np.abs(self.unknowns).max())))
            if steps[-1] < 1e-13 or (len(steps) > 3 and steps[-1] < 1e-9 and steps[-1] > steps[-2] / 4):
                break
        else:
            raise ArithmeticError(f"the reference does not come to a curve: {steps[-3:]}")
        self._found.clear()
        self.first_step = steps[0]
        self.size = scale
        self.lam = dict(zip((c.name for c in self.model.conditions), lam * scale / sizes, strict=True))
        self.hessian, self.held = H, G

    def directions(self) -> Numbers:
        """Return the eigenvalues of the second variation with all conditions held, against that of y'^2 + y^2."""
        Z = null_space(self.held) if len(self.held) else np.eye(self.width)
        rows = self.rows @ Z
        used = [3 * k + n for k, i in enumerate(self.free) for n in range(self.model.orders[i] + 2)]
        if self.model.unknown_end:
            used.append(self.variables - 1)
        sizes = np.ones(self.variables)
        for k, i in enumerate(self.free):
            sizes[3 * k : 3 * k + 3] = 1 / self.model.sizes[i]
        if self.model.unknown_end:
            sizes[-1] = 1 / self.model.end_size
        weighed = (rows * sizes[None, :, None])[:, used] * np.sqrt(self.weights)[:, None, None]
        flat = weighed.reshape(-1, Z.shape[1])
        return np.asarray(eigh(Z.T @ self.hessian @ Z, flat.T @ flat, eigvals_only=True))

    def curve(self, e: E, s: Numbers) -> Numbers:
        """Return a formula along the curve at shares s of the range."""
        local = self.matrix(s) @ self.unknowns
        return evaluate(in_full(e, self.eliminated), self.leaf(s, local)).value

    @property
    def upper(self) -> float:
        return (
            float(self.unknowns[-1] * self.model.end_size) if self.model.unknown_end else self.a + self.span
        )

    def multiplier(self, name: str) -> float:
        return float(self.lam[name])

    def density(self, name: str, s: Numbers) -> Numbers:
        """Return the multiplier of a condition at every place, from the equation of Euler and Lagrange of its coordinate."""
        held = next(c for c in self.model.everywhere if c.name == name)
        total = self.model.stationary
        for c in self.model.conditions:
            weight = E("num", (), (self.lam[c.name], "", 1.0))
            total = total + weight * (c.left - c.right)
        weights = self.outer(total)[1]
        nodes = np.cos(np.pi * (np.arange(2 * self.degree) + 0.5) / (2 * self.degree))
        answer = np.zeros(len(s))
        for low, high in zip(self.knots[:-1], self.knots[1:], strict=True):
            inside = (s >= low) & (s <= high)
            if not inside.any():
                continue
            here = low + (high - low) * (nodes + 1) / 2
            force, push, share = (np.zeros(len(here)) for _ in range(3))
            for part, weight_ in weights.items():
                if part.op == "integral":
                    slopes = self._partial(part.args[0], held.coordinate, here)
                    force += weight_ * slopes[0]
                    push += weight_ * slopes[1]
            share = self._partial(held.left - held.right, held.coordinate, here)[0]
            fitted = legendre.legfit(nodes, push, 2 * self.degree - 1)
            rate = legendre.legval(nodes, legendre.legder(fitted)) * 2 / (high - low) / self.span
            fitted = legendre.legfit(nodes, -(force - rate) / share, 2 * self.degree - 1)
            answer[inside] = legendre.legval(2 * (s[inside] - low) / (high - low) - 1, fitted)
        return answer

    def _partial(self, e: E, i: int, s: Numbers) -> tuple[Numbers, Numbers]:
        """Return the derivatives of a formula by coordinate i and by its slope, all others as they are."""
        local = self.matrix(s) @ self.unknowns
        known = self.leaf(s, local)
        values = [evaluate(in_full(coordinate(i, k), self.eliminated), known).value for k in range(2)]

        def leaf(p: E) -> Jet:
            if p.op == "q":
                j, k = int(str(p.data[0])), int(str(p.data[1]))
                value = values[k] if j == i else evaluate(in_full(p, self.eliminated), known).value
                jet = constant(value, len(s), 2)
                if j == i:
                    jet.slope[:, k] = 1.0
                return jet
            return constant(known(p).value, len(s), 2)

        jet = evaluate(e, leaf)
        return jet.slope[:, 0], jet.slope[:, 1]


def end_span(ritz: Ritz, start: Start) -> float:
    return start(np.array([ritz.a]))[1] - ritz.a


def _outermost(e: E) -> list[E]:
    if e.op in ("integral", "at"):
        return [e]
    return [e, *(part for a in e.args for part in _outermost(a))]
