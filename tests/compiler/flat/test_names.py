"""Files, imports, scopes and inheritance."""

from __future__ import annotations

from pathlib import Path

import pytest
from flat_models import codes, definition, flat, rate, said, start, value, variable

from mechc.compiler.flat.flatten import flatten
from mechc.lang.diagnostics import CompileError, Reporter
from mechc.lang.parser import parse
from mechc.lang.read import read_source


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """Return a folder with files that import each other."""
    (tmp_path / "parts.mech").write_text(
        "import more.*;\n"
        "model Part  parameter m = 1 kg; coordinate x = 0 m; kinetic 1/2*double(m)*der(x)^2; end Part;\n"
        "function double(x) = 2*x;\n"
        'type Rigidity = unit "N.m^2";\n'
    )
    (tmp_path / "more.mech").write_text(
        "import parts.*;\nmodel Pair  Part a; Part b; end Pair;\nfunction double(x) = x;\n"
    )
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "inner.mech").write_text("model Inner  parameter k = 1; end Inner;\n")
    return tmp_path


@pytest.mark.parametrize(
    ("imports", "type"),
    [
        ("import parts.*;", "Part"),
        ("import parts;", "parts.Part"),
        ("import P = parts;", "P.Part"),
        ("import parts.{Part};", "Part"),
        ("import parts.Part;", "Part"),
        ("import Q = parts.Part;", "Q"),
        ("import parts.*; import parts.{Part};", "Part"),
    ],
)
def test_forms_of_import(library: Path, imports: str, type: str) -> None:
    model = flat(f"{imports} model M  {type} p; end M;", folder=library)
    assert [v.name for v in model.variables] == ["p.m", "p.x"]


def test_a_file_sees_its_own_names_first_and_files_may_import_each_other(library: Path) -> None:
    model = flat("import more.*; model M  Pair p; end M;", folder=library)
    assert [value(e.value) for e in model.energies] == [
        "0.5*(2*p.a.m)*der(p.a.x)^2",
        "0.5*(2*p.b.m)*der(p.b.x)^2",
    ]


def test_folders_below_and_functions_and_types_of_other_files(library: Path) -> None:
    text = "import deep.inner.*; import P = parts; model M  Inner i; parameter P.Rigidity e = 1 N.m^2; let d = P.double(i.k); end M;"
    model = flat(text, folder=library)
    assert value(definition(model, "d").value) == "2*i.k"


