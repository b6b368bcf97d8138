"""Modes of small motions against closed forms, and two ways to them against each other."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf, polyroots, sin
from numpy.typing import NDArray

import mechc
from mechc.cli.main import run as run_command
from mechc.runtime.outcome import SimulationError
from mechc.runtime.studies.kinds.linearize import Linearization
from mechc.runtime.studies.kinds.modes import FoundModes

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "physics" / "data" / "normal_modes_set.json"
Array = NDArray[np.float64]

CHAIN = """\
model Chain
  dimensionless;
  structural parameter Integer n = 3;
  coordinate Real x[n];
  kinetic 1/2*sum(der(x[i])^2 for i in 1:n);
  potential 1/2*x[1]^2 + 1/2*x[n]^2 + 1/2*sum((x[i+1] - x[i])^2 for i in 1:n-1);
end Chain;
"""
HANGING = """\
model Hanging
  dimensionless;
  structural parameter Integer n = 3;
  coordinate Real a[n];
  let Real x[n] = {sum(sin(a[j]) for j in 1:i) for i in 1:n};
  let Real y[n] = {-sum(cos(a[j]) for j in 1:i) for i in 1:n};
  kinetic 1/2*sum(der(x[i])^2 + der(y[i])^2 for i in 1:n);
  potential sum(y[i] for i in 1:n);
end Hanging;
"""


TURNED = """\
model Turned
  dimensionless;
  coordinate a = 0; coordinate x = 0;
  drive der(a) = 2;
  kinetic 1/2*der(x)^2;
  potential 1/2*(x - cos(a))^2;
end Turned;
"""


def modes(model: mechc.Model, **settings: Any) -> FoundModes:
    found = model.study("modes", **settings)
    assert isinstance(found, FoundModes)
    return found


def check(found: FoundModes, wanted: Any, relative: float = 1e-12) -> None:
    """Compare frequencies; each stated error contains its own, and is below the relative bound."""
    wanted = np.sort(np.array(wanted, dtype=float))
    errors = np.array([mode["error"] for mode in found.details["modes"]])
    assert found.frequencies.shape == wanted.shape
    assert (np.abs(found.frequencies - wanted) <= np.maximum(errors, 2e-16 * wanted)).all()
    scale = np.where(wanted > 0, wanted, np.inf)
    assert (np.abs(found.frequencies - wanted) <= relative * scale + np.where(wanted > 0, 0, errors)).all()
    assert (errors <= relative * np.where(wanted > 0, wanted, 1e6)).all()


@pytest.mark.parametrize(
    "case", json.loads(DATA.read_text(encoding="utf-8"))["references"], ids=lambda c: c["case"][:24]
)
def test_the_reference(case: dict[str, Any]) -> None:
    """Thirty digits of chains of springs, hanging chains, double pendulums and coupled pendulums."""
    name, values = case["case"], {k: float(v) for k, v in case["values"].items()}
    wanted = [np.sqrt(v) if k.startswith("omega^2") else v for k, v in values.items()]
    if name.startswith("hanging chain of n="):
        model = mechc.loads(HANGING).with_values({"n": len(wanted)})
    elif "n+1 equal springs" in name:
        model = mechc.loads(CHAIN).with_values({"n": len(wanted)})
    elif name.startswith("double pendulum equal masses"):
        model = mechc.loads(HANGING).with_values({"n": 2})
    elif name.startswith("point double pendulum"):
        model = mechc.loads(HANGING.replace("potential sum", "potential 9.81*sum")).with_values({"n": 2})
    elif name.startswith("thesis"):
        model = mechc.load(ROOT / "examples" / "double_pendulum_bars.mech", set=THESIS)
    elif name.startswith("three pendulums"):
        model = mechc.loads("""\
model Three
  dimensionless;
  coordinate Real a[3];
  kinetic 1/2*sum(der(a[i])^2 for i in 1:3);
  potential 1/2*9.81*sum(a[i]^2 for i in 1:3) + 1/2*2*sum((a[i+1] - a[i])^2 for i in 1:2);
