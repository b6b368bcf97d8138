"""Inputs that jump or have kinks, and runs of extreme length."""

from __future__ import annotations

from pathlib import Path
from tempfile import gettempdir
from typing import Any

import numpy as np

from .case import Array, Case, Known, Refusal, within

NUMBER = 21
TITLE = "Inputs, steps and lengths of runs"

PUSHED = """
input Force push(interpolation = "{how}") = 0 N;
coordinate Length x = 0 m;
kinetic 1/2*1 kg*der(x)^2;
force push on x;
experiment(stop = 10 s);
"""


def table(name: str, rows: tuple[tuple[float, float], ...]) -> str:
    """Write a table as a file and return its path."""
    path = Path(gettempdir()) / f"mechc-stability-{name}.csv"
    path.write_text("time,push\n" + "".join(f"{t!r},{v!r}\n" for t, v in rows), encoding="utf-8")
    return str(path)


def twice(t: Array, kinks: tuple[tuple[float, float], ...]) -> Array:
    """Return the double integral from 0 of straight pieces through the kinks, zero before the first."""
    x = np.zeros_like(t)
    times, values = zip(*kinks, strict=True)
    for i, (at, value) in enumerate(kinks):
        before = (values[i] - values[i - 1]) / (at - times[i - 1]) if i else 0.0
        last = i == len(kinks) - 1
        slope = 0.0 if last else (values[i + 1] - value) / (times[i + 1] - at)
        s = np.maximum(t - at, 0)
        x += (slope - before) * s**3 / 6 + (value * s**2 / 2 if i == 0 else 0)
    return x


KINKS = ((1.0, 0.0), (1.5, 1.0), (1.6, -1.0), (3.0, 0.5), (9.0, 0.0))
NARROW = ((0.0, 0.0), (5.0, 1e6), (5.000001, 0.0))


def pulse(t: Array) -> Any:
    s = np.maximum(t - 5, 0)
    inside = np.minimum(s, 5.000001 - 5)
    return 1e6 * inside**2 / 2 + 1e6 * inside * (s - inside)


JUMP = """
coordinate Length x = 0 m;
kinetic 1/2*1 kg*der(x)^2;
force (if time < 3 s then 0 N elseif time < 3.000001 s then 1e6 N else 0 N) on x;
experiment(stop = {stop} s);
"""


def jump(t: Array) -> Any:
    s = np.maximum(t - 3, 0)
    inside = np.minimum(s, 3.000001 - 3)
    return 1e6 * inside**2 / 2 + 1e6 * inside * (s - inside)


OSCILLATOR = """
coordinate Length x = 1 m;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*1 N/m*x^2;
experiment(stop = {stop} s);
"""


def swing(t: Array) -> Array:
    return np.cos(t)


CASES = (
    Case(
        "table with kinks",
        "five kinks, the pieces of very different length",
        PUSHED.format(how="linear"),
        Known("the path to 1e-12", {"x": lambda t: twice(t, KINKS)}, 1e-12, (within(100),)),
        fault="kinks ignored",
        options={"inputs": {"push": table("kinks", KINKS)}, "tolerance": 1e-6},
    ),
    Case(
        "narrow pulse",
        "1e6 N for 1e-6 s within 10 s, as a table of steps",
        PUSHED.format(how="step"),
        Known("the path to 1e-12", {"x": pulse}, 1e-12),
        fault="kinks ignored",
        options={"inputs": {"push": table("pulse", NARROW)}},
    ),
    Case(
        "narrow pulse in an equation",
        "the same written with time",
        JUMP.format(stop=10),
        Known("the path to 1e-9", {"x": jump}, 1e-9),
        fault="missed times",
    ),
    Case(
        "table whose times fall",
        "a time that goes back",
        PUSHED.format(how="linear"),
        Refusal("is refused", ("must not fall",)),
        fault="tables unchecked",
        options={"inputs": {"push": table("back", ((0.0, 0.0), (1.0, 1.0), (0.5, 2.0)))}},
    ),
    Case(
        "zero length",
        "start and stop in one point",
        OSCILLATOR.format(stop=0),
        Known("the initial state", {"x": 1.0, "der(x)": 0.0}, 1e-15),
        fault="moved start",
    ),
    Case(
        "1e-300 s",
        "a run below every scale of the motion",
        OSCILLATOR.format(stop=1e-300),
        Known("the initial state", {"x": 1.0}, 1e-15),
        fault="moved start",
    ),
    Case(
        "1e5 s",
        "16 000 periods, asked for at 3 points",
        OSCILLATOR.format(stop=1e5),
        Known("the place to 1e-5", {"x": swing}, 1e-5),
        fault="loose",
        options={"every": 5e4, "tolerance": 1e-12},
    ),
    Case(
        "loosest tolerance",
        "0.1",
        OSCILLATOR.format(stop=20),
        Known("owns up to its error", {"x": swing}, 1.0),
        fault="understated",
        options={"tolerance": 0.1},
    ),
    Case(
        "tightest tolerance",
        "1e-14",
        OSCILLATOR.format(stop=20),
        Known("the place to 1e-12", {"x": swing}, 1e-12),
        fault="loose",
        options={"tolerance": 1e-14},
    ),
    Case(
        "rest for ever",
        "nothing ever moves: 1e15 s",
        "coordinate Length x = 0 m;\nkinetic 1/2*1 kg*der(x)^2;\npotential 1/2*1 N/m*x^2;\nexperiment(stop = 1e15 s);",
        Known("stays at rest in a few steps", {"x": 0.0}, 1e-15, (within(1000),)),
        fault="pushed",
    ),
)
