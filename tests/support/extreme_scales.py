"""Forty models that hold lengths, times, masses or stiffnesses of ratios up to 1e20, with what they end with by other means.

Each is written as a person composes it. References share no code with mechc: closed forms in mpmath, or equations of motion by hand,
in units in which all is of size one, solved by SciPy at 1e-13.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from mpmath import mp, mpf
from msgspec import Struct
from scipy.integrate import solve_ivp

mp.dps = 40

Ends = Mapping[str, tuple[float, float]]
"""Of each quantity the value at the end, and how large it is during the run: errors count against that."""


class Scaled(Struct, frozen=True):
    """``extreme`` says what is far apart; ``ends`` makes the reference. ``refused``: the targets (``run`` among them) that say
    that they cannot. ``unresolved``: what a double holds only some digits of."""

    name: str
    extreme: str
    text: str
    ends: Callable[[], Ends]
    refused: frozenset[str] = frozenset()
    unresolved: frozenset[str] = frozenset()


CASES: list[Scaled] = []


def case(
    extreme: str, text: str, refused: str = "", unresolved: str = ""
) -> Callable[[Callable[[], Ends]], Callable[[], Ends]]:
    def keep(ends: Callable[[], Ends]) -> Callable[[], Ends]:
        CASES.append(
            Scaled(
                ends.__name__, extreme, text, ends, frozenset(refused.split()), frozenset(unresolved.split())
            )
        )
        return ends

    return keep


def solved(rates: Callable[..., Sequence[Any]], stop: float, start: Sequence[float], **more: Any) -> Any:
    """Return the last state of equations in units of size one."""
    done = solve_ivp(rates, (0, stop), start, method="DOP853", rtol=1e-13, atol=1e-15, **more)
    assert done.success
    return done.y[:, -1]


def pendulum(angle: float, w: float, t: float) -> tuple[float, float]:
    """Return angle and rate of a plane pendulum that is let go: by Jacobi's functions."""
    k = mp.sin(mpf(angle) / 2)
    u = mp.ellipk(k * k) - mpf(w) * mpf(t)
    s, c, d = (mp.ellipfun(kind, u, m=k * k) for kind in ("sn", "cn", "dn"))
    del d
    return float(2 * mp.asin(k * s)), float(-2 * k * mpf(w) * c)


def kepler(e: float, mean: float) -> tuple[float, float, float, float]:
    """Return place and velocity on an orbit of half axis 1 and mean motion 1, a mean anomaly after the pericentre."""
    m = mpf(mean)
    E = mp.findroot(lambda x: x - e * mp.sin(x) - m, m)
    c, s, b = mp.cos(E), mp.sin(E), mp.sqrt(1 - mpf(e) ** 2)
    rate = 1 / (1 - e * c)
    return float(c - e), float(b * s), float(-s * rate), float(b * c * rate)


def damped(x0: Any, v0: Any, w: Any, d: Any, t: Any) -> tuple[float, float]:
    """Return x'' + 2 d x' + w^2 x = 0 at a time."""
    x0, v0, w, d, t = (mpf(a) for a in (x0, v0, w, d, t))
    r = mp.sqrt(mp.mpc(d * d - w * w))
    a, b = -d + r, -d - r
    A = (v0 - b * x0) / (a - b)
    B = x0 - A
    x = A * mp.exp(a * t) + B * mp.exp(b * t)
    v = A * a * mp.exp(a * t) + B * b * mp.exp(b * t)
    return float(x.real), float(v.real)


@case(
    "an orbit of 1.5e11 m and a mass that swings 1 nm in its tide: 1e20 in length",
    """
    parameter GM = 1.32712440018e20 m^3/s^2; parameter r0 = 1.5e11 m; parameter w = 2e-6 rad/s;
    coordinate x = r0; coordinate Length y = 0 m; initial der(y) = sqrt(GM/r0);
    coordinate u = 1 nm;
    let r = sqrt(x^2 + y^2);
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential -GM*1 kg/r;
    kinetic 1/2*1e-9 kg*der(u)^2; potential 1/2*1e-9 kg*w^2*u^2; force -1e-9 kg*GM/r^3*u on u;
    experiment(stop = 3e7 s);
    """,
)
def tide() -> Ends:
    n = mp.sqrt(mpf("1.32712440018e20") / mpf("1.5e11") ** 3)
    t, W = mpf("3e7"), mp.sqrt(mpf("2e-6") ** 2 + n * n)
    return {
        "x": (float(1.5e11 * mp.cos(n * t)), 1.5e11),
        "y": (float(1.5e11 * mp.sin(n * t)), 1.5e11),
        "u": (float(1e-9 * mp.cos(W * t)), 1e-9),
        "der(u)": (float(-1e-9 * W * mp.sin(W * t)), float(1e-9 * W)),
    }


@case(
    "masses of 1 kg and 1e-20 kg on springs of 1 N/m and 1e-20 N/m",
    """
    import mech.translational.*;
    Slider heavy(m = 1 kg, s = 1 m); Slider light(m = 1e-20 kg, s = 3 m, der(s) = 1 m/s);
    SpringDamper big(from = 0, to = heavy.s, k = 1 N/m, c = 0.1 N.s/m, rest = 0 m);
    SpringDamper small(from = heavy.s, to = light.s, k = 1e-20 N/m, c = 0 N.s/m, rest = 0 m);
    experiment(stop = 20 s);
    """,
)
def light_on_heavy() -> Ends:
    """The light one does not move the heavy one."""
    y = solved(lambda t, y: [y[2], y[3], -y[0] - 0.1 * y[2], y[0] - y[1]], 20, [1, 3, 0, 1])
    return {
        "heavy.s": (y[0], 1),
        "light.s": (y[1], 10),
        "der(heavy.s)": (y[2], 1),
        "der(light.s)": (y[3], 10),
    }


