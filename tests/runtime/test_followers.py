"""States that only follow the motion: studies of the motion leave them out, and what is asked of them is still told."""

from __future__ import annotations

import numpy as np
import pytest

import mechc

FOLLOWING = """
  output I = integral(x^2);
  output J = integral(integral(x));
  state s = 0; equation der(s) = x + time;
  state f = 0; equation der(f) = x - f;
  discrete Integer n = 0;
  when x < 0.2 then n := n + 1; end when;
  when s > 1e6 then terminate("far"); end when;
"""
LINES = {"alone": "", "followed": FOLLOWING}

DAMPED = """
model Damped
  dimensionless;
  parameter k = 0;
  coordinate x(min = -5, max = 5) = 2;
  kinetic 1/2*der(x)^2; potential 1/2*(x - 1)^2; damping 0.3 on x;
  {lines}
  experiment(stop = 2);
end Damped;
"""
POLES = -0.15 + 1j * np.sqrt(1 - 0.15**2) * np.array([1, -1])
"""Of x'' + 0.3 x' + x = 1, at rest at x = 1."""


def names(text: str) -> set[str]:
    problem = mechc.loads(text).problem()
    return {problem.states[k].name for k in problem.followers}


def as_complex(pairs: object) -> list[complex]:
    return sorted((complex(*pair) for pair in pairs), key=lambda z: (z.real, z.imag))  # type: ignore[attr-defined]


@pytest.mark.parametrize("lines", LINES)
def test_an_equilibrium_is_that_of_the_motion(lines: str) -> None:
    (found,) = mechc.loads(DAMPED.format(lines=LINES[lines])).equilibria().summary()["equilibria"]
    assert found["values"] == {"x": pytest.approx(1, abs=1e-12)} and found["stable"]
    assert as_complex(found["eigenvalues"]) == pytest.approx(sorted(POLES, key=lambda z: z.imag), abs=1e-12)


@pytest.mark.parametrize("lines", LINES)
def test_modes_are_those_of_the_motion(lines: str) -> None:
    found = mechc.loads(DAMPED.format(lines=LINES[lines])).modes()
    (mode,) = found.summary()["modes"]
    assert (mode["frequency"], mode["damping"]) == pytest.approx((1, 0.15), abs=1e-12)
    assert ("s, f: left out, as the motion does not depend on them" in found.remarks) is (lines == "followed")


@pytest.mark.parametrize("lines", LINES)
def test_multipliers_exponents_and_volumes_are_those_of_the_motion(lines: str) -> None:
    model = mechc.loads(DAMPED.format(lines=LINES[lines]))
    multipliers = as_complex(model.floquet(period=2).summary()["multipliers"])
    assert multipliers == pytest.approx(sorted(np.exp(2 * POLES), key=lambda z: z.imag), abs=1e-8)
    assert model.volume()["rate"] == pytest.approx(-0.3, abs=1e-8)
    exponents = model.lyapunov(time=40).summary()["exponents"]
    assert len(exponents) == 2 and sum(exponents) == pytest.approx(-0.3, abs=1e-6)


def test_an_orbit_is_that_of_the_motion() -> None:
    """Duffing's oscillator x'' + x + x^3 = 0 from x = 1: the period is an elliptic integral."""
    text = """
    model Duffing
      dimensionless;
      coordinate x = 1;
      kinetic 1/2*der(x)^2; potential 1/2*x^2 + 1/4*x^4;
      output I = integral(x^2);
      output J = integral(cos(time));
      experiment(stop = 20);
    end Duffing;
    """
    from scipy.special import ellipk

    found = mechc.loads(text).orbit()
    assert found["period"] == pytest.approx(4 * ellipk(0.25) / np.sqrt(2), rel=1e-10)
    assert set(found.summary()["start"]) == {"x", "der(x)"}
    assert as_complex(found.summary()["multipliers"]) == pytest.approx([1, 1], abs=1e-4)


