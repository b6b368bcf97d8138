"""Figures that notebooks show as pictures, whether Matplotlib's interface for notebooks was started or not."""

from __future__ import annotations

from io import BytesIO

from matplotlib.figure import Figure


class Picture(Figure):
    """A figure that shows itself where it is the value of a cell."""

    def _repr_png_(self) -> bytes:
        """Return the picture as PNG: the name is IPython's."""
        file = BytesIO()
        self.savefig(file, format="png")
        return file.getvalue()
