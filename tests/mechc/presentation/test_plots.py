"""Pictures hold the panels that a model calls for, with units, and need no display."""

from __future__ import annotations

from copy import copy
from pathlib import Path

import numpy as np
import pytest
from hand_made import pendulum_problem, pendulum_solution
from matplotlib.figure import Figure
from slow_params import slow_but

import mechc
from mechc.cli.main import run
from mechc.display import choose
from mechc.presentation.painting import Painter
from mechc.presentation.panels import (
    EnergyPanel,
    Paths,
    PhasePanel,
    Scenery,
    TimePanel,
    element,
    matrix_rows,
    panels_of,
    point_names,
)
from mechc.presentation.plots import balance_error, figure, save
from mechc.presentation.strokes import Strokes
from mechc.runtime.interface import Quantity
from mechc.solution import Solution


@pytest.fixture(scope="module")
def solution() -> Solution:
    return pendulum_solution()


def test_panels(solution: Solution) -> None:
    assert panels_of(solution) == [
        Paths(("bob",), 2),
        TimePanel("coordinates", "rad", ("theta",)),
        PhasePanel("theta", "der(theta)"),
        EnergyPanel(
            ("energy.kinetic", "energy.potential", "energy.total", "energy.dissipated"), balance=False
        ),
    ]


def test_points_are_two_or_three_lengths() -> None:
    def vector(name: str, unit: str, size: int) -> list[Quantity]:
        return [Quantity(f"{name}[{i}]", "output", unit) for i in range(1, size + 1)]

    outputs = [
        *vector("tip", "m", 2),
        *vector("force", "N", 2),
        *vector("r", "m", 3),
        *vector("many", "m", 4),
    ]
    assert point_names(outputs) == {"tip": 2, "r": 3}


def test_labels_have_the_units_of_the_model_or_the_chosen_ones(solution: Solution) -> None:
    axes = figure(solution).axes
    assert axes[1].get_ylabel() == "[deg]"
    assert (axes[2].get_xlabel(), axes[2].get_ylabel()) == (r"$\theta$ [deg]", r"$\dot{\theta}$ [deg/s]")
    assert figure(solution.shown_in("rad,mm")).axes[0].get_xlabel() == "$x$ [mm]"


def test_curves_show_converted_values(solution: Solution) -> None:
    line = figure(solution).axes[1].get_lines()[0]
    assert line.get_ydata()[0] == pytest.approx(60.0, rel=1e-12)


def test_chosen_names_only(solution: Solution) -> None:
    axes = figure(solution, ["der(theta)", "bob[1]"]).axes
    assert [a.get_title(loc="left") for a in axes] == [r"$\dot{\theta}$", "bob$_{1}$"]


def test_a_jump_is_drawn_upright() -> None:
    """Both sides of an event are points of the curve, at one time."""
    text = "coordinate x = 0 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2; contact wall: 0.5 m - x restitution 1;"
    solution = mechc.loads(text).simulate(stop=1)
    assert isinstance(solution, Solution)
    portrait = next(a for a in figure(solution).axes if a.get_title(loc="left") == "phase portrait of $x$")
    x, rate = (np.asarray(data) for data in portrait.get_lines()[0].get_data())
    (jump,) = np.flatnonzero(np.diff(np.sign(rate)))
    assert x[jump] == x[jump + 1] == pytest.approx(0.5, abs=1e-12)


def test_titles_tell_how_many_are_left_out_and_chosen_names_are_all_drawn() -> None:
    text = "coordinate x[10] = 1 m; kinetic sum(1/2*1 kg*der(x[i])^2 for i in 1:10);"
    solution = mechc.loads(text).simulate(stop=1)
    assert isinstance(solution, Solution)
    assert figure(solution).axes[0].get_title(loc="left") == "coordinates (8 of 10)"
    chosen = figure(solution, [f"x[{i}]" for i in range(1, 11)]).axes
    assert [len(axes.get_lines()) for axes in chosen] == [8, 2]


