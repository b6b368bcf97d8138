"""The C compiler and the cache of what it made."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mechc.runtime.native import build, cache, tally
from mechc.runtime.native import compiler as compilers
from mechc.runtime.native.build import (
    BuildError,
    CompilerMissing,
    build_shared,
    built_once,
    find_compiler,
    model_flags,
)
from mechc.runtime.native.cache import (
    SUBFOLDER,
    CacheUnusable,
    cache_content,
    cache_folder,
    clear_cache,
    prune_cache,
)
from mechc.runtime.native.compiler import Compiler
from mechc.runtime.native.libtcc import find_libtcc

SOURCE = {"a.c": '#include "a.h"\n__attribute__((visibility("default"))) int f(void) { return VALUE; }\n'}


def sources(value: int) -> dict[str, str]:
    return {**SOURCE, "a.h": f"#define VALUE {value}\n"}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    if find_compiler() is None:
        pytest.skip("no C compiler")
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "mechc-compiled"


def value_of(library: Path) -> int:
    return int(ctypes.CDLL(str(library)).f())


def test_built_once_and_found_again(folder: Path) -> None:
    library = build_shared(sources(1), model_flags())
    assert value_of(library) == 1
    assert library.parent.parent == folder == cache_folder()
    made = library.stat().st_mtime_ns
    os.utime(library, ns=(made - 10**12, made - 10**12))
    assert build_shared(sources(1), model_flags()) == library
    assert library.stat().st_mtime_ns >= made, "an entry that is used becomes the youngest"
    assert [*folder.glob("*/*")] == [library]


def test_what_is_known_is_found_without_asking_the_compiler(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the compiler's file; another one of the same name is asked, and makes its own."""
    real = find_compiler()
    assert real is not None
    asked = tmp_path / "asked"
    compiler = tmp_path / "cc"
    compiler.write_text(f'#!/bin/sh\necho "$1" >> {asked}\nexec {" ".join(real.command)} "$@"\n')
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))

    def made() -> Path:
        return built_once({"known": "one"}, model_flags(), lambda: build_shared(sources(5), model_flags()))

    library = made()
    assert value_of(library) == 5 and asked.read_text().startswith("--version\n")
    asked.write_text("")
    assert made() == library and not asked.read_text()
    build._find_compiler.cache_clear()
    assert made() == library and not asked.read_text()
    os.utime(compiler, ns=(1, 1))
    build._find_compiler.cache_clear()
    assert made() != library and asked.read_text().startswith("--version\n")


def test_key_holds_all_that_matters(monkeypatch: pytest.MonkeyPatch) -> None:
    compiler = find_compiler()
    assert compiler is not None
    first = build_shared(sources(1), model_flags())
    others = [
        build_shared(sources(2), model_flags()),
        build_shared(sources(1), model_flags(reproducible=True)),
        build_shared(sources(1), (*model_flags(), "-DX"), key="other"),
        build_shared(sources(1), model_flags(), key="other"),
        build_shared(sources(1), model_flags(), compiler=Compiler(compiler.command, "another version")),
    ]
    monkeypatch.setattr(compilers, "processor", lambda: "another processor")
    others.append(build_shared(sources(1), model_flags()))
    assert len({first, *others}) == 7
    assert build_shared(sources(1), model_flags(reproducible=True)) in others, "not tied to the processor"
    assert value_of(others[0]) == 2


def test_several_files_become_one_library() -> None:
    files = {
        "a.c": 'int g(void);\n__attribute__((visibility("default"))) int f(void) { return g() + 1; }\n',
        "b.c": "int g(void) { return 41; }\n",
    }
    assert value_of(build_shared(files, model_flags())) == 42


