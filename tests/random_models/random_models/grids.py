"""Coordinates in two dimensions, and matrices that are reported: names with several indices."""

from __future__ import annotations

from random_models.coordinates import half, square
from random_models.expressions import Writer
from random_models.operators import call, der, multiply, vector
from random_models.scope import Scope, rare
from random_models.tree import FORCE, LENGTH, MASS, NUMBER, SPEED, Dim, E, Slot, node, reference

SHARE = 0.06
"""Of the models."""


@rare(SHARE)
def grids(s: Scope) -> None:
    """Write one."""
    rows, columns = s.pick(((2, 2), (2, 3), (3, 2), (1, 3)))
    name, i, j = s.fresh("q"), s.fresh("i"), s.fresh("i")
    places = _matrix(s, rows, columns, LENGTH)
    rates = _matrix(s, rows, columns, SPEED)
    size = f"[{rows}, {columns}]"
    s.add("grid", f"coordinate Length {name}{size} = ", Slot("coordinate.value", places), ";", name=name)
    s.add("grid", f"initial der({name}) = ", Slot("initial.rate", rates), ";", name=f"der({name})")
    entry = reference(f"{name}[{i}, {j}]", "coordinate", LENGTH, level="q")
    mass, stiffness = (
        s.value(MASS, s.number(0.5, 2)),
        s.value((MASS[0], LENGTH[0], SPEED[2] * 2, MASS[3]), s.number(0.5, 2)),
    )
    for kind, term in (
        ("kinetic", half(s, mass, square(der(entry)))),
        ("potential", half(s, stiffness, square(entry))),
    ):
        total = node(
            "sum over a grid",
            "sum(sum(",
            term,
            f" for {j} in 1:{columns}) for {i} in 1:{rows})",
            dim=term.dim,
        )
        s.add("energy", f"{kind} ", Slot(kind, total), ";", data={"what": kind})
    one = reference(
        f"{name}[{s.random.randint(1, rows)}, {s.random.randint(1, columns)}]",
        "coordinate",
        LENGTH,
        level="q",
    )
    push = Writer(s, "tqxv", kinks=False).scalar(FORCE, 1)
    s.add(
        "force",
        "force ",
        Slot("force.value", push),
        " on ",
        Slot("force.on", one),
        ";",
        data={"on": "scalar"},
    )
    whole = reference(name, "coordinate", LENGTH, (rows, columns), level="q")
    turned: E = call("transpose", whole, dim=LENGTH, shape=(columns, rows))
    for e in (turned, multiply(s.literal(NUMBER, s.number(0.2, 2)), whole)):
        out = s.fresh("o")
        s.add("output", f"output {out} = ", Slot("output.value", e), ";", name=out)


def _matrix(s: Scope, rows: int, columns: int, d: Dim) -> E:
    return vector(
        *(vector(*(s.literal(d, s.number(-0.8, 0.8)) for _ in range(columns))) for _ in range(rows)),
        kind="matrix",
    )
