"""Powers of forces: by their names, and of a force on a coordinate."""

from __future__ import annotations

import pytest
from compiled import compiled, outcome

from mechc.lang.diagnostics import CompileError

SLIDER = "parameter m = 2 kg; coordinate x = 0 m; kinetic 1/2*m*der(x)^2;"


@pytest.mark.parametrize(
    ("statements", "question", "power"),
    [
        ("force push: 3 N on x;", "power(push)", 12),
        ("force push: 3 N on x;", "push.power", 12),
        ("force 3 N on x;", "power(3 N, x)", 12),
        ("damping oil: 5 N.s/m on x;", "power(oil)", -80),
        ("damping oil: 5 N.s/m on 2*x;", "oil.power", -320),
        ('friction pad: 7 N on x, law = "regularized", v_stick = 1 um/s;', "power(pad)", -28),
        ("coordinate Length s; drive s = 1 m/s*time; kinetic 1/2*m*der(s)^2;", "power(3 N, s)", 3),
    ],
)
def test_powers(statements: str, question: str, power: float) -> None:
    """Force times rate at der(x) = 4 m/s; friction is fully sliding at 4e6 times its speed of creeping."""
    model = compiled(f"{SLIDER} {statements} output p = {question};")
    assert outcome(model, "outputs", {"x": 1.0, "der(x)": 4.0})["p"] == pytest.approx(power, rel=1e-14)


@pytest.mark.parametrize(
    ("question", "words"),
    [
        ("power(3 J, x)", "a force on 'x' is a force (N), this is an energy (J)"),
        ("power({1, 2} N, x)", "this is a vector of 2 forces (N)"),
        ("power(3 N, r)", "'power(f, q)' asks about one coordinate, 'r' has several numbers"),
    ],
)
def test_wrong_powers(question: str, words: str) -> None:
    with pytest.raises(CompileError) as caught:
        compiled(f"{SLIDER} coordinate Length r[2] = 0 m; output p = {question};")
    assert words in caught.value.diagnostics[0].message