@case(
    "a chain of three masses, 1e-10, 1 and 1e10 kg, springs that fit: stiffness 1e-10 to 1e10 N/m",
    """
    parameter m[3] = {1e-10, 1, 1e10} kg; parameter k[3] = {1e-10, 1, 1e10} N/m;
    coordinate Length x[3] = {1, -0.5, 0.25} m;
    kinetic sum(1/2*m[i]*der(x[i])^2 for i in 1:3);
    potential 1/2*k[1]*(x[2] - x[1])^2 + 1/2*k[2]*(x[3] - x[2])^2 + 1/2*k[3]*x[3]^2;
    experiment(stop = 15 s);
    """,
)
def graded_chain() -> Ends:
    def rates(t: float, y: Any) -> list[float]:
        x, v = y[:3], y[3:]
        return [*v, x[1] - x[0], x[2] - x[1] + 1e-10 * (x[0] - x[1]), -x[2] + 1e-10 * (x[1] - x[2])]

    y = solved(rates, 15, [1, -0.5, 0.25, 0, 0, 0])
    return {f"x[{k + 1}]": (y[k], size) for k, size in enumerate((3, 2, 0.25))}


@case(
    "springs of 1e-10 and 1e10 N/m in series with a node that has no mass",
    """
    coordinate Length x = 1 m; coordinate Length node ~ 0 m; parameter soft = 1e-10 N/m; parameter hard = 1e10 N/m;
    kinetic 1/2*1e-10 kg*der(x)^2; potential 1/2*soft*(x - node)^2 + 1/2*hard*node^2;
    experiment(stop = 10 s);
    """,
)
def series() -> Ends:
    w = mp.sqrt(1 / (1 + mpf("1e-20")))
    x = mp.cos(10 * w)
    return {
        "x": (float(x), 1),
        "node": (float(x * mpf("1e-20")), 1e-20),
        "der(x)": (float(-mp.sin(10 * w)), 1),
    }


@case(
    "a ball that bounces 1 um high beside a planet at 1e11 m",
    """
    parameter n = 1e-3 rad/s; parameter R = 1e11 m;
    coordinate x = R; coordinate Length y = 0 m; initial der(y) = n*R;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 1/2*1 kg*n^2*(x^2 + y^2);
    coordinate h = 1 um; kinetic 1/2*1e-9 kg*der(h)^2; potential 1e-9 kg*9.81 m/s^2*h;
    contact floor: h restitution 0.5;
    experiment(stop = 1.2 ms);
    """,
)
def bounce_beside_planet() -> Ends:
    g, t = mpf("9.81"), mpf("1.2e-3")
    fall = mp.sqrt(2 * mpf("1e-6") / g)
    v, at = g * fall / 2, fall
    while at + 2 * v / g < t:
        at, v = at + 2 * v / g, v / 2
    s = t - at
    return {
        "h": (float(v * s - g * s * s / 2), 1e-6),
        "der(h)": (float(v - g * s), 4e-3),
        "x": (float(1e11 * mp.cos(mpf("1e-3") * t)), 1e11),
        "y": (float(1e11 * mp.sin(mpf("1e-3") * t)), 1e11),
    }


@case(
    "a speck of 1e-12 kg that friction stops beside a train of 1e8 kg: 1e20 in mass",
    """
    coordinate speck = 0 mm; initial der(speck) = 2 mm/s; kinetic 1/2*1e-12 kg*der(speck)^2;
    friction 1e-12 kg*1 mm/s^2 on speck;
    coordinate train = 0 km; initial der(train) = 30 m/s; kinetic 1/2*1e8 kg*der(train)^2; friction 1e8 N on train;
    experiment(stop = 5 s);
    """,
)
def speck_and_train() -> Ends:
    return {
        "speck": (2e-3, 2e-3),
        "der(speck)": (0.0, 2e-3),
        "train": (30 * 5 - 12.5, 150),
        "der(train)": (25, 30),
    }


@case(
    "lags of 1e-10 s, 1 s and 1e10 s in a row: 1e20 in time",
    """
    parameter T[3] = {1e-10, 1, 1e10} s; state Real a = 0; state Real b = 0; state Real c = 0;
    equation der(a) = (1 - a)/T[1]; equation der(b) = (a - b)/T[2]; equation der(c) = (b - c)/T[3];
    experiment(stop = 3 s);
    """,
)
def lags() -> Ends:
    t, (f, m, s) = mpf(3), (mpf("1e-10"), mpf(1), mpf("1e10"))
    b = 1 - (m * mp.exp(-t / m) - f * mp.exp(-t / f)) / (m - f)
    c = 1 - sum(p * p * mp.exp(-t / p) / ((p - q) * (p - r)) for p, q, r in ((f, m, s), (m, s, f), (s, f, m)))
    return {"a": (1, 1), "b": (float(b), 1), "c": (float(c), 2e-10)}


@case(
    "lags of 1e-10 s and 1e10 s seen over 1e10 s",
    """
    parameter fast = 1e-10 s; parameter slow = 1e10 s; state Real a = 1; state Real c = 0;
    equation der(c) = (1 - c)/slow; equation der(a) = (c - a)/fast;
    experiment(stop = 1e10 s);
    """,
)
def lags_seen_long() -> Ends:
    c = 1 - mp.exp(-1)
    return {"c": (float(c), 1), "a": (float(c), 1)}


