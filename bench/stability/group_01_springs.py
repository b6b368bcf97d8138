"""Springs of very different stiffness, and damping that is far above the critical one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np

from .case import Array, Case, Known, by, within

NUMBER = 1
TITLE = "Stiff springs and dampers"

TWO = """
parameter k = 1 N/m;
parameter K = 1e12 N/m;
parameter c = {c} N.s/m;
parameter m = 1 kg;
coordinate Length x = {x} m;
coordinate Length y = {y} m;
initial der(y) = {v} m/s;
kinetic 1/2*m*(der(x)^2 + der(y)^2);
potential 1/2*k*x^2 + 1/2*K*(y - x)^2;
dissipation 1/2*c*(der(y) - der(x))^2;
experiment(stop = {stop} s, tolerance = {tolerance});
"""

DECAY = """
parameter k = 1 N/m;
parameter c = 1e9 N.s/m;
coordinate Length x = 1 m;
initial der(x) = {v} m/s;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*k*x^2;
dissipation 1/2*c*der(x)^2;
experiment(stop = {stop} s);
"""


def linear(rates: Sequence[Sequence[float]], start: Sequence[float], t: float) -> list[float]:
    """Return exp(A t) start with 60 digits."""
    with mpmath.workdps(60):
        matrix = mpmath.expm(mpmath.matrix([[mpmath.mpf(x) for x in row] for row in rates]) * t)
        return [float(x) for x in matrix * mpmath.matrix([mpmath.mpf(x) for x in start])]


def two(c: float, x: float, y: float, v: float, t: float) -> dict[str, float]:
    rates = ((0, 0, 1, 0), (0, 0, 0, 1), (-1 - 1e12, 1e12, -c, c), (1e12, -1e12, c, -c))
    return dict(zip(("x", "y", "der(x)", "der(y)"), modal(rates, (x, y, 0, v), t), strict=True))


def modal(rates: Sequence[Sequence[float]], start: Sequence[float], t: float) -> list[float]:
    """Return exp(A t) start by eigenvectors with 60 digits: exp of a large matrix costs too much."""
    with mpmath.workdps(60):
        values, vectors = mpmath.eig(mpmath.matrix([[mpmath.mpf(x) for x in row] for row in rates]))
        parts = mpmath.lu_solve(vectors, mpmath.matrix([mpmath.mpf(x) for x in start]))
        weights = [mpmath.exp(value * t) * part for value, part in zip(values, parts, strict=True)]
        return [float(mpmath.re(x)) for x in vectors * mpmath.matrix(weights)]


def decay(t: float, v: float) -> dict[str, float]:
    x, speed = modal(((0, 1), (-1, -1e9)), (1, v), t)
    return {"x": x, "der(x)": speed}


RESTING = 1 + 5e-13
"""Where the second mass hangs so that the stiff spring carries its slow motion: else that spring swings."""


def _model(c: float, x: float, y: float, v: float, stop: float, tolerance: float = 1e-8) -> str:
    return TWO.format(c=c, x=x, y=repr(y), v=v, stop=stop, tolerance=tolerance)


def fast(t: Array) -> Any:
    return 1e-3 * np.sin(1e6 * np.sqrt(2) * t) / (1e6 * np.sqrt(2))


CASES = (
    Case(
        "fast mode at rest, undamped",
        "frequencies 1.4e6 and 0.7 rad/s; 10 s hold 2 million fast periods, of which none swings",
        _model(0, 1, RESTING, 0, 10, 1e-7),
        Known(
            "the slow motion to 1e-5, in few steps",
            two(0, 1, RESTING, 0, 10),
            1e-5,
            (by("radau5"), within(20_000)),
        ),
        fault="not switched",
    ),
    Case(
        "fast mode swinging, undamped",
        "frequency 1.4e6 rad/s, followed for 2 ms (450 periods)",
        _model(0, 0, 0, 1e-3, 0.002, 1e-10),
        Known("both masses to 1e-5 of the largest value", two(0, 0, 0, 1e-3, 0.002), 1e-5,
              sizes={"x": 1e-6, "y": 1e-6, "der(x)": 1e-3, "der(y)": 1e-3}),
        fault="loose",
    ),
    Case(
        "fast mode damped",
        "stiffness 1e12 beside 1, damping 1e6: the fast motion is gone after 1e-6 s",
        _model(1e6, 1, 1.001, 0, 10),
        Known("the slow motion to 1e-6, in few steps", two(1e6, 1, 1.001, 0, 10), 1e-6,
              (by("radau5"), within(2000))),
        fault="not switched",
    ),
    Case(
        "damper 1e9",
        "rates 1e9 and 1e-9 in one coordinate",
        DECAY.format(v=0, stop=1e9),
        Known("the creep back, to 1e-6", decay(1e9, 0), 1e-6, (by("radau5"), within(2000))),
        fault="sign",
    ),
    Case(
        "damper 1e9, thrown",
        "a start at 1000 m/s is braked within 1e-9 s",
        DECAY.format(v=1000, stop=1),
        Known("what is left of the throw, to 1e-6", decay(1, 1000), 1e-6, (by("radau5"), within(2000)),
              sizes={"der(x)": 1e-6}),
        fault="sign",
    ),
    Case(
        "fast mode at rest, undamped, explicit",
        "by dop853: 2 million periods are followed one by one",
        _model(0, 1, RESTING, 0, 1),
        Known("right to 1e-6", two(0, 1, RESTING, 0, 1), 1e-6, (by("dop853"),)),
        fault="loose",
        options={"method": "dop853"},
        seconds=300,
        full=True,
    ),
)  # fmt: skip
