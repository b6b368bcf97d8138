"""Every row of ``graph/operations.py`` is whole: all that computes an operation agrees with all else.

The graph's own numbers (floats, many digits, exact rationals), its derivatives, the C text in double and in quadruple
precision, the Python text for numbers and for arrays, and SymPy. A new operation needs nothing here.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy
from all_operations import (
    ROWS,
    SPECIAL,
    Quad,
    apply,
    build,
    file_of,
    in_digits,
    is_regular,
    missing,
    padded,
    points,
    rational,
    truths,
    value,
)
from differentiable_modules import plain_module
from native_code import Both, bits
from sympy import sympify

from mechc.compiler.equations.hybrid import switches
from mechc.compiler.graph import DivisionByZero, Graph, Node, fold, kinks
from mechc.compiler.graph import operations as ops
from mechc.compiler.graph.differentiate import jvp
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.graph.kinks import as_choice
from mechc.compiler.graph.operation import Form, Operation, Parity, Sign
from mechc.compiler.graph.operations import OPERATIONS
from mechc.compiler.graph.rewrite import substitute, transfer
from mechc.compiler.symbolic import express
from mechc.runtime.native.libtcc import HEADERS

EVERY = pytest.mark.parametrize("row", ROWS, ids=[row.name for row in ROWS])
TABLE_ROW = file_of(ops)
MODERATE = (0.0, 1.0, -1.0, 0.5, -0.5, 0.25, 2.0, -2.0, 3.0, -2.5, 10.0)
SMALL = [Fraction(x) for x in (0, 1, -1, 2, -2, 3, -3, 4)] + [Fraction(1, 2), Fraction(-1, 2), Fraction(9, 4)]

EXACT_BY_CONSTRUCTION = {ops.ADD, ops.SUB, ops.MUL, ops.NEG, ops.DIV, ops.AND, ops.OR, ops.NOT, ops.SELECT}
"""Their constructors fold."""
NEVER_EXACT = {ops.POW, ops.LOOKUP}
"""Powers fold where they are products and roots; a table is one of floats."""
REFUSED = {ops.EQUAL, ops.NORMAL}
"""Of moving quantities, in words: E0513. What numbers random ones is whole, and a signal goes smoothly from one to the next."""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[int, Both], dict[int, str]]:
    return build(ROWS, tmp_path_factory.mktemp("operations"))


@pytest.fixture(scope="module")
def both(built: tuple[dict[int, Both], dict[int, str]]) -> Callable[[Operation], Both]:
    """Return the C and Python of an operation."""

    def find(row: Operation) -> Both:
        programs, failed = built
        assert row.code not in failed, (
            f"the text of '{row.name}' is wrong, see {TABLE_ROW}: {failed[row.code]}"
        )
        if row.code not in programs:
            pytest.fail("; ".join(missing(row)))
        return programs[row.code]

    return find


def test_rows_stand_at_their_codes() -> None:
    assert [row.code for row in OPERATIONS] == list(range(len(OPERATIONS))), f"codes of {TABLE_ROW} have gaps"
    assert len({row.name for row in OPERATIONS}) == len(OPERATIONS)


@EVERY
def test_its_row_is_whole(row: Operation) -> None:
    assert not missing(row), "; ".join(missing(row))
    assert len(row.partials) in (0, row.arity), (
        f"one derivative for each argument of '{row.name}': {TABLE_ROW}"
    )


@EVERY
def test_what_is_built_is_the_operation(row: Operation) -> None:
    """In whatever order the arguments came into being, and after a change of sign."""
    for order in itertools.permutations(range(row.arity)):
        g = Graph()
        names = {i: g.symbol(f"x{i}") for i in order}
        arguments = [names[i] for i in range(row.arity)]
        n = apply(g, row, arguments)
        assert g.op(n) == row.code, f"the constructor of '{row.name}' builds another operation"
        for at in points(row, MODERATE):
            kinds = truths(row)
            given = {x: bool(v) if kind else v for x, v, kind in zip(arguments, at, kinds, strict=True)}
            found = float(evaluate(g, [n], given)[0])
            expected = TABLE_VALUE(*at) if row.value is None else float(row.value(*given.values()))
            assert bits(np.array([found])) == bits(np.array([expected])), (at, f"order {order}")


def TABLE_VALUE(x: float) -> float:
    from all_operations import TABLE

    return TABLE(x)


@EVERY
def test_parity(row: Operation) -> None:
    if row.arity != 1 or any(truths(row)):
        assert row.parity is Parity.NONE
        return
    pairs = [(value(row, (x,)), value(row, (-x,))) for x in (0.3, 0.7, 1.3, 2.2, 3.7)]
    pairs = [(a, b) for a, b in pairs if math.isfinite(a) or math.isfinite(b)]
    odd, even = all(a == -b for a, b in pairs), all(a == b for a, b in pairs)
    expected = Parity.ODD if odd else Parity.EVEN if even else Parity.NONE
    assert row.parity is expected, f"'{row.name}' has the parity {expected.value}: say so in {TABLE_ROW}"


def of_one_number(row: Operation) -> bool:
    return row.arity == 1 and not row.conditions[0] and row.code != ops.LOOKUP


@EVERY
def test_its_sign(row: Operation) -> None:
    """Formulas show their signs by it (signs.py): at many points, and no weaker statement than holds."""
    places = [x for (x,) in points(row, MODERATE, 200) if is_regular(row, (x,))] if of_one_number(row) else []
    pairs = [(x, value(row, (x,))) for x in places]
    never = all(y >= 0 for _, y in pairs)
    alike = all((y > 0) - (y < 0) == (x > 0) - (x < 0) for x, y in pairs)
    expected = Sign.NEVER_NEGATIVE if never else Sign.OF_ARGUMENT if alike else Sign.ANY
    assert row.sign is (expected if pairs else Sign.ANY), f"'sign' of '{row.name}' in {TABLE_ROW}: {expected}"


@EVERY
def test_it_says_whether_it_kinks(row: Operation) -> None:
    """And each that does is turned into choices, which have events."""
    found = (
        []
        if any(row.conditions) or row.jumps
        else [at for at in points(row, (-2.0, 0.0, 1.0)) if kinks_at(row, at)]
    )
    assert row.kinks == bool(found), (
        f"'kinks' of '{row.name}' in {TABLE_ROW}: its derivative jumps at {found}"
    )
    g = Graph()
    arguments = tuple(g.symbol(f"x{i}") for i in range(row.arity))
    chosen = as_choice(g, apply(g, row, arguments), arguments, g.less)
    assert chosen is not None or not row.kinks, f"a case for '{row.name}' in {file_of(kinks)}"


def kinks_at(row: Operation, at: tuple[float, ...]) -> bool:
    """Tell whether the slopes on both sides of a point differ, along an argument."""
    for which in range(row.arity):
        moved = [tuple(x + d if i == which else x for i, x in enumerate(at)) for d in (-1e-6, 0.0, 1e-6)]
        if all(is_regular(row, place) for place in moved):
            left, middle, right = (value(row, place) for place in moved)
            if abs((right - middle) - (middle - left)) > 1e-8:
                return True
    return False


@EVERY
def test_it_says_whether_it_is_narrow(row: Operation) -> None:
    """Four fifths of all change between -200 and 200 happen within a fiftieth of that."""
    smooth = of_one_number(row) and not row.jumps and row.regular is None
    spots = np.linspace(-200.0, 200.0, 20001)
    changes = np.abs(np.diff([value(row, (x,)) for x in spots])) if smooth else np.ones(2)
    share = np.sort(changes)[-len(changes) // 50 :].sum() / changes.sum()
    assert row.narrow == (smooth and share > 0.8), f"'narrow' of '{row.name}' in {TABLE_ROW}: {share:.0%}"


@EVERY
def test_proofs_have_what_balls_have(row: Operation) -> None:
    flint = pytest.importorskip("flint")
    has = hasattr(flint.arb, row.name) and not row.jumps
    assert row.ball is not None or not has, f"balls have '{row.name}': 'ball' in {TABLE_ROW}"


@EVERY
def test_it_is_rebuilt(row: Operation) -> None:
    """By substitution, and in another graph."""
    g, other = Graph(), Graph(by_value=False, seed=5)
    before, after = ([g.symbol(k + str(i)) for i in range(row.arity)] for k in "xs")
    n = apply(g, row, before)
    (replaced,) = substitute(g, [n], dict(zip(before, after, strict=True)))
    assert replaced == apply(g, row, after)
    (moved,) = transfer(g, [n], other)
    assert other.op(moved) == row.code
    assert [other.name(a) for a in other.args(moved)] == [g.name(a) for a in g.args(n)]


@EVERY
def test_it_folds_what_is_rational(row: Operation) -> None:
    """To the value that the function has; and wherever it is rational."""
    with mpmath.workdps(50):
        for at in itertools.product(*((Fraction(0), Fraction(1)) if k else SMALL for k in truths(row))):
            g = Graph()
            try:
                n = apply(g, row, [g.constant(x) for x in at])
            except DivisionByZero:
                continue
            exact = in_digits(row, tuple(map(float, at)))
            if g.is_constant(n):
                found = g.value(n)
                off = abs(mpmath.mpf(found.numerator) / found.denominator - exact)
                assert off < 1e-45, f"{row.name}{at} is not {found}: 'exact' in {TABLE_ROW}"
            elif row.code not in NEVER_EXACT and is_regular(row, tuple(map(float, at))):
                told = f"{row.name}{at} is {rational(exact)}, and is not folded: 'exact' in {TABLE_ROW}"
                assert rational(exact) is None, f"{told}, with rules from {file_of(fold)}"
    assert (row.exact is None) or row.code not in EXACT_BY_CONSTRUCTION


def forward(g: Graph, n: Node, wrt: list[Node]) -> list[Node]:
    return [jvp(g, [n], {x: g.one})[0] for x in wrt]


@EVERY
def test_it_says_where_it_is_regular(row: Operation) -> None:
    """Where ``regular`` holds, value and derivatives are finite; where not, one of them is not, or the value jumps."""
    g = Graph()
    symbols = [g.symbol(f"x{i}") for i in range(row.arity)]
    n = apply(g, row, symbols)
    kinds = truths(row)
    slopes = [forward(g, n, [s])[0] for s, kind in zip(symbols, kinds, strict=True) if not kind]
    for at in points(row, MODERATE, 60):
        given = {s: bool(x) if k else x for s, x, k in zip(symbols, at, kinds, strict=True)}
        finite = all(math.isfinite(float(x)) for x in evaluate(g, [n, *slopes], given))
        if is_regular(row, at):
            large = any(abs(x) > 100 for x in at)
            assert finite or large, f"'{row.name}' is said to be regular at {at}: 'regular' in {TABLE_ROW}"
        else:
            assert not finite or jumps_at(row, at), (
                f"'{row.name}' is said not to be regular at {at}: 'regular' in {TABLE_ROW}"
            )


def jumps_at(row: Operation, at: tuple[float, ...]) -> bool:
    """Tell whether the value differs between the sides of a point, along an argument."""
    for which, kind in enumerate(truths(row)):
        if not kind:
            moved = [tuple(x + d if i == which else x for i, x in enumerate(at)) for d in (-1e-9, 0.0, 1e-9)]
            values = [value(row, place) for place in moved if place == at or is_regular(row, place)]
            if math.isfinite(sum(values)) and max(values) - min(values) > 1e-3 * (1 + max(map(abs, values))):
                return True
    return False


@EVERY
def test_it_says_whether_it_jumps(row: Operation) -> None:
    """And each that does is among those at which events are looked for."""
    places = [at for at in points(row, MODERATE) if is_regular(row, at)]
    found = [at for at in places if jumps_at(row, at)]
    seen = f"jumps at {found[:3]}" if found else "jumps nowhere"
    assert row.jumps == bool(found), f"'{row.name}' {seen}: 'jumps' in {TABLE_ROW}"
    if row.jumps and row.code not in REFUSED:
        g = Graph()
        n = apply(g, row, [g.symbol(f"x{i}") for i in range(row.arity)])
        located = switches.stair(g, n) is not None or switches.compared(g, n) is not None
        files = f"'compared' or 'stair' in {file_of(switches)}"
        assert located, f"where '{row.name}' jumps there is no event: {files}"


@EVERY
def test_c_python_and_the_graph_give_the_same_bits(row: Operation, both: Callable[[Operation], Both]) -> None:
    program = both(row)
    name = f"op_{row.name}"
    for at in points(row, SPECIAL, 200):
        try:
            program.compare(name, list(padded(at)))
        except AssertionError as error:
            told = f"'c' and 'python' of '{row.name}' in {TABLE_ROW} differ at {at}"
            pytest.fail(f"{told}: {error}")
        empty = np.empty(0)
        native = program.native.call(name, 0.7, padded(at), empty, empty, program.p)
        found = np.array([value(row, at)])
        assert bits(found) == bits(native), (
            f"'value' of '{row.name}' in {TABLE_ROW} gives {found[0]!r} at {at}, C gives {native[0]!r}"
        )


@EVERY
def test_arrays_agree_with_numbers(row: Operation, both: Callable[[Operation], Both]) -> None:
    """NumPy's own functions differ from the C library's in the last digits, nothing else may."""
    program, name = both(row), f"op_{row.name}"
    module = plain_module(program.program)
    states = [padded(at) for at in points(row, SPECIAL, 200)]
    try:
        with np.errstate(all="ignore"):
            found = getattr(module, name)(0.7, np.array(states).T, (), program.p)[0]
    except Exception as error:
        pytest.fail(f"'array' of '{row.name}' in {TABLE_ROW}: {error!r}")
    empty = np.empty(0)
    expected = np.array([program.python[name](0.7, s, empty, empty, program.p)[0] for s in states])
    finite = np.isfinite(expected) & np.isfinite(found)
    same = np.where(finite, 0.0, found) == np.where(finite, 0.0, expected)
    assert np.all(same | (np.isnan(found) & np.isnan(expected))), f"'array' in {TABLE_ROW}"
    distance = np.abs(found[finite] - expected[finite]) / np.spacing(np.abs(expected[finite]))
    assert distance.max() <= 4, f"'array' of '{row.name}' in {TABLE_ROW} differs"


def finite_points(row: Operation) -> list[tuple[float, ...]]:
    return [at for at in points(row, MODERATE, 60) if is_regular(row, at) and max(map(abs, at)) < 200]


@EVERY
def test_many_digits_agree(row: Operation, both: Callable[[Operation], Both]) -> None:
    """The graph's many digits round to its floats: within 2 units in the last place, which is more than libm's error."""
    with mpmath.workdps(60):
        for at in finite_points(row):
            exact, found = in_digits(row, at), value(row, at)
            assert abs(exact - found) <= 2 * np.spacing(abs(found)), (
                f"'digits' of '{row.name}' in {TABLE_ROW} give {mpmath.nstr(exact, 20)} at {at}, floats {found!r}"
            )


@pytest.fixture(scope="module")
def quad(
    built: tuple[dict[int, Both], dict[int, str]], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[Both], Quad]:
    made: dict[int, Quad] = {}

    def find(program: Both) -> Quad:
        if id(program) not in made:
            made[id(program)] = Quad(program, tmp_path_factory.mktemp("quad"))
        return made[id(program)]

    return find


@EVERY
def test_quadruple_precision_has_its_digits(
    row: Operation, both: Callable[[Operation], Both], quad: Callable[[Both], Quad]
) -> None:
    """To 1e-32 of the value, some fifty roundings; tables are of floats in the graph, so to some fifty of theirs."""
    functions = quad(both(row))
    with mpmath.workdps(60):
        for at in finite_points(row):
            exact, found = in_digits(row, at), functions(row, at)
            bound = mpmath.mpf("1e-14") if row.code == ops.LOOKUP else abs(exact) * mpmath.mpf("1e-32")
            assert abs(found - exact) <= bound, (
                f"'{row.name}' at {at} with 113 bits: {mpmath.nstr(found, 40)}, "
                f"not {mpmath.nstr(exact, 40)}: 'c' or 'c_text' in {TABLE_ROW}"
            )


@EVERY
def test_sympy_agrees(row: Operation) -> None:
    if row.code == ops.NORMAL:
        pytest.skip("random numbers have no formula")
    if row.code == ops.LOOKUP:
        g = Graph()
        (found,) = express.express(g, [apply(g, row, [g.symbol("x")])], {})
        assert str(found) == "table(x)"
        return
    function = express.SYMPY.functions[row.code]
    with mpmath.workdps(40):
        for at in finite_points(row):
            number_of = sympy.Rational if set(at) <= set(MODERATE) else lambda x: sympy.Float(x, 45)
            kinds = truths(row)
            given = [sympify(bool(x)) if k else number_of(x) for x, k in zip(at, kinds, strict=True)]
            found = function(*given)
            number = (
                mpmath.mpf(bool(found)) if found in (True, False) else mpmath.mpmathify(sympy.N(found, 40))
            )
            exact = in_digits(row, at)
            assert abs(number - exact) <= abs(exact) * mpmath.mpf(10) ** -35, (
                f"SymPy's '{row.name}' at {at} is {number}, not {exact}: 'sympy' in {TABLE_ROW}"
            )


def test_the_compiler_that_comes_along_knows_every_function() -> None:
    """What the C text of an operation calls is declared in the header of libtcc, for both kinds of numbers."""
    called = {
        row.c or row.name
        for row in ROWS
        if row.form is None and not row.c_text and not isinstance(row.c, Form) and row.value is not None
    } | {name for row in ROWS for name in row.calls}
    declared = set(re.findall(r"(\w+)\(", (HEADERS / "math.h").read_text(encoding="utf-8")))
    assert len(called) > 20
    assert {*called, *(f"{name}l" for name in called)} <= declared
