"""The search: least squares over the motions, from one start or several, bit by bit where the whole ends poorly."""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from ..case import Progress
from ..outcome import SimulationError
from ..problem import Array
from .residuals import Motions, counted

WEIGHTINGS, SETTLED = 8, 1e-3
"""How often the noise of outputs is estimated at most, and the relative change below which it has settled."""
POOR, PERSISTENT = 0.1, 0.5
"""Residuals above the first, of the scatter of the data, with a correlation of neighbours above the second belong to a wrong
valley or to a wrong model: the motion is fitted bit by bit, too."""
ENOUGH = 3
"""Measured numbers for each unknown, at least, in a part of the motion that is fitted by itself."""
SHARES = tuple(0.03 * 1.25**k for k in range(16))
"""Of the measured motion, from its begin: fitted one after the other where the whole is fitted poorly."""
STOPPED = 1e-12
"""Relative change of the sum of squares, and of the unknowns, at which a search ends."""
GROWN, FAR = 3.0, 100.0
"""Times its first size: an unknown that grows without bound is beyond the first where motions take too many steps, and beyond
the second where they do not."""
NO_WORSE = 1e-6
"""Of the sum of squares: a fit that is worse by less is no worse."""
FIRST, MOST = 60, 400
"""Evaluations of a search: a first one that takes more is in a curved valley, and is begun bit by bit."""
ROUNDING = 1e-12
"""Of the largest value: what scatters less than that does not change."""
NORMAL = 1.4826
"""Standard deviation over median deviation of normal errors."""


class SearchResult(Struct, frozen=True, eq=False):
    """Where a search ended: unknowns ``x`` [k], weights [m], and the half sum of squares of what it made small."""

    x: Array
    weights: Array
    cost: float
    message: str
    converged: bool


