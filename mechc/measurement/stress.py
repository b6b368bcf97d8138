"""Run a model under extremes, and find out whether any answer is wrong and does not say so.

A run is compared with the same model in higher precision; where that cannot be had, with another method. Its claim is
the estimated error of its own report.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct, to_builtins

from ..answering import answered, plan
from ..api import Model, load
from ..asking.given_values import Given, UsageMistake
from ..asking.question import Asked, asked
from ..runtime.native.kernel import load_kernel
from ..runtime.outcome import Outcome, SimulationError
from ..runtime.reference.high_precision import ReferenceFailed
from ..runtime.studies.kinds.motion import Simulate
from ..solution import Solution
from ..watchdog import Crashed, Hung, Watchdog
from .extremes import Extreme, extremes
from .truth import ROUNDING, compile_for_reference, true_errors

UNDERSTATED = 100.0
"""A true error that is larger than the claimed one by more than this is a silent failure."""
ROUGH = 0.1
"""From this error on, claimed or true, a run is not right, whatever it says of it."""
OPINION = 1e-10
"""Tolerance of the other method where there is no reference."""
MARGIN = 20.0
"""Seconds beyond the limits of a run after which its process counts as hung; compiling is among them."""

WORDS = {
    "right": "right within its claim",
    "rough": "inaccurate, says so",
    "refused": "refused",
    "doubtful": "doubtful, and says so",
    "open": "not checked",
    "long": "stopped, too long",
    "wrong": "WRONG SILENTLY",
    "hung": "HUNG",
    "crashed": "CRASHED",
}
BAD = ("wrong", "hung", "crashed")


class Row(Struct, frozen=True):
    """One run. ``kind``: a key of WORDS; ``error`` the true one, ``claim`` what the run reports, both the largest over the
    states relative to nominal + |value|; ``against`` what it was compared with."""

    group: str
    text: str
    kind: str
    method: str = ""
    error: float | None = None
    claim: float | None = None
    against: str = ""
    seconds: float = 0.0
    steps: int = 0
    reason: str = ""


class Stress(Struct, frozen=True):
    """All runs of one model."""

    model: str
    experiment: str
    rows: tuple[Row, ...]
    left_out: tuple[str, ...]

    @property
    def silent(self) -> bool:
        """Say whether a run was wrong without saying so, hung or crashed."""
        return any(row.kind in BAD for row in self.rows)

    def summary(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {**to_builtins(self), "silent": self.silent}


class Subject(Struct, frozen=True):
    """What is put under stress, in words that another process understands."""

    file: str
    model: str | None
    settings: Mapping[str, Given]
    experiment: str | None
    seconds: float

    def load(self) -> Model:
        loaded = load(Path(self.file), model=self.model, set=self.settings)
        return loaded.for_experiment(self.experiment)


class _OutOfTime(Exception):
    """A run takes longer than it may."""


class _Limit:
    """Progress of runs that ends each of them after some seconds."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.begin()

    def begin(self) -> None:
        self.begun = time.perf_counter()

    def __call__(self, done: float) -> None:
        if time.perf_counter() - self.begun > self.seconds:
            raise _OutOfTime(f"{done:.0%} of the work in {self.seconds:g} s")


def stress(subject: Subject, *, full: bool = False, progress: Callable[[Row], None] | None = None) -> Stress:
    """Run all extremes, each under a watchdog. Raises CompileError, SimulationError, BuildError, CompilerMissing."""
    model = subject.load()
    stated = plan(model, asked(Simulate, {"experiment": subject.experiment}))
    made = extremes(stated, adaptive_methods(), full=full)
    _compile(model)
    rows: list[Row] = []
    limit = 4 * subject.seconds + MARGIN
    with Watchdog(worker, subject) as dog:
        for extreme in made.runs:
            reply: Row | Crashed | Hung = dog.ask(extreme, limit)
            match reply:
                case Crashed(how):
                    reply = Row(extreme.group, extreme.text, "crashed", reason=how)
                case Hung(seconds):
                    reply = Row(extreme.group, extreme.text, "hung", reason=f"no answer in {seconds:g} s")
            rows.append(reply)
            if progress is not None:
                progress(reply)
    return Stress(model.name, stated.case.experiment, tuple(rows), made.left_out)


