"""Periodic orbits and Floquet multipliers: against closed forms and the literature."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import mathieu_a, mathieu_b
from shared_models import example

import mechc
from mechc.cli.main import run as run_command

DUFFING = """\
model Duffing
  dimensionless;
  parameter a = {start};
  coordinate x = a;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2 + 1/4*x^4;
  experiment(stop = 30);
end Duffing;
"""

MATHIEU = """\
model Mathieu
  dimensionless;
  parameter a = 1;
  parameter q = 0.3;
  coordinate x = 0;
  kinetic 1/2*der(x)^2;
  force -(a - 2*q*cos(2*time))*x on x;
end Mathieu;
"""


def test_van_der_pol() -> None:
    """mu = 1: the period 6.6632868593231 and the multiplier exp of the integral of 1 - x^2, of a run by SciPy."""
    found = example("van_der_pol_cycle").orbit().summary()
    assert found["period"] == pytest.approx(6.6632868593231, rel=1e-12)

    def rate(t: float, s: np.ndarray) -> list[float]:
        return [s[1], (1 - s[0] ** 2) * s[1] - s[0], 1 - s[0] ** 2]

    start = [found["start"]["x"], found["start"]["der(x)"], 0.0]
    twin = solve_ivp(rate, (0, found["period"]), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    assert np.abs(twin[:2] - start[:2]).max() < 1e-11
    inner = min(found["multipliers"], key=lambda m: abs(complex(*m)))
    assert inner[0] == pytest.approx(math.exp(twin[2]), abs=1e-12) and inner[1] == 0
    assert found["stable"] is True


def test_van_der_pol_as_a_relaxation() -> None:
    """mu = 1000: T = (3 - 2 ln 2) mu + 3 a mu^(-1/3) - 2 ln(mu)/(3 mu) + ... = 1614.40, a = 2.33811 (Dorodnitsyn)."""
    found = example("van_der_pol_cycle").orbit(experiment="relaxation")
    mu = 1000.0
    series = (3 - 2 * math.log(2)) * mu + 3 * 2.338107410 * mu ** (-1 / 3) - 2 / 3 * math.log(mu) / mu
    assert found["period"] == pytest.approx(series, abs=2.0 / mu)  # the next term is 1.3246/mu
    (period,) = (v for v in found.values if v.name == "period")
    assert period.error is not None and period.error < 1e-10 * series
    small = min(abs(complex(*m)) for m in found.summary()["multipliers"])
    assert small < 1e-8


def test_the_figure_eight() -> None:
    """Three bodies (Chenciner and Montgomery 2000): T = 6.32591398, stable but for what keeps them in families."""
    found = example("figure_eight").orbit().summary()
    assert found["period"] == pytest.approx(6.32591398, abs=5e-8)  # of a start of 8 digits
    sizes = sorted(abs(complex(*m)) for m in found["multipliers"])
    assert sizes[-1] == pytest.approx(1, abs=2e-3) and sizes[0] == pytest.approx(1, abs=2e-3)
    moving = [complex(*m) for m in found["multipliers"] if abs(m[1]) > 1e-2]
    assert len(moving) == 4  # 0.9986 +- 0.0529 i, -0.2976 +- 0.9547 i (Simo)
    assert any(abs(m - complex(-0.2975967, 0.9546917)) < 1e-5 for m in moving)


@pytest.mark.parametrize("start", [0.5, 2.0])
def test_duffing_has_the_period_of_its_integral(start: float) -> None:
    """The orbit keeps the start's energy, and 'period' gives the same by an integral."""
    model = mechc.loads(DUFFING.format(start=start))
    found = model.orbit()
    assert found["period"] == pytest.approx(model.period()["period"], rel=1e-11)
    assert found.summary()["stable"] is None
    other = model.orbit(energy=1.0)
    assert other["period"] == pytest.approx(model.period(energy=1.0)["period"], rel=1e-10)


