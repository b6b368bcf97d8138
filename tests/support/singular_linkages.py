"""Six linkages that pass positions in which their constraints depend on each other, with their motions in coordinates that do not.

Beside such a position another motion begins (a parallelogram may go on as an antiparallelogram); the references follow the one along
which the linkage came, in independent coordinates by hand, solved by SciPy to 12 digits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec import Struct
from scipy.integrate import solve_ivp

G = 9.81
RELATIVE = 3e-14


class Linkage(Struct, frozen=True):
    """``text`` with the mass M; ``motion`` by name at some times; ``passes`` changes its sign in the singular position."""

    name: str
    text: str
    motion: Callable[[Any], dict[str, Any]]
    passes: Callable[[dict[str, Any]], Any]


def motion(rates: Callable[..., Any], times: Any, start: list[float]) -> Any:
    """Return [states, n], to 12 digits: a looser solution agrees."""
    found = [
        solve_ivp(rates, (0, times[-1]), start, method="DOP853", rtol=tolerance, atol=1e-15, t_eval=times).y
        for tolerance in (RELATIVE, 10 * RELATIVE)
    ]
    assert (np.abs(found[0] - found[1]) < 1e-11 * (1 + np.abs(found[0]))).all()
    return found[0]


def one_angle(inertia: Callable[[Any], Any], potential: Callable[[Any], Any]) -> Callable[..., list[Any]]:
    """Return the rates of I(a) a'^2/2 + V(a); derivatives by a complex step, exact to rounding."""

    def slope(f: Callable[[Any], Any], a: Any) -> Any:
        return np.imag(f(a + 1e-30j)) / 1e-30

    def rates(t: float, y: Any) -> list[Any]:
        a, v = y
        return [v, (-slope(potential, a) - slope(inertia, a) * v * v / 2) / inertia(a)]

    return rates


def kite(times: Any) -> dict[str, Any]:
    """Two points at l from the origin, a third at s from both: it lies on their bisector, so that (a + b)/2 and (a - b)/2 go on."""
    l, s = 1.0, 0.7
    first, second = np.arcsin(-0.3), np.arcsin(0.8)  # from the downward vertical

    def rates(t: float, y: Any) -> list[Any]:
        f, d, vf, vd = y
        S, C = np.sin(d), np.cos(d)
        root = np.sqrt(s * s - l * l * S * S)
        r, r1 = l * C + root, -l * S - l * l * S * C / root
        r2 = -l * C - l * l * (C * C - S * S) / root - l**4 * S * S * C * C / root**3
        af = (-G * (2 * l * C + r) * np.sin(f) - 2 * r * r1 * vd * vf) / (2 * l * l + r * r)
        ad = (-2 * G * l * np.cos(f) * S + G * r1 * np.cos(f) + r * r1 * vf * vf - r1 * r2 * vd * vd) / (
            2 * l * l + r1 * r1
        )
        return [vf, vd, af, ad]

    f, d, *_ = motion(rates, times, [(first + second) / 2, (first - second) / 2, 0, 0])
    r = l * np.cos(d) + np.sqrt(s * s - l * l * np.sin(d) ** 2)
    return {
        "a[1]": np.sin(f + d),
        "a[2]": -np.cos(f + d),
        "b[1]": np.sin(f - d),
        "c[1]": r * np.sin(f),
        "c[2]": -r * np.cos(f),
    }


KITE = """
parameter M = 1 kg; parameter g = 9.81 m/s^2; parameter l = 1 m; parameter s = 0.7 m;
coordinate Length a[2] ~ {-0.6, -0.8} m; coordinate Length b[2] ~ {0.6, -0.8} m; coordinate Length c[2] ~ {0.1, -1.2} m;
initial a[1] = -0.3 m; initial b[1] = 0.8 m;
kinetic 1/2*M*(dot(der(a), der(a)) + dot(der(b), der(b)) + dot(der(c), der(c)));
potential M*g*(a[2] + b[2] + c[2]);
constraint oa: dot(a, a) = l^2; constraint ob: dot(b, b) = l^2;
constraint ac: dot(a - c, a - c) = s^2; constraint bc: dot(b - c, b - c) = s^2;
experiment(stop = 2 s);
"""


def parallelogram(times: Any) -> dict[str, Any]:
    """Cranks of 0.5 m and masses M, a coupler of 1 m and 2 M that moves without turning: flat at 0 and 180 deg."""
    l = 0.5
    rates = one_angle(
        lambda a: 2 * l * l / 3 + 2 * l * l + 0 * a, lambda a: G * (2 * l / 2 + 2 * l) * np.sin(a)
    )
    a, v = motion(rates, times, [1.0, 9.0])
    return {"left.angle": a, "right.angle": a, "der(left.angle)": v}


