"""Ten parts of the library inside parts in arrays, on frames by further names, with parameters from other parts and driven by a file: models, and SciPy on the laws that their descriptions state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from modelica_computed import motion
from scipy.integrate import solve_ivp

Vector = np.ndarray[Any, Any]

DRIVES = """
import mech.rotational.{Rotor, TorqueCurve};
import mech.translational.{Slider, GasSpring};
import mech.couplings.{Belt};
import mech.control.{StateSpace};

model Drive
  input Real pedal;
  parameter Real size = 1;
  StateSpace smooth(u = {pedal, 0.3*pedal}, A = {{-4, 2}, {0, -6}}*size, B = {{3, 1}, {0, 5}}, C = {{1, 0.5}},
                    D = {{0, 0.1}}, T = 0.5 s);
  Rotor engine(J = 0.2 kg.m^2*size, angle = 0 rad, der(angle) = 20 rad/s);
  Rotor shaft(J = 2.5*engine.J, angle ~ 0 rad);
  let a = engine.angle;
  TorqueCurve curve(from = a, load = smooth.y[1], speeds = {0, 10, 40, 80} rad/s, full = {5, 9, 8, 0} N.m,
                    dragged = {-1, -1.5, -2, -4} N.m);
  Belt belt(angle1 = a, angle2 = shaft.angle, r1 = 0.1 m, r2 = 1.7*belt.r1*size);
  Slider piston(m = 3 kg*size, s = 0.11 m, der(s) = 0 m/s);
  GasSpring gas(from = 0.01 m*sin(shaft.angle), to = piston.s, area = 2 cm^2, charged = 0.1 m,
                volume = piston.m*(0.03 m/kg), pressure = 0.8 MPa, outside = 0.1 MPa, n = 1.3);
  force -1200 N/m*piston.s - 15 N.s/m*der(piston.s) on piston.s;
end Drive;

model Drives
  input Real pedal = 0;
  Drive drive[2](pedal = {pedal, 1 - pedal}, size = {1, 1.4});
  output Real load[2] = {drive[1].smooth.y[1], drive[2].smooth.y[1]};
  experiment(stop = 1.5 s, tolerance = 1e-10);
end Drives;
"""

ARMS = """
import mech.planar.*;
import mech.elements.{Parachute};
import mech.fields.{CentralField};
import mech.machines.{HangingLoad};

model Arm
  frame base;
  parameter Length place[2] = {0, 0} m;
  input Velocity gust;
  parameter Mass m = 2 kg;
  parameter Length l = 0.8 m;
  Bar bar(m = m, l = l);
  Revolute pin(base -> bar.a, angle = 30 deg, der(angle) = 1 rad/s);
  frame tip = bar.b;
  frame end_ = tip;
  TorsionSpring twist(base -> bar.c, k = 20 N.m/rad*field.n*m/(2 kg), rest = 45 deg);
  Parachute chute(to = end_, CdS = 0.4 m^2, open = 0.2 s, fill = 0.3 s, wind = {gust, 0 m/s});
  CentralField field(world -> end_, V0 = 0.3 J*m/(1 kg), r0 = 0.5*l, n = 1.5);
  HangingLoad load(from = end_, m = 0.1*bar.m, l = 0.5*bar.l,
                   position = place + {l*cos(30 deg), l*sin(30 deg) - 0.5*l},
                   der(position) = 1 rad/s*l*{-sin(30 deg), cos(30 deg)});
end Arm;

model Arms
  input Velocity gust = 0 m/s;
  gravity {0, -9.81} m/s^2;
  Arm arm[2](base = {world * trans({1, 0} m), world * trans({-1, 0.5} m)}, place = {{1, 0}, {-1, 0.5}} m,
             gust = {gust, -gust}, m = {2, 3} kg);
  output Angle hangs[2] = arm.load.angle;
  experiment(stop = 1 s, tolerance = 1e-10);
end Arms;
"""

PROBES = """
import mech.spatial.*;
import mech.space.{ReactionWheel};

model Probe
  input Torque push;
  parameter Inertia J = 1 kg.m^2;
  frame at;
  Body hull(m = 10 kg, J = {{2, 0.3, 0.1}, {0.3, 3, -0.2}, {0.1, -0.2, 4}}*J);
  Spherical joint(at -> hull.a, der(orientation) = {0.3, -0.2, 0.5} rad/s);
  frame deck = hull.a;
  frame rack = deck;
  ReactionWheel wheel(from = rack, axis = {1, 2, 2}, motor = push, J = 0.05*rotor.J, most = 0.06 N.m,
                      c = 2e-3 N.m.s, angle = 0 rad, der(angle) = 30 rad/s);
  CarriedRotor rotor(to = rack, J = 0.4*J, axis = {0, 1, -1}, angle = 0 rad, der(angle) = 2 rad/s);
  force -0.1 N.m.s*der(rotor.angle) on rotor.angle;
  output AngularVelocity w[3] = components(hull.a, angvel(hull.a));
