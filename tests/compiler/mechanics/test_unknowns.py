"""Outputs that equations determine: against mpmath, closed forms and the implicit function theorem, on all targets."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import mpmath
import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from slow_params import slow_but

import mechc
from mechc.cli.main import run
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.printing.printer import format_file
from mechc.lang.source import SourceFile

BODY = "coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2; "
KEPLER = """
parameter e = 0.6;
parameter n = 2 rad/s;
let Angle M = n*time;
output Angle E ~ M + e*sin(M);
equation E - e*sin(E) = M;
output rate = der(E);
"""


def final(text: str) -> dict[str, float]:
    solution = mechc.loads(text).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution.outcome.value == "completed", solution.message
    return {name: float(solution[name][-1]) for name in solution.quantities}


@pytest.mark.parametrize("seed", slow_but([3, 5], range(6)))
def test_random_systems_have_the_solutions_of_mpmath(seed: int) -> None:
    """Two to four equations with sines, exponentials and products, built to have a solution near 1."""
    random = Random(seed)
    count = 2 + seed % 3
    names = [f"x{k}" for k in range(count)]
    solution = [random.uniform(0.7, 1.4) for _ in names]
    rows = []
    for i in range(count):
        a, b = random.choice(names), random.choice(names)
        left = f"{random.randint(2, 5)}*{names[i]} + sin({a}) + {random.choice(('exp(-' + b + ')', a + '*' + b + '/3', 'sqrt(1 + ' + b + '^2)'))}"
        value = eval(left.replace("^", "**"), {**vars(mpmath.mp), }, {**dict(zip(names, solution, strict=True)), "sin": mpmath.sin, "exp": mpmath.exp, "sqrt": mpmath.sqrt})  # fmt: skip
        rows.append((left, float(value)))
    text = "dimensionless; " + "".join(f"output {n} ~ 1; " for n in names)
    text += "".join(f"equation {left} = {value!r}; " for left, value in rows) + "experiment(stop = 0);"

    def residual(*x: object) -> list[object]:
        known = {
            **dict(zip(names, x, strict=True)),
            "sin": mpmath.sin,
            "exp": mpmath.exp,
            "sqrt": mpmath.sqrt,
        }
        return [eval(left.replace("^", "**"), {}, known) - value for left, value in rows]

    expected = mpmath.findroot(residual, [1] * count)
    found = final(text)
    assert [found[n] for n in names] == pytest.approx([float(v) for v in expected], rel=1e-14)


@pytest.fixture(scope="module")
def kepler() -> mechc.Model:
    return mechc.loads(BODY + KEPLER + "experiment(stop = 6 s);")


@pytest.mark.slow
def test_equation_of_kepler_along_time(kepler: mechc.Model) -> None:
    """E - e sin E = M by bisection, and der(E) = n/(1 - e cos E) by the implicit function theorem."""
    for e in (0.0, 0.6, 0.97):
        solution = kepler.simulate(set={"e": e}, estimate_error=False)
        assert isinstance(solution, mechc.Solution)
        E = [brentq(lambda x, M=2 * t, e=e: x - e * np.sin(x) - M, -1, 15, xtol=1e-15) for t in solution.time]
        assert solution["E"] == pytest.approx(E, rel=1e-13, abs=1e-14)
        assert solution["rate"] == pytest.approx(2 / (1 - e * np.cos(E)), rel=1e-12)


@pytest.mark.slow
def test_sensitivities_are_those_of_the_implicit_function(kepler: mechc.Model) -> None:
    """dE/de = sin E/(1 - e cos E)."""
    solution = kepler.simulate(sensitivity="e", estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    E = solution["E"]
    found = solution.sensitivity("E", "e").values
    assert np.ravel(found) == pytest.approx(np.sin(E) / (1 - 0.6 * np.cos(E)), rel=1e-11, abs=1e-12)


def test_python_module_gives_the_same_numbers(kepler: mechc.Model, tmp_path: Path) -> None:
    native = kepler.simulate(estimate_error=False)
    assert isinstance(native, mechc.Solution)
    kepler.compile("python", tmp_path / "kepler.py")
    told = subprocess.run(
        [sys.executable, "-c", "import kepler; print(repr(float(kepler.simulate()['E'][-1])))"],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
    ).stdout
    assert float(told) == pytest.approx(float(native["E"][-1]), rel=1e-14)


@pytest.mark.slow
def test_fmu_and_program_give_the_same_numbers(kepler: mechc.Model, tmp_path: Path) -> None:
    """An FMU is compared with the native run before it is written."""
    (tmp_path / "kepler.mech").write_text(BODY + KEPLER + "experiment(stop = 6 s);", encoding="utf-8")
    assert (
        run(["compile", str(tmp_path / "kepler.mech"), "--target", "fmu", "-o", str(tmp_path / "kepler.fmu")])
        == 0
    )
    kepler.compile("c", tmp_path / "program")
    subprocess.run(["cc", "-O1", "-o", "kepler", *(p.name for p in (tmp_path / "program").glob("*.c")), "-lm"], cwd=tmp_path / "program", check=True)  # fmt: skip
    printed = subprocess.run(
        ["./kepler"], cwd=tmp_path / "program", capture_output=True, text=True, check=True
    )
    header, *_, last = printed.stdout.strip().splitlines()
    row = dict(zip((h.split(" ")[0] for h in header.split(",")), map(float, last.split(",")), strict=True))
    e = 0.6
    assert row["E"] - e * np.sin(row["E"]) == pytest.approx(2 * row["time"], rel=1e-14)


@pytest.mark.slow
def test_units_and_components() -> None:
    """A ladder of forces: each component finds its own numbers, in its own units."""
    found = final(
        """
        model Bow "cable of a span and a length: h and the tension at its lowest point"
          parameter Length span = 10 m;
          parameter Length long = 12 m;
          parameter w = 20 N/m;
          output Length a ~ span/2 "w a is the tension";
          equation 2*a*sinh(span/(2*a)) = long;
          output Force H ~ w*span;
          equation H/w = a;
        end Bow;
        model M
          Bow b[2](long = {12 m, 15 m});
          output Force sum = b[1].H + b[2].H;
          experiment(stop = 0);
        end M;
        """
    )
    for k, long in ((1, 12), (2, 15)):
        a = brentq(lambda a, s=long: 2 * a * np.sinh(5 / a) - s, 1, 50, xtol=1e-14)
        assert found[f"b[{k}].a"] == pytest.approx(a, rel=1e-14)
        assert found[f"b[{k}].H"] == pytest.approx(20 * a, rel=1e-14)
    assert found["sum"] == pytest.approx(found["b[1].H"] + found["b[2].H"], rel=1e-15)


def test_linear_systems_are_solved_at_once() -> None:
    """A zero where a pivot would stand, and sizes from 1e-9 to 1e9."""
    found = final(
        "dimensionless; parameter k = 1e9; output x[3] ~ 0; "
        "equation {{0, k, 1}, {1, 0, 1/k}, {1, 1, 1}}*x = {k + 3, 2, 6}; experiment(stop = 0);"
    )
    with mpmath.workdps(40):
        k = mpmath.mpf(10) ** 9
        exact = mpmath.lu_solve(mpmath.matrix([[0, k, 1], [1, 0, 1 / k], [1, 1, 1]]), [k + 3, 2, 6])
    assert [found[f"x[{i}]"] for i in (1, 2, 3)] == pytest.approx([float(v) for v in exact], rel=1e-14)


def test_forces_may_enter() -> None:
    """The reaction of a joint, found as a formula and by an equation."""
    solution = mechc.loads(
        """
        import mech.planar.*;
        gravity {0, -9.81} m/s^2;
        Bar bar(m = 2 kg, l = 1 m);
        Revolute pin(world -> bar.a, angle = 30 deg);
        output Force size ~ 20 N;
        equation size^2 = dot(reaction(pin), reaction(pin));
        output R = norm(reaction(pin));
        experiment(stop = 1 s);
        """
    ).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution["size"] == pytest.approx(solution["R"], rel=1e-13)


FAILS = {
    "a double root, which steps halve the way to": "output y ~ 1000; equation y^2 - 2*y + 1 = 0;",
    "no root": "output y ~ 1; equation y^2 = -k;",
    "a singular matrix": "output y[2] ~ 1; equation {{1, k}, {2, 2*k}}*y = {1, 3};",
    "equations that disagree": "output y ~ 1; equation k*y = 1; equation k*y = 2;",
}


@pytest.mark.parametrize("name", FAILS)
def test_what_has_no_single_solution_ends_the_run(name: str) -> None:
    solution = mechc.loads(f"dimensionless; parameter k = 1; {FAILS[name]} experiment(stop = 0);").simulate()
    assert isinstance(solution, mechc.Solution)
    assert solution.outcome.value == "failed"
    assert "no solution for 'y' is found from the guess" in str(solution.message)


def test_what_hangs_together_weakly_is_found_from_afar() -> None:
    """The only solution, which a - 0.24 sin b = c, b + 0.1 sin a = r gives by putting one into the other."""
    solution = mechc.loads(
        "dimensionless; coordinate x = 0; initial der(x) = 1; kinetic 1/2*der(x)^2;"
        "output a ~ 20; output b ~ -1; equation a - 0.24*sin(b) = 20 + x; equation b + 0.1*sin(a) = 3000*x;"
        "experiment(stop = 1, every = 0.02);"
    ).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution) and solution.outcome.value == "completed"
    a, b = 20 + solution["x"], 3000 * solution["x"]
    for _ in range(40):
        a, b = 20 + solution["x"] + 0.24 * np.sin(b), 3000 * solution["x"] - 0.1 * np.sin(a)
    assert solution["a"] == pytest.approx(a, abs=1e-10) and solution["b"] == pytest.approx(b, abs=1e-10)


def test_a_run_ends_where_a_solution_ends() -> None:
    """y^2 = 1 - t has none after t = 1."""
    solution = mechc.loads(
        "dimensionless; coordinate x = 1; kinetic 1/2*der(x)^2; output y ~ 1; equation y^2 = 1 - time; experiment(stop = 2);"
    ).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution.outcome.value == "failed"
    assert 0.9 < solution.time[-1] <= 1.5
    seen = np.isfinite(solution["y"])
    assert solution["y"][seen] == pytest.approx(np.sqrt(1 - solution.time[seen]), rel=1e-9)


@pytest.mark.parametrize(
    ("beside", "told"), [("", "nothing determines"), (" + 2 N", "contradict each other")]
)
def test_a_force_that_repeats_itself_is_told_from_one_that_contradicts_itself(beside: str, told: str) -> None:
    caught = refused(
        "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; constraint wall: x = 1 m;"
        f"force -multiplier(wall){beside} on x;"
    )
    (only,) = caught
    assert only.code == "E0537" and told in only.message


REFUSED = {
    "output Length y ~ 1 m; equation y = 2 s;": ("E0302", "a time (s)"),
    "output Length y ~ 1 m;": ("E0339", "no equations"),
    "output Length y ~ 1 m; output Length z ~ 1 m; equation y + z = 1 m;": ("E0339", "2 unknown numbers, 1 equation"),
    "output Length y ~ 1 m; equation y - y = 0 m;": ("E0339", "do not determine"),
    "output Length y ~ 1 m; equation y = 2 m; equation 1 m = y - y;": ("E0339", "contradict"),
    "output y ~ 1; output z ~ 1; equation y + z = 1; equation y + z = 2;": ("E0339", "contradict"),
    "output y ~ 1; output z ~ 1; equation y + z = x/1 m; equation 2*y + 2*z = 2*x/1 m + 1;": ("E0339", "no numbers fulfil"),
    "output y ~ 1; output z ~ 1; equation y^2 + z^2 = 1; equation y^2 + z^2 = 2;": ("E0339", "from the guess, no numbers"),
    "output y ~ 1; equation y = 1; equation y = 2;": ("E0339", "no number fulfils"),
    "output y ~ 1; output z ~ 1; equation y + z = 1; equation 2*y + 2*z = 2;": ("E0339", "do not determine"),
    "output Length y ~ 0 m; equation y^2 = 2 m^2;": ("E0339", "at the guess they leave it open"),
    "output Length y[11] ~ 1 m; equation {y[i]*y[1] for i in 1:11} = {2 m^2 for i in 1:11};": ("E0339", "at most 10"),
    "output Length y ~ 1 m; equation y = 2 m; parameter b = 2*y;": ("E0338", "needed before"),
    "output Length y ~ 1 m; equation y = 2 m; coordinate Length b = y;": ("E0338", "'y' is found"),
    "output Length y ~ 1 m; equation y = 2 m; experiment(stop = y/(1 m/s));": ("E0338", "needed before"),
    "output Length y ~ z; equation y = 2 m; output Length z ~ 1 m; equation z = 1 m;": ("E0338", "a guess"),
    "output Boolean y ~ true;": ("E0338", "a number"),
    "equation x = 2 m;": ("E0421", "rate of a state"),
}  # fmt: skip


@pytest.mark.parametrize("text", REFUSED)
def test_what_cannot_be_solved_is_refused(text: str) -> None:
    code, words = REFUSED[text]
    with pytest.raises(mechc.CompileError) as refused:
        mechc.loads(BODY + text)
    assert code in str(refused.value) and words in str(refused.value)


def test_layout_keeps_the_guess() -> None:
    text = 'model M\n  output Length y[2] ~ {1, 2} m "found";\n  equation y = {1, 2} m;\nend M;\n'
    assert format_file(parse(SourceFile("m.mech", text), Reporter())) == text


def test_a_linear_system_whose_solution_passes_zero() -> None:
    """At an event both right sides vanish but for rounding: the guess is far larger than what is found."""
    solution = mechc.loads(
        "coordinate x[2] = {0.3, 0.5} m;\nkinetic 1/2*1 kg*(der(x[1])^2 + der(x[2])^2);\n"
        "potential 1/2*4 N/m*(x[1]^2 + x[2]^2);\nwhen x[1] < 0 m then reinit(der(x[2]), -der(x[2])); end when;\n"
        "output u[2] ~ {0.5, 0.5};\nequation u[1] + u[2] = x[1]/(1 m);\nequation u[1] - 2*u[2] = x[2]/(1 m);\n"
        "experiment(stop = 2 s);\n"
    ).simulate()
    assert solution.failure is None and solution.events
    x, y = solution["x[1]"], solution["x[2]"]
    assert np.abs(solution["u[1]"] - (2 * x + y) / 3).max() < 1e-15
    assert np.abs(solution["u[2]"] - (x - y) / 3).max() < 1e-15


# ---------------------------------------------------------------- in the motion

CUBIC = "coordinate Length x = 1 m; output Real z ~ 1; equation z^3 + z = x/1 m; experiment(stop = 3 s, tolerance = 1e-11);"


def _root(x: float) -> float:
    return float(brentq(lambda z: z**3 + z - x, -5, 5, xtol=1e-15, rtol=1e-15))


def _against_scipy(
    text: str, rates: Callable[..., object], start: list[float], by: str = "DOP853", **options: Any
) -> float:
    solution = mechc.loads(text).simulate(estimate_error=False, **options)
    assert isinstance(solution, mechc.Solution) and solution.failure is None, solution.message
    end = float(solution.time[-1])
    reference = solve_ivp(rates, (0, end), start, rtol=1e-12, atol=1e-13, method=by)
    return abs(float(solution["x"][-1]) - float(reference.y[0, -1]))


IN_THE_MOTION: dict[str, tuple[str, Callable[[float, float, float], float]]] = {
    "force": ("kinetic 1/2*1 kg*der(x)^2; force -1 N*z on x;", lambda z, d, v: -z),
    "potential": ("kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 J*z^2;", lambda z, d, v: -z * d),
    "kinetic": (
        "kinetic 1/2*(1 + z^2)*1 kg*der(x)^2; potential 1/2*1 N/m*x^2;",
        lambda z, d, v: -(z * d * v * v + z**3 + z) / (1 + z * z),
    ),
    "dissipation": (
        "kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*x^2; dissipation 1/2*0.3 N.m.s*der(z)^2;",
        lambda z, d, v: -(z**3 + z) - 0.3 * d * d * v,
    ),
}


@pytest.mark.parametrize(
    "case", slow_but(["force dop853", "kinetic radau5"], [f"{p} {m}" for p in IN_THE_MOTION for m in ("dop853", "radau5")])
)  # fmt: skip
def test_the_motion_may_depend_on_what_equations_determine(case: str) -> None:
    """z^3 + z = x has one real solution; z' = 1/(1 + 3 z^2) by hand. Implicit methods differentiate it thrice."""
    place, method = case.split()
    text, law = IN_THE_MOTION[place]

    def rates(t: float, y: list[float]) -> list[float]:
        z = _root(y[0])
        return [y[1], law(z, 1 / (3 * z * z + 1), y[1])]

    assert _against_scipy(CUBIC + text, rates, [1.0, 0.0], method=method) < 1e-10


