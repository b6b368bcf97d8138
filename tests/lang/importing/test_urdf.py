"""Robots in URDF as models: energies against own kinematics with derivatives by complex steps, and what is said of the rest."""

from __future__ import annotations

import math
import re
import warnings
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import mechc
from mechc.cli.main import mechc as mechc_command
from mechc.cli.main import run
from mechc.lang.diagnostics import CompileError, Reporter
from mechc.lang.importing import Imported, Wishes, imported
from mechc.lang.parser import parse
from mechc.lang.printing.printer import format_file
from mechc.lang.source import SourceFile

ARM = """\
<?xml version="1.0"?>
<robot name="small-arm">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="base">
    <inertial><mass value="2"/><inertia ixx="0.1" iyy="0.2" izz="0.25" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.2 0.3"/></geometry><material name="grey"/></visual>
    <collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>
  </link>
  <link name="upper arm">
    <inertial>
      <origin xyz="0.1 -0.2 0.3" rpy="0.3 -0.4 1.1"/>
      <mass value="1.5"/><inertia ixx="0.03" ixy="0.002" ixz="-0.001" iyy="0.04" iyz="0.003" izz="0.05"/>
    </inertial>
    <visual><geometry><cylinder radius="0.05" length="0.4"/></geometry></visual>
  </link>
  <link name="fore"><inertial><origin xyz="0 0 0.2"/><mass value="0.7"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.002"/></inertial></link>
  <link name="hand"><inertial><mass value="0.2"/></inertial></link>
  <link name="finger"><inertial><origin xyz="0.02 0 0"/><mass value="0.05"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5"/></inertial></link>
  <link name="thumb"><inertial><origin xyz="0.03 0.01 0"/><mass value="0.04"/><inertia ixx="2e-5" iyy="1e-5" izz="1e-5"/></inertial></link>
  <link name="tip"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper arm"/>
    <origin xyz="0 0.1 0.5" rpy="0.2 0.5 -0.7"/><axis xyz="1 2 2"/>
    <limit lower="-1.5" upper="2" effort="30" velocity="3"/><dynamics damping="0.3"/>
  </joint>
  <joint name="fore" type="continuous">
    <parent link="upper arm"/><child link="fore"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/>
    <limit effort="10" velocity="5"/><safety_controller k_velocity="1"/>
  </joint>
  <joint name="wrist" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="0.1 0 0.3" rpy="0 0 1"/></joint>
  <joint name="slide" type="prismatic">
    <parent link="hand"/><child link="finger"/><origin rpy="1 0 0"/><axis xyz="0 0 -1"/>
    <limit lower="0.01" upper="0.05" effort="5" velocity="0.2"/>
  </joint>
  <joint name="thumb" type="revolute">
    <parent link="hand"/><child link="thumb"/><origin xyz="0 0 0.05"/><axis xyz="0 3 4"/>
    <limit lower="-1" upper="1" effort="0" velocity="0"/><mimic joint="slide" multiplier="-20" offset="0.1"/>
  </joint>
  <joint name="nail" type="fixed"><parent link="thumb"/><child link="tip"/><origin xyz="0 0 0.02"/></joint>
  <transmission name="t"><type>simple</type></transmission>
</robot>
"""
LIMIT = ARM[: ARM.index('lower="0.01"')].count("\n") + 1
LIMITED = [
    k for k, row in enumerate(ARM.splitlines(), start=1) if 'velocity="' in row and 'effort="0"' not in row
]
JOINTS = {"shoulder": "shoulder.angle", "fore": "fore.angle", "slide": "slide.position"}


def made(folder: Path, text: str, **wishes: Any) -> Imported:
    return imported(text, Wishes(folder / "robot.urdf", folder, **wishes), Reporter())


def numbers(element: ET.Element | None, name: str) -> np.ndarray:
    return np.array(
        [float(x) for x in element.get(name, "0 0 0").split()] if element is not None else [0.0] * 3
    )


