"""Dry friction on coordinates without mass: Jenkins' elements, rubbing dampers and play, against SciPy phase by phase and closed forms."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from c_programs import build
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from wasm_module import WasmRun, needs_wasmtime

import mechc
from mechc import CompileError
from mechc.cli.main import run as cli
from mechc.compiler.targets.wasm.link import linked
from mechc.web.kernels import kernel_for, loaded

Array = NDArray[np.float64]

X = "dimensionless; coordinate x = 0; initial der(x) = 1; kinetic 1/2*der(x)^2; force 1.7*sin(1.3*time) on x;"
END = "output held = multiplier(f); output sticks = closed(f); experiment(stop = 12, tolerance = 1e-11);"
JENKINS = X + "coordinate z = 0; potential 2*(x - z)^2; friction f: 1 on z;" + END
DAMPED = X + "coordinate z = 0; potential 2*(x - z)^2; damping 0.4 on z; friction f: 1 on z;" + END
SIDES = JENKINS.replace("f: 1 on", "f: forward 1 backward 0.4 on")


def run(text: str, **options: object) -> mechc.Solution:
    solution = mechc.loads(text).simulate(estimate_error=False, **options)  # type: ignore[arg-type]
    assert isinstance(solution, mechc.Solution)
    assert solution.failure is None, solution.message
    return solution


def jenkins(forward: float, backward: float, times: Array) -> Array:
    """x, x', z: sticks while -backward <= 4 (x - z) <= forward, else slides so that it stays there; one phase after the other."""
    t, y, mode, parts = 0.0, np.array([0.0, 1.0, 0.0]), 0, []

    def rates(t: float, y: Array, mode: int) -> list[float]:
        pull = {0: 4 * (y[0] - y[2]), 1: forward, -1: -backward}[mode]
        return [y[1], 1.7 * np.sin(1.3 * t) - pull, y[1] if mode else 0.0]

    tight = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14, "dense_output": True}
    while t < times[-1]:
        ends: list[Callable[..., float]]
        if mode:
            ends = [lambda t, y, mode: y[1]]
        else:
            ends = [
                lambda t, y, mode: 4 * (y[0] - y[2]) - forward,
                lambda t, y, mode: 4 * (y[0] - y[2]) + backward,
            ]
        for end, direction in zip(ends, [-mode] if mode else [1, -1], strict=True):
            end.terminal, end.direction = True, direction  # type: ignore[attr-defined]
        found = solve_ivp(rates, (t, times[-1]), y, events=ends, args=(mode,), **tight)
        parts.append((t, found.t[-1], found.sol))
        t, y = found.t[-1], found.y[:, -1]
        mode = 0 if mode else 1 if len(found.t_events[0]) else -1
    rows = [next(sol for a, b, sol in parts if a <= at <= b + 1e-14)(at) for at in times]
    return np.array(rows).T


@pytest.mark.parametrize(
    ("text", "limits", "method"),
    [
        (JENKINS, (1.0, 1.0), "dop853"),
        (SIDES, (1.0, 0.4), "dop853"),
        pytest.param(JENKINS, (1.0, 1.0), "radau5", marks=pytest.mark.slow),
        pytest.param(JENKINS, (1.0, 1.0), "gauss6", marks=pytest.mark.slow),
        pytest.param(JENKINS, (1.0, 1.0), "taylor", marks=pytest.mark.slow),
    ],
)
def test_a_spring_and_a_friction_in_series(text: str, limits: tuple[float, float], method: str) -> None:
    fixed = {"step": 0.005} if method == "gauss6" else {}
    solution = run(text, method=method, **fixed)
    exact = jenkins(*limits, solution.time)
    assert len(solution.events) > 6
    assert np.abs(np.array([solution[q] for q in ("x", "der(x)", "z")]) - exact).max() < 1e-9
    np.testing.assert_allclose(solution["held"], -4 * (exact[0] - exact[2]), atol=1e-8)
    balance = solution["energy.total"] + solution["energy.dissipated"] - solution["energy.supplied"]
    assert np.ptp(balance) < 1e-9
    assert solution["energy.dissipated"][-1] > 1


