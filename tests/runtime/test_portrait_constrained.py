"""Phase portraits of models whose constraints leave one freedom, against those in free coordinates and closed forms."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from shared_models import FOUR_BAR

import mechc
from mechc.runtime.outcome import SimulationError

G = 9.81


def portrait(text: str, **settings: Any) -> dict[str, Any]:
    found = mechc.loads(text).portrait(**settings).summary()
    assert isinstance(found, dict)
    return found


@pytest.mark.slow
def test_a_pendulum_of_two_tied_coordinates() -> None:
    """Neither x nor y tells where it is: the picture is over the length along the circle, from the start on."""
    found = portrait(
        "model P\n dimensionless;\n coordinate x = 0.6;\n coordinate y ~ -0.8;\n kinetic 1/2*(der(x)^2 + der(y)^2);\n"
        f" potential {G}*y;\n constraint x^2 + y^2 = 1;\nend P;\n",
        paths=6,
    )
    (centre,) = (one for one in found["equilibria"] if one["kind"] == "centre")
    (saddle,) = (one for one in found["equilibria"] if one["kind"] == "saddle" and one["values"]["arc"] > 0)
    low = math.asin(0.6)
    assert centre["values"]["arc"] == pytest.approx(-low, abs=1e-9)
    assert saddle["values"]["arc"] == pytest.approx(math.pi - low, abs=1e-9)
    assert [centre["positions"][q] for q in ("x", "y")] == pytest.approx([0, -1], abs=1e-9)
    assert abs(complex(*centre["eigenvalues"][0])) == pytest.approx(math.sqrt(G), rel=1e-8)
    for line in found["separatrices"]:
        arc, v = np.array(line["points"]).T
        assert np.abs(np.abs(v) - 2 * math.sqrt(G) * np.abs(np.cos((arc + low) / 2))).max() < 1e-6
    kinds = set()
    for path in found["levels"]:
        e = path["energy"] / G
        kinds.add(path["kind"])
        assert path["kind"] == ("libration" if e < 1 else "rotation")
        m = (1 + e) / 2
        exact = 4 * mpmath.ellipk(m) if e < 1 else 2 * mpmath.ellipk(1 / m) / mpmath.sqrt(m)
        assert path["period"] == pytest.approx(float(exact) / math.sqrt(G), rel=1e-7)
    assert kinds == {"libration", "rotation"}


@pytest.mark.slow
def test_a_bead_on_a_rotating_hoop_that_holds_it_by_a_constraint() -> None:
    """At rest to the hoop at the bottom, unstable at this speed, and at cos(theta) = g/(R w^2)."""
    R, w = 0.7, 6.0
    found = portrait(
        "model H\n coordinate x = 0.3 m;\n coordinate z ~ -0.6 m;\n"
        " kinetic 1/2*(2 kg)*(der(x)^2 + der(z)^2 + (6 rad/s)^2*x^2);\n potential (2 kg)*(9.81 m/s^2)*z;\n"
        " constraint x^2 + z^2 = (0.7 m)^2;\nend H;\n",
        paths=1,
    )
    leaning = math.acos(G / (R * w**2))
    rates = {"top": math.sqrt(w**2 + G / R), "bottom": math.sqrt(w**2 - G / R), "side": w * math.sin(leaning)}
    seen = set()
    for one in found["equilibria"]:
        x, z = (one["positions"][q] for q in ("x", "z"))
        name = "side" if abs(x) > 0.01 else "top" if z > 0 else "bottom"
        seen.add(name)
        if name == "side":
            assert abs(x) == pytest.approx(R * math.sin(leaning), abs=1e-9)
        assert one["kind"] == ("centre" if name == "side" else "saddle")
        assert abs(complex(*one["eigenvalues"][0])) == pytest.approx(rates[name], rel=1e-7)
    assert seen == {"top", "bottom", "side"}


def energies_of_four_bar(angle: float) -> tuple[float, float]:
    """Potential and reduced inertia over the angle of the crank: circles that meet, and a derivative by complex steps."""

    def places(a: complex) -> tuple[np.ndarray, ...]:
        b = 0.2 * np.array([np.cos(a), np.sin(a)])
        d = np.array([0.5, 0.0])
        reach = np.sqrt(np.sum((d - b) ** 2))
        along = (0.5**2 - 0.4**2 + reach**2) / (2 * reach)
        across = np.sqrt(0.5**2 - along**2)
        e = (d - b) / reach
        return b, b + along * e + across * np.array([-e[1], e[0]]), d

    def middles(a: complex) -> list[np.ndarray]:
        b, c, d = places(a)
        return [b / 2, (b + c) / 2, (c + d) / 2]

    step = 1e-30
    b, c, d = places(angle + 1j * step)
    masses, lengths = (1.0, 2.0, 1.5), (0.2, 0.5, 0.4)
    V = sum(m * G * float(p[1].real) for m, p in zip(masses, middles(angle), strict=True))
    inertia = 0.0
    for m, l, p, (first, last) in zip(
        masses, lengths, middles(angle + 1j * step), ((0 * b, b), (b, c), (d, c)), strict=True
    ):
        v, bar = p.imag / step, (last - first) / l
        turn = bar[0].real * bar[1].imag / step - bar[1].real * bar[0].imag / step
        inertia += m * float(v @ v) + m * l**2 / 12 * float(turn**2)
    return V, inertia


@pytest.mark.slow
def test_paths_of_a_four_bar_are_levels_of_its_energy() -> None:
    """Over the crank, which goes round: the loop is solved by hand."""
    found = portrait(FOUR_BAR, paths=2)
    assert set(found["equilibria"][0]["values"]) == {"a.angle", "der(a.angle)"}
    for line in found["separatrices"]:
        points = np.array(line["points"])[::40]
        h = [V + inertia * rate**2 / 2 for (V, inertia), rate in
             zip(map(energies_of_four_bar, points[:, 0]), points[:, 1], strict=True)]  # fmt: skip
        assert np.ptp(h) < 1e-7 and h[0] == pytest.approx(line["energy"], abs=1e-7)
    for one in found["equilibria"]:
        a = one["values"]["a.angle"]
        ahead, behind = (energies_of_four_bar(a + s * 1e-4)[0] for s in (1, -1))
        assert abs(ahead - behind) / 2e-4 < 1e-6
        curvature = (ahead - 2 * energies_of_four_bar(a)[0] + behind) / 1e-8
        expected = math.sqrt(abs(curvature) / energies_of_four_bar(a)[1])
        assert (one["kind"] == "centre") is (curvature > 0)
        assert abs(complex(*one["eigenvalues"][0])) == pytest.approx(expected, rel=1e-5)


@pytest.mark.slow
def test_rolling_counts_as_a_tie() -> None:
    """A disk on a parabola, damped: (1 + 1/2) x'' + c x' + x = 0 at the bottom."""
    found = portrait(
        "model R\n dimensionless;\n coordinate x = 1;\n coordinate y ~ 0.5;\n coordinate phi = 0;\n"
        " kinetic 1/2*(der(x)^2 + der(y)^2) + 1/4*der(phi)^2;\n potential y;\n damping 0.1 on x;\n"
        " constraint y = x^2/2;\n constraint der(phi) = sqrt(1 + x^2)*der(x);\nend R;\n",
        paths=1,
    )
    (one,) = found["equilibria"]
    assert one["kind"] == "stable focus" and one["values"]["x"] == pytest.approx(0, abs=1e-9)
    assert abs(complex(*one["eigenvalues"][0])) == pytest.approx(math.sqrt(2 / 3), rel=1e-8)


@pytest.mark.parametrize(
    ("constraints", "over", "said"),
    [
        ("x^2 + y^2 + z^2 = 1", None, "leave 2 freedoms"),
        ("x^2 + y^2 = 1; constraint z = 0", "x = -1 .. 1", "can stand in several positions"),
    ],
)
def test_what_is_no_portrait_is_told(constraints: str, over: str | None, said: str) -> None:
    text = (
        "model M\n dimensionless;\n coordinate x = 0.6;\n coordinate y ~ 0.8;\n coordinate z ~ 0;\n"
        f" kinetic 1/2*(der(x)^2 + der(y)^2 + der(z)^2);\n potential y;\n constraint {constraints};\nend M;\n"
    )
    with pytest.raises(SimulationError, match=said):
        portrait(text, **({"over": over} if over else {}))
