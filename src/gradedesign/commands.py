"""Names for the commands of plugins: reading cases, running them, printing, folders, processes."""

from __future__ import annotations

from gradedesign.common.system.atomic import UNFINISHED, is_folder, write_error, write_text
from gradedesign.common.system.cache import content_key
from gradedesign.common.system.limits import (
    available_memory_bytes,
    resident_memory_bytes,
)
from gradedesign.common.system.processor import usable_cores
from gradedesign.common.system.progress import Listener, counted, ignore
from gradedesign.common.system.scratch import scratch_folder
from gradedesign.common.system.worker import kill_all, start_process
from gradedesign.common.values.key_path import parse_key, with_values
from gradedesign.common.values.problems import Problem, case_error, dotted, problems_of
from gradedesign.common.values.suggest import instead, shown
from gradedesign.common.values.table import Table
from gradedesign.common.values.toml_lines import Key
from gradedesign.common.values.toml_text import toml_text
from gradedesign.common.values.value_types import Name
from gradedesign.design.case.read_case import case_file, read_toml
from gradedesign.design.case.schema import Case
from gradedesign.design.loop.stated_print import stated_print
from gradedesign.design.resolve.choose_law import choose_law
from gradedesign.design.resolve.fitting_part import fitting_part
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.design.resolve.stated_lattice import stated_lattice
from gradedesign.design.verdict.common import library_versions
from gradedesign.design.verdict.result import RunResult, from_json
from gradedesign.design.verdict.result import as_json as result_data
from gradedesign.errors import blaming
from gradedesign.geometry.formats.write_stl import write_stl
from gradedesign.geometry.triangles.boolean import difference
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.commands.layout import say, wrapped
from gradedesign.program.commands.on_dask import Cluster, has_dask, on_dask
from gradedesign.program.commands.plugins import named_cell, registry_for
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.show import print_files, print_json, print_table, print_text
from gradedesign.program.host.registry import build_registry
from gradedesign.program.outputs.files import RESULT_NAME
from gradedesign.program.outputs.finished import finished_result, stored_result
from gradedesign.program.outputs.scene_file import stored_scene, stored_still
from gradedesign.program.pictures.figure import (
    COLOURS,
    GREY,
    empty_figure,
    figure_png,
    save_figure,
)
from gradedesign.program.pictures.page import content_policy, scene_html
from gradedesign.program.store.run_lock import RunLock
from gradedesign.program.store.stages import open_stages

__all__ = [
    "COLOURS", "GREY", "RESULT_NAME", "UNFINISHED", "Case", "Cluster", "Key", "LimitRow",
    "Listener", "Name", "Problem", "ProgressLines", "Registry", "RunLock", "RunResult", "Table",
    "available_memory_bytes", "blaming", "build_registry", "case_error", "case_file", "choose_law",
    "content_key", "content_policy", "counted", "difference", "dotted", "empty_figure",
    "figure_png", "finished_result", "fitting_part", "from_json", "has_dask", "ignore",
    "instead", "is_folder", "kill_all", "library_versions", "lookup", "named_cell", "on_dask",
    "open_stages", "parse_key", "print_files", "print_json", "print_table", "print_text",
    "problems_of", "read_toml", "registry_for", "resident_memory_bytes", "result_data",
    "save_figure", "say", "scene_html", "scratch_folder", "shown", "start_process",
    "stated_lattice", "stated_print", "stored_result", "stored_scene", "stored_still",
    "toml_text", "usable_cores", "with_values", "wrapped", "write_error", "write_stl",
    "write_text",
]  # fmt: skip
