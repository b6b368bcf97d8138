"""Robots in MJCF as models: accelerations against MuJoCo, and what is said of the rest."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.lang.diagnostics import CompileError, Reporter
from mechc.lang.importing import Imported, Wishes, imported
from mechc.lang.parser import parse
from mechc.lang.printing.printer import format_file
from mechc.lang.source import SourceFile
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions

mujoco = pytest.importorskip("mujoco")

HOPPER = """\
<mujoco model="hop one">
  <compiler angle="radian"/>
  <option gravity="0.1 0 -9.7" density="30" viscosity="0.05" wind="1 0.2 0"/>
  <default><joint damping="0.2" armature="0.01"/><default class="light"><geom density="300"/></default></default>
  <worldbody>
    <geom type="plane" size="5 5 1"/>
    <site name="wall" pos="0 0 2"/>
    <body name="trunk" pos="0.1 0 0.5" quat="0.9 0.1 0.3 -0.2" gravcomp="0.4">
      <joint name="root" type="free" armature="0.05"/>
      <geom type="box" size="0.2 0.1 0.05" rgba="1 0 0 1"/>
      <site name="jet" pos="0.1 0 0" quat="0.8 0 0.6 0"/>
      <body name="thigh" pos="0 0 -0.1" euler="0.2 0.4 0">
        <joint name="hip x" type="hinge" axis="1 0 0" pos="0 0 0.02" stiffness="3" springref="0.3"/>
        <joint name="hip y" type="hinge" axis="0 1 0" ref="0.1" range="-1 1" limited="true" frictionloss="0.5"/>
        <geom class="light" type="capsule" fromto="0 0 0 0.05 0 -0.3" size="0.03"/>
        <body name="shank" pos="0.05 0 -0.3">
          <joint name="knee" type="slide" axis="0 0.6 0.8" pos="0.01 0 0" damping="2"/>
          <geom type="cylinder" size="0.02 0.15" pos="0 0 -0.15"/>
          <site name="toe" pos="0 0 -0.3"/>
          <body name="foot" pos="0 0 -0.3">
            <joint name="ankle" type="ball" damping="0.1"/>
            <geom type="sphere" size="0.04" pos="0.03 0.01 0"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <fixed name="mix" stiffness="4" damping="0.3"><joint joint="hip y" coef="2"/><joint joint="knee" coef="-1.5"/></fixed>
    <spatial name="rope" stiffness="20" springlength="0.4" damping="1">
      <site site="wall"/><site site="jet"/><pulley divisor="2"/><site site="jet"/><site site="toe"/>
    </spatial>
  </tendon>
  <actuator>
    <motor name="push" joint="hip x" gear="3" ctrlrange="-0.5 0.5" ctrllimited="true"/>
    <position name="hold" joint="hip y" kp="7" kv="0.4"/>
    <velocity name="turn" joint="knee" kv="2" forcerange="-1 1" forcelimited="true"/>
    <general name="slow" tendon="mix" dyntype="filter" dynprm="0.3" gainprm="5" gear="2" actearly="true"/>
    <general name="wind" joint="hip x" dyntype="integrator" biastype="affine" biasprm="0.5 -1 -0.2"/>
    <general name="lift" tendon="rope" gaintype="affine" gainprm="1 2 -0.5"/>
    <motor name="thrust" site="jet" gear="1 2 3 0.1 0 -0.2"/>
  </actuator>
  <sensor><jointpos joint="hip x"/></sensor>
  <keyframe><key name="low" qpos="0 0 1 1 0 0 0 0.2 0.3 0.1 1 0 0 0"/></keyframe>
