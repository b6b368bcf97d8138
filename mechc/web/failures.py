"""The words in which a page says how a run failed: those of native runs, with blanks for what is known there only."""

from __future__ import annotations

import math
from collections.abc import Iterator

from msgspec import Struct

from mechc.runtime.integrate.kernel_failure import kernel_failure
from mechc.runtime.native.status import Status
from mechc.runtime.problem import Array, Problem

MOST = 100
"""Texts that are kept of one status, beside the one in which only a name changes."""

UNUSUAL = (1.0, math.nan, math.inf)
"""Values that texts tell apart."""

OF_STATES = (Status.STEP_TOO_SMALL, Status.NOT_FINITE, Status.NO_SERIES)
OF_BRANCHES = (Status.EVENT_LOOP, Status.ZENO, Status.BRANCH_ASSERTION)
REFUSED = (
    Status.NEEDS_JACOBIAN,
    Status.NEEDS_SEPARABLE,
    Status.NEEDS_MOMENTA,
    Status.NEEDS_SERIES,
    Status.NEEDS_ROWS,
    Status.NEEDS_STEPS,
)
"""No run begins with these."""


class _Blank(float):
    """A number that is written as its place in a text, whatever the format."""

    place: str

    def __new__(cls, place: str, value: float = 1.0) -> _Blank:
        blank = super().__new__(cls, value)
        blank.place = place
        return blank

    def __format__(self, _: str) -> str:
        return f"@{self.place}@"

    def __abs__(self) -> _Blank:
        return self


class _Report(Struct):
    """What a failure is told from: the part of ``mech_report`` that ``kernel_failure`` reads."""

    t: float
    failed_index: int
    failed_part: int
    failed_value: float


def failure_texts(problem: Problem) -> dict[str, str]:
    """Return texts by "status", "status:kind" (of the state), "status:index", "status:index:part" and those with ":nan" or ":inf", the
    most special one counts. Blanks: @time@, @value@, @name@ (of the state or row with the index), @coordinate@ (of which it is the rate),
    @y3@ (of a state)."""
    texts: dict[str, str] = {}
    y: Array = [_Blank(f"y{k}") for k in range(problem.ny)]  # type: ignore[assignment]
    for status in Status:
        if status >= 0 or status in REFUSED or (status <= Status.EVENT_LOOP and problem.hybrid is None):
            continue
        texts |= _of_status(problem, status, y)
    return texts


def _of_status(problem: Problem, status: Status, y: Array) -> dict[str, str]:
    found: dict[str, str] = {}
    for key, report in _reports(problem, status):
        if len(found) > MOST:
            break
        text = _text(problem, status, report, y)
        if text is None:
            continue
        of_kind = _of_kind(problem, status, report)
        if not found:
            found[str(int(status))] = text
        elif text != next(
            found[less] for less in (*_less(key)[:-1], *of_kind, str(int(status))) if less in found
        ):
            found[next((k for k in of_kind[:1] if k not in found), key)] = text
    return found


def _of_kind(problem: Problem, status: Status, report: _Report) -> list[str]:
    """Return the keys of the kind of the state, with the size of its value and without it; none where no state fails."""
    if status not in OF_STATES:
        return []
    kind = f"{int(status)}:{problem.states[report.failed_index].kind}"
    return [kind] if math.isfinite(report.failed_value) else [f"{kind}:{float(report.failed_value)}", kind]


def _reports(problem: Problem, status: Status) -> Iterator[tuple[str, _Report]]:
    """Yield what a run may report, with its key, the most general one first."""
    for index in range(_count(problem, status)):
        for part in range(_parts(problem, status, index)):
            for value in UNUSUAL:
                key = f"{int(status)}:{index}" + (f":{part}" if part else "")
                key += "" if math.isfinite(value) else f":{value}"
                yield key, _Report(_Blank("time"), index, part, _Blank("value", value))


def _count(problem: Problem, status: Status) -> int:
    if status in OF_STATES:
        return problem.ny
    if status == Status.ASSERTION:
        return len(problem.assertions)
    if problem.hybrid is None or status > Status.EVENT_LOOP:
        return 1
    if status == Status.CHATTER:
        return max(1, len(problem.hybrid.switches))
    return max(1, len(problem.hybrid.branches if status in OF_BRANCHES else problem.hybrid.rows))


def _parts(problem: Problem, status: Status, index: int) -> int:
    if status == Status.BRANCH_ASSERTION and problem.hybrid is not None:
        return len(problem.hybrid.branches[index].checks) if problem.hybrid.branches else 0
    return {Status.CHATTER: 5, Status.EVENT_LOOP: 2}.get(status, 1)


def _text(problem: Problem, status: Status, report: _Report, y: Array) -> str | None:
    """Return the text with a blank for the name to blame, None where the model has nothing that could fail so."""
    try:
        failure = kernel_failure(problem, status, report, y)  # type: ignore[arg-type]
    except (AssertionError, IndexError):
        return None
    name = _name(problem, status, report.failed_index)
    if failure is None:
        return None
    said = failure.message.replace(f"'{name}'", "'@name@'")
    coordinate = name.replace("der(", "", 1).replace(")", "", 1)
    return said.replace(f"'{coordinate}'", "'@coordinate@'") if coordinate != name else said


def _name(problem: Problem, status: Status, index: int) -> str:
    if status in OF_STATES:
        return problem.states[index].name if index < problem.ny else ""
    rows = problem.hybrid.rows if problem.hybrid else ()
    return rows[index].name if index < len(rows) else ""


def _less(key: str) -> list[str]:
    """Return the keys that count where this one is missing, the most special one first."""
    parts = key.split(":")
    return [":".join(parts[:n]) for n in range(len(parts) - 1, 0, -1)]
