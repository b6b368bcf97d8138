"""The state of a model in the coordinates of its twin.

Joints span a tree in the order of declaration, so that another joint may close a loop where statements stand elsewhere: its
coordinates are not states then, and what is guessed for them counts no more. Assembly weighs guesses by the mean of the
parameters that are lengths, and a twin may have others. Such twins begin elsewhere, and move alike from the same state.
"""

from __future__ import annotations

import math

from mechc.runtime.start.facts import start_facts
from mechc.runtime.start.free_state import characteristic_length
from random_models.compiled import Compiled, Refused, Values, compiled, differences
from random_models.twins import Twin, renamed_name


def assembled_alike(twin: Twin, base: Compiled, other: Compiled) -> bool:
    """Whether both find their start in the same coordinates, by the same weights."""
    mine = {renamed_name(twin, n) for n in base.states if not _account(n)}
    return mine == {n for n in other.states if not _account(n)} and lengths_alike(base, other)


def lengths_alike(base: Compiled, other: Compiled) -> bool:
    """Whether lengths are moved by shares of one size: where fewer lengths are used, it is another."""
    facts = [(c, start_facts(c.problem)) for c in (base, other)]
    lengths = [characteristic_length(f, c.case.p) for c, f in facts if f is not None]
    return len(lengths) < 2 or math.isclose(*lengths, rel_tol=1e-12)


def begins_alike(twin: Twin, base: Compiled, other: Compiled) -> bool:
    """Whether a twin begins at the start of the model; where it must, others say so."""
    if assembled_alike(twin, base, other):
        return True
    there = carried(twin, base, other, base.start())
    return there is not None and not differences(there, other.start())


CLOSING = {"E0517", "E0522"}
"""What is said of coordinates of joints that close loops."""


def closes_elsewhere(refused: Refused, base: Compiled) -> bool:
    """Whether another joint closes a loop of a twin, so that coordinates that the model asks for have no value there."""
    return base.constrained and set(refused.codes) <= CLOSING


def momenta_differ(twin: Twin, base: Compiled, other: Compiled) -> bool:
    """Whether a model asks for momenta, each of which is of what its coordinate carries while the others stay, and others stay
    in a twin whose loops other joints close."""
    mine = {renamed_name(twin, n) for n in base.states if not _account(n)}
    return (
        base.constrained and "momentum(" in base.text and mine != {n for n in other.states if not _account(n)}
    )


def carried(twin: Twin, base: Compiled, other: Compiled, state: Values) -> Values | None:
    """Return a state of the model as one of the twin; None where it cannot be told."""
    there = {renamed_name(twin, n): v for n, v in state.items()}
    missing = [n for n in other.states if n not in there and not _account(n)]
    if missing:
        known = {renamed_name(twin, v.name): v.name for v in base.model.compilation.flat.variables}
        told = _told(base, [_original(n, known) for n in missing], state)
        if told is None:
            return None
        there |= zip(missing, told, strict=True)
    there = {n: there.get(n, 0.0) for n in (*other.states, "time") if n in there or _account(n)}
    return there | _integrals(base, other, state, there)


def _integrals(base: Compiled, other: Compiled, state: Values, there: Values) -> Values:
    """Return the integrals over time of a twin, whose numbers are those of the text: they are told by what they add up."""
    names = [n for n in base.states if n.startswith("integral[")]
    if len(names) < 2:
        return {}
    level = dict.fromkeys(names, state[names[0]])
    adds = base.rhs(state | level)
    mine = sorted((adds[f"d {n}"], state[n]) for n in names)
    adds = other.rhs(there | level)
    theirs = sorted((adds[f"d {n}"], n) for n in names)
    return {n: x for (_, x), (_, n) in zip(mine, theirs, strict=True)}


def hides_its_start(twin: Twin, base: Compiled, other: Compiled, there: Values) -> bool:
    """Whether coordinates of the model that are none of the twin begin elsewhere there, as guesses of joints that close loops count for
    nothing: what turns freely between two joints begins by those of one of them."""
    mine = {renamed_name(twin, n): v for n, v in base.start().items() if not _account(n)}
    mine = {n: v for n, v in mine.items() if n not in there}
    told = _told(other, [*mine], there) if mine else []
    if told is None:  # no guess of theirs may count then
        return any(v != n.endswith(".orientation[1]") for n, v in mine.items())
    return bool(differences(mine, dict(zip(mine, told, strict=True))))


def _original(name: str, known: dict[str, str]) -> str:
    """Return what the model calls a coordinate of its twin, an element or a rate of it."""
    head = "der(" if name.startswith("der(") else ""
    rest = name.removeprefix(head)
    own = next((n for n in known if rest.startswith(n) and rest[len(n) :][:1] in ("", "[", ")")), rest)
    return f"{head}{known.get(own, own)}{rest.removeprefix(own)}"


def _told(base: Compiled, names: list[str], state: Values) -> list[float] | None:
    """Return coordinates and rates of joints that close loops in the model, which it computes for outputs."""
    lines = [f"  output carried{k} = {name};\n" for k, name in enumerate(names)]
    head, end, tail = base.text.rpartition("end M;")
    try:
        asked = compiled(head + "".join(lines) + end + tail, quick=base.problem.quick)
    except Refused:
        return None
    asked.z = base.z
    values = asked.outputs(state)
    return [values[f"carried{k}"] for k in range(len(names))]


def _account(name: str) -> bool:
    """Whether a state only adds up what energies do."""
    return name.startswith("energy.")
