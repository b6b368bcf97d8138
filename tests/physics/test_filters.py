"""Inputs after a filter: two states follow each, in every target; against closed forms, and against the states written out."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.fmu.run import run_fmu
from mechc.lang.diagnostics import CompileError

TAU = 0.02
STEPPED = """
model Stepped
  input Length road(filter = 20 ms, interpolation = "step") = 0 m;
  coordinate Length axle;
  coordinate Length body = 0 m;
  kinetic 1/2*3 kg*der(axle)^2 + 1/2*2 kg*der(body)^2;
  potential 1/2*200 N/m*(body - axle)^2;
  drive axle = road;
  output Force F = reaction(axle);
  output rate = der(road);
  output twice = 2*road;
  experiment(stop = 1 s, tolerance = 1e-11);
end Stepped;
"""
WRITTEN = """
model Written
  input Length road(interpolation = "step") = 0 m;
  state Length s = road;
  state Velocity r = 0 m/s;
  equation der(s) = r;
  equation der(r) = (road - s)/(20 ms)^2 - 2*r/(20 ms);
  coordinate Length axle;
  coordinate Length body = 0 m;
  kinetic 1/2*3 kg*der(axle)^2 + 1/2*2 kg*der(body)^2;
  potential 1/2*200 N/m*(body - axle)^2;
  drive axle = s;
  output Force F = reaction(axle);
  experiment(stop = 1 s, tolerance = 1e-11);