def test_a_friction_beside_a_damping() -> None:
    """0.4 z' = 4 (x - z) less its part within the limit."""
    solution = run(DAMPED)

    def rates(t: float, y: Array) -> list[float]:
        pull = 4 * (y[0] - y[2])
        return [y[1], 1.7 * np.sin(1.3 * t) - pull, (pull - np.clip(pull, -1, 1)) / 0.4]

    found = solve_ivp(
        rates, (0, 12), [0, 1, 0], "DOP853", rtol=1e-12, atol=1e-13, max_step=1e-2, dense_output=True
    )
    exact = found.sol(solution.time)
    assert np.abs(np.array([solution[q] for q in ("x", "der(x)", "z")]) - exact).max() < 1e-8
    pull = 4 * (solution["x"] - solution["z"])
    np.testing.assert_allclose(solution["held"], -np.clip(pull, -1, 1), atol=1e-12)
    apart = np.abs(np.abs(pull) - 1) > 1e-8
    np.testing.assert_array_equal(solution["sticks"][apart] > 0.5, np.abs(pull[apart]) <= 1)
    balance = solution["energy.total"] + solution["energy.dissipated"] - solution["energy.supplied"]
    assert np.ptp(balance) < 1e-8


def play(x: Array, widths: Array) -> Array:
    """The operator of play at the values of x, monotone in between: z = max(x - r, min(x + r, z))."""
    z, rows = np.zeros(len(widths)), []
    for one in x:
        z = np.maximum(one - widths, np.minimum(one + widths, z))
        rows.append(z)
    return np.array(rows).T


def test_elements_side_by_side_remember() -> None:
    """Prandtl's and Ishlinskii's sum of elements at a driven place: each is a play of the width of its limit over its stiffness."""
    stiff, limits = np.array([3.0, 2.0, 1.0]), np.array([0.6, 0.9, 1.1])
    text = "dimensionless; coordinate x; drive x = sin(time)*(1.2 + cos(0.37*time)); coordinate z[3] = 0;"
    for k in range(3):
        text += f"potential 1/2*{stiff[k]}*(x - z[{k + 1}])^2; friction f{k}: {limits[k]} on z[{k + 1}];"
    solution = run(text + "experiment(stop = 30, every = 1 ms, tolerance = 1e-10);".replace("1 ms", "0.001"))
    exact = play(solution["x"], limits / stiff)  # rows are 1e-3 apart: turns between them are missed by 1e-6
    for k in range(3):
        assert np.abs(solution[f"z[{k + 1}]"] - exact[k]).max() < 1e-6


def test_between_a_mass_and_a_node() -> None:
    """Friction between x and a node on a spring: the node goes along up to 1/4, and stays there."""
    solution = run(
        "dimensionless; coordinate x = 0; initial der(x) = 1; kinetic 1/2*der(x)^2; coordinate z = 0; potential 2*z^2;"
        "friction f: 1 on x - z; output held = multiplier(f); experiment(stop = 1, tolerance = 1e-11);"
    )
    begins = np.arcsin(0.5) / 2  # x = sin(2 t)/2 while it sticks
    t = solution.time
    slides = 0.25 + np.cos(2 * begins) * (t - begins) - (t - begins) ** 2 / 2
    exact = np.where(t < begins, np.sin(2 * t) / 2, slides)
    assert np.abs(solution["x"] - exact)[t < begins + 0.8].max() < 1e-9
    assert np.abs(solution["z"] - np.minimum(exact, 0.25))[t < begins + 0.8].max() < 1e-9


def test_an_impact_while_it_slides() -> None:
    """The velocity of the mass turns round at a wall, and with it the slip: the node sticks at once, and slides back later."""
    solution = run(
        "dimensionless; coordinate x = 0; initial der(x) = 2; kinetic 1/2*der(x)^2; coordinate z = 0; potential 2*(x - z)^2;"
        "friction f: 1 on z; contact wall: 0.6 - x restitution 0.8; experiment(stop = 0.9, tolerance = 1e-11);"
    )
    hit = next(e.time for e in solution.events if e.kind == "impact")
    slides = np.arcsin(0.25) / 2  # x = sin(2 t)
    v = 2 * np.cos(2 * slides)
    gone = v - np.sqrt(v**2 - 2 * 0.35)  # v s - s^2/2 = 0.35 after that
    assert hit == pytest.approx(slides + gone, abs=1e-10)
    back = 0.8 * (v - gone)
    t = solution.time
    # sticks at z = 0.35: x - z = 0.25 cos(2 s) - back/2 sin(2 s), down to -0.25
    s = t - hit
    exact = 0.35 + 0.25 * np.cos(2 * s) - back / 2 * np.sin(2 * s)
    stuck = (t > hit) & (exact > 0.1)
    assert np.abs(solution["x"] - exact)[stuck].max() < 1e-9 and stuck.sum() > 10
    assert np.abs(solution["z"][stuck] - 0.35).max() < 1e-9
    assert solution["z"][-1] < 0.34


