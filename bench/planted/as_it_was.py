"""Old mechc, before any run was doubtful: what its wrong runs said, and whether today's rule doubts them.

The models are those of the faults that mechc once had (``former.py``), most of them as they were found, and some of their brothers. They
run in the sources of the last commit before these faults were mended; motions, balances, estimates and outputs are its own, and
``runtime/results/contradictions.py`` of today judges them. ``python -m bench.planted --as-it-was`` does so and writes
``as_it_was.json``, of which the page tells, and which a test holds against the rule.
"""

from __future__ import annotations

import os
import pickle
import select
import subprocess
import sys
import tarfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any, cast

import msgspec
import numpy as np
from msgspec import Struct

from mechc.runtime.case import Case
from mechc.runtime.results import contradictions as rule
from mechc.runtime.results.accuracy import ErrorEstimate

from . import brothers, former
from .fault import ROOT
from .judged import FACTOR

COMMIT = "034cc84e01f9b7a8f419a0ba8894953e123f828a"
FILE = Path(__file__).with_name("as_it_was.json")
PROBE = Path(__file__).with_name("old_mechc.py")
SECONDS = 120.0
"""After which a run is given up: far more than those need that end."""
HEAD = ("what was wrong", "run", "balance off by", "estimated error", "over what that allows", "doubtful")
BALANCE = rule.Check("energy", "energy balance", "J", {}, {}, anchored=False)


class Was(Struct, frozen=True):
    """A run of the commit: how it ended; what its balance was ``off`` by, as a share of the largest energy, and its largest
    estimated error, as it said itself; None where it told none. Where the balance contradicts most, in J: the ``balance``, and what the rule
    compares it with, what the ``stated`` errors do to it, what both runs are apart in it (``own``), and what they ``shared``."""

    text: str
    point: str
    outcome: str
    off: float | None = None
    estimate: float | None = None
    balance: float = 0.0
    stated: float = 0.0
    own: float = 0.0
    shared: float = 0.0

    @property
    def wrong(self) -> bool:
        """Whether its balance is off by more than ten times what it claims its errors to be."""
        if self.off is None or self.estimate is None:
            return False
        return self.off > FACTOR * max(self.estimate, sys.float_info.epsilon)

    @property
    def ratio(self) -> float:
        """What the rule of today makes of it: from ``rule.FACTOR`` on the run is doubtful."""
        look = rule.Look(BALANCE, 1.0, self.stated, self.shared)
        look.read(
            np.array([0.0, 1.0]), np.array([0.0, self.balance]), np.array([0.0, self.balance - self.own])
        )
        return look.told()[1]

    @property
    def doubtful(self) -> bool:
        return self.ratio > rule.FACTOR


def kept() -> tuple[Was, ...]:
    """Return the runs that were kept."""
    return msgspec.json.decode(FILE.read_bytes(), type=tuple[Was, ...])


def models() -> dict[str, tuple[str, str]]:
    """Return the models by what was wrong with them, with the heading under which that was found."""
    return {f.text: (f.point, f.model) for f in former.FAULTS} | brothers.MODELS


def main() -> int:
    """Run all models in the sources of the commit, and keep what they say. The exit code is 1 unless each run whose balance is off
    is doubtful by the rule of today."""
    found = []
    with TemporaryDirectory(prefix="mechc-as-it-was-") as work:
        lay_out(Path(work))
        for text, (point, model) in models().items():
            with started(Path(work).resolve()) as old:
                found.append(_shown(old.run(text, point, model)))
    FILE.write_bytes(msgspec.json.format(msgspec.json.encode(found)) + b"\n")
    print(words(found))
    return int(not all(one.doubtful for one in found if one.wrong))


def _shown(one: Was) -> Was:
    print(" | ".join(row(one)), flush=True)
    return one


def words(found: Sequence[Was]) -> str:
    """Say what the runs come to."""
    wrong = [one for one in found if one.wrong]
    return (
        f"Of {len(found)} such runs the balance of {len(wrong)} was off by more than {FACTOR:g} times the estimated error, under "
        f"'completed', and {sum(one.doubtful for one in wrong)} of these are doubtful by the rule of today."
    )


