"""How much was kept since the cache was looked through, in a file beside the entries: so that it is looked through seldom.

It holds the time of the last look in ten digits, then a dot for each block that was kept. What holds anything else is somebody's
own file: it stays as it is, and the cache is looked through each time.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .trust import file_doubt

NAME = "kept-since"
BLOCK = 4096
"""Bytes of entries for which a dot stands; a part of them counts as whole."""
DAY = 24 * 3600.0
"""Seconds after which it is time for another look, however little was kept."""

_CONTENT = re.compile(rb"[0-9]{10}\.*")
_LONGEST = 1_000_000
_FLAGS = os.O_APPEND | sum(getattr(os, f, 0) for f in ("O_BINARY", "O_CLOEXEC", "O_NOFOLLOW", "O_NONBLOCK"))


def note(folder: Path, size: int) -> None:
    """Note that an entry of so many bytes was kept."""
    with _opened(folder, os.O_RDWR) as (descriptor, content):
        if content:
            os.write(descriptor, b"." * (1 + size // BLOCK))


def is_due(folder: Path, most: int) -> bool:
    """Tell whether more than ``most`` bytes were kept since the last look, or a day went by, or nobody knows."""
    with _opened(folder, os.O_RDONLY) as (_, content):
        if not content:
            return True
        return BLOCK * (len(content) - 10) > most or not 0 <= time.time() - int(content[:10]) <= DAY


def begin(folder: Path) -> None:
    """Note that the cache was looked through now; nobody else may work in it meanwhile."""
    forget(folder)
    with suppress(OSError):  # somebody's own file, or a disk that is full
        descriptor = os.open(folder / NAME, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _FLAGS, 0o600)
        with os.fdopen(descriptor, "wb") as file:
            file.write(b"%010d" % int(time.time()))


def forget(folder: Path) -> None:
    """Remove the file, if it is ours."""
    with _opened(folder, os.O_RDONLY) as (_, content):
        ours = bool(content)
    if ours:
        (folder / NAME).unlink(missing_ok=True)


@contextmanager
def _opened(folder: Path, how: int) -> Iterator[tuple[int, bytes]]:
    """Open the file and give its content; nothing where there is none, or none of ours."""
    try:
        descriptor = os.open(folder / NAME, how | _FLAGS)
    except OSError:
        yield -1, b""
        return
    try:
        content = b"" if file_doubt(os.fstat(descriptor)) else os.read(descriptor, _LONGEST)
        yield descriptor, content if _CONTENT.fullmatch(content) else b""
    finally:
        os.close(descriptor)
