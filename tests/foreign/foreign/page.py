"""Write docs/foreign.md from the tables: ``PYTHONPATH=tests/foreign:tests/support python -m foreign.page``.

``--store`` asks SymPy for the numbers that are kept and not yet in stored.json; ``--measure`` measures the times beside SymPy, and how far
the examples of Modelica agree.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
from modelica_examples import rows as modelica_rows
from modelica_table import COMPUTED, EXAMPLES

import mechc
from foreign import exudyn_table
from foreign.case import STORED, Evaluated, Side, System, Waiting, drawn, stored
from foreign.table import NO_MOTION, SYSTEMS, WAITING

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs" / "foreign.md"
TIMES = Path(__file__).with_name("times.json")

AGREEMENT = Path(__file__).parents[1] / "modelica" / "agreement.json"

MODELICA = """## Modelica

Examples of the Modelica Standard Library (MultiBody, Rotational, Translational and the mechanical Blocks) and of PlanarMechanics,
written in our own words with the numbers of the originals. Most are compared with rows of the reference results that the library's makers
publish (Dymola 2020x, tolerance 1e-6; github.com/modelica/MAP-LIB_ReferenceResults), the others with equations of our own in SciPy or
closed forms. *Agreement* is the largest root mean square of a difference, as a share of the largest value. The tests require 1e-3.
"""

EXUDYN = """## Exudyn

Systems of the TestModels and Examples of [Exudyn](https://github.com/jgerstmayr/EXUDYN), in our own words. Each stands
for the ones that are named: the same elements, joined and loaded alike, with some of their numbers. Exudyn 1.13 shares no code with mechc. Where there are constraints, it
integrates redundant coordinates by the trapezoidal rule, and three runs with step sizes in the ratio 4 : 2 : 1 are extrapolated to step size zero (Richardson). Otherwise a Runge-Kutta
method computes the motion twice, with two step sizes or tolerances (`tests/foreign/exudyn/exudyn_reference.py`). Places, directions and angular velocities at the end differ by less
than 1e-10 of the largest value plus the uncertainty of Exudyn's own results. The column *doubt* gives the latter relative to the largest
value; it is large where forces have kinks.
"""

HEAD = """# Systems of other programs

The systems that other programs test themselves with, written as models and compared with the results of those programs. Made
from the table in `tests/foreign` by `python -m foreign.page`; the tests use the same table.

## SymPy and PyDy

SymPy forms equations of motion by Kane's and by Lagrange's method, and shares no code with mechc. Each row is one system of
the tests of `sympy.physics.mechanics` (1.14) or of the examples of [PyDy](https://github.com/pydy/pydy), as a model in our own
words. Both sides give the accelerations, and the reactions where the system has them, at three random states, with random
parameters and inputs; states of systems with constraints satisfy them. They agree to 1e-12 of the largest acceleration
everywhere; the largest difference that was seen is 2e-14.

The last two columns give processor time in seconds: for mechc from the text of the model to numeric functions, for SymPy from points and
frames to the same functions.
"""


def rows(systems: Sequence[System], times: dict[str, list[float]]) -> str:
    lines = ["| system | from | compared | mechc | SymPy |", "|---|---|---|---|---|"]
    for s in systems:
        ours, theirs = (f"{t:.2f}" for t in times[s.name]) if s.name in times else ("", "")
        lines.append(f"| {s.name} | {s.source} | {s.compared} | {ours} | {theirs} |")
    return "\n".join(lines)


def reasons(waiting: Sequence[Waiting]) -> str:
    return "\n".join(
        [
            "| what | from | why |",
            "|---|---|---|",
            *(f"| {w.name} | {w.source} | {w.reason} |" for w in waiting),
        ]
    )


def modelica() -> str:
    """Return the table of Modelica's examples, with the agreement that was measured last."""
    agreement = json.loads(AGREEMENT.read_text(encoding="utf-8"))
    by = {e.name: "SciPy or a closed form" if e.source == COMPUTED else "published rows" for e in EXAMPLES}
    lines = ["| example | compared with | agreement | remark |", "|---|---|---|---|"]
    for name, _, said in modelica_rows():
        lines.append(f"| {name} | {by.get(name, '')} | {agreement.get(name, '')} | {said} |")
    return "\n".join(lines)


def exudyn() -> str:
    """Return the table of Exudyn's systems."""
    kept = exudyn_table.reference()
    lines = ["| system | from | compared | doubt |", "|---|---|---|---|"]
    for e in exudyn_table.EXAMPLES:
        r = kept[e.name]
        doubt = f"{r.doubt / max(map(abs, r.values)):.0e}"
        lines.append(
            f"| {e.name.replace('_', ' ')} | {e.source} | {len(e.read)} numbers at {r.stop:g} s | {doubt} |"
        )
    waiting = [Waiting(*row) for row in exudyn_table.WAITING]
    return "\n".join([*lines, "", reasons(waiting)])


def page() -> str:
    times = json.loads(TIMES.read_text(encoding="utf-8"))
    published = sum(e.source != COMPUTED for e in EXAMPLES)
    remarks = "\n".join(f"- **{s.name}**: {s.remark}." for s in SYSTEMS if s.remark)
    return f"""{HEAD}
{rows(SYSTEMS, times)}

All {len(SYSTEMS)} systems agree. {len(WAITING)} more cannot be written in the language yet.

### Where the two are not the same

{remarks}

### What the language lacks

{reasons(WAITING)}

### What has no motion to compare

{reasons(NO_MOTION)}

{MODELICA}
{modelica()}

All {len(EXAMPLES)} mechanical examples of these libraries agree: {published} with published rows, {len(EXAMPLES) - published} with equations of our own.
Where a reference ends early or differs, a third program shows why (`test_third_programs.py` and `test_sensitive_motions` in `tests/foreign/modelica`).

{EXUDYN}
{exudyn()}

All {len(exudyn_table.EXAMPLES)} systems agree; they represent {len(exudyn_table.covered())} tests and examples. The last table lists what has no model yet.
"""


def measure() -> dict[str, list[float]]:
    """Processor seconds to form each system that SymPy forms here: by mechc, which keeps nothing, and by SymPy."""
    times = {}
    for s in SYSTEMS:
        if s.judge is not None:
            begun = spent()
            judge = Evaluated(s.judge(), s.values)
            theirs = spent() - begun
            draw = judge.parameters(np.random.default_rng(41))
            with tempfile.TemporaryDirectory() as empty:
                os.environ["MECHC_CACHE"] = empty
                begun = spent()
                Side(mechc.loads(s.text), s, draw)
                times[s.name] = [round(spent() - begun, 2), round(theirs, 2)]
            print(s.name, times[s.name], flush=True)
    return times


def spent() -> float:
    """Processor time of this process and of the compilers that it ran."""
    t = os.times()
    return t.user + t.system + t.children_user + t.children_system


if __name__ == "__main__":
    if "--store" in sys.argv:
        kept = stored() if STORED.exists() else {}
        draws = {s.name: kept.get(s.name) or drawn(s) for s in SYSTEMS if s.stored}
        STORED.write_bytes(msgspec.json.format(msgspec.json.encode(draws), indent=1) + b"\n")
    if "--measure" in sys.argv:
        TIMES.write_text(json.dumps(measure(), indent=1) + "\n", encoding="utf-8")
        measured = {name: agreement for name, agreement, _ in modelica_rows(measure=True) if agreement}
        AGREEMENT.write_text(json.dumps(measured, indent=0) + "\n", encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")
