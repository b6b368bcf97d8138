"""Parameters and inputs of a model that nothing in it uses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from mechc.lang import ast

from ..names.instance import Instance
from .inside import Inside, listed


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


def _names(references: Iterable[ast.Reference], modifications: Iterable[ast.Modification]) -> Iterator[str]:
    """Yield the first parts of references; what a modification or an experiment sets is not used by that."""
    set_by = {id(m.target) for m in modifications if m.kind != "->"}
    for reference in references:
        if id(reference) not in set_by:
            yield reference.parts[0].name
