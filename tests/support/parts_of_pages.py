"""What a page holds: its scripts and facts as they are, what else as bytes."""

from __future__ import annotations

import base64
import gzip
import json
import re
from typing import Any


def parts_of(page: str) -> dict[str, Any]:
    found = re.search(r"\nbegin\((.*)\);\n", page)
    assert found is not None
    parts = {name: gzip.decompress(base64.b64decode(part)) for name, part in json.loads(found[1]).items()}
    return parts | {name: json.loads(parts[name]) for name in ("scripts", "info")}
