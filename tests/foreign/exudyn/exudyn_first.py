"""The first systems: elements alone and in pairs."""

from __future__ import annotations

from typing import Any

import exudyn.itemInterface as exu_items
import numpy as np
from exudyn.utilities import (
    MarkerBodyPosition,
    ObjectConnectorGravity,
    RigidBodyInertia,
    RotationMatrixY,
    RotationMatrixZ,
)
from exudyn_forming import POSITION, SPIN, Read, Scene, explicit, exu, implicit

G = [0.0, 0.0, -9.81]


def inertia(mass: float, *moments: float) -> Any:
    return RigidBodyInertia(mass=mass, inertiaTensor=np.diag(moments), com=[0, 0, 0])


def at(mbs: Any, body: Any, what: Any = POSITION, place: Any = (0, 0, 0)) -> list[float]:
    return [float(x) for x in mbs.GetObjectOutputBody(body, what, list(place))]


def mass_spring_damper(s: Scene) -> Read:
    mbs = s.mbs
    m = mbs.CreateMassPoint(
        referencePosition=[0.5, 0, 0],
        initialDisplacement=[-0.08, 0, 0],
        initialVelocity=[1, 0, 0],
        physicsMass=1.6,
    )
    ground = mbs.CreateGround()
    mbs.CreateSpringDamper(bodyNumbers=[ground, m], referenceLength=0.5, stiffness=4000, damping=8)
    mbs.CreateForce(bodyNumber=m, loadVector=[80, 0, 0])
    return lambda: [at(mbs, m)[0] - 0.5]


def cartesian_springs(s: Scene) -> Read:
    mbs = s.mbs
    m = mbs.CreateMassPoint(
        referencePosition=[0, 0, 0], initialVelocity=[0.3, -0.2, 0.1], physicsMass=5, gravity=G
    )
    ground = mbs.CreateGround()
    mbs.CreateCartesianSpringDamper(bodyNumbers=[ground, m], stiffness=[300, 400, 500], damping=[3, 4, 5])
    return lambda: at(mbs, m)


def two_on_springs(s: Scene) -> Read:
    mbs = s.mbs
    a = mbs.CreateMassPoint(referencePosition=[1, 0, 0], initialVelocity=[0, 1, 0], physicsMass=2, gravity=G)
    b = mbs.CreateMassPoint(
        referencePosition=[1, 1, 0], initialVelocity=[0, 0, 0.5], physicsMass=1, gravity=G
    )
    ground = mbs.CreateGround()
    mbs.CreateSpringDamper(bodyNumbers=[ground, a], stiffness=2000, damping=2)
    mbs.CreateSpringDamper(bodyNumbers=[a, b], stiffness=1000, damping=1)
    return lambda: at(mbs, a) + at(mbs, b)


def free_rotation(s: Scene) -> Read:
    mbs = s.mbs
    b = mbs.CreateRigidBody(
        inertia=inertia(10, 1, 2, 3), referencePosition=[0, 0, 0], initialAngularVelocity=[0.01, 5, 0.02]
    )
    return lambda: at(mbs, b, SPIN) + at(mbs, b, POSITION, (1, 0, 0))


def heavy_top(s: Scene) -> Read:
    mbs = s.mbs
    omega, tip = np.array([0, 150, -4.61538]), np.array([0.0, 1.0, 0.0])
    b = mbs.CreateRigidBody(
        inertia=inertia(15, 0.234375, 0.46875, 0.234375),
        referencePosition=tip,
        initialAngularVelocity=omega,
        initialVelocity=np.cross(omega, tip),
        gravity=G,
    )
    ground = mbs.CreateGround()
    mbs.CreateSphericalJoint(bodyNumbers=[ground, b], position=[0, 0, 0], show=False)
    return lambda: at(mbs, b)


def skew_double_pendulum(s: Scene) -> Read:
    mbs = s.mbs
    a = mbs.CreateRigidBody(inertia=inertia(2, 0.05, 0.4, 0.45), referencePosition=[0.5, 0, 0], gravity=G)
    b = mbs.CreateRigidBody(inertia=inertia(1, 0.02, 0.1, 0.11), referencePosition=[1.4, 0, 0], gravity=G)
    ground = mbs.CreateGround()
    mbs.CreateRevoluteJoint(bodyNumbers=[ground, a], position=[0, 0, 0], axis=[0, 1, 0], useGlobalFrame=True)
    mbs.CreateRevoluteJoint(bodyNumbers=[a, b], position=[1, 0, 0], axis=[0.6, 0.8, 0], useGlobalFrame=True)
    return lambda: at(mbs, a) + at(mbs, b)


