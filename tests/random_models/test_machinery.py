"""The machinery around random models: states at which they are compared, limits, mutants."""

from __future__ import annotations

import re
import subprocess
from copy import copy
from random import Random
from types import SimpleNamespace

import numpy as np
import pytest
from msgspec.structs import replace
from oracle import Meaning
from random_models import exact
from random_models.balance import unaccounted
from random_models.checks import compare_twin
from random_models.compiled import compiled
from random_models.definition import LOOKED, UNTIL, along, edged, moved, undone
from random_models.generator import generate
from random_models.limits import TooLong, limited
from random_models.motions import by_another_method, columns, difference, doubts, loose, run, slow
from random_models.mutants import FOLDER, ROOT, mutants, texts
from random_models.nesting import by_element, with_gravity
from random_models.overruling import overruling
from random_models.spelled_out import spelled_out
from random_models.states import looks
from random_models.structure import as_functions, inherited
from random_models.tree import Model, statement
from random_models.twins import Twin

import mechc

BOX = """coordinate Length y = 0.5 m;
coordinate Length x = 0 m;
initial der(x) = 0.3 m/s;
kinetic 1/2*2 kg*(der(x)^2 + der(y)^2);
potential 2 kg*9.81 m/s^2*y;
force 3 N on x;
contact floor: y - 0.1*x friction 0.2 along der(x);
output push = multiplier(floor);
experiment(stop = 1 s);
"""


def test_a_contact_is_looked_at_where_it_touches() -> None:
    meaning = Meaning(compiled(BOX).model.compilation.flat, experiment="")
    there = dict(looks(meaning, np.random.default_rng(1), 2))
    assert set(there) == {"start", "random", "at rest", "on a contact", "sliding"}
    state = there["on a contact"]
    assert abs(state["y"] - 0.1 * state["x"]) < 1e-12
    assert state["der(x)"] == state["der(y)"] == 0
    assert meaning.modes(state)["floor"] != "open"
    moving = there["sliding"]
    assert abs(moving["y"] - 0.1 * moving["x"]) < 1e-12
    assert abs(moving["der(y)"] - 0.1 * moving["der(x)"]) < 1e-12
    assert abs(moving["der(x)"]) > 1e-3
    assert meaning.modes(moving)["floor"].startswith("slip")


def test_what_a_run_decides_is_asked_of_the_kernel() -> None:
    LOOKED.clear()
    assert undone(compiled(BOX, quick=False), 1) == []
    assert LOOKED["on a contact"] == LOOKED["at rest"] == LOOKED["sliding"] == 1


def test_another_law_is_seen_on_a_contact() -> None:
    other = compiled(BOX.replace("friction 0.2", "friction 0.01"), quick=False)
    other.model = compiled(BOX).model
    assert undone(other, 1)


def test_methods_with_steps_of_one_size_are_run() -> None:
    """None was told its step: all were refused, and nothing was compared."""
    pendulum = "coordinate Angle a = 1 rad; kinetic 1/2*1 kg.m^2*der(a)^2; potential -9 J*cos(a); experiment(stop = 1 s);"
    first, other = run(pendulum), run(pendulum, "lobatto4")
    assert other.statistics.method == "lobatto4" and not difference(first, other)
    assert by_another_method(pendulum, first, Random(0)) == ""
    rough = SimpleNamespace(accuracy=SimpleNamespace(error=SimpleNamespace(by_state={"a": 1e-4})))
    assert "0.0001" in loose(first, rough, "taylor") and "0.0001" in loose(first, rough, "lobatto4")
    assert not loose(first, rough, "rattle") and not loose(first, first, "lobatto6")


