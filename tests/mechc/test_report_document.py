"""The document on a model: largest loads against closed forms, what it holds, and what it refuses."""

from __future__ import annotations

import base64
import re
import sys
import zlib
from pathlib import Path

import pytest

import mechc
from mechc.cli.main import run

ROOT = Path(__file__).resolve().parents[2]

ROD = """\
import mech.planar.*;
model Rod "a rod that falls from the horizontal"
  gravity {0, -9.81} m/s^2;
  Bar rod(m = 1 kg, l = 1 m);
  Revolute hinge(world -> rod.a, angle = 0 deg);
  output Force tip = 0.5 N*cos(time/(1 s));
  experiment(stop = 1 s, tolerance = 1e-10);
  study small = modes(at = "hinge.angle = -90 deg") "about the bottom";
end Rod;
"""


def rows_of(html: str) -> list[list[str]]:
    return [re.findall(r"<t[dh]>(.*?)</t[dh]>", row) for row in re.findall(r"<tr>(.*?)</tr>", html)]


def test_the_largest_reaction_is_named_with_its_time(tmp_path: Path) -> None:
    """At the bottom the hinge bears 5 m g/2, a quarter of a swing after the start: 1.8540747 sqrt(2 l/(3 g)) (U134)."""
    (tmp_path / "rod.mech").write_text(ROD)
    out = tmp_path / "rod.html"
    assert run(["report", str(tmp_path / "rod.mech"), "-o", str(out)]) == 0
    text = out.read_text(encoding="utf-8")
    (row,) = (row for row in rows_of(text) if row[:2] == ["hinge", "reaction"])
    assert float(row[2].removesuffix(" N")) == pytest.approx(2.5 * 9.81, rel=1e-6)
    assert float(row[3].removesuffix(" s")) == pytest.approx(1.8540747 * (2 / (3 * 9.81)) ** 0.5, rel=1e-4)
    assert ["tip", "output", "0.5 N", "0 s"] in rows_of(text)
    assert text.count("<img") == 3 and "<iframe" in text  # positions, motion, study
    for word in (
        "Study small: about the bottom",
        "model Rod",
        "equations of motion",
        f"mechc report {tmp_path}/rod.mech",
    ):
        assert word in text, word


def test_what_has_no_place_has_no_picture_of_places(tmp_path: Path) -> None:
    """Beads and hands at four times, which say nothing, filled a page."""
    (tmp_path / "mass.mech").write_text(
        "dimensionless; coordinate x = 1; kinetic 1/2*der(x)^2; potential x^2/2; experiment(stop = 1);"
    )
    out = tmp_path / "mass.html"
    assert run(["report", str(tmp_path / "mass.mech"), "-o", str(out)]) == 0
    assert out.read_text(encoding="utf-8").count("<img") == 1


def test_a_pdf(tmp_path: Path) -> None:
    pytest.importorskip("reportlab")
    (tmp_path / "rod.mech").write_text(ROD)
    out = tmp_path / "rod.pdf"
    assert run(["report", str(tmp_path / "rod.mech"), "-o", str(out)]) == 0
    written = out.read_bytes()
    assert written.startswith(b"%PDF") and 2 <= len(re.findall(rb"/Type /Page\b", written)) <= 6


def printed(pdf: bytes) -> str:
    """The text of a PDF whose streams are packed and written in digits."""
    found = []
    for stream in re.findall(rb"stream\r?\n(.*?)endstream", pdf, re.DOTALL):
        text = stream.strip()
        if text.endswith(b"~>"):
            text = base64.a85decode(b"<~" + text.removeprefix(b"<~"), adobe=True)
            found += re.findall(rb"\((.*?)(?<!\\)\) Tj", zlib.decompress(text))
    return re.sub(r"\\(.)", r"\1", b" ".join(found).decode("latin-1")).replace("\xa0", " ")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "quantity", "unit", "in_si"),
    [
        ("front_loader", "forces[1]", "kN", 1e3),
        ("quarter_car", "comfort", "mm/s^2", 1e-3),
        ("heavy_symmetric_top", "theta", "rad", 1.0),
    ],
)
def test_pdfs_of_machines(name: str, quantity: str, unit: str, in_si: float, tmp_path: Path) -> None:
    """They hold what the run says, in the units of the model, how to repeat it, pictures, and the whole model."""
    pytest.importorskip("reportlab")
    path, out = ROOT / "examples" / f"{name}.mech", tmp_path / f"{name}.pdf"
    assert run(["report", str(path), "-o", str(out)]) == 0
    written = out.read_bytes()
    text, solution = printed(written), mechc.load(path).simulate()
    assert 3 <= len(re.findall(rb"/Type /Page\b", written)) <= 8 and b"/Subtype /Image" in written
    told = re.search(rf"{re.escape(quantity)}  +(\S+) {re.escape(unit)}", text)
    assert told is not None
    assert float(told[1]) * in_si == pytest.approx(solution[quantity][-1], rel=1e-6)
    title = solution.problem.name
    for words in (
        f"mechc report {path}",
        "completed at",
        "energy balance",
        f"model {title}",
        f"end {title};",
    ):
        assert words in text, words


def test_without_reportlab_it_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "reportlab.lib.units", None)
    (tmp_path / "rod.mech").write_text(ROD)
    assert run(["report", str(tmp_path / "rod.mech"), "-o", str(tmp_path / "rod.pdf")]) != 0
    assert 'pip install "mechc[report]"' in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((str(ROOT / "examples/curves/brachistochrone.mech"),), "is a curve: a report is about one motion"),
        (("ROD", "-o", "report.doc"), "reports go to a file that ends in .html, .pdf"),
        (("ROD", "smal"), "did you mean 'small'?"),
    ],
)
def test_what_is_no_report(
    words: tuple[str, ...], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rod.mech").write_text(ROD)
    told = [str(tmp_path / "rod.mech") if word == "ROD" else word for word in words]
    assert run(["report", *told]) != 0
    assert says in capsys.readouterr().err


def test_a_run_that_fails_is_told(tmp_path: Path) -> None:
    (tmp_path / "fall.mech").write_text(
        "model Fall\n  dimensionless;\n  coordinate x = 1;\n  kinetic der(x)^2/2;\n  potential -1/x;\n"
        "  experiment(stop = 5);\nend Fall;\n"
    )
    out = tmp_path / "fall.html"
    assert run(["report", str(tmp_path / "fall.mech"), "-o", str(out)]) != 0
    text = out.read_text(encoding="utf-8")
    assert "failed" in text and "<img" not in text
