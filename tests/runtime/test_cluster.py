"""Ensembles on Dask clusters: the bits of a run in one process, whatever becomes of workers and schedulers."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace
from shared_models import STIFF

import mechc
from mechc.runtime.ensembles import cluster as dask_side
from mechc.runtime.ensembles import worker
from mechc.runtime.ensembles.compatibility import own_facts
from mechc.runtime.ensembles.result import Ensemble
from mechc.runtime.native.libtcc import find_libtcc

distributed = pytest.importorskip("distributed")

BALL = """\
model Ball
  parameter e = 0.8;
  parameter k = 1;
  input Force push = 0 N;
  input Force gust = 0 N;
  coordinate Length y = 1 m;
  kinetic 1/2*k*1 kg*der(y)^2;
  potential 1 kg*9.81 m/s^2*y;
  force push + gust on y;
  contact floor: y restitution e;
  experiment(stop = 2 s);
end Ball;
"""
ASKED: dict[str, Any] = {
    "vary": {"e": np.linspace(0.3, 1.1, 30), "push": [0.0, 3.0]},
    "keep": "n = events(impact, floor), max(y^2), y, first(y < 0.5 m)",
    "every": "0.5 s",
    "errors": "0.5",
}
"""Members with e > 1 fail."""

SMOOTH = """\
model Smooth
  parameter w = 1 rad/s;
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*1 kg*(w/(1 rad))^2*x^2;
  experiment(stop = 1 s);
end Smooth;
"""
MANY: dict[str, Any] = {
    "vary": "w ~ uniform(1, 9 rad/s)",
    "samples": 2000,
    "keep": "max(x), mean(x^2)",
}

pytestmark = pytest.mark.filterwarnings("default")


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    """Two workers in this process."""
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=False, dashboard_address=":0"
        ) as local,
        distributed.Client(local, set_as_default=False) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def ball() -> mechc.Model:
    return mechc.loads(BALL)


@pytest.fixture(scope="module")
def smooth() -> mechc.Model:
    return mechc.loads(SMOOTH)


def equal(one: Ensemble, two: Ensemble) -> None:
    """Hold every bit of two ensembles against each other, but how long they took."""
    for name in ("numbers", "number_errors", "rows", "outcomes", "reasons", "ends", "errors", "steps"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name), err_msg=name)
    assert one.texts == two.texts and one.build == two.build


def test_a_cluster_gives_the_bits_of_one_process(ball: mechc.Model, client: Any, tmp_path: Path) -> None:
    """Events, inputs by member and by table, members that fail, errors, series."""
    table = tmp_path / "gust.csv"
    table.write_text("time,gust\n0,0\n1,2\n2,0\n", encoding="utf-8")
    asked = ASKED | {"inputs": {"gust": str(table)}}
    here = ball.ensemble(**asked)
    there = ball.ensemble(**asked, cluster=client)
    equal(here, there)
    assert here.counts()["failed"] == 8 and len(here.texts) == 1
    assert any("of a Dask cluster" in remark for remark in there.remarks)


def test_lanes_on_a_cluster_give_the_bits_of_one_process(smooth: mechc.Model, client: Any) -> None:
    here = smooth.ensemble(**MANY)
    there = smooth.ensemble(**MANY, cluster=client.cluster)
    assert "lanes" in here.build
    equal(here, there)


def test_workers_need_none_of_the_files_of_a_model(client: Any, tmp_path: Path) -> None:
    (tmp_path / "springs.mech").write_text(
        "model Spring\n  frame a;\n  parameter k = 1 N/m;\n  coordinate Length x = 1 m;\n"
        "  kinetic 1/2*1 kg*der(x)^2;\n  potential 1/2*k*x^2;\nend Spring;\n",
        encoding="utf-8",
    )
    (tmp_path / "two.mech").write_text(
        "import springs.*;\nmodel Two\n  structural parameter n = 2;\n  Spring s[i in 1:n](k = i*1 N/m);\n"
        "  experiment(stop = 1 s);\nend Two;\n",
        encoding="utf-8",
    )
    model = mechc.load(tmp_path / "two.mech", set={"n": 3})
    asked: dict[str, Any] = {"vary": {"s[3].k": [1.0, 4.0]}, "keep": "final(s[1].x*s[3].x)"}
    here = model.ensemble(**asked)
    for file in tmp_path.iterdir():
        file.unlink()
    there = model.ensemble(**asked, cluster=client)
    equal(here, there)
    expected = np.cos(1.0) * np.cos(np.sqrt([1.0, 4.0]))
    np.testing.assert_allclose(there["final(s[1].x*s[3].x)"], expected, atol=1e-6)


PARALLELOGRAM = """\
import mech.planar.*;
parameter l = 1.1 m;
Bar crank(m = 1 kg, l = 1 m);
Bar coupler(m = 2 kg, l = 2 m);
Bar rocker(m = 3 kg, l = l);
Revolute a(world -> crank.a, angle = 30 deg, der(angle) = 10 rad/s);
Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
Revolute d(world * trans({2 m, 0 m}) -> rocker.a, angle ~ 30 deg);
cut Revolute c(coupler.b -> rocker.b);
experiment(stop = 1 s);
"""
"""With l = 1 m it passes flat positions, which needs multipliers of a small compliance."""


def test_other_builds_of_a_model_reach_the_workers(client: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stiff members, and those that meet a singular position, are followed there as they are here."""
    model = mechc.loads(PARALLELOGRAM)
    asked: dict[str, Any] = {"vary": {"l": [1.0, 1.2]}, "keep": "final(a.angle)"}
    here = model.ensemble(**asked)
    assert here.counts() == {"completed": 2}
    equal(here, model.ensemble(**asked, cluster=client))
    monkeypatch.setattr("mechc.session.FEW_STEPS", 300)
    stiff = mechc.loads(STIFF)
    here = stiff.ensemble({"mu": [1.0, 300.0]}, "final(x)")
    assert here.steps[1] < 3000
    equal(here, stiff.ensemble({"mu": [1.0, 300.0]}, "final(x)", cluster=client))


