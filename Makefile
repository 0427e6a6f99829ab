# Sets up everything in .venv; needs python3 (3.11 to 3.13) with its venv module, and make.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.ready
TESTED := $(VENV)/.ready-to-test
DOCUMENTED := $(VENV)/.ready-to-document
# Brings a library of 390 MB: only installed by who asks for it, and for tests.
LARGE := plugins/gradedesign-step
# Of the others, those that are not wanted, such as the one under the GPL:
# make install WITHOUT=plugins/gradedesign-pymeshlab
WITHOUT :=
PLUGINS := $(filter-out $(LARGE) $(WITHOUT),$(patsubst %/pyproject.toml,%,$(wildcard plugins/*/pyproject.toml)))
PROJECTS := pyproject.toml $(wildcard plugins/*/pyproject.toml)

.PHONY: install run test test-all bench docs pictures
.DEFAULT_GOAL := install

install: $(READY)

# Core and plugins, editable; done again only when a pyproject.toml changes.
$(READY): $(PROJECTS)
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable . $(addprefix --editable ./,$(PLUGINS))
	touch $@

$(TESTED): $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ./$(LARGE)
	touch $@

$(DOCUMENTED): $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	touch $@

run: $(READY)
	$(BIN)/gradedesign run cases/bracket --output runs/bracket --overwrite

# A process for every core, so one thread each for OpenBLAS: more of them spin for a core that another
# process has. Bytecode is kept: the tests start the program some fifty times.
PYTEST := OPENBLAS_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n auto --dist worksteal

test: $(TESTED)
	$(PYTEST)

# Also the slow ones: the whole bracket, and real parts where ../shared/parts exists.
test-all: $(TESTED)
	HYPOTHESIS_PROFILE=explore $(PYTEST) -m "slow or not slow"

bench: $(TESTED)
	for file in benchmarks/bench_*.py; do echo "== $$file"; $(BIN)/python $$file || exit 1; done

# The site of docs/, below build/site; warnings are errors.
docs: $(DOCUMENTED)
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "site: $(CURDIR)/build/site/index.html"

# The pictures of README and cases, from the finished runs below runs/.
pictures: $(READY)
	$(BIN)/python docs/make_pictures.py
