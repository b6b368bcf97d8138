"""Compare a compiled model with the oracle, which knows the page of the language and a flat model, and no more."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection
from typing import Any

import numpy as np
from oracle import Ambiguous, Meaning, NotCovered, Undetermined
from oracle.expressions import BENDS, EDGES
from oracle.impacts import mass_matrix

from mechc.runtime.outcome import Outcome
from random_models.accounts import misbooked
from random_models.balance import unaccounted
from random_models.compiled import Compiled, NoMotion, Values, differences, shaken
from random_models.limits import TooLong, limited
from random_models.states import approaching, looks
from random_models.tree import Model


class OracleFails(Exception):
    """The oracle ends with an error that is not one of its own answers."""


def ignored(model: Model) -> tuple[str, ...]:
    """Return outputs whose meaning pages leave open."""
    found: tuple[str, ...] = ()
    moving = ("potential", "potential.linear", "lagrangian", "lagrangian.linear", "function.body")
    linear = any(
        e.kind in ("der", "vel", "angvel", "vel_at") or "v" in e.level
        for s in model.statements()
        for slot in s.slots
        if slot.place in moving
        for e in slot.expression.walk()
    )
    if linear or any((s.data or {}).get("class") == "UniformMagneticField" for s in model.statements()):
        found += ("energy.potential", "energy.kinetic")  # where a potential of velocities belongs
    return found


SKIPPED: Counter[str] = Counter()
"""What the oracle had no answer for, by its reason."""
LOOKED: Counter[str] = Counter()
"""States that were compared, by what is special about them."""


def by_definition(meaning: Any, state: Values) -> Values:
    """Return accelerations, under the names that derivatives of states have here, and outputs."""
    found: Values = {}
    for name, x in meaning.accelerations(state).items():
        found[_derivative(name)] = float(x)
    return found | {k: float(v) for k, v in meaning.outputs(state).items()}


def _derivative(name: str) -> str:
    """Turn ``der(q, 2)`` into ``d der(q)``, ``der(x)`` into ``d x``."""
    if ", 2)" in name:
        return "d " + name.replace(", 2)", ")")
    return f"d {name[4:-1]}"


def undone(
    base: Compiled, seed: int, states: int = 2, ignored: tuple[str, ...] = ()
) -> list[tuple[str, str]]:
    """List (what kind of value, how it differs) at the start and at random states on the constraints."""
    where, state = "start", dict[str, Any]()
    try:
        meaning = Meaning(base.model.compilation.flat, experiment="")
        rng = np.random.default_rng(seed)
        for where, state in looks(meaning, rng, states, base.case.begin):
            here = {n: state.get(n, 0.0) for n in base.states} | {"time": state.get("time", 0.0)}
            try:
                here = base.settle(here)
            except NoMotion as reason:
                SKIPPED[f"{where}: {reason}"] += 1
                if str(reason) == "NO_MODE" and _goes_on(meaning, state):
                    return [("no motion", f"refused, goes on by definition\n{where}, at {state}")]
                continue
            LOOKED[where] += 1
            begun, state = state, state | here | base.discretes() | base.released()
            there = by_definition(meaning, state)
            near = [base.everything(shaken(here, rng)) for _ in range(2)]
            wrong = differences(base.everything(here), there, near, ignored, base.relative)
            if wrong and _on_an_edge(meaning, state, there, wrong, rng):
                SKIPPED[f"{where}: on an edge"] += 1
                continue
            if wrong:
                lines = "".join(f"{n}: {x:.12g} compiled, {y:.12g} by definition\n" for n, x, y in wrong[:6])
                return [(kind_of(wrong[0][0]), f"{lines}{where}, at {state}")]
            if where == "start" and (said := _other_start(base, meaning, begun)):
                return [("start", said)]
            if not ignored and (said := unaccounted(base, here)) and not _edges(meaning, state):
                return [("balance", f"{said}{where}, at {state}")]
            if said := misbooked(base, meaning, here, state):
                return [("account", f"{said}{where}, at {state}")]
    except Ambiguous as reason:
        if "closed(" not in base.text:  # by such laws a contact may hold itself, or keep itself open
            return [("no motion", f"goes on, {reason} by definition\n{where}, at {state}")]
        SKIPPED[str(reason)[:60]] += 1
    except (NotCovered, Undetermined) as reason:
        SKIPPED[f"{type(reason).__name__}: {str(reason)[:60]}"] += 1
    except Exception as error:
        if _of_the_oracle(error):
            raise OracleFails(repr(error)[:200]) from error
        raise
    return []


def _goes_on(meaning: Any, state: Values) -> bool:
    """Whether one motion goes on from a state by the definition, where nothing is tied, and no mass is negative."""
    try:
        by_definition(meaning, state)
        masses = np.linalg.eigvalsh(mass_matrix(meaning, state))
    except (NotCovered, Undetermined):
        return False
    return bool(masses.min(initial=0.0) >= 0) and not _edges(meaning, state)


def _other_start(base: Compiled, meaning: Any, state: Values) -> str:
    """Say how the start of a model differs from its start by definition, and, where constraints leave several, from that by steps
    from where it begins."""
    mine = base.start()
    wrong = _off_start(base, mine, state)
    if wrong and base.constrained:
        again = meaning.start(base.case.begin, mine)
        if not _off_start(base, mine, again):
            SKIPPED["start: another of several nearest states"] += 1
            return ""
        if _off_start(base, again, meaning.start(base.case.begin, again)):
            SKIPPED["start: singular"] += 1
            return ""
    return "".join(f"{n}: begins at {x:.12g}, at {y:.12g} by definition\n" for n, x, y in wrong[:6])


def is_nearest(base: Compiled, state: Values) -> bool:
    """Whether a state is one of several that are nearer to the guesses of a model than all around them."""
    if not base.constrained:
        return False
    try:
        found = Meaning(base.model.compilation.flat, experiment="").start(base.case.begin, state)
    except (NotCovered, Undetermined):
        return False
    return not _off_start(base, state, found)


def _off_start(base: Compiled, mine: Values, theirs: Values) -> list[tuple[str, float, float]]:
    there = {n: theirs[n] for n in base.states if n in theirs}
    return differences(mine, turned_alike(mine, there), relative=1e-7)


def turned_alike(mine: Values, theirs: Values) -> Values:
    """Return values with quaternions of the sign that they have in others: a quaternion and its negative are one rotation."""
    found = dict(theirs)
    for stem in {n[:-3] for n in found if n.endswith("[4]") and f"der({n[:-3]})[3]" in found}:
        entries = [f"{stem}[{k}]" for k in (1, 2, 3, 4)]
        if all(n in mine for n in entries) and sum(mine[n] * found[n] for n in entries) < 0:
            found |= {n: -found[n] for n in entries}
    return found


def _on_an_edge(
    meaning: Any,
    state: Values,
    there: Values,
    wrong: list[tuple[str, float, float]],
    rng: np.random.Generator,
    inputs: dict[str, Any] | None = None,
) -> bool:
    """Whether the definition itself jumps next to a state in all that is wrong: both sides are right then."""
    if _edges(meaning, state):
        return True
    near = []
    for _ in range(4):
        near.append(by_definition(_beside(meaning, rng, inputs), shaken(state, rng)))
    return all(any(not abs(n[name] - there[name]) <= 0.1 * abs(x - y) for n in near) for name, x, y in wrong)


def _edges(meaning: Any, state: Values) -> bool:
    """Whether something is decided exactly where it changes; what is tied beside the state, too, as x < x is, never changes,
    unless it bends there for what asks for a force, or is whole but for rounding."""
    tied = _ties(meaning, state)
    if BENDS:
        return True
    rng = np.random.default_rng(len(state))
    always = set(tied)
    for _ in range(2 if tied else 0):
        always &= _ties(_beside(meaning, rng), shaken(state, rng))
    return bool(tied - always)


def _ties(meaning: Any, state: Values) -> set[Any]:
    EDGES.clear()
    BENDS.clear()
    meaning.solved = None
    by_definition(meaning, state)
    return set(EDGES)


def _beside(meaning: Any, rng: np.random.Generator, inputs: dict[str, Any] | None = None) -> Any:
    """Return the definition with parameters a little beside their values."""
    numbers = {k: v for k, v in meaning.parameters.items() if isinstance(v, float)}
    return Meaning(meaning.flat, shaken(numbers, rng), experiment="", inputs=inputs or {})


def _row(solution: Any, names: list[str], k: int) -> Values:
    """Return the state in a row of a motion, with what events have released until then."""
    time = float(solution.time[k])
    state = {n: float(np.ravel(solution[n])[k]) for n in names} | {"time": time}
    switched = [e for e in solution.events if e.kind in ("release", "engage") and e.time <= time]
    return state | {f"held({e.name})": float(e.kind == "engage") for e in switched}


def edges_along(base: Compiled, solution: Any) -> Callable[[float], bool | None]:
    """Return whether a law or an output changes exactly at the row of a time, so that rounding decides for its side."""
    names = [n for n in (*base.states, *(q.name for q in base.problem.discretes)) if n in solution]
    rng = np.random.default_rng(len(solution.time))

    def at(time: float) -> bool | None:
        k = int(np.argmin(np.abs(np.asarray(solution.time) - time)))
        state = _row(solution, names, k)
        moving = {n: state[n] for n in base.states if n in state}
        return edged(base, state) or edged(base, state | shaken(moving, rng))

    return at


def ends_rightly(base: Compiled, solution: Any) -> bool:
    """Whether by the definition, too, a motion that failed cannot go on: it has no accelerations at the end or right behind it, or they
    change by a tenth of their size within a millionth of the time, as next to a singularity, or it is on the way to infinity."""
    names = [n for n in (*base.states, *(q.name for q in base.problem.discretes)) if n in solution]
    end = _row(solution, names, -1)
    try:
        meaning = Meaning(base.model.compilation.flat, experiment="")
        there = _accelerations(meaning, end)
        step = BEFORE * end["time"]
        rates = {n: end[f"der({n})"] for n in meaning.coordinates if f"der({n})" in end}
        rates |= {n.removeprefix("d "): x for n, x in there.items()} | {"time": 1.0}
        first, last = (
            max((abs(x) for n, x in _row(solution, names, k).items() if n.startswith("der(")), default=0.0)
            for k in (0, -1)
        )
        if last > ENDLESS * max(first, 1.0):
            return True
        before, behind = (
            _accelerations(meaning, {n: x + way * step * rates.get(n, 0.0) for n, x in end.items()})
            for way in (-1, 1)
        )
        if not np.all(np.isfinite([*there.values(), *behind.values()])):
            return True
        changed = max((abs(x - before[n]) for n, x in there.items()), default=0.0)
        return changed > 0.1 * max(map(abs, there.values()), default=0.0)
    except NotCovered:
        return False
    except Undetermined:
        return True
    except Exception as error:
        if _of_the_oracle(error):
            raise OracleFails(repr(error)[:200]) from error
        raise


ENDLESS = 1e5
"""How many times the velocities at its start a motion reaches that is on the way to infinity."""
BEFORE = 1e-6
"""How long before its end a failed motion is looked at, as a share of it."""


def _accelerations(meaning: Any, state: Values) -> Values:
    meaning.solved = None
    return {_derivative(n): float(x) for n, x in meaning.accelerations(state).items()}


def edged(base: Compiled, state: Values) -> bool | None:
    """Whether a law of a model changes exactly at a state, so that twins may go on by either of its sides; None where the definition
    cannot tell."""
    try:
        found = _edges(Meaning(base.model.compilation.flat, experiment=""), base.discretes() | state)
    except (NotCovered, Undetermined):
        return None
    SKIPPED["a twin on an edge"] += found
    return found


def _of_the_oracle(error: BaseException) -> bool:
    """Whether an error was raised inside of the oracle."""
    where = error.__traceback__
    files = []
    while where is not None:
        files.append(where.tb_frame.f_code.co_filename)
        where = where.tb_next
    return any("/oracle/" in f for f in files)


def kind_of(name: str) -> str:
    """Name the kind of a value."""
    if name.startswith("d "):
        return "acceleration"
    return "energy" if name.startswith("energy.") else "output"


UNTIL = 0.41
"""Seconds of a motion by definition, which is slow; no multiple of the periods that clocks have."""
MOST = 30
"""Events in it; a motion of more may be one of bounces that pile up."""
SECONDS = 20.0
"""Of processor time that it may take."""
SHARP = re.compile(r"\b(exp|tanh|sinh|cosh|atan|table)\(")
"""Formulas that may be narrow, which steps of the definition must not pass over either."""


def moved(base: Compiled, solution: Any, sizes: Collection[str] = ()) -> list[tuple[str, str]]:
    """List how the end of a run, of the length ``UNTIL``, differs from the motion by definition from the same start.

    ``sizes``: states far from one, for which the integrator of the definition is too coarse.
    """
    events = [float(e.time) for e in solution.events]
    begin = base.case.begin
    until = begin + UNTIL
    if any(until - t < 1e-3 for t in events) or len(events) > MOST:
        return []
    try:
        meaning = Meaning(base.model.compilation.flat, experiment="")
        told = {n: float(np.ravel(solution[n])[0]) for n in base.states if n in solution}
        # what is told may begin later than the motion
        first = told if solution.time[0] == begin else base.start()
        start = {n: first.get(n, float(v)) for n, v in meaning.start(begin).items()}
        with limited(SECONDS):
            motion = meaning.motion(
                until,
                state=start | {"time": begin},
                tolerance=1e-8,
                scan=UNTIL / 20,
                longest=UNTIL / 20 if SHARP.search(base.text) else None,
            )
        if motion.outcome == "terminated":
            return _ended(solution, float(motion.states[-1]["time"]))
        if motion.outcome != "completed":
            return []
        end = {n: float(v) for n, v in motion.states[-1].items() if n in solution and n != "time"}
        here = {n: float(np.ravel(solution[n])[-1]) for n in end}
        wrong = [w for w in differences(here, end, relative=1e-5) if w[0] not in sizes]
        wrong = [w for w in wrong if not w[0].startswith(("energy.", "creep("))]
        if wrong:
            lines = "".join(f"{n}: {x:.9g} run, {y:.9g} by definition\n" for n, x, y in wrong[:6])
            mine = [(float(e.time), e.kind) for e in solution.events]
            theirs = [(float(e.time), e.kind) for e in motion.events]
            return [("events" if mine or theirs else "motion", f"{lines}{mine} run, {theirs} by definition")]
    except TooLong:
        SKIPPED["a motion by definition that takes too long"] += 1
    except (NotCovered, Undetermined) as reason:
        SKIPPED[f"{type(reason).__name__}: {str(reason)[:60]}"] += 1
    except Exception as error:
        if _of_the_oracle(error):
            raise OracleFails(repr(error)[:200]) from error
        raise
    return []


def _ended(solution: Any, end: float) -> list[tuple[str, str]]:
    """Tell whether a run ends where an event ends the motion by definition."""
    here = float(solution.time[-1])
    if solution.outcome is Outcome.TERMINATED and abs(here - end) < 1e-6:
        return []
    return [("end", f"{solution.outcome.value} at {here:.9g}, terminated at {end:.9g} by definition")]


def before_a_hit(base: Compiled, seed: int) -> Values:
    """Return initial values by which a contact is about to touch."""
    try:
        meaning = Meaning(base.model.compilation.flat, experiment="")
        state = approaching(meaning, np.random.default_rng(seed))
    except (NotCovered, Undetermined):
        return {}
    moving = (*meaning.coordinates, *meaning.rates)
    return {n: state[n] for n in moving if n in state} if state is not None else {}


def begins_otherwise(base: Compiled, solution: Any, inputs: dict[str, Any]) -> str:
    """Say how a run whose inputs are tables begins other than by definition, where nothing constrains it or acts at its start."""
    if base.constrained or "initial()" in base.text:
        return ""
    try:
        meaning = Meaning(base.model.compilation.flat, experiment="", inputs=inputs)
        there = {n: float(v) for n, v in meaning.start(float(solution.time[0])).items()}
    except (NotCovered, Undetermined) as reason:
        SKIPPED[f"{type(reason).__name__}: {str(reason)[:60]}"] += 1
        return ""
    here = {n: float(solution[n][0]) for n in base.states if n in solution}
    return "".join(f"{n}: {x:.12g} run, {y:.12g} by definition\n" for n, x, y in differences(here, there))


def along(
    base: Compiled, solution: Any, ignored: tuple[str, ...] = (), inputs: dict[str, Any] | None = None
) -> list[tuple[str, str]]:
    """List how outputs along a run differ from the definition at the same states; rows next to events are left out."""
    try:
        meaning = Meaning(base.model.compilation.flat, experiment="", inputs=inputs or {})
        rng = np.random.default_rng(len(solution.time))
        events = [float(e.time) for e in solution.events]
        names = [n for n in (*base.states, *(q.name for q in base.problem.discretes)) if n in solution]
        twice = {float(t) for t, u in zip(solution.time[1:], solution.time[:-1], strict=True) if t == u}
        for k, t in enumerate(solution.time):
            if k % 3 or any(abs(t - e) < 1e-6 for e in events) or t in twice:
                continue
            state = _row(solution, names, k)
            there = meaning.outputs(state)
            here = {n: float(solution[n][k]) for n in there if n in solution and np.ndim(solution[n]) == 1}
            known = max(1e-6, base.relative)
            wrong = differences(here, {n: float(v) for n, v in there.items()}, relative=known)
            wrong = [w for w in wrong if w[0] not in ("energy.supplied", "energy.dissipated", *ignored)]
            if wrong and _on_an_edge(meaning, state, there, wrong, rng, inputs):
                SKIPPED["a row of a motion on an edge"] += 1
                continue
            if wrong:
                lines = "".join(f"{n}: {x:.12g} run, {y:.12g} by definition\n" for n, x, y in wrong[:6])
                return [(kind_of(wrong[0][0]), lines + f"at {state}")]
    except (NotCovered, Undetermined) as reason:
        SKIPPED[f"{type(reason).__name__}: {str(reason)[:60]}"] += 1
    except Exception as error:
        if _of_the_oracle(error):
            raise OracleFails(repr(error)[:200]) from error
        raise
    return []