@case(
    "pendulums of 1 nm and 1 km",
    """
    import mech.planar.*;
    gravity {0, -9.81 m/s^2};
    Body small(m = 1e-20 kg, com = {0, -1 nm}); Revolute pin(world -> small.a, angle = 1 rad);
    Body large(m = 1 kg, com = {0, -1 km}); Revolute hook(world * trans({5 km, 0 m}) -> large.a, angle = 2 rad);
    experiment(stop = 1 ms);
    """,
)
def two_pendulums() -> Ends:
    small = pendulum(1, np.sqrt(9.81 / 1e-9), 1e-3)
    large = pendulum(2, np.sqrt(9.81 / 1e3), 1e-3)
    return {
        "pin.angle": (small[0], 1),
        "der(pin.angle)": (small[1], 1e5),
        "hook.angle": (large[0], 2),
        "der(hook.angle)": (large[1], 1e-5),
    }


@case(
    "an electron of 9.1e-31 kg and an ion of 1e-11 kg (charged dust) in one field: 1e20 in mass",
    """
    parameter B = 1e-4 T; parameter e = 1.602176634e-19 C; parameter me = 9.1093837015e-31 kg;
    coordinate Length r[2] = {0, 0} m; initial der(r[1]) = 1e6 m/s; kinetic 1/2*me*dot(der(r), der(r));
    force -e*B*der(r[2]) on r[1]; force e*B*der(r[1]) on r[2];
    coordinate Length dust[2] = {0, 0} m; initial der(dust[1]) = 1e-3 m/s; kinetic 1/2*1e-11 kg*dot(der(dust), der(dust));
    force -1e6*e*B*der(dust[2]) on dust[1]; force 1e6*e*B*der(dust[1]) on dust[2];
    experiment(stop = 1 us);
    """,
)
def electron_and_dust() -> Ends:
    e, m, B, t = mpf("1.602176634e-19"), mpf("9.1093837015e-31"), mpf("1e-4"), mpf("1e-6")
    w, slow = e * B / m, mpf(10) ** 6 * e * B / mpf("1e-11")
    v, d = mpf(10) ** 6, mpf("1e-3")
    return {
        "r[1]": (float(v / w * mp.sin(w * t)), float(v / w)),
        "r[2]": (float(v / w * (1 - mp.cos(w * t))), float(v / w)),
        "der(r[1])": (float(v * mp.cos(w * t)), 1e6),
        "dust[1]": (float(d / slow * mp.sin(slow * t)), 1e-9),
        "dust[2]": (float(d * slow * t * t / 2), float(d * slow * t * t / 2)),
        "der(dust[1])": (1e-3, 1e-3),
    }


@case(
    "an electron about a nucleus: 5.3e-11 m, 2.4e-17 s, 9.1e-31 kg",
    """
    parameter k = 2.3e-28 N.m^2; parameter m = 9.1e-31 kg; parameter a = 5e-11 m; parameter ec = 0.6;
    coordinate Length r[2] = {a*(1 - ec), 0 m};
    initial der(r[2]) = sqrt(k/(m*a)*(1 + ec)/(1 - ec));
    kinetic 1/2*m*dot(der(r), der(r)); potential -k/norm(r);
    experiment(stop = 3e-16 s);
    """,
)
def electron_orbit() -> Ends:
    a, n = mpf("5e-11"), mp.sqrt(mpf("2.3e-28") / mpf("9.1e-31") / mpf("5e-11") ** 3)
    x, y, u, v = kepler(0.6, n * mpf("3e-16"))
    return {
        "r[1]": (float(x * a), 5e-11),
        "r[2]": (float(y * a), 5e-11),
        "der(r[1])": (float(u * a * n), float(a * n)),
        "der(r[2])": (float(v * a * n), float(a * n)),
    }


@case(
    "a star of 1e38 kg.m^2 and a rotor of 1e18 kg.m^2 that a gear joins: 1e20 in inertia",
    """
    import mech.rotational.*;
    Rotor star(J = 1e38 kg.m^2, angle = 0 rad, der(angle) = 1 rad/s); Rotor wheel(J = 1e18 kg.m^2);
    Gear gear(wheel.angle -> star.angle, ratio = 1e10);
    TorqueSource pull(from = star.angle, torque = 2e37 N.m);
    experiment(stop = 3 s);
    """,
)
def star_and_rotor() -> Ends:
    """Seen through the gear the small wheel is as heavy as the star: 1e18 (1e10)^2."""
    return {"star.angle": (3 + 0.1 * 9 / 2, 3.45), "der(star.angle)": (1.3, 1.3)}


@case(
    "a tether of two masses, 1 mm apart, on an orbit at 7e6 m, in local coordinates",
    """
    parameter n = 1e-3 rad/s; parameter k = 1e-9 N/m; parameter m = 1e-3 kg;
    coordinate x = 1 mm; coordinate Length y = 0 mm; coordinate R = 7e6 m; coordinate phi = 0 rad;
    initial der(phi) = n;
    kinetic 1/2*1e6 kg*(der(R)^2 + R^2*der(phi)^2); potential -1e6 kg*n^2*(7e6 m)^3/R;
    kinetic 1/2*m*(der(x)^2 + der(y)^2); lagrangian m*n*(x*der(y) - y*der(x)) + 3/2*m*n^2*x^2;
    potential 1/2*k*(x^2 + y^2);
    experiment(stop = 5000 s);
    """,
)
def tether() -> Ends:
    """In time of 1/n: Hill's equations with a spring of k/(m n^2) = 1."""
    y = solved(lambda t, y: [y[2], y[3], 2 * y[3] + 3 * y[0] - y[0], -2 * y[2] - y[1]], 5, [1, 0, 0, 0])
    return {
        "x": (y[0] * 1e-3, 5e-3),
        "y": (y[1] * 1e-3, 5e-3),
        "R": (7e6, 7e6),
        "phi": (5, 5),
        "der(x)": (y[2] * 1e-6, 5e-6),
    }


