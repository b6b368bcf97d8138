"""Compilations kept beside compiled code: a model that has not changed is not formed again.

The name of an entry is made of all that a compilation depends on and that is known before it: the text, what was asked
for, and the state of the compiler's own files. Which other files it read, or looked for in vain, it knows afterwards: they
stand in the entry with their checksums, and are looked at again before it is used. Entries are trusted as compiled code
is (``runtime/native/kept_files.py``); they are data, never executed. Compilations with warnings are not kept.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from .compiler.compilation import Compilation, StoredCompilation, stages_of
from .runtime.native.checksum import sha256

if TYPE_CHECKING:
    from .lang.source import SourceFile

SUFFIX = ".stages"
PACKAGES = ("lang", "compiler", "stdlib")
"""Of which any change may change what is formed."""
DESCRIBED = "runtime/interface.py"
"""What problems are described in, which is kept, too."""

Contents = tuple[dict[str, str], dict[str, bytes]]
"""Checksums of the files that were read, empty for those that were not there; stages by name."""


def kept_or_formed(
    source: SourceFile, asked: object, parts: frozenset[str], form: Callable[[], Compilation]
) -> Compilation:
    """Return the kept compilation of a text, or form it and keep it. ``asked``: all else that it depends on, but files
    and compiler."""
    from .compiler.flat.names.looked_for import collected
    from .runtime.native.kept_files import find_entry

    stem = f"stages-{_digest(repr((source.name, source.text, asked, _compiler_state())).encode())}"
    entry = find_entry(stem, SUFFIX)
    if entry is not None:
        stages = _read(entry)
        if stages is not None:
            return StoredCompilation(source, stages, parts, entry.name)
    with collected() as looked_for:
        formed = form()
    if not formed.diagnostics:
        _keep(stem, formed, looked_for)
    return formed


def _read(entry: Path) -> dict[str, bytes] | None:
    """Return the stages of an entry; None where a file has changed since."""
    files, stages = msgspec.msgpack.decode(entry.read_bytes(), type=Contents)
    return stages if all(_checksum(Path(path)) == sum for path, sum in files.items()) else None


def _keep(stem: str, compilation: Compilation, looked_for: Iterable[Path]) -> None:
    from .runtime.native.kept_files import build_folder, find_entry, keep_entry

    files = {str(path): _checksum(path) for path in sorted(looked_for)}
    old = find_entry(stem, SUFFIX)
    with build_folder() as folder:
        file = folder / f"kept{SUFFIX}"
        file.write_bytes(msgspec.msgpack.encode((files, stages_of(compilation))))
        kept = keep_entry(file, stem, SUFFIX)
    if old is not None and old != kept:
        old.unlink(missing_ok=True)


def _checksum(path: Path) -> str:
    try:
        return _digest(path.read_bytes())
    except OSError:
        return ""


def _digest(content: bytes) -> str:
    return str(sha256(content).hexdigest()[:32])


def _compiler_state() -> list[tuple[str, int, int]]:
    """Return names, sizes and times of the compiler's own files, and the folders that imports are looked for in."""
    state = [(f"{sys.version}:{os.environ.get('MECHPATH', '')}:{Path.cwd()}", 0, 0)]
    pending = [str(Path(__file__).parent / name) for name in PACKAGES]
    known = (Path(__file__).parent / DESCRIBED).stat()
    state.append((DESCRIBED, known.st_size, known.st_mtime_ns))
    while pending:
        with os.scandir(pending.pop()) as entries:
            for entry in entries:
                if entry.is_dir():
                    if entry.name != "__pycache__":
                        pending.append(entry.path)
                elif entry.name.endswith((".py", ".mech", ".lark")):
                    status = entry.stat()
                    state.append((entry.path, status.st_size, status.st_mtime_ns))
    return sorted(state)
