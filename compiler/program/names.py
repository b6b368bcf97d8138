"""Identifiers for the numbers of the arrays, so that generated code speaks the names of the model."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping

from .model import Program

_TEMPORARY = re.compile(r"[vkw]\d+|(sin|cos)_\w+")
"""Names that targets give to values of their own."""


def identifiers(program: Program, reserved: Collection[str]) -> Mapping[tuple[str, int], str]:
    """Return a different identifier for each (array, index); none is in ``reserved``.

    ``der(theta)`` becomes der_theta, ``arm.R[2]`` arm_R_2; hoisted constants are k0, k1, ...
    """
    names: dict[tuple[str, int], str] = {("t", 0): "t"}
    taken = {
        "t",
        "y",
        "u",
        "z",
        "p",
        "out",
        "w",
        "set",
        *reserved,
        *(("g",) if "g" in program.arrays else ()),
    }
    for array in ("y", "u", "z", "p", "g"):
        for index, entry in enumerate(program.arrays.get(array, ())):
            base = re.sub(r"\W+", "_", entry.name, flags=re.ASCII).strip("_") or array
            name = f"{array}_{base}" if base[0].isdigit() or _TEMPORARY.fullmatch(base) else base
            while name in taken:
                name += "_"
            taken.add(name)
            names[array, index] = name
    for i in range(program.nh):
        names["p", len(program.arrays["p"]) + i] = f"k{i}"
    return names
