"""Each part that carries a force tells it: that it does, and that what it says is what acts, by the momentum of what it acts on."""

from __future__ import annotations

import numpy as np
import pytest
from gallery import ROOT

import mechc
from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.read import read_source

ACTING = (ast.Load, ast.Damping, ast.Energy, ast.Friction, ast.Constraint, ast.Contact)
APART = ("planar", "spatial", "suspension", "machines", "contact", "shapes")
"""Modules of bodies, joints, which have reactions, and assemblies; force elements of the first two are compared below."""
OPEN = {"PointOnCurve", "PointOnSurface"}
"""The heir's formula decides the unit of the multiplier."""
GIVEN = {"TorqueSource", "ForceSource"}
"""Their force is what they are given."""
INERT = {"Rotor", "Slider"}
"""Energies of what moves."""


def test_every_part_that_carries_a_force_tells_it() -> None:
    silent = []
    for path in sorted((ROOT / "stdlib").glob("*.mech")):
        for model in parse(read_source(path), Reporter()).items:
            if path.stem in APART or not isinstance(model, ast.Model) or model.name in OPEN | GIVEN | INERT:
                continue
            told = [s for s in model.body if isinstance(s, ast.Output) and s.type in ("Force", "Torque")]
            if any(isinstance(s, ACTING) for s in model.body) and not told:
                silent.append(f"{path.stem}.{model.name}")
    assert silent == []


LINES: dict[str, dict[str, tuple[str, tuple[float | None, float]]]] = {
    "rotational": {
        "SpringDamper": ("SpringDamper p(a -> b, k = 3 N.m/rad, c = 0.4 N.m.s, rest = 0.1 rad);", (1, -1)),
        "Backlash": ("Backlash p(a -> b, k = 30 N.m/rad, c = 0.4 N.m.s);", (1, -1)),
        "Gear": ("Gear p(a -> b, ratio = 2.5);", (-1 / 2.5, 1)),
        "LossyGear": ("LossyGear p(a -> b, ratio = 2.5, efficiency = 0.8, back_efficiency = 0.7);", (None, 1)),
        "VariableLossGear": ("VariableLossGear p(a -> b, ratio = 2.5, efficiency = 0.8 - 0.1*sin(3 rad/s*time), back_efficiency = 0.7);", (None, 1)),
        "Clutch": ("Clutch p(a -> b, press = 3 N);", (-1, 1)),
        "Brake": ("Brake p(a -> b, press = 3 N);", (1, -1)),
        "OneWayClutch": ("OneWayClutch p(a -> b, drag = 0.2 N.m);", (-1, 1)),
        "BearingFriction": ("BearingFriction p(a -> b, coulomb = 0.3 N.m, viscous = 0.1 N.m.s);", (1, -1)),
        "EddyCurrentBrake": ("EddyCurrentBrake p(a -> b, peak = 0.4 N.m);", (1, -1)),
        "Stop": ("Stop p(a -> b, low = -0.5 rad, high = -0.25 rad);", (1, -1)),
        "SpeedSource": ("SpeedSource p(a -> b, speed = (3 rad/s^2)*time);", (1, -1)),
        "DCMotor": ("DCMotor p(a -> b, voltage = 3 V);", (1, -1)),
        "Servo": ("Servo p(a -> b, target = 1 rad);", (1, -1)),
    },
    "translational": {
        "SpringDamper": ("SpringDamper p(a -> b, k = 3 N/m, c = 0.4 N.s/m, rest = 0.1 m);", (1, -1)),
        "Gap": ("Gap p(a -> b, rest = 0.5 m, k = 30 N/m, c = 0.4 N.s/m);", (-1, 1)),
        "GasSpring": ("GasSpring p(a -> b, charged = 0 m, volume = 3 m, area = 1 cm^2);", (-1, 1)),
        "ShockAbsorber": ("ShockAbsorber p(a -> b, low = 3 N.s/m, high = 1 N.s/m);", (1, -1)),
        "Rack": ("Rack p(a/1 m*1 rad -> b, r = 0.4 m);", (-0.4, 1)),
        "LeadScrew": ("LeadScrew p(a/1 m*1 rad -> b, lead = 0.4 m);", (-0.4 / (2 * np.pi), 1)),
        "Brake": ("Brake p(a -> b, press = 3 N);", (1, -1)),
        "StribeckFriction": ("StribeckFriction p(a -> b, coulomb = 0.3 N, viscous = 0.1 N.s/m);", (1, -1)),
        "EddyCurrentBrake": ("EddyCurrentBrake p(a -> b, peak = 0.4 N);", (1, -1)),
        "Stop": ("Stop p(a -> b, low = -0.5 m, high = -0.25 m);", (1, -1)),
        "Cylinder": ("Cylinder p(a -> b, retracted = -0.3 m, stroke = 3 m, flow1 = 1 l/min, bulk = 1e3 Pa);", (-1, 1)),
        "SpeedSource": ("SpeedSource p(a -> b, speed = (3 m/s^2)*time);", (1, -1)),
    },
}  # fmt: skip
"""On two coordinates: what the told force, times these, is on each."""