@case(
    "a spring of 1e20 N/m in a pendulum of 1 kg: 1e20 in stiffness",
    """
    parameter k = 1e20 N/m; parameter l = 1 m; parameter m = 1 kg; parameter g = 9.81 m/s^2;
    coordinate Length s = 0 m; coordinate a = 90 deg; let r = l + s;
    kinetic 1/2*m*(der(r)^2 + r^2*der(a)^2); potential 1/2*k*s^2 - m*g*r*cos(a);
    experiment(stop = 4 s);
    """,
)
def stiff_pendulum() -> Ends:
    a, w = pendulum(np.pi / 2, np.sqrt(9.81), 4)
    return {"a": (a, 1.6), "der(a)": (w, 4.4)}


@case(
    "a damper of 1e20 N.s/m in series with a spring of 1 N/m: creep of 1e-20",
    """
    coordinate Length x = 1 m; coordinate Length piston = 0 m;
    kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*(x - piston)^2; damping 1e20 N.s/m on piston;
    experiment(stop = 10 s);
    """,
)
def creep() -> Ends:
    return {
        "x": (float(mp.cos(10)), 1),
        "piston": (float(mp.sin(10) * mpf("1e-20")), 1e-20),
        "der(x)": (float(-mp.sin(10)), 1),
    }


@case(
    "a fault that is pulled at 1e-9 m/s and slips within seconds: 1e8 in time",
    """
    parameter v = 1e-9 m/s; coordinate Length x = 0 m;
    kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*(x - v*time)^2; friction 1 N static 2 N on x;
    experiment(stop = 5e9 s);
    """,
    refused="run",
)
def fault() -> Ends:
    """Sticks until the spring pulls with 2 N, slips by 2 m, and sticks 0 N off: cycles of 2 m/v."""
    return {"x": (4.0, 4.0), "der(x)": (0.0, 1.0)}


@case(
    "a controller that samples each 1e-9 s moves a mass of 1e-15 kg by 1e-12 m",
    """
    parameter m = 1e-15 kg; parameter target = 1e-12 m; discrete Force F = 0 N;
    coordinate Length x = 0 m; kinetic 1/2*m*der(x)^2; force F on x;
    when sample(1e-9 s) then
      F := 400 N/m*(target - x) - 6e-7 N.s/m*der(x);
    end when;
    experiment(stop = 20.5e-9 s);
    """,
)
def sampled() -> Ends:
    """In ns, pm and 1e-15 kg pm/ns^2 = 1e-9 N: 400 N/m is 0.4, 6e-7 N.s/m is 0.6."""
    x = v = mpf(0)
    for k in range(21):
        F = mpf("0.4") * (1 - x) - mpf("0.6") * v
        s = mpf(1) if k < 20 else mpf("0.5")
        x, v = x + v * s + F * s * s / 2, v + F * s
    return {"x": (float(x * mpf("1e-12")), 1e-12), "der(x)": (float(v * mpf("1e-3")), 3e-4)}


@case(
    "a rocket that burns from 1e10 kg to 1 kg",
    """
    parameter m0 = 1e10 kg; parameter m1 = 1 kg; parameter T = 100 s; parameter c = 3 km/s;
    let Mass m = m0*exp(-time/T*log(m0/m1));
    coordinate Length x = 0 m; mass m at world * {x, 0 m};
    force -c*der(m) on x;
    experiment(stop = 100 s);
    """,
)
def rocket() -> Ends:
    """The speed grows evenly: c log(m0/m) = c log(1e10) t/T."""
    v = 3000 * mp.log(mpf(10) ** 10)
    return {"der(x)": (float(v), float(v)), "x": (float(v * 50), float(v * 50))}


@case(
    "a ball of 1e-10 kg hits one of 1e10 kg, elastically: 1e20 in mass",
    """
    coordinate a = -1 m; initial der(a) = 1 m/s; coordinate b = 0 m; initial der(b) = -1 mm/s;
    kinetic 1/2*1e-10 kg*der(a)^2; kinetic 1/2*1e10 kg*der(b)^2;
    contact hit: b - a restitution 1;
    experiment(stop = 3 s);
    """,
)
def light_hits_heavy() -> Ends:
    ratio = mpf("1e-20")
    at = 1 / (1 + mpf("1e-3"))
    u, w = mpf(1), mpf("-1e-3")
    common = (ratio * u + w) / (1 + ratio)
    a, b = 2 * common - u, 2 * common - w
    return {
        "der(a)": (float(a), 1),
        "der(b)": (float(b), 1e-3),
        "a": (float(-1 + at + a * (3 - at)), 3),
        "b": (float(w * at + b * (3 - at)), 3e-3),
    }


@case(
    "a wall of 1e16 N/m that a ball of 1 kg touches for 3e-8 s in a flight of 2 s",
    """
    coordinate x = 1 m; initial der(x) = -1 m/s; kinetic 1/2*1 kg*der(x)^2;
    force if x < 0 m then -1e16 N/m*x else 0 N on x;
    experiment(stop = 2 s);
    """,
)
def hard_wall() -> Ends:
    x = 2 - 1 - mp.pi * mpf("1e-8")
    return {"x": (float(x), 1), "der(x)": (1, 1)}