</mujoco>
"""


def made(folder: Path, text: str, **wishes: Any) -> Imported:
    (folder / "robot.xml").write_text(text)
    return imported(text, Wishes(folder / "robot.xml", folder, **wishes), Reporter())


def without(text: str, *words: str) -> str:
    """Return the text of a model without statements, one to a line, and without settings of joints."""
    text = re.sub(rf",\s*(?:{'|'.join(words)}) = [^,()]*(?=[,)])", "", text)
    gone = tuple(f"  {word} " for word in words)
    return "".join(f"{line}\n" for line in text.splitlines() if not line.startswith(gone))


class Twin:
    """A model in both programs: the state goes in by names."""

    def __init__(self, text: str, model: mechc.Model, off: tuple[str, ...]) -> None:
        self.m = mujoco.MjModel.from_xml_string(text)
        self.d = mujoco.MjData(self.m)
        self.m.actuator_actearly[:] = False  # of its steps
        for name in off:
            self.m.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}"))
        self.problem = model.problem(quick=True)
        self.functions = load_functions(self.problem)
        self.case = prepare(self.problem, self.functions, SimulationOptions(stop=1))
        self.states = [q.name for q in self.problem.states]
        self.inputs = [q.name for q in self.problem.inputs]

    def apart(
        self,
        random: np.random.Generator,
        joints: dict[str, str],
        controls: dict[str, str],
        most: float = 1.0,
    ) -> float:
        """Return how far accelerations of a random state are apart, relative to the largest; ``most``: of a control."""
        y, u = self.case.y0.copy(), np.zeros(len(self.inputs))
        rows: list[int] = []
        columns: list[int] = []

        def give(name: str, value: float, speed: float, q: int, v: int, of: float = 0.0) -> None:
            self.d.qpos[q], self.d.qvel[v] = value + of, speed
            y[self.states.index(name)], y[self.states.index(f"der({name})")] = value, speed
            rows.append(self.states.index(f"der({name})"))
            columns.append(v)

        for there, here in joints.items():
            joint = self.m.joint(there)
            q, v, kind = int(joint.qposadr[0]), int(joint.dofadr[0]), int(joint.type[0])
            if kind >= 2:
                value, speed = random.uniform(-1, 1, size=2)
                give(here, value, speed, q, v, float(self.m.qpos0[q]))
                continue
            if kind == 0:
                for k in range(3):
                    value, speed = random.normal(size=2)
                    give(f"{here}.position[{k + 1}]", value, speed, q + k, v + k)
                q, v = q + 3, v + 3
            turn, spin = random.normal(size=4), random.normal(size=3)
            self.d.qpos[q : q + 4] = turn = turn / np.linalg.norm(turn)
            self.d.qvel[v : v + 3] = spin
            y[[i for i, name in enumerate(self.states) if name.startswith(f"{here}.orientation")]] = turn
            spins = [i for i, name in enumerate(self.states) if name.startswith(f"der({here}.orientation")]
            y[spins] = spin
            rows += spins
            columns += range(v, v + 3)
        for there, here in controls.items():
            actuator = self.m.actuator(there)
            self.d.ctrl[actuator.id] = u[self.inputs.index(here)] = random.uniform(-most, most)
            if f"{there}_activation" in self.states:
                level = random.uniform(0, 1)
                self.d.act[int(self.m.actuator_actadr[actuator.id])] = level
                y[self.states.index(f"{there}_activation")] = level
        mujoco.mj_forward(self.m, self.d)
        ours = self.functions.rhs(0.0, y, u, self.case.z, self.case.p)[rows]
        theirs = self.d.qacc[columns]
        return float(np.abs(ours - theirs).max() / np.abs(theirs).max())


JOINTS = {
    "root": "root",
    "hip x": "hip_x.angle",
    "hip y": "hip_y.angle",
    "knee": "knee.position",
    "ankle": "ankle",
}
DRIVES = ("push", "hold", "turn", "slow", "wind", "lift", "thrust")


def test_accelerations_of_a_hopper(tmp_path: Path) -> None:
    """Joints out of their bodies, several on one, springs, tendons, each kind of actuator, wind and water, to rounding."""
    text = without(made(tmp_path, HOPPER).text, "friction")
    twin = Twin(HOPPER, mechc.loads(text), ("CONTACT", "LIMIT", "FRICTIONLOSS"))
    controls = {name: f"{name}_control" for name in DRIVES}
    random = np.random.default_rng(11)
    assert max(twin.apart(random, JOINTS, controls) for _ in range(6)) < 1e-12


def test_the_text_of_a_hopper(tmp_path: Path) -> None:
    model = made(tmp_path, HOPPER)
    assert format_file(parse(SourceFile("a", model.text), Reporter())) == model.text
    flat = " ".join(model.text.split())
    for words in (
        "model HopOne gravity {0.1, 0, -9.7} m/s^2;",
        "Free root(world -> trunk.a, position = {0.1, 0, 0.5} m, orientation = quat(",
        "angle = 0 rad, damping = 0.2 N.m.s, friction = 0.5 N.m, armature = 0.01 kg.m^2);",
        "contact hip_y_upper: 0.9 rad - hip_y.angle; contact hip_y_lower: hip_y.angle - (-1.1 rad);",
        "kinetic 1/2*0.01 kg.m^2*dot(der(ankle.orientation), der(ankle.orientation));",
        "let Length mix = 2 m/rad*hip_y.angle - 1.5*knee.position + 0.2 m;",
        "let Length rope = norm(pos(wall) - pos(jet)) + norm(pos(jet) - pos(toe))/2;",
        "force clamp(push_control, -0.5, 0.5)*3 N.m on hip_x.angle;",
        "torque thrust_control*{0.1, 0, -0.2} N.m on jet in jet;",
        'draw box({0.4, 0.2, 0.1} m) on trunk.a, colour = "#ff0000";',
        "experiment low(root.position = {0, 0, 1} m, root.orientation = quat(1, 0, 0, 0), hip_x.angle = 0.2 rad,",
    ):
        assert words in flat, words
    line = next(k for k, row in enumerate(HOPPER.splitlines(), start=1) if 'ref="0.1"' in row)
    sensor = next(k for k, row in enumerate(HOPPER.splitlines(), start=1) if "<sensor>" in row)
    early = next(k for k, row in enumerate(HOPPER.splitlines(), start=1) if "actearly" in row)
    assert set(model.left_out) == {
        f"that the activation of 'slow' acts a step early: there are no steps (line {early})",
        f"the zero of 'hip_y': it counts from its reference, 0.1 rad (line {line})",
        "the ends of joint ranges, unless stops = true",
        "that bodies of one tree touch each other, but in pairs that the file names",
        "contacts, unless contacts = true; they are rigid then, where those of MuJoCo give way",
        f"sensors (line {sensor})",
    }


TOGETHER = """\
<mujoco model="together">
  <compiler angle="radian"/>
  <worldbody>
    <body name="a"><joint name="p" axis="0 1 0" actuatorfrcrange="-0.9 0.7"/><geom size="0.1" pos="0.3 0 0"/>
      <body name="b" pos="0.3 0 0"><joint name="q" type="slide" actuatorfrcrange="-0.3 0.2"/><geom size="0.1"/>
        <body name="c"><joint name="r" axis="0 0 1" actuatorfrcrange="-0.1 0.1"/><geom size="0.1" pos="0 0.1 0"/></body>
      </body></body>
  </worldbody>
  <tendon><fixed name="t"><joint joint="r" coef="2"/></fixed></tendon>
  <actuator>
    <motor name="one" joint="p" gear="2"/>
    <position name="two" joint="p" kp="3"/>
    <motor name="three" joint="q"/>
    <motor name="four" tendon="t"/>
  </actuator>
