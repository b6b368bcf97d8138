"""The text of ``mechc explain MODEL``: what the compiler chose, what it left out, why, and what that saved."""

from __future__ import annotations

import textwrap
import time
from collections import defaultdict
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct, to_builtins

from ..compiler.equations.needs import PARTS
from ..compiler.targets.parts import FUNCTIONS
from ..exporting import default_run
from ..presentation.numbers import plural
from ..presentation.style import PLAIN, Style, pad, width
from ..runtime.case import input_values
from ..runtime.native import contract
from ..runtime.outcome import time_text
from .needed_by import derived_lines, extent, line_of, lines, resting
from .savings import default_case

if TYPE_CHECKING:
    from ..compiler.equations.model import Choice
    from ..model import CompiledModel
    from .savings import Cost, Savings

WIDTH = 100
SIZES = {
    "c": "bytes of code",
    "python": "bytes of text",
    "fmu": "bytes of the binary",
    "web": "bytes of the module",
}


LONGEST = 10.0
"""Seconds that the run may take by which is found what it needs."""


class AsRun(Struct, frozen=True):
    """A model with all that its run has: ``words`` about that run, and the ``reasons`` of parts that it brought."""

    model: CompiledModel
    words: str
    reasons: Mapping[str, str] = MappingProxyType({})


class _TooLong(Exception):
    """The run by which is found what a model needs takes too long."""


def as_run(model: CompiledModel) -> AsRun:
    """Run the default experiment, and return the model as that takes it: a stiff one with its Jacobian, one that meets singular positions
    with multipliers of a small compliance."""
    begun = time.perf_counter()

    def within(_: float) -> None:
        if time.perf_counter() - begun > LONGEST:
            raise _TooLong

    try:
        ran = default_run(model, progress=within)
    except _TooLong:
        return AsRun(model, f"the run takes longer than {LONGEST:g} s: whether it brings more is not known")
    if ran is None:
        return AsRun(model, "no run can begin as the model is: whether it brings more is not known")
    made, run = ran
    done = run.statistics
    words = f"run: {done.method}, {plural(done.steps, 'step')}"
    brought = made.compilation.parts - model.compilation.parts
    reasons = dict.fromkeys(brought, "the run has met what needs it, and was repeated with it")
    if done.jacobians:
        since = f" since {time_text(run.problem, done.stiff_time)}" if done.stiff_time is not None else ""
        line = _stiffest(made)
        reasons["jacobian"] = f"the run is stiff{since}, and its implicit method works on it{line}"
        if model.method(None):
            reasons["jacobian"] = f"the experiment says the method '{model.method(None)}', which works on it"
    known = {name: why for name, why in reasons.items() if name in PARTS}
    return AsRun(made.keeping({*made.compilation.parts, *known}), words, known)


def _stiffest(model: CompiledModel) -> str:
    """Say which state changes fastest where the run begins, with its line: the largest entry in the mode of the largest rate."""
    problem = model.problem(method="radau5")
    case = default_case(problem)
    if case is None:
        return ""
    struct, ny = case.functions.struct, case.y0.size
    u = input_values(case.functions, case.tables, case.begin, case.p, len(problem.inputs))
    entries, dense = np.empty(struct.n_jacobian), np.zeros((ny, ny))
    places = (a.ctypes.data for a in (np.ascontiguousarray(case.y0), u, case.z, case.p, entries))
    contract.MODEL_FUNCTION(struct.jacobian)(case.begin, *places)
    for k, value in enumerate(entries):
        dense[struct.jac_row[k], struct.jac_col[k]] = value
    if not np.isfinite(dense).all():
        return ""
    rates, modes = np.linalg.eig(dense)
    name = problem.states[int(np.argmax(np.abs(modes[:, int(np.argmax(np.abs(rates)))])))].name
    line = line_of(model.compilation.flat, name)
    return f"; '{name}' changes fastest{f': {line}' if line else ''}"


def explanation(
    model: CompiledModel,
    style: Style = PLAIN,
    saved: Savings | None = None,
    ran: AsRun | None = None,
) -> str:
    """Return the choices, those with the same decision and reason together, the line that needs each, and what each of them saved."""
    groups: dict[tuple[str, str], list[Choice]] = defaultdict(list)
    for choice in model.compilation.equations.choices:
        groups[choice.decision, _reason(choice, model, ran)].append(choice)
    column = max((width(_lead(choices)) for choices in groups.values()), default=0)
    rows = [f"{style.bold(model.name)}: {', '.join(plural(n, word) for n, word in _counts(model) if n)}"]
    rows += [f"  {ran.words}"] if ran is not None else []
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


def _reason(choice: Choice, model: CompiledModel, ran: AsRun | None) -> str:
    """Say why, with the line of the model that decides it; else with all its lines."""
    reason = choice.reason if ran is None else ran.reasons.get(choice.part, choice.reason)
    if ": line " in reason:
        return reason
    flat, equations = model.compilation.flat, model.compilation.equations
    if choice.part:
        line = resting(flat).get(choice.part)
    else:
        line = (lines(flat) | derived_lines(equations)).get(choice.fact)
        line = line if choice.decision != "left out" else None
    return f"{reason}: {line or extent(flat)}"


