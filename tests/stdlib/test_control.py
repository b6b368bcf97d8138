"""Blocks of control engineering against SciPy, closed forms and the same algorithms in Python."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmu_models import written
from gallery import ROOT
from scipy import signal
from scipy.integrate import solve_ivp

import mechc
from mechc.compiler.targets.fmu import driver
from mechc.compiler.targets.fmu.checks import native_motion
from mechc.runtime.native.build import find_compiler


def run(text: str, stop: float = 1.0, tolerance: float = 1e-11, **given: Any) -> mechc.Solution:
    whole = f"import mech.control.*;\nmodel M\n{text}\n  experiment(stop = {stop} s, tolerance = {tolerance});\nend M;\n"
    solution = mechc.loads(whole).simulate(**given)
    assert solution.outcome.value == "completed", solution.message
    return solution


def test_signals() -> None:
    s = run("output r = ramp(time, 0.2 s, 0.4 s); output s = sine(time, 2 Hz, 30 deg); output c = chirp(time, 2 Hz, 5 Hz, 0.5 s); output p = pulse(time, 0.1 s, 0.2 s, 0.3); output t = trapezoid(time, 0.1 s, 0.2 s, 0.3 s, 0.1 s); output j = step(time, 0.3 s);")  # fmt: skip
    t = s.time
    off = (np.abs((t - 0.1) % 0.2 - 0.06) > 1e-9) & (np.abs((t - 0.1 + 0.1) % 0.2 - 0.1) > 1e-9)
    assert s["r"] == pytest.approx(np.interp(t, [0.2, 0.6], [0, 1]), abs=1e-14)
    assert s["s"] == pytest.approx(np.sin(4 * np.pi * t + np.pi / 6), abs=1e-13)
    early = t <= 0.5
    assert s["c"][early] == pytest.approx(signal.chirp(t[early], 2, 0.5, 5, phi=-90), abs=1e-13)
    assert s["c"][~early] == pytest.approx(np.sin(2 * np.pi * (1.75 + 5 * (t[~early] - 0.5))), abs=1e-12)
    assert s["t"] == pytest.approx(np.interp(t, [0.1, 0.3, 0.6, 0.7], [0, 1, 1, 0]), abs=1e-14)
    assert (s["p"] == (((t - 0.1) % 0.2 < 0.06) & (t > 0.1)))[off].all()
    assert (s["j"] == (t >= 0.3))[np.abs(t - 0.3) > 1e-9].all()


@pytest.mark.parametrize("n", range(2, 12))
def test_binary_sequences_are_as_long_as_they_can_be(n: int) -> None:
    """What tells them: one more of -1 than of 1, and a cyclic autocorrelation of -1 at all shifts but 0."""
    whole = f"import mech.control.*;\nmodel M\n  output s[:] = binary_sequence({n});\n  state Real x = 0;\n  equation der(x) = 1 s^-1;\n  experiment(stop = 1 s);\nend M;\n"
    solution = mechc.loads(whole).simulate()
    count = 2**n - 1
    s = np.array([solution[f"s[{k + 1}]"][-1] for k in range(count)])
    assert set(s) == {-1.0, 1.0} and s.sum() == -1
    shifted = np.fft.ifft(np.abs(np.fft.fft(s)) ** 2).real
    assert shifted == pytest.approx([count, *[-1] * (count - 1)], abs=1e-9)


def test_a_binary_signal_repeats_its_sequence() -> None:
    s = run("output b = prbs(time, 3, 0.1 s); state Real x = 0; equation der(x) = prbs(time, 3, 0.1 s)*1 s^-1;", 1.5)  # fmt: skip
    sequence = np.array([-1, -1, -1, 1, 1, -1, 1])  # by hand: each is the product of those 3 and 2 before
    place = np.floor(s.time / 0.1 + 1e-9).astype(int)
    inside = np.abs(s.time / 0.1 - np.round(s.time / 0.1)) > 1e-6
    assert (s["b"] == sequence[place % 7])[inside].all()
    assert s["x"][-1] == pytest.approx(0.1 * (2 * sequence.sum() + sequence[0]), abs=1e-12)


@pytest.mark.parametrize("way", [2.0, -2.0, 0.3, 0.0])
def test_the_fastest_way_between_two_points(way: float) -> None:
    """A drive needs its acceleration; that of bang, coast, bang is integrated by hand, and no faster way is known."""
    s = run(f"coordinate Length x; kinetic 1/2*(2 kg)*der(x)^2; drive x = point_to_point(time, {way} m, 1.5 m/s, 5 m/s^2); output F = reaction(x);", 2)  # fmt: skip
    up = min(0.3, math.sqrt(abs(way) / 5))
    over = up + (abs(way) / (5 * up) if way else 0)
    t, sign = s.time, np.sign(way)
    far = np.min([np.abs(t - at) for at in (0, up, over - up, over)], axis=0) > 1e-9
    rate = np.interp(t, [0, up, max(over - up, up), over + 1e-300], [0, 5 * up, 5 * up, 0]) if way else 0 * t
    assert s["der(x)"] == pytest.approx(sign * rate, abs=1e-12)
    assert s["x"][-1] == pytest.approx(way, abs=1e-12)
    pull = np.where(t < up, 5.0, np.where((t > over - up) & (t < over), -5.0, 0.0))
    assert s["F"][far] == pytest.approx(2 * sign * pull[far], abs=1e-10)


def of_scipy(kind: str, high: str, order: int, cutoff: float, ripple: float) -> Any:
    """Return numerator and denominator of an analogue filter."""
    w, way = 2 * math.pi * cutoff, high + "pass"
    if kind == "bessel":
        b, a = signal.bessel(order, w, way, analog=True, norm="mag")
    elif kind == "chebyshev":
        b, a = signal.cheby1(order, ripple, w, way, analog=True)
    else:
        b, a = signal.butter(order, w, way, analog=True)
    return b, a


def step_answer(b: Any, a: Any, t: Any) -> Any:
    """Return the answer to a unit step, by the exponential of the matrix at each time."""
    A, B, C, D = signal.tf2ss(b, a)
    n = len(A)
    scale = np.diag(1.0 / np.abs(np.roots(a)).mean() ** np.arange(n)[::-1])
    A, B, C = np.linalg.inv(scale) @ A @ scale, np.linalg.inv(scale) @ B, C @ scale
    return signal.lsim((A, B, C, D), np.ones_like(t), t)[1]


@pytest.mark.parametrize("kind", ["butterworth", "bessel", "chebyshev"])
@pytest.mark.parametrize(("high", "order"), [("low", 1), ("low", 4), ("low", 7), ("high", 2), ("high", 5)])
def test_filters(kind: str, high: str, order: int) -> None:
    text = f'input Length u = 1 m; Filter f(u = u, kind = "{kind}", pass = "{high}", order = {order}, cutoff = 3 Hz, ripple = 2);'
    s = run(text, 1.0, 1e-12)
    b, a = of_scipy(kind, high, order, 3, 2)
    assert s["f.y"] == pytest.approx(step_answer(b, a, s.time), abs=1e-10)


def test_filters_of_the_highest_order() -> None:
    """A step by partial fractions over the poles that SciPy finds."""
    s = run("".join(f'Filter {kind}(u = 1 m, kind = "{kind}", order = 12, cutoff = 3 Hz, ripple = 0.1);' for kind in ("butterworth", "bessel", "chebyshev")), 2, 1e-12)  # fmt: skip
    w = 6 * math.pi
    for name, (_, poles, gain) in {
        "butterworth": signal.butter(12, w, analog=True, output="zpk"),
        "bessel": signal.bessel(12, w, analog=True, norm="mag", output="zpk"),
        "chebyshev": signal.cheby1(12, 0.1, w, analog=True, output="zpk"),
    }.items():
        answer = sum(
            gain / np.prod(p - np.delete(poles, i)) / p * np.expm1(p * s.time) for i, p in enumerate(poles)
        )
        assert s[f"{name}.y"] == pytest.approx(np.real(answer), abs=1e-11), name


def test_transfer_function_and_state_space() -> None:
    """Steps through both, proper and of two signals, by the exponential of the matrix."""
    b, a = [2.0, 0.5, 3.0], [1.5, 2.0, 7.0, 4.0]
    s = run("input Force u = 1 N; TransferFunction f(u = u, b = {2, 0.5, 3}, a = {1.5, 2, 7, 4}, T = 0.1 s); TransferFunction g(u = u, b = {1, 0, 2}, a = {1, 3, 5}); StateSpace h(u = {u, 2 N}, A = {{0, 1}, {-5, -3}}, B = {{0, 1}, {1, 0}}, C = {{1, 2}, {0, 1}, {3, 0}}, D = {{0, 0}, {1, 0}, {0, 2}});", 2)  # fmt: skip
    t = s.time
    assert s["f.y"] == pytest.approx(step_answer(b, a, t * 10), abs=1e-10)
    assert s["g.y"] == pytest.approx(step_answer([1, 0, 2], [1, 3, 5], t), abs=1e-10)
    rows = ([[0, 1], [-5, -3]], [[0, 1], [1, 0]], [[1, 2], [0, 1], [3, 0]], [[0, 0], [1, 0], [0, 2]])
    system = tuple(np.array(row, dtype=float) for row in rows)
    wanted = signal.lsim(system, np.column_stack([np.ones_like(t), 2 * np.ones_like(t)]), t)[1]
    assert np.column_stack([s[f"h.y[{i}]"] for i in (1, 2, 3)]) == pytest.approx(wanted, abs=1e-10)


def test_lags_and_rates() -> None:
    s = run("let u = 3 N*sin(5 rad/s*time); FirstOrder f(u = u, T = 0.2 s); SecondOrder g(u = 3 N, w = 4 rad/s, D = 0.3); Integrator i(u = u); Derivative d(u = u, T = 0.2 s);")  # fmt: skip
    t = s.time
    lag = 3 * (np.sin(5 * t) - np.cos(5 * t) + np.exp(-5 * t)) / 2
    assert s["f.y"] == pytest.approx(lag, abs=1e-9)
    assert s["d.y"] == pytest.approx((3 * np.sin(5 * t) - lag) / 0.2, abs=1e-9)
    assert s["i.y"] == pytest.approx(0.6 * (1 - np.cos(5 * t)), abs=1e-10)
    w = 4 * math.sqrt(1 - 0.09)
    assert s["g.y"] == pytest.approx(3 - 3 * np.exp(-1.2 * t) * (np.cos(w * t) + 1.2 / w * np.sin(w * t)), abs=1e-10)  # fmt: skip


def test_blocks_take_vectors_and_begin_where_they_stay() -> None:
    """A lag of a ramp is after by T, from the start where it begins there; a PID of two lengths is two of them."""
    s = run("let v = {1 m + 2 m/s*time, 3 m}; FirstOrder f(u = v, T = 0.2 s); initial stationary f.y; Filter g(u = 3 m, order = 3); initial stationary g.chain.x; Derivative d(u = v, T = 0.2 s); initial stationary d.lagging; PID c(target = 0, measured = v, k = 3 N/m, Ti = 2 s);")  # fmt: skip
    t = s.time
    assert s["f.y[1]"] == pytest.approx(1 + 2 * t - 0.4 * (1 - np.exp(-5 * t)), abs=1e-10)
    assert s["d.y[1]"] == pytest.approx(2 * (1 - np.exp(-5 * t)), abs=1e-9)
    assert s["f.y[2]"] == pytest.approx(3) and s["g.y"] == pytest.approx(3, abs=1e-12)
    assert s["c.y[1]"] == pytest.approx(-3 * (1 + 2 * t) - 1.5 * (t + t**2), abs=1e-10)
    assert s["c.y[2]"] == pytest.approx(-9 - 4.5 * t, abs=1e-10)


LOOP = """coordinate Length x = 0 m; kinetic 1/2*(2 kg)*der(x)^2; damping 1 N.s/m on x;
  {kind} c(target = 0.5 m, measured = x, k = 40 N/m, Ti = 0.4 s, Td = 0.3 s, Tf = 20 ms, weight = 0.6{more}); force c.y on x;"""


def controlled(t: float, y: Any, low: float, high: float) -> list[float]:
    x, v, integral, lagging = y
    free = 40 * (0.6 * 0.5 - x + 0.3 * (-x - lagging) / 0.02) + integral
    F = min(max(free, low), high)
    return [v, (F - v) / 2, 40 * (0.5 - x) / 0.4 + (F - free) / 0.1, (-x - lagging) / 0.02]


@pytest.mark.parametrize("limit", [math.inf, 4.0])
def test_a_controlled_mass(limit: float) -> None:
    """The closed loop with SciPy, with limits and without; the integral does not wind up."""
    more = f", Tt = 0.1 s, low = -{limit} N, high = {limit} N" if limit < 10 else ""
    s = run(LOOP.format(kind="LimitedPID" if more else "PID", more=more), 2)
    found = solve_ivp(controlled, (0, 2), [0.0] * 4, "DOP853", args=(-limit, limit), rtol=1e-11, atol=1e-13, max_step=0.002 if more else 1)  # fmt: skip
    for k, name in enumerate(("x", "der(x)", "c.I", "c.lagging")):
        assert s[name][-1] == pytest.approx(found.y[k][-1], abs=1e-7 if more else 1e-9)
    if more:
        assert np.abs(s["c.y"]).max() == pytest.approx(4) and np.sum(np.abs(s["c.y"]) == 4) > 20


SAMPLED = "let m = 0.3 m*sin(7 rad/s*time); SampledPID c(target = 0.2 m, measured = m, k = 40 N/m, period = 0.0625 s, Ti = 0.4 s, Td = 0.3 s, Tf = 20 ms, Tt = 0.1 s, low = -30 N, high = 25 N, weight = 0.6, derivative_weight = 0.2);"  # fmt: skip


def test_a_sampled_controller() -> None:
    """The textbook's algorithm (K. J. Astrom, B. Wittenmark: Computer-Controlled Systems, section 8.5) in Python."""
    s = run(SAMPLED)
    integral = derivative = last = 0.0
    limited = 0
    for n in range(16):
        m, h = 0.3 * math.sin(7 * n * 0.0625), 0.0625
        e = 0.2 * 0.2 - m
        derivative = (0.02 * derivative + 40 * 0.3 * (e - last)) / (0.02 + h) if n else 0.0
        last = e
        free = 40 * (0.6 * 0.2 - m) + integral + derivative
        answer = min(max(free, -30), 25)
        limited += answer != free
        integral += 40 * h / 0.4 * (0.2 - m) + h / 0.1 * (answer - free)
        assert s(n * h + h / 2)["c.y"] == pytest.approx(answer, rel=1e-13), n
    assert 3 < limited < 13


