"""Exponents over parameters and starts: against eigenvalues, SciPy, and motions that are followed one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shared_models import example

import mechc
from mechc.runtime.numerics.growth_rates import megno, times_of

KEPT = "lyapunov(time)"
DAMPED = """\
model Damped
  dimensionless;
  parameter k = 1;
  parameter c = 0.2;
  coordinate x = 1;
  kinetic 1/2*der(x)^2;
  potential k/2*x^2;
  damping c on x;
  experiment(stop = 400);
end Damped;
"""
FOLLOWED = DAMPED.replace("  experiment", "  state s = 0;\n  equation der(s) = x^2;\n  experiment")


@pytest.mark.parametrize("text", [DAMPED, FOLLOWED], ids=["alone", "with an integral that follows"])
def test_linear_systems_have_their_eigenvalues(text: str) -> None:
    """The larger real part of s^2 + c s + k = 0, also where it is unstable; the growth swings by at most ln 4 around it."""
    found = mechc.loads(text).lyapunov(over={"k": [-0.2, 0.5, 1.0], "c": [0.1, 0.3, 3.0]})
    k, c = found["k"], found["c"]
    exact = np.roots
    wanted = np.vectorize(lambda k, c: exact([1, c, k]).real.max())(k, c)
    assert np.abs(found[KEPT] - wanted).max() < 2 * np.log(4) / (0.9 * 400)
    assert (np.abs(found[KEPT] - wanted) <= np.maximum(found.error(KEPT), 1e-6)).all()
    assert ((found["megno(time)"] > 4) == (k < 0)).all()


def test_fixed_points_of_lorenz_have_their_eigenvalues() -> None:
    """The origin for r < 1; beyond, (+-sqrt(b (r-1)), ..., r-1), whose cubic is in every textbook; 0.9056 at 28."""
    found = example("lorenz").lyapunov(over={"r": [0.5, 10.0, 28.0]}, time=400)
    s, b = 10.0, 8 / 3
    wanted = [
        (-(s + 1) + np.sqrt((s + 1) ** 2 - 4 * s * (1 - 0.5))) / 2,
        np.roots([1, s + b + 1, b * (s + 10), 2 * s * b * 9]).real.max(),
        0.9056,
    ]
    assert np.abs(found[KEPT][:2] - wanted[:2]).max() < 2 * np.log(30) / 360
    assert abs(found[KEPT][2] - wanted[2]) < 1.5 * found.error(KEPT)[2] < 0.1


def test_scipy_finds_the_same_growth() -> None:
    """The same change of three stars of Hénon and Heiles by variational equations in SciPy, over a time in which digits last."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        x, z, vx, vz, a, b, c, d = y
        return [vx, vz, -x - 2 * x * z, -z - x * x + z * z, c, d, -(1 + 2 * z) * a - 2 * x * b, -2 * x * a - (1 - 2 * z) * b]  # fmt: skip

    starts, given = [0.1, 0.2, 0.3], {"q1": 0.05, "der(q1)": 0.1, "der(q2)": 0.3}
    found = example("henon_heiles").lyapunov(over={"q2": starts}, time=30, set=given, tolerance=1e-11)
    golden = (5**0.5 - 1) / 2
    change = 0.5 + golden * np.arange(1, 5) % 1
    change /= np.linalg.norm(change)
    for value, start in zip(found[KEPT], starts, strict=True):
        begin = [0.05, start, 0.1, 0.3, *change]
        flow = solve_ivp(rates, (0, 30), begin, method="DOP853", rtol=1e-12, atol=1e-13, t_eval=[3, 30])
        early, late = np.log(np.linalg.norm(flow.y[4:], axis=0))
        assert value == pytest.approx((late - early) / 27, abs=1e-8)


def test_a_body_turns_over_about_its_middle_axis() -> None:
    """Euler: w*sqrt((I2 - I1)*(I3 - I2)/(I1*I3)) about the middle axis, a tenth left out, over 27 s, of which the first third still turns the change."""
    text = """\
model Tossed
  parameter J[3] = {2, 3, 4.5} kg.m^2;
  coordinate Rotation R;
  initial der(R) = {0, 1, 0} rad/s;
  frame body = world * R;
  inertia diag(J) on body;
  experiment(stop = 60 s);
end Tossed;
"""
    found = mechc.loads(text).lyapunov(over={"der(R)[2]": [1.0, 2.0]}, time=30)
    rate = np.sqrt((3 - 2) * (4.5 - 3) / (2 * 4.5))
    assert found[KEPT] == pytest.approx(np.array([1, 2]) * rate, abs=np.log(1.3) / 27)


