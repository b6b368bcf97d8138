"""Print a robot as Pinocchio has it, as JSON: robot_numbers.py FILE fixed|floating

The file is in URDF, which Pinocchio reads, or in MJCF: then MuJoCo reads it, ``floating`` says nothing, and of actuators, tendons
and springs nothing is left. ``text``: the numbers that ``pinocchio_functions.cpp`` takes; ``joints``: their names, in the same order;
``link``: what the last one carries; ``armature``: inertia of rotors on each velocity, which the numbers do not hold.
"""

from __future__ import annotations

import json
import sys

import numpy as np
import pinocchio as pin

path, root = sys.argv[1:]


def from_urdf() -> tuple[pin.Model, str]:
    model = pin.buildModelFromUrdf(path, *([pin.JointModelFreeFlyer()] if root == "floating" else []))
    last = model.njoints - 1
    links = (f.name for f in model.frames if f.type == pin.FrameType.BODY and f.parentJoint == last)
    return model, next(links)


def from_mjcf() -> tuple[pin.Model, str]:
    """Joints of one body follow each other, at their anchors; what has no joint is part of what carries it."""
    import mujoco

    m = mujoco.MjModel.from_xml_path(path)
    free, slide, hinge = (
        int(getattr(mujoco.mjtJoint, f"mjJNT_{name}")) for name in ("FREE", "SLIDE", "HINGE")
    )
    model = pin.Model()
    model.gravity.linear = np.array(m.opt.gravity)
    carried = [(0, pin.SE3.Identity())]  # the joint of each body, and its place on that
    last = ""
    for body in range(1, m.nbody):
        at, place = carried[m.body_parentid[body]]
        place = place * pin.SE3(_turn(m.body_quat[body]), m.body_pos[body])
        for k in range(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body]):
            name, kind = m.joint(k).name, int(m.jnt_type[k])
            if kind == free:
                joint, anchor = pin.JointModelFreeFlyer(), np.zeros(3)
            elif kind in (hinge, slide):
                turns = kind == hinge
                made = pin.JointModelRevoluteUnaligned if turns else pin.JointModelPrismaticUnaligned
                joint, anchor = made(m.jnt_axis[k]), m.jnt_pos[k]
            else:
                raise SystemExit(f"{path}: the joint {name} is a ball")
            to = pin.SE3(np.eye(3), anchor)
            at = model.addJoint(at, joint, place * to, name)
            model.armature[model.idx_vs[at] : model.nv] = m.dof_armature[m.jnt_dofadr[k]]
            place, last = to.inverse(), m.body(body).name
        carried.append((at, place))
        turn = _turn(m.body_iquat[body])
        inertia = pin.Inertia(
            m.body_mass[body], m.body_ipos[body], turn @ np.diag(m.body_inertia[body]) @ turn.T
        )
        if at:
            model.appendBodyToJoint(at, inertia, place)
    return model, last


def _turn(quaternion: np.ndarray) -> np.ndarray:
    return pin.Quaternion(*quaternion).toRotationMatrix()


model, link = from_mjcf() if path.endswith(".xml") else from_urdf()


def kind_of(joint: pin.JointModel) -> tuple[int, list[float]]:
    name = joint.shortname().removeprefix("JointModel")
    if name == "FreeFlyer":
        return 2, [0, 0, 0]
    if "RUB" in name:
        raise SystemExit(f"{path}: a joint without ends, {name}, has two numbers")
    along = joint.extract().axis if "Unaligned" in name else np.eye(3)["XYZ".index(name[-1])]
    return int(name.startswith("P")), [float(x) for x in along]


lines = [" ".join(map(repr, model.gravity.linear.tolist()))]
for k in range(1, model.njoints):
    kind, axis = kind_of(model.joints[k])
    place, body = model.jointPlacements[k], model.inertias[k]
    numbers = [
        *axis,
        *place.rotation.ravel(),
        *place.translation,
        body.mass,
        *body.lever,
        *body.inertia.ravel(),
    ]
    lines.append(" ".join([str(model.parents[k]), str(kind), *(repr(float(x)) for x in numbers)]))
said = {"text": "\n".join(lines), "joints": list(model.names)[1:], "link": link}
print(json.dumps({**said, "armature": list(model.armature)}))
