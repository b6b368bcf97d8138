"""Make docs/units.md, the reference of units and types, from their tables: ``python docs/units.py``."""

from __future__ import annotations

from pathlib import Path

from mechc.lang.units import NAMED_TYPES, PREFIXES, parse_unit

HERE = Path(__file__).resolve().parent

HEAD = """# Units and types

Made from the tables of the language by `python docs/units.py`. How quantities are written is in
[the language](language.md#3-quantities-and-units).

## Units

A unit is made of these by `.`, `/` and `^`: `N.m/rad`, `kg.m^2`, `m/s^2`. What stands behind `/` ends at the next `.` or `/`.

| unit | is | prefixes |
|---|---|---|
"""

TYPES = """
## Types

A type stands before a name, `parameter Length l;`, and must where there is no value to tell the dimension. Values are stored in the SI
unit of the type and shown in it, unless the declaration or `--display` names another.

| type | unit |
|---|---|
"""

END = """
`Rotation` is the type of a coordinate that turns freely in space. `type Stiffness = N/m;` gives a name to another unit.
"""


def page() -> str:
    """Return the text of docs/units.md."""
    units = [f"| `{unit}` | {_meaning(unit)} | {' '.join(prefixes)} |" for unit, prefixes in PREFIXES.items()]
    types = [f"| `{name}` | {'' if row.unit == '1' else row.unit} |" for name, row in NAMED_TYPES.items()]
    return HEAD + "\n".join(units) + "\n" + TYPES + "\n".join(types) + "\n" + END


def _meaning(text: str) -> str:
    """Say what a unit is in SI."""
    unit = parse_unit(text)
    base = "rad" if unit.angle and str(unit.dimension) == "1" else str(unit.dimension)
    if unit.angle and base != "rad":
        base = base.replace("1/", "rad/", 1)
    if unit.factor == 1:
        return "" if base == text else base
    return f"{float(unit.factor):.12g} {base}"


if __name__ == "__main__":
    from own_installation import require_own_installation

    require_own_installation()
    (HERE / "units.md").write_text(page(), encoding="utf-8")
