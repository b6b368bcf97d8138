"""People at a terminal are told what is compiled where that takes long, and nothing stays of it."""

from __future__ import annotations

import io
import os
import sys
import threading
import time
from pathlib import Path

import pytest
from slow_params import slow_but

from mechc.presentation import progress as module
from mechc.presentation.progress import building
from mechc.runtime.native.build import build_shared, find_compiler, model_flags

SOURCES = {"a.c": "int f(void) { return 1; }\n"}


class Terminal(io.StringIO):
    """It knows when somebody wrote on it."""

    def __init__(self) -> None:
        super().__init__()
        self.written = threading.Event()

    def isatty(self) -> bool:
        return True

    def flush(self) -> None:
        self.written.set()


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if find_compiler() is None:
        pytest.skip("no C compiler")
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(module, "BUILD_DELAY", 0.01)


def slowly(stream: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the compiler wait until the line stands there."""
    from mechc.runtime.native import build

    compile_ = build._compile

    def compiled(*arguments: object) -> None:
        assert stream.written.wait(10)
        compile_(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(build, "_compile", compiled)


@pytest.mark.usefixtures("empty_cache")
def test_what_is_compiled_is_said_while_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Terminal()
    slowly(stream, monkeypatch)
    with building(stream=stream):
        build_shared(SOURCES, model_flags(), name="kernel")
        line = "\rcompiling the solver, once for models like this one: about 10 s ...\x1b[K"
        assert stream.getvalue() == line + "\r\x1b[K"
        build_shared(SOURCES, model_flags(), name="kernel")  # it is kept
        assert stream.getvalue() == line + "\r\x1b[K"


@pytest.mark.usefixtures("empty_cache")
def test_a_short_build_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "BUILD_DELAY", 60)
    stream = Terminal()
    with building(stream=stream):
        build_shared(SOURCES, model_flags())
    assert stream.getvalue() == ""


@pytest.mark.usefixtures("empty_cache")
@pytest.mark.parametrize(("stream", "quiet"), [(io.StringIO(), False), (Terminal(), True)])
def test_nothing_is_said_without_a_terminal_or_when_quiet(stream: io.StringIO, quiet: bool) -> None:
    with building(quiet=quiet, stream=stream):
        build_shared(SOURCES, model_flags(), name="kernel")
    assert stream.getvalue() == ""


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
@pytest.mark.parametrize("silent", slow_but(["", "--quiet"], ["", "--json", "--quiet"]))
def test_the_command_line_tells_it_on_a_terminal(silent: str, tmp_path: Path) -> None:
    """A model that nobody has compiled before; the delay is nothing."""
    import pty
    import subprocess

    model = tmp_path / "falling.mech"
    new = f"force {time.time_ns()}e-18 N on x;"
    model.write_text(f"coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; {new} experiment(stop = 1 s);")
    begin = "import mechc.presentation.progress as b; b.BUILD_DELAY = 0; import mechc.cli.main as m; raise SystemExit(m.run())"
    ours, theirs = pty.openpty()
    command = [sys.executable, "-c", begin, "run", str(model), *([silent] if silent else [])]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=theirs, timeout=100)
    os.close(theirs)
    said = b""
    try:
        while part := os.read(ours, 4096):
            said += part
    except OSError:  # the end of a pseudo-terminal
        pass
    os.close(ours)
    assert done.returncode == 0
    if silent:
        assert said == b""
    else:
        assert b"\rcompiling the model ..." in said
        assert said.endswith(b"\r\x1b[K"), "nothing stays of it"
