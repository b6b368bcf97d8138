"""Dissipations that are dry friction are told before a run, with what to write instead."""

from __future__ import annotations

import pytest

import mechc
from mechc.runtime.native.build import find_compiler

MODEL = (
    "parameter c = 2 N; parameter d = 1 N.s/m; coordinate Length q = 1 m; coordinate Length p = 0 m;"
    "kinetic 1/2*1 kg*(der(q)^2 + der(p)^2); potential 1/2*10 N/m*(q^2 + p^2); damping d on p;"
    "potential 1 mN*c/(1 N)*q; {} experiment(stop = 3 s);"
)
FORM = "friction F on s;"
WARNED = {
    "dissipation c*abs(der(q));": "friction c on q;",
    "dissipation abs(der(q))*1 N;": FORM,
    "dissipation 2 N * abs(der(q - p));": "friction 2 N on q - p;",
    "dissipation (c + 1 N)*abs(der(q));": "friction (c + 1 N) on q;",
    "dissipation 1/2*d*der(q)^2 + c*abs(der(q));": FORM,
    "dissipation c*sqrt(der(q)^2);": FORM,
    "dissipation c*max(der(q), -der(q));": FORM,
    "dissipation c*norm({der(q), der(p)});": FORM,
}
QUIET = (
    "dissipation 1/2*d*der(q)^2;",
    "dissipation 1e6*d*der(q)^2;",
    "dissipation 1/3*d/(1 m/s)*abs(der(q))^3;",
    "dissipation c*abs(der(q) - 1 m/s);",
    "dissipation c*0.01 m/s*(sqrt(1 + (der(q)/(0.01 m/s))^2) - 1);",
    "dissipation d*der(q)*abs(der(q));",
    "friction c on q;",
)


def warnings(statement: str) -> list[str]:
    model = mechc.loads(MODEL.replace("{}", statement))
    return [w.help for w in model.diagnostics if w.code == "W0566"]


@pytest.mark.parametrize("statement", WARNED)
def test_dry_friction_is_told_with_what_to_write(statement: str) -> None:
    (told,) = warnings(statement)
    assert f"'{WARNED[statement]}'" in told


@pytest.mark.parametrize("statement", QUIET)
def test_what_is_smooth_at_rest_or_bends_elsewhere_is_not(statement: str) -> None:
    assert warnings(statement) == []


def test_a_bushing_between_turned_frames_of_moving_bodies_is_smooth() -> None:
    """Its formula is a sum of many products of quaternions, so that the square of a small velocity has a large factor."""
    model = mechc.loads(
        "import mech.spatial.*; import mech.elements.*; Body a(J = identity(3)*1 kg.m^2); Body b(J = identity(3)*1 kg.m^2);"
        "Free one(world -> a.a); Free two(a.a -> b.a);"
        "Bushing bush(a.a * trans({0.1, 0.2, 0} m) * rotz(40 deg) -> b.a, C = 3*identity(3) N.s/m);"
    )
    assert "W0566" not in [w.code for w in model.diagnostics]


@pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
def test_what_is_advised_runs_where_the_dissipation_stops() -> None:
    """A block of 1 kg on a spring of 10 N/m: 1 m, -0.6 m, 0.2 m, where 2 N hold it."""
    model = mechc.loads(MODEL.replace("{}", "friction c on q;").replace("1 mN*", "0 mN*"))
    solution = model.simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    assert solution["q"][-1] == pytest.approx(0.2, abs=1e-7) and solution["der(q)"][-1] == 0
