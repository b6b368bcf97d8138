"""What a study is: a frozen question about a model, and the answer to it."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any, ClassVar, Protocol

from msgspec import Struct
from msgspec.structs import replace

from ..case import SimulationOptions, find_experiment
from ..delays import refuse_delays
from ..interface import ModelInterface
from ..outcome import Outcome, SimulationError
from ..problem import Problem
from ..results.solution import Solution

OF_A_MOTION = frozenset({"start", "stop", "every", "step", "tolerance", "method", "estimate_error"})
"""Settings of a run that mean nothing where no motion is followed."""

MOST_NAMED = 6
"""States in a remark."""


Members = tuple["type[Study]", dict[str, Any]]


class Answer(Protocol):
    """What a study gives: data that import no picture and no text of a report.

    ``runs``: the motions that it was made from; what they met tells whether the model lacked a part.
    """

    @property
    def runs(self) -> tuple[Solution, ...]: ...

    @property
    def outcome(self) -> Outcome: ...

    def summary(self) -> Mapping[str, Any]:
        """Give the answer as JSON knows it, in SI, with ``study``, ``model``, ``outcome`` and ``accuracy``."""


class Study(SimulationOptions, frozen=True, kw_only=True):
    """A question about a model, in SI. Each kind adds the settings of its own (``runtime/settings.py``).

    ``needs`` are the parts of the equations that it works on beyond the right-hand side; they are built when it is
    asked, and never otherwise. ``unused`` are the settings of a run that do nothing to its answer: nobody can give them.
    ``sweeps``: it answers for each of the values that an experiment sweeps; others refuse such an experiment.
    ``of_curves``: it is asked about a curve, and not about a motion. ``of_members``: it runs many members,
    which ``others`` may follow. ``of_own_states``: it tells of the states on which the motion depends (``Problem.own``).
    ``of_environments``: it steps the model (``wishes``). ``of_past``: it answers for models with delays, whose state is all that was within the longest delay.
    """

    needs: ClassVar[frozenset[str]] = frozenset()
    unused: ClassVar[frozenset[str]] = frozenset()
    sweeps: ClassVar[bool] = False
    asked_needs: ClassVar[Mapping[str, frozenset[str]]] = {}
    """Parts that it works on beside ``needs`` where these settings are given."""
    of_curves: ClassVar[bool] = False
    of_members: ClassVar[bool] = False
    of_own_states: ClassVar[bool] = False
    of_past: ClassVar[bool] = False
    of_environments: ClassVar[bool] = False

    @classmethod
    def about_members(
        cls, problem: ModelInterface, asked: Mapping[str, Any], experiment: str | None
    ) -> Members | None:
        """Give the question about many runs, with its settings as people write them, that answers this one by compiled code; None where
        there is none. Raises SimulationError."""
        return None

    def solve(self, problem: Problem) -> Answer:
        """Answer the question. Raises SimulationError where it cannot begin, CompilerMissing, BuildError."""
        raise NotImplementedError


def solve(problem: Problem, study: Study) -> Answer:
    """Answer a question about a problem. Raises what ``Study.solve`` raises, and SimulationError where it cannot sweep."""
    if not study.of_past:
        refuse_delays(problem, "this study takes the motion as one of a state of finitely many numbers")
    experiment = find_experiment(problem, study.experiment)
    if experiment is not None and (experiment.sweeps or experiment.words):
        if not study.sweeps:
            refuse_sweep(swept_axes(problem, study))
        refuse_random(problem, study)
    answer = study.solve(problem)
    if study.of_own_states and (left := left_out(problem)):
        assert isinstance(answer, Struct)  # Findings, which a run does without
        remarks: tuple[str, ...] = getattr(answer, "remarks", ())
        return replace(answer, remarks=(*remarks, left))
    return answer


def left_out(problem: Problem, kept: Collection[int] = ()) -> str:
    """Say which states of the model only follow the motion, but for those that are ``kept``; nothing where none does.

    An integral within a formula has no name of its own, and nobody misses it.
    """
    names = [problem.states[k].name for k in problem.followers if k not in kept]
    names = [name for name in names if not name.startswith("integral[")]
    if not names:
        return ""
    shown = ", ".join(names[:MOST_NAMED]) + ", ..." * (len(names) > MOST_NAMED)
    return f"{shown}: left out, as the motion does not depend on {'it' if len(names) == 1 else 'them'}"


def refuse_random(problem: Problem, study: Study) -> None:
    """Raise SimulationError if the experiment draws values at random and the question is about no ensemble."""
    experiment = find_experiment(problem, study.experiment)
    drawn = experiment.words.get("vary", "") if experiment else ""
    if drawn and not study.of_members:
        raise SimulationError(
            f"the experiment draws at random: {drawn}: it is many runs, and this question is about one",
            help="'mechc run' runs them all, and so does the study 'ensemble'",
        )


def swept_axes(problem: Problem, options: SimulationOptions) -> dict[str, tuple[float, ...]]:
    """Names and values that the experiment sweeps and the caller does not set."""
    experiment = find_experiment(problem, options.experiment)
    if experiment is None or not experiment.sweeps:
        return {}
    arrays = {"p": problem.parameters, "y": problem.states, "u": problem.inputs}
    axes = {arrays[s.array][s.index].name: values for s, values in experiment.sweeps}
    return {name: values for name, values in axes.items() if name not in options.values}


def refuse_sweep(names: Iterable[str], *, structural: bool = False) -> None:
    """Raise SimulationError if there are names of what an experiment sweeps; ``structural``: of what makes several models."""
    if swept := list(names):
        answering = "'sweep' answers" if structural else "'sweep' and 'section' answer"
        raise SimulationError(
            f"the experiment sweeps {', '.join(swept)}: it is several runs, and this question is about one",
            help=f"give it one value, as in --set {swept[0]}=..., or take an experiment that sweeps nothing; "
            f"{answering} for each value{' of what is structural' if structural else ''}",
        )
