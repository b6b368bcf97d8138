"""Coordinates without mass: springs in series, Maxwell elements and networks against closed forms, SciPy and pencils of matrices."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from random import Random

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import eig, expm
from scipy.optimize import brentq
from slow_params import slow_but

import mechc
from mechc import CompileError
from mechc.cli.main import run as cli

Array = NDArray[np.float64]

X = "dimensionless; coordinate x = 1; kinetic 1/2*der(x)^2; "

SERIES = """
coordinate Length x = 1 m;
coordinate Length z ~ 0.3 m;
parameter k = 4 N/m;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*k*(x - z)^2 + 1/2*4 N/m*z^2;
experiment(stop = 2 s, tolerance = 1e-11);
"""
MAXWELL = """
coordinate Length x = 1 m;
coordinate Length z = 0 m;
parameter c = 1 N.s/m;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*4 N/m*(x - z)^2;
damping c on z;
experiment(stop = 2 s, tolerance = 1e-11);
"""


def run(text: str, **options: object) -> mechc.Solution:
    solution = mechc.loads(text).simulate(estimate_error=False, **options)  # type: ignore[arg-type]
    assert isinstance(solution, mechc.Solution)
    assert solution.failure is None, solution.message
    return solution


def maxwell(t: float) -> Array:
    """x, x', z of m x'' = -k (x - z), c z' = k (x - z)."""
    matrix = np.array([[0, 1, 0], [-4, 0, 4], [4, 0, -4]], float)
    return np.asarray(expm(matrix * t) @ [1, 0, 0])


# ---------------------------------------------------------------- closed forms


@pytest.mark.parametrize(
    "method",
    slow_but(["dop853", "taylor"], ["dop853", "taylor", "radau5", "gauss8", "lobatto6"]),
)
def test_two_springs_are_one(method: str) -> None:
    fixed = {"step": "10 ms"} if method in ("gauss8", "lobatto6") else {}
    solution = run(SERIES, method=method, **fixed)
    assert np.abs(solution["x"] - np.cos(np.sqrt(2) * solution.time)).max() < 1e-9
    assert np.abs(solution["z"] - solution["x"] / 2).max() < 1e-15
    assert np.abs(solution["der(z)"] - solution["der(x)"] / 2).max() < 1e-15


@pytest.mark.parametrize("n", slow_but([5], [2, 5, 20, 200]))
def test_springs_in_series(n: int) -> None:
    stiff = [4 + (7 * i) % 5 for i in range(n)]
    text = f"coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2; coordinate Length z[{n - 1}] ~ 0 m;"
    ends = ["0 m", *(f"z[{i}]" for i in range(1, n)), "x"]
    for a, b, k in zip(ends, ends[1:], stiff, strict=False):
        text += f"potential 1/2*{k} N/m*({b} - {a})^2;\n"
    solution = run(text + "experiment(stop = 2 s, tolerance = 1e-12);")
    give = np.cumsum([1 / k for k in stiff])
    assert solution["x"][-1] == pytest.approx(np.cos(2 / np.sqrt(give[-1])), abs=1e-11)
    for i in range(1, n):
        assert solution[f"z[{i}]"][-1] == pytest.approx(solution["x"][-1] * give[i - 1] / give[-1], abs=1e-13)


@pytest.mark.parametrize("method", slow_but(["dop853"], ["dop853", "taylor", "radau5", "gauss8"]))
def test_maxwell_element(method: str) -> None:
    solution = run(MAXWELL, method=method, **({"step": "10 ms"} if method == "gauss8" else {}))
    exact = maxwell(2.0)
    assert [solution[q][-1] for q in ("x", "der(x)", "z")] == pytest.approx(list(exact), abs=1e-9)
    lost = solution["energy.dissipated"] + solution["energy.total"] - 2
    assert np.abs(lost).max() < 1e-10


@pytest.mark.slow
def test_a_chain_of_maxwell_elements() -> None:
    """A damper between two nodes without mass leaves one balance without rates, that of both together."""
    text = """
    coordinate Length x = 1 m; coordinate Length a = 0.6 m; coordinate Length b ~ 0 m;
    kinetic 1/2*1 kg*der(x)^2;
    potential 1/2*4 N/m*(x - a)^2 + 1/2*3 N/m*b^2; damping 0.7 N.s/m on a - b;
    experiment(stop = 2 s, tolerance = 1e-12);
    """
    solution = run(text)

    def rates(t: float, y: Array) -> list[float]:  # 4 (x - a) = 3 b = 0.7 (a' - b'), so b = 4 (x - a)/3
        x, v, a = y
        return [v, -4 * (x - a), (4 * (x - a) / 0.7 + 4 * v / 3) / (7 / 3)]

    reference = solve_ivp(rates, (0, 2), [1, 0, 0.6], rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    assert [solution[q][-1] for q in ("x", "der(x)", "a")] == pytest.approx(list(reference), abs=1e-10)
    assert solution["b"] == pytest.approx(4 * (solution["x"] - solution["a"]) / 3, abs=1e-14)


# ---------------------------------------------------------------- networks


Edge = tuple[int, int, str, float, float]


def network(seed: int) -> tuple[list[float], list[Edge]]:
    """Masses, some zero, and springs and dampers: a tree to the ground (-1), and some further ones."""
    random = Random(seed)
    n = random.randint(2, 7)
    masses = [random.choice([0, 0, round(random.uniform(0.3, 2), 2)]) for _ in range(n)]
    if not any(masses):
        masses[random.randrange(n)] = 1.0

    def element(i: int, j: int, kinds: list[str]) -> Edge:
        return i, j, random.choice(kinds), round(random.uniform(1, 30), 1), round(random.uniform(0.2, 3), 2)

    edges = [element(0, -1, ["k"])]
    edges += [element(i, random.randrange(-1, i), ["k", "k", "c", "kc"]) for i in range(1, n)]
    pairs = [(random.randrange(n), random.randrange(-1, n)) for _ in range(random.randint(0, n))]
    edges += [element(i, j, ["k", "c", "kc"]) for i, j in pairs if i != j]
    return masses, edges


def written(masses: list[float], edges: list[Edge], seed: int) -> str:
    random = Random(-seed - 1)
    text = ""
    for i, m in enumerate(masses):
        text += f"coordinate Length x{i} {'=' if m else '~'} {random.uniform(-1, 1):.2f} m;\n"
        if m:
            text += f"initial der(x{i}) = {random.uniform(-1, 1):.2f} m/s; kinetic 1/2*{m} kg*der(x{i})^2;\n"
    for i, j, kind, k, c in edges:
        along = f"x{i}" + (f" - x{j}" if j >= 0 else "")
        text += f"potential 1/2*{k} N/m*({along})^2;\n" if "k" in kind else ""
        text += f"damping {c} N.s/m on {along};\n" if "c" in kind else ""
    return text + "experiment(stop = 2 s, tolerance = 1e-12);"


def pencil(masses: list[float], edges: list[Edge], x: Array, v: Array, t: float) -> tuple[float, Array]:
    """Return how far a start is from the solutions of E y' = A y, and the places at t, by the finite eigenvalues of the pencil."""
    n = len(masses)
    damping, stiffness = np.zeros((n, n)), np.zeros((n, n))
    for i, j, kind, k, c in edges:
        e = np.eye(n)[i] - (np.eye(n)[j] if j >= 0 else 0)
        stiffness += k * np.outer(e, e) if "k" in kind else 0
        damping += c * np.outer(e, e) if "c" in kind else 0
    heavy = np.array(masses) > 0
    rows, columns = np.r_[heavy, np.ones(n, bool)], np.r_[np.ones(n, bool), heavy]
    left = np.block([[np.eye(n), np.zeros((n, n))], [damping, np.diag(masses)]])[rows][:, columns]
    right = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, np.zeros((n, n))]])[rows][:, columns]
    (alpha, beta), vectors = eig(right, left, homogeneous_eigvals=True)
    finite = np.abs(beta) > 1e-9 * np.maximum(np.abs(alpha), np.abs(beta))
    start = np.r_[x, v[heavy]]
    shares = np.linalg.lstsq(vectors[:, finite], start.astype(complex), rcond=None)[0]
    moved = vectors[:, finite] @ (shares * np.exp(alpha[finite] / beta[finite] * t))
    return float(np.abs(vectors[:, finite] @ shares - start).max()), moved.real[:n]


