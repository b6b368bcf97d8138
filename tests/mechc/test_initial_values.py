"""Initial values that are stated with those of others follow what a run sets."""

from __future__ import annotations

from pathlib import Path

import pytest

import mechc

TEXT = """
coordinate Length x = 1 m;
coordinate Length y = 2*x;
initial der(x) = 2 m/s;
initial der(y) = 3*x/1 s + der(x);
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
experiment(stop = 1 ms, x = 3 m);
experiment declared(stop = 1 ms);
"""


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, (3, 6, 2, 11)),
        ({"experiment": "declared"}, (1, 2, 2, 5)),
        ({"set": {"x": "5 m"}}, (5, 10, 2, 17)),
        ({"set": {"der(x)": 1}}, (3, 6, 1, 10)),
        ({"set": {"y": 0.5, "der(y)": 0}}, (3, 0.5, 2, 0)),
    ],
)
def test_they_follow_settings(options: dict[str, object], expected: tuple[float, ...]) -> None:
    solution = mechc.loads(TEXT).simulate(estimate_error=False, target="python", **options)  # type: ignore[arg-type]
    start = tuple(solution[name][0] for name in ("x", "y", "der(x)", "der(y)"))
    assert start == pytest.approx(expected, abs=1e-14)


def test_rates_of_any_size_are_assembled() -> None:
    """A four-bar driven at 1e7 rad/s: its rates are the same multiples of the speed as at 10 rad/s."""
    model = mechc.load(Path(__file__).parents[2] / "examples" / "four_bar.mech")
    slow, fast = (
        model.simulate(set={"speed": speed}, stop=0.0, estimate_error=False) for speed in (10.0, 1e7)
    )
    for name in ("der(b.angle)", "der(d.angle)"):
        assert fast[name][0] / 1e7 == pytest.approx(slow[name][0] / 10, rel=1e-11)