@case(
    "a train of gears between inertias of 1e-10 and 1e10 kg.m^2",
    """
    import mech.rotational.*;
    Rotor motor(J = 1e-10 kg.m^2, angle = 0 rad); Rotor shaft(J = 1e-4 kg.m^2); Rotor mill(J = 1e10 kg.m^2);
    Gear first(motor.angle -> shaft.angle, ratio = 1e3); Gear second(shaft.angle -> mill.angle, ratio = 1e7);
    TorqueSource pull(from = motor.angle, torque = 1 N.m);
    experiment(stop = 4 s);
    """,
)
def gear_train() -> Ends:
    """On the mill: J = 1e10 + 1e-4 1e14 + 1e-10 1e20 = 3e10, M = 1e10."""
    a = mpf(1) / 3
    return {
        "mill.angle": (float(8 * a), 3),
        "der(mill.angle)": (float(4 * a), 1.4),
        "motor.angle": (float(8 * a * mpf(10) ** 10), 3e10),
    }


@case(
    "a pendulum of 1 m by a constraint in Cartesian coordinates, 1e5 m off the origin",
    """
    parameter X = 1e5 m; parameter l = 1 m; parameter m = 1e-10 kg; parameter g = 9.81 m/s^2;
    coordinate x ~ X + l; coordinate Length y = 0 m;
    kinetic 1/2*m*(der(x)^2 + der(y)^2); potential m*g*y;
    constraint rod: (x - X)^2 + y^2 = l^2;
    experiment(stop = 1.5 s);
    """,
)
def far_pendulum() -> Ends:
    a, w = pendulum(np.pi / 2, np.sqrt(9.81), 1.5)
    return {
        "x": (1e5 + np.sin(a), 1),
        "y": (-np.cos(a), 1),
        "der(x)": (np.cos(a) * w, 4.4),
        "der(y)": (np.sin(a) * w, 4.4),
    }


@case(
    "a pendulum of 1 um by a constraint, 1e6 m off the origin: the place keeps four digits of it",
    """
    parameter X = 1e6 m; parameter l = 1 um; parameter m = 1 kg; parameter g = 9.81 m/s^2;
    coordinate x ~ X + l; coordinate Length y = 0 m;
    kinetic 1/2*m*(der(x)^2 + der(y)^2); potential m*g*y;
    constraint rod: (x - X)^2 + y^2 = l^2;
    experiment(stop = 1 ms);
    """,
    unresolved="x y",
)
def lost_pendulum() -> Ends:
    a = pendulum(np.pi / 2, np.sqrt(9.81e6), 1e-3)[0]
    return {"x": (1e6 + 1e-6 * np.sin(a), 1e-6), "y": (-1e-6 * np.cos(a), 1e-6)}


@case(
    "a delay of 1e-9 s beside a lag of 1e6 s",
    """
    parameter T = 1e-9 s; state Real a = 1; state Real slow = 1;
    equation der(a) = -0.5/T*delay(a, T); equation der(slow) = -slow/1e6 s;
    experiment(stop = 2.5e-9 s);
    """,
    refused="python",
)
def delayed() -> Ends:
    """By the method of steps: a = sum over k of (-1/2)^k (t - k + 1)^k/k!, with a(t < 0) = 1."""
    t = mpf("2.5")
    a = sum((-mpf(1) / 2) ** k * (t - k + 1) ** k / mp.factorial(k) for k in range(4))
    return {"a": (float(a), 1), "slow": (1, 1)}


@case(
    "a double pendulum with bobs of 1 kg and 1e-20 kg",
    """
    import mech.planar.*;
    gravity {0, -9.81 m/s^2};
    Body upper(m = 1 kg, com = {0, -1 m}); Revolute shoulder(world -> upper.a, angle = 1 rad);
    Body lower(m = 1e-20 kg, com = {0, -1 m}); Revolute elbow(upper.a * trans({0, -1 m}) -> lower.a, angle = 0.3 rad);
    experiment(stop = 3 s);
    """,
)
def light_lower_bob() -> Ends:
    """The upper one is a pendulum; the lower one hangs from a point that moves so."""
    g = 9.81

    def rates(t: float, y: Any) -> list[float]:
        a, b, v, w = y
        acc = -g * np.sin(a)
        ax, ay = acc * np.cos(a) - v * v * np.sin(a), acc * np.sin(a) + v * v * np.cos(a)
        return [v, w, acc, -(g + ay) * np.sin(b) - ax * np.cos(b)]

    y = solved(rates, 3, [1, 1.3, 0, 0])
    return {
        "shoulder.angle": (y[0], 1),
        "elbow.angle": (y[1] - y[0], 2),
        "der(shoulder.angle)": (y[2], 3),
        "der(elbow.angle)": (y[3] - y[2], 6),
    }


