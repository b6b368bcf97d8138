"""Diagnostics look as promised, whatever the source text holds."""

from __future__ import annotations

from mechc.lang.diagnostics import Diagnostic, Label, Severity
from mechc.lang.source import SourceFile, Span
from mechc.presentation.render import render
from mechc.presentation.style import Style, printable, width

PENDULUM = SourceFile(
    "pendulum.mech",
    """\
model Pendulum
  parameter l = 1 m;
  coordinate theta = 1 rad;
  potential  -m*g*cos(theta);
\tlet a = l + t;
end Pendulum;
""",
)


def span(file: SourceFile, text: str) -> Span:
    start = file.text.index(text)
    return Span(file, start, start + len(text))


def error(place: Span | None, caption: str = "", *labels: Label, help: str = "") -> Diagnostic:
    return Diagnostic(Severity.ERROR, "E0301", "potential must be an energy", place, caption, labels, help)


def test_place_caption_context_line_and_help() -> None:
    shown = render(
        [
            error(
                span(PENDULUM, "-m*g*cos(theta)"),
                "this is kg.m/s^2 (N)",
                Label(span(PENDULUM, "coordinate"), ""),
                help="one factor of [m] is missing\nsecond line",
            )
        ]
    )
    assert shown == (
        "error[E0301]: potential must be an energy\n"
        "  --> pendulum.mech:4:14\n"
        " 3 |   coordinate theta = 1 rad;\n"
        " 4 |   potential  -m*g*cos(theta);\n"
        "   |              ^^^^^^^^^^^^^^^ this is kg.m/s^2 (N)\n"
        "   = help: one factor of [m] is missing\n"
        "           second line"
    )


def test_places_on_one_line_get_their_words_below_each_other() -> None:
    whole = span(PENDULUM, "l + t")
    plus = Span(PENDULUM, whole.start + 2, whole.start + 3)
    left = Label(Span(PENDULUM, whole.start, whole.start + 1), "a length (m)")
    right = Label(Span(PENDULUM, whole.end - 1, whole.end), "a time (s)")
    assert render([error(plus, "here", left, right)]).splitlines()[2:] == [
        " 5 |     let a = l + t;",
        "   |             - ^ - a time (s)",
        "   |             | |",
        "   |             | here",
        "   |             a length (m)",
    ]


def test_overlapping_places_get_rows_of_their_own() -> None:
    whole = span(PENDULUM, "l + t")
    plus = Span(PENDULUM, whole.start + 2, whole.start + 3)
    assert render([error(plus, "here", Label(whole, "the sum"))]).splitlines()[3:] == [
        "   |               ^ here",
        "   |             ----- the sum",
    ]


def test_a_place_in_another_file() -> None:
    other = SourceFile("planar.mech", "model Bar\n  parameter m = 1 kg;\nend Bar;\n")
    shown = render([error(span(PENDULUM, "theta"), "this", Label(span(other, "m = 1"), "declared here"))])
    assert shown.splitlines()[4:] == [
        "  ::: planar.mech:2:13",
        " 2 |   parameter m = 1 kg;",
        "   |             ----- declared here",
    ]


def test_wide_combining_and_control_characters_keep_the_carets_in_place() -> None:
    file = SourceFile("wide.mech", "漢字 e\u0301 x\x07y z")
    shown = render([error(span(file, "z"), "here")]).splitlines()
    line, carets = shown[2], shown[3]
    assert width(line[: line.index("z")]) == width(carets[: carets.index("^")])
    assert "\x07" not in line


def test_a_long_line_is_cut_around_the_place() -> None:
    file = SourceFile("long.mech", "x" * 500 + " yyy " + "z" * 500)
    line, carets = render([error(span(file, "yyy"), "here")]).splitlines()[2:4]
    assert len(line) < 160
    assert line[carets.index("^") : carets.rindex("^") + 1] == "yyy"
    assert line.startswith(" 1 | ...") and line.endswith("...")


def test_the_end_of_the_file_and_an_empty_file() -> None:
    end = len(PENDULUM.text)
    assert render([error(Span(PENDULUM, end, end), "expected more")]).endswith("7 |\n   | ^ expected more")
    empty = SourceFile("empty.mech", "")
    assert render([error(Span(empty, 0, 0))]).endswith(" 1 |\n   | ^")


def test_a_message_without_a_place() -> None:
    assert render([error(None, help="look")]) == (
        "error[E0301]: potential must be an energy\n   = help: look"
    )


def test_at_most_twenty_errors_first() -> None:
    warning = Diagnostic(Severity.WARNING, "W0101", "odd", None)
    many = [warning, *(error(Span(PENDULUM, i, i + 1)) for i in range(25))]
    shown = render(many)
    assert shown.count("error[E0301]") == 20
    assert "W0101" not in shown
    assert shown.endswith("... and 6 more")


def test_colours_only_change_the_look() -> None:
    import re

    coloured = render([error(span(PENDULUM, "theta"), "this", help="that")], Style(True))
    assert coloured != re.sub(r"\x1b\[[0-9;]*m", "", coloured)
    assert re.sub(r"\x1b\[[0-9;]*m", "", coloured) == render(
        [error(span(PENDULUM, "theta"), "this", help="that")]
    )


def test_tabs_are_expanded_to_stops() -> None:
    assert printable("a\tb\t c") == "a   b    c"
