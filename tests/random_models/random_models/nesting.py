"""The same model with values of elements: stated one by one, in arrays inside of arrays, and gravity of heirs."""

from __future__ import annotations

from dataclasses import replace
from random import Random

from random_models.operators import multiply, vector
from random_models.quantities import quantity
from random_models.scope import TYPES
from random_models.structure import decoy, mod, model_statement, sign_of, with_value
from random_models.tree import (
    E,
    Model,
    S,
    Seq,
    Slot,
    map_expression,
    node,
    reference,
    statement,
)
from random_models.twins import Twin


def by_element(model: Model, random: Random) -> Twin | None:
    """Give initial values and rates of arrays element by element, beside a whole whose values there do not count."""
    new: list[S] = []
    later: list[S] = []
    items = model.top.seq().items
    if any(s.kind == "initial" and "[" in s.name for s in items):  # some are stated so
        return None
    for s in items:
        n = _elements(s)
        if s.kind == "component" and "[" not in str(s.parts[0]):
            s, given = _outside(s, random)
            new.append(s)
            later += given
        elif not n or random.random() < 0.3:
            new.append(s)
        else:
            sign = sign_of(s)
            if s.kind == "coordinate":
                text = str(s.parts[0]).rsplit(sign, 1)[0].rstrip()
                new.append(statement("coordinate", f"{text};", name=s.name, data=s.data))
            later += _one_by_one(s.name, sign, s.slots[0].expression, n, random)
    return Twin("by element", model.with_top((*new, *later))) if later else None


def _elements(s: S) -> int:
    """Return of how many elements a statement gives the initial value, 0 if it gives none."""
    if s.kind == "initial" and s.slots and s.slots[0].expression.kind == "vector":
        return 0 if "orientation" in s.name else len(s.slots[0].expression.operands)
    n = (s.data or {}).get("n")
    return int(str(n)) if s.kind == "coordinate" and n and s.slots else 0


def _outside(s: S, random: Random) -> tuple[S, list[S]]:
    """Give the initial values of arrays in a component beside it."""
    kept: list[S] = []
    given: list[S] = []
    for m in s.seq().items:
        e = m.slots[0].expression
        vector_of = m.slots[0].place in ("modification.initial", "modification.rate") and e.kind == "vector"
        if not vector_of or "orientation" in m.name or random.random() < 0.3:
            kept.append(m)
            continue
        name = f"der({s.name}.{m.name[4:-1]})" if m.name.startswith("der(") else f"{s.name}.{m.name}"
        given += _one_by_one(name, str((m.data or {})["sign"]), e, len(e.operands), random)
    parts = tuple(Seq(tuple(kept), "list") if isinstance(p, Seq) else p for p in s.parts)
    return (replace(s, parts=parts) if given else s), given


def _one_by_one(name: str, sign: str, e: E, n: int, random: Random) -> list[S]:
    """State the value of a whole, some elements of which are wrong, and those and others by themselves."""
    values = list(e.operands) if e.kind == "vector" else [e] * n
    stem, tail = (name[:-1], ")") if name.startswith("der(") else (name, "")
    wrong = [random.random() < 0.7 for _ in values]
    whole = [decoy(v, random) if w else v for v, w in zip(values, wrong, strict=True)]
    if all(wrong) and random.random() < 0.5:
        stated = _initial(name, sign, decoy(values[0], random))
    else:
        stated = _initial(name, sign, vector(*whole))
    given = [
        _initial(f"{stem}[{k}]{tail}", sign, v)
        for k, (v, w) in enumerate(zip(values, wrong, strict=True), 1)
        if w or random.random() < 0.3
    ]
    return random.sample([stated, *given], len(given) + 1)


def _initial(name: str, sign: str, e: E) -> S:
    data = {"guess": sign == "~"}
    return statement(
        "initial", f"initial {name} {sign} ", Slot("initial.value", e), ";", name=name, data=data
    )


