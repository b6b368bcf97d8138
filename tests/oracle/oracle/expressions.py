"""What an expression is at one point of a motion (language, sections 6, 7 and 12)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, reduce
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from mechc.compiler.flat import model as flat
from oracle import matrices, poses
from oracle.fields import differences, moved
from oracle.integrals import ONE_BY_ONE, definite_integral
from oracle.meshes import solid
from oracle.poses import Pose, vector
from oracle.series import FUNCTIONS, Series, angle_of, apply, known, places, power, real, spread, steps_of
from oracle.values import NotCovered, Uneven

Value = Any
RELATIONS: dict[str, tuple[Callable[[Any, Any], bool], int]] = {
    "less": (lambda a, b: a < b, -1),
    "less_equal": (lambda a, b: a <= b, -1),
    "greater": (lambda a, b: a > b, 1),
    "greater_equal": (lambda a, b: a >= b, 1),
}

DUE = 1e-12
"""As a share of a time, how near to it is due what comes with the time alone, as of ticks."""
EDGES: set[Any] = set()
"""Decisions that were taken exactly where they change, since somebody emptied this: both sides are right there."""
BENDS: set[Any] = set()
"""Those among them that count wherever they are tied: a bend of what is zero in all motions, but not for the displacements
that ask for a force, has no derivative there; and rounding decides for the floor of what is whole but for rounding, and
between numbers that are one but for it."""
ROUNDING = 1e-11
"""How near to a whole number the floor of a number that moves is one of rounding."""
ROUNDED = 1e-15
"""How near to each other, as a share of their size, rounding decides which of two numbers is larger."""


_OF_RATES = frozenset({"vel", "vel_at", "angvel"})
"""Functions that look at how their arguments go on."""


_BY_ONE_NUMBER = frozenset({"equal", "not_equal", "div", "mesh_volume", "mesh_centre", "mesh_inertia"})
"""Functions that look at the number itself, the same at all places."""


def each(f: Callable[[Any], Any], x: Value) -> Value:
    """Apply a function to a number or to every element of an array."""
    if not isinstance(x, np.ndarray):
        return f(x)
    out = np.empty(x.shape, object)
    for i in np.ndindex(*x.shape):
        out[i] = f(x[i])
    return out


def der(x: Value) -> Value:
    """The derivative by time along the motion; what is not a series is constant."""
    return each(lambda s: s.der() if isinstance(s, Series) else 0.0, x)


def rate_of(x: Any) -> Any:
    return der(np.asarray(x, object))


class Evaluator:
    """Values of expressions. ``names`` holds variables, ``question`` answers queries, ``frame`` places free frames."""

    def __init__(
        self,
        names: Mapping[str, Value],
        definitions: Mapping[str, flat.Definition],
        space: int,
        frame: Callable[[str], Pose],
        question: Callable[[flat.Query], Value],
        frozen: dict[Any, Any] | None = None,
    ) -> None:
        self.names, self.definitions, self.space = names, definitions, space
        self.frame, self.question = frame, question
        self.frozen = frozen
        self.seen: dict[Any, tuple[Any, Any]] = {}
        self.floors: dict[Any, float] = {}
        self.local: dict[str, Value] = {}
        self.memo: dict[str, Value] = {}
        self.fixed: dict[tuple[int, bool], Value] | None = None
        self.many: tuple[int, int] | None = None  # steps and places, where an integral looks at many at once
        self.reached: dict[int, tuple[Any, frozenset[str]]] = {}
        self.previous: Evaluator | None = None
        self.due = 0.0
        self.numbers_only = False
        self.event: Callable[[flat.Apply], bool] | None = None
        self.lazy: dict[str, Callable[[], Value]] = {}

    # ------------------------------------------------------------ decisions

    def decide(self, key: Any, margin: Any, now: bool) -> bool:
        """A choice of a law: as it is now, or as it stays up to the next event (events, section 5).

        At an instant that is ``due`` what the time alone decides is as it is right behind it.
        """
        self.alike(margin)
        if real(margin) == 0:
            EDGES.add(key)
        if self.due and isinstance(margin, Series) and margin.e is None and len(margin.v) > 1:
            rate = margin.v[1, 0].real
            if abs(real(margin)) <= DUE * self.due * abs(rate):
                return bool(rate > 0)
        if self.frozen is None or not (
            self.numbers_only or isinstance(margin, Series) or isinstance(self.frozen, Fresh)
        ):
            return now
        choice = self.frozen.setdefault(key, now)
        self.seen[key] = (margin if choice else -margin, choice)
        return bool(choice)

    def alike(self, margin: Any) -> None:
        """Leave off where a choice is not the same at all places, or is tied at one."""
        if self.many and isinstance(margin, Series):
            sides = margin.v[0].real
            if self.due or not (np.all(sides > 0) or np.all(sides < 0)):
                raise Uneven

    def bend(self, key: Any, margin: Any, now: bool) -> bool:
        """The side of a bend: a choice that is tied with a derivative has none there."""
        self.alike(margin)
        if abs(real(margin)) <= 10 * ROUNDED and moves(margin):
            EDGES.add(key)
            BENDS.add(key)
        return self.decide(key, margin, now)

    def whole_below(self, key: Any, x: Any) -> float:
        """The floor of a number, kept up to the next event."""
        if self.many and steps_of(x) > 1:
            raise Uneven
        off = abs(real(x) - round(real(x)))
        if off <= ROUNDING and (off or isinstance(x, Series)):
            EDGES.add(key)
            if off or moves(x):
                BENDS.add(key)
        if self.frozen is None or not (self.numbers_only or isinstance(x, Series)):
            return math.floor(real(x))
        n = self.frozen.setdefault(key, math.floor(real(x)))
        self.floors[key] = real(x)
        self.seen[key] = (x - n if real(x) - n < 0.5 else n + 1 - x, n)
        return float(n)

    # ------------------------------------------------------------ expressions

    def __call__(self, e: flat.Expression) -> Value:
        if self.fixed is None or isinstance(e, flat.Literal) or not self.free(e):
            return self.value(e)
        key = id(e), self.numbers_only
        if key not in self.fixed:
            outer = self.seen, self.many
            self.seen, self.many = {}, None
            try:
                self.fixed[key] = self.value(e)
            finally:
                self.seen, self.many = outer
        return self.fixed[key] if self.many is None else everywhere(self.fixed[key], self.many)

    @contextmanager
    def only_numbers(self, only: bool = True) -> Iterator[None]:
        """Leave out how values go on and answer to displacements, where nothing asks for it: much faster.

        At an instant that is due the rates say how time decides, so that nothing is left out.
        """
        outer, self.numbers_only = self.numbers_only, only and not self.due
        try:
            yield
        finally:
            self.numbers_only = outer

    def free(self, e: flat.Expression) -> bool:
        """Whether no variable of an integral enters: then the value is the same at all its points."""
        return self.reach(e).isdisjoint(self.local)

    def reach(self, e: Any) -> frozenset[str]:
        """The names that an expression contains, by itself and in definitions."""
        if id(e) not in self.reached:
            found: set[str] = set()
            if isinstance(e, flat.Name):
                found.add(e.name)
                value = self.definitions[e.name].value if e.name in self.definitions else None
                found |= self.reach(value) if value is not None else set()
            for part in e if isinstance(e, tuple) else (getattr(e, f) for f in e.__struct_fields__):
                found |= self.reach(part) if isinstance(part, tuple | flat.Typed) else set()
            self.reached[id(e)] = (
                e,
                frozenset(found),
            )  # with what has the number, so that nothing else gets it
        return self.reached[id(e)][1]

    def value(self, e: flat.Expression) -> Value:
        if self.numbers_only and (
            isinstance(e, flat.Derivative | flat.Query | flat.FieldDerivative)
            or (isinstance(e, flat.Apply) and e.function in _OF_RATES)
        ):
            if self.many:
                raise Uneven
            with self.only_numbers(False):
                return now(self.value(e))
        match e:
            case flat.Apply():
                return self.apply(e)
            case flat.Literal():
                return e.value if isinstance(e.value, bool | str) else float(e.value)
            case flat.Name():
                return self.name(e.name)
            case flat.Element():
                base = self(e.base)
                if isinstance(base, Pose):  # R[k]: the quaternion
                    base = self.name(f"{self._variable(e.base)} quaternion")
                return base[e.indices if len(e.indices) > 1 else e.indices[0]]
            case flat.Derivative():
                x = self(e.operand)
                if isinstance(x, Pose):
                    x, orders = self.name(f"{self._variable(e.operand)} rate"), e.order - 1
                else:
                    orders = e.order
                for _ in range(orders):
                    x = der(x)
                return x
            case flat.Previous():
                return (self.previous or self)(e.operand)
            case flat.Array():
                return stack([self(x) for x in e.elements])
            case flat.Select():
                return self(e.then if self(e.condition) else e.otherwise)
            case flat.Query():
                return self.question(e)
            case flat.Quadrature() | flat.FieldDerivative() if self.many:
                raise Uneven
            case flat.Quadrature() if self.local:
                return self.quadrature(e)
            case flat.Quadrature():
                name = f"integral {id(e)}"
                if name not in self.memo:
                    self.memo[name] = self.quadrature(e)
                return self.memo[name]
            case flat.Unknown():
                return self.name(e.name)
            case flat.FieldDerivative():
                return self.field_derivative(e)
            case flat.Where():
                outer = self.local
                self.local = dict(outer)
                try:
                    for name, value in zip(e.names, e.values, strict=True):
                        self.local[name] = self(value)
                    return self(e.body)
                finally:
                    self.local = outer

    def _variable(self, e: flat.Expression) -> str:
        """The variable that a name stands for, through names of names."""
        name = _name(e)
        while name in self.definitions and isinstance(value := self.definitions[name].value, flat.Name):
            name = value.name
        return name

    def name(self, name: str) -> Value:
        if name in self.local:
            return self.local[name]
        if not self.numbers_only or (
            self.local and name in self.definitions and name not in self.names and name not in self.lazy
        ):
            return self.known(name)
        with self.only_numbers(False):
            return now(self.known(name))

    def known(self, name: str) -> Value:
        """What a name stands for that no integral and no sum binds."""
        if name in self.names:
            return self.names[name]
        if name in self.lazy:
            if name not in self.memo:
                self.memo[name] = self.lazy[name]()
            return self.memo[name]
        if name == "world":
            return poses.identity(self.space)
        if self.local and name in self.definitions:
            value = self.definitions[name].value  # no memory of what depends on a bound variable
            return self.frame(name) if value is None else self(value)
        if name not in self.memo:
            value = self.definitions[name].value
            self.memo[name] = self.frame(name) if value is None else self(value)
        return self.memo[name]

    def quadrature(self, e: flat.Quadrature) -> Value:
        """``integral(e for s in a:b)``, with every kink and jump of e at the end of a piece."""

        def body(s: Any) -> tuple[Value, dict[Any, tuple[Any, Any]]]:
            outer = self.local, self.frozen, self.seen, self.fixed
            self.local, self.frozen, self.seen = {**self.local, e.variable: s}, Fresh(), {}
            self.fixed = fixed
            try:
                return self(e.body), dict(self.seen)
            finally:
                self.local, self.frozen, self.seen, self.fixed = outer

        lower, upper = self(e.lower), self(e.upper)
        fixed: dict[tuple[int, bool], Value] = {} if self.fixed is None else self.fixed

        def plain(s: Any) -> tuple[Value, dict[Any, tuple[Any, Any]]]:
            try:
                with self.only_numbers():
                    return body(real(s))
            except ArithmeticError:  # where a series says that something is not a number
                return body(s)

        def together(start: Any, width: Any, shares: Any, numbers: bool) -> tuple[Any, Any]:
            """The body at many places at once."""
            if self.due:
                raise Uneven
            steps = 1
            if numbers:
                start, width = real(start), real(width)
            else:
                steps = max(map(steps_of, (start, width, body(start + width * 0.5)[0])))
            outer = self.local, self.frozen, self.seen, self.fixed, self.many
            many = steps, len(shares)
            along = places(shares, steps, 1 if numbers else 3)
            at = spread(start, many) + spread(width, many) * along
            self.local, self.frozen, self.seen = {**self.local, e.variable: at}, Fresh(), {}
            self.fixed, self.many = fixed, many
            try:
                with self.only_numbers(numbers):
                    found = self(e.body)
            finally:
                self.local, self.frozen, self.seen, self.fixed, self.many = outer
            if not isinstance(found, Series):
                found = Series(np.full((3, 1), float(found), complex) * np.eye(3, 1))
            parts = []
            for x in (found.v, found.e):
                parts.append(None if x is None else by_place(x, many))
            return parts[0], parts[1]

        return definite_integral(body, plain, together, lower, upper)

    def field_derivative(self, e: flat.FieldDerivative) -> Value:
        """``grad``, ``div``, ``curl``, ``laplacian`` by differences; what is compared is decided at the place itself."""
        place = self(e.place)

        def field(at: Value, frozen: dict[Any, Any] | None) -> Value:
            outer = self.local, self.frozen, self.seen, self.fixed
            self.local, self.frozen, self.fixed = {**self.local, e.variable: at}, frozen, None
            try:
                return self(e.body)
            finally:
                self.local, self.fixed = outer[0], outer[3]
                if frozen is not outer[1]:
                    self.frozen, self.seen = outer[1], outer[2]

        here = field(place, self.frozen)

        def combined(index: int | None, distances: list[float], weights: list[float], even: bool) -> Value:
            try:
                return self.beside(e, place, here, index, distances, weights, even)
            except ONE_BY_ONE:
                sides = [[field(moved(place, index, s * d), Fresh()) for d in distances] for s in (1, -1)]
                pairs = [(a - here) + (b - here) if even else a - b for a, b in zip(*sides, strict=True)]
                terms = [pair * w for pair, w in zip(pairs, weights, strict=True)]
                return sum(terms[1:], terms[0])

        return differences(e.operator, combined, place)

    def beside(
        self,
        e: flat.FieldDerivative,
        place: Value,
        here: Value,
        index: int | None,
        distances: list[float],
        weights: list[float],
        even: bool,
    ) -> Value:
        """A sum of values of a field on both sides of a place, all at once."""
        if self.due:
            raise Uneven
        n, outer = len(distances), (self.local, self.frozen, self.seen, self.fixed, self.many)
        steps = max(map(steps_of, [*items(place), *items(here)]))
        many = steps, 2 * n
        at = moved(
            everywhere(place, many), index, places(np.array([*distances, *(-d for d in distances)]), steps)
        )
        self.local = {k: everywhere(x, many) for k, x in outer[0].items()} | {e.variable: at}
        self.frozen, self.seen, self.fixed, self.many = Fresh(), {}, {}, many
        try:
            found = self(e.body)
        finally:
            self.local, self.frozen, self.seen, self.fixed, self.many = outer

        def added(x: Any, centre: Any) -> Any:
            if not isinstance(x, Series):
                return 0.0
            parts = []
            for y, c in ((x.v, known(centre)), (x.e, centre.e if isinstance(centre, Series) else None)):
                if y is not None:
                    y = by_place(y, many)
                    if even and c is not None:
                        y = y - c[: len(y), ..., None]
                    y = y[..., :n] + (y[..., n:] if even else -y[..., n:])
                    y = y @ np.array(weights)
                parts.append(y)
            return Series(*parts)

        out = np.empty(np.shape(found), object)
        for i in np.ndindex(*np.shape(found)):
            out[i] = added(found[i], here[i]) if i else added(found, here)
        return out if np.shape(found) else out[()]

    def apply(self, e: flat.Apply) -> Value:
        f, key = e.function, id(e)
        match f:
            case "and":
                return all(bool(self(x)) for x in e.arguments)
            case "or":
                return any(bool(self(x)) for x in e.arguments)
            case "sample" | "initial":
                if self.event is None:
                    raise NotCovered(f"{f}() outside of an event")
                return self.event(e)
        x = [self(a) for a in e.arguments]
        if self.many and f in _BY_ONE_NUMBER and any(steps_of(y) > 1 for y in x):
            raise Uneven
        if f in FUNCTIONS:
            return apply(f, x[0])
        if f in RELATIONS:
            holds, sign = RELATIONS[f]
            one, other = real(x[0]), real(x[1])
            alike = (
                one == other and e.arguments[0] != e.arguments[1] and any(isinstance(a, Series) for a in x)
            )
            if alike or 0 < abs(one - other) <= ROUNDED * abs(one):
                EDGES.add(key)
                BENDS.add(key)
            return self.decide(key, (x[0] - x[1]) * sign, holds(one, other))
        match f:
            case "not":
                return not x[0]
            case "equal":
                return bool(real(x[0]) == real(x[1]))
            case "not_equal":
                return bool(real(x[0]) != real(x[1]))
            case "add":
                return x[0] + x[1]
            case "subtract":
                return x[0] - x[1]
            case "negate":
                return -x[0]
            case "multiply":
                return multiply(x[0], x[1])
            case "divide":
                return x[0] / x[1]
            case "power":
                return power(x[0], x[1])
            case "atan2":
                return angle_of(x[0], x[1])
            case "abs":
                return x[0] if self.bend(key, x[0], real(x[0]) >= 0) else -x[0]
            case "sign":
                if real(x[0]) == 0:
                    EDGES.add(key)
                if real(x[0]) == 0 and (self.frozen is None or key not in self.frozen):
                    return 0.0
                return 1.0 if self.decide(key, x[0], real(x[0]) > 0) else -1.0
            case "floor":
                return self.whole_below(key, x[0])
            case "ceil":
                return -self.whole_below(key, -x[0])
            case "mod":
                return x[0] - x[1] * self.whole_below(key, x[0] / x[1])
            case "div":
                return float(math.trunc(real(x[0]) / real(x[1])))
            case "clamp":
                if self.bend((key, "low"), x[1] - x[0], real(x[0]) < real(x[1])):
                    return x[1]
                return x[2] if self.bend((key, "high"), x[0] - x[2], real(x[0]) > real(x[2])) else x[0]
            case "deadzone":
                if self.bend((key, "high"), x[0] - x[1], real(x[0]) > real(x[1])):
                    return x[0] - x[1]
                return (
                    x[0] + x[1]
                    if self.bend((key, "low"), -x[0] - x[1], real(x[0]) < -real(x[1]))
                    else 0.0 * x[0]
                )
            case "min" | "max":
                return self.extreme(key, x, 1 if f == "max" else -1)
            case "sum":
                return reduce(lambda a, b: a + b, list(x[0]), 0.0)
            case "product":
                return reduce(lambda a, b: a * b, list(x[0]), 1.0)
            case "dot":
                return sum(a * b for a, b in zip(x[0], x[1], strict=True))
            case "cross":
                return poses.cross(x[0], x[1])
            case "norm":
                return poses.norm(x[0])
            case "transpose":
                return x[0].T
            case "outer":
                return poses.matrix([[a * b for b in x[1]] for a in x[0]])
            case "identity":
                return np.eye(int(real(x[0]))).astype(object)
            case "diag":
                return poses.matrix(
                    [[a if i == j else 0.0 for j in range(len(x[0]))] for i, a in enumerate(x[0])]
                )
            case "det":
                return matrices.determinant(x[0])
            case "inverse":
                return matrices.solved(x[0], np.eye(len(x[0])).astype(object))
            case "eigenvalues":
                return np.linalg.eigvalsh(np.vectorize(real)(x[0]).astype(float)).astype(object)
            case "solve":
                return matrices.solved(x[0], x[1])
            case "linspace":
                n = int(real(x[2]))
                return vector(*(x[0] + (x[1] - x[0]) * (i / (n - 1)) for i in range(n)))
            case "table":
                return self.curve(key, *x)
            case "mesh_volume" | "mesh_centre" | "mesh_inertia":
                return solid(f, x[0], x[1])
            case "trans":
                return poses.displacement(x[0])
            case "rot":
                return poses.planar(x[0])
            case "rotx" | "roty" | "rotz":
                return poses.about(np.eye(3)["xyz".index(f[-1])], x[0])
            case "axis_angle":
                return poses.about(x[0], x[1])
            case "quat":
                return poses.quaternion(vector(*x))
            case "pos":
                return position(x[0])
            case "vel":
                if len(x) == 1:
                    return rate_of(position(x[0]))
                return rate_of(x[1].R.T @ (position(x[0]) - x[1].p))
            case "vel_at":
                w = self.angular_velocity(x[0])
                d = position(x[1]) - x[0].p
                turning = vector(-w * d[1], w * d[0]) if len(d) == 2 else poses.cross(w, d)
                return rate_of(x[0].p) + turning
            case "angvel":
                w = self.angular_velocity(x[0])
                return w if len(x) == 1 or self.space == 2 else x[1].R.T @ w
            case "heading":
                return poses.heading(x[0])
            case "local":
                return x[0].R.T @ (position(x[1]) - x[0].p)
            case "components":
                return x[0].R.T @ np.asarray(x[1], object)
            case "direction":
                return x[0].R @ np.asarray(x[1], object)
        raise NotCovered(f"the function {f}")

    def angular_velocity(self, frame: Pose) -> Value:
        """In world components; a number in the plane."""
        return der(frame.angle) if frame.angle is not None else poses.spin(frame.R, der(frame.R))

    def curve(self, key: Any, x: Any, xs: Value, ys: Value) -> Any:
        """``table``: a smooth curve that does not overshoot its points (PCHIP), going on straight outside of them."""
        piece = _pieces(tuple(map(real, xs)), tuple(map(real, ys)))
        knots = piece.x
        at = x.v[0].real if isinstance(x, Series) else np.array([real(x)])
        index = np.searchsorted(knots, at, side="right")
        index = np.where(at == knots[-1], len(knots) - 1, index)
        if np.any(index != index[0]):
            raise Uneven
        i = int(index[0]) - 1
        if isinstance(
            self.frozen, Fresh
        ):  # an integral has a piece up to each point: the third derivative jumps there
            self.seen[key] = 0.0, i
        if not 0 <= i < len(knots) - 1:
            end = knots[0] if i < 0 else knots[-1]
            return float(piece(end)) + (x - end) * float(piece(end, 1))
        h = x - knots[i]
        c = piece.c[:, i]
        return ((c[0] * h + c[1]) * h + c[2]) * h + c[3]

    def extreme(self, key: Any, x: list[Value], sign: int) -> Value:
        items = list(np.ravel(x[0])) if len(x) == 1 else x
        best = items[0]
        for i, item in enumerate(items[1:]):
            gain = (item - best) * sign
            if self.bend((key, i), gain, real(gain) > 0):
                best = item
        return best


def now(x: Value) -> Value:
    """The numbers of a value; positions and orientations stay as they are."""
    return x if isinstance(x, Pose) else each(lambda s: s.real if isinstance(s, Series) else s, x)


def items(x: Value) -> list[Any]:
    return list(np.ravel(x)) if isinstance(x, np.ndarray) else [x]


def by_place(x: Any, many: tuple[int, int]) -> Any:
    """Numbers at many places with an axis of their own for these."""
    if not np.isfinite(x).all():
        raise Uneven
    return np.broadcast_to(x, (*x.shape[:-1], many[0] * many[1])).reshape(*x.shape[:-1], *many)


def everywhere(x: Value, many: tuple[int, int]) -> Value:
    """What is the same at all places, as numbers for each."""
    if isinstance(x, Pose):
        angle = None if x.angle is None else spread(x.angle, many)
        return Pose(everywhere(x.R, many), everywhere(x.p, many), angle)
    return each(lambda y: spread(y, many), x)


def moves(x: Any) -> bool:
    """Whether displacements change a number at first order, those too that only ask for forces."""
    return isinstance(x, Series) and x.e is not None and bool(np.any(x.e[0]))


class Fresh(dict[Any, Any]):
    """Decisions that are recorded, but not kept."""

    def setdefault(self, key: Any, default: Any = None) -> Any:
        return default


def _name(e: flat.Expression) -> str:
    if not isinstance(e, flat.Name):
        raise NotCovered("the rate of a composed rotation")
    return e.name


def stack(items: list[Value]) -> Value:
    if isinstance(items[0], np.ndarray):
        out = np.empty((len(items), *items[0].shape), object)
        for i, item in enumerate(items):
            out[i] = item
        return out
    return vector(*items)


def position(x: Value) -> Value:
    return x.p if isinstance(x, Pose) else x


def multiply(a: Value, b: Value) -> Value:
    if isinstance(a, Pose):
        return a @ b if isinstance(b, Pose) else a.R @ np.asarray(b, object) + a.p
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a @ b
    return a * b


@cache
def _pieces(xs: tuple[float, ...], ys: tuple[float, ...]) -> Any:
    return PchipInterpolator(np.array(xs), np.array(ys))
