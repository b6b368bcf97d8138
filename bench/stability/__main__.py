"""``python -m bench.stability [--quick | --full] [--mutated] [GROUP ...] [--only WORD]``.

Runs the cases and writes docs/stability.md, if all groups were asked for. ``--mutated`` runs each case in a
mutant of mechc in which its expectation must fail. The exit code is 1 if an expectation is not met (not failed, in a mutant).
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter

from mechc.runtime.native.kernel import load_kernel
from mechc.runtime.reference.high_precision import best_precision
from mechc.watchdog import Watchdog

from .case import Row
from .faults import FAULTS
from .page import line, write
from .perform import Question, case_of, maker, questions, titles, watched


def main(arguments: list[str]) -> int:
    given = argparse.ArgumentParser(prog="python -m bench.stability", description="Stiff and extreme cases.")
    given.add_argument("groups", type=int, nargs="*", metavar="GROUP", help="numbers of groups; all without")
    size = given.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="leave out the long cases (the default)")
    size.add_argument("--full", action="store_true", help="all cases")
    given.add_argument("--mutated", action="store_true", help="see each expectation fail under its fault")
    given.add_argument("--only", default="", metavar="WORD", help="cases whose name holds this")
    asked = given.parse_args(arguments)
    wanted = questions(not asked.full, tuple(asked.groups), asked.only)
    return mutated(wanted) if asked.mutated else run(wanted, not (asked.groups or asked.only), asked.full)


def run(wanted: list[Question], all_groups: bool, full: bool) -> int:
    load_kernel()  # compiled before, so that no case spends its time on it
    best_precision()
    begun = time.perf_counter()
    rows: list[Row] = []
    with Watchdog(maker, "") as dog:
        for question in wanted:
            rows.append(watched(dog, question))
            print(line(rows[-1]), flush=True)
    seconds = time.perf_counter() - begun
    kinds = Counter(row.kind for row in rows)
    print(f"\n{len(rows)} cases in {seconds:.0f} s: " + ", ".join(f"{n} {kind}" for kind, n in kinds.items()))
    if all_groups:
        write(rows, titles(), full=full, seconds=seconds)
    return int(any(row.kind != "met" for row in rows))


def mutated(wanted: list[Question]) -> int:
    """Run each case under its fault; the worker is begun again for each fault."""
    green: list[Row] = []
    red: Counter[str] = Counter()
    for name, fault in FAULTS.items():
        under = [q for q in wanted if case_of(q).fault == name]
        if not under:
            continue
        print(f"mutant: {fault.text}")
        with Watchdog(maker, name) as dog:
            for question in under:
                row = watched(dog, question)
                print("  " + ("STILL MET " if row.kind == "met" else "red       ") + line(row), flush=True)
                red[name] += row.kind != "met"
                green += [row] if row.kind == "met" else []
    print(f"\n{red.total()} of {len(wanted)} expectations failed under their fault, as they must")
    return int(bool(green))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
