"""Interning, local rules and identities of the graph."""

import math
import subprocess
import sys
from fractions import Fraction

import pytest

from mechc.compiler.graph import DivisionByZero, Graph, Node
from mechc.compiler.graph import operations as ops
from mechc.compiler.graph.verify import verify


@pytest.fixture
def g() -> Graph:
    return Graph()


def test_equal_structure_is_one_node(g: Graph) -> None:
    x, y = g.symbol("x"), g.symbol("y")
    assert g.symbol("x") == x
    assert g.add(x, y) == g.add(y, x)
    assert g.mul(g.sin(x), y) == g.mul(y, g.sin(x))
    assert g.sub(x, y) == g.neg(g.sub(y, x))
    assert g.less(x, y) != g.less(y, x)
    assert g.maximum(x, y) == g.maximum(y, x)


def test_arguments_have_smaller_numbers(g: Graph) -> None:
    x = g.symbol("x")
    n = g.select(g.less(x, g.one), g.sin(x), g.div(x, g.add(x, g.two)))
    for k in g.reach([n]):
        assert all(a < k for a in g.args(k))
    assert g.support(n) == [x]
    assert g.args(n)[0] == g.less(x, g.one)


def test_zero_and_one_vanish(g: Graph) -> None:
    x = g.symbol("x")
    assert g.add(x, g.zero) == x
    assert g.mul(x, g.zero) == g.zero
    assert g.mul(g.one, x) == x
    assert g.sub(x, x) == g.zero
    assert g.div(x, x) == g.one
    assert g.neg(g.neg(x)) == x
    assert g.mul(g.neg(x), g.neg(x)) == g.mul(x, x)
    assert g.op(g.mul(g.neg(x), g.symbol("y"))) == ops.NEG


def test_constants_are_exact(g: Graph) -> None:
    tenth, fifth = g.constant(Fraction(1, 10)), g.constant(Fraction(1, 5))
    assert g.add(tenth, fifth) == g.constant(Fraction(3, 10))
    assert g.value(g.constant(0.1)) == Fraction(0.1) != Fraction(1, 10)
    product = g.mul(g.constant(3), g.mul(tenth, g.symbol("x")))
    assert product == g.mul(g.constant(Fraction(3, 10)), g.symbol("x"))
    assert g.div(g.symbol("x"), g.constant(4)) == g.mul(g.symbol("x"), g.constant(0.25))


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_constants_are_finite(g: Graph, bad: float) -> None:
    with pytest.raises((ValueError, OverflowError)):
        g.constant(bad)


def test_long_constants_are_not_multiplied_out(g: Graph) -> None:
    n = g.constant(Fraction(1, 3))
    factor = g.constant(Fraction(10**40 + 1, 10**40 + 3))
    for _ in range(100):
        n = g.mul(n, factor)
    bits = [g.value(k).numerator.bit_length() for k in g.reach([n]) if g.op(k) == ops.CONST]
    assert max(bits) <= 1024
    assert g.op(n) == ops.MUL


@pytest.mark.parametrize(
    ("function", "argument", "value"),
    [
        ("sin", 0, 0),
        ("cos", 0, 1),
        ("exp", 0, 1),
        ("log", 1, 0),
        ("sqrt", Fraction(9, 4), Fraction(3, 2)),
        ("abs", -3, 3),
        ("floor", Fraction(-1, 2), -1),
        ("sign", -7, -1),
        ("cos", math.pi / 2, 0),
        ("sin", math.pi / 2, 1),
        ("sin", -math.pi / 6, Fraction(-1, 2)),
        ("cos", math.pi, -1),
        ("cos", 2 * math.pi / 3, Fraction(-1, 2)),
    ],
)
def test_functions_of_constants_fold_where_exact(
    g: Graph, function: str, argument: float, value: float
) -> None:
    assert getattr(g, function)(g.constant(argument)) == g.constant(value)