PARALLELOGRAM = """
import mech.planar.*;
parameter M = 1 kg; gravity {0, -9.81 m/s^2};
Bar crank(m = M, l = 0.5 m); Bar coupler(m = 2*M, l = 1 m); Bar rocker(m = M, l = 0.5 m);
Revolute left(world -> crank.a, angle = 1 rad, der(angle) = 9 rad/s);
Revolute pin(crank.b -> coupler.a, angle ~ -1 rad);
Revolute right(world*trans({1 m, 0 m}) -> rocker.a, angle ~ 1 rad);
cut Revolute last(coupler.b -> rocker.b);
experiment(stop = 2 s);
"""


def slider_crank(times: Any) -> dict[str, Any]:
    """Crank and rod of 0.4 m and M each, a piston of 2 M: at 90 deg the piston is at the shaft, where the rod could turn with the crank."""
    l = 0.4

    def inertia(a: Any) -> Any:
        rod = (1.5 * l * np.sin(a)) ** 2 + (0.5 * l * np.cos(a)) ** 2 + l * l / 12
        return l * l / 3 + rod + 2 * (2 * l * np.sin(a)) ** 2

    a, v = motion(one_angle(inertia, lambda a: 0 * a), times, [0.5, 4.0])
    return {"main.angle": a, "guide.position": 2 * l * np.cos(a), "der(main.angle)": v}


SLIDER_CRANK = """
import mech.planar.*;
parameter M = 1 kg;
Bar crank(m = M, l = 0.4 m); Bar rod(m = M, l = 0.4 m); Body piston(m = 2*M);
Revolute main(world -> crank.a, angle = 0.5 rad, der(angle) = 4 rad/s);
Revolute big(crank.b -> rod.a, angle ~ -1 rad);
Prismatic guide(world -> piston.a, axis = {1, 0}, position ~ 0.7 m);
cut Revolute small(rod.b -> piston.a);
experiment(stop = 1.5 s);
"""


def kite_four_bar(times: Any) -> dict[str, Any]:
    """Crank and ground of 0.3 m, coupler and rocker of 0.7 m: at 0 the crank ends at the pivot of the rocker."""
    a, b = 0.3, 0.7

    def apex(th: Any) -> Any:
        return a * np.cos(th / 2) + np.sqrt(b * b - (a * np.sin(th / 2)) ** 2)

    def slope(th: Any) -> Any:
        S, C = np.sin(th / 2), np.cos(th / 2)
        return -a * S / 2 - a * a * S * C / (2 * np.sqrt(b * b - a * a * S * S))

    def places(th: Any) -> tuple[Any, ...]:
        r, r1 = apex(th), slope(th)
        S, C = np.sin(th / 2), np.cos(th / 2)
        ends = (a * np.cos(th), a * np.sin(th)), (r * C, r * S)
        rates = (-a * np.sin(th), a * np.cos(th)), (r1 * C - r * S / 2, r1 * S + r * C / 2)
        return ends, rates

    def inertia(th: Any) -> Any:
        (ax, ay), (bx, by) = places(th)[1]
        return (ax * ax + ay * ay) + 2 * (bx * bx + by * by)

    def potential(th: Any) -> Any:
        (_, ay), (_, by) = places(th)[0]
        return G * (ay + 2 * by)

    th, v = motion(one_angle(inertia, potential), times, [1.2, -3.0])
    (ax, _), (bx, by) = places(th)[0]
    del v
    return {"p[1]": ax, "q[1]": bx, "q[2]": by}


KITE_FOUR_BAR = """
parameter M = 1 kg; parameter g = 9.81 m/s^2; parameter a = 0.3 m; parameter b = 0.7 m;
coordinate Length p[2] ~ {0.1, 0.28} m; coordinate Length q[2] ~ {0.7, 0.5} m;
initial p[1] = a*cos(1.2 rad); initial der(p[1]) = 3 rad/s*a*sin(1.2 rad);
kinetic 1/2*M*dot(der(p), der(p)) + M*dot(der(q), der(q)); potential M*g*p[2] + 2*M*g*q[2];
constraint crank: dot(p, p) = a^2; constraint coupler: dot(q - p, q - p) = b^2;
constraint rocker: dot(q - {a, 0 m}, q - {a, 0 m}) = b^2;
experiment(stop = 1.5 s);
"""


