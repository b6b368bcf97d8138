"""Entries of the cache: found only if nobody else can have written them and they are whole, kept under their checksum."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from . import tally
from .cache import BUILD_PREFIX, ENTRY, cache_folder, mark_used, remove_build, remove_entry, shelf_of
from .checksum import checksum
from .holding import hold, locked
from .trust import file_doubt

_READ = os.O_RDONLY | sum(
    getattr(os, flag, 0) for flag in ("O_BINARY", "O_CLOEXEC", "O_NOFOLLOW", "O_NONBLOCK")
)
"""Neither through a link nor waiting for whoever writes into a pipe."""


def find_entry(stem: str, suffix: str) -> Path | None:
    """Give the entry of a name, which no other process removes as long as this one holds it; None where there is none.

    What others may have written, what was cut off or damaged is removed, with a warning: it is never executed.
    """
    folder = shelf_of(stem)
    with locked(folder.parent):
        for file in _listed(folder, f"{stem}-", suffix):
            name = ENTRY.fullmatch(file.name)
            if name is None:
                continue
            doubt = _doubt(file, name[1])
            if not doubt:
                hold(file)
                mark_used(file)
                return file
            warnings.warn(
                f"{file.name} in {folder} {doubt}: it is not used, but made again",
                RuntimeWarning,
                stacklevel=1,
            )
            remove_entry(file)
    return None


def keep_entry(file: Path, stem: str, suffix: str) -> Path:
    """Move a file of a build folder to where ``find_entry`` finds it, readable and writable by its owner alone."""
    file.chmod(0o600 if suffix in (".npz", ".stages") else 0o700)
    content = file.read_bytes()
    kept = shelf_of(stem) / f"{stem}-{_checksum(content)}{suffix}"
    assert ENTRY.fullmatch(kept.name), f"{kept.name} would never be found again"
    folder = kept.parent.parent
    with locked(folder):
        _move(file, kept)
        hold(kept)
        tally.note(folder, len(content))
    return kept


def _move(file: Path, kept: Path) -> None:
    """Move a file to its shelf, which is made if absent, and may be gone again where there are no locks."""
    while True:
        kept.parent.mkdir(mode=0o700, exist_ok=True)
        try:
            os.replace(file, kept)
        except FileNotFoundError:
            if not file.exists():
                raise
        else:
            return


def _listed(shelf: Path, begin: str, end: str) -> list[Path]:
    try:
        names = os.listdir(shelf)
    except FileNotFoundError:
        return []
    return [shelf / name for name in sorted(names) if name.startswith(begin) and name.endswith(end)]


@contextmanager
def build_folder(kept_after: type[BaseException] | tuple[()] = ()) -> Iterator[Path]:
    """Give a new folder to build in, which no other process removes; afterwards it is gone, but after that exception."""
    import tempfile

    cache = cache_folder()
    with ExitStack() as stack:
        with locked(cache):
            folder = Path(tempfile.mkdtemp(prefix=BUILD_PREFIX, dir=cache))
            stack.enter_context(locked(folder))
        try:
            yield folder
        except kept_after:
            raise
        except BaseException:
            remove_build(folder)
            raise
        remove_build(folder)


def _doubt(file: Path, expected: str) -> str:
    try:
        descriptor = os.open(file, _READ)
    except OSError as error:
        return "is a link" if file.is_symlink() else f"cannot be read ({error.strerror})"
    with os.fdopen(descriptor, "rb") as opened:
        doubt = file_doubt(os.fstat(descriptor))
        if doubt:
            return doubt
        whole = _checksum(opened.read()) == expected
    return "" if whole else "was cut off or damaged"


def _checksum(content: bytes) -> str:
    return checksum(content).hexdigest()[:16]
