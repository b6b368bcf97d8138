"""The playground: the compiler without NumPy, the facts of a page from a run in it, and, in a browser, text that moves."""

from __future__ import annotations

import base64
import functools
import io
import json
import os
import re
import shutil
import subprocess
import sys
import threading
import zipfile
from collections.abc import Iterator, Sequence
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsers import needs_browser, running_browser, waited
from firefox import needs_firefox, running_firefox
from parts_of_pages import parts_of

import mechc
from mechc.cli.main import run
from mechc.compiler.pipeline import compile_source
from mechc.compiler.targets.wasm.link import linked
from mechc.editor.playground import FILE, Playground
from mechc.lang.source import SourceFile
from mechc.web.kernels import kernel_for, loaded
from mechc.web.run_facts import RunFacts, facts_of

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = ROOT / "examples"

SWING = """
model Swing
  parameter m(min = 0.1 kg) = 1 kg;
  parameter l = 80 cm;
  input Torque M = 0.1 N.m;
  coordinate theta = 40 deg;
  coordinate Length x = 0 m;
  initial der(x) = 0 m/s;
  kinetic 1/2*m*l^2*der(theta)^2 + 1/2*m*der(x)^2;
  potential -m*9.81 m/s^2*l*cos(theta);
  torque M on theta;
  draw sphere(5 cm) at {l*sin(theta), -l*cos(theta)};
  experiment(stop = 2 s, der(theta) = 1 rad/s, tolerance = 1e-10);
end Swing;
"""

WRONG = {
    "a unit": SWING.replace("-m*9.81 m/s^2*l*cos(theta)", "-m*9.81 m/s^2*cos(theta)"),
    "two names": SWING.replace("cos(theta)", "cos(thta)").replace("sphere(5 cm)", "sphere(r)"),
    "half written": SWING.partition("  potential")[0],
    "nothing": "",
    "no stop": SWING.replace("experiment(stop = 2 s, der(theta) = 1 rad/s, tolerance = 1e-10);", ""),
    "a curve": (EXAMPLES / "curves" / "thrown.mech").read_text(encoding="utf-8"),
    "no step": SWING.replace("tolerance = 1e-10", 'method = "rk4"'),
    "a step": SWING.replace("tolerance = 1e-10", "step = 1 ms"),
    "a method": SWING.replace("tolerance = 1e-10", 'method = "scipy:LSODA"'),
}


def compiled(text: str) -> dict[str, Any]:
    return json.loads(Playground().compile(text))  # type: ignore[no-any-return]


@pytest.mark.parametrize("example", ["double_pendulum", "bouncing_ball", "dzhanibekov"])
def test_nothing_is_imported_that_the_playground_does_not_hold(example: str) -> None:
    text = f"""
import json, sys
from mechc.editor.playground import Playground
made = Playground()
text = open({str(EXAMPLES / f"{example}.mech")!r}, encoding="utf-8").read()
assert "run" in json.loads(made.compile(text)), made
assert json.loads(made.complete(text + "coordinate q = 1 ", len(text) + 17))
held = {{name.partition(".")[0] for name in sys.modules}}
print(len(made.module()), sorted(held & {{"numpy", "scipy", "sympy", "mpmath", "lark", "click", "lsprotocol", "pygls"}}))
"""
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, cwd=ROOT)
    assert done.stderr == "" and done.stdout.endswith(" []\n"), done.stderr + done.stdout


