"""Period and action by integration: against closed forms, and what it refuses."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from scipy.special import ellipk
from shared_models import example

import mechc
from mechc.runtime.studies.findings import Findings

ONE = """\
model One
  dimensionless;
  parameter m = 1;
  coordinate x = {start};
  kinetic {mass}/2*der(x)^2;
  potential {potential};
end One;
"""


def one(potential: str, start: float = 0.1, mass: str = "m", **settings: object) -> Findings:
    found = mechc.loads(ONE.format(potential=potential, start=start, mass=mass)).period(**settings)
    assert isinstance(found, Findings)
    return found


def within(found: Findings, name: str, expected: float) -> None:
    """The stated error holds, and is small."""
    (value,) = (value for value in found.values if value.name == name)
    assert value.error is not None and value.error < 1e-10 * max(1.0, abs(expected))
    assert abs(value.value - expected) <= max(value.error, 4e-16 * abs(expected))


def test_a_pendulum_is_an_elliptic_integral() -> None:
    """T = 4 K(sin(a/2)) at the amplitudes a."""
    model = mechc.loads(ONE.format(potential="-cos(x)", start=0.1, mass="m"))
    for amplitude in ("0.001", "1", "3", "3.14"):  # of the smallest, rounding of cos leaves 1e-10
        found = model.period(set={"x": float(amplitude)})
        exact = 4 * mpmath.ellipk(mpmath.sin(mpmath.mpf(float(amplitude)) / 2) ** 2)
        (period,) = (value for value in found.values if value.name == "period")
        # the start is a number of the machine: its rounding moves a period near the separatrix by dT/da
        loose = 1e-11 if amplitude == "3.14" else 1e-13
        assert abs(period.value - float(exact)) <= max(period.error, loose * float(exact))


def test_the_slope_of_the_action_beside_a_separatrix() -> None:
    """dJ/dE of the double well at 1e-6 above its saddle, where the depth is 1/4: T = 4 K(m)/w of
    x = A cn(w t), A^2 = 1 + sqrt(1 + 4 E), w^2 = A^2 - 1, m = A^2/(2 w^2). A fixed step of the energy leads beyond the saddle: 1573."""
    found = one("x^4/4 - x^2/2", start=1.5, energy=1e-6)
    (remark,) = (text for text in found.remarks if "dJ/dE" in text)
    slope = float(remark.partition(" is ")[2].partition(":")[0])
    A2 = 1 + math.sqrt(1 + 4e-6)
    exact = 4 * ellipk(A2 / (2 * (A2 - 1))) / math.sqrt(A2 - 1)
    assert slope == pytest.approx(exact, rel=1e-6)
    assert found.details["period"] == pytest.approx(exact, rel=1e-10)


def test_a_rotor_of_twice_the_energy() -> None:
    """Beyond the separatrix the period of a turn is 2 K(2/(1 + e)) sqrt(2/(1 + e)): 3.3132763 at 2, 2.0021548 at 5."""
    model = example("rotor")
    for energy, stated in ((2, 3.3132763), (5, 2.0021548)):
        found = model.period(set={"energy": energy})
        assert found["period"] == pytest.approx(stated, abs=5e-8)
        m = mpmath.mpf(2) / (1 + energy)
        within(found, "period", float(2 * mpmath.sqrt(m) * mpmath.ellipk(m)))
        assert found.summary()["turning_points"] == [] and found.summary()["turns"]


@pytest.mark.slow
def test_turning_points_and_the_series_of_a_rotor() -> None:
    """U75: a pendulum turns at acos(-e), its period is 4 int dx/sqrt(2 (e + cos(x))), endless at e = 1; U76: (pi/sqrt(2 e)) (2 +
    3/8 e^-2 + 105/512 e^-4) is 2.0021455 at e = 5, 3.3089883 at 2."""
    for energy in (-0.9, 0.3, 0.99):
        low, high = one("-cos(x)", energy=energy).summary()["turning_points"]
        assert high == -low == pytest.approx(math.acos(-energy), rel=1e-12)
        # 2 (e + cos(x)) = 4 sin((c + x)/2) sin((c - x)/2), x = c (1 - s^2), so that the root at the end goes
        c = mpmath.acos(-energy)
        part = mpmath.quad(
            lambda s, c=c: s / mpmath.sqrt(4 * mpmath.sin(c - c * s * s / 2) * mpmath.sin(c * s * s / 2)),
            [0, 1],
        )
        assert one("-cos(x)", energy=energy)["period"] == pytest.approx(float(8 * c * part), rel=1e-11)
    for energy, words in ((-1, "it is -1 at rest, at x = 0"), (1, "has no finite period")):
        with pytest.raises(mechc.SimulationError, match=words):
            one("-cos(x)", energy=energy)
    model = example("rotor")
    for energy, stated, next_term in ((5.0, 2.0021455, 1.5 * 5.0**-6), (2.0, 3.3089883, 1.5 * 2.0**-6)):
        series = math.pi / math.sqrt(2 * energy) * (2 + 3 / 8 * energy**-2 + 105 / 512 * energy**-4)
        assert series == pytest.approx(stated, abs=5e-8)
        assert abs(model.period(set={"energy": energy})["period"] - series) < next_term


@pytest.mark.parametrize("energy", [1e-6, 0.5, 10.0, 1e4])
def test_a_well_with_hard_walls(energy: float) -> None:
    """V = tan(x)^2: T = 2 pi sqrt(m/(2 (1 + E))), J = 2 pi sqrt(2 m) (sqrt(1 + E) - 1)."""
    found = one("tan(x)^2", energy=energy)
    exact = 2 * math.pi / math.sqrt(2 * (1 + energy))
    assert found["period"] == pytest.approx(exact, rel=1e-12 if energy < 1e3 else 1e-9)
    action = 2 * math.pi * math.sqrt(2) * energy / (math.sqrt(1 + energy) + 1)
    assert found["action"] == pytest.approx(action, rel=1e-9)
    low, high = found.summary()["turning_points"]
    assert high == -low == pytest.approx(math.atan(math.sqrt(energy)), rel=1e-12)


def test_the_oscillator_has_the_action_energy_over_frequency() -> None:
    """J/2 pi = E/w, with a mass that depends on the place in another coordinate: x = sinh s."""
    found = one("2*x^2", energy=3.0)
    within(found, "action/2pi", 3.0 / 2.0)
    bent = one("2*sinh(x)^2", mass="cosh(x)^2", energy=3.0)
    within(bent, "action/2pi", 3.0 / 2.0)
    within(bent, "period", math.pi)


@pytest.mark.parametrize("degree", [4, 6, 20])
def test_power_laws(degree: int) -> None:
    """V = |x|^n: T = 4 sqrt(pi/2) Gamma(1 + 1/n)/Gamma(1/2 + 1/n) at E = 1, scaling as E^(1/n - 1/2)."""
    exact = 4 * math.sqrt(math.pi / 2) * math.gamma(1 + 1 / degree) / math.gamma(0.5 + 1 / degree)
    for energy in (1.0, 16.0):
        found = one(f"x^{degree}", energy=energy)
        within(found, "period", exact * energy ** (1 / degree - 0.5))


@pytest.mark.slow
@pytest.mark.slow
@pytest.mark.parametrize("start", [-0.4, 0.0001])
def test_a_valley_whose_force_jumps(start: float) -> None:
    """V = 2 |x| + 3 max(0, x - 1/10): pieces of constant force."""
    energy = 2 * abs(start)
    period = 4 * math.sqrt(2 * energy) / 2
    if energy > 0.2:
        first, second = math.sqrt(2 * energy), math.sqrt(2 * (energy - 0.2))
        period = 2 * (first / 2 + (first - second) / 2 + second / 5)
    found = one("2*abs(x) + 3*max(0, x - 1/10)", start, "1")
    (value,) = (value for value in found.values if value.name == "period")
    assert value.error is not None and value.error < 1e-8
    assert abs(value.value - period) <= value.error


def test_a_mass_on_a_table_with_a_string_through_a_hole() -> None:
    """U153: the angle between two nearest points is 2 pi sqrt(lambda) 0.54621613 at e = 3, where r1 = 0.4421253 as printed; it goes to
    2 pi sqrt(lambda/3) towards the least energy, 3/2 at r = 1."""
    model = example("table_hole_string")
    for ratio in (2.0, 3.0):
        found = model.period(set={"lambda": ratio})
        assert found.summary()["turning_points"] == pytest.approx([0.4421253, 2.9422419], abs=2e-7)
        turns = found.summary()["advance"]["phi"] / (2 * math.pi)
        assert turns == pytest.approx(math.sqrt(ratio) * 0.54621613, abs=3e-8)
        assert turns == pytest.approx({2.0: 0.77246626, 3.0: 0.94607409}[ratio], abs=5e-9)
    for energy, turns in ((4.7407578, 3 / 4), (1.9172399, 4 / 5)):  # closed orbits at lambda = 2
        found = model.period(set={"lambda": 2}, energy=energy)
        assert found.summary()["advance"]["phi"] / (2 * math.pi) == pytest.approx(turns, abs=1e-8)
    for ratio in (2.0, 3.0):  # nearly a circle
        found = model.period(set={"lambda": ratio}, energy=1.500001)
        assert found.summary()["advance"]["phi"] / (2 * math.pi) == pytest.approx(
            math.sqrt(ratio / 3), abs=1e-7
        )
    with pytest.raises(mechc.SimulationError, match=r"it is 1.5 at rest, at r = 1;"):
        model.period(energy=1.4999)
    for ratio, turns in ((1.8853565, 3 / 4), (1.4896644, 2 / 3), (3.3517449, 1.0)):  # closed orbits
        found = model.period(set={"lambda": ratio})
        assert found.summary()["advance"]["phi"] / (2 * math.pi) == pytest.approx(turns, abs=3e-8)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [2.0, 3.0])
def test_a_mass_that_the_string_hardly_holds(ratio: float) -> None:
    """Of the same system: pi sqrt(lambda) between two nearest points at large energies."""
    found = example("table_hole_string").period(set={"lambda": ratio}, energy=1e6)
    assert found.summary()["advance"]["phi"] / (2 * math.pi) == pytest.approx(math.sqrt(ratio) / 2, abs=1e-7)


def test_a_kepler_orbit_closes() -> None:
    """In polar coordinates: T = 2 pi a^1.5, and the angle advances by a turn."""
    text = """\
