"""Robots of dm_control and Gymnasium at their stops, on the ground, on walls and on each other, beside MuJoCo with contacts that hardly give way.

MuJoCo's contacts are springs with dampers: with a time constant of 1 ms and eight times the critical damping bodies do not rebound,
as ours do not. Both programs leave out the same shapes; the bodies of one robot pass through each other.
"""

from __future__ import annotations

import importlib.util
import re
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
LEFT_OUT = ("mjGEOM_HFIELD", "mjGEOM_ELLIPSOID", "mjGEOM_MESH")
FOLDERS = {"dm_control": "suite", "gymnasium": "envs/mujoco/assets"}


def path_of(robot: str, package: str = "dm_control") -> Path:
    home = importlib.util.find_spec(package)
    if home is None or home.origin is None:
        pytest.skip(f"needs {package}")
    return Path(home.origin).parent / FOLDERS[package] / f"{robot}.xml"


class Theirs(NamedTuple):
    """``q`` [times, nq]: coordinates; ``pressure`` [times]: the sum of all normal forces, in N."""

    m: Any
    q: np.ndarray
    pressure: np.ndarray


def hard(
    robot: str,
    stop: float,
    every: float,
    said: Mapping[str, Mapping[str, Any]] = NOTHING,
    package: str = "dm_control",
    step: float = 5e-5,
) -> Theirs:
    """What MuJoCo's steps come to at each multiple of ``every`` up to ``stop``: ``said`` sets qpos, qvel and ctrl by names, of free joints
    the place."""
    mujoco.set_mju_user_warning(lambda _: None)  # else they go to a file of MuJoCo
    try:
        m = mujoco.MjModel.from_xml_path(str(path_of(robot, package)))
    finally:
        mujoco.set_mju_user_warning(None)
    m.opt.timestep, m.opt.tolerance, m.opt.iterations = step, 1e-12, 200
    m.opt.cone, m.opt.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 100
    for law in ("geom", "jnt", "eq", "dof", "pair"):
        getattr(m, f"{law}_solref")[:] = [1e-3, 8]
        getattr(m, f"{law}_solimp")[:] = [0.99, 0.999, 1e-4, 0.5, 2]
    m.geom_margin[:] = 0
    m.geom_condim[:] = np.minimum(m.geom_condim, 3)
    for kind in LEFT_OUT:
        left = m.geom_type == int(getattr(mujoco.mjtGeom, kind))
        m.geom_contype[left] = m.geom_conaffinity[left] = 0
    drum, others = (
        [int(getattr(mujoco.mjtGeom, f"mjGEOM_{kind}")) for kind in kinds]
        for kinds in (("CYLINDER",), ("CYLINDER", "CAPSULE", "BOX"))
    )

    def skip(m: Any, _: Any, one: int, other: int) -> int:
        trees = [m.body_rootid[m.geom_bodyid[g]] for g in (one, other)]
        kinds = [int(m.geom_type[g]) for g in (one, other)]
        if trees[0] == trees[1] != 0 or (set(kinds) & set(drum) and set(kinds) <= set(others)):
            return 1
        bits = [(m.geom_contype[g], m.geom_conaffinity[g]) for g in (one, other)]
        return int(not (bits[0][0] & bits[1][1] or bits[1][0] & bits[0][1]))

    mujoco.set_mjcb_contactfilter(skip)
    try:
        data, rows, pressure = mujoco.MjData(m), [], []
        for joint in range(m.njnt):  # one whose zero lies outside its range starts at the nearer end
            if m.jnt_limited[joint] and m.jnt_type[joint] >= 2:
                at = m.jnt_qposadr[joint]
                data.qpos[at] = np.clip(m.qpos0[at], *m.jnt_range[joint])
        for name, value in said.get("qpos", {}).items():
            at = int(m.joint(name).qposadr[0])
            data.qpos[at : at + np.size(value)] = value if np.ndim(value) else m.qpos0[at] + value
        for name, value in said.get("qvel", {}).items():
            data.joint(name).qvel[0] = value
        for drive, value in said.get("ctrl", {}).items():
            data.actuator(drive).ctrl[0] = value
        for _ in range(round(stop / every)):
            for _ in range(round(every / m.opt.timestep)):
                mujoco.mj_step(m, data)
            rows.append(data.qpos.copy())
            pressure.append(sum(_normal_force(m, data, k) for k in range(data.ncon)))
    finally:
        mujoco.set_mjcb_contactfilter(None)
    return Theirs(m, np.array(rows), np.array(pressure))


def _normal_force(m: Any, data: Any, contact: int) -> float:
    force = np.zeros(6)
    mujoco.mj_contactForce(m, data, contact, force)
    return float(force[0])


