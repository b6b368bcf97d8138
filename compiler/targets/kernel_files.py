"""The files of the kernel that a model and its method need: what FMUs and the C target take of it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from mechc.runtime.methods import methods_for, with_components

from ..equations.needs import EVERYTHING
from ..program.model import Program


def needed_kernel(
    program: Program, wanted: Sequence[str], users: Mapping[str, str], parts: Collection[str] = ()
) -> dict[str, str]:
    """Return the text by name of each file of the kernel that the files of its ``users`` need, directly or not.

    ``wanted``: the methods by name.

    ``parts``: what is kept though the model does not need it (equations/needs.py); all of them: every method.
    """
    from mechc.runtime.native.kernel import kernel_sources
    from mechc.runtime.native.selection import fitted, needed

    methods: tuple[str, ...] | None = None
    if not EVERYTHING.issubset(parts):
        listed = [name for method in wanted for name in with_components(method)]
        methods = tuple(dict.fromkeys([*listed, *methods_for(parts)]))
    states = program.nq + program.nv + program.nx
    switches = program.switching is not None
    kernel = fitted(kernel_sources(), methods=methods, states=states, switches=switches)
    return needed(kernel, users.values())
