"""Do the checks of a run cry wolf? Over all examples, methods and tolerances: what each check is off by, over what the
estimated errors allow."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct

import mechc
from mechc.runtime.outcome import ENDED, Outcome
from mechc.runtime.results.consistency import FACTOR, compared
from mechc.runtime.studies.runs import companion

from .machine import table, write
from .references import FAILURES, examples

TOLERANCES = (1e-4, 1e-8, 1e-12)
ADAPTIVE = ("dop853", "radau5")
FIXED = ("rk4", "gauss4", "verlet", "rattle")
STEPS = (300, 3000)


class Row(Struct, frozen=True):
    """The check of a run that comes nearest to contradicting its estimate."""

    model: str
    method: str
    setting: float
    kind: str
    name: str
    ratio: float
    doubtful: bool


def rows(path: Path) -> tuple[list[Row], int]:
    """Run one example by every method that fits it; give the checks, and the number of runs that told an estimate."""
    found: list[Row] = []
    count = 0
    model = mechc.load(path).for_experiment(None)
    duration = None
    kinds = [(m, "tolerance", s) for m in ADAPTIVE for s in TOLERANCES]
    kinds += [(m, "step", s) for m in FIXED for s in STEPS]
    for method, option, setting in kinds:
        if option == "step" and duration is None:
            continue
        value = setting if option == "tolerance" else duration / setting
        made: list[Any] = []

        def noted(*given: Any, made: list[Any] = made, **more: Any) -> Any:
            own = compared(*given, **more)
            if made:  # looked at again beside a third run
                made[:] = [
                    (one, min(ratio, other)) for (one, ratio), (_, other) in zip(made, own, strict=True)
                ]
            else:
                made += own
            return tuple(one for one, ratio in own if ratio > FACTOR)

        before, companion.contradictions = companion.contradictions, noted
        try:
            run = model.simulate(method=method, **{option: value})
        except FAILURES:
            continue
        finally:
            companion.contradictions = before
        if len(run.time) > 1:
            duration = duration or float(run.time[-1] - run.time[0])
        if run.outcome not in ENDED or run.accuracy.error is None:
            continue
        count += 1
        doubtful = run.outcome is Outcome.DOUBTFUL
        found += [Row(path.stem, method, setting, c.kind, c.name, ratio, doubtful) for c, ratio in made]
    return found, count


def main(quick: bool = False) -> None:
    found: list[Row] = []
    runs = 0
    for path in examples(quick, every=8):
        made, count = rows(path)
        found += made
        runs += count
        near = max((r.ratio for r in made), default=0.0)
        print(f"{path.stem:40} {count:3} runs, largest ratio {near:.2g}", flush=True)
        for r in made:
            if r.ratio > FACTOR:
                print(f"    {r.method} {r.setting:g}: {r.kind} {r.name} {r.ratio:.3g}", flush=True)
    lines = []
    for method in (*ADAPTIVE, *FIXED):
        own = [r for r in found if r.method == method]
        for kind in dict.fromkeys(r.kind for r in own):
            ratios = np.array([r.ratio for r in own if r.kind == kind])
            worst = max((r for r in own if r.kind == kind), key=lambda r: r.ratio)
            share = f"{np.median(ratios):.2g}"
            lines.append(
                [method, kind, f"{ratios.size}", share, f"{ratios.max():.2g} ({worst.model})",
                 f"{(ratios > FACTOR).sum()}"]
            )  # fmt: skip
    text = (
        f"{runs} runs of the examples at tolerances of {', '.join(f'{t:g}' for t in TOLERANCES)} and with "
        f"{' and '.join(map(str, STEPS))} steps: what each check is off by, over what the estimated errors let expect of "
        f"it. A run is doubtful where that is more than {FACTOR:g}; among the examples that is an alarm without a cause."
    )
    head = ["method", "check", "checked", "median ratio", "largest", "alarms"]
    write("doubts", "Checks of a run against its estimated errors", [text, table(head, lines)])


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