def row(one: Was) -> list[str]:
    """Return the cells of a run."""
    told = "-" if one.off is None else f"{one.off:.1e}"
    estimate = "-" if one.estimate is None else f"{one.estimate:.1e}"
    judged = f"{one.ratio:.2g}" if one.balance else "-"
    return [f"{one.text} ({one.point})", one.outcome, told, estimate, judged, "yes" if one.doubtful else "no"]


class Old:
    """The mechc of the commit, in a process of its own."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self._process = process

    def _asked(self, what: object) -> Any:
        assert self._process.stdin is not None and self._process.stdout is not None
        pickle.dump(what, self._process.stdin)
        self._process.stdin.flush()
        if not select.select([self._process.stdout], [], [], SECONDS)[0]:
            raise TimeoutError
        return pickle.load(self._process.stdout)

    def run(self, text: str, point: str, model: str) -> Was:
        """Run a model, and judge its balance by the rule of today."""
        try:
            told = self._asked(model)
        except TimeoutError:
            return Was(text, point, f"no end in {SECONDS:g} s")
        if told.get("energy") is None or told["estimate"] is None:
            return Was(text, point, told["outcome"])
        found = Was(text, point, told["outcome"], told["energy"][1], told["estimate"].largest)
        return self._judged(found, told) if told["problem"]["energy_balance"] else found

    def _judged(self, found: Was, told: Mapping[str, Any]) -> Was:
        case = cast(Case, SimpleNamespace(problem=_problem(told["problem"])))
        estimate = cast(ErrorEstimate, told["estimate"])
        (check, *_) = rule.checks(case.problem, as_stated=False)
        inside = vars(rule)  # outputs at states are those of the old mechc
        before, inside["evaluate_rows"] = inside["evaluate_rows"], lambda _, name, *at: self._asked(at)
        try:
            (t, y, z), (u, other, modes) = told["main"], told["companion"]
            count = min(t.size, u.size)
            ours, theirs = (
                rule.values_of(case, (check,), *at)[:, 0] for at in ((t, y, z), (u, other, modes))
            )
            rows = (np.r_[part[: count - 1], part[-1:]] for part in (ours, theirs))
            ours, theirs = (part - part[0] for part in rows)
            pair = rule.Pair(
                t, y, z, count, theirs[:, None], told["steps"], told["factor"], told["tolerance"]
            )
            ((stated, shared),) = rule.scales(case, (check,), pair, estimate)
        finally:
            inside["evaluate_rows"] = before
        own = np.maximum.accumulate(told["factor"] * np.abs(ours - theirs))
        at = int(np.argmax(np.abs(ours) / np.maximum(np.minimum(stated, own + shared), sys.float_info.min)))
        judged = {"balance": abs(ours[at]), "stated": stated, "own": own[at], "shared": shared}
        return msgspec.structs.replace(found, **{name: float(value) for name, value in judged.items()})


def _problem(told: Mapping[str, Any]) -> SimpleNamespace:
    """Return of a problem what the rule looks at."""
    lists = {name: [SimpleNamespace(**q) for q in told[name]] for name in ("states", "outputs")}
    numbers = {name: told[name] for name in ("nq", "nv", "energy_balance", "conserved")}
    hybrid = SimpleNamespace(rows=[None] * told["rows"])
    return SimpleNamespace(**lists, **numbers, ny=len(lists["states"]), hybrid=hybrid)


def lay_out(work: Path) -> None:
    """Lay out the sources of the commit in a folder."""
    archive = subprocess.run(["git", "archive", COMMIT], cwd=ROOT, capture_output=True, check=True).stdout
    with tarfile.open(fileobj=BytesIO(archive)) as sources:
        sources.extractall(work / "tree", filter="data")


@contextmanager
def started(work: Path) -> Iterator[Old]:
    """Start the mechc that was laid out."""
    environment = {n: v for n, v in os.environ.items() if n not in ("PYTHONPATH", "PYTHONSAFEPATH")}
    environment["MECHC_CACHE"] = str(work / "cache")
    with subprocess.Popen(
        [sys.executable, "-c", PROBE.read_text(encoding="utf-8")], cwd=work / "tree", env=environment,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    ) as process:  # fmt: skip
        try:
            yield Old(process)
        finally:
            process.kill()
