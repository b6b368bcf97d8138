"""Systems in space."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import exudyn.itemInterface as items
import numpy as np
from exudyn.utilities import RotationMatrixX, RotationMatrixY, RotationMatrixZ
from exudyn_forming import ANGLES, DOWN, Link, Read, Scene, box, explicit, implicit, led

NONE = (0.0, 0.0, 0.0)


def bricard(s: Scene) -> Read:
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], dtype=float)
    axes = [(0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)]
    bars = []
    for a, b in pairwise(corners):
        along = (b - a) / np.linalg.norm(b - a)
        J = 0.5 / 300 * np.outer(along, along) + 0.0841666666666667 * (np.eye(3) - np.outer(along, along))
        bars.append(s.body(1, J, (a + b) / 2, g=DOWN))
    parts = [s.ground, *bars, s.ground]
    for k in range(5):
        s.hinge(parts[k], parts[k + 1], corners[k], axes[k])
    # one of the six hinges holds what the others hold already
    s.joint(parts[5], s.ground, corners[5], [1, 1, 1, 0, 1, 0])
    return lambda: s.where(*bars)


def bent_shaft(s: Scene) -> Read:
    w = 10.0
    lean = RotationMatrixX(np.pi / 4)
    along = lean @ np.array([0, 0, 1.0])
    driving = s.body(9, (2, 3, 5), (0, 0, 0), w=(0, 0, w), g=NONE)
    pin = np.array([0, 0, 0.5])
    cross = s.body(1, (0.1, 0.2, 0.3), pin, turn=lean, w=(0, 0, w), g=NONE)
    driven = s.body(3, (1, 1, 2), pin + 0.5 * along, turn=lean, w=w / np.sqrt(2) * along, about=pin, g=NONE)
    s.hinge(s.ground, driving, (0, 0, -0.5), (0, 0, 1))
    s.hinge(driving, cross, pin, (1, 0, 0))
    s.hinge(cross, driven, pin, lean @ np.array([0, 1.0, 0]))
    s.joint(s.ground, driven, pin + along, [1, 1, 0, 0, 0, 0], lean)
    load = s.mbs.GetObject(driving)["nodeNumber"]
    s.mbs.AddObject(
        items.ObjectConnectorCoordinate(
            markerNumbers=[
                s.fixed,
                s.mbs.AddMarker(items.MarkerNodeRotationCoordinate(nodeNumber=load, rotationCoordinate=2)),
            ],
            offset=w,
            velocityLevel=True,
        )
    )
    return lambda: s.where(driving, cross, driven, local=(1, 0, 0)) + s.spin(driven)


def stiff_governor(s: Scene) -> Read:
    thin, lean = box(0.3, 1, 0.01, 0.01), np.radians(30)
    m = 5.3
    com = (0.3 * 0.5 + 5) / m
    across = thin[1] + 0.3 * (com - 0.5) ** 2 + 5 * (1 - com) ** 2
    rod = (thin[0], across, across)
    links = [
        Link("RevoluteZ", 0.3, box(0.3, 0.01, 0.01, 1), parent=-1, at=(0, 0, 0.5), v=0.16 * 2 * np.pi),
        Link("PrismaticZ", 3, box(3, 0.1, 0.1, 0.1), parent=0),
        Link("RevoluteY", m, rod, (com, 0, 0), parent=0, at=(0.05, 0, 0.5), turn=RotationMatrixY(lean)),
        Link(
            "RevoluteY", m, rod, (com, 0, 0), parent=0, at=(-0.05, 0, 0.5), turn=RotationMatrixY(np.pi - lean)
        ),
    ]
    node, tree = s.tree(links)
    for k, x in ((2, 0.05), (3, -0.05)):
        s.mbs.AddObject(
            items.ObjectConnectorSpringDamper(
                markerNumbers=[s.on(tree, 1, (x, 0, 0)), s.on(tree, k, (0.5, 0, 0))],
                stiffness=8e5,
                damping=4e4,
                referenceLength=0.5,
            )
        )
    return lambda: s.values(node)


def soft_governor(s: Scene) -> Read:
    w = np.array([0, 0, 0.16 * 2 * np.pi])
    lean = np.radians(30)
    m = 5.3
    com = (0.3 * 0.5 + 5) / m
    thin = box(0.3, 1, 0.01, 0.01)
    across = thin[1] + 0.3 * (com - 0.5) ** 2 + 5 * (1 - com) ** 2
    shaft = s.body(0.3, box(0.3, 0.01, 0.01, 1), (0, 0, 0.5), w=w)
    slider = s.body(3, box(3, 0.1, 0.1, 0.1), (0, 0, 0.5), w=w)
    s.hinge(s.ground, shaft, (0, 0, 0), (0, 0, 1))
    s.mbs.CreatePrismaticJoint(
        bodyNumbers=[shaft, slider], position=[0, 0, 0.5], axis=[0, 0, 1], useGlobalFrame=True
    )
    rods = []
    for side in (1, -1):
        turn = RotationMatrixY(lean if side > 0 else np.pi - lean)
        top = np.array([0.05 * side, 0, 1])
        at = top + turn @ np.array([com, 0, 0])
        rod = s.body(m, turn @ np.diag((thin[0], across, across)) @ turn.T, at, w=w, about=(0, 0, 0))
        s.hinge(shaft, rod, top, (0, 1, 0))
        middle = top + turn @ np.array([0.5, 0, 0]) - at
        s.spring(slider, (0.05 * side, 0, 0), rod, middle, 4000, 0.5, 200)
        rods.append(rod)
    return lambda: s.where(slider, *rods) + s.spin(shaft)


def slider_crank_in_space(s: Scene) -> Read:
    crank_foot, b = np.array([0, 0.1, 0.12]), np.array([0, 0.1, 0.2])
    c = np.array([0.2, 0, 0])
    x = (c - b) / 0.3
    z = b - (b @ x) * x
    z /= np.linalg.norm(z)
    turn = np.array([x, np.cross(z, x), z]).T
    crank = s.body(0.12, (0.0001, 0.0001, 0.00001), (0, 0.1, 0.16), w=(6, 0, 0), about=crank_foot)
    rod = s.body(
        0.5, (0.0004, 0.004, 0.004), (b + c) / 2, turn=turn, v=(0.12, -0.24, 0), w=(1.92, -0.96, 0.48)
    )
    slider = s.body(2, (0.0001, 0.0001, 0.0001), c, v=(0.24, 0, 0))
    s.hinge(s.ground, crank, crank_foot, (1, 0, 0))
    s.mbs.CreatePrismaticJoint(
        bodyNumbers=[s.ground, slider], position=list(c), axis=[1, 0, 0], useGlobalFrame=True
    )
    s.ball(crank, rod, b)
    s.mbs.AddObject(
        items.ObjectJointGeneric(
            markerNumbers=[
                s.place(slider),
                s.place(rod, (0.15, 0, 0)),
            ],
            constrainedAxes=[1, 1, 1, 0, 0, 1],
        )
    )
    return lambda: s.where(crank, rod, slider) + s.spin(crank)[:1]


def rotor(s: Scene, at: float, eccentric: float, spin: float) -> Any:
    m, r, k = 2.0, 0.75, 800.0
    J = (0.5 * m * r**2, 0.25 * m * r**2 + m * 0.2**2 / 12, 0.25 * m * r**2 + m * 0.2**2 / 12)
    d = 2 * np.sqrt(2 * k / m) * 0.002 * m
    b = s.body(m, J, (at - 0.5, eccentric, 0), w=(spin, 0, 0), g=NONE, node=ANGLES)
    s.springs(s.ground, (-0.5, 0, 0), b, (-at, -eccentric, 0), (k, k, k), (d, d, d))
    s.springs(s.ground, (0.5, 0, 0), b, (1 - at, -eccentric, 0), (0, k, k), (0, d, d))
    return b


def rotor_running_up(s: Scene) -> Read:
    b = rotor(s, 0.5, 0.00148, 0)
    s.twist(b, (2, 0, 0))
    return lambda: [100 * x for x in s.where(b)] + s.spin(b)


def rotor_pushed_backwards(s: Scene) -> Read:
    b = rotor(s, 0.9, 0, 15)
    s.push(
        b,
        (0, 0, 0),
        loadVectorUserFunction=lambda mbs, t, load: [0, -10 * np.cos(12 * t), 10 * np.sin(12 * t)],
    )
    return lambda: [10 * x for x in s.where(b)] + s.spin(b)


def torques_of_its_own(s: Scene) -> Read:
    b = s.body(2, (0.1, 0.25, 0.2), (0, 0, 0), g=NONE, node=ANGLES)
    s.twist(
        b,
        (0, 0, 0),
        bodyFixed=True,
        loadVectorUserFunction=lambda mbs, t, load: [
            1.2 * np.cos(4 * t),
            0.5 * np.sin(3 * t),
            0.8 * np.cos(2 * t),
        ],
    )
    s.push(b, (0, 0, 0), loadVectorUserFunction=lambda mbs, t, load: [20 * np.cos(3 * t), 4 * t, 0])
    return lambda: s.where(b, local=(0.05, 0.05, 0.05)) + s.spin(b)


def skew_tree(s: Scene) -> Read:
    m = 20.0
    J = box(m, 2, 0.1, 0.1)
    skew = RotationMatrixY(np.pi / 4)
    links = []
    for k in range(5):
        turn = np.eye(3) if k % 2 == 0 else skew
        if k % 3 >= 1:
            turn = RotationMatrixX(np.pi / 2) @ skew
        links.append(Link("RevoluteZ", m, J, (1, 0, 0), parent=k - 1, at=(2 if k else 0, 0, 0), turn=turn))
    node, _ = s.tree(links, (0, -10, 0))
    return lambda: s.values(node)


ARM = (
    # mass, moments, centre, then Denavit and Hartenberg's d, a and alpha to the next joint
    (20, (1e-8, 0.35, 1e-8), (0, 0, 0), (0, 0, np.pi / 2)),
    (17.4, (0.13, 0.524, 0.539), (-0.3638, 0.006, 0.2275), (0, 0.4318, 0)),
    (4.8, (0.066, 0.086, 0.0125), (-0.0203, -0.0141, 0.07), (0.15, 0.0203, -np.pi / 2)),
    (0.82, (0.0018, 0.0013, 0.0018), (0, 0.019, 0), (0.4318, 0, np.pi / 2)),
    (0.34, (0.0003, 0.0004, 0.0003), (0, 0, 0), (0, 0, -np.pi / 2)),
    (0.09, (0.00015, 0.00015, 4e-5), (0, 0, 0.032), (0, 0, 0)),
)
"""Of the arm Puma 560: centres and moments are in the frame at the end of each link."""


def arm_of_six(s: Scene, more: tuple[Link, ...] = ()) -> Read:
    links = list(more)
    at, turn = np.zeros(3), np.eye(3)
    for m, J, com, (up, a, alpha) in ARM:
        end = RotationMatrixX(alpha)
        offset = np.array([a, 0, up])
        links.append(
            Link(
                "RevoluteZ",
                m,
                end @ np.diag(J) @ end.T,
                offset + end @ np.array(com),
                parent=len(links) - 1,
                at=at,
                turn=turn,
            )
        )
        at, turn = offset, end
    k = [0.0] * len(more) + [4000.0, 4000, 4000, 100, 100, 10]
    d = [0.0] * len(more) + [400.0, 400, 100, 1, 1, 0.1]
    if more:
        k[0], d[0] = 20000.0, 200.0
    aim = [0.1] * len(more) + [0.5, np.pi / 8, np.pi / 4, 0.2, np.pi / 8, 0.3]
    node, _ = s.tree(links, (0, 0, -9.81), **led(k, d, aim))
    return lambda: s.values(node)


def arm_on_a_sledge(s: Scene) -> Read:
    return arm_of_six(s, (Link("PrismaticX", 50, (1, 1, 1), parent=-1),))


def coupled_joints(s: Scene) -> Read:
    m = 4.0
    J = box(m, 0.4, 0.1, 0.1)
    links = [
        Link("PrismaticX", m, J, (0.2, 0, 0), parent=-1),
        Link("RevoluteX", m, J, (0.2, 0, 0), parent=0, at=(0.4, 0, 0), turn=RotationMatrixY(np.pi / 2)),
        Link("RevoluteY", m, J, (0.2, 0, 0), parent=1, at=(0.4, 0, 0)),
        Link("RevoluteZ", m, J, (0.2, 0, 0), parent=2, at=(0.4, 0, 0), q=0.5),
    ]
    node, _ = s.tree(links, DOWN)
    q = [s.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=k)) for k in range(4)]
    s.keep(
        q[0],
        offsetUserFunction=lambda mbs, t, item, offset: 0.3 * (1 - np.cos(2 * np.pi * t)),
        offsetUserFunction_t=lambda mbs, t, item, offset: 0.6 * np.pi * np.sin(2 * np.pi * t),
    )
    s.keep(q[0], q[1], factorValue1=1 / (2 * np.pi))
    s.keep(q[1], q[2], factorValue1=-1)
    return lambda: s.values(node)


def wheel_on_a_turntable(s: Scene) -> Read:
    m = 1000 * np.pi * 0.25 * 0.1
    J = m * (0.75 + 0.01) / 12
    wheel = s.body(m, (J, J, m * 0.125), (0, 0, 3), g=DOWN)
    table = s.body(100, (1000, 1000, 1000), (0, -0.5, 0), g=DOWN)
    s.hinge(s.ground, table, (0, -0.5, 0), (0, 1, 0))
    s.springs(wheel, (0, 0, -3), s.ground, (0, 0, 0), (1e5, 1e5, 1e5), (1e4, 1e4, 1e4))
    s.twist(wheel, (0, 0, 20), bodyFixed=True)
    s.mbs.AddObject(
        items.ObjectJointRollingDisc(
            markerNumbers=[s.place(table), s.place(wheel)],
            constrainedAxes=[1, 1, 1],
            discRadius=0.5,
            discAxis=np.array([0, 0, 1]),
            planeNormal=np.array([0, 1, 0]),
        )
    )
    return lambda: s.where(wheel, local=(0.5, 0, 0)) + s.spin(wheel, table)


def disc_that_tips(s: Scene) -> Read:
    r, m = 0.2, 5000 * np.pi * 0.04 * 0.02
    J = m * (3 * r**2 + 0.02**2) / 12
    w = np.array([-6 * np.pi, 3, 0])
    b = s.body(m, (m * r**2 / 2, J, J), (1, 0, r), w=w, about=(1, 0, 0))
    s.mbs.CreateRollingDisc(
        bodyNumbers=[s.ground, b],
        axisPosition=[0, 0, 0],
        axisVector=[1, 0, 0],
        planePosition=[0, 0, 0],
        planeNormal=[0, 0, 1],
        discRadius=r,
    )
    return lambda: s.where(b) + s.spin(b)


def bicycle(s: Scene) -> Read:
    v, lean = 4.0, 0.05
    z = 1.0
    rear, front = np.array([0, 0, 0.3]), np.array([1.02, 0, 0.35])
    head = np.array([0.82188470506, 0, 0.85595086466])
    about = np.zeros(3)

    def part(m: float, J: Any, at: Any, roll: float = 0) -> Any:
        w = np.array([lean, 0, 0])
        speed = np.array([v, 0, 0]) + np.cross(w, np.array(at) - about)
        return s.body(m, J, at, v=speed, w=w + np.array([0, roll, 0]))

    back = part(2, (0.0603, 0.12, 0.0603), rear, v / 0.3)
    fore = part(3, (0.1405, 0.28, 0.1405), front, v / 0.35)
    frame = part(85, [[9.2, 0, -2.4], [0, 11, 0], [-2.4, 0, 2.8]], (0.3, 0, 0.9))
    fork = part(4, [[0.05892, 0, 0.00756], [0, 0.06, 0], [0.00756, 0, 0.00708]], (0.9, 0, 0.7))
    axis = np.array([-np.sin(np.pi / 10), 0, z * np.cos(np.pi / 10)])
    s.hinge(back, frame, rear, (0, 1, 0))
    s.hinge(fork, fore, front, (0, 1, 0))
    s.hinge(frame, fork, head, axis)
    for wheel, r in ((back, 0.3), (fore, 0.35)):
        s.mbs.CreateRollingDisc(
            bodyNumbers=[s.ground, wheel],
            axisPosition=[0, 0, 0],
            axisVector=[0, 1, 0],
            planePosition=[0, 0, 0],
            planeNormal=[0, 0, 1],
            discRadius=r,
        )
    return lambda: s.where(back, fore, frame, fork)


def bodies_on_stiff_springs(s: Scene) -> Read:
    before, at = s.ground, (-0.3, 0, 0.1)
    bodies = []
    for k in range(4):
        b = s.body(2, (0.6, 0.1, 0.6), (0.6 * k, 0, 0), g=DOWN, node=ANGLES)
        s.springs(before, at, b, (-0.3, 0, 0.1), (1e4, 1e4, 1e4), (20, 20, 20))
        before, at = b, (0.3, 0, 0.1)
        bodies.append(b)
    return lambda: s.where(*bodies)


def chain_of_ball_joints(s: Scene) -> Read:
    before = s.ground
    bodies = []
    for k in range(4):
        b = s.body(1, (0.02, 0.05, 0.06), (0.25 + 0.5 * k, 0, 0), w=(1, 0, 0), about=(0, 0, 0))
        s.ball(before, b, (0.5 * k, 0, 0))
        before = b
        bodies.append(b)
    s.push(bodies[-1], (0, 3, 0), (0.25, 0, 0))
    return lambda: s.where(*bodies)


def cranks_and_a_rod(s: Scene) -> Read:
    a = s.body(1, (0.01, 0.02, 0.03), (0, 0.1, 0), w=(5, 0, 0), about=(0, 0, 0))
    s.hinge(s.ground, a, (0, 0, 0), (1, 0, 0))
    start, end = np.array([0, 0.2, 0]), np.array([0.8, 0.3, 0.5])
    foot = np.array([0.8, 0.3, 0])
    # the rod keeps its length: the end of the second crank begins at this speed
    rod = start - end
    speed = float(rod @ np.array([0, 0, 1.0]) / (rod @ np.array([1.0, 0, 0])))
    w = np.array([0, speed / 0.5, 0])
    b = s.body(2, (0.03, 0.04, 0.02), foot + np.array([0, 0, 0.25]), w=w, about=foot)
    s.hinge(s.ground, b, foot, (0, 1, 0))
    s.mbs.CreateDistanceConstraint(
        bodyNumbers=[a, b],
        localPosition0=[0, 0.1, 0],
        localPosition1=[0, 0, 0.25],
        distance=float(np.linalg.norm(rod)),
    )
    return lambda: s.where(a, b) + s.spin(a, b)


def turned_cardan(s: Scene) -> Read:
    b = s.body(50, box(50, 1, 0.1, 0.1), (1, 0, 0), w=(0, 2, 0), about=(0.5, 0, 0), g=DOWN)
    s.joint(s.ground, b, (0.5, 0, 0), [1, 1, 1, 1, 0, 0], RotationMatrixX(np.pi / 8))
    s.push(b, (0, 20, 0), (0.5, 0, 0))
    s.twist(b, (0, 0, 0), loadVectorUserFunction=lambda mbs, t, load: [0, 8 * t**2, 5 * t**2])
    return lambda: s.where(b) + s.where(b, local=(0, 1, 0))


def skew_pair_on_springs(s: Scene) -> Read:
    turn = RotationMatrixZ(-np.pi / 4) @ RotationMatrixY(np.pi / 4)
    half = np.array([0.05, 0, 0])
    J = box(0.5, 0.1, 0.01, 0.02)
    a = s.body(0.5, J, half, g=DOWN)
    b = s.body(0.5, J, 2 * half + turn @ half, turn=turn, g=DOWN)
    s.hinge(s.ground, a, (0, 0, 0), (0, 0, 1))
    s.ball(a, b, 2 * half)
    tip = 2 * half + turn @ (2 * half)
    s.springs(b, half, s.ground, tip, (100, 100, 100), (0.1, 0.1, 0.1))
    return lambda: [10 * x for x in s.where(a, b)] + s.where(b, local=(0, 1, 0))


def gyroscope(s: Scene) -> Read:
    links = [
        Link("RevoluteZ", 1, (0.03, 0.03, 0.05), parent=-1, v=0.5),
        Link("RevoluteX", 0.6, (0.02, 0.01, 0.01), (0, 0.02, -0.05), parent=0, q=0.4),
        Link("RevoluteY", 2, (0.01, 0.02, 0.01), (0, 0.1, 0), parent=1, v=100),
    ]
    node, _ = s.tree(links)
    return lambda: s.values(node)


def body_on_three_angles(s: Scene) -> Read:
    links = [
        Link("RevoluteX", 0, (0, 0, 0), parent=-1, v=1),
        Link("RevoluteY", 0, (0, 0, 0), parent=0, q=0.3),
        Link("RevoluteZ", 3, (0.1, 0.2, 0.25), (0.2, 0.1, -0.1), parent=1, v=3),
    ]
    node, _ = s.tree(links)
    return lambda: s.values(node)


def springs_of_the_joints(s: Scene) -> Read:
    axis = np.array([0.6, 0.8, 0])
    a = s.body(3, (0.2, 0.3, 0.4), (0.3, 0, 0), w=2 * axis, about=(0, 0, 0))
    b = s.body(1, (0.02, 0.03, 0.04), (0.5, 0, 0.2), w=2 * axis, about=(0, 0, 0))
    s.hinge(s.ground, a, (0, 0, 0), axis)
    s.mbs.CreateTorsionalSpringDamper(
        bodyNumbers=[s.ground, a],
        position=[0, 0, 0],
        axis=list(axis),
        stiffness=20,
        damping=0.3,
        useGlobalFrame=True,
    )
    along = np.array([0.6, 0, 0.8])
    s.mbs.CreatePrismaticJoint(
        bodyNumbers=[a, b], position=[0.5, 0, 0.2], axis=list(along), useGlobalFrame=True
    )
    s.mbs.CreateLinearSpringDamper(
        itemNumbers=[a, b],
        position=[0.5, 0, 0.2],
        axis=list(along),
        stiffness=150,
        damping=2,
        offset=0.05,
        useGlobalFrame=True,
    )
    return lambda: s.where(a, b) + s.where(a, local=(0, 1, 0))


SYSTEMS = {
    "bricard": implicit(bricard, 1.0, 5e-4),
    "bent_shaft": implicit(bent_shaft, 0.5, 2e-4),
    "stiff_governor": implicit(stiff_governor, 1.0, 2e-4),
    "soft_governor": implicit(soft_governor, 1.0, 2e-4),
    "slider_crank_in_space": implicit(slider_crank_in_space, 0.5, 2e-4),
    "rotor_running_up": explicit(rotor_running_up, 2.0, 1e-3),
    "rotor_pushed_backwards": explicit(rotor_pushed_backwards, 1.0, 1e-3),
    "torques_of_its_own": explicit(torques_of_its_own, 1.0, 1e-3),
    "skew_tree": explicit(skew_tree, 1.0, 1e-3),
    "arm_of_six": explicit(arm_of_six, 0.3, 5e-5),
    "arm_on_a_sledge": explicit(arm_on_a_sledge, 0.3, 5e-5),
    "coupled_joints": implicit(coupled_joints, 0.4, 2e-4),
    "wheel_on_a_turntable": implicit(wheel_on_a_turntable, 1.0, 2e-4),
    "disc_that_tips": implicit(disc_that_tips, 0.5, 2e-4),
    "bicycle": implicit(bicycle, 1.0, 5e-4),
    "bodies_on_stiff_springs": explicit(bodies_on_stiff_springs, 0.5, 2e-4),
    "chain_of_ball_joints": implicit(chain_of_ball_joints, 0.5, 2e-4),
    "cranks_and_a_rod": implicit(cranks_and_a_rod, 0.5, 2e-4),
    "turned_cardan": implicit(turned_cardan, 0.8, 1e-4),
    "skew_pair_on_springs": implicit(skew_pair_on_springs, 0.2, 1e-4),
    "gyroscope": explicit(gyroscope, 1.0, 2e-4),
    "body_on_three_angles": explicit(body_on_three_angles, 0.6, 5e-4),
    "springs_of_the_joints": implicit(springs_of_the_joints, 0.6, 2e-4),
}
