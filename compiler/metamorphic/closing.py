"""A joint of the tree as a closure: what it carried moves freely, and its equations hold it."""

from __future__ import annotations

from random import Random

import numpy as np
from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter

from ..flat import types
from ..flat.model import Apply, Array, Expression, FlatModel, Joint, Name, Query, Role, Switch, Variable
from ..flat.operands import parts, stated
from ..mechanics.kinematics.topology import TreeEdge, classify, root_of
from .asked import ModelFacts, defined_by, felt
from .coordinates import held_coordinates
from .rewriting import apply, measured, number, undrawn
from .starts import begun, rate_name
from .twin import ACCOUNTS, NotApplicable, Seen, Twin

PLACE, TURN = "freed place", "freed turn"
THIN = 1e-9
"""Inertia about a line, as a share of the largest, that counts as none."""
HALF_TURN = 3.0
"""Angles that go beyond are told by a closure up to whole turns only [rad]."""


def joint_as_closure(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Let a joint of the tree close a loop: the frame that it placed gets a place and a turn of its own."""
    if seen is None:
        raise NotApplicable("where its frames are at the start is not known")
    if felt(model, {"momentum"}):
        raise NotApplicable("a law asks for a momentum, which is that of what each coordinate carries")
    tree = classify(model, Reporter()).tree
    held = held_coordinates(model)
    fit = [
        edge.joint for edge in tree if _fits(model, edge, seen, held) and not _thin(model, edge.joint, seen)
    ]
    if not fit:
        raise NotApplicable(
            "no joint of its tree has equations of a closure, with coordinates that nothing prescribes and that stay "
            "within half a turn, and carries what has inertia about every line"
            if tree
            else "it has no joints"
        )
    joint = random.choice(fit)
    span = joint.origin.span
    n = model.space
    target = Name(type=types.FRAME, span=span, name=joint.target)
    length, spin = measured(model, "length", (n,)), measured(model, "rate", (3,) if n == 3 else ())
    place = Variable(PLACE, Role.COORDINATE, length, joint.origin)
    turn = Variable(TURN, Role.COORDINATE, types.ROTATION if n == 3 else types.ANGLE, joint.origin)
    at = Name(type=length, span=span, name=PLACE)
    turned: Expression = Name(type=turn.type, span=span, name=TURN)
    pose: Expression = Name(type=types.FRAME, span=span, name="world")
    turned = turned if n == 3 else apply("rot", types.POSE, turned)
    for step in (apply("trans", types.POSE, at), turned):
        pose = apply("multiply", types.FRAME, pose, step)
    free = Joint("freed", "world", joint.target, joint.target, pose, (PLACE, TURN), (), False, joint.origin)
    wanted: list[Expression] = [
        apply("pos", length, target),
        apply("vel", measured(model, "velocity", (n,)), target),
    ]
    w: Expression = apply("angvel", spin, target)
    wanted += [w if n == 2 else apply("components", spin, target, w)]
    wanted += [apply("heading", types.ANGLE, target)] if n == 2 else _axes(target, model)
    where, speed, rate, *angles = seen.evaluated(wanted)
    start = dict(seen.first)
    for k in range(n):
        start[f"{PLACE}[{k + 1}]"] = where[k]
        start[rate_name(f"{PLACE}[{k + 1}]")] = speed[k]
    if n == 2:
        start |= {TURN: angles[0][0], rate_name(TURN): rate[0]}
    else:
        start |= {f"{TURN}[{k + 1}]": x for k, x in enumerate(_quaternion(angles))}
        start |= {f"{rate_name(TURN)}[{k + 1}]": x for k, x in enumerate(rate)}
    made = replace(undrawn(model), variables=(*model.variables, place, turn), joints=(free, *model.joints))
    return Twin(
        "joint as closure",
        f"the joint '{joint.name}' closes a loop",
        begun(made, start),
        ACCOUNTS | {"momentum"} | defined_by(model, {"momentum"}),
        start=start,
    )


def _fits(model: FlatModel, edge: TreeEdge, seen: Seen, held: set[str]) -> bool:
    joint = edge.joint
    own = {v.name: v for v in model.variables if v.name in joint.coordinates}
    switched = {
        a.target for e in model.events for b in e.branches for a in b.actions if isinstance(a, Switch)
    }
    asked = {p.target for p in parts(stated(model)) if isinstance(p, Query)}
    angles = [
        n
        for n in seen.largest
        for v in own.values()
        if _is_of(n, v.name) and not v.type.shape and v.type.angle
    ]
    return (
        bool(joint.coordinates and joint.closures)
        and not edge.backwards
        and not joint.cut
        and joint.name not in switched
        and not asked & set(joint.coordinates)
        and not ModelFacts(model).within(*stated(model.equations)) & set(joint.coordinates)
        and not held & set(joint.coordinates)
        and all(seen.largest[n] < HALF_TURN for n in angles)
    )


def _thin(model: FlatModel, joint: Joint, seen: Seen) -> bool:
    """Tell whether a joint carries what has no inertia about some line, about which nothing but the joint holds it."""
    definitions = {d.name: d for d in model.definitions}
    if model.space != 3 or joint.target not in {root_of(m.at, definitions) for m in model.masses}:
        return False
    span, kind = (
        joint.origin.span,
        types.real(types.NUMBER.dimension if model.dimensionless else types.INERTIA, (3, 3)),
    )
    frame = Name(type=types.FRAME, span=span, name=joint.target)
    asked = Query(type=kind, span=span, function="inertia_tensor", target="", arguments=(frame,))
    sizes = np.linalg.eigvalsh(np.reshape(seen.evaluated([asked])[0], (3, 3)))
    return bool(sizes[0] <= THIN * sizes[-1])


def _is_of(state: str, name: str) -> bool:
    return state == name or state.startswith(f"{name}[")


def _axes(frame: Expression, model: FlatModel) -> list[Expression]:
    """Return the axes of a frame in the world."""
    found: list[Expression] = []
    for k in range(3):
        entries = tuple(number(float(i == k), types.NUMBER, frame.span) for i in range(3))
        axis = Array(type=types.real(shape=(3,)), span=frame.span, elements=entries)
        found.append(Apply(type=axis.type, span=frame.span, function="direction", arguments=(frame, axis)))
    return found


def _quaternion(axes: list[list[float]]) -> list[float]:
    """Return the unit quaternion, scalar part first, of a rotation by its axes; by the largest entry, which no rounding
    makes small."""
    (xx, yx, zx), (xy, yy, zy), (xz, yz, zz) = axes
    squares = (1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz)
    largest = max(range(4), key=lambda k: squares[k])
    x, y, z = zy - yz, xz - zx, yx - xy
    rows = (
        (squares[0], x, y, z),
        (x, squares[1], yx + xy, xz + zx),
        (y, yx + xy, squares[2], zy + yz),
        (z, xz + zx, zy + yz, squares[3]),
    )
    size = 2 * squares[largest] ** 0.5
    return [entry / size for entry in rows[largest]]
