"""Parameters and inputs of a model that nothing in it uses, and inputs of its components that nothing gives a value."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from mechc.lang import ast

from ..model import Experiment, Role
from ..names.instance import Instance
from ..statements.record import StatementRecord
from .inside import Inside, listed

_SUBSCRIPT = re.compile(r"\[\d+(, ?\d+)*\]")


def warn_of_unused(instance: Instance, inside: Sequence[Inside]) -> None:
    """Warn of parameters and inputs that the model declares itself and that none of its statements names.

    What is said under conditions counts, whether they hold or not. Bases and components are not asked: those of a
    library offer more than each of their users needs. The parameters of a shape are for its contacts.
    """
    if instance.cls.model.shape:
        return
    used = {name for found in inside for name in _names(found.references, found.modifications)}
    for inherited in instance.cls.inherited:
        references, modifications, *_ = listed(inherited.modification)
        used.update(_names(references, modifications))
    for found in inside:
        if found.stated.model is not instance.cls.model:
            continue
        for node in found.declared:
            if node.name in used:
                continue
            word = "parameter" if isinstance(node, ast.Parameter) else "input"
            instance.flattening.reporter.warning(
                "W0402",
                f"nothing uses the {word} '{node.name}'",
                node.name_span,
                caption="its value changes nothing",
                help="use it in a statement of the model, or remove it",
            )


def warn_of_unset(instance: Instance, record: StatementRecord, experiments: Sequence[Experiment]) -> None:
    """Warn of inputs of components without a default that the model and its experiments give no value; once for an array of
    components. Those of the model itself are what it asks from outside.
    """
    told = {s.target for e in experiments for s in e.settings}
    told.update(s.target for e in experiments for s in e.sweeps)
    for member in record.variables:
        if member.role is not Role.INPUT or member.value is not None or member.scope.instance is instance:
            continue
        of_all = _SUBSCRIPT.sub("", member.name)
        if member.name in told or of_all in told:
            continue
        told.add(of_all)
        component, _, name = of_all.rpartition(".")
        instance.flattening.reporter.warning(
            "W0403",
            f"nothing here gives the input '{of_all}' a value: it is 0 unless a run sets it",
            member.scope.origin(member.declaration.span).shown,
            help=f"write '{name} = …' where '{component}' stands; a value from outside is an input of the model: 'input {name};' and '{name} = {name}'",
        )


def _names(references: Iterable[ast.Reference], modifications: Iterable[ast.Modification]) -> Iterator[str]:
    """Yield the first parts of references; what a modification or an experiment sets is not used by that."""
    set_by = {id(m.target) for m in modifications if m.kind != "->"}
    for reference in references:
        if id(reference) not in set_by:
            yield reference.parts[0].name
