"""Outputs that equations determine: enough equations, and nothing of the motion depends on them."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec

from mechc.lang.diagnostics import Label, Reporter

from ..model import Expression, FlatModel, Typed
from ..unknowns import Group, groups, unknowns_in

MOST = 10
"""Most numbers that one system determines."""

_ANSWERS = ("definitions", "assertions", "exacts", "draws", "implicit", "unknowns")
"""Where unknowns may stand: what nothing of the motion depends on."""


def check_unknowns(model: FlatModel, reporter: Reporter) -> None:
    """Report unknowns without enough equations, and those that the motion would depend on."""
    if not model.unknowns:
        return
    if model.variation is not None:
        reporter.error(
            "E0338",
            "a curve has no outputs that equations determine",
            model.unknowns[0].origin.span,
            help="write the output as a formula",
        )
        return
    for group in groups(model):
        _check_count(group, reporter)
    definitions = {d.name: d.value for d in model.definitions}
    for unknown in model.unknowns:
        for name in unknowns_in(unknown.guess, definitions):
            reporter.error(
                "E0338",
                f"a guess must not depend on what is to be found, as on '{name}'",
                unknown.guess.span,
            )
    for field in model.__struct_fields__:
        if field in _ANSWERS:
            continue
        for expression in _expressions(getattr(model, field)):
            for name in unknowns_in(expression, definitions):
                reporter.error(
                    "E0338",
                    f"'{name}' is found by equations, and the motion must not depend on it",
                    expression.span,
                    caption="which of several solutions is meant, nothing would tell along the motion",
                    help="write a formula, or a coordinate with a 'constraint'; outputs, 'exact' and 'assert' may use it",
                )


def _check_count(group: Group, reporter: Reporter) -> None:
    span = group.unknowns[0].origin.span
    labels = tuple(Label(e.origin.span, "an equation") for e in group.equations[:4])
    if group.rows < group.count:
        reporter.error(
            "E0339",
            f"{group.words}: {group.count} unknown number{'s' * (group.count != 1)}, "
            f"{group.rows or 'no'} equation{'s' * (group.rows != 1)}",
            span,
            labels=labels,
            help="write 'equation a = b;' for what determines it",
        )
    elif group.count > MOST:
        reporter.error(
            "E0339",
            f"{group.count} numbers in one system of equations, at most {MOST} are found",
            span,
            labels=labels,
            help="coordinates with constraints may be many more",
        )


def _expressions(value: object) -> Iterator[Expression]:
    """Yield the outermost expressions in what a field of a model holds."""
    if isinstance(value, Typed):
        yield value  # type: ignore[misc]
    elif isinstance(value, tuple):
        for item in value:
            yield from _expressions(item)
    elif isinstance(value, dict):
        yield from _expressions(tuple(value.values()))
    elif isinstance(value, msgspec.Struct):
        for field in value.__struct_fields__:
            yield from _expressions(getattr(value, field))
