"""``sample()`` and ``initial()`` are instants: they belong to ``when``, and continuous formulas refuse them."""

from __future__ import annotations

import pytest
from refusals import refused

import mechc

SLIDER = "coordinate Length x = 0.3 m; coordinate Length y = 1 m; kinetic 1/2*2 kg*(der(x)^2 + der(y)^2);"


@pytest.mark.parametrize("instant", ["sample(0.1 s)", "sample(0.1 s, 1 s)", "initial()"])
@pytest.mark.parametrize(
    "statement",
    [
        "force if T then 1 N else 0 N on x;",
        "potential if T then 1 N*x else 0 J;",
        "damping if T then 1 N.s/m else 0 N.s/m on x;",
        "friction if T then 1 N else 0 N on x;",
        "contact c: y - (if T then 0.1 m else 0 m) friction 0.1 along der(x);",
        "contact c: y friction if T then 0.1 else 0.2 along der(x);",
        "constraint c: y = if T then 1 m else 2 m;",
        "state s = 0; equation der(s) = if T then 1 Hz else 0 Hz;",
        "output seen = if T then 1 else 0;",
        'assert not T, "an instant";',
        "let tick = T; force if tick then 1 N else 0 N on x; when tick then reinit(der(x), 1 m/s); end when;",
    ],
)
def test_instants_in_continuous_formulas(statement: str, instant: str) -> None:
    caught = refused(SLIDER + statement.replace("T", instant, 1))
    assert {d.code for d in caught if d.code.startswith("E")} == {"E0721"}
    assert f"'{instant}'" in caught[-1].message


def test_a_discrete_variable_keeps_what_an_instant_sets() -> None:
    """n counts the ticks at 0, 0.1, ... 0.9 s; 2 a = n gives a speed of 0.05 (1 + ... + 10)."""
    text = "discrete n = 0; when sample(0.1 s) then n := n + 1; end when; force 1 N*n on x;"
    solution = mechc.loads(SLIDER + text).simulate(stop=1 - 1e-9)
    assert solution["der(x)"][-1] == pytest.approx(2.75, rel=1e-7)
