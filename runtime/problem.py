"""The contract that generated code fulfils, as plain data and callables.

``Problem`` mirrors ``kernel/model.h`` field by field, and adds names, units and origins so that results and failures can be
told in the words of the model. It knows nothing of the language: a hand-written one serves as well.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field

from .interface import ModelInterface

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:  # a model is compiled without NumPy
    Array = Any

ModelFunction = Callable[[float, Array, Array, Array, Array], Array]
"""(t, y, u, z, p) -> out"""


class NotEnclosed(ValueError):
    """An operation that has no form over balls of numbers."""


Enclosure = Callable[[str, Mapping[str, Sequence[Any]]], list[Any]]
"""(name, {"t", "y", "u", "z", "p"}) -> out"""


class Directions(Struct, frozen=True):
    """The directions in which a motion is differentiated: ``states`` directions of the start, then parameters and inputs by their indices.

    ``given``: parameters that do not follow from others because they were set; ``tables``: inputs whose values do not come
    from their defaults; ``units`` of the directions of the initial state, the last ones: the first have none.
    """

    states: int = 0
    parameters: tuple[int, ...] = ()
    inputs: tuple[int, ...] = ()
    given: tuple[int, ...] = ()
    tables: tuple[int, ...] = ()
    units: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        return self.states + len(self.parameters) + len(self.inputs)


class Adjoint(Struct, frozen=True):
    """A goal whose gradient is asked for: ``goal``, the array (out or y) and its index; an ``integral`` over the motion, or
    its value at the end. ``parameters`` and ``inputs`` by their indices.

    ``given``: parameters that do not follow from others because they were set; ``tables``: inputs whose values do not come from
    their defaults; ``stated``: initial values, ``settled``: parameters and inputs (array, index), that the caller has set;
    ``experiment`` sets others.
    """

    goal: tuple[str, int]
    integral: bool
    parameters: tuple[int, ...]
    inputs: tuple[int, ...]
    given: tuple[int, ...]
    tables: tuple[int, ...]
    stated: tuple[int, ...]
    settled: tuple[tuple[str, int], ...]
    experiment: str


class Problem(ModelInterface, frozen=True, kw_only=True):
    """A model that can be run: its interface with its code. ``library``: a shared object that exports
    ``const mech_model *mech_model_get(void)`` and, for each experiment, its function. A curve has none, but ``functions`` of many
    places at once, by name, and ``parameters_function(p, set)``, which fills dependent parameters and hoisted constants in place."""

    enclosure: Enclosure | None = None
    """What evaluates a function by its name over balls that hold every rounding, for proofs."""
    functions: Mapping[str, ModelFunction] = field(default_factory=dict)
    parameters_function: Callable[[Array, NDArray[np.uint8]], None] | None = None
    library: Path | None = None
    quick: bool = False
    """Whether libtcc made the library where there is a better compiler, because its code is ready first (``native/libtcc.py``)."""
    tangents: Callable[[Directions], Problem] | None = None
    """Makes the problem of the motion with its derivatives (``runtime/tangent/``); None where nobody can."""
    adjoints: Callable[[Adjoint], Problem] | None = None
    """Makes the problem whose functions pull a goal back (``runtime/tangent/gradient.py``); None where nobody can."""
