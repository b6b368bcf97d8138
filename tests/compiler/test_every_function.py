"""Every function that the language knows is whole: type rule, units, meaning, folding, events, its line in the page.

What takes numbers needs nothing here: folding and meaning, which share no code, are held against each other, and units
against a change of scale. Any other function has an example with its value by hand in ``EXAMPLES``.
"""

from __future__ import annotations

import itertools
import math
import re
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, cast

import pytest

import mechc
from mechc.compiler.flat import well_typed
from mechc.compiler.flat.expressions import functions as rules
from mechc.compiler.flat.expressions.calls import _further_rules
from mechc.compiler.flat.expressions.fields import OPERATORS
from mechc.compiler.flat.expressions.queries import QUERY_RULES
from mechc.compiler.flat.values import evaluate as folding
from mechc.compiler.graph import Graph
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.graph.operations import JUMPING
from mechc.compiler.mechanics.meaning import functions as meanings
from mechc.compiler.mechanics.meaning import lower
from mechc.compiler.pipeline import compile_source
from mechc.lang.builtins import BUILTINS, Builtin, Category
from mechc.lang.source import SourceFile
from mechc.lang.units import parse_unit

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "language.md").read_text(encoding="utf-8")

OF_NUMBERS = [b for b in BUILTINS.values() if b.category is Category.ELEMENTARY or b.name in ("min", "max")]
NUMBERS = (0.3, 0.75, 1.25, 2.5, -0.4, -1.75)
EVERY = pytest.mark.parametrize("builtin", BUILTINS.values(), ids=list(BUILTINS))
EACH_OF_NUMBERS = pytest.mark.parametrize("builtin", OF_NUMBERS, ids=[b.name for b in OF_NUMBERS])
LATER = {"at"}
"""Belongs to models that are refused in words (E0590)."""


def file_of(module: ModuleType) -> str:
    return Path(str(module.__file__)).resolve().relative_to(ROOT).as_posix()


def arguments(builtin: Builtin) -> list[tuple[float, ...]]:
    """Return some arguments of each number of them."""
    count = builtin.most or 3
    sizes = range(max(builtin.least, 2 if builtin.most is None else 1), count + 1)
    every = (itertools.product(NUMBERS, repeat=size) for size in sizes)
    return [row for rows in every for row in itertools.islice(rows, 0, 40, 3 if builtin.most != 1 else 1)]


def called(builtin: Builtin, given: tuple[object, ...]) -> str:
    return f"{builtin.name}({', '.join(map(str, given))})"


BODY = "coordinate Length body = 1 m; kinetic 1/2*1 kg*der(body)^2;\n"


@cache
def compiled(name: str, count: int, unit: str) -> Any:
    """Return (function of the arguments, unit of the value) of a model that computes it from parameters."""
    builtin = BUILTINS[name]
    names = [f"p{i}" for i in range(count)]
    text = BODY + "".join(f"parameter {p} = {i + 2} {unit};\n" for i, p in enumerate(names))
    equations = compile_source(
        SourceFile("m.mech", f"{text}output y = {called(builtin, tuple(names))};\n")
    ).equations
    index = next(i for i, entry in enumerate(equations.outputs) if entry.name == "y")
    node = next(f for f in equations.functions if f.name == "outputs").outputs[index]
    places = {slot.index: n for n, slot in equations.layout.items() if slot.array == "p"}
    parameters = [places[i] for i in range(count)]

    def value(*given: float) -> float:
        return float(evaluate(equations.graph, [node], dict(zip(parameters, given, strict=True)))[0])

    return value, equations.outputs[index].unit


@EVERY
def test_it_has_a_rule_and_a_line(builtin: Builtin) -> None:
    known = builtin.name in {**rules.RULES, **_further_rules()} or builtin.name in (
        *QUERY_RULES,
        *OPERATORS,
        "integral",
        "rms",
    )
    assert known, (
        f"'{builtin.name}' has no type rule: a row in RULES of {file_of(rules)} (or of kinematics, queries)"
    )
    if builtin.category in (Category.ELEMENTARY, Category.VECTOR) and builtin.name != "identity":
        assert builtin.name in well_typed.RESULTS, (
            f"what '{builtin.name}' gives is not derived a second time: a row in RESULTS of {file_of(well_typed)}"
        )
    if builtin.category in (
        Category.ELEMENTARY,
        Category.REDUCTION,
        Category.VECTOR,
        Category.POSE,
        Category.STRUCTURE,
        Category.FIELD,
    ):
        assert f"| `{builtin.name}` | {builtin.doc} |" in PAGE, (
            f"'{builtin.name}' has no line in docs/language.md"
        )


