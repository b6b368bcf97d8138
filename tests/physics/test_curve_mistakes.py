"""Models of curves that are wrong, and what is said of them; and numbers of the whole that read each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from refusals import refused

import mechc

LINE = """
model Line
  parameter a = 0 m;
  independent x from a to {upper};
  coordinate z ~ {guess};
  {ends}
  stationary integral({integrand});
  {more}
end Line;
"""

ENDS = "initial z = 0 m; final z = 1 m;"


def line(
    more: str = "",
    integrand: str = "sqrt(1 + der(z)^2)",
    ends: str = ENDS,
    guess: str = "x",
    upper: str = "1 m",
) -> str:
    return LINE.format(upper=upper, guess=guess, ends=ends, integrand=integrand, more=more)


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        (line("output k = sample(0 m, 0.1 m);"), "E0552", "'sample()' is an instant, and a curve has none"),
        (line("output k = if initial() then 1 else 0;"), "E0552", "'initial()' is an instant"),
        (line("equation der(z) = 1;"), "E0552", "a first-order equation begins at one end"),
        (line("damping 1 N.s/m on z;"), "E0552", "damping does not follow from anything stationary"),
        (line("friction 0.3 on z;"), "E0552", "friction does not follow from anything stationary"),
        (line("force 1 N on z;"), "E0552", "a force has no part in what is stationary"),
        (line("drive z = 1 m;"), "E0552", "a drive prescribes a motion in time"),
        (line("input Real u = 0;"), "E0552", "an input is told from outside in time"),
        (line("contact z restitution 0.5;"), "E0552", "a contact happens in time"),
        (line("experiment(stop = 1 s);"), "E0562", "'stop' belongs to a run in time"),
        (line("experiment(c = 1);"), "E0801", "there is no 'c' that an experiment could set"),
        (line("output e = at(z, 2 s);"), "E0303", "'x' is a length (m), the value is a time (s)"),
        (line("output e = at(z, z);"), "E0559", "the place of a value must be known"),
        (line("output e = energy.total;"), "E0522", "has no answer in this model"),
        (line(integrand="z + der(z)"), "E0302", "left side is a length (m), right side is a number"),
        (line(integrand="z, 0 m, 1 m"), "E0309", "'integral' takes 1 argument, not 3"),
        (line(ends="initial z ~ 0 m;"), "E0553", "an end is known or free, and not guessed"),
        (line().replace("from a", "from 1 m"), "E0551", "the range of 'x' is empty"),
        (line().replace("from a", "from 2 m"), "E0551", "the range of 'x' descends"),
    ],
)
def test_what_no_curve_has_is_refused(text: str, code: str, said: str) -> None:
    (told,) = [d for d in refused(text) if d.code.startswith("E")]
    assert told.code == code
    assert said in told.message


@pytest.mark.parametrize(
    ("text", "values", "said"),
    [
        (
            line("output e = at(z, 2 m);"),
            {},
            "asks for a place outside of the range; the range goes from 0 to 1 m",
        ),
        (line(), {"a": 2}, "the range of 'x' goes from 2 m to 1 m: it must ascend"),
        (
            line("parameter b = 0 m;", "der(z)^2", upper="b"),
            {},
            "the range of 'x' goes from 0 m to 0 m: it must ascend",
        ),
        (line('assert z < 0.2471 m, "too high";'), {}, "assertion failed at x = 0.248 m: too high"),
    ],
)
def test_what_only_values_tell_is_refused(text: str, values: dict[str, float], said: str) -> None:
    with pytest.raises(mechc.SimulationError) as caught:
        mechc.loads(text).solve(set=values)
    assert said in str(caught.value)
    assert caught.value.origin is not None


def test_numbers_of_the_whole_read_each_other() -> None:
    """Along z = x: the mean of z is 1/2, and the part below x = 0.3 is 0.3^2/2."""
    found = mechc.loads(
        line("""
        output mean = integral(integral(z));
        output product = integral(z*at(z, 0.5 m));
        output twice = at(at(z, 0.2 m), 0.5 m);
        output part = integral(if x < 0.3 m then z else 0 m);
        assert z < 2 m, "too high";
        """)
    ).solve()
    for name, exact in (("mean", 0.5), ("product", 0.25), ("twice", 0.2), ("part", 0.045)):
        assert abs(found.outputs[name] - exact) <= 30 * found.output_errors[name] <= 1e-11


def test_run_finds_a_curve(tmp_path: Path) -> None:
    from mechc.cli.run import command

    (tmp_path / "line.mech").write_text(line())
    arguments = [str(tmp_path / "line.mech"), "-q"]
    assert CliRunner().invoke(command, arguments, standalone_mode=False).exit_code == 0


@pytest.mark.parametrize("command", ["fit", "init", "stress", "view"])
def test_commands_of_motions_refuse_curves(command: str, tmp_path) -> None:  # type: ignore[no-untyped-def]
    from importlib import import_module

    from click import UsageError

    (tmp_path / "line.mech").write_text(line())
    ran = CliRunner().invoke(import_module(f"mechc.cli.{command}").command, [str(tmp_path / "line.mech")])
    assert ran.exit_code
    assert isinstance(ran.exception, (UsageError, mechc.UsageMistake, SystemExit))
    said = ran.output + str(ran.exception)
    assert "is a curve" in said
    assert "claimed" not in said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        pytest.param(line(integrand="z"), "what is stationary has no lower bound", marks=pytest.mark.slow),
        pytest.param(
            line(integrand="z*der(z)"), "the same for every curve between these ends", marks=pytest.mark.slow
        ),
        (line(ends=ENDS + " final z = 2 m;"), "'final z' repeats or contradicts"),
        pytest.param(
            line("constraint c: integral(sqrt(1 + der(z)^2)) = 1 m;"),
            "no curve was found that meets 'c'",
            marks=pytest.mark.slow,
        ),
        (line("constraint c: z >= 2 m;"), "'c' does not hold where the ends are given: at x = 0 m"),
        (line("constraint c: z = 0.5 m;"), "'c' does not hold where the ends are given: at x = 0 m"),
        (line(integrand="sqrt((1 + der(z)^2)/(z - 0.5 m))"), "with the guess the integrand is not defined"),
    ],
)
def test_why_there_is_no_curve(text: str, said: str) -> None:
    with pytest.raises(mechc.SimulationError) as caught:
        mechc.loads(text).solve()
    assert said in "; ".join((caught.value.message, *caught.value.notes))


@pytest.mark.parametrize(
    ("integrand", "place"),
    [
        ("sqrt(1 + der(z)^2)/x", "x = 0 m"),
        ("der(z)^2 + 1 m/(1 m - x)", "x = 1 m"),
        pytest.param("sqrt(1 + der(z)^2)/(x - 0.3 m)^2", "x = 0.3 m", marks=pytest.mark.slow),
    ],
)
def test_an_integral_without_a_value_is_named(integrand: str, place: str) -> None:
    with pytest.raises(mechc.SimulationError) as caught:
        mechc.loads(line(integrand=integrand)).solve()
    said = "; ".join((caught.value.message, *caught.value.notes))
    assert (
        f"the integrand of 'integral({integrand})' grows like 1/distance, or faster, towards {place}" in said
    )


def test_an_output_without_a_value_is_told() -> None:
    text = line("output finite = integral(1 m^(1/2)/sqrt(x)); output endless = integral(1 m/x);")
    found = mechc.loads(text).solve()
    assert found.outcome.value == "doubtful"
    assert found.remarks == [
        "an output has no finite value: the integrand of 'integral(1 m/x)' grows like 1/distance, or faster, towards x = 0 m"
    ]


@pytest.mark.slow
def test_rings_too_far_apart_leave_two_discs() -> None:
    """Goldschmidt: no film is left beyond b = 0.6627, and two discs have 2 pi."""
    film = Path(__file__).parents[2] / "examples" / "curves" / "soap_film.mech"
    with pytest.raises(mechc.SimulationError) as caught:
        mechc.load(film).solve(set={"b": 0.8})
    assert "one that jumps have the value 6.28318531" in caught.value.notes[0]


def test_the_density_of_a_surface_goes_on_to_the_ends() -> None:
    """Along a great circle d/ds (r'/|r'|) = -|r'| r, so that the density of dot(r, r) = 1 is -|r'|/2, at the ends, too."""
    found = mechc.load(Path(__file__).parents[2] / "examples" / "curves" / "sphere.mech").solve()
    speed = np.sqrt(sum(found[f"der(r[{k}])"] ** 2 for k in (1, 2, 3)))
    assert found["multiplier(surface)"] == pytest.approx(-speed / 2, rel=1e-6)


@pytest.mark.parametrize(
    ("slope", "told"), [(1.9, []), (0.1, ["the guess is far from 'c', which the curve meets"])]
)
def test_a_guess_that_is_far_from_a_condition_is_told(slope: float, told: list[str]) -> None:
    text = line(
        "constraint c: integral(sqrt(1 + der(z)^2)) = 1.5 m;",
        "z*sqrt(1 + der(z)^2)",
        "initial z = 0 m; final z = 0 m;",
        f"-{slope}*x*(1 - x/1 m)",
    )
    assert mechc.loads(text).solve().remarks == told
