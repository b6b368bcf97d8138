"""Where mechc and the published references part: a third program, SciPy on equations written from the laws, says which of both is right.

The published rows are from the reference results of the Modelica Standard Library.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from modelica_table import EXAMPLES
from scipy.integrate import solve_ivp

import mechc

Vector = np.ndarray[Any, Any]
PATHS = {example.name: example.path for example in EXAMPLES}


# ---------------------------------------------------------------- masses at a hard stop

BEFORE = (-0.203039644380041, -0.60251755933916, 0.338296230362625, 0.584264703867529, -0.0942808237018486, -0.0746764055982867, -0.000515652108661502, -0.00180912203494132)  # fmt: skip
"""Published of Translational.HeatLosses at 0.41 s: ``read`` of ``state``."""
AFTER = {
    0.429: (-0.21346296762362, -0.492951739019218, 0.35, 0, -0.09519762472868, -0.0207282961514128, -0.000546195408590273, -0.0031568734885636),
    0.44: (-0.21851499823768, -0.425060944401519, 0.35, 0, -0.0952556108609974, 0.00928075025046162, -0.00061186122834197, -0.00616472403252082),
    0.46: (-0.225714055068081, -0.292912948514011, 0.35, 0, -0.0946220031413857, 0.0518064264602944, -0.000731144412587899, -0.0057479597162003),
    0.49: (-0.231265750760924, -0.0729359421480761, 0.35, 0, -0.0923598960911373, 0.0960889479780348, -0.000891789432506756, -0.00491593632062561),
}  # fmt: skip
"""Published after the impact of the last mass, with its hard stop at 0.35 m, at 0.4285494 s."""
READ = ("gap_", "gap_rate", "last.s", "der(last.s)", "span[1]", "rate[1]", "span[2]", "rate[2]")
Push = Callable[[float, float], float]


def state(read: Sequence[float]) -> list[float]:
    """Places and speeds of the four masses, from ends of bars of 0.1 m and the lengths of springs between them."""
    gap, gap_rate, last, rate, span1, rate1, span2, rate2 = read
    one = -gap + 0.05
    return [
        one,
        one + span1 + 0.1,
        last - span2 - 0.1,
        last,
        -gap_rate,
        -gap_rate + rate1,
        rate - rate2,
        rate,
    ]


def read(y: Vector) -> list[float]:
    x1, x2, x3, x4, v1, v2, v3, v4 = y
    return [-(x1 - 0.05), -v1, x4, v4, x2 - x1 - 0.1, v2 - v1, x4 - x3 - 0.1, v4 - v3]


def masses(t: float, y: Vector, push: Push | None) -> list[float]:
    """Newton's law of four masses of 1 kg while the gap is open, the brake released and the second one slides; ``push`` of the stop."""
    x1, x2, x3, x4, v1, v2, v3, v4 = y
    first = 100 * (x2 - x1 - 0.1) + 10 * (v2 - v1)
    middle = 100 * (x3 - x2 - 0.1)
    end = 1e4 * (x4 - x3 - 0.1) + 1e3 * (v4 - v3)
    rubbing = math.copysign(1 + 2 * math.exp(-abs(v4) / 0.5) + 0.5 * abs(v4), v4)
    last = -end - rubbing if push is None else -end + push(x4, v4)
    return [v1, v2, v3, v4, 20 * math.sin(2 * math.pi * t) - 10 * v1 + first, -first + middle - 1, -middle + end, last]  # fmt: skip


def touches(t: float, y: Vector, push: Push | None) -> float:
    return float(y[3] - 0.35)


touches.terminal = True  # type: ignore[attr-defined]


def after(time: float, y: Sequence[float], stiffness: float) -> Vector:
    """Quantities at the times of ``AFTER`` with a stop that is a spring and a damper: no law of impacts is assumed."""
    c = 2 * math.sqrt(stiffness)
    found = solve_ivp(masses, (time, 0.49), y, "Radau", list(AFTER), args=(lambda x, v: -stiffness * (x - 0.35) - c * v,), rtol=1e-8, atol=1e-11)  # fmt: skip
    return np.array([read(column) for column in found.y.T])


def test_a_mass_beside_one_that_meets_its_stop_keeps_its_speed() -> None:
    """From the published row before the impact SciPy goes on as mechc does; it gets the published rows if the neighbour is stopped, too."""
    way = solve_ivp(masses, (0.41, 0.5), state(BEFORE), "Radau", args=(None,), events=touches, rtol=1e-10, atol=1e-12)  # fmt: skip
    time, at = float(way.t[-1]), way.y[:, -1]
    assert time == pytest.approx(0.42854941954175, abs=1e-8)
    assert np.all(np.abs(at[4:]) > 0.4)  # all four move: no friction changes its side
    ours = mechc.load(PATHS["Translational.HeatLosses"]).simulate(
        stop=0.5, tolerance=1e-9, estimate_error=False
    )
    motion = np.array([[float(ours(t)[name]) for name in READ] for t in AFTER])
    published = np.array(list(AFTER.values()))
    later = [1, 2, 3]  # the damper between both is at rest after milliseconds
    # A stop of 1e8 N/m gives way by 1e-7 m and takes 1e-4 s: what is left of that is 1e-6 of the speeds.
    third = after(time, at, 1e8)
    assert motion[later] == pytest.approx(third[later], abs=2e-6)
    assert np.abs(published - third)[later][:, [5, 6]].max() > 3e-4

    stopped = at.copy()
    stopped[6] -= stopped[7]  # the third mass loses what the fourth one does, and their relative speed stays
    stopped[7] = 0
    assert after(time, stopped, 1e8)[later] == pytest.approx(published[later], abs=2e-6)
    force = abs(1e4 * read(at)[6] + 1e3 * read(at)[7])
    lost = at[6] - stopped[6]
    assert force < 7 and lost > 0.67  # N, and m/s of 1 kg: with that force it would take a tenth of a second


