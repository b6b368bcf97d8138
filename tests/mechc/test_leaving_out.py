"""What is left out changes no motion, and is nowhere in the code."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from msgspec import Struct
from msgspec.structs import replace

import mechc
from mechc.api import Model
from mechc.cli.main import mechc as program
from mechc.compiler.equations.needs import EVERYTHING
from mechc.compiler.targets.parts import FUNCTIONS
from mechc.measurement import savings as measured
from mechc.measurement.explanation import explanation
from mechc.measurement.savings import LARGEST, SQUARE, code_bytes, least_times, savings
from mechc.runtime.case import Case, SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate.kernel_run import run_kernel
from mechc.runtime.integrate.solver import SolverOptions
from mechc.runtime.integrate.trajectory import Trajectory
from mechc.runtime.outcome import SimulationError
from mechc.runtime.problem import Array

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.mech"))
EPSILON = float(np.finfo(float).eps)
STEPS = 1000
PLANAR_TREE = """
import mech.planar.*;
model Tree
  parameter g = 9.81 m/s^2;
  gravity {0, -g};
  Bar trunk; Revolute foot(world -> trunk.a, angle = 60 deg);
  Bar left; Revolute one(trunk.b -> left.a, angle = 20 deg);
  Bar right; Revolute two(trunk.b -> right.a, angle = -70 deg);
  experiment(stop = 2 s);
end Tree;
"""


@pytest.fixture(autouse=True)
def _at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time in this process, once."""
    monkeypatch.setattr(measured, "_in_a_process", lambda cases, steps: least_times(cases, steps, 0.0))


@pytest.mark.slow
def test_planar_tree_is_at_least_30_percent_smaller() -> None:
    made = savings(mechc.loads(PLANAR_TREE))
    assert made.lean.size is not None and made.everything.size is not None
    assert made.lean.size <= 0.7 * made.everything.size
    assert made.lean.evaluation <= made.everything.evaluation
    assert all(cost.operations >= made.lean.operations for cost in made.parts.values())
    assert all(cost.size is not None and cost.size > made.lean.size / 2 for cost in made.parts.values())


def test_code_size_is_that_of_instructions_and_constants() -> None:
    library = mechc.loads(PLANAR_TREE).problem().library
    assert library is not None
    assert 500 < code_bytes(library) < library.stat().st_size


@pytest.mark.parametrize("name", ["double_pendulum", "four_bar", "rotating_hoop"])
def test_lean_moves_as_keep_all(name: str) -> None:
    compare(Path(__file__).parents[2] / "examples" / f"{name}.mech")


def test_every_part_alone_keeps_the_motion() -> None:
    model = mechc.loads(PLANAR_TREE)
    lean = motion(model)
    disturbed = motion(model, beside=lean)
    for part in sorted(EVERYTHING):
        same(lean, disturbed, motion(model.keeping({part})))


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_moves_as_keep_all(path: Path) -> None:
    compare(path)


def compare(path: Path) -> None:
    """Compare both builds over the longest time in which a disturbance by rounding stays small."""
    model = mechc.load(path).for_experiment(None)
    everything = model.keeping(EVERYTHING)
    assert everything.compilation.program.function("jacobian") is not None
    operations = sum(f.operations for f in everything.compilation.program.functions)
    if operations > LARGEST:
        everything = model.keeping(EVERYTHING - SQUARE)
    share = 1.0
    while True:
        lean = motion(model, share)
        disturbed = motion(model, share, beside=lean)
        if lean is not None and disturbed is not None and apart(lean, disturbed) < 1e-9:
            break
        share /= 4
        assert share > 1e-4, "no horizon"
    same(lean, disturbed, motion(everything, share))


class Motion(Struct, frozen=True):
    """States by name, and the size of each: the largest value of any state of its unit."""

    t: Array
    states: dict[str, Array]
    sizes: dict[str, float]


def motion(model: Model, share: float = 1.0, beside: Motion | None = None) -> Motion | None:
    """Follow a motion by equal steps; it may begin one unit in the last place beside another, also in what is zero there."""
    problem = model.problem()
    functions = load_functions(problem)
    try:
        case = prepare(problem, functions, SimulationOptions(points=21))
    except SimulationError:
        case = prepare(problem, functions, SimulationOptions(points=21, stop=1.0))
    stop = case.begin + share * (case.stop - case.begin)
    case = replace(case, stop=stop, grid=np.linspace(case.begin, stop, 21))
    if beside is not None:
        there = np.array([beside.sizes[q.name] for q in problem.states])
        case = replace(case, y0=case.y0 + EPSILON * np.where(case.y0 == 0, there, case.y0))
    done = run(case)
    if done.failure is not None or not np.isfinite(done.y).all():
        return None
    assert done.t.size == 21 or done.terminated is not None
    largest = np.abs(done.y).max(axis=0)
    sizes: dict[str, float] = {}
    for k, q in enumerate(problem.states):
        rounding = q.kind == "account" and largest[k] < 1e-12  # nothing is lost where a wheel rolls
        sizes[q.unit] = max(sizes.get(q.unit, 0.0), 0.0 if rounding else float(largest[k]))
    states = {q.name: done.y[:, k] for k, q in enumerate(problem.states)}
    return Motion(done.t, states, {q.name: sizes[q.unit] or 1.0 for q in problem.states})


