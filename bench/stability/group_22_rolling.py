"""Rolling and gliding: constraints that hold for velocities only."""

from __future__ import annotations

from .case import Array, Case, Followed, Known, Measured, Refusal, drift, energy_drift
from .group_11_redundant import published

NUMBER = 22
TITLE = "Rolling, gliding, rattleback"

DISK = """
parameter m = 1 kg;
parameter R = 0.3 m;
gravity {{0, 0, -9.81 m/s^2}};
coordinate Length x = 0 m;
coordinate Length y = 0 m;
coordinate Angle yaw = 0 deg;
coordinate Angle lean = {lean};
coordinate Angle roll = 0 rad;
initial der(roll) = {roll} rad/s;
initial der(yaw) = {yaw} rad/s;
frame heel = world * trans({{x, y, 0}}) * rotz(yaw) * rotx(lean);
frame disk = heel * trans({{0, 0, R}}) * roty(roll);
mass m at disk;
inertia m*R^2*diag({{1/4, 1/2, 1/4}}) on disk;
nonholonomic constraint forward: der(x) = R*der(roll)*cos(yaw);
nonholonomic constraint side: der(y) = R*der(roll)*sin(yaw);
{more}
experiment(stop = {stop} s, tolerance = 1e-11);
"""

SLEIGH = published("chaplygin_sleigh", 10.0)

# Ellipsoid with semi-axes 0.2, 0.03, 0.02 m on a plane, its mass unsymmetric by a small angle: it reverses its spin.
RATTLEBACK = """
parameter m = 1 kg;
parameter delta = 2 deg "between the axes of curvature and of inertia";
gravity {0, 0, -9.81 m/s^2};
parameter a = 0.2 m;
parameter b = 0.03 m;
parameter c = 0.02 m;
coordinate Length p[3] ~ {0 m, 0 m, c};
coordinate Rotation R = rotx(0.5 deg)*roty(0.01 deg);
initial der(R) ~ {0, 0, -5} rad/s;
frame body = world * trans(p) * R;
let u = components(body, {0, 0, 1});
let s = sqrt(a^2*u[1]^2 + b^2*u[2]^2 + c^2*u[3]^2);
let r = {-a^2*u[1]/s, -b^2*u[2]/s, -c^2*u[3]/s};
mass m at body;
inertia {{2e-4*cos(delta)^2 + 1.6e-3*sin(delta)^2, (2e-4 - 1.6e-3)*sin(delta)*cos(delta), 0},
         {(2e-4 - 1.6e-3)*sin(delta)*cos(delta), 1.6e-3*cos(delta)^2 + 2e-4*sin(delta)^2, 0},
         {0, 0, 1.7e-3}} kg.m^2 on body;
constraint touch: p[3] = s;
nonholonomic constraint grip: vel(body) + direction(body, cross(der(R), r)) = {0, 0, 0};
output spin = components(world, angvel(body))[3];
experiment(stop = 10 s, tolerance = 1e-10);
"""


def straight(t: Array) -> Array:
    return 6 * 0.3 * t


CASES = (
    Case(
        "disk rolling upright",
        "an unstable motion below the critical speed; nothing disturbs it",
        DISK.format(lean="0 deg", roll=6, yaw=0, more="", stop=3),
        Known("rolls straight on, to 1e-9", {"x": straight}, 1e-9),
        fault="pushed",
    ),
    Case(
        "disk falling flat",
        "without any spin it lies down: the mass matrix is that of a falling pencil",
        DISK.format(lean="10 deg", roll=0, yaw=0, more='assert abs(lean) < 89.9 deg, "the disk lies flat";', stop=20),
        Refusal("stops with the words of the model when it lies flat", ("the disk lies flat",), (0.1, 20)),
        fault="no refusal",
    ),
    Case(
        "disk falling nearly flat, and rising again",
        "lean up to 89.99 deg, spins of 1e3 rad/s near the ground",
        DISK.format(lean="60 deg", roll=1, yaw=0.5, more="", stop=5),
        Measured("keeps energy to 1e-7", energy_drift, 1e-7),
        fault="loose",
    ),
    Case(
        "disk, followed",
        "the same, against the reference",
        DISK.format(lean="60 deg", roll=1, yaw=0.5, more="", stop=1),
        Followed("follows the reference to 1e-6", 1e-6, seconds=15),
        fault="loose",
    ),
    Case(
        "Chaplygin's sleigh",
        "a blade that cannot slip: an attractor without friction",
        "examples/chaplygin_sleigh.mech",
        Known("the published end, to 1e-8",
              {"x": SLEIGH["x"], "y": SLEIGH["y"], "theta": SLEIGH["theta"]}, 1e-8),
        fault="sign",
        options={"tolerance": 1e-10},
    ),
    Case(
        "Chaplygin's sleigh for 1e4 s",
        "it glides straight on for ever",
        "examples/chaplygin_sleigh.mech",
        Measured("keeps its energy to 1e-8", drift, 1e-8),
        fault="loose",
        options={"tolerance": 1e-10, "stop": 1e4},
    ),
    Case(
        "rattleback",
        "spun against its sense it rattles, stops, and turns round",
        RATTLEBACK,
        Measured("turns round: the spin goes from -5 to above 0.5 rad/s", lambda s: 0.5 - float(s["spin"].max()), 0,
                 (("energy kept to 1e-6", lambda s: energy_drift(s) < 1e-6),)),
        fault="sign",
    ),
    Case(
        "rattleback, followed",
        "the rattling is fast, and grows from a small tilt",
        RATTLEBACK,
        Followed("follows the reference to 1e-5", 1e-5, seconds=25),
        fault="loose",
        options={"stop": 3},
    ),
)  # fmt: skip
