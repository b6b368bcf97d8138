"""``delay(e, T)`` against closed forms and an integrator of its own; jumps come again after T."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mechc

Floats = NDArray[np.float64]


def run(body: str, stop: float, parts: str = "", **options: Any) -> mechc.Solution:
    text = f"{parts}model M\n{body}\n experiment(stop = {stop!r} s);\nend M;\n"
    solution = mechc.loads(text, model="M").simulate(**{"tolerance": 1e-11, **options})
    assert solution.outcome.value == "completed", solution.message
    return solution


def by_steps(count: int) -> list[list[Fraction]]:
    """Return x on [k, k + 1] as coefficients of powers of t - k, for x' = -x(t - 1) with x = 1 before 0."""
    start, before, pieces = Fraction(1), [Fraction(1)], []
    for _ in range(count):
        piece = [start, *(-a / (i + 1) for i, a in enumerate(before))]
        pieces.append(piece)
        start, before = sum(piece, Fraction(0)), piece
    return pieces


PIECES = by_steps(10)


def exact(t: float) -> float:
    """Return the closed form at a time from 0 to 10."""
    k = min(int(t), 9)
    s = Fraction(t) - k
    return float(sum((a * s**i for i, a in enumerate(PIECES[k])), Fraction(0)))


LINEAR = "state x = 1; equation der(x) = -delay(x, 1 s)/(1 s); output w = delay(x, 1 s);"


@pytest.mark.parametrize(
    ("method", "options", "bound"),
    [
        ("dop853", {"tolerance": 1e-11}, 1e-11),
        ("auto", {"tolerance": 1e-11}, 1e-11),
        ("radau5", {"tolerance": 1e-11}, 1e-10),
        ("rk4", {"step": 0.01}, 1e-10),
        ("gauss4", {"step": 0.01}, 1e-11),
        ("gauss8", {"step": 0.1}, 1e-13),
    ],
)
def test_the_method_of_steps(method: str, options: dict[str, Any], bound: float) -> None:
    """Measured: 6e-13 by dop853, 3e-11 by radau5, 2.4e-11 by rk4, 2.9e-12 by gauss4, 2e-14 by gauss8."""
    found = run(LINEAR, 10.0, method=method, **options)
    wanted = np.array([exact(t) for t in found.time])
    before = np.array([1.0 if t < 1 else exact(t - 1) for t in found.time])
    assert np.abs(found["x"] - wanted).max() < bound
    assert np.abs(found["w"] - before).max() < bound


def test_values_between_the_rows() -> None:
    """Of outputs that look back, too: by the polynomials of the steps. Measured: 9e-13."""
    found = run(LINEAR, 10.0, every=1.0)
    times = np.array([0.3, 1.7, 4.9, 9.99])
    between = found(times)
    assert np.abs(between["x"] - [exact(t) for t in times]).max() < 1e-11
    assert np.abs(between["w"] - [1.0 if t < 1 else exact(t - 1) for t in times]).max() < 1e-11


def own_integrator(
    rate: Callable[[float, Floats, list[Floats]], Sequence[float]],
    start: Sequence[float],
    delays: Sequence[float],
    stop: float,
) -> Callable[[float], Floats]:
    """Return y(t) by SciPy's DOP853 from one sum of delays to the next, with its dense output: shares no code with mechc."""
    sums = {0.0}
    for _ in range(10):
        sums |= {s + d for s in sums for d in delays if s + d < stop}
    ends = sorted({round(s, 12) for s in sums} | {stop})
    step = min(delays)
    cuts = sorted({*ends, *np.arange(0.0, stop, step / 2).tolist()})
    pieces: list[tuple[float, Callable[[float], Floats]]] = []
    state = np.array(start, dtype=float)

    def at(t: float) -> Floats:
        if t <= 0 or not pieces:
            return np.array(start, dtype=float)
        low = max(k for k, (begin, _) in enumerate(pieces) if begin <= t or k == 0)
        return pieces[low][1](t)

    for begin, end in itertools.pairwise(cuts):
        if end - begin < 1e-12:
            continue
        done = solve_ivp(
            lambda t, y: rate(t, y, [at(t - d) for d in delays]),
            (begin, end),
            state,
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
            dense_output=True,
        )
        pieces.append((begin, done.sol))
        state = done.y[:, -1]
    return at


