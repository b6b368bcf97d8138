"""Run one case, in a process of its own, and judge what it came to."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

from msgspec.structs import replace

import mechc
from mechc.api import Model
from mechc.lang.diagnostics import CompileError
from mechc.measurement.references import compile_for_reference
from mechc.measurement.truth import true_errors
from mechc.requests.parse_values import UsageMistake
from mechc.requests.request import asked
from mechc.runtime.native.build import BuildError
from mechc.runtime.native.kernel import load_kernel
from mechc.runtime.outcome import Outcome, SimulationError
from mechc.runtime.reference.high_precision import ReferenceFailed
from mechc.runtime.studies.kinds.motion import Simulate
from mechc.session import plan
from mechc.solution import Solution
from mechc.watchdog import Crashed, Hung, Watchdog

from .case import Case, Finding, Followed, Refusal, Row, claimed
from .faults import FAULTS

EXAMPLES = Path(__file__).parents[2] / "examples"
GROUPS = tuple(sorted(p.stem for p in Path(__file__).parent.glob("group_*.py")))
"""Modules of cases: each has NUMBER, TITLE and CASES."""

Question = tuple[str, int]
"""Module and index of a case."""


def titles() -> dict[int, str]:
    """Return the title of every group by its number."""
    return {m.NUMBER: m.TITLE for m in (_group(name) for name in GROUPS)}


def questions(quick: bool, numbers: tuple[int, ...] = (), word: str = "") -> list[Question]:
    """Return the cases of the suite, of some groups if ``numbers`` are given, whose name holds ``word``."""
    return [
        (name, i)
        for name in GROUPS
        for i, case in enumerate(_group(name).CASES)
        if not (quick and case.full) and (not numbers or _group(name).NUMBER in numbers) and word in case.name
    ]


def case_of(question: Question) -> Case:
    name, index = question
    found: Case = _group(name).CASES[index]
    return found


def watched(dog: Watchdog[Question, Row], question: Question) -> Row:
    """Run a case under the watchdog."""
    case = case_of(question)
    truth = 2 * case.expects.seconds if isinstance(case.expects, Followed) else 0.0
    reply = dog.ask(question, case.seconds + truth)
    match reply:
        case Crashed(how):
            row = _unfinished(question, "crashed", how)
        case Hung(seconds):
            row = _unfinished(question, "hung", f"no answer within {seconds:g} s")
        case done:
            row = done
    return replace(row, fault=case.fault)


def _unfinished(question: Question, kind: str, reason: str) -> Row:
    case = case_of(question)
    number: int = _group(question[0]).NUMBER
    return Row(number, case.name, case.extreme, case.expects.text, kind, reason=reason)


def maker(fault: str) -> Callable[[Question], Row]:
    """Return what runs cases in this process, in a mutant of mechc (none if empty)."""
    if fault:
        FAULTS[fault].plant()
        load_kernel()  # a fault that does not compile is not a fault of the model
    return _perform


def _perform(question: Question) -> Row:
    case, number = case_of(question), _group(question[0]).NUMBER
    expects = case.expects
    try:
        solution = _model(case.model, case.variant).simulate(**case.options)
    except (CompileError, SimulationError, BuildError, UsageMistake) as error:
        message = "; ".join((str(error), *getattr(error, "notes", ())))
        if isinstance(error, CompileError):
            message = "; ".join(f"{d.code}: {d.message}" for d in error.diagnostics)
        if isinstance(expects, Refusal):
            found = expects.judge_error(message)
        else:
            found = Finding(problems=(message,))
        return _row(number, case, found, outcome=f"refused: {message}")
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        why = f"{type(error).__name__}: {error} ({Path(where.filename).name}, line {where.lineno})"
        return Row(number, case.name, case.extreme, expects.text, "crashed", reason=why)
    try:
        found = (
            _followed(expects, case, solution) if isinstance(expects, Followed) else expects.judge(solution)
        )
    except (ValueError, KeyError, IndexError) as error:  # what is to be measured is not there
        found = Finding(problems=(f"cannot be judged: {error}",))
    made, estimate = solution.statistics, solution.accuracy.error
    names = list(getattr(expects, "values", ()))
    claims = [c for n in names if (c := claimed(solution, n, at_end=False)) is not None]
    claim = max(claims) if claims else estimate.largest if estimate else None
    row = _row(number, case, found, outcome=solution.message)
    return Row(
        number, case.name, case.extreme, expects.text, row.kind, made.method, row.outcome, found.error, claim,
        made.run_time, made.steps, row.reason,
    )  # fmt: skip


def _followed(expects: Followed, case: Case, solution: Solution) -> Finding:
    if solution.outcome is not Outcome.COMPLETED:
        return Finding(problems=(f"{solution.outcome.value}: {solution.message}",))
    model = _model(case.model, case.variant).with_values(case.options.get("set", {}))
    model = model.for_experiment(case.options.get("experiment"))
    try:
        begun = plan(model, asked(Simulate, {k: v for k, v in case.options.items() if k != "set"}))
        truth = true_errors(compile_for_reference(model), begun, solution, expects.seconds)
        return expects.judge(solution, truth)
    except ReferenceFailed as error:
        return Finding(problems=(f"no reference: {error}",))


def _row(number: int, case: Case, found: Finding, outcome: str) -> Row:
    kind = "silent" if found.silent else "not met" if found.problems else "met"
    return Row(
        number, case.name, case.extreme, case.expects.text, kind,
        outcome=outcome, error=found.error, reason="; ".join(found.problems),
    )  # fmt: skip


@cache
def _model(text: str, variant: str | None) -> Model:
    if text.startswith("examples/"):
        return mechc.load(EXAMPLES / text.removeprefix("examples/"), model=variant)
    return mechc.loads(text, model=variant)


@cache
def _group(name: str) -> ModuleType:
    return import_module(f".{name}", __package__)
