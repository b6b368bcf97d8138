"""What a compilation leaves after while nothing collects circles."""

import gc
import importlib
from fractions import Fraction

import pytest

from mechc.compiler.equations.assemble import assemble
from mechc.compiler.flat.flatten import flatten
from mechc.compiler.interpreter import compiling
from mechc.compiler.mechanics.build import build
from mechc.compiler.program.loops.roll import roll
from mechc.compiler.program.lower import lower
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.source import SourceFile

CHAIN = """
import mech.planar.*;
model Chain
  structural parameter Integer n = 10;
  gravity {0, -9.81} m/s^2;
  Bar link[i in 1:n];
  Revolute joint[i in 1:n]((if i == 1 then world else link[i-1].b) -> link[i].a);
  experiment(stop = 1 s);
end Chain;
"""


def circles(n: int) -> list[int]:
    """Return how many objects each stage leaves in circles."""
    reporter, found = Reporter(), []

    def count() -> None:
        found.append(gc.collect())

    with compiling():
        gc.collect()
        tree = parse(SourceFile("chain.mech", CHAIN), reporter)
        flat = flatten(tree, reporter, structural={"n": Fraction(n)}, search=())
        count()
        system = build(flat, reporter)
        count()
        equations = assemble(system, reporter)
        count()
        program = lower(equations)
        rhs = program.function("rhs")
        count()
        assert rhs is not None and roll(rhs) is not None
        count()
    return found


@pytest.mark.slow
def test_nothing_that_grows_with_the_model_stays_in_circles(monkeypatch: pytest.MonkeyPatch) -> None:
    # the package has a function of that name
    lowering = importlib.import_module("mechc.compiler.program.lower")
    monkeypatch.setattr(lowering, "LONG", 500)
    monkeypatch.setattr(lowering, "SHORT", 300)
    circles(20)  # imports and caches
    few, many = circles(20), circles(60)
    assert max(more - less for less, more in zip(few, many, strict=True)) < 20, (few, many)
