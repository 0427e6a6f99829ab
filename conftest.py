"""How hypothesis chooses its examples, for the tests of the core and of every plugin."""

import os

import hypothesis

# As the command does: several processes of several threads share the cores here.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

# The same examples in every run, so that a change is to blame for a failure. `make test-all`, or
# HYPOTHESIS_PROFILE=explore, looks for new ones.
hypothesis.settings.register_profile("repeatable", derandomize=True)
hypothesis.settings.register_profile("explore", print_blob=True)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))