def in_arrays(model: Model, random: Random) -> Twin | None:
    """Let parameters of one dimension be those of components in an array inside of an array."""
    items = list(model.top.seq().items)
    held = _named_elsewhere(model)
    plain = [
        s
        for s in items
        if s.kind == "parameter"
        and len(s.slots) == 1
        and _literal(s.slots[0].expression)
        and s.name
        and s.name not in held
    ]
    random.shuffle(plain)
    pair = next(
        (
            (a, b)
            for k, a in enumerate(plain)
            for b in plain[k + 1 :]
            if a.slots[0].expression.dim == b.slots[0].expression.dim and a.slots[0].expression.dim in TYPES
        ),
        None,
    )
    if pair is None:
        return None
    values = [s.slots[0].expression for s in pair]
    d = values[0].dim
    leaf = model_statement(
        "Leaf",
        [statement("parameter", f"parameter {TYPES[d][0]} v = ", Slot("parameter.value", quantity(7, d)), ";", name="v")],
    )  # fmt: skip
    inner = statement(
        "component",
        "Leaf leaf[2]",
        Seq((mod("v", "=", "modification.parameter", decoy(values[0], random)),), "list"),
        ";",
        name="leaf",
    )
    branch = model_statement("Branch", [inner])
    if random.random() < 0.5:  # along the leaves of each branch
        given, places = vector(*values), [random.randint(1, 2), random.randint(1, 2)]
        names = {s.name: f"tree[{places[k]}].leaf[{k + 1}].v" for k, s in enumerate(pair)}
    else:
        wrong = [decoy(v, random) for v in values]
        rows = random.random() < 0.5
        whole = [[values[0], wrong[0]], [values[1], wrong[1]]]
        if not rows:
            whole = [[values[0], values[1]], wrong]
        given = vector(*(vector(*row) for row in whole), kind="matrix")
        other = "tree[2].leaf[1].v" if rows else "tree[1].leaf[2].v"
        names = {pair[0].name: "tree[1].leaf[1].v", pair[1].name: other}
    tree = statement(
        "component",
        "Branch tree[2]",
        Seq((mod("leaf.v", "=", "modification.nested", given),), "list"),
        ";",
        name="tree",
    )

    def change(e: E, place: str) -> E:
        return map_expression(
            e, lambda x: reference(names[x.ref], "parameter", x.dim, level="p") if x.ref in names else x
        )

    rest = [s.rebuilt(change) for s in items if s not in pair]
    rest.insert(random.randrange(len(rest)), tree)
    top = model.with_top(tuple(rest))
    return Twin("in arrays", Model((*top.items[:-1], leaf, branch, top.items[-1])))


def _named_elsewhere(model: Model) -> set[str]:
    """Return what an experiment sets, what other models and functions name, and what is overruled in `extends`."""
    named = {
        e.ref
        for item in model.items[:-1]
        for s in item.walk()
        for slot in s.slots
        for e in slot.expression.walk()
    }
    for s in model.top.seq().items:
        if s.kind == "experiment":
            named |= {word for p in s.parts if isinstance(p, str) for word in p.replace(",", " ").split()}
        if s.kind == "extends":
            named |= {m.name for m in s.seq().items}
    return named


def _literal(e: E) -> bool:
    return not e.shape and not e.level and e.kind in ("quantity", "number")


def with_gravity(model: Model, random: Random) -> Twin | None:
    """Let the model overrule the gravity of one that it extends."""
    own = next((s for s in model.top.seq().items if s.kind == "gravity"), None)
    if own is None:
        return None
    e = own.slots[0].expression
    wrong = with_value(own, multiply(node("number", "3", value=lambda: 3), e))
    base = model_statement("Heavy", [wrong], partial=random.random() < 0.5)
    heir = statement("extends", "extends Heavy", Seq((), "list"), ";")
    items = [heir, *model.top.seq().items] if random.random() < 0.5 else [*model.top.seq().items, heir]
    top = model.with_top(tuple(items))
    return Twin("with gravity", Model((*top.items[:-1], base, top.items[-1])))


NESTED = (by_element, in_arrays, with_gravity)
