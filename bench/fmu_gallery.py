"""Every example as FMI 2 and FMI 3 units of both kinds: ``python -m bench.fmu_gallery [--quick] [NAME ...]``.

Each is exported with the check of the exporter, checked by ``mechc fmu check``, and compared with the free native run.
The page has one row for each example; the exit code is 1 if one of them fails. Runs of names alone print the page and
do not write it.
"""

from __future__ import annotations

import multiprocessing
import sys
import tempfile
import time
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from msgspec import Struct, field

from mechc.api import Model, load
from mechc.compiler.targets.fmu.agreement import AGREED, SAFETY, Agreement, agreement, distance
from mechc.compiler.targets.fmu.checks import APART, CVODE, Checked, check_package
from mechc.compiler.targets.fmu.export import Made
from mechc.compiler.targets.fmu.inspect import behaviour
from mechc.fmu.documents import native_run
from mechc.fmu.export import FmuOptions, fmu_packages
from mechc.lang.diagnostics import CompileError
from mechc.runtime.results.accuracy import companion_tolerance

from .machine import page, table, write

EXAMPLES = Path(__file__).parents[1] / "examples"
PATIENCE = 600.0
"""Seconds after which an example is given up."""
BETWEEN_STEPS = 10.0
"""By how much values between the ends of a step may be worse: that is what the kernel checks (step.c)."""
WORDS = (
    "Each example as an FMU of both versions, each with both kinds: validated by fmpy and by the rules of this "
    "compiler, simulated by fmpy in each kind, compared with the reference results in the file, and with native runs.",
    "- *CS*: Co-Simulation gives the bits of the native solver that stops at the same 47 times (else the example "
    "fails); the number is its largest difference to the free native run, followed by the bound.\n"
    f"- *ME*: difference of a run by CVode at {CVODE:g} to the native run, for both versions, followed by the bound.\n"
    f"- *until*: the part of the run that is compared, up to a bound of {AGREED:g}; beyond, chaotic motion goes its "
    "own ways.",
    "Differences are over the size of each state (nominal value and largest value), at the time at which difference and "
    f"bound come nearest. The bound is derived: {SAFETY:g} times the difference of each native run to one with a "
    f"tolerance {APART:g} times tighter, and the difference of CVode's run to one {APART:g} times looser, which bounds "
    f"its error; each the largest so far, and not below {SAFETY:g} times the tolerance (for CS {SAFETY * BETWEEN_STEPS:g}"
    " times, since values of the free run lie between its steps). Sizes are of the FMI 3 unit; seconds are for all of "
    "it in one process.",
)


class Row(Struct):
    """``size`` in bytes, ``until`` a part of the run; ``failure``: empty if all is well."""

    example: str
    size: int = 0
    me: dict[int, Agreement] = field(default_factory=dict)
    cs: Agreement | None = None
    until: float = 1.0
    seconds: float = 0.0
    failure: str = ""


def main(quick: bool = False, names: list[str] | None = None) -> int:
    """Check the examples (every tenth if ``quick``), write the page and return the exit code."""
    chosen = names or sorted(p.stem for p in EXAMPLES.glob("*.mech"))[:: 10 if quick else 1]
    rows = []
    for name in chosen:
        rows.append(in_process(name))
        print(" | ".join(cells(rows[-1])), file=sys.stderr, flush=True)
    failed = sum(bool(row.failure) for row in rows)
    parts = [
        *WORDS,
        f"{len(rows) - failed} of {len(rows)} pass, in {sum(row.seconds for row in rows) / 60:.0f} minutes.",
        table(
            ["example", "CS", "bound", "ME 2", "ME 3", "bound", "until", "kB", "s", ""],
            list(map(cells, rows)),
        ),
    ]
    if names:
        print(page("Examples as FMUs", parts))
    else:
        write("fmu_gallery", "Examples as FMUs", parts)
    return 1 if failed else 0


def cells(row: Row) -> list[str]:
    """Return one line of the table."""
    cs, two, three = row.cs, row.me.get(2), row.me.get(3)
    return [
        row.example,
        f"{cs.difference:.0e}" if cs else "-",
        f"{cs.bound:.0e}" if cs else "-",
        f"{two.difference:.0e}" if two else "-",
        f"{three.difference:.0e}" if three else "-",
        f"{three.bound:.0e}" if three else "-",
        f"{row.until:.0%}",
        f"{row.size / 1000:.0f}",
        f"{row.seconds:.0f}",
        row.failure.replace("|", "/") or "ok",
    ]


def in_process(example: str) -> Row:
    """Check an example in a process of its own: a binary that crashes ends only that."""
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe(duplex=False)
    begun = time.perf_counter()
    process = context.Process(target=_send, args=(example, there))
    process.start()
    there.close()
    try:
        row = here.recv() if here.poll(PATIENCE) else Row(example, failure=f"not done after {PATIENCE:g} s")
    except EOFError:
        process.join()
        row = Row(example, failure=f"the process ended with code {process.exitcode}")
    if process.is_alive():
        process.join(1.0)
        process.kill()
    process.join()
    row.seconds = time.perf_counter() - begun
    return row


def _send(example: str, there: Connection) -> None:
    there.send(checked(example))


def checked(example: str) -> Row:
    """Export one example and check the files."""
    row = Row(example)
    try:
        model = load(EXAMPLES / f"{example}.mech").for_experiment(None)
        packages = fmu_packages(model, FmuOptions(fmi="both"))
        for version, made in zip((2, 3), packages, strict=True):
            found = check_package(made)
            row.size = len(made.package.data)
            if found is not None and found.me is not None:
                row.me[version] = found.me
            row.failure = row.failure or _inspected(made)
        case = packages[-1].start.case
        if found is not None:
            row.cs = against_free_run(model, packages[-1], found)
            ends = [row.cs, *row.me.values()]
            row.until = (min(a.until for a in ends) - case.begin) / (found.times[-1] - case.begin)
            if not row.cs.passed:
                row.failure = row.failure or f"Co-Simulation differs from the free run by {row.cs}"
    except CompileError as error:
        row.failure = row.failure or error.diagnostics[0].message
    return row


def _inspected(made: Made) -> str:
    """Return what ``mechc fmu check`` says against a file that has been validated."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.fmu"
        path.write_bytes(made.package.data)
        return next((f"{line.what}: {line.detail}" for line in behaviour(path).lines if not line.passed), "")


def against_free_run(model: Model, made: Made, found: Checked) -> Agreement:
    """Compare the run that stops at each time, which is that of Co-Simulation, with one that does not.

    Both have a companion each: steps that end at given times are shorter, and their errors smaller.
    """
    case = made.start.case
    tolerance, factor = companion_tolerance(case.tolerance)
    runs = (
        native_run(model, None, case.stop)[1],
        native_run(model, None, case.stop, tolerance, case.step / 2 if case.step else None)[1],
    )
    times = found.times[found.times <= min(run.time[-1] for run in runs)]
    columns = (run(times) for run in runs)
    free, companion = (np.array([c[q.name] for q in runs[0].problem.states]).T for c in columns)
    error = SAFETY * factor * distance(free, companion, found.size) + found.error[: len(times)]
    return agreement(times, distance(found.states, free, found.size), error, BETWEEN_STEPS * case.tolerance)


if __name__ == "__main__":
    sys.exit(main("--quick" in sys.argv, [name for name in sys.argv[1:] if name != "--quick"]))
