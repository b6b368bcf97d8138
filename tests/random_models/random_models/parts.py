"""Parts of the library with all that they can be told: solids, what stays on surfaces and rolls, springs and motors between hinges."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from random_models.bodies import WORLD, given, joint, joint_kinds, mod
from random_models.closing import direction, hung, placed, push
from random_models.driven import ask, course
from random_models.operators import call, vector
from random_models.scope import Scope
from random_models.tree import (
    ENERGY,
    FORCE,
    INERTIA,
    LENGTH,
    MASS,
    NUMBER,
    RATE,
    Dim,
    E,
    S,
    Seq,
    Slot,
    dim,
    node,
    over,
    reference,
    statement,
    times,
)

SHARE = 0.15
"""Of the models with bodies."""
F = Fraction
DENSITY, STIFFNESS, CHARGE = dim(1, -3), ENERGY, dim(0, 0, 1, 1)
Size = tuple[str, float, float, float]
"""A parameter, its least and largest value, and how often it is given."""

_OUTER, _INNER = ("r", 0.3, 0.6, 0.9), ("inner", 0.1, 0.25, 0.5)
_SOLIDS: dict[int, dict[str, tuple[Size, ...]]] = {
    2: {
        "Particle": (),
        "Disk": (_OUTER, _INNER, ("thickness", 0.3, 0.8, 0.6)),
        "Box": (("size", 0.3, 0.8, 0.9), ("depth", 0.3, 0.8, 0.6)),
        "Sphere": (_OUTER, _INNER),
    },
    3: {
        "Particle": (),
        "Disk": (_OUTER, _INNER),
        "Box": (("size", 0.3, 0.8, 0.9),),
        "Cylinder": (_OUTER, _INNER, ("l", 0.3, 1, 0.8)),
        "Sphere": (_OUTER, _INNER),
        "Hemisphere": (_OUTER,),
        "Frustum": (_OUTER, ("top", 0.1, 0.5, 0.8), ("h", 0.3, 1, 0.8)),
        "Cone": (_OUTER, ("h", 0.3, 1, 0.8)),
        "Ellipsoid": (("radii", 0.3, 0.7, 0.9),),
        "Torus": (("r", 0.4, 0.8, 0.9), ("section", 0.1, 0.25, 0.8)),
        "Polyhedron": (("corners", 0.5, 1, 0.7),),
    },
}
_ENDS = {"Hemisphere": "c", "Frustum": "bc", "Cone": "bc", "Polyhedron": "c"}


def parts(s: Scope, seed: int) -> None:
    """Write one part, and what tells how it acts. Its random numbers are its own: models keep all else."""
    if not s.space:
        return
    with s.apart(f"parts of {seed}"):
        if s.chance(SHARE):
            s.weighted(((4, _solid), (3, _acting), (2, _coupled), (4 if s.space == 3 else 0, _kept)))(s)


def told(s: Scope, kind: str, name: str, mods: list[S]) -> None:
    """Declare a component."""
    s.add("component", f"{kind} {name}", Seq(tuple(mods), "list"), ";", name=name, data={"class": kind})


def frame_of(name: str) -> E:
    """Return a frame by its name."""
    return reference(name, "frame", LENGTH, level="q", type="frame")


# ---------------------------------------------------------------- solids


def _solid(s: Scope) -> None:
    """A solid by its mass or its density, on any joint, with a force and a torque."""
    n, name = s.space, s.fresh("b")
    kind = s.pick(_SOLIDS[n])
    dense = kind != "Particle" and (n, kind) != (3, "Disk") and s.chance(0.55)
    mods = [_size(s, kind, size) for size in _SOLIDS[n][kind] if s.chance(size[3])]
    if dense:
        mods.append(given(s, "density", DENSITY, s.number(3, 12)))
    elif s.chance(0.9):
        mods.append(given(s, "m", MASS, s.number(0.5, 2)))
    if n == 3 and kind in ("Disk", "Cylinder") and s.chance(0.7):
        mods.append(mod("axis", "=", "modification.structural", direction(s)))
    s.random.shuffle(mods)
    told(s, kind, name, mods)
    at = WORLD if s.chance(0.6) else s.pick(f for f in s.frames if f.type == "frame")
    fits = ("Translation", "Prismatic") if kind == "Particle" else [k for k, c in joint_kinds(n) if c]
    joint(s, at, f"{name}.a", False, kind=s.pick(fits))
    frame = frame_of(f"{name}.a")
    push(s, frame)
    if kind != "Particle":
        ask(
            s,
            call(
                "inertia_tensor",
                frame,
                dim=INERTIA,
                shape=() if n == 2 else (3, 3),
                level="" if n == 2 else "q",
            ),
        )
    ask(s, call("mass_centre", frame, dim=LENGTH, shape=(n,), level="q"))
    for end in _ENDS.get(kind, ""):
        ask(s, call("pos", frame_of(f"{name}.{end}"), dim=LENGTH, shape=(n,), level="q"))


def _size(s: Scope, kind: str, size: Size) -> S:
    name, low, high, _ = size
    if name == "corners":
        rows = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
        moved = [
            vector(*(s.literal(LENGTH, s.number(low, high) if x else s.number(-0.1, 0.1)) for x in row))
            for row in rows
        ]
        return mod(name, "=", "modification.parameter", vector(*moved, kind="matrix"))
    if name in ("size", "radii"):
        edges = (s.literal(LENGTH, s.number(low, high)) for _ in range(s.space))
        return mod(name, "=", "modification.parameter", vector(*edges))
    return given(s, name, LENGTH, s.number(low, high))


# ---------------------------------------------------------------- on surfaces


def _kept(s: Scope) -> None:
    """A body that a plane, a quadric or rolling keeps, with the forces of that."""
    body, _ = hung(s, "Free", WORLD)
    ground = _ground(s)
    kind, name = s.pick(("PointOnPlane", "PointOnQuadric", "RollingSphere", "RollingDisk")), s.fresh("k")
    to = placed(s, body) if kind.startswith("Point") and s.chance(0.7) else body
    mods = [statement("bind", Slot("component.from", ground), " -> ", Slot("component.to", to), name="->")]
    counts: dict[str, int] = {"ground": 0, "roll": 2} if kind.startswith("Rolling") else {}
    if kind == "PointOnPlane":
        counts = {"plane": 0}
    elif kind == "PointOnQuadric":
        counts = {"surface": 0}
        if s.chance(0.8):
            mods.append(mod("A", "=", "modification.parameter", _form(s)))
        if s.chance(0.6):
            slopes = (s.literal(dim(0, -1), s.number(-0.5, 0.5)) for _ in range(3))
            mods.append(mod("b", "=", "modification.parameter", vector(*slopes)))
        if s.chance(0.5):
            mods.append(mod("c", "=", "modification.parameter", s.literal(NUMBER, s.number(0.6, 1.5))))
    elif s.chance(0.9):
        mods.append(given(s, "r", LENGTH, s.number(0.3, 0.7)))
    if kind == "RollingDisk":  # it must not lie flat
        axis = (F(1), s.number(-0.5, 0.5), s.number(-0.3, 0.3))
        mods.append(
            mod("axis", "=", "modification.structural", vector(*(s.literal(NUMBER, x) for x in axis)))
        )
    told(s, kind, name, mods)
    push(s, body)
    for row, count in counts.items():
        d = over(ENERGY, NUMBER if row == "surface" else LENGTH)
        if row == "roll":
            d = times(FORCE, NUMBER)
        ask(
            s,
            call(
                "multiplier",
                reference(f"{name}.{row}", "constraint"),
                dim=d,
                shape=(count,) if count else (),
                level="qva",
            ),
        )
    ask(s, call("pos", to, dim=LENGTH, shape=(3,), level="q"))


def _ground(s: Scope) -> E:
    """The world, a body that turns, or a frame at rest that is tilted a little."""
    if s.chance(0.7):
        return hung(s, "Revolute", WORLD)[0] if s.chance(0.6) else WORLD
    name = s.fresh("f")
    offset = vector(*(s.literal(LENGTH, s.number(-0.2, 0.2)) for _ in range(3)))
    turn = call(s.pick(("rotx", "roty")), s.literal(NUMBER, s.number(-0.5, 0.5), angle=True), type="pose")
    moved = node("pose*", (call("trans", offset, type="pose"), 6), " * ", (turn, 7), binding=6, type="pose")
    pose = node("frame*", (WORLD, 6), " * ", (moved, 7), dim=LENGTH, type="frame")
    s.add("frame", f"frame {name} = ", Slot("frame.value", pose), ";", name=name)
    return frame_of(name)


def _form(s: Scope) -> E:
    """A symmetric, positive matrix."""
    a, b, c = (s.number(1.2, 3) for _ in range(3))
    x, y, z = (s.number(-0.4, 0.4) for _ in range(3))
    rows = ((a, x, y), (x, b, z), (y, z, c))
    return vector(*(vector(*(s.literal(dim(0, -2), v) for v in row)) for row in rows), kind="matrix")


# ---------------------------------------------------------------- between hinges


def _acting(s: Scope) -> None:
    """Two bodies on hinges, and what acts between them or against the world."""
    n = s.space
    (first, one), (second, _) = hung(s, "Revolute", WORLD), hung(s, "Revolute", WORLD)
    frm = WORLD if s.chance(0.4) else second
    kind, name = (
        s.pick(("TorsionSpring", "TorsionDamper", "Motor", "SpeedMotor", "Spring", "Coulomb")),
        s.fresh("c"),
    )
    mods = [statement("bind", Slot("component.from", frm), " -> ", Slot("component.to", first), name="->")]
    turned = reference(f"{one}.angle", "coordinate", NUMBER, level="q")
    if n == 3 and kind.startswith("Torsion"):
        mods = [mod("angle", "=", "modification.input", turned)]
    if n == 3 and kind.endswith("Motor") and s.chance(0.8):
        mods.append(mod("axis", "=", "modification.structural", direction(s)))
    if kind in ("Spring", "Coulomb"):
        far = Slot("component.from", _far(s, frm))
        mods = [statement("bind", far, " -> ", Slot("component.to", placed(s, first)), name="->")]
    for target, make, share in _ACTING[kind]:
        if s.chance(share):
            mods.append(make(s, target))
    told(s, kind, name, mods)
    ask(s, turned)


def _far(s: Scope, frame: E) -> E:
    """A frame that is far from all others, so that ends never meet."""
    offset = vector(*(s.literal(LENGTH, x) for x in ((F("2.1"), F("-2.7"), F("3.3"))[: s.space])))
    name = s.fresh("f")
    pose = node(
        "frame*", (frame, 6), " * ", (call("trans", offset, type="pose"), 7), dim=LENGTH, type="frame"
    )
    s.add("frame", f"frame {name} = ", Slot("frame.value", pose), ";", name=name)
    return frame_of(name)


Make = Callable[[Scope, str], S]


def _number(d: Dim, low: float, high: float, *, angle: bool = False) -> Make:
    return lambda s, target: mod(
        target, "=", "modification.parameter", s.literal(d, s.number(low, high), angle=angle)
    )


def _moving(d: Dim) -> Make:
    """What goes on with time."""
    return lambda s, target: mod(target, "=", "modification.input", course(s, d))


def _charge(s: Scope, target: str) -> S:
    return mod(target, "=", "modification.parameter", s.literal(CHARGE, s.number(0.5, 2) / 100000))


def _permittivity(s: Scope, target: str) -> S:
    value = s.literal(dim(-1, -3, 4, 2), s.number(1, 9) / 10**11)
    return mod(target, "=", "modification.parameter", value)


_ACTING: dict[str, tuple[tuple[str, Make, float], ...]] = {
    "TorsionSpring": (
        ("k", _number(STIFFNESS, 0.5, 4), 0.8),
        ("rest", _number(NUMBER, -1, 1, angle=True), 0.7),
    ),
    "TorsionDamper": (("c", _number(dim(1, 2, -1), 0.1, 0.8), 0.8),),
    "Motor": (("drive_torque", _moving(ENERGY), 0.9),),
    "SpeedMotor": (("gain", _number(dim(1, 2, -1), 0.2, 1), 0.8), ("speed", _moving(RATE), 0.9)),
    "Spring": (("k", _number(dim(1, 0, -2), 0.5, 4), 0.7), ("rest", _number(LENGTH, 0.3, 2), 0.5)),
    "Coulomb": (
        ("q1", _charge, 1.0),
        ("q2", _charge, 1.0),
        ("epsilon0", _permittivity, 0.5),
    ),
}


def _coupled(s: Scope) -> None:
    """Bodies on hinges and sliders that a coupling ties together, with its offset and its force."""
    s.notes.add("couplings")
    kind, name = s.pick(("Gear", "Belt", "Rack", "Planetary", "Distance")), s.fresh("k")
    (first, one), (second, two) = (
        hung(s, "Revolute", WORLD),
        hung(s, "Prismatic" if kind == "Rack" else "Revolute", WORLD),
    )
    angle = reference(f"{one}.angle", "coordinate", NUMBER, level="q")
    row, mods = "mesh", [_radius(s, "r1"), _radius(s, "r2")]
    if kind == "Distance":
        row, mods = (
            "rod",
            [
                statement(
                    "bind",
                    Slot("component.from", _far(s, first)),
                    " -> ",
                    Slot("component.to", placed(s, second)),
                    name="->",
                ),
                mod(
                    "l",
                    "=",
                    "modification.parameter",
                    s.literal(LENGTH, s.number(4, 5) if s.space == 3 else s.number(3, 3.5)),
                ),
            ],
        )
    elif kind == "Rack":
        slid = reference(f"{two}.position", "coordinate", LENGTH, level="q")
        mods = [
            mod("angle", "=", "modification.input", angle),
            mod("position", "=", "modification.input", slid),
            _radius(s, "r"),
        ]
    else:
        other = reference(f"{two}.angle", "coordinate", NUMBER, level="q")
        if kind == "Planetary":
            _, three = hung(s, "Revolute", WORLD)
            third = reference(f"{three}.angle", "coordinate", NUMBER, level="q")
            mods = [
                mod(k, "=", "modification.input", q)
                for k, q in (("sun", angle), ("ring", other), ("carrier", third))
            ]
            mods += [_radius(s, "r_sun"), _radius(s, "r_ring")]
        else:
            mods += [
                mod("angle1", "=", "modification.input", angle),
                mod("angle2", "=", "modification.input", other),
            ]
            row = "mesh" if kind == "Gear" else "strand"
    if kind in ("Gear", "Belt", "Rack") and s.chance(0.6):
        mods.append(mod("offset", "=", "modification.parameter", s.literal(LENGTH, s.number(-0.2, 0.2))))
    told(s, kind, name, mods)
    ask(s, call("multiplier", reference(f"{name}.{row}", "constraint"), dim=FORCE, level="qva"))
    ask(s, angle)


def _radius(s: Scope, name: str) -> S:
    return given(s, name, LENGTH, s.number(0.3, 0.8))
