"""Heaps of balls that rest on each other: numbers find what statics, least squares and the formulas of few contacts find."""

from itertools import pairwise

import numpy as np
import pytest
from gallery import load
from scipy.integrate import quad
from scipy.optimize import nnls
from slow_params import slow_but

import mechc
from mechc.runtime.outcome import Outcome

R = 0.05
BALLS = """
parameter r = 5 cm;
parameter m[{n}] = {{{masses}}} kg;
coordinate Length x[{n}] = {{{x}}} m;
coordinate Length y[{n}] = {{{y}}} m;
for i in 1:{n} loop
  initial der(x[i]) = 0 m/s;
  initial der(y[i]) = 0 m/s;
  kinetic 1/2*m[i]*(der(x[i])^2 + der(y[i])^2);
  potential m[i]*9.81 m/s^2*(y[i]*cos({tilt}) + x[i]*sin({tilt}));
  contact low[i]: y[i] - r;
  for j in i+1:{n} loop
    contact hit[i,j]: norm({{x[i] - x[j], y[i] - y[j]}}) - 2*r;
  end for;
end for;
output ax[i in 1:{n}] = der(der(x[i]));
output ay[i in 1:{n}] = der(der(y[i]));
experiment(stop = 1 us);
"""


def pile(rows: int, rng: np.random.Generator) -> np.ndarray:
    """Balls in rows, each on two of the row below; the floor's have gaps between them, by which their places are random."""
    layer = [np.array([x, R]) for x in np.cumsum(2 * R * rng.uniform(1.02, 1.25, rows))]
    places = list(layer)
    while len(layer) > 1:
        above = []
        for a, b in pairwise(layer):
            d, middle = b - a, (a + b) / 2
            rise = np.sqrt(4 * R**2 - d @ d / 4)
            above.append(middle + rise * np.array([-d[1], d[0]]) / np.linalg.norm(d))
        layer = above
        places += layer
    return np.array(places)


