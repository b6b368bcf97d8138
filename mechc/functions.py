"""``model.functions``: the functions of a model for other programs, frames that are asked for by name included."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

from msgspec import Struct

from .model import CompiledModel
from .requests.parse_values import UsageMistake
from .runtime.case import SimulationOptions
from .runtime.local.model_functions import ModelFunctions, model_functions


class Frame(Struct, frozen=True):
    """A frame or point, in components of the world: each a function of (y[, t[, u]]).

    ``jacobian`` has the rows of ``velocity``, then those of ``angular_velocity`` (of a point: None, and no such rows), and a
    column for each velocity of the model; ``jacobian_rate`` is its time derivative, and ``drift`` the acceleration [rows] where
    those of the model are zero. ``rotation`` [n, n] maps components in the axes of the frame to those of the world.
    """

    position: Callable[..., Any]
    velocity: Callable[..., Any]
    angular_velocity: Callable[..., Any] | None
    jacobian: Callable[..., Any]
    rotation: Callable[..., Any] | None
    jacobian_rate: Callable[..., Any]
    drift: Callable[..., Any]


class Centroid(Struct, frozen=True):
    """All bodies together, in components of the world: each a function of (y[, t[, u]]).

    ``position`` of the mass centre; ``momentum``: the linear one, then the angular one about the mass centre, ``matrix`` times the
    velocities of the model; ``drift``: its rate where the accelerations of the model are zero. ``gravity``: the acceleration that acts on
    all of them alike, None where it is not one. The velocity of the mass centre is that of the first rows over ``mass``.
    """

    mass: Callable[..., Any]
    position: Callable[..., Any]
    momentum: Callable[..., Any]
    matrix: Callable[..., Any]
    drift: Callable[..., Any]
    gravity: Callable[..., Any] | None


class Functions(ModelFunctions):
    """See ``ModelFunctions``; ``frame`` gives what is known of a frame or point of the model."""

    def __init__(self, model: CompiledModel, *, quick: bool = True) -> None:
        if model.compilation.equations.curve is not None:
            raise UsageMistake(f"'{model.name}' is a curve and does not move: it has no functions of a state")
        model = model.for_experiment(None)
        problem = model.problem(quick=quick, parts={"functions"})
        made = model_functions(problem, SimulationOptions(values=model.settings))
        super().__init__(problem, made._bound.site)
        self._model = model
        self._quick = quick
        self._frames: dict[str, Frame] = {}

    def faster(self) -> Functions:
        """Return the same functions compiled by gcc or clang, if there is one: that takes seconds, and calls take half the time or
        less, for robots of many joints a quarter. It pays from some 100 000 calls on."""
        return Functions(self._model, quick=False) if self._quick else self

    def frame(self, name: str) -> Frame:
        """Compile what moves a frame or a point: ``f.frame("arm[7].b").jacobian(y)``. Raises UsageMistake for no such."""
        if name not in self._frames:
            self._frames[name] = self._frame(name)
        return self._frames[name]

    def _frame(self, name: str) -> Frame:
        from .compiler.frame_functions import frame_functions, is_frame_or_point

        compilation = self._model.compilation
        if not is_frame_or_point(compilation, name):
            raise UsageMistake(f"'{name}' is neither a frame nor a point of '{self._model.name}'")
        found = frame_functions(compilation, name, quick=self._quick)
        if found is None:
            raise UsageMistake(
                f"'{name}' moves by more than the states and the inputs of '{self._model.name}'",
                "declare an output of its position or velocity: output tip = pos(...); and take its Jacobian",
            )
        of = self.of_library(found.library, found.shapes)
        return Frame(
            of["position"],
            of["velocity"],
            of.get("angular_velocity"),
            of["frame_jacobian"],
            of.get("rotation"),
            of["jacobian_rate"],
            of["drift"],
        )

    @cached_property
    def rates_jacobian(self) -> Callable[..., Any]:
        """The derivatives of the rates by the state, compiled when first asked for."""
        from .compiler.frame_functions import rates_jacobian_function

        found = rates_jacobian_function(self._model.compilation, quick=self._quick)
        return self.of_library(found.library, found.shapes)["rates_jacobian"]

    @cached_property
    def centroid(self) -> Centroid:
        """The mass centre and the momenta of all bodies. Raises UsageMistake for a model without bodies."""
        from .compiler.frame_functions import centroid_functions

        found = centroid_functions(self._model.compilation, quick=self._quick)
        if found is None:
            raise UsageMistake(
                f"'{self._model.name}' has no bodies whose momenta are functions of the states"
            )
        of = self.of_library(found.library, found.shapes)
        return Centroid(
            of["total_mass"],
            of["centre"],
            of["momenta"],
            of["momenta_matrix"],
            of["momenta_drift"],
            of.get("gravity"),
        )

    def regressor(self, frames: Sequence[str]) -> Callable[[Any, Any], Any]:
        """Return the function (y, a) -> Y [nv, 10 bodies]: the torques that bodies fixed in these frames ask for are Y pi.

        ``pi`` has ten numbers for each body: mass m, first moment m c, and the moments of inertia about the origin of the
        frame, xx yy zz xy xz yz, in its axes. Gravity is that of the model. In space only.
        """
        from .regressor import regressor_of

        bodies = [self.frame(name) for name in frames]
        if any(body.rotation is None or body.angular_velocity is None for body in bodies):
            raise UsageMistake("a regressor is that of bodies in frames, not of points")
        gravity = self.centroid.gravity
        if gravity is None:
            raise UsageMistake("gravity is not the same for all bodies, so that no regressor holds it")
        if len(gravity(self.start)) != 3:
            raise UsageMistake("a regressor is that of bodies in space")
        return regressor_of(bodies, gravity)