def test_files_that_did_not_change_are_not_compiled_again(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled: list[str] = []
    run = build._run

    def counted(command: list[str], where: Path) -> None:
        compiled.extend(word for word in command if word.endswith(".c"))
        run(command, where)

    monkeypatch.setattr(build, "_run", counted)
    files = {
        "a.c": '#include "b.h"\n__attribute__((visibility("default"))) int f(void) { return g() + 1; }\n',
        "b.c": "int g(void) { return 41; }\n",
        "b.h": '#  include "c.h"\n',
        "c.h": "int g(void);\n",
    }
    build_shared(files, model_flags())
    assert sorted(compiled) == ["a.c", "b.c"]
    compiled.clear()
    assert value_of(build_shared(files | {"b.c": "int g(void) { return 1; }\n"}, model_flags())) == 2
    assert compiled == ["b.c"]
    compiled.clear()
    build_shared(files | {"c.h": "int g(void);\nint h(void);\n"}, model_flags())
    assert compiled == ["a.c"], "what it includes has changed, by way of another header"
    compiled.clear()
    build_shared(files, model_flags(reproducible=True))
    assert sorted(compiled) == ["a.c", "b.c"], "other flags, other objects"


def test_compiler_that_fails(folder: Path) -> None:
    with pytest.raises(BuildError, match="the C compiler failed") as caught:
        build_shared({"a.c": "int f(void) { return missing; }\n"}, model_flags())
    assert "missing" in caught.value.output
    assert (caught.value.folder / "a.c").read_text().startswith("int f")
    assert not list(folder.rglob("*.so"))


def test_two_processes_build_one_model_at_once(folder: Path) -> None:
    script = (
        "from mechc.runtime.native.build import build_shared, model_flags\n"
        "text = ''.join(f'double g{i}(double x) {{ return x * {i}; }}\\n' for i in range(500))\n"
        "text += '__attribute__((visibility(\"default\"))) int f(void) { return (int)g7(1); }\\n'\n"
        "print(build_shared({'a.c': text}, model_flags()))"
    )
    command = [sys.executable, "-c", script]
    runs = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    answers = {run.communicate(timeout=60)[0].strip() for run in runs}
    assert [run.returncode for run in runs] == [0, 0]
    assert len(answers) == 1
    assert value_of(Path(answers.pop())) == 7
    assert len(list(folder.glob("*/*"))) == 1, "nothing is left over"


def name_of(k: int) -> str:
    return f"model-{k:032x}-{0:016x}.so"


def test_size_is_bounded_by_removing_what_was_unused_longest(folder: Path) -> None:
    folder.mkdir(parents=True)
    for k in range(5):
        (folder / name_of(k)).write_bytes(b"x" * 1000)
        os.utime(folder / name_of(k), (1e9 + (k + 2) % 5, 1e9 + (k + 2) % 5))
    prune_cache(limit=2500)
    assert sorted(file.name for file in folder.iterdir()) == ["kept-since", name_of(1), name_of(2)]


def test_what_broken_builds_leave_is_removed_after_a_day(folder: Path) -> None:
    for name, age in (("build-oldoldol", 2 * 86400.0), ("build-newnewne", 10.0)):
        (folder / name).mkdir(parents=True)
        (folder / name / "a.c").write_text("x")
        os.utime(folder / name, (time.time() - age, time.time() - age))
    prune_cache()
    assert sorted(entry.name for entry in folder.iterdir()) == ["build-newnewne", "kept-since"]


def foreign_files(folder: Path) -> dict[str, str]:
    """Fill a folder with files of others, with names near ours and in folders named like ours; give what each holds."""
    old = time.time() - 1000 * 86400.0
    names = (
        "thesis.tex",
        "build-2019/main.c",
        "build-abcdefgh/deep/below/main.c",
        "model-1.so",
        name_of(7),
        "reference-letters/bank.pdf",
        f"{SUBFOLDER}/notes.txt",
        f"{SUBFOLDER}/model-1.so",
        f"{SUBFOLDER}/build-2019/main.c",
        f"{SUBFOLDER}/build-abcdefgh/deep/below/main.c",
        f"{SUBFOLDER}/build-ijklmnop/thesis.tex",
        f"{SUBFOLDER}/{name_of(8)}/file.txt",
        f"{SUBFOLDER}/entries-00/thesis.tex",
        f"{SUBFOLDER}/entries-00/entries-01/{name_of(6)}",
        f"{SUBFOLDER}/entries-00/build-abcdefgh/main.c",
        f"{SUBFOLDER}/entries-letters/{name_of(5)}",
    )
    for name in names:
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"holds {name}")
        os.utime(file, (old, old))
        os.utime(file.parent, (old, old))
    return {name: f"holds {name}" for name in names}


