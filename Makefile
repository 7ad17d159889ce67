# rollcli: set-up, the sample run, tests. `make` alone lists the targets.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
TOUCH := $(BIN)/python -c "import pathlib, sys; pathlib.Path(sys.argv[1]).touch()"
# tests of one file stay in one process: they share what is dear to make
SHARED_OUT := --numprocesses 2 --dist loadfile
REMOVE := $(PYTHON) -c "import glob, os, shutil, sys; [shutil.rmtree(p) if os.path.isdir(p) else os.remove(p) for a in sys.argv[1:] for p in glob.glob(a)]"

.DEFAULT_GOAL := help
.PHONY: help run test test-all lint types format readme bench fuzz clean

help:
	@echo "make run     install into .venv, and estimate the roll of sample_data into out/"
	@echo "make test    run the tests that every change runs"
	@echo "make test-all  and the slow ones: clusters, TLS, browsers, injected faults, long kills, further cases"
	@echo "make lint    ruff: style and format"
	@echo "make types   mypy, strict"
	@echo "make format  let ruff rewrite the code"
	@echo "make readme  write the tables of options in rollcli/cli/README.md, and rollcli/REFERENCE.md"
	@echo "make bench   run every benchmark of tests/benchmarks"
	@echo "make fuzz    throw broken files at the readers, and let every system call of a run fail"
	@echo "make clean   remove all that make made"

$(BIN)/.run: pyproject.toml
	@$(PYTHON) -c "import sys; sys.version_info >= (3, 10) or sys.exit('rollcli needs Python 3.10 or later: make PYTHON=python3.12 ...')"
	@echo "installing rollcli into $(VENV) ..."
	@$(PYTHON) -m venv $(VENV)
	@$(PIP) --editable .
	@$(TOUCH) $@

$(BIN)/.dev: $(BIN)/.run
	@echo "installing what the tests need into $(VENV) ..."
	@$(PIP) 'pip>=25.1'  # older ones know no groups
	@$(PIP) --editable '.[all]' --group dev
	@$(TOUCH) $@

run: $(BIN)/.run
	$(BIN)/rollcli estimate sample_data/maps --overwrite -o out/rolls.csv --derotated out/derotated --vdisparity out/vdisparity

test: $(BIN)/.dev
	$(BIN)/python -m pytest $(SHARED_OUT) -m "not slow"

test-all: $(BIN)/.dev
	$(BIN)/python -m pytest $(SHARED_OUT)

lint: $(BIN)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(BIN)/.dev
	$(BIN)/mypy

format: $(BIN)/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

readme: $(BIN)/.dev
	$(BIN)/python -m tests.readme_tables
	$(BIN)/python -m tests.reference_page

bench: $(BIN)/.dev
	@for each in tests/benchmarks/bench_*.py; do echo "== $$each"; $(BIN)/python $$each || exit 1; done

fuzz: $(BIN)/.dev
	$(BIN)/python -m tests.fuzz
	$(BIN)/python -m tests.fuzz.faults

clean:
	@$(REMOVE) $(VENV) out build dist "*.egg-info" .pytest_cache .mypy_cache .ruff_cache .hypothesis
