"""Contacts of robots in MJCF: which shapes touch, against MuJoCo's own search, and motions beside closed forms and MuJoCo's.

Contacts of MuJoCo give way, here with a time constant of 2 ms (``solref``): its bodies sink in by some micrometres under their weight
and by a millimetre at impacts, and its steps of 0.2 ms are of first order. Closed forms of rigid bodies hold to the error of the run.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.lang.diagnostics import Reporter
from mechc.lang.importing import Imported, Wishes, imported
from mechc.lang.parser import parse
from mechc.lang.printing.printer import format_file
from mechc.lang.source import SourceFile

mujoco = pytest.importorskip("mujoco")

G = 9.81


def made(folder: Path, text: str) -> Imported:
    (folder / "robot.xml").write_text(text)
    return imported(text, Wishes(folder / "robot.xml", folder), Reporter())


def touching(text: str) -> dict[frozenset[str], float]:
    """Return the friction of each pair of shapes in a text."""
    found: dict[frozenset[str], float] = {}
    for one, others, friction in re.findall(r"contact (\w+)\s+with ([\w,\s]+?)(?:\s+friction (\S+))?;", text):
        for other in others.split(","):
            pair = frozenset({one, other.strip()})
            assert pair not in found
            found[pair] = float(friction or 0)
    return found


RULES = """\
<mujoco model="rules">
  <default><geom size="0.1" friction="0.5 0.01 0.001" mass="1"/></default>
  <worldbody>
    <geom name="ground" type="plane" size="1 1 1" pos="0 0 0.05" friction="0.6 0.01 0.001"/>
    <geom name="slope" type="plane" size="1 1 1" euler="0 30 0" contype="2" conaffinity="0"/>
    <geom name="step" type="box" size="0.1 0.1 0.1" contype="4" conaffinity="4"/>
    <geom name="bin" type="box" size="0.1 0.1 0.1" contype="0" conaffinity="1" friction="0.4 0 0"/>
    <body name="pole"><geom name="knob" contype="8" conaffinity="8"/></body>
    <body name="a"><freejoint/>
      <geom name="low" condim="1"/>
      <geom name="high" contype="2" conaffinity="2" friction="0.3 0 0" priority="1" pos="0.01 0 0"/>
      <frame pos="0 0.01 0"><geom name="crate" type="box" size="0.1 0.1 0.1" contype="1" conaffinity="4" friction="0.9 0 0"/></frame>
      <body name="b"><joint axis="0 1 0"/>
        <geom name="post" type="capsule" size="0.1 0.1" condim="4" pos="0 0 0.01"/>
        <geom name="drum" type="cylinder" size="0.1 0.1"/>
        <body name="c"><joint axis="0 0 1"/><geom name="toe" pos="0 0.02 0"/></body>
      </body>
    </body>
    <body name="d"><freejoint/>
      <geom name="ball" contype="13" conaffinity="13" friction="0.8 0 0"/>
      <geom name="ghost" contype="0" conaffinity="0"/>
    </body>
    <body name="e"><freejoint/><geom name="other" condim="1" friction="0.7 0 0"/></body>
  </worldbody>
  <contact>
    <exclude body1="d" body2="e"/>
    <pair geom1="toe" geom2="crate" friction="0.25 0.25 0 0 0"/>
    <pair name="uneven" geom1="ghost" geom2="ground" friction="0.2 0.1 0 0 0"/>
    <pair geom1="low" geom2="knob" condim="1"/>
    <pair geom1="toe" geom2="ground" friction="0.15 0.15 0 0 0"/>
  </contact>