@pytest.mark.parametrize("wrong", WRONG, ids=lambda name: name.replace(" ", "_"))
def test_messages_are_those_of_the_command(
    wrong: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path(FILE).write_text(WRONG[wrong], encoding="utf-8")
    assert run(["view", FILE, "--no-open", "-o", "page.html"]) in (1, 2)
    listed = re.compile(r"(?<= \(there are )[^)]*")  # methods: the kernel has them in another order
    said, here = capsys.readouterr().err.rstrip("\n"), compiled(WRONG[wrong])["message"]
    assert listed.sub("", here) == listed.sub("", said)


def test_marks_stand_where_the_text_is_wrong() -> None:
    text = WRONG["two names"]
    told = compiled(text)
    assert {text[m["start"] : m["end"]] for m in told["marks"]} == {"thta", "r"}
    assert told["codes"] == [m["code"] for m in told["marks"]]


def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mechc.compiler.equations.rows.rank", None)
    monkeypatch.setitem(sys.modules, "numpy", None)
    said = compiled((EXAMPLES / "four_bar.mech").read_text(encoding="utf-8"))["message"]
    assert "which the playground does not hold; 'mechc view' shows it" in said


STAND_IN = ROOT / "docs" / "website" / "playground" / "stand_in"
LOOPS = ("four_bar", "rolling_coin", "squeezing_mechanism", "hanging_chain", "chaplygin_sleigh", "fekete")
MORE_LOOPS = (
    *(
        "ball_in_bowl",
        "ball_on_turntable",
        "bead_on_hyperbola",
        "bricard",
        "differential",
        "double_pendulum_cartesian",
    ),
    *("edge_runner", "five_bar", "jointed_chain", "ladder", "lorentz_inferred", "n_four_bar", "peaucellier"),
    *(
        "pendulum_tension",
        "rod_in_circle",
        "screw_press",
        "slider_crank_friction",
        "stewart_platform",
        "watt_linkage",
    ),
    *("universal_joint_shaft", "wheel_on_curve", "drive_train", "relativistic_charge", "round_bodies"),
)
COMPILED = """
import hashlib, json, sys
from mechc.editor.playground import Playground
made = Playground()
for path in sys.argv[1:]:
    assert "run" in (told := json.loads(made.compile(open(path, encoding="utf-8").read()))), told["message"]
    print(path, hashlib.sha256(made.module()).hexdigest())
import numpy
print(hasattr(numpy, "__version__"), file=sys.stderr)
"""


def digests(examples: Sequence[str], *folders: Path) -> tuple[str, bool]:
    """Return the digests of the modules of some examples, and whether NumPy itself was there."""
    paths = [str(EXAMPLES / f"{name}.mech") for name in examples]
    known = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (*folders, ROOT)))}
    done = subprocess.run(
        [sys.executable, "-c", COMPILED, *paths], capture_output=True, text=True, env=known, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr == "True\n"


@pytest.mark.parametrize(
    "examples", [LOOPS, pytest.param(MORE_LOOPS, marks=pytest.mark.slow)], ids=["some", "others"]
)
def test_the_stand_in_for_numpy_gives_the_same_modules(examples: Sequence[str]) -> None:
    assert (*digests(examples)[:1], False) == digests(examples, STAND_IN)
    assert digests(examples[:1])[1]


def test_what_the_stand_in_lacks_counts_as_no_numpy() -> None:
    text = "import numpy\ntry: numpy.linalg.cond\nexcept ModuleNotFoundError as e: print(e.name)\ntry: numpy.fft\nexcept ModuleNotFoundError as e: print(e.name)"
    known = {**os.environ, "PYTHONPATH": str(STAND_IN)}
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, env=known)
    assert (done.stdout, done.stderr) == ("numpy\nnumpy\n", "")


def told_by(facts: RunFacts) -> dict[str, Any]:
    """Return what the worker would tell of this native run, from its rows."""
    _, y, out, _ = facts.recorded()
    rows = np.column_stack([y, out])
    error, span, found = facts.solution.accuracy.error, facts.span, facts.found
    assert error is not None
    return {
        "p": found.p,
        "y0": found.y0,
        "u": found.u,
        "nominal": found.nominal,
        "low": rows.min(axis=0).tolist(),
        "high": rows.max(axis=0).tolist(),
        "errors": [error.by_state.get(q.name) for q in facts.problem.states],
        "largest": error.largest,
        "span": {name: getattr(span, name) for name in ("begin", "start", "stop", "tolerance", "step")},
    }