def test_a_steady_motion_and_a_portrait_are_those_of_the_motion() -> None:
    text = """
    model Kepler
      dimensionless;
      coordinate r(min = 0.1) = 1.2;
      coordinate phi = 0;
      initial der(phi) = 1/1.44;
      kinetic 1/2*(der(r)^2 + r^2*der(phi)^2); potential -1/r;
      output I = integral(r);
    end Kepler;
    """
    (found,) = mechc.loads(text).steady().summary()["steady"]
    assert found["values"] == {"r": pytest.approx(1), "der(phi)": pytest.approx(1)}
    followed = DAMPED.format(lines="output I = integral(x^2);")
    assert "1 stable focus" in mechc.loads(followed).portrait().message


def test_an_integral_that_a_force_reads_stays() -> None:
    lines = "force -0.2*integral(x - 1) on x; output I = integral(x);"
    text = DAMPED.format(lines=lines)
    assert names(text) == {"integral[2]"}
    (found,) = mechc.loads(text).equilibria().summary()["equilibria"]
    wanted = sorted(np.roots([1, 0.3, 1, 0.2]), key=lambda z: (z.real, z.imag))
    assert as_complex(found["eigenvalues"]) == pytest.approx(wanted, abs=1e-9)


def test_what_is_observed_of_a_follower_is_still_told() -> None:
    """The integral of x^2 at x = 2 grows by 4 x beside it."""
    model = mechc.loads(DAMPED.format(lines="input F = 0; force F on x; output I = integral(x^2);"))
    found = model.linearize()
    assert [q.name for q in found.states] == ["x", "der(x)", "integral[1]"]
    assert found.A[2] == pytest.approx([4, 0, 0])
    assert np.sort_complex(found.poles) == pytest.approx(np.sort_complex([0, *POLES]), abs=1e-12)
    other = model.linearize(outputs="x")
    assert np.sort_complex(other.poles) == pytest.approx(np.sort_complex(POLES), abs=1e-12)


@pytest.mark.parametrize(
    ("lines", "following"),
    [
        ("state s = 0; equation der(s) = x;", {"s"}),
        ("state s = 0; equation der(s) = x; force -0.1*s on x;", set()),
        ("state s = 0; equation der(s) = x; state r = 0; equation der(r) = s; force -r on x;", set()),
        ("state s = 0; equation der(s) = x; damping 0.1*s^2 on x;", set()),
        ("state s = 0; equation der(s) = x; when s > 1 then terminate(\"far\"); end when;", {"s"}),
        ("state s = 0; equation der(s) = x; when s > 1 then reinit(der(x), 0); end when;", set()),
        ("state s = 0; equation der(s) = x; when x > 1 then reinit(s, 0); end when;", {"s"}),
        ("state s = 0; equation der(s) = x; discrete Integer n = 0; when s > 1 then n := n + 1; end when;", {"s"}),
        ("state s = 0; equation der(s) = x; discrete Real n = 0; when s > 1 then n := s; end when; force n on x;", set()),
        ("state s = 0; equation der(s) = x; force if s > 1 then 1 else 0 on x;", set()),
        ("state s = 0.5; equation der(s) = x; contact wall: x - s restitution 0.5;", set()),
    ],
)  # fmt: skip
def test_what_the_motion_depends_on_is_found_through_events(lines: str, following: set[str]) -> None:
    assert names(DAMPED.format(lines=lines)) == following


@pytest.mark.parametrize(
    ("equations", "following"),
    [
        ("der(x) = y; der(y) = -x; der(s) = x^2", {"s"}),
        ("der(x) = -x; der(y) = x - y; der(s) = y; der(r) = s", {"s", "r"}),
        ("der(x) = time; der(y) = x; der(s) = y; der(r) = s", set()),
    ],
)
def test_without_coordinates_the_motion_is_what_acts_on_itself(equations: str, following: set[str]) -> None:
    states = {part.split("(")[1][0] for part in equations.split(";")}
    body = "".join(f"state {name} = 1; " for name in sorted(states))
    body += "".join(f"equation {part.strip()}; " for part in equations.split(";"))
    assert names(f"model First dimensionless; {body} end First;") == following
