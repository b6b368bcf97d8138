"""Which files a compilation depends on, for those who keep compilations."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

_LOOKED_FOR: ContextVar[set[Path] | None] = ContextVar("looked_for", default=None)


@contextmanager
def collected() -> Iterator[set[Path]]:
    """Collect every file that a compilation reads, or would have read, were it there."""
    found: set[Path] = set()
    token = _LOOKED_FOR.set(found)
    try:
        yield found
    finally:
        _LOOKED_FOR.reset(token)


def note(path: Path) -> Path:
    """Tell that the compilation depends on a file, and return it."""
    looked_for = _LOOKED_FOR.get()
    if looked_for is not None:
        looked_for.add(path)
    return path
