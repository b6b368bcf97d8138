"""The same model as an heir of an heir: of every initial value each text says something else, in any of the ways there are."""

from __future__ import annotations

from dataclasses import replace
from random import Random

from random_models.operators import vector
from random_models.structure import decoy, mod, model_statement, sign_of, with_value
from random_models.tree import E, Model, S, Seq, Slot, statement
from random_models.twins import Twin


def overruling(model: Model, random: Random) -> Twin | None:
    """Let the outermost text alone say what is true."""
    items = [s for s in model.top.seq().items if s.kind != "experiment"]
    last = [s for s in model.top.seq().items if s.kind == "experiment"]
    by_parts = {_stem(s.name) for s in items if s.kind == "initial" and "[" in s.name}
    chosen = [s for s in items if _plain(s) and s.name not in by_parts and random.random() < 0.8]
    if not chosen:
        return None
    inner = [with_value(s, _wrong(s.slots[0].expression, random)) if s in chosen else s for s in items]
    middle: tuple[list[S], list[S]] = ([], [])
    outer: tuple[list[S], list[S]] = ([], [])
    for s in chosen:
        e = s.slots[0].expression
        _say(middle, s, _wrong(e, random), random, sure=False)
        _say(outer, s, e, random, sure=True)
    bases = (
        model_statement("Inner", inner, partial=True),
        model_statement("Middle", [_extends("Inner", middle[0]), *middle[1]], partial=random.random() < 0.5),
    )
    rest = [*outer[1], *last]
    rest.insert(random.randrange(len(rest) + 1), _extends("Middle", outer[0]))
    top = replace(
        model.top, parts=tuple(Seq(tuple(rest)) if isinstance(p, Seq) else p for p in model.top.parts)
    )
    return Twin("overruling", Model((*model.items[:-1], *bases, top)))


def _plain(s: S) -> bool:
    """Whether a statement gives one initial value that other texts can give, too."""
    if (
        s.kind not in ("coordinate", "initial", "state")
        or len(s.slots) != 1
        or "[" in s.name
        or "." in s.name
    ):
        return False
    return s.slots[0].expression.type == "real"


def _stem(name: str) -> str:
    return name.partition("[")[0] + (")" if name.startswith("der(") else "")


def _wrong(e: E, random: Random) -> E:
    return vector(*(decoy(x, random) for x in e.operands)) if e.kind == "vector" else decoy(e, random)


def _extends(name: str, mods: list[S]) -> S:
    return statement("extends", f"extends {name}", Seq(tuple(mods), "list"), ";")


def _say(text: tuple[list[S], list[S]], s: S, e: E, random: Random, *, sure: bool) -> None:
    """Give a value in a text, as a modification, as ``initial``, or by both, of which the modification counts; or element by
    element. Not ``sure``: perhaps nothing of it, or one element alone."""
    mods, initials = text
    name, sign = s.name, sign_of(s)
    place = "modification.rate" if name.startswith("der(") else "modification.initial"
    elements = e.operands if e.kind == "vector" else (e,) * int(str((s.data or {}).get("n", 0)))
    r = random.random()
    if not sure and r < 0.15:
        return
    if elements and r < (0.35 if sure else 0.6):
        stem, tail = (name[:-1], ")") if name.startswith("der(") else (name, "")
        told = range(len(elements)) if sure else [random.randrange(len(elements))]
        initials += [_initial(f"{stem}[{k + 1}]{tail}", sign, elements[k]) for k in told]
        if sure and random.random() < 0.5:
            initials.append(_initial(name, sign, _wrong(e, random)))
    elif r < 0.7:
        mods.append(mod(name, sign, place, e))
        if random.random() < 0.4:
            initials.append(_initial(name, sign, _wrong(e, random)))
    else:
        initials.append(_initial(name, sign, e))


def _initial(name: str, sign: str, e: E) -> S:
    place = "initial.rate" if name.startswith("der(") else "initial.value"
    data = {"guess": sign == "~"}
    return statement("initial", f"initial {name} {sign} ", Slot(place, e), ";", name=name, data=data)
