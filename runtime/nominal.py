"""What nominal values follow from: the size that each state has in a run, against which its error is measured.

A tolerance of 1e-8 bounds the local error of a state by 1e-8 (nominal + |value|). The kernel has the rules
(``kernel/start/nominal.c``). Each multiplies and compares quantities of one unit only, so that a change of
units changes no step: the same model in kilometres and in metres runs alike.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from ctypes import addressof, c_int

from msgspec import Struct
from msgspec.structs import replace

from .interface import PURE, ModelInterface, Quantity
from .memo import once
from .native.contract import QuantityStruct, SizesStruct
from .problem import Problem

NOISE = 1e-12
"""Shares below this are what rounding leaves of a zero."""


class Sizes(Struct, frozen=True):
    """What the rules know of a model (``mech_sizes`` of kernel/start/start.h).

    By state: ``units``, the same number for the same unit; ``kinds``: "", account or rotation (an entry of one); ``pure``:
    an angle or a pure number; ``nominal``: declared, 0 without; ``ranges``: the size of the declared range, 0 without.
    ``partner`` [nv]: index of the coordinate of each velocity; ``parameter_units``: -1 where no state has it, and
    where nothing uses the parameter;
    ``energies``: indices of outputs. ``groups``: the same number for states that feel each other, empty where all do.
    """

    nq: int
    nv: int
    units: Sequence[int]
    kinds: Sequence[str]
    pure: Sequence[bool]
    nominal: Sequence[float]
    ranges: Sequence[float]
    partner: Sequence[int]
    parameter_units: Sequence[int]
    energies: Sequence[int]
    groups: Sequence[int] = ()


@once
def sizes_of(problem: ModelInterface) -> Sizes:
    """Return what the rules know of a model."""
    numbers: dict[str, int] = {}
    units = [numbers.setdefault(q.measure, len(numbers)) for q in problem.states]
    entries = {first + k for first in problem.rotations for k in range(4)}
    return Sizes(
        problem.nq,
        problem.nv,
        units,
        [
            "rotation" if i in entries else "account" if q.kind == "account" else ""
            for i, q in enumerate(problem.states)
        ],
        [q.unit in PURE for q in problem.states],
        [abs(q.nominal) if q.nominal is not None else 0.0 for q in problem.states],
        [_range(q) for q in problem.states],
        problem.partner,
        [-1 if q.kind == "idle" else numbers.get(q.measure, -1) for q in problem.parameters],
        [k for k, q in enumerate(problem.outputs) if q.kind == "energy"],
        problem.groups,
    )


def with_nominal(problem: Problem, sizes: Mapping[str, float]) -> Problem:
    """Return a problem whose states declare nominal values, by name."""
    if not sizes:
        return problem
    states = tuple(replace(q, nominal=sizes.get(q.name, q.nominal)) for q in problem.states)
    return replace(problem, states=states)


def _range(quantity: Quantity) -> float:
    ends = [abs(e) for e in (quantity.minimum, quantity.maximum) if e is not None and math.isfinite(e)]
    return max(ends, default=0.0)


KINDS = {"": 0, "account": 1, "rotation": 2}
"""Of states, as the kernel numbers them: enum mech_quantity_kind."""


@once
def kernel_sizes(problem: Problem) -> tuple[SizesStruct, tuple[object, ...]]:
    """Make what the kernel's rules read, and what that points to."""
    sizes = sizes_of(problem)
    groups = sizes.groups or (0,) * problem.ny
    rows = zip(sizes.units, sizes.kinds, sizes.pure, sizes.nominal, sizes.ranges, groups, strict=True)
    states = (QuantityStruct * problem.ny)(
        *(QuantityStruct(unit, KINDS[kind], *others) for unit, kind, *others in rows)
    )
    lists = [(c_int * len(what))(*what) for what in (sizes.partner, sizes.parameter_units, sizes.energies)]
    partner, units, energies = map(addressof, lists)
    made = SizesStruct(addressof(states), partner, units, len(sizes.energies), energies)
    return made, (states, *lists)
