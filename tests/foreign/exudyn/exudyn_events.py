"""Systems that change at given times, vehicles, mechanisms with slots, curves and motors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import exudyn.itemInterface as items
import numpy as np
from exudyn.utilities import RigidBodyInertia, RotationMatrixY, RotationMatrixZ
from exudyn_forming import ANGLES, DOWN, G, Link, Read, Scene, box, explicit, exu, implicit, turned

NONE = (0.0, 0.0, 0.0)
FORCE = exu.OutputVariableType.Force


def torques_in_turns(s: Scene) -> Read:
    b = s.body(2, (0.1, 0.15, 0.2), (0, 0, 0), g=NONE, node=ANGLES)
    torques = [(2.0, 0, 0), (-2.0, 0, 0), (0, 0, 2.0), (0, 1.0, -2.0)]
    load = s.mbs.CreateTorque(bodyNumber=b, loadVector=list(torques[0]), bodyFixed=True)

    def turn_to(torque: tuple[float, ...]) -> Callable[[], None]:
        return lambda: s.mbs.SetLoadParameter(load, "loadVector", list(torque))

    s.stages += [(0.3 * (k + 1), turn_to(torque)) for k, torque in enumerate(torques[1:])]
    return lambda: s.where(b, local=(0.1, 0.2, 0.3)) + s.spin(b)


def springs_that_break(s: Scene) -> Read:
    places = {(i, j): (float(i), float(j), 0.0) for i in range(3) for j in range(2)}
    points = {at: s.mass(10, p, g=(0, -9, 0)) for at, p in places.items() if at[0]}
    pairs = [
        *(((i, j), (i + 1, j)) for j in range(2) for i in range(2)),
        *(((i, 0), (i, 1)) for i in (1, 2)),
        *(((i, 0), (i + 1, 1)) for i in (0, 1)),
    ]
    springs = []
    for a, b in pairs:
        length = float(np.linalg.norm(np.subtract(places[a], places[b])))
        one, at = (points[a], ()) if a in points else (s.ground, places[a])
        springs.append(s.spring(one, at, points[b], (), 4000, length, 10))

    def look() -> None:
        for spring in springs:
            if np.linalg.norm(s.mbs.GetObjectOutput(spring, FORCE)) > 400:
                s.mbs.SetObjectParameter(spring, "activeConnector", False)

    for k in range(1, 60):
        s.stages.append((0.01 * k, look))
    return lambda: s.where(*points.values(), flat=True)


def hand_that_samples(s: Scene) -> Read:
    links = [
        Link("RevoluteZ", 2, (0.01, 0.1, 0.1), (0.25, 0), parent=-1),
        Link("RevoluteZ", 1, (0.01, 0.05, 0.05), (0.2, 0), parent=0, at=(0.5, 0, 0), q=0.3),
    ]
    node, _ = s.tree(links, DOWN)
    loads = []
    for k in range(2):
        mark = s.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=k))
        loads.append(s.mbs.AddLoad(items.LoadCoordinate(markerNumber=mark, load=0)))

    def torque(q: Any, v: Any) -> list[float]:
        aim = (0.5, -0.4)
        return [float((60, 20)[k] * (aim[k] - q[k]) - (4, 1)[k] * v[k]) for k in range(2)]

    def act() -> None:
        q = s.mbs.GetNodeOutput(node, exu.OutputVariableType.Coordinates)
        v = s.mbs.GetNodeOutput(node, exu.OutputVariableType.Coordinates_t)
        for load, value in zip(loads, torque(q, v), strict=True):
            s.mbs.SetLoadParameter(load, "load", value)

    for load, value in zip(loads, torque((0, 0.3), (0, 0)), strict=True):
        s.mbs.SetLoadParameter(load, "load", value)
    for k in range(1, 40):
        s.stages.append((0.02 * k, act))
    return lambda: s.values(node)


def rod_that_is_let_go(s: Scene) -> Read:
    rod = s.flat(12, 1, (-0.5, 0), v=(0, 2), w=4)
    mass = s.mbs.CreateMassPoint(
        referencePosition=[-0.5, 0, 0],
        initialVelocity=[0, 2, 0],
        physicsMass=2,
        gravity=list(DOWN),
        create2D=True,
    )
    held = [s.keep(s.of(mass, k), s.of(rod, k)) for k in (0, 1)]
    hinge = s.mbs.AddObject(
        items.ObjectJointRevolute2D(markerNumbers=[s.place(s.ground, (-1, 0)), s.place(rod, (-0.5, 0))])
    )

    def off(*objects: Any) -> Callable[[], None]:
        def change() -> None:
            for k in objects:
                s.mbs.SetObjectParameter(k, "activeConnector", False)

        return change

    s.stages += [(0.1, off(*held)), (0.3, off(hinge))]
    return lambda: s.where(rod, mass, flat=True) + s.where(rod, local=(1, 0), flat=True)


def three_wheeler(s: Scene) -> Read:
    v, r = 2.0, 0.3
    frame = s.body(20, (1, 2, 2.5), (0.4, 0, 0.5), v=(v, 0, 0))
    fork = s.body(2, (0.05, 0.06, 0.03), (1, 0, 0.4), v=(v, 0, 0))
    wheels = {
        at: s.body(1.5, (0.04, 0.07, 0.04), (*at, r), v=(v, 0, 0), w=(0, v / r, 0))
        for at in ((0, 0.4), (0, -0.4), (1, 0))
    }
    s.hinge(frame, fork, (1, 0, 0.5), (0, 0, 1))
    for at, wheel in wheels.items():
        s.hinge(fork if at[0] else frame, wheel, (*at, r), (0, 1, 0))
        s.mbs.CreateRollingDisc(
            bodyNumbers=[s.ground, wheel],
            axisPosition=[0, 0, 0],
            axisVector=[0, 1, 0],
            planePosition=[0, 0, 0],
            planeNormal=[0, 0, 1],
            discRadius=r,
            # the rear wheels hold their axle both; one is enough
            constrainedAxes=[0, 1, 1] if at == (0, -0.4) else [1, 1, 1],
        )
    s.mbs.CreateTorsionalSpringDamper(
        bodyNumbers=[frame, fork],
        position=[1, 0, 0.5],
        axis=[0, 0, 1],
        stiffness=40,
        damping=4,
        offset=0.4,
        useGlobalFrame=True,
    )
    s.twist(wheels[(0, 0.4)], (0, 3, 0), bodyFixed=True)
    return lambda: s.where(frame, fork, *wheels.values())


def pin_in_a_slot(s: Scene) -> Read:
    angle = float(np.arctan2(0.5, 0.2))
    arm = s.flat(2, 0.15, turned(angle, 0.45), angle)
    crank = s.flat(1, 0.01, (0.1, 0.5))
    s.pin(s.ground, (0, 0), arm, (-0.45, 0))
    s.pin(s.ground, (0, 0.5), crank, (-0.1, 0))
    s.mbs.AddObject(
        items.ObjectJointPrismatic2D(
            markerNumbers=[s.place(crank, (0.1, 0)), s.place(arm)],
            axisMarker0=[1, 0, 0],
            normalMarker1=[0, 1, 0],
            constrainRotation=False,
        )
    )
    s.load(s.of(crank, 2), 5)
    return lambda: s.where(arm, crank, flat=True)


def bead_on_a_curve(s: Scene) -> Read:
    node = s.mbs.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=[0, 0],
            initialCoordinates=[1, 0.5 + 0.1 * np.sin(3)],
            initialCoordinates_t=[0, 0],
            numberOfODE2Coordinates=2,
        )
    )
    body = s.mbs.AddObject(
        items.ObjectGenericODE2(nodeNumbers=[node], massMatrix=2 * np.eye(2), forceVector=[0, -19.62])
    )
    ground = s.mbs.AddMarker(items.MarkerNodeCoordinates(nodeNumber=s.mbs.AddNode(items.NodePointGround())))

    def slope(mbs: Any, t: float, item: int, q: Any, v: Any, rate: bool) -> np.ndarray:
        return np.array([[-q[0] - 0.3 * np.cos(3 * q[0]), 1.0]])

    def law(mbs: Any, t: float, item: int, q: Any, v: Any, rate: bool) -> list[float]:
        if rate:
            return list(slope(mbs, t, item, q, v, rate) @ v)
        return [q[1] - q[0] ** 2 / 2 - 0.1 * np.sin(3 * q[0])]

    s.mbs.AddObject(
        items.CoordinateVectorConstraint(
            markerNumbers=[ground, s.mbs.AddMarker(items.MarkerObjectODE2Coordinates(objectNumber=body))],
            scalingMarker0=np.zeros((1, 2)),
            constraintUserFunction=law,
            jacobianUserFunction=slope,
        )
    )
    return lambda: s.values(node)


def disc_on_a_slope(s: Scene) -> Read:
    tilt = RotationMatrixY(0.3)
    normal = tilt @ np.array([0, 0, 1.0])
    r, m = 0.2, 3.0
    centre = r * normal
    w = tilt @ np.array([0.5, 4.0, 1.0])
    b = s.body(m, (0.04, 0.07, 0.04), centre, turn=tilt, w=w, about=(0, 0, 0))
    s.mbs.CreateRollingDisc(
        bodyNumbers=[s.ground, b],
        axisPosition=[0, 0, 0],
        axisVector=[0, 1, 0],
        planePosition=[0, 0, 0],
        planeNormal=list(normal),
        discRadius=r,
    )
    return lambda: s.where(b) + s.spin(b)


def joint_that_moves(s: Scene) -> Read:
    a = s.body(1, (0.1, 0.1, 0.1), (0, 0, 0), v=(0.4, 0, 0), node=ANGLES)
    b = s.body(2, (0.02, 0.1, 0.1), (0.3, 0, 0), v=(0.4, 0, 0))
    for k in range(6):
        amount = (0.1, 0, 0.05, 0, 0, 0)[k]
        s.keep(
            s.of(a, k),
            offsetUserFunction=lambda mbs, t, item, _, c=amount, k=k: (
                c * (np.sin(4 * t) if k == 0 else 1 - np.cos(3 * t))
            ),
            offsetUserFunction_t=lambda mbs, t, item, _, c=amount, k=k: (
                c * (4 * np.cos(4 * t) if k == 0 else 3 * np.sin(3 * t))
            ),
        )
    s.hinge(a, b, (0, 0, 0), (0, 1, 0))
    return lambda: s.where(a, b)


def geared_motor(s: Scene) -> Read:
    links = [
        Link("RevoluteY", 4, (0.01, 0.1, 0.1), (0.25, 0, 0), parent=-1),
        Link("RevoluteY", 2, (0.01, 0.05, 0.05), (0.2, 0, 0), parent=0, at=(0.5, 0, 0)),
    ]
    node, _ = s.tree(links, G)
    rotor, angle = s.coordinate(0.002)
    s.keep(
        s.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0)),
        angle,
        factorValue1=-1 / 50,
    )
    s.along(angle, stiffness=0, damping=0.02)
    s.load(angle, 0.02 * 150)
    return lambda: s.values(node, rotor)


def lopsided_body(s: Scene) -> Read:
    J = np.array([[0.3, 0.05, -0.02], [0.05, 0.4, 0.03], [-0.02, 0.03, 0.5]])
    b = s.mbs.CreateRigidBody(
        inertia=RigidBodyInertia(
            mass=4, inertiaTensor=J, com=np.array([0.1, 0.2, -0.1]), inertiaTensorAtCOM=True
        ),
        referencePosition=[0, 0, 0],
        initialVelocity=[0.2, 0, 0.1],
        initialAngularVelocity=[1, -2, 0.5],
        gravity=list(G),
        nodeType=ANGLES,
    )
    s.springs(s.ground, (0.3, 0, 0.2), b, (0.3, 0, 0.2), (300, 400, 500), (3, 4, 5))
    s.springs(s.ground, (-0.3, 0.2, 0), b, (-0.3, 0.2, 0), (400, 300, 300), (4, 3, 3))
    s.twist(b, (0.5, 0, 1), bodyFixed=True)
    return lambda: s.where(b) + s.where(b, local=(0.1, 0.2, -0.1)) + s.spin(b)


def follower_on_a_cam(s: Scene) -> Read:
    node, q = s.coordinate(0.3, 0.06)

    def law(mbs: Any, t: float, item: int, u: float, v: float, k: float, d: float, offset: float) -> float:
        push = sum(max(r + at * np.cos(8 * np.pi * t) - u, 0.0) for r, at in ((0.05, 0.0), (0.035, 0.025)))
        return float(k * (u - 0.04) + d * v - 2e5 * push)

    s.along(q, stiffness=1000, damping=20, springForceUserFunction=law)
    return lambda: s.values(node)


def meet(a: Any, r: float, b: Any, q: float) -> np.ndarray:
    """Where circles meet, left of the way from a to b."""
    d: np.ndarray = np.subtract(b, a)
    length = float(np.linalg.norm(d))
    x = (length**2 + r**2 - q**2) / (2 * length)
    d = d / length
    found: np.ndarray = np.array(a) + x * d + np.sqrt(r**2 - x**2) * np.array([-d[1], d[0]])
    return found


def six_bars(s: Scene) -> Read:
    pin = 0.2 * np.array([np.cos(1), np.sin(1)])
    knee = meet(pin, 0.5, (0.6, 0), 0.4)
    along = (knee - pin) / 0.5
    point = pin + 0.25 * along + 0.15 * np.array([-along[1], along[0]])
    top = meet(point, 0.5, (0.9, 0.6), 0.4)
    bars = []
    for a, b, m, J in (
        ((0, 0), pin, 1, 0.01),
        (pin, knee, 2, 0.05),
        ((0.6, 0), knee, 1, 0.02),
        (point, top, 1, 0.03),
        ((0.9, 0.6), top, 1, 0.02),
    ):
        way = np.subtract(b, a)
        bars.append(s.flat(m, J, np.add(a, b) / 2, float(np.arctan2(way[1], way[0]))))
    crank, rod, rocker, link, arm = bars
    s.pin(s.ground, (0, 0), crank, (-0.1, 0))
    s.pin(crank, (0.1, 0), rod, (-0.25, 0))
    s.pin(s.ground, (0.6, 0), rocker, (-0.2, 0))
    s.pin(rod, (0.25, 0), rocker, (0.2, 0))
    s.pin(rod, (0, 0.15), link, (-0.25, 0))
    s.pin(s.ground, (0.9, 0.6), arm, (-0.2, 0))
    s.pin(link, (0.25, 0), arm, (0.2, 0))
    s.load(s.of(crank, 2), 6)
    return lambda: s.where(*bars, flat=True)


def plate_on_posts(s: Scene) -> Read:
    b = s.body(3, (0.1, 0.2, 0.28), (0, 0, 0), w=(0.5, 0, 0), about=(0, 0, 0))
    s.joint(s.ground, b, (-0.4, 0, 0), [1, 1, 0, 0, 0, 0])
    s.joint(s.ground, b, (0.4, 0, 0), [0, 1, 0, 0, 0, 0])
    for at, k in (((-0.4, 0, 0), 400), ((0.4, 0, 0), 600), ((0, 0.3, 0), 300)):
        s.springs(s.ground, at, b, at, (0, 0, k), (0, 0, 2))
    return lambda: s.where(b) + s.where(b, local=(0, 1, 0)) + s.spin(b)


def ten_links(s: Scene) -> Read:
    links = [
        Link(
            "RevoluteY" if k % 2 else "RevoluteZ",
            1,
            (0.001, 0.01, 0.01),
            (0.15, 0.01, 0),
            parent=k - 1,
            at=(0.3 if k else 0, 0, 0),
            v=1.0 if k == 0 else 0.0,
        )
        for k in range(10)
    ]
    node, _ = s.tree(links, G)
    return lambda: s.values(node)


def soft_disc(s: Scene, wheel: Any, r: float, mu: tuple[float, float], angle: float, c: float = 1e3) -> None:
    """A wheel about x on soft ground, whose friction grows with its slip."""
    data = s.mbs.AddNode(
        items.NodeGenericData(initialCoordinates=[1e-3, 0, -1e-3], numberOfDataCoordinates=3)
    )
    s.mbs.AddObject(
        items.ObjectConnectorRollingDiscPenalty(
            markerNumbers=[s.place(s.ground), s.place(wheel)],
            nodeNumber=data,
            discRadius=r,
            dryFriction=list(mu),
            dryFrictionAngle=angle,
            dryFrictionProportionalZone=2.0,
            useLinearProportionalZone=True,
            contactStiffness=1e5,
            contactDamping=c,
        )
    )


def car_on_soft_wheels(s: Scene) -> Read:
    car = s.body(500, box(500, 2, 3, 0.4), (0, 0, 0.4), v=(0, 3, 0))
    m = 500 * np.pi * 0.16 * 0.1
    J = (m * 0.08, m * (0.48 + 0.01) / 12, m * (0.48 + 0.01) / 12)
    wheels = []
    for x, y, turn in ((-1, -1.5, 0.0), (1, -1.5, 0.0), (-1, 1.5, 0.2), (1, 1.5, 0.15)):
        A = RotationMatrixZ(turn)
        axis = A @ np.array([1.0, 0, 0])
        wheel = s.body(m, J, (x, y, 0.4), turn=A, v=(0, 3, 0), w=-3 / 0.4 * axis)
        s.hinge(car, wheel, (x, y, 0.4), axis)
        soft_disc(s, wheel, 0.4, (0.8, 0.8), 0.0)
        if y < 0:
            s.twist(wheel, (-200, 0, 0), bodyFixed=True)
        wheels.append(wheel)
    return lambda: s.where(car, *wheels) + s.spin(wheels[0])


def wheels_with_rollers(s: Scene) -> Read:
    car = s.body(500, box(500, 3, 3, 0.4), (0, 0, 0.4))
    m = 500 * np.pi * 0.16 * 0.2
    J = (m * 0.08, m * (0.48 + 0.04) / 12, m * (0.48 + 0.04) / 12)
    wheels = []
    for k, (x, y) in enumerate(((-1.5, -1.5), (1.5, -1.5), (-1.5, 1.5), (1.5, 1.5))):
        wheel = s.body(m, J, (x, y, 0.4))
        s.hinge(car, wheel, (x, y, 0.4), (1, 0, 0))
        soft_disc(s, wheel, 0.4, (1.0, 0.0), (-1 if k in (0, 3) else 1) * np.pi / 4)
        s.twist(wheel, ((100, -60, -80, 120)[k], 0, 0), bodyFixed=True)
        wheels.append(wheel)
    return lambda: s.where(car, *wheels) + s.spin(car)


def coin_on_soft_ground(s: Scene) -> Read:
    r, m = 0.2, 2.0
    turn = RotationMatrixY(0.2)
    axis = turn @ np.array([1.0, 0, 0])
    w = -8 * axis + np.array([0, 0, -1])
    b = s.body(m, (0.04, 0.02, 0.02), (0, 0, r * np.cos(0.2)), turn=turn, v=(0, 8 * r, 0), w=w)
    soft_disc(s, b, r, (0.8, 0.6), 0.0, 100)
    return lambda: s.where(b) + s.spin(b)


SYSTEMS = {
    "torques_in_turns": explicit(torques_in_turns, 1.2, 1e-3),
    "springs_that_break": explicit(springs_that_break, 0.6, 1e-3),
    "hand_that_samples": explicit(hand_that_samples, 0.8, 1e-3),
    "rod_that_is_let_go": implicit(rod_that_is_let_go, 0.6, 5e-4),
    "three_wheeler": implicit(three_wheeler, 1.0, 5e-4),
    "pin_in_a_slot": implicit(pin_in_a_slot, 0.3, 2e-4),
    "bead_on_a_curve": implicit(bead_on_a_curve, 1.0, 5e-4),
    "disc_on_a_slope": implicit(disc_on_a_slope, 0.5, 2e-4),
    "joint_that_moves": implicit(joint_that_moves, 1.0, 5e-4),
    "geared_motor": implicit(geared_motor, 0.5, 2e-4),
    "lopsided_body": explicit(lopsided_body, 1.0, 1e-3),
    "follower_on_a_cam": explicit(follower_on_a_cam, 0.5, 1e-5),
    "six_bars": implicit(six_bars, 0.3, 2e-4),
    "plate_on_posts": implicit(plate_on_posts, 0.6, 2e-4),
    "car_on_soft_wheels": implicit(car_on_soft_wheels, 0.5, 5e-4),
    "wheels_with_rollers": implicit(wheels_with_rollers, 0.5, 5e-4),
    "coin_on_soft_ground": implicit(coin_on_soft_ground, 0.5, 1e-4),
    "ten_links": explicit(ten_links, 0.5, 2e-4),
}
