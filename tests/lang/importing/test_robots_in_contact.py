"""Robots of dm_control that touch the ground, walls and each other, in steps, beside MuJoCo with contacts that hardly give way.

MuJoCo's contacts are springs with dampers: with a time constant of 1 ms and eight times the critical damping bodies do not rebound,
as ours do not. Both programs leave out the same shapes; the bodies of one robot pass through each other.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.lang.diagnostics import Reporter
from mechc.lang.importing import Wishes, imported
from mechc.runtime.outcome import Outcome

mujoco = pytest.importorskip("mujoco")
HOME = importlib.util.find_spec("dm_control")
needs_dm_control = pytest.mark.skipif(HOME is None, reason="needs dm_control")
LEFT_OUT = ("mjGEOM_HFIELD", "mjGEOM_ELLIPSOID", "mjGEOM_CYLINDER")


def path_of(robot: str) -> Path:
    assert HOME is not None and HOME.origin is not None
    return Path(HOME.origin).parent / "suite" / f"{robot}.xml"


def hard(robot: str, stop: float, every: float) -> np.ndarray:
    """Coordinates at each multiple of ``every`` up to ``stop``, as MuJoCo steps them."""
    m = mujoco.MjModel.from_xml_path(str(path_of(robot)))
    m.opt.timestep, m.opt.tolerance, m.opt.iterations = 5e-5, 1e-12, 200
    m.opt.cone, m.opt.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 100
    for law in ("geom", "jnt", "eq"):
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
        for _ in range(round(stop / every)):
            for _ in range(round(every / m.opt.timestep)):
                mujoco.mj_step(m, data)
            rows.append(data.qpos - m.qpos0)
    finally:
        mujoco.set_mjcb_contactfilter(None)
    return np.array(rows)


def stepped(robot: str, step: str, stop: float, every: float) -> mechc.Solution:
    path = path_of(robot)
    text = imported(path.read_text(), Wishes(path, path.parent), Reporter()).text
    switches = {"contacts": "true", "stops": "true"}
    solution = mechc.loads(text).simulate(
        set=switches, method="moreau", step=step, stop=f"{stop} s", every=f"{every} s", estimate_error=False
    )
    assert solution.outcome is Outcome.COMPLETED, solution.message
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
