"""Run a model under extremes, and find out whether any answer is wrong and does not say so.

A run is compared with the same model in higher precision; where that cannot be had, with another method. Its claim is
the estimated error of its own report. All of that shares the formulas of the model. So its own motion is first compared with
that of its twins, which say the same mechanics otherwise (``twins.py``).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..api import Model, load
from ..compiler.metamorphic.table import TWINS
from ..compiler.metamorphic.twin import NotApplicable, Twin
from ..lang.diagnostics import CompileError
from ..requests.parse_values import Given, UsageMistake
from ..requests.request import Asked, asked
from ..runtime.case import Case, inputs_at
from ..runtime.interface import PURE
from ..runtime.native.kernel import load_kernel
from ..runtime.outcome import ENDED, Outcome, SimulationError
from ..runtime.reference.high_precision import ReferenceFailed
from ..runtime.results.evaluate import evaluate_rows
from ..runtime.studies.kinds.motion import Simulate
from ..session import answered, plan
from ..solution import Solution
from ..watchdog import Crashed, Hung, Watchdog
from .extremes import SIZES_GROUP, TARGET, Extreme, extremes, factor_of
from .metamorphic import Base, beside, compare, disturbed_twin, run_twin, twin_of
from .own_ranges import lost
from .perturbed_starts import shaken
from .references import ReferenceCode, compile_for_reference
from .stress_table import STATED, TWIN, Stress, StressRow
from .stress_targets import REFUSALS, Answer, NotTried, answer_of
from .truth import ROUNDING, Rows, even_rows, true_errors

UNDERSTATED = 100.0
"""A true error that is larger than the claimed one by more than this is a silent failure."""
ROUGH = 0.1
"""From this error on, claimed or true, a run is not right, whatever it says of it."""
LINEAR = 1e-3
"""Share of its size up to which what the error of a start grows to may be told from a motion that begins beside it."""
SAME_OUTPUT = 1e-6
"""Share of its size up to which an output of a target may differ from what the model makes of the same states: both round."""
OPINION = 1e-10
"""Tolerance of the other method where there is no reference."""
MARGIN = 20.0
"""Seconds beyond the limits of a run after which its process counts as hung; compiling is among them."""

ANSWERING, BUILDING = 10.0, 120.0
"""How many times longer than a run a target may take to answer, and seconds that gcc may take to build it, on a busy machine, too."""


class Subject(Struct, frozen=True):
    """What is put under stress, in words that another process understands."""

    file: str
    model: str | None
    settings: Mapping[str, Given]
    experiment: str | None
    seconds: float
    targets: tuple[str, ...] = ()

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


def stress(
    subject: Subject,
    *,
    full: bool = False,
    only: Collection[str] = (),
    progress: Callable[[StressRow], None] | None = None,
) -> Stress:
    """Run all extremes and twins, each under a watchdog; ``only`` those of some groups.

    Raises CompileError, SimulationError, BuildError, CompilerMissing.
    """
    model = subject.load()
    stated = plan(model, asked(Simulate, {"experiment": subject.experiment}))
    made = extremes(stated, adaptive_methods(), full=full, targets=subject.targets)
    _compile(model)
    rows: list[StressRow] = []
    with Watchdog(worker, subject) as dog:
        twins = [Extreme(TWIN, name) for name in TWINS]
        for extreme in (made.runs[0], *twins, *made.runs[1:]):
            if only and extreme.group not in only:
                continue
            reply: StressRow | Crashed | Hung = dog.ask(extreme, _patience(extreme, subject.seconds))
            match reply:
                case Crashed(how):
                    reply = StressRow(extreme.group, extreme.text, "crashed", reason=how)
                case Hung(seconds):
                    kind = "long" if extreme.group == TWIN else "hung"  # its equations may be many
                    reply = StressRow(extreme.group, extreme.text, kind, reason=f"no answer in {seconds:g} s")
            rows.append(reply)
            if progress is not None:
                progress(reply)
    return Stress(model.name, stated.case.experiment, tuple(rows), made.left_out)


def _patience(extreme: Extreme, seconds: float) -> float:
    """Give the time after which a row counts as hung, of runs that may take some ``seconds`` each."""
    patience = 4 * seconds + MARGIN
    return patience + ANSWERING * seconds + BUILDING if extreme.group == TARGET else patience


def _compile(model: Model) -> None:
    """Fill the cache with what the runs need, so that no limit of theirs is spent on it."""
    model.problem(method=model.method(None))
    with suppress(ReferenceFailed, CompileError):  # some models have neither
        model.problem(method="radau5")
        compile_for_reference(model)


def adaptive_methods() -> list[str]:
    """Return the methods of the kernel that choose their steps themselves."""
    kernel = load_kernel()
    count = range(kernel.mech_method_count())
    return [kernel.mech_method_name(k).decode() for k in count if kernel.mech_method_is_adaptive(k)]


def worker(subject: Subject) -> Callable[[Extreme], StressRow]:
    """Return what makes and judges one run, in a process of its own."""
    model = subject.load()
    stated: list[Base | StressRow] = []

    def judged(extreme: Extreme) -> StressRow:
        if extreme.group == TARGET:
            return _of_target(model, subject, extreme)
        if extreme.group == SIZES_GROUP:
            return _in_other_sizes(model, subject, extreme)
        if extreme.group != TWIN:
            return _judged(model, subject, extreme)
        if not stated:
            stated.append(_stated(model, subject))
        base = stated[0]
        return replace(base, text=extreme.text) if isinstance(base, StressRow) else _twin(base, extreme.text)

    return judged


def _stated(model: Model, subject: Subject) -> Base | StressRow:
    """Make the run that twins are compared with, or say why there is none."""
    request = asked(Simulate, {"experiment": subject.experiment, "progress": _Limit(subject.seconds)})
    try:
        ran, solution = answered(model, request)
    except (SimulationError, UsageMistake, _OutOfTime) as error:
        return StressRow(TWIN, "", "open", reason=f"the model itself: {error}")
    assert isinstance(solution, Solution)
    if solution.accuracy.error is None:
        return StressRow(TWIN, "", "open", reason=f"the model itself: {solution.accuracy.remark}")
    return Base.of(ran, request, solution)


def _twin(base: Base, name: str) -> StressRow:
    """Make a twin, run it, and compare."""
    limit = base.request.progress
    assert isinstance(limit, _Limit)
    try:
        twin = twin_of(name, base)
    except NotApplicable as why:
        return StressRow(TWIN, name, "none", reason=str(why))
    limit.begin()
    try:
        base = beside(twin, base)
        made = run_twin(twin, base)
    except CompileError as error:
        first = next(d for d in error.diagnostics if d.code.startswith("E"))
        return StressRow(TWIN, name, "none", reason=f"it is refused: {first.code}: {first.message}")
    except (SimulationError, UsageMistake) as error:
        return StressRow(TWIN, name, "refused", reason=str(error))
    except _OutOfTime as late:
        return StressRow(TWIN, name, "long", reason=str(late))
    solution, mine = made.solution, base.solution
    done = solution.statistics
    row = StressRow(
        TWIN,
        name,
        "open",
        done.method,
        against="the model",
        seconds=done.run_time,
        steps=done.steps,
        reason=twin.says,
    )
    if solution.outcome is Outcome.FAILED:
        return replace(row, kind="refused", reason=solution.message)
    if Outcome.TERMINATED in (solution.outcome, mine.outcome) and solution.outcome is not mine.outcome:
        return replace(row, kind="other", reason=f"it ends otherwise: {solution.message}; {mine.message}")
    if solution.accuracy.error is None:
        return replace(row, reason=solution.accuracy.remark)
    if twin.shakes:
        return _shaken(base, twin, row)
    found = compare(base, twin, made)
    if twin.backwards and found is not None and not found.same:
        elsewhere = disturbed_twin(name, base)
        limit.begin()
        try:
            found = compare(base, twin, made, None if elsewhere is None else run_twin(elsewhere, base))
        except (SimulationError, _OutOfTime) as error:
            return replace(row, reason=f"how its start counts is not known: {error}")
        assert found is not None
    if found is None:
        return replace(row, reason="both have no time and no quantity in common")
    row = replace(row, error=found.difference, claim=found.allowed)
    if not found.same and twin.backwards and found.allowed > LINEAR:
        return replace(
            row, kind="rough", reason="back from its end the motion is too unstable to be followed"
        )
    if not found.same:
        words = f"{found.name} differs by {found.difference:.1e} from t = {found.at:.6g} on, {found.allowed:.1e} is allowed"
        return replace(row, kind="other", reason=words)
    return replace(row, kind="same" if found.allowed < ROUGH else "rough")


def _shaken(base: Base, twin: Twin, row: StressRow) -> StressRow:
    """Move the start of a twin, and see what becomes of it."""
    limit = base.request.progress
    assert isinstance(limit, _Limit)
    try:
        found = shaken(twin, base, limit.begin)
    except SimulationError as error:
        return replace(row, reason=str(error))
    except _OutOfTime as late:
        return replace(row, kind="long", reason=str(late))
    if not found.series:
        return replace(row, reason="no start beside its own can run")
    row, worst = replace(row, claim=None), found.worst
    if worst is None:
        return replace(row, kind="same")
    row = replace(row, error=worst.apart)
    if worst.determined:
        return (
            replace(row, kind="rough", reason=worst.words())
            if worst.apart > ROUGH
            else replace(row, kind="same")
        )
    return replace(row, kind="tied" if worst.tied else "parted", reason=worst.words())


def _of_target(model: Model, subject: Subject, extreme: Extreme) -> StressRow:
    """Compare what a target answers with the run that it stands for."""
    target = extreme.text.partition(":")[0]
    changed = model.with_values(extreme.values)
    row = StressRow(TARGET, extreme.text, "open", target, against="the run")
    try:
        run = _run(
            changed, asked(Simulate, {"experiment": subject.experiment, "progress": _Limit(subject.seconds)})
        )
    except (*REFUSALS, _OutOfTime) as error:
        return replace(row, reason=f"the run itself: {error}")
    estimate, tolerance = run.accuracy.error, run.motion.columns.case.tolerance
    if run.outcome not in ENDED or estimate is None:
        return replace(row, reason=f"the run itself: {run.message or run.accuracy.remark}")
    names = list(estimate.nominal)
    try:
        answer = answer_of(target, changed, names, ANSWERING * subject.seconds)
    except NotTried as why:
        return replace(row, reason=str(why))
    except CompileError as error:
        return replace(row, kind="refused", reason=str(error.diagnostics[0].message))
    except REFUSALS as error:
        return replace(row, kind="refused", reason=str(error))
    found = _beside_target(run, answer, tolerance)
    row = replace(row, error=found.error, claim=estimate.largest)
    if not found.wrong:
        return replace(row, kind="right" if max(found.error, estimate.largest) < ROUGH else "rough")
    return replace(row, kind="wrong", reason=found.wrong)


class _Beside(Struct, frozen=True):
    """How far what a target answers is from the run, over nominal + |value|, and what is wrong with it, if anything is."""

    error: float
    wrong: str = ""


def _beside_target(run: Solution, answer: Answer, tolerance: float) -> _Beside:
    """Compare all of a motion: the states with those of the run, the outputs with what the model makes of these states."""
    estimate, case, time = run.accuracy.error, run.motion.columns.case, answer["time"]
    assert estimate is not None
    states = [q.name for q in case.problem.states if q.kind != "account" or q.name in answer]
    missing = [name for name in states if name not in answer]
    if missing or not time.size:
        return _Beside(np.inf, f"it does not tell '{missing[0]}'" if missing else "it has no rows")
    if run.time[-1] - time[-1] > 1.01 * float(np.diff(time, prepend=time[0]).max()) + ROUNDING * abs(
        run.time[-1]
    ):
        return _Beside(np.inf, f"it ends at {time[-1]:.6g}, the run at {run.time[-1]:.6g}")
    rows = even_rows(time, run)
    here = run(time[rows])
    worst, words = 0.0, ""
    for name in states:
        ours, theirs = here[name], answer[name][rows]
        off = np.abs(theirs - ours) / (estimate.nominal[name] + np.abs(ours))
        off = np.where(np.isfinite(theirs), off, np.inf)
        worst = max(worst, float(off.max(initial=0.0)))
        if not words and off.max(initial=0.0) > UNDERSTATED * max(estimate.by_state[name], tolerance):
            k = int(off.argmax())
            words = f"{name} is {theirs[k]:.6g} there at {time[rows][k]:.6g}, and {ours[k]:.6g} in the run"
    return _Beside(worst, words or _outputs_beside(case, answer, rows))


def _outputs_beside(case: Case, answer: Answer, rows: Rows) -> str:
    """Say which output is not that of the states beside it, or nothing. Outputs that discrete variables enter are left out."""
    problem = case.problem
    if problem.hybrid is not None or any(q.name not in answer for q in problem.states):
        return ""
    time, states = answer["time"][rows], np.array([answer[q.name][rows] for q in problem.states]).T
    with np.errstate(all="ignore"):
        made = evaluate_rows(case, "outputs", time, states)
    for q, ours in zip(problem.outputs, made.T, strict=True):
        theirs = answer.get(q.name)
        if theirs is None or q.unit in PURE:  # an angle may be that of another turn
            continue
        off = np.abs(theirs[rows] - ours) > SAME_OUTPUT * np.abs(ours).max(initial=0.0)
        if (off & np.isfinite(ours)).any():
            k = int(off.argmax())
            return f"{q.name} is {theirs[rows][k]:.6g} there at {time[k]:.6g}, and {ours[k]:.6g} by its own states"
    return ""


COMPLETED = frozenset({"right", "rough", "open"})
"""Kinds of rows whose run went to its end."""


def _in_other_sizes(model: Model, subject: Subject, extreme: Extreme) -> StressRow:
    """Judge the motion in other lengths, masses and times: it ends as the stated one does, if it is the same in other numbers."""
    row = _judged(model, subject, extreme)
    if not _is_the_same(model, subject, extreme):
        return replace(
            row,
            reason=row.reason or "not known to be the same motion in other numbers",
        )
    stated = _judged(model, subject, Extreme(STATED, "nothing changed"))
    ends = ("refused", *COMPLETED)
    if row.kind in ends and stated.kind in ends and (row.kind in COMPLETED) is not (stated.kind in COMPLETED):
        why = row.reason if row.kind == "refused" else stated.reason
        there, here = ("refused", "completes") if row.kind == "refused" else ("completes", "refused")
        return replace(row, kind="unlike", reason=f"{there} in these sizes, {here} as stated: {why}")
    return row


def _is_the_same(model: Model, subject: Subject, extreme: Extreme) -> bool:
    """Whether the rates of all states, at the start and beside it, are those of the model as stated in other sizes. What switches, or
    holds assertions, may compare with numbers that do not grow: nothing is known of that."""
    equations = model.compilation.equations
    if equations.switching is not None or equations.assertions:
        return False
    around = {"experiment": subject.experiment}
    try:
        stated = plan(model, asked(Simulate, around)).case
        sized = plan(model.with_values(extreme.values), asked(Simulate, {**around, **extreme.options})).case
    except (SimulationError, UsageMistake):
        return False
    problem = stated.problem
    factors = np.array([factor_of(q.unit) for q in problem.states])
    per_time = factor_of(problem.time.unit)
    begin = sized.begin
    for share in (0.0, 1e-3, -2e-3):
        moved = stated.y0 * (1 + share)
        rates = stated.functions.rhs(stated.begin, moved, inputs_at(stated, stated.begin), stated.z, stated.p)
        again = sized.functions.rhs(begin, factors * moved, inputs_at(sized, begin), sized.z, sized.p)
        expected = rates * factors / per_time
        if not np.allclose(again, expected, rtol=1e-6, atol=1e-9 * float(np.abs(expected).max(initial=0.0))):
            return False
    return bool(np.allclose(sized.y0, factors * stated.y0, rtol=1e-6))


def _judged(model: Model, subject: Subject, extreme: Extreme) -> StressRow:
    changed = model.with_values(extreme.values)
    limit = _Limit(subject.seconds)
    around = {"experiment": subject.experiment, "progress": limit}
    request = asked(Simulate, {**around, **extreme.options})
    try:
        solution = _run(changed, request)
    except (SimulationError, UsageMistake) as refused:
        return StressRow(extreme.group, extreme.text, "refused", reason=str(refused))
    except CompileError as refused:
        return StressRow(extreme.group, extreme.text, "refused", reason=refused.diagnostics[0].message)
    except _OutOfTime as late:
        return StressRow(extreme.group, extreme.text, "long", reason=str(late))
    kind, error, against, reason = _checked(changed, subject, request, solution)
    estimate, done = solution.accuracy.error, solution.statistics
    claim = estimate.largest if estimate else None
    return StressRow(
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
        truth = true_errors(_reference_of(model), plan(model, request), solution, subject.seconds / 2)
        errors, against = truth.by_state, truth.precision
        if truth.horizon < solution.time[-1]:
            why = f"compared up to {truth.horizon:.6g}: beyond, the reference is in doubt"
    except ReferenceFailed as failed:
        why = f"no reference: {failed}"
        try:
            errors, own, against = _opinion(model, request, solution)
        except (SimulationError, _OutOfTime, ReferenceFailed) as none:
            return "open", None, "", f"{why}; no other method either: {none}"
        coarse = [name for name, claim in owed.items() if own[name] > max(claim, ROUNDING)]
        if coarse and max(errors.values()) <= UNDERSTATED * max(owed[n] + own[n] for n in owed):
            words = f"{against} claims {own[coarse[0]]:.0e} of {coarse[0]}, more than the {owed[coarse[0]]:.0e} of the run"
            return "open", max(errors.values()), against, f"{why}; {words}"
        owed = {name: claim + own[name] for name, claim in owed.items()}
    worst = max(errors, key=lambda n: errors[n] / max(owed[n], ROUNDING))
    largest = max(errors.values())
    if errors[worst] <= UNDERSTATED * max(owed[worst], ROUNDING):
        missed = _lost(model, request, solution) if max(largest, estimate.largest) < ROUGH else ""
        kind = "rough" if missed or max(largest, estimate.largest) >= ROUGH else "right"
        return kind, largest, against, missed or why
    if errors[worst] <= UNDERSTATED * _conditioning(model, request, solution).get(worst, 0.0):
        return "right", largest, against, "as far as the rounding of its parameters lets it be"
    words = f"the error of {worst} is {errors[worst]:.1e}, {estimate.by_state[worst]:.1e} was claimed"
    return "wrong", largest, against, words


def _reference_of(model: Model) -> ReferenceCode:
    """Return the code of a reference. Raises ReferenceFailed, also where the model has no formulas for one."""
    try:
        return compile_for_reference(model)
    except CompileError as refused:
        raise ReferenceFailed(refused.diagnostics[0].message) from None


def _lost(model: Model, request: Asked, solution: Solution) -> str:
    """Say which state is not known by its own range, or nothing."""
    assert isinstance(request.progress, _Limit)
    request.progress.begin()
    method = solution.statistics.method
    changes = {"method": method if method in adaptive_methods() else "dop853"}
    try:
        found = lost(plan(model, request.changed(**changes)), solution)
    except (SimulationError, UsageMistake, _OutOfTime):
        return ""
    return found.words() if found else ""


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
    try:
        other, differences = _other(model, request, solution, method=method, tolerance=OPINION)
    except CompileError as refused:
        raise ReferenceFailed(refused.diagnostics[0].message) from None
    estimate = other.accuracy.error
    if estimate is None:
        raise ReferenceFailed(other.accuracy.remark)
    return differences, estimate.by_state, f"{method} at {OPINION:g}"


def _conditioning(model: Model, request: Asked, solution: Solution) -> dict[str, float]:
    """Return how far the end moves if every parameter is changed by a unit in the last place."""
    parameters = model.problem().parameters
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
