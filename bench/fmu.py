"""What the calls of an FMU cost: the double pendulum in both versions, beside its bare right-hand side."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

import fmpy

import mechc
from mechc.compiler.targets.fmu.export import Package, make_package, start_of
from mechc.runtime.native.build import find_compiler, kernel_flags

from .machine import table, write

EXAMPLE = Path(__file__).parents[1] / "examples" / "double_pendulum.mech"
DRIVER = Path(__file__).parent / "fmu_calls.c"
CALLS = 200_000
CASES = (
    ("set time, states, get derivatives, above the bare function", 60.0),
    ("get derivatives again", 20.0),
    ("step of 10 ms at tolerance 1e-6", 3000.0),
)


def package(fmi: int, example: Path = EXAMPLE) -> Package:
    """Make the sources of an FMU; nothing is run."""
    model = mechc.load(example).for_experiment(None)
    start = start_of(model.problem())
    return make_package(model.compilation.equations, start, fmi=fmi, method="dop853", platforms=())


def nanoseconds(made: Package, fmi: int, calls: int) -> dict[str, float]:
    """Compile an FMU with the driver and return the nanoseconds by case: bare, whole, again, step."""
    compiler = find_compiler()
    if compiler is None:
        raise SystemExit("the costs of an FMU cannot be measured without a C compiler")
    with tempfile.TemporaryDirectory() as folder:
        names = []
        for name, data in made.files.items():
            if name.startswith("sources/") and not name.endswith(".xml"):
                names.append(name.removeprefix("sources/"))
                Path(folder, names[-1]).write_bytes(data)
        flags = [*kernel_flags(reproducible=True), "-I.", f"-I{Path(fmpy.__file__).parent / 'c-code'}"]
        sources = [name for name in names if name.endswith(".c")]
        version = ["-DFMI2"] if fmi == 2 else []
        command = [*compiler.command, *flags, *version, str(DRIVER), *sources, "-o", "calls", "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        done = subprocess.run(
            [str(Path(folder, "calls")), made.token, str(calls)], capture_output=True, text=True, check=True
        )
    return {name: float(value) for name, value in (line.split() for line in done.stdout.splitlines())}


def main(quick: bool = False) -> None:
    """Measure and write the page."""
    rows = []
    for fmi in (2, 3):
        found = nanoseconds(package(fmi), fmi, CALLS // 10 if quick else CALLS)
        rows.append([f"FMI {fmi}", "bare right-hand side", "", f"{found['bare']:.1f}"])
        values = (found["whole"] - found["bare"], found["again"], found["step"])
        for (words, goal), value in zip(CASES, values, strict=True):
            rows.append([f"FMI {fmi}", words, f"{goal:g}", f"{value:.1f}"])
    text = (
        "Calls into the FMU of `examples/double_pendulum.mech`, compiled as it is exported (`-ffp-contract=off`, no "
        "instructions of this processor alone). CPU time, the least of 15 means."
    )
    write("fmu", "Cost of the calls of an FMU", [text, table(["", "call", "goal, ns", "ns"], rows)])


if __name__ == "__main__":
    main()
