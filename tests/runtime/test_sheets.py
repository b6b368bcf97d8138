"""Tables as loggers and spreadsheets write them: each read as the text says, or refused with what it could mean."""

from __future__ import annotations

import csv
import time
from pathlib import Path

import pytest

from mechc.runtime.outcome import SimulationError
from mechc.runtime.sheets import NamedColumn, Sheet, SheetReading, read_sheet

AS_IT_IS = SheetReading()
UNITS = {"s", "ms", "deg", "m", "mm", "N", "kN", "°"}


def read(folder: Path, data: str | bytes, reading: SheetReading = AS_IT_IS) -> Sheet:
    path = folder / "log.csv"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_sheet(path, reading, UNITS.__contains__)


PLAIN = "time [s],x [mm]\n0,10.5\n0.5,-1250\n"
SAME = {
    "plain": PLAIN,
    "mark of bytes": "\ufeff" + PLAIN,
    "Windows": PLAIN.replace("\n", "\r\n"),
    "old Macintosh": PLAIN.replace("\n", "\r"),
    "UTF-16": PLAIN.encode("utf-16"),
    "semicolons": "time [s];x [mm]\n0;10,5\n0,5;-1250\n",
    "semicolons and points": "time [s];x [mm]\n0;10.5\n0.5;-1250\n",
    "tabs": "time [s]\tx [mm]\n0\t10.5\n0.5\t-1250\n",
    "tabs and commas": "time [s]\tx [mm]\n0\t10,5\n0,5\t-1250\n",
    "bars": "time [s] | x [mm]\n0 | 10.5\n0.5 | -1250\n",
    "blanks": "  time [s]   x [mm]\n  0.0  10.5\n  0.5 -1250\n",
    "blanks and decimal commas": "time [s] x [mm]\n0,0 10,5\n0,5 -1250\n",
    "points between thousands": "time [s];x [mm]\n0;10,5\n0,5;-1.250,0\n",
    "commas between thousands": 'time [s];x [mm]\n0;10.5\n0.5;"-1,250.0"\n',
    "blanks between thousands": "time [s];x [mm]\n0;10,5\n0,5;-1 250,0\n",
    "fixed blanks between thousands": "time [s],x [mm]\n0,10.5\n0.5,-1\u202f250\n",
    "apostrophes between thousands": "time [s],x [mm]\n0,10.5\n0.5,-1'250.0\n",
    "minus signs": "time [s],x [mm]\n0,10.5\n0.5,\u22121250\n",
    "quoted decimal commas": 'time [s],x [mm]\n0,"10,5"\n"0,5",-1250\n',
    "quoted": '"time [s]","x [mm]"\n"0","10.5"\n"0.5","-1250"\n',
    "trailing separators": "time [s],x [mm],\n0,10.5,\n0.5,-1250,\n",
    "trailing separators below": "time [s],x [mm]\n0,10.5,\n0.5,-1250,\n",
    "trailing separators above": "time [s],x [mm],,\n0,10.5\n0.5,-1250\n",
    "parentheses": "time (s),x (mm)\n0,10.5\n0.5,-1250\n",
    "strokes": "time / s;x/mm\n0;10,5\n0,5;-1250\n",
    "row of units": "time,x\ns,mm\n0,10.5\n0.5,-1250\n",
    "row of units in brackets": "time;x\n[s];[mm]\n0;10,5\n0,5;-1250\n",
    "comments": "# by a logger\n% rate; 2 Hz\n" + PLAIN + "# end\n",
    "heads of NumPy": "# " + PLAIN,
    "lines above": "Logger 7;\nSerial;1234-5\n\nRate [Hz];2\n\ntime [s];x [mm]\n0;10,5\n0,5;-1250\n",
    "lines above and units": "Logger 7\nRate;2\nOperator;MM\nNotes\nt;x\ns;mm\n0;10,5\n0,5;-1250\n".replace(
        "t;", "time;"
    ),
}


