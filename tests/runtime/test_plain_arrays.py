"""Plain arrays do what NumPy's do: the same numbers, shapes and memory, by operators, indices, functions and reductions."""

from __future__ import annotations

import itertools
import math
import random
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy
import pytest

from mechc.runtime.arrays.choice import np, plain_arrays
from mechc.runtime.arrays.plain import MOST, Plain


@pytest.fixture(autouse=True)
def plain() -> Iterator[None]:
    with plain_arrays(beside_numpy=True, until_needed=False):
        yield


def both(values: Any) -> tuple[Any, Any]:
    """Give the same numbers as a plain array and as one of NumPy."""
    made = numpy.array(values)
    found = np.array(made.tolist(), dtype=bool if made.dtype == bool else int if made.dtype == int else float)
    return found.reshape(made.shape), made


def assert_same(found: Any, expected: Any, *, plain: bool = True) -> None:
    """``plain``: what is found was made without NumPy."""
    if isinstance(expected, numpy.ndarray):
        assert isinstance(found, Plain) is plain
        assert found.shape == expected.shape
        assert found.size == expected.size and len(found) == len(expected)
        assert found.nbytes == expected.nbytes
        numpy.testing.assert_array_equal(numpy.asarray(found), expected)
        assert numpy.asarray(found).dtype == expected.dtype
        if plain:
            assert repr(found.tolist()) == repr(expected.tolist())
    else:
        assert not isinstance(found, Plain)
        numpy.testing.assert_equal(float(found), float(expected))


ROW = [1.5, -2.0, 0.0, math.inf, -0.25, math.nan]
GRID = [[1.0, -2.0, 3.0], [0.5, 0.0, -7.0], [4.0, 4.0, 1e-300], [-1.0, 2.5, 9.0]]
DEEP = [[[float(7 * i + 3 * j - k) for k in range(4)] for j in range(2)] for i in range(3)]
WHOLE = [3, -1, 0, 2, 2]
TRUTHS = [True, False, True, True, False, True]

OPERATORS: list[Callable[[Any, Any], Any]] = [
    lambda a, b: a + b,
    lambda a, b: a - b,
    lambda a, b: a * b,
    lambda a, b: a / b,
    lambda a, b: a < b,
    lambda a, b: a <= b,
    lambda a, b: a > b,
    lambda a, b: a >= b,
    lambda a, b: a == b,
    lambda a, b: a != b,
]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("operate", OPERATORS)
def test_operators(operate: Callable[[Any, Any], Any]) -> None:
    pairs: list[tuple[Any, Any]] = [
        (ROW, ROW[::-1]),
        (GRID, GRID[0]),
        (GRID, [[1.0], [0.0], [-2.0], [3.0]]),
        (DEEP, GRID[0][:1]),
        (DEEP, [[1.0], [2.0]]),
        (WHOLE, ROW[:5]),
        (WHOLE, WHOLE[::-1]),
    ]
    for one, other in pairs:
        (a, x), (b, y) = both(one), both(other)
        assert_same(operate(a, b), operate(x, y))
        assert_same(operate(b, a), operate(y, x))
    for number in (0.0, 2.5, -3, math.nan):
        for values in (ROW, GRID, WHOLE):
            a, x = both(values)
            assert_same(operate(a, number), operate(x, number))
            assert_same(operate(number, a), operate(number, x))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_operators_beside_numpy() -> None:
    a, x = both(GRID)
    for operate in OPERATORS:
        assert_same(operate(a, x + 1), operate(x, x + 1), plain=False)
        assert_same(operate(x + 1, a), operate(x + 1, x), plain=False)


def test_operators_in_place_and_of_one() -> None:
    a, x = both(GRID)
    view, seen = a[1:, ::2], x[1:, ::2]
    view *= 3.0
    seen *= 3.0
    view += a[0, ::2]
    seen += x[0, ::2]
    assert_same(a, x)
    assert_same(-a, -x)
    assert_same(abs(a), abs(x))
    assert_same(a**2, x**2)
    t, u = both(TRUTHS)
    assert_same(~t, ~u)
    assert_same(t & ~t, u & ~u)
    assert_same(t | (a[0, 0] > t), u | (x[0, 0] > u))
    t &= ~t
    u &= ~u
    assert_same(t, u)
    assert_same(a % 2.0, x % 2.0, plain=False)
    assert_same(a @ a.T, x @ x.T, plain=False)


