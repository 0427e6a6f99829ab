"""The order of all tests, of the core and of every plugin, and how hypothesis chooses examples."""

import gc
import os
from pathlib import Path

import hypothesis

ROOT = Path(__file__).parent

#: Folders of tests that come first. A worker takes a half of the list: one compiles the kernels of
#: these, the other, after the many short tests that stand directly in tests/, those of whole runs.
#: In the order of the alphabet both need the same kernels at the same time and compile them twice.
FIRST = ("plugins", "tests/verification", "tests")

# The same examples in every run, so that a change is to blame for a failure. `make test-all`, or
# HYPOTHESIS_PROFILE=explore, looks for new ones.
hypothesis.settings.register_profile("repeatable", derandomize=True)
hypothesis.settings.register_profile("explore", print_blob=True)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))


def pytest_collection_modifyitems(items):
    """Sort by folder, each as it was within."""
    items.sort(key=lambda item: rank(item.path))


def rank(path):
    """Place of the folder of a file of tests in `FIRST`, or after all of them."""
    folder = path.relative_to(ROOT).parent
    name = "plugins" if folder.parts[0] == "plugins" else folder.as_posix()
    return FIRST.index(name) if name in FIRST else len(FIRST)


def pytest_collection_finish():
    """Look for garbage seldom, and never among what was imported: compiling makes many objects."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)