def spinning_on_a_ball_joint(s: Scene) -> Read:
    mbs = s.mbs
    omega, c = np.array([20.0, 0, 1]), np.array([0.3, 0, 0.1])
    b = mbs.CreateRigidBody(
        inertia=inertia(1, 0.02, 0.01, 0.015),
        referencePosition=c,
        initialAngularVelocity=omega,
        initialVelocity=np.cross(omega, c),
        gravity=G,
    )
    ground = mbs.CreateGround()
    mbs.CreateSphericalJoint(bodyNumbers=[ground, b], position=[0, 0, 0], show=False)
    return lambda: at(mbs, b) + at(mbs, b, SPIN)


def slider_on_an_arm(s: Scene) -> Read:
    mbs = s.mbs
    a = mbs.CreateRigidBody(inertia=inertia(3, 0.1, 0.5, 0.5), referencePosition=[0.5, 0, 0], gravity=G)
    b = mbs.CreateRigidBody(inertia=inertia(1, 0.02, 0.03, 0.04), referencePosition=[0.6, 0, 0], gravity=G)
    ground = mbs.CreateGround()
    mbs.CreateRevoluteJoint(bodyNumbers=[ground, a], position=[0, 0, 0], axis=[0, 1, 0], useGlobalFrame=True)
    mbs.CreatePrismaticJoint(bodyNumbers=[a, b], position=[0.6, 0, 0], axis=[1, 0, 0], useGlobalFrame=True)
    mbs.CreateSpringDamper(bodyNumbers=[ground, b], referenceLength=0.6, stiffness=200, damping=2)
    return lambda: at(mbs, a) + at(mbs, b)


def masses_at_fixed_distances(s: Scene) -> Read:
    mbs = s.mbs
    a = mbs.CreateMassPoint(referencePosition=[1, 0, 0], initialVelocity=[0, 1, 0], physicsMass=2, gravity=G)
    b = mbs.CreateMassPoint(referencePosition=[2, 0, 0], initialVelocity=[0, 2, 0], physicsMass=1, gravity=G)
    ground = mbs.CreateGround()
    mbs.CreateDistanceConstraint(bodyNumbers=[ground, a], distance=1)
    mbs.CreateDistanceConstraint(bodyNumbers=[a, b], distance=1)
    return lambda: at(mbs, a) + at(mbs, b)


def four_bars(s: Scene) -> Read:
    mbs = s.mbs
    down = [0.0, -9.81, 0.0]
    a = mbs.CreateRigidBody(
        inertia=inertia(1, 0.011, 0.011, 0.021),
        referencePosition=[0, 0.25, 0],
        referenceRotationMatrix=RotationMatrixZ(np.pi / 2),
        initialAngularVelocity=[0, 0, 0],
        gravity=down,
    )
    b = mbs.CreateRigidBody(inertia=inertia(2, 0.01, 0.2, 0.2), referencePosition=[0.5, 0.5, 0], gravity=down)
    c = mbs.CreateRigidBody(
        inertia=inertia(1.5, 0.01, 0.03, 0.04),
        referencePosition=[1, 0.25, 0],
        referenceRotationMatrix=RotationMatrixZ(np.pi / 2),
        gravity=down,
    )
    ground = mbs.CreateGround()
    for bodies, place in (([ground, a], [0, 0, 0]), ([a, b], [0, 0.5, 0]), ([b, c], [1, 0.5, 0])):
        mbs.CreateRevoluteJoint(bodyNumbers=bodies, position=place, axis=[0, 0, 1], useGlobalFrame=True)
    mbs.CreateGenericJoint(
        bodyNumbers=[ground, c], position=[1, 0, 0], constrainedAxes=[1, 1, 0, 0, 0, 0], useGlobalFrame=True
    )
    mbs.CreateTorque(bodyNumber=a, loadVector=[0, 0, -0.8])
    return lambda: at(mbs, a)[:2] + at(mbs, b)[:2] + at(mbs, c)[:2]