def test_inputs_and_discrete_variables_are_drawn_where_they_change() -> None:
    text = "discrete Integer n = 3; input Force u = 2 N; coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; force u*n on x;"
    solution = mechc.loads(text + "when x > 2 m then n := 1; end when;").simulate(stop=1)
    assert isinstance(solution, Solution)
    drawn = figure(solution)
    titles = [axes.get_title(loc="left") for axes in drawn.axes]
    assert "$n$" in titles and "$u$" not in titles
    assert "constant: $u$ = 2 N" in drawn.get_supxlabel()


def test_the_balance_is_total_and_dissipated_energy(solution: Solution) -> None:
    error, unit = balance_error(solution)
    assert unit == "J" and error[0] == 0.0
    assert 0 < abs(error).max() < 1e-5  # tolerance 1e-8 and 10 J, with the dense output's error
    chosen = copy(solution)
    chosen.display = choose("mJ")
    shown, unit = balance_error(chosen)
    assert unit == "mJ" and shown == pytest.approx(1000 * error, rel=1e-15)


@pytest.mark.parametrize("ending", slow_but(["png"], ["png", "pdf", "svg"]))
def test_pictures_need_no_display(
    ending: str, solution: Solution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    path = tmp_path / f"motion.{ending}"
    save(solution, path)
    assert path.stat().st_size > 5000


def test_every_name_of_the_problem_can_be_drawn(solution: Solution) -> None:
    problem = pendulum_problem()
    names = [q.name for q in (*problem.states, *problem.outputs)]
    assert sum(len(a.get_lines()) for a in figure(solution, names).axes) == len(names)


def test_rows_of_a_matrix_of_coordinates_are_points() -> None:
    rows = [Quantity(f"r[{i},{j}]", "coordinate", "m") for i in (1, 2) for j in (1, 2, 3)]
    assert matrix_rows(
        [*rows, Quantity("x[1]", "coordinate", "m"), Quantity("a[1,2]", "coordinate", "rad")]
    ) == {
        "r[1,": 3,
        "r[2,": 3,
    }
    assert [element("r[2,", 3), element("tip", 2)] == ["r[2,3]", "tip[2]"]


def test_what_is_constant_looks_constant() -> None:
    free = pendulum_solution(c=0.0)
    energies = next(a for a in figure(free).axes if a.get_title(loc="left") == "energies")
    total = figure(free, ["energy.total"]).axes[0]
    assert energies.get_ylim()[1] - energies.get_ylim()[0] > 5
    assert total.get_ylim()[1] - total.get_ylim()[0] > 0.1 * abs(free["energy.total"][0])


TURN = """
parameter l = 2 m;
coordinate a = 30 deg;
initial der(a) = 1 rad/s;
kinetic 1/2*1 kg*l^2*der(a)^2;
output tip = {l*cos(a), l*sin(a)};
output again = a;
output held = momentum(a);
draw line({0, 0}, {l*cos(a), l*sin(a)});
draw trail({l*cos(a), l*sin(a)});
experiment(stop = 1 s);
"""


@pytest.fixture(scope="module")
def turn() -> Solution:
    return mechc.loads(TURN).simulate()


def test_what_is_drawn_comes_first_and_nothing_is_there_twice(turn: Solution) -> None:
    """The rate is constant, so that there is no phase portrait, and so are all energies; an output repeats the angle."""
    assert panels_of(turn) == [Scenery(("tip",)), TimePanel("coordinates", "rad", ("a",))]
    drawn = figure(turn)
    scene = drawn.axes[0]
    assert scene.get_aspect() == 1.0 and scene.get_xlabel() == "$x$ [m]"
    (strokes,) = (artist for artist in scene.get_children() if isinstance(artist, Strokes))
    ends = [o.path.vertices for o in strokes.outlines if np.shape(o.path.vertices) == (2, 2)]
    start, end = (np.deg2rad(30), np.deg2rad(30) + 1)
    for line, angle in zip(ends, (start, end), strict=True):
        assert np.allclose(line, [[0, 0], [2 * np.cos(angle), 2 * np.sin(angle)]], rtol=0, atol=1e-7)
    words = drawn.get_supxlabel()
    assert "held = 4 kg·m²/s" in words and "again is $a$" in words and "energies balance within" in words


def test_a_chaotic_motion_is_no_rest() -> None:
    """Its estimated error is as large as the motion itself."""
    text = "dimensionless; state x = 1; state y = 1; state z = 1; equation der(x) = 10*(y - x); "
    text += "equation der(y) = x*(28 - z) - y; equation der(z) = x*y - 8/3*z;"
    found = mechc.loads(text).simulate(stop=50)
    assert panels_of(found) == [Scenery(()), TimePanel("states", "", ("x", "y", "z"))]


def test_angles_are_in_degrees_where_the_text_says_degrees() -> None:
    """Of a part, too, whose coordinate declares no unit; not where radians stand beside them."""
    text = """
import mech.planar.*;
gravity {0, -9.81} m/s^2;
Bar bar(m = 1 kg, l = 1 m);
Revolute pin(world -> bar.a, angle = -30 deg, der(angle) = 1 rad/s);
experiment(stop = 0.1 s);
"""
    for words, unit, first in (("-30 deg", "deg", -30.0), ("-0.5 rad", "rad", -0.5)):
        found = mechc.loads(text.replace("-30 deg", words)).simulate()
        (axes,) = figure(found, ["pin.angle"]).axes
        assert axes.get_ylabel() == f"[{unit}]"
        assert np.asarray(axes.get_lines()[0].get_ydata())[0] == pytest.approx(first)


def test_one_over_another(turn: Solution) -> None:
    (axes,) = figure(turn, ["tip[1]:tip[2]"]).axes
    assert axes.get_title(loc="left") == "tip$_{2}$ over tip$_{1}$" and axes.get_aspect() == 1.0
    x, y = axes.get_lines()[0].get_data()
    assert np.allclose(np.hypot(x, y), 2.0, rtol=0, atol=1e-12)
    assert len(figure(turn, ["a:der(a)", "a", "tip"]).axes) == 3
    with pytest.raises(KeyError, match="there is no 'b'"):
        figure(turn, ["a:b"])


def test_names_for_plot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "turn.mech").write_text(TURN)
    monkeypatch.chdir(tmp_path)
    asked: list[tuple[str, list[str]]] = []
    monkeypatch.setattr(
        "mechc.presentation.plots.save", lambda s, path, names: asked.append((str(path), list(names)))
    )
    for words in (["a,tip[1]:tip[2]"], ["tip:tip", "--plot", "own.svg"], ["own.png"]):
        assert run(["run", "turn.mech", "-q", "--plot", *words]) == 0
    assert asked == [
        ("turn.png", ["a", "tip[1]:tip[2]"]),
        ("own.svg", ["tip[1]:tip[1]", "tip[2]:tip[2]"]),
        ("own.png", []),
    ]
    capsys.readouterr()
    for wrong, said in {"b:a": "'b'", "tip:a": "different numbers", "own.jpg": "ends in .png"}.items():
        assert run(["run", "turn.mech", "-q", "--plot", wrong]) == 2
        assert said in capsys.readouterr().err


