"""What becomes of an ensemble whose workers are killed, whose scheduler goes away, and that is ended from outside."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.runtime.ensembles import cluster as dask_side
from mechc.runtime.ensembles.result import Ensemble

distributed = pytest.importorskip("distributed")

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]

MODEL = """\
model DoublePendulum
  parameter l = 1 m;
  coordinate a = 1 rad;
  coordinate b = 0 rad;
  kinetic 1/2*2 kg*(l*der(a))^2 + 1/2*1 kg*(l*der(b))^2 + 1 kg*l^2*der(a)*der(b)*cos(a - b);
  potential -9.81 m/s^2*l*(2 kg*cos(a) + 1 kg*cos(b));
  experiment(stop = 10 s);
end DoublePendulum;
"""
MEMBERS = 20_000
HANGING = 12_345
"""A member with arms of a femtometre, which swing so fast that it never ends."""


def asked() -> dict[str, Any]:
    values = np.column_stack([np.random.default_rng(1).uniform(-1, 1, (MEMBERS, 2)), np.ones(MEMBERS)])
    values[HANGING, 2] = 1e-15
    return {
        "vary": {("a", "b", "l"): values},
        "keep": "final(a), max(b^2), first(a > 0.2 rad)",
        "time_limit": "2 s",
        "lanes": "off",
    }


@pytest.fixture(scope="module")
def model() -> mechc.Model:
    return mechc.loads(MODEL)


@pytest.fixture(scope="module")
def undisturbed(model: mechc.Model) -> Ensemble:
    return model.ensemble(**asked())


def equal(one: Ensemble, two: Ensemble) -> None:
    """Hold every bit of two ensembles against each other, but how long they took."""
    for name in ("numbers", "number_errors", "rows", "outcomes", "reasons", "ends", "errors", "steps"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name), err_msg=name)
    assert one.texts == two.texts


def test_killed_workers_and_a_hanging_member_change_nothing(
    model: mechc.Model, undisturbed: Ensemble, monkeypatch: pytest.MonkeyPatch
) -> None:
    """20 000 members on four processes, of which three are killed at random times."""
    monkeypatch.setattr(dask_side, "TARGET", 0.3)
    chance = random.Random()
    killed: list[int] = []
    due = sorted(chance.uniform(0.05, 0.8) for _ in range(3))
    with (
        distributed.LocalCluster(n_workers=4, threads_per_worker=1, dashboard_address=":0") as local,
        distributed.Client(local, set_as_default=False) as client,
    ):

        def kill(fraction: float) -> None:
            if due and fraction > due[0]:
                # one that was just killed may still be listed
                processes = client.run(os.getpid, on_error="ignore")
                if alive := [p for p in processes.values() if p not in killed]:
                    due.pop(0)
                    killed.append(chance.choice(alive))
                    os.kill(killed[-1], signal.SIGKILL)

        runs = model.ensemble(**asked(), cluster=client, progress=kill)
    assert len(killed) == 3
    assert any("went away meanwhile" in remark for remark in runs.remarks), runs.remarks
    assert runs.counts() == {"completed": MEMBERS - 1, "failed": 1}
    assert "time limit" in runs.reason(HANGING)
    equal(undisturbed, runs)


@contextmanager
def machines(folder: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """Begin a scheduler and two workers as processes of their own; give the address and the scheduler."""
    with ExitStack() as ends:

        def begun(*command: str) -> subprocess.Popen[bytes]:
            process = subprocess.Popen(
                [sys.executable, "-m", "distributed.cli.dask_" + command[0], *command[1:]],
                cwd=folder,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )

            def end() -> None:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()

            ends.callback(end)
            return process

        file = folder / "scheduler.json"
        scheduler = begun("scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", str(file))
        address = None
        while address is None:  # the file is there before all of it is written
            time.sleep(0.1)
            assert scheduler.poll() is None, "the scheduler ended"
            with suppress(FileNotFoundError, json.JSONDecodeError):
                address = str(json.loads(file.read_text())["address"])
        for _ in range(2):
            begun("worker", address, "--nthreads", "1", "--no-dashboard", "--no-nanny")
        yield address, scheduler


def test_a_lost_scheduler_leaves_what_was_made(
    model: mechc.Model, undisturbed: Ensemble, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask_side, "TARGET", 0.3)
    monkeypatch.setattr(dask_side, "PATIENCE", 2.0)
    store = str(tmp_path / "runs.npz")
    seen: list[float] = []
    with machines(tmp_path) as (address, scheduler):

        def kill(fraction: float) -> None:
            seen.append(fraction)
            if fraction > 0.3:
                scheduler.kill()

        part = model.ensemble(**asked(), cluster=address, store=store, progress=kill)
    made = MEMBERS - part.counts()["not made"]
    assert part.outcome.value == "interrupted" and 0.3 * MEMBERS < made < MEMBERS
    assert any("scheduler" in remark and "went away" in remark for remark in part.remarks), part.remarks
    seen.clear()
    again = tmp_path / "again"
    again.mkdir()
    with machines(again) as (address, _):
        whole = model.ensemble(**asked(), cluster=address, store=store, resume=True, progress=seen.append)
    assert seen[0] == made / MEMBERS  # nothing is made twice
    equal(undisturbed, whole)
    assert not (tmp_path / "runs.npz.parts").exists()


@pytest.mark.parametrize("ending", [signal.SIGTERM, signal.SIGINT])
def test_a_command_that_is_ended_leaves_what_was_made(tmp_path: Path, ending: signal.Signals) -> None:
    """The signal reaches all processes, as that of a terminal does."""
    (tmp_path / "m.mech").write_text(MODEL, encoding="utf-8")
    command = [sys.executable, "-m", "mechc", "run", "m.mech", "--lanes", "off", "--vary"]
    command += ["a = -1 rad .. 1 rad, 300; b = -1 rad .. 1 rad, 200", "--keep", "final(a)", "-o", "runs.npz"]
    begun = subprocess.Popen(
        [*command, "--workers", "2"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
        text=True,
    )
    pieces = tmp_path / "runs.npz.parts"

    def press() -> None:
        while begun.poll() is None and len(list(pieces.glob("*.npz"))) < 4:
            time.sleep(0.05)
        os.killpg(begun.pid, ending)

    threading.Thread(target=press).start()
    said, _ = begun.communicate(timeout=120)
    assert begun.returncode == 130, said
    assert "were not made; --resume goes on" in said and "Traceback" not in said
    left = len(list(pieces.glob("*.npz")))
    assert left >= 4
    done = subprocess.run([*command, "--resume"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "60000 completed" in done.stdout and not pieces.exists()
