"""Who can have written a file: code is executed only if nobody but this user and the system's administrator can.

A checksum beside a file proves nothing against somebody who can write the file: they write the checksum, too. What
decides is the owner and the mode of the file and of all folders above it; a checksum finds what was cut off or damaged.
On Windows, where modes tell nothing, the rights of the user's own folders stand in their place.
"""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

_WRITE_OF_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def folder_doubt(folder: Path) -> str:
    """Say why others could exchange what lies in a folder, which is there and no link; empty if nobody can.

    In a folder above it that all may write, such as that of temporary files, the sticky bit keeps each from renaming
    what belongs to others.
    """
    if sys.platform == "win32":
        return ""
    for place in (folder, *folder.parents):
        doubt = _place_doubt(place, place.lstat(), above=place != folder)
        if doubt:
            return doubt
    return ""


def subfolder_doubt(place: Path) -> str:
    """Say why others could exchange what lies in a subfolder of a folder without doubt; empty if nobody can, or it is not there."""
    try:
        state = place.lstat()
    except FileNotFoundError:
        return ""
    if not stat.S_ISDIR(state.st_mode):
        return f"{place} is not a folder"
    return "" if sys.platform == "win32" else _place_doubt(place, state, above=False)


def _place_doubt(place: Path, state: os.stat_result, *, above: bool) -> str:
    if state.st_uid not in (0, os.geteuid()):
        return f"{place} belongs to {_user(state.st_uid)}, who could put other code there"
    guarded = above and state.st_mode & stat.S_ISVTX
    if state.st_mode & _WRITE_OF_OTHERS and not guarded and not _only_by_private_group(state):
        return f"others may write in {place} and could put other code there"
    return ""


def file_doubt(state: os.stat_result) -> str:
    """Say why a file is not a file, or who but this user may have written it; empty if nobody can."""
    if not stat.S_ISREG(state.st_mode):
        return "is not a regular file"
    if sys.platform == "win32":
        return ""
    if state.st_uid not in (0, os.geteuid()):
        return f"belongs to {_user(state.st_uid)}"
    return "can be written by others" if state.st_mode & _WRITE_OF_OTHERS else ""


def _only_by_private_group(state: os.stat_result) -> bool:
    """Tell whether the group that may write is that of this user alone, as many systems make one for each user."""
    if sys.platform == "win32" or state.st_mode & stat.S_IWOTH:
        return False
    import grp
    import pwd

    try:
        user = pwd.getpwuid(os.geteuid())
        group = grp.getgrgid(state.st_gid)
    except KeyError:
        return False
    return group.gr_gid == user.pw_gid and group.gr_name == user.pw_name and {*group.gr_mem} <= {user.pw_name}


def _user(number: int) -> str:
    if sys.platform != "win32":
        import pwd

        try:
            return f"the user {pwd.getpwuid(number).pw_name}"
        except KeyError:
            pass
    return f"the user {number}"
