"""The user's cache folder of compiled code: where it is, how big it may grow, how it is emptied."""

from __future__ import annotations

import os
import shutil
import time
from contextlib import suppress
from pathlib import Path

from msgspec import Struct

SIZE_LIMIT = 500_000_000
"""Bytes above which the entries that were unused for the longest time are removed."""

BUILD_PREFIX = "build-"
STALE_SECONDS = 24 * 3600.0


class CacheContent(Struct, frozen=True):
    folder: Path
    entries: int
    size: int


def cache_folder() -> Path:
    """Give the folder, made if absent: ``MECHC_CACHE``, else the user's cache of this platform."""
    chosen = os.environ.get("MECHC_CACHE")
    if chosen:
        folder = Path(chosen)
    else:
        import platformdirs

        folder = Path(platformdirs.user_cache_dir("mechc", appauthor=False))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def mark_used(entry: Path) -> None:
    """Make the entry the youngest one."""
    with suppress(FileNotFoundError):  # another process emptied the cache meanwhile
        os.utime(entry)


def cache_content() -> CacheContent:
    folder = cache_folder()
    entries = [size for _, size, _ in _entries(folder)]
    return CacheContent(folder, len(entries), sum(entries))


def clear_cache() -> CacheContent:
    """Remove all entries; give what was there."""
    content = cache_content()
    for _, _, entry in _entries(content.folder):
        _remove(entry)
    return content


def prune_cache(limit: int = SIZE_LIMIT) -> None:
    """Remove the entries unused for the longest time until the rest fits, and what broken builds left."""
    folder = cache_folder()
    entries = sorted(_entries(folder))
    size = sum(entry_size for _, entry_size, _ in entries)
    now = time.time()
    for used, entry_size, entry in entries:
        stale = entry.name.startswith(BUILD_PREFIX) and now - used > STALE_SECONDS
        if size > limit or stale:
            _remove(entry)
            size -= entry_size


def _entries(folder: Path) -> list[tuple[float, int, Path]]:
    """(time of last use, bytes, path) of all entries; entries that vanish meanwhile are left out."""
    found: list[tuple[float, int, Path]] = []
    for entry in folder.iterdir():
        with suppress(FileNotFoundError):
            files = [entry] if entry.is_file() else [file for file in entry.rglob("*") if file.is_file()]
            found.append((entry.stat().st_mtime, sum(file.stat().st_size for file in files), entry))
    return found


def _remove(entry: Path) -> None:
    if entry.is_dir():
        shutil.rmtree(entry, ignore_errors=True)
    else:
        with suppress(FileNotFoundError, PermissionError):  # Windows keeps a library that is loaded
            entry.unlink()
