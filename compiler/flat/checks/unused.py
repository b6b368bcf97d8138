"""Parameters and inputs of a model that nothing in it uses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from mechc.lang import ast

from ..names.instance import Instance
from ..names.space import nodes
from .inside import Inside


def warn_of_unused(instance: Instance, inside: Inside) -> None:
    """Warn of parameters and inputs that the model declares itself and that none of its statements names.

    What is said under conditions counts, whether they hold or not. Bases and components are not asked: those of a
    library offer more than each of their users needs.
    """
    used = {name for _, found in inside for name in _names(found)}
    used |= {
        name for inherited in instance.cls.inherited for name in _names((*nodes(inherited.modification),))
    }
    for stated, found in inside:
        if stated.model is not instance.cls.model:
            continue
        for node in found:
            if not isinstance(node, ast.Parameter | ast.Input) or node.name in used:
                continue
            word = "parameter" if isinstance(node, ast.Parameter) else "input"
            instance.flattening.reporter.warning(
                "W0402",
                f"nothing uses the {word} '{node.name}'",
                node.name_span,
                caption="its value changes nothing",
                help="use it in a statement of the model, or remove it",
            )


def _names(found: Iterable[ast.Node]) -> Iterator[str]:
    """Yield the first parts of all references; what a modification or an experiment sets is not used by that."""
    set_by = {id(n.target) for n in found if isinstance(n, ast.Modification) and n.kind != "->"}
    for inner in found:
        if isinstance(inner, ast.Reference) and id(inner) not in set_by:
            yield inner.parts[0].name