def _compile(model: Model) -> None:
    """Fill the cache with what the runs need, so that no limit of theirs is spent on it."""
    model.problem("c", method="radau5")
    with suppress(ReferenceFailed):
        compile_for_reference(model)


def adaptive_methods() -> list[str]:
    """Return the methods of the kernel that choose their steps themselves."""
    kernel = load_kernel()
    count = range(kernel.mech_method_count())
    return [kernel.mech_method_name(k).decode() for k in count if kernel.mech_method_is_adaptive(k)]


def worker(subject: Subject) -> Callable[[Extreme], Row]:
    """Return what makes and judges one run, in a process of its own."""
    model = subject.load()
    return lambda extreme: _judged(model, subject, extreme)


def _judged(model: Model, subject: Subject, extreme: Extreme) -> Row:
    changed = model.with_values(extreme.values)
    limit = _Limit(subject.seconds)
    around = {"experiment": subject.experiment, "progress": limit}
    request = asked(Simulate, {**around, **extreme.options})
    try:
        solution = _run(changed, request)
    except (SimulationError, UsageMistake) as refused:
        return Row(extreme.group, extreme.text, "refused", reason=str(refused))
    except _OutOfTime as late:
        return Row(extreme.group, extreme.text, "long", reason=str(late))
    kind, error, against, reason = _checked(changed, subject, request, solution)
    estimate, done = solution.accuracy.error, solution.statistics
    claim = estimate.largest if estimate else None
    return Row(
        extreme.group,
        extreme.text,
        kind,
        done.method,
        error,
        claim,
        against,
        done.run_time,
        done.steps,
        reason,
    )


def _run(model: Model, request: Asked) -> Solution:
    solution = answered(model, request)[1]
    assert isinstance(solution, Solution)
    return solution


def _checked(
    model: Model, subject: Subject, request: Asked, solution: Solution
) -> tuple[str, float | None, str, str]:
    """Give the kind of the row, the true error, what told it, and a reason."""
    if solution.outcome is Outcome.FAILED:
        return "refused", None, "", solution.message
    if solution.outcome is Outcome.DOUBTFUL:
        return "doubtful", None, "its own checks", solution.message
    unfinished = [q for q in solution.final() if not np.isfinite(solution[q][-1])]
    estimate = solution.accuracy.error
    if estimate is None:
        return "open", None, "", solution.accuracy.remark
    silent = [q for q in unfinished if not any(f"'{q}'" in remark for remark in solution.remarks)]
    if silent:
        return "wrong", None, "", f"'{silent[0]}' is not a number at the end, and nothing says so"
    why, owed = "", dict(estimate.by_state)
    try:
        truth = true_errors(compile_for_reference(model), plan(model, request), solution, subject.seconds / 2)
        errors, against = truth.by_state, truth.precision
        if truth.horizon < solution.time[-1]:
            why = f"compared up to {truth.horizon:.6g}: beyond, the reference is in doubt"
    except ReferenceFailed as failed:
        why = f"no reference: {failed}"
        try:
            errors, own, against = _opinion(model, request, solution)
        except (SimulationError, _OutOfTime, ReferenceFailed) as none:
            return "open", None, "", f"{why}; no other method either: {none}"
        owed = {name: claim + own[name] for name, claim in owed.items()}
    worst = max(errors, key=lambda n: errors[n] / max(owed[n], ROUNDING))
    largest = max(errors.values())
    if errors[worst] <= UNDERSTATED * max(owed[worst], ROUNDING):
        return "right" if max(largest, estimate.largest) < ROUGH else "rough", largest, against, why
    if errors[worst] <= UNDERSTATED * _conditioning(model, request, solution).get(worst, 0.0):
        return "right", largest, against, "as far as the rounding of its parameters lets it be"
    words = f"the error of {worst} is {errors[worst]:.1e}, {estimate.by_state[worst]:.1e} was claimed"
    return "wrong", largest, against, words


