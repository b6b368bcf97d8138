"""The search for steady motions along moves of the coordinates, where constraints tie these or none is cyclic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from ...local.equilibrium import EPSILON, check_autonomous
from ...local.operating_point import site_of
from ...local.search import spread_evenly
from ...numerics.newton import added, newton
from ...numerics.rank import NEWTON, POSITIONS, condition, inverse, rank, solve
from ...outcome import SimulationError
from ...problem import Array, Problem
from ...settings import Place
from ..flow.moving_equilibria import CarriedEquations
from ..study import Study
from .routh import GUESSES, ITERATIONS, LONGEST, NEAR, REACH, SAME, SteadyMotion

ENOUGH = 5
"""Steady motions with nothing held, from which is told what may be held."""


class CarriedSearch(CarriedEquations):
    """Steady motions of a model at one set of values, and what of its start they keep."""

    def __init__(
        self, problem: Problem, study: Study, vary: Sequence[str], values: Mapping[str, float]
    ) -> None:
        site = site_of(problem, replace(study, values={**study.values, **values}), Place())
        check_autonomous(site, site.derivatives(site.y), site.y)
        super().__init__(site)
        self.fixed = not vary
        self.unknown: NDArray[np.intp] = np.arange(self.n + self.k)
        self.held: list[tuple[str, int]] = []
        self.held = self._held(vary)

    def _held(self, vary: Sequence[str]) -> list[tuple[str, int]]:
        """Return what stays as at the start: momenta and rates of moves, and coordinates, as many as leave single motions."""
        names, n = self.names[: self.n], self.n
        touched = {f"der({name})": [a for a, move in enumerate(self.moves) if move.A[k].any() or move.b[k]]
                   for k, name in enumerate(names)}  # fmt: skip
        for name in vary:
            if name not in names and not touched.get(name):
                known = [
                    *(names[k] for k in self.columns() if k < n),
                    *(name for name, moves in touched.items() if moves),
                ]
                raise SimulationError(
                    f"'{name}' cannot be sought", help=f"steady motions differ in {', '.join(known)}"
                )
        sought = {a for name in vary for a in touched.get(name, [])}
        if self.fixed:
            tried = [("momentum", a) for a, move in enumerate(self.moves) if move.kept]
            tried += [("rate", a) for a in self._stated() if not self.moves[a].kept]
        else:
            places = [("place", k) for k in range(n) if names[k] not in vary and not self.shifted[k]]
            rates = [("rate", a) for a in self._stated() if a not in sought]
            tried = sorted([*rates, *places], key=lambda one: not self._is_stated(*one))
        place, found = self._some()
        held: list[tuple[str, int]] = []
        for one in tried:
            if found == self.n + self.k:
                break
            more = self.rows(place, [*held, one])[1]
            if self._rank(more) > found:
                held, found = [*held, one], self._rank(more)
        if vary and 0 < found < n + self.k:
            raise SimulationError(
                "the steady motions form a family when these are sought: " + ", ".join(vary),
                help="name fewer, or none: then the momenta stay as they start",
            )
        return held

    def _is_stated(self, kind: str, k: int) -> bool:
        """Whether the model states the start of a coordinate, or of the rate of one that a move shifts."""
        known = self.site.case.known
        return bool(
            known[k] if kind == "place" else known[self.n : 2 * self.n][np.flatnonzero(self.moves[k].b)].any()
        )

    def _stated(self) -> list[int]:
        """Return the moves: first those of coordinates whose rates are stated, then shifts of angles."""
        return sorted(
            range(self.k),
            key=lambda a: (not self._is_stated("rate", a), not self.units[self.n + a].startswith("rad")),
        )

    def _some(self) -> tuple[Array, int]:
        """Return a steady motion with nothing held, and the rank of its equations: elsewhere some look independent that are not."""
        best, most, seen = self.start, 0, 0
        for guess in [self.start, *self._guesses()]:
            x = self._newton(guess)
            if x is None or not np.isfinite(left := self.rows(x, [])[0]).all() or np.abs(left).max() > 1e-6:
                continue
            found = self._rank(self.rows(x, [])[1])
            if found > most:
                best, most = x, found
            seen += 1
            if seen == ENOUGH:
                break
        return best, most

    def _rank(self, rows: Array) -> int:
        return rank(self.scaled(rows)[0], POSITIONS)

    def words(self) -> str:
        """Say what stays as at the start."""
        values = {"momentum": self.p0, "rate": self.start[self.n :], "place": self.start[: self.n]}
        names = {
            "momentum": [f"the momentum of {a}" for a in self.axes],
            "rate": self.names[self.n :],
            "place": self.names[: self.n],
        }
        return ", ".join(f"{names[kind][k]} {values[kind][k]:.6g}" for kind, k in self.held)

    def run(self) -> list[SteadyMotion]:
        """Search from the start and from guesses spread over the bounds."""
        found: list[SteadyMotion] = []
        for guess in [self.start, *self._guesses()]:
            x = self._newton(guess)
            one = None if x is None else self._steady_motion(x)
            if one is not None and not any(self._apart(one.y, other.y) < SAME for other in found):
                found.append(one)
        return sorted(found, key=lambda m: tuple(np.round(m.y, 9)))

    def _guesses(self) -> list[Array]:
        found = []
        free = [a for a in range(self.k) if ("rate", a) not in self.held]
        for point in spread_evenly(GUESSES, self.n + len(free)):
            x = self.start.copy()
            x[: self.n] = self.low + point[: self.n] * (self.high - self.low)
            for kind, k in self.held:
                if kind == "place":
                    x[k] = self.start[k]
            for share, a in zip(point[self.n :], free, strict=True):
                x[self.n + a] = np.sign(share - 0.5) * self.speeds[a] * REACH ** (abs(4 * share - 2) - 1)
            x = self._onto(x)
            kept = [a for kind, a in self.held if kind == "momentum"]
            if kept:
                y = self.state(np.r_[x[: self.n], np.zeros(self.k)])
                slopes = self.momenta_slopes(y)[:, self.n :] @ self.ways(x[: self.n])
                wanted = (self.p0 - self.momenta_of(y))[kept]
                if np.isfinite(slopes).all() and np.isfinite(wanted).all():
                    x[self.n :][kept] = solve(slopes[np.ix_(kept, kept)], wanted, POSITIONS)
            found.append(x)
        return found

    def _onto(self, x: Array) -> Array:
        """Return a guess moved onto the constraints of positions, as far as a few steps get."""
        if not self.site.problem.constraints:
            return x

        def step(x: Array) -> tuple[Array, float] | None:
            y = self.site.y.copy()
            y[: self.n], y[self.n : 2 * self.n] = x[: self.n], 0.0
            try:
                slopes = self.site.derivatives(y).position[:, : self.n]
            except SimulationError:
                return None
            left = self.site.constraints(y)[0]
            if not (np.isfinite(left).all() and np.isfinite(slopes).all()):
                return None
            sized = solve(slopes * self.lengths, -left, NEWTON)
            return np.r_[self.lengths * sized, np.zeros(self.k)], float(np.abs(sized).max(initial=0.0))

        return newton(x, step, added, most=8, close=NEAR, longest=1.0).at

    def _newton(self, x: Array) -> Array | None:
        def step(x: Array) -> tuple[Array, float] | None:
            try:
                left, slopes = self.rows(x, self.held)
            except (SimulationError, np.linalg.LinAlgError):  # a derivative is undefined there
                return None
            if not (np.isfinite(left).all() and np.isfinite(slopes).all()):
                return None
            scaled, norms = self.scaled(slopes)
            found = -self.sizes * solve(scaled, left / norms, NEWTON)
            return found, float((np.abs(found) / np.maximum(self.sizes, np.abs(x))).max(initial=0.0))

        solved = newton(x, step, added, most=ITERATIONS, close=NEAR, longest=LONGEST)
        return solved.at if solved.converged else None

    def _steady_motion(self, x: Array) -> SteadyMotion | None:
        x = self.nearest(x)
        n = self.n
        if ((x[:n] < self.low) | (x[:n] > self.high))[self.stated].any():
            return None
        left, slopes = self.rows(x, self.held)
        scale = np.abs(slopes) @ np.maximum(np.abs(x), 1e-3 * self.sizes)
        if (np.abs(left) > 1e-7 * scale + 1e-300).any():
            return None  # the least squares have a minimum here, the equations no zero
        scaled, norms = self.scaled(slopes)
        if condition(scaled) > 1 / POSITIONS:
            errors = np.full(n + self.k, np.nan)  # not isolated
        else:
            own = np.abs(inverse(scaled)) @ ((np.abs(left) + EPSILON * scale) / norms)
            errors = self.sizes * own + EPSILON * np.abs(x)
        values, stable = self.stability(x)
        return SteadyMotion(x, dict(enumerate(errors.tolist())), values, stable)

    def _apart(self, a: Array, b: Array) -> float:
        d = a - b
        d[: self.n] = np.where(self.periodic, (d[: self.n] + np.pi) % (2 * np.pi) - np.pi, d[: self.n])
        return float(np.abs(d / np.maximum(self.sizes, np.abs(a))).max(initial=0.0))