@pytest.mark.slow
def test_mackey_and_glass() -> None:
    """M. C. Mackey, L. Glass, Science 197, 1977: x' = beta x(t - T)/(1 + x(t - T)^n) - gamma x, before it becomes chaotic."""
    body = """
      parameter T = 6 s; parameter beta = 0.2/(1 s); parameter gamma = 0.1/(1 s);
      state x = 0.5; let past = delay(x, T);
      equation der(x) = beta*past/(1 + past^10) - gamma*x;
    """

    def rate(t: float, y: Floats, past: list[Floats]) -> list[float]:
        p = float(past[0][0])
        return [0.2 * p / (1 + p**10) - 0.1 * float(y[0])]

    found = run(body, 100.0)
    own = own_integrator(rate, [0.5], [6.0], 100.0)
    off = [abs(x - own(t)[0]) for t, x in zip(found.time[::10], found["x"][::10], strict=True)]
    assert max(off) < 1e-9


@pytest.mark.slow
def test_two_delays_and_a_mass() -> None:
    """Two delays whose sums are many, in a force on a coordinate and its rate."""
    body = """
      coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*4 N/m*x^2;
      force -1.5 N/m*delay(x, 0.7 s) - 0.8 N.s/m*delay(der(x), 0.31 s) on x;
    """

    def rate(t: float, y: Floats, past: list[Floats]) -> list[float]:
        return [float(y[1]), float(-4 * y[0] - 1.5 * past[0][0] - 0.8 * past[1][1])]

    found = run(body, 4.0)
    own = own_integrator(rate, [1.0, 0.0], [0.7, 0.31], 4.0)
    off = [
        max(abs(x - own(t)[0]), abs(v - own(t)[1]))
        for t, x, v in zip(found.time[::10], found["x"][::10], found["der(x)"][::10], strict=True)
    ]
    assert max(off) < 1e-9


# ---------------------------------------------------------------- jumps come again


def test_ticks_come_again() -> None:
    """A number that a clock counts: the integral of the count a quarter of a second ago, in closed form."""
    found = run(
        "discrete Real n = 0; state v = 0; equation der(v) = delay(n, 0.25 s)/(1 s); output m = delay(n, 0.25 s);"
        "when sample(0.1 s) then n := n + 1; end when;",
        1.0,
    )
    assert found["v"][-1] == pytest.approx(0.25 + sum(0.1 * (k + 1) for k in range(7)) + 8 * 0.05, abs=1e-14)
    assert found["m"][-1] == 8


def test_jumps_of_states_come_again() -> None:
    found = run(
        "state x = 0; state y = 0; equation der(x) = 0/(1 s); equation der(y) = delay(x, 0.3 s)/(1 s);"
        "when sample(0.25 s) then reinit(x, x + 1); end when;",
        1.0,
    )
    assert found["y"][-1] == pytest.approx(0.3 + 0.25 + 0.25 * 2 + 0.2 * 3, abs=1e-14)


def test_rows_of_a_table_come_again() -> None:
    """A jump and a bend of an input: 0.25 of 1, 0.3 of 1, 0.2 of 3, half of 0.1 of 3."""
    model = mechc.loads(
        "model M\n input Real F = 0; state v = 0; equation der(v) = delay(F, 0.25 s)/(1 s); experiment(stop = 1 s);\nend M;"
    )
    times, values = [0, 0.3, 0.3, 0.5, 0.6, 1.0], [1, 1, 3, 3, 0, 0]
    found = model.simulate(inputs={"F": (np.array(times), np.array(values, dtype=float))}, tolerance=1e-11)
    assert found["v"][-1] == pytest.approx(0.25 + 0.3 + 0.6 + 0.15, abs=1e-14)


