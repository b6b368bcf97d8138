"""Sliders and what they lead to: ranges, impossible values, runs that take too long, one scale of time, and how a page words its figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from browsers import Opened, needs_browser

import mechc
from mechc.web.page import page
from mechc.web.run_facts import facts_of
from mechc.web.sizes import of_dimension

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"

KINDS = """
model Kinds
  parameter Mass m = 2 kg;
  parameter Mass more = 0 kg;
  parameter Length l = 0.5 m;
  parameter Length aside = 0 m;
  parameter Force push = -8 N;
  parameter Force pull = 0 N;
  parameter Stiffness k = 50 N/m;
  parameter Damping c = 0 N.s/m;
  parameter Damping other = 3 N.s/m;
  parameter Damping third = 1 N.s/m;
  parameter Time T(min = 1e-12 s) = 2 ms;
  parameter e(min = 0, max = 1) = 0.5;
  parameter far(min = 0.1, max = 3) = 1;
  parameter Angle tilt = 0 rad;
  parameter shift = 1e3 m;
  parameter w = 30 m/s;
  parameter Density density = 1000 kg/m^3;
  parameter Mass given = density*1 m^3;
  parameter Mass unused = 1 kg;
  parameter Inertia J[2, 2] = {{0.3, 0}, {0, 0}} kg.m^2;
  coordinate Length x = 1 m;
  kinetic 1/2*(m + more + given + sum(J[1, :] + J[2, :])/1 m^2)*der(x)^2;
  potential 1/2*(k + 1 N/m*(e + far + cos(tilt)))*(x - l - aside - shift/1000)^2;
  damping (c + other + third)*(1 + T/1 s) on x;
  force push + pull + 1 N.s/m*w on x;
  experiment(stop = 1 s, display = "mm"{given});
end Kinds;
"""


def sliders(text: str) -> dict[str, Any]:
    facts = facts_of(mechc.loads(text, keep={"scene"}), {}, None, {"method": "dop853"})
    told: Any = facts.told(recorded=True)
    return {q["name"]: q for group in ("parameters", "inputs") for q in told[group]}


def test_ranges_are_those_of_what_a_parameter_is() -> None:
    """Zero where it leaves a model, no negative mass, sizes of others of the unit, limits that are no mere guard."""
    found = sliders(KINDS.replace("{given}", ""))
    ends = {name: (q["min"], q["max"]) for name, q in found.items()}
    pi = 3.141592653589793
    wanted = {
        "m": (0.5, 8),
        "more": (0, 2),
        "l": (0.125, 2),
        "aside": (-1000, 1000),
        "push": (-32, 0),
        "pull": (-8, 8),
        "k": (0, 200),
        "c": (0, 3),
        "T": (0.5e-3, 8e-3),
        "e": (0, 1),
        "far": (0.1, 3),
        "tilt": (-pi, pi),
        "J[1,2]": (-0.3, 0.3),
        "J[2,2]": (0, 0.3),
    }
    for name, (low, high) in wanted.items():
        assert ends[name] == pytest.approx((low, high), rel=1e-5), name  # six digits


SATELLITE = """
model Damper parameter Stiffness k = 400 N/m; parameter Damping c = 0 N.s/m; parameter k3 = 0 N/m^3; parameter Length rest = 10 cm;
  input Length s; potential 1/2*k*(s - rest)^2 + 1/4*k3*s^4; damping c on s; end Damper;
model Bus parameter Mass m = 100 kg; parameter Inertia J = 25 kg.m^2; parameter Length com = 0 m;
  input Length s; coordinate phi = 0 rad; initial der(phi) = 1e-3 rad/s; kinetic 1/2*m*der(s)^2 + 1/2*(J + m*com^2)*der(phi)^2; end Bus;
model Satellite
  parameter Length orbit = 7000 km; parameter Time day = 86400 s; parameter push = 0 N;
  coordinate Length s = 0 m; initial der(s) = 2 m/s;
  Bus bus(s = s); Damper spring(s = s);
  force push*orbit/orbit*day/day on s;
  experiment(stop = 10 s);
