"""What notebooks show, and the notebooks of the documentation, which must run."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from parts_of_pages import parts_of

import mechc
from mechc.presentation.bundles import findings_bundle, parameter_values
from mechc.runtime.native.build import find_compiler

COMPILED = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
NOTEBOOKS = sorted((Path(__file__).resolve().parents[3] / "docs" / "notebooks").glob("*.ipynb"))
PENDULUM = """model Pendulum "swings <and> swings"
  parameter Mass m = 2 kg;
  parameter l = 50 cm "length & more";
  parameter Length half = l/2;
  coordinate theta = 60 deg;
  kinetic 1/2*m*l^2*der(theta)^2;
  potential -m*9.81 m/s^2*2*half*cos(theta);
  experiment(stop = 1 s);
end Pendulum;
"""


@pytest.fixture(scope="module")
def pendulum() -> mechc.Model:
    return mechc.loads(PENDULUM)


def test_a_model_shows_quantities_and_equations(pendulum: mechc.Model) -> None:
    shown = pendulum._repr_mimebundle_()
    page = shown["text/html"]
    assert "swings &lt;and&gt; swings" in page and "length &amp; more" in page and "<math" in page
    cells = re.findall(r"<td[^>]*>([^<]*)</td>", page)
    assert cells[cells.index("l") + 1 : cells.index("l") + 3] == ["50", "cm"]
    assert shown["text/plain"] == "<mechc model Pendulum>" and r"\section*{Pendulum}" in shown["text/latex"]


def test_values_that_were_set_are_shown(pendulum: mechc.Model) -> None:
    assert parameter_values(pendulum) == {"m": 2.0, "l": 0.5, "half": 0.25}
    assert parameter_values(pendulum.with_values({"l": "2 m"})) == {"m": 2.0, "l": 2.0, "half": 1.0}


@COMPILED
def test_a_motion_shows_picture_and_report(pendulum: mechc.Model) -> None:
    shown = pendulum.simulate()._repr_mimebundle_()
    assert shown["text/plain"].startswith("Pendulum: completed at time = 1 s")
    assert shown["text/html"].count("data:image/png;base64,") == 1 and "completed" in shown["text/html"]


@COMPILED
def test_an_answer_shows_what_it_found(pendulum: mechc.Model) -> None:
    shown = findings_bundle(pendulum.study("modes", at="equilibrium"))  # type: ignore[arg-type]
    assert "rad/s" in shown["text/plain"] and shown["text/html"].startswith("<div>")


@COMPILED
def test_a_motion_is_seen_as_it_was_asked_for(pendulum: mechc.Model, tmp_path: Path) -> None:
    view = pendulum.simulate(stop="250 ms", set={"l": "1 m"}).view(recorded=True)
    info = parts_of(view.text)["info"]
    assert info["stop"] == 0.25 and "srcdoc=" in view._repr_html_()
    assert view.save(tmp_path / "p.html").read_text(encoding="utf-8") == view.text
    assert [q["value"] for q in info["parameters"] if q["name"] == "l"] == [1.0]


@COMPILED
def test_a_motion_without_its_model_says_so() -> None:
    swept = mechc.loads(PENDULUM.replace("stop = 1 s", "l in {1, 2} m, stop = 1 s")).sweep()
    with pytest.raises(mechc.UsageMistake, match="does not know its model"):
        swept.solutions[0].view()


@pytest.fixture
def shell() -> Iterator[Any]:
    interactive = pytest.importorskip("IPython.core.interactiveshell")
    shell = interactive.InteractiveShell.instance()
    shell.run_line_magic("load_ext", "mechc")
    yield shell
    shell.run_line_magic("unload_ext", "mechc")
    interactive.InteractiveShell.clear_instance()


def test_a_cell_is_a_model(shell: Any, capsys: pytest.CaptureFixture[str]) -> None:
    model = shell.run_cell_magic("mech", "swing", PENDULUM)
    assert shell.user_ns["swing"] is model and model.name == "Pendulum"
    assert shell.run_cell_magic("mech", "swing", PENDULUM.replace("1/2*m*l^2", "1/2*m*l")) is None
    assert shell.user_ns["swing"] is model
    assert "E0301" in (said := capsys.readouterr().out) and "cell.mech:6" in said


def test_a_cell_has_one_name(shell: Any) -> None:
    from IPython.core.error import UsageError

    with pytest.raises(UsageError, match="one name at most"):
        shell.run_cell_magic("mech", "a b", PENDULUM)


@pytest.mark.slow
@COMPILED
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_the_notebooks_run(path: Path) -> None:
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    done = nbclient.NotebookClient(
        nbformat.read(path, as_version=4), timeout=300, kernel_name="python3"
    ).execute()
    outputs = [o for cell in done.cells if cell.cell_type == "code" for o in cell.outputs]
    assert sum("text/html" in o.get("data", {}) for o in outputs) >= 2
    assert not any(o.output_type == "error" for o in outputs)
