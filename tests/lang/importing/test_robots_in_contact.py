"""Robots of dm_control at their stops, on the ground, on walls and on each other, beside MuJoCo with contacts that hardly give way.

MuJoCo's contacts are springs with dampers: with a time constant of 1 ms and eight times the critical damping bodies do not rebound,
as ours do not. Both programs leave out the same shapes; the bodies of one robot pass through each other.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import mechc
from mechc.lang.diagnostics import Reporter
from mechc.lang.importing import Wishes, imported
from mechc.runtime.outcome import Outcome

mujoco = pytest.importorskip("mujoco")
HOME = importlib.util.find_spec("dm_control")
needs_dm_control = pytest.mark.skipif(HOME is None, reason="needs dm_control")
NOTHING: dict[str, dict[str, float]] = {}
NO_VALUES: dict[str, float] = {}
LEFT_OUT = ("mjGEOM_HFIELD", "mjGEOM_ELLIPSOID", "mjGEOM_CYLINDER")


def path_of(robot: str) -> Path:
    assert HOME is not None and HOME.origin is not None
    return Path(HOME.origin).parent / "suite" / f"{robot}.xml"


def hard(
    robot: str, stop: float, every: float, said: Mapping[str, Mapping[str, float]] = NOTHING
) -> np.ndarray:
    """Coordinates at each multiple of ``every`` up to ``stop``, as MuJoCo steps them: ``said`` sets qpos, qvel and ctrl by names."""
    m = mujoco.MjModel.from_xml_path(str(path_of(robot)))
    m.opt.timestep, m.opt.tolerance, m.opt.iterations = 5e-5, 1e-12, 200
    m.opt.cone, m.opt.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 100
    for law in ("geom", "jnt", "eq", "dof"):
        getattr(m, f"{law}_solref")[:] = [1e-3, 8]
        getattr(m, f"{law}_solimp")[:] = [0.99, 0.999, 1e-4, 0.5, 2]
    for kind in LEFT_OUT:
        left = m.geom_type == int(getattr(mujoco.mjtGeom, kind))
        m.geom_contype[left] = m.geom_conaffinity[left] = 0

    def skip(m: Any, _: Any, one: int, other: int) -> int:
        trees = [m.body_rootid[m.geom_bodyid[g]] for g in (one, other)]
        if trees[0] == trees[1] != 0:
            return 1
        bits = [(m.geom_contype[g], m.geom_conaffinity[g]) for g in (one, other)]
        return int(not (bits[0][0] & bits[1][1] or bits[1][0] & bits[0][1]))

    mujoco.set_mjcb_contactfilter(skip)
    try:
        data, rows = mujoco.MjData(m), []
        for joint, value in said.get("qpos", {}).items():
            data.joint(joint).qpos[0] += value
        for joint, value in said.get("qvel", {}).items():
            data.joint(joint).qvel[0] = value
        for drive, value in said.get("ctrl", {}).items():
            data.actuator(drive).ctrl[0] = value
        for _ in range(round(stop / every)):
            for _ in range(round(every / m.opt.timestep)):
                mujoco.mj_step(m, data)
            rows.append(data.qpos - m.qpos0)
    finally:
        mujoco.set_mjcb_contactfilter(None)
    return np.array(rows)


def ours(robot: str, values: Mapping[str, float], **settings: Any) -> mechc.Solution:
    path = path_of(robot)
    text = imported(path.read_text(), Wishes(path, path.parent), Reporter()).text
    switches = {word: True for word in ("contacts", "stops") if f"Boolean {word}" in text}
    solution = mechc.loads(text).simulate(set={**switches, **values}, estimate_error=False, **settings)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    return solution


def stepped(
    robot: str, step: str, stop: float, every: float, values: Mapping[str, float] = NO_VALUES
) -> mechc.Solution:
    solution = ours(robot, values, method="moreau", step=step, stop=f"{stop} s", every=f"{every} s")
    assert solution.report["contact"]["unsolved"] == 0
    return solution


@needs_dm_control
@pytest.mark.slow
def test_a_quadruped_lands_on_its_feet() -> None:
    """271 contacts, of which its toes and the ball touch the floor. Impacts are dated to steps of 0.5 ms; the ball falls for 0.76 s."""
    ours, theirs = stepped("quadruped", "0.5 ms", 1.0, 0.1), hard("quadruped", 1.0, 0.1)
    sides = ["front_left", "front_right", "back_right", "back_left"]
    for number, side in enumerate(sides):
        for k, joint in enumerate(["yaw", "pitch", "knee", "ankle"]):
            angles = ours[f"{joint}_{side}.angle"][1:]
            assert np.abs(angles - theirs[:, 7 + 4 * number + k]).max() < 6e-3
    assert np.abs(ours["root.position"][1:, 2] - 0.57 - theirs[:, 2]).max() < 2.5e-3
    assert (
        np.abs(ours["ball_root.position"][1:, 2] - 3 - theirs[:, 25]).max() < 4e-3
    )  # MuJoCo's gives way by 2.5 mm


@needs_dm_control
@pytest.mark.slow
def test_a_manipulator_beside_what_falls() -> None:
    """Joints with springs and dampers a thousand times as fast as the steps; a ball rolls off, a peg tumbles over the edges of a box."""
    ours, theirs = stepped("manipulator", "1 ms", 0.7, 0.1), hard("manipulator", 0.7, 0.1)
    joints = [
        "arm_root",
        "arm_shoulder",
        "arm_elbow",
        "arm_wrist",
        "thumb",
        "thumbtip",
        "finger",
        "fingertip",
    ]
    for k, joint in enumerate(joints):
        assert np.abs(ours[f"{joint}.angle"][1:] - theirs[:, k]).max() < 1e-4
    sizes = {"ball_x.position": 3e-3, "ball_z.position": 1e-3, "ball_y.angle": 0.15}
    sizes |= {"peg_x.position": 0.012, "peg_z.position": 0.02, "peg_y.angle": 0.15}
    for k, (name, size) in enumerate(sizes.items()):
        assert np.abs(ours[name][1:] - theirs[:, 8 + k]).max() < size, name
        assert np.abs(theirs[:, 8 + k]).max() > 0.1


class Motion(NamedTuple):
    """Three seconds with located events."""

    robot: str
    said: dict[str, dict[str, float]]
    """What MuJoCo starts from."""
    values: dict[str, float]
    """The same in words of the model."""
    events: dict[str, float]
    """The first impact of each row of this name, which must happen, and its time in s."""
    errors: dict[str, float]
    """How far each coordinate may be off, in the order of qpos."""


MOTIONS = (
    # The cart strikes its stop, and the pole swings on as the stop holds the cart, lifts it off and lets it come back.
    Motion(
        "cartpole",
        {"qpos": {"hinge_1": 0.1}, "ctrl": {"slide": 0.3}},
        {"hinge_1.angle": 0.1, "slide_control": 0.3},
        {"slider_upper": 1.160},
        {"slider.position": 2e-3, "hinge_1.angle": 0.03},
    ),
    # The wrist strikes its stop while the shoulder turns on.
    Motion(
        "reacher",
        {"qvel": {"shoulder": -1, "wrist": 2}, "ctrl": {"shoulder": 0.3, "wrist": 1}},
        {
            "der(shoulder.angle)": -1,
            "der(wrist.angle)": 2,
            "shoulder_actuator_control": 0.3,
            "wrist_actuator_control": 1,
        },
        {"wrist_upper": 0.6015},
        {"shoulder.angle": 1e-4, "wrist.angle": 2e-3},
    ),
    # A mass on tendons along both axes comes to a wall.
    Motion(
        "point_mass",
        {"qvel": {"root_x": 1, "root_y": 0.5}, "ctrl": {"t1": -1, "t2": 0.9}},
        {
            "der(root_x.position)": 1,
            "der(root_y.position)": 0.5,
            "t1_actuator_control": -1,
            "t2_actuator_control": 0.9,
        },
        {"root_y_upper": 1.858},
        {"root_x.position": 3e-5, "root_y.position": 1e-4},
    ),
    # A finger strikes a spinner that dry friction holds, rolls on it, pushes it away and lets it go.
    Motion(
        "finger",
        {"qpos": {"hinge": 0.3}, "ctrl": {"proximal": 0.15, "distal": 0.05}},
        {"hinge.angle": 0.3, "proximal_actuator_control": 0.15, "distal_actuator_control": 0.05},
        {"fingertip-cap2.touch": 0.717},
        {"proximal.angle": 8e-3, "distal.angle": 4e-3, "hinge.angle": 0.016},
    ),
    # It stands on two feet, and twelve springs and dampers settle between contacts that stick and slip some hundreds of times.
    Motion(
        "cheetah",
        {},
        {},
        {},
        {
            "rootx.position": 8e-4,
            "rootz.position": 1e-3,
            "rooty.angle": 6e-4,
            "bthigh.angle": 1e-3,
            "bshin.angle": 2e-3,
            "bfoot.angle": 2e-3,
            "fthigh.angle": 2e-3,
            "fshin.angle": 2e-3,
            "ffoot.angle": 2e-3,
        },
    ),
    # The ball falls until its string is tight.
    Motion(
        "ball_in_cup",
        {},
        {},
        {},
        {"cup_x.position": 1e-6, "cup_z.position": 1e-3, "ball_x.position": 1e-6, "ball_z.position": 4e-3},
    ),
)


@needs_dm_control
@pytest.mark.slow
@pytest.mark.parametrize("motion", MOTIONS, ids=[motion.robot for motion in MOTIONS])
def test_three_seconds_beside_mujoco(motion: Motion) -> None:
    """Differences are those of contacts that give way: an impact takes MuJoCo some milliseconds, and its friction creeps."""
    solution = ours(motion.robot, motion.values, stop="3 s")
    theirs = hard(motion.robot, 3.0, 0.1, motion.said)
    for name, time in motion.events.items():
        assert next(e.time for e in solution.events if e.name == name) == pytest.approx(time, abs=1e-3)
    for k, (name, size) in enumerate(motion.errors.items()):
        start = motion.said.get("qpos", {}).get(name.partition(".")[0], 0)
        mine = np.array([solution((j + 1) * 0.1)[name] for j in range(30)]) - solution[name][0] + start
        assert np.abs(mine - theirs[:, k]).max() < size, name
    assert np.abs(theirs[-1]).max() > 10 * max(motion.errors.values())


LEGS = tuple(f"{side}_{joint}.angle" for side in ("right", "left") for joint in ("hip", "knee", "ankle"))


@needs_dm_control
@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "step", "said", "names", "until"),
    [
        (
            "hopper",
            "0.1 ms",
            {"knee": math.radians(5)},
            ("rootx", "rootz", "rooty", "waist", "hip", "knee", "ankle"),
            1.0,
        ),
        ("walker", "0.2 ms", {"rooty": 0.3}, ("rootz", "rootx", "rooty", *LEGS), 0.5),
    ],
)
def test_a_fall_that_comes_to_rest(
    robot: str, step: str, said: dict[str, float], names: tuple[str, ...], until: float
) -> None:
    """Legs that land, fold up to their stops, slide and fall over: one impact after the other lets small differences grow tenfold.

    They lie still in the end. The hopper starts at the lower stop of its knee: its zero lies outside the range of the joint.
    """
    # Names of coordinates: those of a slide are positions.
    full = [n if "." in n else f"{n}.{'position' if n in ('rootx', 'rootz') else 'angle'}" for n in names]
    values = {f"{joint}.angle": value for joint, value in said.items()}
    mine, theirs = stepped(robot, step, 3.0, 0.1, values), hard(robot, 3.0, 0.1, {"qpos": said})
    early = round(until / 0.1)
    for k, name in enumerate(full):
        start = said.get(name.partition(".")[0], 0.0)
        off = np.abs(mine[name][1:] - mine[name][0] + start - theirs[:, k])
        assert off[:early].max() < 5e-3, name
        assert off.max() < 0.25, name
        assert np.ptp(mine[name][-5:]) < 2e-3, name
    assert np.ptp(theirs[:, full.index("rooty.angle")]) > 1.5
    assert np.abs(mine["rootx.position"][1:] - theirs[:, full.index("rootx.position")]).max() < 0.04
