"""What ``mechc explain`` says: of the run that is made, with the line that needs each thing, and times with their intervals."""

from __future__ import annotations

import pytest

import mechc
from mechc.compiler.equations.needs import FACTS
from mechc.measurement import savings as measured
from mechc.measurement.explanation import as_run, explanation, summary
from mechc.measurement.needed_by import lines
from mechc.measurement.savings import Cost, savings
from mechc.runtime.native.build import find_compiler

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
    """Rounds are compared in pairs: a machine that slows down in the middle changes both."""
    drift = [float(k * k) for k in range(11)]
    lean = Cost(1, 1, 1, 10.0, tuple(10 + x for x in drift))
    more = Cost(1, 1, 1, 12.0, tuple(12 + x + (0.5 if k % 2 else -0.5) for k, x in enumerate(drift)))
    found = more.beyond(lean)
    assert found is not None
    median, low, high = found
    assert low <= median <= high and low >= 1.5 and high <= 2.5
    assert more.beyond(Cost(1, 1)) is None


def test_what_cannot_be_measured_is_said_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts that no evaluation calls were said to save negative times."""
    times = iter([5.0, 4.0, 6.0] * 1000)
    monkeypatch.setattr(measured, "_by_kernel", lambda _case, _step: next(times))
    model = mechc.loads(STIFF)
    text = " ".join(explanation(model, saved=savings(model)).split())
    assert "below what can be measured" in text and "-" not in text.partition("saves")[2].split(" ns")[0][-4:]


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
