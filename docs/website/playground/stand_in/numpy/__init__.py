"""What compiling a model takes of NumPy, for small matrices, in Python alone: the playground holds this in its place.

NumPy has no wheel for Pyodide among those that pip finds. Looking at constraints (``compiler/equations/rows``) takes a few
products, norms and decompositions of some rows, which decide by tolerances; so the modules that come out are the same, as a test compares.
Slices are copies here, and random numbers are others.
"""

from __future__ import annotations

import builtins
import itertools
import math
import random as _random
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

inf, nan, pi = math.inf, math.nan, math.pi
newaxis = None
float64, bool_, int32, int8, intp, uint8 = float, bool, int, int, int, int
Shape = tuple[int, ...]


def _lacking(name: str) -> ModuleNotFoundError:
    """Return what is raised for what is not here, as if there were no NumPy: the playground tells that in its words."""
    return ModuleNotFoundError(f"this stand-in for NumPy has no '{name}'", name="numpy")


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    raise _lacking(name)


class _Room(type):
    """A module inside: what it does not have is told in the same way."""

    def __getattr__(cls, name: str) -> Any:
        raise AttributeError(name) if name.startswith("__") else _lacking(name)


class ndarray:
    """Numbers in rows: ``data`` has all of them, the last axis runs fastest."""

    __slots__ = ("data", "shape")
    __array_priority__ = 1000

    def __init__(self, shape: Shape, data: list[Any]) -> None:
        self.shape = shape
        self.data = data

    # ------------------------------------------------------------ form

    ndim = property(lambda self: len(self.shape))
    size = property(lambda self: len(self.data))
    T = property(lambda self: self.transpose())

    def __len__(self) -> int:
        return self.shape[0]

    def __iter__(self) -> Iterator[Any]:
        return (self[i] for i in range(self.shape[0]))

    def __repr__(self) -> str:
        return f"array({self.tolist()})"

    def __bool__(self) -> bool:
        return bool(self.item())

    def __float__(self) -> float:
        return float(self.item())

    def item(self) -> Any:
        (value,) = self.data
        return value

    def tolist(self) -> Any:
        return [row.tolist() if isinstance(row, ndarray) else row for row in self]

    def copy(self) -> ndarray:
        return ndarray(self.shape, self.data[:])

    def astype(self, kind: Callable[[Any], Any]) -> ndarray:
        return ndarray(self.shape, [kind(x) for x in self.data])

    def ravel(self) -> ndarray:
        return ndarray((self.size,), self.data[:])

    def reshape(self, *shape: Any) -> ndarray:
        wanted = shape[0] if isinstance(shape[0], tuple) else shape
        known = math.prod(n for n in wanted if n >= 0)
        return ndarray(tuple(n if n >= 0 else self.size // known for n in wanted), self.data[:])

    def transpose(self, *order: int) -> ndarray:
        axes = order or tuple(reversed(range(self.ndim)))
        steps, shape = _steps(self.shape), tuple(self.shape[a] for a in axes)
        return ndarray(shape, [self.data[k] for k in _walk(shape, [steps[a] for a in axes])])

    # ------------------------------------------------------------ parts

    def _picked(self, key: Any) -> tuple[Shape, list[int]]:
        """Return the shape of a part and where its numbers are."""
        if isinstance(key, ndarray) and key.ndim == self.ndim > 1:
            return (sum(map(bool, key.data)),), [k for k, is_in in enumerate(key.data) if is_in]
        keys = list(key) if isinstance(key, tuple) else [key]
        keys += [slice(None)] * (self.ndim - sum(k is not None for k in keys))
        axes, shape, axis = list[list[int]](), list[int](), 0
        steps = _steps(self.shape)
        for one in keys:
            if one is None:
                shape.append(1)
                continue
            n = self.shape[axis]
            if isinstance(one, slice):
                found = list(range(*one.indices(n)))
                shape.append(len(found))
            elif isinstance(one, ndarray | list | range):
                listed = one.data if isinstance(one, ndarray) else list(one)
                if listed and isinstance(listed[0], bool):
                    found = [k for k, is_in in enumerate(listed) if is_in]
                else:
                    found = [k + n if k < 0 else k for k in listed]
                shape.append(len(found))
            else:
                found = [one + n if one < 0 else int(one)]
                if not 0 <= found[0] < n:
                    raise IndexError(one)
            axes.append([k * steps[axis] for k in found])
            axis += 1
        return tuple(shape), [sum(place) for place in itertools.product(*axes)]

    def __getitem__(self, key: Any) -> Any:
        shape, places = self._picked(key)
        return ndarray(shape, [self.data[k] for k in places]) if shape else self.data[places[0]]

    def __setitem__(self, key: Any, value: Any) -> None:
        shape, places = self._picked(key)
        values = broadcast_to(value, shape).data if shape else [array(value).item()]
        for k, x in zip(places, values, strict=True):
            self.data[k] = x

    # ------------------------------------------------------------ arithmetic

    def __neg__(self) -> ndarray:
        return _each(lambda x: -x, self)

    def __abs__(self) -> ndarray:
        return _each(builtins.abs, self)

    def __invert__(self) -> ndarray:
        return _each(lambda x: not x, self)

    def __matmul__(self, other: Any) -> Any:
        a, b = self, array(other)
        left, right = a.ndim == 1, b.ndim == 1
        if a.ndim > 2 or b.ndim > 2:
            pairs = zip(
                broadcast_to(a, (len(b), *a.shape)) if a.ndim == 2 else a,
                b if b.ndim > 2 else [b] * len(a),
                strict=True,
            )
            return array([x @ y for x, y in pairs])
        if left:
            a = ndarray((1, a.size), a.data)
        if right:
            b = ndarray((b.size, 1), b.data)
        (n, m), width = a.shape, b.shape[1]
        columns = [b.data[j::width] if width else [] for j in range(width)]
        rows = [a.data[i * m : (i + 1) * m] for i in range(n)]
        found = [_dot(row, column) if m else 0.0 for row in rows for column in columns]
        shape = ((n,) if not left else ()) + ((width,) if not right else ())
        return ndarray(shape, found) if shape else found[0]

    def __rmatmul__(self, other: Any) -> Any:
        return array(other) @ self

    # ------------------------------------------------------------ sums

    def _along(self, take: Callable[[list[Any]], Any], axis: int | None, keepdims: bool = False) -> Any:
        if axis is None:
            found = take(self.data)
            return ndarray((1,) * self.ndim, [found]) if keepdims else found
        axis %= self.ndim
        steps, n = _steps(self.shape), self.shape[axis]
        shape = self.shape[:axis] + self.shape[axis + 1 :]
        others = [s for k, s in enumerate(steps) if k != axis]
        data = [take([self.data[at + k * steps[axis]] for k in range(n)]) for at in _walk(shape, others)]
        return (
            ndarray((*self.shape[:axis], 1, *self.shape[axis + 1 :]) if keepdims else shape, data)
            if shape or keepdims
            else data[0]
        )

    def sum(self, axis: int | None = None, keepdims: bool = False) -> Any:
        return self._along(
            math.fsum if self.data and isinstance(self.data[0], float) else builtins.sum, axis, keepdims
        )

    def max(self, axis: int | None = None, keepdims: bool = False, initial: float | None = None) -> Any:
        return self._along(lambda row: _most(row if initial is None else [*row, initial]), axis, keepdims)

    def min(self, axis: int | None = None, keepdims: bool = False) -> Any:
        return -(-self).max(axis, keepdims)

    def all(self, axis: int | None = None) -> Any:
        return self._along(builtins.all, axis)

    def any(self, axis: int | None = None) -> Any:
        return self._along(builtins.any, axis)

    def argmax(self) -> int:
        return builtins.max(range(self.size), key=self.data.__getitem__)


def _steps(shape: Shape) -> list[int]:
    return [math.prod(shape[k + 1 :]) for k in range(len(shape))]


def _walk(shape: Shape, steps: Sequence[int]) -> Iterator[int]:
    return (
        sum(place)
        for place in itertools.product(
            *(range(0, n * s, s) if s else [0] * n for n, s in zip(shape, steps, strict=True))
        )
    )


def _most(row: Sequence[Any]) -> Any:
    return next((x for x in row if x != x), None) or builtins.max(row)


def _each(function: Callable[..., Any], *given: Any) -> Any:
    """Apply a function to numbers of equal place."""
    arrays = [array(x) for x in given]
    first = arrays[0].shape
    if builtins.all(a.shape == first for a in arrays):
        return ndarray(first, list(map(function, *(a.data for a in arrays))))
    ndim = builtins.max(a.ndim for a in arrays)
    shapes = [(1,) * (ndim - a.ndim) + a.shape for a in arrays]
    shape = tuple(builtins.max(axis) if 0 not in axis else 0 for axis in zip(*shapes, strict=True))
    return ndarray(shape, list(map(function, *(broadcast_to(a, shape).data for a in arrays))))


def broadcast_to(value: Any, shape: Shape) -> ndarray:
    a = array(value)
    if a.shape == shape:
        return a
    own = (1,) * (len(shape) - a.ndim) + a.shape
    if any_of(n not in (1, m) for n, m in zip(own, shape, strict=True)):
        raise ValueError(f"{a.shape} does not fit {shape}")
    steps = [0 if n == 1 else s for n, s in zip(own, _steps(own), strict=True)]
    return ndarray(shape, [a.data[k] for k in _walk(shape, steps)])


any_of = builtins.any


def _products(a: Iterable[float], b: Iterable[float]) -> float:
    return math.fsum(map(float.__mul__, a, b))


# since Python 3.12
_dot: Callable[[Sequence[float], Sequence[float]], float] = getattr(math, "sumprod", _products)


def _divided(a: float, b: float) -> float:
    if b:
        return a / b
    return nan if not a or a != a else math.copysign(inf, a) * math.copysign(1.0, b)


def _operators() -> None:
    kinds: dict[str, Callable[[Any, Any], Any]] = {
        "add": lambda a, b: a + b,
        "sub": lambda a, b: a - b,
        "mul": lambda a, b: a * b,
        "truediv": _divided,
        "pow": lambda a, b: a**b,
        "or": lambda a, b: a or b,
        "and": lambda a, b: a and b,
    }
    for name, function in kinds.items():
        setattr(ndarray, f"__{name}__", lambda self, other, f=function: _each(f, self, other))
        setattr(ndarray, f"__r{name}__", lambda self, other, f=function: _each(f, other, self))

        def in_place(self: ndarray, other: Any, f: Any = function) -> ndarray:
            self.data[:] = _each(f, self, broadcast_to(other, self.shape)).data
            return self

        setattr(ndarray, f"__i{name}__", in_place)
    for name in ("lt", "le", "gt", "ge", "eq", "ne"):
        compare = getattr(__import__("operator"), name)
        setattr(ndarray, f"__{name}__", lambda self, other, f=compare: _each(f, self, other))


_operators()
ndarray.__hash__ = None  # type: ignore[assignment]

# ---------------------------------------------------------------- making


def array(value: Any, dtype: Any = None) -> ndarray:
    if isinstance(value, ndarray):
        found = value
    elif isinstance(value, list | tuple | range) or hasattr(value, "__next__"):
        parts = [array(x) for x in value]
        shape = parts[0].shape if parts else ()
        found = ndarray((len(parts), *shape), [x for part in parts for x in part.data])
    else:
        found = ndarray((), [value])
    return found if dtype is None else found.astype(dtype)


asarray = array


def zeros(shape: Any, dtype: Any = float) -> ndarray:
    return full(shape, dtype(0))


def ones(shape: Any) -> ndarray:
    return full(shape, 1.0)


def full(shape: Any, value: Any) -> ndarray:
    wanted = shape if isinstance(shape, tuple) else (shape,)
    return ndarray(wanted, [value] * math.prod(wanted))


def zeros_like(a: ndarray) -> ndarray:
    return zeros(a.shape)


def eye(n: int) -> ndarray:
    return ndarray((n, n), [float(i == j) for i in range(n) for j in range(n)])


def arange(*bounds: int) -> ndarray:
    return array(list(range(*bounds)))


def hstack(parts: Sequence[ndarray]) -> ndarray:
    rows = [[x for part in parts for x in part[i].data] for i in range(len(parts[0]))]
    return ndarray((len(rows), builtins.sum(p.shape[1] for p in parts)), [x for row in rows for x in row])


def outer(a: ndarray, b: ndarray) -> ndarray:
    return ndarray((a.size, b.size), [x * y for x in a.data for y in b.data])


def diag(a: ndarray) -> ndarray:
    return ndarray((len(a),), [a.data[i * (len(a) + 1)] for i in range(len(a))])


def trace(a: ndarray) -> float:
    return float(diag(a).sum()) if len(a) else 0.0


def einsum(form: str, a: ndarray, b: ndarray) -> ndarray:
    if form != "ij,ji->i":
        raise _lacking(form)
    return (a * b.T).sum(axis=1)


# ---------------------------------------------------------------- functions of numbers


def _elementwise(function: Callable[..., Any]) -> Callable[..., Any]:
    def applied(*given: Any) -> Any:
        if not any_of(isinstance(x, ndarray | list | tuple) for x in given):
            return function(*given)
        return _each(function, *given)

    return applied


abs = _elementwise(builtins.abs)
sqrt, log = _elementwise(math.sqrt), _elementwise(math.log)
cos, sin = _elementwise(math.cos), _elementwise(math.sin)
square = _elementwise(lambda x: x * x)
isfinite, isnan = _elementwise(math.isfinite), _elementwise(math.isnan)
maximum = _elementwise(lambda a, b: a if a != a or a > b else b)
minimum = _elementwise(lambda a, b: a if a != a or a < b else b)
where = _elementwise(lambda is_in, a, b: a if is_in else b)


def divide(a: Any, b: ndarray, out: ndarray, where: ndarray) -> ndarray:
    return _each(lambda x, y, z, is_in: _divided(x, y) if is_in else z, a, b, out, where)


def flatnonzero(a: ndarray) -> ndarray:
    return array([k for k, x in enumerate(a.data) if x])


def max(a: Any, axis: int | None = None) -> Any:
    return array(a).max(axis)


def any(a: Any, axis: int | None = None) -> Any:
    return array(a).any(axis)


def all(a: Any, axis: int | None = None) -> Any:
    return array(a).all(axis)


# ---------------------------------------------------------------- decompositions


def _rotated(rows: list[list[float]], basis: list[list[float]]) -> None:
    """Turn rows against each other until all are orthogonal (Hestenes 1958), and those of the basis along with them."""
    n = len(rows)
    least = (2.0**-50 * math.sqrt(builtins.sum(_dot(r, r) for r in rows))) ** 2
    for _ in range(60):
        still = True
        for i, j in itertools.combinations(range(n), 2):
            a, b, c = _dot(rows[i], rows[i]), _dot(rows[j], rows[j]), _dot(rows[i], rows[j])
            if builtins.abs(c) <= 1e-15 * math.sqrt(a * b) or a <= least * 1e-6 or b <= least * 1e-6:
                continue
            still = False
            tau = (b - a) / (2 * c)
            t = math.copysign(1.0, tau) / (builtins.abs(tau) + math.hypot(1.0, tau))
            cos_ = 1 / math.hypot(1.0, t)
            for m in (rows, basis):
                x, y = m[i], m[j]
                m[i] = [cos_ * (p - t * q) for p, q in zip(x, y, strict=True)]
                m[j] = [cos_ * (t * p + q) for p, q in zip(x, y, strict=True)]
        if still:
            break


class finfo:
    """numpy.finfo of floats"""

    eps = 2.0**-52

    def __init__(self, kind: object) -> None:
        pass


class linalg(metaclass=_Room):
    """numpy.linalg"""

    class LinAlgError(ValueError):
        """numpy.linalg.LinAlgError"""

    @staticmethod
    def norm(a: ndarray, axis: int | None = None) -> Any:
        if axis is None:
            return math.hypot(*a.data)
        return a._along(lambda row: math.hypot(*row), axis)

    @staticmethod
    def solve(a: ndarray, b: ndarray) -> ndarray:
        n = len(a)
        rows = [[*a.data[i * n : (i + 1) * n], b.data[i]] for i in range(n)]
        for k in range(n):
            best = builtins.max(range(k, n), key=lambda i: builtins.abs(rows[i][k]))
            rows[k], rows[best] = rows[best], rows[k]
            if not rows[k][k]:
                raise linalg.LinAlgError("singular")
            for i in range(k + 1, n):
                share = rows[i][k] / rows[k][k]
                if share:
                    rows[i] = [x - share * y for x, y in zip(rows[i], rows[k], strict=True)]
        x = [0.0] * n
        for k in reversed(range(n)):
            x[k] = (rows[k][n] - _dot(rows[k][k + 1 : n], x[k + 1 :])) / rows[k][k]
        return ndarray((n,), x)

    @staticmethod
    def eigh(a: ndarray) -> tuple[ndarray, ndarray]:
        """Jacobi's rotations: eigenvalues in ascending order, eigenvectors in columns."""
        n = len(a)
        m, v = a.tolist() if n else [], eye(n).tolist() if n else []
        for _ in range(60):
            off = math.hypot(*(m[i][j] for i in range(n) for j in range(i))) if n > 1 else 0.0
            if off <= 1e-16 * math.hypot(*a.data):
                break
            for i, j in itertools.combinations(range(n), 2):
                if not m[i][j]:
                    continue
                theta = (m[j][j] - m[i][i]) / (2 * m[i][j])
                t = math.copysign(1.0, theta) / (builtins.abs(theta) + math.hypot(1.0, theta))
                c = 1 / math.hypot(1.0, t)
                s = t * c
                m[i], m[j] = (
                    [c * x - s * y for x, y in zip(m[i], m[j], strict=True)],
                    [s * x + c * y for x, y in zip(m[i], m[j], strict=True)],
                )
                for row in m:
                    row[i], row[j] = c * row[i] - s * row[j], s * row[i] + c * row[j]
                v[i], v[j] = (
                    [c * x - s * y for x, y in zip(v[i], v[j], strict=True)],
                    [s * x + c * y for x, y in zip(v[i], v[j], strict=True)],
                )
        order = sorted(range(n), key=lambda k: m[k][k])
        return array([m[k][k] for k in order]), array([v[k] for k in order]).T if n else zeros((0, 0))

    @staticmethod
    def svd(a: ndarray, full_matrices: bool = True, compute_uv: bool = True) -> Any:
        """U with the columns that belong to singular values, these, in descending order, and a whole V transposed."""
        m, n = a.shape
        rows, basis = a.T.tolist() if n and m else [[] for _ in range(n)], eye(n).tolist() if n else []
        if m:
            _rotated(rows, basis)
        sizes = [math.hypot(*row) if row else 0.0 for row in rows]
        order = sorted(range(n), key=lambda k: -sizes[k])
        kept = order[: builtins.min(m, n)]
        values = array([sizes[k] for k in kept])
        if not compute_uv:
            return values
        u = [[x / sizes[k] if sizes[k] else 0.0 for x in rows[k]] for k in kept]
        return array(u).T if kept else zeros((m, 0)), values, array([basis[k] for k in order])

    @staticmethod
    def pinv(a: ndarray, rcond: float = 1e-15, hermitian: bool = False) -> ndarray:
        if hermitian:
            values, vectors = linalg.eigh(a)
            u, s, vt = vectors, abs(values), vectors.T
            sign = where(values < 0, -1.0, 1.0)
        else:
            u, s, vt = linalg.svd(a)
            vt, sign = vt[: s.size], ones(s.size)
        kept = s > rcond * s.max(initial=0.0)
        inverse = where(kept, sign / where(kept, s, 1.0), 0.0)
        return (vt.T * inverse) @ u.T

    @staticmethod
    def lstsq(a: ndarray, b: ndarray, rcond: float | None = None) -> tuple[ndarray]:
        share = 2.0**-52 * builtins.max(a.shape) if rcond is None else rcond
        return (linalg.pinv(a, share) @ b,)


class random(metaclass=_Room):
    """numpy.random"""

    class default_rng:
        """Other numbers than NumPy's, the same on every machine."""

        def __init__(self, seed: int) -> None:
            self._made = _random.Random(seed)

        def standard_normal(self, size: int | None = None) -> Any:
            if size is None:
                return self._made.gauss(0.0, 1.0)
            return array([self._made.gauss(0.0, 1.0) for _ in range(size)])

        def uniform(self, low: float, high: float) -> float:
            return self._made.uniform(low, high)