def summary(model: CompiledModel, saved: Savings | None = None, ran: AsRun | None = None) -> dict[str, Any]:
    """Return the same as plain data."""
    program = model.compilation.program
    choices = []
    for choice in model.compilation.equations.choices:
        reason = _reason(choice, model, ran)
        row: dict[str, Any] = {"topic": choice.topic, "decision": choice.decision, "reason": reason}
        if saved is not None and choice.part in saved.parts:
            kept = choice.decision == "kept"
            row["cost" if kept else "saved"] = _difference(*_both(saved, choice))
            row["functions"] = list(FUNCTIONS.get(choice.part, ()))
        choices.append(row)
    found: dict[str, Any] = {
        "model": model.name,
        "sizes": {word: n for n, word in _counts(model)},
        "functions": {function.name: function.operations for function in program.functions},
        "choices": choices,
        **({"run": ran.words} if ran is not None else {}),
    }
    if saved is not None:
        found |= {
            "target": saved.target,
            "lean": _as_data(saved.lean),
            "keep_all": _as_data(saved.everything),
        }
    return found


def _as_data(cost: Cost) -> dict[str, Any]:
    return {**to_builtins(cost), "nanoseconds": cost.nanoseconds, "interval": cost.interval}


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


def _both(saved: Savings, choice: Choice) -> tuple[Cost, Cost]:
    """Return the build with the part and the one without."""
    other = saved.parts[choice.part]
    return (saved.lean, other) if choice.decision == "kept" else (other, saved.lean)


def _difference(cost: Cost, lean: Cost) -> dict[str, Any]:
    """Return how much more one build costs than another; times with the interval that holds them."""
    apart = cost.beyond(lean)
    return {
        "operations": cost.operations - lean.operations,
        "evaluation": cost.evaluation - lean.evaluation,
        "size": None if cost.size is None or lean.size is None else cost.size - lean.size,
        "nanoseconds": None if apart is None else apart[0],
        "interval": None if apart is None else list(apart[1:]),
    }


def _said(saved: Savings, choice: Choice) -> str:
    """Say what a part that is left out would have cost, or one that is kept does."""
    if choice.part and choice.part not in saved.parts:
        return "too large to be formed for a comparison"
    if choice.part not in saved.parts:
        return ""
    more = _difference(*_both(saved, choice))
    texts = []
    if choice.part in FUNCTIONS:
        names = FUNCTIONS[choice.part]
        texts.append(f"the function{'s' if len(names) > 1 else ''} {', '.join(names)}")
    count, each = more["operations"], more["evaluation"]
    within = f", {abs(each)}{_sign(each)} in each evaluation" if each else ""
    texts.append(f"{plural(abs(count), 'operation')}{_sign(count)}{within}")
    if more["size"] is not None:
        texts.append(f"{abs(more['size'])} {SIZES[saved.target]}{_sign(more['size'])}")
    if more["nanoseconds"] is not None:
        texts.append(_time(more["nanoseconds"], *more["interval"]))
    return f"{'costs' if choice.decision == 'kept' else 'saves'} {'; '.join(texts)}"


def _sign(saved: float) -> str:
    """Say where the build without is the one that has more."""
    return " more" if saved < 0 else ""


def _time(median: float, low: float, high: float) -> str:
    """Give a time and its interval, which reaches from zero where the sign is not known."""
    if low <= 0 <= high:
        return f"less than {max(-low, high):.1f} ns an evaluation"
    near, far = sorted((abs(low), abs(high)))
    return f"{abs(median):.1f} ns an evaluation{_sign(median)} ({near:.1f} to {far:.1f})"


def _totals(saved: Savings, style: Style) -> list[str]:
    """Compare the lean build with that of ``--keep-all``."""
    rows = [style.bold(f"  {'':<34} {'lean':>10} {'keep-all':>10}  ratio")]
    lean, everything = saved.lean, saved.everything
    for words, a, b in (
        ("operations, all functions", lean.operations, everything.operations),
        ("operations of the right-hand side", lean.evaluation, everything.evaluation),
        (SIZES[saved.target], lean.size, everything.size),
        ("ns an evaluation, all told", lean.nanoseconds, everything.nanoseconds),
        ("  from", lean.interval and lean.interval[0], everything.interval and everything.interval[0]),
        ("  to", lean.interval and lean.interval[1], everything.interval and everything.interval[1]),
    ):
        if a is None or b is None:
            continue
        ratio = "" if words[0] == " " else f"{a / b:.2f}" if b else "-"
        rows.append(f"  {words:<34} {a:>10.4g} {b:>10.4g}  {ratio:>5}".rstrip() if isinstance(a, float) else
                    f"  {words:<34} {a:>10} {b:>10}  {ratio:>5}")  # fmt: skip
    return rows


def _lead(choices: list[Choice]) -> str:
    """Return what stands in the margin: the topic of a single choice, the decision of several."""
    return choices[0].topic if len(choices) == 1 else choices[0].decision
