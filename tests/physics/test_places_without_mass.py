"""A cam with its follower by the place of contact, and a muscle with its tendon: places without mass against closed forms and SciPy."""

from __future__ import annotations

from collections.abc import Callable
from time import process_time

import numpy as np
import pytest
import sympy
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import mechc

Array = NDArray[np.float64]

CAM = """
coordinate Angle phi; drive phi = 6 rad/s*time;
coordinate Length y = 1.2 m;
kinetic 1/2*1 kg*der(y)^2; potential 1 kg*9.81 m/s^2*y + 1/2*50 N/m*(y - 0.5 m)^2;
let q[2] = {sin(phi), cos(phi)}*y;
"""
BY_A_COORDINATE = (
    CAM
    + """
coordinate Angle u ~ 90 deg;
constraint (q[1] - 2 m*cos(u))*2*sin(u) - (q[2] - 1 m*sin(u))*cos(u) = 0 m;
contact cam: dot({q[1] - 2 m*cos(u), q[2] - 1 m*sin(u)}, {cos(u), 2*sin(u)})/sqrt(cos(u)^2 + 4*sin(u)^2) - 0.2 m;
experiment(stop = 3 s, tolerance = 1e-12);
"""
)
BY_AN_OUTPUT = (
    CAM
    + """
output Angle u ~ atan2(2*q[2], q[1]);
equation (q[1] - 2 m*cos(u))*2*sin(u) - (q[2] - 1 m*sin(u))*cos(u) = 0 m;
contact cam: norm({q[1] - 2 m*cos(u), q[2] - 1 m*sin(u)}) - 0.2 m;
experiment(stop = 3 s, tolerance = 1e-12);
"""
)
SPEED, STIFF, REST, WEIGHT = 6.0, 50.0, 0.5, 9.81


def profile() -> tuple[Callable[[float], float], Callable[[float], tuple[float, float, float]]]:
    """Return the place u of contact by the angle of the cam, and y, dy/dphi, d2y/dphi2 by u: the centre is p(u) + r n(u), at the
    angle phi of a ray that turns."""
    u = sympy.Symbol("u")
    size = sympy.sqrt(sympy.cos(u) ** 2 + 4 * sympy.sin(u) ** 2)
    centre = (
        2 * sympy.cos(u) + 0.2 * sympy.cos(u) / size,
        sympy.sin(u) + 0.4 * sympy.sin(u) / size,
    )
    y = sympy.sqrt(centre[0] ** 2 + centre[1] ** 2)
    turn = (centre[0].diff(u) * centre[1] - centre[0] * centre[1].diff(u)) / y**2
    first = y.diff(u) / turn
    told = sympy.lambdify(u, (y, first, first.diff(u) / turn))
    place = sympy.lambdify(u, centre)

    def of_angle(phi: float) -> float:
        def off(u: float) -> float:
            a, b = place(u)
            return float(a * np.cos(phi) - b * np.sin(phi))  # across the ray

        near = np.pi / 2 - phi
        return float(brentq(off, near - 0.8, near + 0.8, xtol=1e-14))

    def of_place(at: float) -> tuple[float, float, float]:
        y, slope, bend = told(at)
        return float(y), float(slope), float(bend)

    return of_angle, of_place


