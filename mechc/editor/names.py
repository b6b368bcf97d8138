"""What the word at a place of a text means."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from msgspec import Struct

from ..compiler.flat.names.classes import Class
from ..compiler.flat.names.files import LIBRARY
from ..compiler.flat.names.namespace import Namespace
from ..lang import ast
from ..lang.builtins import BUILTINS, Builtin
from ..lang.grammar.keywords import KEYWORDS
from ..lang.source import Span
from .document import Document
from .pieces import code_before, names

_SET = re.compile(r"\bshape[ \t]+(?:model[ \t]+|\w+[ \t]*:[ \t]*)?\Z")
"""What stands before the name of a shape."""


class Word(Struct, frozen=True):
    """A dotted name in a text: its ``parts`` up to the one at the place, and where that one stands, [start, end)."""

    parts: tuple[str, ...]
    start: int
    end: int

    @property
    def name(self) -> str:
        return self.parts[-1]


class Meaning(Struct, frozen=True):
    """What a word stands for: a declaration of a model (``path`` its name in results) or in a function, a definition, a built-in function, a
    keyword. ``place``: where its name is declared, None for what the language has."""

    word: Word
    what: ast.Declaration | ast.Argument | ast.Model | ast.Function | ast.Type | Builtin | str
    place: Span | None = None
    path: str = ""


def word_at(text: str, offset: int) -> Word | None:
    """Find the dotted name around a place; comments and strings hold none."""
    code = code_before(text, offset)
    if code is None:
        return None
    start = max(text.rfind("\n", 0, offset) + 1, code)
    end = text.find("\n", offset)
    for name in names(text[start : end if end >= 0 else len(text)]):
        if name.piece.start <= offset - start <= name.piece.end:
            return Word(name.path, start + name.piece.start, start + name.piece.end)
    return None


def meaning_at(document: Document, offset: int) -> Meaning | None:
    """Say what the word at a place means; None where there is none, or it means nothing."""
    word = word_at(document.text, offset)
    return None if word is None else meaning(document, word, document.model_at(offset))


def meaning(document: Document, word: Word, model: str) -> Meaning | None:
    """Say what a word means inside a model of the document."""
    namespace = document.namespace()
    if not document.broken and word.parts[0] in (known := locals_at(document, word.start)):
        declared, place = known[word.parts[0]]
        return Meaning(word, declared, place)
    cls = document.class_of(model)
    if cls is not None and (component := _modified(document, cls, word)):
        inner = document.type_of(*component)
        return None if inner is None else _declared(document, word, inner)
    if cls is not None and (found := _declared(document, word, cls)):
        return found
    if namespace is not None:
        seen = cls.namespace if cls is not None else namespace
        look_up = seen.look_up_shape if _SET.search(document.text, 0, word.start) else seen.look_up
        defined = look_up(".".join(word.parts), Span(document.source, word.start, word.end))
        if defined is not None:
            return Meaning(word, defined.definition, defined.definition.name_span)
    if len(word.parts) == 1:
        if word.name in BUILTINS:
            return Meaning(word, BUILTINS[word.name])
        if word.name in KEYWORDS:
            return Meaning(word, word.name)
    return None


def _modified(document: Document, cls: Class, word: Word) -> tuple[ast.Declaration, Namespace] | None:
    """Return the component whose member a word names: in ``Bar bar(l = l)`` the first l is that of the bar."""
    component = None if document.broken else document.component_at(cls, word.start)
    for modification in component[0].modifications if component is not None else ():
        if modification.target.span.start <= word.start < modification.target.span.end:
            return component
    return None


def _declared(document: Document, word: Word, cls: Class) -> Meaning | None:
    """Follow the parts of a name through components."""
    here: Class | None = cls
    for k, part in enumerate(word.parts):
        found = None if here is None else document.members(here).get(part)
        if found is None:
            return None
        if k == len(word.parts) - 1:
            return Meaning(word, found[0], found[0].name_span, ".".join(word.parts))
        here = document.type_of(*found)
    return None


def is_library(span: Span) -> bool:
    """Whether a place is in a file of the library, which messages call by its name there."""
    path = Path(span.file.name)
    return path.parts[:1] == (LIBRARY,) and not path.exists()


Local = ast.Argument | ast.Declaration


def function_at(document: Document, offset: int) -> ast.Function | None:
    """Return the function whose text surrounds a place, from the last tree."""
    for _, statement in document.statements():
        if isinstance(statement, ast.Function) and statement.span.start < offset < statement.span.end:
            return statement
    return None


def locals_at(document: Document, offset: int) -> dict[str, tuple[Local, Span]]:
    """Return the names that a place in a function sees, and where each is declared; the last one of a name counts."""
    function = function_at(document, offset)
    if function is None:
        return {}
    found: dict[str, tuple[Local, Span]] = {a.name: (a, _name_of(a)) for a in function.arguments}
    for declaration in _in_steps(function.body):
        if declaration.name_span.start <= offset:
            found[declaration.name] = (declaration, declaration.name_span)
    return found


def _in_steps(body: Iterable[ast.Statement]) -> Iterator[ast.Declaration]:
    for statement in body:
        match statement:
            case ast.Declaration():
                yield statement
            case ast.Unpacked(lets=lets):
                yield from lets
            case ast.For(body=inner):
                yield from _in_steps(inner)
            case ast.If(branches=branches, otherwise=otherwise):
                yield from _in_steps((*(s for b in branches for s in b.body), *otherwise))


def _name_of(argument: ast.Argument) -> Span:
    """Return where the name of an argument stands, after its type and before its sizes."""
    span = argument.span
    start = span.start + (span.text.rfind(argument.name, 0, (span.text.find("[") + 1 or len(span.text) + 1)))
    return Span(span.file, start, start + len(argument.name))
