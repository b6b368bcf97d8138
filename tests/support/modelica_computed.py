"""Examples of Modelica's libraries by other equations, where no references are published: mass matrices from places of mass points, SciPy's DOP853; nothing of mechc.

Each system says where its masses are (``places``: all coordinates and angles, times the roots of their masses and inertias), its
potential, and the other forces on its coordinates. Derivatives of these are taken by complex steps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from modelica_losses import losses
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

G = 9.81
Vector = np.ndarray[Any, Any]


def still(t: float, q: Vector, v: Vector, z: Vector) -> tuple[Any, Any]:
    """No forces but those of the potential, no further states."""
    return np.zeros_like(q), np.zeros_like(z)


def motion(
    places: Callable[[Any], Sequence[Any]],
    potential: Callable[[Any], Any],
    start: Sequence[float],
    rates: Sequence[float],
    times: Sequence[float],
    others: Callable[[float, Vector, Vector, Vector], tuple[Any, Any]] = still,
    further: int = 0,
    held: Callable[[Any], Any] | None = None,
    method: str = "DOP853",
) -> Vector:
    """Return the coordinates and their rates at ``times``: a row for each.

    ``others`` gives forces, and rates of further states; ``held`` a matrix A with A v = 0.
    """
    n = len(start)
    step = 1e-40

    def jacobian(q: Vector) -> Vector:
        return np.array([np.imag(places(q + 1j * step * e)) / step for e in np.eye(n)]).T

    def slope(q: Vector) -> Vector:
        return np.array([np.imag(potential(q + 1j * step * e)) / step for e in np.eye(n)])

    def right(t: float, y: Vector) -> Vector:
        q, v, z = y[:n], y[n : 2 * n], y[2 * n :]
        J = jacobian(q)
        small = 1e-5
        bent = (jacobian(q + small * v) - jacobian(q - small * v)) @ v / (2 * small)
        force, rate = others(t, q, v, z)
        M, right_side = J.T @ J, force - slope(q) - J.T @ bent
        if held:
            A = held(q)
            turned = (held(q + small * v) - held(q - small * v)) @ v / (2 * small)
            M = np.block([[M, A.T], [A, np.zeros((len(A), len(A)))]])
            right_side = np.concatenate([right_side, -turned])
        return np.concatenate([v, np.linalg.solve(M, right_side)[:n], rate])

    y = np.concatenate([start, rates, np.zeros(further)])
    found = solve_ivp(right, (0, times[-1]), y, method, times, rtol=1e-10, atol=1e-10, max_step=0.05)
    return np.array(found.y[: 2 * n])


def body(x: Any, y: Any, angle: Any, m: float, J: float) -> list[Any]:
    """A rigid body in the plane."""
    return [np.sqrt(m) * x, np.sqrt(m) * y, np.sqrt(J) * angle]


def pendulum(times: Sequence[float], excited: bool = False) -> dict[str, Any]:
    """A body of 1 kg and 0.1 kg.m^2 on an arm of 1 m; excited, a force across the arm from 1.8 s on."""

    def push(t: float, q: Vector, v: Vector, z: Vector) -> tuple[Any, Any]:
        return np.array([-5 * np.sin(2 * np.pi * (t - 1.8)) if excited and t > 1.8 else 0.0]), z

    y = motion(
        lambda q: body(np.cos(q[0]), np.sin(q[0]), q[0], 1, 0.1),
        lambda q: G * np.sin(q[0]),
        [0],
        [0],
        times,
        push,
    )
    return {"pin": y[0]}


def double(times: Sequence[float], m: float, J: float) -> dict[str, Any]:
    """Two bodies on arms of 1 m and 0.4 m."""

    def places(q: Any) -> list[Any]:
        a, b = q[0], q[0] + q[1]
        upper = body(np.cos(a), np.sin(a), a, 1, 0.1)
        return upper + body(np.cos(a) + 0.4 * np.cos(b), np.sin(a) + 0.4 * np.sin(b), b, m, J)

    y = motion(
        places,
        lambda q: G * np.sin(q[0]) + m * G * (np.sin(q[0]) + 0.4 * np.sin(q[0] + q[1])),
        [0, 0],
        [0, 0],
        times,
    )
    a, b, wa, wb = y[0], y[0] + y[1], y[2], y[2] + y[3]
    vx, vy = -np.sin(a) * wa - 0.4 * np.sin(b) * wb, np.cos(a) * wa + 0.4 * np.cos(b) * wb
    return {
        "r1.angle": y[0],
        "r2.angle": y[1],
        "place[1]": np.cos(a) + 0.4 * np.cos(b),
        "place[2]": np.sin(a) + 0.4 * np.sin(b),
        "v[1]": np.cos(b) * vx + np.sin(b) * vy,
        "v[2]": np.cos(b) * vy - np.sin(b) * vx,
    }


def crab(times: Sequence[float], damping: float, place: float, g: float = G) -> dict[str, Any]:
    """A crab of 1 kg on a rail, a load of 0.5 kg 1 m below it."""
    y = motion(
        lambda q: [q[0], *body(q[0] + np.sin(q[1]), -np.cos(q[1]), q[1], 0.5, 0.1)],
        lambda q: -0.5 * g * np.cos(q[1]),
        [place, np.deg2rad(150)],
        [0, 0],
        times,
        lambda t, q, v, z: (np.array([-damping * v[0], 0]), z),
    )
    distance = np.hypot(y[0] + np.sin(y[1]), np.cos(y[1]))
    return {"rail": y[0], "pin": y[1], "distance": distance, "carrier": -0.2 + 0.2 * np.asarray(times)}


def controlled(times: Sequence[float]) -> dict[str, Any]:
    """A crab of 250 kg, a load of 70 kg 2.5 m above it, a PID controller with a filtered derivative."""

    def others(t: float, q: Vector, v: Vector, z: Vector) -> tuple[Any, Any]:
        force = -320 * 9.81 * 5 * (q[1] + z[0] + 10 * (q[1] - z[1]))
        return np.array([force, 0]), np.array([q[1] / 1e9, (q[1] - z[1]) / 0.02])

    y = motion(
        lambda q: [
            np.sqrt(250) * q[0],
            np.sqrt(70) * (q[0] - 2.5 * np.sin(q[1])),
            np.sqrt(70) * 2.5 * np.cos(q[1]),
        ],
        lambda q: 70 * G * 2.5 * np.cos(q[1]),
        [0, np.deg2rad(-20)],
        [0, 0],
        times,
        others,
        2,
    )
    return {"rail": y[0], "pin": y[1]}


def loop(times: Sequence[float]) -> dict[str, Any]:
    """Two massless bars of 0.5 m between a hinge and a slide at s: they meet at (s/2, -sqrt(1/4 - s^2/4))."""

    def places(q: Any) -> list[Any]:
        s, turned = q[0], np.arcsin(q[0]) + q[1]
        return body(
            s / 2 + 0.6 * np.sin(turned),
            -np.sqrt(0.25 - s * s / 4) - 0.6 * np.cos(turned),
            turned,
            1,
            0.1,
        )

    y = motion(
        places,
        lambda q: 10 * (q[0] - 0.4) ** 2 + G * places(q)[1],
        [0.4, np.deg2rad(-40)],
        [0, 0],
        times,
        lambda t, q, v, z: (np.array([-4 * v[0], 0]), z),
    )
    return {"slide": y[0], "pin": y[1]}


def engine(times: Sequence[float]) -> dict[str, Any]:
    """A crank of 0.3 m with 0.1 kg.m^2, a rod of 0.8 m without mass, a piston of 3 kg."""

    def places(q: Any) -> list[Any]:
        piston = 0.3 * np.cos(q[0]) + np.sqrt(0.64 - 0.09 * np.sin(q[0]) ** 2)
        return [np.sqrt(0.1) * q[0], np.sqrt(3) * piston]

    return {"crank": motion(places, lambda q: 0 * q[0], [0], [-2.5], times)[0]}


def sprung(times: Sequence[float]) -> dict[str, Any]:
    """0.5 kg at springs of 5 N/m and dampers of 1 N.s/m along both axes; the springs end at (-1, 0)."""
    y = motion(
        lambda q: np.sqrt(0.5) * q,
        lambda q: 2.5 * ((q[0] + 1) ** 2 + q[1] ** 2) + 0.5 * G * q[1],
        [1, 1],
        [0, 0],
        times,
        lambda t, q, v, z: (-v, z),
    )
    return {"x": y[0], "y": y[1]}


def hanging(times: Sequence[float]) -> dict[str, Any]:
    """0.5 y'' + y' + 10 (y + 0.5) + 0.5 g = 0 from 0.2 at rest, in closed form."""
    t = np.asarray(times)
    rest, w = -0.5 - 0.5 * G / 10, np.sqrt(20 - 1)
    return {"y": rest + (0.2 - rest) * np.exp(-t) * (np.cos(w * t) + np.sin(w * t) / w)}


