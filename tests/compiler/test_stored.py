"""What is written of a stage is read as it was: the programs made of it are the same, byte for byte."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import msgspec
import pytest
from compiled import compiled
from differentiable_modules import plain_text
from msgspec.structs import replace

from mechc.compiler import stored
from mechc.compiler.compilation import Compilation
from mechc.compiler.equations import verify as equations
from mechc.compiler.equations.model import Equations
from mechc.compiler.flat import verify as flat
from mechc.compiler.flat.model import FlatModel
from mechc.compiler.flat.operands import written_size
from mechc.compiler.graph import Graph, Table
from mechc.compiler.graph import verify as graphs
from mechc.compiler.graph.columns import columns, graph_of
from mechc.compiler.mechanics.build import build
from mechc.compiler.mechanics.show import show
from mechc.compiler.pipeline import compile_source
from mechc.compiler.program import Program, lower
from mechc.compiler.stored import OtherVersion, read, write
from mechc.compiler.targets.c import emit_c
from mechc.lang.diagnostics import Reporter
from mechc.lang.read import read_source

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.mech"))
TELLING = (
    *("bouncing_ball", "catapult", "coulomb_pendulum", "double_pendulum", "five_bar", "heavy_symmetric_top"),
    *("kepler", "stewart_platform", "squeezing_mechanism", "tilted_rod", "universal_joint_shaft"),
)
"""With events, friction, loops, rotations, drives, experiments."""

TEXT = """
coordinate x = 1 m;
kinetic 1/2*2 kg*der(x)^2;
potential 3 N*x;
experiment(stop = 1 s);
"""


def check(model: Compilation) -> None:
    """The program, that made of the equations, and the system made of the flat model."""
    program = read(write(model.program), Program)
    assert program == model.program
    made = read(write(model.equations), Equations)
    equations.verify(made)
    assert lower(made, hoist="constants" not in model.parts) == model.program
    again = read(write(model.flat), FlatModel)
    flat.verify(again)
    assert again == model.flat
    assert show(build(again, Reporter())) == show(model.system)


def example(path: Path) -> Compilation:
    return compile_source(read_source(path), search=(path.parent,))


@pytest.mark.parametrize("name", TELLING)
def test_telling_examples_come_back(name: str) -> None:
    check(example(ROOT / "examples" / f"{name}.mech"))


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_all_examples_come_back(path: Path) -> None:
    check(example(path))


@pytest.mark.parametrize("name", ["bouncing_ball", "kepler"])
def test_the_texts_are_the_same(name: str) -> None:
    model = example(ROOT / "examples" / f"{name}.mech")
    program = lower(read(write(model.equations), Equations))
    assert emit_c(program) == emit_c(model.program)
    assert plain_text(program) == plain_text(model.program)


def test_parts_come_back() -> None:
    check(compiled(TEXT, parts={"jacobian", "momenta", "constants"}))


def test_equations_without_values_come_back() -> None:
    check(compiled(TEXT, by_value=False))


def test_numbers_of_any_size_come_back() -> None:
    """Python's own texts of whole numbers end at 4300 digits, those of msgpack at 64 bits."""
    model = compiled(TEXT).flat
    huge = replace(model, structural={"n": Fraction(10**5000 + 1, 3), "k": Fraction(-1, 10**30)})
    assert read(write(huge), FlatModel) == huge


def test_what_functions_share_is_written_once() -> None:
    """The argument of twelve squares within each other is twelve nodes, not 2^12."""
    nested = "square(" * 12 + "x/1 m" + ")" * 12
    model = compiled(f"function square(Real x) = x*x;\n{TEXT}output deep = {nested};").flat
    deep = model.definitions[0].value
    assert deep is not None and written_size(deep) > 2**12
    assert len(write(model)) < 3000
    assert read(write(model), FlatModel) == model


def test_tables_come_back() -> None:
    check(compiled(TEXT + "potential table(x, {0, 1, 3} m, {0, 1, 2} J);"))


@pytest.mark.parametrize("by_value", [True, False])
def test_expressions_are_built_in_a_graph_that_was_read(by_value: bool) -> None:
    """As in the one that was written: what is there is found, what is new is new."""
    g = Graph(by_value=by_value)
    x, y = g.symbol("x"), g.symbol("y")
    forgotten = g.exp(x)
    table = g.add_table(Table((0.0, 1.0), (0.0, 2.0), (2.0, 2.0)))
    kept = [
        *(g.add(x, y), g.neg(g.mul(x, y)), g.div(x, y), g.sin(x), g.select(g.less(x, y), x, g.sqrt(y))),
        *(g.lookup(table, x), g.constant(Fraction(1, 3))),
    ]
    made, row = columns(g, kept)
    h = graph_of(made)
    graphs.verify(h)
    a, b = h.symbol("x"), h.symbol("y")
    again = [
        *(h.add(a, b), h.neg(h.mul(a, b)), h.div(a, b), h.sin(a), h.select(h.less(a, b), a, h.sqrt(b))),
        *(h.lookup(table, a), h.constant(Fraction(1, 3))),
    ]
    assert again == [row[n] for n in kept]
    count = len(h)
    h.exp(a)
    assert forgotten not in row and len(h) == count + 1
    graphs.verify(h)


# ---------------------------------------------------------------- other versions


def test_bytes_of_other_versions_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    data = write(compiled(TEXT).program)
    read(data, Program)
    monkeypatch.setattr(stored, "VERSION", stored.VERSION + 1)
    with pytest.raises(OtherVersion, match="another version"):
        read(data, Program)


def test_a_field_more_is_another_version(monkeypatch: pytest.MonkeyPatch) -> None:
    data = write(compiled(TEXT).program)
    before = stored._fingerprint()

    class Program2(msgspec.Struct, frozen=True):
        name: str

    known = (*stored._classes(), Program2)
    stored._fingerprint.cache_clear()
    monkeypatch.setattr(stored, "_classes", lambda: known)
    try:
        assert stored._fingerprint() != before
        with pytest.raises(OtherVersion, match="another version"):
            read(data, Program)
    finally:
        stored._fingerprint.cache_clear()


def test_bytes_of_another_stage_are_refused() -> None:
    with pytest.raises(OtherVersion, match="hold Program, not Equations"):
        read(write(compiled(TEXT).program), Equations)


@pytest.mark.parametrize("data", [b"", b"nonsense", msgspec.msgpack.encode(["other", 1, "", "", [], 0])])
def test_what_is_no_stage_is_refused(data: bytes) -> None:
    with pytest.raises(OtherVersion, match="hold no stage"):
        read(data, Program)


def test_half_of_the_bytes_are_refused() -> None:
    data = write(compiled(TEXT).program)
    with pytest.raises(OtherVersion):
        read(data[: len(data) // 2], Program)
