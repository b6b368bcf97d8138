"""More than 64 rows of contacts beside joints, drives, turned worlds, small sizes, ``when``, ensembles and inputs, against closed forms
and steps in NumPy."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import Outcome

ALONE: dict[str, Any] = {"estimate_error": False}
G = 9.81

# ---------------------------------------------------------------- joints between what touches

LINKS, LENGTH, MASS, LIMIT = 34, 0.1, 0.2, 0.03
CHAIN = f"""
import mech.planar.*;
gravity {{0, -{G}}} m/s^2;
Bar bar[{LINKS}](m = {MASS} kg, l = {LENGTH} m);
Revolute first(world -> bar[1].a, angle = -60 deg);
Revolute hinge[i in 1:{LINKS - 1}](bar[i].b -> bar[i+1].a, angle = 0.02*sin(i));
for i in 1:{LINKS - 1} loop
  initial der(hinge[i].angle) = 6 rad/s*cos(3*i);
  contact high[i]: {LIMIT} - hinge[i].angle;
  contact low[i]: {LIMIT} + hinge[i].angle;
end for;
experiment(stop = 60 ms, method = "moreau", step = 1 ms, tolerance = 1e-12);
"""


def chain_rates(q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Give the mass matrix of the relative angles of a chain of bars, and the accelerations without contacts."""
    a, w = np.cumsum(q), np.cumsum(v)
    along, across = np.array([np.cos(a), np.sin(a)]), np.array([-np.sin(a), np.cos(a)])
    mass, force = np.zeros((LINKS, LINKS)), np.zeros(LINKS)
    for i in range(LINKS):
        share = np.where(np.arange(LINKS) < i, LENGTH, np.where(np.arange(LINKS) == i, LENGTH / 2, 0))
        jacobian = across * share  # of the centre, by absolute angles
        bias = -(along * share) @ w**2
        turn = np.zeros(LINKS)
        turn[i] = 1
        mass += MASS * jacobian.T @ jacobian + MASS * LENGTH**2 / 12 * np.outer(turn, turn)
        force += MASS * jacobian.T @ (np.array([0, -G]) - bias)
    relative = np.tril(np.ones((LINKS, LINKS)))
    mass, force = relative.T @ mass @ relative, relative.T @ force
    return mass, np.linalg.solve(mass, force)


def stepped_chain(steps: int, h: float) -> tuple[np.ndarray, np.ndarray]:
    i = np.arange(1, LINKS)
    q = np.concatenate([[-np.pi / 3], 0.02 * np.sin(i)])
    v = np.concatenate([[0.0], 6 * np.cos(3 * i)])
    rows = np.concatenate([-np.eye(LINKS)[1:], np.eye(LINKS)[1:]])
    for _ in range(steps):
        qm, begin = q + h / 2 * v, v
        for _pass in range(40):  # until the forces are those at the mean of both velocities
            mass, middle = chain_rates(qm, (begin + v) / 2)
            free = begin + h * middle
            gaps = LIMIT + rows @ qm
            near = gaps <= 0.02
            k, offsets = rows[near], 2 * np.maximum(0.0, gaps[near]) / h
            w = k @ np.linalg.solve(mass, k.T)
            target = k @ free + offsets
            r = np.zeros(len(k))
            for _sweep in range(20000):
                before = r.copy()
                for j in range(len(k)):
                    r[j] = max(0.0, r[j] - (w[j] @ r + target[j]) / w[j, j])
                if np.abs((r - before) * np.diag(w)).max() < 1e-14:
                    break
            last, v = v, free + np.linalg.solve(mass, k.T @ r)
            if np.abs(v - last).max() < 1e-12:
                break
        q = qm + h / 2 * v
    return q, v


