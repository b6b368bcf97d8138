"""The report of a run says what happened, in the units of the model."""

from __future__ import annotations

import math
import re

import pytest
from hand_made import failing_solution, pendulum_solution

import mechc
from mechc.display import choose
from mechc.presentation.numbers import count, duration, number
from mechc.presentation.report import report
from mechc.presentation.run_failure import render_failure
from mechc.presentation.sweep_report import sweep_report


def test_a_completed_run() -> None:
    solution = pendulum_solution()
    rows = report(solution).splitlines()
    assert rows[0] == "Pendulum: completed at time = 5 s"
    assert rows[2] == "  method     dop853, compiled C"
    assert re.fullmatch(r"  steps      \d+(, \d+ rejected)?, [\d ]+ evaluations", rows[3])
    theta = next(row for row in rows if row.startswith("  theta "))
    error = r"\d\.\de-\d\d"
    assert re.fullmatch(rf"  theta +-?\d+\.\d+ deg +{error} +{error}", theta)
    assert float(theta.split()[1]) == pytest.approx(solution["theta"][-1] * 57.29577951308232, rel=1e-6)
    assert any(re.fullmatch(rf"  energy balance +{error} J +{error}", row) for row in rows)
    assert not any("energy.lost" in row for row in rows), "accounts are kept for the balance only"


def test_outputs_and_discrete_variables_stand_below_the_states() -> None:
    text = """dimensionless; coordinate x = 0; initial der(x) = 1; kinetic 1/2*der(x)^2; output double = 2*x;
    discrete Integer hits = 0; when x > 1 then hits := hits + 1; end when; when x > 1.5 then hits := 7; end when;"""
    solution = mechc.loads(text).simulate(stop=2)
    assert isinstance(solution, mechc.Solution)
    rows = report(solution).splitlines()
    names = [row.split()[0] for row in rows[rows.index("") + 5 :] if row.startswith("  ")][1:6]
    assert names == ["x", "der(x)", "double", "hits", "errors"]
    assert next(row for row in rows if row.startswith("  double ")).split() == ["double", "4"]
    events = rows[next(k for k, row in enumerate(rows) if row == "  2 events") + 1 :]
    assert [row.split() for row in events] == [["1", "x", ">", "1", "when"], ["1.5", "x", ">", "1.5", "when"]]
    assert len({row.index("when") for row in events}) == 1, "kinds stand below each other"


PART = "model Part output y[14] = {i*time for i in 1:14}; end Part; "


def test_only_outputs_of_parts_are_left_out_of_the_report_which_says_how_many() -> None:
    text = PART + "model Whole Part a; Part b; output z[20] = {i^2*time for i in 1:20}; "
    solution = mechc.loads(text + "coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; end Whole;").simulate(
        stop=1
    )
    assert isinstance(solution, mechc.Solution)
    rows = [row.split() for row in report(solution).splitlines()]
    assert [row[:2] for row in rows if row and row[0].startswith("z")] == [
        [f"z[{i}]", str(i * i)] for i in range(1, 21)
    ]
    assert not any(row and row[0].startswith(("a.y", "b.y")) for row in rows)
    note = "... and {} more quantities of parts; 'mechc run --outputs NAME,...' shows those it names"
    assert note.format(28).split() in rows
    asked = [row.split() for row in report(solution, of=("b.y[3]", "a.y[14]")).splitlines()]
    assert [row[:2] for row in asked if row and row[0].startswith(("a.y", "b.y"))] == [
        ["a.y[14]", "14"],
        ["b.y[3]", "3"],
    ]
    assert note.format(26).split() in asked


def test_states_that_are_asked_for_are_in_the_report() -> None:
    """Twenty oscillators of one frequency: their errors are alike; those of the last ones are the smallest."""
    text = "coordinate x[20] = {1 m/i^2 for i in 1:20}; kinetic sum(1/2*1 kg*der(x[i])^2 for i in 1:20); "
    text += "potential sum(1/2*1 N/m*x[i]^2 for i in 1:20); input Force f = 0 N; force f on x[1];"
    solution = mechc.loads(text).simulate(stop=1)
    assert isinstance(solution, mechc.Solution)
    names = [f"x[{i}]" for i in range(1, 21)]
    rows = report(solution, of=(*names, "f", "energy.total")).splitlines()
    shown = {row.split()[0]: row.split()[1] for row in rows if row and len(row.split()) > 1}
    for i in range(1, 21):
        assert float(shown[f"x[{i}]"]) == pytest.approx(math.cos(1) / i**2, rel=1e-6)
    assert shown["f"] == "0" and "energy.total" in shown
    said = "... and 20 more states with smaller errors; 'mechc run --outputs NAME,...' shows those it names"
    assert "  " + said in rows
    assert "... and 28 more states with smaller errors;" in report(solution)