@case(
    "a microscope mirror: a four-bar linkage of micrometres and picograms",
    """
    import mech.planar.*;
    Bar crank(m = 1e-15 kg, l = 1 um); Bar coupler(m = 2e-15 kg, l = 3 um); Bar rocker(m = 1.5e-15 kg, l = 2.5 um);
    Revolute a(world -> crank.a, angle = 1 rad, der(angle) = 1e6 rad/s);
    Revolute b(crank.b -> coupler.a, angle ~ -0.6 rad);
    Revolute d(world * trans({3 um, 0 um}) -> rocker.a, angle ~ 1.8 rad);
    cut Revolute c(coupler.b -> rocker.b);
    experiment(stop = 3 us);
    """,
)
def micro_four_bar() -> Ends:
    """One angle in um, pg and us: T = I(a) a'^2/2 is kept; the position of the rocker by the cosine rule."""
    l1, l2, l3, l0 = 1.0, 3.0, 2.5, 3.0
    m1, m2, m3 = 1.0, 2.0, 1.5

    def angles(a: Any) -> tuple[Any, Any]:
        p = np.array([l1 * np.cos(a), l1 * np.sin(a)])
        d = np.array([l0, 0]) - p
        r = np.hypot(*d)
        at = np.arctan2(d[1], d[0]) + np.arccos((l2**2 + r**2 - l3**2) / (2 * l2 * r))
        end = p + l2 * np.array([np.cos(at), np.sin(at)])
        return at, np.arctan2(end[1], end[0] - l0)

    def ratios(a: Any) -> tuple[Any, Any]:
        b, c = angles(a)
        return l1 * np.sin(a - c) / (l2 * np.sin(c - b)), l1 * np.sin(a - b) / (l3 * np.sin(c - b))

    def inertia(a: Any) -> Any:
        b = angles(a)[0]
        kb, kc = ratios(a)
        v = l1**2 + (kb * l2 / 2) ** 2 + l1 * l2 * kb * np.cos(b - a)
        return m1 * l1**2 / 3 + m2 * (v + l2**2 / 12 * kb**2) + m3 * l3**2 / 3 * kc**2

    first = inertia(1.0)
    a = solved(lambda t, y: [np.sqrt(first / inertia(y[0]))], 3, [1.0])[0]
    b, c = angles(a)
    return {
        "a.angle": (a, 4),
        "b.angle": (b - a, 4),
        "d.angle": (c, 2),
        "der(a.angle)": (float(np.sqrt(first / inertia(a))) * 1e6, 1e6),
    }


@case(
    "a molecule bent at 1e-10 m, of 1e-26 kg and springs of 500 N/m, by parts of the library",
    """
    import mech.planar.*;
    Particle left(m = 1.6e-27 kg); Particle middle(m = 26.6e-27 kg);
    Translation a(world -> left.a, position = {-1.1e-10 m, 0 m}); Translation b(world -> middle.a, position = {0 m, 0 m});
    Spring bond(left.a -> middle.a, k = 500 N/m, rest = 1e-10 m);
    experiment(stop = 1e-13 s);
    """,
)
def molecule() -> Ends:
    m, M = mpf("1.6e-27"), mpf("26.6e-27")
    w = mp.sqrt(500 * (1 / m + 1 / M))
    s = mpf("1e-11") * (1 - mp.cos(w * mpf("1e-13")))
    return {
        "a.position[1]": (float(mpf("-1.1e-10") + s * M / (m + M)), 1e-11),
        "b.position[1]": (float(-s * m / (m + M)), 1e-12),
    }


@case(
    "an asteroid of 1e32 kg.m^2 that tumbles once a day, and a gyroscope of 1e-8 kg.m^2 at 1e4 rad/s",
    """
    coordinate Rotation rock = rotz(0 rad); initial der(rock) = {1e-5, 7e-5, 2e-5} rad/s;
    inertia diag({1e32, 2e32, 3e32} kg.m^2) on world * rock;
    coordinate Rotation gyro = rotz(0 rad); initial der(gyro) = {1, 0, 1e4} rad/s;
    inertia diag({1e-8, 1e-8, 2e-8} kg.m^2) on world * gyro;
    experiment(stop = 5e-3 s);
    """,
)
def tumbling() -> Ends:
    """A symmetric top in its own axes: w1 + i w2 turns at (C - A)/A w3."""
    t, W = mpf("5e-3"), mpf(10) ** 4
    return {
        "der(gyro)[1]": (float(mp.cos(W * t)), 1),
        "der(gyro)[2]": (float(mp.sin(W * t)), 1),
        "der(rock)[2]": (7e-5 + 2e-10 * 5e-3, 7e-5),
    }


@case(
    "a decay of 1e17 s seen at its half, by an event that ends the run",
    """
    state Real n = 1; parameter T = 1e17 s; discrete Integer half = 0;
    equation der(n) = -n/T;
    when n < 0.5 then half := 1; terminate("half is gone"); end when;
    coordinate Length x = 0 m; initial der(x) = 1e-3 m/s; kinetic 1/2*1e-20 kg*der(x)^2;
    experiment(stop = 1e18 s);
    """,
)
def decay() -> Ends:
    t = mpf(10) ** 17 * mp.log(2)
    return {
        "n": (0.5, 1),
        "x": (float(t * mpf("1e-3")), float(t * mpf("1e-3"))),
        "time": (float(t), float(t)),
    }


@case(
    "a base that shakes 1e-12 m moves an axle by a drive, beside a satellite at 4e7 m",
    """
    parameter w = 2 rad/s; parameter A = 1e-12 m;
    coordinate Length base; drive base = A*sin(w*time);
    coordinate Length body = 0 m; kinetic 1/2*2 kg*der(body)^2; potential 1/2*18 N/m*(body - base)^2;
    coordinate far = 4e7 m; initial der(far) = -3 km/s; kinetic 1/2*1 kg*der(far)^2;
    experiment(stop = 5 s);
    """,
)
def shaken_base() -> Ends:
    """Both begin at rest but the base: x = A W^2/(W^2 - w^2) (sin w t - w/W sin W t), W = 3."""
    t, w, W = mpf(5), mpf(2), mpf(3)
    x = mpf("1e-12") * W**2 / (W**2 - w**2) * (mp.sin(w * t) - w / W * mp.sin(W * t))
    v = mpf("1e-12") * W**2 / (W**2 - w**2) * w * (mp.cos(w * t) - mp.cos(W * t))
    return {"body": (float(x), 3e-12), "der(body)": (float(v), 6e-12), "far": (4e7 - 15e3, 4e7)}


