"""The diagram of error over run time: every method is in it or named with a reason, and its last sentence follows from its points."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

import mechc
from mechc.measurement.benchmark import Benchmark, benchmark, conclusion
from mechc.measurement.benchmark_report import draw, report, write_page
from mechc.measurement.peers import LIBRARIES, left_out, peers
from mechc.measurement.references import compile_for_reference
from mechc.runtime.methods import KERNEL_METHODS
from mechc.runtime.native.build import find_compiler
from mechc.runtime.outcome import SimulationError
from mechc.runtime.reference import work_precision
from mechc.runtime.reference.work_precision import WorkPrecisionPoint

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

EXAMPLES = Path(__file__).parents[3] / "examples"
OSCILLATOR = """\
model Oscillator
  parameter k = 4 N/m;
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*k*x^2;
  damping 0.01 N.s/m on x;
  experiment(stop = 10 s);
end Oscillator;
"""


@pytest.fixture(scope="module")
def made() -> Benchmark:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(work_precision, "PATIENCE", 0.0)  # times are not what is looked at
        return _made()


def _made() -> Benchmark:
    return benchmark(mechc.loads(OSCILLATOR), tolerances=(1e-5, 1e-8), against=("scipy:DOP853",))


def test_every_method_is_measured_or_named_with_a_reason(made: Benchmark) -> None:
    """taylor and lobatto6 were refused, as the code of the model did not hold what they need."""
    measured, skipped = set(made.by_method()), dict(made.skipped)
    assert measured | set(skipped) == {*KERNEL_METHODS, "scipy:DOP853"}
    assert {"taylor", "lobatto6", "rattle", "gauss8"} <= measured
    assert set(skipped) == {"verlet", "moreau"} and "velocities" in skipped["verlet"]
    assert "contacts" in skipped["moreau"]
    text = report(made)
    assert all(name in text for name in (*measured, *skipped))


def test_what_runs_claim_stands_beside_their_true_errors(made: Benchmark) -> None:
    """The closed form is the judge of the truth: x = exp(-a t) (cos w t + a/w sin w t)."""
    model = mechc.loads(OSCILLATOR)
    for p in (p for p in made.points if p.method in ("dop853", "taylor", "gauss4")):
        claimed, true = p.claimed, p.claimed_of
        if claimed is not None:
            assert true is not None
            assert true / 30 < claimed < 30 * true or max(claimed, true) < 1e-13
    assert sum(p.claimed is not None for p in made.points) > 20
    (p,) = (p for p in made.by_method()["dop853"] if p.setting == 1e-5)
    run = model.simulate(tolerance=1e-5, method="dop853", every="0.25 s")
    a, w = 0.005, np.sqrt(4 - 0.005**2)
    exact = np.exp(-a * run.time) * (np.cos(w * run.time) + a / w * np.sin(w * run.time))
    error = run.accuracy.error
    assert error is not None
    true = np.abs(run["x"] - exact) / (error.nominal["x"] + np.abs(exact))
    assert p.claimed_of is not None and true.max() <= p.claimed_of * 1.001


def test_a_picture_and_a_page_name_what_they_do_not_draw(made: Benchmark, tmp_path: Path) -> None:
    lobatto = [
        (name, f"'{name}' cannot run this model: it has contacts") for name in ("lobatto4", "lobatto6")
    ]
    made = replace(made, skipped=(*made.skipped, *lobatto))
    draw(made, tmp_path / "bench.svg")
    write_page(made, tmp_path / "bench.html")
    text = (tmp_path / "bench.html").read_text(encoding="utf-8")
    titles = re.findall(r"<title>([^<]*)</title>", text)
    for p in made.points:
        if p.error is not None and p.error < 1:
            assert any(
                title.startswith(f"{p.method}, ") and f"error {p.error:.1e}" in title for title in titles
            )
    assert "not measured: verlet" in text and "moreau" in text
    assert "not measured: lobatto4, lobatto6: it has contacts" in text
    assert "differ by" in text and "not drawn: gauss" not in text.replace("errors above 1", "")
    assert conclusion(made).replace("'", "&#x27;") in text


def _point(method: str, error: float, seconds: float) -> WorkPrecisionPoint:
    return WorkPrecisionPoint(method, 1e-6, error, error, seconds, 0.0, 1, 1)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([("dop853", 1e-10, 2e-3), ("rk4", 1e-10, 1e-1)], "for 1e-9 take dop853: 2 ms"),
        (
            [("dop853", 1e-10, 2e-3), ("scipy:LSODA", 1e-10, 0.26)],
            "for 1e-9 take dop853: 2 ms; the fastest peer, scipy:LSODA, needs 100 to 160 times as long",
        ),
        (
            [("dop853", 1e-10, 2e-3), ("heyoka:Taylor", 1e-10, 1e-3)],
            "for 1e-9 take heyoka:Taylor: 1 ms; the fastest of mechc, dop853, needs 1.6 to 2.5 times as long",
        ),
        (
            [("dop853", 1e-7, 2e-3), ("scipy:LSODA", 1e-3, 2e-3)],
            "for 1e-6 take dop853: 2 ms; none of the peers gets there; for 1e-3 dop853 takes 2 ms; scipy:LSODA takes as long within the spread",
        ),
        (
            [("dop853", 1e-7, 2e-3), ("scipy:LSODA", 1e-2, 1e-3)],
            "for 1e-6 take dop853: 2 ms; none of the peers gets there",
        ),
        ([("auto", 1e-10, 1.0e-3), ("dop853", 1e-10, 1.05e-3)], "for 1e-9 take dop853: 1.05 ms"),
        (
            [
                ("dop853", 1e-10, 1.05e-3),
                ("taylor", 1e-10, 1e-3),
                ("rk4", 1e-10, 2e-3),
                ("scipy:BDF", 1e-10, 1.1e-3),
            ],
            "for 1e-9 take dop853 or taylor: 1 ms; scipy:BDF takes as long within the spread",
        ),
        (
            [("dop853", 1e-10, 1e-3), ("taylor", 1e-10, 1.05e-3), ("rk4", 1e-10, 1.1e-3)],
            "for 1e-9 take dop853, taylor or rk4: 1 ms",
        ),
        ([("dop853", 0.5, 2e-3)], "no method reaches an error of 1e-3"),
    ],
)
def test_the_conclusion_follows_from_the_points(
    made: Benchmark, points: list[tuple[str, float, float]], words: str
) -> None:
    assert conclusion(replace(made, points=tuple(_point(*p) for p in points))) == words


def test_the_spread_decides_which_methods_are_called_alike(made: Benchmark) -> None:
    """The slower one lies 40 % above; its quarter of the fastest runs does not."""
    points = [
        _point("dop853", 1e-10, 1e-3),
        _point("taylor", 1e-10, 1.4e-3),
        _point("scipy:RK45", 1e-10, 1e-2),
    ]
    words = conclusion(replace(made, points=tuple(points)))
    assert words == "for 1e-9 take dop853: 1 ms; the fastest peer, scipy:RK45, needs 8 to 12 times as long"
    points[0] = replace(points[0], quartiles=(0.9e-3, 1.2e-3))
    points[1] = replace(points[1], quartiles=(1.3e-3, 1.5e-3))
    points[2] = replace(points[2], quartiles=(0.9e-2, 1.2e-2))
    words = conclusion(replace(made, points=tuple(points)))
    assert (
        words
        == "for 1e-9 take dop853 or taylor: 1 ms; the fastest peer, scipy:RK45, needs 6 to 17 times as long"
    )


def test_rounds_are_compared_in_pairs(made: Benchmark) -> None:
    """A machine that slows down in the middle changes both: taylor takes 1.5 times as long in each round."""
    rounds = (1e-3, 1e-3, 2e-3, 2e-3, 4e-3)
    points = [
        replace(
            _point(name, 1e-10, 2e-3 * f), quartiles=(1e-3 * f, 2e-3 * f), rounds=tuple(f * t for t in rounds)
        )
        for name, f in (("dop853", 1.0), ("taylor", 1.5), ("heyoka:Taylor", 3.0))
    ]
    words = conclusion(replace(made, points=tuple(points)))
    assert (
        words == "for 1e-9 take dop853: 2 ms; the fastest peer, heyoka:Taylor, needs 2.4 to 3.8 times as long"
    )


def test_times_on_which_the_conclusion_rests_are_measured_in_turns(made: Benchmark) -> None:
    ours, theirs = (
        [p for p in made.points if p.rounds and (p.method in KERNEL_METHODS) is own] for own in (True, False)
    )
    assert ours and theirs and len({len(p.rounds) for p in made.points if p.rounds}) == 1
    assert conclusion(made).startswith("for 1e-9 take")


def test_peers_are_named_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    model = mechc.loads(OSCILLATOR)
    assert list(peers(model, ["scipy:Radau"])) == ["scipy:Radau"]
    for name, words in {"matlab": "are known", "scipy:Euler": "scipy has scipy:DOP853"}.items():
        with pytest.raises(SimulationError, match=words):
            peers(model, [name])
    assert {"scipy", "sundials", "heyoka", "diffsol", "numbalsoda", "diffrax"} == set(LIBRARIES)
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "heyoka" else found(name))
    names = ["scipy:Radau", "heyoka", "mujoco"]
    assert list(peers(model, names)) == ["scipy:Radau"]
    reasons = left_out(names)
    assert reasons["heyoka"] == "is not installed (pip install heyoka)"
    assert "takes bodies" in reasons["mujoco"] and len(reasons) == 2


@pytest.mark.slow
def test_contacts_that_share_loads_have_a_reference() -> None:
    """Their functions did not compile in numbers of 113 bits."""
    model = mechc.load(EXAMPLES / "balls_on_a_box.mech")
    assert compile_for_reference(model, "__float128").library.exists()


def test_a_reference_that_had_no_time_does_not_make_a_motion_chaotic(made: Benchmark) -> None:
    """A valve that opened was called chaotic, as thirty seconds were too few for its reference."""
    early = replace(
        made, horizon=1.0, stop=5.0, reference=replace(made.reference, method="dop853", tolerance=1e-22)
    )
    assert "no time to be exact enough (--seconds)" in report(early)
    done = replace(early, reference=replace(early.reference, tolerance=1e-25))
    assert "too chaotic" in report(done)
