"""A file of results for a run whose points nobody keeps in memory: its rows lie in files beside it, and CSV is written while the
run goes on."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np

from ..case import Case
from ..problem import Array
from ..rows import AT_ONCE, Scratch, passed
from .evaluate import Table
from .files import check_format, csv_lines
from .quantities import Display, header

if TYPE_CHECKING:
    from .solution import Solution


class Streamed:
    """Results in the file ``path``, by the end of its name: of all quantities or of ``names``, in the units of ``display``.

    CSV is a row after the other, and grows with the run. NPZ and JSON hold a column after the other and the report: they are
    written after the run, a slice of a column at a time. What is written so far stays where a run is interrupted or fails.
    """

    def __init__(
        self, path: Path, names: Sequence[str] | None = None, display: Display | None = None
    ) -> None:
        check_format(path)
        self.path, self._names, self._display = path, names, display
        self.storage = Scratch(path.parent)
        self._by_rows = path.suffix.lower() == ".csv"
        self._file: TextIO | None = None
        self._case: Case | None = None
        self._of = 0
        self._count = 0

    def begin(self, case: Case, y: Array) -> None:
        """Begin the file for the run whose states will be ``y``: again, where the run before is repeated."""
        if not self._by_rows:
            return
        self._close()
        self._case, self._of, self._count = case, y.ctypes.data, 0
        problem = case.problem
        listed = (*problem.states, *problem.outputs, *problem.inputs)
        listed += tuple(q for q in problem.discretes if q.kind != "mode")
        column = {quantity.name: k for k, quantity in enumerate(listed)}
        chosen = [("time", problem.time.unit)]
        chosen += [(name, listed[column[name]].unit) for name in self._names or column]
        shown = [self._display(*one) if self._display else (one[1], 1.0) for one in chosen]
        self._columns = [column[name] for name, _ in chosen[1:]]
        self._factors = np.array([factor for _, factor in shown])
        self._file = self.path.open("w", newline="", encoding="utf-8")
        heads = [header(name, unit) for (name, _), (unit, _) in zip(chosen, shown, strict=True)]
        csv.writer(self._file, lineterminator="\n").writerow(heads)

    def follow(self, t: Array, y: Array, z: Array | None) -> None:
        """Write further rows: times, states, discrete variables."""
        if self._by_rows and self._case is not None:
            self._write(Table(self._case, t, y, z))

    def finish(self, table: Table, y: Array) -> None:
        """Write the rest of a run whose states on the grid are ``y``; all of it, where another one was followed last."""
        if not self._by_rows:
            return
        if self._file is None or self._of != y.ctypes.data:
            self.begin(table.case, y)
        while self._count < len(table):
            rows = slice(self._count, min(self._count + AT_ONCE, len(table)))
            self._write(table.part(rows))
            passed(table.t, table.y, table.z)
        self._close()

    def complete(self, solution: Solution) -> None:
        """Write what takes the whole run."""
        if not self._by_rows:
            solution.save(self.path, self._names, self._display)

    def _write(self, table: Table) -> None:
        assert self._file is not None
        block = np.column_stack([table.t, table.rows(slice(0, len(table)))[:, self._columns]]) * self._factors
        try:
            self._file.writelines(csv_lines(block))
            self._file.flush()
        except OSError as error:
            error.filename = str(self.path)
            with suppress(OSError):  # the same once more
                self._close()
            raise
        self._count += len(table)

    def _close(self) -> None:
        if self._file is not None:
            file, self._file = self._file, None
            file.close()