@pytest.mark.parametrize("seed", slow_but([4, 9, 296], range(300)))
def test_random_networks(seed: int) -> None:
    masses, edges = network(seed)
    solution = run(written(masses, edges, seed))
    names = [f"x{i}" for i in range(len(masses))]
    first, last = (np.array([solution[name][k] for name in names]) for k in (0, -1))
    rates = np.array([solution[f"der({name})"][0] for name in names])
    off, expected = pencil(masses, edges, first, rates, 2.0)
    assert off < 1e-12
    assert np.abs(last - expected).max() < 1e-9 * max(1, np.abs(expected).max())
    lost = solution["energy.total"] - solution["energy.total"][0]
    if "energy.dissipated" in solution.quantities:
        lost = lost + solution["energy.dissipated"]
    assert np.abs(lost).max() < 1e-9 * solution["energy.total"][0]


# ---------------------------------------------------------------- what is not linear


def test_a_node_on_a_cubic_spring() -> None:
    """4 (x - z) = 4 z^3, and its rate by the implicit function."""
    text = SERIES.replace("1/2*4 N/m*z^2", "1/4*4 N/m^3*z^4")

    def node(x: float) -> float:
        return float(brentq(lambda z: z**3 + z - x, -2, 2, xtol=1e-15))

    def rates(t: float, y: Array) -> list[float]:
        return [y[1], -4 * (y[0] - node(y[0]))]

    solution = run(text)
    reference = solve_ivp(rates, (0, 2), [1, 0], rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    assert [solution[q][-1] for q in ("x", "der(x)")] == pytest.approx(list(reference), abs=1e-10)
    z = solution["z"]
    assert z**3 + z == pytest.approx(solution["x"], abs=1e-15)
    assert solution["der(z)"] == pytest.approx(solution["der(x)"] / (3 * z**2 + 1), abs=1e-13)
    assert np.ptp(solution["energy.total"]) < 1e-10


@pytest.mark.slow
def test_accelerations_of_what_has_no_mass() -> None:
    """z^3 + z = x twice differentiated: z'' = (x'' - 6 z z'^2)/(1 + 3 z^2)."""
    solution = run(
        SERIES.replace("1/2*4 N/m*z^2", "1/4*4 N/m^3*z^4") + "output a = der(der(z)); output b = der(der(x));"
    )
    z, rate = solution["z"], solution["der(z)"]
    assert solution["a"] == pytest.approx((solution["b"] - 6 * z * rate**2) / (3 * z**2 + 1), abs=1e-12)


def test_a_model_without_any_mass() -> None:
    """c z' = -k z, and a spring that follows a force of time."""
    decay = run(
        "dimensionless; coordinate z = 1; potential 1/2*z^2; damping 1 on z; experiment(stop = 1, tolerance = 1e-11);"
    )
    assert decay["z"] == pytest.approx(np.exp(-decay.time), abs=1e-10)
    assert np.ptp(decay["energy.total"] + decay["energy.dissipated"]) < 1e-10
    led = run(
        "dimensionless; coordinate z ~ 0; potential 1/2*z^2; force sin(time) on z; experiment(stop = 1);"
    )
    assert led["z"] == pytest.approx(np.sin(led.time), abs=1e-15)
    assert led["der(z)"] == pytest.approx(np.cos(led.time), abs=1e-15)


@pytest.mark.slow
def test_a_reaction_acts_on_what_has_no_mass() -> None:
    """2 (x - z) - 2 z + 0.1 m = 0 with the multiplier m = x - z: z = 2.1 x/4.1, and x'' = -(x - z)."""
    solution = run(
        X + "coordinate y = 1; kinetic 1/2*der(y)^2; constraint c: x = y; coordinate z ~ 0;"
        "potential (x - z)^2 + z^2; force 0.1*multiplier(c) on z; experiment(stop = 1, tolerance = 1e-11);"
    )
    assert solution["x"][-1] == pytest.approx(np.cos(np.sqrt(2 / 4.1)), abs=1e-10)
    assert solution["z"] == pytest.approx(2.1 * solution["x"] / 4.1, abs=1e-13)


@pytest.mark.slow
def test_a_node_between_springs_in_the_plane() -> None:
    """Where its energy is least: by SciPy's minimiser at each of its states."""
    solution = run(
        """
        import mech.planar.*;
        Particle m(m = 1 kg); Translation t(world -> m.a, position = {1, 0.3} m);
        frame node; Translation n(world -> node, position ~ {0.5, 0.4} m);
        Spring a(world -> node, k = 10 N/m, rest = 0.3 m); Spring b(world*trans({0, 1} m) -> node, k = 7 N/m, rest = 0.4 m);
        Spring c(node -> m.a, k = 5 N/m, rest = 0.2 m);
        experiment(stop = 1 s, tolerance = 1e-10, every = 0.1 s);
        """
    )
    springs = [(10, 0.3), (7, 0.4), (5, 0.2)]
    for k in range(0, len(solution.time), 3):
        ends = np.array([[0, 0], [0, 1], [solution["t.position[1]"][k], solution["t.position[2]"][k]]])
        node = np.array([solution["n.position[1]"][k], solution["n.position[2]"][k]])
        pull = sum(
            s * (np.linalg.norm(node - end) - rest) * (node - end) / np.linalg.norm(node - end)
            for end, (s, rest) in zip(ends, springs, strict=True)
        )
        assert np.abs(pull).max() < 1e-12
    assert np.ptp(solution["energy.total"]) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("n", [4, 20])
def test_springs_in_series_that_are_not_linear(n: int) -> None:
    """n springs of force 4 s + c s^3: each is stretched alike, and many balances are solved along the structure."""
    ends = ["0", *(f"z[{i}]" for i in range(1, n)), "x"]
    text = X + f"coordinate z[{n - 1}] ~ 0.1;"
    text += "".join(f"potential 2*({b} - {a})^2 + {100 * n}*({b} - {a})^4;" for a, b in pairwise(ends))
    solution = run(text + "experiment(stop = 2, tolerance = 1e-11);")

    def rates(t: float, y: Array) -> list[float]:
        s = y[0] / n
        return [y[1], -4 * s - 400 * n * s**3]

    reference = solve_ivp(rates, (0, 2), [1, 0], rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    assert solution["x"][-1] == pytest.approx(reference[0], abs=1e-9)
    assert solution[f"z[{n // 2}]"] == pytest.approx(solution["x"] * (n // 2) / n, abs=1e-13)


DAMPED_IF_PRESSED = """
coordinate Length x = 1 m;
coordinate Length z ~ 0.3 m;
parameter c = 0 N.s/m;
let twist = z - x;
let spring = 4 N/m*twist;
kinetic 1/2*1 kg*der(x)^2;
potential 1/2*4 N/m*twist^2 + 1/2*4 N/m*z^2;
force -(if spring > 0 N then max(c*der(twist), -spring) else min(c*der(twist), -spring)) on twist;
experiment(stop = 2 s, tolerance = 1e-11);
"""


def test_a_damper_of_no_strength_in_a_law_that_bends() -> None:
    """The rate of what has mass stayed in the balance, and its acceleration where nothing can be solved for it."""
    found = run(DAMPED_IF_PRESSED)
    assert np.abs(found["x"] - np.cos(np.sqrt(2) * found.time)).max() < 1e-9
    assert np.abs(found["z"] - found["x"] / 2).max() < 1e-9
    damped = mechc.loads(DAMPED_IF_PRESSED).simulate(set={"c": 0.1}, estimate_error=False)
    assert "contain a rate that it does not contain" in str(damped.message)


def test_a_node_in_the_play_of_a_gear_is_refused() -> None:
    text = """
import mech.rotational.*;
model Play
  Node pinion;
  Backlash shaft(pinion.angle -> load.angle, k = 900 N.m/rad, play = 0.8 deg);
  Rotor load(J = 0.12 kg.m^2, angle = 0 rad);
  experiment(stop = 2 s);
end Play;
"""
    with pytest.raises(
        mechc.SimulationError, match=r"no balance of forces on 'pinion.angle' is found at the start"
    ):
        mechc.loads(text).simulate()


@pytest.mark.slow
def test_a_damper_that_is_not_linear() -> None:
    """z' + z'^3 = 4 (x - z)."""
    text = MAXWELL.replace("damping c on z;", "dissipation 1/2*c*der(z)^2 + 1/4*c*1 s^2/m^2*der(z)^4;")

    def rates(t: float, y: Array) -> list[float]:
        x, v, z = y
        return [v, -4 * (x - z), brentq(lambda w: w + w**3 - 4 * (x - z), -9, 9, xtol=1e-15)]

    solution = run(text)
    reference = solve_ivp(rates, (0, 2), [1, 0, 0], rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    assert [solution[q][-1] for q in ("x", "der(x)", "z")] == pytest.approx(list(reference), abs=1e-10)


@pytest.mark.slow
def test_a_spring_that_is_slack_on_one_side() -> None:
    """A node between a linear spring and one that only pulls: its kink is an event."""
    text = SERIES.replace("1/2*4 N/m*z^2", "1/2*1 N/m*z^2 + (if z > 0 m then 1/2*8 N/m*z^2 else 0 J)")

    def rates(t: float, y: Array) -> list[float]:
        z = 4 * y[0] / (13 if y[0] > 0 else 5)
        return [y[1], -4 * (y[0] - z)]

    solution = run(text)
    reference = solve_ivp(rates, (0, 2), [1, 0], rtol=1e-12, atol=1e-13, method="DOP853", max_step=1e-2).y[
        :, -1
    ]
    assert [solution[q][-1] for q in ("x", "der(x)")] == pytest.approx(list(reference), abs=1e-8)


def test_a_force_by_the_velocity_of_what_has_mass() -> None:
    """4 (x - z) - 4 z - 0.3 x' = 0: der(z) follows from the acceleration."""
    solution = run(SERIES + "force -0.3 N.s/m*der(x) on z;")
    matrix = np.array([[0, 1], [-2, -0.15]])
    reference = expm(matrix * 2.0) @ [1, 0]
    assert [solution[q][-1] for q in ("x", "der(x)")] == pytest.approx(list(reference), abs=1e-10)
    accelerated = matrix[1] @ reference
    assert solution["der(z)"][-1] == pytest.approx((4 * reference[1] - 0.3 * accelerated) / 8, abs=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["dop853", "radau5", "lobatto6"])
def test_the_solution_goes_on_as_it_began(method: str) -> None:
    """A hub without mass between two magnetic couplings, 5 sin(x - z) = 3 sin(z - y), after twelve turns: its balance has many
    solutions, and the guess is that of the start."""

    def rates(t: float, s: Array) -> list[float]:
        x, y, u, v, z = s
        stiff = 5 * np.cos(x - z), 3 * np.cos(z - y)
        slip = (stiff[0] * u + stiff[1] * v) / sum(stiff)
        return [u, v, 0.3 - 5 * np.sin(x - z), 1.5 * np.sin(z - y), slip]

    text = """
    coordinate Angle x = 0 rad; initial der(x) = 3 rad/s; coordinate Angle y = 0 rad; initial der(y) = 3 rad/s;
    coordinate Angle z ~ 0 rad;
    kinetic 1/2*1 kg.m^2*der(x)^2 + 1/2*2 kg.m^2*der(y)^2; force 0.3 N.m on x;
    potential -5 N.m*cos(x - z) - 3 N.m*cos(z - y);
    experiment(stop = 20 s, tolerance = 1e-11);
    """
    solution = run(text, method=method, **({"step": "20 ms"} if method == "lobatto6" else {}))
    reference = solve_ivp(rates, (0, 20), [0, 0, 3, 3, 0], rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    close = 1e-6 if method == "lobatto6" else 1e-8
    assert [solution[q][-1] for q in ("x", "y", "z")] == pytest.approx(list(reference[[0, 1, 4]]), abs=close)


@pytest.mark.slow
def test_a_solution_that_ends_is_told() -> None:
    """A node in a double well, 2 (z^3 - z) + z = x, ends in the fold 6 z^2 = 1."""
    solution = mechc.loads(
        "dimensionless; coordinate x = -2; initial der(x) = 1; coordinate z ~ -1; kinetic 1/2*der(x)^2;"
        "potential 1/2*(x - z)^2 + 1/2*(z^2 - 1)^2; experiment(stop = 8);"
    ).simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution) and solution.failure is not None
    assert solution["z"][-1] == pytest.approx(-1 / np.sqrt(6), abs=1e-4)
    assert any("two solutions meet" in remark or "ends there" in remark for remark in solution.remarks)


@pytest.mark.parametrize(
    ("statements", "end"),
    [
        ("output z ~ -1; equation z^3 - z = x; force 1e-4*z on x;", 0.3849),
        ("coordinate z ~ -1; potential z^4/4 - z^2/2 - x*z;", 0.4970),
    ],
    ids=["unknown", "node"],
)
def test_a_run_that_fails_in_a_fold_says_so(statements: str, end: float) -> None:
    """z^3 - z = x ends at x = 2/3 sqrt(1/3), where steps become short before nothing is found. A law that is as flat, and goes on, is passed."""
    text = "dimensionless; coordinate x = 0; initial der(x) = 1; kinetic 1/2*der(x)^2; experiment(stop = 2);"
    solution = mechc.loads(text + statements).simulate(estimate_error=False)
    assert solution["x"][-1] == pytest.approx(2 / 3**1.5, abs=1e-9)
    assert solution.time[-1] == pytest.approx(end, abs=1e-4)
    (told,) = [remark for remark in solution.remarks if "ends there, in a fold" in remark]
    assert "'z' = -0.57735 is the last value" in told
    flat = text.replace("x = 0", "x = -1") + "coordinate z ~ -1; potential z^4/4 - x*z;"
    assert not any("fold" in remark for remark in mechc.loads(flat).simulate(estimate_error=False).remarks)


# ---------------------------------------------------------------- inertias of zero, bodies


def test_an_inertia_that_a_parameter_makes_zero() -> None:
    text = SERIES + "parameter J = 0 kg; kinetic 1/2*J*der(z)^2;"
    solution = run(text)
    assert solution["x"][-1] == pytest.approx(np.cos(2 * np.sqrt(2)), abs=1e-10)
    other = mechc.loads(text).simulate(set={"J": 0.1}, estimate_error=False)
    assert isinstance(other, mechc.Solution) and "'z' has no mass with the values of the model" in str(
        other.message
    )


def test_a_lever_without_mass() -> None:
    """A lever of 2 m on a hinge, a torsion spring in it, and a spring to a mass: (1/8 + 4/3)^-1 N/m together."""
    solution = run(
        """
        import mech.planar.*;
        Body lever(m = 0 kg, J = 0 kg.m^2); Revolute hinge(world -> lever.a, angle ~ 0.1 rad);
        Particle mass(m = 1 kg); Prismatic rail(world -> mass.a, position = 1 m);
        potential 1/2*8 N/m*(rail.position - 2 m*hinge.angle)^2 + 1/2*3 N.m*hinge.angle^2;
        experiment(stop = 2 s, tolerance = 1e-11);
        """
    )
    assert solution["rail.position"][-1] == pytest.approx(np.cos(2 / np.sqrt(1 / 8 + 4 / 3)), abs=1e-10)


# ---------------------------------------------------------------- motions of several coordinates that move no mass


def test_two_sliders_in_a_row() -> None:
    """The frame between them has no mass; both springs of 4 N/m are in series, and a stop acts on the mass after them."""
    solution = run(
        """
        import mech.planar.*;
        Particle mass(m = 1 kg); frame node;
        Prismatic first(world -> node, position = 0.5 m); Prismatic second(node -> mass.a, position ~ 0.5 m);
        potential 1/2*4 N/m*first.position^2 + 1/2*4 N/m*second.position^2;
        contact stop: first.position + second.position restitution 0.5;
        experiment(stop = 2 s, tolerance = 1e-11);
        """
    )
    w = np.sqrt(2)
    hit = np.pi / 2 / w
    exact = np.where(solution.time < hit, np.cos(w * solution.time), np.sin(w * (solution.time - hit)) / 2)
    assert np.abs(2 * solution["first.position"] - exact).max() < 1e-9
    assert np.abs(solution["second.position"] - solution["first.position"]).max() < 1e-14
    assert np.ptp(solution["energy.total"] + solution["energy.dissipated"]) < 1e-9


@pytest.mark.slow
def test_rows_of_unequal_sizes() -> None:
    """A lever of 1e-11 m/rad before the mass: factors of rows may be small."""
    solution = run(
        "dimensionless; coordinate a = 1; coordinate b ~ 0; kinetic 1/2*(der(a) + 1e-11*der(b))^2;"
        "potential 1/2*a^2 + 1/2*1e-22*b^2; experiment(stop = 2, tolerance = 1e-11);"
    )
    assert 1e-11 * solution["b"] == pytest.approx(solution["a"], abs=1e-12)
    assert solution["a"] == pytest.approx(np.cos(np.sqrt(1 / 2) * solution.time), abs=1e-9)


@pytest.mark.slow
def test_a_spring_and_a_damper_in_a_row() -> None:
    """MAXWELL by the stretch of the spring and that of the damper: x = a + b, z = b."""
    text = "dimensionless; coordinate a = 1; initial der(a) = -4; coordinate b = 0; kinetic 1/2*(der(a) + der(b))^2;"
    solution = run(text + "potential 1/2*4*a^2; damping 1 on b; experiment(stop = 2, tolerance = 1e-11);")
    x, _, z = maxwell(2.0)
    assert [solution["a"][-1], solution["b"][-1]] == pytest.approx([x - z, z], abs=1e-9)


def test_constraints_and_springs_decide_together() -> None:
    """Of z + w = x and (x - z)^2 + z^2 + w^2 the energy is least at z = 2 x/3: 2/3 x^2 is left."""
    solution = run(
        X + "coordinate z ~ 0; coordinate w ~ 0; potential (x - z)^2 + z^2 + w^2; constraint c: z + w = x;"
        "output force = multiplier(c); experiment(stop = 2, tolerance = 1e-11);"
    )
    assert solution["x"] == pytest.approx(np.cos(np.sqrt(4 / 3) * solution.time), abs=1e-9)
    assert solution["z"] == pytest.approx(2 * solution["x"] / 3, abs=1e-10)
    assert np.abs(solution["force"]) == pytest.approx(np.abs(2 * solution["x"] / 3), abs=1e-10)
    assert np.ptp(solution["energy.total"]) < 1e-10


# ---------------------------------------------------------------- starts, events, inputs


def test_a_stated_start_is_a_condition_on_the_others() -> None:
    text = SERIES.replace("x = 1 m", "x ~ 1 m").replace("z ~ 0.3 m", "z = 0.25 m")
    solution = run(text + "initial der(x) ~ 0 m/s; initial der(z) = 0.5 m/s;")
    assert [solution[q][0] for q in ("x", "z", "der(x)")] == pytest.approx([0.5, 0.25, 1.0], abs=1e-14)
    with pytest.raises(mechc.SimulationError, match="contradict"):
        mechc.loads(SERIES.replace("z ~ 0.3 m", "z = 0.25 m")).simulate()


def test_an_initial_value_of_what_is_no_state_is_refused() -> None:
    with pytest.raises(mechc.UsageMistake, match="'z' has no mass: the balance of forces decides it"):
        mechc.loads(SERIES).simulate(set={"z": "0.3 m"})
    for start in ("z = 0.3 m", "z in {0.3, 0.4} m"):
        with pytest.raises(mechc.CompileError, match="it has no mass: the balance of forces decides it"):
            mechc.loads(SERIES + f"experiment moved({start});")
    moved = run(MAXWELL, set={"z": "0.3 m"})
    assert moved["z"][0] == 0.3


def test_an_impact_moves_what_has_no_mass_along() -> None:
    """x' jumps at the stop, and z' = x'/2 with it; z goes on."""
    solution = run(SERIES + "contact stop: x restitution 0.5;")
    ((t, _),) = [(e.time, e) for e in solution.events if e.time > 0]
    assert t == pytest.approx(np.pi / 2 / np.sqrt(2), abs=1e-9)
    after = solution.time > t + 1e-9
    expected = np.sin(np.sqrt(2) * (solution.time - t)) / 2
    assert np.abs(solution["x"] - expected)[after].max() < 1e-9
    assert np.abs(solution["z"] - expected / 2)[after].max() < 1e-9
    balance = solution["energy.total"] + solution["energy.dissipated"]
    assert np.ptp(balance) < 1e-9


def test_a_force_that_jumps_does_work_on_what_has_no_mass() -> None:
    """The node jumps by F/8, and the account of energy holds what the force brought."""
    solution = run(SERIES + "force (if time > 1 s then 2 N else 0 N) on z;")
    t, x = solution.time, solution["x"]
    late = t > 1 + 1e-9
    assert np.abs(solution["z"] - x / 2 - np.where(late, 0.25, 0))[late].max() < 1e-13
    w = np.sqrt(2)  # x'' = -2 x + 1 after t = 1
    start, speed = np.cos(w) - 0.5, -w * np.sin(w)
    expected = 0.5 + start * np.cos(w * (t - 1)) + speed / w * np.sin(w * (t - 1))
    assert np.abs(x - expected)[late].max() < 1e-9
    assert np.ptp(solution["energy.total"] - solution["energy.supplied"]) < 1e-9


def test_an_input_acts_without_its_rate() -> None:
    """z follows the force of an input, so nothing tells der(z) or the work; the motion is known."""
    solution = run(SERIES + "input Force F = 1 N*sin(time/1 s); force F on z;")
    other = run(SERIES + "force 1 N*sin(time/1 s) on z;")
    assert solution["x"][-1] == pytest.approx(other["x"][-1], abs=1e-11)
    assert "der(z)" not in solution.quantities and "energy.supplied" not in solution.quantities
    assert "der(z)" in other.quantities and np.ptp(other["energy.total"] - other["energy.supplied"]) < 1e-10


# ---------------------------------------------------------------- studies and targets


def test_algebraic_coordinates_are_no_states() -> None:
    linear = mechc.loads(SERIES).linearize()
    assert np.sort(np.asarray(linear.poles).imag) == pytest.approx([-np.sqrt(2), np.sqrt(2)], abs=1e-13)
    assert np.asarray(linear.A).shape == (2, 2)


@pytest.mark.slow
def test_sensitivities() -> None:
    """x = cos(sqrt(K) t) with K = 4 k/(4 + k), dK/dk = 16/(4 + k)^2 = 1/4."""
    solution = run(SERIES, sensitivity="k")
    w, t = np.sqrt(2), 2.0
    slope = -np.sin(w * t) * t / (2 * w) / 4
    assert solution.sensitivity("x", "k").values[-1] == pytest.approx(slope, abs=1e-9)
    own = np.cos(w * t) / 16 * 1.0  # dz/dk at x held: z = k x/(4 + k), 4 x/64
    assert solution.sensitivity("z", "k").values[-1] == pytest.approx(slope / 2 + own, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("text", [SERIES, MAXWELL])
def test_targets_give_the_same_motion(text: str, tmp_path: Path) -> None:
    # an FMU is compared with the native run before it is written
    (tmp_path / "model.mech").write_text(text, encoding="utf-8")
    arguments = [str(tmp_path / "model.mech"), "--target", "fmu", "-o", str(tmp_path / "model.fmu")]
    assert cli(["compile", *arguments]) == 0


# ---------------------------------------------------------------- what is refused


REFUSED = {
    "a node on nothing": (X + "coordinate z ~ 0;", "E0520", "'z', and no force decides where it is"),
    "two nodes on each other": (
        X + "coordinate z ~ 0; coordinate w ~ 0; potential (z - w)^2;",
        "E0520",
        "'z' and 'w' together",
    ),
    "a damper between two": (
        X + "coordinate z ~ 0; coordinate w ~ 0; damping 1 on z - w;",
        "E0520",
        "'z' and 'w' together",
    ),
    "set by an event": (
        X + "coordinate z ~ 0; potential (x - z)^2 + z^2; when time > 1 then reinit(z, 1); end when;",
        "E0713",
        "'z' has no mass, so it cannot be set",
    ),
    "pushed by an event": (
        X + "coordinate z ~ 0; potential (x - z)^2 + z^2; when time > 1 then impulse 1 on z; end when;",
        "E0713",
        "'z' has no mass, so it cannot be pushed",
    ),
    "a contact on it": (
        X + "coordinate z ~ 0; potential (x - z)^2; contact c: z;",
        "E0520",
        "contacts and friction in contacts act on what has mass",
    ),
    "held in part, and loose": (
        X + "coordinate z ~ 0; coordinate w ~ 0; potential x^2; constraint z + w = x;",
        "E0520",
        "nothing with mass moves with 'z'",
    ),
    "two sliders in a row, on nothing": (
        "dimensionless; coordinate a = 1; coordinate b ~ 0; kinetic (der(a) + der(b))^2; potential (a + b)^2;",
        "E0520",
        "some motion of 'a' and 'b' together moves no mass",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_nothing_decides_is_refused_by_name(name: str) -> None:
    text, code, words = REFUSED[name]
    with pytest.raises(CompileError) as refused:
        mechc.loads(text + "experiment(stop = 1);")
    assert code in str(refused.value) and words in str(refused.value)


RACK = """
import mech.translational.*;
import R = mech.rotational;
Slider p(m = 1 kg, s = 0.1 m);
Node n;
R.Node w;
SpringDamper s1(p.s -> n.s, k = 10 N/m{c1});
Rack r(w.angle -> n.s, r = 0.1 m);
R.SpringDamper s2(from = w.angle, k = 1 N.m/rad{c2});
experiment(stop = 1 s, tolerance = 1e-11);
"""


@pytest.mark.parametrize("c1", ["", ", c = 0 N.s/m"])
@pytest.mark.parametrize("c2", ["", ", c = 0 N.m.s"])
def test_dampings_of_value_zero_on_both_sides_of_a_constraint(c1: str, c2: str) -> None:
    """1 N.m/rad is 100 N/m at the rack; in series with 10 N/m that is 1000/110 N/m."""
    solution = mechc.loads(RACK.format(c1=c1, c2=c2)).simulate()
    x = 0.1 * math.cos(math.sqrt(1000 / 110))
    assert solution["p.s"][-1] == pytest.approx(x, abs=1e-11)
    assert solution["w.angle"][-1] == pytest.approx(x / 0.1 / 11, abs=1e-10)


def test_a_damping_that_comes_to_a_constraint_is_told() -> None:
    solution = mechc.loads(RACK.format(c1="", c2="")).simulate(set={"s2.c": 0.1}, estimate_error=False)
    assert "contain a rate that it does not contain" in solution.message


UNDECIDED = {
    "no stiffness": (SERIES.replace("4 N/m*z^2", "k*z^2"), {"k": 0.0}, "no force decides the motion"),
    "no damping": (
        SERIES + "parameter d = 1 N.s/m; damping d on z;",
        {"d": 0.0},
        "the damping that decides the rate is zero: where a value makes it so, write that into the model",
    ),
    "a damping that comes": (
        SERIES + "parameter d = 0 N.s/m; damping d on z;",
        {"d": 1.0},
        "contain a rate that it does not contain",
    ),
}


@pytest.mark.parametrize("name", UNDECIDED)
def test_parameters_that_change_what_decides_are_told(name: str) -> None:
    text, values, words = UNDECIDED[name]
    solution = mechc.loads(text).simulate(set=values, estimate_error=False)
    assert isinstance(solution, mechc.Solution) and words in str(solution.message)


# ---------------------------------------------------------------- what it costs


LONG = "experiment(stop = 1000, every = 1000, tolerance = 1e-9);"
DRIVEN = X + "potential x^2; force sin(0.9*time) on x;"
STIFF = [4 + (7 * i) % 5 for i in range(20)]

BY_HAND = {
    "springs in series": (
        X
        + "coordinate z[19] ~ 0;"
        + "".join(
            f"potential 1/2*{k}*({b} - {a})^2;"
            for k, (a, b) in zip(STIFF, pairwise(["0", *(f"z[{i}]" for i in range(1, 20)), "x"]), strict=True)
        ),
        X + f"potential 1/2*{1 / sum(1 / k for k in STIFF)}*x^2;",
    ),
    "Maxwell elements": (
        X
        + "coordinate z[10] = 0; potential sum(2*i*(x - z[i])^2 for i in 1:10);"
        + "".join(f"damping {100 + i} on z[{i}];" for i in range(1, 11)),
        X
        + "state z[10] = 0; force -sum(4*i*(x - z[i]) for i in 1:10) on x; state lost = 0;"
        + "".join(f"equation der(z[{i}]) = {4 * i}*(x - z[{i}])/{100 + i};" for i in range(1, 11))
        + "equation der(lost) = sum((4*i*(x - z[i]))^2/(100 + i) for i in 1:10);",
    ),
    "a friction beside a damper": (
        DRIVEN + "coordinate z = 1; potential 2*(x - z)^2; damping 2 on z; friction f: 1 on z;",
        DRIVEN
        + "state z = 1; let p = 4*(x - z); force -p on x; state lost = 0; equation der(lost) = p*der(z);"
        "equation der(z) = if p > 1 then (p - 1)/2 else if p < -1 then (p + 1)/2 else 0;",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BY_HAND)
def test_it_costs_no_more_than_by_hand(name: str) -> None:
    """The same with its accounts of energy as a person would write it. Measured: 0.95 to 1.1; the middle of quotients of
    neighbouring runs, whose noise is a tenth."""
    models = [mechc.loads(text + LONG) for text in BY_HAND[name]]
    quotients = []
    for _ in range(25):
        runs = [model.simulate(estimate_error=False, method="dop853") for model in models]
        assert all(isinstance(one, mechc.Solution) and one.failure is None for one in runs)
        quotients.append(runs[0].statistics.run_time / runs[1].statistics.run_time)
    assert sorted(quotients)[12] < 1.2


def test_a_rotation_after_a_coordinate_without_mass() -> None:
    """A damper relaxes as exp(-k t/c) before a free body in the text; the body turns as without it."""
    body = "coordinate Rotation q ~ rotz(0 rad); initial der(q) ~ {0.7, -0.3, 0.4} rad/s; frame b = world*q; inertia diag({1, 2, 3}) kg.m^2 on b; experiment(stop = 1 s, tolerance = 1e-11);"
    oil = "coordinate Length oil = 0.2 m; potential 1/2*3 N/m*oil^2; damping 1 N.s/m on oil;"
    both = mechc.loads(f"{oil} {body}").simulate(estimate_error=False)
    alone = mechc.loads(body).simulate(estimate_error=False)
    assert both["oil"][-1] == pytest.approx(0.2 * np.exp(-3), abs=1e-10)
    for k in (1, 2, 3, 4):
        assert both[f"q[{k}]"][-1] == pytest.approx(alone[f"q[{k}]"][-1], abs=1e-10)


MEASURED = """
import mech.rotational.*;

model Half
  input Angle shaft;
  let hub = shaft;
  parameter RotationalStiffness stiff = 100 N.m/rad;
  Node middle;
  let joint = middle.angle;
  SpringDamper quill(hub -> joint, k = 50 N.m/rad);
  Backlash teeth(from = joint, to = 0 rad, k = stiff, play = 0 deg);
end Half;

model Line
  input Torque load = 0 N.m;
  Rotor wheel(J = 0.1 kg.m^2, angle = 0 rad);
  Half half(shaft = wheel.angle, stiff = 200 N.m/rad);
  force load on wheel.angle;
  when wheel.angle > 0.5 rad then
    terminate("far enough");
  end when;
  experiment(stop = 5 s, tolerance = 1e-10);
end Line;
"""


def test_a_node_in_a_part_under_a_measured_load_until_it_ends() -> None:
    """Springs in series, 50 and 200: J w' = load - 40 angle; by SciPy from point to point of the load."""
    times, loads = np.arange(6.0), np.array([0.0, 4, -6, 14, 20, 0])

    def far(_: float, x: Array) -> float:
        return float(x[0] - 0.5)

    far.terminal, far.direction = True, 1  # type: ignore[attr-defined]
    state, end = np.zeros(2), 0.0
    for first, last in pairwise(times):
        found = solve_ivp(
            lambda t, x: [x[1], (np.interp(t, times, loads) - 40 * x[0]) / 0.1],
            (first, last),
            state,
            "DOP853",
            rtol=1e-12,
            atol=1e-13,
            events=far,
        )
        state, end = found.y[:, -1], float(found.t[-1])
        if found.status == 1:
            break
    ran = mechc.loads(MEASURED, model="Line").simulate(inputs={"load": (times, loads)}, estimate_error=False)
    assert ran.time[-1] == pytest.approx(end, abs=1e-8)
    assert ran["der(wheel.angle)"][-1] == pytest.approx(state[1], abs=1e-7)
    assert ran["half.middle.angle"][-1] == pytest.approx(0.1, abs=1e-9)


GEARED = """
import mech.rotational.*;
Rotor rotor(J = 0.1 kg.m^2);
Node mid(angle ~ 0 rad);
Node hub(angle ~ 0 rad);
Rotor load(J = 0.03 kg.m^2, angle {start} 0 rad);
SpringDamper shaft(rotor.angle -> mid.angle, k = 100 N.m/rad, c = 1 N.m.s/rad);
SpringDamper belt(hub.angle -> load.angle, k = 30 N.m/rad, c = 0.2 N.m.s/rad);
{gear}
initial der(rotor.angle) = 1 rad/s;
experiment(stop = 1 s);
"""


@pytest.mark.parametrize("ratio", [1.0, 2.0, -3.0])
@pytest.mark.parametrize("start", ["=", "~"])
def test_a_gear_between_nodes_leaves_the_load_at_rest(ratio: float, start: str) -> None:
    """Dampers give the rate of the gear at the start; nothing strikes the load. SciPy with the reduced equations."""

    def motion(_: float, y: Array) -> list[float]:
        r, w, far, u, hub = y
        rate = (ratio * (w - 100 * (ratio * hub - r)) - 30 * (hub - far) + 0.2 * u) / (ratio**2 + 0.2)
        pull = 100 * (ratio * hub - r) + ratio * rate - w
        return [w, pull / 0.1, u, (30 * (hub - far) + 0.2 * (rate - u)) / 0.03, rate]

    expected = solve_ivp(motion, (0, 1), [0, 1, 0, 0, 0], "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    gear = f"Gear gear(mid.angle -> hub.angle, ratio = {ratio});"
    found = mechc.loads(GEARED.format(gear=gear, start=start)).simulate(tolerance=1e-10)
    names = ("rotor.angle", "der(rotor.angle)", "load.angle", "der(load.angle)", "hub.angle")
    assert found["der(load.angle)"][0] == 0
    assert [found[name][-1] for name in names] == pytest.approx(expected.tolist(), abs=1e-8)


@pytest.mark.parametrize("speeds", [(3.0, 2.0), (-2.5, -3.5), (0.8, 1.1), (4.0, 4.5)])
def test_a_law_that_falls_behind_its_peak_is_solved_near_the_speeds_beside_it(
    speeds: tuple[float, float],
) -> None:
    """A brake of 2 N.m x/(1 + x^2) pulls the hub along: of several rates with balance the run takes the one with little slip. SciPy."""
    model = mechc.loads(f"""
    import mech.rotational.*;
    Rotor driver(J = 0.1 kg.m^2);
    Rotor load(J = 0.03 kg.m^2);
    Node hub(angle ~ 0 rad);
    EddyCurrentBrake brake(driver.angle -> hub.angle);
    SpringDamper belt(hub.angle -> load.angle, c = 0.2 N.m.s/rad);
    initial der(driver.angle) = {speeds[0]} rad/s;
    initial der(load.angle) = {speeds[1]} rad/s;
    """)

    def carried(w: float, u: float) -> float:
        return float(brentq(lambda x: 2 * x / (1 + x * x) - 0.2 * (w - x - u), -0.7, 0.7, xtol=1e-14))

    def motion(_: float, y: Array) -> list[float]:
        x = carried(y[0], y[1])
        torque = 2 * x / (1 + x * x)
        return [-torque / 0.1, torque / 0.03, y[0] - x]

    expected = solve_ivp(motion, (0, 0.5), [*speeds, 0], "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    found = model.simulate(stop=0.5, tolerance=1e-10)
    names = ("der(driver.angle)", "der(load.angle)", "hub.angle")
    assert [found[name][-1] for name in names] == pytest.approx(expected.tolist(), abs=1e-8)


def test_a_start_moves_what_has_no_mass_onto_a_constraint() -> None:
    gear = "constraint mesh: mid.angle = hub.angle - 0.1 rad;"
    found = mechc.loads(GEARED.format(gear=gear, start="~")).simulate()
    begun = {
        name: found[name][0] for name in ("rotor.angle", "load.angle", "der(load.angle)", "der(hub.angle)")
    }
    assert begun == pytest.approx(
        {"rotor.angle": 0, "load.angle": 0, "der(load.angle)": 0, "der(hub.angle)": (1 - 3) / 1.2}, abs=1e-12
    )
