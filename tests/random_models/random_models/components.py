"""The same model with some of its statements as a component, or as an array of components."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from random import Random

from random_models.operators import vector
from random_models.quantities import quantity
from random_models.scope import TYPES
from random_models.structure import decoy, mod, model_statement, sign_of, with_value
from random_models.tree import E, Model, S, Seq, Slot, map_expression, reference, statement, without
from random_models.twins import Twin

_INDEXED = re.compile(r"\[[A-Za-z_]")
_NAME = re.compile(r"(?<![\w.])([A-Za-z_]\w*)")
_MOVABLE = {
    "energy",
    "force",
    "damping",
    "torque",
    "for",
    "let",
    "state",
    "equation",
    "output",
    "component",
    "point",
    "frame",
    "mass",
    "inertia",
}
_OUTSIDE_ONLY = {"ref:joint", "ref:constraint", "ref:contact", "ref:load", "ref:point"}


def renamed_text(text: str, names: Mapping[str, str]) -> str:
    """Exchange the heads of dotted names in a text."""
    return _NAME.sub(lambda m: names.get(m[1], m[1]), text)


def renamed(s: S, names: Mapping[str, str]) -> S:
    """Exchange the heads of names in a statement, in its text and in its expressions."""

    def change(e: E, place: str) -> E:
        def one(x: E) -> E:
            return replace(x, ref=renamed_text(x.ref, names)) if x.ref else x

        return map_expression(e, one)

    def texts(x: S) -> S:
        parts = tuple(renamed_text(p, names) if isinstance(p, str) else p for p in x.parts)
        return replace(x, parts=parts, name=renamed_text(x.name, names))

    return texts(s.rebuilt(change, texts))


def _head(ref: str) -> str:
    return re.split(r"[.\[]", ref)[0]


def _leaves(s: S) -> list[E]:
    return [x for inner in s.walk() for slot in inner.slots for x in slot.expression.walk() if x.ref]


def _texts(s: S) -> set[str]:
    """Return the names in the texts of a statement, without those of its expressions."""
    words: set[str] = set()
    for inner in s.walk():
        for p in inner.parts:
            if isinstance(p, str):
                words |= set(_NAME.findall(p))
    return words


def _declares(s: S) -> bool:
    return s.kind in (
        "parameter",
        "coordinate",
        "state",
        "let",
        "frame",
        "point",
        "component",
        "output",
        "discrete",
        "input",
    ) and bool(s.name)


def _interface(e: E) -> str:
    """Say how a name of outside comes into a component: parameter, input, frame, or not at all."""
    if _INDEXED.search(e.ref):  # by a loop of the statement
        return ""
    if e.kind == "ref:parameter":
        return "parameter" if not e.shape else ""
    if (
        e.kind in ("ref:coordinate", "ref:let", "ref:state", "ref:input", "ref:discrete")
        and not e.shape
        and e.type == "real"
    ):
        return "input"
    if e.kind == "ref:frame":
        return "frame"
    return ""


def _group(items: list[S], random: Random) -> list[S]:
    """Choose statements that belong together: a coordinate of one's own or a state, and what looks at it."""
    seeds = [
        s
        for s in items
        if s.kind in ("coordinate", "state") or (s.kind == "component" and s.name.startswith("c"))
    ]
    if not seeds:
        return []
    seed = random.choice(seeds)
    names = {seed.name}
    fixed = {
        n
        for s in items
        if s.kind in ("when", "drive", "constraint", "contact", "friction")
        for n in _texts(s)
    }
    if seed.kind == "state" and seed.name in fixed:
        return []
    group = [seed]
    for s in items:
        if s is seed or s.kind not in _MOVABLE | {"initial"}:
            continue
        if s.kind in ("initial", "equation"):
            if s.name in (seed.name, f"der({seed.name})"):
                group.append(s)
            continue
        if (
            s.kind in ("state", "mass", "inertia")
            or (s.kind == "component" and not s.name.startswith("c"))
            or s.kind in ("frame", "point")
        ):
            continue
        touches = {_head(x.ref) for x in _leaves(s)} & names
        if (touches and random.random() < 0.8) or random.random() < 0.1:
            group.append(s)
    return group


def _fits(s: S, inside: set[str]) -> bool:
    """Whether a statement can do with what an interface carries."""
    kinds = {x.kind for inner in s.walk() for slot in inner.slots for x in slot.expression.walk()}
    for x in _leaves(s):
        if (
            _head(x.ref) in inside
            or x.ref in ("world", "time")
            or x.kind in ("ref:bound", "ref:index", "ref:formal", "ref:time", "ref:world")
        ):
            continue
        if not _interface(x) or ("momentum" in kinds or "reaction" in kinds):
            return False
    return True