def text_of(robot: str, package: str = "dm_control") -> str:
    path = path_of(robot, package)
    return imported(path.read_text(), Wishes(path, path.parent), Reporter()).text


def moved_as_said(text: str, values: Mapping[str, float], **settings: Any) -> mechc.Solution:
    switches = {word: True for word in ("contacts", "stops") if f"Boolean {word}" in text}
    solution = mechc.loads(text).simulate(set={**switches, **values}, estimate_error=False, **settings)
    assert solution.outcome is Outcome.COMPLETED, solution.message
    return solution


def ours(robot: str, values: Mapping[str, float], **settings: Any) -> mechc.Solution:
    return moved_as_said(text_of(robot), values, **settings)


def offsets(theirs: Theirs) -> np.ndarray:
    return np.asarray(theirs.q - theirs.m.qpos0)


def stepped(
    robot: str, step: str, stop: float, every: float, values: Mapping[str, float] = NO_VALUES
) -> mechc.Solution:
    solution = ours(robot, values, method="moreau", step=step, stop=f"{stop} s", every=f"{every} s")
    assert solution.report["contact"]["unsolved"] == 0
    return solution


@needs_dm_control
@pytest.mark.slow
def test_a_manipulator_beside_what_falls() -> None:
    """Joints with springs and dampers a thousand times as fast as the steps; a ball rolls off, a peg tumbles over the edges of a box."""
    ours, theirs = stepped("manipulator", "1 ms", 0.7, 0.1), offsets(hard("manipulator", 0.7, 0.1))
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
    theirs = offsets(hard(motion.robot, 3.0, 0.1, motion.said))
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
        ("walker", "0.2 ms", {"rooty": 0.3}, ("rootz", "rootx", "rooty", *LEGS), 0.5),
    ],
)
def test_a_fall_that_comes_to_rest(
    robot: str, step: str, said: dict[str, float], names: tuple[str, ...], until: float
) -> None:
    """Legs that land, fold up to their stops, slide and fall over: one impact after the other lets small differences grow tenfold.

    They lie still in the end.
    """
    # Names of coordinates: those of a slide are positions.
    full = [n if "." in n else f"{n}.{'position' if n in ('rootx', 'rootz') else 'angle'}" for n in names]
    values = {f"{joint}.angle": value for joint, value in said.items()}
    mine, theirs = stepped(robot, step, 3.0, 0.1, values), offsets(hard(robot, 3.0, 0.1, {"qpos": said}))
    early = round(until / 0.1)
    for k, name in enumerate(full):
        start = said.get(name.partition(".")[0], 0.0)
        off = np.abs(mine[name][1:] - mine[name][0] + start - theirs[:, k])
        assert off[:early].max() < 5e-3, name
        assert off.max() < 0.25, name
        assert np.ptp(mine[name][-5:]) < 2e-3, name
    assert np.ptp(theirs[:, full.index("rooty.angle")]) > 1.5
    assert np.abs(mine["rootx.position"][1:] - theirs[:, full.index("rootx.position")]).max() < 0.04


class Fall(NamedTuple):
    """Three seconds from a start that lets small differences grow little. ``way``, ``end``: how far the mass centres of bodies may be apart
    at any time and in the end, in m; ``floor``: what alone carries a robot that lies still in the end."""

    package: str
    robot: str
    said: dict[str, dict[str, Any]]
    values: dict[str, Any]
    settings: dict[str, str]
    way: float
    end: float
    floor: str = ""


LEAN = {"qpos": {"rooty": 0.3}}, {"rooty.angle": 0.3}


def steps(step: str) -> dict[str, str]:
    return {"method": "moreau", "step": step}


