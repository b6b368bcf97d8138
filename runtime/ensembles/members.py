"""Which members an ensemble has: products of values, clouds of random values, and lists of members."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from ..outcome import SimulationError
from ..problem import Array

MOST_MEMBERS = 10**8
SAMPLINGS = ("plain", "latin", "sobol")
SAMPLE = "sample"
"""The name of the dimension of a cloud, and of a list of members."""


class Axis(Struct, frozen=True, eq=False):
    """The values [n] of a parameter, an initial value or an input, in SI."""

    name: str
    unit: str
    values: Array


class Spread(Struct, frozen=True):
    """A random value in SI. ``kind`` and ``numbers``: normal (mean, deviation; the mean alone where a covariance holds the
    rest), uniform (low, high), lognormal (median, deviation of the logarithm), triangular (low, mode, high)."""

    name: str
    unit: str
    kind: str
    numbers: tuple[float, ...]


NUMBERS = {"normal": (1, 2), "uniform": (2, 2), "lognormal": (2, 2), "triangular": (3, 3)}
"""How many numbers each kind takes, at least and at most."""


class Listed(Struct, frozen=True, eq=False):
    """Members that are given one by one: ``rows`` [n, names] in SI."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: Array
    remarks: tuple[str, ...] = ()


class Members(Struct, frozen=True, eq=False):
    """Every combination of the values of the axes, and for each of these the same ``cloud`` [n, names of it], if there is one."""

    axes: tuple[Axis, ...]
    cloud: Listed | None = None
    remarks: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        return (*(axis.name for axis in self.axes), *(self.cloud.names if self.cloud else ()))

    @property
    def units(self) -> tuple[str, ...]:
        return (*(axis.unit for axis in self.axes), *(self.cloud.units if self.cloud else ()))

    @property
    def shape(self) -> tuple[int, ...]:
        """The lengths of the dimensions: those of the axes, then that of the cloud."""
        return (*(axis.values.size for axis in self.axes), *((len(self.cloud.rows),) if self.cloud else ()))

    @property
    def dimensions(self) -> tuple[str, ...]:
        return (*(axis.name for axis in self.axes), *((SAMPLE,) if self.cloud else ()))

    @property
    def count(self) -> int:
        return math.prod(self.shape)

    def values(self, first: int, last: int) -> Array:
        """Give the values [last - first, names] of members in SI; the last dimension changes fastest."""
        places = np.unravel_index(np.arange(first, last), self.shape)
        columns = [axis.values[place] for axis, place in zip(self.axes, places, strict=False)]
        if self.cloud is not None:
            columns += list(self.cloud.rows[places[-1]].T)
        return np.ascontiguousarray(np.column_stack(columns))


def members_of(
    axes: Sequence[Axis],
    spreads: Sequence[Spread],
    listed: Listed | None,
    samples: int | None,
    seed: int,
    sampling: str,
    covariance: Array | None,
) -> Members:
    """Make the members that a question asks for. Raises SimulationError for what is empty, too many, or contradicts itself."""
    size = math.prod(axis.values.size for axis in axes)
    if listed is not None:
        if spreads:
            raise SimulationError("members are drawn at random or listed, not both")
        if samples is not None:
            raise SimulationError(
                f"the list has {len(listed.rows)} members: 'samples' belongs to random values"
            )
        size *= len(listed.rows)
    elif spreads:
        if samples is None:
            raise SimulationError(
                f"'{spreads[0].name}' is drawn at random: the number of samples is missing",
                help="say how many: samples = 10000, --samples 10000 to the command, or samples=10000 in Python",
            )
        size *= samples
    elif samples is not None or covariance is not None:
        what = "samples" if samples is not None else "covariance"
        raise SimulationError(
            f"'{what}' belongs to random values, and nothing is drawn at random",
            help='as in vary = "theta ~ normal(1 rad, 0.01 rad)"',
        )
    if not axes and not spreads and listed is None:
        raise SimulationError(
            "nothing varies: an ensemble takes ranges, values or distributions",
            help='as in vary = "l = 0.5 m .. 2 m, 200" or vary = "theta ~ normal(1 rad, 0.01 rad)"',
        )
    if size == 0:
        (empty,) = [axis.name for axis in axes if not axis.values.size][:1] or ["the list"]
        raise SimulationError(f"there are no members: '{empty}' has no values")
    if size > MOST_MEMBERS:
        lengths = " times ".join(str(axis.values.size) for axis in axes)
        raise SimulationError(
            f"these are {size:.3g} members"
            + (f" ({lengths})" if len(axes) > 1 else "")
            + f", of which each takes some 50 bytes and more: {50 * size / 1e9:.3g} GB at least",
            help=f"at most {MOST_MEMBERS:.0e} are made in one question: take fewer values, or draw at random",
        )
    cloud = listed
    remarks = listed.remarks if listed is not None else ()
    if spreads:
        assert samples is not None
        cloud, remarks = _drawn(spreads, samples, seed, sampling, covariance)
    return Members(tuple(axes), cloud, remarks)