@EACH_OF_NUMBERS
def test_it_means_what_it_folds_to(builtin: Builtin) -> None:
    assert builtin.name in meanings.FUNCTIONS, (
        f"'{builtin.name}' has no meaning: a row in FUNCTIONS of {file_of(meanings)}"
    )
    checked = 0
    for given in arguments(builtin):
        value, _ = compiled(builtin.name, len(given), "")
        expected = value(*given)
        if not math.isfinite(expected):
            continue
        text = f"{BODY}structural parameter Real k = {called(builtin, given)};\n"
        try:
            folded = compile_source(SourceFile("m.mech", text)).flat.structural["k"]
        except mechc.CompileError as error:
            pytest.fail(f"'{called(builtin, given)}' is not folded, see {file_of(folding)}: {error}")
        assert float(cast(float, folded)) == pytest.approx(expected, rel=1e-14, abs=1e-15), (
            f"{called(builtin, given)} folds to {float(cast(float, folded))!r} by {file_of(folding)}, "
            f"and means {expected!r} by {file_of(meanings)}"
        )
        checked += 1
    assert checked >= 2


@EACH_OF_NUMBERS
def test_its_unit_follows_a_change_of_scale(builtin: Builtin) -> None:
    """f(4 x) is 4^k f(x) where the value of lengths has the unit m^k: in whatever unit one counts, it is the same."""
    for count in {len(row) for row in arguments(builtin)}:
        try:
            value, unit = compiled(builtin.name, count, "m")
        except mechc.CompileError:
            continue  # it takes numbers only
        length, given = parse_unit("m").dimension, parse_unit(unit or "1").dimension
        powers = [
            k
            for k in (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, -0.5, -1.0, -2.0, -3.0)
            if length ** Fraction(k) == given
        ]
        assert powers, f"the unit '{unit}' of '{builtin.name}' of lengths: its rule in {file_of(rules)}"
        for row in (row for row in arguments(builtin) if len(row) == count):
            before, after = value(*row), value(*(4 * x for x in row))
            if math.isfinite(before):
                assert after == pytest.approx(4 ** powers[0] * before, rel=1e-14), (
                    f"'{builtin.name}' of lengths is said to be in '{unit or 1}', which it is not: {file_of(rules)}"
                )


@EACH_OF_NUMBERS
def test_where_it_jumps_events_are_looked_for(builtin: Builtin) -> None:
    g = Graph()
    for count in {len(row) for row in arguments(builtin)}:
        symbols = tuple(g.symbol(f"x{i}") for i in range(count))
        kinematics = cast(Any, SimpleNamespace(graph=g))
        result = cast(Any, meanings.FUNCTIONS[builtin.name](kinematics, lambda n: g.zero, symbols))
        jumps = [n for n in g.reach([result]) if g.op(n) in JUMPING]
        told = builtin.name in lower.RELATIONS | lower.STAIRS
        assert told == bool(jumps), f"'{builtin.name}' jumps: RELATIONS or STAIRS of {file_of(lower)}"


# ---------------------------------------------------------------- all others, by examples