@pytest.mark.parametrize(("function", "argument"), [("sin", 1), ("sqrt", 2), ("exp", 1), ("sqrt", -1)])
def test_irrational_values_stay_expressions(g: Graph, function: str, argument: int) -> None:
    assert not g.is_constant(getattr(g, function)(g.constant(argument)))


def test_sums_of_angles_are_recognised(g: Graph) -> None:
    a, b = g.symbol("a"), g.symbol("b")
    s, c = g.sin, g.cos
    mul, add, sub = g.mul, g.add, g.sub
    assert add(mul(s(a), s(a)), mul(c(a), c(a))) == g.one
    assert g.is_zero(sub(s(add(a, b)), add(mul(s(a), c(b)), mul(c(a), s(b)))))
    assert g.is_zero(sub(c(sub(a, b)), add(mul(c(a), c(b)), mul(s(a), s(b)))))
    double = mul(g.two, a)
    assert s(double) == mul(g.two, mul(s(a), c(a))) or g.identical(s(double), mul(g.two, mul(s(a), c(a))))
    third = g.div(a, g.constant(3))
    cube = mul(s(third), mul(s(third), s(third)))
    assert g.identical(s(a), sub(mul(g.constant(3), s(third)), mul(g.constant(4), cube)))
    assert g.identical(s(add(a, g.constant(math.pi / 2))), c(a))
    assert g.identical(g.tan(a), g.div(s(a), c(a))) is False  # tan is opaque


def test_functions_of_products_are_recognised_as_far_as_sound(g: Graph) -> None:
    a, b = g.symbol("a"), g.symbol("b")
    p = g.mul(a, b)
    assert g.add(g.mul(g.sin(p), g.sin(p)), g.mul(g.cos(p), g.cos(p))) == g.one
    # 2 a b is twice the angle a b
    assert g.identical(g.sin(g.mul(g.two, p)), g.mul(g.two, g.mul(g.sin(p), g.cos(p))))


def test_half_of_a_sum_of_angles_keeps_its_sign() -> None:
    """With exponents reduced modulo a full turn, half of the cases would merge with the wrong sign."""
    for seed in range(20):
        g = Graph(seed=seed)
        a, b = g.symbol("a"), g.symbol("b")
        whole = g.sin(g.mul(g.half, g.add(a, b)))
        x, y = g.mul(g.half, a), g.mul(g.half, b)
        parts = g.add(g.mul(g.sin(x), g.cos(y)), g.mul(g.cos(x), g.sin(y)))
        assert g.identical(whole, parts)


def test_a_third_of_a_turn_more_is_another_angle(g: Graph) -> None:
    """The circle group has no element of order three; sin((a + 2 pi)/3) is not sin(a/3)."""
    a = g.symbol("a")
    third = g.constant(Fraction(1, 3))
    turned = g.sin(g.mul(third, g.add(a, g.constant(2 * math.pi))))
    assert not g.equal_up_to_sign(turned, g.sin(g.mul(third, a)))


def test_square_roots_do_not_choose_a_sign() -> None:
    for seed in range(12):
        g = Graph(seed=seed)
        x = g.symbol("x")
        root = g.sqrt(g.mul(x, x))
        assert not g.equal_up_to_sign(root, x)
        assert root == g.abs(x)
        y = g.add(g.mul(x, x), g.add(g.mul(g.two, x), g.one))
        assert not g.equal_up_to_sign(g.sqrt(y), g.add(x, g.one))
        assert g.mul(g.sqrt(x), g.sqrt(x)) == x


def test_a_difference_does_not_represent_a_product(g: Graph) -> None:
    a = g.symbol("a")
    difference = g.sub(g.one, g.cos(g.mul(g.two, a)))
    product = g.mul(g.two, g.mul(g.sin(a), g.sin(a)))
    assert g.op(difference) == ops.SUB
    assert g.op(product) == ops.MUL
    assert g.identical(difference, product)
    assert g.is_zero(g.sub(difference, product))
    b = g.symbol("b")
    other = g.sub(g.one, g.mul(g.two, g.mul(g.sin(b), g.sin(b))))
    cosine = g.cos(g.mul(g.two, b))
    assert (g.op(other), g.op(cosine)) == (ops.SUB, ops.COS)
    assert g.identical(other, cosine)


