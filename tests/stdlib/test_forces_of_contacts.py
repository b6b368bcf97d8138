"""Forces and points of contacts: against the momenta and moments of momentum of the bodies, from their motion alone."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

import mechc

Array = NDArray[np.float64]
DOWN = np.array([0, 0, -9.81])


def impulses(s: mechc.Solution, names: tuple[str, ...], gravity: Array) -> Array:
    """The integrals of outputs over time, by Gauss's rule between events, and that of a constant vector."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    ends = sorted({s.time[0], *(e.time for e in s.events), s.time[-1]})
    total = gravity * (s.time[-1] - s.time[0])
    for a, b in pairwise(ends):
        parts = a + (b - a) * (1 - np.cos(np.linspace(0, np.pi, 41))) / 2  # fine where a slip ends
        for part, width in zip(parts, np.diff(parts), strict=False):
            found = s(part + width * (1 + nodes) / 2)
            total = total + width / 2 * np.array([weights @ found[name] for name in names])
    return np.asarray(total)


def change(s: mechc.Solution, names: tuple[str, ...]) -> Array:
    return np.array([s[name][-1] - s[name][0] for name in names])


def vector(name: str) -> tuple[str, ...]:
    return tuple(f"{name}[{k}]" for k in (1, 2, 3))


BLOCK = """
model Block
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  coordinate Length z = 0 m;
  initial der(x) = 1.2 m/s;
  initial der(y) = 0.9 m/s;
  kinetic 1/2*2 kg*(der(x)^2 + der(y)^2 + der(z)^2);
  potential 2 kg*9.81 m/s^2*z;
  force 2 N*max(0, time/1 s - 1) on x;
  contact floor: GAP friction 0.3 LAW along {der(x), der(y)};
  output f[:] = multiplier(floor.friction);
  output STICKS;
  output lost = power(floor.friction);
  experiment(stop = 5 s, tolerance = 1e-10);
end Block;
"""


@pytest.mark.parametrize("gap", ["z", "min(z, z + x/10)"])
def test_the_friction_of_a_contact_has_a_name(gap: str) -> None:
    """A block slides, sticks, is pulled by 2 N (t - 1) and slides where that is mu m g; also where its gap has two parts, of
    which the other is open."""
    text = BLOCK.replace("GAP", gap).replace(" LAW", "")
    s = mechc.loads(text.replace("STICKS", "stuck = if closed(floor.friction) then 1 else 0")).simulate(
        estimate_error=False
    )
    limit, stops, slides = 0.3 * 2 * 9.81, 1.5 / (0.3 * 9.81), 1 + 0.3 * 9.81
    before, held, after = (s(t) for t in (stops / 2, 2.0, slides + 0.5))
    assert [before[f"f[{k}]"] for k in (1, 2)] == pytest.approx([-0.8 * limit, -0.6 * limit], abs=1e-7)
    assert before["lost"] == pytest.approx(-limit * 0.75, abs=1e-7)
    assert [held[n] for n in ("f[1]", "f[2]", "lost")] == pytest.approx([-2, 0, 0], abs=1e-9)
    assert [after[n] for n in ("f[1]", "f[2]")] == pytest.approx([-limit, 0], abs=1e-7)
    assert [v["stuck"] for v in (before, held, after)] == [0, 1, 0]


def test_the_friction_of_a_contact_by_a_smooth_law() -> None:
    text = BLOCK.replace("GAP", "z").replace("LAW along", "along")
    text = text.replace("der(y)};", 'der(y)}, law = "regularized", v_stick = 1 mm/s;')
    s = mechc.loads(text.replace("STICKS", "w = multiplier(floor)")).simulate(estimate_error=False)
    v = np.hypot(s["der(x)"], s["der(y)"])
    assert s["f[1]"] == pytest.approx(-0.3 * s["w"] * np.tanh(v / 1e-3) * s["der(x)"] / v, abs=1e-9)


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ("multiplier(roof.friction)", "the contact 'roof' has no friction"),
        ("multiplier(floor.friction[1])", "the friction of 'floor' is asked about as a whole"),
        ("multiplier(floor.frictoin)", "'floor.frictoin' is none"),
        ("closed(x.friction)", "'x.friction' is none"),
    ],
)
def test_what_has_no_friction_of_this_name_is_told(asked: str, says: str) -> None:
    text = (
        BLOCK.replace("GAP", "z").replace(" LAW", "").replace("STICKS", f"stuck = if {asked} then 1 else 0")
    )
    with pytest.raises(mechc.CompileError, match=re.escape(says)):
        mechc.loads(text.replace("  experiment", "  contact roof: 1 m - z;\n  experiment"))


CRATE = """
import mech.spatial.*;
import mech.shapes.*;
model M
  gravity {0, 0, -9.81} m/s^2;
  Box crate(size = {0.4, 0.3, 0.2} m, m = 2 kg);
  frame slope = world * roty(15 deg);
  Free free(slope * rotz(25 deg) -> crate.a, position = {0, 0, 0.1} m, der(position) = {-1.5, 0.4, 0} m/s,
            der(orientation) = {0, 0, 2} rad/s);
  shape Box(size = crate.size) on crate;
  shape Plane on slope;
  contact c: crate with slope friction 0.4;
  output p[3] = 2 kg*vel(crate.a);
  output spin[3] = direction(crate.a, inertia_tensor(crate.a)*components(crate.a, angvel(crate.a)));
  output F[3] = {sum(c.force[i, k] for i in 1:8) for k in 1:3};
  output T[3] = {sum(cross(c.c[i] - pos(crate.a), c.force[i, :])[k] for i in 1:8) for k in 1:3};
  output stuck = sum(if closed(c.touch[i].friction) and closed(c.touch[i]) then 1 else 0 for i in 1:8);
  output lost = sum(power(c.touch[i].friction) for i in 1:8);
  experiment(stop = 1 s, tolerance = 1e-11);
end M;
"""


