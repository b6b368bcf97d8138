"""Motions that moves of the coordinates carry along (``moves.py``), constraints or not: relative equilibria.

q' = A q + b and v' = A v with one A and b of the moves: the motion carries the model along and changes nothing else
(J. E. Marsden, Lectures on Mechanics, 1992, chapters 4 and 5, there also the energy with the momenta held).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ...local.operating_point import Site
from ...local.search import box_of
from ...local.zeros import Complex, poles
from ...numerics.newton import added, newton
from ...numerics.rank import EPSILON, NEWTON, POSITIONS, null_space, solve
from ...outcome import SimulationError
from ...problem import Array
from .moves import moves_of

SMALL = 1e-6
"""Of the largest row: smaller ones, which may be rounding, are not made as large as the others."""
NOTHING = 1e-12
"""Of the largest row, what is rounding alone."""
QUARTERS = np.arange(4) * np.pi / 2
"""Turns from which the one nearest to the start is looked for."""
APART = 2e-3
"""Of the sizes, by which states lie beside each other whose energies are compared."""


class CarriedEquations:
    """The equations of motions that moves carry, by x: the coordinates, then the rates of the moves."""

    def __init__(self, site: Site) -> None:
        problem = site.problem
        self.site, self.n = site, problem.nq
        self.moves, self.keeps_energy = moves_of(site)
        if not self.moves:
            coordinates = ", ".join(q.name for q in problem.states[: self.n])
            raise SimulationError(
                f"'{problem.name}' has no cyclic coordinate: its forces depend on {coordinates}, and no shift of them and no turn "
                "of two leaves the equations of motion as they are",
                help="'equilibria' finds where it rests; choose coordinates in which the symmetry is seen",
            )
        self.k = len(self.moves)
        self.shifted: NDArray[np.bool_] = np.any([move.b != 0 for move in self.moves], axis=0)
        self.names = [q.name for q in problem.states[: self.n]] + [move.name for move in self.moves]
        self.units = [q.unit for q in problem.states[: self.n]] + [move.unit for move in self.moves]
        self.axes = [move.axis for move in self.moves]
        self._momenta = [k for k, q in enumerate(problem.phase) if q.kind == "momentum"]
        self._energy = next(k for k, q in enumerate(problem.phase) if q.kind == "energy")
        self._bounds()
        self.start = self._begun()
        self.p0 = self.momenta_of(site.y)

    def _bounds(self) -> None:
        """Set ranges and sizes of the unknowns, and which are angles that may turn round."""
        site, n = self.site, self.n
        box = box_of(site)
        self.low, self.high = np.full(n, -1.0), np.full(n, 1.0)
        self.periodic: NDArray[np.bool_] = np.zeros(n, dtype=bool)
        self.stated: NDArray[np.bool_] = np.zeros(n, dtype=bool)
        for k, j in enumerate(box.moved):
            if j < n:
                self.low[j], self.high[j] = box.low[k], box.high[k]
                self.periodic[j], self.stated[j] = box.periodic[k], box.stated[k]
        q = site.y[:n]
        self.lengths = np.maximum(1.0, np.abs(q))
        rates = np.array([np.abs(move.at(q)).max() for move in self.moves])
        fast = float(np.abs(site.y[n : 2 * n]).max())
        slope = np.abs(site.derivatives(site.y).rates[n : 2 * n, :n])
        natural = float(np.sqrt(slope[np.isfinite(slope)].max(initial=0.0)))
        self.speeds = np.where(
            rates > 0, (fast or natural or 1.0) / np.where(rates > 0, rates, 1.0), natural or 1.0
        )
        self.sizes = np.r_[self.lengths, self.speeds]

    def _begun(self) -> Array:
        """Return coordinates and rates of the moves as they are at the start: the rates nearest to its velocities."""
        y, n = self.site.y, self.n
        ways = np.array([move.at(y[:n]) for move in self.moves]).T
        return np.concatenate([y[:n], solve(ways, y[n : 2 * n], POSITIONS)])

    def scaled(self, rows: Array) -> tuple[Array, Array]:
        """Return rows in sizes of the unknowns, of one length but for those that are nearly nothing, and what they were divided by."""
        scaled = rows * self.sizes
        norms = np.linalg.norm(scaled, axis=1)
        norms = np.maximum(norms, SMALL * float(norms.max(initial=1e-300)))
        return scaled / norms[:, None], norms

    def _turn(self, x: Array) -> Array:
        return sum(
            (w * move.A for w, move in zip(x[self.n :], self.moves, strict=True)), np.zeros((self.n, self.n))
        )

    def ways(self, q: Array) -> Array:
        return np.array([move.at(q) for move in self.moves]).T

    def state(self, x: Array) -> Array:
        """Return the state of a motion with these coordinates and rates of the moves."""
        y = self.site.y.copy()
        y[: self.n] = x[: self.n]
        y[self.n : 2 * self.n] = self.ways(x[: self.n]) @ x[self.n :]
        return y

    def momenta_of(self, y: Array) -> Array:
        """Return the momenta of the moves."""
        found: Array = self.site.phase(y)[self._momenta] @ self.ways(y[: self.n])
        return found

    def momenta_slopes(self, y: Array) -> Array:
        """Return the derivatives of the momenta of the moves by q and v."""
        site, n = self.site, self.n
        assert site.case.functions.phase_gradient is not None, "the part phase"
        own = np.asarray(site.case.functions.phase_gradient(site.t, y, site.u, site.z, site.p)).reshape(
            -1, 2 * n
        )
        slopes = self.ways(y[:n]).T @ own[self._momenta]
        slopes[:, :n] += np.array([self.site.phase(y)[self._momenta] @ move.A for move in self.moves])
        return slopes

    def momenta_at(self, x: Array) -> Array:
        return self.momenta_of(self.state(x))

    def rows(self, x: Array, held: Sequence[tuple[str, int]]) -> tuple[Array, Array]:
        """Return what has to vanish and its derivatives by coordinates and rates: constraints, accelerations that the moves do not
        make, changes of what is held; last that no step is along a move."""
        n, k = self.n, self.k
        y, turn, ways = self.state(x), self._turn(x), self.ways(x[:n])
        v = y[n : 2 * n]
        found = self.site.derivatives(y)
        along = np.block([[np.eye(n), np.zeros((n, k))], [turn, ways]])
        position, rate = self.site.constraints(y)
        left = self.site.rates(y)[n : 2 * n] - turn @ v
        turned = np.hstack([turn @ turn, turn @ ways + np.array([move.A @ v for move in self.moves]).T])
        residuals = [position, rate, left]
        slopes = [found.position[:, : 2 * n] @ along, found.rate[:, : 2 * n] @ along,
                  found.rates[n : 2 * n, : 2 * n] @ along - turned]  # fmt: skip
        momenta, momenta_slopes = self.momenta_of(y) - self.p0, self.momenta_slopes(y) @ along
        for kind, a in held:
            place = {"momentum": -1, "rate": n + a, "place": a}[kind]
            residuals.append(momenta[[a]] if place < 0 else (x - self.start)[[place]])
            slopes.append(momenta_slopes[[a]] if place < 0 else np.eye(n + k)[[place]])
        across = np.hstack([(ways / self.lengths[:, None] ** 2).T, self._conjugate(x)])
        residuals.append(np.zeros(k))
        slopes.append(across)
        return np.concatenate(residuals), np.vstack(slopes)

    def _conjugate(self, x: Array) -> Array:
        """Return how the rates of the moves change along each of them, where moves do not commute."""
        rows = []
        turn, ways = self._turn(x), self.ways(x[: self.n])
        span = np.array([np.r_[move.A.ravel(), move.b] for move in self.moves]).T
        b = ways @ x[self.n :] - turn @ x[: self.n]
        for move in self.moves:
            other = np.r_[(move.A @ turn - turn @ move.A).ravel(), move.A @ b - turn @ move.b]
            rows.append(solve(span, other, POSITIONS) / self.speeds**2)
        return np.array(rows)

    def nearest(self, x: Array) -> Array:
        """Return the same motion carried along its moves to where it is nearest to the start, angles within a turn."""
        n, k = self.n, self.k
        x = x.copy()
        x[:n] = np.where(
            self.periodic, x[:n] - 2 * np.pi * np.ceil((x[:n] - np.pi * (1 + 1e-12)) / (2 * np.pi)), x[:n]
        )
        v, fields = (
            self.state(x)[n : 2 * n],
            [np.block([[m.A, m.b[:, None]], [np.zeros((1, n + 1))]]) for m in self.moves],
        )
        best, least = x, np.inf
        turning = [a for a, m in enumerate(self.moves) if m.A.any()]
        for turns in product(QUARTERS, repeat=min(len(turning), 3)):
            c = np.zeros(k)
            c[turning[:3]] = turns
            moved = self._carried_by(fields, c)
            for _ in range(40):
                q = moved[:n, :n] @ x[:n] + moved[:n, n]
                off, ways = (q - self.start[:n]) / self.lengths**2, self.ways(q)
                slope = ways.T @ off
                bend = np.array([off @ m.A @ ways for m in self.moves])
                values, vectors = np.linalg.eigh(
                    (ways / self.lengths[:, None] ** 2).T @ ways + (bend + bend.T) / 2
                )
                values = np.abs(values)
                used = values > POSITIONS * values.max(initial=0.0)
                step = -vectors[:, used] @ ((vectors[:, used].T @ slope) / values[used])
                step *= min(1.0, 0.5 / max(float(np.abs(step[turning]).max(initial=0.0)), 1e-300))
                moved = self._carried_by(fields, step) @ moved
                if np.abs(step).max(initial=0.0) < 1e-15:
                    break
            q = moved[:n, :n] @ x[:n] + moved[:n, n]
            away = float(np.linalg.norm((q - self.start[:n]) / self.lengths))
            if away < least - 1e-9:
                carried = solve(self.ways(q), moved[:n, :n] @ v, POSITIONS)
                best, least = np.r_[q, carried], away
        return best

    def _carried_by(self, fields: list[Array], c: Array) -> Array:
        """Return the map, of coordinates and 1, that moves make of them in the times ``c``."""
        return np.asarray(
            expm(sum((f * s for f, s in zip(fields, c, strict=True)), np.zeros((self.n + 1, self.n + 1))))
        )

    def columns(self) -> list[int]:
        """Return what a steady motion is told by: coordinates that no move shifts, and rates of the moves."""
        return [*(k for k in range(self.n) if not self.shifted[k]), *range(self.n, self.n + self.k)]

    def stability(self, x: Array) -> tuple[Complex, bool | None]:
        """Return the eigenvalues of motions near by, carried along and with the same constant momenta, and whether they stay
        near: by these, and by the energy with constraints and momenta held."""
        n, y = self.n, self.state(x)
        found, turn = self.site.derivatives(y), self._turn(x)
        linear = found.rates[: 2 * n, : 2 * n] - np.kron(np.eye(2), turn)
        rows = np.vstack(
            [found.position[:, : 2 * n], found.rate[:, : 2 * n], self.momenta_slopes(y)[self._constant()]]
        )
        scale = np.r_[self.lengths, np.full(n, max(float(np.abs(y[n : 2 * n]).max()), 1e-3))]
        rows = _alike(rows * scale)
        allowed = null_space(rows, POSITIONS, 1.0)
        ways = np.array([np.r_[move.at(y[:n]), move.A @ y[n : 2 * n]] for move in self.moves]) / scale
        ways = _alike(ways).T
        along = ways @ null_space(rows @ ways, POSITIONS, 1.0)
        kept = allowed @ null_space((allowed.T @ along).T, POSITIONS, 1.0)
        values, errors = poles(kept.T @ (linear * scale / scale[:, None]) @ kept)
        size = float(np.abs(values).max(initial=0.0))
        limits = np.array([1e-7 * size if e is None else 4 * e + 1e-12 * size for e in errors])
        if (values.real > limits).any():
            return values, False
        if len(values) and (values.real < -limits).all():
            return values, True
        holonomic = len(found.rate) == len(found.position)
        safe = self.keeps_energy and holonomic and all(move.kept for move in self.moves)
        return values, True if safe and self._minimum(y, kept * scale[:, None]) else None

    def _constant(self) -> list[int]:
        return [a for a, move in enumerate(self.moves) if move.kept]

    def _minimum(self, y: Array, ways: Array) -> bool:
        """Whether the energy has a strict minimum there over the states on the constraints with the same momenta, by differences."""
        wanted, m, h = self.momenta_of(y), ways.shape[1], APART

        def onto(z: Array) -> tuple[Array, float]:
            found, constant, n = self.site.derivatives(z), self._constant(), 2 * self.n
            left = np.r_[*self.site.constraints(z), (self.momenta_of(z) - wanted)[constant]]
            rows = np.vstack([found.position[:, :n], found.rate[:, :n], self.momenta_slopes(z)[constant]])
            step = -solve(rows, left, NEWTON)
            return np.r_[step, np.zeros(len(z) - n)], float(np.abs(step).max())

        def energy(way: Array) -> float:
            z = y.copy()
            z[: 2 * self.n] += way
            return float(self.site.phase(newton(z, onto, added, most=6, close=EPSILON).at)[self._energy])

        hessian = np.zeros((m, m))
        try:
            for i in range(m):
                for j in range(i + 1):
                    corners = [
                        energy(h * (s * ways[:, i] + t * ways[:, j])) * s * t
                        for s in (-1, 1)
                        for t in (-1, 1)
                    ]
                    hessian[i, j] = hessian[j, i] = sum(corners) / 4
            flat = 1e-12 * (abs(energy(0 * ways[:, 0])) + float(np.abs(hessian).max())) if m else 0.0
        except SimulationError:
            return False
        return bool(m and np.isfinite(hessian).all() and np.linalg.eigvalsh(hessian).min() > 16 * flat)


def _alike(rows: Array) -> Array:
    """Return rows of the length 1, without those that are nothing."""
    norms = np.linalg.norm(rows, axis=1)
    filled = norms > NOTHING * norms.max(initial=1e-300)
    return np.asarray(rows[filled] / norms[filled][:, None])
