"""The study of a field of forces, where there is none."""

from __future__ import annotations

import pytest

import mechc


@pytest.mark.parametrize("further", ["", "friction 2 N on x;"])
def test_where_no_force_acts_the_potential_is_zero(further: str) -> None:
    model = mechc.loads(
        f"coordinate x = 0 m; coordinate y = 0 m; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); {further}"
    )
    told = model.study("field").summary()
    assert told["conservative"] and told["curl_free"]
    assert "potential: 0" in told["remarks"]
