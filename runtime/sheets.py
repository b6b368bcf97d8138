"""Tables in text files, as loggers and spreadsheets write them: what heads their columns, and the numbers below.

How a file separates columns and writes numbers is found by reading it in each of the ways there are (``_WAYS``): the file is read
in the one in which every cell below the heads is a number or missing. A file that can be read in two of them with different
numbers is refused with both; what fits none is refused with the first line that does not fit.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from io import StringIO
from pathlib import Path
from typing import NoReturn, TypeGuard

from msgspec import Struct
from msgspec.structs import replace

from .outcome import SimulationError


class NamedColumn(Struct, frozen=True):
    """What a column is: its head in the file, or its number from 1 on; its unit there, "" where the file says it; its name."""

    head: str
    unit: str
    name: str


class SheetReading(Struct, frozen=True):
    """How a file is to be read, where that is said; what is not said is recognised. ``skip``: lines to leave out at the top;
    ``headless``: the first row may hold numbers already, the columns are then numbered."""

    columns: tuple[NamedColumn, ...] = ()
    skip: int = 0
    separator: str | None = None
    decimal: str | None = None
    headless: bool = False


PLAIN = SheetReading()


class Sheet(Struct, frozen=True):
    """``heads``: name and unit ("": none is written) of each column; ``columns``: its numbers, not-a-number where a cell is empty;
    ``lines``: the line of the file on which each row stands. ``remarks``: how it was read, where that is not plain."""

    path: Path
    heads: tuple[tuple[str, str], ...]
    columns: tuple[list[float], ...]
    lines: list[int]
    remarks: tuple[str, ...] = ()
    from_file: bool = True

    def place(self, row: int) -> str:
        return f"{'line' if self.from_file else 'row'} {self.lines[row]} of {self.path}"

    def complete(self, column: int, name: str) -> list[float]:
        """Return a column whose cells all hold a number. Raises SimulationError."""
        values = self.columns[column]
        for row, value in enumerate(values):
            if value != value:
                raise SimulationError(
                    f"{self.place(row)} has no value of '{name}'", help="fill the gap, or leave its line out"
                )
        return values

    def without_repeats(self) -> Sheet:
        """Leave out rows that are equal to the row before them: loggers write a row twice."""
        rows = list(zip(*self.columns, strict=True))
        twice = {k for k in range(1, len(rows)) if _same(rows[k], rows[k - 1])}
        if not twice:
            return self
        kept = [k for k in range(len(rows)) if k not in twice]
        first = self.lines[min(twice)]
        said = f"line {first} of {self.path.name} repeats the row before it"
        if len(twice) > 1:
            said = (
                f"{len(twice)} rows of {self.path.name} repeat the row before them, the first in line {first}"
            )
        return replace(
            self,
            columns=tuple([values[k] for k in kept] for values in self.columns),
            lines=[self.lines[k] for k in kept],
            remarks=(*self.remarks, f"{said}: left out"),
        )


def _same(a: Sequence[float], b: Sequence[float]) -> bool:
    return all(x == y or (x != x and y != y) for x, y in zip(a, b, strict=True))


IsUnit = Callable[[str], bool]
_TIMES = frozenset(
    ("time", "times", "timestamp", "elapsed", "zeit", "temps", "tiempo", "tempo", "tid", "tijd")
)
"""What people call the time in a table, beside ``t``."""


def is_time(name: str) -> bool:
    """Whether a column of this name holds the time."""
    return name == "t" or name.casefold() in _TIMES


class _Way(Struct, frozen=True):
    """One way to write a table: what separates columns ("": blanks), and the sign before decimals."""

    separator: str
    decimal: str

    def __str__(self) -> str:
        called = f"columns separated by {SEPARATORS[self.separator]}"
        return called if self.decimal == "." else f"{called}, decimal commas"


SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", "": "blanks"}
_WAYS = [_Way(separator, decimal) for separator in SEPARATORS for decimal in ".,"]


class _Fault(Exception):
    """Why a file cannot be read in one way; ``good``: how many of its lines can be."""

    def __init__(self, message: str, good: int, help: str = "") -> None:
        super().__init__(message)
        self.message, self.good, self.help = message, good, help


class _Found(Struct, frozen=True):
    """What a file holds, read in one way."""

    way: _Way
    heads: tuple[tuple[str, str], ...]
    columns: tuple[list[float], ...]
    lines: list[int]
    cells: list[list[str]]
    said: tuple[str, ...]


def read_sheet(path: Path, reading: SheetReading = PLAIN, is_unit: IsUnit = lambda text: False) -> Sheet:
    """Read a table. ``is_unit`` tells a row of units from one of names. Raises SimulationError with file and line."""
    text, encoding = _text(path)
    below = text
    for _ in range(reading.skip):
        below = below.partition("\n")[2]
    if not below.strip():
        raise SimulationError(
            f"{path} is empty: it begins with a line such as 'time [s],x [mm]'"
            if not text.strip()
            else f"{path} has no line after the first {reading.skip}"
        )
    ways = [
        way
        for way in _WAYS
        if reading.separator in (None, way.separator)
        and reading.decimal in (None, way.decimal)
        and _possible(way, below, reading.decimal)
    ]
    found: list[_Found] = []
    faults: list[tuple[bool, int, _Fault]] = []
    # those in which the last line holds numbers; the others only tell what is wrong where these fail
    for way in sorted(ways, key=lambda way: not _ends_in_numbers(way, below)):
        if found and not _ends_in_numbers(way, below):
            break
        try:
            found.append(_read(path, below, reading.skip, way, reading, is_unit))
        except _Fault as fault:
            faults.append((bool(way.separator) and way.separator in below, fault.good, fault))
    for way in [way for way in ways if way.separator and not found]:
        with suppress(_Fault):  # the first pass says more
            found.append(_read(path, below, reading.skip, way, reading, is_unit, texts=True))
    if not found:
        if not faults:
            raise SimulationError(f"{path} has none of the separators or decimals that are asked for")
        *_, nearest = max(faults, key=lambda fault: fault[:2])  # the way in which most can be read
        raise SimulationError(nearest.message, help=nearest.help)
    first = found[0]
    for other in found[1:]:
        _refuse_two(path, first, other)
    said = (*([str(first.way)] if first.way != _WAYS[0] else []), *encoding, *first.said)
    remarks = (f"{path.name} is read as: {', '.join(said)}",) if said else ()
    return _named(Sheet(path, first.heads, first.columns, first.lines, remarks), reading)


_OTHERS = {
    b"PK\x03\x04": "a workbook or an archive",
    b"\xd0\xcf\x11\xe0": "a workbook",
    b"\x89HDF": "an HDF5 file",
    b"MATLAB 5": "a file of MATLAB",
    b"TDSm": "a TDMS file",
    b"<": "HTML or XML",
    b'{"': "JSON",
    b"[{": "JSON",
    b"[[": "JSON",
}
"""How files of other kinds begin."""


_VALUE = re.compile(r"[-+]?\.?\d[\d.eE+-]*( |$)|\{")
"""How a number, with or without its unit, and an array begin."""


def _text(path: Path) -> tuple[str, tuple[str, ...]]:
    """Return the text of a file, and its encoding if that is not UTF-8."""
    try:
        data = path.read_bytes()
    except OSError as error:
        help = "" if path.suffix == ".csv" else "several names are one text, with commas: --vary A,B"
        if _VALUE.match(str(path)):
            help = f'a value is not a table: --set NAME="{path}"'
        raise SimulationError(f"cannot read {path}: {error.strerror}", help=help) from error
    for begins, what in _OTHERS.items():
        if data.lstrip().startswith(begins):
            raise SimulationError(
                f"{path} is {what}, and no table in a text file", help="save it as CSV, with a line of heads"
            )
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        text = data.decode("utf-16" if wide else "utf-8-sig")
        said: tuple[str, ...] = ("UTF-16",) if wide else ()
    except UnicodeDecodeError as error:
        if wide:
            raise SimulationError(
                f"cannot read {path}: it begins as UTF-16 and goes on otherwise", help="save it as UTF-8"
            ) from error
        text, said = data.decode("cp1252", errors="replace"), ("Latin-1",)
    if "\0" in text:
        raise SimulationError(f"cannot read {path}: it is not a text", help="save it as UTF-8")
    return text.replace("\r\n", "\n").replace("\r", "\n").replace("\N{MINUS SIGN}", "-"), said


# ---------------------------------------------------------------- one way to read


def _possible(way: _Way, text: str, decimal: str | None) -> bool:
    """Whether a text may be written in a way, by the signs in it."""
    if way.decimal == "," and not decimal and "," not in text:
        return False
    if way.separator == way.decimal and '"' not in text:
        return False  # nothing would tell the two apart
    return way.separator in ",;" or way.separator in text


def _ends_in_numbers(way: _Way, text: str) -> bool:
    """Whether the last line that is not a comment is one of numbers."""
    import csv  # which a run without tables does without

    end = len(text)
    while end > 0:
        begin = text.rfind("\n", 0, end) + 1
        line = text[begin:end].strip()
        if line and line[0] not in "#%":
            cells = _words(line) if not way.separator else next(csv.reader([line], delimiter=way.separator))
            return _is_data([_PARSERS[way.decimal](cell.strip()) for cell in cells])
        end = begin - 1
    return False


def _read(
    path: Path,
    text: str,
    above: int,
    way: _Way,
    reading: SheetReading,
    is_unit: IsUnit,
    *,
    texts: bool = False,
) -> _Found:
    """Read a text in one way; with ``texts`` where some columns hold no number at all, without these. Raises _Fault."""
    rows, comments = _rows(path, text, above, way)
    parse = _PARSERS[way.decimal]
    whole, words = rows, list[int]()
    if texts:
        rows, words = _without_texts(rows, parse)
    numbers: list[list[float]] = []
    for _, cells in reversed(rows):
        row = [parse(cell) for cell in cells]
        if not _is_data(row):
            break
        numbers.append(row)
    numbers.reverse()
    data = rows[len(rows) - len(numbers) :]
    upper = [
        (line, cells, [parse(cell) for cell in cells]) for line, cells in rows[: len(rows) - len(numbers)]
    ]
    heads = _heads(path, upper, data, comments, is_unit, reading)
    width = len(heads.names)
    _check_names(path, way, heads)
    for (line, cells), values in zip(data, numbers, strict=True):
        if len(cells) < width or any(cells[width:]):
            if all(len(others) > width and others[width] for _, others in data):
                commas = way.separator == "," and all(len(others) == 2 * width for _, others in data)
                raise _Fault(
                    f"line {heads.line} of {path} has no name for column {width + 1}",
                    len(data),
                    "numbers with decimal commas are separated by other signs: save it with semicolons"
                    if commas
                    else "",
                )
            count = f"{len(cells)} cell{'s' if len(cells) != 1 else ''}"
            raise _Fault(f"line {line} of {path} has {count}, not {width}", len(data) - 1)
        del values[width:]
    if way.decimal == "," and not reading.decimal and not any("," in c for _, cells in data for c in cells):
        raise _Fault("no number has a decimal comma", 0)  # points alone are decimal points
    said = heads.said
    if texts:
        names = next(cells for line, cells in whole if line == heads.line)
        listed = ", ".join(names[k] for k in words if k < len(names))
        said += (f"columns of text left out: {listed}",)
    marks = {c for _, cells in data for c in cells if c in MISSING and c and c.casefold() != "nan"}
    if marks:
        said += (f"{' and '.join(map(repr, sorted(marks)))} for missing values",)
    return _Found(
        way,
        tuple(_head(path, heads, k, is_unit) for k in range(width)),
        tuple(map(list, zip(*numbers, strict=True))),
        [line for line, _ in data],
        [cells for _, cells in data],
        said,
    )


Row = tuple[int, list[str]]


def _without_texts(rows: list[Row], parse: Callable[[str], float | None]) -> tuple[list[Row], list[int]]:
    """Leave out the columns in which no row below the heads has a number, such as remarks and dates; the last row tells which, and
    two others remain. Raises _Fault where there are none."""
    last = [parse(cell) for cell in rows[-1][1]] if rows else []
    words = [k for k, value in enumerate(last) if value is None]
    if not words or sum(value is not None and value == value for value in last) < 2:
        raise _Fault("no column holds text alone", 0)
    kept = [
        (line, [cell for k, cell in enumerate(cells) if k not in words] if len(cells) == len(last) else cells)
        for line, cells in rows
    ]
    for (_, cells), (_, others) in zip(reversed(rows), reversed(kept), strict=True):
        if len(cells) != len(last) or not _is_data([parse(cell) for cell in others]):
            break
        if any(
            cells[k] not in MISSING and any(p(cells[k]) is not None for p in _PARSERS.values()) for k in words
        ):
            raise _Fault("a column holds text and numbers", 0)
    return kept, words


def _rows(path: Path, text: str, above: int, way: _Way) -> tuple[list[Row], list[Row]]:
    """Return the cells of all lines that are not blank, with the numbers of these lines; and those of comments."""
    rows: list[Row] = []
    comments: list[Row] = []
    for line, cells in _cells(path, text, above, way):
        if not any(cells):
            continue
        if cells[0][:1] in ("#", "%") and cells[0] not in MISSING:
            comments.append((line, [cells[0].lstrip("#% "), *cells[1:]]))
        else:
            rows.append((line, cells))
    return rows, comments


_WORD = re.compile(r'"[^"]*"|(?:\[[^\]]*\]|\([^)]*\)|[^\s"\[(])+(?:\s+[\[(][^\])]*[\])])?')
"""A cell between blanks; a unit in brackets belongs to the name before it."""


def _words(line: str) -> list[str]:
    return [word.strip('"') for word in _WORD.findall(line)]


def _cells(path: Path, text: str, above: int, way: _Way) -> Iterator[Row]:
    import csv

    if not way.separator:
        for line, words in enumerate(text.split("\n"), start=above + 1):
            yield line, _words(words)
        return
    reader = csv.reader(StringIO(text, newline=""), delimiter=way.separator, strict=True)
    line = above + 1
    try:
        for cells in reader:
            yield line, [cell.strip() for cell in cells]
            line = above + reader.line_num + 1
    except csv.Error as error:
        raise _Fault(f"cannot read line {line} of {path}: {error}", 0) from None


MISSING = frozenset(
    (
        "",
        "nan",
        "NaN",
        "NAN",
        "-nan",
        "-NaN",
        "NA",
        "N/A",
        "n/a",
        "#N/A",
        "#NA",
        "<NA>",
        "NULL",
        "null",
        "None",
    )
) | {"-", "--", "---"}
"""Cells that hold no number."""


def _is_data(row: Sequence[float | None]) -> TypeGuard[list[float]]:
    """Whether all cells of a row are numbers or missing, and at least one is a number."""
    return None not in row and any(value == value for value in row)


class _Heads(Struct, frozen=True):
    """What stands above the numbers: names, units ("" where they are none or stand in the names), the line of the names."""

    line: int
    names: list[str]
    units: list[str]
    said: tuple[str, ...] = ()


Upper = tuple[int, list[str], list[float | None]]


def _heads(
    path: Path,
    upper: list[Upper],
    data: list[Row],
    comments: list[Row],
    is_unit: IsUnit,
    reading: SheetReading,
) -> _Heads:
    """Find the names of columns above the numbers. Raises _Fault."""
    if not data:
        _refuse_empty(path, upper)
    width = max(len(_bare(cells)) for _, cells in data)
    if not upper:
        for line, cells in reversed(comments):  # as NumPy writes names
            if line < data[0][0] and len(cells) == width:
                return _Heads(line, cells, [""] * width, (f"heads in the comment of line {line}",))
        if reading.headless:
            return _Heads(data[0][0], [str(k + 1) for k in range(width)], [""] * width)
        numbered = [int(named.head) for named in reading.columns if named.head.isdecimal()]
        if numbered:
            if max(numbered) > width:
                raise _Fault(f"{path} has no column {max(numbered)}, it has {width}", len(data))
            return _Heads(data[0][0], [str(k + 1) for k in range(width)], [""] * width, ("no heads",))
        raise _Fault(
            f"line {data[0][0]} of {path} holds numbers alone: the first line names the columns, as in 'time [s],x [mm]'",
            len(data),
            'or say what they are: --columns "1 [s] = time, 2 [mm] = x"',
        )
    line, cells, values = upper[-1]
    _refuse_text(path, line, cells, values, len(data))
    names, units, at = _bare(cells), [""] * len(_bare(cells)), len(upper) - 1
    if at and _are_units(names, is_unit):
        above = _bare(upper[at - 1][1])
        if len(names) <= len(above) <= width and not _numbers(upper[at - 1][2]):
            units = [_unwrapped(cell) for cell in names] + [""] * (len(above) - len(names))
            names, at = above, at - 1
    for first, others, numbers in upper[:at]:
        if _is_data(numbers) and len(others) == width > 1:
            raise _Fault(
                f"line {upper[at][0]} of {path} names columns, and line {first} above it holds numbers already",
                len(data),
                f"--skip {upper[at][0] - 1} reads what stands below",
            )
    if number := next(
        (name for name in names for p in _PARSERS.values() if name and p(name) is not None), ""
    ):
        raise _Fault(f"line {upper[at][0]} of {path} has the number '{number}' instead of a name", 0)
    said: tuple[str, ...] = (f"heads in line {upper[at][0]}, what stands above left out",) if at else ()
    if at < len(upper) - 1:
        said += (f"units in line {line}",)
    return _Heads(upper[at][0], names, units, said)


def _refuse_empty(path: Path, upper: list[Upper]) -> NoReturn:
    """Say why no numbers stand at the end of a file. Raises _Fault."""
    for line, cells, values in upper[1:]:
        _refuse_text(path, line, cells, values, 0)
    if upper and any(_is_data(values) for _, _, values in upper):
        line, cells, _ = upper[-1]
        raise _Fault(f"line {line} of {path} holds '{cells[0]}' below the rows of numbers", 1, "leave it out")
    raise _Fault(f"{path} has no rows below its first line", 0)


def _refuse_text(path: Path, line: int, cells: list[str], values: list[float | None], good: int) -> None:
    """Refuse a row that holds numbers and what is none. Raises _Fault."""
    if _numbers(values) and None in values:
        cell = cells[values.index(None)]
        clock = re.search(r"\d:\d\d", cell)
        raise _Fault(
            f"line {line} of {path} holds '{cell}', which is not a finite number",
            good,
            "the time is a column of numbers, as in 'time [s]'" if clock else "",
        )


def _numbers(values: Sequence[float | None]) -> bool:
    return any(value is not None and value == value for value in values)


def _bare(cells: list[str]) -> list[str]:
    """Leave out empty cells at the end: the line ends with a separator."""
    end = len(cells)
    while end > 1 and not cells[end - 1]:
        end -= 1
    return cells[:end]


def _unwrapped(cell: str) -> str:
    text = cell[1:-1].strip() if cell[:1] + cell[-1:] in ("[]", "()") else cell
    return "" if text == "-" else text


def _are_units(cells: Sequence[str], is_unit: IsUnit) -> bool:
    texts = [_unwrapped(cell) for cell in cells]
    return any(texts) and all(not text or is_unit(text) for text in texts)


def _check_names(path: Path, way: _Way, heads: _Heads) -> None:
    """Refuse columns without a name, and names that hold what separates columns. Raises _Fault."""
    if unnamed := [k for k, name in enumerate(heads.names, start=1) if not name]:
        raise _Fault(f"line {heads.line} of {path} has no name for column {unnamed[0]}", 0)
    outside = [re.sub(r"\[[^\]]*\]", "", name) for name in heads.names]
    if (len(outside) == 1 or not way.separator) and any(set(name) & set(",;|\t") for name in outside):
        raise _Fault(f"line {heads.line} of {path} names more columns than there are numbers below it", 0)


_UNIT = re.compile(r"(.*?)\s*\[(?![0-9, ]+\])([^\[\]]*)\]")
"""A name and its unit; what holds numbers only is an index."""
_LOOSE = re.compile(r"(?!der\b)(\S.*?)\s*(?:\(([^()]+)\)|/\s*(\S+))")
"""A name with its unit in parentheses, or after a stroke."""


def header_of(cell: str, is_unit: IsUnit) -> tuple[str, str]:
    """Take ``torque [N.m]``, ``u[1] [N]`` and, where ``is_unit`` knows the unit, ``F (N)`` and ``F / N`` apart."""
    text = cell.strip()
    match = _UNIT.fullmatch(text)
    if match is None and text.count("[") != text.count("]"):
        raise SimulationError(f"a column is headed 'name [unit]', not '{text}'")
    name, unit = match.groups() if match else (text, "")
    if match is None and (loose := _LOOSE.fullmatch(text)) and is_unit((loose[2] or loose[3]).strip()):
        name, unit = loose[1], loose[2] or loose[3]
    return "".join(name.split()), unit.strip()


def _head(path: Path, heads: _Heads, k: int, is_unit: IsUnit) -> tuple[str, str]:
    try:
        name, unit = header_of(heads.names[k], is_unit)
    except SimulationError as error:
        raise _Fault(f"line {heads.line} of {path}: {error.message}", 1) from None
    return name, unit or heads.units[k]


# ---------------------------------------------------------------- numbers


def _value(text: str) -> float | None:
    """Return the number that a cell holds, not-a-number for a missing one; None for anything else, as for the ``1_0`` of Python."""
    try:
        value = float(text)
    except ValueError:
        if text in MISSING:
            return float("nan")
        if _APART.fullmatch(text):
            return _value(_BETWEEN.sub("", text))
        return float(text.replace(",", "")) if _COMMAS.fullmatch(text) else None
    return None if "_" in text or not text.isascii() or abs(value) == float("inf") else value


_BETWEEN = re.compile(
    "[ '\N{NO-BREAK SPACE}\N{THIN SPACE}\N{NARROW NO-BREAK SPACE}\N{RIGHT SINGLE QUOTATION MARK}]"
)
"""What may stand between thousands and means nothing else."""
_APART = re.compile(rf"[+-]?\d{{1,3}}(?:{_BETWEEN.pattern}\d{{3}})+(?:[.,]\d*)?", re.ASCII)
_COMMAS = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+(?:\.\d*)?", re.ASCII)
_CONTINENTAL = re.compile(r"[+-]?(?:\d+|\d{1,3}(?:\.\d{3})+)?(?:,\d*)?(?:[eE][+-]?\d+)?", re.ASCII)


def _continental(text: str) -> float | None:
    """Return the number of a cell with a decimal comma; points may stand between thousands."""
    if text in MISSING:
        return float("nan")
    if _APART.fullmatch(text):
        text = _BETWEEN.sub("", text)
    return _value(text.replace(".", "").replace(",", ".")) if _CONTINENTAL.fullmatch(text) else None


_PARSERS: Mapping[str, Callable[[str], float | None]] = {".": _value, ",": _continental}


def _refuse_two(path: Path, a: _Found, b: _Found) -> None:
    """Refuse a file that two ways read, with different numbers."""
    if a.heads == b.heads and len(a.lines) == len(b.lines):
        for k, name in enumerate(a.heads):
            for row, (x, y) in enumerate(zip(a.columns[k], b.columns[k], strict=True)):
                if not _same([x], [y]):
                    raise SimulationError(
                        f"line {a.lines[row]} of {path} holds '{a.cells[row][k]}' for '{name[0]}', which is {x:.12g} "
                        f"({_signs(a.way)}) or {y:.12g} ({_signs(b.way)})",
                        help='say which sign stands before decimals: --decimal "." or --decimal ","',
                    )
        return
    raise SimulationError(
        f"{path} can be read in two ways: {len(a.heads)} {a.way}, or {len(b.heads)} {b.way}",
        help='say which: --separator ";" --decimal ","',
    )


def _signs(way: _Way) -> str:
    return "with a decimal point" if way.decimal == "." else "with a decimal comma"


# ---------------------------------------------------------------- names that are given


def _named(sheet: Sheet, reading: SheetReading) -> Sheet:
    """Give columns the names that the caller has for them. Raises SimulationError."""
    heads = list(sheet.heads)
    for asked in reading.columns:
        k = _column(sheet, asked)
        name, unit = sheet.heads[k]
        if asked.unit and unit and asked.unit != unit:
            raise SimulationError(f"the column '{name}' of {sheet.path} is in {unit}, not in {asked.unit}")
        heads[k] = asked.name, unit or asked.unit
    return replace(sheet, heads=tuple(heads))


def _column(sheet: Sheet, asked: NamedColumn) -> int:
    names = [name for name, _ in sheet.heads]
    for same in (str.strip, str.casefold):
        found = [k for k, name in enumerate(names) if same(name) == same("".join(asked.head.split()))]
        if len(found) == 1:
            return found[0]
        if found:
            raise SimulationError(
                f"{sheet.path} has {len(found)} columns '{asked.head}'",
                help=f'name one by its number: --columns "{found[0] + 1} = {asked.name}"',
            )
    if asked.head.isdecimal() and 1 <= int(asked.head) <= len(names):
        return int(asked.head) - 1
    there = ", ".join(f"'{name}'" for name in names)
    raise SimulationError(f"{sheet.path} has no column '{asked.head}'; it has {there}")


def units_apart(units: Sequence[tuple[str, Mapping[str, str]]]) -> list[str]:
    """Say which columns have a unit in one file and none in another. ``units``: those of each file, by column."""
    found: list[str] = []
    for name in dict.fromkeys(name for _, columns in units for name in columns):
        having = [(source, columns[name]) for source, columns in units if name in columns]
        stated = [(source, unit) for source, unit in having if unit]
        bare = [source for source, unit in having if not unit]
        if stated and bare:
            source, unit = stated[0]
            found.append(
                f"the column '{name}' is in {unit} in {source}; {bare[0]} gives it no unit and is read in SI"
            )
    return found