def about(axis: np.ndarray, angle: complex) -> np.ndarray:
    """Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned: np.ndarray = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    return turned


def origin(element: ET.Element) -> tuple[np.ndarray, np.ndarray]:
    found = element.find("origin")
    roll, pitch, yaw = numbers(found, "rpy")
    x, y, z = np.eye(3)
    return about(z, yaw) @ about(y, pitch) @ about(x, roll), numbers(found, "xyz")


class Kinematics:
    """Energies of a URDF by its definition; velocities are imaginary parts of poses at q + i h v."""

    def __init__(self, text: str) -> None:
        self.robot = ET.fromstring(text)
        self.joints = {j.find("child").get("link"): j for j in self.robot.findall("joint")}  # type: ignore[union-attr]

    def value(self, joint: ET.Element, q: dict[str, complex]) -> complex:
        mimic = joint.find("mimic")
        if mimic is None:
            return q.get(joint.get("name", ""), 0)
        leader = next(j for j in self.joints.values() if j.get("name") == mimic.get("joint"))
        return float(mimic.get("multiplier", 1)) * self.value(leader, q) + float(mimic.get("offset", 0))

    def pose(
        self, link: str, q: dict[str, complex], root: tuple[np.ndarray, np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        joint = self.joints.get(link)
        if joint is None:
            return root
        R, p = self.pose(joint.find("parent").get("link"), q, root)  # type: ignore[union-attr,arg-type]
        turn, place = origin(joint)
        R, p = R @ turn, p + R @ place
        axis, value = numbers(joint.find("axis"), "xyz"), self.value(joint, q)
        if joint.get("type") == "prismatic":
            return R, p + R @ (axis / np.linalg.norm(axis) * value)
        return (R if joint.get("type") == "fixed" else R @ about(axis, value)), p

    def energies(
        self,
        q: dict[str, float],
        v: dict[str, float],
        root: tuple[np.ndarray, np.ndarray] = (np.eye(3), np.zeros(3)),
    ) -> tuple[float, float]:
        """``root``: its pose, with rates in the imaginary parts of 1e-100 times."""
        h, kinetic, potential = 1e-100, 0.0, 0.0
        moving = {name: q[name] + 1j * h * v[name] for name in q}
        for link in self.robot.findall("link"):
            inertial = link.find("inertial")
            if inertial is None:
                continue
            R, p = self.pose(link.get("name", ""), moving, root)
            turn, centre = origin(inertial)
            m = float(inertial.find("mass").get("value"))  # type: ignore[union-attr,arg-type]
            J = np.zeros((3, 3))
            if (given := inertial.find("inertia")) is not None:
                for i, a in enumerate("xyz"):
                    for k, b in enumerate("xyz"):
                        J[i, k] = float(given.get(f"i{min(a, b)}{max(a, b)}", 0))
            c, R = p + R @ centre, R @ turn
            rate, spin = c.imag / h, R.imag / h
            spread = np.trace(J) / 2 * np.eye(3) - J  # of the mass: the integral of x x'
            kinetic += m / 2 * rate @ rate + np.trace(spin @ spread @ spin.T) / 2
            potential += 9.81 * m * c.real[2]
        return kinetic, potential


def loaded(folder: Path, text: str, **wishes: Any) -> mechc.Model:
    model = made(folder, text, **wishes)
    (folder / "robot.mech").write_text(model.text)
    return mechc.load(folder / "robot.mech")


def test_energies_of_an_arm(tmp_path: Path) -> None:
    """At three states, to rounding: axes out of order, turned inertias, a joint that follows another."""
    model, own, random = loaded(tmp_path, ARM), Kinematics(ARM), np.random.default_rng(5)
    first = None
    for _ in range(3):
        q, v = (
            {name: float(x) for name, x in zip(JOINTS, random.normal(size=3), strict=True)} for _ in range(2)
        )
        values = {JOINTS[n]: q[n] for n in q} | {f"der({JOINTS[n]})": v[n] for n in q}
        motion = model.simulate(set=values, stop=1e-3, estimate_error=False)
        kinetic, potential = own.energies(q, v)
        first = first if first is not None else motion["energy.potential"][0] - potential
        assert motion["energy.kinetic"][0] == pytest.approx(kinetic, rel=1e-13)
        assert motion["energy.potential"][0] - potential == pytest.approx(first, abs=1e-13)


def test_a_floating_root(tmp_path: Path) -> None:
    """Position and attitude of the root, its velocity in the world and its angular velocity in its own axes."""
    model, own, random = loaded(tmp_path, ARM, floating=True), Kinematics(ARM), np.random.default_rng(7)
    for _ in range(3):
        q, v = (
            {name: float(x) for name, x in zip(JOINTS, random.normal(size=3), strict=True)} for _ in range(2)
        )
        axis, angle, place, rate, spin = random.normal(size=3), 0.8, *random.normal(size=(3, 3))
        turn = about(axis, angle)
        skew = np.array([[0, -spin[2], spin[1]], [spin[2], 0, -spin[0]], [-spin[1], spin[0], 0]])
        root = (turn + 1j * 1e-100 * turn @ skew, place + 1j * 1e-100 * rate)
        half = np.concatenate([[math.cos(angle / 2)], math.sin(angle / 2) * axis / np.linalg.norm(axis)])
        values: dict[str, Any] = {JOINTS[n]: q[n] for n in q} | {f"der({JOINTS[n]})": v[n] for n in q}
        values |= {"root_joint.position": place, "der(root_joint.position)": rate}
        values |= {"root_joint.orientation": half, "der(root_joint.orientation)": spin}
        motion = model.simulate(set=values, stop=1e-3, estimate_error=False)
        kinetic, _ = own.energies(q, v, root)
        assert motion["energy.kinetic"][0] == pytest.approx(kinetic, rel=1e-12)


def test_the_text_of_an_arm(tmp_path: Path) -> None:
    """It is what the formatter writes, holds each thing of the file, and lists the rest with its lines."""
    model = made(tmp_path, ARM)
    assert format_file(parse(SourceFile("a", model.text), Reporter())) == model.text
    flat = " ".join(model.text.split())
    for words in (
        "model SmallArm",
        "Body upper_arm(m = 1.5 kg, com = {0.1, -0.2, 0.3} m, J = {{",
        'axis = {1, 2, 2}, angle = 0 rad, damping = 0.3 N.m.s) "at most 3 rad/s";',
        "input Torque torque_shoulder(min = -30 N.m, max = 30 N.m) = 0 N.m; force torque_shoulder on shoulder.angle;",
        "Revolute fore(upper_arm.a * trans({0, 0, 0.4} m) -> fore_link.a, axis = {0, 1, 0}",
        "Body hand(m = 0.2 kg, a = fore_link.a * trans({0.1, 0, 0.3} m) * rotz(1 rad));",
        "slide(hand.a * rotx(1 rad) -> finger.a, axis = {0, 0, -1}, position = 0.01 m)",
        "let Angle thumb = -20 rad/m*slide.position + 0.1 rad;",
        "axis_angle({0, 0.6, 0.8}, thumb)",
        "frame tip = thumb_link.a * trans({0, 0, 0.02} m);",
        "contact shoulder_upper: 2 rad - shoulder.angle; contact shoulder_lower: shoulder.angle - (-1.5 rad);",
        "contact thumb_upper: 1 rad - thumb;",
        'draw box({0.1, 0.2, 0.3} m) on base.a * trans({0, 0, 0.1} m), colour = "#808080";',
        "draw cylinder(radius = 0.05 m, length = 0.4 m, axis = {0, 0, 1}) on upper_arm.a;",
    ):
        assert words in flat, words
    at = {
        word: f"(line {k})"
        for k, row in enumerate(ARM.splitlines(), start=1)
        for word in ("<collision", "<safety", "<transm")
        if word in row
    }
    assert set(model.left_out) == {
        f"collision shapes of what stands still: they touch nothing {at['<collision']}",
        f"safety_controller {at['<safety']}",
        f"transmission {at['<transm']}",
        f"the zero of 'slide': it lies beyond the range, and the joint starts at 0.01 m (line {LIMIT})",
        "the ends of joint ranges, unless stops = true",
        f"limits of effort and speed; the text states them, but nothing enforces them (lines {', '.join(map(str, LIMITED))})",
    }
    assert "// link upper arm: upper_arm" in re.sub(r"//\s+", "// ", model.text)


def test_joints_end_at_their_ranges(tmp_path: Path) -> None:
    """A door that falls open: it stops at 0.4 rad for good, and not without stops."""
    text = """<robot name="door"><link name="world"/><link name="leaf"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
      <inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>
      <joint name="hinge" type="revolute"><parent link="world"/><child link="leaf"/><axis xyz="0 1 0"/>
      <limit lower="0" upper="0.4" effort="0" velocity="0"/></joint></robot>"""
    model = made(tmp_path, text).text
    assert "world" in model and "frame world" not in model
    stopped = mechc.loads(model).with_values({"stops": True}).simulate(stop=2, estimate_error=False)
    assert stopped["hinge.angle"][-1] == pytest.approx(0.4, abs=1e-9)
    free = mechc.loads(model).simulate(stop=2, estimate_error=False)
    assert free["hinge.angle"].max() > 1


def link(name: str) -> str:
    return (
        f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>'
    )


def joint(name: str, kind: str, parent: str, child: str, inside: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'
    )


def test_joints_of_several_freedoms(tmp_path: Path) -> None:
    """A plane across {0, 1, 0}: of its two lengths and the turn, gravity sees the height alone."""
    robot = f'<robot name="r">{link("a")}{link("b")}{link("c")}{link("d")}'
    robot += joint("p", "planar", "a", "b", '<axis xyz="0 1 0"/>') + joint("f", "floating", "b", "c")
    robot += joint("s", "spherical", "c", "d") + "</robot>"
    model = mechc.loads(made(tmp_path, robot).text)
    motion = model.simulate(stop=0.5, tolerance=1e-10, estimate_error=False)
    fall = -9.81 / 2 * 0.25
    heights = motion["energy.potential"][-1] - motion["energy.potential"][0]
    assert heights == pytest.approx(3 * 9.81 * fall, rel=1e-9)


AXIS, ORIGIN, LIMITS = '<axis xyz="{}"/>', '<origin xyz="0 0 x"/>', '<limit lower="1" upper="-1"/>'
MIMIC = '<mimic joint="{}"/>'
WRONG = [
    ("<robot name='r'", "the file is not an XML"),
    ("<robot name='r'/>", "line 1 of .*the robot has no link"),
    (f"<robot>{link('a')}{link('a')}</robot>", "two elements 'link' are called 'a'"),
    (f"<robot>{link('a')}\n{link('b')}</robot>", "line 1 of .*2 links have no parent: a, b"),
    (
        f"<robot>{link('a')}{link('b')}\n{joint('j', 'fixed', 'a', 'c')}</robot>",
        "line 2 of .*there is no link 'c'",
    ),
    (
        f"<robot>{link('a')}{link('b')}{joint('j', 'fixed', 'a', 'b')}{joint('k', 'fixed', 'b', 'a')}</robot>",
        "no link is the root: the joints go round",
    ),
    (
        f"<robot>{link('a')}{link('b')}{joint('j', 'fixed', 'a', 'b')}{joint('k', 'fixed', 'a', 'b')}</robot>",
        "the link 'b' is the child of two joints",
    ),
    (
        f"<robot>{link('a')}{link('b')}{joint('j', 'revolt', 'a', 'b')}</robot>",
        "the joint 'j' is of the type 'revolt'",
    ),
    (
        f"<robot>{link('a')}{link('b')}{joint('j', 'revolute', 'a', 'b', AXIS.format('0 0 0'))}</robot>",
        "the axis of the joint 'j' has no direction",
    ),
    (
        f"<robot>{link('a')}{link('b')}{joint('j', 'revolute', 'a', 'b', AXIS.format('0 0'))}</robot>",
        "'xyz' of 'axis' has 2 numbers, not 3",
    ),
    (
        f"<robot>{link('a')}{link('b')}{joint('j', 'revolute', 'a', 'b', ORIGIN)}</robot>",
        "'xyz' of 'origin' is '0 0 x', which is not a number",
    ),
    (
        f"<robot>{link('a')}{link('b')}{joint('j', 'revolute', 'a', 'b', LIMITS)}</robot>",
        "the range of the joint 'j' ends before it begins",
    ),
    (
        f"<robot>{link('a')}{link('b')}{joint('j', 'revolute', 'a', 'b', MIMIC.format('j'))}</robot>",
        "the joint 'j' follows itself",
    ),
    (
        "<robot><link name='a'><inertial><mass value='-1'/></inertial></link></robot>",
        "the mass of the link 'a' is -1 kg",
    ),
    ("<!DOCTYPE r [<!ENTITY x 'y'>]><robot/>", "defines entities"),
    ("<robot xmlns:xacro='x'><xacro:include filename='a'/></robot>", "written with xacro"),
]


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_wrong_robots(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(CompileError, match=message):
        made(tmp_path, text)


LIGHT = f"""
<robot name="light">
  <link name="base"/>{link("arm")}<link name="tip"/><link name="pad"/><link name="rub"/>{link("claw")}
  {joint("j", "revolute", "base", "arm", '<limit lower="-1" upper="1" effort="0" velocity="0"/>')}
  {joint("open", "revolute", "arm", "tip", '<axis xyz="0 0 2"/><limit lower="0.5" upper="1" effort="3" velocity="2"/>')}
  {joint("like", "prismatic", "tip", "pad", '<axis xyz="0 1 0"/><mimic joint="open" multiplier="-2" offset="0.25"/>')}
  {joint("drags", "continuous", "pad", "rub", '<dynamics damping="0.3"/>')}
  {joint("leads", "continuous", "pad", "cup", "")}<link name="cup"/>
  {joint("led", "continuous", "arm", "claw", '<mimic joint="leads"/>')}