def _other(
    model: Model, request: Asked, solution: Solution, **changes: Any
) -> tuple[Solution, dict[str, float]]:
    """Make a changed run; return it, and how far it ends from this one by state.

    Raises ReferenceFailed where it ends in another way."""
    assert isinstance(request.progress, _Limit)
    request.progress.begin()
    other = _run(model, request.changed(**changes))
    estimate = solution.accuracy.error
    assert estimate is not None
    if other.outcome is not solution.outcome:
        raise ReferenceFailed(f"it ends otherwise: {other.message}")
    return other, {
        name: abs(float(other[name][-1] - solution[name][-1])) / (nominal + abs(float(other[name][-1])))
        for name, nominal in estimate.nominal.items()
    }


def _opinion(
    model: Model, request: Asked, solution: Solution
) -> tuple[dict[str, float], Mapping[str, float], str]:
    """Compare the end with that by another method at a tight tolerance, which claims an error of its own."""
    method = "dop853" if solution.statistics.method == "radau5" else "radau5"
    other, differences = _other(model, request, solution, method=method, tolerance=OPINION)
    estimate = other.accuracy.error
    if estimate is None:
        raise ReferenceFailed(other.accuracy.remark)
    return differences, estimate.by_state, f"{method} at {OPINION:g}"


def _conditioning(model: Model, request: Asked, solution: Solution) -> dict[str, float]:
    """Return how far the end moves if every parameter is changed by a unit in the last place."""
    parameters = model.problem("c").parameters
    values = {q.name: float(solution.parameters[q.name]) for q in parameters if q.name in solution.parameters}
    signs = [1 if k % 2 else -1 for k in range(len(values))]
    moved = {
        name: value * (1 + sign * float(np.finfo(float).eps))
        for (name, value), sign in zip(values.items(), signs, strict=True)
    }
    try:
        return _other(model.with_values(moved), request, solution, estimate_error=False)[1]
    except (SimulationError, UsageMistake, ReferenceFailed, _OutOfTime):
        return {}


def report(made: Stress) -> str:
    """Return the table and what it comes to."""
    title = f"{made.model}{', ' + made.experiment if made.experiment else ''} under stress"
    counts = Counter(row.kind for row in made.rows)
    rows = [title, "", line_of(None), *(line_of(row) for row in made.rows), ""]
    rows.append(
        f"{len(made.rows)} runs: " + ", ".join(f"{counts[k]} {w}" for k, w in WORDS.items() if counts[k])
    )
    rows += [f"left out: {words}" for words in made.left_out]
    return "\n".join(rows)


def line_of(row: Row | None) -> str:
    """Lay out one line of the table, or its head."""
    if row is None:
        cells: Sequence[str] = (
            "extreme",
            "",
            "method",
            "outcome",
            "error",
            "claimed",
            "checked by",
            "run time",
        )
        reason = ""
    else:
        error, claim = ("-" if x is None else f"{x:.0e}" for x in (row.error, row.claim))
        duration = f"{row.seconds * 1e3:.3g} ms" if row.method else "-"
        cells = (
            row.group,
            row.text,
            row.method or "-",
            WORDS[row.kind],
            error,
            claim,
            row.against or "-",
            duration,
        )
        reason = "  " + row.reason.splitlines()[0] if row.reason else ""
    widths = (9, 41, 7, 21, 6, 7, 15, 10)
    return ("".join(f"{cell:<{width}} " for cell, width in zip(cells, widths, strict=True)) + reason).rstrip()
