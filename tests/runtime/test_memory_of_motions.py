"""Discrete variables that carry memory from one time to the next: linear maps against closed forms that share no code with mechc."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import mechc

Array = np.ndarray

SERVO = """\
model Servo
  parameter Time T = 100 ms;
  parameter Real k = 4;
  parameter Real d = 2;
  parameter Real F = 0;
  parameter Real n = 10;
  coordinate Length x = 0.1 m;
  discrete Length last = 0.1 m;
  discrete Length next = 0 m;
  discrete Force u = 0 N;
  kinetic 1/2*1 kg*der(x)^2;
  force u + F*1 N*cos(2*pi*time/(n*T)) on x;
  when sample(T, {offset}*T) then
    {late}
    last := x;
  end when;
  experiment(stop = 5 s, tolerance = 1e-11);
end Servo;
"""

AT_ONCE = "u := -k*1 N/m*x - d*1 N.s/m*(x - last)/T;"
LATER = "u := -k*1 N/m*next - d*1 N.s/m*(next - last)/T; last := next; next := x;"


def servo(offset: float = 0.0, *, later: bool = False) -> mechc.Model:
    text = SERVO.format(offset=offset, late=LATER if later else AT_ONCE)
    return mechc.loads(text.replace("    last := x;\n", "") if later else text)


def affine(
    k: float, d: float, n: int, force: float = 0.0, offset: float = 0.0, *, later: bool = False
) -> Array:
    """Give the map of (x, v, last, next, u, 1) over n samples of 0.1 s, from t = 0 on: ticks are at (j + offset) 0.1 s."""
    period = 0.1
    w = 2 * math.pi / (n * period)

    def flight(a: float, b: float) -> Array:
        m, h = np.eye(6), b - a
        m[0, 1], m[0, 4], m[1, 4] = h, h * h / 2, h
        m[1, 5] = force * (math.sin(w * b) - math.sin(w * a)) / w
        m[0, 5] = force * ((math.cos(w * a) - math.cos(w * b)) / w**2 - math.sin(w * a) * h / w)
        return m

    tick = np.eye(6)
    read = 3 if later else 0
    tick[4] = 0.0
    tick[4, read] = -k - d / period
    tick[4, 2] = d / period
    tick[2] = np.eye(6)[read]
    if later:
        tick[3] = np.eye(6)[0]
    whole, t = np.eye(6), 0.0
    for j in range(n):
        at = (j + offset) * period
        whole, t = tick @ flight(t, at) @ whole, at
    return flight(t, n * period) @ whole


def exact(*settings: float, later: bool = False, offset: float = 0.0) -> Array:
    """Give the multipliers, the largest first; variables that nothing reads are left out."""
    k, d, n = settings
    kept = [0, 1, 2, *([3] if later else []), *([4] if offset else [])]
    values = np.linalg.eigvals(affine(k, d, int(n), 0.0, offset, later=later)[np.ix_(kept, kept)])
    return values[np.argsort(-np.abs(values), kind="stable")]


def sorted_values(found: list[list[float]]) -> Array:
    values = np.array([complex(*one) for one in found])
    return values[np.argsort(-np.abs(values), kind="stable")]


def same(found: list[list[float]], wanted: Array, within: float) -> None:
    """Compare multipliers as roots of a polynomial, so that their order does not count."""
    values = sorted_values(found)
    assert len(values) == len(wanted), (values, wanted)
    assert np.abs(np.poly(values) - np.poly(wanted)).max() < within, (values, wanted)


@pytest.mark.parametrize(
    ("offset", "later", "samples"),
    [(0.0, False, 1), (0.0, False, 50), (0.37, False, 1), (0.0, True, 1), (0.6, True, 3)],
)
def test_multipliers_of_a_sampled_loop(offset: float, later: bool, samples: int) -> None:
    """The memory of the controller belongs to the map, and the held force where a period begins between samples."""
    found = servo(offset, later=later).floquet(period=0.1 * samples).summary()
    same(found["multipliers"], exact(4, 2, samples, offset=offset, later=later), 1e-11)


def test_the_edge_of_stability_of_a_sampled_loop() -> None:
    """Where the largest eigenvalue of the map is 1 in size, by bisection of the closed form."""
    found = servo().floquet(period=0.1, over="d = 5 .. 20, 6").summary()
    edge = brentq(lambda d: abs(exact(4, d, 1)[0]) - 1, 5, 20, xtol=1e-13)
    assert len(found["edges"]) == 1 and found["edges"][0][0] == pytest.approx(edge, rel=1e-8)
    wanted = [abs(exact(4, d, 1)[0]) for d in found["parameters"]["d"]]
    assert np.abs(np.array(found["largest"]) - wanted).max() < 1e-10


@pytest.mark.parametrize("offset", [0.0, 0.37])
def test_a_periodic_motion_comes_back_in_its_memory(offset: float) -> None:
    found = servo(offset).orbit(period="n*T", set={"F": 1, "n": 10}).summary()
    whole = affine(4, 2, 10, 1.0, offset)
    kept = [0, 1, 2, *([4] if offset else [])]
    start = np.linalg.solve(np.eye(len(kept)) - whole[np.ix_(kept, kept)], whole[kept, 5])
    names = ["x", "der(x)", "last", *(["u"] if offset else [])]
    assert list(found["start"]) == names
    assert np.abs(np.array([found["start"][name] for name in names]) - start).max() < 1e-10
    same(found["multipliers"], exact(4, 2, 10, offset=offset), 1e-11)
    assert not found["remarks"] and found["stable"]


@pytest.mark.slow
@pytest.mark.parametrize("offset", [0.0, 0.37])
def test_a_very_unstable_loop_in_pieces(offset: float) -> None:
    """Changes grow 1e9 times in a period: the pieces of the shooting begin at samples, and between them."""
    found = servo(offset).orbit(period="n*T", set={"k": 150, "F": 1, "n": 80}).summary()
    whole = affine(150, 2, 80, 1.0, offset)
    kept = [0, 1, 2, *([4] if offset else [])]
    start = np.linalg.solve(np.eye(len(kept)) - whole[np.ix_(kept, kept)], whole[kept, 5])
    sizes = np.array([1, 1, 1, *([150 + 2 / 0.1] if offset else [])])
    assert (np.abs(np.array(list(found["start"].values())) - start) < 1e-8 * sizes).all(), "of their sizes"
    largest = abs(sorted_values(found["multipliers"])[0])
    assert largest == pytest.approx(abs(exact(150, 2, 80)[0]), rel=1e-7)


def test_an_orbit_with_memory_is_followed() -> None:
    """Over d up to where the loop becomes unstable: its multipliers cross the unit circle there."""
    found = servo().orbit(period="n*T", set={"F": 1, "n": 9}, over="d = 15 .. 22, 4").summary()
    for one in found["orbits"]:
        wanted = exact(4, one["parameter"]["d"], 9)
        same(one["multipliers"], wanted, 1e-9 * max(1.0, abs(wanted[0])) ** 2)
    edge = brentq(lambda d: abs(exact(4, d, 1)[0]) - 1, 5, 20, xtol=1e-13)
    assert [one["kind"] for one in found["special"]] == ["torus"]
    assert found["special"][0]["value"] == pytest.approx(edge, rel=1e-8)


def test_exponents_of_a_sampled_loop() -> None:
    """ln|m|/T of each multiplier m of one sample, within the stated confidence; their sum is that of the volume."""
    found = servo().lyapunov(time=60).summary()
    wanted = np.log(np.abs(exact(4, 2, 1))) / 0.1
    assert (np.abs(np.array(found["exponents"]) - wanted) < found["confidence"]).all()
    assert max(found["confidence"]) < 0.4


def test_a_sample_sets_a_force_anew() -> None:
    """Between samples the held force is a state, of which a sample leaves nothing."""
    found = servo(0.37).lyapunov(time=60).summary()
    assert found["exponents"].pop() is None
    assert any("1 of 4 exponents is minus infinity" in remark for remark in found["remarks"])
    wanted = np.log(np.abs(exact(4, 2, 1))) / 0.1
    assert (np.abs(np.array(found["exponents"]) - wanted) < found["confidence"][:3]).all()
    found = servo(0.37).lyapunov(time=60, count=3).summary()
    wanted = np.log(np.abs(exact(4, 2, 1))) / 0.1
    assert (np.abs(np.array(found["exponents"]) - wanted) < found["confidence"]).all()


def test_the_volume_of_states_and_memory() -> None:
    found = servo().volume(stop=0.3).summary()
    assert found["ratio"] == pytest.approx(abs(np.linalg.det(affine(4, 2, 3)[:3, :3])), rel=1e-9)


STARTED = """\
model Started
  input Force f = 0 N;
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*3 N/m*x^2;
  damping 0.4 N.s/m on x;
  discrete Length last = 0 m;
  discrete Force u = 0 N;
  discrete {type} running = {off};
  when sample(0.2 s{offset}) then
    u := if {runs} then -4 N.s/m*(x - last)/0.2 s else 4 N/m*x;
    last := x;
    running := {on};
  end when;
  force u + f on x;
  experiment(stop = 20 s);
