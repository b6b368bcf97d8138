"""Guesses from outside: those that decide nothing, that miss an end, that are far away, and curves that are zero."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import pytest

import mechc
from mechc.runtime.curves.found import CurveSolution


def solve(text: str, **options: Any) -> CurveSolution:
    found: CurveSolution = mechc.loads(text).solve(**options)
    return found


CHAIN = """
model Chain
  parameter w = 10 N/m;
  parameter L = 3 m;
  independent x from 0 m to 2 m;
  coordinate z ~ {guess};
  initial z = 0 m;
  final z = {end};
  stationary integral(w*z*sqrt(1 + der(z)^2));
  constraint length: integral(sqrt(1 + der(z)^2)) = L;
end Chain;
"""


def chain(length: float, end: float) -> float:
    """The potential energy of z = z0 + c cosh((x - x0)/c) through (0, 0) and (2, end)."""
    straight = mp.log(mp.sqrt(mp.mpf(length) ** 2 - mp.mpf(end) ** 2))
    c = mp.findroot(lambda c: mp.log(2 * c * mp.sinh(1 / c)) - straight, (0.05, 2), solver="anderson")
    x0 = 1 - c * mp.asinh(end / (2 * c * mp.sinh(1 / c)))
    z0 = -c * mp.cosh(x0 / c)
    area = mp.quad(lambda x: (z0 + c * mp.cosh((x - x0) / c)) * mp.cosh((x - x0) / c), [0, 1, 2])
    return float(10 * area)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("guess", "length", "end"),
    [("0 m", 3, 0), ("0 m", 20, 0), ("x/2", 4, 1), ("0.1 m*sin(pi*x/1 m)", 6, 0)],
)
def test_a_guess_that_decides_nothing_is_bent_both_ways(guess: str, length: float, end: float) -> None:
    text = CHAIN.format(guess=guess, end=f"{end} m")
    found = solve(text, set={"L": length})
    exact = chain(length, end)
    assert abs(found.stationary - exact) <= 30 * found.error <= 1e-9 * abs(exact)
    assert found.kind == "minimum"
    (said,) = found.remarks
    assert "the guess itself leads to no curve" in said
    assert "leads to another one, with the value" in said


def test_an_end_that_a_guess_misses_is_told() -> None:
    found = solve(CHAIN.format(guess="-0.1*x", end="0 m"))
    assert found.remarks == [
        "the guess does not meet 'final z': it was bent to do so",
        "the guess is far from 'length', which the curve meets",
    ]
    assert solve(CHAIN.format(guess="-x*(2 m - x)/1 m", end="0 m")).remarks == []


def test_a_value_of_zero_is_no_doubt() -> None:
    found = solve("""
        model Zero
          dimensionless;
          independent x from 0 to 1;
          coordinate y ~ x*(1 - x);
          initial y = 0;
          final y = 0;
          stationary integral(der(y)^2);
        end Zero;
    """)
    assert abs(found.stationary) < 1e-30
    assert found.outcome.value == "completed"


FILM = """
model Film
  independent x from 0 m to 2 m;
  coordinate z ~ {guess};
  initial z = 2 m;
  final z = 2 m;
  stationary integral(z*sqrt(1 + der(z)^2));