def test_what_is_not_linear() -> None:
    s = run("let u = 1 m*sin(6 rad/s*time); Limiter l(u = u, low = -0.3 m, high = 0.6 m); Deadband d(u = u, width = 0.4 m); Quantizer q(u = u, resolution = 0.13 m); Hysteresis h(u = u, low = -0.5 m, high = 0.7 m); Hysteresis on(u = 2 m - u, low = 0.5 m, high = 1.5 m); SampleHold p(u = u, period = 0.125 s);", 2)  # fmt: skip
    t = s.time
    u = np.sin(6 * t)
    assert s["l.y"] == pytest.approx(np.clip(u, -0.3, 0.6), abs=1e-12)
    assert s["d.y"] == pytest.approx(u - np.clip(u, -0.4, 0.4), abs=1e-12)
    inside = np.abs(u / 0.13 % 1 - 0.5) > 1e-7
    assert s["q.y"][inside] == pytest.approx(0.13 * np.round(u / 0.13)[inside], abs=1e-12)
    on, off, period = math.asin(0.7) / 6, (math.pi + math.asin(0.5)) / 6, math.pi / 3
    phase = t % period
    assert (s["h.y"] == ((phase > on) & (phase < off)))[
        (np.abs(phase - on) > 1e-7) & (np.abs(phase - off) > 1e-7)
    ].all()
    assert (s["on.y"][1:] == 1).all()
    between = np.abs(t / 0.125 - np.round(t / 0.125)) > 1e-7
    assert s["p.y"][between] == pytest.approx(np.sin(6 * 0.125 * np.floor(t / 0.125))[between], abs=1e-12)


