"""Errors of measured inputs: smoothed, told where they matter, and carried to the unknowns.

What drives a motion is taken as it is given. Its noise moves the unknowns, and turns them to one side where the model is not linear in
it or differentiates it (errors in variables: Fuller, Measurement Error Models, 1987). Both are found by fits to inputs with such noise
added once more (Cook, Stefanski, J. Am. Stat. Assoc. 89 (1994) 1314), each a Gauss-Newton step from the solution.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..driving_inputs import derived
from ..inputs import Table, make_table
from ..numerics.rank import solve
from ..numerics.roots import minimum
from ..outcome import SimulationError
from ..problem import Array, Problem
from .measured import Measured
from .residuals import Motions
from .search import SearchResult
from .uncertainty import FitErrors

DRAWS, FEW_DRAWS = 40, 12
"""How often noise is added: for intervals, and to see whether it matters."""
LEAST_ROWS, MOST_ROWS = 10, 2000
"""Of an input of which a smooth curve can be told from its noise, and from which it is told whether it is rough."""
PROBES, SOFTEST = 4, -4
"""Random signs that estimate how many numbers a smooth curve takes from its rows; the power of ten of the least stiffness."""
PERSISTENT = 0.5
"""Correlation of neighbours among what a smooth curve leaves: noise has less."""
MATTERS = 0.5
"""Of a standard error: what moves an unknown by more is told."""
SMALL = 1e-7
"""Of the range of an input: noise that is smaller is rounding of a file."""


class InputNoise(Struct, frozen=True, eq=False):
    """What noise of the inputs does to the unknowns: ``covariance`` [k, k] and the mean ``shift`` [k]; ``noise``: standard
    deviations by the names of the inputs."""

    covariance: Array
    shift: Array
    noise: Mapping[str, float]


class Smoother(Struct, frozen=True, eq=False):
    """The smoothing spline of a table: its rows on the curve, ``stiffness``, which gives the same smoothing of other values, and
    the noise of each row [n] that it ``left``."""

    table: Table
    stiffness: float
    left: Array

    @property
    def noise(self) -> float:
        """The standard deviation of the noise."""
        return float(np.sqrt(np.mean(self.left**2)))

    def of(self, values: Array) -> Table:
        """Smooth other values at the same times."""
        times = self.table.times
        return make_table(times, _curve(_places(times), values, self.stiffness), self.table.interpolation)


def _places(times: Array) -> Array:
    """Count times in rows, so that stiffnesses have no unit."""
    places: Array = (times - times[0]) * ((times.size - 1) / np.ptp(times))
    return places


def _curve(places: Array, values: Array, stiffness: float) -> Array:
    """Give the smoothing spline of values [n] or [n, k] at their places (Reinsch, Numer. Math. 10 (1967) 177): values - stiffness Q c,
    where (R + stiffness Q^T Q) c = Q^T values."""
    from scipy.linalg import solveh_banded

    gaps = np.diff(places)
    left, right = 1 / gaps[:-1], 1 / gaps[1:]
    middle = -left - right
    bands = np.zeros((3, gaps.size - 1))
    bands[0, 2:] = stiffness * right[:-2] * left[2:]
    bands[1, 1:] = gaps[1:-1] / 6 + stiffness * (middle[:-1] * left[1:] + right[:-1] * middle[1:])
    bands[2] = (gaps[:-1] + gaps[1:]) / 3 + stiffness * (left**2 + middle**2 + right**2)
    curvature = solveh_banded(bands, np.diff((np.diff(values, axis=0).T / gaps).T, axis=0)).T
    bent = np.zeros(values.T.shape)
    bent[..., :-2] += left * curvature
    bent[..., 1:-1] += middle * curvature
    bent[..., 2:] += right * curvature
    found: Array = values - stiffness * bent.T
    return found


def smoother(table: Table, what: str) -> Smoother:
    """Find the smoothing spline by generalised cross-validation. Raises SimulationError where it is not told from the noise.

    The trace of the smoothing is estimated by random signs (Girard, Numer. Math. 56 (1989) 1). SciPy's own search goes by steps of
    1e-5 in units of the cube of the time, and does not find small ones.
    """
    times, values = table.times, table.values
    n = times.size
    if table.interpolation == "step" or (np.diff(times) <= 0).any() or n < LEAST_ROWS:
        raise SimulationError(
            f"{what} cannot be smoothed: that takes {LEAST_ROWS} rows, times that rise, and no steps"
        )
    places = _places(times)
    signs = np.random.default_rng(1).choice((-1.0, 1.0), (PROBES, n)).T

    def taken(power: float) -> float:
        """How many numbers the curve takes from the rows."""
        return float(np.sum(signs * _curve(places, signs, 10.0**power)) / PROBES)

    def score(power: float) -> float:
        apart = values - _curve(places, values, 10.0**power)
        return float(np.dot(apart, apart)) / max(n - taken(power), 1e-3) ** 2

    powers = np.arange(SOFTEST, 3 * np.log10(n) + 2)
    best = float(powers[np.argmin([score(power) for power in powers])])
    power, _ = minimum(score, best - 1, best + 1, 0.05)
    on_curve = _curve(places, values, 10.0**power)
    apart = values - on_curve
    square = float(np.dot(apart, apart))
    if np.dot(apart[1:], apart[:-1]) > PERSISTENT * square:
        raise SimulationError(
            f"{what} cannot be smoothed: what a smooth curve leaves is not noise, as its rows follow one another; they are too few"
        )
    used = taken(power)
    freedom = n - (used if used < n / 2 else 0.0)  # a curve through all rows tells no noise
    return Smoother(
        make_table(times, on_curve, table.interpolation), 10.0**power, apart * np.sqrt(n / freedom)
    )


Smoothers = Sequence[Mapping[str, Smoother]]
"""For each measured motion, those of its inputs by name."""


def smoothers_of(data: Sequence[Measured], names: Sequence[str]) -> Smoothers:
    """Find the smooth curves of measured inputs. Raises SimulationError for what was not measured."""
    for name in names:
        if not any(name in motion.inputs for motion in data):
            raise SimulationError(f"'{name}' is to be smoothed, and is not a measured input")
    return [
        {
            name: smoother(table, f"'{name}' of {motion.source}")
            for name, table in motion.inputs.items()
            if name in names
        }
        for motion in data
    ]


def smoothed(data: Sequence[Measured], smoothers: Smoothers) -> tuple[Measured, ...]:
    """Return the motions with inputs on their smooth curves."""
    return tuple(
        replace(motion, inputs={**motion.inputs, **{name: one.table for name, one in own.items()}})
        for motion, own in zip(data, smoothers, strict=True)
    )


def scatter(smoothers: Smoothers) -> dict[str, float]:
    """Give the standard deviations of measured inputs about their smooth curves."""
    found: dict[str, float] = {}
    for own in smoothers:
        for name, one in own.items():
            found[name] = max(found.get(name, 0.0), one.noise)
    return found


def roughness(data: Sequence[Measured], names: Sequence[str]) -> dict[str, float]:
    """Give the standard deviations of those inputs that are not smooth curves, from their first rows; none of what is smooth."""
    found: dict[str, float] = {}
    for name in names:
        for motion in data:
            if name not in motion.inputs:
                continue
            table = motion.inputs[name]
            rows = slice(0, MOST_ROWS)
            first = make_table(table.times[rows], table.values[rows], table.interpolation)
            try:
                size = smoother(first, name).noise
            except SimulationError:
                continue
            if size > SMALL * float(np.ptp(table.values)):
                found[name] = max(found.get(name, 0.0), size)
    return found


def differentiated(problem: Problem, data: Sequence[Measured]) -> list[str]:
    """Give the measured inputs of which the model takes derivatives."""
    names = {problem.inputs[k].name for k in derived(problem)}
    return sorted({name for motion in data for name in motion.inputs} & names)


def carried(
    motions: Motions, found: SearchResult, noise: Mapping[str, float], smoothers: Smoothers, count: int
) -> InputNoise | None:
    """Carry noise of the inputs to the unknowns; None where motions with it cannot be computed.

    It is as given, else what smoothing left of each row times a random number (C. F. J. Wu, Ann. Stat. 14 (1986) 1261): stamps of
    time that jitter are noise where an input moves, and none where it turns back.
    """
    random = np.random.default_rng(1)
    steps = []
    for _ in range(count):
        inputs = []
        for motion, own in zip(motions.data, smoothers, strict=True):
            tables: dict[str, Table] = {}
            noisy: dict[str, Array | float] = {**{name: one.left for name, one in own.items()}, **noise}
            for name, table in motion.inputs.items():
                if name in noisy:
                    rough = table.values + noisy[name] * random.normal(size=table.times.size)
                    tables[name] = (
                        own[name].of(rough)
                        if name in own
                        else make_table(table.times, rough, table.interpolation)
                    )
            inputs.append(tables)
        computed = motions.under(found.x, inputs)
        if not computed.values:
            return None
        r, slopes = motions.residuals(computed, found.weights), motions.jacobian(computed, found.weights)
        sizes = np.linalg.norm(slopes, axis=0)
        sizes[sizes == 0] = 1.0
        steps.append(-solve(slopes / sizes, r) / sizes)
    moved = np.array(steps)
    return InputNoise(np.atleast_2d(np.cov(moved.T)), moved.mean(axis=0), {**scatter(smoothers), **noise})


def widened(judged: FitErrors, spread: InputNoise) -> FitErrors:
    """Add the spread to standard errors, intervals and correlation."""
    told = np.isfinite(judged.errors)
    errors = np.where(told, judged.errors, np.nan)
    covariance = judged.correlation * np.outer(errors, errors) + spread.covariance
    wider = np.sqrt(np.diag(covariance))
    return replace(
        judged,
        errors=np.where(told, wider, np.inf),
        half=np.where(told, judged.half * (wider / errors), np.inf),
        correlation=covariance / np.outer(wider, wider),
    )


def said_of(
    judged: FitErrors,
    spread: InputNoise | None,
    names: Sequence[str],
    units: Mapping[str, str],
    smooth: Sequence[str],
    held: bool,
) -> list[str]:
    """Say what noise of the inputs does that the intervals do not hold. ``names`` [k]: of the unknowns; ``held``: ``judged`` has
    the spread, and only what goes to one side is not in it."""
    if spread is None:
        return ["motions with noise of the inputs cannot be computed: the intervals are without it"]
    moves = np.abs(spread.shift)
    if not held:
        moves = np.hypot(moves, np.sqrt(np.diag(spread.covariance)))
    moved = [
        name
        for name, size, error in zip(names, moves, judged.errors, strict=True)
        if np.isfinite(error) and size > MATTERS * error
    ]
    if not moved:
        return []
    rough = ", ".join(
        f"'{name}' ({f'{size:.2g} {units[name]}'.strip()})" for name, size in spread.noise.items()
    )
    bare = ",".join(name for name in spread.noise if name not in smooth)
    help = f"; smooth = {bare} (--smooth) drives by a smooth curve" if bare else ""
    return [
        f"noise of {rough}, which drives the model, moves {', '.join(moved)} by more than half a standard error: the intervals "
        f"cannot be trusted{help}"
    ]