@pytest.mark.parametrize("tilt", slow_but([0.3], [0.0, 0.3, 1.2]))
def test_accelerations_of_a_pile_are_those_of_least_constraint(tilt: float) -> None:
    """Gauss: a is the nearest to free fall, weighed by masses, that opens no contact; non-negative least squares of its dual."""
    rng = np.random.default_rng(7)
    places = pile(7, rng)
    n, mass = len(places), rng.uniform(0.5, 2, len(places))
    solution = mechc.loads(
        BALLS.format(
            n=n,
            masses=", ".join(map(repr, mass.tolist())),
            x=", ".join(map(repr, places[:, 0].tolist())),
            y=", ".join(map(repr, places[:, 1].tolist())),
            tilt=f"{tilt} rad",
        )
    ).simulate(estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    found = np.array([[solution[f"a{c}[{i + 1}]"][0] for c in "xy"] for i in range(n)])
    directions = [np.concatenate([np.zeros(2 * i), [0, 1], np.zeros(2 * (n - i - 1))]) for i in range(7)]
    for i in range(n):
        for j in range(i + 1, n):
            d = places[j] - places[i]
            if np.linalg.norm(d) < 2 * R + 1e-12:
                row = np.zeros(2 * n)
                row[2 * i : 2 * i + 2], row[2 * j : 2 * j + 2] = -d / (2 * R), d / (2 * R)
                directions.append(row)
    K, root = np.array(directions), np.repeat(np.sqrt(mass), 2)
    assert len(K) == 7 + 2 * 21
    free = np.tile([-9.81 * np.sin(tilt), -9.81 * np.cos(tilt)], n)
    force, _ = nnls((K / root).T, -root * free, maxiter=10000)
    expected = free + K.T @ force / root**2
    assert np.abs(expected).max() > 0.1
    assert np.allclose(found.ravel(), expected, rtol=0, atol=1e-8)


COLUMN = """
structural parameter Integer n = 70;
parameter m = 2 kg;
coordinate Length x[n] = {(i + 0.01*i) * 1 m for i in 1:n};
for i in 1:n loop
  kinetic 1/2*m*der(x[i])^2;
  potential m*10 m/s^2*x[i];
end for;
contact floor: x[1] - 1 m;
for i in 1:n-1 loop
  contact hit[i]: x[i+1] - x[i] - 1 m;
end for;
output bottom = multiplier(floor);
output middle = multiplier(hit[35]);
output top = multiplier(hit[69]);
experiment(stop = 1 s);
"""


def test_a_column_dropped_without_restitution_carries_its_weight() -> None:
    """Each falls 1 cm more than the one below and stops when it meets it, as that lies already."""
    solution = mechc.loads(COLUMN).simulate(estimate_error=False)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    assert [solution[name][-1] for name in ("bottom", "middle", "top")] == pytest.approx(
        [1400, 700, 20], rel=1e-11
    )
    assert [solution[f"x[{i}]"][-1] for i in (1, 35, 70)] == pytest.approx([1, 35, 70], rel=1e-11)
    end = solution.energy
    assert end is not None and end.dissipated is not None
    assert end.dissipated == pytest.approx(20 * 0.01 * 70 * 71 / 2, rel=1e-9)


BOX = """
structural parameter Integer n = {n};
structural parameter Integer idle = 0;
parameter r = 6 cm;
coordinate Length x[n] = {{{x}}} m;
coordinate Length y[n] = {{{y}}} m;
for i in 1:n loop
  initial der(x[i]) = 1 m/s*sin({seed}*i);
  kinetic 1/2*0.1 kg*(der(x[i])^2 + der(y[i])^2);
  potential 0.1 kg*9.81 m/s^2*y[i];
  contact left[i]: x[i] - r restitution 0.5;
  contact right[i]: 0.4 m - r - x[i] restitution 0.5;
  contact low[i]: y[i] - r restitution 0.5;
  for j in i+1:n loop
    contact hit[i,j]: norm({{x[i] - x[j], y[i] - y[j]}}) - 2*r restitution 0.5;
  end for;
end for;
for i in 1:idle loop
  contact far_off[i]: y[1] + 100 m*i;
end for;
experiment(stop = 2 s);
"""


@pytest.mark.parametrize("seed", slow_but([0], range(3)))
def test_heaps_of_few_balls_settle_as_formulas_have_it(seed: int) -> None:
    """The same model with and without contacts that never touch, from random starts; energies while balls still roll about."""
    rng = np.random.default_rng(seed)
    n = 3 + seed
    x, y = rng.uniform(0.1, 0.3, n), 0.2 + 0.15 * np.arange(n)
    text = BOX.format(
        n=n, x=", ".join(map(repr, x.tolist())), y=", ".join(map(repr, y.tolist())), seed=seed + 3
    )
    few = mechc.loads(text).simulate(estimate_error=False)
    many = mechc.loads(text.replace("idle = 0", "idle = 70")).simulate(estimate_error=False)
    assert few.outcome is many.outcome is Outcome.COMPLETED, (few.message, many.message)
    for i in range(n):
        for c in "xy":
            assert abs(few[f"{c}[{i + 1}]"][-1] - many[f"{c}[{i + 1}]"][-1]) < 1e-6
    end = many.energy
    assert end is not None and end.dissipated is not None
    assert abs(end.start - end.dissipated - end.end) < 1e-7 * end.start


DOMINOES = """
structural parameter Integer n = 20;
parameter H = 48 mm;
parameter w = 7.5 mm;
parameter d = 24 mm;
coordinate Angle lean[n] = 0 rad;
initial der(lean[1]) = 4 rad/s;
for i in 1:n loop
  kinetic 1/2*10 g*(H^2 + w^2)/3*der(lean[i])^2;
  potential 10 g*9.81 m/s^2*(H*cos(lean[i]) + w*sin(lean[i]))/2;
  contact stands[i]: lean[i];
  contact lies[i]: 90 deg - lean[i];
end for;
for i in 1:n-1 loop
  contact hits[i]: d*cos(lean[i+1]) - w - H*sin(lean[i] - lean[i+1])
    friction 0.2 along der(H*cos(lean[i] - lean[i+1]) - d*sin(lean[i+1]));
end for;
when lean[n] > 89 deg then terminate("the last has fallen"); end when;
experiment(stop = 5 s);
"""


def first_hit() -> float:
    """When the first domino meets the second one, by a quadrature."""
    H, w, d, g = 0.048, 0.0075, 0.024, 9.81
    inertia = (H**2 + w**2) / 3

    def rate(lean: float) -> float:
        fallen = (H * (1 - np.cos(lean)) - w * np.sin(lean)) / 2
        return float(np.sqrt(16 + 2 * g * fallen / inertia))

    first, _ = quad(lambda lean: 1 / rate(lean), 0, np.arcsin((d - w) / H))
    return float(first)


@pytest.mark.parametrize("n", [20, 50])
def test_a_row_of_dominoes_falls_in_a_time_that_converges(n: int) -> None:
    """Each turns about its foot; the corner of one slides on the face of the next. The first hit follows from a quadrature."""
    model = mechc.loads(DOMINOES.replace("n = 20", f"n = {n}"))
    runs = [model.simulate(estimate_error=False, tolerance=tolerance) for tolerance in (1e-6, 1e-9)]
    assert all(run.outcome is Outcome.TERMINATED for run in runs), [run.message for run in runs]
    assert runs[0].time[-1] == pytest.approx(runs[1].time[-1], rel=1e-4)
    assert runs[1].events[0].name == "hits[1]"
    assert runs[1].events[0].time == pytest.approx(first_hit(), rel=1e-8)
    for run in runs:
        end = run.energy
        assert end is not None and end.dissipated is not None and end.dissipated > 0.3 * end.start
        assert abs(end.start - end.dissipated - end.end) < 1e-6 * end.start


def test_a_short_row_falls_by_formulas_as_by_numbers() -> None:
    """The example, whose forces have formulas, and the same row beside contacts that never touch; the first hit by a quadrature."""
    few = load("dominoes").simulate(estimate_error=False)
    idle = "".join(f"contact far_off{i}: lean[1] + {i} rad;\n" for i in range(1, 71))
    text = DOMINOES.replace("n = 20", "n = 8").replace("for i in 1:n loop", idle + "for i in 1:n loop", 1)
    many = mechc.loads(text).simulate(estimate_error=False)
    assert few.outcome is many.outcome is Outcome.TERMINATED, (few.message, many.message)
    assert few.time[-1] == pytest.approx(many.time[-1], rel=1e-7)
    assert few.events[0].time == pytest.approx(first_hit(), rel=1e-8)


TWENTY = """
structural parameter Integer n = 20;
parameter r = 2 cm;
parameter a = 0.3 m;
parameter e = 0.5;
coordinate Length x[n] = {a*(0.5 + mod(i - 1, 5))/5 + 3 mm*sin(7*i) for i in 1:n};
coordinate Length y[n] = {a*(0.5 + floor((i - 1)/5))/5 + 3 mm*sin(5*i) for i in 1:n};
for i in 1:n loop
  kinetic 1/2*0.1 kg*(der(x[i])^2 + der(y[i])^2);
  potential 0.1 kg*9.81 m/s^2*y[i];
  contact left[i]: x[i] - r restitution e, rest = 1 cm/s;
  contact right[i]: a - r - x[i] restitution e, rest = 1 cm/s;
  contact low[i]: y[i] - r restitution e, rest = 1 cm/s;
  for j in i+1:n loop
    contact hit[i,j]: norm({x[i] - x[j], y[i] - y[j]}) - 2*r restitution e, rest = 1 cm/s;
  end for;
end for;
experiment(stop = 2 s);
"""


@pytest.mark.slow
def test_twenty_bouncing_balls_come_to_rest_in_a_close_packing() -> None:
    """Rigid patches, where contacts depend on each other: no gap opens downwards, energy balances, what lies is in equilibrium."""
    model = mechc.loads(TWENTY)
    lacks = []
    for tolerance in (1e-6, 1e-10):
        solution = model.simulate(estimate_error=False, tolerance=tolerance)
        assert solution.outcome is Outcome.COMPLETED, solution.message
        place = np.array([[solution[f"{c}[{i}]"][-1] for c in "xy"] for i in range(1, 21)])
        speed = np.array([[solution[f"der({c}[{i}])"][-1] for c in "xy"] for i in range(1, 21)])
        assert np.abs(speed).max() < 1e-6
        apart = np.linalg.norm(place[:, None] - place[None], axis=2)[np.triu_indices(20, 1)] - 0.04
        gaps = np.concatenate([apart, place[:, 0] - 0.02, 0.28 - place[:, 0], place[:, 1] - 0.02])
        assert gaps.min() > -1e-8
        end = solution.energy
        assert end is not None and end.dissipated is not None
        assert end.supplied is not None
        told = solution.statistics
        assert f"{told.laid} times a contact that would have fallen back" in "".join(solution.remarks)
        # of each contact less than that of all balls at its rest of 1 cm/s, laid down with others
        assert told.laid_energy is not None and 0 < told.laid_energy < told.laid * 20 * 0.1 * 0.01**2 / 2
        assert end.supplied < 1e-7 * end.start  # gaps that were closed raise a heap, too
        lacks.append(abs(end.start + end.supplied - end.dissipated - end.end) / end.start)
        closed: list[tuple[int, int | None, np.ndarray]] = []
        for i in range(20):
            if place[i, 1] < 0.02 + 1e-7:
                closed.append((i, None, np.array([0.0, 1.0])))
            for wall, out in ((place[i, 0] - 0.02, 1.0), (0.28 - place[i, 0], -1.0)):
                if wall < 1e-7:
                    closed.append((i, None, np.array([out, 0.0])))
            for j in range(i + 1, 20):
                d = place[j] - place[i]
                if np.linalg.norm(d) < 0.04 + 1e-7:
                    closed.append((j, i, d / np.linalg.norm(d)))
        K = np.zeros((len(closed), 20, 2))
        for row, (ball, other, normal) in zip(K, closed, strict=True):
            row[ball] += normal
            if other is not None:
                row[other] -= normal
        weight = np.tile([0.0, 0.981], 20)
        _, unbalanced = nnls(K.reshape(len(closed), -1).T, weight, maxiter=10000)
        assert unbalanced < 1e-4
    assert lacks[0] < 1e-7 and lacks[1] < 1e-9, lacks


COLUMN_OF_THREE = """
structural parameter Integer n = 3;
structural parameter Integer idle = 70;
coordinate Length y[n] = {0.3 m, 0.55 m, 0.9 m};
for i in 1:n loop
  kinetic 1/2*(0.1 kg*i)*der(y[i])^2;
  potential 0.1 kg*i*9.81 m/s^2*y[i];
end for;
contact low: y[1] - 5 cm restitution 0.5;
for i in 1:n-1 loop
  contact hit[i]: y[i+1] - y[i] - 10 cm restitution 0.5;
end for;
for i in 1:idle loop
  contact far_off[i]: y[1] + 100 m*i;
end for;
experiment(stop = 3 s);
"""


def bounces(count: int) -> list[float]:
    """Times of hits of three balls above each other, by roots of quadratics; the fastest approach of those that touch first."""
    y, v, m, g, t = np.array([0.25, 0.4, 0.65]), np.zeros(3), np.array([0.1, 0.2, 0.3]), 9.81, 0.0
    times: list[float] = []
    while len(times) < count:
        waits = [(v[0] + np.sqrt(v[0] ** 2 + 2 * g * y[0])) / g]
        for i in range(2):
            rate, gap = v[i + 1] - v[i], y[i + 1] - y[i]
            waits.append(gap / -rate if rate < 0 else np.inf)
        k = int(np.argmin(waits))
        y, v, t = y + v * waits[k] - g * waits[k] ** 2 / 2, v - g * waits[k], t + waits[k]
        times.append(t)
        if k == 0:
            y[0], v[0] = 0.0, -v[0] / 2
        else:
            push = 1.5 * (v[k - 1] - v[k]) / (1 / m[k - 1] + 1 / m[k])
            v[k - 1] -= push / m[k - 1]
            v[k] += push / m[k]
            y[k] = y[k - 1]
    return times


def test_three_balls_above_each_other_bounce_when_quadratics_say_and_end_as_a_column() -> None:
    solution = mechc.loads(COLUMN_OF_THREE).simulate(estimate_error=False, tolerance=1e-10)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    hits = [e.time for e in solution.events if e.kind == "impact"]
    assert np.allclose(hits[:12], bounces(12), rtol=0, atol=1e-9)
    assert [solution[f"y[{i}]"][-1] for i in (1, 2, 3)] == pytest.approx([0.05, 0.15, 0.25], abs=1e-9)
    end = solution.energy
    assert end is not None and end.dissipated is not None
    assert end.dissipated == pytest.approx(0.981 * (0.25 + 2 * 0.4 + 3 * 0.65), rel=1e-8)
