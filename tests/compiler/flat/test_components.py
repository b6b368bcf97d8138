"""Components: instances, modifications, arrays, conditions, recursion, connections."""

from __future__ import annotations

import pytest
from flat_models import codes, definition, flat, rate, said, start, value, variable

PART = """
model Part
  parameter m = 1 kg;
  parameter Length size[2] = {1, 2} m;
  coordinate x = 0 m;
  kinetic 1/2*m*der(x)^2;
end Part;
"""

JOINT = """
model Body "with one frame"
  parameter m = 1 kg;
  frame a;
  mass m at a;
end Body;

model Hinge
  frame from;
  frame to;
  coordinate Angle angle ~ 0 rad;
  place to = from * rot(angle);
  closure pos(to) = pos(from);
end Hinge;
"""


def test_members_get_dotted_names_in_the_order_of_declaration() -> None:
    model = flat(PART + "model M  Part b; Part a; end M;")
    assert [v.name for v in model.variables] == ["b.m", "b.size", "b.x", "a.m", "a.size", "a.x"]
    assert [value(e.value) for e in model.energies] == ["0.5*b.m*der(b.x)^2", "0.5*a.m*der(a.x)^2"]
    assert model.energies[0].origin.instance == "b"


def test_the_left_name_is_the_component_s_and_the_value_the_enclosing_model_s() -> None:
    model = flat(PART + "model M  parameter m = 3 kg; Part p(m = m); end M;")
    assert value(variable(model, "p.m").value) == "m"


def test_a_scalar_goes_to_every_component_and_a_vector_is_distributed() -> None:
    model = flat(PART + "model M  parameter w = {5, 6} kg; Part p[2](m = w, size = 3 m); end M;")
    assert [value(variable(model, f"p[{k}].m").value) for k in (1, 2)] == ["w[1]", "w[2]"]
    assert value(variable(model, "p[2].size").value) == "{3, 3}"


def test_shape_alone_decides_between_broadcast_and_distribution() -> None:
    same = flat(PART + "model M  Part p[2](size = {7, 8} m); end M;")
    assert [value(variable(same, f"p[{k}].size").value) for k in (1, 2)] == ["{7, 8}", "{7, 8}"]
    each = flat(PART + "model M  Part p[2](size = {{1, 2}, {3, 4}} m); end M;")
    assert [value(variable(each, f"p[{k}].size").value) for k in (1, 2)] == ["{1, 2}", "{3, 4}"]
    assert codes(PART + "model M  Part p[3](m = {1, 2} kg); end M;") == ["E0404"]


def test_the_index_of_an_array_is_visible_in_modifications() -> None:
    model = flat(PART + "model M  Part p[i in 1:3](m = i^2*1 kg); end M;")
    assert [value(variable(model, f"p[{k}].m").value) for k in (1, 2, 3)] == ["1", "4", "9"]


def test_arrays_of_two_dimensions() -> None:
    model = flat(PART + "model M  Part p[i in 1:2, j in 1:2](m = (10*i + j)*1 kg); end M;")
    assert [v.name for v in model.variables if v.name.endswith(".m")] == [
        "p[1,1].m",
        "p[1,2].m",
        "p[2,1].m",
        "p[2,2].m",
    ]
    assert value(variable(model, "p[2,1].m").value) == "21"


def test_modifications_reach_through_components() -> None:
    pair = "model Pair  Part p; Part q[2]; end Pair;"
    model = flat(PART + pair + "model M  Pair pair(p.m = 2 kg, q[2].m = 4 kg, p.x ~ 1 m); end M;")
    assert value(variable(model, "pair.p.m").value) == "2"
    assert [value(variable(model, f"pair.q[{k}].m").value) for k in (1, 2)] == ["1", "4"]
    assert start(model, "pair.p.x") == "~ 1"


def test_the_outermost_modification_wins() -> None:
    pair = "model Pair  Part p(m = 2 kg); end Pair;"
    assert value(variable(flat(PART + pair + "model M  Pair pair; end M;"), "pair.p.m").value) == "2"
    outer = flat(PART + pair + "model M  Pair pair(p.m = 3 kg); end M;")
    assert value(variable(outer, "pair.p.m").value) == "3"
    outermost = PART + pair + "model N  Pair pair(p.m = 3 kg); end N; model M  N n(pair.p.m = 4 kg); end M;"
    assert value(variable(flat(outermost), "n.pair.p.m").value) == "4"


PAIR = (
    PART
    + "model Pair  Part p(m = 2 kg, x = 1 m, size = 3 m); Part q[2](m = 6 kg); initial p.x ~ 9 m; end Pair;"
)


