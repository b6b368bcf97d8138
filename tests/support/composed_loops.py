"""Random closed loops as people compose them, and the forces in their joints by Newton's and Euler's laws of each body.

Frames are named through other names up to three deep, on either side of joints; parts have a root and a tip of their own,
parts stand in parts, bodies are joined by value, joints stand in components. The judge knows none of that: it has the
absolute places of bodies and joints, and solves the laws of all bodies with all forces as unknowns.
"""

from __future__ import annotations

import random
from collections.abc import Mapping

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

KINDS = {2: ("Revolute", "Prismatic", "PinSlot", "Weld"), 3: ("Revolute", "Prismatic", "Cylindrical", "Universal", "Spherical", "Weld")}  # fmt: skip
STIFF = ("Prismatic", "Weld")
"""Joints that do not turn. A loop turns in two places at least, else its equations are not independent."""
SETTINGS = {
    "Prismatic": ("axis",),
    "PinSlot": ("axis",),
    "Cylindrical": ("axis",),
    "Universal": ("first", "second"),
}


class Place(Struct, frozen=True):
    """Origin and axes (columns) in the world; in the plane, the third coordinate and row are those of the world."""

    origin: Array
    axes: Array

    def seen_from(self, other: Place) -> Place:
        return Place(other.axes.T @ (self.origin - other.origin), other.axes.T @ self.axes)


class Lump(Struct, frozen=True):
    """One rigid body of the model: ``com`` in the axes of ``place``; ``inertia`` is the same about all axes.

    ``name``: where it is in the model.
    """

    name: str
    place: Place
    mass: float
    com: Array
    inertia: float


class Joint(Struct, frozen=True):
    """``twists``: what it leaves free, rows of velocity and angular velocity in the world, at ``place``."""

    asked: str
    place: Place
    twists: Array


class Loop(Struct, frozen=True):
    """Body i, made of ``lumps[i]``, lies between the joints i and i + 1; the world is at both ends."""

    text: str
    size: int
    gravity: Array
    lumps: tuple[tuple[Lump, ...], ...]
    joints: tuple[Joint, ...]


# ---------------------------------------------------------------- the model


