"""Loops as people compose them: parts with a root and a tip, bodies connected by value, names of names at the joints."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from random_models.bodies import WORLD, mod
from random_models.closing import direction, hung, placed, push
from random_models.driven import ask
from random_models.lists import Chain
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

SHARE, PINNED, FOLLOWED, GROUPED = 0.12, 0.05, 0.02, 0.03
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


def groups(s: Scope, seed: int) -> None:
    """Hold bodies together by connections to and fro, which joints from outside reach in two places. Its random numbers are its own."""
    if not s.space:
        return
    with s.apart(f"groups 86 of {seed}"):
        if s.chance(GROUPED):
            _Group(s).write()


class _Group(Chain):
    """Writes bodies whose connections make a tree. Its twin has each of them away from the first body, and all before the joints."""

    def write(self) -> None:
        s, n, hold = self.s, self.s.pick((3, 3, 4)), self.s.fresh("Hold")
        text = f"model {hold} frame from; frame to; place to = from; end {hold};"
        s.file.items.append(statement("class", text, name=hold))
        names = [s.fresh("b") for _ in range(n)]
        planar = s.space == 2
        for name in names:
            m, J = self.numbers(2)
            self.same(
                f"Body {name}(m = {m:g} kg, J = {f'{J:g} kg.m^2' if planar else f'diag({{{J:g}, {m:g}, 1}} kg.m^2)'});"
            )
        edges = [(s.pick(names[:k]), names[k]) for k in range(1, n)]
        arms = [self._arm() for _ in edges]
        first, last = names[0], names[-1]
        free, pin = s.fresh("j"), s.fresh("j")
        x, f = self.numbers(2, 0.2, 0.8)
        place = f"x ~ {x:g} m" if planar else f"position ~ {{{x:g}, 0, 0}} m"
        joints = [
            f"Free {free}(world -> {first}.a, {place});",
            f"{'Revolute' if planar else 'Spherical'} {pin}(world -> {last}.a);",
        ]
        welds = [(f"{hold} {s.fresh('w')}", a, b, arm) for (a, b), arm in zip(edges, arms, strict=True)]
        away = [f"{weld}({a}.a * {arm} -> {b}.a);" for weld, a, b, arm in welds]
        shuffled = [
            one if s.chance(0.5) else f"{weld}({b}.a -> {a}.a * {arm});"
            for one, (weld, a, b, arm) in zip(away, welds, strict=True)
        ]
        written = [*shuffled, *joints]
        s.random.shuffle(written)
        self.say(written[0], *away, *joints)
        for text in written[1:]:
            self.say(text)
        push_by = "{0, 1}" if planar else "{0, 1, 0}"
        self.same(f"force {f:g} N*{push_by} on {s.pick(names)}.a;")
        for question in (f"reaction({pin})", f"pos({s.pick(names)}.a)", f"mass_centre({s.pick(names)}.a)"):
            self.output(question, question)

    def _arm(self) -> str:
        s = self.s
        numbers = ", ".join(f"{v:g} m" for v in self.numbers(s.space, -0.6, 0.6))
        return f"trans({{{numbers}}})"


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
    with s.apart(f"equations of the pin {name} with {arm}"):
        if s.chance(0.5):  # by names
            closed = (
                "let across = local(from, seat)[1]; let along = local(from, seat)[2]; closure across = 0; closure along = 0 m; "
                "let turned = heading(seat) - heading(from); closure angle = turned;"
                if s.space == 2
                else "let off = pos(seat) - pos(from); closure off = 0 m;"
            )
    with s.apart(f"ends of the pin {name} with {arm}"):
        ends_of = s.pick(("frame from; frame to;", "frame to; frame from;"))
        carries = s.chance(0.5)
    frames = f"{ends_of} frame eye = to * {out}; frame seat = eye;"
    text = f"{frames} {moved} place to = from * {place}; {closed}"
    s.file.items.append(statement("class", f"model {kind} {text} end {kind};", name=kind))
    ends = named(s, near), named(s, free)
    both: tuple[str | Slot, ...]
    if ends_of.startswith("frame from"):
        both = (Slot("component.from", ends[0]), " -> ", Slot("component.to", ends[1]))
    else:
        both = ("from = ", Slot("component.from", ends[0]), ", to = ", Slot("component.to", ends[1]))
    items = (statement("bind", *both, name="->"),)
    s.add("component", f"{kind} {name}", Seq(items, "list"), ";", name=name, data={"class": kind})
    push(s, named(s, free))
    if carries:  # what hangs on the joint is lowered before the loop is closed
        with s.apart(f"what the pin {name} carries with {arm}"):
            seat = reference(f"{name}.{s.pick(('eye', 'seat'))}", "frame", type="frame", level="q")
            push(s, hung(s, "Revolute", seat)[0])
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
