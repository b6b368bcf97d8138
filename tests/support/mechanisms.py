"""Mechanisms of any size as residuals in central form, built on the graph alone.

Symbols: q, u, a (coordinates, velocities, accelerations), m, l, J (mass, length, inertia), g, each with a
number; lam for multipliers.
"""

from __future__ import annotations

import random

import numpy as np
from msgspec import Struct, field

from mechc.compiler.graph import Graph, Node
from mechc.compiler.graph import vector as vec
from mechc.compiler.graph.differentiate import jacobian, jvp, vjp
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.graph.vector import Matrix, Vector


class Mechanism(Struct):
    """``residuals`` vanish at the right ``a``; ``constraints`` are positions phi = 0 (none for a tree)."""

    graph: Graph
    q: list[Node]
    u: list[Node]
    a: list[Node]
    residuals: list[Node]
    constraints: list[Node] = field(default_factory=list)

    def environment(self, seed: int = 1, spread: float = 1.0) -> dict[Node, float]:
        """Return random values for all symbols: positive parameters, coordinates within ``spread``."""
        rng = random.Random(seed)
        nodes = self.graph.support(*self.residuals, *self.constraints, *self.q, *self.u)
        values = {n: rng.uniform(*_range(self.graph.name(n))) for n in nodes}
        return values | {n: spread * values[n] for n in self.q if n in values}


def _range(name: str) -> tuple[float, float]:
    """Return sensible bounds for a symbol; products of inertia (J.._3 to J.._5) stay small."""
    match name[0]:
        case "J" if name[-2:] in ("_3", "_4", "_5"):
            return -0.02, 0.02
        case "J":
            return 0.05, 0.15
        case "m" | "l" if not name.startswith("lam"):
            return 0.5, 1.5
        case "d":
            return 0.9, 1.1
        case "g":
            return 9.0, 10.0
        case _:
            return -1.0, 1.0


def symbols(graph: Graph, letter: str, count: int) -> list[Node]:
    return [graph.symbol(f"{letter}{i}") for i in range(count)]


def chain_parents(count: int) -> list[int]:
    return [i - 1 for i in range(count)]


def planar_tree(graph: Graph, parents: list[int], *, joint_angles: bool, rigid: bool) -> Mechanism:
    """Links hinged to the tip of their parent, with point masses at the tips or as uniform-ish bars."""
    count = len(parents)
    q, u, a = (symbols(graph, c, count) for c in "qua")
    g = graph.symbol("g")
    tips: list[tuple[Node, Node, Node]] = []
    points: list[Node] = []
    angles: list[Node] = []
    for i, parent in enumerate(parents):
        x, y, angle = tips[parent] if parent >= 0 else (graph.zero, graph.zero, graph.zero)
        length = graph.symbol(f"l{i}")
        angle = graph.add(angle, q[i]) if joint_angles else q[i]
        dx = graph.mul(length, graph.sin(angle))
        dy = graph.mul(length, graph.cos(angle))
        tip = (graph.add(x, dx), graph.sub(y, dy), angle)
        tips.append(tip)
        if rigid:
            points += (graph.add(x, graph.mul(graph.half, dx)), graph.sub(y, graph.mul(graph.half, dy)))
            angles.append(angle)
        else:
            points += tip[:2]
    along = dict(zip(q, u, strict=True))
    along_twice = along | dict(zip(u, a, strict=True))
    velocities = jvp(graph, points + angles, along)
    accelerations = jvp(graph, velocities, along_twice)
    seeds = []
    for i in range(count):
        m = graph.symbol(f"m{i}")
        ax, ay = accelerations[2 * i : 2 * i + 2]
        seeds.append((velocities[2 * i], graph.mul(m, ax)))
        seeds.append((velocities[2 * i + 1], graph.mul(m, graph.add(ay, g))))
    for i in range(len(angles)):
        inertia = graph.symbol(f"J{i}")
        seeds.append((velocities[2 * count + i], graph.mul(inertia, accelerations[2 * count + i])))
    return Mechanism(graph, q, u, a, vjp(graph, seeds, u))


