"""The interface of a model, through its stages."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import msgspec
import numpy as np
from native_code import compile_c
from random_models.python_functions import load_python
from sample_equations import pendulum

from mechc.compiler.equations.model import CompilerInterface, Equations, origin
from mechc.compiler.program import lower
from mechc.compiler.program.model import Program
from mechc.compiler.targets.c import emit_c
from mechc.lang.source import SourceFile, Span
from mechc.runtime.functions import with_code
from mechc.runtime.interface import ModelInterface, Origin, interface_of
from mechc.runtime.problem import Problem


def test_the_interface_of_a_program_is_plain_data() -> None:
    interface = ModelInterface(**interface_of(lower(pendulum())))
    data = json.loads(msgspec.json.encode(interface))
    assert data["name"] == "Pendulum"
    assert (data["nq"], data["nv"], data["nx"], data["nh"]) == (1, 1, 0, 1)
    assert [s["name"] for s in data["states"]] == ["theta", "der(theta)"]
    assert data["states"][0]["display"] == "deg"
    assert data["experiments"][0]["settings"][1] == {"array": "p", "index": 1, "guess": False}
    assert msgspec.json.decode(msgspec.json.encode(interface), type=ModelInterface) == interface


def test_stages_share_no_field_but_their_functions() -> None:
    """What a model is told and tells is stated once; the functions have another form at each stage."""
    stages = (ModelInterface, CompilerInterface, Equations, Program, Problem)
    counted = Counter(name for stage in stages for name in stage.__annotations__)
    assert {name for name, count in counted.items() if count > 1} == {"functions", "parameters_function"}


def test_places_are_lines_of_the_source() -> None:
    source = SourceFile("a.mech", "model A {\n  assert theta < 3;\n}\n")
    start = source.text.index("theta")
    assert origin(Span(source, start, start + 5)) == Origin("a.mech", 2, 10, "  assert theta < 3;")


def test_a_problem_with_a_library_gives_what_the_statements_say(tmp_path: Path) -> None:
    """Loaded by the runtime, and evaluated in Python."""
    from mechc.runtime.functions import load_functions

    program = lower(pendulum())
    functions, parameters = load_python(program)
    loaded = load_functions(with_code(program, library=compile_c(emit_c(program), tmp_path)))
    results = []
    for fill in (parameters, loaded.parameters):
        p = np.full(program.size("p"), np.nan)
        fill(p, np.zeros(5, np.uint8))
        results.append(p.tolist())
    assert results[0] == results[1]
    y, z, nothing = np.array([0.3, 0.4]), np.array([1.0]), np.empty(0)
    assert loaded.inputs is not None and loaded.outputs is not None
    u = loaded.inputs(0.5, nothing, np.empty(1), nothing, p)
    assert u.tolist() == functions["inputs"](0.5, nothing, np.empty(1), nothing, p).tolist()
    swing = loaded.experiments["experiment_swing"]
    for name, found in (("experiment_swing", swing), ("rhs", loaded.rhs), ("outputs", loaded.outputs)):
        assert found(0.5, y, u, z, p).tolist() == functions[name](0.5, y, u, z, p).tolist(), name
