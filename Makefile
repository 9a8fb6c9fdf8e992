# make study      sets up .venv and runs the indoor robot's study into reports/indoor_robot/
# make test       sets up .venv and runs lint, format, types, layers and all tests but the slow ones
# make test-all   the same with the slow tests: whole studies, renders, sweeps and notebooks
# make setup      sets up .venv only (.venv/bin/designer is the command afterwards)
# make reference  writes docs/requirement_reference.md again (after changing a key of the requirement)
# make validation writes docs/validation.md again: our numbers beside those of others
# make lock       resolves the dependencies again (after editing pyproject.toml)

PYTHON ?= python3
REQUIREMENT ?= configs/indoor_robot.toml
BIN := .venv/bin
SHELL := /bin/bash

.PHONY: setup study test test-all checks reference validation lock clean

setup: .venv/.installed

study: .venv/.installed
	$(BIN)/designer study $(REQUIREMENT)

test: checks
	$(BIN)/pytest -n 2 -m "not slow"

test-all: checks
	$(BIN)/pytest -n 2

checks: .venv/.installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

reference: .venv/.installed
	$(BIN)/python -m designer.requirement.reference > docs/requirement_reference.md

validation: .venv/.installed
	$(BIN)/python -m validation

lock: .venv/.uv
	$(BIN)/uv pip compile --quiet --upgrade --universal --generate-hashes --all-extras --no-header \
	    pyproject.toml --output-file requirements.lock
	echo uv | $(BIN)/uv pip compile --quiet --upgrade --universal --generate-hashes --no-header --no-annotate \
	    - --output-file requirements-uv.lock

clean:
	rm -rf .venv

# Every version and its hash is locked, the installer and the build backend included. Should uv not reach the package
# index that pip is configured for, pip installs the same lock itself, only more slowly. Compiled once, the libraries are
# not compiled again by every process where Python may not write beside them.
.venv/.installed: .venv/.uv requirements.lock pyproject.toml
	index="$${PIP_INDEX_URL:-$$($(BIN)/pip config get global.index-url 2>/dev/null || true)}"; \
	if [ -n "$$index" ]; then export UV_DEFAULT_INDEX="$${UV_DEFAULT_INDEX:-$$index}"; fi; \
	$(BIN)/uv pip install --quiet --compile-bytecode --python $(BIN)/python --require-hashes --requirement requirements.lock \
	    || $(BIN)/pip install --quiet --require-hashes --requirement requirements.lock
	$(BIN)/uv pip install --quiet --python $(BIN)/python --no-deps --no-build-isolation --editable .
	touch $@

.venv/.uv: requirements-uv.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or later is needed: make PYTHON=...")'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --require-hashes --requirement requirements-uv.lock
	touch $@
