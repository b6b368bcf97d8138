"""A row is enough: an operation that no library has, with its own text in C and Python, in every target.

It is added to the table of another process before anything reads it.
"""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

SUPPORT = Path(__file__).resolve().parents[1] / "support"

ADDED = """
import importlib, math, sys, types
from math import exp, log
from pathlib import Path

import mpmath
import mechc.compiler

FOLDER = Path(sys.argv[1])
folder = types.ModuleType("mechc.compiler.graph")
folder.__path__ = [str(Path(mechc.compiler.__file__).parent / "graph")]
sys.modules["mechc.compiler.graph"] = folder
ops = importlib.import_module("mechc.compiler.graph.operations")
row = importlib.import_module("mechc.compiler.graph.operation")


def softplus(x):
    return log(1.0 + exp(x))


SOFTPLUS = row.Operation(
    len(ops.OPERATIONS),
    "softplus",
    1,
    (lambda g, x, n: g.div(g.one, g.add(g.one, g.exp(g.neg(x[0])))),),
    value=softplus,
    digits=lambda context: lambda x: context.log(1 + context.exp(x)),
    sign=row.Sign.NEVER_NEGATIVE,
    c_text="static inline mech_real softplus(mech_real x)\\n{\\n    return log(1 + exp(x));\\n}\\n",
    calls=("exp", "log"),
    python=softplus,
    lanes=None,
    array=None,
    casadi=None,
    jax=None,
    sympy=None,
)
ops.OPERATIONS = (*ops.OPERATIONS, SOFTPLUS)
del sys.modules["mechc.compiler.graph"]

import numpy as np
from all_operations import Quad, program_of, value
from differentiable_modules import module_of
from native_code import Both
from test_lanes import Lanes
from mechc.compiler.program.series import with_series
from mechc.compiler.graph import Graph
from mechc.compiler.symbolic import express

places = [-3.0, -0.5, 0.0, 0.25, 2.0, 5.5, -1.0, 1.0]
wanted = np.array([math.log(1 + math.exp(x)) for x in places])
both = Both(program_of([SOFTPLUS]), FOLDER)
for x in places:
    both.compare("op_softplus", [x, 0.0, 0.0])
states = np.array([[x, 0.0, 0.0] for x in places]).T
np.testing.assert_allclose(Lanes(both, 8)("op_softplus", states), wanted, rtol=1e-15)
with mpmath.workdps(40):
    assert abs(Quad(both, FOLDER)(SOFTPLUS, (0.25,)) - mpmath.log(1 + mpmath.exp(0.25))) < 1e-32
for library in sys.argv[2:]:
    made = module_of(both.program, library, FOLDER, ["op_softplus"])
    found = [float(made.op_softplus(0.0, np.array([x, 0.0, 0.0]), np.zeros(0), np.zeros(0))[0]) for x in places]
    np.testing.assert_allclose(found, wanted, rtol=1e-14)
g = Graph()
assert str(express.express(g, [g.apply(SOFTPLUS.code, g.symbol("x"))], {})[0]) == "softplus(x)"
print("whole")
"""


@pytest.mark.slow
def test_an_operation_of_its_own_is_a_row(tmp_path: Path) -> None:
    (script := tmp_path / "added.py").write_text(ADDED, encoding="utf-8")
    there = [name for name in ("casadi", "jax") if find_spec(name)]
    places = (SUPPORT, SUPPORT.parent / "compiler" / "targets", *sys.path)
    done = subprocess.run(
        [sys.executable, str(script), str(tmp_path), *there],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, places))},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0 and "whole" in done.stdout, done.stderr[-3000:]