@pytest.mark.slow
def test_links_of_a_chain_that_stop_each_other() -> None:
    """Neighbours are joined and touch: the responses of all 33 stops are coupled by the chain."""
    solution = mechc.loads(CHAIN).simulate(**ALONE)
    q, v = stepped_chain(60, 1e-3)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    names = ["first.angle", *(f"hinge[{i}].angle" for i in range(1, LINKS))]
    assert solution["energy.dissipated"][-1] > 1e-3
    assert np.abs(np.array([solution[n][-1] for n in names]) - q).max() < 1e-8
    assert np.abs(np.array([solution[f"der({n})"][-1] for n in names]) - v).max() < 1e-6


# ---------------------------------------------------------------- what is driven

PLATE = """
structural parameter Integer n = 70;
parameter A = 2 mm;
parameter w = 50 rad/s;
coordinate Length plate;
drive plate = A*sin(w*time);
coordinate Length y[n] = {0 m for i in 1:n};
for i in 1:n loop
  initial der(y[i]) = A*w/(1 rad);
  kinetic 1/2*0.1 kg*der(y[i])^2;
  potential 0.1 kg*9.81 m/s^2*y[i];
  contact on[i]: y[i] - plate;
end for;
output push = multiplier(on[7]);
experiment(stop = 0.1 s, method = "moreau", step = 0.1 ms, tolerance = 1e-10);
"""


def test_what_lies_on_a_driven_plate_goes_with_it() -> None:
    """A w^2 is half of g, so nothing lifts off. A step ends at the speed that the plate has in its middle, so all is half a step
    late: 0.05 ms times 0.2 m/s in places. The mean force of a step is m (g + acceleration) a step before, and the plate supplies the energy."""
    solution = mechc.loads(PLATE).simulate(**ALONE)
    t = solution.time
    moved = 2e-3 * np.sin(50 * t)
    assert np.abs(solution["y[70]"] - moved).max() < 1e-5
    push = 0.1 * (G - 2e-3 * 2500 * np.sin(50 * (t - 0.1e-3)))
    assert np.abs(solution["push"] - push)[2:].max() < 3e-3 * 0.1 * G
    speed = 0.1 * np.cos(50 * t)
    energy = 70 * 0.1 * (speed**2 / 2 + G * moved)
    supplied = solution["energy.supplied"]
    assert np.abs((supplied - supplied[0]) - (energy - energy[0])).max() < 70 * 0.1 * (
        G * 1e-5 + 0.1 * 5 * 0.05e-3
    )
    assert (
        np.abs(solution["energy.total"] + solution["energy.dissipated"] - supplied - energy[0]).max() < 1e-12
    )


# ---------------------------------------------------------------- turned, and small

BALLS = """
import mech.planar.*;
import mech.shapes.*;
parameter d = D;
parameter tilt = TILT;
gravity {G*sin(tilt), -G*cos(tilt)};
Disk ball[16](r = 4/9*d, m = 0.1 kg);
frame base = world * rot(tilt);
Free free[i in 1:16](base -> ball[i].a, x = d*(0.5 + mod(i - 1, 4)) + d/20*sin(7*i),
  y = d*(0.5 + floor((i - 1)/4)) + d/20*sin(5*i));
shape Sphere(r = 4/9*d) on ball;
shape floor: Plane on base;
contact ball[*] with ball[*], floor friction 0.3 restitution 0.5;
experiment(stop = STOP, method = "moreau", step = STOP/80, tolerance = 1e-12);
"""


def balls(d: str = "4.5 cm", tilt: str = "0 deg", stop: str = "80 ms") -> str:
    text = BALLS.replace("STOP", stop).replace("TILT", tilt).replace("D;", f"{d};")
    return text.replace("G*", "9.81 m/s^2*")


def test_a_turned_world_has_the_same_heap() -> None:
    straight, turned = (mechc.loads(balls(tilt=t)).simulate(**ALONE) for t in ("0 deg", "40 deg"))
    assert straight["energy.dissipated"][-1] > 0.05 * straight["energy.total"][0]
    for state in straight.problem.states:
        if not state.name.startswith("energy"):
            assert np.abs(straight[state.name] - turned[state.name]).max() < 1e-7, state.name