def test_a_hanging_member_is_a_row_there_too(smooth: mechc.Model, client: Any) -> None:
    values = np.linspace(1.0, 9.0, 60)
    values[7] = 1e9
    asked: dict[str, Any] = {"vary": {"w": values}, "keep": "final(x)", "time_limit": "0.1 s"}
    there = smooth.ensemble(**asked, cluster=client)
    assert there.counts() == {"completed": 59, "failed": 1} and "time limit" in there.reason(7)
    equal(smooth.ensemble(**asked), there)


def test_what_was_made_is_kept_when_it_is_interrupted(
    smooth: mechc.Model, client: Any, tmp_path: Path
) -> None:
    presses: list[float] = []

    def pressed(fraction: float) -> None:
        if 0.3 < fraction < 1 and not presses:  # after the last batch nobody asks any more
            presses.append(fraction)
            signal.raise_signal(signal.SIGINT)

    part = None
    for attempt in range(10):
        store = str(tmp_path / f"runs{attempt}.npz")
        presses.clear()
        # where all others came together with the batch at which it was pressed, nothing is left to be interrupted
        with contextlib.suppress(KeyboardInterrupt):
            part = smooth.ensemble(**MANY, cluster=client, store=store, progress=pressed)
        if part is not None and presses and not part.complete:
            break
    assert part is not None
    made = part.counts()
    assert part.outcome.value == "interrupted" and made["completed"] > 600 and made["not made"] > 0
    seen: list[float] = []
    again = smooth.ensemble(**MANY, cluster=client, store=store, resume=True, progress=seen.append)
    assert again.complete and seen[0] == made["completed"] / 2000
    equal(smooth.ensemble(**MANY), again)
    assert not Path(f"{store}.parts").exists()
    # and what a cluster has begun goes on in one process
    presses.clear()
    with contextlib.suppress(KeyboardInterrupt):
        smooth.ensemble(**MANY, cluster=client, store=store, progress=pressed)
    equal(smooth.ensemble(**MANY), smooth.ensemble(**MANY, store=store, resume=True))