PLANE = """
import mech.planar.*;
gravity {0, -10} m/s^2;
parameter Real a[3] = {1, 2, 3};
parameter Real b[3] = {4, 5, 6};
parameter Real n = 2;
Bar bar(m = 2 kg, l = 3 m);
Revolute pin(world -> bar.a, angle = 30 deg, der(angle) = 2 rad/s);
torque motor: 5 N.m on bar.a;
"""
SPACE = """
import mech.spatial.*;
parameter Angle angle = 30 deg;
Body body(m = 1 kg, J = identity(3)*1 kg.m^2);
Free free(world -> body.a);
"""
LINE = """
coordinate Length x = 0.6 m;
coordinate Length z = 0.8 m;
kinetic 1/2*1 kg*(der(x)^2 + der(z)^2);
potential 1 kg*10 m/s^2*z;
constraint rod: x^2 + z^2 = 1 m^2;
discrete Integer count = 0;
"""
FIELDS = (
    "function V(Length r[3], Pressure k) = k*r[1]*r[2]*r[3];"
    "function F(Length r[3]) = {r[1]*r[2] + r[2]*r[3], r[1]^2, r[3]^2/2};" + BODY
)
SOLID = (
    "parameter Length corner[4, 3] = {{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 6}} m;"
    "structural parameter Integer faces[4, 3] = {{1, 3, 2}, {1, 2, 4}, {1, 4, 3}, {2, 3, 4}};" + BODY
)
c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
turn = (5 - 2 * 10 * 1.5 * c) / 6  # angular acceleration
force = [2 * 1.5 * (-turn * s - 4 * c), 2 * (1.5 * (turn * c - 4 * s) + 10)]

