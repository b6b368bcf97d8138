"""What the systems have in common: bodies, joints, springs and trees of Exudyn in a line each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import exudyn
import exudyn.itemInterface as items
import numpy as np
from exudyn.utilities import RigidBodyInertia, RotationMatrixZ

exu: Any = exudyn
"""Any: this folder has the name of the library, which type checkers find first."""
POSITION = exu.OutputVariableType.Position
SPIN = exu.OutputVariableType.AngularVelocityLocal
COORDINATES = exu.OutputVariableType.Coordinates
G = (0.0, 0.0, -9.81)
DOWN = (0.0, -9.81, 0.0)
ANGLES = exu.NodeType.RotationRxyz
"""Three angles: without the constraint of four parameters an explicit method can go."""

Read = Callable[[], list[float]]
"""Gives what is compared, at the end."""


class Scene:
    """A system under construction."""

    def __init__(self, mbs: Any) -> None:
        self.mbs, self.ground = mbs, mbs.CreateGround()
        self.stages: list[tuple[float, Callable[[], None]]] = []
        """Times at which a run pauses, each with what changes there."""
        self.fixed = mbs.AddMarker(
            items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0)
        )

    # ------------------------------------------------------------ bodies

    def mass(self, m: float, at: Any, v: Any = (0, 0, 0), g: Any = (0, 0, 0)) -> Any:
        return self.mbs.CreateMassPoint(
            referencePosition=list(at), initialVelocity=list(v), physicsMass=m, gravity=list(g)
        )

    def body(
        self,
        m: float,
        J: Any,
        at: Any,
        *,
        turn: Any = None,
        v: Any = (0, 0, 0),
        w: Any = (0, 0, 0),
        about: Any = None,
        g: Any = G,
        node: Any = None,
    ) -> Any:
        """A rigid body with its mass centre at ``at``; ``about``: the place that its velocity turns it about."""
        J = np.array(J, float)
        if about is not None:
            v = np.array(v) + np.cross(w, np.array(at) - np.array(about))
        return self.mbs.CreateRigidBody(
            inertia=RigidBodyInertia(mass=m, inertiaTensor=J if J.ndim == 2 else np.diag(J), com=np.zeros(3)),
            referencePosition=list(at),
            referenceRotationMatrix=np.eye(3) if turn is None else turn,
            initialVelocity=list(v),
            initialAngularVelocity=list(w),
            gravity=list(g),
            nodeType=exu.NodeType.RotationEulerParameters if node is None else node,
        )

    def flat(
        self, m: float, J: float, at: Any, angle: float = 0, v: Any = (0, 0), w: float = 0, g: Any = DOWN
    ) -> Any:
        """A body in the plane; places on it count from its mass centre."""
        node = self.mbs.AddNode(
            items.NodeRigidBody2D(referenceCoordinates=[*at, angle], initialVelocities=[*v, w])
        )
        body = self.mbs.AddObject(items.ObjectRigidBody2D(physicsMass=m, physicsInertia=J, nodeNumber=node))
        self.mbs.AddLoad(
            items.LoadMassProportional(
                markerNumber=self.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=body)), loadVector=list(g)
            )
        )
        return body

    def coordinate(self, J: float, q: float = 0, v: float = 0) -> tuple[Any, Any]:
        """A mass or a moment of inertia on a coordinate: its node, and the marker of the coordinate."""
        node = self.mbs.AddNode(
            items.Node1D(referenceCoordinates=[0], initialCoordinates=[q], initialVelocities=[v])
        )
        self.mbs.AddObject(items.ObjectMass1D(nodeNumber=node, physicsMass=J))
        return node, self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))

    # ------------------------------------------------------------ markers and joints

    def place(self, body: Any, local: Any = (0, 0, 0)) -> Any:
        return self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body, localPosition=three(local)))

    def point(self, body: Any) -> Any:
        return self.mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=body))

    def of(self, body: Any, k: int) -> Any:
        """The marker of a coordinate of a body's node: 0, 1, 2 are x, y and the angle in the plane."""
        node = self.mbs.GetObject(body)["nodeNumber"]
        return self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=k))

    def pin(self, a: Any, pa: Any, b: Any, pb: Any) -> None:
        """A hinge in the plane, between places on two bodies."""
        self.mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[self.place(a, pa), self.place(b, pb)]))

    def hinge(self, a: Any, b: Any, at: Any, axis: Any) -> Any:
        return self.mbs.CreateRevoluteJoint(
            bodyNumbers=[a, b], position=list(at), axis=list(axis), useGlobalFrame=True
        )

    def joint(self, a: Any, b: Any, at: Any, held: Sequence[int], axes: Any = None) -> Any:
        return self.mbs.CreateGenericJoint(
            bodyNumbers=[a, b],
            position=list(at),
            constrainedAxes=list(held),
            rotationMatrixAxes=np.eye(3) if axes is None else axes,
            useGlobalFrame=True,
        )

    def ball(self, a: Any, b: Any, at: Any) -> None:
        self.joint(a, b, at, [1, 1, 1, 0, 0, 0])

    def keep(self, a: Any, b: Any = None, **more: Any) -> Any:
        """A constraint of coordinates: of a alone, or of a and b."""
        return self.mbs.AddObject(
            items.ObjectConnectorCoordinate(markerNumbers=[self.fixed, a] if b is None else [a, b], **more)
        )

    # ------------------------------------------------------------ forces

    def spring(
        self, a: Any, pa: Any, b: Any, pb: Any, k: float, rest: float, c: float = 0, **more: Any
    ) -> Any:
        return self.mbs.CreateSpringDamper(
            bodyNumbers=[a, b],
            localPosition0=three(pa),
            localPosition1=three(pb),
            referenceLength=rest,
            stiffness=k,
            damping=c,
            **more,
        )

    def springs(self, a: Any, pa: Any, b: Any, pb: Any, k: Any, c: Any = (0, 0, 0), **more: Any) -> Any:
        """Springs along x, y and z."""
        return self.mbs.CreateCartesianSpringDamper(
            bodyNumbers=[a, b],
            localPosition0=three(pa),
            localPosition1=three(pb),
            stiffness=list(k),
            damping=list(c),
            **more,
        )

    def along(self, a: Any, b: Any = None, **more: Any) -> Any:
        """A spring between coordinates, or of one against the ground."""
        return self.mbs.AddObject(
            items.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[self.fixed, a] if b is None else [a, b], **more
            )
        )

    def load(self, marker: Any, value: float, law: Any = None) -> None:
        """A force along a coordinate; ``law``: of time."""
        more = {} if law is None else {"loadUserFunction": lambda mbs, t, load: law(t)}
        self.mbs.AddLoad(items.LoadCoordinate(markerNumber=marker, load=value, **more))

    def push(self, body: Any, force: Any, at: Any = (0, 0, 0), **more: Any) -> None:
        self.mbs.CreateForce(bodyNumber=body, loadVector=list(force), localPosition=three(at), **more)

    def twist(self, body: Any, torque: Any, **more: Any) -> None:
        self.mbs.CreateTorque(bodyNumber=body, loadVector=list(torque), **more)

    # ------------------------------------------------------------ trees

    def tree(self, links: Sequence[Link], g: Any = G, **more: Any) -> tuple[Any, Any]:
        """A tree of minimal coordinates: its node and its object."""
        n = len(links)
        node = self.mbs.AddNode(
            items.NodeGenericODE2(
                referenceCoordinates=[0.0] * n,
                initialCoordinates=[link.q for link in links],
                initialCoordinates_t=[link.v for link in links],
                numberOfODE2Coordinates=n,
            )
        )
        tree = self.mbs.AddObject(
            items.ObjectKinematicTree(
                nodeNumber=node,
                jointTypes=[link.kind for link in links],
                linkParents=[link.parent for link in links],
                jointTransformations=exu.Matrix3DList([link.turn for link in links]),
                jointOffsets=exu.Vector3DList([three(link.at) for link in links]),
                linkInertiasCOM=exu.Matrix3DList([link.J for link in links]),
                linkCOMs=exu.Vector3DList([three(link.com) for link in links]),
                linkMasses=[link.m for link in links],
                gravity=list(g),
                **more,
            )
        )
        return node, tree

    def on(self, tree: Any, link: int, local: Any) -> Any:
        return self.mbs.AddMarker(
            items.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=link, localPosition=three(local))
        )

    # ------------------------------------------------------------ what is read

    def where(self, *bodies: Any, local: Any = (0, 0, 0), flat: bool = False) -> list[float]:
        return [
            float(x)
            for b in bodies
            for x in self.mbs.GetObjectOutputBody(b, POSITION, three(local))[: 2 if flat else 3]
        ]

    def spin(self, *bodies: Any) -> list[float]:
        """Angular velocities in the axes of the bodies."""
        return [float(x) for b in bodies for x in self.mbs.GetObjectOutputBody(b, SPIN, [0, 0, 0])]

    def values(self, *nodes: Any) -> list[float]:
        return [float(x) for n in nodes for x in np.atleast_1d(self.mbs.GetNodeOutput(n, COORDINATES))]

    def marked(self, *markers: Any, flat: bool = False) -> list[float]:
        return [float(x) for m in markers for x in self.mbs.GetMarkerOutput(m, POSITION)[: 2 if flat else 3]]