# ---------------------------------------------------------------- a bevel gear on a body that turns about three axes

PUBLISHED = {
    0.4: (21.7557411741496, -0.217114086026663, -2.75188326268699, 0.187424998659576),
    0.48: (27.3368730885897, 1.47593074035737, -0.644080264150158, 0.242732441202584),
    0.49: (28.5347072306765, 0.751159078823279, -2.51137498273094, 0.248129763724046),
}
"""Published of MultiBody.Rotational3DEffects.BevelGear1D: the three hinges and the slow shaft."""
ANGLES = ("r1.angle", "r2.angle", "r3.angle", "right.angle")


def bevel(t: float, y: Vector) -> list[float]:
    """Euler's equations of the cube with the rotors' momentum h, about the point on the three hinges, and the torques on their axes."""
    a, b, c, _, da, db, dc, slow = (float(v) for v in y)
    ca, sa, cb, sb, cc, sc = math.cos(a), math.sin(a), math.cos(b), math.sin(b), math.cos(c), math.sin(c)
    # Axes of the hinges in the body, and how they change.
    E = ((cb * cc, -cb * sc, sb), (sc, cc, 0.0))
    dE = ((-sb * cc * db - cb * sc * dc, sb * sc * db - cb * cc * dc, cb * db), (cc * dc, -sc * dc, 0.0))
    w = (E[0][0] * da + E[1][0] * db, E[0][1] * da + E[1][1] * db, E[0][2] * da + dc)
    turned = (dE[0][0] * da + dE[1][0] * db, dE[0][1] * da + dE[1][1] * db, dE[0][2] * da)
    m, d = 7.7, 0.05 / math.sqrt(3)  # its mass centre is at (d, d, d)
    inner, outer = 7.7 * 0.01 / 6 + 2 * m * d * d, -m * d * d  # moments and products of inertia

    def momentum(u: tuple[float, float, float]) -> tuple[float, float, float]:
        rest = outer * (u[0] + u[1] + u[2])
        return tuple((inner - outer) * v + rest for v in u)  # type: ignore[return-value]

    fast = 10 * slow
    L, change = momentum(w), momentum(turned)
    H = (L[0] + 1.1 * fast, L[1] + 18.2 * slow, L[2])
    up = (ca * sc + sa * sb * cc, ca * cc - sa * sb * sc, -sa * cb)  # y of the world in the body
    G = m * 9.80665
    weight = tuple(-G * d * (up[(i + 2) % 3] - up[(i + 1) % 3]) for i in range(3))
    bias = [change[i] + w[(i + 1) % 3] * H[(i + 2) % 3] - w[(i + 2) % 3] * H[(i + 1) % 3] - weight[i] for i in range(3)]  # fmt: skip
    axes = (E[0], E[1], (0.0, 0.0, 1.0))
    S = (11.0, 18.2, 0.0)
    M = np.empty((4, 4))
    right = np.empty(4)
    for i, axis in enumerate(axes):
        carried = momentum(axis)
        for k in range(i, 3):
            M[i, k] = M[k, i] = sum(carried[n] * axes[k][n] for n in range(3))
        M[i, 3] = M[3, i] = sum(S[n] * axis[n] for n in range(3))
        right[i] = (110 + 10 * i) * math.sin(2 * math.pi * (5 + i) * t) - sum(
            bias[n] * axis[n] for n in range(3)
        )
    M[3, 3] = 110 + 18.2
    right[3] = 1400 * math.sin(16 * math.pi * t) - sum(S[n] * turned[n] for n in range(3))
    return [da, db, dc, slow, *np.linalg.solve(M, right)]


def test_a_bevel_gear_near_its_singular_position() -> None:
    """SciPy's motion converges with its tolerance, and to that of mechc; the published rows are off by a thousand times the rest."""
    times, near = list(PUBLISHED), np.linspace(0.47, 0.48, 51)
    every = np.union1d(times, near)
    rows = np.searchsorted(every, times)
    coarse, fine = (
        solve_ivp(bevel, (0, every[-1]), np.zeros(8), "DOP853", every, rtol=tol, atol=tol / 100).y
        for tol in (1e-8, 1e-10)
    )
    assert np.abs(np.cos(fine[1])).min() < 0.04 and np.abs(fine[4]).max() > 3000  # rad/s of the first hinge
    assert np.abs(coarse - fine)[:4, rows].max() < 2e-5
    ours = mechc.load(PATHS["MultiBody.Rotational3DEffects.BevelGear1D"]).simulate(
        stop=times[-1], tolerance=1e-10, estimate_error=False
    )
    motion = np.array([[float(ours(t)[name]) for t in times] for name in ANGLES])
    assert motion == pytest.approx(fine[:4, rows], abs=2e-7)
    off = np.abs(np.array(list(PUBLISHED.values())).T - fine[:4, rows]).max(axis=0)
    assert 1e-4 < off[0] < 1e-3 and off[1] > 5e-3 and off[2] > 1e-3
