"""Outputs that equations determine: enough equations, and nothing that is needed before a run depends on them."""

from __future__ import annotations

from mechc.lang.diagnostics import Label, Reporter

from ..model import FlatModel
from ..operands import stated
from ..unknowns import UnknownGroup, groups, unknowns_in

MOST = 10
"""Most numbers that one system determines."""

_BEFORE = ("variables", "experiments", "studies")
"""What is known before a run: values of parameters, starts, settings."""


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
    for field in _BEFORE:
        for expression in stated(getattr(model, field)):
            for name in unknowns_in(expression, definitions):
                reporter.error(
                    "E0338",
                    f"'{name}' is found during the motion, but this value is needed before it",
                    expression.span,
                    caption="the value of a parameter, a start or a setting",
                    help="write a formula of parameters; 'initial a = b;' may contain what equations determine",
                )


def _check_count(group: UnknownGroup, reporter: Reporter) -> None:
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
