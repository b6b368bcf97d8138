"""Do the intervals of fits hold as often as they say, and what do exact derivatives of motions save?

Noisy data of six models, one chaotic, one with impacts, one with a closed loop, are fitted again and again: a 95 % interval
ought to hold in 179 to 198 of 200 repetitions, and to be as wide as the scatter of the estimates. Then the same
least squares with two-point differences, of the compiled runs and of what one writes by hand for `solve_ivp`: time and
evaluations for 2, 4 and 8 unknowns.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from msgspec import Struct
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

import mechc
from mechc.runtime.problem import Array

from .machine import table, write

REPETITIONS, QUICK = 200, 20
NORMAL = 1.959964
"""Half of a 95 % interval over the standard deviation of normal estimates."""


class Trial(Struct, frozen=True):
    """A model, the true values of what is fitted, from where the search begins, the output and its noise, the last time."""

    name: str
    text: str
    true: Mapping[str, float]
    first: Mapping[str, float]
    output: str
    noise: float
    stop: float


TRIALS = (
    Trial(
        "pendulum",
        "parameter l = 1 m; parameter c = 0.1 N.m.s; coordinate Angle q = 0.6 rad;"
        "kinetic 1/2*1 kg*l^2*der(q)^2; potential -9.81 N*l*cos(q); dissipation 1/2*c*der(q)^2;",
        {"l": 1.1, "c": 0.08, "q": 0.6},
        {"l": 1.0, "c": 0.05, "q": 0.5},
        "q",
        0.01,
        8.0,
    ),
    Trial(
        "oscillator with a drive",
        "parameter k = 30 N/m; parameter c = 1 N.s/m; parameter F = 3 N; coordinate x = 0 m;"
        "kinetic 1/2*1 kg*der(x)^2; potential 1/2*k*x^2; damping c on x; force F*sin(4 rad/s*time) on x;",
        {"k": 33.0, "c": 0.8, "F": 2.5},
        {"k": 30.0, "c": 1.0, "F": 3.0},
        "x",
        0.01,
        8.0,
    ),
    Trial(
        "Duffing oscillator",
        "parameter a = 1 N/m; parameter b = 1 N/m^3; coordinate x = 1 m;"
        "kinetic 1/2*1 kg*der(x)^2; potential -1/2*a*x^2 + 1/4*b*x^4; damping 0.1 N.s/m on x;",
        {"a": 1.1, "b": 0.9, "x": 1.6},
        {"a": 1.0, "b": 1.0, "x": 1.5},
        "x",
        0.02,
        12.0,
    ),
    Trial(
        "double pendulum (chaotic)",
        "parameter l = 1 m; parameter g = 9.81 m/s^2; coordinate Angle a = 2 rad; coordinate Angle b = -0.4 rad;"
        "kinetic 1 kg*l^2*(der(a)^2 + 1/2*der(b)^2 + der(a)*der(b)*cos(a - b));"
        "potential -1 kg*g*l*(2*cos(a) + cos(b));",
        {"l": 1.03, "a": 2.05, "b": -0.35},
        {"l": 1.0, "a": 2.0, "b": -0.4},
        "a",
        0.02,
        6.0,
    ),
    Trial(
        "bouncing ball (impacts)",
        "parameter e(min = 0, max = 1) = 0.7; parameter g = 9.81 m/s^2; coordinate y = 1 m;"
        "kinetic 1/2*1 kg*der(y)^2; potential 1 kg*g*y; contact floor: y restitution e;",
        {"e": 0.8, "g": 9.7, "y": 1.1},
        {"e": 0.75, "g": 9.8, "y": 1.05},
        "y",
        0.01,
        1.6,
    ),
    Trial(
        "four-bar linkage (closed loop)",
        "import mech.planar.*; gravity {0, -9.81} m/s^2; parameter l = 0.3 m; parameter m(min = 10 g) = 1 kg;"
        "Bar crank(m = 0.5 kg, l = l); Bar coupler(m = m, l = 0.7 m); Bar rocker(m = 0.6 kg, l = 0.5 m);"
        "Revolute one(world -> crank.a, angle = 2 rad); Revolute two(crank.b -> coupler.a, angle ~ -60 deg);"
        "Revolute three(coupler.b -> rocker.b, angle ~ 60 deg);"
        "frame ground = world * trans({0.8 m, 0 m}); Revolute four(ground -> rocker.a, angle ~ 100 deg);",
        {"l": 0.31, "m": 1.2, "one.angle": 2.05},
        {"l": 0.3, "m": 1.0, "one.angle": 2.0},
        "one.angle",
        0.005,
        1.0,
    ),
)


def data_of(trial: Trial, model: mechc.Model, count: int = 101) -> dict[str, Array]:
    """Return what would be measured without noise."""
    run = model.simulate(set=dict(trial.true), stop=trial.stop, tolerance=1e-11, estimate_error=False)
    times = np.linspace(0.0, trial.stop, count)
    return {"time": times, trial.output: run(times)[trial.output]}


def coverage(trial: Trial, repetitions: int) -> list[list[str]]:
    """Fit noisy data again and again; give a row for each unknown."""
    model = mechc.loads(trial.text).with_values(dict(trial.first))
    exact = data_of(trial, model)
    names = list(trial.true)
    truth = np.array([trial.true[name] for name in names])
    held, values, halves, evaluations = np.zeros(len(names)), [], [], []
    begun = time.process_time()
    for seed in range(repetitions):
        noise = trial.noise * np.random.default_rng(seed).normal(size=exact["time"].size)
        found = model.fit({**exact, trial.output: exact[trial.output] + noise}, names)
        x = np.array([found[name] for name in names])
        half = np.array([value.error if value.error is not None else np.inf for value in found.values])
        held += np.abs(x - truth) <= half
        values.append(x)
        halves.append(half)
        evaluations.append(found.details["evaluations"])
    taken = (time.process_time() - begun) / repetitions
    width = np.median(halves, axis=0) / (NORMAL * np.std(values, axis=0, ddof=1))
    return [
        [
            trial.name if k == 0 else "",
            name,
            f"{held[k]:.0f} of {repetitions}",
            f"{width[k]:.2f}",
            f"{np.mean(evaluations):.1f}" if k == 0 else "",
            f"{1e3 * taken:.0f} ms" if k == 0 else "",
        ]
        for k, name in enumerate(names)
    ]


CHAIN = 4
"""Masses of the chain whose masses and springs are found: up to eight unknowns."""


def chain() -> str:
    lines = [f"parameter m{i} = {1 + 0.1 * i} kg; parameter k{i} = {20 + 3 * i} N/m; coordinate x{i} = {0.3 / i} m;" for i in range(1, CHAIN + 1)]  # fmt: skip
    lines += [f"kinetic 1/2*m{i}*der(x{i})^2; damping 0.1 N.s/m on x{i};" for i in range(1, CHAIN + 1)]
    lines += [f"potential 1/2*k{i}*(x{i}{f' - x{i - 1}' if i > 1 else ''})^2;" for i in range(1, CHAIN + 1)]
    return "\n".join(lines)


def rates_by_hand(values: Mapping[str, float]) -> Callable[[float, Array], Array]:
    """Return the chain as one writes it for ``solve_ivp``, with arrays."""
    m = np.array([values[f"m{i}"] for i in range(1, CHAIN + 1)])
    k = np.array([values[f"k{i}"] for i in range(1, CHAIN + 1)])

    def rates(t: float, y: Array) -> Array:
        x, v = y[:CHAIN], y[CHAIN:]
        pull = k * np.diff(x, prepend=0.0)
        return np.concatenate([v, (np.append(pull[1:], 0.0) - pull - 0.1 * v) / m])

    return rates


def against_differences(count: int, repetitions: int) -> list[str]:
    """Fit ``count`` unknowns with exact derivatives and with two-point differences of the same runs, in turn."""
    names = [f"k{i}" for i in range(1, CHAIN + 1)] + [f"m{i}" for i in range(1, CHAIN + 1)]
    names = names[:count]
    model = mechc.loads(chain())
    parameters = model.simulate(stop=0.1, estimate_error=False).motion.parameters
    first = np.array([parameters[name] for name in names])
    truth = first * (1 + 0.1 * np.cos(np.arange(count)))
    outputs = [f"x{i}" for i in range(1, CHAIN + 1)]
    times = np.linspace(0, 10, 201)
    run = model.simulate(
        set=dict(zip(names, truth, strict=True)), stop=10, tolerance=1e-12, estimate_error=False
    )
    exact = np.column_stack([run(times)[name] for name in outputs])
    taken = {"exact": 0.0, "differences": 0.0}
    evaluations, errors = {"exact": 0, "differences": 0}, {"exact": 0.0, "differences": 0.0}
    by_hand = dict(zip(parameters, map(float, parameters.values()), strict=True))

    def residuals(x: Array) -> Array:
        evaluations["differences"] += 1
        values = dict(zip(names, x, strict=True))
        found = model.simulate(set=values, stop=10, estimate_error=False)(times)
        difference: Array = (np.column_stack([found[name] for name in outputs]) - exact).ravel()
        return difference

    data: dict[str, Any] = {"time": times, **{n: exact[:, k] for k, n in enumerate(outputs)}}
    noise = dict.fromkeys(outputs, 0.001)
    model.fit(data, names, noise=noise)  # the code of the derivatives is made once, and kept
    for _ in range(repetitions):
        begun = time.process_time()
        found = model.fit(data, names, noise=noise)
        taken["exact"] += time.process_time() - begun
        evaluations["exact"] += found.details["evaluations"]
        errors["exact"] = float(
            np.abs([found[n] - t for n, t in zip(names, truth, strict=True)] / truth).max()
        )
        begun = time.process_time()
        other = least_squares(residuals, first, x_scale=first, xtol=1e-12, ftol=1e-12, gtol=1e-12)
        taken["differences"] += time.process_time() - begun
        errors["differences"] = float(np.abs(other.x / truth - 1).max())

    def residuals_by_hand(x: Array) -> Array:
        moved = solve_ivp(
            rates_by_hand({**by_hand, **dict(zip(names, x, strict=True))}),
            (0, 10),
            [0.3 / i for i in range(1, CHAIN + 1)] + [0.0] * CHAIN,
            "DOP853",
            times,
            rtol=1e-8,
            atol=1e-8,
        )
        difference: Array = (moved.y[:CHAIN].T - exact).ravel()
        return difference

    begun = time.process_time()
    least_squares(residuals_by_hand, first, x_scale=first, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    hand = time.process_time() - begun
    return [
        str(count),
        f"{1e3 * taken['exact'] / repetitions:.0f} ms",
        f"{1e3 * taken['differences'] / repetitions:.0f} ms",
        f"{1e3 * hand:.0f} ms",
        f"{taken['differences'] / taken['exact']:.1f}",
        f"{hand * repetitions / taken['exact']:.0f}",
        f"{evaluations['exact'] // repetitions}",
        f"{evaluations['differences'] // repetitions}",
        f"{errors['exact']:.1e}",
        f"{errors['differences']:.1e}",
    ]


def main(quick: bool = False) -> None:
    repetitions = QUICK if quick else REPETITIONS
    rows: list[list[str]] = []
    for trial in TRIALS:
        rows += coverage(trial, repetitions)
        print(*rows[-len(trial.true) :], sep="\n", flush=True)
    pairs = [against_differences(count, 2 if quick else 5) for count in (2, 4, 8)]
    text = (
        f"Fits of {repetitions} noisy repetitions each, 101 times: how often the 95 % intervals hold the true value, their "
        "half widths over those of the scatter of the estimates, evaluations of motion and derivatives, and processor time "
        "for each fit."
    )
    head = ["model", "unknown", "held", "width / scatter", "evaluations", "time"]
    other = (
        "Masses and springs of a chain from its motion (804 numbers without noise), by `model.fit` and by the same least "
        "squares with two-point differences of compiled runs, or of `solve_ivp` (DOP853, 1e-8) on NumPy by hand; errors relative, "
        "at the solution. The code of the derivatives was compiled before."
    )
    peers = [
        "unknowns",
        "exact",
        "differences",
        "by hand",
        "ratio of differences",
        "ratio by hand",
        "evaluations",
        "runs",
        "error",
        "error of differences",
    ]
    write("fits", "Fits", [text, table(head, rows), other, table(peers, pairs)])


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
