"""Archives that can be unpacked: bounded in number and size, no path that leads out, no links, nothing damaged."""

from __future__ import annotations

import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from .read_description import Finding

MOST_FILES = 20_000
LARGEST = 2_000_000_000
"""Bytes of all files unpacked."""
LARGEST_DESCRIPTION = 100_000_000
DESCRIPTION = "modelDescription.xml"

_DAMAGED = (
    OSError,
    zipfile.BadZipFile,
    zipfile.LargeZipFile,
    zlib.error,
    struct.error,
    EOFError,
    RuntimeError,  # encrypted, or a compression that this Python cannot undo
    ValueError,
    KeyError,
)
"""What the library for archives raises for files that are none, or damaged."""


class NoArchive(ValueError):
    """A file that cannot be read as an archive."""


@contextmanager
def opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open an archive. Raises NoArchive, also for what goes wrong while it is read."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except _DAMAGED as error:
        raise NoArchive(str(error.args[0] if isinstance(error, KeyError) else error)) from error


def archive_findings(path: Path) -> list[Finding]:
    """Return why an archive must not be unpacked, or is not an FMU; sizes are those that unpacking keeps to."""
    try:
        with opened(path) as archive:
            unfit = [Finding("archive", text) for text in _unfit(archive)]
            damaged = None if unfit else archive.testzip()
    except NoArchive as error:
        return [Finding("archive", f"the file is not an FMU: {error}")]
    return unfit + ([Finding("archive", f"'{damaged}' in it is damaged")] if damaged else [])


def read_description(path: Path) -> bytes:
    """Return the text of the model description. Raises NoArchive."""
    with opened(path) as archive:
        return archive.read(DESCRIPTION)


def _unfit(archive: zipfile.ZipFile) -> Iterator[str]:
    entries = archive.infolist()
    if len(entries) > MOST_FILES:
        yield f"it holds {len(entries)} files, of which at most {MOST_FILES} are unpacked"
        return
    size = sum(entry.file_size for entry in entries)
    if size > LARGEST:
        yield f"unpacked it would take {size / 1e9:.1f} GB, of which at most {LARGEST / 1e9:g} are allowed"
    names = [entry.filename for entry in entries]
    if DESCRIPTION not in names:
        yield f"the file is not an FMU: there is no {DESCRIPTION} in it"
    seen: dict[str, tuple[str, int, int]] = {}
    for entry in entries:
        name = entry.orig_filename
        if _leads_out(name):
            yield f"the path '{name}' leads out of the archive"
        content = entry.filename, entry.CRC, entry.file_size
        if seen.setdefault(entry.filename.casefold(), content) != content:  # some tools write a file twice
            yield f"there are two files '{entry.filename}' in it"
        if stat.S_ISLNK(entry.external_attr >> 16):
            yield f"'{name}' is a link"
        if entry.flag_bits & 1:
            yield f"'{name}' is encrypted"
        if name == DESCRIPTION and entry.file_size > LARGEST_DESCRIPTION:
            yield f"{DESCRIPTION} is too large: {entry.file_size / 1e6:.0f} MB"


def _leads_out(name: str) -> bool:
    odd = name.startswith("/") or any(sign in name for sign in ("\\", ":", "\0"))
    return odd or ".." in PurePosixPath(name).parts