class Motion(Struct):
    """Of a frame, in its own axes: angular velocity and acceleration, velocity and acceleration less gravity."""

    w: Vector
    v: Vector
    alpha: Vector
    acc: Vector


def at_offset(graph: Graph, motion: Motion, r: Vector) -> tuple[Vector, Vector]:
    """Return velocity and acceleration of the point at ``r``."""
    turned = vec.cross(graph, motion.w, r)
    velocity = vec.add(graph, motion.v, turned)
    acceleration = vec.add(graph, motion.acc, vec.cross(graph, motion.alpha, r))
    return velocity, vec.add(graph, acceleration, vec.cross(graph, motion.w, turned))


def rotated(graph: Graph, motion: Motion, r: Matrix, relative: Vector, rate: Vector) -> Motion:
    """Return the motion in axes turned by ``r`` with angular velocity ``relative`` (new axes)."""
    w, v, alpha, acc = (
        vec.transpose_matvec(graph, r, x) for x in (motion.w, motion.v, motion.alpha, motion.acc)
    )
    alpha = vec.add(graph, vec.add(graph, alpha, rate), vec.cross(graph, w, relative))
    return Motion(vec.add(graph, w, relative), v, alpha, acc)


def body_seeds(
    graph: Graph, motion: Motion, m: Node, centre: Vector, inertia: Matrix
) -> list[tuple[Node, Node]]:
    velocity, acceleration = at_offset(graph, motion, centre)
    moment = vec.matvec(graph, inertia, motion.alpha)
    spin = vec.matvec(graph, inertia, motion.w)
    moment = vec.add(graph, moment, vec.cross(graph, motion.w, spin))
    force = vec.scale(graph, m, acceleration)
    return [*zip(velocity, force, strict=True), *zip(motion.w, moment, strict=True)]


def ground(graph: Graph) -> Motion:
    zero = (graph.zero,) * 3
    return Motion(zero, zero, zero, (graph.zero, graph.symbol("g"), graph.zero))


def spatial_tree(graph: Graph, parents: list[int], *, tip_fixed: bool = False) -> Mechanism:
    """Revolute joints about x, y, z in turn; each body with its centre below the joint, diagonal inertia.

    ``tip_fixed``: the tip of the last body has three multipliers, which follow ``a``.
    """
    count = len(parents)
    q, u, a = (symbols(graph, c, count) for c in "qua")
    zero = graph.zero
    motions: list[Motion] = []
    seeds: list[tuple[Node, Node]] = []
    for i, parent in enumerate(parents):
        motion = motions[parent] if parent >= 0 else ground(graph)
        if parent >= 0:
            v, acc = at_offset(graph, motion, (zero, graph.minus_one, zero))
            motion = Motion(motion.w, v, motion.alpha, acc)
        axis = i % 3
        relative = tuple(u[i] if k == axis else zero for k in range(3))
        rate = tuple(a[i] if k == axis else zero for k in range(3))
        motion = rotated(graph, motion, vec.axis_rotation(graph, axis, q[i]), relative, rate)
        motions.append(motion)
        about, along = graph.symbol(f"J{i}"), graph.symbol(f"JK{i}")
        inertia = ((about, zero, zero), (zero, along, zero), (zero, zero, about))
        centre = (zero, graph.neg(graph.symbol(f"l{i}")), zero)
        seeds += body_seeds(graph, motion, graph.symbol(f"m{i}"), centre, inertia)
    if not tip_fixed:
        return Mechanism(graph, q, u, a, vjp(graph, seeds, u))
    velocity, _ = at_offset(graph, motions[-1], (zero, graph.minus_one, zero))
    lam = symbols(graph, "lam", 3)
    seeds += [(v, graph.neg(n)) for v, n in zip(velocity, lam, strict=True)]
    rates = jvp(graph, velocity, dict(zip(q, u, strict=True)) | dict(zip(u, a, strict=True)))
    return Mechanism(graph, q, u, a + lam, vjp(graph, seeds, u) + rates)


