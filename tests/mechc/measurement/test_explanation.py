"""What ``mechc explain`` says: of the run that is made, with the line that needs each thing, and times with their intervals."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from random import Random
from types import SimpleNamespace

import pytest
from msgspec.structs import replace

import mechc
from mechc.compiler.equations.model import Choice
from mechc.compiler.equations.needs import FACTS, PARTS
from mechc.measurement import savings as measured
from mechc.measurement.explanation import _reason, as_run, explanation, summary
from mechc.measurement.needed_by import lines
from mechc.measurement.savings import Cost, least_times, savings
from mechc.runtime.case import Case
from mechc.runtime.native.build import find_compiler
from mechc.runtime.outcome import SimulationError

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

STIFF = """\
model Sensor
  parameter k = 1e9 N/m;
  coordinate x = 10 mm; coordinate y = 11 mm;
  kinetic 1/2*(1000 kg)*der(x)^2 + 1/2*(1 g)*der(y)^2;
  potential 1/2*(40 kN/m)*x^2 + 1/2*k*(y - x)^2;
  dissipation 1/2*(2e3 N.s/m)*(der(y) - der(x))^2;
  experiment(stop = 10 s);
end Sensor;
"""
JUGGLE = """\
model Juggle
  parameter a = 2 cm; parameter w = 20 rad/s;
  gravity {0, -9.81 m/s^2};
  coordinate Length y = 0.5 m;
  mass 0.1 kg at world*{0 m, y};
  force -(0.01 kg/m)*der(y)*abs(der(y)) on y;
  contact paddle: y - a*sin(w*time) restitution 0.8;
  assert y < 5 m, "it is lost";
  experiment(stop = 1 s);
end Juggle;
"""
LOOP = """\
import mech.planar.*;
model Loop
  gravity {0, -9.81 m/s^2};
  input Torque u;
  Bar crank(m = 1 kg, l = 1 m);
  Bar coupler(m = 1 kg, l = 2 m);
  Revolute a(world -> crank.a, angle = 60 deg);
  Revolute b(crank.b -> coupler.a, angle ~ -60 deg);
  Prismatic slide(world -> coupler.b, axis = {1, 0}, position ~ 2.3 m);
  torque u on a.angle;
  experiment(stop = 1 s);
end Loop;
"""


@pytest.fixture(autouse=True)
def _at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time in this process, once."""
    monkeypatch.setattr(measured, "_in_a_process", lambda cases, steps: least_times(cases, steps, 0.0))


def test_a_stiff_run_brings_its_jacobian() -> None:
    """It was said to be left out, as no implicit method is asked for."""
    ran = as_run(mechc.loads(STIFF))
    assert ran.words.startswith("run: radau5") and "stiff since" in ran.reasons["jacobian"]
    text = " ".join(explanation(ran.model, saved=savings(ran.model, measured=False), ran=ran).split())
    assert "the Jacobian of implicit methods kept the run is stiff since" in text
    assert "costs the function jacobian" in text
    mild = as_run(mechc.loads(STIFF.replace("1e9", "1e2").replace("2e3", "2e-3")))
    assert not mild.reasons and mild.words.startswith("run: dop853")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (STIFF, {"dissipation": "line 6: dissipation"}),
        (
            JUGGLE,
            {
                "events": "line 7: contact paddle",
                "modes": "line 7: contact paddle",
                "time": "line 7: contact paddle",
                "gravity": "line 5: mass",
                "dissipation": "line 6: force",
                "assertions": "line 8: assert",
            },
        ),
        (LOOP, {"constraints": "line 9: Prismatic slide", "inputs": "line 4: input"}),
    ],
)
def test_what_is_needed_names_its_line(text: str, told: dict[str, str]) -> None:
    model = mechc.loads(text)
    found = lines(model.compilation.flat)
    needed = {c.fact for c in model.compilation.equations.choices if c.decision == "needed"}
    assert needed <= set(FACTS) and needed <= set(found)
    for fact, line in told.items():
        assert fact in needed and found[fact].startswith(line)
    reasons = {c["topic"]: c["reason"] for c in summary(model)["choices"] if c["decision"] == "needed"}
    assert all("line " in reason for reason in reasons.values())


