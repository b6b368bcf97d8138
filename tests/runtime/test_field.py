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


def test_states_that_act_are_held_and_named() -> None:
    text = (
        "model Lag coordinate Length x = 1 m; state Length w = 0 m; equation der(w) = (x - w)/0.5 s;"
        " kinetic 1/2*1 kg*der(x)^2; potential 1/2*9 N/m*x^2; force -2 N/m*w on x; end Lag;"
    )
    assert any(remark.startswith("w: held") for remark in mechc.loads(text).field().remarks)
    follows = text.replace("force -2 N/m*w on x;", "")
    assert not any("held" in remark for remark in mechc.loads(follows).field().remarks)
