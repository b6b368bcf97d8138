"""Compilations kept beside compiled code: a model that has not changed is not formed again.

The name of an entry is made of all that a compilation depends on and that is known before it: the text, what was asked
for, and the state of the compiler's own files. Which other files it read, or looked for in vain, it knows afterwards: they
stand in the entry with their checksums, and are looked at again before it is used. Entries are trusted as compiled code
is (``runtime/native/kept_files.py``); they are data, never executed. Compilations with warnings are not kept.
"""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec.structs import replace

from mechc.runtime.native.checksum import checksum

from .compilation import Compilation, Request

if TYPE_CHECKING:
    from .flat.model import FlatModel

SUFFIX = ".stages"
PACKAGES = ("lang", "compiler", "stdlib")
"""Of which any change may change what is formed."""
DESCRIBED = "runtime/interface.py"
"""What problems are described in, which is kept, too."""

Contents = tuple[dict[str, str], dict[str, bytes]]
"""Checksums of the files that were read, empty for those that were not there; stages by name."""


def compiled(request: Request) -> Compilation:
    """Compile what is asked for, or take what another process has formed. Raises CompileError."""
    return kept_or_formed(request) if request.remembered else form(request)


@functools.lru_cache(maxsize=8)
def compiled_once(request: Request) -> Compilation:
    """Compile what came from another process, once for all tasks that it sends. Raises CompileError."""
    return compiled(request)


def variant(compilation: Compilation, **changes: Any) -> Compilation:
    """Return the same model with other ``structural`` values, ``parts`` or ``formulas``. Raises CompileError."""
    own = replace(compilation.request, remembered=False)
    request, variants = replace(own, **changes), compilation.variants
    if request == own:
        return compilation
    variants.setdefault(own, compilation)
    if request not in variants:
        if compilation.derived:
            assert changes.keys() == {"parts"}, "no text says the rest"
            made = formed_of(compilation, compilation.flat, request.parts)
        else:
            again = compilation.request.remembered and changes.keys() == {"structural"}
            made = compiled(replace(request, remembered=again))
        made.variants = variants
        variants[request] = made
    return variants[request]


def form(request: Request) -> Compilation:
    """Form every stage. Raises CompileError."""
    from .pipeline import form

    return form(request)


def formed_of(compilation: Compilation, flat: FlatModel, parts: frozenset[str] = frozenset()) -> Compilation:
    """Return the compilation of a flat model that was made of this one's. Raises CompileError."""
    from .pipeline import compile_flat

    return compile_flat(compilation, flat, parts)


def kept_or_formed(request: Request) -> Compilation:
    """Return the kept compilation of a request, or form it and keep it."""
    from mechc.runtime.native.kept_files import find_entry

    from .flat.names.file_dependencies import collected

    asked = (
        request.source.name,
        request.source.text,
        [str(folder) for folder in request.search],
        request.model,
        request.structural,
        sorted(request.parts),
        request.formulas,
    )
    stem = f"stages-{_digest(repr((asked, _compiler_state())).encode())}"
    entry = find_entry(stem, SUFFIX)
    if entry is not None:
        stages = _read(entry)
        if stages is not None:
            return Compilation(request, stored=stages, stored_as=entry.name)
    with collected() as looked_for:
        formed = form(request)
    if not formed.diagnostics:
        _keep(stem, formed, looked_for)
    return formed


def _read(entry: Path) -> dict[str, bytes] | None:
    """Return the stages of an entry; None where a file has changed since."""
    files, stages = msgspec.msgpack.decode(entry.read_bytes(), type=Contents)
    return stages if all(_checksum(Path(path)) == sum for path, sum in files.items()) else None


def _keep(stem: str, compilation: Compilation, looked_for: Iterable[Path]) -> None:
    from mechc.runtime.native.kept_files import build_folder, find_entry, keep_entry

    files = {str(path): _checksum(path) for path in sorted(looked_for)}
    old = find_entry(stem, SUFFIX)
    with build_folder() as folder:
        file = folder / f"kept{SUFFIX}"
        file.write_bytes(msgspec.msgpack.encode((files, compilation.stages())))
        kept = keep_entry(file, stem, SUFFIX)
    if old is not None and old != kept:
        old.unlink(missing_ok=True)


def _checksum(path: Path) -> str:
    try:
        return _digest(path.read_bytes())
    except OSError:
        return ""


def _digest(content: bytes) -> str:
    return checksum(content).hexdigest()[:32]


def _compiler_state() -> list[tuple[str, int, int]]:
    """Return names, sizes and times of the compiler's own files, and the folders that imports are looked for in."""
    state = [(f"{sys.version}:{os.environ.get('MECHPATH', '')}:{Path.cwd()}", 0, 0)]
    pending = [str(Path(__file__).parent.parent / name) for name in PACKAGES]
    known = (Path(__file__).parent.parent / DESCRIBED).stat()
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
