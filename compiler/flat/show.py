"""The flat model as text, for reading and for golden files. Numbers are in SI."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import assert_never

from mechc.lang.units import preferred_unit

from .model import (
    Action,
    Apply,
    Array,
    Assertion,
    Assign,
    Definition,
    Derivative,
    Element,
    Experiment,
    Expression,
    FieldDerivative,
    FlatModel,
    Friction,
    Impulse,
    Joint,
    Kind,
    Literal,
    Load,
    Name,
    Previous,
    Quadrature,
    Query,
    Reinit,
    Role,
    Select,
    StartValue,
    Switch,
    Terminate,
    Type,
    Unknown,
    Variable,
    Variation,
    Where,
)
from .subscripts import element_name

_OPERATORS: Mapping[str, tuple[str, int]] = {
    "or": (" or ", 1),
    "and": (" and ", 2),
    "less": (" < ", 4),
    "less_equal": (" <= ", 4),
    "greater": (" > ", 4),
    "greater_equal": (" >= ", 4),
    "equal": (" == ", 4),
    "not_equal": (" <> ", 4),
    "add": (" + ", 5),
    "subtract": (" - ", 5),
    "multiply": ("*", 6),
    "divide": ("/", 6),
    "power": ("^", 8),
}
_ATOM = 9


def show(model: FlatModel) -> str:
    """Return the model as readable text, one element a line, without an end of line."""
    return "\n".join(_lines(model))


def _lines(model: FlatModel) -> Iterable[str]:
    yield f"model {model.name}" + (f' "{model.doc}"' if model.doc else "")
    if model.space:
        yield f"  space {model.space}"
    if model.dimensionless:
        yield "  dimensionless"
    if model.variation is not None:
        yield f"  independent {model.independent} from {text(model.variation.lower)} to {text(model.variation.upper)}"
    elif model.independent != "time":
        yield f"  independent {model.independent}"
    for file in model.files:
        yield f'  file "{file.name}" {file.checksum[:16]}'
    for name, constant in model.structural.items():
        yield f"  structural {name} = {_constant(constant)}"
    for variable in model.variables:
        yield from _variable(variable)
    for definition in model.definitions:
        yield _definition(definition)
    if model.variation is not None:
        yield from _variation(model.variation)
    for energy in model.energies:
        yield f"  {energy.kind} {text(energy.value)}"
    for mass in model.masses:
        field = "" if mass.gravity is None else f" gravity {text(mass.gravity)}"
        yield f"  mass {text(mass.value)} at {text(mass.at)}{field}"
    for inertia in model.inertias:
        yield f"  inertia {text(inertia.value)} on {text(inertia.on)}"
    for load in model.loads:
        yield f"  {_load(load)}"
    for damping in model.dampings:
        yield f"  damping {damping.name}: {text(damping.value)} on {text(damping.on)}"
    for friction in model.frictions:
        yield f"  {_friction(friction)}"
    for constraint in model.constraints:
        word = f"{constraint.asserted} constraint" if constraint.asserted else "constraint"
        sign = ">=" if constraint.asserted == "inequality" else "="
        yield f"  {word} {constraint.name}: {text(constraint.left)} {sign} {text(constraint.right)}"
    for drive in model.drives:
        yield f"  drive {text(drive.target)} = {text(drive.value)}"
    for contact in model.contacts:
        clauses = (
            ("restitution", contact.restitution),
            ("friction", contact.friction),
            ("static", contact.static),
            ("along", contact.along),
        )
        words = "".join(f" {word} {text(e)}" for word, e in clauses if e is not None)
        yield f"  contact {contact.name}: {text(contact.gap)}{words}{_options(contact.options)}"
    for joint in model.joints:
        yield from _joint(joint)
    for initial in model.initials:
        yield f"  initial {text(initial.target)} {_start(initial.start)}"
    for equation in model.equations:
        yield f"  equation der({element_name(equation.state, equation.indices)}) = {text(equation.value)}"
    for unknown in model.unknowns:
        yield f"  unknown {unknown.name} ~ {text(unknown.guess)}"
    for implicit in model.implicit:
        yield f"  equation {text(implicit.left)} = {text(implicit.right)}"
    for event in model.events:
        for k, branch in enumerate(event.branches):
            yield f"  {'elsewhen' if k else 'when'} {text(branch.condition)}"
            for action in branch.actions:
                yield f"    {_action(action)}"
    for assertion in model.assertions:
        yield f'  assert {text(assertion.condition)}, "{assertion.message}"'
    for exact in model.exacts:
        yield f"  exact {text(exact.target)} = {text(exact.value)}"
    for experiment in model.experiments:
        yield from _experiment(experiment)
    for study in model.studies:
        settings = ", ".join(f"{name} = {value}" for name, value in study.settings.items())
        yield f"  study {study.name} = {study.kind}({settings})"


# ---------------------------------------------------------------- elements


def type_text(type: Type) -> str:
    """Return ``m``, ``rad/s [3]``, ``frame``, ``Integer``."""
    if type.kind is Kind.REAL:
        base = preferred_unit(type.dimension, type.angle)
        base = "rad" if type.angle and base == "1" else base
    else:
        base = type.kind.value
    return f"{base} [{', '.join(map(str, type.shape))}]" if type.shape else base


def _friction(friction: Friction) -> str:
    options = _options(friction.options)
    static = "" if friction.static is None else f" static {text(friction.static)}"
    if friction.one_way or friction.backward is not None:
        back = "infinite" if friction.backward is None else text(friction.backward)
        if friction.static is not None:
            held = "infinite" if friction.static_backward is None else text(friction.static_backward)
            static = f" static forward {text(friction.static)} backward {held}"
        limits = f"forward {text(friction.kinetic)} backward {back}"
        return f"friction {friction.name}: {limits}{static} on {text(friction.on)}{options}"
    return f"friction {friction.name}: {text(friction.kinetic)}{static} on {text(friction.on)}{options}"


def _variable(variable: Variable) -> Iterable[str]:
    value = "" if variable.value is None else f" = {text(variable.value)}"
    if variable.start is not None:
        value = f" {_start(variable.start)}"
    doc = f' "{variable.doc}"' if variable.doc else ""
    yield f"  {variable.role.value} {variable.name} : {type_text(variable.type)}{value}{doc}"
    for index, start in variable.starts.items():
        yield f"    {element_name(variable.name, index)} {_start(start)}"
    if variable.rate is not None:
        yield f"    der({variable.name}) {_start(variable.rate)}"
    for index, start in variable.rates.items():
        name = element_name(f"der({variable.name})", index) if _is_rotation(variable) else ""
        yield f"    {name or f'der({element_name(variable.name, index)})'} {_start(start)}"


def _is_rotation(variable: Variable) -> bool:
    return variable.role is Role.COORDINATE and variable.type.kind is Kind.ROTATION


def _start(start: StartValue) -> str:
    return f"{'~' if start.guess else '='} {text(start.value)}"


def _variation(variation: Variation) -> Iterable[str]:
    if variation.unknown:
        yield f"  to be found: {', '.join(variation.unknown)}"
    for end in variation.ends:
        yield f"  {'final' if end.upper else 'initial'} {text(end.target)} = {text(end.value)}"
    if variation.functional is not None:
        yield f"  stationary {text(variation.functional)}"


def _definition(definition: Definition) -> str:
    value = "" if definition.value is None else f" = {text(definition.value)}"
    kind = definition.role.value
    typed = "" if kind in ("frame", "point") else f" : {type_text(definition.type)}"
    doc = f' "{definition.doc}"' if definition.doc else ""
    return f"  {kind} {definition.name}{typed}{value}{doc}"


def _load(load: Load) -> str:
    clauses = (("at", load.at), ("from", load.source), ("in", load.frame))
    words = "".join(f" {word} {text(e)}" for word, e in clauses if e is not None)
    name = f" {load.name}:" if load.name else ""
    return f"{load.kind}{name} {text(load.value)} on {text(load.on)}{words}"


def _joint(joint: Joint) -> Iterable[str]:
    cut = "cut " if joint.cut else ""
    source = f" from {joint.source}" if joint.source else ""
    yield f"  {cut}joint {joint.name}{source} to {joint.target} = {text(joint.value)}"
    if joint.coordinates:
        yield f"    coordinates {', '.join(joint.coordinates)}"
    for closure in joint.closures:
        yield f"    closure {text(closure.left)} = {text(closure.right)}"


def _action(action: Action) -> str:
    match action:
        case Reinit(target=target, value=value):
            return f"reinit({text(target)}, {text(value)})"
        case Assign(target=target, value=value):
            return f"{text(target)} := {text(value)}"
        case Terminate(message=message):
            return f'terminate("{message}")'
        case Impulse(load=load):
            return _load(load)
        case Switch(target=name, engage=engage):
            return f"{'engage' if engage else 'release'} {name}"
        case Assertion(condition=condition, message=message):
            return f'assert {text(condition)}, "{message}"'
        case _:
            assert_never(action)


def _experiment(experiment: Experiment) -> Iterable[str]:
    yield f"  experiment {experiment.name}".rstrip()
    for name, value in experiment.options.items():
        yield f"    {name} = {text(value)}"
    for name, constant in experiment.structural.items():
        yield f"    structural {name} = {_constant(constant)}"
    for setting in experiment.settings:
        name = element_name(setting.target, setting.indices)
        sign = "~" if setting.guess else "="
        yield f"    {f'der({name})' if setting.rate else name} {sign} {text(setting.value)}"
    for sweep in experiment.sweeps:
        word = "structural " if sweep.structural else ""
        name = element_name(sweep.target, sweep.indices)
        name = f"der({name})" if sweep.rate else name
        yield f"    {word}{name} in {{{', '.join(text(v) for v in sweep.values)}}}"


def _options(options: Mapping[str, Expression]) -> str:
    return "".join(f", {name} = {text(value)}" for name, value in options.items())


# ---------------------------------------------------------------- expressions


def text(expression: Expression, above: int = 0) -> str:
    """Return an expression; in parentheses where the operator around it (of rank ``above``) binds tighter."""
    result, rank = _written(expression)
    return f"({result})" if rank < above else result


def _written(expression: Expression) -> tuple[str, int]:
    match expression:
        case Literal(value=value):
            shown = _constant(value)
            return shown, 6 if shown.startswith("-") else 6 if "/" in shown and isinstance(
                value, Fraction
            ) else _ATOM
        case Name(name=name):
            return name, _ATOM
        case Element(base=base, indices=indices):
            return element_name(text(base, _ATOM), indices), _ATOM
        case Derivative(operand=operand, order=order):
            return f"der({text(operand)}{f', {order}' if order > 1 else ''})", _ATOM
        case Previous(operand=operand):
            return f"pre({text(operand)})", _ATOM
        case Array(elements=items):
            return f"{{{', '.join(text(e) for e in items)}}}", _ATOM
        case Select(condition=condition, then=then, otherwise=otherwise):
            return f"if {text(condition)} then {text(then)} else {text(otherwise)}", 0
        case Query(function=function, target=target, arguments=arguments):
            inside = [target, *(text(a) for a in arguments)] if target else [text(a) for a in arguments]
            return f"{function}({', '.join(inside)})", _ATOM
        case Quadrature(variable=variable, lower=lower, upper=upper, body=body):
            return f"integral({text(body)} for {variable} in {text(lower)}:{text(upper)})", _ATOM
        case Unknown(name=name):
            return f"unknown {name}", _ATOM
        case FieldDerivative(operator=operator, variable=variable, place=place, body=body):
            return f"{operator}({text(body)} for {variable} at {text(place)})", _ATOM
        case Where(names=names, values=values, body=body):
            given = (f"{name} = {text(value)}" for name, value in zip(names, values, strict=True))
            return f"({text(body)} where {'; '.join(given)})", _ATOM
        case Apply():
            return _applied(expression)
        case _:
            assert_never(expression)


def _applied(expression: Apply) -> tuple[str, int]:
    function, arguments = expression.function, expression.arguments
    if function == "negate":
        return f"-{text(arguments[0], 6)}", 6
    if function == "not":
        return f"not {text(arguments[0], 4)}", 3
    if function in _OPERATORS:
        sign, rank = _OPERATORS[function]
        left = rank + 1 if function == "power" or rank == 4 else rank
        right = rank if function in ("and", "or") else rank + 1
        return sign.join((text(arguments[0], left), text(arguments[1], right))), rank
    return f"{function}({', '.join(text(a) for a in arguments)})", _ATOM


def _constant(value: Fraction | bool | str) -> str:
    """Return a number in the shortest form that is exact for a double."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if value.denominator == 1 and abs(value.numerator) < 10**15:
        return str(value.numerator)
    shown = repr(float(value))
    exact = Fraction(shown) == value
    small = value.denominator < 1000 and abs(value.numerator) < 1000
    return str(value) if small and not exact else shown