def test_steps_that_solve_for_contacts_have_no_events_of_them() -> None:
    """A block is pushed, slides and sticks again; its clock ticks in both."""
    block = (
        "coordinate Length x = 0 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2; friction f: 4 N on x; "
        "discrete Integer ticks = 0; when {} then ticks := ticks + 1; end when; experiment(stop = 1 s);"
    )
    first, other = (run(block.format("sample(0.3 s, 0.15 s)"), method) for method in ("dop853", "moreau"))
    assert {"stick", "when"} <= {e.kind for e in first.events} and {e.kind for e in other.events} == {"when"}
    assert difference(first, other) == ""
    assert "events" in difference(first, run(block.format("sample(0.5 s, 0.25 s)"), "moreau"))


def test_the_order_of_methods_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """An error that half the step does not make four times as small, as one of an account, is not an error of second order."""
    text = (
        "coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 2 N/m*x^2; experiment(stop = 1 s);"
    )
    first = run(text)
    assert slow(text, first, "verlet") == ""

    runs = [
        columns(run(text, "verlet", step=h)) | {"x": np.asarray(first["x"]) + 0.1 * h} for h in (0.02, 0.01)
    ]
    monkeypatch.setattr("random_models.motions.run", lambda *_, step: runs[step < 0.02])
    assert slow(text, first, "verlet").startswith("x is off by")


def test_what_is_said_of_integrals_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    model = generate(82)
    base = compiled(model.text(), quick=False)
    assert exact.exact(model) and exact.badly_known(model, base, 1) == []
    monkeypatch.setattr(exact, "ROUNDING", 0.0)
    assert exact.badly_known(model, base, 1)


def test_limits_stand_inside_of_each_other() -> None:
    with pytest.raises(TooLong), limited(0.2):
        with pytest.raises(TooLong), limited(0.05):
            while True:
                pass
        while True:
            pass


@pytest.mark.slow
def test_gravity_that_overrules_stays_the_nearest() -> None:
    model = generate(514)
    base = compiled(model.text())
    for k in range(4):
        heavy = with_gravity(model, Random(k))
        assert heavy is not None
        twin = inherited(heavy.model, Random(k))
        assert twin is not None
        assert compare_twin(base, twin, k) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [363, 11604])
def test_initial_values_of_elements_stay_with_that_of_the_whole(seed: int) -> None:
    """What an heir says of the whole overrules what its base says of elements: they move together, and none is said of it."""
    model = generate(seed)
    base = compiled(model.text())
    twins = []
    for k in range(8):
        apart = by_element(model, Random(k))
        twins += [inherited(apart.model, Random(k))] if apart is not None else []
    assert len(twins) > 3
    for twin in twins:
        assert twin is not None and not compare_twin(base, twin, 1)


@pytest.mark.slow
def test_values_of_elements_are_stated_beside_components_too() -> None:
    """What is said of one element goes before what is said of the whole, of a joint's coordinates and rates as well."""
    models = (m for m in map(generate, range(400)) if "planar" in m.text())
    model = next(m for m in models if re.search(r"Translation [^;]*\Wposition [=~] \{", m.text()))
    twins = [by_element(model, Random(k)) for k in range(6)]
    named = [s.name for twin in twins if twin is not None for s in twin.model.top.seq().items]
    assert any(name.endswith("position[2]") for name in named)
    base = compiled(model.text())
    assert not any(compare_twin(base, twin, 1) for twin in twins if twin is not None)


def test_models_hold_what_faults_have_to_be_seen_in() -> None:
    """Laws of which one branch asks for a force, clocks that read each other, floors that bend below what slides."""
    written = "\n".join(generate(seed).text() for seed in range(40))
    assert re.search(r"force if .* else .*(reaction|multiplier|moment|power)\(", written)
    assert re.search(r"when sample\(0\.1 s\) then\s+(n\d+) := .*\1 \+ .*\*n\d+;", written)
    assert re.search(r"contact C\d+: q\d+ - .*(abs|max|min|clamp)\(", written)


class _Run(dict[str, float]):
    outcome = "Outcome.DOUBTFUL"
    message = "a drift"
    problem = SimpleNamespace(energy_balance=False)


def test_what_a_run_tells_against_itself_is_a_disagreement() -> None:
    assert doubts(_Run()) == [("doubtful", "a drift")]


