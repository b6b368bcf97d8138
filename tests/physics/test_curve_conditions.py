"""Curves that their own first integrals, Legendre's or Weierstrass' condition contradict are doubtful.

Weierstrass' excess E = F(w) - F(p) - (w - p) F'(p) by hand.
"""

from __future__ import annotations

import pytest

import mechc
from mechc.runtime.curves.optimality_checks import drifting

RANGE = "dimensionless; independent x from 0 to 1; "

NEWTON = """
model Newton "body of least resistance"
  dimensionless;
  parameter a = {a};
  parameter H = {H};
  independent r from a to 1;
  coordinate u ~ H*(1 - r)/(1 - a);
  initial u = H;
  final u = 0;
  stationary integral(2*r/(1 + der(u)^2));
end Newton;
"""


@pytest.mark.parametrize(
    "text",
    [
        # E = (w - 1)^2 (w + 2) < 0 below -2
        "coordinate u ~ x; initial u = 0; final u = 1; stationary integral(der(u)^3);",
        # the same of second derivatives: u'' is 3 (1 - x), E = (w - p)^2 (w + 2 p)
        "coordinate u ~ x^2; initial u = 0; initial der(u) = 0; final u = 1; stationary integral(der(u, 2)^3);",
        # a maximum of slopes below sqrt 2 only: E = w^4 - 2 w^2
        "coordinate u ~ 0; initial u = 0; final u = 0; stationary integral((der(u)^2 - 1)^2);",
        # two coordinates, one of them alone
        "coordinate u ~ x; coordinate v ~ x; initial u = 0; final u = 1; initial v = 0; final v = 1; "
        "stationary integral(der(v)^2 + der(u)^3);",
    ],
)
def test_extrema_among_neighbouring_slopes_only(text: str) -> None:
    found = mechc.loads(RANGE + text).solve()
    assert found.outcome.value == "doubtful"
    assert any("Weierstrass" in remark for remark in found.remarks)


def test_a_second_derivative_by_the_slope_that_changes_its_sign() -> None:
    """F'' = 2 (x - 0.4): (x - 0.4) u' is the same all along, so that u = 0 is stationary, and no extremum."""
    text = "coordinate u ~ 0; initial u = 0; final u = 0; stationary integral((x - 0.4)*der(u)^2);"
    found = mechc.loads(RANGE + text).solve()
    assert found.outcome.value == "doubtful"
    assert any("Legendre" in remark and "x = 0.4" in remark for remark in found.remarks)


def test_a_steep_body_is_beaten_by_zigzags() -> None:
    """Slopes beyond 1/sqrt 3 all along: F'' > 0, and yet E < 0, for F falls towards zero with every slope."""
    found = mechc.loads(NEWTON.format(a=0.3, H=2)).solve()
    assert (found.kind, found.outcome.value) == ("minimum", "doubtful")
    assert found.first_integrals["momentum(u)"][1] < 1e-12


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("coordinate u ~ x; initial u = 0; final u = 1; stationary integral(sqrt(1 + der(u)^2));", "minimum"),
        ("coordinate u ~ x; initial u = 0; final u = 1; stationary integral(sqrt(2 - der(u)^2));", "maximum"),
        # slopes beyond 1: F = (p^2 - 1)^2 lies above its tangents there
        ("coordinate u ~ 1.5*x; initial u = 0; final u = 1.5; stationary integral((der(u)^2 - 1)^2 + u);", "minimum"),
        # neither minimum nor maximum is said, and the signs are the same all along
        (
            "coordinate u ~ x; coordinate v ~ x/2; initial u = 0; final u = 1; initial v = 0; final v = 0.5; "
            "stationary integral(der(u)^2 - der(v)^2 + u*v);",
            "saddle",
        ),
        # on a cylinder, slopes across it are none
        (
            "coordinate r[3] ~ {cos(pi/2*x), sin(pi/2*x), x}; initial r = {1, 0, 0}; final r = {0, 1, 1}; "
            "constraint surface: r[1]^2 + r[2]^2 = 1; stationary integral(dot(der(r), der(r)));",
            "minimum",
        ),
    ],
)  # fmt: skip
def test_no_doubt_without_cause(text: str, kind: str) -> None:
    found = mechc.loads(RANGE + text).solve()
    assert (found.kind, found.outcome.value, found.remarks) == (kind, "completed", [])


def test_a_momentum_that_varies_says_that_nothing_is_stationary() -> None:
    ranges = {"u": 2.0}
    assert not drifting({"momentum(u)": (0.5, 4e-3), "energy": (1.0, 9e-3)}, 1.0, ranges, 1.0)
    assert "momentum(u)" in drifting({"momentum(u)": (0.09, 6e-2)}, 0.19, ranges, 1.0)
    assert "energy" in drifting({"energy": (0.0, 2e-2)}, 1.0, ranges, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("height", [1, 2])
def test_newtons_body_without_a_bound_has_no_curve(height: float) -> None:
    """A stationary curve keeps C = r p/(1 + p^2)^2 with p = -u': r = C (1 + p^2)^2/p stays above 3 C, and C = 0 has no height.

    Where rounding lets Newton's method end at all, in some zigzag, what it ends at is doubtful.
    """
    try:
        found = mechc.loads(NEWTON.format(a=0, H=height)).solve()
    except mechc.SimulationError as refused:
        assert "no stationary curve" in str(refused)
    else:
        assert found.outcome.value == "doubtful"
        assert any("not stationary" in remark for remark in found.remarks)
