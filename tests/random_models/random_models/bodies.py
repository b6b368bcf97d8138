"""Random trees of bodies on joints, in the plane and in space."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from random_models.coordinates import begins, initial_value, know
from random_models.operators import (
    add,
    call,
    der,
    element,
    vector,
)
from random_models.scope import Scope
from random_models.tree import (
    ACCELERATION,
    INERTIA,
    LENGTH,
    MASS,
    NUMBER,
    PRODUCT,
    RATE,
    SIGNED,
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
)

F = Fraction


def _frame(name: str) -> E:
    return reference(name, "frame", LENGTH, level="q", type="frame")


WORLD = reference("world", "world", LENGTH, type="frame")


_JOINTS: dict[int, tuple[tuple[float, str, tuple[tuple[str, str], ...]], ...]] = {
    2: (
        (4, "Revolute", (("angle", "angle"),)),
        (2, "Prismatic", (("position", "length"),)),
        (1, "Planar", (("x", "length"), ("y", "length"), ("angle", "angle"))),
        (0.6, "Free", (("x", "length"), ("y", "length"), ("angle", "angle"))),
        (1, "PinSlot", (("position", "length"), ("angle", "angle"))),
        (0.5, "Rolling", (("position", "length"),)),
        (0.5, "RollingOnCircle", (("angle", "angle"),)),
        (0.5, "Translation", (("position", "lengths"),)),
        (0.4, "Weld", ()),
    ),
    3: (
        (4, "Revolute", (("angle", "angle"),)),
        (2, "Prismatic", (("position", "length"),)),
        (1, "Cylindrical", (("position", "length"), ("angle", "angle"))),
        (0.6, "Screw", (("angle", "angle"),)),
        (1, "Universal", (("angle", "angles"),)),
        (1, "Spherical", (("orientation", "rotation"),)),
        (0.6, "Planar", (("x", "length"), ("y", "length"), ("angle", "angle"))),
        (1, "Free", (("position", "lengths"), ("orientation", "rotation"))),
        (0.5, "Translation", (("position", "lengths"),)),
        (0.4, "Weld", ()),
    ),
}


def joint_kinds(n: int) -> list[tuple[str, tuple[tuple[str, str], ...]]]:
    """List the joints with their coordinates, and what these are."""
    return [(kind, coordinates) for _, kind, coordinates in _JOINTS[n]]


def mod(target: str, sign: str, place: str, e: E) -> S:
    """Return one modification."""
    return statement("mod", f"{target} {sign} ", Slot(place, e), name=target, data={"sign": sign})


def given(s: Scope, target: str, d: Dim, value: Fraction | None = None) -> S:
    """Give a parameter of a component a positive value."""
    return mod(target, "=", "modification.parameter", s.value(d, value))


def _body(s: Scope) -> tuple[str, list[S], str]:
    """Choose a body with rotational inertia: its model, modifications, and the frames that others can use."""
    n = s.space
    m = [given(s, "m", MASS, s.number(0.5, 2))] if s.chance(0.85) else []
    kind = s.pick(
        ("Body", "Body", "Bar", "Bar", "Rod", "Disk", "Box", "Sphere") + (("Cylinder",) if n == 3 else ())
    )
    ends = "a"
    match kind:
        case "Body":
            if n == 2:
                m.append(given(s, "J", INERTIA, s.number(0.05, 0.5)))
            else:
                a, b = s.number(0.2, 0.3), s.number(0.2, 0.3)
                c, off = s.number(0.2, 0.3), s.number(-0.03, 0.03)
                if s.chance(0.5):
                    j = node("quantity", "diag({", (s.literal(NUMBER, a)), ", ", s.literal(NUMBER, b), ", ", s.literal(NUMBER, c), "} kg.m^2)", dim=INERTIA, shape=(3, 3),
                             value=lambda x, y, z: np.diag([x, y, z]))  # fmt: skip
                else:
                    rows = ((a, off, F(0)), (off, b, F(0)), (F(0), F(0), c))
                    inner = vector(
                        *(vector(*(s.literal(NUMBER, x) for x in row)) for row in rows), kind="matrix"
                    )
                    j = node(
                        "unit of a brace", inner, " kg.m^2", dim=INERTIA, shape=(3, 3), value=lambda x: x
                    )
                m.append(mod("J", "=", "modification.parameter", j))
            if s.chance(0.8):
                com = vector(*(s.literal(LENGTH, s.number(-0.6, 0.6)) for _ in range(n)))
                m.append(mod("com", "=", "modification.parameter", com))
        case "Bar" | "Rod":
            m.append(given(s, "l", LENGTH, s.number(0.5, 1.5)))
            ends = s.pick("bbca")
            if kind == "Rod" and s.chance(0.6):
                direction = vector(*(s.literal(NUMBER, s.number(-1, 1) or F(1)) for _ in range(n)))
                m.append(mod("direction", "=", "modification.structural", direction))
        case "Box":
            m.append(
                mod(
                    "size",
                    "=",
                    "modification.parameter",
                    vector(*(s.literal(LENGTH, s.number(0.3, 1)) for _ in range(n))),
                )
            )
        case _:
            m.append(given(s, "r", LENGTH, s.number(0.3, 0.9)))
            if s.chance(0.2) and kind != "Sphere":
                m.append(given(s, "inner", LENGTH, F("0.2")))
    return kind, m, ends


def tree(s: Scope) -> None:
    """Write bodies on joints that hang together."""
    n = s.space
    if s.chance(0.8) and "gravity" not in s.notes:
        s.notes.add("gravity")
        g = [F(0)] * (n - 1) + [s.number(-9.81, -3)]
        if s.chance(0.4):
            g[0] = s.number(-2, 2)
        s.add("gravity", "gravity ", Slot("gravity", vector(*(s.literal(ACCELERATION, x) for x in g))), ";")
    s.frames.append(WORLD)
    count = s.random.randint(6, 9) if s.chance(0.015) else s.random.choice((1, 1, 2, 2, 3))
    for _ in range(count):
        _hang(s, s.pick([f for f in s.frames if f.type == "frame"]))


def _hang(s: Scope, parent: E) -> None:
    n = s.space
    kind, mods, end = _body(s)
    slender = n == 3 and kind in ("Bar", "Rod")
    name = s.fresh("b")
    if s.chance(0.15):
        name = _own_body(s)
        end, slender = "", False
    else:
        s.add("component", f"{kind} {name}", Seq(tuple(mods), "list"), ";", name=name, data={"class": kind})
    frame = f"{name}.a" if end else name
    joint(s, parent, frame, slender)
    base = _frame(frame)
    s.frames.append(base)
    s.bodies.append(base)
    if end and end != "a":
        s.frames.append(_frame(f"{name}.{end}"))
    if s.chance(0.35):
        offset = vector(*(s.literal(LENGTH, s.number(-0.7, 0.7)) for _ in range(n)))
        if s.chance(0.5):
            new = s.fresh("f")
            pose = call("trans", offset, type="pose")
            place = node("frame*", (base, PRODUCT), " * ", (pose, SIGNED), dim=LENGTH, type="frame")
            s.add("frame", f"frame {new} = ", Slot("frame.value", place), ";", name=new)
            s.frames.append(_frame(new))
        else:
            new = s.fresh("r")
            place = node("frame*point", (base, PRODUCT), " * ", (offset, SIGNED), dim=LENGTH, type="point")
            s.add("point", f"point {new} = ", Slot("point.value", place), ";", name=new)
            s.frames.append(reference(new, "point", LENGTH, (n,), level="q", type="point"))


def _own_body(s: Scope) -> str:
    """Write a free frame with mass and inertia of its own."""
    n = s.space
    name = s.fresh("f")
    s.add("frame", f"frame {name};", name=name)
    if s.chance(0.5):
        at: E = _frame(name)
    else:
        offset = vector(*(s.literal(LENGTH, s.number(-0.5, 0.5)) for _ in range(n)))
        at = node("frame*point", (_frame(name), PRODUCT), " * ", (offset, SIGNED), dim=LENGTH, type="point")
    s.add(
        "mass", "mass ", Slot("mass.value", s.value(MASS, s.number(0.5, 2))), " at ", Slot("mass.at", at), ";"
    )
    if n == 2:
        s.add(
            "inertia",
            "inertia ",
            Slot("inertia.value", s.value(INERTIA, s.number(0.1, 0.6))),
            " on ",
            Slot("inertia.on", _frame(name)),
            ";",
        )
    else:
        d = vector(*(s.literal(INERTIA, s.number(0.2, 0.3)) for _ in range(3)))
        j = call("diag", d, dim=INERTIA, shape=(3, 3))
        s.add("inertia", "inertia ", Slot("inertia.value", j), " on ", Slot("inertia.on", _frame(name)), ";")
    return name


def _axis(s: Scope) -> E:
    """Return a direction, now and then along a coordinate axis or against it."""
    n = s.space
    if s.chance(0.45):
        along, sign = s.random.randrange(n), s.pick((F(-1), F(-1), F(1)))
        return vector(*(s.literal(NUMBER, sign if k == along else F(0)) for k in range(n)))
    return vector(*(s.literal(NUMBER, s.number(-1, 1) or F(1)) for _ in range(n)))


def joint(s: Scope, parent: E, frame: str, slender: bool, *, kind: str = "") -> str:
    """Place a frame by a joint with initial values."""
    n = s.space
    rows = list(_JOINTS[n])
    if slender:  # turning about its own axis would move nothing
        rows = [r for r in rows if r[1] in ("Prismatic", "Translation", "Weld")] + [
            (6, "Revolute", (("angle", "angle"),))
        ]
    if kind:
        rows = [r for r in rows if r[1] == kind]
    kind, coordinates = s.weighted((w, (k, c)) for w, k, c in rows)
    name = s.fresh("j")
    mods: list[S] = []
    e = Slot("component.from", parent)
    mods.append(statement("bind", e, f" -> {frame}", name="->"))
    if (kind in ("Revolute", "Prismatic", "PinSlot", "Cylindrical", "Screw") and n == 3) or kind in (
        "Prismatic",
        "PinSlot",
    ):
        if slender and kind == "Revolute":
            axis = vector(
                *(s.literal(NUMBER, x) for x in (s.number(-0.3, 0.3), s.number(0.3, 1), s.number(0.3, 1)))
            )
            mods.append(mod("axis", "=", "modification.structural", axis))
        elif s.chance(0.6):
            mods.append(mod("axis", "=", "modification.structural", _axis(s)))
    if kind == "Screw":
        mods.append(given(s, "pitch", LENGTH, s.number(0.2, 0.6)))
    if kind in ("Rolling", "RollingOnCircle"):
        mods.append(given(s, "r", LENGTH, s.number(0.3, 0.8)))
    later: list[tuple[str, str, str, E]] = []
    for coordinate_name, what in coordinates:
        full = f"{name}.{coordinate_name}"
        d = LENGTH if what.startswith("length") else NUMBER
        count = {"lengths": n, "angles": 2, "rotation": 3}.get(what, 0)
        sign = "~" if s.chance(0.9 if s.locked else 0.1) else "="
        rate_sign = "~" if s.chance(0.9 if s.locked else 0.1) else "="
        if what == "rotation":
            start: E = call(
                "axis_angle",
                vector(*(s.literal(NUMBER, s.number(-1, 1) or F(1)) for _ in range(3))),
                s.literal(NUMBER, s.number(-1, 1), angle=True),
                type="pose",
            )
            if s.chance(0.3):
                start = call("rotx", s.literal(NUMBER, s.number(-1, 1), angle=True), type="pose")
        elif count:
            start = vector(*(s.literal(d, s.number(-0.7, 0.7)) for _ in range(count)))
        else:
            start = initial_value(s, d, angle=what == "angle")
        rd = over(d, dim(0, 0, 1))
        rate = (
            vector(*(s.literal(rd, s.number(-1, 1)) for _ in range(count)))
            if count
            else s.literal(rd, s.number(-1, 1))
        )
        if s.chance(0.85):
            if s.chance(0.8):
                mods.append(mod(coordinate_name, sign, "modification.initial", start))
            else:
                later.append((full, sign, "initial.value", start))
            begins(s, full, sign, start)
        if s.chance(0.75):
            if s.chance(0.8):
                mods.append(mod(f"der({coordinate_name})", rate_sign, "modification.rate", rate))
            else:
                later.append((f"der({full})", rate_sign, "initial.rate", rate))
            begins(s, f"der({full})", rate_sign, rate)
        if what == "rotation":
            w = der(reference(full, "rotation", NUMBER, (4,), level="q"))
            w = E(w.kind, w.parts, RATE, (3,), w.level | {"v"})
            s.vectors.append(w)
            s.signals.append(element(w, s.random.randint(1, 3)))
        elif count:
            s.vectors.append(reference(full, "coordinate", d, (count,), level="q"))
            for i in range(1, count + 1):
                know(s, reference(f"{full}[{i}]", "coordinate", d, level="q"))
        else:
            know(s, reference(full, "coordinate", d, level="q"))
    s.add("component", f"{kind} {name}", Seq(tuple(mods), "list"), ";", name=name, data={"class": kind})
    for target, sign, place, e2 in later:
        s.add(
            "initial",
            f"initial {target} {sign} ",
            Slot(place, e2),
            ";",
            name=target,
            data={"guess": sign == "~"},
        )
    s.joints.append(name)
    return name


def observe(s: Scope) -> None:
    """Let expressions look at positions and velocities of the bodies."""
    n = s.space
    for f in s.random.sample(s.frames, min(len(s.frames), 3)):
        if f.ref == "world":
            continue
        i = s.random.randint(1, n)
        position = call("pos", f, dim=LENGTH, shape=(n,), level="q", type="real")
        velocity = call("vel", f, dim=over(LENGTH, dim(0, 0, 1)), shape=(n,), level="qv")
        s.signals += [element(position, i), element(velocity, s.random.randint(1, n))]
        s.vectors += [position, velocity]
        if f.type == "point":
            s.signals.append(element(f, i))
            s.vectors.append(f)
        other = s.pick([g for g in s.frames if g.type == "frame"])
        s.vectors.append(call("local", other, f, dim=LENGTH, shape=(n,), level="q"))
        s.vectors.append(call("vel", f, other, dim=over(LENGTH, dim(0, 0, 1)), shape=(n,), level="qv"))
        if other.ref != f.ref:
            away = vector(*(s.literal(LENGTH, s.number(0.2, 0.6)) for _ in range(n)))  # points may coincide
            s.signals.append(call("norm", add(s.vectors[-2], away), dim=LENGTH))
        s.vectors.append(call("vel_at", other, f, dim=over(LENGTH, dim(0, 0, 1)), shape=(n,), level="qv"))
        if f.type == "frame":
            if n == 2:
                s.signals.append(call("heading", f, level="q"))
                s.signals.append(call("angvel", f, dim=RATE, level="qv"))
            else:
                s.vectors.append(call("angvel", f, dim=RATE, shape=(3,), level="qv"))
                s.vectors.append(call("angvel", f, other, dim=RATE, shape=(3,), level="qv"))
            s.vectors.append(
                call(
                    "direction",
                    f,
                    vector(*(s.literal(NUMBER, s.number(-1, 1)) for _ in range(n))),
                    shape=(n,),
                    level="q",
                )
            )
            s.vectors.append(call("components", f, velocity, dim=velocity.dim, shape=(n,), level="qv"))
