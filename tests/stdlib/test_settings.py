"""Damping, friction, springs, rotors and stops of joints: as if stated beside the joint, and nothing where they are not given."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gallery import ROOT

import mechc
from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.read import read_source

TURNING = ("0.3 N.m.s", "0.2 N.m", "4 N.m/rad", "0.1 rad", "0.5 kg.m^2", "{-0.3, 0.25} rad")
SLIDING = ("0.3 N.s/m", "0.2 N", "4 N/m", "0.1 m", "0.5 kg", "{-0.3, 0.25} m")
JOINTS = {
    ("planar", "Revolute"): ("angle", 1, TURNING),
    ("planar", "Prismatic"): ("position", 1, SLIDING),
    ("planar", "RollingOnCircle"): ("angle", 1, TURNING),
    ("planar", "Rolling"): ("position", 1, SLIDING),
    ("planar", "Translation"): ("position", 2, SLIDING),
    ("spatial", "Revolute"): ("angle", 1, TURNING),
    ("spatial", "Prismatic"): ("position", 1, SLIDING),
    ("spatial", "Screw"): ("angle", 1, TURNING),
    ("spatial", "Universal"): ("angle", 2, TURNING),
    ("spatial", "Gimbal"): ("angle", 3, TURNING),
    ("spatial", "Translation"): ("position", 3, SLIDING),
}
BOTH = {
    ("planar", "Planar"): 2,
    ("planar", "Free"): 2,
    ("planar", "PinSlot"): 1,
    ("spatial", "Cylindrical"): 1,
    ("spatial", "Planar"): 2,
}
"""Joints that slide along so many axes and turn about one."""
BALLS = {"Spherical": "", "ConstantVelocity": "", "PointOnLine": "turning_", "Free": "turning_"}
"""Joints of space that turn about any axis, with what stands before the names of the settings."""
BODY = {
    "planar": "gravity {2, -9} m/s^2; Body body(m = 2 kg, J = 0.3 kg.m^2, com = {0.4, -0.1} m);",
    "spatial": "gravity {2, -9, 4} m/s^2; Body body(m = 2 kg, J = diag({0.3, 0.4, 0.5} kg.m^2), com = {0.4, -0.1, 0.2} m);",
}


def simulate(package: str, text: str) -> mechc.Solution:
    whole = f"import mech.{package}.*;\nmodel M\n{BODY[package]}\n{text}\nexperiment(stop = 1 s, tolerance = 1e-10);\nend M;\n"
    solution = mechc.loads(whole).simulate(estimate_error=False)
    assert solution.outcome.value == "completed", solution.message
    return solution


def told(q: str, n: int, values: tuple[str, ...], before: str = "") -> tuple[str, str]:
    """Return the settings of a joint, and statements that say the same."""
    damping, friction, stiffness, rest, armature, limits = values
    rows = limits
    if n > 1:
        pair, unit = limits.rsplit(" ", 1)
        rows = "{" + ", ".join([pair] * n) + f"}} {unit}"
    settings = ", ".join(
        f"{before}{setting}"
        for setting in (
            f"damping = {damping}",
            f"friction = {friction}",
            f"stiffness = {stiffness}",
            f"rest = {rest}",
            f"armature = {armature}",
            f"limits = {rows}",
            "restitution = 0.4",
        )
    )
    low, high = limits.strip("{} radm").split(", ")
    unit = rest.split()[1]
    statements = ""
    for i in range(n):
        x = f"joint.{q}" + (f"[{i + 1}]" if n > 1 else "")
        statements += (
            f"damping {damping} on {x}; friction {friction} on {x}; potential 1/2*({stiffness})*({x} - {rest})^2; kinetic 1/2*({armature})*der({x})^2;"
            f"contact {x} - ({low} {unit}) restitution 0.4; contact ({high.strip('} ')} {unit}) - {x} restitution 0.4;"
        )
    return settings, statements


@pytest.mark.parametrize(("package", "name"), JOINTS)
def test_settings_are_what_is_stated_beside_a_joint(package: str, name: str) -> None:
    q, n, values = JOINTS[package, name]
    settings, statements = told(q, n, values)
    one = simulate(package, f"{name} joint(world -> body.a, {settings});")
    other = simulate(package, f"{name} joint(world -> body.a);\n{statements}")
    names = [f"joint.{q}"] if n == 1 else [f"joint.{q}[{i + 1}]" for i in range(n)]
    for x in names:
        assert one[x] == pytest.approx(other[x], abs=1e-8)
    assert one["energy.total"] == pytest.approx(other["energy.total"], abs=1e-7)
    assert len(one.events) == len(other.events) > 0


def test_every_joint_with_settings_is_tried() -> None:
    """Those that extend them, in both packages."""
    found = set()
    for package in ("planar", "spatial"):
        file = parse(read_source(ROOT / "stdlib" / f"{package}.mech"), Reporter())
        for model in (m for m in file.items if isinstance(m, ast.Model)):
            bases = [s.base for s in model.body if isinstance(s, ast.Extends)]
            if any(base.endswith("Settings") for base in bases):
                found.add((package, model.name))
    # the planar Free is Planar by another name
    assert found == {*JOINTS, *BOTH, *(("spatial", name) for name in BALLS)} - {("planar", "Free")}


@pytest.mark.parametrize(("package", "name"), BOTH)
def test_settings_of_joints_that_slide_and_turn(package: str, name: str) -> None:
    """Each by its own name: as if stated beside the joint."""
    n = BOTH[package, name]
    sliding, along = told("position", n, SLIDING)
    turning, about = told("angle", 1, TURNING, "turning_")
    one = simulate(package, f"{name} joint(world -> body.a, {sliding}, {turning});")
    other = simulate(package, f"{name} joint(world -> body.a);\n{along}{about}")
    for x in (q.name for q in one.problem.states):
        assert one[x] == pytest.approx(other[x], abs=1e-8)
    assert one["energy.total"] == pytest.approx(other["energy.total"], abs=1e-7)
    assert len(one.events) == len(other.events) > 0


@pytest.mark.parametrize("name", BALLS)
def test_settings_of_joints_with_a_ball(name: str) -> None:
    """A ball that spins at 1 rad/s meets the cone after half a second and comes back half as fast; a damped swing; a spin that runs down."""
    before = BALLS[name]
    text = "import mech.spatial.*;\nBody b(m = 1 kg, J = identity(3)*2 kg.m^2);\n{} h(world -> b.a, {});\n{}output z = direction(b.a, {{0, 0, 1}});\nexperiment(stop = 1 s, tolerance = 1e-11);"
    rate = (
        "initial der(h.bend) = {0.5, 0}/s;"
        if name == "ConstantVelocity"
        else "initial der(h.orientation) = {1, 0, 0} rad/s;"
    )
    rate = rate.replace("{0.5, 0}/s", "{0.5, 0} s^-1")

    def run(settings: str, start: str) -> mechc.Solution:
        return mechc.loads(text.format(name, settings, start)).simulate(estimate_error=False)

    s = run(f"{before}limits = 0.5 rad, {before}restitution = 0.5", rate)
    assert s.events[0].time == pytest.approx(0.5, rel=1e-7)
    assert s["z[2]"][-1] == pytest.approx(-math.sin(0.25), rel=1e-6)
    s = run(f"{before}damping = 4 N.m.s", rate)
    assert s["energy.total"] == pytest.approx(np.exp(-4 * s.time), rel=1e-7)
    s = run(f"{before}stiffness = 50 N.m/rad", rate)
    assert s["energy.total"] == pytest.approx(1, rel=1e-8)
    # the potential 2 k tan(angle/2)^2 is 4 % stiffer than a spring at 0.2 rad
    t = float(s.time[np.argmax(-s["z[2]"])])
    assert t == pytest.approx(math.pi / 2 / 5, rel=0.02)
    assert np.abs(s["z[2]"]).max() == pytest.approx(math.sin(2 * math.atan(0.1)), rel=1e-4)


def test_a_ball_joint_with_a_spring_and_damping() -> None:
    """A ball about its centre: a damped swing about any axis, small angles; the damping takes all of a spin."""
    text = "import mech.spatial.*;\nBody b(m = 1 kg, J = identity(3)*2 kg.m^2);\nSpherical h(world -> b.a{});\n{}experiment(stop = 1 s, tolerance = 1e-11);"
    start = "orientation = axis_angle({1, 2, 2}, 1e-3 rad)"
    s = mechc.loads(text.format(f", {start}, stiffness = 50 N.m/rad, damping = 4 N.m.s", "")).simulate()
    w, t = math.sqrt(25 - 1), s.time
    swing = 1e-3 * np.exp(-t) * (np.cos(w * t) + np.sin(w * t) / w)
    assert 2 * s["h.orientation[3]"] == pytest.approx(2 / 3 * swing, abs=1e-9)
    s = mechc.loads(
        text.format(", damping = 4 N.m.s", "initial der(h.orientation) = {3, 0, 4} rad/s;")
    ).simulate()
    assert s["energy.total"] == pytest.approx(25 * np.exp(-4 * s.time), rel=1e-8)


def test_each_setting_has_its_closed_form() -> None:
    """A wheel on a hinge: damped swing, run down by friction, rotor, and a stop that gives half of the speed back."""
    wheel = "import mech.planar.*;\nDisk d(m = 2 kg, r = 1 m);\nRevolute h(world -> d.a, {});\n{}\nexperiment(stop = 1 s, tolerance = 1e-11);"

    def run(settings: str, more: str = "") -> mechc.Solution:
        return mechc.loads(wheel.format(settings, more)).simulate()

    s = run("angle = 0.3 rad, stiffness = 25 N.m/rad, rest = 0.1 rad, damping = 2 N.m.s")
    w, t = math.sqrt(25 - 1), s.time
    assert s["h.angle"] == pytest.approx(
        0.1 + 0.2 * np.exp(-t) * (np.cos(w * t) + np.sin(w * t) / w), abs=1e-9
    )
    s = run("friction = 4 N.m, der(angle) = 2 rad/s")
    assert s["h.angle"][-1] == pytest.approx(0.5, rel=1e-9) and s["energy.dissipated"][-1] == pytest.approx(2)
    s = run("armature = 3 kg.m^2", "force 8 N.m on h.angle;")
    assert s["h.angle"][-1] == pytest.approx(1, rel=1e-9)
    s = run("limits = {-1, 0.5} rad, restitution = 0.5, der(angle) = 1 rad/s")
    assert s.events[0].time == pytest.approx(0.5, rel=1e-9) and s["h.angle"][-1] == pytest.approx(0.25)


def test_settings_hold_where_a_joint_closes_a_loop() -> None:
    """The fourth hinge of a four-bar with a spring and damping: with the same energy as where another hinge closes it."""
    text = """import mech.planar.*;
    gravity {0, -9.81} m/s^2;
    Bar a(m = 1 kg, l = 0.3 m); Bar b(m = 2 kg, l = 0.8 m); Bar c(m = 1 kg, l = 0.6 m);
    frame post = world * trans({0.7, 0} m);
    %s Revolute ha(world -> a.a, angle %s 60 deg); %s Revolute hb(a.b -> b.a, angle ~ -50 deg);
    Revolute hc(post -> c.a, angle ~ 90 deg, damping = 0.4 N.m.s, stiffness = 9 N.m/rad, rest = 80 deg, armature = 0.2 kg.m^2);
    Revolute hd(c.b -> b.b);
    output turn = heading(a.a);
    experiment(stop = 1 s, tolerance = 1e-10);"""
    tree = mechc.loads(text % ("", "=", "")).simulate(estimate_error=False)
    loop = mechc.loads((text % ("", "=", "")).replace("Revolute hc(", "cut Revolute hc(")).simulate(
        estimate_error=False
    )
    assert loop["turn"] == pytest.approx(tree["turn"], abs=1e-7)
    assert loop["energy.total"] == pytest.approx(tree["energy.total"], abs=1e-6)
    assert tree["energy.dissipated"][-1] > 0.05


def test_a_setting_that_is_not_given_is_not_there() -> None:
    """Neither parameter nor code; a rest without a spring, or a wrong name, is refused in words."""
    text = "import mech.planar.*;\nBody b(m = 1 kg, J = 1 kg.m^2);\nRevolute h(world -> b.a{});\n"
    plain = mechc.loads(text.format(""))
    assert [p.name for p in plain.problem().parameters if p.name.startswith("h.")] == []
    damped = mechc.loads(text.format(", damping = 2 N.m.s"))
    assert [p.name for p in damped.problem().parameters if p.name.startswith("h.")] == ["h.damping"]
    for wrong, words in (
        (", rest = 1 rad", "only under a condition"),
        (", dampin = 2 N.m.s", "has no 'dampin'"),
    ):
        with pytest.raises(mechc.CompileError, match=words):
            mechc.loads(text.format(wrong))
    with pytest.raises(mechc.SimulationError, match="below its minimum"):
        mechc.loads(text.format(", damping = -2 N.m.s")).simulate()
