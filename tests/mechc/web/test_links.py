"""Links to pages: what is written is read again, whatever parameters are called, and what cannot be read is said."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

import mechc.web

LINKS = Path(mechc.web.__file__).with_name("links.js")
NODE = shutil.which("node")

pytestmark = pytest.mark.skipif(NODE is None, reason="needs node")


def called(expression: str, **given: Any) -> Any:
    """Return what an expression of the page's own functions gives."""
    assert NODE is not None
    program = (
        f"{LINKS.read_text()}\nconst given = {json.dumps(given)};\nconsole.log(JSON.stringify({expression}));"
    )
    done = subprocess.run([NODE, "-e", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def written(settings: Mapping[str, float], time: float | None) -> str:
    return str(called("writeLink(given.settings, given.time)", settings=[*settings.items()], time=time))


def read(link: str, names: Sequence[str]) -> tuple[dict[str, float], float | None, list[str]]:
    found = called(
        "(f => [[...f.values], f.time, f.wrong])(readLink(given.link, new Set(given.names)))",
        link=link,
        names=names,
    )
    return dict(found[0]), found[1], found[2]


ODD = ["t", "start", "stop", "time", "der(x)", "x[1, 2]", "a.b", "50%", "a=b", "a&b", "#", "__proto__", "é"]


@pytest.mark.parametrize("time", [None, 2.5])
def test_what_is_written_is_read_again(time: float | None) -> None:
    settings = {name: 0.1 * (k + 1) for k, name in enumerate(ODD)}
    values, told, wrong = read(written(settings, time), ODD)
    assert values == pytest.approx(settings, rel=1e-11) and (told, wrong) == (time, [])


def test_a_parameter_t_is_no_time() -> None:
    assert read("#t=2", ["t"]) == ({"t": 2}, None, [])
    assert read("#t=2&@t=0.5", ["t"]) == ({"t": 2}, 0.5, [])
    assert read("#%40t=0.5", ["x"]) == ({}, 0.5, [])  # as some programs escape it


@pytest.mark.parametrize(
    ("part", "word"),
    [
        ("50%", "‘50%’, which is not escaped"),
        ("%E9=1", "‘%E9=1’, which is not escaped"),
        ("x=", "‘x’ to ‘’, which is not a number"),
        ("x", "‘x’ to ‘’, which is not a number"),
        ("x=%20", "which is not a number"),
        ("x=two", "‘x’ to ‘two’, which is not a number"),
        ("x=1=2", "‘x’ to ‘1=2’, which is not a number"),
        ("x=1e999", "which is not a number"),
        ("@t=", "which is not a number"),
        ("@t=NaN", "which is not a number"),
        ("t=1", "sets ‘t’, which this page does not have"),
        ("constructor=1", "which this page does not have"),
        ("=1", "sets ‘’, which this page does not have"),
    ],
)
def test_what_cannot_be_read_is_said_and_changes_nothing(part: str, word: str) -> None:
    values, time, wrong = read(f"#{part}&y=3", ["x", "y"])
    assert (values, time) == ({"y": 3}, None)
    assert len(wrong) == 1 and word in wrong[0]


def test_an_empty_link_says_nothing() -> None:
    assert read("", ["x"]) == read("#", ["x"]) == read("#&&", ["x"]) == ({}, None, [])
