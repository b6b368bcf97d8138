"""Fixtures and options of all tests."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from mechc.compiler.verification import verifying

Golden = Callable[[str, str], None]


def pytest_configure() -> None:
    """Take Ctrl-C as Python does, also where a shell started the tests in the background and ignores it for them.

    Small matrices are solved faster by one thread than by several, which wait for each other, as the command line does.
    What is imported is compiled once for all processes that tests start, also where containers tell Python to keep nothing.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """Let nobody look for cycles in what lasts as long as the tests: modules, and ten thousand of them."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="rewrite the golden files and error pages")


@pytest.fixture
def update_golden(request: pytest.FixtureRequest) -> bool:
    """Whether expected texts are to be rewritten instead of compared."""
    return bool(request.config.getoption("--update-golden"))


@pytest.fixture
def golden(request: pytest.FixtureRequest, update_golden: bool) -> Golden:
    """Compare a text with ``golden/NAME`` in the folder of the test; ``--update-golden`` writes it."""
    folder = Path(request.path).parent / "golden"

    def compare(name: str, text: str) -> None:
        path = folder / name
        if update_golden:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
            return
        assert path.exists(), f"{path} is missing: run pytest --update-golden"
        assert text == path.read_text(encoding="utf-8")

    return compare


@pytest.fixture(scope="session", autouse=True)
def stages_verified() -> Iterator[None]:
    """What every stage of the compiler makes keeps the rules of its stage, whatever a test is about."""
    with verifying():
        yield


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Give a browser without a window (``support/browsers.py``)."""
    from browsers import running_browser

    yield from running_browser()


@pytest.fixture(autouse=True)
def plain_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages without colours whatever the terminal of the tests is."""
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.delenv("MECHC_DEBUG", raising=False)