def test_formulas_of_inputs_are_delayed() -> None:
    found = run(
        "input Real F = sin(3*time/(1 s)); state v = 0; equation der(v) = delay(F, 0.25 s)/(1 s);", 1.0
    )
    assert found["v"][-1] == pytest.approx((1 - np.cos(2.25)) / 3, abs=1e-12)


def test_conditions_look_back() -> None:
    """x = t passes 0.4 at 0.4, so what it was 0.3 ago does at 0.7."""
    found = run(
        "state x = 0; state y = 0; discrete Real hit = -1; equation der(x) = 1/(1 s); equation der(y) = 0/(1 s);"
        "when delay(x, 0.3 s) > 0.4 then hit := time/(1 s); end when;",
        1.0,
    )
    assert found["hit"][-1] == pytest.approx(0.7, abs=1e-13)


def test_a_switch_that_looks_back() -> None:
    """x' = -sign(x(t - 1)): straight lines between -1 and 1 from t = 2 on."""
    found = run("state x = 1; equation der(x) = -sign(delay(x, 1 s))/(1 s);", 20.0)
    t = found.time
    wanted = np.where(t < 2, 1 - t, np.interp((t - 2) % 4, [0, 2, 4], [-1, 1, -1]))
    assert np.abs(found["x"] - wanted).max() < 1e-11


def test_impacts_come_again() -> None:
    """The delayed speed of a ball pushes a mass: its speed is the height of the ball half a second ago, less 1 m."""
    found = run(
        """coordinate Length h = 1 m; coordinate Length q = 0 m; kinetic 1/2*1 kg*(der(h)^2 + der(q)^2);
        potential 1 kg*10 m/s^2*h; force 1 kg/s*delay(der(h), 0.5 s) on q; contact c: h restitution 0.5;""",
        3.0,
    )
    first = np.sqrt(0.2)

    def height(t: float) -> float:
        if t <= first:
            return 1 - 5 * max(t, 0.0) ** 2
        speed, t = 10 * first, t - first
        while speed > 1e-9:
            speed /= 2
            if t < speed / 5:
                return float(speed * t - 5 * t * t)
            t -= speed / 5
        return 0.0

    wanted = np.array([height(t - 0.5) - 1 for t in found.time])
    assert np.abs(found["der(q)"] - wanted).max() < 1e-12


def test_delays_of_delays_add_up() -> None:
    found = run(
        """state x = 0; equation der(x) = 1/(1 s); output a = delay(delay(x, 0.2 s)^2, 0.3 s); output b = delay(x, 0.5 s)^2;
        output t = delay(time, 0.3 s);""",
        1.0,
    )
    assert np.abs(found["a"] - found["b"]).max() < 1e-15
    assert np.abs(found["t"] - np.maximum(found.time - 0.3, 0)).max() < 1e-15


def test_what_is_driven_is_delayed_by_its_formula() -> None:
    found = run(
        """coordinate Length z; drive z = 2 m + 0.5 m*sin(3*time/(1 s)); kinetic 1/2*1 kg*der(z)^2;
        output a = delay(z, 0.2 s); output v = delay(der(z), 0.2 s); state s = 0; equation der(s) = 1/(1 s);""",
        1.0,
    )
    then = np.maximum(found.time - 0.2, 0)
    assert np.abs(found["a"] - (2 + 0.5 * np.sin(3 * then))).max() < 1e-14
    assert np.abs(found["v"] - 1.5 * np.cos(3 * then)).max() < 1e-14


