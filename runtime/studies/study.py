"""What a study is: a frozen question about a model, and the answer to it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Protocol

from ..case import SimulationOptions
from ..outcome import Outcome
from ..problem import Problem
from ..results.solution import Solution


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
    asked, and never otherwise.
    """

    needs: ClassVar[frozenset[str]] = frozenset()

    def solve(self, problem: Problem) -> Answer:
        """Answer the question. Raises SimulationError where it cannot begin, CompilerMissing, BuildError."""
        raise NotImplementedError


def solve(problem: Problem, study: Study) -> Answer:
    """Answer a question about a problem."""
    return study.solve(problem)