end Film;
"""


@pytest.mark.slow
@pytest.mark.parametrize("guess", ["2 m", pytest.param("2 m - x*(2 m - x)/1 m", marks=pytest.mark.slow)])
def test_both_films_are_found_from_either_side(guess: str) -> None:
    exact = []
    for start in (1.7, 0.47):
        c = mp.findroot(lambda c: c * mp.cosh(1 / c) - 2, start)
        exact.append(float(c + c**2 / 2 * mp.sinh(2 / c)))
    found = mechc.loads(FILM.format(guess=guess)).solve(all=True)
    assert sorted(s.stationary for s in found.solutions[0]) == pytest.approx(exact, rel=1e-12)


def test_what_belongs_to_a_motion_is_refused(tmp_path) -> None:  # type: ignore[no-untyped-def]
    from click import UsageError
    from click.testing import CliRunner

    from mechc.cli.run import command

    file = tmp_path / "film.mech"
    file.write_text(FILM.format(guess="2 m"))
    for option in (["--reproducible"], ["--snapshot", "1"], ["--animate", "a.mp4"]):
        with pytest.raises(UsageError, match=option[0]):
            CliRunner().invoke(command, [str(file), *option], catch_exceptions=False, standalone_mode=False)


def elastica(p: float, mode: int) -> float:
    """theta'' + p sin(theta) = 0 from a clamped to a free end: quarter waves of a pendulum, (2 mode - 1) of them."""
    m = mp.findroot(lambda m: (2 * mode - 1) * mp.ellipk(m) - mp.sqrt(p), (0.01, 0.999999), solver="anderson")
    quarters, k = 2 * mode - 1, mp.ellipk(m)
    # theta'^2 / 2 = p (cos(theta) - cos(end)), and the mean of cos(theta) is 2 E/K - 1
    end = 1 - 2 * m
    mean = 2 * mp.ellipe(m) / k - 1
    assert abs(quarters * k / mp.sqrt(p) - 1) < 1e-9
    return float(p * (2 * mean - end))


@pytest.mark.slow
@pytest.mark.parametrize(
    "guess",
    ["0", pytest.param("1", marks=pytest.mark.slow), pytest.param("sin(pi*s/2)", marks=pytest.mark.slow)],
)
def test_four_bent_rods_and_the_straight_one(guess: str) -> None:
    """Under p = 30, above (3 pi/2)^2, the rod bends to either side in two ways; the straight one has two ways down."""
    (found,) = (
        mechc.loads(f"""
        model Elastica
          dimensionless;
          parameter P = 30;
          independent s from 0 to 1;
          coordinate theta ~ {guess};
          initial theta = 0;
          stationary integral(1/2*der(theta)^2 + P*cos(theta));
        end Elastica;
    """)
        .solve(all=True)
        .solutions
    )
    values = sorted((s.stationary, s.negative_directions) for s in found)
    first, second = elastica(30, 1), elastica(30, 2)
    assert [n for _, n in values] == [0, 0, 1, 1, 2]
    for (value, _), exact in zip(values, [first, first, second, second, 30.0], strict=True):
        assert abs(value - exact) < 1e-9 * 30
    signs = {round(float(s["theta"][-1]), 3) for s in found}
    assert len(signs) == 5


@pytest.mark.slow
def test_both_arcs_of_a_great_circle_each_once() -> None:
    """The speed along them is free: curves that are passed differently are the same. The long arc goes beyond the other pole."""
    found = mechc.loads("""
        model Sphere
          dimensionless;
          independent s from 0 to 1;
          coordinate r[3] ~ {1 - s, s, 0.3*s*(1 - s)};
          initial r = {1, 0, 0};
          final r = {0, 0.6, 0.8};
          constraint surface: dot(r, r) = 1;
          stationary integral(norm(der(r)));
        end Sphere;
    """).solve(all=True)
    arcs = [(s.stationary, s.negative_directions) for s in found.solutions[0]]
    assert arcs == [(pytest.approx(mp.pi / 2, rel=1e-9), 0), (pytest.approx(3 * mp.pi / 2, rel=1e-9), 1)]


def test_a_corner_at_the_border_of_an_element_is_doubted() -> None:
    """As long as it shall be, sqrt(1 + y'^2) times its multiplier bends the other way than y'^2/2: corners may be anywhere."""
    text = """
model Stretched
  dimensionless;
  independent s from 0 to 4.0656;
  coordinate q ~ -0.355*2.11;
  initial q = 0.544*2.11;
  final q = -0.0178*2.11;
  let weight = 0.0598*(if s > 1.1099 then 3.15 else 1.86);
  let stiffness = if s > 0.789*4.0656 then 1.819 else 1.43;
  let slope = der(q)*2.42/2.11;
  stationary integral(stiffness*slope^2/2 - weight*q/2.11)/2.42 - 0.196044*at(cos(q/2.11), 0.85784);
  constraint length: integral(sqrt(1 + slope^2))/2.42 = 2.01533;
end Stretched;
"""
    found = solve(text)
    assert found.outcome.value == "doubtful"
    assert "the curve has a corner at s = " in found.remarks[-1]