def test_derivatives_of_own_outputs_are_in_the_report() -> None:
    text = "parameter k = 2; coordinate x[13] = {i*k*1 m for i in 1:13}; kinetic sum(1/2*1 kg*der(x[i])^2 for i in 1:13); "
    solution = mechc.loads(text + "output y = k^2;").simulate(stop=1, sensitivity="k")
    assert isinstance(solution, mechc.Solution)
    rows = [row.split() for row in report(solution).splitlines()]
    assert next(row for row in rows if row and row[0] == "d(y)/d(k)")[1] == "4"
    note = "... and 3 more derivatives; 'mechc run --outputs NAME,...' shows those it names"
    assert note.split() in rows
    asked = report(solution, of=[f"x[{i}]" for i in range(1, 14)] + [f"der(x[{i}])" for i in range(1, 14)])
    assert asked.count("/d(k)") == 26


def test_the_table_of_a_sweep_has_all_outputs_of_the_model() -> None:
    text = PART + "model Whole Part a; parameter k = 1; output z[8] = {i*k for i in 1:8}; "
    text += (
        "coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; experiment both(k in {1, 2}, stop = 1 s); end Whole;"
    )
    sweep = mechc.loads(text).sweep(experiment="both")
    rows = [row.split() for row in sweep_report(sweep).splitlines()]
    assert rows[2] == ["k", "outcome", "steps", *(f"z[{i}]" for i in range(1, 9)), "error"]
    assert rows[4][3:11] == [str(2 * i) for i in range(1, 9)]
    said = "  ... and 15 more quantities; 'mechc run --outputs NAME,...' shows those it names"
    assert sweep_report(sweep).splitlines()[5] == said
    rows = [row.split() for row in sweep_report(sweep, of=("a.y[2]", "der(x)")).splitlines()]
    assert {"a.y[2]", "z[1]", "z[8]", "der(x)"} < set(rows[2]) and rows[5][2] == "14"


def test_outputs_alone_are_all_that_is_said_of_what_does_not_move() -> None:
    text = "dimensionless; output y[14] = {i^2 for i in 1:14}; experiment(stop = 0);"
    solution = mechc.loads(text).simulate()
    assert isinstance(solution, mechc.Solution)
    rows = [row.split() for row in report(solution).splitlines() if row]
    assert rows[4] == ["at", "0"] and rows[5:] == [[f"y[{i}]", str(i * i)] for i in range(1, 15)]
    # a prescribed motion has an energy
    driven = mechc.loads("coordinate Length x; kinetic 1/2*2 kg*der(x)^2; drive x = 3 m/s*time;")
    moving = driven.simulate(stop=1)
    assert isinstance(moving, mechc.Solution)
    assert "energy balance" in report(moving) and "estimated error" not in report(moving)


def test_an_energy_below_rounding_is_told_as_none() -> None:
    """To and fro: as much is taken back as was supplied, up to rounding of the 450 J in between."""
    text = """coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; parameter k = 1;
    force (if time < 15 s then 2 N else -6 N*k) on x; experiment(stop = 20 s);"""
    model = mechc.loads(text)
    shown = []
    for k in (1, 1 + 1e-5):
        solution = model.simulate(set={"k": k})
        assert isinstance(solution, mechc.Solution)
        supplied = solution.energy.supplied if solution.energy is not None else None
        assert supplied is not None and 0 < abs(supplied) < 1e-6
        shown.append(next(row.split() for row in report(solution).splitlines() if "  supplied" in row))
    assert shown[0] == ["supplied", "0", "J"] and float(shown[1][1]) != 0