def test_a_circle_of_signals_is_solved_by_an_unknown() -> None:
    """a.y = 0.5 (1 - a.y), so a.y = 1/3; where it is not linear it is refused as formulas, and the message names the cure."""
    gain = "model Gain input Real u; parameter Real k = 1; {} end Gain; model M Gain a(u = 1 - b.y, k = 0.5); Gain b(u = a.y);"
    loop = gain + " state Real x = 0; equation der(x) = a.y/1 s; experiment(stop = 1 s); end M;"
    with pytest.raises(mechc.CompileError) as refused:
        mechc.loads(loop.format("output Real y = k*sin(u);"))
    assert "E0207" in str(refused.value) and "'output y ~ 0;' and 'equation y = ..;'" in str(refused.value)
    solution = mechc.loads(loop.format("output Real y ~ 0; equation y = k*u;")).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution["x"][-1] == pytest.approx(1 / 3, rel=1e-14)


def test_a_muscle_with_its_tendon() -> None:
    """The tendon's force fixes the velocity of the fibre; SciPy with the law of Hill turned round by hand."""

    def rates(t: float, y: list[float]) -> list[float]:
        x, v, fibre = y
        strain = (x - fibre) / 0.2 - 1
        tendon = 37.5 * strain + 800 * strain**2 if strain > 0 else 0.0
        f = tendon / (0.5 * np.exp(-(((fibre / 0.1 - 1) / 0.45) ** 2)))
        fast = 10 * (f - 1) / (1 + f / 0.25) if f < 1 else 10 * (f - 1) / ((1.4 - f) * 7.56 + 1)
        return [v, -1000 * tendon / 5, 0.1 * fast]

    text = """
        coordinate Length x = 0.302 m; kinetic 1/2*5 kg*der(x)^2;
        state Length lf = 0.1 m; output Real vf ~ 0;
        let Real et = (x - lf)/0.2 m - 1; let Real ft = if et > 0 then 37.5*et + 800*et^2 else 0;
        let Real fl = exp(-((lf/0.1 m - 1)/0.45)^2);
        let Real fv = if vf < 0 then (1 + vf/10)/(1 - vf/2.5) else 1.4 - 0.4*(1 - vf/10)/(1 + 7.56*vf/10);
        equation 0.5*fl*fv = ft; equation der(lf) = 0.1 m*vf/1 s; force -1000 N*ft on x;
        experiment(stop = 0.1 s, tolerance = 1e-11);
    """
    assert _against_scipy(text, rates, [0.302, 0.0, 0.1], "LSODA") < 1e-10


