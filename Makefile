# `make demo` runs the main job, `make test` runs lint, types and the tests, and `make test-all` runs
# these and the exhaustive tests, which take minutes more. Each makes its own virtual environment
# first; it needs Python >= 3.10 and a package index.

PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11 python3.10 python; do \
	"$$p" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2])' 2>/dev/null && echo "$$p" && break; done)
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
INSTALL := $(PIP) install --quiet --constraint constraints.txt --no-build-isolation
# Tests are spread over the processors there are; `make test JOBS=0` runs them in one process.
JOBS ?= auto
# The tests start Python a hundred times: what it compiles is kept, whatever the environment says.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo test test-all lint types suite exhaustive docs figures pictures placement clean

# The demo draws nothing, reads no meshes but STL and chooses no times: it needs only these.
DEMO := numpy lazy_loader pin eigenpy 'example-robot-data>=5.0,<6' pydantic PyYAML click rich

demo: $(VENV)/demo
	$(BIN)/knotwork plan scenarios/ur5_deburring.yaml

test: lint types suite

test-all: test exhaustive

lint: $(VENV)/dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check

types: $(VENV)/dev
	$(BIN)/mypy

suite: $(VENV)/dev
	$(BIN)/pytest --numprocesses $(JOBS) --dist worksteal -m "not exhaustive"

exhaustive: $(VENV)/dev
	$(BIN)/pytest --numprocesses $(JOBS) --dist worksteal -m "exhaustive or hypothesis" --hypothesis-profile exhaustive

# The exhaustive tests build the documentation too; this puts it where it can be read: build/docs/index.html.
docs: $(VENV)/dev
	@$(BIN)/python -c 'import sphinx' || { echo "the documentation needs Python 3.11 or newer" >&2; exit 2; }
	$(BIN)/python -m sphinx --fail-on-warning --nitpicky --keep-going --fresh-env --quiet -D live_pages=1 docs build/docs

# The page on planners and figures of the benchmarks, from benchmarks/results.
figures: $(VENV)/dev
	$(BIN)/python benchmarks/pages.py

# Pictures of scenes: the README's, which moves, and the gallery's. Needs Chromium.
pictures: $(VENV)/dev
	$(BIN)/python docs/scene_pictures.py

# Plans 1,476 scenarios, which takes minutes; started again, it goes on where it was.
placement: $(VENV)/dev
	$(BIN)/python examples/placement_study.py build/placement
	cp build/placement/placement.svg docs/placement.svg

$(VENV)/base: constraints.txt pyproject.toml
	@test -n "$(PYTHON)" || { echo "Python 3.10 or newer is needed; set PYTHON=/path/to/python3" >&2; exit 2; }
	@echo "setting up $(VENV) with $(PYTHON); the first time this downloads about 236 MB (133 MB of them models of robots), for the tests about 660 MB"
	"$(PYTHON)" -m venv --clear $(VENV)
	$(PIP) install --quiet --constraint constraints.txt hatchling editables
	@touch $@

$(VENV)/demo: $(VENV)/base
	$(INSTALL) $(DEMO)
	$(INSTALL) --no-deps --editable .
	@touch $@

$(VENV)/run: $(VENV)/demo
	$(INSTALL) --editable .
	@touch $@

$(VENV)/dev: $(VENV)/run
	$(INSTALL) --editable '.[dev,docs]'
	@touch $@

clean:
	rm -rf $(VENV) build dist out .mypy_cache .pytest_cache .ruff_cache .hypothesis