end Probe;

model Probes
  input Torque push = 0 N.m;
  Probe probe[2](push = {push, -2*push}, J = {1, 1.5} kg.m^2, at = {world, world * trans({5, 0, 0} m)});
  experiment(stop = 2 s, tolerance = 1e-10);
end Probes;
"""


class Case(NamedTuple):
    """A model, the input that a file gives, and what SciPy makes of it at the end of the file by name."""

    text: str
    input: str
    times: Sequence[float]
    values: Sequence[float]
    known: Callable[[Sequence[float], Sequence[float]], dict[str, float]]


# ---------------------------------------------------------------- drives

SPEEDS, FULL, DRAGGED = [0, 10, 40, 80], [5, 9, 8, 0], [-1, -1.5, -2, -4]


def drive_rates(y: Vector, pedal: float, size: float) -> Vector:
    """Rates of (two states, angle and speed of the engine, place and speed of the piston); the belt turns the shaft."""
    x, (a, w, s, v) = y[:2], y[2:]
    u = np.array([pedal, 0.3 * pedal])
    load = np.clip(x[0] + 0.5 * x[1] + 0.1 * u[1], 0, 1)
    low, high = np.interp(w, SPEEDS, DRAGGED), np.interp(w, SPEEDS, FULL)
    torque = low + load * (high - low)
    slower = 1 / (1.7 * size)
    b = slower * a
    m = 3 * size
    column = 0.03 * m + s - 0.01 * np.sin(b) - 0.1
    push = (0.8e6 * (0.03 * m / column) ** 1.3 - 0.1e6) * 2e-4
    J = 0.2 * size * (1 + 2.5 * slower**2)
    rates = (size * np.array([[-4, 2], [0, -6]]) @ x + np.array([[3, 1], [0, 5]]) @ u) / 0.5
    turn = (torque - push * 0.01 * np.cos(b) * slower) / J
    return np.array([*rates, w, turn, v, (push - 1200 * s - 15 * v) / m])


def drives(times: Sequence[float], values: Sequence[float]) -> dict[str, float]:
    found: dict[str, float] = {}
    for k, size in ((1, 1.0), (2, 1.4)):

        def right(t: float, y: Vector, k: int = k, size: float = size) -> Vector:
            pedal = float(np.interp(t, times, values))
            return drive_rates(y, pedal if k == 1 else 1 - pedal, size)

        y = np.array([0, 0, 0, 20, 0.11, 0])
        for begin, end in pairwise(times):
            y = solve_ivp(right, (begin, end), y, "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
        pedal = values[-1] if k == 1 else 1 - values[-1]
        part = f"drive[{k}]"
        found |= {f"{part}.engine.angle": y[2], f"{part}.shaft.angle": y[2] / (1.7 * size), f"{part}.piston.s": y[4]}  # fmt: skip
        found[f"load[{k}]"] = y[0] + 0.5 * y[1] + 0.03 * pedal
    return found


def drive_jacobian(pedal: float) -> dict[int, Vector]:
    """Derivatives of the rates of both drives by their states at the start."""
    y, small = np.array([0, 0, 0, 20, 0.11, 0]), 1e-5 * np.eye(6)
    return {
        k: np.array([(drive_rates(y + d, p, size) - drive_rates(y - d, p, size)) / 2e-5 for d in small]).T
        for k, p, size in ((1, pedal, 1.0), (2, 1 - pedal, 1.4))
    }


# ---------------------------------------------------------------- arms


def arms(times: Sequence[float], values: Sequence[float]) -> dict[str, float]:
    """Bar and load as masses at places of the two angles; the rope is taut all the time."""
    found: dict[str, float] = {}
    l, rope = 0.8, 0.4
    for k, m, x0, y0, side in ((1, 2.0, 1.0, 0.0, 1), (2, 3.0, -1.0, 0.5, -1)):
        hung = 0.1 * m

        def tip(q: Any, x0: float = x0, y0: float = y0) -> tuple[Any, Any]:
            return x0 + l * np.cos(q[0]), y0 + l * np.sin(q[0])

        def load(q: Any, tip: Any = tip) -> tuple[Any, Any]:
            x, y = tip(q)
            return x + rope * np.sin(q[1]), y - rope * np.cos(q[1])

        def places(
            q: Any, m: float = m, hung: float = hung, x0: float = x0, y0: float = y0, load: Any = load
        ) -> list[Any]:
            bar = [x0 + l / 2 * np.cos(q[0]), y0 + l / 2 * np.sin(q[0])]
            weights = np.sqrt([m, m, m * l**2 / 12, hung, hung])
            return [w * p for w, p in zip(weights, [*bar, q[0], *load(q)], strict=True)]

        def potential(
            q: Any, m: float = m, hung: float = hung, tip: Any = tip, load: Any = load, y0: float = y0
        ) -> Any:
            x, y = tip(q)
            weight = 9.81 * (m * (y0 + l / 2 * np.sin(q[0])) + hung * load(q)[1])
            stiffness = 20 * 1.5 * m / 2
            far = (x**2 + y**2) ** 0.5
            return weight + stiffness * (q[0] - np.pi / 4) ** 2 / 2 + 0.3 * m * (far / (0.5 * l)) ** 1.5

        def drag(t: float, q: Vector, v: Vector, z: Vector, side: int = side) -> tuple[Any, Any]:
            opened = np.clip((t - 0.2) / 0.3, 0, 1) ** 2
            e = l * np.array([-np.sin(q[0]), np.cos(q[0])])
            u = e * v[0] - np.array([side * np.interp(t, times, values), 0])
            force = -0.5 * 1.225 * 0.4 * opened * np.hypot(*u) * u
            return np.array([force @ e, 0]), z

        # One second is short: the kinks of the table and of the filling cost the steps that find them.
        y = motion(places, potential, [np.pi / 6, 0], [1, 0], [times[-1]], drag)[:, -1]
        found |= {f"arm[{k}].pin.angle": y[0], f"hangs[{k}]": y[1], f"der(arm[{k}].pin.angle)": y[2]}
    return found


# ---------------------------------------------------------------- probes


def probes(times: Sequence[float], values: Sequence[float]) -> dict[str, float]:
    """Euler's equations of a hull with two rotors about its fixed mass centre, in the axes of the hull."""
    found: dict[str, float] = {}
    e, n = np.array([1, 2, 2]) / 3, np.array([0, 1, -1]) / np.sqrt(2)
    for k, J, sign in ((1, 1.0, 1), (2, 1.5, -2)):
        hull = J * np.array([[2, 0.3, 0.1], [0.3, 3, -0.2], [0.1, -0.2, 4]])
        rotor = 0.4 * J
        wheel = 0.05 * rotor
        M = np.zeros((5, 5))
        M[:3, :3] = hull + wheel * np.outer(e, e)
        M[:3, 3] = M[3, :3] = wheel * e
        M[:3, 4] = M[4, :3] = rotor * n
        M[3, 3], M[4, 4] = wheel, rotor

        def right(t: float, y: Vector, M: Vector = M, sign: int = sign) -> Vector:
            rates = y[2:]
            motor = np.clip(sign * np.interp(t, times, values), -0.06, 0.06)
            momentum = M[:3] @ rates
            torques = [*np.cross(momentum, rates[:3]), motor - 2e-3 * rates[3], -0.1 * rates[4]]
            return np.array([rates[3], rates[4], *np.linalg.solve(M, torques)])

        y = np.array([0, 0, 0.3, -0.2, 0.5, 30, 2])
        for begin, end in pairwise(times):
            y = solve_ivp(right, (begin, end), y, "DOP853", rtol=1e-11, atol=1e-13, max_step=0.01).y[:, -1]
        part = f"probe[{k}]"
        found |= {f"{part}.wheel.angle": y[0], f"{part}.rotor.angle": y[1]}
        found |= {f"{part}.w[{i + 1}]": y[2 + i] for i in range(3)}
        found[f"{part}.wheel.momentum"] = wheel * (e @ y[2:5] + y[5])
    return found


CASES = {
    "Drives": Case(
        DRIVES, "pedal", np.linspace(0, 1.5, 7).tolist(), [0.2, 0.9, 0.4, 0.6, 0.1, 0.8, 0.5], drives
    ),
    "Arms": Case(ARMS, "gust", np.linspace(0, 1, 6).tolist(), [0, 2, 3, 1, -2, -1], arms),
    "Probes": Case(PROBES, "push", np.linspace(0, 2, 6).tolist(), [0, 0.05, 0.1, -0.04, -0.02, 0.03], probes),
}
"""Of ten files: TorqueCurve, Belt, GasSpring, StateSpace; TorsionSpring, Parachute, CentralField, HangingLoad; ReactionWheel, CarriedRotor."""
