"""What is kept is used only if nobody else can have written it and it is whole."""

from __future__ import annotations

import ctypes
import os
import stat
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import mechc
from mechc.runtime.native import cache, holding, trust
from mechc.runtime.native import kept_files as entries
from mechc.runtime.native.build import BuildError, build_shared, find_compiler, model_flags
from mechc.runtime.native.cache import cache_folder, clear_cache, prune_cache
from mechc.runtime.reference import high_precision

pytestmark = pytest.mark.skipif(os.name == "nt", reason="modes and owners are those of POSIX")

VISIBLE = '__attribute__((visibility("default")))'
SOURCE = {"a.c": f"{VISIBLE} int f(void) {{ return 1; }}\n"}
MODEL = "model M\n  coordinate x = 1 m;\n  kinetic 1/2*1 kg*der(x)^2;\n  experiment(stop = 1 s);\nend M;\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    if find_compiler() is None:
        pytest.skip("no C compiler")
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(cache, "_passing", None)
    yield tmp_path / "cache" / "mechc-compiled"
    holding.release()


def planted(marker: Path) -> bytes:
    """Give a library that leaves a file after as soon as it is loaded."""
    text = f'#include <stdio.h>\n__attribute__((constructor)) static void run(void) {{ fclose(fopen("{marker}", "w")); }}\n'
    found = find_compiler()
    assert found is not None
    source = marker.with_name("planted.c")
    source.write_text(text + SOURCE["a.c"])
    out = marker.with_name("planted.so")
    subprocess.run([*found.command, "-shared", "-fPIC", "-o", out, source], check=True)
    return out.read_bytes()


def open_to_others(file: Path, bad: bytes) -> None:
    file.write_bytes(bad)
    file.chmod(0o666)


def link(file: Path, bad: bytes) -> None:
    elsewhere = file.with_name("elsewhere.so")
    elsewhere.write_bytes(bad)
    file.unlink()
    file.symlink_to(elsewhere)


def lost_link(file: Path, bad: bytes) -> None:
    file.unlink()
    file.symlink_to(file.with_name("nowhere.so"))


def pipe(file: Path, bad: bytes) -> None:
    file.unlink()
    os.mkfifo(file)


def whole_but_open(file: Path, bad: bytes) -> None:
    file.chmod(0o702)


def one_bit(file: Path, bad: bytes) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


DAMAGE: dict[str, Callable[[Path, bytes], object]] = {
    "planted": lambda file, bad: file.write_bytes(bad),
    "planted, open to others": open_to_others,
    "open to others": whole_but_open,
    "a link": link,
    "a link to nothing": lost_link,
    "a pipe": pipe,
    "empty": lambda file, bad: file.write_bytes(b""),
    "cut off": lambda file, bad: file.write_bytes(file.read_bytes()[:2000]),
    "longer": lambda file, bad: file.write_bytes(file.read_bytes() + b"x"),
    "one bit": one_bit,
    "text": lambda file, bad: file.write_bytes(b"no library"),
    "zeros": lambda file, bad: file.write_bytes(bytes(file.stat().st_size)),
}
"""Ways in which an entry may have become something else. ``bad`` is a library that tells if it was loaded."""


@pytest.mark.parametrize("way", DAMAGE)
def test_what_is_not_as_it_was_written_is_never_loaded_but_made_anew(way: str, tmp_path: Path) -> None:
    library = build_shared(SOURCE, model_flags())
    DAMAGE[way](library, planted(tmp_path / "executed"))
    with pytest.warns(RuntimeWarning, match="it is not used, but made again"):
        again = build_shared(SOURCE, model_flags())
    assert ctypes.CDLL(str(again)).f() == 1
    assert not (tmp_path / "executed").exists()
    assert stat.S_IMODE(again.lstat().st_mode) == 0o700
    assert build_shared(SOURCE, model_flags()) == again, "without a warning"


