"""Initial values and states on the constraints (language, section 11)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.compiler.flat import model as flat
from oracle import poses
from oracle.expressions import Value, der
from oracle.point import Point, Unknowns, at_order, now
from oracle.poses import Pose
from oracle.series import STEP, real
from oracle.values import NotCovered, Undetermined

if TYPE_CHECKING:
    from oracle.meaning import Meaning

Array = Any
State = dict[str, Any]
Rows = Callable[[Point], list[Any]]


# ---------------------------------------------------------------- moving a state


def shift(meaning: Meaning, state: Mapping[str, Any], d: Array, freedoms: list[int], rates: bool) -> State:
    """A state moved along its freedoms; a rotation turns in the body."""
    out, change = dict(state), dict(zip(freedoms, d, strict=True))
    for _, shape, elements, names, first in meaning.coordinate_layout:
        if rates or shape is not None:
            for i, x in enumerate(names if rates else elements):
                if first + i in change:
                    out[x] = out[x] + change[first + i]
        elif any(first + k in change for k in range(3)):
            half = [change.get(first + k, 0.0) / 2 for k in range(3)]
            turned = poses.times(poses.vector(*(out[x] for x in elements)), poses.vector(1.0, *half))
            length = np.sqrt(sum(x * x for x in turned))
            out.update({x: y / length for x, y in zip(elements, turned, strict=True)})
    return out


def settle(
    meaning: Meaning,
    state: State,
    rows: Rows,
    freedoms: list[int],
    rates: bool,
    sizes: Array | None = None,
    begin: State | None = None,
    frozen: dict[Any, Any] | None = None,
) -> State:
    """Newton's method with the least change of the freedoms given; with ``sizes`` the nearest state, as shares of them.

    ``begin``: from where the nearest state is looked for, in the place of the state itself; ``frozen``: branches that hold.
    """
    best, guess, moved, share = np.inf, state, np.inf, 1.0
    if sizes is not None:
        state = settle(meaning, begin or state, rows, freedoms, rates)
    for _ in range(60 if sizes is None else 300):
        n = len(freedoms)
        batch = shift(meaning, state, 1j * STEP * np.eye(n), freedoms, rates) if n else state
        values = np.array(
            [
                np.broadcast_to(np.asarray(now(r), complex), max(n, 1))
                for r in rows(meaning.point(batch, frozen=frozen))
            ]
        )
        if not len(values):
            return state
        if not np.isfinite(values).all():
            raise Undetermined("constraints have no value on the way to a state on them")
        r, J = values[:, 0].real, (values.imag / STEP)[:, :n]
        scale = 1 + np.abs(J).max(axis=1, initial=0)
        error = float((np.abs(r) / scale).max())
        done = error <= 1e-15 or (error <= 1e-11 and error >= best / 2)
        if done and (sizes is None or not n or moved <= 1e-11):
            return state
        best = min(best, error)
        if not n:
            d = np.zeros(0)
        elif sizes is None:
            d = -np.linalg.lstsq(J / scale[:, None], r / scale, rcond=1e-9)[0]
        else:  # the least |(off + d)/sizes| with J d = -r, by shorter steps along the constraints where that swings
            off = deviation(meaning, state, guess, freedoms, rates) / sizes
            A = J / scale[:, None] * sizes
            along = np.linalg.lstsq(A, A @ off, rcond=1e-9)[0] - off
            share /= 1 if np.abs(along).max() < moved else 2
            moved = float(np.abs(along).max())
            d = sizes * (share * along - np.linalg.lstsq(A, r / scale, rcond=1e-9)[0])
        size = np.abs(d).max(initial=0)
        state = shift(meaning, state, d / max(1.0, size), freedoms, rates)
        state = {k: float(np.real(v)) for k, v in state.items()}
    if best <= 1e-9:
        return state
    raise Undetermined(f"no state on the constraints: off by {best:.1e}")


def deviation(meaning: Meaning, state: State, guess: State, freedoms: list[int], rates: bool) -> Array:
    """How far a state is from a guess along its freedoms: the turn in the body, where it is a rotation."""
    out: dict[int, float] = {}
    for _, shape, elements, names, first in meaning.coordinate_layout:
        if rates or shape is not None:
            for i, x in enumerate(names if rates else elements):
                out[first + i] = state[x] - guess[x]
            continue
        back = poses.vector(*(s * guess[x] for s, x in zip((1, -1, -1, -1), elements, strict=True)))
        turn = poses.times(back, poses.vector(*(state[x] for x in elements)))
        turn = turn * (1 if turn[0] >= 0 else -1)
        size = float(np.sqrt(sum(x * x for x in turn[1:])))
        share = 2 * np.arctan2(size, float(turn[0])) / size if size > 1e-300 else 2.0
        out.update({first + k: float(turn[1 + k]) * share for k in range(3)})
    return np.array([out[i] for i in freedoms])


def sizes_of(meaning: Meaning, freedoms: list[int]) -> Array:
    """What a change of each freedom is a share of (section 11)."""
    used = _used(meaning.flat)
    lengths = [
        abs(float(meaning.parameters[x]))
        for v in meaning.flat.variables
        if v.name in used and str(v.type.dimension) == "m" and v.type.kind is flat.Kind.REAL
        for x in meaning.parameters
        if x == v.name or x.startswith(f"{v.name}[")
    ]
    lengths = [x for x in lengths if x]
    mean = float(np.exp(np.mean(np.log(lengths)))) if lengths else 1.0
    out = {}
    for name, _, _elements, rates, first in meaning.coordinate_layout:
        v = meaning.variables[name]
        size = 1.0 if v.type.kind is flat.Kind.ROTATION or str(v.type.dimension) != "m" else mean
        size = size if v.attributes.nominal is None else abs(float(v.attributes.nominal))
        out.update(dict.fromkeys(range(first, first + len(rates)), size))
    return np.array([out[i] for i in freedoms])


def _used(model: flat.FlatModel) -> set[str]:
    """The parameters that something uses: pictures and closed solutions do not count, parameters only where they are used."""
    owners = {v.name: v for v in model.variables if v.role is flat.Role.PARAMETER}
    found: set[str] = set()
    pending: list[Any] = [v for v in model.variables if v.name not in owners]
    pending += [
        getattr(model, x) for x in model.__struct_fields__ if x not in ("variables", "draws", "exacts")
    ]
    seen: set[int] = set()
    while pending:
        part = pending.pop()
        if isinstance(part, flat.Name) and part.name in owners and part.name not in found:
            found.add(part.name)
            pending.append(owners[part.name].value)
        if isinstance(part, (tuple, list)):
            pending += part
        elif isinstance(part, Mapping):
            pending += part.values()
        elif hasattr(part, "__struct_fields__") and id(part) not in seen:
            seen.add(id(part))
            pending += [getattr(part, x) for x in part.__struct_fields__]
    return found


def position_rows(point: Point) -> list[Any]:
    return [value for _, kind, value in point.rows() if kind == "position"]


def rate_rows(point: Point) -> list[Any]:
    return [der(value) if kind == "position" else value for _, kind, value in point.rows()]


def free(meaning: Meaning, fixed: Iterable[str]) -> list[int]:
    """The freedoms of which no element, or no rate, is fixed."""
    names, out = set(fixed), []
    for _, shape, elements, rates, first in meaning.coordinate_layout:
        whole = shape is None and any(x in names for x in elements)
        for i in range(len(rates)):
            if not whole and (rates[i] not in names) and (shape is None or elements[i] not in names):
                out.append(first + i)
    return out


def undriven(meaning: Meaning, rates: bool) -> list[int]:
    return free(
        meaning, [x for x in meaning.all_rates if x not in meaning.rates] if rates else meaning.driven
    )


def project(
    meaning: Meaning, state: State, rows: Rows | None = None, frozen: dict[Any, Any] | None = None
) -> State:
    extra = rows or (lambda point: [])
    both = lambda p: position_rows(p) + extra(p)  # noqa: E731
    state = settle(meaning, state, both, undriven(meaning, False), False, frozen=frozen)
    more = lambda p: rate_rows(p) + [der(r) for r in extra(p)]  # noqa: E731
    return settle(meaning, state, more, undriven(meaning, True), True, frozen=frozen)


def residuals(meaning: Meaning, state: State) -> tuple[Array, Array]:
    point = meaning.point(state)
    return np.array([real(r) for r in position_rows(point)]), np.array([real(r) for r in rate_rows(point)])


# ---------------------------------------------------------------- initial values


class Given:
    """The initial values of a model, by element: the outermost holds, and `=` is known, `~` is guessed."""

    def __init__(self, meaning: Meaning, time: float) -> None:
        self.meaning = meaning
        self.bare = meaning.point({"time": time}, bare=True)

    def of(self, v: flat.Variable, rate: bool) -> dict[tuple[int, ...], tuple[Any, bool]]:
        """``(value, guess)`` by index; the value is a number, or an expression of coordinates; () is the whole."""
        m = self.meaning
        whole, parts = (v.rate, dict(v.rates)) if rate else (v.start, dict(v.starts))
        out: dict[tuple[int, ...], tuple[Any, bool]] = {}
        layers: list[tuple[tuple[int, ...], flat.Expression, bool]] = []
        if whole is not None:
            layers.append(((), whole.value, whole.guess))
        layers += [(i, s.value, s.guess) for i, s in parts.items()]
        layers += sorted(
            ((s.indices, s.value, s.guess) for s in m.settings if s.target == v.name and s.rate == rate),
            key=lambda layer: len(layer[0]),
        )
        rotation = v.type.kind is flat.Kind.ROTATION
        shape: tuple[int, ...] = (() if not rate else (3,)) if rotation else v.type.shape
        for indices, e, guess in layers:
            value = self.value(e)
            if isinstance(value, Pose):
                out[()] = value, guess
            elif isinstance(value, flat.Typed):
                for index in np.ndindex(*shape):
                    if index[: len(indices)] == indices:
                        element = (
                            value
                            if index == indices
                            else flat.Element(
                                span=value.span,
                                type=flat.Type(flat.Kind.REAL),
                                base=value,  # type: ignore[arg-type]
                                indices=index[len(indices) :],
                            )
                        )
                        out[index] = element, guess
            else:
                for index in np.ndindex(*shape):
                    if index[: len(indices)] == indices:
                        part = value
                        if isinstance(value, np.ndarray):
                            part = value[index[len(indices) :]]
                        out[index] = real(part), guess
        return out

    def value(self, e: flat.Expression) -> Any:
        try:
            return self.bare.at(e)
        except KeyError:
            return e


def assemble(meaning: Meaning, time: float, beside: State | None = None) -> State:
    """Known values stay, guesses move as little as they can, until all constraints and conditions hold.

    Of several states that are nearer than all around them it is the one that Newton's steps lead to, from the guesses
    or from the places of ``beside``.
    """
    m, given = meaning, Given(meaning, time)
    state: State = {"time": time}
    conditions: dict[bool, list[tuple[Any, Any]]] = {False: [], True: []}
    fixed: dict[bool, set[str]] = {False: set(), True: set()}

    def put(name: str, value: Any, guess: bool, rate: bool, target: Callable[[Point], Any]) -> None:
        if name in m.values:
            value, guess = float(m.values[name]), False
        if isinstance(value, flat.Typed):
            state[name] = 0.0
            if guess:
                raise NotCovered("a guess that depends on coordinates")
            conditions[rate].append((target, value))
            return
        state[name] = value
        if not guess:
            fixed[rate].add(name)

    for name, shape, elements, rates, first in m.coordinate_layout:
        v = m.variables[name]
        places, speeds = given.of(v, False), given.of(v, True)
        if shape is None:
            pose, guess = places.get((), (poses.identity(3), True))
            values = poses.quaternion_of(pose)
            for k, x in enumerate(elements):
                put(x, float(values[k]), guess, False, lambda p: 0.0)
        indices = [(k,) for k in range(3)] if shape is None else list(np.ndindex(*shape))
        for i, index in enumerate(indices):
            if shape is not None:
                value, guess = places.get(index, (0.0, True))
                put(elements[i], value, guess, False, lambda p, n=name, j=index: _part(p.at.name(n), j))  # type: ignore[misc]
            value, guess = speeds.get(index, (0.0, True))
            put(rates[i], value, guess, True, lambda p, n=first + i: p.state[m.all_rates[n]])  # type: ignore[misc]
    following: dict[str, flat.Expression] = {}
    for name, shape, elements in m.state_layout:
        for x, (value, _) in zip(elements, _whole(given.of(m.variables[name], False), shape), strict=True):
            value = m.values.get(x, value)
            if isinstance(value, flat.Typed):
                following[x] = value  # type: ignore[assignment]
            state[x] = 0.0 if x in following else float(value)
    for name, shape, elements, _ in m.discrete_layout:
        setting = next(
            (s.value for s in m.settings if s.target == name and not s.indices), m.variables[name].value
        )
        whole = np.broadcast_to(np.asarray(0.0 if setting is None else given.bare.at(setting), object), shape)
        for x, value in zip(elements, np.ravel(whole), strict=True):
            state[x] = float(m.values.get(x, real(value)))
    for x in m.driven:
        state.pop(x, None)
    for x in m.all_rates:
        if x not in m.rates:
            state.pop(x, None)
    state = m.fill(state)
    for name in m.computed:
        v = m.variables[name]
        for rate in (False, True):
            for index, (value, guess) in given.of(v, rate).items():
                if not guess:
                    conditions[rate].append((lambda p, n=name, j=index, r=rate: _seen(p, n, j, r), value))
    for c in m.flat.initials:
        if c.start.guess:
            raise NotCovered("a guess of an expression")
        rate = _depends_on_rates(m, state, c.target)
        if _depends_on_accelerations(m, state, c):
            conditions[rate].append((lambda p, i=c: _of_forces(p, i), 0.0))
        else:
            conditions[rate].append((lambda p, e=c.target: p.at(e), c.start.value))
    for moving, rows in ((False, position_rows), (True, rate_rows)):
        loose = _loose(m, fixed[moving], moving)
        wanted = lambda p, f=rows, r=moving: f(p) + _off(p, conditions[r])  # noqa: E731
        sizes = sizes_of(m, loose)
        begin = state if beside is None or moving else _at(m, state, beside)
        state = settle(m, state, wanted, loose, moving, sizes, begin)
    if following:
        point = m.point(state)
        state |= {x: real(point.at(e)) for x, e in following.items()}
        error = max((np.abs(r).max(initial=0) for r in residuals(m, state)), default=0.0)
        if error > 1e-9:
            raise NotCovered("a constraint of a state whose start follows coordinates")
    return state


def _at(meaning: Meaning, state: State, beside: State) -> State:
    return state | {x: beside[x] for c in meaning.coordinate_layout for x in c[2] if x in beside}


def _loose(meaning: Meaning, fixed: set[str], rates: bool) -> list[int]:
    allowed = set(undriven(meaning, rates))
    return [i for i in free(meaning, fixed) if i in allowed]


def _part(value: Value, index: tuple[int, ...]) -> Any:
    return value[index] if index else value


def _seen(point: Point, name: str, index: tuple[int, ...], rate: bool) -> Any:
    value = point.at.name(name)
    return _part(der(value) if rate else value, index)


def _off(point: Point, conditions: list[tuple[Any, Any]]) -> list[Any]:
    out: list[Any] = []
    for target, value in conditions:
        wanted = point.at(value) if isinstance(value, flat.Typed) else value  # type: ignore[arg-type]
        left, right = np.broadcast_arrays(np.asarray(target(point), object), np.asarray(wanted, object))
        if isinstance(target(point), np.ndarray) and target(point).dtype != object:  # a batch of one number
            out.append(target(point) - now(wanted))
        else:
            out += [now(a) - now(b) for a, b in zip(np.ravel(left), np.ravel(right), strict=True)]
    return out


def _whole(
    values: Mapping[tuple[int, ...], tuple[Any, bool]], shape: tuple[int, ...]
) -> list[tuple[Any, bool]]:
    return [values.get(index, (0.0, True)) for index in np.ndindex(*shape)]


def _depends_on_rates(meaning: Meaning, state: State, e: flat.Expression) -> bool:
    freedoms = list(range(meaning.size))
    noise = np.random.default_rng(3).uniform(0.1, 1, meaning.size)
    moved = shift(meaning, state, noise, freedoms, True)
    batch = shift(meaning, moved, 1j * STEP * np.eye(meaning.size), freedoms, True)
    values = [np.asarray(now(x)) for x in np.ravel(np.asarray(meaning.point(batch).at(e), object))]
    return any(np.abs(np.imag(x)).max() > 0 for x in values)


def _depends_on_accelerations(meaning: Meaning, state: State, c: flat.InitialCondition) -> bool:
    noise = np.random.default_rng(5).uniform(0.1, 1, (meaning.size, 1)).astype(complex)
    still, moved = meaning.point(state), Point(meaning, state, Unknowns(noise))
    return any(real(still.at(e)) != real(moved.at(e)) for e in (c.target, c.start.value))


def _of_forces(point: Point, c: flat.InitialCondition) -> Array:
    """What a condition that asks for accelerations or forces is off by; its slopes by differences, as these are solved for."""
    m = point.meaning
    steps = np.broadcast_arrays(*(np.asarray(x, complex) for x in point.state.values()))
    states = [
        dict(zip(point.state, column, strict=True)) for column in np.ravel(steps).reshape(len(steps), -1).T
    ]

    def off(state: State) -> float:
        there = m.solution(state).point
        return real(there.at(c.target)) - real(there.at(c.start.value))

    now = {x: float(v.real) for x, v in states[0].items()}
    found = []
    for state in states:
        ahead = {x: v.real + _AHEAD / STEP * v.imag for x, v in state.items()}
        behind = {x: v.real - _AHEAD / STEP * v.imag for x, v in state.items()}
        found.append(off(now) + 1j * STEP * (off(ahead) - off(behind)) / (2 * _AHEAD))
    return np.array(found)


_AHEAD = 1e-5


def random(meaning: Meaning, rng: np.random.Generator, spread: float, moves: bool) -> State:
    """A state near the start, moved at random and put back on the constraints, from which, where it ``moves``, a motion goes on."""
    base = meaning.start()
    for attempt in range(40):
        size = spread * 0.8**attempt
        state = {**base, "time": float(rng.uniform(0, 1)) * spread}
        for x in meaning.driven:
            state.pop(x, None)
        for x in meaning.all_rates:
            if x not in meaning.rates:
                state.pop(x, None)
        state = meaning.fill(state)
        for rates in (False, True):
            names = meaning.all_rates
            freedoms = undriven(meaning, rates)
            unit = [max(abs(base[names[i]]), 1.0) for i in freedoms] if rates else [1.0] * len(freedoms)
            state = shift(meaning, state, size * rng.normal(size=len(freedoms)) * unit, freedoms, rates)
        for x in meaning.states:
            state[x] += size * float(rng.normal()) * max(abs(state[x]), 1.0)
        try:
            state = project(meaning, {k: float(v) for k, v in state.items()})
            point = meaning.point(state)
            if all(real(point.at(c.gap)) > 0 for c in meaning.flat.contacts):
                if moves:
                    meaning.outputs(state)
                return state
        except (Undetermined, ValueError, ZeroDivisionError):
            continue
    raise Undetermined("no random state near the start")


__all__ = ["assemble", "at_order", "project", "random", "residuals"]
