"""Every example as FMI 2 and FMI 3 units of both kinds: ``python -m bench.fmu_gallery [--quick] [NAME ...]``.

Each is validated, simulated in fmpy as Model Exchange and as Co-Simulation, and compared with the native run. The page
has one row for each example; the exit code is 1 if one of them fails.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from .machine import table, write

EXAMPLES = Path(__file__).parents[1] / "examples"
PATIENCE = 900.0
"""Seconds after which an example is given up."""
TOGETHER = 2


@dataclass(frozen=True, slots=True)
class Row:
    """``differences``: the largest to the reference, by version and kind; ``failure``: empty if all is well."""

    example: str
    size: int
    differences: dict[str, str]
    seconds: float
    failure: str


def main(quick: bool = False, names: list[str] | None = None) -> int:
    """Check the examples (every tenth if ``quick``), write the page and return the exit code."""
    chosen = names or sorted(p.stem for p in EXAMPLES.glob("*.mech"))[:: 10 if quick else 1]
    with ThreadPoolExecutor(TOGETHER) as pool:
        rows = list(pool.map(checked, chosen))
    keys = [f"FMI {v} {kind}" for v in (2, 3) for kind in ("ME", "CS")]
    lines = [
        [
            row.example,
            *(row.differences.get(key, "-") for key in keys),
            f"{row.size / 1000:.0f}",
            f"{row.seconds:.0f}",
            row.failure or "ok",
        ]
        for row in rows
    ]
    failed = sum(bool(row.failure) for row in rows)
    text = (
        "Each example as an FMU of both versions with both kinds: validated by fmpy and by the rules of this compiler, "
        "simulated by fmpy in each kind, and compared with the native run. Co-Simulation must give the bits of the "
        "native run that stops at the same times. The numbers are the largest differences to the reference results in "
        "the file, over the largest value of each variable; the Model Exchange run is that of CVode at 1e-8. Sizes in "
        "kB of the FMI 3 unit, seconds for all of it."
    )
    write(
        "fmu_gallery",
        "Examples as FMUs",
        [
            text,
            f"{len(rows) - failed} of {len(rows)} pass.",
            table(["example", *keys, "kB", "s", ""], lines),
        ],
    )
    return 1 if failed else 0


def checked(example: str) -> Row:
    """Export one example and check the files, in processes of their own."""
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / f"{example}.fmu"
        failure = _run(
            "compile", str(EXAMPLES / f"{example}.mech"), "--target", "fmu", "--fmi", "both", "-o", target
        )[1]
        differences: dict[str, str] = {}
        size = 0
        if not failure:
            for version in (2, 3):
                file = target.parent / f"fmi{version}" / target.name
                size = file.stat().st_size
                said, wrong = _run("fmu", "check", str(file))
                differences |= {f"FMI {version} {kind}": d for kind, d in _differences(said).items()}
                failure = failure or wrong
    row = Row(example, size, differences, time.perf_counter() - begun, failure)
    print(f"{row.seconds:6.0f} s  {example}: {failure or 'ok'}", file=sys.stderr, flush=True)
    return row


def _run(*arguments: str | Path) -> tuple[str, str]:
    """Run the command line; return what it printed and, if it failed, why in one line."""
    command = [sys.executable, "-m", "mechc", *map(str, arguments)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return "", f"not done after {PATIENCE:g} s"
    if done.returncode == 0:
        return done.stdout, ""
    lines = [line for line in (done.stderr + done.stdout).splitlines() if line.strip()]
    wrong = [line for line in lines if line.startswith(("error", "FAIL"))] or lines or ["no message"]
    return done.stdout, wrong[0].replace("|", "/")


def _differences(said: str) -> dict[str, str]:
    """Read the largest differences out of the table of ``mechc fmu check``."""
    found = {}
    for line in said.splitlines():
        for kind, title in (("ME", "ModelExchange reference"), ("CS", "CoSimulation reference")):
            if title in line and "largest difference" in line:
                found[kind] = line.partition("largest difference ")[2].split()[0]
    return found


if __name__ == "__main__":
    sys.exit(main("--quick" in sys.argv, [name for name in sys.argv[1:] if name != "--quick"]))
