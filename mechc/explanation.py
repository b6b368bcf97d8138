"""The text of ``mechc explain MODEL``: what the compiler chose, what it left out, why, and what that saved."""

from __future__ import annotations

import textwrap
from collections import defaultdict
from typing import TYPE_CHECKING

from .style import PLAIN, Style, pad, width

if TYPE_CHECKING:
    from .api import Model
    from .compiler.equations.model import Choice

WIDTH = 100


def explanation(model: Model, style: Style = PLAIN) -> str:
    """Return the choices, those with the same decision and reason together, and the operations they saved."""
    equations = model.compilation.equations
    accounts = sum(entry.kind == "account" for entry in equations.states)
    sizes = [
        (equations.nq, "coordinate"),
        (equations.nv, "velocity"),
        (equations.nx - accounts, "first-order state"),
        (len(equations.parameters), "parameter"),
        (len(equations.inputs), "input"),
    ]
    described = ", ".join(_plural(n, word) for n, word in sizes if n)
    groups: dict[tuple[str, str], list[Choice]] = defaultdict(list)
    for choice in equations.choices:
        groups[choice.decision, choice.reason].append(choice)
    column = max((width(_lead(choices)) for choices in groups.values()), default=0)
    rows = [f"{style.bold(model.name)}: {described}"]
    for (decision, reason), choices in groups.items():
        words = decision if len(choices) == 1 else ", ".join(choice.topic for choice in choices)
        saved = sum(choice.saved_operations for choice in choices)
        if saved:
            words += f" ({_plural(saved, 'operation')} saved)"
        lines = [*textwrap.wrap(words, WIDTH - column), *(style.dim(row) for row in [reason] if row)]
        leads = [style.cyan(pad(_lead(choices), column)), *[" " * column] * (len(lines) - 1)]
        rows += ["", *(f"  {lead}  {line}" for lead, line in zip(leads, lines, strict=True))]
    return "\n".join(rows)


def _lead(choices: list[Choice]) -> str:
    """Return what stands in the margin: the topic of a single choice, the decision of several."""
    return choices[0].topic if len(choices) == 1 else choices[0].decision


def _plural(n: int, word: str) -> str:
    if n != 1:
        word = word[:-1] + "ies" if word.endswith("y") else word + "s"
    return f"{n} {word}"