end Three;
""")
    else:
        assert name.startswith("continuous hanging chain")
        return  # no model of finitely many masses
    check(modes(model, at="start" if not name.startswith("thesis") else "equilibrium"), wanted)


THESIS: dict[str, Any] = {}


def test_a_chain_of_springs() -> None:
    """P17: 2 sin(k pi/(2(n + 1))); shapes are sines; also T7."""
    n = 40
    found = modes(mechc.loads(CHAIN).with_values({"n": n}))
    mp.dps = 30
    check(found, [float(2 * sin(mp.pi * k / (2 * (n + 1)))) for k in range(1, n + 1)])
    j = np.arange(1, n + 1)
    for k in range(n):
        shape = np.sin((k + 1) * np.pi * j / (n + 1)) * np.sqrt(2 / (n + 1))
        assert min(np.abs(found.shapes[:, k] - shape).max(), np.abs(found.shapes[:, k] + shape).max()) < 1e-12


@pytest.mark.slow
def test_a_chain_of_400() -> None:
    """Its stiffness has the condition 6.5e4: without correction the lowest frequency is off by 1e-12 and more."""
    n = 400
    found = modes(mechc.loads(CHAIN).with_values({"n": n}))
    mp.dps = 30
    wanted = np.array([float(2 * sin(mp.pi * k / (2 * (n + 1)))) for k in range(1, n + 1)])
    assert (np.abs(found.frequencies / wanted - 1) < 1e-14).all()
    assert max(mode["error"] / w for mode, w in zip(found.details["modes"], wanted, strict=True)) < 1e-10


def test_the_sources() -> None:
    """P14: k/m and 7k/m. T20: 0, and 3k/m twice. V10: g/l and g/l + k (1/m1 + 1/m2)."""
    three = mechc.load(ROOT / "examples" / "three_springs.mech")
    p = values(three)
    check(modes(three), [np.sqrt(p["k"] / p["m"]), np.sqrt(7 * p["k"] / p["m"])])
    ring = mechc.load(ROOT / "examples" / "ring_of_masses.mech")
    p = values(ring)
    found = modes(ring)
    check(found, [0.0, *[np.sqrt(3 * p["k"] / p["m"])] * 2])
    assert found.details["degenerate"] == [[2, 3]]
    assert any("modes 2, 3 have one frequency" in r for r in found.remarks)
    assert any("nothing brings back mode 1" in r for r in found.remarks)
    pair = mechc.load(ROOT / "examples" / "coupled_pendulums.mech")
    p = values(pair)
    check(modes(pair), np.sqrt([p["g"] / p["l"], p["g"] / p["l"] + p["k"] * (1 / p["m1"] + 1 / p["m2"])]))


def values(model: mechc.Model) -> dict[str, float]:
    from mechc.runtime.case import SimulationOptions
    from mechc.runtime.local.operating_point import site_of
    from mechc.runtime.settings import Place
    from mechc.runtime.studies.kinds.modes import FindModes

    site = site_of(model.problem(parts=FindModes.needs), SimulationOptions(), Place())
    return {q.name: float(v) for q, v in zip(model.parameters, site.p, strict=False)}


@pytest.mark.parametrize("n", [4, 7])
def test_a_ring_has_pairs(n: int) -> None:
    """2 sin(pi k/n), each twice but for k = 0 and, for even n, k = n/2."""
    text = f"""\
model Ring
  dimensionless;
  coordinate Real x[{n}];
  kinetic 1/2*sum(der(x[i])^2 for i in 1:{n});
  potential 1/2*sum((x[i+1] - x[i])^2 for i in 1:{n - 1}) + 1/2*(x[1] - x[{n}])^2;
end Ring;
"""
    found = modes(mechc.loads(text))
    check(found, [2 * abs(np.sin(np.pi * k / n)) for k in range(n)])
    assert len(found.details["degenerate"]) == (n - 1) // 2


def test_damping_and_a_rotor() -> None:
    """A damped oscillator, overdamped too; a Jeffcott rotor in the turning frame, whose whirls are w0 + n and w0 - n."""
    found = modes(mechc.load(ROOT / "examples" / "damped_oscillator.mech"))
    assert len(found.eigenvalues) == 1 and 0 < found.dampings[0] < 1
    text = "model D dimensionless; coordinate x = 0; kinetic 1/2*der(x)^2; potential 2*x^2; damping 5 on x; end D;"
    over = modes(mechc.loads(text))
    assert np.abs(over.eigenvalues - [-1, -4]).max() < 1e-14 and (over.dampings == 1).all()
    rotor = """\
model Rotor
  dimensionless;
  parameter n = 0.7;
  coordinate x = 0; coordinate y = 0;
  kinetic 1/2*((der(x) - n*y)^2 + (der(y) + n*x)^2);
  potential 1/2*(x^2 + y^2);
end Rotor;
"""
    for speed in (0.3, 0.7, 2.5):
        found = modes(mechc.loads(rotor).with_values({"n": speed}))
        assert np.abs(np.sort(found.frequencies) - np.sort([1 + speed, abs(1 - speed)])).max() < 1e-14
        assert np.abs(found.eigenvalues.real).max() < 1e-14


def test_a_loop_and_its_twin() -> None:
    """A pendulum of two constraints swings as it does without any; a slider-crank at its dead centre as by hand."""
    loop = """\
model Loop
  dimensionless;
  coordinate x = 0.3; coordinate y = -sqrt(1 - 0.3^2);
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential 9.81*y;
  constraint x^2 + y^2 = 1;