@pytest.mark.parametrize(("package", "part"), [(p, n) for p, parts in LINES.items() for n in parts])
def test_what_is_told_is_what_acts(package: str, part: str) -> None:
    """J a'' is the driving force and what the part says, on both sides, at all places of a motion."""
    turns = package == "rotational"
    kind, one, force, inertia = ("Angle", "rad", "N.m", "kg.m^2") if turns else ("Length", "m", "N", "kg")
    text, signs = LINES[package][part]
    joined = "" if part in ("Gear", "LossyGear", "VariableLossGear", "Rack", "LeadScrew", "SpeedSource") else f" initial a = 0 {one}; initial b = 0.3 {one}; initial der(a) = 0.4 {one}/s;"  # fmt: skip
    s = mechc.loads(
        f"import mech.{package}.*;\nmodel M coordinate {kind} a ~ 0 {one}; coordinate {kind} b ~ 0 {one};\n{joined} kinetic 1/2*2 {inertia}*der(a)^2 + 1/2*3 {inertia}*der(b)^2;\n"
        f" force 0.7 {force}*cos(2 s^-1*time) on a; force -0.2 {force} on b;\n{text}\n output A = der(a, 2); output B = der(b, 2); experiment(stop = 1.5 s, tolerance = 1e-10); end M;"
    ).simulate(estimate_error=False)
    assert s.outcome.value == "completed", s.message
    told = s["p.torque" if "p.torque" in s.quantities else "p.push" if "p.push" in s.quantities else "p.pull"]
    assert np.abs(told).max() > 0.01
    for acceleration, mass, driven, sign in (
        (s["A"], 2, 0.7 * np.cos(2 * s.time), signs[0]),
        (s["B"], 3, -0.2, signs[1]),
    ):
        if sign is not None:
            assert mass * acceleration - driven == pytest.approx(
                sign * told, abs=1e-9 * max(1, np.abs(told).max())
            )


ELASTIC = {
    "Bushing": "Bushing p(post -> b.a, K = {{30, 2, 1}, {2, 20, 3}, {1, 3, 10}} N/m, R = {{3, 0.2, 0.1}, {0.2, 2, 0.3}, {0.1, 0.3, 1}} N.m/rad, "
    "Q = {{0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}, {0.7, 0.8, 0.9}} N, C = {{3, 0.2, 0.1}, {0.2, 2, 0.3}, {0.1, 0.3, 1}} N.s/m, "
    "D = {{0.3, 0.02, 0.01}, {0.02, 0.2, 0.03}, {0.01, 0.03, 0.1}} N.m.s);",
    "Bearing": "Bearing p(post -> b.a, radial = 30 N/m, axial = 20 N/m, tilting = 3 N.m/rad, radial_damping = 2 N.s/m, axial_damping = 1 N.s/m, tilting_damping = 0.4 N.m.s);",
}


@pytest.mark.parametrize("part", ELASTIC)
def test_forces_and_moments_of_elastic_joints(part: str) -> None:
    """m a = -F and, of a body with equal moments of inertia about its frame, J w' = -M, in the axes of `from`."""
    s = mechc.loads(
        "import mech.spatial.*;\nimport mech.elements.*;\nmodel M Body b(m = 2 kg, J = 3*identity(3) kg.m^2); frame post = world * rotx(20 deg) * rotz(30 deg);"
        " Free f(world -> b.a, position = {0.2, -0.3, 0.1} m, orientation = rotz(0.4 rad)*rotx(0.3 rad), der(position) = {0.4, 0.2, -0.3} m/s, der(orientation) = {0.5, -0.2, 0.3} rad/s);"
        f" {ELASTIC[part]} output F[3] = -2 kg*components(post, der(vel(b.a))); output M[3] = -3 kg.m^2*components(post, der(angvel(b.a))); experiment(stop = 1 s, tolerance = 1e-10); end M;"
    ).simulate(estimate_error=False)
    for k in (1, 2, 3):
        assert s[f"p.F[{k}]"] == pytest.approx(s[f"F[{k}]"], abs=1e-9)
        assert s[f"p.M[{k}]"] == pytest.approx(s[f"M[{k}]"], abs=1e-9)
    assert np.abs(s["p.M[3]"]).max() > 0.02


LINE = {
    "spatial": {"Spring": "k = 30 N/m, rest = 0.2 m", "Damper": "c = 3 N.s/m"},
    "elements": {
        "Maxwell": "k = 30 N/m, c = 4 N.s/m",
        "Rope": "l = 0.2 m, EA = 30 N, c = 3 N.s/m",
        "Tether": "l = sqrt(0.14) m",
    },
    "couplings": {"Distance": "l = sqrt(0.14) m"},
    "fields": {
        "InverseSquare": "k = 0.3 J.m",
        "CentralField": "V0 = 2 J",
        "Gravitation": "G = 0.3 m^3/kg/s^2",
        "Coulomb": "q1 = 2 uC, q2 = -3 uC",
    },
}


@pytest.mark.parametrize(("package", "part"), [(p, n) for p, parts in LINE.items() for n in parts])
def test_forces_along_a_line(package: str, part: str) -> None:
    """m a along the line to the other end is what the part tells."""
    still = part in ("Tether", "Distance")
    s = mechc.loads(
        f"import mech.spatial.*;\nimport mech.{package}.*;\nmodel M Particle b(m = 2 kg); Translation f(world -> b.a, position ~ {{0.2, -0.3, 0.1}} m, der(position) ~ {{0.3, 0.2, {0 if still else -0.3}}} m/s);"
        f" {part} p(world -> b.a, {LINE[package][part]}); output F = -2 kg*dot(der(vel(b.a)), pos(b.a))/norm(pos(b.a)); experiment(stop = 0.3 s, tolerance = 1e-10); end M;"
    ).simulate(estimate_error=False)
    told = next(s[f"p.{name}"] for name in ("tension", "pull", "push") if f"p.{name}" in s.quantities)
    assert s["F"] == pytest.approx(-told if part == "Coulomb" else told, abs=1e-9)
    assert np.abs(told).max() > 0.01