def test_a_singular_form_does_not_represent_a_regular_one(g: Graph) -> None:
    x = g.symbol("x")
    singular = g.div(g.sub(g.mul(x, x), g.one), g.sub(x, g.one))
    regular = g.add(x, g.one)
    assert g.op(singular) == ops.DIV
    assert g.op(regular) == ops.ADD
    assert g.identical(singular, regular)
    # from now on the regular form is the one
    assert g.div(g.mul(g.two, regular), g.two) == regular
    half_angle = g.div(g.sin(g.mul(g.two, x)), g.mul(g.two, g.cos(x)))
    assert (g.op(half_angle), g.op(g.sin(x))) == (ops.DIV, ops.SIN)
    assert g.identical(half_angle, g.sin(x))
    y = g.symbol("y")
    quotient = g.div(y, x)
    assert g.mul(y, g.div(g.one, x)) == quotient  # both divide by x


def test_a_choice_keeps_its_last_argument(g: Graph) -> None:
    """An equal choice that is asked for later, of a newer form, is the older node; this must not read what comes after it."""
    a, b = g.symbol("a"), g.symbol("b")
    chosen = g.select(g.less(a, b), b, difference := g.sub(g.one, g.cos(g.mul(g.two, a))))
    product = g.mul(g.two, g.mul(g.sin(a), g.sin(a)))
    assert product > chosen
    assert g.select(g.less(a, b), b, product) == chosen
    assert g.args(chosen)[2] == difference
    verify(g)


def test_identities_cancel_divisions(g: Graph) -> None:
    x, y = g.symbol("x"), g.symbol("y")
    assert g.div(g.mul(x, y), x) == y
    square = g.sub(g.mul(x, x), g.mul(y, y))
    total = g.add(x, y)
    assert g.div(square, g.sub(x, y)) == total


def test_division_by_zero_is_found_by_value(g: Graph) -> None:
    a, x = g.symbol("a"), g.symbol("x")
    s, c = g.sin(a), g.cos(a)
    zero = g.sub(g.sub(g.one, g.mul(s, s)), g.mul(c, c))
    with pytest.raises(DivisionByZero) as caught:
        g.div(x, zero)
    assert caught.value.numerator == x
    with pytest.raises(DivisionByZero):
        g.modulo(x, g.zero)
    with pytest.raises(DivisionByZero):
        g.power(g.zero, -2)


def test_structure_alone_does_not_know_identities() -> None:
    g = Graph(by_value=False)
    a, b = g.symbol("a"), g.symbol("b")
    assert g.add(a, b) == g.add(b, a)
    assert g.sub(a, a) == g.zero
    assert not g.is_zero(g.sub(g.add(a, b), g.add(a, g.add(b, g.one))))
    assert g.add(g.mul(g.sin(a), g.sin(a)), g.mul(g.cos(a), g.cos(a))) != g.one
    assert g.neg(g.sub(a, b)) == g.sub(b, a)
    assert g.equal_up_to_sign(g.mul(a, b), g.neg(g.mul(a, b)))


@pytest.mark.parametrize(("exponent", "operations"), [(2, 1), (3, 2), (4, 2), (5, 3), (6, 3), (7, 4), (8, 3)])
def test_powers_multiply(g: Graph, exponent: int, operations: int) -> None:
    n = g.power(g.symbol("x"), exponent)
    assert g.count_operations([n]) == operations
    assert {g.op(k) for k in g.reach([n])} == {ops.SYMBOL, ops.MUL}


def test_powers_divide_and_take_roots(g: Graph) -> None:
    x = g.symbol("x")
    assert g.power(x, 0) == g.one
    assert g.power(x, -1) == g.div(g.one, x)
    assert g.power(x, Fraction(1, 2)) == g.sqrt(x)
    assert g.power(x, Fraction(3, 2)) == g.mul(x, g.sqrt(x))
    assert g.power(x, Fraction(-1, 2)) == g.div(g.one, g.sqrt(x))
    assert g.op(g.power(x, Fraction(1, 3))) == ops.POW
    assert g.op(g.pow(x, g.symbol("y"))) == ops.POW
    assert g.pow(x, g.constant(2)) == g.mul(x, x)