@pytest.mark.parametrize("text", [SWING, (EXAMPLES / "bouncing_ball.mech").read_text(encoding="utf-8")])
def test_the_facts_are_those_of_a_native_run(text: str) -> None:
    """Of the same run both ways tell a page the same: sliders, units, curves, picture."""
    native = facts_of(mechc.loads(text, keep={"scene"}), {}, None, {})
    playground = Playground()
    assert "run" in json.loads(playground.compile(text))
    shown = playground.page(json.dumps(told_by(native)))
    info = parts_of(shown)["info"]
    wanted = json.loads(json.dumps(native.told(recorded=False)))
    assert info.keys() == wanted.keys()
    assert {name: info[name] for name in wanted if info[name] != wanted[name]} == {}
    assert len(info["parameters"]) > 1 and info["curves"]


def test_the_archive_holds_what_pages_are_made_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs")
    from website.playground import archive

    with zipfile.ZipFile(io.BytesIO(archive())) as read:
        held = {name for name in read.namelist() if name.startswith("mechc/web/")}
    web = ROOT / "mechc" / "web"
    kept = [*web.glob("*.js"), *web.glob("*.html"), *web.glob("*.css"), *web.glob("kernel/*.wasm")]
    assert {path.relative_to(ROOT).as_posix() for path in kept} <= held


# ---------------------------------------------------------------- in a browser

NPM = pytest.mark.skipif(shutil.which("npm") is None, reason="needs npm, which fetches Pyodide")


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(running_browser, id="chromium", marks=needs_browser),
        pytest.param(running_firefox, id="firefox", marks=needs_firefox),
    ],
)
def browser(request: pytest.FixtureRequest) -> Iterator[Any]:
    yield from request.param()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    sys.path.insert(0, str(ROOT / "docs"))
    from website.playground import write_playground

    folder = tmp_path_factory.mktemp("site")
    try:
        write_playground(folder, ROOT / "build" / "website" / "downloads")
    except subprocess.CalledProcessError as error:  # nothing was fetched before, and there is no network
        pytest.skip(f"Pyodide cannot be fetched: {error}")
    return folder


class Typed:
    """The playground in a browser."""

    def __init__(self, browser: Any, address: str, **options: Any) -> None:
        self.tab = browser.new_page(**({"viewport": {"width": 1280, "height": 800}} | options))
        self.said: list[str] = []
        self.tab.on("console", lambda message: self.said.append(message.text))
        self.tab.on("pageerror", lambda error: self.said.append(str(error)))
        self.tab.goto(address)
        for _ in range(4):  # on a machine with much to do Python takes its time
            if self.tab.evaluate("playground.answers > 0"):
                break
            self.tab.wait_for_timeout(30_000 if _ else 10_000)
        waited(self.tab, "playground.answers > 0", self.said)

    def ask(self, expression: str, argument: Any = None) -> Any:
        return self.tab.evaluate(expression, argument)

    def type(self, text: str, at: str = "") -> None:
        """Type a text after another one; without that instead of all."""
        self.ask(
            "at => { const e = document.getElementById('text'), k = e.value.indexOf(at) + at.length;"
            " e.focus(); e.setSelectionRange(at ? k : 0, at ? k : e.value.length); }",
            at,
        )
        before = self.ask("playground.answers")
        self.tab.keyboard.insert_text(text)
        waited(self.tab, f"playground.answers > {before} && !document.querySelector('iframe.coming')")

    def moves(self, expression: str) -> Any:
        """Ask the page that is shown."""
        return self.ask(
            f"(page => {expression})(document.querySelector('#motion iframe').contentWindow.page)"
        )

    @property
    def module(self) -> bytes:
        return base64.b64decode(
            self.ask("btoa(Array.from(playground.bytes, b => String.fromCharCode(b)).join(''))")
        )


@pytest.fixture(scope="module")
def typed(browser: Any, site: Path) -> Typed:
    return Typed(browser, (site / "playground.html").as_uri() + "#example=double_pendulum")


def native_module(text: str, events: bool) -> bytes:
    program = compile_source(SourceFile("", text), parts={"scene"}).program
    name = program.experiments[0].name if program.experiments else None
    return linked(program, loaded(kernel_for("dop853", events=events)), name).module


