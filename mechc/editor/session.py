"""One editor's texts: who reads them and looks at them, and when.

A text is read and looked at in a thread, so that what is asked meanwhile is answered from the text before; what the whole compiler
says, when nothing has changed for a moment, in a process of its own, which ends where a change makes its answer useless.
"""

from __future__ import annotations

import asyncio
import gc
import sys
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from lsprotocol import types as lsp
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol

from .. import __version__
from ..compiler.interpreter import DEEPEST
from ..lang.diagnostics import Diagnostic
from .document import Document
from .folders import documents
from .models import read
from .protocol import diagnostic_of, path_of
from .worker_process import WorkerProcess

IDLE = 0.4
"""Seconds without a change after which the whole compiler is asked."""
PATIENCE = 0.03
"""Seconds that a question waits for the present text to be read, before it is answered from the one before."""
MOST_UNSWEPT = 10
"""Texts that are taken, at most, before cyclic garbage is looked for; else it is at idle moments."""

P = ParamSpec("P")
T = TypeVar("T")


class Forgetful(LanguageServerProtocol):
    """What pygls speaks, without all futures of the notifications that were ever answered: it keeps two for each."""

    def _execute_handler(
        self,
        msg_id: str | int,
        handler: Callable[..., Any],
        callback: Callable[[Future[Any]], None],
        args: tuple[Any, ...] | None = None,
        kwargs: dict[str, Any] | None = None,
    ) -> None:
        def ended(future: Future[Any]) -> None:
            if not future.cancelled():  # pygls cancels while it goes through them
                self._request_futures.pop(msg_id, None)
            callback(future)

        super()._execute_handler(msg_id, handler, ended, args, kwargs)


class Server(LanguageServer):
    """One editor's documents."""

    def __init__(self) -> None:
        super().__init__(
            "mechc",
            __version__,
            text_document_sync_kind=lsp.TextDocumentSyncKind.Full,
            protocol_cls=Forgetful,
        )
        self.documents: dict[str, Document] = {}
        self.shown: dict[str, tuple[Diagnostic, ...]] = {}
        self.whole, self.fixing, self.running = (
            WorkerProcess(),
            WorkerProcess(5.0, patient=True),
            WorkerProcess(30.0, patient=True),
        )
        self._thread = ThreadPoolExecutor(1, "mechc")
        self._checks: dict[str, asyncio.Task[None]] = {}
        self._around: asyncio.Task[None] | None = None
        self._step = asyncio.Event()
        self._unswept = 0

    def begin(self) -> None:
        """Look for cyclic garbage only where nobody waits, and allow deep recursion in all threads."""
        gc.collect()
        gc.freeze()
        gc.disable()
        sys.setrecursionlimit(max(sys.getrecursionlimit(), DEEPEST))

    async def end(self) -> None:
        """Leave nothing running."""
        for task in (*self._checks.values(), *([self._around] if self._around else [])):
            task.cancel()
        for aside in (self.whole, self.fixing, self.running):
            await aside.close()

    async def aside(self, call: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call a function in the thread that reads and looks."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, lambda: call(*args, **kwargs))

    # ------------------------------------------------------------ texts

    def take(self, uri: str, text: str) -> None:
        """Take a text that was opened or changed, and begin to say what is wrong with it."""
        document = self.documents.get(uri)
        if document is None:
            document = self.documents[uri] = Document(path_of(uri))
        document.write(text)
        if before := self._checks.pop(uri, None):
            before.cancel()
        self._checks[uri] = asyncio.get_running_loop().create_task(self._check(uri, document))

    async def _check(self, uri: str, document: Document) -> None:
        """Read a text, look at it, and ask the whole compiler; a change of the text cancels this."""
        self._unswept += 1
        if self._unswept >= MOST_UNSWEPT:
            await self._sweep()
        reading = await self.aside(read, document.source)
        document.take(reading)
        self._stepped()
        front = await self.aside(document.look, reading)
        document.take_front(front)
        self._stepped()
        self.show(uri, front.diagnostics)
        await asyncio.sleep(IDLE)
        if reading.tree is not None:
            found = await self.whole.ask("in_full", document.path, document.text)
            if found is not None:
                self.show(uri, found)
        await self._sweep()

    async def _sweep(self) -> None:
        self._unswept = 0
        await self.aside(gc.collect)

    def _stepped(self) -> None:
        self._step.set()
        self._step = asyncio.Event()

    async def read(self, uri: str) -> Document:
        """Return a document whose present text was read. Raises KeyError where it is closed."""
        while self.documents[uri].reading is None:
            await self._step.wait()
        return self.documents[uri]

    async def looked_at(self, uri: str) -> Document:
        """Return a document whose present text was looked at. Raises KeyError where it is closed."""
        while not self.documents[uri].is_looked_at:
            await self._step.wait()
        return self.documents[uri]

    async def soon(self, uri: str) -> Document:
        """Return a document whose present text was read, if that takes but a moment. Raises KeyError where it is closed."""
        if self.documents[uri].tree is None:
            return await self.read(uri)
        with suppress(TimeoutError):
            return await asyncio.wait_for(self.read(uri), PATIENCE)
        return self.documents[uri]

    def show(self, uri: str, found: tuple[Diagnostic, ...]) -> None:
        """Send the messages of a document."""
        document = self.documents[uri]
        self.shown[uri] = own_of(document, found)
        self._publish(uri, document, self.shown[uri])

    def close(self, uri: str) -> None:
        """Forget a document."""
        if check := self._checks.pop(uri, None):
            check.cancel()
        self.documents.pop(uri, None)
        self.shown.pop(uri, None)
        self._stepped()  # whoever waits for it hears that it is closed

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

        others = documents((), self.folders(), concerned)
        while (document := await self.aside(next, others, None)) is not None:
            uri = document.path.resolve().as_uri()
            if uri not in self.documents:
                self._publish(uri, document, own_of(document, await self.aside(document.at_once)))

    def _publish(self, uri: str, document: Document, found: Iterable[Diagnostic]) -> None:
        self.text_document_publish_diagnostics(
            lsp.PublishDiagnosticsParams(uri, [diagnostic_of(document, d) for d in found])
        )


def own_of(document: Document, found: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Return those messages that are about this text, and not about one that it imports."""
    return tuple(d for d in found if d.span is None or d.span.file.name == document.source.name)
