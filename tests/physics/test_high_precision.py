"""References in higher precision agree with the published 30-digit values, to the digits that both claim.

Numbers that a model states are decimals for both. What an experiment or a test sets is a double: it is chosen so that
it is one exactly, or the agreement ends at its rounding, which ``rounded`` says.
"""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import mpmath
import pytest
from gallery import EXAMPLES, stars
from msgspec import Struct, field

import mechc
from mechc.measurement.benchmark import reference_at
from mechc.runtime.reference.high_precision import best_precision

DATA = Path(__file__).parent / "data"
EXACT = 1e-26
"""Relative; the published numbers have 30 digits of which the last ones are lost by cancellation."""


class Case(Struct, frozen=True):
    """``names``: state by published name. ``until``: the last time that is compared."""

    example: str
    data: str
    names: dict[str, str]
    until: float
    experiment: str | None = None
    model: str | None = None
    case: str = ""
    values: dict[str, float] = field(default_factory=dict)
    rounded: float = 0.0

    def __str__(self) -> str:
        return "-".join(filter(None, (self.example, self.model, self.experiment, self.case)))


PLANE = {"x": "x", "y": "y", "vx": "der(x)", "vy": "der(y)"}
EULER = {"theta": "theta", "phi": "phi", "psi": "psi"}
EULER |= {f"{k}dot": f"der({k})" for k in ("theta", "phi", "psi")}
BARS = {"q1": "q1", "q2": "q2", "u1": "der(q1)", "u2": "der(q2)"}
WRONG = "DoublePendulumAsPublished"
ANGLES = ("beta", "theta", "gamma", "phi", "delta", "omega", "epsilon")

FAST = ("kepler", "double_pendulum_points", "heavy_symmetric_top")

CASES = [
    Case("kepler", "kepler_eccentricity_family", PLANE, 20, case="e=0.5", values={"e": 0.5}),
    Case(
        "double_pendulum_points",
        "double_pendulum_point_masses",
        {"th1": "th1", "th2": "th2", "w1": "der(th1)"},
        10,
    ),
    Case("double_pendulum_bars", "thesis_double_pendulum_2d_right_caseA", BARS, 10),
    Case("double_pendulum_bars", "thesis_double_pendulum_2d_aswritten_caseA", BARS, 10, model=WRONG),
    Case(
        "elastic_pendulum_parts",
        "elastic_pendulum_1_2",
        {"x": "guide.position[1]", "y": "guide.position[2]", "vx": "der(guide.position[1])"},
        10,
    ),
    Case("heavy_symmetric_top", "heavy_symmetric_top", EULER, 10),
    Case("spherical_pendulum", "spherical_pendulum", {k: v for k, v in EULER.items() if "psi" not in k}, 10),
    Case("van_der_pol", "van_der_pol_mu10", {"x": "x", "v": "v"}, 20),
    Case("duffing_double_well", "duffing_double_well", {"x": "x", "v": "der(x)"}, 10),
    Case(
        "driven_pendulum", "driven_pendulum_baker_gollub_g0p9", {"theta": "theta", "omega": "der(theta)"}, 10
    ),
    Case("rotating_hoop", "bead_on_rotating_hoop", {"theta": "theta", "thetadot": "der(theta)"}, 10),
    Case("dzhanibekov", "dzhanibekov_free_body", {f"w{k}": f"der(R)[{k}]" for k in (1, 2, 3)}, 10),
    Case("figure_eight", "figure_eight_choreography", stars(3), 7),
    Case("pleiades", "pleiades", stars(7), 1),
    Case("pendulum_cartesian", "pendulum_dae", PLANE, 10, rounded=1e-12),
    Case("chaplygin_sleigh", "chaplygin_sleigh", {"x": "x", "y": "y", "theta": "theta"}, 10, rounded=1e-12),
    Case(
        "squeezing_mechanism",
        "andrews_squeezer",
        {k: k for k in ANGLES} | {f"{k}dot": f"der({k})" for k in ANGLES},
        0.01,
        rounded=1e-9,
    ),
]


@pytest.mark.parametrize(
    "case", [pytest.param(c, id=str(c), marks=[] if c.example in FAST else [pytest.mark.slow]) for c in CASES]
)
def test_agreement(case: Case) -> None:
    if best_precision() != "__float128":
        pytest.skip("this C compiler has no __float128")
    published = json.loads((DATA / f"{case.data}.json").read_text(encoding="utf-8"))["references"]
    points = [
        p
        for p in published
        if p.get("case", "").split(",")[0] == case.case and (case.rounded or _is_double(p["t"]))
    ]
    points = [p for p in points if float(p["t"]) <= case.until]
    assert points
    model = mechc.load(EXAMPLES / f"{case.example}.mech", model=case.model, set=dict(case.values))
    model = model.for_experiment(case.experiment)
    made = reference_at(model, [float(p["t"]) for p in points], experiment=case.experiment, seconds=3)
    states = [entry.name for entry in model.compilation.equations.states]
    with mpmath.workdps(50):
        for row, point in enumerate(points):
            # an error of the reference is its doubt; two runs may differ by less than they are wrong
            claimed = max(10 * float(made.doubt[row]), EXACT, case.rounded)
            for name, state in case.names.items():
                k = states.index(state)
                value = mpmath.mpf(made.high[row, k]) + mpmath.mpf(made.low[row, k])
                expected = mpmath.mpf(point["values"][name])
                error = abs(value - expected) / (made.nominal[k] + abs(expected))
                assert error <= claimed, (point["t"], name, float(error), claimed)


def _is_double(text: str) -> bool:
    """Tell whether a published time is a double exactly, so that both mean the same instant."""
    try:
        return Fraction(text) == Fraction(float(text))
    except ValueError:
        return False
