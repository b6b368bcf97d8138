"""Every command in-process: what it writes, where to, and its exit code."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import click
import pytest

from mechc import __version__
from mechc.cli.main import COMMANDS, mechc, run

WRONG = "model Wrong\n  parametr m = 1 kg;\nend Wrong;\n"


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Run a command; return exit code, standard output and standard error."""
    code = run(arguments)
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_help_lists_every_command_and_each_explains_itself(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = call(capsys, "--help")
    assert code == 0
    for name, line in COMMANDS.items():
        assert f"  {name}" in out
        code, own, _ = call(capsys, name, "--help")
        assert (code, own.startswith(f"Usage: mechc {name}")) == (0, True)
        assert line.split()[0] in out


def every_command() -> list[click.Command]:
    context = click.Context(mechc)
    found: list[click.Command] = []
    for name in COMMANDS:
        command = mechc.get_command(context, name)
        assert command is not None
        found += command.commands.values() if isinstance(command, click.Group) else [command]
    return found


def test_no_command_takes_one_option_twice() -> None:
    for command in every_command():
        for option in command.params:
            if not isinstance(option, click.Option) or option.multiple:
                continue
            flag = option.is_flag or option.count
            if flag and not option.secondary_opts:
                continue
            given = [option.opts[0]] if flag else [option.opts[0], "1"]
            with pytest.raises(click.UsageError, match="is given twice"):
                command.make_context("mechc", [*given, *given])


def test_a_value_set_twice_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    call(capsys, "new", "pendulum")
    for names in (("l", "l"), ("l", " l")):
        code, _, err = call(
            capsys, "run", "pendulum.mech", "--set", f"{names[0]}=1", "--set", f"{names[1]}=80 cm"
        )
        assert code == 2 and "'l' is given twice: 1 and 80 cm" in err


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(capsys, "--version") == (0, f"mechc {__version__}\n", "")


def test_help_imports_nothing_heavy() -> None:
    heavy = ["numpy", "scipy", "sympy", "lark", "matplotlib", "rich", "mechc.compiler", "mechc.lang.parser"]
    program = (
        "import sys; from mechc.cli.main import run; run(['--help']); "
        f"print([m for m in {heavy!r} if m in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (["rum"], "Did you mean 'mechc run'?"),
        (["pendulum.mech"], "Did you mean 'mechc run pendulum.mech'?"),
        (["run", "--stop", "1"], "Missing argument 'MODEL.mech'"),
        (["run", "x.mech", "--set", "l"], "'l' is not of the form name=value"),
        (["run", "x.mech", "-o", "x.doc"], "results go to a file that ends in .csv, .npz, .json"),
        (["check", "x.mech", "--json", "--structure"], "--json holds the diagnostics and no structure"),
        (["run", "x.mech", "--display", "cm,mm"], "'cm' and 'mm' are units of one kind; choose one of them"),
        (
            ["run", "x.mech", "--input", "u.csv"],
            "'u.csv' is not of the form name=value; as in --input push=push.csv",
        ),
        (["fmu", "run", __file__, "-o", "x.doc"], "results go to a file that ends in .csv, .npz, .json"),
        (["bench", "x.mech", "--plot", "x.doc"], "pictures go to a file that ends in .png, .pdf, .svg"),
        (["run", "--plot", "x.mech"], "x.mech is a model: write it before --plot"),
        (["show", "tokens", "x.mech"], "'tokens' is not one of"),
        (["explain", "E9999"], "there is no message E9999"),
    ],
)
def test_wrong_usage(arguments: list[str], hint: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = call(capsys, *arguments)
    assert (code, out) == (2, "")
    assert hint in err
    assert "Traceback" not in err


def test_new_writes_a_model_in_canonical_layout_once(capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = call(capsys, "new", "my-pendulum")
    assert code == 0 and "wrote my-pendulum.mech" in err
    assert "model MyPendulum" in Path("my-pendulum.mech").read_text()
    assert call(capsys, "fmt", "--check", "my-pendulum.mech")[0] == 0
    Path("my-pendulum.mech").write_text("mine")
    code, _, err = call(capsys, "new", "my-pendulum")
    assert code == 2 and "exists" in err
    assert Path("my-pendulum.mech").read_text() == "mine"


@pytest.mark.parametrize("name", ["double_pendulum", "DoublePendulum", "my-double-pendulum"])
def test_new_writes_a_double_pendulum_where_the_name_asks_for_one(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _, err = call(capsys, "new", name)
    assert code == 0 and "a double pendulum" in err
    assert call(capsys, "fmt", "--check", f"{name}.mech")[0] == 0
    assert "2 coordinates" in "".join(call(capsys, "check", f"{name}.mech")[1:])
    assert call(capsys, "run", "-q", f"{name}.mech")[0] == 0


@pytest.mark.parametrize("name", ["3body", "no/such/folder/pendulum"])
def test_new_refuses_names_it_cannot_use(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(capsys, "new", name)[0] == 2


def test_fmt(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    untidy, tidy = "model A\nparameter m=1 kg ;\n end A;", "model A\n  parameter m = 1 kg;\nend A;\n"
    first, second = Path("first.mech"), Path("second.mech")
    first.write_text(untidy)
    second.write_text(tidy)
    code, out, err = call(capsys, "fmt", "--check", "first.mech", "second.mech")
    assert (code, out, err) == (1, "", "first.mech: would be changed\n")
    assert first.read_text() == untidy
    code, out, _ = call(capsys, "fmt", "--diff", "first.mech")
    assert "+  parameter m = 1 kg;" in out and first.read_text() == untidy
    assert call(capsys, "fmt", "first.mech", "second.mech") == (0, "", "first.mech: changed\n")
    assert first.read_text() == tidy


def test_fmt_of_standard_input() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "mechc", "fmt", "-"], input="model A\nend A;", capture_output=True, text=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "model A\nend A;\n", "")


def test_fmt_of_a_wrong_model_changes_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    Path("wrong.mech").write_text(WRONG)
    code, out, err = call(capsys, "fmt", "wrong.mech")
    assert (code, out) == (1, "")
    assert "wrong.mech:2:3" in err and "did you mean 'parameter'?" in err
    assert Path("wrong.mech").read_text() == WRONG


def test_show_ast(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.mech").write_text('model A "doc"\n  parameter m = 3/2 kg;\nend A;\n'.replace("3/2", "1.5"))
    code, out, _ = call(capsys, "show", "ast", "a.mech")
    assert code == 0
    assert out.splitlines() == [
        "File",
        "  items[1]: Model doc='doc' name='A'",
        "    body[1]: Parameter name='m'",
        "      value: Quantity value=3/2 unit='kg' text='1.5'",
    ]


def test_a_missing_file_is_told_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = call(capsys, "show", "ast", "nothere.mech")
    assert (code, out) == (1, "")
    assert "nothere.mech" in err and "Traceback" not in err


def test_cache_and_doctor(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path / "cache"))
    code, out, _ = call(capsys, "doctor")
    assert code == 0
    assert f"mechc         {__version__}" in out and "numpy" in out
    assert str(tmp_path / "cache") in out
    (tmp_path / "cache" / "something").write_text("12345")
    ours = tmp_path / "cache" / "mechc-compiled"
    assert list(ours.iterdir())
    _, out, _ = call(capsys, "cache", "clear")
    assert str(tmp_path / "cache") in out
    assert list(ours.iterdir()) == []
    assert (tmp_path / "cache" / "something").read_text() == "12345"


def test_pages_are_shown_without_what_is_for_their_tests(capsys: pytest.CaptureFixture[str]) -> None:
    for code in ("E0604", "E0902"):
        _, out, _ = call(capsys, "explain", code)
        assert not re.search(r"^(run|compile|without): ", out, re.MULTILINE) and "    error[" in out


def test_fmt_keeps_the_line_ends_of_a_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "a.mech"
    path.write_bytes(b"coordinate x=1 m;\r\nkinetic 1/2*1 kg*der(x)^2;\r\n")
    assert call(capsys, "fmt", str(path))[0] == 0
    assert path.read_bytes() == b"coordinate x = 1 m;\r\nkinetic 1/2*1 kg*der(x)^2;\r\n"
    assert call(capsys, "fmt", "--check", str(path)) == (0, "", "")


def test_a_file_that_is_not_there_has_neighbours(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "spring.mech").write_text("")
    for name in ("sprng.mech", "spring"):
        code, _, err = call(capsys, "check", str(tmp_path / name))
        assert code == 1 and f"did you mean '{tmp_path / 'spring.mech'}'?" in err


def test_new_says_commands_that_can_be_copied(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    _, _, err = call(capsys, "new", "my pendulum")
    assert err == "wrote my pendulum.mech, a pendulum; run it with: mechc run 'my pendulum.mech' --plot\n"
    assert "mechc run 'my pendulum.mech' --plot" in (tmp_path / "my pendulum.mech").read_text()


@pytest.mark.filterwarnings("default:compiled code cannot be kept")
def test_doctor_tells_of_a_cache_that_cannot_be_written(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MECHC_CACHE", "")
    (tmp_path / "home").write_text("no folder")
    monkeypatch.setattr("mechc.runtime.native.cache.users_cache", lambda: tmp_path / "home" / "mechc")
    code, out, err = call(capsys, "doctor")
    assert code == 1
    assert f"!!  cache         {tmp_path / 'home' / 'mechc'}: " in out
    assert err.startswith("warning: compiled code cannot be kept in ")


def test_doctor_tells_of_a_compiler_that_does_not_answer(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "/no/such/compiler")
    code, out, _ = call(capsys, "doctor")
    assert code == 1
    assert "CC=/no/such/compiler" in out


def test_doctor_tells_of_a_package_that_cannot_be_imported(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "scipy", None)
    code, out, _ = call(capsys, "doctor")
    assert code == 1
    assert re.search(r"!!  scipy +[\d.]+, but its import fails: import of scipy halted", out)


def test_our_own_bug_is_called_so(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from mechc.cli import new

    def broken(stem: str) -> str:
        raise ZeroDivisionError("oh")

    monkeypatch.setattr(new, "model_name", broken)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    code, out, err = call(capsys, "new", "x")
    assert (code, out) == (1, "")
    assert err.startswith("error: this is a bug in mechc, in the command line: ZeroDivisionError: oh\n")
    assert "Traceback" not in err
    written = next(tmp_path.glob("mechc-bug-*.txt"))
    assert str(written) in err and "Traceback" in written.read_text()
    monkeypatch.setenv("MECHC_DEBUG", "1")
    assert "Traceback" in call(capsys, "new", "x")[2]


def test_a_closed_pipe_is_no_error() -> None:
    command = f"{sys.executable} -m mechc show ast {Path('big.mech')} | head -1"
    Path("big.mech").write_text("model A\n" + "  parameter m = 1 kg;\n" * 5000 + "end A;\n")
    done = subprocess.run(command, shell=True, capture_output=True, text=True, env={**os.environ})
    assert (done.stdout, done.stderr) == ("File\n", "")


def test_check_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    Path("wrong.mech").write_text(WRONG)
    code, out, err = call(capsys, "check", "--json", "wrong.mech")
    assert (code, err) == (1, "")
    (found,) = json.loads(out)
    assert found["place"] == {"file": "wrong.mech", "line": 2, "column": 3, "end_line": 2, "end_column": 11}
    assert found["severity"] == "error" and found["code"].startswith("E01")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["compile", "--set", "m=heavy"], "'heavy' is not a number"),
        (["compile", "--set", "mass=2"], "no parameter or initial value 'mass'"),
        (["compile", "--target", "c", "-o", "model.c"], "the C target writes a folder"),
        (["check", "--set", "mass=2"], "no parameter or initial value 'mass'"),
        (["equations", "--set", "m=2 s"], "it has the unit kg"),
        (["show", "flat", "--set", "m=heavy"], "'heavy' is not a number"),
        (["run", "--stop", "late"], "'stop': 'late' is not a number"),
        (["run", "--experiment", "slow"], "its only one has no name: leave the name out"),
    ],
)
def test_mistakes_in_the_use_of_a_command_are_told(
    capsys: pytest.CaptureFixture[str], own_folder: Path, arguments: list[str], said: str
) -> None:
    text = (
        "parameter m = 1 kg;\ncoordinate Length x = 1 m;\nkinetic 1/2*m*der(x)^2;\nexperiment(stop = 1 s);\n"
    )
    (own_folder / "model.mech").write_text(text, encoding="utf-8")
    code, _, err = call(capsys, *arguments, "model.mech")
    assert (code, "bug" in err) == (2, False)
    assert said in err


def test_a_folder_that_is_written_is_told_once(capsys: pytest.CaptureFixture[str], own_folder: Path) -> None:
    (own_folder / "a.mech").write_text(
        "coordinate Length x = 1 m;\nkinetic 1/2*1 kg*der(x)^2;\n", encoding="utf-8"
    )
    code, out, err = call(capsys, "compile", "--target", "c", "-o", "code", "a.mech")
    assert (code, out, err) == (0, "", f"wrote {len(list(Path('code').iterdir()))} files to code\n")


@pytest.mark.parametrize(
    "words",
    ["compile --target python -o", "compile --target c -o", "equations -o", "bench --json", "stress --json"],
)
def test_nothing_is_written_over_a_model(
    words: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    call(capsys, "new", "pendulum")
    before = Path("pendulum.mech").read_bytes()
    command, *options = words.split()
    code, _, err = call(capsys, command, "pendulum.mech", *options, "pendulum.mech")
    assert code == 2 and f"pendulum.mech is a model: write it before {options[-1]}" in err
    assert Path("pendulum.mech").read_bytes() == before


def test_fmt_writes_a_file_whole_or_not_at_all(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through a link, with its mode; and nothing is lost where the new text cannot be put in place."""
    model, link = tmp_path / "a.mech", tmp_path / "link.mech"
    text = "coordinate x=1 m;\nkinetic 1/2*1 kg*der(x)^2;\n"
    model.write_text(text)
    model.chmod(0o640)
    link.symlink_to(model)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("os.replace", full)
        code, _, err = call(capsys, "fmt", str(link))
    assert (code, err) == (1, "error: No space left on device\n")
    assert model.read_text() == text
    assert call(capsys, "fmt", str(link))[0] == 0
    assert model.read_text() == text.replace("x=1", "x = 1") and link.is_symlink()
    assert model.stat().st_mode & 0o777 == 0o640
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.mech", "link.mech"]


@pytest.mark.parametrize(
    "command",
    [
        ["run", "--stop", "1"],
        ["compile", "--target", "c", "-o", "m_c"],
        ["compile", "--target", "fmu", "-o", "m.fmu", "--sources-only"],
    ],
)
def test_what_is_told_of_a_model_is_told_wherever_it_is_built(
    capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    text = "model M\n  parameter z = 3;\n  coordinate x = 1 m;\n  kinetic 1/2*1 kg*der(x)^2;\nend M;\n"
    Path("m.mech").write_text(text, encoding="utf-8")
    code, _, said = call(capsys, command[0], "m.mech", *command[1:])
    assert code == 0 and "W0402" in said