COUNTER = """
model Counter
  discrete Real n = 1;
  discrete Real d[2] = {1, 1};
  discrete Boolean on[2];
  initial n = 2;
  initial d[2] = 3;
  initial on[1] = true;
end Counter;
"""


def test_the_outermost_first_value_of_a_discrete_variable_wins() -> None:
    model = flat(COUNTER + "model M  Counter own; Counter given(n = 5, d = {7, 8}); end M;")
    found = [[value(variable(model, f"{part}.{x}").value) for x in "nd"] for part in ("own", "given")]
    assert found == [["2", "{1, 3}"], ["5", "{7, 8}"]]
    assert value(variable(model, "own.on").value) == "{true, false}"
    heir = "model Heir  extends Counter(n = 4); initial d[1] = 6; end Heir; model M  Heir h; Heir k(n = 9); end M;"
    model = flat(COUNTER + heir)
    assert [value(variable(model, name).value) for name in ("h.n", "h.d", "k.n")] == ["4", "{6, 3}", "9"]


def test_an_heir_s_modification_wins_over_that_of_its_base() -> None:
    """The value stands further out, though both reach into the same component of the same model."""
    pair = PAIR.replace(" initial p.x ~ 9 m;", "")
    model = flat(
        pair
        + "model M  extends Pair(p.m = 3 kg, p.x ~ 2 m, der(p.x) = 5 m/s, p.size = 4 m, q[2].m = 7 kg); end M;"
    )
    assert value(variable(model, "p.m").value) == "3"
    assert value(variable(model, "p.size").value) == "{4, 4}"
    assert (start(model, "p.x"), rate(model, "p.x")) == ("~ 2", "= 5")
    assert [value(variable(model, f"q[{k}].m").value) for k in (1, 2)] == ["6", "7"]
    assert start(flat(pair + "model M  extends Pair; initial p.x = 8 m; end M;"), "p.x") == "= 8"
    both = "model Mid  extends Pair(p.m = 3 kg); end Mid; model M  MORE end M;"
    assert value(variable(flat(pair + both.replace("MORE", "extends Mid;")), "p.m").value) == "3"
    assert value(variable(flat(pair + both.replace("MORE", "extends Mid(p.m = 4 kg);")), "p.m").value) == "4"
    assert value(variable(flat(pair + both.replace("MORE", "Mid mid(p.m = 5 kg);")), "mid.p.m").value) == "5"
    assert codes(PAIR + "model M  Pair pair; end M;") == ["E0409"]


def test_an_heir_connects_what_its_base_has_connected_elsewhere() -> None:
    base = JOINT + (
        "model Base  frame hook = world * trans({1 m, 0}); Body b; Hinge h(world -> b.a);"
        " Body c(a = b.a); end Base;"
    )
    model = flat(base + "model M  extends Base(h.from = hook, c.a = hook); end M;")
    assert value(definition(model, "h.from").value) == "hook"
    assert value(next(j for j in model.joints if j.name == "c.a").value) == "hook"


def test_what_an_inner_heir_says_loses_against_the_model_around_it() -> None:
    heir = PAIR.replace(" initial p.x ~ 9 m;", "") + "model Heir  extends Pair(p.x = 2 m); end Heir;"
    assert start(flat(heir + "model M  Heir h; end M;"), "h.p.x") == "= 2"
    assert start(flat(heir + "model M  Heir h; initial h.p.x = 3 m; end M;"), "h.p.x") == "= 3"
    assert start(flat(heir + "model M  Heir h(p.x ~ 4 m); end M;"), "h.p.x") == "~ 4"


@pytest.mark.parametrize(
    ("modification", "code"),
    [
        ("mm = 1 kg", "E0401"),
        ("m = 1 s", "E0303"),
        ("m = 1", "E0303"),
        ("der(m) = 1 kg/s", "E0403"),
        ("m = 1 kg, m = 2 kg", "E0409"),
        ("m.k = 1 kg", "E0401"),
        ("x.k = 1 m", "E0402"),
        ("world -> world", "E0408"),
        ("m in {1, 2} kg", "E0809"),
        ("size = {1, 2, 3} m", "E0305"),
        ("m = unknown", "E0201"),
        ("x[1] = 1 m", "E0314"),
    ],
)
def test_wrong_modifications(modification: str, code: str) -> None:
    assert codes(PART + f"model M  Part p({modification}); end M;") == [code]


