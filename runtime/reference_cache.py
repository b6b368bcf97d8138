"""References kept in the cache by the content of what they were made from: code, kernel, case and effort."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from .cache import BUILD_PREFIX, cache_folder, mark_used, prune_cache
from .case import Case
from .problem import Array
from .reference import LADDERS, SHORT_LADDERS, Reference, reference_library

ARRAYS = ("t", "high", "low", "doubt", "nominal")


def kept_reference(
    library: Path,
    case: Case,
    nominal: Array,
    times: Array,
    *,
    precision: str,
    method: str,
    seconds: float,
    make: Callable[[], Reference],
) -> Reference:
    """Return the reference of a case, made anew if the cache has none that was made with the same effort.

    ``library`` is named after its content, and so is the kernel. Raises what ``make`` raises.
    """
    digest = hashlib.sha256()
    names = (
        library.name,
        reference_library(precision).name,
        precision,
        method,
        repr(seconds),
        repr((LADDERS[method], SHORT_LADDERS[method])),
    )
    numbers = (case.begin, case.stop, case.max_step)
    for text in (*names, *map(repr, numbers)):
        digest.update(text.encode() + b"\0")
    for array in (case.y0, case.z, case.p, nominal, times):
        digest.update(np.ascontiguousarray(array, dtype=float).tobytes() + b"\0")
    for index, table in sorted(case.tables.items()):
        digest.update(repr((index, table)).encode() + table.kinks().tobytes())
    file = cache_folder() / f"reference-{digest.hexdigest()[:32]}.npz"
    if file.is_file():
        mark_used(file)
        return _read(file)
    made = make()
    _write(file, made)
    prune_cache()
    return made


def _read(file: Path) -> Reference:
    with np.load(file) as held:
        arrays = {name: held[name] for name in ARRAYS}
        plain = {name: held[name].item() for name in Reference.__struct_fields__ if name not in ARRAYS}
    return replace(Reference(**arrays, **plain), cached=True)


def _write(file: Path, made: Reference) -> None:
    """Write to a temporary name and rename: two processes may make the same reference at once."""
    values = {name: np.asarray(getattr(made, name)) for name in Reference.__struct_fields__}
    handle, name = tempfile.mkstemp(prefix=BUILD_PREFIX, suffix=".npz", dir=file.parent)
    try:
        with os.fdopen(handle, "wb") as out:
            np.savez(out, allow_pickle=False, **values)
        os.replace(name, file)
    finally:
        Path(name).unlink(missing_ok=True)