def test_of_many_events_the_report_counts_the_kinds() -> None:
    text = "coordinate x = 0 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2; discrete Integer n = 0; "
    solution = mechc.loads(text + "when sin(x*20*pi/1 m) > 0 then n := n + 1; end when;").simulate(stop=1.05)
    assert isinstance(solution, mechc.Solution)
    *_, counted, last = report(solution).splitlines()
    assert counted == "  ... and 3 more; in all: 11 sin(x*20*pi/1 m) > 0 when"
    assert last.split()[:2] == ["1", "s"] and last.endswith("when, the last")


def test_of_many_kinds_of_events_those_are_counted_that_came_again() -> None:
    """Of the events of ten kinds, each of which came once, nothing came most often."""
    once = "".join(f"when time > 0.{k}5 s then n := n + 1; end when; " for k in range(10))
    model = mechc.loads(f"coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; discrete Integer n = 0; {once}")
    again = mechc.loads(
        f"coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; discrete Integer n = 0; {once}"
        "when sin(time*5*pi/1 s) > 0.5 then n := n + 1; end when;"
    )
    told = [
        next(row for row in report(m.simulate(stop=1)).splitlines() if "more" in row) for m in (model, again)
    ]
    assert told == [
        "  ... and 2 more",
        "  ... and 5 more; of all most often: 3 sin(time*5*pi/1 s) > 0.5 when",
    ]


CLOCKS = """model Controller
  parameter Time period = 1 ms;
  discrete Integer n = 0;
  when sample(period) then n := n + 1; end when;
end Controller;
model Two
  Controller a;
  Controller b(period = 3 ms);
  coordinate x = 0.1 m;
  initial der(x) = 1 m/s;
  discrete Integer n = 0;
  let tick = sample(5 ms);
  kinetic 1/2*1 kg*der(x)^2;
  when tick then n := n + 1; end when;
  when tick and x > 0.5995 m then n := n + 1; end when;
  when x > 0.3 m then n := n + 1; end when;
  when x > 0.9 m or sample(1 s, 0.6 s) then n := n + 1; end when;
  when sample(2 s, 0.9 s) then n := n + 1; end when;
end Two;
"""


def test_a_clock_is_one_line_and_other_events_stay() -> None:
    """x = 0.1 + t: ticks at k T for k from 0 to 1/T, of the third at 0.5, 0.505, .., 1 s where the condition holds."""
    solution = mechc.loads(CLOCKS).simulate(stop=1)
    assert isinstance(solution, mechc.Solution)
    rows = report(solution).splitlines()
    ticks = ((1001, "0 s to 1"), (334, "0 s to 0.999"), (201, "0 s to 1"), (101, "0.5 s to 1"))
    texts = ("a: sample(period)", "b: sample(period)", "tick", "tick and x > 0.5995 m")
    at = rows.index(f"  {1001 + 334 + 201 + 101 + 1 + 2 + 1} events")
    clocks = [f"  {text:<21}  {n} times, from {t} s" for text, (n, t) in zip(texts, ticks, strict=True)]
    assert rows[at + 1 : at + 5] == clocks
    others = [re.split(r"  +", row.strip()) for row in rows[at + 5 :]]
    assert others == [
        ["0.2 s", "x > 0.3 m", "when"],
        ["0.6 s", "x > 0.9 m or sample(1 s, 0.6 s)", "when"],
        ["0.8 s", "x > 0.9 m or sample(1 s, 0.6 s)", "when"],
        ["0.9 s", "sample(2 s, 0.9 s)", "when"],
    ]
    assert len(solution.summary()["events"]) == 1641, "data hold all"


def test_swept_values_have_their_units() -> None:
    text = "parameter l = 1 m; structural parameter Integer n = 1; coordinate Length x = n*l; kinetic 1 kg*der(x)^2;"
    sweep = mechc.loads(text + "experiment both(l in {1, 2} m, n in {1, 3}, stop = 1 s);").sweep(
        experiment="both"
    )
    head = next(row for row in sweep_report(sweep).splitlines() if "outcome" in row)
    assert re.split(r"  +", head.strip())[:3] == ["n", "l [m]", "outcome"]