def follower(times: Array) -> Array:
    """y: on the cam while it is pressed, else a harmonic flight, with impacts that do not bounce."""
    of_angle, of_place = profile()
    w, middle = np.sqrt(STIFF), REST - WEIGHT / STIFF

    def on(t: float) -> tuple[float, float, float]:
        y, first, second = of_place(of_angle(SPEED * t))
        return y, SPEED * first, SPEED**2 * second

    def pressed(t: float) -> float:
        y, _, acceleration = on(t)
        return acceleration + WEIGHT + STIFF * (y - REST)

    pieces: list[tuple[float, Callable[[float], float]]] = []
    t = 0.0
    while t < times[-1]:
        pieces.append((t, lambda at: on(at)[0]))
        leaves = next((s for s in np.arange(t, times[-1], 2e-3) if pressed(s) > 0 > pressed(s + 2e-3)), None)
        if leaves is None:
            break
        t = float(brentq(pressed, leaves, leaves + 2e-3, xtol=1e-15))
        y, v, _ = on(t)

        def flight(at: float, t: float = t, y: float = y, v: float = v) -> float:
            return float(middle + (y - middle) * np.cos(w * (at - t)) + v / w * np.sin(w * (at - t)))

        pieces.append((t, flight))
        s = t + 5e-3
        while s < times[-1] and flight(s) > on(s)[0]:
            s += 2e-3
        if s >= times[-1]:
            break
        t = float(brentq(lambda at: flight(at) - on(at)[0], s - 2e-3, s, xtol=1e-15))
    return np.array([next(f for begin, f in reversed(pieces) if begin <= at)(at) for at in times])


@pytest.mark.parametrize(
    "text",
    [BY_A_COORDINATE, pytest.param(BY_AN_OUTPUT, marks=pytest.mark.slow)],
    ids=["coordinate", "output"],
)
def test_a_follower_lifts_off_its_cam(text: str) -> None:
    """Measured: 2e-10 after six flights. The equations of a cam whose place an output gives are formed in a second: once it took hours,
    as steps of Newton's method were taken for jumps of what is prescribed."""
    begun = process_time()
    model = mechc.loads(text)
    assert process_time() - begun < 10
    solution = model.simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution) and solution.failure is None
    times = np.linspace(0, 3, 61)
    assert np.abs(solution(times)["y"] - follower(times)).max() < 1e-9
    assert sum(e.kind == "impact" for e in solution.events) == 5


MUSCLE = """
parameter F0 = 1000 N; parameter l0 = 0.1 m; parameter ls = 0.2 m; parameter a = 0.5;
coordinate Length x = 0.3008 m;
coordinate Length l = 0.1 m "length of the fibre";
kinetic 1/2*20 kg*der(x)^2;
force 20 kg*9.81 m/s^2 on x;
potential 1/2*40*F0/ls*(x - l - ls)^2;
let v = der(l)/(10*l0/1 s);
let w = -8.149*v - 0.374;
let fv = 0.886 + 0.318*log(-w + sqrt(w^2 + 1));
force -F0*(a*exp(-((l/l0 - 1)/0.45)^2)*fv + 0.02*exp(4*(l/l0 - 1))) on l;
experiment(stop = 1 s, tolerance = 1e-11);
"""
"""Hill's muscle with an elastic tendon; the law of force and velocity is that of De Groote et al. 2016, Ann. Biomed. Eng. 44, 2922."""


def test_a_muscle_with_its_tendon() -> None:
    """The law turned round by hand: log(-w + sqrt(w^2 + 1)) = -asinh(w)."""

    def rates(t: float, y: Array) -> list[float]:
        x, rate, length = y
        tendon = 40 * (x - length - 0.2) / 0.2
        active = 0.5 * np.exp(-(((length / 0.1 - 1) / 0.45) ** 2))
        fv = (tendon - 0.02 * np.exp(4 * (length / 0.1 - 1))) / active
        w = -np.sinh((fv - 0.886) / 0.318)
        return [rate, 9.81 - 1000 * tendon / 20, (-0.374 - w) / 8.149]

    solution = mechc.loads(MUSCLE).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution) and solution.failure is None
    exact = solve_ivp(
        rates, (0, 1), [0.3008, 0, 0.1], "DOP853", rtol=1e-12, atol=1e-14, dense_output=True
    ).sol(solution.time)
    assert np.abs(solution["x"] - exact[0]).max() < 1e-9
    assert np.abs(solution["l"] - exact[2]).max() < 1e-9
    assert np.ptp(solution["l"]) > 0.002