def test_a_limited_rate() -> None:
    """A step is followed at the largest rate until it is nearer than T times that, and then by a lag."""
    s = run("RateLimiter r(u = 0.5 m*step(time, 0.1 s), rise = 1 m/s, fall = 3 m/s, T = 10 ms);")
    t = s.time
    wanted = np.where(t < 0.59, np.clip(t - 0.1, 0, 1), 0.5 - 0.01 * np.exp(-(t - 0.59) / 0.01))
    assert s["r.y"] == pytest.approx(wanted, abs=1e-9)


def test_what_is_refused() -> None:
    for text, code, word in (
        ("TransferFunction f(u = time, b = {1, 2, 3});", "E0305", "3 elements"),
        ("TransferFunction f(u = time, a = {1}, b = {2});", "E0423", "below its minimum 1"),
        ("Filter f(u = time, order = 13);", "E0423", "above its maximum 12"),
        ("FirstOrder f;", "E0327", "'FirstOrder f(u = ..);'"),
        ("PID c(measured = 2*time);", "E0327", "'PID c(k = ..);'"),
        ("LimitedPID c(measured = 2*time, k = 1 N/s, low = -1, high = 1 N);", "E0303", "write '-1 N'"),
    ):
        with pytest.raises(mechc.CompileError) as found:
            run(text)
        assert code in str(found.value) and word in str(found.value), text
    for text, word in (
        ("Limiter f(u = time, low = 2 s, high = 1 s);", "the lower limit is above the upper one"),
        ("Hysteresis f(u = time, low = 2 s, high = 1 s);", "switches off below where it switches on"),
        ('Filter f(u = time, kind = "besel");', "the kind of a filter is"),
        ("FirstOrder f(u = time, T = 0 s);", "below its minimum"),
    ):
        with pytest.raises((mechc.SimulationError, AssertionError), match=word):
            run(text)


