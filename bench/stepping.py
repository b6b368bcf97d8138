"""Control steps of robots: ``model.env`` and ``model.batch`` beside ``mj_step`` and ``rollout`` of MuJoCo, at equal true error.

Call this by the Python of an environment with mujoco, dm_control and example-robot-data (bench/peers/README.md); what is not there is
left out. Contacts, ranges and dry friction are off in both programs.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct

from .machine import table, write
from .robots_sweep import MuJoCo, Ours, switch_off

MANY = 1024
STEPS = 20
"""Control steps of a batch that are timed at once."""
SPAN = 0.5
"""Seconds after which errors are read."""
FINE = 64
"""Steps of MuJoCo's reference in a control step."""
PUSH = 0.1


class Robot(Struct, frozen=True):
    file: str
    dt: float
    goals: tuple[float, float]
    """Microseconds of a control step: of one with what is read, and in a batch."""


ROBOTS = {
    "acrobot": Robot("dm_control/suite/acrobot.xml", 0.02, (2, 0.15)),
    "UR5": Robot("example-robot-data/robots/ur_description/urdf/ur5_robot.urdf", 0.002, (5, 0.8)),
    "humanoid": Robot("dm_control/suite/humanoid.xml", 0.005, (25, 6)),
}


def path_of(file: str) -> Path | None:
    """Find a file of an installed package by how its path ends."""
    for package in distributions():
        for one in package.files or ():
            if str(one).endswith(file):
                return Path(str(package.locate_file(one))).resolve()
    return None


