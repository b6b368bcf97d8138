"""The language server: pygls between an editor and the other files of this folder.

Messages about text, names and units come at every change; those of the whole compiler when nothing has changed for a moment.
"""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import Protocol

from lsprotocol import types as lsp
from pygls.lsp.server import LanguageServer

from .. import __version__
from ..lang.diagnostics import Diagnostic
from ..lang.source import SourceFile
from .completion import completions
from .document import Document
from .edits import fixes, formatted, occurrences, renamed
from .folders import documents
from .hover import hover
from .inlays import inlays
from .lenses import lenses
from .names import meaning_at
from .outline import folds, symbols
from .protocol import (
    data_of,
    diagnostic_of,
    edit_of,
    inlay_of,
    item_of,
    lens_of,
    location_of,
    offset_of,
    path_of,
    range_of,
    selection_of,
    signature_of,
    symbol_of,
)
from .selections import around
from .signatures import signature
from .tokens import KINDS, MODIFIERS, tokens

IDLE = 0.4
"""Seconds without a change after which the whole compiler is asked."""


class Server(LanguageServer):
    """One editor's documents. ``idle``: seconds without a change before the whole compiler is asked."""

    def __init__(self, idle: float = IDLE) -> None:
        super().__init__("mechc", __version__, text_document_sync_kind=lsp.TextDocumentSyncKind.Full)
        self.documents: dict[str, Document] = {}
        self.shown: dict[str, tuple[Diagnostic, ...]] = {}
        self.idle = idle
        self._waiting: dict[str, asyncio.Task[None]] = {}
        self._around: asyncio.Task[None] | None = None

    def take(self, uri: str, text: str) -> None:
        """Take a text that was opened or changed, and say what is wrong with it."""
        document = self.documents.get(uri)
        if document is None:
            document = self.documents[uri] = Document(path_of(uri), text)
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
        self.shown[uri] = own_of(document, found)
        self._publish(uri, document, self.shown[uri])

    def close(self, uri: str) -> None:
        """Forget a document."""
        if waiting := self._waiting.pop(uri, None):
            waiting.cancel()
        self.documents.pop(uri, None)
        self.shown.pop(uri, None)

    # ------------------------------------------------------------ the folders that the editor works in

    def folders(self) -> list[Path]:
        """Return the folders that the editor works in."""
        return [path_of(uri) for uri in self.workspace.folders]

    def holding(self, word: str) -> Iterator[Document]:
        """Yield the texts that hold a word: the open ones, and those of the folders."""
        return documents(self.documents.values(), self.folders(), lambda _, text: word in text)

    def uri_of(self, document: Document) -> str:
        """Return the address of a text, as the editor calls it where it is open."""
        opened = (uri for uri, one in self.documents.items() if one is document)
        return next(opened, document.path.resolve().as_uri())

    def look_around(self, changed: Collection[Path] = ()) -> None:
        """Begin to say what is wrong with the files that are not open: with all, or with those that a change may concern."""
        if self._around is not None and not self._around.done():
            self._around.cancel()
            changed = ()  # what was begun has to be finished, too
        self._around = asyncio.get_running_loop().create_task(self._look_around(changed))

    async def _look_around(self, changed: Collection[Path]) -> None:
        def concerned(path: Path, text: str) -> bool:
            return not changed or path in changed or any(other.stem in text for other in changed)

        for document in documents((), self.folders(), concerned):
            await asyncio.sleep(0)  # an editor that asks comes first
            uri = document.path.resolve().as_uri()
            if uri not in self.documents:
                self._publish(uri, document, own_of(document, document.at_once()))

    def _publish(self, uri: str, document: Document, found: Iterable[Diagnostic]) -> None:
        self.text_document_publish_diagnostics(
            lsp.PublishDiagnosticsParams(uri, [diagnostic_of(document, d) for d in found])
        )