KEYS: list[Any] = [
    0,
    -1,
    slice(None),
    slice(1, None),
    slice(None, None, -1),
    slice(2, 0, -1),
    slice(1, 1),
    slice(-2, None),
    None,
    ...,
]


def test_views_by_indices() -> None:
    for shape in ((4,), (3, 4), (3, 2, 4)):
        a, x = both(numpy.arange(float(math.prod(shape))).reshape(shape))
        for count in range(1, len(shape) + 1):
            for key in itertools.product(KEYS, repeat=count):
                if sum(one is Ellipsis for one in key) > 1:
                    continue
                found, expected = a[key], x[key]
                assert_same(found, expected)
                if isinstance(found, Plain) and found.size:
                    found[...] = np.asarray(found) * 2.0 + 1.0
                    expected[...] = expected * 2.0 + 1.0
                    assert_same(a, x)  # the same memory


def test_rows_by_lists_and_truths() -> None:
    a, x = both(DEEP)
    rows, places = both([2, 0, 2, -1])
    wanted, truths = both([True, False, True])
    assert_same(a[rows], x[places])
    assert_same(a[[2, 0]], x[[2, 0]])
    assert_same(a[wanted], x[truths])
    assert_same(a[:, :, rows], x[:, :, places])
    assert_same(a[rows, -1], x[places, -1], plain=False)
    assert_same(a[0][:, rows], x[0][:, places])
    assert_same(a[rows, 1:], x[places, 1:])
    assert_same(a[..., rows], x[..., places])
    assert_same(a[a > 3.0], x[x > 3.0])
    assert_same(a[rows, [0, 1, 0, 1]], x[places, [0, 1, 0, 1]], plain=False)
    assert_same(a[[]], x[[]])
    for key, same, value in (
        (rows, places, 5.0),
        (wanted, truths, numpy.arange(16.0).reshape(2, 2, 4).tolist()),
        ((slice(None), slice(None), rows), (slice(None), slice(None), places), -1.0),
    ):
        filling, filled = (value, value) if isinstance(value, float) else both(value)
        a[key] = filling
        x[same] = filled
        assert_same(a, x)
    a[a > 0.0] = 0.25
    x[x > 0.0] = 0.25
    assert_same(a, x)


def test_values_are_spread_where_they_are_written() -> None:
    a, x = both(DEEP)
    (b, y), (c, z) = both([[1.0], [2.0]]), both([1, 2, 3, 4])
    a[1], x[1] = b, y
    a[:, 0], x[:, 0] = c, z
    a[2, 1, 3], x[2, 1, 3] = 7, 7
    a[0], x[0] = a[0, ::-1], x[0, ::-1].copy()
    assert_same(a, x)
    with pytest.raises(ValueError, match="does not fill"):
        a[0] = np.zeros(3)
    with pytest.raises(IndexError):
        a[3]
    with pytest.raises(IndexError):
        np.zeros(3)[-4]


REDUCTIONS = ["max", "min", "sum", "any", "all"]


@pytest.mark.parametrize("name", REDUCTIONS)
def test_reductions(name: str) -> None:
    for values in (ROW, GRID, DEEP, WHOLE, TRUTHS, numpy.arange(40.0).reshape(20, 2)):
        a, x = both(values)
        axes: list[Any] = [None, *range(-x.ndim, x.ndim), *itertools.combinations(range(x.ndim), 2)]
        for axis in axes:
            assert_same(getattr(a, name)(axis=axis), getattr(x, name)(axis=axis))
            assert_same(getattr(np, name)(a, axis=axis), getattr(numpy, name)(x, axis=axis))
        assert_same(getattr(a.T, name)(axis=0), getattr(x.T, name)(axis=0))


def test_reductions_of_nothing_and_with_a_beginning() -> None:
    a, _ = both([])
    assert np.max(a, initial=0.0) == 0.0 and a.max(initial=-1.0) == -1.0 and np.sum(a) == 0.0
    with pytest.raises(ValueError, match="no numbers"):
        a.max()
    b, y = both(GRID)
    for axis in (None, 0, 1):
        assert_same(b.max(axis=axis, initial=3.5), y.max(axis=axis, initial=3.5))
    assert_same(np.nanmax(both(ROW)[0]), numpy.nanmax(ROW))
    assert np.argmax(both(TRUTHS[1:])[0]) == 1 and np.argmax(both(ROW)[0]) == numpy.argmax(ROW)
    assert np.argmin(both(GRID)[0]) == numpy.argmin(GRID) and np.argmin(both(ROW)[0]) == numpy.argmin(ROW)
    for axis in (None, 0, 1):
        assert_same(b.mean(axis=axis), y.mean(axis=axis))
    assert_same(np.mean(b), numpy.mean(y))


