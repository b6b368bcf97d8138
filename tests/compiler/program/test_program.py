"""Lowering, hoisting, order, splitting, checking, and the text of programs."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from msgspec.structs import replace
from random_models.python_functions import load_python
from sample_equations import chain, equations, every_operation, pendulum

from mechc.compiler.equations.model import Function
from mechc.compiler.graph import Graph, Node
from mechc.compiler.graph import operations as ops
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.malformed import Malformed
from mechc.compiler.program import Program, ProgramFunction, lower
from mechc.compiler.program.chunk import chunk, split
from mechc.compiler.program.lower import hoistable, rule_order, schedule
from mechc.compiler.program.model import (
    Body,
    Load,
    Operate,
    Statement,
    Store,
    identifiers,
)
from mechc.compiler.program.show import show
from mechc.compiler.program.verify import verify
from mechc.runtime.interface import Quantity


def with_rhs(program: Program, *bodies: Body, n_out: int = 1, workspace: int = 0) -> Program:
    return replace(program, functions=(ProgramFunction("rhs", "", n_out, bodies, workspace),))


# ---------------------------------------------------------------------- hoisting


def test_hoisted_are_the_largest_expressions_of_parameters() -> None:
    g = Graph()
    x, a, b = g.symbol("x"), g.symbol("a"), g.symbol("b")
    inner = g.mul(a, b)
    outer = g.sqrt(inner)
    layout = equations(
        g,
        [],
        states=[(x, Quantity("x", "state", ""))],
        nx=1,
        parameters=[(a, Quantity("a", "parameter", ""), g.one), (b, Quantity("b", "parameter", ""), g.one)],
    ).layout
    assert hoistable(g, layout, [g.mul(outer, x)]) == [outer]
    # a sign alone is left where it is, a plain parameter or constant too
    assert hoistable(g, layout, [g.select(g.less(x, a), g.neg(a), g.constant(3))]) == []
    assert hoistable(g, layout, [g.atan2(g.neg(inner), x)]) == [inner]
    # an output that depends on parameters only
    assert hoistable(g, layout, [outer]) == [outer]
    assert hoistable(g, layout, []) == []
    # both are needed where both are used
    assert hoistable(g, layout, [g.mul(outer, x), g.add(inner, x)]) == [inner, outer]


def test_discrete_variables_and_inputs_are_no_constants_of_the_run() -> None:
    g = Graph()
    x, u, z = g.symbol("x"), g.symbol("u"), g.symbol("z")
    layout = equations(
        g,
        [],
        states=[(x, Quantity("x", "state", ""))],
        nx=1,
        inputs=[(u, Quantity("u", "input", ""))],
        discretes=[(z, Quantity("z", "discrete", ""))],
    ).layout
    assert hoistable(g, layout, [g.mul(g.exp(z), x), g.mul(g.exp(u), x)]) == []


def test_hoisted_constants_follow_changed_parameters() -> None:
    """The pendulum with J = m l^2 free and with J given."""
    program = lower(pendulum())
    assert program.nh == 1
    functions, complete = load_python(program)
    y, u, z = np.array([0.3, -0.2]), np.array([0.5]), np.array([0.0])
    for m, length, inertia in ((2.0, 0.8, None), (5.0, 1.3, None), (1.5, 0.4, 7.0)):
        p = np.array([m, length, 9.80665, 0.05, inertia or np.nan, np.nan])
        complete(p, np.array([1, 1, 0, 0, inertia is not None], np.uint8))
        moment = inertia or m * length**2
        expected = (0.5 + 0.05 * 0.2 - m * 9.80665 * length * np.sin(0.3)) / moment
        assert functions["rhs"](0.0, y, u, z, p)[1] == pytest.approx(expected, rel=1e-14)


def test_nothing_is_hoisted_from_what_runs_once() -> None:
    g = Graph()
    x, a = g.symbol("x"), g.symbol("a")
    model = equations(
        g,
        [Function("rhs", "", (x,)), Function("initial", "", (g.exp(a),))],
        states=[(x, Quantity("x", "state", ""))],
        nx=1,
        parameters=[(a, Quantity("a", "parameter", ""), g.one)],
    )
    assert lower(model).nh == 0


def test_parameters_come_after_those_they_depend_on() -> None:
    g = Graph()
    a, b, c = (g.symbol(n) for n in "abc")
    entries = [
        (s, Quantity(g.name(s), "parameter", ""), rule)
        for s, rule in ((a, g.mul(b, c)), (b, g.add(c, c)), (c, g.two))
    ]
    model = equations(g, [], parameters=entries)
    rules = {rule.index: rule.value for rule in model.parameter_rules}
    assert rule_order(g, model.layout, rules) == [2, 1, 0]
    functions, complete = load_python(lower(model))
    assert functions == {}
    p = np.full(3, np.nan)
    complete(p, np.zeros(3, np.uint8))
    assert p.tolist() == [8.0, 4.0, 2.0]
    p = np.array([np.nan, 10.0, np.nan])
    complete(p, np.array([0, 1, 0], np.uint8))
    assert p.tolist() == [20.0, 10.0, 2.0]


@pytest.mark.parametrize("case", ["circle", "state"])
def test_impossible_rules_are_refused(case: str) -> None:
    g = Graph()
    a, b, x = g.symbol("a"), g.symbol("b"), g.symbol("x")
    rule = g.sin(b) if case == "circle" else g.sin(x)
    model = equations(
        g,
        [],
        states=[(x, Quantity("x", "state", ""))],
        nx=1,
        parameters=[(a, Quantity("a", "parameter", ""), rule), (b, Quantity("b", "parameter", ""), g.cos(a))],
    )
    with pytest.raises(ValueError, match="depends on itself" if case == "circle" else "more than parameters"):
        lower(model)


# ---------------------------------------------------------------------- order


def test_the_order_is_topological_complete_and_keeps_sine_and_cosine_together() -> None:
    model = chain(12, joint_angles=True)
    g = model.graph
    outputs = model.functions[0].outputs
    order = schedule(g, outputs)
    assert sorted(order) == g.reach(outputs)
    place = {n: i for i, n in enumerate(order)}
    assert all(place[a] < place[n] for n in order for a in g.args(n))
    sines = [n for n in order if g.op(n) == ops.SIN]
    assert len(sines) >= 12
    for n in sines:
        cosine = [c for c in order if g.op(c) == ops.COS and g.args(c) == g.args(n)]
        assert not cosine or abs(place[cosine[0]] - place[n]) == 1


def alive(graph: Graph, order: list[Node]) -> float:
    """Return how many results are alive at once, on average."""
    last = {a: i for i, n in enumerate(order) for a in graph.args(n)}
    ends: dict[int, int] = {}
    count = total = 0
    for i, n in enumerate(order):
        if graph.op(n) > ops.SYMBOL and n in last:
            count += 1
            ends[last[n]] = ends.get(last[n], 0) + 1
        total += count
        count -= ends.get(i, 0)
    return total / len(order)


@pytest.mark.parametrize("joint_angles", [True, False])
def test_fewer_results_are_alive_than_in_the_order_of_construction(joint_angles: bool) -> None:
    """Measured: 0.83 and 0.80 of them."""
    model = chain(30, joint_angles=joint_angles)
    outputs = model.functions[0].outputs
    graph = model.graph
    assert alive(graph, schedule(graph, outputs)) < 0.9 * alive(graph, graph.reach(outputs))


def test_a_very_deep_expression_needs_no_recursion() -> None:
    g = Graph()
    y = g.symbol("x")
    for _ in range(5000):
        y = g.sin(g.add(y, g.one))
    assert len(schedule(g, [y])) == 10_002


# ---------------------------------------------------------------------- statements


def test_every_output_is_stored_also_twice_the_same_node() -> None:
    g = Graph()
    x = g.symbol("x")
    model = equations(
        g,
        [Function("rhs", "", (g.sin(x), x, g.sin(x), g.one))],
        states=[(x, Quantity("x", "state", ""))],
        nx=1,
    )
    program = lower(model)
    verify(program)
    functions, _ = load_python(program)
    out = functions["rhs"](0.0, np.array([0.5]), np.empty(0), np.empty(0), np.empty(0))
    assert out.tolist() == [np.sin(0.5), 0.5, np.sin(0.5), 1.0]


def test_a_program_computes_what_the_graph_says() -> None:
    model = chain(5, joint_angles=True)
    program = lower(model)
    verify(program)
    functions, complete = load_python(program)
    p = np.full(program.size("p"), np.nan)
    complete(p, np.zeros(len(model.parameters), np.uint8))
    y = np.linspace(-1.0, 2.0, 10)
    arrays = {"y": y, "p": p}
    environment = {n: float(arrays[s.array][s.index]) for n, s in model.layout.items()}
    expected = evaluate(model.graph, model.functions[0].outputs, environment)
    found = functions["rhs"](0.0, y, np.empty(0), np.empty(0), p)
    np.testing.assert_allclose(found, expected, rtol=1e-13)


# ---------------------------------------------------------------------- splitting


@pytest.mark.parametrize("size", [1, 7, 50, 300])
def test_split_programs_are_well_formed_and_of_the_size_asked(size: int) -> None:
    program = lower(chain(20))
    done = chunk(program, size)
    verify(done)
    rhs = done.function("rhs")
    assert rhs is not None
    assert rhs.operations == program.functions[0].operations
    counts = [sum(type(s) is Operate for s in body) for body in rhs.bodies]
    assert len(counts) == 1 if rhs.operations <= 1.5 * size else len(counts) > 1
    # sine and cosine stay together, so that a body may hold one operation more
    assert len(counts) == 1 or max(counts) <= size + 1


def test_sine_and_cosine_of_one_argument_stay_in_one_body() -> None:
    for size in range(5, 40):
        rhs = chunk(lower(chain(8)), size).functions[0]
        bodies = [[s for s in body if isinstance(s, Operate)] for body in rhs.bodies]
        counts = [[s.code for s in body].count(ops.SIN) for body in bodies]
        assert counts == [[s.code for s in body].count(ops.COS) for body in bodies]
        assert sum(counts) == 8


def test_the_workspace_is_used_again() -> None:
    """It grows with the links for what the second sweep needs, but holds far less than all results."""
    rhs = chunk(lower(chain(60)), 100).functions[0]
    assert rhs.workspace < rhs.operations / 4


def test_short_functions_stay_whole() -> None:
    program = lower(pendulum())
    assert chunk(program) == program


def test_a_long_parameters_function_is_split_too() -> None:
    g = Graph()
    x = g.symbol("x")
    symbols = [g.symbol(f"p{i}") for i in range(50)]
    total = x
    for i, s in enumerate(symbols):
        total = g.add(total, g.mul(g.sin(total), g.exp(g.mul(s, g.constant(i + 2)))))
    model = equations(
        g,
        [Function("rhs", "", (total,))],
        states=[(x, Quantity("x", "state", ""))],
        nx=1,
        parameters=[
            (s, Quantity(g.name(s), "parameter", ""), g.constant(Fraction(i, 100)))
            for i, s in enumerate(symbols)
        ],
    )
    program = lower(model)
    assert program.nh == 50
    done = chunk(program, 20)
    verify(done)
    assert len(done.parameters_function.bodies) >= 4


# ---------------------------------------------------------------------- the checker


def test_all_samples_are_well_formed() -> None:
    for model in (pendulum(), every_operation(), chain(3)):
        verify(lower(model))


SINE, SUM = ops.SIN, ops.ADD
Y0 = Load("y", 0)


@pytest.mark.parametrize(
    ("message", "body"),
    [
        ("not computed before", (Y0, Operate(SINE, (1,)), Store("out", 0, 1))),
        ("not computed before", (Y0, Store("out", 0, 0), Operate(SINE, (1,)))),
        ("has no operation", (Y0, Operate(999, (0,)), Store("out", 0, 1))),
        ("gives 1 operands to add", (Y0, Operate(SUM, (0,)), Store("out", 0, 1))),
        (r"does not store out\[0\]", (Y0,)),
        (r"writes out\[0\] twice", (Y0, Store("out", 0, 0), Store("out", 0, 0))),
        (r"writes out\[1\], which does not exist", (Y0, Store("out", 1, 0))),
        (r"reads y\[2\]", (Load("y", 2), Store("out", 0, 0))),
        (r"reads w\[0\]", (Load("w", 0), Store("out", 0, 0))),
        (r"writes p\[0\], which does not exist", (Y0, Store("p", 0, 0), Store("out", 0, 0))),
        ("wrong guard", (Y0, Store("out", 0, 0, True))),
    ],
)
def test_malformed_programs_are_found(message: str, body: tuple[Statement, ...]) -> None:
    program = lower(pendulum())
    with pytest.raises(Malformed, match=message):
        verify(with_rhs(program, body))


def test_parameters_read_hoisted_constants_only_after_writing_them() -> None:
    program = lower(pendulum())
    broken = replace(
        program.parameters_function, bodies=((Load("p", 5), *program.parameters_function.bodies[0][1:]),)
    )
    with pytest.raises(Malformed, match=r"reads p\[5\]"):
        verify(replace(program, parameters_function=broken))


# ---------------------------------------------------------------------- texts


def test_the_text_of_a_program() -> None:
    g = Graph()
    x, a = g.symbol("x"), g.symbol("a")
    model = equations(
        g,
        [Function("rhs", "", (g.mul(g.sin(x), g.exp(a)),))],
        name="Short",
        states=[(x, Quantity("x", "state", "m"))],
        nx=1,
        parameters=[(a, Quantity("a", "parameter", ""), g.constant(Fraction(1, 3)))],
    )
    assert show(lower(model)) == (
        "program Short: 0 coordinates, 0 velocities, 1 further states, 1 hoisted constants\n"
        "  y[0] x [m]\n"
        "  p[0] a\n"
        "\n"
        "function parameters: 1 operations\n"
        "  v0 = 1/3\n"
        "  p[0] = v0 unless set\n"
        "  v2 = p[0]  # a\n"
        "  v3 = exp v2\n"
        "  p[1] = v3\n"
        "\n"
        "function rhs: 2 operations\n"
        "  v0 = y[0]  # x\n"
        "  v1 = sin v0\n"
        "  v2 = p[1]\n"
        "  v3 = mul v1 v2\n"
        "  out[0] = v3\n"
    )


def test_split_functions_show_their_workspace() -> None:
    text = show(chunk(lower(chain(5)), 50))
    assert "bodies, workspace of" in text
    assert "  ----\n" in text


def test_identifiers_are_different_and_not_reserved() -> None:
    names = ["der(theta)", "arm.R[2]", "arm_R_2", "x", "y", "t", "if", "v1", "k0", "sin_x", "2nd"]
    g = Graph()
    model = equations(g, [], states=[(g.symbol(n), Quantity(n, "state", "")) for n in names], nx=len(names))
    found = identifiers(lower(model), {"if"})
    assert [found["y", i] for i in range(len(names))] == [
        *("der_theta", "arm_R_2", "arm_R_2_", "x", "y_", "t_", "if_", "y_v1", "y_k0", "y_sin_x", "y_2nd"),
    ]


def test_lowering_is_deterministic() -> None:
    assert show(lower(chain(6))) == show(lower(chain(6)))
    assert split(lower(chain(6)).functions[0], 50) == split(lower(chain(6)).functions[0], 50)
