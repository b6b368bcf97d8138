"""One instant of a motion: positions, rates and assumed accelerations, and the balance of forces there.

Every freedom i has two displacements: number 2i is constant in time (its rate is zero), number 2i + 1 grows like the
time from now (it is zero now, its rate is one). With dL = A eta + B eta' along a motion these give
A = dL/dq from the first and, from the second, B = dL/dv and A + B', so that Lagrange's left side B' - A needs no
derivative of a formula: it is the growth of the second answer less twice the first. That holds for angular
velocities too, where eta turns the body (Hamel).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.compiler.flat import model as flat
from oracle import poses, unknowns
from oracle.expressions import Evaluator, Value, der, position
from oracle.placement import connects
from oracle.poses import Pose, vector
from oracle.series import Series
from oracle.values import NotCovered

if TYPE_CHECKING:
    from oracle.meaning import Meaning

Array = Any


@dataclass
class Unknowns:
    """What a motion does not tell by itself, one number for each complex step."""

    a: Array
    forces: dict[str, Array] = field(default_factory=dict)  # of constraints, contacts, sticking friction
    rates: dict[str, Array] = field(default_factory=dict)  # of first-order states
    answers: dict[Any, Array] = field(default_factory=dict)  # to questions inside of laws


class Point:
    """Values and forces at one instant; ``cut`` is a joint that is given 3 or 6 more freedoms, each with a place and a
    rate that are zero but for a ``nudge``."""

    def __init__(
        self,
        meaning: Meaning,
        state: Mapping[str, float],
        unknowns: Unknowns,
        cut: str = "",
        frozen: dict[Any, Any] | None = None,
        modes: Mapping[str, str] | None = None,
        nudge: Array = 0.0,
    ) -> None:
        self.meaning, self.state, self.unknowns, self.cut = meaning, state, unknowns, cut
        self.modes = modes or {}
        self.space = meaning.flat.space or 2
        self.extra = 0 if not cut else 3 if self.space == 2 else 6
        self.size = meaning.size + self.extra
        self.nudge = np.broadcast_to(nudge, (2 * self.extra, np.shape(nudge)[-1] if np.shape(nudge) else 1))
        self.asked: set[Any] = set()  # questions whose answers are being formed
        self.loads: dict[tuple[str, frozenset[str]], list[Series]] = {}  # of joints that were cut
        self._found: dict[str, Value] | None = None
        self.time = state.get("time", 0.0)
        t = Series(np.array([[self.time], [1.0], [0.0]], complex))
        names: dict[str, Value] = {"time": t, meaning.flat.independent: t, **meaning.parameter_values}
        self.at = Evaluator(names, meaning.definitions, self.space, self.frame, self.question, frozen)
        self.at.lazy.update({n: self._computed(n) for n in meaning.computed})
        self.at.lazy.update({u.name: lambda n=u.name: self._unknowns()[n] for u in meaning.flat.unknowns})  # type: ignore[misc]
        self._fill(names)

    # ------------------------------------------------------------ variables

    def slopes(self, i: int) -> Array:
        e = np.zeros((3, 2 * self.size, 1), complex)
        e[0, 2 * i, 0] = e[1, 2 * i + 1, 0] = 1
        return e

    def _fill(self, names: dict[str, Value]) -> None:
        m, s = self.meaning, self.state
        for name, shape, elements, rates, first in m.coordinate_layout:
            if shape is None:
                places, speeds = [s[x] for x in elements], [s[x] for x in rates]
                turned = cache(lambda q=places, w=speeds, first=first: self._rotation(q, w, first))
                for k, what in enumerate(("", " quaternion", " rate")):
                    self.at.lazy[name + what] = lambda turned=turned, k=k: turned()[k]  # type: ignore[misc]
                continue
            items = []
            for i, (q, v) in enumerate(zip(elements, rates, strict=True)):
                a = self.unknowns.a[first + i]
                items.append(
                    Series(np.stack(np.broadcast_arrays(s[q] + 0j, s[v], a / 2)), self.slopes(first + i))
                )
            names[name] = shaped(items, shape)
        for name, shape, elements in m.state_layout:
            names[name] = shaped([self._state(x) for x in elements], shape)
        for name, shape, elements, kind in m.discrete_layout:
            convert: Callable[[float], Any] = bool if kind is flat.Kind.BOOLEAN else float
            names[name] = shaped([convert(s[x]) for x in elements], shape)
        for name, shape, elements in m.input_layout:
            if any(x in s or x in m.given_inputs for x in elements):
                names[name] = shaped([self._input(x) for x in elements], shape)

    def _state(self, name: str) -> Series:
        rate = self.unknowns.rates.get(name)
        now = np.array([self.state[name]], complex)
        return Series(now[None] if rate is None else np.stack(np.broadcast_arrays(now, rate)))

    def _input(self, name: str) -> Value:
        if name in self.state:
            return float(self.state[name])
        given = self.meaning.given_inputs.get(name)
        if given is None:
            raise NotCovered(f"a part of the input {name}")
        if not callable(given):
            return float(given)
        slopes = getattr(given, "derivative", None)  # of a spline, which may drive
        rates = [] if slopes is None else [slopes(1)(self.time), slopes(2)(self.time) / 2]
        return Series(np.array([[x] for x in (given(self.time), *rates)], complex))

    def _rotation(self, q: list[float], w: list[float], first: int) -> tuple[Value, Value, Value]:
        """A rotation, its quaternion along q' = 1/2 q (0, w), turned in the body by each displacement, and its rate."""
        a = self.unknowns.a[first : first + 3]
        length = np.sqrt(sum(x * x for x in q))
        q0 = vector(*(np.atleast_1d(x / length + 0j) for x in q))
        w0 = vector(0j, *(np.atleast_1d(x + 0j) for x in w))
        w1 = vector(0j, *a)
        q1 = poses.times(q0, w0) / 2
        q2 = (poses.times(q1, w0) + poses.times(q0, w1)) / 4
        whole = [Series(np.stack(np.broadcast_arrays(q0[k], q1[k], q2[k]))) for k in range(4)]
        turned = poses.times(
            vector(*whole),
            vector(0.0, *(Series(np.zeros((3, 1), complex), self.slopes(first + k) / 2) for k in range(3))),
        )
        quaternion = vector(*(x + y for x, y in zip(whole, turned, strict=True)))
        back = vector(quaternion[0], *(-x for x in quaternion[1:]))
        return poses.quaternion(quaternion), quaternion, 2 * poses.times(back, der(quaternion))[1:]

    def _unknowns(self) -> dict[str, Value]:
        """The outputs that equations determine, found once."""
        if self._found is None:
            self._found = unknowns.found(self.at, self.meaning.flat)
        return self._found

    # ------------------------------------------------------------ frames

    def _computed(self, name: str) -> Callable[[], Value]:
        joint, expression = self.meaning.computed[name]
        return lambda: self.view(joint)(expression)

    def view(self, joint: flat.Joint) -> Evaluator:
        """What a joint that closes a loop sees: where it is cut, its `to` side is displaced."""
        key = f"view {joint.name}"
        if joint.name != self.cut:
            return self.at
        if key not in self.at.memo:
            names = dict(self.at.names)
            for name in self.meaning.sides[joint.name]:
                names[name] = self.displaced(self.at.name(name))
            seen = Evaluator(
                names, self.at.definitions, self.space, self.frame, self.question, self.at.frozen
            )
            seen.lazy = self.at.lazy
            self.at.memo[key] = seen
        return self.at.memo[key]  # type: ignore[no-any-return]

    def displaced(self, pose: Pose) -> Pose:
        """A pose after the extra freedoms, which are zero: along the axes of the world, about its own origin."""
        place, rate = self.nudge[0::2], self.nudge[1::2]
        zero = [
            Series(np.stack([place[k] + 0j, rate[k], 0 * rate[k]]), self.slopes(self.meaning.size + k))
            for k in range(self.extra)
        ]
        d = self.space
        if d == 2:
            turn = poses.matrix([[1.0, -zero[2]], [zero[2], 1.0]])
            return Pose(turn @ pose.R, pose.p + vector(*zero[:2]), pose.angle + zero[2])
        x, y, z = zero[3:]
        turn = poses.matrix([[1.0, -z, y], [z, 1.0, -x], [-y, x, 1.0]])
        return Pose(turn @ pose.R, pose.p + vector(*zero[:3]))

    def frame(self, name: str) -> Pose:
        """A free frame, placed by its joint from one side or from the other."""
        tree = self.meaning.tree
        joint = tree.edges[name]
        if joint.name not in tree.backwards:
            to = self.at(joint.value)
            to = self.displaced(to) if joint.name == self.cut else to
            return to @ self.relative(joint.target, name).inverse()
        to = self.at.name(joint.target)
        to = self.displaced(to) if joint.name == self.cut else to
        return to @ self.relative(joint.value, name).inverse()

    def relative(self, e: flat.Expression | str, base: str) -> Pose:
        """A frame as seen from the free frame on which it is built."""
        names = {**self.at.names, base: poses.identity(self.space)}
        seen = Evaluator(names, self.at.definitions, self.space, self.frame, self.question, self.at.frozen)
        seen.lazy = self.at.lazy
        return seen.name(e) if isinstance(e, str) else seen(e)  # type: ignore[no-any-return]

    # ------------------------------------------------------------ displacements

    def moved(self, x: Value, second: bool = False, order: int = 0) -> Array:
        """First changes of numbers by the displacements of one of both kinds, (freedoms, steps)."""
        if not isinstance(x, Series) or x.e is None:
            return np.zeros((self.size, 1), complex)
        if len(x.e) <= order:
            raise NotCovered("a displacement of what is known at one instant only")
        return x.e[order, int(second) :: 2]

    def work(self, forces: Value, places: Value, second: bool = False) -> Array:
        """The sum of the products of forces with the displacements of what they act on."""
        pairs = zip(items_of(forces), items_of(places), strict=True)
        return sum((now(f) * self.moved(x, second) for f, x in pairs), np.zeros((self.size, 1), complex))

    def turned(self, frame: Pose) -> Value:
        """The virtual rotation of a frame in world components, as series of which only `e` counts."""
        if frame.angle is not None:
            return vector(frame.angle)
        still = np.vectorize(lambda x: Series(x.v) if isinstance(x, Series) else x, otypes=[object])(frame.R)
        return poses.spin(still, frame.R)

    # ------------------------------------------------------------ energies

    def energies(self, kind: str) -> Any:
        return sum((self.at(e.value) for e in self.meaning.flat.energies if e.kind == kind), 0.0)

    def bodies(self) -> Any:
        """The kinetic energy of masses and inertias (section 5)."""
        total: Any = 0.0
        for mass in self.meaning.flat.masses:
            v = der(np.asarray(position(self.at(mass.at)), object))
            total = total + self.at(mass.value) * sum(x * x for x in v) * 0.5
        for inertia in self.meaning.flat.inertias:
            J, w = self.inertia(inertia)
            total = total + (sum(w * (J @ w)) * 0.5 if self.space == 3 else J * w * w * 0.5)
        return total

    def inertia(self, inertia: flat.Inertia) -> tuple[Value, Value]:
        """Of a body and its angular velocity, in the axes of its frame."""
        frame, J = self.at(inertia.on), self.at(inertia.value)
        w = self.at.angular_velocity(frame)
        if self.space == 2:
            return J, w
        J = np.asarray(J, object)
        return (J + J.T) / 2, frame.R.T @ w

    def weight(self) -> Any:
        """The potential energy of masses in their fields."""
        total: Any = 0.0
        for mass in self.meaning.flat.masses:
            if mass.gravity is not None:
                P, g = position(self.at(mass.at)), self.at(mass.gravity)
                total = total - self.at(mass.value) * sum(a * b for a, b in zip(g, P, strict=True))
        return total

    def kinetic(self) -> Any:
        return self.energies("kinetic") + self.bodies()

    def potential(self) -> Any:
        return self.energies("potential") + self.weight()

    def stored(self) -> Any:
        """What takes or gives kinetic energy where it jumps: the potential energy, and what else a Lagrangian has, with its sign."""
        return self.potential() - self.energies("lagrangian")

    def lagrangian(self) -> Any:
        return self.kinetic() - self.potential() + self.energies("lagrangian")

    def momenta(self) -> Array:
        """dL/dv of every freedom."""
        L = self.lagrangian()
        return self.moved(L, second=True)

    def total_energy(self) -> Any:
        """The sum of v dL/dv, less L (section 13)."""
        p, L = self.momenta(), self.lagrangian()
        v = [*(self.state[name] for name in self.meaning.all_rates), *self.nudge[1::2]]
        return sum((x * y for x, y in zip(p, v, strict=True)), 0.0) - now(L)

    # ------------------------------------------------------------ the balance of forces

    def inertial(self) -> Array:
        """What Lagrange and Newton and Euler have on the left side."""
        L = self.energies("kinetic") - self.energies("potential") + self.energies("lagrangian")
        rows = self.moved(L, True, 1) - 2 * self.moved(L) if isinstance(L, Series) and L.e is not None else 0
        rows = rows + np.zeros((self.size, 1), complex)
        for mass in self.meaning.flat.masses:
            m, P = now(self.at(mass.value)), np.asarray(position(self.at(mass.at)), object)
            rows = rows + m * self.work(vector(*(at_order(x, 2) for x in P)), P)
            if mass.gravity is not None:
                rows = rows - m * self.work(self.at(mass.gravity), P)
        for inertia in self.meaning.flat.inertias:
            J, w = self.inertia(inertia)
            frame = self.at(inertia.on)
            if self.space == 2:
                torque: Value = vector(now(J) * at_order(w, 1))
            else:
                J, rate = numbers(J), vector(*(at_order(x, 1) for x in w))
                w = numbers(w)
                torque = numbers(frame.R) @ (J @ rate + poses.cross(w, J @ w))
            rows = rows + self.work(torque, self.turned(frame))
        return rows

    def applied(self) -> Array:
        """Generalised forces of all loads, dissipation, friction and constraints."""
        rows = np.zeros((self.size, 1), complex)
        m = self.meaning
        for load in m.flat.loads:
            rows = rows + self.load(load)
        for e in [self.at(e.value) for e in m.flat.energies if e.kind == "dissipation"]:
            rows = rows - self.moved(e, True)
        for damping in m.flat.dampings:
            rows = rows - self.moved(self.damped(damping), True)
        for friction in m.flat.frictions:
            rows = rows + self.rubbing(friction)
        for contact in m.flat.contacts:
            rows = rows + self.pressing(contact)
        for name, kind, value in self.rows():
            rows = rows + self.unknowns.forces[name] * self.moved(value, kind == "rate")
        return rows

    def damped(self, damping: flat.Damping) -> Any:
        return self.at(damping.value) * sum(r * r for r in self.rates(damping.on)) * 0.5

    def rates(self, on: flat.Expression) -> list[Any]:
        """What a damping or a force acts along: an expression that contains velocities is a rate already (section 5)."""
        x = np.asarray(position(self.at(on)), object)
        return items_of(np.ravel(x if self.meaning.rated(on) else der(x)))

    def load(self, load: flat.Load) -> Array:
        """Virtual power of a force or torque, and of its opposite on the source (section 5)."""
        value = self.at(load.value)
        if load.frame is not None and (self.space == 3 or load.kind != "torque"):
            value = self.at(load.frame).R @ np.asarray(value, object)
        rows = np.zeros((self.size, 1), complex)
        for where, sign in ((load.on, 1), (load.source, -1)):
            if where is not None:
                place = self.place(load, where)
                rows = rows + sign * self.work(value, place, self.meaning.rated(where))
        return rows

    def place(self, load: flat.Load, where: flat.Expression) -> Value:
        """What a load displaces: the number, the point, or the frame's turning."""
        x = self.at(where)
        if load.kind == "torque" and isinstance(x, Pose):
            return self.turned(x)
        if load.at is None:
            return np.asarray(position(x), object)
        if not isinstance(x, Pose):
            raise NotCovered("a force on a point `at` another")
        arm = numbers(position(self.at(load.at))) - numbers(x.p)
        still = vector(*(Series(np.atleast_1d(np.asarray(s, complex))[None]) for s in arm))
        turning = self.turned(x)
        if self.space == 2:
            return x.p + vector(-(turning[0] * still[1]), turning[0] * still[0])
        return x.p + poses.cross(turning, still)

    def rubbing(self, friction: flat.Friction) -> Array:
        """Dry friction on a length or angle (section 15)."""
        rate = der(self.at(friction.on))
        mode = self.modes.get(friction.name, "slip")
        if mode == "stick":
            return self.unknowns.forces[friction.name] * self.moved(rate, True)
        f = now(self.at(friction.kinetic))
        if self.meaning.smooth(friction.options):
            return (
                -f * np.tanh(now(rate) / now(self.at(friction.options["v_stick"]))) * self.moved(rate, True)
            )
        return -f * self.direction(mode, rate) * self.moved(rate, True)

    @staticmethod
    def direction(mode: str, rate: Any) -> float:
        if mode in ("slip+", "slip-"):
            return 1.0 if mode == "slip+" else -1.0
        return float(np.sign(rate.real if isinstance(rate, Series) else rate))

    def slip(self, contact: flat.Contact) -> list[Any]:
        assert contact.along is not None
        return items_of(self.at(contact.along))

    def pressing(self, contact: flat.Contact) -> Array:
        """Normal force and friction of a closed contact."""
        mode = self.modes.get(contact.name, "open")
        if mode == "open":
            return np.zeros((self.size, 1), complex)
        N = self.unknowns.forces[contact.name]
        rows = N * self.moved(self.at(contact.gap))
        if contact.friction is None:
            return rows
        slip: Any = self.slip(contact)
        if mode == "stick":
            for k, s in enumerate(slip):
                rows = rows + self.unknowns.forces[f"{contact.name}/{k}"] * self.moved(s, True)
            return rows
        mu = now(self.at(contact.friction))
        if self.meaning.smooth(contact.options):
            speed = np.sqrt(sum(now(s) ** 2 for s in slip) + 0j)
            scale = now(self.at(contact.options["v_stick"]))
            grip = np.tanh(speed / scale) / speed if abs(np.ravel(speed)[0]) > 0 else 1 / scale
            return rows - mu * N * grip * sum(now(s) * self.moved(s, True) for s in slip)
        if len(slip) == 1:
            return rows - mu * N * self.direction(mode, slip[0]) * self.moved(slip[0], True)
        if mode == "slip":
            u = [now(s) for s in slip]
            size = np.sqrt(u[0] ** 2 + u[1] ** 2)
            u = [x / size for x in u]
        else:
            phi = self.unknowns.forces[f"{contact.name}/angle"]
            u = [np.cos(phi), np.sin(phi)]
        return rows - mu * N * sum(x * self.moved(s, True) for x, s in zip(u, slip, strict=True))

    # ------------------------------------------------------------ constraints

    def held(self, name: str) -> bool:
        return self.meaning.holds(self.state, name)

    def rows(self) -> list[tuple[str, str, Any]]:
        """Constraints that hold: name of the force, "position" or "rate", and what has to be zero."""
        m, out = self.meaning, []
        for c in m.flat.constraints:
            if self.held(c.name):
                off = items_of(self.at(c.left) - self.at(c.right))
                out += [
                    (f"{c.name}[{k + 1}]", m.kinds.get((c.name, k), "position"), x) for k, x in enumerate(off)
                ]
        for d in m.flat.drives:
            name, rated = m.drive_name(d)
            if self.held(name):
                target, value = self.at(d.target), self.at(d.value)
                off = items_of(value.way_to(target)) if isinstance(target, Pose) else items_of(target - value)
                out += [
                    (f"drive {name}[{k + 1}]", "rate" if rated else "position", x) for k, x in enumerate(off)
                ]
        for joint in m.tree.loops:
            if self.held(joint.name):
                at, k = self.view(joint), 0
                if connects(joint):
                    out += [
                        (f"loop {joint.name}[{k}]", "position", x)
                        for k, x in enumerate(self._apart(at, joint), 1)
                    ]
                for e in m.closures[joint.name]:
                    for x in items_of(at(e.left) - at(e.right)):
                        k += 1
                        out.append((f"loop {joint.name}[{k}]", "position", x))
        return out

    def _apart(self, at: Evaluator, joint: flat.Joint) -> list[Any]:
        """How far the sides of a connection are apart: places, then turns."""
        here, there = at(joint.value), at.name(joint.target)
        turn = [(here.R.T @ there.R)[1, 0]] if here.angle is not None else items_of(here.way_to(there))
        return [*items_of(there.p - here.p), *turn]

    # ------------------------------------------------------------ questions

    def question(self, q: flat.Query) -> Value:
        return self.meaning.ask(self, q)


def now(x: Any) -> Any:
    """The value at this instant, for each complex step."""
    if isinstance(x, Series):
        return x.v[0]
    return x


def items_of(x: Value) -> list[Any]:
    return list(np.ravel(x)) if isinstance(x, np.ndarray) else [x]


def numbers(x: Value) -> Value:
    out = np.empty(np.shape(x), object)
    for i in np.ndindex(*np.shape(x)):
        out[i] = now(x[i])
    return out


def at_order(x: Any, k: int) -> Any:
    return x.order(k) if isinstance(x, Series) else 0.0


def shaped(items: list[Any], shape: tuple[int, ...]) -> Value:
    if not shape:
        return items[0]
    return vector(*items).reshape(shape)
