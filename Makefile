# Everything runs in .venv, made from the hash-pinned lock; the stamp is renewed when the lock changes.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.synced

.PHONY: demo test slow bench lint types docs notebooks lock clean

demo: $(STAMP)
	$(BIN)/drivetwin demo --out out/demo --force

test: $(STAMP)
	$(BIN)/python -m pytest -n 2 --dist loadfile -q -m "not slow" tests

slow: $(STAMP)
	$(BIN)/python -m pytest -n 2 --dist loadfile -q -m slow tests

bench: $(STAMP)
	$(BIN)/python -m tests.benchmarks.run --out out/bench

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/pyright

docs: $(STAMP)
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs out/docs

notebooks: $(STAMP)
	DRIVETWIN_FAST=0 $(BIN)/python -m pytest -q tests/notebooks

$(STAMP): requirements.lock pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet uv
	$(BIN)/uv pip sync --quiet --python $(BIN)/python requirements.lock
	$(BIN)/uv pip install --quiet --python $(BIN)/python --no-deps --no-build-isolation --editable .
	touch $(STAMP)

lock:
	$(BIN)/uv pip compile --quiet --universal --generate-hashes --all-extras --group dev \
		--python-version 3.11 pyproject.toml -o requirements.lock

clean:
	rm -rf $(VENV) out