def drag(times: Sequence[float]) -> dict[str, Any]:
    """41 w' = c w^2 with w = -5 at first and c = 2 (1/2 0.5 1.2 1.18) 2^2, in closed form."""
    c = 2 * 0.5 * 0.5 * 1.2 * 1.18 * 4 / 41
    return {"pin": -np.log1p(5 * c * np.asarray(times)) / c}


def wheel(times: Sequence[float]) -> dict[str, Any]:
    """A wheel of 0.3 m that rolls, on it a pendulum whose angle counts from the wheel."""

    def places(q: Any) -> list[Any]:
        turned, a = -q[0] / 0.3, -q[0] / 0.3 + q[1]
        return body(q[0], 0.3, turned, 1, 0.1) + body(q[0] + np.cos(a), 0.3 + np.sin(a), a, 2, 0.2)

    y = motion(places, lambda q: 2 * G * np.sin(q[1] - q[0] / 0.3), [0, np.deg2rad(80)], [0, 0], times)
    return {"x": y[0], "pin": y[1]}


def inverted(times: Sequence[float]) -> dict[str, Any]:
    """An angle a along a ramp behind a lag, in closed form; no torque at the pin: m l cos(a) x'' = (m l^2 + I) a'' - m g l sin(a)."""
    m, crab, inertia, lag, duration = 0.5, 1.0, 0.1, 0.1, 0.5

    def angle(t: float) -> tuple[float, float, float]:
        """The lag from -0.5 rad along a ramp that ends after 0.5 s, with two derivatives."""
        a, da, dda = -0.5, 0.0, 0.0
        for start, slope in ((0.0, 1.0), (duration, -1.0)):
            s = t - start
            if s > 0:
                fades = np.exp(-s / lag)
                a, da, dda = a + slope * (s - lag * (1 - fades)), da + slope * (1 - fades), dda + slope * fades / lag  # fmt: skip
        return a, da, dda

    def push(t: float) -> tuple[float, float]:
        a, da, dda = angle(t)
        ddx = ((m + inertia) * dda - m * G * np.sin(a)) / (m * np.cos(a))
        return ddx, (crab + m) * ddx - m * (np.cos(a) * dda - np.sin(a) * da**2)

    ends = [duration, *(t for t in times if t > duration)]
    before = [t for t in times if t <= duration]
    rows, y = [], [0.0, 0.0]
    for span, asked in (((0.0, duration), [*before, duration]), ((duration, times[-1]), ends)):
        found = solve_ivp(lambda t, y: [y[1], push(t)[0]], span, y, "DOP853", sorted(set(asked)), rtol=1e-11, atol=1e-12).y  # fmt: skip
        y = list(found[:, -1])
        rows.append(found)
    rail = np.concatenate([rows[0][0][: len(before)], rows[1][0][1:]])
    return {
        "rail": rail,
        "pin": np.array([angle(t)[0] for t in times]),
        "F": np.array([push(t)[1] for t in times]),
    }