def grouped(model: Model, random: Random) -> Twin | None:
    """Make a component, or an array of two or three, of some statements."""
    items = list(model.top.seq().items)
    group = _group(items, random)
    for _ in range(4):
        inside = {s.name for s in group if _declares(s)} | {
            s.name for s in group if s.kind in ("force", "damping", "torque") and s.name
        }
        group = [
            s for s in group if _fits(s, inside) or s.kind in ("coordinate", "initial", "state", "equation")
        ]
    inside = {s.name for s in group if _declares(s)} | {
        s.name for s in group if s.kind in ("force", "damping", "torque") and s.name
    }
    if not group or not all(_fits(s, inside) for s in group):
        return None
    # parameters that only these use may move with them
    outer = without(items, group)
    used = {_head(x.ref) for s in group for x in _leaves(s)}
    for s in list(outer):
        if (
            s.kind == "parameter"
            and s.name in used
            and len(s.slots) == 1
            and not s.slots[0].expression.shape
            and random.random() < 0.6
            and not s.slots[0].expression.level
        ):
            group.insert(0, s)
            outer.remove(s)
            inside.add(s.name)
    copies = random.choice((1, 2, 2, 3)) if _alone(group, inside) else 1
    array = copies > 1 or random.random() < 0.3
    flat = [*items]
    families: list[dict[str, S]] = [
        {f"{s.kind} {s.name}": s for s in group if s.kind in ("parameter", "coordinate", "initial", "state")}
    ]
    for k in range(2, copies + 1):
        names = {n: f"{n}_{k}" for n in inside}
        values: dict[str, S] = {}
        for s in group:
            other = renamed(s, names)
            if (
                s.kind in ("parameter", "coordinate", "initial", "state")
                and len(s.slots) == 1
                and not s.slots[0].expression.shape
                and random.random() < 0.7
            ):
                other = with_value(other, _other_value(s.slots[0].expression, random))
            values[f"{s.kind} {s.name}"] = other
            flat.append(other)
        families.append(values)
    flat = [s for s in flat if s.kind != "experiment"] + [s for s in flat if s.kind == "experiment"]

    arrays = {s.name for s in group if (s.data or {}).get("n") or (s.name and f" {s.name}[" in s.text())}
    arrays |= {f"der({name})" for name in arrays}
    body: list[S] = []
    mods: list[S] = []
    interface: dict[str, str] = {}
    for s in group:
        for x in _leaves(s):
            if _head(x.ref) in inside or x.ref in interface or not _interface(x) or x.kind in ("ref:formal",):
                continue
            kind = _interface(x)
            name = f"{kind[0]}_{len(interface) + 1}"
            interface[x.ref] = name
            if kind == "frame":
                body.append(statement("frame", f"frame {name};", name=name))
                mods.append(mod(name, "=", "modification.frame", x))
                continue
            types = TYPES.get(x.dim)
            if kind == "parameter":
                body.append(
                    statement(
                        "parameter",
                        f"parameter {name} = ",
                        Slot("parameter.value", decoy(reference("", "", x.dim), random)),
                        ";",
                        name=name,
                    )
                )
                mods.append(mod(name, "=", "modification.parameter", x))
            else:
                head = (
                    f"input {types[0]} {name}"
                    if types and random.random() < 0.7
                    else f"input {name} = {quantity(1, x.dim)}"
                )
                body.append(statement("input", head, ";", name=name))
                mods.append(mod(name, "=", "modification.input", x))
    for s in group:
        key = f"{s.kind} {s.name}"
        s = _through(s, interface)
        values_of = [f[key].slots[0].expression for f in families if key in f and f[key].slots]
        if (
            s.kind in ("parameter", "coordinate", "initial", "state")
            and len(values_of) == copies
            and len(s.slots) == 1
        ):
            plain = all(str(v) == str(values_of[0]) for v in values_of)
            v = values_of[0]
            if not plain or (random.random() < 0.7 and v.type == "real" and not v.shape):
                if not plain and (v.shape or s.name in arrays):
                    return None
                e = v if plain and random.random() < 0.7 else vector(*values_of) if copies > 1 else v
                place = {"parameter": "modification.parameter"}.get(s.kind, "modification.initial")
                mods.append(mod(s.name, "=" if s.kind == "parameter" else sign_of(s), place, e))
                s = with_value(s, decoy(v, random))
        body.append(s)
    if array:
        part = f"part[{copies}]"
    else:
        part = "part"
    names = {n: "part[1]." + n if array else "part." + n for n in inside}
    for k in range(2, copies + 1):
        names |= {f"{n}_{k}": f"part[{k}].{n}" for n in inside}
    component = statement(
        "component", f"Part {part}", Seq(tuple(mods), "list"), ";", name="part", data={"class": "Part"}
    )
    component = component.rebuilt(
        lambda e, _: map_expression(e, lambda x: replace(x, ref=renamed_text(x.ref, names)) if x.ref else x)
    )
    top = [renamed(s, names) for s in outer]
    top.insert(random.randrange(len(top)), component)
    out = Model(
        (
            *model.items[:-1],
            model_statement("Part", body),
            replace(
                model.top, parts=tuple(Seq(tuple(top)) if isinstance(p, Seq) else p for p in model.top.parts)
            ),
        )
    )
    return Twin("grouped", out, names=names, base=model.with_top(tuple(flat)))


def _through(s: S, interface: Mapping[str, str]) -> S:
    def change(e: E, place: str) -> E:
        return map_expression(e, lambda x: replace(x, ref=interface[x.ref]) if x.ref in interface else x)

    return s.rebuilt(change)


def _alone(group: list[S], inside: set[str]) -> bool:
    """Whether copies of the statements make a system that can move: no mass of others enters."""
    if any((s.data or {}).get("n") and s.kind == "coordinate" for s in group):
        return False
    kinds = {
        x.kind for s in group for inner in s.walk() for slot in inner.slots for x in slot.expression.walk()
    }
    if kinds & {"reaction", "moment"}:
        return False
    for s in group:
        if s.kind == "component":
            return False
        moves = s.kind == "energy" and not str(s.parts[0]).startswith(("potential", "dissipation"))
        if moves and any(_head(x.ref) not in inside for x in _leaves(s) if x.kind == "ref:coordinate"):
            return False
    has = [s for s in group if s.kind == "energy" and str(s.parts[0]).startswith("kinetic")]
    return bool(has) or not any(s.kind == "coordinate" for s in group)


def _other_value(e: E, random: Random) -> E:
    return quantity(f"{random.uniform(0.4, 1.6):.2f}", e.dim, random)