@pytest.mark.parametrize("text", SAME.values(), ids=SAME.keys())
def test_one_table_in_many_ways(tmp_path: Path, text: str | bytes) -> None:
    sheet = read(tmp_path, text)
    assert sheet.heads == (("time", "s"), ("x", "mm"))
    assert sheet.columns == ([0.0, 0.5], [10.5, -1250.0])
    raw = text if isinstance(text, str) else text.decode("utf-16")
    line = raw.replace("\r\n", "\n").replace("\r", "\n").split("\n")[sheet.lines[-1] - 1]
    assert "1" in line and "250" in line


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PLAIN, []),
        ("time [s];x [mm]\n0;10,5\n", ["semicolons", "decimal commas"]),
        (
            "Logger\n\ntime;x\ns;mm\n0;1.5\n",
            ["heads in line 3, what stands above left out", "units in line 4"],
        ),
        ("time [s],x [°]\n0,1.5\n".encode("latin-1"), ["Latin-1"]),
        ("time,x\n0,1\n1,N/A\n2,-\n", ["'-' and 'N/A' for missing values"]),
    ],
)
def test_what_was_recognised_is_said_in_one_line(tmp_path: Path, text: str | bytes, said: list[str]) -> None:
    remarks = read(tmp_path, text).remarks
    assert len(remarks) == bool(said)
    assert all(one in remarks[0] for one in said)


def test_columns_of_text_are_left_out(tmp_path: Path) -> None:
    text = "Datum;Zeit [s];x [mm];Status\n28.11.2026 10:00;0,0;10,5;OK\n28.11.2026 10:01;0,5;-1250;\n28.11.2026 10:01;1;2;OK\n"
    sheet = read(tmp_path, text)
    assert sheet.heads == (("Zeit", "s"), ("x", "mm"))
    assert sheet.columns == ([0.0, 0.5, 1.0], [10.5, -1250.0, 2.0])
    assert "columns of text left out: Datum, Status" in sheet.remarks[0]
    with pytest.raises(SimulationError, match=r"line 2 of .* holds '3,x'"):  # numbers and text: a mistake
        read(tmp_path, "time;x;y\n1;2;3,x\n2;3;4,5\n")


TWO = [
    # both readings, as they are named
    ("time;x\n1;1,234\n2;5,678\n", "line 2 of .* holds '1,234' for 'x', which is 1234 .* or 1.234 "),
    ("time\tx\n1\t12,000\n", "which is 12000 .* or 12 "),
    ("time;x\n1.500;1,234\n", "holds '1.500' for 'time', which is 1.5 .* or 1500 "),
    ('time,x\n1,"1,234"\n', "which is 1234 .* or 1.234 "),
    ("x [m]\n1,234\n", "which is 1234 .* or 1.234 "),
]


@pytest.mark.parametrize(("text", "message"), TWO)
def test_two_readings_are_refused_with_both(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SimulationError, match=message) as refused:
        read(tmp_path, text)
    assert "--decimal" in refused.value.help
    found = {sign: read(tmp_path, text, SheetReading(decimal=sign)).columns[-1][0] for sign in ".,"}
    assert found["."] != found[","]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,x\n0,1\n0.1,1,5\n", "line 3 of .* has 3 cells, not 2"),
        ("time,x\n0,5,1,25\n", "line 1 of .* has no name for column 3"),
        ("time;x\n0;1\n1;2\nEnd of file\n", "line 4 of .* holds 'End of file' below the rows of numbers"),
        (
            "time,x\n0,1\n1,2\ntime,x\n0,3\n1,4\n",
            "line 4 of .* names columns, and line 2 above it holds numbers",
        ),
        ("time,x\n12:00:01,1\n12:00:02,2\n", "line 2 of .* holds '12:00:01', which is not a finite number"),
        ("time,x\n0,1\n1,1.5 mm\n2,3\n", "line 3 of .* holds '1.5 mm', which is not a finite number"),
        ("time,x,x\n0,1,2\n", ""),
        ("time,x\n0,1\n0.5\n1,3\n", "line 3 of .* has 1 cell, not 2"),
        ("<table><tr><td>1</td></tr></table>\n", "is HTML or XML, and no table"),
        ('[{"time": 0, "x": 1}]\n', "is JSON, and no table"),
        ("PK\x03\x04\x14\n", "is a workbook or an archive"),
        ("time,,x\n0,1,2\n", "line 1 of .* has no name for column 2"),
        ("only words\nand more\n", "has no rows below"),
    ],
)
def test_wrong_tables(tmp_path: Path, text: str, message: str) -> None:
    if not message:
        assert len(read(tmp_path, text).heads) == 3
        return
    with pytest.raises(SimulationError, match=message):
        read(tmp_path, text)