end Written;
"""
TABLE = (np.array([0.0, 0.1]), np.array([0.0, 0.01]))


@pytest.fixture(scope="module")
def model() -> mechc.Model:
    return mechc.loads(STEPPED)


def test_a_step_is_followed_as_two_lags_follow_it(model: mechc.Model) -> None:
    """s = 1 - (1 + x) e^-x of the step, with x = t/tau; the force that this takes of the mass 3 kg beside the spring."""
    run = model.simulate(inputs={"road": TABLE})
    x = np.clip((run.time - 0.1) / TAU, 0, None)
    height, rate = 0.01 * (1 - (1 + x) * np.exp(-x)), 0.01 * x * np.exp(-x) / TAU
    np.testing.assert_allclose(run["axle"], height, rtol=0, atol=1e-11)
    np.testing.assert_allclose(run["twice"], 2 * height, rtol=0, atol=1e-11)
    np.testing.assert_allclose(run["rate"], rate, rtol=0, atol=1e-9)
    acceleration = 0.01 * (1 - x) * np.exp(-x) / TAU**2
    moved = run.time > 0.1 + 1e-9
    force = 3 * acceleration - 200 * (run["body"] - run["axle"])
    np.testing.assert_allclose(run["F"][moved], force[moved], rtol=0, atol=1e-7)


@pytest.mark.parametrize("method", ["dop853", "radau5"])
def test_it_is_the_model_written_out(model: mechc.Model, method: str) -> None:
    written = mechc.loads(WRITTEN)
    a, b = (m.simulate(inputs={"road": TABLE}, method=method) for m in (model, written))
    assert a["body"].tolist() == b["body"].tolist() and a["F"].tolist() == b["F"].tolist()


def test_it_begins_at_rest_where_the_input_is(model: mechc.Model) -> None:
    run = model.simulate(inputs={"road": ([0.0], [0.03])}, set={"body": 0.03})
    assert np.ptp(run["axle"]) == 0 and run["axle"][0] == 0.03 and abs(run["body"] - 0.03).max() == 0


def test_arrays_and_components() -> None:
    """Of a pair of inputs in a component, one of which an experiment sets."""
    text = """
        model Pair
          dimensionless;
          input u[2](filter = 0.1);
          output v[2] = u;
        end Pair;
        model Whole
          dimensionless;
          Pair p;
          state x = 0; equation der(x) = p.v[1] - p.u[2];
          experiment(stop = 1, p.u[2] = 2, tolerance = 1e-11);
        end Whole;
    """
    run = mechc.loads(text, model="Whole").simulate(inputs={"p.u[1]": ([0.0, 0.2, 0.2], [0.0, 0.0, 1.0])})
    t = np.clip(run.time - 0.2, 0, None)
    wanted = 1 - (1 + t / 0.1) * np.exp(-t / 0.1)
    np.testing.assert_allclose(run["p.v[1]"], wanted, rtol=0, atol=1e-10)
    assert (run["p.u.filtered[2]"] == 2).all()
    x = t - 0.1 * (2 - (2 + t / 0.1) * np.exp(-t / 0.1)) - 2 * run.time
    np.testing.assert_allclose(run["x"], x, rtol=0, atol=1e-10)


def test_its_response_has_two_poles() -> None:
    text = """
        input u(filter = 0.5 s) = 0;
        state y = 0; equation der(y) = (u - y)/(1 s);
        output o = u;
        experiment(stop = 1 s);
    """
    found = mechc.loads(text).linearize()
    poles = np.sort(np.linalg.eigvals(np.asarray(found.A)).real)
    np.testing.assert_allclose(poles, [-2, -2, -1], rtol=0, atol=1e-6)
    s = 3j
    matrix = s * np.eye(3) - np.asarray(found.A)
    row = np.asarray(found.C)[[q.name for q in found.outputs].index("o")]
    gain = row @ np.linalg.solve(matrix, np.asarray(found.B)[:, 0])
    np.testing.assert_allclose(gain, 1 / (1 + 0.5 * s) ** 2, rtol=1e-12)


@pytest.mark.slow
def test_units_drive_through_filters(tmp_path: Path, model: mechc.Model) -> None:
    """Along a staircase; CVode of fmpy is good to 1e-5 of the values, and begins again at each jump."""
    h = 0.005
    clock = np.arange(1, 10) * 0.1
    levels = 0.01 * np.sin(5 * clock)
    native = model.simulate(inputs={"road": ([0.0, *clock], [0.0, *levels])}, every=h)
    table = tmp_path / "road.csv"
    rows = [(0.0, 0.0)]
    for t, z in zip(clock.tolist(), levels.tolist(), strict=True):
        rows += [(t, rows[-1][1]), (t, z)]
    table.write_text("time [s],road [m]\n" + "".join(f"{t!r},{z!r}\n" for t, z in rows))
    smooth = np.min(np.abs(native.time[:, None] - clock), axis=1) > 1e-9  # there the force jumps
    text = STEPPED.replace(", tolerance = 1e-11", "")
    for path, kind in product(
        export_fmu(mechc.loads(text), tmp_path / "m.fmu", FmuOptions("both")), ("me", "cs")
    ):
        found = run_fmu(path, kind=kind, every=h, inputs={"road": str(table)})
        for name, size in (("axle", 0.01), ("body", 0.01), ("F", 10.0)):
            bound = (1e-5 if kind == "me" else 1e-7) * size
            last = np.searchsorted(found.time, native.time + 1e-9, side="right") - 1  # after what jumps
            assert np.abs(found[name][last] - native[name])[smooth].max() < bound, (path, kind, name)


def test_modules_and_programs_have_the_states(tmp_path: Path, model: mechc.Model) -> None:
    namespace: dict[str, Any] = {"__name__": "generated"}
    (path,) = model.compile("python", tmp_path / "made.py")
    exec(path.read_text(encoding="utf-8"), namespace)
    assert "road.filtered" in path.read_text(encoding="utf-8")
    assert model.compile("c", tmp_path / "made_c")


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ("parameter Length u(filter = 1 ms) = 1 m;", "E0415", "no attribute 'filter'"),
        ("state Length u(filter = 1 ms) = 1 m; equation der(u) = 0 m/s;", "E0415", "no attribute 'filter'"),
        ("input Length u(filter = 0 s);", "E0333", "is positive"),
        ("input Length u(filter = -1 ms);", "E0333", "is positive"),
        ("input Length u(filter = 1 mm);", "E0333", "'filter' is a time"),
        ("input Length u(filter = 1);", "E0333", "'filter' is a time"),
        ("parameter Time tau = 1 ms; input Length u(filter = tau);", "E0333", "known when compiling"),
        ('input Length u(filter = "fast");', "E0333", "'filter' is a time"),
        ("input Boolean u(filter = 1 ms);", "E0333", "follows numbers"),
        ("input Integer u(filter = 1 ms);", "E0333", "follows numbers"),
        ("input Length u(filtre = 1 ms);", "E0415", "did you mean 'filter'"),
        ("input Length u(filter ~ 1 ms);", "E0415", "filter"),
    ],
)
def test_wrong_filters(text: str, code: str, said: str) -> None:
    with pytest.raises(CompileError) as error:
        mechc.loads(f"{text} coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2; experiment(stop = 1 s);")
    assert code in str(error.value) and said in str(error.value), error.value


def test_what_is_given_in_the_model_has_no_filter() -> None:
    text = """
        model Part
          input Length u(filter = 1 ms);
          output Length v = u;
        end Part;
        model Whole
          Part p(u = 1 m*sin(time/1 s));
          experiment(stop = 1 s);
        end Whole;
    """
    with pytest.raises(CompileError, match=r"'p\.u' has a filter, and it is given in the model"):
        mechc.loads(text, model="Whole")
