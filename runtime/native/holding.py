"""Locks between processes that share a cache: what one works with is not removed by another.

They end with the process that took them, however it ends. Where there are none (Windows, some network drives) nothing is
ever held; there the system itself keeps files that are open.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

MOST_HELD = 64
"""Entries that a process holds: those it asked for last, of which it may still load some."""

_held: dict[Path, int] = {}
"""Descriptors by path, those asked for last at the end."""


@contextmanager
def locked(place: Path, *, alone: bool = False) -> Iterator[None]:
    """Hold a file or folder together with others that do not want it ``alone``; wait until that can be."""
    descriptor = _open(place)
    try:
        if descriptor is not None:
            _lock(descriptor, alone=alone, wait=True)
        yield
    finally:
        if descriptor is not None:
            os.close(descriptor)


def hold(place: Path) -> None:
    """Hold a file until ``MOST_HELD`` others were asked for, or this process ends."""
    descriptor = _open(place)
    if descriptor is None:
        return
    _lock(descriptor, alone=False, wait=False)
    _release(place)
    _held[place] = descriptor
    if len(_held) > MOST_HELD:
        _release(next(iter(_held)))


def release() -> None:
    """Let go of all that this process holds."""
    for place in [*_held]:
        _release(place)


def _release(place: Path) -> None:
    descriptor = _held.pop(place, None)
    if descriptor is not None:
        os.close(descriptor)


def is_held(place: Path) -> bool:
    """Tell whether any process, this one too, holds a file or folder."""
    descriptor = _open(place)
    if descriptor is None:
        return False
    try:
        return not _lock(descriptor, alone=True, wait=False)
    finally:
        os.close(descriptor)


def _open(place: Path) -> int | None:
    if fcntl is None:
        return None
    with suppress(OSError):  # gone, or not ours to read
        return os.open(place, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
    return None


def _lock(descriptor: int, *, alone: bool, wait: bool) -> bool:
    """Return whether it is locked now, or cannot be locked by anybody."""
    kind = (fcntl.LOCK_EX if alone else fcntl.LOCK_SH) | (0 if wait else fcntl.LOCK_NB)
    try:
        fcntl.flock(descriptor, kind)
    except BlockingIOError:
        return False
    except OSError:  # no locks on this drive
        return True
    return True
