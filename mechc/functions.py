"""``model.functions``: the functions of a model for other programs, frames that are asked for by name included."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from msgspec import Struct

from .lang.diagnostics import CompileError
from .model import CompiledModel
from .requests.parse_values import UsageMistake
from .runtime.case import SimulationOptions
from .runtime.local.model_functions import ModelFunctions, model_functions


class Frame(Struct, frozen=True):
    """A frame or point, in components of the world: each a function of (y[, t[, u]]).

    ``jacobian`` has the rows of ``velocity``, then those of ``angular_velocity`` (of a point: None, and no such rows), and a
    column for each velocity of the model.
    """

    position: Callable[..., Any]
    velocity: Callable[..., Any]
    angular_velocity: Callable[..., Any] | None
    jacobian: Callable[..., Any]


class Functions(ModelFunctions):
    """See ``ModelFunctions``; ``frame`` gives what is known of a frame or point of the model."""

    def __init__(self, model: CompiledModel) -> None:
        if model.compilation.equations.curve is not None:
            raise UsageMistake(f"'{model.name}' is a curve and does not move: it has no functions of a state")
        problem = model.problem(quick=True, parts={"functions"})
        made = model_functions(problem, SimulationOptions(values=model.settings))
        super().__init__(problem, made._bound.site)
        self._model = model

    def frame(self, name: str) -> Frame:
        """Compile what moves a frame or a point: ``f.frame("arm[7].b").jacobian(y)``. Raises UsageMistake for no such."""
        taken = {e.name.partition("[")[0] for e in self._model.compilation.equations.outputs}
        taken |= {e.name for e in self._model.parameters}
        stem = "moved"
        while any(n.startswith(stem) for n in taken):
            stem += "_"
        position, velocity, turning = (f"{stem}{k}" for k in range(3))
        formulas = {position: f"pos({name})", velocity: f"vel({name})"}
        try:
            found = Functions(self._model.with_formulas({**formulas, turning: f"angvel({name})"}))
            names: tuple[str, ...] = (velocity, turning)
        except CompileError:
            try:
                found = Functions(self._model.with_formulas(formulas))
            except CompileError as error:
                raise UsageMistake(
                    f"'{name}' is no frame and no point of '{self._model.name}'", str(error).splitlines()[0]
                ) from None
            names = (velocity,)
        output = found.output
        around = output[turning] if turning in names else None
        return Frame(output[position], output[velocity], around, found.stacked(names))
