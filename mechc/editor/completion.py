"""What may be written at a place: names in scope, members after a dot, units after a number, words of statements."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from msgspec import Struct

from ..compiler.flat.names.classes import Class
from ..compiler.flat.names.files import importable
from ..compiler.flat.names.namespace import Namespace
from ..compiler.flat.statements.experiments import OPTIONS
from ..compiler.flat.statements.shapes import SHAPES
from ..lang import ast
from ..lang.builtins import BUILTINS, CONSTANTS
from ..lang.grammar.examples import WORDS
from ..lang.grammar.keywords import DEFINITIONS, EXPRESSIONS, STATEMENTS, STEPS
from ..lang.source import SourceFile, Span
from ..lang.units import NAMED_TYPES, UNIT_NAMES
from .document import Document, class_of, declarations
from .names import function_at, locals_at
from .pieces import code_before

if TYPE_CHECKING:
    from ..runtime.studies.table import Kind

_INDEX = r"(?:\[[^\]\n]*\])?"
_MEMBER = re.compile(rf"((?<![\w.])[A-Za-z_]\w*{_INDEX}(?:\.\w+{_INDEX})*)\.[ \t]*\w*$")
_IMPORTED = re.compile(r"^[ \t]*import[ \t]+(?:\w+[ \t]*=[ \t]*)?([\w.]*)$")
_DRAWN = re.compile(r"\bdraw[ \t]+\w*$")
_SET = re.compile(r"\bshape[ \t]+(?:\w+[ \t]*:[ \t]*)?\w*$")
_ASKED = re.compile(r"\bstudy[ \t]+\w+[ \t]*=[ \t]*\w*$")
_STUDY = re.compile(r"\bstudy[ \t]+\w+[ \t]*=[ \t]*(\w+)[ \t]*\([^()]*(?:\([^()]*\)[^()]*)*$")
_UNIT = re.compile(
    r"(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?[ \t]+(?:[A-Za-z]\w*(?:\^-?\d+)?[./])*[A-Za-z]*$"
)
_BEGIN = re.compile(r"(?:^|[;\n]|\bthen|\bloop|\belse)[ \t]*\w*$")
_INPUT = re.compile(r"\binput(?:[ \t]+[A-Za-z_][\w.]*)?$")
_MODIFIED = re.compile(r"([A-Za-z_][\w.]*)[ \t]+\w+[ \t]*\(([^()]*(?:\([^()]*\)[^()]*)*)$")
_SETTINGS = re.compile(r"\bexperiment\b[ \t]*\w*[ \t]*\([^()]*(?:\([^()]*\)[^()]*)*$")

COMMON_UNITS = (
    *("m", "kg", "s", "rad", "deg", "N", "N.m", "m/s", "rad/s", "m/s^2", "N/m", "N.s/m", "kg.m^2", "J", "W"),
    *("mm", "cm", "km", "ms", "Hz", "K", "A", "V"),
)


class Offer(Struct, frozen=True):
    """One completion. ``kind``: variable, component, model, function, keyword, unit, property, type; ``insert``: what is
    written where that is not the label."""

    label: str
    kind: str
    detail: str = ""
    doc: str = ""
    insert: str = ""


def completions(document: Document, offset: int) -> list[Offer]:
    """Return what may be written at a place; the editor picks what begins like the word that stands there."""
    before = document.text[max(0, document.text.rfind("\n", 0, offset) + 1) : offset]
    so_far = document.text[max(0, offset - 2000) : offset]
    if code_before(document.text, offset) is None:
        return []
    cls = document.class_of(document.model_at(offset))
    namespace = cls.namespace if cls is not None else document.namespace()
    if _UNIT.search(before):
        return [Offer(unit, "unit") for unit in dict.fromkeys((*COMMON_UNITS, *UNIT_NAMES))]
    if match := _IMPORTED.search(before):
        begun = "".join(match[1].rpartition(".")[:2])
        names = [name for name in importable((document.path.parent,)) if name.startswith(begun)]
        return [Offer(name[len(begun) :], "model", insert=f"{name[len(begun) :]}.*;") for name in names]
    if _DRAWN.search(before):
        return [Offer(name, "function", shape.words) for name, shape in SHAPES.items()]
    if _SET.search(before) and namespace is not None:
        return [Offer(name, "model") for name in dict.fromkeys(namespace.shapes())]
    if _ASKED.search(before):
        return [Offer(name, "function", kind.asks, insert=f"{name}(") for name, kind in _studies().items()]
    if match := _MEMBER.search(before):
        parts = [part for part in re.sub(r"\[[^\]]*\]|[ \t]", "", match[1]).split(".") if part]
        return list(_members(document, parts, cls))
    offers: list[Offer] = []
    if _SETTINGS.search(so_far):
        offers += _settings()
    elif (match := _STUDY.search(so_far)) and (kind := _studies().get(match[1])):
        offers += [Offer(name, "property", insert=f"{name} = ") for name in _settings_of(kind)]
    elif (match := _MODIFIED.search(so_far)) and namespace is not None:
        offers += _modifications(match[1], namespace)
        if _INPUT.search(so_far[: match.start()] + match[1]):
            offers += [Offer(name, "property", insert=f"{name} = ") for name in ("interpolation", "filter")]
    function = function_at(document, offset)
    if _BEGIN.search(before) or not before.strip():
        words = STEPS if function is not None else (*STATEMENTS, *DEFINITIONS)
        offers += [Offer(w, "keyword", WORDS[w][1], insert=w) for w in words if w in WORDS]
    for name, (declaration, _) in locals_at(document, offset).items():
        offers.append(Offer(name, "variable", " ".join(declaration.span.text.split())[:80]))
    offers += _names(cls if function is None else None, namespace)
    return list({offer.label: offer for offer in reversed(offers)}.values())[::-1]


def _names(cls: Class | None, namespace: Namespace | None) -> Iterator[Offer]:
    """Yield what an expression or a declaration may begin with."""
    if cls is not None:
        yield from (_offer(declaration) for declaration, _ in declarations(cls))
    if namespace is not None:
        for name in namespace.names():
            yield Offer(name, "model")
    for function in BUILTINS.values():
        yield Offer(function.name, "function", function.doc)
    for name in (*CONSTANTS, *EXPRESSIONS, "world"):
        yield Offer(name, "keyword", WORDS.get(name, ("", ""))[1])
    for name in NAMED_TYPES:
        yield Offer(name, "type")


def _offer(declaration: ast.Declaration) -> Offer:
    kind = "component" if isinstance(declaration, ast.Component) else "variable"
    return Offer(declaration.name, kind, " ".join(declaration.span.text.split())[:80], declaration.doc)


def _members(document: Document, parts: list[str], cls: Class | None) -> Iterator[Offer]:
    """Yield the members of the component that a dotted name stands for."""
    here = cls
    for part in parts:
        found = None if here is None else document.members(here).get(part)
        here = None if found is None else document.type_of(*found)
    if here is not None:
        yield from (_offer(declaration) for declaration, _ in declarations(here))


def _modifications(type_name: str, namespace: Namespace) -> Iterator[Offer]:
    """Yield what a component of some model, or a declaration of a type, may be given."""
    found = namespace.look_up(type_name, Span(SourceFile("", ""), 0, 0))
    if found is not None and isinstance(found.definition, ast.Model):
        inner = class_of(found.definition, found.namespace)
        if inner is not None:
            for declaration, _ in declarations(inner):
                if isinstance(declaration, ast.Parameter | ast.Coordinate | ast.Input | ast.State):
                    offer = _offer(declaration)
                    yield Offer(offer.label, "property", offer.detail, offer.doc, f"{offer.label} = ")
        return
    for name in ("min", "max", "nominal", "display"):
        yield Offer(name, "property", insert=f"{name} = ")


def _studies() -> Mapping[str, Kind]:
    from ..runtime.studies.table import STUDIES  # it brings NumPy, which no other text needs

    return STUDIES


def _settings_of(kind: Kind) -> list[str]:
    from ..runtime.settings import settings_of

    return [s.option for s in settings_of(kind.question()) if not kind.unused(s.name)]


def _settings() -> Iterator[Offer]:
    """Yield the settings of an experiment."""
    for name in OPTIONS:
        yield Offer(name, "property", insert=f"{name} = ")
