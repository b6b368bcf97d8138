"""Single statements to documents; blocks are put together in ``printer.py``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import assert_never

from .. import ast
from .expressions import document, indices, quote, reference
from .layout import Bracketed, Clauses, Doc, Unbroken, flat

Simple = (
    ast.Import | ast.Extends | ast.Parameter | ast.Coordinate | ast.State | ast.Discrete | ast.Input
    | ast.Output | ast.Let | ast.Unpacked | ast.Var | ast.Return | ast.Frame | ast.Point | ast.Component | ast.Energy | ast.Gravity | ast.Mass
    | ast.Inertia | ast.Load | ast.Damping | ast.Friction | ast.Constraint | ast.Inequality | ast.Drive
    | ast.Contact | ast.ContactOfShapes | ast.Shape | ast.Place | ast.Closure | ast.Initial | ast.StationaryStart | ast.Final | ast.Equation | ast.Exact | ast.Assert
    | ast.Experiment | ast.Study | ast.Dimensionless | ast.Independent | ast.Stationary | ast.Reinit | ast.Assign
    | ast.Draw | ast.Terminate | ast.Impulse | ast.Release | ast.Engage | ast.Function | ast.Type
)  # fmt: skip
"""Statements that end with their own semicolon and hold no others."""


def statement_document(s: Simple) -> Doc:
    """Return a statement without blocks, with its doc string and semicolon."""
    parts = _clauses(s)
    if s.doc:
        parts.append(quote(s.doc))
    return Clauses((*parts[:-1], Unbroken((parts[-1], ";"))))


def dimensions(values: Sequence[ast.Dimension]) -> str:
    """Return ``[n, i in 1:3]``, or nothing."""
    if not values:
        return ""
    items = (f"{d.name} in {flat(document(d.size))}" if d.name else flat(document(d.size)) for d in values)
    return "[" + ", ".join(items) + "]"


def _clauses(s: Simple) -> list[Doc]:
    match s:
        case ast.Import():
            return [_import(s)]
        case ast.Extends():
            return [Unbroken((f"extends {s.base}", _modifications(s.modifications)))]
        case ast.Parameter(found=True, value=value) if value is not None:
            return _started("parameter", s, ast.Start(value=value, guess=True, span=value.span))
        case ast.Parameter():
            return _declared("structural parameter" if s.structural else "parameter", s, s.value)
        case ast.Coordinate():
            return _started("coordinate", s, s.start)
        case ast.State():
            return _started("state", s, s.start)
        case ast.Discrete():
            return _declared("discrete", s, s.value)
        case ast.Input():
            return _declared("input", s, s.value)
        case ast.Output(guess=True, value=value) if value is not None:
            return _started("output", s, ast.Start(value=value, guess=True, span=value.span))
        case ast.Output():
            return _declared("output", s, s.value)
        case ast.Let():
            return _declared("let", s, s.value)
        case ast.Unpacked():
            return [Bracketed("let (", tuple(x.name for x in s.lets), ")"), *_clause("=", s.value)]
        case ast.Var():
            return _declared("var", s, s.value)
        case ast.Return(values=(value,)):
            return _clause("return", value)
        case ast.Return():
            return [Bracketed("return (", tuple(document(x) for x in s.values), ")")]
        case ast.Frame():
            return _declared("frame", s, s.value)
        case ast.Point():
            return _declared("point", s, s.value)
        case ast.Component():
            head = f"{'cut ' if s.cut else ''}{s.type} {s.name}{dimensions(s.dimensions)}"
            parts: list[Doc] = [Unbroken((head, _modifications(s.modifications)))]
            return parts + _clause("if", s.condition)
        case ast.Energy() | ast.Gravity() | ast.Stationary():
            word = s.kind if isinstance(s, ast.Energy) else type(s).__name__.casefold()
            return _clause(word, s.value)
        case ast.Mass():
            return _clause("mass", s.value) + _clause("at", s.at)
        case ast.Inertia():
            return _clause("inertia", s.value) + _clause("on", s.on)
        case ast.Load():
            return _labelled(s.kind, s.label, s.value) + _receivers(s)
        case ast.Impulse():
            return _clause("impulse", s.value) + _receivers(s)
        case ast.Damping():
            return _labelled("damping", s.label, s.value) + _clause("on", s.on)
        case ast.Friction(backward=backward) if backward is not None:
            head = "friction"
            if s.label is not None:
                head += f" {s.label.name}{flat(indices(s.label.indices)) if s.label.indices else ''}:"
            clauses = [head, *_clause("forward", s.kinetic), *_clause("backward", backward)]
            if s.static is not None:
                assert s.static_backward is not None
                clauses += ["static", *_clause("forward", s.static), *_clause("backward", s.static_backward)]
            return _with_options(clauses + _clause("on", s.on), s.options)
        case ast.Friction():
            clauses = _labelled("friction", s.label, s.kinetic) + _clause("static", s.static)
            return _with_options(clauses + _clause("on", s.on), s.options)
        case ast.Constraint():
            word = f"{s.kind} constraint" if s.kind else "constraint"
            clauses = [*_labelled(word, s.label, s.left), *_clause("=", s.right)]
            if s.by is not None:
                clauses += ["by"] if s.by.kind == "input" else ["by", s.by.kind, "on"]
                clauses.append(document(s.by.on))
            return clauses
        case ast.Inequality():
            return _labelled("constraint", s.label, s.condition)
        case ast.Contact():
            clauses = _labelled("contact", s.label, s.gap) + _clause("restitution", s.restitution)
            clauses += _clause("friction", s.friction) + _clause("static", s.static)
            return _with_options(clauses + _clause("along", s.along), s.options)
        case ast.ContactOfShapes():
            clauses = _labelled("contact", s.label, s.of)
            clauses.append(Bracketed("with ", tuple(document(o) for o in s.others), ""))
            clauses += _clause("friction", s.friction) + _clause("restitution", s.restitution)
            return _with_options(clauses, s.options)
        case ast.Shape():
            set_on = _clause("on", s.on) + _clause("at", s.at)
            return [Unbroken((_named("shape", s.label) + s.type, _modifications(s.modifications))), *set_on]
        case ast.Drive():
            return _clause("drive", s.target) + _clause("=", s.value)
        case ast.Place():
            return _clause("place", s.target) + _clause("=", s.value)
        case ast.Closure() | ast.Equation() | ast.Exact():
            return _clause(type(s).__name__.casefold(), s.left) + _clause("=", s.right)
        case ast.Initial() | ast.Final():
            return _clause(type(s).__name__.casefold(), s.target) + _start(s.start)
        case ast.StationaryStart(targets=()):
            return ["initial stationary"]
        case ast.StationaryStart():
            return ["initial stationary", ", ".join(flat(document(t)) for t in s.targets)]
        case ast.Assert():
            return [Unbroken((*_pair("assert", s.condition), ",")), quote(s.message)]
        case ast.Experiment():
            name = f"experiment {s.name}" if s.name else "experiment"
            return [Unbroken((name, _modifications(s.settings) if s.settings else "()"))]
        case ast.Study():
            items = tuple(_study_setting(one) for one in s.settings)
            return [f"study {s.name}", Bracketed(f"= {s.kind}(", items, ")") if items else f"= {s.kind}()"]
        case ast.Dimensionless():
            return ["dimensionless"]
        case ast.Independent():
            name = f"independent {s.type} {s.name}" if s.type else f"independent {s.name}"
            return [name, *_clause("from", s.lower), *_clause("to", s.upper)]
        case ast.Draw():
            return _with_options([_shape(s), *_clause("on", s.on), *_clause("at", s.at)], s.options)
        case ast.Reinit():
            return [Bracketed("reinit(", (document(s.target), document(s.value)), ")")]
        case ast.Assign():
            return [reference(s.target), *_clause(":=", s.value)]
        case ast.Terminate():
            return [f"terminate({quote(s.message)})"]
        case ast.Release() | ast.Engage():
            return _clause(type(s).__name__.casefold(), s.target)
        case ast.Function():
            return [function_head(s), *_clause("=", s.value)]
        case ast.Type():
            return [f"type {s.name} = unit {quote(s.unit)}"]
        case _:
            assert_never(s)


def _pair(word: str, value: ast.Expression) -> tuple[Doc, Doc]:
    return f"{word} ", document(value)


def _clause(word: str, value: ast.Expression | None) -> list[Doc]:
    return [] if value is None else [Unbroken(_pair(word, value))]


def _labelled(word: str, label: ast.LabelName | None, value: ast.Expression) -> list[Doc]:
    return [Unbroken((_named(word, label), document(value)))]


def _named(word: str, label: ast.LabelName | None) -> str:
    """Return the word of a statement with its name, ready for what follows."""
    if label is None:
        return f"{word} "
    return f"{word} {label.name}{flat(indices(label.indices)) if label.indices else ''}: "


def _receivers(s: ast.Load | ast.Impulse) -> list[Doc]:
    return _clause("on", s.on) + _clause("at", s.at) + _clause("from", s.source) + _clause("in", s.frame)


def _with_options(clauses: list[Doc], options: Sequence[ast.Option]) -> list[Doc]:
    """Put the commas of the options after the clauses before them."""
    for option in options:
        clauses[-1] = Unbroken((clauses[-1], ","))
        clauses.append(Unbroken((f"{option.name} = ", document(option.value))))
    return clauses


def _start(start: ast.Start | None) -> list[Doc]:
    return [] if start is None else _clause("~" if start.guess else "=", start.value)


def _head(word: str, s: ast.Declaration) -> Doc:
    kind = f"{s.type} " if s.type else ""
    if s.like is not None:
        kind = f"typeof({flat(document(s.like))}) "
    attributes = _modifications(s.attributes)
    return Unbroken((f"{word} {kind}{s.name}{dimensions(s.dimensions)}", attributes))


def _declared(word: str, s: ast.Declaration, value: ast.Expression | None) -> list[Doc]:
    return [_head(word, s), *_clause("=", value)]


def _started(word: str, s: ast.Declaration, start: ast.Start | None) -> list[Doc]:
    return [_head(word, s), *_start(start)]


def _study_setting(one: ast.StudySetting) -> Doc:
    parts: list[Doc] = [f"{one.name} = ", document(one.value)]
    return Unbroken((*parts, " in ", document(one.within)) if one.within is not None else tuple(parts))


def _modifications(values: Sequence[ast.Modification]) -> Doc:
    if not values:
        return ""
    items = (Unbroken((document(m.target), f" {m.kind} ", document(m.value))) for m in values)
    return Bracketed("(", tuple(items), ")")


def _shape(s: ast.Draw) -> Doc:
    items: list[Doc] = [document(a) for a in s.arguments]
    items += [Unbroken((f"{k.name} = ", document(k.value))) for k in s.keywords]
    items += [Unbroken((f"{g.name} in ", document(g.range))) for g in s.samples]
    if not items:
        return f"draw {s.shape}" if s.shape == "none" else f"draw {s.shape}()"
    return Bracketed(f"draw {s.shape}(", tuple(items), ")")


def _import(s: ast.Import) -> str:
    if s.alias:
        return f"import {s.alias} = {s.path}"
    if s.names == ("*",):
        return f"import {s.path}.*"
    return f"import {s.path}" + (f".{{{', '.join(s.names)}}}" if s.names else "")


def function_head(s: ast.Function) -> Doc:
    """Return a function up to its value or its body: ``function f(Length x) -> Force``."""
    result = f" -> {s.result}{dimensions(s.result_dimensions)}" if s.result else ""
    if s.results:
        result = f" -> ({', '.join(_argument(a) for a in s.results)})"
    return Bracketed(f"function {s.name}(", tuple(_argument(a) for a in s.arguments), ")", result)


def _argument(a: ast.Argument) -> str:
    return f"{f'{a.type} ' if a.type else ''}{a.name}{dimensions(a.dimensions)}"
