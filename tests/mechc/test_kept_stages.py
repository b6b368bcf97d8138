"""Compilations that are kept: used as long as nothing has changed on which they depend, and equal to those formed again."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import mechc
from mechc.compiler.compilation import Compilation
from mechc.compiler.targets.c import emit_c
from mechc.runtime.native.cache import cache_content, cache_folder


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path / "cache"))


def write(folder: Path, k: int) -> Path:
    (folder / "part.mech").write_text(
        f"model Part parameter k = {k} N/m;coordinate x = 1 m;kinetic 1/2*1 kg*der(x)^2;potential 1/2*k*x^2;end Part;"
    )
    file = folder / "whole.mech"
    file.write_text("import part.*;model Whole Part p;output o = 2*p.x;experiment(stop = 1 s);end Whole;")
    return file


def load(file: Path) -> tuple[mechc.Model, bool]:
    """Return the model, and whether it was read."""
    model = mechc.load(file, remembered=True)
    return model, model.compilation.is_stored


def test_the_same_text_is_read(tmp_path: Path) -> None:
    file = write(tmp_path, 4)
    (formed, first), (kept, second) = load(file), load(file)
    assert (first, second) == (False, True)
    assert emit_c(kept.compilation.program) == emit_c(formed.compilation.program)
    assert kept.compilation.flat == formed.compilation.flat
    implicit = [m.problem(quick=True, method="radau5").name for m in (formed, kept)]
    assert implicit == ["Whole", "Whole"], "what is not kept is formed of what is"
    one, two = (m.simulate(set={"p.k": 9}, estimate_error=False) for m in (formed, kept))
    assert one["o"].tolist() == two["o"].tolist()


def test_code_of_a_kept_program_is_not_written_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the second reading on, it is found by what the program was kept as; with other flags it is other code."""
    file = write(tmp_path, 4)
    first = load(file)[0].problem()
    assert load(file)[0].problem().library is not None
    with monkeypatch.context() as patch:
        patch.setattr("mechc.compiler.targets.c.emit_c", None)
        again = load(file)[0].problem()
        assert again.library is not None and first.library is not None
        assert again.library.read_bytes() == first.library.read_bytes()
        with pytest.raises(TypeError):
            load(file)[0].problem(reproducible=True)
    assert load(file)[0].problem(reproducible=True).library != again.library


def test_questions_are_asked_without_the_flat_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = write(tmp_path, 4)
    formed = load(file)[0]
    kept = load(file)[0]
    monkeypatch.setattr(Compilation, "flat", None)
    assert (kept.name, kept.doc, kept.experiments, kept.studies) == ("Whole", "", ("",), formed.studies)
    assert kept.method(None) == "" and kept.structural_parameters == formed.structural_parameters
    assert kept.simulate(estimate_error=False)["o"][-1] == pytest.approx(2 * np.cos(2.0), abs=1e-6)


def test_the_flat_model_goes_where_files_are_not(tmp_path: Path) -> None:
    """Beside the files it is formed again, of the same text; alone it is among the bytes."""
    file = write(tmp_path, 4)
    formed = load(file)[0].compilation
    kept = load(file)[0].compilation
    assert "flat" not in kept.stages() and kept.flat == formed.flat
    stages = kept.stages(alone=True)
    (tmp_path / "part.mech").unlink()
    assert Compilation(formed.request, stored=stages).flat == formed.flat


def test_what_it_depends_on_is_looked_at(tmp_path: Path) -> None:
    """The text, a file that it imports, one that would come before that, and what was asked for."""
    file = write(tmp_path, 4)
    assert [load(file)[1] for _ in range(2)] == [False, True]
    write(tmp_path, 9)
    model, read = load(file)
    assert not read and model.simulate(estimate_error=False)["o"][-1] == pytest.approx(2 * -0.98999, abs=1e-4)
    assert load(file)[1]
    file.write_text(file.read_text() + "// more\n")
    assert [load(file)[1] for _ in range(2)] == [False, True]
    other = mechc.load(file, remembered=True, keep={"jacobian"})
    assert not other.compilation.is_stored


