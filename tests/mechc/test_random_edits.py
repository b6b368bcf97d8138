"""Random edits of all examples are compiled or refused: quickly, in words, and never with a traceback.

``make fuzz EDITS=1000000`` runs as many as one likes.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from random import Random

import pytest
from random_edits import edited

from mechc.compiler.pipeline import compile_source
from mechc.lang.diagnostics import CompileError, Severity
from mechc.lang.grammar.tables import load_tables
from mechc.lang.source import SourceFile
from mechc.presentation.render import MOST_SHOWN, render

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.mech"))
EDITS = int(os.environ.get("MECHC_EDITS", "20000"))
PARTS = 20
SECONDS = 10.0
"""Of processor time, at most: an edit that gives twenty particles on spheres a full mass matrix of 60 coordinates takes 5."""


def check(text: str) -> bool:
    """Compile a text through its equations under the promises that hold for all; True if it was accepted."""
    source = SourceFile("edited.mech", text)
    began = time.process_time()
    try:
        diagnostics = compile_source(source, search=(ROOT / "examples",)).diagnostics
        accepted = True
    except CompileError as error:
        diagnostics = error.diagnostics
        accepted = False
        assert any(d.severity is Severity.ERROR for d in diagnostics)
    seconds = time.process_time() - began
    assert seconds < SECONDS, f"took {seconds:.1f} s"
    assert render(diagnostics).count("-->") <= MOST_SHOWN
    return accepted


def run(seeds: range) -> tuple[int, int]:
    """Check one edit for each seed; return how many were accepted and refused."""
    load_tables()  # made once and kept: not part of any check
    texts = [path.read_text(encoding="utf-8") for path in EXAMPLES]
    accepted = 0
    for seed in seeds:
        random = Random(seed)
        text = edited(random.choice(texts), random)
        try:
            accepted += check(text)
        except Exception as error:
            raise AssertionError(f"seed {seed}: {type(error).__name__}: {error}\n{text}") from error
    return accepted, len(seeds) - accepted


FOUND = {
    "name of the fixed frame": ("output world = x;", "E0211"),
    "sweep over a power": ("experiment s(x in {0, 0.7^0.9}, stop = 1);", None),
    "empty slice": ("constraint c: y[2:1] = y[1:2];", "E0305"),
    "unknown unit of the independent variable": ("independent s s;", "E0203"),
    "element of a rotation by another name": (
        "coordinate Rotation R; frame b = world * R; inertia diag({1, 2, 3}) on b; let w = R; output e = w[2];",
        None,
    ),
    "rate of a rotation by another name": (
        "coordinate Rotation R; frame b = world * R; inertia diag({1, 2, 3}) on b; let w = R; output e = der(w)[2];",
        None,
    ),
    "rate of a formula declared as a rotation": ("let Rotation w = rotz(x); output e = der(w)[2];", "E0329"),
    "element of a formula declared as a rotation": ("let Rotation w = rotz(x); output e = w[2];", "E0316"),
    "drive by a free coordinate": ("coordinate Real w; drive w = x;", "E0504"),
    "element of an answer about an array": ("output P = sum(momentum(z[i]) for i in 1:2);", None),
    "parameter from a reaction": ("constraint c: x = y[1]; parameter p = multiplier(c);", "E0810"),
    "parameter from a frame that moves": (
        "frame f = world * rotz(x); parameter p[3] = components(f, {1, 0, 0});",
        "E0810",
    ),
    "parameter that is a point": ("parameter C = world * {0, 1};", None),
    "start from a reaction": (
        "constraint c: x = y[1]; state s = multiplier(c); equation der(s) = 0;",
        "E0607",
    ),
    "setting from a reaction": ("constraint c: x = y[1]; experiment(x = multiplier(c), stop = 1);", "E0812"),
}
"""Statements on which random edits once found a defect, and the message that they lead to."""


@pytest.mark.parametrize("name", FOUND)
def test_found_by_edits(name: str) -> None:
    statement, code = FOUND[name]
    text = f"""model Found
  dimensionless;
  coordinate x = 1;
  coordinate y[2] = {{1, 0}};
  coordinate z[2,2] = {{{{1, 0}}, {{0, 1}}}};
  kinetic 1/2*der(x)^2 + 1/2*dot(der(y), der(y)) + 1/2*sum(dot(der(z[i]), der(z[i])) for i in 1:2);
  {statement}
end Found;
"""
    source = SourceFile("found.mech", text)
    if code is None:
        compile_source(source)
        return
    with pytest.raises(CompileError) as caught:
        compile_source(source)
    errors = [d.code for d in caught.value.diagnostics if d.severity is Severity.ERROR]
    assert errors[0] == code


def test_forces_undefined_at_the_start_of_a_mechanism() -> None:
    text = (ROOT / "examples" / "n_four_bar.mech").read_text(encoding="utf-8")
    assert "m/s^2" in text
    assert check(text.replace("m/s^2", "m/time^2"))


@pytest.mark.slow
def test_a_field_without_inertia() -> None:
    """80 coordinates in a ring once took 20 s: each of their formulas was searched for all symbols that it reads."""
    text = (ROOT / "examples" / "kink.mech").read_text(encoding="utf-8")
    kinetic = next(line for line in text.splitlines() if line.startswith("  kinetic "))
    assert not check(text.replace(kinetic, ""))


def test_some_edits() -> None:
    accepted, refused = run(range(60))
    assert accepted > 3 and refused > 10


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_many_edits(part: int) -> None:
    size = EDITS // PARTS
    run(range(part * size, (part + 1) * size))
