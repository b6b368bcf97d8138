"""The text of ``mechc explain MODEL``: what the compiler chose, what it left out, why, and what that saved."""

from __future__ import annotations

import textwrap
from collections import defaultdict
from typing import TYPE_CHECKING, Any

from msgspec import to_builtins

from ..compiler.targets.parts import FUNCTIONS
from ..presentation.numbers import plural
from ..presentation.style import PLAIN, Style, pad, width

if TYPE_CHECKING:
    from ..compiler.equations.model import Choice
    from ..model import CompiledModel
    from .savings import Cost, Savings

WIDTH = 100
SIZES = {"c": "bytes of code", "python": "bytes of text", "fmu": "bytes of the binary"}


def explanation(model: CompiledModel, style: Style = PLAIN, saved: Savings | None = None) -> str:
    """Return the choices, those with the same decision and reason together, and what each of them saved."""
    groups: dict[tuple[str, str], list[Choice]] = defaultdict(list)
    for choice in model.compilation.equations.choices:
        groups[choice.decision, choice.reason].append(choice)
    column = max((width(_lead(choices)) for choices in groups.values()), default=0)
    rows = [f"{style.bold(model.name)}: {', '.join(plural(n, word) for n, word in _counts(model) if n)}"]
    for (decision, reason), choices in groups.items():
        words = decision if len(choices) == 1 else ", ".join(choice.topic for choice in choices)
        lines = textwrap.wrap(words, WIDTH - column)
        lines += [style.dim(row) for row in textwrap.wrap(reason, WIDTH - column)]
        costs = [(choice, _said(saved, choice)) for choice in choices] if saved is not None else []
        for choice, text in costs:
            said = text if len(choices) == 1 else f"{choice.topic}: {text}"
            lines += textwrap.wrap(said, WIDTH - column) if text else []
        leads = [style.cyan(pad(_lead(choices), column)), *[" " * column] * (len(lines) - 1)]
        rows += ["", *(f"  {lead}  {line}" for lead, line in zip(leads, lines, strict=True))]
    if saved is not None:
        rows += ["", *_totals(saved, style)]
    return "\n".join(rows)


def summary(model: CompiledModel, saved: Savings | None = None) -> dict[str, Any]:
    """Return the same as plain data."""
    program = model.compilation.program
    choices = []
    for choice in model.compilation.equations.choices:
        row: dict[str, Any] = {"topic": choice.topic, "decision": choice.decision, "reason": choice.reason}
        if saved is not None and choice.part in saved.parts:
            row["saved"] = _difference(saved.parts[choice.part], saved.lean)
            row["functions"] = list(FUNCTIONS.get(choice.part, ()))
        choices.append(row)
    found: dict[str, Any] = {
        "model": model.name,
        "sizes": {word: n for n, word in _counts(model)},
        "functions": {function.name: function.operations for function in program.functions},
        "choices": choices,
    }
    if saved is not None:
        found |= {
            "target": saved.target,
            "lean": to_builtins(saved.lean),
            "keep_all": to_builtins(saved.everything),
        }
    return found


def _counts(model: CompiledModel) -> list[tuple[int, str]]:
    equations = model.compilation.equations
    accounts = sum(entry.kind == "account" for entry in equations.states)
    return [
        (equations.nq, "coordinate"),
        (equations.nv, "velocity"),
        (equations.nx - accounts, "first-order state"),
        (len(equations.parameters), "parameter"),
        (len(equations.inputs), "input"),
    ]


def _difference(cost: Cost, lean: Cost) -> dict[str, float | None]:
    """Return how much more one build costs than the lean one."""
    known = cost.nanoseconds is not None and lean.nanoseconds is not None
    return {
        "operations": cost.operations - lean.operations,
        "evaluation": cost.evaluation - lean.evaluation,
        "size": None if cost.size is None or lean.size is None else cost.size - lean.size,
        "nanoseconds": (cost.nanoseconds or 0.0) - (lean.nanoseconds or 0.0) if known else None,
    }


def _said(saved: Savings, choice: Choice) -> str:
    """Say what a part that is left out would have cost."""
    if choice.part and choice.part not in saved.parts:
        return "too large to be formed for a comparison"
    if choice.part not in saved.parts:
        return ""
    cost = saved.parts[choice.part]
    more = _difference(cost, saved.lean)
    texts = []
    if choice.part in FUNCTIONS:
        names = FUNCTIONS[choice.part]
        texts.append(f"the function{'s' if len(names) > 1 else ''} {', '.join(names)}")
    texts.append(plural(int(more["operations"] or 0), "operation"))
    if more["size"] is not None:
        texts.append(f"{int(more['size'])} {SIZES[saved.target]}")
    if more["nanoseconds"] is not None and saved.lean.nanoseconds:
        texts.append(f"{round(more['nanoseconds'], 1) + 0.0:.1f} ns an evaluation")
    return f"saves {'; '.join(texts)}"


def _totals(saved: Savings, style: Style) -> list[str]:
    """Compare the lean build with that of ``--keep-all``."""
    rows = [style.bold(f"  {'':<34} {'lean':>10} {'keep-all':>10}  ratio")]
    lean, everything = saved.lean, saved.everything
    for words, a, b in (
        ("operations, all functions", lean.operations, everything.operations),
        ("operations of the right-hand side", lean.evaluation, everything.evaluation),
        (SIZES[saved.target], lean.size, everything.size),
        ("ns an evaluation, all told", lean.nanoseconds, everything.nanoseconds),
    ):
        if a is None or b is None:
            continue
        ratio = f"{a / b:.2f}" if b else "-"
        rows.append(f"  {words:<34} {a:>10.4g} {b:>10.4g}  {ratio:>5}" if isinstance(a, float) else
                    f"  {words:<34} {a:>10} {b:>10}  {ratio:>5}")  # fmt: skip
    return rows


def _lead(choices: list[Choice]) -> str:
    """Return what stands in the margin: the topic of a single choice, the decision of several."""
    return choices[0].topic if len(choices) == 1 else choices[0].decision