</mujoco>
"""


def test_forces_on_a_joint_have_a_bound_together(tmp_path: Path) -> None:
    model = made(tmp_path, TOGETHER)
    said = "force clamp(one_control*2 + (3*two_control - 3*1*p.angle/(1 rad)), -0.9, 0.7)*1 N.m on p.angle;"
    assert said in " ".join(model.text.split())
    assert "the largest force of actuators on 'r' (line 6)" in model.left_out  # a tendon drives it
    free = TOGETHER.replace(' actuatorfrcrange="-0.1 0.1"', "")
    twin = Twin(free, mechc.loads(made(tmp_path, free).text), ("CONTACT",))
    joints = {"p": "p.angle", "q": "q.position", "r": "r.angle"}
    controls = {name: f"{name}_control" for name in ("one", "two", "three", "four")}
    random = np.random.default_rng(5)
    assert max(twin.apart(random, joints, controls) for _ in range(20)) < 1e-13


@pytest.mark.parametrize(
    ("flags", "gone"),
    [
        ("constraint", ("friction =", "contact ", "constraint", "mech.shapes")),
        ("equality", ("constraint",)),
        ("limit", ("contact p_upper",)),
        ("frictionloss", ("friction =",)),
        ("gravity", ("gravity {",)),
        ("contact", ("contact plane", "Boolean contacts")),
        ("clampctrl", ("clamp(push",)),
        ("actuation", ("input", "clamp(push")),
        ("spring", ("stiffness", "potential")),
        ("damper", ("damping",)),
        ("spring damper", ("stiffness", "potential", "damping", "flow", "force {")),
    ],
)
def test_what_flags_switch_off(tmp_path: Path, flags: str, gone: tuple[str, ...]) -> None:
    """The text does not hold it, and moves as MuJoCo does with the flags."""
    options = " ".join(f'{flag}="disable"' for flag in flags.split())
    text = FLAGS.replace("<option", f"<option><flag {options}/></option><option")
    model = made(tmp_path, text)
    whole = made(tmp_path, FLAGS).text
    for words in gone:
        assert words in whole and words not in model.text.partition("\nimport ")[2], words
    said = " ".join(model.left_out)
    assert ("contacts, unless contacts = true" in said) == (flags not in ("constraint", "contact"))
    assert ("the actuator 'push': it is disabled" in said) == (flags == "actuation")
    assert ("the equality 'tie', which is not active" in said) == (flags in ("constraint", "equality"))
    free = without(re.sub(r"\n  constraint tie:[^;]*;", "", model.text), "friction")
    twin = Twin(text, mechc.loads(free), ("CONTACT", "LIMIT", "FRICTIONLOSS", "EQUALITY"))
    controls = {} if flags == "actuation" else {"push": "push_control"}
    random = np.random.default_rng(3)
    joints = {"p": "p.angle", "q": "q.angle"}
    assert max(twin.apart(random, joints, controls, 3.0) for _ in range(6)) < 1e-13


FLAGS = """\
<mujoco model="flags">
  <compiler angle="radian"/>
  <option density="30" viscosity="0.05"/>
  <worldbody><geom name="plane" type="plane" size="1 1 1"/>
    <body name="a" gravcomp="0.3"><joint name="p" axis="0 1 0" damping="0.2" stiffness="3" frictionloss="0.4" range="-1 1" limited="true"/>
      <geom size="0.1" pos="0.3 0 0"/>
      <body name="b" pos="0.3 0 0"><joint name="q" axis="0 0 1"/><geom size="0.1" pos="0 0.1 0"/></body></body>
  </worldbody>
  <tendon><fixed name="t" stiffness="2" damping="0.1"><joint joint="q" coef="2"/></fixed></tendon>
  <equality><joint name="tie" joint1="q" joint2="p"/></equality>
  <actuator><motor name="push" joint="p" ctrlrange="-0.5 0.5" ctrllimited="true"/></actuator>