end Satellite;
"""


def test_what_is_zero_is_as_large_as_its_part_makes_it() -> None:
    """sqrt(J/m) of an unknown place, k/l^2 of a cubic stiffness; start values go as far as the motion does."""
    facts = facts_of(mechc.loads(SATELLITE, keep={"scene"}), {}, None, {})
    told: Any = facts.told(recorded=False)
    most = {q["name"]: q["max"] for group in ("parameters", "starts") for q in told[group]}
    assert most["bus.com"] == pytest.approx(0.5)  # not the radius of the orbit
    assert most["spring.k3"] == pytest.approx(4e4)
    lowest, highest = facts.found.extents.ends["s"]
    assert most["s"] == pytest.approx(max(-lowest, highest), rel=0.05)  # two digits
    assert most["bus.phi"] == pytest.approx(0.01, rel=1e-6)


@pytest.mark.parametrize(
    ("unit", "known", "size"),
    [
        ("N.s/m", {"N/m": 100.0, "kg": 4.0}, 20.0),  # sqrt(k m)
        ("N", {"kg": 2.0, "m/s^2": 10.0}, 20.0),
        ("m", {"kg": 2.0, "N/m": 10.0}, None),
        ("m^-1", {"m": 0.25}, 4.0),
        ("m/s", {"m": 2.0, "s": 4.0, "m/s^2": 0.125}, 0.5),  # three sizes that agree
        ("", {"m": 2.0}, None),
    ],
)
def test_sizes_of_a_dimension(unit: str, known: dict[str, float], size: float | None) -> None:
    assert of_dimension(unit, known) == (pytest.approx(size) if size else None)


def test_parameters_that_reach_no_equation_have_no_slider() -> None:
    assert "density" in sliders(KINDS.replace("{given}", ""))
    assert "unused" not in sliders(KINDS.replace("{given}", ""))
    given = sliders(KINDS.replace("given = density*1 m^3", "given = 4 kg").replace("{given}", ""))
    assert "density" not in given and "given" in given


def test_long_numbers_of_settings_are_shown_in_units_of_the_text() -> None:
    found = sliders(KINDS.replace("{given}", ""))
    assert (found["w"]["shown"], found["w"]["factor"]) == ("m/s", 1.0)
    assert (found["l"]["shown"], found["l"]["factor"]) == ("mm", 0.001)


# ---------------------------------------------------------------- in a browser


def opened(browser: Any, folder: Path, model: mechc.Model, **options: Any) -> Opened:
    path = folder / "page.html"
    path.write_text(page(model))
    return Opened(browser, path, **options)


FAILURE = "document.getElementById('failure').textContent"

SAMPLED = """
model Sampled
  parameter Time T(min = 1e-12 s) = 10 ms;
  parameter Mass m = 1 kg;
  discrete Real n = 0;
  coordinate Length x = 1 m;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*5 N/m*x^2;
  when sample(T) then n := n + 1; end when;
  experiment(stop = 1 s);
end Sampled;
"""


@needs_browser
def test_a_run_that_takes_too_long_is_ended(browser: Any, tmp_path: Path) -> None:
    """1e12 samples: a newer setting comes through at once, and without one the page says why nothing moves."""
    page_ = opened(browser, tmp_path, mechc.loads(SAMPLED))
    before = page_.ask("page.series('x').at(-1)")
    page_.ask("Object.assign(page, {late: 100, most: 1e6})")
    page_.ask("void page.sliders.find(s => s.name === 'T').set(1e-12, false)")
    page_.wait("document.body.classList.contains('computing')")
    assert page_.ask("getComputedStyle(document.getElementById('computing')).display") == "block"
    page_.ask("page.most = 1000")
    page_.wait(f"{FAILURE} !== ''")
    assert page_.ask(FAILURE) == "given up after 1 s of computing: move the slider back, or press reset"
    assert page_.ask("page.run") is None
    page_.ask("page.most = 1e6")
    page_.ask("void page.sliders.find(s => s.name === 'T').set(2e-12, false)")
    page_.ask("document.getElementById('reset').click()")
    page_.wait("page.idle()")
    assert page_.ask("page.series('x').at(-1)") == before and page_.ask(FAILURE) == ""
    assert page_.ask("!document.body.classList.contains('computing')")
    assert page_.said == []


ENDED = """
model Ended
  parameter Mass m = 1 kg;
  coordinate Length x = 0 m;
  initial der(x) = 1 m/s;
  kinetic 1/2*m*der(x)^2;
  potential 0 N*x;
  when x > 0.25 m then terminate("there"); end when;
  experiment(stop = 2 s);
