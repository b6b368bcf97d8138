"""Verdicts of ``mechc stress`` on random machines, each repeated by an integrator that shares no code with mechc."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from random_models.machines import CLOSE, STOP, machine

from mechc.measurement.extremes import TARGET, Extreme
from mechc.measurement.stress import UNDERSTATED, Subject, worker
from mechc.measurement.stress_targets import TARGETS, answer_of

COMPILED = ("c", "fmu")
"""Targets that take seconds each: of every fifth machine."""


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 40, 10))
def test_no_verdict_is_unfounded(first: int, tmp_path: Path) -> None:
    told: Counter[str] = Counter()
    for seed in range(first, first + 10):
        made = machine(seed)
        file = tmp_path / f"machine{seed}.mech"
        file.write_text(made.text(), encoding="utf-8")
        subject = Subject(str(file), None, {}, None, 5.0)
        judge, model = worker(subject), subject.load()
        names = [*(f"x{i}" for i in range(len(made.m))), *(e.name for e in made.elements if e.remembers)]
        times = np.linspace(0, STOP, 13)
        exact = made.run(times)
        stated = judge(Extreme("as stated", "nothing changed"))
        ran = model.simulate()(times)
        verdicts = [("run", stated, max(np.abs(ran[n] - exact[:, k]).max() for k, n in enumerate(names)))]
        for target in TARGETS:
            if target in COMPILED and seed % 5:
                continue
            row = judge(Extreme(TARGET, f"{target}: as stated"))
            off = 0.0
            if row.kind in ("right", "rough", "wrong"):
                answer = answer_of(target, model, names, 60.0)
                assert answer["time"][-1] == pytest.approx(STOP)
                off = max(abs(answer[n][-1] - exact[-1, k]) for k, n in enumerate(names))
            verdicts.append((target, row, off))
        for what, row, off in verdicts:
            told[f"{what}: {row.kind}"] += 1
            owed = max(CLOSE, UNDERSTATED * (row.claim or 0.0)) * (1 + float(np.abs(exact).max()))
            assert row.kind != "wrong" or off > owed, (seed, what, row.reason)
            assert row.kind != "right" or off <= owed, (seed, what, off, row.claim)
            assert row.kind not in ("unlike", "crashed", "hung"), (seed, what, row.reason)
    print(dict(told))
    assert sum(n for text, n in told.items() if text.endswith("right")) > 20, told