@case(
    "a knife edge of 1e-18 kg: a constraint of velocities",
    """
    parameter m = 1e-18 kg; parameter J = 1e-36 kg.m^2; parameter w = 1e3 rad/s;
    coordinate Length x = 0 m; coordinate Length y = 0 m; coordinate a = 0 rad;
    initial der(a) = w; initial der(x) = 1e-6 m/s;
    kinetic 1/2*m*(der(x)^2 + der(y)^2) + 1/2*J*der(a)^2;
    constraint edge: -sin(a)*der(x) + cos(a)*der(y) = 0;
    experiment(stop = 2 ms);
    """,
)
def knife_edge() -> Ends:
    """Goes round on a circle of v/w = 1 nm."""
    return {
        "x": (1e-9 * np.sin(2), 1e-9),
        "y": (1e-9 * (1 - np.cos(2)), 1e-9),
        "a": (2, 2),
        "der(x)": (1e-6 * np.cos(2), 1e-6),
    }


@case(
    "a stack of 1e-10 kg on 1e10 kg on a floor that falls: contacts at rest",
    """
    parameter g = 9.81 m/s^2; coordinate low = 1 m; coordinate high = 3 m;
    kinetic 1/2*1e10 kg*der(low)^2; kinetic 1/2*1e-10 kg*der(high)^2;
    potential 1e10 kg*g*low + 1e-10 kg*g*high;
    contact floor: low - 1 m; contact stack: high - low - 2 m;
    output press = multiplier(stack); output ground = multiplier(floor);
    experiment(stop = 1 s);
    """,
)
def stack() -> Ends:
    return {"low": (1, 1), "high": (3, 3)}


@case(
    "a pendulum clock: a kick of 1e-12 N.s on 1e-9 kg at each pass, for 1 s, with a second hand of 1e3 kg.m^2",
    """
    parameter w = 10 rad/s; parameter J = 1e-15 kg.m^2; parameter kick = 1e-17 N.m.s; discrete Integer passes = 0;
    coordinate a = 1e-3 rad; kinetic 1/2*J*der(a)^2; potential 1/2*J*w^2*a^2;
    coordinate hand = 0 rad; initial der(hand) = 0.1 rad/s; kinetic 1/2*1e3 kg.m^2*der(hand)^2;
    when a > 0 rad then reinit(der(a), der(a) + kick/J); passes := passes + 1; end when;
    experiment(stop = 2 s);
    """,
)
def clock() -> Ends:
    """At each pass upwards (3 pi/2, 7 pi/2, 11 pi/2 of the phase) the speed grows by kick/J = 0.01 rad/s."""
    amplitude = 1e-2 + 3 * 1e-2
    phase = 20 - 11 * np.pi / 2
    return {
        "a": (amplitude / 10 * np.sin(phase), 4e-3),
        "der(a)": (amplitude * np.cos(phase), 4e-2),
        "hand": (0.2, 0.2),
        "passes": (3, 3),
    }


@case(
    "an integral over time of 1e-18 J beside one of 1e12 J",
    """
    coordinate x = 1 nm; kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*x^2;
    coordinate X = 1 km; kinetic 1/2*1e6 kg*der(X)^2; potential 1/2*4e6 N/m*X^2;
    output small = integral(1 N/m*x^2); output large = integral(1 N/m*X^2);
    experiment(stop = 7 s);
    """,
)
def integrals() -> Ends:
    return {
        "x": (float(mp.mpf("1e-9") * mp.cos(7)), 1e-9),
        "X": (float(1000 * mp.cos(14)), 1000),
        "small": (float(mpf("1e-18") * (mpf(7) / 2 + mp.sin(14) / 4)), 4e-18),
        "large": (float(mpf("1e6") * (mpf(7) / 2 + mp.sin(28) / 8)), 4e6),
    }


@case(
    "an orbit of eccentricity 0.999999: speeds and times of 1e6 and 1e9",
    """
    parameter GM = 1 m^3/s^2; parameter e = 0.999999;
    coordinate x = 1 m + e*1 m; coordinate Length y = 0 m; initial der(y) = sqrt(GM/1 m*(1 - e)/(1 + e));
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential -GM*1 kg/sqrt(x^2 + y^2);
    experiment(stop = 5 s, tolerance = 1e-11);
    """,
)
def grazing_orbit() -> Ends:
    """From the apocentre, which is on the other side there."""
    x, y, u, v = kepler(0.999999, float(mp.pi) + 5.0)
    return {"x": (-x, 2), "y": (-y, 1e-3), "der(x)": (-u, 1), "der(y)": (-v, 1e-3)}


@case(
    "a thread of 1e-9 kg on a roll of 1e11 kg.m^2 unwinds by friction along",
    """
    import mech.rotational.*;
    Rotor roll(J = 1e11 kg.m^2, angle = 0 rad, der(angle) = 1 rad/s); Rotor thread(J = 1e-9 kg.m^2, angle = 0 rad);
    friction 1e-9 N.m on thread.angle - roll.angle;
    experiment(stop = 3 s);
    """,
)
def clutch() -> Ends:
    """Slips for 1 s, then both turn alike."""
    return {
        "roll.angle": (3, 3),
        "thread.angle": (2.5, 2.5),
        "der(thread.angle)": (1, 1),
        "der(roll.angle)": (1, 1),
    }