@pytest.mark.slow
def test_a_run_makes_kernel_and_model_anew_and_says_so(tmp_path: Path) -> None:
    model = tmp_path / "m.mech"
    model.write_text(MODEL)
    command = [sys.executable, "-m", "mechc", "run", str(model)]
    assert subprocess.run(command, capture_output=True).returncode == 0
    bad = planted(tmp_path / "executed")
    files = list(cache_folder().glob("*/*.so"))
    for file in files:
        DAMAGE["planted" if file.name.startswith("model") else "cut off"](file, bad)
    again = subprocess.run(command, capture_output=True, text=True)
    assert again.returncode == 0, again.stderr
    assert again.stderr.count("it is not used, but made again") == len(files)
    assert not (tmp_path / "executed").exists()


@pytest.mark.slow
@pytest.mark.parametrize("way", DAMAGE)
def test_a_command_survives_damage_of_all_that_is_kept(way: str, tmp_path: Path) -> None:
    """Libraries of kernel and model, and stages: with exit code 0 and words for what is not used."""
    model = tmp_path / "m.mech"
    model.write_text(MODEL)
    command = [sys.executable, "-m", "mechc", "run", str(model)]
    assert subprocess.run(command, capture_output=True).returncode == 0
    bad = planted(tmp_path / "executed")
    kept = [file for file in cache_folder().glob("*/*") if file.is_file()]
    assert {file.name.partition("-")[0] for file in kept} == {"kernel", "known", "model", "stages"}
    for file in kept:
        DAMAGE[way](file, bad)
    again = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert again.returncode == 0 and "Traceback" not in again.stderr, again
    assert "it is not used, but made again" in again.stderr
    assert not (tmp_path / "executed").exists()


def test_what_was_planted_would_tell(tmp_path: Path) -> None:
    library = tmp_path / "loaded.so"
    library.write_bytes(planted(tmp_path / "executed"))
    ctypes.CDLL(str(library))
    assert (tmp_path / "executed").exists()


def test_an_object_that_is_not_as_it_was_written_is_not_linked() -> None:
    files = {**SOURCE, "b.c": "int g(void) { return 0; }\n"}
    build_shared(files, model_flags())
    for library in cache_folder().glob("*/model-*"):
        library.unlink()
    for kept in cache_folder().glob("*/object-*"):
        kept.write_bytes(kept.read_bytes()[:-8])
    with pytest.warns(RuntimeWarning, match="was cut off or damaged") as said:
        library = build_shared(files, model_flags())
    assert len(said) == 2
    assert ctypes.CDLL(str(library)).f() == 1


def test_entries_of_other_users_are_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """As another user than root sees it, for whom root's files are as good as his own."""
    library = build_shared(SOURCE, model_flags())
    state = library.stat()
    for user in (state.st_uid, 12345):
        monkeypatch.setattr("os.geteuid", lambda user=user: user)
        described = os.stat_result((state.st_mode, 0, 0, 1, 54321, 0, 10, 0, 0, 0))
        assert trust.file_doubt(described) == "belongs to the user 54321"
    monkeypatch.setattr("os.geteuid", lambda: 54321)
    assert trust.file_doubt(described) == ""


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o707])
@pytest.mark.parametrize("level", [0, 1, 2])
def test_a_folder_into_which_others_may_write_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: int, level: int
) -> None:
    """The folder of the entries, the one that was chosen, one above it."""
    monkeypatch.setattr(trust, "_only_by_private_group", lambda state: False)
    chosen = tmp_path / "above" / "cache"
    below = chosen / "mechc-compiled"
    below.mkdir(parents=True)
    monkeypatch.setenv("MECHC_CACHE", str(chosen))
    open_one = [below, *below.parents][level]
    open_one.chmod(mode)
    with pytest.warns(RuntimeWarning, match=f"others may write in {open_one} and could put other code there"):
        instead = cache_folder()
    assert below not in (instead, *instead.parents) and stat.S_IMODE(instead.stat().st_mode) == 0o700
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert cache_folder() == instead, "one folder and one warning for a process"
    assert list(below.iterdir()) == []


