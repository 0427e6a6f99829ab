"""Names and markers of the plugin system, which load nothing else."""

from __future__ import annotations

import pluggy

#: Name of the pluggy project and of the entry-point group.
GROUP = "gradedesign"
#: Set to 1 to load no installed plugin, only the built-ins.
DISABLE_VARIABLE = "GRADEDESIGN_DISABLE_PLUGINS"

hookspec = pluggy.HookspecMarker(GROUP)
hookimpl = pluggy.HookimplMarker(GROUP)
