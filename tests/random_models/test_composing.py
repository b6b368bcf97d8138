"""Models as people compose them: that they are written, and that what is compared of them can fail."""

from __future__ import annotations

import re
from pathlib import Path
from random import Random

import numpy as np
import pytest
from msgspec.structs import replace
from random_models.checks import compare_twin
from random_models.compiled import compiled
from random_models.composing import as_people_compose, called_oddly
from random_models.definition import along, begins_otherwise
from random_models.generator import generate
from random_models.hidden import misjudged
from random_models.motions import run
from random_models.tabled import meant, tables
from scipy.interpolate import CubicSpline


def test_twins_hold_what_people_write() -> None:
    """Parts in parts, joints in parts, names of names, values that connect."""
    twins = [as_people_compose(generate(seed), Random(seed)) for seed in range(40)]
    written = "\n".join(twin.model.text() for twin in twins if twin is not None)
    for form in (
        r"model Whole\w+\s+(Part\w+) half",
        r"model L\w+[^;]*(;[^;]*)* pin\(root -> rod\.a\)",
        r"pin\(from_end -> to",
        r"frame (alias\d+) = alias\d+;",
        r"Part\w+ b\d+\([^;]*root = ",
        r"parameter (\w+ )?(t|x|u|lambda) = ",
    ):
        assert re.search(form, written), form


def test_models_hold_loops_of_parts_and_inputs_that_drive() -> None:
    written = "\n".join(generate(seed).text() for seed in (*range(60), 93, 217))
    assert re.search(r"Body b\d+\([^;]*, a = f\d+", written)
    assert re.search(r"Part\d+ b\d+\(root = ", written)
    assert re.search(r"drive der\(q\d+\) = [^;]*u\d+", written) and re.search(
        r"drive q\d+ = [^;]*u\d+", written
    )


@pytest.mark.slow
def test_a_twin_in_parts_is_compared() -> None:
    """Its base with a heavier body in another text is another model."""
    model = generate(62)
    twin = as_people_compose(model, Random(62))
    assert twin is not None and "Part" in twin.model.text()
    assert compare_twin(compiled(model.text()), twin, 1) == []
    heavier = model.text().replace("m = 1.96 kg", "m = 2.1364 kg")
    assert heavier != model.text() and compare_twin(compiled(heavier), twin, 1)


def test_what_an_experiment_sets_keeps_its_name() -> None:
    twin = called_oddly(generate(2), Random(1))
    assert twin is not None and "u9 = 0.12" in twin.model.text() and len(twin.names) > 0
    assert not {"stop", "tolerance", "start"} & set(twin.names.values())  # E0805


FOLLOWED = """coordinate Length x = 1 m;
kinetic 1/2*1 kg*der(x)^2;
state Real a = 0.3; equation der(a) = (x/(1 m) - a)/(1 s);
state Real b = 0.1; equation der(b) = (a - b)/(1 s);
force -1 N*a on x;
output o = integral(x);
experiment(stop = 1 s);
"""


def test_states_that_follow_are_told_from_those_that_act() -> None:
    base = compiled(FOLLOWED)
    following = {base.states[k] for k in base.problem.followers}
    assert following == {"b", "integral[1]"} and misjudged(generate(0), base, 1) == []
    acting = base.states.index("a")
    base.problem = replace(base.problem, followers=(acting,))
    found = {"'a' is said to follow, and changes d der(x)"}
    forgotten = {f"'{name}' follows the motion, and is not said to" for name in ("b", "integral[1]")}
    assert set(misjudged(generate(0), base, 1)) == found | forgotten


DRIVEN = """input Length u(interpolation = "spline") = 0.2 m;
coordinate Length q;
coordinate Length x = 0.1 m;
drive q = u + 0.1 m*sin(u/(1 m));
kinetic 1/2*2 kg*der(x)^2 + 1/2*1 kg*(der(q) + 0.4*der(x))^2;
potential 1/2*3 N/m*(x - q)^2;
output f = reaction(q);
experiment(stop = 1 s);
"""


def test_motions_that_tables_drive_are_those_by_definition(tmp_path: Path) -> None:
    """Place, rate and acceleration are those of the natural spline through the rows."""
    base = compiled(DRIVEN)
    paths = next(p for k in range(9) if (p := tables(base, tmp_path, Random(k))))
    given = meant(base, paths)
    assert set(given) == {"u"}
    solution = run(DRIVEN, inputs=paths)
    assert along(base, solution, (), given) == []
    rows = solution["time"]
    other = CubicSpline(rows, solution["u"] + 0.1 * np.asarray(rows) ** 2, bc_type="natural")
    assert along(base, solution, (), {"u": other})


def test_models_hold_what_loops_parts_and_files_say_for_themselves() -> None:
    written = "\n".join(generate(seed).text() for seed in (84, 109, 113, 211, 276, 416, 457, 560))
    for form in (
        r"for (i\d+) in 1:\d loop force sum\(\S+ N\*\1 for \1 in",
        r"initial stationary; end (Rest\d+);[^@]*\1 (arm\d+);\s+Rest\d+Plain \2b\(",
        r"if given\(q\) then",
        r"model (\w+) [^@]*model \1OfFile ",
        r"frame (f\d+) = b\d+\.tip;[^@]*shape S\d+: Sphere\(r = \S+ m\) on \1;",
        r"input Length (u\d+)\(filter = [^@]*\1",
        r"input Length (u\d+) = \S+ m;\s+state Length x\d+ = \S*\1",
        r"frame seat = eye; [^@]*closure (local\(from, seat\)|pos\(seat\))",
        r"Translation j\d+\([^;]*position\[\d\]",
    ):
        assert re.search(form, written), form


FOLLOWING = """input Length u = 0.2 m;
state Length x = 2*u;
equation der(x) = (u - x)/(1 s);
experiment(stop = 1 s);
"""


def test_a_state_begins_as_the_table_of_its_input_does(tmp_path: Path) -> None:
    base = compiled(FOLLOWING)
    paths = next(p for k in range(9) if (p := tables(base, tmp_path, Random(k))))
    solution, given = run(FOLLOWING, inputs=paths), meant(base, paths)
    assert given["u"](0.0) != 0.2
    assert begins_otherwise(base, solution, given) == ""
    assert begins_otherwise(base, solution, {"u": lambda t: 0.2}).startswith("x: ")
