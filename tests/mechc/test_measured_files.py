"""Tables from files beside a run: what is read in another unit than it looks like is told."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import mechc
from mechc.cli.main import mechc as mechc_command
from mechc.runtime import inputs
from mechc.runtime.outcome import SimulationError

FOLLOW = """\
model Follow
  input Angle measured(interpolation = "spline") = 10 deg;
  input Torque push = 0 N.m;
  parameter Angle offset = 0 rad;
  coordinate Angle q;
  coordinate Angle w = 0 rad;
  drive q = measured;
  kinetic 1/2*2 kg.m^2*(der(q)^2 + der(w)^2);
  force push on w;
  output Angle sum = q + w + offset;
  experiment(stop = 1 s);
end Follow;
"""


@pytest.fixture(scope="module")
def model() -> mechc.Model:
    return mechc.loads(FOLLOW)


def table(folder: Path, head: str, rows: Sequence[tuple[float, ...]], name: str = "table.csv") -> Path:
    path = folder / name
    path.write_text(head + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    return path


RAMP = [(t / 4, 10.0 + 20 * t / 4) for t in range(5)]


def test_degrees_without_a_unit_are_told(model: mechc.Model, tmp_path: Path) -> None:
    """10 to 30 degrees read in rad, once under the name of the input and once under another one."""
    for head in ("time,measured", "time [s],measured", "time [s],knee"):
        run = model.simulate(inputs={"measured": table(tmp_path, head, RAMP)}, estimate_error=False)
        assert run["q"][-1] == pytest.approx(30.0, rel=1e-12)
        *renamed, said = run.remarks
        assert len(renamed) == head.endswith("knee")
        assert "'measured'" in said and "no unit" in said and "reaches 30 rad" in said and "[deg]" in said
    run = model.simulate(
        inputs={"measured": table(tmp_path, "time [s],measured [deg]", RAMP)}, estimate_error=False
    )
    assert run["q"][-1] == pytest.approx(30 * 3.141592653589793 / 180, rel=1e-12) and not run.remarks
    small = [(t, value / 10) for t, value in RAMP]
    assert not model.simulate(inputs={"measured": table(tmp_path, "time,measured", small)}).remarks


def test_units_that_only_one_of_two_files_has_are_told(model: mechc.Model, tmp_path: Path) -> None:
    angle = table(tmp_path, "time [ms],measured [deg]", [(1000 * t, v) for t, v in RAMP], "angle.csv")
    push = table(tmp_path, "time,push [N.m]", [(0, 0), (1000, 1)], "push.csv")
    run = model.simulate(inputs={"measured": angle, "push": push}, estimate_error=False)
    (said,) = run.remarks
    assert "'time' is in ms" in said and "angle.csv" in said and "push.csv" in said


def test_members_in_degrees_without_a_unit_are_told(model: mechc.Model, tmp_path: Path) -> None:
    found = model.ensemble(
        vary=str(table(tmp_path, "offset", [(10,), (20,)], "members.csv")), keep="final(sum)"
    )
    assert any("'offset'" in said and "reaches 20 rad" in said for said in found.remarks)
    path = tmp_path / "wrong.csv"
    path.write_text("offset [deg]\n1\n\n1_0\n")
    with pytest.raises(SimulationError, match=r"line 4 of .* holds '1_0'"):
        model.ensemble(vary=str(path), keep="final(sum)")


RIG = """\
model Rig
  parameter a = 1 N.s/m;
  parameter c = 0.5 N.s/m;
  input Length stroke(interpolation = "spline") = 0 mm;
  input Force push = 0 N;
  coordinate Length x;
  coordinate Length y = 0.3 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1/2*4 N/m*y^2;
  damping c on y;
  drive x = stroke;
  force push on y;
  output Force force = a*der(x);
  experiment(stop = 4 s);