class _Writer:
    def __init__(self, seed: int, size: int) -> None:
        self.random = random.Random(seed)
        self.size = size
        self.models: list[str] = []
        self.lines: list[str] = []
        self.count = 0
        self.cut = self.random.randint(0, 8)
        """The joint that says that it closes the loop, if there is one of that number."""

    def numbers(self, scale: float = 1.0) -> Array:
        found = np.zeros(3)
        found[: self.size] = [self.random.uniform(-scale, scale) for _ in range(self.size)]
        return found

    def vector(self, values: Array) -> str:
        return "{" + ", ".join(repr(float(x)) for x in values[: self.size]) + "}"

    def somewhere(self) -> Place:
        turn = np.array([0.0, 0.0, self.random.uniform(-3, 3)]) if self.size == 2 else self.numbers(2)
        return Place(self.numbers(0.8), Rotation.from_rotvec(turn).as_matrix())

    def moved(self, frame: str, place: Place, of: Place) -> str:
        """Return the expression of ``place`` on a frame that is at ``of``."""
        seen = place.seen_from(of)
        angles = Rotation.from_matrix(seen.axes).as_euler("XYZ")
        names = (("rotx", 0), ("roty", 1), ("rotz", 2)) if self.size == 3 else (("rot", 2),)
        turns = "".join(f" * {name}({float(angles[k])!r} rad)" for name, k in names)
        return f"{frame} * trans({self.vector(seen.origin)} m){turns}"

    def fresh(self) -> str:
        self.count += 1
        return f"n{self.count}"

    def named(self, expression: str) -> str:
        """Return a frame under a name of a name, up to three deep."""
        for _ in range(self.random.randint(0, 3)):
            name = self.fresh()
            self.lines.append(f"frame {name} = {expression};")
            expression = name
        return expression

    def body(self, lump: Lump, at: str = "") -> str:
        inertia = f"{lump.inertia!r} kg.m^2"
        inertia = inertia if self.size == 2 else f"diag({{1, 1, 1}}*{inertia})"
        value = f", a = {at}" if at else ""
        return (
            f"Body {lump.name}(m = {lump.mass!r} kg, J = {inertia}, com = {self.vector(lump.com)} m{value});"
        )

    def lump(self, name: str) -> Lump:
        place = self.somewhere()
        return Lump(
            name, place, self.random.uniform(0.5, 3), self.numbers(0.3), self.random.uniform(0.1, 0.5)
        )

    def assembly(self, i: int, first: Place, second: Place) -> tuple[tuple[Lump, ...], str, str]:
        """Write body i; return what it is made of and its frames at the joints before and after it."""
        style = self.random.choice(("plain", "value", "two", "two", "part", "nested", "own"))
        lump = self.lump(f"b{i}")
        if style == "plain":
            self.lines.append(self.body(lump))
            ends = [self.moved(f"b{i}.a", at, lump.place) for at in (first, second)]
            return (lump,), ends[0], ends[1]
        if style == "value":
            self.lines += [
                f"frame r{i};",
                self.body(lump, self.named(self.moved(f"r{i}", lump.place, first))),
            ]
            return (lump,), f"r{i}", self.moved(f"r{i}", second, first)
        if style == "two":
            other = self.lump(f"e{i}")
            pair = [lump, other] if self.random.random() < 0.5 else [other, lump]
            carrier, carried = pair
            self.lines.append(self.body(carrier))
            self.lines.append(
                self.body(carried, self.named(self.moved(f"{carrier.name}.a", carried.place, carrier.place)))
            )
            ends = [
                self.moved(f"{lump.name}.a", first, lump.place),
                self.moved(f"{other.name}.a", second, other.place),
            ]
            return (lump, other), ends[0], ends[1]
        inner_lump = replace(lump, name="body")
        inside = self.body(inner_lump, self.moved("root", lump.place, first))
        tip = f"frame far = {self.moved('root', second, first)}; frame tip = far;"
        root = "frame root;"
        if style == "own":
            inside = self.body(inner_lump)
            root = f"frame root = {self.moved('body.a', first, lump.place)};"
            tip = f"frame far = {self.moved('body.a', second, lump.place)}; frame tip = far;"
        self.models.append(f"model Part{i} {root} {inside} {tip} end Part{i};")
        kind = f"Part{i}"
        if style == "nested":
            inner = self.random.choice(("inner(root = root)", "inner(root = base)"))
            base = "frame base = root;" if "base" in inner else ""
            self.models.append(
                f"model Whole{i} frame root; {base} Part{i} {inner}; frame tip = inner.tip; end Whole{i};"
            )
            kind = f"Whole{i}"
        self.lines.append(f"{kind} p{i};")
        path = f"p{i}.inner.body" if style == "nested" else f"p{i}.body"
        return (replace(lump, name=path),), f"p{i}.root", f"p{i}.tip"

    def joint(self, j: int, kind: str, ends: tuple[str, str], place: Place) -> Joint:
        axes = [
            self.numbers()
            for _ in SETTINGS.get(kind, ("axis",) if (kind, self.size) == ("Revolute", 3) else ())
        ]
        names = SETTINGS.get(kind, ("axis",))
        settings = "".join(f", {name} = {self.vector(axis)}" for name, axis in zip(names, axes, strict=False))
        source, target = (self.named(end) for end in ends)
        asked = f"j{j}"
        if kind == "Weld" and self.random.random() < 0.5:
            kind = "Bolt"
        if self.random.random() < 0.3:
            inner = f"{kind} pin(from -> to{settings});"
            self.models.append(f"model Link{j} frame from; frame to; {inner} end Link{j};")
            self.lines.append(f"Link{j} j{j}({source} -> {target});")
            asked = f"j{j}.pin"
        else:
            cut = "cut " if j == self.cut else ""
            self.lines.append(f"{cut}{kind} j{j}({source} -> {target}{settings});")
        return Joint(asked, place, _twists(kind, self.size, [place.axes @ axis for axis in axes]))