FALLS = (
    # It lands on four feet, as far in the floor as it falls in half a step.
    Fall("gymnasium", "ant", {}, {}, steps("0.25 ms"), 2e-3, 4e-4, "floor_plane"),
    # It lands and stands on two feet, between springs.
    Fall("gymnasium", "half_cheetah", {}, {}, {}, 8e-4, 5e-4),
    # They fall forwards, fold up and lie.
    Fall("gymnasium", "hopper", *LEAN, steps("0.5 ms"), 0.015, 8e-3, "floor_plane"),
    Fall("gymnasium", "walker2d_v5", *LEAN, steps("0.5 ms"), 0.02, 0.012, "floor_plane"),
    Fall("dm_control", "hopper", *LEAN, steps("0.25 ms"), 8e-3, 6e-3),
    # It folds up, falls on its knees and over, and lies.
    Fall("dm_control", "humanoid", {}, {}, steps("1 ms"), 0.03, 0.01, "floor_plane"),
    # 62 freedoms, with stops at all joints.
    Fall("dm_control", "humanoid_CMU", {}, {}, steps("0.5 ms"), 0.04, 0.035),
    # Joints run into their stops in a thick fluid; an impact takes MuJoCo some milliseconds.
    Fall(
        "gymnasium",
        "swimmer",
        {"qvel": {"motor1_rot": 6.0, "motor2_rot": -5.0}},
        {"der(motor1_rot.angle)": 6.0, "der(motor2_rot.angle)": -5.0},
        {},
        1e-4,
        3e-5,
    ),
    # Sixteen joints with springs and tendons on four feet. The ball falls beside: where it starts, it wedges itself between the hind legs,
    # at 29 degrees to the line between both contacts, less than the angle of friction, 35: rigid bodies do not determine the squeeze.
    Fall(
        "dm_control",
        "quadruped",
        {"qpos": {"ball_root": [1.5, 0.5, 2.0]}},
        {"ball_root.position": [1.5, 0.5, 2.0]},
        steps("0.5 ms"),
        5e-3,
        1e-3,
    ),
)


def rows_of(solution: mechc.Solution, text: str, m: Any, every: float) -> np.ndarray:
    """Return the coordinates of MuJoCo, and behind them the velocities, at each multiple of ``every``."""
    changed = dict(re.findall(r"^//   (\w+ .*): (\w+)$", text, re.M))
    times = np.arange(1, round(solution.time[-1] / every) + 1) * every
    at = np.array([np.flatnonzero(np.abs(solution.time - t) < every / 1e6)[-1] for t in times])
    rows = np.zeros((len(times), m.nq + m.nv))
    for joint in range(m.njnt):
        given = m.joint(joint).name or f"joint_{joint}"
        name, kind = changed.get(f"joint {given}", given), int(m.jnt_type[joint])
        q, v = int(m.jnt_qposadr[joint]), m.nq + int(m.jnt_dofadr[joint])
        if kind >= 2:
            one = f"{name}.{'position' if kind == 2 else 'angle'}"
            rows[:, q] = m.qpos0[q] + solution[one][at]
            rows[:, v] = solution[f"der({one})"][at]
            continue
        if kind == 0:
            rows[:, q : q + 3] = solution[f"{name}.position"][at]
            rows[:, v : v + 3] = solution[f"der({name}.position)"][at]
            q, v = q + 3, v + 3
        rows[:, q : q + 4] = solution[f"{name}.orientation"][at]
        rows[:, v : v + 3] = solution[f"der({name}.orientation)"][at]
    return rows


def centres(m: Any, q: np.ndarray) -> np.ndarray:
    """Return the places of the mass centres of all bodies."""
    data, places = mujoco.MjData(m), []
    for row in q:
        data.qpos[:] = row
        mujoco.mj_kinematics(m, data)
        places.append(data.xipos.copy())
    return np.array(places)


@pytest.mark.slow
@pytest.mark.parametrize("fall", FALLS, ids=[f"{fall.package}-{fall.robot}" for fall in FALLS])
def test_bodies_fall_as_in_mujoco(fall: Fall) -> None:
    """Differences are those of contacts that give way and of the step, and grow at each impact; what lies still presses with its weight."""
    text = text_of(fall.robot, fall.package)
    floors = text.count(f"contact {fall.floor} with") if fall.floor else 0
    for k in range(floors):
        text = text.replace(f"contact {fall.floor} with", f"contact pressing_{k}: {fall.floor} with", 1)
    total = " + ".join(f"multiplier(pressing_{k})" for k in range(floors))
    if floors:
        text = text.replace("if contacts then", f"if contacts then\n  output Force carried = {total};", 1)
    theirs = hard(fall.robot, 3.0, 0.1, fall.said, fall.package, 1e-4)
    mine = moved_as_said(text, fall.values, stop="3 s", every="0.1 s", **fall.settings)
    rows = rows_of(mine, text, theirs.m, 0.1)
    apart = np.abs(centres(theirs.m, rows[:, : theirs.m.nq]) - centres(theirs.m, theirs.q)).max(axis=(1, 2))
    assert apart.max() < fall.way
    assert apart[-1] < fall.end
    assert np.ptp(theirs.q, axis=0).max() > 10 * fall.way
    if floors:
        weight = float(theirs.m.body_subtreemass[0]) * 9.81
        assert mine["carried"][-1] == pytest.approx(weight, rel=1e-3)
        assert theirs.pressure[-1] == pytest.approx(weight, rel=1e-2)
