"""NumPy, loaded where plain arrays do not do; what was asked of it before then holds from then on."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from types import TracebackType
from typing import Any

_entered: list[Quiet] = []
when_loaded: list[Callable[[], None]] = []
"""What is done once NumPy is needed."""


def numpy() -> Any:
    """Give NumPy. What is not to be warned of now is not warned of by it."""
    first = "numpy" not in sys.modules
    loaded = import_module("numpy")
    for one in _entered if first else ():
        one.enter()
    while when_loaded:
        when_loaded.pop()()
    return loaded


class Quiet:
    """``np.errstate``: plain arrays never warn, and NumPy is told once it is there."""

    def __init__(self, **how: Any) -> None:
        self._how = how
        self._state: Any = None

    def enter(self) -> None:
        self._state = numpy().errstate(**self._how)
        self._state.__enter__()

    def __enter__(self) -> None:
        if "numpy" in sys.modules:
            self.enter()
        _entered.append(self)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _entered.remove(self)
        if self._state is not None:
            self._state.__exit__(kind, error, trace)
