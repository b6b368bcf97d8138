"""Loops as people compose them: parts with a root and a tip, bodies connected by value, names of names at the joints."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from random_models.bodies import WORLD, mod
from random_models.closing import direction, hung, placed, push
from random_models.driven import ask
from random_models.operators import call, multiply, vector
from random_models.scope import Scope
from random_models.structure import model_statement
from random_models.tree import (
    ENERGY,
    FORCE,
    INERTIA,
    LENGTH,
    MASS,
    NUMBER,
    E,
    S,
    Seq,
    Slot,
    reference,
    statement,
)

SHARE, PINNED, FOLLOWED = 0.12, 0.05, 0.02
"""Of the models with bodies."""
F = Fraction
_CARRIERS = {2: ("Revolute", "Prismatic", "PinSlot"), 3: ("Revolute", "Spherical", "Cylindrical")}
_CLOSING = {
    2: ("Revolute", "PinSlot", "Prismatic", "Weld"),
    3: ("Spherical", "Universal", "Cylindrical", "Revolute", "Weld"),
}


def linkages(s: Scope, seed: int) -> None:
    """Write one. Its random numbers are its own: models keep all else."""
    if not s.space:
        return
    with s.apart(f"linkages of {seed}"):
        if s.chance(SHARE):
            s.weighted(((2, _jointed), (1, _connected), (1, _tipped)))(s)


def pins(s: Scope, seed: int) -> None:
    """Close a loop by a joint of the file itself, whose equations ask for frames that hang on its end. Its random numbers are its own."""
    if not s.space:
        return
    with s.apart(f"pins 3087 of {seed}"):
        if s.chance(PINNED):
            _pinned(s)


def followed(s: Scope, seed: int) -> None:
    """Write a body that a frame holds by value whose turn follows a joint. Its random numbers are its own."""
    if not s.space:
        return
    with s.apart(f"followed 12 of {seed}"):
        if s.chance(FOLLOWED):
            _followed(s)


def _followed(s: Scope) -> None:
    """Hold a body that moves freely, so that a connection closes the loop: its pose has no freedom, and is not rigid either."""
    base = hung(s, s.pick(_CARRIERS[s.space]), WORLD)[0]
    wheel, joint = hung(s, "Revolute", WORLD)
    angle = reference(f"{joint}.angle", "coordinate", NUMBER, level="q")
    frame = base
    for about in ("rot",) if s.space == 2 else s.random.sample(("rotx", "roty", "rotz"), s.pick((1, 2, 3))):
        turn = multiply(s.literal(NUMBER, s.number(0.3, 1)), angle)
        frame = placed(s, frame, call(about, turn, type="pose"))
    body, free = hung(s, "Planar" if s.space == 2 else "Free", WORLD)
    _hold(s, body, named(s, frame))
    k = next(k for k, one in enumerate(s.statements) if f"{one.name}.a" == body.ref)
    s.statements.append(s.statements.pop(k))  # behind its joint, so that the connection closes the loop
    push(s, body)
    push(s, wheel)
    _told(s, s.pick((free, joint)))
    ask(s, call("pos", body, dim=LENGTH, shape=(s.space,), level="q"))


def _pinned(s: Scope) -> None:
    near = _carried(s, hung(s, s.pick(_CARRIERS[s.space]), WORLD)[0])
    free = hung(s, "Planar" if s.space == 2 else "Free", WORLD)[0]
    kind, name = s.fresh("Pin"), s.fresh("j")
    arm = [float(s.number(-0.5, 0.5)) for _ in range(s.space)]
    out, back = (f"trans({{{', '.join(f'{sign * x:g}' for x in arm)}}} m)" for sign in (1, -1))
    if s.space == 2:
        moved, place = "coordinate Angle angle ~ 0 rad;", f"rot(angle) * {back}"
        closed = "closure local(from, seat) = {0, 0}; closure angle = heading(seat) - heading(from);"
    else:
        moved, place = "coordinate Rotation orientation;", f"orientation * {back}"
        closed = "closure pos(seat) = pos(from);"
    frames = f"frame from; frame to; frame eye = to * {out}; frame seat = eye;"
    text = f"{frames} {moved} place to = from * {place}; {closed}"
    s.file.items.append(statement("class", f"model {kind} {text} end {kind};", name=kind))
    ends = (Slot("component.from", named(s, near)), " -> ", Slot("component.to", named(s, free)))
    items = (statement("bind", *ends, name="->"),)
    s.add("component", f"{kind} {name}", Seq(items, "list"), ";", name=name, data={"class": kind})
    push(s, named(s, free))
    _told(s, name)


def _jointed(s: Scope) -> None:
    """Close a loop by a joint between parts that bodies carry: one end hangs, the other one moves freely."""
    near = _carried(s, hung(s, s.pick(_CARRIERS[s.space]), WORLD)[0])
    free = hung(s, "Planar" if s.space == 2 else "Free", WORLD)[0]
    far = _carried(s, free)
    kind, name = s.pick(_CLOSING[s.space]), s.fresh("j")
    ends = (Slot("component.from", named(s, near)), " -> ", Slot("component.to", named(s, far)))
    mods: list[S] = [statement("bind", *ends, name="->")]
    if kind in ("Prismatic", "PinSlot", "Cylindrical") or (kind == "Revolute" and s.space == 3):
        mods.append(mod("axis", "=", "modification.structural", direction(s)))
    cut = "cut " if s.chance(0.3) else ""
    s.add("component", f"{cut}{kind} {name}", Seq(tuple(mods), "list"), ";", name=name, data={"class": kind})
    push(s, named(s, free))
    _told(s, name)
    ask(s, call("pos", far, dim=LENGTH, shape=(s.space,), level="q"))


def _connected(s: Scope) -> None:
    """Close a loop by a connection: what two joints leave all freedom to is held where another body carries it."""
    base = hung(s, s.pick(_CARRIERS[s.space]), WORLD)[0]
    between, slide = hung(s, "Translation", WORLD)
    turned = "Revolute" if s.space == 2 else "Spherical"
    body, joint = hung(s, turned, named(s, between), axis=False)
    _hold(s, body, named(s, placed(s, _carried(s, base))))
    push(s, body)
    _told(s, s.pick((joint, slide)))
    ask(s, call("pos", between, dim=LENGTH, shape=(s.space,), level="q"))


def _hold(s: Scope, body: E, frame: E) -> None:
    """Connect a body that joints place to a frame by value."""
    value = mod("a", "=", "modification.frame", frame)
    for k, one in enumerate(s.statements):
        if one.kind == "component" and f"{one.name}.a" == body.ref:
            parts = tuple(Seq((*p.items, value), "list") if isinstance(p, Seq) else p for p in one.parts)
            s.statements[k] = replace(one, parts=parts)


def _tipped(s: Scope) -> None:
    """A part whose joint leads to its tip, beside the frame of its body."""
    n, part, name, joint = s.space, s.fresh("Part"), s.fresh("b"), s.fresh("j")
    far = ", ".join(str(float(s.number(-0.6, 0.6))) for _ in range(n))
    text = f"Body body; frame root = body.a; frame far = root * trans({{{far}}} m); frame tip = far;"
    s.file.items.append(statement("class", f"model {part} {text} end {part};", name=part))
    inertia: E = s.value(INERTIA, s.number(0.1, 0.5))
    if n == 3:
        sizes = vector(*(s.literal(INERTIA, s.number(0.2, 0.35)) for _ in range(3)))
        inertia = call("diag", sizes, dim=INERTIA, shape=(3, 3))
    mods = (
        mod("body.m", "=", "modification.parameter", s.value(MASS, s.number(0.5, 2))),
        mod("body.J", "=", "modification.parameter", inertia),
    )
    s.add("component", f"{part} {name}", Seq(mods, "list"), ";", name=name, data={"class": part})
    ends = (Slot("component.from", WORLD), " -> ", Slot("component.to", named(s, _frame(f"{name}.tip"))))
    start = mod("angle", "=", "modification.initial", s.literal(NUMBER, s.number(-1, 1), angle=True))
    items = (statement("bind", *ends, name="->"), start)
    s.add("component", f"Revolute {joint}", Seq(items, "list"), ";", name=joint, data={"class": "Revolute"})
    push(s, _frame(f"{name}.root"))
    _told(s, joint)


def _told(s: Scope, name: str) -> None:
    joint = reference(name, "joint")
    ask(s, call("reaction", joint, dim=FORCE, shape=(s.space,), level="qva"))
    if s.chance(0.6):
        ask(s, call("moment", joint, dim=ENERGY, shape=() if s.space == 2 else (3,), level="qva"))


def _carried(s: Scope, frame: E) -> E:
    """Return the tip of a part that is connected to a frame by value, or the frame itself."""
    if s.chance(0.2):
        return frame
    part, name = s.fresh("Part"), s.fresh("b")
    inner = s.pick(("bar", "body"))
    body = statement(
        "component",
        f"Bar {inner}",
        Seq((mod("a", "=", "modification.frame", _frame(s.pick(("root", "base")))),), "list"),
        ";",
        name=inner,
        data={"class": "Bar"},
    )
    lines = [
        statement("frame", "frame root;", name="root"),
        statement("frame", "frame base = root;", name="base"),
        body,
        statement("frame", f"frame far = {inner}.b;", name="far"),
        statement("frame", "frame tip = far;", name="tip"),
    ]
    s.random.shuffle(lines)
    s.file.items.append(model_statement(part, lines))
    path = inner
    if s.chance(0.4):
        whole = s.fresh("Whole")
        text = "frame root; {} inside(root = root); frame middle = inside.tip; frame tip = middle;"
        s.file.items.append(statement("class", f"model {whole} {text.format(part)} end {whole};", name=whole))
        part, path = whole, f"inside.{inner}"
    mods = (
        mod("root", "=", "modification.frame", named(s, placed(s, frame))),
        mod(f"{path}.m", "=", "modification.parameter", s.value(MASS, s.number(0.5, 2))),
        mod(f"{path}.l", "=", "modification.parameter", s.value(LENGTH, s.number(0.2, 0.6))),
    )
    s.add("component", f"{part} {name}", Seq(mods, "list"), ";", name=name, data={"class": part})
    return _frame(f"{name}.tip")


def named(s: Scope, frame: E) -> E:
    """Return a frame under a name of a name, up to three deep."""
    for _ in range(s.pick((0, 1, 2, 3))):
        name = s.fresh("f")
        s.add("frame", f"frame {name} = ", Slot("frame.value", frame), ";", name=name)
        frame = _frame(name)
    return frame


def _frame(name: str) -> E:
    return reference(name, "frame", LENGTH, level="q", type="frame")