def _twists(kind: str, size: int, axes: list[Array]) -> Array:
    none = np.zeros(3)
    across = np.array([0.0, 0.0, 1.0])
    match kind:
        case "Weld" | "Bolt":
            rows: list[Array] = []
        case "Revolute":
            rows = [np.hstack([none, across if size == 2 else axes[0]])]
        case "Prismatic":
            rows = [np.hstack([axes[0], none])]
        case "PinSlot":
            rows = [np.hstack([axes[0], none]), np.hstack([none, across])]
        case "Cylindrical":
            rows = [np.hstack([axes[0], none]), np.hstack([none, axes[0]])]
        case "Universal":
            rows = [np.hstack([none, axis]) for axis in axes]
        case _:
            rows = [np.hstack([none, axis]) for axis in np.eye(3)]
    return np.reshape(np.array(rows), (-1, 6))


def composed_loop(seed: int, size: int, bodies: int = 3, *, stop: float = 0) -> Loop:
    """Write a random loop; the freedoms of its joints are more than a closed loop takes.

    Outputs are ``F`` and ``M`` of each joint, its place ``P``, and in a run until ``stop`` [s] of each lump the place ``c`` of its mass centre, its
    acceleration ``a`` and angular acceleration ``w``: ``c0_1`` of the second one of the first body.
    """
    writer = _Writer(seed, size)
    kinds: list[str] = []
    freedoms = {k: len(_twists(k, size, [np.ones(3)] * 2)) for k in KINDS[size]}
    while (
        sum(freedoms[k] for k in kinds) <= (3 if size == 2 else 6) or sum(k not in STIFF for k in kinds) < 2
    ):
        kinds = [writer.random.choice(KINDS[size]) for _ in range(bodies + 1)]
        if size == 3:
            kinds[writer.random.randint(0, bodies)] = "Spherical"
    places = [writer.somewhere() for _ in kinds]
    world = Place(np.zeros(3), np.eye(3))
    ends = [[writer.moved("world", places[0], world)]]
    lumps = []
    for i in range(bodies):
        made, first, second = writer.assembly(i, places[i], places[i + 1])
        lumps.append(made)
        ends[-1].append(first)
        ends.append([second])
    ends[-1].append(writer.moved("world", places[-1], world))
    joints = [writer.joint(j, kind, (ends[j][0], ends[j][1]), places[j]) for j, kind in enumerate(kinds)]
    gravity = writer.numbers(9)
    writer.random.shuffle(writer.lines)
    outputs = [
        f"output F{j} = reaction({x.asked}); output M{j} = moment({x.asked}); output P{j} = pos({x.asked}.to);"
        for j, x in enumerate(joints)
    ]
    for i, parts in enumerate(lumps if stop else ()):
        for k, lump in enumerate(parts):
            point = f"({lump.name}.a * {lump.name}.com)"
            outputs.append(
                f"output c{i}_{k} = pos({point}); output a{i}_{k} = der(vel({point})); "
                f"output w{i}_{k} = der(angvel({lump.name}.a));"
            )
    lines = [
        f"import mech.{'planar' if size == 2 else 'spatial'}.*;",
        "model Bolt frame from; frame to; place to = from; end Bolt;",
        *writer.models,
        "model Loop",
        f"gravity {writer.vector(gravity)} m/s^2;",
        *writer.lines,
        *outputs,
        f"experiment(stop = {stop} s, tolerance = 1e-9);",
        "end Loop;",
    ]
    return Loop("\n".join(lines), size, gravity, tuple(lumps), tuple(joints))


# ---------------------------------------------------------------- the judge