class Beside:
    """A robot in both programs, in the same state, pushed alike."""

    def __init__(self, mujoco: Any, path: Path, robot: Robot) -> None:
        self.mujoco, self.dt = mujoco, robot.dt
        self.ours = Ours(path, "--meshes", "none")
        self.drives_are_joints = path.suffix == ".urdf"
        if self.drives_are_joints:
            text = re.sub(r"<(visual|collision)\b.*?</\1>", "", path.read_text(encoding="utf-8"), flags=re.S)
            m = mujoco.MjModel.from_xml_string(text)
        else:
            m = mujoco.MjModel.from_xml_path(str(path))
        switch_off(mujoco, m, "SENSOR")
        m.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        self.m, self.theirs = m, MuJoCo(mujoco, m, self.ours)
        self.theirs.choose(np.random.default_rng(7))
        self.d = self.theirs.d
        if self.drives_are_joints:
            self.d.qfrc_applied[:] = PUSH
        else:
            self.d.ctrl[:] = PUSH
        self.drives = self.d.qfrc_applied if self.drives_are_joints else self.d.ctrl
        spec = mujoco.mjtState
        self.state = np.empty(mujoco.mj_stateSize(m, spec.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(m, self.d, self.state, spec.mjSTATE_FULLPHYSICS)
        y, _ = self.theirs.given()
        nq, nv = self.ours.nq, self.ours.nv
        self.q, self.v = y[:nq], y[nq : nq + nv]

    def reset(self) -> None:
        self.mujoco.mj_setState(self.m, self.d, self.state, self.mujoco.mjtState.mjSTATE_FULLPHYSICS)

    def theirs_after(self, substeps: int) -> Any:
        """Return positions, in our order, after the span."""
        self.m.opt.timestep = self.dt / substeps
        self.reset()
        self.mujoco.mj_step(self.m, self.d, nstep=round(SPAN / self.dt) * substeps)
        return self.theirs.given()[0][: self.ours.nq]

    def ours_after(self, **how: Any) -> Any:
        with self.ours.model.env(self.dt, **how) as env:
            self.begin(env)
            for _ in range(round(SPAN / self.dt)):
                env.step()
            return env.q.copy()

    def begin(self, env: Any) -> None:
        env.reset(q=self.q, v=self.v)
        env.u[:] = PUSH

    # ---- microseconds of one control step, each a function of their number

    def step_ours(self, env: Any, read: bool) -> Callable[[int], float]:
        def seconds(n: int) -> float:
            self.begin(env)
            begun = time.process_time()
            for _ in range(n):
                env.u[:] = PUSH
                env.step()
                if read:
                    _ = env.q, env.v, env.time
            return time.process_time() - begun

        return seconds

    def step_theirs(self, substeps: int) -> Callable[[int], float]:
        mj_step, m, d, drives = self.mujoco.mj_step, self.m, self.d, self.drives

        def seconds(n: int) -> float:
            m.opt.timestep = self.dt / substeps
            self.reset()
            begun = time.process_time()
            for _ in range(n):
                drives[:] = PUSH
                mj_step(m, d, nstep=substeps)
                _ = d.qpos, d.qvel, d.time
            return time.process_time() - begun

        return seconds

    def many_ours(self, batch: Any) -> Callable[[int], float]:
        q, v = np.tile(self.q, (MANY, 1)), np.tile(self.v, (MANY, 1))

        def seconds(n: int) -> float:
            batch.reset(q=q, v=v)
            begun = time.process_time()
            for _ in range(n // MANY):
                batch.u[:] = PUSH
                batch.step()
                _ = batch.q, batch.v, batch.time
            return time.process_time() - begun

        return seconds

    def many_theirs(self, substeps: int) -> Callable[[int], float]:
        """All control steps in one call, in this thread."""
        from mujoco import rollout

        spec = self.mujoco.mjtState
        kind = int(spec.mjSTATE_QFRC_APPLIED if self.drives_are_joints else spec.mjSTATE_CTRL)
        states = np.tile(self.state, (MANY, 1))

        def seconds(n: int) -> float:
            self.m.opt.timestep = self.dt / substeps
            control = np.full((MANY, n // MANY * substeps, self.drives.size), PUSH)
            begun = time.process_time()
            rollout.rollout(self.m, self.d, states, control, control_spec=kind)
            return time.process_time() - begun

        return seconds


def least(contestants: dict[str, tuple[Callable[[int], float], int]], rounds: int) -> dict[str, float]:
    """Least microseconds of each for one of so many, in turn."""
    best = dict.fromkeys(contestants, float("inf"))
    for _ in range(rounds):
        for name, (seconds, n) in contestants.items():
            best[name] = min(best[name], seconds(n) / n * 1e6)
    return best


def row_of(mujoco: Any, name: str, robot: Robot, path: Path, rounds: int) -> list[str]:
    beside = Beside(mujoco, path, robot)
    exact = beside.ours_after(tolerance=1e-12)
    apart = np.abs(beside.theirs_after(FINE) - exact).max()
    error = np.abs(beside.ours_after(method="rk4") - exact).max()
    substeps = 1
    while (other := np.abs(beside.theirs_after(substeps) - exact).max()) > 1.1 * error and substeps < FINE:
        substeps += 1
    model, dt = beside.ours.model, robot.dt
    n = 1000 if name != "humanoid" else 200
    with (
        model.env(dt, method="rk4") as env,
        model.batch(MANY, dt, method="rk4", threads=1) as batch,
    ):
        found = least(
            {
                "one": (beside.step_ours(env, False), n),
                "read": (beside.step_ours(env, True), n),
                "mj_step": (beside.step_theirs(substeps), n),
                "many": (beside.many_ours(batch), MANY * STEPS),
                "rollout": (beside.many_theirs(substeps), MANY * (STEPS if name != "humanoid" else 2)),
            },
            rounds,
        )
    one, read, step, many, rollout = found.values()
    return [
        name,
        f"{1e3 * dt:g} ms",
        f"{error:.1e}",
        f"{other:.1e} ({substeps})",
        f"{apart:.1e}",
        f"{one:.2f}",
        f"{read:.2f}",
        f"{robot.goals[0]:g}",
        f"{step:.2f}",
        f"{read / step:.2f}",
        f"{many:.3f}",
        f"{robot.goals[1]:g}",
        f"{rollout:.3f}",
        f"{many / rollout:.3f}",
    ]


def main(quick: bool = False) -> None:
    rows: list[list[str]] = []
    try:
        import mujoco
    except ImportError:
        mujoco = None
    for name, robot in ROBOTS.items():
        path = path_of(robot.file)
        if mujoco is not None and path is not None:
            rows.append(row_of(mujoco, name, robot, path, 3 if quick else 9))
            print(*rows[-1], flush=True)
    words = (
        f'Microseconds of processor time of one control step with `method="rk4"`: one environment, alone and with its positions, velocities and time '
        f"read; of {MANY} in a batch on one thread, read too. Beside it `mj_step` with RK4, called and read from Python, and `mujoco.rollout`, "
        f"which takes all steps of {MANY} in one call. Errors: of positions after {SPAN:g} s, against mechc at a tolerance of 1e-12, which MuJoCo "
        f"with {FINE} steps in each control step approaches up to what `apart` says; MuJoCo takes so many steps in a control step, in brackets, as bring its error below that of mechc. "
        "Least of rounds in turn. Sensors of MuJoCo are off."
    )
    head = [
        "robot", "control step", "error", "of MuJoCo", "apart", "one", "with reads", "goal", "`mj_step`", "ratio",
        "in a batch", "goal", "`rollout`", "ratio",
    ]  # fmt: skip
    write("stepping", "Control steps of robots", [words, table(head, rows)])


if __name__ == "__main__":
    main()
