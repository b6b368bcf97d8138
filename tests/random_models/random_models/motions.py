"""Short motions: by two methods, and of twins, which must agree within what both claim, events included."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

import mechc
from mechc.runtime.methods import KERNEL_METHODS, SOLVING_CONTACTS
from random_models.accounts import misbooked_at_events
from random_models.compiled import Refused, Values
from random_models.twins import Twin, renamed_name

TOLERANCE = 1e-9
FACTOR = 100.0
"""Estimated errors are of the end of the run to a factor of ten; what comes off twice that far is no rounding."""
FLOOR = 1e-6
"""Relative; a thousand times the tolerance of a step."""
STEP = 0.001
"""Seconds, of methods whose steps are of one size."""
FIXED = frozenset(KERNEL_METHODS) - {"auto", "dop853", "radau5", "taylor"}
Edged = Callable[[float], bool | None]
"""Whether rounding decides for a side of a law or an output at a time."""


def nowhere(_: float) -> bool:
    """Say that nothing is on an edge."""
    return False


def run(
    text: str,
    method: str = "auto",
    stop: float | None = None,
    inputs: Mapping[str, Path] | None = None,
    values: Mapping[str, float] | None = None,
    begin: float = 0.0,
    step: float = STEP,
) -> Any:
    """Run a model on a grid of eleven times, with the last one among them if it begins at ``begin``."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = mechc.loads(text)
            until = stop if stop is not None else 1.0
            return model.simulate(
                stop=until,
                every=(until - begin) / 10,
                tolerance=TOLERANCE,
                method=method,
                step=step if method in FIXED else None,
                inputs=inputs or {},
                set=dict(values or {}),
            )
    except mechc.CompileError as error:
        wrong = [d for d in error.diagnostics if d.code.startswith("E")]
        raise Refused(tuple(d.code for d in wrong), mechc.render(wrong)) from None
    except (mechc.SimulationError, mechc.UsageMistake) as error:
        raise Refused(("run",), str(error)) from None


def columns(solution: Any) -> dict[str, Any]:
    """Return what a solution holds, by name."""
    return {name: np.asarray(solution[name]) for name in solution if name != "time"}


def errors(solution: Any) -> Values:
    """Return the estimated error of each state, relative to its nominal value and size; of one that failed, nothing."""
    error = solution.accuracy.error
    return {} if error is None else {k: float(v) for k, v in error.by_state.items()}


PILED = 1e-4
"""Seconds before a rest whose bounces are not counted: where they pile up, rounding decides for the last of them."""


OF_CONTACTS = frozenset({"impact", "rest", "lift-off", "slip", "stick"})
"""Kinds of events that methods without events of contacts do not have (docs/events.md)."""


def _kinds(solution: Any) -> list[str]:
    """List the kinds of the events of a motion; a twin may state as its start what the other does by ``when initial()``."""
    rests = [(e.name, float(e.time)) for e in solution.events if e.kind == "rest"]
    piled = [
        e.kind == "impact" and any(e.name == n and 0 <= t - float(e.time) < PILED for n, t in rests)
        for e in solution.events
    ]
    first = [e.kind == "when" and e.time == solution.time[0] for e in solution.events]
    return sorted(
        e.kind for e, *left_out in zip(solution.events, piled, first, strict=True) if not any(left_out)
    )