@pytest.mark.slow
def test_twins_of_a_seed_are_searched_with_it() -> None:
    there = [seed for seed in range(60) if "extends B" in texts(seed)]
    assert there and not any("extends B" in generate(seed).text() for seed in there)


def test_heirs_leave_what_is_due_together_in_turn() -> None:
    """What a model extends comes first: its `when` act before those of the model at one instant."""
    for seed in (3, 10, 25, 28, 56):
        model = generate(seed)
        whens = re.findall(r"when .*? then", model.text())
        assert len(whens) > 1
        for k in range(8):
            twin = inherited(model, Random(k))
            assert twin is not None
            assert re.findall(r"when .*? then", twin.model.text()) == whens


@pytest.mark.slow
def test_of_several_nearest_starts_each_is_right_and_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the guesses two chains of steps end at two places, nearer both than all around them."""
    for kind in ("arithmetic", "orientations"):  # found before there were any
        monkeypatch.setattr(f"random_models.{kind}.SHARE", 0)
    base = compiled(generate(10257).text())
    meaning = Meaning(base.model.compilation.flat, experiment="")
    assert base.start()["j2.angle"] != pytest.approx(meaning.start()["j2.angle"], abs=0.5)
    assert undone(base, 1) == []
    aside = meaning.project(base.start() | {"j2.angle": base.start()["j2.angle"] + 0.01})
    assert aside["j2.angle"] != pytest.approx(base.start()["j2.angle"], abs=1e-3)
    y0 = np.array([aside.get(n, v) for n, v in base.start().items() if n != "time"])
    base.case = replace(base.case, y0=y0)
    assert [kind for kind, _ in undone(base, 1)] == ["start"]


def test_powers_are_not_compared_where_a_law_bends() -> None:
    """max(x, y) where both are equal: the potential changes by one rate ahead and by another behind."""
    text = """coordinate Length x = 0 m; coordinate Length y = 0 m; initial der(x) = 1 m/s;
    kinetic 1 kg*(der(x)^2 + der(y)^2);
    potential 1 N*max(x, y);
    experiment(stop = 1 s);
    """
    base = compiled(text)
    assert unaccounted(base, base.start())
    assert undone(base, 1) == []


TIED = """coordinate Length x = 0.5 m;
initial der(x) = 1 m/s;
kinetic 1/2*1 kg*der(x)^2;
force if der(x) < {} then 1 N else 2 N on x;
experiment(stop = 1 s);
"""


def test_what_is_always_tied_is_no_edge() -> None:
    """Models with x < x somewhere were never compared."""
    always, now = compiled(TIED.format("der(x)")), compiled(TIED.format("1 m/s"))
    assert not edged(always, always.start() | {"time": 0.0})
    assert edged(now, now.start() | {"time": 0.0})


BALL = """import mech.spatial.*;
gravity {0.4, 0, -6} m/s^2;
Disk disk(m = 1.3 kg, r = 0.44 m);
Spherical ball(world -> disk.a, orientation = axis_angle({0.9, -0.51, -0.59}, 0.5));
Bar bar;
Prismatic rail(disk.a -> bar.a, position = -0.56 m);
output o = mod(moment(ball)[1], 2.4 N.m);
experiment(stop = 1 s);
"""


def test_the_floor_of_what_is_zero_but_for_rounding_is_an_edge_everywhere() -> None:
    base = compiled(BALL)
    assert edged(base, base.start())


def test_an_edge_is_looked_for_with_the_values_of_discrete_variables() -> None:
    """States of a run of no length hold what moves alone."""
    text = TIED.format("n*(1 m/s)").replace("experiment", "discrete Real n = 1;\nexperiment")
    base = compiled(text)
    assert "n" not in base.start() and edged(base, base.start())


PULSED = """coordinate Length x = 0.06 m;
kinetic 1/2*1 kg*der(x)^2;
force (if {} then {} N else 2 N) on x;
output y ~ 0.8;
equation 1 J^-1*energy() = y + 0.2*atan(y);
output o = der(y);
experiment(stop = 1 s);
"""


def test_pulses_that_begin_at_an_instant_or_behind_it_are_alike_where_the_definition_cannot_tell() -> None:
    base = compiled(PULSED.format("sin(2*pi*time/(0.14 s)) > 0", 1), quick=False)
    assert edged(base, base.start()) is None
    for force, alike in ((1, True), (3, False)):
        text = PULSED.format("mod(time, 0.14 s) < 0.07 s", force)
        twin = Twin("another", Model((statement("list", text),)))
        assert (compare_twin(base, twin, 1) == []) is alike


def test_a_run_ends_where_an_event_ends_the_motion_by_definition() -> None:
    ending = """coordinate Length x = 0.1 m;
    discrete Real n = 0;
    kinetic 1/2*1 kg*der(x)^2;
    when time > {} s then n := 1; terminate("enough"); end when;
    experiment(stop = 1 s);
    """
    base = compiled(ending.format(0.2), quick=False)
    for late, said in ((0.2, []), (0.3, ["end"]), (0.9, ["end"])):
        solution = mechc.loads(ending.format(late)).simulate(stop=UNTIL)
        assert [what for what, _ in moved(base, solution)] == said


def _named(seed: int, k: int) -> str:
    twin = as_functions(generate(seed), Random(k))
    return "" if twin is None else twin.model.text()


def test_functions_take_no_elements_out_of_the_sum_that_counts_them() -> None:
    seed = next(s for s in range(200) if re.search(r"kinetic sum\(sum\(", generate(s).text()))
    written = [_named(seed, k) for k in range(30)]
    assert not any(re.search(r"(kinetic|potential) g\d+\(.*\[i\d+, i\d+\]\)+;", text) for text in written)


def test_of_two_statements_that_read_alike_one_may_move() -> None:
    model = generate(14)
    energy = next(s for s in model.top.seq().items if s.kind == "energy")
    twice = model.with_top((copy(energy), *model.top.seq().items))
    line = energy.text()
    assert twice.text().count(line) == 2
    twins = [inherited(twice, Random(k)) for k in range(12)]
    assert all(twin.model.text().count(line) == 2 for twin in twins if twin is not None)


RELEASED = """coordinate Length x = 0 m;
coordinate Length y = 0 m;
initial der(x) = 1 m/s;
initial der(y) = 1 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
force 1 N on x;
constraint hold: der(x) = der(y);
when time > 0.1 s then
  release hold;