def grip(v: float, adhesion: float, sliding: float, peak: float, rest: float) -> float:
    """Friction over slip: cubics between (0, 0), the peak and the rest, level at both."""
    if abs(v) <= adhesion:
        u = v / adhesion
        return peak * (1.5 * u - 0.5 * u**3)
    u = min((2 * abs(v) - adhesion - sliding) / (sliding - adhesion), 1.0)
    return float(np.sign(v) * ((peak + rest) / 2 + (rest - peak) / 2 * (1.5 * u - 0.5 * u**3)))


def spinning(times: Sequence[float]) -> dict[str, Any]:
    """A wheel of 0.1 m that slides forwards and spins backwards."""

    def right(t: float, y: Vector) -> list[float]:
        f = 0.01 * G * grip(y[2] + 0.1 * y[3], 0.01, 0.03, 0.5, 0.15)
        return [y[2], y[3], -f / 0.01, -0.1 * f / 0.0005]

    y = solve_ivp(
        right, (0, times[-1]), [0, 0, 2, 15], "DOP853", times, rtol=1e-11, atol=1e-11, max_step=0.01
    ).y
    return {"x": y[0], "phi": y[1]}


def around(times: Sequence[float], shares: bool, added: float = 0.0) -> dict[str, Any]:
    """A driven wheel around a pivot at the distance s, turned by a: 10 s'' = 10 s a'^2 - across, ((10 s^2 + 1) a')' = along s.

    ``added`` to the slip [m/s]: 1e-4 in the original, against a division by zero.
    """

    def right(t: float, y: Vector) -> list[float]:
        s, _, _, ds, da, droll = y
        along, across = -da * s - 0.3 * droll, ds
        slip = max(np.hypot(along, across), 1e-12) + added
        speed = 0.3 * abs(droll)
        near, far = (max(0.04 * speed, 0.05), max(0.12 * speed, 0.15)) if shares else (0.1, 0.3)
        f = 100 * grip(slip, near, far, 0.8, 0.4)
        dda = (f * along / slip * s - 20 * s * ds * da) / (10 * s * s + 1)
        return [ds, da, droll, s * da * da - f * across / slip / 10, dda, 2 + 0.3 * f * along / slip]

    start = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    y = solve_ivp(right, (0, times[-1]), start, "Radau", times, rtol=1e-9, atol=1e-10).y
    return {"slide": y[0], "pin": y[1], "roll": y[2]}