</robot>"""


def test_a_robot_without_masses(tmp_path: Path) -> None:
    """It is read, but its text says that it cannot move."""
    text = f'<robot name="drawn"><link name="base"/><link name="arm"/>{joint("j", "continuous", "base", "arm", "")}</robot>'
    assert [one for one in made(tmp_path, text).left_out if one.startswith("masses: no link has one")]
    heavy = text.replace('<link name="arm"/>', link("arm"))
    assert not [one for one in made(tmp_path, heavy).left_out if one.startswith("masses")]


def test_joints_that_move_nothing_with_mass(tmp_path: Path) -> None:
    """They stay where they start, and followers with them; damping or a follower with a mass tells how a joint moves."""
    found = made(tmp_path, LIGHT.strip())
    left = [one for one in found.left_out if "freedom" in one]
    assert [one.partition(" (line")[0] for one in left] == [
        "the freedom of 'open': nothing with mass moves with it, and it stays at 0.5 rad",
        "the freedom of 'like': nothing with mass moves with it, and it stays at -0.75 m",
    ]
    model = mechc.loads(found.text)
    names = [name for name, _ in model.functions.states]
    assert {"j.angle", "drags.angle", "leads.angle"} <= set(names)
    assert not [name for name in names if name.startswith(("open", "like"))]
    frame, y = model.functions.frame("pad"), model.functions.start
    place = np.array(frame.position(y)) - model.functions.frame("tip").position(y)
    assert place == pytest.approx(-0.75 * np.array([-np.sin(0.5), np.cos(0.5), 0]), abs=1e-12)


def test_a_leader_that_is_missing(tmp_path: Path) -> None:
    robot = f"<robot>{link('a')}{link('b')}\n{joint('j', 'continuous', 'a', 'b', MIMIC.format('k'))}</robot>"
    found = made(tmp_path, robot)
    assert found.left_out == ("that 'j' follows 'k': there is no such joint, and it moves freely (line 2)",)
    assert "Revolute j(" in found.text


def test_inertias_that_no_body_has(tmp_path: Path) -> None:
    text = "<robot name='r'><link name='a'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='3'/></inertial></link></robot>"
    (said,) = made(tmp_path, text).left_out
    assert "two principal moments add up to less than the third) of 'a'; it is kept as it is (line 1)" in said
    (said,) = made(tmp_path, text.replace("izz='3'", "izz='-1'")).left_out
    assert "a negative principal moment" in said


SKATE = """\
<robot name="skate">
  <link name="board">
    <inertial><mass value="2"/><inertia ixx="0.01" iyy="0.03" izz="0.04"/></inertial>
    <collision name="pad"><origin xyz="0.3 0 -0.1"/><geometry><sphere radius="0.02"/></geometry></collision>
    <collision name="pad"><origin xyz="-0.3 0.2 -0.1"/><geometry><sphere radius="0.02"/></geometry></collision>
    <collision><origin xyz="-0.3 -0.2 -0.1"/><geometry><sphere radius="0.02"/></geometry></collision>
    <collision><origin rpy="0 0 1.5"/><geometry><box size="0.1 0.2 0.02"/></geometry></collision>
    <collision><geometry><cylinder radius="0.1" length="0.1"/></geometry></collision>
    <collision><geometry><mesh filename="board.stl"/></geometry></collision>
    <collision/>
    <collision><geometry><sphere radius="big"/></geometry></collision>
  </link>
  <link name="top"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="arm"><inertial><mass value="0.1"/></inertial><collision><geometry><sphere radius="0.01"/></geometry></collision></link>
  <joint name="bolt" type="fixed"><parent link="board"/><child link="top"/><origin xyz="0 0 1"/></joint>
  <joint name="hinge" type="continuous"><parent link="top"/><child link="arm"/><origin xyz="0 0 1"/></joint>
