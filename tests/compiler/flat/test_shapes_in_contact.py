"""Statements ``shape`` and ``contact A with B``: which pairs there are, what they are called, and what is refused."""

from __future__ import annotations

import pytest
from flat_models import codes, definition, flat, said, value

from mechc.presentation.render import render

HEAD = "import mech.planar.*;\nimport mech.shapes.*;\n"
BALLS = """
model M
  gravity {0, -9.81} m/s^2;
  parameter mu = 0.3;
  Disk ball[3](r = 5 cm);
  Free free[i in 1:3](world -> ball[i].a, x = 0.2 m*i, y = 1 m);
  shape Sphere(r = 5 cm) on ball;
  shape floor: Plane on world;
  MORE
end M;
"""


def contacts(more: str, text: str = BALLS, head: str = HEAD) -> list[str]:
    return [c.name for c in flat(head + text.replace("MORE", more)).contacts]


def wrong(more: str, text: str = BALLS, head: str = HEAD) -> list[str]:
    return codes(head + text.replace("MORE", more))


def words(more: str, text: str = BALLS, head: str = HEAD) -> str:
    return render(said(head + text.replace("MORE", more)))


# ---------------------------------------------------------------- pairs


@pytest.mark.parametrize(
    ("more", "pairs"),
    [
        ("contact ball with floor;", {(1, "floor"), (2, "floor"), (3, "floor")}),
        ("contact floor with ball[*];", {("floor", 1), ("floor", 2), ("floor", 3)}),
        ("contact ball[2] with world;", {(2, "floor")}),
        ("contact ball[2:3] with ball[1], floor;", {(2, 1), (3, 1), (2, "floor"), (3, "floor")}),
        ("contact ball[:] with ball[*];", {(1, 2), (1, 3), (2, 3)}),
        ("contact ball[1].a with ball[3].a;", {(1, 3)}),
        ("contact ball[1] with ball[1:2], ball[2], free[2].to;", {(1, 2)}),
        ("for i in 1:2 loop contact ball[i] with ball[i + 1]; end for;", {(1, 2), (2, 3)}),
        ("if mu == mu and 1 > 2 then contact ball with floor; end if;", set()),
    ],
)
def test_pairs_are_all_of_both_sides(more: str, pairs: set[tuple[object, object]]) -> None:
    def name(one: object) -> str:
        return f"ball[{one}]" if isinstance(one, int) else str(one)

    found = contacts(more.replace("mu == mu and ", ""))
    assert sorted(found) == sorted(
        f"{name(a)}-{name(b)}.touch{'' if isinstance(a, int) and isinstance(b, int) else '[1]'}"
        for a, b in pairs
    )


def test_a_name_makes_them_parts() -> None:
    assert contacts("contact c: ball[1] with floor;") == ["c.touch[1]"]
    assert contacts("contact c: ball with ball;") == ["c[1].touch", "c[2].touch", "c[3].touch"]
    assert contacts("for i in 1:1 loop contact c[i]: ball with floor; end for;") == [
        "c[1,1].touch[1]",
        "c[1,2].touch[1]",
        "c[1,3].touch[1]",
    ]


CAR = """
model Wheel
  Disk rim(r = 0.1 m);
  frame hub = rim.a;
  shape Sphere(r = 0.1 m) on rim.a at {1, 0} cm;
end Wheel;
model Car
  frame from;
  frame front = from * trans({0.4, 0} m);
  Body body(m = 1 kg, J = 1 kg.m^2);
  Weld w(from -> body.a);
  shape Box(size = {0.5, 0.1} m) on front;
  shape tail: Sphere(r = 2 cm) on body at {-0.3, 0} m;
  Wheel wheel[2];
  Revolute pin[i in 1:2](body.a -> wheel[i].rim.a);
end Car;
model M
  gravity {0, -9.81} m/s^2;
  Body chassis(m = 1 kg, J = 1 kg.m^2);
  Planar free(world -> chassis.a, y = 1 m);
  Car car(from = chassis.a);
  shape Plane on world * rot(5 deg);
  shape Sphere(r = 1 cm) on chassis;
  MORE
end M;
"""


@pytest.mark.parametrize(
    ("more", "first"),
    [
        ("contact car.wheel[1] with world;", ["car.wheel[1].rim"]),
        ("contact car.wheel with world;", ["car.wheel[1].rim", "car.wheel[2].rim"]),
        ("contact car.wheel[2].hub with world;", ["car.wheel[2].rim"]),
        ("contact car with world;", ["car", "car.tail", "car.wheel[1].rim", "car.wheel[2].rim"]),
        ("contact car.tail with world;", ["car.tail"]),
        ("contact car.body with world;", ["car.tail"]),
        ("contact chassis with world;", ["car", "chassis"]),
        ("contact car.front with world;", ["car"]),
        ("contact car.from with world;", ["car", "chassis"]),
    ],
)
def test_shapes_belong_to_parts_frames_and_what_carries_them(more: str, first: list[str]) -> None:
    found = {name.partition("-")[0] for name in contacts(more, CAR)}
    assert found == set(first)


