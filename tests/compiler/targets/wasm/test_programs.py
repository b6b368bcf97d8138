"""Programs in WebAssembly: every form of statement against the Python target, whole runs against known answers."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from msgspec.structs import replace
from native_code import bits, random_states
from random_models.python_functions import load_python
from sample_equations import chain, every_operation, pendulum
from wasm_module import Floats, WasmModel, WasmRun, needs_wasmtime

import mechc
from mechc.compiler.equations.model import Equations
from mechc.compiler.pipeline import program_with
from mechc.compiler.program import Program, ProgramFunction, lower, shared_bodies
from mechc.compiler.program.loops.rolled import Loop
from mechc.compiler.program.model import Literal, Load, Statement, Store
from mechc.compiler.targets.c_loops import loops_of
from mechc.compiler.targets.wasm import functions, straight
from mechc.compiler.targets.wasm.link import linked
from mechc.runtime.methods import parts_for
from mechc.web.kernels import kernel_for, loaded

pytestmark = needs_wasmtime


def compare(program: Program, tolerance: float, count: int = 5) -> None:
    """Compare all functions at random states: all bits, or, where the C libraries differ, to a part of the largest number."""
    python, complete = load_python(program)
    wasm = WasmModel(program, kernel_for("dop853", events=program.switching is not None))
    p = wasm.default_parameters()
    expected = np.full(p.size, np.nan)
    complete(expected, np.zeros(len(program.arrays["p"]), np.uint8))
    assert p == pytest.approx(expected, rel=tolerance, abs=0)
    u, z = np.full(program.size("u"), 0.3), np.full(program.size("z"), 1.0)
    for function in program.functions:
        for y in random_states(count, len(program.arrays["y"])):
            found = wasm.call(function.name, 0.7, y, u, z, p)
            known = python[function.name](0.7, np.array(y), u, z, p)
            if tolerance == 0:
                assert bits(found) == bits(known), function.name
            else:
                size = np.abs(known)[np.isfinite(known)].max(initial=0.0)
                assert np.array_equal(np.isnan(found), np.isnan(known)), function.name
                assert np.allclose(found, known, rtol=0, atol=tolerance * size, equal_nan=True), function.name


@pytest.mark.parametrize("model", [pendulum, every_operation], ids=["pendulum", "every_operation"])
def test_functions_agree_with_python(model: Callable[[], Equations]) -> None:
    """Arrays of every kind, guarded parameters, tables, truth values; 1e-13: errors of two libraries in nested functions."""
    compare(lower(model()), 1e-13)


def test_a_parameter_that_is_set_stays() -> None:
    wasm = WasmModel(lower(pendulum()), kernel_for("dop853", events=False))
    usual = wasm.default_parameters()
    wasm.instance.view(wasm.places[3], 1)[:] = 7.0
    wasm.instance.view(wasm.behind, 1, np.uint8)[:] = 1
    wasm.instance.at(wasm.linked.entries["parameters"])(wasm.places[3], wasm.behind)
    assert wasm.instance.view(wasm.places[3], 1)[0] == 7.0 != usual[0]


def test_long_functions_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Values pass from piece to piece through a workspace on the stack."""
    monkeypatch.setattr(functions, "LONGEST", 40)
    monkeypatch.setattr(functions, "loops_of", lambda program: {})
    compare(lower(chain(6, joint_angles=True)), 1e-12)


PAIRS = """
model Bodies
  dimensionless;
  structural parameter Integer n = 30;
  parameter Real m[n] = 1;
  coordinate Real r[n, 3] = {{i*1.7, i*i*0.3, 0.3*i} for i in 1:n};
  for i in 1:n loop
    kinetic 1/2*m[i]*dot(der(r[i]), der(r[i]));
    for j in i+1:n loop
      potential -m[i]*m[j]/norm(r[i] - r[j]);
    end for;
  end for;
  experiment(stop = 3);
end Bodies;
"""


@pytest.fixture(scope="module")
def pairs() -> Program:
    """The rates alone, which are loops: roots and arithmetic, of which every bit is defined."""
    program = mechc.loads(PAIRS).compilation.program
    program = replace(program, functions=tuple(f for f in program.functions if f.name == "rhs"))
    assert loops_of(program)["rhs"].workspace
    return program


def test_functions_as_loops_have_the_bits_of_straight_lines(pairs: Program) -> None:
    compare(pairs, 0, 2)


def test_constants_that_change_from_turn_to_turn() -> None:
    text = """
function pull(Real x, Integer n) -> Real
  var s = 0;
  for i in 1:n loop
    s := s - sqrt(x^2 + i/7)*(i - 0.3)/(x - 3*i);
  end for;
  return s;
end pull;
model Long
  dimensionless;
  coordinate Real x = 1;
  kinetic 1/2*der(x)^2;
  force pull(x, 2000) on x;
end Long;
"""
    program = mechc.loads(text).compilation.program
    program = replace(program, functions=tuple(f for f in program.functions if f.name == "rhs"))
    assert loops_of(program)["rhs"].numbers
    compare(program, 0, 2)