def jack(times: Any) -> dict[str, Any]:
    """A rhombus of rods of 0.5 m between a pivot and a slider: folded it stands at the pivot, where either pair could turn alone."""
    l = 0.5
    rates = one_angle(lambda a: 2 * l * l + 4 * l * l * np.sin(a) ** 2, lambda a: 0 * a)
    a, v = motion(rates, times, [0.6, 3.0])
    return {
        "a[1]": l * np.cos(a),
        "a[2]": l * np.sin(a),
        "b[2]": -l * np.sin(a),
        "c": 2 * l * np.cos(a),
        "der(c)": -2 * l * np.sin(a) * v,
    }


JACK = """
parameter M = 1 kg; parameter l = 0.5 m;
coordinate Length a[2] ~ {0.41, 0.28} m; coordinate Length b[2] ~ {0.41, -0.28} m; coordinate Length c ~ 0.82 m;
initial a[1] = l*cos(0.6 rad); initial der(a[1]) = -3 rad/s*l*sin(0.6 rad);
kinetic 1/2*M*(dot(der(a), der(a)) + dot(der(b), der(b)) + der(c)^2);
constraint oa: dot(a, a) = l^2; constraint ob: dot(b, b) = l^2;
constraint ac: dot(a - {c, 0 m}, a - {c, 0 m}) = l^2; constraint bc: dot(b - {c, 0 m}, b - {c, 0 m}) = l^2;
experiment(stop = 2 s);
"""


def lamp(times: Any) -> dict[str, Any]:
    """Two parallelograms on each other as a lamp has them, of massless rods but the couplers: points 0.4 and 0.3 m apart move as a double pendulum."""
    l, k = 0.4, 0.3

    def rates(t: float, y: Any) -> list[Any]:
        a, b, v, w = y
        c, s = np.cos(a - b), np.sin(a - b)
        matrix = np.array([[3 * l * l, 2 * l * k * c], [2 * l * k * c, 2 * k * k]])
        right = [
            -2 * l * k * s * w * w - 3 * G * l * np.sin(a),
            2 * l * k * s * v * v - 2 * G * k * np.sin(b),
        ]
        return [v, w, *np.linalg.solve(matrix, right)]

    a, b, *_ = motion(rates, times, [1.0, 0.5, 3.0, 6.0])
    return {
        "p[1]": l * np.sin(a),
        "p[2]": -l * np.cos(a),
        "q[1]": l * np.sin(a) + k * np.sin(b),
        "q[2]": -l * np.cos(a) - k * np.cos(b),
    }


LAMP = """
parameter M = 1 kg; parameter g = 9.81 m/s^2; parameter l = 0.4 m; parameter k = 0.3 m; parameter d = 0.2 m;
coordinate Length p[2] ~ {0.33, -0.21} m; coordinate Length r[2] ~ {0.53, -0.21} m;
coordinate Length q[2] ~ {0.48, -0.48} m; coordinate Length s[2] ~ {0.68, -0.48} m;
initial p[1] = l*sin(1 rad); initial der(p[1]) = 3 rad/s*l*cos(1 rad);
initial q[1] = l*sin(1 rad) + k*sin(0.5 rad); initial der(q[1]) = 3 rad/s*l*cos(1 rad) + 6 rad/s*k*cos(0.5 rad);
kinetic 1/4*M*(dot(der(p), der(p)) + dot(der(r), der(r))) + 1/2*M*(dot(der(q), der(q)) + dot(der(s), der(s)));
potential 1/2*M*g*(p[2] + r[2]) + M*g*(q[2] + s[2]);
constraint one: dot(p, p) = l^2; constraint two: dot(r - {d, 0 m}, r - {d, 0 m}) = l^2;
constraint coupler: dot(r - p, r - p) = d^2;
constraint three: dot(q - p, q - p) = k^2; constraint four: dot(s - r, s - r) = k^2;
constraint top: dot(s - q, s - q) = d^2;
experiment(stop = 1 s);
"""

LINKAGES = {
    linkage.name: linkage
    for linkage in (
        Linkage("kite", KITE, kite, lambda q: q["a[1]"] - q["b[1]"]),
        Linkage("parallelogram", PARALLELOGRAM, parallelogram, lambda q: np.sin(q["left.angle"])),
        Linkage("slider_crank", SLIDER_CRANK, slider_crank, lambda q: q["guide.position"]),
        Linkage("kite_four_bar", KITE_FOUR_BAR, kite_four_bar, lambda q: q["q[2]"]),
        Linkage("jack", JACK, jack, lambda q: q["c"]),
        Linkage("lamp", LAMP, lamp, lambda q: q["q[2]"] - q["p[2]"]),
    )
}
