"""Write forward and inverse dynamics of a robot as C by CasADi: casadi_functions.py OUT.c, its numbers on standard input

The numbers are those of ``pinocchio_functions.cpp``. ``aba(q, v, tau)`` is Featherstone's articulated-body algorithm and
``rnea(q, v, a)`` the recursive Newton-Euler algorithm (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 7 and
5), in symbols that know which entries of a matrix are zero. Motions are (linear, angular), in the axes of each joint.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import casadi as ca
import numpy as np

gravity, *lines = ([float(x) for x in line.split()] for line in sys.stdin)
SX = ca.SX


def constant(of: np.ndarray) -> SX:
    return SX(ca.sparsify(ca.DM(of)))


def cross(a: SX) -> SX:
    rows = [[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]]
    return ca.sparsify(ca.vertcat(*(ca.horzcat(*row) for row in rows)))


def motion_cross(v: SX) -> SX:
    linear, angular = cross(v[:3]), cross(v[3:])
    return ca.vertcat(ca.horzcat(angular, linear), ca.horzcat(SX(3, 3), angular))


class Joint:
    def __init__(self, numbers: list[float], q: SX) -> None:
        """``q``: its coordinates; X takes motions of the parent to the joint, S velocities to motions."""
        self.parent, kind = int(numbers[0]), int(numbers[1])
        axis, turn, to = np.array(numbers[2:5]), np.array(numbers[5:14]).reshape(3, 3), numbers[14:17]
        mass, centre, about = numbers[17], np.array(numbers[18:21]), np.array(numbers[21:30]).reshape(3, 3)
        R, p = SX.eye(3), SX(3, 1)
        if kind == 2:
            x, y, z, w = (q[3 + k] for k in range(4))
            R = ca.vertcat(
                ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
                ca.horzcat(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
                ca.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
            )
            p, self.S = q[:3], SX.eye(6)
        elif kind == 1:
            p, self.S = constant(axis) * q, constant(np.concatenate([axis, np.zeros(3)]))
        else:
            K = constant(np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]]))
            R = SX.eye(3) + ca.sin(q) * K + (1 - ca.cos(q)) * (K @ K)
            self.S = constant(np.concatenate([np.zeros(3), axis]))
        A = constant(turn)
        R, p = ca.sparsify(A @ R), ca.sparsify(constant(np.array(to)) + A @ p)
        self.X = ca.vertcat(ca.horzcat(R.T, -R.T @ cross(ca.densify(p))), ca.horzcat(SX(3, 3), R.T))
        C = np.array([[0, -centre[2], centre[1]], [centre[2], 0, -centre[0]], [-centre[1], centre[0], 0]])
        self.inertia = constant(np.block([[mass * np.eye(3), -mass * C], [mass * C, about - mass * C @ C]]))
        self.nq, self.nv = (7, 6) if kind == 2 else (1, 1)


def robot() -> tuple[SX, SX, SX, list[Joint], list[slice]]:
    free = [int(line[1]) == 2 for line in lines]
    nq, nv = sum(7 if f else 1 for f in free), sum(6 if f else 1 for f in free)
    q, v, given = SX.sym("q", nq), SX.sym("v", nv), SX.sym("given", nv)
    joints, rows, iq, iv = [], [], 0, 0
    for line, f in zip(lines, free, strict=True):
        joints.append(Joint(line, q[iq : iq + (7 if f else 1)]))
        rows.append(slice(iv, iv + joints[-1].nv))
        iq, iv = iq + joints[-1].nq, iv + joints[-1].nv
    return q, v, given, joints, rows


def velocities(joints: list[Joint], rows: list[slice], v: SX) -> tuple[list[SX], list[SX], list[SX]]:
    """Velocities of all joints, what they add to accelerations, and the forces that they ask for."""
    moved, drifts, forces = [], [], []
    for joint, at in zip(joints, rows, strict=True):
        own = joint.S @ v[at]
        V = own + (joint.X @ moved[joint.parent - 1] if joint.parent else SX(6, 1))
        moved.append(V)
        drifts.append(motion_cross(V) @ own)
        forces.append(-motion_cross(V).T @ (joint.inertia @ V))
    return moved, drifts, forces


BASE = constant(np.array([-x for x in gravity] + [0.0] * 3))


def rnea() -> ca.Function:
    q, v, a, joints, rows = robot()
    _, drifts, forces = velocities(joints, rows, v)
    pushed, accelerations = [], []
    for joint, at, drift, force in zip(joints, rows, drifts, forces, strict=True):
        before = accelerations[joint.parent - 1] if joint.parent else BASE
        accelerations.append(joint.X @ before + joint.S @ a[at] + drift)
        pushed.append(joint.inertia @ accelerations[-1] + force)
    out: list[SX] = []
    for k in reversed(range(len(joints))):
        joint = joints[k]
        out.insert(0, joint.S.T @ pushed[k])
        if joint.parent:
            pushed[joint.parent - 1] += joint.X.T @ pushed[k]
    return ca.Function("rnea", [q, v, a], [ca.densify(ca.vertcat(*out))])


def aba() -> ca.Function:
    q, v, tau, joints, rows = robot()
    _, drifts, forces = velocities(joints, rows, v)
    inertias = [joint.inertia for joint in joints]
    U, D, left = ([SX()] * len(joints) for _ in range(3))
    for k in reversed(range(len(joints))):
        joint = joints[k]
        U[k] = inertias[k] @ joint.S
        D[k] = joint.S.T @ U[k]
        left[k] = tau[rows[k]] - joint.S.T @ forces[k]
        if joint.parent:
            assert joint.nv == 1, "only the first joint may be free"
            of = joint.parent - 1
            inertia = inertias[k] - (U[k] / D[k]) @ U[k].T
            force = forces[k] + inertia @ drifts[k] + U[k] * (left[k] / D[k])
            inertias[of] += joint.X.T @ inertia @ joint.X
            forces[of] += joint.X.T @ force
    accelerations, out = [], []
    for k, joint in enumerate(joints):
        before = joint.X @ (accelerations[joint.parent - 1] if joint.parent else BASE) + drifts[k]
        missing = left[k] - U[k].T @ before
        found = missing / D[k] if joint.nv == 1 else ca.solve(D[k], missing)
        accelerations.append(before + joint.S @ found)
        out.append(found)
    return ca.Function("aba", [q, v, tau], [ca.densify(ca.vertcat(*out))])


out = Path(sys.argv[1])
os.chdir(out.parent)
code = ca.CodeGenerator(out.name)
for function in (aba(), rnea()):
    code.add(function)
code.generate()