CALLS: list[Callable[[Any, Any], Any]] = [
    lambda n, g: n.abs(g),
    lambda n, g: n.sqrt(n.abs(g)),
    lambda n, g: n.exp(g * n.array([1e300, 200.0, 0.1])),
    lambda n, g: n.log(g - 1.0) + 1e3,
    lambda n, g: n.exp(n.mean(n.log([1.0, 2.0, 8.0]))),
    lambda n, g: n.isfinite(g / n.abs(g)),
    lambda n, g: n.maximum(g, 0.5),
    lambda n, g: n.minimum(g[:, :1], g),
    lambda n, g: n.maximum(g, g / (g - g)),
    lambda n, g: n.maximum.accumulate(g[:, 1]),
    lambda n, g: n.where(g > 0, g, 0.0),
    lambda n, g: n.where(g[0] > 0, g, -g),
    lambda n, g: n.clip(g, -1.0, 2.0),
    lambda n, g: n.divide(g, g - 4.0, out=n.full(g.shape, 9.0), where=g != 4.0),
    lambda n, g: n.outer(g[0], g[:, 0]),
    lambda n, g: n.diff(g[:, 2]),
    lambda n, g: n.diff(g, axis=0),
    lambda n, g: n.flatnonzero(g > 1.0),
    lambda n, g: n.searchsorted(n.array([-1.0, 0.0, 0.0, 2.0, 4.0]), g[:, 0]),
    lambda n, g: n.searchsorted(n.array([-1.0, 0.0, 0.0, 2.0, 4.0]), g, side="right"),
    lambda n, g: n.searchsorted(n.array([0.0, 1.0]), 0.5),
    lambda n, g: n.isin(g[0], n.array([3.0, 1.0])),
    lambda n, g: n.empty((2, 0)),
    lambda n, g: n.zeros(3, dtype=n.uint8),
    lambda n, g: n.zeros(3, dtype=bool),
    lambda n, g: n.ones((2, 2)),
    lambda n, g: n.full(2, n.nan),
    lambda n, g: n.full(2, 7),
    lambda n, g: n.zeros_like(g),
    lambda n, g: n.ones_like(g[0]),
    lambda n, g: n.full_like(g[0], 2.5),
    lambda n, g: n.array([[1, 2], [3, 4]], dtype=n.float64),
    lambda n, g: n.array([g[0], g[1]]),
    lambda n, g: n.array([g[0], g[1]]).T,
    lambda n, g: n.asarray(g, dtype=n.float64),
    lambda n, g: n.ascontiguousarray(g[:, 1]),
    lambda n, g: n.arange(4),
    lambda n, g: n.arange(2, 5, dtype=n.float64),
    lambda n, g: n.linspace(0.0, 10.0, 500),
    lambda n, g: n.linspace(-1.0, 0.3, 7),
    lambda n, g: n.linspace(2.0, 2.0, 3),
    lambda n, g: n.linspace(2.0, 3.0, 1),
    lambda n, g: n.linspace(0, 9, 4).astype(int),
    lambda n, g: n.broadcast_to(g[0], (2, 3)),
    lambda n, g: n.broadcast_to(g[:1], (5, 3)).copy(),
    lambda n, g: n.concatenate([g, g[:0], g[1:2]]),
    lambda n, g: n.vstack([g, g[0]]),
    lambda n, g: n.hstack([g, g[:, ::-1]]),
    lambda n, g: n.hstack([g[0], g[1]]),
    lambda n, g: n.column_stack([g, g[:, 0]]),
    lambda n, g: n.append(g[0], 5.0),
    lambda n, g: n.append(g, g[0]),
    lambda n, g: n.tile(g[0], (3, 1)),
    lambda n, g: n.repeat(g, 3, axis=0),
    lambda n, g: n.repeat(g, 2),
    lambda n, g: n.r_[False, g[0] > 0, False].astype(int),
    lambda n, g: n.r_[0.0, g[0]],
    lambda n, g: n.linalg.norm(g[0]),
    lambda n, g: n.linalg.norm(g, axis=-1, keepdims=True),
    lambda n, g: g.reshape(2, -1),
    lambda n, g: g.T.reshape((6, 2)),
    lambda n, g: g[:, 1:].ravel(),
    lambda n, g: g[None, :, None],
]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("call", CALLS)
def test_functions(call: Callable[[Any, Any], Any]) -> None:
    a, x = both(GRID)
    assert_same(call(np, a), call(numpy, x))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_what_is_not_known_numpy_does() -> None:
    a, x = both(GRID)
    calls: list[Callable[[Any, Any], Any]] = [
        lambda n, g: n.cos(g),
        lambda n, g: n.linalg.svd(g)[1],
        lambda n, g: n.max(g, axis=0, keepdims=True),
        lambda n, g: n.repeat(g, [1, 2, 3, 4], axis=0),
        lambda n, g: n.diff(g, axis=1),
        lambda n, g: n.linspace(0.0, 1.0, 4, endpoint=False),
        lambda n, g: n.r_[1:4],
        lambda n, g: g.cumsum(),
        lambda n, g: n.abs(n.cos(g)),
    ]
    for call in calls:
        assert_same(call(np, a), call(numpy, x), plain=False)


