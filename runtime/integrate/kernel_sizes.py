"""What nominal values follow from, as the kernel reads it (``kernel/start/start.h``)."""

from __future__ import annotations

from ctypes import addressof, c_int

from ..memo import once
from ..native.contract import QuantityStruct, SizesStruct
from ..nominal import sizes_of
from ..problem import Problem

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