def test_a_driven_orbit_and_its_doubling() -> None:
    """The pendulum of Baker and Gollub: stable at 0.9, doubled between 1.06 and 1.07."""
    model = example("driven_pendulum")
    found = model.orbit(period="2*pi/wD").summary()
    assert found["stable"] is True and found["period"] == pytest.approx(3 * math.pi, rel=1e-14)
    product = np.prod([complex(*m) for m in found["multipliers"]])
    assert product == pytest.approx(math.exp(-0.5 * 3 * math.pi), rel=1e-8)  # Liouville: damping 1/q = 1/2
    settled = model.section(set={"g": 1.05}, every="2*pi/wD", count=100)
    start = {name: float(settled.arrays[name][-1]) for name in ("theta", "der(theta)")}
    followed = model.orbit(period="2*pi/wD", over="g = 1.05 .. 1.075, 16", set=start).summary()
    assert [one["kind"] for one in followed["special"]] == ["period doubling"]
    low, high = followed["special"][0]["between"]
    assert 1.05 < low < high < 1.075


def test_an_orbit_with_constraints() -> None:
    """A pendulum in Cartesian coordinates has the period of the elliptic integral: both multipliers are 1."""
    found = example("pendulum_cartesian").orbit()
    model = example("pendulum_cartesian")
    run = model.section(where="x = 0", count=3)
    assert found["period"] == pytest.approx(float(np.diff(run.arrays["time"])[0]), rel=1e-8)
    assert len(found.summary()["multipliers"]) == 2


def test_what_is_no_orbit() -> None:
    with pytest.raises(mechc.SimulationError, match="depends on time"):
        example("driven_pendulum").orbit()
    with pytest.raises(mechc.SimulationError, match="does not come near"):
        mechc.loads(DUFFING.format(start=1).replace("1/2*x^2 + 1/4*x^4", "-x")).orbit(stop=3)
    with pytest.raises(mechc.SimulationError, match="does not keep an energy"):
        example("van_der_pol_cycle").orbit(energy=1)


DAMPED = DUFFING.format(start=1).replace("experiment", "damping {b} on x; experiment")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (DAMPED.format(b=1), "comes back to is a state of rest, x = 0|comes to rest, x = 0"),
        (DAMPED.format(b=0.1), "comes back to is a state of rest, x = |comes to rest, x = 0"),
        (DUFFING.format(start=0), "comes to rest, x = 0: it has no period"),
    ],
)
def test_a_state_of_rest_is_no_orbit(text: str, words: str) -> None:
    with pytest.raises(mechc.SimulationError, match=words) as told:
        mechc.loads(text).orbit()
    assert "a damped motion that nothing drives ends at rest" in (told.value.help or "")


@pytest.mark.parametrize("study", ["orbit", "floquet", "lyapunov"])
def test_what_has_no_freedom_has_no_neighbours(study: str) -> None:
    """A four-bar whose crank is driven: what is left of changes is rounding, and was told as two directions."""
    settings: dict[str, Any] = {} if study == "lyapunov" else {"period": "2*pi/speed"}
    with pytest.raises(mechc.SimulationError, match="'FourBar' has no freedom"):
        example("four_bar").study(study, **settings)


def test_mathieu_edges() -> None:
    """Stability ends at the characteristic values a_n(q), b_n(q), which SciPy has."""
    found = mechc.loads(MATHIEU).floquet(period="pi", over="a = 0 .. 5, 101")
    q = 0.3
    expected = sorted(float(x) for x in (mathieu_b(1, q), mathieu_a(1, q), mathieu_b(2, q), mathieu_a(2, q)))
    edges = [edge for edge, _ in found.summary()["edges"]]
    assert edges == pytest.approx([e for e in expected if 0 < e < 5], abs=1e-6)