def test_an_angle_from_a_modified_parameter_without_unit_is_warned_of() -> None:
    part = "model Turn  parameter a0 = 1; coordinate Angle a = a0; kinetic 1/2*1 kg.m^2*der(a)^2; end Turn;"
    (warning,) = said(part + "model M  Turn t(a0 = 30); end M;")
    assert warning.code == "W0303" and warning.span is not None and warning.span.text == "30"


def test_one_mistake_in_an_array_of_components_is_one_error() -> None:
    assert codes(PART + "model M  Part p[10](mm = 1 kg); end M;") == ["E0401"]
    wrong = PART.replace("kinetic 1/2*m", "kinetic 1/2")
    found = said(wrong + "model M  Part p[10]; end M;")
    assert [d.code for d in found] == ["E0301"]
    assert any("in 'p[1]'" in label.text for label in found[0].labels)


def test_a_condition_leaves_a_component_out() -> None:
    text = PART + "model M  structural parameter Boolean two = false; Part p; Part q if two; MORE end M;"
    assert [v.name for v in flat(text.replace("MORE", "")).variables if v.name.endswith("x")] == ["p.x"]
    two = flat(text.replace("MORE", "output s = if two then q.x else 0;"), structural={"two": True})
    assert value(definition(two, "s").value) == "q.x"
    assert (
        value(definition(flat(text.replace("MORE", "output s = if two then q.x else 0;")), "s").value) == "0"
    )
    assert codes(text.replace("MORE", "output s = q.x;")) == ["E0216"]


def test_components_may_contain_themselves_while_a_condition_holds() -> None:
    tree = """
model Tree
  structural parameter Integer depth = 0;
  parameter m = 1 kg;
  Tree branch[2](depth = depth - 1, m = m/2) if depth > 0;
end Tree;
model M  Tree t(depth = 3); end M;
"""
    model = flat(tree)
    assert len(model.variables) == 1 + 2 + 4 + 8
    assert value(variable(model, "t.branch[2].branch[1].m").value) == "t.branch[2].m/2"
    assert codes(tree.replace("if depth > 0", "")) == ["E0406"]


def test_partial_and_unknown_models_cannot_be_components() -> None:
    assert codes("partial model P end P; model M  P p; end M;") == ["E0407"]
    assert codes("model M  Parrt p; end M;") == ["E0203"]
    assert codes("function f(x) = x; model M  f p; end M;") == ["E0203"]


def test_slices_of_component_arrays_are_vectors() -> None:
    model = flat(PART + "model M  Part p[3]; output xs = p.x; output first = p[1].size[2]; end M;")
    assert value(definition(model, "xs").value) == "{p[1].x, p[2].x, p[3].x}"
    assert definition(model, "xs").type.shape == (3,)
    assert value(definition(model, "first").value) == "p[1].size[2]"


@pytest.mark.parametrize(
    ("reference", "code"),
    [
        ("p[4].x", "E0314"),
        ("p[0].x", "E0314"),
        ("p.y", "E0202"),
        ("p", "E0213"),
        ("p[1, 2].x", "E0316"),
        ("p[1]", "E0213"),
        ("p[1].x.y", "E0202"),
        ("p[1].size[3]", "E0314"),
        ("p[1].x[1]", "E0316"),
        ("q[1].x", "E0201"),
    ],
)
def test_wrong_references(reference: str, code: str) -> None:
    assert codes(PART + f"model M  Part p[3]; output y = {reference}; end M;") == [code]


# ---------------------------------------------------------------- connections


def test_an_arrow_binds_the_first_two_interface_frames() -> None:
    model = flat(JOINT + "model M  Body b; Hinge h(world -> b.a, angle = 1 rad); end M;")
    assert value(definition(model, "h.from").value) == "world"
    assert value(definition(model, "h.to").value) == "b.a"
    assert definition(model, "b.a").value is None
    (joint,) = model.joints
    assert (joint.name, joint.source, joint.target) == ("h", "h.from", "b.a")
    assert value(joint.value) == "h.from*rot(h.angle)"
    assert joint.coordinates == ("h.angle",) and not joint.cut
    assert [value(c.left) for c in joint.closures] == ["pos(h.to)"]
    assert start(model, "h.angle") == "= 1"


def test_the_long_form_is_the_same() -> None:
    arrow = flat(JOINT + "model M  Body b; cut Hinge h(world -> b.a); end M;")
    named = flat(JOINT + "model M  Body b; cut Hinge h(from = world, to = b.a); end M;")
    assert [j.target for j in named.joints] == [j.target for j in arrow.joints] == ["b.a"]
    assert named.joints[0].cut


