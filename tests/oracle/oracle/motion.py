"""Short motions: a plain integrator between events, events by looking densely and halving (events, sections 2 to 5)."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, RK45

from mechc.compiler.flat import model as flat
from oracle import impacts
from oracle.expressions import der
from oracle.point import Point, items_of
from oracle.poses import Pose
from oracle.series import real
from oracle.solving import Solution, choices, margins, solve, solve_in
from oracle.start import project
from oracle.values import Bent, NotCovered, Undetermined

if TYPE_CHECKING:
    from oracle.meaning import Meaning

State = dict[str, Any]
MARGIN = 1e-11


@dataclass(frozen=True)
class Happening:
    time: float
    name: str
    kind: str


@dataclass
class Motion:
    time: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    states: list[State] = field(default_factory=list)
    events: list[Happening] = field(default_factory=list)
    outcome: str = "completed"
    pieces: list[tuple[float, float, Callable[[float], State]]] = field(default_factory=list)

    def add(self, state: State) -> None:
        self.time = np.append(self.time, state["time"])
        self.states.append(dict(state))

    def at(self, t: float) -> State:
        """The state at a time, the side after an event."""
        if t >= self.time[-1]:
            return self.states[-1]
        for first, last, state in reversed(self.pieces):
            if first <= t < last or (t == last and first == last):
                return state(t)
        raise KeyError(t)


class Run:
    """A motion on its way: state, modes of contacts and friction, branches of laws, conditions."""

    def __init__(
        self, meaning: Meaning, stop: float, state: State, tolerance: float, scan: float, longest: float
    ) -> None:
        self.m, self.stop, self.state = meaning, stop, state
        self.tolerance, self.scan, self.longest = tolerance, scan, longest
        self.motion = Motion()
        self.frozen: dict[Any, Any] = {}
        self.modes: dict[str, str] = {}
        self.fastest = {c.name: 0.0 for c in meaning.flat.contacts}
        self.truth: dict[tuple[int, int], bool] = {}
        self.first = state["time"]
        self.ticked: dict[tuple[int, int], float] = {}
        self.switching = True
        self.order = [*meaning.coordinates, *meaning.rates, *meaning.states]

    # ------------------------------------------------------------ between events

    def unpacked(self, t: float, y: Any) -> State:
        loose = {
            k: v
            for k, v in self.state.items()
            if k not in self.m.all_coordinates and k not in self.m.all_rates
        }
        return self.m.fill({**loose, **dict(zip(self.order, map(float, y), strict=True)), "time": t})

    def solution(self, state: State, quick: bool = False, seen: bool = True) -> Solution:
        return solve_in(self.m, state, self.modes, self.frozen, quick, seen=seen)

    def rhs(self, t: float, y: Any) -> Any:
        state = self.unpacked(t, y)
        s, rate = self.solution(state, quick=True, seen=False), State()
        for _, shape, elements, rates, first in self.m.coordinate_layout:
            v = [state[x] for x in rates]
            if shape is None:
                a, b, c, d = (state[x] for x in elements)
                wx, wy, wz = v
                v = [
                    -b * wx - c * wy - d * wz,
                    a * wx + c * wz - d * wy,
                    a * wy + d * wx - b * wz,
                    a * wz + b * wy - c * wx,
                ]
                v = [x / 2 for x in v]
            rate.update(zip(elements, v, strict=True))
            rate.update(zip(rates, s.unknowns.a[first : first + len(rates), 0].real, strict=True))
        rate.update({x: float(np.real(f[0])) for x, f in s.unknowns.rates.items()})
        return np.array([rate[x] for x in self.order])

    def surfaces(self, s: Solution) -> dict[Any, float]:
        """What stays above zero up to the next event."""
        point, state = s.point, s.point.state
        gaps = self.gaps(point)
        out: dict[Any, float] = {("law", k): real(g) for k, (g, _) in point.at.seen.items()}
        for k, value in margins(self.m, s, {n: [m, "", ""] for n, m in self.modes.items()}).items():
            if not k.endswith((" starts", " opens")):
                out["mode", k] = value
        out.update({("gap", name): gap for name, gap in gaps.items()})
        for c in self.m.flat.contacts:
            if self.modes[c.name] in ("slip+", "slip-") and c.friction is not None:
                out["slip", c.name] = real(point.slip(c)[0]) * (1 if self.modes[c.name] == "slip+" else -1)
        for f in self.m.flat.frictions:
            if self.modes[f.name] in ("slip+", "slip-"):
                out["slip", f.name] = real(der(point.at(f.on))) * (1 if self.modes[f.name] == "slip+" else -1)
        for key, now_true in self.conditions(s, state["time"], None).items():
            if not self.truth.get(key, now_true):
                out["when", key] = -1.0 if now_true else 1.0
            elif not now_true:
                out["lost", key] = -1.0
        return out

    def gaps(self, point: Point) -> dict[str, float]:
        """What is open, and how far; from here on the point has seen the branches of these laws, too."""
        open_ones = [c for c in self.m.flat.contacts if self.modes[c.name] == "open" and point.held(c.name)]
        return {c.name: real(point.at(c.gap)) for c in open_ones}

    def conditions(self, s: Solution, t: float, instant: float | None) -> dict[tuple[int, int], bool]:
        """The truth of all conditions as they stand; `sample`, `initial` and what comes with the time at an instant only."""
        at, out = s.point.at, {}
        frozen, at.frozen = at.frozen, None
        at.event = lambda e: self.ticks(s, e, instant)
        at.due = 0.0 if instant is None else max(1.0, abs(instant))
        for i, event in enumerate(self.m.flat.events):
            for j, branch in enumerate(event.branches):
                out[i, j] = bool(at(branch.condition))
        at.event, at.frozen, at.due = None, frozen, 0.0
        return out

    def ticks(self, s: Solution, e: flat.Apply, instant: float | None) -> bool:
        if instant is None:
            return False
        if e.function == "initial":
            return bool(instant == self.first)
        period, *rest = (real(s.point.at(a)) for a in e.arguments)
        k = round((instant - (rest[0] if rest else 0.0)) / period)
        off = instant - (rest[0] if rest else 0.0) - k * period
        due = k >= 0 and abs(off) <= 1e-12 * max(1.0, abs(instant))
        # an instant right behind a tick, such as of a law that leaves its edge there, is no further one
        return bool(due and self.ticked.setdefault((id(e), k), instant) == instant)

    def next_tick(self) -> float:
        """The next time of a `sample`."""
        t, best, point = self.state["time"], self.stop, self.m.point(self.state, modes=self.modes)
        for event in self.m.flat.events:
            for branch in event.branches:
                for e in self.m.expressions(branch.condition):
                    if isinstance(e, flat.Apply) and e.function == "sample":
                        period, *rest = (real(point.at(a)) for a in e.arguments)
                        first = rest[0] if rest else 0.0
                        k = max(0, math.floor((t - first) / period * (1 + 1e-14) + 1e-9) + 1)
                        best = min(best, first + k * period)
        return best

    def piece(self) -> list[Any]:
        """Integrate up to the next event or tick; what has fallen below zero there."""
        t0, end = self.state["time"], self.next_tick()
        y0 = np.array([self.state[x] for x in self.order])
        if not len(y0):
            y0 = np.zeros(0)
        method = RK45 if self.longest <= self.scan else DOP853  # where steps are short, few stages are enough
        solver = method(
            self.rhs,
            t0,
            y0,
            end,
            max_step=self.longest,
            rtol=max(self.tolerance, 3e-14),
            atol=self.tolerance * 1e-1,
        )
        while solver.status == "running":
            solver.step()
            if solver.status == "failed":
                raise Undetermined("the integrator fails")
            dense, left, right = solver.dense_output(), solver.t_old, solver.t
            look = np.linspace(left, right, max(3, math.ceil((right - left) / self.scan) + 1))[1:]
            look = look if self.switching else look[:0]
            for t in look:
                low = self.heights(t, dense)[1]
                if low:
                    t, low = self.first_below(left, t, low, dense)
                    self.arrive(solver.t_old, t, dense)
                    return list(low)
                left = t
            self.arrive(solver.t_old, solver.t, dense)
            y = np.array([self.state[x] for x in self.order])
            solver.y, solver.f = y, self.rhs(solver.t, y)
        return []

    def heights(self, t: float, dense: Any) -> tuple[dict[Any, float], dict[Any, float]]:
        """What stays above zero up to the next event, at a time on the way, and what of it is below."""
        values = self.surfaces(self.solution(self.unpacked(t, dense(t)), quick=True))
        return values, {k: value for k, value in values.items() if value < -MARGIN}

    def first_below(
        self, left: float, t: float, low: dict[Any, float], dense: Any
    ) -> tuple[float, dict[Any, float]]:
        """Cut next to where straight lines fall through zero, or halve, until nothing is between both sides."""
        whole, above = t - left, self.heights(left, dense)[0]

        def cut(middle: float) -> bool:
            nonlocal left, t, low, above
            if not left < middle < t:
                return False
            values, fallen = self.heights(middle, dense)
            if fallen:
                t, low = middle, fallen
            else:
                left, above = middle, values
            return True

        while t - left > 4e-16 * max(1.0, abs(t)):
            width = t - left
            if all(k[0] not in ("when", "lost") and above.get(k, 0.0) > -MARGIN for k in low):
                falls = ((above.get(k, 0.0) + MARGIN) / (above.get(k, 0.0) - x) for k, x in low.items())
                zero, around = left + width * min(falls), min(0.02 * width, 10 * width * width / whole)
                cut(zero - around)
                cut(zero + around)
            if t - left > 0.5 * width and not cut((left + t) / 2):
                break
        return t, low

    def arrive(self, t0: float, t: float, dense: Any) -> None:
        """Go to a time on the way, back onto all constraints."""
        loose = dict(self.state)
        self.motion.pieces.append((t0, t, lambda s, run=self, d=dense, z=loose: run.seen(s, d, z)))  # type: ignore[misc]
        self.state = self.settled(self.unpacked(t, dense(t)))
        self.motion.add(self.state)

    def seen(self, t: float, dense: Any, loose: State) -> State:
        keep, self.state = self.state, loose
        try:
            return self.unpacked(t, dense(t))
        finally:
            self.state = keep

    def settled(self, state: State) -> State:
        if not (
            self.m.flat.constraints or self.m.tree.loops or any(m != "open" for m in self.modes.values())
        ):
            return state
        state = project(
            self.m,
            state,
            lambda p: [p.at(c.gap) for c in self.m.flat.contacts if self.modes.get(c.name, "open") != "open"],
            self.frozen,
        )
        return self.stuck(state)

    def stuck(self, state: State) -> State:
        """What sticks does not slide, to rounding."""
        point = self.m.point(state, frozen=self.frozen, modes=self.modes)
        pairs = [
            (s, "rate")
            for c in self.m.flat.contacts
            if self.modes.get(c.name) == "stick"
            for s in point.slip(c)
        ]
        pairs += [
            (der(point.at(f.on)), "rate") for f in self.m.flat.frictions if self.modes.get(f.name) == "stick"
        ]
        if not pairs:
            return state
        pairs += [
            (der(point.at(c.gap)), "rate")
            for c in self.m.flat.contacts
            if self.modes.get(c.name, "open") != "open"
        ]
        rows = np.array([impacts.gradient(point, s, kind) for s, kind in pairs])
        return impacts.with_rates(self.m, state, {}, (rows, -np.array([real(s) for s, _ in pairs])))

    # ------------------------------------------------------------ events

    def note(self, name: str, kind: str) -> None:
        self.motion.events.append(Happening(self.state["time"], name, kind))

    def renew(self, still: set[str], ended: Collection[str] = ()) -> None:
        """The modes in which the motion goes on; what presses or slides is known, not measured."""
        hints: State = {}
        for c in self.m.flat.contacts:
            hints[f"closed({c.name})"] = float(self.modes.get(c.name, "open") != "open")
        point = self.m.point(self.state, modes=self.modes)
        speed = 1 + max((abs(self.state[x]) for x in self.m.all_rates), default=0)
        slips = {c.name: point.slip(c) for c in self.m.flat.contacts if c.friction is not None}
        slips.update({f.name: [der(point.at(f.on))] for f in self.m.flat.frictions})
        for name, (first, *more) in slips.items():
            mode, rate = self.modes.get(name, "slip"), real(first)
            if more:
                if name in still or (mode == "stick" and max(abs(rate), abs(real(more[0]))) <= 1e-6 * speed):
                    hints[f"slips({name})"] = 0.0
            elif abs(rate) > 1e-6 * speed:  # measured, since laws and velocities may have jumped
                hints[f"slips({name})"] = rate
            elif name in still or mode == "stick":
                hints[f"slips({name})"] = 0.0
            elif mode in ("slip+", "slip-"):
                hints[f"slips({name})"] = 1.0 if mode == "slip+" else -1.0
        before = dict(self.modes)
        s = solve(self.m, {**self.state, **hints}, frozen=self.frozen, without=ended)
        self.modes = dict(s.modes)
        for name, mode in self.modes.items():
            old = before.get(name, "open")
            if old != "open" and mode == "open":
                self.note(name, "lift-off")
            elif old == "stick" and mode.startswith("slip"):
                self.note(name, "slip")
            elif old.startswith("slip") and mode == "stick":
                self.note(name, "stick")
            elif old.startswith("slip") and mode.startswith("slip") and old != mode:
                self.note(name, "slip")
        self.state = self.settled(self.state)

    def touch(self) -> None:
        """Contacts whose gap is zero: hits until nothing approaches, then rest or flight."""
        m, point = self.m, self.m.point(self.state, frozen=self.frozen, modes=self.modes)
        length = 1 + max((abs(self.state[x]) for x in m.all_coordinates), default=0)
        touching = [
            c for c in m.flat.contacts if point.held(c.name) and real(point.at(c.gap)) <= 1e-9 * length
        ]
        rest = {}
        for c in touching:
            self.fastest[c.name] = max(self.fastest[c.name], -impacts.approach(point, c))
            own = m.option(c.options, "rest", None)
            rest[c.name] = 1e-9 * self.fastest[c.name] + 1e-13 if own is None else own
        pressed = [c for c in touching if self.modes.get(c.name, "open") != "open" and self.presses(point, c)]
        self.state, hit = impacts.impacts(m, self.state, touching, pressed, rest, self.frozen)
        for name in dict.fromkeys(hit):
            self.note(name, "impact")
        point = m.point(self.state, frozen=self.frozen, modes=self.modes)
        still = set()
        for c in touching:
            speed = impacts.approach(point, c)
            closed = abs(speed) <= max(rest[c.name], 1e-12) * 10
            if closed and self.modes.get(c.name, "open") == "open":
                self.note(c.name, "rest")
            elif not closed and self.modes.get(c.name, "open") != "open":
                self.note(c.name, "lift-off")
            self.modes[c.name] = ("slip" if c.friction is not None else "closed") if closed else "open"
            if closed and c.friction is not None:
                slip = [real(s) for s in point.slip(c)]
                speed = 1 + max((abs(self.state[x]) for x in m.all_rates), default=0)
                if max(map(abs, slip)) <= 1e-9 * speed:
                    still.add(c.name)
                elif len(slip) == 1:
                    self.modes[c.name] = "slip+" if slip[0] > 0 else "slip-"
        self.renew(still)

    def bends(self) -> bool:
        """Whether a law that has changed its branch leaves a closed contact with a gap that grows or shrinks."""
        point = self.m.point(self.state, frozen=self.frozen, modes=self.modes)
        speed = 1 + max((abs(self.state[x]) for x in self.m.all_rates), default=0)
        closed = [c for c in self.m.flat.contacts if self.modes[c.name] != "open"]
        return any(abs(impacts.approach(point, c)) > 1e-9 * speed for c in closed)

    def presses(self, point: Point, c: flat.Contact) -> bool:
        """Whether a closed contact has carried a load up to now; one that merely touches can be hit."""
        s = self.solution(self.state)
        force = abs(float(np.real(s.unknowns.forces[c.name][0])))
        loads = np.abs(point.meaning.point(self.state).inertial()[:, 0]) + np.abs(s.point.inertial()[:, 0])
        return bool(force * np.abs(point.moved(point.at(c.gap))).max() > 1e-9 * loads.max(initial=0))

    def cross(self, keys: list[Any]) -> None:
        """Surfaces of laws: the other branch, or an impulse where the potential jumps (events, section 5)."""
        s = self.solution(self.state)
        self.gaps(s.point)
        low = [k for k in keys if k in s.point.at.seen]
        old = dict(self.frozen)
        before = real(s.point.stored())
        for k in low:
            choice = s.point.at.seen[k][1]
            if isinstance(choice, bool | np.bool_):
                self.frozen[k] = not choice
            else:
                self.frozen[k] = math.floor(
                    s.point.at.floors[k] + 1e-9
                    if s.point.at.floors[k] > choice + 0.5
                    else s.point.at.floors[k] - 1e-9
                )
        step = real(self.solution(self.state).point.stored()) - before
        if abs(step) > 1e-9 * (1e-6 + abs(before) + abs(real(s.point.kinetic()))):
            surface = s.point.at.seen[low[0]][0]
            rows = np.array(
                [
                    impacts.gradient(s.point, s.point.at(c.gap), "position")
                    for c in self.m.flat.contacts
                    if self.modes[c.name] != "open"
                ]
            ).reshape(-1, self.m.size)
            self.state, passes = impacts.climb(self.m, self.state, surface, step, rows)
            self.note("potential", "crossing" if passes else "reflection")
            if not passes:
                self.frozen = old
        if self.leaves():
            self.state = impacts.obeying(self.m, self.state, self.frozen)

    def leaves(self) -> bool:
        """Whether a law that has changed its branch leaves a constraint that asks for other velocities now."""
        rows = self.m.point(self.state, frozen=self.frozen, modes=self.modes).rows()
        rates = [real(der(value) if kind == "position" else value) for _, kind, value in rows]
        speed = 1 + max((abs(self.state[x]) for x in self.m.all_rates), default=0)
        return any(abs(rate) > 1e-6 * speed for rate in rates)

    def whens(self, instant: float) -> bool:
        """Act on what has become true, in the order of the text, until nothing changes (events, section 4)."""
        for _ in range(100):
            s = self.solution(self.state)
            current = self.conditions(s, instant, instant)
            risen = {k for k, now_true in current.items() if now_true and not self.truth.get(k, False)}
            self.truth = current
            if not risen:
                self.truth = self.conditions(s, instant, None) | {
                    k: v for k, v in current.items() if not self.momentary(k)
                }
                return True
            for i, event in enumerate(self.m.flat.events):
                j = next((j for j in range(len(event.branches)) if (i, j) in risen), None)
                if j is not None:
                    self.note(f"when[{i + 1}]", "when")
                    if not self.act(event.branches[j].actions):
                        return False
        raise Undetermined("conditions that set each other off")

    def momentary(self, key: tuple[int, int]) -> bool:
        branch = self.m.flat.events[key[0]].branches[key[1]]
        return any(
            isinstance(e, flat.Apply) and e.function in ("sample", "initial")
            for e in self.m.expressions(branch.condition)
        )

    def act(self, actions: tuple[flat.Action, ...]) -> bool:
        m = self.m
        previous = self.solution(self.state).point.at
        for action in actions:
            at = self.solution(self.state).point.at
            at.previous, at.frozen = previous, None
            match action:
                case flat.Terminate():
                    self.motion.outcome = "terminated"
                    return False
                case flat.Assign():
                    self.set(action.target, at(action.value))
                case flat.Reinit():
                    self.reinit(action.target, at(action.value))
                case flat.Impulse():
                    point = self.solution(self.state).point
                    self.state = impacts.pushed(m, self.state, point.load(action.load)[:, 0].real)
                    self.touch()
                case flat.Switch() if action.engage == m.holds(self.state, action.target):
                    pass
                case flat.Switch():
                    self.state = {**self.state, f"held({action.target})": float(action.engage)}
                    self.note(action.target, "engage" if action.engage else "release")
                    if action.engage:
                        self.state = impacts.obeying(m, self.state)
                    if action.target in self.modes and not action.engage:
                        self.modes[action.target] = "open"
                    self.touch()
        return True

    def set(self, target: flat.Expression, value: Any) -> None:
        for name, x in zip(element(target), items_of(value), strict=True):
            self.state = {**self.state, name: float(real(x))}

    def reinit(self, target: flat.Expression, value: Any) -> None:
        m = self.m
        if isinstance(target, flat.Derivative):
            base = element(target.operand)
            names = [f"der({n})" for n in base]
            if names[0] not in m.all_rates:
                names = [r for c in m.coordinate_layout if c[0] == base[0] for r in c[3]]
            wanted = {n: float(real(x)) for n, x in zip(names, items_of(value), strict=True)}
            self.state = impacts.with_rates(m, self.state, wanted)
        elif isinstance(value, Pose):
            raise NotCovered("reinit of a rotation")
        else:
            self.set(target, value)
            self.state = project(m, self.state) if m.flat.constraints or m.tree.loops else self.state
        self.touch()

    def go(self) -> Motion:
        m = self.m
        point = m.point(self.state)
        self.modes = {c.name: "open" for c in m.flat.contacts} | dict.fromkeys(
            (f.name for f in m.flat.frictions), "slip"
        )
        for f in m.flat.frictions:
            options = choices(m, self.state, point)[f.name]
            self.modes[f.name] = options[0]
        self.motion.add(self.state)
        self.touch()
        self.motion.events.clear()
        self.switching = bool(self.surfaces(self.solution(self.state)) or m.flat.events)
        self.truth = self.conditions(self.solution(self.state), self.first, None)
        for key in self.truth:
            if self.momentary(key):
                self.truth[key] = False
        going = self.whens(self.first)
        self.motion.add(self.state)
        while going and self.state["time"] < self.stop:
            low = self.piece()
            t = self.state["time"]
            kinds = {k for k, _ in low}
            self.truth.update({key: False for kind, key in low if kind == "lost"})
            if "law" in kinds:
                self.cross([key for kind, key in low if kind == "law"])
            if kinds & {"gap", "mode", "slip", "law"}:
                still = {key for kind, key in low if kind == "slip"}
                self.modes.update(dict.fromkeys(still, "slip"))
                if "gap" in kinds or ("law" in kinds and self.bends()):
                    self.touch()
                else:
                    self.renew(still, [key for kind, key in low if kind == "mode"])
            going = self.whens(t)
            self.motion.add(self.state)
        return self.motion


def element(target: flat.Expression) -> list[str]:
    """The names of the elements of a variable, or of a part of it."""
    if isinstance(target, flat.Name):
        shape = target.type.shape
        if not shape:
            return [target.name]
        return [f"{target.name}[{','.join(str(i + 1) for i in index)}]" for index in np.ndindex(*shape)]
    if isinstance(target, flat.Element) and isinstance(target.base, flat.Name):
        return [f"{target.base.name}[{','.join(str(i + 1) for i in target.indices)}]"]
    raise NotCovered("an assignment to an expression")


def move(
    meaning: Meaning,
    stop: float,
    start: float = 0.0,
    state: State | None = None,
    tolerance: float = 1e-11,
    scan: float | None = None,
    longest: float | None = None,
) -> Motion:
    """The motion up to a time; ``scan``: how closely is looked for events [s], ``longest``: step of the integrator [s]."""
    state = (
        meaning.start(start) if state is None else meaning.fill({**state, "time": state.get("time", start)})
    )
    scan = scan or (stop - state["time"]) / 200
    meaning.affine = None
    try:
        return Run(meaning, stop, state, tolerance, scan, longest or 10 * scan).go()
    except Bent:
        return Run(meaning, stop, state, tolerance, scan, longest or 10 * scan).go()