def _drawn(
    spreads: Sequence[Spread], samples: int, seed: int, sampling: str, covariance: Array | None
) -> tuple[Listed, tuple[str, ...]]:
    places, remarks = _places(len(spreads), samples, seed, sampling)
    normal = [k for k, one in enumerate(spreads) if one.kind == "normal" and len(one.numbers) == 1]
    if normal and covariance is None:
        name = spreads[normal[0]].name
        raise SimulationError(
            f"the normal distribution of '{name}' has no standard deviation",
            help=f"'{name} ~ normal(MEAN, DEVIATION)', or 'covariance' for all that have a mean alone",
        )
    rows = np.empty_like(places)
    for k, one in enumerate(spreads):
        if k not in normal:
            rows[:, k] = quantile(one, places[:, k])
    if covariance is not None:
        rows[:, normal] = _correlated([spreads[k] for k in normal], places[:, normal], covariance)
    names, units = zip(*((one.name, one.unit) for one in spreads), strict=True)
    return Listed(names, units, rows), remarks


def _places(count: int, samples: int, seed: int, sampling: str) -> tuple[Array, tuple[str, ...]]:
    """Give points [samples, count] in the open unit cube."""
    remarks: tuple[str, ...] = ()
    if sampling == "plain":
        places = np.random.default_rng(seed).random((samples, count))
    else:
        from scipy.stats import qmc

        kind = qmc.Sobol if sampling == "sobol" else qmc.LatinHypercube
        engine = kind(count, seed=np.random.default_rng(seed))
        if sampling == "sobol":
            places = engine.random_base2((samples - 1).bit_length())[:samples]
            if samples & (samples - 1):
                near = 1 << (samples - 1).bit_length()
                remarks = (
                    f"Sobol' points are balanced where their number is a power of two: {near} instead of {samples}",
                )
        else:
            places = engine.random(samples)
    return np.clip(places, 2.0**-54, 1 - 2.0**-53), remarks


def quantile(one: Spread, places: Array) -> Array:
    """Give the values at which the distribution function has the given values."""
    from scipy.special import ndtri

    match one.kind:
        case "normal":
            mean, deviation = one.numbers
            return np.asarray(mean + deviation * ndtri(places))
        case "lognormal":
            median, deviation = one.numbers
            return np.asarray(median * np.exp(deviation * ndtri(places)))
        case "uniform":
            low, high = one.numbers
            return np.asarray(low + (high - low) * places)
    low, mode, high = one.numbers
    below = places * (high - low) < mode - low
    rising = low + np.sqrt(places * (high - low) * (mode - low))
    falling = high - np.sqrt((1 - places) * (high - low) * (high - mode))
    return np.where(below, rising, falling)


def _correlated(normal: Sequence[Spread], places: Array, covariance: Array) -> Array:
    from scipy.special import ndtri

    if covariance.shape != (len(normal), len(normal)):
        raise SimulationError(
            f"the covariance has {' x '.join(map(str, covariance.shape))} numbers for the {len(normal)} normal "
            "distributions with a mean alone",
            help="leave the standard deviation out of those that the matrix is about, in its order",
        )
    if not np.allclose(covariance, covariance.T, rtol=1e-12, atol=0):
        raise SimulationError("the covariance is not symmetric")
    try:
        factor = np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        raise SimulationError("the covariance is not positive definite: no random values have it") from None
    means = np.array([one.numbers[0] for one in normal])
    return np.asarray(means + ndtri(places) @ factor.T)
