# Needs python3 (3.11 or later) with venv, pip, git and make; everything else goes into .venv.
#
#   make demo    the paper, reproduced: report/index.html
#   make app     the page in a browser: sliders, maps, recordings
#   make quick   a minute of tests, some of every file: before a commit
#   make test    the test suite: before a change goes in
#   make test-long   populations, statistics, every law through every method: before a release
#   make check   style, types, documentation
#   make bench   speed and accuracy against other integrators
#   make docs    docs/_build/html/index.html
#   make lock    resolve requirements/*.txt again (make lock UPGRADE=--upgrade moves the versions)
#   make clean   removes .venv and everything that is built

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Compiling every file of every package takes longer than installing them; most are never imported.
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet install --no-compile
LOCKED := $(PIP) --require-hashes
LOCK := requirements
UPGRADE ?=

.PHONY: demo app quick test test-long check style types bench docs lock clean
.DELETE_ON_ERROR:

demo: $(VENV)/run.stamp
	$(BIN)/asperity reproduce --out report
	@echo "The page with sliders and figures: make app" >&2

app: $(VENV)/app.stamp
	$(BIN)/asperity serve --open

# Tests start many processes, and each would compile the packages again where no bytecode is kept.
quick test test-long: export PYTHONDONTWRITEBYTECODE =
quick test test-long: export PYTHONPYCACHEPREFIX = $(abspath $(VENV))/bytecode

quick: $(VENV)/test.stamp
	$(BIN)/python -m pytest -n 2 -m quick

test: $(VENV)/test.stamp
	$(BIN)/python -m pytest -n 2

test-long: $(VENV)/test.stamp
	$(BIN)/python -m pytest -n 2 -m long

check: style types docs

style: $(VENV)/test.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/test.stamp
	$(BIN)/mypy

bench: $(VENV)/bench.stamp
	$(BIN)/python -m benchmarks

docs: $(VENV)/docs.stamp
	$(BIN)/sphinx-build -q -W --keep-going -b html docs docs/_build/html

# A stamp is newer than the lock it installed, so that nothing is installed twice.
$(VENV)/venv.stamp:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "$(PYTHON) must be Python 3.11 or later; call make with PYTHON=/path/to/python3." >&2; exit 2; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { echo "$(PYTHON) must come with venv and ensurepip; install them (on Debian and Ubuntu: apt install python3-venv)." >&2; exit 2; }
	@echo "Setting up $(VENV), once; this takes about a minute." >&2
	$(PYTHON) -m venv --clear $(VENV)
	@touch $@

# The package itself is installed as editable: a change in src needs no new installation.
$(VENV)/run.stamp: $(LOCK)/run.txt $(LOCK)/build.txt pyproject.toml | $(VENV)/venv.stamp
	$(LOCKED) -r $(LOCK)/run.txt -r $(LOCK)/build.txt
	$(PIP) --no-deps --no-build-isolation --no-index --editable .
	@touch $@

$(VENV)/%.stamp: $(LOCK)/%.txt $(VENV)/run.stamp
	$(LOCKED) -r $<
	@touch $@

# Side by side (make -j 2 check), two installations would write the same files.
$(VENV)/docs.stamp: | $(if $(filter check,$(MAKECMDGOALS)),$(VENV)/test.stamp)

# Each file takes the versions of those before it, so that all fit into one environment.
COMPILE = $(BIN)/uv pip compile --universal --python-version 3.11 --generate-hashes --no-header \
  --no-emit-index-url --no-emit-find-links --no-config --quiet $(UPGRADE)

lock: | $(VENV)/venv.stamp
	$(LOCKED) -r $(LOCK)/lock.txt
	$(COMPILE) pyproject.toml -o $(LOCK)/run.txt
	$(COMPILE) $(LOCK)/build.in -c $(LOCK)/run.txt -o $(LOCK)/build.txt
	$(COMPILE) pyproject.toml --extra test -c $(LOCK)/run.txt -c $(LOCK)/build.txt -o $(LOCK)/test.txt
	$(COMPILE) pyproject.toml --extra app -c $(LOCK)/test.txt -c $(LOCK)/build.txt -o $(LOCK)/app.txt
	$(COMPILE) pyproject.toml --extra docs -c $(LOCK)/test.txt -c $(LOCK)/build.txt -o $(LOCK)/docs.txt
	$(COMPILE) pyproject.toml --extra bench -c $(LOCK)/docs.txt -c $(LOCK)/test.txt -c $(LOCK)/build.txt -o $(LOCK)/bench.txt
	$(COMPILE) $(LOCK)/lock.in -o $(LOCK)/lock.txt

clean:
	rm -rf $(VENV) report docs/_build build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find src tests benchmarks examples docs -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true