def test_the_search_path(
    library: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path_factory.mktemp("other")
    text = "import parts.*; model M  Part p; end M;"
    assert codes(text, folder=other) == ["E0205"]
    monkeypatch.setenv("MECHPATH", str(library))
    assert codes(text, folder=other) == []


@pytest.mark.parametrize(
    ("text", "code", "help"),
    [
        ("import partz.*; model M  Part p; end M;", "E0205", "did you mean 'parts'?"),
        ("import mech.planr.*; model M  Bar p; end M;", "E0205", "did you mean 'mech.planar'?"),
        ("import parts.{Prat}; model M  Prat p; end M;", "E0206", "did you mean 'Part'?"),
        ("import parts.*; model M  Prat p; end M;", "E0203", "did you mean 'Part'?"),
        ("import P = parts; model M  Part p; end M;", "E0203", ""),
        (
            "import parts.*; import more.*; model M  let d = double(1); end M;",
            "E0208",
            "import the one that is meant by name",
        ),
        ("model M  parameter lenght = 1 m; let d = 2*length; end M;", "E0201", "did you mean 'lenght'?"),
        ("import parts.*; model M  Part p; let d = p.M; end M;", "E0202", "did you mean 'm'?"),
        ("import parts.*; model M  Part p; let d = x; end M;", "E0201", ""),
        ("coordinate Length x = 0; kinetic 1/2*1 kg*xdot^2;", "E0201", "the rate of 'x' is written 'der(x)'"),
        ("coordinate Length x = 0; let v = dx_dt;", "E0201", "the rate of 'x' is written 'der(x)'"),
        ("let a = 9.81 m / s^2;", "E0201", "a unit has no blanks inside: '9.81 m/s^2'"),
        ("let a = 2.5e3 N * m;", "E0201", "a unit has no blanks inside: '2.5e3 N.m'"),
        ("let a = 5 N/s / m;", "E0201", "a unit has no blanks inside: '5 N/s/m'"),
        ("let a = x2 / s;", "E0201", ""),
        ("let a = t;", "E0201", "the time is called 'time'"),
        (
            "parameter lift = 1 m; function f(Real x) -> Length = lift*x; let d = f(2);",
            "E0201",
            "a function sees its arguments, and what its body declares before in the same block or around it; "
            "give it 'lift' as an argument",
        ),
        ("let a = np.sin(1);", "E0209", "write 'sin(..)'"),
        ("let a = ln(2);", "E0209", "write 'log(..)'"),
        ("let a = pow(2, 3);", "E0209", "a power is written 'x^y'"),
        (
            "coordinate Length x = 0; equation der(x) = 1 m/s;",
            "E0421",
            "its motion follows from 'kinetic', "
            "'potential' and 'force'; 'der(..)' is its rate wherever that is needed",
        ),
        (
            "state v = 0 m/s; equation 1 kg*der(v) = 1 N;",
            "E0421",
            "solve it for the rate: 'equation der(v) = 1 N/(1 kg);'",
        ),
        ("gravity {0, -9.81};", "E0323", "write '{0, -9.81} m/s^2'"),
        ("point P = world * {1, 2};", "E0304", "write '{1, 2} m'"),
        ("state e;", "E0327", "write for example 'state Length e;'"),
        ("model world  end world;", "E0211", ""),
        ("model A  end A; model A  end A;", "E0204", ""),
        ("model M  parameter a = 1; coordinate a = 0 m; end M;", "E0204", ""),
        ("model M  coordinate a = 0 m; constraint a: a = 0; end M;", "E0204", ""),
        ("model M  coordinate a = 0 m; constraint c: a = 0; constraint c: a = 1 m; end M;", "E0204", ""),
    ],
)
def test_wrong_names(library: Path, text: str, code: str, help: str) -> None:
    found = said(text, folder=library)
    assert [d.code for d in found] == [code]
    assert help in found[0].help


def test_mistakes_in_imported_files_are_reported_there(library: Path) -> None:
    (library / "wrong.mech").write_text("model Wrong  parameter m = 1 kg + 1 m; end Wrong;\n")
    found = said("import wrong.*; model M  Wrong w; end M;", folder=library)
    assert [d.code for d in found] == ["E0302"]
    assert found[0].span is not None and Path(found[0].span.file.name).name == "wrong.mech"
    assert [label.text for label in found[0].labels][-1] == "in 'w', which is a Wrong"
    (library / "torn.mech").write_text("model Torn  parameter = ;\n")
    assert all(c.startswith("E01") for c in codes("import torn.*; model M  Torn w; end M;", folder=library))


# ---------------------------------------------------------------- which model


def test_the_last_whole_model_is_the_default() -> None:
    text = "model A  parameter a = 1; end A; model B  parameter b = 1; end B; partial model C  end C;"
    assert flat(text).name == "B"
    assert flat(text, model="A").name == "A"
    assert codes(text, model="D") == ["E0214"]
    assert codes(text, model="C") == ["E0214"]
    assert codes("function f(x) = x;") == ["E0214"]


def test_bare_statements_are_a_model_named_after_the_file(tmp_path: Path) -> None:
    path = tmp_path / "my-pendulum.mech"
    path.write_text("parameter m = 1 kg;\n")
    reporter = Reporter()
    assert flatten(parse(read_source(path, reporter), reporter), reporter).name == "my_pendulum"


def test_a_missing_file_is_no_traceback(tmp_path: Path) -> None:
    with pytest.raises(CompileError):
        read_source(tmp_path / "missing.mech", Reporter())


# ---------------------------------------------------------------- inheritance

BASE = """
partial model Oscillator
  parameter m = 1 kg;
  parameter Stiffness k = 10 N/m;
  coordinate Length x = 0.1 m;
  kinetic 1/2*m*der(x)^2;
  experiment(stop = 1 s);
  experiment slow(stop = 9 s);
end Oscillator;
"""


def test_statements_of_the_bases_come_first() -> None:
    model = flat(BASE + "model M  potential 1/2*k*x^2; parameter c = 1; extends Oscillator(m = 2 kg); end M;")
    assert [v.name for v in model.variables] == ["m", "k", "x", "c"]
    assert [e.kind for e in model.energies] == ["kinetic", "potential"]
    assert value(variable(model, "m").value) == "2"


def test_experiments_are_inherited_and_replaced_by_name() -> None:
    model = flat(
        BASE + "model M  extends Oscillator; experiment(stop = 3 s); experiment new(stop = 4 s); end M;"
    )
    assert {e.name: value(e.options["stop"]) for e in model.experiments} == {"": "3", "slow": "9", "new": "4"}


def test_a_base_of_two_bases_counts_once() -> None:
    text = BASE + (
        "partial model A  extends Oscillator; damping 1 N.s/m on x; end A;"
        "partial model B  extends Oscillator; potential 1/2*k*x^2; end B;"
        "model M  extends A; extends B; end M;"
    )
    model = flat(text)
    assert len(model.energies) == 2 and len(model.dampings) == 1


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("model M  extends Oscilator; end M;", "E0203"),
        ("model M  extends M; end M;", "E0405"),
        ("model M  extends Oscillator(mm = 1 kg); end M;", "E0401"),
        ("model M  extends Oscillator(m = 1 s); end M;", "E0303"),
        ("model M  extends Oscillator; parameter m = 2 kg; end M;", "E0204"),
        ("model N  parameter k = 1; end N; model M  extends Oscillator; extends N; end M;", "E0204"),
        ("model M  extends Oscillator(m = 1 kg, m = 2 kg); end M;", "E0409"),
    ],
)
def test_wrong_inheritance(text: str, code: str) -> None:
    assert codes(BASE + text) == [code]


