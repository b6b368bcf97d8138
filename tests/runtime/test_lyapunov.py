"""Lyapunov exponents and volumes: against closed forms and the literature, and the intervals that they state."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from shared_models import example

import mechc
from mechc.runtime.numerics.growth_rates import estimated
from mechc.runtime.outcome import Outcome
from mechc.runtime.studies.kinds.lyapunov import kaplan_yorke


def test_lorenz() -> None:
    """0.9056 (Wolf and others 1985, Sprott); the sum is -(sigma + 1 + b) exactly."""
    found = example("lorenz").lyapunov(time=1000).summary()
    first, half = found["exponents"][0], found["confidence"][0]
    assert abs(first - 0.9056) < 1.5 * half and half < 0.03
    assert sum(found["exponents"]) == pytest.approx(-(10 + 1 + 8 / 3), rel=1e-6)
    assert abs(found["exponents"][1]) < 3 * found["confidence"][1]


def test_a_linear_system_has_its_eigenvalues() -> None:
    """x'' = -x - 0.3 x' has -0.15 twice; x' = 2 x has 2."""
    text = """\
model Linear
  dimensionless;
  coordinate x = 1;
  state s = 0;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  damping 0.3 on x;
  equation der(s) = -2*s;
  experiment(stop = 20);
end Linear;
"""
    found = mechc.loads(text).lyapunov(time=400).summary()
    assert found["exponents"] == pytest.approx([-0.15, -0.15, -2], abs=3e-3)
    assert sum(found["exponents"]) == pytest.approx(-2.3, abs=1e-7)
    one = mechc.loads(text).lyapunov(time=400, count=1).summary()
    assert len(one["exponents"]) == len(one["confidence"]) == 1


def test_regular_and_chaotic_motions_of_one_model() -> None:
    """Henon-Heiles: zero at E = 1/12; 0.13 at 1/6; pairs of opposite sign."""
    model = example("henon_heiles")
    regular = model.lyapunov(time=4000)
    assert regular.message.startswith("regular: ") and "megno" in regular.message
    chaotic = model.lyapunov(time=4000, experiment="chaotic")
    exponents, halves = np.array(chaotic.summary()["exponents"]), chaotic.summary()["confidence"]
    assert abs(exponents[0] - 0.128) < 2 * halves[0] and halves[0] < 0.06
    assert np.abs(exponents + exponents[::-1]).max() < 1e-3
    assert any("pairs" in remark for remark in chaotic.remarks)


def test_a_pendulum_with_constraints_has_two_exponents() -> None:
    found = example("pendulum_cartesian").lyapunov(time=200).summary()
    assert len(found["exponents"]) == 2 and max(map(abs, found["exponents"])) < 0.05


def test_intervals_hold_their_promise() -> None:
    """Means over batches of correlated noise: the true mean is in the interval of 95 % in at least 90 of 100 cases."""
    random = np.random.default_rng(5)
    held = 0
    for _ in range(100):
        noise = np.zeros(4000)
        shocks = random.standard_normal(4000)
        for k in range(1, 4000):
            noise[k] = 0.8 * noise[k - 1] + shocks[k]
        growth = np.cumsum(0.7 + noise)[:, None]
        means, halves = estimated(np.arange(4000.0), growth)
        held += abs(means[0] - 0.7) <= halves[0]
    assert held >= 90


def test_too_short() -> None:
    found = example("lorenz").lyapunov(time=1)
    assert found.outcome is Outcome.FAILED and "longer" in found.message


def test_volumes() -> None:
    """exp(-c t/m) of a damped mass; 1 with a mass that depends on the place, where velocities alone would not do."""
    damped = mechc.loads(
        "model M dimensionless; coordinate x = 1; kinetic der(x)^2; potential sin(x); damping 0.5 on x; "
        "experiment(stop = 3); end M;"
    ).volume()
    assert damped["ratio"] == pytest.approx(math.exp(-0.25 * 3), rel=1e-9)
    assert not damped.summary()["preserved"]
    bent = mechc.loads(
        "model M dimensionless; coordinate x = 1; kinetic (1 + x^2)/2*der(x)^2; potential x^4; "
        "experiment(stop = 2.2); end M;"
    ).volume()
    assert bent["ratio"] == pytest.approx(1, abs=1e-9) and bent.summary()["preserved"]
    lorenz = example("lorenz").volume(stop=1)
    assert lorenz["rate"] == pytest.approx(-(10 + 1 + 8 / 3), rel=1e-7)
    with pytest.raises(mechc.SimulationError, match="constraints"):
        example("pendulum_cartesian").volume()


@pytest.mark.parametrize("length", [50, 200, 1000])
def test_neighbours_that_part_in_proportion_to_time_are_not_chaotic(length: float) -> None:
    """Swings of a pendulum have periods that depend on their energy: the growth is linear, and the exponent zero."""
    swing = (
        "model P dimensionless; parameter L = 2; coordinate a = 0.3; kinetic 1/2*L^2*der(a)^2; "
        "potential -9.81*L*cos(a); end P;"
    )
    found = mechc.loads(swing).lyapunov(time=length)
    assert found.message.startswith("regular: ")
    for exponent, half in zip(found.summary()["exponents"], found.summary()["confidence"], strict=True):
        assert abs(exponent) <= half


def test_powers_of_time_are_told_from_exponentials() -> None:
    """Exact growths: t^k for k = 1 to 6, and t^-3/2 as of decays without a rate, are zero; exp(0.05 t) is not, nor exp(-0.05 t)."""
    times = np.linspace(0, 400, 2001)
    powers = np.array([-1.5, 1, 2, 3, 4, 6])
    means, halves = estimated(times, np.log1p(3 * times)[:, None] * powers)
    assert (np.abs(means) <= halves).all()
    rates = np.array([0.05, -0.05])
    means, halves = estimated(times, times[:, None] * rates)
    assert means == pytest.approx(rates) and (halves < 0.01).all()


@pytest.mark.parametrize(
    ("name", "settings", "says"),
    [
        ("van_der_pol_cycle", {"time": 300}, "stable: one exponent is zero"),
        ("kepler", {"time": 300}, "regular: "),
        ("lorenz", {"time": 20}, "cannot be told from zero: it takes a longer --time"),
    ],
)
def test_what_exponents_near_zero_tell(name: str, settings: dict[str, float], says: str) -> None:
    """A limit cycle keeps one exponent of zero, an orbit of Kepler's parts from neighbours like t, and chaos takes time to be told."""
    assert says in example(name).lyapunov(**settings).message


