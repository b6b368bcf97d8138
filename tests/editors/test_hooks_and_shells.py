"""Hooks before a commit, and what shells complete."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.shell_completion import ShellComplete, get_completion_class

from mechc.cli.main import COMMANDS, mechc, run

ROOT = Path(__file__).resolve().parents[2]
HOOKS = (ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8")

RIGHT = "model A\n  coordinate x = 1 m;\n  kinetic 1/2*(1 kg)*der(x)^2;\n  experiment(stop = 1 s);\nend A;\n"


def exit_code(hook: str, *files: Path) -> int:
    found = re.search(rf"^- id: {hook}\n(?:  .*\n)*?  entry: mechc (.*)$", HOOKS, re.MULTILINE)
    assert found is not None
    return run([*shlex.split(found[1]), *map(str, files)])


def test_hooks_pass_what_is_right_and_refuse_what_is_not(tmp_path: Path) -> None:
    right, crooked, wrong = (tmp_path / f"{name}.mech" for name in ("right", "crooked", "wrong"))
    right.write_text(RIGHT, encoding="utf-8")
    crooked.write_text(RIGHT.replace("  kinetic", "kinetic"), encoding="utf-8")
    wrong.write_text(RIGHT.replace("1 kg", "1 m"), encoding="utf-8")
    assert [exit_code("mechc-fmt", right, file) for file in (right, crooked, wrong)] == [0, 1, 0]
    assert [exit_code("mechc-check", right, file) for file in (right, crooked, wrong)] == [0, 0, 1]
    assert re.findall(r"files: (.*)", HOOKS) == [r"\.mech$"] * 2


def completion(shell: str) -> ShellComplete:
    found = get_completion_class(shell)
    assert found is not None
    return found(mechc, {}, "mechc", "_MECHC_COMPLETE")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_a_shell_is_printed(shell: str) -> None:
    printed = subprocess.run(
        [sys.executable, "-c", "from mechc.cli import main; import sys; sys.argv[0] = 'mechc'; main()"],
        env={**os.environ, "_MECHC_COMPLETE": f"{shell}_source"},
        capture_output=True,
        text=True,
    )
    assert f"_MECHC_COMPLETE={shell}_complete" in printed.stdout, printed.stderr
    page = (ROOT / "docs" / "editors.md").read_text(encoding="utf-8")
    assert f"_MECHC_COMPLETE={shell}_source mechc" in page


def test_commands_options_and_files_are_completed() -> None:
    bash = completion("bash")
    assert [c.value for c in bash.get_completions([], "")] == list(COMMANDS)
    assert "--method" in [c.value for c in bash.get_completions(["run"], "--me")]
    behind = bash.get_completions(["run", "a.mech", "--set", "l=1", "--method"], "ra")
    assert [c.value for c in behind] == ["radau5", "rattle"]
    for command in ("run", "view", "check", "fmt", "explain", "equations", "compile"):
        assert [(c.value, c.type) for c in bash.get_completions([command], "exa")] == [("exa", "file")], (
            command
        )
    assert {c.type for c in bash.get_completions(["study", "fit", "a.mech"], "da")} == {"file"}


TYPED = {
    "mechc equat": "equations",
    "mechc run --tole": "--tolerance",
    "mechc run a_model.mech --method rad": "radau5",
    "mechc study perio": "period",
    "mechc run a_mo": "a_model.mech",
}
"""What is typed before Tab, and what has to stand there."""


def at_home(folder: Path) -> dict[str, str]:
    """Where a shell finds mechc, and no settings of anybody."""
    (folder / "a_model.mech").write_text(RIGHT, encoding="utf-8")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return {**os.environ, "PATH": path, "HOME": str(folder), "ZDOTDIR": str(folder), "TERM": "dumb"}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("fish") is None, reason="needs fish")
def test_fish_completes(tmp_path: Path) -> None:
    asked = " echo; ".join(f"complete -C '{typed}';" for typed in TYPED)
    line = f"_MECHC_COMPLETE=fish_source mechc | source; {asked}"
    done = subprocess.run(
        ["fish", "-c", line], cwd=tmp_path, env=at_home(tmp_path), capture_output=True, text=True
    )
    told = [{line.partition("\t")[0] for line in part.splitlines()} for part in done.stdout.split("\n\n")]
    assert len(told) == len(TYPED), done.stdout
    assert all(word in words for word, words in zip(TYPED.values(), told, strict=True)), done.stdout


ZSH = """
zmodload zsh/zpty
zpty -b shell 'zsh -f -i'
until_seen() {
  local piece all="" end=$((SECONDS + 30))
  while [[ $all != *$1* ]] && (( SECONDS < end )); do zpty -rt shell piece 2>/dev/null && all+=$piece || sleep 0.1; done
  [[ $all == *$1* ]] || { print -r -- "not seen: $1 in $all"; exit 1 }
}
zpty -w shell 'autoload -Uz compinit; compinit -u -D; eval "$(_MECHC_COMPLETE=zsh_source mechc)"; print READY$((1+1))'
until_seen READY2
"""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("zsh") is None, reason="needs zsh")
def test_zsh_completes(tmp_path: Path) -> None:
    """Typed into a terminal: a line is cleared, written, completed by Tab."""
    keys = [f"zpty -n -w shell $'\\C-u{typed}\\t'\nuntil_seen {word!r}\n" for typed, word in TYPED.items()]
    done = subprocess.run(
        ["zsh", "-f", "-c", ZSH + "".join(keys)],
        cwd=tmp_path,
        env=at_home(tmp_path),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes(tmp_path: Path) -> None:
    lines = ['eval "$(_MECHC_COMPLETE=bash_source mechc)"']
    for typed in TYPED:
        words = typed.split()
        lines += [
            f"COMP_WORDS=({typed}); COMP_CWORD={len(words) - 1}; COMPREPLY=(); _mechc_completion mechc {words[-1]} {words[-2]}",
            'printf "%s " "${COMPREPLY[@]}"; [ -n "${COMPREPLY[*]}" ] || compgen -f ' + words[-1] + "; echo",
        ]
    done = subprocess.run(
        ["bash", "-c", "\n".join(lines)], cwd=tmp_path, env=at_home(tmp_path), capture_output=True, text=True
    )
    told = [line for line in done.stdout.splitlines() if line.strip()]
    assert [word in line for word, line in zip(TYPED.values(), told, strict=True)] == [True] * len(TYPED), (
        done.stdout
    )


def test_every_file_that_a_command_asks_for_is_completed() -> None:
    """Arguments that stand for files let the shell look for them."""
    root = click.Context(mechc, info_name="mechc")
    for name in COMMANDS:
        command = mechc.get_command(root, name)
        assert command is not None
        for parameter in command.params:
            shown = parameter.metavar or ""
            if isinstance(parameter, click.Argument) and ("." in shown.rstrip(".") or "FILE" in shown):
                offered = parameter.shell_complete(click.Context(command, root), "a")
                assert [c.type for c in offered] == ["file"], (name, shown)
