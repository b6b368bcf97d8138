"""Between the values of this folder and those of the Language Server Protocol: places, edits, messages, entries of lists.

Places of the protocol are lines and columns in units of UTF-16; ours are offsets in characters.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from urllib.parse import unquote, urlparse

from lsprotocol import types as lsp

from ..compiler.flat.names.files import library_folder
from ..lang.diagnostics import Diagnostic, Severity
from ..lang.source import Span
from .completion import Offer
from .document import Document
from .edits import Edit
from .inlays import Inlay
from .lenses import Lens
from .names import is_library
from .outline import Symbol
from .signatures import Signature
from .tokens import KINDS, MODIFIERS, Token

SEVERITY = {
    Severity.ERROR: lsp.DiagnosticSeverity.Error,
    Severity.WARNING: lsp.DiagnosticSeverity.Warning,
    Severity.NOTE: lsp.DiagnosticSeverity.Information,
}
OFFERED = {
    "variable": lsp.CompletionItemKind.Variable,
    "component": lsp.CompletionItemKind.Field,
    "model": lsp.CompletionItemKind.Class,
    "function": lsp.CompletionItemKind.Function,
    "keyword": lsp.CompletionItemKind.Keyword,
    "unit": lsp.CompletionItemKind.Unit,
    "property": lsp.CompletionItemKind.Property,
    "type": lsp.CompletionItemKind.TypeParameter,
}
OUTLINED = {
    "model": lsp.SymbolKind.Class,
    "function": lsp.SymbolKind.Function,
    "type": lsp.SymbolKind.TypeParameter,
    "component": lsp.SymbolKind.Field,
    "parameter": lsp.SymbolKind.Constant,
    "variable": lsp.SymbolKind.Variable,
    "event": lsp.SymbolKind.Event,
}


def path_of(uri: str) -> Path:
    """Return the file of an address; ``untitled.mech`` for what is in no file."""
    parsed = urlparse(uri)
    return Path(unquote(parsed.path)) if parsed.scheme == "file" else Path("untitled.mech")


def offset_of(text: str, position: lsp.Position) -> int:
    """Return the character offset of a line and a column in units of UTF-16; places beyond the text are its ends."""
    start = 0
    for _ in range(position.line):
        end = text.find("\n", start)
        if end < 0:
            return len(text)
        start = end + 1
    units = 0
    end = text.find("\n", start)
    for k in range(start, len(text) if end < 0 else end):
        if units >= position.character:
            return k
        units += 2 if ord(text[k]) > 0xFFFF else 1
    return len(text) if end < 0 else end


def position_of(text: str, offset: int) -> lsp.Position:
    """Return the line and the column of a character offset."""
    start = text.rfind("\n", 0, offset) + 1
    return lsp.Position(text.count("\n", 0, start), _units(text[start:offset]))


def _units(text: str) -> int:
    """Return how many units of UTF-16 a text has."""
    return len(text) + sum(c > "\uffff" for c in text)


def range_of(text: str, start: int, end: int) -> lsp.Range:
    """Return the range from one offset to another."""
    return lsp.Range(position_of(text, start), position_of(text, end))


def edit_of(document: Document, edit: Edit) -> lsp.TextEdit:
    """Return an edit in the words of the protocol."""
    return lsp.TextEdit(range_of(document.text, edit.start, edit.end), edit.text)


def location_of(span: Span) -> lsp.Location:
    """Return where a span is, in the library too."""
    path = Path(span.file.name)
    if is_library(span):
        path = library_folder().joinpath(*path.parts[1:])
    return lsp.Location(path.resolve().as_uri(), range_of(span.file.text, span.start, span.end))


def diagnostic_of(document: Document, found: Diagnostic) -> lsp.Diagnostic:
    """Return a message with its help and its further places."""
    text = document.text
    place = (
        range_of(text, found.span.start, max(found.span.end, found.span.start))
        if found.span
        else range_of(text, 0, 0)
    )
    lines = [
        found.message,
        *([found.caption] if found.caption else []),
        *([f"help: {found.help}"] if found.help else []),
    ]
    related = [
        lsp.DiagnosticRelatedInformation(location_of(label.span), label.text or "see here")
        for label in found.labels
    ]
    return lsp.Diagnostic(
        place,
        "\n".join(lines),
        severity=SEVERITY[found.severity],
        code=found.code,
        source="mechc",
        related_information=related or None,
    )


def item_of(offer: Offer) -> lsp.CompletionItem:
    """Return a completion."""
    return lsp.CompletionItem(
        offer.label,
        kind=OFFERED[offer.kind],
        detail=offer.detail or None,
        documentation=offer.doc or None,
        insert_text=offer.insert or None,
    )


def symbol_of(symbol: Symbol) -> lsp.DocumentSymbol:
    """Return an entry of the outline with what is in it."""
    text = symbol.span.file.text
    return lsp.DocumentSymbol(
        symbol.name,
        OUTLINED[symbol.kind],
        range_of(text, symbol.span.start, symbol.span.end),
        range_of(text, symbol.name_span.start, symbol.name_span.end),
        children=[symbol_of(one) for one in symbol.children],
    )


def signature_of(found: Signature) -> lsp.SignatureHelp:
    """Return what belongs in brackets, the argument at the place marked."""
    arguments = [lsp.ParameterInformation(argument) for argument in found.arguments]
    made = lsp.SignatureInformation(found.label, found.doc or None, arguments, found.active)
    return lsp.SignatureHelp([made], 0, found.active)


def selection_of(text: str, nested: Sequence[tuple[int, int]]) -> lsp.SelectionRange:
    """Return ranges, the smallest first, each with the one around it."""
    made: lsp.SelectionRange | None = None
    for start, end in reversed(nested):
        made = lsp.SelectionRange(range_of(text, start, end), made)
    assert made is not None
    return made


def data_of(text: str, found: Iterable[Token]) -> list[int]:
    """Return names as five numbers each: lines and columns from the one before, length, kind, modifiers."""
    data: list[int] = []
    column = 0
    at, begin = 0, 0  # a place in the text, and where its line begins
    for token in found:
        lines = text.count("\n", at, token.start)
        if lines:
            begin = text.rfind("\n", 0, token.start) + 1
        here = _units(text[begin : token.start])
        data += [lines, here - (0 if lines else column), _units(text[token.start : token.end])]
        data += [KINDS.index(token.kind), sum(1 << MODIFIERS.index(m) for m in token.modifiers)]
        at, column = token.start, here
    return data


def inlay_of(text: str, inlay: Inlay) -> lsp.InlayHint:
    """Return what is shown between the characters of a text."""
    return lsp.InlayHint(
        position_of(text, inlay.offset), inlay.text, lsp.InlayHintKind.Type, tooltip=inlay.about
    )


def lens_of(uri: str, lens: Lens) -> lsp.CodeLens:
    """Return a command above a model; it is given the address of the text and the name of the model."""
    place = range_of(lens.span.file.text, lens.span.start, lens.span.end)
    return lsp.CodeLens(place, lsp.Command(lens.title, f"mechc.{lens.title}", arguments=[uri, lens.model]))