def test_a_heap_in_millimetres_is_the_same_in_small() -> None:
    """Lengths by 1/64 and times by 1/8, which is exact: all steps are the same but for rounding."""
    large = mechc.loads(balls()).simulate(**ALONE)
    small = mechc.loads(balls(d="0.703125 mm", stop="10 ms")).simulate(**ALONE)
    assert len(large.time) == len(small.time)
    for i in range(1, 17):
        for name in (f"free[{i}].x", f"free[{i}].y"):
            assert np.abs(large[name] - 64 * small[name]).max() < 1e-7
            assert np.abs(large[f"der({name})"] - 8 * small[f"der({name})"]).max() < 1e-5


# ---------------------------------------------------------------- when, ensembles, inputs

SLABS = """
structural parameter Integer n = 40;
parameter mu = 0.2;
input Force push = 0 N;
coordinate Length x[n] = {0 m for i in 1:n};
coordinate Length z[n] = {0 m for i in 1:n};
for i in 1:n loop
  initial der(x[i]) = 1 m/s;
  kinetic 1/2*1 kg*(der(x[i])^2 + der(z[i])^2);
  potential 1 kg*9.81 m/s^2*z[i];
  contact floor[i]: z[i] friction mu along der(x[i]);
end for;
force push on x[3];
WHEN
experiment(stop = 1 s, method = "moreau", step = 1 ms, tolerance = 1e-12);
"""


def way(speed: float, mu: float) -> float:
    """Length of a slide that ends within a second."""
    return speed**2 / (2 * mu * G)


def test_a_when_sets_one_of_many_in_motion() -> None:
    """Slab 2 gets 0.8 m/s when slab 1 rests; a stop within a step is off by at most mu g h^2/2."""
    text = SLABS.replace("WHEN", "when time > 0.55 s then reinit(der(x[2]), 0.8 m/s); end when;")
    solution = mechc.loads(text).simulate(**ALONE)
    assert solution["x[1]"][-1] == pytest.approx(way(1, 0.2), abs=1e-6)
    assert solution["x[2]"][-1] == pytest.approx(way(1, 0.2) + way(0.8, 0.2), abs=3e-6)


def test_a_released_contact_among_many_is_refused_in_words() -> None:
    text = SLABS.replace("WHEN", "when time > 0.5 s then release floor[2]; end when;")
    with pytest.raises(mechc.CompileError, match="E0720"):
        mechc.loads(text)
    asked = SLABS.replace("WHEN", 'when closed(floor[2]) then terminate("down"); end when;')
    with pytest.raises(mechc.CompileError, match="E0722"):
        mechc.loads(asked)


def test_an_ensemble_of_crowds_and_a_sweep() -> None:
    values = [0.15, 0.2, 0.4]
    found = mechc.loads(SLABS.replace("WHEN", "")).ensemble({"mu": values}, keep=["x[5]"])
    for mu, x in zip(values, found["x[5]"], strict=True):
        assert x[-1] == pytest.approx(way(1, mu), abs=mu * G * 1e-6)


def test_an_input_pushes_one_of_many(tmp_path: Path) -> None:
    """0.5 N against the friction of 0.2 m g: slower to stop."""
    table = tmp_path / "push.csv"
    table.write_text("time [s],push [N]\n0,0.5\n1,0.5\n")
    solution = mechc.loads(SLABS.replace("WHEN", "")).simulate(inputs={"push": table}, **ALONE)
    brake = 0.2 * G - 0.5
    assert solution["x[3]"][-1] == pytest.approx(1 / (2 * brake), abs=2e-6)
    assert solution["x[4]"][-1] == pytest.approx(way(1, 0.2), abs=2e-6)
    assert math.isclose(solution["energy.supplied"][-1], 0.5 / (2 * brake), rel_tol=1e-5)
