"""Names for the commands of plugins: reading cases, running them, printing, folders, processes."""

from __future__ import annotations

from gradedesign.case.key_path import parse_key, with_values
from gradedesign.case.problems import Problem, case_error, dotted, problems_of
from gradedesign.case.read_case import case_file, read_toml
from gradedesign.case.schema import Case
from gradedesign.case.suggest import instead, shown
from gradedesign.case.table import Table
from gradedesign.case.toml_lines import Key
from gradedesign.case.toml_text import toml_text
from gradedesign.case.value_types import Name
from gradedesign.cli.layout import say, wrapped
from gradedesign.cli.named_cell import named_cell
from gradedesign.cli.on_dask import Cluster, has_dask, on_dask
from gradedesign.cli.plugins import registry_for
from gradedesign.cli.progress_lines import ProgressLines
from gradedesign.cli.show import print_files, print_json, print_table, print_text
from gradedesign.errors import blaming
from gradedesign.limits.row import LimitRow
from gradedesign.loop.stages import open_stages
from gradedesign.output.figure import COLOURS, GREY, empty_figure, save_figure
from gradedesign.output.result import RunResult, from_json
from gradedesign.plugin.registry import build_registry
from gradedesign.resolve.registry import Registry, lookup
from gradedesign.results.common import library_versions
from gradedesign.results.files import RESULT_NAME
from gradedesign.results.finished import finished_result
from gradedesign.workspace.atomic import UNFINISHED, is_folder, write_error, write_text
from gradedesign.workspace.processor import usable_cores
from gradedesign.workspace.progress import counted
from gradedesign.workspace.run_lock import RunLock

__all__ = [
    "COLOURS",
    "GREY",
    "RESULT_NAME",
    "UNFINISHED",
    "Case",
    "Cluster",
    "Key",
    "LimitRow",
    "Name",
    "Problem",
    "ProgressLines",
    "Registry",
    "RunLock",
    "RunResult",
    "Table",
    "blaming",
    "build_registry",
    "case_error",
    "case_file",
    "counted",
    "dotted",
    "empty_figure",
    "finished_result",
    "from_json",
    "has_dask",
    "instead",
    "is_folder",
    "library_versions",
    "lookup",
    "named_cell",
    "on_dask",
    "open_stages",
    "parse_key",
    "print_files",
    "print_json",
    "print_table",
    "print_text",
    "problems_of",
    "read_toml",
    "registry_for",
    "save_figure",
    "say",
    "shown",
    "toml_text",
    "usable_cores",
    "with_values",
    "wrapped",
    "write_error",
    "write_text",
]
