"""The compiled functions of a problem, called with arrays."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from .interface import ModelInterface, interface_of
from .memo import once
from .native import contract
from .native import kernel as native
from .problem import Array, ModelFunction, Problem


class Functions(Struct, frozen=True):
    """Callables with the signature (t, y, u, z, p) -> array; sizes as in ``Problem``.

    ``project_position`` [nv and residuals], ``project_velocity`` [nv and residuals] and ``displace`` [nq] correct a
    state that is off its constraints; they are there only if there are any.
    ``matrices`` give entries of matrices, whose places are the ``patterns`` of the problem.
    """

    struct: contract.ModelStruct
    library: ctypes.CDLL
    rhs: ModelFunction
    initial: ModelFunction
    inputs: ModelFunction | None
    discretes: ModelFunction | None
    outputs: ModelFunction | None
    assertions: ModelFunction | None
    experiments: Mapping[str, ModelFunction]
    parameters: Callable[[Array, NDArray[np.uint8]], None]
    initial_of_others: ModelFunction | None = None
    found: ModelFunction | None = None
    timed_arguments: ModelFunction | None = None
    assembly: ModelFunction | None = None
    assembly_jacobian: ModelFunction | None = None
    project_position: ModelFunction | None = None
    project_velocity: ModelFunction | None = None
    displace: ModelFunction | None = None
    scene: ModelFunction | None = None
    scene_still: ModelFunction | None = None
    matrices: Mapping[str, ModelFunction] = field(default_factory=dict)
    phase: ModelFunction | None = None
    matter: ModelFunction | None = None
    phase_rate: ModelFunction | None = None
    phase_gradient: ModelFunction | None = None


def with_code(interface: ModelInterface, **code: Any) -> Problem:
    """Return an interface with its code: the fields of ``Problem``."""
    return Problem(**interface_of(interface), **code)


def named_function(problem: Problem, functions: Functions, name: str, size: int) -> ModelFunction:
    """Give a function with ``size`` results that only some problems have. Raises ValueError if it is not there."""
    if not hasattr(functions.library, name):
        raise ValueError(f"the library of problem '{problem.name}' has no function '{name}'")
    address = ctypes.cast(getattr(functions.library, name), ctypes.c_void_p).value
    assert address is not None
    return compiled_function(address, size)


@once
def load_functions(problem: Problem) -> Functions:
    """Give the functions in the library of ``problem``.

    Raises ``ValueError`` if a function is missing, or if the library was made for other sizes.
    """
    library = ctypes.CDLL(str(problem.library))
    library.mech_model_get.restype = ctypes.POINTER(contract.ModelStruct)
    model: contract.ModelStruct = library.mech_model_get().contents
    model.quick = problem.quick
    _check_sizes(problem, model)

    def needed(name: str, size: int) -> ModelFunction | None:
        if size == 0:
            return None
        address: int | None = getattr(model, name)
        if address is None:
            raise ValueError(f"the library of problem '{problem.name}' has no function '{name}'")
        return compiled_function(address, size)

    rhs, initial = needed("rhs", problem.ny), needed("initial", problem.ny)
    assert rhs is not None and initial is not None

    def exported(name: str, size: int) -> ModelFunction | None:
        if size == 0:
            return None
        address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
        assert address is not None
        return compiled_function(address, size)

    experiments: dict[str, ModelFunction] = {}
    for e in problem.experiments:
        address = ctypes.cast(getattr(library, e.function), ctypes.c_void_p).value
        assert address is not None
        experiments[e.function] = compiled_function(address, len(e.options) + len(e.settings))

    def projection(name: str, size: int) -> ModelFunction | None:
        address: int | None = getattr(model, name)
        return None if address is None else compiled_function(address, size)

    fill = native.PARAMETERS_FUNCTION(getattr(model, "parameters"))  # noqa: B009, a field of the struct

    def parameters(p: Array, given: NDArray[np.uint8]) -> None:
        fill(p.ctypes.data, given.ctypes.data)

    return Functions(
        rhs=rhs,
        initial=initial,
        inputs=needed("inputs", len(problem.inputs)),
        discretes=needed("discretes", len(problem.discretes)),
        outputs=needed("outputs", len(problem.outputs)),
        assertions=needed("assertions", len(problem.assertions)),
        experiments=experiments,
        parameters=parameters,
        initial_of_others=exported("initial_of_others", len(problem.dependent)),
        found=exported("found", len(problem.found)),
        timed_arguments=exported("timed_arguments", 2 * len(problem.timed_points)),
        assembly=exported("assembly", len(problem.assembly)),
        assembly_jacobian=exported("assembly_jacobian", len(problem.assembly) * problem.nv),
        project_position=projection("project_position", problem.nv + model.n_position),
        project_velocity=projection("project_velocity", problem.nv + model.n_velocity),
        displace=projection("displace", problem.nq),
        scene=exported("scene", problem.scene.n_moving if problem.scene else 0),
        scene_still=exported("scene_still", problem.scene.n_still if problem.scene else 0),
        matrices={
            name: found
            for name, pattern in problem.patterns.items()
            if (found := exported(name, len(pattern))) is not None
        },
        phase=exported("phase", len(problem.phase)),
        matter=exported("matter", problem.matter_size),
        phase_rate=exported("phase_rate", len(problem.phase)),
        phase_gradient=exported("phase_gradient", len(problem.phase) * (problem.nq + problem.nv)),
        struct=model,
        library=library,
    )


def _check_sizes(problem: Problem, model: contract.ModelStruct) -> None:
    sizes = {
        "version": contract.MODEL_VERSION,
        "nq": problem.nq,
        "nv": problem.nv,
        "nx": problem.nx,
        "nu": len(problem.inputs),
        "nz": len(problem.discretes),
        "np": len(problem.parameters),
        "nh": problem.nh,
        "n_outputs": len(problem.outputs),
        "n_assertions": len(problem.assertions),
        "n_rotations": len(problem.rotations),
    }
    for name, size in sizes.items():
        if getattr(model, name) != size:
            raise ValueError(
                f"the library of problem '{problem.name}' has {name} = {getattr(model, name)}, not {size}"
            )


FEW_CALLS = 100
"""So many go through ctypes, which needs no preparation; whoever calls more often gets a built-in function."""


def compiled_function(address: int, size: int) -> ModelFunction:
    """Give the function (t, y, u, z, p) -> array [size] at an address."""
    function = contract.MODEL_FUNCTION(address)
    quick: ModelFunction | None = None
    left = FEW_CALLS

    def by_ctypes(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        out = np.empty(size)
        y = np.ascontiguousarray(y)  # scipy passes columns of its Jacobian's differences
        function(t, y.ctypes.data, u.ctypes.data, z.ctypes.data, p.ctypes.data, out.ctypes.data)
        return out

    def call(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        nonlocal quick, left
        if quick is not None:
            return quick(t, y, u, z, p)
        left -= 1
        if left == 0:
            from .native.calls import call_of

            quick = call_of(address, size, by_ctypes)
        return by_ctypes(t, y, u, z, p)

    return call