end Ended;
"""


@needs_browser
def test_slider_and_curves_have_one_scale_of_time(browser: Any, tmp_path: Path) -> None:
    page_ = opened(browser, tmp_path, mechc.loads(ENDED))
    assert page_.ask("+document.getElementById('time').max") == pytest.approx(0.25, abs=1e-9)
    page_.ask("page.go(0.125)")
    time, mark, box = (
        page_.ask(
            f"(({{left, width}}) => [left, width])(document.querySelector('{place}').getBoundingClientRect())"
        )
        for place in ("#time", ".marker", "#plot")
    )
    assert time[1] > 0
    share = page_.ask("(e => (e.value - e.min)/(e.max - e.min))(document.getElementById('time'))")
    assert share == pytest.approx(0.5, abs=1e-6)
    assert (mark[0] - box[0] - 58) / (box[1] - 58 - 12) == pytest.approx(share, abs=0.02)
    assert page_.ask("document.getElementById('events').textContent") == "1 switching"
    assert page_.ask("document.getElementById('note').textContent").endswith("ended by the model at 0.25 s")
    assert page_.ask("document.getElementById('energy').textContent") == "0 J, 0 of the largest energy"


@needs_browser
def test_negative_masses_are_said(browser: Any, tmp_path: Path) -> None:
    page_ = opened(browser, tmp_path, mechc.loads(ENDED))
    assert page_.ask(FAILURE) == ""
    page_.ask("page.sliders.find(s => s.name === 'm').set(-1, false)")  # as typed: the slider ends before
    page_.wait("page.idle()")
    said = page_.ask(FAILURE)
    assert (
        said
        == "the kinetic energy falls to −0.5 J: a mass or an inertia is negative, if this is not meant so"
    )
    native = mechc.loads(ENDED).simulate(set={"m": -1})
    assert said.replace("−", "-") in str(native)


@needs_browser
def test_numbers_and_units_are_worded_in_one_way(browser: Any, tmp_path: Path) -> None:
    page_ = opened(browser, tmp_path, mechc.loads(KINDS.replace("{given}", "")))
    for value, text in {
        2e7: "2e7",
        8.333e-12: "8.333e-12",
        1.49e-4: "1.49e-4",
        0.025: "0.025",
        0: "0",
        -1234.56: "-1235",
    }.items():
        assert page_.ask(f"number({value})") == text
    for unit, text in {
        "kg.m^2": "kg·m²",
        "N.m.s": "N·m·s",
        "s^-1": "s⁻¹",
        "m^3/s/Pa": "m³/s/Pa",
        "": "",
    }.items():
        assert page_.ask(f"unitText('{unit}')") == text
    assert page_.ask("said(-2.5e-4)") == "−2.5e−4"
    header = page_.ask("document.querySelector('dl').innerText")
    assert "of the largest" in header and "(" not in header and "-" not in header


@needs_browser
def test_the_header_does_not_grow_when_the_error_arrives(browser: Any, tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    path.write_text(page(mechc.load(EXAMPLES / "double_pendulum.mech")))
    for width in (1440, 1100, 390):
        page_ = Opened(browser, path, viewport={"width": width, "height": 800})
        page_.wait("page.error")
        after = page_.ask("document.querySelector('header').offsetHeight")
        page_.ask("document.getElementById('error').textContent = '…'")
        assert page_.ask("document.querySelector('header').offsetHeight") == after, width
        page_.tab.close()


@needs_browser
def test_the_header_keeps_its_lines_whatever_is_counted(browser: Any, tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    path.write_text(page(mechc.loads(ENDED)))
    page_ = Opened(browser, path, viewport={"width": 1440, "height": 900})
    before = page_.ask("document.querySelector('header').offsetHeight")
    page_.ask(
        "document.getElementById('events').textContent = '870: 1 switching, 855 impacts, 7 rests, 7 lift-offs'"
    )
    assert page_.ask("document.querySelector('header').offsetHeight") == before


MANY = f"""
import mech.planar.*;
{"".join(f"Bar b{k}(m = 1 kg, l = 1 m); Revolute h{k}(world -> b{k}.a, angle = 10 deg);" for k in range(1, 13))}
parameter Torque load = 2 N.m;
torque load on h1.angle;
experiment(stop = 0.1 s);
"""


@needs_browser
@pytest.mark.parametrize(("width", "open_"), [(390, False), (1280, True)])
def test_many_sliders_can_be_folded_by_components(
    width: int, open_: bool, browser: Any, tmp_path: Path
) -> None:
    path = tmp_path / "page.html"
    path.write_text(page(mechc.loads(MANY)))
    page_ = Opened(browser, path, viewport={"width": width, "height": 800})
    folds = page_.ask(
        "[...document.querySelectorAll('#parameters details')].map(d => [d.firstChild.textContent, d.open, d.querySelectorAll('input[type=range]').length])"
    )
    assert [name for name, _, _ in folds] == [f"b{k}" for k in range(1, 13)]
    assert all(is_open == open_ and n == 2 for _, is_open, n in folds)
    assert page_.ask("document.getElementById('s-load').closest('details')") is None
    assert page_.ask("document.querySelector('#parameters > :nth-child(2)').textContent").startswith("load")
    colour = "getComputedStyle(document.querySelectorAll('#parameters summary')[2]).color"
    before = page_.ask(colour)
    page_.set("b3.m", 2)
    assert page_.ask(colour) != before  # something in there is not as in the text
    assert page_.said == []


@needs_browser
def test_products_of_inertia_that_vanish_are_folded_away(browser: Any, tmp_path: Path) -> None:
    """Of the inertia about principal axes three sliders stand first; one that is tilted by 5 kg.m^2 stays among them."""
    path = tmp_path / "page.html"
    text = "import mech.spatial.*; Body b(m = 1 kg, J = {{3, 0.5, 0}, {0.5, 2, 0}, {0, 0, 1}} kg.m^2); Free f(world -> b.a, der(orientation) = {1, 2, 3} rad/s); parameter k = 1 N.m; torque {k, 0 N.m, 0 N.m} on b.a; experiment(stop = 0.1 s);"
    path.write_text(page(mechc.loads(text)))
    page_ = Opened(browser, path)
    sliders = "[...document.querySelectorAll('#parameters input[type=range]')].map(e => [e.id.slice(2), e.closest('details')?.firstChild.textContent ?? ''])"
    found = page_.ask(sliders)
    first = [name for name, fold in found if not fold]
    assert {"b.J[1,1]", "b.J[1,2]", "b.J[2,1]", "b.J[2,2]", "b.J[3,3]", "k"} <= set(first)
    assert [row for row in found if row[1]] == [
        [f"b.J[{i},{j}]", "products of inertia"] for i, j in ((1, 3), (2, 3), (3, 1), (3, 2))
    ]
    assert not page_.ask("document.querySelector('#parameters details').open")
    page_.set("b.J[1,3]", 0.1)
    assert page_.ask("page.run.p[page.info.parameters.find(q => q.name === 'b.J[1,3]').index]") == 0.1
    assert page_.said == []


@needs_browser
def test_fingers_find_all_controls(browser: Any, tmp_path: Path) -> None:
    page_ = opened(browser, tmp_path, mechc.loads(ENDED), viewport={"width": 390, "height": 844})
    small = page_.ask(
        """[...document.querySelectorAll('button, select, #time, fieldset input[type=range], #bar label, #choose label')]
        .filter(e => e.offsetParent).map(e => [e.id || e.tagName, e.getBoundingClientRect()])
        .filter(([, r]) => r.height < 40 || r.width < 40).map(([name, r]) => [name, r.width, r.height])"""
    )
    assert small == []
    assert page_.ask("document.documentElement.scrollWidth") <= 390


def test_names_are_spelt_as_in_formulas_and_explained(browser: Any, tmp_path: Path) -> None:
    """Shown names alone: links and files have those of the text."""
    text = 'parameter m = 1 kg "of the `bob`"; coordinate theta = 30 deg "from the vertical"; initial der(theta) = 0 rad/s; coordinate Length thetas = 1 m; kinetic 1/2*m*(1 m^2*der(theta)^2 + der(thetas)^2); potential -m*9.81 m/s^2*1 m*cos(theta); output omega_1 = der(theta); experiment(stop = 2 s);'
    path = tmp_path / "page.html"
    path.write_text(page(mechc.loads(text)))
    tab = Opened(browser, path)
    heads = tab.ask(
        "[...document.querySelectorAll('fieldset label > span:first-child')].map(e => e.textContent)"
    )
    assert heads == ["m of the ‘bob’", "θ from the vertical", "thetas", "dθ/dt"]
    assert tab.ask("[...document.getElementById('up').options].map(o => o.text)")[:4] == [
        "θ",
        "thetas",
        "dθ/dt",
        "der(thetas)",
    ]
    assert tab.ask("page.csv()").startswith("time [s],theta [rad],thetas [m],der(theta) [rad/s]")
    tab.set("theta", 0.1)
    assert tab.ask("location.hash").startswith("#theta=0.1")
    assert not tab.ask("document.getElementById('arrows').checkVisibility()")  # tracks have no velocities
    assert tab.said == []