def slider_crank(s: Scene) -> Read:
    mbs = s.mbs
    down = [0.0, -9.81, 0.0]
    turned = RotationMatrixZ(np.pi / 2)
    crank = mbs.CreateRigidBody(
        inertia=inertia(2, 0.01, 0.02, 0.03),
        referencePosition=[0, 0.1, 0],
        referenceRotationMatrix=turned,
        gravity=down,
    )
    rod = mbs.CreateRigidBody(
        inertia=inertia(1, 0.01, 0.02, 0.025),
        referencePosition=[0.2, 0.1, 0],
        referenceRotationMatrix=RotationMatrixZ(-np.arctan2(0.2, 0.4)),
        gravity=down,
    )
    ground = mbs.CreateGround()
    mbs.CreateRevoluteJoint(
        bodyNumbers=[ground, crank], position=[0, 0, 0], axis=[0, 0, 1], useGlobalFrame=True
    )
    mbs.CreateRevoluteJoint(
        bodyNumbers=[crank, rod], position=[0, 0.2, 0], axis=[0, 0, 1], useGlobalFrame=True
    )
    mbs.CreateGenericJoint(
        bodyNumbers=[ground, rod],
        position=[0.4, 0, 0],
        constrainedAxes=[0, 1, 0, 0, 0, 0],
        useGlobalFrame=True,
    )
    mbs.CreateTorque(bodyNumber=crank, loadVector=[0, 0, -2.0])
    return lambda: at(mbs, crank)[:2] + at(mbs, rod)[:2]


def torsional_spring(s: Scene) -> Read:
    mbs = s.mbs
    b = mbs.CreateRigidBody(
        inertia=inertia(1, 0.02, 0.03, 0.05), referencePosition=[0, 0, 0], initialAngularVelocity=[0, 0, 2]
    )
    ground = mbs.CreateGround()
    mbs.CreateRevoluteJoint(bodyNumbers=[ground, b], position=[0, 0, 0], axis=[0, 0, 1], useGlobalFrame=True)
    mbs.CreateTorsionalSpringDamper(
        bodyNumbers=[ground, b],
        position=[0, 0, 0],
        axis=[0, 0, 1],
        stiffness=4,
        damping=0.02,
        useGlobalFrame=True,
    )
    mbs.CreateTorque(bodyNumber=b, loadVector=[0, 0, 0.5])
    return lambda: at(mbs, b, SPIN)[2:] + at(mbs, b, POSITION, (1, 0, 0))[:2]


def body_on_three_springs(s: Scene) -> Read:
    mbs = s.mbs
    b = mbs.CreateRigidBody(
        inertia=inertia(20, 0.8, 1.2, 1.6),
        referencePosition=[0, 0, 0],
        initialAngularVelocity=[0.5, -0.4, 1],
        gravity=G,
    )
    ground = mbs.CreateGround()
    for corner in ([0.5, 0.3, 0], [-0.5, 0.3, 0], [0, -0.4, 0.1]):
        mbs.CreateCartesianSpringDamper(
            bodyNumbers=[ground, b],
            localPosition0=corner,
            localPosition1=corner,
            stiffness=[2000, 1500, 3000],
            damping=[20, 15, 30],
        )
    return lambda: at(mbs, b) + at(mbs, b, POSITION, (0.5, 0.3, 0))


def gravity_between_two(s: Scene) -> Read:
    mbs = s.mbs
    a = mbs.CreateMassPoint(referencePosition=[0, 0, 0], initialVelocity=[0, -0.2, 0], physicsMass=4)
    b = mbs.CreateMassPoint(referencePosition=[1, 0, 0], initialVelocity=[0, 0.8, 0.1], physicsMass=1)
    markers = [mbs.AddMarker(MarkerBodyPosition(bodyNumber=k, localPosition=[0, 0, 0])) for k in (a, b)]
    mbs.AddObject(ObjectConnectorGravity(markerNumbers=markers, gravitationalConstant=0.25, mass0=4, mass1=1))
    return lambda: at(mbs, a) + at(mbs, b)


def pushed_by_a_sine(s: Scene) -> Read:
    mbs = s.mbs
    b = mbs.CreateRigidBody(inertia=inertia(2, 0.1, 0.2, 0.25), referencePosition=[0, 0, 0])
    mbs.CreateForce(
        bodyNumber=b,
        localPosition=[0.1, 0.2, 0],
        loadVectorUserFunction=lambda mbs, t, load: [3 * np.sin(5 * t), 0, 1],
    )
    mbs.CreateTorque(bodyNumber=b, loadVectorUserFunction=lambda mbs, t, load: [0, 0.4 * np.cos(3 * t), 0.2])
    return lambda: at(mbs, b) + at(mbs, b, SPIN)