def test_targets_are_followed_to_the_free_frame() -> None:
    through = """
model Leg
  frame from;
  frame to;
  Body shank;
  Hinge hip(from -> shank.a);
  cut Hinge foot(shank.a -> to);
end Leg;
model M  Body plate; Leg leg(world -> plate.a); end M;
"""
    model = flat(JOINT + through)
    assert [(j.name, j.source, j.target) for j in model.joints] == [
        ("leg.hip", "leg.hip.from", "leg.shank.a"),
        ("leg.foot", "leg.foot.from", "plate.a"),
    ]
    assert value(definition(model, "leg.hip.from").value) == "leg.from"


def test_arrays_of_frames_are_distributed() -> None:
    model = flat(
        JOINT
        + "model M  frame base[i in 1:2] = world * trans({i*1 m, 0}); Body b[2]; Hinge h[2](base -> b.a); end M;"
    )
    assert value(definition(model, "h[2].from").value) == "base[2]"
    assert value(definition(model, "h[1].to").value) == "b[1].a"


def test_a_value_for_a_free_frame_is_a_weld() -> None:
    text = JOINT + "model M  Body b; Hinge h(world -> b.a); Body c(a = b.a * trans({1 m, 0})); end M;"
    model = flat(text)
    weld = next(j for j in model.joints if j.name == "c.a")
    assert (weld.source, weld.target, weld.coordinates) == ("", "c.a", ())
    assert value(weld.value) == "b.a*trans({1, 0})"
    assert definition(model, "c.a").value is None


def test_joints_need_their_connections() -> None:
    assert codes(JOINT + "model M  Body b; Hinge h; end M;") == ["E0414"]
    assert codes(JOINT + "model M  Body b; Hinge h(world -> 1 m); end M;") == ["E0332"]
    assert codes(JOINT + "model M  cut Body b; end M;") == ["E0413"]


def test_inputs_of_components_are_bound_by_modification() -> None:
    motor = "model Motor  input Force u = 0 N; coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; force u on x; end Motor;"
    free = flat(motor + "model M  Motor motor; end M;")
    assert variable(free, "motor.u").role.value == "input"
    bound = flat(motor + "model M  Motor a; Motor b(u = -2 N/m*a.x); end M;")
    assert [v.name for v in bound.variables if v.role.value == "input"] == ["a.u"]
    assert value(definition(bound, "b.u").value) == "-2*a.x"


def test_structural_parameters_of_components() -> None:
    model = flat(
        "model Grid  structural parameter Integer n = 2; coordinate Length x[n] = 0;"
        " kinetic 1/2*1 kg*dot(der(x), der(x)); end Grid;"
        "model M  Grid a; Grid b(n = a.n + 2); output last = b.x[b.n]; end M;"
    )
    assert variable(model, "b.x").type.shape == (4,)
    assert value(definition(model, "last").value) == "b.x[4]"
    assert model.structural == {"a.n": 2, "b.n": 4}


SIZED = """
model Sized
  structural parameter Integer n = 1;
  parameter Length a[n] = {i*1 m for i in 1:n};
end Sized;
model Mixed
  Sized p[i in 1:3](n = NUMBER);
  Scalar q[i in 1:2](u = if i == 1 then 1 m else 2 s);
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2;
  output all = p.a;
  output most = max(p.a);
  output total = sum(2*p.a);
  STATEMENT
end Mixed;
model Scalar
  input u;
end Scalar;
"""


@pytest.mark.parametrize("number", ["i", "4 - i"])
def test_values_of_several_sizes_are_one_list(number: str) -> None:
    model = flat(SIZED.replace("NUMBER", number).replace("STATEMENT", ""), model="Mixed")
    sizes = [1, 2, 3] if number == "i" else [3, 2, 1]
    each = [f"p[{k + 1}].a[{i + 1}]" for k, n in enumerate(sizes) for i in range(n)]
    assert value(definition(model, "all").value) == "{" + ", ".join(each) + "}"
    assert value(definition(model, "most").value) == "max(" + ", ".join(each) + ")"


@pytest.mark.parametrize("statement", ["output u = q.u;", "output u = sum(q.u);", "let u = max(q.u);"])
def test_values_of_several_units_are_no_array(statement: str) -> None:
    text = SIZED.replace("NUMBER", "1").replace("STATEMENT", statement)
    (wrong,) = said(text, model="Mixed")
    assert (wrong.code, wrong.caption) == ("E0317", "a length (m) in 'q[1]', a time (s) in 'q[2]'")
