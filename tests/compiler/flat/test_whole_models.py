"""Whole models: golden texts, every sample and example, random edits, growth."""

from __future__ import annotations

import contextlib
import random
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from flat_models import flat

from mechc.compiler.flat.flatten import flatten
from mechc.compiler.flat.show import show
from mechc.lang.diagnostics import CompileError, Reporter
from mechc.lang.parser import parse
from mechc.lang.read import read_source
from mechc.lang.source import SourceFile

ROOT = Path(__file__).resolve().parents[3]
LANGUAGE = ROOT / "tests" / "models" / "language"
EXAMPLES = sorted((ROOT / "examples").glob("*.mech"))
NUMBERED = sorted(LANGUAGE.glob("*.mech"))

REFUSED_DRAFTS = {
    "E03_stewart_platform": "E0401",
    "E05_robot_arm_7": "E0315",
    "E07_half_car": "E0402",
    "E18_backlash": "E0211",
    "E24_bricard": "E0315",
    "V9_U62_second_derivative_lagrangian": "E0590",
}
"""Drafts that are older than the library or the rules, with the only kind of error they may have."""


EVERYTHING = """
function spring(Length d, k) -> Energy = 1/2*k*d^2;

model Body "rigid body"
  parameter Mass m = 1 kg "mass";
  parameter Inertia J = 0 kg.m^2;
  frame a "placed by a joint";
  mass m at a;
  inertia J on a;
end Body;

model Hinge
  frame from;
  frame to;
  coordinate Angle angle(nominal = 1 rad) ~ 0 rad "relative";
  place to = from * rot(angle);
  closure pos(to) = pos(from) "two equations";
end Hinge;

model Everything "each kind of element once"
  structural parameter Integer n = 2;
  parameter w = {3, 4} kg;
  gravity {0, -9.81 m/s^2};
  Body body[n](m = w);
  Hinge hinge[i in 1:n]((if i == 1 then world else body[i-1].a) -> body[i].a, angle = i*10 deg);
  Body stone(a = body[n].a * trans({1 m, 0}));
  coordinate Length r[2] = {1, 2} m;
  initial der(r[1]) = 3 m/s;
  initial energy() ~ 5 J;
  point P = world * r;
  mass 1 kg at P;
  potential spring(norm(P), 2 N/m);
  dissipation 1/2*1 N.s/m*dot(der(r), der(r));
  force push: {1 N, 0} on P from world in world;
  torque 1 N.m on hinge[1].angle;
  damping 1 N.s/m on r[1];
  friction 1 N static 2 N on r[2], law = "stick";
  holonomic constraint rail: r[1] = 2*r[2];
  contact floor: r[2] restitution 0.5 friction 0.1 along der(r[1]), rest = 1 mm/s;
  coordinate s = 0 m;
  kinetic 1/2*1 kg*der(s)^2;
  drive s = 1 m*sin(time/1 s);
  input Force u = 1 N;
  state Force f ~ 0;
  equation der(f) = (u - f)/10 ms;
  discrete Integer hits = 0;
  when r[1] < 0 m and not initial() then
    hits := pre(hits) + 1;
    reinit(der(r[1]), if u > 0 N then -der(r[1]) else 0);
    release rail;
  elsewhen sample(1 s) then
    impulse 1 N.s on r[2];
    terminate("done");
  end when;
  assert norm(P) < 10 m, "too far";
  output work = integral(u*der(s)) "work of u";
  output area = integral(x^2 for x in 0 m:r[1]);
  output load = multiplier(rail);
  exact s = 1 m*sin(time/1 s);
  experiment(stop = 10 s, r[1] = 4 m, u = 2 N);
  experiment scan(u in linspace(1 N, 2 N, 3), n = 3, f ~ 1 N, stop = 1 s);
end Everything;
"""


def test_golden_text_with_every_element(golden: Callable[[str, str], None]) -> None:
    golden("everything.txt", show(flat(EVERYTHING)) + "\n")


@pytest.mark.parametrize("name", ["07_bouncing_ball", "08_heavy_top"])
def test_golden_texts(name: str, golden: Callable[[str, str], None]) -> None:
    reporter = Reporter()
    model = flatten(parse(read_source(LANGUAGE / f"{name}.mech", reporter), reporter), reporter)
    golden(f"{name}.txt", show(model) + "\n")


@pytest.mark.parametrize("path", [*NUMBERED, *EXAMPLES], ids=lambda p: p.stem)
def test_samples_and_examples_are_right(path: Path) -> None:
    reporter = Reporter()
    show(flatten(parse(read_source(path, reporter), reporter), reporter))
    assert reporter.diagnostics == ()


