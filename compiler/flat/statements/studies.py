"""Studies that a file asks for: their kinds and settings checked by name, their values kept as people write them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mechc.lang import ast
from mechc.suggest import closest

from .. import model
from ..names.instance import Instance
from ..names.scope import Poisoned, Scope

if TYPE_CHECKING:
    from mechc.runtime.settings import QuestionSetting

EXPERIMENT = "experiment"
"""Not a setting of a question, but beside all: which experiment it is about."""


def studies(instance: Instance) -> tuple[model.Study, ...]:
    """Return the studies of the model, those of its bases first."""
    result = []
    for stated in instance.cls.studies.values():
        statement = stated.statement
        assert isinstance(statement, ast.Study)
        scope = Scope(instance.flattening, instance, stated.namespace, level=stated.level)
        try:
            settings = _settings(scope, statement)
        except Poisoned:
            continue
        origin = scope.origin(statement.span)
        result.append(model.Study(statement.name, statement.kind, settings, origin, statement.doc))
    return tuple(result)


def _settings(scope: Scope, statement: ast.Study) -> dict[str, str | bool]:
    # imported where a file asks: they bring NumPy, which no other text needs
    try:
        from mechc.runtime.settings import settings_of
        from mechc.runtime.studies.table import STUDIES
    except ModuleNotFoundError:  # the playground, which answers no study, and holds no NumPy
        return {setting.name: _value(scope, setting, None) for setting in statement.settings}

    kind = STUDIES.get(statement.kind)
    if kind is None:
        near = closest(statement.kind, list(STUDIES))
        raise scope.fail(
            "E0831",
            f"there is no study '{statement.kind}'",
            statement.span,
            help=f"did you mean '{near}'?" if near else f"the kinds are {', '.join(STUDIES)}",
        )
    known = {setting.option: setting for setting in settings_of(kind.question())}
    found: dict[str, str | bool] = {}
    for setting in statement.settings:
        if setting.name not in known and setting.name != EXPERIMENT:
            if unused := kind.unused(setting.name):
                raise scope.fail("E0831", unused, setting.span, help="leave it out")
            near = closest(setting.name, [*known, EXPERIMENT])
            raise scope.fail(
                "E0831",
                f"a study '{statement.kind}' has no setting '{setting.name}'",
                setting.span,
                help=f"did you mean '{near}'?" if near else f"its settings are {', '.join(known)}",
            )
        name = known[setting.name].name if setting.name in known else setting.name
        if name in found:
            raise scope.fail("E0831", f"'{setting.name}' is set twice in one study", setting.span)
        found[name] = _value(scope, setting, known.get(setting.name))
    return found


def _value(scope: Scope, setting: ast.StudySetting, known: QuestionSetting | None) -> str | bool:
    """Return a value as it is written on a command line."""
    value = setting.value
    if setting.within is not None:
        return _range(scope, setting, setting.within)
    match value:
        case ast.String():
            return value.value
        case ast.Boolean():
            return value.value
        case ast.Vector(elements=elements, unit=""):
            return ", ".join(element.span.text for element in elements)
    if known is not None and known.kind == "flag":
        raise scope.fail("E0831", f"'{setting.name}' is true or false", value.span)
    return " ".join(value.span.text.split())


def _range(scope: Scope, setting: ast.StudySetting, within: ast.Expression) -> str:
    """Return ``omega in linspace(a, b, n)`` as ``omega = a .. b, n``."""
    match within:
        case ast.Call(function=ast.Reference(parts=(part,)), arguments=(low, high, *count)) if (
            part.name == "linspace" and len(count) <= 1
        ):
            number = f", {count[0].span.text}" if count else ""
            return f"{setting.value.span.text} = {low.span.text} .. {high.span.text}{number}"
    raise scope.fail(
        "E0831",
        "a study goes over a range",
        within.span,
        help=f"write '{setting.name} = {setting.value.span.text} in linspace(0, 1, 20)', or a text "
        f"'\"{setting.value.span.text} = 0 .. 1, 20\"'",
    )
