"""Phase portraits: points of rest, separatrices and paths against closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import SimulationError

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def portrait(name: str, **settings: Any) -> dict[str, Any]:
    found = mechc.load(EXAMPLES / f"{name}.mech").portrait(**settings).summary()
    assert isinstance(found, dict)
    return found


def test_pendulum_has_a_centre_saddles_and_separatrices_between_them() -> None:
    """K4, U84: levels below m g l are librations of the period 4 K(sin(a/2)), those above rotations; at m g l is the
    separatrix v = +-2 sqrt(g/l) cos(theta/2)."""
    found = portrait("pendulum_phase_portrait")
    kinds = {round(one["values"]["theta"], 12): one["kind"] for one in found["equilibria"]}
    assert kinds == {round(-math.pi, 12): "saddle", 0.0: "centre", round(math.pi, 12): "saddle"}
    w = math.sqrt(9.81)
    within = [line for line in found["separatrices"] if line["other_end"] is not None]
    assert len(within) == 4 and all(line["of"] != line["other_end"] for line in within)
    for line in found["separatrices"]:
        assert line["energy"] == pytest.approx(9.81, rel=1e-12)
        assert line["drift"] < 1e-8
        theta, v = np.array(line["points"]).T
        assert np.abs(np.abs(v) - 2 * w * np.abs(np.cos(theta / 2))).max() < 1e-6
    for path in found["levels"]:
        e = path["energy"] / 9.81
        assert path["kind"] == ("libration" if e < 1 else "rotation")
        m = (1 + e) / 2
        exact = 4 * mpmath.ellipk(m) if e < 1 else 2 * mpmath.ellipk(1 / m) / mpmath.sqrt(m)
        assert path["period"] == pytest.approx(float(exact) / w, rel=1e-7)


@pytest.mark.slow
def test_damping_makes_a_focus_and_then_a_node() -> None:
    """U85: the roots of s^2 + c s + 1 at the bottom, of s^2 + c s - 1 at the top."""
    for c, kind in ((1.9, "stable focus"), (2.1, "stable node")):
        found = portrait("damped_pendulum", set={"c": c}, paths=1)
        assert not found["conserves_energy"]
        bottom, *saddles = sorted(found["equilibria"], key=lambda one: abs(one["values"]["theta"]))
        assert bottom["kind"] == kind and {one["kind"] for one in saddles} == {"saddle"}
        for one, sign in ((bottom, 1), (saddles[0], -1)):
            values = sorted((complex(*v) for v in one["eigenvalues"]), key=lambda z: (z.real, z.imag))
            exact = sorted(np.roots([1, c, sign]).astype(complex), key=lambda z: (z.real, z.imag))
            assert np.allclose(values, exact, rtol=1e-12)
        place = found["equilibria"].index(bottom)
        falls = [line for line in found["separatrices"] if not line["stable"]]
        assert [line["other_end"] for line in falls if not line["leaves"]] == [place, place]


def test_ear_drum_is_kept_by_the_loop_of_its_saddle() -> None:
    """U86: the saddle at x = -1 has the energy 1/6, and its loop goes out to x = 1/2."""
    found = portrait("ear_drum")
    (saddle,) = (one for one in found["equilibria"] if one["kind"] == "saddle")
    assert saddle["values"]["x"] == pytest.approx(-1, abs=1e-12)
    assert saddle["energy"] == pytest.approx(1 / 6, rel=1e-12)
    loops = [line for line in found["separatrices"] if line["other_end"] is not None]
    assert len(loops) == 2
    for line in loops:
        x, v = np.array(line["points"]).T
        assert np.abs(v**2 - (1 / 3 - x**2 - 2 * x**3 / 3)).max() < 1e-7
        assert x.max() == pytest.approx(0.5, abs=1e-3)


def test_double_well_and_its_separatrix() -> None:
    """U87 (b): centres at +-1, a saddle at 0, whose loops go out to sqrt(2)."""
    found = portrait("duffing_free", set={"s": -1})
    assert [(round(o["values"]["x"], 12), o["kind"]) for o in found["equilibria"]] == [
        (-1, "centre"), (0, "saddle"), (1, "centre"),
    ]  # fmt: skip
    furthest = max(abs(p[0]) for line in found["separatrices"] for p in line["points"])
    assert furthest == pytest.approx(math.sqrt(2), abs=2e-3)  # between two points of the path
    for line in found["separatrices"]:
        x, v = np.array(line["points"]).T
        assert np.abs(v**2 - x**2 + x**4 / 2).max() < 1e-7  # so that v = 0 at x^2 = 2


@pytest.mark.slow
def test_cyclic_coordinates_are_reduced() -> None:
    """The effective potential of the Kepler problem: a centre at r = l^2/(m k) with the angular frequency k^2 m/l^3."""
    found = portrait("orbit_equation")
    (one,) = found["equilibria"]
    assert one["values"]["r"] == pytest.approx(1, abs=1e-9) and one["kind"] == "centre"
    assert abs(complex(*one["eigenvalues"][0])) == pytest.approx(1, rel=1e-6)
    for path in found["levels"]:
        if path["closed"]:  # Kepler's third law
            assert path["period"] == pytest.approx(2 * math.pi * (-2 * path["energy"]) ** -1.5, rel=1e-7)
    assert sum(path["closed"] for path in found["levels"]) > 4


@pytest.mark.slow
def test_a_driven_hoop_has_centres_though_its_energy_changes() -> None:
    """The motion goes back the same way with the opposite rate: U109 at w = 5."""
    found = portrait("rotating_hoop", paths=4)
    centres = [one["values"]["theta"] for one in found["equilibria"] if one["kind"] == "centre"]
    assert not found["conserves_energy"] and len(centres) == 2
    assert np.abs(centres) == pytest.approx(math.acos(9.81 / 25), abs=1e-12)


@pytest.mark.slow
def test_states_of_first_order() -> None:
    """Prey and predators: a saddle at the origin, a linear centre where both stay, which may be a focus."""
    text = """\
model Prey
  dimensionless;
  state Real x(min = -1, max = 4) = 1.5;
  state Real y(min = -1, max = 4) = 1;
  equation der(x) = x*(1 - y);
  equation der(y) = y*(x - 1);
end Prey;
"""
    found = mechc.loads(text).portrait(paths=2).summary()
    kinds = {tuple(round(v, 9) for v in one["values"].values()): one["kind"] for one in found["equilibria"]}
    assert kinds == {(0, 0): "saddle", (1, 1): "centre or focus"}


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("stick_slip_belt", "switches"),
        ("heavy_top_rotation", "leave 3 freedoms"),
        ("double_pendulum_points", "cannot be reduced to one"),
        ("driven_pendulum", "depend"),
    ],
)
def test_what_has_no_portrait_is_refused(name: str, said: str) -> None:
    with pytest.raises(SimulationError, match=said):
        portrait(name)


def test_an_axis_that_is_not_there_is_refused() -> None:
    with pytest.raises(SimulationError, match="'c' is not in the picture"):
        portrait("damped_pendulum", over="c = 0 .. 1")
