"""Parameters and inputs that nothing uses are told, those of the model itself alone."""

from __future__ import annotations

import pytest
from flat_models import said

CART = "coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2;"
PART = """
model Part
  parameter m = 1 kg;
  parameter spare = 2 kg;
  coordinate x = 0 m;
  kinetic 1/2*m*der(x)^2;
end Part;
"""


def unused(text: str) -> list[str]:
    found = said(text)
    assert {d.code for d in found} <= {"W0402"}
    return [d.message for d in found]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (CART + "parameter k = 1 N/m;", ["parameter 'k'"]),
        (CART + "input Force u = 0;", ["input 'u'"]),
        (CART + "parameter k = 1 N/m; experiment(k = 2 N/m, stop = 1 s);", ["parameter 'k'"]),
        (CART + "parameter k = 1 N/m; parameter twice = 2*k;", ["parameter 'twice'"]),
        (
            CART + "structural parameter Boolean b = false; if b then parameter k = 1 N/m; end if;",
            ["parameter 'k'"],
        ),
        (PART + "model M  parameter m = 2 kg; Part p(m = 3 kg); end M;", ["parameter 'm'"]),
        (PART + "model M  parameter m = 2 kg; Part p(m = m); end M;", []),
        (PART + "model M  parameter n = 2 kg; extends Part(m = n); end M;", []),
        (CART + "parameter k = 1 s; experiment(stop = 2*k);", []),
        (CART + 'parameter k = 1 N/m; assert k > 0 N/m, "soft";', []),
        (
            CART
            + "structural parameter Boolean b = false; parameter k = 1 N/m; if b then potential k*x^2; end if;",
            [],
        ),
        (CART + "parameter a[3] = {1, 2, 3} N; for i in 1:3 loop force a[i] on x; end for;", []),
        (PART, ["parameter 'spare'"]),
    ],
)
def test_what_nothing_uses_is_told(text: str, names: list[str]) -> None:
    assert unused(text) == [f"nothing uses the {name}" for name in names]


PUSHED = "model Part input Angle from; input Torque push; force push on from; end Part; model Whole extends Part; Part inner(from = from); end Whole; "
TURNING = " coordinate Angle q = 0 rad; kinetic 1/2*1 kg.m^2*der(q)^2; "


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("Part p(from = q);", ["p.push"]),
        ("Part p(from = q, push = 1 N.m);", []),
        ("input Torque push; Part p(from = q, push = push);", []),
        ("Part p(from = q); experiment(stop = 1 s, p.push = 2 N.m);", []),
        ("Part p(from = q); experiment e(stop = 1 s, p.push in {1, 2} N.m);", []),
        ("Part p[3](from = q);", ["p.push"]),
        ("Part p[2](from = q, push = {1, 2} N.m);", []),
        ("Whole p(from = q, push = 1 N.m);", ["p.inner.push"]),
        ("input Torque push; force push on q;", []),
    ],
)
def test_inputs_of_components_that_nothing_sets(body: str, expected: list[str]) -> None:
    """They are 0 without a word otherwise; those of the model itself are what it asks from outside."""
    found = [d for d in said(f"{PUSHED}model M {TURNING} {body} end M;") if d.code == "W0403"]
    assert [d.message.split("'")[1] for d in found] == expected
