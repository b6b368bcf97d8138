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


def process(*arguments: str) -> tuple[float, float]:
    """Wall and CPU seconds of one process of the command line."""
    command = [sys.executable, "-m", "mechc", *arguments]
    before, begun = os.times(), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=INSTALLED)
    wall, after = time.perf_counter() - begun, os.times()
    cpu = after.children_user - before.children_user + after.children_system - before.children_system
    return wall, cpu


def main(quick: bool = False) -> None:
    count = 3 if quick else 7
    with tempfile.TemporaryDirectory() as folder:
        models = [Path(folder, f"pendulum{k}.mech") for k in range(count)]
        for k, model in enumerate(models):
            model.write_text(PENDULUM.format(k=f"{k}_{time.time_ns()}"))
        process(
            "--help"
        )  # writes bytecode, once per installation, as the next one does and compiles the kernel
        process("run", str(models[0]))
        cases = {
            "`mechc --help`": (0.25, [process("--help") for _ in range(count)]),
            "`mechc run`, new model": (2.0, [process("run", str(m)) for m in models[1:]]),
            "`mechc run`, cached model": (0.6, [process("run", str(models[-1])) for _ in range(count)]),
        }
    rows = [
        [
            name,
            f"{goal:g}",
            f"{min(w for w, _ in seconds):.2f}",
            f"{statistics.median(w for w, _ in seconds):.2f}",
            f"{min(c for _, c in seconds):.2f}",
        ]
        for name, (goal, seconds) in cases.items()
    ]
    text = (
        "Whole processes, a simple pendulum of one coordinate. On a machine with other work the CPU time tells "
        "what the wall time would be without it (a little less than it, where the C compiler runs)."
    )
    head = ["command", "goal, s", "best wall, s", "median wall, s", "best CPU, s"]
    write("startup", "Start-up", [text, table(head, rows)])


if __name__ == "__main__":
    main()