def test_numpy_writes_to_plain_arrays() -> None:
    """Also where it was loaded between making an array and filling it."""
    a, x = both(GRID)
    for n in (np, numpy):
        found = np.zeros((4, 3))
        n.maximum(found, x, out=found)
        assert_same(found, numpy.maximum(0.0, x))
        n.divide(x, a, out=found, where=x > 0)
        assert_same(found, numpy.divide(x, x, out=numpy.maximum(0.0, x), where=x > 0))
        n.divide(x, a, out=found, where=a > 0)
        assert_same(found, numpy.divide(x, x, out=numpy.maximum(0.0, x), where=x > 0))
        n.add(a, 1.0, out=found[::-1])
        assert_same(found, (x + 1.0)[::-1])
    assert_same(numpy.add.reduce(a), x.sum(axis=0), plain=False)


def test_many_numbers_are_numpys() -> None:
    a = np.ones(MOST + 1)
    assert isinstance(a, Plain) and isinstance(a + 1.0, numpy.ndarray)
    assert float((a + 1.0).sum()) == 2.0 * (MOST + 1)
    few = np.ones(MOST)
    assert isinstance(few + 1.0, Plain)


def test_memory_is_shared_with_numpy_and_grows() -> None:
    a = np.zeros((2, 3))
    numpy.asarray(a)[1, 2] = 4.0
    assert a[1, 2] == 4.0 and a[1:].ctypes.data == a.ctypes.data + 24
    a.resize((3, 3), refcheck=False)
    assert_same(a, numpy.array([[0, 0, 0], [0, 0, 4.0], [0, 0, 0]]))
    a.resize((1, 3), refcheck=False)
    assert_same(a, numpy.zeros((1, 3)))
    assert np.empty(0).ctypes.data  # C is never given the address of nothing


def test_random_chains_of_views_and_copies() -> None:
    """Seeded: parts of parts of parts, written and read."""
    chance = random.Random(4)
    for _ in range(200):
        shape = [chance.randint(1, 4) for _ in range(chance.randint(1, 4))]
        a, x = both(numpy.arange(float(math.prod(shape))).reshape(shape))
        whole, all_of_it = a, x
        for _ in range(3):
            if not x.ndim or not x.size:
                break
            key: list[Any] = [
                chance.choice([slice(None), slice(None, None, -1), slice(0, n, 2), chance.randrange(n)])
                for n in x.shape
            ]
            key.insert(chance.randint(0, x.ndim), None)
            a, x = a[tuple(key)], x[tuple(key)]
            if not isinstance(a, Plain):
                break
            order = list(range(x.ndim))
            chance.shuffle(order)
            a, x = a.transposed(order), x.transpose(order)
            assert_same(a, x)
            a[...] = abs(np.asarray(a)) + 0.5
            x[...] = abs(x) + 0.5
        assert_same(whole, all_of_it)


def test_numpy_takes_over_where_it_is_needed() -> None:
    """In a process of its own: until then it is not loaded, and what was to be quiet is quiet afterwards."""
    program = (
        "import sys, warnings\n"
        "warnings.simplefilter('error')\n"
        "from mechc.runtime.arrays.choice import np, plain_arrays\n"
        "with plain_arrays():\n"
        "    a = np.linspace(-1.0, 1.0, 3)\n"
        "    with np.errstate(all='ignore'):\n"
        "        assert 'numpy' not in sys.modules and (a / 0.0).tolist()[0] < 0\n"
        "        b = np.cosh(a)\n"
        "        assert 'numpy' in sys.modules and type(np.zeros(2)).__name__ == 'ndarray'\n"
        "assert type(np.zeros(2)).__name__ == 'ndarray'\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