def test_what_an_iteration_leaves_to_the_next() -> None:
    text = """
function follow(Real x, Integer n) -> Real
  var a = x;
  var c = 1;
  for i in 1:n loop
    a := sqrt(a^2 + c*i/7)/(1 + a^2);
    c := (c + x)/(1 + a);
  end for;
  return a - c;
end follow;
model Long
  dimensionless;
  coordinate Real x = 1;
  kinetic 1/2*der(x)^2;
  force follow(x, 1000) on x;
end Long;
"""
    program = mechc.loads(text).compilation.program
    program = replace(program, functions=tuple(f for f in program.functions if f.name == "rhs"))
    assert any(len(i.carried) > 1 for i in loops_of(program)["rhs"].items if isinstance(i, Loop))
    compare(program, 0, 2)


def test_locals_are_used_again_in_loops(pairs: Program, monkeypatch: pytest.MonkeyPatch) -> None:
    """Browsers and wasmtime take no function with more than 50 000; two crates with friction had twice as many in their
    Jacobian, and this had 702."""
    counts = []
    body = straight.FunctionWriter.body

    def counted(writer: straight.FunctionWriter) -> bytes:
        counts.append(len(writer.kinds))
        return body(writer)

    monkeypatch.setattr(straight.FunctionWriter, "body", counted)
    linked(pairs, loaded(kernel_for("dop853", events=False)))
    assert max(counts) < 50


def test_a_workspace_that_is_too_large_for_the_stack(pairs: Program, monkeypatch: pytest.MonkeyPatch) -> None:
    """It lies among the data: with the same result."""
    (y,) = random_states(1, 180)
    kernel = kernel_for("dop853", events=False)
    found = []
    for on_stack in (1 << 20, 0):
        monkeypatch.setattr(functions, "ON_STACK", on_stack)
        wasm = WasmModel(pairs, kernel)
        found.append(bits(wasm.call("rhs", 0.0, y, [], [], wasm.default_parameters())))
    assert found[0] == found[1]


SPHERE = """
model Sphere
  dimensionless;
  structural parameter Integer n = 6;
  coordinate p[n, 3] ~ {{1, 0.1*i, i*i*0.1} for i in 1:n};
  kinetic 1/2*sum(dot(der(p[i]), der(p[i])) for i in 1:n);
  potential sum(1/norm(p[i] - p[j]) for i in 1:n for j in i+1:n);
  for i in 1:n loop
    constraint sphere[i]: dot(p[i], p[i]) = 1;
  end for;
  output lambda[n] = {multiplier(sphere[i]) for i in 1:n};
end Sphere;
"""


def test_what_functions_have_in_common_is_placed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rates and multipliers are nearly the same operations; a Jacobian is mostly zeros, which are written together."""
    program = mechc.loads(SPHERE).compilation.program
    kernel = loaded(kernel_for("dop853", events=False))
    monkeypatch.setattr(functions, "LONGEST", 40)
    monkeypatch.setattr(shared_bodies, "WORTH", 10)
    compare(program, 0)
    size = len(linked(program, kernel).module)
    monkeypatch.setattr(shared_bodies, "WORTH", 1_000_000)
    apart = len(linked(program, kernel).module)
    bare = sum(map(len, kernel.parts.values()))
    assert apart - size > 0.25 * (apart - bare)
    monkeypatch.setattr(straight, "MANY", 1_000_000)
    assert len(linked(program, kernel).module) - apart > 90 * 12  # bytes of 90 constants and stores


def test_zeros_between_other_values() -> None:
    """Also such that stand there without an operation between them, and in any order."""
    program = lower(pendulum())
    other, places = {3, 8, 14, 15}, [*range(13), 20, 19, 18, 17, 16, 15, 14, 13]
    stores = [Store("out", k, 1 if k in other else 0) for k in places]
    body: tuple[Statement, ...] = (Literal(Fraction(0)), Load("y", 0), *stores)
    compare(replace(program, functions=(ProgramFunction("rhs", "", len(places), (body,)),)), 0)


# ---------------------------------------------------------------- whole runs


def ran(text: str, stop: float, method: str = "dop853", step: float = 0.0) -> tuple[WasmRun, Floats]:
    """Return a run by the page's own kernel, and the states along it."""
    compilation = mechc.loads(text, keep={"scene"}).compilation
    program = program_with(compilation, {*compilation.parts, *parts_for(method)})
    kernel = kernel_for(method, events=program.switching is not None)
    experiment = program.experiments[0].name if program.experiments else None
    machine = WasmRun(linked(program, loaded(kernel), experiment).module)
    status, rows = machine.run(stop, kernel.methods.index(method), 1e-10, step)
    assert status in (1, 3)
    return machine, rows


