"""The units that results are shown in; stored values are always SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from msgspec import Struct, field

from .lang.units import Unit, UnitError, parse_unit
from .requests.parse_values import UsageMistake

if TYPE_CHECKING:
    from .runtime.interface import Quantity


class Display(Struct, frozen=True):
    """``chosen`` maps an SI unit to the unit asked for with ``--display``; it goes before the model's own."""

    chosen: dict[str, str] = field(default_factory=dict)

    def unit(self, si: str, declared: str) -> str:
        """Return the unit to show a quantity in: chosen, declared in the model, or SI."""
        wanted = self.chosen.get(_kind(declared or si))
        if wanted:
            return wanted
        numerator, slash, rest = si.partition("/")
        single = slash and not any(sign in numerator for sign in ".(")  # not at the stroke of m^(3/2)
        if single and (wanted := self.chosen.get(_kind(numerator))):
            return f"{wanted}/{rest}"  # with deg chosen, rad/s is shown as deg/s
        return declared or si

    def in_units(self, name: str, si: str) -> tuple[str, float]:
        """Return the chosen unit, or SI, and the factor from SI to it: what ``Results.save`` asks for."""
        unit = self.unit(si, "")
        return unit, factor(si) / factor(unit)


def shown_unit(display: Display, quantities: Mapping[str, Quantity], name: str, si: str) -> tuple[str, float]:
    """Return the unit that a quantity is shown in, and the factor from SI to it.

    A rate follows its coordinate: where that is shown in deg, its rate is shown in deg/s.
    """
    quantity = quantities.get(name)
    declared = quantity.display if quantity else ""
    if quantity and not declared and quantity.kind == "rate" and name.startswith("der("):
        coordinate = quantities.get(name.removeprefix("der(").replace(")", "", 1))
        if coordinate and coordinate.display and coordinate.unit and si.startswith(f"{coordinate.unit}/"):
            declared = coordinate.display + si.removeprefix(coordinate.unit)
    unit = display.unit(si, declared)
    return unit, factor(si) / factor(unit)


def factor(unit: str) -> float:
    """Return the value of a unit in SI."""
    return float(parse_unit(unit or "1").factor)


def choose(text: str) -> Display:
    """Read ``deg,mm``: every quantity of such a dimension is shown in that unit. Raises UsageMistake."""
    chosen: dict[str, str] = {}
    for name in (part.strip() for part in text.split(",")):
        if not name:
            continue
        try:
            unit = parse_unit(name)
        except UnitError as error:
            raise UsageMistake(
                str(error), f"did you mean '{error.suggestion}'?" if error.suggestion else ""
            ) from None
        other = chosen.setdefault(_key(unit), name)
        if other != name:
            raise UsageMistake(f"'{other}' and '{name}' are units of one kind", "choose one of them")
    return Display(chosen)


def _kind(si: str) -> str:
    return _key(parse_unit(si or "1"))


def _key(unit: Unit) -> str:
    """Tell dimensions apart, angles from pure numbers, torques (a force by a length) from energies; rates of angles are angles per time."""
    torque = unit.dimension == _ENERGY and any(force in unit.symbol for force in ("N.", "Nm", "lbf"))
    return f"{unit.dimension}{' angle' if unit.angle else ''}{' torque' if torque else ''}"


_ENERGY = parse_unit("J").dimension
