"""Long functions are lowered in columns: the same statements as those of short ones, one by one."""

from fractions import Fraction
from importlib import import_module

import pytest

from mechc.compiler import stored
from mechc.compiler.equations.model import Equations
from mechc.compiler.graph import operations as ops
from mechc.compiler.pipeline import compile_source
from mechc.compiler.program.model import (
    Literal,
    Load,
    LongBody,
    Operate,
    Program,
    Store,
    codes_of,
    operands_of,
    places_of,
)
from mechc.lang.source import SourceFile

lowering = import_module("mechc.compiler.program.lower")  # a function has its name in the package

PAIRS = """
model Pairs
  dimensionless;
  structural parameter Integer n = 5;
  parameter Real m[n] = 1;
  parameter G = 2;
  parameter k = 2*G + m[1];
  parameter h = k^2/3;
  input u;
  coordinate Real r[n, 2] = {{i, i^2/5} for i in 1:n};
  for i in 1:n loop
    kinetic 1/2*m[i]*dot(der(r[i]), der(r[i]));
    potential if r[i, 1] > 0 then h*r[i, 1]^2 else table(r[i, 2], {-9, 0, 1, 9}, {1, 2, 4, 5});
    force -k*der(r[i, 1])*(if u > 1 then u else 1) on r[i, 1];
    for j in i+1:n loop
      potential -G*m[i]*m[j]/norm(r[i] - r[j]);
    end for;
  end for;
  output sum = 7/3 + u*sin(r[1, 1])*cos(r[1, 1]);
  experiment(stop = 1);
end Pairs;
"""


@pytest.fixture(scope="module")
def equations() -> Equations:
    return compile_source(SourceFile("pairs.mech", PAIRS), structural={"n": Fraction(5)}).equations


@pytest.fixture(scope="module")
def programs(equations: Equations) -> tuple[Program, Program]:
    """The program as statements, and in columns."""
    with pytest.MonkeyPatch.context() as patch:
        plain = lowering.lower(equations)
        patch.setattr(lowering, "LONG", 3)
        patch.setattr(lowering, "SHORT", 0)
        return plain, lowering.lower(equations)


def test_columns_hold_the_same_statements(programs: tuple[Program, Program]) -> None:
    plain, long = programs
    seen: set[int] = set()
    for one, other in zip(
        (plain.parameters_function, *plain.functions),
        (long.parameters_function, *long.functions),
        strict=True,
    ):
        (body,), (columns,) = one.bodies, other.bodies
        assert isinstance(body, tuple)
        assert isinstance(columns, LongBody)
        assert tuple(columns) == body
        assert [columns[k] for k in range(len(body))] == list(body)
        assert columns[1:7] == body[1:7]
        assert columns == LongBody.of(body)
        assert columns != LongBody.of(body[:-1])
        assert one.operations == other.operations
        assert codes_of(columns) == codes_of(body)
        codes = sorted(codes_of(body))[::2]
        assert places_of(columns, codes) == places_of(body, codes)
        seen |= codes_of(body)
    assert {ops.LOOKUP, ops.SELECT} <= seen
    assert any(s.guarded for s in plain.parameters_function.bodies[0] if isinstance(s, Store))
    assert plain.narrow == long.narrow
    assert plain.bent == long.bent


def test_order_of_making_puts_stores_behind_what_they_store(programs: tuple[Program, Program]) -> None:
    for function in (programs[1].parameters_function, *programs[1].functions):
        (body,) = function.bodies
        assert sorted(function.made) == [k for k, s in enumerate(body) if not isinstance(s, Load | Literal)]
        done = {k for k, s in enumerate(body) if isinstance(s, Load | Literal)}
        leaves = set(done)
        late = False
        for k in function.made:
            assert done.issuperset(operands_of(body[k]))
            done.add(k)
            statement = body[k]
            if isinstance(statement, Store) and not statement.guarded:
                late |= statement.value in leaves
            elif function.name != "parameters":
                assert not late, "stores of leaves come last"
            if isinstance(statement, Store) and statement.guarded:
                assert set(range(k)) <= done, "nothing is moved before a guarded store"


def test_columns_are_stored_and_read(programs: tuple[Program, Program]) -> None:
    for program in programs:
        again = stored.read(stored.write(program), Program)
        assert again == program
        assert all(
            type(f.bodies[0]) is type(g.bodies[0])
            for f, g in zip(again.functions, program.functions, strict=True)
        )
    assert programs[0] != programs[1]


def test_statement_of_columns_shows_its_own_operands_only() -> None:
    body = (
        Load("u", 3),
        Literal(Fraction(1, 3)),
        Operate(ops.SUB, (0, 1)),
        Operate(ops.SQRT, (2,)),
        Store("p", 4, 3, True),
    )
    assert tuple(LongBody.of(body)) == body