MOVING = "coordinate x = 0; kinetic 1/2*der(x)^2;"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (f"dimensionless; model M  {MOVING} end M;", ["E0217"]),
        (f"model M  {MOVING} end M; experiment(stop = 1 s);", ["E0217"]),
        ("parameter g = 9.81 m/s^2; model M  coordinate x = 0 m; gravity {0, -g}; end M;", ["E0217"]),
        (f"model M  dimensionless; {MOVING} end M;", []),
        (f"model M  dimensionless; {MOVING} end M; dimensionless; M m;", []),
        (f"dimensionless; {MOVING}", []),
        (f"dimensionless; {MOVING} model M  dimensionless; {MOVING} end M;", []),
        ("function f(x) = x; parameter a = 1; output y = f(a)*time;", []),
    ],
)
def test_bare_statements_beside_models(text: str, expected: list[str]) -> None:
    assert [d.code for d in said(text) if d.code != "W0402"][:1] == expected


def test_loose_statements_of_an_imported_file_are_told(tmp_path: Path) -> None:
    (tmp_path / "parts.mech").write_text(f"dimensionless; model Part  {MOVING} end Part;", encoding="utf-8")
    assert "E0217" in codes("import parts.*; model M  dimensionless; Part p; end M;", folder=tmp_path)


def test_equal_declarations_of_two_bases_are_one() -> None:
    text = (
        "partial model A  parameter g = 9.81 m/s^2; end A; partial model B  parameter g = 9.81 m/s^2; end B;"
    )
    model = flat(text + "model M  extends A; extends B; end M;")
    assert [v.name for v in model.variables] == ["g"]


