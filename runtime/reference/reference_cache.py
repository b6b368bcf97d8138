"""References kept in the cache by the content of what they were made from: code, kernel, case and effort."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from ..case import Case
from ..native.cache import prune_when_due
from ..native.kept_files import build_folder, find_entry, keep_entry
from ..problem import Array
from .high_precision import LADDERS, SHORT_LADDERS, PrecisionReference, reference_library

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
    make: Callable[[], PrecisionReference],
) -> PrecisionReference:
    """Return the reference of a case, made again if the cache has none that was made with the same effort.

    ``library`` is named after its content, and so is the kernel. Raises what ``make`` raises.
    """
    digest = hashlib.sha256()
    names = (
        library.name,
        reference_library(precision).name,
        precision,
        method,
        repr(seconds),
        repr((LADDERS[method], SHORT_LADDERS.get(method))),
    )
    numbers = (case.begin, case.stop, case.max_step)
    for text in (*names, *map(repr, numbers)):
        digest.update(text.encode() + b"\0")
    for array in (case.y0, case.z, case.p, nominal, times):
        digest.update(np.ascontiguousarray(array, dtype=float).tobytes() + b"\0")
    for index, table in sorted(case.tables.items()):
        digest.update(repr((index, table)).encode() + table.kinks().tobytes())
    stem = f"reference-{digest.hexdigest()[:32]}"
    kept = find_entry(stem, ".npz")
    if kept is not None:
        return _read(kept)
    made = make()
    try:
        _write(stem, made)
        prune_when_due()
    except OSError as error:  # a full disk must not cost what took so long
        warnings.warn(f"the reference is not kept: {error}", RuntimeWarning, stacklevel=1)
    return made


def _read(file: Path) -> PrecisionReference:
    with np.load(file) as held:
        arrays = {name: held[name] for name in ARRAYS}
        plain = {
            name: held[name].item() for name in PrecisionReference.__struct_fields__ if name not in ARRAYS
        }
    return replace(PrecisionReference(**arrays, **plain), cached=True)


def _write(stem: str, made: PrecisionReference) -> None:
    values = {name: np.asarray(getattr(made, name)) for name in PrecisionReference.__struct_fields__}
    with build_folder() as folder:
        file = folder / "built.npz"
        np.savez(file, allow_pickle=False, **values)
        keep_entry(file, stem, ".npz")