def test_files_of_others_survive_everything(folder: Path) -> None:
    theirs = foreign_files(folder.parent)
    outside = folder.parent.parent / "outside.txt"
    outside.write_text("kept")
    (folder / name_of(9)).symlink_to(outside)
    (folder / "build-qrstuvwx").symlink_to(outside.parent, target_is_directory=True)
    away = folder.parent.parent / "away"
    away.mkdir()
    (away / name_of(4)).write_text("kept")
    (folder / "entries-02").symlink_to(away, target_is_directory=True)
    build_shared(sources(1), model_flags())
    prune_cache(limit=0)
    build_shared(sources(2), model_flags())
    assert clear_cache().entries >= 1
    assert not [
        file
        for file in (*folder.glob("model-*.so"), *folder.glob("*/model-*.so"))
        if file.is_file() and file.name not in (*map(name_of, (4, 5, 9)), "model-1.so")
    ]
    held = {
        str(file.relative_to(folder.parent)): file.read_text()
        for file in folder.parent.rglob("*")
        if file.is_file() and not file.is_symlink()
    }
    assert held == theirs
    assert outside.read_text() == (away / name_of(4)).read_text() == "kept"


def test_content_and_clearing(folder: Path) -> None:
    build_shared(sources(1), model_flags())
    content = cache_content()
    assert (content.folder, content.entries) == (folder, 1)
    assert content.size > 1000
    assert clear_cache() == content
    assert cache_content().entries == 0


def test_compiler_of_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found = find_compiler()
    assert found is not None
    monkeypatch.setenv("CC", f"{found.command[0]} -DX=1")
    chosen = find_compiler()
    assert chosen is not None
    assert chosen.command == (found.command[0], "-DX=1")
    assert value_of(build_shared({"a.c": SOURCE["a.c"].replace("VALUE", "X"), "a.h": ""}, model_flags())) == 1
    monkeypatch.setenv("CC", str(tmp_path / "no-such-compiler"))
    with pytest.raises(CompilerMissing, match="no-such-compiler, which cannot be run"):
        find_compiler()
    for wrong, reason in (("cc 'unclosed", "is not a command: No closing quotation"), (" ", "cannot be run")):
        monkeypatch.setenv("CC", wrong)
        with pytest.raises(CompilerMissing, match=f"the environment says CC={wrong}, which {reason}"):
            find_compiler()


def test_without_any_compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr(build, "_assumed", None)
    build._find_compiler.cache_clear()
    find_libtcc.cache_clear()
    try:
        assert find_compiler() is None
        with pytest.raises(CompilerMissing, match="no C compiler was found"):
            build_shared(sources(1), model_flags())
        with pytest.raises(CompilerMissing, match="no C compiler was found"):
            built_once({}, model_flags(), lambda: build_shared(sources(1), model_flags()))
    finally:
        build._find_compiler.cache_clear()
        find_libtcc.cache_clear()


