"""How a linear system answers: gain and phase over frequency, and the response to a unit step of each input."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from ...local.linear_system import Form, LinearSystem
from ...local.zeros import Complex
from ...problem import Array, Quantity
from ..findings import Curve, Panel

FREQUENCIES, TIMES = 400, 400
"""Points of the Bode picture and of the step response."""


def sampled(a: Array, b: Array, period: float) -> tuple[Array, Array]:
    """Return A and B from one sample to the next, for inputs that are held in between."""
    n, m = b.shape
    whole = np.zeros((n + m, n + m))
    whole[:n, :n], whole[:n, n:] = a, b
    step = scipy.linalg.expm(whole * period)
    return step[:n, :n], step[:n, n:]


def pictures(
    inputs: tuple[Quantity, ...],
    outputs: tuple[Quantity, ...],
    system: LinearSystem,
    form: Form,
    period: float | None,
    time: Quantity,
) -> tuple[Panel, ...]:
    """Return gain and phase over frequency and the response to a step of each input, of every pair; where there is no
    input, the poles. ``form`` is that of the sampled system where there is a ``period``."""
    a, b, c, d = form.a, form.b, form.c, form.d
    values: Complex = np.asarray(np.linalg.eigvals(a) if a.size else [], dtype=complex)
    unit = f"rad/{time.unit}" if time.unit else ""
    if not inputs or not outputs:
        dots = Curve("poles", values.real.astype(float), values.imag.astype(float), style="points")
        per = f"1/{time.unit}" if time.unit else ""
        return (Panel("poles", "real part", per, "imaginary part", per, (dots,)),)
    rates = values if period is None else np.log(np.where(values == 0, 1e-300, values)) / period
    sizes = np.abs(rates)[np.abs(rates) > 1e-9 * max(float(np.abs(rates).max(initial=0.0)), 1e-300)]
    low, high = (float(sizes.min()) / 30, float(sizes.max()) * 30) if sizes.size else (0.01, 100.0)
    if period is not None:
        high = np.pi / period
        low = min(low, high / 100)
    w = np.geomspace(low, high, FREQUENCIES)
    s = np.asarray(1j * w if period is None else np.exp(1j * w * period), dtype=np.complex128)
    gains, phases = [], []
    identity = np.eye(len(a))
    if period is None:
        response = system.at(s)
    else:
        response = np.array([c @ np.linalg.solve(x * identity - a, b.astype(complex)) + d for x in s])
    for j, u in enumerate(inputs):
        for k, out in enumerate(outputs):
            name = f"{u.name} to {out.name}"
            gain = np.abs(response[:, k, j])
            if not gain.any():
                continue
            gains.append(Curve(name, w, gain))
            phases.append(Curve(name, w, _phase(response[:, k, j])))
    steps = _steps(inputs, outputs, form, period, sizes, values)
    return (
        Panel("gain", "frequency", unit, "gain", "", tuple(gains), logarithmic="xy"),
        Panel("phase", "frequency", unit, "phase", "deg", tuple(phases), logarithmic="x"),
        Panel("response to a unit step", "time", time.unit, "output", "", steps),
    )


def _steps(
    inputs: tuple[Quantity, ...],
    outputs: tuple[Quantity, ...],
    form: Form,
    period: float | None,
    sizes: Array,
    values: Complex,
) -> tuple[Curve, ...]:
    """Return the outputs after a unit step of each input, at rest before: by the exponential of the matrix, exactly. An output
    that follows a derivative of the input has no such response."""
    a, b, c, d = form.a, form.b, form.c, form.d
    n, m = b.shape
    span = 20.0 / float(sizes.min()) if sizes.size else 10.0
    growing = float(values.real.max(initial=0.0)) if period is None else 0.0
    if growing > 0:
        span = min(span, 6.0 / growing)
    if period is None:
        step = span / TIMES
        x, (move, push) = np.zeros((n, m)), sampled(a, b, step)
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
    return tuple(
        Curve(f"{u.name} to {out.name}", t, y[:, k, j])
        for j, u in enumerate(inputs)
        for k, out in enumerate(outputs)
        if y[:, k, j].any() and not (form.d1[k, j] or form.d2[k, j])
    )


def _phase(response: Complex) -> Array:
    """Return the phase in degrees without jumps; it begins above -270 and not above 90."""
    found: Array = np.degrees(np.unwrap(np.angle(response)))
    first: Array = found - 360.0 * np.ceil((found[0] - 90.0 - 1e-6) / 360.0)
    return first
