"""Seconds of whole processes: help, a new model, a cached one."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from .machine import table, write
from .systems import BARS

PENDULUM = """model Pendulum{k}
  parameter m = 1 kg;
  parameter l = 1 m;
  parameter g = 9.81 m/s^2;
  coordinate Angle theta = 30 deg;
  kinetic 1/2*m*l^2*der(theta)^2;
  potential -m*g*l*cos(theta);
  experiment(stop = 10 s);
end Pendulum{k};
"""


INSTALLED = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
"""Installed packages have their bytecode beside them; a checkout gets it by its first run."""


def process(*arguments: str, cache: Path | None = None) -> tuple[float, float]:
    """Wall and CPU seconds of one process of the command line. ``cache``: a folder for compiled code of its own."""
    return timed([sys.executable, "-m", "mechc", *arguments], {"MECHC_CACHE": str(cache)} if cache else {})


def timed(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Wall and CPU seconds of a process and what it starts."""
    before, begun = os.times(), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=INSTALLED | environment)
    wall, after = time.perf_counter() - begun, os.times()
    cpu = after.children_user - before.children_user + after.children_system - before.children_system
    return wall, cpu


def main(quick: bool = False) -> None:
    count = 3 if quick else 7
    with tempfile.TemporaryDirectory() as folder:
        models = [Path(folder, f"pendulum{k}.mech") for k in range(count)]
        for k, model in enumerate(models):
            model.write_text(PENDULUM.format(k=f"{k}_{time.time_ns()}"))
        # writes bytecode, once per installation, as the next one does and compiles the kernel
        process("--help")
        process("run", str(models[0]))
        kept = Path(folder, "kept")
        process("run", str(models[0]), cache=kept)
        long = Path(folder, "chain.mech")
        long.write_text(BARS.replace("n = 10;", "n = 1000;").replace("stop = 10 s", "stop = 10 ms"))
        for _ in range(2):  # the second one finds the code by what its program was kept as
            process("run", str(long), cache=kept)
        once = [Path(folder, f"empty{k}") for k in range(1 if quick else 3)]
        python = [sys.executable, "-c"]
        cases = {
            "`python -c pass`": (None, [timed([*python, "pass"], {}) for _ in range(count)]),
            "`python -c 'import numpy'`": (
                None,
                [timed([*python, "import numpy"], {}) for _ in range(count)],
            ),
            "`mechc --help`": (0.25, [process("--help") for _ in range(count)]),
            "`mechc run`, first run ever": (2.5, [process("run", str(models[0]), cache=c) for c in once]),
            "`mechc run`, new model": (0.3, [process("run", str(m), cache=kept) for m in models[1:]]),
            "`mechc run`, cached model": (
                0.35,
                [process("run", str(models[-1]), cache=kept) for _ in range(count)],
            ),
            "`mechc run`, cached chain of 1000 links over 10 ms": (
                None,
                [process("run", str(long), cache=kept) for _ in range(count)],
            ),
        }
    rows = [
        [
            name,
            f"{goal:g}" if goal else "-",
            f"{min(w for w, _ in seconds):.2f}",
            f"{statistics.median(w for w, _ in seconds):.2f}",
            f"{min(c for _, c in seconds):.2f}",
            f"{statistics.median(c for _, c in seconds):.2f}",
        ]
        for name, (goal, seconds) in cases.items()
    ]
    text = (
        "Whole processes, a simple pendulum of one coordinate. On a machine with other work the CPU time tells "
        "what the wall time would be without it (a little less than it, where the C compiler runs)."
    )
    head = ["command", "goal, s", "best wall, s", "median wall, s", "best CPU, s", "median CPU, s"]
    write("startup", "Start-up", [text, table(head, rows)])


if __name__ == "__main__":
    main()