def test_a_machine_without_a_compiler_takes_what_another_one_compiled(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As workers of a cluster do: libtcc is there, but gives other code."""
    compiler, library = find_compiler(), build_shared(sources(1), model_flags())
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setitem(sys.modules, "ziglang", None)
    other = find_compiler()
    assert other != compiler and (other is None or other.in_process)
    build.assume_compiler(compiler)
    try:
        assert find_compiler() == build.known_compiler() == compiler
        assert build_shared(sources(1), model_flags()) == library
    finally:
        build.assume_compiler(None)


def test_a_users_cache_that_cannot_be_written_is_told_and_done_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "home").write_text("no folder")
    monkeypatch.delenv("MECHC_CACHE")
    monkeypatch.setattr("mechc.runtime.native.cache.users_cache", lambda: tmp_path / "home" / "mechc")
    with pytest.warns(RuntimeWarning, match="MECHC_CACHE chooses another folder"):
        folder = cache_folder()
    assert folder.is_dir() and cache_folder() == folder, "one folder as long as the process lasts"
    assert os.environ["MECHC_CACHE"] == str(folder.parent), "the processes that it starts have it, too"


def test_a_cache_that_was_chosen_must_be_writable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path / "file"))
    with pytest.raises(CacheUnusable, match="which MECHC_CACHE names"):
        cache_folder()


def test_few_entries_are_looked_at_to_find_one(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many lie there, in the layout of now or of before: those on one shelf, and none to see whether there are too many."""
    library = build_shared(sources(1), model_flags())
    for k in range(600):
        place = folder / f"entries-{k % 256:02x}" if k < 512 else folder
        place.mkdir(mode=0o700, exist_ok=True)
        (place / f"model-{k % 256:02x}{k:030x}-{0:016x}.so").touch()
    listed: list[str] = []
    names, entries = os.listdir, os.scandir

    def noted(place: Path) -> Path:
        listed.extend(names(place))
        return place

    monkeypatch.setattr(os, "listdir", lambda place: names(noted(place)))
    monkeypatch.setattr(os, "scandir", lambda place: entries(noted(place)))
    assert build_shared(sources(1), model_flags()) == library
    assert 1 <= len(listed) <= 4, "the entry and those beside it on its shelf"
    build_shared(sources(2), model_flags())
    assert len(listed) < 20


def test_it_is_looked_through_when_enough_was_kept_or_a_day_went_by(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks: list[int] = []
    prune = cache.prune_cache

    def counted() -> None:
        looks.append(1)
        prune()

    monkeypatch.setattr(cache, "prune_cache", counted)
    monkeypatch.setattr(cache, "BETWEEN_LOOKS", 100_000)
    build_shared(sources(0), model_flags())
    assert len(looks) == 1, "nobody knows when it was"
    sizes: list[int] = []
    while len(looks) == 1:
        sizes.append(build_shared(sources(len(sizes) + 1), model_flags()).stat().st_size)
    assert 100_000 - 2 * 4096 <= sum(4096 * (1 + size // 4096) for size in sizes) <= 100_000 + 2 * max(sizes)
    build_shared(sources(100), model_flags())
    assert len(looks) == 2
    now = time.time()
    for later, due in ((3600.0, False), (86_500.0, True), (-100.0, True)):
        monkeypatch.setattr("time.time", lambda later=later: now + later)
        assert tally.is_due(folder, 10**9) is due


@pytest.mark.parametrize("content", [b"", b"my notes", b"1795424400 and more", b"12345", b"1795424400..x"])
def test_a_file_of_others_by_the_name_of_the_tally_stays(folder: Path, content: bytes) -> None:
    build_shared(sources(1), model_flags())
    (folder / tally.NAME).write_bytes(content)
    build_shared(sources(2), model_flags())
    prune_cache(limit=0)
    clear_cache()
    assert [(f.name, f.read_bytes()) for f in folder.iterdir()] == [(tally.NAME, content)]


def test_entries_of_the_layout_before_are_removed_and_never_used(folder: Path) -> None:
    library = build_shared(sources(1), model_flags())
    before = folder / library.name
    library.unlink()
    before.write_bytes(b"not whole")
    os.utime(before, (1e9, 1e9))
    again = build_shared(sources(1), model_flags())
    assert again == library and value_of(again) == 1 and before.exists()
    assert cache_content().entries == 2
    prune_cache(limit=again.stat().st_size)
    assert again.exists() and not before.exists(), "the one that was unused longest"
    before.write_bytes(b"not whole")
    assert clear_cache().entries == 2 and list(folder.iterdir()) == []
