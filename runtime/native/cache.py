"""The user's cache folder of compiled code: where it is, how big it may grow, how it is emptied (the key of an
entry: ``compiler.py``).

The folder that is chosen may hold anything: entries lie in a subfolder of it, and only what bears the name of an entry is ever removed.
There they lie on shelves, by the first digits of their keys, so that few are looked at to find one; those beside the shelves are of
versions of mechc without, and are removed as all others are, never used.
"""

from __future__ import annotations

import atexit
import errno
import os
import re
import stat
import time
import warnings
from contextlib import suppress
from pathlib import Path

from msgspec import Struct

from . import tally
from .holding import is_held, locked, release
from .trust import folder_doubt, subfolder_doubt

SIZE_LIMIT = 500_000_000
"""Bytes above which the entries that were unused for the longest time are removed."""

BETWEEN_LOOKS = SIZE_LIMIT // 20
"""Bytes that are kept before it is looked whether the limit is passed."""

SUBFOLDER = "mechc-compiled"
"""The folder of the entries, in the one that the user chose."""

BUILD_PREFIX = "build-"
STALE_SECONDS = 24 * 3600.0

ENTRY = re.compile(r"[a-z]+(?:-[a-z]+)*-[0-9a-f]{32}-([0-9a-f]{16})\.(?:so|dll|dylib|wasm|o|npz|stages)")
"""Names of entries: what it is, what it was made from, its checksum."""

_BUILD = re.compile(BUILD_PREFIX + r"[a-z0-9_]{8}")
"""A folder in which something is built, named by ``tempfile``."""

_SHELF = re.compile(r"entries-[0-9a-f]{2}")
"""A folder of entries whose keys begin with these digits."""

_BUILT = frozenset(
    (".c", ".h", ".o", ".so", ".dll", ".dylib", ".npz", ".stages", ".lib", ".pdb", ".exp", ".def")
)
"""Endings of what a build leaves in its folder: sources, what we make of them, what linkers add."""


class CacheContent(Struct, frozen=True):
    folder: Path
    entries: int
    size: int
    in_use: int = 0
    """Entries that other processes work with, which were left when the cache was cleared."""


class CacheUnusable(OSError):
    """The folder that the user chose for compiled code cannot be made or written."""


def cache_folder() -> Path:
    """Give the folder of the entries, made if absent: below ``MECHC_CACHE``, else below the user's cache of this platform.

    Where others could put code into it, or the user's cache cannot be written (no home, a system that is read-only), a
    folder that lasts as long as this process takes its place, with a warning. Raises CacheUnusable where ``MECHC_CACHE``
    cannot be written: it was asked for.
    """
    chosen = os.environ.get("MECHC_CACHE")
    try:
        folder = made((Path(chosen) if chosen else users_cache()) / SUBFOLDER)
    except OSError as error:
        if chosen:
            raise CacheUnusable(
                f"compiled code cannot be kept in {chosen}, which MECHC_CACHE names: {error.strerror}"
            ) from error
        return _passing_folder(f"compiled code cannot be kept in {users_cache()} ({error.strerror})")
    if folder.parent == _passing:
        return folder
    doubt = folder_doubt(folder)
    return _passing_folder(f"compiled code is not kept in {folder}: {doubt}") if doubt else folder


def shelf_of(stem: str) -> Path:
    """Give the folder in which entries of a name lie, made or not; as ``cache_folder`` where others could put code there."""
    shelf = cache_folder() / f"entries-{stem.rpartition('-')[2][:2]}"
    doubt = subfolder_doubt(shelf)
    return _passing_folder(f"compiled code is not kept in {shelf}: {doubt}") / shelf.name if doubt else shelf


def users_cache() -> Path:
    """Give the user's cache folder of this platform, whether it is there or not."""
    import platformdirs

    return Path(platformdirs.user_cache_dir("mechc", appauthor=False))