def test_a_part_that_delays() -> None:
    """A model of a transport, used twice with other times: e^(-t) a while ago."""
    found = run(
        "state x = 1; equation der(x) = -x/(1 s); Line a(u = x, T = 0.1 s); Line b(u = x, T = 0.4 s);",
        1.0,
        "model Line\n input Real u; parameter T = 1 s; output y = delay(u, T);\nend Line;\n",
    )
    for name, delay in (("a.y", 0.1), ("b.y", 0.4)):
        assert np.abs(found[name] - np.exp(-np.maximum(found.time - delay, 0))).max() < 1e-11


def test_a_run_in_steps_goes_back() -> None:
    """An input that is set on the way is delayed; a snapshot holds the past."""
    model = mechc.loads(
        "model M\n input Real u = 1; state v = 0; equation der(v) = delay(u, 0.5 s)/(1 s); output w = delay(u, 0.5 s);"
        "experiment(stop = 5 s);\nend M;"
    )
    run_ = model.start()
    run_.step(1.0)
    run_["u"] = 3.0
    run_.step(1.25)
    assert run_["v"] == pytest.approx(1.25, abs=1e-13) and run_["w"] == 1.0
    kept = run_.snapshot()
    for _ in range(2):
        run_.step(2.0)
        assert run_["v"] == pytest.approx(1.5 + 3 * 0.5, abs=1e-13) and run_["w"] == 3.0
        run_.restore(kept)


# ---------------------------------------------------------------- chatter


LATHE = """
  parameter k = 1 N/m; parameter zeta = 0.05; parameter T = 1 s; parameter K = 0.1 N/m;
  coordinate Length x = 1e-3 m;
  kinetic 1/2*1 kg*der(x)^2; potential 1/2*k*x^2; damping 2*zeta*sqrt(k*1 kg) on x;
  force K*(delay(x, T) - x) on x;
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lobe", "frequency"), [(1, 1.02), (1, 1.1), (1, 1.3), (2, 1.02), (2, 1.1), (2, 1.3), (4, 1.02), (4, 1.1)]
)
def test_chatter_begins_at_its_lobes(lobe: int, frequency: float) -> None:
    """Turning, one degree of freedom: m x'' + c x' + k x = K (x(t - T) - x). At the border of stability, with the frequency w of
    the vibration, K = -1/(2 Re G(i w)), and w T = 2 pi (lobe + phase) with the phase of G (J. Tlusty; Y. Altintas, Manufacturing
    Automation, 2nd ed., section 4.3). Below it vibrations die out, above they grow.
    """
    w, zeta = frequency, 0.05
    response = 1 / (1 - w**2 + 2j * zeta * w)
    border = -1 / (2 * response.real)
    # 1/G + K = K e^(-i w T)
    angle = -np.angle((1 / response + border) / border)
    delay = (angle + 2 * np.pi * lobe) / w
    assert delay > 0 and abs(1 / response + border - border * np.exp(-1j * w * delay)) < 1e-12

    def growth(factor: float) -> float:
        found = run(LATHE, 600.0, set={"T": delay, "K": factor * border}, tolerance=1e-9)
        size = np.hypot(found["x"], found["der(x)"])
        early, late = (found.time > 100) & (found.time < 200), found.time > 500
        return float(np.log(size[late].max() / size[early].max()))

    assert growth(0.99) < 0 < growth(1.01)


@pytest.mark.parametrize("kind", ["rainflow", pytest.param("spectrum", marks=pytest.mark.slow)])
def test_studies_of_a_run_look_back(kind: str) -> None:
    """A sine of 1 Hz that is 0.3 s late swings by 2 and has one line."""
    model = mechc.loads(
        "model M\n state Real v = 0; equation der(v) = 2*pi*cos(2*pi*time/(1 s))/(1 s); output w = delay(v, 0.3 s);"
        "experiment(stop = 6 s, tolerance = 1e-9);\nend M;"
    )
    found: Any = model.study(kind, of="w", settling=1)
    if kind == "rainflow":
        assert found.arrays["range"].max() == pytest.approx(2, abs=1e-6)
    else:
        assert found.details["lines"][0]["frequency"] == pytest.approx(1, rel=1e-3)