def general_body(graph: Graph, motion: Motion, name: str) -> list[tuple[Node, Node]]:
    """Return the seeds of a body with any centre and full inertia."""
    centre = tuple(graph.symbol(f"c{name}_{k}") for k in range(3))
    j = [graph.symbol(f"J{name}_{k}") for k in range(6)]
    inertia = ((j[0], j[3], j[4]), (j[3], j[1], j[5]), (j[4], j[5], j[2]))
    return body_seeds(graph, motion, graph.symbol(f"m{name}"), centre, inertia)


def spherical_hub(graph: Graph, children: int) -> Mechanism:
    """A free body with bodies on spherical joints (quaternions, body angular velocities), all general."""
    zero = graph.zero
    u, a = (symbols(graph, c, 6 + 3 * children) for c in "ua")
    quaternions = [[graph.symbol(f"p{i}_{k}") for k in range(4)] for i in range(children + 1)]
    # velocity of the hub's origin in its own axes
    gravity = (zero, graph.symbol("g"), zero)
    orientation = vec.quaternion_rotation(graph, quaternions[0])
    w, v, alpha = tuple(u[3:6]), tuple(u[:3]), tuple(a[3:6])
    acc = vec.add(graph, tuple(a[:3]), vec.cross(graph, w, v))
    acc = vec.add(graph, acc, vec.transpose_matvec(graph, orientation, gravity))
    hub = Motion(w, v, alpha, acc)
    seeds = general_body(graph, hub, "h")
    for i in range(children):
        v, acc = at_offset(graph, hub, tuple(graph.symbol(f"o{i}_{k}") for k in range(3)))
        block = slice(6 + 3 * i, 9 + 3 * i)
        turned = vec.quaternion_rotation(graph, quaternions[i + 1])
        child = rotated(graph, Motion(hub.w, v, hub.alpha, acc), turned, tuple(u[block]), tuple(a[block]))
        seeds += general_body(graph, child, str(i))
    return Mechanism(graph, [n for p in quaternions for n in p], u, a, vjp(graph, seeds, u))


class _Bars(Struct):
    """Planar bars collected one by one: centres and angles, and which body is where."""

    graph: Graph
    points: list[Node] = field(default_factory=list)
    angles: list[Node] = field(default_factory=list)

    def bar(self, start: tuple[Node, Node], angle: Node) -> tuple[Node, Node]:
        """Add a bar and return its far end."""
        g = self.graph
        length = g.symbol(f"l{len(self.angles)}")
        dx, dy = g.mul(length, g.cos(angle)), g.mul(length, g.sin(angle))
        self.points += (g.add(start[0], g.mul(g.half, dx)), g.add(start[1], g.mul(g.half, dy)))
        self.angles.append(angle)
        return g.add(start[0], dx), g.add(start[1], dy)


def _constrained(graph: Graph, bars: _Bars, q: list[Node], gaps: list[Node]) -> Mechanism:
    """Return a mechanism of bars with position constraints ``gaps``; the unknowns are a, then lam."""
    count = len(q)
    u, a = (symbols(graph, c, count) for c in "ua")
    lam = [graph.symbol(f"lam{k}") for k in range(len(gaps))]
    along = dict(zip(q, u, strict=True))
    along_twice = along | dict(zip(u, a, strict=True))
    bodies = len(bars.angles)
    velocities = jvp(graph, bars.points + bars.angles + gaps, along)
    accelerations = jvp(graph, velocities, along_twice)
    g = graph.symbol("g")
    seeds = []
    for i in range(bodies):
        m, inertia = graph.symbol(f"m{i}"), graph.symbol(f"J{i}")
        seeds.append((velocities[2 * i], graph.mul(m, accelerations[2 * i])))
        seeds.append((velocities[2 * i + 1], graph.mul(m, graph.add(accelerations[2 * i + 1], g))))
        seeds.append((velocities[2 * bodies + i], graph.mul(inertia, accelerations[2 * bodies + i])))
    rates = velocities[3 * bodies :]
    seeds += [(rate, graph.neg(force)) for rate, force in zip(rates, lam, strict=True)]
    residuals = vjp(graph, seeds, u) + accelerations[3 * bodies :]
    return Mechanism(graph, q, u, a + lam, residuals, gaps)


