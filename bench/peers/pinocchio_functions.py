"""Pinocchio's functions in Python on the arm of ``bench.systems.SPATIAL``: prints microseconds a call, one name a line."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin

n = int(sys.argv[1])
model = pin.Model()
model.gravity.linear = np.array([0, -9.81, 0])
parent = 0
for i in range(n):
    joint = getattr(pin, f"JointModelR{'XYZ'[i % 3]}")()
    parent = model.addJoint(parent, joint, pin.SE3(np.eye(3), np.array([0, -1.0 if i else 0, 0])), f"j{i}")
    body = pin.Inertia(1.0, np.array([0, -0.5, 0]), np.diag([0.1, 0.01, 0.1]))
    model.appendBodyToJoint(parent, body, pin.SE3.Identity())
data = model.createData()
random = np.random.default_rng(1)
q, v, a = (random.uniform(-1, 1, n) for _ in range(3))
tau = np.zeros(n)


def microseconds(call: Callable[[], Any]) -> float:
    """Least processor time of a call."""
    best = float("inf")
    for _ in range(30):
        begun = time.process_time()
        for _ in range(2000):
            call()
        best = min(best, time.process_time() - begun)
    return best / 2000 * 1e6


CALLS: dict[str, Callable[[], Any]] = {
    "nothing": lambda: None,
    "mass_matrix": lambda: pin.crba(model, data, q),
    "bias": lambda: pin.nonLinearEffects(model, data, q, v),
    "inverse_dynamics": lambda: pin.rnea(model, data, q, v, a),
    "accelerations": lambda: pin.aba(model, data, q, v, tau),
    "kinetic_energy": lambda: pin.computeKineticEnergy(model, data, q, v),
    "potential_energy": lambda: pin.computePotentialEnergy(model, data, q),
    "frame jacobian": lambda: pin.computeJointJacobian(model, data, q, n),
}
for name, call in CALLS.items():
    print(name, microseconds(call), sep="\t")