end Loop;
"""
    found = modes(mechc.loads(loop))
    check(found, [np.sqrt(9.81)])
    assert abs(found.at["x"]) < 1e-15 and abs(found.at["y"] + 1) < 1e-15
    crank = """\
import mech.planar.*;
model SliderCrank
  Bar crank(m = 0.5 kg, l = 10 cm);
  Bar rod(m = 0.4 kg, l = 30 cm);
  Body piston(m = 0.8 kg);
  Revolute main(world -> crank.a, angle = 2 deg);
  Revolute big_end(crank.b -> rod.a, angle ~ -3 deg);
  Prismatic guide(world -> piston.a, axis = {1, 0}, position ~ 40 cm);
  Revolute small_end(rod.b -> piston.a);
  potential 1/2*(500 N/m)*(guide.position - 30 cm)^2;
end SliderCrank;
"""
    found = modes(mechc.loads(crank), at="main.angle = 0, big_end.angle = 0")
    r, length = 0.1, 0.3
    # outstretched: s = r + l - r (1 + r/l) a^2/2, the rod turns by -a r/l, and its centre moves by r a/2 across
    stiffness = -500 * 0.1 * r * (1 + r / length)
    inertia = 0.5 * r**2 / 3 + 0.4 * length**2 / 12 * (r / length) ** 2 + 0.4 * (r / 2) ** 2
    wanted = np.emath.sqrt(stiffness / inertia)
    assert abs(found.eigenvalues[0] - abs(wanted)) < 1e-12 * abs(wanted)
    assert found.dampings[0] == -1


def test_a_state_beside_the_coordinates() -> None:
    """A lag in the spring: three eigenvalues, those of the whole system."""
    text = """\
model Lag
  dimensionless;
  coordinate x = 0; state f = 0;
  kinetic 1/2*der(x)^2; potential 1/2*x^2;
  equation der(f) = -3*(f + 2*x);
  force f on x;
end Lag;
"""
    found = modes(mechc.loads(text))
    mp.dps = 30
    roots = [complex(r) for r in polyroots([mpf(1), 3, 1, 9])]
    for root in roots:
        if root.imag >= 0:
            assert np.abs(found.eigenvalues - root).min() < 1e-13


def test_mistakes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pendulum = mechc.load(ROOT / "examples" / "pendulum.mech")
    with pytest.raises(SimulationError, match="not an equilibrium, so that small motions"):
        modes(pendulum, at="theta = 20 deg")
    with pytest.raises(SimulationError, match="depends on time"):
        modes(mechc.load(ROOT / "examples" / "forced_oscillator.mech"))
    with pytest.raises(SimulationError, match="is driven"):
        modes(mechc.loads(TURNED))
    standing = modes(pendulum, at="theta = 180 deg")
    assert standing.eigenvalues[0].real > 0 and standing.eigenvalues[0].imag == 0
    picture = tmp_path / "modes.png"
    file = str(ROOT / "examples" / "coupled_pendulums.mech")
    assert run_command(["study", "modes", file, "--json", "--plot", str(picture)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [set(mode["shape"]) for mode in found["modes"]] == [{"th1", "th2"}] * 2
    assert {"frequency", "damping", "eigenvalue", "shape"} <= set(found["modes"][0]) and picture.exists()


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.mech")), ids=lambda p: p.stem)
def test_examples_against_poles(path: Path) -> None:
    """The equations before and after they are solved for accelerations have the same eigenvalues at equilibria."""
    model = mechc.load(path)
    try:
        found = modes(model)
    except SimulationError:
        return
    at_rest = {entry.name: 0.0 for entry in model.compilation.equations.states if entry.kind == "rate"}
    try:
        wanted = model.study("linearize", at={**at_rest, **found.at})
    except SimulationError:
        return
    assert isinstance(wanted, Linearization)
    scale = max(1e-6, float(np.abs(wanted.poles).max(initial=0.0)))
    both = np.concatenate([found.eigenvalues, found.eigenvalues.conj(), -found.eigenvalues])
    for pole, error in zip(wanted.poles, wanted.details["accuracy"]["errors"]["poles"], strict=True):
        if abs(pole) > 1e-6 * scale:
            stated = float(max(found.details["accuracy"]["errors"]["frequencies"], default=0.0))
            assert np.abs(both - pole).min() < 1e-7 * scale + 100 * (error or 1e-3 * scale) + 2 * stated


def test_a_beam_on_two_supports() -> None:
    """Masses with the curvature of differences: 4 sin(k pi/(2 (n + 1)))^2, to the k^2 of the beam for low k."""
    n = 30
    text = f"""\
