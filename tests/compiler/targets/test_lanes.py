"""Operations of vectors of lanes: each row of the table against the C of single numbers, in every lane and every width."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from all_operations import ROWS, SPECIAL, build, points, truths
from native_code import Both, Floats, bits
from sample_equations import equations

from mechc.compiler.equations.model import Function
from mechc.compiler.graph import Graph, Samples
from mechc.compiler.graph import operations as ops
from mechc.compiler.graph.operation import Operation
from mechc.compiler.lanes import lane_sources
from mechc.compiler.program.model import Body, Load, Operate, Store
from mechc.compiler.targets.lanes import DOUBLES, FORMS, _Printer, function_lines
from mechc.runtime.interface import Quantity
from mechc.runtime.native.build import build_shared, lane_flags

ULPS = {
    ops.SIN: 1.5,
    ops.COS: 1.5,
    ops.TAN: 3.0,
    ops.EXP: 1.0,
    ops.LOG: 0.8,
    ops.TANH: 1.5,
    ops.ATAN: 1.0,
    ops.ATAN2: 1.7,
}
"""Largest errors that lane_functions.h states, in units of the last place; all others are the bits of single numbers."""
WIDTHS = (2, 4, 8)

WRAPPER = """
__attribute__((visibility("default"))) void many_{name}(long n, const double *y, double *out);
void many_{name}(long n, const double *y, double *out)
{{
    for (long k = 0; k < n; k += WIDTH) {{
        V a[3], found[1];
        for (int i = 0; i < 3; i++) memcpy(&a[i], y + i * n + k, sizeof(V));
        {name}(a[0], a, a, a, a, found);
        memcpy(out + k, found, sizeof(V));
    }}
}}
"""


class Lanes:
    """The functions of a program in lanes of one width."""

    def __init__(self, both: Both, width: int) -> None:
        functions = [f for f in both.program.functions if f.name.startswith("op_")]
        text = "#include <string.h>\n" + "\n".join(function_lines(both.program, functions))
        text += "".join(WRAPPER.format(name=f.name) for f in functions)
        flags = (*lane_flags(), f"-DMECH_LANE_WIDTH={width}")
        self.library = ctypes.CDLL(str(build_shared(lane_sources(text), flags, name="operations")))

    def __call__(self, name: str, states: Floats) -> Floats:
        """Return values at states [3, n], n a multiple of the width."""
        states, out = np.ascontiguousarray(states), np.empty(states.shape[1])
        function = getattr(self.library, f"many_{name}")
        function.argtypes = (ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p)
        function.restype = None
        function(out.size, states.ctypes.data, out.ctypes.data)
        return out


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Both:
    programs, failed = build(ROWS, tmp_path_factory.mktemp("operations"))
    assert not failed
    return programs[ops.ADD]


@pytest.fixture(scope="module")
def lanes(both: Both) -> Mapping[int, Lanes]:
    return {width: Lanes(both, width) for width in WIDTHS}


def states_of(row: Operation) -> Floats:
    found = [(*at, 0.0, 0.0, 0.0)[:3] for at in points(row, SPECIAL, 400)]
    found += [found[-1]] * (-len(found) % max(WIDTHS))
    return np.array(found).T


def test_every_operation_has_its_row() -> None:
    assert {row.code for row in ROWS} == {*FORMS, ops.LOOKUP}


@pytest.mark.parametrize("row", ROWS, ids=[row.name for row in ROWS])
def test_lanes_give_what_single_numbers_give(row: Operation, both: Both, lanes: Mapping[int, Lanes]) -> None:
    states, name, empty = states_of(row), f"op_{row.name}", np.empty(0)
    columns = np.ascontiguousarray(states.T)
    expected = np.array([both.native.call(name, 0.7, y, empty, empty, both.p)[0] for y in columns])
    found = lanes[8](name, states)
    if row.code not in ULPS:
        # the least of two zeros, and the sign of a zero that a comparison sees, are one number
        same = (found == expected) | (np.isnan(found) & np.isnan(expected))
        assert same.all(), (states[:, ~same][:, :3], found[~same][:3], expected[~same][:3])
        return
    finite = np.isfinite(expected)
    assert bits(found[~finite]) == bits(expected[~finite])
    off = np.abs(found[finite] - expected[finite]) / np.spacing(np.abs(expected[finite]))
    assert off.max() <= ULPS[row.code] + 1  # those of the C library are off by less than one


def test_samples_are_read_and_searched_lane_by_lane(tmp_path: Path) -> None:
    g = Graph()
    states = [g.symbol(name) for name in "abc"]
    table = g.add_table(Samples((-2.0, -0.5, 0.1, 0.2, 3.0)))
    nodes = {"op_cell": g.cell(table, states[0]), "op_element": g.element(table, g.floor(states[0]))}
    entries = [(x, Quantity(g.name(x), "state", "")) for x in states]
    functions = [Function(name, name, (n,)) for name, n in nodes.items()]
    both = Both(equations(g, functions, name="samples", states=entries, nx=3), tmp_path)
    at = np.array([-7.0, -2.0, -0.7, -0.5, 0.15, 0.2, 2.9, 3.0, 4.0, 5.0, 0.7, 1.0, 2.0, 3.5, -0.0, 0.0])
    found = Lanes(both, 8)
    for name in nodes:
        wanted = [both.python[name](0.0, np.array([x, 0, 0]), both.u, both.z, both.p)[0] for x in at]
        assert bits(found(name, np.array([at, at, at]))) == bits(np.array(wanted))


@pytest.mark.parametrize("row", ROWS, ids=[row.name for row in ROWS])
def test_a_lane_does_not_feel_its_neighbours(row: Operation, lanes: Mapping[int, Lanes]) -> None:
    """The same bits beside other numbers, in other lanes, and in all widths."""
    states, name = states_of(row), f"op_{row.name}"
    whole = lanes[8](name, states)
    order = np.random.default_rng(1).permutation(states.shape[1])
    for width in WIDTHS:
        moved = lanes[width](name, states[:, order])
        assert bits(moved) == bits(whole[order]), width


@pytest.mark.parametrize(
    ("code", "ranges"),
    [
        (ops.SIN, (0.8, 3.2, 100.0, 1e5, 9e8)),
        (ops.COS, (0.8, 3.2, 100.0, 1e5, 9e8)),
        (ops.TAN, (0.8, 3.2, 100.0, 1e5)),
        (ops.EXP, (0.3, 3.0, 50.0, 690.0)),
        (ops.LOG, (0.5, 3.0, 1e9, 1e300)),
        (ops.TANH, (1e-3, 0.5, 0.7, 3.0, 30.0)),
        (ops.ATAN, (1e-3, 0.7, 3.0, 1e5)),
    ],
)
def test_errors_are_as_stated(code: int, ranges: tuple[float, ...], lanes: Mapping[int, Lanes]) -> None:
    """Against long double, on random points."""
    if np.finfo(np.longdouble).nmant < 63:
        pytest.skip("no long double to compare with")
    rng, name = np.random.default_rng(code), ops.OPERATIONS[code].name
    exactly = np.arctan if code == ops.ATAN else getattr(np, name)
    for reach in ranges:
        x = rng.uniform(0.0 if code == ops.LOG else -reach, reach, 1 << 16)
        if code == ops.LOG:
            x[::2] = np.exp(rng.uniform(-700, np.log(reach), 1 << 15))
            x[1::4] = 1 + rng.uniform(-0.4, 0.4, 1 << 14)
        found = lanes[8](f"op_{name}", np.stack([x, x, x]))
        exact = exactly(x.astype(np.longdouble))
        spacing = np.spacing(np.abs(exact.astype(np.float64)))
        off = float((np.abs(found - exact) / spacing).max())

        assert off <= ULPS[code], (reach, off)


def test_the_error_of_the_arc_of_two_is_as_stated(lanes: Mapping[int, Lanes]) -> None:
    """Against long double, over all angles, also of points at very different distances from the axes."""
    if np.finfo(np.longdouble).nmant < 63:
        pytest.skip("no long double to compare with")
    y, x = np.random.default_rng(4).uniform(-1, 1, (2, 1 << 17))
    x[::2] *= 2.0 ** np.random.default_rng(5).integers(-300, 300, 1 << 16)
    found = lanes[8]("op_atan2", np.stack([y, x, x]))
    exact = np.arctan2(y.astype(np.longdouble), x.astype(np.longdouble))
    off = np.abs(found - exact) / np.spacing(np.abs(exact.astype(np.float64)))
    assert float(off.max()) <= ULPS[ops.ATAN2]


def test_products_are_fused_where_sums_alone_read_them() -> None:
    body: Body = (
        *(Load("y", i) for i in range(3)),
        Operate(ops.MUL, (0, 1)),
        Operate(ops.ADD, (3, 2)),
        Operate(ops.SUB, (2, 3)),
        Operate(ops.SUB, (3, 2)),
        Operate(ops.MUL, (0, 2)),
        Operate(ops.ADD, (7, 4)),
        *(Store("out", k, v) for k, v in enumerate((5, 6, 7, 8))),
    )
    text = "\n".join(_Printer(body, DOUBLES).lines())
    assert "v4 = lane_fma(y[0], y[1], y[2])" in text and "v5 = lane_fnma(y[0], y[1], y[2])" in text
    assert "v6 = lane_fma(y[0], y[1], -y[2])" in text
    assert "v3" not in text, "nobody reads the product alone"
    assert "v7 = y[0] * y[2]" in text and "v8 = v7 + v4" in text, "it is stored"


def test_conditions_are_told_apart() -> None:
    assert {code for code, form in FORMS.items() if form.condition} == {
        *(ops.LESS, ops.LESS_EQUAL, ops.EQUAL, ops.AND, ops.OR, ops.NOT)
    }
    for row, form in ((row, FORMS[row.code]) for row in ROWS if row.code in FORMS):
        assert form.conditions[: row.arity] == truths(row), row.name
        assert form.template.count("{}") == row.arity