def ideal(times: Sequence[float]) -> dict[str, Any]:
    """The same without slip: (1 + (10 + 1) 0.3^2) roll'' = 2 at the distance 1."""
    roll = np.asarray(times) ** 2 / 1.99
    return {"pin": -0.3 * roll, "roll": roll}


def track(times: Sequence[float]) -> dict[str, Any]:
    """A car of one track: x, y, its angle, that of the castor; both wheels hold across, the one after drives with 2/0.3 N."""

    def places(q: Any) -> list[Any]:
        x, y, a, b = q[0], q[1], q[2], q[2] + q[3]
        front = body(x - np.sin(a) + 0.1 * np.sin(b), y + np.cos(a) - 0.1 * np.cos(b), b, 2, 0.1)
        return body(x, y, a, 10, 0.1) + front

    def held(q: Any) -> Any:
        a, b = q[2], q[2] + q[3]
        rear = [np.cos(a), np.sin(a), 0 * a, 0 * a]
        front = [np.cos(b), np.sin(b), -np.cos(b - a) + 0.1, 0.1 + 0 * a]
        return np.array([rear, front])

    def others(t: float, q: Vector, v: Vector, z: Vector) -> tuple[Any, Any]:
        ahead = np.array([-np.sin(q[2]), np.cos(q[2]), 0, 0])
        speed = ahead @ v
        return (2 / 0.3 - (0.5 * 0.4 * 2 * 1.18 * speed**2 if speed > 0 else 0)) * ahead, z

    y = motion(places, lambda q: 0 * q[0], [0, 0, 0, np.deg2rad(40)], [0, 0, 0, 0], times, others, held=held)
    return {"x": y[0], "y": y[1], "angle": y[2], "castor": y[3]}


