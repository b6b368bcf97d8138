"""The language server: pygls between an editor and the other files of this folder.

Messages about text, names and units come at every change; those of the whole compiler when nothing has changed for a moment.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol
from urllib.parse import unquote, urlparse

from lsprotocol import types as lsp
from pygls.lsp.server import LanguageServer

from .. import __version__
from ..compiler.flat.names.files import LIBRARY, library_folder
from ..lang.diagnostics import Diagnostic, Severity
from ..lang.source import SourceFile, Span
from .completion import Offer, completions
from .document import Document
from .edits import Edit, fixes, formatted, occurrences, renamed
from .hover import hover
from .names import meaning_at
from .outline import Symbol, folds, symbols

IDLE = 0.4
"""Seconds without a change after which the whole compiler is asked."""

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


class Server(LanguageServer):
    """One editor's documents. ``idle``: seconds without a change before the whole compiler is asked."""

    def __init__(self, idle: float = IDLE) -> None:
        super().__init__("mechc", __version__, text_document_sync_kind=lsp.TextDocumentSyncKind.Full)
        self.documents: dict[str, Document] = {}
        self.shown: dict[str, tuple[Diagnostic, ...]] = {}
        self.idle = idle
        self._waiting: dict[str, asyncio.Task[None]] = {}

    def take(self, uri: str, text: str) -> None:
        """Take a text that was opened or changed, and say what is wrong with it."""
        document = self.documents.get(uri)
        if document is None:
            document = self.documents[uri] = Document(_path(uri), text)
        else:
            document.change(text)
        self.show(uri, document.at_once())
        if waiting := self._waiting.pop(uri, None):
            waiting.cancel()
        self._waiting[uri] = asyncio.get_running_loop().create_task(self._later(uri, document.source))

    async def _later(self, uri: str, source: SourceFile) -> None:
        await asyncio.sleep(self.idle)
        document = self.documents.get(uri)
        if document is not None and document.source is source:
            self.show(uri, document.in_full())

    def show(self, uri: str, found: tuple[Diagnostic, ...]) -> None:
        """Send the messages of a document."""
        document = self.documents[uri]
        own = tuple(d for d in found if d.span is None or d.span.file.name == document.source.name)
        self.shown[uri] = own
        self.text_document_publish_diagnostics(
            lsp.PublishDiagnosticsParams(uri, [_diagnostic(document, d) for d in own])
        )

    def close(self, uri: str) -> None:
        """Forget a document."""
        if waiting := self._waiting.pop(uri, None):
            waiting.cancel()
        self.documents.pop(uri, None)
        self.shown.pop(uri, None)