def test_a_file_that_would_come_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library by the search path is hidden by a file beside the text that was not there before."""
    far, near = tmp_path / "far", tmp_path / "near"
    far.mkdir()
    near.mkdir()
    file = write(far, 4).rename(near / "whole.mech")
    monkeypatch.setenv("MECHPATH", str(far))
    assert [load(file)[1] for _ in range(2)] == [False, True]
    (near / "part.mech").write_text((far / "part.mech").read_text().replace("k = 4", "k = 9"))
    model, read = load(file)
    assert not read and model.problem(quick=True).parameters[0].name == "p.k"


def test_damaged_entries_are_formed_anew(tmp_path: Path, own_cache: None) -> None:
    file = write(tmp_path, 4)
    load(file)
    (entry,) = cache_folder().glob("*/stages-*.stages")
    entry.write_bytes(entry.read_bytes()[:-9])
    with pytest.warns(RuntimeWarning, match="cut off or damaged"):
        assert not load(file)[1]
    assert load(file)[1]


def test_warnings_are_told_each_time(tmp_path: Path) -> None:
    file = tmp_path / "warned.mech"
    file.write_text("coordinate Angle th = 30;kinetic 1/2*1 kg.m^2*der(th)^2;experiment(stop = 1 s);")
    for _ in range(2):
        model, read = load(file)
        assert model.diagnostics and not read


def test_the_compiler_is_not_imported(tmp_path: Path) -> None:
    """Neither the parser nor what forms equations, where a run finds all that it needs."""
    file = write(tmp_path, 4)
    text = (
        "import sys\nfrom mechc.cli import main\n"
        f"sys.argv = ['mechc', 'run', {str(file)!r}]\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print([n for n in sys.modules if n in ('lark', 'mechc.compiler.pipeline', 'mechc.compiler.equations.assemble')])"
    )
    last = [
        subprocess.run(
            [sys.executable, "-c", text], capture_output=True, text=True, check=True
        ).stdout.splitlines()[-1]
        for _ in range(2)
    ]
    assert "pipeline" in last[0] and last[1] == "[]"


FORMS = (
    "sympy",
    "lark",
    "scipy",
    "matplotlib",
    "rich",
    "fmpy",
    *(
        f"mechc.compiler.{room}"
        for room in ("graph", "mechanics", "program", "targets", "symbolic", "stored")
    ),
    "mechc.compiler.flat.model",
    "mechc.compiler.equations.model",
    "mechc.compiler.pipeline",
    "mechc.lang.parser",
)
"""What forms, reads or draws a model: none of it belongs to a run of what was kept."""


@pytest.mark.slow
def test_a_run_of_what_was_kept_imports_nothing_that_forms(tmp_path: Path, own_cache: None) -> None:
    file = write(tmp_path, 4)
    told = f"import sys; sys.argv = ['mechc', 'run', {str(file)!r}]; from mechc.cli.main import run; run(); print(*sys.modules)"
    for _ in range(2):  # the first one forms, the second one finds the code by what its program was kept as
        subprocess.run([sys.executable, "-c", told], check=True, capture_output=True)
    done = subprocess.run([sys.executable, "-c", told], check=True, capture_output=True, text=True)
    assert "completed at time = 1 s" in done.stdout
    loaded = done.stdout.splitlines()[-1].split()
    assert not [name for name in loaded if name.startswith(FORMS)]


def test_a_library_under_two_names_lies_there_once(tmp_path: Path, own_cache: None) -> None:
    for _ in range(2):
        load(write(tmp_path, 4))[0].problem()
    libraries = [
        f
        for f in cache_folder().glob("*/*")
        if f.name.startswith(("model-", "known-")) and f.suffix != ".stages"
    ]
    assert len({f.stat().st_ino for f in libraries}) < len(libraries)
    assert cache_content().size <= sum(
        {f.stat().st_ino: f.stat().st_size for f in cache_folder().glob("*/*")}.values()
    )


def test_outlines_hold_fractions_and_sweeps(tmp_path: Path, own_cache: None) -> None:
    file = tmp_path / "rows.mech"
    file.write_text(
        "model Rows structural parameter Integer n = 2; structural parameter Boolean free = true;"
        "coordinate Length x = n*1 m; kinetic 1/2*1 kg*der(x)^2; if free then potential 1 N*x; end if;"
        'experiment long(stop = 1 s, method = "rk4", step = 1 ms, n in {1, 3}); end Rows;'
    )
    formed, kept = load(file), load(file)
    assert (formed[1], kept[1]) == (False, True)
    assert kept[0].compilation.outline == formed[0].compilation.outline
    assert kept[0].compilation.summary == formed[0].compilation.summary
    assert kept[0].swept_structural("long") == {"n": (1, 3)}
    assert kept[0].method("long") == "rk4" and kept[0].structural_parameters == {"n": 2, "free": True}