def car(times: Sequence[float]) -> dict[str, Any]:
    """A car of two tracks with castors: x, y, its angle, that of the castors, and those of four wheels."""

    def hubs(q: Any) -> list[Any]:
        s, c = np.sin(q[2]), np.cos(q[2])
        found = []
        for across, ahead in ((-0.75, 2), (0.75, 2), (-0.75, 0), (0.75, 0)):
            x, y = q[0] + c * across - s * ahead, q[1] + s * across + c * ahead
            if ahead:
                x, y = x + 0.05 * np.sin(q[2] + q[3]), y - 0.05 * np.cos(q[2] + q[3])
            found += [x, y]
        return found

    def places(q: Any) -> list[Any]:
        p = hubs(q)
        axles = body(p[0], p[1], q[2] + q[3], 100, 1) + body(p[2], p[3], q[2] + q[3], 100, 1)
        return body(q[0], q[1], q[2], 300, 0.1) + axles + list(q[4:])

    def others(t: float, q: Vector, v: Vector, z: Vector) -> tuple[Any, Any]:
        J = np.array([np.imag(hubs(q + 1e-40j * e)) / 1e-40 for e in np.eye(8)]).T
        force = np.zeros(8)
        force[3] = 2 if t >= 1 and (t - 1) % 2 < 0.6 else 0
        for i in range(4):
            turned = q[2] + (q[3] if i < 2 else 0)
            e, n = np.array([-np.sin(turned), np.cos(turned)]), np.array([np.cos(turned), np.sin(turned)])
            there = J[2 * i : 2 * i + 2]
            along, across = e @ there @ v - 0.25 * v[4 + i], n @ there @ v
            slip = max(np.hypot(along, across), 1e-12)
            f = (1000 if i < 2 else 1500) * grip(slip, 0.1, 0.3, 1, 0.7) / slip
            force -= f * (along * e + across * n) @ there
            force[4 + i] += 0.25 * f * along + (0 if i < 2 else 12.5)
        return force, z

    start = [0, 0, 0, np.deg2rad(25), 0, 0, 0, 0]
    y = motion(places, lambda q: 0 * q[0], start, [0] * 8, times, others, method="LSODA")
    return {"x": y[0], "y": y[1], "angle": y[2], "steer": y[3], "roll": y[6]}


def gearbox(times: Sequence[float]) -> dict[str, Any]:
    """Sun t, carrier c, planet 2 c - t at the distance 2, ring (4 c - t)/3; 1 N.m on the ring and the weight of the planet."""
    J = 1e-3

    def right(t: float, y: Vector) -> list[float]:
        moved = J + 4 + 4 * J + 16 / 9 * J
        return [y[1], (4 / 3 - 2 * G * np.cos(y[0])) / moved]

    y = solve_ivp(right, (0, times[-1]), [0, 0.5], "DOP853", times, rtol=1e-12, atol=1e-12).y
    return {"carrier": y[0], "ring": (4 * y[0] - np.asarray(times)) / 3}


def braked(times: Sequence[float]) -> dict[str, Any]:
    """Four speeds of 100 at first: -100 to 1 and then -100 w, -w, -w^2/100, -1e4/w to 1 and then -100 w; in closed form."""
    t = np.asarray(times)
    late, sooner = np.maximum(t - 0.99, 0), np.maximum(t - 0.49995, 0)
    early, before = np.minimum(t, 0.99), np.minimum(t, 0.49995)
    return {
        "x1": 100 * early - 50 * early**2 + (1 - np.exp(-100 * late)) / 100,
        "x2": 100 * (1 - np.exp(-t)),
        "x3": 100 * np.log1p(t),
        "x4": (1e6 - (1e4 - 2e4 * before) ** 1.5) / 3e4 + (1 - np.exp(-100 * sooner)) / 100,
    }


