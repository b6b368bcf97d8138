"""Boxes on two corners, at random: they hit, press, stick, slide, tip as the one combination has it that Coulomb's law allows.

The combinations are gone through in the test; where none fits, or several that move otherwise, mechc says so.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import Outcome

BOX = """
parameter Inertia J = 0.05 kg.m^2;
parameter Length b = 0.3 m; parameter Length c = 0.3 m; parameter Length h = 0.1 m;
parameter mu1 = 0.3; parameter mu2 = 0.3; parameter e = 0;
parameter Force fx = 0 N; parameter Force fy = 0 N; parameter Torque T = 0 N.m;
parameter Velocity v = 0 m/s; parameter Velocity down = 0 m/s;
coordinate Length x = 0 m; coordinate Length y = h; coordinate Angle a = 0 rad;
initial der(x) = v; initial der(y) = -down;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2) + 1/2*J*der(a)^2;
potential 1 kg*9.81 m/s^2*y;
force fx on x; force fy on y; force T on a;
contact left: y - b*sin(a) - h*cos(a) restitution e friction mu1 along der(x - b*cos(a) + h*sin(a));
contact right: y + c*sin(a) - h*cos(a) restitution e friction mu2 along der(x + c*cos(a) + h*sin(a));
output acceleration[3] = {der(x, 2)/(1 m/s^2), der(y, 2)/(1 m/s^2), der(a, 2)/(1 rad/s^2)};
experiment(stop = 1 ms);
"""
SLACK = 1e-9
Numbers = Any


@pytest.fixture(scope="module")
def box() -> mechc.Model:
    return mechc.loads(BOX)


def drawn(rng: np.random.Generator) -> dict[str, float]:
    """Low and high ones, wide and narrow, with the same friction at both corners or not."""
    b = float(rng.uniform(0.05, 0.5))
    mu = float(rng.uniform(0, 1.5))
    return {
        "J": float(rng.uniform(0.01, 0.3)),
        "b": b,
        "c": b + float(rng.choice([0, rng.uniform(-0.04, 0.3)])),
        "h": float(rng.uniform(0.02, 0.6)),
        "mu1": mu,
        "mu2": mu if rng.random() < 0.5 else float(rng.uniform(0, 1.5)),
        "v": float(rng.choice([0, rng.normal()])),
    }


def solutions(box: dict[str, float], now: Numbers, rebound: float, sticks: bool) -> list[Numbers]:
    """List the velocities, or accelerations, that become of ``now`` by forces on the corners that fit.

    ``rebound``: what share of what corners have along their normals is turned round; ``sticks``: what moves along the floor
    may come to rest by them, or does not move yet; else it slides as it did.
    """
    weight = np.diag([1, 1, box["J"]])
    normals = np.array([[0, 1, -box["b"]], [0, 1, box["c"]]])
    along, mu, aims = np.array([1, 0, box["h"]]), (box["mu1"], box["mu2"]), -rebound * normals @ now
    ways: list[Any] = [
        "open",
        *([np.sign(box["v"])] if box["v"] else [1, -1]),
        *(["stick"] if sticks else []),
    ]
    found: list[Numbers] = []
    for modes in itertools.product(ways, repeat=2):
        rows, wanted, forces = [], [], []
        for k, mode in enumerate(modes):
            if mode == "open":
                continue
            rows.append(normals[k])
            wanted.append(aims[k])
            forces.append(normals[k] if mode == "stick" else normals[k] - mode * mu[k] * along)
            if mode == "stick":
                rows.append(along)
                wanted.append(0)
                forces.append(along)
        then: Numbers = now
        sizes: Numbers = iter(())
        if rows:
            response = np.array(rows) @ np.linalg.solve(weight, np.array(forces).T)
            right = np.array(wanted) - np.array(rows) @ now
            z = np.linalg.lstsq(response, right, rcond=1e-10)[0]
            if np.abs(response @ z - right).max() > 1e-8 * (1 + np.abs(right).max()):
                continue
            then, sizes = now + np.linalg.solve(weight, np.array(forces).T @ z), iter(z)
        fits: Numbers = True
        held, cone = 0.0, 0.0
        for k, mode in enumerate(modes):
            if mode == "open":
                fits &= normals[k] @ then >= aims[k] - SLACK
                continue
            size = next(sizes)
            fits &= size >= -SLACK
            if mode == "stick":  # two corners that stick share what holds them in some way
                held, cone = held + next(sizes), cone + mu[k] * size
            elif sticks:
                fits &= mode * (along @ then) >= -SLACK
        fits &= abs(held) <= cone + SLACK
        if fits and not any(np.allclose(then, x, 1e-6, 1e-6) for x in found):
            found.append(then)
    return found


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.slow) for k in range(2, 20))])
def test_it_moves_on_as_the_only_combination_has_it(box: mechc.Model, seed: int) -> None:
    """It presses and is pushed at its corners, or not; two combinations fit about as often as in one of a thousand."""
    rng = np.random.default_rng(seed)
    for _ in range(200):
        values = drawn(rng) | {
            name: float(rng.choice([0, rng.normal(scale=size)]))
            for name, size in (("fx", 6), ("fy", 6), ("T", 2))
        }
        free = np.array([values["fx"], values["fy"] - 9.81, values["T"] / values["J"]])
        fitting = solutions(values, free, 0, not values["v"])
        found = box.simulate(set=values, estimate_error=False)
        if found.outcome is Outcome.FAILED:
            assert len(fitting) != 1 and "no solution, or more than one" in found.message, values
            continue
        if not fitting:  # no force fits: an impact has ended the slip
            assert found.energy is not None and values["v"] != 0, values
            continue
        assert len(fitting) == 1, values
        here = [found[f"acceleration[{k}]"][0] for k in (1, 2, 3)]
        assert np.allclose(here, fitting[0], 1e-6, 1e-6), values


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.slow) for k in range(2, 20))])
def test_it_rises_from_the_floor_as_the_only_combination_has_it(box: mechc.Model, seed: int) -> None:
    """Newton's restitution, both corners at once."""
    rng = np.random.default_rng(seed)
    for _ in range(200):
        values = drawn(rng) | {
            "down": float(rng.uniform(0.5, 2)),
            "e": float(rng.choice([0, 0.5, 1, rng.random()])),
        }
        (after,) = solutions(values, np.array([values["v"], -values["down"], 0]), values["e"], True)
        found = box.simulate(stop=1e-9, set=values, estimate_error=False)
        here = [found[f"der({q})"][-1] for q in ("x", "y", "a")]
        assert np.allclose(here, after, 1e-6, 1e-6), values


def test_a_third_foot_between_them_changes_nothing() -> None:
    """It takes a share of what they bear, or rises with the body."""
    third = "y + 0.1*(c - b)*sin(a) - h*cos(a) restitution e friction mu1 along der(x + 0.1*(c - b)*cos(a) + h*sin(a))"
    box = mechc.loads(f"{BOX}\ncontact middle: {third};")
    rng = np.random.default_rng(3)
    for _ in range(200):
        values = drawn(rng)
        values |= {
            "mu2": values["mu1"],
            "down": float(rng.uniform(0.5, 2)),
            "e": float(rng.choice([0, 0.5, 1])),
        }
        (after,) = solutions(values, np.array([values["v"], -values["down"], 0]), values["e"], True)
        found = box.simulate(stop=1e-9, set=values, estimate_error=False)
        assert np.allclose([found[f"der({q})"][-1] for q in ("x", "y", "a")], after, 1e-6, 1e-6), values