end Rig;
"""
CLOCK = np.linspace(12.0, 14.0, 201)


@pytest.fixture(scope="module")
def rig() -> mechc.Model:
    return mechc.loads(RIG)


def driven(folder: Path, first: float = 12.0) -> Path:
    """The stroke sin(3 t) of a logger that was switched on 12 s before, with the force of a damper of 2 N.s/m."""
    t = CLOCK - 12.0
    rows = zip(t + first, np.sin(3 * t), 6 * np.cos(3 * t), strict=True)
    return table(folder, "time [s],stroke [m],force [N]", [tuple(map(float, row)) for row in rows])


def test_a_fit_begins_with_data_that_drive(rig: mechc.Model, tmp_path: Path) -> None:
    """The spline of these rows has the rate of the sine to 1e-4, at its ends, and so the fit has 2 N.s/m."""
    early = rig.fit(driven(tmp_path, 0.0), "a")
    late = rig.fit(driven(tmp_path), "a")
    asked = rig.fit(driven(tmp_path), "a", start="12 s")
    after = rig.fit(driven(tmp_path), "a", start=12.5)
    for found in (early, late, asked, after):
        assert found["a"] == pytest.approx(2.0, abs=1e-3)
    assert late["a"] == pytest.approx(early["a"], rel=1e-9) and asked["a"] == late["a"]
    assert any("begins at t = 12 s" in said for said in late.remarks) and not asked.remarks
    assert "151 numbers" in after.message
    with pytest.raises(SimulationError, match='begin with the table: --start "12 s"'):
        rig.fit(driven(tmp_path), "a", start=11)
    with pytest.raises(SimulationError, match="ends at 14, before the motion begins at 15"):
        rig.fit(driven(tmp_path), "a", start=15)


def test_a_run_begins_with_a_table_that_drives(rig: mechc.Model, tmp_path: Path) -> None:
    inputs = {"stroke": driven(tmp_path)}
    run = rig.simulate(inputs=inputs, start="12 s", stop="14 s")
    assert run.time[0] == 12.0 and run.time[-1] == 14.0 and run["x"][-1] == pytest.approx(np.sin(6.0))
    w, d = np.sqrt(4 - 0.0625), 0.25  # y'' + 0.5 y' + 4 y = 0 from 0.3 at 12 s
    y = 0.3 * np.exp(-d * 2) * (np.cos(w * 2) + d / w * np.sin(w * 2))
    assert run["y"][-1] == pytest.approx(y, rel=1e-7)
    assert any("begins at t = 12 s" in said for said in run.remarks)
    with pytest.raises(SimulationError, match='begin with the table: --start "12 s"'):
        rig.simulate(inputs=inputs, stop=2)
    with pytest.raises(SimulationError, match='begin and end with the table: --start "12 s" --stop "14 s"'):
        rig.simulate(inputs=inputs, stop=15)
    with pytest.raises(
        SimulationError, match="stops at t = 4 s, before the start at t = 12 s; give the stop"
    ):
        rig.simulate(inputs=inputs, start=12)
    many = rig.ensemble(
        vary="c = 0.5 N.s/m .. 0.6 N.s/m, 2", inputs=inputs, start=12, stop=14, keep="final(y)"
    )
    assert float(many["final(y)"][0]) == pytest.approx(y, rel=1e-7)


def test_a_force_that_was_measured_from_a_time_on(rig: mechc.Model, tmp_path: Path) -> None:
    """With the start at its first row the motion begins there; with another one at 0, where the first value holds."""
    path = table(tmp_path, "time [s],push [N]", [(float(t), float(np.cos(t))) for t in CLOCK])

    def y(begin: float) -> float:
        def rates(t: float, y: np.ndarray) -> list[float]:
            push = np.interp(t, CLOCK, np.cos(CLOCK))
            return [y[1], push - 4 * y[0] - 0.5 * y[1]]

        end = solve_ivp(rates, (begin, 14), [0.3, 0.0], rtol=1e-9, atol=1e-11, max_step=0.01)
        return float(end.y[0][-1])

    there = rig.simulate(inputs={"push": path}, start=12, stop=14, estimate_error=False)
    assert there["y"][-1] == pytest.approx(y(12.0), abs=1e-6)
    assert any("begins at t = 12 s" in said for said in there.remarks)
    from_zero = rig.simulate(inputs={"push": path}, start=13, stop=14, estimate_error=False)
    assert from_zero["y"][-1] == pytest.approx(y(0.0), abs=1e-6)
    assert any("beyond its ends its first and last value hold" in said for said in from_zero.remarks)


def test_data_that_begin_late_are_told(rig: mechc.Model) -> None:
    """y of 0.3 m at 7 s: a motion that begins at 0 fits it poorly and says so, one that begins there fits it."""
    t = np.linspace(0, 3, 61)
    w, d = np.sqrt(4 - 0.09), 0.3
    data = {"time": t + 7, "y": 0.3 * np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t))}
    late = rig.fit(data, "c")
    assert any("begin at t = 7 s" in said and "initial values at 0" in said for said in late.remarks)
    asked = rig.fit(data, "c", start=7)
    assert asked["c"] == pytest.approx(0.6, rel=1e-6) and not asked.remarks


PENDULUM = """\
model Pendulum
  parameter l(min = 1 cm, max = 5 m) = 0.8 m;
  parameter g = 9.81 m/s^2;
  coordinate Angle theta = 20 deg;
  kinetic 1/2*l^2*der(theta)^2*1 kg;
  potential 1/2*1 kg*g*l*theta^2;
