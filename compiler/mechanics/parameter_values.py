"""What must be known before a run begins: parameters, defaults of inputs, initial values, settings.

Names that change are refused where they are written (flat/statements/variables.py), in the same words (flat/values/evaluate.py); here the
formulas are known, and with them what changes without being named: a frame that is carried along, a reaction.
"""

from __future__ import annotations

from collections.abc import Sequence

from mechc.lang.diagnostics import Reporter

from ..flat.model import Expression, Literal, Variable
from ..flat.values.evaluate import first_value_changes, input_changes, parameter_changes, setting_changes
from ..graph import Graph, Node
from .defaults import first_values
from .meaning.symbols import Scalar
from .meaning.values import Placement
from .system import MechanicalSystem


def check_known_beforehand(system: MechanicalSystem, reporter: Reporter) -> None:
    """Report parameters, defaults of inputs and discrete variables and settings of experiments that depend on the motion."""
    symbols = system.symbols
    fixed = {s.node for s in symbols.parameters}
    for variables, known, changes in (
        (_declared(symbols.parameters), fixed, parameter_changes),
        (_declared(symbols.inputs), fixed | {symbols.time}, input_changes),
    ):
        for variable in variables:
            value = variable.value
            if value is not None and (culprit := _culprit(system, value, known)) is not None:
                code, message, details = changes(variable.name, culprit)
                reporter.error(code, message, value.span, **details)
    first = first_values(system)
    for variable in _declared(symbols.discretes):
        own = [first[s.node] for s in symbols.discretes if s.variable is variable and s.node in first]
        culprit = _unknown(system.graph, own, fixed)
        if culprit is not None and variable.value is not None:
            code, message, details = first_value_changes(variable.name, culprit)
            reporter.error(code, message, variable.value.span, **details)
    for experiment in system.model.experiments:
        for value in (*experiment.options.values(), *(s.value for s in experiment.settings)):
            if (culprit := _culprit(system, value, fixed)) is not None:
                code, message, details = setting_changes(culprit)
                reporter.error(code, message, value.span, **details)
    _check_starts(system, fixed | {s.node for s in (*symbols.inputs, *symbols.discretes)}, reporter)


def _check_starts(system: MechanicalSystem, fixed: set[Node], reporter: Reporter) -> None:
    """Report initial values that ask for an answer about the motion, as a reaction."""
    known = fixed | {system.symbols.time}
    known |= {s.node for s in (*system.q, *system.v, *system.symbols.states)}
    seen = set()
    for beginning in (*system.start_q, *system.start_v, *system.start_x):
        start = beginning.start
        culprit = _unknown(system.graph, (beginning.value,), known)
        if culprit is None or start is None or start.origin.span in seen:
            continue
        seen.add(start.origin.span)
        reporter.error(
            "E0607",
            f"an initial value must not depend on '{culprit}'",
            start.value.span,
            caption="this is known only when the motion is",
            help="write 'initial EXPRESSION = VALUE' for a condition that coordinates and rates must meet",
        )


def _declared(scalars: Sequence[Scalar]) -> list[Variable]:
    return list({s.variable.name: s.variable for s in scalars}.values())


def _culprit(system: MechanicalSystem, value: Expression, known: set[Node]) -> str | None:
    if isinstance(value, Literal) and isinstance(value.value, str):
        return None
    placed = isinstance(system.lowering.value(value), Placement)
    nodes = () if placed else system.lowering.reported(value)
    return _unknown(system.graph, nodes, known)


def _unknown(graph: Graph, nodes: Sequence[Node], known: set[Node]) -> str | None:
    """Return the name of the first symbol in formulas that is not known, as the user would write it."""
    for n in graph.support(*nodes):
        if n not in known:
            return graph.name(n).removeprefix("?").partition("#")[0]
    return None
