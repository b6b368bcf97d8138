"""Robots of other packages, imported and compared: URDF with Pinocchio, MJCF with MuJoCo, at ten random states each.

Robots are sought in the packages that are installed beside pin and mujoco, so call this by the Python of an environment that has
them (``bench/peers/README.md``): ``python -m bench.robots_sweep [--floating] [--keep FILE] [WORD ...]``, where words pick files by
their paths, and what FILE holds already is not measured again. The page is ``bench/report/robots_sweep.md``.

Each file goes through ``mechc import``; the text must be what ``mechc fmt`` gives. Joints are found by the names at the head of
the text. Ranges, contacts and dry friction are off in both programs, as the quantities compared are smooth; dry friction is taken
out of the text, the rest is off there by itself. Errors are the largest difference over the largest value.

A joint of Pinocchio that mimics another is free there, and G, the derivative of its velocities by those of the model, puts it back:
M = G' M G and so on. The same G turns velocities of free bodies, which Pinocchio has in their own axes. The reference of MJCF with
equalities, which MuJoCo softens, is the exact motion by MuJoCo's own M, forces and constraint Jacobian J; J' v is a difference
quotient of sixth order along the motion.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import multiprocessing
import re
import resource
import signal
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import numpy as np

import mechc
from mechc.cli.main import run
from mechc.lang.diagnostics import CompileError
from mechc.lang.importing.xml import read_xml

from .machine import table, write

STATES = 10
FRAMES = 3
"""Links whose Jacobians, and joints whose regressors, are compared."""
LIMIT = 120
"""Seconds of processor time that a robot may take."""
URDF, MJCF = "urdf", "mjcf"


def files() -> Iterator[tuple[str, str, Path]]:
    """Yield the package, the format and the file of each robot; of whole files that are the same, the first."""
    seen: set[bytes] = set()
    for package, kind, path in _files():
        text = path.read_bytes()
        if text not in seen or b"file=" in text:
            seen.add(text)
            yield package, kind, path


def _files() -> Iterator[tuple[str, str, Path]]:
    for package in sorted(distributions(), key=lambda one: one.metadata["Name"].lower()):
        for file in sorted(package.files or (), key=str):
            path = Path(str(package.locate_file(file))).resolve()
            if file.suffix == ".urdf" and path.is_file():
                yield package.metadata["Name"], URDF, path
            elif file.suffix == ".xml" and path.is_file():
                head = re.sub(rb"<!--.*?-->|<\?.*?\?>", b"", path.read_bytes(), flags=re.S).lstrip()
                if head.startswith(b"<mujoco"):
                    yield package.metadata["Name"], MJCF, path


# ---------------------------------------------------------------- the model


class Ours:
    """A robot as it is imported, with its functions; names of the file lead to states."""

    def __init__(self, path: Path, *words: str) -> None:
        with tempfile.TemporaryDirectory() as folder:
            there = Path(folder) / "robot.mech"
            code, said = _command("import", str(path), "-o", str(there), *words)
            if code:
                raise Refused(" ".join(said.split()))
            self.left_out = re.findall(r"^  left out: (.*)$", said, re.M)
            self.text = there.read_text(encoding="utf-8")
            self.formatted = _command("fmt", "--check", str(there))[0] == 0
        self.changed: dict[str, str] = dict(re.findall(r"^//   (\w+ .*): (\w+)$", self.text, re.M))
        begun = time.process_time()
        self.model = mechc.loads(_without_friction(self.text))
        self.f = self.model.functions
        self.seconds = time.process_time() - begun
        names = [name for name, _ in self.f.states]
        self.states = {name: k for k, name in enumerate(names)}
        self.nv = len(self.f.offer("accelerations").rows)
        if self.nv == 0:
            raise Refused("no joint moves a mass")
        self.nq = next(k for k, name in enumerate(names) if name.startswith("der("))
        self.velocities = {name: k for k, name in enumerate(names[self.nq : self.nq + self.nv])}
        self.inputs = {name: k for k, (name, _) in enumerate(self.f.inputs)}

    def name(self, kind: str, given: str) -> str:
        return self.changed.get(f"{kind} {given}", given)

    def places(self, coordinate: str) -> tuple[list[int], list[int]]:
        """Return where a coordinate stands among the states, and its rate among the velocities."""
        q = [k for name, k in self.states.items() if re.fullmatch(re.escape(coordinate) + r"(\[\d\])?", name)]
        v = [
            k
            for name, k in self.velocities.items()
            if re.fullmatch(rf"der\({re.escape(coordinate)}(\[\d\])?\)(\[\d\])?", name)
        ]
        assert q and v, (
            f"no coordinate {coordinate} among {list(self.states)[:8]}, {list(self.velocities)[:8]}"
        )
        return q, v


def _command(*words: str) -> tuple[int, str]:
    """Call ``mechc``; returns its exit code and what it says."""
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
        code = run(words)
    return code, said.getvalue()


class Refused(Exception):
    """In which words a robot was refused."""


def _without_friction(text: str) -> str:
    """Return the text of a model without dry friction, as statements and as settings of joints."""
    text = re.sub(r"^  friction (?!=)[^;]*;\n", "", text, flags=re.M)
    return re.sub(r",\s*friction = [^,()]*(?=[,)])", "", text)


def _turn(random: np.random.Generator) -> Any:
    turn = random.normal(size=4)
    return turn / np.linalg.norm(turn)


def _matrix(q: Any) -> Any:
    """Return the matrix of a quaternion, its real part first."""
    w, x, y, z = q
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


class Errors(dict[str, float]):
    """The largest error of each quantity."""

    def note(self, what: str, ours: Any, theirs: Any, size: float | None = None) -> None:
        ours, theirs = np.asarray(ours), np.asarray(theirs)
        size = np.abs(theirs).max(initial=0.0) if size is None else size
        apart = np.abs(ours - theirs).max(initial=0.0)
        self[what] = max(self.get(what, 0.0), float(apart / size if size else apart))


# ---------------------------------------------------------------- URDF


def compare_urdf(path: Path, floating: bool) -> dict[str, Any]:
    """Compare with Pinocchio."""
    import pinocchio as pin

    root = [pin.JointModelFreeFlyer()] if floating else []
    try:
        pin_model = pin.buildModelFromUrdf(str(path), *root)
    except ValueError as error:
        return {"skipped": f"Pinocchio does not load it: {' '.join(str(error).split())[-90:]}"}
    if pin_model.nv == 0:
        return {"skipped": "nothing moves"}
    ours = Ours(path, "--meshes", "none", *(["--floating"] if floating else []))
    theirs = _Pinocchio(pin, pin_model, path, ours)
    random, errors = np.random.default_rng(7), Errors()
    f = ours.f
    links = theirs.links()
    frames = [(link, frame_of(f, ours.name("link", link))) for link in links]
    carried = theirs.carried()
    regressor = (
        f.regressor([_name_of_frame(f, ours.name("link", link)) for _, link in carried]) if carried else None
    )
    heights = []
    for _ in range(STATES):
        y, u, a = f.start.copy(), np.zeros(len(f.inputs)), random.normal(size=ours.nv)
        q, v, G, drift = theirs.state(random, y)
        load = theirs.loads(random, u)
        data = pin_model.createData()
        M = pin.crba(pin_model, data, q)
        M = np.triu(M) + np.triu(M, 1).T - np.diag(theirs.armature)
        D = np.diag(theirs.damping)
        mass = G.T @ M @ G
        bias = G.T @ (pin.nonLinearEffects(pin_model, data, q, v) + D @ v + M @ drift)
        if np.linalg.matrix_rank(mass) < len(mass):
            return {"skipped": "the mass matrix of Pinocchio is singular"}
        errors.note("mass matrix", f.mass_matrix(y), mass)
        errors.note("bias", f.bias(y), bias)
        wanted = G @ a + drift
        torques = G.T @ (pin.rnea(pin_model, data, q, v, wanted) - theirs.armature * wanted + D @ v)
        errors.note("inverse dynamics", f.inverse_dynamics(y, a), torques)
        exact = np.linalg.solve(mass, load - bias)
        found = f.accelerations(y, 0.0, u)
        errors.note("accelerations", found, exact)
        errors.note("balance of forces", mass @ found + bias, load, (np.abs(mass) @ np.abs(exact)).max())
        if G.shape[0] == G.shape[1] and not theirs.armature.any():
            push = np.linalg.solve(G.T, load) - D @ v
            aba = np.linalg.solve(G, pin.aba(pin_model, data, q, v, push) - drift)
            errors.note("ABA", found, aba)
            errors.note("ABA and Cholesky of Pinocchio", exact, aba)
        errors["condition"] = max(errors.get("condition", 0), float(np.linalg.cond(mass)))
        errors.note("kinetic energy", f.kinetic_energy(y), pin.computeKineticEnergy(pin_model, data, q, v))
        heights.append((float(f.potential_energy(y)), pin.computePotentialEnergy(pin_model, data, q)))
        pin.forwardKinematics(pin_model, data, q, v, 0 * v)
        pin.computeJointJacobians(pin_model, data, q)
        pin.updateFramePlacements(pin_model, data)
        for link, frame in frames:
            there = pin_model.getFrameId(link, pin.FrameType.BODY)
            J = pin.getFrameJacobian(pin_model, data, there, pin.LOCAL_WORLD_ALIGNED)
            errors.note("place", frame.position(y), data.oMf[there].translation)
            errors.note("rotation", frame.rotation(y), data.oMf[there].rotation)
            errors.note("Jacobian", frame.jacobian(y), J @ G)
        pin.computeCentroidalMomentum(pin_model, data, q, v)
        pin.computeCentroidalMap(pin_model, data, q)
        hg, Ag = np.asarray(data.hg), np.asarray(data.Ag)
        arm = np.array(data.com[0])
        centre = f.centroid.position(y)
        errors.note("momenta", _about_origin(f.centroid.momentum(y), centre), _about_origin(hg, arm))
        errors.note("momenta", _about_origin(f.centroid.matrix(y), centre), _about_origin(Ag, arm) @ G)
        if regressor is not None:
            Y = pin.computeJointTorqueRegressor(pin_model, data, q, v, wanted)
            order = [0, 1, 2, 3, 4, 6, 9, 5, 7, 8]
            columns = [10 * (joint - 1) + k for joint, _ in carried for k in order]
            errors.note("regressor", regressor(y, a), (G.T @ Y)[:, columns])
    ups = np.array(heights)
    ups -= ups[0]
    errors.note("potential energy", ups[:, 0], ups[:, 1])
    return _result(ours, errors, pin_model.nv)


def _about_origin(momenta: Any, centre: Any) -> Any:
    """Return momenta, the angular one about the origin: programs differ in whether what stands still has a mass centre."""
    linear, angular = momenta[:3], momenta[3:]
    return np.concatenate([linear, angular + np.cross(centre, linear.T).T])


def _name_of_frame(f: Any, link: str) -> str:
    from mechc.compiler.frame_functions import is_frame_or_point

    return next(name for name in (f"{link}.a", link) if is_frame_or_point(f._model.compilation, name))


def frame_of(f: Any, link: str) -> Any:
    return f.frame(_name_of_frame(f, link))


class _Pinocchio:
    """A model of Pinocchio beside ours; ``state`` fills both."""

    def __init__(self, pin: Any, model: Any, path: Path, ours: Ours) -> None:
        self.pin, self.m, self.ours = pin, model, ours
        robot = read_xml(path.read_text(encoding="utf-8"))
        self.joints = {one.get("name"): one for one in robot.all("joint")}
        self.armature = np.array(model.armature)
        held = (re.match(r"the freedom of '(.*?)': .* stays at (\S+) ", line) for line in ours.left_out)
        self.held = {one[1]: float(one[2]) for one in held if one is not None}
        """Joints that move nothing with mass: where they stay."""
        self.damping = np.zeros(model.nv)
        for k in range(1, model.njoints):
            dynamics = self.element(k, "dynamics")
            if dynamics is not None:
                at = model.joints[k].idx_v
                self.damping[at : at + model.joints[k].nv] = float(dynamics.get("damping", 0))

    def element(self, joint: int, tag: str) -> dict[str, str] | None:
        """Return the attributes of what stands in the element of a joint."""
        found = self.joints.get(self.m.names[joint])
        inner = None if found is None else found.one(tag)
        return None if inner is None else inner.attributes

    def leads(self, joint: int) -> tuple[int, float, float]:
        """Return what a joint follows in the end, with factor and offset; itself where it follows none."""
        mimic = self.element(joint, "mimic")
        if mimic is None or not self.m.existJointName(mimic["joint"]):
            return joint, 1.0, 0.0
        leader, factor, offset = self.leads(self.m.getJointId(mimic["joint"]))
        own = float(mimic.get("multiplier", 1))
        return leader, own * factor, own * offset + float(mimic.get("offset", 0))

    def coordinate(self, joint: int) -> str:
        given = self.m.names[joint]
        name = self.ours.name("joint", given)
        kind = self.m.joints[joint].shortname()
        if "FreeFlyer" in kind or "Planar" in kind:
            return name
        return f"{name}.position" if "ModelP" in kind else f"{name}.angle"

    def state(self, random: np.random.Generator, y: Any) -> tuple[Any, Any, Any, Any]:
        """Choose a state; returns q, v, G and G' v of Pinocchio."""
        nv, nq_ours = self.ours.nv, self.ours.nq
        q, v = self.pin.neutral(self.m), np.zeros(self.m.nv)
        G, drift = np.zeros((self.m.nv, nv)), np.zeros(self.m.nv)
        chosen: dict[int, tuple[float, float, int]] = {}
        order = sorted(range(1, self.m.njoints), key=lambda k: self.leads(k)[0] != k)
        for k in order:
            joint, kind = self.m.joints[k], self.m.joints[k].shortname()
            leader, factor, offset = self.leads(k)
            if self.m.names[k] in self.held:
                start = self.held[self.m.names[k]]
                q[joint.idx_q : joint.idx_q + joint.nq] = (
                    (np.cos(start), np.sin(start)) if joint.nq == 2 else start
                )
                continue
            if "FreeFlyer" in kind:
                place, at = self.ours.places(f"{self.coordinate(k)}.position")
                turned, spins = self.ours.places(f"{self.coordinate(k)}.orientation")
                y[place], y[turned] = random.normal(size=3), _turn(random)
                y[[nq_ours + c for c in [*at, *spins]]] = random.normal(size=6)
                R, w, p = _matrix(y[turned]), y[[nq_ours + c for c in spins]], y[[nq_ours + c for c in at]]
                rows = range(joint.idx_v, joint.idx_v + 6)
                q[joint.idx_q : joint.idx_q + 7] = [*y[place], *y[turned][1:], y[turned][0]]
                G[np.ix_(rows[:3], at)], G[np.ix_(rows[3:], spins)] = R.T, np.eye(3)
                v[rows] = [*(R.T @ p), *w]
                drift[rows[:3]] = -np.cross(w, R.T @ p)
                continue
            if "Planar" in kind:
                x, z, angle = (
                    self.ours.places(f"{self.coordinate(k)}.{name}") for name in ("x", "y", "angle")
                )
                y[[x[0][0], z[0][0], angle[0][0]]] = random.uniform(-1, 1, size=3)
                columns = [x[1][0], z[1][0], angle[1][0]]
                y[[nq_ours + c for c in columns]] = random.uniform(-1, 1, size=3)
                a, rate = y[angle[0][0]], y[[nq_ours + c for c in columns]]
                R = np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])
                rows = range(joint.idx_v, joint.idx_v + 3)
                q[joint.idx_q : joint.idx_q + 4] = [y[x[0][0]], y[z[0][0]], np.cos(a), np.sin(a)]
                G[np.ix_(rows[:2], columns[:2])], G[rows[2], columns[2]] = R, 1
                v[rows] = [*(R @ rate[:2]), rate[2]]
                drift[rows[:2]] = rate[2] * np.array([v[rows[1]], -v[rows[0]]])
                continue
            if leader == k:
                place, at = self.ours.places(self.coordinate(k))
                y[place[0]], y[nq_ours + at[0]] = random.uniform(-1, 1, size=2)
                chosen[k] = float(y[place[0]]), float(y[nq_ours + at[0]]), at[0]
            value, speed, column = chosen[leader]
            value, speed = factor * value + offset, factor * speed
            if joint.nq == 2:
                q[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
            else:
                q[joint.idx_q] = value
            v[joint.idx_v], G[joint.idx_v, column] = speed, factor
        return q, v, G, drift

    def loads(self, random: np.random.Generator, u: Any) -> Any:
        """Choose inputs; returns the loads on our velocities."""
        load = np.zeros(self.ours.nv)
        for k in range(1, self.m.njoints):
            kind = self.m.joints[k].shortname()
            if "FreeFlyer" in kind or "Planar" in kind or self.m.names[k] in self.held:
                continue
            leader, factor, _ = self.leads(k)
            drive = "force" if "ModelP" in kind else "torque"
            name = self.ours.name("joint", self.m.names[k])
            there = self.ours.inputs[self.ours.name(drive, f"{drive}_{name}")]
            u[there] = random.normal()
            load[self.ours.places(self.coordinate(leader))[1][0]] += factor * u[there]
        return load

    def links(self) -> list[str]:
        """Return some links, among them the last one."""
        body = self.pin.FrameType.BODY
        found = [frame.name for frame in self.m.frames if frame.type == body and frame.parentJoint]
        return [found[k] for k in sorted({0, len(found) // 2, len(found) - 1})][:FRAMES]

    def carried(self) -> list[tuple[int, str]]:
        """Return some joints of one freedom with the links that they carry."""
        found = []
        for k in range(1, self.m.njoints):
            child = self.element(k, "child")
            if child is not None and self.m.joints[k].nv == 1:
                found.append((k, child["link"]))
        return [found[k] for k in sorted({0, len(found) // 2, len(found) - 1})][:FRAMES] if found else []


# ---------------------------------------------------------------- MJCF


def compare_mjcf(path: Path) -> dict[str, Any]:
    """Compare with MuJoCo."""
    import mujoco

    warned: list[str] = []
    mujoco.set_mju_user_warning(warned.append)
    try:
        m = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        return {"skipped": f"MuJoCo does not compile it: {' '.join(str(error).split())[:120]}"}
    finally:
        mujoco.set_mju_user_warning(None)
    if m.nv == 0:
        return {"skipped": "nothing moves"}
    ours = Ours(path, "--meshes", "none")
    switch_off(mujoco, m)
    less = _take_out(mujoco, m, ours.left_out)
    theirs = MuJoCo(mujoco, m, ours)
    random, errors = np.random.default_rng(7), Errors()
    f = ours.f
    for _ in range(STATES):
        theirs.choose(random)
        y, u = theirs.given()
        mass = np.zeros((m.nv, m.nv))
        mujoco.mj_fullM(m, theirs.d, mass)
        order = theirs.order
        errors.note("mass matrix", f.mass_matrix(y), mass[np.ix_(order, order)])
        force = mass @ theirs.d.qacc_smooth
        errors.note(
            "bias", f.bias(y, 0.0, u), -force[order], np.abs(theirs.d.qfrc_bias).max() + np.abs(force).max()
        )
        exact = theirs.accelerations(mass, force)
        found = np.empty(m.nv)
        found[order] = f.accelerations(y, 0.0, u)
        errors.note("accelerations", found, exact)
        errors["condition"] = max(errors.get("condition", 0), float(np.linalg.cond(mass)))
        if m.na:
            activations = f.rates(y, 0.0, u)[theirs.activations]
            errors.note("activations", activations, theirs.d.act_dot)
    return {**_result(ours, errors, m.nv), "less": less, "equalities": int(m.neq), "actuators": int(m.nu)}


def switch_off(mujoco: Any, m: Any, *more: str) -> None:
    """Let nothing touch, end or rub in a model of MuJoCo."""
    for name in ("CONTACT", "LIMIT", "FRICTIONLOSS", *more):
        m.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}"))


def _take_out(mujoco: Any, m: Any, left_out: Sequence[str]) -> list[str]:
    """Take out of MuJoCo's model what the importer says that it left out; returns that."""
    less = []
    for told in left_out:
        line = re.sub(r" \(lines? [\d, ]+\)$", "", told)
        if found := re.match(r"the actuator '(.*?)': (.*)", line):
            k = _index(mujoco, m, "actuator", found[1])
            m.actuator_gaintype[k], m.actuator_biastype[k] = 0, 0
            m.actuator_gainprm[k], m.actuator_biasprm[k] = 0, 0
            less.append(f"actuator: {found[2]}")
        elif found := re.match(r"the tendon '(.*?)'", line):
            k = _index(mujoco, m, "tendon", found[1])
            m.tendon_stiffness[k] = m.tendon_damping[k] = m.tendon_armature[k] = 0
            less.append("tendon round a shape")
        elif found := re.match(r"that the activation of '(.*?)' acts a step early", line):
            m.actuator_actearly[_index(mujoco, m, "actuator", found[1])] = False
            less.append("activation a step early")
        elif line.startswith("forces of the fluid on ellipsoids"):
            m.geom_fluid[:] = 0
            less.append("fluid on ellipsoids")
        elif found := re.match(r"friction, stiffness and range of '(.*?)'", line):
            k = _index(mujoco, m, "joint", found[1])
            less += ["stiffness of a ball"] if m.jnt_stiffness[k] else []
            m.jnt_stiffness[k] = 0
        elif found := re.match(r"the largest force of actuators on '(.*?)'", line):
            m.jnt_actfrclimited[_index(mujoco, m, "joint", found[1])] = 0
            less.append("largest force of actuators on a joint")
        elif found := re.match(r"(\w+) of the tendon '(.*?)'", line):
            getattr(m, f"tendon_{found[1]}")[_index(mujoco, m, "tendon", found[2])] = 0
            less.append(f"{found[1]} of a tendon")
        elif found := re.match(r"(stiffnesspoly|dampingpoly|springyield) of '(.*?)'", line):
            k = _index(mujoco, m, "joint", found[2])
            array, at = ("dof", m.jnt_dofadr[k]) if found[1] == "dampingpoly" else ("jnt", k)
            getattr(m, f"{array}_{found[1]}")[at] = 0
            less.append(f"{found[1]} of a joint")
        elif found := re.match(r"the equality '(.*?)' of the kind (\w+)", line):
            less.append(f"equality of the kind {found[2]}")
    return sorted(set(less))


def _index(mujoco: Any, m: Any, kind: str, name: str) -> int:
    """Return the number of what has a name, or was called by its number; names that changed differ in signs alone."""
    count = {"actuator": m.nu, "tendon": m.ntendon, "joint": m.njnt}[kind]
    named = [
        mujoco.mj_id2name(m, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), k) or "" for k in range(count)
    ]
    plain = [
        re.sub(r"\W+", "_", one or f"{kind}_{k}", flags=re.ASCII).strip("_") for k, one in enumerate(named)
    ]
    if name in named:
        return named.index(name)
    return plain.index(name) if name in plain else plain.index(name.removesuffix(f"_{kind}"))


class MuJoCo:
    """A model of MuJoCo beside ours."""

    def __init__(self, mujoco: Any, m: Any, ours: Ours) -> None:
        self.mj, self.m, self.ours, self.d = mujoco, m, ours, mujoco.MjData(m)
        self.order = np.full(m.nv, -1)
        """By our velocities: those of MuJoCo."""
        self.q: list[tuple[list[int], list[int], float]] = []
        """States, numbers in qpos, and the reference that MuJoCo adds."""
        for k in range(m.njnt):
            given = self.named("joint", k)
            name, kind = ours.name("joint", given), int(m.jnt_type[k])
            a, d = int(m.jnt_qposadr[k]), int(m.jnt_dofadr[k])
            parts = {0: ("position", "orientation"), 1: ("orientation",), 2: ("position",), 3: ("angle",)}[
                kind
            ]
            for part in parts:
                y, v = ours.places(f"{name}.{part}")
                of = float(m.qpos0[a]) if kind > 1 else 0.0
                self.q.append((y, list(range(a, a + len(y))), of))
                self.order[v] = range(d, d + len(v))
                a, d = a + len(y), d + len(v)
        assert sorted(self.order) == list(range(m.nv)), "not each velocity has a place"
        self.activations: list[int] = []
        for k in range(m.nu):
            if int(m.actuator_actnum[k]):
                name = f"{ours.name('actuator', self.named('actuator', k))}_activation"
                self.activations.append(ours.states[ours.name("state", name)])

    def named(self, kind: str, k: int) -> str:
        given = self.mj.mj_id2name(self.m, getattr(self.mj.mjtObj, f"mjOBJ_{kind.upper()}"), k)
        return str(given or f"{kind}_{k}")

    def choose(self, random: np.random.Generator) -> None:
        """Choose a state on the equalities, with velocities along them, and controls."""
        m, d, mj = self.m, self.d, self.mj
        d.qpos[:] = m.qpos0
        away = random.uniform(-1, 1, size=m.nv) * (0.2 if m.neq else 1)
        mj.mj_integratePos(m, d.qpos, away, 1.0)
        d.qvel[:], d.act[:] = random.uniform(-1, 1, size=m.nv), random.uniform(0, 1, size=m.na)
        d.ctrl[:] = random.uniform(-1, 1, size=m.nu)
        for _ in range(60):
            mj.mj_forward(m, d)
            if d.nefc == 0:
                return
            J = self.rows()
            if np.abs(d.efc_pos).max() < 1e-14:
                break
            mj.mj_integratePos(m, d.qpos, -np.linalg.lstsq(J, np.array(d.efc_pos), rcond=1e-9)[0], 1.0)
        if np.abs(d.efc_pos).max() > 1e-10:
            raise Refused(f"no state holds its equalities: {np.abs(d.efc_pos).max():.1e} is left")
        d.qvel[:] -= np.linalg.lstsq(J, J @ d.qvel, rcond=1e-9)[0]
        mj.mj_forward(m, d)

    def rows(self) -> Any:
        """Return the Jacobian of the equalities."""
        m, d = self.m, self.d
        if not self.mj.mj_isSparse(m):
            return np.array(d.efc_J).reshape(d.nefc, m.nv)
        J = np.zeros((d.nefc, m.nv))
        for i in range(d.nefc):
            part = slice(d.efc_J_rowadr[i], d.efc_J_rowadr[i] + d.efc_J_rownnz[i])
            J[i, d.efc_J_colind[part]] = np.array(d.efc_J).ravel()[part]
        return J

    def accelerations(self, mass: Any, force: Any) -> Any:
        m, d, mj = self.m, self.d, self.mj
        free = np.array(d.qacc_smooth)
        if d.nefc == 0:
            return free
        J, q, v = self.rows(), np.array(d.qpos), np.array(d.qvel)
        step, rates = 2e-3, np.zeros(d.nefc)
        for k, factor in ((1, 3 / 4), (2, -3 / 20), (3, 1 / 60)):
            for sign in (1, -1):
                d.qpos[:] = q
                mj.mj_integratePos(m, d.qpos, v, sign * k * step)
                mj.mj_forward(m, d)
                rates += sign * factor * (self.rows() @ v) / step
        d.qpos[:] = q
        mj.mj_forward(m, d)
        inverse = np.linalg.solve(mass, J.T)
        forces = np.linalg.lstsq(J @ inverse, J @ free + rates, rcond=1e-10)[0]
        return free - inverse @ forces

    def given(self) -> tuple[Any, Any]:
        """Return our state and inputs."""
        ours, d = self.ours, self.d
        y, u = ours.f.start.copy(), np.zeros(len(ours.f.inputs))
        for there, here, of in self.q:
            y[there] = d.qpos[here] - of
        y[ours.nq : ours.nq + ours.nv] = d.qvel[self.order]
        y[self.activations] = d.act
        for k in range(self.m.nu):
            name = f"{ours.name('actuator', self.named('actuator', k))}_control"
            entry = ours.inputs.get(ours.name("input", name))
            if entry is not None:
                u[entry] = d.ctrl[k]
        return y, u


# ---------------------------------------------------------------- all of them


def _result(ours: Ours, errors: Errors, freedoms: int) -> dict[str, Any]:
    return {
        "freedoms": freedoms,
        "states": len(ours.states),
        "formatted": ours.formatted,
        "seconds": round(ours.seconds, 2),
        "left out": ours.left_out,
        "errors": {name: float(f"{value:.2g}") for name, value in errors.items()},
    }


def _measured(work: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Measure in a process of its own, which may take long or end in any way."""
    receive, send = multiprocessing.Pipe(duplex=False)

    def call() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT))
        try:
            send.send(work())
        except Refused as refused:
            send.send({"refused": str(refused)})
        except CompileError as error:
            send.send({"refused": " ".join(str(error).split())})
        except Exception as error:  # of peers and of ours: it goes into the table
            send.send({"failed": f"{type(error).__name__}: {' '.join(str(error).split())}"})

    process = multiprocessing.get_context("fork").Process(target=call)
    process.start()
    send.close()
    try:
        found: dict[str, Any] = receive.recv()
        process.join()
    except EOFError:
        process.join()
        ended = process.exitcode == -signal.SIGXCPU or process.exitcode == -signal.SIGKILL
        found = {
            "failed": f"it takes more than {LIMIT} s" if ended else f"the process ended: {process.exitcode}"
        }
    return found


def sweep(words: Sequence[str], keep: Path | None, floating: bool) -> dict[str, dict[str, Any]]:
    """Measure all robots whose paths hold one of the words; those that ``keep`` holds are taken from there."""
    known = json.loads(keep.read_text()) if keep is not None and keep.is_file() else {}
    for package, kind, path in sorted(files(), key=lambda one: one[2].stat().st_size):
        place = "/".join(path.parts[-4:])
        name = f"{package}: {place}" + (" floating" if floating and kind == URDF else "")
        if (words and not any(word in str(path) for word in words)) or name in known:
            continue
        if floating and kind == MJCF:
            continue
        begun = time.monotonic()
        work = partial(compare_urdf, path, floating) if kind == URDF else partial(compare_mjcf, path)
        found = _measured(work)
        known[name] = {"kind": kind, **found}
        if keep is not None:
            keep.write_text(json.dumps(known, indent=1))
        print(f"{name}\t{time.monotonic() - begun:.1f} s\t{_short(known[name])}", flush=True)
    return known


def _short(found: dict[str, Any]) -> str:
    for what in ("skipped", "refused", "failed"):
        if what in found:
            return f"{what}: {found[what][:300]}"
    shown = ", ".join(f"{name} {value:.0e}" for name, value in found["errors"].items())
    return f"{found['freedoms']} freedoms; {shown}; {'' if found['formatted'] else 'not as fmt; '}{found.get('less', '')}"


QUANTITIES = {
    URDF: (
        "mass matrix",
        "bias",
        "inverse dynamics",
        "accelerations",
        "Jacobian",
        "momenta",
        "regressor",
        "kinetic energy",
        "potential energy",
    ),
    MJCF: ("mass matrix", "bias", "accelerations", "activations"),
}


def report(known: dict[str, dict[str, Any]], kind: str) -> list[str]:
    """Return what is said of the robots of a format: how many, the worst errors, each robot, what is none."""
    of = {name: one for name, one in known.items() if one["kind"] == kind}
    compared = {name: one for name, one in of.items() if "errors" in one}
    others = {name: one for name, one in of.items() if "errors" not in one}
    worst = [
        (q, max(((one["errors"].get(q, 0.0), name) for name, one in compared.items()), default=(0.0, "")))
        for q in QUANTITIES[kind]
    ]
    rows = []
    for name, one in compared.items():
        cells = [f"{one['errors'][q]:.0e}" if q in one["errors"] else "" for q in QUANTITIES[kind]]
        rows.append([name, str(one["freedoms"]), *cells, "; ".join(one.get("less", []))])
    unlike = [name for name, one in compared.items() if not one["formatted"]]
    words = [
        (next(w for w in ("skipped", "refused", "failed") if w in one), name, one)
        for name, one in others.items()
    ]
    parts = [
        f"{len(of)} files in {kind.upper()}; {len(compared)} compared, the text of {len(compared) - len(unlike)} as `mechc fmt` "
        f"lays it out. The largest errors:",
        table(["quantity", "error", "robot"], [[q, f"{value:.1e}", name] for q, (value, name) in worst]),
    ]
    if rows:
        parts.append(table(["robot", "freedoms", *QUANTITIES[kind], "without"], rows))
    if words:
        parts.append(
            table(["file", "", "why"], [[name, what, one[what][:200]] for what, name, one in sorted(words)])
        )
    return parts


def main() -> None:
    reader = argparse.ArgumentParser(
        prog="python -m bench.robots_sweep", description="Compare imported robots."
    )
    reader.add_argument("words", nargs="*", help="take the files whose paths hold one of them")
    reader.add_argument("--floating", action="store_true", help="let the roots of URDFs move freely")
    reader.add_argument("--keep", type=Path, help="a file of JSON: what it holds is not measured again")
    given = reader.parse_args()
    known = sweep(given.words, given.keep, given.floating)
    write(
        "robots_sweep",
        "Robots of other packages",
        [part for kind in (URDF, MJCF) for part in report(known, kind)],
    )


if __name__ == "__main__":
    main()
