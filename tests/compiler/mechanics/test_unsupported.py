"""What the equations cannot hold is refused at its place, with a way round it."""

from __future__ import annotations

import pytest
from refusals import refused

CART = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; "


@pytest.mark.parametrize(
    ("text", "place", "way"),
    [
        (CART + "experiment section(stop = 1 s, record = der(x));", "der(x)", "'when'"),
        (
            'coordinate Rotation R(chart = "zxz"); inertia identity(3)*1 kg.m^2 on world*R;',
            'coordinate Rotation R(chart = "zxz");',
            "rotz(a)*rotx(b)*rotz(c)",
        ),
    ],
    ids=["record", "chart"],
)
def test_refusals(text: str, place: str, way: str) -> None:
    (found,) = refused(text)
    assert found.span is not None
    assert (found.code, found.span.text) == ("E0590", place)
    assert way in found.help
