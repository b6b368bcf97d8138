"""Parameters and starts that a run is given, by a number in the place of a number or a formula, against a text that says the same."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from random import Random
from typing import Any

import numpy as np

import mechc
from random_models.carried import lengths_alike
from random_models.compiled import Compiled, Given, NoMotion, Refused, differences, prepared, shaken
from random_models.meaning import Meaning
from random_models.quantities import quantity
from random_models.settings import is_number
from random_models.starts import begun
from random_models.structure import with_value
from random_models.tree import Dim, E, Model, S, node, statement


def chosen(model: Model, random: Random) -> dict[str, float]:
    """Choose parameters and other values for them, formulas first; nothing if there are none that have a positive value."""
    known = Meaning(model)
    there: list[tuple[bool, str, float]] = []
    for s in model.top.seq().items:
        if is_number(s):
            try:
                value = float(np.asarray(known.value(s.name)))
            except (ValueError, KeyError):
                continue
            if value > 0:
                there.append((not s.slots[0].expression.level, s.name, value))
    random.shuffle(there)
    there.sort(key=lambda row: row[0])
    return {name: value * random.uniform(0.9, 1.15) for _, name, value in there[: random.choice((1, 1, 2))]}


def said_by_text(model: Model, given: dict[str, float]) -> Model:
    """Return the model that says these values itself."""

    def change(s: S) -> S:
        return with_value(s, written(given[s.name], s.slots[0].expression.dim)) if s.name in given else s

    return model.with_top(tuple(change(s) if is_number(s) else s for s in model.top.seq().items))


def whole(model: Model, random: Random) -> tuple[dict[str, Given], str]:
    """Choose other values for an array in a part, and another one for an element of it; return them and the text that says so."""
    items = model.top.seq().items
    there = [s for s in items if s.data and "whole" in s.data]
    if not there:
        return {}, ""
    s = random.choice(there)
    assert s.data is not None
    name, n, text = s.data["whole"]
    values = [random.uniform(0.4, 2) for _ in range(n)]
    k, own = random.randrange(n), random.uniform(2, 3)
    given: list[tuple[str, Given]] = [(name, values), (f"{name}[{k + 1}]", own)]
    said = ", ".join(f"{own if i == k else v:.17g}" for i, v in enumerate(values))
    other = statement("list", text.format(f"{{{said}}}"))
    return dict(random.sample(given, 2)), model.with_top(tuple(other if x is s else x for x in items)).text()


def written(value: float, d: Dim) -> E:
    """Write a number of SI so that nothing of it is lost."""
    unit = str(quantity(1, d)).partition(" ")[2]
    return node("quantity" if unit else "number", f"{value:.17g} {unit}".strip(), dim=d, value=lambda: value)


def differs_from_text(model: Model, base: Compiled, seed: int) -> list[tuple[str, str]] | None:
    """List how a model with given parameters, or a given start, differs from one whose text says them."""
    random = Random(f"given to {seed}")
    given = chosen(model, random)
    found = _differs(base, given, said_by_text(model, given).text(), seed) if given else []
    start, text = begun(base.text, random)
    found += _differs(base, start, text, seed) if start else []
    told, text = whole(model, random)
    found += _differs(base, told, text, seed) if told else []
    return found if given or start or told else None


def _differs(base: Compiled, given: Mapping[str, Given], text: str, seed: int) -> list[tuple[str, str]]:
    quick = base.problem.quick
    one = _refused(lambda: base.model, base.text, quick, given)
    other = _refused(lambda: mechc.loads(text), text, quick)
    if isinstance(one, Refused) or isinstance(other, Refused):
        both = isinstance(one, Refused) and isinstance(other, Refused)
        return [] if both else [("refused", f"{given}: {one}\n{other}")]
    wrong = differences(one.parameters(), other.parameters(), relative=1e-12)
    if lengths_alike(one, other):  # a formula that is not read any more used some
        wrong += differences(one.start(), other.start())
    rng = np.random.default_rng(seed)
    for state in [] if wrong else one.random_states(rng, 2):
        try:
            here, there = one.settle(state), other.settle(state)
        except NoMotion:
            continue
        near = [one.everything(shaken(here, rng)) for _ in range(2)]
        wrong += differences(one.everything(here), other.everything(there), near, relative=one.relative)
    lines = "".join(f"{n}: {x:.12g}, by the text {y:.12g}\n" for n, x, y in wrong[:6])
    return [("value", f"{given}\n{lines}")] if wrong else []


def _refused(
    made: Callable[[], Any], text: str, quick: bool, values: Mapping[str, Given] | None = None
) -> Any:
    try:
        return prepared(made, values, text, quick=quick)
    except Refused as refused:
        return refused
