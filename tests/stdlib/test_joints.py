"""Joints of the library as edges of a tree: pose of `to`, and freedoms."""

from __future__ import annotations

import numpy as np
import pytest
from library_joints import joints
from scipy.spatial.transform import Rotation

import mechc

a, b, d, e = 0.7, -1.2, 0.4, -0.9
n = np.array([1.0, 2.0, 2.0]) / 3


def turn(axis: object, angle: float) -> np.ndarray:
    return np.asarray(Rotation.from_rotvec(angle * np.asarray(axis, dtype=float)).as_matrix())


def plane(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


x, y, z = np.eye(3)
I2, I3 = np.eye(2), np.eye(3)
Q = Rotation.from_rotvec([0.3, -0.5, 0.8])
q = "quat(" + ", ".join(repr(float(c)) for c in np.roll(Q.as_quat(), 1)) + ")"

# declaration, position of `to`, its axes as columns
PLANAR = [
    ("Revolute", "angle = 0.7 rad", [0, 0], plane(a)),
    ("Prismatic", "axis = {3, 4}, position = 0.4 m", [0.24, 0.32], I2),
    ("Translation", "position = {0.4, -0.9} m", [d, e], I2),
    ("Planar", "x = 0.4 m, y = -0.9 m, angle = 0.7 rad", [d, e], plane(a)),
    ("Free", "x = 0.4 m, y = -0.9 m, angle = 0.7 rad", [d, e], plane(a)),
    ("Weld", "", [0, 0], I2),
    ("PinSlot", "axis = {3, 4}, position = 0.4 m, angle = 0.7 rad", [0.24, 0.32], plane(a)),
    ("Rolling", "r = 0.5 m, position = 0.4 m", [0.4, 0.5], plane(-0.8)),
    (
        "RollingOnCircle",
        "track = 2 m, r = -0.5 m, angle = 0.7 rad",
        [1.5 * np.cos(a), 1.5 * np.sin(a)],
        plane(-3 * a),
    ),
]
SPATIAL = [
    ("Revolute", "axis = {1, 2, 2}, angle = 0.7 rad", 0 * n, turn(n, a)),
    ("Revolute", "angle = 0.7 rad", 0 * n, turn(z, a)),
    ("Prismatic", "axis = {1, 2, 2}, position = 0.4 m", d * n, I3),
    ("Cylindrical", "axis = {1, 2, 2}, position = 0.4 m, angle = 0.7 rad", d * n, turn(n, a)),
    ("Screw", "axis = {1, 2, 2}, pitch = 0.3 m, angle = 0.7 rad", 0.3 * a / (2 * np.pi) * n, turn(n, a)),
    ("Universal", "angle = {0.7, -1.2} rad", 0 * n, turn(x, a) @ turn(y, b)),
    ("Universal", "first = {0, 0, 2}, second = {1, 2, 2}, angle = {0.7, -1.2} rad", 0 * n, turn(z, a) @ turn(n, b)),
    ("Gimbal", "angle = {0.7, -1.2, 0.4} rad", 0 * n, turn(x, a) @ turn(y, b) @ turn(z, d)),
    ("ConstantVelocity", "bend = {0.3, -0.4}", 0 * n, turn([0.6, -0.8, 0], 2 * np.arctan(0.5))),
    ("PointOnLine", f"axis = {{1, 2, 2}}, position = 0.4 m, orientation = {q}", d * n, Q.as_matrix()),
    ("Spherical", f"orientation = {q}", 0 * n, Q.as_matrix()),
    ("Planar", "x = 0.4 m, y = -0.9 m, angle = 0.7 rad", [d, e, 0], turn(z, a)),
    ("Free", f"position = {{0.4, -0.9, 0.2}} m, orientation = {q}", [d, e, 0.2], Q.as_matrix()),
    ("Translation", "position = {0.4, -0.9, 0.2} m", [d, e, 0.2], I3),
    ("Weld", "", 0 * n, I3),
]  # fmt: skip


def start(library: str, joint: str, settings: str, turned: str, at: str) -> dict[str, float]:
    """Place a joint on a frame that is off the origin and turned; return the outputs at the start."""
    size = 2 if library == "planar" else 3
    inertia = "1 kg.m^2" if size == 2 else "diag({1, 2, 3} kg.m^2)"
    units = ", ".join("{" + ", ".join("1" if i == j else "0" for j in range(size)) + "}" for i in range(size))
    axes = "".join(
        f"output e{i + 1} = direction(body.a, {unit});\n"
        for i, unit in enumerate(["{" + part + "}" for part in units.strip("{}").split("}, {")])
    )
    comma = ", " if settings else ""
    # a slider carries the frame, so that a welded body leaves a freedom; the post has a mass of its own
    text = (
        f"import mech.{library}.*;\nPrismatic rail(world -> post);\nframe post;\nmass 1 kg at post;\n"
        f"frame seat = post * trans({at} m) * {turned};\nBody body(m = 1 kg, J = {inertia});\n"
        f"{joint} joint(seat -> body.a{comma}{settings});\noutput p = pos(body.a);\n{axes}"
    )
    solution = mechc.loads(text).simulate(stop=1e-3, tolerance=1e-8)
    assert solution.outcome.value == "completed", solution.message
    return {name: float(values[0]) for name, values in solution.items()}


def test_every_joint_has_a_row() -> None:
    """A ``place`` and a ``closure`` that are wrong alike pass all tests but these."""
    missing = [
        f"{joint.name} of {joint.file}"
        for joint in joints()
        if joint.name not in {row[0] for row in (PLANAR if joint.library == "planar" else SPATIAL)}
    ]
    assert not missing


@pytest.mark.parametrize(("joint", "settings", "position", "axes"), PLANAR)
def test_planar(joint: str, settings: str, position: object, axes: np.ndarray) -> None:
    got = start("planar", joint, settings, "rot(0.5 rad)", "{1, 2}")
    seat = plane(0.5)
    assert [got[f"p[{i}]"] for i in (1, 2)] == pytest.approx(seat @ np.asarray(position) + [1, 2], abs=1e-14)
    columns = np.array([[got[f"e{j}[{i}]"] for j in (1, 2)] for i in (1, 2)])
    assert columns == pytest.approx(seat @ axes, abs=1e-14)


@pytest.mark.parametrize(("joint", "settings", "position", "axes"), SPATIAL)
def test_spatial(joint: str, settings: str, position: object, axes: np.ndarray) -> None:
    got = start("spatial", joint, settings, "rotx(0.5 rad)", "{1, 2, 3}")
    seat = turn(x, 0.5)
    expected = seat @ np.asarray(position) + [1, 2, 3]
    assert [got[f"p[{i}]"] for i in (1, 2, 3)] == pytest.approx(expected, abs=1e-14)
    columns = np.array([[got[f"e{j}[{i}]"] for j in (1, 2, 3)] for i in (1, 2, 3)])
    assert columns == pytest.approx(seat @ axes, abs=1e-14)


def test_a_homokinetic_joint_turns_both_shafts_alike() -> None:
    """Two shafts at 30 deg in bearings of their own: a cross joint between them does not, by as much as 1/cos - cos."""
    text = (
        "import mech.spatial.*;\nBody one(m = 1 kg, J = identity(3)*1 kg.m^2);\nBody two(m = 1 kg, J = identity(3)*1 kg.m^2);\n"
        "Revolute drive(world -> one.a);\ndrive drive.angle = 3 rad/s*time;\n{joint} middle(one.a -> two.a{settings});\n"
        "cut Cylindrical bearing(world * rotx(30 deg) -> two.a);\noutput w = dot(angvel(two.a), direction(two.a, {{0, 0, 1}}));\nexperiment(stop = 3 s);\n"
    )
    alike = mechc.loads(text.format(joint="ConstantVelocity", settings="")).simulate()["w"]
    assert alike == pytest.approx(3, abs=1e-9)
    crossed = mechc.loads(text.format(joint="Universal", settings="")).simulate()["w"]
    c = np.cos(np.radians(30))
    assert [crossed.min(), crossed.max()] == pytest.approx([3 * c, 3 / c], rel=1e-3)
