"""The same model, some of whose parameters its experiment sets: what texts say of them are other numbers, or formulas of others."""

from __future__ import annotations

import math
from dataclasses import replace
from random import Random

import numpy as np

from random_models.meaning import Meaning
from random_models.operators import add, call, choose, divide, multiply, relation
from random_models.quantities import quantity
from random_models.structure import decoy, sign_of, with_value
from random_models.tree import LENGTH, NUMBER, E, Model, S, Seq, Slot, node, reference, whole_of
from random_models.twins import Twin

SHARE = 0.4
"""Of the values that an experiment may set."""


def settings(model: Model, random: Random) -> Twin | None:
    """Let the experiment say what parameters are, and declarations and modifications something else."""
    items = list(model.top.seq().items)
    place = next((k for k, s in enumerate(items) if s.kind == "experiment"), None)
    if place is None:
        return None
    said = {p.split()[1] for p in items[place].parts if isinstance(p, str) and p.startswith(", ")}
    stems = [s for s in items if is_number(s) and not s.slots[0].expression.level and random.random() < 0.5]
    known = Meaning(model)
    in_parts = {whole_of(s) for s in items if s.kind == "initial" and "[" in s.name}
    given: list[tuple[str, E]] = []
    for k, s in enumerate(items):
        if s.kind in ("component", "extends"):
            items[k], more = _modified(s, stems, said, random)
            given += more
        elif s.data and "wrong" in s.data and random.random() < SHARE:
            name, true, wrong = s.data["wrong"]
            given.append((name, node("quantity", true)))
            items[k] = replace(s, parts=(wrong,))
        elif _is_value(s) and s.name not in said and whole_of(s) not in in_parts and random.random() < SHARE:
            given.append((s.name, s.slots[0].expression))
            items[k] = with_value(s, decoy(s.slots[0].expression, random))
        elif is_number(s) and s not in stems and s.name not in said and random.random() < SHARE:
            e = s.slots[0].expression
            if not any(x.kind == "function" for x in e.walk()):
                # what the experiment says is in no number of the text
                as_it_is = random.random() < 0.6 or said
                given.append((s.name, e if as_it_is else _as_number(s.name, e, known)))
                items[k] = with_value(s, _another(e, stems, random))
    if not given:
        return None
    parts = [p for p in items[place].parts if p != ");"]
    for name, e in given:
        parts += [f", {name} = ", Slot("experiment.value", e)]
    items[place] = replace(items[place], parts=(*parts, ");"))
    return Twin(
        "settings", Model(tuple(_inside(s, random, items) for s in model.with_top(tuple(items)).items))
    )


def is_number(s: S) -> bool:
    """Whether a statement declares a parameter that is a number."""
    return (
        s.kind == "parameter"
        and len(s.slots) == 1
        and "[" not in str(s.parts[0])
        and not s.slots[0].expression.shape
    )


def _is_value(s: S) -> bool:
    """Whether a statement gives a known rate that is a number, no element of one."""
    if s.kind != "initial" or len(s.slots) != 1 or "[" in s.name or sign_of(s) != "=":
        return False
    e = s.slots[0].expression
    return s.name.startswith("der(") and e.type == "real" and not e.shape and e.level <= frozenset("p")


def _modified(s: S, stems: list[S], said: set[str], random: Random) -> tuple[S, list[tuple[str, E]]]:
    """Let modifications say something else; returns what the experiment has to say."""
    items, given = [], []
    for m in s.seq().items:
        e = m.slots[0].expression if m.kind == "mod" and m.slots else None
        name = m.name if s.kind == "extends" else f"{s.name}.{m.name}"
        if (
            e is not None
            and m.slots[0].place == "modification.parameter"
            and (e.type, e.shape) == ("real", ())
            and name not in said
            and not {"function", "ref:index"} & {x.kind for x in e.walk()}
            and random.random() < SHARE
        ):
            given.append((name, e))
            m = with_value(m, _another(e, stems, random))
        items.append(m)
    return replace(
        s, parts=tuple(Seq(tuple(items), p.style) if isinstance(p, Seq) else p for p in s.parts)
    ), given


def _as_number(name: str, e: E, known: Meaning) -> E:
    """Return the value of a formula as a number; of a number, itself."""
    try:
        value = float(np.asarray(known.value(name)))
    except (ValueError, KeyError):
        return e
    if not e.level or value <= 0:
        return e
    unit = str(quantity(1, e.dim)).partition(" ")[2]
    return node(
        "quantity" if unit else "number", f"{value:.17g} {unit}".strip(), dim=e.dim, value=lambda: value
    )


def _another(e: E, stems: list[S], random: Random) -> E:
    """Return another value, perhaps a formula of some of the stems. What bodies are made of stays of its size."""
    if not stems or random.random() < 0.25:
        return multiply(node("number", "0.9", value=lambda: 0.9), e) if e.dim == LENGTH else decoy(e, random)
    s = random.choice(stems)
    own = s.slots[0].expression
    x = reference(s.name, "parameter", own.dim, level="p")
    size = quantity(f"{random.uniform(1, 2):.2f}", own.dim, random)
    if e.dim == LENGTH:
        small, large = (multiply(node("number", t), e) for t in ("0.9", "0.8"))
        return choose(relation(random.choice("<>"), x, size), small, large)
    ratio = divide(x, size) if own.dim != NUMBER else x
    other = quantity(f"{random.uniform(2, 4):.2f}", e.dim, random)
    kind = random.choice(("product", "wave", "choice", "sum"))
    if kind == "product":
        return multiply(other, add(node("number", "2"), multiply(ratio, ratio)))
    if kind == "wave":
        return multiply(other, add(node("number", "2"), call("sin", ratio, value=math.sin)))
    if kind == "choice":
        return choose(relation(random.choice("<>"), x, size), other, multiply(node("number", "3"), other))
    return add(other, multiply(other, multiply(ratio, ratio)))


def _inside(s: S, random: Random, top: list[S]) -> S:
    """Let declarations in models that are parts or bases, whose values others overrule, be formulas of their neighbours."""
    if s.kind != "model" or s.seq().items == tuple(top):
        return s
    mods = [
        m.name for t in top if t.kind in ("component", "extends") for m in t.seq().items if m.kind == "mod"
    ]
    items = list(s.seq().items)
    stems = [x for x in items if is_number(x) and not x.slots[0].expression.level and random.random() < 0.5]
    for k, x in enumerate(items):
        if is_number(x) and x not in stems and stems and x.name in mods and random.random() < 0.7:
            items[k] = with_value(x, _another(x.slots[0].expression, stems, random))
    return replace(s, parts=tuple(Seq(tuple(items)) if isinstance(p, Seq) else p for p in s.parts))
