"""The search for steady motions: Newton's method from many guesses, errors, and stability by Routh's function."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from ...local.equilibrium import EPSILON, check_autonomous
from ...local.operating_point import site_of
from ...local.search import box_of, spread_evenly
from ...local.zeros import Complex, poles
from ...numerics.newton import added, newton
from ...numerics.rank import NEWTON, POSITIONS, condition, inverse, solve
from ...outcome import SimulationError
from ...problem import Array, Problem
from ...settings import Place
from ..study import Study

GUESSES = 96
ITERATIONS = 60
LONGEST = 0.5
"""Of the size of an unknown, in one step."""
NEAR = 1e-10
"""A last step, in sizes of the unknowns, below which a solution is one."""
SAME = 1e-6
POLE = 1e-14
"""Of its inertia at the start: below this a cyclic coordinate has none, as an azimuth nearer than 1e-7 to a pole."""
REACH = 100.0
"""Times the size of the rates of the start, and one over it, between which unknown rates are looked for."""


class SteadyMotion(Struct, frozen=True, eq=False):
    """A steady motion: its state, errors of the ``unknowns`` by column, and what the motions near it do."""

    y: Array
    errors: dict[int, float]
    eigenvalues: Complex
    stable: bool | None


class SteadySearch:
    """The equations of steady motion at one set of values, and their unknowns, by columns of (q, v)."""

    def __init__(
        self, problem: Problem, study: Study, vary: Sequence[str], values: Mapping[str, float]
    ) -> None:
        asked = replace(study, values={**study.values, **values})
        self.site = site = site_of(problem, asked, Place())
        check_autonomous(site, site.derivatives(site.y), site.y)
        self.nq = nq = problem.nq
        self.names = [q.name for q in problem.states[: 2 * nq]]
        self.units = [q.unit for q in problem.states[: 2 * nq]]
        box = box_of(site)
        self.cyclic = [k for k in range(nq) if self.names[k] in box.idle]
        self.shape = [k for k in range(nq) if k not in self.cyclic]
        self.momenta = [k for k, q in enumerate(problem.phase) if q.kind == "momentum"]
        self.energy_place = next(k for k, q in enumerate(problem.phase) if q.kind == "energy")
        self.fixed = not vary
        self.undefined: set[str] = set()
        """Where cyclic coordinates lose their meaning, as an azimuth at a pole, and rates of them are not motions."""
        rates = [nq + k for k in self.cyclic]
        if self.fixed:
            self.unknown = np.array([*self.shape, *rates], dtype=np.intp)
        else:
            self.unknown = np.array([self._column(name) for name in vary], dtype=np.intp)
            if len(self.unknown) != len(self.shape):
                raise SimulationError(
                    f"{len(self.shape)} equations are left, of {', '.join(self.names[k] for k in self.shape) or 'nothing'}, "
                    f"and {len(self.unknown)} unknowns are named",
                    help="name as many, or none: then the momenta stay as they start",
                )
        y = site.y.copy()
        y[[nq + k for k in self.shape]] = 0.0
        self.start, self.p0 = y, self.site.phase(site.y)[self.momenta][self.cyclic]
        self._bounds(box)

    def _column(self, name: str) -> int:
        free = [*(self.names[k] for k in self.shape), *(self.names[self.nq + k] for k in self.cyclic)]
        if name not in free:
            raise SimulationError(
                f"'{name}' cannot be sought", help=f"steady motions differ in {', '.join(free)}"
            )
        return self.names.index(name)

    def _bounds(self, box: Any) -> None:
        """Set the ranges and sizes of the unknowns, and which are angles that may turn round."""
        chart, nq = self.site.chart, self.nq
        self.low, self.high = np.full(2 * nq, -1.0), np.full(2 * nq, 1.0)
        self.periodic: NDArray[np.bool_] = np.zeros(2 * nq, dtype=bool)
        self.stated: NDArray[np.bool_] = np.zeros(2 * nq, dtype=bool)
        for k, j in enumerate(box.moved):
            if j < chart.nd:
                place = chart.places[j]
                self.low[place], self.high[place] = box.low[k], box.high[k]
                self.periodic[place], self.stated[place] = box.periodic[k], box.stated[k]
        speed = float(np.abs(self.site.y[nq : 2 * nq]).max())
        slope = np.abs(self.site.derivatives(self.start).rates[nq:, :nq])
        natural = float(np.sqrt(slope[np.isfinite(slope)].max(initial=0.0)))
        self.speed = speed or natural or 1.0
        self.sizes = np.r_[np.maximum(1.0, np.abs(self.start[:nq])), np.full(nq, self.speed)]

    def _slopes(self, y: Array) -> Array:
        """Return the derivatives of the momenta of cyclic coordinates by q and v."""
        site = self.site
        assert site.case.functions.phase_gradient is not None, "the part phase"
        found = site.case.functions.phase_gradient(site.t, y, site.u, site.z, site.p)
        return np.asarray(found).reshape(-1, 2 * self.nq)[self.momenta][self.cyclic]

    def momenta_at(self, y: Array) -> Array:
        """Return the momenta of the cyclic coordinates."""
        return self.site.phase(y)[self.momenta][self.cyclic]

    def equations(self, y: Array) -> tuple[Array, Array]:
        """Return what has to vanish and its derivatives by q and v: accelerations, and changes of momenta that are held."""
        nq = self.nq
        left, slopes = self.site.rates(y)[nq : 2 * nq], self.site.derivatives(y).rates[nq : 2 * nq]
        if not self.fixed:
            return left, slopes
        change = self.site.phase(y)[self.momenta][self.cyclic] - self.p0
        return np.r_[left, change], np.vstack([slopes, self._slopes(y)])

    def run(self) -> list[SteadyMotion]:
        """Search from the start and from guesses spread over the bounds."""
        found: list[SteadyMotion] = []
        for guess in [self.start, *self._guesses()]:
            one = self._newton(guess)
            if one is not None and not any(self._apart(one.y, other.y) < SAME for other in found):
                found.append(one)
        return sorted(found, key=lambda m: tuple(np.round(m.y[self.unknown], 9)))

    def _guesses(self) -> list[Array]:
        """Return states with unknown coordinates over their bounds, unknown rates over powers of ten of both signs."""
        count = len(self.unknown)
        found = []
        for point in spread_evenly(GUESSES, count):
            y = self.start.copy()
            for share, k in zip(point, self.unknown, strict=True):
                if k < self.nq:
                    y[k] = self.low[k] + share * (self.high[k] - self.low[k])
                elif not self.fixed:
                    y[k] = np.sign(share - 0.5) * self.speed * REACH ** (abs(4 * share - 2) - 1)
            if self.fixed:
                self._set_rates(y)
            found.append(y)
        return found

    def _set_rates(self, y: Array) -> None:
        """Give the cyclic coordinates the rates that belong to the momenta of the start."""
        rates = [self.nq + k for k in self.cyclic]
        slopes = self._slopes(y)[:, rates]
        change = self.p0 - self.site.phase(y)[self.momenta][self.cyclic]
        if np.isfinite(slopes).all() and np.isfinite(change).all():
            y[rates] += solve(slopes, change)

    def _newton(self, y: Array) -> SteadyMotion | None:
        """Return the steady motion that Newton's method leads to."""
        sizes = self.sizes[self.unknown]

        def step(y: Array) -> tuple[Array, float] | None:
            try:
                left, slopes = self.equations(y)
            except SimulationError:  # a derivative is undefined there
                return None
            chosen = slopes[:, self.unknown]
            if not (np.isfinite(left).all() and np.isfinite(chosen).all()):
                return None
            found = np.zeros_like(y)
            found[self.unknown] = -sizes * solve(chosen * sizes, left, NEWTON)
            sized = np.abs(found[self.unknown]) / np.maximum(sizes, np.abs(y[self.unknown]))
            return found, float(sized.max(initial=0.0))

        solved = newton(y, step, added, most=ITERATIONS, close=NEAR, longest=LONGEST)
        return self._steady_motion(solved.at) if solved.converged else None

    def _means_nothing(self, y: Array) -> bool:
        """Whether the momenta of cyclic coordinates hardly feel a rate of them, beside those of the start."""
        rates = [self.nq + k for k in self.cyclic]
        here, start = (self._slopes(at)[:, rates] for at in (y, self.start))
        size = np.sqrt(np.maximum(np.abs(np.diag(start)), 1e-300))
        return bool(np.linalg.eigvalsh(here / np.outer(size, size)).min(initial=1.0) < POLE)

    def _steady_motion(self, y: Array) -> SteadyMotion | None:
        turns = [k for k in self.unknown if self.periodic[k]]
        y[turns] -= 2 * np.pi * np.ceil((y[turns] - np.pi * (1 + 1e-12)) / (2 * np.pi))
        bounded = [k for k in self.unknown if self.stated[k]]
        if ((y[bounded] < self.low[bounded]) | (y[bounded] > self.high[bounded])).any():
            return None
        if self._means_nothing(y):
            self.undefined.add(", ".join(f"{self.names[k]} = {round(y[k], 6) + 0.0:g}" for k in self.shape))
            return None
        left, slopes = self.equations(y)
        scale = np.abs(slopes) @ np.maximum(np.abs(y[: 2 * self.nq]), 1e-3 * self.sizes)
        if (np.abs(left) > 1e-7 * scale + 1e-300).any():
            return None  # the least squares have a minimum here, the equations no zero
        if condition(slopes[:, self.unknown] * self.sizes[self.unknown]) > 1 / POSITIONS:
            errors = np.full(len(self.unknown), np.nan)  # not isolated
        else:
            errors = np.abs(inverse(slopes[:, self.unknown])) @ (
                np.abs(left) + EPSILON * scale
            ) + EPSILON * np.abs(y[self.unknown])
        values, stable = self._stability(y)
        return SteadyMotion(y, dict(zip(self.unknown.tolist(), errors.tolist(), strict=True)), values, stable)

    def _stability(self, y: Array) -> tuple[Complex, bool | None]:
        """Return the eigenvalues of motions near by with the same momenta, and whether they stay near: by these, and by the
        second variation of the energy (Routh)."""
        nq, found = self.nq, self.site.derivatives(y).rates
        s, c = np.array(self.shape, dtype=np.intp), np.array(self.cyclic, dtype=np.intp)
        kept = np.r_[s, nq + s]
        momentum = self._slopes(y)
        drift = momentum[:, :nq] @ found[:nq] + momentum[:, nq:] @ found[nq : 2 * nq]
        conserved = bool(
            (np.abs(drift) <= 1e-9 * (np.abs(momentum[:, nq:]) @ np.abs(found[nq : 2 * nq]) + 1e-300)).all()
        )
        if not conserved:
            kept = np.r_[kept, nq + c]
            values, errors = poles(
                found[np.ix_(kept, kept)], [self.site.problem.states[int(k)].unit for k in kept]
            )
        else:
            follow = -np.linalg.solve(momentum[:, nq + c], momentum[:, kept])
            slopes = found[np.ix_(kept, kept)] + found[np.ix_(kept, nq + c)] @ follow
            values, errors = poles(slopes, [self.site.problem.states[int(k)].unit for k in kept])
        size = float(np.abs(values).max(initial=0.0))
        limits = np.array([1e-7 * size if e is None else 4 * e + 1e-12 * size for e in errors])
        if (values.real > limits).any():
            return values, False
        if (values.real < -limits).all():
            return values, True
        return values, True if conserved and self._minimum(y) else None

    def amended(self, q: Array) -> float:
        """Return the energy with the coordinates that rest at ``q`` and the momenta of the state: Routh's potential."""
        y = self.start.copy()
        y[self.shape] = q
        self._set_rates(y)
        return float(self.site.phase(y)[self.energy_place])

    def _minimum(self, y: Array) -> bool:
        """Whether the energy has a strict minimum there, by differences, with the momenta of the motion held."""
        n, held = len(self.shape), self.p0
        self.p0 = self.site.phase(y)[self.momenta][self.cyclic]
        q, h = y[self.shape], 2e-3 * self.sizes[self.shape]
        hessian = np.zeros((n, n))
        for i in range(n):
            for j in range(n):
                a, b = np.eye(n)[i] * h, np.eye(n)[j] * h
                corners = [self.amended(q + s * a + t * b) * s * t for s in (-1, 1) for t in (-1, 1)]
                hessian[i, j] = sum(corners) / 4
        flat = 1e-12 * (abs(self.amended(q)) + float(np.abs(hessian).max()))
        self.p0 = held
        return bool(np.isfinite(hessian).all() and np.linalg.eigvalsh(hessian).min() > 16 * flat)

    def _apart(self, a: Array, b: Array) -> float:
        d = (a - b)[: 2 * self.nq]
        d = np.where(self.periodic, (d + np.pi) % (2 * np.pi) - np.pi, d)
        return float(
            np.abs(d / np.maximum(self.sizes, np.abs(a[: 2 * self.nq])))[self.unknown].max(initial=0.0)
        )

    @property
    def axes(self) -> list[str]:
        """Return the names of the coordinates that keep their rates."""
        return [self.names[k] for k in self.cyclic]

    def words(self) -> str:
        """Say which momenta stay as at the start."""
        held = ", ".join(f"{name} {v:.6g}" for name, v in zip(self.axes, self.p0, strict=True))
        return f"the momenta of cyclic coordinates: {held}" if self.fixed else ""

    def columns(self) -> list[int]:
        """Return what a steady motion is told by: coordinates that rest and rates of the others."""
        return [*self.shape, *(self.nq + k for k in self.cyclic)]
