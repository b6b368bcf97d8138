"""The same model with values of elements: stated one by one, in arrays inside of arrays, and gravity of heirs."""

from __future__ import annotations

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
    """Give initial values of arrays element by element, beside one for the whole that does not count."""
    new: list[S] = []
    changed = False
    for s in model.top.seq().items:
        n = (s.data or {}).get("n")
        if s.kind != "coordinate" or not n or not s.slots or random.random() < 0.3:
            new.append(s)
            continue
        changed = True
        e, sign = s.slots[0].expression, sign_of(s)
        values = list(e.operands) if e.kind == "vector" else [e] * n
        text = str(s.parts[0]).rsplit(sign, 1)[0].rstrip()
        new.append(statement("coordinate", f"{text};", name=s.name, data=s.data))
        wrong = quantity(f"{random.uniform(2, 4):.2f}", values[0].dim, random)
        given = [_initial(s.name, sign, wrong)]
        given += [_initial(f"{s.name}[{k}]", sign, v) for k, v in enumerate(values, 1)]
        new += random.sample(given, len(given))
    return Twin("by element", model.with_top(tuple(new))) if changed else None


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
