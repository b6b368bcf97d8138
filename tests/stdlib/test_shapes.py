"""Mass properties of shapes against integrals over their points."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import mechc

Array = NDArray[np.float64]


def revolved(
    low: float, high: float, outer: object, inner: object = lambda z: 0.0 * z
) -> tuple[float, Array, Array]:
    """Return volume, centre and tensor about the centre of a body of revolution about z, by Gauss's rule."""
    x, w = np.polynomial.legendre.leggauss(200)
    z, w = 0.5 * (high - low) * x + 0.5 * (high + low), 0.5 * (high - low) * w
    a, b = inner(z), outer(z)  # type: ignore[operator]
    area, second = np.pi * (b**2 - a**2), np.pi / 4 * (b**4 - a**4)  # of a section, about its diameter
    volume, first = float(w @ area), float(w @ (area * z))
    centre = first / volume
    across = float(w @ (second + area * (z - centre) ** 2))
    return volume, np.array([0.0, 0.0, centre]), np.diag([across, across, float(w @ (2 * second))])


def torus(r: float, s: float) -> tuple[float, Array, Array]:
    x, w = np.polynomial.legendre.leggauss(400)
    angle, w = np.pi / 2 * x, np.pi / 2 * w
    z, dz = s * np.sin(angle), s * np.cos(angle)
    half = s * np.cos(angle)
    a, b = r - half, r + half
    area, second = np.pi * (b**2 - a**2), np.pi / 4 * (b**4 - a**4)
    across = float((w * dz) @ (second + area * z**2))
    return float((w * dz) @ area), np.zeros(3), np.diag([across, across, float((w * dz) @ (2 * second))])


def scaled(radii: tuple[float, float, float]) -> tuple[float, Array, Array]:
    """Return an ellipsoid as a stretched ball, of which the integral of x^2 is 4 pi/15."""
    volume = 4 / 3 * np.pi * np.prod(radii)
    squares = np.array(radii) ** 2 * volume / 5
    return float(volume), np.zeros(3), np.diag(squares.sum() - squares)


SHAPES = {
    "Hemisphere b(r = 0.7 m)": revolved(0, 0.7, lambda z: np.sqrt(np.maximum(0.49 - z**2, 0))),
    "Cone b(r = 0.4 m, h = 1.3 m)": revolved(0, 1.3, lambda z: 0.4 * (1 - z / 1.3)),
    "Frustum b(r = 0.6 m, top = 0.25 m, h = 0.9 m)": revolved(0, 0.9, lambda z: 0.6 - 0.35 * z / 0.9),
    "Frustum b(r = 0.4 m, h = 1.3 m)": revolved(0, 1.3, lambda z: 0.4 * (1 - z / 1.3)),
    "Ellipsoid b(radii = {0.3, 0.5, 0.8} m)": scaled((0.3, 0.5, 0.8)),
    "Torus b(r = 0.8 m, section = 0.3 m)": torus(0.8, 0.3),
    "Sphere b(r = 0.6 m)": scaled((0.6, 0.6, 0.6)),
    "Cylinder b(r = 0.5 m, inner = 0.2 m, l = 1.1 m)": revolved(
        -0.55, 0.55, lambda z: 0.5 + 0 * z, lambda z: 0.2 + 0 * z
    ),
}


@pytest.mark.parametrize("text", SHAPES)
def test_mass_properties(text: str) -> None:
    """Gauss's rule is exact but for the root of the hemisphere: 1e-6 there."""
    volume, centre, tensor = SHAPES[text]
    model = mechc.loads(
        f"import mech.spatial.*; model M {text}; Free f(world -> b.a); experiment(stop = 1 s); end M;"
    )
    (body,) = model.inertia().details["bodies"]
    close = 1e-6 if "Hemisphere" in text else 1e-12
    assert body["mass"] == pytest.approx(1000 * volume, rel=close)
    assert np.allclose(body["centre"], centre, atol=close)
    assert np.allclose(body["tensor"], 1000 * tensor, rtol=close, atol=1000 * volume * close)