end when;
output holds = if closed(hold) then 1 else 0;
output push = multiplier(hold);
experiment(stop = 0.3 s);
"""


def test_rows_of_a_motion_know_what_was_released() -> None:
    assert along(compiled(RELEASED), run(RELEASED)) == []


def test_short_forms_are_spelled_out() -> None:
    """Flattening is read by the definition, too: only another text tells that it is wrong."""
    seed = next(s for s in range(0, 100, 4) if "elseif" in generate(s).text())
    twin = spelled_out(generate(seed), Random(0))
    assert twin is not None
    assert twin.model.text().count("elseif") < generate(seed).text().count("elseif")


def test_of_initial_values_the_outermost_text_counts() -> None:
    model = generate(14)
    twin = overruling(model, Random(1))
    assert twin is not None and "extends Middle" in twin.model.text()
    base, other = compiled(model.text()).start(), compiled(twin.model.text()).start()
    assert other == pytest.approx(base)


@pytest.mark.slow
def test_every_mutant_applies() -> None:
    """Whoever changes what a patch mutates writes the patch anew, or removes it with its row."""
    kept = mutants()
    assert {f"{name}.patch" for name in kept} == {file.name for file in FOLDER.glob("*.patch")}
    words = ["patch", "-p0", "--dry-run", "-s", "-f"]
    applies = {
        name: subprocess.run(words, cwd=ROOT, input=one.patch, text=True, capture_output=True).returncode == 0
        for name, one in kept.items()
    }
    assert [name for name, fits in applies.items() if not fits] == []