def test_lanes_and_threads_tell_the_same() -> None:
    model = example("henon_heiles")
    asked: dict[str, Any] = {
        "vary": "q2 = -0.1 .. 0.1, 6",
        "keep": f"{KEPT}, final(q2)",
        "stop": 300,
        "errors": "none",
    }
    one, other = (model.ensemble(**asked, lanes=lanes) for lanes in ("on", "off"))
    assert one[KEPT] == pytest.approx(other[KEPT], abs=1e-5)
    assert one["final(q2)"] == pytest.approx(other["final(q2)"], abs=1e-6)
    beside = model.ensemble(**{**asked, "keep": f"q2, {KEPT}"}, every=2, lanes="off")
    assert beside["q2"].shape == (6, 151)
    assert np.abs(beside[KEPT] - other[KEPT]).max() <= np.maximum(beside.error(KEPT), other.error(KEPT)).max()


SAMPLED = DAMPED.replace("damping c on x", "damping 0.5 on x").replace(
    "  experiment",
    "  discrete f = 0;\n  when sample(0.5) then f := -c*x; end when;\n  force f on x;\n  experiment",
)


def test_motions_on_constraints_are_followed_one_by_one() -> None:
    found = example("pendulum_cartesian").lyapunov(over={"x": [0.6, 0.9]}, time=60)
    assert (np.abs(found[KEPT]) <= found.error(KEPT)).all() and "one after the other" in found.remarks[-1]
    assert (found["megno(time)"] < 4).all()
    with pytest.raises(mechc.SimulationError, match="smooth motions, and 'Damped' has events"):
        mechc.loads(SAMPLED).ensemble(vary={"c": [0.2]}, keep=KEPT)


@pytest.mark.slow
def test_motions_across_events_are_followed_one_by_one() -> None:
    """As the study without ``over`` follows them."""
    over = mechc.loads(SAMPLED).lyapunov(over={"c": [0.2]}, time=100)
    alone = mechc.loads(SAMPLED).lyapunov(time=100, set={"c": 0.2})
    assert over[KEPT][0] == pytest.approx(alone.details["exponents"][0], abs=0.02)


def test_what_cannot_be_asked() -> None:
    model = mechc.loads(DAMPED)
    with pytest.raises(mechc.SimulationError, match="leave 'count' out"):
        model.lyapunov(over={"c": [0.2]}, count=2)
    with pytest.raises(mechc.UsageMistake, match=r"'lyapunov' is of the whole run, not of 'x'"):
        model.ensemble(vary={"c": [0.2]}, keep="lyapunov(x)")
    sized = mechc.loads(DAMPED.replace("parameter k", "structural parameter n = 2;\n  parameter k"))
    with pytest.raises(mechc.UsageMistake, match="'n' is structural"):
        sized.lyapunov(over={"n": [2, 3]})
    with pytest.raises(mechc.SimulationError, match="20 times are too few"):
        model.ensemble(vary={"c": [0.2]}, keep="x, lyapunov(time)", every=400 / 19)


def test_methods_that_follow_no_changes_give_way() -> None:
    """As in the study without ``over``: what is not a method for whatever has rates is followed by dop853."""
    model = mechc.loads(DAMPED.replace("damping c on x;", "force -c*x on x;"))
    asked: dict[str, Any] = {"over": {"c": [0.2, 0.4]}, "time": 20}
    one, other = model.lyapunov(**asked), model.lyapunov(**asked, method="verlet", step=0.01)
    assert (one[KEPT] == other[KEPT]).all() and other.method == "dop853"


def test_factors_tell_powers_from_exponentials() -> None:
    """2 p for t^p, rate*t/2 for exponentials (Cincotta and Simó 2000), within what the few times leave."""
    times = times_of(0.0, 1000.0)
    growth = np.stack([np.log1p(times), 2 * np.log1p(times), 0.05 * times, -0.05 * times], axis=1)
    assert megno(times, growth) == pytest.approx([2, 4, 25, -25], rel=0.1)
