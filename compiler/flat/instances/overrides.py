"""Values of structural parameters given from outside: by an experiment, a command or a program."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from itertools import zip_longest

from mechc.lang.diagnostics import Reporter
from mechc.suggest import closest

from ..model import Expression, Kind, Literal, Type
from ..names.instance import Instance, VariableMember
from ..names.scope import Constant

Given = Fraction | int | float | bool | str


def exact(values: Mapping[str, Given]) -> dict[str, Constant]:
    """Return the values as the compiler holds them."""
    return {
        name: value if isinstance(value, bool | str) else Fraction(value) for name, value in values.items()
    }


def overridden(member: VariableMember) -> Expression | None:
    """Return the value given from outside for a structural parameter, if there is one."""
    overrides = member.scope.flattening.overrides
    naming = [name for name in overrides if stands_for(name, member.name)]
    if not naming:
        return None
    value = overrides[max(naming, key=lambda name: name.count("["))]  # an index goes before all components
    assert member.type is not None
    problem = mismatch(value, member.type)
    if problem:
        raise member.scope.fail(
            "E0303",
            f"'{member.name}' cannot be {_text(value)}: {problem}",
            member.declaration.name_span,
            caption="declared here",
        )
    return Literal(type=member.type, span=member.declaration.name_span, value=value)


def stands_for(name: str, member: str) -> bool:
    """Whether a name without some of the indices, as ``arm.n``, stands for ``arm[2].n``, too."""
    if name == member or "[" not in member:
        return name == member
    pairs = zip_longest(name.split("."), member.split("."), fillvalue="")
    return all(part in (full, full.partition("[")[0]) for part, full in pairs)


def mismatch(value: Constant, type: Type) -> str:
    """Say why a value does not fit a type; empty if it does."""
    if type.shape:
        return "it is an array, which cannot be given from outside"
    match type.kind:
        case Kind.BOOLEAN:
            return "" if isinstance(value, bool) else "it is true or false"
        case Kind.STRING:
            return "" if isinstance(value, str) else "it is a text"
        case Kind.INTEGER:
            whole = isinstance(value, Fraction) and value.denominator == 1
            return "" if whole else "it is a whole number"
        case _:
            return "" if isinstance(value, Fraction) else "it is a number"


def _text(value: Constant) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"'{value}'" if isinstance(value, str) else f"{float(value):.10g}"


def check_known(instance: Instance, reporter: Reporter) -> None:
    """Report values given for names that are not structural parameters of the model."""
    known = [n for n, m in instance.members.items() if isinstance(m, VariableMember) and m.structural]
    for name in instance.flattening.overrides:
        if "." in name or name in known:
            continue
        near = closest(name, known)
        reporter.error(
            "E0801",
            f"'{name}' is not a structural parameter of {instance.model.name}",
            instance.model.name_span,
            help=f"did you mean '{near}'?"
            if near
            else f"it has {', '.join(known)}"
            if known
            else "it has no structural parameters",
        )
