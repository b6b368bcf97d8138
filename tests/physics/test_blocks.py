"""Blocks that take the dimension of what they are given: inputs without a type, `typeof(e)`, states that begin at zero.

Judges: closed forms, and the same model with the types written out.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import mechc

LAG = """
model Lag
  input u;
  parameter Time T = 1 s;
  state y ~ 0;
  equation der(y) = (u - y)/T;
end Lag;
"""
BLOCK = """
model FirstOrder "k/(T s + 1)"
  input u = 0;
  parameter k = 1;
  parameter Time T = 1 s;
  state typeof(k*u) y = 0;
  equation der(y) = (k*u - y)/T;
  let typeof(u) left = u - y/k;
  output typeof(k*u) twice = 2*y;
end FirstOrder;
"""


def test_a_lag_of_a_length_is_a_length() -> None:
    text = LAG + (
        "model M\n coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2; Lag l(u = x, T = 0.1 s); force -3 N/m*l.y on x;\n"
        " experiment(stop = 2 s);\nend M;"
    )
    written = text.replace("input u;", "input Length u;").replace("state y", "state Length y")
    a, b = (mechc.loads(t).simulate(estimate_error=False) for t in (text, written))
    assert np.array_equal(a["x"], b["x"])
    assert a.unit("l.y") == "m"


def test_one_block_of_three_dimensions() -> None:
    text = BLOCK + (
        "model M\n coordinate Length x = 1 m; coordinate Angle a = 1 rad; initial der(x) = 2 m/s; initial der(a) = 0 rad/s;\n"
        " kinetic 1/2*1 kg*der(x)^2 + 1/2*1 kg.m^2*der(a)^2; FirstOrder f(u = x, T = 0.5 s); FirstOrder g(u = a, k = 3);\n"
        " FirstOrder h(u = der(x)); experiment(stop = 1 s);\nend M;"
    )
    found = mechc.loads(text).simulate(estimate_error=False)
    t = found.time
    assert [found.unit(n) for n in ("f.y", "g.y", "h.y", "f.twice", "g.twice")] == [
        "m",
        "rad",
        "m/s",
        "m",
        "rad",
    ]
    # x = 1 + 2 t after a lag of T: 1 - 2 T + 2 t + (2 T - 1) exp(-t/T)
    assert found["f.y"] == pytest.approx(2 * t, abs=1e-7)
    assert found["g.y"] == pytest.approx(3 * (1 - np.exp(-t)), abs=1e-7)
    assert found["h.y"] == pytest.approx(2 * (1 - np.exp(-t)), abs=1e-7)


def test_states_follow_each_other() -> None:
    text = (
        "model Second\n input u = 0; state y ~ 0; state z ~ 0; equation der(z) = (y - z)/(1 s); equation der(y) = (u - y)/(1 s); end Second;\n"
        "model M\n coordinate Length x = 1 m; initial der(x) = 0 m/s; kinetic 1/2*1 kg*der(x)^2; Second s(u = x); experiment(stop = 1 s);\nend M;"
    )
    found = mechc.loads(text).simulate(estimate_error=False)
    assert found["s.z"] == pytest.approx(1 - (1 + found.time) * np.exp(-found.time), abs=1e-7)


@pytest.mark.parametrize(
    "text",
    [
        "state a = 0; state b = 0; equation der(a) = (1 - b)/(1 s); equation der(b) = a/(1 s);",
        "state a = 0; let e = 1 - a; equation der(a) = e/(1 s);",
        "state a[2] = 0; equation der(a[1]) = a[2]/(1 s); equation der(a[2]) = -a[1]/(1 s);",
        "dimensionless; state a = 0; equation der(a) = 1 - a;",
    ],
)
def test_plain_numbers_stay_plain(text: str) -> None:
    model = mechc.loads(
        text + " experiment(stop = 1);" if "dimensionless" in text else text + " experiment(stop = 1 s);"
    )
    assert model.simulate(estimate_error=False).unit(next(q.name for q in model.states)) == ""


def test_functions_may_say_it_too() -> None:
    text = (
        "function doubled(x)\n let typeof(x) y = 2*x;\n return y;\nend doubled;\n"
        "coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2; output Length d = doubled(x); experiment(stop = 1 s);"
    )
    assert mechc.loads(text).simulate(estimate_error=False)["d"][0] == 2.0


USED = "coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\n"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (USED + "state typeof(x) y = 1 s; equation der(y) = x/(1 s);", "E0303"),
        (USED + "state typeof(y) y = 0; equation der(y) = x/(1 s);", "E0207"),
        (USED + "state typeof(z) y = 0; equation der(y) = x/(1 s);", "E0201"),
        (USED + "state typeof(x < 1 m) y = 0; equation der(y) = 0/(1 s);", "E0303"),
        (USED + "state y ~ 0; equation der(y) = (x - y)/(1 s); force y on x;", "E0322"),
        ("function f(typeof(x) y) = y;\n" + USED, "E0110"),
        ("independent typeof(x) t;\n" + USED, "E0110"),
        (USED + "state typeof x y = 0;", "E0110"),
        ("model B\n input u; output y = 2*u; end B;\nmodel M\n B b;\nend M;", "E0327"),
    ],
)
def test_wrong_models(text: str, code: str) -> None:
    caught = refused(text)
    assert caught[0].code == code, caught[0].message


def test_the_formatter_keeps_it(tmp_path: Path) -> None:
    from mechc.cli.main import run

    text = "state typeof(k*u) y[3] = 0;\nlet typeof(u) e = u - y;\n"
    file = tmp_path / "m.mech"
    file.write_text(text)
    assert run(["fmt", str(file)]) == 0
    assert file.read_text() == text