model Beam
  dimensionless;
  coordinate Real w[{n}];
  kinetic 1/2*sum(der(w[i])^2 for i in 1:{n});
  potential 1/2*sum((w[i-1] - 2*w[i] + w[i+1])^2 for i in 2:{n - 1}) + 1/2*(w[2] - 2*w[1])^2
    + 1/2*(w[{n - 1}] - 2*w[{n}])^2;
end Beam;
"""
    mp.dps = 30
    wanted = [float(4 * sin(mp.pi * k / (2 * (n + 1))) ** 2) for k in range(1, n + 1)]
    found = modes(mechc.loads(text))
    assert (np.abs(found.frequencies / wanted - 1) < 1e-12).all()
    errors = np.array([mode["error"] for mode in found.details["modes"]])
    assert (np.abs(found.frequencies - wanted) <= np.maximum(errors, 2e-16)).all()


@pytest.mark.slow
def test_a_loop_of_six_hinges_in_space() -> None:
    """Bricard's mechanism at rest, against positions and rotations of its bars by hand, in 40 digits."""
    found = modes(mechc.load(ROOT / "examples" / "bricard.mech"))
    (mode,) = found.details["modes"]
    with mp.workdps(40):
        wanted = float(_bricard_frequency())
    assert abs(found.frequencies[0] - wanted) < 1e-12 * wanted
    assert abs(found.frequencies[0] - wanted) <= max(mode["error"], 2e-16)


SIZES = ((1, 0.1, 0.1), (0.1, 1, 0.1), (0.1, 0.1, 1), (1, 0.1, 0.1), (0.1, 1, 0.1))
PINS = ((1, (-1, 0, 0)), (2, (0, 1, 0)), (0, (0, 0, -1)), (1, (1, 0, 0)), (2, (0, -1, 0)))
"""Of each bar the axis of its first hinge, and where that sits, in halves of the bar; the other is opposite."""


def _bars(q: Any) -> list[tuple[Any, Any]]:
    """Give centre and rotation of the bars for the angles of the first five hinges."""
    at, turned, bars = mp.matrix(3, 1), mp.eye(3), []
    for angle, (axis, place) in zip(q, PINS, strict=True):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        turn = mp.eye(3)
        turn[j, j] = turn[k, k] = mp.cos(angle)
        turn[k, j], turn[j, k] = mp.sin(angle), -mp.sin(angle)
        turned = turned * turn
        arm = turned * mp.matrix(place) / 2
        bars.append((at - arm, turned))
        at = at - 2 * arm
    return bars


def _open(q: Any) -> Any:
    """What is open at the sixth hinge: its place, and its axis beside x."""
    centre, turned = _bars(q)[-1]
    end = centre + turned * mp.matrix([0, mpf(1) / 2, 0]) - mp.matrix([0, 0, 1])
    return mp.matrix([*end, turned[1, 0], turned[2, 0]])


def _closed(first: Any) -> list[Any]:
    """Close the loop for an angle of the first hinge, near the position of the example."""
    rest = mp.matrix([-mp.pi / 6, first, -mp.pi / 6, first])
    for _ in range(60):
        base = _open([first, *rest])
        slope = mp.matrix(5, 4)
        for k in range(4):
            moved = rest.copy()
            moved[k] += mpf(10) ** -18
            slope[:, k] = (_open([first, *moved]) - base) * mpf(10) ** 18
        step = mp.lu_solve(slope.T * slope, slope.T * base)
        rest -= step
        if mp.norm(step) < mpf(10) ** -34:
            return [first, *rest]
    raise AssertionError("the loop does not close")


def _bricard_frequency() -> Any:
    """sqrt(V''/M) along the closed loop where V' = 0, by differences."""

    def potential(first: Any) -> Any:
        return mpf("9.81") * sum(centre[1] for centre, _ in _bars(_closed(first)))

    def slope(first: Any, h: Any) -> Any:
        return (potential(first + h) - potential(first - h)) / (2 * h)

    h = mpf(10) ** -9
    rest = mp.findroot(lambda a: slope(a, h), (mp.pi / 2, mp.pi / 2 + mpf("0.01")), tol=1e-25)
    curvature = (potential(rest + h) - 2 * potential(rest) + potential(rest - h)) / h**2
    mass = mpf(0)
    here = _bars(_closed(rest))
    behind, before = _bars(_closed(rest - h)), _bars(_closed(rest + h))
    for size, (_, turned), (c0, r0), (c1, r1) in zip(SIZES, here, behind, before, strict=True):
        v, spin = (c1 - c0) / (2 * h), turned.T * (r1 - r0) / (2 * h)
        omega = (spin[2, 1], spin[0, 2], spin[1, 0])
        squares = [mpf(repr(s)) ** 2 for s in size]
        inertia = [(sum(squares) - s) / 12 for s in squares]
        mass += sum(x**2 for x in v) + sum(j * w**2 for j, w in zip(inertia, omega, strict=True))
    return mp.sqrt(curvature / mass)