def test_a_difference_holds_its_median_in_an_interval() -> None:
    """What was timed in one process is compared; in one of them code may be slower throughout."""
    lean = Cost(1, 1, 1, (10.0, 10.1, 9.9, 10.0, 10.0, 14.0, 10.0))
    more = Cost(1, 1, 1, (12.0, 12.0, 12.1, 11.9, 12.0, 12.0, 12.0))
    found = more.beyond(lean)
    assert found is not None
    assert found == pytest.approx((2, 1.9 - 0.14, 2 + 0.14))
    assert more.beyond(Cost(1, 1)) is None


@pytest.mark.parametrize("seed", range(3))
def test_two_runs_agree_beside_other_work(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    """Nine of ten short runs share their core: they take 1.3 to 1.7 times as long. The fast ones are those to be found."""
    ticks = itertools.count()
    monkeypatch.setattr(measured, "_in_a_process", lambda cases, steps: least_times(cases, steps, 40))
    monkeypatch.setattr(measured, "time", SimpleNamespace(perf_counter=lambda: next(ticks)))
    model = mechc.loads(STIFF)
    noise = Random(seed)

    def run(case: Case, _steps: int) -> float:
        lone = 50.0 + 30.0 * (case.functions.struct.n_jacobian > 0) + noise.gauss(0, 0.1)
        return lone * (noise.uniform(1.3, 1.7) if noise.random() < 0.9 else 1)

    monkeypatch.setattr(measured, "_by_kernel", run)
    builds = {"lean": model, "jacobian": model.keeping({"jacobian"}), "momenta": model.keeping({"momenta"})}
    for _ in range(2):
        lean, jacobian, momenta = measured.costs_of(builds).values()
        found, none = jacobian.beyond(lean), momenta.beyond(lean)
        assert found is not None and none is not None
        assert found[1] < 30 < found[2] and found[2] - found[1] < 0.1 * 30
        assert none[1] < 0 < none[2] and none[2] - none[1] < 0.05 * 50


def test_builds_are_timed_in_processes_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    monkeypatch.setattr(measured, "PROCESSES", 3)
    monkeypatch.setattr(measured, "SECONDS", 0.02)
    model = mechc.loads(JUGGLE)
    (cost,) = measured.costs_of({"lean": model}).values()
    assert len(cost.processes) == 3 and len(set(cost.processes)) > 1
    assert all(1 < ns < 1e5 for ns in cost.processes)
    monkeypatch.setattr(measured, "PATIENCE", 1e-3)
    with pytest.raises(SimulationError, match="the process that times the model takes longer"):
        measured.costs_of({"lean": model})


def test_a_time_always_has_an_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of parts that no evaluation calls was said that nothing could be measured, or that they save negative times."""
    monkeypatch.setattr(measured, "_by_kernel", lambda _case, _steps: 50.0)
    model = mechc.loads(STIFF)
    saved = savings(model)
    text = " ".join(explanation(model, saved=saved).split())
    assert text.count("less than 0.5 ns an evaluation") == len(saved.parts)
    assert "ns an evaluation, all told 50 50 1.00 from 49.5 49.5 to 50.5 50.5" in text
    slower = replace(saved, lean=replace(saved.lean, processes=(53.0,) * measured.PROCESSES))
    text = " ".join(explanation(model, saved=slower).split())
    assert text.count("3.0 ns an evaluation more (2.5 to 3.5)") == len(saved.parts)
    counts = summary(model, saved)["lean"]
    assert counts["nanoseconds"] == 50.0 and counts["interval"] == pytest.approx((49.5, 50.5))


@pytest.mark.parametrize("target", ["python", "web"])
def test_other_targets_are_measured(target: str) -> None:
    made = savings(mechc.loads(STIFF), target)  # type: ignore[arg-type]
    assert made.lean.size is not None and made.everything.size is not None
    assert made.lean.size < made.everything.size
    assert made.lean.nanoseconds is None


LIGHT = """\
model Light
  coordinate Length x = 1 m;
  coordinate Length y ~ 0.5 m;
  kinetic 1/2*(1 kg)*der(x)^2;
  potential 9.81 N*y;
  constraint rod: x^2 + y^2 = 1.25 m^2;
  experiment(stop = 1 s);
end Light;
"""


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            LIGHT,
            {
                "accelerations": "line 4: kinetic",
                "singular mass matrix": "line 3: coordinate Length y",
                "assertions": "line 3: coordinate Length y",
            },
        ),
        (
            STIFF.replace("coordinate y", "\n  coordinate y"),
            {
                "independent subsystems": "line 3: coordinate x",
                "the Jacobian of implicit methods": "'der(y)' changes fastest: line 4: coordinate y",
            },
        ),
        (
            STIFF.replace("stop = 10 s", 'stop = 10 s, method = "radau5"'),
            {"the Jacobian of implicit methods": "which works on it: line 7: experiment"},
        ),
    ],
)
def test_choices_among_forms_name_their_line(text: str, told: dict[str, str]) -> None:
    """The motion of y moves no mass; that of the sensor is the stiff one."""
    ran = as_run(mechc.loads(text))
    reasons = {c["topic"]: c["reason"] for c in summary(ran.model, ran=ran)["choices"]}
    for topic, line in told.items():
        assert line in reasons[topic], reasons
    kept = [c for c in summary(ran.model, ran=ran)["choices"] if c["decision"] != "left out"]
    assert all("line " in c["reason"] for c in kept)


SPATIAL = """\
import mech.spatial.*;
model Flight
  gravity {0, 0, -9.81 m/s^2};
  input Length reach = 1 m;
  discrete Integer turns = 0;
  state Real wear = 0;
  Body stone(m = 1 kg, J = diag({1, 2, 3} kg.m^2));
  Free flight(world -> stone.a);
  Body swing(m = 1 kg, J = diag({1, 2, 3} kg.m^2));
  Revolute pin(world -> swing.a, axis = {1, 0, 0});
  drive pin.angle = sin(3 rad/s*time);
  coordinate Length x = 1 m;
  kinetic 1/2*(1 kg)*der(x)^2;
  force table(x, {0, 1, 2} m, {0, 1, 3} N) on x;
  force -(1 N/m)*delay(x, 0.1 s) on x;
  damping 1 N.s/m on x;
  equation der(wear) = 1/(1 s);
  when x > reach then turns := turns + 1; end when;
  constraint hold: flight.position[1] = 0 m;
  assert x < 9 m, "far";
  contact floor: x restitution 0.5;
  experiment(stop = 1 s);
end Flight;
"""


def test_every_fact_that_is_needed_names_the_line_of_a_statement() -> None:
    model = mechc.loads(SPATIAL)
    topics = {c["topic"]: c for c in summary(model)["choices"]}
    for fact, words in FACTS.items():
        assert topics[words]["decision"] == "needed", fact
        found = re.search(r": line (\d+): (.+)", topics[words]["reason"])
        assert found, topics[words]
        assert SPATIAL.splitlines()[int(found[1]) - 1].strip() == found[2]


@pytest.mark.parametrize("text", [STIFF, JUGGLE, LOOP, LIGHT, SPATIAL])
def test_every_reason_names_a_line_or_all_lines(text: str) -> None:
    model = mechc.loads(text)
    choices = list(model.compilation.equations.choices)
    for name, part in PARTS.items():
        choices += [Choice(part.words, kind, part.absence, part=name) for kind in ("kept", "left out")]
    for choice in choices:
        assert re.search(r": lines? \d", _reason(choice, model, None)), choice
    absent = next(c for c in choices if c.part == "scene")
    first = next(k for k, row in enumerate(text.splitlines(), 1) if row.startswith("model"))
    assert _reason(absent, model, None).endswith(f": lines {first} to {len(text.splitlines())}")


def test_a_line_of_another_file_names_it(tmp_path: Path) -> None:
    (tmp_path / "base.mech").write_text(
        "model Base\n  coordinate Length x = 1 m;\n  kinetic 1/2*(1 kg)*der(x)^2;\nend Base;\n"
    )
    path = tmp_path / "own.mech"
    path.write_text("import base.*;\nmodel Own\n  extends Base;\n  damping 1 N.s/m on x;\nend Own;\n")
    reasons = {c["topic"]: c["reason"] for c in summary(mechc.load(path))["choices"]}
    assert reasons["the account of dissipated energy"].endswith(": line 4: damping 1 N.s/m on x;")
    assert re.search(r"line 3 of \S*base.mech: kinetic", reasons["accelerations"]), reasons["accelerations"]
