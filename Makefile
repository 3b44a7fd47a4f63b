# Everything is set up on the first call: a virtual environment in .venv, the package and its tools.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: validate test test-all lint format clean

validate: $(VENV)/.ready ## run the suite `paper` and write rockcheck-report/index.html
	$(BIN)/rockcheck validate paper

test: $(VENV)/.ready ## the everyday tests
	$(BIN)/python -m pytest -q -m "not slow"

test-all: $(VENV)/.ready ## also the slow ones
	$(BIN)/python -m pytest -q

lint: $(VENV)/.ready ## linter, formatter's check, type checker
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(VENV)/.ready
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf $(VENV) build dist *.egg-info rockcheck-report

$(VENV)/.ready: pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "rockcheck needs Python 3.11 or newer: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test,lint]'
	touch $@