def test_a_sticky_folder_may_stand_above_and_a_private_group_may_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    below = tmp_path / "above" / "below"
    below.mkdir(parents=True)
    below.parent.chmod(0o1777)
    assert trust.folder_doubt(below) == ""
    below.chmod(0o1777)
    assert trust.folder_doubt(below).startswith(f"others may write in {below}")
    below.chmod(0o775)
    for private in (True, False):
        monkeypatch.setattr(trust, "_only_by_private_group", lambda state, private=private: private)
        assert (trust.folder_doubt(below) == "") is private


def test_a_group_is_private_if_it_is_named_like_its_only_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import grp
    import pwd

    tmp_path.chmod(0o775)
    state = tmp_path.stat()
    user = pwd.struct_passwd(("ada", "x", os.geteuid(), state.st_gid, "", "", ""))
    monkeypatch.setattr(pwd, "getpwuid", lambda number: user)
    for name, members, private in (
        ("ada", ["ada"], True),
        ("ada", ["ada", "bob"], False),
        ("staff", [], False),
    ):
        group = grp.struct_group((name, "x", state.st_gid, members))
        monkeypatch.setattr(grp, "getgrgid", lambda number, group=group: group)
        assert trust._only_by_private_group(state) is private
        assert not trust._only_by_private_group(os.stat_result((0o40777, *state[1:])))


def test_a_folder_of_another_user_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    above = next((place for place in (tmp_path, *tmp_path.parents) if place.stat().st_uid != 0), None)
    if above is None:
        os.chown(tmp_path, 12345, -1)
        assert "belongs to the user 12345, who could put" in trust.folder_doubt(tmp_path)
    else:
        monkeypatch.setattr("os.geteuid", lambda: 54321)
        assert trust.folder_doubt(tmp_path).startswith(f"{above} belongs to ")


