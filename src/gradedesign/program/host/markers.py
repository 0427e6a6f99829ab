"""Names and markers of the plugin system, which load nothing else."""

from __future__ import annotations

import pluggy

#: Name of the pluggy project and of the entry-point group.
GROUP = "gradedesign"

hookspec = pluggy.HookspecMarker(GROUP)
hookimpl = pluggy.HookimplMarker(GROUP)
