"""The answer to sines: gain and phase between inputs and outputs over frequency, at one operating point or over a parameter.

H(i w) = C (i w - A)^-1 B(i w) + D(i w) of the linear system near a state, in which an input that drives a coordinate acts by its rate and
its acceleration as well; of a sampled system at exp(i w T). What is delayed by T answers by exp(-i w T), exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace
from numpy.typing import NDArray

from ...interface import Quantity
from ...local.frequency_response import NEAR, Answers, Continuous, Sampled, Transfer, answers, phases
from ...local.linear_delays import HIGHEST, LinearDelays
from ...local.linear_system import proper_form
from ...local.operating_point import PART
from ...local.zeros import EPSILON, Complex, poles
from ...numerics.roots import minimum
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...results.files import json_number
from ...settings import EQUILIBRIUM, Frequencies, Place, Range, settable
from ..findings import Cell, Findings, Table
from ..flow.linear_pictures import Shown, bode, hertz_of, in_decibels, per, rates_of, seen_over
from ..flow.sampled_loop import sampled_loop, samples_itself
from ..study import OF_A_MOTION, Study
from .linearize import OperatingLinearization, held_form, point_of

VALUES = 5
MOST_CURVES, MOST_ROWS = 12, 24
"""Curves with names in a picture; frequencies that are listed."""
ERRORS = "rounding of the entries, which are exact derivatives, through the equations at each frequency"


class FrequencyResponse(Findings, frozen=True, eq=False, kw_only=True):
    """``frequency`` [w] in rad per unit of time, ``response`` [w][outputs][inputs] complex, its ``gain``, ``phase`` in rad without jumps
    (not-a-number where the response is rounding) and bounds of its ``error``; over a parameter all with its values in front.

    ``period``: of a sampled system, else None. ``stable``: whether what begins beside the steady oscillation dies out, None where it
    neither grows nor dies out; one for each value of a parameter.
    """

    frequency: Array
    response: Complex
    gain: Array
    phase: Array
    error: Array
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    stable: tuple[bool | None, ...]
    period: float | None = None

    def control(self) -> Any:
        """Return the response as python-control knows it (``FrequencyResponseData``), over a parameter a list of them. Raises
        SimulationError where that is not installed."""
        try:
            import control  # type: ignore[import-not-found, import-untyped, unused-ignore]
        except ImportError:
            raise SimulationError("python-control is not installed", help="pip install control") from None
        names: dict[str, Any] = {
            "inputs": [q.name for q in self.inputs],
            "outputs": [q.name for q in self.outputs],
            "name": self.model,
        }
        if self.period is not None:
            names["dt"] = self.period
        every = self.response if self.response.ndim == 4 else self.response[None]
        found = [control.FRD(np.moveaxis(one, 0, -1), self.frequency, **names) for one in every]
        return found if self.response.ndim == 4 else found[0]


class Response(Study, frozen=True, kw_only=True):
    """The frequency response at a state, between inputs and outputs: all inputs, and the outputs of the model (coordinates where it has
    none) unless they are named."""

    unused = OF_A_MOTION
    of_past = True
    needs: ClassVar[frozenset[str]] = frozenset({PART, "projection"})

    at: Annotated[
        Place, settable("Where: the start, the equilibrium reached from it, or other values.", "place")
    ] = field(default_factory=Place)
    driven: Annotated[tuple[str, ...], settable("Inputs that act on it.", "names", option="inputs")] = ()
    outputs: Annotated[tuple[str, ...], settable("Quantities that are observed.", "names")] = ()
    frequencies: Annotated[
        Frequencies | None,
        settable(
            'Frequencies: "1 Hz .. 100 Hz", with a number of them "0.1 .. 10 rad/s, 50", or a list "{1, 2, 5} Hz" '
            "(default: those of the poles).",
            "frequencies",
        ),
    ] = None
    over: Annotated[
        tuple[Range, ...],
        settable(
            f'A response for each value of a parameter, an initial value or an input: "c = 0 .. 1, 4"; {VALUES} without a count.',
            "ranges",
        ),
    ] = ()
    sample: Annotated[
        float | None,
        settable("Period of a sampled system whose inputs are constant between samples.", "time"),
    ] = None
    hertz: Annotated[bool, settable("Frequencies in cycles, in text and picture.", "flag")] = False
    decibel: Annotated[bool, settable("Gains in decibels of the SI unit, in text and picture.", "flag")] = (
        False
    )

    def solve(self, problem: Problem) -> FrequencyResponse:
        """Linearise at each operating point. Raises SimulationError where that is not possible, and where there is no input."""
        asked = self.frequencies
        if self.hertz and asked is not None and asked.bare:
            raise SimulationError(
                "'hertz' leaves open what the bare numbers of 'frequencies' are",
                help='write "1 Hz .. 100 Hz" or "1 rad/s .. 100 rad/s"',
            )
        if len(self.over) > 1:
            raise SimulationError(
                "a response is shown over one parameter, not over several", help='over = "c = 0 .. 1"'
            )
        values: list[float | None] = [None]
        if self.over:
            over = self.over[0]
            values = [*np.linspace(over.low, over.high, over.count or VALUES).tolist()]
        systems = []
        for k, value in enumerate(values):
            systems.append(self._system(problem, value))
            if self.progress is not None:
                self.progress((k + 1) / len(values))
        return _findings(problem, self, systems)

    def _system(self, problem: Problem, value: float | None) -> System:
        options = self if value is None else replace(self, values={**self.values, self.over[0].name: value})
        at = self.at
        if value is not None and self.over[0].name in at.values:
            raise SimulationError(f"'{self.over[0].name}' has one value in 'at' and several in 'over'")
        sampling = samples_itself(problem)
        looks_back = problem.hybrid is not None and bool(problem.hybrid.delays)
        if looks_back and (sampling or self.sample is not None):
            raise SimulationError(
                f"'{problem.name}' looks back, and no response of a sampled system with delays is known here",
                help="leave 'sample' out, or let a discrete variable store the value of earlier samples"
                if self.sample is not None
                else "keep what was at the samples before in discrete variables, instead of 'delay'",
            )
        if sampling and self.sample is not None:
            raise SimulationError(
                f"the model samples by itself ({sampling}), but 'sample' names another period",
                help="leave 'sample' out",
            )
        if sampling and at.word == EQUILIBRIUM:
            raise SimulationError(
                f"the equilibrium of a motion that is sampled ({sampling}) is not looked for",
                help='say where it rests: at = "x = 0, ..."',
            )
        point = point_of(problem, options, at, self.driven, self.outputs)
        if not point.inputs:
            raise SimulationError(
                f"'{problem.name}' has no inputs{' that may change' if problem.inputs else ''}: nothing drives it at a frequency",
                help="declare one and let it act: input Force u = 0 N; force u on x;",
            )
        if sampling:
            loop = sampled_loop(point.site, point.y, point.system, point.inputs, point.outputs)
            return _of(point, loop, loop.matrix, value, loop.remarks)
        if point.past is not None:
            return _of_past(point, point.past, value)
        form = proper_form(point.system)
        if self.sample is None:
            return _of(point, Continuous(point.system), form.a, value)
        form = held_form(form, tuple(q for q, _ in point.outputs), self.sample)
        return _of(point, Sampled(form, self.sample, max(1.0, point.system.condition)), form.a, value)


class System(Struct, frozen=True, eq=False):
    """The system at one operating point: its ``poles``, and whether it is ``stable``; the ``value`` of the parameter. ``undamped``: the
    frequencies of poles on the imaginary axis, or on the unit circle."""

    point: OperatingLinearization
    transfer: Transfer
    poles: Complex
    undamped: Array
    stable: bool | None
    value: float | None
    remarks: tuple[str, ...]
    known: bool = True
    """Whether poles tell of stability."""


def _of(
    point: OperatingLinearization,
    transfer: Transfer,
    a: Array,
    value: float | None,
    more: tuple[str, ...] = (),
) -> System:
    chart, system = point.site.chart, point.system
    units = [*(chart.units[int(j)] for j in system.chosen), *(q.unit for q in system.behind)]
    values, errors = poles(a, units if len(units) == len(a) else ())
    size = float(np.abs(values).max(initial=0.0))
    limits = np.array(
        [1e-7 * size if e is None else 4 * transfer.condition * e + 64 * EPSILON * size for e in errors]
    )
    growth = values.real if transfer.period is None else np.abs(values) - 1
    stable: bool | None = None
    if (growth > limits).any():
        stable = False
    elif (growth < -limits).all():
        stable = True
    undamped = np.abs(rates_of(values, transfer.period).imag[np.abs(growth) <= limits])
    return System(point, transfer, values, undamped, stable, value, (*point.remarks, *more))


def _of_past(point: OperatingLinearization, past: LinearDelays, value: float | None) -> System:
    """Return the system with delays: of its poles, which are infinitely many, those that an approximation has that is right up to the
    fastest pole that may be unstable."""
    order = past.order()
    found = _of(point, past, past.approximated(order or HIGHEST).a, value)
    kept = found.poles[past.trusted(found.poles, order or HIGHEST)]
    if order is not None:
        return replace(found, poles=kept)
    unknown = "delays are long beside the fastest motions, so that it is not known here whether it is stable"
    none = np.zeros(0)
    return replace(
        found, poles=kept, undamped=none, stable=None, known=False, remarks=(*found.remarks, unknown)
    )


class Grid(Struct, frozen=True, eq=False):
    """All frequencies that were looked at, which of them are told, and whether these were listed one by one."""

    w: Array
    told: NDArray[np.intp]
    listed: bool


def _grid(asked: Frequencies | None, systems: Sequence[System]) -> Grid:
    pairs = [(one.transfer, one.poles) for one in systems]
    if asked is None:
        w = seen_over(pairs)
        return Grid(w, np.arange(len(w)), False)
    if not asked.values and asked.count is None:
        w = seen_over(pairs, (asked.low, asked.high))
        return Grid(w, np.arange(len(w)), False)
    wanted = np.array(asked.values)
    if asked.count is not None:
        spread = np.geomspace if asked.low > 0 else np.linspace
        wanted = spread(asked.low, asked.high, asked.count)
    ends = (float(wanted[0]), float(wanted[-1]))
    between = seen_over(pairs, ends) if ends[0] < ends[1] else wanted
    w = np.unique(np.concatenate([between, wanted]))
    return Grid(w, np.searchsorted(w, wanted), True)


class Seen(Struct, frozen=True, eq=False):
    """How a response is told: between what, over which parameter, in which units."""

    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    over: Range | None
    time: Quantity
    hertz: bool
    decibel: bool

    @property
    def pairs(self) -> list[tuple[int, int]]:
        return [(k, j) for j in range(len(self.inputs)) for k in range(len(self.outputs))]

    def name(self, k: int, j: int) -> str:
        return f"{self.inputs[j].name} to {self.outputs[k].name}"

    @property
    def frequency_unit(self) -> str:
        if self.hertz:
            return hertz_of(self.time.unit)
        return f"rad/{self.time.unit}" if self.time.unit else ""

    def frequency(self, w: float) -> float:
        return w / (2 * math.pi) if self.hertz else w

    def frequency_text(self, w: float) -> str:
        return f"{self.frequency(w):.6g} {self.frequency_unit}".rstrip()

    def unit(self, k: int, j: int) -> str:
        return per(self.outputs[k].measure, self.inputs[j].measure)

    def gain(self, gain: float, error: float) -> tuple[float, float | None]:
        """Return a gain and its error as they are shown."""
        if not math.isfinite(gain) or not gain:
            return (-math.inf if self.decibel and not gain else gain), None if gain else error
        return (
            (float(in_decibels(np.array(gain))), 20 / math.log(10) * error / gain)
            if self.decibel
            else (gain, error)
        )

    def value(self, one: System) -> str:
        """Say the value of the parameter, or nothing."""
        return "" if self.over is None else f"{self.over.name} = {one.value:.6g} {self.over.unit}".rstrip()


def _findings(problem: Problem, study: Response, systems: Sequence[System]) -> FrequencyResponse:
    first, asked = systems[0].point, study.frequencies
    seen = Seen(
        tuple(problem.inputs[k] for k in first.inputs),
        tuple(q for q, _ in first.outputs),
        study.over[0] if study.over else None,
        problem.time,
        study.hertz or (asked is not None and asked.hertz),
        study.decibel,
    )
    grid = _grid(asked, systems)
    found = [answers(one.transfer, grid.w) for one in systems]
    turns = [phases(one) for one in found]
    told = [Answers(one.values[grid.told], one.errors[grid.told]) for one in found]
    told_turns = [turn[grid.told] for turn in turns]
    w, period = grid.w[grid.told], systems[0].transfer.period
    arrays = {
        "response": np.array([one.values for one in told]),
        "gain": np.abs([one.values for one in told]),
        "phase": np.array(told_turns),
        "error": np.array([one.errors for one in told]),
    }
    if seen.over is None:
        arrays = {"frequency": w, **{name: a[0] for name, a in arrays.items()}}
    else:
        arrays = {seen.over.name: np.array([one.value for one in systems]), "frequency": w, **arrays}
    tables = [_peaks(seen, systems, grid, found, turns)]
    if grid.listed and len(w) <= MOST_ROWS:
        tables += _rows(seen, systems, w, told, told_turns)
    shown = [Shown(seen.value(one), one.transfer, grid.w) for one in systems]
    ends = " .. ".join(f"{seen.frequency(x):.4g}" for x in dict.fromkeys((float(w[0]), float(w[-1]))))
    return FrequencyResponse(
        study="response",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=f"inputs {len(seen.inputs)}, outputs {len(seen.outputs)}, {ends} {seen.frequency_unit}".rstrip()
        + ("" if seen.over is None else f", {len(systems)} values of {seen.over.name}")
        + ("" if period is None else f", sampled every {period:g} {problem.time.unit}".rstrip()),
        errors_from=ERRORS,
        remarks=tuple(_remarks(seen, systems, grid, found)),
        tables=tuple(tables),
        panels=bode(
            shown,
            seen.inputs,
            seen.outputs,
            problem.time,
            hertz=seen.hertz,
            decibel=seen.decibel,
            named=len(seen.pairs) * len(shown) <= MOST_CURVES,
        ),
        details=_details(seen, systems, w, told, told_turns, found),
        arrays=arrays,
        frequency=w,
        response=arrays["response"],
        gain=arrays["gain"],
        phase=arrays["phase"],
        error=arrays["error"],
        inputs=seen.inputs,
        outputs=seen.outputs,
        stable=tuple(one.stable for one in systems),
        period=period,
    )


class Peak(Struct, frozen=True):
    """The greatest gain between an input and an output, where it is, its error and the phase there."""

    gain: float
    error: float
    w: float
    phase: float


def _peak(one: System, w: Array, found: Answers, turn: Array, k: int, j: int) -> Peak:
    """Return the greatest gain, between the frequencies too; it is infinite on a pole of the imaginary axis."""
    gains = np.abs(found.values[:, k, j])
    top = int(np.argmax(gains))
    best = Peak(float(gains[top]), float(found.errors[top, k, j]), float(w[top]), float(turn[top, k, j]))
    if not 0 < top < len(w) - 1 or not math.isfinite(best.gain) or not best.gain:
        return best
    low, high = float(w[top - 1]), float(w[top + 1])
    sharp = high - low < 4 * NEAR * high or best.error > best.gain
    if sharp and ((one.undamped > low) & (one.undamped < high)).any():
        return Peak(math.inf, math.inf, best.w, math.nan)

    def lower(x: float) -> float:
        return -abs(complex(answers(one.transfer, np.array([x])).values[0, k, j]))

    place = minimum(lower, low, high, 1e-10 * high)[0]
    there = answers(one.transfer, np.array([place]))
    gain = abs(complex(there.values[0, k, j]))
    if gain <= best.gain:
        return best
    turned = float(np.angle(there.values[0, k, j] / found.values[top, k, j]))
    return Peak(gain, float(there.errors[0, k, j]), place, best.phase + turned)


def _peaks(
    seen: Seen, systems: Sequence[System], grid: Grid, found: Sequence[Answers], turns: Sequence[Array]
) -> Table:
    decibels = " in dB of" if seen.decibel else ""
    head = [("input", ""), ("output", "")]
    head += [] if seen.over is None else [(seen.over.name, seen.over.unit)]
    head += [("largest gain", ""), ("error", ""), (f"unit{decibels and ','}{decibels}", "")]
    head += [("at", seen.frequency_unit), ("phase", "deg")]
    rows: list[tuple[Cell, ...]] = []
    for k, j in seen.pairs:
        for one, there, turn in zip(systems, found, turns, strict=True):
            peak = _peak(one, grid.w, there, turn, k, j)
            gain, error = seen.gain(peak.gain, peak.error)
            phase = None if math.isnan(peak.phase) else math.degrees(peak.phase)
            value = () if one.value is None else (one.value,)
            names = (seen.inputs[j].name, seen.outputs[k].name)
            rows.append((*names, *value, gain, error, seen.unit(k, j) or "1", seen.frequency(peak.w), phase))
    return Table("", tuple(head), tuple(rows))


def _rows(
    seen: Seen, systems: Sequence[System], w: Array, told: Sequence[Answers], turns: Sequence[Array]
) -> list[Table]:
    """Return gain and phase at each frequency, a table for each pair and value."""
    tables = []
    for k, j in seen.pairs:
        for one, there, turn in zip(systems, told, turns, strict=True):
            unit = seen.unit(k, j)
            shown = (f"dB of 1 {unit}" if unit else "dB") if seen.decibel else unit
            head = (("frequency", seen.frequency_unit), ("gain", shown), ("error", ""), ("phase", "deg"))
            rows: list[tuple[Cell, ...]] = []
            for i, x in enumerate(w):
                gain, error = seen.gain(abs(complex(there.values[i, k, j])), float(there.errors[i, k, j]))
                phase = float(turn[i, k, j])
                rows.append(
                    (
                        seen.frequency(float(x)),
                        gain,
                        error,
                        None if math.isnan(phase) else math.degrees(phase),
                    )
                )
            value = seen.value(one)
            tables.append(Table(seen.name(k, j) + (f", {value}" if value else ""), head, tuple(rows)))
    return tables


def _worst(found: Sequence[Answers]) -> float:
    """Return the largest error of an answer relative to the largest gain of its pair."""
    worst = 0.0
    for one in found:
        finite = np.isfinite(one.values) & np.isfinite(one.errors)
        largest = np.where(finite, np.abs(one.values), 0.0).max(axis=0)
        errors = np.where(finite, one.errors, 0.0).max(axis=0)
        worst = max(
            worst,
            float(np.divide(errors, largest, out=np.zeros_like(errors), where=largest > 0).max(initial=0.0)),
        )
    return worst


def _remarks(seen: Seen, systems: Sequence[System], grid: Grid, found: Sequence[Answers]) -> list[str]:
    said: dict[str, list[System]] = {}
    for one, there in zip(systems, found, strict=True):
        for remark in (*one.remarks, *_stability(seen, one), *_limits(seen, one, grid, there)):
            said.setdefault(remark, []).append(one)
    return [
        remark if len(of) == len(systems) else f"at {', '.join(seen.value(one) for one in of)}: {remark}"
        for remark, of in said.items()
    ]


def _stability(seen: Seen, one: System) -> list[str]:
    if one.stable is False:
        fastest = one.poles[np.argmax(one.poles.real if one.transfer.period is None else np.abs(one.poles))]
        where = f"{fastest.real:.5g}" + (f" +- {abs(fastest.imag):.5g}i" if fastest.imag else "")
        return [
            f"unstable, with a pole at {where}: the response is that of the equations, but no motion settles to it"
        ]
    if one.stable is None and one.known and len(one.poles):
        return [
            "poles on the limit of stability: what they begin with neither grows nor dies out, so that a motion need not settle to the "
            "response"
        ]
    return []


def _limits(seen: Seen, one: System, grid: Grid, found: Answers) -> list[str]:
    """Say where answers vanish, have no bound, or are those of other frequencies."""
    said = []
    for k, j in seen.pairs:
        if not np.abs(found.values[:, k, j]).any():
            said.append(f"'{seen.inputs[j].name}' does not reach '{seen.outputs[k].name}'")
    infinite = grid.w[~np.isfinite(found.values).all(axis=(1, 2))]
    if infinite.size:
        listed = ", ".join(seen.frequency_text(float(x)) for x in infinite[:4]) + ", ..." * (
            infinite.size > 4
        )
        said.append(f"on a pole, so that the response has no bound: {listed}")
    if one.transfer.period is not None and grid.w[-1] > (1 + 1e-12) * math.pi / one.transfer.period:
        whole = 2 * math.pi / one.transfer.period
        said.append(
            f"aliasing: beyond {seen.frequency_text(whole / 2)}, half the sampling rate, a sine has the samples of one whose "
            f"frequency is less by {seen.frequency_text(whole)}"
        )
    return said


def _details(
    seen: Seen,
    systems: Sequence[System],
    w: Array,
    told: Sequence[Answers],
    turns: Sequence[Array],
    found: Sequence[Answers],
) -> dict[str, Any]:
    records = []
    for one, there, turn in zip(systems, told, turns, strict=True):
        pairs = [
            {
                "input": seen.inputs[j].name,
                "output": seen.outputs[k].name,
                "unit": seen.unit(k, j),
                "real": [json_number(float(x)) for x in there.values[:, k, j].real],
                "imag": [json_number(float(x)) for x in there.values[:, k, j].imag],
                "gain": [json_number(float(x)) for x in np.abs(there.values[:, k, j])],
                "phase": [json_number(float(x)) for x in turn[:, k, j]],
                "errors": [json_number(float(x)) for x in there.errors[:, k, j]],
            }
            for k, j in seen.pairs
        ]
        parameter = {} if seen.over is None else {seen.over.name: one.value}
        listed = [[float(z.real), float(z.imag)] for z in one.poles]
        records.append({"parameter": parameter, "stable": one.stable, "poles": listed, "responses": pairs})
    return {
        "frequency": w.tolist(),
        "inputs": [q.name for q in seen.inputs],
        "outputs": [q.name for q in seen.outputs],
        "systems": records,
        "period": systems[0].transfer.period,
        "accuracy": {
            "errors": {"response": _worst(found)},
            "errors_from": f"{ERRORS}, relative to the largest gain of each pair",
        },
    }