def run(text: str, stop: float, method: str = "dop853", step: float = 0.0) -> Floats:
    return ran(text, stop, method, step)[1]


OSCILLATOR = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*4 N/m*x^2;"
STEPS = dict.fromkeys(("verlet", "rattle"), 1e-4)


@pytest.mark.parametrize(
    "method", ["dop853", "rk4", "radau5", "gauss6", "verlet", "rattle", "lobatto4", "auto", "taylor"]
)
def test_methods(method: str) -> None:
    """x = cos 2t; steps of 1e-4 of the second order are off by less than 1e-7."""
    rows = run(OSCILLATOR, 2.0, method, STEPS.get(method, 1e-3))
    assert rows[-1] == pytest.approx([np.cos(4.0), -2 * np.sin(4.0)], abs=1e-7)


CIRCLES = """
model Circles
  dimensionless;
  structural parameter Integer n = {n};
  coordinate Real x[n] = 1;
  coordinate Real y[n] = 0;
  for i in 1:n loop
    initial der(y[i]) = 1;
    kinetic 1/2*(der(x[i])^2 + der(y[i])^2);
    potential -1/sqrt(x[i]^2 + y[i]^2);
  end for;
  experiment(stop = 5);
end Circles;
"""


@pytest.mark.parametrize(("n", "least", "most"), [(1, 1, 8), (3, 9, 64), (16, 65, 999)])
def test_taylor_series_of_few_and_many_slots(n: int, least: int, most: int) -> None:
    """One loop over the orders, with and without sums that end with the latest products, and order by order."""
    text = CIRCLES.replace("{n}", str(n))
    series = program_with(mechc.loads(text).compilation, {"series"}).series
    assert series is not None and least <= series.n_slots <= most
    rows = run(text, 5.0, "taylor")
    t = np.linspace(0, 5, len(rows))
    assert np.allclose(rows[:, :n], np.cos(t)[:, None], rtol=0, atol=1e-8)
    assert np.allclose(rows[:, n : 2 * n], np.sin(t)[:, None], rtol=0, atol=1e-8)


def test_impacts() -> None:
    """Dropped from 1 m with g = 8 m/s^2, restitution 1/2: the ground at 0.5 s, the next time 0.5 s later."""
    rows = run(
        "coordinate Length y = 1 m; kinetic 1/2*1 kg*der(y)^2; potential 1 kg*8 m/s^2*y; contact ground: y restitution 0.5;",
        0.75,
    )
    assert rows[-1, :2] == pytest.approx([2 * 0.25 - 4 * 0.25**2, 0.0], abs=1e-9)


def test_a_crowd_of_contacts() -> None:
    """70 balls in a row, apart by a gap each: the blow goes through to the last one, which flies on alone."""
    rows = run(
        """
        structural parameter Integer n = 70;
        coordinate Length x[n] = {i*1 m for i in 1:n};
        initial der(x[1]) = 2 m/s;
        kinetic sum(1/2*1 kg*der(x[i])^2 for i in 1:n);
        for i in 1:n-1 loop
          contact hit[i]: x[i+1] - x[i] - 0.99 m restitution 1;
        end for;
        """,
        1.0,
    )
    expected = np.arange(1, 71) + np.where(np.arange(70) == 69, 2 - 69 * 0.01, 0.01)
    assert rows[-1, :70] == pytest.approx(expected, abs=1e-8)


def test_loads_that_rigid_bodies_do_not_determine() -> None:
    """A plate on four legs whose weight grows: each carries a quarter, until one of them feels 5 N."""
    rows = run(
        """
        parameter Length foot[4, 2] = {{0.2, 0.2}, {-0.2, 0.2}, {-0.2, -0.2}, {0.2, -0.2}} m;
        coordinate z = 0 m; coordinate Angle a = 0 rad; coordinate Angle b = 0 rad;
        kinetic 1/2*1 kg*der(z)^2 + 1/2*0.1 kg.m^2*(der(a)^2 + der(b)^2);
        force -(10 N + 20 N*time/(1 s)) on z;
        for i in 1:4 loop
          contact leg[i]: z + foot[i, 2]*a - foot[i, 1]*b;
        end for;
        state Real sum = 0; state Real late = 0; discrete Real felt = 0;
        equation der(sum) = multiplier(leg[4])/(1 N.s);
        equation der(late) = felt/(1 s);
        when multiplier(leg[2]) > 5 N then felt := 1; end when;
        """,
        1.0,
    )
    assert rows[-1, 6:8] == pytest.approx([5.0, 0.5], abs=1e-9)


def test_no_event_is_lost() -> None:
    """A clock of 1 kHz for 10 s: more events than there is room for in the beginning."""
    machine, _ = ran(
        "coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; discrete n = 0; when sample(1 ms) then n := n + 1; end when;",
        10.0,
    )
    times = machine.event_times()
    assert np.allclose(times, np.arange(10_001) * 1e-3, rtol=0, atol=1e-12)