def test_members_and_settings() -> None:
    """The limit is a parameter: members of an ensemble are runs."""
    model = mechc.loads(JENKINS.replace("f: 1 on", "f: F on") + "parameter F = 1;")
    many = model.ensemble(vary={"F": [0.5, 1.0, 2.0]}, keep="final(z)")
    for k, F in enumerate((0.5, 1.0, 2.0)):
        exact = jenkins(F, F, np.array([0.0, 12.0]))[2, -1]
        assert float(many["final(z)"][k]) == pytest.approx(exact, abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("text", [JENKINS, DAMPED])
def test_fmus_have_the_same_motion(text: str, tmp_path: Path) -> None:
    """An FMU is compared with the run before it is written."""
    (tmp_path / "model.mech").write_text(text, encoding="utf-8")
    assert (
        cli(["compile", str(tmp_path / "model.mech"), "--target", "fmu", "-o", str(tmp_path / "m.fmu")]) == 0
    )


@pytest.mark.slow
@pytest.mark.parametrize("text", [JENKINS, DAMPED])
def test_c_programs_have_the_same_motion(text: str, tmp_path: Path) -> None:
    model = mechc.loads(text)
    model.compile("c", tmp_path)
    done = subprocess.run([build(tmp_path, tmp_path)], capture_output=True, text=True, check=True)
    head, *_, last = done.stdout.splitlines()
    row = dict(zip((h.split(" ")[0] for h in head.split(",")), map(float, last.split(",")), strict=True))
    solution = run(text)
    assert row["z"] == pytest.approx(solution["z"][-1], abs=1e-9)
    assert row["x"] == pytest.approx(solution["x"][-1], abs=1e-9)


@needs_wasmtime
@pytest.mark.slow
@pytest.mark.parametrize("text", [JENKINS, DAMPED])
def test_pages_have_the_same_motion(text: str) -> None:
    program = mechc.loads(text).compilation.program
    kernel = kernel_for("dop853", events=True)
    machine = WasmRun(linked(program, loaded(kernel), "").module, rows=25)
    status, rows = machine.run(12.0, kernel.methods.index("dop853"), 1e-11)
    assert status == 1
    between = run(text)(np.linspace(0, 12, 25))
    assert np.abs(rows[:, 0] - between["x"]).max() < 1e-8


REFUSED = {
    "a static limit": ("friction f: 1 static 2 on z;", "its sticking limit exceeds its sliding limit"),
    "a limit by its own rate": ("friction f: 1 + abs(der(z)) on z;", "depends on that motion or on a force"),
    "two on one": ("friction f: 1 on z; friction g: 1 on z;", "acts on the same coordinate"),
    "two nodes in a row": (
        "coordinate w = 0; potential (z - w)^2; friction f: 1 on z; friction g: 1 on w;",
        "several coordinates without mass that no damping resists",
    ),
    "two that depend on each other": (
        "coordinate w = 0; damping 1 on z; damping 1 on z - w; friction f: 1 on z; friction g: 1 on w;",
        "depend on each other",
    ),
    "a damper that is not linear": (
        "dissipation 1/4*der(z)^4 + 1/2*der(z)^2; friction f: 1 on z;",
        "no rate depends on it in proportion",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_has_no_unique_answer_is_refused(name: str) -> None:
    text, words = REFUSED[name]
    with pytest.raises(CompileError) as refused:
        mechc.loads(X + "coordinate z = 0; potential 2*(x - z)^2;" + text + "experiment(stop = 1);")
    assert "E0541" in str(refused.value) and words in str(refused.value)


def test_nothing_answers_it() -> None:
    with pytest.raises(CompileError, match="neither a spring nor a damping"):
        mechc.loads(X + "coordinate z = 0; friction f: 1 on z; experiment(stop = 1);")


def test_a_force_that_jumps_beyond_it_is_told() -> None:
    text = (
        X
        + "coordinate z = 0; potential 2*(x - z)^2; friction f: 1 on z; force (if time > 0.5 then 3 else 0) on z;"
    )
    solution = mechc.loads(text + "experiment(stop = 1);").simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert 0.5 <= solution.time[-1] < 0.7  # asserted at each step
    assert "without mass and damping it would jump" in solution.message


def test_sensitivity_through_the_beginning_of_a_slip() -> None:
    """x' = cos(2 b) - F (t - b) from b = asin(F/2)/2 on: dx'/dF = -(t - b), as the rest cancels."""
    text = (
        "dimensionless; parameter F = 1; coordinate x = 0; initial der(x) = 1; kinetic 1/2*der(x)^2;"
        "coordinate z = 0; potential 2*(x - z)^2; friction f: F on z; experiment(stop = 1, tolerance = 1e-11);"
    )
    solution = run(text, sensitivity="F")
    slope = solution.sensitivity("der(x)", "F").values[-1]
    assert slope == pytest.approx(-(1 - np.arcsin(0.5) / 2), abs=1e-9)


PLATES = """
import mech.rotational.*;
model Train "a rotor, a damper, a clutch between two nodes, a damper, a load"
  Rotor motor(J = 1 kg.m^2, der(angle) = 20 rad/s);
  Rotor load(J = 3 kg.m^2);
  Node n[2];
  SpringDamper s1(motor.angle -> n[1].angle, c = 2 N.m.s);
  Clutch clutch(n[1].angle -> n[2].angle, press = 50 N, radius = 0.3 m, mu = 0.4);
  SpringDamper s2(n[2].angle -> load.angle, c = 3 N.m.s);
  experiment(stop = 4 s);
end Train;
"""


def test_a_static_limit_that_is_another_formula_of_the_same_limit() -> None:
    """Plates of 6 N.m in a row with dampers of 2 and 3 N.m.s, 1.2 together: they slide until 20 - 8 t = 6/1.2, then d' = -1.6 d."""
    model = mechc.loads(PLATES)
    torque = model.simulate()["clutch.torque"][-1]
    begins = (20 - 6 / 1.2) / 8
    assert torque == pytest.approx(6 * np.exp(-1.6 * (4 - begins)), rel=1e-7)
    with pytest.raises(CompileError, match="E0541"):
        mechc.loads(PLATES.replace("mu = 0.4", "mu = 0.4, peak = 1.3"))
    told = model.simulate(set={"clutch.peak": 1.3})
    assert (
        told.outcome.value == "failed" and "its sticking limit differs from its sliding limit" in told.message
    )


def test_what_stands_at_its_edge_is_named_by_its_friction() -> None:
    """A spring with a friction at its end, at rest: whether it slips is asked by no statement of the model."""
    model = mechc.loads(
        "coordinate Length x = 0 m; coordinate Length z = 0 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*10 N/m*(x - z)^2;"
        "potential 1/2*5 N/m*x^2; friction pad: 1 N on z;"
    )
    said = [remark for remark in model.linearize().remarks if "edge" in remark]
    assert said == ["'slip of friction pad' stands at its edge: the event that it is for is not looked at"]


def test_friction_whose_limit_follows_a_force_is_named_where_nothing_has_mass() -> None:
    text = """
    import mech.rotational.*;
    Rotor m(J = 0.01 kg.m^2); Node a; Node b;
    SpringDamper s1(m.angle -> a.angle, k = 100 N.m/rad, c = 0.1 N.m.s);
    SpringDamper s2(from = b.angle, k = 100 N.m/rad, c = 0.1 N.m.s);
    LossyGear g(a.angle -> b.angle, ratio = 20, efficiency = 0.6);
    experiment(stop = 1 s);
    """
    with pytest.raises(CompileError, match=r"the limit of the friction 'g\.teeth' follows a force"):
        mechc.loads(text).compiled()
