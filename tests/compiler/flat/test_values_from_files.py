"""Values from files: what they are, their units, what is refused, and who is told of the files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse

import mechc
from mechc.compiler.flat.names.file_dependencies import collected
from mechc.fmu.documents import page
from mechc.lang.diagnostics import CompileError

BODY = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2;\n"
A = np.array([[2.0, -1.0, 0.1], [-1.0, 3.5, 1 / 3]])


def model(folder: Path, text: str) -> Any:
    path = folder / "m.mech"
    path.write_text(BODY + text, encoding="utf-8")
    return mechc.load(path)


def value(folder: Path, expression: str, declared: str = "") -> Any:
    made = model(folder, f"{declared}output y = {expression};\n")
    return made.functions.output["y"](np.array([1.0, 0.0])), made.functions.offer("y", "output").rows[0][1]


def written(folder: Path) -> None:
    np.savez(folder / "a.npz", A=A, b=np.arange(3))
    np.save(folder / "a.npy", A)
    np.savetxt(folder / "blanks.txt", A)
    np.savetxt(folder / "commas.csv", A, delimiter=",", header="of NumPy", fmt="%.17g")
    scipy.io.mmwrite(folder / "a.mtx", scipy.sparse.csr_matrix(A), precision=17)
    lines = ["time [s];force [kN];n", "0;1.5;2", "1;2.5e0;3", "2;-3;5"]
    (folder / "measured.csv").write_text("\n".join(lines) + "\n", encoding="utf-8-sig")


@pytest.mark.parametrize(
    "call",
    ['file("a.npz", "A")', 'file("a.npy")', 'file("blanks.txt")', 'file("commas.csv")', 'file("a.mtx")'],
)
def test_arrays_bit_for_bit(tmp_path: Path, call: str) -> None:
    written(tmp_path)
    for k in range(2):
        declared = f"structural parameter {('', 'Real ')[k]}A[:, :] = {call} m;\n"
        found, unit = value(tmp_path, f"A[{k + 1}, :]*1 N", declared)
        assert found.tolist() == A[k].tolist()
        assert unit == "J"


def test_columns_have_names_and_units(tmp_path: Path) -> None:
    written(tmp_path)
    found, unit = value(tmp_path, 'file("measured.csv", "force")')
    assert (found.tolist(), unit) == ([1500, 2500, -3000], "N")
    declared = """
structural parameter Integer n[:] = file("measured.csv", "n");
parameter Time t[:] = file("measured.csv", "time");
parameter Real c[n[2]] = 1;
"""
    assert value(tmp_path, "size(c, 1) + size(t, 1)", declared)[0] == 6
    assert value(tmp_path, 'file("a.npz", "b")[3]')[0] == 2


def test_a_change_of_a_file_changes_the_model(tmp_path: Path) -> None:
    written(tmp_path)
    with collected() as looked_for:
        made = model(tmp_path, 'output y = file("a.npy")[1, 1];\n')
    assert tmp_path / "a.npy" in looked_for
    before = made.compilation.flat.files
    np.save(tmp_path / "a.npy", A + 1)
    after = model(tmp_path, 'output y = file("a.npy")[1, 1];\n')
    assert after.functions.output["y"](np.array([1.0, 0.0])) == 3
    assert [f.name for f in before] == ["a.npy"]
    assert before != after.compilation.flat.files


def test_documents_of_an_fmu_name_the_files(tmp_path: Path) -> None:
    written(tmp_path)
    made = model(tmp_path, 'parameter K[:, :] = file("a.npy") N/m; potential 1/2*K[1, 1]*x^2;\n')
    (file,) = made.compilation.flat.files
    text = page(made, made.simulate(stop=1, estimate_error=False))
    assert "a.npy" in text and file.checksum in text
    plain = model(tmp_path, "")
    assert "<h2>Files</h2>" not in page(plain, plain.simulate(stop=1, estimate_error=False))


WRONG = {
    "none": ('file("no.csv")', "", "folder"),
    "another kind": ('file("m.mech")', "", "'.npz'"),
    "no text": ("file(3)", "", "quotes"),
    "no array": ('file("a.npz", "B")', "", "'b'"),
    "which array": ('file("a.npz")', "", '"A"'),
    "no column": ('file("measured.csv", "forc")', "", "'force'"),
    "different units": ('file("measured.csv")', "", "column"),
    "a unit on a unit": ('file("measured.csv", "force") N', "", "once"),
    "a name of a matrix": ('file("a.mtx", "A")', "", "leave the name out"),
    "an empty cell": ('file("x.csv")', "1,2\n3,\n", ""),
    "rows of two lengths": ('file("x.csv")', "1,2\n3\n", ""),
    "a text": ('file("x.csv")', "1,2\n3,a\n", ""),
    "a decimal comma": ('file("x.csv")', "1;2\n3;4,5\n", ""),
    "no number at all": ('file("x.csv")', "", ""),
    "a head alone": ('file("x.csv")', "a,b\n", ""),
    "no name in a head": ('file("x.csv", "a")', "1,2\n", "first row"),
    "no unit": ('file("x.csv")', "a [quux]\n1\n", ""),
    "not finite": ('file("nan.npy")', "", ""),
    "complex": ('file("complex.npy")', "", ""),
    "damaged": ('file("damaged.npz")', "", ""),
    "no market": ('file("damaged.mtx")', "", ""),
}


@pytest.mark.parametrize(("call", "content", "help"), WRONG.values(), ids=list(WRONG))
def test_what_is_refused(tmp_path: Path, call: str, content: str, help: str) -> None:
    written(tmp_path)
    (tmp_path / "x.csv").write_text(content, encoding="utf-8")
    np.save(tmp_path / "nan.npy", np.array([1.0, np.nan]))
    np.save(tmp_path / "complex.npy", np.array([1j]))
    for name in ("damaged.npz", "damaged.mtx"):
        (tmp_path / name).write_bytes(b"PK nothing")
    with pytest.raises(CompileError) as caught:
        model(tmp_path, f"output y = {call};\n")
    (found,) = caught.value.diagnostics
    assert found.code in ("E0823", "E0308", "E0334"), str(caught.value)
    assert help in found.help, found.help