def closed_chain(graph: Graph, count: int, *, joint_angles: bool) -> Mechanism:
    """Bars hinged one after the other, both ends pinned to the ground."""
    q = symbols(graph, "q", count)
    bars = _Bars(graph)
    tip, angle = (graph.zero, graph.zero), graph.zero
    for i in range(count):
        angle = graph.add(angle, q[i]) if joint_angles else q[i]
        tip = bars.bar(tip, angle)
    return _constrained(graph, bars, q, [graph.sub(tip[k], graph.symbol(f"d{k}")) for k in range(2)])


def ladder(graph: Graph, cells: int) -> Mechanism:
    """Four-bar cells on top of each other, joint angles: two uprights on a bar, a bar on their tips."""
    q = symbols(graph, "q", 3 * cells)
    bars = _Bars(graph)
    left, right, angle = (graph.zero, graph.zero), (graph.symbol("d"), graph.zero), graph.zero
    gaps: list[Node] = []
    for i in range(cells):
        upright = graph.add(angle, q[3 * i])
        top_left = bars.bar(left, upright)
        other = bars.bar(right, graph.add(angle, q[3 * i + 2]))
        angle = graph.add(upright, q[3 * i + 1])
        top_right = bars.bar(top_left, angle)
        gaps += [graph.sub(s, t) for s, t in zip(other, top_right, strict=True)]
        left, right = top_left, top_right
    return _constrained(graph, bars, q, gaps)


def close(mechanism: Mechanism, environment: dict[Node, float]) -> dict[Node, float]:
    """Return the environment with coordinates moved onto phi = 0 (Gauss-Newton, least change)."""
    graph, q = mechanism.graph, mechanism.q
    rows = jacobian(graph, mechanism.constraints, q)
    entries = [(i, j, n) for i, row in enumerate(rows) for j, n in row.items()]
    closed = dict(environment)
    outputs = [*mechanism.constraints, *(n for _, _, n in entries)]
    count = len(mechanism.constraints)
    for _ in range(50):
        values = evaluate(graph, outputs, closed)
        phi = np.array(values[:count])
        if np.abs(phi).max() < 1e-13:
            return closed
        matrix = np.zeros((count, len(q)))
        for (i, j, _), v in zip(entries, values[count:], strict=True):
            matrix[i, j] = v
        step = np.linalg.lstsq(matrix, phi, rcond=None)[0]
        for n, s in zip(q, step, strict=True):
            closed[n] -= float(s)
    raise AssertionError("the mechanism does not close")


def support_on_manifold(mechanism: Mechanism, states: list[dict[Node, float]]) -> dict[int, set[int]]:
    """Return, for each multiplier, the coordinates that move its constraint in some of the closed states."""
    graph = mechanism.graph
    offset = len(mechanism.q)
    support: dict[int, set[int]] = {}
    for k, row in enumerate(jacobian(graph, mechanism.constraints, mechanism.q)):
        support[offset + k] = {
            j for j, n in row.items() if any(abs(evaluate(graph, [n], s)[0]) > 1e-9 for s in states)
        }
    return support


def spatial_loop(graph: Graph, count: int) -> Mechanism:
    """A spatial chain whose tip does not move: its velocity, in the axes of the last body, is constrained."""
    return spatial_tree(graph, chain_parents(count), tip_fixed=True)