def rolling_coin(s: Scene) -> Read:
    mbs = s.mbs
    r, m = 0.05, 0.2
    omega = np.array([0.0, 0, -3])
    turn = RotationMatrixY(np.radians(20))
    spin = turn @ np.array([-20.0, 0, 0]) + omega
    # towards the contact, for a coin whose axis has no y
    down = np.cross(turn @ np.array([1.0, 0, 0]), [0, 1.0, 0])
    down *= -np.sign(down[2]) * r
    centre = -down
    b = mbs.CreateRigidBody(
        inertia=inertia(m, m * r**2 / 2, m * r**2 / 4, m * r**2 / 4),
        referencePosition=centre,
        referenceRotationMatrix=turn,
        initialAngularVelocity=spin,
        initialVelocity=np.cross(spin, centre),
        gravity=G,
    )
    ground = mbs.CreateGround()
    mbs.CreateRollingDisc(
        bodyNumbers=[ground, b],
        axisPosition=[0, 0, 0],
        axisVector=[1, 0, 0],
        planePosition=[0, 0, 0],
        planeNormal=[0, 0, 1],
        discRadius=r,
    )
    return lambda: at(mbs, b)


def sliding_and_turning(s: Scene) -> Read:
    mbs = s.mbs
    b = mbs.CreateRigidBody(
        inertia=inertia(2, 0.1, 0.2, 0.15), referencePosition=[0.4, 0, 0.1], gravity=[0, -9.81, -1]
    )
    ground = mbs.CreateGround()
    mbs.CreateGenericJoint(
        bodyNumbers=[ground, b], position=[0, 0, 0], constrainedAxes=[1, 1, 0, 1, 1, 0], useGlobalFrame=True
    )
    mbs.CreateSpringDamper(bodyNumbers=[ground, b], localPosition0=[0, 0, 1], referenceLength=1, stiffness=50)
    return lambda: at(mbs, b) + at(mbs, b, POSITION, (0, 0.5, 0))


def in_a_plane(s: Scene) -> Read:
    mbs = s.mbs
    b = mbs.CreateRigidBody(
        inertia=inertia(2, 0.1, 0.2, 0.15),
        referencePosition=[0.3, 0.2, 0],
        initialAngularVelocity=[0, 0, 4],
        initialVelocity=[0.5, 0, 0],
        gravity=[0, -9.81, 0],
    )
    ground = mbs.CreateGround()
    mbs.CreateGenericJoint(
        bodyNumbers=[ground, b], position=[0, 0, 0], constrainedAxes=[0, 0, 1, 1, 1, 0], useGlobalFrame=True
    )
    mbs.CreateSpringDamper(
        bodyNumbers=[ground, b], localPosition1=[0.2, 0, 0], referenceLength=0.3, stiffness=300, damping=3
    )
    return lambda: at(mbs, b)[:2] + at(mbs, b, POSITION, (0.2, 0, 0))[:2]


def five_in_a_row(s: Scene) -> Read:
    mbs = s.mbs
    ground = mbs.CreateGround()
    bodies = [ground]
    for k in range(5):
        bodies.append(mbs.CreateMassPoint(referencePosition=[k + 1, 0, 0], physicsMass=1 + 0.1 * k))
        mbs.CreateSpringDamper(bodyNumbers=bodies[-2:], referenceLength=1, stiffness=800, damping=4)
    mbs.CreateForce(bodyNumber=bodies[-1], loadVector=[20, 0, 0])
    return lambda: [at(mbs, b)[0] - k - 1 for k, b in enumerate(bodies[1:])]


def three_link_arm(s: Scene) -> Read:
    mbs = s.mbs
    ground = mbs.CreateGround()
    before, x, links = ground, 0.0, []
    for k, axis in enumerate(([0, 0, 1], [0, 1, 0], [0, 1, 0])):
        length = (0.2, 0.5, 0.4)[k]
        link = mbs.CreateRigidBody(
            inertia=inertia(3 - k, 0.02, 0.1, 0.1), referencePosition=[x + length / 2, 0, 0], gravity=G
        )
        mbs.CreateRevoluteJoint(
            bodyNumbers=[before, link], position=[x, 0, 0], axis=axis, useGlobalFrame=True
        )
        before, x = link, x + length
        links.append(link)
    mbs.CreateTorque(bodyNumber=links[0], loadVector=[0, 0, 1.5])
    mbs.CreateForce(bodyNumber=links[2], localPosition=[0.2, 0, 0], loadVector=[0, 0, 12])
    return lambda: [x for link in links for x in at(mbs, link)]