def test_a_vertically_driven_pendulum() -> None:
    """U89: multipliers at w = 2, edges of the main instability, critical damping, Kapitza's frequency; U90: its
    edges are those of Mathieu's equation with a = 4 w0^2/w^2, q = 2 a/r.

    Without damping the row prints 1.36711556, which is 1/0.73146706 and not the inverse of the other multiplier; SciPy
    gives 1.36711536 and 0.73146717.
    """
    model = example("vertically_driven_pendulum")
    for damping, multiplier in ((0.0, 1.36711536), (0.1, 1.16869772), (0.3, 0.853945)):
        found = model.floquet(period="2*pi/w", set={"gamma": damping}).summary()
        sizes = [abs(complex(*m)) for m in found["multipliers"]]
        assert max(sizes) == pytest.approx(multiplier, abs=6e-9 if damping < 0.3 else 6e-7)
        product = np.prod([complex(*m) for m in found["multipliers"]])
        assert product == pytest.approx(math.exp(-damping * math.pi), rel=1e-10)
    edges = model.floquet(period="2*pi/w", over="w = 1.7 .. 2.4, 29").summary()["edges"]
    assert [e for e, _ in edges] == pytest.approx([1.8296538, 2.2429139], abs=1e-7)
    mapped = [2 / math.sqrt(float(edge(1, 2 * 0.1))) for edge in (mathieu_a, mathieu_b)]
    assert [e for e, _ in edges] == pytest.approx(mapped, abs=1e-7)
    ((critical, _),) = model.floquet(period="2*pi/w", over="gamma = 0.1 .. 0.3, 5").summary()["edges"]
    assert critical == pytest.approx(0.19956586, abs=1e-8)
    ((kapitza, _),) = model.floquet(
        period="2*pi/w", over="w = 14 .. 14.4, 5", experiment="inverted"
    ).summary()["edges"]
    assert kapitza == pytest.approx(14.17289, abs=6e-6)


def test_a_chart_and_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, picture = tmp_path / "mathieu.mech", tmp_path / "chart.png"
    file.write_text(MATHIEU, encoding="utf-8")
    over = "a = 0.5 .. 1.5, 5, q = 0.1 .. 0.4, 3"
    assert run_command(["study", "floquet", str(file), "--period", "pi", "--over", over, "--json", "--plot", str(picture)]) == 0  # fmt: skip
    found = json.loads(capsys.readouterr().out)
    largest = np.array(found["largest"])
    assert largest.shape == (5, 3) and picture.exists()
    a, q = np.meshgrid(np.linspace(0.5, 1.5, 5), np.linspace(0.1, 0.4, 3), indexing="ij")
    inside = (a > mathieu_b(1, q)) & (a < mathieu_a(1, q))
    assert ((largest > 1 + 1e-6) == inside).all()


def test_a_motion_that_does_not_come_back_is_told() -> None:
    found = mechc.loads(DUFFING.format(start=1)).floquet(period=1)
    assert not found.summary()["returns"] and "does not come back" in found.remarks[0]


BALL = """\
model Ball "bounces on a table that vibrates"
  dimensionless;
  parameter e = 0.8;
  parameter A = 0.03;
  parameter w = 2*pi;
  parameter late = 0.05;
  coordinate z = A*sin(w*late);
  initial der(z) = 1/2;
  kinetic 1/2*der(z)^2;
  potential z;
  contact z - A*sin(w*(time + late)) restitution e;
  experiment(stop = 3);
end Ball;
"""


def test_a_ball_on_a_vibrating_table() -> None:
    """Once in a period T = 1 it leaves with T/2 = v and meets the table at rates that the law of impact joins:
    v = e v + (1 + e) A w cos(phase). Multipliers: det = e^2, trace from the map of impacts by hand."""
    e, rise, w = 0.8, 0.03, 2 * math.pi
    phase = math.acos((1 - e) / (1 + e) * 0.5 / (rise * w))
    model = mechc.loads(BALL)
    late = phase / w - 0.3  # begins between two impacts
    z0 = rise * math.sin(phase) + 0.5 * 0.7 - 0.7**2 / 2
    found = model.orbit(period=1, set={"late": late, "z": z0, "der(z)": 0.5 - 0.7}).summary()
    assert found["period"] == 1.0
    product = np.prod([complex(*m) for m in found["multipliers"]])
    assert product == pytest.approx(e**2, rel=1e-7)
    # in the time of an impact s and the speed v after it: s' = s + f, v' = -e (v - f) + (1 + e) A w cos(w s'), where
    # v f - f^2/2 + A sin(w s) = A sin(w s')
    up, fall = rise * w * math.cos(phase), -rise * w**2 * math.sin(phase)
    v, flight = 0.5, 1.0
    landing = v - flight - up  # relative speed before the impact, negative
    ds = np.array([-(up - (v - flight)) / landing, -flight / landing])  # d(s')/d(s, v), s' = s + f
    ds = np.array([(v - flight - up) / landing, -flight / landing])
    dv = np.array([e * (ds[0] - 1), -e + e * ds[1]]) + (1 + e) * fall * ds
    trace = ds[0] + dv[1]
    assert sum(complex(*m) for m in found["multipliers"]) == pytest.approx(trace, abs=1e-6)


