"""Faults that are planted in what targets write: ``mechc stress --target`` tells them."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from msgspec import Struct
from parts_of_pages import changed

from mechc.measurement.extremes import TARGET, Extreme
from mechc.measurement.stress import Subject, worker

MODEL = """
parameter m = 2 kg; parameter k = 30 N/m; parameter c = 0.4 N.s/m; parameter A = 5 N; parameter w = 3 rad/s; parameter l = 1 m;
coordinate x = 0.1 m; coordinate a = 0.5 rad; initial der(a) = 1 rad/s;
kinetic 1/2*m*der(x)^2 + 1/2*(1 kg)*(der(x)^2 + 2*l*cos(a)*der(x)*der(a) + l^2*der(a)^2);
potential 1/2*k*x^2 - 1 kg*9.81 m/s^2*l*cos(a);
damping c on x; force push: A*sin(w*time) on x;
output Length tip = x + l*sin(a); output Force spring = k*x;
experiment(k = 40 N/m, stop = 4 s, tolerance = 1e-9);
"""
BALL = """
parameter m = 1 kg; parameter g = 9.81 m/s^2; parameter e = 0.8;
coordinate y = 1 m; kinetic 1/2*m*der(y)^2; potential m*g*y; contact floor: y restitution e;
experiment(stop = 2 s);
"""
WRITERS = {
    "c": ("mechc.exporting", "c_files"),
    "python": ("mechc.exporting", "_module"),
    "fmu": ("mechc.compiler.targets.fmu.export", "emit_c"),
    "web": ("mechc.web.page", "page"),
    "ensemble": ("mechc.compiler.lanes", "emit_lanes"),
}
"""The function that writes the text of each target."""


class Fault(Struct, frozen=True):
    """``pattern`` in what a target writes, which becomes ``wrong`` where it stands first."""

    target: str
    what: str
    pattern: str
    wrong: str
    model: str = MODEL


FAULTS = (
    Fault("c", "another phase of a force", r"A \* sin\(w_ \* t\)", "A * cos(w_ * t)"),
    Fault("c", "another constant", r"real\(9\.81\)", "real(9.80665)"),
    Fault("c", "another start", r"out\[1\] = 0\.5;", "out[1] = 0.05;"),
    Fault("c", "the experiment sets nothing", r"    p\[1\] = 40\.0;\n    set\[1\] = 1;\n", ""),
    Fault("c", "another tolerance", r": 1e-09;", ": 1e-03;"),
    Fault("c", "another output", r"out\[1\] = k \* x;", "out[1] = k * a;"),
    Fault("c", "it ends too early", r": 4\.0;", ": 3.0;"),
    Fault("c", "half of what is dissipated", r"out\[5\] = k5", "out[5] = 0.5 * k5"),
    Fault("c", "another restitution", r"p\[2\] = real\(0\.8\)", "p[2] = real(0.79)", BALL),
    Fault("python", "twice a force", r"0\.5 \* der_a", "der_a"),
    Fault("python", "sizes that are too large", r"tolerance \* np\.array", "1e6 * tolerance * np.array"),
    Fault("python", "another sign of an output", r"(def outputs.*?)k \* x", r"\1-k * x"),
    Fault("python", "the experiment sets nothing", r"\{\*\*\{'k': 40\.0\}", "{**{}"),
    Fault("fmu", "another phase of a force", r"A \* sin\(w_ \* t\)", "A * cos(w_ * t)"),
    Fault("fmu", "damping of the wrong sign", r"\(k5 \* v1 \+", "(-k5 * v1 +"),
    Fault("fmu", "another output", r"x \+ l \* sin", "x - l * sin"),
    Fault("web", "another tolerance", r"e\.web_run\(span\.tolerance", "e.web_run(1e6 * span.tolerance"),
    Fault("web", "another start", r'"y":\[\]', '"y":[[1,0.6]]'),
    Fault("web", "names that are exchanged", r'"name":"x"(.*?)"name":"a"', r'"name":"a"\1"name":"x"'),
    Fault("web", "a run at half its times", r"e\.web_times\((.*?), ?end\);", r"e.web_times(\1, end / 2);"),
    Fault("ensemble", "another phase of a force", r"sin\(", "cos("),
    Fault("ensemble", "half of what is dissipated", r"out\[5\] = (v\d+)", r"out[5] = 0.5 * \1"),
)  # fmt: skip


def planted(text: Any, fault: Fault) -> Any:
    """Return a text, or the files of a target, with a fault in the first place that it fits."""
    if isinstance(text, dict):
        for name, one in text.items():
            if isinstance(one, str) and re.search(fault.pattern, one):
                return {**text, name: planted(one, fault)}
    if isinstance(text, str) and fault.target == "web" and "<!doctype html>" in text:
        return changed(text, lambda inside: planted(inside, fault))
    assert isinstance(text, str) and re.search(fault.pattern, text, re.DOTALL), f"{fault.what} fits nothing"
    return re.sub(fault.pattern, fault.wrong, text, count=1, flags=re.DOTALL)


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f"{f.target}: {f.what}")
def test_a_fault_is_told(fault: Fault, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "driven.mech"
    file.write_text(fault.model, encoding="utf-8")
    extreme = Extreme(TARGET, f"{fault.target}: as stated")
    subject = Subject(str(file), None, {}, None, 10.0)
    whole, name = WRITERS[fault.target]
    module = import_module(whole)
    write = getattr(module, name)
    monkeypatch.setattr(module, name, lambda *given, **more: planted(write(*given, **more), fault))
    row = worker(subject)(extreme)
    assert row.kind == "wrong", (row.kind, row.reason)


@pytest.mark.slow
@pytest.mark.parametrize("target", WRITERS)
def test_what_holds_no_fault_is_right(target: str, tmp_path: Path) -> None:
    for k, text in enumerate((MODEL, BALL)):
        file = tmp_path / f"sound{k}.mech"
        file.write_text(text, encoding="utf-8")
        row = worker(Subject(str(file), None, {}, None, 10.0))(Extreme(TARGET, f"{target}: as stated"))
        assert row.kind == ("refused" if target == "python" and text == BALL else "right"), row.reason