def test_pairs_of_one_rigid_body_are_left_out() -> None:
    """Through formulas, alias and welds: tail, front and the chassis are one body, the wheels are others."""
    found = {name.partition(".touch")[0] for name in contacts("contact car.wheel with car, chassis;", CAR)}
    assert found == {
        f"car.wheel[{i}].rim-{other}" for i in (1, 2) for other in ("car", "car.tail", "chassis")
    } | {"car.wheel[1].rim-car.wheel[2].rim"}
    assert wrong("contact chassis with car.body;", CAR) == ["E0733"]


def test_a_frame_that_moves_by_a_formula_is_a_body_of_its_own() -> None:
    text = """
model M
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  frame slide = world * trans({x, 0 m});
  frame tip = slide * trans({0 m, 1 cm});
  shape Sphere(r = 1 cm) on tip;
  shape wall: Plane on world * rot(-90 deg);
  shape Sphere(r = 1 cm) on slide at {0, 3} cm;
  MORE
end M;
"""
    found = contacts("contact slide with wall;", text)
    assert [name.partition("-")[0] for name in found] == ["tip", "slide"]
    assert wrong("contact slide with tip;", text) == ["E0733"]


def test_shapes_are_told_from_bodies_of_the_same_name() -> None:
    text = """
model M
  gravity {0, -9.81} m/s^2;
  Sphere ball(r = 5 cm);
  Box box(size = {1, 1} m);
  Free f(world -> ball.a, y = 3 m);
  Free g(world -> box.a, y = 1 m);
  shape Sphere(r = ball.r) on ball;
  shape Box(size = box.size) on box;
  contact ball with box;
end M;
"""
    assert contacts("", text) == ["ball-box.touch"]
    named = HEAD.replace("mech.shapes.*", "mech.shapes.{Sphere, Box}")
    assert contacts("", text, named) == ["ball-box.touch"]


def test_a_shape_may_extend_another_one() -> None:
    text = 'shape model Wheel "a ball" extends Sphere(r = 3 cm); end Wheel;' + BALLS.replace(
        "shape Sphere(r = 5 cm)", "shape Wheel"
    )
    assert len(contacts("contact ball with ball, floor;", text)) == 6


OWN = """
shape model Dot "a point" frame a; end Dot;
shape model Spot "a special point" extends Dot; end Spot;
model DotMeetsPlane
  shape plane: Plane;
  shape dot: Dot;
  parameter Length above = 0 m;
  contact touch: local(plane.a, pos(dot.a))[2] - above;
end DotMeetsPlane;
"""


def test_a_part_of_ones_own_takes_options() -> None:
    text = OWN + BALLS.replace("shape Sphere(r = 5 cm)", "shape Dot")
    assert contacts("contact ball[2] with floor;", text) == ["ball[2]-floor.touch"]
    (touch,) = flat(
        HEAD
        + text.replace("MORE", "contact c: floor with ball[2];\n output Length gap = c.gap2;").replace(
            "contact touch:", "let gap2 = local(plane.a, pos(dot.a))[2];\n contact touch:"
        )
    ).contacts
    assert touch.name == "c.touch"
    assert wrong("contact ball with floor friction 0.3;", text) == ["E0401"]


def test_the_part_for_the_most_special_shapes_is_taken() -> None:
    special = "model SpotMeetsPlane shape dot: Spot; shape plane: Plane; contact special: pos(dot.a)[2]; end SpotMeetsPlane;"
    text = OWN + special + BALLS.replace("shape Sphere(r = 5 cm)", "shape Spot")
    assert contacts("contact ball[1] with floor;", text) == ["ball[1]-floor.special"]
    again = special.replace("SpotMeetsPlane", "Another")
    assert wrong("contact ball[1] with floor;", text.replace(special, special + again)) == ["E0732"]


def test_a_part_of_the_file_goes_before_that_of_the_library() -> None:
    own = "model Mine shape one: Sphere; shape other: Plane; contact mine: pos(one.a)[2] - one.r; end Mine;"
    assert contacts("contact ball[1] with floor;", own + BALLS) == ["ball[1]-floor.mine"]


# ---------------------------------------------------------------- values


def test_what_a_contact_is_given_is_no_parameter_but_a_shapes_is() -> None:
    model = flat(HEAD + BALLS.replace("MORE", "contact ball with floor friction mu restitution 0.5;"))
    names = [v.name for v in model.variables]
    assert [name for name in names if name.startswith(("shape", "floor"))] == [
        "shape[1].r",
        "shape[2].r",
        "shape[3].r",
    ]
    assert not [name for name in names if "-" in name]
    assert not [d.name for d in model.definitions if d.role.value == "output"]


def test_the_text_around_a_part_sets_its_shapes_and_contacts() -> None:
    text = """
model Ball
  Disk disk(r = 5 cm);
  Free free(world -> disk.a, y = 1 m);
  shape skin: Sphere(r = 5 cm) on disk;
  shape floor: Plane on world;
  contact c: disk with floor restitution 0.2;
end Ball;
model M
  gravity {0, -9.81} m/s^2;
  Ball ball(skin.r = 7 cm, c.restitution = 0.6);
  output Length r = ball.skin.r;
end M;
"""
    model = flat(HEAD + text)
    (value,) = (v.value for v in model.variables if v.name == "ball.skin.r")
    assert float(value.value) == 0.07  # type: ignore[union-attr]
    (value,) = (d.value for d in model.definitions if d.name == "ball.c.restitution")
    assert float(value.value) == 0.6  # type: ignore[union-attr]


