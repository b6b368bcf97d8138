"""The values that a flat model has by its own text: parameters, and the initial values that are known."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from random_models.tree import E, Model, evaluate


def _given(model: Model) -> Iterator[tuple[str, str, E]]:
    """Yield (name, what, expression) of parameters and initial values in the text of the model itself."""
    for s in model.top.seq().items:
        if s.kind == "parameter" and s.slots:
            yield s.name, "parameter", s.slots[0].expression
        elif s.kind in ("coordinate", "initial", "state") and s.slots:
            guess = (s.data or {}).get("guess", False)
            yield s.name, "guess" if guess else "known", s.slots[0].expression
        elif s.kind == "component":
            for m in s.seq().items:
                if m.kind != "mod":
                    continue
                name = f"{s.name}.{m.name}"
                if m.name.startswith("der("):
                    name = f"der({s.name}.{m.name[4:-1]})"
                place = m.slots[0].place
                if place == "modification.parameter":
                    yield name, "parameter", m.slots[0].expression
                elif place in ("modification.initial", "modification.rate"):
                    known = (m.data or {}).get("sign") == "="
                    yield name, "known" if known else "guess", m.slots[0].expression


class Meaning:
    """Numbers by name, computed from the tree of the model alone."""

    def __init__(self, model: Model) -> None:
        self.given = list(_given(model))
        self.parameters_by_name = {name: e for name, what, e in self.given if what == "parameter"}
        self.cache: dict[str, Any] = {}

    def value(self, name: str) -> Any:
        """Return the value of a parameter."""
        if name not in self.cache:
            self.cache[name] = evaluate(self.parameters_by_name[name], self.value)
        return self.cache[name]

    def values(self, *, guesses: bool) -> dict[str, float]:
        """Return parameters and initial values element by element; with ``guesses`` also those that may move."""
        found: dict[str, float] = {}
        for name, what, e in self.given:
            if what == "guess" and not guesses:
                continue
            try:
                value = self.value(name) if what == "parameter" else evaluate(e, self.value)
            except (ValueError, KeyError):
                continue
            for index, x in np.ndenumerate(np.asarray(value, dtype=float)):
                found[_element(name, index)] = float(x)
        return found


def _element(name: str, index: tuple[int, ...]) -> str:
    if not index:
        return name
    inside = ",".join(str(i + 1) for i in index)
    return f"{name[:-1]}[{inside}])" if name.startswith("der(") else f"{name}[{inside}]"
