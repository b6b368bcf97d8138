"""Do intervals of Lyapunov exponents keep their promise? Studies as they are asked for, against a motion a hundred times longer."""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np
from msgspec import Struct

import mechc
from mechc.runtime.numerics.growth_rates import estimated
from mechc.runtime.problem import Array
from mechc.runtime.studies.kinds.lyapunov import FEWEST, LATER, WANTED

from .machine import table, write
from .references import EXAMPLES

REPETITIONS = 100
TIGHT = 1e-12
"""Tolerance of the long motion, where its energy has to stay."""
PLAIN = 1e-8


class System(Struct, frozen=True):
    """A chaotic example, how it is asked, and the length at which each repetition ends, known or not: reached in less than the 45 s
    of the study."""

    example: str
    asked: dict[str, Any]
    length: float
    literature: str
    tolerance: float = TIGHT


SYSTEMS = (
    System("lorenz", {}, 8000.0, "0.9056"),
    System("driven_pendulum", {"set": {"g": 1.15}}, 1e6, "", PLAIN),
    System("henon_heiles", {"experiment": "chaotic"}, 4e6, "0.13"),
)


def as_asked(times: Array, growth: Array) -> tuple[float, float]:
    """Tell exponent and half width as a study without options does that goes along a motion, of which no more is there than this."""
    at, before = FEWEST * float(times[1] - times[0]), False
    while True:
        last = int(min(np.searchsorted(times - times[0], at), len(times) - 1))
        means, halves = estimated(times[: last + 1], growth[: last + 1])
        known = bool(halves[0] < WANTED * abs(means[0]))
        if (known and before) or last == len(times) - 1:
            return float(means[0]), float(halves[0])
        at, before = at * LATER, known


def coverage(times: Array, growth: Array) -> tuple[float, int, Array]:
    """Cut a long motion in pieces: the mean of all of it, how many pieces' intervals hold it, and half widths of these."""
    whole = float(growth[-1] - growth[0]) / float(times[-1] - times[0])
    edges = np.searchsorted(times, np.linspace(times[0], times[-1], REPETITIONS + 1)[:-1])
    held, halves = 0, []
    for first, last in zip(edges, [*edges[1:], len(times)], strict=True):
        mean, half = as_asked(times[first : last + 1], growth[first : last + 1, None])
        held += bool(abs(mean - whole) <= half)
        halves.append(half)
    return whole, held, np.array(halves)


def row(system: System, quick: bool) -> list[str]:
    model = mechc.load(EXAMPLES / f"{system.example}.mech")
    model.lyapunov(time=system.length / 100, **system.asked)  # built and kept
    before = time.process_time()
    found = model.lyapunov(**system.asked)
    took = time.process_time() - before
    told, halves = np.array(found.details["exponents"]), found.details["confidence"]
    pairs = float(np.abs(told + told[::-1] - told.sum() * 2 / len(told)).max())
    length = system.length / (20 if quick else 1)
    long = model.lyapunov(time=REPETITIONS * length, count=1, tolerance=system.tolerance, **system.asked)
    whole, held, widths = coverage(long.arrays["time"], long.arrays["growth"][:, 0])
    return [
        system.example, f"{told[0]:.5f} ± {halves[0]:.5f}", f"{halves[0] / told[0]:.1%}", f"{took:.1f} s",
        f"{pairs:.1e}" if len(told) % 2 == 0 else "", f"{whole:.5f}", system.literature, f"{length:g}",
        f"{held} of {REPETITIONS}", f"{np.median(widths) / whole:.1%}", f"{widths.max() / whole:.1%}",
    ]  # fmt: skip


def main(quick: bool = False) -> None:
    rows = []
    for system in SYSTEMS:
        rows.append(row(system, quick))
        print(rows[-1], flush=True)
    head = [
        "model", "study without options", "half width", "processor time", "pairs off by", "a hundred times longer", "literature",
        "length of a repetition", "intervals that hold it", "their half width, in the middle", "at most",
    ]  # fmt: skip
    text = (
        f"The largest exponent with its interval of 95 %, and how many of {REPETITIONS} intervals of repetitions hold that of a "
        "motion a hundred times longer, of which they are the pieces; each ends as the study does where it knows enough, and at the end "
        f"of its piece. The long motion is followed at a tolerance of {TIGHT:g} (driven pendulum {PLAIN:g}). Pairs: the largest sum of "
        "two that belong together, less the mean rate at which volumes change."
    )
    write("exponents", "Intervals of Lyapunov exponents", [text, table(head, rows)])


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
