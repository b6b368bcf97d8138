"""The twins that mechc makes itself (``mechc stress``): the same mechanics said otherwise, at states and along motions."""

from __future__ import annotations

import warnings
from random import Random

import numpy as np

import mechc
from mechc.compiler.metamorphic.table import TWINS
from mechc.compiler.metamorphic.twin import NotApplicable, Twin
from mechc.lang.units import parse_unit
from mechc.measurement.metamorphic import Base, beside, compare, run_twin, twin_of
from mechc.requests.request import asked as question
from mechc.runtime.outcome import Outcome
from mechc.runtime.studies.kinds.motion import Simulate
from mechc.session import answered
from random_models.carried import CLOSING
from random_models.compiled import Compiled, NoMotion, Refused, differences, prepared, shaken
from random_models.definition import edges_along
from random_models.motions import Edged, asked

AT_STATES = tuple(
    name
    for name in TWINS
    if name
    not in (
        "joint as closure",
        "other coordinates",
        "nominal sizes",
        "powers written out",
        "time reversed",
        "times as a state",
    )
)
"""Twins with the states of the model; the others have other ones."""
MOST = 3
"""Motions of twins of one model."""


def at_states(base: Compiled, seed: int) -> list[tuple[str, str]] | None:
    """Compare a model with one of its twins at random states."""
    random = Random(seed)
    for name in random.sample(AT_STATES, len(AT_STATES)):
        try:
            twin = TWINS[name](base.model.compilation.flat, None, random)
        except NotApplicable:
            continue
        return [(name, said) for said in _compared(base, twin, seed)]
    return None


def _compared(base: Compiled, twin: Twin, seed: int) -> list[str]:
    try:
        other = prepared(lambda: base.model.of(twin.model, {}), None, base.text, quick=base.problem.quick)
    except Refused as refused:
        return [f"refused {','.join(refused.codes)}: {refused.text}"]
    sizes = {q.name: _size(twin, q.unit) for q in (*base.problem.states, *base.problem.outputs)}
    second = _size(twin, base.problem.time.unit)
    sizes |= {f"d {n}": x / second for n, x in sizes.items()} | {"time": second}
    apart = [n for n in sizes if not twin.means(n.removeprefix("d ")) or n.startswith(("error(", "d error("))]
    rng = np.random.default_rng(seed)
    for state in base.random_states(rng, 2):
        there = {n: x * sizes.get(n, 1.0) for n, x in state.items() if n in other.states or n == "time"}
        there = dict.fromkeys(other.states, 0.0) | there  # accounts of energies
        try:
            state, there = base.settle(state), other.settle(there)
        except NoMotion:
            continue
        mine = _booked(base.everything(state), apart)
        near = [_booked(base.everything(shaken(state, rng)), apart) for _ in range(2)]
        theirs = _booked({n: x / sizes.get(n, 1.0) for n, x in other.everything(there).items()}, apart)
        wrong = differences(mine, theirs, near, apart, base.relative)
        if wrong:
            return ["".join(f"{n}: {x:.12g}, twin {y:.12g}\n" for n, x, y in wrong[:6]) + base.text]
    return []


_ACCOUNTS = {"d energy.supplied": 1.0, "d energy.dissipated": -1.0}


def _booked(values: dict[str, float], apart: list[str]) -> dict[str, float]:
    """Return values with the power of both accounts as one: on which of them a force counts, the text of a model decides."""
    if _ACCOUNTS.keys().isdisjoint(values) or not _ACCOUNTS.keys().isdisjoint(apart):
        return values
    booked = sum(sign * values.get(name, 0.0) for name, sign in _ACCOUNTS.items())
    return {n: x for n, x in values.items() if n not in _ACCOUNTS} | {"d energy.booked": booked}


def _size(twin: Twin, unit: str) -> float:
    return twin.factor(parse_unit(unit or "1").dimension)


def along_motions(base: Compiled, seed: int) -> list[tuple[str, str]] | None:
    """Compare the motion of a model with those of some of its twins, within what both runs claim."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        request = question(Simulate, {"stop": 0.5})
        try:
            ran, solution = answered(base.model, request)
        except (mechc.SimulationError, mechc.UsageMistake):
            return None
        if solution.accuracy.error is None or solution.outcome is not Outcome.COMPLETED:  # type: ignore[attr-defined]
            return None
        stated = Base.of(ran, request, solution)  # type: ignore[arg-type]
        random = Random(seed)
        found, done = [], 0
        for name in random.sample(list(TWINS), len(TWINS)):
            said = _moved(name, stated, edges_along(base, solution))
            if said is not None:
                done += 1
                found += [(name, said + base.text)] if said else []
            if done == MOST:
                break
    return found


def _moved(name: str, base: Base, edged: Edged) -> str | None:
    """Say how a twin moves otherwise, nothing if it does not, None where there is none that tells."""
    try:
        twin = twin_of(name, base)
        base = beside(twin, base)
        made = run_twin(twin, base)
    except NotApplicable:
        return None
    except mechc.CompileError as error:
        told = {d.code for d in error.diagnostics if d.code.startswith("E")} <= CLOSING
        return None if told else f"refused: {error}\n"
    except mechc.SimulationError:
        return None
    if made.solution.outcome is not Outcome.COMPLETED or made.solution.accuracy.error is None:
        return None
    found = compare(base, twin, made)
    if found is None or found.same or found.allowed > 1e-2:
        return ""
    if asked(found.name) and edged(found.at):
        return ""
    return f"{found.name} differs by {found.difference:.3g} at t = {found.at:.6g}, {found.allowed:.3g} is allowed\n"