@pytest.mark.slow
def test_a_contact_may_have_an_unknown_in_its_gap() -> None:
    """A mass falls on a floor at z(x) = -1, where x = -2 by z^3 + z = x."""
    solution = mechc.loads(
        "coordinate Length x = 0 m; output Real z ~ 0; equation z^3 + z = x/1 m; kinetic 1/2*1 kg*der(x)^2; potential 9.81 N*x;"
        "contact floor: (z + 1)*1 m restitution 0.5; experiment(stop = 0.7 s, tolerance = 1e-11);"
    ).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution) and solution.failure is None
    at = np.sqrt(2 * 2 / 9.81)
    rest = 0.7 - at
    assert solution["x"][-1] == pytest.approx(-2 + 0.5 * 9.81 * at * rest - 9.81 / 2 * rest**2, abs=1e-10)


PAIR = """
coordinate Length x = 0.2 m; coordinate Length y = 0.5 m; initial der(x) = 0.3 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 1 kg*9.81 m/s^2*y;
output Length s[2] ~ {x, y}; equation s + s*s[1]/1 m = {x, y};
let Length by_hand[2] = {sqrt(1/4 + x/1 m) - 1/2, y/1 m/(1/2 + sqrt(1/4 + x/1 m))}*1 m;
STATEMENT
output force = multiplier(c);
experiment(stop = 0.6 s, tolerance = 1e-11);
"""


@pytest.mark.parametrize(
    "statement",
    [
        "contact c: WHAT[2] - 0.1 m friction 0.2 along der(x);",
        "constraint c: WHAT[2] = 0.5 m/(1/2 + sqrt(0.45));",
    ],
)
def test_what_two_equations_determine_may_be_held(statement: str) -> None:
    """Its second derivative is in the constraint, and is affine in the accelerations: as with the solution written out."""
    found = [final(PAIR.replace("STATEMENT", statement.replace("WHAT", word))) for word in ("s", "by_hand")]
    for name in ("x", "y", "der(x)", "der(y)", "force"):
        assert found[0][name] == pytest.approx(found[1][name], abs=1e-9)


def test_an_unknown_beside_a_table_of_two_variables_is_compiled() -> None:
    found = final(
        'output a ~ 1; equation a^3 + a = 2 + table(time/1 s, a, {0, 1, 2}, {0, 1, 2}, {{0, 1, 2}, {1, 2, 3}, {2, 3, 4}}, "linear");'
        " experiment(stop = 1 s);"
    )
    assert found["a"] == pytest.approx(brentq(lambda a: a**3 + a - 2 - 1 - a, 0, 2), abs=1e-12)