EXAMPLES: dict[str, tuple[str, str, list[float]]] = {
    "sum": (PLANE, "sum(a)", [6]),
    "product": (PLANE, "product(a[i] for i in 1:3)", [6]),
    "integral": (PLANE, "integral(n*u^2 for u in 0:3)", [18]),
    "rms": (PLANE, "rms(-3*n)", [6]),
    "dot": (PLANE, "dot(a, b)", [32]),
    "cross": (PLANE, "cross(a, b)", [-3, 6, -3]),
    "norm": (PLANE, "norm({3, 2*n})", [5]),
    "transpose": (PLANE, "transpose({a, b})*{1, 10}", [41, 52, 63]),
    "outer": (PLANE, "outer(a, b)*{1, 10, 100}", [654, 1308, 1962]),
    "identity": (PLANE, "identity(3)*a", [1, 2, 3]),
    "diag": (PLANE, "diag(a)*b", [4, 10, 18]),
    "det": (PLANE, "det(outer(a, b) + diag(a))", [6 * (1 + 4 + 5 + 6)]),
    "inverse": (PLANE, "inverse({{n, 1, 0}, {0, 1, 0}, {0, 0, 4}})*a", [-0.5, 2, 0.75]),
    "solve": (PLANE, "solve({{n, 1, 0}, {0, 1, 0}, {0, 0, 4}}, a)", [-0.5, 2, 0.75]),
    "trace": (PLANE, "trace(outer(a, b))", [32]),
    "size": (PLANE, "size(outer(a, {1, 2}), 2) + n", [4]),
    "given": (PLANE, "if given(n) then 1 else 5", [5]),
    "concat": (PLANE, "concat(b, n, a[2:3])", [4, 5, 6, 2, 2, 3]),
    "eigenvalues": (PLANE, "eigenvalues({{2, 1}, {1, 2}})", [1, 3]),
    "file": (PLANE, f'file("{ROOT}/tests/models/values/forces.csv", "force")/1 kN', [1.5, 2.5]),
    "linspace": (PLANE, "linspace(n, 6, 3)", [2, 4, 6]),
    "table": (PLANE, "table(n, {0, 2, 3}, {5, 7, 8})", [7]),
    "trans": (PLANE, "pos(world * trans({n, 1}*1 m))", [2, 1]),
    "rot": (PLANE, "pos(world * rot(30 deg) * {2 m, 0})", [2 * c, 2 * s]),
    "rotx": (SPACE, "pos(world * rotx(angle) * {1 m, 1 m, 0})", [1, c, s]),
    "roty": (SPACE, "pos(world * roty(angle) * {1 m, 1 m, 0})", [c, 1, -s]),
    "rotz": (SPACE, "pos(world * rotz(angle) * {1 m, 0, 1 m})", [c, s, 1]),
    "axis_angle": (SPACE, "pos(world * axis_angle({1, 1, 1}, 4*angle) * {1 m, 2 m, 3 m})", [3, 1, 2]),
    "quat": (SPACE, "pos(world * quat(cos(angle/2), 0, 0, sin(angle/2)) * {1 m, 0, 1 m})", [c, s, 1]),
    "origin": (PLANE, "origin(bar.b)", [3 * c, 3 * s]),
    "pos": (PLANE, "pos(bar.a * {1 m, 1 m})", [c - s, s + c]),
    "vel": (PLANE, "vel(bar.b)", [-6 * s, 6 * c]),
    "vel_at": (PLANE, "vel_at(bar.a, world * {1 m, 0})", [0, 2]),
    "angvel": (PLANE, "angvel(bar.a)", [2]),
    "heading": (PLANE, "heading(bar.a)", [math.pi / 6]),
    "local": (PLANE, "local(bar.a, bar.b)", [3, 0]),
    "components": (PLANE, "components(bar.a, {1 m, 0 m})", [c, -s]),
    "direction": (PLANE, "direction(bar.a, {1 m, 0 m})", [c, s]),
    "energy": (PLANE, "energy()", [12 + 2 * 10 * 1.5 * s]),
    "kinetic_energy": (PLANE, "kinetic_energy()", [12]),
    "potential_energy": (PLANE, "potential_energy()", [2 * 10 * 1.5 * s]),
    "momentum": (PLANE, "momentum(pin.angle)", [12]),
    "power": (PLANE, "power(motor)", [10]),
    "reaction": (PLANE, "reaction(pin)", force),
    "moment": (PLANE, "moment(pin)", [0]),
    "inertia_tensor": (PLANE, "inertia_tensor(bar.a)", [1.5]),
    "mass_centre": (PLANE, "mass_centre()", [1.5 * c, 1.5 * s]),
    "multiplier": (LINE, "abs(multiplier(rod))", [4]),
    "closed": (LINE, "if closed(rod) then 1 else 0", [1]),
    "sample": (LINE + "when sample(0.1 ms) then count := count + 1; end when;\n", "count", [11]),
    "noise": (LINE, "noise(0, 1 s)", [-0.25581597020351543]),
    "delay": (LINE, "delay(2*count + 1, 1 s)", [1]),
    "mesh_volume": (SOLID, "mesh_volume(corner, faces)", [6]),
    "mesh_centre": (SOLID, "mesh_centre(corner, faces)", [0.5, 0.75, 1.5]),
    "mesh_inertia": (SOLID, "mesh_inertia(corner, faces)*{1, 0, 0}", [10.125, 0.45, 0.9]),
    "grad": (FIELDS, "grad(V, {1, 2, 3}*1 m, 5 N/m^2)", [30, 15, 10]),
    "curl": (FIELDS, "curl(F, {1, 2, 3}*1 m)", [0, 2, -2]),
    "laplacian": (FIELDS, "laplacian(F, {1, 2, 3}*1 m)", [0, 2, 1]),
    "initial": (LINE + "when initial() then count := 7; end when;\n", "count", [7]),
}
"""Model, call, and its value at the start; after 1 ms where events count."""


@pytest.mark.parametrize(
    "builtin", [b for b in BUILTINS.values() if b not in OF_NUMBERS], ids=lambda b: b.name
)
def test_examples_have_their_values(builtin: Builtin) -> None:
    if builtin.name in LATER:
        return
    assert builtin.name in EXAMPLES, (
        f"'{builtin.name}' has no example: a row in EXAMPLES of tests/compiler/{Path(__file__).name}"
    )
    prelude, call, expected = EXAMPLES[builtin.name]
    assert re.search(rf"\b{builtin.name}\(", prelude + call)
    try:
        solution = mechc.loads(f"{prelude}output y = {call};\n").simulate(stop=1e-3, estimate_error=False)
    except (KeyError, AssertionError, NotImplementedError) as error:
        pytest.fail(
            f"'{builtin.name}' means nothing, see FUNCTIONS of {file_of(meanings)}, or queries: {error!r}"
        )
    assert isinstance(solution, mechc.Solution)
    names = ["y"] if len(expected) == 1 else [f"y[{i + 1}]" for i in range(len(expected))]
    when = -1 if call == "count" else 0
    assert [float(solution[name][when]) for name in names] == pytest.approx(expected, rel=1e-12, abs=1e-12)