def difference(
    a: Any, b: Any, twin: Twin | None = None, edged: Edged = nowhere, sizes: Collection[str] = ()
) -> str:
    """Say how two motions differ, or nothing; each may claim its own estimated error. Outputs may jump where ``edged``.

    ``sizes``: states that are compared over their own size, others over one and theirs.
    """
    if str(a.outcome) != str(b.outcome):
        return f"outcome {a.outcome} ({a.message}), then {b.outcome} ({b.message})"
    if str(a.outcome) == "Outcome.FAILED":
        return ""
    kinds_a, kinds_b = _kinds(a), _kinds(b)
    stepped = not SOLVING_CONTACTS.isdisjoint({a.statistics.method, b.statistics.method})
    if stepped:
        kinds_a, kinds_b = ([k for k in kinds if k not in OF_CONTACTS] for kinds in (kinds_a, kinds_b))
    ca, cb = columns(a), columns(b)
    estimate = [v for v in (*errors(a).values(), *errors(b).values()) if np.isfinite(v)]
    allowed = FACTOR * max(estimate, default=0.0) + FLOOR
    if allowed > 1e-2:
        return ""
    if kinds_a != kinds_b:
        return f"events {kinds_a}, then {kinds_b}"
    ours, theirs = _single(a.time), _single(b.time)
    common = [(ours[t], theirs[t]) for t in ours if t in theirs]
    near_jump = [float(e.time) for e in a.events]
    near_jump += [float(t) for s in (a, b) for t, u in zip(s.time[1:], s.time[:-1], strict=True) if t == u]
    near = STEP if stepped else 1e-4
    common = [(k, n) for k, n in common if all(abs(a.time[k] - j) > near for j in near_jump)]
    mine, there = [k for k, _ in common], [n for _, n in common]
    ignored = twin.ignored if twin is not None else ()
    for name, x in ca.items():
        other = renamed_name(twin, name) if twin is not None else name
        if (
            other not in cb or name in ignored or name.startswith("integral[")
        ):  # numbered in the order of the text
            continue
        x, y = x[mine], cb[other][there]
        if x.shape != y.shape:
            return f"{name}: shape {x.shape}, then {y.shape}"
        scale = (0 if name in sizes else 1) + np.max(np.abs(x[np.isfinite(x)]), initial=0.0)
        off = np.where(np.isfinite(x - y), np.abs(x - y), 0.0)
        far = off > allowed * scale * (100 if asked(name) else 1)
        rows = list(np.flatnonzero(far.reshape(len(far), -1).any(axis=1))) if far.size else []
        if asked(name):
            rows = [k for k in rows if not edged(float(a.time[mine[k]]))]
        if len(rows):
            k = int(np.argmax(off))
            return f"{name}: {np.ravel(x)[k]:.9g}, then {np.ravel(y)[k]:.9g}, allowed {allowed * scale:.2g}"
    return ""


_BENDS = re.compile(r"\b(table|abs|min|max|clamp|deadzone|mod|floor|ceil|sign)\(")


def by_another_method(text: str, first: Any, random: Random, sharp: bool = False) -> str:
    """Say how a motion differs from those by other methods that take the model and come to an end, or nothing.

    ``sharp``: steps of one size promise nothing. Of every model that is separable one is ``verlet``, of every other model one that keeps momenta and that of Taylor series; else,
    and where none of them takes it, any.
    """
    every = [m for m in KERNEL_METHODS if m not in ("auto", "radau5", first.statistics.method)]
    rare = [[m for m in every if part in KERNEL_METHODS[m].parts] for part in ("momenta", "series")]
    groups = [random.sample(group, len(group)) for group in rare] if random.random() < 0.5 else []
    groups.append(["verlet"])
    ran = [by for group in groups if (by := _by_one_of(text, group))]
    if not ran and (by := _by_one_of(text, random.sample(every, 5))):
        ran = [by]
    for method, other in ran:
        untold = method in FIXED and other.accuracy.error is None  # its companion failed: the run says that
        said = "" if (sharp and method in FIXED) or untold else difference(first, other)
        if not said and not (
            method in FIXED and (sharp or untold or _BENDS.search(text))
        ):  # what is narrow, or a kink, inside of fixed steps: companions tell of it, and it has no order
            said = loose(first, other, method) or slow(text, first, method)
        if said:
            return f"{method}: {said}"
    return ""


def _by_one_of(text: str, methods: Sequence[str]) -> tuple[str, Any] | None:
    """Return the first of some methods that takes a model and comes to an end, with the motion."""
    for method in methods:
        try:
            solution = run(text, method)
        except Refused:
            continue
        if str(solution.outcome) != "Outcome.FAILED":
            return method, solution
    return None


LOOSE = 100.0
"""By how much more a method may be off than its order, or the tolerance of each step, makes it: they count themselves to a factor of ten."""


