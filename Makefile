# Everything is set up on the first call: a virtual environment in .venv, the package and its tools.
# Python 3.11 where there is one: PyBullet has wheels for no newer one.
PYTHON ?= $(shell for p in python3.11 python3; do $$p -c "" 2>/dev/null && echo $$p && break; done)
# In CI everything comes from the lock file, by hash; UNLOCKED=1 takes the newest that pyproject.toml allows.
LOCKED := $(if $(UNLOCKED),,$(CI))
LOCK := .ci/requirements.txt
VENV := .venv
BIN := $(VENV)/bin
# What installs: the machine's uv, or one that pip fetches into the virtual environment. That of an active .venv goes as it is made anew.
UV := $(filter-out $(abspath $(BIN))/%,$(shell command -v uv 2>/dev/null))
INSTALL := $(or $(UV),$(BIN)/uv) pip install --quiet --python $(BIN)/python $(if $(PYTHONDONTWRITEBYTECODE),--compile-bytecode)

.PHONY: help install validate test test-change test-all nightly coverage mutation lint format docs gallery wheel lock clean

install: $(VENV)/.warm ## the command `rockcheck` in .venv/bin

validate: $(VENV)/.ready ## run the suite `paper` and write rockcheck-report/index.html
	$(BIN)/rockcheck validate paper

help: ## what `make` can do
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-12s %s\n", $$1, $$2 }' Makefile

test: $(VENV)/.warm ## the everyday tests: 5 to 10 minutes on two cores
	$(BIN)/python -m pytest -q -m "not slow and not long" -n auto --dist loadfile

test-change: $(VENV)/.warm ## also the long ones: what must pass before a change lands
	$(BIN)/python -m pytest -q -m "not slow" -n auto --dist loadfile

test-all: $(VENV)/.warm ## also the slow ones
	$(BIN)/python -m pytest -q

nightly: $(VENV)/.warm ## what is too long for each change; NIGHTLY_QUICK=1 for a short form; the results go to docs/nightly.json
	$(INSTALL) --editable '.[audit,fuzz,engines]'
	$(BIN)/python .ci/nightly.py

# The core is compiled, and its lines are then not seen: the second run interprets it, on fewer tests.
INTERPRETED := tests/ebm/core/test_series.py tests/ebm/core/test_guards.py tests/ebm/core/test_selection.py tests/ebm/core/test_impact_laws.py tests/ebm/test_edges.py tests/ebm/core/test_rare_scenes.py::test_it_runs_and_contacts_hold \
	tests/cm/test_contact.py
coverage: $(VENV)/.warm ## branch coverage, and the lines that no test runs; slow
	mkdir -p build/coverage
	$(BIN)/coverage erase
	-$(BIN)/coverage run -m pytest -q -m "not slow" -n auto --dist loadfile # a test that fails is told; the report is made all the same
	NUMBA_DISABLE_JIT=1 $(BIN)/coverage run -m pytest -q -m "not slow and not browser" $(INTERPRETED)
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report --sort=cover --skip-covered --show-missing --fail-under=90

mutation: $(VENV)/.warm ## small faults planted in a sample of places: which ones no test notices
	$(BIN)/python tests/mutation.py

# What people read is spelt and worded: .ci/proselint.json says which rules bite.
PROSE := README.md CONTRIBUTING.md CHANGELOG.md SECURITY.md $(wildcard docs/*.md)
# Where no function is harder to follow than pyproject.toml allows.
COGNITIVE := rockcheck scenes ebm cm engines validation reports docs
lint: $(VENV)/.ready ## linter, formatter's check, type checker, cognitive complexity, spelling and wording
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	$(BIN)/complexipy --failed $(COGNITIVE)
	$(BIN)/codespell $(PROSE) rockcheck docs/site_tools
	$(BIN)/proselint check --config .ci/proselint.json $(PROSE)

format: $(VENV)/.ready ## mend what the linter can
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(VENV)/.ready ## the documentation, into site/
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	@echo site/index.html

gallery: $(VENV)/.ready ## the pictures of docs/gallery.md
	$(BIN)/python docs/site_tools/gallery.py

wheel: ## build the wheel, install it into a clean environment, and validate with it outside of the repository
	PYTHON=$(PYTHON) .ci/wheel

lock: $(VENV)/.ready ## the lock file anew, from what pyproject.toml allows today
	echo 'setuptools>=77' | $(or $(UV),$(BIN)/uv) pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes --no-annotate \
		--no-emit-index-url --no-header --extra test --extra docs --extra lint --output-file $(LOCK) pyproject.toml -

clean: ## remove all that was made
	rm -rf $(VENV) build dist *.egg-info rockcheck-report site

# Where Python may write no compiled files, as in many containers, each command would compile all sources again: they are compiled once.
$(VENV)/.ready: pyproject.toml $(if $(LOCKED),$(LOCK))
	$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "rockcheck needs Python 3.11 or newer: make PYTHON=python3.12")'
	@$(PYTHON) -c 'import sys; v = sys.version_info; print("Python", ".".join(map(str, v[:3])), "from $(PYTHON)" + ("" if v < (3, 12) else "; PyBullet has wheels for Python 3.11 only and is left out here (make PYTHON=python3.11)"))'
	@test -d rockcheck/scenes || { echo "rockcheck/scenes is no link to scenes/: git config core.symlinks true, then check out again"; exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	$(if $(UV),,$(BIN)/python -m pip install --quiet --disable-pip-version-check uv)
	$(if $(LOCKED),$(INSTALL) --require-hashes --requirement $(LOCK))
	$(INSTALL) $(if $(LOCKED),--no-deps --no-build-isolation --editable .,--editable '.[test,docs,lint]')
	$(if $(PYTHONDONTWRITEBYTECODE),$(BIN)/python -m compileall -q $(COGNITIVE))
	touch $@

# `make validate` does without: it compiles what it plays, and plays the engines meanwhile.
$(VENV)/.warm: $(VENV)/.ready
	$(BIN)/rockcheck warm
	touch $@
