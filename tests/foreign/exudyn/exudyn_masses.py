"""Systems of points, coordinates and states of the first order."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import exudyn.itemInterface as items
import numpy as np
from exudyn_forming import DOWN, G, Link, Read, Scene, adaptive, explicit, implicit


def spring_for_two_seconds(s: Scene) -> Read:
    m = s.mass(10, (1, 0, 0), (1, 0, 0))
    s.spring(s.ground, (), m, (), 1000, 1)
    return lambda: [s.where(m)[0] - 1]


def hardening_spring(s: Scene) -> Read:
    node, q = s.coordinate(5)
    s.along(
        q,
        stiffness=5000,
        damping=80,
        springForceUserFunction=lambda mbs, t, item, u, v, k, d, offset: 0.1 * k * u + k * u**3 + d * v,
    )
    s.load(q, 1)
    return lambda: s.values(node)


def slider_on_a_spring(s: Scene) -> Read:
    b = s.body(1, (1, 1, 1), (0, 0, 0), g=(0, 0, 0))
    s.mbs.CreatePrismaticJoint(
        bodyNumbers=[s.ground, b], position=[0, 0, 0], axis=[1, 0, 0], useGlobalFrame=True
    )
    s.mbs.CreateLinearSpringDamper(
        itemNumbers=[s.ground, b],
        position=[0, 0, 0],
        axis=[1, 0, 0],
        stiffness=2000,
        damping=20,
        useGlobalFrame=True,
    )
    s.push(b, (1, 0, 0))
    return lambda: s.where(b)[:1]


def twelve_in_a_row(s: Scene) -> Read:
    nodes, before = [], None
    for _ in range(12):
        node, q = s.coordinate(1)
        s.along(*([q] if before is None else [before, q]), stiffness=800, damping=2)
        nodes.append(node)
        before = q
    s.load(before, 0, lambda t: 10 * np.sin(3.55 * t))
    return lambda: s.values(*nodes)


def thrown(s: Scene) -> Read:
    m = s.mass(2, (1, 0, 0), (2, 5, 0.5), G)
    return lambda: s.where(m)


def seen_from_the_origin(s: Scene) -> Read:
    m = s.mass(1, (1, 0, 0), (0, 1, 0))

    def read() -> list[float]:
        x, y, _ = s.where(m)
        return [float(np.arctan2(y, x))]

    return read


def hard_springs_in_space(s: Scene) -> Read:
    m = s.mass(5, (0, 0, 0), (0.8, -0.6, 0.5), G)

    def law(mbs: Any, t: float, item: int, u: Any, v: Any, k: Any, d: Any, offset: Any) -> list[float]:
        return [k[i] * (u[i] + 20 * u[i] ** 3) + d[i] * v[i] for i in range(3)]

    s.springs(s.ground, (), m, (), (300, 400, 500), (3, 4, 5), springForceUserFunction=law)
    return lambda: s.where(m)


def friction_that_weakens(s: Scene) -> Read:
    node, q = s.coordinate(1)

    def law(mbs: Any, t: float, item: int, u: float, v: float, k: float, d: float, offset: float) -> float:
        return float(k * u + 20 * (1 + 0.5 * np.exp(-abs(v))) * np.tanh(v / 0.1))

    s.along(q, stiffness=1600, springForceUserFunction=law)
    s.load(q, 0, lambda t: 120 + 80 * np.cos(2 * np.pi * t))
    return lambda: s.values(node)


def mass_on_a_band(s: Scene) -> Read:
    node, q = s.coordinate(0.5, 0, 4)

    def law(mbs: Any, t: float, item: int, u: float, v: float, k: float, d: float, offset: float) -> float:
        slip = v - 4
        return float(k * u + d * v + (40 + 10 * np.exp(-abs(slip) / 0.5)) * np.tanh(slip / 0.1))

    s.along(q, stiffness=400, damping=0.05, springForceUserFunction=law)
    return lambda: s.values(node)


def bristles(s: Scene) -> Read:
    node = s.mbs.AddNode(
        items.NodeGenericODE1(
            referenceCoordinates=[0, 0, 0], initialCoordinates=[0, 0, 0], numberOfODE1Coordinates=3
        )
    )

    def law(mbs: Any, t: float, item: int, q: Any) -> list[float]:
        x, v, z = q
        rate = v - z * abs(v) * 1e5 / (1 + 0.5 * np.exp(-((v / 0.001) ** 2)))
        return [v, 2 * (0.1 * t - x) - (1e5 * z + np.sqrt(1e5) * rate + 0.4 * v), rate]

    s.mbs.AddObject(items.ObjectGenericODE1(nodeNumbers=[node], rhsUserFunction=law))
    return lambda: s.values(node)


def floor_that_gives(s: Scene) -> Read:
    node, q = s.coordinate(0.25, 0.05)

    def law(mbs: Any, t: float, item: int, u: float, v: float, k: float, d: float, offset: float) -> float:
        return k * u if u < 0 else 0.0

    s.along(q, stiffness=20000, springForceUserFunction=law)
    s.load(q, -0.25 * 9.81)
    return lambda: s.values(node)


def stops_at_both_ends(s: Scene) -> Read:
    node, q = s.coordinate(0.5, 0, 10)

    def law(mbs: Any, t: float, item: int, u: float, v: float, k: float, d: float, offset: float) -> float:
        beyond = max(u - 0.9, 0.0) + min(u + 0.9, 0.0)
        return k * u + d * v + 1e4 * beyond * (1 + 0.05 * abs(v))

    s.along(q, stiffness=100, damping=0.5, springForceUserFunction=law)
    return lambda: s.values(node)


def soft_mesh(s: Scene) -> Read:
    a, qa = s.coordinate(1, 0, 2 * np.pi)
    b, qb = s.coordinate(1, 0, -2 * np.pi / 3)
    s.mbs.AddObject(
        items.ObjectConnectorCoordinateSpringDamperExt(
            markerNumbers=[qb, qa], stiffness=1e3, damping=10, factor0=1, factor1=-1 / 3
        )
    )
    s.mbs.AddObject(
        items.ObjectConnectorCoordinate(markerNumbers=[qb, s.fixed], offset=2 * np.pi / 3, velocityLevel=True)
    )
    s.load(qa, -10)
    return lambda: s.values(a, b)


def three_stars(s: Scene) -> Read:
    bodies = [
        s.mass(m, at, v)
        for m, at, v in (
            (4, (0, 0, 0), (0, -0.3, 0.02)),
            (1, (1, 0, 0), (0, 1, 0)),
            (2, (0, 1.5, 0.3), (-0.6, 0, 0.1)),
        )
    ]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        masses = (4, 1, 2)
        s.mbs.AddObject(
            items.ObjectConnectorGravity(
                markerNumbers=[s.point(bodies[i]), s.point(bodies[j])],
                gravitationalConstant=0.25,
                mass0=masses[i],
                mass1=masses[j],
            )
        )
    return lambda: s.where(*bodies)


def only_pushing(k: float, near: float, power: float) -> Any:
    """The law of a spring that only pushes, below a distance."""
    return lambda mbs, t, item, x, v, _, c, f: float(-k * max(near - x, 0.0) ** power)


def balls_that_meet(s: Scene) -> Read:
    balls = [
        s.mass(1, (-0.5, 0, 0), (1, 0.05, 0)),
        s.mass(1.5, (0.5, 0.1, 0), (-1, 0, 0.05)),
        s.mass(2, (0, -0.4, 0.05), (0, 1, 0)),
    ]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        s.spring(balls[i], (), balls[j], (), 1, 0, springForceUserFunction=only_pushing(3e4, 0.2, 1.5))
    return lambda: s.where(*balls)


def cradle(s: Scene) -> Read:
    pitch, m, r = 2 * 0.02 * 1.02, 7800 * 4 / 3 * np.pi * 0.02**3, 0.02
    J = 0.4 * m * r**2
    links = [
        Link("RevoluteZ", m, (J, J, J), (0, -0.25, 0), parent=-1, at=(k * pitch, 0, 0), q=q)
        for k, q in enumerate((0, 0, 1.0))
    ]
    node, tree = s.tree(links, DOWN)
    balls = [s.on(tree, k, (0, -0.25)) for k in range(3)]
    for a, b in pairwise(balls):
        s.mbs.AddObject(
            items.ObjectConnectorSpringDamper(
                markerNumbers=[a, b], springForceUserFunction=only_pushing(1e6, 2 * r, 1.5)
            )
        )
    return lambda: s.values(node)


CORNERS = [(x, y, z) for x in (0.0, 0.1, 0.2) for y in (0.0, 0.2) for z in (0.0, 0.2)]
PAIRS = [
    (a, b)
    for a in range(12)
    for b in range(max(a + 1, 4), 12)
    if np.linalg.norm(np.subtract(CORNERS[a], CORNERS[b])) < 0.23
]
"""Of a block of points, the first four of which are fixed: neighbours and the ends of short diagonals."""


def block_of_points(s: Scene) -> Read:
    points = [s.mass(0.1, at, g=DOWN) for at in CORNERS[4:]]
    for a, b in PAIRS:
        one, at = (s.ground, CORNERS[a]) if a < 4 else (points[a - 4], ())
        length = float(np.linalg.norm(np.subtract(CORNERS[a], CORNERS[b])))
        s.spring(one, at, points[b - 4], (), 200, length, 0.1)
    return lambda: s.where(*points[-4:])


def train_of_gears(s: Scene) -> Read:
    wheels = [s.coordinate(J) for J in (0.3, 0.004, 0.3, 0.004, 0.5)]
    marks = [q for _, q in wheels]
    s.keep(marks[0], marks[1], factorValue1=-1 / 3)
    s.keep(marks[1], marks[2], factorValue1=1)
    s.keep(marks[2], marks[3], factorValue1=-1 / 3)
    s.along(marks[3], marks[4], stiffness=50, damping=0.2)
    s.load(marks[0], 0, lambda t: 40 * np.sin(4 * t))
    return lambda: s.values(*(n for n, _ in wheels))


def two_points_on_functions(s: Scene) -> Read:
    node = s.mbs.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=[0] * 4,
            initialCoordinates=[0.8, 0, 1.6, 0],
            initialCoordinates_t=[0] * 4,
            numberOfODE2Coordinates=4,
        )
    )
    body = s.mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=[node], massMatrix=2.5 * np.eye(4), forceVector=[0, -2.5 * 9.81] * 2
        )
    )
    ground = s.mbs.AddMarker(items.MarkerNodeCoordinates(nodeNumber=s.mbs.AddNode(items.NodePointGround())))

    def law(mbs: Any, t: float, item: int, q: Any, v: Any, rate: bool) -> list[float]:
        if rate:
            return list(slope(mbs, t, item, q, v, rate) @ v)
        return [np.hypot(q[0], q[1]) - 0.8, np.hypot(q[2] - q[0], q[3] - q[1]) - 0.8]

    def slope(mbs: Any, t: float, item: int, q: Any, v: Any, rate: bool) -> np.ndarray:
        a, b = np.array([q[0], q[1]]), np.array([q[2] - q[0], q[3] - q[1]])
        a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
        return np.array([[*a, 0, 0], [*-b, *b]])

    s.mbs.AddObject(
        items.CoordinateVectorConstraint(
            markerNumbers=[ground, s.mbs.AddMarker(items.MarkerObjectODE2Coordinates(objectNumber=body))],
            scalingMarker0=np.zeros((2, 4)),
            constraintUserFunction=law,
            jacobianUserFunction=slope,
        )
    )
    return lambda: s.values(node)


def hung_on_a_moving_end(s: Scene) -> Read:
    a, qa = s.coordinate(1, 0, 0.2)
    b, qb = s.coordinate(2)
    s.keep(
        qa,
        offsetUserFunction=lambda mbs, t, item, offset: 0.05 * np.sin(4 * t),
        offsetUserFunction_t=lambda mbs, t, item, offset: 0.2 * np.cos(4 * t),
    )
    s.along(qa, qb, stiffness=100, damping=1)
    s.load(qb, -2 * 9.81)
    return lambda: s.values(a, b)


def pendulum_of_a_point(s: Scene) -> Read:
    m = s.mass(1, (-1, 0, 0), g=DOWN)
    s.mbs.CreateDistanceConstraint(bodyNumbers=[s.ground, m], distance=1)
    return lambda: s.where(m)[:2]


SYSTEMS = {
    "spring_for_two_seconds": explicit(spring_for_two_seconds, 2.0, 0.001),
    "hardening_spring": explicit(hardening_spring, 1.0, 0.001),
    "slider_on_a_spring": implicit(slider_on_a_spring, 1.0, 5e-4),
    "twelve_in_a_row": explicit(twelve_in_a_row, 2.0, 0.002),
    "thrown": explicit(thrown, 1.0, 0.01),
    "seen_from_the_origin": explicit(seen_from_the_origin, 1.0, 0.01),
    "hard_springs_in_space": explicit(hard_springs_in_space, 1.0, 0.001),
    "friction_that_weakens": explicit(friction_that_weakens, 1.0, 2e-4),
    "mass_on_a_band": adaptive(mass_on_a_band, 1.0),
    "bristles": adaptive(bristles, 9.0),
    "floor_that_gives": explicit(floor_that_gives, 0.25, 1e-5),
    "stops_at_both_ends": adaptive(stops_at_both_ends, 1.0),
    "soft_mesh": implicit(soft_mesh, 1.0, 5e-4),
    "three_stars": explicit(three_stars, 2.0, 0.002),
    "balls_that_meet": explicit(balls_that_meet, 1.0, 2e-5),
    "cradle": adaptive(cradle, 1.0),
    "block_of_points": explicit(block_of_points, 0.5, 0.0005),
    "train_of_gears": implicit(train_of_gears, 1.0, 5e-4),
    "two_points_on_functions": implicit(two_points_on_functions, 1.0, 5e-4),
    "hung_on_a_moving_end": implicit(hung_on_a_moving_end, 1.0, 5e-4),
    "pendulum_of_a_point": implicit(pendulum_of_a_point, 2.0, 5e-4),
}