def named(*columns: tuple[str, str, str], **more: object) -> SheetReading:
    return SheetReading(columns=tuple(NamedColumn(*one) for one in columns), **more)  # type: ignore[arg-type]


def test_columns_are_named_by_their_heads_or_numbers(tmp_path: Path) -> None:
    text = "Zeit;Kraft [kN];Weg;Weg\n0;1,5;2;3\n"
    sheet = read(
        tmp_path, text, named(("kraft", "kN", "force"), ("Zeit", "s", "time"), ("4", "mm", "stroke"))
    )
    assert sheet.heads == (("time", "s"), ("force", "kN"), ("Weg", ""), ("stroke", "mm"))
    bare = read(tmp_path, "0,1\n1,2\n", named(("1", "s", "time"), ("2", "m", "x")))
    assert bare.heads == (("time", "s"), ("x", "m")) and bare.columns == ([0, 1], [1, 2])
    for reading, message in (
        (named(("Weg", "", "stroke")), "has 2 columns 'Weg'"),
        (named(("Krft", "", "force")), "has no column 'Krft'; it has 'Zeit', 'Kraft', 'Weg', 'Weg'"),
        (named(("Kraft", "N", "force")), "'Kraft' of .* is in kN, not in N"),
        (named(("9", "", "force")), "has no column '9'"),
    ):
        with pytest.raises(SimulationError, match=message):
            read(tmp_path, text, reading)


def test_lines_and_signs_that_are_asked_for(tmp_path: Path) -> None:
    text = "1;2\n3;4\ntime;x\n5;6\n"
    with pytest.raises(
        SimulationError, match="names columns, and line 1 above it holds numbers already"
    ) as refused:
        read(tmp_path, text)
    assert "--skip 2" in refused.value.help
    sheet = read(tmp_path, text, SheetReading(skip=2))
    assert sheet.columns == ([5], [6]) and sheet.lines == [4]
    with pytest.raises(SimulationError, match="has no line after the first 9"):
        read(tmp_path, text, SheetReading(skip=9))
    with pytest.raises(SimulationError, match="has no rows below"):
        read(tmp_path, text, SheetReading(skip=2, separator=","))


def test_rows_that_loggers_write_twice(tmp_path: Path) -> None:
    sheet = read(tmp_path, "time,x\n0,1\n1,\n1,\n2,3\n2,4\n").without_repeats()
    assert sheet.columns[0] == [0, 1, 2, 2] and sheet.lines == [2, 3, 5, 6]
    assert "line 4 of log.csv repeats the row before it" in sheet.remarks[-1]


@pytest.mark.slow
def test_a_hundred_thousand_rows(tmp_path: Path) -> None:
    """Beside the reader of the standard library, with numbers: at most eight times as long."""
    path = tmp_path / "road.csv"
    path.write_text(
        "time;x\n" + "".join(f"{k / 1000:.3f};{k % 77 / 7:.6f}\n".replace(".", ",") for k in range(100_000))
    )
    begun = time.process_time()
    with path.open() as file:
        rows = [
            [float(cell.replace(",", ".")) for cell in row]
            for row in list(csv.reader(file, delimiter=";"))[1:]
        ]
    plain = time.process_time() - begun
    begun = time.process_time()
    sheet = read_sheet(path)
    taken = time.process_time() - begun
    assert sheet.columns[1] == [row[1] for row in rows]
    assert taken < 8 * plain