model Kepler
  dimensionless;
  coordinate r = 0.5;
  coordinate phi = 0;
  initial der(phi) = sqrt(1.5/0.5^3);
  kinetic 1/2*(der(r)^2 + r^2*der(phi)^2);
  potential -1/r;
end Kepler;
"""
    found = mechc.loads(text).period()
    assert found["period"] == pytest.approx(2 * math.pi, rel=1e-12)
    assert found["advance of phi"] == pytest.approx(2 * math.pi, rel=1e-12)
    assert found.summary()["turning_points"] == pytest.approx([0.5, 1.5], rel=1e-13)


def test_a_rotating_hoop_keeps_another_energy() -> None:
    """A bead beyond the fork swings about its angle: T2 - T0 + V is what is constant, as the motion itself shows."""
    text = """\
model Hoop
  dimensionless;
  coordinate theta = 1.3;
  kinetic 1/2*(der(theta)^2 + 2*sin(theta)^2);
  potential -cos(theta);
  experiment(stop = 60, tolerance = 1e-12);
end Hoop;
"""
    model = mechc.loads(text)
    found = model.period()
    low, high = found.summary()["turning_points"]
    assert high == pytest.approx(1.3, rel=1e-14) and 0 < low < math.acos(0.5) < high
    run = model.section(where="der(theta) = 0", direction="down", count=5)
    assert np.diff(run.arrays["time"]) == pytest.approx(found["period"], rel=1e-9)


def test_what_has_no_period_is_refused() -> None:
    def refused(text: str, words: str, **settings: object) -> None:
        with pytest.raises(mechc.SimulationError, match=words):
            mechc.loads(text).period(**settings)

    text = ONE.format(potential="x^2", start=1, mass="m")
    refused(text, "no motion with the energy -1: it is .* at rest, at x", energy=-1)
    refused(text.replace("end", "damping 0.001 on x; end"), "does not keep its energy")
    refused(text.replace("end", "force 0.01*sin(time) on x; end"), "does not keep its energy")
    refused(ONE.format(potential="-1/(1+x^2)", start=0, mass="m"), "does not come back", energy=1)
    refused(ONE.format(potential="0*x", start=0, mass="m"), "depend on no coordinate")
    refused(ONE.format(potential="x^2", start=1, mass="(1+der(x)^2)"), "quadratic")
    for name, words in (
        ("kepler", "x, y, which are not cyclic"),
        ("bouncing_ball", "switches"),
        ("pendulum_cartesian", "constraints"),
    ):
        with pytest.raises(mechc.SimulationError, match=words):
            example(name).period()
    with pytest.raises(mechc.UsageMistake, match="given in N"):
        example("pendulum").period(energy="3 N")


@pytest.mark.parametrize(
    "more",
    [
        "state w = 0; equation der(w) = x - w; force -2*w on x;",  # a force that lags: the rest is unstable
        "state w = 0; equation der(w) = x; potential w*x;",
        "coordinate w = 0; damping 2 on w; potential 1/2*5*(x - w)^2;",  # without mass: a state
    ],
)
def test_what_moves_in_further_states_has_no_period(more: str) -> None:
    """The states begin at rest where they do nothing, and the integral would take them as constant."""
    text = ONE.format(potential="x^2", start=1, mass="m").replace("end", more + " end")
    with pytest.raises(mechc.SimulationError, match="states of first order beside its coordinates: w"):
        mechc.loads(text).period()


def test_a_state_that_only_follows_does_not_matter() -> None:
    text = ONE.format(potential="x^2", start=1, mass="m")
    own, followed = (
        mechc.loads(text.replace("end", more + " end")).period()
        for more in ("", "state w = 0; equation der(w) = x;")
    )
    assert followed["period"] == own["period"]
    assert any("w: left out" in remark for remark in followed.remarks)


WELLS = "-1/2*x^2 + 1/4*x^4"
"""Two wells, with an unstable rest between them whose energy is 0."""


@pytest.mark.parametrize(
    ("potential", "start", "words"),
    [
        ("-cos(x)", math.pi, "begins at an unstable rest, x = 3.141593:"),
        ("-cos(x)", math.pi - 1e-10, "begins at an unstable rest, x = 3.141593:"),
        (WELLS, 0.0, "begins at an unstable rest, x = 0:"),
        (WELLS, math.sqrt(2), "moves towards an unstable rest, x = 0:"),
        ("-x^4 + x^6", 1.0, "moves towards an unstable rest, x = 0:"),
    ],
)
def test_motions_to_an_unstable_rest_have_no_period(potential: str, start: float, words: str) -> None:
    with pytest.raises(mechc.SimulationError, match=words):
        one(potential, start=start)


def test_near_an_unstable_rest_as_many_digits_are_said_as_are_known() -> None:
    """A pendulum from 0.002 short of upright lasts 4 K: its error leaves eight digits of the sentence."""
    found = one("-cos(x)", start=math.pi - 2e-3)
    (period,) = (value for value in found.values if value.name == "period")
    exact = float(4 * mpmath.ellipk(mpmath.sin(mpmath.mpf(math.pi - 2e-3) / 2) ** 2))
    said = found.message.removeprefix("period ")
    assert period.error is not None and abs(period.value - exact) <= period.error
    last = 10.0 ** -len(said.partition(".")[2])
    assert period.error <= last <= 10 * period.error and abs(float(said) - exact) <= 2 * last


def test_kinds_of_numbers() -> None:
    joule = example("pendulum").period(energy="-5 J")
    assert joule["energy"] == -5.0


@pytest.mark.parametrize("energy", [0.9, 1.01, 2.0])
def test_a_particle_on_a_sphere_turns_back_before_the_poles(energy: float) -> None:
    """At a pole the angle about the axis moves nothing. Period by the quadrature of (ds/dt)^2 = 4 (2 (E - 1 + s) s - p^2)(1 - s), s = sin^2."""
    found = example("particle_on_sphere").period(set={"E": energy})
    roots = np.roots([2, 2 * (energy - 1), -0.25])
    low, other = roots.max(), roots.min()
    # from s = low at the turning point to 1 at the equator and back, twice: an elliptic integral
    whole = 4 * ellipk((1 - low) / (1 - other)) / math.sqrt(8 * (1 - other)) * 2
    assert found.details["period"] == pytest.approx(whole, rel=1e-9)
