"""What takes long, in a process of its own: ``python -m mechc.editor.worker_main`` reads questions and writes answers, pickled."""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from ..lang.diagnostics import Diagnostic
from .document import Document
from .edits import Fix, fixes
from .preview import preview

MOST = 8
"""Texts that are remembered, so that models that have not changed are not looked at again."""
TRYING = 0.8
"""Seconds of processor time after which no further proposal is tried."""


class AnswerCache:
    """Answers by the names of their questions."""

    def __init__(self) -> None:
        self._documents: dict[Path, Document] = {}
        self.by_name: Mapping[str, Callable[..., Any]] = {
            "in_full": self.in_full,
            "fixes": self.fixes,
            "preview": preview,
        }

    def in_full(self, path: Path, text: str) -> tuple[Diagnostic, ...]:
        """Return what the whole compiler says of a text."""
        return self._document(path, text).in_full()

    def fixes(self, path: Path, text: str, found: Iterable[Diagnostic]) -> list[list[Fix]]:
        """Return what messages about a text propose, as much as can be tried in ``TRYING`` seconds."""
        document = self._document(path, text)
        until = time.process_time() + TRYING
        return [fixes(document, diagnostic, until - time.process_time()) for diagnostic in found]

    def _document(self, path: Path, text: str) -> Document:
        document = self._documents.pop(path, None) or Document(path)
        if document.text != text or not document.is_looked_at:
            document.change(text)
        self._documents[path] = document
        while len(self._documents) > MOST:
            del self._documents[next(iter(self._documents))]
        return document


def main() -> None:
    """Answer until nobody asks any more; what the compiler prints goes to where errors go."""
    with os.fdopen(os.dup(0), "rb") as asked, os.fdopen(os.dup(1), "wb") as told:
        os.dup2(2, 1)
        answers = AnswerCache()
        _write(told, b"")  # ready
        while True:
            try:
                question, arguments, named = pickle.load(asked)
            except EOFError:
                return
            _write(told, pickle.dumps(answers.by_name[question](*arguments, **named)))


def _write(told: BinaryIO, data: bytes) -> None:
    told.write(len(data).to_bytes(8, "big") + data)
    told.flush()


if __name__ == "__main__":
    main()
