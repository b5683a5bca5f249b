# Every target does its own set-up in .venv: a machine needs Python 3.11 (or newer, below 3.12) and make, nothing else.
PYTHON ?= $(firstword $(shell command -v python3.11 python3))
BPY ?= 4.5.15
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready-$(BPY)

.PHONY: demo test lint types check slow gui bench validate scenes package clean

$(READY): requirements/test.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet bpy==$(BPY) -r requirements/test.txt
	touch $@

test: $(READY)
	$(BIN)/python -m pytest

slow: $(READY)
	$(BIN)/python -m pytest -m slow

bench: $(READY)
	$(BIN)/python -m pytest -s -m benchmark

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-cache

types: $(READY)
	$(BIN)/mypy

clean:
	rm -rf build $(VENV)
