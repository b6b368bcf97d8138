"""``mechc fit``: find parameters and starts from measured motions; the study of that name under a short one."""

from __future__ import annotations

from ..runtime.studies.table import STUDIES
from .study import command_of

command = command_of(STUDIES["fit"])
