"""Whether every number of a text reaches what flattening makes of it: what is read, but forgotten or taken twice, changes nothing.

The compiler and the definition read the same flat model, so that neither misses what the parser or flattening lost.
"""

from __future__ import annotations

import bisect
from fractions import Fraction
from typing import Any

from mechc.compiler.flat.flatten import flatten
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.source import SourceFile
from random_models.quantities import quantity
from random_models.tree import E, Model, map_expression

_UNREAD = ("function.body", "experiment.", "draw.")
"""Places of what may have no effect on the mechanics, or that keeps its numbers elsewhere."""
_CHOSEN = {"index", "max", "min", "clamp", "deadzone", "abs", "mod", "div", "floor", "ceil", "sign", "table"}
"""Of the numbers in these one may be chosen already, as of a row, or of several constants."""
MOST = 6
"""Numbers of a model that are changed to see whether anything else follows."""


def lost(model: Model, flat: Any) -> list[str]:
    """List the numbers of a text that no number of its flat model follows."""
    sizes = sorted(_numbers(flat))
    found = []
    for place, e in _literals(model):
        v = abs(float(e.data))
        k = bisect.bisect_left(sizes, v * (1 - 1e-12))
        if k < len(sizes) and sizes[k] <= v * (1 + 1e-12):
            continue
        found.append((place, e))
    return [
        f"{place}: {e} changes nothing"
        for place, e in found[:MOST]
        if sizes == sorted(_numbers(_flat(_changed(model, e))))
    ]


def _literals(model: Model) -> list[tuple[str, E]]:
    slots = [slot for s in model.statements() for slot in s.slots if not slot.place.startswith(_UNREAD)]
    return [
        (slot.place, e)
        for slot in slots
        if all(e.kind not in _CHOSEN for e in slot.expression.walk())
        for e in slot.expression.walk()
        if e.kind == "quantity" and e.data is not None
    ]


def _changed(model: Model, one: E) -> Model:
    """Change a number by a hundredth wherever it stands."""

    def change(e: E) -> E:
        return quantity(e.data * Fraction(101, 100), e.dim) if e == one else e

    return model.rebuilt(lambda e, _: map_expression(e, change))


def _flat(model: Model) -> Any:
    reporter = Reporter()
    return flatten(parse(SourceFile("model.mech", model.text()), reporter), reporter)


def _numbers(flat: Any) -> set[float]:
    """The sizes of all numbers that a flat model holds."""
    seen: set[int] = set()
    found: set[float] = set()
    todo = [flat]
    while todo:
        x = todo.pop()
        if isinstance(x, float | int | Fraction):
            found.add(abs(float(x)))
        elif isinstance(x, tuple | list | frozenset):
            todo += x
        elif isinstance(x, dict):
            todo += x.values()
        elif hasattr(x, "__struct_fields__") and id(x) not in seen:
            seen.add(id(x))
            todo += [getattr(x, f) for f in x.__struct_fields__ if f not in ("span", "origin", "type")]
    return found