end Pendulum;
"""
SWING = [(t, 20 * np.cos(3 * t)) for t in np.linspace(0, 2, 41)]
"""Of g/l = 9/s^2."""


def logged(folder: Path) -> Path:
    """A file as a logger writes it: lines of its own, semicolons, decimal commas, a row of units, a code page."""
    path = folder / "log.csv"
    rows = "".join(f"{t:.3f};{a:.6f};{k}\n".replace(".", ",") for k, (t, a) in enumerate(SWING))
    text = f"Messgerät 7\nDatum;28.11.2026\nAbtastrate;20 Hz\n\nZeit;Ausschlag;Nr\ns;°;-\n{rows}"
    path.write_bytes(text.encode("latin-1"))
    return path


def test_a_file_of_a_logger_with_one_option(tmp_path: Path) -> None:
    (tmp_path / "pendulum.mech").write_text(PENDULUM)
    path = logged(tmp_path)
    run = CliRunner().invoke(
        mechc_command,
        ["fit", str(tmp_path / "pendulum.mech"), str(path), "--vary", "l", "--columns", "Ausschlag = theta"],
        catch_exceptions=False,
    )
    found = next(line.split() for line in run.output.splitlines() if line.split()[:1] == ["l"])
    assert run.exit_code == 0 and float(found[1]) == pytest.approx(9.81 / 9, rel=1e-6)
    said = " ".join(run.output.split())
    for words in (
        "columns separated by semicolons, decimal commas, Latin-1, heads in line 5, what stands above left out, units in line 6",
        "columns of log.csv that the model has not: Nr",
    ):
        assert words in said


ANGLES = [(k / 20, 10 + 20 * np.sin(k / 7)) for k in range(31)]
"""To 1.5 s, in degrees."""
LINES = [f"{t:.5f},{a:.5f}" for t, a in ANGLES]
BODY = "\n".join(LINES) + "\n"
HEAD = "time [s],measured [deg]\n"
COMMAS = (HEAD + BODY).replace(",", ";").replace(".", ",")
READ = {
    "plain": HEAD + BODY,
    "marked": ("\ufeff" + HEAD + BODY).encode(),
    "commented": "# Exported from Vicon\n# rate 20 Hz\n" + HEAD + BODY,
    "Windows": (HEAD + BODY).replace("\n", "\r\n"),
    "degree sign": HEAD.replace("deg", "°") + BODY,
    "degree sign of Latin-1": (HEAD.replace("deg", "°") + BODY).encode("latin-1"),
    "repeated row": HEAD + "\n".join([*LINES[:9], *LINES[8:]]) + "\n",
    "milliseconds": "time [ms],measured [deg]\n" + "".join(f"{1000 * t:.2f},{a:.5f}\n" for t, a in ANGLES),
    "other name": "time [s],KneeAngle [deg]\n" + BODY,
    "parentheses": "Time (s),measured (deg)\n" + BODY,
    "quoted": '"time [s]","measured [deg]"\n' + BODY,
    "decimal commas": COMMAS,
    "semicolons": (HEAD + BODY).replace(",", ";"),
    "blanks around": (HEAD + BODY).replace(",", " , "),
    "tabs": (HEAD + BODY).replace(",", "\t"),
    "trailing": (HEAD + BODY).replace("\n", ",\n"),
    "two lines": "time,measured\ns,deg\n" + BODY,
    "UTF-16": (HEAD + BODY).encode("utf-16"),
    "time without unit": "t,measured [deg]\n" + BODY,
    "blank line": HEAD + BODY.replace("0.50000,", "\n0.50000,"),
}


@pytest.mark.parametrize("text", READ.values(), ids=READ.keys())
def test_tables_of_loggers_drive_alike(model: mechc.Model, tmp_path: Path, text: str | bytes) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    run = model.simulate(inputs={"measured": path}, estimate_error=False)
    expected = CubicSpline(*zip(*ANGLES, strict=True), bc_type="natural")(run.time)
    np.testing.assert_allclose(np.degrees(run["q"]), expected, rtol=0, atol=1e-5)


REFUSED = {
    "no heads": (BODY, "line 1 of .* holds numbers alone"),
    "a gap": (HEAD + BODY.replace(LINES[6], LINES[6].partition(",")[0] + ","), "line 8 of .* has no value of 'measured'"),
    "not a number": (HEAD + BODY.replace(LINES[6], "0.3,NaN"), "line 8 of .* has no value of 'measured'"),
    "two values at once": (HEAD + BODY + "1.50000,5.0\n", "the time 1.5 stands twice, with .* and with 0.0872665 .in SI. in line 33"),
    "unsorted": (HEAD + "\n".join([*LINES[:7], LINES[8], LINES[7], *LINES[9:]]), "in line 10 of .* the time 0.35 follows 0.4"),
    "late": (HEAD + "".join(f"{t + 12.5},{a}\n" for t, a in ANGLES), "reaches from 12.5 s to 14 s, the run from 0 s to 1 s"),
    "another unit": (HEAD.replace("deg", "mm") + BODY, "the column 'measured' is in mm, the model has it in rad"),
    "nothing": (HEAD, "has no rows below its first line"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "words"), REFUSED.values(), ids=REFUSED.keys())
def test_tables_of_loggers_that_are_refused(
    model: mechc.Model, tmp_path: Path, text: str, words: str
) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(SimulationError, match=words):
        model.simulate(inputs={"measured": path})


def test_rows_without_a_value_are_counted(tmp_path: Path) -> None:
    """A fit compares the others."""
    gaps = {**dict(SWING), 0.0: np.nan, SWING[7][0]: np.nan}
    path = table(tmp_path, "time [s],theta [deg]", [(float(t), float(a)) for t, a in gaps.items()])
    found = mechc.loads(PENDULUM).fit(path, "l")
    assert found["l"] == pytest.approx(9.81 / 9, rel=1e-6)
    assert "2 of 41 rows of table.csv hold no value of 'theta'" in found.remarks


def test_files_that_need_a_word(tmp_path: Path) -> None:
    model = mechc.loads(PENDULUM)
    rows = "".join(f"{1000 * t:.1f}|{np.radians(a):.9f}\n" for t, a in SWING)
    (tmp_path / "bare.csv").write_text(rows)
    file = mechc.table_file(tmp_path / "bare.csv", columns="1 [ms] = time, 2 [rad] = theta", separator="|")
    assert model.fit(file, "l")["l"] == pytest.approx(9.81 / 9, rel=1e-6)
    (tmp_path / "near.csv").write_text("time,theeta\n0,0.3\n1,0.2\n")
    with pytest.raises(mechc.UsageMistake, match=r"'theeta'.*--columns \"theeta = theta\""):
        model.fit(tmp_path / "near.csv", "l")
    (tmp_path / "none.csv").write_text("time,a,b\n0,0.3,1\n1,0.2,1\n")
    with pytest.raises(mechc.UsageMistake, match=r"none of the columns of none.csv .* 'a', 'b'"):
        model.fit(tmp_path / "none.csv", "l")
    for wrong, message in (
        ({"columns": "Zeit"}, "columns are named as in"),
        ({"columns": "a = x, b = x"}, "two columns are called 'x'"),
        ({"columns": "a = x [m]"}, "stands beside the head of the file"),
        ({"separator": "x"}, "separated by"),
        ({"decimal": "'"}, "before decimals"),
        ({"skip": -1}, "number of lines"),
    ):
        with pytest.raises(mechc.UsageMistake, match=message):
            mechc.table_file("x.csv", **wrong)


def test_options_of_reading_without_a_table(tmp_path: Path) -> None:
    (tmp_path / "pendulum.mech").write_text(PENDULUM)
    run = CliRunner().invoke(mechc_command, ["run", str(tmp_path / "pendulum.mech"), "--skip", "3"])
    assert run.exit_code == 2 and "--skip: there is no table to read" in run.output


PUSHED = """\
model Pushed
  input Force push = 0 N;
  input Real many[2] = {0, 0};
  coordinate Length x;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*4 N/m*x^2;
  force push + 1 N*(many[1] + many[2]) on x;
  experiment(stop = 3 s, tolerance = 1e-10);