class FitSearch:
    """``scatter`` [m]: the standard deviations of what was measured; ``noise`` [m]: those of the errors, not-a-number where
    they are to be estimated, never below ``finest`` of the scatter."""

    def __init__(
        self,
        motions: Motions,
        *,
        noise: Array,
        loss: str,
        starts: int,
        finest: float,
        progress: Progress | None,
    ) -> None:
        self.motions = motions
        self.loss = loss
        self.given = noise
        self.scatter = _scatter(motions)
        self.sizes = np.array([unknown.size for unknown in motions.unknowns])
        self.low = np.array([unknown.low for unknown in motions.unknowns])
        self.high = np.array([unknown.high for unknown in motions.unknowns])
        self._count, self._finest, self._progress = starts, finest, progress

    def run(self) -> SearchResult:
        """Search from each start and return the best end. Raises SimulationError where no motion can be computed."""
        best: SearchResult | None = None
        starts = self._starts()
        for k, x in enumerate(starts):
            found = self._one(x, most=FIRST)
            if found is None or not found.converged or self.poor(found):
                found = self._better(found, self._by_parts(x))
            if found is not None and (best is None or found.cost < best.cost):
                best = found
            if self._progress is not None:
                self._progress(0.9 * (k + 1) / len(starts))
        if best is None:
            failed = self.motions.at(starts[0])
            raise SimulationError(
                f"the motion cannot be computed where the search begins: {failed.reason}",
                help=failed.help or "begin nearer to what was measured: --set NAME=VALUE",
            )
        return self._weighted(best)

    def noise(self, found: SearchResult) -> Array:
        """Give the size of the residuals of each output [m], from their median where outliers count less."""
        motions = self.motions
        computed = motions.at(found.x)
        r, of = motions.residuals(computed, np.ones(len(motions.outputs))), motions.output_of(computed)
        free = r.size / max(r.size - len(motions.unknowns), 1)
        sizes = [
            np.sqrt(free * np.mean(own**2)) if self.loss == "linear" else NORMAL * np.median(np.abs(own))
            for own in (r[of == m] for m in range(len(motions.outputs)))
        ]
        return np.maximum(sizes, self._finest * self.scatter)

    def _starts(self) -> list[Array]:
        first = np.array([unknown.first for unknown in self.motions.unknowns])
        if self._count == 1:
            return [first]
        for unknown in self.motions.unknowns:
            if not np.isfinite([unknown.low, unknown.high]).all():
                raise SimulationError(
                    f"several starts are spread over bounds, and '{unknown.name}' has none",
                    help=f'--vary "{unknown.name} = LOW .. HIGH"',
                )
        from scipy.stats import qmc

        points = qmc.Halton(len(first), seed=1).random(self._count - 1)
        return [first, *qmc.scale(points, self.low, self.high)]

    def _one(
        self, x: Array, share: float = 1.0, weights: Array | None = None, most: int = MOST
    ) -> SearchResult | None:
        """Search from ``x`` with the first part of each motion; None where nothing can be computed there."""
        from scipy.optimize import least_squares

        if weights is None:
            weights = 1.0 / np.where(np.isfinite(self.given), self.given, self.scatter)
        motions = self.motions
        begin = motions.at(x, share)
        if not begin.values or not np.isfinite(motions.residuals(begin, weights)).all():
            return None
        count = motions.residuals(begin, weights).size

        def residuals(s: Array) -> Array:
            computed = motions.at(s * self.sizes, share)
            if not computed.values:
                return np.full(count, np.inf)
            return motions.residuals(computed, weights)

        def jacobian(s: Array) -> Array:
            slopes: Array = motions.jacobian(motions.at(s * self.sizes, share), weights) * self.sizes
            return slopes

        inside = np.clip(x, np.nextafter(self.low, np.inf), np.nextafter(self.high, -np.inf))
        found = least_squares(
            residuals,
            inside / self.sizes,
            jac=jacobian,
            bounds=(self.low / self.sizes, self.high / self.sizes),
            method="trf",
            loss=self.loss,
            xtol=STOPPED,
            ftol=STOPPED,
            gtol=STOPPED,
            max_nfev=most,
        )
        return SearchResult(
            found.x * self.sizes, weights, float(found.cost), str(found.message), found.status > 0
        )

    def _by_parts(self, x: Array) -> SearchResult | None:
        """Search with a short part of the motion first, then with longer ones: each begins where the last one ended."""
        motions = self.motions
        whole = motions.residuals(motions.at(x), self.scatter).size if motions.at(x).values else 0
        for share in SHARES:
            if whole and share * whole < ENOUGH * x.size:
                continue
            found = self._one(x, share, most=FIRST)
            if found is not None:
                x = found.x
        return self._one(x)

    def _better(self, found: SearchResult | None, other: SearchResult | None) -> SearchResult | None:
        """Return the end that is lower; one that was cut off goes on."""
        if found is None or (other is not None and other.cost < found.cost):
            return other
        return found if found.converged else self._one(found.x)

    def runaways(self, found: SearchResult) -> list[int]:
        """Give the unknowns that grow without bound: twice as large they fit no worse, or the residuals fall while motions begin to
        take too many steps."""
        motions = self.motions
        computed = motions.at(found.x)
        r = motions.residuals(computed, found.weights)
        slopes = motions.jacobian(computed, found.weights) * counted(r, self.loss)[:, None]
        falls = -(slopes.T @ r) * found.x > 0
        grown = np.abs(found.x) / self.sizes
        ends = []
        for k in np.flatnonzero((grown > GROWN) & (found.x > self.low) & (found.x < self.high)):
            further = found.x.copy()
            further[k] *= 2
            before = motions.given_up
            there = motions.at(further)
            if there.values:
                worse = np.sum(counted(r, self.loss) * (motions.residuals(there, found.weights) ** 2 - r**2))
                if grown[k] > FAR and worse <= NO_WORSE * np.sum(counted(r, self.loss) * r**2):
                    ends.append(int(k))
            elif motions.given_up > before > 0 and falls[k]:
                ends.append(int(k))
        return ends

    def poor(self, found: SearchResult) -> bool:
        """Whether the residuals are large and follow one another: errors of the data would not."""
        motions = self.motions
        computed = motions.at(found.x)
        if np.sqrt(np.mean(motions.residuals(computed, 1.0 / self.scatter) ** 2)) <= POOR:
            return False
        return motions.persistence(computed, 1.0 / self.scatter) > PERSISTENT

    def _weighted(self, found: SearchResult) -> SearchResult:
        """Estimate the noise of outputs for which it is not given, and search again with it, until it has settled.

        One output needs none: its noise scales all residuals alike, unless a loss counts large ones less.
        """
        one = len(self.motions.outputs) == 1 and self.loss == "linear"
        if one or (np.isfinite(self.given).all()):
            return found
        for _ in range(WEIGHTINGS):
            weights = 1.0 / np.where(np.isfinite(self.given), self.given, self.noise(found))
            if np.abs(weights / found.weights - 1.0).max() < SETTLED:
                break
            again = self._one(found.x, weights=weights)
            if again is None:
                break
            found = again
        return found


def _scatter(motions: Motions) -> Array:
    """Give the standard deviation of all that was measured of each output; its size where it does not change."""
    found = []
    for name in motions.outputs:
        whole = np.concatenate([m.columns[name] for m in motions.data if name in m.columns])
        values = whole[np.isfinite(whole)]
        if not values.size:
            raise SimulationError(f"no row of the data has a value of '{name}'")
        deviation, largest = float(values.std()), float(np.abs(values).max())
        found.append(deviation if deviation > ROUNDING * largest else largest or 1.0)
    return np.array(found)