# ---------------------------------------------------------------- initial values

STARTED = """
model Base
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  {base}
end Base;
model Heir
  extends Base{extends};
  {heir}
end Heir;
model M
  Heir h{modified};
  {outer}
end M;
"""


@pytest.mark.parametrize(
    ("base", "extends", "heir", "modified", "outer", "expected"),
    [
        ("", "", "", "", "", "= 1"),
        ("initial x ~ 2 m;", "", "", "", "", "~ 2"),
        ("initial x = 2 m;", "", "initial x = 3 m;", "", "", "= 3"),
        ("initial x = 2 m;", "(x = 4 m)", "initial x = 3 m;", "", "", "= 4"),
        ("initial x = 2 m;", "(x = 4 m)", "initial x = 3 m;", "(x ~ 5 m)", "", "~ 5"),
        ("", "", "initial x = 3 m;", "", "initial h.x = 6 m;", "= 6"),
        ("", "(x = 4 m)", "", "", "initial h.x = 6 m;", "= 6"),
    ],
)
def test_precedence_of_initial_values(
    base: str, extends: str, heir: str, modified: str, outer: str, expected: str
) -> None:
    text = STARTED.format(base=base, extends=extends, heir=heir, modified=modified, outer=outer)
    assert start(flat(text), "h.x") == expected


def test_an_outer_heir_states_more_than_the_extends_of_an_inner_one() -> None:
    heirs = STARTED.format(base="", extends="(x = 4 m)", heir="", modified="", outer="")
    outermost = "model Top  extends Heir; initial x = 7 m; end Top;"
    assert start(flat(heirs + outermost), "x") == "= 7"
    assert start(flat(heirs + outermost.replace("Heir;", "Heir(x = 5 m);")), "x") == "= 5"
    assert start(flat(heirs + outermost.replace("initial x = 7 m;", "")), "x") == "= 4"


def test_two_initial_values_at_one_level_contradict() -> None:
    two = {"base": "", "extends": "", "heir": "", "modified": "", "outer": ""}
    assert codes(STARTED.format(**{**two, "heir": "initial x = 3 m; initial x = 3 m;"})) == ["E0409"]
    assert codes(STARTED.format(**{**two, "modified": "(x = 1 m)", "outer": "initial h.x = 2 m;"})) == [
        "E0409"
    ]


def test_two_initial_rates_are_called_rates() -> None:
    (found,) = said(
        STARTED.format(
            base="", extends="", heir="initial der(x) = 3 m/s; initial der(x) = 2 m/s;", modified="", outer=""
        )
    )
    assert found.message == "'der(h.x)' is given two initial values at the same level"


@pytest.mark.parametrize(
    ("given", "help"),
    [
        ("w[2, :].x", "{w[2, i].x for i in 1:3}"),
        ("w[1:2, 2].x", "{w[i, 2].x for i in 1:2}"),
        ("w[1:2, :].x", "{w[i, j].x for i in 1:2, j in 1:3}"),
        ("w[:, :].x", "a name without an index stands for all of them, as in 'w.x'"),
    ],
)
def test_ranges_of_components_of_two_indices(given: str, help: str) -> None:
    """Of one row, the name without index was recommended, which stands for all rows."""
    part = "model P  coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2; end P;"
    (found,) = said(f"{part} model M  P w[2, 3]; let a = {given}; end M;")
    assert found.code == "E0316" and help in found.help


def test_rates_and_elements() -> None:
    model = flat(
        "coordinate Length r[2] = 0; coordinate Rotation R = rotz(1 rad); kinetic 1/2*1 kg*dot(der(r), der(r));"
        "initial r[2] = 5 m; initial der(r) = {1, 2} m/s; initial der(r[1]) ~ 3 m/s; initial der(R) = {0, 0, 2 rad/s};"
    )
    r = variable(model, "r")
    assert start(model, "r") == "= {0, 0}" and rate(model, "r") == "= {1, 2}"
    assert {i: value(s.value) for i, s in r.starts.items()} == {(1,): "5"}
    assert {i: (value(s.value), s.guess) for i, s in r.rates.items()} == {(0,): ("3", True)}
    assert rate(model, "R") == "= {0, 0, 2}"