end Started;
"""
REAL = {"type": "Real", "off": "0", "on": "1", "runs": "running > 0"}
TYPES = [REAL, {"type": "Boolean", "off": "false", "on": "true", "runs": "running"}]
THIRD = {**REAL, "on": "min(running + 1, 3)", "runs": "running > 2"}


def started_map() -> Array:
    """Give the map of (x, v, last) over a sample and the 0.2 s behind it, once the controller runs."""
    flight = expm(np.array([[0, 1, 0], [-3, -0.4, 1], [0, 0, 0]]) * 0.2)[:2]
    force = np.array([-4 / 0.2, 0, 4 / 0.2])
    rows = [flight[i, :2] @ np.eye(3)[:2] + flight[i, 2] * force for i in (0, 1)]
    return np.array([*rows, [1.0, 0.0, 0.0]])


@pytest.mark.parametrize("kind", [*TYPES, THIRD])
def test_what_the_first_sample_does_once_is_not_that_of_every_period(kind: dict[str, str]) -> None:
    """A controller that begins otherwise than it goes on: its memory, which the first samples do not read, belongs to the map."""
    model, wanted = mechc.loads(STARTED.format(offset="", **kind)), np.linalg.eigvals(started_map())
    assert abs(wanted).max() == pytest.approx(0.87001032, rel=1e-7)
    for found in (model.floquet(period=0.2).summary(), model.orbit(period=0.2).summary()):
        same(found["multipliers"], wanted, 1e-11)
        assert found["stable"] and not any("does not come back" in said for said in found["remarks"])
    over = model.floquet(period=0.4, over="f = 0 .. 1, 2").summary()
    assert over["largest"] == pytest.approx([abs(wanted).max() ** 2] * 2, rel=1e-10)


def test_exponents_of_memory_that_the_first_sample_does_not_read() -> None:
    found = mechc.loads(STARTED.format(offset="", **REAL)).lyapunov(time=20, stop=5).summary()
    wanted = np.sort(np.log(np.abs(np.linalg.eigvals(started_map()))) / 0.2)[::-1]
    assert (np.abs(np.array(found["exponents"]) - wanted) < found["confidence"]).all()


@pytest.mark.parametrize("kind", [REAL, THIRD])
def test_the_response_of_a_loop_that_has_begun(kind: dict[str, str]) -> None:
    """A constant force f displaces it by f/k: the controller only damps. With its first sample, 4 N/m pull away from rest."""
    found = mechc.loads(STARTED.format(offset=", 0.1 s", **kind)).response(
        inputs="f", outputs="x", frequencies="{1e-6, 1e-5} Hz"
    )
    assert abs(found.response[0, 0, 0]) == pytest.approx(1 / 3, rel=1e-6)
    assert found.stable == (True,)


ALTERNATING = STARTED.replace("running := {on}", "running := if running > 0 then 0 else 1")


def test_a_discrete_variable_that_comes_back_after_two_periods_is_told() -> None:
    model = mechc.loads(ALTERNATING.format(offset="", **REAL))
    assert any("'running' does not come back" in said for said in model.floquet(period=0.2).remarks)
    assert not any("'running'" in said for said in model.floquet(period=0.4).remarks)


KICKED = """\
model Kicked
  dimensionless;
  coordinate x = 0;
  discrete Integer kicks = 0;
  discrete Real share = 0.5;
  discrete Real seen = 0;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  when sample(1) then
    reinit(der(x), share*der(x));
    kicks := kicks + 1;
    seen := seen + x;
  end when;
  experiment(stop = 1);
