"""What the runtime is told about a program."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from msgspec.structs import replace
from native_code import compile_c
from sample_equations import pendulum

from mechc.compiler.equations.model import AssertionText
from mechc.compiler.program import lower
from mechc.compiler.targets.c import emit_c
from mechc.compiler.targets.description import describe, make_problem
from mechc.compiler.targets.python import load_python
from mechc.lang.source import SourceFile, Span
from mechc.runtime.problem import Origin


def test_the_description_is_plain_data() -> None:
    data = json.loads(json.dumps(describe(lower(pendulum()))))
    assert data["name"] == "Pendulum"
    assert (data["nq"], data["nv"], data["nx"], data["nh"]) == (1, 1, 0, 1)
    assert [s["name"] for s in data["states"]] == ["theta", "der(theta)"]
    assert data["states"][0]["display"] == "deg"
    assert data["experiments"][0]["settings"][1] == {"array": "p", "index": 1, "guess": False}
    assert "functions" not in data


def test_places_are_lines_of_the_source() -> None:
    source = SourceFile("a.mech", "model A {\n  assert theta < 3;\n}\n")
    start = source.text.index("theta")
    model = replace(pendulum(), assertions=(AssertionText("too far", Span(source, start, start + 5)),))
    (assertion,) = make_problem(lower(model)).assertions
    assert assertion.message == "too far"
    assert assertion.origin == Origin("a.mech", 2, 10, "  assert theta < 3;")


def test_a_problem_with_functions_and_one_with_a_library_agree(tmp_path: Path) -> None:
    """Loaded by the runtime, both ways."""
    from mechc.runtime.functions import load_functions

    program = lower(pendulum())
    functions, parameters = load_python(program)
    in_python = load_functions(make_problem(program, functions=functions, parameters_function=parameters))
    in_c = load_functions(make_problem(program, library=compile_c(emit_c(program), tmp_path)))
    results = []
    for loaded in (in_python, in_c):
        p = np.full(program.size("p"), np.nan)
        loaded.parameters(p, np.zeros(5, np.uint8))
        y, z = np.array([0.3, 0.4]), np.array([1.0])
        assert loaded.inputs is not None
        assert loaded.outputs is not None
        u = loaded.inputs(0.5, np.empty(0), np.empty(1), np.empty(0), p)
        experiment = loaded.experiments["experiment_swing"](0.0, y, u, z, p)
        results.append([*p, *u, *experiment, *loaded.rhs(0.5, y, u, z, p), *loaded.outputs(0.5, y, u, z, p)])
    assert results[0] == results[1]