def run(case: Case) -> Trajectory:
    step = (case.stop - case.begin) / STEPS
    options = SolverOptions("rk4", 1e-8, np.ones(case.problem.ny), step, max_steps=20 * STEPS)
    return run_kernel(case, options)


def apart(a: Motion, b: Motion) -> float:
    """Return the largest difference of what both have, relative to its size."""
    assert a.t.size == b.t.size
    shared = [name for name in a.states if name in b.states]
    return max(float(np.abs(a.states[n] - b.states[n]).max()) / a.sizes[n] for n in shared)


def same(lean: Motion | None, disturbed: Motion | None, other: Motion | None) -> None:
    """Assert that a motion differs from the lean one by no more than 1000 times what rounding does; measured: 250, through impacts of a box."""
    assert lean is not None and disturbed is not None and other is not None
    rounding = max(apart(lean, disturbed), EPSILON * np.sqrt(STEPS))
    assert set(lean.states) <= set(other.states)
    assert apart(lean, other) <= 1000 * rounding


def test_python_modules_keep_all(tmp_path: Path) -> None:
    path = tmp_path / "tree.mech"
    path.write_text(PLANAR_TREE)
    module = tmp_path / "tree.py"
    for arguments in (
        ["compile", str(path), "--target", "python", "-o", str(module), "--keep-all"],
        ["run", str(path), "--keep-all", "--stop", "0.1", "--quiet"],
    ):
        done = CliRunner().invoke(program, arguments)
        assert done.exit_code == 0, done.output
    assert "def jacobian(" in module.read_text()


@pytest.mark.parametrize("part", sorted(EVERYTHING))
def test_a_part_brings_the_functions_of_its_table(part: str) -> None:
    model = mechc.loads(PLANAR_TREE)
    lean, kept = ({f.name for f in m.compilation.program.functions} for m in (model, model.keeping({part})))
    assert kept - lean == set(FUNCTIONS.get(part, ()))


def test_explanation_states_reason_and_saving() -> None:
    model = mechc.loads(PLANAR_TREE)
    text = " ".join(explanation(model, saved=savings(model)).split())
    for words in ("left out", "nothing switches", "there are no constraints", "bytes of code", "keep-all"):
        assert words in text


@pytest.mark.slow
def test_large_models_are_explained_without_what_grows_with_their_square() -> None:
    chain = PLANAR_TREE.replace(
        "Bar trunk; Revolute foot(world -> trunk.a, angle = 60 deg);",
        "Bar trunk; Revolute foot(world -> trunk.a, angle = 60 deg);"
        "Bar link[i in 1:50]; Revolute joint[i in 1:50]((if i == 1 then trunk.b else link[i-1].b) -> link[i].a);",
    )
    made = savings(mechc.loads(chain), measured=False)
    assert not SQUARE.intersection(made.parts) and "events" in made.parts
    assert "too large" in explanation(mechc.loads(chain), saved=made)


def test_command_prints_one_object(tmp_path: Path) -> None:
    path = tmp_path / "tree.mech"
    path.write_text(PLANAR_TREE)
    for target in ("c", "python"):
        done = CliRunner().invoke(program, ["explain", str(path), "--target", target, "--json"])
        assert done.exit_code == 0, done.output
        made = json.loads(done.output)
        assert made["lean"]["operations"] < made["keep_all"]["operations"]
        assert made["lean"]["size"] < made["keep_all"]["size"]
        by_topic = {choice["topic"]: choice for choice in made["choices"]}
        assert by_topic["the Jacobian of implicit methods"]["saved"]["operations"] > 0


def test_kept_parts_are_in_the_code_of_the_command(tmp_path: Path) -> None:
    path = tmp_path / "tree.mech"
    path.write_text(PLANAR_TREE)
    for options, present in (([], False), (["--keep-all"], True)):
        out = tmp_path / f"code{len(options)}"
        done = CliRunner().invoke(program, ["compile", str(path), "--target", "c", "-o", str(out), *options])
        assert done.exit_code == 0, done.output
        text = (
            (out / "model.c").read_text()
            if (out / "model.c").exists()
            else "".join(f.read_text() for f in out.glob("*.c"))
        )
        assert ("static const mech_hybrid hybrid" in text) is present
        assert ("Entries of d(rhs)/dy" in text) is present
