"""A model without constraints holds nothing of what constraints need: not in its text, not in its library."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess

import pytest

import mechc
from mechc.compiler.targets.c import emit_c
from mechc.measurement.explanation import explanation
from mechc.runtime.functions import load_functions

TREE = "import mech.planar.*;gravity {0, -9.81 m/s^2};Bar bar;Revolute pin(world -> bar.a, angle = 1 rad);"
LOOP = f"{TREE}Bar other;Revolute hinge(bar.b -> other.a);cut Revolute last(other.b -> world * trans({{1, 0}} m));"
FUNCTIONS = ("project_position", "project_velocity", "displace", "constraints", "constraint_jacobian")
WORDS = ("assembly", "multiplier", *FUNCTIONS)


def test_text() -> None:
    tree, loop = (emit_c(mechc.loads(text).compilation.program) for text in (TREE, LOOP))
    head = tree.split("static const mech_model")[0]
    assert [word for word in WORDS if word in head] == []
    assert all(f"{word}(" in loop for word in ("assembly", "assembly_jacobian", *FUNCTIONS))
    assert 3 * len(tree) < len(loop)


def test_singular_positions() -> None:
    """What passes them is only in models that meet some."""
    flat = LOOP.replace("cut", "Bar third;Revolute knee(other.b -> third.a, angle ~ -1 rad);cut")
    flat = flat.replace("last(other.b", "last(third.b")
    assert [("closeness(" in emit_c(mechc.loads(text).compilation.program)) for text in (LOOP, flat)] == [
        False,
        True,
    ]


def test_library() -> None:
    tree, loop = (mechc.loads(text).problem() for text in (TREE, LOOP))
    for problem, present in ((tree, False), (loop, True)):
        assert hasattr(ctypes.CDLL(str(problem.library)), "assembly") is present
        functions = load_functions(problem)
        assert functions.struct is not None
        assert [getattr(functions.struct, name) is not None for name in FUNCTIONS] == [present] * 5
        assert (functions.struct.n_velocity > 0, functions.assembly is not None) == (present, present)
        assert (len(problem.constraints) > 0, len(problem.assembly) > 0) == (present, present)
    assert tree.library is not None and loop.library is not None
    assert tree.library.stat().st_size < loop.library.stat().st_size


@pytest.mark.skipif(shutil.which("nm") is None, reason="lists the symbols by nm")
def test_symbols() -> None:
    """What the model itself defines: a tree has the functions that every model has, and nothing else."""
    found = []
    for text in (TREE, LOOP):
        library = mechc.loads(text).problem().library
        listed = subprocess.run(["nm", str(library)], capture_output=True, text=True, check=True).stdout
        found.append(set(re.findall(r" [tT] (\w+?)(?:\.\w+)*$", listed, re.M)))
    tree, loop = found
    assert {"rhs", "initial", "outputs", "parameters"} <= tree
    turns = {"mech_far_turns"}  # of sincos_batch.h, where a function has several angles
    assert loop - tree - turns == {"assembly", "assembly_jacobian", "balance", *FUNCTIONS}


def test_run() -> None:
    """Nothing is assembled, nothing projected; no step looks for events."""
    four_bar = LOOP.replace("cut", "Bar third;Revolute knee(other.b -> third.a, angle ~ -1 rad);cut")
    four_bar = four_bar.replace("last(other.b", "last(third.b").replace("{1, 0} m", "{1.5, 0} m")
    tree, loop = (mechc.loads(text).simulate(stop=0.1, estimate_error=False) for text in (TREE, four_bar))
    assert tree.statistics.drift_position is None and tree.statistics.drift_velocity is None
    assert loop.statistics.drift_position is not None and loop.statistics.drift_velocity is not None
    assert (tree.accuracy.constraints, tree.events) == ((), ())
    struct = load_functions(mechc.loads(TREE).problem()).struct
    assert struct is not None and not struct.hybrid


def test_it_is_said() -> None:
    decisions = [
        next(c.decision for c in mechc.loads(text).compilation.equations.choices if "projection" in c.topic)
        for text in (TREE, LOOP)
    ]
    assert decisions == ["left out", "needed"]
    assert "multipliers, projection and assembly" in " ".join(explanation(mechc.loads(TREE)).split())