def make_server(idle: float = IDLE) -> Server:
    """Make a server with all that it can do."""
    server = Server(idle)

    @server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)
    async def opened(params: lsp.DidOpenTextDocumentParams) -> None:
        server.take(params.text_document.uri, params.text_document.text)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
    async def changed(params: lsp.DidChangeTextDocumentParams) -> None:
        server.take(params.text_document.uri, params.content_changes[-1].text)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: lsp.DidCloseTextDocumentParams) -> None:
        server.close(params.text_document.uri)

    @server.feature(lsp.TEXT_DOCUMENT_HOVER)
    def hovered(params: lsp.HoverParams) -> lsp.Hover | None:
        document, offset = _place(server, params)
        found = hover(document, offset)
        if found is None:
            return None
        text, start, end = found
        return lsp.Hover(lsp.MarkupContent(lsp.MarkupKind.Markdown, text), _range(document.text, start, end))

    @server.feature(lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=[".", "(", " "]))
    def completed(params: lsp.CompletionParams) -> lsp.CompletionList:
        return lsp.CompletionList(False, [_item(offer) for offer in completions(*_place(server, params))])

    @server.feature(lsp.TEXT_DOCUMENT_DEFINITION)
    def defined(params: lsp.DefinitionParams) -> lsp.Location | None:
        found = meaning_at(*_place(server, params))
        return None if found is None or found.place is None else _location(found.place)

    @server.feature(lsp.TEXT_DOCUMENT_REFERENCES)
    def referred(params: lsp.ReferenceParams) -> list[lsp.Location]:
        document, offset = _place(server, params)
        uri = params.text_document.uri
        return [lsp.Location(uri, _range(document.text, *place)) for place in occurrences(document, offset)]

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def highlighted(params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        document, offset = _place(server, params)
        return [
            lsp.DocumentHighlight(_range(document.text, *place)) for place in occurrences(document, offset)
        ]

    @server.feature(lsp.TEXT_DOCUMENT_RENAME)
    def rename(params: lsp.RenameParams) -> lsp.WorkspaceEdit | None:
        document, offset = _place(server, params)
        edits = renamed(document, offset, params.new_name)
        if not edits:
            return None
        return lsp.WorkspaceEdit(changes={params.text_document.uri: [_edit(document, e) for e in edits]})

    @server.feature(lsp.TEXT_DOCUMENT_FORMATTING)
    def format_text(params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
        document = server.documents[params.text_document.uri]
        edit = formatted(document)
        return [] if edit is None else [_edit(document, edit)]

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def outline(params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        document = server.documents[params.text_document.uri]
        return [_symbol(s) for s in symbols(document)]

    @server.feature(lsp.TEXT_DOCUMENT_FOLDING_RANGE)
    def folded(params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
        document = server.documents[params.text_document.uri]
        return [lsp.FoldingRange(first - 1, last - 1) for first, last in folds(document)]

    @server.feature(
        lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions(code_action_kinds=[lsp.CodeActionKind.QuickFix])
    )
    def proposed(params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        uri = params.text_document.uri
        document = server.documents[uri]
        first, last = (_offset(document.text, place) for place in (params.range.start, params.range.end))
        return [
            lsp.CodeAction(
                fix.title,
                kind=lsp.CodeActionKind.QuickFix,
                diagnostics=[_diagnostic(document, diagnostic)],
                edit=lsp.WorkspaceEdit(changes={uri: [_edit(document, e) for e in fix.edits]}),
            )
            for diagnostic in server.shown.get(uri, ())
            if diagnostic.span is not None and diagnostic.span.start <= last and diagnostic.span.end >= first
            for fix in fixes(document, diagnostic)
        ]

    return server


# ---------------------------------------------------------------- between offsets and places of the protocol


def _path(uri: str) -> Path:
    parsed = urlparse(uri)
    return Path(unquote(parsed.path)) if parsed.scheme == "file" else Path("untitled.mech")


class _At(Protocol):
    """Parameters of the protocol that name a document and a place in it."""

    text_document: lsp.TextDocumentIdentifier
    position: lsp.Position


def _place(server: Server, params: _At) -> tuple[Document, int]:
    document = server.documents[params.text_document.uri]
    return document, _offset(document.text, params.position)


def _offset(text: str, position: lsp.Position) -> int:
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


def _position(text: str, offset: int) -> lsp.Position:
    start = text.rfind("\n", 0, offset) + 1
    line = text.count("\n", 0, start)
    return lsp.Position(line, sum(2 if ord(c) > 0xFFFF else 1 for c in text[start:offset]))


def _range(text: str, start: int, end: int) -> lsp.Range:
    return lsp.Range(_position(text, start), _position(text, end))


def _edit(document: Document, edit: Edit) -> lsp.TextEdit:
    return lsp.TextEdit(_range(document.text, edit.start, edit.end), edit.text)


def _location(span: Span) -> lsp.Location:
    path = Path(span.file.name)
    if path.parts[:1] == (LIBRARY,) and not path.exists():  # as messages call the files of the library
        path = library_folder().joinpath(*path.parts[1:])
    return lsp.Location(path.resolve().as_uri(), _range(span.file.text, span.start, span.end))


def _diagnostic(document: Document, found: Diagnostic) -> lsp.Diagnostic:
    text = document.text
    place = (
        _range(text, found.span.start, max(found.span.end, found.span.start))
        if found.span
        else _range(text, 0, 0)
    )
    lines = [
        found.message,
        *([found.caption] if found.caption else []),
        *([f"help: {found.help}"] if found.help else []),
    ]
    related = [
        lsp.DiagnosticRelatedInformation(_location(label.span), label.text or "see here")
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


def _item(offer: Offer) -> lsp.CompletionItem:
    return lsp.CompletionItem(
        offer.label,
        kind=OFFERED[offer.kind],
        detail=offer.detail or None,
        documentation=offer.doc or None,
        insert_text=offer.insert or None,
    )


def _symbol(symbol: Symbol) -> lsp.DocumentSymbol:
    text = symbol.span.file.text
    return lsp.DocumentSymbol(
        symbol.name,
        OUTLINED[symbol.kind],
        _range(text, symbol.span.start, symbol.span.end),
        _range(text, symbol.name_span.start, symbol.name_span.end),
        children=_children(symbol.children),
    )


def _children(inner: Sequence[Symbol]) -> list[lsp.DocumentSymbol]:
    return [_symbol(one) for one in inner]