def made(folder: Path) -> Path:
    """Make a folder if absent, for its owner alone; give it without links. Raises OSError where it may not be written."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    return folder.resolve()


_passing: Path | None = None
"""The folder that this process made in place of one that cannot be used."""


def _passing_folder(why: str) -> Path:
    import shutil
    import tempfile

    global _passing
    _passing = Path(tempfile.mkdtemp(prefix="mechc-cache-")).resolve()
    atexit.register(shutil.rmtree, _passing, ignore_errors=True)
    os.environ["MECHC_CACHE"] = str(_passing)  # from here on, also for the processes that this one starts
    warnings.warn(
        f"{why}, so each run compiles again; the environment variable MECHC_CACHE chooses another folder",
        RuntimeWarning,
        stacklevel=1,
    )
    return made(_passing / SUBFOLDER)


def mark_used(entry: Path) -> None:
    """Make the entry the youngest one."""
    with suppress(FileNotFoundError):  # another process emptied the cache meanwhile
        os.utime(entry)


def cache_content() -> CacheContent:
    folder = cache_folder()
    entries = [size for _, size, _ in _entries(folder)]
    return CacheContent(folder, len(entries), sum(entries))


def clear_cache() -> CacheContent:
    """Remove all entries that no other process works with; give what was removed."""
    release()
    folder = cache_folder()
    with locked(folder, alone=True):
        entries = _entries(folder)
        free = [(size, entry) for _, size, entry in entries if not is_held(entry)]
        for _, entry in free:
            remove_entry(entry)
        for shelf in _shelves(folder):
            with suppress(OSError):  # something lies there
                shelf.rmdir()
        tally.forget(folder)
    return CacheContent(folder, len(free), sum(size for size, _ in free), len(entries) - len(free))


def prune_when_due() -> None:
    """Prune the cache, if enough was kept since it was looked through: to look through many entries takes longer than to build one."""
    if tally.is_due(cache_folder(), BETWEEN_LOOKS):
        prune_cache()


def prune_cache(limit: int = SIZE_LIMIT) -> None:
    """Remove the entries unused for the longest time until the rest fits, and what broken builds left."""
    folder = cache_folder()
    with locked(folder, alone=True):
        entries = sorted(_entries(folder))
        size = sum(entry_size for _, entry_size, _ in entries)
        now = time.time()
        for used, entry_size, entry in entries:
            stale = entry.name.startswith(BUILD_PREFIX) and now - used > STALE_SECONDS
            if (size > limit or stale) and not is_held(entry):
                remove_entry(entry)
                size -= entry_size
        tally.begin(folder)


def remove_build(folder: Path) -> None:
    """Remove the folder of a build: what builds write, never what lies deeper; then the folder, if that was all."""
    with suppress(OSError):
        for file in folder.iterdir():
            if file.suffix in _BUILT and not file.is_dir():
                file.unlink()
        folder.rmdir()


def _entries(folder: Path) -> list[tuple[float, int, Path]]:
    """(time of last use, bytes, path) of all entries; what vanishes meanwhile and what is not an entry is left out. What lies there
    under two names counts once."""
    found: list[tuple[float, int, Path]] = []
    for place in (folder, *_shelves(folder)):
        for entry in place.iterdir():
            with suppress(FileNotFoundError):
                state = entry.lstat()
                if stat.S_ISREG(state.st_mode) and ENTRY.fullmatch(entry.name):
                    found.append((state.st_mtime, state.st_size // state.st_nlink, entry))
                elif stat.S_ISDIR(state.st_mode) and place == folder and _BUILD.fullmatch(entry.name):
                    size = sum(file.lstat().st_size for file in entry.iterdir())
                    found.append((state.st_mtime, size, entry))
    return found


def _shelves(folder: Path) -> list[Path]:
    with os.scandir(folder) as listed:
        return [Path(e.path) for e in listed if _SHELF.fullmatch(e.name) and e.is_dir(follow_symlinks=False)]


def remove_entry(entry: Path) -> None:
    """Remove an entry; a link, never what it leads to."""
    if entry.is_dir() and not entry.is_symlink():
        remove_build(entry)
    else:
        with suppress(FileNotFoundError, PermissionError):  # gone meanwhile; Windows keeps what is loaded
            entry.unlink()