def test_swings_of_short_chaotic_motions_are_no_fall() -> None:
    """Independent growths of mean 0.1 and deviation 0.5 over 300 times: few intervals are three times too
    wide. They were in 23 of 400 cases while a later half below 0.6 of the first, by chance, counted as a fall."""
    random, wide = np.random.default_rng(3), 0
    for _ in range(400):
        growth = np.concatenate([[0.0], np.cumsum(random.normal(0.1, 0.5, 300))])
        _, (half,) = estimated(np.arange(301.0), growth[:, None])
        wide += half > 3 * 1.96 * 0.5 / math.sqrt(270)
    assert wide <= 8


def test_no_motion_in_a_plane_is_chaotic() -> None:
    """On top of a hill neighbours part at the rate 1, and that is all."""
    found = mechc.loads("model H dimensionless; coordinate x = 0; kinetic 1/2*der(x)^2; potential -1/2*x^2; end H;").lyapunov(time=400)  # fmt: skip
    assert found.summary()["exponents"] == pytest.approx([1, -1], abs=0.02)
    assert "not chaotic" in found.message


def test_the_dimension_of_an_attractor() -> None:
    """Kaplan and Yorke: 2.0620 for Lorenz's equations, of which time along the motion is one; 2.6741 - 1 for Ueda's oscillator
    x'' + 0.05 x' + x^3 = 7.5 sin t, strobed (Sprott, Chaos and Time-Series Analysis, appendix A)."""
    found = example("lorenz").lyapunov(time=1000)
    assert found["dimension"] == pytest.approx(2.0620, abs=3e-3)
    ueda = mechc.loads("""\
model Ueda
  dimensionless;
  coordinate x = 2.5;
  kinetic 1/2*der(x)^2;
  potential x^4/4;
  damping 0.05 on x;
  force 7.5*sin(time) on x;
end Ueda;
""").lyapunov(time=6000)
    (error,) = (one.error for one in ueda.values if one.name == "dimension")
    assert error is not None and abs(ueda["dimension"] - 1.6741) < 1.5 * error < 0.2
    assert any("strobed" in remark for remark in ueda.remarks)


def test_regular_and_conservative_motions_have_no_such_dimension() -> None:
    found = example("lorenz").lyapunov(time=500, count=2)
    assert "dimension" not in [one.name for one in found.values]


@pytest.mark.parametrize(
    ("exponents", "dimension"),
    [
        ((0.5, 0.0, -2.0), 2.25),
        ((0.5, -1.0), 1.5),
        ((1.0, -0.25, -0.25, -4.0), 3.125),
        ((0.5, 0.1), None),
        ((-1.0, -2.0), None),
        ((0.2, 0.0, 0.0, -0.2 - 1e-12), None),
    ],
)
def test_kaplan_yorke(exponents: tuple[float, ...], dimension: float | None) -> None:
    found = kaplan_yorke(np.array(exponents), np.zeros(len(exponents)))
    assert (None if found is None else found[0]) == dimension


