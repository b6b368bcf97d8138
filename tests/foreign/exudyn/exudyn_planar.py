"""Systems in a plane."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import exudyn.itemInterface as items
import numpy as np
from exudyn_forming import DOWN, Link, Read, Scene, explicit, implicit, led, turned

NONE = (0.0, 0.0, 0.0)


def row(s: Scene, n: int, m: float = 1, J: float = 1) -> list[Any]:
    """Links of 1 m in a row along x, each hinged to the one before."""
    links = [s.flat(m, J, (0.5 + k, 0)) for k in range(n)]
    for before, link in zip([s.ground, *links], links, strict=False):
        s.pin(before, (0, 0) if before is s.ground else (0.5, 0), link, (-0.5, 0))
    return links


def two_links(s: Scene) -> Read:
    links = row(s, 2)
    return lambda: s.where(*links, flat=True)


def four_links(s: Scene) -> Read:
    links = row(s, 4)
    return lambda: s.where(*links, flat=True)


def two_links_led(s: Scene) -> Read:
    links = row(s, 2)
    a, b = (s.of(link, 2) for link in links)
    for one, other, sign in ((a, None, 1), (a, b, -1)):

        def law(
            mbs: Any,
            t: float,
            item: int,
            u: float,
            v: float,
            k: float,
            d: float,
            offset: float,
            c: int = sign,
        ) -> float:
            aim, rate = np.pi / 2 * np.sin(np.pi / 2 * t), np.pi**2 / 4 * np.cos(np.pi / 2 * t)
            return float(k * (u - c * aim) + d * (v - c * rate))

        s.along(one, other, stiffness=5000, damping=100, springForceUserFunction=law)
    return lambda: s.where(*links, flat=True)


def eccentric_rotor(s: Scene) -> Read:
    speed = 0.5 * np.sqrt(4000 / 1.6)
    b = s.flat(1.6, 1.6 * 0.25, (0, 0.01), w=speed, g=NONE)
    s.springs(s.ground, (), b, (0, -0.01), (4000, 4000, 0), (0.8, 0.8, 0))
    return lambda: [100 * x for x in s.where(b, flat=True)] + s.where(b, local=(1, 0), flat=True)


def two_four_bars(s: Scene) -> Read:
    up = np.pi / 2
    bars = []
    for k in range(5):
        standing = k % 2 == 0
        x = k / 2 if standing else (k - 1) / 2 + 0.5
        v = (0.5, 0) if standing else (1, 0)
        bars.append(
            s.flat(1, 1 / 12, (x, 0.5 if standing else 1), up if standing else 0, v, -1 if standing else 0)
        )
    for k in (0, 2, 4):
        s.pin(s.ground, (k / 2, 0), bars[k], (-0.5, 0))
    for k in (1, 3):
        s.pin(bars[k - 1], (0.5, 0), bars[k], (-0.5, 0))
        s.pin(bars[k], (0.5, 0), bars[k + 1], (0.5, 0))
    return lambda: s.where(*bars, flat=True)


def crank_slider_and_spring(s: Scene) -> Read:
    up, lean = np.pi / 2, -np.arcsin(0.5)
    crank = s.flat(0.36, 0.0027, (0, 0.15), up, g=NONE)
    rod = s.flat(0.15, 0.0045, np.add(turned(lean, 0.3), (0, 0.3)), lean, g=NONE)
    x = 0.6 * np.cos(lean)
    slider, load = (
        s.mbs.CreateMassPoint(referencePosition=[at, 0, 0], physicsMass=m, create2D=True)
        for m, at in ((0.1, x), (0.7, x + 0.2))
    )
    s.pin(s.ground, (0, 0), crank, (-0.15, 0))
    s.pin(crank, (0.15, 0), rod, (-0.3, 0))
    s.mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[s.place(rod, (0.3, 0)), s.point(slider)]))
    s.keep(s.of(slider, 1))
    s.keep(s.of(load, 1))
    s.along(s.of(slider, 0), s.of(load, 0), stiffness=1000)
    s.load(s.of(crank, 2), 1)
    return lambda: s.where(crank, rod, slider, load, flat=True)


def scissors(s: Scene) -> Read:
    g = (3.0, -9.81, 0.0)
    arms = []
    for k in range(2):
        at = (k * 0.8, 0)
        arms.append((s.flat(1, 0.1, at, 0.6, g=g), s.flat(1, 0.1, at, -0.6, g=g)))
    h = 0.8 / 2 / np.cos(0.6)
    s.pin(s.ground, (0, 0), arms[0][0], (0, 0))
    for a, b in arms:
        s.mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[s.place(a), s.place(b)]))
    s.pin(arms[0][0], (h, 0), arms[1][1], (-h, 0))
    s.pin(arms[0][1], (h, 0), arms[1][0], (-h, 0))
    s.keep(s.of(arms[0][0], 2), s.of(arms[0][1], 2), factorValue1=-1)
    s.along(s.of(arms[0][0], 2), stiffness=40, damping=2, offset=0.4)
    return lambda: s.where(*(b for pair in arms for b in pair), flat=True)


def oil(s: Scene, a: Any, b: Any, length: float, valve: tuple[float, float], modulus: float) -> Any:
    """An actuator with two chambers, whose pressures are states."""
    node = s.mbs.AddNode(
        items.NodeGenericODE1(
            referenceCoordinates=[0, 0], initialCoordinates=[2e6, 2e6], numberOfODE1Coordinates=2
        )
    )
    s.mbs.AddObject(
        items.HydraulicActuatorSimple(
            markerNumbers=[a, b],
            nodeNumbers=[node],
            offsetLength=length,
            strokeLength=length,
            chamberCrossSection0=0.01,
            chamberCrossSection1=0.008,
            hoseVolume0=1.0,
            hoseVolume1=1.0,
            valveOpening0=valve[0],
            valveOpening1=valve[1],
            oilBulkModulus=modulus,
            actuatorDamping=2e5,
            nominalFlow=2e-5,
            systemPressure=2e7,
            tankPressure=1e5,
            useChamberVolumeChange=False,
        )
    )
    return node


def arm_on_oil(s: Scene) -> Read:
    node, tree = s.tree([Link("RevoluteZ", 120, (1, 10, 10), (0.5, 0), parent=-1)], DOWN)
    pressures = oil(
        s, s.place(s.ground, (0, -0.25)), s.on(tree, 0, (0.25, 0)), np.sqrt(0.125), (0.1, -0.1), 1e9
    )
    return lambda: s.values(node) + [1e-7 * p for p in s.values(pressures)]


def two_arms_on_oil(s: Scene) -> Read:
    links = [
        Link("RevoluteZ", 120, (1, 10, 10), (0.5, 0), parent=-1),
        Link("RevoluteZ", 120, (1, 10, 10), (0.5, 0), parent=0, at=(1, 0, 0), q=-np.pi / 2),
    ]
    node, tree = s.tree(links, DOWN)
    first = oil(s, s.place(s.ground, (0, -0.3)), s.on(tree, 0, (0.25, -0.05)), 0.35, (0.15, -0.1), 1e9)
    second = oil(s, s.on(tree, 0, (0.75, -0.05)), s.on(tree, 1, (0.25, -0.05)), 0.28, (-0.1, 0.1), 1e9)
    return lambda: s.values(node) + [1e-7 * p for p in s.values(first, second)]


def rod_rubbing_at_its_tip(s: Scene) -> Read:
    J = 2.5 * (0.8**2 + 0.025**2) / 12
    node, tree = s.tree([Link("RevoluteZ", 2.5, (J, J, J), (0.4, 0), parent=-1)], DOWN)

    def law(mbs: Any, t: float, item: int, u: Any, v: Any, k: Any, d: Any, offset: Any) -> list[float]:
        return [float(x) for x in 3 * np.array(v) / np.sqrt(np.dot(v, v) + 0.01)]

    s.mbs.AddObject(
        items.ObjectConnectorCartesianSpringDamper(
            markerNumbers=[s.place(s.ground), s.on(tree, 0, (0.8, 0))], springForceUserFunction=law
        )
    )
    return lambda: s.values(node)


def bars_for_a_beam(s: Scene) -> Read:
    bars = [s.flat(0.5, 0.002, (0.1 + 0.2 * k, 0)) for k in range(5)]
    s.pin(s.ground, (0, 0), bars[0], (-0.1, 0))
    s.along(s.of(bars[0], 2), stiffness=400, damping=0.4)
    for a, b in pairwise(bars):
        s.pin(a, (0.1, 0), b, (-0.1, 0))
        s.along(s.of(a, 2), s.of(b, 2), stiffness=200, damping=0.2)
    s.push(bars[-1], (0, -5, 0), (0.1, 0))
    return lambda: s.where(*bars, flat=True)


def crank_at_one_speed(s: Scene) -> Read:
    w = 2 * np.pi
    crank = s.flat(2, 0.03, (0.1, 0), 0, (0, 0.1 * w), w)
    rod = s.flat(1, 0.025, (0.45, 0), 0, (0, 0.1 * w), -0.2 * w / 0.5)
    piston = s.mbs.CreateMassPoint(referencePosition=[0.7, 0, 0], physicsMass=0.5, create2D=True)
    s.pin(s.ground, (0, 0), crank, (-0.1, 0))
    s.pin(crank, (0.1, 0), rod, (-0.25, 0))
    s.mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[s.place(rod, (0.25, 0)), s.point(piston)]))
    s.keep(s.of(piston, 1))
    s.mbs.AddObject(
        items.ObjectConnectorCoordinate(markerNumbers=[s.fixed, s.of(crank, 2)], offset=w, velocityLevel=True)
    )
    load = s.mbs.CreateMassPoint(referencePosition=[1, 0, 0], physicsMass=2, create2D=True)
    s.keep(s.of(load, 1))
    s.along(s.of(piston, 0), s.of(load, 0), stiffness=50, damping=1)
    return lambda: s.where(crank, rod, piston, load, flat=True)


def cart_and_poles(s: Scene) -> Read:
    links = [
        Link("PrismaticX", 2, (1, 1, 1), parent=-1),
        Link("RevoluteZ", 0.5, (0.01, 0.01, 0.02), (0, 0.3), parent=0, q=0.1),
        Link("RevoluteZ", 0.4, (0.01, 0.01, 0.02), (0, 0.3), parent=1, at=(0, 0.6, 0), q=-0.2),
        Link("RevoluteZ", 0.3, (0.01, 0.01, 0.02), (0, 0.3), parent=2, at=(0, 0.6, 0), q=0.1),
    ]
    node, _ = s.tree(links, DOWN)
    s.load(
        s.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0)),
        0,
        lambda t: 5 * np.sin(3 * t),
    )
    return lambda: s.values(node)


def tree_closed_to_four_bars(s: Scene) -> Read:
    q = [np.pi / 2, -np.pi / 2 + 0.2, 0.0]
    knee = turned(q[0], 0.4) + turned(q[0] + q[1], 0.8)
    foot = np.array([0.9, 0.0])
    last = np.arctan2(*(foot - knee)[::-1])
    length = float(np.linalg.norm(foot - knee))
    q[2] = last - q[0] - q[1]
    links = [
        Link("RevoluteZ", 1, (0, 0.01, 0.02), (0.2, 0), parent=-1, q=q[0]),
        Link("RevoluteZ", 2, (0, 0.01, 0.1), (0.4, 0), parent=0, at=(0.4, 0, 0), q=q[1]),
        Link("RevoluteZ", 1.5, (0, 0.01, 0.03), (length / 2, 0), parent=1, at=(0.8, 0, 0), q=q[2]),
    ]
    node, tree = s.tree(links, DOWN)
    s.mbs.AddObject(
        items.ObjectJointSpherical(
            markerNumbers=[s.on(tree, 2, (length, 0)), s.place(s.ground, foot)], constrainedAxes=[1, 1, 0]
        )
    )
    s.load(
        s.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0)),
        0,
        lambda t: -4 * np.cos(2 * t),
    )
    return lambda: s.values(node)


def chain_behind_a_slider(s: Scene) -> Read:
    links = [Link("PrismaticX", 25, (1, 1, 1), parent=-1, v=0.5)]
    for k in range(4):
        q = -np.pi / 2 if k == 0 else 0.0
        links.append(
            Link("RevoluteZ", 5, (0.1, 0.01, 0.11), (0, 0.25), parent=k, at=(0, 0.5 if k else 0, 0), q=q)
        )
    node, tree = s.tree(
        links,
        DOWN,
        **led((20000, 0, 0, 0, 0), (400, 0, 0, 0, 0)),
    )
    s.mbs.AddObject(
        items.ObjectJointSpherical(
            markerNumbers=[s.on(tree, 4, (0, 0.5)), s.place(s.ground, (2, 0))], constrainedAxes=[0, 1, 0]
        )
    )
    return lambda: s.values(node)


def radial_engine(s: Scene) -> Read:
    crank = s.flat(3, 0.02, (0, 0), g=NONE)
    s.pin(s.ground, (0, 0), crank, (0, 0))
    parts = []
    for k in range(4):
        phi = k * np.pi / 2
        pin = np.array([0.1, 0.0])
        along = turned(phi, 1)
        across = turned(phi, 0, 1)
        reach = float(pin @ along + np.sqrt(0.25 - (pin @ across) ** 2))
        head = reach * along
        angle = float(np.arctan2(*(head - pin)[::-1]))
        rod = s.flat(0.8, 0.017, (pin + head) / 2, angle, g=NONE)
        piston = s.mbs.CreateMassPoint(
            referencePosition=[*head, 0], physicsMass=0.3 if k == 3 else 0.2, create2D=True
        )
        s.pin(crank, (0.1, 0), rod, (-0.25, 0))
        s.mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[s.place(rod, (0.25, 0)), s.point(piston)]))
        s.keep(s.of(piston, 1 - k % 2))
        parts += [rod, piston]
    node, wheel = s.coordinate(0.05)
    s.keep(s.of(crank, 2), wheel, factorValue1=-1 / 3)
    s.along(wheel, stiffness=0, damping=0.05)
    s.load(s.of(crank, 2), 0, lambda t: 20 * np.sin(3 * t))
    return lambda: s.where(*parts, flat=True) + s.values(node)


def branching_tree(s: Scene) -> Read:
    links = [
        Link("PrismaticX", 0, (0, 0, 0), parent=-1),
        Link("PrismaticY", 0, (0, 0, 0), parent=0, v=3),
        Link("RevoluteZ", 4, (0, 0, 0.2), (0.05, 0.02), parent=1, q=0.2, v=1),
    ]
    for side in (-1, 1):
        n = len(links)
        links += [
            Link("RevoluteZ", 1, (0, 0, 0.02), (0, -0.2), parent=2, at=(0.25 * side, -0.1, 0), q=0.3 * side),
            Link("RevoluteZ", 0.6, (0, 0, 0.01), (0, -0.15), parent=n, at=(0, -0.4, 0), q=-0.4, v=side),
        ]
    node, _ = s.tree(
        links,
        DOWN,
        **led((0, 0, 0, 30, 20, 30, 20), (0, 0, 0, 0.3, 0.2, 0.3, 0.2), (0, 0, 0, -0.5, 0.8, 0.5, 0.4)),
    )
    return lambda: s.values(node)


SYSTEMS = {
    "two_links": implicit(two_links, 1.0, 5e-4),
    "four_links": implicit(four_links, 1.0, 2e-4),
    "two_links_led": implicit(two_links_led, 1.0, 2e-4),
    "eccentric_rotor": explicit(eccentric_rotor, 1.0, 1e-3),
    "two_four_bars": implicit(two_four_bars, 0.5, 5e-4),
    "crank_slider_and_spring": implicit(crank_slider_and_spring, 0.5, 2e-4),
    "scissors": implicit(scissors, 0.5, 2e-4),
    "arm_on_oil": explicit(arm_on_oil, 0.5, 1e-4),
    "two_arms_on_oil": explicit(two_arms_on_oil, 0.5, 1e-4),
    "rod_rubbing_at_its_tip": explicit(rod_rubbing_at_its_tip, 0.8, 1e-3),
    "bars_for_a_beam": implicit(bars_for_a_beam, 0.5, 2e-4),
    "crank_at_one_speed": implicit(crank_at_one_speed, 1.2, 5e-4),
    "cart_and_poles": explicit(cart_and_poles, 1.0, 1e-3),
    "tree_closed_to_four_bars": implicit(tree_closed_to_four_bars, 0.5, 2e-4),
    "chain_behind_a_slider": implicit(chain_behind_a_slider, 0.4, 2e-4),
    "radial_engine": implicit(radial_engine, 0.5, 2e-4),
    "branching_tree": explicit(branching_tree, 0.8, 5e-4),
}