def test_a_point_at_rest_has_no_path(solution: Solution) -> None:
    still = pendulum_solution(theta=0.0)
    assert not any(isinstance(panel, Paths) for panel in panels_of(still))


def test_a_flat_path_in_space_has_a_box_with_room_for_its_numbers() -> None:
    text = """
    coordinate Length x = 1 m;
    initial der(x) = 1 m/s;
    kinetic 1/2*1 kg*der(x)^2;
    output path = {x, 0.1*x, 0 m};
    experiment(stop = 1 s);
    """
    axes = next(a for a in figure(mechc.loads(text).simulate()).axes if a.name == "3d")
    spans = [high - low for low, high in (axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d())]
    assert spans[1] / spans[0] == spans[2] / spans[0] == pytest.approx(0.5)


def test_shafts_show_their_speeds() -> None:
    """More than get phase portraits, and nothing else that shows how they move: in a picture of places there are none."""
    text = "import mech.rotational.*; Rotor a; Rotor b; Rotor c; SpringDamper s(a.angle -> b.angle, k = 5 N.m/rad); initial der(a.angle) = 2 rad/s; initial der(c.angle) = 1 rad/s;"
    solution = mechc.loads(text).simulate(stop=1.0)
    speeds = [p for p in panels_of(solution) if isinstance(p, TimePanel) and p.title == "speeds"]
    assert [(p.unit, p.names) for p in speeds] == [("rad/s", ("der(a.angle)", "der(b.angle)"))]
    pendulum = "import mech.planar.*; gravity {0, -9.81} m/s^2; Bar u; Bar v; Bar w; Revolute p(world -> u.a, angle = 1 rad); Revolute q(u.b -> v.a); Revolute r(v.b -> w.a);"
    panels = panels_of(mechc.loads(pendulum).simulate(stop=0.5))
    assert isinstance(panels[0], Scenery) and "speeds" not in [getattr(p, "title", "") for p in panels]


