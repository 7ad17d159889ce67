# rollcli: set-up, tests and the sample run. `make help` lists the targets.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.DEFAULT_GOAL := help
.PHONY: help run test lint format types bench fuzz clean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-8s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

$(BIN)/.run: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(BIN)/.dev: $(BIN)/.run
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev,report,cluster]'
	@touch $@

run: $(BIN)/.run  ## install, and estimate the roll of sample_data into out/
	$(BIN)/rollcli estimate sample_data/maps --overwrite -o out/rolls.csv --derotated out/derotated --vdisparity out/vdisparity

test: $(BIN)/.dev  ## run the whole test suite
	$(BIN)/python -m pytest

lint: $(BIN)/.dev  ## ruff: style and format
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(BIN)/.dev  ## mypy, strict
	$(BIN)/mypy

format: $(BIN)/.dev  ## let ruff rewrite the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(BIN)/.dev  ## run every benchmark in tests/benchmarks
	@for b in tests/benchmarks/bench_*.py; do echo "== $$b"; $(BIN)/python $$b || exit 1; done

fuzz: $(BIN)/.dev  ## throw broken files at the readers for a while
	$(BIN)/python -m tests.fuzz

clean:  ## remove what make made
	rm -rf $(VENV) out build *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
