"""Dimensional analysis: products and groups that are known by hand, and invariance under other base units."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.cli.main import run as run_command
from mechc.runtime.studies.findings import Findings

QUARTIC = """\
model Quartic
  parameter m = 2 kg;
  parameter k = 1 J/m^4;
  coordinate x = 10 cm;
  kinetic m*der(x)^2/2;
  potential k*x^4;
end Quartic;
"""

PENDULUM = """\
model Pendulum
  parameter l = 1 m;
  parameter m = 2 kg;
  parameter g = 9.81 m/s^2;
  coordinate theta = 1 rad;
  kinetic m*l^2*der(theta)^2/2;
  potential -m*g*l*cos(theta);
end Pendulum;
"""

DRAG = """\
model Drag
  parameter m = 1 kg;
  parameter d = 0.1 m;
  parameter rho = 1.29 kg/m^3;
  parameter eta = 2e-5 Pa.s;
  parameter U = 3 m/s;
  coordinate y = 0 m;
  kinetic 1/2*m*der(y)^2;
  force -3*pi*eta*d*(der(y) - U)*(1 + rho*d*abs(der(y))/eta) on y;
end Drag;
"""

EXPONENTS = {"m": (1, 0, 0), "d": (0, 1, 0), "rho": (1, -3, 0), "eta": (1, -1, -1), "U": (0, 1, -1)}
"""Of kg, m, s in the units of DRAG, by hand."""


def asked(text: str, **settings: Any) -> Findings:
    found = mechc.loads(text).study("dimensions", **settings)
    assert isinstance(found, Findings)
    return found


def test_a_quartic_oscillator_is_slower_the_less_it_swings() -> None:
    """T ~ sqrt(m/k)/A, as 2^(-1/4) for twice the energy says (Landau and Lifshitz, Mechanics, section 10)."""
    found = asked(QUARTIC)
    assert found.message == "time = m^(1/2)/(k^(1/2)*x(0))*C, where C is a number"
    assert found.details["product"] == {"m": "1/2", "k": "-1/2", "x(0)": "-1"}
    assert found.details["groups"] == []


def test_no_mass_enters_the_period_of_a_pendulum() -> None:
    found = asked(PENDULUM)
    assert found.details["product"] == {"l": "1/2", "g": "-1/2"}
    assert found.details["groups"] == [{"theta(0)": "1"}]
    assert found.details["alone"] == ["m"]
    assert "m: enters nothing" in found.remarks[0]
    assert (
        "numbers with units in the text, as 9.81 m/s^2, take no part unless they have names"
        in found.remarks[0]
    )


@pytest.mark.parametrize(
    ("of", "product"),
    [
        ("-m*g*l*cos(theta)", {"l": "1", "m": "1", "g": "1"}),
        ("l*der(theta)", {"l": "1/2", "g": "1/2"}),
        ("theta", {}),
        ("1 A", None),
    ],
)
def test_quantities_that_are_asked(of: str, product: dict[str, str] | None) -> None:
    found = asked(PENDULUM, of=of)
    assert found.details["product"] == product
    assert ("no product of" in found.message) == (product is None)


def test_a_force_in_a_fluid_is_a_function_of_the_reynolds_number() -> None:
    """F = rho d^2 U^2 f(Re) or eta d U f(Re): one group, Reynolds' number or its reciprocal."""
    found = asked(DRAG, of="1 N", among="d, rho, eta, U")
    (group,) = found.details["groups"]
    powers = {name: Fraction(power) for name, power in group.items()}
    reynolds = {"rho": 1, "U": 1, "d": 1, "eta": -1}
    ratio = powers["rho"]
    assert powers == {name: ratio * power for name, power in reynolds.items()}


def test_products_are_the_same_in_other_base_units() -> None:
    """A group keeps its value, and a product changes as what it stands for, whatever a kilogram, a metre and a second are."""
    rng = np.random.default_rng(7)
    values = {name: float(rng.uniform(0.5, 2)) for name in EXPONENTS}
    for of, exponents in (("1 N", (1, 1, -2)), ("1 Pa", (1, -1, -2)), ("1 W", (1, 2, -3))):
        found = asked(DRAG, of=of, among=list(EXPONENTS))
        assert len(found.details["groups"]) == len(EXPONENTS) - 3  # the rank of kg, m, s

        def value(powers: dict[str, str], units: np.ndarray) -> float:
            sized = {
                name: v * np.prod(units ** -np.array(EXPONENTS[name], float)) for name, v in values.items()
            }
            return float(np.prod([sized[name] ** float(Fraction(p)) for name, p in powers.items()]))

        units = rng.uniform(0.1, 10, 3)
        for group in found.details["groups"]:
            assert value(group, units) == pytest.approx(value(group, np.ones(3)), rel=1e-13)
        change = float(np.prod(units ** -np.array(exponents, float)))
        product = found.details["product"]
        assert value(product, units) == pytest.approx(change * value(product, np.ones(3)), rel=1e-13)


def test_initial_values_of_zero_decide_nothing() -> None:
    text = QUARTIC.replace("x = 10 cm;", "x = 0 m;\n  initial der(x) = 1 m/s;")
    assert asked(text).details["product"] == {"m": "1/4", "k": "-1/4", "der(x)(0)": "-1/2"}


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "model.mech"
    path.write_text(PENDULUM)
    assert run_command(["study", "dimensions", str(path), "--among", "l, g", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["product"] == {"l": "1/2", "g": "-1/2"}
    assert run_command(["study", "dimensions", str(path), "--among", "l, gg"]) != 0
    assert "no parameter, initial value or input 'gg'" in capsys.readouterr().err
