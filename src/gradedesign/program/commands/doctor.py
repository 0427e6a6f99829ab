"""``gradedesign doctor``: what is installed and whether it works."""

from __future__ import annotations

import os
from typing import Any

import typer

from gradedesign.common.system.cache import cache_folder
from gradedesign.common.system.limits import available_memory_bytes
from gradedesign.common.system.processor import threading_layer, usable_cores
from gradedesign.design.verdict.common import library_versions
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.show import print_json, print_table


def doctor(*, strict_plugins: bool, as_json: bool) -> None:
    """Print versions, plugins, cores and memory."""
    registry = registry_for(strict_plugins=strict_plugins)
    data: dict[str, Any] = {
        "versions": library_versions(),
        "plugins": [str(p) for p in registry.plugins],
        "failed_plugins": [str(f) for f in registry.failures],
        "reads": sorted(s for reader in registry.readers.values() for s in reader.suffixes),
        "formats": [*registry.exporters, *registry.outputs],
        "solvers": [*registry.solvers],
        "eigen_solvers": [*registry.eigen_solvers],
        "cores": usable_cores(),
        "threads": int(os.environ["NUMBA_NUM_THREADS"]),
        "threading_layer": threading_layer(),
        "available_memory_GB": round(available_memory_bytes() / 1e9, 2),
        "cache_folder": str(cache_folder()),
    }
    if as_json:
        print_json(data)
        return
    print_table("Versions", ("library", "version"), list(data["versions"].items()))
    typer.echo("plugins: " + (", ".join(data["plugins"]) or "none"))
    typer.echo(f"parts: {', '.join(data['reads'])}; formats: {', '.join(data['formats'])}")
    typer.echo(f"solvers: {', '.join(data['solvers'])}")
    typer.echo(f"eigenvalue solvers: {', '.join(data['eigen_solvers'])}")
    typer.echo(
        f"{data['cores']} cores, {data['threads']} threads by {data['threading_layer']}, "
        f"{data['available_memory_GB']:g} GB of memory available"
    )
    typer.echo(f"cache: {data['cache_folder']}")