def boxes(times: Sequence[float]) -> dict[str, Any]:
    """Two boxes of steel, 0.5 m by 6 cm by 6 cm, in a row; the tip starts at (0.7, 0.3) at rest."""
    m = 7700 * 0.5 * 0.06**2
    J = m * (0.5**2 + 0.06**2) / 12
    bend = 2 * np.arccos(np.hypot(0.7, 0.3))
    y = motion(
        lambda q: (
            body(0.25 * np.cos(q[0]), 0.25 * np.sin(q[0]), q[0], m, J)
            + body(
                0.5 * np.cos(q[0]) + 0.25 * np.cos(q[0] + q[1]),
                0.5 * np.sin(q[0]) + 0.25 * np.sin(q[0] + q[1]),
                q[0] + q[1],
                m,
                J,
            )
        ),
        lambda q: m * 9.80665 * (0.75 * np.sin(q[0]) + 0.25 * np.sin(q[0] + q[1])),
        [np.arctan2(0.3, 0.7) - bend / 2, bend],
        [0, 0],
        times,
        lambda t, q, v, z: (np.array([-0.1 * v[0], 0]), z),
    )
    return {"revolute1.phi": y[0], "revolute2.phi": y[1], "revolute1.w": y[2], "revolute2.w": y[3]}


def orbits(times: Sequence[float]) -> dict[str, Any]:
    """Two masses in the field of a centre, mu = 1 m^3/s^2."""
    found: dict[str, Any] = {}
    for name, start in (("body1", [0, 0.6, 1, 0]), ("body2", [0.6, 0.6, 0.6, 0])):
        y = solve_ivp(
            lambda t, y: np.concatenate([y[2:], -y[:2] / np.hypot(*y[:2]) ** 3]),
            (0, times[-1]),
            start,
            "DOP853",
            times,
            rtol=1e-12,
            atol=1e-12,
        ).y
        found |= {f"{name}.frame_a.r_0[1]": y[0], f"{name}.frame_a.r_0[2]": y[1]}
    return found


def grounded(times: Sequence[float], force: Callable[[float], float], preload: bool) -> dict[str, Any]:
    """A force F on a mass of 0.1 kg, which a gear or lever of 1.6 on a soft support joins to one of 7 kg."""

    def first(q: Any) -> Any:
        return 1.6 * q[0] - 0.6 * q[1]

    y = motion(
        lambda q: [np.sqrt(0.1) * first(q), np.sqrt(7) * q[0]],
        lambda q: 400 * q[1] ** 2 + preload * 80 * (q[0] + 0.1) ** 2,
        [0, 0],
        [0, 0],
        times,
        lambda t, q, v, z: (
            force(t) * np.array([1.6, -0.6]) - np.array([10 * preload * v[0], 50 * v[1]]),
            z,
        ),
    )
    return {"mass1.s": first(y), "mass2.s": y[0], "support": y[1]}


def freewheel(times: Sequence[float]) -> dict[str, Any]:
    """A shaft turns with w = 5 sin(10 pi t) as long as that needs a torque w' + 5 w > 0, and then with exp(-5 t), until it is caught."""
    rate = 10 * np.pi

    def driven(t: float) -> float:
        return float(5 * np.sin(rate * t))

    angle = 0.0
    caught, turns, speeds = 0.0, {}, {}
    while caught < times[-1]:
        free = (np.pi - np.arctan(2 * np.pi)) / rate + 0.2 * np.floor(rate * caught / (2 * np.pi) + 0.25)
        left = driven(free)
        again = brentq(lambda t, a=free, w=left: driven(t) - w * np.exp(-5 * (t - a)), free + 0.1, free + 0.2)

        def way(t: float, begin: float = caught) -> float:
            return float(5 / rate * (np.cos(rate * begin) - np.cos(rate * t)))

        for t in times:
            if caught <= t < free:
                turns[t], speeds[t] = angle + way(t), driven(t)
            elif free <= t < again:
                fallen = np.exp(-5 * (t - free))
                turns[t], speeds[t] = angle + way(free) + left / 5 * (1 - fallen), left * fallen
        angle += way(free) + left / 5 * (1 - np.exp(-5 * (again - free)))
        caught = again
    return {
        "inertia2.phi": np.array([turns[t] for t in times]),
        "inertia2.w": np.array([speeds[t] for t in times]),
    }