def own_of(document: Document, found: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Return those messages that are about this text, and not about one that it imports."""
    return tuple(d for d in found if d.span is None or d.span.file.name == document.source.name)


def make_server(idle: float = IDLE) -> Server:
    """Make a server with all that it can do."""
    server = Server(idle)
    _keep_texts(server)
    _tell_meanings(server)
    _show_structure(server)
    _change_texts(server)
    return server


def _keep_texts(server: Server) -> None:
    """Follow what is opened, written and closed."""

    @server.feature(lsp.INITIALIZED)
    async def began(_: lsp.InitializedParams) -> None:
        server.look_around()

    @server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)
    async def opened(params: lsp.DidOpenTextDocumentParams) -> None:
        server.take(params.text_document.uri, params.text_document.text)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
    async def changed(params: lsp.DidChangeTextDocumentParams) -> None:
        server.take(params.text_document.uri, params.content_changes[-1].text)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: lsp.DidCloseTextDocumentParams) -> None:
        server.close(params.text_document.uri)

    @server.feature(lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    async def changed_outside(params: lsp.DidChangeWatchedFilesParams) -> None:
        server.look_around([path_of(change.uri) for change in params.changes])


def _tell_meanings(server: Server) -> None:
    """Say what words mean, what may be written, and where things are declared and used."""

    @server.feature(lsp.TEXT_DOCUMENT_HOVER)
    def hovered(params: lsp.HoverParams) -> lsp.Hover | None:
        document, offset = _place(server, params)
        found = hover(document, offset)
        if found is None:
            return None
        text, start, end = found
        return lsp.Hover(
            lsp.MarkupContent(lsp.MarkupKind.Markdown, text), range_of(document.text, start, end)
        )

    @server.feature(lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=[".", "(", " "]))
    def completed(params: lsp.CompletionParams) -> lsp.CompletionList:
        return lsp.CompletionList(False, [item_of(offer) for offer in completions(*_place(server, params))])

    @server.feature(lsp.TEXT_DOCUMENT_SIGNATURE_HELP, lsp.SignatureHelpOptions(trigger_characters=["(", ","]))
    def signed(params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
        found = signature(*_place(server, params))
        return None if found is None else signature_of(found)

    @server.feature(lsp.TEXT_DOCUMENT_DEFINITION)
    def defined(params: lsp.DefinitionParams) -> lsp.Location | None:
        found = meaning_at(*_place(server, params))
        return None if found is None or found.place is None else location_of(found.place)

    @server.feature(lsp.TEXT_DOCUMENT_REFERENCES)
    def referred(params: lsp.ReferenceParams) -> list[lsp.Location]:
        found = meaning_at(*_place(server, params))
        if found is None or found.place is None:
            return []
        place = found.place
        return [
            lsp.Location(server.uri_of(document), range_of(document.text, *where))
            for document in server.holding(place.text)
            for where in occurrences(document, place)
        ]

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def highlighted(params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        document, offset = _place(server, params)
        found = meaning_at(document, offset)
        if found is None or found.place is None:
            return []
        places = occurrences(document, found.place)
        return [lsp.DocumentHighlight(range_of(document.text, *place)) for place in places]


def _show_structure(server: Server) -> None:
    """Show what a text consists of, what it does not say, and what can be done with it."""

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def outline(params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        document = server.documents[params.text_document.uri]
        return [symbol_of(s) for s in symbols(document)]

    @server.feature(lsp.TEXT_DOCUMENT_FOLDING_RANGE)
    def folded(params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
        document = server.documents[params.text_document.uri]
        return [lsp.FoldingRange(first - 1, last - 1) for first, last in folds(document)]

    @server.feature(lsp.TEXT_DOCUMENT_SELECTION_RANGE)
    def selected(params: lsp.SelectionRangeParams) -> list[lsp.SelectionRange]:
        document = server.documents[params.text_document.uri]
        return [
            selection_of(document.text, around(document, offset_of(document.text, place)))
            for place in params.positions
        ]

    @server.feature(
        lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, lsp.SemanticTokensLegend(list(KINDS), list(MODIFIERS))
    )
    def coloured(params: lsp.SemanticTokensParams) -> lsp.SemanticTokens:
        document = server.documents[params.text_document.uri]
        return lsp.SemanticTokens(data_of(document.text, tokens(document)))

    @server.feature(lsp.TEXT_DOCUMENT_INLAY_HINT)
    def hinted(params: lsp.InlayHintParams) -> list[lsp.InlayHint]:
        document = server.documents[params.text_document.uri]
        start, end = (offset_of(document.text, place) for place in (params.range.start, params.range.end))
        return [inlay_of(document.text, inlay) for inlay in inlays(document, start, end)]

    @server.feature(lsp.TEXT_DOCUMENT_CODE_LENS)
    def offered(params: lsp.CodeLensParams) -> list[lsp.CodeLens]:
        uri = params.text_document.uri
        return [lens_of(uri, lens) for lens in lenses(server.documents[uri])]


def _change_texts(server: Server) -> None:
    """Propose edits: new names, the layout, what messages say."""

    @server.feature(lsp.TEXT_DOCUMENT_RENAME)
    def rename(params: lsp.RenameParams) -> lsp.WorkspaceEdit | None:
        found = meaning_at(*_place(server, params))
        if found is None or found.place is None:
            return None
        edits = renamed(server.holding(found.place.text), found.place, params.new_name)
        changes = {server.uri_of(document): [edit_of(document, e) for e in some] for document, some in edits}
        return lsp.WorkspaceEdit(changes=changes) if changes else None

    @server.feature(lsp.TEXT_DOCUMENT_FORMATTING)
    def format_text(params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
        document = server.documents[params.text_document.uri]
        edit = formatted(document)
        return [] if edit is None else [edit_of(document, edit)]

    @server.feature(
        lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions(code_action_kinds=[lsp.CodeActionKind.QuickFix])
    )
    def proposed(params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        uri = params.text_document.uri
        document = server.documents[uri]
        first, last = (offset_of(document.text, place) for place in (params.range.start, params.range.end))
        return [
            lsp.CodeAction(
                fix.title,
                kind=lsp.CodeActionKind.QuickFix,
                diagnostics=[diagnostic_of(document, diagnostic)],
                edit=lsp.WorkspaceEdit(changes={uri: [edit_of(document, e) for e in fix.edits]}),
            )
            for diagnostic in server.shown.get(uri, ())
            if diagnostic.span is not None and diagnostic.span.start <= last and diagnostic.span.end >= first
            for fix in fixes(document, diagnostic)
        ]


class _At(Protocol):
    """Parameters of the protocol that name a document and a place in it."""

    text_document: lsp.TextDocumentIdentifier
    position: lsp.Position


def _place(server: Server, params: _At) -> tuple[Document, int]:
    document = server.documents[params.text_document.uri]
    return document, offset_of(document.text, params.position)
