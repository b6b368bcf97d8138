"""What stands between the brackets at a place: arguments of functions and shapes, what parts are given, settings."""

from __future__ import annotations

from msgspec import Struct

from ..compiler.flat.names.namespace import Namespace
from ..compiler.flat.statements.ensembles import DISTRIBUTIONS
from ..compiler.flat.statements.experiments import OPTIONS
from ..compiler.flat.statements.shapes import SHAPES
from ..lang import ast
from ..lang.builtins import BUILTINS
from ..lang.source import SourceFile, Span
from .document import Document, class_of, declarations
from .hover import arguments_of
from .pieces import Piece, pieces

_GIVEN = ast.Parameter | ast.Coordinate | ast.State | ast.Input | ast.Frame | ast.Point
_OPEN, _CLOSED = "([{", ")]}"


class Signature(Struct, frozen=True):
    """``arguments`` are pieces of ``label``; ``active`` counts the one at the place, None where none is."""

    label: str
    doc: str
    arguments: tuple[str, ...]
    active: int | None


class _Call(Struct, frozen=True):
    """Brackets that are open: the words before them (at most two), and what was written in them so far."""

    words: tuple[str, ...]
    arguments: tuple[tuple[Piece, ...], ...]

    @property
    def name(self) -> str:
        return self.words[-1]


def signature(document: Document, offset: int) -> Signature | None:
    """Say what belongs in the innermost round brackets that are open at a place; None where nobody can know."""
    call = _call(document.text[:offset])
    if call is None or not call.words:
        return None
    for candidate in (_setting, _drawing, _given, _function):
        found = candidate(document, offset, call)
        if found is not None:
            return found
    return None


def _call(text: str) -> _Call | None:
    """Find the round brackets that are open at the end of a text, or none in comments and strings."""
    parts = [piece for piece in pieces(text) if piece.kind not in ("blank", "unit")]
    if parts and (
        parts[-1].text.startswith("//") or (parts[-1].kind == "text" and not _ends(parts[-1].text))
    ):
        return None
    depth = 0
    arguments: list[tuple[Piece, ...]] = []
    current: list[Piece] = []
    for k in range(len(parts) - 1, -1, -1):
        sign = parts[k].text
        if sign in _CLOSED:
            depth += 1
        elif sign in _OPEN and depth:
            depth -= 1
        elif sign == "(":
            inside = (tuple(reversed(current)), *arguments)
            return _Call(_words_before(parts[max(0, k - 12) : k]), inside)
        elif sign in _OPEN:
            arguments, current = [], []  # an array is not a call: what holds it is
            continue
        elif sign == ";" and not depth:
            return None
        elif sign == "," and not depth:
            arguments, current = [tuple(reversed(current)), *arguments], []
            continue
        current.append(parts[k])
    return None


def _words_before(parts: list[Piece]) -> tuple[str, ...]:
    """Return the dotted name that ends some pieces, and the word before it."""
    words: list[str] = []
    for piece in reversed(parts):
        if piece.text == "." and words:
            words[-1] = f".{words[-1]}"
        elif piece.kind == "name" and words and words[-1].startswith("."):
            words[-1] = piece.text + words[-1]
        elif piece.kind == "name" and len(words) < 2:
            words.append(piece.text)
        else:
            break
    return tuple(reversed(words))


def _ends(text: str) -> bool:
    return len(text) > 1 and text.endswith('"')


def _made(head: str, arguments: tuple[str, ...], doc: str, call: _Call) -> Signature:
    """Make a signature; an argument with its name before '=' is that one, another the one of its place."""
    at = call.arguments[-1]
    active: int | None = len(call.arguments) - 1
    names = [argument.split(" = ")[0].split()[-1] if argument else "" for argument in arguments]
    if len(at) > 1 and at[1].text in ("=", "~", "->"):
        active = names.index(at[0].text) if at[0].text in names else None
    elif at and at[0].text in names and len(at) == 1:
        active = names.index(at[0].text)
    if active is not None and active >= len(arguments):
        active = len(arguments) - 1 if arguments and arguments[-1] == "..." else None
    return Signature(f"{head}({', '.join(arguments)})", doc, arguments, active)


def _function(document: Document, offset: int, call: _Call) -> Signature | None:
    if call.name in DISTRIBUTIONS and "experiment" in document.text[max(0, offset - 2000) : offset]:
        return _made(call.name, DISTRIBUTIONS[call.name], "values drawn at random", call)
    if builtin := BUILTINS.get(call.name):
        return _made(call.name, tuple(arguments_of(builtin).split(", ")), builtin.doc, call)
    found = _defined(document, offset, call.name)
    if found is not None and isinstance(found[0], ast.Function):
        arguments = tuple(" ".join(a.span.text.split()) for a in found[0].arguments)
        return _made(call.name, arguments, found[0].doc, call)
    return None


def _given(document: Document, offset: int, call: _Call) -> Signature | None:
    """``Bar bar(``, ``extends Base(``: what a model declares."""
    if len(call.words) < 2:
        return None
    extends = call.words[0] == "extends"
    found = _defined(document, offset, call.words[1 if extends else 0])
    if found is None or not isinstance(found[0], ast.Model):
        return None
    model = class_of(found[0], found[1])
    if model is None:
        return None
    arguments = tuple(_short(d) for d, _ in declarations(model) if isinstance(d, _GIVEN))
    return _made(" ".join(call.words), arguments, found[0].doc, call)


def _short(declaration: ast.Declaration) -> str:
    """Write a declaration as what it can be given: ``l = 1 m``, ``a``."""
    value = getattr(declaration, "value", None)
    start = getattr(declaration, "start", None)
    shown = (
        value.span.text if value is not None else start.span.text.lstrip("=~ ") if start is not None else ""
    )
    return f"{declaration.name} = {' '.join(shown.split())}" if shown else declaration.name


def _setting(document: Document, offset: int, call: _Call) -> Signature | None:
    """``experiment fast(``, ``study small = modes(``."""
    if "experiment" in call.words:
        return _made(" ".join(call.words), OPTIONS, "settings of the run, and values of the model", call)
    line = document.text[document.text.rfind("\n", 0, offset) + 1 : offset].split()
    if line[:1] == ["study"]:
        from ..runtime.settings import settings_of
        from ..runtime.studies.table import STUDIES

        if kind := STUDIES.get(call.name):
            known = [s for s in settings_of(kind.question()) if not kind.unused(s.name)]
            return _made(call.name, tuple(s.name for s in known), kind.asks, call)
    return None


def _drawing(document: Document, offset: int, call: _Call) -> Signature | None:
    """``draw circle(``."""
    shape = SHAPES.get(call.name)
    if shape is None or call.words[0] != "draw":
        return None
    points = ["..."] if shape.points[1] is None else ["point"] * shape.points[1]
    return _made(f"draw {call.name}", (*points, *(a.name for a in shape.arguments)), shape.words, call)


def _defined(document: Document, offset: int, name: str) -> tuple[ast.Statement, Namespace] | None:
    """Look up a model or a function."""
    cls = document.class_of(document.model_at(offset))
    namespace = cls.namespace if cls is not None else document.namespace()
    found = None if namespace is None else namespace.look_up(name, Span(SourceFile("", ""), 0, 0))
    return None if found is None else (found.definition, found.namespace)
