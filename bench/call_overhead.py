"""What a run costs beside its motion: calls in a loop, bounces, output points; processor time and memory, beside the kernel's own."""

from __future__ import annotations

import itertools
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import Any
from unittest.mock import patch

import mechc
from mechc.runtime.integrate.kernel_run import run_kernel
from mechc.runtime.integrate.trajectory import Trajectory
from mechc.runtime.studies.runs import companion

from .machine import table, write
from .startup import INSTALLED

DOUBLE_PENDULUM = Path(__file__).parents[1] / "examples" / "double_pendulum.mech"

BALL = """model Ball
  parameter m = 1 kg;
  parameter g = 9.81 m/s^2;
  coordinate Length y = 1 m;
  kinetic 1/2*m*der(y)^2;
  potential m*g*y;
  contact floor: y restitution 1;
  experiment(stop = 1 s);
end Ball;
"""

STREAMED = (
    "The same double pendulum with its estimate of errors, written to an NPZ file while it runs (`to=`)."
)

PEAK = """
import resource, sys
import mechc
model = mechc.loads(sys.argv[1])
model.simulate(stop=1)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
solution = model.simulate(**eval(sys.argv[2]))
after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(1024 * (after - before), len(solution.time), len(solution.events), 1 + solution.problem.ny)
"""


@contextmanager
def seconds_of_runs() -> Iterator[list[float]]:
    """Give a list that grows by the kernel's own seconds of each run, companions too."""
    told: list[float] = []

    def noted(*given: Any) -> Trajectory:
        made = run_kernel(*given)
        told.append(made.statistics.run_time)
        return made

    with patch.object(companion, "run_kernel", noted):
        yield told


def apart(call: Callable[[], object], count: int) -> tuple[float, float, float]:
    """Median processor time of a call, the kernel's own in it, and what is beside that in the same call."""
    taken = []
    with seconds_of_runs() as told:
        for _ in range(count):
            told.clear()
            begun = time.process_time()
            call()
            whole = time.process_time() - begun
            taken.append((whole, sum(told), whole - sum(told)))
    whole, kernel, beside = (median(column) for column in zip(*taken, strict=True))
    return whole, kernel, beside


def peak(model: str, **options: float | str) -> tuple[int, int, int, int]:
    """Bytes that a run adds to the peak of a process; its output times, events and columns."""
    done = subprocess.run(
        [sys.executable, "-c", PEAK, model, repr(options)],
        check=True,
        capture_output=True,
        text=True,
        env=INSTALLED,
    )
    added, times, events, columns = map(int, done.stdout.split())
    return added, times, events, columns


def main(quick: bool = False) -> None:
    count = 30 if quick else 300
    text = DOUBLE_PENDULUM.read_text(encoding="utf-8")
    pendulum = mechc.loads(text)
    name = pendulum.parameters[0].name
    rows = []
    values = itertools.count(1)
    for estimate in (False, True):

        def run(estimate: bool = estimate, **options: float) -> mechc.Solution:
            value = 1.1 + 1e-9 * next(values)  # another one each time
            return pendulum.simulate(set={name: value}, estimate_error=estimate, **options)  # type: ignore[arg-type]

        for _ in range(count):
            run()
        label = f"`simulate(set=...)` {'with' if estimate else 'without'} estimate"
        for ending, call in (("", run), (", its outcome read", lambda: run().outcome)):
            cells = [f"{1e3 * seconds:.3f} ms" for seconds in apart(call, count)]
            rows.append([label + ending, *cells, "-" if ending else "0.1 ms"])
    ball = mechc.loads(BALL)
    ball.simulate(stop=100, estimate_error=False)
    stop = 20_000.0
    begun = time.process_time()
    bounced = ball.simulate(stop=stop, estimate_error=False)
    each = 1e6 * (time.process_time() - begun) / len(bounced.events)
    own = 1e6 * bounced.statistics.run_time / len(bounced.events)
    rows.append(["a bounce", f"{each:.1f} us", f"{own:.1f} us", f"{each - own:.1f} us", "3 us in all"])
    head = ["", "processor time", "of it the kernel", "beside it", "goal"]
    added, _, events, _ = peak(BALL, stop=10 * stop, estimate_error=False)
    memory = [["a bounce", f"{added / events:.0f}", "-", "-", "300"]]
    points = 1_000_000 if quick else 10_000_000
    for estimate in (False, True):
        added, times, _, columns = peak(text, stop=10.0, every=10.0 / points, estimate_error=estimate)
        per = added / times
        label = f"an output point, {'with' if estimate else 'without'} estimate"
        memory.append([label, f"{per:.0f}", f"{8 * columns}", f"{per / (8 * columns):.2f}", "70"])
    streamed = []
    for count_of in (points // 10, points):
        with tempfile.TemporaryDirectory() as folder:
            to = f"{folder}/motion.npz"
            added, times, _, columns = peak(text, stop=10.0, every=10.0 / count_of, to=to)
            size = Path(to).stat().st_size
        streamed.append(
            [
                f"{times:.0e}",
                f"{added / 1e6:.0f} MB",
                f"{8 * columns * times / 1e6:.0f} MB",
                f"{size / 1e6:.0f} MB",
            ]
        )
    words = (
        f"Medians of {count} calls. The double pendulum over 10 s, each time with another value of a parameter; how a short run ended and how accurate it was is judged when somebody asks; a ball that bounces without loss, for {stop:g} s. The kernel's time "
        "is what runs say of themselves, by the clock, in the same call; what is beside it is a median of its own. "
        f"{points:g} output points: time and states are there, outputs are computed where somebody asks for them."
    )
    of_files = ["points", "memory added", "times and states", "the file"]
    bytes_ = ["", "bytes at the peak", "of time and states alone", "ratio", "goal"]
    write(
        "around",
        "Around the motion",
        [words, table(head, rows), table(bytes_, memory), STREAMED, table(of_files, streamed)],
    )


if __name__ == "__main__":
    main()
