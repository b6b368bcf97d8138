"""Statements that parse and check but have no meaning in the equations yet: refused, with their place."""

from __future__ import annotations

from mechc.lang.diagnostics import Reporter

from ..flat.model import FlatModel


def refuse(model: FlatModel, reporter: Reporter) -> None:
    """Report each statement that the equations cannot hold yet."""
    for variable in model.variables:
        if "chart" in variable.attributes.options:
            reporter.error(
                "E0590",
                "charts of rotations are not supported yet",
                variable.origin.shown,
                caption="this asks for three angles instead of a quaternion",
                help="leave the chart out, or write the frame as rotz(a)*rotx(b)*rotz(c) with coordinates a, b, c",
            )
    for experiment in model.experiments:
        if (section := experiment.options.get("record")) is not None:
            reporter.error(
                "E0590",
                "recording where an expression crosses zero is not supported yet",
                section.span,
                help="'every' records at equal distances; where the condition of a 'when' becomes true is an event, "
                "which the solution keeps",
            )