OSCILLATOR = """\
model Impacting "oscillator that is driven against a stop"
  dimensionless;
  parameter e = 0.8;
  parameter w = 2.5;
  parameter late = 0;
  coordinate x = 0.1;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  force cos(w*(time + late)) on x;
  contact x restitution e;
  experiment(stop = 3);
end Impacting;
"""


@pytest.mark.parametrize(("e", "w"), [(0.8, 2.5), (0.6, 2.2)])
def test_an_impact_oscillator(e: float, w: float) -> None:
    """x'' + x = cos(w t) above a stop at 0, one impact in each period, all in closed form: between impacts
    x = C cos(t - s) + S sin(t - s) + P cos(w t), and the multipliers are those of the map (s, v) -> (s', v') of impacts."""
    force, turn = 1 / (1 - w * w), 2 * math.pi / w
    c, s = math.cos(turn), math.sin(turn)
    swing = -(1 - c) / s  # S over P cos(w s), so that it comes back to the stop after a period
    # P w sin(w s) over P cos(w s), so that it leaves as before
    lean = (swing * (1 + e * c) + e * s) / (1 + e)
    begin = math.atan2(lean / w, 1.0) / w
    a = force * math.cos(w * begin)
    v = (swing - lean) * a
    assert v > 0
    big, small = swing * a, -a  # S, C
    ds = force * w * w * math.cos(w * begin)
    dc = force * w * math.sin(w * begin)
    landing = -small * s + big * c - dc
    place = np.array([dc * c + ds * s + small * s - big * c, s])  # d x(t)/d(s, v) at the time of the impact
    rate = np.array([-dc * s + ds * c + small * c + big * s, c])
    later = -place / landing
    leaving = -e * (rate + math.cos(w * begin) * later)
    trace, det = later[0] + leaving[1], later[0] * leaving[1] - later[1] * leaving[0]
    assert det == pytest.approx(e * e, rel=1e-12)
    half = 0.4 * turn  # begin between two impacts
    x = small * math.cos(half) + big * math.sin(half) + force * math.cos(w * (begin + half))
    rate_there = -small * math.sin(half) + big * math.cos(half) - force * w * math.sin(w * (begin + half))
    found = (
        mechc.loads(OSCILLATOR)
        .orbit(period=turn, set={"e": e, "w": w, "late": begin + half, "x": x, "der(x)": rate_there})
        .summary()
    )
    assert found["start"]["x"] == pytest.approx(x, abs=1e-9)
    multipliers = [complex(*m) for m in found["multipliers"]]
    assert sum(multipliers) == pytest.approx(trace, abs=1e-8)
    assert np.prod(multipliers) == pytest.approx(e * e, abs=1e-8)


CHAIN = """\
model Chain
  parameter m = 2 kg;
  parameter k = 10 N/m;
  coordinate x1 = 1 cm;
  coordinate x2 = 2 cm;
  coordinate x3 = 3 cm;
  kinetic 1/2*m*(der(x1)^2 + der(x2)^2 + der(x3)^2);
  potential 1/2*k*(x1^2 + (x2 - x1)^2 + (x3 - x2)^2 + x3^2);
end Chain;
"""