def test_initial_rates_of_all_components() -> None:
    part = "model Part  coordinate Angle a = 0; kinetic 1/2*1 kg.m^2*der(a)^2; end Part;"
    model = flat(part + "model M  Part p[2]; initial der(p.a) = {1, 2} rad/s; initial p.a ~ 3 rad; end M;")
    assert [rate(model, f"p[{k}].a") for k in (1, 2)] == ["= 1", "= 2"]
    assert [start(model, f"p[{k}].a") for k in (1, 2)] == ["~ 3", "~ 3"]


def test_a_stronger_value_of_the_whole_replaces_weaker_ones_of_elements() -> None:
    part = "model Part  coordinate Length r[2] = 0; kinetic 1/2*1 kg*dot(der(r), der(r)); initial r[2] = 5 m; end Part;"
    inner = variable(flat(part + "model M  Part p; end M;"), "p.r")
    assert {i: value(s.value) for i, s in inner.starts.items()} == {(1,): "5"}
    outer = variable(flat(part + "model M  Part p(r = {7, 8} m); end M;"), "p.r")
    assert outer.starts == {} and outer.start is not None and value(outer.start.value) == "{7, 8}"
    single = variable(flat(part + "model M  Part p(r[1] ~ 9 m); end M;"), "p.r")
    assert {i: (value(s.value), s.guess) for i, s in single.starts.items()} == {
        (1,): ("5", False),
        (0,): ("9", True),
    }


def test_initial_conditions_on_expressions() -> None:
    model = flat(
        "coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; initial momentum(x) = 2 kg.m/s; initial energy() ~ 3 J;"
    )
    assert [(value(i.target), value(i.start.value), i.start.guess) for i in model.initials] == [
        ("momentum(x)", "2", False),
        ("energy()", "3", True),
    ]


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("initial x = 1 s;", "E0303"),
        ("initial y = 1 m;", "E0201"),
        ("initial m = 1 kg;", "E0420"),
        ("initial der(s) = 1 N;", "E0303"),
        ("initial der(x, 2) = 1 m/s;", "E0303"),
        ("initial der(x, 3) = 1 m/s^3;", "E0590"),
        ("initial x + x = 1 s;", "E0303"),
        ("initial world = 1;", "E0420"),
    ],
)
def test_wrong_initial_statements(statement: str, code: str) -> None:
    text = "parameter m = 1 kg; coordinate x = 0 m; kinetic m*der(x)^2; state s = 1 N; equation der(s) = 0;"
    assert codes(text + statement) == [code]


def test_what_follows_from_a_name_of_two_imports_is_not_told() -> None:
    """The first import was taken to be meant: five further errors told what does not fit its model."""
    text = """
    import mech.rotational.*; import mech.translational.*;
    model P
      coordinate Length x = 1 m;
      kinetic 1/2*1 kg*der(x)^2;
      SpringDamper s(of = x, k = 3 N/m, c = 2 N.s/m);
      SpringDamper s2(of = x, k = 3 N/m);
      output F = s.force;
    end P;
    """
    assert codes(text) == ["E0208"]


@pytest.mark.parametrize("named", ["model sin  parameter k = 1; end sin;", 'type sin = unit "1/m";'])
def test_a_model_or_type_may_be_called_as_a_function_of_the_language(named: str) -> None:
    model = flat(
        f"{named} model M  coordinate Angle a = 1 rad; kinetic 1/2*1 kg.m^2*der(a)^2; potential 1 J*sin(a); output y = sin(a); end M;"
    )
    assert [value(e.value) for e in model.energies][1:] == ["1*sin(a)"]
    assert [d.name for d in model.definitions if d.name == "y"] == ["y"]