SHAKEN = """\
model Shaken "a block on a shaken table, held by a spring: it sticks and slips"
  dimensionless;
  coordinate x = 0.2;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  friction rub: 0.7 on x - 1.5*sin(0.7*time);
  experiment(stop = 50);
end Shaken;
"""


W, LIMIT = 0.7, 0.7


def table(t: float) -> tuple[float, float]:
    return 1.5 * math.sin(W * t), 1.5 * W * math.cos(W * t)


def slid(t: float, x: float, v: float, side: float, stop: float) -> tuple[float, float, float]:
    """Time, place and velocity of a slipping block where its slip vanishes, or at the stop, by SciPy."""

    def slip(s: float, y: Any) -> float:
        return float(y[1] - table(s)[1])

    def rates(s: float, y: Any) -> list[float]:
        return [y[1], -y[0] + LIMIT * side]

    slip.terminal = True  # type: ignore[attr-defined]
    accuracy = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
    ahead = min(t + 1e-3, stop)  # off the surface that it leaves
    near = solve_ivp(rates, (t, ahead), [x, v], **accuracy).y[:, -1]
    run = solve_ivp(rates, (ahead, stop), near, events=slip, **accuracy)
    return float(run.t[-1]), *run.y[:, -1]


def slips_at(t: float, offset: float, stop: float) -> float:
    """When the friction that holds a block reaches its limit; the stop where it does not."""

    def beyond(s: Any) -> Any:
        return np.abs(offset + 1.5 * (1 - W * W) * np.sin(W * s)) - LIMIT

    grid = np.linspace(t, stop, 4000)
    over = np.flatnonzero(beyond(grid) > 0)
    if not over.size:
        return stop
    return float(brentq(beyond, grid[over[0] - 1], grid[over[0]], xtol=1e-14)) if over[0] else t


def shaken(x: float, periods: int) -> float:
    """Where the block is after some periods, from rest on the table."""
    stop = periods * 2 * math.pi / W
    t, v, sticks = 0.0, table(0)[1], True
    while t < stop:
        if sticks:
            offset = x - table(t)[0]
            t = slips_at(t, offset, stop)
            x, v = offset + table(t)[0], table(t)[1]
            if t == stop:
                break
        side = math.copysign(1.0, x - W * W * table(t)[0])
        t, x, v = slid(t, x, v, side, stop)
        sticks = abs(x - W * W * table(t)[0]) <= LIMIT
    return x


def test_what_sticks_forgets() -> None:
    """Of a change of the velocity nothing is left where friction sticks; that of the place shrinks from period to period, by SciPy."""
    found = mechc.loads(SHAKEN).lyapunov(time=2000).summary()
    assert found["exponents"][1] is None and len(found["exponents"]) == 2
    assert any("1 of 2 exponents is minus infinity" in remark for remark in found["remarks"])
    settled, d = shaken(0.2, 8), 1e-5
    apart = (shaken(settled + d, 1) - shaken(settled - d, 1)) / (2 * d)
    exponent = math.log(abs(apart)) * 0.7 / (2 * math.pi)
    assert found["exponents"][0] == pytest.approx(exponent, abs=found["confidence"][0])


def test_a_belt_that_starts_where_it_sticks() -> None:
    """Its start lies on the very point where friction changes; on its cycle one exponent is zero."""
    found = example("stick_slip_belt").lyapunov()
    assert (
        found.message.startswith("stable: one exponent is zero")
        and found.message.count("minus infinity") == 1
    )
    first, second = found.summary()["exponents"]
    assert abs(first) < 1e-3 and second is None


def test_changes_of_which_nothing_is_left() -> None:
    found = mechc.loads("model M dimensionless; coordinate x = 0; initial der(x) = 1; kinetic 1/2*der(x)^2; friction 0.5 on x; experiment(stop = 20); end M;").lyapunov(time=100)  # fmt: skip
    assert found.summary()["exponents"][1] is None and abs(found.summary()["exponents"][0]) < 1e-6


def test_what_friction_brings_to_rest_is_told_so() -> None:
    """The places at which a block sticks lie beside each other: a change of its start moves it from one to another."""
    text = """
model Block
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*16 N/m*x^2;
  friction 0.3 N on x;
  experiment(stop = 5 s);
end Block;
"""
    begun = time.process_time()
    found = mechc.loads(text).lyapunov()
    assert "comes to rest" in found.message and "goes on" not in found.message
    assert found.details["exponents"][0] == 0 and found.details["exponents"][1] is None
    assert time.process_time() - begun < 20  # it took all of its 45 s, as nothing else ended it