def test_a_free_body_is_neither_stable_nor_unstable() -> None:
    """Euler's top is integrable: every multiplier is 1, in blocks of two that share a vector, and errors part them."""
    text = """
model Free
  coordinate Rotation R = rotz(30 deg)*rotx(20 deg);
  initial der(R) = {1, 2, 0.1} rad/s;
  frame body = world*R;
  inertia diag({1, 2, 3} kg.m^2) on body;
  experiment(stop = 10 s);
end Free;
"""
    found = mechc.loads(text).orbit()
    multipliers = np.array(found.details["multipliers"]) @ (1, 1j)
    assert found.details["stable"] is None and "neutral" in found.message
    assert (np.abs(multipliers - 1) <= found.details["multiplier_errors"]).all()


def test_the_least_period_is_told() -> None:
    """A chain comes near to its start after six swings of its slowest mode, 2 pi/sqrt(5 (2 - sqrt 2)) s each."""
    found = mechc.loads(CHAIN).orbit().summary()
    least = 2 * math.pi / math.sqrt(5 * (2 - math.sqrt(2)))
    assert found["period"] == pytest.approx(least, rel=1e-10)
    phases = [math.sqrt(5 * (2 + sign * math.sqrt(2))) * least for sign in (0, 1)]
    exact = sorted([1.0, 1.0, *(math.cos(p) for p in phases for _ in range(2))])
    assert sorted(m[0] for m in found["multipliers"]) == pytest.approx(exact, abs=1e-6)


def test_a_multiple_of_the_period_is_told_as_the_period() -> None:
    """Van der Pol's cycle, asked for with guesses of four and of 26 times its period: the multiplier is that of one round."""
    model = example("van_der_pol_cycle")
    once = model.orbit().summary()
    for many in (4, 26):
        found = model.orbit(period=many * 6.6633, set=once["start"]).summary()
        assert found["period"] == pytest.approx(once["period"], rel=1e-11)
        assert found["multipliers"][1][0] == pytest.approx(once["multipliers"][1][0], abs=1e-9)
    followed = model.orbit(period=3 * 6.6633, set=once["start"], over="mu = 1 .. 1.1, 2").summary()
    assert followed["orbits"][0]["period"] == pytest.approx(once["period"], rel=1e-9)


def test_the_cycle_of_a_block_on_a_belt() -> None:
    """It slips from k x = fs, on a circle about fk/k, until it is as fast as the belt, and sticks for the rest: the same period from
    each start, and nothing of a change is left after a stick. It begins at rest on the belt, where there is no derivative."""
    model = example("stick_slip_belt")
    for fs, u in ((2.943, 1.962), (3.924, 0.981)):
        found = model.orbit(set={"fs": fs, "u": u}).summary()
        off = fs - 1.962
        assert found["period"] == pytest.approx(2 * math.pi - 2 * math.atan(off / u) + 2 * off / u, rel=1e-10)
        radius = math.hypot(found["start"]["x"] - 1.962, found["start"]["der(x)"])
        assert radius == pytest.approx(math.hypot(off, u), rel=1e-9)
        one, other = (abs(complex(*pair)) for pair in found["multipliers"])
        assert one == pytest.approx(1, abs=1e-8) and other < 1e-8
        assert found["stable"]


@pytest.mark.parametrize("stop", [30, 45, 60])
def test_the_cycle_is_found_where_the_longest_stretch_sticks(stop: int) -> None:
    """It sticks from x = 0 until k x = fs, for 1 N/(1 N/m*0.2 m/s), and slips on a circle of the radius sqrt(0.5^2 + 0.2^2)."""
    text = f"""
model Belt
  parameter u = 0.2 m/s;
  coordinate Length x = 0 m;
  initial der(x) = u;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*1 N/m*x^2;
  friction 0.5 N static 1 N on x - u*time;
  experiment(stop = {stop} s);
end Belt;
"""
    found = mechc.loads(text).orbit()
    exact = 1 / 0.2 + 2 * (math.pi - math.atan2(0.5, 0.2))
    assert found["period"] == pytest.approx(exact, rel=1e-10) and found.details["stable"]


