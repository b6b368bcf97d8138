"""Pictures of linear systems: gain and phase over frequency (Bode), and the response to a unit step of each input."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ...interface import Quantity
from ...local.frequency_response import Answers, Transfer, answers, held, phases, refined
from ...local.linear_system import OutputForm
from ...local.zeros import Complex
from ...problem import Array
from ..findings import Curve, Panel

FREQUENCIES, TIMES = 400, 400
"""Points of a picture over frequency, before it is refined, and of a step response."""
BEYOND = 30.0
"""Frequencies are shown from the slowest pole to the fastest, and so many times beyond."""
APART = 1e-4
"""Points of a picture are further apart than this share of their frequencies: what has no damping has a peak without an end."""


def rates_of(values: Complex, period: float | None) -> Complex:
    """Return poles as those of a continuous system."""
    if period is None:
        return values
    return np.asarray(np.log(np.where(values == 0, 1e-300, values)) / period, dtype=complex)


def range_of(values: Complex, period: float | None) -> tuple[float, float]:
    """Return the lowest and the highest frequency that tell of poles; of a sampled system up to that of Nyquist."""
    sizes = speeds(rates_of(values, period))
    low, high = (float(sizes.min()) / BEYOND, float(sizes.max()) * BEYOND) if sizes.size else (0.01, 100.0)
    if period is not None:
        high = math.pi / period
        low = min(low, high / 100)
    return low, high


def speeds(rates: Complex) -> Array:
    """Return the sizes of poles without those at zero."""
    found: Array = np.abs(rates)
    return found[found > 1e-9 * max(float(found.max(initial=0.0)), 1e-300)]


def seen_over(systems: Sequence[tuple[Transfer, Complex]], ends: tuple[float, float] | None = None) -> Array:
    """Return frequencies at which the answers of systems, each with its poles, look as they are."""
    ranges = [range_of(values, one.period) for one, values in systems]
    low, high = ends or (min(a for a, _ in ranges), max(b for _, b in ranges))
    w = np.geomspace(low, high, FREQUENCIES) if low > 0 else np.linspace(low, high, FREQUENCIES)
    rates = np.concatenate([rates_of(values, one.period) for one, values in systems])
    own = np.abs(rates.imag[np.abs(rates.real) > 1e-9 * np.abs(rates)])
    return refined([one for one, _ in systems], np.concatenate([w, own[(own > low) & (own < high)]]))


class Shown(Struct, frozen=True, eq=False):
    """A system in a picture over frequencies ``w`` [rad per unit of time], and what its curves are called beside input and
    output."""

    name: str
    transfer: Transfer
    w: Array


def hertz_of(time: str) -> str:
    """Return the unit of cycles per time."""
    return {"s": "Hz", "": ""}.get(time, f"1/{time}")


def per(above: str, below: str) -> str:
    """Return the unit of a quotient; ``1`` is none."""
    if above == below or below in ("", "1"):
        return "" if above in (below, "1") else above
    turned = "".join(f"{'.' if sign == '/' else '/'}{symbol}" for sign, symbol in _FACTOR.findall(below))
    return f"{above or '1'}{turned}" if "(" not in below else f"{above or '1'}/({below})"


_FACTOR = re.compile(r"([./]?)([^./]+)")


def bode(
    shown: Sequence[Shown],
    inputs: Sequence[Quantity],
    outputs: Sequence[Quantity],
    time: Quantity,
    *,
    hertz: bool = False,
    decibel: bool = False,
    named: bool = True,
) -> tuple[Panel, ...]:
    """Return gains over frequency, a panel for each of their units, and the phases of all."""
    found = [(one, answers(one.transfer, one.w), _apart(one.w)) for one in shown]
    gains: dict[str, list[Curve]] = {}
    turns: list[Curve] = []
    for j, u in enumerate(inputs):
        for k, out in enumerate(outputs):
            for one, there, kept in found:
                gain = np.abs(there.values[:, k, j])
                if not gain.any():
                    continue
                name = ", ".join(part for part in (f"{u.name} to {out.name}", one.name) if part)
                x = one.w[kept] / (2 * math.pi if hertz else 1.0)
                unit = per(out.measure, u.measure)
                colour = len(turns)
                name = name if named else ""
                gains.setdefault(unit, []).append(Curve(name, x, _drawn(gain[kept], decibel), colour=colour))
                turns.append(Curve(name, x, np.degrees(_phase(there, k, j)[kept]), colour=colour))
    label = hertz_of(time.unit) if hertz else f"rad/{time.unit}" if time.unit else ""
    scale = "x" if decibel else "xy"
    panels = [
        Panel("gain" if not n else "", "frequency", label, "gain", _gain_unit(unit, decibel), tuple(curves), logarithmic=scale)
        for n, (unit, curves) in enumerate((gains or {"": []}).items())
    ]  # fmt: skip
    return (*panels, Panel("phase", "frequency", label, "phase", "deg", tuple(turns), logarithmic="x"))


def _apart(w: Array) -> NDArray[np.bool_]:
    """Tell which frequencies are not in a crowd round a pole or a zero."""
    gaps = np.concatenate([[np.inf], np.diff(w), [np.inf]])
    kept: NDArray[np.bool_] = np.maximum(gaps[1:], gaps[:-1]) > APART * w
    return kept


def _gain_unit(unit: str, decibel: bool) -> str:
    if not decibel:
        return unit
    return f"dB of 1 {unit}" if unit else "dB"


def in_decibels(gain: Array) -> Array:
    """Return 20 log10 of gains, which are in SI."""
    with np.errstate(divide="ignore"):
        found: Array = 20 * np.log10(gain)
    return found


def _drawn(gain: Array, decibel: bool) -> Array:
    shown = np.where(np.isfinite(gain) & (gain > 0), gain, np.nan)
    return in_decibels(shown) if decibel else shown


def _phase(there: Answers, k: int, j: int) -> Array:
    pair = Answers(there.values[:, k : k + 1, j : j + 1], there.errors[:, k : k + 1, j : j + 1])
    return phases(pair)[:, 0, 0]


def step_responses(
    inputs: tuple[Quantity, ...],
    outputs: tuple[Quantity, ...],
    form: OutputForm,
    period: float | None,
    values: Complex,
    time: Quantity,
) -> Panel:
    """Return the outputs after a unit step of each input, at rest before: by the exponential of the matrix, exactly. An output
    that follows a derivative of the input has no such response."""
    a, b, c, d = form.a, form.b, form.c, form.d
    n, m = b.shape
    sizes = speeds(rates_of(values, period))
    span = 20.0 / float(sizes.min()) if sizes.size else 10.0
    growing = float(values.real.max(initial=0.0)) if period is None else 0.0
    if growing > 0:
        span = min(span, 6.0 / growing)
    if period is None:
        step = span / TIMES
        x, (move, push) = np.zeros((n, m)), held(a, b, step)
        t: Array = step * np.arange(TIMES + 1, dtype=float)
    else:
        count = int(min(max(span / period, 20), 2000))
        x, move, push = np.zeros((n, m)), a, b
        t = period * np.arange(count + 1, dtype=float)
    found = []
    for _ in t:
        found.append(c @ x + d)
        x = move @ x + push
    y = np.array(found)
    curves = tuple(
        Curve(f"{u.name} to {out.name}", t, y[:, k, j])
        for j, u in enumerate(inputs)
        for k, out in enumerate(outputs)
        if y[:, k, j].any() and not (form.d1[k, j] or form.d2[k, j])
    )
    return Panel("response to a unit step", "time", time.unit, "output", "", curves)