@pytest.mark.slow
def test_a_crate_that_slides_spins_and_stays() -> None:
    """Four corners with friction in two directions: momentum, moment of momentum about the centre, energy; then its weight."""
    s = mechc.loads(CRATE).simulate(estimate_error=False)
    assert not [e for e in s.events if e.kind == "impact"]
    assert 0.2 < s.events[0].time < 0.3
    assert change(s, vector("p")) == pytest.approx(impulses(s, vector("F"), 2 * DOWN), abs=1e-8)
    assert change(s, vector("spin")) == pytest.approx(impulses(s, vector("T"), 0 * DOWN), abs=1e-8)
    assert impulses(s, ("lost",), np.zeros(1))[0] == pytest.approx(-s["energy.dissipated"][-1], abs=1e-8)
    rest = [s[name][-1] for name in (*vector("F"), *vector("T"))]
    assert rest == pytest.approx([0, 0, 2 * 9.81, 0, 0, 0], abs=1e-9)
    assert s["stuck"][0] == 0
    assert s["stuck"][-1] == 4


HEAP = """
import mech.SPACE.*;
import mech.shapes.*;
model M
  structural parameter Integer n = COUNT;
  structural parameter Integer d = AXES;
  gravity {if k == d then -9.81 m/s^2 else 0 for k in 1:d};
  BALLS;
  shape Sphere(r = 5 cm) on ball;
  shape floor: Plane on world;
  shape wall: Plane on world * TURN;
  contact b: ball with ball friction 0.4;
  contact g: ball with floor, wall friction 0.4;
  output p[d] = {0.1 kg*vel(ball[1].a)[k] for k in 1:d} "momentum of the first ball";
  output F[d] = {sum(g[i].force[1, k] for i in 1:2) - sum(b[i].force[k] for i in 1:n - 1) for k in 1:d};
  output P[d] = {sum(0.1 kg*vel(ball[i].a)[k] for i in 1:n) for k in 1:d} "of all";
  output A[d] = {sum(g[i].force[1, k] for i in 1:2*n) for k in 1:d};
  experiment(stop = 0.5 s, SETTING);
end M;
"""
DISKS = "Disk ball[n](r = 5 cm, m = 0.1 kg); Free free[i in 1:n](world -> ball[i].a, x = 0.06 m*i, y = 0.1 m + 0.1 m*mod(i, 3))"
SPHERES = (
    "Body ball[n](m = 0.1 kg, J = 1e-4*identity(3) kg.m^2); Free free[i in 1:n](world -> ball[i].a, "
    "position = {0.06 m*i, 0.01 m*mod(i, 2), 0.1 m + 0.1 m*mod(i, 3)}, der(position) = {0.1, 0.2, 0} m/s)"
)


def heap(space: str, count: int, setting: str) -> mechc.Solution:
    plane = space == "planar"
    text = HEAP
    for word, value in (
        ("SPACE", space),
        ("COUNT", str(count)),
        ("AXES", "2" if plane else "3"),
        ("BALLS", DISKS if plane else SPHERES),
        ("TURN", "rot(-60 deg)" if plane else "roty(60 deg)"),
        ("SETTING", setting),
    ):
        text = text.replace(word, value)
    s = mechc.loads(text).simulate(estimate_error=False)
    assert s.outcome.value == "completed", s.message
    return s


@pytest.mark.parametrize("count", [3, pytest.param(7, marks=pytest.mark.slow)])
def test_disks_in_a_heap(count: int) -> None:
    """Between two impacts the momenta of one ball and of all change by their forces; with 7 balls these have no formula."""
    s = heap("planar", count, "tolerance = 1e-11")
    hits = [*(e.time for e in s.events if e.kind == "impact"), s.time[-1]]
    k = int(np.argmax(np.diff(hits)))
    a, b = hits[k] + 1e-9, hits[k + 1] - 1e-9
    nodes, weights = np.polynomial.legendre.leggauss(24)
    ends = [a, *sorted({e.time for e in s.events if a < e.time < b}), b]
    found = np.zeros(4)
    for p, q in pairwise(ends):
        values = s((p + q) / 2 + (q - p) / 2 * nodes)
        found += (q - p) / 2 * np.array([weights @ values[f"{n}[{i}]"] for n in "FA" for i in (1, 2)])
    found += 0.1 * (b - a) * np.array([0, -9.81, 0, -9.81 * count])
    first, last = s(a), s(b)
    changes = [last[f"{n}[{i}]"] - first[f"{n}[{i}]"] for n in "pP" for i in (1, 2)]
    assert max(abs(s[f"F[{i}]"]).max() for i in (1, 2)) > 0.5
    assert changes == pytest.approx(found, abs=1e-8)


@pytest.mark.slow
def test_balls_in_a_heap_by_steps() -> None:
    """Each step changes momenta by its mean force, with friction in two directions; results have that of the step before, along
    the normals of their own time: those of planes do not turn, those of balls by some 1 mm in 100 mm."""
    s = heap("spatial", 7, 'method = "moreau", step = 1 ms, every = 1 ms')
    assert np.diff(s.time) == pytest.approx(1e-3, abs=1e-12)
    for momentum, force, balls, off in (("p", "F", 1, 1e-2), ("P", "A", 7, 1e-10)):
        p, f = (np.transpose([s[name] for name in vector(n)]) for n in (momentum, force))
        change = np.diff(p, axis=0)[:-1] / 1e-3 - 0.1 * balls * DOWN
        assert np.abs(f).max() > 100
        assert np.abs(f[:, :2]).max() > 5
        assert np.abs(change - f[2:]).max() < off * np.abs(f).max()
