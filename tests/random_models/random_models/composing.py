"""The same model as people compose it: names of names, parts with a root and a tip, joints inside of parts, connections by value,
and names that settings, options, axes and other languages have, too."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from random import Random

from random_models.bodies import joint_kinds
from random_models.components import renamed, renamed_text
from random_models.scope import TYPES
from random_models.structure import decoy, mod, model_statement, with_value
from random_models.tree import (
    LENGTH,
    NUMBER,
    E,
    Model,
    S,
    Seq,
    Slot,
    map_expression,
    reference,
    statement,
    without,
)
from random_models.twins import Twin

BODIES = {"Body", "Bar", "Rod", "Disk", "Box", "Sphere", "Cylinder"}
JOINTS = {kind for n in (2, 3) for kind, _ in joint_kinds(n)}
ODD = (
    "t", "x", "y", "z", "u", "p", "n", "h", "dt", "seed", "inputs",
    "outputs", "states", "parameters", "values", "data", "over", "names", "lambda", "self", "int", "double", "main", "np", "math",
)  # fmt: skip
"""What settings, options, axes, and what other languages know are called."""
# a joint without freedoms that does not say what it holds
BOLT = statement("class", "model Bolt frame from; frame to; place to = from; end Bolt;", name="Bolt")
METER = statement(
    "class", "model Meter input Real signal; output sum = integral(signal); end Meter;", name="Meter"
)
SHARE = 0.4
"""Of the twins call things so."""
_OWN = re.compile(r"[A-Za-z]+\d+")
_DECLARED = {"parameter", "coordinate", "state", "let", "component", "output", "input", "discrete"}


def as_people_compose(model: Model, random: Random) -> Twin | None:
    """Say a model as people compose it."""
    composer = _Composer(model, random)
    twin = composer.twin() if composer.compose() else None
    if random.random() < SHARE:
        return called_oddly(model if twin is None else twin.model, random, twin) or twin
    return twin


def called_oddly(model: Model, random: Random, twin: Twin | None = None) -> Twin | None:
    """Call some of what a model declares as others call their settings; what its experiment sets keeps its name."""
    items = model.top.seq().items
    told = " ".join(s.text() for s in items if s.kind == "experiment")
    declared = [
        s.name for s in items if s.kind in _DECLARED and _OWN.fullmatch(s.name) and s.name not in told
    ]
    chosen = random.sample(declared, min(len(declared), random.choice((1, 2, 4, 8))))
    names = dict(zip(chosen, random.sample(ODD, len(chosen)), strict=True))
    if not names:
        return None
    others = {} if twin is None else {old: renamed_text(new, names) for old, new in twin.names.items()}
    other = model.with_top(tuple(renamed(s, names) for s in items))
    return Twin("as people compose", other, names=names | others)


class _Composer:
    """``names``: what components are called, heads of names; ``frames``: what else their frames are called."""

    def __init__(self, model: Model, random: Random) -> None:
        self.model, self.random = model, random
        self.items = [_bound(s) for s in model.top.seq().items]
        self.models: list[S] = []
        self.names: dict[str, str] = {}
        self.frames: dict[str, str] = {}
        self.made: set[str] = set()
        self.aliases: list[S] = []

    def compose(self) -> bool:
        """Exchange components by parts, and frames by names of theirs; return whether there was anything."""
        bodies = {s.name: s for s in self.items if _is(s, BODIES)}
        for weld in [s for s in self.items if _is(s, {"Weld"})]:
            self._by_value(weld, bodies)
        for s in [s for s in self.items if _class(s) == "Weld" and s.kind == "component"]:
            if self.random.random() < 0.4 and len(s.seq().items) == 1:
                self._bolt(s)
        for s in [s for s in self.items if _is(s, JOINTS)]:
            r = self.random.random()
            body = bodies.get(_body_of(s))
            if r < 0.25 and body is not None and _value(body) is None:
                self._limb(s, body)
                del bodies[body.name]
            elif r < 0.5:
                self._link(s)
        for s in bodies.values():
            if self.random.random() < 0.6:
                self._part(s)
        if self.random.random() < 0.7:
            self._metered()
        items = [self._renamed(s).rebuilt(self._aliased) for s in self.items]
        for s in self.aliases:
            items.insert(self.random.randrange(len(items) + 1), s)
        self.items = items
        return bool(self.names or self.aliases or self.models)

    def twin(self) -> Twin:
        other = self.model.with_top(tuple(self.items))
        known = {s.name for s in other.items[:-1]}
        models = {s.name: s for s in self.models if s.name not in known}
        items = (*other.items[:-1], *models.values(), other.top)
        return Twin("as people compose", Model(items), names=self.names)

    # ---------------------------------------------------------------- parts

    def _by_value(self, weld: S, bodies: dict[str, S]) -> None:
        """Connect a body by the value of its frame, where nothing asks for the weld."""
        body = bodies.get(_body_of(weld))
        asked = any(re.search(rf"(?<![\w.]){weld.name}\b", s.text()) for s in self.items if s is not weld)
        if body is None or asked or _value(body) is not None or self.random.random() < 0.3:
            return
        place = mod("a", "=", "modification.frame", weld.seq().items[0].slots[0].expression)
        bodies[body.name] = _component(_class(body), body.name, (*body.seq().items, place))
        self.items = without([bodies[body.name] if s is body else s for s in self.items], [weld])

    def _bolt(self, weld: S) -> None:
        """Exchange a weld by a joint that does not say what it holds."""
        parts = (str(weld.parts[0]).replace("Weld ", "Bolt "), *weld.parts[1:])
        bolt = replace(weld, parts=parts, data={"class": "Bolt"})
        self.items = [bolt if s is weld else s for s in self.items]
        self.models.append(BOLT)

    def _part(self, body: S) -> None:
        """A body with a root and a tip, which may be a part of another part."""
        name, inner = body.name, self.random.choice(("body", "bar", "inside"))
        lines, own, outer = self._split(body, inner)
        if (value := _value(body)) is not None:
            outer.append(mod("root", "=", "modification.frame", value))
        if value is None and self.random.random() < 0.5:
            lines += [_component(_class(body), inner, own), *self._chain("root", f"{inner}.a")]
        else:
            root = mod("a", "=", "modification.frame", _frame("root"))
            lines += [statement("frame", "frame root;", name="root"), *self._chain("base", "root")]
            lines.append(_component(_class(body), inner, [*own, root]))
        lines += self._chain("tip", f"{inner}.{_far(body)}")
        self.models.append(model_statement(f"Part{name}", lines))
        part, path = f"Part{name}", f"{name}.{inner}"
        if self.random.random() < 0.4:
            root = mod("root", "=", "modification.frame", _frame("root"))
            whole = [_component(part, "half", [] if value is None else [root])]
            whole += (
                [statement("frame", "frame root;", name="root")]
                if value is not None
                else self._chain("root", "half.root")
            )
            self.models.append(model_statement(f"Whole{name}", [*whole, *self._chain("tip", "half.tip")]))
            part, path = f"Whole{name}", f"{name}.half.{inner}"
            outer = [m if m.name == "root" else _inside("half", m) for m in outer]
        self._made(body, _component(part, name, outer), {name: path})
        self.frames |= {f"{path}.a": f"{name}.root", f"{path}.{_far(body)}": f"{name}.tip"}

    def _limb(self, joint: S, body: S) -> None:
        """A joint and the body behind it, as one part."""
        name = f"limb{body.name}"
        lines, own, outer = self._split(body, "rod")
        more, settings, given = self._split(joint, "pin")
        bind = statement(
            "bind",
            Slot("component.from", _frame("root")),
            " -> ",
            Slot("component.to", _frame("rod.a")),
            name="->",
        )
        lines += [*more, statement("frame", "frame root;", name="root"), _component(_class(body), "rod", own)]
        lines += [
            _component(_class(joint), "pin", [bind, *settings]),
            *self._chain("tip", f"rod.{_far(body)}"),
        ]
        self.random.shuffle(lines)
        self.models.append(model_statement(f"L{name[1:]}", lines))
        root = mod("root", "=", "modification.frame", joint.seq().items[0].slots[0].expression)
        self.items = without(self.items, [joint])
        names = {body.name: f"{name}.rod", joint.name: f"{name}.pin"}
        self._made(body, _component(f"L{name[1:]}", name, [root, *outer, *given]), names)
        self.frames[f"{name}.rod.{_far(body)}"] = f"{name}.tip"

    def _link(self, joint: S) -> None:
        """A joint in a part, between frames of that."""
        name = joint.name
        lines, settings, outer = self._split(joint, "pin")
        lines += [statement("frame", f"frame {x};", name=x) for x in ("from", "to")]
        ends = []
        for x in ("from", "to"):
            chain = self._chain(f"{x}_end", x) if self.random.random() < 0.4 else []
            lines += chain
            ends.append(_frame(f"{x}_end" if chain else x))
        bind = statement(
            "bind", Slot("component.from", ends[0]), " -> ", Slot("component.to", ends[1]), name="->"
        )
        kind, part, path = _class(joint), f"Link{name}", "pin"
        lines.append(_component(kind, "pin", [bind, *settings]))
        if self.random.random() < 0.3:
            lines.append(statement("frame", "frame spare;", name="spare"))
        self.models.append(model_statement(part, lines))
        if self.random.random() < 0.4:
            part, path = f"Whole{part}", "half.pin"
            inner = f"model {part} frame from; frame to; Link{name} half(from -> to); end {part};"
            self.models.append(statement("class", inner, name=part))
            outer = [_inside("half", m) for m in outer]
        self._made(joint, _component(part, name, [joint.seq().items[0], *outer]), {name: f"{name}.{path}"})

    def _metered(self) -> None:
        """Let parts of one kind tell integrals over time."""
        told = [s for s in self.items if s.kind == "output" and _is_integral(s.slots[0].expression)]
        for k, s in enumerate(told):
            given = mod("signal", "=", "modification.input", s.slots[0].expression.operands[0])
            meter = statement(
                "component",
                f"Meter meter{k}_",
                Seq((given,), "list"),
                ";",
                name=f"meter{k}_",
                data={"class": "Meter"},
            )
            value = reference(f"meter{k}_.sum", "output", s.slots[0].expression.dim, level="x")
            self.items = [with_value(s, value) if x is s else x for x in self.items]
            self.items.append(meter)
            self.models.append(METER)

    def _split(self, s: S, inner: str) -> tuple[list[S], list[S], list[S]]:
        """Return parameters of a part, what it says of a component inside by them, and what is said of the part."""
        lines: list[S] = []
        own: list[S] = []
        outer: list[S] = []
        for m in s.seq().items:
            if m.name in ("->", "a"):
                continue
            e, place = m.slots[0].expression, m.slots[0].place
            plain = place == "modification.parameter" and e.dim in TYPES and e.dim != LENGTH and not e.shape
            if plain and e.type == "real" and self.random.random() < 0.4:
                given = f"{inner}_{m.name}"
                value = Slot("parameter.value", decoy(e, self.random))
                lines.append(statement("parameter", f"parameter {given} = ", value, ";", name=given))
                own.append(mod(m.name, "=", place, reference(given, "parameter", e.dim, level="p")))
                outer.append(mod(given, "=", place, e))
            else:
                outer.append(_inside(inner, m))
        return lines, own, outer

    def _chain(self, name: str, target: str) -> list[S]:
        """Return a name of a frame, up to three deep."""
        lines = []
        for k in range(self.random.choice((0, 0, 1, 2))):
            lines.append(_named(f"{name}_{k}", _frame(target)))
            target = f"{name}_{k}"
        return [*lines, _named(name, _frame(target))]

    def _made(self, old: S, new: S, names: dict[str, str]) -> None:
        self.items = [new if s is old else s for s in self.items]
        self.made.add(new.name)
        self.names |= names

    # ---------------------------------------------------------------- names

    def _renamed(self, s: S) -> S:
        if s.kind != "component" or s.name not in self.made:
            return renamed(s, self.names)

        def one(x: E) -> E:
            return replace(x, ref=renamed_text(x.ref, self.names)) if x.ref else x

        return s.rebuilt(lambda e, _: map_expression(e, one))

    def _aliased(self, e: E, place: str) -> E:
        """Call frames and points otherwise."""

        def one(x: E) -> E:
            if x.kind not in ("ref:frame", "ref:point", "ref:world") or "[" in x.ref:
                return x
            if x.ref in self.frames and self.random.random() < 0.6:
                x = replace(x, ref=self.frames[x.ref])
            for _ in range(self.random.choice((0, 0, 0, 1, 2, 3))):
                name = f"alias{len(self.aliases)}"
                several = x.type == "frame" and self.random.random() < 0.2
                self.aliases.append(_second(name, x) if several else _named(name, x))
                x = replace(x, ref=f"{name}[2]" if several else name)
            return x

        return map_expression(e, one)


def _named(name: str, e: E) -> S:
    kind = "point" if e.type == "point" else "frame"
    return statement(kind, f"{kind} {name} = ", Slot(f"{kind}.value", e), ";", name=name)


def _second(name: str, e: E) -> S:
    """Return an array of frames of which a frame is the second."""
    first = reference("world", "world", LENGTH, type="frame")
    values = Slot("frame.value", first), ", ", Slot("frame.value", e)
    return statement("frame", f"frame {name}[2] = {{", *values, "};", name=name)


def _frame(name: str) -> E:
    return reference(name, "frame", LENGTH, level="q", type="frame")


def _component(kind: str, name: str, mods: Iterable[S]) -> S:
    return statement(
        "component", f"{kind} {name}", Seq(tuple(mods), "list"), ";", name=name, data={"class": kind}
    )


def _inside(name: str, m: S) -> S:
    """Return a modification of a component as one of the part in which it is."""
    rate = m.name.startswith("der(")
    target = f"der({name}.{m.name[4:-1]})" if rate else f"{name}.{m.name}"
    return mod(target, str((m.data or {}).get("sign", "=")), m.slots[0].place, m.slots[0].expression)


def _bound(s: S) -> S:
    """Write the second end of a joint as an expression."""
    if s.kind != "component":
        return s

    def ends(m: S) -> S:
        found = re.fullmatch(r" -> ([\w.]+)", str(m.parts[-1])) if m.kind == "bind" else None
        if found is None:
            return m
        return replace(m, parts=(*m.parts[:-1], " -> ", Slot("component.to", _frame(found[1]))))

    return s.rebuilt(lambda e, _: e, ends)


def _is_integral(e: E) -> bool:
    return e.kind == "integral.time" and e.operands[0].dim == NUMBER and not e.operands[0].shape


def _class(s: S) -> str:
    return str((s.data or {}).get("class"))


def _is(s: S, kinds: set[str]) -> bool:
    """Whether a statement is a component of a kind, with what can be said of it elsewhere."""
    if s.kind != "component" or s.parts[0] != f"{_class(s)} {s.name}" or _class(s) not in kinds:
        return False
    items: Sequence[S] = s.seq().items
    ends = [len(m.slots) for m in items if m.kind == "bind"]
    return all(m.kind in ("mod", "bind") for m in items) and ends == ([2] if kinds & JOINTS else [])


def _body_of(joint: S) -> str:
    """Return the component whose first frame a joint leads to."""
    return str(joint.seq().items[0].slots[1].expression).removesuffix(".a")


def _value(body: S) -> E | None:
    """Return the frame that a body is connected to by value."""
    return next((m.slots[0].expression for m in body.seq().items if m.name == "a"), None)


def _far(body: S) -> str:
    return "b" if _class(body) in ("Bar", "Rod") else "a"