def forces_at_rest(loop: Loop) -> tuple[list[Array], float]:
    """Return the force and moment on the ``to`` side of each joint, at its place, and how well they are determined.

    At rest, with a, alpha the accelerations of body i at the origin of the world and w the wrench of joint j there:
    M a - sum +-w = weight; a_to - a_from = N s for the free motions N of the joint; N^T w = 0. All are unknown.
    """
    bodies, joints = len(loop.lumps), len(loop.joints)
    free = [_at_origin(joint) for joint in loop.joints]
    starts = np.cumsum([6 * bodies, 6 * joints, *(n.shape[0] for n in free)])
    size = int(starts[-1])
    matrix, right = np.zeros((size, size)), np.zeros(size)
    for i, lumps in enumerate(loop.lumps):
        rows = slice(6 * i, 6 * i + 6)
        for lump in lumps:
            at = lump.place.origin + lump.place.axes @ lump.com
            arm = _cross(at)
            inertia = lump.inertia * np.eye(3) - lump.mass * arm @ arm
            matrix[rows, rows] += np.block(
                [[lump.mass * np.eye(3), -lump.mass * arm], [lump.mass * arm, inertia]]
            )
            right[rows] += np.hstack([lump.mass * loop.gravity, np.cross(at, lump.mass * loop.gravity)])
        for j, sign in ((i, 1.0), (i + 1, -1.0)):
            wrench = slice(6 * bodies + 6 * j, 6 * bodies + 6 * j + 6)
            matrix[rows, wrench] -= sign * np.eye(6)
            matrix[wrench, rows] += sign * np.eye(6)
    for j, twists in enumerate(free):
        wrench = slice(6 * bodies + 6 * j, 6 * bodies + 6 * j + 6)
        speeds = slice(int(starts[j + 1]), int(starts[j + 2]))
        matrix[wrench, speeds] = -twists.T
        matrix[speeds, wrench] = twists
    if loop.size == 2:  # what leaves the plane is not an unknown
        kept = [k for k in range(size) if k >= 6 * (bodies + joints) or k % 6 in (0, 1, 5)]
        matrix, right = matrix[np.ix_(kept, kept)], right[kept]
    else:
        kept = list(range(size))
    found: Array = np.zeros(size)
    found[kept] = np.linalg.solve(matrix, right)
    wrenches = found[6 * bodies : 6 * (bodies + joints)].reshape(joints, 6)
    moved = [
        np.hstack([w[:3], w[3:] - np.cross(joint.place.origin, w[:3])])
        for w, joint in zip(wrenches, loop.joints, strict=True)
    ]
    return moved, float(np.linalg.cond(matrix))


def unbalanced(loop: Loop, seen: Mapping[str, Array]) -> float:
    """Return what is left of Newton's and Euler's law of each body, of its largest term, by its motion and the forces."""
    worst = 0.0
    for i, lumps in enumerate(loop.lumps):
        terms = []
        for k, lump in enumerate(lumps):
            at, acceleration = _vector(seen, f"c{i}_{k}", loop.size), _vector(seen, f"a{i}_{k}", loop.size)
            force = lump.mass * (acceleration - loop.gravity)
            spin = _vector(seen, f"w{i}_{k}", loop.size, turning=True)
            terms.append(np.hstack([force, lump.inertia * spin + np.cross(at, force)]))
        for j, sign in ((i, -1.0), (i + 1, 1.0)):
            at, force = _vector(seen, f"P{j}", loop.size), _vector(seen, f"F{j}", loop.size)
            moment = _vector(seen, f"M{j}", loop.size, turning=True)
            terms.append(sign * np.hstack([force, moment + np.cross(at, force)]))
        worst = max(worst, float(np.abs(sum(terms)).max() / np.abs(terms).max()))
    return worst


def _vector(seen: Mapping[str, Array], name: str, size: int, *, turning: bool = False) -> Array:
    """Return the vector of an output at all times, in space; in the plane, what turns is about the third axis."""
    if size == 2 and turning:
        z = np.asarray(seen[name])
        return np.stack([0 * z, 0 * z, z], axis=-1)
    parts = [np.asarray(seen[f"{name}[{k + 1}]"]) for k in range(size)]
    return np.stack([*parts, *([0 * parts[0]] * (3 - size))], axis=-1)


def _at_origin(joint: Joint) -> Array:
    """Return the free motions as velocity of what is at the origin of the world, and angular velocity."""
    return np.array(
        [np.hstack([t[:3] - np.cross(t[3:], joint.place.origin), t[3:]]) for t in joint.twists]
    ).reshape(-1, 6)


def _cross(a: Array) -> Array:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
