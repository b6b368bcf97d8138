"""Experiments: settings, sweeps and options, checked against the model."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from msgspec import Struct, field
from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.diagnostics import Diagnostic, Label
from mechc.lang.source import Span
from mechc.suggest import closest, setting_meant

from .. import model, types
from ..expressions.coordinates import Target, slice_elements, target_of, whole_rotation
from ..expressions.operators import parameters_without_unit
from ..expressions.references import component_index, existing
from ..instances.declared_types import fit, fits
from ..instances.instantiate import member_of
from ..instances.members import type_of
from ..instances.overrides import stands_for
from ..model import Expression, Kind, Role
from ..names.instance import ROLE_WORDS, ComponentMember, Instance, VariableMember
from ..names.scope import Constant, Poisoned, Scope
from ..values.evaluate import constant, elements, not_structural, setting_changes, values_of
from . import ensembles
from .variables import changing

TIMES = ("stop", "start", "every", "step")
OPTIONS = (*TIMES, "tolerance", "method", "display", "record")
"""Names that an experiment sets for the run itself; no variable of the model may have one of them."""

_TEXT = (types.STRING, "a text")
_MEANINGS = {"tolerance": (types.NUMBER, "a number"), "method": _TEXT, "display": _TEXT}


_OF_SIZES = {"E0305", "E0314"}
"""Codes of values and indices that do not fit the sizes of arrays."""


class _Parts(Struct):
    options: dict[str, Expression] = field(default_factory=dict)
    settings: list[model.Setting] = field(default_factory=list)
    sweeps: list[model.Sweep] = field(default_factory=list)
    structural: dict[str, Constant] = field(default_factory=dict)
    seen: dict[tuple[str, bool], Span] = field(default_factory=dict)
    spreads: list[str] = field(default_factory=list)


def experiments(instance: Instance) -> tuple[model.Experiment, ...]:
    """Return the experiments of the model, those of its bases first."""
    _check_names(instance)
    result = []
    for stated in instance.cls.experiments.values():
        statement = stated.statement
        assert isinstance(statement, ast.Experiment)
        scope = Scope(instance.flattening, instance, stated.namespace, level=stated.level)
        parts = _Parts()
        reporter = instance.flattening.reporter
        unfit: list[tuple[str, Sequence[Diagnostic]]] = []
        for node in statement.settings:
            told = len(reporter.diagnostics)
            try:
                _setting(scope, node, parts)
            except Poisoned:
                if _OF_SIZES.issuperset(d.code for d in reporter.diagnostics[told:]):
                    unfit.append((node.target.span.text, reporter.withdraw(told)))
        if not _of_another_size(instance, parts):
            for diagnostic in (d for _, found in unfit for d in found):
                reporter.add(diagnostic)
            unfit = []
        result.append(
            model.Experiment(
                statement.name,
                parts.options,
                tuple(parts.settings),
                tuple(parts.sweeps),
                parts.structural,
                scope.origin(statement.span),
                statement.doc,
                tuple(target for target, _ in unfit),
            )
        )
    return tuple(result)


def _of_another_size(instance: Instance, parts: _Parts) -> bool:
    """Whether an experiment runs with other structural values than those at hand: it is checked again with its own."""
    swept = [
        (sweep.target, constant(value))
        for sweep in parts.sweeps
        if sweep.structural
        for value in sweep.values
    ]
    return any(
        isinstance(member, VariableMember)
        and isinstance(member.constant, model.Literal)
        and member.constant.value != value
        for given, value in (*parts.structural.items(), *swept)
        for name, member in instance.flattening.variables.items()
        if stands_for(given, name)
    )


def _check_names(instance: Instance) -> None:
    if not instance.cls.experiments:
        return
    for name, member in instance.members.items():
        if name in OPTIONS and isinstance(member, VariableMember):
            member.scope.report(
                "E0805",
                f"'{name}' is also a setting of experiments",
                member.declaration.name_span,
                help=f"choose another name, for example '{name}_'",
            )


def _setting(scope: Scope, node: ast.Modification, parts: _Parts) -> None:
    rate = isinstance(node.target, ast.Derivative)
    reference = node.target.operand if isinstance(node.target, ast.Derivative) else node.target
    if node.kind == "->" or not isinstance(reference, ast.Reference):
        raise scope.fail("E0801", "an experiment sets values", node.span, help="write 'name = value'")
    _check_once(scope, node, parts)
    name = reference.parts[0].name
    assert scope.instance is not None
    if name in ensembles.SETTINGS and member_of(scope.instance, name) is None:
        parts.options[name] = ensembles.setting(scope, name, node)
        return
    if name in OPTIONS and len(reference.parts) == 1 and not rate:
        _option(scope, name, node, parts)
        return
    if member_of(scope.instance, name) is None:
        raise _unknown(scope, name, reference.span)
    structural = _structural_member(scope, reference)
    if structural is not None:
        _structural(scope, *structural, node, parts)
        return
    left = scope.elaborate(node.target)
    if node.kind == "in":
        _sweep(scope, node, left, parts)
        return
    if ensembles.is_spread(node):
        _target(scope, replace(node, kind="="), left)
        parts.spreads.append(ensembles.spread(scope, node, left))
        parts.options[ensembles.VARY] = ensembles.text_of(node, "; ".join(parts.spreads))
        return
    value = scope.elaborate(node.value)
    if (
        node.kind != "~" or scope.flattening.interval is None
    ):  # the guess of a curve differs from place to place
        _check_fixed(scope, node, value)
    for part, part_value in _spread(scope, node, left, value):
        parts.settings.append(_set(scope, node, part, part_value))


def _check_once(scope: Scope, node: ast.Modification, parts: _Parts) -> None:
    key = (node.target.span.text.replace(" ", ""), isinstance(node.target, ast.Derivative))
    first = parts.seen.get(key)
    if first is not None:
        raise scope.fail(
            "E0409",
            f"'{key[0]}' is set twice in one experiment",
            node.span,
            caption="second",
            labels=(Label(first, "first"),),
            help="leave one of them out",
        )
    parts.seen[key] = node.span


def _unknown(scope: Scope, name: str, span: Span) -> Poisoned:
    assert scope.instance is not None
    if scope.instance.cls.broken:
        return Poisoned()
    meant = setting_meant(name)
    near = closest(name, [*scope.instance.members, *OPTIONS])
    return scope.fail(
        "E0801",
        f"there is no '{name}' that an experiment could set",
        span,
        caption="neither a name of the model nor a setting",
        help=f"that is called '{meant}' here"
        if meant
        else f"did you mean '{near}'?"
        if near
        else f"the settings are {', '.join(_settings(scope))}",
    )


def _settings(scope: Scope) -> Sequence[str]:
    """Return the options of an experiment: a curve has no run."""
    return [*OPTIONS] if scope.flattening.interval is None else ["tolerance", "display"]


def _check_fixed(scope: Scope, node: ast.Modification, value: Expression) -> None:
    """Report a value that is not yet known when the settings are computed, before the run begins."""
    culprit = changing(scope.flattening, value)
    if culprit is not None:
        code, message, details = setting_changes(culprit)
        raise scope.fail(code, message, node.value.span, **details)


# ---------------------------------------------------------------- options of the run


def _option(scope: Scope, name: str, node: ast.Modification, parts: _Parts) -> None:
    if name not in _settings(scope):
        raise scope.fail(
            "E0562",
            f"'{name}' belongs to a run in time",
            node.span,
            help="an experiment of a curve sets parameters, guesses, 'tolerance' and 'display'",
        )
    if node.kind != "=":
        raise scope.fail("E0804", f"'{name}' is set by '='", node.span, help=f"write '{name} = ...'")
    if _MEANINGS.get(name, ()) == _TEXT:
        _check_quoted(scope, name, node.value)
    value = scope.elaborate(node.value)
    if name != "record":
        _check_fixed(scope, node, value)
    time = scope.flattening.time_type
    if name in TIMES:
        wanted, words = time, types.unit_words(time.dimension, time.angle)
    elif name in _MEANINGS:
        wanted, words = _MEANINGS[name]
    else:
        wanted, words = types.with_shape(types.numeric(value.type), ()), "one number"
    if value.type.shape or not fits(value, wanted) or wanted.kind not in (Kind.REAL, Kind.STRING):
        given = types.describe(types.numeric(value.type))
        bare = name in TIMES and value.type.dimension.is_none and value.type.kind in types.NUMERIC
        raise scope.fail(
            "E0804",
            f"'{name}' must be {words}",
            node.value.span,
            caption=f"this is {given}",
            labels=(unitless := parameters_without_unit(scope, value)),
            help=_in_seconds(node.value, bool(unitless)) if bare and time.dimension == types.TIME else "",
        )
    parts.options[name] = fit(scope, value, wanted, node.value.span, name=name)


def _check_quoted(scope: Scope, name: str, node: ast.Expression) -> None:
    """Report a word that stands for itself, as it may in studies."""
    if not isinstance(node, ast.Reference) or len(node.parts) != 1 or node.parts[0].indices:
        return
    word = node.parts[0].name
    if scope.instance is not None and member_of(scope.instance, word) is None:
        raise scope.fail(
            "E0804",
            f"'{name}' must be a text",
            node.span,
            caption="this is a name that the model does not have",
            help=f"a text stands in quotes: '{name} = \"{word}\"'",
        )


def _in_seconds(node: ast.Expression, unitless: bool) -> str:
    """Say how a bare number becomes a time: a number gets its unit, a formula a factor, or its parameter a unit."""
    text = node.span.text
    if isinstance(node, ast.Number | ast.Parenthesis):
        return f"write '{text} s'"
    factor = f"multiply by a second: '({text})*(1 s)'"
    return f"give the parameter its unit, or {factor}" if unitless else factor


# ---------------------------------------------------------------- values of the model


def _structural_member(scope: Scope, reference: ast.Reference) -> tuple[VariableMember, str] | None:
    """Return the structural parameter that a setting names, if it names one, and the name, without the indices that
    the setting leaves out: it then stands for that of all components, however many the experiment has."""
    instance = scope.instance
    for part in reference.parts[:-1]:
        member = None if instance is None else member_of(instance, part.name)
        if not isinstance(member, ComponentMember):
            return None
        instances = existing(scope, member, part.span)
        every = member.extents and not part.indices
        first = next(iter(instances.values()), None)
        instance = first if every else instances[component_index(scope, member, part)]
    last = reference.parts[-1]
    member = None if instance is None else member_of(instance, last.name)
    if not isinstance(member, VariableMember) or not member.structural:
        return None
    pairs = zip(member.name.split("."), reference.parts, strict=True)
    return member, ".".join(name if part.indices else name.partition("[")[0] for name, part in pairs)


def _structural(
    scope: Scope, member: VariableMember, name: str, node: ast.Modification, parts: _Parts
) -> None:
    if node.kind == "in":
        values = values_of(scope, node.value)
        for value in values:
            _check_structural(scope, member, node, value)
        parts.sweeps.append(model.Sweep(name, tuple(values), True, scope.origin(node.span)))
        return
    value = scope.elaborate(node.value)
    parts.structural[name] = _check_structural(scope, member, node, value)


def _check_structural(
    scope: Scope, member: VariableMember, node: ast.Modification, value: Expression
) -> Constant:
    name = member.declaration.name
    known = constant(value)
    if known is None:
        raise not_structural(scope, node.value, value, f"the structural parameter '{name}'")
    value = fit(
        scope, value, type_of(member), node.value.span, name=name, declared=member.declaration.name_span
    )
    if isinstance(known, tuple):
        raise scope.fail("E0801", f"'{name}' is an array, which an experiment cannot set", node.target.span)
    return known


def _spread(
    scope: Scope, node: ast.Modification, left: Expression, value: Expression
) -> list[tuple[Expression, Expression]]:
    """Return the single settings of one that sets a slice, such as ``joint.angle = {1, 2} rad``."""
    parts = slice_elements(left)
    if parts is None:
        return [(left, value)]
    if value.type.shape and value.type.shape != left.type.shape:
        value = fit(scope, value, types.numeric(left.type), node.value.span, name=node.target.span.text)
    values = elements(value) if value.type.shape else [value] * len(parts)
    return [
        pair
        for part, part_value in zip(parts, values, strict=True)
        for pair in _spread(scope, node, part, part_value)
    ]


def _target(scope: Scope, node: ast.Modification, left: Expression) -> Target:
    """Return the variable that a setting is about; report what an experiment cannot set."""
    target = target_of(scope, left)
    span = node.target.span
    if target is None and (every := slice_elements(left)):
        raise scope.fail(
            "E0809",
            "a sweep runs over the values of one parameter or initial value",
            span,
            caption=f"these are {len(every)}, one in each component",
            help="give the index of a component, or sweep a parameter of which all of them are made",
        )
    if target is None or target.rate > 1 or (target.rate and target.role is not Role.COORDINATE):
        raise scope.fail(
            "E0802",
            f"'{span.text}' cannot be set by an experiment",
            span,
            help=whole_rotation(left)
            or "parameters, initial values of coordinates and states, and unconnected inputs can be set",
        )
    if node.kind == "~" and target.role not in (Role.COORDINATE, Role.STATE):
        noun = ROLE_WORDS[target.role]
        raise scope.fail(
            "E0403", f"'{span.text}' is {noun}, which is known and not guessed", span, help="write '='"
        )
    return target


def _set(scope: Scope, node: ast.Modification, left: Expression, value: Expression) -> model.Setting:
    target = _target(scope, node, left)
    declared = target.member.declaration.name_span
    value = fit(scope, value, left.type, node.value.span, name=node.target.span.text, declared=declared)
    origin = scope.origin(node.span)
    return model.Setting(target.name, target.indices, target.rate == 1, node.kind == "~", value, origin)


def _sweep(scope: Scope, node: ast.Modification, left: Expression, parts: _Parts) -> None:
    target = _target(scope, node, left)
    if left.type.shape or left.type.kind is Kind.ROTATION:
        raise scope.fail(
            "E0809",
            "a sweep runs over the values of one parameter or initial value",
            node.target.span,
            caption=f"this is {types.describe(left.type)}",
            help=f"give an index, as in '{node.target.span.text}[1] in ...'" if left.type.shape else "",
        )
    declared = target.member.declaration.name_span
    values = [
        fit(scope, v, left.type, node.value.span, name=node.target.span.text, declared=declared)
        for v in values_of(scope, node.value)
    ]
    if not values:
        raise scope.fail("E0809", "a sweep needs at least one value", node.value.span)
    for value in values:
        if not isinstance(constant(value), Fraction):
            raise not_structural(scope, node.value, value, "the values of a sweep")
    origin = scope.origin(node.span)
    parts.sweeps.append(
        model.Sweep(target.name, tuple(values), False, origin, target.indices, target.rate == 1)
    )