def test_clearing_and_pruning_leave_what_others_work_with(tmp_path: Path) -> None:
    """A process that builds and one that is about to load; then both are gone, and so is what they had."""
    script = (
        "import sys\n"
        "from mechc.runtime.native.build import build_shared, model_flags\n"
        "from mechc.runtime.native.kept_files import build_folder\n"
        f"build_shared({SOURCE!r}, model_flags())\n"
        "with build_folder() as folder:\n"
        "    (folder / 'a.c').write_text('int x;')\n"
        "    print('ready', flush=True)\n"
        "    sys.stdin.read()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout is not None and other.stdout.readline() == b"ready\n"
        build_shared({"a.c": "int g(void) { return 2; }\n"}, model_flags())
        prune_cache(limit=0)
        cleared = clear_cache()
        assert (cleared.entries, cleared.in_use) == (1, 2)
        left = sorted(entry.name.partition("-")[0] for entry in cache_folder().iterdir())
        assert left == ["build", "entries"]
        assert [e.name.partition("-")[0] for e in cache_folder().glob("entries-*/*")] == ["model"]
        other.kill()
    assert clear_cache().entries == 2
    assert list(cache_folder().iterdir()) == []


@pytest.mark.slow
def test_clearing_beside_running_builds_disturbs_none(tmp_path: Path) -> None:
    script = (
        "import ctypes, sys\n"
        "from mechc.runtime.native.build import build_shared, model_flags\n"
        "for k in range(6):\n"
        f"    files = {{'a.c': '{VISIBLE} int f(void) {{ return %d; }}' % k, 'b.c': 'int g(void) {{ return %d; }}' % k}}\n"
        "    assert ctypes.CDLL(str(build_shared(files, model_flags()))).f() == k\n"
    )
    runs = [
        subprocess.Popen([sys.executable, "-c", script], stderr=subprocess.PIPE, text=True) for _ in range(2)
    ]
    while any(run.poll() is None for run in runs):
        clear_cache()
    for run in runs:
        _, said = run.communicate()
        assert (run.returncode, said) == (0, "")


def test_a_build_that_ends_early_leaves_nothing_but_the_sources_of_a_failure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("mechc.runtime.native.build._compile", full)
        with pytest.raises(OSError, match="No space left"):
            build_shared(SOURCE, model_flags())
    assert list(cache_folder().iterdir()) == []
    with pytest.raises(BuildError):
        build_shared({"a.c": "wrong"}, model_flags())
    (kept,) = cache_folder().iterdir()
    assert (kept / "a.c").read_text() == "wrong"


@pytest.mark.slow
def test_a_reference_that_cannot_be_kept_is_not_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    from mechc.measurement.benchmark import benchmark

    model = mechc.loads(MODEL)
    with monkeypatch.context() as patch:
        patch.delenv("MECHC_CACHE")  # the library, which is not what is tested, need not be compiled
        for precision in filter(high_precision.has_precision, high_precision.PRECISIONS):
            high_precision.reference_library(precision)
    with monkeypatch.context() as patch:

        def full(file: Path, stem: str, suffix: str) -> Path:
            raise OSError(28, "No space left on device")

        patch.setattr("mechc.runtime.reference.reference_cache.keep_entry", full)
        with pytest.warns(RuntimeWarning, match="the reference is not kept"):
            assert benchmark(model, methods=("dop853",), tolerances=()).reference.doubt.max() < 1e-15
    benchmark(model, methods=("dop853",), tolerances=())
    (kept,) = cache_folder().glob("*/reference-*.npz")
    kept.write_bytes(kept.read_bytes()[:-40])
    with pytest.warns(RuntimeWarning, match="was cut off or damaged"):
        assert not benchmark(model, methods=("dop853",), tolerances=()).reference.cached
    assert benchmark(model, methods=("dop853",), tolerances=()).reference.cached


def test_no_more_is_held_than_a_process_may_open() -> None:
    for k in range(holding.MOST_HELD + 10):
        file = cache_folder() / f"file-{k}"
        file.touch()
        holding.hold(file)
    assert len(holding._held) == holding.MOST_HELD
    assert holding.is_held(file) and not holding.is_held(cache_folder() / "file-0")
    assert entries.find_entry("model-" + "0" * 32, ".so") is None


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o707])
def test_a_shelf_into_which_others_may_write_is_not_used(
    mode: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trust, "_only_by_private_group", lambda state: False)
    library = build_shared(SOURCE, model_flags())
    library.write_bytes(planted(tmp_path / "executed"))
    library.parent.chmod(mode)
    with pytest.warns(
        RuntimeWarning, match=f"others may write in {library.parent} and could put other code there"
    ):
        again = build_shared(SOURCE, model_flags())
    assert ctypes.CDLL(str(again)).f() == 1 and not (tmp_path / "executed").exists()
    assert library.parent.parent not in again.parents and stat.S_IMODE(again.parent.stat().st_mode) == 0o700


@pytest.mark.parametrize("what", ["link", "file"])
def test_a_shelf_that_is_no_folder_is_not_used(what: str, tmp_path: Path) -> None:
    library = build_shared(SOURCE, model_flags())
    shelf = library.parent
    if what == "link":
        shelf.rename(tmp_path / "elsewhere")
        shelf.symlink_to(tmp_path / "elsewhere", target_is_directory=True)
    else:
        library.unlink()
        shelf.rmdir()
        shelf.write_text("somebody's")
    with pytest.warns(RuntimeWarning, match="is not a folder"):
        again = build_shared(SOURCE, model_flags())
    assert ctypes.CDLL(str(again)).f() == 1 and shelf.parent not in again.parents
    assert what == "link" or shelf.read_text() == "somebody's"
