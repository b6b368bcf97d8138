"""A rough rod that slides on its foot: one solution, none, or two (P. Painlevé 1895)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from mechc.runtime.outcome import Outcome

ROD = """
parameter tilt = 60 deg;
parameter mu = 2;
parameter I = 0.3 kg.m^2;
parameter speed = 1 m/s;
parameter w = 0 rad/s;
gravity {0, -9.81} m/s^2;
coordinate Length x = 0 m;
coordinate Length y ~ 1 m;
coordinate Angle a = tilt;
initial der(x) = speed;
initial der(a) = w;
frame rod = world * trans({x, y}) * rot(a);
mass 1 kg at rod;
inertia I on rod;
point foot = rod * {-1, 0} m;
initial foot[2] = 0 m;
initial der(foot[2]) = 0 m/s;
contact ground: foot[2] friction mu along vel(foot)[1];
output N = multiplier(ground);
"""


@pytest.fixture(scope="module")
def rod() -> mechc.Model:
    return mechc.loads(ROD)


def test_one_is_found_two_are_refused_and_none_is_an_impact(rod: mechc.Model) -> None:
    """With the force N the foot has the acceleration b + S N upwards: S < 0 has no solution for b < 0, two for b > 0.

    Where there is none, impulses end the slip at once (F. Genot, B. Brogliato 1999): those that leave the foot at rest, which lie in
    the cone then.
    """
    random = np.random.default_rng(5)
    seen = {"one": 0, "open": 0, "none": 0, "two": 0}
    for _ in range(60):
        tilt, mu, inertia = random.uniform(0.2, 1.4), random.uniform(0.1, 4), random.uniform(0.05, 0.5)
        speed, w = random.uniform(-20, 20), random.uniform(0, 6)
        c, s = math.cos(tilt), math.sin(tilt)
        along = speed + s * w
        S = 1 + (c * c + math.copysign(mu, along) * c * s) / inertia
        b = s * w * w - 9.81
        if abs(S) < 0.05 or abs(b) < 0.05 or abs(along) < 0.5:
            continue
        case = ("open" if b > 0 else "one") if S > 0 else ("two" if b > 0 else "none")
        seen[case] += 1
        settings = {"tilt": tilt, "mu": mu, "I": inertia, "speed": speed, "w": w}
        solution = rod.simulate(stop=1e-6, set=settings, estimate_error=False)
        if case == "none":
            # of the foot: rows along and up by (x, y, a); the impulses that stop it
            G = np.array([[1, 0, s], [0, 1, -c]])
            W = G @ np.diag([1, 1, 1 / inertia]) @ G.T
            pushes = np.linalg.solve(W, [-along, 0])
            assert abs(pushes[0]) <= mu * pushes[1]
            then = np.array([speed, 0, w]) + np.diag([1, 1, 1 / inertia]) @ G.T @ pushes
            then[1] += c * w  # the foot begins without a velocity up
            found = [solution[name][-1] for name in ("der(x)", "der(y)", "der(a)")]
            assert np.allclose(found, then, rtol=1e-4, atol=1e-4)
            assert [(e.time, e.kind, e.value) for e in solution.events[:1]] == [(0, "impact", 0)]
            # of what the motion at the start has, the run loses what the impulses took
            first = np.array([speed, c * w, w])
            gone = (first**2 - then**2) @ [1, 1, inertia] / 2
            assert solution["energy.dissipated"][-1] == pytest.approx(gone, rel=1e-3)
            assert solution["der(x)"][0] == speed
        elif case == "two":
            assert solution.outcome is Outcome.FAILED
            assert "no solution, or more than one" in solution.message
        else:
            assert solution.outcome is Outcome.COMPLETED
            assert solution["N"][0] == pytest.approx(max(0, -b / S), rel=1e-9)
    assert min(seen.values()) >= 3


LOPSIDED = """
parameter mu = 2;
parameter Velocity slip[2] = {1 m/s, 2 m/s};
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Length z = 0 m;
initial der(x) = slip[1];
initial der(y) = slip[2];
kinetic (2/7) kg*der(x)^2 + (5/2) kg*der(y)^2 + (8/7) kg*der(z)^2 - (6/7) kg*der(x)*der(z);
force -1 N on z;
contact ground: z friction mu along {der(x), der(y)};
experiment(stop = 1e-7 s);
"""


def test_a_shock_turns_its_slip_until_forces_can_hold_it() -> None:
    """Of this mass, as one that a linkage carries, only the slip along x drives the contact into the ground. The velocities over the impulse
    of the contact: friction against the slip of the moment, to where the approach ends (G. Darboux 1880, J. B. Keller 1986)."""
    model = mechc.loads(LOPSIDED)
    W = np.array([[4, 0, 1.5], [0, 0.2, 0], [1.5, 0, 1]])
    for mu, slip in (
        (1.2, (1, 0.5)),
        (1.2, (1, -1)),
        (2, (0.5, 1)),
        (2, (1, 0.5)),
        (3, (1, 2)),
        (3, (-1, 2)),
    ):

        def rate(_: float, u: np.ndarray, mu: float = mu) -> np.ndarray:
            return np.asarray(W[:, 2] - mu * W[:, :2] @ u[:2] / np.hypot(*u[:2]))

        def ends(_: float, u: np.ndarray) -> float:
            return float(u[2] - 1e-12)

        ends.terminal, ends.direction = True, 1  # type: ignore[attr-defined]
        path = solve_ivp(rate, (0, 10), [*slip, -1e-9], method="LSODA", rtol=1e-9, atol=1e-12, events=ends)
        assert rate(0, path.y[:, -1])[2] > 0
        solution = model.simulate(
            set={"mu": mu, "slip[1]": slip[0], "slip[2]": slip[1]}, estimate_error=False
        )
        assert solution.outcome is Outcome.COMPLETED, solution.message
        found = [solution[name][-1] for name in ("der(x)", "der(y)", "der(z)")]
        if rate(0, np.array([*slip, 0]))[2] > 0:  # forces hold it
            assert found == pytest.approx([*slip, 0], abs=1e-5)
        else:
            assert found == pytest.approx(path.y[:, -1], abs=3e-4)
