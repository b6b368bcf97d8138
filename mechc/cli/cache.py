"""``mechc cache``: show or clear the compiled code that is kept."""

from __future__ import annotations

import click

from .options import Command


@click.group(name="cache", short_help="Show or clear the compiled code that is kept.")
def command() -> None:
    """Compiled models are kept by content, so that a known model starts at once.

    They lie in mechc-compiled, a subfolder of the user's cache folder, or of MECHC_CACHE if that is set; nothing
    else is touched there. It cleans itself: what was unused for the longest time goes when it grows too large.
    """


@command.command(cls=Command)
def show() -> None:
    """Print the folder, and how much it holds."""
    from ..runtime.native.cache import cache_content

    content = cache_content()
    click.echo(f"{content.folder}\n{content.entries} entries, {size_text(content.size)}")


@command.command(cls=Command)
def clear() -> None:
    """Remove all compiled code that is kept, and no other file; the next runs compile again."""
    from ..runtime.native.cache import clear_cache

    content = clear_cache()
    click.echo(f"removed {content.entries} entries, {size_text(content.size)}, from {content.folder}")
    if content.in_use:
        click.echo(f"left {content.in_use} that other runs of mechc are working with")


def size_text(size: int) -> str:
    """Return a number of bytes in a readable unit."""
    if size < 1000:
        return f"{size} bytes"
    return f"{size / 1e3:.0f} kB" if size < 1_000_000 else f"{size / 1e6:.1f} MB"
