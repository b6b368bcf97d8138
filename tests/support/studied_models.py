"""A small model for each kind of study, and the settings with which it is asked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

WELL = """\
model Well
  dimensionless;
  coordinate x = 1;
  kinetic 1/2*der(x)^2;
  potential {potential};
  output square = x^2;
  experiment(stop = 300);
end Well;
"""

BODY = """\
model Slider
  coordinate x = 1 m;
  frame b = world * trans({x, 0 m, 0 m});
  mass 2 kg at b;
  output place = pos(b);
  experiment(stop = 300 s);
end Slider;
"""

ASKED = {
    "curves": """\
model String
  dimensionless;
  parameter k = 1;
  independent x from 0 to 1;
  coordinate y ~ x;
  initial y = 0;
  final y = 1;
  stationary integral(der(y)^2 + k*y^2);
end String;
""",
    "scattering": """\
model Particle
  dimensionless;
  coordinate x = -10;
  coordinate y = 1;
  initial der(x) = 1;
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential 1/(x^2 + y^2);
end Particle;
""",
    **dict.fromkeys(
        ("hysteresis", "diagram"),
        """\
model Lag
  dimensionless;
  parameter u = 0;
  state Real x = 0;
  equation der(x) = u - x;
end Lag;
""",
    ),
    "response": """\
model Pushed
  dimensionless;
  input u = 0;
  coordinate x = 1;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  damping 0.1 on x;
  force u on x;
end Pushed;
""",
    "steady": """\
model Orbit
  dimensionless;
  coordinate r(min = 0.1) = 1;
  coordinate phi = 0;
  initial der(phi) = 1;
  kinetic 1/2*(der(r)^2 + r^2*der(phi)^2);
  potential -1/r;
end Orbit;
""",
    "inertia": BODY,
    "kinematics": BODY,
}
"""Models for questions that are not asked of a well."""

SETTINGS: Mapping[str, Mapping[str, str | float]] = {
    "fit": {"data": "data.csv", "vary": "x"},
    "optimum": {"vary": "x = 0.5 .. 2", "goal": "-(x - 1)^2", "stop": 3},
    "hysteresis": {"over": "u = 0 .. 1, 3", "hold": 3},
    "diagram": {"over": "u = 0 .. 1, 3", "hold": 3, "every": 0.1},
    "threshold": {"over": "x = 0.5 .. 2", "reaches": "x = -1", "stop": 4},
    "gradient": {"to": "x", "goal": "-(x - 1)^2", "stop": 3},
    "curves": {"over": "k = 0 .. 2"},
    "task": {"observe": "x, der(x)", "reward": "-x^2", "every": 0.1, "stop": 3, "episodes": 2},
    "ensemble": {"vary": "x = 0.5 .. 2, 3", "stop": 3},
}
"""What some kinds are not asked without; the measured motion is in ``data.csv``."""


def model_of(name: str) -> str:
    return ASKED.get(name, WELL.format(potential="1/2*x^2"))


def settings_of_kind(name: str, unused: frozenset[str]) -> dict[str, str | float]:
    """Give the settings of a kind; without any, a motion is followed for three seconds."""
    return dict(SETTINGS.get(name, {} if "stop" in unused else {"stop": 3}))


def write_measured(folder: Path) -> Path:
    """Write the measured motion of the well to ``data.csv``."""
    path = folder / "data.csv"
    rows = "".join(f"{t / 10},{math.cos(t / 10)!r}\n" for t in range(31))
    path.write_text("time,x\n" + rows, encoding="utf-8")
    return path