SYSTEMS: dict[str, tuple[float, Callable[[Sequence[float]], dict[str, Any]]]] = {
    "PlanarMechanics.Pendulum": (3, pendulum),
    "PlanarMechanics.PendulumExcited": (3, lambda times: pendulum(times, excited=True)),
    "PlanarMechanics.DoublePendulum": (10, lambda times: double(times, 0.2, 0.01)),
    "PlanarMechanics.MeasureDemo": (10, lambda times: double(times, 0.4, 0.02)),
    "PlanarMechanics.CraneCrab": (10, lambda times: crab(times, 10, 0)),
    "PlanarMechanics.PowerDistanceDemo": (6, lambda times: crab(times, 1, 1)),
    "PlanarMechanics.ControlledCraneCrab": (3, controlled),
    "PlanarMechanics.FreeBody": (3, lambda times: {"y": -G / 2 * np.asarray(times) ** 2}),
    "PlanarMechanics.KinematicLoop": (6, loop),
    "PlanarMechanics.PistonEngine": (10, engine),
    "PlanarMechanics.SpringDamperDemo": (5, sprung),
    "PlanarMechanics.SpringDemo": (5, hanging),
    "PlanarMechanics.TestAirDrag": (10, drag),
    "PlanarMechanics.CraneCrabTo3D": (10, lambda times: crab(times, 10, 0, 9.80665)),
    "PlanarMechanics.CounterSpin": (3, spinning),
    "PlanarMechanics.InvertedCraneCrab": (3, inverted),
    "MultiBody.Elementary.InitSpringConstant": (1, lambda times: {"c": np.full(len(times), 9.80665 / 0.2)}),
    "PlanarMechanics.TestDryFrictionWheel": (20, lambda times: around(times, shares=False)),
    "PlanarMechanics.TestSlipBasedWheel": (20, lambda times: around(times, shares=True)),
    "PlanarMechanics.TestIdealWheel": (10, ideal),
    "PlanarMechanics.SingleTrackWithEngine": (6, track),
    "PlanarMechanics.TwoTrackWithDifferentialGear": (10, car),
    "PlanarMechanics.SpurGear": (
        10,
        lambda times: {"b": -np.asarray(times), "motor": 10 + 0 * np.asarray(times)},
    ),
    "PlanarMechanics.PlanetaryGear": (10, gearbox),
    "Rotational.CompareBrakingTorque": (5, braked),
    "Translational.CompareBrakingForce": (5, braked),
    "PlanarMechanics.WheelBasedCraneCrab": (4.5, wheel),
    "Translational.GearGrounded": (
        3,
        lambda times: grounded(times, lambda t: 10 + 10 * np.clip((t - 0.3) / 0.6, 0, 1), True),
    ),
    "Translational.LeverGrounded": (
        1,
        lambda times: grounded(times, lambda t: 10 * np.sin(10 * np.pi * t), False),
    ),
    "Rotational.DemoFreeWheel": (1, freewheel),
    "Rotational.HeatLosses": (1, losses),
}
"""How long each of them runs, and what gives its reference."""


def computed_reference(name: str) -> dict[str, Any]:
    """Return ten rows of an example: ``time`` and what it is compared in."""
    stop, system = SYSTEMS[name.removesuffix("_DynamicStateSelection")]
    times = np.linspace(0, stop, 11)[1:]
    return {"time": times, **system(list(times))}
