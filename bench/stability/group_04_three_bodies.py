"""Three bodies that meet closely, and three that return for ever."""

from __future__ import annotations

import numpy as np

from .case import Case, Followed, Measured, drift

NUMBER = 4
TITLE = "Close encounters and choreographies"

PYTHAGOREAN = """
dimensionless;
parameter Real m[3] = {3, 4, 5};
coordinate Real r[3, 2] = {{1, 3}, {-2, -1}, {1, -1}};
for i in 1:3 loop
  kinetic 1/2*m[i]*dot(der(r[i]), der(r[i]));
  for j in i+1:3 loop
    potential -m[i]*m[j]/norm(r[i] - r[j]);
  end for;
end for;
experiment(stop = 70, tolerance = 1e-13);
"""
FIGURE = "examples/figure_eight.mech"
PERIOD = 6.32591398

CASES = (
    Case(
        "Pythagorean problem until its closest encounter",
        "two bodies pass at 4e-4 at t = 15.83; errors grow by 1e6",
        PYTHAGOREAN,
        Followed("follows the reference to 1e-5", 1e-5, seconds=20),
        fault="loose",
        options={"stop": 16},
    ),
    Case(
        "Pythagorean problem to the escape",
        "all close encounters, to t = 70",
        PYTHAGOREAN,
        Followed(
            "owns up to it: after the closest encounters not a digit is left", 10, seconds=60, least=0.8
        ),
        fault="understated",
        full=True,
        seconds=200,
    ),
    Case(
        "energy of the Pythagorean problem",
        "accelerations between 0.1 and 1e8",
        PYTHAGOREAN,
        Measured("keeps energy to 1e-9", drift, 1e-9),
        fault="loose",
    ),
    Case(
        "figure eight, 100 periods",
        "a long run at a tight tolerance; the initial values hold 9 digits",
        FIGURE,
        Measured(
            "back at the start to 1e-4",
            lambda s: float(np.hypot(s["r[1,1]"][-1] - 0.97000436, s["r[1,2]"][-1] + 0.24308753)),
            1e-4,
        ),
        fault="loose",
        options={"stop": 100 * PERIOD, "tolerance": 1e-13},
    ),
    Case(
        "figure eight against the reference",
        "the same, followed to 1e-8",
        FIGURE,
        Followed("follows the reference to 1e-8", 1e-8, seconds=20),
        fault="loose",
        options={"stop": 20 * PERIOD, "tolerance": 1e-13},
    ),
)
