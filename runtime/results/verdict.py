"""What is told of a run: how it ended and how accurate it was. Of a short run it is found when somebody asks."""

from __future__ import annotations

from collections.abc import Callable

from msgspec import Struct

from ..outcome import Failure, Outcome
from .accuracy import Accuracy


class Verdict(Struct, frozen=True):
    """``message`` says the ``outcome`` in words; ``failure`` is why a run failed; ``remarks`` are what it says itself."""

    outcome: Outcome
    message: str
    failure: Failure | None
    accuracy: Accuracy
    remarks: tuple[str, ...] = ()


class Judged:
    """A verdict, or what finds it from the rows of the run, which nobody else may change until then."""

    def __init__(self, found: Verdict | Callable[[], Verdict]) -> None:
        self._found = found

    @property
    def pending(self) -> bool:
        """Whether nobody has asked yet."""
        return not isinstance(self._found, Verdict)

    def __call__(self) -> Verdict:
        found = self._found
        if not isinstance(found, Verdict):
            found = self._found = found()  # whose rows may go
        return found
