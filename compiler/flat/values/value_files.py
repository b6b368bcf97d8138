"""Numbers in files: tables of text (CSV), NumPy's NPZ and NPY, Matrix Market.

What a file leaves in doubt is refused: empty cells, rows of different lengths, several arrays without a name. In a table
of text the first row may name the columns, with units in brackets: ``force [N]``.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from msgspec import Struct

from mechc.suggest import closest

_HEAD = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?")


class Numbers(Struct, frozen=True):
    """``values`` in row-major order, of an array of a shape; ``unit`` of all of them, where the file says it."""

    values: tuple[Fraction, ...]
    shape: tuple[int, ...]
    unit: str = ""


class NoNumbers(ValueError):
    """A file that does not hold what is asked for; ``help`` says what to do."""

    def __init__(self, words: str, help: str = "") -> None:
        super().__init__(words)
        self.help = help


def numbers(data: bytes, kind: str, name: str) -> Numbers:
    """Return the array or the column ``name`` of a file of a kind in ``READERS``; all of it without a name. Raises NoNumbers."""
    return READERS[kind](data, name)


# ---------------------------------------------------------------- tables of text


def _table(data: bytes, name: str) -> Numbers:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise NoNumbers("it is no text in UTF-8", "save it as UTF-8") from None
    rows = [
        (k, line)
        for k, line in enumerate(text.splitlines(), 1)
        if line.strip() and line.strip()[0] not in "#%"
    ]
    if not rows:
        raise NoNumbers("it is empty")
    sign = next((s for s in ";\t," if s in rows[0][1]), None)
    cells = [(k, [c.strip().strip('"') for c in line.split(sign)]) for k, line in rows]
    head: list[str] = []
    if any(not _NUMBER.fullmatch(c) for c in cells[0][1]):
        head = cells.pop(0)[1]
        if not cells:
            raise NoNumbers("it has a head and no numbers")
    width = len(head or cells[0][1])
    found = [_row(k, row, width) for k, row in cells]
    return _columns(head, found, name)


def _row(line: int, cells: Sequence[str], width: int) -> list[Fraction]:
    if len(cells) != width:
        raise NoNumbers(f"line {line} has {len(cells)} cells, the first one has {width}")
    found = []
    for k, cell in enumerate(cells):
        if not cell:
            raise NoNumbers(f"line {line} has an empty cell, its number {k + 1}")
        if not _NUMBER.fullmatch(cell):
            comma = "a decimal point is '.'" if "," in cell else ""
            raise NoNumbers(f"line {line}: '{cell}' is no number", comma)
        found.append(Fraction(re.sub("[dD]", "e", cell)))
    return found


def _columns(head: Sequence[str], rows: Sequence[Sequence[Fraction]], name: str) -> Numbers:
    """Return one column by its name, or all; a single one is a vector."""
    matches = [_HEAD.fullmatch(cell) for cell in head]
    names = [m["name"] if m else "" for m in matches]
    units = [(m["unit"] or "") if m else "" for m in matches]
    if name and name not in names:
        if not head:
            raise NoNumbers("its columns have no names", "its first row may name them")
        near = closest(name, names)
        told = f"did you mean '{near}'?" if near else f"it has {', '.join(names)}"
        raise NoNumbers(f"it has no column '{name}'", told)
    if name and names.count(name) > 1:
        raise NoNumbers(f"it has {names.count(name)} columns '{name}'")
    chosen = [names.index(name)] if name else list(range(len(rows[0])))
    own = {units[k] for k in chosen} if units else {""}
    if len(own) > 1:
        raise NoNumbers("its columns have different units", 'name one: \'file("..", "column")\'')
    values = tuple(row[k] for row in rows for k in chosen)
    shape = (len(rows),) if len(chosen) == 1 else (len(rows), len(chosen))
    return Numbers(values, shape, own.pop())


# ---------------------------------------------------------------- arrays


def _npz(data: bytes, name: str) -> Numbers:
    import numpy as np

    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            names = list(arrays)
            if not name and len(names) != 1:
                told = f'name one: \'file("..", "{names[0]}")\'' if names else ""
                raise NoNumbers(f"it holds {len(names)} arrays: {', '.join(names)}", told)
            if name and name not in names:
                near = closest(name, names)
                told = f"did you mean '{near}'?" if near else f"it has {', '.join(names)}"
                raise NoNumbers(f"it has no array '{name}'", told)
            return _array(arrays[name or names[0]])
    except NoNumbers:
        raise
    except Exception:  # whatever is wrong with the bytes
        raise NoNumbers("it is no NPZ file of numbers") from None


def _npy(data: bytes, name: str) -> Numbers:
    import numpy as np

    _unnamed(name)
    try:
        found = np.load(io.BytesIO(data), allow_pickle=False)
    except Exception:  # whatever is wrong with the bytes
        raise NoNumbers("it is no NPY file of numbers") from None
    return _array(found)


def _matrix_market(data: bytes, name: str) -> Numbers:
    from scipy.io import mmread

    _unnamed(name)
    try:
        found = mmread(io.BytesIO(data))
    except Exception:  # whatever is wrong with the text
        raise NoNumbers("it is no Matrix Market file") from None
    return _array(found.toarray() if hasattr(found, "toarray") else found)


def _unnamed(name: str) -> None:
    if name:
        raise NoNumbers(f"it holds one array, which has no name '{name}'", "leave the name out")


def _array(found: Any) -> Numbers:
    import numpy as np

    if found.dtype.kind not in "fiu":
        what = {"c": "complex numbers", "b": "truth values"}.get(found.dtype.kind, "no numbers")
        raise NoNumbers(f"it holds {what}")
    if not np.isfinite(found).all():
        raise NoNumbers("it holds numbers that are not finite")
    return Numbers(tuple(map(Fraction, found.ravel().tolist())), found.shape)


READERS: Mapping[str, Callable[[bytes, str], Numbers]] = {
    ".csv": _table,
    ".txt": _table,
    ".dat": _table,
    ".npz": _npz,
    ".npy": _npy,
    ".mtx": _matrix_market,
}
"""How files are read, by the end of their names."""
