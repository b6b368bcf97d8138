"""A document as a PDF, set by ReportLab (``pip install "mechc[report]"``)."""

from __future__ import annotations

from html import escape
from io import BytesIO
from pathlib import Path
from typing import Any, assert_never

from ..requests.parse_values import UsageMistake
from .blocks import Block, Document, Heading, MovingPage, Paragraph, Picture, Preformatted, Rows

WIDTH, HIGHEST, LOWER = 17.0, 14.0, 7.5
"""Centimetres between the margins of an A4 page, of a picture, and of one that another one follows, so that a page holds both."""
LETTERS = 102
"""Of the type of preformatted text in a line; longer lines go on below, after two blanks."""


def write(document: Document, path: Path) -> None:
    """Write the file. Raises UsageMistake where ReportLab is not installed."""
    try:
        from reportlab.lib.units import cm
        from reportlab.platypus import CondPageBreak, SimpleDocTemplate
    except ImportError:
        raise UsageMistake(
            "a PDF needs ReportLab", 'pip install "mechc[report]", or write the report as .html'
        ) from None
    template = SimpleDocTemplate(
        str(path), leftMargin=2 * cm, rightMargin=2 * cm, topMargin=2.2 * cm, bottomMargin=2.2 * cm,
        title=document.title, subject=document.subtitle, creator="mechc",
    )  # fmt: skip
    setter = _Setter()
    story = setter.title(document)
    blocks = [*document.blocks, None, None]
    for block, following, later in zip(document.blocks, blocks[1:], blocks[2:], strict=False):
        if isinstance(block, Heading):
            room = (
                3 + (LOWER if isinstance(later, Picture) else HIGHEST)
                if isinstance(following, Picture)
                else 4
            )
            story.append(CondPageBreak(room * cm))
        story += setter.block(block, LOWER if isinstance(following, Picture) else HIGHEST)
    template.build(story, onFirstPage=_footer, onLaterPages=_footer)


def _footer(canvas: Any, template: Any) -> None:
    from reportlab.lib.units import cm

    canvas.setFont("DejaVu", 8)
    canvas.drawString(2 * cm, 1.2 * cm, template.title)
    canvas.drawRightString(19 * cm, 1.2 * cm, str(canvas.getPageNumber()))


class _Setter:
    """Styles, and the flowing pieces of each block. The fonts are those that come with Matplotlib."""

    def __init__(self) -> None:
        from matplotlib import get_data_path
        from reportlab.lib.styles import ParagraphStyle
        from reportlab.pdfbase.pdfmetrics import registerFont
        from reportlab.pdfbase.ttfonts import TTFont

        fonts = Path(get_data_path()) / "fonts" / "ttf"
        for name, file in (
            ("DejaVu", "DejaVuSans"),
            ("DejaVuBold", "DejaVuSans-Bold"),
            ("Mono", "DejaVuSansMono"),
        ):
            registerFont(TTFont(name, str(fonts / f"{file}.ttf")))
        self.text = ParagraphStyle("text", fontName="DejaVu", fontSize=9, leading=12.5, spaceAfter=5)
        self.cell = ParagraphStyle("cell", parent=self.text, fontSize=8.5, leading=11, spaceAfter=0)
        self.small = ParagraphStyle("small", parent=self.text, fontSize=8, textColor="#555566")
        self.heading = ParagraphStyle(
            "heading",
            parent=self.text,
            fontName="DejaVuBold",
            fontSize=12,
            leading=15,
            spaceBefore=14,
            keepWithNext=1,
        )
        self.head = ParagraphStyle(
            "head", parent=self.heading, fontSize=18, leading=22, spaceBefore=0, spaceAfter=2
        )
        self.mono = ParagraphStyle(
            "mono",
            fontName="Mono",
            fontSize=7.5,
            leading=9.2,
            backColor="#f5f6f8",
            borderPadding=4,
            spaceBefore=6,
            spaceAfter=8,
        )

    def title(self, document: Document) -> list[Any]:
        from reportlab.platypus import Paragraph as Words

        return [Words(escape(document.title), self.head), Words(escape(document.subtitle), self.small)]

    def block(self, block: Block, highest: float) -> list[Any]:
        from reportlab.platypus import Paragraph as Words
        from reportlab.platypus import XPreformatted

        match block:
            case Heading():
                return [Words(escape(block.text), self.heading)]
            case Paragraph():
                return [Words(escape(block.text), self.text)]
            case Preformatted():
                return [XPreformatted(escape("\n".join(_folded(block.text))), self.mono)]
            case Rows():
                return [self._table(block)]
            case Picture():
                return self._picture(block, highest)
            case MovingPage():
                return []
            case _:
                assert_never(block)

    def _table(self, block: Rows) -> Any:
        from reportlab.lib.units import cm
        from reportlab.platypus import Paragraph as Words
        from reportlab.platypus import Table, TableStyle

        rows = [
            [Words(escape(cell), self.cell) for cell in row]
            for row in (*((block.head,) if block.head else ()), *block.rows)
        ]
        lines: list[Any] = [
            ("VALIGN", (0, 0), (-1, -1), "TOP"),
            ("LINEBELOW", (0, 0), (-1, -1), 0.3, "#d4d7dd"),
        ]
        if block.head:
            lines.append(("LINEBELOW", (0, 0), (-1, 0), 0.8, "#556677"))
        widths = None if block.head else [3.6 * cm, (WIDTH - 3.6) * cm]
        return Table(
            rows, widths, style=TableStyle(lines), hAlign="LEFT", repeatRows=bool(block.head), spaceAfter=6
        )

    def _picture(self, block: Picture, highest: float) -> list[Any]:
        from reportlab.lib.units import cm
        from reportlab.lib.utils import ImageReader
        from reportlab.platypus import Image, KeepTogether
        from reportlab.platypus import Paragraph as Words

        wide, high = ImageReader(BytesIO(block.png)).getSize()
        scale = min(WIDTH * cm / wide, highest * cm / high)
        image = Image(BytesIO(block.png), wide * scale, high * scale)
        return [KeepTogether([image, Words(escape(block.caption), self.small)])]


def _folded(text: str) -> list[str]:
    """Cut lines that are wider than the page."""
    lines: list[str] = []
    for line in text.expandtabs(2).splitlines():
        while len(line) > LETTERS:
            at = line.rfind(" ", LETTERS // 2, LETTERS)
            at = at if at > 0 else LETTERS
            lines.append(line[:at])
            line = "  " + line[at:].lstrip()
        lines.append(line)
    return lines
