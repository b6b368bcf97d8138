"""Make docs/units.md, the reference of units and types, from their tables: ``python docs/units.py``."""

from __future__ import annotations

from pathlib import Path

from mechc.lang.units import NAMED_TYPES, PREFIXES, parse_unit

HERE = Path(__file__).resolve().parent

HEAD = """# Units and types

`python docs/units.py` writes this page from the tables of the compiler. [The language](language.md#3-quantities-and-units)
explains how to write quantities.

## Units

Combine these units by `.`, `/` and `^`: `N.m/rad`, `kg.m^2`, `m/s^2`. A `/` divides by the next unit only: `J/kg.K` is (J/kg)·K.

| unit | equals | prefixes |
|---|---|---|
"""

TYPES = """
## Types

A type stands before the name, as in `parameter Length l;`. It is required where no value gives the dimension. Values are stored and shown in the SI
unit of the type, unless the declaration or `--display` names another unit for display.

| type | unit |
|---|---|
"""

END = """
`Rotation` is the type of a coordinate that turns freely in space. `type Snap = unit "m/s^4";` declares a type of your own.
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
        return ("unit of angle" if unit.angle else "base unit") if base == text else base
    return f"{float(unit.factor):.12g} {base}".removesuffix(" 1")


if __name__ == "__main__":
    from own_installation import require_own_installation

    require_own_installation()
    (HERE / "units.md").write_text(page(), encoding="utf-8")
