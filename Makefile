# Everything is set up on the first call: a virtual environment in .venv, the package and its tools.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: install validate test test-all lint format docs gallery wheel clean

install: $(VENV)/.ready ## the command `rockcheck` in .venv/bin

validate: $(VENV)/.ready ## run the suite `paper` and write rockcheck-report/index.html
	$(BIN)/rockcheck validate paper

test: $(VENV)/.ready ## the everyday tests
	$(BIN)/python -m pytest -q -m "not slow" -n auto --dist loadfile

test-all: $(VENV)/.ready ## also the slow ones
	$(BIN)/python -m pytest -q

lint: $(VENV)/.ready ## linter, formatter's check, type checker
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	cd build/typed && ../../$(BIN)/lint-imports --config ../../pyproject.toml --no-logo

format: $(VENV)/.ready
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(VENV)/.ready ## the documentation, into site/
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	@echo site/index.html

gallery: $(VENV)/.ready ## the pictures of docs/gallery.md
	$(BIN)/python docs/site_tools/gallery.py

wheel: ## build the wheel, install it into a clean environment, and validate with it outside of the repository
	PYTHON=$(PYTHON) .ci/wheel

clean:
	rm -rf $(VENV) build dist *.egg-info rockcheck-report site

$(VENV)/.ready: pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "rockcheck needs Python 3.11 or newer: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	mkdir -p build/typed/rockcheck # the folders as they are installed, for tools that do not follow the install
	for part in rockcheck/*.py scenes ebm cm engines validation reports; do ln -sfn ../../../$$part build/typed/rockcheck/; done
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test,docs,lint]'
	touch $@