</mujoco>
"""


LOOP = """\
<mujoco model="loop">
  <option gravity="0 0 -9.81"/>
  <default><geom type="capsule" size="0.02"/><equality solref="0.02 1" solimp="0.9999 0.9999 0.001"/></default>
  <worldbody>
    <body name="a"><joint name="qa" axis="0 1 0"/><geom fromto="0 0 0 0 0 0.4"/>
      <body name="b" pos="0 0 0.4"><joint name="qb" axis="0 1 0"/><geom fromto="0 0 0 1 0 0"/></body></body>
    <body name="c" pos="1 0 0"><joint name="qc" axis="0 1 0"/><geom fromto="0 0 0 0 0 0.4"/></body>
    <body name="d" pos="0 1 0"><joint name="qd" axis="0 1 0"/><geom fromto="0 0 0 0 0 0.3"/>
      <body name="e" pos="0 0 0.3"><joint name="qe" type="slide" axis="1 0 0"/><geom fromto="0 0 0 0.2 0 0"/></body></body>
  </worldbody>
  <equality>
    <connect name="pin" body1="b" body2="c" anchor="1 0 0"/>
    <joint name="cam" joint1="qe" joint2="qd" polycoef="0.1 0.2 -0.3 0 0"/>
    <joint name="off" joint1="qd" polycoef="0.1 0 0 0 0" active="false"/>
  </equality>