end Kicked;
"""


def test_what_is_constant_or_read_by_nothing_adds_no_multiplier() -> None:
    """A kick at both ends of a period counts once: the map is flow times kick. A count that goes on is told."""
    found = mechc.loads(KICKED).floquet(period=2).summary()
    turn = np.array([[math.cos(1), math.sin(1)], [-math.sin(1), math.cos(1)]]) @ np.diag([1, 0.5])
    same(found["multipliers"], np.linalg.eigvals(turn @ turn), 1e-10)
    assert found["returns"] and len(found["remarks"]) == 1
    assert "'kicks' does not come back after this time, it goes from 0 to 2" in found["remarks"][0]


BOUNCING = """\
model Bouncing
  dimensionless;
  parameter b = 0.49;
  coordinate z = 0.5;
  initial der(z) = 0;
  discrete Real last = 1;
  discrete Integer n = 0;
  discrete Real arrived = 0;
  kinetic 1/2*der(z)^2;
  force -1 on z;
  when z < 0 then
    arrived := -der(z);
    reinit(der(z), 0.51 + b*last);
    last := arrived;
    n := n + 1;
  end when;
  experiment(stop = 10);
end Bouncing;
"""


def test_a_ball_whose_throws_remember() -> None:
    """It is thrown up with 0.51 + b times the speed with which it arrived the time before: multipliers 1 and the roots of b."""
    found = mechc.loads(BOUNCING).orbit(period=2.1).summary()
    assert found["period"] == pytest.approx(2, rel=1e-9)
    assert found["start"]["last"] == pytest.approx(1, rel=1e-9)
    same(found["multipliers"], np.array([1.0, 0.7, -0.7]), 1e-7)
    assert any("'n' does not come back" in said for said in found["remarks"])


SWITCHED = """\
model Switched
  dimensionless;
  parameter a = 0.3;
  parameter b = -0.8;
  state w = 0.2;
  state y = 0;
  discrete Real m = 0;
  equation der(w) = m - w;
  equation der(y) = 1 + 0*w;
  when y > 1 then
    reinit(y, y - 1);
    m := a*m + b*w + 1;
  end when;
  experiment(stop = 10);
