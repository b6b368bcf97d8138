"""The spectrum of a motion: amplitudes or power over frequency, and the lines in it with their errors.

A record is multiplied by a window before its Fourier transform (Harris, Proceedings of the IEEE 66, 1978). Between the frequencies of the
transform a line is found where the windowed Fourier sum is greatest; the same of other parts of the record and with another window tells
how far it may be off.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...numerics.roots import minimum
from ...outcome import ENDED, Outcome, SimulationError
from ...problem import Array, Problem
from ...results.solution import Solution
from ...settings import Formula, settable
from ...weightings import WEIGHTINGS
from ..findings import Curve, Findings, Panel, Table, Value
from ..flow.record import Recorded, RecordStudy, observed, recorded, unfinished

WINDOWS = {"blackmanharris": 4.0, "hann": 2.0, "rectangular": 1.0}
"""Windows, and half the width of a line that each leaves, in steps of frequency."""
OTHER = {"blackmanharris": "hann", "hann": "blackmanharris", "rectangular": "hann"}
"""The window with which the lines are found once more."""
SAMPLES_A_STEP, FEWEST, MOST = 8, 4096, 2**17
"""Samples of the record: so many in a step of the method, within bounds."""
PARTS = ((0.0, 0.75), (0.25, 1.0))
MARGIN = 1.5
"""Times the differences from lines that are off by less than a third of them themselves."""
LINES = 8
FELT = 1e-3
"""Seconds between samples of what is weighted, which ends at some hundred Hz."""
FAINT = 1e-4
"""Of the largest amplitude: what is fainter may be the foot of a line."""
LIVELY = 1e-6
"""Of the largest amplitude, at the highest frequencies: what is more is folded back to lower ones."""
BESIDE = 1.5
"""The spectrum is drawn up to so many times the highest line."""
ERRORS = "lines in other parts of the record, with another window, and of a looser tolerance"


class Spectrum(RecordStudy, frozen=True, kw_only=True):
    """The spectrum of the quantity ``of`` over a run, without what is still ``settling``."""

    window: Annotated[
        str, settable(f"The window: {', '.join(WINDOWS)} (default: blackmanharris).", "text")
    ] = "blackmanharris"
    power: Annotated[bool, settable("Power per frequency instead of amplitudes.", "flag")] = False
    weighting: Annotated[
        str | None,
        settable(f"Weight the rms of an acceleration as people feel it: {', '.join(WEIGHTINGS)}.", "text"),
    ] = None
    count: Annotated[int, settable(f"Number of lines to list (default: {LINES}).", "count")] = LINES

    def solve(self, problem: Problem) -> Findings:
        """Run the model at two tolerances and transform the tighter motion. Raises SimulationError."""
        if self.window not in WINDOWS:
            raise SimulationError(f"the window is one of {', '.join(WINDOWS)}, not '{self.window}'")
        if self.weighting is not None and self.weighting not in WEIGHTINGS:
            raise SimulationError(f"the weighting is one of {', '.join(WEIGHTINGS)}, not '{self.weighting}'")
        seen = observed(problem, self)
        if self.weighting is not None:
            _check_acceleration(problem, seen, self.weighting)
        record = recorded(problem, self)
        if record.solution.outcome not in ENDED:
            return unfinished("spectrum", problem, record.solution, ERRORS)
        return _findings(problem, self, record)


class Record(Struct, frozen=True, eq=False):
    """Samples ``x`` [n] of a quantity, ``step`` apart."""

    x: Array
    step: float


class Line(Struct, frozen=True):
    """One line: its ``frequency``, and the ``amplitude`` of the oscillation that makes it."""

    frequency: float
    amplitude: float


def record_of(solution: Solution, name: str, begin: float, end: float, longest: float = math.inf) -> Record:
    """Return a quantity between two times, in a power of two of samples, no more than ``longest`` apart if that can be."""
    fewest = max(FEWEST, SAMPLES_A_STEP * solution.statistics.steps, math.ceil((end - begin) / longest))
    wanted = min(fewest, MOST)
    count = 1 << (wanted - 1).bit_length()
    t = np.linspace(begin, end, count, endpoint=False)
    return Record(np.asarray(solution(t)[name], dtype=float), (end - begin) / count)


def _check_acceleration(problem: Problem, seen: Formula, weighting: str) -> None:
    """Raise SimulationError for a quantity that is not an acceleration."""
    unit = next(q.unit for q in (*problem.states, *problem.outputs) if q.name == seen.name)
    if unit != "m/s^2":
        raise SimulationError(
            f"{weighting} weights an acceleration in m/s^2, and '{seen.text}' is {f'in {unit}' if unit else 'a pure number'}",
            help='name one: of = "der(der(x))"',
        )


def weighted_rms(solution: Solution, name: str, begin: float, weighting: str) -> Value:
    """Return the weighted rms of an acceleration from ``begin`` on; the filter is at rest where the motion begins."""
    first, end = float(solution.time[0]), float(solution.time[-1])
    whole = record_of(solution, name, first, end, FELT)
    found = []
    for every in (1, 2):
        x, step = whole.x[::every], every * whole.step
        y = WEIGHTINGS[weighting].weighted(x, step)
        kept = y[round((begin - first) / step) :]
        found.append(float(np.sqrt(np.mean(kept**2))))
    return Value(f"rms, {weighting}", "m/s^2", found[0], abs(found[0] - found[1]))


def _windowed(record: Record, window: str) -> tuple[Array, float]:
    """Return the record times its window, without its mean, and the sum of the window."""
    from scipy.signal import get_window

    w = get_window("boxcar" if window == "rectangular" else window, len(record.x))
    return (record.x - float(w @ record.x / w.sum())) * w, float(w.sum())


def amplitudes(record: Record, window: str) -> tuple[Array, Array]:
    """Return frequencies and the amplitudes of oscillations of these frequencies."""
    x, total = _windowed(record, window)
    frequencies: Array = np.asarray(np.fft.rfftfreq(len(x), record.step), dtype=float)
    return frequencies, 2 * np.abs(np.fft.rfft(x)) / total


def power(record: Record) -> tuple[Array, Array]:
    """Return frequencies and the power per frequency, by means over half-overlapping parts (Welch 1967)."""
    from scipy.signal import welch

    f, density = welch(record.x, 1 / record.step, nperseg=len(record.x) // 8, detrend="constant")
    return np.asarray(f), np.asarray(density)


def line_near(record: Record, window: str, frequency: float) -> Line:
    """Return the line within a step of frequency of a given one."""
    x, total = _windowed(record, window)
    t = record.step * np.arange(len(x))
    width = 1 / (record.step * len(x))

    def height(f: float) -> float:
        return -abs(complex(x @ np.exp(-2j * math.pi * f * t)))

    low = max(frequency - width, 0.25 * width)
    top, least = minimum(height, low, frequency + width, 1e-9 * width)
    return Line(top, -2 * least / total)


def lines_of(record: Record, window: str, count: int) -> list[Line]:
    """Return the strongest lines, by their frequencies."""
    f, a = amplitudes(record, window)
    half = math.ceil(WINDOWS[window])
    tops = [
        k
        for k in range(1, len(a) - 1)
        if a[k] > FAINT * a.max() and a[k] == a[max(k - half, 1) : k + half + 1].max()
    ]
    strongest = sorted(sorted(tops, key=lambda k: -a[k])[:count])
    return [line_near(record, window, float(f[k])) for k in strongest]


def _findings(problem: Problem, study: Spectrum, runs: Recorded) -> Findings:
    seen, solution, rough = runs.of, runs.solution, runs.rough
    begin, end = max(runs.begin, float(solution.time[0])), float(solution.time[-1])
    unit, time = solution.unit(seen.name), solution.unit("time")
    hertz = {"s": "Hz", "": ""}.get(time, f"1/{time}")
    record = record_of(solution, seen.name, begin, end)
    lines = lines_of(record, study.window, study.count)
    cut = [
        Record(record.x[round(a * len(record.x)) : round(b * len(record.x))], record.step) for a, b in PARTS
    ]
    others = [(one, study.window) for one in cut]
    others += [(record, OTHER[study.window])]
    others += [(record_of(rough, seen.name, begin, min(end, float(rough.time[-1]))), study.window)]
    width = 1 / (record.step * len(record.x))
    rows = []
    for line in lines:
        again = [line_near(one, window, line.frequency) for one, window in others]
        off = MARGIN * max(abs(other.frequency - line.frequency) for other in again)
        high = MARGIN * max(abs(other.amplitude - line.amplitude) for other in again)
        rows.append((line, off, high))
    f, a = amplitudes(record, study.window)
    apart = _with_unit(2 * WINDOWS[study.window] * width, hertz)
    remarks = [f"the record is {_with_unit(end - begin, time)} long: lines closer than {apart} are one"]
    if a[-len(a) // 20 :].max() > LIVELY * a.max(initial=1e-300):
        remarks.append(
            f"there is more above {_with_unit(float(f[-1]), hertz)}, which folds back to lower frequencies"
        )
    drawn = (f, a)
    if study.power:
        drawn = power(record)
    highest = max((line.frequency for line, _, _ in rows), default=f[-1] / BESIDE)
    shown = (drawn[0] > 0) & (drawn[0] <= BESIDE * highest + 8 * width)
    squared = f"({unit})^2" if "/" in unit or "." in unit else f"{unit}^2" if unit else "1"
    label, drawn_unit = ("amplitude", unit)
    if study.power:
        label, drawn_unit = "power", f"{squared}/{hertz}" if hertz else squared if unit else ""
    head = (("frequency", hertz), ("error", ""), ("amplitude", unit), ("error", ""))
    table = Table(
        f"lines of {seen.text}",
        head,
        tuple((line.frequency, off, line.amplitude, high) for line, off, high in rows),
    )
    mean, rms = float(record.x.mean()), float(np.sqrt((record.x**2).mean()))
    half = record.x[: len(record.x) // 2]
    details: dict[str, Any] = {
        "of": seen.text,
        "lines": [
            {"frequency": line.frequency, "error": off, "amplitude": line.amplitude, "amplitude_error": high}
            for line, off, high in rows
        ],
        "accuracy": {"errors": {}, "errors_from": ERRORS},
    }
    values = [
        Value("mean", unit, mean, abs(float(half.mean()) - mean)),
        Value("rms", unit, rms, abs(float(np.sqrt((half**2).mean())) - rms)),
    ]
    if study.weighting is not None:
        felt, other = (weighted_rms(one, seen.name, begin, study.weighting) for one in (solution, rough))
        values.append(replace(felt, error=(felt.error or 0.0) + abs(felt.value - other.value)))
    told = rough if rough.outcome is Outcome.DOUBTFUL else solution
    return Findings(
        study="spectrum",
        model=problem.name,
        outcome=told.outcome,
        message=f"{len(rows)} line{'s' * (len(rows) != 1)} of {seen.text}",
        values=tuple(values),
        errors_from=ERRORS
        + "; mean and rms: those of the first half"
        + ("; weighted: half the samples, and a looser tolerance" if study.weighting else ""),
        remarks=(*remarks, *solution.remarks),
        tables=(table,) if rows else (),
        panels=(
            Panel(
                "power per frequency" if study.power else "amplitudes", "frequency", hertz, label, drawn_unit,
                (Curve(seen.text, drawn[0][shown], drawn[1][shown]),), logarithmic="y",
            ),
        ),
        details=details,
        arrays={"frequency": drawn[0], label: drawn[1]},
        runs=(solution, rough),
    )  # fmt: skip


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".rstrip()