</mujoco>
"""


def test_equalities_hold_exactly(tmp_path: Path) -> None:
    """A parallel crank: its bars stay parallel and the energy stays; a cam follows its polynomial."""
    model = made(tmp_path, LOOP)
    assert "that equalities give way: they hold exactly (lines 12, 13)" in model.left_out
    assert "the equality 'off', which is not active (line 14)" in model.left_out
    run = mechc.loads(model.text).simulate(set={"qa.angle": 0.5, "qd.angle": 0.2}, stop=0.5, tolerance=1e-10)
    assert run["qa.angle"] == pytest.approx(run["qc.angle"], abs=1e-8)
    d = run["qd.angle"]
    assert run["qe.position"] == pytest.approx(0.1 + 0.2 * d - 0.3 * d**2, abs=1e-8)
    assert abs(run["energy.total"] - run["energy.total"][0]).max() < 1e-8


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        ("<worldbody><body><joint/></body></worldbody>", "MuJoCo refuses it: .*mass"),
        ("<worldbody><bdy/></worldbody>", "MuJoCo refuses it: .*bdy"),
    ],
)
def test_wrong_robots(tmp_path: Path, inside: str, said: str) -> None:
    with pytest.raises(CompileError, match=said):
        made(tmp_path, f"<mujoco>{inside}</mujoco>")
    with pytest.raises(CompileError, match="says itself what moves freely"):
        made(tmp_path, f"<mujoco>{inside}</mujoco>", floating=True)


def test_what_is_left_out(tmp_path: Path) -> None:
    text = """<mujoco><option density="1.2"/><worldbody>
      <body name="m" mocap="true"><geom size="0.1"/></body>
      <body name="a"><joint name="h" axis="0 1 0"/><geom name="round" type="ellipsoid" size="0.1 0.2 0.1" fluidshape="ellipsoid"/><site name="s"/></body>
      <body name="b" pos="1 0 0"><joint name="k" axis="0 1 0"/><geom size="0.1"/><site name="t"/></body></worldbody>
      <tendon><spatial name="w"><site site="s"/><geom geom="round0"/><site site="t"/></spatial></tendon>
      <actuator><muscle name="m" joint="h" lengthrange="0 1"/><motor name="p" tendon="w"/></actuator></mujoco>"""
    text = text.replace(
        '<geom size="0.1"/><site name="t"',
        '<geom size="0.1"/><geom name="round0" size="0.05"/><site name="t"',
    )
    left = made(tmp_path, text).left_out
    for words in (
        "that 'm' is moved from outside: it stays where it is (line 2)",
        "how shapes of other kinds look (line 3)",
        "the tendon 'w': it wraps round a shape (line 5)",
        "the actuator 'm': it is a muscle (line 2)",
        "the actuator 'p': its tendon is left out (line 6)",
        "forces of the fluid on ellipsoids: those on boxes of the same inertia stand for them (line 1)",
    ):
        assert any(words.split(" (")[0] in one for one in left), (words, left)


def test_a_keyframe_sets_all_that_it_holds(tmp_path: Path) -> None:
    """Velocities of balls and of what is free, controls and activations; where equalities bind, all are guesses."""
    text = """
    <mujoco>
      <worldbody>
        <body name="free" pos="1 0 1"><freejoint name="flight"/><geom size="0.1"/></body>
        <body name="arm"><joint name="ball" type="ball"/><geom size="0.1" pos="0.2 0 0"/>
          <body><joint name="one" axis="0 1 0"/><geom size="0.1"/></body>
          <body><joint name="two" axis="0 1 0"/><geom size="0.1" pos="0 0 1"/></body>
        </body>
      </worldbody>
      EQUALITY
      <actuator>
        <motor name="push" joint="one"/>
        <general name="slow" joint="one" dyntype="filter" dynprm="0.3" gainprm="5"/>
      </actuator>
      <keyframe><key name="thrown" qpos="0 0 2 1 0 0 0 1 0 0 0 0.2 0.3" qvel="1 2 3 4 5 6 7 8 9 0.1 0.2" act="0.5"
        ctrl="0.3 0.4"/></keyframe>
    </mujoco>"""
    loose = mechc.loads(made(tmp_path, text.replace("EQUALITY", "")).text)
    start = loose.simulate(experiment="thrown", stop=0.0)
    data = mujoco.MjData(model := mujoco.MjModel.from_xml_string(text.replace("EQUALITY", "")))
    mujoco.mj_resetDataKeyframe(model, data, 0)
    for name, expected in (
        ("flight.position", data.qpos[:3]),
        ("der(flight.position)", data.qvel[:3]),
        ("der(flight.orientation)", data.qvel[3:6]),
        ("der(ball.orientation)", data.qvel[6:9]),
    ):
        found = [start[column][0] for column in start if column.startswith((f"{name}[", f"{name[:-1]}["))]
        assert found == list(expected), name
    assert (start["slow_activation"][0], start["push_control"][0], start["slow_control"][0]) == (
        0.5,
        0.3,
        0.4,
    )
    bound = made(
        tmp_path,
        text.replace(
            "EQUALITY", '<equality><joint joint1="one" joint2="two" polycoef="0 1 0 0 0"/></equality>'
        ),
    )
    begun = mechc.loads(bound.text).simulate(experiment="thrown", stop=0.0)
    assert begun["one.angle"][0] == pytest.approx(begun["two.angle"][0])
    assert 0.2 < begun["one.angle"][0] < 0.3


KNEE = """<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="shank">
      <joint name="knee" axis="0 1 0" range="0.1 2" limited="true"/>
      <geom type="sphere" size="0.1" pos="0.3 0 0"/>
    </body>
  </worldbody>
  <keyframe><key name="straight" qpos="0"/></keyframe>
</mujoco>"""


def test_a_joint_starts_within_its_range(tmp_path: Path) -> None:
    """The zero of MuJoCo's coordinate lies beyond the range, which a rigid stop refuses."""
    model = made(tmp_path, KNEE)
    assert (
        "the zero of 'knee': it lies beyond the range, and the joint starts at 0.1 rad (line 5)"
        in model.left_out
    )
    assert "straight(knee.angle = 0 rad" in " ".join(model.text.split())
    run = mechc.loads(model.text).simulate(set={"stops": True}, stop=0.1)
    assert run["knee.angle"][0] == 0.1
