"""The user's cache folder of compiled code: where it is, how big it may grow, how it is emptied.

The folder that is chosen may hold anything: entries lie in a subfolder of it, and only what bears the name of an entry is ever removed.
"""

from __future__ import annotations

import atexit
import errno
import os
import re
import shutil
import stat
import tempfile
import time
import warnings
from contextlib import suppress
from pathlib import Path

from msgspec import Struct

SIZE_LIMIT = 500_000_000
"""Bytes above which the entries that were unused for the longest time are removed."""

SUBFOLDER = "mechc-compiled"
"""The folder of the entries, in the one that the user chose."""

BUILD_PREFIX = "build-"
STALE_SECONDS = 24 * 3600.0

_ENTRY = re.compile(r"[a-z]+(?:-[a-z]+)*-[0-9a-f]{32}\.(?:so|dll|dylib|o|npz)")
_BUILD = re.compile(BUILD_PREFIX + r"[a-z0-9_]{8}(?:\.npz)?")
"""A folder in which something is built, or a file that is being written, named by ``tempfile``."""

_BUILT = frozenset((".c", ".h", ".o", ".kept", ".so", ".dll", ".dylib", ".lib", ".pdb", ".exp", ".def"))
"""Endings of what a build leaves in its folder: sources, what we make of them, what linkers add."""


class CacheContent(Struct, frozen=True):
    folder: Path
    entries: int
    size: int


class CacheUnusable(OSError):
    """The folder that the user chose for compiled code cannot be made or written."""


def cache_folder() -> Path:
    """Give the folder of the entries, made if absent: below ``MECHC_CACHE``, else below the user's cache of this platform.

    Where the user's cache cannot be written (no home, a system that is read-only), a folder that lasts as long as this process takes
    its place, with a warning. Raises CacheUnusable where ``MECHC_CACHE`` cannot be written: it was asked for.
    """
    chosen = os.environ.get("MECHC_CACHE")
    if not chosen:
        return _users_folder(users_cache())
    try:
        return made(Path(chosen) / SUBFOLDER)
    except OSError as error:
        raise CacheUnusable(
            f"compiled code cannot be kept in {chosen}, which MECHC_CACHE names: {error.strerror}"
        ) from error


def users_cache() -> Path:
    """Give the user's cache folder of this platform, whether it is there or not."""
    import platformdirs

    return Path(platformdirs.user_cache_dir("mechc", appauthor=False))


def made(folder: Path) -> Path:
    """Make a folder if absent, for its owner alone. Raises OSError where it may not be written."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    if not os.access(folder, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    return folder


def _users_folder(folder: Path) -> Path:
    try:
        return made(folder / SUBFOLDER)
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
        return made(instead / SUBFOLDER)


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


def remove_build(folder: Path) -> None:
    """Remove the folder of a build: what builds write, never what lies deeper; then the folder, if that was all."""
    with suppress(OSError):
        for file in folder.iterdir():
            if file.suffix in _BUILT and not file.is_dir():
                file.unlink()
        folder.rmdir()


def _entries(folder: Path) -> list[tuple[float, int, Path]]:
    """(time of last use, bytes, path) of all entries; what vanishes meanwhile and what is no entry is left out."""
    found: list[tuple[float, int, Path]] = []
    for entry in folder.iterdir():
        with suppress(FileNotFoundError):
            state = entry.lstat()
            if stat.S_ISREG(state.st_mode) and (_ENTRY.fullmatch(entry.name) or _BUILD.fullmatch(entry.name)):
                found.append((state.st_mtime, state.st_size, entry))
            elif stat.S_ISDIR(state.st_mode) and _BUILD.fullmatch(entry.name):
                size = sum(file.lstat().st_size for file in entry.iterdir())
                found.append((state.st_mtime, size, entry))
    return found


def _remove(entry: Path) -> None:
    if entry.is_dir():
        remove_build(entry)
    else:
        with suppress(FileNotFoundError, PermissionError):  # Windows keeps a library that is loaded
            entry.unlink()
