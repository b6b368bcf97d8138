"""Fourteen small models, one for each way in which a run differs: what the command line is tried on."""

from __future__ import annotations

from typing import NamedTuple


class Small(NamedTuple):
    """A model with a ``parameter`` and a ``coordinate`` (of ``experiment(stop = 0.5 s)``), and its inputs."""

    text: str
    parameter: str = "a"
    coordinate: str = "x"
    input: str = ""


def _crowd() -> str:
    balls = (
        f"coordinate y{k} = {1 + k} cm; kinetic 1/2*1 kg*der(y{k})^2; potential 1 kg*a*y{k}; contact floor{k}: y{k};"
        for k in range(70)
    )
    return "parameter a = 9.81 m/s^2;" + "\n".join(balls)


MODELS: dict[str, Small] = {
    "smooth": Small(
        "parameter a = 4 N/m; coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*a*x^2;"
    ),
    "loop": Small(
        """gravity {0, -9.81} m/s^2; parameter a = 0.2 m;
        Bar crank(m = 1 kg, l = a); Bar coupler(m = 2 kg, l = 0.5 m); Bar rocker(m = 1.5 kg, l = 0.4 m);
        frame pivot = world * trans({0.5 m, 0});
        Revolute shaft(world -> crank.a, angle = 60 deg); Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
        Revolute d(pivot -> rocker.a, angle ~ 90 deg); cut Revolute c(coupler.b -> rocker.b);""",
        coordinate="shaft.angle",
    ),
    "quaternion": Small(
        """parameter a = 2 kg.m^2; coordinate Rotation R; initial der(R) = {0.1, 3, 0.1} rad/s;
        inertia diag({1 kg.m^2, a, 3 kg.m^2}) on world*R; output w = der(R)[1];""",
        coordinate="der(R)[1]",
    ),
    "rolling": Small(
        """parameter a = 0.5 m; coordinate x = 0 m; coordinate y = 0 m; coordinate Angle phi = 0 rad;
        coordinate Angle theta = 0 rad; initial der(theta) = 2 rad/s; initial der(phi) = 1 rad/s;
        kinetic 1/2*1 kg*(der(x)^2 + der(y)^2) + 1/2*0.1 kg.m^2*der(theta)^2 + 1/2*0.05 kg.m^2*der(phi)^2;
        constraint along: der(x) = a*cos(phi)*der(theta); constraint across: der(y) = a*sin(phi)*der(theta);""",
        coordinate="phi",
    ),
    "contact": Small(
        """parameter a = 0.7; coordinate x = 0.2 m; kinetic 1/2*1 kg*der(x)^2; potential 1 kg*9.81 m/s^2*x;
        contact floor: x restitution a;"""
    ),
    "friction": Small(
        """parameter a = 2 N; coordinate x = 0 m; initial der(x) = 0.5 m/s; kinetic 1/2*1 kg*der(x)^2;
        friction a on x;"""
    ),
    "when": Small(
        """parameter a = 2 N; coordinate x = 0 m; discrete Integer n = 0; kinetic 1/2*1 kg*der(x)^2;
        force a*(1 + n) on x; when time >= 0.2 s then n := n + 1; end when;"""
    ),
    "sample": Small(
        """parameter a = 40 N/m; coordinate x = 1 m; discrete Force u = 0 N; kinetic 1/2*1 kg*der(x)^2;
        when sample(20 ms) then u := -a*x; end when; force u on x;"""
    ),
    "table": Small(
        """parameter a = 2; input Force u = 1 N; coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; force a*u on x;""",
        input="u",
    ),
    "driven": Small(
        """parameter a = 4 N/m; input Length u(interpolation = "spline") = 0.1 m; coordinate s = 0 m; coordinate x = 0.2 m;
        kinetic 1/2*1 kg*(der(s)^2 + der(x)^2); potential 1/2*a*(x - s)^2; drive s = u;""",
        input="u",
    ),
    "integral": Small(
        """parameter a = 4 N/m; coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*a*x^2;
        damping 0.3 N.s/m on x; output I = integral(x^2);"""
    ),
    "unknown": Small(
        """parameter a = 4 N/m; coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*a*x^2;
        output Real z ~ 1; equation z^3 + z = 2 + x/1 m;"""
    ),
    "ended": Small(
        """parameter a = 4 N/m; coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*a*x^2;
        when time >= 0.3 s then terminate("enough"); end when;"""
    ),
    "crowd": Small(_crowd(), coordinate="y0"),
}


def whole(name: str) -> str:
    """Return the text of a model as a file holds it."""
    head = "import mech.planar.*;\n" if name == "loop" else ""
    ends = f"experiment(stop = 0.5 s);\nexperiment later(stop = 0.3 s);\nend {name.capitalize()};\n"
    return f"{head}model {name.capitalize()}\n{MODELS[name].text}\n{ends}"