def example(name: str) -> mechc.Solution:
    solution = mechc.load(ROOT / "examples" / f"{name}.mech").simulate()
    assert solution.outcome.value == "completed", solution.message
    return solution


def test_the_thermostat_switches_with_its_period() -> None:
    s = example("thermostat")
    on = [e.time for e in s.events if "high" in e.name]
    assert np.diff(on) == pytest.approx(s["expected"][0], rel=1e-9)
    assert s["expected"][0] == pytest.approx(1200 * (math.log(22 / 18) + math.log(22 / 18)), rel=1e-12)


def test_the_cart_arrives_in_time() -> None:
    """On its way it is off by less than (m a + wind)/k, and it stays within two steps of its encoder."""
    s = example("cart_servo")
    (arrival,) = set(s["expected"])
    assert arrival == pytest.approx(2 / 1.5 + 1.5 / 4, rel=1e-14)
    assert np.abs(s["x"] - 2)[s.time > arrival + 1].max() < 2e-4
    assert np.abs(s["off"]).max() < (5 * 4 + 8) / 2000
    assert s["servo.y"][-1] == pytest.approx(8, abs=0.1)


def test_the_filters_of_the_example() -> None:
    s = example("filters")
    for kind in ("bessel", "butterworth", "chebyshev"):
        b, a = of_scipy(kind, "low", 4, 10, 1)
        assert s[f"{kind}_answer"] == pytest.approx(0.01 * step_answer(b, a, s.time), abs=1e-9)


@pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
def test_a_sampled_loop_has_the_same_bits_in_an_fmu(tmp_path: Path) -> None:
    text = "import mech.control.*;\nmodel Loop\n" + LOOP.format(
        kind="SampledPID", more=", period = 30 ms, low = -5 N, high = 5 N"
    )
    path, start = written(tmp_path, text + "\n  experiment(stop = 1 s, tolerance = 1e-8);\nend Loop;\n", 3)
    native = native_motion(start, "dop853", 31)
    assert np.array_equal(driver.co_simulation(path, native.times, native.step), native.states)
    assert np.abs(native.states).max() > 0.1


def test_arrays_of_blocks_share_what_they_are_given() -> None:
    """As many values as blocks are dealt out, also where a declaration leaves type or size to them; others go to each."""
    s = run("let v = {1 m, 2 m, 3 m}; FirstOrder one[2](u = {1 m, 2 m}, T = {0.5, 0.2} s); FirstOrder all[2](u = v); FirstOrder rows[2](u = {v, 2*v}); PID c[2](target = 1 m, measured = 0 m, k = {3 N/m, 4 N/m}); TransferFunction f[2](u = 1 N, a = {{2, 1}, {3, 1}}); Integrator nested[2](u = c.y);")  # fmt: skip
    t = s.time
    for T, scale, name in ((0.5, 1, "one[1].y"), (0.2, 2, "one[2].y"), (1, 3, "all[1].y[3]"), (1, 3, "all[2].y[3]"), (1, 6, "rows[2].y[3]"), (2, 1, "f[1].y"), (3, 1, "f[2].y")):  # fmt: skip
        assert s[name] == pytest.approx(scale * (1 - np.exp(-t / T)), abs=1e-10), name
    for k in (1, 2):
        assert s[f"c[{k}].y"] == pytest.approx((2 + k) * (1 + t), abs=1e-10)
        assert s[f"nested[{k}].y"] == pytest.approx((2 + k) * (t + t**2 / 2), abs=1e-10)
