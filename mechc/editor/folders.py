"""The files beside those that are open: all ``.mech`` files of the folders that an editor works in."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from .document import Document

MOST = 1000
"""Files that are looked at, at most."""
_ASIDE = frozenset({"node_modules", "site-packages", "build", "dist"})


def files(folders: Iterable[Path]) -> Iterator[Path]:
    """Yield the files of mech below some folders, hidden and foreign folders left out; ``MOST`` at most."""
    seen = 0
    for folder in folders:
        for path in sorted(folder.rglob("*.mech")):
            inside = path.relative_to(folder).parts[:-1]
            if any(part.startswith(".") or part in _ASIDE for part in inside):
                continue
            yield path
            seen += 1
            if seen >= MOST:
                return


def documents(
    opened: Iterable[Document], folders: Iterable[Path], wanted: Callable[[Path, str], bool]
) -> Iterator[Document]:
    """Yield the open texts, then those of the folders' other files; only ``wanted`` ones, by path and text, are read further."""
    known = set()
    for document in opened:
        known.add(document.path.resolve())
        if wanted(document.path, document.text):
            yield document
    for path in files(folders):
        if path.resolve() in known:
            continue
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            continue  # the compiler says so when it is opened
        if wanted(path, text):
            yield Document(path, text)