class System:
    """A system, its end, and how Exudyn is to go there."""

    def __init__(self, make: Callable[[Scene], Read], stop: float, method: str, step: float) -> None:
        self.make, self.stop, self.method, self.step = make, stop, method, step


def implicit(make: Callable[[Scene], Read], stop: float, step: float) -> System:
    """By the trapezoidal rule, which is for constraints; ``step`` is the longest."""
    return System(make, stop, "implicit", step)


def explicit(make: Callable[[Scene], Read], stop: float, step: float) -> System:
    """By a Runge-Kutta method of order 6; ``step`` is the longer one."""
    return System(make, stop, "explicit", step)


def adaptive(make: Callable[[Scene], Read], stop: float) -> System:
    """By Dormand and Prince's method, whose steps become short where a force has a kink."""
    return System(make, stop, "adaptive", 0.0)


class Link:
    """A link of a tree: its joint, ``at`` and ``turn`` from the link before it, and its body."""

    def __init__(
        self,
        kind: str,
        m: float,
        J: Any,
        com: Any = (0, 0, 0),
        *,
        parent: int,
        at: Any = (0, 0, 0),
        turn: Any = None,
        q: float = 0,
        v: float = 0,
    ) -> None:
        self.kind = getattr(exu.JointType, kind)
        self.m, self.com, self.parent, self.at, self.q, self.v = m, com, parent, at, q, v
        self.J = np.diag(np.array(J, float)) if np.ndim(J) == 1 else np.array(J, float)
        self.turn = np.eye(3) if turn is None else np.array(turn)


def led(stiffness: Sequence[float], damping: Sequence[float], aim: Sequence[float] = ()) -> dict[str, Any]:
    """Springs and dampers of the joints of a tree, which aim at ``aim`` at rest."""
    return {
        "jointPControlVector": list(map(float, stiffness)),
        "jointDControlVector": list(map(float, damping)),
        "jointPositionOffsetVector": list(map(float, aim)) or [0.0] * len(stiffness),
        "jointVelocityOffsetVector": [0.0] * len(stiffness),
    }


def turned(angle: float, *v: float) -> np.ndarray:
    """A vector of the plane, turned."""
    return np.array((RotationMatrixZ(angle) @ three(v))[:2])


def three(v: Any) -> list[float]:
    """A place with the coordinates that are not said, which are 0."""
    return [*map(float, v), 0.0, 0.0, 0.0][:3]


def box(m: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Moments of inertia of a box."""
    return m / 12 * (y**2 + z**2), m / 12 * (x**2 + z**2), m / 12 * (x**2 + y**2)