@pytest.mark.parametrize("path", sorted((LANGUAGE / "gallery").glob("*.mech")), ids=lambda p: p.stem)
def test_drafts(path: Path) -> None:
    reporter = Reporter()
    with contextlib.suppress(CompileError):
        show(flatten(parse(read_source(path, reporter), reporter), reporter))
    found = {d.code for d in reporter.diagnostics if d.code.startswith("E")}
    assert found == ({REFUSED_DRAFTS[path.stem]} if path.stem in REFUSED_DRAFTS else set())


CHAIN = """
import mech.planar.*;
model Chain
  structural parameter Integer n = 5;
  parameter M = 2 kg;
  gravity {0, -9.81 m/s^2};
  Bar link[n](m = M/n);
  Revolute joint[i in 1:n]((if i == 1 then world else link[i-1].b) -> link[i].a, angle ~ 30 deg);
end Chain;
"""


def calls_of(work: Callable[[], object]) -> int:
    """Count the Python calls that some work takes: unlike its time, the same on every machine."""
    count = 0

    def trace(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event == "call"

    before = sys.getprofile()
    sys.setprofile(trace)
    try:
        work()
    finally:
        sys.setprofile(before)
    return count


def test_work_grows_linearly_with_the_number_of_components() -> None:
    flat(CHAIN, structural={"n": 2})
    few, many = (calls_of(lambda n=n: flat(CHAIN, structural={"n": n})) for n in (20, 80))  # type: ignore[misc]
    base = calls_of(lambda: flat(CHAIN, structural={"n": 1}))
    assert many - base < 4.2 * (few - base)


def test_a_model_flattens_twice_to_the_same() -> None:
    assert flat(CHAIN) == flat(CHAIN)


# ---------------------------------------------------------------- random edits

TOKENS = re.compile(r'"[^"]*"|[A-Za-z_]\w*|\d+(?:\.\d+)?(?:[eE][-+]?\d+)?|\s+|->|:=|<=|>=|.', re.DOTALL)
VALUES = (
    "0", "-1", "world", "1e30", "{1, 2}", "time", "{0, 0, 1}", "true", "(x)", "100000", "3", "2.5", "1 m", "1 kg",
    "sin(1)", "{i for i in 1:3}", "rot(1)", "pos(world)", "(if time > 1 s then 1 else 2)", "pi",
)  # fmt: skip


def edited(text: str, chance: random.Random) -> str:
    """Return a text with a few names, numbers, operators or statements exchanged."""
    tokens = TOKENS.findall(text)
    for _ in range(chance.choice((1, 1, 2, 3))):
        names = [i for i, t in enumerate(tokens) if re.match("[A-Za-z_]", t)]
        numbers = [i for i, t in enumerate(tokens) if t[0].isdigit()]
        operators = [i for i, t in enumerate(tokens) if t in "+-*/^<>"]
        kind = chance.random()
        if kind < 0.45 and names:
            tokens[chance.choice(names)] = tokens[chance.choice(names)]
        elif kind < 0.7 and numbers:
            tokens[chance.choice(numbers)] = chance.choice(VALUES)
        elif kind < 0.8 and operators:
            tokens[chance.choice(operators)] = chance.choice("+-*/^<")
        else:
            statements = "".join(tokens).split(";")
            a, b = chance.randrange(len(statements)), chance.randrange(len(statements))
            statements[a], statements[b] = statements[b], statements[a]
            tokens = TOKENS.findall(";".join(statements))
    return "".join(tokens)


def check_random_edits(count: int, seed: int) -> None:
    chance = random.Random(seed)
    texts = [p.read_text(encoding="utf-8") for p in (*NUMBERED, *EXAMPLES)]
    for _ in range(count):
        text = edited(chance.choice(texts), chance)
        reporter = Reporter()
        began = time.process_time()
        try:
            show(flatten(parse(SourceFile("edited.mech", text), reporter), reporter))
        except CompileError:
            assert any(d.code.startswith("E") for d in reporter.diagnostics)
        except Exception as error:
            raise AssertionError(f"{type(error).__name__}: {error} in\n{text}") from error
        assert time.process_time() - began < 10, text  # as in test_random_edits.py


def test_random_edits_end_in_a_model_or_in_diagnostics() -> None:
    check_random_edits(150, seed=1)


@pytest.mark.slow
def test_many_random_edits() -> None:
    check_random_edits(5000, seed=2)
