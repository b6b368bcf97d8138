"""The same text in other words: comments, imports by other names, another name of the time, further experiments, no model around it."""

from __future__ import annotations

import re
from dataclasses import replace
from random import Random

from random_models.tree import E, Model, S, Seq, Slot, map_expression, statement
from random_models.twins import Twin

_CLASS = re.compile(r"^(cut )?([A-Z]\w*)(?= [A-Za-z_])")
_INSIDE = re.compile(r"(?<=[ ;])[A-Z]\w*(?= [a-z]\w*[ (;\[])")
_PLAIN = re.compile(r"(?<![\w.\"])time(?!\w)")


def other_words(model: Model, random: Random) -> Twin | None:
    """Say a model in other words, in several ways at once."""
    whole = Twin("other words", model)
    for make in (_with_another_time, _with_other_imports, _with_comments, _with_a_further_experiment):
        if random.random() < 0.6:
            whole = replace(whole, model=make(whole.model, random))
    if random.random() < 0.3:
        whole = replace(whole, model=_bare(whole.model))
    return None if whole.model is model else whole


def _bare(model: Model) -> Model:
    """Leave out the model around the statements, where the file holds no other."""
    if any(s.kind not in ("import", "function", "comment") for s in model.items[:-1]):
        return model
    return Model((*model.items[:-1], replace(model.top, parts=(model.top.seq(),))))


def _with_another_time(model: Model, random: Random) -> Model:
    """Call the time otherwise, in the model and in none of its parts."""
    classes = [s for s in model.items[:-1] if s.kind == "model"]
    if classes:  # a base would ask for the name
        return model
    name = random.choice(("tau", "now", "t"))

    def at(e: E, place: str) -> E:
        return map_expression(e, lambda x: replace(x, ref=name) if x.kind == "ref:time" else x)

    def texts(s: S) -> S:
        parts = tuple(
            _PLAIN.sub(name, p) if isinstance(p, str) and s.kind in ("list", "when") else p for p in s.parts
        )
        return replace(s, parts=parts)

    top = model.top.rebuilt(at, texts)
    return model.with_top((statement("independent", f"independent {name};"), *top.seq().items))


def _with_other_imports(model: Model, random: Random) -> Model:
    """Import a library under a name, or what is needed of it."""
    found = [
        (k, str(s.parts[0]))
        for k, s in enumerate(model.items)
        if s.kind == "import" and ".*" in str(s.parts[0])
    ]
    used = {
        m[2] for s in model.statements() if s.kind == "component" and (m := _CLASS.match(str(s.parts[0])))
    }
    classes = [s for s in model.items if s.kind == "class"]
    used |= {name for s in classes for name in _INSIDE.findall(s.text())}
    defined = {s.name for s in model.items if s.kind in ("model", "class")}
    used -= defined
    if len(found) != 2 or "couplings" in model.text():
        return model
    fields = {
        name
        for name in used
        if name in ("UniformField", "InverseSquare", "Coulomb", "Stokes", "Drag", "Magnetic")
    }
    _, body = found[0]
    library = body.removeprefix("import ").removesuffix(".*;")
    known = _names_of(library) - defined
    if not (used - fields) & known:
        return model
    own = sorted(used & known)
    items = list(model.items)
    if random.random() < 0.5:
        items[found[0][0]] = statement("import", f"import {library}.{{{', '.join(own)}}};")
        return Model(tuple(items))
    items[found[0][0]] = statement("import", f"import Lib = {library};")

    def called(s: S) -> S:
        if s.kind == "class":
            return replace(s, parts=tuple(within(p) if isinstance(p, str) else p for p in s.parts))
        m = _CLASS.match(str(s.parts[0])) if s.kind == "component" else None
        if m is None or m[2] not in known:
            return s
        return replace(s, parts=(f"{m[1] or ''}Lib.{str(s.parts[0])[m.start(2) :]}", *s.parts[1:]))

    def within(text: str) -> str:
        return _INSIDE.sub(lambda m: f"Lib.{m[0]}" if m[0] in known else m[0], text)

    return Model(tuple(called(s.rebuilt(lambda e, _: e, called)) for s in items))


def _names_of(library: str) -> set[str]:
    """Return the models that a file of the library holds."""
    from random_models.mutants import ROOT

    text = (ROOT / "stdlib" / f"{library.removeprefix('mech.')}.mech").read_text(encoding="utf-8")
    return set(re.findall(r"^(?:partial )?model (\w+)", text, re.M))


def _with_comments(model: Model, random: Random) -> Model:
    """Put comments between the statements, which look like some."""
    items: list[S] = []
    for s in model.top.seq().items:
        if random.random() < 0.3:
            items.append(
                statement(
                    "comment",
                    random.choice(
                        ("// force 1 N on nothing;", '/* "a text */', "/* kinetic // of\n  several lines */")
                    ),
                )
            )
        items.append(s)
    return model.with_top(tuple(items))


def _with_a_further_experiment(model: Model, random: Random) -> Model:
    """Let a further experiment say something else, which the first does not know."""
    items = list(model.top.seq().items)
    given = [
        s for s in items if s.kind == "parameter" and len(s.slots) == 1 and not s.slots[0].expression.shape
    ]
    given = [s for s in given if "[" not in str(s.parts[0])]
    place = next((k for k, s in enumerate(items) if s.kind == "experiment"), None)
    if not given or place is None:
        return model
    s = random.choice(given)
    twice = E("doubled", ("2*", (s.slots[0].expression, 8)), s.slots[0].expression.dim)
    parts: list[str | Slot | Seq] = [
        f"experiment other({s.name} = ",
        Slot("experiment.value", twice),
        ", stop = 2 s, every = 0.1 s);",
    ]
    items.insert(place + 1, statement("further", *parts))
    return model.with_top(tuple(items))