@pytest.mark.slow
@NPM
def test_text_moves_in_the_browser_from_the_file_system(typed: Typed) -> None:
    """The bytes of the module are those that CPython makes here, and the motion is that of the command."""
    # Firefox has none without a display
    solid = typed.ask("!!document.createElement('canvas').getContext('webgl2')")
    for name in ("double_pendulum", "bouncing_ball", *(["lagrange_top"] if solid else []), "four_bar"):
        text = (EXAMPLES / f"{name}.mech").read_text(encoding="utf-8")
        typed.type(text)
        assert typed.module == native_module(text, name == "bouncing_ball"), name
        solution = mechc.loads(text, keep={"scene"}).simulate()
        coordinate = next(q.name for q in solution.problem.states if q.kind == "coordinate")
        found = np.array(typed.moves(f"page.series({coordinate!r})"))
        times = np.array(typed.moves("Array.from(page.run.all.t)"))
        size = np.abs(found).max()
        early = times < 0.2 * times[-1]  # before a chaotic motion is another one
        assert np.allclose(found[early], solution(times[early])[coordinate], rtol=0, atol=1e-5 * size), name
    assert typed.said == []


@pytest.mark.slow
@NPM
def test_a_change_of_the_text_changes_the_motion(typed: Typed) -> None:
    typed.type(SWING)
    typed.moves("page.sliders.find(s => s.name === 'm').set(2, false)")
    assert typed.moves("page.info.stop") == 2
    typed.type("0", at="stop = 2")  # twenty seconds
    assert typed.moves("page.info.stop") == 20
    assert typed.moves("page.sliders.find(s => s.name === 'm').value") == 2  # what was set goes on
    u = typed.moves("page.info.inputs[0]")
    assert (u["name"], u["value"]) == ("M", 0.1)
    typed.moves("page.playing(false)")
    typed.type("kg", at="parameter l = 80 ")
    assert (
        typed.ask("playground.message")
        == compiled(typed.ask("document.getElementById('text').value"))["message"]
    )
    assert "error[E0" in typed.ask("document.getElementById('message').textContent")
    assert typed.ask("document.querySelectorAll('#marks mark').length") > 0
    assert typed.ask("document.querySelector('#message a').getAttribute('href')").startswith("../errors/E0")
    assert typed.ask("document.getElementById('motion').className") == "stale"
    assert typed.said == []


@pytest.mark.slow
@NPM
def test_completion_is_that_of_editors(typed: Typed) -> None:
    typed.type(SWING)
    typed.type("\n  coo", at="stop = 2 s, der(theta) = 1 rad/s, tolerance = 1e-10);")
    typed.tab.keyboard.type("r")
    waited(typed.tab, "!document.getElementById('offers').hidden")
    assert typed.ask("playground.offers.map(o => o.label)") == ["coordinate"]
    typed.tab.keyboard.press("Tab")
    assert "\n  coordinate\nend Swing" in typed.ask("document.getElementById('text').value")


@pytest.mark.slow
@NPM
def test_the_link_holds_the_text(browser: Any, site: Path, typed: Typed) -> None:
    """Also from a static host."""
    text = SWING.replace("Swing", "Swung") + "// θ in ° – all letters\n"
    typed.type(text)
    typed.ask("document.getElementById('link').click()")
    waited(typed.tab, "location.hash.startsWith('#text=')")
    typed.tab.wait_for_timeout(600)
    link = typed.ask("location.hash")
    handler = functools.partial(SimpleHTTPRequestHandler, directory=str(site))
    handler.log_message = lambda *_: None  # type: ignore[attr-defined]
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        other = Typed(browser, f"http://127.0.0.1:{server.server_port}/playground.html{link}")
        assert other.ask("document.getElementById('text').value") == text
        waited(other.tab, "playground.shown > 0")
        assert other.moves("page.info.name") == "Swung"
        assert other.said == []
        other.tab.close()
        server.shutdown()
    typed.ask("location.hash = '#text=!!'")
    waited(typed.tab, "document.getElementById('message').textContent.includes('the link holds no text')")
