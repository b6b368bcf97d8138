"""What the doc string of an example promises in numbers, its obvious command prints: ``mechc run FILE``, and ``mechc study FILE`` where the
file states studies.

A number of the model text itself, such as a parameter, is not a promise; nor is a year, or a coefficient inside a formula.
"""

from __future__ import annotations

import contextlib
import io
import re
from functools import cache
from pathlib import Path

import pytest
from msgspec import Struct
from slow_params import slow_but

import mechc
from mechc.cli.main import run
from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.read import read_source

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted([*(ROOT / "examples").glob("*.mech"), *(ROOT / "examples" / "curves").glob("*.mech")])
NUMBER = r"(?<![\w.^/*])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w^*]|\.\d|/| [a-z]\w*[\^/])"
FRACTION = r"(?<![\w.^*/(])(\d+)/(\d+)(?=$|[,;:.)]| of| times| and| or| at)"


QUICK = {"hemisphere", "poinsot", "sphere_on_sphere", "keplers_equation", "scale_model", "bowling_ball"}


class Promise(Struct, frozen=True):
    """A value, and the largest difference at which a printed one still keeps it."""

    text: str
    value: float
    within: float


def doc(path: Path) -> str:
    """Return the doc string of the model that a file runs, or the first comment of a bare file, without rows and years."""
    file = parse(read_source(path), Reporter())
    models = [item for item in file.items if isinstance(item, ast.Model) and not item.partial]
    text = models[-1].doc if models else file.comments[0].text
    text = re.sub(r"\([^()]*\b[UKTVP]\d+\b[^()]*\)", "", text)
    return re.sub(r"\b(?:1[6-9]|20)\d\d\b", "", text).strip()


def promises(text: str) -> list[Promise]:
    """Return the numbers of a doc string with at least two digits, and its fractions."""
    found = []
    for match in re.finditer(FRACTION, text):
        value = int(match[1]) / int(match[2])
        found.append(Promise(match[0], value, 5e-4 * value))
    for match in re.finditer(NUMBER, re.sub(r"(\d) (?=\d{3}\b)", r"\1", re.sub(FRACTION, "", text))):
        digits = match[0].lstrip("-").partition("e")[0]
        if len(digits.replace(".", "").lstrip("0")) < 2:
            continue
        value = float(match[0])
        last = len(digits.partition(".")[2]) or (0 if not digits.endswith("0") else -1)
        found.append(Promise(match[0], value, 0.51 * 10.0**-last))
    return found


def typed(*words: str) -> str:
    """Run a command and return what it prints."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert run(list(words)) == 0, (words, out.getvalue())
    return out.getvalue()


@cache
def printed(path: Path) -> str:
    """Return what the obvious commands print: a run, one of each experiment that has a name and sweeps nothing, and the studies."""
    file = str(path)
    text = typed("run", file)
    flat = mechc.load(path).compilation.flat
    for experiment in flat.experiments:
        if experiment.name and not experiment.sweeps:
            text += typed("run", file, "--experiment", experiment.name)
    return text + (
        typed("study", file) if re.search(r"^\s*study ", path.read_text(encoding="utf-8"), re.M) else ""
    )


def kept(promise: Promise, numbers: list[float]) -> bool:
    return any(abs(abs(number) - abs(promise.value)) <= promise.within for number in numbers)


@pytest.mark.parametrize(
    "path", slow_but([path for path in EXAMPLES if path.stem in QUICK], EXAMPLES), ids=lambda path: path.stem
)
def test_the_obvious_command_prints_it(path: Path) -> None:
    said = doc(path)
    found = promises(said)
    if not found:
        return
    body = path.read_text(encoding="utf-8").replace(said, "")
    body = re.sub(r'"[^"\n]*"', "", body)
    stated = [float(text) for text in re.findall(r"\d+(?:\.\d+)?(?:e-?\d+)?", body)]
    output = printed(path)
    numbers = [float(text) for text in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", output)]
    for promise in found:
        if promise.value in stated or promise.text in body:
            continue
        assert kept(promise, numbers), f"{promise.text} of {path.name} is not printed:\n{output}"


def answers() -> list[tuple[str, list[Path], list[Promise]]]:
    """Return the rows of the sources whose answer holds numbers with a decimal point or a fraction, with their files."""
    found = []
    for line in (ROOT / "docs" / "sources.txt").read_text(encoding="utf-8").splitlines():
        name, _, answered, examples, *_ = line.split(" | ")
        numbers = [p for p in promises(answered) if "." in p.text or "/" in p.text]
        if numbers:
            found.append((name, [ROOT / "examples" / f"{e}.mech" for e in examples.split()], numbers))
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("name", "paths", "found"), answers())
def test_the_files_of_a_row_print_its_answer(name: str, paths: list[Path], found: list[Promise]) -> None:
    """The numbers of docs/sources.md, by the obvious commands of the files beside them, or as what the files are given."""
    text = "".join(
        printed(path) + re.sub(r'"[^"\n]*"', "", path.read_text(encoding="utf-8")) for path in paths
    )
    numbers = [float(number) for number in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", text)]
    for promise in found:
        assert kept(promise, numbers), f"{promise.text} of {name} is not printed"