</robot>
"""


def test_what_touches_the_floor(tmp_path: Path) -> None:
    """Spheres, boxes and cylinders of what moves; the rest is listed with its lines."""
    model = made(tmp_path, SKATE, floating=True)
    assert format_file(parse(SourceFile("a", model.text), Reporter())) == model.text
    flat = " ".join(model.text.split())
    for words in (
        'structural parameter Boolean contacts = false "whether shapes touch";',
        "shape pad: Sphere(r = 0.02 m) on board.a at {0.3, 0, -0.1} m;",
        "shape board_sphere: Sphere(r = 0.02 m) on board.a at {-0.3, 0.2, -0.1} m;",
        "shape board_sphere_2: Sphere(r = 0.02 m) on board.a at {-0.3, -0.2, -0.1} m;",
        "shape board_box: Box(size = {0.1, 0.2, 0.02} m) on board.a * rotz(1.5 rad);",
        "shape board_cylinder: Cylinder(r = 0.1 m, l = 0.1 m) on board.a * roty(90 deg);",
        "contact floor_plane with pad, board_sphere, board_sphere_2, board_box, board_cylinder, top_sphere, arm_sphere friction floor_friction;",
    ):
        assert words in flat, words
    assert set(model.left_out) == {
        "contacts of shapes of the kind mesh (line 9)",
        "a collision shape of 'board': it has no geometry (line 10)",
        "'radius' of 'sphere' is 'big', which is not a number (line 11)",
        "contacts, unless contacts = true; it brings those with the floor z = 0, with a friction of 1 (lines 4, 5, 6, 7, 8, 13, 14)",
    }
    held = made(tmp_path, SKATE)
    assert "contact floor_plane with arm_sphere friction floor_friction;" in held.text
    assert (
        "collision shapes of what stands still: they touch nothing (lines 4, 5, 6, 7, 8, 9, 10, 11, 13)"
        in held.left_out
    )
    alone = made(tmp_path, SKATE.replace("continuous", "fixed"))
    assert "contact" not in alone.text.partition("\nimport ")[2] and "mech.shapes" not in alone.text


def test_a_skate_slides_to_rest(tmp_path: Path) -> None:
    """The distance is v^2/(2 mu g); without contacts it falls freely."""
    model = mechc.loads(made(tmp_path, SKATE.replace("continuous", "fixed"), floating=True).text)
    start: dict[str, Any] = {"root_joint.position": [0, 0, 0.12], "der(root_joint.position)": [1, 0, 0]}
    run = model.simulate(stop=0.5, set={"contacts": True, "floor_friction": 0.3, **start})
    assert run["root_joint.position[1]"][-1] == pytest.approx(1 / (2 * 0.3 * 9.81), abs=1e-8)
    assert run["root_joint.position[3]"][-1] == pytest.approx(0.12, abs=1e-9)
    assert model.simulate(stop=0.5, set=start)["root_joint.position[3]"][-1] == pytest.approx(
        0.12 - 9.81 * 0.5**2 / 2, abs=1e-8
    )


TRIANGLE = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n"


def test_surfaces_of_files(tmp_path: Path) -> None:
    """Files of packages, beside the robot and elsewhere: linked, copied or left; those of other formats give way to collision shapes."""
    where = tmp_path / "ws" / "my_robot" / "meshes"
    where.mkdir(parents=True)
    (where / "a.stl").write_text(TRIANGLE)
    (tmp_path / "ws" / "my_robot" / "urdf").mkdir()

    def robot(file: str, more: str = "") -> str:
        mesh = f'<geometry><mesh filename="{file}" {more}/></geometry>'
        return (
            f'<robot name="r"><link name="a"><inertial><mass value="1"/></inertial><visual>{mesh}</visual>'
            '<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>'
        )

    def wished(text: str, **wishes: Any) -> Imported:
        given = {"source": where.parent / "urdf" / "r.urdf", "folder": tmp_path, **wishes}
        return imported(text, Wishes(**given), Reporter())

    inside = robot("package://my_robot/meshes/a.stl", 'scale="0.001 0.001 0.001"')
    found = wished(inside)
    assert 'mesh("ws/my_robot/meshes/a.stl", scale = 0.001 m) on a.a' in found.text
    assert wished(inside, meshes="none").text.count("draw") == 0
    copied = wished(inside, meshes="copy")
    assert copied.copies == {"r_meshes/a.stl": where / "a.stl"} and 'mesh("r_meshes/a.stl"' in copied.text
    away = {"source": tmp_path / "r.urdf"}
    assert "there is no such file; --package" in " ".join(wished(inside, **away).left_out)
    for folder in (tmp_path / "ws", where.parent):
        assert "a.stl" in wished(inside, packages=(folder,), **away).text
    other = wished(robot("package://my_robot/meshes/a.ply"))
    assert "draw sphere(0.1 m) on a.a" in other.text
    assert any("surfaces are read from STL, OBJ, DAE and GLB" in one for one in other.left_out)
    assert any("their collision shapes are drawn" in one for one in other.left_out)
    for scale, said in (("1 -1 2", "{1, -1, 2} m"), ("-1 -1 -1", "{-1, -1, -1} m"), ("2 2 2", "2 m")):
        scaled = wished(robot("../meshes/a.stl", f'scale="{scale}"'))
        assert f"scale = {said}) on a.a" in scaled.text and not scaled.left_out[1:]


def test_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.urdf").write_text(ARM)
    call = CliRunner().invoke
    done = call(mechc_command, ["import", "arm.urdf"])
    assert (
        done.exit_code == 0
        and "wrote arm.mech" in done.stderr
        and "left out: transmission (line" in done.stderr
    )
    again = call(mechc_command, ["import", "arm.urdf"])
    assert again.exit_code == 2 and "arm.mech exists and is left as it is" in again.output
    assert call(mechc_command, ["import", "arm.urdf", "-o", "other.mech", "--floating"]).exit_code == 0
    assert "Free root_joint(world -> base.a);" in Path("other.mech").read_text()
    wrong = call(mechc_command, ["import", "arm.urdf", "-o", "arm.txt"])
    assert wrong.exit_code == 2 and "ends in .mech" in wrong.output
    with pytest.raises(CompileError, match=r"'arm\.mech' is not a robot in URDF"):
        call(mechc_command, ["import", "arm.mech", "-o", "x.mech"], catch_exceptions=False)
    with pytest.warns(
        UserWarning,
        match=r"arm\.urdf is read as a model; 'mechc import' writes it .* what the model does not hold",
    ):
        model = mechc.load("arm.urdf")
    assert model.name == "SmallArm"
    assert run(["fmt", "arm.urdf"]) == 1 and Path("arm.urdf").read_text() == ARM
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert call(mechc_command, ["check", "arm.urdf"]).exit_code == 0