def test_studies_and_experiments_run_on_clusters(client: Any) -> None:
    model = mechc.loads(
        SMOOTH.replace(
            "experiment(stop = 1 s);",
            "experiment(stop = 1 s);\n  experiment cloud(w ~ uniform(1 rad/s, 2 rad/s), samples = 50, stop = 1 s, "
            'keep = {final(x)});\n  study spread = ensemble(vary = "w = 1 rad/s .. 2 rad/s, 7", keep = "max(x)");',
        )
    )
    equal(model.ensemble(experiment="cloud"), model.ensemble(experiment="cloud", cluster=client))
    here, there = model.study("spread"), model.study("spread", cluster=client)
    assert isinstance(here, Ensemble) and isinstance(there, Ensemble)
    equal(here, there)


def test_a_worker_of_another_version_is_left_out(
    smooth: mechc.Model, client: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []

    def facts() -> Any:
        asked.append(1)
        return replace(own_facts(), code="another") if len(asked) == 1 else own_facts()

    monkeypatch.setattr(worker, "own_facts", facts)
    runs = smooth.ensemble(**MANY, cluster=client)
    assert runs.complete
    (said,) = [remark for remark in runs.remarks if "left out" in remark]
    assert "another version of mechc" in said
    monkeypatch.setattr(worker, "own_facts", lambda: replace(own_facts(), python="3.1"))
    monkeypatch.setattr(dask_side, "PATIENCE", 2.0)
    with pytest.raises(mechc.SimulationError, match=r"no worker.*can make members.*runs Python 3\.1"):
        smooth.ensemble(**MANY, cluster=client)


def test_a_worker_of_another_platform_compiles_for_itself_and_is_told(
    smooth: mechc.Model, client: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken: list[object] = []
    monkeypatch.setattr(worker, "own_facts", lambda: replace(own_facts(), machine="another"))
    monkeypatch.setattr(worker, "_take_libraries", taken.append)
    runs = smooth.ensemble(**MANY, cluster=client)
    assert runs.complete and not taken
    assert any("another processor or compiler" in remark for remark in runs.remarks)
    same = smooth.ensemble(**MANY, cluster=client, reproducible=True)
    assert not any("another processor" in remark for remark in same.remarks)


def test_a_worker_without_a_compiler_takes_the_code_of_the_sender(
    smooth: mechc.Model, client: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    assumed: list[object] = []
    monkeypatch.setattr("mechc.runtime.native.build.assume_compiler", assumed.append)
    monkeypatch.setattr(worker, "own_facts", lambda: replace(own_facts(), compiler=find_libtcc()))
    there = smooth.ensemble(**MANY, cluster=client)
    assert assumed and {*map(repr, assumed)} == {repr(own_facts().compiler)}
    assert not any("another processor or compiler" in remark for remark in there.remarks)
    equal(smooth.ensemble(**MANY), there)


def test_what_cannot_be_asked_is_told(
    smooth: mechc.Model, client: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(mechc.SimulationError, match="take one of them"):
        smooth.ensemble(**MANY, cluster=client, workers=2)
    monkeypatch.setattr(dask_side, "ANSWER", 0.2)
    with pytest.raises(mechc.SimulationError, match=r"no scheduler answers at 'tcp://127\.0\.0\.1:9'"):
        smooth.ensemble(**MANY, cluster="tcp://127.0.0.1:9")
    with pytest.raises(mechc.SimulationError, match="is an address"):
        smooth.ensemble(**MANY, cluster=7)
    with pytest.raises(mechc.SimulationError, match="differ from member to member"):
        mechc.loads(SMOOTH.replace("stop = 1 s", "stop = 1 s*w/(1 rad/s)")).ensemble(**MANY, cluster=client)


def test_a_scheduler_without_workers_is_told(smooth: mechc.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_side, "NO_WORKERS", 0.2)
    with (
        distributed.LocalCluster(n_workers=0, processes=False, dashboard_address=":0") as local,
        pytest.raises(mechc.SimulationError, match="it has none: start some"),
    ):
        smooth.ensemble(**MANY, cluster=local)