def test_the_cycle_on_a_belt_with_friction_that_falls_with_the_speed() -> None:
    """It slips by x'' = 2 - x + 0.2 x' from x = 2.2, where x' is that of the belt, until it is again; then it sticks."""

    def fast(t: float, y: np.ndarray) -> float:
        return float(y[1] - 1) if t > 0.1 else -1.0

    fast.terminal = True  # type: ignore[attr-defined]
    slip = solve_ivp(
        lambda t, y: [y[1], 2 - y[0] + 0.2 * y[1]], (0, 20), [2.2, 1], "DOP853", events=fast, rtol=1e-12, atol=1e-12
    )  # fmt: skip
    period = slip.t[-1] + 2.2 - slip.y[0, -1]
    assert example("belt_with_rosin").orbit().summary()["period"] == pytest.approx(period, rel=1e-10)


@pytest.mark.parametrize(
    ("name", "period", "multiplier"),
    [
        ("thermostat", 1200 * (math.log(22 / 18) + math.log(22 / 18)), 0.0),
        # coasts from 0.04 to -0.04 rad at 0.005 rad/s, then a pulse of M/J turns the rate back
        ("relay_attitude", 2 * (0.08 / 0.005 + 2 * 0.005 / 0.1), None),
    ],
)
def test_cycles_that_are_small_beside_the_way_to_them(
    name: str, period: float, multiplier: float | None
) -> None:
    found = example(name).orbit().summary()
    assert found["period"] == pytest.approx(period, rel=1e-10)
    if multiplier is not None:
        assert min(abs(complex(*pair)) for pair in found["multipliers"]) == pytest.approx(
            multiplier, abs=1e-9
        )


RUBBED = """\
model Rubbed
  dimensionless;
  parameter w = 0.5;
  coordinate x = 0.7;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  force cos(w*time) on x;
  friction rub: 0.4 on x;
end Rubbed;
"""


def rubbed(begin: float, y: np.ndarray, w: float, duration: float) -> np.ndarray:
    """The state after a time, by SciPy, piece by piece: while it rests, until |cos(w t) - x| passes 0.4."""
    t, stop, y = begin, begin + duration, np.array(y, dtype=float)
    while t < stop:
        push = math.cos(w * t) - y[0]
        if y[1] == 0 and abs(push) <= 0.4 * (1 + 1e-12):
            times = np.linspace(t, stop, 20001)[1:]
            beyond = np.flatnonzero(np.abs(np.cos(w * times) - y[0]) > 0.4)
            if not beyond.size:
                return y
            b = float(times[beyond[0]])
            a = max(t, float(b - (stop - t) / 20000))
            t = brentq(lambda s, x=y[0]: abs(math.cos(w * s) - x) - 0.4, a, b, xtol=1e-14) if a > t else b
            push = math.cos(w * (t + 1e-9)) - y[0]
        sign = math.copysign(1, y[1] if y[1] else push)

        def turns(s: float, y: np.ndarray, begun: float = t, sign: float = sign) -> float:
            return float(y[1]) if s > begun + 1e-4 else sign

        turns.terminal = True  # type: ignore[attr-defined]
        found = solve_ivp(
            lambda s, y, sign=sign: [y[1], math.cos(w * s) - y[0] - 0.4 * sign],
            (t, stop), y, "DOP853", events=turns, rtol=1e-12, atol=1e-13, max_step=0.1,
        )  # fmt: skip
        t, y = float(found.t[-1]), found.y[:, -1].copy()
        if found.status == 1:
            y[1] = 0.0
    return y


def test_a_driven_orbit_is_told_where_it_slips() -> None:
    """Where its motion begins it sticks; the period comes back by SciPy, and of a change the share of the multiplier is left."""
    found = mechc.loads(RUBBED).orbit(period=4 * math.pi)
    told = found.summary()
    assert "where the motion begins, it sticks or switches" in " ".join(found.remarks)
    start = np.array([told["start"]["x"], told["start"]["der(x)"]])
    end = rubbed(told["begin"], start, 0.5, 4 * math.pi)
    assert end == pytest.approx(start, abs=1e-9)
    changes = [(rubbed(told["begin"], start + d, 0.5, 4 * math.pi) - end) / 1e-5 for d in 1e-5 * np.eye(2)]
    largest = np.abs(np.linalg.eigvals(np.column_stack(changes))).max()
    assert abs(complex(*told["multipliers"][0])) == pytest.approx(largest, abs=1e-4)
