"""Numbers in files: tables of text (CSV), NumPy's NPZ and NPY, Matrix Market.

What a file leaves in doubt is refused: empty cells, rows of different lengths, several arrays without a name. Tables of text are
read as measured ones are (runtime/sheets.py); their first row may hold numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from msgspec import Struct

from mechc.runtime.outcome import SimulationError
from mechc.runtime.sheets import SheetReading, read_sheet
from mechc.suggest import closest


class FileNumbers(Struct, frozen=True):
    """``values`` in row-major order, of an array of a shape; ``unit`` of all of them, where the file says it."""

    values: tuple[Fraction, ...]
    shape: tuple[int, ...]
    unit: str = ""


class NoNumbers(ValueError):
    """A file that does not hold what is asked for; ``help`` says what to do."""

    def __init__(self, words: str, help: str = "") -> None:
        super().__init__(words)
        self.help = help


def numbers(path: Path, name: str) -> FileNumbers:
    """Return the array or the column ``name`` of a file of a kind in ``READERS``; all of it without a name. Raises NoNumbers."""
    return READERS[path.suffix.casefold()](path, name)


# ---------------------------------------------------------------- tables of text


def _table(path: Path, name: str) -> FileNumbers:
    """Return one column by its name, or all; a single one is a vector. Numbers are those of the shortest decimals of doubles."""
    try:
        sheet = read_sheet(path, SheetReading(headless=True, decimal="."))
        names = [head for head, _ in sheet.heads]
        if name and name not in names:
            near = closest(name, names)
            told = (
                f"did you mean '{near}'?"
                if near
                else f"it has {', '.join(names)}; its first row may name columns"
            )
            raise NoNumbers(f"it has no column '{name}'", told)
        if name and names.count(name) > 1:
            raise NoNumbers(f"it has {names.count(name)} columns '{name}'")
        chosen = [names.index(name)] if name else list(range(len(names)))
        units = {sheet.heads[k][1] for k in chosen}
        if len(units) > 1:
            raise NoNumbers("its columns have different units", 'name one: \'file("..", "column")\'')
        columns = [[Fraction(repr(x)) for x in sheet.complete(k, names[k])] for k in chosen]
    except SimulationError as error:
        raise NoNumbers(str(error), error.help or "") from None
    rows = len(sheet.lines)
    values = tuple(column[row] for row in range(rows) for column in columns)
    return FileNumbers(values, (rows,) if len(chosen) == 1 else (rows, len(chosen)), units.pop())


# ---------------------------------------------------------------- arrays


def _npz(path: Path, name: str) -> FileNumbers:
    import numpy as np

    try:
        with np.load(path, allow_pickle=False) as arrays:
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
        raise NoNumbers("it is not an NPZ file of numbers") from None


def _npy(path: Path, name: str) -> FileNumbers:
    import numpy as np

    _unnamed(name)
    try:
        found = np.load(path, allow_pickle=False)
    except Exception:  # whatever is wrong with the bytes
        raise NoNumbers("it is not an NPY file of numbers") from None
    return _array(found)


def _matrix_market(path: Path, name: str) -> FileNumbers:
    from scipy.io import mmread

    _unnamed(name)
    try:
        found = mmread(path)
    except Exception:  # whatever is wrong with the text
        raise NoNumbers("it is not a Matrix Market file") from None
    return _array(found.toarray() if hasattr(found, "toarray") else found)


def _unnamed(name: str) -> None:
    if name:
        raise NoNumbers(f"it holds one array, which has no name '{name}'", "leave the name out")


def _array(found: Any) -> FileNumbers:
    import numpy as np

    if found.dtype.kind not in "fiu":
        what = {"c": "complex numbers", "b": "truth values"}.get(found.dtype.kind, "no numbers")
        raise NoNumbers(f"it holds {what}")
    if not np.isfinite(found).all():
        raise NoNumbers("it holds numbers that are not finite")
    return FileNumbers(tuple(map(Fraction, found.ravel().tolist())), found.shape)


READERS: Mapping[str, Callable[[Path, str], FileNumbers]] = {
    ".csv": _table,
    ".txt": _table,
    ".dat": _table,
    ".npz": _npz,
    ".npy": _npy,
    ".mtx": _matrix_market,
}
"""How files are read, by the end of their names."""