def test_drift_off_the_constraints() -> None:
    """What the steps leave, and what is left after their projection."""
    text = "coordinate x = 0.6 m;coordinate y ~ -0.8 m;kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"
    model = mechc.loads(f"{text}potential 9.81 N*y;constraint rod: x^2 + y^2 = 1 m^2;")
    solution = model.simulate(stop=2)
    assert isinstance(solution, mechc.Solution)
    rows = report(solution).splitlines()
    head = next(k for k, row in enumerate(rows) if row.startswith("  drift off the constraints"))
    for row, level in zip(rows[head + 1 : head + 3], ("positions", "velocities"), strict=True):
        name, before, after = row.split()
        assert name == level
        assert float(after) < 1e-14 < float(before) < 1e-6


def test_chosen_units_change_rates_too() -> None:
    shown = report(pendulum_solution().shown_in("mrad"))
    assert re.search(r"^  theta +-?[\d.]+ mrad ", shown, re.MULTILINE)
    assert re.search(r"^  der\(theta\) +-?[\d.]+ mrad/s ", shown, re.MULTILINE)


def test_the_balance_of_energies_and_what_disagrees_are_told_in_chosen_units() -> None:
    text = "coordinate q = 0.001 m; kinetic 1/2*1 kg*der(q)^2; potential 1/2*10 N/m*q^2; exact q = 0.003 m; experiment(stop = 1 s);"
    solution = mechc.loads(text).simulate()
    assert isinstance(solution, mechc.Solution)
    in_si = report(solution).splitlines()
    assert solution.accuracy.energy is not None
    drift, off = solution.accuracy.energy.absolute, solution.true_errors[0].largest
    solution.display = choose("mJ,mm")
    rows = report(solution).splitlines()
    for told, energy, length in ((in_si, "J", "m"), (rows, "mJ", "mm")):
        by = 1000 if energy == "mJ" else 1
        balance = next(row for row in told if row.startswith("  energy balance"))
        assert balance.split()[2:4] == [f"{drift * by:.1e}", energy]
        assert told[-1].split()[:3] == ["q", f"{off * by:.1e}", length]


def test_a_failure_names_time_line_and_state() -> None:
    solution = failing_solution()
    assert report(solution).startswith("Pendulum: failed at time = 1 s")
    rows = render_failure(solution).splitlines()
    assert re.fullmatch(r"error: the \w+ of 'theta' is not a number at t = 1 s", rows[0])
    assert rows[1:4] == [
        "  --> pendulum.mech:5:3",
        " 5 |   coordinate theta = 60 deg;",
        "   |   ^^^^^^^^^^^^^^^^^^^^^^^^^^",
    ]
    assert re.fullmatch(r"   = state: theta = \S+ rad, der\(theta\) = \S+ rad/s", rows[4])


def test_a_failed_assertion_shows_its_own_line() -> None:
    rows = render_failure(pendulum_solution(**{"der(theta)": 7.0})).splitlines()
    assert rows[0].startswith("error: assertion failed at t = ")
    assert rows[0].endswith(": the bob stays below")
    assert rows[1] == "  --> pendulum.mech:9:3"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(1.83e-4, "183 us"), (0.0021, "2.1 ms"), (0.9996, "1 s"), (3.42, "3.42 s"), (125.4, "2 min 5 s")],
)
def test_durations(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_counts_are_grouped() -> None:
    assert [count(n) for n in (0, 999, 1234567)] == ["0", "999", "1 234 567"]


def test_zero_has_no_sign() -> None:
    assert [number(x) for x in (-0.0, 0.0, -1.25e-9)] == ["0", "0", "-1.25e-09"]


@pytest.mark.parametrize("display", ["", "mm,deg"])
def test_units_with_powers_that_are_not_whole_are_in_the_report(display: str) -> None:
    """The stroke of m^(3/2) divides no units: whoever asked for such an output got a crash of the report."""
    text = """coordinate Length x = 4 m; initial der(x) = 2 m/s; kinetic 1/2*1 kg*der(x)^2;
    output a = x^1.5; output b = sqrt(der(x)); output A = integral(x^1.5);"""
    solution = mechc.loads(text).simulate(stop=1)
    assert isinstance(solution, mechc.Solution)
    solution.display = choose(display)
    rows = {row.split()[0]: row.split() for row in report(solution).splitlines() if len(row.split()) > 2}
    assert [rows[name][2] for name in ("a", "b", "A")] == ["m^(3/2)", "m^(1/2)/s^(1/2)", "m^(3/2).s"]
    assert rows["a"][1] == "14.69694", "6^1.5"