</mujoco>
"""


def test_which_shapes_touch(tmp_path: Path) -> None:
    """Bits, bodies that carry one another, exclusions, pairs of the file; friction by priority, or the larger."""
    model = made(tmp_path, RULES)
    assert format_file(parse(SourceFile("a", model.text), Reporter())) == model.text
    m = mujoco.MjModel.from_xml_string(RULES)
    d = mujoco.MjData(m)
    m.geom_margin[:] = 1  # all is near
    m.pair_margin[:] = 1
    mujoco.mj_forward(m, d)
    theirs: dict[frozenset[str], float] = {}
    for k in range(d.ncon):
        contact = d.contact[k]
        one, other = (mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_GEOM, g) for g in contact.geom)
        theirs[frozenset({one, other})] = float(contact.friction[0]) if contact.dim > 1 else 0.0
    tree = {"low", "high", "crate", "post", "drum", "toe"}

    def carried(pair: frozenset[str]) -> bool:
        return pair == {"toe", "crate"} or not (pair <= tree or pair == {"drum", "bin"})

    expected = {pair: mu for pair, mu in theirs.items() if carried(pair)}
    assert touching(model.text) == pytest.approx(expected)
    assert len(expected) > 12 and len(theirs) > len(expected)
    flat = " ".join(model.text.split())
    for words in (
        "shape ground: Plane on world at {0, 0, 0.05} m;",
        "shape slope: Plane on world * roty(0.5235987755982988 rad);",
        "shape low: Sphere(r = 0.1 m) on a.a;",
        "shape crate: Box(size = {0.2, 0.2, 0.2} m) on a.a at {0, 0.01, 0} m;",
        "shape post: Capsule(r = 0.1 m, l = 0.2 m) on b.a * trans({0, 0, 0.01} m) * roty(90 deg);",
        "shape drum: Cylinder(r = 0.1 m, l = 0.2 m) on b.a * roty(90 deg);",
    ):
        assert words in flat, words

    def line(words: str) -> int:
        return next(k for k, row in enumerate(RULES.splitlines(), start=1) if words in row)

    said = model.left_out
    for words in (
        f"contacts of a box with a cylinder (lines {line('bin')}, {line('drum')})",
        f"edges of boxes that cross: boxes touch each other at their corners (lines {line('step')}, {line('bin')}, {line('crate')})",
        f"a second friction of pairs: 0.2 holds in all directions (line {line('uneven')})",
        "that bodies of one tree touch each other, but in pairs that the file names",
        f"torsional and rolling friction of contacts (line {line('post')})",
    ):
        assert words in said, (words, said)
    smooth = re.sub(r"\s+friction [\d.]+;", ";", model.text)  # else there are more rows than a run takes
    mechc.loads(smooth).with_values({"contacts": True})  # the library has a contact for each pair


def test_what_bodies_of_a_tree_do(tmp_path: Path) -> None:
    """A body and the one that carries it do not touch in MuJoCo, so nothing of it is left out; unless a flag says so."""
    text = """<mujoco><worldbody><geom name="p" type="plane" size="1 1 1"/><body><freejoint/><geom name="one" size="0.1"/>
      <body><joint/><geom name="two" size="0.1"/></body></body></worldbody></mujoco>"""
    said = "that bodies of one tree touch each other, but in pairs that the file names"
    assert said not in made(tmp_path, text).left_out
    flag = '<option><flag filterparent="disable"/></option><worldbody>'
    assert said in made(tmp_path, text.replace("<worldbody>", flag)).left_out


def test_what_lets_nothing_touch(tmp_path: Path) -> None:
    for text in (
        RULES.replace("<default>", '<option><flag contact="disable"/></option><default>', 1),
        '<mujoco><worldbody><geom type="plane" size="1 1 1"/></worldbody></mujoco>',
    ):
        model = made(tmp_path, text)
        assert "contact" not in model.text.partition("\nmodel ")[2] and "mech.shapes" not in model.text
        assert not any("touch" in one for one in model.left_out)


def test_friction_of_all_contacts(tmp_path: Path) -> None:
    """The option of the file that overrides what shapes say; margins are told."""
    text = """<mujoco><option o_friction="0.35 0.35 0 0 0" o_margin="0.01"><flag override="enable"/></option><worldbody>
      <geom name="p" type="plane" size="1 1 1"/><body><freejoint/><geom name="s" size="0.1"/></body></worldbody></mujoco>"""
    model = made(tmp_path, text)
    assert touching(model.text) == {frozenset({"p", "s"}): 0.35}
    assert "margins of contacts: shapes touch where their surfaces meet" in model.left_out


# ---------------------------------------------------------------- motions


class Beside:
    """A motion of both programs."""

    def __init__(
        self, folder: Path, text: str, stop: float, start: dict[str, Any], said: str = "", **how: Any
    ) -> None:
        self.imported = made(folder, text)
        model = mechc.loads(
            self.imported.text.replace("contact ground", "contact on_ground: ground").replace(
                "  end if;", f"{said}  end if;"
            )
        )
        self.still = model.simulate(stop=stop, set=start)  # contacts off
        self.run = model.simulate(stop=stop, set={"contacts": True, **start}, **how)
        assert self.run.outcome.name == "COMPLETED"
        self.m = mujoco.MjModel.from_xml_string(text)
        self.d = mujoco.MjData(self.m)

    def theirs(self, stop: float) -> None:
        while self.d.time < stop - self.m.opt.timestep / 2:
            mujoco.mj_step(self.m, self.d)

    def pressure(self) -> float:
        """Return the sum of all normal forces of MuJoCo."""
        total, force = 0.0, np.zeros(6)
        for k in range(self.d.ncon):
            mujoco.mj_contactForce(self.m, self.d, k, force)
            total += float(force[0])
        return total


def robot(bodies: str) -> str:
    return f"""<mujoco model="small">
      <option timestep="0.0002" cone="elliptic"/><default><geom solref="0.002 1"/></default>
      <worldbody><geom name="ground" type="plane" size="5 5 1" friction="0.3"/>{bodies}</worldbody></mujoco>"""


def test_a_sled_slides_to_rest(tmp_path: Path) -> None:
    """It stands on three balls, and the distance is v^2/(2 mu g)."""
    feet = "".join(
        f'<geom name="foot_{k}" pos="{x} {y} 0" size="0.02" mass="0.1" friction="0.4"/>'
        for k, (x, y) in enumerate(((0.3, 0), (-0.3, 0.2), (-0.3, -0.2)))
    )
    body = '<geom type="box" size="0.3 0.2 0.01" mass="2" contype="0" conaffinity="0"/>'
    sled = f'<body name="sled" pos="0 0 0.02"><freejoint name="root"/>{body}{feet}</body>'
    both = Beside(tmp_path, robot(sled), 0.6, {"der(root.position)": [1.5, 0, 0]})
    distance = 1.5**2 / (2 * 0.4 * G)
    assert both.run["root.position[1]"][-1] == pytest.approx(distance, abs=1e-8)
    assert both.run["root.position[3]"][-1] == pytest.approx(0.02, abs=1e-9)
    assert both.still["root.position[3]"][-1] == pytest.approx(0.02 - G * 0.6**2 / 2, abs=1e-8)
    both.d.qvel[0] = 1.5
    both.theirs(0.6)
    assert both.d.qpos[0] == pytest.approx(distance, abs=1e-3)
    assert both.d.qpos[2] == pytest.approx(0.02, abs=2e-5)


def test_a_crate_lands_on_its_face(tmp_path: Path) -> None:
    crate = '<body name="crate" pos="0 0 0.15"><freejoint name="root"/><geom type="box" size="0.1 0.08 0.05" mass="2"/></body>'
    both = Beside(tmp_path, robot(crate), 0.3, {})
    assert both.run.events[0].time == pytest.approx(math.sqrt(2 * 0.1 / G), abs=1e-9)
    assert both.run["root.position[3]"][-1] == pytest.approx(0.05, abs=1e-9)
    both.theirs(1)
    assert both.d.qpos[2] == pytest.approx(0.05, abs=2e-5)


def test_a_ball_slides_until_it_rolls(tmp_path: Path) -> None:
    """It rolls from 2 v/(7 mu g) on, at 5/7 of its speed."""
    ball = '<body name="ball" pos="0 0 0.1"><freejoint name="root"/><geom size="0.1" mass="1" friction="0.2"/></body>'
    both = Beside(tmp_path, robot(ball), 1.0, {"der(root.position)": [2.0, 0, 0]})
    slides = 2 * 2 / (7 * 0.3 * G)
    end = 2 * slides - 0.3 * G * slides**2 / 2 + 10 / 7 * (1 - slides)
    assert both.run["root.position[1]"][-1] == pytest.approx(end, abs=1e-7)
    both.d.qvel[0] = 2
    both.theirs(1.0)
    assert both.d.qpos[0] == pytest.approx(end, abs=1e-3)
    assert both.d.qvel[0] == pytest.approx(10 / 7, rel=5e-4)


def test_a_rod_lands_flat(tmp_path: Path) -> None:
    """It falls freely, and lies at the height of its radius."""
    rod = '<body name="rod" pos="0 0 0.5"><freejoint name="root"/><geom type="capsule" size="0.03 0.2" euler="0 90 0" mass="1"/></body>'
    both = Beside(tmp_path, robot(rod), 0.6, {})
    impact = math.sqrt(2 * 0.47 / G)
    assert both.run.events[0].time == pytest.approx(impact, abs=1e-9)
    assert both.run["root.position[3]"][-1] == pytest.approx(0.03, abs=1e-9)
    both.theirs(0.3)
    assert both.d.qpos[2] == pytest.approx(0.5 - G * 0.3**2 / 2, abs=1e-3)  # its method is of first order
    both.theirs(0.6)
    assert both.d.qpos[2] == pytest.approx(0.03, abs=2e-5)


def test_a_drum_rolls_down(tmp_path: Path) -> None:
    """On a slope of 5 degrees, without slip: two thirds of the acceleration down it. Upright it stands."""
    slope = '<geom name="ground" type="plane" size="9 9 1" friction="0.3" euler="0 5 0"/>'
    drum = '<body name="drum" pos="0 0 {}"><freejoint name="root"/><geom type="cylinder" size="0.1 0.2" euler="{} 0 0" mass="1"/></body>'
    high = 0.1 / math.cos(math.radians(5))
    lying = robot("").replace('<geom name="ground" type="plane" size="5 5 1" friction="0.3"/>', slope)
    both = Beside(tmp_path, lying.replace("</worldbody>", drum.format(high, 90) + "</worldbody>"), 0.5, {})
    along = G * math.sin(math.radians(5)) * 0.5**2 / 3
    assert both.run["root.position[1]"][-1] == pytest.approx(along * math.cos(math.radians(5)), abs=1e-7)
    both.theirs(0.5)
    assert both.d.qpos[0] == pytest.approx(along * math.cos(math.radians(5)), abs=1e-3)
    standing = Beside(tmp_path, robot(drum.format(0.25, 0)), 0.4, {})
    assert standing.run.events[0].time == pytest.approx(math.sqrt(2 * 0.05 / G), abs=1e-9)
    assert standing.run["root.position[3]"][-1] == pytest.approx(0.2, abs=1e-9)
    standing.theirs(0.4)
    assert standing.d.qpos[2] == pytest.approx(0.2, abs=2e-5)


def test_a_crate_slides_on_a_table(tmp_path: Path) -> None:
    """A box on a larger one of the world, on its four corners: v^2/(2 mu g)."""
    table = '<geom name="table" type="box" size="1 0.5 0.1" pos="0 0 0.1" friction="0.4"/>'
    crate = '<body name="crate" pos="-0.5 0 0.25"><freejoint name="root"/><geom type="box" size="0.1 0.08 0.05" mass="2" friction="0.2"/></body>'
    both = Beside(
        tmp_path, robot(table + crate), 0.6, {"der(root.position)": [1.5, 0, 0]}, method="moreau", step="1 ms"
    )
    end = -0.5 + 1.5**2 / (2 * 0.4 * G)
    assert both.run["root.position[1]"][-1] == pytest.approx(end, abs=1e-5)
    assert both.run["root.position[3]"][-1] == pytest.approx(0.25, abs=1e-5)
    both.d.qvel[0] = 1.5
    both.theirs(0.6)
    assert both.d.qpos[0] == pytest.approx(end, abs=1e-3)


def test_a_ball_rests_on_a_step(tmp_path: Path) -> None:
    """A box of the world."""
    step = '<geom name="step" type="box" size="0.3 0.3 0.2" pos="0 0 0.1"/>'
    ball = '<body name="ball" pos="0.1 0 0.6"><freejoint name="root"/><geom size="0.1" mass="1" contype="2"/></body>'
    both = Beside(tmp_path, robot(step.replace("/>", ' conaffinity="2"/>') + ball), 0.5, {})
    assert both.run.events[0].time == pytest.approx(math.sqrt(2 * 0.2 / G), abs=1e-9)
    assert both.run["root.position[3]"][-1] == pytest.approx(0.4, abs=1e-9)
    both.theirs(1.0)
    assert both.d.qpos[2] == pytest.approx(0.4, abs=2e-5)


HOPPER = """<body name="trunk" pos="0 0 0.8"><joint name="rail" type="slide" axis="0 0 1"/><geom size="0.05" mass="3" contype="0" conaffinity="0"/>
  <body name="shin" pos="0 0 -0.5"><joint name="leg" type="slide" axis="0 0 1" stiffness="600"/><geom name="foot" size="0.04" mass="0.5"/></body></body>"""


def test_a_hopper_lands_on_its_spring(tmp_path: Path) -> None:
    """Its foot stops dead at the impact, and the trunk moves on it as an oscillator does."""
    both = Beside(tmp_path, robot(HOPPER), 0.35, {})
    impact = math.sqrt(2 * 0.26 / G)
    assert both.run.events[0].time == pytest.approx(impact, abs=1e-9)
    w, sag, speed = math.sqrt(600 / 3), 3 * G / 600, G * impact

    def trunk(t: float) -> float:
        """Return how far it has moved down, while the foot stands."""
        t -= impact
        return 0.26 + sag + speed / w * math.sin(w * t) - sag * math.cos(w * t)

    for t in (0.25, 0.3, 0.35):
        ours = -both.run(t)["rail.position"]
        assert ours == pytest.approx(trunk(t), abs=1e-7)
        both.theirs(t)
        assert -both.d.qpos[0] == pytest.approx(trunk(t), abs=1e-3)


def leg(name: str, x: float, y: float) -> str:
    return f"""<body name="{name}" pos="{x} {y} 0"><joint name="{name}_hip" axis="0 1 0" damping="1" stiffness="300"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.015" mass="0.3" contype="0" conaffinity="0"/>
      <geom name="{name}_foot" pos="0 0 -0.3" size="0.03" mass="0.1"/></body>"""


def test_a_quadruped_stands(tmp_path: Path) -> None:
    """It lands on four feet at once, which carry its weight."""
    ends = {
        "front_left": (0.2, 0.1),
        "front_right": (0.2, -0.1),
        "back_left": (-0.2, 0.1),
        "back_right": (-0.2, -0.1),
    }
    legs = "".join(leg(name, x, y) for name, (x, y) in ends.items())
    trunk = f'<body name="trunk" pos="0 0 0.4"><freejoint name="root"/><geom type="box" size="0.2 0.1 0.05" mass="4"/>{legs}</body>'
    carried = "output Force carried = multiplier(on_ground);"
    both = Beside(tmp_path, robot(trunk), 0.5, {}, carried)
    impact = math.sqrt(2 * 0.07 / G)
    assert [e.time for e in both.run.events][:4] == pytest.approx([impact] * 4, abs=1e-9)
    assert both.run["root.position[3]"][-1] == pytest.approx(0.33, abs=1e-9)
    weight = (4 + 4 * 0.4) * G
    assert both.run["carried"][-1] == pytest.approx(weight, rel=1e-9)
    both.theirs(1.5)
    assert both.d.qpos[2] == pytest.approx(0.33, abs=2e-5)
    assert both.pressure() == pytest.approx(weight, rel=1e-4)
