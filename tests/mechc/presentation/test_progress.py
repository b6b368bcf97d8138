"""The progress bar appears after a second, on a terminal only, and leaves no trace."""

from __future__ import annotations

import io

import pytest

from mechc.presentation.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time that the bar sees."""
    now = [100.0]
    monkeypatch.setattr("mechc.presentation.progress.time.monotonic", lambda: now[0])
    return now


def test_the_bar_of_a_long_run(clock: list[float]) -> None:
    stream = Terminal()
    with Progress("Pendulum", stream=stream) as bar:
        clock[0] += 0.9
        bar(0.1)
        assert stream.getvalue() == ""
        clock[0] += 1.1
        bar(0.5)
        assert stream.getvalue() == f"\rPendulum [{'#' * 15}{'.' * 15}]  50 %, 2 s left \x1b[K"
        bar(0.6)
        assert "60 %" not in stream.getvalue(), "at most ten times a second"
    assert stream.getvalue().endswith("\r\x1b[K")


@pytest.mark.parametrize(("stream", "quiet"), [(io.StringIO(), False), (Terminal(), True)])
def test_no_bar_without_a_terminal_or_when_quiet(
    stream: io.StringIO, quiet: bool, clock: list[float]
) -> None:
    with Progress("Pendulum", quiet=quiet, stream=stream) as bar:
        clock[0] += 10
        bar(0.5)
    assert stream.getvalue() == ""