def first_order(s: Scene) -> Read:
    mbs = s.mbs
    node = mbs.AddNode(
        exu_items.NodeGenericODE1(
            referenceCoordinates=[0, 0, 0], initialCoordinates=[1, 0, -0.5], numberOfODE1Coordinates=3
        )
    )
    mbs.AddObject(
        exu_items.ObjectGenericODE1(
            nodeNumbers=[node],
            systemMatrix=np.array([[-1, 4, 0], [-4, -1, 1], [0.5, 0, -2.0]]),
            rhsVector=[0, 2, 1],
        )
    )
    return lambda: [float(x) for x in mbs.GetNodeOutput(node, exu.OutputVariableType.Coordinates)]


def three_masses_by_matrices(s: Scene) -> Read:
    mbs = s.mbs
    node = mbs.AddNode(
        exu_items.NodeGenericODE2(
            referenceCoordinates=[0, 0, 0],
            initialCoordinates=[0.1, 0, -0.2],
            initialCoordinates_t=[0, 1, 0],
            numberOfODE2Coordinates=3,
        )
    )
    K = 100 * np.array([[2, -1, 0], [-1, 3, -2], [0, -2, 2.0]])
    mbs.AddObject(
        exu_items.ObjectGenericODE2(
            nodeNumbers=[node],
            massMatrix=np.array([[2, 0.1, 0], [0.1, 3, 0.2], [0, 0.2, 1.0]]),
            stiffnessMatrix=K,
            dampingMatrix=0.004 * K,
            forceVector=[0, 5, 0],
        )
    )
    return lambda: [float(x) for x in mbs.GetNodeOutput(node, exu.OutputVariableType.Coordinates)]


def geared_discs(s: Scene) -> Read:
    mbs = s.mbs
    nodes, markers = [], []
    ground = mbs.AddNode(exu_items.NodePointGround())
    for moment in (0.2, 0.05):
        node = mbs.AddNode(
            exu_items.Node1D(referenceCoordinates=[0], initialCoordinates=[0], initialVelocities=[0])
        )
        mbs.AddObject(exu_items.ObjectRotationalMass1D(nodeNumber=node, physicsInertia=moment))
        markers.append(mbs.AddMarker(exu_items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0)))
        nodes.append(node)
    fixed = mbs.AddMarker(exu_items.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    mbs.AddObject(exu_items.ObjectConnectorCoordinate(markerNumbers=markers, factorValue1=-0.4))
    mbs.AddObject(
        exu_items.ObjectConnectorCoordinateSpringDamper(
            markerNumbers=[fixed, markers[1]], stiffness=6, damping=0.1
        )
    )
    mbs.AddLoad(exu_items.LoadCoordinate(markerNumber=markers[0], load=3))
    return lambda: [float(mbs.GetNodeOutput(n, exu.OutputVariableType.Coordinates)) for n in nodes]


SYSTEMS = {
    "mass_spring_damper": implicit(mass_spring_damper, 1.0, 1e-4),
    "cartesian_springs": implicit(cartesian_springs, 1.0, 1e-3),
    "two_on_springs": implicit(two_on_springs, 1.0, 5e-4),
    "free_rotation": implicit(free_rotation, 2.0, 1e-3),
    "heavy_top": implicit(heavy_top, 0.5, 1e-4),
    "skew_double_pendulum": implicit(skew_double_pendulum, 1.0, 5e-4),
    "spinning_on_a_ball_joint": implicit(spinning_on_a_ball_joint, 1.0, 2e-4),
    "slider_on_an_arm": implicit(slider_on_an_arm, 1.0, 5e-4),
    "masses_at_fixed_distances": implicit(masses_at_fixed_distances, 1.0, 5e-4),
    "four_bars": implicit(four_bars, 0.5, 5e-4),
    "slider_crank": implicit(slider_crank, 0.3, 2e-4),
    "torsional_spring": implicit(torsional_spring, 1.0, 1e-3),
    "body_on_three_springs": implicit(body_on_three_springs, 1.0, 5e-4),
    "gravity_between_two": implicit(gravity_between_two, 2.0, 1e-3),
    "pushed_by_a_sine": implicit(pushed_by_a_sine, 2.0, 1e-3),
    "rolling_coin": implicit(rolling_coin, 0.5, 5e-4),
    "sliding_and_turning": implicit(sliding_and_turning, 1.0, 5e-4),
    "in_a_plane": implicit(in_a_plane, 1.0, 5e-4),
    "five_in_a_row": implicit(five_in_a_row, 1.0, 2e-4),
    "three_link_arm": implicit(three_link_arm, 0.6, 5e-4),
    "first_order": explicit(first_order, 2.0, 1e-3),
    "three_masses_by_matrices": implicit(three_masses_by_matrices, 1.0, 2e-4),
    "geared_discs": implicit(geared_discs, 1.0, 5e-4),
}