def loose(first: Any, other: Any, method: str) -> str:
    """Say that a method estimates a far larger error than it may have.

    One that chooses its steps keeps to the tolerance that the first has. One of order p whose steps are h leaves (h/H)^p, where
    steps of H are enough for another one of high order; what errors grow by, those of the first show.
    """
    known, told = (max(errors(x).values(), default=0.0) for x in (first, other))
    left = TOLERANCE
    if method in FIXED:
        if first.statistics.method != "dop853":  # a stiff motion tells nothing of the others
            return ""
        order = int(method[-1]) if method[-1].isdigit() else 2
        duration = float(first.time[-1]) - min(0.0, float(first.time[0]))
        left = max(left, (STEP * first.statistics.steps / duration) ** order)
    if not told > LOOSE * left * max(1.0, known / TOLERANCE):
        return ""
    return f"an estimated error of {told:.2g}, for {known:.2g}"


COARSE, HIGH = 0.01, 6
"""Seconds, of two steps the shorter, at which the order of a method shows; and the order from which it shows late."""


def slow(text: str, first: Any, method: str) -> str:
    """Say that a method of order p with steps of one size loses less than 2^(p - 1/2) of an error by half the step, or of high order
    2^(p - 1).

    Looked at is what is off by far more than the first motion may be, and by little enough that the order shows.
    """
    if method not in FIXED or first.events or first.statistics.method != "dop853":
        return ""
    order = int(method[-1]) if method[-1].isdigit() else 2
    try:
        two = [columns(run(text, method, step=h)) for h in (2 * COARSE, COARSE)]
    except Refused:
        return ""
    for name, x in columns(first).items():
        if (
            asked(name)
            or any(name not in c or c[name].shape != x.shape for c in two)
            or not np.isfinite(x).all()
        ):
            continue
        scale = 1 + np.max(np.abs(x), initial=0.0)
        coarse, fine = (float(np.max(np.abs(c[name] - x), initial=0.0)) / scale for c in two)
        if 30 * FLOOR < coarse < 1e-2 and fine > coarse / 2 ** (order - (0.5 if order < HIGH else 1)):
            return f"{name} is off by {coarse:.2g}, and with half the step by {fine:.2g}"
    return ""


def _single(times: Any) -> dict[float, int]:
    """Return the rows of the times that stand once."""
    rounded = [round(float(t), 12) for t in times]
    return {t: k for k, t in enumerate(rounded) if rounded.count(t) == 1}


def asked(name: str) -> bool:
    """Whether a name is an output, whose derivative by the states is not known here."""
    return name.startswith("o") or ".o" in name


def unbalanced(solution: Any) -> str:
    """Say how far energy is off, where that is more than the motion can be."""
    c = columns(solution)
    if str(solution.outcome) == "Outcome.FAILED" or not solution.problem.energy_balance:
        return ""  # an energy that depends on an input has no balance
    total = c["energy.total"] - c.get("energy.supplied", 0.0) + c.get("energy.dissipated", 0.0)
    if not np.all(np.isfinite(total)):
        return ""
    turned = np.max(np.abs(c["energy.kinetic"])) + np.max(np.abs(c["energy.potential"]))
    turned += sum(np.max(np.abs(c[n])) for n in ("energy.supplied", "energy.dissipated") if n in c)
    drift = float(np.max(np.abs(total - total[0])))
    estimate = max((v for v in errors(solution).values() if np.isfinite(v)), default=0.0)
    allowed = (FACTOR * estimate + FLOOR) * (1 + turned)
    return (
        f"energy is off by {drift:.3g} J of {turned:.3g} J, allowed {allowed:.2g}" if drift > allowed else ""
    )


def doubts(solution: Any) -> list[tuple[str, str]]:
    """List (what, in words) that a run tells against itself: energies that do not add up, any of its own checks."""
    said = unbalanced(solution)
    found = [("balance", said)] if said else []
    if said := misbooked_at_events(solution):
        found.append(("booked", said))
    if str(solution.outcome) == "Outcome.DOUBTFUL":
        found.append(("doubtful", solution.message))
    return found


def ended(solution: Any) -> bool:
    """Whether a run reached its end, well enough known to be compared there."""
    there = str(solution.outcome) in ("Outcome.COMPLETED", "Outcome.DOUBTFUL")
    return there and max(errors(solution).values(), default=0.0) <= 1e-7