def test_parity(g: Graph) -> None:
    x = g.symbol("x")
    for odd in (g.sin, g.tan, g.asin, g.atan, g.sinh, g.tanh, g.asinh, g.sign):
        assert odd(g.neg(x)) == g.neg(odd(x))
    for even in (g.cos, g.cosh, g.abs):
        assert even(g.neg(x)) == even(x)
    assert g.exp(g.neg(x)) != g.exp(x)
    assert g.sin(g.constant(-1)) == g.neg(g.sin(g.one))


def test_conditions_simplify(g: Graph) -> None:
    x, y = g.symbol("x"), g.symbol("y")
    c = g.less(x, y)
    assert g.less(g.one, g.two) == g.one
    assert g.less(x, x) == g.zero
    assert g.logical_and(c, g.one) == c
    assert g.logical_or(c, g.one) == g.one
    assert g.logical_not(g.logical_not(c)) == c
    assert g.select(g.one, x, y) == x
    assert g.select(c, x, x) == x
    assert g.select(g.logical_not(c), x, y) == g.select(c, y, x)


def test_operations_count_everything_but_leaves(g: Graph) -> None:
    x = g.symbol("x")
    n = g.neg(g.mul(g.constant(3), g.add(g.sin(x), g.cos(x))))
    assert g.count_operations([n]) == 5
    assert g.count_operations([n, g.sin(x)]) == 5


def test_a_fork_is_independent_until_adopted(g: Graph) -> None:
    x = g.symbol("x")
    fork = g.fork()
    n = fork.sin(fork.add(x, fork.symbol("y")))
    assert len(g) < len(fork)
    g.adopt(fork)
    assert g.sin(g.add(x, g.symbol("y"))) == n
    late = g.fork()
    late.mul(x, x)
    g.add(x, x)
    g.add(x, g.add(x, x))
    with pytest.raises(ValueError):
        g.adopt(late)


PROGRAM = """
from mechc.compiler.graph import Graph
g = Graph()
x, y = g.symbol("x"), g.symbol("y")
n = g.select(g.less(x, y), g.exp(g.mul(x, y)), g.sin(g.add(x, g.sqrt(y))))
print(n, len(g), g._values)
"""


def test_the_same_calls_give_the_same_graph_in_every_process() -> None:
    runs = [
        subprocess.run(
            [sys.executable, "-c", PROGRAM],
            env={"PYTHONHASHSEED": seed, "PYTHONPATH": ":".join(sys.path)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    ]
    assert runs[0] == runs[1]


def test_sums_and_products(g: Graph) -> None:
    x, y = g.symbol("x"), g.symbol("y")
    assert g.sum([]) == g.zero
    assert g.product([]) == g.one
    assert g.sum([x, y, g.neg(x)]) == y
    assert g.dot([x, y], [y, x]) == g.mul(g.two, g.mul(x, y))
    with pytest.raises(ValueError):
        g.dot([x], [x, y])


def test_names_of_symbols(g: Graph) -> None:
    x = g.symbol("link[3].angle")
    assert g.name(x) == "link[3].angle"
    with pytest.raises(KeyError):
        g.name(Node(0))


def test_a_fork_leaves_the_graph_as_it_was_until_it_is_adopted(g: Graph) -> None:
    x, y = g.symbol("x"), g.symbol("y")
    known = g.mul(x, y)
    count = len(g)
    one, other = g.fork(), g.fork()
    n = one.sin(one.add(x, one.mul(x, y)))
    assert one.mul(y, x) == known
    assert other.add(x, known) == n - 1
    late = one.fork()
    assert late.sin(late.add(x, known)) == n
    assert len(g) == count
    g.adopt(one)
    assert g.sin(g.add(x, known)) == n
    assert g.add(x, known) == n - 1
