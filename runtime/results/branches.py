"""Which of several solutions the outputs follow that equations determine, and what is said of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from msgspec import Struct, to_builtins

from ..arrays.choice import np
from ..case import Case
from ..integrate.trajectory import DenseOutput
from ..outcome import time_text
from ..problem import Array, Problem
from .branch_jumps import Jump, Kind, Point, follow
from .files import json_number
from .further_solutions import Several, several_at
from .systems import StatesAt, System, systems_of

LEAST_POINTS, MOST_POINTS = 400, 5000
"""Rows of the results at which a solution is followed: of fewer, others are put between, of more some are left out; as many
steps at most."""
TOLD_TIMES, TOLD_SOLUTIONS = 4, 3
JUMP_DIGITS = 5
"""In a fold the last ones come from the root of a small time."""

WORDS = {
    Kind.JUMP: "the solution that it followed goes on, and the guess leads to another one",
    Kind.FOLD: "the solution that it followed ends there, in a fold, and the guess leads to another one",
    Kind.MEETING: "two solutions meet there, and the guess decides, not the equations, which one goes on",
    Kind.LOST: "the solution that it followed goes on, but is not found from the guess",
}
ENDS = "the solution that it followed ends there, in a fold, and none is found from the guess"


class Branches(Struct, frozen=True):
    """``given_up``: systems that jump too often, by the names of their outputs, with the time until which they were followed."""

    jumps: tuple[Jump, ...] = ()
    several: tuple[Several, ...] = ()
    given_up: tuple[tuple[tuple[str, ...], float], ...] = ()

    def summary(self) -> dict[str, Any]:
        """Give what a report holds as JSON knows it: nothing where there is nothing to say."""
        jumps = [
            to_builtins(j) | {"before": _numbers(j.before), "after": _numbers(j.after)} for j in self.jumps
        ]
        several = to_builtins(self.several)
        return ({"jumps": jumps} if jumps else {}) | ({"further_solutions": several} if several else {})

    def remarks(self, problem: Problem) -> Iterator[str]:
        for one in self.several:
            yield _several_text(problem, one)
        alike = dict[object, list[Jump]]()
        for jump in sorted(self.jumps, key=lambda j: j.time):
            alike.setdefault((jump.names, jump.kind, bool(np.isfinite(jump.after).all())), []).append(jump)
        for jumps in alike.values():
            yield _jumps_text(problem, jumps)
        for names, until in self.given_up:
            yield f"{_named(names)} jump{'s' * (len(names) == 1)} more often: followed until {time_text(problem, until)}, no further"


def branches_of(
    case: Case,
    rows: tuple[Array, Array, Array | None],
    dense: Callable[[Array], Array] | None,
    states_at: StatesAt,
) -> Callable[[], Branches] | None:
    """Give what looks at the outputs that equations determine along the ``rows`` (times, states, discrete variables) of a run;
    None where there are none. Between rows it looks at the steps, so that the spacing of results changes nothing."""
    if not case.problem.sought or not rows[0].size:
        return None

    def look() -> Branches:
        jumps: list[Jump] = []
        several: list[Several] = []
        given_up: list[tuple[tuple[str, ...], float]] = []
        with np.errstate(all="ignore"):
            for system in systems_of(case):
                points = _points(system, rows, dense, states_at)
                finite = [p.values for p in points if np.isfinite(p.values).all()]
                if finite:
                    system.largest = np.maximum(np.max(np.abs(finite), axis=0), 1e-300)
                found = several_at(system, points[0])
                several += [] if found is None else [found]
                followed = follow(system, points, states_at)
                jumps += followed.jumps
                if followed.until is not None:
                    given_up.append((tuple(q.name for q in system.quantities), followed.until))
        return Branches(tuple(jumps), tuple(several), tuple(given_up))

    return look


def _points(
    system: System,
    rows: tuple[Array, Array, Array | None],
    dense: Callable[[Array], Array] | None,
    states_at: StatesAt,
) -> list[Point]:
    t, y, z = rows
    held = system.case.z
    sides = np.zeros(t.size, dtype=bool)  # of events, which stay
    sides[[0, -1]] = True
    equal = np.flatnonzero(t[1:] == t[:-1])
    sides[equal] = sides[equal + 1] = True
    kept = np.flatnonzero(sides | (np.arange(t.size) % (1 + t.size // MOST_POINTS) == 0))
    found = [system.place(float(t[k]), y[k], held if z is None else z[k]) for k in kept]
    further = np.empty(0)
    if isinstance(dense, DenseOutput):
        further = dense.begin[(dense.begin > t[0]) & (dense.begin < t[-1])]
        further = further[:: 1 + further.size // MOST_POINTS]
    if t.size < LEAST_POINTS:
        further = np.append(further, np.linspace(t[0], t[-1], LEAST_POINTS))
    further = np.setdiff1d(further, t)
    if further.size:
        between, modes = states_at(further)
        found += [
            system.place(float(at), between[k], held if modes is None else modes[k])
            for k, at in enumerate(further)
        ]
        found.sort(key=lambda place: place.t)  # keeps the order of both sides of an event
    return [Point(place, system.reported(place)) for place in found]


# ---------------------------------------------------------------- words


def _several_text(problem: Problem, one: Several) -> str:
    shown = [_values(problem, one.names, x) for x in one.others[:TOLD_SOLUTIONS]]
    others = " or ".join(shown) + (" and more" if len(one.others) > TOLD_SOLUTIONS else "")
    taken = (
        f"{_named(one.names)} = {_values(problem, one.names, one.taken)} at {time_text(problem, one.time)}"
    )
    if one.outside:
        return (
            f"{taken} lies outside of the range that the model states; its equations hold within it for {others}: "
            "state a guess nearer to that"
        )
    return (
        f"{taken} is one of several solutions of its equations, beside {others}: the guess chooses; "
        "'min' and 'max' of the output say which one is meant"
    )


def _jumps_text(problem: Problem, jumps: Sequence[Jump]) -> str:
    first = jumps[0]
    before, after = (_values(problem, first.names, x, JUMP_DIGITS) for x in (first.before, first.after))
    ends = not np.isfinite(first.after).all()
    at = f"at {time_text(problem, first.time)}"
    if ends:
        words = ENDS if first.kind is Kind.FOLD else WORDS[first.kind]
        said = f"{_named(first.names)} = {before} is the last value before {at.removeprefix('at ')}: {words}"
    elif first.kind is Kind.MEETING:
        said = f"{_named(first.names)} {at}: {WORDS[first.kind]}"
    else:
        verb = "jumps" if len(first.names) == 1 else "jump"
        said = f"{_named(first.names)} {verb} {at} from {before} to {after}: {WORDS[first.kind]}"
    again = [f"{jump.time:.10g}" for jump in jumps[1:TOLD_TIMES]]
    if again:
        rest = len(jumps) - TOLD_TIMES
        said += f"; again at {', '.join(again)}" + (f" and {rest} times more" if rest > 0 else "")
    return said


def _named(names: Sequence[str]) -> str:
    """Name outputs, an array by its own name."""
    return ", ".join(f"'{name}'" for name in dict.fromkeys(name.partition("[")[0] for name in names))


def _values(problem: Problem, names: Sequence[str], values: Sequence[float], digits: int = 6) -> str:
    units = {q.name: q.unit for q in problem.outputs if q.name in names}
    shown = [f"{0.0 if abs(x) < 1e-300 else x:.{digits}g}" for x in values]
    if len({units[n] for n in names}) == 1:
        text = shown[0] if len(shown) == 1 else f"({', '.join(shown)})"
        return f"{text} {units[names[0]]}".rstrip()
    return f"({', '.join(f'{x} {units[n]}'.rstrip() for x, n in zip(shown, names, strict=True))})"


def _numbers(values: Sequence[float]) -> list[float | None]:
    return [json_number(x) for x in values]