end Switched;
"""


def test_a_switched_integrator_with_memory() -> None:
    """Once in a unit of time, in whose middle it begins, m goes to a m + b w + 1; w goes to m exponentially."""
    a, b = 0.3, -0.8
    jump = np.array([[1, 0], [b, a]])
    half = np.array([[math.exp(-0.5), 1 - math.exp(-0.5)], [0, 1]])
    found = mechc.loads(SWITCHED).floquet(period=1, set={"y": 0.5}).summary()
    same(found["multipliers"], np.append(np.linalg.eigvals(half @ jump @ half), 1.0), 1e-8)


ONCE = """\
model Once
  dimensionless;
  coordinate x = 1;
  discrete Real last = 0;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  force -0.3*last - 0.1*der(x) on x;
  when initial() then
    last := x;
    reinit(der(x), 2*x);
  end when;
  when sample(1, {offset}) then
    last := 0.5*last + x;
  end when;
  experiment(stop = 4);
end Once;
"""


@pytest.mark.parametrize("offset", [0.0, 0.5])
def test_what_happens_once_at_the_start_is_no_part_of_a_period(offset: float) -> None:
    flight = np.array([[0, 1, 0], [-1, -0.1, -0.3], [0, 0, 0]])
    tick = np.array([[1, 0, 0], [0, 1, 0], [1, 0, 0.5]])
    found = mechc.loads(ONCE.format(offset=offset)).floquet(period=1).summary()
    same(
        found["multipliers"],
        np.linalg.eigvals(expm(flight * (1 - offset)) @ tick @ expm(flight * offset)),
        1e-10,
    )


MOVED = """\
model Moved
  dimensionless;
  discrete Real place = 0;
  coordinate x = 1;
  coordinate z ~ 0;
  kinetic 1/2*(der(x)^2 + der(z)^2);
  potential 1/2*x^2;
  constraint z = place + x;
  when sample(1) then
    place := 0.5*x;
  end when;
  experiment(stop = 2);
end Moved;
"""


def test_memory_that_moves_a_constraint_is_refused() -> None:
    with pytest.raises(mechc.SimulationError, match="'place' moves a constraint"):
        mechc.loads(MOVED).floquet(period=1)


def test_stability_is_not_told_of_a_motion_with_impacts_that_does_not_come_back() -> None:
    model = mechc.loads(
        "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*x^2; damping 0.1 N.s/m on x;"
        "force 1 N*cos(2.8 rad/s*time) on x; contact wall: x restitution 0.8; experiment(stop = 5 s);"
    )
    found = model.floquet(period="2.2439947525641 s")
    assert found.details["stable"] is None and not found.details["returns"]
    assert "no period of the motion" in found.message
