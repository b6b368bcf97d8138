"""A document as one HTML file that needs nothing else."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from pathlib import Path
from typing import assert_never

from .blocks import Block, Document, Heading, MovingPage, Paragraph, Picture, Preformatted, Rows

STYLE = """\
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #1c2330; background: #fff }
h1 { margin-bottom: 0 } .subtitle { color: #566; margin-top: 0.2rem }
h2 { margin-top: 2.2rem; border-bottom: 1px solid #ccd }
pre { background: #f5f6f8; padding: 0.8rem; overflow-x: auto; font-size: 0.85rem; line-height: 1.35 }
table { border-collapse: collapse; margin: 0.8rem 0 } th, td { padding: 0.25rem 0.9rem 0.25rem 0; text-align: left; vertical-align: top }
th { border-bottom: 1px solid #889 } tr + tr td { border-top: 1px solid #e4e6ea } td { font-variant-numeric: tabular-nums }
figure { margin: 1rem 0 } img { max-width: 100% } figcaption { color: #566; font-size: 0.9rem }
iframe { width: 100%; height: 46rem; border: 1px solid #ccd }
@media print { iframe { display: none } h2 { break-after: avoid } figure, table { break-inside: avoid } }
"""


def write(document: Document, path: Path) -> None:
    """Write the file."""
    body = "\n".join(_block(block) for block in document.blocks)
    path.write_text(
        f'<!doctype html>\n<html lang="en">\n<meta charset="utf-8">\n<meta name="viewport" content="width=device-width">\n'
        f"<title>{escape(document.title)}</title>\n<style>\n{STYLE}</style>\n<h1>{escape(document.title)}</h1>\n"
        f'<p class="subtitle">{escape(document.subtitle)}</p>\n{body}\n</html>\n',
        encoding="utf-8",
    )


def _block(block: Block) -> str:
    match block:
        case Heading():
            return f"<h2>{escape(block.text)}</h2>"
        case Paragraph():
            return f"<p>{escape(block.text)}</p>"
        case Preformatted():
            return f"<pre>{escape(block.text)}</pre>"
        case Rows():
            head = "".join(f"<th>{escape(cell)}</th>" for cell in block.head)
            rows = "".join(
                f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in block.rows
            )
            return f"<table>{f'<tr>{head}</tr>' if head else ''}{rows}</table>"
        case Picture():
            data = b64encode(block.png).decode()
            caption = escape(block.caption)
            return f'<figure><img src="data:image/png;base64,{data}" alt="{caption}"><figcaption>{caption}</figcaption></figure>'
        case MovingPage():
            return f'<iframe title="the model, moving" srcdoc="{escape(block.html)}"></iframe>'
        case _:
            assert_never(block)
