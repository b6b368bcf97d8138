"""The text of ``mechc explain MODEL``: what the compiler chose, what it left out, why, and what that saved."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

from .style import PLAIN, Style, pad, width

if TYPE_CHECKING:
    from .api import Model
    from .compiler.equations.model import Choice


def explanation(model: Model, style: Style = PLAIN) -> str:
    """Return the choices by topic, each with its reason and the operations that it saved."""
    equations = model.compilation.equations
    sizes = [
        (equations.nq, "coordinate"),
        (equations.nv, "velocity"),
        (equations.nx, "first-order state"),
        (len(equations.parameters), "parameter"),
        (len(equations.inputs), "input"),
    ]
    described = ", ".join(_plural(n, word) for n, word in sizes if n)
    rows = [f"{style.bold(model.name)}: {described}", ""]
    topics: dict[str, list[Choice]] = defaultdict(list)
    for choice in equations.choices:
        topics[choice.topic].append(choice)
    column = max((width(topic) for topic in topics), default=0)
    for topic, choices in topics.items():
        for i, choice in enumerate(choices):
            saved = f" ({choice.saved_operations} operations saved)" if choice.saved_operations else ""
            lead = style.cyan(pad(topic if i == 0 else "", column))
            rows.append(f"  {lead}  {choice.decision}{saved}")
            if choice.reason:
                rows.append(f"  {' ' * column}  {style.dim(choice.reason)}")
    rows += [
        "",
        f"  {style.cyan(pad('needs', column))}  {', '.join(sorted(equations.needs)) or 'nothing special'}",
    ]
    return "\n".join(rows)


def _plural(n: int, word: str) -> str:
    if n != 1:
        word = word[:-1] + "ies" if word.endswith("y") else word + "s"
    return f"{n} {word}"