end Pushed;
"""
T = np.linspace(0, 3, 31)


def by_scipy(force: Callable[[float], float], breaks: tuple[float, ...] = ()) -> float:
    """x at 3 s of x'' + 4 x = force, in pieces between its breaks."""
    y = [0.0, 0.0]
    for a, b in itertools.pairwise((0.0, *breaks, 3.0)):
        middle = np.nextafter(b, a)
        rates = lambda t, y, a=a, m=middle: [y[1], force(min(max(t, a), m)) - 4 * y[0]]  # noqa: E731
        y = solve_ivp(rates, (a, b), y, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1].tolist()
    return float(y[0])


def test_inputs_as_arrays_and_frames() -> None:
    model = mechc.loads(PUSHED)
    expected = by_scipy(lambda t: float(np.interp(t, T, np.sin(T))), tuple(T[1:-1]))
    table = np.column_stack([T, np.sin(T)])
    for given in (
        (T, np.sin(T)),
        [list(T), list(np.sin(T))],
        table,
        {"time [ms]": 1000 * T, "push [kN]": np.sin(T) / 1000},
        {"time": T, "other": 0 * T, "push": np.sin(T)},
    ):
        run = model.simulate(inputs={"push": given}, estimate_error=False)
        assert run["x"][-1] == pytest.approx(expected, rel=1e-9)
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"t": T, "push [N]": np.sin(T)})
    for given in (frame, frame.set_index("t")["push [N]"]):
        run = model.simulate(inputs={"push": given}, estimate_error=False)
        assert run["x"][-1] == pytest.approx(expected, rel=1e-9)


def test_inputs_as_functions() -> None:
    """A smooth one, one with a jump and one with a kink: steps end there; against SciPy in pieces."""
    model = mechc.loads(PUSHED)
    root = 2**0.5
    for force, breaks in (
        (lambda t: np.sin(5 * t) * np.exp(-t), ()),
        (lambda t: 1.0 if t < root else -0.5, (root,)),
        (lambda t: abs(t - root), (root,)),
    ):
        run = model.simulate(inputs={"push": force})
        assert run["x"][-1] == pytest.approx(by_scipy(force, breaks), rel=1e-8)
        assert run["push"] == pytest.approx([force(t) for t in run.time], abs=1e-10)
    both = model.simulate(inputs={"many[1]": np.sin, "many[2]": lambda t: -np.sin(t)}, estimate_error=False)
    assert abs(both["x"]).max() < 1e-9


def test_inputs_that_are_refused(rig: mechc.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inputs, "MOST_PIECES", 10_000)
    model = mechc.loads(PUSHED)
    for given, words in (
        ({"push": 3}, "comes from a table or a function of the time, not from 3"),
        ({"push": np.zeros((2, 3))}, "has two columns, time and value, not the shape"),
        ({"push": (T, T[1:])}, "one number for each row"),
        ({"push": {"a": T, "push": T}}, "has no column 'time'"),
        ({"many": np.sin}, "has 2 elements: give a function for each, as in 'many\\[1\\]'"),
        ({"push": lambda t: float("nan")}, "the function of 'push' gives nan at 0"),
        ({"push": lambda t: hash(t) % 97}, "changes too often to be followed"),
        ({"push": lambda t: np.array([t, t])}, "gives array.* at 0, and an input is one number"),
        ({"push": (T, 1j * T)}, "'push' holds complex numbers"),
        ({"push": (T.astype("datetime64[s]"), T)}, "'time' holds dates, and a table has numbers"),
        ({"push": {"time [s]": T, "push [m]": T}}, "the data: the column 'push' is in m"),
        ([T, T], "'inputs' are tables or functions by the names of inputs, not a list"),
        ("push", "'inputs' are tables or functions by the names of inputs"),
    ):
        with pytest.raises((mechc.UsageMistake, SimulationError), match=words):
            model.simulate(inputs=given)  # type: ignore[arg-type]
    with pytest.raises(SimulationError, match="drives a coordinate, and its two derivatives are not known"):
        rig.simulate(inputs={"stroke": np.sin})
    with pytest.raises(mechc.UsageMistake, match="an ensemble cannot keep"):
        rig.ensemble(vary="c = 0.5 N.s/m .. 0.6 N.s/m, 2", inputs={"push": np.sin}, keep="final(y)")


def test_a_table_of_one_row_is_told(rig: mechc.Model, tmp_path: Path) -> None:
    """Its value was held for the whole run without a word."""
    path = table(tmp_path, "time [s],push [N]", [(0.0, 3.0)])
    run = rig.simulate(inputs={"push": path}, stop=1, estimate_error=False)
    assert any("the table of 'push' has one row" in said for said in run.remarks)


@pytest.mark.parametrize(("head", "said"), [("pull [N]", True), ("push [N]", False)])
def test_the_only_column_is_taken_whatever_its_head_and_a_note_says_so(
    tmp_path: Path, head: str, said: bool
) -> None:
    (tmp_path / "log.csv").write_text(f"time [s],{head}\n0,1\n1,2\n")
    model = mechc.loads(
        "input Force push = 0 N; coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; force push on x;"
    )
    found = model.simulate(stop=1, inputs={"push": tmp_path / "log.csv"})
    assert found["x"][-1] == pytest.approx(1 / 2 + 1 / 6)
    expected = (
        f"'push' is read from the column 'pull' of {tmp_path / 'log.csv'}, the only one beside the time"
    )
    assert (expected in found.remarks) == said
