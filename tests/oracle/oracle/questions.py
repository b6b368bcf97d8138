"""Questions about the motion, by their definitions (language, section 13)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.compiler.flat import model as flat
from oracle import poses
from oracle.expressions import Value, der, position
from oracle.point import Point, at_order, items_of, now, numbers, shaped
from oracle.poses import Pose, vector
from oracle.series import STEP, Series
from oracle.start import shift
from oracle.values import NotCovered, Undetermined

if TYPE_CHECKING:
    from oracle.meaning import Meaning

IMPLICIT = (
    "reaction",
    "moment",
    "power",
)  # answers that are unknowns where laws depend on them: power of a friction


def key_of(q: flat.Query) -> tuple[str, str, str]:
    return q.function, q.target, repr(q.arguments)


def known_now(x: Any, e: Any = None) -> Series:
    """A quantity of which only the value at this instant is known, and perhaps its displacements ``e``."""
    return Series(np.atleast_1d(np.asarray(x, complex))[None], None if e is None else e[None])


def decided(meaning: Meaning, point: Point, name: str, f: Callable[[Point], list[Any]]) -> list[Series]:
    """Numbers that the state decides: where forces come from their derivatives, with those by all displacements.

    Each comes from a complex step of the state; what turns a body by a constant angle turns its angular velocity, too.
    """
    values = f(point)
    if name not in meaning.felt:
        return [known_now(x) for x in values]
    key = f"decided {name}"
    if key not in point.at.memo:
        n = 2 * point.size
        if any(np.size(point.state[x]) > 1 for x in meaning.all_rates):
            raise NotCovered("a derivative of what contains a derivative by velocities")
        step = 1j * STEP * np.eye(n)
        places, rates = step[0 : 2 * meaning.size : 2], step[1 : 2 * meaning.size : 2].copy()
        for _, shape, _, names, first in meaning.coordinate_layout:
            if shape is None:
                w, turn = [point.state[x] for x in names], places[first : first + 3]
                rates[first : first + 3] += [
                    w[1] * turn[2] - w[2] * turn[1],
                    w[2] * turn[0] - w[0] * turn[2],
                    w[0] * turn[1] - w[1] * turn[0],
                ]
        freedoms = list(range(meaning.size))
        state = shift(meaning, point.state, places, freedoms, False)
        state = shift(meaning, state, rates, freedoms, True)
        beside = type(point)(
            meaning,
            state,
            replace(point.unknowns, a=meaning.unasked, forces={}, rates={}, answers={}),
            point.cut,
            point.at.frozen,
            point.modes,
            step[2 * meaning.size :],
        )
        point.at.memo[key] = [
            np.broadcast_to(np.asarray(x, complex).imag / STEP, n)[:, None] for x in f(beside)
        ]
    return [known_now(x, e) for x, e in zip(values, point.at.memo[key], strict=True)]


def force_of(point: Point, name: str) -> Series:
    if name not in point.unknowns.forces:
        if point.unknowns.a is point.meaning.unasked:
            raise NotCovered("a force where none is known")
        return known_now(0.0)
    if name in point.meaning.superfluous:
        raise Undetermined(f"the force of {name}, among superfluous constraints")
    return known_now(point.unknowns.forces[name])


def answer(meaning: Meaning, point: Point, q: flat.Query, defining: bool = False) -> Value:
    """The answer at a point; where laws ask, it has been assumed."""
    key = key_of(q)
    if key in point.unknowns.answers and not defining:
        return point.unknowns.answers[key]
    if key in point.asked:
        raise NotCovered("a question that its own answer seems to need")
    point.asked.add(key)
    try:
        return formed(meaning, point, q)
    finally:
        point.asked.discard(key)


def formed(meaning: Meaning, point: Point, q: flat.Query) -> Value:
    """The answer, of which nothing is known."""
    match q.function:
        case "kinetic_energy":
            return point.kinetic()
        case "potential_energy":
            return point.potential()
        case "energy":
            return decided(meaning, point, "energy ", lambda p: [p.total_energy()])[0]
        case "momentum":
            return momentum(meaning, point, q.target)
        case "multiplier":
            return multiplier(meaning, point, q.target)
        case "closed":
            contact = any(c.name == q.target for c in meaning.flat.contacts)
            if contact:
                return point.modes.get(q.target, "open") != "open"
            return point.held(q.target)
        case "reaction" if q.target in meaning.drive_names:
            shape = q.type.shape
            count = int(np.prod(shape))
            return shaped([force_of(point, f"drive {q.target}[{k + 1}]") for k in range(count)], shape)
        case "reaction" | "moment":
            load = load_at(meaning, point, q.target)
            d = point.space
            if q.function == "reaction":
                return vector(*load[:d])
            return load[2] if d == 2 else vector(*load[3:])
        case "power":
            return power(meaning, point, q)
        case "mass_centre":
            masses = bodies_of(meaning, point, q)[0]
            m = sum(x for x, _ in masses)
            return sum((P * (x / m) for x, P in masses[1:]), masses[0][1] * (masses[0][0] / m))
        case "inertia_tensor":
            return inertia_tensor(meaning, point, q)
    raise NotCovered(f"the question {q.function}")


def momentum(meaning: Meaning, point: Point, target: str) -> Value:
    for name, shape, elements, _, first in meaning.coordinate_layout:
        if name == target:
            own = slice(first, first + (3 if shape is None else len(elements)))
            items = decided(meaning, point, f"momentum {target}", lambda p, own=own: list(p.momenta()[own]))  # type: ignore[misc]
            return shaped(items, (3,) if shape is None else shape)
    raise NotCovered(f"the momentum of {target}")


def multiplier(meaning: Meaning, point: Point, target: str) -> Value:
    for c in meaning.flat.constraints:
        if c.name == target:
            shape = np.broadcast_shapes(c.left.type.shape, c.right.type.shape)
            return shaped([force_of(point, f"{target}[{k + 1}]") for k in range(int(np.prod(shape)))], shape)
    if any(c.name == target for c in meaning.flat.contacts):
        return force_of(point, target)
    raise NotCovered(f"the multiplier of {target}")


def load_at(meaning: Meaning, point: Point, joint: str) -> list[Series]:
    """The load of a cut, formed once at a point: force and moment are asked for by themselves."""
    key = joint, meaning.superfluous
    if key not in point.loads:
        point.loads[key] = cut_load(meaning, point, joint)
    return point.loads[key]


def cut_load(meaning: Meaning, point: Point, joint: str) -> list[Series]:
    """Force and moment on the `to` side of a joint: what holds the freedoms of a cut (decision of section 9).

    In the tree the cut carries all that hangs on the joint; in a loop it moves only what the joint itself sees, so
    that the load is the force of the joint on its own displacement.
    """
    cut = Point(meaning, point.state, point.unknowns, joint, point.at.frozen, point.modes)
    rows = (cut.inertial() - cut.applied())[meaning.size :]
    if any(j.name == joint for j in meaning.tree.loops):
        for name, _, value in cut.rows():
            if name in meaning.superfluous and np.abs(cut.moved(value)[meaning.size :]).max() > 0:
                raise Undetermined(f"the load of {joint}, among superfluous constraints")
        sign = -1
    else:
        if meaning.superfluous:
            for name, kind, value in cut.rows():
                if (
                    name in meaning.superfluous
                    and np.abs(cut.moved(value, kind == "rate")[meaning.size :]).max() > 0
                ):
                    raise Undetermined(f"the load of {joint}, among superfluous constraints")
        sign = -1 if joint in meaning.tree.backwards else 1
    return [known_now(sign * row) for row in rows]


def power(meaning: Meaning, point: Point, q: flat.Query) -> Value:
    """Force times velocity: of a named force, torque, damping, friction; of a force on a coordinate."""
    if q.arguments:
        force, on = (point.at(a) for a in q.arguments)
        return sum(f * v for f, v in zip(np.ravel(np.asarray(force, object)), rates(on), strict=True))
    for load in meaning.flat.loads:
        if load.name == q.target:
            return load_power(point, load)
    for damping in meaning.flat.dampings:
        if damping.name == q.target:
            return damping_power(meaning, point, damping)
    for friction in meaning.flat.frictions:
        if friction.name == q.target:
            rate = der(point.at(friction.on))
            if point.modes.get(friction.name) == "stick":
                return 0.0
            f = known_now(now(point.at(friction.kinetic)))
            if meaning.smooth(friction.options):
                scale = now(point.at(friction.options["v_stick"]))
                return f * rate * known_now(-np.tanh(now(rate) / scale))
            return f * rate * -point.direction(point.modes.get(friction.name, "slip"), rate)
    raise NotCovered(f"the power of {q.target}")


def damping_power(meaning: Meaning, point: Point, damping: flat.Damping) -> Value:
    """-c s^2 - 1/2 s^2 sum(v dc/dv) (section 13)."""
    coefficients = np.ravel(np.asarray(point.at(damping.value), object))
    bent = [point.moved(c, True) for c in coefficients]
    speeds = point.rates(damping.on)
    if not any(np.any(b) for b in bent):
        return point.at(damping.value) * sum(s * s for s in speeds) * -1.0
    many = list(range(len(speeds))) if len(coefficients) > 1 else [0] * len(speeds)

    def lost(p: Point) -> list[Any]:
        v = [p.state[name] for name in meaning.all_rates]
        factors = np.ravel(np.asarray(p.at(damping.value), object))
        total: Any = 0.0
        for s, k in zip(p.rates(damping.on), many, strict=True):
            further = sum((x * row for x, row in zip(v, p.moved(factors[k], True), strict=False)), 0.0)
            total = total - now(s) ** 2 * (now(factors[k]) + 0.5 * further)
        return [total]

    return decided(meaning, point, f"power {damping.name}", lost)[0]


def rates(x: Value) -> list[Any]:
    return list(np.ravel(np.asarray(der(np.asarray(x, object)), object)))


def load_power(point: Point, load: flat.Load) -> Any:
    value = point.at(load.value)
    if load.frame is not None and (point.space == 3 or load.kind == "force"):
        value = point.at(load.frame).R @ np.asarray(value, object)
    force = np.ravel(np.asarray(value, object))
    total: Any = 0.0
    for where, sign in ((load.on, 1), (load.source, -1)):
        if where is None:
            continue
        x = point.at(where)
        if load.kind == "torque" and isinstance(x, Pose):
            v: list[Any] = items_of(point.at.angular_velocity(x))
        elif load.at is not None:
            w, d = point.at.angular_velocity(x), numbers(position(point.at(load.at))) - numbers(x.p)
            arm = vector(*(known_now(s) for s in d))
            v = rates(x.p) + (vector(-w * arm[1], w * arm[0]) if point.space == 2 else poses.cross(w, arm))
        else:
            v = point.rates(where)
        total = total + sign * sum(f * s for f, s in zip(force, v, strict=True))
    return total


def bodies_of(meaning: Meaning, point: Point, q: flat.Query) -> tuple[list[Any], list[Any]]:
    """Masses ``(m, P)`` and inertias ``(J, frame)`` of the whole model or of the rigid body of a frame."""
    masses = [(point.at(m.value), np.asarray(position(point.at(m.at)), object)) for m in meaning.flat.masses]
    inertias = [(point.at(j.value), point.at(j.on)) for j in meaning.flat.inertias]
    if not q.arguments and not q.target:
        return masses, inertias
    own_masses, own_inertias = meaning.rigid(q)
    return [masses[i] for i in own_masses], [inertias[i] for i in own_inertias]


def frame_of(point: Point, q: flat.Query) -> Pose:
    return point.at(q.arguments[0]) if q.arguments else point.at.name(q.target)  # type: ignore[no-any-return]


def rigidly_with(point: Point, frame: Pose, x: Value) -> bool:
    """Whether nothing moves a point or frame against a frame (asked for at a place without symmetry)."""
    seen = frame.R.T @ (position(x) - frame.p)
    items = list(seen)
    if isinstance(x, Pose):
        items += [*np.ravel(frame.R.T @ x.R)]
    return all(
        abs(at_order(s, 1)).max() < 1e-9 and np.abs(point.moved(s)).max() < 1e-9
        for s in items
        if isinstance(s, Series)
    )


def inertia_tensor(meaning: Meaning, point: Point, q: flat.Query) -> Value:
    masses, inertias = bodies_of(meaning, point, q)
    frame, d = frame_of(point, q), point.space
    m = sum(x for x, _ in masses) if masses else 0.0
    centre = (
        sum((P * (x / m) for x, P in masses[1:]), masses[0][1] * (masses[0][0] / m)) if masses else frame.p
    )
    total: Any = 0.0 if d == 2 else np.zeros((3, 3)).astype(object)
    for J, on in inertias:
        R = frame.R.T @ on.R
        total = total + (J if d == 2 else R @ ((J + J.T) / 2) @ R.T)
    for x, P in masses:
        r = frame.R.T @ (P - centre)
        square = sum(s * s for s in r)
        if d == 2:
            total = total + x * square
        else:
            total = (
                total
                + (np.eye(3).astype(object) * square - poses.matrix([[a * b for b in r] for a in r])) * x
            )
    return total
