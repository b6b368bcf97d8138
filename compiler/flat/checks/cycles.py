"""Definitions and parameters that are defined by themselves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from mechc.lang.diagnostics import Reporter

from ..model import Definition, DefinitionRole, Expression, Literal, Role, Variable
from ..operands import free_names


def check_cycles(
    variables: tuple[Variable, ...], definitions: tuple[Definition, ...], reporter: Reporter
) -> None:
    """Report each chain of names that leads back to its beginning."""
    for chain in chains_to_themselves(variables, definitions):
        elements = _defined(variables, definitions)
        reporter.error(
            "E0207",
            f"'{chain[0]}' is defined by itself",
            elements[chain[0]].origin.span,
            caption=" -> ".join([*chain, chain[0]]),
            help=_cure(chain, definitions),
        )


def _cure(chain: list[str], definitions: tuple[Definition, ...]) -> str:
    """Say how a circle of signals is solved; "" where no output of a component is in it."""
    outputs = {d.name for d in definitions if d.role is DefinitionRole.OUTPUT}
    name = next((n.rpartition(".")[2] for n in chain if n in outputs and "." in n), None)
    if name is None:
        return ""
    return (
        f"where both hold at once, let an equation determine one of them: 'output {name} ~ 0;' and "
        f"'equation {name} = ..;' instead of 'output {name} = ..;'"
    )


def chains_to_themselves(
    variables: tuple[Variable, ...], definitions: tuple[Definition, ...]
) -> Iterator[list[str]]:
    """Yield the names of each chain of parameters and definitions that leads back to its beginning."""
    elements = _defined(variables, definitions)
    values: dict[str, Expression] = {
        n: e.value for n, e in elements.items() if e.value is not None and not isinstance(e.value, Literal)
    }
    done: set[str] = set()
    for name in values:
        if chain := _chain(name, values, done):
            yield chain


def _defined(
    variables: tuple[Variable, ...], definitions: tuple[Definition, ...]
) -> dict[str, Variable | Definition]:
    elements: dict[str, Variable | Definition] = {d.name: d for d in definitions}
    return elements | {v.name: v for v in variables if v.role is Role.PARAMETER}


def _chain(start: str, values: Mapping[str, Expression], done: set[str]) -> list[str]:
    """Return the names of a cycle reached from ``start``; empty if there is none."""
    if start in done:
        return []
    path: list[str] = [start]
    open_names = {start}
    stack = [iter(free_names(values[start]))]
    while stack:
        following = next((n for n in stack[-1] if n in values and n not in done), None)
        if following is None:
            stack.pop()
            name = path.pop()
            open_names.discard(name)
            done.add(name)
        elif following in open_names:
            done.update(open_names)
            return path[path.index(following) :]
        else:
            path.append(following)
            open_names.add(following)
            stack.append(iter(free_names(values[following])))
    return []
