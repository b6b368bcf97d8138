"""The language server: which of the other files of this folder answers which question of an editor.

What is asked while somebody types is answered at once, from the text before if need be; what shows the text waits until it is read.
"""

from __future__ import annotations

from typing import Any, Protocol

from lsprotocol import types as lsp
from msgspec.structs import asdict

from .completion import completions
from .document import Document
from .edits import formatted, occurrences, renamed
from .hover import hover
from .inlays import inlays
from .lenses import lenses
from .names import meaning_at
from .outline import folds, symbols
from .preview import Preview
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
from .session import Server
from .signatures import signature
from .tokens import KINDS, MODIFIERS, tokens


def make_server() -> Server:
    """Make a server with all that it can do."""
    server = Server()
    server.begin()
    _keep_texts(server)
    _tell_meanings(server)
    _show_structure(server)
    _change_texts(server)
    _run(server)
    return server


def _keep_texts(server: Server) -> None:
    """Follow what is opened, written and closed."""

    @server.feature(lsp.INITIALIZED)
    async def began(_: lsp.InitializedParams) -> None:
        server.look_around()

    @server.feature(lsp.SHUTDOWN)
    async def ended(_: None) -> None:
        await server.end()

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
    async def hovered(params: lsp.HoverParams) -> lsp.Hover | None:
        document, offset = await _soon(server, params)
        found = hover(document, offset)
        if found is None:
            return None
        text, start, end = found
        return lsp.Hover(
            lsp.MarkupContent(lsp.MarkupKind.Markdown, text), range_of(document.text, start, end)
        )

    @server.feature(lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=[".", "(", " "]))
    async def completed(params: lsp.CompletionParams) -> lsp.CompletionList:
        return lsp.CompletionList(
            False, [item_of(offer) for offer in completions(*await _soon(server, params))]
        )

    @server.feature(lsp.TEXT_DOCUMENT_SIGNATURE_HELP, lsp.SignatureHelpOptions(trigger_characters=["(", ","]))
    async def signed(params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
        found = signature(*await _soon(server, params))
        return None if found is None else signature_of(found)

    @server.feature(lsp.TEXT_DOCUMENT_DEFINITION)
    async def defined(params: lsp.DefinitionParams) -> lsp.Location | None:
        found = meaning_at(*await _place(server, params))
        return None if found is None or found.place is None else location_of(found.place)

    @server.feature(lsp.TEXT_DOCUMENT_REFERENCES)
    async def referred(params: lsp.ReferenceParams) -> list[lsp.Location]:
        found = meaning_at(*await _place(server, params))
        if found is None or found.place is None:
            return []
        place = found.place
        return [
            lsp.Location(server.uri_of(document), range_of(document.text, *where))
            for document in server.holding(place.text)
            for where in occurrences(document, place)
        ]

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    async def highlighted(params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        document, offset = await _place(server, params)
        found = meaning_at(document, offset)
        if found is None or found.place is None:
            return []
        places = occurrences(document, found.place)
        return [lsp.DocumentHighlight(range_of(document.text, *place)) for place in places]


def _show_structure(server: Server) -> None:
    """Show what a text consists of, what it does not say, and what can be done with it."""

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    async def outline(params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        document = await server.read(params.text_document.uri)
        return [symbol_of(s) for s in symbols(document)]

    @server.feature(lsp.TEXT_DOCUMENT_FOLDING_RANGE)
    async def folded(params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
        document = await server.read(params.text_document.uri)
        return [lsp.FoldingRange(first - 1, last - 1) for first, last in folds(document)]

    @server.feature(lsp.TEXT_DOCUMENT_SELECTION_RANGE)
    async def selected(params: lsp.SelectionRangeParams) -> list[lsp.SelectionRange]:
        document = await server.read(params.text_document.uri)
        return [
            selection_of(document.text, around(document, offset_of(document.text, place)))
            for place in params.positions
        ]

    @server.feature(
        lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, lsp.SemanticTokensLegend(list(KINDS), list(MODIFIERS))
    )
    async def coloured(params: lsp.SemanticTokensParams) -> lsp.SemanticTokens:
        document = await server.read(params.text_document.uri)
        return lsp.SemanticTokens(data_of(document.text, tokens(document)))

    @server.feature(lsp.TEXT_DOCUMENT_INLAY_HINT)
    async def hinted(params: lsp.InlayHintParams) -> list[lsp.InlayHint]:
        document = await server.looked_at(params.text_document.uri)
        start, end = (offset_of(document.text, place) for place in (params.range.start, params.range.end))
        return [inlay_of(document.text, inlay) for inlay in inlays(document, start, end)]

    @server.feature(lsp.TEXT_DOCUMENT_CODE_LENS)
    async def offered(params: lsp.CodeLensParams) -> list[lsp.CodeLens]:
        uri = params.text_document.uri
        return [lens_of(uri, lens) for lens in lenses(await server.read(uri))]


def _run(server: Server) -> None:
    """Run what is being written: ``mechc/preview`` with the address of a text, perhaps a ``model``."""

    @server.feature("mechc/preview")
    async def previewed(params: Any) -> dict[str, str]:
        document = server.documents[params.uri]
        model = getattr(params, "model", None)
        made: Preview | None = await server.running.ask("preview", document.path, document.text, model)
        return asdict(made or Preview(message=f"the run takes more than {server.running.longest:g} s"))


def _change_texts(server: Server) -> None:
    """Propose edits: new names, the layout, what messages say."""

    @server.feature(lsp.TEXT_DOCUMENT_RENAME)
    async def rename(params: lsp.RenameParams) -> lsp.WorkspaceEdit | None:
        found = meaning_at(*await _place(server, params))
        if found is None or found.place is None:
            return None
        holding = list(server.holding(found.place.text))
        edits = await server.aside(renamed, holding, found.place, params.new_name)
        changes = {server.uri_of(document): [edit_of(document, e) for e in some] for document, some in edits}
        return lsp.WorkspaceEdit(changes=changes) if changes else None

    @server.feature(lsp.TEXT_DOCUMENT_FORMATTING)
    async def format_text(params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
        document = await server.read(params.text_document.uri)
        edit = await server.aside(formatted, document)
        return [] if edit is None else [edit_of(document, edit)]

    @server.feature(
        lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions(code_action_kinds=[lsp.CodeActionKind.QuickFix])
    )
    async def proposed(params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        uri = params.text_document.uri
        document = await server.looked_at(uri)
        first, last = (offset_of(document.text, place) for place in (params.range.start, params.range.end))
        near = [
            diagnostic
            for diagnostic in server.shown.get(uri, ())
            if diagnostic.span is not None and diagnostic.span.start <= last and diagnostic.span.end >= first
        ]
        found = await server.fixing.ask("fixes", document.path, document.text, near) if near else []
        return [
            lsp.CodeAction(
                fix.title,
                kind=lsp.CodeActionKind.QuickFix,
                diagnostics=[diagnostic_of(document, diagnostic)],
                edit=lsp.WorkspaceEdit(changes={uri: [edit_of(document, e) for e in fix.edits]}),
            )
            for diagnostic, some in zip(near, found or [[]] * len(near), strict=True)
            for fix in some
        ]


class _At(Protocol):
    """Parameters of the protocol that name a document and a place in it."""

    text_document: lsp.TextDocumentIdentifier
    position: lsp.Position


async def _place(server: Server, params: _At) -> tuple[Document, int]:
    document = await server.read(params.text_document.uri)
    return document, offset_of(document.text, params.position)


async def _soon(server: Server, params: _At) -> tuple[Document, int]:
    document = await server.soon(params.text_document.uri)
    return document, offset_of(document.text, params.position)
