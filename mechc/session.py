"""From a question to its answer: the model is built with what the question needs, and once more with what it lacked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec.structs import replace

from .compiler.compilation import Compilation
from .display import Display, choose
from .model import CompiledModel
from .requests.parse_values import UsageMistake, one_of
from .requests.question import formulas, study
from .requests.request import Asked, holds_formulas, known_of
from .runtime.case import Case, SimulationOptions, find_experiment, prepare
from .runtime.functions import load_functions
from .runtime.integrate.solver import BetterCodePays, little_work
from .runtime.interface import COMPLIANCE
from .runtime.memo import once
from .runtime.outcome import AT_SINGULAR_POSITIONS, SINGULAR_MASS, TOO_MANY_STEPS, Failure, Outcome, Told
from .runtime.problem import Problem
from .runtime.results.solution import Solution as Run
from .runtime.studies.runs.simulate import Plan, plan_run
from .runtime.studies.study import Answer, Study, refuse_sweep, solve
from .solution import Solution

if TYPE_CHECKING:
    from .cluster_payload import SentQuestion
    from .runtime.ensembles.lanes import Maker, Wanted
    from .runtime.ensembles.recipe import Recipe
    from .runtime.studies.environments.environments import Environments, Wishes
    from .runtime.studies.environments.episodes import Episodes
    from .runtime.studies.environments.stepper import Stepper

FEW_STEPS = 20_000
"""Steps after which a run is looked at: if it is stiff, it begins again with an implicit method at hand."""
MOST_POSED = 16
"""Questions that are remembered for each compilation."""
REPEATED = "the run was repeated with multipliers of a small compliance"
DECIDED = (
    "only the constraints decide the motion there, and the run was repeated with equations that use them"
)
PASSED_BY = (
    f'where the mechanism passes a singular position there, build it with keep={{"{COMPLIANCE}"}}; a whole run '
    "(simulate) does that by itself"
)
"""What a run step by step says: it cannot begin again, as its caller has seen its past."""


def with_experiment(model: CompiledModel, asked: Asked) -> Asked:
    """Return a question about an ensemble with what the experiment says of it, after what the caller says."""
    if not asked.question.of_members:
        return asked
    said = model.ensemble_settings(asked.experiment)
    if "vary" in asked.given:  # other random values, or none: how many is said with them
        said = {name: text for name, text in said.items() if name in ("keep", "errors")}
    return replace(asked, given={**said, **asked.given})


def _text_of(found: Answer) -> str:
    from .presentation import answers

    return answers.text(found)


def _drawn(found: Answer, *how: Any) -> Any:
    from .presentation import answers

    return answers.plotted(found, *how)


def _bundled(found: Solution) -> dict[str, Any]:
    from .presentation.bundles import solution_bundle

    return solution_bundle(found)


Told.teller, Told.drawer, Told.bundler = _text_of, _drawn, _bundled


def answer(model: CompiledModel, asked: Asked) -> Answer:
    """Answer a question about a model, as people meet it: runs in the units that they are shown in.

    Structural parameters that the experiment sweeps are swept outermost: each of their values compiles the model again.
    Raises what ``Study.solve`` raises.
    """
    from .runtime.studies.kinds.sweep import Runs, Sweep

    asked = with_experiment(model, _about_members(model, asked))
    if not issubclass(asked.question, Sweep):
        found = answered(model, asked)[1]
        if asked.to is not None and isinstance(found, Solution):
            asked.to.complete(found)
        return found
    points: list[Mapping[str, float | bool | str]] = []
    solutions: list[Solution] = []
    complete = True
    variants = model.structural_points(asked.experiment)
    if asked.to is not None and len(variants) > 1:
        raise UsageMistake(
            f"the experiment sweeps {', '.join(variants[0][0])}: it is {len(variants)} runs, and a file that grows with a run holds one",
            "give each one value, or write the files after the runs, without --streamed",
        )
    for structural, variant in variants:
        try:
            found = _solve(variant, asked)[2]
        except KeyboardInterrupt:  # while a variant was compiled, or pressed again during its first run
            if not solutions:
                raise
            complete = False
            break
        assert isinstance(found, Runs)
        for point, one in zip(found.points, found.solutions, strict=True):
            points.append({**structural, **point})
            solutions.append(_shown(one, asked, points[-1]))
        if asked.to is not None and solutions:
            asked.to.complete(solutions[-1])
        complete = found.complete
        if not complete or found.outcome is Outcome.INTERRUPTED:
            break
    return Runs(tuple(points), tuple(solutions), complete)


def _about_members(model: CompiledModel, asked: Asked) -> Asked:
    """Return the question about many runs that answers one, where compiled code can."""
    other = asked.question.about_members(model.compilation.summary.description, asked.given, asked.experiment)
    if other is None:
        return asked
    from .requests.members import refuse_structural

    refuse_structural(other[1]["vary"], model.structural_parameters)
    return replace(asked, question=other[0], given=other[1])


def answered(model: CompiledModel, asked: Asked) -> tuple[CompiledModel, Answer]:
    """Answer a question; return the model that was asked in the end, too: with compliant multipliers if it took those."""
    swept = model.swept_structural(asked.experiment)
    refuse_sweep(swept, structural=True)  # others than ``Sweep`` would take the default
    ran, _, found = _solve(model, asked)
    return ran, _shown(found, asked) if isinstance(found, Run) else found


def begin(model: CompiledModel, asked: Asked) -> Stepper:
    """Begin a run that the caller takes on, piece by piece."""
    from .runtime.studies.environments.stepper import Stepper

    problem, question = _posed(model, asked)
    return Stepper(problem, question, _wishes(model))


def environments(
    model: CompiledModel, asked: Asked, n: int | None, substeps: int, lanes: str, **bounds: int
) -> Environments:
    """Make environments of a model whose control steps last as long as the question says that its output is apart; ``n``: None is
    one by itself, without the axis of many. Raises SimulationError."""
    from .runtime.ensembles.lanes import CHOICES
    from .runtime.studies.environments.environment import Environment
    from .runtime.studies.environments.environments import Environments, control_steps

    one_of(lanes, CHOICES, "choice of lanes")
    problem, question = _posed(model, asked)
    assert isinstance(question, SimulationOptions)
    period = question.every
    if period is None or not (math.isfinite(period) and period > 0):
        raise UsageMistake("a control step lasts a time above zero", 'as in dt="2 ms"')
    options, wishes = control_steps(question, _wishes(model), period, substeps)
    wishes = replace(wishes, n=n or 1, lanes=_lanes_of(model, asked, lanes), **bounds)
    return (Environment if n is None else Environments)(problem, options, wishes)


def episodes(model: CompiledModel, asked: Asked, n: int, lanes: str, threads: int) -> Episodes:
    """Begin the episodes of a task. Raises UsageMistake, SimulationError."""
    from .runtime.ensembles.lanes import CHOICES
    from .runtime.studies.kinds.task import Task

    one_of(lanes, CHOICES, "choice of lanes")
    problem, question = _posed(model, asked)
    if not isinstance(question, Task):
        raise UsageMistake(
            "this is not a task", 'study swing = task(observe = "sin(a)", reward = "cos(a)", ...);'
        )
    made = _lanes_of(with_formulas(model, asked), asked, lanes)
    return question.environments(problem, replace(_wishes(model), n=n, threads=threads, lanes=made))


def _lanes_of(model: CompiledModel, asked: Asked, lanes: str) -> Maker:
    from .runtime.ensembles.lanes import Maker

    return Maker(lambda wanted, by: model.lanes(by, _needs(asked), wanted, by), lanes)


def _wishes(model: CompiledModel) -> Wishes:
    """Return what the model says to environments of it."""
    from .runtime.studies.environments.environments import Wishes

    advice = "" if _foreseen(model) else PASSED_BY
    return Wishes(moving=_moving_inputs(model), at_singular_positions=advice)


def plan(model: CompiledModel, asked: Asked) -> Plan:
    """Make a run ready without beginning it. Raises SimulationError."""
    return plan_run(*_posed(model, asked))


def case_of(model: CompiledModel, asked: Asked, problem: Problem) -> Case:
    """Return the case of a run by the compiled functions that answered before. Raises SimulationError."""
    options = study(asked, problem)
    assert isinstance(options, SimulationOptions)
    return prepare(problem, load_functions(problem), replace(options, values=model.settings))


def _posed(
    model: CompiledModel, asked: Asked, method: str | None = None, *, quick: bool = False
) -> tuple[Problem, Study]:
    """Return the model with what the question needs, and the question in SI, with the values of the model that were changed."""
    known, key = _posed_of(model.compilation), (id(asked), method, quick)
    found = known.get(key)
    if found is not None and found[0] is asked:
        _, problem, question = found
    else:
        problem, question = _posed_anew(model, asked, method, quick)
        if asked.lasts:
            for oldest in [*known][: max(len(known) - MOST_POSED + 1, 0)]:  # others may ask at the same time
                known.pop(oldest, None)
            known[key] = asked, problem, question
    return problem, replace(question, values=model.settings)


@once
def _posed_of(compilation: Compilation) -> dict[tuple[int, str | None, bool], tuple[Asked, Problem, Study]]:
    """The last questions that were put, by their identity, with what answers them, without values."""
    return {}


def _posed_anew(model: CompiledModel, asked: Asked, method: str | None, quick: bool) -> tuple[Problem, Study]:
    """Return the model with what the question needs, and the question without values. Raises UsageMistake for a curve where a
    motion is asked about, and the other way round."""
    if model.is_curve and not asked.question.of_curves:
        raise UsageMistake(
            f"'{model.name}' is a curve and does not move: this study is not asked about it",
            "'solve' finds it, as 'mechc run' does; 'mechc study curves' follows it over a parameter",
        )
    if asked.question.of_curves and not model.is_curve:
        raise UsageMistake(
            f"'{model.name}' is a motion, and this study is asked about curves",
            "a curve has a range: 'independent x from a to b;'",
        )
    problem = problem_of(model, asked, method, quick=quick)
    question = study(asked, problem)
    return problem, replace(question, wishes=_wishes(model)) if question.of_environments else question


def problem_of(
    model: CompiledModel, asked: Asked, method: str | None = None, *, quick: bool = False
) -> Problem:
    """Return the model with what a question needs."""
    model = with_formulas(model, asked)
    said = asked.given.get("method") or model.method(asked.experiment)
    return model.problem(
        method=method or str(said),
        reproducible=bool(asked.given.get("reproducible", False)),
        quick=quick,
        parts=_needs(asked),
    )


def _needs(asked: Asked) -> frozenset[str]:
    needed = asked.question.needs.union(
        *(p for n, p in asked.question.asked_needs.items() if asked.given.get(n))
    )
    if not any(asked.given.get(name) for name in known_of(asked.question).lists):
        return needed
    from .requests.kept import parts_of_kept

    return needed | parts_of_kept(asked)


def with_formulas(model: CompiledModel, asked: Asked) -> CompiledModel:
    """Return the model with the formulas of a question as outputs."""
    if not holds_formulas(asked):
        return model
    equations = model.compilation.equations
    names = [e.name for e in (*equations.states, *equations.outputs)]
    taken = [e.name for e in (*equations.parameters, *equations.inputs, *equations.discretes)]
    return model.with_formulas(formulas(asked, names, taken))


def _moving_inputs(model: CompiledModel) -> frozenset[str]:
    """Return the inputs whose defaults depend on time."""
    equations = model.compilation.equations
    time = {n for n, slot in equations.layout.items() if slot.array == "t"}
    defaults = [n for f in equations.functions if f.name == "inputs" for n in f.outputs]
    moving = [bool(time & set(equations.graph.support(n))) for n in defaults]
    return frozenset(e.name for e, moves in zip(equations.inputs, moving, strict=True) if moves)


def _solve(model: CompiledModel, asked: Asked) -> tuple[CompiledModel, Problem, Answer]:
    """Answer; where that meets a singular position or mass matrix which was not foreseen, answer again with compliant
    multipliers and weights of constraints.

    Whether there are such is decided for the default values, along one motion (equations/rows/singular.py, weights.py).
    """
    problem, found = _solve_as_it_is(model, asked)
    if not problem.constraints or not any(map(_met, found.runs)) or _foreseen(model):
        return model, problem, found
    softer = compliant(model)
    other, again = _solve_as_it_is(softer, asked)
    if any(map(_met, again.runs)):
        return model, problem, found
    for one, before in zip(again.runs, found.runs, strict=True):
        failure = _cause(before)
        if failure is not None:
            what = f"met a singular position at t = {failure.time:.6g}: {REPEATED}"
            if failure.kind == SINGULAR_MASS:
                what = f"the mass matrix is singular at t = {failure.time:.6g}: {DECIDED}"
            one.add_remark(what)
    return softer, other, again


def compliant(model: CompiledModel) -> CompiledModel:
    """Return the model with multipliers of a small compliance and weights of constraints, which passes singular positions
    and goes on with a singular mass matrix."""
    return model.keeping({*model.compilation.parts, COMPLIANCE})


def _foreseen(model: CompiledModel) -> bool:
    """Whether the model has all that passes singular positions."""
    return COMPLIANCE in model.compilation.parts


def _cause(run: Run) -> Failure | None:
    """What ended a run, or its companion run."""
    return run.motion.stopped or run.motion.companion_stopped


def _met(run: Run) -> bool:
    failure = _cause(run)
    return failure is not None and failure.kind in AT_SINGULAR_POSITIONS


def _gave_up(run: Run) -> bool:
    failure = run.motion.stopped
    return failure is not None and failure.kind == TOO_MANY_STEPS


def _solve_as_it_is(model: CompiledModel, asked: Asked) -> tuple[Problem, Answer]:
    """Answer by the method that was asked for; without one explicitly, and again with the Jacobian if that is stiff.

    So the Jacobian is compiled for stiff models only. What the first try costs at most is ``FEW_STEPS``: what is not stiff
    after these goes on. Before that the question is answered by code that is ready at once, if it takes little work; not one about
    members of an ensemble, which are many.
    """
    if not asked.question.of_members:
        problem, question = _posed(model, asked, quick=True)
        if problem.quick:
            with suppress(BetterCodePays), little_work():
                return problem, solve(problem, question)
    problem, question = _posed(model, asked)
    if question.of_members:
        return problem, solve(problem, with_others(model, asked, problem, question))
    if asked.given.get("method") or model.method(asked.experiment):
        return problem, solve(problem, question)
    found = solve(problem, replace(question, stiff_after=FEW_STEPS))
    if not any(map(_gave_up, found.runs)):
        return problem, found
    if any(run.statistics.stiff_time is not None for run in found.runs):
        problem, question = _posed(model, asked, method="auto")
    return problem, solve(problem, question)


def with_others(model: CompiledModel, asked: Asked, problem: Problem, question: Study) -> Study:
    """Let single members be followed by other builds of the model, as single runs are: with the Jacobian, or compliant."""
    from .runtime.ensembles.batches import Other

    def make_lanes(wanted: Wanted, by: str) -> Path:
        said = str(asked.given.get("method") or model.method(asked.experiment))
        return with_formulas(model, asked).lanes(said, _needs(asked), wanted, by)

    def make_items(wanted: Wanted, by: str) -> str:
        from .compiler.lanes import item_text

        said = str(asked.given.get("method") or model.method(asked.experiment))
        whole = with_formulas(model, asked)
        return item_text(whole.program(whole.parts_of(said, _needs(asked))), wanted, by)

    def send(whole: Study) -> SentQuestion:
        from .cluster_payload import SentQuestion

        softer = [compliant(model)] if compliance else []
        builds = [*softer, *(with_formulas(one, asked) for one in (model, *softer))]
        return SentQuestion.of(model, builds, asked, whole, recipe_of)

    compliance = bool(problem.constraints) and not _foreseen(model)
    question = replace(question, make_lanes=make_lanes, make_items=make_items, send=send)
    others = []
    if compliance:
        others.append(Other(False, lambda: problem_of(compliant(model), asked)))
    if asked.given.get("method") or model.method(asked.experiment):
        return replace(question, others=tuple(others))
    others.append(Other(True, lambda: problem_of(model, asked, "auto")))
    return replace(question, others=tuple(others), few_steps=FEW_STEPS)


def recipe_of(model: CompiledModel, asked: Asked, question: Study) -> Recipe:
    """Say how the members of a question that was sent here are made."""
    problem = problem_of(model, asked)
    whole = with_others(model, asked, problem, question)
    from .runtime.studies.kinds.ensemble import EnsembleOf

    assert isinstance(whole, EnsembleOf)
    return whole.recipe(problem)


def _shown(run: Run, asked: Asked, swept: Mapping[str, float | bool | str] | None = None) -> Solution:
    chosen = find_experiment(run.problem, asked.experiment)
    words = chosen.words.get("display", "") if chosen else ""
    if not words and not swept:
        return Solution(run.motion)
    return Solution(run.motion, choose(words) if words else Display(), swept or {})
