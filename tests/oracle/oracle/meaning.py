"""The meaning of one flat model (README.md lists the methods)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from mechc.compiler.flat import model as flat
from oracle import questions, start
from oracle.expressions import Evaluator, Value, der
from oracle.motion import Motion, move
from oracle.placement import sides, span
from oracle.point import Point, Unknowns, now
from oracle.poses import Pose, quaternion_of, vector
from oracle.series import real
from oracle.solving import Solution, solve
from oracle.values import NotCovered

State = dict[str, float]


def element_names(name: str, shape: tuple[int, ...]) -> list[str]:
    """``x[1]``, ``x[1,2]``, or the name itself."""
    if not shape:
        return [name]
    return [f"{name}[{','.join(str(i + 1) for i in index)}]" for index in np.ndindex(*shape)]


def rate_names(name: str, shape: tuple[int, ...], rotation: bool) -> list[str]:
    if rotation:
        return [f"der({name})[{k}]" for k in (1, 2, 3)]
    return [f"der({x})" for x in element_names(name, shape)]


class Meaning:
    """What one model does."""

    def __init__(
        self,
        model: flat.FlatModel,
        values: Mapping[str, float] | None = None,
        experiment: str | None = None,
        inputs: Mapping[str, Callable[[float], float]] | None = None,
    ) -> None:
        self.flat = model
        self.values = dict(values or {})
        self.settings = self._settings(experiment)
        self.given_inputs: dict[str, Any] = dict(inputs or {})
        self.definitions = {d.name: d for d in model.definitions}
        self.variables = {v.name: v for v in model.variables}
        self.tree = span(model.joints, self.definitions)
        self.sides = {j.name: sides(j, self.definitions) for j in model.joints}
        self.computed: dict[str, tuple[flat.Joint, flat.Expression]] = {}
        self.closures: dict[str, list[flat.ClosureEquation]] = {}
        for joint in self.tree.loops:
            self.closures[joint.name] = []
            for c in joint.closures:
                if isinstance(c.left, flat.Name) and c.left.name in joint.coordinates:
                    self.computed[c.left.name] = joint, c.right
                else:
                    self.closures[joint.name].append(c)
        self._lay_out({x for j in self.tree.loops for x in j.coordinates})
        self.unasked = np.zeros((self.size, 1), complex)
        self.superfluous: frozenset[str] = frozenset()
        self.open_at_start = self._open_at_start()
        self.solved: tuple[Any, Solution] | None = None  # of the last state
        self._parameters()
        self.drive_names = [self.drive_name(d)[0] for d in model.drives]
        self.kinds: dict[tuple[str, int], str] = {}
        self.rates_by_text: dict[int, bool] = {}
        self.force_names: dict[Any, list[str]] = {}
        self.starts: dict[float, State] = {}
        self.braking: dict[tuple[str, int], bool] = {}
        self.plain = True
        self.affine: bool | None = None  # whether laws that ask for forces have been affine along a motion
        self.law_questions = self._law_questions()
        self.felt = self._felt()
        self._kinds()

    # ------------------------------------------------------------ declarations

    def _open_at_start(self) -> frozenset[str]:
        """Constraints and joints that ``when initial() then release`` leaves open (events, section 4)."""
        branches = (event.branches[0] for event in self.flat.events)
        first = [
            b for b in branches if isinstance(b.condition, flat.Apply) and b.condition.function == "initial"
        ]
        released = {a.target for b in first for a in b.actions if isinstance(a, flat.Switch) and not a.engage}
        return frozenset(released - {c.name for c in self.flat.contacts})

    def holds(self, state: Mapping[str, float], name: str) -> bool:
        """Whether what can be released holds: unless a state says so, as at the start."""
        return state.get(f"held({name})", float(name not in self.open_at_start)) != 0

    def _settings(self, experiment: str | None) -> tuple[flat.Setting, ...]:
        if experiment is None:
            return ()
        for e in self.flat.experiments:
            if e.name == experiment:
                return e.settings
        raise KeyError(f"no experiment {experiment!r}")

    def _lay_out(self, loops: set[str]) -> None:
        """The order of all freedoms and other variables, by the names of their elements."""
        self.coordinate_layout: list[tuple[str, tuple[int, ...] | None, list[str], list[str], int]] = []
        self.state_layout: list[tuple[str, tuple[int, ...], list[str]]] = []
        self.discrete_layout: list[tuple[str, tuple[int, ...], list[str], flat.Kind]] = []
        self.input_layout: list[tuple[str, tuple[int, ...], list[str]]] = []
        self.size = 0
        for v in self.flat.variables:
            elements = element_names(v.name, v.type.shape)
            if v.role is flat.Role.COORDINATE and v.name not in loops:
                rotation = v.type.kind is flat.Kind.ROTATION
                if rotation:
                    elements = element_names(v.name, (4,))
                rates = rate_names(v.name, v.type.shape, rotation)
                shape = None if rotation else v.type.shape
                self.coordinate_layout.append((v.name, shape, elements, rates, self.size))
                self.size += len(rates)
            elif v.role is flat.Role.STATE:
                self.state_layout.append((v.name, v.type.shape, elements))
            elif v.role is flat.Role.DISCRETE:
                self.discrete_layout.append((v.name, v.type.shape, elements, v.type.kind))
            elif v.role is flat.Role.INPUT:
                self.input_layout.append((v.name, v.type.shape, elements))
        self.all_coordinates = [x for c in self.coordinate_layout for x in c[2]]
        self.all_rates = [x for c in self.coordinate_layout for x in c[3]]

    def _parameters(self) -> None:
        """Parameters and defaults of inputs: the caller's value, the experiment's, the model's."""
        raised = self._raise
        at = Evaluator({}, self.definitions, self.flat.space or 2, raised, raised)
        for v in self.flat.variables:
            if v.role is flat.Role.PARAMETER:
                at.lazy[v.name] = lambda v=v: self._parameter(at, v)  # type: ignore[misc]
        self.parameter_values = {n: at.name(n) for n in at.lazy}
        self.parameters = {
            x: y if isinstance(y, str) else real(y)
            for n, value in self.parameter_values.items()
            for x, y in zip(
                element_names(n, np.shape(value)), np.ravel(np.asarray(value, object)), strict=True
            )
        }
        for v in self.flat.variables:
            if v.role is flat.Role.INPUT:
                value = next(
                    (s.value for s in self.settings if s.target == v.name and not s.indices), v.value
                )
                if value is not None:
                    self.definitions[v.name] = flat.Definition(
                        name=v.name, role=flat.DefinitionRole.LET, type=v.type, value=value, origin=v.origin
                    )
                for x in element_names(v.name, v.type.shape):
                    if x in self.values:
                        self.given_inputs.setdefault(x, self.values[x])
                    elif value is None:
                        self.given_inputs.setdefault(x, 0.0)

    @staticmethod
    def _raise(what: Any) -> Any:
        raise NotCovered(f"{what} in a parameter")

    def _parameter(self, at: Evaluator, v: flat.Variable) -> Value:
        settings = [s for s in self.settings if s.target == v.name]
        whole = next((s.value for s in settings if not s.indices), v.value)
        names = element_names(v.name, v.type.shape)
        if whole is None and not all(n in self.values for n in names):
            raise KeyError(f"the parameter {v.name} has no value")
        value = np.zeros(v.type.shape).astype(object) if whole is None else at(whole)
        if v.type.shape:
            value = np.array(np.broadcast_to(value, v.type.shape), object)
            for s in settings:
                if s.indices:
                    value[s.indices] = at(s.value)
            for index, n in zip(np.ndindex(*v.type.shape), names, strict=True):
                value[index] = self.values.get(n, value[index])
            return value
        return self.values.get(v.name, value)

    def drive_name(self, d: flat.Drive) -> tuple[str, bool]:
        target, rated = d.target, False
        if isinstance(target, flat.Derivative):
            target, rated = target.operand, True
        if isinstance(target, flat.Name):
            return target.name, rated
        if isinstance(target, flat.Element) and isinstance(target.base, flat.Name):
            return f"{target.base.name}[{','.join(str(i + 1) for i in target.indices)}]", rated
        raise NotCovered("a drive of an expression")

    @staticmethod
    def smooth(options: Mapping[str, flat.Expression]) -> bool:
        law = options.get("law")
        return isinstance(law, flat.Literal) and law.value == "regularized"

    def option(self, options: Mapping[str, flat.Expression], name: str, default: Any) -> Any:
        e = options.get(name)
        if e is None:
            return default
        if isinstance(e, flat.Literal):
            return e.value if isinstance(e.value, bool | str) else float(e.value)
        return real(self.point({}, bare=True).at(e))

    # ------------------------------------------------------------ what laws ask for

    def expressions(self, e: Any) -> Iterable[flat.Expression]:
        """An expression with all that it is made of, through definitions."""
        seen: set[str] = set()
        todo = [e]
        while todo:
            x = todo.pop()
            if isinstance(x, flat.Name) and x.name in self.definitions and x.name not in seen:
                seen.add(x.name)
                todo.append(self.definitions[x.name].value)
            if isinstance(x, flat.Typed):
                yield x  # type: ignore[misc]
                todo += [getattr(x, f) for f in x.__struct_fields__]
            elif isinstance(x, tuple):
                todo += x

    def _law_questions(self) -> list[flat.Query]:
        m, found = self.flat, {}
        stated: list[Any] = [*m.energies, *m.loads, *m.dampings, *m.equations]
        laws = [e.value for e in stated] + [x.at for x in m.loads if x.at is not None]
        laws += [x for f in m.frictions for x in (f.kinetic, f.static)]
        laws += [x for c in m.contacts for x in (c.friction, c.static)]
        rubbing = {f.name for f in m.frictions}
        for law in laws:
            for e in self.expressions(law):
                twice = isinstance(e, flat.Derivative) and (
                    e.order > 1 or isinstance(e.operand, flat.Derivative)
                )
                self.plain = self.plain and not twice and not isinstance(e, flat.Query)
                if (
                    isinstance(e, flat.Query)
                    and e.function in questions.IMPLICIT
                    and e.target not in self.drive_names
                    and (e.function != "power" or e.target in rubbing)
                ):
                    found[questions.key_of(e)] = e
        return list(found.values())

    def _felt(self) -> set[str]:
        """The answers that the state decides from whose derivatives forces come."""
        m = self.flat
        laws: list[Any] = [x for d in m.dampings for x in (d.value, d.on)]
        laws += [x for load in m.loads for x in (load.on, load.source) if x is not None]
        laws += [e.value for e in m.energies if e.kind == "dissipation"]
        asked = [e for law in laws for e in self.expressions(law) if isinstance(e, flat.Query)]
        return {f"{q.function} {q.target}" for q in asked}

    def _kinds(self) -> None:
        """A constraint without velocities holds for positions, others for rates (section 10)."""
        rng = np.random.default_rng(1)
        for _ in range(3):
            state = self.fill({**self._anything(rng), "time": rng.uniform(0.1, 1)})
            try:
                point = self.point(state)
                for c in self.flat.constraints:
                    off = np.ravel(np.asarray(point.at(c.left) - point.at(c.right), object))
                    for k, x in enumerate(off):
                        if np.abs(point.moved(x, True)).max() > 1e-12 * (1 + np.abs(point.moved(x)).max()):
                            self.kinds[c.name, k] = "rate"
            except (ValueError, ZeroDivisionError):
                continue

    def rated(self, e: flat.Expression) -> bool:
        """Whether an expression contains velocities, so that it is a rate itself (section 5)."""
        if id(e) not in self.rates_by_text:
            self.rates_by_text[id(e)] = self._moves_with_rates(e)
        return self.rates_by_text[id(e)]

    def _moves_with_rates(self, e: flat.Expression) -> bool:
        rng = np.random.default_rng(4)
        for _ in range(3):
            try:
                point = self.point(self.fill({**self._anything(rng), "time": rng.uniform(0.1, 1)}))
                x = point.at(e)
                if isinstance(x, Pose):
                    return False
                items = np.ravel(np.asarray(x, object))
                if any(np.abs(point.moved(i, True)).max(initial=0) > 1e-12 for i in items):
                    return True
            except (ValueError, ZeroDivisionError):
                continue
        return False

    def _anything(self, rng: np.random.Generator) -> State:
        names = [*self.all_coordinates, *self.all_rates, *(x for s in self.state_layout for x in s[2])]
        state = {n: float(rng.uniform(0.2, 1)) for n in names}
        return {**state, **{x: 1.0 for d in self.discrete_layout for x in d[2]}}

    def rigid(self, q: flat.Query) -> tuple[list[int], list[int]]:
        """The masses and inertias that belong to the rigid body of a frame."""
        point = self.point(self.fill(self._anything(np.random.default_rng(2))))
        frame = questions.frame_of(point, q)
        masses = [
            i
            for i, m in enumerate(self.flat.masses)
            if questions.rigidly_with(point, frame, point.at(m.at))
            and questions.rigidly_with(point, frame, self._carrier(point, m.at))
        ]
        inertias = [
            i
            for i, j in enumerate(self.flat.inertias)
            if questions.rigidly_with(point, frame, point.at(j.on))
        ]
        return masses, inertias

    def _carrier(self, point: Point, at: flat.Expression) -> Value:
        """The frame in which a point is stated, which may turn where the point does not move; without one the point."""
        match at:
            case flat.Name(name=name) if name in self.definitions:
                value = self.definitions[name].value
                return point.at(at) if value is None else self._carrier(point, value)
            case flat.Apply(function="multiply", arguments=(first, _)) if at.type.kind is flat.Kind.POINT:
                return point.at(first)
        return point.at(at)

    # ------------------------------------------------------------ states

    def fill(self, state: Mapping[str, float]) -> State:
        """A state with the values of what is driven, as far as it is not given."""
        full = dict(state)
        full.setdefault("time", 0.0)
        for d, name in zip(self.flat.drives, self.drive_names, strict=True):
            rated = self.drive_name(d)[1]
            if not self.holds(full, name):
                continue
            value = self._driving(full, d, name)
            elements, rates = self.driven_by(name)
            if isinstance(value, Pose):
                turning, value = value.own_spin(), quaternion_of(value)
            else:
                value = np.ravel(value if isinstance(value, np.ndarray) else np.array([value], object))
                turning = value if rated else vector(*(der(x) for x in value))
            for x, f in zip(rates, turning, strict=True):
                full.setdefault(x, real(f))
            for x, f in zip(elements, () if rated else value, strict=not rated):
                full.setdefault(x, real(f))
        return full

    def _driving(self, state: State, d: flat.Drive, name: str) -> Value:
        """A driven value: of time, and of frames whose places to each other are, wherever these are."""
        try:
            return self.point(state, bare=True).at(d.value)
        except KeyError:
            elements, rates = self.driven_by(name)
            around = dict.fromkeys((*elements, *rates), 0.0)
            around |= {elements[0]: 1.0} if len(elements) > len(rates) else {}  # no turn, as a quaternion
            return self.point(around | state).at(d.value)

    def driven_by(self, name: str) -> tuple[list[str], list[str]]:
        """The elements of a coordinate, or the one of this name, and their rates."""
        whole = next((c for c in self.coordinate_layout if c[0] == name), None)
        return (whole[2], whole[3]) if whole else ([name], [f"der({name})"])

    def point(self, state: Mapping[str, float], bare: bool = False, **others: Any) -> Point:
        """A point without known accelerations (``bare``: without coordinates)."""
        if bare:
            outer = self.coordinate_layout, self.state_layout, self.discrete_layout
            self.coordinate_layout, self.state_layout, self.discrete_layout = [], [], []
            try:
                return Point(self, state, Unknowns(self.unasked), **others)
            finally:
                self.coordinate_layout, self.state_layout, self.discrete_layout = outer
        return Point(self, state, Unknowns(self.unasked), **others)

    def ask(self, point: Point, q: flat.Query) -> Value:
        return questions.answer(self, point, q)

    @property
    def driven(self) -> list[str]:
        out = []
        for d, name in zip(self.flat.drives, self.drive_names, strict=True):
            out += [] if self.drive_name(d)[1] else self.driven_by(name)[0]
        return out

    @property
    def coordinates(self) -> list[str]:
        return [x for x in self.all_coordinates if x not in self.driven]

    @property
    def rates(self) -> list[str]:
        rated = {x for name in self.drive_names for x in self.driven_by(name)[1]}
        return [x for x in self.all_rates if x not in rated]

    @property
    def states(self) -> list[str]:
        return [x for s in self.state_layout for x in s[2]]

    @property
    def discretes(self) -> list[str]:
        return [x for d in self.discrete_layout for x in d[2]]

    @property
    def input_names(self) -> list[str]:
        return [x for u in self.input_layout for x in u[2]]

    # ------------------------------------------------------------ answers

    def solution(self, state: Mapping[str, float], **others: Any) -> Solution:
        if others:
            return solve(self, self.fill(state), **others)
        # accounts of energy, which a run adds to its states, enter no law
        asked = tuple(sorted((k, v) for k, v in state.items() if not k.startswith("energy.")))
        if self.solved is None or self.solved[0] != asked:
            self.solved = asked, solve(self, self.fill(state))
        return self.solved[1]

    def accelerations(self, state: Mapping[str, float]) -> State:
        s, out = self.solution(state), State()
        for _, shape, elements, rates, first in self.coordinate_layout:
            names = [f"{r[:-3]}, 2){r[-3:]}".replace("), 2)", ", 2)") for r in rates]
            if shape is not None:
                names = [f"der({x}, 2)" for x in elements]
            out.update(zip(names, s.unknowns.a[first : first + len(names), 0].real, strict=True))
        return {k: float(v) for k, v in out.items()} | {
            f"der({x})": float(v[0].real) for x, v in s.unknowns.rates.items()
        }

    def outputs(self, state: Mapping[str, float]) -> State:
        return self.outputs_of(self.solution(state))

    def outputs_of(self, solution: Solution) -> State:
        point, out = solution.point, {}
        self.superfluous = solution.superfluous
        try:
            for d in self.flat.definitions:
                if d.role is flat.DefinitionRole.OUTPUT and d.value is not None:
                    out.update(named(d.name, point.at.name(d.name)))
        finally:
            self.superfluous = frozenset()
        out["energy.kinetic"] = real(point.kinetic())
        out["energy.potential"] = real(point.potential())
        out["energy.total"] = float(np.real(np.ravel(point.total_energy())[0]))
        return out

    def input_values(self, state: Mapping[str, float]) -> State:
        point, out = self.point(self.fill(state)), {}
        for name, _, _ in self.input_layout:
            out.update(named(name, point.at.name(name)))
        return out

    def multipliers(self, state: Mapping[str, float]) -> dict[str, list[float]]:
        forces: dict[str, list[float]] = {}
        for name, value in self.solution(state).unknowns.forces.items():
            forces.setdefault(name.split("[")[0] if name.endswith("]") else name, []).append(
                float(value[0].real)
            )
        return forces

    def _load(self, joint: str, state: Mapping[str, float]) -> list[float]:
        s = self.solution(state)
        self.superfluous = s.superfluous
        try:
            return [x.real for x in questions.cut_load(self, s.point, joint)]
        finally:
            self.superfluous = frozenset()

    def reaction(self, joint: str, state: Mapping[str, float]) -> list[float]:
        return self._load(joint, state)[: self.flat.space]

    def moment(self, joint: str, state: Mapping[str, float]) -> list[float]:
        return self._load(joint, state)[self.flat.space :]

    def modes(self, state: Mapping[str, float]) -> dict[str, str]:
        return dict(self.solution(state).modes)

    def value(self, e: flat.Expression, state: Mapping[str, float]) -> Any:
        x = self.solution(state).point.at(e)
        if isinstance(x, Pose):
            x = x.p
        if isinstance(x, np.ndarray):
            return np.array([real(y) for y in np.ravel(x)]).reshape(x.shape)
        return x if isinstance(x, bool | str) else real(x)

    def residuals(self, state: Mapping[str, float]) -> tuple[Any, Any]:
        return start.residuals(self, self.fill(state))

    def project(self, state: Mapping[str, float]) -> State:
        return start.project(self, self.fill(state))

    def start(self, time: float = 0.0, beside: State | None = None) -> State:
        if beside is not None:
            return start.assemble(self, time, beside)
        if time not in self.starts:
            self.starts[time] = start.assemble(self, time)
        return dict(self.starts[time])

    def random(self, rng: np.random.Generator, spread: float = 0.3, moves: bool = True) -> State:
        return start.random(self, rng, spread, moves)

    def motion(self, stop: float, start: float = 0.0, **options: Any) -> Motion:
        return move(self, stop, start, **options)


def named(name: str, value: Value) -> State:
    """The elements of a value, by name."""
    if isinstance(value, Pose):
        value = value.p
    items = np.ravel(np.asarray(value, object))
    return {
        n: float(np.real(np.ravel(now(x))[0]))
        for n, x in zip(element_names(name, np.shape(value)), items, strict=True)
    }
