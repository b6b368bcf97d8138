"""Examples of Modelica's mechanical libraries, in the words of the language, against what others computed of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from modelica_computed import around, boxes, computed_reference, orbits
from modelica_examples import AGREED, disagreement, reference, rows
from modelica_table import COMPUTED, EXAMPLES, Example

import mechc

TOLERANCES = {"Rotational.HeatLosses": 1e-11}
"""At 1e-10 that run ends with a message where a pawl and a clutch share a load: their modes change again and again."""

LONG = ("PlanarMechanics.TwoTrackWithDifferentialGear", "Rotational.HeatLosses")
"""Whose reference takes SciPy seconds."""
BY_NAME = {example.name: example for example in EXAMPLES}


def cases(source: str) -> list[Any]:
    """The examples with a reference of this source; one with the same text as another one is slow."""
    return [
        pytest.param(
            example, id=example.name, marks=[pytest.mark.slow] if example.file or example.name in LONG else []
        )
        for example in EXAMPLES
        if (example.source == COMPUTED) == (source == "computed")
    ]


@pytest.mark.parametrize("example", cases("published"))
def test_published_references(example: Example) -> None:
    """They were computed with a tolerance of 1e-6 a step; most agree to 1e-5."""
    found = disagreement(example, reference(example))
    assert max(found.values()) < AGREED, found


@pytest.mark.parametrize("example", cases("computed"))
def test_computed_references(example: Example) -> None:
    """SciPy's own error is largest in the double pendulum: 7e-8."""
    found = disagreement(
        example, computed_reference(example.name), tolerance=TOLERANCES.get(example.name, 1e-10)
    )
    assert max(found.values()) < 1e-6, found


@pytest.mark.parametrize(("name", "system"), [("DoublePendulumInitTip", boxes), ("PointGravity", orbits)])
def test_sensitive_motions(name: str, system: Callable[[Sequence[float]], dict[str, Any]]) -> None:
    """Up to 5 s, where the published references are off by a few thousandths: SciPy agrees with us."""
    times = np.linspace(0, 5, 51)[1:]
    found = disagreement(
        BY_NAME[f"MultiBody.Elementary.{name}"], {"time": times, **system(list(times))}, tolerance=1e-11
    )
    assert max(found.values()) < 2e-6, found


@pytest.mark.parametrize(("shares", "share"), [(False, 7e-4), (True, 2e-4)])
def test_what_the_original_adds_to_a_slip(shares: bool, share: float) -> None:
    """1e-4 m/s against a division by zero, which our part does not need: less than the agreement that is asked for."""
    times = np.linspace(0, 20, 11)[1:]
    with_it, without = (around(list(times), shares, added)["slide"] for added in (1e-4, 0))
    found = np.sqrt(np.mean((with_it - without) ** 2)) / np.max(with_it)
    assert found == pytest.approx(share, rel=0.2) and found < AGREED


def test_parts_of_the_library_alone() -> None:
    """No example brings a file of parts of its own: what is imported is the library's, and a second model is an example's own setup."""
    folder = EXAMPLES[0].path.parent
    assert {path.name for path in folder.glob("*.mech")} == {example.path.name for example in EXAMPLES}
    imports = [
        line
        for path in folder.glob("*.mech")
        for line in path.read_text(encoding="utf-8").splitlines()
        if line.startswith("import ")
    ]
    assert len(imports) > 80
    assert [line for line in imports if not line.startswith("import mech.")] == []


def test_rows_of_the_page() -> None:
    """Every mechanical example of these libraries once."""
    names = [name for name, _, _ in rows()]
    assert len(names) == len(set(names)) == len(EXAMPLES) == 107
    assert all(example.path.exists() for example in EXAMPLES)


LOSSES = [f"Rotational.LossyGearDemo{k}" for k in (1, 2, 3)]
LOSSES += [f"Rotational.OneWayClutch{end}" for end in ("", "Disengaged")]
LOSSES += ["Rotational.CoupledClutches", "Rotational.SimpleGearShift", "Rotational.Friction", "Translational.Brake"]  # fmt: skip
LOSSES += ["Rotational.CompareBrakingTorque", "Rotational.EddyCurrentBrake", "Translational.Friction", "PlanarMechanics.PlanetaryGear"]  # fmt: skip


@pytest.mark.parametrize("name", LOSSES)
def test_accounts_of_energy_are_exact(name: str) -> None:
    """What gears, clutches and brakes lose is what is missing, to 1e-9 of the energy that is turned over. Measured: 5e-11."""
    solution = mechc.load(BY_NAME[name].path).simulate(tolerance=1e-11, estimate_error=False)
    total, size = solution["energy.total"], np.abs(solution["energy.total"]).max()
    for what, sign in (("dissipated", 1), ("supplied", -1)):
        if f"energy.{what}" in solution.quantities:
            total = total + sign * solution[f"energy.{what}"]
            size = max(size, np.abs(solution[f"energy.{what}"]).max())
    assert np.ptp(total) < 1e-9 * size
