"""Content key of this program's own text, for answers that another version might not give."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

from gradedesign.common.system.cache import content_key


@cache
def program_key() -> str:
    """Content key of the whole package: what another version computed is not this one's answer."""
    package = sys.modules[__name__.partition(".")[0]]
    root = Path(str(package.__file__)).parent
    return content_key(*(path.read_bytes() for path in sorted(root.rglob("*.py"))))