def test_a_narrow_picture_has_few_numbers_on_its_short_side() -> None:
    """At most two where a tall one is as wide as a word; a picture of its own is filled."""
    text = "import mech.planar.*; gravity {0, -9.81} m/s^2; Particle p(m = 1 kg); Prismatic s(world -> p.a, axis = {0, 1}, position = 10 m); draw line(world, p.a);"
    solution = mechc.loads(text).simulate(stop=0.1)
    painter = Painter(solution, solution.time[[0, -1]], Figure().add_subplot())
    painter.paint(0)
    low, high = painter.axes.get_xlim()
    seen = [x for x in painter.axes.get_xticks() if low <= x <= high]
    assert len(seen) <= 2 < len(painter.axes.get_yticks())
    own = Painter(solution, solution.time[[0, -1]])
    own.paint(0)
    (left, right), (down, up) = own.axes.get_xlim(), own.axes.get_ylim()
    box = own.axes.get_window_extent()
    assert (right - left) / (up - down) == pytest.approx(box.width / box.height, rel=1e-3)


LONG = """\
model Part
  output Real steady_position_of_the_slider = 1;
  output Real steady_position_of_the_carriage = 2;
end Part;
model Press
  parameter M = 2e5 N;
  Part first_of_the_long_names; Part second_of_the_long_names; Part third_of_the_long_names;
  coordinate x = 1 m;
  kinetic 1/2*200 kg*der(x)^2;
  potential 1/2*(4e5 N/m)*x^2;
  output Force held = M*(x/(1 m));
  experiment(stop = 0.1 s);
end Press;
"""


def test_the_line_below_the_panels_is_not_cut() -> None:
    drawn = figure(mechc.loads(LONG).simulate())
    drawn.canvas.draw()
    line = drawn._supxlabel
    assert "third_of_the_long_names.steady_position_of_the_carriage" in line.get_text()
    assert line.get_window_extent().x1 <= drawn.bbox.x1


def test_long_numbers_become_a_prefix_of_the_unit() -> None:
    drawn = figure(mechc.loads(LONG).simulate())
    drawn.canvas.draw()
    axes = next(a for a in drawn.axes if a.get_title(loc="left") == "held")
    assert axes.get_ylabel() == "[kN]"
    shown = {t.get_text() for t in axes.get_yticklabels()}
    assert {"0", "200", "\N{MINUS SIGN}200"} <= shown
    assert all(a.yaxis.get_offset_text().get_text() == "" for a in drawn.axes)
    energies = next(a for a in drawn.axes if a.get_title(loc="left") == "energies")
    assert energies.get_ylabel() == "[kJ]"
