"""Studies that a file states: what they are, how they are asked, and what is said where they are wrong."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import mechc
from mechc.cli.main import run as run_command
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.printing.printer import format_file
from mechc.lang.source import SourceFile
from mechc.runtime.studies.findings import Findings

TEXT = """\
model Swing
  dimensionless;
  parameter w = 2;
  coordinate x = 1;
  kinetic 1/2*der(x)^2;
  potential 1/2*w^2*x^2;
  experiment(stop = 20);
  experiment fast(w = 4, stop = 20);
  study swing = period();
  study crossings = section(where = "x = 0", count = 5, direction = down) "every other one";
  study strobe = section(every = 2*pi/w, count = 3, experiment = fast);
  study mean = virial(of = {x, der(x)}, stop = 30, estimate_error = false);
  study chart = floquet(period = 1, over = w in linspace(1, 2, 3));
end Swing;
"""


def test_they_are_asked_by_name() -> None:
    model = mechc.loads(TEXT)
    assert list(model.studies) == ["swing", "crossings", "strobe", "mean", "chart"]
    assert model.studies["crossings"].doc == "every other one"
    swing, mean = model.study("swing"), model.study("mean")
    assert isinstance(swing, Findings) and isinstance(mean, Findings)
    assert swing["period"] == pytest.approx(3.141592653589793, rel=1e-13)
    found = model.study("crossings").summary()
    assert found["count"] == 5 and found["points"][0]["der(x)"] < 0
    assert model.study("crossings", count=2).summary()["count"] == 2
    fast = model.study("strobe").summary()["points"]
    assert [point["time"] for point in fast] == pytest.approx([0, 1.5707963267948966, 3.141592653589793])
    assert {value.name for value in mean.values} >= {"x", "der(x)"}
    assert model.study("chart").summary()["parameters"] == {"w": [1.0, 1.5, 2.0]}
    assert model.period(set={"w": 1})["period"] == pytest.approx(6.283185307179586)


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "swing.mech"
    file.write_text(TEXT, encoding="utf-8")
    assert run_command(["study", str(file), "--list"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert len(listed) == 5 and listed[0] == "study swing = period()"
    assert run_command(["study", str(file), "swing", "crossings", "--json", "--plots", str(tmp_path)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["studies"]) == {"swing", "crossings"} and found["studies"]["swing"]["study"] == "period"
    assert (tmp_path / "swing.png").is_file()
    assert run_command(["study", str(file), "swign"]) == 2
    assert "did you mean 'swing'" in capsys.readouterr().err


def test_studies_are_listed_by_the_words_of_the_language(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """'inputs' was listed as 'driven', by which the settings are called inside."""
    file = tmp_path / "cart.mech"
    file.write_text(
        "model Cart  input Force F = 0 N; coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2; force F on x;"
        "study l = linearize(inputs = {F}, outputs = {x}); end Cart;",
        encoding="utf-8",
    )
    assert run_command(["study", str(file), "--list"]) == 0
    assert capsys.readouterr().out == "study l = linearize(inputs = F, outputs = x)\n"
    assert run_command(["study", str(file), "--list", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["studies"]["l"]["settings"] == {"inputs": "F", "outputs": "x"}


def test_a_section_of_several_models_names_what_answers() -> None:
    """It was sent to 'section' itself."""
    model = mechc.loads(
        "structural parameter Integer n = 2; coordinate x[n] = 1 m; kinetic sum(1/2*1 kg*der(x[i])^2 for i in 1:n);"
        "experiment(n in {1, 2}, stop = 1 s);"
    )
    with pytest.raises(mechc.SimulationError) as refused:
        model.study("section", where="x[1] = 0", count=2)
    assert "'sweep' answers for each value" in refused.value.help and "section" not in refused.value.help


def test_the_printer_keeps_them() -> None:
    def printed(text: str) -> str:
        return format_file(parse(SourceFile("swing.mech", text), Reporter()))

    assert printed(TEXT) == TEXT
    assert printed(TEXT.replace("count = 5,", "count=5  ,")) == TEXT


def test_a_base_hands_its_studies_on() -> None:
    text = TEXT + "model Other extends Swing(w = 3); study swing = period(energy = 8); end Other;\n"
    other = mechc.loads(text)
    assert "crossings" in other.studies and other.studies["swing"].settings == {"energy": "8"}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("period()", "perod()", "there is no study 'perod'"),
        ("count = 5", "cuont = 5", "has no setting 'cuont'"),
        ("count = 5", "count = 5, count = 6", "set twice"),
        ("w in linspace(1, 2, 3)", "w in {1, 2}", "goes over a range"),
        ("estimate_error = false", "estimate_error = no", "is true or false"),
        ("study crossings", "study swing", "two studies 'swing'"),
    ],
)
def test_mistakes(old: str, new: str, words: str) -> None:
    assert old in TEXT
    with pytest.raises(mechc.CompileError, match=words):
        mechc.loads(TEXT.replace(old, new))


def test_values_are_read_when_they_are_asked() -> None:
    with pytest.raises(mechc.UsageMistake, match="whole number"):
        mechc.loads(TEXT.replace("count = 5", "count = -5")).study("crossings")
