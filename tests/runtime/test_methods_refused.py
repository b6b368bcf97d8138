"""Structure-preserving methods say what in a model they cannot take."""

from __future__ import annotations

import pytest

import mechc
from mechc.runtime.outcome import SimulationError

MASS = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*x^2; "
SPIN = "coordinate Rotation R; inertia diag({1, 2, 3} kg.m^2) on world * R; "
SLED = (
    "coordinate u = 0 m; coordinate v = 0 m; coordinate th = 0 rad; constraint k: der(v)*cos(th) = der(u)*sin(th);"
    "kinetic 1/2*1 kg*(der(u)^2 + der(v)^2) + 1/2*1 kg.m^2*der(th)^2; "
)
ROD = "coordinate y ~ 0 m; kinetic 1/2*1 kg*der(y)^2; constraint rod: x^2 + y^2 = 1 m^2; "
LAG = "state Force f = 0; equation der(f) = -f/1 s; "
RATE = "coordinate Angle phi; drive der(phi) = 1 rad/s; mass 1 kg at world * rot(phi) * {x, 0}; "


@pytest.mark.parametrize(
    ("method", "text", "obstacle"),
    [
        ("rattle", SPIN, "rotations"),
        ("lobatto4", SPIN + LAG, "rotations, .* and first-order states"),
        ("lobatto6", SLED, "constraints between velocities"),
        ("rattle", MASS + LAG, "first-order states"),
        ("rattle", MASS + RATE, "of which the rate alone is prescribed"),
        ("verlet", MASS + RATE, "of which the rate alone is prescribed"),
        ("rattle", MASS + "friction 0.1 N on x;", "dry friction"),
        ("lobatto6", MASS + "contact wall: x;", "contacts"),
        ("verlet", SPIN, "rotations"),
        ("verlet", MASS + ROD, "constraints, for which there are 'rattle'"),
        ("verlet", MASS + "damping 1 N.s/m on x;", "accelerations that depend on velocities"),
    ],
)
def test_the_reason_is_said(method: str, text: str, obstacle: str) -> None:
    with pytest.raises(SimulationError, match=rf"^'{method}' cannot run this model: it has .*{obstacle}"):
        mechc.loads(text).simulate(stop=1, step=0.01, method=method)


def test_what_fits_runs() -> None:
    for method, text in (
        ("verlet", MASS),
        ("rattle", MASS + ROD),
        ("lobatto4", MASS + "damping 1 N.s/m on x;"),
    ):
        solution = mechc.loads(text).simulate(stop=0.1, step=0.01, method=method, estimate_error=False)
        assert isinstance(solution, mechc.Solution) and solution.outcome.value == "completed"
