"""A fault put into a copy of mechc, and what ``mechc run`` and ``mechc stress`` say there of a model that reaches it."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from msgspec import Struct

from .fault import ROOT, Fault, Tree

Call = Callable[..., subprocess.CompletedProcess[str]]

FACTOR = 10.0
"""How many times the stated estimate energy must be moved by, to be told."""
SECONDS = 1800
"""After which a call is given up: far more than any takes on a machine of its own."""
UNHURRIED = ("--seconds", "60")
"""How long a run under stress may take, for the same reason."""
DOUBTFUL = 3
"""The exit code of a doubtful run."""


class Run(Struct, frozen=True):
    """``off``: what the energy balance is off by, ``estimate``: the largest estimated error of the motion, both relative to sizes;
    ``accounts``: energies at the end. None where the run told none."""

    outcome: str
    code: int
    off: float | None = None
    estimate: float | None = None
    size: float = 0.0
    accounts: tuple[float, ...] = ()
    message: str = ""


class Stressed(Struct, frozen=True):
    """``code``: the exit code; ``kinds``: of its rows, by name of the twin, empty for the run itself."""

    code: int
    kinds: dict[str, str]
    message: str = ""

    @property
    def right(self) -> bool:
        """Whether it calls the run right."""
        return self.code == 0 and self.kinds.get("") == "right"


class Found(Struct, frozen=True):
    """A model in mechc as it is, and in a mutant."""

    fault: Fault
    sound: Run
    sound_stressed: Stressed
    mutant: Run
    stressed: Stressed

    @property
    def moved(self) -> float | None:
        """What the balance of the mutant's run is off by, over its largest estimated error."""
        run = self.mutant
        if run.off is None or run.estimate is None:
            return None
        return run.off / max(run.estimate, sys.float_info.epsilon)

    @property
    def elsewhere(self) -> float | None:
        """By what the energies at the end differ from those without the fault, relative to their size."""
        mine, true = self.mutant.accounts, self.sound.accounts
        if not mine or len(mine) != len(true) or not self.sound.size:
            return None
        return max(abs(a - b) for a, b in zip(mine, true, strict=True)) / self.sound.size

    @property
    def owed(self) -> bool:
        """Whether so much energy is moved that the run must say so."""
        return self.moved is not None and self.moved > FACTOR

    @property
    def told(self) -> bool:
        """Whether the run speaks up, or does not end at all."""
        return self.mutant.code != 0

    @property
    def good(self) -> bool:
        """Whether all is as it must be: silent without the fault, loud with it, and not right under stress."""
        refused = self.sound.outcome in ("failed", "refused")
        silent = refused or (self.sound.code == 0 and self.sound_stressed.code == 0)
        caught = self.mutant.code == DOUBTFUL if self.owed else True
        seen = not self.stressed.right or not (self.owed or self.fault.point)
        return silent and caught and seen


def run(call: Call, model: Path, options: tuple[str, ...]) -> Run:
    """Run a model."""
    done = call("run", str(model), "--json", *options)
    try:
        told: dict[str, Any] = json.loads(done.stdout)
    except json.JSONDecodeError:
        words = (done.stderr or done.stdout).strip().splitlines()
        return Run("refused", done.returncode, message=words[0] if words else "")
    accuracy, energy = told["accuracy"], told["energy"] or {"start": 0.0}
    errors = [error for name, error in accuracy["by_state"].items() if not name.startswith("energy.")]
    final = [float(value) for name, value in told["final"].items() if name.startswith("energy.")]
    return Run(
        told["outcome"],
        done.returncode,
        accuracy["energy_drift"],
        max(errors, default=accuracy["estimated_error"]),
        max(map(abs, (energy["start"], *final)), default=0.0),
        tuple(final),
        told["message"],
    )


def stress(call: Call, model: Path) -> Stressed:
    """Put a model under stress: the run that it states, and its twins."""
    done = call("stress", str(model), "--json", "-", "--only", "as stated", "--only", "twin", *UNHURRIED)
    try:
        rows = json.loads(done.stdout)["rows"]
    except json.JSONDecodeError:
        words = (done.stderr or done.stdout).strip().splitlines()
        return Stressed(done.returncode, {}, words[0] if words else "")
    kinds = {row["text"] if row["group"] == "twin" else "": row["kind"] for row in rows}
    return Stressed(done.returncode, kinds)


class Judge:
    """Looks at faults one after the other, in a copy of the package below ``work``; what a model does without one is
    remembered."""

    def __init__(self, work: Path) -> None:
        self._work = work
        self._tree = Tree(work / "tree")
        (work / "models").mkdir()
        self._sound: dict[tuple[str, tuple[str, ...]], tuple[Run, Stressed]] = {}
        where = self._call("-c", "import mechc; print(mechc.__file__)").stdout.strip()
        assert Path(where).is_relative_to(self._tree.folder), f"mechc is imported from {where}"

    def __call__(self, fault: Fault) -> Found:
        """Look at a fault. Raises DoesNotFit."""
        model, asked = self._file(fault), (fault.model, fault.options)
        if asked not in self._sound:
            self._sound[asked] = run(self._mechc, model, fault.options), stress(self._mechc, model)
        with self._tree.mutated(fault.edits):
            mutant = run(self._mechc, model, fault.options), stress(self._mechc, model)
        return Found(fault, *self._sound[asked], *mutant)

    def _mechc(self, *words: str) -> subprocess.CompletedProcess[str]:
        return self._call("-m", "mechc", *words)

    def _call(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Call Python in the tree, whose modules come before all others."""
        left_out = ("PYTHONPATH", "PYTHONDONTWRITEBYTECODE", "PYTHONSAFEPATH")
        environment = {name: value for name, value in os.environ.items() if name not in left_out} | {
            "MECHC_CACHE": str(self._work / "cache"),
            "PYTHONPYCACHEPREFIX": str(self._work / "pycache"),
            "OPENBLAS_NUM_THREADS": "1",
        }
        return subprocess.run(
            [sys.executable, *words], cwd=self._tree.folder, env=environment, capture_output=True, text=True,
            check=False, timeout=SECONDS,
        )  # fmt: skip

    def _file(self, fault: Fault) -> Path:
        if fault.model.startswith("examples/"):
            return ROOT / fault.model
        file = self._work / "models" / f"{hashlib.sha256(fault.model.encode()).hexdigest()[:16]}.mech"
        file.write_text(fault.model, encoding="utf-8")
        return file
