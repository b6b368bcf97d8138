"""What is shown about the word under the pointer, as Markdown."""

from __future__ import annotations

from collections.abc import Mapping

from ..compiler.flat import types
from ..compiler.flat.model import FlatModel, Type
from ..lang import ast
from ..lang.builtins import Builtin
from ..lang.grammar.examples import WORDS
from ..lang.printing.layout import flat
from ..lang.printing.statements import function_head
from .document import Document
from .names import Meaning, meaning_at


def hover(document: Document, offset: int) -> tuple[str, int, int] | None:
    """Return Markdown and the range [start, end) that it is about; None where nothing is known."""
    found = meaning_at(document, offset)
    if found is None:
        return None
    return _text(document, found, document.model_at(offset)), found.word.start, found.word.end


def _text(document: Document, found: Meaning, model: str) -> str:
    match found.what:
        case str(word):
            written, means = WORDS.get(word, (word, ""))
            return _code(written) + (f"\n\n{means}" if means else "")
        case Builtin() as function:
            return f"{_code(f'{function.name}({arguments_of(function)})')}\n\n{function.doc}"
        case ast.Model() as defined:
            head = f"{'partial ' if defined.partial else ''}{'shape ' if defined.shape else ''}model {defined.name}"
            return _joined(_code(head), defined.doc, _interface(defined))
        case ast.Function(value=None) as defined:
            return _joined(_code(flat(function_head(defined))), defined.doc)
        case ast.Function() | ast.Type() as defined:
            return _joined(_code(defined.span.text.strip()), defined.doc)
        case ast.Argument() as argument:
            return _joined(_code(" ".join(argument.span.text.split())), "argument")
        case declaration:
            return _declared(document, declaration, found.path, model)


def _declared(document: Document, declaration: ast.Declaration, path: str, model: str) -> str:
    kind = type(declaration).__name__.lower()
    lines = [_code(" ".join(declaration.span.text.split()))]
    if isinstance(declaration, ast.Component):
        kind = f"component of {declaration.type}"
    typed = document.flat_of(model)
    known = type_in(typed, path) if typed is not None else None
    if known is not None:
        kind += f": {types.describe(known)}"
    return _joined(lines[0], kind, declaration.doc)


def type_in(flat: FlatModel, path: str) -> Type | None:
    """Return the type of a variable, output, let or place of a flat model by its name in results."""
    return types_in(flat).get(path)


def types_in(flat: FlatModel) -> Mapping[str, Type]:
    """Return the types of all variables, outputs, lets and places by their names in results, with and without indices."""
    found: dict[str, Type] = {}
    typed = [(v.name, v.type) for v in flat.variables] + [(d.name, d.type) for d in flat.definitions]
    for name, type in typed:
        found.setdefault(name, type)
        found.setdefault(_plain(name), type)
    return found


def _plain(name: str) -> str:
    """Return a name without indices: ``bars[2].m`` is ``bars.m``."""
    text, depth = "", 0
    for c in name:
        depth += (c == "[") - (c == "]")
        if depth == 0 and c != "]":
            text += c
    return text


def arguments_of(function: Builtin) -> str:
    """Write how many arguments a function takes: ``x, y``."""
    names = ["x", "y", "z", "u", "v", "w"]
    if function.most is None:
        return "x, ..."
    return ", ".join(names[: function.most]) if function.most <= len(names) else "..."


def _interface(model: ast.Model) -> str:
    """List the parameters of a model with their defaults."""
    rows = [" ".join(s.span.text.split()) for s in model.body if isinstance(s, ast.Parameter)]
    return _code("\n".join(rows)) if rows else ""


def _code(text: str) -> str:
    return f"```mech\n{text}\n```"


def _joined(*parts: str) -> str:
    return "\n\n".join(part for part in parts if part)