# ---------------------------------------------------------------- refused


@pytest.mark.parametrize(
    ("more", "code", "word"),
    [
        ("shape Sphere(r = 1 cm);", "E0730", "nothing carries it"),
        ("shape Sphere(r = 1 cm) on ball[1].a * {1, 0} cm;", "E0730", "'at'"),
        ("shape Sphere(r = 1 cm) on mu;", "E0730", "a number"),
        ("shape Sphere(r = 1 cm) on free[1];", "E0730", "free[1].to"),
        ("shape Sphere(r = 1 cm) on world at 3 cm;", "E0730", "2 or 3 lengths"),
        ("shape Sphere(r = 1 cm) on world at {1, 2};", "E0730", "2 or 3 lengths"),
        ("shape Sphera(r = 1 cm) on world;", "E0203", "'Sphere'"),
        ("shape Disk(r = 1 cm) on world;", "E0203", "no shape 'Disk'"),
        ("shape Sphere(d = 1 cm) on world;", "E0401", "'d'"),
        ("shape s: Plane on world; shape s: Plane on world;", "E0204", "'s'"),
        ("Plane p;", "E0203", "no model 'Plane'"),
        ("contact ball with free;", "E0731", "'free' has no shape"),
        ("frame f = ball[1].a * trans({1, 0} m); contact f with floor;", "E0731", "'f' has no shape"),
        ("contact mu with floor;", "E0731", "a number"),
        ("contact bal with floor;", "E0201", "'ball'"),
        ("contact ball[4] with floor;", "E0314", "outside"),
        ("contact floor with world;", "E0733", "fixed"),
        ("contact ball with floor; contact ball[1] with ball, floor;", "E0733", "already"),
        ("contact ball with floor friction 3 m;", "E0303", "'friction' is a number"),
        ("contact c: ball with floor; let c = 3;", "E0204", "'c'"),
        ("contact ball with floor, rest = 3;", "E0110", "found '='"),
        ("contact ball with floor friction 0.1, rests = 1 m/s;", "E0401", "rests"),
        ("contact ball, floor with ball;", "E0110", "'with'"),
    ],
)
def test_refused(more: str, code: str, word: str) -> None:
    found = words(more)
    assert (wrong(more)[:1], word in found) == ([code], True), found


def test_a_model_of_a_pair_is_no_component() -> None:
    assert wrong("SphereMeetsPlane p;") == ["E0730", "E0730"]


def test_a_missing_shape_is_told_once() -> None:
    """What follows from a shape that could not be set is not told again."""
    text = BALLS.replace("shape Sphere(r = 5 cm) on ball", "shape Spher(r = 5 cm) on ball")
    assert wrong("contact ball with floor;", text) == ["E0203"]


def test_options_are_those_of_the_contacts() -> None:
    more = 'contact ball[1] with floor friction 0.3, rest = 1 mm/s, impacts = "simultaneous";'
    (touch,) = flat(HEAD + BALLS.replace("MORE", more)).contacts
    assert sorted(touch.options) == ["impacts", "rest"]
    assert wrong("contact ball with floor friction 0.3, rest = 1 m;") == ["E0333"]


def test_one_pair_of_a_named_contact_is_asked_about_and_released() -> None:
    more = """
    contact c: ball with floor;
    output load = multiplier(c[2]);
    output shut = if closed(c[3]) then 1 else 0;
    when time > 1 s then release c[1]; end when;
    """
    model = flat(HEAD + BALLS.replace("MORE", more))
    assert value(definition(model, "load").value) == "multiplier(c[2].touch[1])"
    assert "closed(c[3].touch[1])" in value(definition(model, "shut").value)
    (event,) = model.events
    assert event.switched == {"c[1].touch[1]"}
    assert wrong("contact c: ball with floor; output load = multiplier(c[4]);") == ["E0314"]


def test_conditions_and_loops_may_stand_before_the_shape_they_ask_for() -> None:
    """As 'if' and 'for' of a base do, whose statements come first."""
    model = """
import mech.planar.*;
import mech.shapes.*;
model Slides
  Particle one(m = 1 kg);
  Prismatic guide(world -> one.a, position = 1 m);
  if body.size[1] > 20 cm then
    coordinate Real more = size(body.size, 1);
  end if;
  for i in 1:size(body.size, 1) loop
    damping i*1 N.s/m on guide.position;
  end for;
  shape body: Long() on one.a;
  kinetic 1/2*1 kg.m^2*der(more)^2;
end Slides;
shape model Long
  frame a;
  structural parameter Length size[2] = {30 cm, 10 cm};
end Long;
"""
    found = flat(model)
    assert [v.name for v in found.variables if v.name == "more"] == ["more"]
    assert len(found.dampings) == 2