@case(
    "a relay that holds 1e-6 K, with lags of 1 s and 1e8 s",
    """
    parameter T = 1 s; state Real heat = 0; discrete Integer on = 1; state Real room = 0;
    equation der(heat) = (1e-6*on - heat)/T; equation der(room) = (heat - room)/1e8 s;
    when heat > 0.6e-6 then on := 0; elsewhen heat < 0.4e-6 then on := 1; end when;
    experiment(stop = 5 s);
    """,
    unresolved="room",
)
def relay() -> Ends:
    t, h, on, left = mpf(0), mpf(0), True, mpf(5)
    area = mpf(0)
    while True:
        limit = mpf("0.6") if on else mpf("0.4")
        aim = mpf(1) if on else mpf(0)
        takes = mp.log((aim - h) / (aim - limit))
        step = min(takes, left)
        new = aim + (h - aim) * mp.exp(-step)
        area += aim * step + (h - aim) * (1 - mp.exp(-step))
        t, left, h = t + step, left - step, new
        if left <= 0:
            break
        on = not on
    return {
        "heat": (float(h * mpf("1e-6")), 1e-6),
        "room": (float(area * mpf("1e-14")), 3e-14),
        "on": (float(on), 1),
    }


@case(
    "Kepler's equation as an unknown, of an orbit of 1e13 m and of a dust grain at 1e-7 m",
    """
    parameter e = 0.9; parameter n = 1e-9 rad/s; let Angle M = n*time;
    output Angle E ~ M + e*sin(M); equation E - e*sin(E) = M;
    output Length far = 1e13 m*(cos(E) - e); output Length near = 1e-7 m*(cos(E) - e);
    coordinate grain = 1e-7 m; kinetic 1/2*1e-18 kg*der(grain)^2; force -1e-36 kg/s^2*near on grain;
    experiment(stop = 2e9 s);
    """,
)
def unknown() -> Ends:
    """grain'' = -1e-18 1/s^2 near: twice integrated over n t."""
    E = mp.findroot(lambda x: x - mpf("0.9") * mp.sin(x) - 2, 2)
    x = mp.cos(E) - mpf("0.9")

    def near(m: Any) -> Any:
        r = mp.findroot(lambda q: q - mpf("0.9") * mp.sin(q) - m, m + mpf("0.9") * mp.sin(m))
        return mp.cos(r) - mpf("0.9")

    moved = mp.quad(lambda m: (2 - m) * near(m), [0, 0.05, 0.2, 0.5, 1, 2])
    return {
        "far": (float(x * mpf(10) ** 13), 1e13),
        "near": (float(x * mpf("1e-7")), 1e-7),
        "grain": (float(mpf("1e-7") * (1 - moved)), 1e-7),
    }


@case(
    "a bead of 1e-12 kg on a rough ring of 1e8 m that turns: normal force and friction",
    """
    parameter R = 1e8 m; parameter mu = 0.2; coordinate s = 0 rad; initial der(s) = 1e-3 rad/s;
    kinetic 1/2*1e-12 kg*R^2*der(s)^2;
    force -mu*1e-12 kg*R^2*der(s)*abs(der(s)) on s;
    coordinate tick = 1e-6 m; kinetic 1/2*1e-6 kg*der(tick)^2; potential 1/2*1e-12 N/m*tick^2;
    experiment(stop = 1e4 s);
    """,
)
def bead_on_ring() -> Ends:
    w = 1e-3
    return {
        "s": (np.log1p(0.2 * w * 1e4) / 0.2, 5),
        "der(s)": (w / (1 + 0.2 * w * 1e4), 1e-3),
        "tick": (1e-6 * float(mp.cos(10)), 1e-6),
    }


@case(
    "a slider crank of 1e-6 m whose piston of 1e6 kg a spring of 1e6 N/m holds",
    """
    import mech.planar.*;
    Bar crank(m = 1e-14 kg, l = 1 um); Bar rod(m = 1e-14 kg, l = 3 um); Body piston(m = 1e6 kg);
    Revolute main(world -> crank.a, angle = 90 deg); Revolute big(crank.b -> rod.a, angle ~ -110 deg);
    Prismatic guide(world -> piston.a, axis = {1, 0}, position ~ 2.8 um);
    cut Revolute small(rod.b -> piston.a);
    force -1e6 N/m*(guide.position - 3.5 um) on guide.position;
    experiment(stop = 1 s);
    """,
)
def micro_crank() -> Ends:
    """The piston is all that weighs: a mass on a spring, and the crank follows by the cosine rule."""
    x = 3.5 + (np.sqrt(8) - 3.5) * np.cos(1.0)
    v = -(np.sqrt(8) - 3.5) * np.sin(1.0)
    a = np.arccos((x * x + 1 - 9) / (2 * x))
    return {"guide.position": (x * 1e-6, 1e-6), "main.angle": (a, 1), "der(guide.position)": (v * 1e-6, 1e-6)}


@case(
    "stars of 1e30 kg and a probe of 1e-10 kg that swings between them in a saddle: 1e40 in mass",
    """
    parameter G = 6.674e-11 N.m^2/kg^2; parameter M = 1e30 kg; parameter d = 1e11 m; parameter m = 1e-10 kg;
    coordinate z = 1e3 m;
    kinetic 1/2*m*der(z)^2; potential -2*G*M*m/sqrt(d^2 + z^2);
    experiment(stop = 1e7 s);
    """,
)
def probe() -> Ends:
    """Small beside d: a linear spring to 1e-16."""
    w = mp.sqrt(2 * mpf("6.674e-11") * mpf(10) ** 30 / mpf(10) ** 33)
    t = mpf(10) ** 7
    return {
        "z": (float(1000 * mp.cos(w * t)), 1e3),
        "der(z)": (float(-1000 * w * mp.sin(w * t)), float(1000 * w)),
    }
