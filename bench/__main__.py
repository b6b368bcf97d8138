"""``python -m bench [--quick] [NAME ...]``: make the pages of bench/report, all of them or those named."""

from __future__ import annotations

import os
import sys
import time
from importlib import import_module

from .machine import note_time

PAGES = (
    "forming",
    "constraints",
    "curves",
    "four_bar",
    "evaluation",
    "tangents",
    "functions",
    "robot_functions",
    "stepping",
    "tables",
    "massless",
    "gradient",
    "kernel",
    "stiff",
    "taylor",
    "long_runs",
    "events",
    "dominoes",
    "heap",
    "friction_problems",
    "fmu",
    "large",
    "pairs",
    "whole",
    "startup",
    "editor",
    "around",
    "work_precision",
    "examples",
    "calibration",
    "doubts",
    "mutants",
    "fits",
    "exponents",
    "exponent_maps",
    "studies",
    "answers",
    "leaving_out",
    "ensembles",
    "cluster",
)


def main(arguments: list[str]) -> int:
    quick = "--quick" in arguments
    names = [a for a in arguments if a != "--quick"] or list(PAGES)
    unknown = [name for name in names if name not in PAGES]
    if unknown:
        print(f"no page '{unknown[0]}'; there are {', '.join(PAGES)}", file=sys.stderr)
        return 2
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does
    begun = time.monotonic()
    for name in names:
        before = time.monotonic()
        import_module(f".{name}", __package__).main(quick=quick)
        taken = time.monotonic() - before
        note_time(name, taken)
        print(f"page {name}: {taken:.0f} s, {time.monotonic() - begun:.0f} s so far", flush=True)
    import_module(".index", __package__).main()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
