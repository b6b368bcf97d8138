"""Rates of growth with their errors: Lyapunov exponents from logarithms of how far neighbouring motions have parted."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

Array = NDArray[np.float64]

BATCHES, LONG_BATCHES = 32, 8
"""Parts of the motion whose means tell the spread; the longer ones too, as motions that stay long near regular ones make
neighbouring parts alike, and means over short parts seem surer than they are."""
DOUBLINGS = 8
CONFIDENCE = 0.95
SETTLING = 0.1
"""Share of the motion that is left out at its beginning."""
POWER = 2.0
"""Of time: growth up to such a power is told from none by no exponent. Motions that part in proportion to time, as those
with periods of their own do, grow by the first."""
FALLING = 0.6
"""An exponent of the later half of the motion below this share of that of the first half still falls: t^k, whose exponent
falls to zero, gives ln(20/11)/ln(11/2) = 0.35 for all k. By chance a chaotic motion that is short does so, too, but by no more than its
means over parts swing about their trend."""


def times_of(begin: float, end: float) -> Array:
    """Give few times by which ``estimated`` tells as much as by all, the ends of its parts, and before them doublings for ``megno``."""
    first = SETTLING * (end - begin)
    doubled = first * 2.0 ** np.arange(-DOUBLINGS, 0)
    return np.concatenate([[begin], begin + doubled, np.linspace(begin + first, end, BATCHES + 1)])


def _index(times: Array, of: Array | float) -> Any:
    """Give the indices of the increasing times next to some."""
    right = np.clip(np.searchsorted(times, of), 1, len(times) - 1)
    return np.where(of - times[right - 1] < times[right] - of, right - 1, right)


def estimated(times: Array, growth: Array) -> tuple[Array, Array]:
    """Give the exponents [k] and half of their intervals of confidence [k], by means over batches of time.

    What grows, or falls, by a power of time has the exponent zero, at which means arrive like log(t)/t: an interval holds
    zero as well where the whole growth is no more than such a power, and where the exponent still falls. ``swing``: half of the interval of
    means about their trend, of which the difference of two halves of the motion has twice as much.
    """
    first = _index(times, times[0] + SETTLING * (times[-1] - times[0]))
    span = times[-1] - times[first]
    means: Array = (growth[-1] - growth[first]) / span
    halves: Array = np.zeros_like(means)
    swing = halves
    for count in (LONG_BATCHES, BATCHES):
        edges = _index(times, np.linspace(times[first], times[-1], count + 1))
        batches = np.diff(growth[edges], axis=0) / np.diff(times[edges])[:, None]
        quantile = stdtrit(count - 1, (1 + CONFIDENCE) / 2) / math.sqrt(count)
        halves = np.maximum(halves, quantile * batches.std(axis=0, ddof=1))
        trend = np.stack([np.ones(count), np.linspace(-1, 1, count)], axis=1)
        about = batches - trend @ np.linalg.lstsq(trend, batches, rcond=None)[0]
        swing = quantile * np.sqrt((about**2).sum(axis=0) / (count - 2))
    powers = POWER * math.log((times[-1] - times[0]) / (times[first] - times[0]))
    middle = int(np.searchsorted(times, (times[first] + times[-1]) / 2))
    early = (growth[middle] - growth[first]) / (times[middle] - times[first])
    later = (growth[-1] - growth[middle]) / (times[-1] - times[middle])
    falls = (later * np.sign(early) < FALLING * np.abs(early)) & (np.abs(early - later) > 2 * swing)
    none = (np.abs(means) * span <= powers) | falls
    return means, halves + np.where(none, np.abs(means), 0.0)


def megno(times: Array, growth: Array) -> Array:
    """Give the mean exponential growth factors of nearby orbits [k], as means over time (Cincotta and Simó 2000).

    With the logarithm l of the growth, the factor is Y(t) = 2/t times the integral of l' s ds = 2 (l(t) - mean of l up to t): 2 p where
    changes grow like t^p, and rate*t where they grow exponentially. Its mean over time, 2 p and rate*t/2, swings less.
    """
    passed = (times - times[0])[1:, None]
    logs = growth - growth[0]
    spans = np.diff(times)[:, None]
    factors = 2 * (logs[1:] - np.cumsum(spans * (logs[1:] + logs[:-1]) / 2, axis=0) / passed)
    whole: Array = (spans * np.vstack([factors[:1] / 2, (factors[1:] + factors[:-1]) / 2])).sum(
        axis=0
    ) / passed[-1]
    return whole


CHAOTIC = 2 * POWER
"""A factor above which neighbouring motions part faster than by a power of the time."""


def parted(factors: Array) -> tuple[str, ...]:
    """Say how many of some motions part from their neighbours faster than by a power of the time."""
    known = factors[np.isfinite(factors)]
    count = int((known > CHAOTIC).sum())
    if not known.size:
        return ()
    return (
        f"{count} of {known.size} motions part from their neighbours faster than the square of the time (megno above {CHAOTIC:g}): "
        "chaotic where they stay bounded",
    )
