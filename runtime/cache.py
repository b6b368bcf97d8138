"""The user's cache folder of compiled code: where it is, how big it may grow, how it is emptied."""

from __future__ import annotations

import atexit
import errno
import os
import shutil
import tempfile
import time
import warnings
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


class CacheUnusable(OSError):
    """The folder that the user chose for compiled code cannot be made or written."""


def cache_folder() -> Path:
    """Give the folder, made if absent: ``MECHC_CACHE``, else the user's cache of this platform.

    Where the user's cache cannot be written (no home, a system that is read-only), a folder that lasts as long as this process takes
    its place, with a warning. Raises CacheUnusable where ``MECHC_CACHE`` cannot be written: it was asked for.
    """
    chosen = os.environ.get("MECHC_CACHE")
    if not chosen:
        return _users_folder(users_cache())
    try:
        return made(Path(chosen))
    except OSError as error:
        raise CacheUnusable(
            f"compiled code cannot be kept in {chosen}, which MECHC_CACHE names: {error.strerror}"
        ) from error


def users_cache() -> Path:
    """Give the user's cache folder of this platform, whether it is there or not."""
    import platformdirs

    return Path(platformdirs.user_cache_dir("mechc", appauthor=False))


def made(folder: Path) -> Path:
    """Make a folder if absent. Raises OSError where it may not be written."""
    folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    return folder


def _users_folder(folder: Path) -> Path:
    try:
        return made(folder)
    except OSError as error:
        instead = Path(tempfile.mkdtemp(prefix="mechc-cache-"))
        atexit.register(shutil.rmtree, instead, ignore_errors=True)
        os.environ["MECHC_CACHE"] = str(instead)  # from here on, also for the processes that this one starts
        warnings.warn(
            f"compiled code cannot be kept in {folder} ({error.strerror}), so each run compiles anew; "
            "the environment variable MECHC_CACHE chooses another folder",
            RuntimeWarning,
            stacklevel=1,
        )
        return instead


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
